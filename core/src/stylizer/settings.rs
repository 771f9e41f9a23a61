//! The settings of a running stylizer. Every change is checked against the database ([`crate::stylizer::style_mix`]).

use super::Stylizer;
use crate::{
    ConfigError,
    blob::layout::{MAX_GROUPS, MAX_STYLES},
    error::saturating_u16,
    stylizer::style_mix::{GroupStyle, MAX_GROUP_STYLES, MAX_STRENGTH, StyleWeights},
};

/// Greatest weight of a style before normalisation.
const MAX_WEIGHT: f32 = 1e6;
/// Sum of weights up to which a mix counts as empty.
const MIN_TOTAL: f32 = 1e-6;

impl<const J: usize, const K: usize, const C: usize> Stylizer<'_, J, K, C> {
    /// Sets the output style: numbers of styles and their weights, which are normalised to sum 1. May change at any time.
    ///
    /// # Errors
    /// [`ConfigError`] for unknown styles, for weights that are negative, not finite or above 1e6, and for weights whose sum
    /// is not above 1e-6; the current style stays.
    pub fn set_style(&mut self, weights: &[(u16, f32)]) -> Result<(), ConfigError> {
        let mut styles: StyleWeights = [0.0; MAX_STYLES];
        for &(style, weight) in weights {
            check_id(Some(style), self.database.counts().styles)?;
            let slot = styles.get_mut(usize::from(style)).ok_or(ConfigError::Weights)?;
            *slot += checked_weight(weight)?;
        }
        let used = styles.get_mut(..self.database.counts().styles).unwrap_or(&mut []);
        let total: f32 = used.iter().sum();
        if total <= MIN_TOTAL {
            return Err(ConfigError::Weights);
        }
        used.iter_mut().for_each(|w| *w /= total);
        if self.settings.styles != styles {
            self.settings.styles = styles;
            self.settings_changed();
        }
        Ok(())
    }

    /// Sets the output style of one joint group, in place of the body's ([`set_style`](Self::set_style)): at most
    /// [`MAX_GROUP_STYLES`] styles. An empty list restores the body's style. May change at any time.
    ///
    /// The root's group determines which feet stand and how long a step takes. Each different mix costs the unpacking and
    /// the regression of a frame once more. The linear models refuse styles of joint groups ([`ConfigError::WholeBody`]).
    ///
    /// # Errors
    /// [`ConfigError`] for an unknown group, for too many styles, and as [`set_style`](Self::set_style); the current
    /// style stays.
    pub fn set_group_style(&mut self, group: u16, weights: &[(u16, f32)]) -> Result<(), ConfigError> {
        check_id(Some(group), self.database.counts().groups)?;
        if self.config.method.needs().whole_body && !weights.is_empty() {
            return Err(ConfigError::WholeBody);
        }
        let mut group_style =
            GroupStyle { count: u8::try_from(weights.len()).unwrap_or(u8::MAX), ..GroupStyle::NONE };
        if weights.len() > MAX_GROUP_STYLES {
            return Err(ConfigError::Weights);
        }
        let mut total = 0.0;
        for ((slot, number), &(style, weight)) in
            group_style.weights.iter_mut().zip(&mut group_style.styles).zip(weights)
        {
            check_id(Some(style), self.database.counts().styles)?;
            // A database has at most 32 styles.
            (*slot, *number) = (checked_weight(weight)?, style as u8);
            total += weight;
        }
        if total <= MIN_TOTAL && !weights.is_empty() {
            return Err(ConfigError::Weights);
        }
        group_style.weights = group_style.weights.map(|w| w / if total > 0.0 { total } else { 1.0 });
        if self.settings.set_group_style(usize::from(group), group_style) {
            self.settings_changed();
        }
        Ok(())
    }

    /// Weight of a style in a joint group, from the group's mix or the body's.
    pub fn style_of(&self, group: usize, style: usize) -> f32 {
        self.settings.mix(self.settings.mix_of(group)).weight(style)
    }

    /// Weights of the output style, `[styles]`; they sum to 1.
    pub fn style(&self) -> &[f32] {
        self.settings.styles.get(..self.database.counts().styles).unwrap_or(&[])
    }

    /// Labels the input's action; `None` if it is unknown.
    ///
    /// # Errors
    /// [`ConfigError`] where the database has no such action, or not in the labelled input style.
    pub fn set_action(&mut self, action: Option<u16>) -> Result<(), ConfigError> {
        self.set_labels(action, self.settings.input_style)
    }

    /// Labels the input's style; `None` if it is unknown.
    ///
    /// # Errors
    /// [`ConfigError`] where the database has no such style, or not in the labelled action.
    pub fn set_input_style(&mut self, style: Option<u16>) -> Result<(), ConfigError> {
        self.set_labels(self.settings.action, style)
    }

    /// Labels the input's action and style; `None` for what is unknown. They change together: the database need not have
    /// the new action in the style before, nor the action before in the new style.
    ///
    /// # Errors
    /// [`ConfigError`] where the database has no such action or style, or not the action in the style; both labels stay.
    pub fn set_labels(&mut self, action: Option<u16>, style: Option<u16>) -> Result<(), ConfigError> {
        check_id(action, self.database.counts().actions)?;
        check_id(style, self.database.counts().styles)?;
        if self.config.method.needs().labelled_class && !self.database.classes().any(|c| c.has(action, style))
        {
            return Err(ConfigError::NoClass);
        }
        if self.labels() != (action, style) {
            (self.settings.action, self.settings.input_style) = (action, style);
            self.settings_changed();
        }
        Ok(())
    }

    /// Sets whether the search compares a joint group. At least one group is always compared.
    ///
    /// # Errors
    /// [`ConfigError::Unknown`] for an unknown group; [`ConfigError::OutOfRange`] where nothing would be left to compare,
    /// as in a database without features.
    pub fn set_mask(&mut self, group: u16, searched: bool) -> Result<(), ConfigError> {
        let groups = self.database.counts().groups;
        check_id(Some(group), groups)?;
        let bit = 1 << group;
        let mask = if searched { self.settings.mask | bit } else { self.settings.mask & !bit };
        let all = if groups >= MAX_GROUPS { u8::MAX } else { (1 << groups) - 1 };
        // At least one component has to be left to compare.
        let features = self.database.counts().features;
        if !(0..features).any(|f| (mask & all) >> self.database.feature_group(f) & 1 == 1) {
            return Err(ConfigError::OutOfRange);
        }
        if self.settings.mask != mask {
            self.settings.mask = mask;
            self.settings_changed();
        }
        Ok(())
    }

    /// True where the search compares the group; false for a group that the database lacks.
    pub fn searches(&self, group: usize) -> bool {
        group < self.database.counts().groups.min(MAX_GROUPS) && self.settings.mask >> group & 1 == 1
    }

    /// Sets the strength of the style in a joint group: 0 is the input, 1 the style, and up to 2 exaggerates it. In a
    /// running stream it changes without a jump: 95% of the change is done after [`STRENGTH_S`](crate::STRENGTH_S).
    ///
    /// # Errors
    /// [`ConfigError`] for an unknown group or a strength outside 0 to 2.
    pub fn set_strength(&mut self, group: u16, strength: f32) -> Result<(), ConfigError> {
        self.check_strength(group, strength)?;
        if let Some(slot) = self.settings.strength.get_mut(usize::from(group)).filter(|s| **s != strength) {
            *slot = strength;
            self.settings_changed();
        }
        Ok(())
    }

    /// Refuses what [`set_strength`](Self::set_strength) refuses.
    pub(crate) fn check_strength(&self, group: u16, strength: f32) -> Result<(), ConfigError> {
        check_id(Some(group), self.database.counts().groups)?;
        if (0.0..=MAX_STRENGTH).contains(&strength) { Ok(()) } else { Err(ConfigError::OutOfRange) }
    }

    /// The strength that was set for a joint group.
    pub fn strength(&self, group: usize) -> f32 {
        self.settings.strength.get(group).copied().unwrap_or(1.0)
    }

    /// The strength of a joint group in the last frame, which follows the one that was set, times the part of the input that
    /// is not passed through.
    pub fn strength_now(&self, group: usize) -> f32 {
        self.settings.strength_of(group)
    }

    /// Sets the heights of the floor under the left and the right foot, metres over the floor of the database. They may
    /// change with every pose; the body follows. A stream begins on them.
    ///
    /// # Errors
    /// [`ConfigError::OutOfRange`] for heights beyond 10 m or not finite; the current heights stay.
    pub fn set_floor(&mut self, heights: [f32; 2]) -> Result<(), ConfigError> {
        if !heights.iter().all(|h| (-10.0..=10.0).contains(h)) {
            return Err(ConfigError::OutOfRange);
        }
        self.lock.set_floor(heights);
        if self.last.is_none() {
            self.lock.reset();
        }
        Ok(())
    }

    /// The labelled action and input style.
    pub fn labels(&self) -> (Option<u16>, Option<u16>) {
        (self.settings.action, self.settings.input_style)
    }

    /// Prepares for another posture, so that the output changes to it softly.
    pub(super) fn settings_changed(&mut self) {
        self.stillness.settings_changed();
        self.limit.soften();
    }
}

/// Refuses weights that are negative, not finite, or beyond [`MAX_WEIGHT`].
fn checked_weight(weight: f32) -> Result<f32, ConfigError> {
    if (0.0..=MAX_WEIGHT).contains(&weight) { Ok(weight) } else { Err(ConfigError::Weights) }
}

/// Refuses a number of an action, style or joint group of which the database has `have`.
fn check_id(id: Option<u16>, have: usize) -> Result<(), ConfigError> {
    match id {
        Some(id) if usize::from(id) >= have => Err(ConfigError::Unknown { id, have: saturating_u16(have) }),
        _ => Ok(()),
    }
}
