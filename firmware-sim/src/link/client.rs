//! Asking a board: one request at a time, repeated until it is answered.

use std::{io, time::Duration};

use gestus_core::link::{
    Damage, Direction, Fault, Frame, Header, Identity, Receiver, Reply, Request, decode,
};

use super::line::Line;

/// Bytes of the longest frame that a host takes or sends: 64 joints and to spare.
pub const BUFFER: usize = 4096;

/// How long a client waits.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Patience {
    /// For the first answer; each repetition waits twice as long as the one before.
    pub first: Duration,
    /// But never longer than this.
    pub most: Duration,
    /// Repetitions before the client gives up.
    pub repeats: u8,
}

impl Default for Patience {
    fn default() -> Self {
        Self { first: Duration::from_millis(250), most: Duration::from_secs(2), repeats: 20 }
    }
}

/// What a client counted of its line.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct HostCounts {
    /// Requests asked.
    pub requests: u64,
    /// Repetitions sent, since no answer came in time.
    pub repeats: u64,
    /// Frames that arrived whole.
    pub frames: u64,
    /// Answers to requests that were answered already.
    pub doubled: u64,
    /// Frames that were cut.
    pub cut: u64,
    /// Frames whose checksum disagreed.
    pub corrupted: u64,
    /// Frames longer than the buffer.
    pub overlong: u64,
    /// Frames that are no replies: an echo, or another program's.
    pub foreign: u64,
}

impl HostCounts {
    /// All counts, by name.
    pub fn all(&self) -> [(&'static str, u64); 8] {
        [
            ("requests", self.requests),
            ("repeats", self.repeats),
            ("frames", self.frames),
            ("doubled", self.doubled),
            ("cut", self.cut),
            ("corrupted", self.corrupted),
            ("overlong", self.overlong),
            ("foreign", self.foreign),
        ]
    }
}

/// Why a request has no answer that is of use.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum LinkError {
    /// The line is gone.
    #[error("the line is gone: {0}")]
    Line(#[from] io::Error),
    /// No answer.
    #[error("no answer after {repeats} repetitions in {seconds:.1} s{}", advice(.counts))]
    Silent {
        /// Repetitions.
        repeats: u8,
        /// Time waited.
        seconds: f64,
        /// What the line brought meanwhile and before.
        counts: HostCounts,
    },
    /// The board has an answer, and it is no.
    #[error("{0}")]
    Fault(Fault),
    /// The answer can't be decoded, or is one to another question.
    #[error("the answer can't be read: take host and firmware of one release")]
    Unreadable,
    /// The request is too long for a frame.
    #[error("the request is longer than {BUFFER} bytes")]
    Overlong,
}

fn advice(counts: &HostCounts) -> &'static str {
    match (counts.frames, counts.cut + counts.corrupted + counts.overlong) {
        (0, 0) => ": is the board running, and this its port?",
        (0, _) => ", bytes that are no frames: is the baud rate right?",
        _ => ": the board has stopped, or the line got worse",
    }
}

/// The host's end of a line.
pub struct Client<L> {
    line: L,
    patience: Patience,
    session: u32,
    sequence: u16,
    frame: Box<Frame<BUFFER>>,
    receiver: Box<Receiver<BUFFER>>,
    /// Bytes that arrived, and how many of them are looked at.
    arrived: Vec<u8>,
    /// The last answer's message.
    message: Vec<u8>,
    counts: HostCounts,
}

impl<L: Line> Client<L> {
    /// A client on a line. `session` tells it from the client before, which the board may remember.
    pub fn new(line: L, session: u32, patience: Patience) -> Self {
        Self {
            line,
            patience,
            session,
            // Answers to a client before are not to fit this one's questions.
            sequence: (session >> 8) as u16,
            frame: Box::default(),
            receiver: Box::default(),
            arrived: Vec::new(),
            message: Vec::new(),
            counts: HostCounts::default(),
        }
    }

    /// A number for a session: this process at this moment.
    pub fn new_session() -> u32 {
        let since = std::time::SystemTime::now().duration_since(std::time::UNIX_EPOCH).unwrap_or_default();
        let mixed = (since.as_nanos() as u64 ^ u64::from(std::process::id()) << 32)
            .wrapping_mul(0x9e37_79b9_7f4a_7c15);
        (mixed >> 32) as u32
    }

    /// What was counted.
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
        match self.ask(&Request::Hello { session: self.session })? {
            Reply::Hello(identity) => Ok(identity),
            _ => Err(LinkError::Unreadable),
        }
    }

    /// Puts a setting in force.
    ///
    /// # Errors
    /// [`LinkError`].
    pub fn set(&mut self, request: &Request<'_>) -> Result<(), LinkError> {
        match self.ask(request)? {
            Reply::Done => Ok(()),
            _ => Err(LinkError::Unreadable),
        }
    }

    /// All of the board's statistics: numbers ([`gestus_core::link::counter`]) and values.
    ///
    /// # Errors
    /// [`LinkError`].
    pub fn statistics(&mut self) -> Result<Vec<(u16, u64)>, LinkError> {
        let mut all = Vec::new();
        loop {
            let skip = u16::try_from(all.len()).map_err(|_| LinkError::Unreadable)?;
            match self.ask(&Request::Statistics { skip })? {
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

    /// Asks, and repeats the question until its answer has come.
    ///
    /// # Errors
    /// [`LinkError`]; a refusal is [`LinkError::Fault`].
    pub fn ask(&mut self, request: &Request<'_>) -> Result<Reply<'_>, LinkError> {
        self.sequence = self.sequence.wrapping_add(1);
        self.counts.requests += 1;
        let began = self.line.now();
        let mut wait = self.patience.first;
        for attempt in 0..=self.patience.repeats {
            self.counts.repeats += u64::from(attempt > 0);
            let bytes = self
                .frame
                .write(Header::request(self.sequence, attempt), request)
                .map_err(|_| LinkError::Overlong)?;
            self.line.send(bytes)?;
            if self.listen(wait)? {
                return match decode(&self.message) {
                    Some(Reply::Fault(fault)) => Err(LinkError::Fault(fault)),
                    Some(reply) => Ok(reply),
                    None => Err(LinkError::Unreadable),
                };
            }
            wait = (wait * 2).min(self.patience.most);
        }
        let seconds = (self.line.now() - began).as_secs_f64();
        Err(LinkError::Silent { repeats: self.patience.repeats, seconds, counts: self.counts })
    }

    /// Waits for the answer to the running question. False where none came in time.
    fn listen(&mut self, wait: Duration) -> Result<bool, LinkError> {
        let until = self.line.now() + wait;
        loop {
            while let Some(byte) = self.arrived.pop() {
                if self.take(byte) {
                    return Ok(true);
                }
            }
            let now = self.line.now();
            if now >= until {
                return Ok(false);
            }
            let mut buffer = [0; 512];
            let count = self.line.receive(&mut buffer, until - now)?;
            // Backwards, so that the next byte is at the end.
            self.arrived.extend(buffer[..count].iter().rev());
        }
    }

    /// Takes a byte. True where it completes the answer.
    fn take(&mut self, byte: u8) -> bool {
        let counts = &mut self.counts;
        match self.receiver.receive(byte) {
            None => false,
            Some(Err(damage)) => {
                match damage {
                    Damage::Cut => counts.cut += 1,
                    Damage::Overlong => counts.overlong += 1,
                    _ => counts.corrupted += 1,
                }
                false
            }
            Some(Ok(received)) => {
                counts.frames += 1;
                if received.header.direction != Direction::Reply {
                    counts.foreign += 1;
                    return false;
                }
                if received.header.sequence != self.sequence {
                    counts.doubled += 1;
                    return false;
                }
                self.message.clear();
                self.message.extend_from_slice(received.message);
                true
            }
        }
    }
}
