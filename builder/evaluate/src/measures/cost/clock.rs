//! Times a step by stage: a watcher that reads the clock when a stage begins.
//!
//! A reading takes some 30 ns itself. What it takes is measured first, and subtracted from each stage for each time that
//! it was entered.

use std::{hint::black_box, time::Instant};

use gestus_core::{Report, Stage};
use gestus_database::stream::Watcher;

/// Number of stages.
pub(super) const STAGES: usize = Stage::NAMES.len();
/// Readings by which their own cost is measured.
const READINGS: u32 = 4096;

/// Microseconds by stage, in the order of [`Stage::NAMES`].
pub(super) type Micros = [f64; STAGES];

/// The time of every step of a stream by stage.
#[derive(Debug)]
pub(super) struct Clock {
    stage: usize,
    last: Instant,
    current: Micros,
    /// Microseconds that a reading takes.
    reading: f64,
    /// Of each step.
    pub(super) steps: Vec<Micros>,
}

impl Clock {
    /// Measures the cost of a reading.
    pub(super) fn new() -> Self {
        let mut clock =
            Self { stage: 0, last: Instant::now(), current: [0.0; STAGES], reading: 0.0, steps: Vec::new() };
        clock.begin();
        for _ in 0..READINGS {
            clock.stage(black_box(Stage::Query));
        }
        clock.reading = clock.current.iter().sum::<f64>() / f64::from(READINGS);
        clock
    }
}

impl Watcher for Clock {
    fn begin(&mut self) {
        self.current = [0.0; STAGES];
        self.stage = Stage::Rest as usize;
        self.last = Instant::now();
    }

    #[inline(always)]
    fn stage(&mut self, stage: Stage) {
        let now = Instant::now();
        self.current[self.stage] += now.duration_since(self.last).as_secs_f64() * 1e6 - self.reading;
        self.stage = stage as usize;
        self.last = now;
    }

    fn done(&mut self, _report: &Report) {
        self.stage(Stage::Rest);
        self.steps.push(self.current.map(|micros| micros.max(0.0)));
    }
}
