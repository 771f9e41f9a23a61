//! From angles to the pulses of hobby servos: microseconds, with offset, gain and end stops.
//!
//! ```text
//! pulse = centre + (angle - zero) gain       clamped to least and greatest, rounded to a microsecond
//! ```
//!
//! Cost: six operations a hinge.

use crate::math::clamp;

/// The pulse range of a servo and how it is mounted.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Servo {
    /// Pulse at the angle `zero`, microseconds.
    pub centre_us: f32,
    /// Microseconds a radian, negative where the servo is mounted the other way round.
    pub gain_us: f32,
    /// Angle of the hinge at which the pulse is `centre_us`, radians.
    pub zero: f32,
    /// Shortest pulse that the servo may be given, microseconds.
    pub least_us: f32,
    /// Longest pulse, microseconds.
    pub greatest_us: f32,
}

impl Servo {
    /// True if every number is in its range.
    pub fn is_valid(&self) -> bool {
        let pulse = |v: f32| (1.0..=20_000.0).contains(&v);
        pulse(self.least_us)
            && pulse(self.greatest_us)
            && self.least_us < self.greatest_us
            && (self.least_us..=self.greatest_us).contains(&self.centre_us)
            && (1.0..=1e5).contains(&crate::math::abs(self.gain_us))
            && (-100.0..=100.0).contains(&self.zero)
    }

    /// The pulse for an angle, microseconds; for NaN that of the centre.
    pub fn pulse(&self, angle: f32) -> u16 {
        let free = self.centre_us + (angle - self.zero) * self.gain_us;
        let free = if free.is_finite() { free } else { self.centre_us };
        // Positive and below 20,001, so the cast rounds down.
        (clamp(free, self.least_us, self.greatest_us) + 0.5) as u16
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn range_offset_and_direction() {
        let servo =
            Servo { centre_us: 1500.0, gain_us: -600.0, zero: 0.25, least_us: 700.0, greatest_us: 2300.0 };
        assert!(servo.is_valid());
        for (angle, pulse) in
            [(0.25, 1500), (0.0, 1650), (1.25, 900), (3.0, 700), (-3.0, 2300), (f32::NAN, 1500)]
        {
            assert_eq!(servo.pulse(angle), pulse, "{angle}");
        }
        assert!(!Servo { gain_us: 0.0, ..servo }.is_valid());
        assert!(!Servo { centre_us: 500.0, ..servo }.is_valid());
    }
}
