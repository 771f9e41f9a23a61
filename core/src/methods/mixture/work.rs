//! The most work of a step of the mixture.

use crate::{
    Config,
    blob::{Database, layout::block},
    error::saturating_u32,
    methods::{
        mixture::{contact_votes::MAX_VOTERS, places::MAX_DISTANCES},
        weights::{MAX_KEPT_FRESH, most_kept},
        work::{Load, Work},
    },
    search::{
        graph::{EDGE_BYTES, MAX_FOLLOWED, MAX_VISITS},
        visited::PATIENCE,
    },
};

/// Visits that a frame has to spare beyond those of its classes, for searches that are begun anew.
pub(super) const SPARE: u16 = MAX_VISITS;
/// Bytes of a frame's squared length.
const NORM: u32 = 4;
/// Rows that an example unpacks of the input, and the most that it unpacks of an output: two about either moment.
const ROWS_INPUT: u32 = 2;
const ROWS_OUTPUT: u32 = 4;

impl Work {
    /// The most work of a step of the mixture, but for the bytes that it reads.
    ///
    /// `rows` are those of each class that is searched, `gestures` is the number of those that are not gaits, `mixes` and
    /// `outputs` as in [`Work`]. With C classes of more rows than `V = config.visits`, a step computes at most
    /// `C V` + [`MAX_VISITS`] distances: after a jump a class is searched again, with the visits that the others have not
    /// used and [`MAX_VISITS`] more. Smaller classes are compared whole, once. Of the classes `config.classes` are unpacked,
    /// at most; in a stream's first frame two, and the nearest once more. Each of them that is not a gait takes
    /// `MAX_DISTANCES` distances more to be followed.
    pub fn of_mixture(
        config: &Config,
        rows: impl Iterator<Item = usize>,
        gestures: u32,
        mixes: u32,
        outputs: u32,
    ) -> Self {
        let visits = u32::from(config.visits);
        let (mut searched, mut large, mut distances) = (0_u32, 0_u32, 0_u32);
        for rows in rows {
            let rows = saturating_u32(rows);
            searched += 1;
            large += u32::from(rows > visits);
            distances += rows.min(visits);
        }
        // What small classes leave of their visits is there for the others, which use at most as many again as their own.
        let spare = u32::from(SPARE) + searched * visits - distances;
        let kept = most_kept(config, searched);
        let first = if searched > 0 { kept.min(MAX_KEPT_FRESH as u32) + 1 } else { 0 };
        let classes = kept.max(first);
        let followed = if config.follow > 0.0 { kept.min(gestures) } else { 0 };
        let examples = classes * u32::from(config.k);
        Self {
            searched,
            distances: distances + spare.min(large * visits) + followed * MAX_DISTANCES,
            // A search clears its visited set twice at most.
            collisions: 2 * large * u32::from(PATIENCE),
            followed: large * u32::from(config.k) * MAX_FOLLOWED as u32,
            classes,
            examples,
            voters: examples.min(MAX_VOTERS as u32),
            mixes,
            outputs,
            bytes_read: 0,
        }
    }
}

/// See [`Translate::worst_step`](crate::methods::context::Translate::worst_step).
pub(super) fn worst_step(database: &Database<'_>, config: &Config, load: &Load) -> Work {
    let counts = database.counts();
    let rows = load.classes(database).map(|(_, class)| class.rows);
    let gestures =
        saturating_u32(load.classes(database).filter(|&(class, _)| !database.is_gait(class)).count());
    let outputs = load.styles * saturating_u32(database.outputs());
    let work = Work::of_mixture(config, rows, gestures, load.mixes, outputs);
    let row_bytes = saturating_u32(block::header(counts.dofs) + (counts.dofs * block::MAX_WIDTH).div_ceil(8));
    let rows = work.examples * (ROWS_INPUT * work.mixes + ROWS_OUTPUT * work.outputs);
    // Every frame that is measured may be expanded.
    let bytes_read = work.distances * (saturating_u32(counts.features) + NORM + EDGE_BYTES)
        + rows.saturating_mul(row_bytes);
    Work { bytes_read, ..work }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_work_follows_from_classes_and_settings() {
        let config = Config::new().k(40).classes(8);
        let work = |config: &Config, rows: &[usize]| Work::of_mixture(config, rows.iter().copied(), 0, 1, 2);
        let all = work(&config, &[1000; 28]);
        assert_eq!((all.searched, all.distances), (28, 28 * 256 + 448));
        assert_eq!((all.classes, all.examples, all.voters), (8, 320, MAX_VOTERS as u32));
        let labelled = work(&config, &[1000; 2]);
        assert_eq!((labelled.distances, labelled.classes), (2 * 256 + 448, 3), "the nearest comes twice");
        // A class of 100 rows is compared whole. Its other visits go to the large one, which uses as many again as its own.
        let small = work(&config, &[100, 1000]);
        assert_eq!((small.distances, small.collisions), (100 + 2 * 256, 2 * u32::from(PATIENCE)));
        let gesture = Work::of_mixture(&config, [1000; 2].into_iter(), 1, 1, 2);
        assert_eq!(gesture.distances, labelled.distances + 56, "one class is followed");
        assert_eq!(work(&config, &[]), Work { mixes: 1, outputs: 2, ..Work::default() });
    }
}
