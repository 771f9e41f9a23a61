//! The current settings: output style of the body and of joint groups, labels of the input, masks and strengths of joint
//! groups.
//!
//! **Strengths** that change in a running stream follow their new value by a critically damped spring, so that neither the
//! position nor the speed of a joint jumps, whatever the sequence of changes:
//!
//! ```text
//! d = s - s*;  c = (v + ω d) Δt;  s' = s* + (d + c) e^(-ω Δt);  v' = (v - ω c) e^(-ω Δt)      ω = 8 per second
//! ```
//!
//! s* is the strength that was set. Half of a change is done after 0.21 s, 95% after [`STRENGTH_S`]. A stream begins
//! with the strengths that were set. Cost: one exponential and a dozen operations a group and frame while a strength
//! changes.
//!
//! **Styles of joint groups.** A group has the body's mix of styles or its own (`StyleMix`). The regression treats each dof
//! alone, and is done once for each different mix. Time step, root and contacts follow the root's group.

use crate::{
    blob::{
        Database,
        layout::{MAX_GROUPS, MAX_STYLES},
        sections::labels_match,
    },
    math::{clamp, exp, maximum},
};

/// Time after which 95% of a change of strength is done, seconds.
pub const STRENGTH_S: f32 = 0.6;
/// Rate ω of the spring, 1/s.
const STRENGTH_RATE: f32 = 8.0;
/// Distance from its target at which a strength snaps to it.
const STRENGTH_TOLERANCE: f32 = 1e-4;
/// Greatest strength of a style.
pub(crate) const MAX_STRENGTH: f32 = 2.0;
/// Greatest number of styles in the mix of a joint group.
pub const MAX_GROUP_STYLES: usize = 3;

/// Weight of each output style; they sum to 1. The first S are used.
pub type StyleWeights = [f32; MAX_STYLES];

/// The mix of styles of a joint group.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct GroupStyle {
    pub weights: [f32; MAX_GROUP_STYLES],
    pub styles: [u8; MAX_GROUP_STYLES],
    /// Number of styles; 0 where the group follows the body.
    pub count: u8,
}

impl GroupStyle {
    pub const NONE: Self = Self { weights: [0.0; MAX_GROUP_STYLES], styles: [0; MAX_GROUP_STYLES], count: 0 };
}

/// A mix of styles: the body's, or that of a joint group.
#[derive(Clone, Copy)]
pub(crate) struct StyleMix<'a> {
    settings: &'a Settings,
    id: usize,
}

impl StyleMix<'_> {
    /// Weight of a style; a mix's weights sum to 1.
    #[inline(never)]
    pub fn weight(self, style: usize) -> f32 {
        let group_style = self.id.checked_sub(1).and_then(|group| self.settings.group_styles.get(group));
        let Some(group_style) = group_style else {
            return self.settings.styles.get(style).copied().unwrap_or(0.0);
        };
        let pairs = group_style.styles.iter().zip(group_style.weights).take(usize::from(group_style.count));
        pairs.filter(|(s, _)| usize::from(**s) == style).map(|(_, weight)| weight).sum()
    }

    /// The styles with weight among the first `styles`, and their weights.
    pub fn weighted(self, styles: usize) -> impl Iterator<Item = (usize, f32)> {
        (0..styles).map(move |s| (s, self.weight(s))).filter(|(_, weight)| *weight > 0.0)
    }
}

/// The current settings. Every change is checked against the database; a refused change has no effect.
#[derive(Debug, Clone)]
pub(crate) struct Settings {
    pub styles: StyleWeights,
    pub action: Option<u16>,
    pub input_style: Option<u16>,
    /// One bit a joint group: whether the search compares it.
    pub mask: u8,
    group_styles: [GroupStyle; MAX_GROUPS],
    /// The mix of each group: 0 for the body's, else one more than the first group that has it.
    mixes: [u8; MAX_GROUPS],
    /// Strength of each joint group as it was set.
    pub strength: [f32; MAX_GROUPS],
    /// Current strength of each joint group, and its rate of change, 1/s.
    strength_now: [[f32; 2]; MAX_GROUPS],
    /// Part of the input that is passed through, 0 to 1. Strengths are multiplied by 1 - `passed`.
    pub passed: f32,
}

impl Settings {
    /// The first style, no labels, everything searched, full strength.
    pub fn new() -> Self {
        let mut styles = [0.0; MAX_STYLES];
        styles[0] = 1.0;
        Self {
            styles,
            action: None,
            input_style: None,
            mask: u8::MAX,
            group_styles: [GroupStyle::NONE; MAX_GROUPS],
            mixes: [0; MAX_GROUPS],
            strength: [1.0; MAX_GROUPS],
            strength_now: [[1.0, 0.0]; MAX_GROUPS],
            passed: 0.0,
        }
    }

    /// Strength of a joint group in this frame.
    pub fn strength_of(&self, group: usize) -> f32 {
        self.strength_now.get(group).map_or(1.0, |[strength, _]| *strength) * (1.0 - self.passed)
    }

    /// Advances the strengths by a frame. In a first frame they are those that were set.
    pub fn advance_strengths(&mut self, first: bool, step_s: f32) {
        for ([now, speed], &target) in self.strength_now.iter_mut().zip(&self.strength) {
            let off = *now - target;
            if first || (-STRENGTH_TOLERANCE..STRENGTH_TOLERANCE).contains(&off) {
                (*now, *speed) = (target, 0.0);
                continue;
            }
            let decay = exp(-STRENGTH_RATE * step_s);
            let change = (*speed + STRENGTH_RATE * off) * step_s;
            // A target that changes meanwhile can make the spring overshoot.
            *now = clamp(target + (off + change) * decay, 0.0, MAX_STRENGTH);
            *speed = (*speed - STRENGTH_RATE * change) * decay;
        }
    }

    /// The mix of styles of a joint group, by number: 0 the body's; groups of equal mixes have one number.
    pub fn mix_of(&self, group: usize) -> usize {
        self.mixes.get(group).copied().map_or(0, usize::from)
    }

    /// Sets or removes the mix of a group. Returns true if it has changed.
    pub fn set_group_style(&mut self, group: usize, group_style: GroupStyle) -> bool {
        let Some(slot) = self.group_styles.get_mut(group).filter(|slot| **slot != group_style) else {
            return false;
        };
        *slot = group_style;
        for (mix, group_style) in self.mixes.iter_mut().zip(&self.group_styles) {
            let first =
                self.group_styles.iter().position(|o| o == group_style).filter(|_| group_style.count > 0);
            *mix = first.map_or(0, |first| first as u8 + 1);
        }
        true
    }

    /// True where a joint group has styles of its own.
    pub fn has_group_styles(&self) -> bool {
        self.mixes != [0; MAX_GROUPS]
    }

    /// Whether a joint group has that mix of styles.
    pub fn uses_mix(&self, database: &Database<'_>, mix: usize) -> bool {
        (0..database.counts().groups).any(|group| self.mix_of(group) == mix)
    }

    /// Speed of the fastest joint of an action in a mix of styles, rad/s. Of any action if `action` is `None`; infinite
    /// if the blob has no speeds.
    #[inline(never)]
    pub fn max_turning(&self, database: &Database<'_>, mix: usize, action: Option<u16>) -> f32 {
        let mix = self.mix(mix);
        let mut most = 0.0;
        for class in 0..database.counts().classes {
            let [of_action, style] = database.labels(class);
            if action.is_none_or(|action| action == of_action) && mix.weight(usize::from(style)) > 0.0 {
                let turning = database.trust_limits(class).map_or(0.0, |limits| limits.turning);
                most = maximum(turning, most);
            }
        }
        if most > 0.0 { most } else { f32::INFINITY }
    }

    /// A mix by its number.
    pub fn mix(&self, id: usize) -> StyleMix<'_> {
        StyleMix { settings: self, id }
    }

    /// Whether the labels allow a class of an action in a style.
    pub fn allow(&self, labels: [u16; 2]) -> bool {
        labels_match(labels, self.action, self.input_style)
    }
}
