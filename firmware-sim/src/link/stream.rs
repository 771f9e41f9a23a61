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

/// A clip that went through a board.
#[derive(Debug, Clone)]
pub struct Linked {
    /// The board's output. `micros` of a step are those of its round trip.
    pub streamed: Streamed,
    /// Digest of this machine's output.
    pub host_digest: u32,
    /// Frames that differ in any bit.
    pub differing: usize,
    /// The first of them.
    pub first_difference: Option<usize>,
    /// Largest angle between a joint's rotation on the board and on this machine, radians.
    pub apart_rad: f64,
    /// Instructions of each step by stage, where the board counts them.
    pub stages: Vec<Vec<u32>>,
    /// Frames whose answer came after the next one was due, where the stream kept the rate.
    pub late: usize,
    /// Ticks of the robot, where one was found.
    pub driven: Vec<Driven>,
}

impl Linked {
    /// Instructions of each step in total, ascending; none where the board does not count.
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

    /// Every bit of every pose, report and tick was that of this machine.
    pub fn bit_exact(&self) -> bool {
        self.differing == 0
            && self.streamed.digest == self.host_digest
            && self.driven.iter().all(|tick| tick.same)
    }

    /// What the robot did, as figures; nothing where there is none.
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

/// Streams a clip, which has to be at the database's rate and on its joints. With `pace` a frame is sent when it is
/// due; else as soon as the one before is answered. `progress` hears of each frame.
///
/// # Errors
/// [`LinkError`](super::LinkError), with the frame at which it happened.
pub fn stream<L: Line>(
    session: &mut Session<'_, L>,
    clip: &Clip,
    pace: bool,
    mut progress: impl FnMut(),
) -> Result<Linked> {
    let joints = session.joints();
    let (mut digest, mut host_digest) = (Digest::new(), Digest::new());
    let (mut steps, mut stages) = (Vec::with_capacity(clip.frames.len()), Vec::new());
    let (mut differing, mut first_difference, mut late, mut apart_rad) = (0, None, 0, 0.0);
    let (mut driven, mut played_s) = (Vec::new(), 0.0);
    let start = Instant::now();
    for (t, frame) in clip.frames.iter().enumerate() {
        let due = Duration::from_secs_f64(t as f64 / clip.rate_hz);
        if pace {
            std::thread::sleep(due.saturating_sub(start.elapsed()));
        }
        let stepped = session.step(&to_pose(frame)).with_context(|| format!("frame {t}"))?;
        if pace && start.elapsed() > due + Duration::from_secs_f64(1.0 / clip.rate_hz) {
            late += 1;
        }
        if !stepped.same {
            differing += 1;
            first_difference.get_or_insert(t);
            let frames = [&stepped.pose, &stepped.host_pose].map(|pose| from_pose(pose, joints));
            let pairs = frames[0].rotations.iter().zip(&frames[1].rotations);
            apart_rad = pairs.map(|(a, b)| a.angle_to(b)).fold(apart_rad, f64::max);
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
        if let Some(robot) = session.robot() {
            // The robot keeps its own time: as many ticks as fall before the next pose.
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
        apart_rad,
        stages,
        late,
        driven,
    })
}
