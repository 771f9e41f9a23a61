//! Settings that change while a stylizer runs; every change is checked against the database first ([`crate::stylizer::style_mix`]).

use super::Stylizer;
use crate::{
    ConfigError,
    blob::layout::{MAX_GROUPS, MAX_STYLES},
    stylizer::style_mix::{MAX_OWN, MOST_STRENGTH, Own, StyleWeights, matches},
};

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
        if self.settings.styles != styles {
            self.settings.styles = styles;
            self.settings_changed();
        }
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
        if self.config.method.needs().whole_body && !weights.is_empty() {
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
        if self.settings.set_own(usize::from(group), own) {
            self.settings_changed();
        }
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
            return Err(ConfigError::OutOfRange);
        }
        if self.settings.mask != mask {
            self.settings.mask = mask;
            self.settings_changed();
        }
        Ok(())
    }

    /// True where the search looks at the group.
    pub fn searches(&self, group: usize) -> bool {
        group < MAX_GROUPS && self.settings.mask >> group & 1 == 1
    }

    /// How much of the style a joint group takes on: 0 leaves the input as it is, 1 is the style, up to 2 goes beyond.
    /// In a running stream it gets there within [`STRENGTH_S`](crate::STRENGTH_S), without a jump.
    ///
    /// # Errors
    /// [`ConfigError`] for an unknown group or a strength outside 0 to 2.
    pub fn set_strength(&mut self, group: u16, strength: f32) -> Result<(), ConfigError> {
        known(Some(group), self.database.counts().groups)?;
        if !(0.0..=MOST_STRENGTH).contains(&strength) {
            return Err(ConfigError::OutOfRange);
        }
        if let Some(slot) = self.settings.strength.get_mut(usize::from(group)).filter(|s| **s != strength) {
            *slot = strength;
            self.settings_changed();
        }
        Ok(())
    }

    /// Strength of a joint group as it was set.
    pub fn strength(&self, group: usize) -> f32 {
        self.settings.strength.get(group).copied().unwrap_or(1.0)
    }

    /// Strength of a joint group in the last frame: on its way to what was set, less what was passed on of the input.
    pub fn strength_now(&self, group: usize) -> f32 {
        self.settings.strength_of(group)
    }

    /// Heights of the floor under the left and the right foot, metres over the floor of the database. May change with
    /// every pose: the body follows.
    ///
    /// # Errors
    /// [`ConfigError::OutOfRange`] for heights beyond 10 m or not finite; those in force stay.
    pub fn set_floor(&mut self, heights: [f32; 2]) -> Result<(), ConfigError> {
        if !heights.iter().all(|h| (-10.0..=10.0).contains(h)) {
            return Err(ConfigError::OutOfRange);
        }
        self.lock.set_floor(heights);
        Ok(())
    }

    /// The labelled action and input style.
    pub fn labels(&self) -> (Option<u16>, Option<u16>) {
        (self.settings.action, self.settings.input_style)
    }

    /// Another posture is due: it is taken up, and softly.
    pub(super) fn settings_changed(&mut self) {
        self.stillness.settings_changed();
        self.limit.soften();
    }

    fn label(&mut self, action: Option<u16>, style: Option<u16>) -> Result<(), ConfigError> {
        if self.config.method.needs().labelled_class
            && !self.database.classes().any(|c| matches([c.action, c.style], action, style))
        {
            return Err(ConfigError::NoClass);
        }
        if self.labels() != (action, style) {
            (self.settings.action, self.settings.input_style) = (action, style);
            self.settings_changed();
        }
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
