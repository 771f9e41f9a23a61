//! The methods that need no frames: compared with slow `f64` versions, checked by `open`, and cut to a blob of their own.

use gestus_core::{
    BlobError, Config, ConfigError, Database, Degraded, Method, Pose, Stylizer,
    blob::layout::{self, dof, lti, section, statistic},
};
use gestus_database::{
    blob::cut::models_only,
    build::{BuildOptions, build},
    command_line::stylizer_args::methods,
    models::lti::{Model, clip},
    stream::{Request, Streamed, from_pose, stream, stream_with_labels, to_pose},
    synth,
};
use gestus_motion::clip::rotation;
use gestus_tests::{
    motion,
    patch::{self, patched, with_section},
    trace::Trace,
};
use nalgebra::{UnitQuaternion, Vector3};

// The foot lock and the speed limit are off, so that the predictions are compared.
const LTI: Config = Config::new().method(Method::Lti).contacts(false).speed_limit(0.0);
const STATISTIC: Config = Config::new().method(Method::Statistic).contacts(false).speed_limit(0.0);

fn run(blob: &[u8], config: Config, style: &[(u16, f32)], frames: usize) -> (Trace, Streamed) {
    let database = Database::open(blob).unwrap();
    let request = Request { config, style: style.to_vec(), ..Request::style(0) };
    let mut trace = Trace::default();
    let streamed = stream(&database, &motion::unseen(0, 0, frames), &request, &mut trace).unwrap();
    (trace, streamed)
}

fn wide(values: &[f32]) -> Vec<f64> {
    values.iter().map(|&v| f64::from(v)).collect()
}

/// Numbers that a stream predicts, without the yaw, which is the input's.
fn without_yaw(row: &[f64]) -> impl Iterator<Item = f64> + '_ {
    row.iter().enumerate().filter(|(d, _)| *d != dof::YAW).map(|(_, v)| *v)
}

#[test]
fn the_stream_of_a_linear_model_is_the_papers_recursion() {
    let blob = motion::small();
    let database = Database::open(blob).unwrap();
    for (confidence, style, settle_s) in [(5.0, 1, 0.1), (1.5, 2, 0.0), (1.5, 2, 0.1), (1e6, 1, 0.1)] {
        let config = LTI.confidence(confidence).settle_s(settle_s);
        let (trace, streamed) = run(blob, config, &[(style, 1.0)], 150);
        let model = Model::of(&database, database.linear_model_of(style, None).unwrap());
        let x: Vec<Vec<f64>> = trace.frames.iter().map(|f| wide(&f.x)).collect();
        let left = if settle_s > 0.0 { (-1.0 / (motion::RATE_HZ * f64::from(settle_s))).exp() } else { 0.0 };
        let options = clip::Options { before: 0, generalise: Some((f64::from(confidence), 8.0)), left };
        let truth = model.translate(&x, &options);
        for (t, frame) in trace.frames.iter().enumerate() {
            let found = wide(&frame.predicted);
            for (d, (a, b)) in without_yaw(&found).zip(without_yaw(&truth.rows[t])).enumerate() {
                assert!((a - b).abs() < 2e-4, "frame {t}, number {d}: {a} {b}");
            }
            let step = f64::from(frame.report.predicted_step_s) * motion::RATE_HZ;
            assert!((step - truth.warp[t]).abs() < 1e-4, "frame {t}: {step} {}", truth.warp[t]);
            assert_eq!(frame.report.contacts, truth.contacts[t], "frame {t}");
        }
        assert!(streamed.steps.iter().all(|s| s.report.degraded.is_empty()));
    }
}

#[test]
fn a_linear_model_learns_the_style() {
    let (trace, _) = run(motion::small(), LTI, &[(2, 1.0)], 150);
    let database = Database::open(motion::small()).unwrap();
    // The same content performed in the style, compared by means: `raised` holds the arms a radian higher.
    let raised = motion::example(0, 2, 9, 150).clip;
    let body = |rows: &dyn Fn(usize) -> f64| (60..150).map(rows).sum::<f64>() / 90.0;
    let arm = 6;
    let mean = rotation(database.joint(arm).mean);
    for axis in 0..3 {
        let d = layout::ROOT_DOFS + 3 * arm + axis;
        let found = body(&|t| f64::from(trace.frames[t].predicted[d]));
        let input = body(&|t| f64::from(trace.frames[t].x[d]));
        let truth = body(&|t| (mean.inverse() * raised.frames[t].rotations[arm]).scaled_axis()[axis]);
        let gap = (input - truth).abs();
        assert!((found - truth).abs() < 0.1 * gap + 0.05, "axis {axis}: {found} for {truth}, input {input}");
    }
}

/// Models are for one input style, and their feet are for input of any.
#[test]
fn feet_stand_with_those_of_input_in_any_style() {
    let database = Database::open(motion::small()).unwrap();
    for config in [LTI, STATISTIC] {
        for style in 0..3 {
            let example = motion::example(0, style, 9, 200);
            let request = Request { config, style: vec![(1, 1.0)], ..Request::style(0) };
            let streamed = stream(&database, &example.clip, &request, &mut ()).unwrap();
            let settled = streamed.steps.iter().zip(&example.contacts).skip(30);
            let right = settled.clone().filter(|(step, truth)| step.report.contacts == **truth).count();
            let share = right as f64 / settled.count() as f64;
            assert!(share > 0.85, "{:?}, style {style}: {share}", config.method);
        }
    }
}

#[test]
fn statistics_are_transferred_as_in_the_paper() {
    let blob = motion::small();
    let database = Database::open(blob).unwrap();
    let clip = motion::unseen(0, 0, 80);
    let (trace, streamed) = run(blob, STATISTIC, &[(1, 1.0)], 80);
    let (source, target) = (database.table_of(0, None).unwrap(), database.table_of(1, None).unwrap());
    for (t, step) in streamed.steps.iter().enumerate() {
        for j in 1..database.counts().joints {
            let ((from, from_sd), (to, to_sd)) = (source.joint(j), target.joint(j));
            let aligned = clip.frames[t].rotations[j] * (rotation(from).inverse() * rotation(to));
            let scale = (f64::from(to_sd) / f64::from(from_sd)).min(2.0);
            // Slerp from the mean is the mean times the scaled rotation.
            let way: Vector3<f64> = (rotation(to).inverse() * aligned).scaled_axis() * scale;
            let truth = rotation(to) * UnitQuaternion::from_scaled_axis(way);
            let off = step.frame.rotations[j].angle_to(&truth);
            assert!(off < 2e-3, "frame {t}, joint {j}: {off}");
        }
        let x = wide(&trace.frames[t].x);
        // The change of the mean speed fades where the input is slow.
        let moving = (x[dof::FORWARD].abs() / (0.25 * f64::from(source.root(1)[0]).abs())).min(1.0);
        for (i, (d, part)) in
            [(dof::HEIGHT, 1.0), (dof::FORWARD, moving), (dof::LEFT, moving)].into_iter().enumerate()
        {
            let [mean, deviation] = source.root(i).map(f64::from);
            let [to_mean, to_deviation] = target.root(i).map(f64::from);
            let scale = (to_deviation / deviation).min(2.0);
            let truth = scale * x[d] + part * (to_mean - scale * mean);
            let found = f64::from(trace.frames[t].predicted[d]);
            assert!((found - truth).abs() < 2e-4, "frame {t}, number {d}: {found} {truth}");
        }
        assert_eq!(step.report.step_s, 1.0 / 30.0);
    }
}

/// Statistics are of bodies that walk; one that waves on the spot drifted by half a metre.
#[test]
fn statistics_leave_a_body_on_the_spot() {
    let options = synth::Options::of(&["walk"], &["neutral", "old"], 2, 6.0);
    let corpus = synth::corpus(&options).unwrap();
    let blob = build(&corpus, &BuildOptions::default()).unwrap().bytes;
    let database = Database::open(&blob).unwrap();
    let mut clip = corpus.examples[0].clip.clone();
    clip.frames.truncate(150);
    let place = clip.frames[0].root;
    clip.frames.iter_mut().for_each(|frame| (frame.root.x, frame.root.z) = (place.x, place.z));
    let [from, to] = [0, 1].map(|style| database.table_of(style, None).unwrap().root(1).map(f64::from));
    let drift_m = (to[0] - (to[1] / from[1]).min(2.0) * from[0]) * 150.0 / motion::RATE_HZ;
    assert!(drift_m.abs() > 0.2, "nothing to take away: {drift_m} m");
    for config in [STATISTIC, STATISTIC.halflife_s(2.0)] {
        let streamed = stream(&database, &clip, &Request { config, ..Request::style(1) }, &mut ()).unwrap();
        let moved = streamed.steps.iter().map(|s| (s.frame.root - place).xz().norm()).fold(0.0, f64::max);
        assert!(moved < 0.05, "{moved} m with a half-life of {} s", config.halflife_s);
    }
}

/// An input in another style than that of the stored statistics: running statistics adapt to it.
#[test]
fn running_statistics_follow_the_input() {
    let blob = motion::small();
    let database = Database::open(blob).unwrap();
    let clip = motion::example(0, 2, 9, 600).clip;
    let (arm, target) = (6, database.table_of(1, None).unwrap());
    let off = |config: Config| {
        let request = Request { config, ..Request::style(1) };
        let streamed = stream(&database, &clip, &request, &mut ()).unwrap();
        let all = streamed.steps[400..].iter().map(|s| {
            let q = s.frame.rotations[arm];
            [q.i as f32, q.j as f32, q.k as f32, q.w as f32]
        });
        let all: Vec<[f32; 4]> = all.collect();
        let mean = gestus_database::models::statistic::mean::recursive(all);
        gestus_core::math::quaternion::angle(mean, target.joint(arm).0)
    };
    // A half-life of half a second adapts quickly; the stored statistics are those of `normal`, arms down.
    let (running, stored) = (off(STATISTIC.halflife_s(3.0)), off(STATISTIC));
    assert!(running < 0.15 && stored > 0.5, "{running} {stored}");
    // With a labelled input style the stored statistics are right.
    let request = Request { config: STATISTIC, input_style: Some(2), ..Request::style(1) };
    assert!(stream(&database, &clip, &request, &mut ()).is_ok());
}

#[test]
fn the_inputs_own_style_is_the_input() {
    for config in [LTI, STATISTIC] {
        let (trace, streamed) = run(motion::small(), config, &[(0, 1.0)], 60);
        for (t, frame) in trace.frames.iter().enumerate() {
            for (a, b) in frame.predicted.iter().zip(&frame.x) {
                assert!((a - b).abs() < 2e-3, "{config:?}, frame {t}: {a} {b}");
            }
            assert_eq!(streamed.steps[t].report.step_s, 1.0 / 30.0);
        }
    }
}

#[test]
fn unexpected_input_passes_through() {
    let database = Database::open(motion::small()).unwrap();
    let mut clip = motion::unseen(0, 0, 120);
    for frame in &mut clip.frames[40..80] {
        frame.rotations[4] *= UnitQuaternion::from_scaled_axis(Vector3::new(0.0, 2.5, 0.0));
    }
    let request = Request { config: LTI, ..Request::style(2) };
    let mut trace = Trace::default();
    let _ = stream(&database, &clip, &request, &mut trace).unwrap();
    let apart = |t: usize| {
        let frame = &trace.frames[t];
        frame.predicted.iter().zip(&frame.x).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max)
    };
    assert!(apart(60) < 0.02, "{}", apart(60));
    assert!(apart(110) > 0.3, "the style is back: {}", apart(110));
    assert!(trace.frames[60].report.distance2 > 100.0);
}

/// The knee of another body or of a sensor turns about an axis a degree off the captured one. Since no captured joint turned
/// about that axis, every frame used to count as unexpected, and the input passed through.
#[test]
fn a_still_joint_that_is_a_degree_off_is_not_unexpected() {
    let database = Database::open(motion::small()).unwrap();
    let clip = motion::unseen(0, 0, 120);
    let mut turned = clip.clone();
    let knee = 14;
    for frame in &mut turned.frames {
        frame.rotations[knee] *= UnitQuaternion::from_scaled_axis(Vector3::new(0.0, 0.0, 0.016));
    }
    let run = |clip| {
        let mut trace = Trace::default();
        let _ = stream(&database, clip, &Request { config: LTI, ..Request::style(2) }, &mut trace).unwrap();
        trace
    };
    let (own, off) = (run(&clip), run(&turned));
    for (t, (own, off)) in own.frames.iter().zip(&off.frames).enumerate() {
        assert!(off.report.distance2 < 25.0, "frame {t}: {} variances", off.report.distance2);
        for (d, (a, b)) in own.predicted.iter().zip(&off.predicted).enumerate() {
            let most = if (d - dof::JOINTS.min(d)) / 3 + 1 == knee { 0.02 } else { 1e-3 };
            assert!((a - b).abs() < most, "frame {t}, dof {d}: {a} {b}");
        }
    }
}

/// Joints that hardly moved in the input style are no stiller in another take: a shoulder that is two degrees off was a
/// thousand variances away, and whole gestures were passed through.
#[test]
fn a_still_joint_does_not_make_input_unlike_the_statistics() {
    let database = Database::open(motion::small()).unwrap();
    let input = database.table_of(0, None).unwrap();
    let still = (1..database.counts().joints).filter(|&j| input.joint(j).1 < 0.0501);
    let mut count = 0;
    for joint in still {
        let mut clip = motion::unseen(0, 0, 60);
        for frame in &mut clip.frames {
            frame.root.y += 0.01;
            frame.rotations[joint] *= UnitQuaternion::from_scaled_axis(Vector3::new(0.0, 0.04, 0.0));
        }
        let request = Request { config: STATISTIC, ..Request::style(2) };
        let streamed = stream(&database, &clip, &request, &mut ()).unwrap();
        for (t, step) in streamed.steps.iter().enumerate() {
            assert!(step.report.distance_ratio < 1.0, "joint {joint}, frame {t}: {}", step.report.distance2);
        }
        count += 1;
    }
    assert!(count > 0, "some joint is still");
}

/// A change of style is gradual; the new model starts at x = 0 without a visible jump.
#[test]
fn styles_blend_and_change_without_a_jump() {
    let database = Database::open(motion::small()).unwrap();
    let clip = motion::unseen(0, 0, 160);
    for config in [LTI, STATISTIC] {
        let poses = |style: &[(u16, f32)]| {
            let request = Request { config, style: style.to_vec(), ..Request::style(0) };
            let mut trace = Trace::default();
            let _ = stream(&database, &clip, &request, &mut trace).unwrap();
            trace.frames.into_iter().map(|f| wide(&f.predicted)).collect::<Vec<_>>()
        };
        if config == LTI {
            // Linear: the blend is the sum.
            let (a, b, both) = (poses(&[(1, 1.0)]), poses(&[(2, 1.0)]), poses(&[(1, 3.0), (2, 1.0)]));
            for (t, row) in both.iter().enumerate().skip(1) {
                for (d, v) in row.iter().enumerate() {
                    assert!((v - 0.75 * a[t][d] - 0.25 * b[t][d]).abs() < 1e-4, "frame {t}, dof {d}");
                }
            }
            let mut stylizer = Box::new(Stylizer::<22, 40, 28>::new(database, config).unwrap());
            let (mut output, mut last) = (Pose::IDENTITY, None);
            let mut most: f64 = 0.0;
            for (t, frame) in clip.frames.iter().enumerate() {
                if t % 40 == 20 {
                    stylizer.set_style(&[(if t % 80 == 20 { 2 } else { 1 }, 1.0)]).unwrap();
                }
                let _ = stylizer.step(&to_pose(frame), &mut output);
                let now = from_pose(&output, 21);
                if let Some(last) = last.replace(now.clone()) {
                    let last: gestus_motion::clip::Frame = last;
                    let turned = now.rotations.iter().zip(&last.rotations).map(|(a, b)| a.angle_to(b));
                    most = turned.fold(most, f64::max);
                }
            }
            assert!(most < 0.4, "a joint turned by {most} in a frame");
        }
    }
}

#[test]
fn a_method_needs_its_section() {
    let database = Database::open(motion::small()).unwrap();
    assert_eq!(database.linear_from(), Some(0));
    assert!(size_of::<Stylizer<'_, 22, 40, 28>>() <= 24_576);
    let mut stylizer = Box::new(Stylizer::<22, 40, 28>::new(database, Config::new()).unwrap());
    // A stylizer that changes its method restarts, and gives the same output as one created with that method.
    let mut output = Pose::IDENTITY;
    let clip = motion::unseen(0, 0, 40);
    for frame in &clip.frames {
        let _ = stylizer.step(&to_pose(frame), &mut output);
    }
    stylizer.set_config(LTI).unwrap();
    stylizer.set_style(&[(1, 1.0)]).unwrap();
    let (_, wanted) = run(motion::small(), LTI, &[(1, 1.0)], 40);
    for (frame, wanted) in clip.frames.iter().zip(&wanted.steps) {
        let _ = stylizer.step(&to_pose(frame), &mut output);
        assert_eq!(from_pose(&output, 21), wanted.frame);
    }
    assert_eq!(Method::of(&database), Method::Mar);
    let old = std::fs::read(concat!(env!("CARGO_MANIFEST_DIR"), "/golden/blob-v2.gestus")).unwrap();
    let without = Database::open(&old).unwrap();
    if without.linear_from().is_none() {
        let refused = Stylizer::<22, 40, 28>::new(without, LTI).err();
        assert_eq!(refused, Some(ConfigError::Method));
    }
}

#[test]
fn models_beyond_the_limit_of_a_frame_are_dropped_and_reported() {
    let mut blob = motion::small().to_vec();
    // Three styles have two models, which always fit.
    let database = Database::open(&blob).unwrap();
    let mut stylizer = Box::new(Stylizer::<22, 40, 28>::new(database, LTI).unwrap());
    stylizer.set_style(&[(0, 1.0), (1, 1.0), (2, 1.0)]).unwrap();
    let mut output = Pose::IDENTITY;
    for frame in &motion::unseen(0, 0, 20).frames {
        let report = stylizer.step(&to_pose(frame), &mut output);
        assert!(!report.degraded.contains(Degraded::CLASSES));
        assert!(output.is_valid(21));
    }
    // A blob that changes while in use gives other poses, but no panic.
    let at = patch::section(&blob, section::LTI);
    blob[at.start + 200..at.end].fill(0xff);
    assert!(Database::open(&blob).is_err());
}

#[test]
fn a_blob_of_models_alone_gives_the_same_bits() {
    let whole = motion::small();
    let cut = models_only(&Database::open(whole).unwrap()).unwrap();
    let database = Database::open(&cut).unwrap();
    assert_eq!(
        (methods(&database), methods(&Database::open(whole).unwrap()).len()),
        (vec!["lti", "statistic", "phase"], 4)
    );
    assert_eq!(database.counts().frames, 0);
    assert_eq!(database.manifest().unwrap().styles.iter().collect::<Vec<_>>(), motion::STYLES);
    assert_eq!(database.manifest().unwrap().licences.count(), 1);
    // Only names, body and query remain besides the models.
    let models: usize = database.optional_sections().map(|(_, bytes)| bytes.len()).sum();
    let query = database.sections().into_iter().find(|(id, _)| *id == section::QUERY).unwrap().1.len();
    assert!(cut.len() < models + query + 8 * 1024, "{} bytes, models {models}, query {query}", cut.len());
    let style = [(1, 0.5), (2, 0.5)];
    for config in [LTI, STATISTIC] {
        let digest = |blob: &[u8], config| run(blob, config, &style, 60).1.digest;
        assert_eq!(digest(&cut, config), digest(whole, config));
        // Cutting once dropped the section of feet, and feet slid.
        let held = digest(&cut, config.contacts(true));
        assert!(held == digest(whole, config.contacts(true)) && held != digest(&cut, config));
    }
    let refused = Stylizer::<22, 40, 28>::new(database, Config::new()).err();
    assert_eq!(refused, Some(ConfigError::Method));
    assert_eq!(Method::of(&database), Method::Phase);
    // A second cut changes nothing; a blob without models can't be cut.
    assert_eq!(models_only(&database).unwrap(), cut);
    let mut stylizer = Box::new(Stylizer::<22, 40, 28>::new(database, LTI).unwrap());
    stylizer.set_action(Some(1)).unwrap();
    assert!(stylizer.set_action(Some(9)).is_err() && stylizer.set_mask(9, false).is_err());
}

/// A stylizer whose action is set during a stream uses the model of that action from then on.
#[test]
fn an_action_set_during_a_stream_takes_effect_from_there() {
    let database = Database::open(motion::small()).unwrap();
    let clip = motion::unseen(0, 0, 40);
    let request = Request { config: STATISTIC, ..Request::style(1) };
    let told = |actions: &[(usize, u16)]| {
        stream_with_labels(&database, &clip, &request, actions, &mut ())
            .unwrap()
            .steps
            .into_iter()
            .map(|s| s.frame)
    };
    let known = |action| {
        let request = Request { action, ..request.clone() };
        stream(&database, &clip, &request, &mut ()).unwrap().steps.into_iter().map(|s| s.frame)
    };
    assert!(told(&[(0, 1)]).eq(known(Some(1))));
    assert!(told(&[(20, 1)]).take(20).eq(known(None).take(20)));
    assert!(stream_with_labels(&database, &clip, &request, &[(20, 9)], &mut ()).is_err());
}

fn refuses(name: &str, blob: &[u8], section: u16, record: u32) {
    assert_eq!(Database::open(blob).err(), Some(BlobError::Value { section, record }), "{name}");
}

/// Every check of the linear models, one case each.
#[test]
fn linear_models_are_checked() {
    let blob = motion::tiny();
    let at = |at: usize, bytes: &[u8]| patched(blob, section::LTI, at, bytes);
    let database = Database::open(blob).unwrap();
    assert_eq!(database.linear_models(), 1);
    let dofs = database.counts().dofs;
    let model = database.linear_model(0);
    let (entry, start) = (lti::HEADER, lti::HEADER + lti::ENTRY);
    let units = start + lti::units(dofs, model.states);
    let refuses = |name: &str, at_byte: usize, bytes: &[u8], record: u32| {
        refuses(name, &at(at_byte, bytes), section::LTI, record);
    };
    refuses("no such style", lti::FROM.start, &9_u16.to_le_bytes(), 1);
    refuses("style of the model", entry + lti::STYLE.start, &9_u16.to_le_bytes(), 0);
    refuses("to its own style", entry + lti::STYLE.start, &0_u16.to_le_bytes(), 0);
    refuses("no such action", entry + lti::ACTION.start, &9_u16.to_le_bytes(), 0);
    refuses("more units than joints", entry + lti::UNITS.start, &999_u16.to_le_bytes(), 0);
    refuses("fewer units", entry + lti::UNITS.start, &1_u16.to_le_bytes(), 0);
    refuses("more states than there is room", entry + lti::STATES.start, &9_999_u16.to_le_bytes(), 0);
    refuses("other states", entry + lti::STATES.start, &1_u16.to_le_bytes(), 0);
    refuses("elsewhere", entry + lti::OFFSET.start, &48_u32.to_le_bytes(), 0);
    refuses("longer than the section", entry + lti::BYTES.start, &u32::MAX.to_le_bytes(), 0);
    // If a style's only model is for one action, the style has none for all actions.
    refuses("no model of all actions", entry + lti::ACTION.start, &0_u16.to_le_bytes(), 1);
    for (name, value) in [("NaN", f32::NAN), ("infinite", f32::INFINITY), ("huge", 1e9)] {
        refuses(&format!("mean {name}"), start, &value.to_le_bytes(), 0);
        refuses(&format!("step {name}"), start + lti::step(dofs), &value.to_le_bytes(), 0);
        refuses(&format!("foot {name}"), start + lti::feet(dofs), &value.to_le_bytes(), 0);
        refuses(&format!("A {name}"), units + lti::UNIT, &value.to_le_bytes(), 0);
    }
    for (name, value) in [("zero", 0.0_f32), ("negative", -1.0), ("NaN", f32::NAN)] {
        refuses(&format!("input deviation {name}"), start + 4, &value.to_le_bytes(), 0);
        refuses(&format!("output deviation {name}"), start + 12, &value.to_le_bytes(), 0);
        refuses(&format!("step deviation {name}"), start + lti::step(dofs) + 4, &value.to_le_bytes(), 0);
    }
    refuses("order", units + lti::ORDER, &[200], 0);
    refuses("no input", units + lti::INPUTS, &[0], 0);
    refuses("too many inputs", units + lti::INPUTS, &[5], 0);
    refuses("no output", units + lti::OUTPUTS, &[0], 0);
    refuses("reserved byte of a unit", units + lti::UNIT_RESERVED, &[1], 0);
    refuses("input dof", units + lti::FIRST_INPUT.start, &(dofs as u16).to_le_bytes(), 0);
    refuses("output dof", units + lti::FIRST_OUTPUT.start, &(dofs as u16).to_le_bytes(), 0);
    // A pole outside the unit circle: the first number of A.
    let unit = model.units().find(|u| u.order > 0).unwrap();
    assert_eq!((unit.first_input, unit.inputs), (0, 4));
    refuses("a pole outside", units + lti::UNIT, &50.0_f32.to_le_bytes(), 0);
    let reserved = at(lti::RESERVED.start, &[1]);
    assert_eq!(Database::open(&reserved).err(), Some(BlobError::Reserved { section: section::LTI }));
    let longer = with_section(blob, section::LTI, |bytes| bytes.extend([0; 4]));
    assert!(matches!(Database::open(&longer), Err(BlobError::Length { section: section::LTI, .. })));
    let nothing = with_section(blob, section::LTI, |bytes| bytes.truncate(20));
    assert!(matches!(Database::open(&nothing), Err(BlobError::Length { section: section::LTI, .. })));
    let header = with_section(blob, section::LTI, Vec::clear);
    assert!(matches!(Database::open(&header), Err(BlobError::Length { section: section::LTI, .. })));
}

/// Every check of the tables of statistics, one case each.
#[test]
fn statistics_are_checked() {
    let blob = motion::tiny();
    let database = Database::open(blob).unwrap();
    let (dofs, joints) = (database.counts().dofs, database.counts().joints);
    let tables = database.tables() as u32;
    let table = statistic::HEADER;
    let refuses = |name: &str, at: usize, bytes: &[u8], record: u32| {
        refuses(name, &patched(blob, section::STATISTIC, at, bytes), section::STATISTIC, record);
    };
    refuses("no such style", statistic::FROM.start, &9_u16.to_le_bytes(), tables);
    refuses("style of a table", table + statistic::STYLE.start, &9_u16.to_le_bytes(), 0);
    refuses("the same twice", table + statistic::STYLE.start, &1_u16.to_le_bytes(), 1);
    refuses("no such action", table + statistic::ACTION.start, &9_u16.to_le_bytes(), 0);
    refuses("no table of all actions", table + statistic::ACTION.start, &0_u16.to_le_bytes(), tables);
    let joint = table + statistic::joints(dofs);
    for value in [f32::NAN, f32::INFINITY, 1e9] {
        refuses("root", table + statistic::ROOT, &value.to_le_bytes(), 0);
        refuses("foot", table + statistic::FEET, &value.to_le_bytes(), 0);
        refuses("mean rotation", joint, &value.to_le_bytes(), 0);
    }
    for value in [0.0_f32, -1.0, f32::NAN] {
        refuses("deviation of the root", table + statistic::ROOT + 4, &value.to_le_bytes(), 0);
        refuses("deviation of a joint", joint + 16, &value.to_le_bytes(), 0);
    }
    for at in [statistic::RESERVED.start, table + statistic::TABLE_RESERVED.start] {
        let error = Database::open(&patched(blob, section::STATISTIC, at, &[1])).err();
        assert_eq!(error, Some(BlobError::Reserved { section: section::STATISTIC }), "byte {at}");
    }
    assert_eq!(statistic::length(joints), (patch::section(blob, section::STATISTIC).len() - 16) / 2);
    assert!(statistic::length(22) <= 4096);
    let longer = with_section(blob, section::STATISTIC, |bytes| bytes.extend([0; 4]));
    assert!(matches!(Database::open(&longer), Err(BlobError::Length { section: section::STATISTIC, .. })));
}

/// A blob without frames is checked by the rules of all blobs, and has to hold a model.
#[test]
fn a_blob_of_models_alone_is_checked() {
    use gestus_core::blob::Counts;
    use gestus_database::blob::assemble::assemble;
    let cut = models_only(&Database::open(motion::tiny()).unwrap()).unwrap();
    let database = Database::open(&cut).unwrap();
    let sections: Vec<_> = database.sections().into_iter().map(|(i, b)| (i, b.to_vec())).collect();
    let nothing = assemble(database.counts(), 30.0, &sections);
    refuses("neither frames nor models", &nothing, 0, 8);
    let all: Vec<_> =
        sections.iter().cloned().chain(database.optional_sections().map(|(i, b)| (i, b.to_vec()))).collect();
    let with = |change: fn(&mut Counts)| {
        let mut counts = *database.counts();
        change(&mut counts);
        assemble(&counts, 30.0, &all)
    };
    for change in [
        (|c: &mut Counts| c.classes = 0) as fn(&mut Counts),
        |c| c.rows = 1,
        |c| c.features = 0,
        |c| c.window = 0,
        |c| c.timing = 1,
        |c| c.cycles = 1,
        |c| c.clips = 1,
    ] {
        refuses("counts of a blob without frames", &with(change), 0, 8);
    }
    let stray = with_section(&cut, section::FEATURES, |bytes| bytes.push(0));
    assert!(matches!(Database::open(&stray), Err(BlobError::Length { section: section::FEATURES, .. })));
}
