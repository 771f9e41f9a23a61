//! The search against brute force over the same features: recall, visits, time.

use std::time::Instant;

use anyhow::Result;
use gestus_core::{
    Config, Database,
    blob::layout::{MAX_FEATURES, MAX_JOINTS},
    search::{
        graph::{Last, Limits, Searcher},
        metric::Metric,
        query::{ALIGNED, Window},
    },
};
use serde_json::json;

use crate::{
    evaluation::{Evaluation, row},
    experiment::Experiment,
    measures::{OnClips, Uses},
    plots::{self, Labels},
    report::{html::Figure, table},
};
use gestus_database::{
    build::build,
    command_line::progress,
    search::graph::{ClassFeatures, exact_knn},
    stream::to_pose,
};

/// Frames after a jump whose recall is measured.
const AFTER: usize = 8;

/// Numbers of neighbors that are searched, by the name of the method: the default, and 40 (Xia 2015, section 7).
fn neighbor_counts() -> [(&'static str, u16); 2] {
    [("graph", Config::new().k), ("graph-40", 40)]
}

type Pose = gestus_core::Pose<MAX_JOINTS>;

/// Options of `gestus evaluate knn`.
#[derive(clap::Args, Debug)]
pub struct Args;

impl OnClips for Args {
    const USES: Uses = Uses { to: false, ..Uses::ALL };

    fn evaluate(&self, experiment: &Experiment) -> Result<Evaluation> {
        evaluate(experiment)
    }
}

/// Streams held-out clips through the search: every frame is a query to every class.
fn evaluate(experiment: &Experiment) -> Result<Evaluation> {
    let corpus = &experiment.corpus;
    let tests = experiment.queries()?;
    let built = build(&corpus.without(&tests), &experiment.build)?;
    let database = Database::open(&built.bytes)?;
    let bar = progress::bar(tests.len(), "search");
    let classes = Classes::of(&database);
    let mut rows: Vec<table::Row> = Vec::new();
    let mut after_jump = [[After::default(); AFTER]; 2];
    for (i, &test) in tests.iter().enumerate() {
        let clip = &corpus.examples[test].clip;
        // After the clip the stream jumps into another one, a third of the way in.
        let other = &corpus.examples[tests[(i + tests.len() / 2) % tests.len()]].clip;
        let jump = clip.frames.len();
        let poses: Vec<Pose> =
            clip.frames.iter().chain(&other.frames[other.frames.len() / 3..]).map(to_pose).collect();
        let mut results = Vec::new();
        for ((method, k), after_jump) in neighbor_counts().into_iter().zip(&mut after_jump) {
            let (graph, brute) = stream(&database, &classes, &poses, k, jump, after_jump);
            results.push((method, graph));
            if method == "graph" {
                results.push(("brute-force", brute));
            }
        }
        for (method, result) in results {
            rows.push(row(json!({
                "method": method,
                "action": corpus.actions[corpus.examples[test].action],
                "style": corpus.styles[corpus.examples[test].style],
                "clip": clip.name,
                "recall": result.recall,
                "visits_mean": result.visits,
                "us_per_query": result.micros,
            })));
        }
        bar.inc(1);
    }
    bar.finish_and_clear();
    let mut recoveries: Vec<(String, Vec<(f64, f64)>)> = Vec::new();
    for ((name, _), after) in neighbor_counts().into_iter().zip(&after_jump) {
        let method = format!("{name}-after-jump");
        for (frame, after) in after.iter().enumerate() {
            rows.push(row(json!({
                "method": method, "action": null, "style": null, "frames_after": frame,
                "recall": after.found / after.wanted.max(1.0), "visits_mean": after.visits / after.queries.max(1.0),
            })));
        }
        let recall = |(t, a): (usize, &After)| (t as f64, a.found / a.wanted.max(1.0));
        recoveries.push((name.to_owned(), after.iter().enumerate().map(recall).collect()));
    }
    let labels =
        Labels { title: "Recall after a jump of the input", x: "frames after the jump", y: "recall" };
    let figures = vec![Figure {
        name: "jump".into(),
        caption: "The input jumps into another clip, a third of the way in, at frame 0.".into(),
        svg: plots::lines(labels, &recoveries),
    }];
    Ok(Evaluation {
        what: "knn",
        about: "Queries are the frames of held-out clips, one query to each class a frame; recall counts how many of \
                the nearest by brute force over the same stored features the graph finds: of as many as a stylizer takes \
                as shipped (graph), and of 40 (graph-40). Time is that of one query to one class, on one thread."
            .into(),
        keys: vec!["method", "frames_after"],
        rows,
        figures,
    })
}

/// Stored features of each class, as brute force wants them.
struct Classes {
    codes: Vec<Vec<Vec<i8>>>,
    searchable: Vec<Vec<bool>>,
    weights: Vec<f32>,
}

impl Classes {
    fn of(database: &Database<'_>) -> Self {
        use gestus_core::blob::layout::flag;
        let rows = |c: gestus_core::blob::Class| c.first_row..c.first_row + c.rows;
        let codes = |r: usize| database.feature(r).iter().map(|&b| b as i8).collect();
        Self {
            codes: database.classes().map(|c| rows(c).map(codes).collect()).collect(),
            searchable: database
                .classes()
                .map(|c| rows(c).map(|r| database.flags(r) & flag::SEARCHABLE != 0).collect())
                .collect(),
            weights: (0..database.counts().features).map(|f| database.feature_scale(f).powi(2)).collect(),
        }
    }
}

#[derive(Default)]
struct Outcome {
    recall: f64,
    visits: f64,
    micros: f64,
}

/// Sums over the queries of one frame after a jump.
#[derive(Default, Clone, Copy)]
struct After {
    found: f64,
    wanted: f64,
    visits: f64,
    queries: f64,
}

fn stream(
    database: &Database<'_>,
    classes: &Classes,
    poses: &[Pose],
    k: u16,
    jump: usize,
    after_jump: &mut [After],
) -> (Outcome, Outcome) {
    let Config { k, pool, visits, jump: jump_factor, .. } = Config::new().k(k);
    let limits = Limits {
        k: usize::from(k),
        pool: usize::from(pool),
        visits,
        spare: visits,
        jump: jump_factor,
        cutoff_distance2: f32::INFINITY,
    };
    let counts = database.counts();
    let mut window = Box::new(Window::new());
    let mut searcher = Box::new(Searcher::new());
    let mut last: Vec<(Vec<u16>, Option<f32>)> = vec![(Vec::new(), None); counts.classes];
    let (mut graph, mut brute) = (Outcome::default(), Outcome::default());
    let (mut found, mut wanted, mut queries) = (0.0, 0.0, 0.0);
    let mut feature = [0.0; MAX_FEATURES];
    let mut aligned = [0; ALIGNED * MAX_JOINTS];
    for (t, pose) in poses.iter().enumerate() {
        window.push(database, pose);
        window.feature(database, &mut aligned, &mut feature);
        let metric = Metric::new(database, &mut feature, u8::MAX);
        for class in 0..counts.classes {
            let start = Instant::now();
            let (rows, mean_distance2) = &last[class];
            let followed = Last { rows, mean_distance2: *mean_distance2, frames: 1 };
            let near = searcher.search(database, class, &metric, &limits, followed);
            let graph_s = start.elapsed().as_secs_f64();
            let (rows, mean): (Vec<u16>, f32) = (near.rows().collect(), near.mean_distance2);
            let query: Vec<f32> =
                (0..counts.features).map(|f| feature[f] / database.feature_scale(f)).collect();
            let features = ClassFeatures {
                codes: &classes.codes[class],
                weights: &classes.weights,
                searchable: &classes.searchable[class],
            };
            let start = Instant::now();
            // As many as the class has to return, not as many as were found: missing neighbors count against the recall.
            let exact = exact_knn(&features, &query, limits.k.min(database.class(class).k_cap));
            let brute_s = start.elapsed().as_secs_f64();
            let hits = exact.iter().filter(|(_, r)| rows.contains(&(*r as u16))).count() as f64;
            let visits = f64::from(near.stats.visits);
            if t < jump {
                found += hits;
                wanted += exact.len() as f64;
                graph.visits += visits;
                graph.micros += 1e6 * graph_s;
                brute.visits += classes.searchable[class].iter().filter(|s| **s).count() as f64;
                brute.micros += 1e6 * brute_s;
                queries += 1.0;
            } else if let Some(after) = after_jump.get_mut(t - jump) {
                after.found += hits;
                after.wanted += exact.len() as f64;
                after.visits += visits;
                after.queries += 1.0;
            }
            last[class] = (rows, Some(mean));
        }
    }
    for outcome in [&mut graph, &mut brute] {
        outcome.visits /= queries;
        outcome.micros /= queries;
    }
    (graph.recall, brute.recall) = (found / wanted, 1.0);
    (graph, brute)
}
