//! Averaged output cycles.

use gestus_motion::{corpus::Cycle, statistics::distance2};

use crate::pairing::{
    cycles::{CONTENT, CycleData, at},
    scheme::Scheme,
};

/// Cycles that a prototype averages.
const KERNEL_CYCLES: usize = 12;
/// Greatest number of prototypes of a class.
const PROTOTYPES: usize = 24;

/// An averaged cycle, stored as a short clip of its own.
#[derive(Debug, Clone)]
pub struct Prototype {
    /// Dofs, shape `[frames][D]`; two frames before phase 0 and one behind phase 1 belong to it.
    pub rows: Vec<Vec<f64>>,
    /// Its timeline in those rows.
    pub cycle: Cycle,
}

/// The prototypes of a class with their contents; none for schemes of real cycles.
pub(super) fn of(
    scheme: Scheme,
    cycles: &[CycleData<'_>],
    members: &[usize],
    content: &[Vec<f64>],
) -> Vec<(Vec<f64>, Prototype)> {
    match scheme {
        Scheme::Kernel => {
            let with = |centre: Vec<f64>| {
                let prototype = average(cycles, &kernel(members, content, &centre));
                (centre, prototype)
            };
            centres(members, content).into_iter().map(with).collect()
        }
        Scheme::Mean => {
            let all: Vec<(usize, f64)> = members.iter().map(|&i| (i, 1.0)).collect();
            vec![(vec![0.0; CONTENT], average(cycles, &all))]
        }
        _ => Vec::new(),
    }
}

/// Centres over the contents of a class: first the mean, then each time the content farthest from all centres so far.
fn centres(members: &[usize], content: &[Vec<f64>]) -> Vec<Vec<f64>> {
    let mut centres = vec![vec![0.0; CONTENT]];
    while centres.len() < PROTOTYPES.min(members.len()) {
        let isolation =
            |&i: &usize| centres.iter().map(|c| distance2(c, &content[i])).fold(f64::INFINITY, f64::min);
        match members.iter().copied().max_by(|a, b| isolation(a).total_cmp(&isolation(b))) {
            Some(next) => centres.push(content[next].clone()),
            None => break,
        }
    }
    centres
}

/// The cycles nearest to a centre, with Gaussian weights whose width is the distance of the farthest.
fn kernel(members: &[usize], content: &[Vec<f64>], centre: &[f64]) -> Vec<(usize, f64)> {
    let mut near: Vec<(f64, usize)> = members.iter().map(|&i| (distance2(&content[i], centre), i)).collect();
    near.sort_by(|a, b| a.0.total_cmp(&b.0));
    near.truncate(KERNEL_CYCLES);
    let width = near.last().map_or(1.0, |n| n.0).max(1e-9);
    near.into_iter().map(|(d, i)| (i, (-2.0 * d / width).exp())).collect()
}

/// The weighted mean of cycles, as a clip at their mean tempo.
fn average(cycles: &[CycleData<'_>], weights: &[(usize, f64)]) -> Prototype {
    const BEFORE: usize = 2;
    let total: f64 = weights.iter().map(|w| w.1).sum();
    let mean = |value: &dyn Fn(usize) -> f64| weights.iter().map(|&(i, w)| w * value(i)).sum::<f64>() / total;
    // Knots at the mean tempo, after the lead-in frames.
    let segments = weights.iter().map(|&(i, _)| cycles[i].cycle.knots.len() - 1).max().unwrap_or(1);
    let knots: Vec<f64> = (0..=segments)
        .map(|k| {
            let phase = k as f64 / segments as f64;
            BEFORE as f64 + mean(&|i| cycles[i].cycle.position(phase) - cycles[i].cycle.position(0.0))
        })
        .collect();
    let cycle = Cycle { knots };
    let frames = cycle.span().1.ceil() as usize + 2;
    let rows = (0..frames)
        .map(|f| {
            let phase = cycle.phase(f as f64);
            let mut row = vec![0.0; cycles[weights[0].0].dofs[0].len()];
            for &(i, w) in weights {
                for (sum, value) in row.iter_mut().zip(at(&cycles[i], phase)) {
                    *sum += w / total * value;
                }
            }
            row
        })
        .collect();
    Prototype { rows, cycle }
}
