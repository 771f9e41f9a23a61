//! Bytes a frame against the joint error that packing causes.

use gestus_core::Database;
use serde_json::json;

use crate::{
    evaluation::{self, Evaluation},
    experiment::Experiment,
    measures::{OnClips, Uses},
    plots::{self, Labels},
    report::{html::Figure, table},
};
use gestus_database::{
    blob::{export::row, rows::joint_error},
    build::{BuildError, BuildOptions, build},
    command_line::progress,
};
use gestus_motion::{body::Body, corpus::Corpus};

/// Options of `gestus evaluate compression`.
#[derive(clap::Args, Debug)]
pub struct Args;

impl OnClips for Args {
    const USES: Uses = Uses { groups: true, ..Uses::NONE };

    fn evaluate(&self, experiment: &Experiment) -> anyhow::Result<Evaluation> {
        Ok(evaluate(&experiment.corpus, &experiment.build)?)
    }
}

/// Builds at several targets and block sizes, and compares what the core unpacks with the clips.
fn evaluate(corpus: &Corpus, options: &BuildOptions) -> Result<Evaluation, BuildError> {
    let body = Body::of(corpus)?;
    let targets = [0.01, 0.02, 0.03, 0.045, 0.07, 0.1, 0.15];
    let blocks = [16, 32];
    let bar = progress::bar(targets.len() * blocks.len(), "compression");
    let mut rows: Vec<table::Row> = Vec::new();
    let mut series = Vec::new();
    for block_rows in blocks {
        let mut points = Vec::new();
        for error_cm in targets {
            let built = build(corpus, &BuildOptions { error_cm, block_rows, ..options.clone() })?;
            let database = Database::open(&built.bytes)?;
            let error = 100.0 * mean_error(corpus, &body, &database);
            let frames = database.counts().frames as f64;
            let packed = database
                .sections()
                .iter()
                .filter(|(id, _)| {
                    ["rows", "blocks"].contains(&gestus_core::blob::layout::section::name(*id).unwrap_or(""))
                })
                .map(|s| s.1.len())
                .sum::<usize>();
            rows.push(evaluation::row(json!({
                "method": "blocks", "action": null, "style": null, "block_rows": block_rows, "target_cm": error_cm,
                "joint_error_cm": error,
                "bytes_per_frame": built.bytes.len() as f64 / frames,
                "row_bytes_per_frame": packed as f64 / frames,
            })));
            points.push((packed as f64 / frames, error));
            bar.inc(1);
        }
        series.push((format!("blocks of {block_rows}"), points));
    }
    bar.finish_and_clear();
    let labels = Labels { title: "Packed rows", x: "bytes a frame, rows alone", y: "mean joint error, cm" };
    let figures = vec![Figure {
        name: "bytes".into(),
        caption: "Mean joint error of unpacked rows against the clips.".into(),
        svg: plots::lines(labels, &series),
    }];
    Ok(Evaluation {
        what: "compression",
        about: "Whole databases are built at several targets; core unpacks every captured frame, which is compared with the clip.".into(),
        keys: vec!["block_rows", "target_cm"],
        rows,
        figures,
    })
}

/// Mean joint distance between the clips and what the database holds of them, metres.
pub fn mean_error(corpus: &Corpus, body: &Body, database: &Database<'_>) -> f64 {
    let Ok(manifest) = database.manifest() else { return f64::NAN };
    let (mut sum, mut count) = (0.0, 0.0);
    for (i, name) in manifest.clips.iter().enumerate() {
        let (first, length) = database.clip(i);
        let Some(example) =
            corpus.examples.iter().find(|e| e.clip.name == name && first < database.counts().frames)
        else {
            continue;
        };
        for (f, dofs) in body.clip_dofs(&example.clip).iter().enumerate().take(length) {
            let wide: Vec<f32> = dofs.iter().map(|&v| v as f32).collect();
            sum += joint_error(body, &wide, &row(database, first + f));
            count += 1.0;
        }
    }
    sum / count
}
