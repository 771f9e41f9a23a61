//! Frames of the input style beside their counterparts in an output style (paper 001, sections 3 and 4.1).
//!
//! Cycles are paired by content ([`crate::pair`]) and brought to equal canonical time. Whole-clip actions have nothing
//! but their ends in common: iterative motion warping ([`crate::warp::imw`]) finds the correspondence within each
//! pair. Gaits have strikes, found from the feet, between which time is taken to run evenly; warping them on top is an
//! option that costs more than it gives (`docs/PERFORMANCE.md`). The output is warped to the input's
//! time, and the logarithm of the differential time warp `w` goes with it as one dof more: its exponential is
//! positive whatever a linear model makes of it.

use crate::{
    body::row_at,
    corpus::Cycle,
    pair::{CycleData, Pairing},
    segment::smooth,
    warp::{
        self,
        imw::{Config, imw},
    },
};
use gestus_core::blob::layout::dof;

/// Standard deviation of the smoothing of the refinement, seconds. Differential warps are multiples of one half.
const SMOOTH_S: f64 = 0.06;
/// Knots of a gait cycle: left, right and left strike.
const GAIT_KNOTS: usize = 3;
/// Bounds of the differential time warp.
const SLOPE: f64 = 4.0;

/// A stretch of the input and what it is in the output style. T frames of the input, D dofs.
#[derive(Debug, Clone)]
pub struct Aligned {
    /// Its action.
    pub action: usize,
    /// The input's dofs, shape `[T][D]`.
    pub inputs: Vec<Vec<f64>>,
    /// The output's dofs in the input's time, and the logarithm of the time warp. Shape `[T][D + 1]`.
    pub outputs: Vec<Vec<f64>>,
    /// Which foot stands in the output, left and right. Shape `[T]`.
    pub contacts: Vec<[bool; 2]>,
}

/// What is paired.
#[derive(Debug, Clone, Copy)]
pub struct Pairs<'a> {
    /// The cycles, sorted by class, clip and time.
    pub cycles: &'a [CycleData<'a>],
    /// Action and style of each class.
    pub classes: &'a [(usize, usize)],
    /// Contacts of each clip.
    pub contacts: &'a [&'a [[bool; 2]]],
    /// The pairing of the cycles.
    pub pairing: &'a Pairing,
    /// Frames a second.
    pub rate_hz: f64,
    /// Whether iterative motion warping refines gaits too, whose strikes are known.
    pub warp_gaits: bool,
}

/// All stretches of a style that have a counterpart in another: cycles that follow each other in a clip are one
/// stretch. Cost: one iterative motion warping a cycle.
pub fn align(pairs: &Pairs<'_>, from: usize, style: usize) -> Vec<Aligned> {
    let mut stretches: Vec<Aligned> = Vec::new();
    let mut open: Option<(usize, f64)> = None;
    for (i, input) in pairs.cycles.iter().enumerate() {
        let (action, own) = pairs.classes[input.class];
        let Some(output) = (own == from).then(|| pairs.pairing.outputs[i][style]).flatten() else {
            open = None;
            continue;
        };
        let (start, end) = input.cycle.span();
        let frames: Vec<usize> =
            (start.ceil().max(0.0) as usize..(end.ceil() as usize).min(input.dofs.len())).collect();
        if frames.len() < 2 {
            open = None;
            continue;
        }
        let (cycle, rows, contacts) = match pairs.cycles.get(output) {
            Some(real) => (real.cycle, real.dofs, pairs.contacts.get(real.clip)),
            None => {
                let prototype = &pairs.pairing.prototypes[output - pairs.cycles.len()];
                (&prototype.cycle, prototype.rows.as_slice(), None)
            }
        };
        let positions = positions(input, &frames, cycle, rows, pairs);
        let follows = open.is_some_and(|(clip, at)| clip == input.clip && (at - start).abs() < 1e-6);
        if !follows {
            stretches.push(Aligned { action, inputs: vec![], outputs: vec![], contacts: vec![] });
        }
        open = Some((input.clip, end));
        // The list is not empty: a stretch was just begun, or goes on.
        let Some(stretch) = stretches.last_mut() else { continue };
        for (k, &t) in frames.iter().enumerate() {
            let before = k.max(1) - 1;
            let slope = positions[before + 1] - positions[before];
            let mut row = row_at(rows, positions[k]);
            row.push(slope.clamp(1.0 / SLOPE, SLOPE).ln());
            stretch.inputs.push(input.dofs[t].clone());
            stretch.outputs.push(row);
            // A prototype has no contacts of its own: content stands where content stands.
            let of = |c: &[[bool; 2]], at: usize| c.get(at.min(c.len().saturating_sub(1))).copied();
            let stands = match contacts {
                Some(contacts) => of(contacts, positions[k].round().max(0.0) as usize),
                None => pairs.contacts.get(input.clip).and_then(|c| of(c, t)),
            };
            stretch.contacts.push(stands.unwrap_or_default());
        }
    }
    stretches
}

/// Where the frames of an input cycle are in the output clip.
fn positions(
    input: &CycleData<'_>,
    frames: &[usize],
    output: &Cycle,
    rows: &[Vec<f64>],
    pairs: &Pairs<'_>,
) -> Vec<f64> {
    let rate_hz = pairs.rate_hz;
    let canonical: Vec<f64> = frames.iter().map(|&t| output.position(input.cycle.phase(t as f64))).collect();
    if input.cycle.knots.len() == GAIT_KNOTS && !pairs.warp_gaits {
        return canonical;
    }
    let shape = |row: &[f64]| -> Vec<f64> {
        // Velocities follow from where the body is, not from what it does now.
        row.iter()
            .enumerate()
            .filter(|(d, _)| !(dof::FORWARD..dof::JOINTS).contains(d))
            .map(|(_, v)| *v)
            .collect()
    };
    let u: Vec<Vec<f64>> = frames.iter().map(|&t| shape(&input.dofs[t])).collect();
    let y: Vec<Vec<f64>> = canonical.iter().map(|&p| shape(&row_at(rows, p))).collect();
    let (u, y) = warp::standardised(&u, &y);
    let Ok(solution) = imw(&u, &y, &Config::default()) else { return canonical };
    let last = (frames.len() - 1) as f64;
    let shift: Vec<f64> =
        solution.warp.positions.iter().enumerate().map(|(k, p)| p.clamp(0.0, last) - k as f64).collect();
    let smooth = smooth(&shift, SMOOTH_S * rate_hz);
    let refined: Vec<f64> = smooth
        .iter()
        .enumerate()
        .map(|(k, shift)| {
            // Cycles begin and end with the same event: nothing is shifted there.
            let edge = (k as f64).min(last - k as f64) / (2.0 * SMOOTH_S * rate_hz);
            let at = (k as f64 + shift * edge.min(1.0)).clamp(0.0, last);
            let i = (at as usize).min(frames.len() - 2);
            canonical[i] + (at - i as f64) * (canonical[i + 1] - canonical[i])
        })
        .collect();
    if refined.windows(2).all(|w| w[0] < w[1]) { refined } else { canonical }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::TAU;

    /// Two dofs that count over one cycle; `course` bends the time between its ends.
    fn rows(frames: usize, course: impl Fn(f64) -> f64, scale: f64, offset: f64) -> Vec<Vec<f64>> {
        (0..frames)
            .map(|t| {
                let x = TAU * course(t as f64 / (frames - 1) as f64);
                let mut row = vec![0.9, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0];
                row.extend([
                    scale * x.sin() + offset,
                    scale * (2.0 * x + 0.4).cos() - offset,
                    0.3 * (x + 1.0).sin(),
                ]);
                row
            })
            .collect()
    }

    #[test]
    fn frames_meet_their_counterparts() {
        let bend = |x: f64| x + 0.06 * (TAU * x).sin();
        let (input, output) = (rows(61, |x| x, 0.6, 0.0), rows(81, bend, 0.9, 0.3));
        let cycle = |last: f64| Cycle { knots: vec![0.0, last] };
        let (own, other) = (cycle(60.0), cycle(80.0));
        let data = |class, clip, cycle, dofs| CycleData { class, clip, take: "", index: 0, cycle, dofs };
        let cycles = [data(0, 0, &own, &input[..]), data(1, 1, &other, &output[..])];
        let pairing =
            Pairing { outputs: vec![vec![Some(0), Some(1)], vec![None, Some(1)]], prototypes: vec![] };
        let contacts = [vec![[true, false]; 61], vec![[false, true]; 81]];
        let pairs = Pairs {
            cycles: &cycles,
            classes: &[(0, 0), (0, 1)],
            contacts: &[&contacts[0], &contacts[1]],
            pairing: &pairing,
            rate_hz: 60.0,
            warp_gaits: false,
        };
        let aligned = align(&pairs, 0, 1);
        assert_eq!((aligned.len(), aligned[0].inputs.len()), (1, 60));
        assert_eq!(aligned[0].contacts[10], [false, true]);
        let mut inverse_error = 0.0;
        let mut time = 0.0;
        for (t, row) in aligned[0].outputs.iter().enumerate() {
            time += row[10].exp();
            let phase = t as f64 / 60.0;
            // The third joint dof is the same in both but for time: it says where the row is.
            inverse_error += (row[9] - 0.3 * (TAU * phase + 1.0).sin()).abs() / 60.0;
        }
        assert!(inverse_error < 0.03, "{inverse_error}");
        assert!((time - 80.0).abs() < 2.0, "the warp integrates to the output's length: {time}");
    }
}
