//! The figures of a motion against the truth clip: of a prediction, or of the poses that leave.

use gestus_core::blob::Leg;
use gestus_database::{registration::contact::legs, stream::Streamed};
use gestus_motion::{
    body::{Body, row_at},
    clip::Clip,
    corpus::{Corpus, Cycle},
};
use nalgebra::Vector3;

use crate::metrics::{
    amplitude, centred,
    feet::{skate_cm_s, stillest_cm_s},
    joint_distance, matched,
    performance::{Performance, times},
    speed::ground_speed,
    third_difference, variability,
};

/// Mean speed on the ground below which a clip stays where it is, m/s: a ratio to less says nothing.
const STAYS: f64 = 0.1;

/// The figures of one motion, in units and by definitions of `docs/METRICS.md`.
#[derive(Debug, Clone, Copy)]
pub struct Figures {
    /// Mean joint error, centimetres; not a number where no frame is in a cycle.
    pub error_cm: f64,
    /// Mean error of a time step, milliseconds; of methods that predict it.
    pub step_error_ms: Option<f64>,
    /// Duration over the truth's.
    pub duration: Option<f64>,
    /// Third difference, relative to the truth's.
    pub third_difference: f64,
    /// How far joints swing, relative to the truth's; of clips that last long enough.
    pub amplitude: Option<f64>,
    /// Cycle-to-cycle variability relative to the truth's; of clips with two cycles or more.
    pub variability: Option<f64>,
    /// Mean speed on the ground relative to the truth's; of clips that move.
    pub speed: Option<f64>,
    /// Mean speed on the ground of the feet that stand in the truth at the matched moments, cm/s; not a number where
    /// none does.
    pub skate_counterpart_cm_s: f64,
    /// Mean speed on the ground of the stillest foot joint of each frame, cm/s.
    pub skate_stillest_cm_s: f64,
}

/// A motion to be measured, one pose a frame of the test clip.
pub(crate) struct Motion {
    /// Dofs of the poses. Shape `[frames][D]`.
    rows: Vec<Vec<f64>>,
    /// The poses on their way, with times and the feet that should stand.
    performance: Performance,
    /// Whether the method says how long a step takes.
    timed: bool,
}

/// What motions are compared with: the truth clip at the moments that match the test clip's frames.
pub(crate) struct Reference {
    body: Body,
    /// The test clip, for its skeleton and rate.
    test: Clip,
    /// The test clip's cycles.
    cycles: Vec<Cycle>,
    /// The legs, with the heights at which the truth's feet stand.
    legs: [Leg; 2],
    /// The truth's frame at each frame of the test clip. Shape `[frames]`.
    pub(crate) at: Vec<Option<f64>>,
    /// Joint positions there. Shape `[frames][joints]`.
    poses: Vec<Option<Vec<Vector3<f64>>>>,
    /// Which feet of the truth stand there; none outside of cycles. Shape `[frames]`.
    pub(crate) stands: Vec<[bool; 2]>,
    third_difference: f64,
    amplitude: Option<f64>,
    variability: Option<f64>,
    ground_speed: f64,
}

impl Reference {
    /// The truth clip for a test clip; `rows` are the truth's dofs, and `shift` is that of [`matched`].
    pub(crate) fn of(
        corpus: &Corpus,
        body: &Body,
        [test, truth]: [usize; 2],
        rows: &[Vec<f64>],
        shift: usize,
    ) -> Self {
        let (test, truth) = (&corpus.examples[test], &corpus.examples[truth]);
        let at: Vec<Option<f64>> =
            (0..test.clip.frames.len()).map(|t| matched(&test.cycles, t, &truth.cycles, shift)).collect();
        let stands_at = |p: &f64| truth.contacts.get(p.round() as usize).copied();
        let all: Vec<_> = rows.iter().map(|r| centred(body, r)).collect();
        let inside: Vec<bool> =
            (0..rows.len()).map(|t| matched(&truth.cycles, t, &truth.cycles, 0).is_some()).collect();
        Self {
            body: body.clone(),
            test: Clip { frames: Vec::new(), ..test.clip.clone() },
            cycles: test.cycles.clone(),
            legs: legs(&[truth], &body.landmarks),
            poses: at.iter().map(|p| p.map(|p| centred(body, &row_at(rows, p)))).collect(),
            stands: at.iter().map(|p| p.as_ref().and_then(stands_at).unwrap_or_default()).collect(),
            third_difference: third_difference(&all),
            amplitude: amplitude(&all, truth.clip.rate_hz),
            variability: variability(body, rows, &truth.cycles),
            ground_speed: ground_speed(&Performance::of_clip(&truth.clip, body), &inside),
            at,
        }
    }

    /// Dofs, on the way that their own velocities and times make; `steps_s` are the times of a method that predicts them.
    pub(crate) fn predicted(&self, rows: &[Vec<f64>], steps_s: Option<Vec<f64>>) -> Motion {
        let timed = steps_s.is_some();
        let steps_s = steps_s.unwrap_or_else(|| vec![1.0 / self.test.rate_hz; rows.len()]);
        let performance = Performance::of_rows(&self.body, rows, steps_s, self.stands.clone());
        Motion { rows: rows.to_vec(), performance, timed }
    }

    /// The poses that leave, each at its own time.
    pub(crate) fn delivered(&self, streamed: &Streamed) -> Motion {
        self.of_poses(Performance::of_stream(streamed), true)
    }

    /// The poses of a method from outside, each at its own time if it says that.
    pub(crate) fn given(&self, clip: &Clip, steps_s: Option<&[f64]>) -> Motion {
        let frames = clip.frames.clone();
        let even = || vec![1.0 / self.test.rate_hz; frames.len()];
        let timed = steps_s.is_some();
        let steps_s = steps_s.map_or_else(even, <[f64]>::to_vec);
        self.of_poses(Performance { frames, steps_s, stands: Vec::new() }, timed)
    }

    fn of_poses(&self, performance: Performance, timed: bool) -> Motion {
        let performance = Performance { stands: self.stands.clone(), ..performance };
        let clip = Clip { frames: performance.frames.clone(), ..self.test.clone() };
        Motion { rows: self.body.clip_dofs(&clip), performance, timed }
    }

    /// The figures of a motion.
    pub(crate) fn figures(&self, of: &Motion) -> Figures {
        let rate = self.test.rate_hz;
        let poses = |rows: &[Vec<f64>]| -> Vec<_> { rows.iter().map(|r| centred(&self.body, r)).collect() };
        let (mut error, mut count) = (0.0, 0.0);
        for (pose, truth) in poses(&of.rows).iter().zip(&self.poses) {
            if let Some(truth) = truth {
                error += joint_distance(pose, truth);
                count += 1.0;
            }
        }
        let [mut step_error, mut steps, mut ours, mut theirs] = [0.0; 4];
        for (w, step) in self.at.windows(2).zip(of.performance.steps_s.iter().skip(1)) {
            if let &[Some(before), Some(now)] = w
                && of.timed
                && now > before
            {
                let truth = (now - before) / rate;
                step_error += (step - truth).abs();
                ours += step;
                theirs += truth;
                steps += 1.0;
            }
        }
        let resampled = of.timed.then(|| at_times(&of.rows, &times(&of.performance.steps_s), rate));
        let timely = poses(resampled.as_deref().unwrap_or(&of.rows));
        let inside: Vec<bool> = self.at.iter().map(Option::is_some).collect();
        let (skeleton, feet) = (&self.body.skeleton, &of.performance);
        Figures {
            error_cm: 100.0 * error / count,
            step_error_ms: (steps > 0.0).then(|| 1000.0 * step_error / steps),
            duration: (theirs > 0.0).then(|| ours / theirs),
            third_difference: third_difference(&timely) / self.third_difference,
            amplitude: amplitude(&timely, rate).zip(self.amplitude).map(|(a, b)| a / b),
            variability: variability(&self.body, &of.rows, &self.cycles)
                .zip(self.variability)
                .map(|(a, b)| a / b),
            speed: (self.ground_speed > STAYS).then(|| ground_speed(feet, &inside) / self.ground_speed),
            skate_counterpart_cm_s: skate_cm_s(skeleton, &self.legs, feet),
            skate_stillest_cm_s: stillest_cm_s(skeleton, &self.legs, feet),
        }
    }

    /// F1 of the standing feet that a stream reports.
    pub(crate) fn contact_f1(&self, streamed: &Streamed) -> Option<f64> {
        let (mut hit, mut off) = (0.0, 0.0);
        for (t, truth) in self.stands.iter().enumerate().filter(|&(t, _)| self.at[t].is_some()) {
            for (said, stands) in streamed.steps[t].report.contacts.iter().zip(truth) {
                hit += f64::from(u8::from(*said && *stands));
                off += f64::from(u8::from(said != stands));
            }
        }
        (hit + off > 0.0).then(|| 2.0 * hit / (2.0 * hit + off))
    }
}

/// Rows at their time stamps, resampled to a rate.
fn at_times(rows: &[Vec<f64>], times: &[f64], rate_hz: f64) -> Vec<Vec<f64>> {
    let end = times.last().copied().unwrap_or(0.0);
    let mut i = 0;
    (0..=(end * rate_hz) as usize)
        .map(|k| {
            let time = k as f64 / rate_hz;
            while i + 2 < times.len() && times[i + 1] <= time {
                i += 1;
            }
            let span = (times[(i + 1).min(times.len() - 1)] - times[i]).max(1e-9);
            row_at(rows, i as f64 + ((time - times[i]) / span).clamp(0.0, 1.0))
        })
        .collect()
}
