//! The table of parameters: number, name, type, default, range, the methods that use it, and its documentation.
//!
//! Everything that knows parameters is made from this table: the fields and setters of [`Config`], the numbers of the
//! [`link`](crate::link) and of the C interface, the options of the command line, and the tables in the documents. A
//! number's meaning never changes, since hosts and boards of different builds talk in them; a new parameter goes to the
//! end. Values travel as `f32`, which holds each of them exactly.

use super::choice::{Method, Ridge, Safety, Timing, Value, Yaw};
use crate::{ConfigError, search::graph};

/// A row of the table.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Parameter {
    /// Its number on the link and in the C interface.
    pub number: u16,
    /// Its name, that of the field of [`Config`].
    pub name: &'static str,
    /// The numbers that it takes.
    pub range: Range,
    /// The methods that use it.
    pub methods: &'static [Method],
    /// Names of its alternatives, by number; empty where it is a quantity.
    pub choices: &'static [&'static str],
    /// What it does, when to change it, and what goes wrong.
    pub doc: &'static str,
}

/// The numbers that a parameter takes, bounds included.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Range {
    /// Smallest.
    pub least: f32,
    /// Greatest.
    pub most: f32,
    /// 0 is taken too: it switches the parameter off.
    pub or_zero: bool,
}

impl Range {
    /// True where the range holds a number. NaN is in no range.
    pub fn contains(&self, number: f32) -> bool {
        (self.least..=self.most).contains(&number) || (self.or_zero && number == 0.0)
    }
}

impl core::fmt::Display for Range {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        write!(f, "{} to {}", self.least, self.most)?;
        if self.or_zero { f.write_str(", or 0 for none") } else { Ok(()) }
    }
}

macro_rules! range {
    ($least:literal to $most:expr) => {
        Range { least: $least, most: $most, or_zero: false }
    };
    (0 or $least:literal to $most:expr) => {
        Range { least: $least, most: $most, or_zero: true }
    };
    ($type:ident) => {
        Range { least: 0.0, most: (<$type as Value>::NAMES.len() - 1) as f32, or_zero: false }
    };
}

macro_rules! parameters {
    ($(
        $(#[doc = $doc:literal])*
        $number:literal $constant:ident $name:ident: $type:ident = $default:expr, [$($range:tt)*], $methods:expr;
    )*) => {
        $(
            #[doc = concat!("Number of [`Config::", stringify!($name), "`].")]
            pub const $constant: u16 = $number;
        )*

        /// Names of the parameters, by number.
        pub const NAMES: &[&str] = &[$(stringify!($name)),*];

        /// Ranges of the parameters, by number.
        pub const RANGES: &[Range] = &[$(range!($($range)*)),*];

        /// Every parameter, by number. It holds all of the documentation: for hosts.
        pub const TABLE: &[Parameter] = &[$(Parameter {
            number: $number,
            name: stringify!($name),
            range: range!($($range)*),
            methods: $methods,
            choices: <$type as Value>::NAMES,
            doc: concat!($($doc, "\n"),*),
        }),*];

        /// The parameters of a stylizer. Build one by chaining: `Config::new().k(32).lambda(0.2)`. What is out of range
        /// is refused where a configuration is put in force.
        #[derive(Debug, Clone, Copy, PartialEq)]
        #[cfg_attr(feature = "defmt", derive(defmt::Format))]
        pub struct Config {
            $(
                $(#[doc = $doc])*
                #[doc = concat!("\nDefault `", stringify!($default), "`.")]
                pub $name: $type,
            )*
        }

        impl Config {
            pub(super) const DEFAULTS: Self = Self { $($name: $default),* };

            $(
                #[doc = concat!("Sets [`", stringify!($name), "`](Self#structfield.", stringify!($name), ").")]
                #[must_use]
                pub const fn $name(mut self, value: $type) -> Self {
                    self.$name = value;
                    self
                }
            )*
        }

        /// Value of a parameter; `None` where no parameter has that number.
        pub fn value(config: &Config, number: u16) -> Option<f32> {
            Some(match number {
                $($number => config.$name.to_number(),)*
                _ => return None,
            })
        }

        /// The configuration with one parameter set. Ranges are checked where it is put in force
        /// ([`Stylizer::set_config`](crate::Stylizer::set_config)).
        ///
        /// # Errors
        /// [`ConfigError::Unknown`] for an unknown number, [`ConfigError::Parameter`] for a value that the parameter's
        /// type can't hold.
        pub fn set(config: Config, number: u16, value: f32) -> Result<Config, ConfigError> {
            let refused = ConfigError::Parameter { number };
            Ok(match number {
                $($number => config.$name(Value::from_number(value).ok_or(refused)?),)*
                id => return Err(ConfigError::Unknown { id, have: NAMES.len() as u16 }),
            })
        }

    };
}

parameters! {
    /// Neighbors of each class that the local models are fitted to. More of them average more: the output is smoother,
    /// but all steps look alike. Fewer follow the input more closely and are rougher; 40 is the value of Xia 2015. At most
    /// the stylizer's `K`, with every method, though only the mixture uses neighbors.
    0 K k: u16 = 8, [1.0 to graph::POOL as f32], &Method::ALL;
    /// Weight λ of the ridge (Xia 2015, section 5.1). Less lets a class's slopes count more, and the output may take
    /// longer to forget an error; from about 1 on raw variables it is the neighbors' mean.
    1 LAMBDA lambda: f32 = 0.1, [1e-9 to 1e6], &[Method::Mar];
    /// Variables of the ridge. `norm` is better for motion that was recorded or made in pairs. Set λ and the feedback
    /// penalty together with it, as [`Config::normalised`] does.
    2 RIDGE ridge: Ridge = Ridge::Raw, [Ridge], &[Method::Mar];
    /// Width δ of the mixing kernel (Xia 2015, eq. 4). Wider mixes more classes, costs more and blurs the action; Xia
    /// 2015 has 0.7.
    3 DELTA delta: f32 = 0.2, [1e-3 to 1e3], &[Method::Mar];
    /// Weight of the classes that may be dropped from a frame's mixture. More is faster, and joints may jump where a class
    /// comes or goes.
    4 PRUNE prune: f32 = 0.1, [0.0 to 1.0 - f32::EPSILON / 2.0], &[Method::Mar, Method::Phase];
    /// Most classes in a frame's mixture, which bounds the slowest frame. A frame in which this drops more weight than
    /// `prune` allows sets the flag `classes`.
    5 CLASSES classes: u8 = 4, [1.0 to 8.0], &[Method::Mar, Method::Phase];
    /// Half width κ of the interval about the neighbors' mean inside which the input is trusted, in standard deviations of
    /// the neighbors (Xia 2015, eq. 6). Wider passes less of an unusual gesture on to the output.
    6 KAPPA kappa: f32 = 0.25, [0.0 to 1e6], &[Method::Mar];
    /// Part ρ of what lies outside that interval that is kept in the output (Xia 2015, eq. 7). More keeps more of the
    /// input's own character, and is further from the style.
    7 RHO rho: f32 = 0.7, [0.0 to 1.0], &[Method::Mar];
    /// Most distances computed in a class and frame: what bounds the slowest frame. Fewer lose neighbors where the stream
    /// jumps; a frame that reaches the cap sets the flag `visits`.
    8 VISITS visits: u16 = 256, [64.0 to graph::MAX_VISITS as f32], &[Method::Mar];
    /// Frames that the search keeps as candidates; at least `k` are kept. More find more of the true neighbors and visit
    /// more.
    9 POOL pool: u8 = 20, [1.0 to graph::POOL as f32], &[Method::Mar];
    /// The search of a class restarts where its mean squared distance is this many times the last frame's. Lower
    /// notices a jump sooner, and restarts more often without need.
    10 JUMP jump: f32 = 4.0, [1.0 to 1e9], &[Method::Mar];
    /// Policy for the output's time. `free` is for files; a robot that takes a pose each tick wants `sync`.
    11 TIMING timing: Timing = Timing::Free, [Timing], &Method::ALL;
    /// Width of the kernel that predicts the time step, in mean squared distances of the neighbors (Xia 2015, section
    /// 5.1). Wider averages more: time steps vary less.
    12 TIMING_WIDTH timing_width: f32 = 0.5, [1e-3 to 1e3], &[Method::Mar];
    /// Where the output's heading comes from. A predicted heading drifts from the input's in turns.
    13 YAW yaw: Yaw = Yaw::Input, [Yaw], &Method::ALL;
    /// kc: how far a linear model is trusted, in standard deviations of its inputs (Hsu 2005, eq. 8). One of some sixty
    /// dofs is always two or three deviations out, so a smaller value makes the model visibly come and go.
    14 CONFIDENCE confidence: f32 = 5.0, [1e-3 to 1e6], &[Method::Lti];
    /// kp: how sharply a linear model gives way to the input beyond kc (Hsu 2005, eq. 8). A large value switches; a
    /// small one mixes the input in everywhere.
    15 PREFERENCE preference: f32 = 8.0, [1e-3 to 1e3], &[Method::Lti];
    /// Half-life of the input's running statistics in statistical transfer, seconds; 0 takes those of the database. Short
    /// ones follow a performer that differs from the database, and forget slow motion.
    16 HALFLIFE halflife_s: f32 = 0.0, [0.0 to 1e6], &[Method::Statistic];
    /// The method of translation. The database has to hold what it needs. A change restarts the stream.
    17 METHOD method: Method = Method::Mar, [Method], &Method::ALL;
    /// Whether standing feet are held in place. Otherwise they slide at 12 to 18 cm/s.
    18 CONTACTS contacts: bool = true, [bool], &Method::ALL;
    /// What the output does where the input is late, out of order, invalid, or leaps. A robot wants `hold` or `rest`.
    19 SAFETY safety: Safety = Safety::Follow, [Safety], &Method::ALL;
    /// Distance from its predicted place beyond which a held foot takes a step, metres. With less, feet step more
    /// often; more stretches legs.
    20 RELEASE release_m: f32 = 0.2, [0.01 to 1.0], &Method::ALL;
    /// Shortest time in which a foot that leaves the floor returns to where the prediction has it, seconds. A shorter
    /// time shows as a jerk, a longer one drags the foot.
    21 EASE ease_s: f32 = 0.2, [0.01 to 2.0], &Method::ALL;
    /// Penalty on the coefficient of the last output, as a multiple of λ; 1 in Xia 2015. More forgets an error sooner
    /// at a small λ, and makes the output rougher.
    22 FEEDBACK feedback: f32 = 1.0, [1e-3 to 1e6], &[Method::Mar];
    /// How fast a joint of the output may turn, in multiples of the input's fastest joint of the last seconds; 0 sets no
    /// limit. A quicker style may turn joints as fast as its clips do, up to 5/3 of this limit. Lower holds quick styles
    /// back: their feet slide, and their arms do not rise as high.
    23 SPEED_LIMIT speed_limit: f32 = 1.2, [0 or 1.0 to 100.0], &Method::ALL;
    /// Half width κy of the interval about the neighbors' mean that an output stays in, in standard deviations of the dof
    /// over the database; Xia 2015 has none. A wider one lets an output that is fed back drift away from every example.
    24 OUTPUT_KAPPA output_kappa: f32 = 0.25, [0.0 to 1e6], &[Method::Mar];
    /// A body stands where its fastest joint turns slower than this, rad/s, and its root moves by less than 0.2 m times
    /// that a second; the output then stands too. With 0 it never does: the output of a held pose may glide on. A
    /// larger value stops slow motion of the style, a smaller one takes sensor noise for motion.
    25 STILL_SPEED still_speed: f32 = 0.1, [0 or 1e-3 to 1.0], &Method::ALL;
    /// Input whose mean squared distance is more than this many times that of the clips that the builder held out, or
    /// whose root goes much faster or slower than theirs, is unlike the database. It is passed through unchanged: in
    /// part from this value on, entirely from 1.5 times it on. The flag `far` is set where at least half is passed
    /// through. In the first half second of a stream the limit is 2.5 times this value, and the speed does not count. 0
    /// gives every input the style. Less also passes unusual motion of known actions through, more gives unknown actions
    /// a style that spoils them.
    26 TRUST trust: f32 = 6.0, [0 or 1.0 to 100.0], &Method::ALL;
    /// How much the output's cycles differ, as a multiple of what ρ keeps of the input's own character, scaled by the
    /// variability of the style's clips over that of the clips of the input's style. Less is nearer to the style's mean,
    /// more is livelier and further from any one clip. 0 keeps ρ in every style, as Xia 2015 does.
    27 LIVELINESS liveliness: f32 = 0.0, [0 or 0.01 to 4.0], &[Method::Mar];
    /// Time in which the output settles on the prediction, seconds, so that it does not jump where other neighbors or
    /// classes take part. Meanwhile the mixture's output moves as those of its neighbors move, so it does not lag. The
    /// output of phase tables has no neighbors to follow, so it settles in half of the time. A gait that has all the
    /// weight takes a quarter of the time. The time is longer where the body jumps to another part of a clip, begins
    /// another action, or where clips of another gesture come to take part. With linear models, only the part of the
    /// input that is blended in settles. More is smoother, and takes longer to follow a change; 0 outputs the prediction
    /// as it is, as Xia 2015 and Hsu 2005 do.
    28 SETTLE settle_s: f32 = 0.1, [0 or 0.01 to 10.0], &[Method::Mar, Method::Phase, Method::Lti];
    /// In clips of a whole action, the frames that follow the last neighbors are preferred to the nearest frames. They
    /// may be farther away, by this multiple of the distance of the clips that the builder held out. They keep apart the
    /// repetitions of a wave, whose outputs cancel otherwise; where a motion repeats itself, all come from one clip. More
    /// keeps to the order of the clips, and is slower to notice that the body is elsewhere in them; less flattens
    /// waves. 0 takes the nearest frames, as Xia 2015 does.
    29 FOLLOW follow: f32 = 1.0, [0 or 0.01 to 100.0], &[Method::Mar];
    /// How far an output may turn a joint beyond where any captured frame of the database has it, radians along each axis,
    /// unless the input goes that way too. 0 sets no limit: elbows may bend backwards. More gives a strength above 1 more
    /// room, less holds back styles of bodies that are more flexible than the database's.
    30 JOINT_MARGIN joint_margin: f32 = 0.05, [0 or 1e-3 to 10.0], &Method::ALL;
}

impl Parameter {
    /// Its default, as a number.
    pub fn default(&self) -> f32 {
        value(&Config::new(), self.number).unwrap_or(f32::NAN)
    }
}

/// Number of the first parameter that is out of its range.
pub(super) fn out_of_range(config: &Config) -> Option<u16> {
    let is_outside = |range: &Range, number| !value(config, number).is_some_and(|v| range.contains(v));
    RANGES.iter().zip(0..).find(|&(range, number)| is_outside(range, number)).map(|(_, number)| number)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_parameter_stands_at_its_number_and_its_default_is_in_range() {
        for (i, parameter) in TABLE.iter().enumerate() {
            assert_eq!(usize::from(parameter.number), i, "{}", parameter.name);
            assert_eq!((NAMES[i], RANGES[i]), (parameter.name, parameter.range));
            assert!(parameter.range.contains(parameter.default()), "{}", parameter.name);
        }
    }

    #[test]
    fn every_parameter_goes_both_ways() {
        for parameter in TABLE {
            let Range { least, most, .. } = parameter.range;
            for number in [least, most] {
                let config = set(Config::new(), parameter.number, number).expect("it is in range");
                assert_eq!(value(&config, parameter.number), Some(number), "{}", parameter.name);
                let others = TABLE.iter().filter(|other| other.number != parameter.number);
                for other in others {
                    assert_eq!(value(&config, other.number), Some(other.default()), "{}", parameter.name);
                }
                assert_eq!(out_of_range(&config), None);
            }
        }
    }

    #[test]
    fn a_number_beyond_a_range_is_refused_by_its_parameters_name() {
        for parameter in TABLE {
            let Parameter { number, range, .. } = *parameter;
            for value in [range.least.next_down().min(-1e-3), range.most.next_up(), f32::NAN, f32::INFINITY] {
                let refused = match set(Config::new(), number, value) {
                    Ok(config) => out_of_range(&config),
                    Err(ConfigError::Parameter { number }) => Some(number),
                    Err(_) => None,
                };
                assert_eq!(refused, Some(number), "{} {value}", parameter.name);
            }
        }
    }

    #[test]
    fn a_number_that_a_type_does_not_hold_is_refused() {
        for (number, value) in [
            (K, 3.5),
            (K, -1.0),
            (K, 7e4),
            (K, f32::NAN),
            (POOL, 300.0),
            (TIMING, 2.0),
            (YAW, 0.5),
            (METHOD, Method::ALL.len() as f32),
        ] {
            let refused = Err(ConfigError::Parameter { number });
            assert_eq!(set(Config::new(), number, value), refused, "{number} {value}");
        }
        let have = TABLE.len() as u16;
        let unknown = ConfigError::Unknown { id: have, have };
        assert_eq!(set(Config::new(), have, 0.0), Err(unknown));
        assert_eq!(value(&Config::new(), have), None);
    }
}
