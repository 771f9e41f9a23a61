//! `cargo xtask wasm`: the core as a wasm module, in node and in a browser.
//!
//! 1. builds `firmware-sim/web`, which `gestus-sim view` puts into its pages;
//! 2. runs a recording of 10,000 frames, in which styles and labels change, through it in node: the host's digest;
//! 3. makes a page, opens it in a headless Chromium, and lets it play: no error, and the host's digest;
//! 4. tries the page of `gestus page` ([`page`]).
//!
//! What is missing is said, and the rest is done.

use std::fs;

use anyhow::{Context, Result, bail};

use crate::{
    browser::{attribute, document},
    page,
    recording::{Recorded, record},
    shell::{Outcome, cargo, command, root, run as run_command, sim, target_dir},
    target, tools,
};

const CRATE: &str = "firmware-sim/web";
const TARGET: &str = "wasm32-unknown-unknown";
/// Frames of the long stream, which the boards are tried with too (`cargo xtask firmware`).
const FRAMES: u32 = 10_000;
/// Frames that a page plays at the least in ten seconds of its own time.
const MIN_PLAYED_FRAMES: u32 = 100;

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
    let missing = missing.into_iter().chain(page::run(source, setup)?);
    Ok(Outcome::passed_but_for(missing))
}

/// Opens a page headless and reads what it says about itself after it has checked its digest and played.
fn in_browser(browser: &str, recorded: &Recorded) -> Result<()> {
    let folder = target_dir().join("recorded");
    let page = folder.join("view.html");
    run_command(sim()?.args(["view", "--db"]).arg(&recorded.blob).arg("-o").arg(&page))?;
    // `#check` begins to play at once, and uses the controls on the way.
    let dom = document(browser, &folder, &page, "check", 10_000)?;
    let attribute = |name| attribute(&dom, name);
    let state = attribute("data-state").context("the page does not say how it is")?;
    let frames: u32 = attribute("data-frames").and_then(|f| f.parse().ok()).unwrap_or(0);
    let (digest, expected) = (attribute("data-digest"), attribute("data-expected"));
    let tried = attribute("data-tried").unwrap_or_else(|| "nothing".into());
    println!("{browser}: the page is `{state}`: {frames} frames played, digest {digest:?}, tried {tried}");
    let plays = state == "playing" && frames >= MIN_PLAYED_FRAMES && tried == "style, strength, label";
    if !plays || digest.is_none() || digest != expected {
        let error = attribute("data-error").unwrap_or_else(|| "no error is said".into());
        bail!("{} does not play, or not with the host's digest {expected:?}: {error}", page.display());
    }
    Ok(())
}
