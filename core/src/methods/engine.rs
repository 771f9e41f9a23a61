//! The running method: one value that is any of the methods, and everything that the stylizer asks of a method.
//!
//! Methods are features of the crate. Firmware without a method has neither its code nor its memory.

#[cfg(feature = "lti")]
use super::linear::Linear;
#[cfg(feature = "mar")]
use super::mixture::step::Mixture;
#[cfg(feature = "phase")]
use super::phase::step::Phase;
#[cfg(feature = "statistic")]
use super::statistics::Statistics;
use super::{
    context::{Context, Needs, Translate},
    work::{Load, Work},
};
use crate::{Config, Database, Method, Observer, blob::layout::section};

#[cfg(not(any(feature = "mar", feature = "lti", feature = "statistic", feature = "phase")))]
compile_error!("no method: choose features of gestus-core among mar, lti, statistic and phase");

// Does not compile if a method is missing among all methods in `Cargo.toml`.
#[cfg(feature = "methods")]
const _: () = {
    let mut number = 0;
    while number < Method::ALL.len() {
        assert!(Method::ALL[number].is_built());
        number += 1;
    }
};

/// A method and its state. The methods share one place in memory, as large as the largest state, the mixture's.
#[derive(Debug, Clone)]
#[allow(clippy::large_enum_variant)]
pub(crate) enum Engine<const J: usize, const K: usize, const C: usize> {
    #[cfg(feature = "mar")]
    Mar(Mixture<J, K, C>),
    #[cfg(feature = "lti")]
    Lti(Linear<J>),
    #[cfg(feature = "statistic")]
    Statistic(Statistics<J>),
    #[cfg(feature = "phase")]
    Phase(Phase<J, C>),
}

/// Calls a function of the running method.
macro_rules! each {
    ($engine:expr, $method:ident => $call:expr) => {
        match $engine {
            #[cfg(feature = "mar")]
            Engine::Mar($method) => $call,
            #[cfg(feature = "lti")]
            Engine::Lti($method) => $call,
            #[cfg(feature = "statistic")]
            Engine::Statistic($method) => $call,
            #[cfg(feature = "phase")]
            Engine::Phase($method) => $call,
        }
    };
}

/// Evaluates an expression on the type of a named method; `$missing` if the core was built without it.
macro_rules! of_type {
    ($name:expr, $Method:ident => $value:expr, $missing:expr) => {
        match $name {
            #[cfg(feature = "mar")]
            Method::Mar => {
                type $Method = Mixture<1, 1, 1>;
                $value
            }
            #[cfg(feature = "lti")]
            Method::Lti => {
                type $Method = Linear<1>;
                $value
            }
            #[cfg(feature = "statistic")]
            Method::Statistic => {
                type $Method = Statistics<1>;
                $value
            }
            #[cfg(feature = "phase")]
            Method::Phase => {
                type $Method = Phase<1, 1>;
                $value
            }
            #[cfg(not(feature = "mar"))]
            Method::Mar => $missing,
            #[cfg(not(feature = "lti"))]
            Method::Lti => $missing,
            #[cfg(not(feature = "statistic"))]
            Method::Statistic => $missing,
            #[cfg(not(feature = "phase"))]
            Method::Phase => $missing,
        }
    };
}

impl<const J: usize, const K: usize, const C: usize> Engine<J, K, C> {
    /// The first available method before its first frame: all zeros, like its state.
    #[cfg(feature = "mar")]
    pub const NEW: Self = Self::Mar(Mixture::NEW);
    #[cfg(all(feature = "lti", not(feature = "mar")))]
    pub const NEW: Self = Self::Lti(Linear::NEW);
    #[cfg(all(feature = "statistic", not(any(feature = "mar", feature = "lti"))))]
    pub const NEW: Self = Self::Statistic(Statistics::NEW);
    #[cfg(all(feature = "phase", not(any(feature = "mar", feature = "lti", feature = "statistic"))))]
    pub const NEW: Self = Self::Phase(Phase::NEW);

    fn method(&self) -> Method {
        match self {
            #[cfg(feature = "mar")]
            Self::Mar(_) => Method::Mar,
            #[cfg(feature = "lti")]
            Self::Lti(_) => Method::Lti,
            #[cfg(feature = "statistic")]
            Self::Statistic(_) => Method::Statistic,
            #[cfg(feature = "phase")]
            Self::Phase(_) => Method::Phase,
        }
    }

    /// Starts a method before a first frame, if another one ran. It is written in place: the mixture's state would not fit a
    /// stack.
    #[inline(never)]
    pub fn begin(&mut self, method: Method) {
        if self.method() == method {
            return;
        }
        match method {
            #[cfg(feature = "mar")]
            Method::Mar => *self = Self::Mar(Mixture::NEW),
            #[cfg(feature = "lti")]
            Method::Lti => *self = Self::Lti(Linear::NEW),
            #[cfg(feature = "statistic")]
            Method::Statistic => *self = Self::Statistic(Statistics::NEW),
            #[cfg(feature = "phase")]
            Method::Phase => *self = Self::Phase(Phase::NEW),
            // Configurations that name a missing method are refused.
            #[allow(unreachable_patterns)]
            Method::Mar | Method::Lti | Method::Statistic | Method::Phase => {}
        }
    }

    /// See [`Translate::predict`].
    pub fn predict(&mut self, context: &mut Context<'_, '_, J, impl Observer<J>>) {
        each!(self, method => method.predict(context));
    }

    /// See [`Translate::forget_window`].
    pub fn forget_window(&mut self) {
        each!(self, method => method.forget_window());
    }

    /// Forgets the stream.
    // Not inlined, so that its stack is not part of its callers' frames.
    #[inline(never)]
    pub fn reset(&mut self) {
        each!(self, method => method.reset());
    }
}

impl Database<'_> {
    /// An upper bound on the work of a step with a configuration, for any stream and any settings: labels, output styles,
    /// styles of joint groups.
    ///
    /// It holds for every database, since [`open`](Database::open) refuses those whose work is not bounded. A stylizer
    /// has the bound under its current settings ([`Stylizer::worst_step`](crate::Stylizer::worst_step)). The cost is
    /// proportional to the number of classes. All counts are 0 if the database lacks what the method needs.
    pub fn worst_step(&self, config: &Config) -> Work {
        self.worst_step_of(config, &Load::most(self))
    }

    /// [`worst_step`](Self::worst_step) under given settings.
    #[inline(never)]
    pub fn worst_step_of(&self, config: &Config, load: &Load) -> Work {
        if !config.method.is_available_in(self) {
            return Work::default();
        }
        of_type!(config.method, M => M::worst_step(self, config, load), Work::default())
    }
}

impl Method {
    /// Whether the core was built with the method. Methods are features of the crate.
    #[inline]
    pub const fn is_built(self) -> bool {
        match self {
            Self::Mar => cfg!(feature = "mar"),
            Self::Lti => cfg!(feature = "lti"),
            Self::Statistic => cfg!(feature = "statistic"),
            Self::Phase => cfg!(feature = "phase"),
        }
    }

    /// The optional section that the method needs; `None` if it needs the captured frames.
    pub const fn section(self) -> Option<u16> {
        match self {
            Self::Mar => None,
            Self::Lti => Some(section::LTI),
            Self::Statistic => Some(section::STATISTIC),
            Self::Phase => Some(section::PHASE),
        }
    }

    /// Whether the core was built with the method, and the database has what it needs.
    #[inline]
    pub fn is_available_in(self, database: &Database<'_>) -> bool {
        self.is_built()
            && match self.section() {
                Some(id) => database.optional(id).is_some(),
                None => database.counts().frames > 0,
            }
    }

    /// The first method that is available in a database, for firmware that accepts any blob.
    #[inline]
    pub fn of(database: &Database<'_>) -> Self {
        Self::ALL.into_iter().find(|m| m.is_available_in(database)).unwrap_or_default()
    }

    pub(crate) fn needs(self) -> Needs {
        of_type!(self, M => M::NEEDS, Needs { labelled_class: false, whole_body: false })
    }
}
