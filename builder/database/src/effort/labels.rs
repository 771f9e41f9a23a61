//! The table of Efforts of fragments and blends that people fill in.
//!
//! ```text
//! id,clip,from_s,to_s,with,with_from_s,with_to_s,alpha,action,style,flow,weight,time
//! f0001,walk_proud_1,0.4,1.5,,,,,walk,proud,1,-0.5,2
//! b0001,walk_proud_1,0.4,1.5,walk_old_3,0.3,1.6,0.25,walk,,,,
//! ```
//!
//! A row without `with` is a fragment, from and to in seconds of its clip: changing those, or adding rows, is how
//! fragments are annotated. A row with it is the blend of two fragments. Factors are from -3 to 3; a row in which
//! all three are empty is unlabelled and skipped.

use std::path::Path;

use thiserror::Error;

use crate::effort::{
    Factors, NAMES, POLE,
    fragment::{Library, Span},
};
use crate::list::first_of;
use gestus_motion::files::{self, FileError, MAX_SETTINGS_BYTES};

/// A row of the table.
#[derive(Debug, Clone, PartialEq)]
pub struct Row {
    /// Its name on the page.
    pub id: String,
    /// The fragment, or a blend's first one.
    pub first: Span,
    /// A blend's second fragment, and α.
    pub second: Option<(Span, f64)>,
    /// Action, for people.
    pub action: String,
    /// Style, for people; empty for blends.
    pub style: String,
    /// Its Effort, if labelled.
    pub effort: Option<Factors>,
}

/// A table that can't be used.
#[derive(Debug, Error)]
pub enum LabelError {
    /// The file.
    #[error("{file} can't be read: {error}")]
    Io {
        /// The file.
        file: String,
        /// Why.
        error: FileError,
    },
    /// Its form.
    #[error("{file}: {error}")]
    Csv {
        /// The file.
        file: String,
        /// Why.
        error: csv::Error,
    },
    /// A column that is not there.
    #[error("{file}: there is no column `{column}`: `gestus effort {command}` writes a table to start from")]
    Column {
        /// The file.
        file: String,
        /// The column.
        column: &'static str,
        /// The command that writes such a table.
        command: &'static str,
    },
    /// A value.
    #[error("{file}, line {line}: {column} is `{value}`: {need}")]
    Value {
        /// The file.
        file: String,
        /// The line, from 1.
        line: u64,
        /// The column.
        column: &'static str,
        /// What it holds.
        value: String,
        /// What it should hold.
        need: &'static str,
    },
    /// Too few labels to learn from.
    #[error("{file}: {have} {what} have labels, at least {need} are needed; fill in more rows")]
    Few {
        /// The file.
        file: String,
        /// Fragments or blends.
        what: &'static str,
        /// How many.
        have: usize,
        /// How many it takes.
        need: usize,
    },
    /// The skeleton.
    #[error(transparent)]
    Landmark(#[from] gestus_motion::landmarks::LandmarkError),
    /// The clips.
    #[error(
        "{file}: none of its fragments are in the clips: do the names in the column `clip` fit, and is it the table of \
         these clips?"
    )]
    Clips {
        /// The file.
        file: String,
    },
}

const COLUMNS: [&str; 13] = [
    "id",
    "clip",
    "from_s",
    "to_s",
    "with",
    "with_from_s",
    "with_to_s",
    "alpha",
    "action",
    "style",
    NAMES[0],
    NAMES[1],
    NAMES[2],
];
/// Frames by which an end may be off, since the table has it in rounded seconds.
const ROUNDED: usize = 1;
const SECONDS: &str = "a time in seconds, not negative";
const AFTER: &str = "it has to be after the fragment's start";
const FACTOR: &str = "a number from -3 to 3 (all three factors, or none)";
const BETWEEN: &str = "a number from -0.25 to 1.25";

/// The table as text.
pub fn write(rows: &[Row], rate_hz: f64) -> String {
    let mut writer = csv::Writer::from_writer(Vec::new());
    let seconds = |frame: usize| format!("{}", (frame as f64 / rate_hz * 1e4).round() / 1e4);
    // Writing to memory does not fail.
    let _ = writer.write_record(COLUMNS);
    for row in rows {
        let mut fields =
            vec![row.id.clone(), row.first.clip.clone(), seconds(row.first.from), seconds(row.first.to)];
        match &row.second {
            Some((span, alpha)) => {
                fields.extend([
                    span.clip.clone(),
                    seconds(span.from),
                    seconds(span.to),
                    format!("{alpha:.4}"),
                ]);
            }
            None => fields.extend([const { String::new() }; 4]),
        }
        fields.extend([row.action.clone(), row.style.clone()]);
        match &row.effort {
            Some(effort) => fields.extend(effort.map(|v| format!("{v:.3}"))),
            None => fields.extend([const { String::new() }; 3]),
        }
        let _ = writer.write_record(&fields);
    }
    writer.into_inner().map(|bytes| String::from_utf8_lossy(&bytes).into_owned()).unwrap_or_default()
}

/// Reads a table. Times become frames of a rate.
///
/// # Errors
/// [`LabelError`] names file, line and column.
pub fn read(path: &Path, rate_hz: f64) -> Result<Vec<Row>, LabelError> {
    let file = path.display().to_string();
    let text = files::read(path, MAX_SETTINGS_BYTES)
        .map_err(|error| LabelError::Io { file: file.clone(), error })?;
    parse(&text, &file, rate_hz)
}

/// Reads a table's text; `file` is its name in messages.
///
/// # Errors
/// [`LabelError`] names file, line and column.
pub fn parse(text: &[u8], file: &str, rate_hz: f64) -> Result<Vec<Row>, LabelError> {
    let form = |error| LabelError::Csv { file: file.to_owned(), error };
    let mut reader = csv::ReaderBuilder::new().trim(csv::Trim::All).from_reader(text);
    let header = reader.headers().map_err(form)?.clone();
    let mut places = [0; COLUMNS.len()];
    for (place, column) in places.iter_mut().zip(COLUMNS) {
        *place = header
            .iter()
            .position(|h| h.trim_start_matches('\u{feff}') == column)
            .ok_or_else(|| LabelError::Column { file: file.to_owned(), column, command: "sheet" })?;
    }
    let mut rows = Vec::new();
    for record in reader.records() {
        let record = record.map_err(form)?;
        let line = line_of(&record, text);
        let field = |c: usize| record.get(places[c]).unwrap_or("");
        let bad = |c: usize, need| LabelError::Value {
            file: file.to_owned(),
            line,
            column: COLUMNS[c],
            value: field(c).to_owned(),
            need,
        };
        let number = |c: usize, (low, high): (f64, f64), need| match field(c).parse::<f64>() {
            Ok(v) if (low..=high).contains(&v) => Ok(v),
            _ => Err(bad(c, need)),
        };
        let span = |clip: usize| -> Result<Span, LabelError> {
            let frame = |c| number(c, (0.0, 1e6), SECONDS).map(|s| (s * rate_hz).round() as usize);
            let (from, to) = (frame(clip + 1)?, frame(clip + 2)?);
            if to <= from {
                Err(bad(clip + 2, AFTER))
            } else {
                Ok(Span { clip: field(clip).to_owned(), from, to })
            }
        };
        let second = match field(4) {
            "" => None,
            _ => Some((span(4)?, number(7, super::ALPHA, BETWEEN)?)),
        };
        let effort = if (10..13).all(|c| field(c).is_empty()) {
            None
        } else {
            let factor = |c| number(c, (-POLE, POLE), FACTOR);
            Some([factor(10)?, factor(11)?, factor(12)?])
        };
        rows.push(Row {
            id: field(0).to_owned(),
            first: span(1)?,
            second,
            action: field(8).to_owned(),
            style: field(9).to_owned(),
            effort,
        });
    }
    Ok(rows)
}

/// The line of a record, from 1. Its position is before empty lines that stand before it.
pub(super) fn line_of(record: &csv::StringRecord, text: &[u8]) -> u64 {
    let Some(place) = record.position() else { return 0 };
    let rest = text.get(place.byte() as usize..).unwrap_or(&[]);
    let breaks = rest.iter().take_while(|byte| matches!(byte, b'\r' | b'\n'));
    place.line() + breaks.filter(|byte| **byte == b'\n').count() as u64
}

/// Rows with labels that a library of fragments does not use as they are: fragments of other clips, those that end after
/// their clip, and those that are there twice.
pub fn doubts(rows: &[Row], file: &str, library: &Library) -> Vec<String> {
    let labelled: Vec<&Row> =
        rows.iter().filter(|row| row.second.is_none() && row.effort.is_some()).collect();
    let of = |row: &Row| library.fragments.iter().find(|f| f.span.begins_with(&row.first));
    let named = |what: &str, chosen: &dyn Fn(usize, &Row) -> bool| {
        let named = |row: &Row| format!("{} ({})", row.id, row.first.clip);
        let all = labelled.iter().enumerate().filter(|(i, row)| chosen(*i, row));
        let rows: Vec<String> = all.map(|(_, row)| named(row)).collect();
        let count = rows.len();
        Some(format!("{file}: {count} {what}: {}", first_of(rows, "more")?))
    };
    let is_cut = |row: &Row| of(row).is_some_and(|f| f.span.to + ROUNDED < row.first.to);
    let is_repeated = |i: usize, row: &Row| labelled[..i].iter().any(|other| other.first == row.first);
    [
        named("fragments with labels are of no clip that is used, and left out", &|_, row| of(row).is_none()),
        named("fragments end after their clip, and are cut there", &|_, row| is_cut(row)),
        named("fragments have labels already, in a row above, which counts", &|i, row| is_repeated(i, row)),
    ]
    .into_iter()
    .flatten()
    .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn rows() -> Vec<Row> {
        let span = |clip: &str, from, to| Span { clip: clip.to_owned(), from, to };
        vec![
            Row {
                id: "f1".into(),
                first: span("a, \"b\"", 12, 45),
                second: None,
                action: "walk".into(),
                style: "old".into(),
                effort: Some([1.5, -3.0, 0.25]),
            },
            Row {
                id: "b1".into(),
                first: span("a, \"b\"", 12, 45),
                second: Some((span("c", 0, 31), -0.125)),
                action: "walk".into(),
                style: String::new(),
                effort: None,
            },
        ]
    }

    #[test]
    fn what_is_written_is_read() {
        assert_eq!(parse(write(&rows(), 30.0).as_bytes(), "x.csv", 30.0).unwrap(), rows());
    }

    #[test]
    fn mistakes_are_named_by_line_and_column() {
        let good = write(&rows(), 30.0);
        let refused = |from: &str, to: &str| {
            assert!(good.contains(from), "{good}");
            parse(good.replacen(from, to, 1).as_bytes(), "x.csv", 30.0).unwrap_err().to_string()
        };
        assert!(refused(",1.500,", ",4,").contains("x.csv, line 2: flow is `4`"));
        assert!(refused(",1.500,", ",,").contains("line 2: flow is ``"));
        assert!(refused("-0.1250", "1.3").contains("line 3: alpha is `1.3`"));
        assert!(refused(",0.4,1.5,", ",1.6,1.5,").contains("line 2: to_s is `1.5`"));
        assert!(refused(",0.4,", ",soon,").contains("line 2: from_s is `soon`"));
        assert!(
            refused("\nf1,\"a, \"\"b\"\"\",0.4,", "\n\r\n\nf1,\"a, \"\"b\"\"\",soon,")
                .contains("line 4: from_s is `soon`")
        );
        assert!(refused(",weight", ",heft").contains("no column `weight`"));
    }
}
