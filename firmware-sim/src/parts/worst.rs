//! The most that a frame can cost: a bound that is known before anything is streamed, from what is chosen for a board.
//!
//! The work of a frame is bounded by the code: C classes that are searched compute at most C V + 448 distances, V being
//! `Config::visits` (a class that is searched anew, because the stream has jumped, takes what the others have left, and
//! 448 at most beyond); each class that is kept unpacks and fits at most K examples; at most `Config::classes` are kept,
//! and 4 where the stream begins or most of the database's C₀ classes have jumped. With G = min(classes, C) and
//! G₄ = min(G, 4), a frame is one of
//!
//! ```text
//! first       C V visits              G₄ + 1 classes unpacked (the nearest twice)
//! follow      C V + 448 visits        G
//! ```
//!
//! with every example unpacked and fitted once for each mix of output styles (the body's, and those of joint groups), and
//! costs at most the sum of [`cost`](super::cost) over those units, each stage times the largest ratio of counted
//! to modelled instructions that was seen on streams made to be hard (`Calibration::worst`; `docs/PORTING.md`, "The
//! worst frame"). So the counts are proven and the prices are measured, with a margin; `cargo xtask budget` holds the
//! bound against emulated boards in several configurations. Classes of no more than V rows are searched whole, once.

use gestus_core::{
    Config, Database, methods::mixture::contact_votes::MOST_VOTERS, search::graph::MAX_VISITS,
};
use gestus_database::stream::Request;

use super::{
    cost::{Work, outputs, rows},
    prices::Isa,
};

/// Classes that are kept where the stream begins or has jumped: the core's.
const KEPT_ANEW: usize = 4;
/// Visits that a frame has to spare: the core's.
const SPARE: usize = MAX_VISITS as usize;

/// What is chosen for a board: the capacities in use, and what limits a frame.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Shape {
    /// Joints of the database; its dofs are 3 J + 4.
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
    /// Most distances of a class a frame ([`Config::visits`]).
    pub visits: usize,
    /// Most classes of a frame ([`Config::classes`]).
    pub kept: usize,
    /// Outputs of an example in each mix of styles: the body's, and those that joint groups have of their own.
    pub mixes: Vec<usize>,
}

impl Shape {
    /// For a board that is still to be chosen: J joints, K neighbors, C classes that are all searched, one output style,
    /// a database as `gestus build` makes it, with two outputs a cycle, and otherwise the shipped configuration.
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
            kept: gestus_core::methods::mixture::weights::MAX_KEPT,
            mixes: vec![2],
        }
    }

    /// Of a database under a request.
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

    /// The frames that may be the worst: a first one, and one that follows.
    pub fn work(&self) -> [Work; 2] {
        let searched = self.searched.len();
        let kept = self.kept.min(searched);
        // Small classes are searched whole, once: they have nothing to search anew, and leave something for others.
        let visits: usize = self.searched.iter().map(|&rows| rows.min(self.visits)).sum();
        let large = self.searched.iter().filter(|&&rows| rows > self.visits).count();
        let spare = SPARE + searched * self.visits - visits;
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
        let first = kept.min(KEPT_ANEW) + usize::from(searched > 0);
        [work(visits, first), work(visits + again, kept)]
    }

    /// The most instructions of a frame; `None` where no prices of that instruction set were tried on hard streams.
    pub fn most(&self, isa: Isa) -> Option<f64> {
        let calibration = isa.calibration();
        let worst = calibration.worst?;
        let cost = |work: &Work| -> f64 {
            calibration
                .prices
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
        assert_eq!((first.visits, first.used, first.examples), (28.0 * 256.0, 5.0, 200.0));
        assert_eq!((follow.visits, follow.used), (28.0 * 256.0 + 448.0, 8.0));
        assert_eq!((follow.dofs, follow.rows), (67.0, 8.0 / 5.0));
        let labelled = Shape { searched: vec![1000; 7], ..shape.clone() };
        assert_eq!(labelled.work().map(|w| (w.visits, w.used)), [(1792.0, 5.0), (2240.0, 7.0)]);
        // A class of 100 rows is searched whole, and what it leaves is the other's, which takes no more than its own again.
        let small = Shape { searched: vec![100, 1000], classes: 2, ..shape };
        assert_eq!(small.work().map(|w| (w.visits, w.used)), [(356.0, 3.0), (612.0, 2.0)]);
    }

    /// docs/PORTING.md states the factors; here is what to put there.
    #[test]
    fn the_document_has_the_factors_of_the_code() {
        let calibration = Isa::Armv7MFpu.calibration();
        let worst = calibration.worst.expect("it was calibrated");
        let factor = |term: usize| {
            let ratio = worst[crate::parts::cost::STAGE_OF[term] as usize];
            format!("{:.0}", calibration.prices.0[term] * ratio)
        };
        let [q, s, class, d, r, r_class, t, t_class, joint, e, none, c, l] = std::array::from_fn(factor);
        assert_eq!(none, "0", "what is left has a price a class: put it into the document");
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
    fn every_mix_that_is_heard_is_counted_once() {
        let own = |styles: &[u16]| styles.iter().map(|&s| (s, 0.5)).collect::<Vec<_>>();
        let mut request =
            Request { group_styles: vec![(1, own(&[2, 3])), (2, own(&[2, 3]))], ..Request::style(1) };
        assert_eq!(request.mixes(3), [1, 2]);
        // What is set last counts, none gives the group back, and of what no group takes there is nothing to pay.
        request.group_styles.push((2, Vec::new()));
        assert_eq!(request.mixes(3), [1, 2]);
        request.group_styles.extend([(0, own(&[4])), (2, own(&[4, 5, 6]))]);
        assert_eq!(request.mixes(3), [1, 2, 3]);
        let [_, follow] = Shape { mixes: request.mixes(3), ..Shape::new(21, 40, 28) }.work();
        assert_eq!((follow.mixes, follow.rows), (3.0, (5.0 + 8.0 + 11.0) / 5.0));
    }

    #[test]
    fn the_bound_grows_with_what_is_asked_and_falls_with_labels() {
        let most = |shape: &Shape| shape.most(Isa::Armv7MFpu).expect("it was calibrated");
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
        assert!(most(&Shape { searched: vec![1000; 7], ..all.clone() }) < 0.6 * most(&all));
        assert!(all.most(Isa::Armv6M).is_none());
    }
}
