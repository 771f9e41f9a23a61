//! Upper bound of the instructions of a frame, known before anything is streamed, from the capacities and limits of a
//! board.
//!
//! The code bounds the work of a frame. Searching C classes computes at most C V + 448 distances, V being
//! `Config::visits`: after a jump a class is searched again, with the visits that the others have not used and at most
//! 448 more. Each kept class unpacks and fits at most K examples. At most `Config::classes` classes are kept, and at
//! most 2 at the start of the stream or if most of the database's C₀ classes have jumped. With G = min(classes, C) and
//! G₂ = min(G, 2), a frame is one of
//!
//! ```text
//! first       C V visits              G₂ + 1 classes unpacked (the nearest twice)
//! follow      C V + 448 visits        G
//! ```
//!
//! Every example is unpacked and fitted once for each mix of output styles (the body's, and those of joint groups). The
//! bound is the sum of [`cost`](super::cost) over those units, each stage times the largest ratio of counted to
//! modelled instructions on worst-case streams (`Calibration::worst`; `docs/PORTING.md`, "The worst frame"). So the
//! units are proven, and the costs a unit are measured, with a margin; `cargo xtask budget` checks the bound on
//! emulated boards in several configurations. Classes of at most V rows are searched exhaustively, once.

use gestus_core::{
    Config, Database,
    methods::mixture::{
        contact_votes::MOST_VOTERS,
        weights::{MAX_KEPT, MAX_KEPT_ANEW},
    },
    search::graph::MAX_VISITS,
};
use gestus_database::stream::Request;

use super::{
    calibration::Isa,
    cost::{Work, outputs, rows},
};

/// Additional visits of a frame in which classes are searched again, as in the core.
const EXTRA_VISITS: usize = MAX_VISITS as usize;

/// The capacities that are in use on a board, and the limits of a frame.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Shape {
    /// Joints J of the database; its dofs are 3 J + 4.
    pub joints: usize,
    /// Components of a feature.
    pub features: usize,
    /// Frames of the query window.
    pub window: usize,
    /// Classes of the database, searched or not.
    pub classes: usize,
    /// Rows of each class that is searched.
    pub searched: Vec<usize>,
    /// Neighbors a class.
    pub k: usize,
    /// Most distances computed in a class in a frame ([`Config::visits`]).
    pub visits: usize,
    /// Most classes kept in a frame ([`Config::classes`]).
    pub kept: usize,
    /// Outputs of an example in each mix of styles: that of the body, and those of joint groups.
    pub mixes: Vec<usize>,
}

impl Shape {
    /// The shape of J joints, K neighbors and C classes that are all searched, with one output style, a database with
    /// two outputs a cycle, as `gestus build` makes it, and the default configuration. For planning a board.
    pub fn new(joints: usize, k: usize, classes: usize) -> Self {
        let visits = Config::new().visits;
        Self {
            joints,
            features: gestus_core::blob::layout::MAX_FEATURES,
            window: gestus_core::blob::layout::MAX_WINDOW,
            classes,
            searched: vec![usize::MAX; classes],
            k,
            visits: usize::from(visits),
            kept: MAX_KEPT,
            mixes: vec![2],
        }
    }

    /// The shape of a database under a request.
    pub fn of(database: &Database<'_>, request: &Request) -> Self {
        let Request { config, action, input_style, .. } = request;
        let counts = database.counts();
        let allowed = |class: &gestus_core::blob::Class| {
            action.is_none_or(|a| a == class.action) && input_style.is_none_or(|s| s == class.style)
        };
        let (k, visits) = (config.k, config.visits);
        Self {
            joints: counts.joints,
            features: counts.features,
            window: counts.window,
            classes: counts.classes,
            searched: database.classes().filter(allowed).map(|c| c.rows).collect(),
            k: usize::from(k),
            visits: usize::from(visits),
            kept: usize::from(config.classes),
            mixes: outputs(database, request),
        }
    }

    /// The work of the two candidates for the worst frame: the first of a stream, and a later one.
    pub fn work(&self) -> [Work; 2] {
        let searched = self.searched.len();
        let kept = self.kept.min(searched);
        // Small classes are searched exhaustively, once. They are never searched again, and leave visits to others.
        let visits: usize = self.searched.iter().map(|&rows| rows.min(self.visits)).sum();
        let large = self.searched.iter().filter(|&&rows| rows > self.visits).count();
        let spare = EXTRA_VISITS + searched * self.visits - visits;
        let again = spare.min(large * self.visits);
        let work = |visits: usize, used: usize| Work {
            joints: self.joints as f64,
            dofs: (3 * self.joints + 4) as f64,
            features: self.features as f64,
            window: self.window as f64,
            searched: searched as f64,
            visits: visits as f64,
            used: used as f64,
            examples: (used * self.k) as f64,
            voters: (used * self.k).min(MOST_VOTERS) as f64,
            mixes: self.mixes.len() as f64,
            rows: rows(&self.mixes),
        };
        let first = kept.min(MAX_KEPT_ANEW) + usize::from(searched > 0);
        [work(visits, first), work(visits + again, kept)]
    }

    /// Upper bound of the instructions of a frame; `None` for an instruction set without measurements on worst-case
    /// streams.
    pub fn bound(&self, isa: Isa) -> Option<f64> {
        let calibration = isa.calibration();
        let worst = calibration.worst?;
        let cost = |work: &Work| -> f64 {
            calibration
                .unit_costs
                .stages(&work.units())
                .iter()
                .zip(worst)
                .map(|(stage, ratio)| stage * ratio)
                .sum()
        };
        Some(self.work().iter().map(cost).fold(0.0, f64::max))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_work_is_that_of_the_table() {
        let shape = Shape { classes: 28, ..Shape::new(21, 40, 28) };
        let [first, follow] = shape.work();
        assert_eq!((first.visits, first.used, first.examples), (28.0 * 256.0, 3.0, 120.0));
        assert_eq!((follow.visits, follow.used), (28.0 * 256.0 + 448.0, 8.0));
        assert_eq!((follow.dofs, follow.rows), (67.0, 8.0 / 5.0));
        let labelled = Shape { searched: vec![1000; 7], ..shape.clone() };
        assert_eq!(labelled.work().map(|w| (w.visits, w.used)), [(1792.0, 3.0), (2240.0, 7.0)]);
        // A class of 100 rows is searched exhaustively. Its unused visits go to the other class, which uses at most as
        // many again as its own.
        let small = Shape { searched: vec![100, 1000], classes: 2, ..shape };
        assert_eq!(small.work().map(|w| (w.visits, w.used)), [(356.0, 3.0), (612.0, 2.0)]);
    }

    /// The factors of the formula in docs/PORTING.md are those of the code; the message has the lines to put there.
    #[test]
    fn the_document_has_the_factors_of_the_code() {
        let calibration = Isa::Armv7MFpu.calibration();
        let worst = calibration.worst.expect("it was calibrated");
        let factor = |term: usize| {
            let ratio = worst[crate::parts::cost::STAGE_OF[term] as usize];
            format!("{:.0}", calibration.unit_costs.0[term] * ratio)
        };
        let [q, s, class, d, r, r_class, t, t_class, joint, e, none, c, l] = std::array::from_fn(factor);
        assert_eq!(none, "0", "stage rest has a cost a class: add it to the document");
        let lines = [
            format!("query {q} · J W F"),
            format!("search {s} · distances · F + {class} · C"),
            format!("decode {d} · n D · Σ (2 + 3 S) / 5"),
            format!("regression ({r} · n D + {r_class} · classes unpacked · D) · M"),
            format!("timing ({t} · n + {t_class} · classes unpacked) · M"),
            format!("rest {joint} · J + {e} · n M"),
            format!("contacts {c} · the smaller of n and {MOST_VOTERS}"),
            format!("lock {l}"),
        ];
        let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../docs/PORTING.md");
        let document = std::fs::read_to_string(path).expect("the document is there");
        let document: Vec<String> =
            document.lines().map(|l| l.split_whitespace().collect::<Vec<_>>().join(" ")).collect();
        for line in lines {
            assert!(document.contains(&line), "docs/PORTING.md has no line `{line}`");
        }
    }

    #[test]
    fn every_mix_with_weight_is_counted_once() {
        let own = |styles: &[u16]| styles.iter().map(|&s| (s, 0.5)).collect::<Vec<_>>();
        let mut request =
            Request { group_styles: vec![(1, own(&[2, 3])), (2, own(&[2, 3]))], ..Request::style(1) };
        assert_eq!(request.mixes(3), [1, 2]);
        // The last setting of a group counts; an empty one returns the group to the body's style; a body's style that
        // no group uses costs nothing.
        request.group_styles.push((2, Vec::new()));
        assert_eq!(request.mixes(3), [1, 2]);
        request.group_styles.extend([(0, own(&[4])), (2, own(&[4, 5, 6]))]);
        assert_eq!(request.mixes(3), [1, 2, 3]);
        let [_, follow] = Shape { mixes: request.mixes(3), ..Shape::new(21, 40, 28) }.work();
        assert_eq!((follow.mixes, follow.rows), (3.0, (5.0 + 8.0 + 11.0) / 5.0));
    }

    #[test]
    fn the_bound_grows_with_the_settings_and_falls_with_labels() {
        let most = |shape: &Shape| shape.bound(Isa::Armv7MFpu).expect("it was calibrated");
        let all = Shape::new(21, 40, 28);
        for more in [
            Shape { k: 48, ..all.clone() },
            Shape { visits: 400, ..all.clone() },
            Shape { joints: 22, ..all.clone() },
            Shape { mixes: vec![3], ..all.clone() },
            Shape { mixes: vec![2, 2], ..all.clone() },
            Shape::new(21, 40, 29),
        ] {
            assert!(most(&more) > most(&all), "{more:?}");
        }
        assert!(most(&Shape { searched: vec![1000; 7], ..all.clone() }) < 0.7 * most(&all));
        assert!(all.bound(Isa::Armv6M).is_none());
    }
}
