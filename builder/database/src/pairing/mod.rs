//! Pairing: finds for every cycle and style the cycle that is its output.
//!
//! The papers assume an output example for every input example; recorded data has none. A cycle's output is a cycle of
//! the same action in the other style with similar content: speed and yaw rate, and the swing of the hips **relative to
//! the mean and standard deviation of its style**.
//!
//! | scheme | output of a cycle |
//! |---|---|
//! | [`Scheme::Spread`] | one real cycle of all similar actions; neighboring inputs get different outputs, as often as kernel weights say |
//! | [`Scheme::Both`] | two real cycles, whose mean is the output: those of `Spread` and `Viterbi`; of a whole clip, that of `Spread` and the clip most like it |
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

use gestus_motion::{corpus::Cycle, statistics::distance2};

mod alike;
mod cycles;
mod prototypes;
mod scheme;
mod similar_actions;
mod spread;
mod viterbi;

pub use cycles::{ClassName, CycleData};
pub use prototypes::Prototype;
pub use scheme::Scheme;

use cycles::standardised_content;

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

impl Pairing {
    /// Timeline, dofs and clip of an output of cycles; a prototype is of no clip.
    pub fn output<'a>(
        &'a self,
        cycles: &[CycleData<'a>],
        output: usize,
    ) -> (&'a Cycle, &'a [Vec<f64>], Option<usize>) {
        match cycles.get(output) {
            Some(real) => (real.cycle, real.dofs, Some(real.clip)),
            None => {
                let Prototype { cycle, rows } = &self.prototypes[output - cycles.len()];
                (cycle, rows, None)
            }
        }
    }
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
        let first = pair_among(cycles, classes, styles, Scheme::Spread, kept);
        let mut second = pair_among(cycles, classes, styles, Scheme::Viterbi, kept).outputs;
        let partners = alike::partners(cycles, kept);
        for (input, (firsts, seconds)) in first.outputs.iter().zip(&mut second).enumerate() {
            for (first, second) in firsts.iter().zip(seconds) {
                // In its own style, a cycle is its own output.
                let Some(partner) = first.filter(|&f| f != input).and_then(|f| partners[f]) else { continue };
                *second = Some(partner);
            }
        }
        return Pairing { second, ..first };
    }
    let all: Vec<Vec<usize>> =
        (0..classes.len()).map(|c| (0..cycles.len()).filter(|&i| cycles[i].class == c).collect()).collect();
    let content = standardised_content(cycles, &all);
    let only_kept = |lists: &[Vec<usize>]| -> Vec<Vec<usize>> {
        lists.iter().map(|list| list.iter().copied().filter(|&i| kept[i]).collect()).collect()
    };
    let members = only_kept(&all);
    let pools = match scheme {
        Scheme::Spread => only_kept(&similar_actions::pools(cycles, classes, &all)),
        _ => Vec::new(),
    };
    let mut outputs = vec![vec![None; styles]; cycles.len()];
    let mut prototypes = Vec::new();
    for (target, &(action, style)) in classes.iter().enumerate() {
        let first = cycles.len() + prototypes.len();
        let found = prototypes::of(scheme, cycles, &all[target], &content);
        // Index and content of what may be the output of several cycles.
        let candidates: Vec<(usize, &[f64])> = match scheme {
            Scheme::Nearest => members[target].iter().map(|&i| (i, content[i].as_slice())).collect(),
            _ => found.iter().enumerate().map(|(k, (centre, _))| (first + k, centre.as_slice())).collect(),
        };
        for (source, &(_, source_style)) in classes.iter().enumerate().filter(|(_, c)| c.0 == action) {
            let inputs = &members[source];
            let real = |outputs: Vec<usize>| outputs.into_iter().map(Some).collect();
            let each = |of: &dyn Fn(usize) -> Option<usize>| inputs.iter().map(|&i| of(i)).collect();
            let chosen: Vec<Option<usize>> = match scheme {
                // In its own style, a cycle is its own output.
                _ if source_style == style => each(&Some),
                // `Both` was split into its two schemes above.
                Scheme::Spread | Scheme::Both => real(spread::spread(inputs, &pools[target], &content)),
                Scheme::Viterbi => real(viterbi::viterbi(cycles, inputs, &members[target], &content)),
                Scheme::Nearest | Scheme::Kernel | Scheme::Mean => {
                    each(&|input| nearest(&content[input], &candidates))
                }
                Scheme::Take => each(&|input| {
                    let of = |i: usize| (cycles[i].take, cycles[i].index);
                    members[target].iter().copied().find(|&output| of(output) == of(input))
                }),
            };
            for (&input, output) in inputs.iter().zip(chosen) {
                outputs[input][style] = output;
            }
        }
        prototypes.extend(found.into_iter().map(|(_, prototype)| prototype));
    }
    Pairing { outputs, second: Vec::new(), prototypes }
}

/// The candidate whose content is nearest; `None` without candidates.
fn nearest(to: &[f64], candidates: &[(usize, &[f64])]) -> Option<usize> {
    candidates.iter().min_by(|a, b| distance2(to, a.1).total_cmp(&distance2(to, b.1))).map(|(i, _)| *i)
}

#[cfg(test)]
mod tests {
    use gestus_core::blob::layout::dof;

    use super::*;

    /// A held-out set of a small class is empty. The nearest of none was the first cycle of the database.
    #[test]
    fn without_candidates_there_is_no_output() {
        let (cycle, dofs) = (Cycle { knots: vec![0.0, 1.0, 2.0] }, vec![vec![0.5; dof::JOINTS]; 3]);
        let of = |class| CycleData { class, clip: class, take: "", index: 0, cycle: &cycle, dofs: &dofs };
        let (cycles, classes) = ([of(0), of(1)], [(0, 0), (0, 1)]);
        for scheme in [Scheme::Nearest, Scheme::Viterbi, Scheme::Spread, Scheme::Take] {
            let pairing = pair_among(&cycles, &classes, 2, scheme, &[true, false]);
            assert_eq!(pairing.outputs, [[Some(0), None], [None, None]], "{scheme:?}");
            let all = pair(&cycles, &classes, 2, scheme).outputs;
            assert_eq!(all, [[Some(0), Some(1)], [Some(0), Some(1)]], "{scheme:?}");
        }
    }
}
