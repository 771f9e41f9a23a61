//! Which classes are searched: those that may have weight.
//!
//! Most classes are too far from the input to have weight, and stay so for a while. The builder measures how fast the
//! distance of such a class falls at most ([`Database::fall`]): after n frames `fall(n)` of its mean squared distance is
//! left, but for 0.5% of frames. A class is searched where that bound lets it have weight (Xia 2015, eq. 4):
//!
//! ```text
//! bound <= least · (1 + δ ln (C / prune))        least mean squared distance of the frame
//! ```
//!
//! Together, the classes beyond have less weight than the mixture may drop. Where a class is seen to fall faster than the
//! bound, every bound of that frame shrinks with it. At the start, after a jump, and where a mask changes what distances
//! mean, every class is searched.

use crate::{
    Config,
    blob::{Database, layout::MAX_WINDOW},
    math::ln,
    methods::context::Frame,
    search::found::Found,
};

/// Mean squared distance of a class that the labels don't allow, or that was not searched.
const UNKNOWN: f32 = -1.0;

/// When each class was searched last, and how far it was.
#[derive(Debug, Clone)]
pub(super) struct Reach<const C: usize> {
    mean_distance2: [f32; C],
    /// Frames since; stops at 255.
    age: [u8; C],
    /// Frames for which every class is searched: the window does not show yet how the body moves.
    unsettled: u8,
}

/// The classes of a frame that are still to be searched.
pub(super) struct Candidates<const C: usize> {
    /// The least that the mean squared distance may be; infinite for classes that are done.
    bounds: [f32; C],
    /// Bounds shrink by this, because a class fell faster.
    shrunk: f32,
    /// Least mean squared distance found.
    least: f32,
    /// Distance, over the least, beyond which a class has no weight. Infinite under a mask, for which the graph was not made:
    /// there every class is searched with all that it takes to find the nearest.
    reach: f32,
    /// Every class is searched.
    all: bool,
}

/// Mean squared distance, over the least of all classes, beyond which a class has no weight.
pub fn limit(config: &Config, classes: usize) -> f32 {
    if config.prune > 0.0 { 1.0 + config.delta * ln(classes as f32 / config.prune) } else { f32::INFINITY }
}

impl<const C: usize> Reach<C> {
    /// Before the first frame, which takes no distance from here. All zeros, as a method's state has to be.
    pub const NEW: Self = Self { mean_distance2: [0.0; C], age: [0; C], unsettled: 0 };

    /// The classes that the labels of a frame allow. `is_whole`: no mask leaves a part of the features out.
    pub fn candidates(&mut self, frame: Frame<'_, '_>, is_whole: bool) -> Candidates<C> {
        let Frame { database, config, settings, first } = frame;
        let classes = database.counts().classes;
        if first {
            self.unsettle();
        }
        let is_settled = self.unsettled == 0 && is_whole && config.prune > 0.0;
        self.unsettled = self.unsettled.saturating_sub(1);
        let mut candidates = Candidates {
            bounds: [f32::INFINITY; C],
            shrunk: 1.0,
            least: f32::INFINITY,
            reach: if is_whole { limit(config, classes) } else { f32::INFINITY },
            all: !is_settled,
        };
        let slots = candidates.bounds.iter_mut().zip(&mut self.mean_distance2).zip(&mut self.age);
        for (class, ((bound, mean), age)) in slots.enumerate().take(classes) {
            *age = age.saturating_add(1);
            if !settings.allow(database.labels(class)) {
                *mean = UNKNOWN;
            } else if is_settled && *mean >= 0.0 {
                *bound = *mean * database.fall(usize::from(*age));
            } else {
                *bound = 0.0;
            }
        }
        candidates
    }

    /// Every class is searched until the window has left what was before.
    pub fn unsettle(&mut self) {
        self.unsettled = MAX_WINDOW as u8;
    }

    /// The window shows how the body moves: neither does the stream begin, nor has it jumped just now.
    pub fn is_settled(&self) -> bool {
        self.unsettled == 0
    }

    /// Mean squared distance of a class when it was searched last, and how many frames ago that was.
    pub fn last(&self, class: usize) -> (f32, usize) {
        let mean = self.mean_distance2.get(class).copied().unwrap_or(UNKNOWN);
        (mean, self.age.get(class).copied().map_or(0, usize::from))
    }

    /// A class was searched.
    pub fn set(
        &mut self,
        database: &Database<'_>,
        class: usize,
        found: &Found<'_>,
        candidates: &mut Candidates<C>,
    ) {
        let (last, age) = self.last(class);
        let mean = found.mean_distance2;
        // The first class of a frame is the one that was nearest.
        if found.stats.jumped && candidates.least == f32::INFINITY {
            self.unsettle();
            candidates.all = true;
        }
        let expected = last * database.fall(age);
        if expected > 0.0 && mean < candidates.shrunk * expected {
            candidates.shrunk = mean / expected;
        }
        if mean < candidates.least {
            candidates.least = mean;
        }
        if let (Some(slot), Some(age)) = (self.mean_distance2.get_mut(class), self.age.get_mut(class)) {
            (*slot, *age) = (mean, 0);
        }
    }

    /// Mean squared distances of the classes; those that were not searched in this frame have a negative one.
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
    pub fn enough(&self) -> f32 {
        if self.reach < f32::INFINITY { self.reach * self.least } else { f32::INFINITY }
    }

    /// The class with the least bound, if it may have weight. It is handed out once.
    pub fn next(&mut self) -> Option<usize> {
        let nearest = |best: (usize, f32), (class, &bound): (usize, &f32)| {
            if bound < best.1 { (class, bound) } else { best }
        };
        let (class, bound) = self.bounds.iter().enumerate().fold((C, f32::INFINITY), nearest);
        let slot = self.bounds.get_mut(class)?;
        *slot = f32::INFINITY;
        (self.all || bound * self.shrunk <= self.enough()).then_some(class)
    }
}
