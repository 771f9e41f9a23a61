//! Parameters that choose between named alternatives.

/// Makes an enum of alternatives; the first is the default. A number on the link is an alternative's place.
macro_rules! choices {
    ($($(#[$doc:meta])* $name:ident { $($(#[$variant_doc:meta])* $variant:ident = $text:literal,)* })*) => {$(
        $(#[$doc])*
        #[derive(Debug, Clone, Copy, PartialEq, Eq)]
        #[cfg_attr(feature = "defmt", derive(defmt::Format))]
        pub enum $name {
            $($(#[$variant_doc])* $variant,)*
        }

        impl $name {
            /// Every alternative, in the order of the numbers that the link and the C interface give them.
            pub const ALL: [Self; Self::NAMES.len()] = [$(Self::$variant),*];
            /// Their names, in the same order.
            pub const NAMES: &'static [&'static str] = &[$($text),*];

            /// The alternative's name, as the command line spells it.
            pub const fn name(self) -> &'static str {
                match self {
                    $(Self::$variant => $text,)*
                }
            }

            /// The alternative of that name.
            pub fn named(name: &str) -> Option<Self> {
                Self::ALL.into_iter().find(|choice| choice.name() == name)
            }
        }

        impl Default for $name {
            fn default() -> Self {
                Self::ALL[0]
            }
        }

        impl Value for $name {
            const NAMES: &'static [&'static str] = Self::NAMES;

            fn to_number(self) -> f32 {
                f32::from(self as u8)
            }

            fn from_number(number: f32) -> Option<Self> {
                Self::ALL.get(usize::from(u8::from_number(number)?)).copied()
            }
        }
    )*};
}

choices! {
    /// Variables of the ridge regression ([`crate::methods::mixture::regression`]).
    Ridge {
        /// Radians, metres and metres a second, as they are (Xia 2015).
        Raw = "raw",
        /// Each dof divided by its standard deviation over the database, so that λ means the same for all of them.
        Normalised = "norm",
    }

    /// Policy for the output's time.
    Timing {
        /// Poses carry their predicted time stamps: the output runs on its own timeline. For files.
        Free = "free",
        /// One pose in, one pose out, played at the input's rate. The root still covers the ground of the predicted
        /// step, so that feet stay where the pose has them. For robots.
        Sync = "sync",
    }

    /// Where the output's heading comes from.
    Yaw {
        /// The input's: the output turns where and when the input does.
        Input = "input",
        /// The predicted rate, integrated. It drifts: some 40 degrees in a turn of 110.
        Predicted = "predicted",
    }

    /// The output where the input fails: it is late, out of order, no pose, or leaps.
    Safety {
        /// The output takes the input's posture and heading, leaps included, within the speed limit; on the ground a leap
        /// does not move it. Where there is no input the last output is held.
        Follow = "follow",
        /// The last output is held; afterwards the output is blended back.
        Hold = "hold",
        /// The output is eased to rest, the database's mean pose on the floor; afterwards it is blended back.
        Rest = "rest",
    }

    /// The method of translation. The blob has to hold what it needs.
    Method {
        /// The mixture of local autoregressive models over the database's frames (Xia 2015).
        Mar = "mar",
        /// Linear time-invariant models (Hsu 2005).
        Lti = "lti",
        /// Transfer of means and spreads, with quaternions.
        Statistic = "statistic",
        /// Phase tables: means of each class over its cycle.
        Phase = "phase",
    }
}

/// A parameter's type. Every value has a number, which an `f32` holds exactly: so parameters travel over a link.
pub trait Value: Copy + PartialEq {
    /// Names of the alternatives, by number; empty for a quantity.
    const NAMES: &'static [&'static str] = &[];

    /// The value as a number.
    fn to_number(self) -> f32;

    /// The value of a number; `None` where the type does not hold it.
    fn from_number(number: f32) -> Option<Self>;
}

impl Value for f32 {
    fn to_number(self) -> f32 {
        self
    }

    fn from_number(number: f32) -> Option<Self> {
        Some(number)
    }
}

impl Value for u16 {
    fn to_number(self) -> f32 {
        f32::from(self)
    }

    fn from_number(number: f32) -> Option<Self> {
        // The cast saturates, and NaN becomes 0: what comes back differs then.
        let whole = number as u16;
        if f32::from(whole) == number { Some(whole) } else { None }
    }
}

impl Value for u8 {
    fn to_number(self) -> f32 {
        f32::from(self)
    }

    fn from_number(number: f32) -> Option<Self> {
        u8::try_from(u16::from_number(number)?).ok()
    }
}

impl Value for bool {
    const NAMES: &'static [&'static str] = &["no", "yes"];

    fn to_number(self) -> f32 {
        f32::from(u8::from(self))
    }

    fn from_number(number: f32) -> Option<Self> {
        match number {
            0.0 => Some(false),
            1.0 => Some(true),
            _ => None,
        }
    }
}
