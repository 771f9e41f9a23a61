//! Similar actions, which share their output cycles.
//!
//! The straight part of a turn looks like a straight walk, so an unlabelled search confuses them. If each action had
//! outputs of its own only, the confusion would be visible, since the styles of both differ. It is not if both actions
//! choose from the cycles of both.
//!
//! Two gaits are **similar** if the nearest cycle of the other action is less than [`SIMILAR`] times as far as the
//! nearest of the same action in another clip, in the geometric mean over both directions and all styles. Distances are
//! root mean square differences of the pose's dofs at equal canonical time. Whole-clip actions are similar to none,
//! since their canonical times are not comparable.
//!
//! On captured walks, runs and turns the ratio is 1.4 between walk and turns, and at least 4.4 between these and a run.

use crate::pairing::cycles::{ClassName, CycleData, shape};
use crate::registration::timeline::Kind;
use gestus_motion::statistics::{distance2, mean};

/// Greatest ratio of distances for similar actions.
const SIMILAR: f64 = 2.0;
/// Phases at which cycles are compared.
const PHASES: usize = 8;
/// Most cycles of a class that are compared.
const SAMPLE: usize = 64;

/// For every class, the cycles of its style in its own and all similar actions.
pub(super) fn pools(
    cycles: &[CycleData<'_>],
    classes: &[ClassName],
    members: &[Vec<usize>],
) -> Vec<Vec<usize>> {
    let gait: Vec<bool> =
        members.iter().map(|m| m.iter().all(|&i| Kind::of_cycle(cycles[i].cycle) == Kind::Gait)).collect();
    let samples: Vec<Vec<(usize, Vec<f64>)>> = members
        .iter()
        .zip(&gait)
        .map(|(m, gait)| {
            let step = m.len().div_ceil(SAMPLE).max(1);
            let sampled = m.iter().step_by(step).filter(|_| *gait);
            sampled.map(|&i| (cycles[i].clip, shape(&cycles[i], PHASES))).collect()
        })
        .collect();
    let class_of = |action: usize, style: usize| classes.iter().position(|&c| c == (action, style));
    let similar = |a: usize, b: usize| {
        let pairs =
            classes.iter().filter(|c| c.0 == a).filter_map(|&(_, s)| class_of(a, s).zip(class_of(b, s)));
        let logs: Vec<f64> = pairs
            .filter_map(|(a, b)| {
                let [a, b] = [&samples[a], &samples[b]];
                let ratio = mean_distance(a, b)? * mean_distance(b, a)?
                    / (mean_distance(a, a)? * mean_distance(b, b)?);
                Some(0.5 * ratio.ln())
            })
            .collect();
        !logs.is_empty() && mean(logs.iter().copied()) < SIMILAR.ln()
    };
    classes
        .iter()
        .enumerate()
        .map(|(class, &(action, style))| {
            let shared = |(c, &(a, s)): (usize, &ClassName)| {
                c == class || (s == style && gait[c] && gait[class] && similar(action, a))
            };
            let shared = classes.iter().enumerate().filter(|&c| shared(c));
            shared.flat_map(|(c, _)| members[c].iter().copied()).collect()
        })
        .collect()
}

/// Mean distance of cycles to the nearest of `others` from another clip; `None` if there is none or the distance is 0.
fn mean_distance(of: &[(usize, Vec<f64>)], others: &[(usize, Vec<f64>)]) -> Option<f64> {
    let nearest: Vec<f64> = of
        .iter()
        .filter_map(|(clip, shape)| {
            let elsewhere = others.iter().filter(|(c, _)| c != clip);
            elsewhere.map(|(_, other)| distance2(shape, other).sqrt()).min_by(f64::total_cmp)
        })
        .collect();
    let mean = mean(nearest);
    // The mean of none is NaN.
    (mean > 0.0).then_some(mean)
}

#[cfg(test)]
mod tests {
    use gestus_core::blob::layout::dof;

    use super::*;
    use gestus_motion::corpus::Cycle;

    /// Clips of one cycle of 20 frames: a swing about a posture, each clip a little different.
    fn clips(postures: &[f64], knots: usize) -> Vec<(Vec<Vec<f64>>, Cycle)> {
        let clip = |posture: f64, take: f64| {
            let row = |t: usize| {
                let x = t as f64 / 20.0 * std::f64::consts::TAU;
                let mut row = vec![0.0; dof::JOINTS + 3];
                row[dof::JOINTS] = posture + 0.3 * x.sin() + 0.05 * take;
                row[dof::JOINTS + 1] = 0.2 * x.cos() - 0.04 * take;
                // Velocities are not compared.
                row[dof::FORWARD] = 10.0 * posture;
                row
            };
            let even = |k: usize| 1.0 + 18.0 * k as f64 / (knots - 1) as f64;
            ((0..21).map(row).collect(), Cycle { knots: (0..knots).map(even).collect() })
        };
        postures.iter().flat_map(|&p| (0..4).map(move |take| clip(p, f64::from(take)))).collect()
    }

    /// Pools of classes of four cycles, one style, action by action.
    fn pools_of(clips: &[(Vec<Vec<f64>>, Cycle)]) -> Vec<Vec<usize>> {
        let cycle =
            |(clip, (dofs, cycle))| CycleData { class: clip / 4, clip, take: "", index: 0, cycle, dofs };
        let cycles: Vec<CycleData<'_>> =
            clips.iter().map(|(d, c)| (d.as_slice(), c)).enumerate().map(cycle).collect();
        let classes: Vec<ClassName> = (0..clips.len() / 4).map(|action| (action, 0)).collect();
        let members: Vec<Vec<usize>> = (0..classes.len()).map(|c| (4 * c..4 * c + 4).collect()).collect();
        pools(&cycles, &classes, &members)
    }

    #[test]
    fn actions_that_look_alike_share_their_cycles_and_others_do_not() {
        let found = pools_of(&clips(&[0.0, 0.02, 1.0], 3));
        let both: Vec<usize> = (0..8).collect();
        assert_eq!(found, [both.clone(), both, (8..12).collect()]);
    }

    #[test]
    fn whole_clip_actions_share_nothing() {
        let found = pools_of(&clips(&[0.0, 0.02], 13));
        assert_eq!(found, [(0..4).collect::<Vec<_>>(), (4..8).collect()]);
    }

    #[test]
    fn a_class_of_one_clip_keeps_to_itself() {
        let all = clips(&[0.0, 0.02], 3);
        let cycles: Vec<CycleData<'_>> = all
            .iter()
            .enumerate()
            .map(|(i, (dofs, cycle))| CycleData {
                class: i / 4,
                clip: i / 4,
                take: "",
                index: i % 4,
                cycle,
                dofs,
            })
            .collect();
        let members = [(0..4).collect::<Vec<_>>(), (4..8).collect()];
        assert_eq!(pools(&cycles, &[(0, 0), (1, 0)], &members), members);
    }
}
