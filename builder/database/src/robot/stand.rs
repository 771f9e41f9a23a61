//! Where the robot's base is in its world.
//!
//! A robot's world has X ahead, Y left and Z up (ROS REP 103, MuJoCo), and its floor at zero. The midpoint of its hip
//! joints moves as the body's does, scaled by leg length and with its height measured from the ankles:
//!
//! ```text
//! hips = ankle_r + s (W hips_b - ankle_b)         base = hips - R hips_r         R = W R_root C
//! ```
//!
//! with W from the body's world (X left, Y up, Z ahead), s the length of the robot's legs over the body's, and C from the
//! body's root to the robot's base. Legs reach for the body's ankles, scaled alike, so that a foot that stands stays where
//! it is.

use gestus_motion::{clip::Frame, formats::urdf::Robot};
use nalgebra::{Isometry3, Matrix3, Rotation3, UnitQuaternion, Vector3};

use crate::{
    retarget::{
        body::Body,
        parts::{Part, Side},
    },
    robot::{
        assign::Assignment,
        file::RobotMap,
        links::{Limb, Links},
    },
};

/// Highest that an ankle may be above its sole, in lengths of the leg.
const MAX_SOLE_RATIO: f64 = 0.4;
/// Least cosine between straight down and the legs of a robot that stands, with all hinges at zero.
const STANDS: f64 = 0.5;

/// What it takes to place the base.
#[derive(Debug, Clone)]
pub struct Stand {
    /// Height of the robot's ankles above the ground when it stands, metres.
    pub ankle_m: f64,
    /// Leg length of the robot over the body's; 1 without legs.
    scale: f64,
    /// Midpoint of the hip joints: in the body's root, and in the robot's base.
    hips: [Vector3<f64>; 2],
    /// Height of the body's ankles when they stand, metres.
    body_ankle_m: f64,
    /// From the body's root to the robot's base.
    base: UnitQuaternion<f64>,
    /// That the height of the ankles is a guess, and that the feet are not below the hips.
    pub doubts: Vec<String>,
}

/// From the body's world to the robot's.
pub fn to_robot_world() -> UnitQuaternion<f64> {
    let columns = Matrix3::from_columns(&[Vector3::y(), Vector3::z(), Vector3::x()]);
    UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(columns))
}

impl Stand {
    pub(super) fn of(
        body: &Body,
        robot: &Robot,
        assignment: &Assignment,
        links: &Links,
        axes: UnitQuaternion<f64>,
        map: &RobotMap,
        limbs: &[Limb],
    ) -> Self {
        let legs: Vec<&Limb> = limbs.iter().filter(|limb| limb.leg).collect();
        let scale = legs.first().map_or(1.0, |leg| leg.scale);
        let begins = legs.iter().map(|leg| links.places[leg.hinges.0].translation.vector);
        let middle = begins.sum::<Vector3<f64>>() / legs.len().max(1) as f64;
        let base = body.anatomy.frame(0).unwrap_or_else(UnitQuaternion::identity) * axes.inverse();
        let guess = scale * body.anatomy.ankle_m.max(0.0);
        let leg_m = scale * body.anatomy.leg_m;
        let found = sole(robot, assignment, links, &(axes * -Vector3::y()))
            .filter(|sole_m| (0.0..=MAX_SOLE_RATIO * leg_m).contains(sole_m));
        let ankle_m = map.ankle_m.or(found).unwrap_or(guess);
        let assumed = (map.ankle_m.is_none() && found.is_none() && !legs.is_empty()).then(|| {
            format!(
                "no shape of the feet tells how high the ankles are above the ground: {:.1} cm is assumed, `ankle_m` in \
                 the robot map states it",
                100.0 * guess
            )
        });
        let hips = [body.anatomy.hips, middle];
        let too_high = map.ankle_m.filter(|&m| !legs.is_empty() && m > MAX_SOLE_RATIO * leg_m).map(|m| {
            format!(
                "`ankle_m` in the robot map has the ankles {:.0} cm above the ground, and the legs are {:.0} cm long from \
                 hip to ankle: it is in metres",
                100.0 * m,
                100.0 * leg_m
            )
        });
        let doubts = assumed
            .into_iter()
            .chain(too_high)
            .chain(not_below(&legs, links, &(axes * -Vector3::y())))
            .collect();
        Self { ankle_m, scale, hips, body_ankle_m: body.anatomy.ankle_m, base, doubts }
    }

    /// The base in the robot's world, for a pose of the body.
    pub fn base(&self, frame: &Frame) -> Isometry3<f64> {
        let world = to_robot_world();
        let root = frame.rotations[0];
        let mut hips = world * (frame.root + root * self.hips[0]);
        hips.z -= self.body_ankle_m;
        hips *= self.scale;
        hips.z += self.ankle_m;
        let turn = world * root * self.base;
        Isometry3::from_parts((hips - turn * self.hips[1]).into(), turn)
    }
}

/// What to do where the feet are not below the hips, with all hinges at zero: many makers have another axis up.
fn not_below(legs: &[&Limb], links: &Links, down: &Vector3<f64>) -> Option<String> {
    let along = |leg: &&Limb| {
        let [hip, knee] = [leg.hinges.0, leg.hinges.1].map(|hinge| links.places[hinge]);
        knee.transform_point(&leg.tip.into()).coords - hip.translation.vector
    };
    let legs: Vector3<f64> = legs.iter().map(along).sum();
    if legs.norm() < 1e-6 || legs.dot(down) >= STANDS * legs.norm() {
        return None;
    }
    let axis = legs.iamax();
    let up = format!("{}{}", if legs[axis] > 0.0 { "-" } else { "" }, ["x", "y", "z"][axis]);
    Some(format!(
        "with all hinges at zero the feet are not below the hips: if the robot's up is {up}, write `up = \"{up}\"` in the \
         robot map"
    ))
}

/// Height of the ankles above the lowest of the feet, with all hinges at zero: by shapes that collide, by those that are
/// seen, by links that are fixed to the feet. `down` is a direction in the base's axes.
fn sole(robot: &Robot, assignment: &Assignment, links: &Links, down: &Vector3<f64>) -> Option<f64> {
    let feet = Side::BOTH.map(|side| assignment.groups.iter().find(|g| g.part == Part::Foot(side)));
    let heights = feet.into_iter().flatten().map(|foot| {
        let (first, last) = (foot.hinges[0], foot.hinges[foot.hinges.len() - 1]);
        let behind = |mut hinge: Option<usize>| {
            while let Some(h) = hinge.filter(|&h| h != last) {
                hinge = robot.hinges[h].parent;
            }
            hinge.is_some()
        };
        let ankle = links.places[first].translation.vector.dot(down);
        let lowest = |visual: bool| {
            let shapes = robot.shapes.iter().filter(|s| s.visual == visual && behind(s.parent));
            shapes.filter_map(|s| Some(s.reach(&links.places[s.parent?], down))).reduce(f64::max)
        };
        let fixed = robot.fixed.iter().filter(|f| behind(f.parent));
        let fixed =
            fixed.filter_map(|f| Some((links.places[f.parent?] * f.origin).translation.vector.dot(down)));
        let low = lowest(false).or_else(|| lowest(true)).or_else(|| fixed.reduce(f64::max))?;
        Some(low - ankle)
    });
    let heights: Vec<f64> = heights.collect::<Option<_>>()?;
    (!heights.is_empty()).then(|| heights.iter().sum::<f64>() / heights.len() as f64)
}
