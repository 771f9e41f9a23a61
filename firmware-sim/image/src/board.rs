//! The link server's board: its name and statistics.

use gestus_core::{
    Observer, Report, Stage,
    link::{Board, Statistic, counter},
};

use crate::{
    counter::Counter,
    memory, stack,
    stages::{Instructions, STAGES, Stages},
};

/// Counts the instructions of the steps of a session.
#[derive(Debug)]
pub struct Firmware<C> {
    stages: Stages<C>,
    last: Instructions,
    sums: [u64; STAGES],
    most: u32,
    /// Instructions of `Database::open`.
    open: u64,
    /// Bytes of stylizer and server, which are on the stack but not part of the calls' use.
    state: usize,
}

impl<C: Counter> Firmware<C> {
    /// A board that has opened its database in `open` ticks of its counter, and has `state` bytes of stylizer and
    /// server in the stack frame of its main loop.
    pub fn new(counter: C, open: u32, state: usize) -> Self {
        let open = C::instructions(u64::from(open));
        Self { stages: Stages::new(counter), last: [0; STAGES], sums: [0; STAGES], most: 0, open, state }
    }

    /// Instructions of the last step.
    fn total(&self) -> u32 {
        self.last.iter().sum()
    }
}

impl<const J: usize, C: Counter> Observer<J> for Firmware<C> {
    #[inline(always)]
    fn stage(&mut self, stage: Stage) {
        self.stages.enter(stage);
    }
}

impl<const J: usize, C: Counter> Board<J> for Firmware<C> {
    fn name(&self) -> &str {
        env!("GESTUS_BOARD")
    }

    fn build(&self) -> &str {
        env!("GESTUS_BUILD")
    }

    fn begin(&mut self) {
        self.stages.begin();
    }

    fn end(&mut self, report: &Report) {
        self.last = self.stages.end();
        for (sum, &stage) in self.sums.iter_mut().zip(&self.last) {
            *sum += u64::from(stage);
        }
        self.most = self.most.max(self.total());
        crate::log::step(report, self.total());
    }

    fn stages(&self) -> &[u32] {
        &self.last
    }

    fn statistic(&mut self, index: u16) -> Option<Statistic> {
        let [query, search, decode, regression, timing, rest, contacts, lock] = self.sums;
        Some(match index {
            0 => (counter::STATIC_BYTES, (memory::static_bytes() + self.state) as u64),
            1 => (counter::STACK_BYTES, stack::used().saturating_sub(self.state) as u64),
            2 => (counter::INSTRUCTIONS, self.sums.iter().sum()),
            3 => (counter::INSTRUCTIONS_MAX, u64::from(self.most)),
            4 => (counter::INSTRUCTIONS_QUERY, query),
            5 => (counter::INSTRUCTIONS_SEARCH, search),
            6 => (counter::INSTRUCTIONS_DECODE, decode),
            7 => (counter::INSTRUCTIONS_REGRESSION, regression),
            8 => (counter::INSTRUCTIONS_TIMING, timing),
            9 => (counter::INSTRUCTIONS_REST, rest),
            10 => (counter::INSTRUCTIONS_OPEN, self.open),
            11 => (counter::INSTRUCTIONS_CONTACTS, contacts),
            12 => (counter::INSTRUCTIONS_LOCK, lock),
            _ => return None,
        })
    }
}
