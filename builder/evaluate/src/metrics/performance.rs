//! Motion with times and contacts, captured or from the core: the input of the measures of feet and joint speeds.

use gestus_database::{registration::contact::contacts, stream::Streamed};
use gestus_motion::{
    body::Body,
    clip::{Clip, Frame},
};

/// Poses with the times between them and the feet that stand.
#[derive(Debug, Clone)]
pub struct Performance {
    /// The poses.
    pub frames: Vec<Frame>,
    /// Seconds from each pose's predecessor to it.
    pub steps_s: Vec<f64>,
    /// Which foot stands.
    pub stands: Vec<[bool; 2]>,
}

impl Performance {
    /// A clip with its kinematic contacts.
    pub fn of_clip(clip: &Clip, body: &Body) -> Self {
        Self {
            frames: clip.frames.clone(),
            steps_s: vec![1.0 / clip.rate_hz; clip.frames.len()],
            stands: contacts(clip, &body.landmarks),
        }
    }

    /// A stream's output, each pose at its own time, with the contacts that the core reported.
    pub fn of_stream(streamed: &Streamed) -> Self {
        let steps = || streamed.steps.iter();
        Self {
            frames: steps().map(|s| s.frame.clone()).collect(),
            steps_s: steps().map(|s| f64::from(s.report.step_s)).collect(),
            stands: steps().map(|s| s.report.contacts).collect(),
        }
    }
}
