//! The place of the body in the clips of a whole action: which repetition of a wave it is at.
//!
//! A wave repeats itself, so frames of every repetition are about as near to the query. Their counterparts lie at other
//! moments of the other style's clip, which need not repeat the wave as often, and the mean of such outputs hardly moves.
//! A class whose clips are whole actions is therefore followed (ours; Xia 2015 takes the nearest frames):
//!
//! ```text
//! e    = u[t-1] + mean 1/duration           u: canonical time of the body in the clips of the class, 0 to 1
//! N    = the k nearest of the frames within 3 of e in each clip, at most 3 of a clip
//! u[t] = e + (mean canonical time of N - e) / 2
//! ```
//!
//! N takes the place of the nearest frames as long as `mean d²(N) <= mean d²(nearest) + follow · far`: it may be as much
//! further as the clips that the builder left out are ([`TrustLimits::far`](crate::blob::TrustLimits)). Beyond that the
//! body is elsewhere in the clip. The nearest frames are then used, and u begins anew at the nearest of them: the body has
//! jumped, and the output takes longer to settle.
//!
//! The distances of classes, and so their proportions and the trust in them, are those of the nearest frames.
//!
//! Cost: at most [`MOST_DISTANCES`] distances for each class kept. Gaits have no places: their cycles are alike.

use heapless::Vec;

use crate::{
    Report,
    blob::{Class, Database, layout::flag},
    math::clamp,
    methods::weights::Share,
    search::{
        found::{Neighbor, mean},
        metric::Metric,
        top_k::insert,
    },
};

/// Frames before and after the expected one that are compared.
const NEAR_ROWS: usize = 3;
/// Most frames of one clip among the neighbors, so that others take part.
const MOST_OF_CLIP: usize = 3;
/// Most clips of a class that are looked at. Of more, these many are taken evenly.
const MOST_CLIPS: usize = 8;
/// Most distances that following a class takes.
pub(super) const MOST_DISTANCES: u32 = (MOST_CLIPS * (2 * NEAR_ROWS + 1)) as u32;
/// Part of the difference from the expected canonical time by which the place is corrected in a frame.
const GAIN: f32 = 0.5;
/// The place in a class that is not followed.
const UNKNOWN: f32 = -1.0;

/// What the frames of a class that are near the expected place are compared with.
#[derive(Debug, Clone, Copy)]
pub(super) struct Limits {
    /// Mean squared distance of the nearest rows, weighted square metres.
    pub distance2: f32,
    /// [`Config::follow`](crate::Config::follow).
    pub follow: f32,
}

/// The place of the body in the clips of each class.
#[derive(Debug, Clone)]
pub(super) struct Places<const C: usize>([f32; C]);

impl<const C: usize> Places<C> {
    /// The state before the first frame, which clears it. All zeros, as the state of a method has to be.
    pub const NEW: Self = Self([0.0; C]);

    /// Forgets every place.
    pub fn clear(&mut self) {
        self.0.fill(UNKNOWN);
    }

    /// Forgets the places of classes that have no share.
    pub fn retain(&mut self, shares: &[Share]) {
        for (class, place) in self.0.iter_mut().enumerate() {
            if !shares.iter().any(|share| usize::from(share.class) == class) {
                *place = UNKNOWN;
            }
        }
    }

    /// Follows the body in a class of whole actions. `rows` has those that the search has found, nearest first. It gets
    /// those that follow the last place, unless they are too far. Returns true if the body has jumped: its place was known,
    /// and it is elsewhere.
    pub fn follow<const K: usize>(
        &mut self,
        database: &Database<'_>,
        class: usize,
        metric: &Metric,
        limits: Limits,
        rows: &mut Vec<u16, K>,
        report: &mut Report,
    ) -> bool {
        let Some(place) = self.0.get_mut(class) else { return false };
        let (was_known, mut found) = (*place >= 0.0, Vec::new());
        let distances = follow(database, class, metric, limits, rows, place, &mut found);
        if !found.is_empty() {
            rows.clear();
            for neighbor in &found {
                // At most as many as the nearest, which fit.
                let _ = rows.push(neighbor.row);
            }
        }
        report.visits += distances;
        report.bytes_read += distances * metric.bytes() as u32;
        was_known && found.is_empty()
    }
}

/// Room for the best frames of every clip.
type Near = Vec<Neighbor, { MOST_CLIPS * MOST_OF_CLIP }>;

/// See [`Places::follow`]. Leaves `found` empty where the nearest rows are to be used. Returns the number of distances computed.
// Not generic over capacities, so that it is compiled with the core, optimised for speed.
#[inline(never)]
fn follow(
    database: &Database<'_>,
    class: usize,
    metric: &Metric,
    limits: Limits,
    nearest: &[u16],
    place: &mut f32,
    found: &mut Near,
) -> u32 {
    let record = database.class(class);
    let mut distances = 0;
    if *place >= 0.0 {
        let clips = record.cycles.clamp(1, MOST_CLIPS);
        let clip = |i: usize| record.first_cycle + i * record.cycles / clips;
        let pace = (0..clips).map(|i| 1.0 / database.cycle_duration(clip(i))).sum::<f32>() / clips as f32;
        let expected = clamp(*place + pace, 0.0, 1.0);
        for i in 0..clips {
            distances += measure(database, &record, clip(i), expected, metric, found);
        }
        found.truncate(nearest.len());
        let far = database.trust_limits(class).map_or(0.0, |trust| trust.far);
        let most = limits.distance2 + limits.follow * far;
        if !found.is_empty() && mean(found) * metric.unit2() <= most {
            let times = found.iter().map(|neighbor| time_of(database, class, &record, neighbor.row));
            let seen = times.sum::<f32>() / found.len() as f32;
            *place = clamp(expected + GAIN * (seen - expected), 0.0, 1.0);
            return distances;
        }
        found.clear();
    }
    *place = nearest.first().map_or(UNKNOWN, |&row| time_of(database, class, &record, row));
    distances
}

/// Canonical time of a row of the class in its clip, 0 to 1.
fn time_of(database: &Database<'_>, class: usize, record: &Class, row: u16) -> f32 {
    let row = record.first_row + usize::from(row);
    let time = database.cycle_of(class, row).map_or(0.0, |cycle| database.cycle_time(cycle, row));
    clamp(time, 0.0, 1.0)
}

/// Adds the frames of a clip that are nearest to the query, of those near the `expected` canonical time, to `found`. Returns
/// the number of distances computed.
fn measure(
    database: &Database<'_>,
    class: &Class,
    cycle: usize,
    expected: f32,
    metric: &Metric,
    found: &mut Near,
) -> u32 {
    let mut best: Vec<Neighbor, MOST_OF_CLIP> = Vec::new();
    let (mut distances, own) = (0, database.cycle_rows(class, cycle));
    let middle = database.row_at(cycle, expected);
    for row in middle.saturating_sub(NEAR_ROWS)..=middle + NEAR_ROWS {
        if !own.contains(&row) || database.flags(row) & flag::SEARCHABLE == 0 {
            continue;
        }
        distances += 1;
        let distance2 = metric.distance2(database, row);
        // A class has fewer than 2^16 rows.
        let row = u16::try_from(row - class.first_row).unwrap_or(u16::MAX);
        let neighbor = Neighbor { distance2, row, expanded: false, followed: true };
        insert(&mut best, MOST_OF_CLIP, neighbor, |other| other.distance2 <= distance2);
    }
    for &neighbor in &best {
        insert(found, MOST_CLIPS * MOST_OF_CLIP, neighbor, |other| other.distance2 <= neighbor.distance2);
    }
    distances
}
