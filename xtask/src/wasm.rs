//! `cargo xtask wasm`: the core as a wasm module, in node and in a browser.
//!
//! 1. builds `firmware-sim/web`, which `gestus-sim view` puts into its pages;
//! 2. runs a recording of 10,000 frames, in which styles and labels change, through it in node: the host's digest;
//! 3. makes a page, opens it in a headless Chromium, and lets it play: no error, and the host's digest.
//!
//! What is missing is said, and the rest is done.

use std::{fs, path::Path, process::Command, time::Duration};

use anyhow::{Context, Result, bail};

use crate::{
    recording::{Recorded, record},
    shell::{Outcome, cargo, command, root, run as run_command, run_within, sim, target_dir},
    target, tools,
};

const CRATE: &str = "firmware-sim/web";
const TARGET: &str = "wasm32-unknown-unknown";
/// Frames of the long stream, which the boards are tried with too (`cargo xtask firmware`).
const FRAMES: u32 = 10_000;
/// Frames that a page plays at the least in ten seconds of its own time.
const LEAST_PLAYED: u32 = 100;
const PATIENCE: Duration = Duration::from_secs(120);

/// What is missing to build the module, after trying to install it where that is wanted.
pub fn missing(setup: bool) -> Option<String> {
    target::find(TARGET, setup).err()
}

/// Does all of it.
///
/// # Errors
/// Where something of it fails.
pub fn run(setup: bool) -> Result<Outcome> {
    let source = match target::find(TARGET, setup) {
        Ok(source) => source,
        Err(missing) => return Ok(Outcome::Skipped(missing)),
    };
    let manifest = root().join(CRATE).join("Cargo.toml");
    run_command(cargo().args(["fmt", "--check", "--manifest-path"]).arg(&manifest))?;
    // Where `gestus-sim view` looks for it.
    let folder = target_dir().join("wasm");
    let mut build = source.cargo("build", TARGET);
    build.args(["--release", "--quiet", "--manifest-path"]).arg(&manifest).arg("--target-dir").arg(&folder);
    run_command(build.env("RUSTFLAGS", source.linker(TARGET)))?;
    let module = folder.join(TARGET).join("release/gestus_web.wasm");
    println!("{}: {} bytes", module.display(), fs::metadata(&module)?.len());

    let missing = tools::missing(&["node", "chromium"], setup);
    let recorded = record(FRAMES)?;
    if tools::has("node") {
        let mut node = command("node");
        node.arg(root().join(CRATE).join("run.js")).arg(&module);
        run_command(node.arg(&recorded.blob).arg(&recorded.stream))?;
    }
    if let Some(browser) = tools::browser() {
        in_browser(browser, &recorded)?;
    }
    Ok(Outcome::passed_but_for(missing))
}

/// Opens a page headless and reads what it says about itself after it has checked its digest and played.
fn in_browser(browser: &str, recorded: &Recorded) -> Result<()> {
    let folder = target_dir().join("recorded");
    let page = folder.join("view.html");
    run_command(sim()?.args(["view", "--db"]).arg(&recorded.blob).arg("-o").arg(&page))?;
    let profile = folder.join(format!("chromium-{}", std::process::id()));
    let (done, dom) = run_within(&mut headless(browser, &profile, &page), PATIENCE)?;
    fs::remove_dir_all(&profile).ok();
    if !done {
        bail!("{browser} does not open {} in time:\n{dom}", page.display());
    }
    let state = attribute(&dom, "data-state").context("the page does not say how it is")?;
    let frames: u32 = attribute(&dom, "data-frames").and_then(|f| f.parse().ok()).unwrap_or(0);
    let (digest, expected) = (attribute(&dom, "data-digest"), attribute(&dom, "data-expected"));
    let tried = attribute(&dom, "data-tried").unwrap_or("nothing");
    println!("{browser}: the page is `{state}`: {frames} frames played, digest {digest:?}, tried {tried}");
    let plays = state == "playing" && frames >= LEAST_PLAYED && tried == "style, strength, label";
    if !plays || digest.is_none() || digest != expected {
        let error = attribute(&dom, "data-error").unwrap_or("no error is said");
        bail!("{} does not play, or not with the host's digest {expected:?}: {error}", page.display());
    }
    Ok(())
}

/// A browser that opens a page, lets it run for ten seconds of its own time, and writes what has become of it.
fn headless(browser: &str, profile: &Path, page: &Path) -> Command {
    let mut chromium = command(browser);
    chromium.args(["--headless", "--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run"]);
    chromium.args(["--disable-background-networking", "--disable-component-update", "--disable-sync"]);
    chromium.arg(format!("--user-data-dir={}", profile.display()));
    // `#check` begins to play at once, and uses the controls on the way.
    chromium
        .args(["--virtual-time-budget=10000", "--dump-dom"])
        .arg(format!("file://{}#check", page.display()));
    chromium
}

/// The value of the first attribute of that name.
fn attribute<'a>(html: &'a str, name: &str) -> Option<&'a str> {
    let rest = html.split_once(&format!("{name}=\""))?.1;
    rest.split_once('"').map(|(value, _)| value)
}

#[cfg(test)]
mod tests {
    #[test]
    fn attributes_are_found() {
        let html = r#"<html data-state="playing" data-digest="00c0ffee"><p>data-frames</p>"#;
        assert_eq!(super::attribute(html, "data-digest"), Some("00c0ffee"));
        assert_eq!(super::attribute(html, "data-frames"), None);
    }
}
