//! Clips that a database is made without: why, how many, and the lines of `gestus.toml` that would change it.

use std::{collections::BTreeMap, fmt};

use serde_json::{Value, json};
use thiserror::Error;

use super::{config::FILE_NAME, pattern::example};
use crate::list::{NAMED, first_of};

/// Why a clip is left out.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Reason {
    /// The file can't be read, or holds no body that moves.
    Unreadable,
    /// Its name does not say action and style.
    Unlabelled,
    /// Its skeleton differs from that of most clips.
    Skeleton,
    /// Its body has a size or a place that no body has.
    Size,
    /// A gait without a gait cycle.
    NoCycle,
    /// A gait too short for a gait cycle, where others of its action have one.
    Brief,
    /// Fewer frames than an action takes.
    Short,
    /// The body leaps within the clip.
    Leap,
    /// Its action is not there in every style, or its style not in every action.
    Incomplete,
}

impl Reason {
    /// Its name in JSON.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Unreadable => "unreadable",
            Self::Unlabelled => "unlabelled",
            Self::Skeleton => "skeleton",
            Self::Size => "size",
            Self::NoCycle => "no_cycle",
            Self::Brief => "brief",
            Self::Short => "short",
            Self::Leap => "leap",
            Self::Incomplete => "incomplete",
        }
    }

    /// What the clips are, and what to do about it.
    const fn words(self) -> [&'static str; 2] {
        match self {
            Self::Unreadable => ["that can't be read", "mend them, or take them out of the folder"],
            Self::Unlabelled => ["without action and style in the name", "label them"],
            Self::Skeleton => [
                "whose skeleton differs from that of most",
                "`--rig FILE`, with one of them or a character, takes clips of all skeletons; or build a separate database \
                 from them",
            ],
            Self::Size => {
                ["of a size, or at a place, that no body has", "correct `unit`, `floor` or `[floors]`"]
            }
            Self::NoCycle => ["without a gait cycle", "if their action is no gait, say so"],
            Self::Brief => [
                "without a gait cycle, which others of their action have",
                "give longer clips, in which the left foot strikes twice",
            ],
            Self::Leap => ["in which the body leaps", "cut them where their takes were joined"],
            Self::Short => ["too short", "give longer clips, or take still poses out of the folder"],
            Self::Incomplete => ["incomplete", "add what is missing"],
        }
    }
}

/// A clip that is left out.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct LeftOut {
    /// The clip, or its file.
    pub clip: String,
    /// Why.
    pub reason: Reason,
    /// The same in words, with the clip's name.
    pub said: String,
    /// The action, where its kind may be wrong.
    pub action: Option<String>,
}

impl LeftOut {
    /// A clip, and why it is left out.
    pub fn new(reason: Reason, clip: impl Into<String>, said: impl fmt::Display) -> Self {
        Self { clip: clip.into(), reason, said: said.to_string(), action: None }
    }
}

impl fmt::Display for LeftOut {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "left out: {}", self.said)
    }
}

/// Clips that are left out for one reason.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Group {
    /// Why.
    pub reason: Reason,
    /// The clips.
    pub clips: Vec<String>,
    /// What they are.
    pub what: String,
    /// What to do about it.
    pub advice: String,
    /// Lines for `gestus.toml` that would change it; empty if none would.
    pub change: String,
}

impl Group {
    /// The clips by their reasons.
    pub fn all(left_out: &[LeftOut]) -> Vec<Self> {
        let mut by_reason = BTreeMap::<Reason, Vec<&LeftOut>>::new();
        for one in left_out {
            by_reason.entry(one.reason).or_default().push(one);
        }
        let group = |(reason, list): (Reason, Vec<&LeftOut>)| {
            let [what, advice] = reason.words().map(str::to_owned);
            let clips: Vec<String> = list.iter().map(|one| one.clip.clone()).collect();
            let change = match reason {
                Reason::Unlabelled => labels(&clips),
                Reason::NoCycle => whole(list.iter().filter_map(|one| one.action.as_deref())),
                _ => String::new(),
            };
            Self { reason, clips, what, advice, change }
        };
        by_reason.into_iter().map(group).collect()
    }

    /// For a program.
    pub fn json(&self) -> Value {
        let Self { reason, clips, what, advice, change } = self;
        json!({
            "reason": reason.name(), "count": clips.len(), "clips": clips, "what": what, "advice": advice,
            "change": change,
        })
    }

    /// For a person:
    ///
    /// ```text
    /// 2 without a gait cycle (stretch_a_1, stretch_b_1): if their action is no gait, say so, in gestus.toml:
    ///     [kind]
    ///     stretch = "whole"
    /// ```
    pub fn lines(&self) -> Vec<String> {
        let mut lines = vec![self.to_string()];
        if !self.change.is_empty() {
            lines[0] += &format!(", in {FILE_NAME}:");
            lines.extend(self.change.lines().map(|line| format!("    {line}")));
        }
        lines
    }
}

impl fmt::Display for Group {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let names = first_of(self.clips.iter().cloned(), "more").unwrap_or_default();
        write!(f, "{} {} ({names}): {}", self.clips.len(), self.what, self.advice)
    }
}

/// Clips that can't be used where none may be left out: each with its reason, and what would change it.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
pub struct Refused {
    /// One line a clip, where it has one of its own.
    said: Vec<String>,
    groups: Vec<Group>,
}

impl Refused {
    /// The error of a command under `strict`, if it would leave out anything.
    ///
    /// # Errors
    /// There are such clips.
    pub fn unless_empty(said: Vec<String>, groups: Vec<Group>) -> Result<(), Self> {
        if groups.is_empty() { Ok(()) } else { Err(Self { said, groups }) }
    }
}

impl fmt::Display for Refused {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let count: usize = self.groups.iter().map(|group| group.clips.len()).sum();
        write!(f, "files or clips that can't be used: {count} (--strict: nothing is left out)")?;
        let groups = self.groups.iter().flat_map(Group::lines);
        self.said.iter().cloned().chain(groups).try_for_each(|line| write!(f, "\n  {line}"))
    }
}

/// Lines that label files. A few get one each; of many a pattern tells more.
fn labels(files: &[String]) -> String {
    if files.len() > NAMED {
        return format!("patterns = [{}]", quoted(&example(&files[0])));
    }
    let line = |file: &String| format!("{} = {{ action = \"...\", style = \"...\" }}", quoted(file));
    let lines: Vec<String> = files.iter().map(line).collect();
    format!("[files]\n{}", lines.join("\n"))
}

/// Lines that take actions as a whole.
fn whole<'a>(actions: impl Iterator<Item = &'a str>) -> String {
    let mut lines: Vec<String> = actions.map(|action| format!("{} = \"whole\"", key(action))).collect();
    lines.sort();
    lines.dedup();
    format!("[kind]\n{}", lines.join("\n"))
}

/// A line that selects actions or styles: `styles = ["a", "b"]`.
pub(super) fn selection(list: &str, names: &[&str]) -> String {
    let names: Vec<String> = names.iter().map(|name| quoted(name)).collect();
    format!("{list} = [{}]", names.join(", "))
}

/// A key of TOML: bare if it can be.
fn key(name: &str) -> String {
    let is_bare = |c: char| c.is_ascii_alphanumeric() || c == '-' || c == '_';
    if !name.is_empty() && name.chars().all(is_bare) { name.to_owned() } else { quoted(name) }
}

/// A string of TOML.
fn quoted(text: &str) -> String {
    toml::Value::from(text).to_string()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{data_folder::config::Config, registration::timeline::Kind};

    #[test]
    fn clips_are_counted_by_reason_with_lines_that_the_configuration_reads() {
        let mut list = vec![
            LeftOut::new(Reason::NoCycle, "stretch_a_1", "no cycle"),
            LeftOut::new(Reason::Unlabelled, "my \"best\" take.bvh", "no labels"),
            LeftOut::new(Reason::NoCycle, "slow walk_a_1", "no cycle"),
            LeftOut::new(Reason::NoCycle, "stretch_b_1", "no cycle"),
        ];
        for (one, action) in [(0, "stretch"), (2, "slow walk"), (3, "stretch")] {
            list[one].action = Some(action.to_owned());
        }
        let groups = Group::all(&list);
        let counts: Vec<_> = groups.iter().map(|g| (g.reason, g.clips.len())).collect();
        assert_eq!(counts, [(Reason::Unlabelled, 1), (Reason::NoCycle, 3)]);
        // The lines that the user reads.
        let said = groups[1].to_string();
        assert!(
            said.starts_with("3 without a gait cycle (stretch_a_1, slow walk_a_1, stretch_b_1):"),
            "{said}"
        );
        let config = Config::parse(&groups[1].change, FILE_NAME).unwrap();
        assert_eq!(config.kind.keys().collect::<Vec<_>>(), ["slow walk", "stretch"]);
        assert!(config.kind.values().all(|kind| *kind == Kind::Whole));
        let config = Config::parse(&groups[0].change, FILE_NAME).unwrap();
        assert!(config.files.contains_key("my \"best\" take.bvh"));
        let many: Vec<_> = (0..9).map(|n| LeftOut::new(Reason::Unlabelled, n.to_string(), "")).collect();
        let [group] = &Group::all(&many)[..] else { panic!("one reason") };
        assert!(Config::parse(&group.change, FILE_NAME).unwrap().patterns.len() == 1);
        assert!(group.to_string().contains("(0, 1, 2, 6 more)"));
    }
}
