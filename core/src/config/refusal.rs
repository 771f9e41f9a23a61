//! The messages of [`ConfigError`]: what was refused, and what to do. They name parameters, which return the error: hence
//! a file of their own.

use core::fmt;

use super::parameters;
use crate::ConfigError;

impl fmt::Display for ConfigError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match *self {
            Self::Joints { need, have } => {
                write!(f, "the skeleton has {need} joints, and there is room for {have}: raise J")
            }
            Self::Classes { need, have } => {
                write!(f, "the database has {need} classes, this stylizer takes {have}: raise C")
            }
            Self::Hinges { need, have } => {
                write!(f, "the robot has {need} hinges, this drive takes {have}: raise H")
            }
            Self::Neighbors { need, have } => {
                write!(f, "k is {need}, this stylizer takes 1 to {have}: lower k or raise K")
            }
            Self::Unknown { id, have } => {
                write!(
                    f,
                    "there is no style, action, joint group or parameter {id}: there are {have}, counted from 0"
                )
            }
            Self::Poses { need, have } => {
                write!(f, "these bounds need {need} poses, this retimer keeps {have}: raise N or narrow them")
            }
            Self::NoClass => f.write_str(
                "the database does not hold that action in that style: label one of them, or neither",
            ),
            Self::Method => f.write_str(
                "the database does not hold what the method needs, or this program was built without the method: choose another, build the database with the models in it, or the program with the method",
            ),
            Self::WholeBody => f.write_str(
                "the linear models translate the whole body, with one state and one time step: give the style to the body, or choose another method",
            ),
            Self::OtherDatabase => f.write_str(
                "the robot or map was made for another database: make it again with this one, or take the one that it was made for",
            ),
            Self::Weights => f.write_str(
                "weights must be finite, not negative, and not all zero, and a joint group takes three styles at most",
            ),
            Self::OutOfRange => f.write_str("a value is not finite or out of its range, or a mask leaves nothing to search"),
            Self::Parameter { number } => {
                let number = usize::from(number);
                match (parameters::NAMES.get(number), parameters::RANGES.get(number)) {
                    (Some(name), Some(range)) => write!(f, "the parameter `{name}` takes {range}"),
                    _ => write!(f, "parameter {number} is out of its range"),
                }
            }
            Self::NoDial => f.write_str(
                "the database has no effort dial: build it again with two styles or more and `--effort`",
            ),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::MAX_GROUP_STYLES;

    #[test]
    fn a_refusal_names_the_value_and_the_limit() {
        let cases = [
            (
                ConfigError::Unknown { id: 25, have: 25 },
                "joint group or parameter 25: there are 25, counted from 0",
            ),
            (ConfigError::Weights, "a joint group takes three styles at most"),
            // No capacity of anything makes another database's robot fit.
            (ConfigError::OtherDatabase, "made for another database"),
            // The joints may be a database's or those of a map's other skeleton.
            (
                ConfigError::Joints { need: 60, have: 22 },
                "the skeleton has 60 joints, and there is room for 22: raise J",
            ),
        ];
        for (refusal, said) in cases {
            let text = refusal.to_string();
            assert!(text.contains(said), "{text}");
        }
        assert_eq!(MAX_GROUP_STYLES, 3, "the text of `Weights` says three");
    }
}
