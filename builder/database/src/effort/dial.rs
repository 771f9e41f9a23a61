//! The effort dial: the mix of styles nearest to an Effort, tabulated at the nodes of a grid that the core interpolates
//! (`gestus_core::stylizer::effort_dial`).
//!
//! There are two ways to fill the table. [`response::solve`](super::response::solve) measures: on the axes through the
//! node at rest, where a single factor changes, a node has the mix at which the core's output showed the target change
//! ([`Dial::measured`]). Elsewhere the changes along the axes are added and projected onto valid mixes (no weight below 0,
//! sum 1). [`Dial::new`] only uses the styles' Efforts `G`:
//!
//! ```text
//! w(e) = least of |S⁻¹ (G w - e)|² + ε |w|²   over  w >= 0, Σ w = 1
//! ```
//!
//! with S the ranges of the factors, which makes them comparable. The penalty makes the solution unique and continuous. It
//! is monotone if mixes follow `G w`: `(e - e')ᵀ S⁻² (G w - G w') >= 0`. Real mixes deviate from that, which is why
//! measuring is the default. Weights are stored as bytes; a test bounds how far rounding violates monotonicity.

use gestus_core::{
    Database,
    blob::layout::effort,
    stylizer::effort_dial::{Effort, TOLERANCE},
};
use nalgebra::{DMatrix, DVector};

use crate::effort::{Factors, POLE, Source};
use gestus_motion::statistics::extent;

/// Nodes along each axis.
pub const NODES: usize = 9;
/// Penalty on the mix, in units of squared ranges.
const PENALTY: f64 = 2e-3;
/// Steps of the projected gradient.
const STEPS: usize = 600;
/// Shortest axis.
const MIN_AXIS: f64 = 0.05;

/// A solved dial.
#[derive(Debug, Clone, PartialEq)]
pub struct Dial {
    /// Source of the Efforts.
    pub source: Source,
    /// Effort of each style; `None` if unknown.
    pub styles: Vec<Option<Factors>>,
    /// Effort at rest.
    pub rest: Factors,
    /// Ends of the axes.
    pub axes: [(f64, f64); 3],
    /// Weights of the styles at each node, of sum 255: flow slowest, time fastest.
    pub table: Vec<Vec<u8>>,
}

/// Range of one factor in one direction from the rest.
#[derive(Debug, Clone, Default)]
pub struct Reach {
    /// Mean change of the factor at each step, ascending from 0, in either direction.
    pub course: Vec<f64>,
    /// The mix at each step; the first is that at rest.
    pub mixes: Vec<Vec<f64>>,
    /// Mean measured Effort at each step.
    pub seen: Vec<Factors>,
}

impl Reach {
    /// The change at the end.
    pub fn gain(&self) -> f64 {
        self.course.last().zip(self.course.first()).map_or(0.0, |(l, f)| l - f)
    }

    /// The mix at which a share of the whole change is reached.
    fn at(&self, share: f64) -> Option<Vec<f64>> {
        if self.course.len() < 2 {
            return self.mixes.first().cloned();
        }
        let wanted = self.course[0] + share * self.gain();
        let next = self.course.partition_point(|&v| v < wanted).clamp(1, self.course.len() - 1);
        let (low, high) = (self.course[next - 1], self.course[next]);
        let t = if high > low { ((wanted - low) / (high - low)).clamp(0.0, 1.0) } else { 0.0 };
        Some(self.mixes[next - 1].iter().zip(&self.mixes[next]).map(|(a, b)| a + t * (b - a)).collect())
    }
}

/// Weight of what a style was seen as alone, against 1 of a sample that is all of that style.
const ALONE: f64 = 1e-3;

/// Efforts of styles from those of mixes, by least squares, drawn a little to what each style was seen as `alone`. Styles
/// that are no end of a sweep have equal shares of every sample, and the samples cannot tell them apart.
fn fit(samples: &[(Vec<f64>, Factors)], alone: &[Factors]) -> Vec<Factors> {
    let styles = alone.len();
    let mut normal = DMatrix::<f64>::identity(styles, styles) * ALONE;
    let mut right = DMatrix::from_fn(styles, 3, |s, k| ALONE * alone[s][k]);
    for (mix, effort) in samples {
        let w = DVector::from_row_slice(mix);
        normal += &w * w.transpose();
        right += &w * nalgebra::RowVector3::from_row_slice(effort);
    }
    let solved = normal.lu().solve(&right).unwrap_or_else(|| DMatrix::zeros(styles, 3));
    (0..styles).map(|s| [solved[(s, 0)], solved[(s, 1)], solved[(s, 2)]]).collect()
}

/// Least difference of two styles' Efforts that tells them apart.
const APART: f64 = 1e-3;

/// Pairs of Efforts that are the same.
fn alike(efforts: &[Factors]) -> Vec<[usize; 2]> {
    let same = |a: Factors, b: Factors| a.iter().zip(b).all(|(a, b)| (a - b).abs() < APART);
    let pairs = (0..efforts.len()).flat_map(|s| (s + 1..efforts.len()).map(move |t| [s, t]));
    pairs.filter(|&[s, t]| same(efforts[s], efforts[t])).collect()
}

/// Pairs of styles, by name, that the effort dial of a database cannot tell apart.
pub fn styles_alike(database: &Database<'_>) -> Vec<[String; 2]> {
    let (Some(dial), Ok(manifest)) = (database.dial(), database.manifest()) else { return Vec::new() };
    let names: Vec<&str> = manifest.styles.iter().collect();
    let efforts: Vec<Factors> = (0..names.len()).map(|s| dial.of_style(s).factors().map(f64::from)).collect();
    let name = |s: usize| names[s].to_owned();
    alike(&efforts).into_iter().map(|pair| pair.map(name)).collect()
}

/// Narrowest range of a factor that a knob can move: the distance from its target at which a factor counts as reached.
const NARROWEST: f32 = TOLERANCE;

/// Factors whose ranges are too narrow to move them.
fn narrow(ranges: [(f32, f32); 3]) -> Vec<&'static str> {
    let names = Effort::NAMES.into_iter().zip(ranges);
    names.filter(|(_, (low, high))| high - low < NARROWEST).map(|(name, _)| name).collect()
}

/// Factors, by name, that the effort dial of a database cannot move: few styles do not change them in every action alike.
pub fn fixed_factors(database: &Database<'_>) -> Vec<&'static str> {
    database.dial().map_or_else(Vec::new, |dial| narrow(dial.range()))
}

/// What is to be said of a database whose effort dial cannot tell styles apart, or move a factor.
pub fn doubts(database: &Database<'_>) -> Vec<String> {
    let pairs = styles_alike(database);
    let list: Vec<String> = pairs.iter().map(|[one, other]| format!("{one} and {other}")).collect();
    let alike = (!list.is_empty()).then(|| {
        format!(
            "the effort dial has the same Efforts for {}, and `--effort` takes either: their clips hardly differ, or have no \
             labels (`gestus effort sheet`, `build --labels`)",
            list.join(", ")
        )
    });
    let fixed = fixed_factors(database);
    let still = (!fixed.is_empty()).then(|| {
        format!(
            "the effort dial cannot move {}: no mix of these {} styles changes it by {NARROWEST} in every action, so that \
             `--effort` does nothing there; add clips of more styles, or build with fewer actions (--actions)",
            fixed.join(", "),
            database.counts().styles
        )
    });
    alike.into_iter().chain(still).collect()
}

impl Dial {
    /// The dial of styles with those Efforts; styles with `None` are not used.
    ///
    /// # Panics
    /// If no style has an Effort.
    pub fn new(source: Source, styles: Vec<Option<Factors>>, rest: usize) -> Self {
        use rayon::prelude::*;
        let used: Vec<usize> = (0..styles.len()).filter(|&s| styles[s].is_some()).collect();
        let efforts: Vec<Factors> = styles.iter().flatten().copied().collect();
        let axes = std::array::from_fn(|k| {
            let (low, high) = extent(efforts.iter().map(|e| e[k]));
            // An axis along which no style differs still needs a length.
            let margin = (0.5 * (MIN_AXIS - (high - low))).max(0.0);
            (low - margin, high + margin)
        });
        let rest = styles.get(rest).copied().flatten().unwrap_or(efforts[0]);
        let scales: Factors = axes.map(|(low, high): (f64, f64)| 1.0 / (high - low));
        let alike = DMatrix::<f64>::zeros(used.len(), used.len());
        let table = (0..NODES.pow(3))
            .into_par_iter()
            .map(|node| {
                let target = effort_at(&axes, node);
                let mix = nearest(&efforts, &scales, &alike, &target);
                let mut weights = vec![0.0; styles.len()];
                used.iter().zip(mix).for_each(|(&s, w)| weights[s] = w);
                bytes(&weights)
            })
            .collect();
        Self { source, styles, rest, axes, table }
    }

    /// The dial of measured sweeps: how far each factor reaches down and up from the mix at rest, whose Effort is
    /// `rest`. `alone` is what each style was seen as, `None` for those that are not used.
    ///
    /// The rest is a node of each axis, as many nodes below it as make the grid finest. The last nodes are the ends of
    /// the sweeps, so that no part of an axis does nothing; those between have their share of the measured change.
    pub fn measured(
        source: Source,
        alone: &[Option<Factors>],
        rest: Factors,
        reaches: &[[Reach; 2]; 3],
    ) -> Self {
        let styles = alone.len();
        let used: Vec<usize> = (0..styles).filter(|&s| alone[s].is_some()).collect();
        let even: Vec<f64> =
            alone.iter().map(|e| if e.is_some() { 1.0 / used.len() as f64 } else { 0.0 }).collect();
        let below: [usize; 3] = std::array::from_fn(|k| {
            let gain = |side: usize| reaches[k][side].gain();
            let spacing = |below: &usize| {
                let part = |gain: f64, nodes: usize| if nodes > 0 { gain / nodes as f64 } else { 1e3 * gain };
                f64::max(part(gain(0), *below), part(gain(1), NODES - 1 - below))
            };
            (0..NODES).min_by(|a, b| spacing(a).total_cmp(&spacing(b))).unwrap_or(NODES / 2)
        });
        let axes: [(f64, f64); 3] = std::array::from_fn(|k| {
            let part = |side: usize, nodes: usize| reaches[k][side].gain() / nodes.max(1) as f64;
            let (down, up) = (below[k], NODES - 1 - below[k]);
            let least = MIN_AXIS / (NODES - 1) as f64;
            let spacing = part(0, down).max(part(1, up)).max(least);
            (rest[k] - down as f64 * spacing, rest[k] + up as f64 * spacing)
        });
        // The change of the mix at each node of each line.
        let lines: [Vec<Vec<f64>>; 3] = std::array::from_fn(|k| {
            (0..NODES)
                .map(|i| {
                    let (side, steps, of) = match i.checked_sub(below[k]) {
                        None => (0, below[k] - i, below[k]),
                        Some(up) => (1, up, NODES - 1 - below[k]),
                    };
                    let mix = reaches[k][side].at(steps as f64 / of.max(1) as f64);
                    mix.map_or_else(
                        || vec![0.0; styles],
                        |m| m.iter().zip(&even).map(|(m, e)| m - e).collect(),
                    )
                })
                .collect()
        });
        let table = (0..NODES.pow(3))
            .map(|node| {
                let at = [node / NODES.pow(2), node / NODES % NODES, node % NODES];
                let sum: Vec<f64> =
                    used.iter().map(|&s| even[s] + (0..3).map(|k| lines[k][at[k]][s]).sum::<f64>()).collect();
                let mut weights = vec![0.0; styles];
                used.iter().zip(onto_simplex(&sum)).for_each(|(&s, w)| weights[s] = w);
                bytes(&weights)
            })
            .collect();
        let samples: Vec<(Vec<f64>, Factors)> = reaches
            .iter()
            .flatten()
            .flat_map(|r| r.mixes.iter().cloned().zip(r.seen.iter().copied()))
            .collect();
        // The format holds numbers up to 10; a style that stands in few mixes may be fitted beyond.
        let held = |e: Factors| e.map(|v| v.clamp(-3.0 * POLE, 3.0 * POLE));
        let seen: Vec<Factors> = alone.iter().map(|e| e.unwrap_or_default()).collect();
        let efforts = fit(&samples, &seen).into_iter().map(held);
        let styles = efforts.zip(alone).map(|(fitted, used)| used.map(|_| fitted)).collect();
        Self { source, styles, rest, axes, table }
    }

    /// Encodes the section of the blob.
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
}

/// The Effort of a node.
fn effort_at(axes: &[(f64, f64); 3], node: usize) -> Factors {
    let at = [node / NODES.pow(2), node / NODES % NODES, node % NODES];
    std::array::from_fn(|k| axes[k].0 + (axes[k].1 - axes[k].0) * at[k] as f64 / (NODES - 1) as f64)
}

/// The mix nearest to a target, with a penalty on `wᵀ spread w`, by accelerated projected gradient (Nesterov's steps,
/// Duchi's projection).
pub(super) fn nearest(
    efforts: &[Factors],
    scales: &Factors,
    spread: &DMatrix<f64>,
    target: &Factors,
) -> Vec<f64> {
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
mod tests;
