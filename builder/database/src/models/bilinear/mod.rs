//! A gait cycle as a function of style and speed: bilinear analysis (Hsu 2005, section 5.1; Tenenbaum and Freeman
//! 2000; Vasilescu 2002).
//!
//! One cycle of every style and speed is warped onto a reference cycle by iterative motion warping and written as one
//! vector of its dofs and the logarithm of its time warp. The tensor `[styles][speeds][vector]`, minus its mean, is
//! factored by the singular value decompositions of its two unfoldings:
//!
//! `vector(a, b) = mean + Σ_ij a_i b_j core_ij`
//!
//! A style is a coordinate vector `a`, a speed a coordinate vector `b`; other styles and speeds are
//! interpolated or extrapolated in the coordinates. The cycle is closed and repeated.

mod cuts;
mod error;
mod walk;

use gestus_motion::{
    body::Body,
    corpus::Corpus,
    statistics::{dot, mean},
};
use nalgebra::{DMatrix, SymmetricEigen};

pub use cuts::{Cut, SPEEDS, aligned, at_quantile, by_speed, cuts};
pub use error::BilinearError;
pub use walk::LoopCycle;

use crate::registration::warp::WarpError;

/// The bilinear model.
#[derive(Debug, Clone)]
pub struct Bilinear {
    frames: usize,
    dofs: usize,
    rate_hz: f64,
    mean: Vec<f64>,
    /// Coordinates of each style, `[styles x styles]`, and of each speed, `[speeds x speeds]`.
    styles: DMatrix<f64>,
    speeds: DMatrix<f64>,
    /// `[styles][speeds]` of vectors.
    core: Vec<Vec<Vec<f64>>>,
    /// Mean forward speed of slow, medium and fast cycles over all styles, metres a second.
    pub speeds_m_s: Vec<f64>,
    /// Share of the variance that each style coordinate, and each speed coordinate, explains.
    pub explained: [Vec<f64>; 2],
}

impl Bilinear {
    /// The model of an action; `reference` is the style whose medium cycle the others are warped onto.
    ///
    /// # Errors
    /// [`BilinearError`] where a style has too few cycles.
    pub fn of(corpus: &Corpus, body: &Body, action: usize, reference: usize) -> Result<Self, BilinearError> {
        let all: Vec<Vec<Cut>> =
            (0..corpus.styles.len()).map(|s| cuts(corpus, body, action, s)).collect::<Result<_, _>>()?;
        Self::of_cuts(&corpus.styles, &all, &all[reference][1], corpus.rate_hz)
    }

    /// The model of cycles of all styles at two or more speeds, the slowest first, shape `[styles][speeds]`; all are
    /// warped onto `base`.
    ///
    /// # Errors
    /// [`BilinearError::Lengths`] and [`BilinearError::Warp`] where a cycle can't be warped.
    pub fn of_cuts(
        styles: &[String],
        all: &[Vec<Cut>],
        base: &Cut,
        rate_hz: f64,
    ) -> Result<Self, BilinearError> {
        let mut tensor = Vec::new();
        for (style, cuts) in styles.iter().zip(all) {
            let vector =
                |cut: &Cut| aligned(base, cut, rate_hz).map_err(|error| unaligned(style, [cut, base], error));
            tensor.push(cuts.iter().map(vector).collect::<Result<Vec<_>, _>>()?);
        }
        let speeds_m_s = (0..all[0].len()).map(|v| mean(all.iter().map(|c| c[v].speed))).collect();
        Ok(Self::analyse(&tensor, base.rows.len() - 1, base.rows[0].len(), rate_hz, speeds_m_s))
    }

    fn analyse(
        tensor: &[Vec<Vec<f64>>],
        frames: usize,
        dofs: usize,
        rate_hz: f64,
        speeds_m_s: Vec<f64>,
    ) -> Self {
        let (styles, speeds, length) = (tensor.len(), tensor[0].len(), tensor[0][0].len());
        let count = (styles * speeds) as f64;
        let mean: Vec<f64> =
            (0..length).map(|k| tensor.iter().flatten().map(|v| v[k]).sum::<f64>() / count).collect();
        let centred: Vec<Vec<Vec<f64>>> = tensor
            .iter()
            .map(|row| row.iter().map(|v| v.iter().zip(&mean).map(|(a, b)| a - b).collect()).collect())
            .collect();
        let by_style = DMatrix::from_fn(styles, styles, |a, b| {
            (0..speeds).map(|v| dot(&centred[a][v], &centred[b][v])).sum()
        });
        let by_speed = DMatrix::from_fn(speeds, speeds, |a, b| {
            (0..styles).map(|s| dot(&centred[s][a], &centred[s][b])).sum()
        });
        let (style_axes, style_share) = axes(by_style);
        let (speed_axes, speed_share) = axes(by_speed);
        let core = (0..styles)
            .map(|i| {
                (0..speeds)
                    .map(|j| {
                        let mut sum = vec![0.0; length];
                        for (s, row) in centred.iter().enumerate() {
                            for (v, vector) in row.iter().enumerate() {
                                let weight = style_axes[(s, i)] * speed_axes[(v, j)];
                                sum.iter_mut().zip(vector).for_each(|(a, b)| *a += weight * b);
                            }
                        }
                        sum
                    })
                    .collect()
            })
            .collect();
        Self {
            frames,
            dofs,
            rate_hz,
            mean,
            styles: style_axes,
            speeds: speed_axes,
            core,
            speeds_m_s,
            explained: [style_share, speed_share],
        }
    }
}

/// Why a cycle can't be warped onto another.
fn unaligned(style: &str, cuts: [&Cut; 2], error: WarpError) -> BilinearError {
    let (style, [frames, base]) = (style.to_owned(), cuts.map(|cut| cut.rows.len() - 1));
    match error {
        WarpError::Lengths { slope, .. } => BilinearError::Lengths { style, frames, base, slope },
        source => BilinearError::Warp { style, source },
    }
}

/// Eigenvectors of a symmetric matrix, largest first, and the share of each.
fn axes(matrix: DMatrix<f64>) -> (DMatrix<f64>, Vec<f64>) {
    let eigen = SymmetricEigen::new(matrix);
    let mut order: Vec<usize> = (0..eigen.eigenvalues.len()).collect();
    order.sort_by(|&a, &b| eigen.eigenvalues[b].total_cmp(&eigen.eigenvalues[a]));
    let total: f64 = eigen.eigenvalues.iter().map(|v| v.max(0.0)).sum::<f64>().max(1e-300);
    let shares = order.iter().map(|&i| eigen.eigenvalues[i].max(0.0) / total).collect();
    (DMatrix::from_fn(order.len(), order.len(), |r, c| eigen.eigenvectors[(r, order[c])]), shares)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::synth;
    use gestus_motion::clip::Frame;
    use nalgebra::Vector3;

    #[test]
    fn known_corners_come_back_and_the_walk_goes_on() {
        let corpus =
            synth::corpus(&synth::Options::of(&["walk"], &["neutral", "proud", "old"], 3, 6.0)).unwrap();
        let body = Body::of(&corpus).unwrap();
        let model = Bilinear::of(&corpus, &body, 0, 0).unwrap();
        assert!(model.explained.iter().all(|e| (e.iter().sum::<f64>() - 1.0).abs() < 1e-9));
        // The coordinates of a known style at a known speed give its own vector.
        let own = cuts(&corpus, &body, 0, 1).unwrap();
        let base = cuts(&corpus, &body, 0, 0).unwrap()[1].clone();
        let truth = aligned(&base, &own[2], corpus.rate_hz).unwrap();
        let found = model.vector(&[0.0, 1.0, 0.0], 2.0);
        assert!(truth.iter().zip(&found).all(|(a, b)| (a - b).abs() < 1e-9));

        let ground = |weights: &[f64], speed: f64, beyond: f64| {
            let clip = model.cycle(weights, speed, beyond).unwrap().walk(&body, 6.0, corpus.rate_hz);
            assert!((clip.duration_s() - 6.0).abs() < 0.1);
            // No seam: no joint turns by more than a walk does.
            let turned = clip.frames.windows(2).flat_map(|w| {
                w[0].rotations.iter().zip(&w[1].rotations).map(|(a, b)| a.angle_to(b)).collect::<Vec<_>>()
            });
            assert!(turned.fold(0.0, f64::max) < 0.6);
            // Along the way, which may turn.
            let flat = |f: &Frame| Vector3::new(f.root.x, 0.0, f.root.z);
            let way: f64 = clip.frames.windows(2).map(|w| (flat(&w[1]) - flat(&w[0])).norm()).sum();
            way / clip.duration_s()
        };
        // Each style has speeds of its own. The walk has the speed that was asked for: between them, beyond them, and
        // where only quicker or slower steps have it; between two styles, and beyond one.
        for weights in [[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.5, 0.0, 0.5], [-0.3, 1.3, 0.0]] {
            let known = model.speeds_of(&weights);
            for speed in
                [known[1], 0.5 * (known[1] + known[2]), 1.1 * known[2], 0.6 * known[0], 1.6 * known[2]]
            {
                for beyond in [0.0, 1.0] {
                    let walked = ground(&weights, speed, beyond);
                    assert!((walked / speed - 1.0).abs() < 0.05, "{weights:?}: {walked} for {speed}");
                }
            }
        }
        let neutral = [1.0, 0.0, 0.0];
        let fast = 1.3 * model.speeds_of(&neutral)[2];
        let [in_steps, extrapolated] = [0.0, 1.0].map(|beyond| model.cycle(&neutral, fast, beyond).unwrap());
        assert!((in_steps.cadence - 1.3).abs() < 1e-6 && extrapolated.cadence < 1.3);
        // A cycle that lasts too long is named with its style.
        let slow = Cut { rows: own[1].rows.iter().flat_map(|r| [r; 3]).cloned().collect(), ..own[1].clone() };
        let cuts = [vec![base.clone(), base.clone()], vec![base.clone(), slow]];
        let error = Bilinear::of_cuts(&corpus.styles[..2], &cuts, &base, corpus.rate_hz).unwrap_err();
        let BilinearError::Lengths { style, slope: 2, .. } = &error else { panic!("{error}") };
        assert_eq!(style, "proud");
        for speed in [0.0, 20.0] {
            let error = model.cycle(&neutral, speed, 0.0).unwrap_err();
            let BilinearError::Speed { slowest, fastest, .. } = error else { panic!("{error}") };
            assert!(slowest < 0.7 && fastest > 1.5 && !(slowest..fastest).contains(&speed));
        }
    }
}
