//! The state of fault handling: see [`super::fallback`].

/// Number of poses in a row, all out of order, after which the sender's counter counts as restarted.
const RESTARTED: u8 = 8;

/// Poses out of order.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
struct Rejected {
    /// Number of the last one.
    number: u32,
    /// How many came in a row.
    count: u8,
}

/// The state of fault handling between frames.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub(super) struct FaultState {
    /// Number of the last input that was a valid pose, whether it was accepted or a glitch.
    pub number: Option<u32>,
    /// The poses that came out of order.
    rejected: Rejected,
    /// Frames from the last accepted input to this one, by their numbers.
    pub gap: u16,
    /// Glitches since the last accepted input.
    pub leaps: u8,
    /// Ground speed of the last accepted input, forward and to the left, m/s; `None` before the second input.
    pub speed: Option<[f32; 2]>,
    /// Time left of the blend back, seconds.
    pub blend_back_s: f32,
    /// The feet that the last output stands on, one bit each.
    pub stands: u8,
}

impl FaultState {
    pub const fn new() -> Self {
        Self {
            number: None,
            rejected: Rejected { number: 0, count: 0 },
            gap: 1,
            leaps: 0,
            speed: None,
            blend_back_s: 0.0,
            stands: 0,
        }
    }

    /// Frames from the last accepted input to this one: by their numbers, or by the glitches between them.
    pub fn frames(&self) -> f32 {
        let glitches = u16::from(self.leaps) + 1;
        f32::from(if glitches > self.gap { glitches } else { self.gap })
    }

    /// Frames from the last pose to the one with this number; `None` if it is not later. After [`RESTARTED`] such poses in a
    /// row the counter counts as restarted, and the stream continues with its numbers.
    pub fn gap(&mut self, number: u32) -> Option<u16> {
        let Some(last) = self.number else { return Some(1) };
        // Numbers wrap. The shorter way around decides which is later.
        match number.wrapping_sub(last) {
            0 | 0x8000_0000.. => {
                let Rejected { number: before, count } = self.rejected;
                let follows = count > 0 && (1..=u32::from(RESTARTED)).contains(&number.wrapping_sub(before));
                let count = if follows { count.saturating_add(1) } else { 1 };
                self.rejected = Rejected { number, count };
                if count < RESTARTED {
                    return None;
                }
                self.rejected.count = 0;
                Some(1)
            }
            gap => {
                self.rejected.count = 0;
                Some(u16::try_from(gap).unwrap_or(u16::MAX))
            }
        }
    }
}
