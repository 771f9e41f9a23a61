//! Identifies body parts: by the map file, by names, by shape, in this order.

use std::{collections::BTreeMap, fmt};

use thiserror::Error;

use crate::retarget::{
    facing,
    file::MapFile,
    parts::{Named, Part, Side, families, named},
    shape::{self, ShapeError},
    tree::{advice, below, next},
};
use gestus_motion::{
    clip::{Frame, Skeleton},
    names::Family,
};

/// Source of an identification.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum How {
    /// The map file says so.
    File,
    /// By its name, in that family of skeletons.
    Name(&'static str),
    /// By its name, in none in particular.
    Word,
    /// By the skeleton's shape.
    Shape,
    /// By where it is in the tree, between joints that were found.
    Tree,
}

impl fmt::Display for How {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            How::File => f.write_str("map file"),
            How::Name(family) => write!(f, "name ({family})"),
            How::Word => f.write_str("name"),
            How::Shape => f.write_str("shape"),
            How::Tree => f.write_str("place in the tree"),
        }
    }
}

/// Identified body parts of a skeleton.
#[derive(Debug, Clone, Default)]
pub struct Parts {
    /// Joint of each part.
    pub joints: BTreeMap<Part, usize>,
    /// How each was found.
    pub how: BTreeMap<Part, How>,
    /// From the joint above the hips to the chest, the joint that carries the arms.
    pub spine: Vec<usize>,
    /// From the joint above the chest to the head.
    pub neck: Vec<usize>,
    /// What a person should look at.
    pub doubts: Vec<String>,
}

/// A skeleton whose parts can't be identified.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[allow(missing_docs, reason = "the messages say what the fields are")]
pub enum IdentifyError {
    #[error(
        "no {missing} found among the joints {joints}: their names do not say it, and by shape {shape}; name them in a map \
         file: [joints] {example} = \"...\""
    )]
    Missing { missing: String, joints: String, shape: String, example: String },
    #[error("the map file says that {part} is `{name}`, which is not a joint; the joints are {joints}")]
    NoSuchJoint { part: Part, name: String, joints: String },
    #[error(
        "{lower} (`{lower_joint}`) is not below {upper} (`{upper_joint}`) in the skeleton, but below `{parent}`: {advice}"
    )]
    Tree {
        upper: Part,
        upper_joint: String,
        lower: Part,
        lower_joint: String,
        parent: String,
        advice: String,
    },
    #[error("{a} and {b} are both `{joint}`: say in a map file which is which")]
    Twice { a: Part, b: Part, joint: String },
}

impl Parts {
    /// Joint of a part.
    pub fn get(&self, part: Part) -> Option<usize> {
        self.joints.get(&part).copied()
    }

    /// Finds the parts of a skeleton. `frames` are some of its poses, Y up.
    ///
    /// # Errors
    /// [`IdentifyError`] where arms or legs are missing, or a file says what is not so.
    pub fn find(skeleton: &Skeleton, frames: &[Frame], file: &MapFile) -> Result<Self, IdentifyError> {
        let mut parts = Self::default();
        let listed = || skeleton.names.join(", ");
        for (&part, name) in &file.joints {
            if let Some(name) = name {
                let joint = skeleton.find(name).ok_or_else(|| IdentifyError::NoSuchJoint {
                    part,
                    name: name.clone(),
                    joints: listed(),
                })?;
                parts.put(part, joint, How::File);
            }
        }
        let denied = |part: &Part| file.joints.get(part).is_some_and(Option::is_none);
        parts.by_name(skeleton, &denied);
        parts.ends(skeleton, &denied);
        // A rig may have several joints of one name, of controls and of the body, which do not hang together.
        let is_named = parts.missing().next().is_none()
            && (!file.joints.is_empty() || parts.check_tree(skeleton).is_ok());
        let shape = if is_named { Ok(()) } else { parts.by_shape(skeleton, frames, &denied) };
        if !parts.joints.contains_key(&Part::Hips) || parts.get(Part::Hips) != Some(0) {
            parts.joints.insert(Part::Hips, 0);
            parts.how.insert(Part::Hips, How::Tree);
        }
        let missing: Vec<Part> = parts.missing().collect();
        if let Some(first) = missing.first() {
            return Err(IdentifyError::Missing {
                missing: missing.iter().map(ToString::to_string).collect::<Vec<_>>().join(", "),
                joints: listed(),
                shape: shape.err().map_or_else(|| "they are not there".into(), |error| error.to_string()),
                example: first.to_string(),
            });
        }
        parts.check_tree(skeleton)?;
        parts.check_sides(skeleton, frames);
        parts.trunk(skeleton, &denied);
        parts.doubt(skeleton);
        Ok(parts)
    }

    fn put(&mut self, part: Part, joint: usize, how: How) {
        self.joints.entry(part).or_insert(joint);
        self.how.entry(part).or_insert(how);
    }

    fn missing(&self) -> impl Iterator<Item = Part> + '_ {
        let needed = Part::all().into_iter().filter(|p| !p.optional() && *p != Part::Hips);
        needed.filter(|p| !self.joints.contains_key(p))
    }

    /// By the family of names that explains most, and in which limbs hang together.
    fn by_name(&mut self, skeleton: &Skeleton, denied: &dyn Fn(&Part) -> bool) {
        let names: Vec<&str> = skeleton.names.iter().map(String::as_str).collect();
        let taken = |parts: &Self, joint: usize| parts.joints.values().any(|&j| j == joint);
        let joints = named(&names);
        let put = |parts: &mut Self, of: &dyn Fn(&Named<'_>) -> Option<Part>, how: How| {
            for (j, joint) in joints.iter().enumerate() {
                if let Some(part) = of(joint).filter(|p| !denied(p) && !taken(parts, j)) {
                    parts.put(part, j, how);
                }
            }
        };
        let in_family = |family: &'static Family| {
            let mut parts = self.clone();
            put(&mut parts, &|joint| joint.part_in(family), How::Name(&family.name));
            parts
        };
        let found: Vec<Self> = families(&joints).into_iter().map(in_family).collect();
        let whole = found.iter().find(|parts| parts.check_tree(skeleton).is_ok());
        if let Some(best) = whole.or(found.first()) {
            *self = best.clone();
        }
        put(self, &|joint| joint.likely(), How::Word);
    }

    /// Hands, feet and toes that no name tells: the joint that follows the lower bone of a limb whose bones are named.
    fn ends(&mut self, skeleton: &Skeleton, denied: &dyn Fn(&Part) -> bool) {
        let next = next(skeleton);
        for side in Side::BOTH {
            let [leg, arm] = limbs(side);
            for chain in [&leg[..], &arm[1..]] {
                if self.get(chain[0]).is_none() || self.get(chain[2]).is_some() {
                    continue;
                }
                for pair in chain[1..].windows(2).take_while(|pair| !denied(&pair[1])) {
                    let free = |joint: &usize| !self.joints.values().any(|taken| taken == joint);
                    let Some(end) = self.get(pair[0]).and_then(|joint| next[joint]).filter(free) else {
                        break;
                    };
                    self.put(pair[1], end, How::Tree);
                }
            }
        }
    }

    fn by_shape(
        &mut self,
        skeleton: &Skeleton,
        frames: &[Frame],
        denied: &dyn Fn(&Part) -> bool,
    ) -> Result<(), ShapeError> {
        let named_head = self.get(Part::Head);
        let mut shape = shape::find(skeleton, frames)?;
        // A head that is called so is one, if it is in the chain that reaches highest: eyes and hair reach higher.
        if let Some((_, head)) = shape.parts.iter_mut().find(|(part, _)| *part == Part::Head)
            && let Some(named) = named_head.filter(|&named| below(skeleton, *head, named))
        {
            *head = named;
        }
        // Names and shape together contradict each other too easily: a side of a limb is one or the other.
        let from_file: Vec<Part> =
            self.how.iter().filter(|(_, h)| **h == How::File).map(|(p, _)| *p).collect();
        let complete = shape.parts.len() >= 11;
        if complete {
            self.doubts.extend(self.contradiction(skeleton, &shape.parts));
            self.joints.retain(|p, _| from_file.contains(p));
            self.how.retain(|p, _| from_file.contains(p));
        }
        for (part, joint) in shape.parts {
            if !denied(&part) && !self.joints.values().any(|&j| j == joint && part != Part::Hips) {
                self.put(part, joint, How::Shape);
            }
        }
        if complete && shape.symmetry < 0.95 {
            self.doubts.push(format!(
                "parts were found by shape, and the two sides differ by {:.0}% in length: check them",
                100.0 * (1.0 - shape.symmetry)
            ));
        } else if complete {
            self.doubts.push(
                "parts were found by shape, since the names say too little: check left and right (`gestus retarget \
                 --check` lists them, a map file corrects them)"
                    .into(),
            );
        }
        Ok(())
    }

    /// What the names of joints say that shape contradicts.
    fn contradiction(&self, skeleton: &Skeleton, by_shape: &[(Part, usize)]) -> Option<String> {
        let named = |joint: usize| self.joints.iter().find(|(_, j)| **j == joint).map(|(part, _)| *part);
        let (joint, by_name, by_shape) = by_shape.iter().find_map(|&(part, joint)| {
            let by_name = named(joint).filter(|&by_name| by_name != part && part != Part::Hips)?;
            Some((joint, by_name, part))
        })?;
        Some(format!(
            "by its name `{}` is the {by_name}, and by shape the {by_shape}, as which it is taken: name the joints in a map \
             file if that is wrong",
            skeleton.names[joint]
        ))
    }

    /// Left is where left is: names that say otherwise than the feet are exchanged, and reported.
    fn check_sides(&mut self, skeleton: &Skeleton, frames: &[Frame]) {
        /// Least sureness to contradict a name.
        const SURE: f64 = 0.5;
        let limb = |side, parts: [fn(Side) -> Part; 4]| parts.map(|part| self.get(part(side)));
        let legs = Side::BOTH.map(|s| limb(s, [Part::UpperLeg, Part::LowerLeg, Part::Foot, Part::Toes]));
        let arms = Side::BOTH.map(|s| {
            let mut arm = limb(s, [Part::UpperArm, Part::LowerArm, Part::Hand, Part::Hand]);
            arm[3] = None;
            arm
        });
        let positions: Vec<_> = frames.iter().map(|f| f.positions(skeleton)).collect();
        if facing::first_is_left(&positions, legs, &arms) > -SURE {
            return;
        }
        let by_name = self.get(Part::UpperLeg(Side::Left)).map_or("", |j| skeleton.names[j].as_str());
        if self.how.values().any(|how| *how == How::File) {
            self.doubts.push(format!(
                "the map file says that `{by_name}` is on the left, and feet and knees say that it is on the right"
            ));
            return;
        }
        self.doubts.push(format!(
            "`{by_name}` and what is named like it are on the right, as feet and knees point: left and right are \
             exchanged; name the joints in a map file if that is wrong"
        ));
        self.joints = self.joints.iter().map(|(part, &j)| (part.mirrored(), j)).collect();
        self.how = self.how.iter().map(|(part, &how)| (part.mirrored(), how)).collect();
    }

    fn check_tree(&self, skeleton: &Skeleton) -> Result<(), IdentifyError> {
        for side in Side::BOTH {
            for chain in limbs(side) {
                let known: Vec<(Part, usize)> =
                    chain.iter().filter_map(|&p| Some((p, self.get(p)?))).collect();
                for pair in known.windows(2) {
                    let ((upper, a), (lower, b)) = (pair[0], pair[1]);
                    if !below(skeleton, b, a) || a == b {
                        let name = |j: usize| skeleton.names[j].clone();
                        return Err(IdentifyError::Tree {
                            upper,
                            upper_joint: name(a),
                            lower,
                            lower_joint: name(b),
                            parent: skeleton.parents[b].map_or_else(|| "nothing".into(), name),
                            advice: advice(skeleton),
                        });
                    }
                }
            }
        }
        let all: Vec<(&Part, &usize)> = self.joints.iter().collect();
        for (i, (a, ja)) in all.iter().enumerate() {
            if let Some((b, _)) = all[i + 1..].iter().find(|(_, jb)| jb == ja) {
                let joint = skeleton.names[**ja].clone();
                return Err(IdentifyError::Twice { a: **a, b: **b, joint });
            }
        }
        Ok(())
    }

    /// Spine, chest, neck, collarbones: by the tree between what was found.
    fn trunk(&mut self, skeleton: &Skeleton, denied: &dyn Fn(&Part) -> bool) {
        let arms = Side::BOTH.map(|s| self.get(Part::UpperArm(s)).map_or(vec![0], |j| skeleton.path(j)));
        let chest =
            arms[0].iter().zip(&arms[1]).take_while(|(a, b)| a == b).map(|(a, _)| *a).last().unwrap_or(0);
        if chest > 0 && !denied(&Part::Chest) {
            self.put(Part::Chest, chest, How::Tree);
        }
        let chest = self.get(Part::Chest).unwrap_or(chest);
        self.spine = skeleton.path(chest).into_iter().skip(1).collect();
        if let Some(head) = self.get(Part::Head).filter(|&h| below(skeleton, h, chest) && h != chest) {
            self.neck = skeleton.path(head).into_iter().skip_while(|&j| j != chest).skip(1).collect();
        } else if let Some(head) = self.joints.remove(&Part::Head) {
            self.doubts.push(format!("`{}` is not above the chest: no head is mapped", skeleton.names[head]));
        }
        for side in Side::BOTH {
            let between: Vec<usize> = arms[side.index()]
                .iter()
                .copied()
                .skip_while(|&j| j != chest)
                .skip(1)
                .filter(|&j| Some(j) != self.get(Part::UpperArm(side)))
                .collect();
            if let Some(&last) = between.last()
                && !denied(&Part::Clavicle(side))
            {
                self.put(Part::Clavicle(side), last, How::Tree);
            }
        }
    }

    fn doubt(&mut self, skeleton: &Skeleton) {
        let length = |upper: Part, lower: Part| -> Option<f64> {
            let (a, mut b) = (self.get(upper)?, self.get(lower)?);
            let mut sum = 0.0;
            while b != a {
                sum += skeleton.offsets[b].norm();
                b = skeleton.parents[b]?;
            }
            Some(sum)
        };
        type Bone = (&'static str, fn(Side) -> Part, fn(Side) -> Part);
        let bones: [Bone; 4] = [
            ("thighs", Part::UpperLeg, Part::LowerLeg),
            ("shins", Part::LowerLeg, Part::Foot),
            ("upper arms", Part::UpperArm, Part::LowerArm),
            ("lower arms", Part::LowerArm, Part::Hand),
        ];
        let mut doubts = Vec::new();
        for (what, upper, lower) in bones {
            let of = |s: Side| length(upper(s), lower(s));
            match (of(Side::Left), of(Side::Right)) {
                (Some(l), Some(r)) if l.min(r) < 0.85 * l.max(r) => {
                    doubts.push(format!(
                        "the two {what} differ in length: {:.1} and {:.1} cm",
                        100.0 * l,
                        100.0 * r
                    ));
                }
                (Some(l), Some(r)) if l.min(r) < 0.03 => {
                    doubts.push(format!("the {what} are {:.1} cm long", 100.0 * l.min(r)));
                }
                _ => {}
            }
        }
        for part in Part::all() {
            if self.get(part).is_none() {
                doubts.push(format!("no {part}: the joints below it follow the joint above"));
            }
        }
        self.doubts.extend(doubts);
    }

    /// Joints that are no part, nor in spine or neck.
    pub fn others<'a>(&'a self, skeleton: &'a Skeleton) -> impl Iterator<Item = usize> + 'a {
        (0..skeleton.joints()).filter(|j| {
            !self.joints.values().any(|k| k == j) && !self.spine.contains(j) && !self.neck.contains(j)
        })
    }
}

/// Parts of a leg and an arm, each below the one before it; an arm begins with its collarbone.
fn limbs(side: Side) -> [[Part; 4]; 2] {
    [
        [Part::UpperLeg(side), Part::LowerLeg(side), Part::Foot(side), Part::Toes(side)],
        [Part::Clavicle(side), Part::UpperArm(side), Part::LowerArm(side), Part::Hand(side)],
    ]
}
