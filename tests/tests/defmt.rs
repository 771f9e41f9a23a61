//! Every public type of the core can be logged: it derives `defmt::Format` behind the feature, or implements it.

use std::{fs, path::Path};

fn sources(folder: &Path, found: &mut Vec<(String, String)>) {
    for entry in fs::read_dir(folder).unwrap().flatten() {
        let path = entry.path();
        if path.is_dir() {
            sources(&path, found);
        } else if path.extension().is_some_and(|e| e == "rs") {
            found.push((path.display().to_string(), fs::read_to_string(&path).unwrap()));
        }
    }
}

/// Name of the public type that a line declares, if any.
fn declared(line: &str) -> Option<&str> {
    let rest = line.strip_prefix("pub struct ").or_else(|| line.strip_prefix("pub enum "))?;
    rest.split(|c: char| !c.is_alphanumeric() && c != '_').next()
}

#[test]
fn every_public_type_can_be_logged() {
    let mut files = Vec::new();
    sources(&Path::new(env!("CARGO_MANIFEST_DIR")).join("../core/src"), &mut files);
    let (mut types, mut silent) = (0, Vec::new());
    for (path, text) in &files {
        let mut attributes = String::new();
        for line in text.lines() {
            if let Some(name) = declared(line) {
                types += 1;
                let by_hand = files.iter().any(|(_, t)| {
                    let joined = t.split_whitespace().collect::<Vec<_>>().join(" ");
                    joined.contains(&format!("defmt::Format for {name}<"))
                });
                if !attributes.contains("derive(defmt::Format)") && !by_hand {
                    silent.push(format!("{path}: {name}"));
                }
            }
            match line.starts_with("#[") || line.starts_with("///") || line.starts_with("//") {
                true => attributes.push_str(line),
                false => attributes.clear(),
            }
        }
    }
    assert!(types > 40, "{types} public types were found");
    assert!(silent.is_empty(), "no defmt::Format: {silent:#?}");
}
