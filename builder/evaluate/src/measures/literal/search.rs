//! Neighbors by point clouds, and what the model and interpolation make of them.

use std::collections::BTreeSet;

use gestus_core::{Config, Database};
use gestus_motion::statistics::mean;

use super::names::named;
use crate::{
    baselines::{
        clouds::{CloudSearch, Comparison},
        local_ar::translate,
        outputs::{Example, Outputs, Record, interpolated},
    },
    fold::{Fold, own_dofs},
    report::table,
};

/// The ways in which clouds are compared, by name.
const OPTIONS: [(&str, Comparison); 4] = [
    ("mean-cloud", Comparison { pairwise: false, tapered: false, legs: false }),
    ("tapered", Comparison { pairwise: false, tapered: true, legs: false }),
    ("pairwise", Comparison { pairwise: true, tapered: false, legs: false }),
    ("pairwise-tapered", Comparison { pairwise: true, tapered: true, legs: false }),
];

/// Neighbors of each frame: row and squared distance.
type Neighbors = Vec<Vec<(usize, f32)>>;

/// Rows of the local autoregressive model and of interpolation over the neighbors of each search.
pub(super) fn rows(
    fold: &Fold<'_>,
    database: &Database<'_>,
    class: usize,
    examples: &[Example],
    record: &Record,
) -> Vec<table::Row> {
    let config = Config::paper();
    let body = fold.body.with_means_of(database);
    let clip = &fold.corpus.examples[fold.test].clip;
    let core: Neighbors = record
        .neighbors
        .iter()
        .map(|classes| classes.iter().find(|c| c.0 == class).map_or_else(Vec::new, |c| c.1.clone()))
        .collect();
    // A small class has fewer, whatever the search.
    let most = usize::from(config.k).min(database.class(class).k_cap);
    let mut searches = vec![("core", core.clone())];
    for (option, comparison) in OPTIONS {
        let found = CloudSearch::of(database, &body, &[class], comparison).nearest(clip, most);
        let narrow = |near: Vec<(usize, f64)>| near.into_iter().map(|(r, d)| (r, d as f32)).collect();
        searches.push((option, found.into_iter().map(narrow).collect()));
    }
    let mut rows = Vec::new();
    for (option, near) in searches {
        let shared = mean(near.iter().zip(&core).map(|(near, core)| share(near, core)));
        let variables: Vec<Vec<&Example>> = near
            .iter()
            .map(|near| near.iter().filter_map(|&(r, _)| example_of(examples, r)).collect())
            .collect();
        let mut last = Vec::new();
        let knn: Vec<Vec<f64>> = near
            .into_iter()
            .map(|near| {
                let found = interpolated(database, &[&(class, near)], usize::MAX, fold.style, Outputs::Mean);
                last = found.unwrap_or_else(|| last.clone());
                last.clone()
            })
            .collect();
        for (method, output) in [("local-ar", translate(&config, &record.x, &variables)), ("knn", knn)] {
            let figures = fold.row(method, &own_dofs(fold, database, &output), None).predicted;
            let mut row = named(fold, "search", method, option);
            row.insert("joint_error_cm".into(), figures.error_cm.into());
            row.insert("variability".into(), figures.variability.into());
            row.insert("third_difference".into(), figures.third_difference.into());
            row.insert("shared".into(), shared.into());
            rows.push(row);
        }
    }
    rows
}

/// The variables of a row.
fn example_of(examples: &[Example], row: usize) -> Option<&Example> {
    examples.binary_search_by_key(&row, |e| e.row).ok().map(|at| &examples[at])
}

/// Share of the core's neighbors that are among some.
fn share(near: &[(usize, f32)], core: &[(usize, f32)]) -> f64 {
    let found: BTreeSet<usize> = near.iter().map(|n| n.0).collect();
    core.iter().filter(|n| found.contains(&n.0)).count() as f64 / core.len().max(1) as f64
}
