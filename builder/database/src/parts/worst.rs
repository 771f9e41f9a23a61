//! Upper bound of the instructions of a frame, known before anything is streamed, from a database and its settings.
//!
//! The core knows the most work of a step ([`Database::worst_step`]). The bound is the [`cost`](super::cost) of that work,
//! each stage times the largest ratio of counted to modelled instructions on worst-case streams (`Calibration::worst`;
//! `docs/PORTING.md`, "The worst frame"). So the units are proven, and the costs a unit are measured, with a margin;
//! `cargo xtask budget` checks the bound on emulated boards in several configurations. It leaves out collisions in the
//! visited sets beyond those of blobs that the builder makes.

use crate::stream::Request;
use gestus_core::{Database, methods::work::Work};

use super::{
    calibration::Isa,
    cost::{Size, load},
};

/// Upper bound of the instructions of a frame of the mixture in a database under a request; `None` for an instruction set
/// without measurements on worst-case streams.
pub fn bound(isa: Isa, database: &Database<'_>, request: &Request) -> Option<f64> {
    let work = database.worst_step_of(&request.config, &load(database, request));
    bound_of(isa, &Size::of(database), &work)
}

/// The same of any work, for planning a board: [`Work::of_mixture`] makes it of capacities.
pub fn bound_of(isa: Isa, size: &Size, work: &Work) -> Option<f64> {
    let calibration = isa.calibration();
    let stages = calibration.unit_costs.stages(&size.mixture(work));
    Some(stages.iter().zip(calibration.worst?).map(|(stage, ratio)| stage * ratio).sum())
}

#[cfg(test)]
mod tests {
    use gestus_core::Config;

    use super::*;

    /// The factors of the formula in docs/PORTING.md are those of the code; the message has the lines to put there.
    #[test]
    fn the_document_has_the_factors_of_the_code() {
        let calibration = Isa::Armv7MFpu.calibration();
        let worst = calibration.worst.expect("it was calibrated");
        let factor = |term: usize| {
            let ratio = worst[crate::parts::cost::STAGE_OF[term] as usize];
            format!("{:.0}", calibration.unit_costs.0[term] * ratio)
        };
        let [q, s, class, d, r, r_class, t, t_class, joint, e, e_class, c, l] = std::array::from_fn(factor);
        let lines = [
            format!("query {q} · J W F"),
            format!("search {s} · distances · F + {class} · C"),
            format!("decode {d} · n D · Σ (2 + 3 S) / 5"),
            format!("regression ({r} · n D + {r_class} · classes unpacked · D) · M"),
            format!("timing ({t} · n + {t_class} · classes unpacked) · M"),
            format!("rest {joint} · J + {e} · n M + {e_class} · C"),
            format!(
                "contacts {c} · the smaller of n and {}",
                gestus_core::methods::mixture::contact_votes::MAX_VOTERS
            ),
            format!("lock {l}"),
        ];
        let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../../docs/PORTING.md");
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
    }

    #[test]
    fn the_bound_grows_with_the_settings_and_falls_with_labels() {
        let size = |joints: f64| Size { joints, dofs: 3.0 * joints + 4.0, features: 32.0, window: 5.0 };
        let most = |joints: f64, config: &Config, classes: usize, mixes: u32, outputs: u32| {
            let work = Work::of_mixture(config, std::iter::repeat_n(1000, classes), 0, mixes, outputs);
            bound_of(Isa::Armv7MFpu, &size(joints), &work).expect("it was calibrated")
        };
        let config = Config::new().k(40);
        let all = most(21.0, &config, 28, 1, 2);
        for more in [
            most(21.0, &config.k(48), 28, 1, 2),
            most(21.0, &config.visits(400), 28, 1, 2),
            most(22.0, &config, 28, 1, 2),
            most(21.0, &config, 28, 1, 3),
            most(21.0, &config, 28, 2, 4),
            most(21.0, &config, 29, 1, 2),
        ] {
            assert!(more > all, "{more} {all}");
        }
        assert!(most(21.0, &config, 2, 1, 2) < 0.7 * all);
        let work = Work::of_mixture(&config, std::iter::repeat_n(1000, 28), 0, 1, 2);
        assert!(bound_of(Isa::Armv6M, &size(21.0), &work).is_none());
    }
}
