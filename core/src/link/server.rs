//! The board's end of the link: takes bytes, and gives the bytes of replies.

use super::{
    Board, BriefReport, Direction, Fault, Frame, Full, Header, HingeBuffer, Identity, LinkCounts, PAGE,
    PoseBuffer, PoseBytes, Received, Receiver, Reply, Request, StepReport, VERSION, board::Statistic,
    buffer_length, counter, decode, robot_buffer_length,
};
use crate::{Config, Pose, Report, Stylizer, error::saturating_u16, robot::Driven};

/// Serves a stylizer over a line.
///
/// `N` is the length of each of its two buffers in bytes: [`buffer_length`] of the joints or [`robot_buffer_length`] of
/// the hinges, whichever is larger. Pass every byte that arrives to [`receive`](Self::receive), and send what it returns:
///
/// ```
/// use gestus_core::{Stylizer, link::{Board, Server, buffer_length}};
///
/// const J: usize = 22;
///
/// fn serve<const K: usize, const C: usize>(
///     stylizer: &mut Stylizer<'_, J, K, C>,
///     board: impl Board<J>,
///     mut read: impl FnMut() -> Option<u8>,
///     mut write: impl FnMut(&[u8]),
/// ) {
///     let mut server = Server::<_, J, K, C, { buffer_length(J) }>::new(stylizer, board);
///     while let Some(byte) = read() {
///         if let Some(reply) = server.receive(byte) {
///             write(reply);
///         }
///     }
/// }
/// ```
///
/// Shorter buffers do not compile: if the reply to a pose did not fit, the host would lose a step of the stream.
///
/// ```compile_fail
/// # use gestus_core::{Stylizer, link::Server};
/// fn serve(stylizer: &mut Stylizer<'_, 22, 40, 28>) {
///     // 505 bytes are needed.
///     Server::<_, 22, 40, 28, 400>::new(stylizer, ()).receive(0);
/// }
/// # let database = crate::Database::open(&[]).unwrap();
/// # serve(&mut Stylizer::new(database, crate::Config::new()).unwrap());
/// ```
///
/// No sequence of bytes makes it panic or hang. A byte costs a bounded number of instructions: it is stored, and the
/// last one of a frame runs at most one step.
#[derive(Debug)]
pub struct Server<'a, 'db, B, const J: usize, const K: usize, const C: usize, const N: usize> {
    stylizer: &'a mut Stylizer<'db, J, K, C>,
    /// The parameters that a session starts with.
    config: Config,
    board: B,
    receiver: Receiver<N>,
    /// The reply to the last request that was executed, kept in case it has to be sent again.
    answer: Frame<N>,
    session: Option<u32>,
    /// Header of the last request that was executed, with the last of its attempts that arrived.
    last: Header,
    counts: LinkCounts,
}

/// The stylizer, the session and the counts.
#[cfg(feature = "defmt")]
impl<B, const J: usize, const K: usize, const C: usize, const N: usize> defmt::Format
    for Server<'_, '_, B, J, K, C, N>
{
    fn format(&self, f: defmt::Formatter<'_>) {
        defmt::write!(f, "Server of a {}, session {}: {}", self.stylizer, self.session, self.counts);
    }
}

impl<'a, 'db, B, const J: usize, const K: usize, const C: usize, const N: usize>
    Server<'a, 'db, B, J, K, C, N>
where
    B: Board<J>,
{
    /// A server without a session. Sessions start with the stylizer's present parameters.
    pub fn new(stylizer: &'a mut Stylizer<'db, J, K, C>, board: B) -> Self {
        const {
            assert!(N >= buffer_length(J), "a server's buffers are shorter than buffer_length of its joints");
            assert!(
                B::HINGES == 0 || N >= robot_buffer_length(B::HINGES),
                "a server's buffers are shorter than robot_buffer_length of its hinges"
            );
        }
        Self {
            config: *stylizer.config(),
            stylizer,
            board,
            receiver: Receiver::new(),
            answer: Frame::new(),
            session: None,
            last: Header::request(0, 0),
            counts: LinkCounts::default(),
        }
    }

    /// Takes the next byte of the line. Returns the bytes to send back at the end of a frame that needs a reply.
    pub fn receive(&mut self, byte: u8) -> Option<&[u8]> {
        let received = match self.receiver.receive(byte)? {
            Ok(received) => received,
            Err(damage) => {
                self.counts.damaged(damage);
                return None;
            }
        };
        LinkCounts::increment(&mut self.counts.frames);
        let mut handler = Handler {
            stylizer: self.stylizer,
            config: &self.config,
            board: &mut self.board,
            answer: &mut self.answer,
            session: &mut self.session,
            last: &mut self.last,
            counts: &mut self.counts,
        };
        handler.handle(received).then(|| self.answer.bytes())
    }

    /// The counts of the line.
    pub fn counts(&self) -> &LinkCounts {
        &self.counts
    }

    /// The board.
    pub fn board(&mut self) -> &mut B {
        &mut self.board
    }

    /// The stylizer.
    pub fn stylizer(&mut self) -> &mut Stylizer<'db, J, K, C> {
        self.stylizer
    }
}

/// A server without its receiver, which holds the bytes of the request that is executed.
pub(super) struct Handler<'a, 'db, B, const J: usize, const K: usize, const C: usize, const N: usize> {
    pub(super) stylizer: &'a mut Stylizer<'db, J, K, C>,
    config: &'a Config,
    board: &'a mut B,
    answer: &'a mut Frame<N>,
    session: &'a mut Option<u32>,
    last: &'a mut Header,
    counts: &'a mut LinkCounts,
}

impl<B: Board<J>, const J: usize, const K: usize, const C: usize, const N: usize>
    Handler<'_, '_, B, J, K, C, N>
{
    /// Executes a request if it is the next. True if the reply is to be sent.
    fn handle(&mut self, Received { header, message }: Received<'_>) -> bool {
        if header.direction == Direction::Reply {
            LinkCounts::increment(&mut self.counts.foreign);
            return false;
        }
        if header.version != VERSION {
            LinkCounts::increment(&mut self.counts.foreign);
            // The host runs another program now, so the session is over.
            *self.session = None;
            self.fault(header, Fault::Version { need: VERSION, have: header.version });
            return true;
        }
        let request = Self::request(message);
        let new_session = match request {
            Some(Request::Hello { session }) if *self.session != Some(session) => Some(session),
            _ => None,
        };
        if new_session.is_none() {
            if self.session.is_none() {
                self.fault(header, Fault::NoSession);
                return true;
            }
            if header.sequence == self.last.sequence {
                let again = header.attempt == self.last.attempt;
                LinkCounts::increment(if again {
                    &mut self.counts.doubled
                } else {
                    &mut self.counts.repeated
                });
                self.last.attempt = header.attempt;
                return true;
            }
            if header.sequence != self.last.sequence.wrapping_add(1) {
                LinkCounts::increment(&mut self.counts.stale);
                return false;
            }
        }
        *self.last = header;
        self.counts.lost = self.counts.lost.saturating_add(u32::from(header.attempt));
        LinkCounts::increment(&mut self.counts.requests);
        if let Err(fault) = self.execute(header, request.as_ref(), new_session) {
            self.fault(header, fault);
        }
        true
    }

    // A function of its own, so that decoding takes no stack during a step; a method, so that it is compiled with the
    // firmware, for size.
    #[inline(never)]
    fn request(message: &[u8]) -> Option<Request<'_>> {
        decode(message)
    }

    // None of the functions that it calls is inlined: their stack frames would add up.
    fn execute(
        &mut self,
        header: Header,
        request: Option<&Request<'_>>,
        new_session: Option<u32>,
    ) -> Result<(), Fault> {
        #[cfg(feature = "defmt")]
        if let Some(request) = request.filter(|r| !matches!(r, Request::Pose(_))) {
            defmt::info!("request: {}", request);
        }
        match *request.ok_or(Fault::Malformed)? {
            Request::Hello { .. } => return self.hello(header, new_session),
            Request::Pose(ref pose) => return self.step(header, pose),
            Request::Statistics { skip } => return self.statistics(header, skip),
            Request::Robot { angles } => return self.place(header, angles),
            Request::Drive => return self.drive(header),
            Request::StepRobot(ref pose) => return self.step_robot(header, pose),
            ref setting => self.set(setting)?,
        }
        self.reply(header, &Reply::Done)
    }

    #[inline(never)]
    fn hello(&mut self, header: Header, new_session: Option<u32>) -> Result<(), Fault> {
        if new_session.is_some() {
            *self.session = new_session;
            self.stylizer.restore(*self.config)?;
            let _ = self.board.place(&[]);
        }
        let database = self.stylizer.database();
        let counts = database.counts();
        let identity = Identity {
            board: self.board.name(),
            build: self.board.build(),
            database: database.identity(),
            rate_hz: database.rate_hz(),
            joints: saturating_u16(counts.joints),
            classes: saturating_u16(counts.classes),
            capacity: [saturating_u16(J), saturating_u16(K), saturating_u16(C)],
            ram_bytes: size_of::<Stylizer<'_, J, K, C>>() as u32,
            buffer_bytes: saturating_u16(N),
        };
        self.answer.write(header.reply(), &Reply::Hello(identity)).map(|_| ()).map_err(overlong)
    }

    fn fits(&self, bytes: &PoseBytes<'_>) -> Result<(), Fault> {
        let joints = self.stylizer.database().counts().joints;
        if bytes.joints() != Some(joints) {
            let have = bytes.joints().map_or(u16::MAX, saturating_u16);
            return Err(Fault::Joints { need: saturating_u16(joints), have });
        }
        Ok(())
    }

    #[inline(never)]
    fn step(&mut self, header: Header, bytes: &PoseBytes<'_>) -> Result<(), Fault> {
        self.fits(bytes)?;
        let mut output = Pose::<J>::IDENTITY;
        let report = self.stepped(bytes, &mut output);
        self.answer_pose(header, &output, &report)
    }

    #[inline(never)]
    fn stepped(&mut self, bytes: &PoseBytes<'_>, output: &mut Pose<J>) -> Report {
        let mut input = Pose::<J>::IDENTITY;
        bytes.read(&mut input);
        self.board.begin();
        let report = self.stylizer.step_observed(&input, output, self.board);
        self.board.end(&report);
        LinkCounts::increment(&mut self.counts.steps);
        report
    }

    #[inline(never)]
    fn answer_pose(&mut self, header: Header, output: &Pose<J>, report: &Report) -> Result<(), Fault> {
        let joints = self.stylizer.database().counts().joints;
        let mut buffer = PoseBuffer::new();
        let report = StepReport::new(report, self.board.stages());
        self.reply(header, &Reply::Pose(buffer.pose(output, joints), report))
    }

    #[inline(never)]
    fn place(&mut self, header: Header, angles: &[u8]) -> Result<(), Fault> {
        let (angles, rest) = angles.as_chunks::<4>();
        if !rest.is_empty() {
            return Err(Fault::Malformed);
        }
        let robot = self.board.place(angles).ok_or(Fault::NoRobot)?;
        self.reply(header, &Reply::Robot(robot))
    }

    #[inline(never)]
    fn drive(&mut self, header: Header) -> Result<(), Fault> {
        // Before the first valid pose the hinges stay where they are.
        let pose = self.stylizer.last_output().unwrap_or(&Pose::INVALID);
        let driven = self.board.drive(pose).ok_or(Fault::NoRobot)?;
        let mut buffer = HingeBuffer::new();
        let report = buffer.report(&driven, |hinge| self.board.hinge(hinge));
        self.reply(header, &Reply::Drive(report))
    }

    #[inline(never)]
    fn step_robot(&mut self, header: Header, bytes: &PoseBytes<'_>) -> Result<(), Fault> {
        if B::HINGES == 0 {
            return Err(Fault::NoRobot);
        }
        self.fits(bytes)?;
        let (step, ticks, driven) = self.followed(bytes)?;
        let mut buffer = HingeBuffer::new();
        let drive = buffer.report(&driven, |hinge| self.board.hinge(hinge));
        self.reply(header, &Reply::StepRobot { step, ticks, drive })
    }

    #[inline(never)]
    fn followed(&mut self, bytes: &PoseBytes<'_>) -> Result<(BriefReport, u16, Driven), Fault> {
        let mut output = Pose::<J>::IDENTITY;
        let report = self.stepped(bytes, &mut output);
        let pose = self.stylizer.last_output().unwrap_or(&Pose::INVALID);
        let (ticks, driven) = self.board.follow(pose, report.step_s).ok_or(Fault::NoRobot)?;
        Ok((BriefReport::new(&report), ticks, driven))
    }

    #[inline(never)]
    fn statistics(&mut self, header: Header, skip: u16) -> Result<(), Fault> {
        let (mut page, mut more) = (heapless::Vec::<_, PAGE>::new(), false);
        for index in skip..u16::MAX {
            let Some(statistic) = self.statistic(index) else { break };
            more = page.push(statistic).is_err();
            if more {
                break;
            }
        }
        self.reply(header, &Reply::Statistics { more, page })
    }

    /// Statistic `index`: the link's own counts, the sizes, then the board's counts.
    fn statistic(&mut self, index: u16) -> Option<Statistic> {
        let counts = self.counts.statistics();
        let sizes = [
            (counter::STYLIZER_BYTES, size_of::<Stylizer<'_, J, K, C>>() as u64),
            (counter::SERVER_BYTES, size_of::<Server<'_, '_, B, J, K, C, N>>() as u64),
        ];
        let own = (counts.len() + sizes.len()) as u16;
        match index.checked_sub(own) {
            Some(index) => self.board.statistic(index),
            None => {
                let index = usize::from(index);
                counts.get(index).or_else(|| sizes.get(index.checked_sub(counts.len())?)).copied()
            }
        }
    }

    fn reply(&mut self, header: Header, reply: &Reply<'_>) -> Result<(), Fault> {
        self.answer.write(header.reply(), reply).map(|_| ()).map_err(overlong)
    }

    #[inline(never)]
    fn fault(&mut self, header: Header, fault: Fault) {
        LinkCounts::increment(&mut self.counts.faults);
        #[cfg(feature = "defmt")]
        defmt::warn!("request refused: {}", fault);
        // A fault is a few bytes, and N is hundreds.
        let _ = self.answer.write(header.reply(), &Reply::Fault(fault));
    }
}

fn overlong(_: Full) -> Fault {
    Fault::Overlong
}
