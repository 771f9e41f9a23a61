//! What is asked of a stylizer on a command line, in words: `gestus translate` and `gestus-sim run` share it.

use anyhow::{Context, Result, bail};
use gestus_core::{
    Config, Database, Effort, MAX_OWN, Method, Safety, blob::Names, effort::Labels, regress::Ridge,
    retime::Bounds, timing::Timing,
};

use crate::{effort, stream::Request};

/// Style, labels and parameters, in words.
#[derive(clap::Args, Clone, Debug)]
pub struct WishArgs {
    /// Output style: a name, or weights a=1,b=2, which are brought to sum 1
    #[arg(long, default_value = "", hide_default_value = true)]
    pub style: String,
    /// Wanted Laban effort instead of a style: flow=1,weight=-2,time=0.5, each from -3 to 3; the database's dial
    /// finds the mix of styles
    #[arg(long, allow_hyphen_values = true, conflicts_with = "style")]
    pub effort: Option<String>,
    /// The input's action, where it is known
    #[arg(long)]
    action: Option<String>,
    /// The input's style, where it is known
    #[arg(long)]
    input_style: Option<String>,
    /// The method: mar (the mixture of autoregressive models), lti (linear models), statistic (means and spreads); a
    /// pose at a time. effort, with --effort: the whole clip rebuilt of blended fragments by `gestus translate`, and the
    /// mix that the dial finds, by mar, where a pose comes at a time
    #[arg(long, default_value = "mar")]
    pub method: String,
    /// Output time: free (poses keep their predicted times), sync (one pose a tick, at its input's time) or bounded
    /// (predicted times, within --lead and --lag of the input)
    #[arg(long, default_value = "free")]
    timing: String,
    /// With --timing bounded: most seconds by which a pose may come early. A live stream is delayed by it
    #[arg(long, default_value_t = 0.2)]
    lead: f32,
    /// With --timing bounded: most seconds by which a pose may come late
    #[arg(long, default_value_t = 0.2)]
    lag: f32,
    /// What is put out where the input is no pose or leaps: follow, hold (the last output) or rest (ease to it)
    #[arg(long, default_value = "follow")]
    safety: String,
    /// Leave feet as they come out: those that stand are not held
    #[arg(long)]
    no_contact: bool,
    /// How many times the input's fastest joint of the last seconds a joint of the output may turn; 0: no limit
    #[arg(long)]
    speed_limit: Option<f32>,
    /// Joint groups that the search leaves out, as the database names them: body, left-arm, right-arm
    #[arg(long, value_delimiter = ',')]
    mask: Vec<String>,
    /// Strength of the style in a joint group, left-arm=0.5
    #[arg(long, value_delimiter = ',')]
    strength: Vec<String>,
    /// Own style of a joint group, in place of --style: left-arm=proud,right-arm=proud, or a mix of up to three,
    /// left-arm=proud:2+old:1
    #[arg(long, value_delimiter = ',', value_name = "GROUP=STYLE")]
    group_style: Vec<String>,
    /// Named parameters to start from: default, paper, near (half as many neighbors) or normalised
    #[arg(long, default_value = "default")]
    preset: String,
    /// Neighbors a class
    #[arg(long)]
    k: Option<u16>,
    /// Most distances of a class's search, a frame: what bounds the worst frame
    #[arg(long)]
    visits: Option<u16>,
    /// Weight of the ridge
    #[arg(long)]
    lambda: Option<f32>,
    /// Variables of the ridge: raw or norm
    #[arg(long)]
    ridge: Option<String>,
    /// How many times lambda the coefficient of the last output is penalised with
    #[arg(long)]
    feedback: Option<f32>,
    /// Half width of the interval about its neighbors' mean that an output lies in, in deviations of the dof
    #[arg(long)]
    output_kappa: Option<f32>,
    /// Width of the mixing kernel
    #[arg(long)]
    delta: Option<f32>,
    /// Weight of classes that may be dropped
    #[arg(long)]
    prune: Option<f32>,
    /// Half width of the interval of trust, in standard deviations
    #[arg(long)]
    kappa: Option<f32>,
    /// How much of what lies outside is kept
    #[arg(long)]
    rho: Option<f32>,
    /// lti: standard deviations within which the model is trusted (kc)
    #[arg(long)]
    confidence: Option<f32>,
    /// lti: how sharply it gives way to the input beyond (kp)
    #[arg(long)]
    preference: Option<f32>,
    /// statistic: half-life of the input's running statistics, seconds; 0: those stored
    #[arg(long)]
    halflife: Option<f32>,
}

impl WishArgs {
    /// Parameters, checked for their names, and the method for whether the database holds it.
    fn config(&self, database: &Database<'_>) -> Result<Config> {
        let name = match self.method.as_str() {
            // A stream can't wait for whole fragments: its effort is the dial's mix, by the mixture. `gestus
            // translate`, which has the whole clip, does not come here.
            "effort" if self.effort.is_some() => "mar",
            "effort" => bail!("--method effort: say which with --effort flow=..,weight=..,time=.."),
            name => name,
        };
        let policy = match self.timing.as_str() {
            "free" | "bounded" => Timing::Free,
            "sync" => Timing::Sync,
            other => bail!("--timing {other}: free, sync or bounded"),
        };
        let mut config = match self.preset.as_str() {
            "default" => Config::new(),
            "paper" => Config::paper(),
            "near" => Config::near(),
            "normalised" => Config::normalised(),
            other => bail!("--preset {other}: default, paper, near or normalised"),
        }
        .timing(policy)
        .method(method(name, database)?)
        .contacts(!self.no_contact)
        .safety(match self.safety.as_str() {
            "follow" => Safety::Follow,
            "hold" => Safety::Hold,
            "rest" => Safety::Rest,
            other => bail!("--safety {other}: follow, hold or rest"),
        });
        if let Some(ridge) = &self.ridge {
            config = match ridge.as_str() {
                "raw" => config.ridge(Ridge::Raw),
                "norm" => config.ridge(Ridge::Normalised).lambda(1.0),
                other => bail!("--ridge {other}: raw or norm"),
            };
        }
        config = self.speed_limit.map_or(config, |v| config.speed_limit(v));
        config = self.k.map_or(config, |v| config.k(v));
        config = self.visits.map_or(config, |v| config.visits(v));
        config = self.lambda.map_or(config, |v| config.lambda(v));
        config = self.feedback.map_or(config, |v| config.feedback(v));
        config = self.output_kappa.map_or(config, |v| config.output_kappa(v));
        config = self.delta.map_or(config, |v| config.delta(v));
        config = self.prune.map_or(config, |v| config.prune(v));
        config = self.kappa.map_or(config, |v| config.kappa(v));
        config = self.rho.map_or(config, |v| config.rho(v));
        config = self.confidence.map_or(config, |v| config.confidence(v));
        config = self.preference.map_or(config, |v| config.preference(v));
        Ok(self.halflife.map_or(config, |v| config.halflife_s(v)))
    }

    /// The mix of styles that the database's effort dial gives for what is wanted, and what that reaches.
    fn dialled(&self, database: &Database<'_>, wanted: &str) -> Result<Vec<(u16, f32)>> {
        let factors = effort::parse(wanted).map_err(|e| anyhow::anyhow!("--effort {wanted}: {e}"))?;
        let dial = database.dial().context(
            "--effort: the database has no effort dial: build it again from two styles or more, without --no-effort",
        )?;
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
                eprintln!(
                    "--effort: {name} {} is beyond these styles' reach, {:.2} is taken (Efforts {labels}; {name} runs \
                     from {low:.2} to {high:.2}, less where other factors are asked for too)",
                    target[k],
                    reached.effort.factors()[k]
                );
            }
        }
        Ok((0..database.counts().styles).map(|s| (s as u16, weights[s])).collect())
    }

    /// The request in the database's numbers.
    ///
    /// # Errors
    /// Names that the database does not know, and numbers that are none; the message lists what there is.
    pub fn request(&self, database: &Database<'_>) -> Result<Request> {
        let manifest = database.manifest()?;
        let named = self
            .style
            .split(',')
            .filter(|s| !s.trim().is_empty())
            .map(|part| weighted(part, manifest.styles, "style"))
            .collect::<Result<Vec<_>>>()?;
        let style = match &self.effort {
            Some(wanted) => self.dialled(database, wanted)?,
            None => named,
        };
        if style.is_empty() {
            bail!("no style: give --style NAME or --style a=1,b=2 out of {}", listed(manifest.styles));
        }
        let label =
            |name: &Option<String>, names, what| name.as_ref().map(|n| find(n, names, what)).transpose();
        Ok(Request {
            bounds: (self.timing == "bounded").then_some(Bounds { lead_s: self.lead, lag_s: self.lag }),
            config: self.config(database)?,
            style,
            action: label(&self.action, manifest.actions, "action")?,
            input_style: label(&self.input_style, manifest.styles, "style")?,
            masked: self
                .mask
                .iter()
                .map(|g| find(g, manifest.groups, "joint group"))
                .collect::<Result<_>>()?,
            strength: self
                .strength
                .iter()
                .map(|s| weighted(s, manifest.groups, "joint group"))
                .collect::<Result<_>>()?,
            group_styles: self
                .group_style
                .iter()
                .map(|s| group_style(s, manifest.groups, manifest.styles))
                .collect::<Result<_>>()?,
        })
    }
}

/// The methods that a pose at a time comes from, by name.
const METHODS: [(&str, Method); 3] =
    [("mar", Method::Mar), ("lti", Method::Lti), ("statistic", Method::Statistic)];

/// Names of the methods that a database holds what is needed for.
pub fn methods(database: &Database<'_>) -> Vec<&'static str> {
    METHODS.iter().filter(|(_, method)| method.is_held_by(database)).map(|(name, _)| *name).collect()
}

/// The method of a name, where the database holds it.
fn method(name: &str, database: &Database<'_>) -> Result<Method> {
    let Some(&(_, method)) = METHODS.iter().find(|(known, _)| *known == name) else {
        bail!("--method {name}: mar, lti, statistic or effort");
    };
    if !method.is_held_by(database) {
        bail!("--method {name}: the database does not hold it, it holds {}", methods(database).join(", "));
    }
    Ok(method)
}

fn listed(names: Names<'_>) -> String {
    names.iter().collect::<Vec<_>>().join(", ")
}

fn find(name: &str, names: Names<'_>, what: &str) -> Result<u16> {
    names
        .find(name.trim())
        .with_context(|| format!("the database has no {what} `{}`: it has {}", name.trim(), listed(names)))
}

/// `left-arm=proud:2+old:1`, in the database's numbers.
fn group_style(part: &str, groups: Names<'_>, styles: Names<'_>) -> Result<(u16, Vec<(u16, f32)>)> {
    let (group, mix) =
        part.split_once('=').with_context(|| format!("--group-style {part}: write left-arm=proud"))?;
    let weights: Vec<(u16, f32)> =
        mix.split('+').map(|s| weighted(&s.replacen(':', "=", 1), styles, "style")).collect::<Result<_>>()?;
    if weights.len() > MAX_OWN {
        bail!("--group-style {part}: {} styles, a joint group mixes {MAX_OWN} at most", weights.len());
    }
    Ok((find(group, groups, "joint group")?, weights))
}

fn weighted(part: &str, names: Names<'_>, what: &str) -> Result<(u16, f32)> {
    let (name, weight) = part.split_once('=').unwrap_or((part, "1"));
    let number: f32 = weight
        .trim()
        .parse()
        .with_context(|| format!("`{part}`: `{weight}` is no number; write {what}=0.5"))?;
    Ok((find(name, names, what)?, number))
}
