//! Plots of the leave-one-out measure.

use gestus_core::{Config, Database, Method};
use gestus_database::build::BuildError;
use gestus_motion::{
    body::{Body, first_dof, row_at},
    corpus::Corpus,
    statistics::{mean, variance},
};

use crate::{
    baselines::outputs::{ClassNeighbors, GlobalModel, Outputs, Variables, interpolated},
    experiment::Experiment,
    fold::{Fold, Row, class_of, own_dofs},
    measures::streamed,
    metrics::matched,
    plots::{self, Labels},
    report::{html::Figure, table::distinct},
};

fn methods_of(results: &[Row]) -> Vec<String> {
    distinct(results.iter().map(|row| row.method.clone()))
}

fn finite_mean(values: impl Iterator<Item = f64>) -> f64 {
    mean(values.filter(|v| v.is_finite()))
}

/// Methods whose errors are drawn.
const SHOWN: &str =
    "unchanged other-clip global-affine nearest knn local-ar mixture mixture-paper lti statistic";

/// Errors of each method by action (Xia 2015, Figure 6).
pub(super) fn error_bars(corpus: &Corpus, results: &[Row]) -> Figure {
    let series: Vec<(String, Vec<f64>)> = methods_of(results)
        .into_iter()
        .filter(|m| SHOWN.split(' ').any(|shown| shown == m))
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

/// A method's prediction for the test clip, and its steps where it predicts any.
struct Course {
    method: &'static str,
    rows: Vec<Vec<f64>>,
    steps_s: Option<Vec<f64>>,
}

/// One dof over time for each method against the truth (Xia 2015, Figure 3), and the time warps of those that predict one
/// (Figure 4). None where there is no fold.
pub(in crate::measures) fn curves(experiment: &Experiment) -> Result<Vec<Figure>, BuildError> {
    let corpus = &experiment.corpus;
    let body = Body::of(corpus)?;
    let Some(&held) = experiment.held_out(&body).0.first() else { return Ok(Vec::new()) };
    let (fold, bytes) = Fold::new(experiment, &body, held, &experiment.build_with_models())?;
    let courses = courses(&fold, &Database::open(&bytes)?);
    let of = format!("{} in the style {}", corpus.examples[held.test].clip.name, corpus.styles[held.style]);
    Ok(vec![one_dof(&fold, &courses, &of), time_warps(&fold, &courses, &of)])
}

fn courses(fold: &Fold<'_>, database: &Database<'_>) -> Vec<Course> {
    let example = &fold.corpus.examples[fold.test];
    let mut courses = Vec::new();
    for (method, kind, record, streamed) in streamed(database, &example.clip, fold.style) {
        let steps = streamed.steps.iter().map(|s| f64::from(s.report.predicted_step_s)).collect();
        let rows = own_dofs(fold, database, &record.predicted);
        // Statistics have the input's time.
        let steps_s = Some(steps).filter(|_| kind != Method::Statistic);
        courses.push(Course { method, rows, steps_s });
        if kind == Method::Mar {
            let of = |classes: &[ClassNeighbors]| {
                let most = usize::from(Config::new().k);
                interpolated(database, &classes.iter().collect::<Vec<_>>(), most, fold.style, Outputs::Mean)
            };
            let rows = own_dofs(fold, database, &record.each(of));
            courses.push(Course { method: "knn", rows, steps_s: None });
        }
    }
    let Some(class) = class_of(database, example.action, example.style) else { return courses };
    let x = fold.body.with_means_of(database).clip_dofs(&example.clip);
    for (method, variables) in
        [("global-affine", Variables::Affine), ("global-ar", Variables::Autoregressive)]
    {
        let model = GlobalModel::fit(database, &[class], fold.style, variables, Outputs::One);
        courses.push(Course { method, rows: own_dofs(fold, database, &model.run(&x, &x[0])), steps_s: None });
    }
    courses
}

/// Seconds of a dof that are drawn: more than a few strides can't be told apart.
const DRAWN_S: f64 = 4.0;

/// The knee's dof that varies most.
fn one_dof(fold: &Fold<'_>, courses: &[Course], of: &str) -> Figure {
    let dof = first_dof(fold.body.landmarks.knees[0]);
    let spread = |d: usize| variance(fold.x.iter().map(|r| r[d]));
    let dof = (dof..dof + 3).max_by(|&a, &b| spread(a).total_cmp(&spread(b))).unwrap_or(dof);
    let rate = fold.corpus.rate_hz;
    let drawn = fold.x.len().min((DRAWN_S * rate) as usize);
    let series = |rows: &[Vec<f64>]| {
        rows.iter().take(drawn).enumerate().map(|(t, r)| (t as f64 / rate, r[dof])).collect::<Vec<_>>()
    };
    let (cycles, truth_cycles) = fold.cycles();
    let truth: Vec<(f64, f64)> = (0..drawn)
        .filter_map(|t| {
            let at = matched(cycles, t, truth_cycles, fold.shift)?;
            Some((t as f64 / rate, row_at(&fold.truth_rows, at)[dof]))
        })
        .collect();
    let mut all = vec![("input".to_owned(), series(&fold.x)), ("truth".to_owned(), truth)];
    all.extend(courses.iter().map(|c| (c.method.to_owned(), series(&c.rows))));
    let title = format!("{} of {of}", fold.body.dof_names()[dof]);
    Figure {
        name: "dof".into(),
        caption: "One dof over the input's time, each method against the truth at equal canonical time (Xia 2015, Figure 3)."
            .into(),
        svg: plots::lines(Labels { title: &title, x: "input time, s", y: "rad" }, &all),
    }
}

/// Time that has passed in the output beyond the input's, over the frames with a truth.
fn time_warps(fold: &Fold<'_>, courses: &[Course], of: &str) -> Figure {
    let rate = fold.corpus.rate_hz;
    let truth = fold.true_steps();
    let course = |step: &dyn Fn(usize) -> Option<f64>| {
        let mut ahead = 0.0;
        let frames = (0..truth.len()).filter(|&t| truth[t].is_some());
        frames
            .filter_map(|t| {
                ahead += step(t)? - 1.0 / rate;
                Some((t as f64 / rate, 1000.0 * ahead))
            })
            .collect::<Vec<_>>()
    };
    let mut all = vec![("truth".to_owned(), course(&|t| truth[t]))];
    all.extend(courses.iter().filter_map(|c| {
        let steps = c.steps_s.as_ref()?;
        Some((c.method.to_owned(), course(&|t| steps.get(t).copied())))
    }));
    let title = format!("Time of {of}");
    Figure {
        name: "time".into(),
        caption: "How far the output's time has run ahead of the input's, predicted and in the truth clip (Xia 2015, \
                  Figure 4)."
            .into(),
        svg: plots::lines(Labels { title: &title, x: "input time, s", y: "output less input time, ms" }, &all),
    }
}
