//! The state of fault handling: see [`super::fallback`].

/// The state of fault handling between frames.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub(super) struct FaultState {
    /// Number of the last input that was a pose, accepted or a glitch.
    pub number: Option<u32>,
    /// Frames from the last accepted input to this one, by their numbers.
    pub gap: u16,
    pub leaps: u8,
    /// Seconds left of the blend back.
    pub blend_back_s: f32,
    /// The feet that the last output stands on, one bit each.
    pub stands: u8,
}

impl FaultState {
    pub const fn new() -> Self {
        Self { number: None, gap: 1, leaps: 0, blend_back_s: 0.0, stands: 0 }
    }

    /// Frames from the last accepted input to this one: by their numbers, or by the glitches between them.
    pub fn frames(&self) -> f32 {
        let glitches = u16::from(self.leaps) + 1;
        f32::from(if glitches > self.gap { glitches } else { self.gap })
    }

    /// Frames from the last pose to number `number`; `None` where it is not after that.
    pub fn gap(&self, number: u32) -> Option<u16> {
        let Some(last) = self.number else { return Some(1) };
        // Numbers wrap; the nearer way round says which is later.
        match number.wrapping_sub(last) {
            0 | 0x8000_0000.. => None,
            gap => Some(u16::try_from(gap).unwrap_or(u16::MAX)),
        }
    }
}
