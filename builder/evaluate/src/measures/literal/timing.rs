//! Time steps by neighbors of the timing's own: of the class, those nearest in pose and change of the input and of the
//! output that has just been synthesized (Xia 2015, section 5.1).

use gestus_core::{Config, Database};
use gestus_database::stream::Streamed;
use gestus_motion::statistics::{mean, variance};

use super::names::named;
use crate::{
    baselines::outputs::{Example, Record},
    fold::Fold,
    report::table,
};

/// A dof of the metric, and the weights of squared differences of its value and of its change.
type Term = (usize, f64, f64);

/// Steps of the core and by each metric, against the truth's.
pub(super) fn rows(
    fold: &Fold<'_>,
    database: &Database<'_>,
    class: usize,
    examples: &[Example],
    (record, streamed): (&Record, &Streamed),
) -> Vec<table::Row> {
    let truth = fold.true_steps();
    let steps: Vec<f64> = examples.iter().map(|e| step_s(database, class, e.row, fold.style)).collect();
    let named_dofs: Vec<Term> = (0..database.counts().timing)
        .map(|i| database.timing(i))
        .map(|t| (t.dof, f64::from(t.pose), f64::from(t.change)))
        .collect();
    let most = usize::from(Config::paper().k).min(database.class(class).k_cap);
    let own = |metric: &[Term]| -> Vec<Option<f64>> {
        (0..record.x.len())
            .map(|t| {
                let before = t.checked_sub(1)?;
                let at = [&record.x[t], &record.x[before], &record.predicted[t], &record.predicted[before]];
                Some(predicted((metric, most), examples, &steps, at))
            })
            .collect()
    };
    let core = streamed.steps.iter().map(|s| Some(f64::from(s.report.predicted_step_s))).collect();
    [("core", core), ("own", own(&named_dofs)), ("own-all-dofs", own(&all_dofs(examples)))]
        .into_iter()
        .map(|(option, found): (&str, Vec<Option<f64>>)| {
            let compared: Vec<(f64, f64)> =
                found.iter().zip(&truth).filter_map(|(found, truth)| Some(((*found)?, (*truth)?))).collect();
            let [ours, theirs] = [0, 1].map(|i| compared.iter().map(|c| [c.0, c.1][i]).sum::<f64>());
            let mut row = named(fold, "timing", "local-ar", option);
            row.insert(
                "step_error_ms".into(),
                mean(compared.iter().map(|c| 1000.0 * (c.0 - c.1).abs())).into(),
            );
            row.insert("duration_error".into(), (ours / theirs - 1.0).abs().into());
            row
        })
        .collect()
}

/// Seconds from `y[t-1]` to `y[t]` of a row, a mean over its outputs.
fn step_s(database: &Database<'_>, class: usize, row: usize, style: usize) -> f64 {
    let cycle = database.cycle_of(class, row);
    mean(cycle.into_iter().flat_map(|c| database.counterparts(c, row, style)).map(|c| f64::from(c.step_s)))
}

/// Every dof, its value and its change each by its variance over the examples.
fn all_dofs(examples: &[Example]) -> Vec<Term> {
    let dofs = examples.first().map_or(0, |e| e.x.len());
    let weight = |of: &dyn Fn(&Example) -> f64| 1.0 / variance(examples.iter().map(of)).max(1e-6);
    (0..dofs).map(|d| (d, weight(&|e| e.x[d]), weight(&|e| e.x[d] - e.x_prev[d]))).collect()
}

/// The step at `[x[t], x[t-1], y[t], y[t-1]]`: of the nearest `most`, weighted by a Gaussian.
fn predicted(
    (metric, most): (&[Term], usize),
    examples: &[Example],
    steps: &[f64],
    at: [&Vec<f64>; 4],
) -> f64 {
    let distance2 = |e: &Example| {
        let theirs = [&e.x, &e.x_prev, &e.y, &e.y_prev];
        let of = |&(d, pose, change): &Term| {
            let [x, x_prev, y, y_prev] = [0, 1, 2, 3].map(|i| at[i][d] - theirs[i][d]);
            pose * (x * x + y * y) + change * ((x - x_prev).powi(2) + (y - y_prev).powi(2))
        };
        metric.iter().map(of).sum::<f64>()
    };
    let mut near: Vec<(f64, f64)> = examples.iter().map(distance2).zip(steps.iter().copied()).collect();
    near.sort_by(|a, b| a.0.total_cmp(&b.0));
    near.truncate(most);
    let (least, width) = (
        near[0].0,
        2.0 * f64::from(Config::paper().timing_width) * mean(near.iter().map(|n| n.0)).max(1e-20),
    );
    let weight = |distance2: f64| (-(distance2 - least) / width).exp();
    let total: f64 = near.iter().map(|n| weight(n.0)).sum();
    near.iter().map(|n| weight(n.0) * n.1).sum::<f64>() / total
}
