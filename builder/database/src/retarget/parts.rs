//! Body parts, and the names of their joints.
//!
//! Skeletons are compared by parts: `left-upper-arm` is the joint that rotates the left upper arm, whatever its name. The
//! words are those of [`gestus_motion::names`].

use std::{collections::BTreeSet, fmt};

use gestus_motion::names::{Family, names, without_shared_words};
pub use gestus_motion::names::{Side, split};

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

use Part::*;

/// The parts of a side, in the order of [`Family::limbs`].
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

    /// The part on the other side; itself, if it is in the middle.
    pub fn mirrored(self) -> Part {
        let other = |side| if side == Side::Left { Side::Right } else { Side::Left };
        match self {
            Hips | Chest | Head => self,
            Clavicle(s) => Clavicle(other(s)),
            UpperArm(s) => UpperArm(other(s)),
            LowerArm(s) => LowerArm(other(s)),
            Hand(s) => Hand(other(s)),
            UpperLeg(s) => UpperLeg(other(s)),
            LowerLeg(s) => LowerLeg(other(s)),
            Foot(s) => Foot(other(s)),
            Toes(s) => Toes(other(s)),
        }
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

/// The part that a joint of that name is, in a family.
fn part_in(family: &Family, name: &str) -> Option<Part> {
    let (side, stem) = split(name);
    let has = |words: &[String]| words.contains(&stem);
    match side {
        None if has(&family.hips) => Some(Hips),
        None if has(&family.head) => Some(Head),
        None => None,
        Some(side) => family.limbs().iter().position(|words| has(words)).map(|i| LIMBS[i](side)),
    }
}

/// A joint by its name, and by what is left of it without the words that the names of its skeleton begin with
/// ([`without_shared_words`]).
#[derive(Debug, Clone)]
pub struct Named<'a> {
    whole: &'a str,
    shorter: Vec<String>,
}

/// The joints of a skeleton by their names.
pub fn named<'a>(names: &[&'a str]) -> Vec<Named<'a>> {
    let shorter = without_shared_words(names);
    names.iter().zip(shorter).map(|(&whole, shorter)| Named { whole, shorter }).collect()
}

impl Named<'_> {
    /// The part that it is in a family.
    pub fn part_in(&self, family: &Family) -> Option<Part> {
        let shorter = || self.shorter.iter().find_map(|name| part_in(family, name));
        part_in(family, self.whole).or_else(shorter)
    }

    /// The likely part in an unknown family.
    pub fn likely(&self) -> Option<Part> {
        self.part_in(&names().others)
    }
}

/// The families that know six parts of a skeleton or more, those that know most of them first, of equals the more common.
pub fn families(joints: &[Named<'_>]) -> Vec<&'static Family> {
    /// Fewer are chance.
    const MIN_KNOWN_PARTS: usize = 6;
    let known = |family: &&Family| {
        joints.iter().filter_map(|joint| joint.part_in(family)).collect::<BTreeSet<_>>().len()
    };
    let mut found: Vec<(usize, &Family)> = names().families.iter().map(|f| (known(&f), f)).collect();
    found.retain(|(known, _)| *known >= MIN_KNOWN_PARTS);
    found.sort_by_key(|(known, _)| std::cmp::Reverse(*known));
    found.into_iter().map(|(_, family)| family).collect()
}

#[cfg(test)]
mod tests;
