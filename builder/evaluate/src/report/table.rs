//! Rows of figures as CSV and text.

use serde_json::{Map, Value};

use gestus_motion::statistics::{mean, quantile, sorted, variance};

/// A row: names and values, in order.
pub type Row = Map<String, Value>;

/// Each value once, in order of its first use.
pub fn distinct<T: PartialEq>(values: impl IntoIterator<Item = T>) -> Vec<T> {
    let mut found = Vec::new();
    for value in values {
        if !found.contains(&value) {
            found.push(value);
        }
    }
    found
}

/// Names of all columns, in order of their first use.
pub fn columns(rows: &[Row]) -> Vec<&str> {
    distinct(rows.iter().flat_map(Map::keys).map(String::as_str))
}

/// A value as text: numbers with four decimals, and nothing for a missing value.
pub fn text(value: Option<&Value>) -> String {
    match value {
        None | Some(Value::Null) => String::new(),
        Some(Value::String(s)) => s.clone(),
        Some(Value::Number(n)) if n.is_f64() => format!("{:.4}", n.as_f64().unwrap_or(0.0)),
        Some(other) => other.to_string(),
    }
}

/// Rows as CSV; fields with commas, quotes or line ends are quoted.
///
/// # Errors
/// None in practice: memory takes all records, and all have the same columns.
pub fn csv(rows: &[Row]) -> anyhow::Result<String> {
    let columns = columns(rows);
    let mut writer = csv::Writer::from_writer(Vec::new());
    writer.write_record(&columns)?;
    for row in rows {
        writer.write_record(columns.iter().map(|c| match row.get(*c) {
            Some(Value::Number(n)) => n.to_string(),
            other => text(other),
        }))?;
    }
    Ok(String::from_utf8(writer.into_inner()?)?)
}

/// Rows as columns of text.
pub fn plain(rows: &[Row]) -> String {
    let columns = columns(rows);
    let mut cells: Vec<Vec<String>> = vec![columns.iter().map(|c| (*c).to_owned()).collect()];
    cells.extend(rows.iter().map(|row| columns.iter().map(|c| text(row.get(*c))).collect()));
    let width = |c: usize| cells.iter().map(|row| row[c].chars().count()).max().unwrap_or(0);
    let widths: Vec<usize> = (0..columns.len()).map(width).collect();
    cells
        .iter()
        .map(|row| {
            let line: Vec<String> = row.iter().zip(&widths).map(|(c, &w)| format!("{c:<w$}")).collect();
            line.join("  ").trim_end().to_owned() + "\n"
        })
        .collect()
}

/// Rows that agree in `keys`, in order of their first use, under the values of the keys.
fn groups<'a>(rows: &'a [Row], keys: &[&str]) -> Vec<(Row, Vec<&'a Row>)> {
    let mut groups: Vec<(Row, Vec<&Row>)> = Vec::new();
    for row in rows {
        let key: Row =
            keys.iter().filter_map(|k| row.get(*k).map(|v| ((*k).to_owned(), v.clone()))).collect();
        match groups.iter_mut().find(|(k, _)| *k == key) {
            Some((_, members)) => members.push(row),
            None => groups.push((key, vec![row])),
        }
    }
    groups
}

/// One number for the rows that agree in `keys`, of every column with numbers; and how many rows these are, since such
/// numbers are comparable only over the same rows.
fn summary(rows: &[Row], keys: &[&str], of: impl Fn(&[&Row], &str) -> Option<f64>) -> Vec<Row> {
    let columns = columns(rows);
    groups(rows, keys)
        .into_iter()
        .map(|(mut key, members)| {
            key.insert("rows".into(), members.len().into());
            for column in columns.iter().filter(|c| !keys.contains(c)) {
                if let Some(number) = of(&members, column) {
                    key.insert((*column).to_owned(), number.into());
                }
            }
            key
        })
        .collect()
}

fn numbers<'a>(rows: &'a [&Row], column: &'a str) -> impl Iterator<Item = f64> + 'a {
    rows.iter().filter_map(move |r| r.get(column).and_then(Value::as_f64))
}

/// The mean of every number over the rows that agree in `keys`.
pub fn means(rows: &[Row], keys: &[&str]) -> Vec<Row> {
    summary(rows, keys, |members, column| Some(mean(numbers(members, column))).filter(|m| !m.is_nan()))
}

/// The median of every number over the rows that agree in `keys`.
pub fn medians(rows: &[Row], keys: &[&str]) -> Vec<Row> {
    summary(rows, keys, |members, column| quantile(&sorted(numbers(members, column)), 0.5))
}

/// The standard error of each of the [`means`]. Rows of one `clip` are not independent: their mean counts once. None where
/// fewer than two clips have the number.
pub fn standard_errors(rows: &[Row], keys: &[&str]) -> Vec<Row> {
    summary(rows, keys, |members, column| {
        let mut clips: Vec<(Option<&Value>, Vec<f64>)> = Vec::new();
        for row in members {
            let Some(number) = row.get(column).and_then(Value::as_f64) else { continue };
            let clip = row.get("clip");
            match clips.iter_mut().find(|(c, _)| clip.is_some() && *c == clip) {
                Some((_, of)) => of.push(number),
                None => clips.push((clip, vec![number])),
            }
        }
        let of_clips: Vec<f64> = clips.into_iter().map(|(_, of)| mean(of)).collect();
        let count = of_clips.len() as f64;
        let spread = variance(of_clips.iter().copied()) * count / (count - 1.0);
        (count > 1.0).then(|| (spread / count).sqrt())
    })
}

/// Means with their standard errors, as text: `2.0600 ± 0.0400`.
pub fn with_errors(means: &[Row], errors: &[Row]) -> Vec<Row> {
    let join = |mean: &Row, error: &Row| {
        let cell = |(column, value): (&String, &Value)| {
            let plain = || value.clone();
            let known = error.get(column).filter(|e| e.is_f64() && value.is_f64());
            let both = |e| Value::String(format!("{} ± {}", text(Some(value)), text(Some(e))));
            (column.clone(), known.map_or_else(plain, both))
        };
        mean.iter().map(cell).collect()
    };
    means.iter().zip(errors).map(|(mean, error)| join(mean, error)).collect()
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;

    fn rows() -> Vec<Row> {
        [json!({"m": "a,\"b\"", "e": 1.0}), json!({"m": "c", "n": 3}), json!({"m": "c", "n": 5, "e": 2.0})]
            .into_iter()
            .filter_map(|v| v.as_object().cloned())
            .collect()
    }

    #[test]
    fn csv_quotes_and_fills_what_is_missing() {
        assert_eq!(csv(&rows()).unwrap(), "m,e,n\n\"a,\"\"b\"\"\",1.0,\nc,,3\nc,2.0,5\n");
    }

    #[test]
    fn means_go_over_what_is_there() {
        let means = means(&rows(), &["m"]);
        assert_eq!(means.len(), 2);
        assert_eq!(means[1]["rows"], 2);
        assert_eq!((means[1]["n"].as_f64(), means[1]["e"].as_f64()), (Some(4.0), Some(2.0)));
    }

    #[test]
    fn rows_of_one_clip_count_once_in_a_standard_error() {
        let row = |clip: &str, e: f64| json!({"m": "a", "clip": clip, "e": e}).as_object().unwrap().clone();
        let rows = [row("x", 1.0), row("x", 3.0), row("y", 4.0)];
        // Means 2 and 4: deviation sqrt(2), over sqrt(2).
        assert_eq!(standard_errors(&rows, &["m"])[0]["e"].as_f64(), Some(1.0));
        assert!(standard_errors(&rows[..2], &["m"])[0].get("e").is_none());
        assert_eq!(medians(&rows, &["m"])[0]["e"].as_f64(), Some(3.0));
    }
}
