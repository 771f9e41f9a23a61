//! The search graph of a class: up to eight edges a frame, so that a greedy walk finds the frames like it.
//!
//! Candidates are the exact nearest neighbors (and who has a frame among theirs). An edge is kept where no edge
//! kept before it, nor the frame before or after in time, lies closer to its end than the frame itself does (the
//! occlusion rule of HNSW's and Vamana's graphs, with a slack): near ones stand for their surroundings, and a few
//! reach far.

use gestus_core::blob::layout::{DEGREE, ENTRIES, NONE};
use rayon::prelude::*;

/// Candidates an edge is chosen from.
const CANDIDATES: usize = 48;
/// Slack of the occlusion rule: larger keeps fewer edges.
const SLACK: f32 = 1.0;

/// Stored features of a class and which of its frames a search may return.
#[derive(Debug, Clone, Copy)]
pub struct ClassFeatures<'a> {
    /// Codes, shape `[rows][features]`.
    pub codes: &'a [Vec<i8>],
    /// Squared metres for a squared step, shape `[features]`.
    pub weights: &'a [f32],
    /// Shape `[rows]`.
    pub searchable: &'a [bool],
    /// Whether the row before is the frame before, shape `[rows]`.
    pub follows: &'a [bool],
}

/// The graph of a class.
#[derive(Debug, Clone, PartialEq)]
pub struct ClassGraph {
    /// Edges of each row, [`NONE`] where there are fewer.
    pub edges: Vec<[u16; DEGREE]>,
    /// Entry points.
    pub entries: [u16; ENTRIES],
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

/// The `count` rows of a class nearest to a query (metres, divided by the features' scales), by looking at all;
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

/// Builds the graph of a class. Cost: the square of its rows times the features, on all cores.
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
    connect(class, &rows, &entries, &mut edges);
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

/// The frames before and after: edges that are not stored.
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

/// Entry points, each as far as possible from those before it: the first is the middle of the class.
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

/// Makes every row reachable from the entry points: an island gets an edge from its nearest frame outside.
fn connect(class: &ClassFeatures<'_>, rows: &[usize], entries: &[usize], edges: &mut [Vec<usize>]) {
    let mut reached = vec![false; class.codes.len()];
    let mut stack = entries.to_vec();
    loop {
        while let Some(row) = stack.pop() {
            if !std::mem::replace(&mut reached[row], true) {
                stack.extend(edges[row].iter().copied().chain(sides(class, row)).filter(|&r| !reached[r]));
            }
        }
        let Some(&island) = rows.iter().find(|&&r| !reached[r]) else { return };
        let outside = rows.iter().copied().filter(|&r| reached[r]);
        let Some(bridge) =
            outside.min_by(|&a, &b| class.distance2(a, island).total_cmp(&class.distance2(b, island)))
        else {
            return;
        };
        if edges[bridge].len() == DEGREE {
            edges[bridge].pop();
        }
        edges[bridge].push(island);
        stack.push(island);
    }
}
