//! From a pair and α to the Effort of its blend: four ways to learn it, and the table that compares them (paper 003,
//! section 6 and Table 1).
//!
//! The input is `z = [c_i, c_j, e_i, e_j, α]`: components and Efforts of both fragments, and α; each number is taken to
//! mean 0 and variance 1 over the training examples. Linear interpolation, `(1-α) e_i + α e_j`, learns nothing and is
//! what earlier work assumes. It is also a good place to start from: the kernel methods learn the Effort itself, as the
//! paper has it, or its deviation from interpolation, whichever cross-validation finds better. And with 85 examples in
//! a dozen dimensions not all of z helps: cross-validation may also choose a kernel of the Efforts and α alone, or of
//! the factor's own ones and α (`View`).

use nalgebra::DMatrix;
use rand::{SeedableRng, seq::SliceRandom};
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;

use super::{
    Factors,
    ridge::{self, Kernel, Machine, gammas},
    support,
};

/// A way to predict.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Method {
    /// The blend's Effort is the blend of the Efforts.
    LinearInterpolation,
    /// A linear function of z, with a penalty.
    LinearRidge,
    /// A sum of radial functions, squared loss.
    KernelRidge,
    /// A sum of radial functions, ε-insensitive loss.
    SupportVector,
}

impl Method {
    /// All of them, in the order of Table 1.
    pub const ALL: [Self; 4] =
        [Self::LinearInterpolation, Self::LinearRidge, Self::KernelRidge, Self::SupportVector];

    /// As tables and JSON have it.
    pub const fn name(self) -> &'static str {
        match self {
            Self::LinearInterpolation => "linear-interpolation",
            Self::LinearRidge => "linear-ridge",
            Self::KernelRidge => "kernel-ridge",
            Self::SupportVector => "support-vector",
        }
    }
}

/// A labelled blend.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Example {
    /// The first fragment.
    pub first: usize,
    /// The second.
    pub second: usize,
    /// How far from the first to the second.
    pub alpha: f64,
    /// What it was seen as.
    pub effort: Factors,
}

/// What is known of each fragment.
#[derive(Debug, Clone, Default)]
pub struct Known {
    /// Its components, `[fragments][k]`.
    pub components: Vec<Vec<f64>>,
    /// Its Effort, `[fragments]`.
    pub efforts: Vec<Factors>,
}

impl Known {
    /// z of a pair and α.
    pub fn input(&self, first: usize, second: usize, alpha: f64) -> Vec<f64> {
        let (c, e) = (&self.components, &self.efforts);
        [&c[first][..], &c[second], &e[first], &e[second], &[alpha]].concat()
    }

    /// The blend of the Efforts.
    pub fn interpolated(&self, first: usize, second: usize, alpha: f64) -> Factors {
        std::array::from_fn(|k| (1.0 - alpha) * self.efforts[first][k] + alpha * self.efforts[second][k])
    }
}

/// What a kernel sees of z.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum View {
    /// All of it.
    All,
    /// The Efforts and α.
    Efforts,
    /// One factor of the Efforts, and α.
    Own(usize),
}

impl View {
    fn of(self, z: &[f64]) -> Vec<f64> {
        // z ends with both Efforts and α.
        let first = z.len() - 7;
        match self {
            Self::All => z.to_vec(),
            Self::Efforts => z[first..].to_vec(),
            Self::Own(k) => vec![z[first + k], z[first + 3 + k], z[first + 6]],
        }
    }
}

/// A machine, what it sees, and whether it adds to linear interpolation.
#[derive(Debug, Clone)]
struct Fitted {
    view: View,
    machine: Machine,
    about_line: bool,
}

/// Kernel matrices of the training examples, whichever may be chosen.
struct Candidates {
    view: View,
    z: Vec<Vec<f64>>,
    kernels: Vec<(Kernel, DMatrix<f64>)>,
}

impl Candidates {
    fn of(view: View, z: &[Vec<f64>], kernels: impl Fn(usize) -> Vec<Kernel>) -> Self {
        let z: Vec<Vec<f64>> = z.iter().map(|z| view.of(z)).collect();
        let kernels = kernels(z.first().map_or(0, Vec::len)).into_iter().map(|k| (k, k.matrix(&z))).collect();
        Self { view, z, kernels }
    }
}

/// What ridge's cross-validation chose for a factor.
struct Choice {
    /// Index of the candidates, and of their kernel.
    at: (usize, usize),
    lambda: f64,
    about_line: bool,
    error: f64,
}

/// A fitted function.
#[derive(Debug, Clone)]
pub struct Learner {
    /// Mean and inverse standard deviation of each number of z.
    scales: Vec<(f64, f64)>,
    /// One machine a factor; none of linear interpolation alone.
    machines: Vec<Fitted>,
}

/// Ridge's choice for each factor.
fn chosen(candidates: &[Candidates], targets: &[Vec<f64>], with_line: bool) -> Vec<Choice> {
    let mut best: Vec<Option<Choice>> = (0..3).map(|_| None).collect();
    for (c, candidate) in candidates.iter().enumerate() {
        let matrices: Vec<&DMatrix<f64>> = candidate.kernels.iter().map(|k| &k.1).collect();
        let of: Vec<usize> = match candidate.view {
            View::Own(k) => vec![k, k + 3],
            _ => (0..6).collect(),
        };
        let of: Vec<usize> = of.into_iter().filter(|&t| t < 3 || with_line).collect();
        let own: Vec<Vec<f64>> = of.iter().map(|&t| targets[t].clone()).collect();
        for (&t, (at, lambda, error)) in of.iter().zip(ridge::choose(&matrices, &own)) {
            let slot = &mut best[t % 3];
            if slot.as_ref().is_none_or(|b| error < b.error) {
                *slot = Some(Choice { at: (c, at), lambda, about_line: t >= 3, error });
            }
        }
    }
    best.into_iter().flatten().collect()
}

impl Learner {
    /// Fits to examples, with everything that is free chosen by ten-fold cross-validation over them.
    pub fn fit(method: Method, known: &Known, examples: &[Example]) -> Self {
        let mut learners = Self::fit_all(&[method], known, examples);
        learners.remove(0)
    }

    /// Fits by each of some methods: kernel ridge's choices are where the support vectors' begin.
    fn fit_all(methods: &[Method], known: &Known, examples: &[Example]) -> Vec<Self> {
        let inputs: Vec<Vec<f64>> =
            examples.iter().map(|e| known.input(e.first, e.second, e.alpha)).collect();
        let scales = scales(&inputs);
        let z: Vec<Vec<f64>> = inputs.iter().map(|i| scaled(&scales, i)).collect();
        // The Efforts, and behind them what they deviate from interpolation by.
        let line = |e: &Example| known.interpolated(e.first, e.second, e.alpha);
        let targets: Vec<Vec<f64>> = (0..6)
            .map(|k| {
                let less = |e: &Example| if k < 3 { 0.0 } else { line(e)[k % 3] };
                examples.iter().map(|e| e.effort[k % 3] - less(e)).collect()
            })
            .collect();
        let target = |k: usize, about_line: bool| &targets[if about_line { k + 3 } else { k }];
        let radial = |width: usize| gammas(width).map(Kernel::Radial).collect();
        let curved = || -> (Vec<Candidates>, Vec<Choice>) {
            let views = [View::All, View::Efforts, View::Own(0), View::Own(1), View::Own(2)];
            let candidates: Vec<Candidates> = views.iter().map(|&v| Candidates::of(v, &z, radial)).collect();
            let choices = chosen(&candidates, &targets, true);
            (candidates, choices)
        };
        let mut curves: Option<(Vec<Candidates>, Vec<Choice>)> = None;
        methods
            .iter()
            .map(|method| {
                let machines = match method {
                    Method::LinearInterpolation => Vec::new(),
                    Method::LinearRidge => {
                        let candidates = [Candidates::of(View::All, &z, |_| vec![Kernel::Linear])];
                        let choices = chosen(&candidates, &targets, false);
                        ridges(&candidates, &choices, target)
                    }
                    Method::KernelRidge => {
                        let (candidates, choices) = curves.get_or_insert_with(curved);
                        ridges(candidates, choices, target)
                    }
                    Method::SupportVector => {
                        let (candidates, choices) = curves.get_or_insert_with(curved);
                        supports(candidates, choices, target)
                    }
                };
                Self { scales: scales.clone(), machines }
            })
            .collect()
    }

    /// The Effort of a blend.
    pub fn predict(&self, known: &Known, first: usize, second: usize, alpha: f64) -> Factors {
        if self.machines.is_empty() {
            return known.interpolated(first, second, alpha);
        }
        let z = scaled(&self.scales, &known.input(first, second, alpha));
        let line = known.interpolated(first, second, alpha);
        std::array::from_fn(|k| {
            let fitted = &self.machines[k];
            fitted.machine.predict(&fitted.view.of(&z)) + if fitted.about_line { line[k] } else { 0.0 }
        })
    }
}

/// Ridge with what was chosen.
fn ridges<'a>(
    candidates: &[Candidates],
    choices: &[Choice],
    target: impl Fn(usize, bool) -> &'a Vec<f64>,
) -> Vec<Fitted> {
    let fit = |(k, choice): (usize, &Choice)| {
        let candidate = &candidates[choice.at.0];
        let kernel = candidate.kernels[choice.at.1].0;
        let machine = ridge::fit(kernel, choice.lambda, &candidate.z, target(k, choice.about_line));
        Fitted { view: candidate.view, machine, about_line: choice.about_line }
    };
    choices.iter().enumerate().map(fit).collect()
}

/// Support vectors with ridge's view, and its kernel or one of the two beside it: what to look at, and how widely, is a
/// matter of the data more than of the loss.
fn supports<'a>(
    candidates: &[Candidates],
    choices: &[Choice],
    target: impl Fn(usize, bool) -> &'a Vec<f64>,
) -> Vec<Fitted> {
    let fit = |(k, choice): (usize, &Choice)| {
        let candidate = &candidates[choice.at.0];
        let y = target(k, choice.about_line);
        let at = choice.at.1;
        let near = &candidate.kernels[at.saturating_sub(1)..(at + 2).min(candidate.kernels.len())];
        let matrices: Vec<&DMatrix<f64>> = near.iter().map(|k| &k.1).collect();
        let (index, parameters, _) = support::choose(&matrices, y);
        let machine = support::fit(near[index].0, parameters, &candidate.z, y);
        Fitted { view: candidate.view, machine, about_line: choice.about_line }
    };
    choices.iter().enumerate().map(fit).collect()
}

fn scales(inputs: &[Vec<f64>]) -> Vec<(f64, f64)> {
    let n = inputs.len().max(1) as f64;
    (0..inputs.first().map_or(0, Vec::len))
        .map(|d| {
            let mean = inputs.iter().map(|i| i[d]).sum::<f64>() / n;
            let variance = inputs.iter().map(|i| (i[d] - mean).powi(2)).sum::<f64>() / n;
            (mean, 1.0 / variance.sqrt().max(1e-6))
        })
        .collect()
}

fn scaled(scales: &[(f64, f64)], input: &[f64]) -> Vec<f64> {
    input.iter().zip(scales).map(|(v, (mean, inverse))| (v - mean) * inverse).collect()
}

/// Mean squared errors of each method and factor over random splits, in the order of [`Method::ALL`]. `progress` is called once a split.
pub fn table(
    known: &Known,
    examples: &[Example],
    train: usize,
    splits: usize,
    seed: u64,
    progress: &(dyn Fn() + Sync),
) -> Vec<Factors> {
    let errors: Vec<Vec<Factors>> = (0..splits)
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
        .collect();
    (0..Method::ALL.len())
        .map(|m| std::array::from_fn(|k| errors.iter().map(|e| e[m][k]).sum::<f64>() / splits.max(1) as f64))
        .collect()
}

/// Pearson's correlation; 0 where one side does not vary.
pub fn correlation(a: &[f64], b: &[f64]) -> f64 {
    let n = a.len().max(1) as f64;
    let (ma, mb) = (a.iter().sum::<f64>() / n, b.iter().sum::<f64>() / n);
    let dot = |x: &[f64], mx: f64, y: &[f64], my: f64| -> f64 {
        x.iter().zip(y).map(|(x, y)| (x - mx) * (y - my)).sum()
    };
    let scale = (dot(a, ma, a, ma) * dot(b, mb, b, mb)).sqrt();
    if scale > 0.0 { dot(a, ma, b, mb) / scale } else { 0.0 }
}

/// Spearman's rank correlation: Pearson's of the ranks, ties sharing theirs.
pub fn rank_correlation(a: &[f64], b: &[f64]) -> f64 {
    correlation(&ranks(a), &ranks(b))
}

fn ranks(values: &[f64]) -> Vec<f64> {
    values
        .iter()
        .map(|v| {
            let below = values.iter().filter(|o| *o < v).count() as f64;
            let equal = values.iter().filter(|o| *o == v).count() as f64;
            below + 0.5 * (equal - 1.0)
        })
        .collect()
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
        let errors = table(&known, &examples, 48, 4, 7, &|| {});
        assert!(errors[0][0] < 1e-20 && errors[0][2] < 1e-20);
        // Half a parabola of height 2 about its middle is off by 0.4 and more.
        assert!(errors[0][1] > 0.4, "{errors:?}");
        for kernel in [2, 3] {
            assert!(errors[kernel][1] < 0.8 * errors[0][1], "{errors:?}");
        }
        let (known, straight) = data(0.0);
        assert!(table(&known, &straight, 48, 2, 7, &|| {})[0].iter().all(|e| *e < 1e-20));
    }

    #[test]
    fn ranks_are_what_counts() {
        assert!((rank_correlation(&[1.0, 2.0, 3.0, 4.0], &[0.1, 0.2, 5.0, 99.0]) - 1.0).abs() < 1e-12);
        assert!(
            (rank_correlation(&[1.0, 2.0, 3.0, 4.0], &[1.0, 1.0, 2.0, 2.0]) - 0.894_427_191).abs() < 1e-6
        );
        assert!((rank_correlation(&[1.0, 2.0, 3.0], &[3.0, 2.0, 1.0]) + 1.0).abs() < 1e-12);
        assert_eq!(rank_correlation(&[1.0, 2.0], &[5.0, 5.0]), 0.0);
    }
}
