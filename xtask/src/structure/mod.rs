//! `cargo xtask structure`: limits that keep the sources easy to walk through.
//!
//! - **No circles.** A file depends on another where its code, without tests, imports or names something that the
//!   other one defines. Paths are followed through re-exports to the file of the definition. So a `mod.rs` that only
//!   declares and re-exports its children depends on none of them, and whoever imports through it does not depend on
//!   it. A child that uses what its own `mod.rs` defines is in a circle if that file's code uses what the child
//!   defines. Methods are not followed, since they need no import. See [`graph`].
//! - At most 18 entries directly in the `src` of the core and of each crate of the builder.
//! - No file over 400 lines without its tests, but for five at most that say why in a line `// Over 400 lines: ...`.
//! - No function over 100 lines, from its signature to its closing brace.

mod graph;
mod source;

use std::{collections::BTreeMap, fs, path::Path};

use anyhow::{Context, Result};

use crate::shell::{Outcome, command, root, run_for_stdout};
use graph::Crate;
use source::Source;

/// Most entries in a `src` folder.
const ENTRIES: usize = 18;
/// Most lines of a file, without its tests.
const LINES: usize = 400;
/// What a longer file says at its top, with the reason behind it.
const REASON: &str = "// Over 400 lines: ";
/// Most files that may be longer.
const LONG: usize = 5;
/// Most lines of a function.
const FUNCTION_LINES: usize = 100;
/// Crates whose files are drawn.
const DRAWN: [&str; 2] = ["core", "builder"];

/// Checks all limits and prints what is over one.
///
/// # Errors
/// Where a source can't be read or parsed.
pub fn run() -> Result<Outcome> {
    let list = run_for_stdout(command("git").args([
        "ls-files",
        "--cached",
        "--others",
        "--exclude-standard",
        "*.rs",
    ]))?;
    let mut sources = BTreeMap::new();
    for path in list.lines().filter(|path| root().join(path).is_file()) {
        let text = fs::read_to_string(root().join(path)).with_context(|| format!("{path} can't be read"))?;
        sources.insert(path.to_owned(), Source::parse(&text).with_context(|| path.to_owned())?);
    }
    let mut wrong = lengths(&sources);
    for folder in source_folders(&sources) {
        let entries = fs::read_dir(root().join(&folder))?.count();
        if entries > ENTRIES {
            wrong.push(format!("{folder}: {entries} entries, at most {ENTRIES}"));
        }
        wrong.extend(["lib.rs", "main.rs"].iter().flat_map(|name| {
            let circles = Crate::new(&sources, &format!("{folder}/{name}")).circles();
            circles.into_iter().map(|circle| format!("a circle of files:\n    {}", circle.join("\n    ")))
        }));
    }
    for line in &wrong {
        println!("{line}");
    }
    println!("{} files", sources.len());
    Ok(if wrong.is_empty() {
        Outcome::Passed
    } else {
        Outcome::Failed(format!("{} limits are not kept", wrong.len()))
    })
}

/// The `src` folders of the crates that are drawn.
fn source_folders(sources: &BTreeMap<String, Source>) -> Vec<String> {
    let is_drawn = |path: &str| DRAWN.iter().any(|d| path.split('/').next() == Some(d));
    let roots = sources.keys().filter(|path| is_drawn(path));
    let folders =
        roots.filter_map(|path| path.strip_suffix("/lib.rs").or_else(|| path.strip_suffix("/main.rs")));
    let mut folders: Vec<String> = folders.filter(|f| f.ends_with("/src")).map(str::to_owned).collect();
    folders.dedup();
    folders
}

/// Files and functions that are too long. Files of tests and benches are not looked at.
fn lengths(sources: &BTreeMap<String, Source>) -> Vec<String> {
    let is_product =
        |path: &str| !path.split('/').any(|part| ["tests", "benches", "tests.rs"].contains(&part));
    let (mut wrong, mut long) = (Vec::new(), Vec::new());
    for (path, source) in sources.iter().filter(|(path, _)| is_product(path)) {
        if source.lines > LINES {
            let reason = source.reason.is_some();
            long.extend(reason.then(|| path.clone()));
            wrong.extend(
                (!reason).then(|| format!("{path}: {} lines without tests, at most {LINES}", source.lines)),
            );
        }
        let functions = source.functions.iter().filter(|f| f.lines > FUNCTION_LINES);
        wrong.extend(functions.map(|f| {
            format!("{path}:{}: `{}` has {} lines, at most {FUNCTION_LINES}", f.line, f.name, f.lines)
        }));
    }
    if long.len() > LONG {
        wrong.push(format!("{} files over {LINES} lines, at most {LONG}: {}", long.len(), long.join(", ")));
    }
    wrong
}

/// The module's name of a file's path in its crate: `src/a/b.rs` and `src/a/b/mod.rs` are `b` in `a`.
fn module_file(folder: &str, name: &str, is_there: impl Fn(&str) -> bool) -> Option<String> {
    let inner = Path::new(folder).join(name);
    let candidates = [inner.with_extension("rs"), inner.join("mod.rs")];
    candidates.iter().map(|path| path.to_string_lossy().into_owned()).find(|path| is_there(path))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn long_functions_and_files_are_named() {
        let long = format!("fn short() {{}}\nfn long() {{\n{}}}\n", "    call();\n".repeat(100));
        let tests =
            format!("fn f() {{}}\n#[cfg(test)]\nmod tests {{\n{}}}\n", "    // A line.\n".repeat(500));
        let file = |text: &str| Source::parse(text).unwrap();
        let lines = "// A line.\n".repeat(401);
        let sources = BTreeMap::from([
            ("a/src/a.rs".to_owned(), file(&long)),
            ("a/src/b.rs".to_owned(), file(&tests)),
            ("a/src/c.rs".to_owned(), file(&lines)),
            ("a/src/d.rs".to_owned(), file(&format!("{REASON}one table.\n{lines}"))),
            ("a/tests/e.rs".to_owned(), file(&lines)),
        ]);
        let expected = [
            "a/src/a.rs:2: `long` has 102 lines, at most 100",
            "a/src/c.rs: 401 lines without tests, at most 400",
        ];
        assert_eq!(lengths(&sources), expected);
    }
}
