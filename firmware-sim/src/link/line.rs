//! Lines: the transports that carry the link's bytes.

use std::{
    io::{self, Read, Write},
    net::TcpStream,
    num::NonZero,
    ops::DerefMut,
    sync::mpsc::{self, Receiver, RecvTimeoutError},
    time::{Duration, Instant},
};

use thiserror::Error;

/// Default baud rate of a serial port.
pub const BAUD: u32 = 921_600;
/// Read timeout of a serial port; the reading thread then tries again.
const POLL: Duration = Duration::from_millis(100);
/// Bytes of a read.
const READ: usize = 4096;
/// Reads that wait to be received. A peer that sends more than is received has to wait: a socket stops it, and a serial
/// port loses bytes, which the link repeats.
const WAITING: usize = 64;

/// A line of bytes in both directions, with a clock.
pub trait Line {
    /// Sends all of the bytes.
    ///
    /// # Errors
    /// The line failed or was closed.
    fn send(&mut self, bytes: &[u8]) -> io::Result<()>;

    /// Receives at least one byte and returns how many, or 0 if none came within that time.
    ///
    /// # Errors
    /// The line failed or was closed.
    fn receive(&mut self, into: &mut [u8], within: Duration) -> io::Result<usize>;

    /// The line's clock, from an arbitrary start. A simulated line has a virtual one.
    fn now(&self) -> Duration;
}

/// A line made of a reader and a writer. A thread does the reading, so that any reader gets a time limit.
pub struct Piped<W> {
    writer: W,
    reader: Receiver<io::Result<Vec<u8>>>,
    /// Bytes read and not yet returned.
    left: Vec<u8>,
    start: Instant,
}

impl<W: Write> Piped<W> {
    /// Joins the two halves of a line.
    pub fn new(mut reader: impl Read + Send + 'static, writer: W) -> Self {
        let (sender, receiver) = mpsc::sync_channel(WAITING);
        std::thread::spawn(move || {
            let mut buffer = [0; READ];
            loop {
                let read = match reader.read(&mut buffer) {
                    Ok(0) => {
                        Err(io::Error::new(io::ErrorKind::UnexpectedEof, "the other end has closed the line"))
                    }
                    Ok(count) => Ok(buffer[..count].to_vec()),
                    Err(e) if is_pending(&e) => continue,
                    Err(e) => Err(e),
                };
                let last = read.is_err();
                if sender.send(read).is_err() || last {
                    return;
                }
            }
        });
        Self { writer, reader: receiver, left: Vec::new(), start: Instant::now() }
    }
}

/// True if the error only means that nothing has come yet.
fn is_pending(error: &io::Error) -> bool {
    matches!(error.kind(), io::ErrorKind::TimedOut | io::ErrorKind::WouldBlock | io::ErrorKind::Interrupted)
}

impl<W: Write> Line for Piped<W> {
    fn send(&mut self, bytes: &[u8]) -> io::Result<()> {
        self.writer.write_all(bytes)?;
        self.writer.flush()
    }

    fn receive(&mut self, into: &mut [u8], within: Duration) -> io::Result<usize> {
        if self.left.is_empty() {
            self.left = match self.reader.recv_timeout(within) {
                Ok(read) => read?,
                Err(RecvTimeoutError::Timeout) => return Ok(0),
                Err(RecvTimeoutError::Disconnected) => {
                    return Err(io::Error::new(io::ErrorKind::UnexpectedEof, "the line is closed"));
                }
            };
        }
        let count = into.len().min(self.left.len());
        for (slot, byte) in into.iter_mut().zip(self.left.drain(..count)) {
            *slot = byte;
        }
        Ok(count)
    }

    fn now(&self) -> Duration {
        self.start.elapsed()
    }
}

/// References and boxes.
impl<L: Line + ?Sized, P: DerefMut<Target = L>> Line for P {
    fn send(&mut self, bytes: &[u8]) -> io::Result<()> {
        (**self).send(bytes)
    }

    fn receive(&mut self, into: &mut [u8], within: Duration) -> io::Result<usize> {
        (**self).receive(into, within)
    }

    fn now(&self) -> Duration {
        (**self).now()
    }
}

/// A line that can't be opened. The caller adds the name.
#[derive(Debug, Error)]
pub enum LineError {
    /// Nobody listens at the address, or it is none.
    #[error("can't connect: does the other end listen there?: {0}")]
    Connect(io::Error),
    /// What follows the device is no number above zero.
    #[error("`{baud}` is not a baud rate: write, for example, {device}@115200")]
    Baud {
        /// The device.
        device: String,
        /// What follows it.
        baud: String,
    },
    /// There is no such serial port, or it can't be opened. The message lists those of this machine.
    #[error("{0}; {list}", list = ports())]
    Port(serialport::Error),
}

/// Opens a line by name:
///
/// - `tcp:HOST:PORT`;
/// - `unix:PATH`, a socket;
/// - `DEVICE` or `DEVICE@BAUD`, a serial port: `/dev/ttyACM0`, `COM3@115200`.
///
/// # Errors
/// There is no such line, or it can't be opened.
pub fn open(name: &str) -> Result<Box<dyn Line>, LineError> {
    if let Some(address) = name.strip_prefix("tcp:") {
        let stream = TcpStream::connect(address).map_err(LineError::Connect)?;
        stream.set_nodelay(true).map_err(LineError::Connect)?;
        return Ok(Box::new(Piped::new(stream.try_clone().map_err(LineError::Connect)?, stream)));
    }
    if let Some(path) = name.strip_prefix("unix:") {
        return unix(path).map_err(LineError::Connect);
    }
    let (device, baud) = match name.rsplit_once('@') {
        Some((device, baud)) => {
            let of = |_| LineError::Baud { device: device.to_owned(), baud: baud.to_owned() };
            // A port at no speed opens, and then waits for ever.
            (device, baud.parse::<NonZero<u32>>().map_err(of)?.get())
        }
        None => (name, BAUD),
    };
    let port = serialport::new(device, baud).timeout(POLL).open().map_err(LineError::Port)?;
    Ok(Box::new(Piped::new(port.try_clone().map_err(LineError::Port)?, port)))
}

#[cfg(unix)]
fn unix(path: &str) -> io::Result<Box<dyn Line>> {
    let stream = std::os::unix::net::UnixStream::connect(path)?;
    Ok(Box::new(Piped::new(stream.try_clone()?, stream)))
}

#[cfg(not(unix))]
fn unix(_: &str) -> io::Result<Box<dyn Line>> {
    Err(io::Error::new(io::ErrorKind::Unsupported, "this system has no Unix sockets: use tcp:HOST:PORT"))
}

fn ports() -> String {
    let names: Vec<String> =
        serialport::available_ports().unwrap_or_default().into_iter().map(|p| p.port_name).collect();
    let lines = "a line is DEVICE[@BAUD], tcp:HOST:PORT, unix:PATH or loopback";
    match names.len() {
        0 => format!("there are no serial ports here; {lines}"),
        _ => format!("serial ports here: {}; {lines}", names.join(", ")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_socket_is_a_line() {
        let listener = std::net::TcpListener::bind("127.0.0.1:0").expect("a port is free");
        let name = format!("tcp:{}", listener.local_addr().expect("it has an address"));
        let board = std::thread::spawn(move || {
            let (mut stream, _) = listener.accept().expect("somebody connects");
            let mut bytes = [0; 5];
            stream.read_exact(&mut bytes).expect("five bytes come");
            bytes.reverse();
            stream.write_all(&bytes).expect("they go back");
        });
        let mut line = open(&name).expect("somebody listens");
        let mut buffer = [0; 3];
        assert_eq!(line.receive(&mut buffer, Duration::from_millis(5)).expect("no fault"), 0);
        line.send(b"abcde").expect("the line is there");
        let mut received: Vec<u8> = vec![];
        while received.len() < 5 {
            let count = line.receive(&mut buffer, Duration::from_secs(10)).expect("the line is there");
            assert!(count > 0, "{received:?}");
            received.extend(&buffer[..count]);
        }
        assert_eq!(received, b"edcba");
        board.join().expect("no assertion failed");
        // The other end is closed: every further read reports it.
        for _ in 0..2 {
            let gone = line.receive(&mut buffer, Duration::from_secs(10)).expect_err("it is closed");
            assert_eq!(gone.kind(), io::ErrorKind::UnexpectedEof);
        }
    }

    /// Whoever sends without end waits until somebody receives.
    #[test]
    fn a_flood_is_not_queued() {
        struct Flood(std::sync::Arc<std::sync::atomic::AtomicUsize>);
        impl Read for Flood {
            fn read(&mut self, into: &mut [u8]) -> io::Result<usize> {
                self.0.fetch_add(into.len(), std::sync::atomic::Ordering::Relaxed);
                Ok(into.len())
            }
        }
        let sent = std::sync::Arc::default();
        let mut line = Piped::new(Flood(std::sync::Arc::clone(&sent)), io::sink());
        std::thread::sleep(Duration::from_millis(100));
        let mut buffer = [0; 512];
        assert_eq!(line.receive(&mut buffer, Duration::from_secs(1)).expect("there is a flood"), 512);
        // Those that wait, the one received, and the one in the thread's hands.
        let sent = sent.load(std::sync::atomic::Ordering::Relaxed);
        assert!(sent <= (WAITING + 2) * READ, "{sent} bytes");
    }

    #[test]
    fn a_name_that_is_no_line_is_explained() {
        let error = |name: &str| open(name).err().expect("there is no such line");
        assert!(matches!(error("/dev/no-such-port"), LineError::Port(_)));
        for rate in ["fast", "0"] {
            let error = error(&format!("/dev/no-such-port@{rate}"));
            assert!(matches!(&error, LineError::Baud { baud, .. } if baud == rate), "{error}");
        }
        for name in ["tcp:127.0.0.1:1", "unix:/no/such/socket"] {
            assert!(matches!(error(name), LineError::Connect(_)), "{name}");
        }
        // The line that a user reads lists what could be meant.
        assert!(error("/dev/no-such-port").to_string().contains("DEVICE[@BAUD]"));
    }
}
