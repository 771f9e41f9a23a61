//! The verdict on a clip, in words: whether it is of the database's kind, what was recognised in it, what was passed
//! through, and what to do about that.

use gestus_core::{Database, Degraded, Method};
use gestus_motion::statistics::{mean_or_zero, quantile, sorted};
use serde_json::{Value, json};

use crate::{
    blob::export::class_names,
    registration::floor,
    stream::{Request, Streamed, input::Input, left_alone::MOSTLY_UNLIKE, translate::translate},
};

/// Share of the motion that is passed through from which a clip is partly unlike the database.
const PARTLY_UNLIKE: f64 = 0.05;
/// Median distance, relative to that of held-out clips of the database's kind, beyond which a clip is partly unlike it.
const FAR: f64 = 3.0;
/// Speed up to which the bodies of a database stay in place, m/s.
const STAYS_M_S: f32 = 0.2;
/// Least share of an action or style that is listed.
const MIN_LISTED_SHARE: f64 = 0.05;
/// Shortest span of frames passed through that is listed, seconds.
const MIN_SPAN_S: f64 = 0.2;

/// How much a clip is like the database.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Likeness {
    /// It is of the database's kind.
    Like,
    /// Parts of it are not, or all of it is somewhat far.
    Partly,
    /// Most of it is not.
    Unlike,
}

impl Likeness {
    /// The word for JSON.
    pub fn name(self) -> &'static str {
        match self {
            Self::Like => "like",
            Self::Partly => "partly",
            Self::Unlike => "unlike",
        }
    }
}

/// The verdict on a clip.
#[derive(Debug, Clone)]
pub struct Verdict {
    /// How much the clip is like the database.
    pub likeness: Likeness,
    /// Share of the motion that was passed through unchanged, 0 to 1.
    pub passed: f64,
    /// Share of the frames that are unlike the database, 0 to 1.
    pub far: f64,
    /// Median distance, relative to that of held-out clips of the database's kind; `None` if the method has no distance.
    pub distance: Option<f64>,
    /// Actions by their share of the frames, 0 to 1, largest first.
    pub actions: Vec<(String, f64)>,
    /// Styles by their share of the frames, 0 to 1, largest first.
    pub styles: Vec<(String, f64)>,
    /// Spans that were passed through, seconds from the first frame.
    pub left_alone: Vec<[f64; 2]>,
    /// What the user can do.
    pub advice: Vec<String>,
}

impl Verdict {
    /// The verdict on a streamed input.
    pub fn of(database: &Database<'_>, input: &Input, streamed: &Streamed) -> Self {
        let reports = || streamed.steps.iter().map(|s| &s.report);
        let passed = mean_or_zero(reports().map(|r| f64::from(r.passed)));
        let far = mean_or_zero(reports().map(|r| f64::from(u8::from(r.degraded.contains(Degraded::FAR)))));
        let ratios = sorted(reports().map(|r| f64::from(r.distance_ratio)).filter(|&ratio| ratio > 0.0));
        let distance = quantile(&ratios, 0.5);
        let likeness = if passed > MOSTLY_UNLIKE {
            Likeness::Unlike
        } else if passed > PARTLY_UNLIKE || distance.is_some_and(|distance| distance > FAR) {
            Likeness::Partly
        } else {
            Likeness::Like
        };
        let [actions, styles] = shares(database, streamed);
        let rate_hz = f64::from(database.rate_hz());
        let left_alone = spans(reports().map(|r| r.passed > 0.5), rate_hz);
        let mut verdict =
            Self { likeness, passed, far, distance, actions, styles, left_alone, advice: Vec::new() };
        verdict.advice = verdict.advise(database, input);
        verdict
    }

    /// Tells that the linear models leave their input as it is, where the style that they take is the one that is wanted.
    pub fn note_same_style(&mut self, database: &Database<'_>, request: &Request) {
        let from = database.linear_from().filter(|_| request.config.method == Method::Lti);
        if let Some(from) = from.filter(|from| request.style.iter().all(|(style, _)| style == from)) {
            let name = database
                .manifest()
                .ok()
                .and_then(|m| m.styles.iter().nth(usize::from(from)).map(str::to_owned));
            self.advice.insert(
                0,
                format!(
                    "the linear models take input of the style {}, which is the output's too, so that nothing changes: choose \
                     another style or method, or build with another --from",
                    name.unwrap_or_default()
                ),
            );
        }
    }

    fn advise(&self, database: &Database<'_>, input: &Input) -> Vec<String> {
        let mut advice = Vec::new();
        if self.likeness != Likeness::Like {
            let speed = input.speed_m_s();
            let range = (0..database.counts().classes)
                .filter_map(|class| database.trust_limits(class).map(|limits| limits.speeds))
                .reduce(|[a, b], [c, d]| [a.min(c), b.max(d)]);
            match range {
                Some([_, fastest]) if fastest < STAYS_M_S && speed > 2.0 * f64::from(STAYS_M_S) => {
                    advice.push(format!(
                        "the clip moves at {speed:.1} m/s, and the database's clips stay where they are: build it with clips \
                         that get along"
                    ));
                }
                Some([_, fastest]) if speed > 1.2 * f64::from(fastest) + 0.1 => advice.push(format!(
                    "the clip moves at {speed:.1} m/s, the database at {fastest:.1} m/s at most: build it with faster \
                     clips, or check the unit (--unit)"
                )),
                _ => advice.push(format!(
                    "build the database with clips of what this clip does: it knows {}",
                    names(database)
                )),
            }
            if input.course().is_none() && speed < 0.2 {
                advice.push("if the body walks or runs in place, say so with --root in-place".into());
            }
            if self.passed > PARTLY_UNLIKE {
                advice.push("--trust 0 also stylizes what was passed through, but badly".into());
            }
        }
        let second = self.actions.get(1).map_or(0.0, |a| a.1);
        if self.likeness == Likeness::Like
            && second > 0.25
            && let Some((first, _)) = self.actions.first()
        {
            advice.push(format!("if the whole clip is one action, name it: --action {first}"));
        }
        advice.extend(input.coarse().map(str::to_owned));
        let floor = input.floor();
        if floor.source == floor::Source::Body {
            advice.push(format!("its floor was found at {:.2} m: --floor states another", floor.height_m));
        }
        advice
    }

    /// As JSON.
    pub fn json(&self) -> Value {
        let list = |shares: &[(String, f64)]| -> Vec<Value> {
            shares.iter().map(|(name, share)| json!({ "name": name, "share": share })).collect()
        };
        json!({
            "like": self.likeness.name(),
            "passed": self.passed,
            "far": self.far,
            "distance_ratio": self.distance,
            "actions": list(&self.actions),
            "styles": list(&self.styles),
            "left_alone_s": self.left_alone,
            "advice": self.advice,
            "text": self.sentences().join(" "),
        })
    }

    /// In words, a sentence each.
    pub fn sentences(&self) -> Vec<String> {
        let how = match self.likeness {
            Likeness::Like => "This clip is like the database",
            Likeness::Partly => "This clip is only partly like the database",
            Likeness::Unlike => "This clip is unlike the database",
        };
        let distance =
            self.distance.map_or(String::new(), |d| format!(" (distance {d:.1}, 1 or less is usual)"));
        let mut sentences = vec![format!("{how}{distance}.")];
        let [actions, styles] = [&self.actions, &self.styles].map(|shares| listed(shares));
        sentences.push(match actions.is_empty() {
            true => "The method recognises no action.".into(),
            false => format!("Recognised: {actions}; in the style {styles}."),
        });
        sentences.push(match (self.passed * 100.0).round() {
            0.0 => "Nothing was passed through unchanged.".into(),
            percent => {
                let spans: Vec<String> =
                    self.left_alone.iter().take(4).map(|[a, b]| format!("{a:.1} to {b:.1} s")).collect();
                let more = if self.left_alone.len() > 4 { ", ..." } else { "" };
                let at =
                    if spans.is_empty() { String::new() } else { format!(": {}{more}", spans.join(", ")) };
                format!("{percent:.0}% of the motion was passed through unchanged{at}.")
            }
        });
        sentences.extend(self.advice.iter().map(|advice| {
            let mut letters = advice.chars();
            let first = letters.next().map(|c| c.to_uppercase().collect::<String>()).unwrap_or_default();
            format!("{first}{}.", letters.as_str())
        }));
        sentences
    }
}

/// The verdict on an input before a style is chosen.
///
/// # Errors
/// A database without data of any method.
pub fn before(database: &Database<'_>, input: &Input) -> anyhow::Result<Verdict> {
    let mut request = Request::style(0);
    if let Some(method) = [Method::Mar, Method::Phase].into_iter().find(|m| m.is_available_in(database)) {
        request.config = request.config.method(method);
    }
    let streamed = translate(database, input, &request, &mut ())?;
    Ok(Verdict::of(database, input, &streamed))
}

/// The actions of the database.
fn names(database: &Database<'_>) -> String {
    database.manifest().map_or(String::new(), |m| m.actions.iter().collect::<Vec<_>>().join(", "))
}

/// Shares of actions and styles over the frames, largest first.
fn shares(database: &Database<'_>, streamed: &Streamed) -> [Vec<(String, f64)>; 2] {
    let Ok(manifest) = database.manifest() else { return [Vec::new(), Vec::new()] };
    let classes: Vec<[String; 2]> = database
        .classes()
        .map(|c| class_names(&manifest, c).map(|name| name.unwrap_or("?").to_owned()))
        .collect();
    let count = streamed.steps.len().max(1) as f64;
    [0, 1].map(|which| {
        let mut shares: Vec<(String, f64)> = Vec::new();
        for share in streamed.steps.iter().flat_map(|s| &s.report.classes) {
            let Some(class) = classes.get(usize::from(share.class)) else { continue };
            let part = f64::from(share.proportion) / count;
            match shares.iter_mut().find(|(name, _)| *name == class[which]) {
                Some((_, sum)) => *sum += part,
                None => shares.push((class[which].clone(), part)),
            }
        }
        shares.sort_by(|a, b| b.1.total_cmp(&a.1));
        shares
    })
}

/// `walk 83%, turn 12%`.
fn listed(shares: &[(String, f64)]) -> String {
    let listed: Vec<String> = shares
        .iter()
        .enumerate()
        .filter(|(i, (_, share))| *i == 0 || *share >= MIN_LISTED_SHARE)
        .map(|(_, (name, share))| format!("{name} {:.0}%", 100.0 * share))
        .collect();
    listed.join(", ")
}

/// Spans of frames for which it holds, seconds.
fn spans(holds: impl Iterator<Item = bool>, rate_hz: f64) -> Vec<[f64; 2]> {
    let mut spans: Vec<[usize; 2]> = Vec::new();
    for (t, holds) in holds.enumerate() {
        match spans.last_mut() {
            Some(span) if holds && span[1] == t => span[1] = t + 1,
            _ if holds => spans.push([t, t + 1]),
            _ => {}
        }
    }
    let seconds = spans.into_iter().map(|span| span.map(|t| t as f64 / rate_hz));
    seconds.filter(|[a, b]| b - a >= MIN_SPAN_S).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn spans_are_whole_and_short_ones_are_left_out() {
        let holds = [true, true, true, false, true, false, true, true, true, true];
        assert_eq!(spans(holds.into_iter(), 10.0), [[0.0, 0.3], [0.6, 1.0]]);
    }
}
