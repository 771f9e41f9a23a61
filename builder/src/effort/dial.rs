//! The effort dial: which mix of styles comes nearest to an Effort, solved at the nodes of a grid for the core to look
//! up (`gestus_core::effort`).
//!
//! Labelled fragments and blends say what mixes of styles look like: a fragment of style s is the mix `1_s`, a blend
//! `(1-α) 1_s + α 1_t`. The Efforts `G` of the styles are the least-squares fit of `G w = e` over all of them, so that
//! what blends were seen as counts as much as what their ends were. A node's mix is
//!
//! ```text
//! w(e) = least of |S⁻¹ (G w - e)|² + 2 mean over actions of |S⁻¹ (G_a - G) w|² + ε |w|²   over  w >= 0, Σ w = 1
//! ```
//!
//! with S the ranges of the factors, so that each counts alike, and G_a the mean Efforts of the styles in one action: a
//! mix that looks strong in a walk and light in a run is of little use on a dial that knows no actions. The last penalty makes it unique and continuous: of mixes that look
//! alike it takes the one that is spread over most styles. And it is monotone: for two targets that differ in one
//! factor the mixes satisfy `(e - e')ᵀ S⁻² (G w - G w') >= 0`, so no factor ever goes against its own knob. What is
//! stored are bytes; [`Dial::backsteps`] says by how much rounding undoes that (a hundredth of the range at most).

use gestus_core::blob::layout::{MAX_STYLES, effort};
use nalgebra::{DMatrix, DVector};
use serde_json::{Value, json};

use super::{Factors, NAMES, Source, model::Model};

/// Nodes along each axis.
pub const NODES: usize = 9;
/// Penalty on the mix, in units of squared ranges.
const PENALTY: f64 = 2e-3;
/// Weight of what differs from action to action.
const UNEVEN: f64 = 2.0;
/// Steps of the projected gradient.
const STEPS: usize = 600;
/// Shortest axis.
const SHORTEST: f64 = 0.05;

/// A solved dial.
#[derive(Debug, Clone, PartialEq)]
pub struct Dial {
    /// Where the Efforts come from.
    pub source: Source,
    /// Effort of each style; `None` of styles that nothing is known of.
    pub styles: Vec<Option<Factors>>,
    /// Effort at rest.
    pub rest: Factors,
    /// Ends of the axes.
    pub axes: [(f64, f64); 3],
    /// Weights of the styles at each node, of sum 255: flow slowest, time fastest.
    pub table: Vec<Vec<u8>>,
}

/// Solves the dial of a model; `rest` is the style whose Effort unturned factors have. `None` of fewer than two styles
/// with labels, or of more than the format holds.
pub fn solve(model: &Model, rest: usize) -> Option<Dial> {
    let styles = model.library.styles.len();
    let fragments = &model.library.fragments;
    let mut samples: Vec<(Vec<f64>, Factors)> = Vec::new();
    let mut seen = vec![false; styles];
    for (fragment, effort) in fragments.iter().zip(&model.known.efforts) {
        let mut mix = vec![0.0; styles];
        mix[fragment.style] = 1.0;
        seen[fragment.style] = true;
        samples.push((mix, *effort));
    }
    for e in &model.examples {
        let mut mix = vec![0.0; styles];
        mix[fragments[e.first].style] += 1.0 - e.alpha;
        mix[fragments[e.second].style] += e.alpha;
        samples.push((mix, e.effort));
    }
    if seen.iter().filter(|s| **s).count() < 2 || styles > MAX_STYLES {
        return None;
    }
    let efforts = fit(&samples, styles);
    let known: Vec<Option<Factors>> = efforts.into_iter().zip(&seen).map(|(e, s)| s.then_some(e)).collect();
    Some(Dial::of_actions(model.source, known, &actions(model), rest))
}

/// Mean Effort of each style in each action that it is seen in.
fn actions(model: &Model) -> Vec<Vec<Option<Factors>>> {
    (0..model.library.actions.len())
        .map(|action| {
            (0..model.library.styles.len())
                .map(|style| {
                    let fragments = model.library.fragments.iter().zip(&model.known.efforts);
                    let own: Vec<&Factors> = fragments
                        .filter(|(f, _)| (f.action, f.style) == (action, style))
                        .map(|(_, e)| e)
                        .collect();
                    let mean = |k: usize| own.iter().map(|e| e[k]).sum::<f64>() / own.len() as f64;
                    (!own.is_empty()).then(|| [mean(0), mean(1), mean(2)])
                })
                .collect()
        })
        .collect()
}

/// Least squares, with as little penalty as keeps styles without samples at zero.
fn fit(samples: &[(Vec<f64>, Factors)], styles: usize) -> Vec<Factors> {
    let mut normal = DMatrix::<f64>::identity(styles, styles) * 1e-6;
    let mut right = DMatrix::<f64>::zeros(styles, 3);
    for (mix, effort) in samples {
        let w = DVector::from_row_slice(mix);
        normal += &w * w.transpose();
        right += &w * nalgebra::RowVector3::from_row_slice(effort);
    }
    let solved = normal.lu().solve(&right).unwrap_or_else(|| DMatrix::zeros(styles, 3));
    (0..styles).map(|s| [solved[(s, 0)], solved[(s, 1)], solved[(s, 2)]]).collect()
}

impl Dial {
    /// The dial of styles with those Efforts; `None` for styles that are not to be used.
    ///
    /// # Panics
    /// Where no style has an Effort.
    pub fn new(source: Source, styles: Vec<Option<Factors>>, rest: usize) -> Self {
        Self::of_actions(source, styles, &[], rest)
    }

    /// The same, with the styles' Efforts in each of some actions, `[actions][styles]`: mixes that look alike in all of
    /// them are preferred.
    ///
    /// # Panics
    /// Where no style has an Effort.
    pub fn of_actions(
        source: Source,
        styles: Vec<Option<Factors>>,
        actions: &[Vec<Option<Factors>>],
        rest: usize,
    ) -> Self {
        use rayon::prelude::*;
        let used: Vec<usize> = (0..styles.len()).filter(|&s| styles[s].is_some()).collect();
        let efforts: Vec<Factors> = styles.iter().flatten().copied().collect();
        let axes = std::array::from_fn(|k| {
            let values = efforts.iter().map(|e| e[k]);
            let (low, high) =
                values.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), v| (l.min(v), h.max(v)));
            // An axis along which no style differs still needs a length.
            let air = (0.5 * (SHORTEST - (high - low))).max(0.0);
            (low - air, high + air)
        });
        let rest = styles.get(rest).copied().flatten().unwrap_or(efforts[0]);
        let scales: Factors = axes.map(|(low, high): (f64, f64)| 1.0 / (high - low));
        // How much the styles' Efforts differ from action to action.
        let mut spread = DMatrix::<f64>::zeros(used.len(), used.len());
        for action in actions {
            let off = DMatrix::from_fn(3, used.len(), |k, i| {
                action[used[i]].map_or(0.0, |e| scales[k] * (e[k] - efforts[i][k]))
            });
            spread += off.tr_mul(&off) * (UNEVEN / actions.len() as f64);
        }
        let place = |k: usize, i: usize| axes[k].0 + (axes[k].1 - axes[k].0) * i as f64 / (NODES - 1) as f64;
        let table = (0..NODES.pow(3))
            .into_par_iter()
            .map(|node| {
                let target =
                    [place(0, node / NODES.pow(2)), place(1, node / NODES % NODES), place(2, node % NODES)];
                let mix = nearest(&efforts, &scales, &spread, &target);
                let mut weights = vec![0.0; styles.len()];
                used.iter().zip(mix).for_each(|(&s, w)| weights[s] = w);
                bytes(&weights)
            })
            .collect();
        Self { source, styles, rest, axes, table }
    }

    /// The section of the blob.
    pub fn section(&self) -> Vec<u8> {
        let mut out = Vec::new();
        for _ in 0..3 {
            out.extend((NODES as u16).to_le_bytes());
        }
        out.push(if self.source == Source::Given { effort::GIVEN } else { effort::ESTIMATED });
        out.push(0);
        let ends = self.axes.iter().flat_map(|&(low, high)| [low, high]);
        let efforts = self.styles.iter().flat_map(|e| e.unwrap_or(self.rest));
        for v in ends.chain(self.rest).chain(efforts) {
            out.extend((v as f32).to_le_bytes());
        }
        out.extend(self.table.iter().flatten());
        out
    }

    /// The Effort of the mix at a node.
    fn reached(&self, node: usize) -> Factors {
        std::array::from_fn(|k| {
            let of = |(w, e): (&u8, &Option<Factors>)| f64::from(*w) / 255.0 * e.map_or(0.0, |e| e[k]);
            self.table[node].iter().zip(&self.styles).map(of).sum()
        })
    }

    /// The largest step against its own knob that any factor takes from node to node, as a share of its range.
    pub fn backsteps(&self) -> f64 {
        let mut worst = 0.0f64;
        for node in 0..self.table.len() {
            for (k, stride) in [NODES.pow(2), NODES, 1].into_iter().enumerate() {
                if node / stride % NODES + 1 < NODES {
                    let change = self.reached(node + stride)[k] - self.reached(node)[k];
                    worst = worst.max(-change / (self.axes[k].1 - self.axes[k].0));
                }
            }
        }
        worst
    }

    /// The share of the grid's nodes that are reached within the core's tolerance: how much of the box the styles fill.
    pub fn filled(&self) -> f64 {
        let place = |k: usize, i: usize| {
            self.axes[k].0 + (self.axes[k].1 - self.axes[k].0) * i as f64 / (NODES - 1) as f64
        };
        let near = |node: &usize| {
            let target = [node / NODES.pow(2), node / NODES % NODES, node % NODES];
            let reached = self.reached(*node);
            (0..3).all(|k| {
                (reached[k] - place(k, target[k])).abs() <= f64::from(gestus_core::effort::TOLERANCE)
            })
        };
        (0..self.table.len()).filter(near).count() as f64 / self.table.len() as f64
    }

    /// What it can do, as JSON.
    pub fn report(&self, names: &[String]) -> Value {
        let range: serde_json::Map<String, Value> = NAMES
            .iter()
            .zip(&self.axes)
            .map(|(n, (low, high))| ((*n).to_owned(), json!([low, high])))
            .collect();
        let styles: serde_json::Map<String, Value> = names
            .iter()
            .zip(&self.styles)
            .filter_map(|(n, e)| Some((n.clone(), json!(e.as_ref()?))))
            .collect();
        json!({
            "labels": self.source.name(),
            "range": range,
            "rest": self.rest,
            "styles": styles,
            "filled": self.filled(),
            "backsteps": self.backsteps(),
        })
    }
}

/// The mix nearest to a target, by accelerated projected gradient (Nesterov's steps, Duchi's projection).
fn nearest(efforts: &[Factors], scales: &Factors, spread: &DMatrix<f64>, target: &Factors) -> Vec<f64> {
    let n = efforts.len();
    let at = |w: &[f64]| -> Factors {
        std::array::from_fn(|k| {
            scales[k] * (efforts.iter().zip(w).map(|(e, w)| e[k] * w).sum::<f64>() - target[k])
        })
    };
    // The gradient changes at most this fast: twice the trace bounds the largest eigenvalue.
    let trace: f64 = efforts.iter().map(|e| (0..3).map(|k| (scales[k] * e[k]).powi(2)).sum::<f64>()).sum();
    let step = 0.5 / (trace + spread.trace() + PENALTY);
    let mut w = vec![1.0 / n as f64; n];
    let (mut ahead, mut momentum) = (w.clone(), 1.0f64);
    for _ in 0..STEPS {
        let off = at(&ahead);
        let uneven = spread * DVector::from_column_slice(&ahead);
        let moved: Vec<f64> = ahead
            .iter()
            .zip(efforts)
            .zip(uneven.iter())
            .map(|((w, e), uneven)| {
                let pull = (0..3).map(|k| scales[k] * e[k] * off[k]).sum::<f64>();
                let gradient = 2.0 * (pull + uneven + PENALTY * w);
                w - step * gradient
            })
            .collect();
        let next = onto_simplex(&moved);
        let faster = 0.5 * (1.0 + (1.0 + 4.0 * momentum * momentum).sqrt());
        let carry = (momentum - 1.0) / faster;
        ahead = next.iter().zip(&w).map(|(n, w)| n + carry * (n - w)).collect();
        (w, momentum) = (next, faster);
    }
    w
}

/// The nearest point with `w >= 0` and `Σ w = 1`.
fn onto_simplex(v: &[f64]) -> Vec<f64> {
    let mut sorted = v.to_vec();
    sorted.sort_by(|a, b| b.total_cmp(a));
    let (mut sum, mut cut) = (0.0, 0.0);
    for (i, value) in sorted.iter().enumerate() {
        sum += value;
        let tried = (sum - 1.0) / (i + 1) as f64;
        if *value > tried {
            cut = tried;
        }
    }
    v.iter().map(|v| (v - cut).max(0.0)).collect()
}

/// Weights as bytes of sum 255: rounded down, and what is missing to those that lost most.
fn bytes(weights: &[f64]) -> Vec<u8> {
    let total: f64 = weights.iter().sum();
    let exact: Vec<f64> = weights.iter().map(|w| w / total * 255.0).collect();
    let mut out: Vec<u8> = exact.iter().map(|w| w.floor() as u8).collect();
    let missing = 255 - out.iter().map(|b| usize::from(*b)).sum::<usize>();
    let mut order: Vec<usize> = (0..out.len()).collect();
    order.sort_by(|&a, &b| (exact[b] - exact[b].floor()).total_cmp(&(exact[a] - exact[a].floor())));
    for &i in order.iter().take(missing) {
        out[i] += 1;
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    fn efforts() -> Vec<Option<Factors>> {
        vec![
            Some([0.0, 0.0, 0.0]),
            Some([-0.5, 1.8, 1.5]),
            None,
            Some([1.0, -1.2, -1.6]),
            Some([0.8, 0.9, -0.4]),
        ]
    }

    #[test]
    fn no_mix_on_a_fine_lattice_is_nearer() {
        let efforts: Vec<Factors> = efforts().into_iter().flatten().collect();
        let scales = [0.7, 0.3, 0.35];
        let uneven = DMatrix::from_fn(3, 4, |i, j| 0.1 * ((3 * i + 5 * j) % 4) as f64);
        let spread = uneven.tr_mul(&uneven);
        let misfit = |w: &[f64], e: &Factors| {
            let off = (0..3).map(|k| {
                (scales[k] * (efforts.iter().zip(w).map(|(s, w)| s[k] * w).sum::<f64>() - e[k])).powi(2)
            });
            let w = DVector::from_column_slice(w);
            off.sum::<f64>() + PENALTY * w.norm_squared() + (w.transpose() * &spread * &w)[0]
        };
        for target in [[0.2, 0.3, 0.1], [2.0, 2.0, 2.0], [-0.4, -1.0, 1.0]] {
            let found = misfit(&nearest(&efforts, &scales, &spread, &target), &target);
            for a in 0..=20 {
                for b in 0..=20 - a {
                    for c in 0..=20 - a - b {
                        let w = [a, b, c, 20 - a - b - c].map(|v| f64::from(v) / 20.0);
                        assert!(found <= misfit(&w, &target) + 1e-6, "{target:?}: {w:?}");
                    }
                }
            }
        }
    }

    #[test]
    fn every_knob_moves_its_factor_and_never_back() {
        let dial = Dial::new(Source::Estimated, efforts(), 0);
        assert!(dial.backsteps() < 0.01, "{}", dial.backsteps());
        assert!(dial.table.iter().all(|w| w.iter().map(|b| u16::from(*b)).sum::<u16>() == 255 && w[2] == 0));
        assert!(dial.filled() > 0.05 && dial.filled() < 1.0, "{}", dial.filled());
        assert_eq!(dial.rest, [0.0; 3]);
        for k in 0..3 {
            let stride = [NODES * NODES, NODES, 1][k];
            let middle = NODES * NODES * 4 + NODES * 4 + 4;
            let (low, high) = (middle - 4 * stride, middle + 4 * stride);
            assert!(dial.reached(high)[k] > dial.reached(low)[k] + 0.2, "{k}");
        }
    }

    #[test]
    fn efforts_of_styles_come_from_blends_too() {
        let mix = |s: usize, t: usize, a: f64| {
            let mut w = vec![0.0; 3];
            w[s] += 1.0 - a;
            w[t] += a;
            w
        };
        let truth = [[1.0, 2.0, -1.0], [0.0, -1.0, 0.5], [2.0, 0.3, 0.7]];
        let samples: Vec<(Vec<f64>, Factors)> =
            [(0, 1, 0.3), (1, 2, 1.2), (2, 0, -0.2), (0, 2, 0.6), (1, 0, 0.5)]
                .map(|(s, t, a)| {
                    (mix(s, t, a), std::array::from_fn(|k| (1.0 - a) * truth[s][k] + a * truth[t][k]))
                })
                .into();
        for (found, wanted) in fit(&samples, 3).iter().zip(truth) {
            assert!(found.iter().zip(wanted).all(|(f, w)| (f - w).abs() < 1e-4), "{found:?}");
        }
    }
}
