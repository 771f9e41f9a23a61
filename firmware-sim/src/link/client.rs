//! The client of the link protocol: sends one request at a time, and sends it again until the reply arrives.

use std::{io, time::Duration};

use gestus_core::link::{
    Damage, Direction, Fault, Frame, Header, Identity, Receiver, Reply, Request, VERSION, decode,
};

use super::line::Line;

/// Size of the host's frame buffers, bytes: more than a pose of 64 joints takes.
pub const BUFFER: usize = 4096;

/// How long a client waits for a reply, and how often it sends a request again.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct RetryPolicy {
    /// Time to wait after the first attempt; doubled after each further one.
    pub first_timeout: Duration,
    /// Upper limit of the time to wait.
    pub max_timeout: Duration,
    /// Repeated attempts before the client gives up.
    pub retries: u8,
}

impl Default for RetryPolicy {
    fn default() -> Self {
        Self { first_timeout: Duration::from_millis(250), max_timeout: Duration::from_secs(2), retries: 20 }
    }
}

/// What a client counted on its line.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, serde::Serialize)]
pub struct HostCounts {
    /// Requests made, each counted once.
    pub requests: u64,
    /// Requests sent again because no reply came in time.
    pub repeats: u64,
    /// Bytes received.
    pub bytes: u64,
    /// Undamaged frames received.
    pub frames: u64,
    /// Replies to requests that already had one.
    pub doubled: u64,
    /// Truncated frames.
    pub cut: u64,
    /// Frames with a wrong checksum.
    pub corrupted: u64,
    /// Frames longer than the buffer.
    pub overlong: u64,
    /// Frames that are not replies: an echo, or another program's.
    pub foreign: u64,
}

/// Why a request failed.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum LinkError {
    /// The line failed or was closed.
    #[error("the line failed")]
    Line(#[from] io::Error),
    /// No reply came.
    #[error("no reply within {seconds:.1} s, after {retries} retries{}", advice(.counts))]
    Timeout {
        /// Repeated attempts.
        retries: u8,
        /// Time waited, seconds.
        seconds: f64,
        /// What the client has counted since it began.
        counts: HostCounts,
    },
    /// The board refused the request.
    #[error("{0}")]
    Fault(Fault),
    /// The reply can't be decoded, or is not of the kind that the request asks for.
    #[error("the reply can't be decoded: use host and firmware of the same release")]
    Unreadable,
    /// The board has another database.
    #[error(
        "the board's database is {board:08x}, the file's {file:08x}: flash the board with this file, or give the file that it was flashed with"
    )]
    Database {
        /// Identity of the board's database.
        board: u32,
        /// Identity of the file's.
        file: u32,
    },
    /// The board's buffers are too short for a pose: it would drop poses silently, or step them and not reply.
    #[error(
        "the link's buffers on the board have {have} bytes, and a pose of this database needs {need}: build its firmware with larger ones (docs/LINK.md, \"Memory\")"
    )]
    Buffers {
        /// Bytes of a buffer.
        have: usize,
        /// Bytes needed.
        need: usize,
    },
    /// The request is too long for a frame.
    #[error("the request is longer than {BUFFER} bytes")]
    Overlong,
}

fn advice(counts: &HostCounts) -> &'static str {
    match (counts.bytes, counts.frames) {
        (0, _) => ": is the board running, and is it on this port?",
        (_, 0) => {
            ", and the bytes received are not frames: is the baud rate right, and does the board serve the link?"
        }
        (_, frames) if frames == counts.foreign => {
            ", and the frames received are this host's own: something echoes them, and no board answers"
        }
        _ => ": the board has stopped, or the line has become worse",
    }
}

/// The host's end of a line to a board.
pub struct Client<L> {
    line: L,
    retry: RetryPolicy,
    session: u32,
    sequence: u16,
    frame: Box<Frame<BUFFER>>,
    receiver: Box<Receiver<BUFFER>>,
    /// Bytes received and not yet parsed, the next one last.
    arrived: Vec<u8>,
    /// Message of the last reply.
    message: Vec<u8>,
    counts: HostCounts,
}

impl<L: Line> Client<L> {
    /// A client on a line. `session` distinguishes it from an earlier client, whose requests the board may remember.
    pub fn new(line: L, session: u32, retry: RetryPolicy) -> Self {
        Self {
            line,
            retry,
            session,
            // Starts elsewhere than an earlier client, so that a late reply to that one does not match.
            sequence: (session >> 8) as u16,
            frame: Box::default(),
            receiver: Box::default(),
            arrived: Vec::new(),
            message: Vec::new(),
            counts: HostCounts::default(),
        }
    }

    /// A new session number, from the time and the process id.
    pub fn new_session() -> u32 {
        let since = std::time::SystemTime::now().duration_since(std::time::UNIX_EPOCH).unwrap_or_default();
        let mixed = (since.as_nanos() as u64 ^ u64::from(std::process::id()) << 32)
            .wrapping_mul(0x9e37_79b9_7f4a_7c15);
        (mixed >> 32) as u32
    }

    /// What was counted so far.
    pub fn counts(&self) -> HostCounts {
        self.counts
    }

    /// The line.
    pub fn line(&self) -> &L {
        &self.line
    }

    /// Begins the session.
    ///
    /// # Errors
    /// [`LinkError`].
    pub fn hello(&mut self) -> Result<Identity<'_>, LinkError> {
        match self.call(&Request::Hello { session: self.session })? {
            Reply::Hello(identity) => Ok(identity),
            _ => Err(LinkError::Unreadable),
        }
    }

    /// Applies a setting.
    ///
    /// # Errors
    /// [`LinkError`].
    pub fn set(&mut self, request: &Request<'_>) -> Result<(), LinkError> {
        match self.call(request)? {
            Reply::Done => Ok(()),
            _ => Err(LinkError::Unreadable),
        }
    }

    /// All of the board's statistics, each as its number ([`gestus_core::link::counter`]) and its value.
    ///
    /// # Errors
    /// [`LinkError`].
    pub fn statistics(&mut self) -> Result<Vec<(u16, u64)>, LinkError> {
        let mut all = Vec::new();
        loop {
            let skip = u16::try_from(all.len()).map_err(|_| LinkError::Unreadable)?;
            match self.call(&Request::Statistics { skip })? {
                Reply::Statistics { more, page } => {
                    all.extend_from_slice(&page);
                    if !more || page.is_empty() {
                        return Ok(all);
                    }
                }
                _ => return Err(LinkError::Unreadable),
            }
        }
    }

    /// Sends a request, again and again until its reply has come.
    ///
    /// # Errors
    /// [`LinkError`]; a refusal by the board is [`LinkError::Fault`].
    pub fn call(&mut self, request: &Request<'_>) -> Result<Reply<'_>, LinkError> {
        self.sequence = self.sequence.wrapping_add(1);
        self.counts.requests += 1;
        let began = self.line.now();
        let mut wait = self.retry.first_timeout;
        for attempt in 0..=self.retry.retries {
            self.counts.repeats += u64::from(attempt > 0);
            let bytes = self
                .frame
                .write(Header::request(self.sequence, attempt), request)
                .map_err(|_| LinkError::Overlong)?;
            self.line.send(bytes)?;
            if let Some(version) = self.listen(wait)? {
                if version != VERSION {
                    return Err(LinkError::Fault(Fault::Version { need: version, have: VERSION }));
                }
                return match decode(&self.message) {
                    Some(Reply::Fault(fault)) => Err(LinkError::Fault(fault)),
                    Some(reply) => Ok(reply),
                    None => Err(LinkError::Unreadable),
                };
            }
            wait = (wait * 2).min(self.retry.max_timeout);
        }
        let seconds = (self.line.now() - began).as_secs_f64();
        Err(LinkError::Timeout { retries: self.retry.retries, seconds, counts: self.counts })
    }

    /// Waits for the reply to the current request, and returns its protocol version, or `None` if none came in time.
    fn listen(&mut self, wait: Duration) -> Result<Option<u8>, LinkError> {
        let until = self.line.now() + wait;
        loop {
            while let Some(byte) = self.arrived.pop() {
                if let Some(version) = self.take(byte) {
                    return Ok(Some(version));
                }
            }
            let now = self.line.now();
            if now >= until {
                return Ok(None);
            }
            let mut buffer = [0; 512];
            let count = self.line.receive(&mut buffer, until - now)?;
            self.counts.bytes += count as u64;
            // In reverse, so that the next byte is the last.
            self.arrived.extend(buffer[..count].iter().rev());
        }
    }

    /// Parses a byte. Returns the protocol version of the reply if the byte completes it.
    fn take(&mut self, byte: u8) -> Option<u8> {
        let counts = &mut self.counts;
        match self.receiver.receive(byte) {
            None => None,
            Some(Err(damage)) => {
                match damage {
                    Damage::Cut => counts.cut += 1,
                    Damage::Overlong => counts.overlong += 1,
                    _ => counts.corrupted += 1,
                }
                None
            }
            Some(Ok(received)) => {
                counts.frames += 1;
                if received.header.direction != Direction::Reply {
                    counts.foreign += 1;
                    return None;
                }
                if received.header.sequence != self.sequence {
                    counts.doubled += 1;
                    return None;
                }
                self.message.clear();
                self.message.extend_from_slice(received.message);
                Some(received.header.version)
            }
        }
    }
}
