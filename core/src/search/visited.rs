//! The set of rows that a search has measured: a hash set of fixed size.

/// Number of slots: more than any search adds, so that every row finds one.
pub const SLOTS: usize = 512;

/// Number of occupied slots that one search may probe. A search that uses all of its visits and reaches each row from ten
/// others probes some 6,000. Rows chosen to collide would take hundreds each.
pub const PATIENCE: u16 = 16_384;

/// A set of fewer than [`SLOTS`] rows in 1 KB. A slot holds the row plus 1, or 0 if it is free. The empty set is all
/// zeros, so that a static stylizer takes no flash.
#[derive(Debug, Clone)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Visited([u16; SLOTS]);

impl Visited {
    /// No row.
    #[inline]
    pub const fn new() -> Self {
        Self([0; SLOTS])
    }

    /// Removes every row.
    #[inline]
    pub fn clear(&mut self) {
        self.0 = [0; SLOTS];
    }

    /// Adds a row other than [`NONE`](crate::blob::layout::NONE). Returns false if it is in the set already, or if
    /// `patience` is used up before a free slot is found.
    #[inline]
    pub fn insert(&mut self, row: u16, patience: &mut u16) -> bool {
        // Fibonacci hashing with double hashing: nine bits select the slot, the other seven an odd step, which reaches every
        // slot. No two rows share both.
        let hash = row.wrapping_mul(40_503);
        let mut slot = usize::from(hash >> 7);
        while let Some(place) = self.0.get_mut(slot & (SLOTS - 1)) {
            if *place == 0 {
                *place = row.wrapping_add(1);
                return true;
            }
            if *place == row.wrapping_add(1) || *patience == 0 {
                return false;
            }
            *patience -= 1;
            slot += 2 * usize::from(hash & 127) + 1;
        }
        false
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::blob::layout::NONE;

    /// Occupied slots that it takes to add rows, and to come to each from ten others.
    fn collisions(rows: impl Iterator<Item = u16> + Clone) -> u32 {
        let mut visited = Visited::new();
        let mut looked_at = 0;
        for (time, row) in (0..10).flat_map(|time| rows.clone().map(move |row| (time, row))) {
            let mut patience = u16::MAX;
            assert_eq!(visited.insert(row, &mut patience), time == 0, "row {row}");
            looked_at += u32::from(u16::MAX - patience);
        }
        looked_at
    }

    #[test]
    fn rows_side_by_side_rows_at_random_and_rows_of_one_slot_leave_patience() {
        let most = crate::search::graph::MAX_VISITS;
        for step in [1, 2, 3, 64, 128, 146] {
            let looked_at = collisions((0..most).map(|i| i * step));
            assert!(looked_at < u32::from(PATIENCE), "every {step}: {looked_at}");
        }
        // A generator of full period: no row comes twice.
        let random = (0..most).scan(1_u16, |row, _| {
            *row = row.wrapping_mul(25_173).wrapping_add(13_849);
            Some(*row)
        });
        let looked_at = collisions(random.filter(|&row| row != NONE));
        assert!(looked_at < u32::from(PATIENCE) / 2, "at random: {looked_at}");
        let looked_at = collisions((0..NONE).filter(|row| row.wrapping_mul(40_503) >> 7 == 7));
        assert!(looked_at < u32::from(PATIENCE), "of one slot: {looked_at}");
    }

    #[test]
    fn without_patience_a_row_that_collides_is_not_added() {
        let (mut visited, mut patience) = (Visited::new(), 0);
        let mut same = (0..NONE).filter(|row| row.wrapping_mul(40_503) >> 7 == 0);
        let (first, second) = (same.next().unwrap(), same.next().unwrap());
        assert!(visited.insert(first, &mut patience));
        assert!(!visited.insert(second, &mut patience));
        patience = 1;
        assert!(visited.insert(second, &mut patience));
        assert!(!visited.insert(first, &mut patience));
    }
}
