//! Compares what two revisions wrote.

use std::{collections::BTreeSet, fs, path::Path};

use anyhow::{Context, Result};
use serde_json::Value;

use super::STDOUT;

/// Values of the JSON output that change from run to run: where, by the start of the case's name, the key, and why.
const VOLATILE: [(&str, &str, &str); 11] = [
    ("", "median_us", "time of a step on this machine"),
    ("", "p99_us", "time of a step on this machine"),
    ("", "us_per_query", "time of a search on this machine"),
    ("build", "seconds", "time that the build took; `seconds` of a stream is its length, which is compared"),
    ("demo", "seconds", "time that the demo took"),
    ("effort-clip", "seconds", "time that the synthesis took"),
    ("transfer", "warp_ms", "time of the time warp"),
    ("transfer", "transfer_ms", "time of the transfer"),
    ("transfer", "clean_up_ms", "time of the removal of foot skate"),
    ("gaussian-process", "fit_s", "time of a regression"),
    ("gaussian-process", "predict_ms", "time of a prediction"),
];
/// Differences that are shown of a case.
const SHOWN: usize = 20;
/// Files that are not compared: reports and pages hold the times of [`VOLATILE`], and their wording may change.
const REPORTS: [&str; 3] = ["report", "html", "svg"];

/// The differences between the folders of a case, as lines to print; none where they are the same.
///
/// # Errors
/// Where a file can't be read.
pub fn folders(case: &str, old: &Path, new: &Path) -> Result<Vec<String>> {
    let (before, after) = (files(old)?, files(new)?);
    let mut differences: Vec<String> = before
        .symmetric_difference(&after)
        .map(|name| {
            format!(
                "{name}: only written by the {} revision",
                if before.contains(name) { "base" } else { "new" }
            )
        })
        .collect();
    for name in before.intersection(&after) {
        let read =
            |folder: &Path| fs::read(folder.join(name)).with_context(|| format!("{name} can't be read"));
        let (before, after) = (read(old)?, read(new)?);
        if name == STDOUT {
            let [before, after] = [before, after].map(|text| String::from_utf8_lossy(&text).into_owned());
            differences.extend(json(case, &before, &after)?);
        } else if before != after {
            let at =
                before.iter().zip(&after).position(|(a, b)| a != b).unwrap_or(before.len().min(after.len()));
            differences.push(format!(
                "{name}: {} bytes, {} bytes; they differ at byte {at}",
                before.len(),
                after.len()
            ));
        }
    }
    let more = differences.len().saturating_sub(SHOWN);
    differences.truncate(SHOWN);
    if more > 0 {
        differences.push(format!("and {more} more"));
    }
    Ok(differences)
}

/// The files of a folder by their paths in it.
fn files(folder: &Path) -> Result<BTreeSet<String>> {
    let mut names = BTreeSet::new();
    for entry in fs::read_dir(folder).with_context(|| format!("{} can't be read", folder.display()))? {
        let path = entry?.path();
        let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
        if REPORTS.iter().any(|r| name == *r || path.extension().is_some_and(|e| e == *r)) {
            continue;
        }
        if path.is_dir() {
            names.extend(files(&path)?.into_iter().map(|inner| format!("{name}/{inner}")));
        } else {
            names.insert(name);
        }
    }
    Ok(names)
}

/// Compares two JSON texts, without the volatile values. The texts decide, so that the order of keys and every digit
/// count; the values are compared only to say where.
fn json(case: &str, old: &str, new: &str) -> Result<Vec<String>> {
    let keys = VOLATILE.iter().filter(|(cases, _, _)| case.starts_with(cases)).map(|(_, key, _)| *key);
    let keys: Vec<&str> = keys.collect();
    let [old, new] = [old, new].map(|text| without(text, &keys));
    if old == new {
        return Ok(Vec::new());
    }
    let parse = |text: &str| {
        serde_json::from_str(text).with_context(|| format!("{case}: standard output is not JSON"))
    };
    let mut differences = Vec::new();
    compare("$", &parse(&old)?, &parse(&new)?, &mut differences);
    if differences.is_empty() {
        differences.push("the same values in another order or notation".into());
    }
    Ok(differences)
}

/// A JSON text in which the numbers of these keys are `null`.
fn without(text: &str, keys: &[&str]) -> String {
    let mut text = text.to_owned();
    for key in keys {
        let key = format!("\"{key}\":");
        let mut parts = text.split(&key);
        let mut kept = parts.next().unwrap_or_default().to_owned();
        for part in parts {
            let rest =
                part.trim_start().trim_start_matches(|c: char| c.is_ascii_digit() || "+-.eE".contains(c));
            kept += &key;
            kept += if rest.len() < part.trim_start().len() { "null" } else { "" };
            kept += rest;
        }
        text = kept;
    }
    text
}

/// Adds a line for each difference: the path, the old and the new value.
fn compare(path: &str, old: &Value, new: &Value, differences: &mut Vec<String>) {
    match (old, new) {
        (Value::Object(a), Value::Object(b)) => {
            for (key, old) in a {
                compare(&format!("{path}.{key}"), old, b.get(key).unwrap_or(&Value::Null), differences);
            }
            let added = b.iter().filter(|(key, _)| !a.contains_key(*key));
            differences.extend(added.map(|(key, new)| format!("{path}.{key}: new: {new}")));
        }
        (Value::Array(a), Value::Array(b)) => {
            if a.len() != b.len() {
                differences.push(format!("{path}: {} elements, {} elements", a.len(), b.len()));
            }
            for (i, (old, new)) in a.iter().zip(b).enumerate() {
                compare(&format!("{path}[{i}]"), old, new, differences);
            }
        }
        _ if old != new => differences.push(format!("{path}: {old}, {new}")),
        _ => {}
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn volatile_values_are_left_out_by_case() {
        let (old, new) = (r#"{"median_us":1.5e-3,"seconds":2.0}"#, r#"{"median_us":7,"seconds":3.0}"#);
        assert!(json("build", old, new).unwrap().is_empty());
        assert_eq!(json("mar", old, new).unwrap(), ["$.seconds: 2.0, 3.0"]);
        assert!(json("mar", r#"{"median_us":null}"#, r#"{"median_us":2}"#).unwrap().is_empty());
    }

    #[test]
    fn differences_are_named_by_path() {
        let old = r#"{"rows":[{"a":1,"b":"x"},{"a":2}],"c":1}"#;
        let new = r#"{"rows":[{"a":1,"b":"y"}],"d":1}"#;
        let expected =
            ["$.rows: 2 elements, 1 elements", "$.rows[0].b: \"x\", \"y\"", "$.c: 1, null", "$.d: new: 1"];
        assert_eq!(json("mar", old, new).unwrap(), expected);
        // Text decides: order and notation count.
        assert_eq!(json("mar", r#"{"a":1,"b":2}"#, r#"{"b":2,"a":1}"#).unwrap().len(), 1);
        assert_eq!(json("mar", r#"{"a":1.0}"#, r#"{"a":1.00}"#).unwrap().len(), 1);
    }

    #[test]
    fn files_are_compared_byte_for_byte_and_reports_are_not() {
        let folder = std::env::temp_dir().join(format!("gestus-same-{}", std::process::id()));
        let write = |name: &str, text: &str| {
            let path = folder.join(name);
            fs::create_dir_all(path.parent().unwrap()).unwrap();
            fs::write(path, text).unwrap();
        };
        for side in ["old", "new"] {
            write(&format!("{side}/a/same.npy"), "same");
            write(&format!("{side}/report/table.csv"), side);
            write(&format!("{side}/page.html"), side);
            write(&format!("{side}/out.bvh"), side);
        }
        write("new/more.bvh", "");
        let found = folders("mar", &folder.join("old"), &folder.join("new"));
        fs::remove_dir_all(&folder).unwrap();
        let expected = [
            "more.bvh: only written by the new revision",
            "out.bvh: 3 bytes, 3 bytes; they differ at byte 0",
        ];
        assert_eq!(found.unwrap(), expected);
    }
}
