//! Shapes of links that are no meshes, and how far they reach.

use nalgebra::{Isometry3, Translation3, UnitQuaternion, Vector3};

/// A shape of a link: a box, a cylinder along its Z, or a sphere.
#[derive(Debug, Clone, PartialEq)]
pub struct Shape {
    /// The hinge before it; `None`: the base.
    pub parent: Option<usize>,
    /// Its frame in the frame behind that hinge.
    pub origin: Isometry3<f64>,
    /// True if the link is seen there but does not collide.
    pub visual: bool,
    solid: Solid,
}

#[derive(Debug, Clone, Copy, PartialEq)]
enum Solid {
    Box(Vector3<f64>),
    Cylinder { radius: f64, half: f64 },
    Sphere(f64),
}

impl Shape {
    /// How far it reaches along a direction, a unit vector in the axes of `place`, the frame behind the hinge.
    pub fn reach(&self, place: &Isometry3<f64>, along: &Vector3<f64>) -> f64 {
        let place = place * self.origin;
        let own = place.rotation.inverse() * along;
        let beyond = match self.solid {
            Solid::Box(half) => half.dot(&own.abs()),
            Solid::Cylinder { radius, half } => half * own.z.abs() + radius * own.xy().norm(),
            Solid::Sphere(radius) => radius,
        };
        place.translation.vector.dot(along) + beyond
    }
}

/// The shapes of a link whose frame is at `at` behind a hinge.
pub(super) fn shapes(link: &urdf_rs::Link, parent: Option<usize>, at: Isometry3<f64>) -> Vec<Shape> {
    use urdf_rs::Geometry::{Box, Capsule, Cylinder, Mesh, Sphere};
    let collisions = link.collision.iter().map(|c| (&c.origin, &c.geometry, false));
    let visuals = link.visual.iter().map(|v| (&v.origin, &v.geometry, true));
    let shape = |(origin, geometry, visual): (&urdf_rs::Pose, &urdf_rs::Geometry, bool)| {
        let solid = match *geometry {
            Box { size } => Solid::Box(0.5 * Vector3::from(size.0)),
            Cylinder { radius, length } | Capsule { radius, length } => {
                Solid::Cylinder { radius, half: 0.5 * length }
            }
            Sphere { radius } => Solid::Sphere(radius),
            Mesh { .. } => return None,
        };
        Some(Shape { parent, origin: at * isometry(origin), visual, solid })
    };
    collisions.chain(visuals).filter_map(shape).collect()
}

/// A pose of the file.
pub(super) fn isometry(pose: &urdf_rs::Pose) -> Isometry3<f64> {
    let [x, y, z] = pose.xyz.0;
    let [roll, pitch, yaw] = pose.rpy.0;
    Isometry3::from_parts(Translation3::new(x, y, z), UnitQuaternion::from_euler_angles(roll, pitch, yaw))
}
