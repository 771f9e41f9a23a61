//! Motion with times and contacts, captured or from the core: the input of the measures of feet and joint speeds.

use gestus_core::blob::layout::dof;
use gestus_database::{registration::contact::contacts, stream::Streamed};
use gestus_motion::{
    body::{Body, about_y},
    clip::{Clip, Frame},
};
use nalgebra::Vector3;

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

/// Time of each pose, seconds from the first, where `steps_s` are the seconds from each pose's predecessor to it.
pub fn times(steps_s: &[f64]) -> Vec<f64> {
    let mut time = 0.0;
    let later = steps_s.iter().skip(1).map(|step_s| {
        time += step_s;
        time
    });
    std::iter::once(0.0).chain(later).take(steps_s.len()).collect()
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

    /// Dofs, on the way that their own velocities and times make, from the origin.
    pub fn of_rows(body: &Body, rows: &[Vec<f64>], steps_s: Vec<f64>, stands: Vec<[bool; 2]>) -> Self {
        let (mut ground, mut heading) = (Vector3::zeros(), 0.0);
        let frames = rows
            .iter()
            .zip(&steps_s)
            .enumerate()
            .map(|(t, (row, step_s))| {
                if t > 0 {
                    ground +=
                        about_y(heading) * Vector3::new(row[dof::LEFT], 0.0, row[dof::FORWARD]) * *step_s;
                    heading += row[dof::YAW] * step_s;
                }
                body.pose(row, [ground.x, ground.z], heading)
            })
            .collect();
        Self { frames, steps_s, stands }
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
