//! Finds the frames on a serial line, byte by byte, in bounded memory and bounded time for each byte.
//!
//! ```text
//!            byte > 0: code        bytes of the group
//!  zero -> [between groups] <-----------------------> [in a group]
//!              | zero                                     | zero
//!              v                                          v
//!         checked: Frame, Cut or Corrupted               Cut
//! ```
//!
//! A frame that is longer than the buffer is read to its end and reported. After any input the receiver is synchronised
//! again at the next zero byte.

use super::frame::{HEADER, Header, OVERHEAD};
use crate::blob::crc::crc32c;

/// What is wrong with the bytes between two zeros.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum Damage {
    /// It ends before it should: bytes are missing. (A cut between two COBS groups looks like corruption.)
    Cut,
    /// The checksum does not agree: bytes were changed, or two frames were joined.
    Corrupted,
    /// It is longer than the buffer.
    Overlong,
}

/// A frame that has arrived whole.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Received<'a> {
    /// The header.
    pub header: Header,
    /// The message, in postcard.
    pub message: &'a [u8],
}

/// Reads a line byte by byte and returns the frames on it. `N` is the length of the longest frame before COBS, in bytes.
#[derive(Debug, Clone)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Receiver<const N: usize> {
    bytes: [u8; N],
    length: u16,
    /// Bytes of the current group that are still to come.
    left: u8,
    /// A zero follows the current group's bytes if another group follows.
    zero: bool,
    /// A byte of the frame has arrived.
    begun: bool,
    overlong: bool,
}

impl<const N: usize> Receiver<N> {
    /// A receiver at the beginning of a line.
    pub const fn new() -> Self {
        const { assert!(N <= u16::MAX as usize, "a receiver's buffer is at most 65,535 bytes") };
        Self { bytes: [0; N], length: 0, left: 0, zero: false, begun: false, overlong: false }
    }

    /// Takes the next byte of the line. Returns a frame or its damage at the end of a frame, otherwise `None`. The frame
    /// stays valid until the next byte.
    #[inline]
    pub fn receive(&mut self, byte: u8) -> Option<Result<Received<'_>, Damage>> {
        if byte == 0 {
            return self.end();
        }
        self.begun = true;
        if let Some(left) = self.left.checked_sub(1) {
            self.left = left;
            self.put(byte);
        } else {
            if self.zero {
                self.put(0);
            }
            self.left = byte - 1;
            self.zero = byte != u8::MAX;
        }
        None
    }

    fn put(&mut self, byte: u8) {
        match self.bytes.get_mut(usize::from(self.length)) {
            Some(slot) => {
                *slot = byte;
                self.length += 1;
            }
            None => self.overlong = true,
        }
    }

    fn end(&mut self) -> Option<Result<Received<'_>, Damage>> {
        let (begun, cut, overlong) = (self.begun, self.left > 0, self.overlong);
        let length = usize::from(self.length);
        (self.length, self.left, self.zero, self.begun, self.overlong) = (0, 0, false, false, false);
        if !begun {
            // There may be several zeros between frames.
            return None;
        }
        if overlong {
            return Some(Err(Damage::Overlong));
        }
        if cut || length < OVERHEAD {
            return Some(Err(Damage::Cut));
        }
        Some(self.bytes.get(..length).and_then(checked).ok_or(Damage::Corrupted))
    }
}

fn checked(bytes: &[u8]) -> Option<Received<'_>> {
    let (content, crc) = bytes.split_last_chunk::<4>()?;
    if crc32c(&[content]) != u32::from_le_bytes(*crc) {
        return None;
    }
    let (header, message) = content.split_first_chunk::<HEADER>()?;
    Some(Received { header: Header::of(*header)?, message })
}

impl<const N: usize> Default for Receiver<N> {
    fn default() -> Self {
        Self::new()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::link::Frame;

    /// Sequence number and message, or what is wrong.
    type Event = Result<(u16, Vec<u8>), Damage>;

    /// All that comes out for these bytes: the length of each message, or its damage.
    fn feed(receiver: &mut Receiver<64>, bytes: &[u8]) -> Vec<Event> {
        let mut all = vec![];
        for &byte in bytes {
            if let Some(event) = receiver.receive(byte) {
                all.push(event.map(|r| (r.header.sequence, r.message.to_vec())));
            }
        }
        all
    }

    fn framed(sequence: u16, message: &[u8; 5]) -> Vec<u8> {
        Frame::<64>::new().write(Header::request(sequence, 0), message).expect("it fits").to_vec()
    }

    #[test]
    fn tells_whole_frames_from_broken_ones_and_is_synchronised_again() {
        let (a, b) = (framed(1, b"first"), framed(2, b"\0nd\0\0"));
        let good = |n: u16| Ok(if n == 1 { (1, b"first".to_vec()) } else { (2, b"\0nd\0\0".to_vec()) });
        let whole = a.len();
        let flipped = |at: usize, to: u8| {
            let mut bytes = a.clone();
            bytes[at] = to;
            bytes
        };
        let cases: [(&str, Vec<u8>, Vec<Event>); 10] = [
            ("clean", [a.clone(), b.clone()].concat(), vec![good(1), good(2)]),
            ("starts in the middle", [&a[9..], &b[..]].concat(), vec![Err(Damage::Cut), good(2)]),
            ("cut at the end", [&a[..whole - 8], &b[..]].concat(), vec![Err(Damage::Cut), good(2)]),
            ("only the last zero lost", [&a[..whole - 1], &b[..]].concat(), vec![good(1), good(2)]),
            ("one byte lost", [&a[..6], &a[7..], &b[..]].concat(), vec![Err(Damage::Cut), good(2)]),
            ("one byte doubled", [&a[..6], &a[5..], &b[..]].concat(), vec![Err(Damage::Cut), good(2)]),
            ("a byte changed", [flipped(9, 0x55), b.clone()].concat(), vec![Err(Damage::Corrupted), good(2)]),
            (
                "a zero within",
                [flipped(9, 0), b.clone()].concat(),
                vec![Err(Damage::Cut), Err(Damage::Cut), good(2)],
            ),
            ("doubled", [a.clone(), a.clone(), b.clone()].concat(), vec![good(1), good(1), good(2)]),
            (
                "noise of a hundred bytes",
                [&[0x7f; 100][..], &b[..]].concat(),
                vec![Err(Damage::Overlong), good(2)],
            ),
        ];
        for (name, bytes, expected) in cases {
            assert_eq!(feed(&mut Receiver::new(), &bytes), expected, "{name}");
        }
    }

    #[test]
    fn unstuffs_what_others_stuff() {
        for length in [1, 2, 245, 246, 247, 254, 255, 508, 520] {
            for every in [usize::MAX, 1, 2, 7, 100] {
                let byte = |i: usize| if i % every == every - 1 { 0 } else { 1 + (i % 255) as u8 };
                let message: Vec<u8> = (0..length).map(byte).collect();
                let mut raw = [&Header::request(9, 0).bytes()[..], &message].concat();
                raw.extend(crc32c(&[&raw]).to_le_bytes());
                let mut receiver = Receiver::<600>::new();
                let mut event = None;
                for byte in [cobs::encode_vec(&raw), vec![0]].concat() {
                    event = receiver.receive(byte).map(|frame| frame.map(|r| r.message.to_vec()));
                }
                assert_eq!(event, Some(Ok(message)), "{length} bytes, a zero every {every}");
            }
        }
    }

    #[test]
    fn every_changed_byte_is_noticed() {
        let bytes = framed(7, b"notic");
        for at in 0..bytes.len() {
            for flip in 1..=255u8 {
                let mut changed = bytes.clone();
                changed[at] ^= flip;
                // The zeros at the ends may come and go; what is between them is never taken for another.
                for frame in feed(&mut Receiver::new(), &changed).into_iter().flatten() {
                    assert_eq!(frame, (7, b"notic".to_vec()), "byte {at} flipped by {flip:#x}");
                }
            }
        }
    }
}
