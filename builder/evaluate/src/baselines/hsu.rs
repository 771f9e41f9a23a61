//! The linear model as Hsu 2005 has it, in `f64`: frames correspond by iterative motion warping alone, each joint has as
//! many states as the singular values say, and its stability is that of subspace methods. The core's `lti` differs in all
//! three, so that it fits a board.
//!
//! | row | is |
//! |---|---|
//! | `lti-paper` | one model of all actions, from `x = 0`, unexpected input blended in by kc 3 and kp 2 (Figure 4) |
//! | `lti-paper-raw` | the same without the blend |

use gestus_core::Database;
use gestus_database::{
    build::{BuildError, BuildOptions, stretches},
    models::{
        correspond::Correspondence,
        lti::{
            self, Model,
            clip::{Options, Translated},
        },
    },
};
use gestus_motion::{body::Body, clip::Clip, corpus::Corpus};
use rayon::prelude::*;

use crate::fold::{Fold, Row, own_dofs};

/// kc and kp of eqs. 7 and 8: of the curves of Figure 4, the one that trusts the model most. The paper prints no values of
/// its own evaluations.
pub(crate) const BLEND: (f64, f64) = (3.0, 2.0);

/// The names of the rows, with the blend of each.
pub(crate) const METHODS: [(&str, Option<(f64, f64)>); 2] =
    [("lti-paper", Some(BLEND)), ("lti-paper-raw", None)];

/// A model for each output style that one can be estimated for.
pub(crate) struct Models(Vec<(usize, Model)>);

impl Models {
    /// From the clips of a database. Cost: an iterative motion warping for each cycle and style, and a subspace
    /// identification for each joint and style.
    pub(crate) fn of(corpus: &Corpus, options: &BuildOptions, styles: &[usize]) -> Result<Self, BuildError> {
        let estimate = |&style: &usize| {
            let found = stretches(corpus, options, style, Correspondence::Warped)?;
            let model = lti::estimate(&found, &[], corpus.rate_hz, &lti::n4sid::Options::paper());
            Ok(model.map(|model| (style, model)))
        };
        let models: Vec<_> = styles.par_iter().map(estimate).collect::<Result<_, BuildError>>()?;
        Ok(Self(models.into_iter().flatten().collect()))
    }

    /// The model of an output style.
    pub(crate) fn style(&self, style: usize) -> Option<&Model> {
        self.0.iter().find(|m| m.0 == style).map(|m| &m.1)
    }
}

/// A clip through a model, in the database's dofs.
pub(crate) fn translate(
    model: &Model,
    body: &Body,
    database: &Database<'_>,
    clip: &Clip,
    generalise: Option<(f64, f64)>,
) -> Translated {
    simulate(model, &body.with_means_of(database).clip_dofs(clip), generalise)
}

/// Dofs of a clip through a model.
pub(crate) fn simulate(model: &Model, dofs: &[Vec<f64>], generalise: Option<(f64, f64)>) -> Translated {
    model.translate(dofs, &Options { generalise, ..Options::default() })
}

/// Adds the rows of a fold.
pub(crate) fn rows(fold: &Fold<'_>, database: &Database<'_>, models: &Models, rows: &mut Vec<Row>) {
    let Some(model) = models.style(fold.style) else { return };
    let clip = &fold.corpus.examples[fold.test].clip;
    for (name, generalise) in METHODS {
        let out = translate(model, &fold.body, database, clip, generalise);
        let steps_s = out.warp.iter().map(|w| w / fold.corpus.rate_hz).collect();
        rows.push(fold.timed_row(name, &own_dofs(fold, database, &out.rows), steps_s));
    }
}

#[cfg(test)]
mod tests {
    use gestus_database::synth;

    use super::*;

    #[test]
    fn orders_are_the_datas_and_every_system_is_stable() {
        let corpus =
            synth::corpus(&synth::Options::of(&["walk", "run"], &["neutral", "old"], 4, 5.0)).unwrap();
        let models = Models::of(&corpus, &BuildOptions::default(), &[1]).unwrap();
        let model = models.style(1).unwrap();
        let orders: Vec<usize> = model.units.iter().map(|u| u.system.order()).collect();
        let ours = lti::n4sid::Options::default().most;
        assert!(orders.iter().any(|&n| n > ours), "no joint has more states than ours may have: {orders:?}");
        let outermost =
            model.units.iter().flat_map(|u| u.system.poles()).map(|p| p.norm()).fold(0.0, f64::max);
        assert!(outermost < 1.0, "{outermost}");
    }
}
