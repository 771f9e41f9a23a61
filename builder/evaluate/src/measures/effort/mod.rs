//! Laban Effort, measured: how well it is learned, how well inputs are segmented, and whether the dial and the
//! whole-clip path reach their targets (Torresani 2006).
//!
//! The column `part` names five parts. `regression` is Torresani 2006, Table 1, on the data's own labels or estimates and
//! on generated motion that a generated annotator has labelled; `annotators` is the latter over ten corpora.
//! `segmentation` cuts streams made of fragments. `dial` is the core's dial on test clips, `clip` the whole-clip path on
//! the same.

mod dial;
mod regression;
mod segmentation;

use std::path::{Path, PathBuf};

use gestus_database::{
    build::BuildError,
    command_line::{outputs::check_outputs, progress},
    effort::{
        fragment::Library,
        labels,
        model::{BLENDS, Model, draw},
        sheet::{SEEDS, caveat, selected},
    },
};

use crate::{
    evaluation::Evaluation,
    experiment::Experiment,
    measures::{OnClips, Uses},
    metrics::annotator::Eye,
};

pub use regression::annotated;
use regression::{ANNOTATORS, CORPORA, SEED, TRAIN};
use segmentation::STREAMS;

/// Options of `gestus evaluate effort`.
#[derive(clap::Args, Debug)]
pub struct Args {
    /// Efforts that people gave: a filled-in table of `gestus effort sheet`; default: estimates
    #[arg(long)]
    labels: Option<PathBuf>,
    /// Number of random splits; standard errors need at least 2
    #[arg(long, default_value_t = 500, value_parser = splits)]
    splits: usize,
}

fn splits(text: &str) -> Result<usize, String> {
    text.parse().ok().filter(|n| *n > 0).ok_or_else(|| "a whole number of 1 or more".to_owned())
}

impl Args {
    /// With estimated Efforts and that many random splits.
    pub(super) const fn estimated(splits: usize) -> Self {
        Self { labels: None, splits }
    }
}

impl OnClips for Args {
    const USES: Uses = Uses { to: false, ..Uses::ALL };

    /// The measure writes `effort.csv`, which is also the name of a sheet: hours of labelling must not be overwritten.
    fn check(&self, output: &Path) -> anyhow::Result<()> {
        let table = output.join("effort.csv");
        Ok(check_outputs([self.labels.as_ref()], [("-o", Some(&table).filter(|_| output.is_dir()))])?)
    }

    fn evaluate(&self, experiment: &Experiment) -> anyhow::Result<Evaluation> {
        let given = match &self.labels {
            Some(path) => {
                let rows = labels::read(path, experiment.corpus.rate_hz)?;
                let annotated = |spans: &_| Library::annotated(&experiment.corpus, spans);
                Some(Model::given(&rows, &path.display().to_string(), annotated)?)
            }
            None => None,
        };
        Ok(evaluate(experiment, given, self.splits)?)
    }
}

/// Measures all parts with a model of given labels, or of estimates.
///
/// # Errors
/// [`BuildError`] where the corpus makes no database.
pub fn evaluate(
    experiment: &Experiment,
    given: Option<Model>,
    splits: usize,
) -> Result<Evaluation, BuildError> {
    let corpus = &experiment.corpus;
    let library = Library::found(corpus)?;
    let tests = experiment.test_clips();
    let model = match given {
        Some(model) => model,
        None if dial::spare(corpus, &tests) => estimated(&Library::found(&corpus.without(&tests))?),
        None => estimated(&library),
    };
    let each = splits.div_ceil(ANNOTATORS);
    let steps = CORPORA.len() * splits + ANNOTATORS * each + 3 * STREAMS + 6 * tests.len();
    let bar = progress::bar(steps, "effort");
    let tick = || bar.inc(1);
    let first = regression::generated(Eye::Descriptors, SEED)?;
    let generated = regression::generated(Eye::Force, SEED)?;
    let mut rows = Vec::new();
    for (name, model) in CORPORA.into_iter().zip([&model, &first, &generated]) {
        rows.extend(regression::regression(name, model, splits, &tick));
    }
    rows.extend(regression::annotators(each, &tick)?);
    rows.extend(segmentation::segmentation(corpus, &library, &tests, &tick));
    let (dialled, curves) = dial::dialled(experiment, &model, &tests, &tick)?;
    rows.extend(dialled);
    rows.extend(dial::clips(corpus, &model, &tests, &tick));
    bar.finish_and_clear();
    let figures =
        vec![regression::mse_figure(&rows), regression::curve_figure(&generated), dial::dial_figure(&curves)];
    Ok(Evaluation {
        what: "effort",
        about: format!(
            "Laban effort after Torresani, Hackney and Bregler 2006. {}. Regression: mean squared errors of the Effort of \
             blends over {splits} random splits of {TRAIN} to learn from and the rest to test; `gain` is by how much that is \
             less than interpolation's, with the standard error of a paired test over splits. Annotators: the same over \
             {ANNOTATORS} corpora of generated motion, the errors over corpora. Segmentation: share of frames \
             whose fragment is the right one. Dial and clip: rank correlation of the target of one factor and the same \
             factor estimated on the output, within the reach of the styles.",
            caveat(model.source)
        ),
        keys: vec!["part", "corpus", "labels", "method", "factor", "streams"],
        rows,
        figures,
    })
}

/// A model of estimates, learned as from a filled-in sheet.
fn estimated(library: &Library) -> Model {
    let library = selected(library, 4 * SEEDS);
    let draws = draw(&library, BLENDS, SEED);
    Model::estimated(library, &draws)
}
