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
//! Clips of a style repeat a wave at other moments, too, so the outputs of one moment still cancel if they come from several
//! clips. Where the motion repeats itself, that is, where the nearest frames lie at least [`REPEATS`] of a clip apart, N
//! comes from one clip: the last one, unless the frames of another have less than 1/[`KEEP`] of its distance. Elsewhere, as in
//! a raised hand, N comes from all clips, whose mean is nearer to the truth.
//!
//! The distances of classes, and so their proportions and the trust in them, are those of the nearest frames.
//!
//! Cost: at most [`MAX_DISTANCES`] distances for each class kept. Gaits have no places: their cycles are alike.

use heapless::Vec;

use crate::{
    Report,
    blob::{Class, Database, layout::flag},
    math::{clamp, maximum, minimum},
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
const MAX_OF_CLIP: usize = 3;
/// Most clips of a class that are looked at. Of more, these many are taken evenly.
const MAX_CLIPS: usize = 8;
/// Most distances that following a class takes.
pub(super) const MAX_DISTANCES: u32 = (MAX_CLIPS * (2 * NEAR_ROWS + 1)) as u32;
/// Part of the difference from the expected canonical time by which the place is corrected in a frame.
const GAIN: f32 = 0.5;
/// Least range of canonical times of the nearest frames of a motion that repeats itself.
const REPEATS: f32 = 0.15;
/// How many times as far as those of another clip the frames of the last one may be.
const KEEP: f32 = 4.0;
/// The place in a class that is not followed.
const UNKNOWN: f32 = -1.0;
/// No clip of a class: it has fewer.
const NO_CYCLE: u16 = u16::MAX;

/// What the frames of a class that are near the expected place are compared with.
#[derive(Debug, Clone, Copy)]
pub(super) struct Limits {
    /// Mean squared distance of the nearest rows, weighted square metres.
    pub distance2: f32,
    /// [`Config::follow`](crate::Config::follow).
    pub follow: f32,
}

/// The place of the body in the clips of a class.
#[derive(Debug, Clone, Copy)]
struct Place {
    /// u, or [`UNKNOWN`].
    time: f32,
    /// The clip that a motion that repeats itself was last fitted to, a cycle of the class. It outlives `time`, so that a
    /// wrong pose does not change the clip.
    cycle: u16,
}

/// The place of the body in the clips of each class.
#[derive(Debug, Clone)]
pub(super) struct Places<const C: usize>([Place; C]);

impl<const C: usize> Places<C> {
    /// The state before the first frame, which clears it. All zeros, as the state of a method has to be.
    pub const NEW: Self = Self([Place { time: 0.0, cycle: 0 }; C]);

    /// Begins anew.
    pub fn clear(&mut self) {
        self.0.fill(Place { time: UNKNOWN, cycle: NO_CYCLE });
    }

    /// Forgets the places of classes that have no share. Their clips are taken again.
    pub fn retain(&mut self, shares: &[Share]) {
        for (class, place) in self.0.iter_mut().enumerate() {
            if !shares.iter().any(|share| usize::from(share.class) == class) {
                place.time = UNKNOWN;
            }
        }
    }

    /// Follows the body in a class of whole actions. `rows` has those that the search has found, nearest first. It gets
    /// those that follow the last place, unless they are too far. Returns true if it keeps the nearest: the body is elsewhere,
    /// or its place was not known.
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
        let mut found = Vec::new();
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
        found.is_empty()
    }
}

/// Room for the best frames of every clip.
type Near = Vec<Neighbor, { MAX_CLIPS * MAX_OF_CLIP }>;

/// See [`Places::follow`]. Leaves `found` empty where the nearest rows are to be used. Returns the number of distances computed.
// Not generic over capacities, so that it is compiled with the core, optimised for speed.
#[inline(never)]
fn follow(
    database: &Database<'_>,
    class: usize,
    metric: &Metric,
    limits: Limits,
    nearest: &[u16],
    place: &mut Place,
    found: &mut Near,
) -> u32 {
    let record = database.class(class);
    let mut distances = 0;
    let time = |&row: &u16| time_of(database, class, &record, row);
    if place.time >= 0.0 {
        let clips = record.cycles.clamp(1, MAX_CLIPS);
        let offset = |i: usize| i * record.cycles / clips;
        let clip = |i: usize| record.first_cycle + offset(i);
        let pace = (0..clips).map(|i| 1.0 / database.cycle_duration(clip(i))).sum::<f32>() / clips as f32;
        let expected = clamp(place.time + pace, 0.0, 1.0);
        let repeats = range(nearest.iter().map(time)) >= REPEATS;
        let (mut chosen, mut least) = (place.cycle, f32::INFINITY);
        for i in 0..clips {
            let mut best = Vec::new();
            distances += measure(database, &record, clip(i), expected, metric, &mut best);
            if best.is_empty() {
                continue;
            }
            if repeats {
                // A class has fewer than 2^16 cycles, because it has fewer rows.
                let cycle = u16::try_from(offset(i)).unwrap_or(NO_CYCLE);
                let distance = mean(&best) * if cycle == place.cycle { 1.0 } else { KEEP };
                if distance >= least {
                    continue;
                }
                (least, chosen) = (distance, cycle);
                found.clear();
            }
            // By reference: dropping heapless's own iterator can panic.
            for &neighbor in &best {
                insert(found, MAX_CLIPS * MAX_OF_CLIP, neighbor, |other| {
                    other.distance2 <= neighbor.distance2
                });
            }
        }
        found.truncate(nearest.len());
        let far = database.trust_limits(class).map_or(0.0, |trust| trust.far);
        let most = limits.distance2 + limits.follow * far;
        if !found.is_empty() && mean(found) * metric.unit2() <= most {
            let seen = found.iter().map(|neighbor| time(&neighbor.row)).sum::<f32>() / found.len() as f32;
            *place = Place { time: clamp(expected + GAIN * (seen - expected), 0.0, 1.0), cycle: chosen };
            return distances;
        }
        found.clear();
    }
    place.time = nearest.first().map_or(UNKNOWN, time);
    distances
}

/// Difference of the greatest and the least of some canonical times.
fn range(times: impl Iterator<Item = f32>) -> f32 {
    let (least, most) =
        times.fold((1.0, 0.0), |(least, most), time| (minimum(least, time), maximum(most, time)));
    most - least
}

/// Canonical time of a row of the class in its clip, 0 to 1.
fn time_of(database: &Database<'_>, class: usize, record: &Class, row: u16) -> f32 {
    let row = record.first_row + usize::from(row);
    let time = database.cycle_of(class, row).map_or(0.0, |cycle| database.cycle_time(cycle, row));
    clamp(time, 0.0, 1.0)
}

/// Puts the frames of a clip that are nearest to the query, of those near the `expected` canonical time, into `best`, nearest
/// first. Returns the number of distances computed.
fn measure(
    database: &Database<'_>,
    class: &Class,
    cycle: usize,
    expected: f32,
    metric: &Metric,
    best: &mut Vec<Neighbor, MAX_OF_CLIP>,
) -> u32 {
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
        let neighbor = Neighbor { distance2, row, expanded: false, followed: false };
        insert(best, MAX_OF_CLIP, neighbor, |other| other.distance2 <= distance2);
    }
    distances
}
