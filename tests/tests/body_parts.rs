//! Strengths and styles of joint groups, changed while a stream runs.

use std::sync::OnceLock;

use gestus_core::{Config, ConfigError, Database, Method, Pose, STRENGTH_S, Stylizer};
use gestus_database::{
    build::{BuildOptions, build},
    search::groups,
    stream::{from_pose, to_pose},
};
use gestus_tests::motion;

type Standard<'db> = Stylizer<'db, 22, 40, 28>;

const RATE_HZ: f64 = 30.0;

fn stylizer(config: Config) -> Standard<'static> {
    let mut stylizer = Standard::new(Database::open(motion::small()).unwrap(), config).unwrap();
    stylizer.set_style(&[(2, 1.0)]).unwrap();
    stylizer
}

fn poses(frames: usize) -> Vec<Pose<22>> {
    motion::unseen(0, 0, frames).frames.iter().map(to_pose).collect()
}

/// The output poses of a stream; `change` is called before each step.
fn run(
    stylizer: &mut Standard<'_>,
    input: &[Pose<22>],
    change: impl Fn(&mut Standard<'_>, usize),
) -> Vec<Pose<22>> {
    let mut output = Pose::IDENTITY;
    input
        .iter()
        .enumerate()
        .map(|(t, pose)| {
            change(stylizer, t);
            let _ = stylizer.step(pose, &mut output);
            output
        })
        .collect()
}

/// For each frame, the largest change of any joint's angular velocity since the last frame, rad/s.
fn jerks(poses: &[Pose<22>]) -> Vec<f64> {
    let frames: Vec<_> = poses.iter().map(|p| from_pose(p, 21)).collect();
    let velocity = |t: usize, j: usize| {
        (frames[t].rotations[j].inverse() * frames[t + 1].rotations[j]).scaled_axis() * RATE_HZ
    };
    (1..frames.len() - 1)
        .map(|t| (1..21).map(|j| (velocity(t, j) - velocity(t - 1, j)).norm()).fold(0.0, f64::max))
        .collect()
}

fn most(values: &[f64]) -> f64 {
    values.iter().copied().fold(0.0, f64::max)
}

/// A generated walk whose feet do not slide.
fn walker() -> &'static (Vec<u8>, Vec<Pose<22>>) {
    static WALKER: OnceLock<(Vec<u8>, Vec<Pose<22>>)> = OnceLock::new();
    WALKER.get_or_init(|| {
        let (blob, clip) = motion::walker(&["neutral", "old", "childlike"], 8.0);
        (blob, clip.frames.iter().map(to_pose).collect())
    })
}

fn walking(config: Config) -> Standard<'static> {
    let database = Database::open(&walker().0).unwrap();
    let style = database.manifest().unwrap().styles.find("old").unwrap();
    let mut stylizer = Standard::new(database, config).unwrap();
    stylizer.set_style(&[(style, 1.0)]).unwrap();
    stylizer
}

#[test]
fn a_change_of_strength_makes_no_speed_jump() {
    let changes: [(usize, f32); 6] = [(60, 0.0), (90, 2.0), (94, 0.3), (120, 2.0), (150, 0.0), (180, 1.0)];
    let change = |s: &mut Standard<'_>, t: usize| {
        for (_, strength) in changes.iter().filter(|c| c.0 == t) {
            (0..3).for_each(|group| s.set_strength(group, *strength).unwrap());
        }
    };
    let raw = Config::new().contacts(false);
    let streams: [(&str, Standard<'_>, Vec<Pose<22>>); 3] = [
        ("arms a radian higher", stylizer(raw), poses(220)),
        ("a walk", walking(raw), walker().1.clone()),
        ("a walk whose feet are held", walking(Config::new()), walker().1.clone()),
    ];
    for (name, stylizer, input) in streams {
        let of = |change: &dyn Fn(&mut Standard<'_>, usize)| run(&mut stylizer.clone(), &input, change);
        let calm = most(&jerks(&of(&|_, _| {})));
        let twice = most(&jerks(&of(&|s, t| {
            if t == 0 {
                (0..3).for_each(|group| s.set_strength(group, 2.0).unwrap());
            }
        })));
        let glided = most(&jerks(&of(&change)));
        println!(
            "{name}: a joint's velocity changes by {calm:.2} rad/s a frame at most, at strength 2 {twice:.2}, \
                  through changes of strength {glided:.2}"
        );
        // A spring of 8/s starts a change of 2 rad with 8 * 8 * 2 / 30 rad/s; an abrupt change would have 60 rad/s.
        assert!(
            glided < calm.max(twice) + 4.3,
            "{name}: {glided}; without changes {calm}, at strength 2 {twice}"
        );
    }
}

#[test]
fn a_strength_arrives_in_its_time_and_a_stream_begins_with_it() {
    let input = poses(90);
    let mut stylizer = stylizer(Config::new());
    stylizer.set_strength(1, 0.25).unwrap();
    let mut output = Pose::IDENTITY;
    let _ = stylizer.step(&input[0], &mut output);
    assert_eq!(stylizer.strength_now(1), 0.25, "a first frame has it at once");
    stylizer.set_strength(1, 1.25).unwrap();
    assert_eq!((stylizer.strength(1), stylizer.strength_now(1)), (1.25, 0.25));
    let mut before = 0.25;
    for (t, pose) in input[1..].iter().enumerate() {
        let _ = stylizer.step(pose, &mut output);
        let now = stylizer.strength_now(1);
        assert!(now >= before && now <= 1.25, "frame {t}: {now} after {before}");
        // A critically damped spring from rest: 1 - (1 + wt) exp(-wt).
        let wt = 8.0 * (t + 1) as f64 / RATE_HZ;
        let exact = 0.25 + 1.0 - (1.0 + wt) * (-wt).exp();
        assert!((f64::from(now) - exact).abs() < 2e-4, "frame {t}: {now}, not {exact}");
        if t as f64 + 1.0 >= f64::from(STRENGTH_S) * RATE_HZ {
            assert!(now >= 0.25 + 0.95, "frame {t}: {now}");
        }
        before = now;
    }
    assert_eq!(before, 1.25, "there to the bit");
    stylizer.set_strength(1, 0.5).unwrap();
    stylizer.reset();
    let _ = stylizer.step(&input[0], &mut output);
    assert_eq!(stylizer.strength_now(1), 0.5);
}

#[test]
fn feet_that_are_held_are_let_go_gently_when_the_style_fades() {
    let input = &walker().1;
    let off = |s: &mut Standard<'_>, t: usize| {
        if t == 70 {
            (0..3).for_each(|group| s.set_strength(group, 0.0).unwrap());
        }
        if t == 150 {
            (0..3).for_each(|group| s.set_strength(group, 1.0).unwrap());
        }
    };
    let held = run(&mut walking(Config::new()), input, |_, _| {});
    let faded = run(&mut walking(Config::new()), input, off);
    let ground = |w: &[Pose<22>]| {
        f64::from((w[1].position[0] - w[0].position[0]).hypot(w[1].position[2] - w[0].position[2]))
    };
    let up = |w: &[Pose<22>]| f64::from((w[1].position[1] - w[0].position[1]).abs());
    let fastest =
        |poses: &[Pose<22>], of: &dyn Fn(&[Pose<22>]) -> f64| poses.windows(2).map(of).fold(0.0, f64::max);
    for (name, of) in [("goes", &ground as &dyn Fn(&[Pose<22>]) -> f64), ("rises", &up)] {
        let most = fastest(&held, of).max(fastest(input, of));
        let found = fastest(&faded, of);
        println!("the root {name} {most:.4} m a frame at most, through the change {found:.4}");
        assert!(found < 1.2 * most + 0.004, "the root {name} {found} m in a frame, else {most} at most");
    }
    // Without a style the output equals the input, including the height of the root.
    for t in 130..150 {
        let (last, wanted) = (from_pose(&faded[t], 21), from_pose(&input[t], 21));
        for (j, (a, b)) in last.rotations.iter().zip(&wanted.rotations).enumerate() {
            assert!(a.angle_to(b) < 1e-3, "frame {t}, joint {j}: {}", a.angle_to(b));
        }
        assert!((faded[t].position[1] - input[t].position[1]).abs() < 2e-3, "frame {t}");
    }
}

#[test]
fn groups_have_their_own_styles_to_the_bit_under_every_label() {
    let input = poses(60);
    let database = Database::open(motion::small()).unwrap();
    for method in [Method::Mar, Method::Statistic] {
        if !method.is_available_in(&database) {
            continue;
        }
        for (action, input_style) in [(None, None), (Some(0), None), (None, Some(0)), (Some(0), Some(0))] {
            // The effects of lock and limit depend on the time step, which depends on the whole body.
            let labelled = |style: &[(u16, f32)]| {
                let mut s = stylizer(Config::new().contacts(false).speed_limit(0.0).method(method));
                s.set_action(action).unwrap();
                s.set_input_style(input_style).unwrap();
                s.set_style(style).unwrap();
                s
            };
            let mut mixed = labelled(&[(1, 1.0)]);
            mixed.set_group_style(1, &[(2, 3.0), (0, 1.0)]).unwrap();
            mixed.set_group_style(2, &[(2, 1.0)]).unwrap();
            assert_eq!([0, 1, 2].map(|s| mixed.style_of(1, s)), [0.25, 0.0, 0.75]);
            assert_eq!(mixed.style(), [0.0, 1.0, 0.0], "the body's is what it was");
            let mixed = run(&mut mixed, &input, |_, _| {});
            let pure = [&[(1, 1.0)][..], &[(2, 3.0), (0, 1.0)], &[(2, 1.0)]]
                .map(|style| run(&mut labelled(style), &input, |_, _| {}));
            for (t, pose) in mixed.iter().enumerate() {
                for j in 1..21 {
                    let group = database.joint_group(j);
                    assert_eq!(
                        pose.rotations[j], pure[group][t].rotations[j],
                        "{method:?} {action:?} {input_style:?} frame {t} joint {j} of group {group}"
                    );
                }
            }
            let arm = (1..21).find(|&j| database.joint_group(j) == 1).unwrap() + 1;
            assert_ne!(mixed[40].rotations[arm], pure[0][40].rotations[arm], "the styles differ");
        }
    }
}

#[test]
fn a_group_that_is_given_back_follows_the_body() {
    let input = poses(50);
    let whole = run(&mut stylizer(Config::new()), &input, |_, _| {});
    let mut given = stylizer(Config::new());
    given.set_group_style(1, &[(0, 1.0)]).unwrap();
    given.set_group_style(1, &[]).unwrap();
    assert_eq!(run(&mut given, &input, |_, _| {}), whole);
    // A group style equal to the body's gives the same poses.
    given.reset();
    (0..3).for_each(|group| given.set_group_style(group, &[(2, 0.5)]).unwrap());
    assert_eq!(run(&mut given, &input, |_, _| {}), whole);
    given.restore(Config::new()).unwrap();
    assert_eq!(given.style_of(1, 0), 1.0);
}

#[test]
fn group_styles_that_are_refused_change_nothing() {
    let mut stylizer = stylizer(Config::new());
    stylizer.set_group_style(1, &[(1, 1.0)]).unwrap();
    let unknown = |id| ConfigError::Unknown { id, have: 3 };
    type Refused<'a> = (u16, &'a [(u16, f32)], ConfigError);
    let refused: [Refused<'_>; 7] = [
        (3, &[(1, 1.0)], unknown(3)),
        (u16::MAX, &[], unknown(u16::MAX)),
        (1, &[(0, 1.0), (3, 1.0)], unknown(3)),
        (1, &[(0, 0.0)], ConfigError::Weights),
        (1, &[(0, f32::NAN)], ConfigError::Weights),
        (1, &[(0, -1.0), (2, 2.0)], ConfigError::Weights),
        (1, &[(0, 1.0); 4], ConfigError::Weights),
    ];
    for (group, weights, error) in refused {
        assert_eq!(stylizer.set_group_style(group, weights), Err(error), "{weights:?}");
        assert_eq!([0, 1, 2].map(|s| stylizer.style_of(1, s)), [0.0, 1.0, 0.0], "{weights:?}");
    }
}

#[test]
fn groups_named_at_build_take_strengths_styles_and_masks() {
    let named: Vec<String> =
        ["legs", "head", "torso", "sword-arm=Shoulder_R"].iter().map(|s| (*s).to_owned()).collect();
    let options = BuildOptions { groups: groups::parse(&named).unwrap(), ..BuildOptions::default() };
    let blob = build(&motion::corpus(motion::SMALL), &options).unwrap().bytes;
    let database = Database::open(&blob).unwrap();
    let names = database.manifest().unwrap().groups;
    assert_eq!(names.iter().collect::<Vec<_>>(), ["body", "head", "legs", "sword-arm", "torso"]);
    let of = |name: &str| {
        let group = names.find(name).unwrap();
        (0..21).filter(move |&j| database.joint_group(j) == usize::from(group)).collect::<Vec<_>>()
    };
    assert_eq!(of("legs"), (13..21).collect::<Vec<_>>());
    // The other arm is attached to the torso.
    assert_eq!((of("head"), of("sword-arm")), (vec![3, 4], vec![9, 10, 11, 12]));
    assert_eq!((of("body"), of("torso")), (vec![0], vec![1, 2, 5, 6, 7, 8]));
    let input = poses(60);
    // As above.
    let config = Config::new().contacts(false).speed_limit(0.0);
    let styled = |set: &dyn Fn(&mut Standard<'_>)| {
        let mut stylizer = Standard::new(database, config).unwrap();
        stylizer.set_style(&[(2, 1.0)]).unwrap();
        set(&mut stylizer);
        run(&mut stylizer, &input, |_, _| {})
    };
    let legs = names.find("legs").unwrap();
    let (whole, other) = (styled(&|_| {}), styled(&|s| s.set_style(&[(1, 1.0)]).unwrap()));
    let without = styled(&|s| s.set_strength(legs, 0.0).unwrap());
    let mixed = styled(&|s| s.set_group_style(legs, &[(1, 1.0)]).unwrap());
    for t in 0..input.len() {
        for j in 1..21 {
            let leg = of("legs").contains(&j);
            let angle = gestus_core::math::quaternion::angle;
            if leg {
                assert!(angle(without[t].rotations[j], input[t].rotations[j]) < 1e-3, "frame {t} joint {j}");
            }
            let expected = if leg { &other } else { &whole };
            assert_eq!(mixed[t].rotations[j], expected[t].rotations[j], "frame {t} joint {j}");
        }
    }
    assert_ne!(whole[40].rotations[13], other[40].rotations[13], "the styles differ");
    // Masking a group reduces its influence on the search. The arms do not affect the root either, so masking them removes
    // their influence entirely.
    let distances = |joint: usize, mask: Option<u16>| {
        let mut moved = input.clone();
        for pose in &mut moved[20..] {
            pose.rotations[joint] = gestus_core::math::quaternion::exp([-0.9, 0.0, 0.0]);
        }
        [&input, &moved].map(|input| {
            let mut stylizer = Standard::new(database, config).unwrap();
            mask.into_iter().for_each(|group| stylizer.set_mask(group, false).unwrap());
            let mut output = Pose::IDENTITY;
            input.iter().map(|p| f64::from(stylizer.step(p, &mut output).distance2)).sum::<f64>()
        })
    };
    let [still, kicking] = distances(17, None);
    let [still_masked, kicking_masked] = distances(17, Some(legs));
    assert!(kicking > 3.0 * still, "{still} {kicking}");
    println!("a kick: {still} -> {kicking}, legs masked {still_masked} -> {kicking_masked}");
    assert!(kicking_masked - still_masked < 0.5 * (kicking - still), "{still_masked} {kicking_masked}");
    let [still, waving] = distances(10, Some(names.find("sword-arm").unwrap()));
    assert_eq!(still, waving);
}

#[test]
fn linear_models_refuse_the_style_of_a_group() {
    let mut stylizer = stylizer(Config::new().method(Method::Lti));
    assert_eq!(stylizer.set_group_style(1, &[(1, 1.0)]), Err(ConfigError::WholeBody));
    // After the group returns to the body's style, no error remains.
    assert_eq!(stylizer.set_group_style(1, &[]), Ok(()));
}
