//! Which clips of a folder a command uses, and how they become a database.

use std::path::{Path, PathBuf};

use anyhow::{Context, Result, bail};
use gestus_database::{
    build::BuildOptions,
    data_folder::{
        config::Config,
        load::{Loaded, load},
    },
    search::groups,
};
use gestus_motion::clip::{RATES_HZ, expected_rate};

/// Which clips are used, at what rate, and with which joints.
#[derive(clap::Args, Clone, Default)]
pub struct Selection {
    #[command(flatten)]
    pub classes: ClassArgs,
    #[command(flatten)]
    pub frames: FrameArgs,
}

/// Which actions and styles are used.
#[derive(clap::Args, Clone, Default)]
pub struct ClassArgs {
    /// Actions to use, a,b; default: all
    #[arg(long, value_delimiter = ',')]
    pub actions: Vec<String>,
    /// Styles to use, s,t; default: all
    #[arg(long, value_delimiter = ',')]
    pub styles: Vec<String>,
}

/// What is taken of each clip.
#[derive(clap::Args, Clone, Default)]
pub struct FrameArgs {
    /// Joints to keep, a,b. The parent of each must be among them
    #[arg(long, value_delimiter = ',')]
    joints: Vec<String>,
    /// Frames a second to which the clips are resampled, from 1 to 1000
    #[arg(long)]
    pub rate: Option<f64>,
    /// Most clips of each action and style; 0 for all. Clips that can't be used do not count
    #[arg(long)]
    limit: Option<usize>,
    /// Make it an error if a clip can't be used, instead of leaving it out
    #[arg(long)]
    strict: bool,
}

/// The joint groups of a database.
#[derive(clap::Args, Clone, Default)]
pub struct GroupArgs {
    /// Joint groups that can have a mask, a strength and a style of their own, besides `body`, the other joints: words (left-arm,
    /// right-arm, arms, left-leg, right-leg, legs, torso, head) or names with joints, tail=Tail1+Tail2. Default:
    /// left-arm and right-arm
    #[arg(long, value_delimiter = ',')]
    groups: Vec<String>,
}

impl FrameArgs {
    /// The options with their names, and whether each is given.
    pub fn given(&self) -> [(&'static str, bool); 4] {
        [
            ("--joints", !self.joints.is_empty()),
            ("--rate", self.rate.is_some()),
            ("--limit", self.limit.is_some()),
            ("--strict", self.strict),
        ]
    }
}

impl GroupArgs {
    /// True if some are given.
    pub fn is_given(&self) -> bool {
        !self.groups.is_empty()
    }

    /// Sets the groups, if some are given.
    ///
    /// # Errors
    /// A group that is given twice.
    pub fn apply(&self, options: &mut BuildOptions) -> Result<()> {
        if self.is_given() {
            options.groups = groups::parse(&self.groups).context("--groups")?;
        }
        Ok(())
    }
}

impl Selection {
    /// The configuration of a folder, or of a file, with the options of the command line applied to it.
    pub fn config(&self, data: Option<&PathBuf>, file: Option<&PathBuf>) -> Result<Config> {
        let mut config = match (file, data) {
            (Some(file), _) => Config::read(file)?,
            (None, Some(data)) => Config::of_folder(data)?,
            (None, None) => bail!("give --data DIR or --config FILE"),
        };
        if let Some(data) = data {
            config.data = Some(data.clone());
        }
        let Self { classes, frames } = self;
        for (given, list) in [
            (&classes.actions, &mut config.actions),
            (&classes.styles, &mut config.styles),
            (&frames.joints, &mut config.joints),
        ] {
            if !given.is_empty() {
                list.clone_from(given);
            }
        }
        if let Some(rate) = frames.rate {
            if !RATES_HZ.contains(&rate) {
                bail!("--rate {rate}: {}", expected_rate());
            }
            config.rate_hz = rate;
        }
        config.limit = frames.limit.unwrap_or(config.limit);
        config.strict |= frames.strict;
        Ok(config)
    }

    /// Loads the clips of a folder; says on standard error what was left out.
    pub fn load(&self, data: &Path) -> Result<(Config, Loaded)> {
        let config = self.config(Some(&data.to_path_buf()), None)?;
        let loaded = load_with_notes(&config)?;
        Ok((config, loaded))
    }
}

/// Loads clips; says on standard error what was left out.
pub fn load_with_notes(config: &Config) -> Result<Loaded> {
    let loaded = load(config)?;
    for note in &loaded.notes {
        super::note(note);
    }
    Ok(loaded)
}
