//! Corresponding frames of the input style and an output style (Hsu 2005, sections 3 and 4.1).
//!
//! Cycles are paired by content ([`crate::pairing`]) at equal canonical time. In whole-clip actions only the ends
//! correspond, and iterative motion warping ([`crate::registration::warp::imw`]) finds the rest for each pair. Gaits
//! correspond at foot strikes, and time between strikes is taken as uniform; [`Correspondence`] has the other ways. The
//! output is warped to the input's time. The logarithm of the differential time warp `w` is added as one more dof, so that
//! a linear model's output gives a positive `w`.

use crate::{
    pairing::{CycleData, Pairing},
    registration::{
        timeline::Kind,
        warp::{
            self,
            imw::{Config, imw},
        },
    },
};
use gestus_motion::{body::row_at, corpus::Cycle};

/// Bounds of the differential time warp.
const SLOPE: f64 = 4.0;

/// How the frames of two paired cycles correspond.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Correspondence {
    /// Gaits by their foot strikes. Whole-clip actions by iterative motion warping, smoothed.
    Phase,
    /// Iterative motion warping, smoothed, on top of the strikes of gaits too. It does not pay
    /// (`docs/experiments/methods.md`).
    Refined,
    /// Iterative motion warping from the ends of the cycle alone, as it comes out (Hsu 2005, sections 3.4 and 4.1).
    Warped,
}

/// A stretch of the input with its counterpart in the output style. T frames of the input, D dofs.
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
    /// How their frames correspond.
    pub correspondence: Correspondence,
}

/// All stretches of a style that have a counterpart in another; consecutive cycles of a clip form one stretch. Cost: one
/// iterative motion warping per cycle.
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
        let (cycle, rows, clip) = pairs.pairing.output(pairs.cycles, output);
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
            // A prototype has no contacts: the output's feet stand where the input's do.
            let of = |c: &[[bool; 2]], at: usize| c.get(at.min(c.len().saturating_sub(1))).copied();
            let stands = match clip {
                Some(clip) => of(pairs.contacts[clip], positions[k].round().max(0.0) as usize),
                None => of(pairs.contacts[input.clip], t),
            };
            stretch.contacts.push(stands.unwrap_or_default());
        }
    }
    stretches
}

/// Positions in the output clip of the frames of an input cycle.
fn positions(
    input: &CycleData<'_>,
    frames: &[usize],
    output: &Cycle,
    rows: &[Vec<f64>],
    pairs: &Pairs<'_>,
) -> Vec<f64> {
    let place = |t: f64| output.position(input.cycle.phase(t));
    let canonical: Vec<f64> = frames.iter().map(|&t| place(t as f64)).collect();
    match pairs.correspondence {
        Correspondence::Warped => return warped(input.dofs, frames, output, rows).unwrap_or(canonical),
        Correspondence::Phase if Kind::of_cycle(input.cycle) == Kind::Gait => return canonical,
        Correspondence::Phase | Correspondence::Refined => {}
    }
    let last = (frames.len() - 1) as f64;
    let count = frames.len().min(warp::MAX_FRAMES);
    let times = (0..count).map(|k| frames[0] as f64 + last * k as f64 / (count - 1) as f64);
    let u: Vec<Vec<f64>> = times.clone().map(|t| warp::shape(&row_at(input.dofs, t))).collect();
    let y: Vec<Vec<f64>> = times.map(|t| warp::shape(&row_at(rows, place(t)))).collect();
    let (u, y) = warp::standardised(&u, &y);
    let Ok(solution) = imw(&u, &y, &Config::default()) else { return canonical };
    let found = solution.warp.stretched(frames.len(), count, frames.len());
    let shift: Vec<f64> =
        found.positions.iter().enumerate().map(|(k, p)| p.clamp(0.0, last) - k as f64).collect();
    let refined: Vec<f64> = warp::smoothed_shift(&shift, pairs.rate_hz)
        .iter()
        .enumerate()
        .map(|(k, shift)| {
            let at = (k as f64 + shift).clamp(0.0, last);
            let i = (at as usize).min(frames.len() - 2);
            canonical[i] + (at - i as f64) * (canonical[i + 1] - canonical[i])
        })
        .collect();
    if refined.windows(2).all(|w| w[0] < w[1]) { refined } else { canonical }
}

/// Positions in the output clip of an input cycle's frames, by iterative motion warping of the two whole cycles. `None`
/// where one lasts more than twice as long as the other, the paper's slope limit.
fn warped(inputs: &[Vec<f64>], frames: &[usize], output: &Cycle, rows: &[Vec<f64>]) -> Option<Vec<f64>> {
    let (start, end) = output.span();
    let last = rows.len().checked_sub(1)?;
    let [first, last] = [start, end].map(|at| (at.round().max(0.0) as usize).min(last));
    let u: Vec<Vec<f64>> = frames.iter().map(|&t| warp::shape(&inputs[t])).collect();
    let y: Vec<Vec<f64>> = rows[first..=last].iter().map(|row| warp::shape(row)).collect();
    let (u, y) = warp::standardised(&u, &y);
    let solution = imw(&u, &y, &Config::default()).ok()?;
    Some(solution.warp.positions.iter().map(|at| first as f64 + at).collect())
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

    /// The stretch of a cycle of so many frames, and of one that takes a third longer.
    fn aligned(frames: usize, rate_hz: f64, correspondence: Correspondence) -> Vec<Aligned> {
        let bend = |x: f64| x + 0.06 * (TAU * x).sin();
        let longer = frames + (frames - 1) / 3;
        let (input, output) = (rows(frames, |x| x, 0.6, 0.0), rows(longer, bend, 0.9, 0.3));
        let cycle = |frames: usize| Cycle { knots: vec![0.0, (frames - 1) as f64] };
        let (own, other) = (cycle(frames), cycle(longer));
        let data = |class, clip, cycle, dofs| CycleData { class, clip, take: "", index: 0, cycle, dofs };
        let cycles = [data(0, 0, &own, &input[..]), data(1, 1, &other, &output[..])];
        let pairing = Pairing {
            outputs: vec![vec![Some(0), Some(1)], vec![None, Some(1)]],
            second: vec![],
            prototypes: vec![],
        };
        let contacts = [vec![[true, false]; frames], vec![[false, true]; longer]];
        let pairs = Pairs {
            cycles: &cycles,
            classes: &[(0, 0), (0, 1)],
            contacts: &[&contacts[0], &contacts[1]],
            pairing: &pairing,
            rate_hz,
            correspondence,
        };
        align(&pairs, 0, 1)
    }

    /// How far the third joint dof, which is the same in both but for time and so says where the row is, is off; and the
    /// integral of the warp.
    fn measured(aligned: &[Aligned]) -> [f64; 2] {
        let rows = &aligned[0].outputs;
        let count = rows.len() as f64;
        let off = |(t, row): (usize, &Vec<f64>)| (row[9] - 0.3 * (TAU * t as f64 / count + 1.0).sin()).abs();
        [rows.iter().enumerate().map(off).sum::<f64>() / count, rows.iter().map(|row| row[10].exp()).sum()]
    }

    /// Four times the frames a second, which are warped thinned, meet the same counterparts.
    #[test]
    fn frames_of_a_long_clip_meet_theirs_too() {
        let full = aligned(warp::MAX_FRAMES - 1, 600.0, Correspondence::Phase);
        let long = aligned(4 * warp::MAX_FRAMES - 5, 2400.0, Correspondence::Phase);
        let ([off, _], [off_long, time]) = (measured(&full), measured(&long));
        assert!(off_long < off + 0.005 && (time / 2723.0 - 1.0).abs() < 0.03, "{off}, {off_long}, {time}");
    }

    #[test]
    fn frames_meet_their_counterparts() {
        let aligned = aligned(61, 60.0, Correspondence::Phase);
        assert_eq!((aligned.len(), aligned[0].inputs.len()), (1, 60));
        assert_eq!(aligned[0].contacts[10], [false, true]);
        let [inverse_error, time] = measured(&aligned);
        assert!(inverse_error < 0.03, "{inverse_error}");
        assert!((time - 80.0).abs() < 2.0, "the warp integrates to the output's length: {time}");
    }

    /// Nothing but the ends of the cycles is known, and slopes are multiples of one half that nothing smooths.
    #[test]
    fn a_warp_of_whole_cycles_needs_no_phase() {
        let [off, time] = measured(&aligned(61, 60.0, Correspondence::Warped));
        assert!(off < 0.06 && (time - 80.0).abs() < 3.0, "{off}, {time}");
    }
}
