//! The rating sheet: a table of fragments and blends for people to fill in, each with its motion.

use crate::effort::{
    Source,
    blend::Pair,
    fragment::{Fragment, Library},
    labels::{self, Row},
    model::{Draw, draw},
};

/// Seeds on a sheet, as in Torresani 2006, section 8.
pub const SEEDS: usize = 60;

/// A form.
#[derive(Debug, Clone)]
pub struct Sheet {
    /// The table.
    pub csv: String,
    /// What the table's rows say.
    pub rows: Vec<Row>,
    /// Dofs of each row's motion. Shape `[rows][frames][D]`.
    pub motions: Vec<Vec<Vec<f64>>>,
    /// Fragments on it.
    pub fragments: usize,
    /// Blends on it.
    pub blends: usize,
}

/// Some fragments, as many of each action and style as there is room for, in order.
pub fn selected(library: &Library, count: usize) -> Library {
    let classes = |f: &Fragment| (f.action, f.style);
    let mut kept = vec![false; library.fragments.len()];
    let mut taken = 0;
    // Round after round one of each class, from its middle on: first and last cycles are starts and stops.
    for round in 0.. {
        let before = taken;
        for (i, fragment) in library.fragments.iter().enumerate() {
            let own: Vec<usize> = (0..library.fragments.len())
                .filter(|&j| classes(&library.fragments[j]) == classes(fragment))
                .collect();
            let place = own.get((own.len() / 2 + round) % own.len());
            if round < own.len() && place == Some(&i) && !kept[i] && taken < count {
                kept[i] = true;
                taken += 1;
            }
        }
        if taken == before {
            break;
        }
    }
    let fragments = library.fragments.iter().zip(kept).filter(|(_, k)| *k).map(|(f, _)| f.clone()).collect();
    Library { fragments, ..library.clone() }
}

/// The sheet of a library.
pub fn sheet(library: &Library, blends: usize, seed: u64) -> Sheet {
    let draws = draw(library, blends, seed);
    let rows = rows(library, &draws);
    let motions: Vec<Vec<Vec<f64>>> = library
        .fragments
        .iter()
        .map(|f| f.rows.clone())
        .chain(
            draws.iter().map(|&(i, j, a)| Pair::new(&library.fragments[i], &library.fragments[j]).blend(a)),
        )
        .collect();
    Sheet {
        csv: labels::write(&rows, library.rate_hz),
        rows,
        motions,
        fragments: library.fragments.len(),
        blends: draws.len(),
    }
}

fn rows(library: &Library, draws: &[Draw]) -> Vec<Row> {
    let name = |names: &[String], i: usize| names.get(i).cloned().unwrap_or_default();
    let seeds = library.fragments.iter().enumerate().map(|(i, f)| Row {
        id: format!("f{:04}", i + 1),
        first: f.span.clone(),
        second: None,
        action: name(&library.actions, f.action),
        style: name(&library.styles, f.style),
        effort: None,
    });
    let blends = draws.iter().enumerate().map(|(n, &(i, j, alpha))| Row {
        id: format!("b{:04}", n + 1),
        first: library.fragments[i].span.clone(),
        second: Some((library.fragments[j].span.clone(), alpha)),
        action: name(&library.actions, library.fragments[i].action),
        style: String::new(),
        effort: None,
    });
    seeds.chain(blends).collect()
}

/// How Efforts are called wherever they are shown: labels or estimates.
pub fn caveat(source: Source) -> &'static str {
    match source {
        Source::Given => "Efforts as people gave them",
        Source::Estimated => {
            "Efforts are ESTIMATED from kinematic descriptors; nobody has looked at the motion"
        }
        Source::Generated => "Efforts are a known function of the motion with noise",
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        effort::{
            labels::{LabelError, parse},
            model::Model,
        },
        synth,
    };

    #[test]
    fn a_sheet_that_is_filled_in_becomes_a_model() {
        let corpus = synth::corpus(&synth::Options {
            actions: vec!["walk".into()],
            styles: ["neutral", "angry", "old"].map(String::from).to_vec(),
            clips: 1,
            seconds: 6.0,
            ..synth::Options::default()
        })
        .unwrap();
        let library = selected(&Library::found(&corpus).unwrap(), 9);
        assert_eq!(library.fragments.len(), 9);
        for style in 0..3 {
            assert_eq!(library.fragments.iter().filter(|f| f.style == style).count(), 3);
        }
        let sheet = sheet(&library, 60, 1);
        assert_eq!((sheet.fragments, sheet.blends), (9, 60));
        let mut rows = parse(sheet.csv.as_bytes(), "sheet.csv", 30.0).unwrap();
        assert!(rows.iter().all(|r| r.effort.is_none()));
        let given =
            |rows: &[Row]| Model::given(rows, "sheet.csv", |spans| Library::annotated(&corpus, spans));
        let few = given(&rows).unwrap_err();
        assert!(matches!(few, LabelError::Few { what: "fragments", have: 0, need: 2, .. }), "{few}");
        for (i, row) in rows.iter_mut().enumerate().skip(1) {
            row.effort = Some([i as f64 / 20.0, 1.0, -1.0]);
        }
        let model = given(&rows).unwrap();
        assert_eq!((model.source, model.library.fragments.len()), (Source::Given, 8));
        assert_eq!(model.known.efforts[0], [0.05, 1.0, -1.0]);
        // Blends of the fragment without a label are passed over.
        let without = rows
            .iter()
            .filter(|r| r.second.as_ref().is_some_and(|s| r.first != rows[0].first && s.0 != rows[0].first));
        assert_eq!(model.examples.len(), without.count());
        assert_eq!(labels::doubts(&rows, "sheet.csv", &model.library), Vec::<String>::new());
        // A clip that is not there, an end after the clip's, and a row twice.
        rows[2].first.clip = "nowhere".into();
        rows[3].first.to += 1000;
        rows.push(rows[4].clone());
        let model = given(&rows).unwrap();
        let doubts = labels::doubts(&rows, "sheet.csv", &model.library);
        assert_eq!(doubts.len(), 3, "{doubts:?}");
        assert!(doubts.iter().zip([2, 3, 4]).all(|(doubt, row)| doubt.contains(&rows[row].id)), "{doubts:?}");
    }
}
