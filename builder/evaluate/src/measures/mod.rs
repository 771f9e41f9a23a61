//! Measures, one a file. `gestus evaluate` makes a subcommand of each type that implements [`OnClips`] or
//! [`OnDatabase`]; the type's fields are the measure's own options.

use std::path::Path;

use anyhow::Result;
use gestus_core::{Config, Database, Method};
use gestus_database::stream::{Request, Streamed};
use gestus_motion::clip::Clip;

use crate::{baselines::outputs::Record, evaluation::Evaluation, experiment::Experiment};

pub mod ablation;
pub mod bilinear;
pub mod comparison;
pub mod compression;
pub mod contacts;
pub mod correspondence;
pub mod cost;
pub mod cross;
pub mod deviations;
pub mod effort;
pub mod field;
pub mod growth;
pub mod knn;
pub mod literal;
pub mod loo;
pub mod papers;
pub mod retarget;
pub mod servo;
pub mod sheets;
pub mod skate;
pub mod starts;
pub mod timing;
pub mod transfer;
pub mod transitions;

/// The streamed methods, unlabelled, by the names that rows have.
pub(crate) const METHODS: [(&str, Method); 4] = [
    ("mixture", Method::Mar),
    ("phase", Method::Phase),
    ("lti", Method::Lti),
    ("statistic", Method::Statistic),
];

/// A clip through each of [`METHODS`] whose section the database has: name, method, record and stream.
pub(crate) fn streamed<'a>(
    database: &'a Database<'_>,
    clip: &'a Clip,
    style: usize,
) -> impl Iterator<Item = (&'static str, Method, Record, Streamed)> + 'a {
    METHODS.into_iter().filter_map(move |(name, method)| {
        let request = Request { config: Config::new().method(method), ..Request::style(style as u16) };
        let (record, streamed) = Record::of_stream(database, clip, &request).ok()?;
        Some((name, method, record, streamed))
    })
}

/// A measure that builds databases from the clips of a folder.
pub trait OnClips: clap::Args {
    /// Which of the common options can have an effect.
    const USES: Uses;

    /// Which of them have one with the measure's own options.
    fn uses(&self) -> Uses {
        Self::USES
    }

    /// Checks the measure's own options before any work is done. `output` is the folder for its report.
    ///
    /// # Errors
    /// The option that can't be used.
    fn check(&self, output: &Path) -> Result<()> {
        let _ = output;
        Ok(())
    }

    /// Runs the measure.
    ///
    /// # Errors
    /// Where the clips make no database.
    fn evaluate(&self, experiment: &Experiment) -> Result<Evaluation>;
}

/// A measure of an existing database.
pub trait OnDatabase: clap::Args {
    /// Runs the measure with the clips of a folder, on any skeleton.
    ///
    /// # Errors
    /// Where no clip of the folder can be used.
    fn evaluate(&self, database: &Database<'_>, folder: &Path) -> Result<Evaluation>;
}

/// The common options that a measure of clips uses. The command accepts the others too, so that one line can serve
/// several measures, and says that they have no effect.
#[derive(Debug, Clone, Copy)]
pub struct Uses {
    /// `--from`: the input style.
    pub from: bool,
    /// `--to`: the output styles.
    pub to: bool,
    /// `--folds`: test clips of each action.
    pub folds: bool,
    /// `--groups`: joint groups of the database.
    pub groups: bool,
}

impl Uses {
    /// Of a measure that translates held-out clips into other styles.
    pub const ALL: Self = Self { from: true, to: true, folds: true, groups: true };
    /// Of a measure that looks at all clips alike.
    pub const NONE: Self = Self { from: false, to: false, folds: false, groups: false };
}
