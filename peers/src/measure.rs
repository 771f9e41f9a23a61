//! Recall and time of a method, and how hard it has to search for a recall.

use std::{hint::black_box, time::Instant};

use anyhow::Result;
use gestus_core::{
    Database,
    search::{graph::Limits, query::Feature},
};
use serde::{Deserialize, Serialize};

use crate::{
    methods::{BruteForce, Core, HnswRs, InstantDistance, Kiddo, Method, Usearch},
    setup::{Points, radii, squared},
};

/// Breadths that a peer is tried with, until it finds what core finds.
const BREADTHS: [usize; 23] =
    [8, 10, 12, 16, 20, 24, 32, 40, 44, 48, 56, 64, 72, 80, 96, 112, 128, 160, 192, 256, 384, 512, 1024];

/// A line of the table.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct Row {
    /// The library.
    pub method: String,
    /// Share of the true `k` nearest that were found.
    pub recall: f64,
    /// Microseconds for one query in one class.
    pub us_per_query: f64,
    /// Breadth of the search, where the library has one.
    pub ef: Option<usize>,
    /// Distances computed a query, where the library tells.
    pub visits: Option<f64>,
}

/// Streams of queries and what is true of them.
#[derive(Debug)]
pub struct Truth<'a> {
    classes: &'a [Points],
    streams: &'a [Vec<Feature>],
    /// Shape [streams][frames][classes].
    radii: Vec<Vec<Vec<f32>>>,
    /// Place in the class's points of each row, shape [classes][rows].
    places: Vec<Vec<usize>>,
}

impl<'a> Truth<'a> {
    /// Looks at every point for every query.
    pub fn new(classes: &'a [Points], streams: &'a [Vec<Feature>]) -> Self {
        let of = |stream: &Vec<Feature>| stream.iter().map(|query| radii(classes, query)).collect();
        let places = classes
            .iter()
            .map(|class| {
                let mut places = vec![usize::MAX; usize::from(u16::MAX)];
                for (place, &row) in class.rows.iter().enumerate() {
                    places[usize::from(row)] = place;
                }
                places
            })
            .collect();
        Self { classes, streams, radii: streams.iter().map(of).collect(), places }
    }

    /// Queries times classes.
    pub fn searches(&self) -> usize {
        self.classes.len() * self.streams.iter().map(Vec::len).sum::<usize>()
    }

    /// Recall at each frame of a stream, mean over the classes.
    pub fn recall_of(&self, method: &mut dyn Method, stream: usize) -> Vec<f64> {
        method.reset();
        let mut found = Vec::new();
        let queries = self.streams[stream].iter().zip(&self.radii[stream]);
        queries
            .map(|(query, radii)| {
                method.begin(query);
                let mut sum = 0.0;
                for (c, class) in self.classes.iter().enumerate() {
                    method.search(c, query, &mut found);
                    found.sort_unstable();
                    found.dedup();
                    let point = |row: &u16| &class.points[self.places[c][usize::from(*row)]];
                    let hits = found.iter().filter(|row| squared(point(row), query) <= radii[c]).count();
                    sum += hits.min(class.k) as f64 / class.k.min(class.points.len()).max(1) as f64;
                }
                sum / self.classes.len() as f64
            })
            .collect()
    }

    /// Recall over all streams.
    pub fn recall(&self, method: &mut dyn Method) -> f64 {
        let each: Vec<f64> = (0..self.streams.len()).flat_map(|s| self.recall_of(method, s)).collect();
        each.iter().sum::<f64>() / each.len().max(1) as f64
    }
}

/// Answers every query of the streams; returns something that depends on every answer.
pub fn answer(method: &mut dyn Method, classes: usize, streams: &[Vec<Feature>]) -> u64 {
    let mut found = Vec::new();
    let mut sum = 0;
    for stream in streams {
        method.reset();
        for query in stream {
            method.begin(query);
            for class in 0..classes {
                method.search(class, query, &mut found);
                sum += found.iter().map(|&row| u64::from(row)).sum::<u64>();
            }
        }
    }
    sum
}

/// Core and every peer, each searching hard enough for the recall of core.
///
/// # Errors
/// A library's.
pub fn tuned<'a>(
    database: Database<'a>,
    limits: Limits,
    truth: &Truth<'a>,
) -> Result<Vec<(Box<dyn Method + 'a>, Row)>> {
    let classes = truth.classes;
    let methods: [Box<dyn Method + 'a>; 7] = [
        Box::new(Core::new(database, limits)),
        Box::new(Core::cold(database, limits)),
        Box::new(Usearch::new(classes)?),
        Box::new(HnswRs::new(classes)),
        Box::new(InstantDistance::new(classes)),
        Box::new(Kiddo::new(classes)),
        Box::new(BruteForce::new(classes)),
    ];
    let mut done: Vec<(Box<dyn Method + 'a>, Row)> = Vec::new();
    for mut method in methods {
        let wanted = done.first().map_or(0.0, |(_, row): &(_, Row)| row.recall);
        let (mut recall, mut ef) = (0.0, None);
        for breadth in BREADTHS {
            let tunable = method.tune(breadth)?;
            recall = truth.recall(method.as_mut());
            ef = tunable.then_some(breadth);
            if !tunable || recall >= wanted {
                break;
            }
        }
        let visits = method.visits().map(|v| v as f64 / truth.searches() as f64);
        let row = Row { method: method.name().into(), recall, us_per_query: f64::INFINITY, ef, visits };
        done.push((method, row));
    }
    Ok(done)
}

/// Times the methods by turns, query by query; of each query the quickest round counts, so that what else the
/// machine does drops out. `between` is called once a round, for a method that times itself.
///
/// # Errors
/// That of `between`.
pub fn time(
    methods: &mut [(Box<dyn Method + '_>, Row)],
    truth: &Truth<'_>,
    rounds: usize,
    mut between: impl FnMut() -> Result<()>,
) -> Result<()> {
    let queries: usize = truth.streams.iter().map(Vec::len).sum();
    let mut best = vec![vec![f64::INFINITY; queries]; methods.len()];
    let mut found = Vec::new();
    for _ in 0..rounds {
        between()?;
        for ((method, _), best) in methods.iter_mut().zip(&mut best) {
            let mut best = best.iter_mut();
            for stream in truth.streams {
                method.reset();
                for (query, best) in stream.iter().zip(best.by_ref()) {
                    let start = Instant::now();
                    method.begin(query);
                    for class in 0..truth.classes.len() {
                        method.search(class, query, &mut found);
                        black_box(&found);
                    }
                    *best = best.min(start.elapsed().as_secs_f64() * 1e6);
                }
            }
        }
    }
    for ((_, row), best) in methods.iter_mut().zip(&best) {
        row.us_per_query = best.iter().sum::<f64>() / truth.searches() as f64;
    }
    Ok(())
}

/// Mean recall 0, 1, 2, .. frames after a jump, and the worst of the streams at each.
pub fn after_jumps(
    database: Database<'_>,
    limits: Limits,
    classes: &[Points],
    jumps: &[(usize, Vec<Feature>)],
    frames: usize,
) -> (Vec<f64>, Vec<f64>) {
    let streams: Vec<Vec<Feature>> = jumps.iter().map(|(_, stream)| stream.clone()).collect();
    let truth = Truth::new(classes, &streams);
    let mut core = Core::new(database, limits);
    let (mut mean, mut worst) = (vec![0.0; frames], vec![1.0f64; frames]);
    for (s, (at, _)) in jumps.iter().enumerate() {
        let recall = truth.recall_of(&mut core, s);
        for (after, (mean, worst)) in mean.iter_mut().zip(&mut worst).enumerate() {
            *mean += recall[at + after] / jumps.len() as f64;
            *worst = worst.min(recall[at + after]);
        }
    }
    (mean, worst)
}

/// A setting of core's search and what it costs.
#[derive(Debug, Clone, Serialize)]
pub struct Setting {
    /// Size of the pool.
    pub pool: usize,
    /// Most visits.
    pub visits: u16,
    /// Share of the true `k` nearest that were found.
    pub recall: f64,
    /// Distances computed a query.
    pub visits_mean: f64,
    /// Microseconds a query and class.
    pub us_per_query: f64,
}

/// Core with every given size of the pool and bound of the visits.
///
/// # Errors
/// As [`time`].
pub fn sweep(
    database: Database<'_>,
    limits: Limits,
    (pools, bounds): (&[usize], &[u16]),
    truth: &Truth<'_>,
    rounds: usize,
) -> Result<Vec<Setting>> {
    let mut settings = Vec::new();
    for &pool in pools {
        for &visits in bounds {
            let mut core = Core::new(database, Limits { pool, visits, ..limits });
            let recall = truth.recall(&mut core);
            let visits_mean = core.visits().unwrap_or(0) as f64 / truth.searches() as f64;
            let row =
                Row { method: "core".into(), recall, us_per_query: f64::INFINITY, ef: None, visits: None };
            let mut methods: [(Box<dyn Method>, Row); 1] = [(Box::new(core), row)];
            time(&mut methods, truth, rounds, || Ok(()))?;
            let us_per_query = methods[0].1.us_per_query;
            settings.push(Setting { pool, visits, recall, visits_mean, us_per_query });
        }
    }
    Ok(settings)
}
