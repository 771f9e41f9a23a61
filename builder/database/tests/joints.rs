//! A corpus on some of its joints.

use gestus_database::synth;
use gestus_motion::joints::{JointsError, kept};

fn names(list: &[&str]) -> Vec<String> {
    list.iter().map(|n| (*n).to_owned()).collect()
}

#[test]
fn kept_joints_are_where_they_were() {
    let options = synth::Options {
        actions: names(&["walk"]),
        styles: names(&["neutral"]),
        clips: 1,
        seconds: 3.0,
        ..synth::Options::default()
    };
    let whole = synth::corpus(&options).unwrap();
    let wanted: Vec<String> = whole.skeleton.names[..3].to_vec();
    let few = whole.on_joints(&wanted).unwrap();
    assert_eq!(few.skeleton.names, wanted);
    let (a, b) = (&whole.examples[0].clip, &few.examples[0].clip);
    for (x, y) in a.frames.iter().zip(&b.frames) {
        let (x, y) = (x.positions(&a.skeleton), y.positions(&b.skeleton));
        for joint in 0..3 {
            assert!((x[joint] - y[joint]).norm() < 1e-12);
        }
    }
    assert_eq!(few.examples[0].contacts, whole.examples[0].contacts);
}

#[test]
fn a_joint_without_its_parent_is_refused_by_name() {
    let skeleton = synth::skeleton();
    let child = (0..skeleton.joints()).find(|&j| skeleton.parents[j].is_some_and(|p| p > 0)).unwrap();
    let root = skeleton.names[0].clone();
    let error = kept(&skeleton, &[root.clone(), skeleton.names[child].clone()]).unwrap_err();
    assert!(matches!(error, JointsError::Parent { joint, .. } if joint == skeleton.names[child]));
    let error = kept(&skeleton, &[root, "Tail".into()]).unwrap_err();
    assert!(matches!(error, JointsError::Unknown { name, .. } if name == "Tail"));
}
