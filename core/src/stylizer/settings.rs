//! What a stylizer is told while it runs: output style, of the whole body or of a joint group, labels of the input, masks
//! and strengths of joint groups.
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
//! **Styles of joint groups.** A group takes its outputs from the body's styles or from its own ([`Mix`]): the regression,
//! which looks at each dof alone, is then done once for each different mix. The time step, the root and the feet that
//! stand follow the root's group.

use super::Stylizer;
use crate::{
    ConfigError, Method,
    blob::{
        Class,
        layout::{MAX_GROUPS, MAX_STYLES},
    },
    examples::StyleWeights,
    math::{clamp, exp},
};

/// Seconds after which 95% of a change of strength is there.
pub const STRENGTH_S: f32 = 0.6;
/// Rate ω of the spring, 1/s.
const STRENGTH_RATE: f32 = 8.0;
/// Nearer than this a strength is there.
const THERE: f32 = 1e-4;
/// The strongest that a style may be.
const MOST_STRENGTH: f32 = 2.0;
/// Most styles of a joint group's own mix.
pub const MAX_OWN: usize = 3;

/// A joint group's own styles.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Own {
    weights: [f32; MAX_OWN],
    styles: [u8; MAX_OWN],
    /// How many; 0 where the group follows the body.
    count: u8,
}

impl Own {
    const NONE: Self = Self { weights: [0.0; MAX_OWN], styles: [0; MAX_OWN], count: 0 };
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
    strength: [f32; MAX_GROUPS],
    /// Where the strengths are on their way, and how fast they go, 1/s.
    glide: [[f32; 2]; MAX_GROUPS],
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
        }
    }

    /// Strength of a joint group in this frame: that which was set, or on its way there.
    pub fn strength_of(&self, group: usize) -> f32 {
        self.glide.get(group).map_or(1.0, |[strength, _]| *strength)
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

    /// Gives a group its own styles, or none.
    fn set_own(&mut self, group: usize, own: Own) {
        if let Some(slot) = self.own.get_mut(group) {
            *slot = own;
        }
        for (mix, own) in self.mixes.iter_mut().zip(&self.own) {
            let first = self.own.iter().position(|o| o == own).filter(|_| own.count > 0);
            *mix = first.map_or(0, |first| first as u8 + 1);
        }
    }

    /// A mix by its number.
    pub fn mix(&self, id: usize) -> Mix<'_> {
        Mix { settings: self, id }
    }

    /// Whether the labels allow a class.
    pub fn allow(&self, class: Class) -> bool {
        matches(class, self.action, self.input_style)
    }
}

impl<const J: usize, const K: usize, const C: usize> Stylizer<'_, J, K, C> {
    /// The output style: numbers of styles and their weights, which are brought to sum 1. May change while running.
    ///
    /// # Errors
    /// [`ConfigError`] for unknown styles and for weights that are negative, not finite or all zero; the style in
    /// force stays.
    pub fn set_style(&mut self, weights: &[(u16, f32)]) -> Result<(), ConfigError> {
        let mut styles: StyleWeights = [0.0; MAX_STYLES];
        for &(style, weight) in weights {
            known(Some(style), self.database.counts().styles)?;
            let slot = styles.get_mut(usize::from(style)).ok_or(ConfigError::Weights)?;
            if !(0.0..=1e6).contains(&weight) {
                return Err(ConfigError::Weights);
            }
            *slot += weight;
        }
        let used = styles.get_mut(..self.database.counts().styles).unwrap_or(&mut []);
        let total: f32 = used.iter().sum();
        if total <= 1e-6 {
            return Err(ConfigError::Weights);
        }
        used.iter_mut().for_each(|w| *w /= total);
        self.settings.styles = styles;
        Ok(())
    }

    /// The output style of a joint group alone, at most [`MAX_OWN`] styles, in place of the body's
    /// ([`set_style`](Self::set_style)); an empty list gives it back to the body's. May change while running. The
    /// group of the root says which feet stand and how long a step takes. Each mix that differs costs the unpacking
    /// and the regression of a frame once more.
    /// The linear models refuse it ([`ConfigError::WholeBody`]).
    ///
    /// # Errors
    /// [`ConfigError`] for an unknown group, more styles than that, and as [`set_style`](Self::set_style); the style
    /// in force stays.
    pub fn set_group_style(&mut self, group: u16, weights: &[(u16, f32)]) -> Result<(), ConfigError> {
        known(Some(group), self.database.counts().groups)?;
        if self.config.method == Method::Lti && !weights.is_empty() {
            return Err(ConfigError::WholeBody);
        }
        let mut own = Own { count: u8::try_from(weights.len()).unwrap_or(u8::MAX), ..Own::NONE };
        if weights.len() > MAX_OWN {
            return Err(ConfigError::Weights);
        }
        let mut total = 0.0;
        for ((slot, number), &(style, weight)) in own.weights.iter_mut().zip(&mut own.styles).zip(weights) {
            known(Some(style), self.database.counts().styles)?;
            if !(0.0..=1e6).contains(&weight) {
                return Err(ConfigError::Weights);
            }
            // A database has at most 32 styles.
            (*slot, *number) = (weight, style as u8);
            total += weight;
        }
        if total <= 1e-6 && !weights.is_empty() {
            return Err(ConfigError::Weights);
        }
        own.weights = own.weights.map(|w| w / if total > 0.0 { total } else { 1.0 });
        self.settings.set_own(usize::from(group), own);
        Ok(())
    }

    /// Weight of a style in a joint group: of its own mix, or of the body's.
    pub fn style_of(&self, group: usize, style: usize) -> f32 {
        self.settings.mix(self.settings.mix_of(group)).weight(style)
    }

    /// The output style's weights, by number of the style; they sum to 1.
    pub fn style(&self) -> &[f32] {
        self.settings.styles.get(..self.database.counts().styles).unwrap_or(&[])
    }

    /// The input's action, where the caller knows it.
    ///
    /// # Errors
    /// [`ConfigError`] where the database has no such action, or not in the labelled input style.
    pub fn set_action(&mut self, action: Option<u16>) -> Result<(), ConfigError> {
        known(action, self.database.counts().actions)?;
        self.label(action, self.settings.input_style)
    }

    /// The input's style, where the caller knows it.
    ///
    /// # Errors
    /// [`ConfigError`] where the database has no such style, or not in the labelled action.
    pub fn set_input_style(&mut self, style: Option<u16>) -> Result<(), ConfigError> {
        known(style, self.database.counts().styles)?;
        self.label(self.settings.action, style)
    }

    /// Whether the search looks at a joint group. At least one group is always looked at.
    ///
    /// # Errors
    /// [`ConfigError`] for an unknown group, or where no group would be left.
    pub fn set_mask(&mut self, group: u16, searched: bool) -> Result<(), ConfigError> {
        let groups = self.database.counts().groups;
        known(Some(group), groups)?;
        let bit = 1 << group;
        let mask = if searched { self.settings.mask | bit } else { self.settings.mask & !bit };
        let all = if groups >= 8 { u8::MAX } else { (1 << groups) - 1 };
        // What counts is whether a component is left to compare.
        let features = self.database.counts().features;
        if !(0..features).any(|f| (mask & all) >> self.database.feature_group(f) & 1 == 1) {
            return Err(ConfigError::Parameter);
        }
        self.settings.mask = mask;
        Ok(())
    }

    /// True where the search looks at the group.
    pub fn searches(&self, group: usize) -> bool {
        group < MAX_GROUPS && self.settings.mask >> group & 1 == 1
    }

    /// How much of the style a joint group takes on: 0 leaves the input as it is, 1 is the style, up to 2 goes beyond.
    /// In a running stream it gets there within [`STRENGTH_S`], without a jump.
    ///
    /// # Errors
    /// [`ConfigError`] for an unknown group or a strength outside 0 to 2.
    pub fn set_strength(&mut self, group: u16, strength: f32) -> Result<(), ConfigError> {
        known(Some(group), self.database.counts().groups)?;
        if !(0.0..=MOST_STRENGTH).contains(&strength) {
            return Err(ConfigError::Parameter);
        }
        if let Some(slot) = self.settings.strength.get_mut(usize::from(group)) {
            *slot = strength;
        }
        Ok(())
    }

    /// Strength of a joint group as it was set.
    pub fn strength(&self, group: usize) -> f32 {
        self.settings.strength.get(group).copied().unwrap_or(1.0)
    }

    /// Strength of a joint group in the last frame: on its way to what was set.
    pub fn strength_now(&self, group: usize) -> f32 {
        self.settings.strength_of(group)
    }

    /// Heights of the floor under the left and the right foot, metres over the floor of the database. May change with
    /// every pose: the body follows.
    ///
    /// # Errors
    /// [`ConfigError`] for heights beyond 10 m or that are none; those in force stay.
    pub fn set_floor(&mut self, heights: [f32; 2]) -> Result<(), ConfigError> {
        if !heights.iter().all(|h| (-10.0..=10.0).contains(h)) {
            return Err(ConfigError::Parameter);
        }
        self.lock.set_floor(heights);
        Ok(())
    }

    /// The labelled action and input style.
    pub fn labels(&self) -> (Option<u16>, Option<u16>) {
        (self.settings.action, self.settings.input_style)
    }

    fn label(&mut self, action: Option<u16>, style: Option<u16>) -> Result<(), ConfigError> {
        // Only the mixture has to find frames; other methods take labels where they have something for them.
        let searches = self.config.method == Method::Mar;
        if searches && !self.database.classes().any(|c| matches(c, action, style)) {
            return Err(ConfigError::NoClass);
        }
        (self.settings.action, self.settings.input_style) = (action, style);
        Ok(())
    }
}

fn known(id: Option<u16>, have: usize) -> Result<(), ConfigError> {
    match id {
        Some(id) if usize::from(id) >= have => {
            Err(ConfigError::Unknown { id, have: u16::try_from(have).unwrap_or(u16::MAX) })
        }
        _ => Ok(()),
    }
}

fn matches(class: Class, action: Option<u16>, style: Option<u16>) -> bool {
    action.is_none_or(|a| a == class.action) && style.is_none_or(|s| s == class.style)
}
