//! Sheets of drawn poses: one moment in mixes of styles over a polygon (Xia 2015, Figure 5), and inputs with their nearest
//! neighbors (Figure 7).
//!
//! Generated motion is drawn by default, so that a sheet can be published.

mod neighbors;
mod polygon;

use anyhow::Result;
use gestus_core::Database;
use gestus_database::{
    build::{BuildOptions, build},
    synth::{self, STYLES},
};

use crate::{
    evaluation::Evaluation,
    experiment::Experiment,
    measures::{OnClips, Uses},
};

/// What is generated: actions, clips of each class, seconds of a gait.
const GENERATED: ([&str; 4], usize, f64) = (["walk", "run", "jump", "kick"], 3, 6.0);

/// Options of `gestus evaluate sheets`.
#[derive(clap::Args, Debug, Default)]
pub struct Args {
    /// Draw the clips of --data, which their terms may not let you publish, in place of generated motion
    #[arg(long)]
    captured: bool,
}

impl OnClips for Args {
    const USES: Uses = Uses::ALL;

    fn uses(&self) -> Uses {
        if self.captured { Self::USES } else { Uses::NONE }
    }

    fn evaluate(&self, experiment: &Experiment) -> Result<Evaluation> {
        if self.captured { drawn(experiment) } else { drawn(&generated()?) }
    }
}

fn generated() -> Result<Experiment> {
    let (actions, clips, seconds) = GENERATED;
    let corpus = synth::corpus(&synth::Options::of(&actions, &STYLES, clips, seconds))?;
    Ok(Experiment::new(corpus, BuildOptions { models: false, ..BuildOptions::default() }))
}

/// All sheets of the first test clip.
fn drawn(experiment: &Experiment) -> Result<Evaluation> {
    let tests = experiment.queries()?;
    let bytes = build(&experiment.corpus.without(&tests), &experiment.build)?.bytes;
    let database = Database::open(&bytes)?;
    let (mut rows, polygon) = polygon::drawn(experiment, &database, tests[0])?;
    let mut figures = vec![polygon];
    let (found, sheet) = neighbors::drawn(experiment, &database, tests[0], "known")?;
    rows.extend(found);
    figures.push(sheet);
    // The same input in a database of another action alone, where there is one.
    let own = experiment.corpus.examples[tests[0]].action;
    if let Some(other) = (0..experiment.corpus.actions.len()).find(|&a| a != own) {
        let bytes =
            build(&crate::experiment::only(&experiment.corpus, &[other], &tests), &experiment.build)?.bytes;
        let (found, sheet) = neighbors::drawn(experiment, &Database::open(&bytes)?, tests[0], "unknown")?;
        rows.extend(found);
        figures.push(sheet);
    }
    Ok(Evaluation {
        what: "sheets",
        about: "Drawn poses. `polygon`: one moment of a held-out clip in mixes of styles; `between_cm` is how far its pose is \
                from the same mix of the poses at the corners, `input_cm` from the input. `known` and `unknown`: input poses \
                and the three nearest of each class, with `nearest_cm`, their mean distance, in a database of all actions and \
                in one that lacks the input's. Distances are of hips-centred joints that face ahead."
            .into(),
        keys: vec!["sheet", "place"],
        rows,
        figures,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::table::Row;

    #[test]
    fn generated_sheets_take_no_clips_of_the_folder() {
        let uses = |captured: bool| Args { captured }.uses();
        assert!(uses(true).from && uses(true).groups && !uses(false).from && !uses(false).groups);
    }

    #[test]
    fn corners_are_their_styles_and_neighbors_of_an_unknown_action_are_further() {
        let styles = ["neutral", "proud", "old", "angry"];
        let found = drawn(&Experiment::generated(&["walk", "run"], &styles, 2, 4.0)).unwrap();
        let of = |sheet: &str| -> Vec<&Row> { found.rows.iter().filter(|r| r["sheet"] == sheet).collect() };
        let number = |row: &Row, key: &str| row[key].as_f64().unwrap_or_else(|| panic!("{key}: {row:?}"));
        // Three corners, three edges, the centre.
        let polygon = of("polygon");
        assert_eq!(polygon.len(), 7);
        for row in &polygon {
            let corner = row["place"] == "corner";
            assert!(number(row, "between_cm") < if corner { 1e-9 } else { 8.0 }, "{row:?}");
            assert!(number(row, "input_cm") > 0.5, "{row:?}");
        }
        let mean = |sheet: &str| {
            let nearest: Vec<f64> = of(sheet).iter().map(|r| number(r, "nearest_cm")).collect();
            nearest.iter().sum::<f64>() / nearest.len() as f64
        };
        assert!(mean("unknown") > mean("known"), "{} {}", mean("unknown"), mean("known"));
        assert_eq!(found.figures.len(), 3);
        assert!(found.figures.iter().all(|f| f.svg.len() > 10_000));
    }
}
