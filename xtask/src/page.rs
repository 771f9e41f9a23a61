//! `cargo xtask wasm`, the page of `gestus page`.
//!
//! 1. the style polygon's arithmetic, in node;
//! 2. the glTF that `gestus translate` writes, in the Khronos validator;
//! 3. the page in a headless Chromium: files are dropped on it, one of them packed by meshoptimizer, and the point of the
//!    polygon is dragged; a corner, a method, a timing, a unit, up, a floor, a root and a loop are chosen. Each digest and
//!    verdict is that of `gestus translate` with the same settings.

use std::{
    fs,
    path::{Path, PathBuf},
    process::Command,
};

use anyhow::{Context, Result, bail, ensure};
use serde_json::Value;

use crate::{
    browser,
    shell::{built, cargo, command, json, root, run as run_command, target_dir},
    target::Source,
    tools,
};

const CRATE: &str = "builder/page";
const VALIDATOR: &str = "gltf-validator";
const VALIDATOR_VERSION: &str = "2.0.0-dev.3.10";
/// Milliseconds of its own that the page gets.
const MILLIS: u32 = 90_000;
/// A walk that meshoptimizer packed, which a test of the builder keeps.
const PACKED: &str = "walk-packed.glb";

/// Does all of it; returns what is missing for the rest.
///
/// # Errors
/// Where something of it fails.
pub fn run(source: Source, setup: bool) -> Result<Vec<String>> {
    let has_node = tools::has("node");
    if has_node {
        run_command(command("node").arg(root().join(CRATE).join("polygon.test.js")))?;
    }
    if source != Source::Installed {
        return Ok(vec!["no std for the page's module: `rustup target add wasm32-unknown-unknown`".into()]);
    }
    run_command(
        cargo().args(["fmt", "--check", "--manifest-path"]).arg(root().join(CRATE).join("Cargo.toml")),
    )?;
    let files = Files::make()?;
    let mut missing = Vec::new();
    match validator(setup) {
        _ if !has_node => missing.push("no node".into()),
        Some(folder) => validate(&files, &folder)?,
        None => missing.push(format!("no {VALIDATOR} (`--setup` gets it with npm)")),
    }
    if let Some(browser) = tools::browser() {
        in_browser(browser, &files)?;
    }
    Ok(missing)
}

/// A small database, its page, and clips to drop on it.
struct Files {
    folder: PathBuf,
    db: PathBuf,
    page: PathBuf,
    clips: [PathBuf; 3],
}

impl Files {
    fn make() -> Result<Self> {
        let folder = target_dir().join("recorded/page");
        let [data, db, page] = ["data", "walks.gestus", "folder"].map(|name| folder.join(name));
        fs::create_dir_all(&folder).with_context(|| format!("{} can't be made", folder.display()))?;
        let mut synth = built("gestus")?;
        synth.args(["synth", "--actions", "walk", "--styles", "neutral,proud,old", "--clips", "2", "-o"]);
        run_command(synth.arg(&data))?;
        run_command(built("gestus")?.args(["build", "--data"]).arg(&data).arg("-o").arg(&db))?;
        run_command(built("gestus")?.args(["page", "--db"]).arg(&db).arg("-o").arg(&page))?;
        let packed = root().join(CRATE).join(PACKED);
        let clips = [data.join("walk_neutral_001.bvh"), page.join("sample.glb"), packed];
        Ok(Self { folder, db, page, clips })
    }

    /// `gestus translate` of a clip.
    fn translate(&self, clip: &Path, options: &[&str], output: &Path) -> Result<Command> {
        let mut translate = built("gestus")?;
        translate.args(["translate", "--json", "--db"]).arg(&self.db).arg("--input").arg(clip);
        translate.args(options).arg("-o").arg(output);
        Ok(translate)
    }
}

/// The folder of the validator, if it is there; gets it where that is wanted.
fn validator(setup: bool) -> Option<PathBuf> {
    let home = target_dir().join("npm");
    let folder = home.join("node_modules").join(VALIDATOR);
    if setup && !folder.is_dir() {
        let mut npm = command("npm");
        npm.args(["install", "--no-save", "--no-audit", "--no-fund", "--prefix"]).arg(&home);
        npm.arg(format!("{VALIDATOR}@{VALIDATOR_VERSION}"));
        tools::try_all(&mut [npm]);
    }
    folder.is_dir().then_some(folder)
}

/// Validates what the commands write: the sample, and a translation of it in its place and beside it.
fn validate(files: &Files, validator: &Path) -> Result<()> {
    let sample = &files.clips[1];
    let [replaced, added] = ["replaced.glb", "added.glb"].map(|name| files.folder.join(name));
    json(&mut files.translate(sample, &["--style", "proud"], &replaced)?)?;
    json(&mut files.translate(sample, &["--style", "old", "--animation", "old"], &added)?)?;
    let mut node = command("node");
    node.arg(root().join(CRATE).join("validate.js")).arg(validator);
    run_command(node.arg(sample).arg(&replaced).arg(&added))
}

/// Uses the page as a person would, and compares its digests with the command's.
fn in_browser(browser: &str, files: &Files) -> Result<()> {
    let page = files.folder.join("checked");
    fs::create_dir_all(&page)?;
    for entry in fs::read_dir(&files.page)? {
        let entry = entry?;
        fs::copy(entry.path(), page.join(entry.file_name()))?;
    }
    let index = page.join("index.html");
    let html = fs::read_to_string(&index)?;
    let scripts = "<script src=\"files.js\"></script>\n<script src=\"check.js\"></script>\n</body>";
    fs::write(&index, html.replace("</body>", scripts))?;
    fs::copy(root().join(CRATE).join("check.js"), page.join("check.js"))?;
    let mut checks = Vec::new();
    for clip in &files.clips {
        let name = clip.file_name().unwrap_or_default().to_string_lossy().into_owned();
        checks.push(serde_json::json!({ "name": name, "bytes": fs::read(clip)? }));
    }
    fs::write(page.join("files.js"), format!("const CHECKS = {};\n", Value::from(checks)))?;
    let dom = browser::document(browser, &files.folder, &index, "", MILLIS)?;
    let list = |name: &str| -> Result<Vec<Value>> {
        let text = browser::attribute(&dom, name).with_context(|| {
            format!("the page has no {name}: {:?}", browser::attribute(&dom, "data-error"))
        })?;
        Ok(serde_json::from_str(&text)?)
    };
    let results = list("data-results")?;
    let (broken, results) = results.split_last().context("the page has no results")?;
    ensure!(broken["error"].as_str().is_some_and(|e| e.contains("broken.bvh")), "a broken file: {broken}");
    let mut results = results.iter();
    for clip in &files.clips {
        let is_bvh = clip.extension().is_some_and(|ending| ending == "bvh");
        let more: [&[&str]; 8] = [
            &[],
            &[],
            &["--method", "phase", "--timing", "sync"],
            &[],
            &["--floor", "0.12", "--root", "in-place"],
            &["--unit", if is_bvh { "inch" } else { "0.5" }],
            &["--up", "z"],
            &["--loop"],
        ];
        for more in more {
            let seen = results.next().context("the page ended before its checks")?;
            let style = mix(seen)?;
            let options = [&["--style", style.as_str()], more].concat();
            let output = files.folder.join("out").with_extension(clip.extension().unwrap_or_default());
            let figures = json(&mut files.translate(clip, &options, &output)?)?;
            println!("{}, {style}: {}, here {}", seen["what"], seen["digest"], figures["digest"]);
            if seen["digest"] != figures["digest"] {
                bail!("the page does not compute what the command does: {seen}");
            }
            ensure!(
                seen["verdict"] == figures["verdict"]["text"],
                "another verdict than the command's: {seen}"
            );
            let body = seen["body"].as_str().and_then(|frames| frames.parse().ok());
            ensure!(body == figures["output_frames"].as_u64(), "no body of the database: {seen}");
        }
    }
    let saved = list("data-saved")?;
    ensure!(
        saved.len() == files.clips.len() && saved.iter().all(|n| n.as_u64() > Some(1000)),
        "nothing is saved: {saved:?}"
    );
    Ok(())
}

/// The weights of the styles at the polygon's point, as `--style` takes them.
fn mix(seen: &Value) -> Result<String> {
    let weights: Vec<f64> =
        serde_json::from_str(seen["mix"].as_str().context("the page does not say its mix")?)?;
    // In the database's order.
    let named = ["neutral", "old", "proud"].iter().zip(weights).filter(|(_, weight)| *weight > 0.0);
    Ok(named.map(|(name, weight)| format!("{name}={weight}")).collect::<Vec<_>>().join(","))
}
