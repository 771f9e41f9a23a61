//! The nearest frames of a class, by graph search.
//!
//! Every captured frame has up to eight explicit edges to frames like it; the frames before and after are edges
//! too. The search keeps a sorted pool of the best frames seen and expands the nearest one not yet expanded until
//! none is left, or the visits are used up (Malkov and Yashunin 2018, their layer search, without layers).
//!
//! Motion goes on: the successors of the last frame's neighbors are most of this frame's neighbors (82% on real
//! clips), so the pool starts with them and a few fixed entry points. Where they turn out far away (the input
//! has jumped), or few of them are left in the pool (the stream has come from elsewhere), the search goes on from
//! frames spread evenly over the class.
//!
//! Cost: at most `visits` distances a class, and after a jump as many again, as far as the frame has them to spare
//! ([`Limits::spare`]); a distance reads one byte a component.

use heapless::Vec;

use crate::{
    blob::{
        Class, Database,
        layout::{NONE, flag},
    },
    search::{
        found::{Found, Neighbor, SearchStats, mean},
        metric::{Frames, Metric},
        top_k::insert,
        visited::{PATIENCE, SLOTS, Visited},
    },
};

/// Most frames in the pool.
pub const POOL: usize = 64;
/// Most visits of one search: the visited set has to stay sparse enough to probe.
pub const MAX_VISITS: u16 = 448;
const _: () = assert!((MAX_VISITS as usize) < SLOTS);
/// Frames that a search without neighbors to go on from starts with.
const SPREAD: usize = 48;
/// Most frames that neighbors are followed through. A class that was not searched for longer is searched anew.
pub const MOST_FOLLOWED: usize = 32;
/// How many of the nearest frames a search that begins anew expands, and at least `k`.
const FRESH: usize = 12;
/// A stream is lost where fewer than one in so many of the last neighbors' successors are among the best frames seen.
const LOST: usize = 2;

/// What limits a search.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Limits {
    /// Neighbors wanted.
    pub k: usize,
    /// Size of the pool, `k` to [`POOL`]: larger finds more and visits more.
    pub pool: usize,
    /// Most distances, up to [`MAX_VISITS`].
    pub visits: u16,
    /// How many more a search may take that is begun anew: what the classes before have left of theirs.
    pub spare: u16,
    /// A mean squared distance this many times the last one is a jump.
    pub jump: f32,
    /// Mean squared distance beyond which a class can't matter: a stream that goes on there is followed less thoroughly.
    pub enough: f32,
}

/// Room for one search; used for one class after another.
#[derive(Debug, Clone)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Searcher {
    pool: Vec<Neighbor, POOL>,
    visited: Visited,
}

impl Searcher {
    /// Room for a search.
    #[inline(never)]
    pub const fn new() -> Self {
        // A search begins with clearing both.
        Self { pool: Vec::new(), visited: Visited::new() }
    }

    /// Finds the nearest frames of a class, nearest first.
    ///
    /// `last` holds the rows found when the class was searched last (empty at the start), `last_mean` their mean squared
    /// distance, and `frames` how many frames ago that was. Small classes are searched whole.
    pub fn search(
        &mut self,
        database: &Database<'_>,
        class: usize,
        metric: &Metric,
        limits: &Limits,
        last: &[u16],
        (last_mean, frames): (f32, usize),
    ) -> Found<'_> {
        let record = database.class(class);
        let k = limits.k.min(record.k_cap);
        let mut walk = Walk {
            database,
            class: record,
            metric,
            frames: metric.frames(database, &record),
            limits: Limits { pool: limits.pool.max(k).min(POOL), ..*limits },
            pool: &mut self.pool,
            visited: &mut self.visited,
            patience: 0,
            stats: SearchStats::default(),
            left: 0,
            next: 0,
            following: false,
        };
        if record.rows <= usize::from(limits.visits) {
            walk.start();
            walk.left = u16::MAX;
            walk.pool_whole();
        } else {
            let mut fresh = last.is_empty() || last_mean < 0.0 || frames > MOST_FOLLOWED;
            if !fresh {
                walk.start();
                walk.following = true;
                walk.seed_successors(last, frames);
                walk.following = false;
                walk.run(k);
                let mut mean = walk.mean(k);
                if mean <= limits.enough {
                    walk.seed_all(database.entries(class));
                    walk.run(POOL);
                    mean = walk.mean(k);
                }
                walk.stats.jumped = mean > limits.jump * last_mean;
                fresh = walk.stats.jumped || walk.is_lost(last.len());
                walk.stats.restarted = fresh;
            }
            if fresh {
                walk.start_again();
                walk.seed_all(database.entries(class));
                walk.seed_spread();
                // Enough to know how far the class is; the frames that follow find neighbors that are missed. The graph is that
                // of whole features: where a mask leaves some out, it leads to the neighbors less directly.
                walk.run(if metric.is_whole() { k.max(FRESH) } else { POOL });
            }
        }
        let mut stats = walk.stats;
        stats.bytes += stats.visits * metric.bytes() as u32;
        Found::new(first(&self.pool, k), metric.unit2(), stats)
    }
}

impl Default for Searcher {
    fn default() -> Self {
        Self::new()
    }
}

fn first(pool: &[Neighbor], k: usize) -> &[Neighbor] {
    pool.get(..k).unwrap_or(pool)
}

struct Walk<'a, 'db> {
    database: &'a Database<'db>,
    class: Class,
    metric: &'a Metric,
    /// The class's frames, where they can be compared the fast way.
    frames: Option<Frames<'db>>,
    limits: Limits,
    pool: &'a mut Vec<Neighbor, POOL>,
    visited: &'a mut Visited,
    /// How often rows may still collide in the visited set.
    patience: u16,
    stats: SearchStats,
    left: u16,
    /// Place in the pool before which every frame is expanded.
    next: usize,
    /// What is visited now is where the neighbors of the last frame went.
    following: bool,
}

impl Walk<'_, '_> {
    fn start(&mut self) {
        self.pool.clear();
        self.next = 0;
        self.visited.clear();
        self.patience = PATIENCE;
        self.left = self.limits.visits.min(MAX_VISITS);
    }

    /// Leave for as many visits again, or as many as there are to spare. What was seen stays, as long as the visited set
    /// has room, and where too few visits are left to find anything else.
    fn start_again(&mut self) {
        let seen = u16::try_from(self.stats.visits).unwrap_or(u16::MAX);
        let room = MAX_VISITS.saturating_sub(seen);
        let left = self.limits.visits.saturating_add(self.limits.spare).saturating_sub(seen);
        if seen == 0 || (room < MAX_VISITS / 2 && usize::from(left) >= SPREAD) {
            self.start();
        } else {
            self.left = self.limits.visits.min(room);
        }
        self.left = self.left.min(left);
    }

    fn pool_whole(&mut self) {
        for row in 0..self.class.rows {
            if self.can_be_found(row) {
                self.measure(row as u16);
            }
        }
    }

    /// Where the last neighbors went in the frames since.
    fn seed_successors(&mut self, last: &[u16], frames: usize) {
        for &row in last {
            let row = usize::from(row);
            let end = (1..=frames).take_while(|i| self.flags(row + i) & flag::FOLLOWS != 0).last();
            let now = end.map_or(row, |frames| row + frames);
            self.visit(if self.can_be_found(now) { now } else { row } as u16);
        }
    }

    fn seed_all(&mut self, rows: impl Iterator<Item = u16>) {
        for row in rows {
            self.visit(row);
        }
    }

    fn seed_spread(&mut self) {
        for i in 0..SPREAD {
            let row = self.class.rows * i / SPREAD;
            if self.can_be_found(row) {
                self.visit(row as u16);
            }
        }
    }

    /// Few of the last frame's neighbors have a successor in sight: the stream has come from elsewhere.
    fn is_lost(&self, seeds: usize) -> bool {
        self.pool.iter().filter(|n| n.followed).count() * LOST < seeds
    }

    /// Mean squared distance of the `k` nearest seen.
    fn mean(&self, k: usize) -> f32 {
        mean(first(self.pool, k)) * self.metric.unit2()
    }

    /// Expands frames until all of the nearest `most` seen are.
    fn run(&mut self, most: usize) {
        while let Some(nearest) = self.pool.get_mut(self.next).filter(|_| self.next < most) {
            self.next += 1;
            if nearest.expanded {
                continue;
            }
            nearest.expanded = true;
            let row = usize::from(nearest.row);
            self.stats.bytes += 16;
            for edge in self.database.edges(self.class.first_row + row) {
                if edge != NONE {
                    self.visit(edge);
                }
            }
            for side in [row.wrapping_sub(1), row + 1] {
                if self.can_be_found(side) {
                    self.visit(side as u16);
                }
            }
            if self.left == 0 {
                self.stats.capped = true;
                return;
            }
        }
    }

    /// Flags of a row of the class; 0 beyond it.
    fn flags(&self, row: usize) -> u8 {
        if row < self.class.rows { self.database.flags(self.class.first_row + row) } else { 0 }
    }

    fn can_be_found(&self, row: usize) -> bool {
        self.flags(row) & flag::SEARCHABLE != 0
    }

    /// Measures a row unless it was measured before or the visits are used up. Rows that collide too often use them up.
    fn visit(&mut self, row: u16) {
        if self.left == 0 {
            return;
        }
        if !self.visited.insert(row, &mut self.patience) {
            if self.patience == 0 {
                self.left = 0;
            }
            return;
        }
        self.left -= 1;
        self.measure(row);
    }

    #[inline(never)]
    fn measure(&mut self, row: u16) {
        self.stats.visits += 1;
        let found =
            self.frames.as_ref().and_then(|frames| self.metric.distance2_in(frames, usize::from(row)));
        let distance2 = found
            .unwrap_or_else(|| self.metric.distance2(self.database, self.class.first_row + usize::from(row)));
        let found = Neighbor { distance2, row, expanded: false, followed: self.following };
        let at = insert(self.pool, self.limits.pool, found, |other| other.distance2 <= distance2);
        self.next = self.next.min(at);
    }
}
