//! What a stream computes, frame by frame, as the core shows it.

use gestus_core::{Report, search::found::Found};
use gestus_database::stream::Watcher;

/// What the search found in a class.
#[derive(Debug, Clone)]
pub struct Searched {
    /// The class.
    pub class: usize,
    /// Row of the class and squared distance, nearest first.
    pub neighbors: Vec<(u16, f32)>,
    /// Mean squared distance.
    pub mean_distance2: f32,
}

/// How the timing weighed the neighbors of a class.
#[derive(Debug, Clone)]
pub struct Timed {
    /// The class.
    pub class: usize,
    /// Rows of the class.
    pub rows: Vec<u16>,
    /// Their weights.
    pub weights: Vec<f32>,
}

/// What one step computed.
#[derive(Debug, Clone, Default)]
pub struct Frame {
    /// The query, F numbers.
    pub query: Vec<f32>,
    /// The classes that were searched.
    pub searched: Vec<Searched>,
    /// The classes that were kept.
    pub timed: Vec<Timed>,
    /// `x[t]`.
    pub x: Vec<f32>,
    /// `x[t-1]`.
    pub x_prev: Vec<f32>,
    /// `y[t-1]`, as fed back.
    pub y_prev: Vec<f32>,
    /// The prediction, after yaw and strength.
    pub predicted: Vec<f32>,
    /// What the step reported.
    pub report: Report,
}

/// Records every step of a stream.
#[derive(Debug, Clone, Default)]
pub struct Trace {
    /// One entry a step.
    pub frames: Vec<Frame>,
    now: Frame,
}

impl Watcher for Trace {
    fn query(&mut self, feature: &[f32]) {
        self.now.query = feature.to_vec();
    }
    fn searched(&mut self, class: usize, found: &Found<'_>) {
        let (neighbors, mean_distance2) = (found.neighbors().collect(), found.mean_distance2);
        self.now.searched.push(Searched { class, neighbors, mean_distance2 });
    }
    fn timed(&mut self, class: usize, rows: &[u16], weights: &[f32]) {
        self.now.timed.push(Timed { class, rows: rows.to_vec(), weights: weights.to_vec() });
    }
    fn predicted(&mut self, x: &[f32], x_prev: &[f32], y_prev: &[f32], predicted: &[f32]) {
        self.now.x = x.to_vec();
        self.now.x_prev = x_prev.to_vec();
        self.now.y_prev = y_prev.to_vec();
        self.now.predicted = predicted.to_vec();
    }
    fn done(&mut self, report: &Report) {
        self.now.report = report.clone();
        self.frames.push(std::mem::take(&mut self.now));
    }
}
