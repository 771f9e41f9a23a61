//! Parameters that change while a stylizer runs: a board that misses its deadline lowers the cap on visits, a host
//! at the other end of a link sets them all.

use super::Stylizer;
use crate::{Config, ConfigError, stylizer::style_mix::Settings};

impl<const J: usize, const K: usize, const C: usize> Stylizer<'_, J, K, C> {
    /// Replaces the parameters from the next step on. The stream goes on, unless the method changes: then it begins anew
    /// without labels, because the other method may not have the labelled class.
    ///
    /// # Errors
    /// [`ConfigError`] where a parameter is out of its range, or the database does not hold what the method needs, and
    /// [`ConfigError::WholeBody`] where a joint group has styles of its own and the method does not support that. The
    /// current parameters stay.
    // Called from several places and never within a frame, so one copy saves flash.
    #[inline(never)]
    pub fn set_config(&mut self, config: Config) -> Result<(), ConfigError> {
        if config.method.needs().whole_body && self.settings.has_group_styles() {
            return Err(ConfigError::WholeBody);
        }
        self.replace_config(config)
    }

    #[inline(never)]
    fn replace_config(&mut self, config: Config) -> Result<(), ConfigError> {
        config.check(K)?;
        if config.method != self.config.method {
            if !config.method.is_available_in(&self.database) {
                return Err(ConfigError::Method);
            }
            // The next frame is a first one, which starts the method.
            self.reset();
            (self.settings.action, self.settings.input_style) = (None, None);
        }
        // The cap on visits follows the load; a change of it is no change of the output.
        if self.config.visits(config.visits) != config {
            self.settings_changed();
        }
        self.config = config;
        Ok(())
    }

    /// Sets the greatest number of distances that are computed a class and frame,
    /// [`MIN_VISITS`](crate::output::visit_cap::MIN_VISITS) to [`MAX_VISITS`](crate::search::graph::MAX_VISITS). It determines
    /// the worst case of a frame, and is the first parameter to lower where a deadline was missed. Frames that reach it are
    /// reported ([`Degraded::VISITS`](crate::Degraded::VISITS)).
    ///
    /// # Errors
    /// [`ConfigError::Parameter`] out of that range; the current cap stays.
    pub fn set_visits(&mut self, visits: u16) -> Result<(), ConfigError> {
        self.set_config(self.config.visits(visits))
    }

    /// Resets the stylizer to its initial settings, with the parameters given: the database's first style, no labels, no
    /// masks, full strength, the floor at 0. Forgets the stream.
    ///
    /// # Errors
    /// [`ConfigError`] where a parameter is out of its range, or the database does not hold what the method needs; nothing
    /// is changed then.
    pub fn restore(&mut self, config: Config) -> Result<(), ConfigError> {
        // Not `set_config`, which would refuse styles of joint groups: they are removed below.
        self.replace_config(config)?;
        self.settings = Settings::new();
        self.lock.set_floor([0.0; 2]);
        self.reset();
        Ok(())
    }
}
