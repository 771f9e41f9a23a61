//! The rating sheet for outputs: clips that were rebuilt with a wanted Effort, for an expert to look at (Torresani 2006,
//! section 8: of the synthesised sequences, the great majority was found consistent with its target).
//!
//! ```text
//! id,clip,flow,weight,time,consistent
//! o0001,walk_1,,2,,yes
//! o0002,walk_1,,-2,,
//! ```
//!
//! A factor without a value is free. `consistent` is `yes`, `no`, or empty where nobody has looked.

use std::path::Path;

use serde::{Deserialize, Serialize};

use crate::effort::{
    NAMES, POLE,
    labels::{LabelError, line_of},
    model::Model,
    synthesize::{Output, translate},
};
use gestus_motion::{
    clip::Clip,
    files::{self, MAX_SETTINGS_BYTES},
};

/// An output on the sheet.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Row {
    /// Its name on the page.
    pub id: String,
    /// The input.
    pub clip: String,
    /// The wanted flow, if it is not free.
    pub flow: Option<f64>,
    /// The wanted weight.
    pub weight: Option<f64>,
    /// The wanted time.
    pub time: Option<f64>,
    /// `yes` or `no`; empty where nobody has looked.
    pub consistent: String,
}

impl Row {
    /// The wanted factors, in order.
    pub fn wanted(&self) -> [Option<f64>; 3] {
        [self.flow, self.weight, self.time]
    }

    /// What is asked for, in words.
    pub fn target(&self) -> String {
        let wanted = NAMES.iter().zip(self.wanted());
        let named: Vec<String> = wanted.filter_map(|(name, v)| Some(format!("{name} {}", v?))).collect();
        named.join(", ")
    }
}

/// How many outputs of a target were looked at, and how many are consistent.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Score {
    /// Outputs that an expert has looked at.
    pub rated: usize,
    /// Those found consistent.
    pub consistent: usize,
}

const COLUMNS: [&str; 6] = ["id", "clip", NAMES[0], NAMES[1], NAMES[2], "consistent"];
const FACTOR: &str = "a number from -3 to 3, or nothing";
const VERDICT: &str = "`yes`, `no` or nothing";

/// Each clip with each factor at either end of a scale from `-reach` to `reach`, the others free.
pub fn outputs(model: &Model, clips: &[Clip], reach: f64) -> Vec<(Row, Output)> {
    let ends = (0..NAMES.len()).flat_map(|k| [-reach, reach].map(|v| (k, v)));
    let all = clips.iter().flat_map(|clip| ends.clone().map(move |end| (clip, end)));
    all.enumerate()
        .map(|(n, (clip, (factor, value)))| {
            let [flow, weight, time] = std::array::from_fn(|k| (k == factor).then_some(value));
            let (id, clip_name) = (format!("o{:04}", n + 1), clip.name.clone());
            let row = Row { id, clip: clip_name, flow, weight, time, consistent: String::new() };
            let output = translate(model, clip, &row.wanted());
            (row, output)
        })
        .collect()
}

/// The table as text.
pub fn write(rows: &[Row]) -> String {
    let mut writer = csv::Writer::from_writer(Vec::new());
    for row in rows {
        // Writing to memory does not fail.
        let _ = writer.serialize(row);
    }
    writer.into_inner().map(|bytes| String::from_utf8_lossy(&bytes).into_owned()).unwrap_or_default()
}

/// Reads a table that an expert has filled in.
///
/// # Errors
/// [`LabelError`] names file, line and column.
pub fn read(path: &Path) -> Result<Vec<Row>, LabelError> {
    let file = path.display().to_string();
    let text = files::read(path, MAX_SETTINGS_BYTES)
        .map_err(|error| LabelError::Io { file: file.clone(), error })?;
    parse(&text, &file)
}

/// Reads a table's text; `file` is its name in messages.
///
/// # Errors
/// [`LabelError`] names file, line and column.
pub fn parse(text: &[u8], file: &str) -> Result<Vec<Row>, LabelError> {
    let mut reader = csv::ReaderBuilder::new().trim(csv::Trim::All).from_reader(text);
    let form = |error| LabelError::Csv { file: file.to_owned(), error };
    let header = reader.headers().map_err(form)?.clone();
    // A column that is not there would be one that is empty.
    if let Some(column) = COLUMNS.into_iter().find(|column| !header.iter().any(|h| h == *column)) {
        return Err(LabelError::Column { file: file.to_owned(), column, command: "outputs" });
    }
    let mut rows = Vec::new();
    for record in reader.records() {
        let record = record.map_err(form)?;
        let line = line_of(&record, text);
        let row: Row = record.deserialize(Some(&header)).map_err(form)?;
        let bad = |column, value: String, need| LabelError::Value {
            file: file.to_owned(),
            line,
            column,
            value,
            need,
        };
        for (name, value) in NAMES.into_iter().zip(row.wanted()) {
            if let Some(value) = value.filter(|v| !(-POLE..=POLE).contains(v)) {
                return Err(bad(name, value.to_string(), FACTOR));
            }
        }
        if !["", "yes", "no"].contains(&row.consistent.as_str()) {
            return Err(bad("consistent", row.consistent, VERDICT));
        }
        rows.push(row);
    }
    Ok(rows)
}

/// The score of each target in turn, by its words, and of all.
pub fn scores(rows: &[Row]) -> (Vec<(String, Score)>, Score) {
    let mut targets: Vec<(String, Score)> = Vec::new();
    let mut all = Score::default();
    for row in rows.iter().filter(|row| !row.consistent.is_empty()) {
        let target = row.target();
        let at = targets.iter().position(|(t, _)| *t == target).unwrap_or_else(|| {
            targets.push((target, Score::default()));
            targets.len() - 1
        });
        for score in [&mut targets[at].1, &mut all] {
            score.rated += 1;
            score.consistent += usize::from(row.consistent == "yes");
        }
    }
    (targets, all)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        effort::{fragment::Library, model::draw},
        synth,
    };

    #[test]
    fn a_sheet_that_is_filled_in_has_a_score_for_each_target() {
        let corpus =
            synth::corpus(&synth::Options::of(&["walk"], &["neutral", "angry", "old"], 1, 5.0)).unwrap();
        let library = Library::found(&corpus).unwrap();
        let draws = draw(&library, 30, 1);
        let model = Model::estimated(library, &draws);
        let clip = corpus.examples[0].clip.clone();
        let made = outputs(&model, &[clip.clone(), clip], 2.0);
        assert_eq!((made.len(), made[1].0.target().as_str()), (12, "flow 2"));
        assert!(made.iter().all(|(_, output)| !output.frames.is_empty()));
        let mut rows: Vec<Row> = made.into_iter().map(|m| m.0).collect();
        assert_eq!(parse(write(&rows).as_bytes(), "o.csv").unwrap(), rows);
        assert_eq!(scores(&rows), (vec![], Score::default()));
        (rows[1].consistent, rows[7].consistent, rows[2].consistent) =
            ("yes".into(), "no".into(), "yes".into());
        let (targets, all) = scores(&rows);
        assert_eq!(targets[0], ("flow 2".into(), Score { rated: 2, consistent: 1 }));
        assert_eq!((targets.len(), all), (2, Score { rated: 3, consistent: 2 }));
        let refused = |from: &str, to: &str| {
            let text = write(&rows);
            assert!(text.contains(from), "{text}");
            parse(text.replacen(from, to, 1).as_bytes(), "o.csv").unwrap_err().to_string()
        };
        assert!(refused(",yes", ",maybe").contains("o.csv, line 3: consistent is `maybe`"));
        assert!(refused(",2.0,", ",5,").contains("line 3: flow is `5`"));
        // Lines are those of the file, empty ones counted.
        let text = write(&rows).replacen("\no0002,", "\n\n\no0002,", 1).replacen(",yes", ",maybe", 1);
        let error = parse(text.as_bytes(), "o.csv").unwrap_err();
        assert!(matches!(error, LabelError::Value { line: 5, column: "consistent", .. }), "{error}");
        assert!(refused("weight", "heft").contains("no column `weight`"));
    }
}
