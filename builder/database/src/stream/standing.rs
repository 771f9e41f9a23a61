//! Which feet of a stream's output stand, at any rate.

use crate::stream::Streamed;

impl Streamed {
    /// Which feet stand in each pose of [`clip`](Self::clip) at that rate: left and right.
    pub fn contacts(&self, rate_hz: f64) -> Vec<[bool; 2]> {
        let stands = |step: usize| self.steps.get(step).map_or([false; 2], |step| step.report.contacts);
        let rows = |end_s: f64| (0..=(end_s * rate_hz + 1e-6).floor() as usize).map(|i| i as f64 / rate_hz);
        if let Some(retimed) = &self.retimed {
            let end_s = retimed.ticks.len().saturating_sub(1) as f64 * retimed.tick_s;
            let shown = |time: f64| {
                let tick =
                    ((time / retimed.tick_s).round() as usize).min(retimed.ticks.len().saturating_sub(1));
                let lag = retimed.ticks.get(tick).map_or(0.0, |tick| f64::from(tick.lag_s) / retimed.tick_s);
                stands((tick as f64 - lag).round().max(0.0) as usize)
            };
            return rows(end_s).map(shown).collect();
        }
        let times = self.times();
        let mut at = 0;
        let nearest = |time: f64| {
            while at + 1 < times.len() && times[at + 1] - time <= time - times[at] {
                at += 1;
            }
            stands(at)
        };
        rows(times.last().copied().unwrap_or(0.0)).map(nearest).collect()
    }
}

#[cfg(test)]
mod tests {
    use gestus_core::{Report, output::retime::Tick};
    use gestus_motion::clip::Frame;

    use super::*;
    use crate::stream::{Retimed, Step};

    /// Ten steps a tenth of a second apart, the left foot standing in the first five and the right one in the others.
    fn streamed() -> Streamed {
        let frame = Frame { root: nalgebra::Vector3::zeros(), rotations: Vec::new() };
        let step = |i: usize| Step {
            frame: frame.clone(),
            report: Report { contacts: [i < 5, i >= 5], step_s: 0.1, ..Report::default() },
            micros: 0.0,
        };
        Streamed { steps: (0..10).map(step).collect(), digest: 0, ram_bytes: 0, retimed: None }
    }

    #[test]
    fn feet_stand_when_the_nearest_pose_does() {
        let mut streamed = streamed();
        assert_eq!(streamed.contacts(10.0).len(), 10);
        let at_50 = streamed.contacts(50.0);
        assert_eq!(at_50.len(), 46);
        assert_eq!(at_50.iter().take_while(|c| **c == [true, false]).count(), 23);
        assert!(at_50[23..].iter().all(|c| *c == [false, true]));
        // Retimed, and two poses late.
        let frame = streamed.steps[0].frame.clone();
        streamed.retimed = Some(Retimed {
            frames: vec![frame; 10],
            ticks: vec![Tick { lag_s: 0.2, speed: 1.0, waited: false }; 10],
            latency_s: 0.0,
            tick_s: 0.1,
        });
        let late = streamed.contacts(10.0);
        assert_eq!((late.len(), late.iter().filter(|c| c[0]).count()), (10, 7));
    }
}
