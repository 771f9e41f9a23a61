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
//! have of their own ([`Request::mixes`](gestus_database::stream::Request::mixes)). An example unpacks two rows of the
//! input and three, sometimes four, of each output.
//!
//! These are the terms of the mixture. The other methods share the query (tables by phase alone) and the lock with it;
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
//! [`super::worst`] bounds the cost of any frame of the mixture by its sum with the most units that a step can have.

use gestus_core::{Database, Method, Report, Stage, methods::mixture::contact_votes};
use gestus_database::stream::Request;

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

/// The counts from which [`Units`] follow.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Work {
    /// Joints J.
    pub joints: f64,
    /// Dofs D.
    pub dofs: f64,
    /// Components F of a feature.
    pub features: f64,
    /// Frames W of the query window.
    pub window: f64,
    /// Classes searched.
    pub searched: f64,
    /// Distances computed.
    pub visits: f64,
    /// Classes unpacked.
    pub used: f64,
    /// Examples unpacked, of all classes.
    pub examples: f64,
    /// Examples that vote for contacts.
    pub voters: f64,
    /// Mixes of output styles.
    pub mixes: f64,
    /// Rows of an example in all mixes, relative to an example with one output.
    pub rows: f64,
}

/// Number of outputs of an example in each mix of styles of a request: one or two a style, as the database has.
pub fn outputs(database: &Database<'_>, request: &Request) -> Vec<usize> {
    let styles = request.mixes(database.counts().groups).into_iter();
    styles.map(|styles| styles * database.outputs()).collect()
}

/// Rows of an example in mixes with these numbers of outputs, relative to an example with one output.
pub fn rows(mixes: &[usize]) -> f64 {
    let of_mix = |&styles: &usize| ROWS_INPUT + ROWS_OUTPUT * styles as f64;
    mixes.iter().map(of_mix).sum::<f64>() / (ROWS_INPUT + ROWS_OUTPUT)
}

impl Work {
    /// The units of the mixture, term by term.
    pub fn units(&self) -> Units {
        let (fitted, used) = (self.examples * self.mixes, self.used * self.mixes);
        let mut units = [0.0; TERMS];
        units[..PHASE].copy_from_slice(&[
            self.joints * self.window * self.features,
            self.visits * self.features,
            self.searched,
            self.examples * self.dofs * self.rows,
            fitted * self.dofs,
            used * self.dofs,
            fitted,
            used,
            self.joints,
            fitted,
            self.searched,
            self.voters,
            1.0,
        ]);
        units
    }
}

/// The units of a step under a request.
pub fn units(database: &Database<'_>, request: &Request, report: &Report) -> Units {
    let counts = database.counts();
    let [joints, dofs, features, used] =
        [counts.joints, counts.dofs, counts.features, report.classes.len()].map(|count| count as f64);
    let mut units = [0.0; TERMS];
    units[LOCK] = 1.0;
    match request.config.method {
        Method::Mar => return work(database, request, report).units(),
        Method::Phase => {
            let styles: usize = request.mixes(counts.groups).iter().sum();
            units[QUERY] = joints * counts.window as f64 * features;
            units[PHASE..LINEAR].copy_from_slice(&[
                f64::from(report.visits) * features,
                searched(database, request),
                features * features,
                used * (1 + styles) as f64 * dofs,
                joints,
            ]);
        }
        Method::Lti => {
            units[LINEAR..STATISTIC].copy_from_slice(&[f64::from(report.bytes_read), joints]);
        }
        Method::Statistic => {
            let styles: usize = request.mixes(counts.groups).iter().sum();
            units[STATISTIC..].copy_from_slice(&[joints, joints * styles as f64]);
        }
    }
    units
}

/// Number of classes that the labels of a request allow.
fn searched(database: &Database<'_>, request: &Request) -> f64 {
    let labels = (request.action, request.input_style);
    let allowed = |class: &gestus_core::blob::Class| {
        labels.0.is_none_or(|a| a == class.action) && labels.1.is_none_or(|s| s == class.style)
    };
    database.classes().filter(allowed).count() as f64
}

/// The work of a step of the mixture.
fn work(database: &Database<'_>, request: &Request, report: &Report) -> Work {
    let k = request.config.k;
    let counts = database.counts();
    let number = |value: usize| value as f64;
    let each =
        || report.classes.iter().map(|s| database.class(usize::from(s.class)).k_cap.min(usize::from(k)));
    let mixes = outputs(database, request);
    let voters = contact_votes::voters(report.classes.len());
    let examples: usize = each().sum();
    Work {
        joints: number(counts.joints),
        dofs: number(counts.dofs),
        features: number(counts.features),
        window: number(counts.window),
        searched: searched(database, request),
        visits: f64::from(report.visits),
        used: number(report.classes.len()),
        examples: number(examples),
        voters: number(each().map(|n| n.min(voters)).sum()),
        mixes: number(mixes.len()),
        rows: rows(&mixes),
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
