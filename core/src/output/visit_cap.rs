//! Keeps a deadline: adapts the cap on search visits to how long the last steps took.
//!
//! The visits of a search ([`Config::visits`](crate::Config::visits)) bound the cost of a step. The search is also what
//! takes longest when a stream jumps or is far from the data. A step that comes near its deadline halves the cap of the
//! next steps; steps with time to spare raise it again, slowly. A missed deadline thus costs some recall
//! ([`Degraded::VISITS`](crate::Degraded::VISITS)) instead of more late frames.
//!
//! The core has no clock. The caller measures, in ticks of any timer. `docs/PORTING.md` has the loop.

use crate::{
    ConfigError,
    config::parameters::{RANGES, VISITS},
    search::graph::MAX_VISITS,
};

/// Smallest cap. Fewer visits find too few neighbors.
pub const MIN_VISITS: u16 = 64;
const _: () = assert!(RANGES[VISITS as usize].least == MIN_VISITS as f32);
/// Number of fast steps in a row after which the cap rises.
const STEPS_TO_RAISE: u8 = 8;

/// The cap on visits, and its state between steps.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct VisitCap {
    budget: u32,
    max: u16,
    cap: u16,
    fast_steps: u8,
    missed: u32,
}

impl VisitCap {
    /// A cap for steps that may take `budget` ticks, at most `max` visits a class.
    ///
    /// # Errors
    /// [`ConfigError::OutOfRange`] where `max` is not [`MIN_VISITS`] to [`MAX_VISITS`], or the budget is 0.
    pub const fn new(budget: u32, max: u16) -> Result<Self, ConfigError> {
        if budget == 0 || max < MIN_VISITS || max > MAX_VISITS {
            return Err(ConfigError::OutOfRange);
        }
        Ok(Self { budget, max, cap: max, fast_steps: 0, missed: 0 })
    }

    /// The cap in force.
    pub const fn visits(&self) -> u16 {
        self.cap
    }

    /// Number of steps that took longer than the budget.
    pub const fn missed(&self) -> u32 {
        self.missed
    }

    /// Records how many ticks a step took; returns the cap for the next one
    /// ([`Stylizer::set_visits`](crate::Stylizer::set_visits)).
    ///
    /// A step of more than seven eighths of the budget halves the cap. Eight steps in a row within half of the budget raise
    /// it by an eighth.
    pub const fn after(&mut self, ticks: u32) -> u16 {
        if ticks > self.budget {
            self.missed = self.missed.saturating_add(1);
        }
        if ticks > self.budget - self.budget / 8 {
            self.cap = if self.cap / 2 > MIN_VISITS { self.cap / 2 } else { MIN_VISITS };
            self.fast_steps = 0;
        } else if ticks <= self.budget / 2 {
            self.fast_steps += 1;
            if self.fast_steps >= STEPS_TO_RAISE {
                self.fast_steps = 0;
                let raised = self.cap + self.cap / 8;
                self.cap = if raised < self.max { raised } else { self.max };
            }
        } else {
            self.fast_steps = 0;
        }
        self.cap
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_miss_lowers_the_cap_and_spare_time_raises_it_again() {
        let mut cap = VisitCap::new(1000, 320).expect("it is in range");
        assert_eq!(cap.after(600), 320);
        // Nearly late counts, late is counted.
        assert_eq!((cap.after(880), cap.missed()), (160, 0));
        assert_eq!((cap.after(1500), cap.missed()), (80, 1));
        assert_eq!((cap.after(1001), cap.after(u32::MAX), cap.missed()), (64, 64, 3));
        // Neither late nor with time to spare: it stays.
        assert_eq!((0..100).map(|_| cap.after(700)).last(), Some(64));
        let mut rises = vec![];
        for _ in 0..8 * 16 {
            let before = cap.visits();
            if cap.after(300) != before {
                rises.push(cap.visits());
            }
        }
        assert!(rises.is_sorted() && rises[0] == 72 && rises.last() == Some(&320), "{rises:?}");
        // Seven steps with time to spare are not eight.
        cap.after(2000);
        for _ in 0..50 {
            assert_eq!((0..7).map(|_| cap.after(0)).last(), Some(160));
            assert_eq!(cap.after(700), 160);
        }
    }

    #[test]
    fn every_cap_suits_a_stylizer_whatever_the_ticks_are() {
        for (budget, max) in [(1, 64), (2, 448), (u32::MAX, 320), (7, 65)] {
            let mut cap = VisitCap::new(budget, max).expect("it is in range");
            let mut ticks = 1u32;
            for _ in 0..5000 {
                ticks = ticks.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
                let visits = cap.after(ticks >> (ticks & 31));
                assert!((MIN_VISITS..=max).contains(&visits), "{budget} {max}: {visits}");
            }
        }
        for (budget, max) in [(0, 320), (100, 63), (100, 449)] {
            assert_eq!(VisitCap::new(budget, max), Err(ConfigError::OutOfRange));
        }
    }
}
