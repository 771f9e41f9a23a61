//! Units of length: a BVH file does not state its own, so it is given or guessed.
//!
//! The guess is by the body's height, estimated from its bones (many files have no rest pose). The unit is the one whose
//! height is nearest in ratio to 1.7 m.

use std::str::FromStr;

use thiserror::Error;

/// Unit of length of a BVH file.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Unit {
    /// 1 m.
    Metres,
    /// 0.01 m.
    Centimetres,
    /// 0.001 m.
    Millimetres,
    /// 0.0254 m.
    Inches,
    /// The CMU library's: inches divided by 0.45, 0.05644 m.
    Cmu,
    /// Metres a unit.
    Other(f64),
}

impl Unit {
    /// Those with a name.
    pub const KNOWN: [Unit; 5] =
        [Unit::Metres, Unit::Centimetres, Unit::Millimetres, Unit::Inches, Unit::Cmu];

    /// Metres a unit.
    pub fn metres(self) -> f64 {
        match self {
            Unit::Metres => 1.0,
            Unit::Centimetres => 0.01,
            Unit::Millimetres => 0.001,
            Unit::Inches => 0.0254,
            Unit::Cmu => 0.0254 / 0.45,
            Unit::Other(metres) => metres,
        }
    }

    /// The name that [`FromStr`] takes.
    pub fn name(self) -> String {
        match self {
            Unit::Metres => "m".to_string(),
            Unit::Centimetres => "cm".to_string(),
            Unit::Millimetres => "mm".to_string(),
            Unit::Inches => "inch".to_string(),
            Unit::Cmu => "cmu".to_string(),
            Unit::Other(metres) => format!("{metres}"),
        }
    }

    /// Guesses from the body's height, in file units.
    pub fn guess(height: f64) -> UnitGuess {
        let off = |u: Unit| (height * u.metres() / ADULT_M).ln().abs();
        let mut unit = Unit::Metres;
        for candidate in Unit::KNOWN {
            if off(candidate) < off(unit) {
                unit = candidate;
            }
        }
        UnitGuess { unit, height_m: height * unit.metres(), sure: off(unit) < 1.35f64.ln() }
    }
}

/// Expected height, metres.
const ADULT_M: f64 = 1.7;

/// Result of [`Unit::guess`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct UnitGuess {
    /// The unit.
    pub unit: Unit,
    /// Height of the body in that unit, estimated, metres.
    pub height_m: f64,
    /// Whether that is a height of an adult (within 35%).
    pub sure: bool,
}

/// Heights of bodies that a format with a unit may hold, metres: toys and giants. Others are in another unit.
const HEIGHTS_M: std::ops::RangeInclusive<f64> = 0.1..=20.0;

impl UnitGuess {
    /// The unit to take instead of the format's own, if a body cannot be as large in it as it is: that in which it is an
    /// adult, as of a BVH file that was converted as it is, or the power of ten that comes nearest.
    pub fn instead(&self, unit: Unit) -> Option<(Unit, String)> {
        let height_m = self.height_m / self.unit.metres() * unit.metres();
        if HEIGHTS_M.contains(&height_m) || !(height_m > 0.0 && height_m.is_finite()) {
            return None;
        }
        let metres = if self.sure {
            self.unit.metres()
        } else {
            unit.metres() * 10f64.powi((ADULT_M / height_m).log10().round() as i32)
        };
        let known = Unit::KNOWN.into_iter().find(|known| (known.metres() / metres - 1.0).abs() < 1e-9);
        let taken = known.unwrap_or(Unit::Other(metres));
        // Three digits of it: it may be any size.
        let digits = 10f64.powi(2 - height_m.log10().floor() as i32);
        let tall = (height_m * digits).round() / digits;
        let said = format!(
            "the body is about {tall} m tall in the format's unit, {}: lengths are taken in another, of {} m; if \
             that is wrong, give the unit, or export the file in metres",
            unit.name(),
            taken.metres()
        );
        Some((taken, said))
    }

    /// A warning if another unit than the format's own gives an adult's height.
    pub fn doubt(&self, unit: Unit) -> Option<String> {
        let height_m = self.height_m / self.unit.metres() * unit.metres();
        (self.sure && self.unit != unit).then(|| {
            format!(
                "the body is about {height_m:.2} m tall in the format's unit, {}; in {} it is an adult's, so say the unit if \
                 this is wrong",
                unit.name(),
                self.unit.name()
            )
        })
    }
}

impl std::fmt::Display for UnitGuess {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let UnitGuess { unit, height_m, sure } = self;
        write!(f, "unit guessed as {} (the body is about {height_m:.2} m tall)", unit.name())?;
        if !sure {
            write!(f, "; that is no adult's height, so say the unit if this is wrong")?;
        }
        Ok(())
    }
}

/// An unknown unit.
#[derive(Debug, Clone, PartialEq, Error)]
#[error("`{0}` is not a unit; expected m, cm, mm, inch, cmu, or metres a unit as a number above zero")]
pub struct ParseUnitError(pub String);

impl FromStr for Unit {
    type Err = ParseUnitError;

    fn from_str(text: &str) -> Result<Unit, ParseUnitError> {
        match text.trim().to_ascii_lowercase().as_str() {
            "m" | "metre" | "metres" | "meter" | "meters" => Ok(Unit::Metres),
            "cm" | "centimetre" | "centimetres" | "centimeter" | "centimeters" => Ok(Unit::Centimetres),
            "mm" | "millimetre" | "millimetres" | "millimeter" | "millimeters" => Ok(Unit::Millimetres),
            "in" | "inch" | "inches" => Ok(Unit::Inches),
            "cmu" => Ok(Unit::Cmu),
            other => match other.parse::<f64>() {
                Ok(metres) if metres.is_finite() && metres > 0.0 => Ok(Unit::Other(metres)),
                _ => Err(ParseUnitError(text.to_string())),
            },
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_adult_is_seen_in_every_unit() {
        for unit in Unit::KNOWN {
            for height_m in [1.4, 1.7, 2.0] {
                let guess = Unit::guess(height_m / unit.metres());
                assert_eq!(guess.unit, unit);
                assert!(guess.sure && (guess.height_m - height_m).abs() < 1e-9);
            }
        }
        assert!(!Unit::guess(0.0).sure);
        assert!(!Unit::guess(f64::INFINITY).sure);
    }

    /// A format states metres, and the body is one of another unit, or none of a known one.
    #[test]
    fn a_body_too_large_or_small_is_an_adult_in_another_unit() {
        for (height, metres) in
            [(1.7, None), (15.0, None), (32.5, Some(Unit::Cmu)), (180.0, Some(Unit::Centimetres))]
        {
            let instead = Unit::guess(height).instead(Unit::Metres);
            assert_eq!(instead.map(|(unit, _)| unit), metres, "{height}");
        }
        let small = Unit::guess(0.017).instead(Unit::Metres).unwrap().0;
        assert!((small.metres() - 100.0).abs() < 1e-9);
    }

    #[test]
    fn names_come_back() {
        for unit in Unit::KNOWN.into_iter().chain([Unit::Other(0.3048)]) {
            assert_eq!(unit.name().parse(), Ok(unit));
        }
        for bad in ["", "furlong", "-1", "0", "nan", "inf"] {
            assert!(bad.parse::<Unit>().is_err(), "{bad}");
        }
    }
}
