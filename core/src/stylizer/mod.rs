//! [`Stylizer`]: a pose in, the same pose in another style out.

mod configure;
pub mod effort_dial;
mod fallback;
mod faults;
mod fit;
mod limits;
mod many;
mod settings;
mod spike;
pub mod style_mix;

pub use fallback::BLEND_BACK_S;
pub use fit::Fit;
pub use many::step_many;

use faults::FaultState;
use spike::Spike;

use crate::{
    Config, Degraded, Observer, Pose, Report,
    blob::{Database, layout::dof},
    body::pose::{self, Anchor},
    config::{Safety, Timing, Yaw},
    math::clamp,
    methods::{
        context::{Context, Frame, Signals},
        engine::Engine,
        work::{Load, Work},
    },
    observe::Stage,
    output::{
        foot_lock::{self, Lock},
        joint_range,
        speed_limit::SpeedLimit,
        stillness::Stillness,
        trust::{Judged, Trust},
    },
    stylizer::style_mix::Settings,
};

/// A predicted dof (m, rad, m/s, rad/s) of at least this size is replaced by the input: no body comes near it.
const IMPLAUSIBLE: f32 = 1e3;
/// After a gap of more frames than this, the search window no longer describes the motion.
const MAX_GAP_FRAMES: f32 = 3.0;

/// Changes the style of a stream of poses. It owns all its memory, whose size is a constant.
///
/// `J`, `K` and `C` are capacities: joints, neighbors a class, and classes. They have to be at least those of the database
/// and the configuration.
#[derive(Debug, Clone)]
pub struct Stylizer<'db, const J: usize, const K: usize, const C: usize> {
    database: Database<'db>,
    config: Config,
    settings: Settings,
    engine: Engine<J, K, C>,
    signals: Signals<J>,
    input_anchor: Anchor,
    output_anchor: Anchor,
    lock: Lock,
    limit: SpeedLimit,
    stillness: Stillness,
    trust: Trust,
    faults: FaultState,
    spike: Spike<J>,
    last: Option<Pose<J>>,
}

/// A stylizer of phase tables alone takes 8 KB.
#[cfg(all(target_pointer_width = "32", not(any(feature = "mar", feature = "lti", feature = "statistic"))))]
const _: () = assert!(size_of::<Stylizer<'_, 22, 1, 28>>() <= 8192);

/// Shows the capacities, database and configuration, without the state.
#[cfg(feature = "defmt")]
impl<const J: usize, const K: usize, const C: usize> defmt::Format for Stylizer<'_, J, K, C> {
    fn format(&self, f: defmt::Formatter<'_>) {
        defmt::write!(f, "Stylizer<{}, {}, {}> of {}: {}", J, K, C, self.database, self.config);
    }
}

impl<'db, const J: usize, const K: usize, const C: usize> Stylizer<'db, J, K, C> {
    /// The database.
    pub fn database(&self) -> &Database<'db> {
        &self.database
    }

    /// The configuration.
    pub fn config(&self) -> &Config {
        &self.config
    }

    /// The last output; `None` before the first frame of a stream.
    pub fn last_output(&self) -> Option<&Pose<J>> {
        self.last.as_ref()
    }

    /// An upper bound on the work of a step under the current settings, for any stream.
    pub fn worst_step(&self) -> Work {
        self.database.worst_step_of(&self.config, &Load::of(&self.settings, &self.database))
    }

    /// Forgets the stream, so that the next pose is a first pose. Settings stay.
    pub fn reset(&mut self) {
        self.engine.reset();
        self.lock.reset();
        self.limit = SpeedLimit::new();
        self.stillness = Stillness::new();
        self.trust = Trust::new();
        self.settings.passed = 0.0;
        self.faults = FaultState::new();
        self.spike = Spike::new();
        self.last = None;
    }

    /// Gives one pose the output style. Poses are expected at the database's rate.
    ///
    /// A step cannot fail; the report says what happened. Where `input` is not a valid pose, or leaps and
    /// [`Config::safety`] tolerates it, `output` follows that policy: the last output, or a pose on its way to rest.
    /// Before the first valid pose, `output` is not changed.
    pub fn step(&mut self, input: &Pose<J>, output: &mut Pose<J>) -> Report {
        self.step_observed(input, output, &mut ())
    }

    /// [`step`](Self::step) with an observer that sees intermediate results.
    // The functions called here are not inlined, so that their locals do not add up on the stack.
    #[inline(never)]
    pub fn step_observed(
        &mut self,
        input: &Pose<J>,
        output: &mut Pose<J>,
        observer: &mut impl Observer<J>,
    ) -> Report {
        let input_step = 1.0 / self.database.rate_hz();
        let mut report = Report { step_s: input_step, predicted_step_s: input_step, ..Report::default() };
        if !input.is_valid(self.database.counts().joints) {
            return self.fallback_output(Degraded::INPUT, output);
        }
        let first = self.last.is_none();
        let anchor = self.input_anchor;
        self.extract_dofs(input, first);
        let leaps = !first && self.is_leap();
        report.degraded.add_if(leaps, Degraded::LEAP);
        if leaps && self.config.safety != Safety::Follow && self.tolerate_leap() {
            self.input_anchor = anchor;
            return self.fallback_output(Degraded::LEAP, output);
        }
        let frames = self.faults.frames();
        self.accept(leaps);
        if !first {
            self.observe_motion(leaps, frames * input_step, &mut report);
        }
        self.settings.advance_strengths(first, input_step);
        let frame = Frame { database: &self.database, config: &self.config, settings: &self.settings, first };
        let signals = &mut self.signals;
        self.engine.predict(&mut Context { frame, input, signals, report: &mut report, observer });
        report.contacts = report.contact_likelihood.map(|likelihood| likelihood > 0.5);
        self.update_trust(leaps || frames > MAX_GAP_FRAMES, &mut report);
        self.compose_output(first, &mut report, output, observer);
        self.set_standing(report.contacts);
        self.blend_back(report.step_s, output);
        if self.config.speed_limit > 0.0 {
            if leaps {
                self.limit.soften();
            }
            self.limit_speed(&report, frames, output);
        }

        self.ensure_valid(input, &mut report, output);

        let signals = &mut self.signals;
        signals.y_prev = signals.predicted;
        signals.x_prev = signals.x;
        self.last = Some(*output);
        report
    }

    /// Updates how much of the input is passed through, by how far it is from the database. `is_discontinuous` is true where
    /// the frames before do not lead to this one.
    #[inline(never)]
    fn update_trust(&mut self, is_discontinuous: bool, report: &mut Report) {
        if is_discontinuous {
            self.trust.restart();
        }
        let x = self.signals.x.as_flattened();
        let velocity = [dof::FORWARD, dof::LEFT].map(|d| x.get(d).copied().unwrap_or(0.0));
        let class = report.classes.first().map(|share| usize::from(share.class));
        let judged = Judged { class, ratio: report.distance_ratio };
        let (max_ratio, seconds) = (self.config.trust, 1.0 / self.database.rate_hz());
        self.trust.update(&self.database, judged, velocity, max_ratio, seconds, &mut self.settings.passed);
        report.passed = self.settings.passed;
        report.degraded.add_if(report.passed >= 0.5, Degraded::FAR);
    }

    /// Converts the input pose to dofs, and starts the method on a first frame.
    #[inline(never)]
    fn extract_dofs(&mut self, input: &Pose<J>, first: bool) {
        if first {
            self.engine.begin(self.config.method);
            let root = input.rotations.first().copied().unwrap_or(crate::math::quaternion::IDENTITY);
            self.input_anchor = Anchor::of(&self.database, input.position, root, Anchor::ORIGIN);
        }
        self.input_anchor =
            pose::to_dofs(&self.database, input, self.input_anchor, self.signals.x.as_flattened_mut());
    }

    /// From the prediction to the output pose, after which only the speed limit is left.
    #[inline(never)]
    fn compose_output(
        &mut self,
        first: bool,
        report: &mut Report,
        pose: &mut Pose<J>,
        observer: &mut impl Observer<J>,
    ) {
        let root_strength = self.settings.strength_of(self.database.joint_group(0));
        self.compose_dofs(first, report, observer);
        let input_step = 1.0 / self.database.rate_hz();
        let step_s = input_step + root_strength * (report.predicted_step_s - input_step);
        // A strength above 1 or unusual clips in a blob may give a step of no time, or of hours.
        let step_s = clamp(step_s, 0.25 * input_step, 4.0 * input_step);
        report.step_s = match self.config.timing {
            Timing::Free => step_s,
            Timing::Sync => input_step,
        };
        self.move_output_anchor(first, step_s);
        pose::to_pose(&self.database, self.signals.output.as_flattened(), self.output_anchor, pose);
        self.lock_feet(root_strength, report, pose, observer);
    }

    /// Leaves the output's dofs in `signals.output`: yaw, strength, corrections, rest where the input stands, and joints
    /// within their ranges.
    #[inline]
    fn compose_dofs(&mut self, first: bool, report: &mut Report, observer: &mut impl Observer<J>) {
        let signals = &mut self.signals;
        let (x, predicted) = (signals.x.as_flattened(), signals.predicted.as_flattened_mut());
        if let (Some(rate), Some(&input_rate), Yaw::Input) =
            (predicted.get_mut(dof::YAW), x.get(dof::YAW), self.config.yaw)
        {
            *rate = input_rate;
        }
        let output = signals.output.as_flattened_mut();
        let holds_still = !first && self.stillness.is_engaged();
        let offset = signals.scratch.as_flattened_mut();
        if holds_still {
            let last = output.iter().zip(signals.x_prev.as_flattened());
            offset.iter_mut().zip(last).for_each(|(offset, (y, x))| *offset = y - x);
        }
        let replaced = apply_strength(&self.database, &self.settings, x, predicted, output);
        report.degraded.add_if(replaced, Degraded::PREDICTION);
        observer.predicted(&signals.x, &signals.x_prev, &signals.y_prev, &signals.output);
        let signals = &mut self.signals;
        signals.add_correction(!replaced);
        if holds_still {
            let (x, offset) = (signals.x.as_flattened(), signals.scratch.as_flattened());
            self.stillness.apply(x, offset, signals.output.as_flattened_mut());
        }
        if self.config.joint_margin > 0.0 {
            let (x, output) = (signals.x.as_flattened(), signals.output.as_flattened_mut());
            joint_range::limit(&self.database, self.config.joint_margin, x, output);
        }
        if self.stillness.is_still() {
            report.contacts = self.standing();
        }
    }

    /// Moves the place and heading of the output on the ground by a step of `step_s` seconds.
    #[inline]
    fn move_output_anchor(&mut self, first: bool, step_s: f32) {
        if first {
            self.output_anchor = self.input_anchor;
            return;
        }
        let at = |d: usize| self.signals.output.as_flattened().get(d).copied().unwrap_or(0.0);
        self.output_anchor.ground = self.output_anchor.moved(at(dof::FORWARD), at(dof::LEFT), step_s);
        self.output_anchor.heading = match self.config.yaw {
            Yaw::Input => self.input_anchor.heading,
            Yaw::Predicted => crate::math::wrap_angle(self.output_anchor.heading + at(dof::YAW) * step_s),
        };
    }

    /// Holds the standing feet of `pose`, and reports which are held.
    #[inline]
    fn lock_feet(
        &mut self,
        root_strength: f32,
        report: &mut Report,
        pose: &mut Pose<J>,
        observer: &mut impl Observer<J>,
    ) {
        // At strength 0 the output is the input, and the lock's offsets are eased out.
        let on = self.config.contacts && root_strength > 0.0;
        if on || self.lock.is_engaged() {
            let tuning =
                foot_lock::Tuning { on, release_m: self.config.release_m, ease_s: self.config.ease_s };
            observer.stage(Stage::Lock);
            self.lock.hold(&self.database, &mut report.contacts, report.step_s, tuning, pose);
            observer.stage(Stage::Rest);
            (report.held, report.held_m) = (self.lock.held(), self.lock.offsets());
        }
    }
}

/// Blends input `x` and prediction by the strength of each joint group. Replaces implausible dofs of `predicted` by the
/// input, and returns true if there were any. All slices are `[dofs]`.
// Not generic over capacities, so that it is compiled with the core, optimised for speed.
#[inline(never)]
fn apply_strength(
    database: &Database<'_>,
    settings: &Settings,
    x: &[f32],
    predicted: &mut [f32],
    output: &mut [f32],
) -> bool {
    let mut replaced = false;
    let mut apply = |strength: f32, predicted: &mut f32, x: f32, output: &mut f32| {
        // Also false for NaN.
        let is_plausible = crate::math::abs(*predicted) < IMPLAUSIBLE;
        if !is_plausible {
            *predicted = x;
            replaced = true;
        }
        *output = x + strength * (*predicted - x);
    };
    let mut strengths = database.groups().map(|group| settings.strength_of(group));
    let at = |dofs: usize| dof::JOINTS.min(dofs);
    let (root, joints) = predicted.split_at_mut(at(predicted.len()));
    let (root_x, joints_x) = x.split_at(at(x.len()));
    let (root_output, joints_output) = output.split_at_mut(at(output.len()));
    let strength = strengths.next().unwrap_or(0.0);
    for ((predicted, &x), output) in root.iter_mut().zip(root_x).zip(root_output) {
        apply(strength, predicted, x, output);
    }
    let maps = joints.as_chunks_mut::<3>().0.iter_mut().zip(joints_x.as_chunks::<3>().0);
    for (((predicted, x), output), strength) in maps.zip(joints_output.as_chunks_mut::<3>().0).zip(strengths)
    {
        for ((predicted, &x), output) in predicted.iter_mut().zip(x).zip(output) {
            apply(strength, predicted, x, output);
        }
    }
    replaced
}
