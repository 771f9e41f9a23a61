//! Models the instructions of a step, stage by stage, from the counts in its report.
//!
//! A stage's instructions are a sum of terms: units of work times instructions a unit. The latter were fitted to counts
//! of emulated boards (`cargo run --release -p gestus-firmware-sim --example calibrate`; figures in
//! `docs/experiments/boards.md`):
//!
//! ```text
//! query       q · J W F                        J joints, W frames of the window, F features
//! search      s₁ · visits F + s₂ · classes searched
//! decode      d · n D · Σ (2 + 3 S) / 5        n examples of all classes used, D dofs; the sum is over the mixes, S is
//!                                               the outputs of a mix: one or two a style, as the database has
//! regression  (r₁ · n D + r₂ · c D) · M        c classes used, M mixes of output styles
//! timing      (t₁ · n + t₂ · c) · M
//! rest        e₁ · J + e₂ · n M + e₃ · classes searched
//! contacts    v · voters       the nearest examples, 160 at most
//! lock        f
//! ```
//!
//! Examples are unpacked and fitted once for each mix of output styles: that of the body, and those that joint groups
//! have of their own ([`Request::mixes`](crate::stream::Request::mixes)). An example unpacks two rows of the
//! input and three, sometimes four, of each output.
//!
//! These are the terms of the mixture. The other methods share the query (phase tables alone) and the lock with it;
//! the rest of their terms are their own:
//!
//! ```text
//! phase       search       s₁ · knots compared F + s₂ · classes compared + s₃ · F²
//!             regression   r · tables added D     for each class used, that of the input and of each style
//!             rest         e · J
//! lti         rest         e₁ · bytes of the models in use + e₂ · J
//! statistic   rest         e₁ · J + e₂ · J S      S output styles
//! ```
//!
//! [`super::worst`] bounds the cost of any frame of the mixture by its sum with the most work that a step can have.

use crate::stream::Request;
use gestus_core::{
    Database, Method, Report, Stage,
    methods::{
        mixture::contact_votes,
        work::{Load, Work},
    },
};

/// Terms of the sums above.
pub const TERMS: usize = 22;
const QUERY: usize = 0;
const LOCK: usize = 12;
/// Where the terms of each other method begin.
const PHASE: usize = 13;
const LINEAR: usize = 18;
const STATISTIC: usize = 20;

/// The stage of each term.
pub const STAGE_OF: [Stage; TERMS] = [
    Stage::Query,
    Stage::Search,
    Stage::Search,
    Stage::Decode,
    Stage::Regression,
    Stage::Regression,
    Stage::Timing,
    Stage::Timing,
    Stage::Rest,
    Stage::Rest,
    Stage::Rest,
    Stage::Contacts,
    Stage::Lock,
    Stage::Search,
    Stage::Search,
    Stage::Search,
    Stage::Regression,
    Stage::Rest,
    Stage::Rest,
    Stage::Rest,
    Stage::Rest,
    Stage::Rest,
];

/// Rows that an example unpacks of the input, and of each output.
const ROWS_INPUT: f64 = 2.0;
const ROWS_OUTPUT: f64 = 3.0;

/// Units of work of a step, term by term.
pub type Units = [f64; TERMS];

/// The counts of a database from which [`Units`] follow, besides the work of a step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Size {
    /// Joints J.
    pub joints: f64,
    /// Dofs D.
    pub dofs: f64,
    /// Components F of a feature.
    pub features: f64,
    /// Frames W of the query window.
    pub window: f64,
}

impl Size {
    /// Of a database.
    pub fn of(database: &Database<'_>) -> Self {
        let counts = database.counts();
        let [joints, dofs, features, window] =
            [counts.joints, counts.dofs, counts.features, counts.window].map(|count| count as f64);
        Self { joints, dofs, features, window }
    }

    /// The units of a step of the mixture, term by term.
    pub fn mixture(&self, work: &Work) -> Units {
        let Self { joints, dofs, features, window } = *self;
        let [searched, distances, classes, examples, voters, mixes, outputs] = [
            work.searched,
            work.distances,
            work.classes,
            work.examples,
            work.voters,
            work.mixes,
            work.outputs,
        ]
        .map(f64::from);
        // Of an example in all mixes, relative to an example with one output.
        let rows = (ROWS_INPUT * mixes + ROWS_OUTPUT * outputs) / (ROWS_INPUT + ROWS_OUTPUT);
        let mut units = [0.0; TERMS];
        units[..PHASE].copy_from_slice(&[
            joints * window * features,
            distances * features,
            searched,
            examples * dofs * rows,
            examples * mixes * dofs,
            classes * mixes * dofs,
            examples * mixes,
            classes * mixes,
            joints,
            examples * mixes,
            searched,
            voters,
            1.0,
        ]);
        units
    }
}

/// The settings of a request on which the work of a step depends.
pub fn load(database: &Database<'_>, request: &Request) -> Load {
    let mixes = request.mixes(database.counts().groups);
    let styles = mixes.iter().sum::<usize>() as u32;
    Load { action: request.action, input_style: request.input_style, mixes: mixes.len() as u32, styles }
}

/// The units of a step under a request.
pub fn units(database: &Database<'_>, request: &Request, report: &Report) -> Units {
    let size = Size::of(database);
    let Size { joints, dofs, features, window } = size;
    let load = load(database, request);
    let styles = f64::from(load.styles);
    let mut units = [0.0; TERMS];
    units[LOCK] = 1.0;
    match request.config.method {
        Method::Mar => return size.mixture(&work(database, request, report)),
        Method::Phase => {
            // Classes differ little in their knots, and the report counts those of the classes that were compared.
            let most = database.worst_step_of(&request.config, &load);
            let compared = f64::from(report.visits) / f64::from(most.distances.max(1));
            units[QUERY] = joints * window * features;
            units[PHASE..LINEAR].copy_from_slice(&[
                f64::from(report.visits) * features,
                compared * f64::from(most.searched),
                features * features,
                report.classes.len() as f64 * (1.0 + styles) * dofs,
                joints,
            ]);
        }
        Method::Lti => {
            units[LINEAR..STATISTIC].copy_from_slice(&[f64::from(report.bytes_read), joints]);
        }
        Method::Statistic => {
            units[STATISTIC..].copy_from_slice(&[joints, joints * styles]);
        }
    }
    units
}

/// The work of a step of the mixture.
fn work(database: &Database<'_>, request: &Request, report: &Report) -> Work {
    let k = request.config.k;
    let each =
        || report.classes.iter().map(|s| database.class(usize::from(s.class)).k_cap.min(usize::from(k)));
    let voters = contact_votes::voters(report.classes.len());
    let most = database.worst_step_of(&request.config, &load(database, request));
    Work {
        distances: report.visits,
        classes: report.classes.len() as u32,
        examples: each().sum::<usize>() as u32,
        voters: each().map(|n| n.min(voters)).sum::<usize>() as u32,
        bytes_read: report.bytes_read,
        // Every class that the labels allow, and the mixes of styles.
        ..most
    }
}

/// Instructions a unit of work, term by term.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct UnitCosts(pub [f64; TERMS]);

impl UnitCosts {
    /// Instructions of a step by stage.
    pub fn stages(&self, units: &Units) -> [f64; Stage::NAMES.len()] {
        let mut stages = [0.0; Stage::NAMES.len()];
        for ((cost, unit), stage) in self.0.iter().zip(units).zip(STAGE_OF) {
            stages[stage as usize] += cost * unit;
        }
        stages
    }

    /// Instructions of a step.
    pub fn total(&self, units: &Units) -> f64 {
        self.stages(units).iter().sum()
    }
}
