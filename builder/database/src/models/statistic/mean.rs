//! Mean and standard deviation of rotations (section 5.4, eq. 6).
//!
//! The mean is recursive: `q̄_n = Slerp(1/n, q̄_{n-1}, q_n)`, with signs of quaternions matched to the mean's. (Eq. 6
//! prints the weight as `(n-1)/n`, which with the paper's Slerp would forget all but the last frames; its arguments are
//! meant in the other order.) It depends on the order of the frames. The geodesic mean does not: it is the rotation with
//! the least sum of squared distances, and [`geodesic`] iterates to it: `q̄ ← q̄ exp(mean of
//! log(q̄⁻¹ q_i))`.
//!
//! In `f32`, with the functions of the core. Cost: one slerp per frame.

use gestus_core::math::quaternion::{self, Quaternion, angle, slerp};

/// Mean and standard deviation of rotations.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Spread {
    /// The mean.
    pub mean: Quaternion,
    /// Root mean square of the geodesic distances to it, radians.
    pub deviation: f32,
}

/// Least standard deviation of a joint, radians: less is noise.
pub const MIN_DEVIATION: f32 = 1e-3;

/// Greatest factor of a standard deviation, as in the core.
pub const MAX_SCALE: f32 = 4.0;

/// The recursive mean of rotations; identity if there are none.
pub fn recursive(rotations: impl IntoIterator<Item = Quaternion>) -> Quaternion {
    let mut mean = quaternion::IDENTITY;
    for (before, q) in rotations.into_iter().enumerate() {
        mean = if before == 0 { q } else { slerp(1.0 / (before as f32 + 1.0), mean, q) };
    }
    mean
}

/// The geodesic mean, from an initial guess by `rounds` of Newton's method; about four are enough.
pub fn geodesic(
    guess: Quaternion,
    rotations: impl IntoIterator<Item = Quaternion> + Clone,
    rounds: usize,
) -> Quaternion {
    let mut mean = guess;
    for _ in 0..rounds {
        let (mut sum, mut count) = ([0.0_f64; 3], 0.0_f64);
        for q in rotations.clone() {
            let way = quaternion::between(mean, q);
            sum.iter_mut().zip(way).for_each(|(s, w)| *s += f64::from(w));
            count += 1.0;
        }
        let step = sum.map(|s| (s / count.max(1.0)) as f32);
        mean = quaternion::normalize(quaternion::multiply(mean, quaternion::exp(step))).unwrap_or(mean);
    }
    mean
}

/// Mean and standard deviation of rotations: recursive, then `rounds` towards the geodesic mean.
pub fn spread(rotations: impl IntoIterator<Item = Quaternion> + Clone, rounds: usize) -> Spread {
    let mean = geodesic(recursive(rotations.clone()), rotations.clone(), rounds);
    let (mut sum, mut count) = (0.0_f64, 0.0_f64);
    for q in rotations {
        let distance = f64::from(angle(mean, q));
        sum += distance * distance;
        count += 1.0;
    }
    Spread { mean, deviation: ((sum / count.max(1.0)).sqrt() as f32).max(MIN_DEVIATION) }
}

/// Mean and standard deviation of every joint of a clip: `frames` `[frames][joints]`, with a weight for each frame. Joints
/// are interleaved, since the steps of one recursion depend on each other.
pub fn spreads(frames: &[Vec<Quaternion>], weights: &[f32], rounds: usize) -> Vec<Spread> {
    let joints = frames.first().map_or(0, Vec::len);
    let mut means = vec![quaternion::IDENTITY; joints];
    let mut total = 0.0;
    for (frame, &weight) in frames.iter().zip(weights).filter(|(_, w)| **w > 0.0) {
        total += weight;
        let share = weight / total;
        for (mean, &q) in means.iter_mut().zip(frame) {
            *mean = if share < 1.0 { near_slerp(share, *mean, q) } else { q };
        }
    }
    for mean in &mut means {
        *mean = quaternion::normalize(*mean).unwrap_or(*mean);
    }
    for _ in 0..rounds {
        let mut ways = vec![[0.0_f32; 3]; joints];
        for (frame, &weight) in frames.iter().zip(weights) {
            for ((way, &mean), &q) in ways.iter_mut().zip(&means).zip(frame) {
                let step = quaternion::between(mean, q);
                way.iter_mut().zip(step).for_each(|(w, s)| *w += weight / total * s);
            }
        }
        for (mean, way) in means.iter_mut().zip(ways) {
            let moved = quaternion::multiply(*mean, quaternion::exp(way));
            *mean = quaternion::normalize(moved).unwrap_or(*mean);
        }
    }
    let mut squares = vec![0.0_f32; joints];
    for (frame, &weight) in frames.iter().zip(weights) {
        for ((square, &mean), &q) in squares.iter_mut().zip(&means).zip(frame) {
            *square += weight * square_angle(mean, q);
        }
    }
    let total = if total > 0.0 { total } else { 1.0 };
    let spread = |(mean, square): (Quaternion, f32)| Spread {
        mean,
        deviation: (square / total).sqrt().max(MIN_DEVIATION),
    };
    means.into_iter().zip(squares).map(spread).collect()
}

/// Slerp without trigonometry for rotations within 52 degrees of each other and `t` up to 1.5; else the core's.
/// `sin(tθ) / sin θ = t (1 + b₁ (1 + b₂ (...)))` with `b_i = (t² - i²) / (i (2i + 1)) (cos θ - 1)` (Eberly 2011, "A
/// fast and accurate algorithm for computing slerp"); five terms are exact to 1e-6.
pub fn near_slerp(t: f32, a: Quaternion, b: Quaternion) -> Quaternion {
    let d = a[0] * b[0] + a[1] * b[1] + a[2] * b[2] + a[3] * b[3];
    let (d, sign) = if d < 0.0 { (-d, -1.0) } else { (d, 1.0) };
    if d < 0.9 || t > 1.5 {
        return slerp(t, a, b);
    }
    let part = |t: f32| {
        let (t2, x) = (t * t, d - 1.0);
        let term = |i: f32| (t2 - i * i) / (i * (2.0 * i + 1.0)) * x;
        t * (1.0 + term(1.0) * (1.0 + term(2.0) * (1.0 + term(3.0) * (1.0 + term(4.0) * (1.0 + term(5.0))))))
    };
    let (from, to) = (part(1.0 - t), sign * part(t));
    std::array::from_fn(|i| from * a[i] + to * b[i])
}

/// Squared angle between two rotations. Near each other, by the chord `c = 2 sin(θ/4)` and the series of
/// `θ² = 16 asin²(c/2)`, which converges fast and needs no root.
fn square_angle(a: Quaternion, b: Quaternion) -> f32 {
    let d = a[0] * b[0] + a[1] * b[1] + a[2] * b[2] + a[3] * b[3];
    let sign = if d < 0.0 { -1.0 } else { 1.0 };
    let chord2: f32 = a.iter().zip(&b).map(|(a, b)| (a - sign * b) * (a - sign * b)).sum();
    let x = 0.25 * chord2;
    if x > 0.1 {
        let angle = angle(a, b);
        return angle * angle;
    }
    // asin²(√x) = x + x²/3 + 8x³/45 + 4x⁴/35 + 128x⁵/1575 + 128x⁶/2079
    let series = 128.0 / 2079.0;
    let series = 128.0 / 1575.0 + x * series;
    let series = 4.0 / 35.0 + x * series;
    let series = 8.0 / 45.0 + x * series;
    let series = 1.0 / 3.0 + x * series;
    16.0 * x * (1.0 + x * series)
}

#[cfg(test)]
mod tests {
    use super::*;
    use gestus_motion::clip;
    use nalgebra::{UnitQuaternion, Vector3};

    fn rotations(spread: f64) -> Vec<UnitQuaternion<f64>> {
        (0..300)
            .map(|t| {
                let x = f64::from(t) * 0.21;
                let way = Vector3::new(x.sin(), (1.7 * x).cos() * 0.6, (0.3 * x).sin()) * spread;
                UnitQuaternion::from_scaled_axis(Vector3::new(0.4, 1.1, -0.3))
                    * UnitQuaternion::from_scaled_axis(way)
            })
            .collect()
    }

    /// Every other one with its sign turned: the same rotation.
    fn narrow(rotations: &[UnitQuaternion<f64>]) -> Vec<Quaternion> {
        let signed = |(i, q): (usize, &UnitQuaternion<f64>)| {
            let s = if i % 2 == 0 { 1.0 } else { -1.0 };
            [q.i, q.j, q.k, q.w].map(|v| (s * v) as f32)
        };
        rotations.iter().enumerate().map(signed).collect()
    }

    #[test]
    fn the_recursive_mean_is_the_papers() {
        let all = rotations(0.5);
        let mut truth = all[0];
        for (n, q) in all.iter().enumerate().skip(1) {
            truth = clip::slerp(&truth, q, 1.0 / (n as f64 + 1.0));
        }
        let found = recursive(narrow(&all));
        let truth = narrow(&[truth])[0];
        assert!(angle(found, truth) < 1e-5, "{found:?} {truth:?}");
    }

    #[test]
    fn the_series_is_slerp() {
        let all = narrow(&rotations(0.5));
        for (k, (&a, &b)) in all.iter().zip(&all[1..]).enumerate() {
            for t in [0.0, 0.01, 0.3, 0.5, 1.0, 1.4, 2.0] {
                let off = angle(near_slerp(t, a, b), slerp(t, a, b));
                assert!(off < 5e-6, "pair {k}, t {t}: {off}");
            }
        }
    }

    /// All joints at once give what each alone gives; a weight of two is the frame twice.
    #[test]
    fn joints_side_by_side_are_joints_alone() {
        let (a, b) = (narrow(&rotations(0.5)), narrow(&rotations(1.1)));
        let frames: Vec<Vec<Quaternion>> = a.iter().zip(&b).map(|(a, b)| vec![*a, *b]).collect();
        for rounds in [0, 4] {
            let all = spreads(&frames, &vec![1.0; frames.len()], rounds);
            for (found, one) in all.iter().zip([&a, &b]) {
                let alone = spread(one.iter().copied(), rounds);
                assert!(angle(found.mean, alone.mean) < 1e-5);
                assert!((found.deviation - alone.deviation).abs() < 1e-4, "{found:?} {alone:?}");
            }
        }
        let twice: Vec<Quaternion> = a.iter().flat_map(|&q| [q, q]).collect();
        let twice = spread(twice.iter().copied(), 0);
        let weighted = spreads(&frames, &vec![2.0; frames.len()], 0)[0];
        assert!(
            angle(twice.mean, weighted.mean) < 5e-3 && (twice.deviation - weighted.deviation).abs() < 1e-3
        );
    }

    #[test]
    fn the_geodesic_mean_is_where_the_squares_are_least() {
        let all = narrow(&rotations(0.8));
        let mean = geodesic(recursive(all.clone()), all.clone(), 8);
        let cost = |m: Quaternion| all.iter().map(|&q| f64::from(angle(m, q)).powi(2)).sum::<f64>();
        let best = cost(mean);
        for way in
            [[0.01, 0.0, 0.0], [-0.01, 0.0, 0.0], [0.0, 0.01, 0.0], [0.0, 0.0, -0.01], [0.0, -0.01, 0.01]]
        {
            assert!(cost(quaternion::multiply(mean, quaternion::exp(way))) > best);
        }
        // The recursive one is near it, and not the same.
        let off = angle(mean, recursive(all.clone()));
        assert!((1e-4..0.05).contains(&off), "{off}");
        assert!((spread(all.clone(), 8).deviation - (best / 300.0).sqrt() as f32).abs() < 1e-4);
    }
}
