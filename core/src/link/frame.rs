//! Writes messages as frames: header, postcard, checksum and COBS in one pass over one buffer.

use postcard::ser_flavors::Flavor;
use serde::Serialize;

use super::{HINGE_BYTES, MAX_STAGES};
use crate::{blob::crc::Crc32c, methods::weights::MAX_KEPT};

/// Version of the protocol, 1 to 15. Another version's frames are answered with [`Fault::Version`](super::Fault).
pub const VERSION: u8 = 1;
/// Bytes of a frame's header.
pub const HEADER: usize = 4;
/// Bytes of a frame that are not its message, before COBS: header and checksum.
pub const OVERHEAD: usize = HEADER + 4;

/// Direction of a frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Direction {
    /// From the host to the board.
    Request,
    /// From the board to the host.
    Reply,
}

/// The header of a frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Header {
    /// Version of the protocol; [`VERSION`] in frames of this one.
    pub version: u8,
    /// Direction of the frame.
    pub direction: Direction,
    /// How often the request was sent before. A reply has that of the request that was carried out: of one that was sent
    /// again, an earlier one.
    pub attempt: u8,
    /// Number of the request, one more than that of the last; a reply repeats that of its request.
    pub sequence: u16,
}

impl Header {
    /// Header of a request.
    pub const fn request(sequence: u16, attempt: u8) -> Self {
        Self { version: VERSION, direction: Direction::Request, attempt, sequence }
    }

    /// Header of the reply to this request.
    pub const fn reply(self) -> Self {
        Self { version: VERSION, direction: Direction::Reply, ..self }
    }

    pub(super) const fn bytes(self) -> [u8; HEADER] {
        let direction = match self.direction {
            Direction::Request => 0,
            Direction::Reply => 1,
        };
        let [low, high] = self.sequence.to_le_bytes();
        [self.version << 4 | direction, self.attempt, low, high]
    }

    /// The header in these bytes; `None` if the direction is invalid.
    pub(super) const fn of([first, attempt, low, high]: [u8; HEADER]) -> Option<Self> {
        let direction = match first & 15 {
            0 => Direction::Request,
            1 => Direction::Reply,
            _ => return None,
        };
        Some(Self { version: first >> 4, direction, attempt, sequence: u16::from_le_bytes([low, high]) })
    }
}

/// Bytes that a [`Server`](super::Server) needs in each of its buffers for poses with that many joints: enough for the
/// framed reply to a pose and for any other message, including those of a robot of up to 40 hinges. A board with more
/// hinges needs at least [`robot_buffer_length`].
pub const fn buffer_length(joints: usize) -> usize {
    // Zero, postcard of the pose and of a report with every class and stage, overhead, zero.
    let pose = 1 + 12 + 2 + 16 * joints;
    let report = 3 * 4 + 2 * 5 + 1 + 5 + 1 + MAX_KEPT * 7 + 1 + MAX_STAGES * 5;
    let raw = OVERHEAD + pose + report;
    let framed = raw + raw / 254 + 1 + 2;
    let robot = robot_buffer_length(40);
    if framed < robot { robot } else { framed }
}

/// Bytes that the replies of a robot of that many hinges need: 6 for each hinge, and 48.
pub const fn robot_buffer_length(hinges: usize) -> usize {
    HINGE_BYTES * hinges + 48
}

/// The message does not fit the frame's buffer.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Full;

/// A framed message, ready to be sent, in a buffer of `N` bytes.
#[derive(Debug, Clone)]
pub struct Frame<const N: usize> {
    bytes: [u8; N],
    length: u16,
}

/// Its bytes, as they go over the line.
#[cfg(feature = "defmt")]
impl<const N: usize> defmt::Format for Frame<N> {
    fn format(&self, f: defmt::Formatter<'_>) {
        defmt::write!(f, "{=[u8]:#04x}", self.bytes());
    }
}

impl<const N: usize> Frame<N> {
    /// No message.
    pub const fn new() -> Self {
        const { assert!(N <= u16::MAX as usize, "a frame's buffer is at most 65,535 bytes") };
        Self { bytes: [0; N], length: 0 }
    }

    /// Replaces the frame's message.
    ///
    /// # Errors
    /// [`Full`] if it does not fit; the frame is then empty.
    pub fn write(&mut self, header: Header, message: &impl Serialize) -> Result<&[u8], Full> {
        self.length = 0;
        self.length = self.try_write(header, message).map_err(|_| Full)?;
        Ok(self.bytes())
    }

    /// The bytes to send; empty before the first message.
    pub fn bytes(&self) -> &[u8] {
        self.bytes.get(..usize::from(self.length)).unwrap_or(&[])
    }

    fn try_write(&mut self, header: Header, message: &impl Serialize) -> postcard::Result<u16> {
        let mut serializer = postcard::Serializer { output: Stuffer::new(&mut self.bytes)? };
        serializer.output.try_extend(&header.bytes())?;
        message.serialize(&mut serializer)?;
        let mut stuffer = serializer.output;
        let crc = stuffer.crc.value();
        stuffer.try_extend(&crc.to_le_bytes())?;
        stuffer.finalize()
    }
}

impl<const N: usize> Default for Frame<N> {
    fn default() -> Self {
        Self::new()
    }
}

/// COBS encoder and checksum of the bytes that are serialised.
struct Stuffer<'a> {
    bytes: &'a mut [u8],
    /// Index of the next byte.
    at: usize,
    /// Index of the current group's length, which is written when the group ends.
    code_at: usize,
    /// Length of the current group with its code.
    code: u8,
    crc: Crc32c,
}

impl<'a> Stuffer<'a> {
    fn new(bytes: &'a mut [u8]) -> postcard::Result<Self> {
        let mut stuffer = Self { bytes, at: 0, code_at: 1, code: 1, crc: Crc32c::new() };
        // The leading zero ends any incomplete frame before.
        stuffer.put(0)?;
        stuffer.put(0)?;
        Ok(stuffer)
    }

    fn put(&mut self, byte: u8) -> postcard::Result<()> {
        *self.bytes.get_mut(self.at).ok_or(postcard::Error::SerializeBufferFull)? = byte;
        self.at += 1;
        Ok(())
    }

    /// Ends the current group and starts a new one.
    fn group(&mut self) -> postcard::Result<()> {
        self.close();
        (self.code_at, self.code) = (self.at, 1);
        self.put(0)
    }

    fn close(&mut self) {
        if let Some(slot) = self.bytes.get_mut(self.code_at) {
            *slot = self.code;
        }
    }
}

impl Flavor for Stuffer<'_> {
    /// Bytes used.
    type Output = u16;

    fn try_push(&mut self, byte: u8) -> postcard::Result<()> {
        self.crc.add(byte);
        // No zero follows a full group. It ends only when another byte comes.
        if self.code == u8::MAX {
            self.group()?;
        }
        if byte == 0 {
            return self.group();
        }
        self.put(byte)?;
        self.code += 1;
        Ok(())
    }

    fn finalize(mut self) -> postcard::Result<u16> {
        self.close();
        self.put(0)?;
        u16::try_from(self.at).map_err(|_| postcard::Error::SerializeBufferFull)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn headers_go_both_ways() {
        for (sequence, attempt) in [(0, 0), (0x1234, 7), (u16::MAX, u8::MAX)] {
            let request = Header::request(sequence, attempt);
            assert_eq!(Header::of(request.bytes()), Some(request));
            assert_eq!(Header::of(request.reply().bytes()), Some(request.reply()));
        }
        assert_eq!(Header::request(0x1234, 7).bytes(), [0x10, 7, 0x34, 0x12]);
        assert_eq!(Header::of([0x12, 0, 0, 0]), None);
    }

    #[test]
    fn stuffs_what_others_unstuff() {
        // Lengths around the full group, with zeros nowhere, at the ends and all over.
        for length in [0, 1, 2, 244, 245, 246, 247, 248, 249, 253, 254, 255, 500, 508, 509] {
            for every in [usize::MAX, 1, 2, 7, 100] {
                let byte = |i: usize| if i % every == every - 1 { 0 } else { 1 + (i % 255) as u8 };
                let message: Vec<u8> = (0..length).map(byte).collect();
                let header = Header::request(0x0102, 3);
                let mut raw = [&header.bytes()[..], &message].concat();
                raw.extend(crate::blob::crc::crc32c(&[&raw]).to_le_bytes());

                let mut frame = Frame::<700>::new();
                let bytes = frame.write(header, &Bytes(&message)).expect("it fits");
                let inside = &bytes[1..bytes.len() - 1];
                assert_eq!((bytes[0], bytes[bytes.len() - 1]), (0, 0));
                assert!(inside.iter().all(|&b| b != 0));
                assert!(inside.len() <= raw.len() + 1 + raw.len() / 254);
                assert_eq!(cobs::decode_vec(inside), Ok(raw), "{length} bytes, a zero every {every}");
            }
        }
    }

    struct Bytes<'a>(&'a [u8]);

    impl Serialize for Bytes<'_> {
        fn serialize<S: serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
            use serde::ser::SerializeTuple;
            let mut tuple = serializer.serialize_tuple(self.0.len())?;
            for byte in self.0 {
                tuple.serialize_element(byte)?;
            }
            tuple.end()
        }
    }

    #[test]
    fn says_where_a_message_does_not_fit() {
        let mut frame = Frame::<16>::new();
        assert!(frame.write(Header::request(0, 0), &[1u8, 2, 3]).is_ok());
        assert_eq!(frame.write(Header::request(0, 0), &[7u8; 32]), Err(Full));
        assert!(frame.bytes().is_empty());
        assert_eq!(Frame::<0>::new().write(Header::request(0, 0), &()), Err(Full));
    }
}
