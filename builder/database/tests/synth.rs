//! Generated motion against what it promises: reproducible, feet that stand, knees that bend forwards, styles that
//! differ in more than posture, exact timelines.

use gestus_database::{
    build::{BuildOptions, build},
    registration::{contact::contacts, gait_cycles::gait_cycles},
    synth::{
        self, ACTIONS, BALL_HEIGHT_M, Options, STYLES, SynthError,
        affine::{self, pairs},
        joint,
    },
};
use gestus_motion::{clip::Frame, corpus::Example, landmarks::Landmarks};
use nalgebra::Vector3;

const RATE_HZ: f64 = 30.0;
const TOES: [usize; 2] = [joint::UPPER_LEG[0] + 3, joint::UPPER_LEG[1] + 3];

fn all() -> Vec<Example> {
    let mut examples = Vec::new();
    for action in ACTIONS {
        for style in STYLES {
            for clip in 0..3 {
                let seed = synth::content_seed(7, action, clip);
                examples.push(synth::performance(seed, action, style, RATE_HZ, 5.0).unwrap());
            }
        }
    }
    examples
}

fn positions(example: &Example) -> Vec<Vec<Vector3<f64>>> {
    example.clip.frames.iter().map(|f| f.positions(&example.clip.skeleton)).collect()
}

fn one(seed: u64, action: &str, style: &str) -> Example {
    synth::performance(seed, action, style, RATE_HZ, 8.0).unwrap()
}

#[test]
fn the_same_seed_gives_the_same_corpus_and_another_seed_another() {
    let options = Options::of(&["walk", "kick"], &["neutral", "old"], 2, 4.0);
    let frames = |options: &Options| -> Vec<Vec<Frame>> {
        synth::corpus(options).unwrap().examples.into_iter().map(|e| e.clip.frames).collect()
    };
    let first = frames(&options);
    assert_eq!(first, frames(&options));
    let other = frames(&Options { seed: 2, ..options });
    for (a, b) in first.iter().zip(&other) {
        assert_ne!(a, b);
    }
    // Clips of a class differ too.
    assert_ne!(first[0], first[1]);
}

#[test]
fn what_can_not_be_generated_is_said() {
    let unknown = synth::performance(1, "swim", "old", RATE_HZ, 5.0).unwrap_err();
    assert_eq!(unknown, SynthError::Action("swim".into()));
    let unknown = synth::performance(1, "walk", "happy", RATE_HZ, 5.0).unwrap_err();
    assert_eq!(unknown, SynthError::Style("happy".into()));
    for (rate_hz, seconds) in [(0.0, 5.0), (f64::NAN, 5.0), (30.0, f64::INFINITY), (30.0, -1.0)] {
        let error = synth::performance(1, "walk", "old", rate_hz, seconds).unwrap_err();
        assert!(matches!(error, SynthError::Range { .. }), "{rate_hz} {seconds}");
    }
    for options in [
        Options { actions: vec![], ..Options::default() },
        Options { styles: vec![], ..Options::default() },
        Options { clips: 0, ..Options::default() },
    ] {
        assert!(matches!(synth::corpus(&options), Err(SynthError::Nothing(_))));
    }
}

#[test]
fn planted_feet_do_not_slide_and_no_sole_is_below_the_floor() {
    for example in all() {
        let name = &example.clip.name;
        let positions = positions(&example);
        for (side, &toes) in TOES.iter().enumerate() {
            for t in 0..positions.len() {
                if example.contacts[t][side] {
                    assert!((positions[t][toes].y - BALL_HEIGHT_M).abs() < 1e-3, "{name}: {side} at {t}");
                    if t > 0 && example.contacts[t - 1][side] {
                        let slid = (positions[t][toes] - positions[t - 1][toes]).norm();
                        assert!(slid < 1e-3, "{name}: foot {side} slides {slid} m at {t}");
                    }
                }
                for point in synth::sole(&example.clip.frames[t], &example.clip.skeleton, side) {
                    assert!(point.y > -1e-3, "{name}: foot {side} is {} m low at {t}", -point.y);
                }
            }
        }
    }
}

#[test]
fn knees_and_elbows_bend_one_way() {
    for example in all() {
        let name = &example.clip.name;
        for (t, frame) in example.clip.frames.iter().enumerate() {
            for side in [0, 1] {
                let knee = frame.rotations[joint::UPPER_LEG[side] + 1].scaled_axis();
                assert!(
                    knee.x > 0.0 && knee.y.abs() + knee.z.abs() < 1e-6,
                    "{name}: knee {side} at {t}: {knee}"
                );
                let elbow = frame.rotations[joint::SHOULDER[side] + 2].scaled_axis();
                let bent = if side == 0 { -elbow.y } else { elbow.y };
                assert!((0.0..2.8).contains(&bent), "{name}: elbow {side} at {t}: {bent}");
            }
        }
    }
}

#[test]
fn joints_move_at_human_speeds() {
    for example in all() {
        let positions = positions(&example);
        for t in 1..positions.len() {
            for (j, (now, before)) in positions[t].iter().zip(&positions[t - 1]).enumerate() {
                let speed = (now - before).norm() * RATE_HZ;
                assert!(speed < 15.0, "{}: joint {j} at {t}: {speed} m/s", example.clip.name);
            }
        }
        for t in 1..example.clip.frames.len() {
            let (now, before) = (&example.clip.frames[t], &example.clip.frames[t - 1]);
            for (j, (a, b)) in now.rotations.iter().zip(&before.rotations).enumerate() {
                let speed = a.angle_to(b) * RATE_HZ;
                assert!(speed < 35.0, "{}: joint {j} at {t}: {speed} rad/s", example.clip.name);
            }
        }
    }
}

#[test]
fn timelines_are_whole_and_strikes_alternate() {
    for example in all() {
        let name = &example.clip.name;
        let last = (example.clip.frames.len() - 1) as f64;
        assert!(!example.cycles.is_empty(), "{name}");
        assert_eq!(example.contacts.len(), example.clip.frames.len());
        let mut before = f64::NEG_INFINITY;
        for cycle in &example.cycles {
            assert!(cycle.knots.windows(2).all(|w| w[0] < w[1]), "{name}: {:?}", cycle.knots);
            assert!(cycle.knots[0] >= before - 1e-9 && cycle.span().1 <= last + 1.0, "{name}");
            before = cycle.span().1;
        }
        let gait = ["walk", "run"].contains(&ACTIONS[example.action]);
        assert_eq!(gait, example.cycles.iter().all(|c| c.knots.len() == 3), "{name}");
        if !gait {
            continue;
        }
        // A foot comes down within a sixth of a cycle after its knot: it lands on its heel first.
        for cycle in &example.cycles {
            for (side, knot) in [(0, cycle.knots[0]), (1, cycle.knots[1])] {
                let sixth = (cycle.span().1 - cycle.span().0) / 6.0;
                let (down, up) = ((knot + sixth).ceil() as usize, (knot - 0.5).floor());
                assert!(example.contacts[down.min(last as usize)][side], "{name}: {side} at {knot}");
                assert!(up < 0.0 || !example.contacts[up as usize][side], "{name}: {side} at {knot}");
            }
        }
    }
}

#[test]
fn segmentation_finds_the_strikes_of_walks() {
    let landmarks = Landmarks::find(&synth::skeleton()).unwrap();
    for style in STYLES {
        let example = one(23, "walk", style);
        let found = gait_cycles(&example.clip, &landmarks);
        let errors: Vec<f64> = found
            .iter()
            .map(|f| {
                let nearest = example.cycles.iter().map(|c| (c.knots[0] - f.knots[0]).abs());
                nearest.fold(f64::INFINITY, f64::min)
            })
            .collect();
        assert!(found.len() + 2 >= example.cycles.len(), "{style}: {} found", found.len());
        let mean = errors.iter().sum::<f64>() / errors.len() as f64;
        // The feet are farthest apart about when the heel strikes: within a tenth of a second.
        assert!(mean < 3.0, "{style}: {mean} frames");
    }
}

#[test]
fn contacts_are_found_as_they_are() {
    let landmarks = Landmarks::find(&synth::skeleton()).unwrap();
    for action in ["walk", "run"] {
        for style in STYLES {
            let example = one(29, action, style);
            let found = contacts(&example.clip, &landmarks);
            let (mut hits, mut said, mut there) = (0.0, 0.0, 0.0);
            for (f, c) in found.iter().zip(&example.contacts) {
                for side in [0, 1] {
                    hits += f64::from(f[side] && c[side]);
                    said += f64::from(f[side]);
                    there += f64::from(c[side]);
                }
            }
            let score = 2.0 * hits / (said + there);
            assert!(score > 0.8, "{action} {style}: F1 {score}");
        }
    }
}

#[test]
fn runs_fly_and_walks_do_not() {
    let flight =
        |e: &Example| e.contacts.iter().filter(|c| !c[0] && !c[1]).count() as f64 / e.contacts.len() as f64;
    for style in STYLES {
        assert!(flight(&one(3, "run", style)) > 0.15, "{style}");
        assert!(flight(&one(3, "walk", style)) < 0.02, "{style}");
    }
    let jump = one(3, "jump", "neutral");
    assert!(flight(&jump) > 0.1);
    let heights: Vec<f64> = jump.clip.frames.iter().map(|f| f.root.y).collect();
    let highest = heights.iter().copied().fold(0.0, f64::max);
    assert!(highest > heights[0] + 0.1);
}

#[test]
fn arms_swing_against_the_legs() {
    for style in STYLES {
        let example = one(5, "walk", style);
        // Where hand and foot of one side are ahead of each other: their product is negative on average.
        let together: f64 = positions(&example)
            .iter()
            .zip(&example.clip.frames)
            .map(|(p, frame)| {
                let forwards = frame.rotations[0] * Vector3::z();
                let feet = (p[joint::UPPER_LEG[0] + 2] - p[joint::UPPER_LEG[1] + 2]).dot(&forwards);
                let hands = (p[joint::SHOULDER[0] + 3] - p[joint::SHOULDER[1] + 3]).dot(&forwards);
                feet * hands
            })
            .sum();
        assert!(together < 0.0, "{style}");
    }
}

/// Mean and spread of the upper body's angles, and seconds a cycle.
fn summary(style: &str) -> (Vec<f64>, f64, f64) {
    let example = one(11, "walk", style);
    let frames = &example.clip.frames;
    let count = frames.len() as f64;
    let angles: Vec<Vec<f64>> = frames
        .iter()
        .map(|f| {
            f.rotations[1..13]
                .iter()
                .flat_map(|q| q.scaled_axis().iter().copied().collect::<Vec<_>>())
                .collect()
        })
        .collect();
    let mean: Vec<f64> = (0..36).map(|d| angles.iter().map(|a| a[d]).sum::<f64>() / count).collect();
    let spread =
        angles.iter().map(|a| a.iter().zip(&mean).map(|(x, m)| (x - m).powi(2)).sum::<f64>()).sum::<f64>();
    let cycle = example.cycles.iter().map(|c| c.span().1 - c.span().0).sum::<f64>();
    (mean, (spread / count).sqrt(), cycle / example.cycles.len() as f64 / RATE_HZ)
}

#[test]
fn styles_differ_in_posture_amplitude_and_tempo() {
    let summaries: Vec<_> = STYLES.iter().map(|s| summary(s)).collect();
    let (_, amplitude, tempo) = summaries[0].clone();
    for (i, (mean, _, _)) in summaries.iter().enumerate() {
        for (other, _, _) in &summaries[..i] {
            let apart = mean.iter().zip(other).map(|(a, b)| (a - b).powi(2)).sum::<f64>().sqrt();
            assert!(apart > 0.15, "{}: {apart}", STYLES[i]);
        }
    }
    for (style, (_, a, t)) in STYLES.iter().zip(&summaries).skip(1) {
        assert!((a / amplitude - 1.0).abs() > 0.03, "{style}: amplitude {a} against {amplitude}");
        assert!((t / tempo - 1.0).abs() > 0.03, "{style}: {t} s against {tempo}");
    }
}

#[test]
fn cycles_differ_from_each_other_most_in_childlike() {
    let variation = |style: &str| {
        let example = one(13, "walk", style);
        let lengths: Vec<f64> = example.cycles.iter().map(|c| c.span().1 - c.span().0).collect();
        let mean = lengths.iter().sum::<f64>() / lengths.len() as f64;
        (lengths.iter().map(|l| (l - mean).powi(2)).sum::<f64>() / lengths.len() as f64).sqrt() / mean
    };
    for style in STYLES {
        assert!(variation(style) > 0.003, "{style}");
        assert!(style == "childlike" || variation(style) < variation("childlike"), "{style}");
    }
}

#[test]
fn one_content_has_the_same_cycles_in_every_style() {
    for action in ACTIONS {
        let counts = |style: &str| -> Vec<usize> {
            one(17, action, style).cycles.iter().map(|c| c.knots.len()).collect()
        };
        for style in STYLES {
            assert_eq!(counts("neutral"), counts(style), "{action} {style}");
        }
    }
}

#[test]
fn headings_start_along_z_and_the_left_is_at_x() {
    let example = one(19, "walk", "neutral");
    let start = example.cycles[0].knots[0].round() as usize;
    let positions = &positions(&example)[start];
    let hips = positions[joint::UPPER_LEG[0]] - positions[joint::UPPER_LEG[1]];
    assert!(hips.x > 0.17);
    let toes = positions[TOES[0]] - positions[TOES[0] - 1];
    assert!(toes.z > 0.1);
}

#[test]
fn a_generated_corpus_builds() {
    let options = Options::of(&["walk", "punch"], &["neutral", "angry", "old"], 2, 4.0);
    let corpus = synth::corpus(&options).unwrap();
    assert_eq!(corpus.examples.len(), 12);
    let built = build(&corpus, &BuildOptions::default()).unwrap();
    assert!(!built.bytes.is_empty());
    let pairs = pairs(&corpus, 0, &affine::Options::default()).unwrap();
    build(&pairs.corpus, &BuildOptions::default()).unwrap();
}

#[test]
fn affine_answers_are_exact() {
    let options = Options {
        actions: vec!["walk".into()],
        styles: vec!["neutral".into()],
        clips: 3,
        ..Options::default()
    };
    let corpus = synth::corpus(&options).unwrap();
    let made = pairs(&corpus, 0, &affine::Options::default()).unwrap();
    let count = made.answers.len();
    assert_eq!((count, made.corpus.examples.len()), (3, 6));
    for (i, answer) in made.answers.iter().enumerate() {
        let (input, output) = (&made.corpus.examples[i], &made.corpus.examples[count + i]);
        assert_eq!(answer.frames.len(), input.clip.frames.len());
        assert!(answer.positions.windows(2).all(|w| w[1] > w[0]));
        // The answers are the map of the inputs, and their dofs read back are what was put in.
        let x = made.body.clip_dofs(&input.clip);
        let clip = gestus_motion::clip::Clip { frames: answer.frames.clone(), ..input.clip.clone() };
        let y = made.body.clip_dofs(&clip);
        for (x, y) in x.iter().zip(&y).skip(1) {
            for (d, (a, b)) in made.map.apply(x).iter().zip(y).enumerate() {
                assert!((a - b).abs() < 0.02, "dof {d}: {a} {b}");
            }
        }
        // The output clip passes through them, when it should.
        let last = (output.clip.frames.len() - 1) as f64;
        for (frame, &position) in answer.frames.iter().zip(&answer.positions).filter(|p| *p.1 <= last) {
            let shown = output.clip.at(position).positions(&output.clip.skeleton);
            for (a, b) in shown.iter().zip(frame.positions(&output.clip.skeleton)) {
                assert!((a - b).norm() < 0.03);
            }
        }
        // And cycles say the same as the warp, to a tenth of a frame.
        for (a, b) in input.cycles.iter().zip(&output.cycles) {
            for k in 1..10 {
                let phase = f64::from(k) / 10.0;
                let at = a.position(phase);
                let (j, t) = (at.floor() as usize, at.fract());
                let truth = answer.positions[j] + t * (answer.positions[j + 1] - answer.positions[j]);
                assert!((b.position(phase) - truth).abs() < 0.1);
            }
        }
    }
}
