//! What a board sends of its robot: which one it is, and the hinges after a tick.

use serde::{Deserialize, Serialize};

use crate::robot::{Driven, layout::MAX_HINGES};

/// Bytes of a hinge on the line: its angle, f32, and its pulse, u16.
pub const HINGE_BYTES: usize = 6;

/// The robot of a board.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct RobotIdentity {
    /// [`Robot::identity`](crate::robot::Robot::identity).
    pub robot: u32,
    /// Hinges.
    pub hinges: u16,
    /// Hinges that the board has room for.
    pub capacity: u16,
    /// Time between two ticks, seconds.
    pub tick_s: f32,
}

/// The report of a robot's tick, as it is sent.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct DriveReport<'a> {
    /// [`Driven::held`]; also before the stream's first pose.
    pub held: bool,
    /// [`Driven::at_limit`].
    pub at_limit: u16,
    /// [`Driven::lag`], radians.
    pub lag: f32,
    /// [`Driven::missing_m`].
    pub missing_m: f32,
    /// [`HINGE_BYTES`] a hinge, in the order of the tables: angle in radians, f32, and pulse in microseconds, u16,
    /// little-endian.
    #[serde(borrow)]
    pub hinges: &'a [u8],
}

impl DriveReport<'_> {
    /// Angles in radians and pulses in microseconds. Bytes of an incomplete hinge are ignored.
    pub fn hinges(&self) -> impl Iterator<Item = (f32, u16)> + '_ {
        let (hinges, _) = self.hinges.as_chunks::<HINGE_BYTES>();
        hinges.iter().map(|&[a, b, c, d, low, high]| {
            (f32::from_le_bytes([a, b, c, d]), u16::from_le_bytes([low, high]))
        })
    }
}

/// Buffer of the hinges' bytes.
#[derive(Debug, Clone)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct HingeBuffer([[u8; HINGE_BYTES]; MAX_HINGES]);

impl HingeBuffer {
    /// A buffer for as many hinges as a robot can have.
    pub const fn new() -> Self {
        Self([[0; HINGE_BYTES]; MAX_HINGES])
    }

    /// The report of a tick; `hinge` gives angle and pulse of each hinge, and `None` after the last.
    pub fn report(
        &mut self,
        driven: &Driven,
        hinge: impl Fn(usize) -> Option<(f32, u16)>,
    ) -> DriveReport<'_> {
        let mut count = 0;
        for (slot, (angle, pulse)) in self.0.iter_mut().zip((0..MAX_HINGES).map_while(hinge)) {
            let ([a, b, c, d], [low, high]) = (angle.to_le_bytes(), pulse.to_le_bytes());
            *slot = [a, b, c, d, low, high];
            count += 1;
        }
        let Driven { held, at_limit, lag, missing_m } = *driven;
        DriveReport {
            held,
            at_limit,
            lag,
            missing_m,
            hinges: self.0.get(..count).unwrap_or(&self.0).as_flattened(),
        }
    }
}

impl Default for HingeBuffer {
    fn default() -> Self {
        Self::new()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn hinges_travel_bit_by_bit() {
        let all = [(-0.0, 0), (f32::NAN, 1500), (1e-40, u16::MAX)];
        let driven = Driven { held: true, at_limit: 2, lag: 0.5, missing_m: 0.25 };
        let mut buffer = HingeBuffer::new();
        let report = buffer.report(&driven, |h| all.get(h).copied());
        assert_eq!(report.hinges.len(), 3 * HINGE_BYTES);
        let bits = |(angle, pulse): (f32, u16)| (angle.to_bits(), pulse);
        assert!(report.hinges().map(bits).eq(all.map(bits)));
        assert!((report.held, report.at_limit, report.lag, report.missing_m) == (true, 2, 0.5, 0.25));
        // Half a hinge is none.
        assert_eq!(DriveReport { hinges: &report.hinges[..8], ..report }.hinges().count(), 1);
        assert_eq!(buffer.report(&driven, |_| Some((0.0, 0))).hinges().count(), MAX_HINGES);
    }
}
