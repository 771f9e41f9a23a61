//! The classes that are searched: those that may have weight.
//!
//! Most classes are too far from the input to have weight, and stay so for a while. The builder measures how fast the
//! distance of such a class falls at most ([`Database::fall`]): after n frames at least `fall(n)` of its mean squared
//! distance is left, in all but 0.5% of frames. A class is searched if this bound allows it to have weight (Xia 2015,
//! eq. 4):
//!
//! ```text
//! bound <= least · (1 + δ ln (C / prune))        least: least mean squared distance of the frame
//! ```
//!
//! All classes beyond the bound have, together, less weight than the mixture may drop. If a class turns out to fall faster
//! than its bound, every bound of that frame shrinks by the same factor. Every class is searched at the start, after a jump,
//! and under a mask, which changes what distances mean.

use crate::{
    Config,
    blob::{Database, layout::MAX_WINDOW},
    math::ln,
    methods::context::Frame,
    search::{found::Found, graph::Last},
};

/// Marks a class that the labels do not allow, or that was not searched.
const UNKNOWN: f32 = -1.0;

/// The distance of each class when it was searched last, and when that was.
#[derive(Debug, Clone)]
pub(super) struct ClassDistances<const C: usize> {
    /// Mean squared distance of each class's neighbors, weighted square metres.
    mean_distance2: [f32; C],
    /// Frames since then; stops at 255.
    age: [u8; C],
    /// Number of frames for which every class is still searched, because the window is not full.
    warmup: u8,
}

/// The classes of a frame that remain to be searched.
pub(super) struct Candidates<const C: usize> {
    /// Lower bound of each class's mean squared distance; infinite for classes that are done.
    bounds: [f32; C],
    /// Factor on all bounds, below 1 if a class has fallen faster than its bound.
    shrinkage: f32,
    /// Least mean squared distance found in this frame.
    least: f32,
    /// Ratio to the least distance beyond which a class has no weight. Infinite under a mask: the graph was not made
    /// for it, so every class needs a full search.
    cutoff: f32,
    /// True if every class is searched.
    all: bool,
}

/// Ratio of a class's mean squared distance to the least of all classes beyond which it has no weight.
pub fn relative_cutoff(config: &Config, classes: usize) -> f32 {
    if config.prune > 0.0 { 1.0 + config.delta * ln(classes as f32 / config.prune) } else { f32::INFINITY }
}

impl<const C: usize> ClassDistances<C> {
    /// The state before the first frame, which uses no distances. All zeros, as the state of a method has to be.
    pub const NEW: Self = Self { mean_distance2: [0.0; C], age: [0; C], warmup: 0 };

    /// Begins a frame, with the classes that its labels allow. `is_whole` is true if no mask leaves features out.
    pub fn candidates(&mut self, frame: Frame<'_, '_>, is_whole: bool) -> Candidates<C> {
        let Frame { database, config, settings, first } = frame;
        let classes = database.counts().classes;
        if first {
            self.restart_warmup();
        }
        let is_warm = self.warmup == 0 && is_whole && config.prune > 0.0;
        self.warmup = self.warmup.saturating_sub(1);
        let mut candidates = Candidates {
            bounds: [f32::INFINITY; C],
            shrinkage: 1.0,
            least: f32::INFINITY,
            cutoff: if is_whole { relative_cutoff(config, classes) } else { f32::INFINITY },
            all: !is_warm,
        };
        let slots = candidates.bounds.iter_mut().zip(&mut self.mean_distance2).zip(&mut self.age);
        for (class, ((bound, mean), age)) in slots.enumerate().take(classes) {
            *age = age.saturating_add(1);
            if !settings.allow(database.labels(class)) {
                *mean = UNKNOWN;
            } else if is_warm && *mean >= 0.0 {
                *bound = *mean * database.fall(usize::from(*age));
            } else {
                *bound = 0.0;
            }
        }
        candidates
    }

    /// Searches every class until the window holds only new frames.
    pub fn restart_warmup(&mut self) {
        self.warmup = MAX_WINDOW as u8;
    }

    /// True if the window is full: the stream has neither begun nor jumped just now.
    pub fn is_warm(&self) -> bool {
        self.warmup == 0
    }

    /// Mean squared distance of a class when it was searched last; negative where it has not been searched.
    pub fn last_distance2(&self, class: usize) -> f32 {
        self.mean_distance2.get(class).copied().unwrap_or(UNKNOWN)
    }

    /// What was found when a class was searched last, with the `rows` found then.
    pub fn last<'a>(&self, class: usize, rows: &'a [u16]) -> Last<'a> {
        let mean = self.last_distance2(class);
        Last { rows, mean_distance2: (mean >= 0.0).then_some(mean), frames: self.frames_since(class) }
    }

    /// Number of frames since a class was searched last.
    fn frames_since(&self, class: usize) -> usize {
        self.age.get(class).copied().map_or(0, usize::from)
    }

    /// Stores the result of a search.
    pub fn set(
        &mut self,
        database: &Database<'_>,
        class: usize,
        found: &Found<'_>,
        candidates: &mut Candidates<C>,
    ) {
        let (last, age) = (self.last_distance2(class), self.frames_since(class));
        let mean = found.mean_distance2;
        // The first class that is searched: in a warm stream the one that was nearest before.
        if found.stats.jumped && candidates.least == f32::INFINITY {
            self.restart_warmup();
            candidates.all = true;
        }
        let expected = last * database.fall(age);
        if expected > 0.0 && mean < candidates.shrinkage * expected {
            candidates.shrinkage = mean / expected;
        }
        if mean < candidates.least {
            candidates.least = mean;
        }
        if let (Some(slot), Some(age)) = (self.mean_distance2.get_mut(class), self.age.get_mut(class)) {
            (*slot, *age) = (mean, 0);
        }
    }

    /// Mean squared distances, `[classes]`; negative for classes that were not searched in this frame.
    pub fn distances(&self, database: &Database<'_>) -> [f32; C] {
        let mut distances = [UNKNOWN; C];
        let classes = self.mean_distance2.iter().zip(&self.age).take(database.counts().classes);
        for (slot, (&mean, _)) in distances.iter_mut().zip(classes).filter(|(_, (_, age))| **age == 0) {
            *slot = mean;
        }
        distances
    }
}

impl<const C: usize> Candidates<C> {
    /// Mean squared distance beyond which a class has no weight.
    pub fn cutoff_distance2(&self) -> f32 {
        if self.cutoff < f32::INFINITY { self.cutoff * self.least } else { f32::INFINITY }
    }

    /// The class with the least bound, if it may have weight. Each class is returned once.
    pub fn next(&mut self) -> Option<usize> {
        let nearest = |best: (usize, f32), (class, &bound): (usize, &f32)| {
            if bound < best.1 { (class, bound) } else { best }
        };
        let (class, bound) = self.bounds.iter().enumerate().fold((C, f32::INFINITY), nearest);
        let slot = self.bounds.get_mut(class)?;
        *slot = f32::INFINITY;
        (self.all || bound * self.shrinkage <= self.cutoff_distance2()).then_some(class)
    }
}
