//! Predicts the Effort of a blend from its pair and α: six methods, and the table that compares them (Torresani 2006,
//! section 6 and Table 1).
//!
//! Linear interpolation, `(1-α) e_i + α e_j`, learns nothing; earlier work assumes it. Linear ridge, kernel ridge and
//! support vector regression learn the Effort from the input `z = [c_i, c_j, e_i, e_j, α]`: components and Efforts of both
//! fragments, and α, each standardised over the training examples. These four are the paper's.
//!
//! Two facts need not be learned from the 85 examples: for α of 0 or 1 the blend is a fragment, whose Effort is known, and
//! the order of the two does not matter. [`Method::PairKernelRidge`] and [`Method::PairSupportVector`] therefore learn the
//! deviation from interpolation with a kernel that has both properties ([`Kernel::Between`]). Not all of z helps:
//! cross-validation chooses a kernel of all of it, of the Efforts and α, or of the factor's own values and α (`View`).

use rand::{SeedableRng, seq::SliceRandom};
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;

use crate::effort::{
    Factors,
    example::{Example, Known},
    ridge::{self, Kernel, Machine, Tabled, gammas},
    support,
};
use gestus_motion::statistics::{mean_or_zero, moments};

/// A way to predict.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Method {
    /// The blend's Effort is the blend of the Efforts.
    LinearInterpolation,
    /// A linear function of z, with a penalty.
    LinearRidge,
    /// A sum of radial functions of z, squared loss.
    KernelRidge,
    /// The same, ε-insensitive loss.
    SupportVector,
    /// A sum of functions of pairs on top of interpolation, squared loss.
    PairKernelRidge,
    /// The same, ε-insensitive loss.
    PairSupportVector,
}

impl Method {
    /// All of them: those of Table 1 in its order, then ours.
    pub const ALL: [Self; 6] = [
        Self::LinearInterpolation,
        Self::LinearRidge,
        Self::KernelRidge,
        Self::SupportVector,
        Self::PairKernelRidge,
        Self::PairSupportVector,
    ];

    /// As tables and JSON have it.
    pub const fn name(self) -> &'static str {
        match self {
            Self::LinearInterpolation => "linear-interpolation",
            Self::LinearRidge => "linear-ridge",
            Self::KernelRidge => "kernel-ridge",
            Self::SupportVector => "support-vector",
            Self::PairKernelRidge => "kernel-ridge-pair",
            Self::PairSupportVector => "support-vector-pair",
        }
    }
}

/// The input of a kernel.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum View {
    /// All of z, number by number.
    Plain,
    /// Components and Efforts of both fragments, and α.
    All,
    /// The Efforts and α.
    Efforts,
    /// One factor of the Efforts, and α.
    Own(usize),
}

/// Standardisation by the training examples: `(mean, 1 / deviation)` of each number.
#[derive(Debug, Clone, Default)]
struct Scales {
    /// Of z.
    plain: Vec<(f64, f64)>,
    /// Of the components and Efforts of a fragment, the first or the second.
    halves: Vec<(f64, f64)>,
}

impl Scales {
    fn of(known: &Known, examples: &[Example]) -> Self {
        let plain: Vec<Vec<f64>> = examples.iter().map(|e| known.input(e.first, e.second, e.alpha)).collect();
        let halves: Vec<Vec<f64>> =
            examples.iter().flat_map(|e| [e.first, e.second]).map(|f| known.half(f)).collect();
        Self { plain: scales(&plain), halves: scales(&halves) }
    }

    fn see(&self, view: View, known: &Known, first: usize, second: usize, alpha: f64) -> Vec<f64> {
        let half = |fragment: usize| -> Vec<f64> {
            let all = scaled(&self.halves, &known.half(fragment));
            let efforts = all.len() - 3;
            match view {
                View::Own(k) => vec![all[efforts + k]],
                View::Efforts => all[efforts..].to_vec(),
                _ => all,
            }
        };
        match view {
            View::Plain => scaled(&self.plain, &known.input(first, second, alpha)),
            _ => [half(first), half(second), vec![2.0 * alpha - 1.0]].concat(),
        }
    }
}

/// A machine with its view.
#[derive(Debug, Clone)]
struct Fitted {
    view: View,
    machine: Machine,
}

/// Kernels of the training examples that may be chosen.
struct Candidates {
    view: View,
    z: Vec<Vec<f64>>,
    kernels: Vec<Tabled>,
}

/// The choice of ridge regression's cross-validation for a factor.
struct Choice {
    /// Index of the candidates, and of their kernel.
    at: (usize, usize),
    lambda: f64,
    error: f64,
}

/// A fitted function.
#[derive(Debug, Clone)]
pub struct Learner {
    scales: Scales,
    /// One machine a factor; none of linear interpolation alone.
    machines: Vec<Fitted>,
}

/// Training examples, prepared for all methods.
struct Training<'a> {
    known: &'a Known,
    examples: &'a [Example],
    scales: Scales,
    /// The Efforts, `[3][examples]`.
    efforts: Vec<Vec<f64>>,
    /// Their deviations from interpolation.
    bends: Vec<Vec<f64>>,
}

impl<'a> Training<'a> {
    fn of(known: &'a Known, examples: &'a [Example]) -> Self {
        let line = |e: &Example| known.interpolated(e.first, e.second, e.alpha);
        let of = |f: &dyn Fn(&Example, usize) -> f64| -> Vec<Vec<f64>> {
            (0..3).map(|k| examples.iter().map(|e| f(e, k)).collect()).collect()
        };
        Self {
            known,
            examples,
            scales: Scales::of(known, examples),
            efforts: of(&|e, k| e.effort[k]),
            bends: of(&|e, k| e.effort[k] - line(e)[k]),
        }
    }

    fn candidates(&self, view: View, kernels: impl Fn(usize) -> Vec<Kernel>) -> Candidates {
        let see = |e: &Example| self.scales.see(view, self.known, e.first, e.second, e.alpha);
        let z: Vec<Vec<f64>> = self.examples.iter().map(see).collect();
        let width = z.first().map_or(0, Vec::len);
        let kernels = kernels(width).into_iter().map(|k| (k, k.matrix(&z))).collect();
        Candidates { view, z, kernels }
    }

    /// What is between the ends, seen in each way.
    fn between(&self) -> Vec<Candidates> {
        [View::All, View::Efforts, View::Own(0), View::Own(1), View::Own(2)]
            .map(|v| self.candidates(v, |width| gammas(width).map(Kernel::Between).collect()))
            .into()
    }

    /// z as it is.
    fn plain(&self, kernels: impl Fn(usize) -> Vec<Kernel>) -> Curves {
        Curves::of(vec![self.candidates(View::Plain, kernels)], &self.efforts)
    }
}

/// Kernels for some targets, and which of them ridge regression's cross-validation chose: support vectors start from it.
struct Curves {
    candidates: Vec<Candidates>,
    choices: Vec<Choice>,
}

impl Curves {
    fn of(candidates: Vec<Candidates>, targets: &[Vec<f64>]) -> Self {
        let choices = chosen(&candidates, targets);
        Self { candidates, choices }
    }
}

/// Ridge's choice for each factor.
fn chosen(candidates: &[Candidates], targets: &[Vec<f64>]) -> Vec<Choice> {
    let mut best: Vec<Option<Choice>> = (0..3).map(|_| None).collect();
    for (c, candidate) in candidates.iter().enumerate() {
        let of = match candidate.view {
            View::Own(k) => k..k + 1,
            _ => 0..3,
        };
        for (k, (at, lambda, error)) in of.clone().zip(ridge::choose(&candidate.kernels, &targets[of])) {
            if best[k].as_ref().is_none_or(|b| error < b.error) {
                best[k] = Some(Choice { at: (c, at), lambda, error });
            }
        }
    }
    best.into_iter().flatten().collect()
}

/// Ridge regression with the choices.
fn ridges(Curves { candidates, choices }: &Curves, targets: &[Vec<f64>]) -> Vec<Fitted> {
    let fit = |(choice, y): (&Choice, &Vec<f64>)| {
        let candidate = &candidates[choice.at.0];
        let kernel = candidate.kernels[choice.at.1].0;
        Fitted { view: candidate.view, machine: ridge::fit(kernel, choice.lambda, &candidate.z, y) }
    };
    choices.iter().zip(targets).map(fit).collect()
}

/// Support vectors with ridge regression's view, and its kernel or one of the two next to it: the best view and width
/// depend on the data more than on the loss.
fn supports(Curves { candidates, choices }: &Curves, targets: &[Vec<f64>]) -> Vec<Fitted> {
    let fit = |(choice, y): (&Choice, &Vec<f64>)| {
        let candidate = &candidates[choice.at.0];
        let at = choice.at.1;
        let near = &candidate.kernels[at.saturating_sub(1)..(at + 2).min(candidate.kernels.len())];
        let (index, parameters, _) = support::choose(near, y);
        let machine = support::fit(near[index].0, parameters, &candidate.z, y);
        Fitted { view: candidate.view, machine }
    };
    choices.iter().zip(targets).map(fit).collect()
}

impl Learner {
    /// Fits to examples; all free parameters are chosen by ten-fold cross-validation.
    pub fn fit(method: Method, known: &Known, examples: &[Example]) -> Self {
        let mut learners = Self::fit_all(&[method], known, examples);
        learners.remove(0)
    }

    /// Fits by several methods; support vectors start from the choices of kernel ridge regression.
    fn fit_all(methods: &[Method], known: &Known, examples: &[Example]) -> Vec<Self> {
        let training = Training::of(known, examples);
        let radial = || training.plain(|width| gammas(width).map(Kernel::Radial).collect());
        let paired = || Curves::of(training.between(), &training.bends);
        let (mut plain, mut pairs): (Option<Curves>, Option<Curves>) = (None, None);
        methods
            .iter()
            .map(|method| {
                let machines = match method {
                    Method::LinearInterpolation => Vec::new(),
                    Method::LinearRidge => {
                        ridges(&training.plain(|_| vec![Kernel::Linear]), &training.efforts)
                    }
                    Method::KernelRidge => ridges(plain.get_or_insert_with(radial), &training.efforts),
                    Method::SupportVector => supports(plain.get_or_insert_with(radial), &training.efforts),
                    Method::PairKernelRidge => ridges(pairs.get_or_insert_with(paired), &training.bends),
                    Method::PairSupportVector => supports(pairs.get_or_insert_with(paired), &training.bends),
                };
                Self { scales: training.scales.clone(), machines }
            })
            .collect()
    }

    /// The Effort of a blend.
    pub fn predict(&self, known: &Known, first: usize, second: usize, alpha: f64) -> Factors {
        let line = known.interpolated(first, second, alpha);
        if self.machines.is_empty() {
            return line;
        }
        std::array::from_fn(|k| {
            let Fitted { view, machine } = &self.machines[k];
            let start = if *view == View::Plain { 0.0 } else { line[k] };
            start + machine.predict(&self.scales.see(*view, known, first, second, alpha))
        })
    }
}

fn scales(inputs: &[Vec<f64>]) -> Vec<(f64, f64)> {
    (0..inputs.first().map_or(0, Vec::len))
        .map(|d| {
            let (mean, deviation) = moments(inputs.iter().map(|i| i[d]), 1e-6);
            (mean, 1.0 / deviation)
        })
        .collect()
}

fn scaled(scales: &[(f64, f64)], input: &[f64]) -> Vec<f64> {
    input.iter().zip(scales).map(|(v, (mean, inverse))| (v - mean) * inverse).collect()
}

/// Mean squared errors of each method ([`Method::ALL`]) and factor in each of some random splits, shape
/// `[splits][methods]`. `progress` is called once a split.
pub fn errors(
    known: &Known,
    examples: &[Example],
    train: usize,
    splits: usize,
    seed: u64,
    progress: &(dyn Fn() + Sync),
) -> Vec<Vec<Factors>> {
    (0..splits)
        .into_par_iter()
        .map(|split| {
            let mut rng = ChaCha8Rng::seed_from_u64(seed);
            rng.set_stream(split as u64);
            let mut order: Vec<Example> = examples.to_vec();
            order.shuffle(&mut rng);
            let (train, test) = order.split_at(train.min(order.len()));
            let errors = Learner::fit_all(&Method::ALL, known, train)
                .iter()
                .map(|learner| {
                    let mut sums = [0.0; 3];
                    for e in test {
                        let guess = learner.predict(known, e.first, e.second, e.alpha);
                        for k in 0..3 {
                            sums[k] += (guess[k] - e.effort[k]).powi(2) / test.len().max(1) as f64;
                        }
                    }
                    sums
                })
                .collect();
            progress();
            errors
        })
        .collect()
}

/// Errors of a method compared with those of linear interpolation in the same cases.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Compared {
    /// Mean of the method's errors.
    pub mean: f64,
    /// Standard error of that mean, over cases that count as independent; none below two.
    pub standard_error: Option<f64>,
    /// Mean reduction of the error relative to interpolation.
    pub gain: f64,
    /// Standard error of the gain: a paired test; none below two cases.
    pub gain_error: Option<f64>,
    /// Share of the cases in which the method is better.
    pub better: f64,
}

/// Compares errors of a method with those of interpolation, case by case.
pub fn compare(method: &[f64], line: &[f64]) -> Compared {
    let gains: Vec<f64> = line.iter().zip(method).map(|(l, m)| l - m).collect();
    let count = gains.len().max(1) as f64;
    let mean = |v: &[f64]| mean_or_zero(v.iter().copied());
    let error = |v: &[f64]| {
        let squares: f64 = v.iter().map(|x| (x - mean(v)).powi(2)).sum();
        (count > 1.0).then(|| (squares / (count - 1.0) / count).sqrt())
    };
    Compared {
        mean: mean(method),
        standard_error: error(method),
        gain: mean(&gains),
        gain_error: error(&gains),
        better: gains.iter().filter(|g| **g > 0.0).count() as f64 / count,
    }
}

/// Means of [`errors`] over the splits, in the order of [`Method::ALL`].
pub fn means(errors: &[Vec<Factors>]) -> Vec<Factors> {
    let over = |m: usize, k: usize| mean_or_zero(errors.iter().map(|e| e[m][k]));
    (0..Method::ALL.len()).map(|m| std::array::from_fn(|k| over(m, k))).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Fragments on a line of Efforts; blends whose Effort bends away from the line.
    fn data(bend: f64) -> (Known, Vec<Example>) {
        let n = 14;
        let wave = |i: usize, f: f64| (i as f64 * f).sin();
        let known = Known {
            components: (0..n).map(|i| vec![wave(i, 1.1), wave(i, 2.3)]).collect(),
            efforts: (0..n).map(|i| [2.0 * wave(i, 0.9), 2.0 * wave(i, 1.7), wave(i, 3.1)]).collect(),
        };
        let examples = (0..60)
            .map(|i| {
                let (first, second) = (i * 5 % n, (i * 3 + 1) % n);
                let alpha = 0.5 + 0.7 * wave(i, 4.7);
                let mut effort = known.interpolated(first, second, alpha);
                effort[1] += bend * (4.0 * alpha * (1.0 - alpha) - 0.5);
                Example { first, second, alpha, effort }
            })
            .collect();
        (known, examples)
    }

    #[test]
    fn lines_are_exact_for_lines_and_kernels_follow_bends() {
        let (known, examples) = data(2.0);
        let errors = means(&super::errors(&known, &examples, 48, 4, 7, &|| {}));
        assert!(errors[0][0] < 1e-20 && errors[0][2] < 1e-20);
        // Half a parabola of height 2 about its middle is off by 0.4 and more.
        assert!(errors[0][1] > 0.4, "{errors:?}");
        for kernel in [4, 5] {
            assert!(errors[kernel][1] < 0.3 * errors[0][1], "{errors:?}");
        }
        let (known, straight) = data(0.0);
        assert!(means(&super::errors(&known, &straight, 48, 2, 7, &|| {}))[0].iter().all(|e| *e < 1e-20));
    }

    #[test]
    fn a_gain_is_compared_with_its_own_spread() {
        let compared = compare(&[1.0, 2.0, 3.0, 2.0], &[2.0, 2.5, 4.0, 1.5]);
        assert_eq!((compared.mean, compared.gain, compared.better), (2.0, 0.5, 0.75));
        // Deviations of the gains from 0.5: 0.5, 0, 0.5, -1; of the errors from 2: -1, 0, 1, 0.
        assert!((compared.gain_error.unwrap() - (1.5f64 / 3.0 / 4.0).sqrt()).abs() < 1e-12);
        assert!((compared.standard_error.unwrap() - (2.0f64 / 3.0 / 4.0).sqrt()).abs() < 1e-12);
        let one = compare(&[1.0], &[2.0]);
        assert_eq!((one.gain, one.standard_error, one.gain_error), (1.0, None, None));
    }
}
