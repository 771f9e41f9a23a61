//! The comparison in words and bars.

use gestus_motion::statistics::mean;

use crate::{
    plots::{self, Labels},
    report::{html::Figure, table},
};

/// A key's mean over the rows of a method in a set; `None` where it has none.
fn mean_of(rows: &[table::Row], set: &str, method: &str, key: &str) -> Option<f64> {
    let of = rows.iter().filter(|r| r["set"] == set && r["method"] == method);
    Some(mean(of.filter_map(|r| r.get(key)?.as_f64()))).filter(|mean| !mean.is_nan())
}

const SETS: [&str; 9] = [
    "homogeneous",
    "heterogeneous",
    "stream",
    "homogeneous-exact",
    "heterogeneous-exact",
    "stream-exact",
    "homogeneous-generated",
    "heterogeneous-generated",
    "stream-generated",
];

/// Errors of each method by set, as in Xia 2015, Table 3 and Figure 6.
pub(super) fn bars(rows: &[table::Row], key: &str, title: &str, unit: &str) -> Figure {
    let methods = [
        "unchanged",
        "global-affine",
        "global-affine-unlabelled",
        "gaussian-process",
        "gaussian-process-unlabelled",
        "statistic",
        "statistic-labelled",
        "lti",
        "lti-labelled",
        "knn",
        "knn-unlabelled",
        "local-ar",
        "mixture",
    ];
    let sets: Vec<String> =
        SETS.iter().filter(|s| rows.iter().any(|r| r["set"] == **s)).map(|s| (*s).to_owned()).collect();
    let series: Vec<(String, Vec<f64>)> = methods
        .iter()
        .filter(|m| sets.iter().any(|s| mean_of(rows, s, m, key).is_some()))
        .map(|m| ((*m).to_owned(), sets.iter().map(|s| mean_of(rows, s, m, key).unwrap_or(0.0)).collect()))
        .collect();
    Figure {
        name: key.replace('_', "-"),
        caption: format!(
            "{title} of each method, mean over test clips and styles (Xia 2015, Table 3, Figure 6)."
        ),
        svg: plots::bars(Labels { title, x: "data", y: unit }, &sets, &series),
    }
}

/// Which of both is better, and by how much.
fn better(mixture: f64, lti: f64, which: &str) -> String {
    if mixture <= lti {
        format!("the mixture is {:.0}% better than the linear model {which}", 100.0 * (1.0 - mixture / lti))
    } else {
        format!("the linear model {which} is {:.0}% better than the mixture", 100.0 * (1.0 - lti / mixture))
    }
}

/// The verdict in words: every number in it is in the table.
pub(super) fn verdict(rows: &[table::Row]) -> String {
    let mut text = String::from(
        "Every method translates clips that it has never seen; errors are mean joint distances of predicted poses, before feet are held and joints limited, \
         which only some methods do, hips-centred and facing ahead, to a held-out clip of the output style at equal canonical time, or to the exact answer. That \
         answer is one affine map for all actions, which is what linear models can say and mixtures have to learn.",
    );
    for set in SETS {
        let of = |method: &str| mean_of(rows, set, method, "joint_error_cm");
        let (Some(mixture), Some(lti)) = (of("mixture"), of("lti")) else { continue };
        text += &format!(
            " {set}: mixture {mixture:.2} cm, linear model {lti:.2} cm; {}",
            better(mixture, lti, "of all actions")
        );
        if let Some(labelled) = of("lti-labelled") {
            text += &format!("; {}", better(mixture, labelled, "of the action alone"));
        }
        if let (Some(affine), Some(statistic)) = (of("global-affine"), of("statistic")) {
            text += &format!("; the global affine map has {affine:.2} cm, statistics {statistic:.2} cm");
        }
        if let Some(affine) = of("global-affine-unlabelled") {
            text += &format!("; one affine map of all actions {affine:.2} cm");
        }
        if let Some(knn) = of("knn") {
            text += &format!("; interpolation of neighbors of the action {knn:.2} cm");
        }
        if let Some(knn) = of("knn-unlabelled") {
            text += &format!(", of all actions {knn:.2} cm");
        }
        if let Some(process) = of("gaussian-process") {
            text += &format!("; the Gaussian process of the action {process:.2} cm");
        }
        if let Some(process) = of("gaussian-process-unlabelled") {
            text += &format!(", of all actions {process:.2} cm");
        }
        let delivered = |method: &str| mean_of(rows, set, method, "delivered_error_cm");
        if let (Some(mixture), Some(lti)) = (delivered("mixture"), delivered("lti")) {
            text += &format!(". Delivered, the mixture has {mixture:.2} cm, the linear model {lti:.2} cm");
        }
        let step = |method: &str| mean_of(rows, set, method, "step_error_ms");
        if let (Some(mixture), Some(lti), Some(kept)) = (step("mixture"), step("lti"), step("statistic")) {
            text += &format!(
                ". A time step of the mixture is {mixture:.2} ms off, of the linear model {lti:.2} ms, of the input's \
                 own time {kept:.2} ms"
            );
        }
        text.push('.');
    }
    text
}
