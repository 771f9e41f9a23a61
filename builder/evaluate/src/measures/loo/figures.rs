//! Plots of the leave-one-out measure.

use gestus_core::{Database, blob::layout::dof};
use gestus_database::{
    build::BuildError,
    stream::{Request, stream},
};
use gestus_motion::{
    body::{Body, row_at},
    corpus::Corpus,
    statistics::{mean, variance},
};

use crate::{
    baselines::outputs::{GlobalModel, Outputs, Record},
    experiment::Experiment,
    fold::{Fold, Row, class_of, own_dofs},
    metrics::matched,
    plots::{self, Labels},
    report::html::Figure,
};

fn methods_of(results: &[Row]) -> Vec<String> {
    let mut names: Vec<String> = Vec::new();
    for row in results {
        if !names.contains(&row.method) {
            names.push(row.method.clone());
        }
    }
    names
}

fn finite_mean(values: impl Iterator<Item = f64>) -> f64 {
    mean(values.filter(|v| v.is_finite()))
}

/// Errors of each method by action (Xia 2015, Figure 6).
pub(super) fn error_bars(corpus: &Corpus, results: &[Row]) -> Figure {
    let series: Vec<(String, Vec<f64>)> = methods_of(results)
        .into_iter()
        .filter(|m| {
            [
                "unchanged",
                "other-clip",
                "global-affine",
                "nearest",
                "knn",
                "local-ar",
                "mixture",
                "mixture-paper",
                "lti",
                "statistic",
            ]
            .contains(&m.as_str())
        })
        .map(|m| {
            let of = |a| {
                finite_mean(
                    results.iter().filter(|r| r.method == m && r.action == a).map(|r| r.delivered.error_cm),
                )
            };
            let values = (0..corpus.actions.len()).map(of).collect();
            (m, values)
        })
        .collect();
    let labels = Labels { title: "Delivered error of each method", x: "action", y: "cm" };
    Figure {
        name: "errors".into(),
        caption: "Mean error of the poses that leave, by action, leave one clip out (Xia 2015, Figure 6)."
            .into(),
        svg: plots::bars(labels, &corpus.actions, &series),
    }
}

/// Error against variability: methods that average have less of both.
pub(super) fn trade_off(results: &[Row]) -> Figure {
    let points: Vec<(String, f64, f64)> = methods_of(results)
        .into_iter()
        .filter(|m| m != "unchanged" && m != "global-ar")
        .map(|m| {
            let of = || results.iter().filter(|r| r.method == m);
            (
                m.clone(),
                finite_mean(of().filter_map(|r| r.delivered.variability)),
                finite_mean(of().map(|r| r.delivered.error_cm)),
            )
        })
        .collect();
    let labels = Labels {
        title: "Delivered error against variability",
        x: "cycle-to-cycle variability, real motion = 1",
        y: "delivered error, cm",
    };
    Figure {
        name: "trade-off".into(),
        caption: "Averages come nearer to the truth than another real clip does, and move less than any."
            .into(),
        svg: plots::points(labels, &points),
    }
}

/// One dof over time for each method against the truth, as in Xia 2015, Figure 3.
/// `None` where there is no fold.
pub(in crate::measures) fn one_dof(experiment: &Experiment) -> Result<Option<Figure>, BuildError> {
    let corpus = &experiment.corpus;
    let body = Body::of(corpus)?;
    let Some(&held) = experiment.held_out(&body).0.first() else { return Ok(None) };
    let (fold, bytes) = Fold::new(experiment, &body, held, &experiment.build)?;
    let database = Database::open(&bytes)?;
    let style = held.style;
    let example = &corpus.examples[held.test];
    let request = Request::style(style as u16);
    let mut record = Record::of(&database);
    let Ok(_) = stream(&database, &example.clip, &request, &mut record) else { return Ok(None) };
    let predicted = own_dofs(&fold, &database, &record.predicted);
    let dof = dof::JOINTS + 3 * (body.landmarks.knees[0] - 1);
    let spread = |d: usize| variance(fold.x.iter().map(|r| r[d]));
    let dof = (dof..dof + 3).max_by(|&a, &b| spread(a).total_cmp(&spread(b))).unwrap_or(dof);
    let series = |rows: &[Vec<f64>]| {
        rows.iter().enumerate().map(|(t, r)| (t as f64 / corpus.rate_hz, r[dof])).collect::<Vec<_>>()
    };
    let (cycles, truth_cycles) = fold.cycles();
    let truth: Vec<(f64, f64)> = (0..fold.x.len())
        .filter_map(|t| {
            let at = matched(cycles, t, truth_cycles, fold.shift)?;
            Some((t as f64 / corpus.rate_hz, row_at(&fold.truth_rows, at)[dof]))
        })
        .collect();
    let mut all = vec![
        ("input".to_owned(), series(&fold.x)),
        ("mixture".to_owned(), series(&predicted)),
        ("truth".to_owned(), truth),
    ];
    if let Some(class) = class_of(&database, example.action, example.style) {
        for (name, autoregressive) in [("global affine", false), ("global AR", true)] {
            let model = GlobalModel::fit(&database, &[class], style, autoregressive, Outputs::One);
            all.push((name.into(), series(&own_dofs(&fold, &database, &model.run(&fold.x, &fold.x[0])))));
        }
    }
    let names = body.dof_names();
    let title = format!("{} of {} in the style {}", names[dof], example.clip.name, corpus.styles[style]);
    Ok(Some(Figure {
        name: "dof".into(),
        caption: "One dof over the input's time, each method against the truth at equal canonical time (Xia 2015, Figure 3).".into(),
        svg: plots::lines(Labels { title: &title, x: "input time, s", y: "rad" }, &all),
    }))
}
