//! What a frame costs on this machine by stage, and what the database does in bytes (Xia 2015, Tables 1 and 2).
//!
//! Held-out clips are streamed through a database without them, on one thread. Each stream runs three times, and the
//! least time of each stage of each frame counts: the work is the same, and what is more is another process's.

mod clock;
pub(super) mod paper_size;

use std::time::Instant;

use anyhow::Result;
use gestus_core::{Config, Database, Stage};
use gestus_database::{
    build::build,
    command_line::progress,
    stream::{Request, Streamed, stream},
};
use gestus_motion::{
    corpus::Corpus,
    statistics::{mean, quantile, sorted},
};
use serde_json::json;

use crate::{
    evaluation::{Evaluation, row},
    experiment::Experiment,
    measures::{OnClips, Uses},
    plots::{self, Labels},
    report::{html::Figure, table},
};
use clock::{Clock, Micros};

/// Runs of each stream.
const RUNS: usize = 3;

/// The components of the paper's Table 2, and the stages that are their work.
const COMPONENTS: [(&str, &[Stage]); 4] = [
    ("knn-search", &[Stage::Query, Stage::Search]),
    ("mar", &[Stage::Decode, Stage::Regression, Stage::Timing]),
    ("post-processing", &[Stage::Contacts, Stage::Lock]),
    ("total", &Stage::ALL),
];

/// Options of `gestus evaluate cost`.
#[derive(clap::Args, Debug, Default)]
pub struct Args {
    /// Measure generated motion of the size of the database of Xia 2015 (79,829 frames) too: it takes a few minutes
    #[arg(long)]
    pub generated: bool,
}

impl OnClips for Args {
    const USES: Uses = Uses::ALL;

    fn evaluate(&self, experiment: &Experiment) -> Result<Evaluation> {
        let mut rows = of_set("data", experiment)?;
        if self.generated {
            rows.extend(of_set("generated", &paper_size::experiment()?)?);
        }
        Ok(Evaluation {
            what: "cost",
            about: "Microseconds of a frame by stage, on one thread of this machine: of each stage of each frame the \
                    least of three runs. `knn-search`, `mar` and `post-processing` are the components of Xia 2015, Table 2: \
                    query and search; decode, regression and timing; contacts and lock. Rows `database` tell its size."
                .into(),
            keys: vec!["set", "method", "component"],
            figures: vec![by_stage(&rows)],
            rows,
        })
    }
}

/// The rows of a set of clips: of its database, and of each method on each test clip.
fn of_set(set: &str, experiment: &Experiment) -> Result<Vec<table::Row>> {
    let corpus = &experiment.corpus;
    let tests = experiment.queries()?;
    let kept = corpus.without(&tests);
    let start = Instant::now();
    let bytes = build(&kept, &experiment.build)?.bytes;
    let build_s = start.elapsed().as_secs_f64();
    let database = Database::open(&bytes)?;
    let mut rows = size(set, &kept, &database, (bytes.len(), build_s));
    let to = experiment.to.first().copied().unwrap_or(experiment.from) as u16;
    let bar = progress::bar(tests.len(), "cost");
    for &test in &tests {
        let example = &corpus.examples[test];
        let own = (Some(example.action as u16), Some(example.style as u16));
        for (method, config, (action, input_style)) in [
            ("mixture", Config::new(), (None, None)),
            ("local-ar", Config::new(), own),
            ("mixture-paper", Config::paper(), (None, None)),
            ("local-ar-paper", Config::paper(), own),
        ] {
            let request = Request { config, action, input_style, ..Request::style(to) };
            let run = || {
                let mut clock = Clock::new();
                let streamed = stream(&database, &example.clip, &request, &mut clock);
                streamed.map(|streamed| (streamed, clock.steps)).map_err(anyhow::Error::msg)
            };
            let (streamed, mut least) = run()?;
            for _ in 1..RUNS {
                for (least, again) in least.iter_mut().zip(run()?.1) {
                    least.iter_mut().zip(again).for_each(|(l, a)| *l = l.min(a));
                }
            }
            let of = json!({
                "set": set,
                "method": method,
                "action": corpus.actions[example.action],
                "clip": example.clip.name,
            });
            rows.extend(times(&row(of), &least, &streamed));
        }
        bar.inc(1);
    }
    bar.finish_and_clear();
    Ok(rows)
}

/// The size of a database: frames of each action, and bytes.
fn size(
    set: &str,
    corpus: &Corpus,
    database: &Database<'_>,
    (bytes, build_s): (usize, f64),
) -> Vec<table::Row> {
    let mut rows: Vec<table::Row> = corpus
        .actions
        .iter()
        .enumerate()
        .map(|(a, action)| {
            let clips = corpus.examples.iter().filter(|e| e.action == a);
            let frames: usize = clips.map(|e| e.clip.frames.len()).sum();
            row(json!({ "set": set, "method": "database", "component": action, "frames": frames }))
        })
        .collect();
    let frames = database.counts().frames;
    rows.push(row(json!({
        "set": set,
        "method": "database",
        "component": "total",
        "frames": frames,
        "classes": database.counts().classes,
        "rate_hz": corpus.rate_hz,
        "database_bytes": bytes,
        "bytes_per_frame": bytes as f64 / frames as f64,
        "build_s": build_s,
    })));
    rows
}

/// A row for each stage and each component of the paper.
fn times(of: &table::Row, steps: &[Micros], streamed: &Streamed) -> Vec<table::Row> {
    let whole = |step: &Micros| step.iter().sum::<f64>();
    let all = mean(steps.iter().map(whole));
    let stages = Stage::ALL.iter().map(|s| (Stage::NAMES[*s as usize], std::slice::from_ref(s)));
    let each = |(name, stages): (&str, &[Stage])| {
        let of_step = |step: &Micros| stages.iter().map(|s| step[*s as usize]).sum::<f64>();
        let micros = sorted(steps.iter().map(of_step));
        let mut row = of.clone();
        row.insert("component".into(), name.into());
        row.insert("us_mean".into(), mean(micros.iter().copied()).into());
        row.insert("us_median".into(), quantile(&micros, 0.5).into());
        row.insert("us_p99".into(), quantile(&micros, 0.99).into());
        row.insert("share".into(), (mean(micros.iter().copied()) / all).into());
        if name == "total" {
            let reports = || streamed.steps.iter().map(|s| &s.report);
            row.insert("visits_mean".into(), mean(reports().map(|r| f64::from(r.visits))).into());
            row.insert("classes_mean".into(), mean(reports().map(|r| r.classes.len() as f64)).into());
            row.insert("bytes_read_mean".into(), mean(reports().map(|r| f64::from(r.bytes_read))).into());
            row.insert("stylizer_bytes".into(), streamed.ram_bytes.into());
        }
        row
    };
    stages.chain(COMPONENTS).map(each).collect()
}

/// Mean time of each stage, a series for each set and method.
fn by_stage(rows: &[table::Row]) -> Figure {
    let means = table::means(rows, &["set", "method", "component"]);
    let mut series: Vec<(String, Vec<f64>)> = Vec::new();
    for row in &means {
        let text = |key: &str| table::text(row.get(key));
        let Some(stage) = Stage::NAMES.iter().position(|name| *name == text("component")) else { continue };
        let name = format!("{} {}", text("set"), text("method"));
        if series.last().is_none_or(|s| s.0 != name) {
            series.push((name, vec![0.0; Stage::NAMES.len()]));
        }
        let micros = row.get("us_median").and_then(serde_json::Value::as_f64).unwrap_or(0.0);
        if let Some((_, values)) = series.last_mut() {
            values[stage] = micros;
        }
    }
    let labels = Labels { title: "Time of a frame by stage", x: "stage", y: "us, median" };
    Figure {
        name: "stages".into(),
        caption: "Median microseconds of each stage of a frame, a mean over clips, by set and method.".into(),
        svg: plots::bars(labels, &Stage::NAMES.map(String::from), &series),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn stages_add_up_to_the_frame_and_the_search_of_all_classes_costs_more() {
        let experiment = Experiment::generated(&["walk", "run"], &["neutral", "old"], 2, 4.0);
        let rows = Args::default().evaluate(&experiment).unwrap().rows;
        let of = |method: &str, component: &str, key: &str| {
            let rows = rows.iter().filter(|r| r["method"] == method && r["component"] == component);
            let values: Vec<f64> = rows.map(|r| r[key].as_f64().unwrap()).collect();
            assert!(!values.is_empty(), "{method} {component} {key}");
            mean(values)
        };
        let stages: f64 = Stage::NAMES.iter().map(|stage| of("mixture", stage, "us_mean")).sum();
        let total = of("mixture", "total", "us_mean");
        assert!((stages - total).abs() < 1e-6 * total && total > 0.0, "{stages} {total}");
        let shares = ["knn-search", "mar", "post-processing", "rest"].map(|c| of("mixture", c, "share"));
        assert!((shares.iter().sum::<f64>() - 1.0).abs() < 1e-9, "{shares:?}");
        // A labelled frame searches one class; the paper unpacks 40 neighbors of each.
        assert!(of("mixture", "search", "us_mean") > of("local-ar", "search", "us_mean"));
        assert!(of("mixture", "total", "visits_mean") > of("local-ar", "total", "visits_mean"));
        assert!(of("local-ar-paper", "decode", "us_mean") > of("local-ar", "decode", "us_mean"));
        let frames = of("database", "walk", "frames") + of("database", "run", "frames");
        assert!((frames - of("database", "total", "frames")).abs() < 0.5);
    }
}
