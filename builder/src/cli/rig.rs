//! The character that a database is built for.

use std::path::PathBuf;

use anyhow::{Result, bail};
use gestus_database::data_folder::config::Config;

/// The character that a database is built for.
#[derive(clap::Args)]
pub struct RigArgs {
    /// A character, glTF with or without animations or BVH, whose skeleton the database gets: all clips are retargeted to it
    #[arg(long, value_name = "FILE")]
    pub rig: Option<PathBuf>,
    /// Which joint of the character is which body part, as --map of `translate`
    #[arg(long, value_name = "FILE")]
    pub rig_map: Option<PathBuf>,
}

impl RigArgs {
    /// Applies the options to a configuration.
    ///
    /// # Errors
    /// A map without a character.
    pub fn apply(&self, config: &mut Config) -> Result<()> {
        config.rig = self.rig.clone().or(config.rig.take());
        config.rig_map = self.rig_map.clone().or(config.rig_map.take());
        if config.rig.is_none() && config.rig_map.is_some() {
            bail!("--rig-map without --rig: name the character that it is for");
        }
        let file = config.rig.as_ref().and_then(|rig| rig.file_name());
        config.build.rig = file.map(|file| file.to_string_lossy().into_owned()).unwrap_or_default();
        Ok(())
    }
}
