//! Fewer joints: a corpus for a body that has not all of the skeleton's, or a board that has no room for them.
//!
//! Contacts and cycles stay those that the whole skeleton showed. What is kept has to be a tree from the root, for a
//! joint without its parent would have to take over the parent's turns.

use std::sync::Arc;

use thiserror::Error;

use crate::{
    corpus::{Corpus, Example},
    motion::{Clip, Frame, Skeleton},
};

/// Joints that can't be kept by themselves.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
pub enum JointsError {
    /// No such joint.
    #[error("the skeleton has no joint `{name}`: it has {list}")]
    Unknown {
        /// What was asked for.
        name: String,
        /// What there is.
        list: String,
    },
    /// The parent is left out.
    #[error("joint `{joint}` can't be kept without its parent `{parent}`")]
    Parent {
        /// The joint.
        joint: String,
        /// Its parent.
        parent: String,
    },
}

/// Indices of the joints to keep, in the skeleton's order.
///
/// # Errors
/// [`JointsError`] for unknown names, and where a parent is missing.
pub fn kept(skeleton: &Skeleton, names: &[String]) -> Result<Vec<usize>, JointsError> {
    if let Some(name) = names.iter().find(|n| skeleton.find(n).is_none()) {
        return Err(JointsError::Unknown { name: name.clone(), list: skeleton.names.join(", ") });
    }
    let kept: Vec<usize> = (0..skeleton.joints()).filter(|&j| names.contains(&skeleton.names[j])).collect();
    let orphan = kept.iter().find_map(|&j| {
        let parent = skeleton.parents[j].unwrap_or(0);
        (!kept.contains(&parent)).then_some((j, parent))
    });
    match orphan {
        Some((joint, parent)) => Err(JointsError::Parent {
            joint: skeleton.names[joint].clone(),
            parent: skeleton.names[parent].clone(),
        }),
        None => Ok(kept),
    }
}

/// The clip on some of its joints; `skeleton` is what [`skeleton_of`] gives for them.
pub fn clip_on(clip: &Clip, kept: &[usize], skeleton: &Arc<Skeleton>) -> Clip {
    let pick = |f: &Frame| Frame { root: f.root, rotations: kept.iter().map(|&j| f.rotations[j]).collect() };
    Clip {
        name: clip.name.clone(),
        skeleton: skeleton.clone(),
        rate_hz: clip.rate_hz,
        frames: clip.frames.iter().map(pick).collect(),
    }
}

/// The skeleton of some joints, which are a tree.
pub fn skeleton_of(skeleton: &Skeleton, kept: &[usize]) -> Arc<Skeleton> {
    let place = |j: usize| kept.iter().position(|&k| k == j);
    Arc::new(Skeleton {
        names: kept.iter().map(|&j| skeleton.names[j].clone()).collect(),
        parents: kept.iter().map(|&j| skeleton.parents[j].and_then(place)).collect(),
        offsets: kept.iter().map(|&j| skeleton.offsets[j]).collect(),
    })
}

impl Corpus {
    /// The corpus on some of its joints, by name.
    ///
    /// # Errors
    /// [`JointsError`] for unknown names, and where a parent is missing.
    pub fn on_joints(&self, names: &[String]) -> Result<Corpus, JointsError> {
        let kept = kept(&self.skeleton, names)?;
        let skeleton = skeleton_of(&self.skeleton, &kept);
        let on = |e: &Example| Example { clip: clip_on(&e.clip, &kept, &skeleton), ..e.clone() };
        Ok(Corpus {
            skeleton: skeleton.clone(),
            examples: self.examples.iter().map(on).collect(),
            ..self.clone()
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::synth;

    fn names(list: &[&str]) -> Vec<String> {
        list.iter().map(|n| (*n).to_owned()).collect()
    }

    #[test]
    fn kept_joints_are_where_they_were() {
        let options = synth::Options {
            actions: names(&["walk"]),
            styles: names(&["neutral"]),
            clips: 1,
            seconds: 3.0,
            ..synth::Options::default()
        };
        let whole = synth::corpus(&options).unwrap();
        let wanted: Vec<String> = whole.skeleton.names[..3].to_vec();
        let few = whole.on_joints(&wanted).unwrap();
        assert_eq!(few.skeleton.names, wanted);
        let (a, b) = (&whole.examples[0].clip, &few.examples[0].clip);
        for (x, y) in a.frames.iter().zip(&b.frames) {
            let (x, y) = (x.positions(&a.skeleton), y.positions(&b.skeleton));
            for joint in 0..3 {
                assert!((x[joint] - y[joint]).norm() < 1e-12);
            }
        }
        assert_eq!(few.examples[0].contacts, whole.examples[0].contacts);
    }

    #[test]
    fn a_joint_without_its_parent_is_refused_by_name() {
        let skeleton = synth::skeleton();
        let child = (0..skeleton.joints()).find(|&j| skeleton.parents[j].is_some_and(|p| p > 0)).unwrap();
        let root = skeleton.names[0].clone();
        let error = kept(&skeleton, &[root.clone(), skeleton.names[child].clone()]).unwrap_err();
        assert!(matches!(error, JointsError::Parent { joint, .. } if joint == skeleton.names[child]));
        let error = kept(&skeleton, &[root, "Tail".into()]).unwrap_err();
        assert!(error.to_string().contains("no joint `Tail`"));
    }
}
