//! Options of a stylizer: style, labels and parameters, shared by `gestus translate` and `gestus-sim`.

use std::str::FromStr;

use anyhow::{Context, Result, bail};
use gestus_core::{
    Config, ConfigError, Database, Effort, Method,
    blob::Names,
    config::{Ridge, Timing},
    output::retime::{Bounds, Retimer},
    stylizer::effort_dial::Labels,
};

use crate::{
    command_line::{
        parameters::ParameterArgs,
        resolve::{check_weights, find, group_style, listed, named, strength},
    },
    effort,
    list::check_once,
    stream::{RETIMER_POSES, Request},
};

/// Default lead and lag, seconds.
const BOUND_S: f32 = 0.2;
/// Greatest lead and lag, seconds.
const MAX_BOUND_S: f32 = 10.0;

/// The method and its Effort: the stylizer's options that also apply to whole clips (`--method effort`).
#[derive(clap::Args, Clone, Debug)]
pub struct MethodArgs {
    /// Laban effort instead of a style: flow=1,weight=-2,time=0.5, each from -3 to 3; the database's effort dial
    /// chooses the mix of styles
    #[arg(long, allow_hyphen_values = true, conflicts_with = "style")]
    pub effort: Option<String>,
    /// Method: mar (mixture of autoregressive models; the default if the database has frames), phase (phase tables), lti
    /// (linear models) or statistic (means and standard deviations), pose by pose; or effort, with --effort: `gestus
    /// translate` rebuilds the whole clip from blended fragments, other commands use the effort dial's mix of styles
    /// with mar
    #[arg(long = "method", id = "method")]
    named: Option<Named>,
}

/// A value of `--method`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Named {
    /// A method of the core, pose by pose.
    Core(Method),
    /// Fragments of the whole clip, blended to an Effort.
    Effort,
}

impl FromStr for Named {
    type Err = String;

    fn from_str(name: &str) -> Result<Self, String> {
        let core = || Method::named(name).map(Self::Core);
        let effort = (name == "effort").then_some(Self::Effort);
        effort.or_else(core).ok_or_else(|| format!("{} or effort", Method::NAMES.join(", ")))
    }
}

/// A value of `--timing`.
#[derive(clap::ValueEnum, Clone, Copy, Debug, PartialEq, Eq)]
enum OutputTime {
    Free,
    Sync,
    Bounded,
}

/// A value of `--preset`.
#[derive(clap::ValueEnum, Clone, Copy, Debug, PartialEq, Eq)]
enum Preset {
    Default,
    Paper,
    Normalised,
}

fn ridge(name: &str) -> Result<Ridge, String> {
    Ridge::named(name).ok_or_else(|| Ridge::NAMES.join(" or "))
}

/// Style, labels and parameters, as given on a command line.
#[derive(clap::Args, Clone, Debug)]
pub struct StylizerArgs {
    /// Output style: a name, or weights a=1,b=2, which are normalised to sum 1
    #[arg(long, default_value = "", hide_default_value = true)]
    pub style: String,
    #[command(flatten)]
    /// The method and its Effort.
    pub method: MethodArgs,
    /// The input's action, if known
    #[arg(long)]
    action: Option<String>,
    /// The input's style, if known
    #[arg(long)]
    input_style: Option<String>,
    /// Output time: free (poses keep their predicted times), sync (one pose a tick, at its input's time) or bounded
    /// (predicted times, within --lead and --lag of the input)
    #[arg(long, value_enum, default_value_t = OutputTime::Free)]
    timing: OutputTime,
    /// With --timing bounded: greatest time by which a pose may be early, seconds, 0 to 10 [default: 0.2]. It delays a
    /// live stream
    #[arg(long)]
    lead: Option<f32>,
    /// With --timing bounded: greatest time by which a pose may be late, seconds, 0 to 10 [default: 0.2]
    #[arg(long)]
    lag: Option<f32>,
    /// Do not hold standing feet in place
    #[arg(long)]
    no_contact: bool,
    /// Joint groups that the search ignores, by their names in the database: body, left-arm, right-arm
    #[arg(long, value_delimiter = ',')]
    mask: Vec<String>,
    /// Strength of the style in a joint group, 0 (the input) to 2 (exaggerated), 1 by default: left-arm=0.5
    #[arg(long, value_delimiter = ',')]
    strength: Vec<String>,
    /// A joint group's own style instead of --style: left-arm=proud,right-arm=proud, or a mix of up to three,
    /// left-arm=proud:2+old:1
    #[arg(long, value_delimiter = ',', value_name = "GROUP=STYLE")]
    group_style: Vec<String>,
    /// Set of parameters to start from
    #[arg(long, value_enum, default_value_t = Preset::Default)]
    preset: Preset,
    /// Variables of the ridge regression: raw or norm (normalised). norm sets lambda to 1 unless --lambda or --preset
    /// normalised is given
    #[arg(long, value_parser = ridge)]
    ridge: Option<Ridge>,
    #[command(flatten)]
    parameters: ParameterArgs,
}

impl MethodArgs {
    /// True if the whole clip is to be rebuilt of fragments.
    pub fn is_effort(&self) -> bool {
        self.named == Some(Named::Effort)
    }
}

impl StylizerArgs {
    /// The configuration, with the method checked against the database.
    fn config(&self, database: &Database<'_>) -> Result<Config> {
        let method = match self.method.named {
            Some(Named::Effort) if self.method.effort.is_none() => {
                bail!("--method effort needs a target: give --effort flow=..,weight=..,time=..")
            }
            // A stream can't wait for whole fragments: it uses the dial's mix with the mixture. `gestus translate`
            // handles whole clips elsewhere.
            Some(Named::Effort) => available(Method::Mar, database)?,
            Some(Named::Core(method)) => available(method, database)?,
            // A database that was cut to its models holds no frames for the mixture.
            None => Method::of(database),
        };
        let policy = match self.timing {
            OutputTime::Free | OutputTime::Bounded => Timing::Free,
            OutputTime::Sync => Timing::Sync,
        };
        let mut config = match self.preset {
            Preset::Default => Config::new(),
            Preset::Paper => Config::paper(),
            Preset::Normalised => Config::normalised(),
        }
        .timing(policy)
        .method(method)
        .contacts(!self.no_contact);
        if let Some(ridge) = self.ridge {
            // The preset `normalised` has a weight for it.
            if ridge == Ridge::Normalised && config.ridge != ridge {
                config = config.lambda(1.0);
            }
            config = config.ridge(ridge);
        }
        self.check_use(config.method)?;
        self.parameters.apply(config)
    }

    /// Refuses options without effect for this method and timing.
    fn check_use(&self, method: Method) -> Result<()> {
        let refused = |option: &str, with: &str| -> Result<()> {
            bail!("{option} does nothing without {with}: give both, or neither")
        };
        for (option, given) in [("--lead", self.lead.is_some()), ("--lag", self.lag.is_some())] {
            if given && self.timing != OutputTime::Bounded {
                return refused(option, "--timing bounded");
            }
        }
        for option in ["release", "ease"] {
            if self.no_contact && self.parameters.has(option) {
                bail!("--{option} does nothing with --no-contact: give one of them");
            }
        }
        let searches = matches!(method, Method::Mar | Method::Phase);
        if !self.mask.is_empty() && !searches {
            return refused("--mask", "--method mar or phase");
        }
        if self.ridge.is_some() && method != Method::Mar {
            return refused("--ridge", "--method mar");
        }
        Ok(())
    }

    /// Bounds of the output's time, with `--timing bounded`.
    fn bounds(&self, database: &Database<'_>) -> Result<Option<Bounds>> {
        if self.timing != OutputTime::Bounded {
            return Ok(None);
        }
        let bounds = bounds(self.lead.unwrap_or(BOUND_S), self.lag.unwrap_or(BOUND_S))?;
        let millihz = (f64::from(database.rate_hz()) * 1000.0).round() as u32;
        if let Err(ConfigError::Poses { need, have }) =
            Retimer::<1, RETIMER_POSES>::new(millihz, millihz, bounds)
        {
            let given = [("--lead", self.lead), ("--lag", self.lag)];
            let given: Vec<String> =
                given.into_iter().filter_map(|(option, s)| Some(format!("{option} {}", s?))).collect();
            bail!(
                "{}: a lead of {} s and a lag of {} s together take {need} poses at {} frames a second, and {have} are kept: narrow them",
                if given.is_empty() { "--timing bounded".to_owned() } else { given.join(" ") },
                bounds.lead_s,
                bounds.lag_s,
                database.rate_hz()
            );
        }
        Ok(Some(bounds))
    }

    /// The mix of styles that the database's effort dial gives for an Effort.
    fn dialled(&self, database: &Database<'_>, effort: &str) -> Result<Vec<(u16, f32)>> {
        let factors = effort::parse(effort).map_err(|e| anyhow::anyhow!("--effort: {e}"))?;
        let dial = database.dial().context(
            "--effort: the database has no effort dial: build it again from two styles or more, with --effort",
        )?;
        effort::dial::doubts(database).iter().for_each(crate::command_line::outputs::note);
        let rest = dial.rest().factors();
        let target: [f32; 3] = std::array::from_fn(|k| factors[k].map_or(rest[k], |v| v as f32));
        let (weights, reached) = dial.weights(Effort::new(target));
        let labels = match dial.labels() {
            Labels::Given => "given by people",
            Labels::Estimated => "estimated from motion",
        };
        for (k, name) in Effort::NAMES.iter().enumerate() {
            if reached.clamped[k] && factors[k].is_some() {
                let (low, high) = dial.range()[k];
                crate::command_line::outputs::note(format_args!(
                    "--effort: {name} {} is not reached, the mix that comes nearest is at {:.2} (Efforts {labels}; with the \
                     other factors at rest the dial is laid out from {low:.2} to {high:.2})",
                    target[k],
                    reached.effort.factors()[k]
                ));
            }
        }
        Ok((0..database.counts().styles).map(|s| (s as u16, weights[s])).collect())
    }

    /// Refuses labels that no class of the database has together.
    fn check_labels(&self, database: &Database<'_>, action: Option<u16>, style: Option<u16>) -> Result<()> {
        let classes: Vec<_> = database.classes().collect();
        if classes.is_empty() || classes.iter().any(|c| c.has(action, style)) {
            return Ok(());
        }
        let manifest = database.manifest()?;
        let named: Vec<String> = [("--action", &self.action), ("--input-style", &self.input_style)]
            .into_iter()
            .filter_map(|(option, name)| Some(format!("{option} {}", name.as_ref()?)))
            .collect();
        // The classes that have one of the two labels, or all if none has.
        let near = |c: &&_| -> bool {
            let c: &gestus_core::blob::Class = c;
            action == Some(c.action) || style == Some(c.style)
        };
        let mut alternatives: Vec<_> = classes.iter().filter(near).collect();
        if alternatives.is_empty() {
            alternatives = classes.iter().collect();
        }
        let listed: Vec<String> = alternatives
            .into_iter()
            .map(|c| {
                let name = |names: Names<'_>, i: u16| names.get(usize::from(i)).unwrap_or("?").to_owned();
                format!("{} in {}", name(manifest.actions, c.action), name(manifest.styles, c.style))
            })
            .collect();
        bail!("{}: the database has no such input; it has {}", named.join(" "), listed.join(", "))
    }

    /// The request, with names resolved to the database's numbers.
    ///
    /// # Errors
    /// Unknown names, with the known ones, and invalid numbers.
    pub fn request(&self, database: &Database<'_>) -> Result<Request> {
        let manifest = database.manifest()?;
        let named = named(&self.style, manifest.styles)?;
        let style = match &self.method.effort {
            Some(effort) => self.dialled(database, effort)?,
            None => named,
        };
        if style.is_empty() {
            bail!("no style: give --style NAME or --style a=1,b=2 out of {}", listed(manifest.styles));
        }
        match &self.method.effort {
            Some(effort) => check_weights("--effort", effort, &style)?,
            None => check_weights("--style", &self.style, &style)?,
        }
        let label = |option: &str, name: &str, names, what| {
            find(name, names, what).with_context(|| format!("{option} {name}"))
        };
        let masked = self.mask.iter().map(|g| label("--mask", g, manifest.groups, "joint group"));
        let masked: Vec<u16> = masked.collect::<Result<_>>()?;
        if !(0..database.counts().features)
            .any(|f| masked.iter().all(|&g| usize::from(g) != database.feature_group(f)))
            && !masked.is_empty()
        {
            bail!(
                "--mask {}: the search has nothing left to look at: leave a group out",
                self.mask.join(",")
            );
        }
        let action = self.action.as_ref().map(|n| label("--action", n, manifest.actions, "action"));
        let input_style =
            self.input_style.as_ref().map(|n| label("--input-style", n, manifest.styles, "style"));
        let (action, input_style) = (action.transpose()?, input_style.transpose()?);
        self.check_labels(database, action, input_style)?;
        for (option, list) in [("--strength", &self.strength), ("--group-style", &self.group_style)] {
            check_once(list.iter().map(|item| item.split('=').next().unwrap_or(item))).context(option)?;
        }
        Ok(Request {
            bounds: self.bounds(database)?,
            config: self.config(database)?,
            style,
            action,
            input_style,
            masked,
            strength: self.strength.iter().map(|s| strength(s, manifest.groups)).collect::<Result<_>>()?,
            group_styles: self
                .group_style
                .iter()
                .map(|s| group_style(s, manifest.groups, manifest.styles))
                .collect::<Result<_>>()?,
        })
    }
}

/// Bounds of the output's time from `--lead` and `--lag`, seconds.
///
/// # Errors
/// The option that is not from 0 to 10 s.
pub fn bounds(lead_s: f32, lag_s: f32) -> Result<Bounds> {
    for (option, seconds) in [("--lead", lead_s), ("--lag", lag_s)] {
        if !(0.0..=MAX_BOUND_S).contains(&seconds) {
            bail!("{option} {seconds}: seconds from 0 to {MAX_BOUND_S}");
        }
    }
    Ok(Bounds { lead_s, lag_s })
}

/// Names of the methods whose data a database holds.
pub fn methods(database: &Database<'_>) -> Vec<&'static str> {
    Method::ALL.into_iter().filter(|method| method.is_available_in(database)).map(Method::name).collect()
}

/// The method, if the database holds its data.
fn available(method: Method, database: &Database<'_>) -> Result<Method> {
    if !method.is_available_in(database) {
        let have = methods(database).join(", ");
        bail!("--method {}: the database does not hold it, it holds {have}", method.name());
    }
    Ok(method)
}

#[cfg(test)]
mod tests;
