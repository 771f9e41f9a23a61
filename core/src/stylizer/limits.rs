//! The last checks of an output: the speed of its joints ([`crate::output::speed_limit`]), and whether it is a valid pose.

use super::{Stylizer, spike::Spike};
use crate::{
    Config, Degraded, Pose, Report,
    blob::layout::{MAX_GROUPS, dof},
    math::{clamp, minimum},
    output::speed_limit,
};

/// The speed limit for which the style's speed is the limit. Another limit scales it.
const DEFAULT_LIMIT: f32 = Config::new().speed_limit;
/// How many times the input's limit a quick style may have: with the default, twice the input's fastest joint.
const MAX_STYLE_RATIO: f32 = 5.0 / 3.0;

impl<const J: usize, const K: usize, const C: usize> Stylizer<'_, J, K, C> {
    /// Limits the joints to the input's speed, or to the style's if that is greater or the stream begins.
    #[inline(never)]
    pub(super) fn limit_speed(&mut self, report: &Report, frames: f32, output: &mut Pose<J>) {
        let Some(last) = self.last.as_ref() else { return };
        let (database, settings) = (&self.database, &self.settings);
        let nearest = report.classes.first().map(|share| database.labels(usize::from(share.class))[0]);
        let action = self.limit.likely_action(nearest);
        let (speed, seconds) = (self.limit.max_speed(self.config.speed_limit), frames * report.step_s);
        // In most frames no joint is near a limit.
        if self.limit.softness() > 0.0 || speed_limit::is_faster(speed * seconds, last, output) {
            let limits = self.limits(report, action, speed);
            let groups = database.groups().take(database.counts().joints);
            let speeds = groups.map(|group| limits.get(group).copied().unwrap_or(0.0));
            let limited = speed_limit::limit_rotations(speeds, seconds, last, output);
            let has_style = settings.strength_of(database.joint_group(0)) > 0.0;
            if limited != 0 && self.config.contacts && has_style {
                self.lock.raise(&self.database, limited, output);
            }
        }
        self.limit.advance(frames / database.rate_hz());
    }

    /// The limit of each joint group, rad/s. `speed` is the input's, and `action` the input's, if known.
    fn limits(&self, report: &Report, action: Option<u16>, speed: f32) -> [f32; MAX_GROUPS] {
        let (database, settings) = (&self.database, &self.settings);
        let softness = self.limit.softness();
        // A style that plays its poses in less time than the input turns its joints that much faster.
        let tempo = 1.0 / (database.rate_hz() * report.step_s);
        let most = MAX_STYLE_RATIO * speed * clamp(tempo, 1.0, f32::INFINITY);
        let (mut limits, mut last_mix) = ([speed; MAX_GROUPS], None);
        for (group, limit) in limits.iter_mut().enumerate().take(database.counts().groups) {
            // All joint groups usually have the same mix.
            let mix = settings.mix_of(group);
            let style = match last_mix {
                Some((of, style)) if of == mix => style,
                _ => self.max_output_speed(report, action, mix),
            };
            last_mix = Some((mix, style));
            let target = match style {
                Some(style) if style < speed => speed + softness * (style - speed),
                Some(style) => clamp(style, 0.0, most),
                None => speed,
            };
            // A weaker style changes the limit less.
            *limit += clamp(settings.strength_of(group), 0.0, 1.0) * (target - speed);
        }
        limits
    }

    /// How fast joints of a mix of styles turn, rad/s, scaled by the limit over its default. `action` is the input's, if known.
    /// `None` if the database has no speeds.
    fn max_output_speed(&self, report: &Report, action: Option<u16>, mix: usize) -> Option<f32> {
        let (database, settings) = (&self.database, &self.settings);
        let actions = report.classes.iter().map(|share| database.labels(usize::from(share.class))[0]);
        // The slowest of the actions that the input may have.
        let each =
            action.into_iter().chain(actions).map(|action| settings.max_turning(database, mix, Some(action)));
        let slowest = each.reduce(|a, b| minimum(b, a));
        let turning = slowest.unwrap_or_else(|| settings.max_turning(database, mix, None));
        turning.is_finite().then(|| turning * self.config.speed_limit / DEFAULT_LIMIT)
    }

    /// Replaces an output that is not a valid pose by the input, and reports it.
    #[inline(never)]
    pub(super) fn ensure_valid(&mut self, input: &Pose<J>, report: &mut Report, output: &mut Pose<J>) {
        if output.is_valid(self.database.counts().joints) {
            return;
        }
        *output = *input;
        self.output_anchor = self.input_anchor;
        self.lock.reset();
        report.degraded.add_if(true, Degraded::PREDICTION);
    }

    /// Measures how the input has moved in `seconds`, and reports a frame before it that was wrong.
    #[inline(never)]
    pub(super) fn observe_motion(&mut self, leaps: bool, seconds: f32, report: &mut Report) {
        let (x, x_prev) = (self.signals.x.as_flattened(), self.signals.x_prev.as_flattened());
        let at = |dofs: &[f32], d: usize| dofs.get(d).copied().unwrap_or(0.0);
        let (fastest, returned) = self.spike.observe(x, x_prev, seconds);
        if leaps {
            self.spike = Spike::new();
        }
        report.degraded.add_if(returned && !leaps, Degraded::SPIKE);
        if self.config.speed_limit > 0.0 {
            self.limit.observe(&fastest, at(x, dof::YAW), seconds);
        }
        // A leap is not rest, however slow it seems.
        let still_speed = if leaps { 0.0 } else { self.config.still_speed };
        self.stillness.observe(x, at(x_prev, dof::HEIGHT), &fastest, seconds, still_speed);
    }
}
