//! Motion graphs (Kovar, Gleicher and Pighin 2002): long streams of many actions from short clips, as Xia 2015 (sections 7,
//! 7.1 and 8) makes its inputs.
//!
//! A node is a frame of a clip. From every frame the clip continues, or there is a transition to a frame of another clip:
//! the two clips are blended over a third of a second. A transition costs the mean squared distance of the features that the
//! search compares (Xia 2015, eq. 1) at the start, in the middle and at the end of the blend. A walk stays in a clip for a
//! while, then goes to a class that it has visited least, by the cheapest transition there is.
//!
//! Transitions are weighed where a walk needs them; no graph is stored. The path over the ground is integrated from the
//! blended velocities, so that nothing jumps. Feet are left as the blend makes them.

use std::collections::BTreeSet;

use nalgebra::Vector3;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use thiserror::Error;

use gestus_core::blob::layout::{MAX_FEATURES, dof};
use gestus_motion::{
    body::{Body, about_y},
    clip::{Clip, Frame, interpolate},
    corpus::Corpus,
    landmarks::LandmarkError,
    statistics::smoothstep,
};

use crate::search::features::{Cloud, FeatureSpace, clouds};

/// Length of a blend, seconds.
const BLEND_S: f64 = 1.0 / 3.0;
/// Frames of the search's window, as `BuildOptions` has it by default.
const WINDOW: usize = 5;

/// Options of a walk.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct WalkOptions {
    /// Length, seconds.
    pub seconds: f64,
    /// Seed of its random choices: the same seed gives the same walk.
    pub seed: u64,
    /// Least time in a clip between two transitions, seconds; at most twice as long. Shorter clips are left earlier.
    pub stay_s: f64,
}

/// Clips that make no graph.
#[derive(Debug, Error)]
pub enum GraphError {
    /// The skeleton.
    #[error(transparent)]
    Landmark(#[from] LandmarkError),
    /// A class of short clips.
    #[error(
        "{action} in {style}: no clip has the {least_s:.1} s that a stay between two blends takes: leave the class out \
         (--actions, --styles), or add longer clips"
    )]
    Short {
        /// Action of the class.
        action: String,
        /// Style of the class.
        style: String,
        /// Least length of a clip, seconds.
        least_s: f64,
    },
    /// Nowhere to go.
    #[error("a motion graph takes two clips at least, and there is {0}")]
    Few(usize),
}

/// What is known of a frame of a walk.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Label {
    /// Action, by number. A blend has the labels of its nearer end.
    pub action: usize,
    /// Style, by number.
    pub style: usize,
    /// The clip of the corpus.
    pub clip: usize,
    /// The clip's frame.
    pub frame: usize,
    /// Whether two clips are blended.
    pub blend: bool,
}

/// A transition of a walk.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Transition {
    /// First frame of its blend in the walk.
    pub frame: usize,
    /// Its cost: mean squared distance of a joint, square metres.
    pub distance2: f64,
}

/// A walk through the graph.
#[derive(Debug, Clone)]
pub struct Walk {
    /// The motion.
    pub clip: Clip,
    /// What each frame shows. Shape `[frames]`.
    pub labels: Vec<Label>,
    /// The transitions, in order.
    pub transitions: Vec<Transition>,
}

/// A motion graph over the clips of a corpus.
pub struct MotionGraph<'a> {
    corpus: &'a Corpus,
    body: Body,
    /// Dofs of each clip. Shape `[clips][frames][D]`.
    rows: Vec<Vec<Vec<f64>>>,
    /// Features of each clip. Shape `[clips][frames][F]`.
    features: Vec<Vec<Vec<f64>>>,
    /// Action and style of each class.
    classes: Vec<(usize, usize)>,
    /// Frames of a blend.
    blend: usize,
}

impl<'a> MotionGraph<'a> {
    /// The graph of all clips that are long enough.
    ///
    /// # Errors
    /// [`GraphError`] where a class has no such clip, or the skeleton no legs.
    pub fn of(corpus: &'a Corpus) -> Result<Self, GraphError> {
        let body = Body::of(corpus)?;
        let blend = ((BLEND_S * corpus.rate_hz).round() as usize).max(WINDOW);
        let windows: Vec<Vec<Cloud>> = corpus.examples.iter().map(|e| clouds(&e.clip, WINDOW)).collect();
        let all: Vec<Cloud> = windows.concat();
        if corpus.examples.len() < 2 {
            return Err(GraphError::Few(corpus.examples.len()));
        }
        let groups = vec![0; body.skeleton.joints()];
        let space = FeatureSpace::of(&body, &groups, &all, WINDOW, MAX_FEATURES);
        let features = windows.iter().map(|w| w.iter().map(|c| space.feature(c)).collect()).collect();
        let rows = corpus.examples.iter().map(|e| body.clip_dofs(&e.clip)).collect();
        let classes: BTreeSet<(usize, usize)> = corpus.examples.iter().map(|e| (e.action, e.style)).collect();
        let graph = Self { corpus, body, rows, features, classes: classes.into_iter().collect(), blend };
        for &class in &graph.classes {
            if graph.clips(class, None).is_empty() {
                let (action, style) = (corpus.actions[class.0].clone(), corpus.styles[class.1].clone());
                let least_s = graph.least() as f64 / corpus.rate_hz;
                return Err(GraphError::Short { action, style, least_s });
            }
        }
        Ok(graph)
    }

    /// Frames that a clip needs: to blend in, to blend out, and a frame between.
    fn least(&self) -> usize {
        2 * self.blend + 2
    }

    /// The clips of a class that are long enough, but for one.
    fn clips(&self, class: (usize, usize), but: Option<usize>) -> Vec<usize> {
        let examples = &self.corpus.examples;
        (0..examples.len())
            .filter(|&i| (examples[i].action, examples[i].style) == class && Some(i) != but)
            .filter(|&i| examples[i].clip.frames.len() >= self.least())
            .collect()
    }

    fn class_of(&self, clip: usize) -> (usize, usize) {
        (self.corpus.examples[clip].action, self.corpus.examples[clip].style)
    }

    /// A walk. Every class is visited once before any is visited twice, and so on.
    pub fn walk(&self, options: &WalkOptions) -> Walk {
        let mut rng = ChaCha8Rng::seed_from_u64(options.seed);
        let rate = self.corpus.rate_hz;
        let wanted = (options.seconds * rate).round().max(1.0) as usize;
        let mut visits = vec![0u32; self.classes.len()];
        let mut path =
            Path { graph: self, frames: Vec::new(), labels: Vec::new(), at: GroundPose::default() };
        let mut transitions = Vec::new();
        let first = self.classes[rng.random_range(0..self.classes.len())];
        let clips = self.clips(first, None);
        let (mut clip, mut frame) = (clips[rng.random_range(0..clips.len())], 0);
        loop {
            visits[self.classes.iter().position(|&c| c == self.class_of(clip)).unwrap_or_default()] += 1;
            let stay = ((options.stay_s * (1.0 + rng.random::<f64>())) * rate).round() as usize;
            let class = self.next_class(&visits, clip, &mut rng);
            let (from, to, entry, distance2) = self.cheapest(clip, frame, stay, class);
            path.follow(clip, frame..from);
            transitions.push(Transition { frame: path.frames.len(), distance2 });
            path.blend((clip, from), (to, entry));
            (clip, frame) = (to, entry + self.blend);
            if path.frames.len() >= wanted {
                break;
            }
        }
        path.frames.truncate(wanted);
        path.labels.truncate(wanted);
        transitions.retain(|t| t.frame < wanted);
        let name = format!("graph_{}", options.seed);
        let skeleton = self.corpus.skeleton.clone();
        let clip = Clip { name, skeleton, rate_hz: rate, frames: path.frames };
        Walk { clip, labels: path.labels, transitions }
    }

    /// A class that was visited least, another than the present one where there is one.
    fn next_class(&self, visits: &[u32], clip: usize, rng: &mut impl Rng) -> (usize, usize) {
        let now = self.class_of(clip);
        let others: Vec<usize> = (0..visits.len()).filter(|&c| self.classes[c] != now).collect();
        let Some(least) = others.iter().map(|&c| visits[c]).min() else { return now };
        let least: Vec<usize> = others.into_iter().filter(|&c| visits[c] == least).collect();
        self.classes[least[rng.random_range(0..least.len())]]
    }

    /// The cheapest transition from a clip after a stay to a class: the clip's frame, the other clip and its frame, the
    /// cost.
    fn cheapest(
        &self,
        clip: usize,
        frame: usize,
        stay: usize,
        class: (usize, usize),
    ) -> (usize, usize, usize, f64) {
        let last = self.rows[clip].len() - self.blend - 1;
        let until = (frame + 2 * stay).clamp(frame, last);
        // A clip that ends before the stay does is left in its last third.
        let since = (frame + stay).min(until - (until - frame) / 3);
        let mut clips = self.clips(class, Some(clip));
        if clips.is_empty() {
            clips = self.clips(class, None);
        }
        let mut best = (since, clips[0], 0, f64::INFINITY);
        for from in since..=until {
            for &to in &clips {
                for entry in 0..=self.rows[to].len() - self.least() {
                    let distance2 = self.distance2((clip, from), (to, entry));
                    if distance2 < best.3 {
                        best = (from, to, entry, distance2);
                    }
                }
            }
        }
        best
    }

    /// Mean squared distance of two clips over a blend that begins at those frames.
    fn distance2(&self, a: (usize, usize), b: (usize, usize)) -> f64 {
        let at = [0, self.blend / 2, self.blend - 1];
        let of = |o: usize| {
            let (p, q) = (&self.features[a.0][a.1 + o], &self.features[b.0][b.1 + o]);
            p.iter().zip(q).map(|(p, q)| (p - q).powi(2)).sum::<f64>()
        };
        at.map(of).iter().sum::<f64>() / at.len() as f64
    }
}

/// Where a walk is on the ground, metres, and its heading, radians.
#[derive(Debug, Clone, Copy, Default)]
struct GroundPose {
    ground: Vector3<f64>,
    heading: f64,
}

/// The frames of a walk so far.
struct Path<'a> {
    graph: &'a MotionGraph<'a>,
    frames: Vec<Frame>,
    labels: Vec<Label>,
    at: GroundPose,
}

impl Path<'_> {
    /// Continues by velocities in a frame's heading, metres and radians a second: the inverse of [`Body::clip_dofs`].
    fn advance(&mut self, forward: f64, left: f64, yaw: f64) {
        if self.frames.is_empty() {
            return;
        }
        let step_s = 1.0 / self.graph.corpus.rate_hz;
        self.at.ground += about_y(self.at.heading) * Vector3::new(left, 0.0, forward) * step_s;
        self.at.heading += yaw * step_s;
    }

    fn pose(&self, row: &[f64]) -> Frame {
        self.graph.body.pose(row, [self.at.ground.x, self.at.ground.z], self.at.heading)
    }

    fn label(&mut self, clip: usize, frame: usize, blend: bool) {
        let (action, style) = self.graph.class_of(clip);
        self.labels.push(Label { action, style, clip, frame, blend });
    }

    /// Frames of a clip as they are.
    fn follow(&mut self, clip: usize, frames: std::ops::Range<usize>) {
        for frame in frames {
            let row = &self.graph.rows[clip][frame];
            self.advance(row[dof::FORWARD], row[dof::LEFT], row[dof::YAW]);
            self.frames.push(self.pose(row));
            self.label(clip, frame, false);
        }
    }

    /// A blend of two clips from those frames on.
    fn blend(&mut self, from: (usize, usize), to: (usize, usize)) {
        let count = self.graph.blend;
        for k in 0..count {
            let (a, b) = (&self.graph.rows[from.0][from.1 + k], &self.graph.rows[to.0][to.1 + k]);
            let t = smoothstep((k + 1) as f64 / (count + 1) as f64);
            let mix = |d: usize| a[d] + t * (b[d] - a[d]);
            self.advance(mix(dof::FORWARD), mix(dof::LEFT), mix(dof::YAW));
            self.frames.push(interpolate(&self.pose(a), &self.pose(b), t));
            let (clip, frame) = if t < 0.5 { from } else { to };
            self.label(clip, frame + k, true);
        }
    }
}
