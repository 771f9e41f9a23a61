//! The generated walk on other skeletons: renamed, rescaled, with other axes and rest poses, more joints, another up.

use std::sync::Arc;

use gestus_database::retarget::{MapFile, Retarget};
use gestus_motion::clip::{Clip, Frame, Skeleton};
use nalgebra::{UnitQuaternion, Vector3};

use crate::common::{database, walk};

/// The same motion on another skeleton.
#[derive(Clone)]
pub struct Foreign(pub Clip);

impl Foreign {
    pub fn new() -> Self {
        Self(walk().clone())
    }

    pub fn skeleton(&mut self, change: impl FnOnce(&mut Skeleton)) {
        let mut skeleton = (*self.0.skeleton).clone();
        change(&mut skeleton);
        self.0.skeleton = Arc::new(skeleton);
    }

    pub fn named(mut self, name: impl Fn(usize, &str) -> String) -> Self {
        self.skeleton(|s| s.names = s.names.iter().enumerate().map(|(j, n)| name(j, n)).collect());
        self
    }

    /// Names as Mixamo has them.
    pub fn mixamo(self) -> Self {
        self.named(|_, name| {
            let (stem, side) = name.split_once('_').unwrap_or((name, ""));
            let side = match side {
                "L" => "Left",
                "R" => "Right",
                _ => "",
            };
            let stem = match stem {
                "UpperArm" => "Arm",
                "LowerArm" => "ForeArm",
                "UpperLeg" => "UpLeg",
                "LowerLeg" => "Leg",
                "Toes" => "ToeBase",
                other => other,
            };
            format!("mixamorig:{side}{stem}")
        })
    }

    /// Left called right, and right left.
    pub fn exchanged(self) -> Self {
        self.named(|_, name| match name.rsplit_once('_') {
            Some((stem, "L")) => format!("{stem}_R"),
            Some((stem, "R")) => format!("{stem}_L"),
            _ => name.to_owned(),
        })
    }

    /// Every joint in axes of its own: the rest pose is a heap of bones, the motion is the same.
    pub fn turned(mut self) -> Self {
        let own = |j: usize| {
            let v = Vector3::new(
                (1.7 * j as f64).sin(),
                (2.3 * j as f64 + 1.0).cos(),
                (0.9 * j as f64 + 2.0).sin(),
            );
            UnitQuaternion::from_scaled_axis(v * 2.0)
        };
        let parents = self.0.skeleton.parents.clone();
        self.skeleton(|s| {
            for j in 1..s.joints() {
                s.offsets[j] = own(parents[j].unwrap()).inverse() * s.offsets[j];
            }
        });
        for frame in &mut self.0.frames {
            for j in 0..frame.rotations.len() {
                let before = parents[j].map_or_else(UnitQuaternion::identity, own);
                frame.rotations[j] = before.inverse() * frame.rotations[j] * own(j);
            }
        }
        self
    }

    pub fn scaled(mut self, scale: f64) -> Self {
        self.skeleton(|s| s.offsets.iter_mut().for_each(|o| *o *= scale));
        self.0.frames.iter_mut().for_each(|f| f.root *= scale);
        self
    }

    /// Z up, as robots and some tools have it.
    pub fn z_up(mut self) -> Self {
        let turn = UnitQuaternion::from_axis_angle(&Vector3::x_axis(), std::f64::consts::FRAC_PI_2);
        for frame in &mut self.0.frames {
            frame.root = turn * frame.root;
            frame.rotations[0] = turn * frame.rotations[0];
        }
        self
    }

    /// One more joint, which does not turn.
    pub fn with_joint(mut self, on: &str, offset: Vector3<f64>) -> Self {
        let on = self.0.skeleton.find(on);
        self.skeleton(|s| {
            s.names.push(format!("thing {}", s.joints()));
            s.parents.push(on);
            s.offsets.push(offset);
        });
        self.0.frames.iter_mut().for_each(|f| f.rotations.push(UnitQuaternion::identity()));
        self
    }

    /// A joint in the middle of a bone, which does not turn; and two that hang on the hand.
    pub fn with_more_joints(mut self) -> Self {
        let s = &self.0.skeleton;
        let arm = s.names.iter().position(|n| n.contains("ForeArm") && n.contains("Left")).unwrap();
        let hand = s.names.iter().position(|n| n.contains("LeftHand")).unwrap();
        let chest = s.names.iter().position(|n| n.ends_with("Chest")).unwrap();
        let count = s.joints();
        // New order: the old joints, with the new ones put in front of what hangs on them.
        type Bone = (String, Option<usize>, Vector3<f64>, Option<usize>);
        let mut order: Vec<Bone> = Vec::new();
        let mut place = vec![0; count];
        for j in 0..count {
            let parent = s.parents[j].map(|p| place[p]);
            let mut offset = s.offsets[j];
            let mut parent = parent;
            if j == arm || j == chest {
                order.push((format!("Helper{j}"), parent, offset * 0.4, None));
                parent = Some(order.len() - 1);
                offset *= 0.6;
            }
            place[j] = order.len();
            order.push((s.names[j].clone(), parent, offset, Some(j)));
            if j == hand {
                for finger in 0..2 {
                    let at = Vector3::new(0.07, 0.0, 0.01 * f64::from(finger));
                    order.push((format!("LeftFinger{finger}"), Some(place[j]), at, None));
                }
            }
        }
        let frames = self.0.frames.iter().map(|f| Frame {
            root: f.root,
            rotations: order
                .iter()
                .map(|o| o.3.map_or_else(UnitQuaternion::identity, |j| f.rotations[j]))
                .collect(),
        });
        self.0 = Clip {
            frames: frames.collect(),
            skeleton: Arc::new(Skeleton {
                names: order.iter().map(|o| o.0.clone()).collect(),
                parents: order.iter().map(|o| o.1).collect(),
                offsets: order.iter().map(|o| o.2).collect(),
            }),
            ..self.0
        };
        self
    }

    pub fn map(&self) -> Retarget {
        Retarget::new(&database(), &self.0, &MapFile::default()).unwrap()
    }
}

/// Mean and largest distance between the joints of two clips of one skeleton, hips at one place, centimetres.
pub fn apart(a: &[Frame], b: &[Frame], skeleton: &Skeleton) -> (f64, f64) {
    let (mut sum, mut most, mut count) = (0.0, 0.0f64, 0);
    for (f, g) in a.iter().zip(b) {
        let (p, q) = (f.positions(skeleton), g.positions(skeleton));
        for j in 0..skeleton.joints() {
            let d = 100.0 * ((p[j] - p[0]) - (q[j] - q[0])).norm();
            sum += d;
            most = most.max(d);
            count += 1;
        }
    }
    (sum / f64::from(count), most)
}
