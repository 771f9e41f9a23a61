//! Clips as people have them: on a floor of their own, in place, as loops, unlike the database. Each comes out as the same
//! clip translated plainly, and moved back.

mod common;

use std::{path::PathBuf, sync::Arc};

use common::{database, walk};
use gestus_core::Method;
use gestus_database::{
    registration::floor::Source,
    retarget::{MapError, MapFile},
    stream::{
        Request,
        course::{self, Root},
        input::{Input, InputOptions},
        looped::LoopError,
        translate::translate,
        verdict::{self, Likeness, Verdict},
    },
    synth,
};
use gestus_motion::{
    body::Body,
    clip::{Clip, Frame, Skeleton},
    corpus::Corpus,
    formats::bvh::Bvh,
    unit::Unit,
};
use nalgebra::{UnitQuaternion, Vector3};

/// Reads a clip as from a file.
fn read(clip: &Clip, reading: &InputOptions) -> anyhow::Result<Input> {
    static COUNT: std::sync::atomic::AtomicUsize = std::sync::atomic::AtomicUsize::new(0);
    let number = COUNT.fetch_add(1, std::sync::atomic::Ordering::Relaxed);
    let path: PathBuf =
        std::env::temp_dir().join(format!("gestus-ground-{}-{number}.bvh", std::process::id()));
    std::fs::write(&path, Bvh::from_clip(clip, Unit::Centimetres).unwrap().to_text()).unwrap();
    let input = Input::read_with(&path, &database(), reading);
    std::fs::remove_file(path).unwrap();
    input
}

/// A clip in the second style.
fn styled(clip: &Clip, reading: &InputOptions) -> (Input, Clip) {
    let input = read(clip, reading).unwrap();
    let streamed = translate(&database(), &input, &Request::style(1), &mut ()).unwrap();
    let output = input.output(&streamed);
    (input, output)
}

fn changed(clip: &Clip, change: impl Fn(&mut Frame)) -> Clip {
    let mut clip = clip.clone();
    clip.frames.iter_mut().for_each(change);
    clip
}

/// The walk on a body without toes.
fn without_toes() -> Clip {
    let clip = walk();
    let kept: Vec<usize> =
        (0..clip.skeleton.joints()).filter(|&j| !clip.skeleton.names[j].contains("Toes")).collect();
    let place = |j: usize| kept.iter().position(|&k| k == j);
    let skeleton = Skeleton {
        names: kept.iter().map(|&j| clip.skeleton.names[j].clone()).collect(),
        parents: kept.iter().map(|&j| clip.skeleton.parents[j].and_then(place)).collect(),
        offsets: kept.iter().map(|&j| clip.skeleton.offsets[j]).collect(),
    };
    let frame = |f: &Frame| f.on_joints(&kept);
    Clip { frames: clip.frames.iter().map(frame).collect(), skeleton: Arc::new(skeleton), ..clip.clone() }
}

/// Largest distance of the joints of two clips, their roots at one place, centimetres; and of their roots' heights.
fn apart(a: &Clip, b: &Clip) -> [f64; 2] {
    let mut most = [0.0f64; 2];
    for (f, g) in a.frames.iter().zip(&b.frames) {
        let (p, q) = (f.positions(&a.skeleton), g.positions(&b.skeleton));
        let joints = p.iter().zip(&q).map(|(u, v)| ((u - p[0]) - (v - q[0])).norm());
        most = [joints.fold(most[0], f64::max), most[1].max((f.root.y - g.root.y).abs())];
    }
    most.map(|m| 100.0 * m)
}

/// A rig without toes whose floor was 0.72 m under the origin came out with its shins folded to hip height.
#[test]
fn a_clip_keeps_its_own_floor() {
    for clip in [walk().clone(), without_toes()] {
        let (plain_in, plain) = styled(&clip, &InputOptions::default());
        assert_eq!(plain_in.floor().source, Source::Zero);
        for height in [-0.72, 0.9] {
            let lifted = changed(&clip, |f| f.root.y += height);
            let (input, output) = styled(&lifted, &InputOptions::default());
            assert_eq!(input.floor().source, Source::Body);
            assert!((input.floor().height_m - height).abs() < 0.02, "{:?}", input.floor());
            let back = changed(&output, |f| f.root.y -= height);
            let [joints, heights] = apart(&plain, &back);
            assert!(joints < 1.0 && heights < 1.0, "{height}: joints {joints} cm, hips {heights} cm");
        }
    }
}

/// At ten kilometres single-precision poses moved in steps of a millimetre: nothing was like the database, and it slid.
#[test]
fn a_clip_is_the_same_wherever_it_is() {
    for clip in [walk().clone(), without_toes()] {
        let (plain_in, plain) = styled(&clip, &InputOptions::default());
        for far in [Vector3::new(10_000.0, 0.0, -10_000.0), Vector3::new(1e6, 2_000.0, 1e6)] {
            let moved = changed(&clip, |f| f.root += far);
            let (input, output) = styled(&moved, &InputOptions::default());
            let floor_m = input.floor().height_m - far.y;
            assert!((plain_in.floor().height_m - floor_m).abs() < 0.02, "{far}: {floor_m}");
            assert_eq!(plain.frames.len(), output.frames.len());
            let [joints, heights] = apart(&plain, &changed(&output, |f| f.root -= far));
            assert!(joints < 0.1 && heights < 1.0, "{far}: joints {joints} cm, hips {heights} cm");
            let way = |clip: &Clip| clip.frames[clip.frames.len() - 1].root - clip.frames[0].root;
            assert!((way(&plain) - way(&output)).norm() < 0.01, "{} and {}", way(&plain), way(&output));
            assert_eq!(input.coarse(), None);
        }
    }
    let far = MapFile { floor_m: Some(300.0), ..MapFile::default() };
    for clip in [walk().clone(), without_toes()] {
        let error = read(&clip, &InputOptions { map: far.clone(), ..InputOptions::default() }).unwrap_err();
        assert!(matches!(error.downcast_ref(), Some(MapError::Floor { .. })), "{error:#}");
    }
}

/// On the database's own skeleton up was not looked for: a walk with Z up was a body that lies.
#[test]
fn a_clip_with_z_up_is_the_same_on_whatever_skeleton() {
    let turn = UnitQuaternion::from_axis_angle(&Vector3::x_axis(), std::f64::consts::FRAC_PI_2);
    for clip in [walk().clone(), without_toes()] {
        let (_, plain) = styled(&clip, &InputOptions::default());
        let turned = changed(&clip, |f| {
            f.root = turn * f.root;
            f.rotations[0] = turn * f.rotations[0];
        });
        let (input, output) = styled(&turned, &InputOptions::default());
        assert!((input.up() - Vector3::z()).norm() < 1e-9, "{}", input.up());
        let back = changed(&output, |f| {
            f.root = turn.inverse() * f.root;
            f.rotations[0] = turn.inverse() * f.rotations[0];
        });
        let [joints, heights] = apart(&plain, &back);
        assert!(joints < 3.0 && heights < 1.5, "joints {joints} cm, hips {heights} cm");
    }
}

/// glTF has Y up, whatever its exporter did: a body that lies throughout may be one that stands.
#[test]
fn a_body_that_lies_throughout_is_told() {
    let turn = UnitQuaternion::from_axis_angle(&Vector3::x_axis(), std::f64::consts::FRAC_PI_2);
    let lies = changed(&without_toes(), |f| {
        f.root = turn * f.root;
        f.rotations[0] = turn * f.rotations[0];
    });
    let notes = |clip: &Clip, up| {
        let map = MapFile { up: Some(up), ..MapFile::default() };
        let input = read(clip, &InputOptions { map, ..InputOptions::default() }).unwrap();
        input.notes().collect::<Vec<_>>().join("\n")
    };
    assert!(notes(&lies, (1, 1.0)).contains("--up z"), "{}", notes(&lies, (1, 1.0)));
    assert!(!notes(&lies, (2, 1.0)).contains("--up"));
    assert!(!notes(&without_toes(), (1, 1.0)).contains("--up"));
}

/// A roll of a game was taken for a walk in a world whose Z is up, a metre over its floor.
#[test]
fn a_body_that_rolls_does_not_turn_its_world() {
    let mut roll = without_toes();
    let count = roll.frames.len() as f64;
    for (t, frame) in roll.frames.iter_mut().enumerate() {
        let turn = t as f64 / count * 1.1 * std::f64::consts::PI;
        frame.rotations[0] = UnitQuaternion::from_axis_angle(&Vector3::x_axis(), turn) * frame.rotations[0];
    }
    let input = read(&roll, &InputOptions::default()).unwrap();
    assert!((input.up() - Vector3::y()).norm() < 1e-6, "{}", input.up());
}

#[test]
fn a_told_floor_wins() {
    let told = |floor_m| InputOptions {
        map: MapFile { floor_m: Some(floor_m), ..MapFile::default() },
        ..InputOptions::default()
    };
    for clip in [walk().clone(), without_toes()] {
        let (_, plain) = styled(&clip, &told(0.0));
        let lifted = changed(&clip, |f| f.root.y += 0.3);
        let (input, output) = styled(&lifted, &told(0.3));
        assert_eq!((input.floor().height_m, input.floor().source), (0.3, Source::Stated));
        let [joints, heights] = apart(&plain, &changed(&output, |f| f.root.y -= 0.3));
        assert!(joints < 1.0 && heights < 1.0, "joints {joints} cm, hips {heights} cm");
    }
}

#[test]
fn a_walk_in_place_is_seen_moving_and_stays_in_place() {
    let (_, plain) = styled(walk(), &InputOptions::default());
    let held = changed(walk(), |f| f.root = Vector3::new(1.5, f.root.y, -2.0));
    let (input, output) = styled(&held, &InputOptions::default());
    let course = input.course().expect("it walks in place");
    let path = |c: &Clip| {
        c.frames
            .windows(2)
            .map(|p| ((p[1].root - p[0].root).component_mul(&Vector3::new(1.0, 0.0, 1.0))).norm())
            .sum::<f64>()
    };
    let speed = path(walk()) / walk().duration_s();
    assert!((course.speed_m_s / speed - 1.0).abs() < 0.1, "{} {speed}", course.speed_m_s);
    assert!((output.frames.len() as isize - plain.frames.len() as isize).abs() <= 2);
    let [joints, heights] = apart(&plain, &output);
    assert!(joints < 3.0 && heights < 1.0, "joints {joints} cm, hips {heights} cm");
    for frame in &output.frames {
        let off = Vector3::new(frame.root.x - 1.5, 0.0, frame.root.z + 2.0).norm();
        assert!(off < 0.15, "{off} m");
    }
    // Told, it is left as it is; and what moves is not in place.
    let motion = InputOptions { root: Some(Root::Motion), ..InputOptions::default() };
    assert!(read(&held, &motion).unwrap().course().is_none());
    assert!(read(walk(), &InputOptions::default()).unwrap().course().is_none());
    let slow =
        changed(&held, |f| f.rotations.iter_mut().skip(1).for_each(|q| *q = UnitQuaternion::identity()));
    assert!(read(&slow, &InputOptions::default()).unwrap().course().is_none());
    let told = InputOptions { root: Some(Root::InPlace), ..InputOptions::default() };
    assert!(read(&slow, &told).unwrap().course().is_some_and(|course| course.stated));
}

/// Feet that an animator keys change their speed within a step, and the hips went to and fro with it.
#[test]
fn feet_of_changing_speed_in_place_do_not_move_the_hips() {
    let held = changed(walk(), |f| f.root = Vector3::new(0.0, f.root.y, 0.0));
    let step = std::f64::consts::TAU / 16.0;
    let mut uneven = held.clone();
    for (t, frame) in uneven.frames.iter_mut().enumerate() {
        *frame = held.at(t as f64 + 1.8 * (step * t as f64).sin());
    }
    for looped in [false, true] {
        let sway = |clip: &Clip| {
            let (input, output) = styled(clip, &InputOptions { looped, ..InputOptions::default() });
            assert!(input.course().is_some(), "it walks in place");
            let at = output.frames.iter().map(|f| Vector3::new(f.root.x, 0.0, f.root.z).norm());
            at.fold(0.0, f64::max)
        };
        let (even, uneven) = (sway(&held), sway(&uneven));
        assert!(uneven < even + 0.03, "{uneven} m, {even} m with even feet; looped: {looped}");
    }
}

/// Runs of games touch the ground in two frames a step: they were taken for motion on the spot.
#[test]
fn gaits_in_place_are_found_and_acts_on_the_spot_are_not() {
    // So many frames of the middle, played so many times as fast.
    let clip = |action: &str, style: &str, frames: usize, times: f64| {
        let mut clip = synth::performance(3, action, style, 30.0 / times, 4.0).unwrap().clip;
        clip.frames.drain(..clip.frames.len().saturating_sub(frames) / 2);
        clip.frames.truncate(frames);
        clip.rate_hz = 30.0;
        clip
    };
    let course = |clip: &Clip| read(clip, &InputOptions::default()).unwrap().course().cloned();
    for style in synth::STYLES {
        for (action, frames, times) in [("run", 20, 2.0), ("run", 20, 1.0), ("walk", 45, 1.0)] {
            let moving = clip(action, style, frames, times);
            assert!(course(&moving).is_none(), "{action} {style} goes somewhere");
            let mut held = changed(&moving, |f| f.root = Vector3::new(0.0, f.root.y, 0.0));
            if times > 1.0 {
                // It leaps three times as high.
                for frame in &mut held.frames {
                    let places = frame.positions(&held.skeleton);
                    let lowest = places.iter().map(|p| p.y).fold(f64::INFINITY, f64::min);
                    frame.root.y += 2.0 * (lowest - 0.02).max(0.0);
                }
            }
            let speed = course(&held).map(|course| course.speed_m_s);
            let way = moving.frames[moving.frames.len() - 1].root - moving.frames[0].root;
            let wanted = Vector3::new(way.x, 0.0, way.z).norm() / moving.duration_s();
            let is_close = speed.is_some_and(|speed| (speed / wanted - 1.0).abs() < 0.25);
            assert!(is_close, "{action} {style} in place, {times} times as fast: {speed:?} of {wanted} m/s");
        }
        for action in ["jump", "kick", "punch"] {
            assert!(course(&clip(action, style, 60, 1.0)).is_none(), "{action} {style}");
        }
    }
}

/// A third of a second of a gait may show one foot on the ground alone.
#[test]
fn parts_of_a_step_in_place_are_found_and_those_of_acts_are_not() {
    let part = |action: &str, style: &str, start: usize| {
        let mut clip = synth::performance(3, action, style, 30.0, 4.0).unwrap().clip;
        clip.frames.drain(..start.min(clip.frames.len() - 12));
        clip.frames.truncate(12);
        clip
    };
    let course = |clip: &Clip| read(clip, &InputOptions::default()).unwrap().course().cloned();
    for style in synth::STYLES {
        for start in [30, 37, 44, 51] {
            for action in ["walk", "run"] {
                let moving = part(action, style, start);
                assert!(course(&moving).is_none(), "{action} {style} from {start} goes somewhere");
                let held = changed(&moving, |f| f.root = Vector3::new(0.0, f.root.y, 0.0));
                assert!(course(&held).is_some(), "{action} {style} from {start} is in place");
            }
            for action in ["jump", "kick", "punch"] {
                assert!(course(&part(action, style, start)).is_none(), "{action} {style} from {start}");
            }
        }
    }
}

/// The clip on a skeleton that is not the database's.
fn renamed(clip: &Clip) -> Clip {
    let names = clip.skeleton.names.iter().map(|name| format!("rig:{name}")).collect();
    Clip { skeleton: Arc::new(Skeleton { names, ..(*clip.skeleton).clone() }), ..clip.clone() }
}

/// The root of some rigs is on the ground: what leans about it carries the hips away, which stay in place all the same.
#[test]
fn hips_over_a_root_on_the_ground_stay_in_place() {
    let hips = Vector3::new(0.0, 0.9, 0.0);
    let last = walk().frames.len() - 1;
    let kept = |hips_of_root: Vector3<f64>| {
        let mut clip = walk().clone();
        for (t, frame) in clip.frames.iter_mut().enumerate() {
            frame.root = Vector3::zeros();
            frame.rotations[0] = UnitQuaternion::from_euler_angles(0.5 * t as f64 / last as f64, 0.0, 0.0);
        }
        let place = course::place(&clip, &hips_of_root);
        course::put_in_place(&mut clip, &hips_of_root, &Vector3::y(), &place, false);
        let way = clip.frames.iter().map(|f| (f.root + f.rotations[0] * hips).z);
        let (least, most) = way.fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), z| (a.min(z), b.max(z)));
        most - least
    };
    assert!(kept(hips) < 0.02, "{}", kept(hips));
    assert!(kept(Vector3::zeros()) > 0.4, "its root is there: {}", kept(Vector3::zeros()));
}

/// One frame a kilometre away was a step so fast that the hips stood still beside it.
#[test]
fn a_wrong_frame_makes_no_walk_in_place() {
    for wrong in 30..60 {
        let mut clip = walk().clone();
        clip.frames[wrong].root.x += 1000.0;
        assert!(read(&clip, &InputOptions::default()).unwrap().course().is_none(), "{wrong}");
    }
}

/// A foot that stands nowhere in a clip does not tell how high ankles are.
#[test]
fn parts_of_a_step_stand_on_the_floor() {
    let ankle = |clip: &Clip| {
        let input = read(&renamed(clip), &InputOptions::default()).unwrap();
        input.retarget().unwrap().source.anatomy.ankle_m
    };
    let whole = ankle(walk());
    let of = |frames: Vec<Frame>| ankle(&Clip { frames, ..walk().clone() }) - whole;
    for start in (30..60).step_by(3) {
        let part = of(walk().frames[start..start + 10].to_vec());
        let held = of(vec![walk().frames[start].clone(); 30]);
        assert!(part < 0.02 && held < 0.025, "{start}: {part} m, held for a second {held} m");
    }
}

#[test]
fn a_loop_stays_a_loop() {
    for held in [false, true] {
        let clip = changed(walk(), |f| {
            if held {
                f.root = Vector3::new(0.0, f.root.y, 0.0);
            }
        });
        let reading = InputOptions { looped: true, ..InputOptions::default() };
        let input = read(&clip, &reading).unwrap();
        let streamed = translate(&database(), &input, &Request::style(1), &mut ()).unwrap();
        let output = input.output(&streamed);
        let (first, last) = (&output.frames[0], &output.frames[output.frames.len() - 1]);
        let shape = |f: &Frame| {
            let ground = Vector3::new(f.root.x, 0.0, f.root.z);
            f.positions(&output.skeleton).into_iter().map(|p| p - ground).collect::<Vec<_>>()
        };
        let seam = shape(first).iter().zip(shape(last)).map(|(p, q)| (p - q).norm()).fold(0.0, f64::max);
        assert!(seam < 0.005, "held {held}: {seam} m");
        assert!(!held || (first.root - last.root).norm() < 0.005);
        // It begins where the input's does, not where rounds that were left out took it.
        let moved = first.root - input.clip.frames[0].root;
        assert!(Vector3::new(moved.x, 0.0, moved.z).norm() < 0.1, "held {held}: {moved:?}");
        let contacts = |i: usize| streamed.steps[i].report.contacts;
        assert_eq!(contacts(0), contacts(streamed.steps.len() - 1));
        // It goes on as it goes: the step over the seam is no larger than any other.
        let steps: Vec<f64> =
            output.frames.windows(2).map(|p| largest(&shape(&p[0]), &shape(&p[1]))).collect();
        let over = largest(&shape(&output.frames[output.frames.len() - 2]), &shape(&output.frames[1])) / 2.0;
        let most = steps.iter().copied().fold(0.0, f64::max);
        assert!(over <= most * 1.1, "{over} m over the seam, {most} m elsewhere");
    }
    // The half of a turn does not come back.
    let straight = changed(walk(), |_| ());
    let mut bent = straight.clone();
    let count = bent.frames.len() as f64;
    for (t, frame) in bent.frames.iter_mut().enumerate() {
        frame.rotations[1] = UnitQuaternion::from_axis_angle(&Vector3::x_axis(), t as f64 / count * 3.0);
    }
    let reading = InputOptions { looped: true, ..InputOptions::default() };
    let error = read(&bent, &reading).unwrap_err();
    assert!(matches!(error.downcast_ref(), Some(LoopError::NoReturn { .. })), "{error:#}");
}

/// A cycle without its first pose again ends a step before it, which may be more than can be closed.
#[test]
fn a_quick_cycle_of_few_frames_is_a_loop() {
    let run = synth::performance(5, "run", "neutral", 120.0, 4.0).unwrap();
    let (start, end) = run.cycles[2].span();
    for rate_hz in [12.0, 15.0, 24.0] {
        let count = ((end - start) / run.clip.rate_hz * rate_hz).round();
        let at = |i: usize| run.clip.at(start + i as f64 / count * (end - start));
        let rate_hz = count / (end - start) * run.clip.rate_hz;
        let clip = Clip { frames: (0..count as usize).map(at).collect(), rate_hz, ..run.clip.clone() };
        let input = read(&clip, &InputOptions { looped: true, ..InputOptions::default() }).unwrap();
        let round = input.round().unwrap();
        assert_eq!((round.start, round.period), (0, count as usize), "at {rate_hz} frames a second");
    }
}

/// The frames in which it stood were taken for the loop: they are alike, but nothing comes back.
#[test]
fn a_pose_that_is_held_is_no_loop() {
    let mut clip = changed(walk(), |_| ());
    let first = clip.frames[0].clone();
    clip.frames.splice(0..0, (0..20).map(|_| first.clone()));
    let reading = InputOptions { looped: true, ..InputOptions::default() };
    let input = read(&clip, &reading).unwrap();
    let seconds = input.mapped.duration_s();
    assert!(seconds > 0.8, "the loop has {seconds} s, and a cycle of the walk takes more");
    // A slow body is near its first pose for a while: it has not come back.
    let mut slow = changed(walk(), |_| ());
    slow.frames.truncate(20);
    let slow = Clip { frames: (0..60).map(|t| slow.at(f64::from(t) * 0.1)).collect(), ..slow };
    assert!(read(&slow, &reading).is_err(), "a tenth of a second of a walk is no loop");
}

fn largest(a: &[Vector3<f64>], b: &[Vector3<f64>]) -> f64 {
    a.iter().zip(b).map(|(p, q)| (p - q).norm()).fold(0.0, f64::max)
}

#[test]
fn the_verdict_says_what_was_recognised_and_what_was_left_alone() {
    let input = read(walk(), &InputOptions::default()).unwrap();
    let verdict = verdict::before(&database(), &input).unwrap();
    assert_eq!(verdict.likeness, Likeness::Like);
    assert_eq!(verdict.actions[0].0, "walk");
    assert!(verdict.actions[0].1 > 0.95 && verdict.left_alone.is_empty(), "{verdict:?}");
    let words = verdict.sentences().join(" ");
    assert!(words.contains("like the database") && words.contains("walk 100%"), "{words}");
    assert!(words.find("Its style is neutral") < words.find("walk"), "{words}");
    assert_eq!(verdict.input_style.as_deref(), Some("neutral"));

    // Input in the wanted style is told; the linear models take one style, and leave input that is to get it as it is.
    let from = database().linear_from().unwrap();
    assert_eq!(from, 0, "the walk's own style");
    let proud = from + 1;
    for (style, input_style, method, told) in [
        (from, None, Method::Lti, Some("linear models")),
        (from, None, Method::Mar, Some("neutral already")),
        (proud, None, Method::Lti, None),
        (proud, None, Method::Mar, None),
        (proud, Some(proud), Method::Statistic, Some("proud already")),
        (from, Some(proud), Method::Mar, None),
    ] {
        let mut request = Request { input_style, ..Request::style(style) };
        request.config = request.config.method(method);
        let mut said = verdict.clone();
        said.note_same_style(&database(), &request);
        assert_eq!(
            said.advice.len(),
            verdict.advice.len() + usize::from(told.is_some()),
            "{:?}",
            said.advice
        );
        assert!(told.is_none_or(|told| said.advice[0].contains(told)), "{:?}", said.advice);
        assert_eq!(said.json()["same_style"], told.is_some());
        request.style.push((style ^ 1, 0.5));
        said = verdict.clone();
        said.note_same_style(&database(), &request);
        assert_eq!((&said.advice, said.same_style), (&verdict.advice, false), "a mix is another style");
    }

    // A body that lies on its back and rows.
    let back = UnitQuaternion::from_axis_angle(&Vector3::x_axis(), -1.5);
    let mut rows = walk().clone();
    let body = Body::of(&Corpus::of_clip(walk())).unwrap();
    for (t, frame) in rows.frames.iter_mut().enumerate() {
        let swing = (t as f64 * 0.2).sin();
        frame.root = Vector3::new(0.0, 0.15, 0.0);
        frame.rotations.iter_mut().for_each(|q| *q = UnitQuaternion::identity());
        frame.rotations[0] = back;
        for side in [0, 1] {
            let turn = UnitQuaternion::from_axis_angle(&Vector3::x_axis(), -1.2 + swing);
            frame.rotations[body.landmarks.hip_joints[side]] = turn;
        }
    }
    let input = read(&rows, &InputOptions::default()).unwrap();
    let streamed = translate(&database(), &input, &Request::style(1), &mut ()).unwrap();
    let verdict = Verdict::of(&database(), &input, &Request::style(1), &streamed);
    assert_eq!(verdict.likeness, Likeness::Unlike, "{verdict:?}");
    assert!(!verdict.left_alone.is_empty());
    let json = verdict.json();
    assert_eq!(json["like"], "unlike");
    assert!(json["text"].as_str().unwrap().contains("walk"), "{json}");
    // The first thing to doubt is a label.
    let request = Request { action: Some(0), ..Request::style(1) };
    let streamed = translate(&database(), &input, &request, &mut ()).unwrap();
    let verdict = Verdict::of(&database(), &input, &request, &streamed);
    assert!(
        verdict.likeness != Likeness::Like && verdict.advice[0].contains("without --action"),
        "{verdict:?}"
    );
}

/// A body that stood and waved was told to walk in place.
#[test]
fn only_clips_whose_feet_step_may_be_in_place() {
    let advised = |clip: &Clip| {
        let motion = InputOptions { root: Some(Root::Motion), ..InputOptions::default() };
        let input = read(clip, &motion).unwrap();
        let streamed = translate(&database(), &input, &Request::style(1), &mut ()).unwrap();
        let verdict = Verdict::of(&database(), &input, &Request::style(1), &streamed);
        assert_ne!(verdict.likeness, Likeness::Like, "{verdict:?}");
        assert_eq!(verdict.input_style, None);
        verdict.advice.iter().any(|advice| advice.contains("--root in-place"))
    };
    // Arms that wave high, as those of no walk, with the walk's legs and with those of its first pose.
    let mut walks = changed(walk(), |f| f.root = Vector3::new(0.0, f.root.y, 0.0));
    let joints = walks.skeleton.names.clone();
    let arms =
        ["UpperArm", "LowerArm"].map(|part| joints.iter().position(|name| name.contains(part)).unwrap());
    let wave = |clip: &mut Clip| {
        for (t, frame) in clip.frames.iter_mut().enumerate() {
            let swing = 2.0 + 0.5 * (t as f64 * 0.3).sin();
            for arm in arms {
                frame.rotations[arm] = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), swing);
            }
        }
    };
    let stance = walks.frames[0].clone();
    let mut stands = changed(&walks, |frame| frame.clone_from(&stance));
    wave(&mut walks);
    wave(&mut stands);
    assert!(advised(&walks) && !advised(&stands));
}
