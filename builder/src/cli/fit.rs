//! `gestus build --fit BOARD`.

use std::path::Path;

use anyhow::{Context, Result, anyhow, bail};
use gestus_database::{
    build::{BuildOptions, Built},
    data_folder::config::Config,
    parts::{
        choose::{Sample, Wanted, choose},
        chosen::Chosen,
        names,
    },
};
use gestus_motion::{
    clip::{RATES_HZ, expected_rate},
    corpus::Corpus,
};

/// The part that a database is built for.
#[derive(clap::Args)]
pub struct FitArgs {
    /// Build the database that suits a microcontroller: the name of a part (rp2040, stm32f405, nrf52840, ...;
    /// `gestus-sim run --board list` lists them), or of an emulated board, which stands for a part. Chooses size and
    /// method by the part's flash, RAM and speed, and says what they cost
    #[arg(long, value_name = "BOARD", conflicts_with_all = ["bytes", "row_error", "features"])]
    fit: Option<String>,
    /// Frames a second that the part has to keep, from 1 to 1000; the database's rate too, unless --rate gives another;
    /// default: the database's rate
    #[arg(long, requires = "fit")]
    fps: Option<f64>,
}

impl FitArgs {
    /// Looks the part up, and sets the rate of the database to the frames a second if `rate` is not given.
    pub fn wanted(&self, config: &mut Config, rate: Option<f64>) -> Result<Option<Wanted>> {
        let Some(board) = &self.fit else { return Ok(None) };
        let (board, part) = names::find_with_name(board).map_err(|error| anyhow!("--fit {error}"))?;
        if let Some(fps) = self.fps {
            if !RATES_HZ.contains(&fps) {
                bail!("--fps {fps}: {}", expected_rate());
            }
            if let Some(rate) = rate.filter(|&rate| rate > fps) {
                bail!(
                    "--fps {fps}: the database has {rate} frames a second (--rate), and the part has to keep as many: leave \
                     one of the two out"
                );
            }
            config.rate_hz = rate.unwrap_or(fps);
        }
        Ok(Some(Wanted { board, part, fps: self.fps.unwrap_or(config.rate_hz) }))
    }
}

/// Builds a database of a corpus: for a part, or as the options say if there is none. `build` builds it with the options
/// that it is given.
pub fn build_for(
    wanted: Option<&Wanted>,
    corpus: &Corpus,
    options: &BuildOptions,
    build: impl Fn(&BuildOptions) -> Result<Built>,
) -> Result<(Built, Option<Chosen>)> {
    let Some(wanted) = wanted else { return Ok((build(options)?, None)) };
    let style = options.from.as_ref().and_then(|name| corpus.style(name).ok());
    let samples = Sample::of(corpus, style.unwrap_or_else(|| corpus.plain_style()));
    let (built, chosen) = choose(wanted, &samples, |bytes| build(&BuildOptions { bytes, ..options.clone() }))
        .context("--fit")?;
    Ok((built, Some(chosen)))
}

/// What was chosen, line by line.
pub fn lines(chosen: Option<&Chosen>, db: &Path) -> Vec<String> {
    chosen.map(|chosen| chosen.lines(&db.display().to_string())).unwrap_or_default()
}
