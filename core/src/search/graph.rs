//! The nearest frames of a class, by graph search.
//!
//! Every captured frame has up to eight explicit edges to similar frames. The frames before and after it are edges too. The
//! search keeps a sorted pool of the nearest frames seen. It expands the nearest unexpanded frame until none is left or the
//! visits are used up (the layer search of Malkov and Yashunin 2018, without layers).
//!
//! Motion is continuous: most of a frame's neighbors are successors of the last frame's neighbors (82% on real clips). The
//! pool therefore starts with these successors and a few fixed entry points. The search restarts from frames spread evenly
//! over the class where the successors are far away (the input has jumped), or where few of them stay in the pool (the
//! stream has come from elsewhere).
//!
//! A blob may leave the graph out. Then the edges are those along time alone, and rows spread over the class take the
//! place of the entry points. Fewer of the nearest frames are found, and the output is as near to the truth.
//!
//! Cost: at most `visits` distances a class. A restart takes up to as many again, if the frame has them to spare
//! ([`Limits::spare`]). A distance reads one byte a component.

use heapless::Vec;

use crate::{
    blob::{
        Class, Database,
        layout::{DEGREE, NONE, flag},
    },
    search::{
        found::{Found, Neighbor, SearchStats, mean},
        metric::{Frames, Metric},
        top_k::insert,
        visited::{PATIENCE, SLOTS, Visited},
    },
};

/// Capacity of the pool.
pub const POOL: usize = 64;
/// Greatest number of visits of one search. The visited set has to stay sparse enough to probe.
pub const MAX_VISITS: u16 = 448;
const _: () = assert!((MAX_VISITS as usize) < SLOTS);
/// Bytes of a frame's edges.
pub(crate) const EDGE_BYTES: u32 = 2 * DEGREE as u32;
/// Number of frames, spread over the class, from which a restarted search begins.
const SPREAD_SEEDS: usize = 48;
/// Without a graph, one visit in `OVERVIEW` is to a row from all over the class, to find neighbors that do not follow the
/// last ones.
const OVERVIEW: usize = 4;
/// Greatest number of frames over which neighbors are followed. The search of a class restarts after a longer pause.
pub const MAX_FOLLOWED: usize = 32;
/// Number of nearest frames that a restarted search expands, if it exceeds `k`.
const RESTART_EXPANSIONS: usize = 12;
/// A search is lost if the pool holds fewer than one in `LOST_RATIO` of the last neighbors' successors.
const LOST_RATIO: usize = 2;

/// The limits of a search.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Limits {
    /// Number of neighbors to find.
    pub k: usize,
    /// Size of the pool, `k` to [`POOL`]. A larger pool finds more of the nearest frames, and visits more.
    pub pool: usize,
    /// Greatest number of distances, up to [`MAX_VISITS`].
    pub visits: u16,
    /// Additional visits for a restarted search: those that the classes before have not used.
    pub spare: u16,
    /// Ratio of the mean squared distance to the last one above which the input has jumped.
    pub jump: f32,
    /// Mean squared distance beyond which a class has no weight, weighted square metres. Such a class is searched less
    /// thoroughly.
    pub cutoff_distance2: f32,
}

/// What was found when a class was searched last.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Last<'a> {
    /// The rows; empty at the start.
    pub rows: &'a [u16],
    /// Their mean squared distance in weighted square metres; `None` where the class has not been searched.
    pub mean_distance2: Option<f32>,
    /// Number of frames since then.
    pub frames: usize,
}

/// Memory for one search, used for one class after another.
#[derive(Debug, Clone)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Searcher {
    pool: Vec<Neighbor, POOL>,
    visited: Visited,
}

impl Searcher {
    /// Memory for a search.
    #[inline(never)]
    pub const fn new() -> Self {
        // A search clears both first.
        Self { pool: Vec::new(), visited: Visited::new() }
    }

    /// Finds the nearest frames of a class, nearest first. Classes of at most `limits.visits` rows are scanned.
    pub fn search(
        &mut self,
        database: &Database<'_>,
        class: usize,
        metric: &Metric,
        limits: &Limits,
        last: Last<'_>,
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
            visits_left: 0,
            next_unexpanded: 0,
            is_following: false,
        };
        if record.rows <= usize::from(limits.visits) {
            walk.start();
            walk.scan_class();
        } else {
            let followed =
                last.mean_distance2.filter(|_| !last.rows.is_empty() && last.frames <= MAX_FOLLOWED);
            let mut restarts = followed.is_none();
            if let Some(last_mean) = followed {
                walk.start();
                walk.is_following = true;
                walk.seed_successors(last.rows, last.frames);
                walk.is_following = false;
                walk.run(k);
                let mut mean = walk.mean(k);
                if mean <= limits.cutoff_distance2 {
                    walk.seed_overview(class);
                    walk.run(POOL);
                    mean = walk.mean(k);
                }
                walk.stats.jumped = mean > limits.jump * last_mean;
                restarts = walk.stats.jumped || walk.is_lost(last.rows.len());
                walk.stats.restarted = restarts;
            }
            if restarts {
                walk.restart();
                walk.seed_all(database.entries(class));
                walk.seed_spread(SPREAD_SEEDS);
                // Enough to measure the distance of the class; later frames find the neighbors missed here. The graph
                // was made for whole features, and leads to the neighbors less directly under a mask.
                walk.run(if metric.is_whole() { k.max(RESTART_EXPANSIONS) } else { POOL });
            }
        }
        let mut stats = walk.stats;
        stats.bytes += stats.visits * metric.bytes() as u32;
        Found::new(nearest(&self.pool, k), metric.unit2(), stats)
    }
}

impl Default for Searcher {
    fn default() -> Self {
        Self::new()
    }
}

/// The `k` nearest of the pool, or all of them.
fn nearest(pool: &[Neighbor], k: usize) -> &[Neighbor] {
    pool.get(..k).unwrap_or(pool)
}

/// The state of one search.
struct Walk<'a, 'db> {
    database: &'a Database<'db>,
    class: Class,
    metric: &'a Metric,
    /// The class's frames in the layout for fast comparison, if there is one.
    frames: Option<Frames<'db>>,
    limits: Limits,
    pool: &'a mut Vec<Neighbor, POOL>,
    visited: &'a mut Visited,
    /// Number of collisions in the visited set that are still allowed.
    patience: u16,
    stats: SearchStats,
    /// Distances that may still be computed.
    visits_left: u16,
    /// Index in the pool before which every frame is expanded.
    next_unexpanded: usize,
    /// True while the successors of the last neighbors are visited.
    is_following: bool,
}

impl Walk<'_, '_> {
    /// Begins with an empty pool.
    fn start(&mut self) {
        self.pool.clear();
        self.next_unexpanded = 0;
        self.visited.clear();
        self.patience = PATIENCE;
        self.visits_left = self.limits.visits.min(MAX_VISITS);
    }

    /// Allows as many visits again, or as many as are left to spare. Keeps the pool as long as the visited set has
    /// capacity, and where too few visits are left to refill it.
    fn restart(&mut self) {
        let seen = u16::try_from(self.stats.visits).unwrap_or(u16::MAX);
        let capacity = MAX_VISITS.saturating_sub(seen);
        let visits_left = self.limits.visits.saturating_add(self.limits.spare).saturating_sub(seen);
        if seen == 0 || (capacity < MAX_VISITS / 2 && usize::from(visits_left) >= SPREAD_SEEDS) {
            self.start();
        } else {
            self.visits_left = self.limits.visits.min(capacity);
        }
        self.visits_left = self.visits_left.min(visits_left);
    }

    /// Measures every searchable row of the class.
    fn scan_class(&mut self) {
        for row in 0..self.class.rows {
            if self.is_searchable(row) {
                self.measure(row as u16);
            }
        }
    }

    /// Visits the rows that follow the last neighbors after `frames` frames.
    fn seed_successors(&mut self, last: &[u16], frames: usize) {
        for &row in last {
            let row = usize::from(row);
            let end = (1..=frames).take_while(|i| self.flags(row + i) & flag::FOLLOWS != 0).last();
            let now = end.map_or(row, |frames| row + frames);
            self.visit(if self.is_searchable(now) { now } else { row } as u16);
        }
    }

    /// Visits the given rows.
    fn seed_all(&mut self, rows: impl Iterator<Item = u16>) {
        for row in rows {
            self.visit(row);
        }
    }

    /// Visits rows from all over the class: the entry points of the graph, or more rows where there is none.
    fn seed_overview(&mut self, class: usize) {
        if self.database.has_graph() {
            return self.seed_all(self.database.entries(class));
        }
        // A row may be some frames from the nearest of its cycle, and so behind rows of worse cycles. A large pool holds it
        // all the same.
        self.limits.pool = POOL;
        self.seed_spread(usize::from(self.limits.visits) / OVERVIEW);
    }

    /// Visits `seeds` rows spread evenly over the class.
    fn seed_spread(&mut self, seeds: usize) {
        for i in 0..seeds {
            let row = self.class.rows * i / seeds;
            if self.is_searchable(row) {
                self.visit(row as u16);
            }
        }
    }

    /// True if few of the `seeds` successors of the last neighbors are in the pool: the stream has come from elsewhere.
    fn is_lost(&self, seeds: usize) -> bool {
        self.pool.iter().filter(|n| n.followed).count() * LOST_RATIO < seeds
    }

    /// Mean squared distance of the `k` nearest frames seen, weighted square metres.
    fn mean(&self, k: usize) -> f32 {
        mean(nearest(self.pool, k)) * self.metric.unit2()
    }

    /// Expands frames until the nearest `most` of the pool are all expanded.
    fn run(&mut self, most: usize) {
        while let Some(frame) =
            self.pool.get_mut(self.next_unexpanded).filter(|_| self.next_unexpanded < most)
        {
            self.next_unexpanded += 1;
            if frame.expanded {
                continue;
            }
            frame.expanded = true;
            let row = usize::from(frame.row);
            if self.database.has_graph() {
                self.stats.bytes += EDGE_BYTES;
                for edge in self.database.edges(self.class.first_row + row) {
                    if edge != NONE {
                        self.visit(edge);
                    }
                }
            }
            for side in [row.wrapping_sub(1), row + 1] {
                if self.is_searchable(side) {
                    self.visit(side as u16);
                }
            }
            if self.visits_left == 0 {
                self.stats.capped = true;
                return;
            }
        }
    }

    /// Flags of a row of the class; 0 beyond it.
    fn flags(&self, row: usize) -> u8 {
        if row < self.class.rows { self.database.flags(self.class.first_row + row) } else { 0 }
    }

    /// True if the search may return a row of the class.
    fn is_searchable(&self, row: usize) -> bool {
        self.flags(row) & flag::SEARCHABLE != 0
    }

    /// Measures a row unless it was measured before or no visits are left. Too many collisions end the search.
    fn visit(&mut self, row: u16) {
        if self.visits_left == 0 {
            return;
        }
        if !self.visited.insert(row, &mut self.patience) {
            if self.patience == 0 {
                self.visits_left = 0;
            }
            return;
        }
        self.visits_left -= 1;
        self.measure(row);
    }

    /// Computes the distance of a row and inserts it in the pool.
    #[inline(never)]
    fn measure(&mut self, row: u16) {
        self.stats.visits += 1;
        let found =
            self.frames.as_ref().and_then(|frames| self.metric.distance2_in(frames, usize::from(row)));
        let distance2 = found
            .unwrap_or_else(|| self.metric.distance2(self.database, self.class.first_row + usize::from(row)));
        let found = Neighbor { distance2, row, expanded: false, followed: self.is_following };
        let at = insert(self.pool, self.limits.pool, found, |other| other.distance2 <= distance2);
        self.next_unexpanded = self.next_unexpanded.min(at);
    }
}
