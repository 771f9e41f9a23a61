//! Counts the instructions of a step by stage: an observer that reads the counter when a stage begins.
//!
//! A reading costs some instructions itself. Their number is measured at the start, over many readings, and subtracted
//! from each stage for each time that it was entered. The compiler may move arithmetic across a reading, so the total
//! is exact and a stage's count is off by a few instructions an entry.

use core::hint::black_box;

use gestus_core::Stage;

use crate::counter::Counter;

/// Number of stages.
pub const STAGES: usize = Stage::NAMES.len();
const READINGS: u32 = 256;

/// Instructions by stage, in the order of [`Stage::NAMES`].
pub type Instructions = [u32; STAGES];

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
    /// Measures the cost of a reading.
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

    /// A step ends. Returns its instructions.
    pub fn end(&mut self) -> Instructions {
        self.enter(Stage::Rest);
        let mut stages = [0; STAGES];
        for ((sum, &ticks), &entered) in stages.iter_mut().zip(&self.ticks).zip(&self.entered) {
            let readings = u64::from(self.overhead) * u64::from(entered) / u64::from(READINGS);
            let ticks = u64::from(ticks).saturating_sub(readings);
            *sum = C::instructions(ticks) as u32;
        }
        stages
    }

    /// The work of a stage begins.
    #[inline(always)]
    pub fn enter(&mut self, stage: Stage) {
        let now = self.counter.now();
        let place = self.stage.min(STAGES - 1);
        self.ticks[place] += self.counter.since(self.last, now);
        self.entered[place] += 1;
        self.stage = stage as usize;
        self.last = now;
    }
}
