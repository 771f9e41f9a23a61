//! Gaussian process regression in the folds of [`loo`](super::loo): accuracy, time and memory as its examples double.

use gestus_core::Database;

use crate::{
    baselines::{
        gaussian_process::{self, Editor, Pairs},
        outputs::Outputs,
    },
    evaluation::Evaluation,
    experiment::Experiment,
    fold::{Fold, Row, class_of, classes_of, own_dofs},
    measures::{OnClips, Uses},
    plots::{self, Labels},
    report::{html::Figure, table},
};
use gestus_database::{build::BuildError, command_line::progress};

/// Options of `gestus evaluate gaussian-process`. Of `--to` the first style alone is measured, since fits take minutes.
#[derive(clap::Args, Debug)]
pub struct Args;

impl OnClips for Args {
    const USES: Uses = Uses::ALL;

    fn evaluate(&self, experiment: &Experiment) -> anyhow::Result<Evaluation> {
        let to = experiment.to.iter().copied().take(1).collect();
        Ok(evaluate(&Experiment { to, ..experiment.clone() })?)
    }
}

/// Gaussian process regression as its examples double, in the first output style: accuracy, time and memory.
fn evaluate(experiment: &Experiment) -> Result<Evaluation, BuildError> {
    let corpus = &experiment.corpus;
    let (body, folds) = experiment.folds()?;
    let sizes = [64, 128, 256, 512, 1024, 2048];
    let bar = progress::bar(folds.len() * sizes.len(), "gaussian process");
    let mut rows = Vec::new();
    for &held in &folds {
        let (fold, bytes) = Fold::new(experiment, &body, held, &experiment.build)?;
        let database = Database::open(&bytes)?;
        for most in sizes {
            let gp = gaussian_process::Options { most, ..gaussian_process::Options::default() };
            bar.inc(1);
            let Some((row, editor, seconds)) = gaussian(&fold, &database, &gp, true, (Outputs::One, ""))
            else {
                continue;
            };
            // The class has fewer examples than that.
            if editor.examples() < most {
                continue;
            }
            let mut row = row.to_json(corpus);
            row.insert("n".into(), editor.examples().into());
            row.insert("fit_s".into(), editor.fit_s.into());
            row.insert("evidence".into(), editor.evidence().into());
            row.insert("predict_ms".into(), (1e3 * seconds).into());
            row.insert("memory_bytes".into(), editor.bytes().into());
            rows.push(row);
        }
    }
    bar.finish_and_clear();
    let means = table::means(&rows, &["n"]);
    let series = |key: &str| -> Vec<(f64, f64)> {
        let number =
            |r: &table::Row, k: &str| r.get(k).and_then(serde_json::Value::as_f64).unwrap_or(f64::NAN);
        means.iter().map(|r| (number(r, "n"), number(r, key))).collect()
    };
    let labels = Labels { title: "Gaussian process as its data grows", x: "examples", y: "s, ms, cm" };
    let keys =
        [("fit_s", "seconds to fit"), ("predict_ms", "ms a frame"), ("joint_error_cm", "joint error, cm")];
    let lines: Vec<_> = keys.iter().map(|(k, name)| ((*name).to_owned(), series(k))).collect();
    Ok(Evaluation {
        what: "gaussian-process",
        about: "Gaussian process regression with a stabilised predictor, leave one clip out, to the first style of --to, conditioned on more and more \
                of the labelled class's examples. Hyperparameters are chosen on a subset of 160 in every row, the best of three starts by \
                marginal likelihood (`evidence`: its negative logarithm, a mean over outputs and examples)."
            .into(),
        keys: vec!["method", "n"],
        rows,
        figures: vec![Figure {
            name: "growth".into(),
            caption: "Time grows with the cube of the examples, memory and prediction with their square.".into(),
            svg: plots::lines(labels, &lines),
        }],
    })
}

/// Gaussian process regression over the labelled class, or over all actions of the input's style; and what it is, and
/// seconds a frame.
pub(super) fn gaussian(
    fold: &Fold<'_>,
    database: &Database<'_>,
    options: &gaussian_process::Options,
    labelled: bool,
    (outputs, ending): (Outputs, &str),
) -> Option<(Row, Editor, f64)> {
    let example = &fold.corpus.examples[fold.test];
    let (name, classes) = if labelled {
        ("gaussian-process", vec![class_of(database, example.action, example.style)?])
    } else {
        ("gaussian-process-unlabelled", classes_of(database, example.style))
    };
    let pairs = Pairs::of(database, &classes, fold.style, outputs).thinned(options.most);
    let editor = Editor::fit(&pairs, options)?;
    let x = fold.body.with_means_of(database).clip_dofs(&example.clip);
    let start = std::time::Instant::now();
    let predicted = editor.run(&x);
    let seconds = start.elapsed().as_secs_f64() / x.len() as f64;
    Some((fold.row(&format!("{name}{ending}"), &own_dofs(fold, database, &predicted), None), editor, seconds))
}
