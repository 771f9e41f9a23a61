//! No method turns a joint beyond where the database or the input has it, by more than the margin.

use gestus_core::{Config, Database, Method, blob::layout::section};
use gestus_database::stream::{Request, Streamed, stream};
use gestus_motion::{body::Body, clip::Clip};
use gestus_tests::{motion, patch, reference, trace::Trace};

const MARGIN: f32 = 0.05;

/// At twice the strength, so that outputs go past the style. Feet are not held, since legs reach for the floor.
fn request(groups: usize, method: Method, margin: f32) -> Request {
    let config =
        Config::new().method(method).contacts(false).speed_limit(0.0).trust(0.0).joint_margin(margin);
    Request { config, strength: (0..groups as u16).map(|group| (group, 2.0)).collect(), ..Request::style(2) }
}

fn run(blob: &[u8], method: Method, margin: f32) -> (Trace, Streamed) {
    let database = Database::open(blob).unwrap();
    let mut trace = Trace::default();
    let request = request(database.counts().groups, method, margin);
    let streamed = stream(&database, &motion::unseen(0, 0, 120), &request, &mut trace).unwrap();
    (trace, streamed)
}

/// How far the outputs leave the ranges and the input at most, radians.
fn furthest_outside(database: &Database<'_>, (trace, streamed): &(Trace, Streamed)) -> f64 {
    let joints = 3 * (database.counts().joints - 1);
    let body = Body::of(&motion::corpus(motion::SMALL)).unwrap();
    let frames = streamed.steps.iter().map(|step| step.frame.clone()).collect();
    let outputs = body.clip_dofs(&Clip { frames, ..motion::unseen(0, 0, 1) });
    let ranges: Vec<[f32; 2]> = database.dof_ranges().collect();
    let ranges = &ranges[ranges.len() - joints..];
    let mut furthest = 0.0f64;
    for (output, frame) in outputs.iter().zip(&trace.frames) {
        let output = &output[output.len() - joints..];
        let x = &frame.x[frame.x.len() - joints..];
        for ((y, &x), [least, greatest]) in output.iter().zip(x).zip(ranges) {
            let (least, greatest) = (f64::from(least.min(x)), f64::from(greatest.max(x)));
            furthest = furthest.max(least - y).max(y - greatest);
        }
    }
    furthest
}

#[test]
fn joints_stay_within_their_range_and_the_input() {
    let database = Database::open(motion::small()).unwrap();
    for method in Method::ALL {
        let free = furthest_outside(&database, &run(motion::small(), method, 0.0));
        assert!(free > 0.3, "{method:?}: the output stays within {free} rad by itself");
        let limited = furthest_outside(&database, &run(motion::small(), method, MARGIN));
        let margin = f64::from(MARGIN);
        assert!((0.9 * margin..margin + 1e-4).contains(&limited), "{method:?}: {limited} rad outside");
    }
}

#[test]
fn ranges_are_those_of_the_captured_frames() {
    let database = Database::open(motion::small()).unwrap();
    let counts = *database.counts();
    let mut seen = vec![[f32::INFINITY, f32::NEG_INFINITY]; counts.dofs];
    for frame in 0..counts.frames {
        for ([least, greatest], value) in seen.iter_mut().zip(reference::row(&database, frame)) {
            let value = value as f32;
            (*least, *greatest) = (least.min(value), greatest.max(value));
        }
    }
    assert_eq!(database.dof_ranges().count(), counts.dofs);
    for (d, (range, seen)) in database.dof_ranges().zip(&seen).enumerate() {
        for (range, seen) in range.iter().zip(seen) {
            assert!((range - seen).abs() <= database.step(d), "dof {d}: {range}, in rows {seen}");
        }
    }
}

#[test]
fn a_blob_without_ranges_sets_no_limit() {
    let database = Database::open(motion::small()).unwrap();
    let old = patch::with_section(motion::small(), section::DOFS, |bytes| {
        bytes.truncate(8 * database.counts().dofs)
    });
    assert_eq!(Database::open(&old).unwrap().dof_ranges().count(), 0);
    let outputs = |blob: &[u8], margin: f32| {
        run(blob, Method::Mar, margin).1.steps.iter().map(|s| s.frame.clone()).collect::<Vec<_>>()
    };
    assert_eq!(outputs(&old, MARGIN), outputs(motion::small(), 0.0));
}
