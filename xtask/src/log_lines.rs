//! The log lines of an image, as `defmt-print` decodes them.

use anyhow::{Context, Result, bail};

use crate::shell::{command, json, run_for_stdout, sim};

/// What the lines of a short stream have to say.
const EXPECTED: [&str; 3] = ["database open: ", "Hello", "Style"];

/// Streams a little through an image with log lines, and looks for those that a firmware author needs.
///
/// # Errors
/// Where one is missing.
pub fn check() -> Result<()> {
    let built = json(sim()?.args(["board", "m4f", "--build", "--defmt", "--json"]))?;
    let image = built["image"].as_str().context("the path of the image")?.to_owned();
    json(sim()?.args(["board", "m4f", "--generated", "--defmt", "--frames", "3", "--json"]))?;
    let log = std::path::Path::new(&image).with_file_name("m4f.log");
    let bytes = std::fs::File::open(&log).with_context(|| log.display().to_string())?;
    let lines = run_for_stdout(command("defmt-print").args(["-e", &image]).stdin(bytes))?;
    for line in lines.lines().take(8) {
        println!("  {line}");
    }
    let missing: Vec<&str> = EXPECTED.into_iter().filter(|e| !lines.contains(e)).collect();
    if !missing.is_empty() {
        bail!("the log of m4f says nothing of: {}", missing.join(", "));
    }
    Ok(())
}
