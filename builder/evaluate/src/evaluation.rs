//! What a measure returns: rows, means over them, plots; and how it is written to a folder.

use std::path::Path;

use anyhow::{Context, Result};
use gestus_motion::files;
use serde_json::json;

use crate::report::{
    html::{Figure, report},
    table::{self, Row},
};

/// What was measured.
#[derive(Debug, Clone)]
pub struct Evaluation {
    /// Name of the measure, as on the command line.
    pub what: &'static str,
    /// What the figures mean and how they were made, for the report.
    pub about: String,
    /// Columns that rows are grouped by for the means.
    pub keys: Vec<&'static str>,
    /// The figures.
    pub rows: Vec<Row>,
    /// The plots.
    pub figures: Vec<Figure>,
}

impl Evaluation {
    /// Means over the keys.
    pub fn means(&self) -> Vec<Row> {
        table::means(&self.rows, &self.keys)
    }

    /// Medians over the keys.
    pub fn medians(&self) -> Vec<Row> {
        table::medians(&self.rows, &self.keys)
    }

    /// Standard errors of the means.
    pub fn standard_errors(&self) -> Vec<Row> {
        table::standard_errors(&self.rows, &self.keys)
    }

    /// The rows, each with `method`, `action` and `style`: null where a measure has none.
    fn labelled(&self) -> Vec<Row> {
        let mut rows = self.rows.clone();
        for row in &mut rows {
            for label in ["method", "action", "style"] {
                row.entry(label).or_insert(serde_json::Value::Null);
            }
        }
        rows
    }

    /// All as one object: what `--json` prints and the JSON file holds. `of` says what was measured
    /// ([`Experiment::described`](crate::experiment::Experiment::described)).
    pub fn to_json(&self, of: &serde_json::Value) -> serde_json::Value {
        json!({
            "what": self.what,
            "of": of,
            "gestus": env!("CARGO_PKG_VERSION"),
            "rows": self.labelled(),
            "means": self.means(),
            "standard_errors": self.standard_errors(),
            "medians": self.medians(),
        })
    }

    /// Means as text.
    pub fn summary(&self) -> String {
        table::plain(&self.means())
    }

    /// Writes tables (JSON, CSV), plots (SVG) and one HTML report to a folder.
    ///
    /// # Errors
    /// Where the folder can't be written.
    pub fn write(&self, folder: &Path, of: &serde_json::Value) -> Result<()> {
        let save = |name: String, content: String| {
            let path = folder.join(name);
            files::write(&path, content).with_context(|| format!("{} can't be written", path.display()))
        };
        save(format!("{}.json", self.what), serde_json::to_string_pretty(&self.to_json(of))?)?;
        save(format!("{}.csv", self.what), table::csv(&self.labelled())?)?;
        for figure in &self.figures {
            save(format!("{}-{}.svg", self.what, figure.name), figure.svg.clone())?;
        }
        let about = format!("{} Of `{of}`, by gestus {}.", self.about, env!("CARGO_PKG_VERSION"));
        let title = format!("gestus evaluate {}", self.what);
        let means = table::with_errors(&self.means(), &self.standard_errors());
        let summaries = [("Means ± standard errors", means), ("Medians", self.medians())];
        save(format!("{}.html", self.what), report(&title, &about, &summaries, &self.figures, &self.rows))
    }
}

/// A row from a JSON object.
pub(crate) fn row(value: serde_json::Value) -> Row {
    match value {
        serde_json::Value::Object(map) => map,
        _ => Row::new(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_row_has_its_labels() {
        let rows = vec![row(json!({ "action": "walk", "cm": 1.0 })), row(json!({ "cm": 2.0 }))];
        let (about, keys, figures) = (String::new(), vec!["action"], Vec::new());
        let json = Evaluation { what: "loo", about, keys, rows, figures }.to_json(&json!({ "set": "test" }));
        assert_eq!(json["of"]["set"], "test");
        assert_eq!(json["rows"][0]["action"], "walk");
        for (row, label) in [(0, "method"), (0, "style"), (1, "method"), (1, "action"), (1, "style")] {
            assert_eq!(json["rows"][row].get(label), Some(&serde_json::Value::Null), "{label} of row {row}");
        }
    }
}
