//! Names of joints: the side that a name tells, its stem, and the families of skeletons that use it.
//!
//! The words are data, in `names.toml` beside this file.

use std::{
    collections::{BTreeMap, HashSet},
    sync::OnceLock,
};

use serde::Deserialize;

/// Which side of the body.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
#[allow(missing_docs, reason = "they are what they are called")]
pub enum Side {
    Left,
    Right,
}

impl Side {
    /// Left, then right.
    pub const BOTH: [Side; 2] = [Side::Left, Side::Right];

    /// 0 left, 1 right.
    pub fn index(self) -> usize {
        usize::from(self == Side::Right)
    }
}

/// The words of a family of skeletons: stems of names, in lower case, without separators and side.
#[derive(Debug, Default, Deserialize)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
pub struct Family {
    /// What the family is called.
    #[serde(default)]
    pub name: String,
    /// The root of the body.
    pub hips: Vec<String>,
    /// The head.
    pub head: Vec<String>,
    clavicle: Vec<String>,
    upper_arm: Vec<String>,
    lower_arm: Vec<String>,
    hand: Vec<String>,
    upper_leg: Vec<String>,
    lower_leg: Vec<String>,
    foot: Vec<String>,
    toes: Vec<String>,
}

impl Family {
    /// The words of a side's parts: collarbone, upper and lower arm, hand, upper and lower leg, foot, toes.
    pub fn limbs(&self) -> [&[String]; 8] {
        [
            &self.clavicle,
            &self.upper_arm,
            &self.lower_arm,
            &self.hand,
            &self.upper_leg,
            &self.lower_leg,
            &self.foot,
            &self.toes,
        ]
    }
}

/// The table of names.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Names {
    prefixes: Vec<String>,
    controls: Vec<String>,
    sided: Vec<String>,
    arms: Vec<String>,
    hands: Vec<String>,
    legs: Vec<String>,
    /// Known families, the more common ones first.
    #[serde(rename = "family")]
    pub families: Vec<Family>,
    /// Words for parts in skeletons of no known family.
    pub others: Family,
    /// Stems that may have a side, of all families.
    #[serde(skip)]
    limbs: HashSet<String>,
}

/// The table of `names.toml`.
pub fn names() -> &'static Names {
    static NAMES: OnceLock<Names> = OnceLock::new();
    NAMES.get_or_init(|| {
        let mut names: Names = toml::from_str(include_str!("names.toml")).expect("a test reads the table");
        let families = names.families.iter().chain([&names.others]);
        let stems = families.flat_map(|f| f.limbs().into_iter().flatten()).chain(&names.sided);
        names.limbs = stems.cloned().collect();
        names
    })
}

impl Names {
    /// True if a name has a word for a part of an arm.
    pub fn is_arm(&self, name: &str) -> bool {
        let name = name.to_ascii_lowercase();
        self.arms.iter().any(|word| name.contains(word))
    }

    /// True if a name has a word for a hand or a finger.
    pub fn is_hand(&self, name: &str) -> bool {
        let name = name.to_ascii_lowercase();
        self.hands.iter().any(|word| name.contains(word))
    }

    /// True if a name has a word for a part of a leg.
    pub fn is_leg(&self, name: &str) -> bool {
        let name = name.to_ascii_lowercase();
        self.legs.iter().any(|word| name.contains(word))
    }
}

/// The side that a name tells.
pub fn side(name: &str) -> Option<Side> {
    split(name).0
}

/// Side and stem of a name, in lower case, without a tool's prefix, a rig's words for controls, separators, and the number
/// that some tools append.
pub fn split(name: &str) -> (Option<Side>, String) {
    let names = names();
    let name = name.rsplit(':').next().unwrap_or(name).trim();
    // `mixamorig_LeftArm`, `Bip01 L Thigh`, `J_Bip_L_UpperArm`, `m_avg_L_Hip`.
    let lower = name.to_ascii_lowercase();
    let cut = names.prefixes.iter().find(|p| lower.starts_with(p.as_str())).map_or(0, String::len);
    // Prefixes are ASCII, so that their ends are boundaries of the original too.
    let rest = name.get(cut..).unwrap_or(name).trim_start_matches(['_', ' ', '.', '-']);
    let mut words = words(rest);
    // `LeftArm_011` of glTF exporters; `spine_02` has a place in a row.
    if words.len() > 1 && words.last().is_some_and(|w| w.len() > 1 && w.bytes().all(|b| b.is_ascii_digit())) {
        let sided = words.iter().any(|w| ["left", "right", "l", "r"].contains(&w.as_str()));
        if sided || words.last().is_some_and(|w| w.len() > 2) && !words[0].starts_with("spine") {
            words.pop();
        }
    }
    let mut side = None;
    let mut stem = String::new();
    for (i, word) in words.iter().enumerate() {
        let at_end = i == 0 || i + 1 == words.len();
        match word.as_str() {
            "left" if side.is_none() => side = Some(Side::Left),
            "right" if side.is_none() => side = Some(Side::Right),
            "l" if side.is_none() && at_end => side = Some(Side::Left),
            "r" if side.is_none() && at_end => side = Some(Side::Right),
            word if names.controls.iter().any(|control| control == word) => {}
            other => stem.push_str(other),
        }
    }
    if side.is_none() {
        // `lfemur`, `leftarm`, `rhipjoint`: a side as a prefix in lower case. `ArmL`: one that is a suffix.
        let known = |s: &str| names.limbs.contains(s);
        for (mark, found) in
            [("left", Side::Left), ("right", Side::Right), ("l", Side::Left), ("r", Side::Right)]
        {
            let without =
                [stem.strip_prefix(mark), stem.strip_suffix(mark)].into_iter().flatten().find(|s| known(s));
            if let Some(rest) = without {
                return (Some(found), rest.to_owned());
            }
        }
    }
    (side, stem)
}

/// Each name without the first, the first two, ... of the words that at least half of the names begin with, as `Avatar_` in
/// `Avatar_LeftArm`: what a person or a tool put before the names of a whole character. None for a name without them.
pub fn without_shared_words(all: &[&str]) -> Vec<Vec<String>> {
    /// Of a project, a character and a rig; no name begins with more.
    const MAX_PREFIXES: usize = 3;
    let mut rest: Vec<Vec<String>> = all.iter().map(|name| words(name)).collect();
    let mut shorter = vec![Vec::new(); all.len()];
    for _ in 0..MAX_PREFIXES {
        let mut counts: BTreeMap<&str, usize> = BTreeMap::new();
        for words in rest.iter().filter(|words| words.len() > 1) {
            *counts.entry(words[0].as_str()).or_default() += 1;
        }
        let is_side = |word: &str| ["left", "right", "l", "r"].contains(&word);
        let shared = counts.into_iter().find(|&(word, n)| 2 * n >= all.len() && !is_side(word));
        let Some(shared) = shared.map(|(word, _)| word.to_owned()) else { break };
        for (words, shorter) in rest.iter_mut().zip(&mut shorter) {
            if words.len() > 1 && words[0] == shared {
                words.remove(0);
                shorter.push(words.join("_"));
            }
        }
    }
    shorter
}

/// Splits `LeftUpLeg_2` into left, up, leg, 2: at separators and capitals, in lower case.
pub fn words(name: &str) -> Vec<String> {
    let mut words: Vec<String> = Vec::new();
    let mut fresh = true;
    let chars: Vec<char> = name.chars().collect();
    for (i, &c) in chars.iter().enumerate() {
        if !c.is_ascii_alphanumeric() {
            fresh = true;
            continue;
        }
        let after_small = i > 0 && (chars[i - 1].is_ascii_lowercase() || chars[i - 1].is_ascii_digit());
        let before_small = i > 0
            && chars[i - 1].is_ascii_uppercase()
            && chars.get(i + 1).is_some_and(char::is_ascii_lowercase);
        if fresh || (c.is_ascii_uppercase() && (after_small || before_small)) {
            words.push(String::new());
            fresh = false;
        }
        if let Some(word) = words.last_mut() {
            word.push(c.to_ascii_lowercase());
        }
    }
    words
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sides_and_stems_of_all_families() {
        use Side::{Left, Right};
        for (name, side, stem) in [
            ("mixamorig:LeftUpLeg", Some(Left), "upleg"),
            ("mixamorig_RightForeArm", Some(Right), "forearm"),
            ("mixamorigLeftArm", Some(Left), "arm"),
            ("mixamorig:LeftArm_011", Some(Left), "arm"),
            ("UpperArm_L", Some(Left), "upperarm"),
            ("UpperArmL", Some(Left), "upperarm"),
            ("lfemur", Some(Left), "femur"),
            ("rhumerus", Some(Right), "humerus"),
            ("rShldr", Some(Right), "shldr"),
            ("lThigh", Some(Left), "thigh"),
            ("lShldrBend", Some(Left), "shldrbend"),
            ("R_Elbow", Some(Right), "elbow"),
            ("m_avg_L_Hip", Some(Left), "hip"),
            ("left_hip", Some(Left), "hip"),
            ("Bip01 R Calf", Some(Right), "calf"),
            ("J_Bip_L_UpperLeg", Some(Left), "upperleg"),
            ("J_Bip_C_Hips", None, "hips"),
            ("leftToes", Some(Left), "toes"),
            ("thigh_r", Some(Right), "thigh"),
            ("DEF-upper_arm.L", Some(Left), "upperarm"),
            ("DEF-spine.006", None, "spine006"),
            ("CTRL_FK_Femur.L", Some(Left), "femur"),
            ("Robot_RightForeArm", Some(Right), "forearm"),
            ("RHipJoint", Some(Right), "hipjoint"),
            ("LowerBack", None, "lowerback"),
            ("root", None, "root"),
            ("Spine1", None, "spine1"),
            ("Pelvis", None, "pelvis"),
            ("", None, ""),
        ] {
            assert_eq!(split(name), (side, stem.to_owned()), "{name}");
        }
    }

    #[test]
    fn words_that_most_names_begin_with_are_left_out() {
        let all = ["Avatar_Hips", "Avatar_LeftUpLeg", "Avatar_L_Knee", "Prop", "avatarHead"];
        let short = without_shared_words(&all);
        assert_eq!(short, [vec!["hips"], vec!["left_up_leg"], vec!["l_knee"], vec![], vec!["head"]]);
        let all = ["My_Rig_Hips", "My_Rig_LeftArm", "My_Other_Head"];
        let short = without_shared_words(&all);
        assert_eq!(short, [vec!["rig_hips", "hips"], vec!["rig_left_arm", "left_arm"], vec!["other_head"]]);
        // A side is no such word, nor is a whole name.
        let none: Vec<String> = Vec::new();
        assert!(without_shared_words(&["LeftArm", "LeftLeg", "Hips", "Hips"]).iter().all(|s| *s == none));
    }

    #[test]
    fn words_are_written_as_they_are_compared() {
        let names = names();
        let all = names.families.iter().chain([&names.others]);
        for word in all.flat_map(|f| f.limbs().into_iter().flatten().chain(&f.hips).chain(&f.head)) {
            assert!(word.bytes().all(|b| b.is_ascii_lowercase() || b.is_ascii_digit()), "{word}");
        }
    }
}
