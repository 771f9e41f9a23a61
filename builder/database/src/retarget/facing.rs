//! Which side of a body is left, by its motion: toes point ahead of the shin, knees bend ahead and elbows back, and left is
//! left of ahead. All of it is relative to the limbs and the trunk, so that it holds for a body that lies or crawls too:
//! the toes of one that lies on its belly point to its feet's end, and those of one that crawls point back.

use nalgebra::Vector3;

/// Joints of a limb, from the trunk on: upper bone, lower bone, end, and what follows it.
pub type Limb = [Option<usize>; 4];

/// Least distance of toes from the line of the shin, or of knees and elbows from straight limbs, both sides together, over
/// the length of the leg. Two knees bent by 9 degrees: straight ones are off by up to that, to any side (a standing body of
/// bvhtools, to the back).
const MIN_RATIOS: [f64; 2] = [0.05, 0.08];

/// How surely the first of two legs is the left one: 1 certainly, -1 certainly the right one, 0 where nothing tells.
/// `poses` are positions of all joints; `arms` may be empty.
pub fn first_is_left(poses: &[Vec<Vector3<f64>>], legs: [Limb; 2], arms: &[Limb]) -> f64 {
    let mut sum = 0.0;
    for p in poses {
        let [Some(first), Some(second)] = legs.map(|l| l[0].map(|j| p[j])) else { return 0.0 };
        let across = (first - second).try_normalize(1e-9);
        if let (Some(left), Some(across)) = (left(p, legs, arms).try_normalize(1e-9), across) {
            sum += left.dot(&across);
        }
    }
    sum / poses.len().max(1) as f64
}

/// The direction to the left of a pose; zero where nothing tells.
fn left(p: &[Vector3<f64>], legs: [Limb; 2], arms: &[Limb]) -> Vector3<f64> {
    let unit = |v: Vector3<f64>| v.try_normalize(1e-9).unwrap_or_else(Vector3::zeros);
    let length = |l: &Limb| match l {
        [Some(a), Some(b), Some(c), _] => (p[*a] - p[*b]).norm() + (p[*b] - p[*c]).norm(),
        _ => 0.0,
    };
    let leg = legs.iter().map(length).fold(0.0, f64::max);
    // Left of the toes, as the shin stands on them.
    let toes = |l: &Limb| match l {
        [_, Some(knee), Some(ankle), Some(toe)] => unit(p[*knee] - p[*ankle]).cross(&(p[*toe] - p[*ankle])),
        _ => Vector3::zeros(),
    };
    let feet: Vector3<f64> = legs.iter().map(toes).sum();
    if feet.norm() > MIN_RATIOS[0] * leg {
        return feet;
    }
    // How far the middle joint is off the straight line, across it.
    let bend = |l: &Limb| match l {
        [Some(a), Some(b), Some(c), _] => {
            let (line, off) = (unit(p[*a] - p[*c]), p[*b] - p[*a]);
            (line, off - line * off.dot(&line))
        }
        _ => (Vector3::zeros(), Vector3::zeros()),
    };
    let middle = |limbs: &[Limb]| {
        let uppers: Vec<Vector3<f64>> = limbs.iter().filter_map(|l| Some(p[l[0]?])).collect();
        uppers.iter().sum::<Vector3<f64>>() / uppers.len().max(1) as f64
    };
    let knees: Vector3<f64> = legs.iter().map(bend).map(|(line, off)| line.cross(&off)).sum();
    let trunk = unit(middle(arms) - middle(&legs));
    let elbows: Vector3<f64> = arms.iter().map(|l| bend(l).1).sum();
    let bent = knees - trunk.cross(&elbows);
    if bent.norm() > MIN_RATIOS[1] * leg { bent } else { Vector3::zeros() }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::FRAC_PI_2;

    use nalgebra::UnitQuaternion;

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

    /// Toes that point away from the head were ahead, so that left was right on the belly and on hands and knees.
    #[test]
    fn left_is_left_of_a_body_that_lies_or_crawls() {
        let turned =
            |pitch: f64, v: Vector3<f64>| UnitQuaternion::from_axis_angle(&Vector3::x_axis(), pitch) * v;
        for (hip, knee, foot) in [
            // On the belly, the back and the side, with pointed feet, and on hands and knees.
            (FRAC_PI_2, 0.1, 1.0),
            (-FRAC_PI_2, 0.1, 1.0),
            (FRAC_PI_2, 0.0, 1.3),
            (0.2, FRAC_PI_2, 1.2),
        ] {
            let leg = |x: f64| {
                let thigh = turned(hip, -Vector3::y() * 0.4);
                let shin = turned(hip + knee, -Vector3::y() * 0.4);
                let toes = turned(hip + knee + foot, Vector3::z() * 0.15);
                let at = Vector3::x() * x;
                [at, at + thigh, at + thigh + shin, at + thigh + shin + toes]
            };
            let pose = [leg(0.1), leg(-0.1)].concat();
            let legs = [[0, 1, 2, 3], [4, 5, 6, 7]].map(|l| l.map(Some));
            for pose in
                [pose.clone(), pose.iter().map(|p| turned(0.7, Vector3::new(p.y, -p.x, p.z))).collect()]
            {
                let sure = first_is_left(&[pose], legs, &[]);
                assert!(sure > 0.9, "hip {hip}, knee {knee}, foot {foot}: {sure}");
            }
        }
    }
}
