//! [`Fit`]: what a stylizer needs, checked before it is made; and how it is made.

use super::{Stylizer, faults::FaultState, spike::Spike, style_mix::Settings};
use crate::{
    Config, ConfigError,
    blob::Database,
    body::pose::Anchor,
    error::saturating_u16,
    methods::{context::Signals, engine::Engine},
    output::{foot_lock::Lock, speed_limit::SpeedLimit, stillness::Stillness, trust::Trust},
};

/// A database and a configuration that fit the capacities of a [`Stylizer`]: the part of [`Stylizer::new`] that can fail.
///
/// A board with a small stack makes its stylizer from this, in a `main` that never returns: the `Result` of
/// [`Stylizer::new`] is as large as the stylizer, and on the stack first.
#[derive(Debug, Clone, Copy)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Fit<'db, const J: usize, const K: usize, const C: usize> {
    database: Database<'db>,
    config: Config,
}

impl<'db, const J: usize, const K: usize, const C: usize> Fit<'db, J, K, C> {
    /// Compares the needs of the database and the configuration with the capacities.
    ///
    /// # Errors
    /// [`ConfigError`] where the database does not fit the capacities or does not hold what the method needs, or a
    /// parameter is out of its range.
    pub fn new(database: Database<'db>, config: Config) -> Result<Self, ConfigError> {
        let counts = *database.counts();
        // Dofs<J> has room for 3 J + 4 numbers from J = 4 on.
        if counts.joints > J || counts.dofs > 4 * J {
            let [need, have] = [counts.joints, J].map(saturating_u16);
            return Err(ConfigError::Joints { need, have });
        }
        if counts.classes > C {
            let [need, have] = [counts.classes, C].map(saturating_u16);
            return Err(ConfigError::Classes { need, have });
        }
        config.check(K)?;
        if !config.method.is_available_in(&database) {
            return Err(ConfigError::Method);
        }
        Ok(Self { database, config })
    }

    /// Makes the stylizer in the caller's stack frame. A `static` gets a copy of it, which takes as much stack for a moment.
    /// The first frame starts its method.
    #[inline(never)]
    pub fn stylizer(self) -> Stylizer<'db, J, K, C> {
        Stylizer {
            database: self.database,
            config: self.config,
            settings: Settings::new(),
            engine: Engine::NEW,
            signals: Signals::NEW,
            input_anchor: Anchor::ORIGIN,
            output_anchor: Anchor::ORIGIN,
            lock: Lock::new(),
            limit: SpeedLimit::new(),
            stillness: Stillness::new(),
            trust: Trust::new(),
            faults: FaultState::new(),
            spike: Spike::new(),
            last: None,
        }
    }
}

impl<'db, const J: usize, const K: usize, const C: usize> Stylizer<'db, J, K, C> {
    /// Makes a stylizer. Its output has the database's first style until a style is set.
    ///
    /// # Errors
    /// [`ConfigError`] where the database does not fit the capacities or does not hold what the method needs, or a
    /// parameter is out of its range.
    pub fn new(database: Database<'db>, config: Config) -> Result<Self, ConfigError> {
        Ok(Fit::new(database, config)?.stylizer())
    }
}
