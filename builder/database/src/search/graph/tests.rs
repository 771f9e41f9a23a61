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
