//! Pairing: finds for every cycle and style the cycle that is its output.
//!
//! The papers assume an output example for every input example; recorded data has none. A cycle's output is a cycle of
//! the same action in the other style with similar content: speed and yaw rate, and the swing of the hips **relative to
//! the mean and standard deviation of its style**.
//!
//! | scheme | output of a cycle |
//! |---|---|
//! | [`Scheme::Spread`] | one real cycle of all similar actions; neighboring inputs get different outputs, as often as kernel weights say |
//! | [`Scheme::Both`] | two real cycles, those of `Spread` and `Viterbi`: the output is their mean |
//! | [`Scheme::Viterbi`] | one real cycle, chosen such that the sequence fits well and is continuous |
//! | [`Scheme::Nearest`] | one real cycle, the best fit |
//! | [`Scheme::Kernel`] | a prototype: a kernel average of a dozen real cycles; a few dozen per class |
//! | [`Scheme::Mean`] | one prototype, the mean of all |
//! | [`Scheme::Take`] | the same cycle of the clip of the same take: for motion recorded or made in pairs |
//!
//! Linear models are estimated from stretches of several cycles and need continuous outputs: with [`Scheme::Spread`] or
//! [`Scheme::Both`], theirs are those of [`Scheme::Viterbi`].
//!
//! An average is nearer to a real cycle than another real cycle is, but moves less: every step becomes the same step.
//! `gestus evaluate ablation` measures both.

use serde::{Deserialize, Serialize};

use gestus_motion::{
    corpus::Cycle,
    statistics::{mean_or_zero, moments},
};

mod cycles;
mod similar_actions;
mod spread;

pub use cycles::{ClassName, CycleData};

use cycles::{at, distance2};

/// Cycles that a prototype averages.
const KERNEL_CYCLES: usize = 12;
/// Greatest number of prototypes of a class.
const PROTOTYPES: usize = 24;
/// Weight of a discontinuity between consecutive output cycles, relative to the fit. Joint errors on real labelled gaits:
/// 2.40 cm for 0, 2.39 for 1, 2.28 for 10, 2.29 for 30, 2.34 for 100.
const CONTINUITY: f64 = 10.0;

/// How output cycles are chosen.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Scheme {
    /// Real cycles of similar actions, distributed by kernel weight.
    Spread,
    /// The outputs of `Spread` and of `Viterbi`, whose mean the core computes.
    #[default]
    Both,
    /// The sequence of real cycles with the best fit and continuity.
    Viterbi,
    /// The real cycle that fits best.
    Nearest,
    /// Kernel averages around prototypes.
    Kernel,
    /// One average per class.
    Mean,
    /// The same cycle of the clip of the same take.
    Take,
}

impl Scheme {
    /// All schemes with their names.
    pub const ALL: [(&'static str, Scheme); 7] = [
        ("both", Self::Both),
        ("spread", Self::Spread),
        ("viterbi", Self::Viterbi),
        ("nearest", Self::Nearest),
        ("kernel", Self::Kernel),
        ("mean", Self::Mean),
        ("take", Self::Take),
    ];

    /// The scheme of that name.
    pub fn named(name: &str) -> Option<Self> {
        Self::ALL.iter().find(|(n, _)| *n == name).map(|(_, s)| *s)
    }

    /// The scheme of the linear models' pairs.
    pub fn of_models(self) -> Self {
        if matches!(self, Self::Spread | Self::Both) { Self::Viterbi } else { self }
    }

    /// Its name.
    pub fn name(self) -> &'static str {
        Self::ALL.iter().find(|(_, s)| *s == self).map_or("", |(n, _)| n)
    }
}

/// An averaged cycle, stored as a short clip of its own.
#[derive(Debug, Clone)]
pub struct Prototype {
    /// Dofs, shape `[frames][D]`; two frames before phase 0 and one behind phase 1 belong to it.
    pub rows: Vec<Vec<f64>>,
    /// Its timeline in those rows.
    pub cycle: Cycle,
}

/// Output cycles of every cycle.
#[derive(Debug, Clone)]
pub struct Pairing {
    /// For every cycle and style: index of the output cycle. Prototypes are numbered after the cycles.
    pub outputs: Vec<Vec<Option<usize>>>,
    /// The same for second outputs; empty if there are none.
    pub second: Vec<Vec<Option<usize>>>,
    /// The averaged cycles.
    pub prototypes: Vec<Prototype>,
}

/// Pairs all cycles, which are sorted by class, clip and time.
pub fn pair(cycles: &[CycleData<'_>], classes: &[ClassName], styles: usize, scheme: Scheme) -> Pairing {
    pair_among(cycles, classes, styles, scheme, &vec![true; cycles.len()])
}

/// Pairs only the cycles for which `kept` is true, `[cycles]`. Statistics of a class still use all its cycles.
pub fn pair_among(
    cycles: &[CycleData<'_>],
    classes: &[ClassName],
    styles: usize,
    scheme: Scheme,
    kept: &[bool],
) -> Pairing {
    if scheme == Scheme::Both {
        let second = pair_among(cycles, classes, styles, Scheme::Viterbi, kept).outputs;
        return Pairing { second, ..pair_among(cycles, classes, styles, Scheme::Spread, kept) };
    }
    let outputs = vec![vec![None; styles]; cycles.len()];
    let mut pairing = Pairing { outputs, second: Vec::new(), prototypes: Vec::new() };
    let all: Vec<Vec<usize>> =
        (0..classes.len()).map(|c| (0..cycles.len()).filter(|&i| cycles[i].class == c).collect()).collect();
    let content: Vec<Vec<f64>> = standardised_content(cycles, &all);
    let only_kept = |lists: &[Vec<usize>]| -> Vec<Vec<usize>> {
        lists.iter().map(|list| list.iter().copied().filter(|&i| kept[i]).collect()).collect()
    };
    let members = only_kept(&all);
    let pools = match scheme {
        Scheme::Spread => only_kept(&similar_actions::pools(cycles, classes, &all)),
        _ => Vec::new(),
    };
    for (target, &(action, style)) in classes.iter().enumerate() {
        // Prototypes of the target class: index and content.
        let prototypes: Vec<(usize, Vec<f64>)> = match scheme {
            Scheme::Kernel => centres(&all[target], &content, PROTOTYPES),
            Scheme::Mean => vec![vec![0.0; CONTENT]],
            _ => Vec::new(),
        }
        .into_iter()
        .map(|centre| {
            let weights = match scheme {
                Scheme::Mean => all[target].iter().map(|&i| (i, 1.0)).collect(),
                _ => kernel(&all[target], &content, &centre),
            };
            pairing.prototypes.push(average(cycles, &weights));
            (cycles.len() + pairing.prototypes.len() - 1, centre)
        })
        .collect();
        for (source, &(source_action, source_style)) in classes.iter().enumerate() {
            if source_action != action {
                continue;
            }
            let inputs = &members[source];
            let outputs: Vec<usize> = if source_style == style {
                // In its own style, a cycle is its own output.
                inputs.clone()
            } else {
                match scheme {
                    Scheme::Take => {
                        for &input in inputs {
                            let (take, index) = (cycles[input].take, cycles[input].index);
                            let same = |&&o: &&usize| cycles[o].take == take && cycles[o].index == index;
                            pairing.outputs[input][style] = members[target].iter().find(same).copied();
                        }
                        continue;
                    }
                    // `Both` was split into its two schemes above.
                    Scheme::Spread | Scheme::Both => spread::spread(inputs, &pools[target], &content),
                    Scheme::Viterbi => viterbi(cycles, inputs, &members[target], &content),
                    Scheme::Nearest => inputs
                        .iter()
                        .map(|&i| nearest(&content[i], candidates(&members[target], &content)))
                        .collect(),
                    Scheme::Kernel | Scheme::Mean => inputs
                        .iter()
                        .map(|&i| nearest(&content[i], prototypes.iter().map(|(p, c)| (*p, c.as_slice()))))
                        .collect(),
                }
            };
            for (&input, output) in inputs.iter().zip(outputs) {
                pairing.outputs[input][style] = Some(output);
            }
        }
    }
    pairing
}

fn candidates<'a>(members: &'a [usize], content: &'a [Vec<f64>]) -> impl Iterator<Item = (usize, &'a [f64])> {
    members.iter().map(|&i| (i, content[i].as_slice()))
}

fn nearest<'a>(to: &[f64], among: impl Iterator<Item = (usize, &'a [f64])>) -> usize {
    among.min_by(|a, b| distance2(to, a.1).total_cmp(&distance2(to, b.1))).map_or(0, |(i, _)| i)
}

/// Length of a content vector.
const CONTENT: usize = 3;
/// Weight of each: mean speed, mean yaw rate, spread of the yaw rate.
const WEIGHTS: [f64; CONTENT] = [1.0, 0.5, 1.0];

/// Content of each cycle: mean speed, mean yaw rate and standard deviation of the yaw rate. The first two mean the same in
/// every style and are divided by their standard deviations over the database. The last is mostly the swing of the hips,
/// which depends on style: it is standardised within the class.
fn standardised_content(cycles: &[CycleData<'_>], members: &[Vec<usize>]) -> Vec<Vec<f64>> {
    use gestus_core::blob::layout::dof;
    let mut content: Vec<Vec<f64>> = cycles
        .iter()
        .map(|c| {
            let (start, end) = c.cycle.span();
            let rows = &c.dofs[start.ceil().max(0.0) as usize..(end.ceil() as usize).clamp(1, c.dofs.len())];
            let speed = mean_or_zero(rows.iter().map(|r| r[dof::FORWARD]));
            let (yaw, spread) = moments(rows.iter().map(|r| r[dof::YAW]), 0.0);
            vec![speed, yaw, spread]
        })
        .collect();
    let everything: Vec<usize> = (0..cycles.len()).collect();
    for (k, weight) in WEIGHTS.into_iter().enumerate() {
        let groups: Vec<&Vec<usize>> = if k <= 1 { vec![&everything] } else { members.iter().collect() };
        for group in groups {
            let (mean, spread) = moments(group.iter().map(|&i| content[i][k]), 1e-9);
            for &i in group {
                content[i][k] = weight * (content[i][k] - mean) / spread;
            }
        }
    }
    content
}

/// The sequence of output cycles with the least sum of misfits and discontinuities.
fn viterbi(
    cycles: &[CycleData<'_>],
    inputs: &[usize],
    outputs: &[usize],
    content: &[Vec<f64>],
) -> Vec<usize> {
    if outputs.is_empty() || inputs.is_empty() {
        return Vec::new();
    }
    // Distance from the end of one output cycle to the start of the next, in standard deviations of each dof; 0 for
    // consecutive cycles.
    let ends: Vec<Vec<f64>> = outputs.iter().map(|&o| at(&cycles[o], 1.0)).collect();
    let starts: Vec<Vec<f64>> = outputs.iter().map(|&o| at(&cycles[o], 0.0)).collect();
    let typical = {
        let pairs = outputs.len() * outputs.len();
        let sum: f64 = ends.iter().flat_map(|e| starts.iter().map(move |s| distance2(e, s))).sum();
        (sum / pairs as f64).max(1e-12)
    };
    let jump = |a: usize, b: usize| {
        let follows = outputs[b] == outputs[a] + 1 && cycles[outputs[a]].clip == cycles[outputs[b]].clip;
        if follows { 0.0 } else { CONTINUITY * distance2(&ends[a], &starts[b]) / typical }
    };
    let jumps: Vec<Vec<f64>> =
        (0..outputs.len()).map(|a| (0..outputs.len()).map(|b| jump(a, b)).collect()).collect();
    let fit = |i: usize, o: usize| distance2(&content[i], &content[outputs[o]]);
    let mut cost: Vec<f64> = (0..outputs.len()).map(|o| fit(inputs[0], o)).collect();
    let mut back: Vec<Vec<usize>> = Vec::new();
    for pair in inputs.windows(2) {
        let joined = cycles[pair[0]].clip == cycles[pair[1]].clip;
        let step: Vec<(f64, usize)> = (0..outputs.len())
            .map(|o| {
                let before = (0..outputs.len())
                    .map(|a| (cost[a] + if joined { jumps[a][o] } else { 0.0 }, a))
                    .min_by(|a, b| a.0.total_cmp(&b.0))
                    .unwrap_or((0.0, 0));
                (before.0 + fit(pair[1], o), before.1)
            })
            .collect();
        cost = step.iter().map(|s| s.0).collect();
        back.push(step.iter().map(|s| s.1).collect());
    }
    let mut best = (0..outputs.len()).min_by(|&a, &b| cost[a].total_cmp(&cost[b])).unwrap_or(0);
    let mut path = vec![outputs[best]];
    for step in back.iter().rev() {
        best = step[best];
        path.push(outputs[best]);
    }
    path.reverse();
    path
}

/// Centres over the contents of a class: first the mean, then each time the content farthest from all centres so far.
fn centres(members: &[usize], content: &[Vec<f64>], most: usize) -> Vec<Vec<f64>> {
    let mut centres = vec![vec![0.0; CONTENT]];
    while centres.len() < most.min(members.len()) {
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
