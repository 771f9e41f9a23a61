use super::*;

#[test]
fn the_toy_has_sixteen_hinges_in_tree_order() {
    let robot = Robot::parse(TOY, "toy.urdf").unwrap();
    assert_eq!((robot.hinges.len(), robot.base.as_str()), (16, "torso"));
    assert!(robot.hinges.iter().enumerate().all(|(i, h)| h.parent.is_none_or(|p| p < i)));
    let knee = &robot.hinges[robot.find("left_knee").unwrap()];
    assert_eq!(robot.hinges[knee.parent.unwrap()].name, "left_hip_pitch");
    let feet = robot.places(&[0.0; 16]);
    let ankle = feet[robot.find("left_ankle_roll").unwrap()].translation.vector;
    // Hip 0.015 + 0.012, thigh 0.09, shin 0.086, ankle 0.006 below the base.
    assert!((ankle - Vector3::new(0.0, 0.037, -0.209)).norm() < 1e-12, "{ankle}");
    assert!(robot.fixed.iter().any(|f| f.link == "left_hand"));
}

fn robot(joints: &str) -> String {
    format!("<robot name=\"r\"><link name=\"a\"/><link name=\"b\"/><link name=\"c\"/>{joints}</robot>")
}

fn joint(name: &str, parent: &str, child: &str, more: &str) -> String {
    format!(
        "<joint name=\"{name}\" type=\"revolute\"><parent link=\"{parent}\"/><child link=\"{child}\"/>\
             <axis xyz=\"0 1 0\"/><limit lower=\"-1\" upper=\"1\" velocity=\"2\" effort=\"1\"/>{more}</joint>"
    )
}

#[test]
fn fixed_joints_are_folded_into_the_hinge_behind_them() {
    let text = format!(
        "<robot name=\"r\"><link name=\"a\"/><link name=\"m\"/><link name=\"b\"/>\
             <joint name=\"f\" type=\"fixed\"><parent link=\"a\"/><child link=\"m\"/><origin xyz=\"0 0 1\" rpy=\"0 0 1.5707963267948966\"/></joint>{}</robot>",
        joint("j", "m", "b", "<origin xyz=\"1 0 0\"/>")
    );
    let read = Robot::parse(&text, "r.urdf").unwrap();
    let at = read.hinges[0].origin.translation.vector;
    assert!((at - Vector3::new(0.0, 1.0, 1.0)).norm() < 1e-9, "{at}");
    assert_eq!(read.hinges[0].parent, None);
}

#[test]
fn nothing_hides_depth_from_the_guard() {
    let deep = |open: &str, close: &str| format!("{}{}", open.repeat(100_000), close.repeat(100_000));
    for text in [
        deep("<a x=\"/>\">", "</a>"),
        deep("<a x='/>'>", "</a>"),
        format!("<?x > <!-- ?>{}<!-- -->", deep("<a>", "</a>")),
        format!("<!-->{} -->{}", "<a/>", deep("<a>", "</a>")),
    ] {
        let error = Robot::parse(&text, "r.urdf").unwrap_err();
        assert!(matches!(error, UrdfError::Depth { .. }), "{error}");
    }
    for text in ["<robot name=\"r>", "<a><!-- ", "<?xml", "<a <![CDATA["] {
        let error = Robot::parse(text, "r.urdf").unwrap_err();
        assert!(matches!(error, UrdfError::Open { line: 1, .. }), "{text}: {error}");
    }
}

#[test]
fn a_limit_without_velocity_has_none() {
    let two = joint("j", "a", "b", "") + &joint("k", "b", "c", "").replace("velocity=\"2\" ", "");
    let read = Robot::parse(&robot(&two), "r.urdf").unwrap();
    assert_eq!((read.hinges[0].velocity, read.hinges[1].velocity), (Some(2.0), None));
    assert_eq!(read.hinges[1].range, (-1.0, 1.0));
    for (attributes, lacks) in [
        (" lower='velocity'/>", true),
        ("/>", true),
        (" velocity = '1'/>", false),
        ("\n\tvelocity=\"1\">", false),
        ("er/>", false),
    ] {
        let text = format!("<limit{attributes}");
        let expected = if lacks { format!("<limit velocity=\"0\"{attributes}") } else { text.clone() };
        assert_eq!(guard(&text, "r.urdf").unwrap(), expected);
    }
}

/// Velocities that stand for no limit gave tables that did not open.
#[test]
fn a_velocity_that_is_no_limit_is_the_greatest() {
    for (velocity, read) in
        [("1e9", Some(MAX_RATE)), ("inf", None), ("3", Some(3.0)), ("0", None), ("nan", None)]
    {
        let text = robot(&(joint("j", "a", "b", "") + &joint("k", "b", "c", "")));
        let text = text.replace("velocity=\"2\"", &format!("velocity=\"{velocity}\""));
        let hinge = &Robot::parse(&text, "r.urdf").unwrap().hinges[0];
        assert_eq!((hinge.velocity, hinge.acceleration, hinge.jerk), (read, None, None), "{velocity}");
    }
}

/// Limits in degrees below 50 were taken for radians without a word.
#[test]
fn limits_beyond_a_whole_turn_are_doubtful() {
    for (upper, doubts) in [("45", 1), ("6.2832", 0), ("1", 0)] {
        let second = joint("k", "b", "c", "").replace("upper=\"1\"", &format!("upper=\"{upper}\""));
        let read = Robot::parse(&robot(&(joint("j", "a", "b", "") + &second)), "r.urdf").unwrap();
        assert_eq!((read.hinges.len(), read.notes.len()), (2, doubts), "{upper}: {:?}", read.notes);
        assert!(read.notes.iter().all(|note| note.contains("`k`") && note.contains("in degrees")));
    }
}

/// Such a joint was held at zero, outside its limits.
#[test]
fn a_joint_without_a_range_is_held_within_its_limits() {
    for (limits, angle) in [("0.5", 0.5), ("-0.25", -0.25), ("0", 0.0)] {
        let bent = joint("k", "b", "c", "")
            .replace("lower=\"-1\" upper=\"1\"", &format!("lower=\"{limits}\" upper=\"{limits}\""));
        let read = Robot::parse(&robot(&(joint("j", "a", "b", "") + &bent)), "r.urdf").unwrap();
        assert_eq!(read.held, [Held { name: "k".into(), before: 1, single: true, angle }]);
        assert!(read.notes[0].contains(&format!("held at {angle} rad")), "{:?}", read.notes);
        let turned = read.fixed[0].origin.rotation.angle_to(&UnitQuaternion::identity());
        assert!((turned - angle.abs()).abs() < 1e-12, "{turned}");
    }
}

#[test]
fn a_motion_is_no_robot() {
    let error = Robot::parse("HIERARCHY\nROOT Hips", "walk.bvh").unwrap_err();
    assert!(
        matches!(&error, UrdfError::Tree { file, what } if file == "walk.bvh" && what.contains("a BVH file")),
        "{error}"
    );
}

#[test]
fn what_is_wrong_is_named_with_file_and_place() {
    let deep = format!("{}{}", "<a>".repeat(30), "</a>".repeat(30));
    for (text, words) in [
            ("<?xml version=\"1.0\"?>\n<!DOCTYPE r [<!ENTITY x SYSTEM \"file:///etc/passwd\">]>\n<robot name=\"r\"/>".to_owned(), vec!["r.urdf", "line 2", "document type"]),
            (deep, vec!["r.urdf", "line 1", "inside each other"]),
            ("<robot name=\"r\">".to_owned(), vec!["r.urdf"]),
            (String::new(), vec!["r.urdf"]),
            (robot(""), vec!["r.urdf", "3 links have no joint above them"]),
            (robot(&(joint("j", "a", "b", "") + &joint("k", "b", "c", ""))).replace("upper=\"1\"", "upper=\"-1\""), vec!["r.urdf", "`j` has no range", "1 more"]),
            (robot(&(joint("j", "a", "b", "") + &joint("k", "a", "nowhere", ""))), vec!["`k`", "`nowhere`"]),
            (robot(&(joint("j", "a", "b", "") + &joint("k", "c", "b", ""))), vec!["`k`", "two joints"]),
            (robot(&(joint("j", "a", "b", "") + &joint("j", "b", "c", ""))), vec!["`j`", "two joints have this name"]),
            (robot(&(joint("j", "b", "c", "") + &joint("k", "c", "b", ""))), vec!["ring"]),
            (robot(&(joint("j", "a", "b", "") + &joint("k", "b", "c", "").replace("0 1 0", "0 0 0"))), vec!["`k`", "axis"]),
            (robot(&(joint("j", "a", "b", "") + &joint("k", "b", "c", "").replace("upper=\"1\"", "upper=\"inf\""))), vec!["`k`", "limits"]),
        ] {
            let message = Robot::parse(&text, "r.urdf").unwrap_err().to_string();
            for word in words {
                assert!(message.contains(word), "{text}\n{message}");
            }
        }
}
