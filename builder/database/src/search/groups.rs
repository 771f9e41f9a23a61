//! Joint groups, each of which can be masked in the search and have its own strength and style.
//!
//! A database has up to eight, named when it is built. The first is `body` and holds all joints of no other group, always
//! with the root. By default the others are the left and the right arm. A group lists joints, each of which includes its
//! descendants unless another group names them, or has a predefined name:
//!
//! ```toml
//! [build.groups]
//! legs = []                       # predefined: left-arm, right-arm, arms, left-leg, right-leg, legs, torso, head
//! head = ["Neck"]
//! sword-arm = ["Shoulder_R"]
//! ```
//!
//! Each of the search's principal components covers one group, so that a mask removes whole components. With more groups,
//! components capture less of their common movement (`docs/experiments/feet.md` has the cost). Windows of poses are aligned
//! by all joints except the arms', independently of groups and masks.

use std::collections::BTreeMap;

use gestus_core::blob::layout::MAX_GROUPS;
use thiserror::Error;

use crate::list::{ListError, check_once};
use gestus_motion::{clip::Skeleton, landmarks::Landmarks};

/// The group of all joints that no other group names.
pub const BODY: &str = "body";

/// Groups by name, each with its joints; without joints, those of the predefined name. Empty: the arms.
pub type Chosen = BTreeMap<String, Vec<String>>;

/// The joint groups of a database.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Groups {
    /// Names, by number; the first is [`BODY`].
    pub names: Vec<String>,
    /// Group of each joint. Shape `[joints]`.
    pub of_joint: Vec<usize>,
}

/// Invalid groups.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
pub enum GroupError {
    /// More than a blob holds.
    #[error("{have} joint groups with `{BODY}`, and a database holds {MAX_GROUPS}: put some together")]
    TooMany {
        /// How many.
        have: usize,
    },
    /// A name that can't be given on a command line.
    #[error("`{0}` can't name a joint group: letters, digits, - and _, and not `{BODY}`, which is the rest")]
    Name(String),
    /// An unknown joint.
    #[error("joint group `{group}`: there is no joint `{joint}` (joints: {have})")]
    Joint {
        /// The group.
        group: String,
        /// The unknown name.
        joint: String,
        /// The known names.
        have: String,
    },
    /// The root, or a joint that is in another group already.
    #[error("joint group `{group}`: `{joint}` is in `{other}` already")]
    Taken {
        /// The group.
        group: String,
        /// The joint.
        joint: String,
        /// Where it is.
        other: String,
    },
    /// A word that says no joints of this skeleton.
    #[error(
        "joint group `{0}`: which joints? Say it ({0} = [\"Joint\"] or --groups {0}=Joint+Joint), or take a word that \
         this skeleton has: left-arm, right-arm, arms, left-leg, right-leg, legs, torso, head"
    )]
    Which(String),
}

impl Groups {
    /// The groups chosen, on a skeleton.
    ///
    /// # Errors
    /// [`GroupError`] if they don't fit it.
    pub fn of(skeleton: &Skeleton, landmarks: &Landmarks, chosen: &Chosen) -> Result<Self, GroupError> {
        let arms: Chosen = ["left-arm", "right-arm"].map(|n| (n.to_owned(), Vec::new())).into();
        let by_default = chosen.is_empty();
        let chosen = if by_default { &arms } else { chosen };
        if chosen.len() + 1 > MAX_GROUPS {
            return Err(GroupError::TooMany { have: chosen.len() + 1 });
        }
        let mut names = vec![BODY.to_owned()];
        let mut named = vec![None; skeleton.joints()];
        named[0] = Some(0);
        for (name, joints) in chosen {
            let letters = |c: char| c.is_alphanumeric() || c == '-' || c == '_';
            if name.is_empty() || name == BODY || !name.chars().all(letters) {
                return Err(GroupError::Name(name.clone()));
            }
            let joints = match joints.as_slice() {
                [] => by_word(skeleton, landmarks, name),
                joints => joints.iter().map(|j| find(skeleton, name, j)).collect::<Result<_, _>>()?,
            };
            // A body without arms gets the default groups too, without an error.
            if joints.is_empty() && !by_default {
                return Err(GroupError::Which(name.clone()));
            }
            for joint in joints {
                if let Some(other) = named[joint].replace(names.len()) {
                    return Err(GroupError::Taken {
                        group: name.clone(),
                        joint: skeleton.names[joint].clone(),
                        other: names.get(other).unwrap_or(name).clone(),
                    });
                }
            }
            names.push(name.clone());
        }
        // Parents come before their children.
        let mut of_joint: Vec<usize> = Vec::with_capacity(named.len());
        for (j, named) in named.iter().enumerate() {
            of_joint.push(named.or(skeleton.parents[j].map(|p| of_joint[p])).unwrap_or(0));
        }
        Ok(Self { names, of_joint })
    }
}

/// `legs,head,sword-arm=Shoulder_R+Hand_L` of a command line.
///
/// # Errors
/// A group that is given twice.
pub fn parse(parts: &[String]) -> Result<Chosen, ListError> {
    let group = |part: &String| {
        let (name, joints) = part.split_once('=').unwrap_or((part, ""));
        let joints = joints.split('+').map(str::trim).filter(|j| !j.is_empty()).map(str::to_owned).collect();
        (name.trim().to_owned(), joints)
    };
    let groups: Vec<(String, Vec<String>)> = parts.iter().map(group).collect();
    check_once(groups.iter().map(|(name, _)| name.as_str()))?;
    Ok(groups.into_iter().collect())
}

fn find(skeleton: &Skeleton, group: &str, joint: &str) -> Result<usize, GroupError> {
    skeleton.find(joint).ok_or_else(|| GroupError::Joint {
        group: group.to_owned(),
        joint: joint.to_owned(),
        have: skeleton.names.join(", "),
    })
}

/// The topmost joints of a predefined group; empty for other names.
fn by_word(skeleton: &Skeleton, landmarks: &Landmarks, word: &str) -> Vec<usize> {
    let arm = |side: usize| {
        let is_arm = |j: &usize| landmarks.groups[*j] == 1 + side;
        (0..skeleton.joints()).filter(is_arm).collect::<Vec<_>>()
    };
    let leg = |side: usize| vec![landmarks.hip_joints[side]];
    let called = |words: &[&str]| {
        let name = |j: usize| skeleton.names[j].to_ascii_lowercase();
        let found = |j: &usize| *j > 0 && words.iter().any(|w| name(*j).contains(w));
        (0..skeleton.joints()).find(found).into_iter().collect::<Vec<_>>()
    };
    match word {
        "left-arm" => arm(0),
        "right-arm" => arm(1),
        "arms" => [arm(0), arm(1)].concat(),
        "left-leg" => leg(0),
        "right-leg" => leg(1),
        "legs" => [leg(0), leg(1)].concat(),
        "head" => match called(&["neck"]).as_slice() {
            [] => called(&["head"]),
            neck => neck.to_vec(),
        },
        "torso" => called(&["spine", "abdomen", "torso", "chest", "back"]),
        _ => Vec::new(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::synth;

    fn body() -> (Skeleton, Landmarks) {
        let skeleton = synth::skeleton();
        let landmarks = Landmarks::find(&skeleton).unwrap();
        (skeleton, landmarks)
    }

    fn groups(wanted: &[&str]) -> Result<Groups, GroupError> {
        let (skeleton, landmarks) = body();
        Groups::of(
            &skeleton,
            &landmarks,
            &parse(&wanted.iter().map(|s| (*s).to_owned()).collect::<Vec<_>>()).unwrap(),
        )
    }

    fn members(groups: &Groups, name: &str) -> Vec<String> {
        let number = groups.names.iter().position(|n| n == name).unwrap();
        let (skeleton, _) = body();
        let of = |j: &usize| groups.of_joint[*j] == number;
        (0..skeleton.joints()).filter(of).map(|j| skeleton.names[j].clone()).collect()
    }

    #[test]
    fn the_arms_are_groups_unless_others_are_named() {
        let (_, landmarks) = body();
        let default = groups(&[]).unwrap();
        assert_eq!(default.names, ["body", "left-arm", "right-arm"]);
        assert_eq!(default.of_joint, landmarks.groups);
        assert_eq!(groups(&["left-arm", "right-arm"]).unwrap(), default);
    }

    #[test]
    fn a_joint_belongs_to_the_nearest_name_above_it() {
        let all = groups(&["torso", "head", "left-arm", "right-arm", "left-leg", "right-leg"]).unwrap();
        assert_eq!(all.names.len(), 7);
        let (skeleton, landmarks) = body();
        assert_eq!(members(&all, "body"), skeleton.names[..1]);
        assert_eq!(members(&all, "left-leg").len(), 4);
        assert!(members(&all, "left-leg").contains(&skeleton.names[landmarks.toes[0]]));
        assert!(members(&all, "head").iter().all(|n| !members(&all, "torso").contains(n)));
        assert_eq!(members(&all, "left-arm").len(), members(&groups(&[]).unwrap(), "left-arm").len());
        // By joints, one below the other.
        let knee = &skeleton.names[landmarks.knees[1]];
        let hip = &skeleton.names[landmarks.hip_joints[1]];
        let two = groups(&[&format!("shin={knee}"), &format!("thigh={hip}")]).unwrap();
        assert_eq!(members(&two, "thigh"), std::slice::from_ref(hip));
        assert_eq!(members(&two, "shin").len(), 3);
    }

    #[test]
    fn what_does_not_fit_is_said() {
        let (skeleton, landmarks) = body();
        let refused = |wanted: &[&str]| groups(wanted).unwrap_err();
        let taken = |wanted: &[&str], by: &str| {
            assert!(matches!(refused(wanted), GroupError::Taken { other, .. } if other == by), "{wanted:?}");
        };
        taken(&[&format!("all={}", skeleton.names[0])], "body");
        let knee = &skeleton.names[landmarks.knees[0]];
        taken(&[&format!("a={knee}"), &format!("b={knee}")], "a");
        assert!(matches!(refused(&["tail=Tail"]), GroupError::Joint { joint, have, .. }
            if joint == "Tail" && have == skeleton.names.join(", ")));
        assert_eq!(refused(&["wings"]), GroupError::Which("wings".into()));
        assert_eq!(refused(&["body"]), GroupError::Name("body".into()));
        assert_eq!(refused(&["a:b=X"]), GroupError::Name("a:b".into()));
        let many: Vec<String> = (0..8).map(|i| format!("g{i}=X")).collect();
        let many: Vec<&str> = many.iter().map(String::as_str).collect();
        assert_eq!(refused(&many), GroupError::TooMany { have: 9 });
    }
}
