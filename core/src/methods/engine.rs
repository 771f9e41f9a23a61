//! The method that runs: one value of all methods, and every question that the stylizer asks of a method.

use super::{
    context::{Context, Needs, Translate},
    linear::Linear,
    mixture::step::Mixture,
    phase::step::Phase,
    statistics::Statistics,
    work::{Load, Work},
};
use crate::{Config, Database, Method, Observer, Report};

/// A method and its state. They share one place, which is as large as the largest, the mixture's.
#[derive(Debug, Clone)]
#[allow(clippy::large_enum_variant)]
pub(crate) enum Engine<const J: usize, const K: usize, const C: usize> {
    Mar(Mixture<J, K, C>),
    Lti(Linear<J>),
    Statistic(Statistics<J>),
    Phase(Phase<J, C>),
}

/// Calls the same function of whichever method runs.
macro_rules! each {
    ($engine:expr, $method:ident => $call:expr) => {
        match $engine {
            Engine::Mar($method) => $call,
            Engine::Lti($method) => $call,
            Engine::Statistic($method) => $call,
            Engine::Phase($method) => $call,
        }
    };
}

impl<const J: usize, const K: usize, const C: usize> Engine<J, K, C> {
    /// The mixture, no frame seen yet: all zeros, like what it is made of.
    pub const NEW: Self = Self::Mar(Mixture::NEW);

    fn method(&self) -> Method {
        match self {
            Self::Mar(_) => Method::Mar,
            Self::Lti(_) => Method::Lti,
            Self::Statistic(_) => Method::Statistic,
            Self::Phase(_) => Method::Phase,
        }
    }

    /// Before a first frame: takes up the method where another one ran. It is written in its place: the mixture's state
    /// would not fit a stack.
    #[inline(never)]
    pub fn begin(&mut self, method: Method) {
        if self.method() == method {
            return;
        }
        match method {
            Method::Mar => *self = Self::NEW,
            Method::Lti => *self = Self::Lti(Linear::NEW),
            Method::Statistic => *self = Self::Statistic(Statistics::NEW),
            Method::Phase => *self = Self::Phase(Phase::NEW),
        }
    }

    /// See [`Translate::predict`].
    pub fn predict(&mut self, context: &mut Context<'_, '_, J, impl Observer<J>>) {
        each!(self, method => method.predict(context));
    }

    /// See [`Translate::contacts`].
    pub fn contacts(&mut self, report: &mut Report) {
        each!(self, method => method.contacts(report));
    }

    /// See [`Translate::forget_window`].
    pub fn forget_window(&mut self) {
        each!(self, method => method.forget_window());
    }

    /// Forgets the stream.
    // Not part of its callers' frames: starting anew takes some stack.
    #[inline(never)]
    pub fn reset(&mut self) {
        each!(self, method => method.reset());
    }
}

impl Database<'_> {
    /// The most work that a step can take with a configuration, whatever the stream and the settings: of labels, of output
    /// styles, of joint groups.
    ///
    /// It holds for every database, since [`open`](Database::open) refuses those whose work has no bound. A stylizer knows
    /// the bound under the settings that are in force ([`Stylizer::worst_step`](crate::Stylizer::worst_step)).
    /// Takes time in proportion to the number of classes; 0 all over where the database does not hold what the method
    /// needs.
    pub fn worst_step(&self, config: &Config) -> Work {
        self.worst_step_of(config, &Load::most(self))
    }

    /// [`worst_step`](Self::worst_step) under some settings.
    #[inline(never)]
    pub fn worst_step_of(&self, config: &Config, load: &Load) -> Work {
        if !config.method.is_held_by(self) {
            return Work::default();
        }
        match config.method {
            Method::Mar => Mixture::<1, 1, 1>::worst_step(self, config, load),
            Method::Lti => Linear::<1>::worst_step(self, config, load),
            Method::Statistic => Statistics::<1>::worst_step(self, config, load),
            Method::Phase => Phase::<1, 1>::worst_step(self, config, load),
        }
    }
}

impl Method {
    /// The optional section of a database that holds what the method needs; `None` for the captured frames.
    pub const fn section(self) -> Option<u16> {
        match self {
            Self::Mar => Mixture::<1, 1, 1>::SECTION,
            Self::Lti => Linear::<1>::SECTION,
            Self::Statistic => Statistics::<1>::SECTION,
            Self::Phase => Phase::<1, 1>::SECTION,
        }
    }

    /// Whether a database holds what the method needs.
    #[inline]
    pub fn is_held_by(self, database: &Database<'_>) -> bool {
        match self.section() {
            Some(id) => database.optional(id).is_some(),
            None => database.counts().frames > 0,
        }
    }

    /// The first method that a database holds what is needed for: for firmware that takes any blob.
    #[inline]
    pub fn of(database: &Database<'_>) -> Self {
        Self::ALL.into_iter().find(|m| m.is_held_by(database)).unwrap_or_default()
    }

    pub(crate) fn needs(self) -> Needs {
        match self {
            Self::Mar => Mixture::<1, 1, 1>::NEEDS,
            Self::Lti => Linear::<1>::NEEDS,
            Self::Statistic => Statistics::<1>::NEEDS,
            Self::Phase => Phase::<1, 1>::NEEDS,
        }
    }
}
