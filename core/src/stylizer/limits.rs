//! What holds an output: the speed of its joints ([`crate::output::speed_limit`]), and that it is a pose.

use super::Stylizer;
use crate::{
    Config, Degraded, Pose, Report,
    blob::layout::{MAX_GROUPS, dof},
    math::clamp,
    output::speed_limit::{self, Fastest},
};

/// The speed limit at which the style's own speed is one while an output begins; another scales it.
const DEFAULT_LIMIT: f32 = Config::new().speed_limit;

impl<const J: usize, const K: usize, const C: usize> Stylizer<'_, J, K, C> {
    /// Holds joints to the input's speed, and those of an output that begins to its style's.
    #[inline(never)]
    pub(super) fn limit_speed(&mut self, report: &Report, frames: f32, output: &mut Pose<J>) {
        let Some(last) = self.last.as_ref() else { return };
        let (database, settings) = (&self.database, &self.settings);
        let mut most = [self.limit.most(self.config.speed_limit); MAX_GROUPS];
        let softness = self.limit.softness();
        let seems = report.classes.first().map(|share| database.labels(usize::from(share.class))[0]);
        let action = self.limit.known(seems);
        if softness > 0.0 {
            let mut known = None;
            for (group, most) in most.iter_mut().enumerate().take(database.counts().groups) {
                // Most often all joint groups have the same mix.
                let mix = settings.mix_of(group);
                let fastest = match known {
                    Some((of, fastest)) if of == mix => fastest,
                    _ => self.fastest(report, action, mix),
                };
                known = Some((mix, fastest));
                if fastest < *most {
                    // A weaker style is less of a limit.
                    let part = softness * clamp(settings.strength_of(group), 0.0, 1.0);
                    *most += part * (fastest - *most);
                }
            }
        }
        let groups = database.groups().take(database.counts().joints);
        let most = groups.map(|group| most.get(group).copied().unwrap_or(0.0));
        speed_limit::hold(most, frames * report.step_s, last, output);
        self.limit.pass(frames / database.rate_hz());
    }

    /// How fast joints of a mix of styles may turn while an output begins, rad/s, where the input is known to be of `action`.
    fn fastest(&self, report: &Report, action: Option<u16>, mix: usize) -> f32 {
        let (database, settings) = (&self.database, &self.settings);
        let actions = report.classes.iter().map(|share| database.labels(usize::from(share.class))[0]);
        // Of the actions that the input may be of, the slowest.
        let each =
            action.into_iter().chain(actions).map(|action| settings.fastest(database, mix, Some(action)));
        let least = each.reduce(|a, b| if b < a { b } else { a });
        let fastest = least.unwrap_or_else(|| settings.fastest(database, mix, None));
        fastest * self.config.speed_limit / DEFAULT_LIMIT
    }

    /// Whatever has gone wrong, what is put out is a pose: the input, where nothing else is left.
    #[inline(never)]
    pub(super) fn keep_valid(&mut self, input: &Pose<J>, report: &mut Report, output: &mut Pose<J>) {
        if output.is_valid(self.database.counts().joints) {
            return;
        }
        *output = *input;
        self.output_anchor = self.input_anchor;
        self.lock.reset();
        report.degraded.set(Degraded::PREDICTION, true);
    }

    /// Measures how the input has moved in `seconds`.
    #[inline(never)]
    pub(super) fn see_motion(&mut self, leaps: bool, seconds: f32) {
        let (x, x_prev) = (self.signals.x.as_flattened(), self.signals.x_prev.as_flattened());
        let at = |dofs: &[f32], d: usize| dofs.get(d).copied().unwrap_or(0.0);
        let fastest = Fastest::of(x, x_prev);
        if self.config.speed_limit > 0.0 {
            self.limit.see(&fastest, at(x, dof::YAW), seconds);
        }
        // What leaps is no rest, though its speeds are set to 0.
        let least = if leaps { 0.0 } else { self.config.still_speed };
        self.stillness.see(x, at(x_prev, dof::HEIGHT), &fastest, seconds, least);
    }
}
