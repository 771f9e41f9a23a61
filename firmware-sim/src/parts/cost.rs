//! What a frame costs: instructions by stage from what a step counts.
//!
//! A stage's instructions are a sum of units of work times a price a unit, which was fitted to the counts of an
//! emulated board (`cargo run --release -p gestus-firmware-sim --example calibrate`, figures in
//! `docs/experiments/boards.md`):
//!
//! ```text
//! query       q · J W F                        J joints, W frames of the window, F features
//! search      s₁ · visits F + s₂ · classes searched
//! decode      d · n D · Σ (2 + 3 S) / 5        n examples over all classes used, D dofs, S outputs of a mix: of each
//!                                               style one, or two where the database has two
//! regression  (r₁ · n D + r₂ · c D) · M        c classes used, M mixes of output styles
//! timing      (t₁ · n + t₂ · c) · M
//! rest        e₁ · J + e₂ · n M + e₃ · classes searched
//! contacts    v · voters       the nearest of them, 160 at most
//! lock        f
//! ```
//!
//! Examples are unpacked and fitted once for each mix: the body's styles, and those that joint groups have of their own
//! ([`Request::mixes`](gestus_database::stream::Request::mixes)). Of an example's rows two are the input's and three,
//! sometimes four, those of an output style.
//!
//! The most that any frame can cost is the same sum with the most units that a step can have: [`super::worst`].

use gestus_core::{Database, Report, Stage, methods::mixture::contact_votes};
use gestus_database::stream::Request;

/// Terms of the sums above.
pub const TERMS: usize = 13;

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
];

/// Rows that an example unpacks: of the input, and of each output style.
const ROWS_INPUT: f64 = 2.0;
const ROWS_OUTPUT: f64 = 3.0;

/// Units of work of a step, term by term.
pub type Units = [f64; TERMS];

/// What a step works through: the counts behind [`Units`].
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
    /// Examples unpacked, over all of them.
    pub examples: f64,
    /// Examples that vote for contacts.
    pub voters: f64,
    /// Mixes of output styles.
    pub mixes: f64,
    /// Rows of an example in all of them, in those of an example with one output style.
    pub rows: f64,
}

/// Outputs that an example has in each mix of styles under a request: one a style, or two where the database has two.
pub fn outputs(database: &Database<'_>, request: &Request) -> Vec<usize> {
    let styles = request.mixes(database.counts().groups).into_iter();
    styles.map(|styles| styles * database.outputs()).collect()
}

/// Rows of an example in mixes of so many output styles, in those of an example with one.
pub fn rows(mixes: &[usize]) -> f64 {
    let of_mix = |&styles: &usize| ROWS_INPUT + ROWS_OUTPUT * styles as f64;
    mixes.iter().map(of_mix).sum::<f64>() / (ROWS_INPUT + ROWS_OUTPUT)
}

impl Work {
    /// The units, term by term.
    pub fn units(&self) -> Units {
        let (fitted, used) = (self.examples * self.mixes, self.used * self.mixes);
        [
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
        ]
    }
}

/// The units of a step under a request.
pub fn units(database: &Database<'_>, request: &Request, report: &Report) -> Units {
    let (labels, k) = ((request.action, request.input_style), request.config.k);
    let counts = database.counts();
    let number = |value: usize| value as f64;
    let allowed = |class: &gestus_core::blob::Class| {
        labels.0.is_none_or(|a| a == class.action) && labels.1.is_none_or(|s| s == class.style)
    };
    let each =
        || report.classes.iter().map(|s| database.class(usize::from(s.class)).k_cap.min(usize::from(k)));
    let mixes = outputs(database, request);
    let voters = contact_votes::voters(report.classes.len());
    let examples: usize = each().sum();
    let work = Work {
        joints: number(counts.joints),
        dofs: number(counts.dofs),
        features: number(counts.features),
        window: number(counts.window),
        searched: number(database.classes().filter(allowed).count()),
        visits: f64::from(report.visits),
        used: number(report.classes.len()),
        examples: number(examples),
        voters: number(each().map(|n| n.min(voters)).sum()),
        mixes: number(mixes.len()),
        rows: rows(&mixes),
    };
    work.units()
}

/// Instructions a unit, term by term.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Prices(pub [f64; TERMS]);

impl Prices {
    /// Instructions of a step by stage.
    pub fn stages(&self, units: &Units) -> [f64; Stage::NAMES.len()] {
        let mut stages = [0.0; Stage::NAMES.len()];
        for ((price, unit), stage) in self.0.iter().zip(units).zip(STAGE_OF) {
            stages[stage as usize] += price * unit;
        }
        stages
    }

    /// Instructions of a step.
    pub fn total(&self, units: &Units) -> f64 {
        self.stages(units).iter().sum()
    }
}
