//! How a robot's links lie in a body, and the tables that the core reads.
//!
//! With all hinges at zero the robot stands, looks ahead, and has its feet flat; its limbs may point anywhere. A
//! link's anatomical frame is found there, by the same rules as a skeleton's ([`crate::retarget::anatomy`]): along
//! the bone, across the axis of knee or elbow in the sense in which they bend.

use gestus_core::{
    BlobError, Database,
    blob::{crc::crc32c, layout::MAX_JOINTS},
    retarget::fingerprint,
    robot::{
        Robot as Tables,
        layout::{self, MAX_CHAIN, MAX_HINGES, group, header, hinge, joint, limb},
    },
};
use nalgebra::{Isometry3, Matrix3, Rotation3, UnitQuaternion, Vector3};
use thiserror::Error;

use crate::retarget::{
    map::{Body, MapError},
    parts::{Part, Side},
};
use crate::robot::{
    assign::{Assigned, Assignment, assign},
    file::RobotMap,
};
use gestus_motion::formats::urdf::Robot;

/// A robot that can't be driven.
#[derive(Debug, Error)]
#[allow(missing_docs, reason = "the messages say what the fields are")]
pub enum MachineError {
    #[error(transparent)]
    Body(#[from] MapError),
    #[error("the robot has {have} hinges, at most {MAX_HINGES} can be driven")]
    Hinges { have: usize },
    #[error(
        "no hinge stands for any body part (joints: {joints}); say in a robot map (--robot-map) which does: [joints.NAME] part = \"left-lower-leg\""
    )]
    Nothing { joints: String },
    #[error("tick_hz = {tick_hz}: a robot is told 1 to 1000 times a second")]
    Tick { tick_hz: f64 },
    #[error("hinge `{hinge}`: {what}")]
    Hinge { hinge: String, what: String },
    #[error("the tables that were made are not in order: {0}")]
    Blob(#[from] BlobError),
}

/// A robot, made ready for a database.
#[derive(Debug, Clone)]
pub struct Machine {
    /// The robot.
    pub robot: Robot,
    /// Which hinge stands for which part.
    pub assignment: Assignment,
    /// Ticks a second.
    pub tick_hz: f64,
    /// Leg length of the robot over the body's; 0 without legs.
    pub scale: f64,
    /// From a body's axes to the base's.
    pub axes: UnitQuaternion<f64>,
    /// Everything that a person should look at.
    pub doubts: Vec<String>,
    bytes: Vec<u8>,
}

impl Machine {
    /// Makes the tables of a robot for a database.
    ///
    /// # Errors
    /// [`MachineError`] says what does not fit.
    pub fn new(database: &Database<'_>, robot: Robot, map: &RobotMap) -> Result<Self, MachineError> {
        let body = Body::of_database(database)?;
        let have = robot.hinges.len();
        if have > MAX_HINGES {
            return Err(MachineError::Hinges { have });
        }
        let tick_hz = map.tick_hz.unwrap_or(50.0);
        if !(1.0..=1000.0).contains(&tick_hz) {
            return Err(MachineError::Tick { tick_hz });
        }
        let assignment = assign(&robot, map);
        let axes = map.axes().unwrap_or_else(UnitQuaternion::identity);
        let links = Links::of(&robot, &assignment, axes);
        let groups: Vec<&Assigned> =
            assignment.groups.iter().filter(|g| body.parts.get(g.part).is_some()).collect();
        if groups.is_empty() {
            let joints = robot.hinges.iter().map(|h| h.name.as_str()).collect::<Vec<_>>().join(", ");
            return Err(MachineError::Nothing { joints });
        }
        let limbs = limbs(&body, &robot, &assignment, &links);
        let mut doubts: Vec<String> = robot.notes.clone();
        doubts.extend(assignment.doubts.iter().cloned());
        for g in assignment.groups.iter().filter(|g| body.parts.get(g.part).is_none()) {
            doubts.push(format!("the database's body has no {}: its hinges rest at zero", g.part));
        }
        let mut this = Self {
            tick_hz,
            scale: 0.0,
            axes,
            doubts,
            bytes: Vec::new(),
            robot,
            assignment: assignment.clone(),
        };
        this.scale = limbs.iter().find(|l| l.leg).map_or(0.0, |l| l.scale);
        this.bytes = this.write(database, &body, map, &groups, &limbs, &links)?;
        Tables::open(&this.bytes)?;
        Ok(this)
    }

    /// The tables for the core (`docs/FORMAT.md`, "Robot").
    pub fn bytes(&self) -> &[u8] {
        &self.bytes
    }

    /// The tables, opened.
    pub fn tables(&self) -> Tables<'_> {
        Tables::open(&self.bytes).expect("it was opened when it was made")
    }

    fn write(
        &mut self,
        database: &Database<'_>,
        body: &Body,
        map: &RobotMap,
        groups: &[&Assigned],
        limbs: &[Limb],
        links: &Links,
    ) -> Result<Vec<u8>, MachineError> {
        let joints = body.skeleton.joints().min(MAX_JOINTS);
        let total = layout::total(joints, self.robot.hinges.len(), groups.len(), limbs.len());
        let mut bytes = vec![0; header::LENGTH];
        let mut put = |range: std::ops::Range<usize>, data: &[u8]| bytes[range].copy_from_slice(data);
        put(header::MAGIC, &layout::MAGIC);
        put(header::VERSION, &layout::VERSION.to_le_bytes());
        // Counts were checked against limits far below these widths.
        put(header::HINGES, &(self.robot.hinges.len() as u16).to_le_bytes());
        put(header::TARGETS, &(joints as u16).to_le_bytes());
        put(header::GROUPS, &(groups.len() as u16).to_le_bytes());
        put(header::LIMBS, &(limbs.len() as u16).to_le_bytes());
        put(header::TOTAL, &(total as u32).to_le_bytes());
        put(header::SKELETON, &fingerprint(database).to_le_bytes());
        put(header::TICK, &((1.0 / self.tick_hz) as f32).to_le_bytes());
        let anatomy = |j: usize| body.anatomy.frame(j).unwrap_or_else(UnitQuaternion::identity);
        let base = anatomy(0) * self.axes.inverse();
        put(header::BASE, &floats(base.coords.as_slice()));
        for j in 0..joints {
            let at = grow(&mut bytes, joint::LENGTH);
            bytes[at + joint::PARENT] = body.skeleton.parents[j].map_or(u8::MAX, |p| p as u8);
            let offset = if j == 0 { Vector3::zeros() } else { body.skeleton.offsets[j] };
            set(&mut bytes, at, joint::OFFSET, offset.as_slice());
        }
        for h in 0..self.robot.hinges.len() {
            self.write_hinge(h, map, &mut bytes)?;
        }
        for g in groups {
            let at = grow(&mut bytes, group::LENGTH);
            let first = g.hinges[0];
            bytes[at + group::FIRST] = first as u8;
            bytes[at + group::COUNT] = g.hinges.len() as u8;
            let part_joint = body.parts.get(g.part).unwrap_or(0);
            bytes[at + group::JOINT] = part_joint as u8;
            let reaches = limbs.iter().position(|l| l.hinges.1 == g.hinges[g.hinges.len() - 1]);
            bytes[at + group::LIMB] = reaches.map_or(0, |l| (l + 1) as u8);
            let last = g.hinges[g.hinges.len() - 1];
            let link = links.frames[last].unwrap_or_else(UnitQuaternion::identity);
            let turn = anatomy(part_joint) * link.inverse();
            set(&mut bytes, at, group::TURN, turn.coords.as_slice());
            // From the frame behind the parent on.
            let mut zero = UnitQuaternion::identity();
            let mut turning = Vec::new();
            for &h in &g.hinges {
                zero *= self.robot.hinges[h].origin.rotation;
                turning.push(zero * self.robot.hinges[h].axis.into_inner());
            }
            set(&mut bytes, at, group::ZERO, zero.coords.as_slice());
            let axes: Vec<f64> =
                (0..3).flat_map(|i| turning.get(i).copied().unwrap_or_else(Vector3::x).data.0[0]).collect();
            set(&mut bytes, at, group::AXES, &axes);
            let pointed = pointed(g.part, &turning, &(zero * link));
            set(&mut bytes, at, group::POINTED, (link * pointed).as_slice());
            if g.hinges.len() < 3 && pointed.norm() < 0.5 {
                self.doubts.push(format!("the hinges of the {} turn about their own link alone", g.part));
            }
        }
        for l in limbs {
            let at = grow(&mut bytes, limb::LENGTH);
            bytes[at..at + 4].copy_from_slice(&[
                l.joints.0 as u8,
                l.joints.1 as u8,
                l.hinges.0 as u8,
                l.hinges.1 as u8,
            ]);
            set(&mut bytes, at, limb::SCALE, &[l.scale]);
            set(&mut bytes, at, limb::TIP, l.tip.as_slice());
        }
        let crc = crc32c(&[&bytes]);
        bytes[header::CRC].copy_from_slice(&crc.to_le_bytes());
        Ok(bytes)
    }

    fn write_hinge(&mut self, h: usize, map: &RobotMap, bytes: &mut Vec<u8>) -> Result<(), MachineError> {
        let record = &self.robot.hinges[h];
        let own = map.joints.get(&record.name);
        let velocity = own.and_then(|o| o.velocity).or(record.velocity).or(map.velocity).unwrap_or(5.0);
        // A servo is at its speed within a twentieth of a second, and at its torque within half of that.
        let acceleration = own
            .and_then(|o| o.acceleration)
            .or(record.acceleration)
            .or(map.acceleration)
            .unwrap_or(20.0 * velocity);
        let jerk = own.and_then(|o| o.jerk).or(record.jerk).or(map.jerk).unwrap_or(40.0 * acceleration);
        let at = grow(bytes, hinge::LENGTH);
        bytes[at + hinge::PARENT] = record.parent.map_or(layout::BASE, |p| p as u8);
        set(bytes, at, hinge::OFFSET, record.origin.translation.vector.as_slice());
        set(bytes, at, hinge::TURN, record.origin.rotation.coords.as_slice());
        set(bytes, at, hinge::AXIS, record.axis.as_slice());
        set(bytes, at, hinge::LIMITS, &[record.range.0, record.range.1, velocity, acceleration, jerk]);
        let servo = own.and_then(|o| o.servo).unwrap_or_default();
        let middle = 0.5 * (record.range.0 + record.range.1);
        let zero = servo.zero_deg.map_or(middle, f64::to_radians);
        let gain = servo.us_per_deg.to_degrees() * if servo.direction < 0 { -1.0 } else { 1.0 };
        let pulses = [servo.centre_us, gain, zero, servo.least_us, servo.greatest_us];
        set(bytes, at, hinge::SERVO, &pulses);
        let ends = [record.range.0, record.range.1].map(|q| servo.centre_us + (q - zero) * gain);
        if ends.iter().any(|&p| p < servo.least_us - 1.0 || p > servo.greatest_us + 1.0) {
            self.doubts.push(format!(
                "`{}` turns further than its servo's pulses reach ({:.0} to {:.0} us): beyond them the pulse stays at its end",
                record.name,
                ends[0].min(ends[1]),
                ends[0].max(ends[1])
            ));
        }
        let valid = gestus_core::robot::servo::Servo {
            centre_us: servo.centre_us as f32,
            gain_us: gain as f32,
            zero: zero as f32,
            least_us: servo.least_us as f32,
            greatest_us: servo.greatest_us as f32,
        };
        if !valid.is_valid() {
            let what = format!("its servo makes no sense: {servo:?}");
            return Err(MachineError::Hinge { hinge: record.name.clone(), what });
        }
        Ok(())
    }

    /// The assignment in words.
    pub fn text(&self) -> String {
        use std::fmt::Write;
        let mut out = String::new();
        // Writing to a String cannot fail.
        for g in &self.assignment.groups {
            let names: Vec<&str> = g.hinges.iter().map(|&h| self.robot.hinges[h].name.as_str()).collect();
            let _ = writeln!(out, "{:<18} {}", g.part.to_string(), names.join(", "));
        }
        for doubt in &self.doubts {
            let _ = writeln!(out, "doubt: {doubt}");
        }
        out
    }

    /// The assignment as JSON.
    pub fn json(&self) -> serde_json::Value {
        let groups: Vec<serde_json::Value> = self
            .assignment
            .groups
            .iter()
            .map(|g| {
                let names: Vec<&str> = g.hinges.iter().map(|&h| self.robot.hinges[h].name.as_str()).collect();
                serde_json::json!({ "part": g.part.to_string(), "hinges": names })
            })
            .collect();
        serde_json::json!({
            "name": self.robot.name, "hinges": self.robot.hinges.len(), "tick_hz": self.tick_hz,
            "scale": self.scale, "groups": groups, "doubts": self.doubts, "bytes": self.bytes.len(),
        })
    }
}

/// The direction that one or two hinges point, in the link's anatomical frame: one that they can turn.
fn pointed(part: Part, turning: &[Vector3<f64>], zero: &UnitQuaternion<f64>) -> Vector3<f64> {
    let (x, y, z) = (Vector3::x(), Vector3::y(), Vector3::z());
    let order = match part {
        // Heads and chests look somewhere, soles are level, limbs point along their bones.
        Part::Head | Part::Chest | Part::Hips | Part::Clavicle(_) => [z, y, x],
        _ => [y, z, x],
    };
    let last = turning.last().copied().unwrap_or(x);
    let across = |v: &&Vector3<f64>| (zero * **v).dot(&last).abs() < 0.9;
    order.iter().find(across).copied().unwrap_or(y)
}

/// An arm or leg that reaches.
struct Limb {
    joints: (usize, usize),
    hinges: (usize, usize),
    scale: f64,
    tip: Vector3<f64>,
    leg: bool,
}

/// Where links are and how they lie, with all hinges at zero.
struct Links {
    places: Vec<Isometry3<f64>>,
    /// From anatomical axes to the link's, for the last hinge of a group.
    frames: Vec<Option<UnitQuaternion<f64>>>,
    /// End of each limb: in the base's axes.
    tips: std::collections::BTreeMap<Part, Vector3<f64>>,
}

impl Links {
    fn of(robot: &Robot, assignment: &Assignment, axes: UnitQuaternion<f64>) -> Self {
        let count = robot.hinges.len();
        let places = robot.places(&vec![0.0; count]);
        let mut this = Self { places, frames: vec![None; count], tips: Default::default() };
        let group = |part: Part| assignment.groups.iter().find(|g| g.part == part);
        for g in &assignment.groups {
            let last = g.hinges[g.hinges.len() - 1];
            let upright = this.places[last].rotation.inverse() * axes;
            this.frames[last] = Some(upright);
        }
        for side in Side::BOTH {
            for (arm, chain) in [
                (false, [Part::UpperLeg(side), Part::LowerLeg(side), Part::Foot(side)]),
                (true, [Part::UpperArm(side), Part::LowerArm(side), Part::Hand(side)]),
            ] {
                let (Some(upper), Some(lower)) = (group(chain[0]), group(chain[1])) else { continue };
                let tip = this.tip(robot, lower, group(chain[2]), chain[0], upper);
                this.tips.insert(chain[2], tip);
                this.limb(robot, upper, lower, tip, arm, axes);
                // A hand lies as its lower arm does.
                if let (true, Some(hand)) = (arm, group(chain[2])) {
                    let (from, to) =
                        (lower.hinges[lower.hinges.len() - 1], hand.hinges[hand.hinges.len() - 1]);
                    let relative = this.places[to].rotation.inverse() * this.places[from].rotation;
                    this.frames[to] = this.frames[from].map(|f| relative * f);
                }
            }
        }
        this
    }

    /// Where a limb ends: at the next group, at a link that is fixed behind it, or as far on as the upper bone is long.
    fn tip(
        &self,
        robot: &Robot,
        lower: &Assigned,
        end: Option<&Assigned>,
        _part: Part,
        upper: &Assigned,
    ) -> Vector3<f64> {
        let last = lower.hinges[lower.hinges.len() - 1];
        if let Some(end) = end {
            return self.places[end.hinges[0]].translation.vector;
        }
        let fixed = robot.fixed.iter().filter(|f| f.parent == Some(last));
        let far = fixed.map(|f| (self.places[last] * f.origin).translation.vector);
        let here = self.places[last].translation.vector;
        let far = far.max_by(|a, b| (a - here).norm().total_cmp(&(b - here).norm()));
        far.filter(|f| (f - here).norm() > 0.01).unwrap_or_else(|| here + (here - self.begin(upper, here)))
    }

    /// Where the upper bone begins: at its last hinge, or at its first where the last sits on the elbow (the yaw of
    /// some upper arms).
    fn begin(&self, upper: &Assigned, elbow: Vector3<f64>) -> Vector3<f64> {
        let at = |h: usize| self.places[h].translation.vector;
        let (first, last) = (at(upper.hinges[0]), at(upper.hinges[upper.hinges.len() - 1]));
        if (elbow - last).norm() > 0.3 * (elbow - first).norm() { last } else { first }
    }

    /// Frames of upper and lower bone.
    fn limb(
        &mut self,
        robot: &Robot,
        upper: &Assigned,
        lower: &Assigned,
        tip: Vector3<f64>,
        arm: bool,
        axes: UnitQuaternion<f64>,
    ) {
        let (u, l) = (upper.hinges[upper.hinges.len() - 1], lower.hinges[lower.hinges.len() - 1]);
        let elbow = self.places[lower.hinges[0]].translation.vector;
        let upper_bone = elbow - self.begin(upper, elbow);
        let lower_bone = tip - elbow;
        // How it bends: with its hinges in the middle of their ranges.
        let mut bent = vec![0.0; robot.hinges.len()];
        for &h in &lower.hinges {
            let (low, high) = robot.hinges[h].range;
            bent[h] = 0.5 * (low + high);
        }
        let places = robot.places(&bent);
        let tip_in_link = self.places[l].inverse_transform_point(&tip.into());
        let bent_bone = places[l].transform_point(&tip_in_link).coords - elbow;
        let bend = upper_bone.cross(&bent_bone);
        let across = if bend.norm() > 0.15 * upper_bone.norm() * bent_bone.norm() {
            bend
        } else {
            // A knee bends about the left axis; an elbow about the right one, carried up with the arm.
            let (down, side) = (axes * -Vector3::y(), axes * Vector3::x());
            if arm {
                UnitQuaternion::rotation_between(&down, &upper_bone).map_or(-side, |r| r * -side)
            } else {
                side
            }
        };
        for (h, bone) in [(u, upper_bone), (l, lower_bone)] {
            let frame = frame(bone, across);
            self.frames[h] = Some(self.places[h].rotation.inverse() * frame);
        }
    }
}

/// Axes with Y along the bone and X across.
fn frame(bone: Vector3<f64>, across: Vector3<f64>) -> UnitQuaternion<f64> {
    let y = bone.try_normalize(1e-9).unwrap_or_else(Vector3::y);
    let other = if y.x.abs() < 0.7 { Vector3::x() } else { Vector3::z() };
    let x = (across - y * y.dot(&across)).try_normalize(1e-9).unwrap_or_else(|| y.cross(&other).normalize());
    let matrix = Matrix3::from_columns(&[x, y, x.cross(&y)]);
    UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(matrix))
}

/// The limbs that both have, in one chain of hinges.
fn limbs(body: &Body, robot: &Robot, assignment: &Assignment, links: &Links) -> Vec<Limb> {
    let group = |part: Part| assignment.groups.iter().find(|g| g.part == part);
    let mut limbs = Vec::new();
    for side in Side::BOTH {
        for (leg, chain) in [
            (true, [Part::UpperLeg(side), Part::LowerLeg(side), Part::Foot(side)]),
            (false, [Part::UpperArm(side), Part::LowerArm(side), Part::Hand(side)]),
        ] {
            let (Some(upper), Some(lower)) = (group(chain[0]), group(chain[1])) else { continue };
            let (Some(from), Some(to)) = (body.parts.get(chain[0]), body.parts.get(chain[2])) else {
                continue;
            };
            let (first, last) = (upper.hinges[0], lower.hinges[lower.hinges.len() - 1]);
            let chained = (first + 1..=last).all(|h| robot.hinges[h].parent == Some(h - 1));
            if !chained || last - first >= MAX_CHAIN {
                continue;
            }
            let tip = links.tips[&chain[2]];
            let elbow = links.places[lower.hinges[0]].translation.vector;
            let length = (elbow - links.places[first].translation.vector).norm() + (tip - elbow).norm();
            let whole = if leg { body.anatomy.leg_m } else { body.anatomy.arm_m };
            let tip = links.places[last].inverse_transform_point(&tip.into()).coords;
            limbs.push(Limb {
                joints: (from, to),
                hinges: (first, last),
                scale: length / whole.max(1e-6),
                tip,
                leg,
            });
        }
    }
    limbs
}

fn grow(bytes: &mut Vec<u8>, length: usize) -> usize {
    let at = bytes.len();
    bytes.resize(at + length, 0);
    at
}

fn set(bytes: &mut [u8], at: usize, range: std::ops::Range<usize>, values: &[f64]) {
    bytes[at + range.start..at + range.end].copy_from_slice(&floats(values));
}

fn floats(values: &[f64]) -> Vec<u8> {
    values.iter().flat_map(|&v| (v as f32).to_le_bytes()).collect()
}
