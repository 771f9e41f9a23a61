//! The page's settings as a stylizer's.

use anyhow::{Context, Result, bail};
use gestus_core::{Config, Database, Effort, Method, config::Timing};
use gestus_database::{
    retarget::{MapFile, axis},
    stream::{Request, input::InputOptions},
};
use serde::Deserialize;

/// An animation of the file, and what the user states about it, with the meaning and the defaults of the options of
/// `gestus translate`.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Animation {
    /// Its number in the file.
    pub index: usize,
    /// Unit of its lengths; found where not given.
    #[serde(default)]
    unit: Option<String>,
    /// Height of the floor, metres; found where not given.
    #[serde(default)]
    floor: Option<f64>,
    /// Up: `x`, `y`, `z`, `-x`, `-y` or `-z`; found where not given.
    #[serde(default)]
    up: Option<String>,
    /// `in-place` or `motion`; found where not given.
    #[serde(default)]
    root: Option<String>,
    /// Whether it is a loop.
    #[serde(default, rename = "loop")]
    looped: bool,
}

impl Animation {
    /// What the user states about it.
    ///
    /// # Errors
    /// An unknown unit or axis, a floor that is too far away, or a root of another name.
    pub fn reading(&self) -> Result<InputOptions> {
        let unit = self.unit.as_deref().map(str::parse).transpose().context("unit")?;
        let root = self.root.as_deref().map(str::parse).transpose();
        let root = root.map_err(|e: String| anyhow::anyhow!("root: {e}"))?;
        let up = self.up.as_deref().map(axis::of_name).transpose();
        let map = MapFile { up: up.map_err(|e| anyhow::anyhow!("up: {e}"))?, ..MapFile::default() };
        Ok(InputOptions { map, unit, root, looped: self.looped }.on_floor(self.floor)?)
    }
}

/// Settings, with the meaning and the defaults of the options of `gestus translate`.
#[derive(Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Settings {
    /// Weight of each style. Shape `[styles]`.
    style: Vec<f32>,
    /// Effort instead of a style: flow, weight and time; `null` leaves a factor at rest.
    effort: Option<[Option<f32>; 3]>,
    /// Strength of each joint group, 0 to 2. Shape `[groups]`; none for 1.
    strength: Vec<f32>,
    /// Name of the method.
    method: String,
    /// True for one pose each input pose.
    sync: bool,
    /// The input's action, if it is known.
    action: Option<u16>,
    /// The input's style, if it is known.
    input_style: Option<u16>,
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            style: Vec::new(),
            effort: None,
            strength: Vec::new(),
            method: Method::Mar.name().to_owned(),
            sync: false,
            action: None,
            input_style: None,
        }
    }
}

impl Settings {
    /// The request to the stylizer.
    ///
    /// # Errors
    /// A method that the database has no data for, an Effort where it has no dial, and no style.
    pub fn request(&self, database: &Database<'_>) -> Result<Request> {
        let method = Method::named(&self.method).filter(|method| method.is_available_in(database));
        let method = method.with_context(|| format!("the database does not hold method {}", self.method))?;
        let timing = if self.sync { Timing::Sync } else { Timing::Free };
        let weights = match self.effort {
            Some(wanted) => {
                let dial = database.dial().context("the database has no effort dial")?;
                let rest = dial.rest().factors();
                let target = std::array::from_fn(|k| wanted[k].unwrap_or(rest[k]));
                dial.weights(Effort::new(target)).0[..database.counts().styles].to_vec()
            }
            None => self.style.clone(),
        };
        if weights.is_empty() {
            bail!("no style is chosen");
        }
        let numbered = |list: &[f32]| (0u16..).zip(list.iter().copied()).collect::<Vec<_>>();
        let mut strength = numbered(&self.strength);
        strength.retain(|(_, value)| *value != 1.0);
        let mut style = numbered(&weights);
        // As on the command line, where only styles with weight are given.
        style.retain(|(_, weight)| *weight > 0.0);
        Ok(Request {
            config: Config::new().timing(timing).method(method).contacts(true),
            style,
            action: self.action,
            input_style: self.input_style,
            strength,
            ..Request::style(0)
        })
    }
}
