//! Models that need no frames at run time.
//!
//! [`correspond`] finds corresponding frames of the input style and an output style; [`lti`] estimates linear
//! time-invariant models from them (Hsu 2005). [`statistic`] computes means and standard deviations of each style, which
//! need no pairs. [`footplant`] fits the detection of foot contacts for both. [`bilinear`] makes looped walks of any style
//! and speed for `gestus loop`; they are not stored in a blob.

pub mod bilinear;
pub mod correspond;
pub mod footplant;
pub mod lti;
pub(crate) mod numbers;
pub mod phase;
pub mod statistic;

use rayon::prelude::*;

use correspond::{Aligned, Pairs};
use footplant::Footplant;
use gestus_motion::{body::Body, corpus::Example};
use lti::{n4sid, section::Labelled};
use statistic::table::Table;

/// Which models are built.
#[derive(Debug, Clone)]
pub struct Wanted<'a> {
    /// The style that linear models take.
    pub from: usize,
    /// Names of all styles.
    pub styles: &'a [String],
    /// One model and table for each action, too.
    pub by_action: bool,
    /// Rounds towards the geodesic mean of rotations.
    pub rounds: usize,
}

/// The models' sections; `None` where one is left out.
#[derive(Debug, Default)]
pub struct Sections {
    /// Linear models.
    pub lti: Option<Vec<u8>>,
    /// Statistics of each style.
    pub statistic: Option<Vec<u8>>,
}

/// Estimates the models. `examples` are the clips of the blob with their dofs, sorted by class. A model that can't be
/// estimated is left out, with a line in `notes`.
pub fn sections(
    body: &Body,
    examples: &[(&Example, &[Vec<f64>])],
    pairs: &Pairs<'_>,
    wanted: &Wanted<'_>,
    notes: &mut Vec<String>,
) -> Sections {
    let lti = match linear(pairs, wanted) {
        Ok(models) => Some(lti::section::section(wanted.from, &models)),
        Err(style) => {
            notes.push(format!(
                "no linear models (`--method lti`): the clips of the style {} are too few or too short; add longer clips",
                wanted.styles[style]
            ));
            None
        }
    };
    let mut actions: Vec<Option<usize>> = vec![None];
    if wanted.by_action {
        let mut all: Vec<usize> = examples.iter().map(|(e, _)| e.action).collect();
        all.sort_unstable();
        all.dedup();
        actions.extend(all.into_iter().map(Some));
    }
    let of = |style: Option<usize>, action: Option<usize>| -> Vec<(&Example, &[Vec<f64>])> {
        let is_of = |e: &Example| style.is_none_or(|s| e.style == s) && action.is_none_or(|a| e.action == a);
        examples.iter().filter(|(e, _)| is_of(e)).copied().collect()
    };
    let feet: Vec<[Footplant; 2]> =
        actions.par_iter().map(|&action| statistic::table::feet(&of(None, action))).collect();
    let labels: Vec<_> =
        (0..wanted.styles.len()).flat_map(|s| actions.iter().zip(&feet).map(move |a| (s, a))).collect();
    let tables: Vec<Table> = labels
        .into_par_iter()
        .map(|(style, (&action, feet))| {
            Table::of(body, (style, action), &of(Some(style), action), feet, wanted.rounds)
        })
        .collect();
    let tables = statistic::table::floored(tables, wanted.from);
    Sections { lti, statistic: Some(statistic::table::section(wanted.from, &tables)) }
}

/// A model for each output style, or the first style without one as the error.
fn linear(pairs: &Pairs<'_>, wanted: &Wanted<'_>) -> Result<Vec<Labelled>, usize> {
    let mut models = Vec::new();
    let options = n4sid::Options::default();
    let outputs = || (0..wanted.styles.len()).filter(|&s| s != wanted.from);
    for style in outputs() {
        let stretches = correspond::align(pairs, wanted.from, style);
        let others: Vec<Aligned> =
            outputs().flat_map(|other| correspond::align(pairs, other, style)).collect();
        let estimate = |stretches: &[Aligned], others: &[Aligned]| {
            lti::estimate(stretches, others, pairs.rate_hz, &options).filter(lti::Model::is_usable)
        };
        models.push(Labelled { style, action: None, model: estimate(&stretches, &others).ok_or(style)? });
        let mut actions: Vec<usize> = stretches.iter().map(|s| s.action).collect();
        actions.sort_unstable();
        actions.dedup();
        for action in actions.into_iter().filter(|_| wanted.by_action) {
            let of_action = |all: &[Aligned]| -> Vec<Aligned> {
                all.iter().filter(|s| s.action == action).cloned().collect()
            };
            // An action with too little to learn from is served by the model of all.
            let model = estimate(&of_action(&stretches), &of_action(&others));
            models.extend(model.map(|model| Labelled { style, action: Some(action), model }));
        }
    }
    Ok(models)
}
