//! Rows of figures as CSV and text.

use serde_json::{Map, Value};

use gestus_motion::statistics::{mean, median};

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

/// One number for the rows that agree in `keys`, of every column with numbers; and how many rows these are, those that
/// lack a number included.
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
    summary(rows, keys, |members, column| median(numbers(members, column)))
}

/// The standard error of each of the [`means`]. Rows of one `clip` or one `truth` are not independent: the error is that of
/// clustering by both (Cameron, Gelbach and Miller 2011), and at least that by either. None where fewer than two clips, or
/// truths, have the number.
pub fn standard_errors(rows: &[Row], keys: &[&str]) -> Vec<Row> {
    summary(rows, keys, |members, column| {
        let [clips, truths] = [&["clip"][..], &["truth"]].map(|by| clustered(members, column, by));
        let both = clustered(members, column, &["clip", "truth"])?;
        let (clips, truths) = (clips?, truths?);
        Some((clips + truths - both).max(clips).max(truths).sqrt())
    })
}

/// The squared standard error of a column's mean, where rows that agree in all columns `by` depend on each other, and a row
/// that lacks one of these on none. None for fewer than two groups.
fn clustered(members: &[&Row], column: &str, by: &[&str]) -> Option<f64> {
    let of = mean(numbers(members, column));
    let mut groups: Vec<(Option<Vec<&Value>>, f64)> = Vec::new();
    let mut rows = 0.0;
    for row in members {
        let Some(number) = row.get(column).and_then(Value::as_f64) else { continue };
        rows += 1.0;
        let key: Option<Vec<&Value>> = by.iter().map(|k| row.get(*k).filter(|v| !v.is_null())).collect();
        match groups.iter_mut().find(|(k, _)| key.is_some() && *k == key) {
            Some((_, sum)) => *sum += number - of,
            None => groups.push((key, number - of)),
        }
    }
    let count = groups.len() as f64;
    let squares: f64 = groups.iter().map(|(_, sum)| sum * sum).sum();
    (count > 1.0).then(|| squares / (rows * rows) * count / (count - 1.0))
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
    fn rows_of_one_clip_or_truth_are_not_independent() {
        let row = |clip: &str, e: f64| json!({"m": "a", "clip": clip, "e": e}).as_object().unwrap().clone();
        let rows = [row("x", 1.0), row("x", 3.0), row("y", 4.0)];
        // Sums of deviations from 8/3: -4/3 and 4/3, over three rows, of two groups.
        let error = |rows: &[Row]| standard_errors(rows, &["m"])[0]["e"].as_f64().unwrap();
        assert!((error(&rows) - 8.0 / 9.0).abs() < 1e-12);
        assert!(standard_errors(&rows[..2], &["m"])[0].get("e").is_none());
        assert_eq!(medians(&rows, &["m"])[0]["e"].as_f64(), Some(3.0));
        // Four clips of two truths, and two clips to two truths each: either way there are two samples.
        let of = |clip: &str, truth: &str, e: f64| {
            json!({"m": "a", "clip": clip, "truth": truth, "e": e}).as_object().unwrap().clone()
        };
        let truths = [of("w", "t", 1.0), of("x", "t", 1.0), of("y", "u", 3.0), of("z", "u", 3.0)];
        let clips = [of("w", "s", 1.0), of("w", "t", 1.0), of("y", "u", 3.0), of("y", "v", 3.0)];
        for rows in [truths, clips] {
            assert!((error(&rows) - 1.0).abs() < 1e-12);
        }
    }
}
