//! Tests that need real clips. They are skipped if the clips are missing, which fails with `CI=true`.

use gestus_core::{Config, Database, blob::layout::dof};
use gestus_database::{
    build::{BuildOptions, build},
    stream::{Request, Streamed, stream},
};
use gestus_evaluate::metrics::{centred, joint_distance};
use gestus_motion::{
    body::{Body, wrap},
    clip::{Clip, Frame},
    corpus::Corpus,
};
use gestus_tests::real_clips;

/// The clips of the figures in `docs/experiments/`, if they are present.
fn corpus(actions: &[&str]) -> Option<Corpus> {
    real_clips::corpus(actions, &["normal", "active", "elderly", "feminine"])
}

fn find(corpus: &Corpus, name: &str) -> usize {
    corpus.examples.iter().position(|e| e.clip.name.ends_with(name)).expect("the clip is there")
}

/// Poses of dofs, integrated from the origin.
fn walked(body: &Body, like: &Clip, rows: &[Vec<f64>]) -> Clip {
    let (mut ground, mut heading) = ([0.0, 0.0], 0.0);
    let frames: Vec<Frame> = rows
        .iter()
        .map(|row| {
            let (s, c) = f64::sin_cos(heading);
            let seconds = 1.0 / like.rate_hz;
            ground[0] += (s * row[dof::FORWARD] + c * row[dof::LEFT]) * seconds;
            ground[1] += (c * row[dof::FORWARD] - s * row[dof::LEFT]) * seconds;
            heading = wrap(heading + row[dof::YAW] * seconds);
            body.pose(row, ground, heading)
        })
        .collect();
    Clip { frames, ..like.clone() }
}

fn output_rows(body: &Body, like: &Clip, streamed: &Streamed) -> Vec<Vec<f64>> {
    body.clip_dofs(&Clip { frames: streamed.steps.iter().map(|s| s.frame.clone()).collect(), ..like.clone() })
}

#[test]
fn a_gesture_of_the_arm_is_kept_and_the_rest_is_as_it_was() {
    let Some(corpus) = corpus(&["walk"]) else { return };
    let body = Body::of(&corpus).unwrap();
    let test = find(&corpus, "walk_normal_001");
    let built = build(&corpus.without(&[test]), &BuildOptions::default()).unwrap();
    let database = Database::open(&built.bytes).unwrap();
    let clip = &corpus.examples[test].clip;
    let plain = body.clip_dofs(clip);
    let arm = corpus.skeleton.find("UpperArm_L").unwrap();
    let at = 4 + 3 * arm;
    let gesture = |axis: usize, amplitude: f64| -> Vec<Vec<f64>> {
        let mut rows = plain.clone();
        for (t, row) in rows.iter_mut().enumerate() {
            // One second to raise and one to lower, held for three.
            let rise = |from: f64| ((t as f64 - from) / 30.0).clamp(0.0, 1.0);
            row[at + axis] += amplitude * (rise(60.0) - rise(180.0));
        }
        rows
    };
    let held = 100..170;
    let hand = corpus.skeleton.find("Hand_L").unwrap();
    let moved = |rows: &[Vec<f64>], other: &[Vec<f64>], joint: usize| {
        let one = |t: usize| (centred(&body, &rows[t])[joint] - centred(&body, &other[t])[joint]).norm();
        100.0 * held.clone().map(one).sum::<f64>() / held.len() as f64
    };
    let run = |rows: &[Vec<f64>], request: &Request| {
        let clip = walked(&body, clip, rows);
        output_rows(&body, &clip, &stream(&database, &clip, request, &mut ()).unwrap())
    };
    let others: Vec<usize> =
        (0..corpus.skeleton.joints()).filter(|&j| body.landmarks.groups[j] == 0).collect();
    // Axis 2 lifts the arm sideways. The walk itself swings it about axis 1, and κ 2 attributes two standard deviations of
    // that swing to the model, so the default κ is needed to keep the gesture there. Axis 0 twists the arm.
    for (axis, kappa, most) in [(2, 2.0, 5.0), (1, 2.0, 8.0), (2, 0.25, 2.0), (1, 0.25, 2.0)] {
        // The amplitude that moves the hand by 33 cm.
        let (mut low, mut high) = (0.0, 3.0);
        for _ in 0..30 {
            let middle = 0.5 * (low + high);
            if moved(&gesture(axis, middle), &plain, hand) < 33.0 { low = middle } else { high = middle }
        }
        let with_gesture = gesture(axis, low);
        // Gesture and style add up to more than the arm of the database or the input does: the range of joints would take
        // a part of it.
        let config = Config::new().kappa(kappa).rho(1.0).joint_margin(0.0);
        let masked = Request { config, masked: vec![1, 2], ..Request::style(2) };
        let (with, without) = (run(&with_gesture, &masked), run(&plain, &masked));
        // Expected: the output without the gesture, plus the gesture.
        let mut wanted = without.clone();
        for (row, (g, p)) in wanted.iter_mut().zip(with_gesture.iter().zip(&plain)) {
            for i in at..at + 3 {
                row[i] += g[i] - p[i];
            }
        }
        let arm_error = moved(&with, &wanted, hand);
        let rest = others.iter().map(|&j| moved(&with, &without, j)).sum::<f64>() / others.len() as f64;
        let unbiased = Request { config: Config::new().kappa(1e6), ..Request::style(2) };
        let lost = moved(&run(&with_gesture, &unbiased), &wanted, hand);
        println!(
            "gesture of 33 cm about axis {axis}, κ {kappa}: hand {arm_error:.2} cm from where it should be, rest {rest:.4} cm; {lost:.1} cm without bias and mask"
        );
        assert!(arm_error <= most, "axis {axis}, κ {kappa}: {arm_error}");
        assert!(rest <= 0.1, "axis {axis}, κ {kappa}: {rest}");
        // With eight neighbors the output follows an arm of its own accord more closely than with sixteen.
        assert!(lost > 1.8 * arm_error, "axis {axis}, κ {kappa}: {lost}");
    }
}

#[test]
fn a_minute_of_walk_and_of_run_does_not_drift() {
    let Some(corpus) = corpus(&["walk", "run"]) else { return };
    let body = Body::of(&corpus).unwrap();
    for name in ["walk_normal_001", "run_normal_001"] {
        let test = find(&corpus, name);
        let built = build(&corpus.without(&[test]), &BuildOptions::default()).unwrap();
        let database = Database::open(&built.bytes).unwrap();
        let example = &corpus.examples[test];
        let rows = body.clip_dofs(&example.clip);
        let start = example.cycles[0].span().0.round() as usize;
        let end = example.cycles[example.cycles.len() - 1].span().1.round() as usize;
        let lap: Vec<Vec<f64>> = rows[start..end].to_vec();
        let laps = (60 * 30usize).div_ceil(lap.len());
        let long: Vec<Vec<f64>> = (0..laps).flat_map(|_| lap.iter().cloned()).collect();
        let clip = walked(&body, &example.clip, &long);
        let streamed = stream(&database, &clip, &Request::style(1), &mut ()).unwrap();
        let output = output_rows(&body, &clip, &streamed);
        // Every lap has the same input: the last lap of the output equals the third.
        let lap_of = |n: usize| &output[n * lap.len()..(n + 1) * lap.len()];
        let apart = lap_of(2)
            .iter()
            .zip(lap_of(laps - 1))
            .map(|(a, b)| joint_distance(&centred(&body, a), &centred(&body, b)));
        let drift = 100.0 * apart.sum::<f64>() / lap.len() as f64;
        println!("{name}: {:.0} s, last lap {drift:.4} cm from the third", long.len() as f64 / 30.0);
        assert!(drift < 0.1, "{name}: {drift}");
    }
}

#[test]
fn a_change_of_style_is_over_in_thirty_frames() {
    let Some(corpus) = corpus(&["walk", "run"]) else { return };
    let body = Body::of(&corpus).unwrap();
    let test = find(&corpus, "walk_normal_001");
    let built = build(&corpus.without(&[test]), &BuildOptions::default()).unwrap();
    let database = Database::open(&built.bytes).unwrap();
    let clip = &corpus.examples[test].clip;
    // Elderly from frame 100 on; before that one stream is active and the other elderly, so the fed-back outputs differ.
    let mut late = gestus_core::Stylizer::<22, 40, 28>::new(database, Config::new()).unwrap();
    let mut always = late.clone();
    late.set_style(&[(1, 1.0)]).unwrap();
    always.set_style(&[(2, 1.0)]).unwrap();
    let (mut a, mut b) = (gestus_core::Pose::IDENTITY, gestus_core::Pose::IDENTITY);
    let mut differences = Vec::new();
    for (t, frame) in clip.frames.iter().enumerate().take(150) {
        if t == 100 {
            late.set_style(&[(2, 1.0)]).unwrap();
        }
        let pose = gestus_database::stream::to_pose::<22>(frame);
        let _ = late.step(&pose, &mut a);
        let _ = always.step(&pose, &mut b);
        let joints = body.skeleton.joints();
        let angle = |j: usize| {
            let dot: f32 = a.rotations[j].iter().zip(&b.rotations[j]).map(|(x, y)| x * y).sum();
            2.0 * f64::from(dot.abs().min(1.0)).acos()
        };
        differences.push((1..joints).map(angle).fold(0.0, f64::max));
    }
    let (before, after) = (differences[99], differences[130]);
    println!("largest joint difference {before:.3} rad before the change, {after:.4} rad thirty frames on");
    assert!(before > 0.3 && after < 0.02, "{before} {after}");
}

#[test]
fn standing_feet_do_not_slide_on_real_clips() {
    use gestus_database::registration::contact::contacts;
    use gestus_evaluate::{
        measures::contacts::Score,
        metrics::{
            feet::{deepest_cm, skate_cm_s},
            performance::Performance,
            speed::fastest,
        },
    };
    let gaits = ["walk", "run", "walk-turn-left", "walk-turn-right"];
    let Some(corpus) = corpus(&gaits) else { return };
    let body = Body::of(&corpus).unwrap();
    let tests = gaits.map(|gait| find(&corpus, &format!("{gait}_normal_001")));
    let built = build(&corpus.without(&tests), &BuildOptions::default()).unwrap();
    let database = Database::open(&built.bytes).unwrap();
    let legs = database.legs().unwrap();
    let mut score = Score::default();
    for test in tests {
        let clip = &corpus.examples[test].clip;
        let name = &clip.name;
        // Translated to its own style, so that the clip's own feet are the truth.
        let request = Request { config: Config::new().contacts(false), ..Request::style(0) };
        let own = stream(&database, clip, &request, &mut ()).unwrap();
        for (step, truth) in own.steps.iter().zip(contacts(clip, &body.landmarks)) {
            score.add(step.report.contacts[0], truth[0]);
            score.add(step.report.contacts[1], truth[1]);
        }
        for style in [1, 2] {
            let streamed = stream(&database, clip, &Request::style(style), &mut ()).unwrap();
            let performance = Performance::of_stream(&streamed);
            let skate = skate_cm_s(&corpus.skeleton, &legs, &performance);
            let deepest = deepest_cm(&corpus.skeleton, &legs, &performance);
            let shown = fastest(&Performance::of_clip(clip, &body));
            let faster = fastest(&performance) / shown;
            // A quicker style turns its joints as fast as its clips do.
            let of_style =
                (0..database.counts().classes).filter(|class| database.class(*class).style == style);
            let turning = of_style.map(|class| f64::from(database.trust_limits(class).unwrap().turning));
            let allowed = (1.2 * shown).max(turning.fold(0.0, f64::max).min(2.0 * shown));
            println!(
                "{name} to {}: skate {skate:.2} cm/s, lowest foot {deepest:.2} cm, fastest joint {faster:.2} times the input's",
                corpus.styles[usize::from(style)]
            );
            assert!(skate <= 1.0, "feet slide at {skate} cm/s");
            assert!(deepest > -1.1, "{deepest} cm below the floor");
            assert!(faster * shown < 1.0001 * allowed, "a joint {faster} times as fast as any of the input");
        }
    }
    println!("contacts: F1 {:.4}, accuracy {:.4}", score.f1(), score.accuracy());
    assert!(score.f1() >= 0.975, "{}", score.f1());
}

#[test]
fn transferred_real_clips_stand_without_a_pop() {
    use gestus_database::{
        models::statistic::transfer::{Options, transfer},
        stream::cleanup::Limbs,
    };
    use gestus_evaluate::metrics::{feet::skate_cm_s, performance::Performance, speed::fastest};
    let Some(corpus) = corpus(&["walk", "run", "walk-turn-left"]) else { return };
    let body = Body::of(&corpus).unwrap();
    let pairs = [
        ("walk_normal_001", "walk_elderly_001"),
        ("walk_normal_002", "walk_feminine_002"),
        ("run_normal_002", "run_elderly_002"),
        ("walk-turn-left_normal_001", "walk-turn-left_active_001"),
        // Its knees are hyperextended, and used to flip.
        ("walk-turn-left_normal_002", "walk-turn-left_feminine_002"),
    ];
    for (source, reference) in pairs {
        let clip = |name: &str| &corpus.examples[find(&corpus, name)].clip;
        let (source, reference) = (clip(source), clip(reference));
        let (limbs, stands) = Limbs::of_clip(&body, source).unwrap();
        let go = |clean_up: bool| {
            let options = Options { clean_up, ..Options::default() };
            let frames = transfer(&body, source, reference, &options).unwrap().clip.frames;
            let steps_s = vec![1.0 / source.rate_hz; frames.len()];
            Performance { frames, steps_s, stands: stands.clone() }
        };
        let (raw, cleaned) = (go(false), go(true));
        let skate = |p: &Performance| skate_cm_s(&body.skeleton, limbs.legs(), p);
        let faster = fastest(&cleaned) / fastest(&raw);
        println!(
            "{} in the style of {}: skate {:.1} -> {:.2} cm/s, fastest joint {faster:.2} times as fast",
            source.name,
            reference.name,
            skate(&raw),
            skate(&cleaned)
        );
        assert!(skate(&raw) > 3.0 && skate(&cleaned) <= 1.0, "{} {}", skate(&raw), skate(&cleaned));
        assert!(faster <= 1.2, "{faster}");
    }
}
