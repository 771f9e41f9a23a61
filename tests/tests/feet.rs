//! Feet: inverse kinematics of the leg, and the lock that holds a standing foot.

use std::sync::OnceLock;

use gestus_core::{Config, Database, Pose, Stylizer, body::two_bone_ik::Chain};
use gestus_database::stream::{Request, Streamed, cleanup::clean_up, from_pose, stream, to_pose};
use gestus_evaluate::metrics::{
    feet::{deepest_cm, skate_cm_s},
    performance::Performance,
    speed::{fastest, peak_speeds},
};
use gestus_motion::{
    body::{Body, database_skeleton},
    clip::{Clip, Frame},
    corpus::Corpus,
};
use gestus_tests::motion;
use nalgebra::Vector3;

type Standard<'db> = Stylizer<'db, 22, 40, 28>;

fn streamed(database: &Database<'_>, action: usize, input: usize, style: u16, held: bool) -> Streamed {
    let clip = motion::unseen(action, input, 150);
    let request = Request { config: Config::new().contacts(held), ..Request::style(style) };
    stream(database, &clip, &request, &mut ()).unwrap()
}

#[test]
fn the_ankle_meets_its_target_the_knee_keeps_its_direction_the_foot_its_orientation() {
    let database = Database::open(motion::small()).unwrap();
    let legs = database.legs().unwrap();
    let skeleton = database_skeleton(&database);
    for (t, frame) in motion::unseen(0, 0, 40).frames.iter().enumerate() {
        for leg in &legs {
            let pose = to_pose::<22>(frame);
            let chain = Chain::of(&database, leg, &pose);
            let before = from_pose(&pose, 21).positions(&skeleton);
            // The leg is compared with forward kinematics in f64.
            for (joint, place) in [(leg.hip, chain.hip), (leg.knee, chain.knee), (leg.ankle, chain.ankle)] {
                let apart = (before[joint] - Vector3::from(place.map(f64::from))).norm();
                assert!(apart < 1e-5, "frame {t}: joint {joint} is {apart} m off");
            }
            let a = t as f32;
            let target = [
                chain.ankle[0] + 0.06 * (0.7 * a).sin(),
                chain.ankle[1] + 0.03 + 0.03 * (1.3 * a).sin(),
                chain.ankle[2] + 0.08 * (0.4 * a).cos(),
            ];
            let mut moved = pose;
            chain.place(leg, target, chain.length(), &mut moved);
            let after = from_pose(&moved, 21).positions(&skeleton);
            let reached = (after[leg.ankle] - before[leg.hip]).norm() < 0.999 * f64::from(chain.length());
            let wanted = Vector3::from(target.map(f64::from));
            let missed = (after[leg.ankle] - wanted).norm();
            assert!(!reached || missed < 2e-5, "frame {t}: {missed} m from the target");
            // The knee keeps its side: the plane in which the leg bends turns with the leg.
            let knee = |p: &[Vector3<f64>]| (p[leg.knee] - p[leg.hip]).cross(&(p[leg.ankle] - p[leg.knee]));
            let (old, new) = (knee(&before), knee(&after));
            if old.norm() > 1e-3 && new.norm() > 1e-3 {
                assert!(old.normalize().dot(&new.normalize()) > 0.9, "frame {t}: the knee turned aside");
            }
            let foot = |f: &Frame| {
                [leg.ankle, leg.knee, leg.hip, 0]
                    .iter()
                    .fold(nalgebra::UnitQuaternion::identity(), |q, &j| f.rotations[j] * q)
            };
            let turned = foot(&from_pose(&moved, 21)).angle_to(&foot(&from_pose(&pose, 21)));
            assert!(turned < 1e-3, "frame {t}: the foot turned by {turned} rad");
            // Bones keep their lengths.
            for joint in [leg.knee, leg.ankle, leg.toe.unwrap()] {
                let length = |p: &[Vector3<f64>]| (p[joint] - p[skeleton.parents[joint].unwrap()]).norm();
                assert!((length(&before) - length(&after)).abs() < 1e-5);
            }
        }
    }
}

#[test]
fn a_target_out_of_reach_stretches_the_leg_and_breaks_nothing() {
    let database = Database::open(motion::small()).unwrap();
    let leg = database.legs().unwrap()[1];
    let pose = to_pose::<22>(&motion::unseen(0, 0, 40).frames[11]);
    let chain = Chain::of(&database, &leg, &pose);
    for target in
        [[9.0, -9.0, 0.0], chain.hip, [f32::NAN, 0.0, 0.0], [chain.hip[0], chain.hip[1] - 0.02, chain.hip[2]]]
    {
        let mut moved = pose;
        chain.place(&leg, target, 0.99 * chain.length(), &mut moved);
        assert!(moved.is_valid(21), "{target:?}");
        let stretched = Chain::of(&database, &leg, &moved);
        let distance = gestus_core::math::distance(stretched.hip, stretched.ankle);
        assert!(distance <= 0.9901 * chain.length(), "{target:?}: {distance}");
    }
}

/// A generated walker whose feet do not slide: a database, and a clip that is not in it.
fn walker() -> &'static (Vec<u8>, Clip) {
    static WALKER: OnceLock<(Vec<u8>, Clip)> = OnceLock::new();
    WALKER.get_or_init(|| motion::walker(&["neutral", "old", "childlike"], 6.0))
}

#[test]
fn standing_feet_stay_and_joints_turn_no_faster_for_it() {
    let (blob, clip) = walker();
    let database = Database::open(blob).unwrap();
    let legs = database.legs().unwrap();
    let styles = database.manifest().unwrap().styles;
    for style in ["old", "childlike"] {
        let style_number = styles.find(style).unwrap();
        let run = |held: bool| {
            let request = Request { config: Config::new().contacts(held), ..Request::style(style_number) };
            Performance::of_stream(&stream(&database, clip, &request, &mut ()).unwrap())
        };
        let (raw, held) = (run(false), run(true));
        let skate = |p: &Performance| skate_cm_s(&clip.skeleton, &legs, p);
        let peak = |p: &Performance| peak_speeds(p).into_iter().fold(0.0, f64::max);
        println!(
            "{style}: skate {:.1} -> {:.2} cm/s, fastest joint {:.2} -> {:.2} rad/s",
            skate(&raw),
            skate(&held),
            peak(&raw),
            peak(&held)
        );
        assert!(skate(&raw) > 2.0, "{}: nothing to hold", skate(&raw));
        assert!(skate(&held) <= 1.0, "{}", skate(&held));
        assert!(peak(&held) <= 1.2 * peak(&raw), "{} {}", peak(&held), peak(&raw));
    }
}

#[test]
fn no_foot_goes_through_the_floor() {
    let (blob, clip) = walker();
    let database = Database::open(blob).unwrap();
    let legs = database.legs().unwrap();
    // A body that sinks: every pose is 4 cm lower than it was.
    let mut sunk = clip.clone();
    sunk.frames.iter_mut().for_each(|f| f.root.y -= 0.04);
    let styles = database.manifest().unwrap().styles;
    for style in ["neutral", "old", "childlike"] {
        let run = |held: bool| {
            let config = Config::new().contacts(held);
            let request = Request { config, ..Request::style(styles.find(style).unwrap()) };
            let of = Performance::of_stream(&stream(&database, &sunk, &request, &mut ()).unwrap());
            deepest_cm(&clip.skeleton, &legs, &of)
        };
        let (raw, held) = (run(false), run(true));
        println!("{style}: lowest foot {raw:.2} -> {held:.2} cm");
        assert!(raw < -2.0, "{raw}: nothing to lift");
        assert!(held > -1.1, "{held}");
    }
}

#[test]
fn a_body_that_the_speed_limit_holds_back_stays_above_the_floor() {
    let (blob, clip) = walker();
    let database = Database::open(blob).unwrap();
    let legs = database.legs().unwrap();
    let styles = database.manifest().unwrap().styles;
    // At a quarter of its speed every style is faster than the input.
    let quarters = 0..4 * (clip.frames.len() - 1);
    let slow = Clip { frames: quarters.map(|t| clip.at(0.25 * t as f64)).collect(), ..clip.clone() };
    for style in ["neutral", "old", "childlike"] {
        let streamed =
            stream(&database, &slow, &Request::style(styles.find(style).unwrap()), &mut ()).unwrap();
        let deepest = deepest_cm(&clip.skeleton, &legs, &Performance::of_stream(&streamed));
        println!("{style}: lowest foot {deepest:.2} cm");
        assert!(deepest > -1.1, "{style}: {deepest}");
        let heights: Vec<f64> = streamed.steps.iter().map(|step| step.frame.root.y).collect();
        let jolt = heights.windows(3).map(|w| (w[2] - 2.0 * w[1] + w[0]).abs()).fold(0.0, f64::max);
        println!("{style}: the root's height bends by {:.2} cm a frame at most", 100.0 * jolt);
        assert!(jolt < 0.02, "{style}: {jolt}");
    }
}

#[test]
fn joints_turn_no_faster_than_the_input_or_its_style() {
    let database = Database::open(motion::small()).unwrap();
    // From the slowest style to the fastest.
    let clip = motion::unseen(0, 1, 200);
    let run = |limit: f32| {
        let request = Request { config: Config::new().speed_limit(limit), ..Request::style(2) };
        stream(&database, &clip, &request, &mut ()).unwrap()
    };
    // In the first two seconds the speed limit assumes 8 rad/s. After that the output has caught up.
    let late = |of: Performance| {
        fastest(&Performance {
            frames: of.frames[90..].to_vec(),
            steps_s: of.steps_s[90..].to_vec(),
            stands: of.stands[90..].to_vec(),
        })
    };
    let shown = fastest(&Performance::of_clip(&clip, &Body::of(&Corpus::of_clip(&clip)).unwrap()));
    let free = run(0.0);
    let freely = late(Performance::of_stream(&free));
    // The style's own speed, and how much faster than the input its poses follow each other.
    let of_style = (0..database.counts().classes).filter(|class| database.class(*class).style == 2);
    let turning = of_style.map(|class| f64::from(database.trust_limits(class).unwrap().turning));
    let turning = turning.fold(0.0, f64::max);
    let shortest = free.steps.iter().map(|step| f64::from(step.report.step_s)).fold(1.0, f64::min);
    let tempo = (1.0 / (clip.rate_hz * shortest)).max(1.0);
    println!(
        "fastest joint: input {shown:.2}, style {turning:.2}, output {freely:.2} rad/s, tempo {tempo:.2}"
    );
    for limit in [1.0, 1.2] {
        let of_input = f64::from(limit) * shown;
        let of_style = f64::from(limit / Config::new().speed_limit) * turning;
        let allowed = of_style.clamp(of_input, (5.0 / 3.0 * tempo * of_input).max(of_input));
        let held = late(Performance::of_stream(&run(limit)));
        println!("limit {limit}: {held:.2} of {allowed:.2} rad/s, by the input {of_input:.2}");
        assert!(freely > of_input, "{freely}: nothing to limit");
        assert!(held < 1.001 * allowed, "{held} rad/s");
        assert!(held > 1.05 * of_input || turning < of_input, "{held}: the style is not as quick as it is");
    }
    // A limit far above the actual speed changes nothing.
    assert_eq!(run(50.0).digest, free.digest);
}

#[test]
fn a_whole_clip_is_cleaned_up_without_a_pop() {
    let (blob, clip) = walker();
    let database = Database::open(blob).unwrap();
    let legs = database.legs().unwrap();
    let style = database.manifest().unwrap().styles.find("old").unwrap();
    let request = Request { config: Config::new().contacts(false), ..Request::style(style) };
    let mut streamed = stream(&database, clip, &request, &mut ()).unwrap();
    let raw = Performance::of_stream(&streamed);
    clean_up(&database, &mut streamed, 8);
    let cleaned = Performance::of_stream(&streamed);
    let skate = |p: &Performance| skate_cm_s(&clip.skeleton, &legs, p);
    let peak = |p: &Performance| peak_speeds(p).into_iter().fold(0.0, f64::max);
    println!(
        "whole clip: skate {:.1} -> {:.2} cm/s, fastest joint {:.2} -> {:.2} rad/s",
        skate(&raw),
        skate(&cleaned),
        peak(&raw),
        peak(&cleaned)
    );
    assert!(skate(&cleaned) <= 1.0 && skate(&raw) > 5.0, "{} {}", skate(&raw), skate(&cleaned));
    // A whole footplant moves to its mean place: 1.27 here.
    assert!(peak(&cleaned) <= 1.3 * peak(&raw), "{} {}", peak(&raw), peak(&cleaned));
    // Arms and trunk do not change.
    let leg_joints: Vec<usize> = legs.iter().flat_map(|l| [l.hip, l.knee, l.ankle]).collect();
    for (a, b) in raw.frames.iter().zip(&cleaned.frames) {
        for j in (0..a.rotations.len()).filter(|j| !leg_joints.contains(j)) {
            assert!(a.rotations[j].angle_to(&b.rotations[j]) < 1e-5);
        }
    }
}

#[test]
fn a_body_that_stands_before_it_walks_stands() {
    let (blob, clip) = walker();
    let database = Database::open(blob).unwrap();
    // Everything in the database walks at 1 m/s or faster.
    let mut clip = clip.clone();
    clip.frames.splice(0..0, vec![clip.frames[0].clone(); 20]);
    for (style, name) in ["neutral", "old", "childlike"].iter().enumerate() {
        let streamed = stream(&database, &clip, &Request::style(style as u16), &mut ()).unwrap();
        let root = |t: usize| streamed.steps[t].frame.root;
        let way = |a: usize, b: usize| (root(b).x - root(a).x).hypot(root(b).z - root(a).z);
        println!("{name}: {:.3} m in 19 frames of stillness, {:.2} in 30 of walk", way(0, 19), way(30, 60));
        assert!(way(0, 19) < 0.04, "{name} walks");
        assert!(way(30, 60) > 0.5, "{name} stands");
    }
}

#[test]
fn the_prediction_is_the_same_with_and_without_the_lock() {
    let database = Database::open(motion::small()).unwrap();
    let (raw, held) = (streamed(&database, 0, 0, 1, false), streamed(&database, 0, 0, 1, true));
    for (a, b) in raw.steps.iter().zip(&held.steps) {
        assert_eq!(a.report.step_s.to_bits(), b.report.step_s.to_bits());
        assert_eq!(a.report.classes, b.report.classes);
        // Arms and trunk have the same bits as the prediction.
        for j in (0..21).filter(|j| !(13..21).contains(j)) {
            assert_eq!(a.frame.rotations[j], b.frame.rotations[j], "joint {j}");
        }
    }
    assert!(raw.steps.iter().all(|s| s.report.held == [false; 2] && s.report.held_m == [0.0; 2]));
    assert!(held.steps.iter().any(|s| s.report.held != [false; 2]));
}

#[test]
fn nothing_is_looked_ahead_to() {
    let database = Database::open(motion::small()).unwrap();
    let clip = motion::unseen(0, 0, 90);
    let poses: Vec<Pose<22>> = clip.frames.iter().map(to_pose).collect();
    let run = |poses: &[Pose<22>]| {
        let mut stylizer = Standard::new(database, Config::new()).unwrap();
        stylizer.set_style(&[(1, 1.0)]).unwrap();
        let mut output = Pose::IDENTITY;
        poses
            .iter()
            .map(|p| {
                let _ = stylizer.step(p, &mut output);
                output
            })
            .collect::<Vec<_>>()
    };
    let mut other = poses.clone();
    other[60..].reverse();
    assert_eq!(run(&poses)[..60], run(&other)[..60]);
}

#[test]
fn a_foot_that_is_too_far_off_steps_and_is_held_again() {
    let database = Database::open(motion::small()).unwrap();
    let (legs, skeleton) = (database.legs().unwrap(), database_skeleton(&database));
    let clip = motion::unseen(0, 0, 150);
    let run = |config: Config| {
        let request = Request { config: config.speed_limit(0.0), ..Request::style(1) };
        stream(&database, &clip, &request, &mut ()).unwrap()
    };
    let (raw, streamed) = (run(Config::new().contacts(false)), run(Config::new().release_m(0.03)));
    let report = |t: usize| &streamed.steps[t].report;
    // Distance of an ankle from its prediction on the ground, relative to the hip joint, which the lock also moves.
    let apart = |t: usize, side: usize| {
        let ankle = |of: &Streamed| {
            let places = of.steps[t].frame.positions(&skeleton);
            places[legs[side].ankle] - places[legs[side].hip]
        };
        let way = ankle(&streamed) - ankle(&raw);
        way.x.hypot(way.z)
    };
    let held = (0..140).flat_map(|t| [(t, 0), (t, 1)]).filter(|&(t, side)| report(t).held[side]);
    let held_most = held.map(|(t, side)| apart(t, side)).fold(0.0, f64::max);
    assert!(held_most < 0.031, "held {held_most} m from its prediction");
    let mut steps = 0;
    for (t, side) in (1..140).flat_map(|t| [(t, 0), (t, 1)]) {
        let stands = |t: usize| raw.steps[t].report.contacts[side];
        if !report(t - 1).held[side] || report(t).held[side] || !stands(t) {
            continue;
        }
        steps += 1;
        assert!(report(t).held_m[side] > 0.03, "frame {t}: let go at {} m", report(t).held_m[side]);
        // Easing 3 cm and the motion of a frame takes at most 8 frames with the shortest easing time.
        let frames = (t..t + 9).take_while(|&t| stands(t) && !report(t).held[side]).count();
        assert!(frames < 9, "frame {t}: {frames} frames without hold");
        assert!((t..t + frames).all(|t| !report(t).contacts[side]), "frame {t}: stands while it steps");
        for (a, b) in (t..t + frames - 1).map(|t| (report(t), report(t + 1))) {
            let eased = a.held_m[side] - b.held_m[side];
            assert!(eased < 1.1 * b.step_s, "{eased} m in a frame");
        }
    }
    assert!(steps > 0, "no foot was let go at 3 cm");
    let slides = skate_cm_s(&skeleton, &legs, &Performance::of_stream(&streamed));
    assert!(slides < 1.0, "{slides} cm/s");
}

#[test]
fn the_offset_of_a_foot_that_goes_up_is_eased_out() {
    let database = Database::open(motion::small()).unwrap();
    // These feet never come far enough from their predictions to be released, so none steps.
    let request = Request { config: Config::new().release_m(1.0), ..Request::style(1) };
    let streamed = stream(&database, &motion::unseen(0, 0, 150), &request, &mut ()).unwrap();
    let mut returning = 0;
    // An offset that is eased out moves no foot by more than a few millimetres a frame.
    for w in streamed.steps.windows(2) {
        for i in [0, 1] {
            if !w[0].report.held[i] && !w[1].report.held[i] {
                let eased = w[0].report.held_m[i] - w[1].report.held_m[i];
                assert!(eased < 0.3 * w[1].report.step_s + 1e-4, "{eased}");
                returning += usize::from(eased > 1e-4);
            }
        }
    }
    assert!(returning > 20, "{returning} frames of feet on their way back");
}

#[test]
fn the_body_follows_the_floor_smoothly() {
    let (blob, clip) = walker();
    let database = Database::open(blob).unwrap();
    let legs = database.legs().unwrap();
    let joints = clip.skeleton.joints();
    let last = clip.frames.len() - 1;
    let run = |floor: f32| {
        let mut stylizer = Standard::new(database, Config::new()).unwrap();
        let mut output = Pose::IDENTITY;
        clip.frames
            .iter()
            .enumerate()
            .map(|(t, frame)| {
                if t == 60 {
                    stylizer.set_floor([floor; 2]).unwrap();
                }
                let report = stylizer.step(&to_pose(frame), &mut output);
                (from_pose(&output, joints), report)
            })
            .collect::<Vec<_>>()
    };
    let (flat, step) = (run(0.0), run(0.12));
    let rise = |t: usize| step[t].0.root.y - flat[t].0.root.y;
    assert!(rise(59).abs() < 1e-9 && (rise(last) - 0.12).abs() < 0.02, "{}", rise(last));
    for t in 1..=last {
        assert!((rise(t) - rise(t - 1)).abs() < 0.03, "frame {t}: {} m in a frame", rise(t) - rise(t - 1));
    }
    // At the end, standing feet are on the new floor.
    for (frame, report) in &step[130..] {
        let p = frame.positions(&clip.skeleton);
        for (side, leg) in legs.iter().enumerate().filter(|(i, _)| report.held[*i]) {
            let over = (p[leg.ankle].y - f64::from(leg.heights[0]))
                .min(p[leg.toe.unwrap()].y - f64::from(leg.heights[1]));
            assert!((over - 0.12).abs() < 0.04, "side {side}: {over}");
        }
    }
    // A stream begins on the floor that was set, whether another one came before or not.
    let (mut new, mut reset) =
        (Standard::new(database, Config::new()).unwrap(), Standard::new(database, Config::new()).unwrap());
    let mut outputs = [Pose::IDENTITY; 2];
    let _ = reset.step(&to_pose(&clip.frames[0]), &mut outputs[1]);
    for stylizer in [&mut new, &mut reset] {
        stylizer.set_floor([0.2; 2]).unwrap();
    }
    reset.reset();
    for frame in &clip.frames[..60] {
        let _ = (new.step(&to_pose(frame), &mut outputs[0]), reset.step(&to_pose(frame), &mut outputs[1]));
        assert_eq!(outputs[0], outputs[1]);
    }
    let mut stylizer = Standard::new(database, Config::new()).unwrap();
    assert!(stylizer.set_floor([f32::NAN, 0.0]).is_err() && stylizer.set_floor([0.0, 11.0]).is_err());
}

#[test]
fn the_state_stays_small() {
    assert!(
        size_of::<gestus_core::output::foot_lock::Lock>() <= 128,
        "{}",
        size_of::<gestus_core::output::foot_lock::Lock>()
    );
    assert!(size_of::<Standard<'_>>() <= 24_576, "{}", size_of::<Standard<'_>>());
}
