//! URDF, the description format of robots: the tree of links and hinges of a file, read by `urdf-rs`.
//!
//! Files are untrusted. Before the XML is parsed into a tree, its size and depth are limited, and a document type is
//! refused, since that is where entities are declared. Then links and joints have to form one tree, numbers have to be
//! finite, and axes have to have a direction. Every error names the file, and the line or the joint.

use std::path::Path;

use nalgebra::{Isometry3, UnitQuaternion, UnitVector3, Vector3};
use quick_xml::{Error as XmlError, Reader, errors::SyntaxError, events::Event};
use thiserror::Error;

use crate::files::{self, FileError};

mod held;
mod mimic;
mod shape;

pub use held::Held;
use held::{held, rest};
pub use mimic::Mimic;
use mimic::mimic;
pub use shape::Shape;
use shape::{isometry, shapes};

/// The toy humanoid of 16 servos that comes with the project.
pub const TOY: &str = include_str!("../../assets/toy.urdf");

/// Greatest rate of a hinge, in rad/s and its derivatives.
pub const MAX_RATE: f64 = 1e6;

/// Largest file, bytes.
pub const MAX_BYTES: usize = 4 << 20;
/// Deepest nesting of elements.
pub const MAX_DEPTH: usize = 24;
/// Most elements: those of a robot of [`MAX_JOINTS`] with several shapes a link are a tenth of it.
const MAX_ELEMENTS: usize = 1 << 16;
/// Longest tag with its attributes, bytes: they are compared with each other.
const MAX_TAG_BYTES: usize = 16 << 10;
/// Most joints.
pub const MAX_JOINTS: usize = 512;

/// A rotating joint.
#[derive(Debug, Clone, PartialEq)]
pub struct Hinge {
    /// The joint's name.
    pub name: String,
    /// Name of the link behind it.
    pub link: String,
    /// The hinge before it, across any number of fixed joints; `None`: the base.
    pub parent: Option<usize>,
    /// From the frame behind the parent hinge to its own frame, at angle zero, metres.
    pub origin: Isometry3<f64>,
    /// Axis in its own frame.
    pub axis: UnitVector3<f64>,
    /// Least and greatest angle, radians.
    pub range: (f64, f64),
    /// Greatest velocity, rad/s; `None` where the file says none.
    pub velocity: Option<f64>,
    /// Greatest acceleration, rad/s² (URDF 1.2).
    pub acceleration: Option<f64>,
    /// Greatest jerk, rad/s³ (URDF 1.2).
    pub jerk: Option<f64>,
    /// What it follows, for one without a motor of its own.
    pub mimics: Option<Mimic>,
}

/// A link behind a fixed joint, such as the end of a limb.
#[derive(Debug, Clone, PartialEq)]
pub struct Fixed {
    /// The link.
    pub link: String,
    /// The hinge before it; `None`: the base.
    pub parent: Option<usize>,
    /// Its frame in the frame behind that hinge.
    pub origin: Isometry3<f64>,
}

/// A robot: its hinges, parents before children, depth first.
#[derive(Debug, Clone, PartialEq)]
pub struct Robot {
    /// Its name.
    pub name: String,
    /// The root link.
    pub base: String,
    /// The hinges.
    pub hinges: Vec<Hinge>,
    /// Links behind fixed joints.
    pub fixed: Vec<Fixed>,
    /// Joints that are held, depth first.
    pub held: Vec<Held>,
    /// Shapes of links that are no meshes.
    pub shapes: Vec<Shape>,
    /// Deviations from the file: joints that are held, and limits that are doubtful.
    pub notes: Vec<String>,
}

/// A file that can't be used.
#[derive(Debug, Error)]
#[allow(missing_docs, reason = "the messages say what the fields are")]
pub enum UrdfError {
    #[error("{file} can't be read: {error}")]
    Read { file: String, error: FileError },
    #[error("{file}: {bytes} bytes, a robot has at most {MAX_BYTES}")]
    Size { file: String, bytes: usize },
    #[error(
        "{file}, line {line}: a document type or entity; these are not read: take it out (run xacro first)"
    )]
    Doctype { file: String, line: usize },
    #[error("{file}, line {line}: more than {MAX_DEPTH} elements inside each other")]
    Depth { file: String, line: usize },
    #[error("{file}, line {line}: a tag, comment or instruction has no end")]
    Open { file: String, line: usize },
    #[error("{file}, line {line}: a tag of more than {MAX_TAG_BYTES} bytes")]
    Tag { file: String, line: usize },
    #[error(
        "{file}: more than {MAX_ELEMENTS} elements, which no robot has: leave out what is not of the robot"
    )]
    Elements { file: String },
    #[error("{file}: {joints} joints, a robot has at most {MAX_JOINTS}")]
    Joints { file: String, joints: usize },
    #[error("{file}: {error}")]
    Xml { file: String, error: Box<urdf_rs::UrdfError> },
    #[error("{file}, joint `{joint}`: {what}")]
    Joint { file: String, joint: String, what: String },
    #[error("{file}: {what}")]
    Tree { file: String, what: String },
}

impl Robot {
    /// Reads a file.
    ///
    /// # Errors
    /// [`UrdfError`] names the file and the place.
    pub fn read(path: &Path) -> Result<Self, UrdfError> {
        let file = path.display().to_string();
        let text = files::read_text(path, MAX_BYTES as u64)
            .map_err(|error| UrdfError::Read { file: file.clone(), error })?;
        Self::parse(&text, &file)
    }

    /// Reads a text; `file` is for messages.
    ///
    /// # Errors
    /// As [`read`](Self::read).
    pub fn parse(text: &str, file: &str) -> Result<Self, UrdfError> {
        let text = guard(text, file)?;
        let robot = urdf_rs::read_from_string(&text)
            .map_err(|error| UrdfError::Xml { file: file.to_owned(), error: Box::new(error) })?;
        if robot.joints.len() > MAX_JOINTS {
            return Err(UrdfError::Joints { file: file.to_owned(), joints: robot.joints.len() });
        }
        tree(&robot, file)
    }

    /// Index of the hinge of that name.
    pub fn find(&self, name: &str) -> Option<usize> {
        self.hinges.iter().position(|h| h.name == name)
    }

    /// Frames behind the hinges at those angles, in the base's frame. Shape `[hinges]`.
    pub fn places(&self, angles: &[f64]) -> Vec<Isometry3<f64>> {
        let mut places: Vec<Isometry3<f64>> = Vec::with_capacity(self.hinges.len());
        for (hinge, &angle) in self.hinges.iter().zip(angles) {
            let before = hinge.parent.map_or_else(Isometry3::identity, |p| places[p]);
            places.push(before * hinge.origin * UnitQuaternion::from_axis_angle(&hinge.axis, angle));
        }
        places
    }
}

/// Looks at the markup before the tree is parsed, without recursion. Gives the text back without what `urdf-rs` refuses
/// although it is no part of a robot's motion: without textures, which it wants to be files, and with a velocity of 0, which
/// stands for none, in each `limit` that has none.
fn guard(text: &str, file: &str) -> Result<String, UrdfError> {
    let file = || file.to_owned();
    if text.len() > MAX_BYTES {
        return Err(UrdfError::Size { file: file(), bytes: text.len() });
    }
    let start = text.trim_start_matches(|c: char| c.is_whitespace() || c == '\u{feff}');
    if !start.starts_with('<') {
        if start.is_empty() {
            return Err(UrdfError::Tree { file: file(), what: "the file is empty".to_owned() });
        }
        let word: String = start.split_whitespace().next().unwrap_or("").chars().take(40).collect();
        let is = if word == "HIERARCHY" { "; this is a BVH file, a motion" } else { "" };
        let what = format!("not a URDF file, which begins with `<`: it begins with `{word}`{is}");
        return Err(UrdfError::Tree { file: file(), what });
    }
    let skipped = text.len() - start.len();
    let mut reader = Reader::from_str(start);
    // Names of ends and entities are checked by the parser behind this one.
    let config = reader.config_mut();
    (config.check_end_names, config.allow_unmatched_ends, config.allow_dangling_amp) = (false, true, true);
    let mut whole = text[..skipped].to_owned();
    let (mut depth, mut elements) = (0usize, 0usize);
    loop {
        let at = skipped + reader.buffer_position() as usize;
        let line = || text[..at].matches('\n').count() + 1;
        let event = reader.read_event().map_err(|error| match error {
            XmlError::Syntax(SyntaxError::UnclosedDoctype | SyntaxError::InvalidBangMarkup) => {
                UrdfError::Doctype { file: file(), line: line() }
            }
            _ => UrdfError::Open { file: file(), line: line() },
        })?;
        match &event {
            Event::DocType(_) => return Err(UrdfError::Doctype { file: file(), line: line() }),
            Event::Start(_) => depth += 1,
            Event::End(_) => depth = depth.saturating_sub(1),
            Event::Eof => return Ok(whole),
            _ => {}
        }
        if depth > MAX_DEPTH {
            return Err(UrdfError::Depth { file: file(), line: line() });
        }
        let markup = &text[at..skipped + reader.buffer_position() as usize];
        if let Event::Start(_) | Event::Empty(_) = event {
            elements += 1;
            if elements > MAX_ELEMENTS {
                return Err(UrdfError::Elements { file: file() });
            }
            if markup.len() > MAX_TAG_BYTES {
                return Err(UrdfError::Tag { file: file(), line: line() });
            }
        }
        let is_texture = match &event {
            Event::Start(tag) | Event::Empty(tag) => tag.name().as_ref() == b"texture",
            Event::End(tag) => tag.name().as_ref() == b"texture",
            _ => false,
        };
        match (event, markup.strip_prefix("<limit")) {
            _ if is_texture => {}
            (Event::Start(tag) | Event::Empty(tag), Some(attributes))
                if tag.name().as_ref() == b"limit"
                    && matches!(tag.try_get_attribute("velocity"), Ok(None)) =>
            {
                whole.extend(["<limit velocity=\"0\"", attributes]);
            }
            _ => whole.push_str(markup),
        }
    }
}

/// The index of the link of that name.
fn link(robot: &urdf_rs::Robot, name: &str) -> Option<usize> {
    robot.links.iter().position(|link| link.name == name)
}

/// The joint above each link, `None` for the base. Refuses joints whose links are missing or have another joint.
fn joints_above<'a>(
    robot: &'a urdf_rs::Robot,
    of: &dyn Fn(&urdf_rs::Joint, &str) -> UrdfError,
) -> Result<Vec<Option<&'a urdf_rs::Joint>>, UrdfError> {
    let mut above = vec![None; robot.links.len()];
    for (j, joint) in robot.joints.iter().enumerate() {
        let Some(below) = link(robot, &joint.child.link) else {
            return Err(of(joint, &format!("its child `{}` is no link", joint.child.link)));
        };
        if link(robot, &joint.parent.link).is_none() {
            return Err(of(joint, &format!("its parent `{}` is no link", joint.parent.link)));
        }
        if above[below].replace(joint).is_some() {
            return Err(of(joint, &format!("`{}` is the child of two joints", joint.child.link)));
        }
        if robot.joints[..j].iter().any(|other| other.name == joint.name) {
            return Err(of(joint, "two joints have this name"));
        }
    }
    Ok(above)
}

/// Walks from the base to the ends of a robot.
fn tree(robot: &urdf_rs::Robot, file: &str) -> Result<Robot, UrdfError> {
    let fail = |what: String| UrdfError::Tree { file: file.to_owned(), what };
    let of = |joint: &urdf_rs::Joint, what: &str| UrdfError::Joint {
        file: file.to_owned(),
        joint: joint.name.clone(),
        what: what.to_owned(),
    };
    let above = joints_above(robot, &of)?;
    let roots: Vec<usize> = (0..robot.links.len()).filter(|&l| above[l].is_none()).collect();
    if robot.links.is_empty() {
        return Err(fail(
            "no links: a xacro file has to be expanded first (`xacro FILE > robot.urdf`)".to_owned(),
        ));
    }
    let &[base] = roots.as_slice() else {
        return Err(fail(format!("{} links have no joint above them; expected one, the base", roots.len())));
    };
    let mut read = Robot {
        name: robot.name.clone(),
        base: robot.links[base].name.clone(),
        hinges: Vec::new(),
        fixed: Vec::new(),
        held: Vec::new(),
        shapes: Vec::new(),
        notes: Vec::new(),
    };
    // Links to visit: the link, the hinge before it, and the transform from there. Joints in the order of the file.
    let mut open = vec![(base, None, Isometry3::identity())];
    let mut seen = 0;
    while let Some((l, behind, at)) = open.pop() {
        seen += 1;
        let (mut behind, mut at) = (behind, at);
        if let Some(joint) = above[l] {
            match hinge(joint, behind, at, &mut read.notes).map_err(|what| of(joint, &what))? {
                Some(hinge) => {
                    read.hinges.push(hinge);
                    // Links behind it begin in its frame.
                    (behind, at) = (Some(read.hinges.len() - 1), Isometry3::identity());
                }
                None => {
                    if let Some(held) = held(joint, read.hinges.len()) {
                        at *= held.turn(joint);
                        read.held.push(held);
                    }
                    read.fixed.push(Fixed { link: robot.links[l].name.clone(), parent: behind, origin: at })
                }
            }
        }
        read.shapes.extend(shapes(&robot.links[l], behind, at));
        // Popped from the end: children in the order of the file.
        for joint in robot.joints.iter().rev().filter(|j| j.parent.link == robot.links[l].name) {
            let origin = at * isometry(&joint.origin);
            let mut numbers = origin.translation.vector.iter().chain(origin.rotation.coords.iter());
            if !numbers.all(|v| v.is_finite() && v.abs() < 100.0) {
                return Err(of(joint, "its origin is not finite or further than 100 m"));
            }
            if let Some(below) = link(robot, &joint.child.link) {
                open.push((below, behind, origin));
            }
        }
    }
    if seen != robot.links.len() {
        return Err(fail("some joints form a ring that is not connected to the base".to_owned()));
    }
    if read.hinges.is_empty() {
        let why = match &read.notes[..] {
            [] => "all joints are fixed".to_owned(),
            [one] => one.clone(),
            [first, more @ ..] => format!("{first}; {} more joints are held too", more.len()),
        };
        return Err(fail(format!("no joint turns: {why}; give the joints type and limits of hinges")));
    }
    Ok(read)
}

/// A joint as a hinge; `None` if it is held fixed.
fn hinge(
    joint: &urdf_rs::Joint,
    parent: Option<usize>,
    origin: Isometry3<f64>,
    notes: &mut Vec<String>,
) -> Result<Option<Hinge>, String> {
    use urdf_rs::JointType::{Continuous, Fixed, Floating, Planar, Prismatic, Revolute, Spherical};
    let range = match joint.joint_type {
        Fixed => return Ok(None),
        Prismatic | Floating | Planar | Spherical => {
            notes.push(format!("joint `{}` is no hinge: it is held at zero", joint.name));
            return Ok(None);
        }
        Continuous => (-std::f64::consts::PI, std::f64::consts::PI),
        Revolute => (joint.limit.lower, joint.limit.upper),
    };
    let axis =
        UnitVector3::try_new(Vector3::from(joint.axis.xyz.0), 1e-6).ok_or("its axis has no direction")?;
    if !(range.0.is_finite() && range.1.is_finite() && range.0.abs() < 50.0 && range.1.abs() < 50.0) {
        return Err(format!(
            "its limits are {} to {} rad: give radians below 50, or make the joint `continuous`",
            range.0, range.1
        ));
    }
    if range.1 - range.0 < 1e-3 {
        notes.push(format!("joint `{}` has no range: it is held at {} rad", joint.name, rest(joint)));
        return Ok(None);
    }
    // A whole turn may be rounded up.
    if range.0.abs().max(range.1.abs()) > 1.01 * std::f64::consts::TAU {
        notes.push(format!(
            "joint `{}` turns from {} to {} rad, further than a whole turn: are its limits in degrees?",
            joint.name, range.0, range.1
        ));
    }
    // Numbers that stand for no limit are beyond what tables can hold. Infinite is what the file does not say.
    let rate = |v: f64| Some(v).filter(|v| v.is_finite() && *v > 1e-3).map(|v| v.min(MAX_RATE));
    Ok(Some(Hinge {
        name: joint.name.clone(),
        link: joint.child.link.clone(),
        parent,
        origin,
        axis,
        range,
        velocity: rate(joint.limit.velocity),
        acceleration: rate(joint.limit.acceleration),
        jerk: rate(joint.limit.jerk),
        mimics: mimic(joint)?,
    }))
}

#[cfg(test)]
mod tests;
