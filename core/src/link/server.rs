//! The board's end of the link: bytes in, bytes out.

use super::{
    Board, Direction, Fault, Frame, Full, Header, HingeBuffer, Identity, LinkCounts, PAGE, Pairs, PoseBuffer,
    PoseBytes, Received, Receiver, Reply, Request, StepReport, VERSION, board::Statistic, buffer_length,
    counter, decode, robot_buffer_length,
};
use crate::config::parameters;
use crate::{Config, ConfigError, Pose, Report, Stylizer, blob::layout::MAX_GROUPS};

/// Serves a stylizer over a line.
///
/// `N` bytes is each of its two buffers: [`buffer_length`] of the joints, or [`robot_buffer_length`] of the hinges
/// where that is more. Feed it every byte that comes in with [`receive`](Self::receive), and send what that returns:
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
/// Shorter buffers are an error of the compiler, since a pose that has been stepped and whose answer does not fit is a
/// stream that is lost:
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
/// No sequence of bytes makes it panic or hang. A byte costs a bounded number of instructions: those of storing it,
/// and at the end of a frame those of at most one step.
#[derive(Debug)]
pub struct Server<'a, 'db, B, const J: usize, const K: usize, const C: usize, const N: usize> {
    stylizer: &'a mut Stylizer<'db, J, K, C>,
    /// What a session starts with.
    config: Config,
    board: B,
    receiver: Receiver<N>,
    /// The answer to the last request that was carried out, kept in case that it has to be sent again.
    answer: Frame<N>,
    session: Option<u32>,
    /// The last request that was carried out, and the last of its attempts that arrived.
    last: Header,
    counts: LinkCounts,
}

/// Who serves what, and what was counted.
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
    /// A server that nobody has said hello to. The stylizer's parameters are those that sessions start with.
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

    /// Takes the next byte of the line, and gives what is to be sent back.
    pub fn receive(&mut self, byte: u8) -> Option<&[u8]> {
        let received = match self.receiver.receive(byte)? {
            Ok(received) => received,
            Err(damage) => {
                self.counts.damaged(damage);
                return None;
            }
        };
        LinkCounts::one(&mut self.counts.frames);
        let mut desk = Desk {
            stylizer: self.stylizer,
            config: self.config,
            board: &mut self.board,
            answer: &mut self.answer,
            session: &mut self.session,
            last: &mut self.last,
            counts: &mut self.counts,
        };
        desk.take(received).then(|| self.answer.bytes())
    }

    /// What was counted of the line.
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

/// A server without its receiver, which holds the request's bytes meanwhile.
struct Desk<'a, 'db, B, const J: usize, const K: usize, const C: usize, const N: usize> {
    stylizer: &'a mut Stylizer<'db, J, K, C>,
    config: Config,
    board: &'a mut B,
    answer: &'a mut Frame<N>,
    session: &'a mut Option<u32>,
    last: &'a mut Header,
    counts: &'a mut LinkCounts,
}

impl<B: Board<J>, const J: usize, const K: usize, const C: usize, const N: usize>
    Desk<'_, '_, B, J, K, C, N>
{
    /// Carries a request out where it is due. True where the answer is to be sent.
    fn take(&mut self, Received { header, message }: Received<'_>) -> bool {
        if header.direction == Direction::Reply {
            LinkCounts::one(&mut self.counts.foreign);
            return false;
        }
        if header.version != VERSION {
            LinkCounts::one(&mut self.counts.foreign);
            // Another program is at the other end now.
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
                LinkCounts::one(if again { &mut self.counts.doubled } else { &mut self.counts.repeated });
                self.last.attempt = header.attempt;
                return true;
            }
            if header.sequence != self.last.sequence.wrapping_add(1) {
                LinkCounts::one(&mut self.counts.stale);
                return false;
            }
        }
        *self.last = header;
        self.counts.lost = self.counts.lost.saturating_add(u32::from(header.attempt));
        LinkCounts::one(&mut self.counts.requests);
        if let Err(fault) = self.carry_out(header, request.as_ref(), new_session) {
            self.fault(header, fault);
        }
        true
    }

    // On its own: what it takes apart is off the stack in a step. With the desk's capacities: it is compiled with the
    // firmware, for size.
    #[inline(never)]
    fn request(message: &[u8]) -> Option<Request<'_>> {
        decode(message)
    }

    // What it calls is never inlined into it: the frames of a step and of a page of statistics would add up.
    fn carry_out(
        &mut self,
        header: Header,
        request: Option<&Request<'_>>,
        new_session: Option<u32>,
    ) -> Result<(), Fault> {
        #[cfg(feature = "defmt")]
        if let Some(request) = request.filter(|r| !matches!(r, Request::Pose(_))) {
            defmt::info!("asked: {}", request);
        }
        match *request.ok_or(Fault::Malformed)? {
            Request::Hello { .. } => {
                if new_session.is_some() {
                    *self.session = new_session;
                    self.stylizer.restore(self.config)?;
                    let _ = self.board.place(&[]);
                }
                return self.hello(header);
            }
            Request::Pose(ref pose) => return self.step(header, pose),
            Request::Statistics { skip } => return self.statistics(header, skip),
            Request::Robot { angles } => return self.place(header, angles),
            Request::Drive => return self.drive(header),
            ref setting => self.set(setting)?,
        }
        self.reply(header, &Reply::Done)
    }

    /// Requests that change a setting; of any other nothing.
    #[inline(never)]
    fn set(&mut self, request: &Request<'_>) -> Result<(), ConfigError> {
        match *request {
            Request::Style(ref weights) => self.stylizer.set_style(weights),
            Request::Labels { action, input_style } => self.labels(action, input_style),
            Request::Mask { group, searched } => self.stylizer.set_mask(group, searched),
            Request::Strength(ref strengths) => self.strengths(strengths),
            Request::GroupStyle { group, ref weights } => self.stylizer.set_group_style(group, weights),
            Request::Configure(ref parameters) => self.configure(parameters),
            Request::Reset => {
                self.stylizer.reset();
                Ok(())
            }
            _ => Ok(()),
        }
    }

    #[inline(never)]
    fn hello(&mut self, header: Header) -> Result<(), Fault> {
        let database = self.stylizer.database();
        let counts = database.counts();
        let identity = Identity {
            board: self.board.name(),
            build: self.board.build(),
            database: database.identity(),
            rate_hz: database.rate_hz(),
            joints: short(counts.joints),
            classes: short(counts.classes),
            capacity: [short(J), short(K), short(C)],
            ram_bytes: size_of::<Stylizer<'_, J, K, C>>() as u32,
            buffer_bytes: short(N),
        };
        self.answer.write(header.reply(), &Reply::Hello(identity)).map(|_| ()).map_err(overlong)
    }

    #[inline(never)]
    fn step(&mut self, header: Header, bytes: &PoseBytes<'_>) -> Result<(), Fault> {
        let joints = self.stylizer.database().counts().joints;
        if bytes.joints() != Some(joints) {
            let have = bytes.joints().map_or(u16::MAX, short);
            return Err(Fault::Joints { need: short(joints), have });
        }
        let mut output = Pose::<J>::IDENTITY;
        let report = self.stepped(bytes, &mut output);
        LinkCounts::one(&mut self.counts.steps);
        self.answer_pose(header, &output, &report)
    }

    #[inline(never)]
    fn stepped(&mut self, bytes: &PoseBytes<'_>, output: &mut Pose<J>) -> Report {
        let mut input = Pose::<J>::IDENTITY;
        bytes.read(&mut input);
        self.board.begin();
        let report = self.stylizer.step_observed(&input, output, self.board);
        self.board.end(&report);
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
        let driven = match self.stylizer.last_output() {
            Some(pose) => self.board.drive(pose),
            // No pose is held, as one that is none.
            None => self.board.drive(&Pose { position: [f32::NAN; 3], ..Pose::IDENTITY }),
        };
        let driven = driven.ok_or(Fault::NoRobot)?;
        let mut buffer = HingeBuffer::new();
        let report = buffer.report(&driven, |hinge| self.board.hinge(hinge));
        self.answer.write(header.reply(), &Reply::Drive(report)).map(|_| ()).map_err(overlong)
    }

    /// Both labels or none: each alone may name no class with the other's old value.
    #[inline(never)]
    fn labels(&mut self, action: Option<u16>, input_style: Option<u16>) -> Result<(), ConfigError> {
        let before = self.stylizer.labels();
        self.put_labels(action, input_style).inspect_err(|_| {
            // Those before name a class.
            let _ = self.put_labels(before.0, before.1);
        })
    }

    fn put_labels(&mut self, action: Option<u16>, input_style: Option<u16>) -> Result<(), ConfigError> {
        self.stylizer.set_input_style(None)?;
        self.stylizer.set_action(action)?;
        self.stylizer.set_input_style(input_style)
    }

    /// All strengths or none.
    #[inline(never)]
    fn strengths(&mut self, strengths: &Pairs) -> Result<(), ConfigError> {
        let before: [f32; MAX_GROUPS] = core::array::from_fn(|group| self.stylizer.strength(group));
        for &(group, strength) in strengths {
            if let Err(error) = self.stylizer.set_strength(group, strength) {
                for (group, strength) in (0..).zip(before) {
                    // Groups that there are not refuse theirs.
                    let _ = self.stylizer.set_strength(group, strength);
                }
                return Err(error);
            }
        }
        Ok(())
    }

    #[inline(never)]
    fn configure(&mut self, parameters: &Pairs) -> Result<(), ConfigError> {
        let mut config = *self.stylizer.config();
        for &(number, value) in parameters {
            config = parameters::set(config, number, value)?;
        }
        self.stylizer.set_config(config)
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

    /// The link's own counts, the sizes, and then what the board counts.
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
        LinkCounts::one(&mut self.counts.faults);
        #[cfg(feature = "defmt")]
        defmt::warn!("not done: {}", fault);
        // A fault is a few bytes, and N is hundreds.
        let _ = self.answer.write(header.reply(), &Reply::Fault(fault));
    }
}

fn overlong(_: Full) -> Fault {
    Fault::Overlong
}

fn short(value: usize) -> u16 {
    u16::try_from(value).unwrap_or(u16::MAX)
}
