//! Rows of figures as CSV and text.

use serde_json::{Map, Value};

use gestus_motion::statistics::mean;

/// A row: names and values, in order.
pub type Row = Map<String, Value>;

/// Names of all columns, in order of their first use.
pub fn columns(rows: &[Row]) -> Vec<&str> {
    let mut names: Vec<&str> = Vec::new();
    for name in rows.iter().flat_map(Map::keys) {
        if !names.contains(&name.as_str()) {
            names.push(name);
        }
    }
    names
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

/// The mean of every number over the rows that agree in `keys`, in order of their first use, and the number of these rows,
/// since means are comparable only over the same rows.
pub fn means(rows: &[Row], keys: &[&str]) -> Vec<Row> {
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
        .into_iter()
        .map(|(mut key, members)| {
            key.insert("rows".into(), members.len().into());
            for column in columns(rows) {
                let mean = mean(members.iter().filter_map(|m| m.get(column).and_then(Value::as_f64)));
                if !mean.is_nan() && !keys.contains(&column) {
                    key.insert(column.to_owned(), mean.into());
                }
            }
            key
        })
        .collect()
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
}
