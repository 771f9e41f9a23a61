//! `gestus demo` and `gestus synth`: generated motion, for those who have none.

use std::path::PathBuf;

use anyhow::Result;

/// Generated motion to a database to a stylized clip.
#[derive(clap::Args)]
pub struct DemoArgs {
    /// Folder for everything that is made
    #[arg(long, default_value = "gestus-demo")]
    out: PathBuf,
}

/// Write generated motion as BVH files.
#[derive(clap::Args)]
pub struct SynthArgs {
    /// Folder for the files
    #[arg(short, long)]
    output: PathBuf,
}

/// Runs `demo`.
pub fn demo(_args: &DemoArgs) -> Result<()> {
    anyhow::bail!("waits for the generator")
}

/// Runs `synth`.
pub fn synth(_args: &SynthArgs) -> Result<()> {
    anyhow::bail!("waits for the generator")
}
