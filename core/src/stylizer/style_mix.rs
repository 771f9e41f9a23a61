//! What is in force in a frame: output style, of the whole body or of a joint group, labels of the input, masks and
//! strengths of joint groups.
//!
//! **Strengths glide.** A strength that changes in a running stream is led to its new value by a critically damped spring,
//! so that neither a joint's place nor its speed jumps, whatever the sequence of changes:
//!
//! ```text
//! d = s - s*;  c = (v + ω d) Δt;  s' = s* + (d + c) e^(-ω Δt);  v' = (v - ω c) e^(-ω Δt)      ω = 8 / s
//! ```
//!
//! with s* the strength that was set: half of a change is there after 0.21 s, 95% after [`STRENGTH_S`]. A stream begins
//! with its strengths as they were set. Cost: one exponential and a dozen operations a group and frame, none at rest.
//!
//! **Styles of joint groups.** A group takes its outputs from the body's styles or from its own (`Mix`): the regression,
//! which looks at each dof alone, is then done once for each different mix. The time step, the root and the feet that
//! stand follow the root's group.

use crate::{
    blob::{
        Database,
        layout::{MAX_GROUPS, MAX_STYLES},
    },
    math::{clamp, exp},
};

/// Seconds after which 95% of a change of strength is there.
pub const STRENGTH_S: f32 = 0.6;
/// Rate ω of the spring, 1/s.
const STRENGTH_RATE: f32 = 8.0;
/// Nearer than this a strength is there.
const THERE: f32 = 1e-4;
/// The strongest that a style may be.
pub(crate) const MOST_STRENGTH: f32 = 2.0;
/// Most styles of a joint group's own mix.
pub const MAX_OWN: usize = 3;

/// Weight of each output style; they sum to 1.
pub type StyleWeights = [f32; MAX_STYLES];

/// A joint group's own styles.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Own {
    pub weights: [f32; MAX_OWN],
    pub styles: [u8; MAX_OWN],
    /// How many; 0 where the group follows the body.
    pub count: u8,
}

impl Own {
    pub const NONE: Self = Self { weights: [0.0; MAX_OWN], styles: [0; MAX_OWN], count: 0 };
}

/// A mix of styles: the body's, or the own one of a joint group.
#[derive(Clone, Copy)]
pub(crate) struct Mix<'a> {
    settings: &'a Settings,
    id: usize,
}

impl Mix<'_> {
    /// Weight of a style; a mix's weights sum to 1.
    #[inline(never)]
    pub fn weight(self, style: usize) -> f32 {
        let own = self.id.checked_sub(1).and_then(|group| self.settings.own.get(group));
        let Some(own) = own else { return self.settings.styles.get(style).copied().unwrap_or(0.0) };
        let pairs = own.styles.iter().zip(own.weights).take(usize::from(own.count));
        pairs.filter(|(s, _)| usize::from(**s) == style).map(|(_, weight)| weight).sum()
    }

    /// The styles below `styles` that have weight, by number.
    pub fn weighted(self, styles: usize) -> impl Iterator<Item = (usize, f32)> {
        (0..styles).map(move |s| (s, self.weight(s))).filter(|(_, weight)| *weight > 0.0)
    }
}

/// The settings in force. Every change is checked against the database; a refused one leaves them as they are.
#[derive(Debug, Clone)]
pub(crate) struct Settings {
    pub styles: StyleWeights,
    pub action: Option<u16>,
    pub input_style: Option<u16>,
    /// One bit a joint group: does the search look at it?
    pub mask: u8,
    own: [Own; MAX_GROUPS],
    /// Number of each group's mix: 0 the body's, else one more than the first group that has it.
    mixes: [u8; MAX_GROUPS],
    /// As they were set.
    pub strength: [f32; MAX_GROUPS],
    /// Where the strengths are on their way, and how fast they go, 1/s.
    glide: [[f32; 2]; MAX_GROUPS],
    /// Part of the input that is passed on: strengths are less by it.
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
            own: [Own::NONE; MAX_GROUPS],
            mixes: [0; MAX_GROUPS],
            strength: [1.0; MAX_GROUPS],
            glide: [[1.0, 0.0]; MAX_GROUPS],
            passed: 0.0,
        }
    }

    /// Strength of a joint group in this frame: that which was set, or on its way there, less what is passed on.
    pub fn strength_of(&self, group: usize) -> f32 {
        self.glide.get(group).map_or(1.0, |[strength, _]| *strength) * (1.0 - self.passed)
    }

    /// Leads the strengths on by a frame; a first frame begins with them as they were set.
    pub fn glide(&mut self, first: bool, step_s: f32) {
        for ([now, speed], &wanted) in self.glide.iter_mut().zip(&self.strength) {
            let off = *now - wanted;
            if first || (-THERE..THERE).contains(&off) {
                (*now, *speed) = (wanted, 0.0);
                continue;
            }
            let decay = exp(-STRENGTH_RATE * step_s);
            let change = (*speed + STRENGTH_RATE * off) * step_s;
            // A turn on the way can carry it beyond what any strength may be.
            *now = clamp(wanted + (off + change) * decay, 0.0, MOST_STRENGTH);
            *speed = (*speed - STRENGTH_RATE * change) * decay;
        }
    }

    /// The mix of styles of a joint group, by number: 0 the body's; groups of equal mixes have one number.
    pub fn mix_of(&self, group: usize) -> usize {
        self.mixes.get(group).copied().map_or(0, usize::from)
    }

    /// Gives a group its own styles, or none. True where it had others.
    pub fn set_own(&mut self, group: usize, own: Own) -> bool {
        let Some(slot) = self.own.get_mut(group).filter(|slot| **slot != own) else { return false };
        *slot = own;
        for (mix, own) in self.mixes.iter_mut().zip(&self.own) {
            let first = self.own.iter().position(|o| o == own).filter(|_| own.count > 0);
            *mix = first.map_or(0, |first| first as u8 + 1);
        }
        true
    }

    /// True where a joint group has styles of its own.
    pub fn has_own(&self) -> bool {
        self.mixes != [0; MAX_GROUPS]
    }

    /// Whether a joint group has that mix of styles.
    pub fn uses_mix(&self, database: &Database<'_>, mix: usize) -> bool {
        (0..database.counts().groups).any(|group| self.mix_of(group) == mix)
    }

    /// Speed of the fastest joint of an action in a mix of styles, rad/s; of any action where it is not known, and endless
    /// where the blob does not say it.
    #[inline(never)]
    pub fn fastest(&self, database: &Database<'_>, mix: usize, action: Option<u16>) -> f32 {
        let mix = self.mix(mix);
        let mut most = 0.0;
        for class in 0..database.counts().classes {
            let [of, style] = database.labels(class);
            if action.is_none_or(|action| action == of) && mix.weight(usize::from(style)) > 0.0 {
                let turning = database.familiar(class).map_or(0.0, |familiar| familiar.turning);
                most = if turning > most { turning } else { most };
            }
        }
        if most > 0.0 { most } else { f32::INFINITY }
    }

    /// A mix by its number.
    pub fn mix(&self, id: usize) -> Mix<'_> {
        Mix { settings: self, id }
    }

    /// Whether the labels allow a class of an action in a style.
    pub fn allow(&self, labels: [u16; 2]) -> bool {
        matches(labels, self.action, self.input_style)
    }
}

/// Whether labels allow a class of an action in a style.
#[inline]
pub(crate) fn matches([of, by]: [u16; 2], action: Option<u16>, style: Option<u16>) -> bool {
    action.is_none_or(|action| action == of) && style.is_none_or(|style| style == by)
}
