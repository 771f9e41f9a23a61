//! A robot made ready for a database: the tables that the core reads.

use gestus_core::{
    BlobError, Database,
    blob::{crc::crc32c, layout::MAX_JOINTS},
    robot::{
        Robot as Tables,
        layout::{self, MAX_HINGES, group, header, hinge, joint, limb},
    },
};
use nalgebra::{UnitQuaternion, Vector3};
use thiserror::Error;

use crate::models::numbers::floats;
use crate::retarget::{
    body::{Body, MapError},
    encode::{grow, set},
    parts::Part,
};
use crate::robot::{
    assign::{Assigned, Assignment, assign},
    file::{RobotMap, TICKS_HZ},
    links::{Limb, Links, limbs},
    stand::Stand,
};
use gestus_motion::formats::urdf::{MAX_RATE, Robot};

/// A robot that can't be driven.
#[derive(Debug, Error)]
#[allow(missing_docs, reason = "the messages say what the fields are")]
pub enum MachineError {
    #[error(transparent)]
    Body(#[from] MapError),
    #[error("the robot has {have} hinges, at most {MAX_HINGES} can be driven")]
    Hinges { have: usize },
    #[error(
        "no hinge could be assigned to a body part (joints: {joints}); assign one in a robot map (--robot-map): [joints.NAME] part = \"left-lower-leg\""
    )]
    Nothing { joints: String },
    #[error("tick_hz = {tick_hz}: a robot takes 1 to 1000 ticks a second")]
    Tick { tick_hz: f64 },
    #[error("hinge `{hinge}`: its servo makes no sense: check `servo` and `zero_deg` in the robot map")]
    Servo { hinge: String },
    #[error("the encoded tables are invalid")]
    Blob(#[from] BlobError),
}

/// A robot, made ready for a database.
#[derive(Debug, Clone)]
pub struct Machine {
    /// The robot.
    pub robot: Robot,
    /// The assignment of hinges to body parts.
    pub assignment: Assignment,
    /// Ticks a second.
    pub tick_hz: f64,
    /// Leg length of the robot over the body's; 0 without legs.
    pub scale: f64,
    /// From a body's axes to the base's.
    pub axes: UnitQuaternion<f64>,
    /// How it stands in its world.
    pub stand: Stand,
    /// Doubts for the user to check.
    pub doubts: Vec<String>,
    /// Doubts about servos that the map file does not describe: for those who drive servos.
    pub servo_doubts: Vec<String>,
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
        if !TICKS_HZ.contains(&tick_hz) {
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
        let stand = Stand::of(&body, &robot, &assignment, &links, axes, map, &limbs);
        doubts.extend(stand.doubts.iter().cloned());
        let mut this = Self {
            tick_hz,
            scale: 0.0,
            axes,
            stand,
            doubts,
            servo_doubts: Vec::new(),
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
        put(header::SKELETON, &database.skeleton_fingerprint().to_le_bytes());
        put(header::TICK, &((1.0 / self.tick_hz) as f32).to_le_bytes());
        let base = anatomy(body, 0) * self.axes.inverse();
        put(header::BASE, &floats(base.coords.iter().copied()));
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
            self.write_group(g, body, limbs, links, &mut bytes);
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

    fn write_group(&mut self, g: &Assigned, body: &Body, limbs: &[Limb], links: &Links, bytes: &mut Vec<u8>) {
        let at = grow(bytes, group::LENGTH);
        let first = g.hinges[0];
        bytes[at + group::FIRST] = first as u8;
        bytes[at + group::COUNT] = g.hinges.len() as u8;
        let part_joint = body.parts.get(g.part).unwrap_or(0);
        bytes[at + group::JOINT] = part_joint as u8;
        let last = g.hinges[g.hinges.len() - 1];
        let reaches = limbs.iter().position(|l| l.hinges.1 == last);
        bytes[at + group::LIMB] = reaches.map_or(0, |l| (l + 1) as u8);
        let link = links.frames[last].unwrap_or_else(UnitQuaternion::identity);
        let turn = anatomy(body, part_joint) * link.inverse();
        set(bytes, at, group::TURN, turn.coords.as_slice());
        // From the frame behind the parent.
        let mut zero = UnitQuaternion::identity();
        let mut turning = Vec::new();
        for &h in &g.hinges {
            zero *= self.robot.hinges[h].origin.rotation;
            turning.push(zero * self.robot.hinges[h].axis.into_inner());
        }
        set(bytes, at, group::ZERO, zero.coords.as_slice());
        let axes: Vec<f64> =
            (0..3).flat_map(|i| turning.get(i).copied().unwrap_or_else(Vector3::x).data.0[0]).collect();
        set(bytes, at, group::AXES, &axes);
        let pointed = pointed(g.part, &turning, &(zero * link));
        set(bytes, at, group::POINTED, (link * pointed).as_slice());
        if g.hinges.len() < 3 && pointed.norm() < 0.5 {
            self.doubts.push(format!("the hinges of the {} turn about their own link alone", g.part));
        }
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
            .unwrap_or((20.0 * velocity).min(MAX_RATE));
        let jerk = own
            .and_then(|o| o.jerk)
            .or(record.jerk)
            .or(map.jerk)
            .unwrap_or((40.0 * acceleration).min(MAX_RATE));
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
            let doubts = if own.is_some_and(|o| o.servo.is_some()) {
                &mut self.doubts
            } else {
                &mut self.servo_doubts
            };
            doubts.push(format!(
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
            return Err(MachineError::Servo { hinge: record.name.clone() });
        }
        Ok(())
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

/// The direction that one or two hinges aim, in the link's anatomical frame: one that they can rotate.
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

/// The anatomical frame of a joint; its own axes where it has none.
fn anatomy(body: &Body, joint: usize) -> UnitQuaternion<f64> {
    body.anatomy.frame(joint).unwrap_or_else(UnitQuaternion::identity)
}
