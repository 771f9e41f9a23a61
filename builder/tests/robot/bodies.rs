//! Robots made of the generated body, as URDF: their truth is known.

use std::fmt::Write;

use gestus_motion::clip::Skeleton;
use nalgebra::UnitQuaternion;

/// The generated body as a robot: three hinges a joint, about axes in an order of its own for every joint, strong
/// enough for anything. The same proportions, so hands and feet have to be where the body's are.
pub fn body_as_robot(skeleton: &Skeleton) -> String {
    let name = |j: usize| {
        let (stem, side) = skeleton.names[j].split_once('_').unwrap_or((&skeleton.names[j], ""));
        let side = match side {
            "L" => "left_",
            "R" => "right_",
            _ => "",
        };
        let stem = match stem {
            "UpperArm" => "shoulder",
            "LowerArm" => "elbow",
            "Hand" => "wrist",
            "UpperLeg" => "hip",
            "LowerLeg" => "knee",
            "Foot" => "ankle",
            "Chest" => "chest",
            "Head" => "head",
            _ => return None,
        };
        Some(format!("{side}{stem}"))
    };
    let mut text = String::from("<robot name=\"body\"><link name=\"j0\"/>");
    let axes = ["1 0 0", "0 1 0", "0 0 1"];
    let orders = [[0, 1, 2], [2, 0, 1], [1, 2, 0], [2, 1, 0], [0, 2, 1], [1, 0, 2]];
    for j in 1..skeleton.joints() {
        let parent = skeleton.parents[j].unwrap();
        // Y up and ahead along Z, as the map says.
        let at = skeleton.offsets[j];
        let origin = format!("<origin xyz=\"{} {} {}\"/>", at.x, at.y, at.z);
        let _ = write!(text, "<link name=\"j{j}\"/>");
        match name(j) {
            None => {
                let _ = write!(
                    text,
                    "<joint name=\"f{j}\" type=\"fixed\"><parent link=\"j{parent}\"/><child link=\"j{j}\"/>{origin}</joint>"
                );
            }
            Some(name) => {
                let order = orders[j % orders.len()];
                for (i, axis) in order.into_iter().enumerate() {
                    let from = if i == 0 { format!("j{parent}") } else { format!("j{j}_{i}") };
                    let to = if i == 2 { format!("j{j}") } else { format!("j{j}_{}", i + 1) };
                    if i < 2 {
                        let _ = write!(text, "<link name=\"{to}\"/>");
                    }
                    let origin = if i == 0 { origin.as_str() } else { "" };
                    let _ = write!(
                        text,
                        "<joint name=\"{name}_{i}\" type=\"continuous\"><parent link=\"{from}\"/><child link=\"{to}\"/>\
                         {origin}<axis xyz=\"{}\"/><limit velocity=\"60\" effort=\"9\" lower=\"-3.14\" upper=\"3.14\"/></joint>",
                        axes[axis]
                    );
                }
            }
        }
    }
    text + "</robot>"
}

/// Puts a turned hinge in front of one that is a joint's first. At angle zero every link stays where it is.
pub fn with_hinge_before(text: &str, first: &str, extra: &str) -> String {
    let start = format!("<joint name=\"{first}\" type=\"continuous\"><parent link=\"");
    let (before, rest) = text.split_once(&start).unwrap();
    let (parent, rest) = rest.split_once('"').unwrap();
    let (child, rest) = rest.split_once("<origin xyz=\"").unwrap();
    let (at, rest) = rest.split_once('"').unwrap();
    let turn = UnitQuaternion::from_euler_angles(0.4, -0.3, 0.5);
    let [there, back] = [turn, turn.inverse()].map(|turn| {
        let (roll, pitch, yaw) = turn.euler_angles();
        format!("rpy=\"{roll} {pitch} {yaw}\"")
    });
    format!(
        "{before}<link name=\"{extra}\"/><joint name=\"{extra}\" type=\"continuous\"><parent link=\"{parent}\"/>\
         <child link=\"{extra}\"/><origin xyz=\"{at}\" {there}/><axis xyz=\"1 0 0\"/></joint>\
         {start}{extra}\"{child}<origin xyz=\"0 0 0\" {back}{rest}"
    )
}
