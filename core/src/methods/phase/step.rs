//! One frame of the phase tables.
//!
//! The window of poses becomes a feature. Every class that the labels allow is compared with it, which gives a distance
//! and a phase ([`super::track`]). A class weighs `exp(-(D - min D) / max(12, 0.1 min D))`, where D is its smoothed
//! distance. The weighted classes make the output ([`super::mix`]), whose change of the input settles over time
//! ([`super::settle`]), so that it does not jump with the phase of a gesture or the weights of classes.
//!
//! Smoothed distances change slowly. A class that is further than all those that have weight is compared in every other
//! frame, with the gain of two frames.
//!
//! Cost: P · F products a class, then 24 a dof for each weighted class, and as many for each of its output styles.

use super::{
    mix::{CyclePoint, TableMix},
    settle::Settled,
    track::{MAX_EXPECTED_KNOTS, Track, WhitenedQuery},
};
use crate::{
    Config, Observer, Report,
    blob::{
        Database, PhaseTables,
        layout::{dof, phase::CONTACTS},
    },
    error::saturating_u32,
    math::{abs, clamp, exp, maximum},
    methods::{
        context::{Context, Frame, Needs, Signals, Translate},
        weights::{self, Share, Width, most_kept},
        work::{Load, Work},
    },
    observe::Stage,
    search::{
        found::Found,
        query::{ALIGNED, Feature, Window},
    },
};

/// Least width of the kernel that gives classes their proportions, whitened square units.
const KERNEL_WIDTH: f32 = 12.0;
/// Width of that kernel as a part of the least distance. Far from every class, as between two actions, the nearest is another
/// one in every frame.
const KERNEL_RATIO: f32 = 0.1;
/// Gain of the filter of a class's distance: weight of the current frame.
const DISTANCE_GAIN: f32 = 0.2;
/// Frames from one comparison of a far class to the next.
const FAR_INTERVAL: u8 = 2;
/// Gain of the filter of a far class's distance: that of `FAR_INTERVAL` frames, 1 - (1 - `DISTANCE_GAIN`)².
const FAR_DISTANCE_GAIN: f32 = 0.36;
/// How much further a far class is than all classes that have weight, whitened square units.
const FAR_MARGIN: f32 = 0.5 * KERNEL_WIDTH;
/// A frame's distance counts as at most this many times the sum of the filtered one and `KERNEL_WIDTH`. A wrong frame may be
/// so far from every class that the filter would need seconds to forget it.
const MAX_RISE_RATIO: f32 = 4.0;
/// What a new place in a cycle counts beside a jump to another part of a clip. More lets the effect of a wrong pose last.
const CYCLE_JUMP: f32 = 0.5;
/// Half-life of the mean forward speed and yaw rate, seconds.
const DRIFT_HALF_LIFE_S: f32 = 0.25;
/// Factor on the slopes. They were fitted to means of cycles; the drift of a stream is noisier.
const SLOPE_GAIN: f32 = 0.5;
/// Distance of a class that the labels do not allow.
const NOT_TRACKED: f32 = -1.0;
/// Ratio of the distance of a stream from a class to that of the class's own cycles.
const STREAM_DISTANCE_RATIO: f32 = 2.0;
/// Distance of a stream, over that of input like the database, from which the output settles more slowly. From one more, it
/// takes as long as after a jump.
const SLOW_DISTANCE_RATIO: f32 = 2.0;
/// Mean speed above which a class moves from place to place, m/s.
const MIN_WALK_SPEED: f32 = 0.3;
/// Part of the class's mean speed below which the body is stopping.
const STOP_SPEED_RATIO: f32 = 0.5;

/// State of the method between frames, and its scratch memory.
#[derive(Debug, Clone)]
pub(crate) struct Phase<const J: usize, const C: usize> {
    window: Window<J>,
    /// Scratch memory: first the aligned window, then the mix of the outputs.
    scratch: [[i32; ALIGNED]; J],
    tracks: [Track; C],
    /// Smoothed squared distance of each class, whitened square units.
    distances: [f32; C],
    /// Smoothed distance of the last frame's farthest class that has weight.
    farthest_kept: f32,
    /// Mean forward speed, m/s, and yaw rate, rad/s.
    drift: [f32; 2],
    settled: Settled<J>,
    /// Frames since the stream began or leapt, 1 in the first; from 255 it goes back by [`FAR_INTERVAL`].
    age: u8,
}

impl<const J: usize, const C: usize> Translate<J> for Phase<J, C> {
    const NEW: Self = Self {
        window: Window::new(),
        scratch: [[0; ALIGNED]; J],
        tracks: [Track::NEW; C],
        // Written before they are read.
        distances: [0.0; C],
        farthest_kept: 0.0,
        drift: [0.0; 2],
        settled: Settled::NEW,
        age: 0,
    };
    const NEEDS: Needs = Needs { labelled_class: true, whole_body: false };

    /// Every class is compared with the input at each of its knots; the classes that are kept are read whole.
    fn worst_step(database: &Database<'_>, config: &Config, load: &Load) -> Work {
        let mut work = Work { mixes: load.mixes, outputs: load.styles, ..Work::default() };
        let mut largest = 0;
        for (class, _) in load.classes(database) {
            let tables = database.phase_tables(class);
            let parts = tables.parts();
            work.searched += 1;
            let expected = if tables.is_cyclic { 0 } else { MAX_EXPECTED_KNOTS.min(tables.feature_knots) };
            work.distances += saturating_u32(tables.feature_knots + expected);
            work.bytes_read += saturating_u32(parts.input);
            largest = saturating_u32(parts.contacts - parts.input).max(largest);
        }
        work.classes = most_kept(config, work.searched);
        work.bytes_read += work.classes * largest;
        work
    }

    #[inline(never)]
    fn predict(&mut self, context: &mut Context<'_, '_, J, impl Observer<J>>) {
        let frame = context.frame;
        context.observer.stage(Stage::Query);
        self.window.push(frame.database, context.input);
        let mut feature: Feature = [0.0; _];
        self.window.feature(frame.database, self.scratch.as_flattened_mut(), &mut feature);
        context.observer.query(&feature);
        context.observer.stage(Stage::Search);
        let query = WhitenedQuery::new(frame.database, &feature, frame.settings.mask);
        self.age =
            if frame.first { 1 } else { self.age.checked_add(1).unwrap_or(u8::MAX - FAR_INTERVAL + 1) };
        // The first pose fills the whole window. Until it has left, the window does not show how the body moves.
        let full = usize::from(self.age).saturating_sub(frame.database.counts().window).saturating_add(1);
        let gain = 1.0 / full.max(1) as f32;
        let gain = maximum(DISTANCE_GAIN, gain);
        // While the window fills, distances are not smoothed.
        let all = gain > DISTANCE_GAIN || frame.config.prune <= 0.0;
        let far = if all { f32::INFINITY } else { self.farthest_kept + FAR_MARGIN };
        let schedule = Schedule { gain, turn: self.age.wrapping_sub(1) % FAR_INTERVAL, far };
        let tracked = track(frame, &query, schedule, &mut self.tracks, &mut self.distances, context.report);
        self.farthest_kept = tracked.farthest_kept;
        for (class, &distance) in self.distances.iter().enumerate().take(frame.database.counts().classes) {
            if distance >= 0.0 {
                context.observer.searched(class, &Found::no_frames(distance));
            }
        }
        context.observer.stage(Stage::Regression);
        if frame.first {
            self.init_history(frame, context.signals, context.report);
        }
        self.follow_drift(frame, context.signals.x.as_flattened());
        let elsewhere = if self.age == 1 { 1.0 } else { tracked.elsewhere };
        self.mix(frame, context.signals, context.report, elsewhere);
        context.observer.stage(Stage::Rest);
    }

    fn forget_window(&mut self) {
        self.age = 0;
        self.window.clear();
    }

    fn reset(&mut self) {
        self.window.clear();
    }
}

/// Which classes a frame compares with the input, and the gain of their distances' filter.
#[derive(Clone, Copy)]
struct Schedule {
    /// Gain of the distances' filter; more than [`DISTANCE_GAIN`] while the window fills.
    gain: f32,
    /// Which of the far classes are compared: below [`FAR_INTERVAL`].
    turn: u8,
    /// Smoothed distance beyond which a class is far.
    far: f32,
}

impl Schedule {
    /// Whether a far class is compared in this frame.
    fn includes(self, class: usize) -> bool {
        class % usize::from(FAR_INTERVAL) == usize::from(self.turn)
    }
}

/// What the comparison with all classes found.
struct Tracked {
    /// Smoothed distance of the farthest class that has weight.
    farthest_kept: f32,
    /// 1 if the body is elsewhere in the clip of the nearest class than the last frame led to, [`CYCLE_JUMP`] if it is
    /// elsewhere in its cycle, otherwise 0.
    elsewhere: f32,
}

/// Distance and phase of every class that the labels allow, and their proportions.
// Of no capacity: it is compiled with the core, for speed, however its caller is.
#[inline(never)]
fn track(
    frame: Frame<'_, '_>,
    query: &WhitenedQuery,
    schedule: Schedule,
    tracks: &mut [Track],
    distances: &mut [f32],
    report: &mut Report,
) -> Tracked {
    let Frame { database, config, settings, first } = frame;
    let (mut least, mut nearest_elsewhere) = (f32::INFINITY, 0.0);
    let rate_hz = database.rate_hz();
    let classes = database.counts().classes;
    let tables_of = database.all_phase_tables();
    for (class, (track, distance)) in tracks.iter_mut().zip(&mut *distances).enumerate().take(classes) {
        if !settings.allow(database.labels(class)) {
            *distance = NOT_TRACKED;
            continue;
        }
        let is_far = *distance > schedule.far;
        if is_far && !schedule.includes(class) {
            continue;
        }
        let tables = tables_of(class);
        let is_new = first || *distance < 0.0 || schedule.gain >= 1.0;
        let expected = if is_new || is_far { None } else { track.expected_knots(&tables, rate_hz) };
        report.visits +=
            tables.feature_knots as u32 + expected.as_ref().map_or(0, |knots| knots.len() as u32);
        let found = query.project(&tables, expected);
        let mut elsewhere = if found.is_expected { 0.0 } else { 1.0 };
        let most = MAX_RISE_RATIO * (*distance + KERNEL_WIDTH);
        let rise = if found.distance2 < most { found.distance2 } else { most } - *distance;
        if is_new {
            *track = Track::begin(&tables, found.phase, rate_hz);
            *distance = found.distance2;
        } else if is_far {
            track.phase = found.phase;
            *distance += FAR_DISTANCE_GAIN * rise;
        } else {
            if track.follow(&tables, found.phase, rate_hz) {
                elsewhere = CYCLE_JUMP;
            }
            *distance += schedule.gain * rise;
        }
        if *distance < least {
            (least, nearest_elsewhere) = (*distance, elsewhere);
        }
        report.bytes_read += tables.parts().input as u32;
    }
    let distances = distances.get(..classes).unwrap_or(&[]);
    let most = usize::from(config.classes);
    let cut = weights::proportions(
        distances,
        Width::relative(KERNEL_RATIO).at_least(KERNEL_WIDTH),
        config.prune,
        most,
        &mut report.classes,
    );
    report.degraded.add_if(cut, crate::Degraded::CLASSES);
    let distance_of = |share: Option<&Share>| {
        share.and_then(|s| distances.get(usize::from(s.class))).copied().unwrap_or(0.0)
    };
    report.distance2 = distance_of(report.classes.first());
    Tracked { farthest_kept: distance_of(report.classes.last()), elsewhere: nearest_elsewhere }
}

impl<const J: usize, const C: usize> Phase<J, C> {
    /// A first pose has no frame before it, so it gets the mean velocities of the nearest class.
    fn init_history(&mut self, frame: Frame<'_, '_>, signals: &mut Signals<J>, report: &Report) {
        if let Some(&nearest) = report.classes.first() {
            let tables = frame.database.phase_tables(usize::from(nearest.class));
            self.drift = tables.drift;
            let slots = signals.x.as_flattened_mut().get_mut(dof::FORWARD..=dof::YAW);
            let means = [tables.drift[0], 0.0, tables.drift[1]];
            slots.into_iter().flatten().zip(means).for_each(|(slot, mean)| *slot = mean);
        }
        signals.x_prev = signals.x;
        signals.y_prev = signals.x;
    }

    /// Updates the mean velocities with those of the frame.
    fn follow_drift(&mut self, frame: Frame<'_, '_>, x: &[f32]) {
        let gain = 1.0 - exp(-core::f32::consts::LN_2 / (DRIFT_HALF_LIFE_S * frame.database.rate_hz()));
        // The first velocity is the class's. A plain mean of the velocities so far is used until the filter is slower.
        let mean_gain = 1.0 / f32::from(self.age.saturating_sub(1).max(1));
        let gain = maximum(mean_gain, gain);
        for (mean, d) in self.drift.iter_mut().zip([dof::FORWARD, dof::YAW]) {
            *mean += gain * (x.get(d).copied().unwrap_or(0.0) - *mean);
        }
    }

    /// The mix of the classes' outputs, the time step and the contacts. `elsewhere` is that of [`Tracked`], and 1 where a
    /// stream begins or leaps.
    #[inline(never)]
    fn mix(&mut self, frame: Frame<'_, '_>, signals: &mut Signals<J>, report: &mut Report, elsewhere: f32) {
        let Frame { database, settings, .. } = frame;
        let dofs = database.counts().dofs;
        let x = signals.x.as_flattened().get(..dofs).unwrap_or(&[]);
        let predicted = signals.predicted.as_flattened_mut();
        let input_step = 1.0 / database.rate_hz();
        let root_mix = settings.mix_of(database.joint_group(0));
        let strength = clamp(settings.strength_of(database.joint_group(0)), 0.0, 1.0);
        let (mut step_s, mut likelihood) = (0.0, [0.0; 2]);
        let (mut far, mut stands) = (0.0, 0.0f32);
        let mut mixed = TableMix::new(database, x, self.scratch.as_flattened_mut());
        let mut i = 0;
        while let Some(&Share { class, proportion }) = report.classes.get(i) {
            i += 1;
            let class = usize::from(class);
            let labels = database.class(class);
            let tables = database.phase_tables(class);
            let Some(track) = self.tracks.get(class) else { continue };
            let phase = track.phase;
            let off = [self.drift[0] - tables.drift[0], self.drift[1] - tables.drift[1]];
            let point = CyclePoint::new(database, phase, off.map(|v| v * SLOPE_GAIN));
            mixed.set_input(&tables, point);
            report.bytes_read += (tables.parts().contacts - tables.parts().input) as u32;
            far += proportion * tables.far;
            if tables.drift[0] > MIN_WALK_SPEED {
                let most = STOP_SPEED_RATIO * tables.drift[0];
                stands += proportion * (1.0 - clamp(abs(self.drift[0]) / most, 0.0, 1.0));
            }
            let own = contact(&tables, phase);
            for mix in (0..=database.counts().groups).filter(|&mix| settings.uses_mix(database, mix)) {
                for (style, weight) in settings.mix(mix).weighted(database.counts().styles) {
                    let weight = proportion * weight;
                    let output = output_class(database, labels.action, style)
                        .filter(|_| style != usize::from(labels.style))
                        .map(|class| database.phase_tables(class));
                    if let Some(output) = &output {
                        mixed.add_output(output, point, weight, settings, mix);
                    }
                    if mix != root_mix {
                        continue;
                    }
                    let stands = output.as_ref().map_or(own, |output| contact(output, phase));
                    for ((sum, stands), own) in likelihood.iter_mut().zip(stands).zip(own) {
                        *sum += weight * (own + strength * (stands - own));
                    }
                    let ratio = output.map_or(1.0, |output| pace(&tables, &output, phase));
                    step_s += weight * input_step * ratio;
                }
            }
        }
        mixed.finish(x, predicted);
        report.distance_ratio =
            if far > 0.0 { report.distance2 / (STREAM_DISTANCE_RATIO * far) } else { 0.0 };
        // Between two actions, classes and phases change in every frame.
        let unlike = clamp(report.distance_ratio - SLOW_DISTANCE_RATIO, 0.0, 1.0);
        self.settled.settle(frame, signals, &report.classes, maximum(elsewhere, unlike));
        report.contact_likelihood = likelihood;
        if step_s > 0.0 {
            report.predicted_step_s = step_s;
        }
        // A body that stands goes nowhere.
        let (x, predicted) = (signals.x.as_flattened(), signals.predicted.as_flattened_mut());
        for d in [dof::FORWARD, dof::LEFT] {
            if let Some((predicted, x)) = predicted.get_mut(d).zip(x.get(d)) {
                *predicted += stands * (x - *predicted);
            }
        }
    }
}

/// The class of an action in a style.
#[inline(never)]
fn output_class(database: &Database<'_>, action: u16, style: usize) -> Option<usize> {
    (0..database.counts().classes).find(|&class| {
        let [of_action, of_style] = database.labels(class);
        of_action == action && usize::from(of_style) == style
    })
}

/// Duration of the output relative to the input, interpolated between the middles of the two halves of a cycle so that it
/// does not jump.
fn pace(input: &PhaseTables<'_>, output: &PhaseTables<'_>, phase: f32) -> f32 {
    let ratio = |half: usize| {
        let own = input.seconds.get(half).copied().unwrap_or(1.0);
        output.output_seconds.get(half).copied().unwrap_or(1.0) / own
    };
    let (first, second) = (ratio(0), ratio(1));
    // 1 in the middle of the first half, 0 in that of the second.
    let part = clamp(2.0 * abs(abs(phase - 0.25) - 0.5), 0.0, 1.0);
    second + part * (first - second)
}

/// Likelihood that the left and the right foot stand, 0 to 1.
fn contact(tables: &PhaseTables<'_>, phase: f32) -> [f32; 2] {
    let at = phase * if tables.is_cyclic { CONTACTS as f32 } else { (CONTACTS - 1) as f32 };
    let start = (at as usize).min(CONTACTS - 1);
    let end = if start + 1 < CONTACTS {
        start + 1
    } else if tables.is_cyclic {
        0
    } else {
        start
    };
    let (from, to) = (tables.contact(start), tables.contact(end));
    let part = at - start as f32;
    [from[0] + part * (to[0] - from[0]), from[1] + part * (to[1] - from[1])]
}
