//! Which side of a body is left, by its motion: feet point ahead, knees bend ahead and elbows back, and left is left of
//! ahead.

use nalgebra::Vector3;

/// Joints of a limb, from the trunk on: upper bone, lower bone, end, and what follows it.
pub type Limb = [Option<usize>; 4];

/// Least distance of toes from the ankle, or of a knee from the line from hip to ankle, over the length of the leg.
const LEAST: [f64; 2] = [0.05, 0.01];

/// How surely the first of two legs is the left one: 1 certainly, -1 certainly the right one, 0 where nothing tells.
/// `poses` are positions of all joints, Y up; `arms` may be empty.
pub fn first_is_left(poses: &[Vec<Vector3<f64>>], legs: [Limb; 2], arms: &[Limb]) -> f64 {
    let mut sum = 0.0;
    for p in poses {
        let ahead = ahead(p, legs, arms);
        let left = Vector3::y().cross(&ahead);
        let [Some(first), Some(second)] = legs.map(|l| l[0].map(|j| p[j])) else { return 0.0 };
        let mut across = first - second;
        across.y = 0.0;
        if let (Some(left), Some(across)) = (left.try_normalize(1e-9), across.try_normalize(1e-9)) {
            sum += left.dot(&across);
        }
    }
    sum / poses.len().max(1) as f64
}

/// The direction ahead of a pose, on the ground; zero where nothing tells.
fn ahead(p: &[Vector3<f64>], legs: [Limb; 2], arms: &[Limb]) -> Vector3<f64> {
    let flat = |v: Vector3<f64>| Vector3::new(v.x, 0.0, v.z);
    let length = |l: &Limb| match l {
        [Some(a), Some(b), Some(c), _] => (p[*a] - p[*b]).norm() + (p[*b] - p[*c]).norm(),
        _ => 0.0,
    };
    let leg = legs.iter().map(length).fold(0.0, f64::max);
    let toes = |l: &Limb| match l {
        [_, _, Some(ankle), Some(toe)] => flat(p[*toe] - p[*ankle]),
        _ => Vector3::zeros(),
    };
    // How far the middle joint is off the straight line, across it.
    let bend = |l: &Limb| match l {
        [Some(a), Some(b), Some(c), _] => {
            let line = (p[*c] - p[*a]).try_normalize(1e-9).unwrap_or_else(Vector3::zeros);
            let off = p[*b] - p[*a];
            flat(off - line * off.dot(&line))
        }
        _ => Vector3::zeros(),
    };
    let feet: Vector3<f64> = legs.iter().map(toes).sum();
    if feet.norm() > LEAST[0] * leg {
        return feet;
    }
    let knees: Vector3<f64> = legs.iter().map(bend).sum();
    let elbows: Vector3<f64> = arms.iter().map(bend).sum();
    let bent = knees - elbows;
    if bent.norm() > LEAST[1] * leg { bent } else { Vector3::zeros() }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Hips at the origin, the first leg at +X, knees and toes moved along Z.
    fn legs(knee: f64, toe: f64) -> (Vec<Vec<Vector3<f64>>>, [Limb; 2]) {
        let leg = |x: f64| {
            [
                Vector3::new(x, 1.0, 0.0),
                Vector3::new(x, 0.5, knee),
                Vector3::new(x, 0.0, 0.0),
                Vector3::new(x, 0.0, toe),
            ]
        };
        let pose = [leg(0.1), leg(-0.1)].concat();
        (vec![pose], [[0, 1, 2, 3], [4, 5, 6, 7]].map(|l| l.map(Some)))
    }

    #[test]
    fn left_is_left_of_where_toes_and_knees_point() {
        for (knee, toe, wanted) in
            [(0.0, 0.2, 1.0), (0.0, -0.2, -1.0), (0.1, 0.0, 1.0), (-0.1, 0.0, -1.0), (0.0, 0.0, 0.0)]
        {
            let (poses, legs) = legs(knee, toe);
            let sure = first_is_left(&poses, legs, &[]);
            assert!((sure - wanted).abs() < 1e-9, "knee {knee}, toe {toe}: {sure}");
            let other = first_is_left(&poses, [legs[1], legs[0]], &[]);
            assert!((other + wanted).abs() < 1e-9);
        }
    }
}
