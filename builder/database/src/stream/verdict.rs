//! The verdict on a clip, in words: whether it is of the database's kind, what was recognised in it, what was passed
//! through, and what to do about that.

use gestus_core::{Database, Degraded, Method, blob::Names};
use gestus_motion::statistics::{mean_or_zero, quantile, sorted};
use serde_json::{Value, json};

use crate::{
    blob::export::class_names,
    registration::floor,
    stream::{Request, Streamed, course, input::Input, left_alone::MOSTLY_UNLIKE, translate::translate},
};

/// Share of the motion that is passed through from which a clip is partly unlike the database.
const PARTLY_UNLIKE: f64 = 0.05;
/// Median distance, relative to that of held-out clips of the database's kind, beyond which a clip is partly unlike it.
const FAR: f64 = 3.0;
/// Speed up to which the bodies of a database stay in place, m/s.
const STAYS_M_S: f32 = 0.2;
/// Least share of an action or style that is listed.
const MIN_LISTED_SHARE: f64 = 0.05;
/// Share from which an action or style is the whole clip's. Of held-out clips the first action is the right one in 154 of 156
/// above it and in 30 of 54 below, however far the second is behind (`docs/experiments/streams.md`).
const MAJORITY: f64 = 0.75;
/// Share from which the input alternates between an action and others that have it.
const ALTERNATES: f64 = 0.25;
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
    /// The action of the whole clip, if one is recognised.
    pub action: Option<String>,
    /// The style that the input has already, if one is recognised.
    pub input_style: Option<String>,
    /// Whether that is the wanted style: see [`note_same_style`](Self::note_same_style).
    pub same_style: bool,
    /// Action and style that the input was labelled with, which the method then does not recognise.
    pub labels: [Option<String>; 2],
    /// Spans that were passed through, seconds from the first frame.
    pub left_alone: Vec<[f64; 2]>,
    /// What the user can do.
    pub advice: Vec<String>,
}

impl Verdict {
    /// The verdict on a streamed input.
    pub fn of(database: &Database<'_>, input: &Input, request: &Request, streamed: &Streamed) -> Self {
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
        let [action, input_style] =
            [&actions, &styles].map(|shares| majority(shares).filter(|_| likeness == Likeness::Like));
        let mut verdict = Self {
            likeness,
            passed,
            far,
            distance,
            actions,
            styles,
            action,
            input_style,
            same_style: false,
            labels: labels(database, request),
            left_alone,
            advice: Vec::new(),
        };
        verdict.advice = verdict.advise(database, input);
        verdict
    }

    /// Tells that the input is in the wanted style already, or that it is the one that the linear models take, so that they
    /// leave their input as it is.
    pub fn note_same_style(&mut self, database: &Database<'_>, request: &Request) {
        let Some(wanted) = only_style(request) else { return };
        let named = |style: u16| {
            let manifest = database.manifest().ok()?;
            manifest.styles.get(usize::from(style)).map(str::to_owned)
        };
        let Some(name) = named(wanted) else { return };
        let own = request.input_style.and_then(named).or_else(|| self.input_style.clone());
        self.same_style = own.is_some_and(|own| own == name);
        let told = if request.config.method == Method::Lti && database.linear_from() == Some(wanted) {
            format!(
                "the linear models take input of the style {name}, which is the output's too, so that nothing changes: choose \
                 another style or method, or build with another --from"
            )
        } else if self.same_style {
            format!("the input is in the style {name} already, so that little changes: choose another style")
        } else {
            return;
        };
        self.advice.insert(0, told);
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
                _ if self.labels.iter().any(Option::is_some) => advice.push(
                    "check the labels: without --action and --input-style the method recognises both itself".to_owned(),
                ),
                _ if self.passed <= PARTLY_UNLIKE => advice.push(
                    "its movements are larger or other than the database's, so the style may look odd: look at the result, \
                     or build the database with clips that are more like it"
                        .to_owned(),
                ),
                _ => advice.push(format!(
                    "build the database with clips of what this clip does: it knows {}",
                    names(database)
                )),
            }
            let steps = || database.legs().is_some_and(|legs| course::steps(&input.mapped, &legs));
            if input.course().is_none() && speed < 0.2 && steps() {
                advice.push("if the body walks or runs in place, say so with --root in-place".into());
            }
            if self.passed > PARTLY_UNLIKE {
                advice.push("--trust 0 also stylizes what was passed through, but badly".into());
            }
        }
        advice.extend(self.advise_action());
        advice.extend(input.coarse().map(str::to_owned));
        let floor = input.floor();
        if floor.source == floor::Source::Body {
            advice.push(format!("its floor was found at {:.2} m: --floor states another", floor.height_m));
        }
        advice
    }

    /// Whether to name the action, where frames were taken for several.
    fn advise_action(&self) -> Option<String> {
        let shared = |least: f64| self.actions.iter().filter(move |(_, share)| *share >= least);
        if self.likeness != Likeness::Like || shared(MIN_LISTED_SHARE).count() < 2 {
            return None;
        }
        if let Some(action) = &self.action {
            return Some(format!("if the whole clip is one action, name it: --action {action}"));
        }
        let mut among: Vec<String> =
            shared(ALTERNATES).map(|(name, share)| format!("{name} ({:.0}%)", 100.0 * share)).collect();
        let last = among.pop().filter(|_| !among.is_empty())?;
        Some(format!(
            "the input alternates between {} and {last}: if all of it is one of them, name that one with --action, else \
             leave it unlabelled",
            among.join(", ")
        ))
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
            "action": self.action,
            "input_style": self.input_style,
            "same_style": self.same_style,
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
        sentences.push(if actions.is_empty() {
            "The method recognises no action.".into()
        } else {
            match &self.labels {
                [Some(action), Some(style)] => format!("Labelled: {action} in the style {style}."),
                [Some(action), None] => format!("Labelled: {action}. Recognised: the style {styles}."),
                [None, Some(style)] => format!("Labelled: the style {style}. Recognised: {actions}."),
                _ if self.input_style.is_some() => format!("Its style is {styles}; recognised: {actions}."),
                _ => format!("Recognised: {actions}; in the style {styles}."),
            }
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
    Ok(Verdict::of(database, input, &request, &streamed))
}

/// The names of the action and the style with which a request labels its input.
fn labels(database: &Database<'_>, request: &Request) -> [Option<String>; 2] {
    let Ok(manifest) = database.manifest() else { return [None, None] };
    let named = |names: Names<'_>, id: Option<u16>| names.get(usize::from(id?)).map(str::to_owned);
    [named(manifest.actions, request.action), named(manifest.styles, request.input_style)]
}

/// The style that is wanted alone, for the whole body.
fn only_style(request: &Request) -> Option<u16> {
    let mut wanted = request.style.iter().filter(|(_, weight)| *weight != 0.0);
    let (style, _) = wanted.next()?;
    (wanted.next().is_none() && request.group_styles.is_empty()).then_some(*style)
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

/// The name of a clear majority.
fn majority(shares: &[(String, f64)]) -> Option<String> {
    shares.first().filter(|(_, share)| *share >= MAJORITY).map(|(name, _)| name.clone())
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

    fn verdict(actions: &[(&str, f64)]) -> Verdict {
        let actions: Vec<(String, f64)> =
            actions.iter().map(|(name, share)| ((*name).to_owned(), *share)).collect();
        let styles = vec![("proud".to_owned(), 0.6), ("old".to_owned(), 0.4)];
        Verdict {
            likeness: Likeness::Like,
            passed: 0.0,
            far: 0.0,
            distance: Some(0.5),
            action: majority(&actions),
            input_style: majority(&styles),
            actions,
            styles,
            same_style: false,
            labels: [None, None],
            left_alone: Vec::new(),
            advice: Vec::new(),
        }
    }

    /// Turns walk straight for half of their time: `--action walk` was advised for one in two of them.
    #[test]
    fn an_action_is_advised_where_it_has_a_clear_majority_and_else_all_of_them_are_named() {
        let advice = |actions: &[(&str, f64)]| verdict(actions).advise_action().unwrap_or_default();
        let named = advice(&[("wave", 0.8), ("raise", 0.2)]);
        assert!(named.ends_with("--action wave"), "{named}");
        for (actions, words) in [
            (vec![("walk", 0.74), ("turn", 0.26)], "between walk (74%) and turn (26%):"),
            (
                vec![("turn", 0.4), ("walk", 0.35), ("run", 0.25)],
                "between turn (40%), walk (35%) and run (25%):",
            ),
            (vec![("turn", 0.45), ("walk", 0.35), ("run", 0.2)], "between turn (45%) and walk (35%):"),
        ] {
            let told = advice(&actions);
            assert!(told.contains(words) && !told.contains("--action turn"), "{told}");
        }
        // Nothing to name, or nothing to name it by.
        for actions in [
            vec![("walk", 0.97), ("turn", 0.03)],
            vec![("walk", 1.0)],
            vec![],
            vec![("walk", 0.6), ("turn", 0.2), ("run", 0.2)],
        ] {
            assert_eq!(advice(&actions), "", "{actions:?}");
        }
        let far = Verdict { likeness: Likeness::Partly, ..verdict(&[("wave", 0.5), ("raise", 0.5)]) };
        assert_eq!(far.advise_action(), None);
    }

    #[test]
    fn a_recognised_style_comes_first() {
        let unsure = verdict(&[("walk", 0.8), ("turn", 0.2)]);
        assert_eq!(unsure.sentences()[1], "Recognised: walk 80%, turn 20%; in the style proud 60%, old 40%.");
        assert_eq!(unsure.json()["input_style"], Value::Null);
        assert_eq!(unsure.json()["action"], "walk");
        let styles = vec![("old".to_owned(), 0.9), ("proud".to_owned(), 0.1)];
        let sure = Verdict { input_style: majority(&styles), styles, ..unsure };
        assert_eq!(sure.sentences()[1], "Its style is old 90%, proud 10%; recognised: walk 80%, turn 20%.");
        // What the user says is not recognised: a wrong label was "Recognised: punch 100%".
        for (labels, words) in [
            (["punch", ""], "Labelled: punch. Recognised: the style old 90%, proud 10%."),
            (["", "old"], "Labelled: the style old. Recognised: walk 80%, turn 20%."),
            (["walk", "old"], "Labelled: walk in the style old."),
        ] {
            let labels = labels.map(|name| Some(name.to_owned()).filter(|name| !name.is_empty()));
            assert_eq!(Verdict { labels, ..sure.clone() }.sentences()[1], words);
        }
    }
}
