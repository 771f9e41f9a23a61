//! Body parts, and the names of their joints.
//!
//! Skeletons are compared by parts: `left-upper-arm` is the joint that rotates the left upper arm, whatever its name. A
//! convention is a table of the names in a family of skeletons. The one that matches most of a skeleton's joints names
//! them all, since words are ambiguous: `LeftShoulder` is the collarbone in Mixamo, and the upper arm in older BVH files.

use std::fmt;

/// A body part with one joint of its own. Spines and necks, which differ in joint count, are chains between them.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
#[allow(missing_docs, reason = "they are what they are called")]
pub enum Part {
    Hips,
    Chest,
    Head,
    Clavicle(Side),
    UpperArm(Side),
    LowerArm(Side),
    Hand(Side),
    UpperLeg(Side),
    LowerLeg(Side),
    Foot(Side),
    Toes(Side),
}

/// Which side of the body.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
#[allow(missing_docs, reason = "they are what they are called")]
pub enum Side {
    Left,
    Right,
}

use Part::*;

impl Side {
    /// Left, then right.
    pub const BOTH: [Side; 2] = [Side::Left, Side::Right];

    /// 0 left, 1 right.
    pub fn index(self) -> usize {
        usize::from(self == Side::Right)
    }
}

/// The parts of a side, in the order of [`Convention`]'s words.
const LIMBS: [fn(Side) -> Part; 8] = [Clavicle, UpperArm, LowerArm, Hand, UpperLeg, LowerLeg, Foot, Toes];

impl Part {
    /// Every part, trunk first, then left and right.
    pub fn all() -> Vec<Part> {
        let mut all = vec![Hips, Chest, Head];
        for side in Side::BOTH {
            all.extend(LIMBS.map(|part| part(side)));
        }
        all
    }

    /// True for parts that a map does not require.
    pub fn optional(self) -> bool {
        matches!(self, Chest | Head | Clavicle(_) | Hand(_) | Toes(_))
    }

    /// The part of that name, as [`fmt::Display`] writes it; `_` may replace `-`.
    pub fn named(name: &str) -> Option<Part> {
        let name = name.trim().to_ascii_lowercase().replace('_', "-");
        Part::all().into_iter().find(|p| p.to_string() == name)
    }
}

impl fmt::Display for Part {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (side, stem) = match *self {
            Hips => return f.write_str("hips"),
            Chest => return f.write_str("chest"),
            Head => return f.write_str("head"),
            Clavicle(s) => (s, "clavicle"),
            UpperArm(s) => (s, "upper-arm"),
            LowerArm(s) => (s, "lower-arm"),
            Hand(s) => (s, "hand"),
            UpperLeg(s) => (s, "upper-leg"),
            LowerLeg(s) => (s, "lower-leg"),
            Foot(s) => (s, "foot"),
            Toes(s) => (s, "toes"),
        };
        write!(f, "{}-{stem}", if side == Side::Left { "left" } else { "right" })
    }
}

/// The names of one family of skeletons: words for hips and head, and for the parts of a side.
#[derive(Debug)]
pub struct Convention {
    /// What the family is called.
    pub name: &'static str,
    hips: &'static str,
    head: &'static str,
    /// In the order of [`LIMBS`].
    limbs: [&'static str; 8],
}

/// Known conventions. Words are in lower case, without separators and side.
pub const CONVENTIONS: [Convention; 8] = [
    Convention {
        name: "Mixamo or CMU (BVH)",
        hips: "hips",
        head: "head",
        limbs: ["shoulder", "arm", "forearm", "hand", "upleg", "leg", "foot", "toebase"],
    },
    Convention {
        name: "CMU (ASF)",
        hips: "root",
        head: "head",
        limbs: ["clavicle", "humerus", "radius", "hand", "femur", "tibia", "foot", "toes"],
    },
    Convention {
        name: "Bandai-Namco",
        hips: "hips",
        head: "head",
        limbs: ["shoulder", "upperarm", "lowerarm", "hand", "upperleg", "lowerleg", "foot", "toes"],
    },
    Convention {
        name: "Xsens",
        hips: "pelvis",
        head: "head",
        limbs: ["shoulder", "upperarm", "forearm", "hand", "upperleg", "lowerleg", "foot", "toe"],
    },
    Convention {
        name: "Xsens (BVH)",
        hips: "hips",
        head: "head",
        limbs: ["collar", "shoulder", "elbow", "wrist", "hip", "knee", "ankle", "toe"],
    },
    Convention {
        name: "SMPL",
        hips: "pelvis",
        head: "head",
        limbs: ["collar", "shoulder", "elbow", "wrist", "hip", "knee", "ankle", "foot"],
    },
    Convention {
        name: "VRM humanoid",
        hips: "hips",
        head: "head",
        limbs: ["shoulder", "upperarm", "lowerarm", "hand", "upperleg", "lowerleg", "foot", "toebase"],
    },
    Convention {
        name: "3ds Max Biped or Unreal",
        hips: "pelvis",
        head: "head",
        limbs: ["clavicle", "upperarm", "forearm", "hand", "thigh", "calf", "foot", "toe0"],
    },
];

/// Other words for parts, in skeletons of no known family.
const OTHERS: [(&str, usize); 17] = [
    ("collarbone", 0),
    ("clavicle", 0),
    ("humerus", 1),
    ("lowerarm", 2),
    ("radius", 2),
    ("wrist", 3),
    ("thigh", 4),
    ("upperleg", 4),
    ("hipjointyaw", 4),
    ("shin", 5),
    ("calf", 5),
    ("knee", 5),
    ("ankle", 6),
    ("ball", 7),
    ("toe", 7),
    ("toes", 7),
    ("toebase", 7),
];

impl Convention {
    /// The part that a joint of that name is.
    pub fn part(&self, name: &str) -> Option<Part> {
        let (side, stem) = split(name);
        match side {
            None => match stem.as_str() {
                s if s == self.hips => Some(Hips),
                s if s == self.head => Some(Head),
                _ => None,
            },
            Some(side) => self.limbs.iter().position(|&w| w == stem).map(|i| LIMBS[i](side)),
        }
    }
}

/// The likely part of a name in an unknown family.
pub fn likely(name: &str) -> Option<Part> {
    let (side, stem) = split(name);
    match side {
        None => {
            ["hips", "pelvis"].contains(&stem.as_str()).then_some(Hips).or((stem == "head").then_some(Head))
        }
        Some(side) => OTHERS.iter().find(|(w, _)| *w == stem).map(|&(_, i)| LIMBS[i](side)),
    }
}

/// Side and stem of a name, in lower case, without a tool's prefix and separators.
pub fn split(name: &str) -> (Option<Side>, String) {
    let name = name.rsplit(':').next().unwrap_or(name).trim();
    // `mixamorig_LeftArm`, `Bip01 L Thigh`, `J_Bip_L_UpperArm`, `m_avg_L_Hip`.
    let lower = name.to_ascii_lowercase();
    let prefixes = [
        "mixamorig1_",
        "mixamorig_",
        "mixamorig",
        "bip01",
        "bip001",
        "j_bip_c_",
        "j_bip_",
        "j_sec_",
        "m_avg_",
        "f_avg_",
        "def-",
        "b_",
    ];
    let cut = prefixes.iter().find(|p| lower.starts_with(**p)).map_or(0, |p| p.len());
    // Cut where the byte is a boundary of the original too: prefixes are ASCII.
    let rest = name.get(cut..).unwrap_or(name).trim_start_matches(['_', ' ', '.', '-']);
    let words = words(rest);
    let mut side = None;
    let mut stem = String::new();
    for (i, word) in words.iter().enumerate() {
        let at_end = i == 0 || i + 1 == words.len();
        match word.as_str() {
            "left" if side.is_none() => side = Some(Side::Left),
            "right" if side.is_none() => side = Some(Side::Right),
            "l" if side.is_none() && at_end => side = Some(Side::Left),
            "r" if side.is_none() && at_end => side = Some(Side::Right),
            other => stem.push_str(other),
        }
    }
    if side.is_none() {
        // `lfemur`, `leftarm`, `rhipjoint`: a side as a prefix in lower case.
        for (prefix, found) in
            [("left", Side::Left), ("right", Side::Right), ("l", Side::Left), ("r", Side::Right)]
        {
            let known = |s: &str| {
                CONVENTIONS.iter().any(|c| c.limbs.contains(&s)) || OTHERS.iter().any(|(w, _)| *w == s)
            };
            if let Some(rest) = stem.strip_prefix(prefix).filter(|r| known(r)) {
                let rest = rest.to_owned();
                return (Some(found), rest);
            }
        }
    }
    (side, stem)
}

/// Splits `LeftUpLeg_2` into left, up, leg, 2: at separators and capitals, in lower case.
fn words(name: &str) -> Vec<String> {
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
            ("UpperArm_L", Some(Left), "upperarm"),
            ("lfemur", Some(Left), "femur"),
            ("rhumerus", Some(Right), "humerus"),
            ("R_Elbow", Some(Right), "elbow"),
            ("m_avg_L_Hip", Some(Left), "hip"),
            ("Bip01 R Calf", Some(Right), "calf"),
            ("J_Bip_L_UpperLeg", Some(Left), "upperleg"),
            ("J_Bip_C_Hips", None, "hips"),
            ("leftToes", Some(Left), "toes"),
            ("thigh_r", Some(Right), "thigh"),
            ("RHipJoint", Some(Right), "hipjoint"),
            ("LowerBack", None, "lowerback"),
            ("root", None, "root"),
            ("Spine1", None, "spine1"),
            ("", None, ""),
        ] {
            assert_eq!(split(name), (side, stem.to_owned()), "{name}");
        }
    }

    #[test]
    fn one_word_means_what_its_family_says() {
        let of = |family: &str, name: &str| CONVENTIONS.iter().find(|c| c.name == family).unwrap().part(name);
        assert_eq!(of("Mixamo or CMU (BVH)", "LeftShoulder"), Some(Part::Clavicle(Side::Left)));
        assert_eq!(of("Xsens (BVH)", "LeftShoulder"), Some(Part::UpperArm(Side::Left)));
        assert_eq!(of("SMPL", "L_Foot"), Some(Part::Toes(Side::Left)));
        assert_eq!(of("Bandai-Namco", "Foot_L"), Some(Part::Foot(Side::Left)));
    }

    #[test]
    fn parts_are_known_by_their_names() {
        for part in Part::all() {
            assert_eq!(Part::named(&part.to_string()), Some(part));
            assert_eq!(Part::named(&part.to_string().replace('-', "_").to_uppercase()), Some(part));
        }
        assert_eq!(Part::named("tail"), None);
    }
}
