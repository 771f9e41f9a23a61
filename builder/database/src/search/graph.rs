//! The search graph of a class: up to eight edges per frame, such that a greedy search finds the nearest frames. It is our
//! own, since the core searches it in flash and the frames before and after are implicit edges.
//!
//! Candidates are the exact nearest neighbors in both directions. An edge is kept if no edge kept before it, nor the frame
//! before or after in time, is closer to its end than the frame itself (the occlusion rule of HNSW and Vamana, with a
//! slack). So near frames represent their surroundings, and a few edges reach far.

use gestus_core::blob::layout::{DEGREE, ENTRIES, NONE};
use rayon::prelude::*;

/// Candidates for the edges of a frame.
const CANDIDATES: usize = 48;
/// Slack of the occlusion rule: larger keeps more edges to near frames and fewer far ones. On 28 classes of real
/// motion 0.7 costs 0.4% of recall, 1.4 gains 0.02% and takes 2% more visits.
const SLACK: f32 = 1.0;

/// Stored features of a class, and which of its frames a search may return.
#[derive(Debug, Clone, Copy)]
pub struct ClassFeatures<'a> {
    /// Codes, shape `[rows][features]`.
    pub codes: &'a [Vec<i8>],
    /// Squared metres per squared step, shape `[features]`.
    pub weights: &'a [f32],
    /// Shape `[rows]`.
    pub searchable: &'a [bool],
}

/// The graph of a class.
#[derive(Debug, Clone, PartialEq)]
pub struct ClassGraph {
    /// Edges of each row, padded with [`NONE`].
    pub edges: Vec<[u16; DEGREE]>,
    /// Entry points.
    pub entries: [u16; ENTRIES],
}

impl ClassGraph {
    /// A graph without edges.
    pub fn empty(rows: usize) -> Self {
        Self { edges: vec![[NONE; DEGREE]; rows], entries: [NONE; ENTRIES] }
    }
}

impl ClassFeatures<'_> {
    /// Squared distance of two rows.
    fn distance2(&self, a: usize, b: usize) -> f32 {
        let pairs = self.codes[a].iter().zip(&self.codes[b]).zip(self.weights);
        pairs.map(|((&a, &b), w)| w * f32::from(i16::from(a) - i16::from(b)).powi(2)).sum()
    }

    fn rows(&self) -> impl Iterator<Item = usize> + '_ {
        (0..self.codes.len()).filter(|&r| self.searchable[r])
    }
}

/// The `count` rows of a class nearest to a query (in metres, divided by the features' scales), by exhaustive search;
/// nearest first.
pub fn exact_knn(class: &ClassFeatures<'_>, query: &[f32], count: usize) -> Vec<(f32, usize)> {
    let mut all: Vec<(f32, usize)> = class
        .rows()
        .map(|r| {
            let terms = class.codes[r].iter().zip(query).zip(class.weights);
            (terms.map(|((&c, q), w)| w * (q - f32::from(c)).powi(2)).sum(), r)
        })
        .collect();
    nearest(&mut all, count);
    all
}

fn nearest(all: &mut Vec<(f32, usize)>, count: usize) {
    let order = |a: &(f32, usize), b: &(f32, usize)| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1));
    if all.len() > count {
        all.select_nth_unstable_by(count, order);
        all.truncate(count);
    }
    all.sort_unstable_by(order);
}

/// Builds the graph of a class. Cost: rows² x features, on all cores.
pub fn build_graph(class: &ClassFeatures<'_>) -> ClassGraph {
    let rows: Vec<usize> = class.rows().collect();
    let near: Vec<Vec<(f32, usize)>> = rows
        .par_iter()
        .map(|&a| {
            let mut all: Vec<(f32, usize)> =
                rows.iter().filter(|&&b| b != a).map(|&b| (class.distance2(a, b), b)).collect();
            nearest(&mut all, CANDIDATES);
            all
        })
        .collect();
    let mut candidates: Vec<Vec<(f32, usize)>> = vec![Vec::new(); class.codes.len()];
    for (&a, near) in rows.iter().zip(&near) {
        candidates[a].extend(near);
        for &(distance, b) in near.iter().take(CANDIDATES / 3) {
            candidates[b].push((distance, a));
        }
    }
    let mut edges: Vec<Vec<usize>> =
        candidates.into_par_iter().enumerate().map(|(a, candidates)| prune(class, a, candidates)).collect();
    let entries = entries(class, &rows);
    connect(class, &rows, &near, &entries, &mut edges);
    let mut table = vec![[NONE; DEGREE]; class.codes.len()];
    for (slots, edges) in table.iter_mut().zip(&edges) {
        for (slot, &edge) in slots.iter_mut().zip(edges) {
            *slot = edge as u16;
        }
    }
    let mut entry_points = [NONE; ENTRIES];
    for (slot, entry) in entry_points.iter_mut().zip(entries) {
        *slot = entry as u16;
    }
    ClassGraph { edges: table, entries: entry_points }
}

/// The frames before and after: implicit edges.
fn sides(class: &ClassFeatures<'_>, row: usize) -> impl Iterator<Item = usize> + use<> {
    let searchable = |r: usize| class.searchable.get(r).copied().unwrap_or(false);
    let before = row.checked_sub(1).filter(|&r| searchable(r));
    let after = Some(row + 1).filter(|&r| searchable(r));
    before.into_iter().chain(after)
}

fn prune(class: &ClassFeatures<'_>, row: usize, mut candidates: Vec<(f32, usize)>) -> Vec<usize> {
    candidates.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
    candidates.dedup();
    let sides: Vec<usize> = sides(class, row).collect();
    let mut kept: Vec<usize> = Vec::new();
    let mut spare = Vec::new();
    for (distance, candidate) in candidates {
        if sides.contains(&candidate) {
            continue;
        }
        let occluded = kept.iter().chain(&sides).any(|&k| SLACK * class.distance2(k, candidate) < distance);
        if occluded {
            spare.push(candidate)
        } else {
            kept.push(candidate)
        }
        if kept.len() == DEGREE {
            break;
        }
    }
    // A place that is left empty helps nobody.
    kept.extend(spare.into_iter().take(DEGREE - kept.len()));
    kept
}

/// Entry points: first the middle row of the class, then each time the row farthest from all before.
fn entries(class: &ClassFeatures<'_>, rows: &[usize]) -> Vec<usize> {
    let Some(&first) = rows.get(rows.len() / 2) else { return Vec::new() };
    let mut entries = vec![first];
    let mut distance: Vec<f32> = rows.iter().map(|&r| class.distance2(r, first)).collect();
    while entries.len() < ENTRIES.min(rows.len()) {
        let (at, &far) = distance.iter().enumerate().max_by(|a, b| a.1.total_cmp(b.1)).unwrap_or((0, &0.0));
        if far <= 0.0 {
            break;
        }
        entries.push(rows[at]);
        for (d, &r) in distance.iter_mut().zip(rows) {
            *d = d.min(class.distance2(r, rows[at]));
        }
    }
    entries
}

/// Makes every row reachable from the entry points: an unreachable component gets an edge, a bridge, from a near frame
/// that is reachable.
///
/// If that frame has no free edge, another edge is replaced, but never a bridge, so that the number of bridges increases
/// and the loop ends. Rows that a replaced edge disconnects are found and bridged in turn.
fn connect(
    class: &ClassFeatures<'_>,
    rows: &[usize],
    near: &[Vec<(f32, usize)>],
    entries: &[usize],
    edges: &mut [Vec<usize>],
) {
    let mut bridges: Vec<Vec<usize>> = vec![Vec::new(); edges.len()];
    let mut reached = vec![false; edges.len()];
    reach(class, edges, entries.to_vec(), &mut reached);
    while rows.iter().any(|&r| !reached[r]) {
        let free = |from: usize| reached[from] && bridges[from].len() < DEGREE;
        let Some((from, island)) = bridge(class, rows, near, &reached, free) else { return };
        let full = edges[from].len() == DEGREE;
        if full {
            let arrivals =
                |to: usize| edges.iter().flatten().filter(|&&e| e == to).count() + sides(class, to).count();
            // Far ones stand last and go first.
            let spare = (0..DEGREE).rev().filter(|&i| !bridges[from].contains(&edges[from][i]));
            let Some(at) = spare.max_by_key(|&i| arrivals(edges[from][i]).min(3)) else { return };
            edges[from].remove(at);
        }
        edges[from].push(island);
        bridges[from].push(island);
        if full {
            reached.fill(false);
            reach(class, edges, entries.to_vec(), &mut reached);
        } else {
            reach(class, edges, vec![island], &mut reached);
        }
    }
}

/// Marks all rows reachable from a row.
fn reach(class: &ClassFeatures<'_>, edges: &[Vec<usize>], mut stack: Vec<usize>, reached: &mut [bool]) {
    while let Some(row) = stack.pop() {
        if !std::mem::replace(&mut reached[row], true) {
            stack.extend(edges[row].iter().copied().chain(sides(class, row)).filter(|&r| !reached[r]));
        }
    }
}

/// The shortest edge from a usable reached row to an unreached one: among the known near pairs, or else to the first
/// unreached row.
fn bridge(
    class: &ClassFeatures<'_>,
    rows: &[usize],
    near: &[Vec<(f32, usize)>],
    reached: &[bool],
    free: impl Fn(usize) -> bool,
) -> Option<(usize, usize)> {
    let cut_off = rows.iter().zip(near).filter(|(row, _)| !reached[**row]);
    let pairs = cut_off.flat_map(|(&to, near)| near.iter().map(move |&(d, from)| (d, from, to)));
    let known = pairs.filter(|&(_, from, _)| free(from)).min_by(|a, b| a.0.total_cmp(&b.0));
    known.map(|(_, from, to)| (from, to)).or_else(|| {
        let to = rows.iter().copied().find(|&r| !reached[r])?;
        let distance = |&from: &usize| class.distance2(from, to);
        let from = rows
            .iter()
            .copied()
            .filter(|&from| free(from))
            .min_by(|a, b| distance(a).total_cmp(&distance(b)))?;
        Some((from, to))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    struct Motion {
        codes: Vec<Vec<i8>>,
        searchable: Vec<bool>,
    }

    const WEIGHTS: [f32; 16] = [1.0; 16];

    impl Motion {
        /// Clips of a cyclic motion, each with its own speed, size and posture; the ends of a clip are not
        /// searchable.
        fn new(clips: usize, frames: usize) -> Self {
            let mut motion = Self { codes: Vec::new(), searchable: Vec::new() };
            for clip in 0..clips {
                for t in 0..frames {
                    motion.codes.push(pose(clip as f32, t as f32).map(|v| v.round() as i8).to_vec());
                    motion.searchable.push(t > 2 && t + 3 < frames);
                }
            }
            motion
        }

        fn class(&self) -> ClassFeatures<'_> {
            ClassFeatures { codes: &self.codes, weights: &WEIGHTS, searchable: &self.searchable }
        }
    }

    /// A smooth path through 16 dimensions.
    fn pose(clip: f32, t: f32) -> [f32; 16] {
        let phase = t * (0.19 + 0.013 * (clip * 1.7).sin());
        std::array::from_fn(|f| {
            let size = 90.0 / (1.0 + f as f32 * 0.4) * (1.0 + 0.15 * (clip * 2.3 + f as f32).sin());
            let posture = 12.0 * (clip * (1.1 + f as f32 * 0.37)).sin();
            size * (phase * (1 + f / 4) as f32 + f as f32).sin() + posture
        })
    }

    fn edges_of(graph: &ClassGraph) -> Vec<Vec<usize>> {
        let stored =
            |slots: &[u16; DEGREE]| slots.iter().filter(|&&e| e != NONE).map(|&e| usize::from(e)).collect();
        graph.edges.iter().map(stored).collect()
    }

    fn reached(class: &ClassFeatures<'_>, entries: &[u16], edges: &[Vec<usize>]) -> Vec<bool> {
        let start = entries.iter().filter(|&&e| e != NONE).map(|&e| usize::from(e)).collect();
        let mut reached = vec![false; edges.len()];
        reach(class, edges, start, &mut reached);
        reached
    }

    /// Core's walk: successors and entry points first, then the nearest frame not yet expanded.
    fn search(
        class: &ClassFeatures<'_>,
        graph: &ClassGraph,
        query: &[f32],
        last: &[usize],
    ) -> (Vec<usize>, usize) {
        const POOL: usize = 48;
        let distance = |r: usize| -> f32 {
            class.codes[r].iter().zip(query).map(|(&c, q)| (q - f32::from(c)).powi(2)).sum()
        };
        let mut pool: Vec<(f32, usize, bool)> = Vec::new();
        let mut seen = vec![false; class.codes.len()];
        let mut visits = 0;
        let mut visit = |pool: &mut Vec<(f32, usize, bool)>, row: usize| {
            if !std::mem::replace(&mut seen[row], true) {
                visits += 1;
                pool.push((distance(row), row, false));
                pool.sort_by(|a, b| a.0.total_cmp(&b.0));
                pool.truncate(POOL);
            }
        };
        let next = |r: usize| {
            let follows = r + 1 < class.codes.len() && class.searchable[r + 1];
            if follows { r + 1 } else { r }
        };
        let entries = graph.entries.iter().filter(|&&e| e != NONE).map(|&e| usize::from(e));
        for row in last.iter().map(|&r| next(r)).chain(entries) {
            visit(&mut pool, row);
        }
        while let Some(at) = pool.iter().position(|n| !n.2) {
            pool[at].2 = true;
            let row = pool[at].1;
            for edge in graph.edges[row].iter().filter(|&&e| e != NONE) {
                visit(&mut pool, usize::from(*edge));
            }
            for side in sides(class, row) {
                visit(&mut pool, side);
            }
        }
        (pool.iter().take(40).map(|n| n.1).collect(), visits)
    }

    #[test]
    fn every_searchable_row_is_reached_and_no_other() {
        let motion = Motion::new(12, 90);
        let class = motion.class();
        let graph = build_graph(&class);
        let reached = reached(&class, &graph.entries, &edges_of(&graph));
        assert_eq!(reached, motion.searchable);
    }

    #[test]
    fn edges_lead_to_searchable_rows_once_and_not_to_themselves() {
        let motion = Motion::new(12, 90);
        let graph = build_graph(&motion.class());
        for (row, edges) in edges_of(&graph).iter().enumerate() {
            assert!(edges.iter().all(|&e| motion.searchable[e] && e != row), "row {row}: {edges:?}");
            let mut unique = edges.clone();
            unique.sort_unstable();
            unique.dedup();
            assert_eq!(unique.len(), edges.len(), "row {row}: {edges:?}");
            assert!(motion.searchable[row] || edges.is_empty(), "row {row} is never found");
        }
    }

    /// Full rows had lost the only edge to another row to make place for a bridge.
    #[test]
    fn a_bridge_cuts_nothing_off() {
        // Rows two apart, so that none has sides: row 0 is the entry and has every edge of the graph.
        let count = 3 * DEGREE;
        let codes: Vec<Vec<i8>> = (0..2 * count).map(|r| vec![(r / 2) as i8; 16]).collect();
        let searchable: Vec<bool> = (0..2 * count).map(|r| r % 2 == 0).collect();
        let class = ClassFeatures { codes: &codes, weights: &WEIGHTS, searchable: &searchable };
        let rows: Vec<usize> = class.rows().collect();
        let mut edges = vec![Vec::new(); 2 * count];
        edges[0] = rows[1..=DEGREE].to_vec();
        let near = vec![Vec::new(); rows.len()];
        connect(&class, &rows, &near, &[0], &mut edges);
        let mut found = vec![false; 2 * count];
        reach(&class, &edges, vec![0], &mut found);
        assert_eq!(found, searchable);
        assert!(edges.iter().all(|e| e.len() <= DEGREE));
    }

    /// Every row an island, and one entry whose places are all taken.
    #[test]
    fn islands_of_equal_rows_are_reached() {
        let codes = vec![vec![7i8; 16]; 400];
        let searchable: Vec<bool> = (0..400).map(|r| r % 2 == 0).collect();
        let class = ClassFeatures { codes: &codes, weights: &WEIGHTS, searchable: &searchable };
        let graph = build_graph(&class);
        assert_eq!(reached(&class, &graph.entries, &edges_of(&graph)), searchable);
    }

    #[test]
    fn small_classes_have_small_graphs() {
        for count in 0..4 {
            let codes = vec![vec![1i8; 16]; count];
            let searchable = vec![true; count];
            let class = ClassFeatures { codes: &codes, weights: &WEIGHTS, searchable: &searchable };
            let graph = build_graph(&class);
            assert_eq!(graph.edges.len(), count);
            assert_eq!(graph.entries.iter().any(|&e| e != NONE), count > 0);
        }
    }

    #[test]
    fn a_stream_finds_its_neighbors() {
        let motion = Motion::new(20, 120);
        let class = motion.class();
        let graph = build_graph(&class);
        let (mut hits, mut wanted, mut visits, mut last) = (0, 0, 0, Vec::new());
        for t in 0..150 {
            // Between the clips of the database, at another speed.
            let query = pose(6.5, 1.13 * t as f32);
            let (found, seen) = search(&class, &graph, &query, &last);
            let truth = exact_knn(&class, &query, 40);
            let radius = truth.last().map_or(0.0, |n| n.0) * 1.000_01;
            let distance = |r: usize| -> f32 {
                class.codes[r].iter().zip(&query).map(|(&c, q)| (q - f32::from(c)).powi(2)).sum()
            };
            // The first frame has nothing to go on from.
            if t > 0 {
                hits += found.iter().filter(|&&r| distance(r) <= radius).count();
                wanted += truth.len();
                visits += seen;
            }
            last = found;
        }
        let recall = hits as f64 / wanted as f64;
        let visits = visits as f64 / 149.0;
        assert!(recall > 0.985, "recall {recall} in {visits} visits");
        assert!(visits < 260.0, "recall {recall} in {visits} visits");
    }
}
