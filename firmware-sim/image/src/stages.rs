//! Instructions of a step by stage: an observer that reads the counter where the work changes.
//!
//! A reading costs some instructions itself. How many is measured at the start, over many readings, and taken off
//! each stage as often as it was entered. The compiler may move arithmetic across a reading; the total is exact, the
//! parts are true to a few instructions an entry.

use core::hint::black_box;

use gestus_core::{Observer, Stage};

use crate::counter::Counter;

const STAGES: usize = Stage::NAMES.len();
const READINGS: u32 = 256;

/// Instructions of a frame.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Instructions {
    /// By stage, in the order of [`Stage::NAMES`].
    pub stages: [u32; STAGES],
}

impl Instructions {
    /// All stages together.
    pub fn total(&self) -> u32 {
        self.stages.iter().sum()
    }
}

/// Counts a step by stage.
#[derive(Debug)]
pub struct Stages<C> {
    counter: C,
    stage: usize,
    last: u32,
    ticks: [u32; STAGES],
    entered: [u32; STAGES],
    /// Ticks of [`READINGS`] readings.
    overhead: u32,
}

impl<C: Counter> Stages<C> {
    /// Measures what a reading costs.
    pub fn new(counter: C) -> Self {
        let mut stages =
            Self { counter, stage: 0, last: 0, ticks: [0; STAGES], entered: [0; STAGES], overhead: 0 };
        stages.begin();
        for _ in 0..READINGS {
            stages.enter(black_box(Stage::Query));
        }
        stages.overhead = stages.ticks.iter().sum();
        stages
    }

    /// A step begins.
    pub fn begin(&mut self) {
        self.ticks = [0; STAGES];
        self.entered = [0; STAGES];
        self.stage = Stage::Rest as usize;
        self.last = self.counter.now();
    }

    /// The step is done: what it took.
    pub fn end(&mut self) -> Instructions {
        self.enter(Stage::Rest);
        let (more, less) = C::RATIO;
        let mut stages = [0; STAGES];
        for ((sum, &ticks), &entered) in stages.iter_mut().zip(&self.ticks).zip(&self.entered) {
            let readings = u64::from(self.overhead) * u64::from(entered) / u64::from(READINGS);
            let ticks = u64::from(ticks).saturating_sub(readings);
            *sum = (ticks * u64::from(more) / u64::from(less)) as u32;
        }
        Instructions { stages }
    }

    #[inline(always)]
    fn enter(&mut self, stage: Stage) {
        let now = self.counter.now();
        let place = self.stage.min(STAGES - 1);
        self.ticks[place] += self.counter.since(self.last, now);
        self.entered[place] += 1;
        self.stage = stage as usize;
        self.last = now;
    }
}

impl<const J: usize, C: Counter> Observer<J> for Stages<C> {
    #[inline(always)]
    fn stage(&mut self, stage: Stage) {
        self.enter(stage);
    }
}
