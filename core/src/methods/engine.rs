//! The running method: one value that is any of the methods, and everything that the stylizer asks of a method.
//!
//! Methods are features of the crate. Firmware without a method has neither its code nor its memory.

use super::{
    context::{Context, Needs, Translate},
    work::{Load, Work},
};
use crate::{Config, Database, Method, Observer, blob::layout::section};

/// Makes [`Engine`], and what [`Method`] knows of each method, of one row a method: its feature, its variant of `Method`,
/// its state, and the optional section that it needs, if it does not need the captured frames. The method of least error
/// comes first ([`Method::of`]).
macro_rules! methods {
    ($($feature:literal $Method:ident($State:ty), $section:expr;)*) => {
        #[cfg(not(any($(feature = $feature),*)))]
        compile_error!(concat!("no method: choose features of gestus-core among:", $(" ", $feature),*));

        /// A method and its state. The methods share one place in memory, as large as the largest state, the mixture's.
        #[derive(Debug, Clone)]
        #[allow(clippy::large_enum_variant)]
        pub(crate) enum Engine<const J: usize, const K: usize, const C: usize> {
            $(#[cfg(feature = $feature)] $Method($State),)*
        }

        impl<const J: usize, const K: usize, const C: usize> Engine<J, K, C> {
            /// The first available method before its first frame: all zeros, like its state.
            #[allow(unreachable_code)]
            pub const NEW: Self = 'first: {
                $(#[cfg(feature = $feature)] break 'first Self::$Method(<$State>::NEW);)*
            };

            fn method(&self) -> Method {
                match self {
                    $(#[cfg(feature = $feature)] Self::$Method(_) => Method::$Method,)*
                }
            }

            /// Starts a method before a first frame, if another one ran. It is written in place: the mixture's state would
            /// not fit a stack.
            #[inline(never)]
            pub fn begin(&mut self, method: Method) {
                if self.method() == method {
                    return;
                }
                match method {
                    $(
                        #[cfg(feature = $feature)]
                        Method::$Method => *self = Self::$Method(<$State>::NEW),
                        // Configurations that name a missing method are refused.
                        #[cfg(not(feature = $feature))]
                        Method::$Method => {}
                    )*
                }
            }

            /// See [`Translate::predict`].
            pub fn predict(&mut self, context: &mut Context<'_, '_, J, impl Observer<J>>) {
                match self {
                    $(#[cfg(feature = $feature)] Self::$Method(state) => state.predict(context),)*
                }
            }

            /// See [`Translate::forget_window`].
            pub fn forget_window(&mut self) {
                match self {
                    $(#[cfg(feature = $feature)] Self::$Method(state) => state.forget_window(),)*
                }
            }

            /// Forgets the stream.
            // Not inlined, so that its stack is not part of its callers' frames.
            #[inline(never)]
            pub fn reset(&mut self) {
                match self {
                    $(#[cfg(feature = $feature)] Self::$Method(state) => state.reset(),)*
                }
            }

            fn needs(method: Method) -> Needs {
                match method {
                    $(
                        #[cfg(feature = $feature)]
                        Method::$Method => <$State>::NEEDS,
                        #[cfg(not(feature = $feature))]
                        Method::$Method => Needs { labelled_class: false, whole_body: false },
                    )*
                }
            }

            fn worst_step(database: &Database<'_>, config: &Config, load: &Load) -> Work {
                match config.method {
                    $(
                        #[cfg(feature = $feature)]
                        Method::$Method => <$State>::worst_step(database, config, load),
                        #[cfg(not(feature = $feature))]
                        Method::$Method => Work::default(),
                    )*
                }
            }
        }

        impl Method {
            /// All methods, that of least error first.
            const BY_ERROR: [Self; Self::ALL.len()] = [$(Self::$Method),*];

            /// Whether the core was built with the method. Methods are features of the crate.
            #[inline]
            pub const fn is_built(self) -> bool {
                match self {
                    $(Self::$Method => cfg!(feature = $feature),)*
                }
            }

            /// The optional section that the method needs; `None` if it needs the captured frames.
            pub const fn section(self) -> Option<u16> {
                match self {
                    $(Self::$Method => $section,)*
                }
            }
        }
    };
}

methods! {
    "mar" Mar(super::mixture::step::Mixture<J, K, C>), None;
    "phase" Phase(super::phase::step::Phase<J, C>), Some(section::PHASE);
    "lti" Lti(super::linear::Linear<J>), Some(section::LTI);
    "statistic" Statistic(super::statistics::Statistics<J>), Some(section::STATISTIC);
}

// Does not compile if a method is missing among all methods in `Cargo.toml`.
#[cfg(feature = "methods")]
const _: () = {
    let mut number = 0;
    while number < Method::ALL.len() {
        assert!(Method::ALL[number].is_built());
        number += 1;
    }
};

impl Database<'_> {
    /// An upper bound on the work of a step with a configuration, for any stream and any settings: labels, output styles,
    /// styles of joint groups.
    ///
    /// It holds for every database, since [`open`](Database::open) refuses those whose work is not bounded. A stylizer
    /// has the bound under its current settings ([`Stylizer::worst_step`](crate::Stylizer::worst_step)). The cost is
    /// proportional to the number of classes. All counts are 0 if the database lacks what the method needs.
    pub fn worst_step(&self, config: &Config) -> Work {
        self.worst_step_of(config, &Load::heaviest(self))
    }

    /// [`worst_step`](Self::worst_step) under given settings.
    #[inline(never)]
    pub fn worst_step_of(&self, config: &Config, load: &Load) -> Work {
        if !config.method.is_available_in(self) {
            return Work::default();
        }
        // The bound does not depend on the capacities.
        Engine::<1, 1, 1>::worst_step(self, config, load)
    }
}

impl Method {
    /// Whether the core was built with the method, and the database has what it needs.
    #[inline]
    pub fn is_available_in(self, database: &Database<'_>) -> bool {
        self.is_built()
            && match self.section() {
                Some(id) => database.optional(id).is_some(),
                None => database.counts().frames > 0,
            }
    }

    /// The method of least error that is available in a database, for firmware that accepts any blob: the mixture,
    /// tables by phase, linear time-invariant models, statistical transfer.
    #[inline]
    pub fn of(database: &Database<'_>) -> Self {
        Self::BY_ERROR.into_iter().find(|m| m.is_available_in(database)).unwrap_or_default()
    }

    pub(crate) fn needs(self) -> Needs {
        Engine::<1, 1, 1>::needs(self)
    }
}
