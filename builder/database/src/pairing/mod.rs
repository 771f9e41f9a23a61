//! Pairs: for every cycle and style, the cycle that is its output.
//!
//! The papers assume an output example for every input example; recorded data has none (METHODS, "Registration and
//! pairing"). A cycle's counterpart is a cycle of the same action in the other style with about the same content:
//! speed and turn, and about the same swing of the hips **relative to their style's own** mean and spread.
//!
//! | scheme | output of a cycle |
//! |---|---|
//! | [`Scheme::Spread`] | one real cycle, out of those of all kin actions; near inputs share out the near outputs by kernel weight |
//! | [`Scheme::Both`] | two real cycles, that of `Spread` and that of `Viterbi`: the output is their mean |
//! | [`Scheme::Viterbi`] | one real cycle; the sequence that fits best and continues best |
//! | [`Scheme::Nearest`] | one real cycle, the best fit |
//! | [`Scheme::Kernel`] | a prototype: a kernel average of a dozen real cycles around it, a few dozen a class |
//! | [`Scheme::Mean`] | one prototype, the mean of all |
//! | [`Scheme::Take`] | the same cycle of the clip of the same take: for motion recorded or made in pairs |
//!
//! The linear models learn from stretches of motion and are always given outputs that continue: where the scheme is
//! [`Scheme::Spread`] or [`Scheme::Both`], theirs is [`Scheme::Viterbi`].
//!
//! Averages lie nearer to any one real cycle than another real cycle does, and move less than any: every step
//! becomes the same step. `gestus evaluate ablation` shows the trade.

use serde::{Deserialize, Serialize};

use gestus_motion::corpus::Cycle;

mod cycles;
mod similar_actions;
mod spread;

pub use cycles::{ClassName, CycleData};

use cycles::{at, distance2};

/// Cycles that a prototype averages.
const KERNEL_CYCLES: usize = 12;
/// Most prototypes a class.
const PROTOTYPES: usize = 24;
/// Weight of a jump between two output cycles that do not follow each other, against the fit. Chosen on real gaits:
/// 0 gives 2.40 cm labelled, 1 2.39, 10 2.28, 30 2.29, 100 2.34.
const CONTINUITY: f64 = 10.0;

/// How output cycles are chosen.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Scheme {
    /// Real cycles of kin actions, shared out by kernel weight.
    Spread,
    /// That and the sequence that fits and continues best: two outputs, of which a board takes the mean.
    #[default]
    Both,
    /// The sequence of real cycles that fits and continues best.
    Viterbi,
    /// The real cycle that fits best.
    Nearest,
    /// Kernel averages around prototypes.
    Kernel,
    /// One average a class.
    Mean,
    /// The same cycle of the clip of the same take.
    Take,
}

impl Scheme {
    /// All, with their names.
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

    /// The scheme that the linear models' pairs are of.
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
    /// Class whose cycles it averages.
    pub class: usize,
    /// Dofs, shape `[frames][D]`; two frames before phase 0 and one behind phase 1 belong to it.
    pub rows: Vec<Vec<f64>>,
    /// Its timeline in those rows.
    pub cycle: Cycle,
}

/// Output cycles of every cycle.
#[derive(Debug, Clone)]
pub struct Pairing {
    /// For every cycle and style: index of the output cycle. Prototypes are numbered behind the cycles.
    pub outputs: Vec<Vec<Option<usize>>>,
    /// The same of their second outputs; empty where there are none.
    pub second: Vec<Vec<Option<usize>>>,
    /// The averaged cycles.
    pub prototypes: Vec<Prototype>,
}

/// Pairs all cycles, which are sorted by class, clip and time.
pub fn pair(cycles: &[CycleData<'_>], classes: &[ClassName], styles: usize, scheme: Scheme) -> Pairing {
    if scheme == Scheme::Both {
        let second = pair(cycles, classes, styles, Scheme::Viterbi).outputs;
        return Pairing { second, ..pair(cycles, classes, styles, Scheme::Spread) };
    }
    let outputs = vec![vec![None; styles]; cycles.len()];
    let mut pairing = Pairing { outputs, second: Vec::new(), prototypes: Vec::new() };
    let members: Vec<Vec<usize>> =
        (0..classes.len()).map(|c| (0..cycles.len()).filter(|&i| cycles[i].class == c).collect()).collect();
    let content: Vec<Vec<f64>> = standard(cycles, &members);
    let pools =
        if scheme == Scheme::Spread { similar_actions::pools(cycles, classes, &members) } else { Vec::new() };
    for (target, &(action, style)) in classes.iter().enumerate() {
        // Prototypes of the target class: index of the prototype, and its content.
        let prototypes: Vec<(usize, Vec<f64>)> = match scheme {
            Scheme::Kernel => centres(&members[target], &content, PROTOTYPES),
            Scheme::Mean => vec![vec![0.0; CONTENT]],
            _ => Vec::new(),
        }
        .into_iter()
        .map(|centre| {
            let weights = match scheme {
                Scheme::Mean => members[target].iter().map(|&i| (i, 1.0)).collect(),
                _ => kernel(&members[target], &content, &centre),
            };
            pairing.prototypes.push(average(cycles, target, &weights));
            (cycles.len() + pairing.prototypes.len() - 1, centre)
        })
        .collect();
        for (source, &(source_action, source_style)) in classes.iter().enumerate() {
            if source_action != action {
                continue;
            }
            let inputs = &members[source];
            let outputs: Vec<usize> = if source_style == style {
                // Where input style and output style are the same, the output is the input.
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
                    // Both are taken one by one.
                    Scheme::Spread | Scheme::Both => spread::spread(inputs, &pools[target], &content),
                    Scheme::Viterbi => viterbi(cycles, inputs, &members[target], &content),
                    Scheme::Nearest => inputs
                        .iter()
                        .map(|&i| nearest(&content[i], real(&members[target], &content)))
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

fn real<'a>(members: &'a [usize], content: &'a [Vec<f64>]) -> impl Iterator<Item = (usize, &'a [f64])> {
    members.iter().map(|&i| (i, content[i].as_slice()))
}

fn nearest<'a>(to: &[f64], among: impl Iterator<Item = (usize, &'a [f64])>) -> usize {
    among.min_by(|a, b| distance2(to, a.1).total_cmp(&distance2(to, b.1))).map_or(0, |(i, _)| i)
}

/// Numbers that say what a cycle is about.
const CONTENT: usize = 3;
/// Weight of each: mean speed, mean yaw rate, spread of the yaw rate.
const WEIGHTS: [f64; CONTENT] = [1.0, 0.5, 1.0];

/// Mean speed, mean yaw rate and spread of the yaw rate of each cycle. A speed is a speed and a turn is a turn in every
/// style: they are counted in spreads over all cycles of the database. The spread of the yaw rate is mostly the swing
/// of the hips, a matter of style, and counted from the mean of the class, in its spreads.
fn standard(cycles: &[CycleData<'_>], members: &[Vec<usize>]) -> Vec<Vec<f64>> {
    use gestus_core::blob::layout::dof;
    let mut content: Vec<Vec<f64>> = cycles
        .iter()
        .map(|c| {
            let (start, end) = c.cycle.span();
            let rows = &c.dofs[start.ceil().max(0.0) as usize..(end.ceil() as usize).clamp(1, c.dofs.len())];
            let count = rows.len().max(1) as f64;
            let mean = |d: usize| rows.iter().map(|r| r[d]).sum::<f64>() / count;
            let yaw = mean(dof::YAW);
            let spread = (rows.iter().map(|r| (r[dof::YAW] - yaw).powi(2)).sum::<f64>() / count).sqrt();
            vec![mean(dof::FORWARD), yaw, spread]
        })
        .collect();
    let everything: Vec<usize> = (0..cycles.len()).collect();
    for (k, weight) in WEIGHTS.into_iter().enumerate() {
        let groups: Vec<&Vec<usize>> = if k <= 1 { vec![&everything] } else { members.iter().collect() };
        for group in groups {
            let count = group.len().max(1) as f64;
            let mean = group.iter().map(|&i| content[i][k]).sum::<f64>() / count;
            let spread = (group.iter().map(|&i| (content[i][k] - mean).powi(2)).sum::<f64>() / count).sqrt();
            for &i in group {
                content[i][k] = weight * (content[i][k] - mean) / spread.max(1e-9);
            }
        }
    }
    content
}

/// The sequence of output cycles with the least misfit and the least jumping.
fn viterbi(
    cycles: &[CycleData<'_>],
    inputs: &[usize],
    outputs: &[usize],
    content: &[Vec<f64>],
) -> Vec<usize> {
    if outputs.is_empty() || inputs.is_empty() {
        return Vec::new();
    }
    // How far the end of one output cycle is from the start of the next, in spreads of each dof; 0 where they follow.
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
    let fit = |i: usize, o: usize| distance2(&content[i], &content[outputs[o]]);
    let mut cost: Vec<f64> = (0..outputs.len()).map(|o| fit(inputs[0], o)).collect();
    let mut back: Vec<Vec<usize>> = Vec::new();
    for pair in inputs.windows(2) {
        let joined = cycles[pair[0]].clip == cycles[pair[1]].clip;
        let step: Vec<(f64, usize)> = (0..outputs.len())
            .map(|o| {
                let before = (0..outputs.len())
                    .map(|a| (cost[a] + if joined { jump(a, o) } else { 0.0 }, a))
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

/// Centres spread over the contents of a class: the first is the mean, each further one lies farthest from those
/// before it.
fn centres(members: &[usize], content: &[Vec<f64>], most: usize) -> Vec<Vec<f64>> {
    let mut centres = vec![vec![0.0; CONTENT]];
    while centres.len() < most.min(members.len()) {
        let lonely =
            |&i: &usize| centres.iter().map(|c| distance2(c, &content[i])).fold(f64::INFINITY, f64::min);
        match members.iter().copied().max_by(|a, b| lonely(a).total_cmp(&lonely(b))) {
            Some(next) => centres.push(content[next].clone()),
            None => break,
        }
    }
    centres
}

/// The cycles nearest to a centre and their Gaussian weights, as wide as the farthest of them.
fn kernel(members: &[usize], content: &[Vec<f64>], centre: &[f64]) -> Vec<(usize, f64)> {
    let mut near: Vec<(f64, usize)> = members.iter().map(|&i| (distance2(&content[i], centre), i)).collect();
    near.sort_by(|a, b| a.0.total_cmp(&b.0));
    near.truncate(KERNEL_CYCLES);
    let width = near.last().map_or(1.0, |n| n.0).max(1e-9);
    near.into_iter().map(|(d, i)| (i, (-2.0 * d / width).exp())).collect()
}

/// The weighted mean of cycles, as a clip at their mean tempo.
fn average(cycles: &[CycleData<'_>], class: usize, weights: &[(usize, f64)]) -> Prototype {
    const BEFORE: usize = 2;
    let total: f64 = weights.iter().map(|w| w.1).sum();
    let mean = |value: &dyn Fn(usize) -> f64| weights.iter().map(|&(i, w)| w * value(i)).sum::<f64>() / total;
    // Knots of the mean tempo, the first one behind the frames that lead in.
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
    Prototype { class, rows, cycle }
}
