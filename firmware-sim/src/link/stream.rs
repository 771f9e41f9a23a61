//! Streams a clip through a board and the core on this machine.

use std::time::{Duration, Instant};

use anyhow::{Context, Result};
use gestus_core::Digest;
use gestus_database::stream::{Step, Streamed, from_pose, to_pose};
use gestus_motion::clip::Clip;
use serde_json::{Value, json};

use super::{
    line::Line,
    session::{Driven, Session},
};

/// The result of streaming a clip through a board.
#[derive(Debug, Clone)]
pub struct Linked {
    /// The board's output. `micros` of a step is the time of its round trip, microseconds.
    pub streamed: Streamed,
    /// Digest of this machine's output.
    pub host_digest: u32,
    /// Frames that differ in any bit.
    pub differing: usize,
    /// Number of the first of them.
    pub first_difference: Option<usize>,
    /// Largest angle between a joint's rotation on the board and on this machine, radians.
    pub difference_rad: f64,
    /// Instructions of each step by stage; empty for a board that does not count.
    pub stages: Vec<Vec<u32>>,
    /// Frames whose reply came after the next frame was due, in a paced stream.
    pub late: usize,
    /// Ticks of the robot; empty without one.
    pub driven: Vec<Driven>,
}

impl Linked {
    /// Total instructions of each step, ascending; empty for a board that does not count.
    pub fn instructions(&self) -> Vec<u64> {
        let mut totals: Vec<u64> = self
            .stages
            .iter()
            .filter(|stages| !stages.is_empty())
            .map(|stages| stages.iter().copied().map(u64::from).sum())
            .collect();
        totals.sort_unstable();
        totals
    }

    /// True if every bit of every pose, report and tick is the same as on this machine.
    pub fn bit_exact(&self) -> bool {
        self.differing == 0
            && self.streamed.digest == self.host_digest
            && self.driven.iter().all(|tick| tick.same)
    }

    /// Figures of the robot's ticks; `None` without a robot.
    pub fn robot_json(&self) -> Option<Value> {
        let first = self.driven.first()?;
        let most = |of: fn(&Driven) -> f32| self.driven.iter().map(of).fold(0.0, f32::max);
        Some(json!({
            "hinges": first.hinges.len(),
            "ticks": self.driven.len(),
            "ticks_differing": self.driven.iter().filter(|tick| !tick.same).count(),
            "ticks_held": self.driven.iter().filter(|tick| tick.held).count(),
            "lag_max_deg": most(|tick| tick.lag).to_degrees(),
            "missing_max_cm": 100.0 * most(|tick| tick.missing_m),
        }))
    }

    /// The robot's ticks as a table: `tick`, then `angle_0_rad`, `pulse_0_us` and so on, in the order of its hinges.
    pub fn robot_csv(&self) -> String {
        let hinges = self.driven.first().map_or(0, |tick| tick.hinges.len());
        let head = (0..hinges).map(|h| format!(",angle_{h}_rad,pulse_{h}_us")).collect::<String>();
        let rows = self.driven.iter().enumerate().map(|(t, tick)| {
            let row = tick.hinges.iter().map(|(angle, pulse)| format!(",{angle},{pulse}"));
            format!("{t}{}\n", row.collect::<String>())
        });
        format!("tick{head}\n{}", rows.collect::<String>())
    }
}

/// Streams a clip, which has to be at the database's rate and on its joints. With `pace_hz` that many frames are sent a
/// second, otherwise each as soon as the previous one is answered. `progress` is called after each frame.
///
/// # Errors
/// [`LinkError`](super::LinkError), with the number of the frame.
pub fn stream<L: Line>(
    session: &mut Session<'_, L>,
    clip: &Clip,
    pace_hz: Option<f64>,
    mut progress: impl FnMut(),
) -> Result<Linked> {
    let joints = session.joints();
    let (mut digest, mut host_digest) = (Digest::new(), Digest::new());
    let (mut steps, mut stages) = (Vec::with_capacity(clip.frames.len()), Vec::new());
    let (mut differing, mut first_difference, mut late, mut difference_rad) = (0, None, 0, 0.0);
    let (mut driven, mut played_s) = (Vec::new(), 0.0);
    let start = Instant::now();
    for (t, frame) in clip.frames.iter().enumerate() {
        let due = |t: usize| pace_hz.map(|rate_hz| Duration::from_secs_f64(t as f64 / rate_hz));
        if let Some(due) = due(t) {
            std::thread::sleep(due.saturating_sub(start.elapsed()));
        }
        let one_call = session.in_one_call();
        let (stepped, ticks) = if one_call {
            session.step_robot(&to_pose(frame))
        } else {
            session.step(&to_pose(frame)).map(|stepped| (stepped, Vec::new()))
        }
        .with_context(|| format!("frame {t}"))?;
        driven.extend(ticks);
        late += usize::from(due(t + 1).is_some_and(|next| start.elapsed() > next));
        if !stepped.same {
            differing += 1;
            first_difference.get_or_insert(t);
            let frames = [&stepped.pose, &stepped.host_pose].map(|pose| from_pose(pose, joints));
            difference_rad = frames[0].angle_to(&frames[1]).max(difference_rad);
        }
        digest.add(&stepped.pose, joints, stepped.report.step_s);
        host_digest.add(&stepped.host_pose, joints, stepped.host_report.step_s);
        stages.push(stepped.report.stages.to_vec());
        steps.push(Step {
            frame: from_pose(&stepped.pose, joints),
            report: stepped.report.report(),
            micros: stepped.round_trip.as_secs_f64() * 1e6,
        });
        played_s += f64::from(stepped.report.step_s);
        if let Some(robot) = session.robot().filter(|_| !one_call) {
            // The robot ticks at its own rate: as many ticks as are due before the next pose.
            while driven.len() as f64 * f64::from(robot.tick_s) < played_s {
                let tick = session.drive().with_context(|| format!("frame {t}: the robot"))?;
                driven.push(tick);
            }
        }
        progress();
    }
    let ram_bytes = session.identity().ram_bytes as usize;
    Ok(Linked {
        streamed: Streamed { steps, digest: digest.value(), ram_bytes, retimed: None },
        host_digest: host_digest.value(),
        differing,
        first_difference,
        difference_rad,
        stages,
        late,
        driven,
    })
}
