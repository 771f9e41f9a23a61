//! A corpus on fewer joints, for a body that lacks some of the skeleton's or a board with little memory.
//!
//! Contacts and cycles of the whole skeleton are kept. The joints that are kept have to form a tree from the root, since a
//! joint without its parent would lose the parent's rotations.

use std::sync::Arc;

use thiserror::Error;

use crate::{
    clip::{Clip, Skeleton},
    corpus::{Corpus, Example},
};

/// A selection of joints that can't be kept.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
pub enum JointsError {
    /// No such joint.
    #[error("the skeleton has no joint `{name}`: it has {list}")]
    Unknown {
        /// The unknown name.
        name: String,
        /// The known names.
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

/// The clip on some of its joints; `skeleton` is [`skeleton_of`] them.
pub fn clip_on(clip: &Clip, kept: &[usize], skeleton: &Arc<Skeleton>) -> Clip {
    Clip {
        name: clip.name.clone(),
        skeleton: skeleton.clone(),
        rate_hz: clip.rate_hz,
        frames: clip.frames.iter().map(|frame| frame.on_joints(kept)).collect(),
    }
}

/// The skeleton of some joints, which have to form a tree.
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
