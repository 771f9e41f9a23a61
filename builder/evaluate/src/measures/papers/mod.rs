//! `gestus evaluate papers`: the tables and figures of the papers, with the papers' own numbers beside ours, what differs in
//! data, and what is missing. One row a figure.

mod tables;

use std::{collections::BTreeMap, time::Instant};

use anyhow::Result;
use gestus_database::command_line::outputs::note;
use serde_json::{Value, json};

use crate::{
    evaluation::{Evaluation, row},
    experiment::Experiment,
    measures::{OnClips, Uses, cost::paper_size},
    report::{html::Figure, table},
};
use tables::{TABLES, Table};

/// Options of `gestus evaluate papers`.
#[derive(clap::Args, Debug)]
pub struct Args {
    /// Also run the measures that take an hour or more with all clips
    #[arg(long)]
    all: bool,
    /// Tables whose name contains one of these words, a,b; default: all
    #[arg(long, value_delimiter = ',')]
    only: Vec<String>,
}

impl OnClips for Args {
    const USES: Uses = Uses::ALL;

    fn check(&self, _: &std::path::Path) -> Result<()> {
        if self.chosen().next().is_none() {
            let names: Vec<&str> = TABLES.iter().map(|t| t.name).collect();
            anyhow::bail!(
                "--only {}: no table has such a name: there are {}",
                self.only.join(","),
                names.join("; ")
            );
        }
        Ok(())
    }

    fn evaluate(&self, experiment: &Experiment) -> Result<Evaluation> {
        let (mut rows, mut figures) = (database(experiment), vec![]);
        for table in self.chosen() {
            note(format_args!("papers: {}", table.name));
            let start = Instant::now();
            if table.long && !self.all {
                rows.push(absent(table, "not run: it takes long; give --all"));
                continue;
            }
            match (table.run)(experiment) {
                Ok(found) => {
                    rows.extend(figures_of(table, &found));
                    figures.extend(found.figures.into_iter().map(|f| Figure {
                        name: format!("{}-{}", found.what, f.name),
                        caption: format!("{}: {}", table.name, f.caption),
                        svg: f.svg,
                    }));
                }
                // One table that these clips can't make costs that table.
                Err(error) => rows.push(absent(table, &format!("failed: {error:#}"))),
            }
            note(format_args!("papers: {:.0} s", start.elapsed().as_secs_f64()));
        }
        Ok(Evaluation {
            what: "papers",
            about: "Every table and figure of the four papers that has numbers here. `ours` is a mean over rows of the \
                    measure, `error` its standard error over test clips, `theirs` what the paper prints. A row with \
                    `missing` has no counterpart yet. No figure of a paper was measured on these clips: read `differs` \
                    before comparing."
                .into(),
            keys: vec!["table", "of", "key"],
            rows,
            figures,
        })
    }
}

impl Args {
    fn chosen(&self) -> impl Iterator<Item = &'static Table> + '_ {
        let wanted = |t: &&Table| {
            let named = |word: &String| t.name.to_lowercase().contains(&word.trim().to_lowercase());
            self.only.is_empty() || self.only.iter().any(named)
        };
        TABLES.iter().filter(wanted)
    }
}

/// A table without figures.
fn absent(table: &Table, why: &str) -> table::Row {
    row(json!({
        "table": table.name, "of": null, "key": null, "ours": null, "error": null, "theirs": null, "rows": null,
        "missing": why, "paper": table.paper, "differs": table.differs,
    }))
}

/// One row for each figure of a measure's means.
fn figures_of(table: &Table, found: &Evaluation) -> Vec<table::Row> {
    let names: Vec<&str> = table.keys.0.split(' ').collect();
    let means = table::means(&found.rows, &names);
    let errors = table::standard_errors(&found.rows, &names);
    let mut rows = Vec::new();
    for (mean, error) in means.iter().zip(&errors) {
        let parts: Vec<String> =
            names.iter().map(|n| table::text(mean.get(*n))).filter(|part| !part.is_empty()).collect();
        let of = parts.join(" ");
        for key in table.keys.1.split(' ') {
            let Some(ours) = mean.get(key).filter(|v| v.is_number()) else { continue };
            let theirs = table.numbers.iter().find(|n| n.1 == key && of.ends_with(n.0)).map(|n| n.2);
            rows.push(row(json!({
                "table": table.name, "of": of, "key": key, "ours": ours, "error": error.get(key).unwrap_or(&Value::Null),
                "theirs": theirs, "rows": mean.get("rows"), "missing": null, "paper": table.paper,
                "differs": table.differs,
            })));
        }
    }
    if rows.is_empty() {
        rows.push(absent(table, "these clips give none of its figures"));
    }
    rows
}

/// Xia 2015, Table 1: frames of each action. Theirs are 120 a second.
fn database(experiment: &Experiment) -> Vec<table::Row> {
    let corpus = &experiment.corpus;
    let mut frames: BTreeMap<&str, usize> = BTreeMap::new();
    for example in &corpus.examples {
        *frames.entry(corpus.actions[example.action].as_str()).or_default() += example.clip.frames.len();
    }
    frames.insert("all", corpus.examples.iter().map(|e| e.clip.frames.len()).sum());
    let theirs = |action: &str| {
        paper_size::FRAMES.iter().chain(&[("all", paper_size::TOTAL)]).find(|t| t.0 == action).map(|t| t.1)
    };
    let of = |(action, frames): (&str, usize)| {
        row(json!({
            "table": "Xia 2015, Table 1: the database", "of": action, "key": "frames", "ours": frames, "error": null,
            "theirs": theirs(action), "rows": null, "missing": null,
            "paper": "eight styles, 79,829 frames at 120 a second: 11 minutes; transitions are 2,145 of them",
            "differs": format!("{} styles at {} frames a second", corpus.styles.len(), corpus.rate_hz),
        }))
    };
    frames.into_iter().map(of).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tables_are_measured_or_said_to_be_missing() {
        let experiment = Experiment::generated(&["walk", "run"], &["neutral", "proud"], 3, 4.0);
        let frames: usize = experiment.corpus.examples.iter().map(|e| e.clip.frames.len()).sum();
        let only = ["correspondence", "bilinear", "components"].map(String::from).to_vec();
        let found = Args { all: false, only }.evaluate(&experiment).unwrap();
        let of = |table: &str| -> Vec<&table::Row> {
            found.rows.iter().filter(|r| r["table"].as_str().unwrap().contains(table)).collect()
        };
        assert_eq!(of("the database").iter().find(|r| r["of"] == "all").unwrap()["ours"], frames);
        assert!(of("components")[0]["missing"].is_string());
        for table in ["correspondence", "bilinear"] {
            let measured = of(table);
            assert!(measured.len() > 4 && measured.iter().all(|r| r["ours"].is_number()), "{measured:?}");
        }
        assert!(of("Torresani").is_empty());
        let wrong = Args { all: false, only: vec!["nothing".into()] };
        assert!(wrong.check(std::path::Path::new(".")).is_err());
    }

    #[test]
    fn the_papers_numbers_stand_beside_their_method_and_factor() {
        let torresani = TABLES.iter().find(|t| t.name.contains("Torresani")).unwrap();
        let rows = ["kernel-ridge", "kernel-ridge-pair"].map(|method| {
            row(json!({ "part": "regression", "corpus": "data", "factor": "flow", "method": method, "mse": 0.4 }))
        });
        let found = Evaluation {
            what: "effort",
            about: String::new(),
            keys: vec![],
            rows: rows.to_vec(),
            figures: vec![],
        };
        let rows = figures_of(torresani, &found);
        assert_eq!((rows.len(), &rows[0]["theirs"], &rows[1]["theirs"]), (2, &json!(0.5), &Value::Null));
    }
}
