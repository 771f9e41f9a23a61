//! One step: a pose in, the same pose in another style out.

mod configure;
pub mod effort_dial;
mod fallback;
mod faults;
mod limits;
mod many;
mod settings;
pub mod style_mix;

pub use fallback::BLEND_BACK_S;
pub use many::step_many;

use faults::FaultState;

use crate::{
    Config, ConfigError, Degraded, Observer, Pose, Report,
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
        speed_limit::Limit,
        stillness::Stillness,
        trust::Trust,
    },
    stylizer::style_mix::Settings,
};

/// No dof of a body comes near (m, rad, m/s, rad/s): a prediction beyond is held back.
const BEYOND_ANY_BODY: f32 = 1e3;
/// After a way of more frames than these, the window of the search says nothing of the motion.
const MOST_MISSED: f32 = 3.0;

/// A database and a configuration that fit the capacities of a [`Stylizer`]: all of [`Stylizer::new`] that can fail.
///
/// A board that keeps its stylizer in static memory makes it from this: a `Result` around 24 KB would pass over the
/// stack first, which has 4.
#[derive(Debug, Clone, Copy)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Fit<'db, const J: usize, const K: usize, const C: usize> {
    database: Database<'db>,
    config: Config,
}

impl<'db, const J: usize, const K: usize, const C: usize> Fit<'db, J, K, C> {
    /// Compares what is needed with the capacities.
    ///
    /// # Errors
    /// [`ConfigError`] where the database does not fit the capacities or does not hold what the method needs, or a
    /// parameter is out of its range.
    pub fn new(database: Database<'db>, config: Config) -> Result<Self, ConfigError> {
        let counts = *database.counts();
        let short = |value: usize| u16::try_from(value).unwrap_or(u16::MAX);
        // Dofs<J> has room for 3 J + 4 numbers from J = 4 on.
        if counts.joints > J || counts.dofs > 4 * J {
            return Err(ConfigError::Joints { need: short(counts.joints), have: short(J) });
        }
        if counts.classes > C {
            return Err(ConfigError::Classes { need: short(counts.classes), have: short(C) });
        }
        config.check(K)?;
        if !config.method.is_held_by(&database) {
            return Err(ConfigError::Method);
        }
        Ok(Self { database, config })
    }

    /// The stylizer, written straight to where the caller puts it. The first frame takes up its method.
    #[inline(never)]
    pub fn stylizer(self) -> Stylizer<'db, J, K, C> {
        Stylizer {
            database: self.database,
            config: self.config,
            settings: Settings::new(),
            engine: Engine::NEW,
            signals: Signals::NEW,
            input_anchor: Anchor::ORIGIN,
            output_anchor: Anchor::ORIGIN,
            lock: Lock::new(),
            limit: Limit::new(),
            stillness: Stillness::new(),
            trust: Trust::new(),
            faults: FaultState::new(),
            last: None,
        }
    }
}

/// Turns a stream of poses into another style. Owns all the RAM it needs, whose size is a constant.
///
/// `J` joints, `K` neighbors a class, `C` classes: capacities, at least those of the database and configuration.
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
    limit: Limit,
    stillness: Stillness,
    trust: Trust,
    faults: FaultState,
    last: Option<Pose<J>>,
}

/// A stylizer of tables by phase alone takes 8 KB.
#[cfg(all(target_pointer_width = "32", not(any(feature = "mar", feature = "lti", feature = "statistic"))))]
const _: () = assert!(size_of::<Stylizer<'_, 22, 1, 28>>() <= 8192);

/// What it was made of, and not its state.
#[cfg(feature = "defmt")]
impl<const J: usize, const K: usize, const C: usize> defmt::Format for Stylizer<'_, J, K, C> {
    fn format(&self, f: defmt::Formatter<'_>) {
        defmt::write!(f, "Stylizer<{}, {}, {}> of {}: {}", J, K, C, self.database, self.config);
    }
}

impl<'db, const J: usize, const K: usize, const C: usize> Stylizer<'db, J, K, C> {
    /// A stylizer that puts out the database's first style until told otherwise.
    ///
    /// # Errors
    /// [`ConfigError`] where the database does not fit the capacities or does not hold what the method needs, or a
    /// parameter is out of its range.
    pub fn new(database: Database<'db>, config: Config) -> Result<Self, ConfigError> {
        Ok(Fit::new(database, config)?.stylizer())
    }

    /// The database.
    pub fn database(&self) -> &Database<'db> {
        &self.database
    }

    /// The configuration.
    pub fn config(&self) -> &Config {
        &self.config
    }

    /// The pose that was put out last; `None` before the first of a stream.
    pub fn last_output(&self) -> Option<&Pose<J>> {
        self.last.as_ref()
    }

    /// The most work that a step can take under the settings that are in force, whatever the stream.
    pub fn worst_step(&self) -> Work {
        self.database.worst_step_of(&self.config, &Load::of(&self.settings, &self.database))
    }

    /// Forgets the stream; the next pose is a first pose. Settings stay.
    pub fn reset(&mut self) {
        self.engine.reset();
        self.lock.reset();
        self.limit = Limit::new();
        self.stillness = Stillness::new();
        self.trust = Trust::new();
        self.settings.passed = 0.0;
        self.faults = FaultState::new();
        self.last = None;
    }

    /// Takes one pose at the database's rate, gives it the style, and says what happened. Cannot fail: input that
    /// is no pose is answered with the last output, and reported; before there was one, `output` is left as it is.
    pub fn step(&mut self, input: &Pose<J>, output: &mut Pose<J>) -> Report {
        self.step_observed(input, output, &mut ())
    }

    /// [`step`](Self::step), looked into.
    // What it calls is not inlined: rooms for a pose that are needed one after the other would add up on the stack.
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
        let leaps = !first && self.leaps();
        report.degraded.set(Degraded::LEAP, leaps);
        if leaps && self.config.safety != Safety::Follow && self.is_glitch() {
            self.input_anchor = anchor;
            return self.fallback_output(Degraded::LEAP, output);
        }
        let frames = self.faults.frames();
        self.accept(leaps);
        if !first {
            self.see_motion(leaps, frames * input_step);
        }
        self.settings.glide(first, input_step);
        let frame = Frame { database: &self.database, config: &self.config, settings: &self.settings, first };
        let signals = &mut self.signals;
        self.engine.predict(&mut Context { frame, input, signals, report: &mut report, observer });
        self.engine.contacts(&mut report);
        self.see_kind(leaps || frames > MOST_MISSED, &mut report);
        self.compose_output(first, &mut report, output, observer);
        self.set_standing(report.contacts);
        self.blend_back(report.step_s, output);
        if self.config.speed_limit > 0.0 {
            if leaps {
                self.limit.soften();
            }
            self.limit_speed(&report, frames, output);
        }

        self.keep_valid(input, &mut report, output);

        let signals = &mut self.signals;
        signals.y_prev = signals.predicted;
        signals.x_prev = signals.x;
        self.last = Some(*output);
        report
    }

    /// Measures whether the input is of the database's kind, and passes it on where it is not. `breaks`: the frames before
    /// do not lead to this one.
    #[inline(never)]
    fn see_kind(&mut self, breaks: bool, report: &mut Report) {
        if breaks {
            self.trust.begin_again();
        }
        let x = self.signals.x.as_flattened();
        let velocity = [dof::FORWARD, dof::LEFT].map(|d| x.get(d).copied().unwrap_or(0.0));
        let class = report.classes.first().map(|share| usize::from(share.class));
        let seen = (class, report.distance_ratio);
        let limits = (self.config.trust, 1.0 / self.database.rate_hz());
        self.trust.see(&self.database, seen, velocity, limits, &mut self.settings.passed);
        report.passed = self.settings.passed;
        report.degraded.set(Degraded::FAR, report.passed >= 0.5);
    }

    /// Input pose to dofs.
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

    /// Yaw, strength, and the way back to a pose; leaves the final dofs in `output`.
    #[inline(never)]
    fn compose_output(
        &mut self,
        first: bool,
        report: &mut Report,
        pose: &mut Pose<J>,
        observer: &mut impl Observer<J>,
    ) {
        let root_strength = self.settings.strength_of(self.database.joint_group(0));
        let signals = &mut self.signals;
        let (x, predicted) = (signals.x.as_flattened(), signals.predicted.as_flattened_mut());
        if let (Some(rate), Some(&own), Yaw::Input) =
            (predicted.get_mut(dof::YAW), x.get(dof::YAW), self.config.yaw)
        {
            *rate = own;
        }
        let output = signals.output.as_flattened_mut();
        let keeps = !first && self.stillness.is_engaged();
        let offset = signals.scratch.as_flattened_mut();
        if keeps {
            let last = output.iter().zip(signals.x_prev.as_flattened());
            offset.iter_mut().zip(last).for_each(|(offset, (y, x))| *offset = y - x);
        }
        let held_back = apply_strength(&self.database, &self.settings, x, predicted, output);
        report.degraded.set(Degraded::PREDICTION, held_back);
        observer.predicted(&signals.x, &signals.x_prev, &signals.y_prev, &signals.output);
        let signals = &mut self.signals;
        signals.add_correction(!held_back);
        if keeps {
            let (x, offset) = (signals.x.as_flattened(), signals.scratch.as_flattened());
            self.stillness.keep(x, offset, signals.output.as_flattened_mut());
        }
        if self.stillness.stands() {
            report.contacts = self.standing();
        }
        let input_step = 1.0 / self.database.rate_hz();
        let step_s = input_step + root_strength * (report.predicted_step_s - input_step);
        // Strength beyond 1 or a blob's odd clips may ask for no time, or for hours.
        let step_s = clamp(step_s, 0.25 * input_step, 4.0 * input_step);
        report.step_s = match self.config.timing {
            Timing::Free => step_s,
            Timing::Sync => input_step,
        };

        let at = |d: usize| self.signals.output.as_flattened().get(d).copied().unwrap_or(0.0);
        if first {
            self.output_anchor = self.input_anchor;
        } else {
            self.output_anchor.ground = self.output_anchor.moved(at(dof::FORWARD), at(dof::LEFT), step_s);
            self.output_anchor.heading = match self.config.yaw {
                Yaw::Input => self.input_anchor.heading,
                Yaw::Predicted => crate::math::wrap_angle(self.output_anchor.heading + at(dof::YAW) * step_s),
            };
        }
        pose::to_pose(&self.database, self.signals.output.as_flattened(), self.output_anchor, pose);
        // At strength 0 the input is put out as it is; what the lock has done until then is eased out.
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

/// As much of what is predicted as each joint group's strength says. What no body comes to is held back, which is said.
// Of no capacity: it is compiled with the core, for speed, however its caller is.
#[inline(never)]
fn apply_strength(
    database: &Database<'_>,
    settings: &Settings,
    x: &[f32],
    predicted: &mut [f32],
    output: &mut [f32],
) -> bool {
    let mut held_back = false;
    let mut take = |strength: f32, predicted: &mut f32, x: f32, output: &mut f32| {
        // Not of NaN either.
        let is_of_a_body = crate::math::abs(*predicted) < BEYOND_ANY_BODY;
        if !is_of_a_body {
            *predicted = x;
            held_back = true;
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
        take(strength, predicted, x, output);
    }
    let maps = joints.as_chunks_mut::<3>().0.iter_mut().zip(joints_x.as_chunks::<3>().0);
    for (((predicted, x), output), strength) in maps.zip(joints_output.as_chunks_mut::<3>().0).zip(strengths)
    {
        for ((predicted, &x), output) in predicted.iter_mut().zip(x).zip(output) {
            take(strength, predicted, x, output);
        }
    }
    held_back
}
