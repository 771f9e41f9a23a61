//! From a pair and α to the Effort of its blend: four ways to learn it, and the table that compares them (paper 003,
//! section 6 and Table 1).
//!
//! The input is `z = [c_i, c_j, e_i, e_j, α]`: components and Efforts of both fragments, and α; each number is taken to
//! mean 0 and variance 1 over the training examples. Linear interpolation, `(1-α) e_i + α e_j`, learns nothing and is
//! what earlier work assumes. It is also a good place to start from: the kernel methods learn the Effort itself, as the
//! paper has it, or its deviation from interpolation, whichever cross-validation finds better.

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

/// A fitted function.
#[derive(Debug, Clone)]
pub struct Learner {
    /// Mean and inverse standard deviation of each number of z.
    scales: Vec<(f64, f64)>,
    /// One machine a factor, and whether it adds to linear interpolation; none of linear interpolation alone.
    machines: Vec<(Machine, bool)>,
}

impl Learner {
    /// Fits to examples, with everything that is free chosen by ten-fold cross-validation over them.
    pub fn fit(method: Method, known: &Known, examples: &[Example]) -> Self {
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
        let radial: Vec<Kernel> = gammas(scales.len()).map(Kernel::Radial).collect();
        let machines = match method {
            Method::LinearInterpolation => Vec::new(),
            Method::LinearRidge => {
                let chosen = ridge::choose(&[Kernel::Linear], &z, &targets[..3]);
                let fit =
                    |(&(k, l, _), y): (&(Kernel, f64, f64), &Vec<f64>)| (ridge::fit(k, l, &z, y), false);
                chosen.iter().zip(&targets).map(fit).collect()
            }
            Method::KernelRidge => {
                let chosen = ridge::choose(&radial, &z, &targets);
                (0..3)
                    .map(|k| {
                        let about_line = chosen[3 + k].2 < chosen[k].2;
                        let pick = if about_line { 3 + k } else { k };
                        (ridge::fit(chosen[pick].0, chosen[pick].1, &z, &targets[pick]), about_line)
                    })
                    .collect()
            }
            Method::SupportVector => {
                // Ridge's kernel and its neighbors: the width is a matter of the data more than of the loss.
                let near = ridge::choose(&radial, &z, &targets);
                (0..3)
                    .map(|k| {
                        let about_line = near[3 + k].2 < near[k].2;
                        let pick = if about_line { 3 + k } else { k };
                        let at = radial.iter().position(|r| *r == near[pick].0).unwrap_or(0);
                        let kernels = &radial[at.saturating_sub(1)..(at + 2).min(radial.len())];
                        let (kernel, parameters, _) = support::choose(kernels, &z, &targets[pick]);
                        (support::fit(kernel, parameters, &z, &targets[pick]), about_line)
                    })
                    .collect()
            }
        };
        Self { scales, machines }
    }

    /// The Effort of a blend.
    pub fn predict(&self, known: &Known, first: usize, second: usize, alpha: f64) -> Factors {
        if self.machines.is_empty() {
            return known.interpolated(first, second, alpha);
        }
        let z = scaled(&self.scales, &known.input(first, second, alpha));
        let line = known.interpolated(first, second, alpha);
        std::array::from_fn(|k| {
            let (machine, about_line) = &self.machines[k];
            machine.predict(&z) + if *about_line { line[k] } else { 0.0 }
        })
    }
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
            let errors = Method::ALL
                .iter()
                .map(|&method| {
                    let learner = Learner::fit(method, known, train);
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
