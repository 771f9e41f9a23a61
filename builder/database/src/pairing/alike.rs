//! Second outputs of whole-clip actions: the clip that is most like the first output.
//!
//! The content of a cycle says little about a gesture, in which the body stands: outputs that it chooses are any two
//! clips. Two waves that are half a wave apart have a mean that holds its hand still. Two that go along have one that
//! waves, and is nearer to either than they are to each other.

use gestus_motion::statistics::distance2;

use crate::{
    pairing::cycles::{CycleData, shape},
    registration::timeline::Kind,
};

/// Phases at which clips are compared: a clip of a dozen waves has five in each.
const PHASES: usize = 64;
/// Least part of their movement that the mean of two clips has to keep; see `docs/experiments/pairing.md`.
const KEPT: f64 = 0.8;

/// For every cycle that is a whole clip, the kept one of its class that is most like it, or itself where there is none or
/// where the mean of both would keep less than [`KEPT`] of their movement. `None` for cycles of gaits, which feet keep in
/// step.
pub(super) fn partners(cycles: &[CycleData<'_>], kept: &[bool]) -> Vec<Option<usize>> {
    let whole = |cycle: &CycleData<'_>| Kind::of_cycle(cycle.cycle) == Kind::Whole;
    let shapes: Vec<Option<Vec<f64>>> =
        cycles.iter().map(|cycle| whole(cycle).then(|| shape(cycle, PHASES))).collect();
    let partner = |(i, own): (usize, &Option<Vec<f64>>)| {
        let own = own.as_ref()?;
        let others = shapes.iter().enumerate().filter_map(|(o, other)| {
            let other = other.as_ref().filter(|_| kept[o] && o != i && cycles[o].class == cycles[i].class)?;
            Some((o, other, distance2(own, other)))
        });
        let nearest = others.min_by(|a, b| a.2.total_cmp(&b.2));
        Some(nearest.filter(|(_, other, _)| kept_movement(own, other) >= KEPT).map_or(i, |(o, _, _)| o))
    };
    shapes.iter().enumerate().map(partner).collect()
}

/// How much the mean of two clips moves, over the mean of how much they do.
fn kept_movement(a: &[f64], b: &[f64]) -> f64 {
    let mean: Vec<f64> = a.iter().zip(b).map(|(a, b)| 0.5 * (a + b)).collect();
    let typical = 0.5 * (movement(a) + movement(b));
    if typical > 0.0 { movement(&mean) / typical } else { 1.0 }
}

/// How far a clip moves from phase to phase, the norm of all steps.
fn movement(clip: &[f64]) -> f64 {
    let dofs = clip.len() / PHASES;
    distance2(&clip[dofs..], &clip[..clip.len() - dofs]).sqrt()
}

#[cfg(test)]
mod tests {
    use std::f64::consts::TAU;

    use gestus_core::blob::layout::dof;
    use gestus_motion::corpus::Cycle;

    use super::*;

    /// Clips of one class that wave three times, each later by a part of a wave.
    fn partners_of(later: &[f64], knots: usize, kept: &[bool]) -> Vec<Option<usize>> {
        let row = |t: usize, later: f64| {
            let mut row = vec![0.0; dof::JOINTS + 1];
            row[dof::JOINTS] = 0.4 * (TAU * (3.0 * t as f64 / 90.0 + later)).sin();
            row
        };
        let clips: Vec<Vec<Vec<f64>>> =
            later.iter().map(|&later| (0..91).map(|t| row(t, later)).collect()).collect();
        let cycle = Cycle { knots: (0..knots).map(|k| 90.0 * k as f64 / (knots - 1) as f64).collect() };
        let cycles: Vec<CycleData<'_>> = clips
            .iter()
            .enumerate()
            .map(|(clip, dofs)| CycleData { class: 0, clip, take: "", index: 0, cycle: &cycle, dofs })
            .collect();
        partners(&cycles, kept)
    }

    #[test]
    fn waves_that_go_along_are_partners() {
        assert_eq!(partners_of(&[0.0, 0.25, 0.1], 9, &[true; 3]), [Some(2), Some(2), Some(0)]);
    }

    #[test]
    fn a_wave_that_would_be_cancelled_stays_alone() {
        assert_eq!(partners_of(&[0.0, 0.5, 0.1], 9, &[true; 3]), [Some(2), Some(1), Some(0)]);
    }

    #[test]
    fn clips_that_are_left_out_are_no_partners() {
        assert_eq!(partners_of(&[0.0, 0.1], 9, &[true, false]), [Some(0), Some(0)]);
        assert_eq!(partners_of(&[0.0], 9, &[true]), [Some(0)]);
    }

    #[test]
    fn gaits_have_none() {
        assert_eq!(partners_of(&[0.0, 0.1], 3, &[true; 2]), [None, None]);
    }
}
