//! The character that a database is built for.

use std::path::PathBuf;

use anyhow::{Result, bail};
use gestus_database::data_folder::config::Config;
use gestus_motion::unit::Unit;

/// The character that a database is built for.
#[derive(clap::Args)]
pub struct RigArgs {
    /// A character, glTF with or without animations or BVH, whose skeleton the database gets: all clips are retargeted to it
    #[arg(long, value_name = "FILE")]
    pub rig: Option<PathBuf>,
    /// Which joint of the character is which body part, as --map of `translate`
    #[arg(long, value_name = "FILE")]
    pub rig_map: Option<PathBuf>,
    /// Unit of the character's lengths: m, cm, mm, inch, cmu, or metres a unit. Default: as that of a clip, by its height
    #[arg(long, value_name = "UNIT")]
    pub rig_unit: Option<Unit>,
}

impl RigArgs {
    /// Applies the options to a configuration.
    ///
    /// # Errors
    /// A map or a unit without a character.
    pub fn apply(&self, config: &mut Config) -> Result<()> {
        config.rig = self.rig.clone().or(config.rig.take());
        config.rig_map = self.rig_map.clone().or(config.rig_map.take());
        config.rig_unit = self.rig_unit.map(Unit::name).or(config.rig_unit.take());
        for (option, is_there) in
            [("--rig-map", config.rig_map.is_some()), ("--rig-unit", config.rig_unit.is_some())]
        {
            if config.rig.is_none() && is_there {
                bail!("{option} without --rig: name the character that it is for");
            }
        }
        let file = config.rig.as_ref().and_then(|rig| rig.file_name());
        config.build.rig = file.map(|file| file.to_string_lossy().into_owned()).unwrap_or_default();
        Ok(())
    }
}
