//! Every library behind one trait. All are asked one query at a time on one thread, and all compare the same
//! features; graphs of peers are built with the settings that their documentation recommends.

use std::num::NonZeroUsize;

use anyhow::{Result, anyhow};
use gestus_core::{
    Database,
    search::{
        graph::{Last, Limits, Searcher},
        metric::Metric,
        query::Feature,
    },
};
use hnsw_rs::prelude::{Distance, Hnsw};
use instant_distance::{Builder, HnswMap, Point, Search};
use kiddo::{ImmutableKdTree, SquaredEuclidean};

use crate::setup::{Points, squared};

/// Frames kept in sight while a graph of a peer is built.
const EF_CONSTRUCTION: usize = 128;
/// Edges of a peer's graph (hnswlib's and usearch's default).
const CONNECTIVITY: usize = 16;

/// A nearest neighbor search over the classes of a database.
pub trait Method {
    /// Its name in the table.
    fn name(&self) -> &'static str;
    /// How hard it searches; `false` where there is nothing to tune.
    fn tune(&mut self, ef: usize) -> Result<bool>;
    /// A new stream begins.
    fn reset(&mut self) {}
    /// A new query, before every class is searched for it.
    fn begin(&mut self, _query: &Feature) {}
    /// The rows of a class nearest to a query.
    fn search(&mut self, class: usize, query: &Feature, found: &mut Vec<u16>);
    /// Distances computed since the last call, where the library tells.
    fn visits(&mut self) -> Option<u64> {
        None
    }
}

/// Core's graph search, warm from frame to frame or from scratch for every query.
pub struct Core<'db> {
    is_cold: bool,
    database: Database<'db>,
    limits: Limits,
    searcher: Searcher,
    metric: Metric,
    last: Vec<(Vec<u16>, f32)>,
    visits: u64,
}

impl<'db> Core<'db> {
    /// The search with given limits, which starts from the neighbors of the frame before.
    pub fn new(database: Database<'db>, limits: Limits) -> Self {
        let metric = Metric::new(&database, &mut [0.0; _], u8::MAX);
        let last = vec![(Vec::new(), 0.0); database.counts().classes];
        Self { is_cold: false, database, limits, searcher: Searcher::new(), metric, last, visits: 0 }
    }

    /// The same search without the frame before, as peers have it.
    pub fn cold(database: Database<'db>, limits: Limits) -> Self {
        Self { is_cold: true, ..Self::new(database, limits) }
    }
}

impl Method for Core<'_> {
    fn name(&self) -> &'static str {
        if self.is_cold { "core, cold" } else { "core" }
    }
    fn tune(&mut self, _ef: usize) -> Result<bool> {
        Ok(false)
    }
    fn reset(&mut self) {
        self.last.iter_mut().for_each(|(rows, _)| rows.clear());
    }
    fn begin(&mut self, query: &Feature) {
        self.metric = Metric::new(&self.database, &mut query.clone(), u8::MAX);
    }
    fn search(&mut self, class: usize, _query: &Feature, found: &mut Vec<u16>) {
        let (rows, mean) = &mut self.last[class];
        if self.is_cold {
            rows.clear();
        }
        let last = Last { rows, mean_distance2: Some(*mean), frames: 1 };
        let near = self.searcher.search(&self.database, class, &self.metric, &self.limits, last);
        rows.clear();
        rows.extend(near.rows());
        *mean = near.mean_distance2;
        self.visits += u64::from(near.stats.visits);
        found.clone_from(rows);
    }
    fn visits(&mut self) -> Option<u64> {
        Some(std::mem::take(&mut self.visits))
    }
}

/// Every point looked at, in plain vectorised Rust.
pub struct BruteForce<'a> {
    classes: &'a [Points],
    all: Vec<(f32, u16)>,
}

impl<'a> BruteForce<'a> {
    /// The scan.
    pub fn new(classes: &'a [Points]) -> Self {
        Self { classes, all: Vec::new() }
    }
}

impl Method for BruteForce<'_> {
    fn name(&self) -> &'static str {
        "brute-force"
    }
    fn tune(&mut self, _ef: usize) -> Result<bool> {
        Ok(false)
    }
    fn search(&mut self, class: usize, query: &Feature, found: &mut Vec<u16>) {
        let class = &self.classes[class];
        self.all.clear();
        self.all.extend(class.points.iter().zip(&class.rows).map(|(p, &row)| (squared(p, query), row)));
        if self.all.len() > class.k && class.k > 0 {
            self.all.select_nth_unstable_by(class.k - 1, |a, b| a.0.total_cmp(&b.0));
        }
        self.all.truncate(class.k);
        self.all.sort_unstable_by(|a, b| a.0.total_cmp(&b.0));
        found.clear();
        found.extend(self.all.iter().map(|n| n.1));
    }
}

/// usearch: HNSW in C++, with vector instructions chosen at run time.
pub struct Usearch<'a> {
    classes: &'a [Points],
    indexes: Vec<usearch::Index>,
}

impl<'a> Usearch<'a> {
    /// Builds the graphs.
    ///
    /// # Errors
    /// The library's.
    pub fn new(classes: &'a [Points]) -> Result<Self> {
        let mut indexes = Vec::new();
        for class in classes {
            let options = usearch::IndexOptions {
                dimensions: class.points.first().map_or(1, |p| p.len()),
                metric: usearch::MetricKind::L2sq,
                quantization: usearch::ScalarKind::F32,
                connectivity: CONNECTIVITY,
                expansion_add: EF_CONSTRUCTION,
                ..Default::default()
            };
            let index = usearch::Index::new(&options).map_err(|e| anyhow!("usearch: {e}"))?;
            index.reserve(class.points.len()).map_err(|e| anyhow!("usearch: {e}"))?;
            for (point, &row) in class.points.iter().zip(&class.rows) {
                index.add(u64::from(row), point).map_err(|e| anyhow!("usearch: {e}"))?;
            }
            indexes.push(index);
        }
        Ok(Self { classes, indexes })
    }
}

impl Method for Usearch<'_> {
    fn name(&self) -> &'static str {
        "usearch"
    }
    fn tune(&mut self, ef: usize) -> Result<bool> {
        self.indexes.iter().for_each(|index| index.change_expansion_search(ef));
        Ok(true)
    }
    fn search(&mut self, class: usize, query: &Feature, found: &mut Vec<u16>) {
        found.clear();
        // An error here is a point without a dimension: nothing is found.
        if let Ok(matches) = self.indexes[class].search(query, self.classes[class].k) {
            found.extend(matches.keys.iter().map(|&key| key as u16));
        }
    }
}

/// Squared Euclidean distance for libraries that take one.
#[derive(Debug, Clone, Copy)]
pub struct Squared;

impl Distance<f32> for Squared {
    fn eval(&self, a: &[f32], b: &[f32]) -> f32 {
        squared(a, b)
    }
}

/// hnsw_rs: HNSW in Rust.
pub struct HnswRs<'a> {
    classes: &'a [Points],
    indexes: Vec<Hnsw<'a, f32, Squared>>,
    ef: usize,
}

impl<'a> HnswRs<'a> {
    /// Builds the graphs.
    pub fn new(classes: &'a [Points]) -> Self {
        let indexes = classes
            .iter()
            .map(|class| {
                let mut index =
                    Hnsw::new(CONNECTIVITY, class.points.len().max(1), 16, EF_CONSTRUCTION, Squared);
                for (at, point) in class.points.iter().enumerate() {
                    index.insert((point, at));
                }
                index.set_searching_mode(true);
                index
            })
            .collect();
        Self { classes, indexes, ef: 0 }
    }
}

impl Method for HnswRs<'_> {
    fn name(&self) -> &'static str {
        "hnsw_rs"
    }
    fn tune(&mut self, ef: usize) -> Result<bool> {
        self.ef = ef;
        Ok(true)
    }
    fn search(&mut self, class: usize, query: &Feature, found: &mut Vec<u16>) {
        let (points, index) = (&self.classes[class], &self.indexes[class]);
        found.clear();
        found.extend(index.search(query, points.k, self.ef).iter().map(|n| points.rows[n.d_id]));
    }
}

/// A point as instant-distance wants it.
#[derive(Debug, Clone)]
pub struct Position(Feature);

impl Point for Position {
    fn distance(&self, other: &Self) -> f32 {
        squared(&self.0, &other.0)
    }
}

/// instant-distance: HNSW in Rust. Its breadth is fixed when the graph is built.
pub struct InstantDistance<'a> {
    classes: &'a [Points],
    indexes: Vec<HnswMap<Position, u16>>,
    search: Search,
}

impl<'a> InstantDistance<'a> {
    /// Nothing yet: the graphs come with [`Method::tune`].
    pub fn new(classes: &'a [Points]) -> Self {
        Self { classes, indexes: Vec::new(), search: Search::default() }
    }
}

impl Method for InstantDistance<'_> {
    fn name(&self) -> &'static str {
        "instant-distance"
    }
    fn tune(&mut self, ef: usize) -> Result<bool> {
        let build = |class: &Points| {
            Builder::default()
                .ef_construction(EF_CONSTRUCTION)
                .ef_search(ef)
                .seed(1)
                .build(class.points.iter().map(|&p| Position(p)).collect(), class.rows.clone())
        };
        self.indexes = self.classes.iter().map(build).collect();
        Ok(true)
    }
    fn search(&mut self, class: usize, query: &Feature, found: &mut Vec<u16>) {
        found.clear();
        let items = self.indexes[class].search(&Position(*query), &mut self.search);
        found.extend(items.take(self.classes[class].k).map(|item| *item.value));
    }
}

/// kiddo: a k-d tree in Rust. Exact.
pub struct Kiddo<'a> {
    classes: &'a [Points],
    trees: Vec<ImmutableKdTree<f32, { gestus_core::blob::layout::MAX_FEATURES }>>,
}

impl<'a> Kiddo<'a> {
    /// Builds the trees.
    pub fn new(classes: &'a [Points]) -> Self {
        let trees = classes.iter().map(|c| ImmutableKdTree::new_from_slice(&c.points)).collect();
        Self { classes, trees }
    }
}

impl Method for Kiddo<'_> {
    fn name(&self) -> &'static str {
        "kiddo"
    }
    fn tune(&mut self, _ef: usize) -> Result<bool> {
        Ok(false)
    }
    fn search(&mut self, class: usize, query: &Feature, found: &mut Vec<u16>) {
        let class_points = &self.classes[class];
        found.clear();
        if let Some(k) = NonZeroUsize::new(class_points.k) {
            let nearest = self.trees[class].nearest_n::<SquaredEuclidean>(query, k);
            found.extend(nearest.iter().map(|n| class_points.rows[n.item as usize]));
        }
    }
}
