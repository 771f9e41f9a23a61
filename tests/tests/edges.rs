//! Streams and blobs at the limits of what is allowed: jumps, turns on the spot, unusual timelines, repeated glitches.

use gestus_core::{
    Config, ConfigError, Database, Degraded, Method, Observer, Pose, Safety, Stylizer,
    blob::{Counterpart, Moment, layout::section},
    body::two_bone_ik::Chain,
    math::quaternion,
    search::found::Found,
};
use gestus_database::{
    build::{BuildError, BuildOptions, build},
    stream::to_pose,
};
use gestus_motion::corpus::Corpus;
use gestus_tests::{
    motion::{self, Size},
    patch::with_section,
};

type Standard<'db> = Stylizer<'db, 22, 40, 28>;

fn walk(action: usize, style: usize, frames: usize) -> Vec<Pose<22>> {
    motion::unseen(action, style, frames).frames.iter().map(to_pose).collect()
}

fn styled<'db>(db: Database<'db>, config: Config) -> Standard<'db> {
    let mut stylizer = Standard::new(db, config).unwrap();
    stylizer.set_style(&[(1, 1.0)]).unwrap();
    stylizer
}

fn with_strength<'db>(mut stylizer: Standard<'db>, strength: f32) -> Standard<'db> {
    for group in 0..stylizer.database().counts().groups {
        stylizer.set_strength(group as u16, strength).unwrap();
    }
    stylizer
}

fn is_finite(pose: &Pose<22>) -> bool {
    pose.position.iter().chain(pose.rotations.as_flattened()).all(|v| v.is_finite())
}

/// Classes in which a frame found no neighbor.
#[derive(Default)]
struct Empty(usize);

impl Observer<22> for Empty {
    fn searched(&mut self, _: usize, found: &Found<'_>) {
        self.0 += usize::from(found.rows().len() == 0);
    }
}

#[test]
fn a_search_begun_anew_finds_something_however_few_visits_are_left() {
    let blob = motion::blob(Size { actions: 2, styles: 3, takes: 8, frames: 300 });
    let db = Database::open(&blob).unwrap();
    let clips: Vec<_> = (0..6).map(|i| walk(i % 2, i / 2, 200)).collect();
    for (visits, pool, every) in [(240, 48, 5), (320, 64, 5), (225, 40, 5), (256, 40, 2)] {
        let mut stylizer = styled(db, Config::new().visits(visits).pool(pool));
        let (mut empty, mut output) = (Empty::default(), Pose::IDENTITY);
        for t in 0..400 {
            let input = clips[(t / every) % 6][t % 200];
            let _ = stylizer.step_observed(&input, &mut output, &mut empty);
        }
        assert_eq!(empty.0, 0, "{visits} visits, pool {pool}, a leap every {every} frames");
    }
}

#[test]
fn a_body_that_is_elsewhere_has_its_legs_under_it() {
    let db = Database::open(motion::small()).unwrap();
    let sprawl = |pose: &Pose<22>| {
        db.legs().unwrap().map(|leg| {
            let chain = Chain::of(&db, &leg, pose);
            (chain.ankle[0] - chain.hip[0]).hypot(chain.ankle[2] - chain.hip[2]) / chain.length()
        })
    };
    for way in [0.0, 5.0, 20.0, 200.0] {
        let mut stylizer = styled(db, Config::new());
        let (mut output, mut most) = (Pose::IDENTITY, 0.0f32);
        for (t, mut input) in walk(0, 0, 300).into_iter().enumerate() {
            input.position[0] += if t < 100 { 0.0 } else { way };
            let _ = stylizer.step(&input, &mut output);
            most = sprawl(&output).into_iter().fold(most, f32::max);
        }
        assert!(most < 0.8, "{way} m: a leg's ankle is {most} of its length beside the hip");
    }
}

#[test]
fn an_output_that_walks_out_of_the_world_goes_on_where_the_input_is() {
    let db = Database::open(motion::small()).unwrap();
    let mut clip = walk(0, 0, 120);
    // Half a metre before the end of the world, and back at the origin in the next frame: the output stays out there.
    let axis = |i: usize| clip[119].position[i] - clip[0].position[i];
    let i = if axis(0).abs() > axis(2).abs() { 0 } else { 2 };
    clip[0].position[i] = 99_999.5 * axis(i).signum();
    for method in Method::ALL {
        let mut stylizer = styled(db, Config::new().method(method));
        let (mut output, mut left) = (Pose::IDENTITY, None);
        for (t, pose) in clip.iter().enumerate() {
            let report = stylizer.step(pose, &mut output);
            assert!(output.is_valid(21), "{method:?}, frame {t}: {:?}", output.position);
            if report.degraded.contains(Degraded::PREDICTION) {
                left = left.or(Some(t));
            }
            let away = (output.position[i] - pose.position[i]).abs();
            assert_eq!(away < 10.0, left.is_some() || t == 0, "{method:?}, frame {t}: {away} m away");
        }
        assert!(left.is_some(), "{method:?} did not get there");
    }
}

#[test]
fn a_statue_that_turns_is_not_held_back() {
    let db = Database::open(motion::small()).unwrap();
    let still = walk(0, 0, 10)[5];
    for strength in [0.0, 1.0] {
        let mut stylizer = with_strength(styled(db, Config::new()), strength);
        let (mut output, mut off) = (Pose::IDENTITY, 0.0f32);
        // Stands until the speed limit has forgotten earlier motion, then turns at 2.5 rad/s.
        for t in 0..400 {
            let turn = (t - 150).max(0) as f32 * 2.5 / 30.0;
            let mut input = still;
            input.rotations[0] = quaternion::multiply(quaternion::about_y(turn), still.rotations[0]);
            let _ = stylizer.step(&input, &mut output);
            let beside =
                if t < 30 { 0.0 } else { quaternion::angle(input.rotations[0], output.rotations[0]) };
            off = off.max(beside);
        }
        let most = if strength == 0.0 { 0.01 } else { 0.25 };
        assert!(off < most, "strength {strength}: {off} rad behind");
    }
}

/// The blob with other knots. Arguments of `change`: whether the cycle is of the first style, the index of the knot in the
/// cycle, the number of knots, the first knot, the rows of the clip, and the knot.
fn with_knots(blob: &[u8], change: impl Fn(bool, usize, usize, f32, f32, f32) -> f32) -> Vec<u8> {
    let db = Database::open(blob).unwrap();
    let plain: Vec<_> =
        db.classes().filter(|c| c.style == 0).map(|c| c.first_cycle..c.first_cycle + c.cycles).collect();
    let cycles = db.sections().iter().find(|s| s.0 == section::CYCLES).unwrap().1.to_vec();
    with_section(blob, section::KNOTS, |bytes| {
        for (i, record) in cycles.chunks(16).enumerate() {
            let number = |at: usize| u32::from_le_bytes(record[at..at + 4].try_into().unwrap()) as usize;
            let rows = db.clip(number(0)).1 as f32;
            let count = usize::from(u16::from_le_bytes([record[8], record[9]]));
            let knots = &mut bytes[4 * number(4)..4 * (number(4) + count)];
            let own = plain.iter().any(|r| r.contains(&i));
            let start = f32::from_le_bytes(knots[..4].try_into().unwrap());
            for (k, knot) in knots.chunks_mut(4).enumerate() {
                let value = f32::from_le_bytes(knot.try_into().unwrap());
                knot.copy_from_slice(&change(own, k, count, start, rows, value).to_le_bytes());
            }
        }
    })
}

#[test]
fn time_goes_on_and_not_by_hours() {
    // The outputs take a third of the time; at twice the strength the time step reaches zero.
    let fast = with_knots(
        motion::small(),
        |own, _, _, start, _, knot| {
            if own { knot } else { start + 0.35 * (knot - start) }
        },
    );
    // Cycles of a fiftieth of a frame with outputs of half a minute.
    let slow = with_knots(motion::small(), |own, k, count, start, rows, knot| match own {
        true => start + 0.012 * k as f32,
        false if k + 1 == count => rows + 900.0,
        false => knot,
    });
    for (blob, strength) in [(&fast, 2.0), (&slow, 1.0)] {
        let db = Database::open(blob).unwrap();
        let mut stylizer = with_strength(styled(db, Config::new()), strength);
        stylizer.set_input_style(Some(0)).unwrap();
        let (mut output, step_s) = (Pose::IDENTITY, 1.0 / db.rate_hz());
        for (t, input) in walk(0, 0, 200).iter().enumerate() {
            let report = stylizer.step(input, &mut output);
            let in_range = (0.25 * step_s..=4.0 * step_s).contains(&report.step_s);
            assert!(in_range, "strength {strength}, frame {t}: {} s", report.step_s);
            assert!(is_finite(&output), "strength {strength}, frame {t}: {:?}", output.position);
        }
    }
}

/// The corpus, each cycle of four even segments instead of a gait's two.
fn whole_clips() -> Corpus {
    let mut corpus = motion::corpus(motion::SMALL);
    for cycle in corpus.examples.iter_mut().flat_map(|example| &mut example.cycles) {
        let (start, end) = cycle.span();
        cycle.knots = [0.0, 0.25, 0.5, 0.75, 1.0].map(|part| start + part * (end - start)).to_vec();
    }
    corpus
}

/// The warp between two waves, of three swings and of four, goes fast and slow as no body does.
#[test]
fn a_bent_warp_counts_half_in_the_time_of_whole_clips() {
    let even = build(&whole_clips(), &BuildOptions::default()).unwrap().bytes;
    // The outer segments of outputs take four fifths of the time; the pairs stay.
    let bent = with_knots(&even, |own, k, _, start, _, knot| match k {
        1 if !own => start + 1.6 * (knot - start),
        3 if !own => start + 0.8 * (knot - start),
        _ => knot,
    });
    let [even, bent] = [&even, &bent].map(|blob| Database::open(blob).unwrap());
    let mut slopes = 0;
    for (number, class) in even.classes().enumerate().filter(|(_, class)| class.style == 0) {
        for row in class.first_row + 1..class.first_row + class.rows {
            // Frames of a counterpart's step, and from its moment before to its moment now.
            let steps = |db: &Database<'_>| -> Vec<(f32, Option<f32>)> {
                let cycle = db.cycle_of(number, row);
                let found = cycle.into_iter().flat_map(|cycle| db.counterparts(cycle, row, 1));
                // Moments beyond a clip are clamped to its first or last row.
                let place = |m: Moment| (m.fraction > 0.0).then_some(m.row as f32 + m.fraction);
                let way = |c: &Counterpart| Some(place(c.now)? - place(c.before)?);
                found.map(|c| (c.step_s * db.rate_hz(), way(&c))).collect()
            };
            for ((even, _), (step, way)) in steps(&even).into_iter().zip(steps(&bent)) {
                if let Some(way) = way.filter(|way| (way / even - 1.0).abs() > 0.2) {
                    assert!((step - 0.5 * (even + way)).abs() < 1e-3, "row {row}: {step}, {even}, {way}");
                    slopes += 1;
                }
            }
        }
    }
    assert!(slopes > 100, "{slopes}");
}

#[test]
fn labels_do_not_outlive_the_method_that_knew_them() {
    let corpus = motion::corpus(motion::SMALL);
    let gone: Vec<usize> = corpus
        .examples
        .iter()
        .enumerate()
        .filter(|(_, e)| e.action == 1 && e.style == 2)
        .map(|(i, _)| i)
        .collect();
    let built = build(&corpus.without(&gone), &BuildOptions::default()).unwrap();
    let db = Database::open(&built.bytes).unwrap();
    let mut stylizer = styled(db, Config::new().method(Method::Statistic));
    stylizer.set_action(Some(1)).unwrap();
    stylizer.set_input_style(Some(2)).unwrap();
    stylizer.set_config(Config::new()).unwrap();
    assert_eq!(stylizer.labels(), (None, None));
    let mut output = Pose::IDENTITY;
    for input in walk(1, 0, 30) {
        assert!(!stylizer.step(&input, &mut output).classes.is_empty());
    }
}

#[test]
fn styles_of_groups_are_not_dropped_by_a_method_that_has_none() {
    let db = Database::open(motion::small()).unwrap();
    let linear = Config::new().method(Method::Lti);
    let mut stylizer = styled(db, Config::new());
    stylizer.set_group_style(1, &[(2, 1.0)]).unwrap();
    assert_eq!(stylizer.set_config(linear), Err(ConfigError::WholeBody));
    assert_eq!((stylizer.config().method, stylizer.style_of(1, 2)), (Method::Mar, 1.0));
    stylizer.set_group_style(1, &[]).unwrap();
    stylizer.set_config(linear).unwrap();
    // Before any change there are no group styles to lose.
    stylizer.set_config(Config::new()).unwrap();
    stylizer.set_group_style(1, &[(2, 1.0)]).unwrap();
    stylizer.restore(linear).unwrap();
    assert_eq!(stylizer.config().method, Method::Lti);
}

#[test]
fn more_actions_and_classes_than_there_is_room_for_are_refused() {
    let mut corpus = motion::corpus(motion::SMALL);
    let originals: Vec<_> = corpus.examples.iter().filter(|e| e.action == 0).cloned().collect();
    // Three styles of 86 actions: 258 classes.
    for action in corpus.actions.len()..86 {
        corpus.actions.push(format!("walk-{action}"));
        corpus.examples.extend(originals.iter().cloned().map(|mut e| {
            e.action = action;
            e
        }));
    }
    let refused = |corpus| match build(&corpus, &BuildOptions::default()).map(|_| ()) {
        Err(BuildError::TooMany { what, have, most, cure }) => (what, have, most, cure.contains("--actions")),
        other => panic!("{other:?}"),
    };
    assert_eq!(refused(corpus.clone()), ("classes".to_owned(), 258, 256, true));
    corpus.actions.extend((86..257).map(|a| format!("nothing-{a}")));
    corpus.examples.retain(|e| e.action < 2);
    assert_eq!(refused(corpus), ("actions".to_owned(), 257, 256, true));
}

#[test]
fn a_stylizer_restored_is_a_new_one() {
    let db = Database::open(motion::small()).unwrap();
    let (mut used, mut new) =
        (Standard::new(db, Config::new()).unwrap(), Standard::new(db, Config::new()).unwrap());
    used.set_floor([0.5; 2]).unwrap();
    used.restore(Config::new()).unwrap();
    let (mut a, mut b) = (Pose::IDENTITY, Pose::IDENTITY);
    for input in walk(0, 0, 60) {
        let _ = (used.step(&input, &mut a), new.step(&input, &mut b));
        assert_eq!(a, b);
    }
}

/// Beyond 8 km all joints of the search's window were in one place.
#[test]
fn far_from_the_origin_the_output_is_the_same() {
    let db = Database::open(motion::small()).unwrap();
    // Places that both streams can hold: f32 has steps of 8 mm at 90 km.
    let stepped = |v: f32| (v * 128.0).round() / 128.0;
    // A leg that is almost straight bends by a degree for such a step.
    let config = Config::new().contacts(false);
    for ground in [[8300.0, 0.0], [-20_000.0, 16_900.0], [90_000.0, -90_000.0]] {
        let (mut near, mut away) = (styled(db, config), styled(db, config));
        let (mut a, mut b) = (Pose::IDENTITY, Pose::IDENTITY);
        for (t, mut input) in walk(0, 0, 120).into_iter().enumerate() {
            (input.position[0], input.position[2]) = (stepped(input.position[0]), stepped(input.position[2]));
            let mut shifted = input;
            shifted.position[0] += ground[0];
            shifted.position[2] += ground[1];
            let reports = (near.step(&input, &mut a), away.step(&shifted, &mut b));
            assert_eq!(reports.0.degraded, reports.1.degraded, "frame {t}");
            let turns = a.rotations.iter().zip(&b.rotations).map(|(a, b)| quaternion::angle(*a, *b));
            let off = turns.fold(0.0, f32::max);
            assert!(off < 0.01, "frame {t} at {ground:?}: {off} rad");
        }
    }
}

#[test]
fn a_glitch_that_comes_again_is_no_news() {
    let db = Database::open(motion::small()).unwrap();
    let poses = walk(0, 0, 80);
    let mut stylizer = styled(db, Config::new().safety(Safety::Hold));
    let mut output = Pose::IDENTITY;
    for (t, input) in poses.iter().take(60).enumerate() {
        let _ = stylizer.tick(Some((input, t as u32)), &mut output);
    }
    let mut glitch = poses[60];
    glitch.position[0] += 5.0;
    let mut degraded = |number| stylizer.tick(Some((&glitch, number)), &mut output).degraded;
    assert_eq!(degraded(60), Degraded::LEAP);
    assert_eq!(format!("{:?} {:?}", Degraded::LEAP, Degraded::default()), "{leap} {}");
    for _ in 0..9 {
        assert_eq!(degraded(60), Degraded::ORDER);
    }
    // Four more such frames count as glitches; after that the new place is accepted.
    for number in 61..65 {
        assert_eq!(degraded(number), Degraded::LEAP, "{number}");
    }
    let taken = degraded(65);
    assert!(taken.contains(Degraded::LEAP));
    assert!(degraded(66).is_empty());
}

#[test]
fn frames_lost_between_glitches_count() {
    let db = Database::open(motion::small()).unwrap();
    let still = walk(0, 0, 10)[5];
    // With this many visits every class is searched completely, and none is searched again; every class may have weight.
    let mut stylizer = styled(db, Config::new().safety(Safety::Hold).visits(320).classes(8));
    let mut output = Pose::IDENTITY;
    let mut at = |x: f32, number| {
        let mut input = still;
        input.position[0] += x;
        stylizer.tick(Some((&input, number)), &mut output).degraded
    };
    for number in 0..30 {
        at(0.0, number);
    }
    assert_eq!(at(50.0, 30), Degraded::LEAP);
    // 4 m are a leap in two frames, but not in the twelve frames since the last accepted input.
    assert!(at(4.0, 41).is_empty());
}

#[test]
fn what_turns_all_the_way_round_does_not_leap() {
    let db = Database::open(motion::small()).unwrap();
    let still = walk(0, 0, 10)[5];
    for joint in [0, 6] {
        let mut stylizer = styled(db, Config::new().safety(Safety::Hold).contacts(false));
        let mut output = Pose::IDENTITY;
        for t in 0..120 {
            // 6 rad/s.
            let half = 0.5 * t as f32 * 6.0 / 30.0;
            let turn = [half.sin(), 0.0, 0.0, half.cos()];
            let mut input = still;
            input.rotations[joint] = match joint {
                0 => quaternion::multiply(turn, still.rotations[0]),
                _ => quaternion::multiply(still.rotations[joint], turn),
            };
            let degraded = stylizer.step(&input, &mut output).degraded;
            assert!(!degraded.contains(Degraded::LEAP), "joint {joint}, frame {t}");
        }
    }
}
