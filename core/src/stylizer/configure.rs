//! Parameters that change while a stylizer runs: a board that misses its deadline lowers the cap on visits, a host
//! at the other end of a link sets them all.

use super::Stylizer;
use crate::{Config, ConfigError, stylizer::style_mix::Settings};

impl<const J: usize, const K: usize, const C: usize> Stylizer<'_, J, K, C> {
    /// Puts other parameters in force, from the next step on. The stream goes on; with another method it begins
    /// anew, without labels: what one method knows by a label another may not hold.
    ///
    /// # Errors
    /// [`ConfigError`] where a parameter is out of its range, or the database does not hold what the method needs, and
    /// [`ConfigError::WholeBody`] where a joint group has styles of its own and the method has none for groups; those in
    /// force stay.
    // Called from several places, and never in a frame: once in a firmware will do.
    #[inline(never)]
    pub fn set_config(&mut self, config: Config) -> Result<(), ConfigError> {
        if config.method.needs().whole_body && self.settings.has_own() {
            return Err(ConfigError::WholeBody);
        }
        self.replace_config(config)
    }

    #[inline(never)]
    fn replace_config(&mut self, config: Config) -> Result<(), ConfigError> {
        config.check(K)?;
        if config.method != self.config.method {
            if !config.method.is_held_by(&self.database) {
                return Err(ConfigError::Method);
            }
            // The next frame is a first one, which takes up the method.
            self.reset();
            (self.settings.action, self.settings.input_style) = (None, None);
        }
        // A cap on visits changes with the load, not with what is wanted.
        if self.config.visits(config.visits) != config {
            self.settings_changed();
        }
        self.config = config;
        Ok(())
    }

    /// Most distances computed in a class a frame, 64 to 448: what a frame costs in the worst case, and the first
    /// thing to lower where a deadline was missed. Frames that reach the cap say so
    /// ([`Degraded::VISITS`](crate::Degraded::VISITS)).
    ///
    /// # Errors
    /// [`ConfigError::Parameter`] out of that range; the cap in force stays.
    pub fn set_visits(&mut self, visits: u16) -> Result<(), ConfigError> {
        self.set_config(self.config.visits(visits))
    }

    /// Goes back to how a stylizer is made: the database's first style, no labels, no masks, all of the strength,
    /// a floor at 0, the parameters given; and forgets the stream.
    ///
    /// # Errors
    /// [`ConfigError`] where a parameter is out of its range; nothing is changed then.
    pub fn restore(&mut self, config: Config) -> Result<(), ConfigError> {
        // Whatever styles groups have: they are about to go.
        self.replace_config(config)?;
        self.settings = Settings::new();
        self.lock.set_floor([0.0; 2]);
        self.reset();
        Ok(())
    }
}
