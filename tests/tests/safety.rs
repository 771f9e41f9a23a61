//! A loop whose input fails: its output and its reports, and that no joint jumps when the input returns.

use gestus_core::{Config, Database, Degraded, Pose, Report, Safety, Stylizer};
use gestus_database::stream::{from_pose, to_pose};
use gestus_tests::motion;

type Standard<'db> = Stylizer<'db, 22, 40, 28>;

/// In the stream without faults no joint turns by more than about 0.2 rad a frame, and nothing here may be faster.
const CALM: f64 = 0.3;

fn stylizer(safety: Safety) -> Standard<'static> {
    let config = Config::new().safety(safety).contacts(false);
    let mut stylizer = Standard::new(Database::open(motion::small()).unwrap(), config).unwrap();
    stylizer.set_style(&[(1, 1.0)]).unwrap();
    stylizer
}

fn poses() -> Vec<Pose<22>> {
    motion::unseen(0, 0, 150).frames.iter().map(to_pose).collect()
}

/// Largest angle between joints of two poses, the root's included, radians.
fn apart(a: &Pose<22>, b: &Pose<22>) -> f64 {
    let (a, b) = (from_pose(a, 21), from_pose(b, 21));
    a.rotations.iter().zip(&b.rotations).map(|(p, q)| p.angle_to(q)).fold(0.0, f64::max)
}

/// The output of a loop whose input `t` is `arrives(t, pose)`.
fn run(
    safety: Safety,
    arrives: impl Fn(usize, Pose<22>) -> Option<(Pose<22>, u32)>,
) -> Vec<(Pose<22>, Report)> {
    let mut stylizer = stylizer(safety);
    let mut output = Pose::IDENTITY;
    poses()
        .into_iter()
        .enumerate()
        .map(|(t, pose)| {
            let input = arrives(t, pose);
            let report = stylizer.tick(input.as_ref().map(|(p, n)| (p, *n)), &mut output);
            (output, report)
        })
        .collect()
}

fn calm(outputs: &[(Pose<22>, Report)]) {
    for (t, w) in outputs.windows(2).enumerate() {
        let turned = apart(&w[0].0, &w[1].0);
        assert!(turned < CALM, "frame {}: {turned} rad", t + 1);
    }
}

#[test]
fn a_loop_without_faults_is_a_stream() {
    let mut plain = stylizer(Safety::Follow);
    let mut output = Pose::IDENTITY;
    for safety in [Safety::Follow, Safety::Hold, Safety::Rest] {
        plain.reset();
        for ((looped, report), pose) in
            run(safety, |t, p| Some((p, (t as u32).wrapping_sub(20)))).iter().zip(poses())
        {
            let expected = plain.step(&pose, &mut output);
            assert_eq!((looped, report), (&output, &expected));
        }
    }
}

#[test]
fn stale_input_is_held_and_the_way_back_is_eased() {
    let outputs = run(Safety::Hold, |t, p| (!(60..75).contains(&t)).then_some((p, t as u32)));
    for t in 60..75 {
        assert_eq!(outputs[t].0, outputs[59].0, "frame {t}");
        assert_eq!(outputs[t].1.degraded, Degraded::STALE);
    }
    assert!(outputs[75].1.degraded.is_empty() || !outputs[75].1.degraded.contains(Degraded::STALE));
    calm(&outputs);
    // Half a second later the stream has recovered.
    let whole = run(Safety::Hold, |t, p| Some((p, t as u32)));
    assert!(apart(&outputs[140].0, &whole[140].0) < 0.05, "{}", apart(&outputs[140].0, &whole[140].0));
    // The root has moved for fifteen frames, which must not become the speed of one frame.
    let speed = |a: &Pose<22>, b: &Pose<22>| {
        f64::from((a.position[0] - b.position[0]).hypot(a.position[2] - b.position[2]))
    };
    let most = whole.windows(2).map(|w| speed(&w[0].0, &w[1].0)).fold(0.0, f64::max);
    for t in 76..90 {
        assert!(speed(&outputs[t - 1].0, &outputs[t].0) < 2.0 * most, "frame {t}");
    }
}

#[test]
fn stale_input_eases_to_rest_and_comes_back() {
    let outputs = run(Safety::Rest, |t, p| (!(40..110).contains(&t)).then_some((p, t as u32)));
    calm(&outputs);
    let database = Database::open(motion::small()).unwrap();
    let rest = &outputs[109].0;
    for j in 1..21 {
        let mean = Pose::<22> { rotations: [database.joint(j).mean; 22], ..Pose::IDENTITY };
        let is = Pose::<22> { rotations: [rest.rotations[j]; 22], ..Pose::IDENTITY };
        assert!(apart(&mean, &is) < 0.02, "joint {j} is not at rest");
    }
    // The body stays in its place, on the floor.
    assert_eq!((rest.position[0], rest.position[2]), (outputs[39].0.position[0], outputs[39].0.position[2]));
    let legs = database.legs().unwrap();
    let over = legs
        .iter()
        .map(|leg| {
            let chain = gestus_core::body::two_bone_ik::Chain::of(&database, leg, rest);
            (chain.ankle[1] - leg.heights[0]).min(chain.toe[1] - leg.heights[1])
        })
        .fold(f32::INFINITY, f32::min);
    assert!(over.abs() < 0.01, "{over}");
}

#[test]
fn input_out_of_order_is_ignored() {
    for (name, number) in
        [("the same again", 59_u32), ("older", 12), ("far behind", 59_u32.wrapping_sub(1 << 30))]
    {
        let outputs = run(Safety::Hold, |t, p| Some((p, if t == 60 { number } else { t as u32 })));
        assert_eq!(outputs[60].1.degraded, Degraded::ORDER, "{name}");
        assert_eq!(outputs[60].0, outputs[59].0, "{name}");
        calm(&outputs);
    }
}

/// A sender that starts anew, or whose number was wrong once, is taken up again after eight poses.
#[test]
fn a_counter_that_starts_anew_is_taken_up() {
    let restarted = |t: usize| if t < 60 { 1_000_000 + t as u32 } else { t as u32 - 60 };
    let far = |t: usize| if t == 60 { 500_000_000 } else { t as u32 };
    let counters: [(&str, &dyn Fn(usize) -> u32); 2] = [("starts anew", &restarted), ("one is wrong", &far)];
    for (name, number) in counters {
        for safety in [Safety::Follow, Safety::Hold] {
            let outputs = run(safety, |t, p| Some((p, number(t))));
            let late: Vec<usize> =
                (0..150).filter(|&t| outputs[t].1.degraded.contains(Degraded::ORDER)).collect();
            assert_eq!(late.len(), 7, "{name}, {safety:?}: {late:?}");
            assert!(late.iter().all(|t| (60..68).contains(t)), "{name}, {safety:?}: {late:?}");
            assert!(outputs.iter().all(|o| o.0.is_valid(21)));
        }
    }
}

#[test]
fn a_glitch_is_ignored_and_a_new_place_is_accepted() {
    let shift = |mut pose: Pose<22>| {
        pose.position[0] += 2.0;
        pose.rotations[6] = [0.0, 0.0, 1.0, 0.0];
        pose
    };
    for safety in [Safety::Hold, Safety::Rest] {
        let glitch = run(safety, |t, p| Some((if (70..72).contains(&t) { shift(p) } else { p }, t as u32)));
        for t in 70..72 {
            assert!(glitch[t].1.degraded.contains(Degraded::LEAP), "frame {t}");
        }
        assert!(!glitch[72].1.degraded.contains(Degraded::LEAP));
        calm(&glitch);
        let stays = run(safety, |t, p| {
            let mut moved = p;
            moved.position[0] += if t >= 70 { 4.0 } else { 0.0 };
            Some((moved, t as u32))
        });
        let leapt: Vec<usize> = (0..150).filter(|&t| stays[t].1.degraded.contains(Degraded::LEAP)).collect();
        assert_eq!(leapt, [70, 71, 72, 73, 74, 75], "five frames of patience, then it is taken");
        calm(&stays);
        // The root does not race to the new place.
        for w in stays.windows(2) {
            assert!((w[1].0.position[0] - w[0].0.position[0]).abs() < 0.15);
        }
    }
    let followed = run(Safety::Follow, |t, p| Some((if t == 70 { shift(p) } else { p }, t as u32)));
    assert!(followed[70].1.degraded.contains(Degraded::LEAP), "it is followed, and reported");
    assert_ne!(followed[70].0, followed[69].0);
}

#[test]
fn an_invalid_pose_is_reported_and_repaired() {
    for safety in [Safety::Hold, Safety::Rest] {
        let outputs = run(safety, |t, mut p| {
            if (50..53).contains(&t) {
                p.rotations[3] = [f32::NAN; 4];
            }
            Some((p, t as u32))
        });
        for (output, report) in &outputs[50..53] {
            assert_eq!(report.degraded, Degraded::INPUT);
            assert!(output.is_valid(21));
        }
        calm(&outputs);
    }
}

#[test]
fn before_the_first_input_there_is_nothing_to_hold() {
    let mut stylizer = stylizer(Safety::Rest);
    let mut output = poses()[0];
    assert_eq!(stylizer.tick(None, &mut output).degraded, Degraded::STALE);
    assert_eq!(output, poses()[0], "what the caller holds stays");
    assert!(stylizer.last_output().is_none());
}

#[test]
fn a_held_output_keeps_its_feet_in_place() {
    let whole = run(Safety::Follow, |t, p| Some((p, t as u32)));
    let standing =
        (40..120).find(|&t| whole[t].1.contacts == [true, false]).expect("a step on the left foot");
    type Fault = fn(Pose<22>, u32) -> Option<(Pose<22>, u32)>;
    let faults: [Fault; 3] =
        [|_, _| None, |p, t| Some((p, t - 1)), |p, t| Some((Pose { position: [f32::NAN; 3], ..p }, t))];
    for safety in [Safety::Follow, Safety::Hold] {
        for fault in faults {
            let outputs =
                run(safety, |t, p| if t == standing + 1 { fault(p, t as u32) } else { Some((p, t as u32)) });
            assert_eq!(outputs[standing + 1].0, outputs[standing].0);
            assert_eq!(outputs[standing + 1].1.contacts, [true, false]);
        }
    }
    // At rest it stands on both feet, or on the one that is lower.
    let resting = run(Safety::Rest, |t, p| (t < 60).then_some((p, t as u32)));
    assert!(resting[149].1.contacts != [false; 2]);
}

#[test]
fn after_a_leap_the_body_has_no_motion_from_the_old_place() {
    // The same walk with a leap in it, and one that begins after the leap.
    let place = |t: usize, mut p: Pose<22>| {
        p.position[0] += if t < 70 { 0.0 } else { 30.0 };
        p
    };
    let mut leapt = stylizer(Safety::Hold);
    let mut anew = stylizer(Safety::Hold);
    let (mut a, mut b) = (Pose::IDENTITY, Pose::IDENTITY);
    for (t, pose) in poses().into_iter().enumerate() {
        let report = leapt.tick(Some((&place(t, pose), t as u32)), &mut a);
        if t < 75 {
            continue;
        }
        let first = anew.step(&place(t, pose), &mut b);
        // From the accepted frame on, the neighbors are those of a body that never was elsewhere.
        let (here, there) = (report.distance2, first.distance2);
        assert!(here <= 1.5 * there + 1e-3, "frame {t}: {here}, and {there} of a stream that begins there");
    }
}
