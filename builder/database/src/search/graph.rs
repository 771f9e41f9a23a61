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
    /// Edges of each row, padded with [`NONE`]; empty if the graph is left out.
    pub edges: Vec<[u16; DEGREE]>,
    /// Entry points.
    pub entries: [u16; ENTRIES],
}

impl ClassGraph {
    /// No graph: no row has edges, not even [`NONE`].
    pub const fn left_out() -> Self {
        Self { edges: Vec::new(), entries: [NONE; ENTRIES] }
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
mod tests;
