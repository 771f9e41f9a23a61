//! A loop whose input fails while feet are held, with every policy and every fault: nothing jumps, and feet stand again.

use std::sync::OnceLock;

use gestus_core::{BLEND_BACK_S, Config, Database, Degraded, Pose, Report, Safety, Stylizer, blob::Leg};
use gestus_database::stream::{from_pose, to_pose};
use gestus_evaluate::metrics::{feet::skate_cm_s, performance::Performance};
use gestus_motion::clip::Clip;
use gestus_tests::motion;

type Standard<'db> = Stylizer<'db, 22, 40, 28>;
type Outputs = Vec<(Pose<22>, Report)>;

/// Frames with the fault.
const FAULT: std::ops::Range<usize> = 90..102;

/// A generated walker whose feet do not slide: a database, and a clip that is not in it.
fn walker() -> &'static (Vec<u8>, Clip) {
    static WALKER: OnceLock<(Vec<u8>, Clip)> = OnceLock::new();
    WALKER.get_or_init(|| motion::walker(&["neutral", "old"], 8.0))
}

fn run(safety: Safety, arrives: impl Fn(usize, Pose<22>) -> Option<(Pose<22>, u32)>) -> Outputs {
    let database = Database::open(&walker().0).unwrap();
    let old = database.manifest().unwrap().styles.find("old").unwrap();
    let mut stylizer = Standard::new(database, Config::new().safety(safety)).unwrap();
    stylizer.set_style(&[(old, 1.0)]).unwrap();
    let mut output = Pose::IDENTITY;
    let poses = walker().1.frames.iter().map(to_pose);
    poses
        .enumerate()
        .map(|(t, pose)| {
            let input = arrives(t, pose);
            let report = stylizer.tick(input.as_ref().map(|(p, n)| (p, *n)), &mut output);
            (output, report)
        })
        .collect()
}

/// Fastest turn of a joint, rad a frame, and motion of the root on the ground and upwards, metres a frame.
fn fastest(outputs: &[(Pose<22>, Report)]) -> [f64; 3] {
    outputs.windows(2).fold([0.0; 3], |most: [f64; 3], w| {
        let (a, b) = (from_pose(&w[0].0, 21), from_pose(&w[1].0, 21));
        let turned = a.rotations.iter().zip(&b.rotations).map(|(p, q)| p.angle_to(q)).fold(0.0, f64::max);
        let way = b.root - a.root;
        [most[0].max(turned), most[1].max(way.x.hypot(way.z)), most[2].max(way.y.abs())]
    })
}

fn skate(legs: &[Leg; 2], outputs: &[(Pose<22>, Report)]) -> f64 {
    let performance = Performance {
        frames: outputs.iter().map(|o| from_pose(&o.0, 21)).collect(),
        steps_s: outputs.iter().map(|o| f64::from(o.1.step_s)).collect(),
        stands: outputs.iter().map(|o| o.1.contacts).collect(),
    };
    skate_cm_s(&walker().1.skeleton, legs, &performance)
}

#[test]
fn every_fault_under_every_policy_is_reported_and_causes_no_jump_while_feet_are_held() {
    type Arrives = fn(usize, Pose<22>) -> Option<(Pose<22>, u32)>;
    let faults: [(&str, Degraded, Arrives); 4] = [
        ("stale", Degraded::STALE, |t, p| (!FAULT.contains(&t)).then_some((p, t as u32))),
        ("out of order", Degraded::ORDER, |t, p| {
            Some((p, if FAULT.contains(&t) { FAULT.start as u32 - 9 } else { t as u32 }))
        }),
        ("NaN", Degraded::INPUT, |t, mut p| {
            if FAULT.contains(&t) {
                p.rotations[7] = [f32::NAN; 4];
            }
            Some((p, t as u32))
        }),
        ("jumping", Degraded::LEAP, |t, mut p| {
            if (FAULT.start..FAULT.start + 4).contains(&t) {
                p.position[2] += 3.0;
                p.rotations[6] = [0.0, 0.0, 1.0, 0.0];
            }
            Some((p, t as u32))
        }),
    ];
    let database = Database::open(&walker().0).unwrap();
    let legs = database.legs().unwrap();
    let whole = run(Safety::Follow, |t, p| Some((p, t as u32)));
    let held = |outputs: &[(Pose<22>, Report)]| outputs.iter().filter(|o| o.1.held.contains(&true)).count();
    assert!(held(&whole[60..90]) > 20, "feet are held before the fault");
    let calm = fastest(&whole);
    for (name, flag, arrives) in faults {
        for safety in Safety::ALL {
            let outputs = run(safety, arrives);
            let said: Vec<usize> =
                (0..outputs.len()).filter(|&t| outputs[t].1.degraded.contains(flag)).collect();
            // The policy `follow` takes a leap up at once, there and back.
            let follows = flag == Degraded::LEAP && safety == Safety::Follow;
            let wanted = match flag {
                Degraded::LEAP => FAULT.start..FAULT.start + 4,
                _ => FAULT,
            };
            let leaps = vec![FAULT.start, FAULT.start + 4];
            let reported = if follows { leaps } else { wanted.clone().collect() };
            let wanted = if follows { 0..0 } else { wanted };
            assert_eq!(said, reported, "{name}, {safety:?}");
            assert!(outputs.iter().all(|o| o.0.is_valid(21)), "{name}, {safety:?}");
            for t in wanted {
                let (before, now) = (&outputs[t - 1].0, &outputs[t].0);
                match safety {
                    Safety::Rest => assert_ne!(before, now, "{name}: eased to rest, frame {t}"),
                    _ => assert_eq!(before, now, "{name}, {safety:?}: held, frame {t}"),
                }
            }
            let most = fastest(&outputs);
            println!("{name}, {safety:?}: {most:.3?} against {calm:.3?} without a fault");
            if safety != Safety::Follow {
                // Joints catch up within `BLEND_BACK_S`; the root continues from where it stopped.
                let missed = if flag == Degraded::LEAP { 4 } else { FAULT.len() } as f64 / 30.0;
                let times = [1.0 + missed / f64::from(BLEND_BACK_S), 1.25, 1.25];
                for ((found, calm), times) in most.into_iter().zip(calm).zip(times) {
                    assert!(found < times * calm + 0.005, "{name}, {safety:?}: {most:?} against {calm:?}");
                }
            }
            // A second after the fault, feet are locked again and do not slide.
            let after = &outputs[FAULT.end + 30..];
            assert!(held(after) > after.len() / 2, "{name}, {safety:?}: {} of {}", held(after), after.len());
            let slid = skate(&legs, after);
            assert!(slid <= 1.0, "{name}, {safety:?}: {slid} cm/s");
        }
    }
}
