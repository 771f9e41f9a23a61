use super::*;
use crate::synth;
use gestus_motion::corpus::Corpus;

fn clips() -> (Body, Clip, Clip) {
    let corpus = synth::corpus(&synth::Options::of(&["walk"], &["neutral", "proud"], 1, 4.0)).unwrap();
    let body = Body::of(&corpus).unwrap();
    let [source, reference] = [0, 1].map(|style| corpus.examples[style].clip.clone());
    (body, source, reference)
}

#[test]
fn the_result_has_the_references_statistics() {
    let (body, source, reference) = clips();
    let options = Options { rounds: 6, warp: false, clean_up: false, ..Options::default() };
    let out = transfer(&body, &source, &reference, &options).unwrap().clip;
    assert_eq!(out.frames.len(), source.frames.len());
    let (a, b) = (Turns::of(&body, &out), Turns::of(&body, &reference));
    for j in 0..body.skeleton.joints() {
        let (found, wanted) = (spread(&a.joint(j), &options), spread(&b.joint(j), &options));
        assert!(quaternion::angle(found.mean, wanted.mean) < 2e-3, "joint {j}: {found:?} {wanted:?}");
        let still = spread(&Turns::of(&body, &source).joint(j), &options).deviation < 0.01;
        assert!(
            still || (found.deviation / wanted.deviation - 1.0).abs() < 0.02,
            "joint {j}: {found:?} {wanted:?}"
        );
    }
    // Where it turns is the source's business.
    for (a, b) in out.frames.iter().zip(&source.frames) {
        assert!((body.heading(a) - body.heading(b)).abs() < 0.2);
    }
}

#[test]
fn a_clip_in_its_own_style_stays() {
    let (body, source, _) = clips();
    for euler in [false, true] {
        let options = Options { euler, clean_up: false, ..Options::default() };
        let out = transfer(&body, &source, &source, &options).unwrap().clip;
        for (a, b) in out.frames.iter().zip(&source.frames) {
            assert!((a.root - b.root).norm() < 0.01, "{euler}");
            for (p, q) in a.rotations.iter().zip(&b.rotations) {
                assert!(p.angle_to(q) < 0.01, "{euler}: {}", p.angle_to(q));
            }
        }
    }
}

/// A reference on a floor of its own took the result with it.
#[test]
fn the_result_stands_on_the_sources_floor() {
    let (body, source, reference) = clips();
    let plain = transfer(&body, &source, &reference, &Options::default()).unwrap();
    let out =
        transfer(&body, &raised(&source, -0.72), &raised(&reference, 0.4), &Options::default()).unwrap();
    assert!((out.floor_m + 0.72).abs() < 0.03, "{}", out.floor_m);
    for (a, b) in plain.clip.frames.iter().zip(&out.clip.frames) {
        assert!((a.root.y - 0.72 - b.root.y).abs() < 0.03, "{} {}", a.root.y, b.root.y);
    }
    let told = Options { floor_m: Some(-0.72), ..Options::default() };
    assert_eq!(transfer(&body, &raised(&source, -0.72), &reference, &told).unwrap().floor_m, -0.72);
}

/// Weighing frames by the warp is going through the warp and back.
#[test]
fn the_warp_cancels_but_for_its_weights() {
    let (body, source, reference) = clips();
    let short = Clip { frames: source.frames[..90].to_vec(), ..source };
    let go = |literal: bool| {
        let options = Options { literal, clean_up: false, ..Options::default() };
        transfer(&body, &short, &reference, &options).unwrap().clip
    };
    let mut most: f64 = 0.0;
    for (a, b) in go(false).frames.iter().zip(&go(true).frames) {
        most = a.angle_to(b).max(most);
    }
    assert!(most < 0.06, "{most} rad");
}

/// Clips of minutes took minutes. What corresponds in them is found among fewer frames.
#[test]
fn long_clips_correspond_as_short_ones_do() {
    let row = |x: f64| {
        let wave = |k: f64| (k * std::f64::consts::TAU * x + k).sin();
        [vec![0.9; dof::JOINTS], vec![wave(1.0), wave(2.0), wave(3.5)]].concat()
    };
    let rows = |count: usize, course: &dyn Fn(f64) -> f64| -> Vec<Vec<f64>> {
        (0..count).map(|t| row(course(t as f64 / (count - 1) as f64))).collect()
    };
    let course = |x: f64| x + 0.05 * (std::f64::consts::TAU * x).sin();
    for (own, other) in [(300, 400), (1500, 2000), (2000, 1500), (900, 2000)] {
        let (x, y) = (rows(own, &|x| x), rows(other, &course));
        let (own_at, other_at) = correspond(&x, &y).unwrap();
        assert_eq!([own_at.len(), other_at.len()], [own.max(other); 2]);
        let off = own_at
            .iter()
            .zip(&other_at)
            .map(|(a, b)| (a / (own - 1) as f64 - course(b / (other - 1) as f64)).abs());
        let off = off.sum::<f64>() / own_at.len() as f64;
        assert!(off < 0.01, "{own} and {other} frames: {off} of the clip off");
    }
    assert_eq!([warped(300, 400), warped(200, 400)], [[300, 400], [400, 400]]);
    assert_eq!([warped(1500, 2000), warped(900, 2000)], [[384, 512], [512, 512]]);
}

#[test]
fn lengths_may_be_far_apart() {
    let (body, source, reference) = clips();
    let short = Clip { frames: source.frames[..30].to_vec(), ..source.clone() };
    assert_eq!(transfer(&body, &short, &reference, &Options::default()).unwrap().clip.frames.len(), 30);
    assert_eq!(
        transfer(&body, &reference, &short, &Options::default()).unwrap().clip.frames.len(),
        reference.frames.len()
    );
    let one = Clip { frames: source.frames[..1].to_vec(), ..source.clone() };
    assert_eq!(transfer(&body, &one, &reference, &Options::default()).unwrap().clip.frames.len(), 1);
    let none = Clip { frames: vec![], ..source };
    assert!(transfer(&body, &none, &reference, &Options::default()).is_err());
}

/// The plants of a walk pulled the body of a run down to the floor, and a third of a metre on in a frame.
#[test]
fn a_walk_in_the_style_of_a_run_keeps_the_course_of_its_body() {
    let of = |action: &str, style: &str| synth::performance(3, action, style, 30.0, 6.0).unwrap().clip;
    let source = of("walk", "neutral");
    let body = Body::of(&Corpus::of_clip(&source)).unwrap();
    let go = |reference: &Clip, clean_up: bool| {
        transfer(&body, &source, reference, &Options { clean_up, ..Options::default() }).unwrap()
    };
    // One as fast as none of its plants is held, and a slower one.
    for (action, style) in [("run", "proud"), ("run", "neutral"), ("kick", "angry")] {
        let reference = of(action, style);
        let (raw, cleaned) = (go(&reference, false).clip.frames, go(&reference, true));
        let step = |frames: &[Frame]| {
            frames.windows(2).map(|pair| (pair[1].root - pair[0].root).norm()).fold(0.0, f64::max)
        };
        let (before, after) = (step(&raw), step(&cleaned.clip.frames));
        assert!(after < before + 0.022, "{action} {style}: steps of {after} m, {before} before");
        let lower = |(raw, cleaned): (&Frame, &Frame)| raw.root.y - cleaned.root.y;
        let lowest = raw.iter().zip(&cleaned.clip.frames).map(lower).fold(0.0, f64::max);
        assert!(lowest < 0.065, "{action} {style}: {lowest} m lower");
        let stands = |contacts: &[[bool; 2]]| contacts.iter().flatten().filter(|stands| **stands).count();
        assert!(cleaned.footplants.dropped > 0, "{action} {style}: {:?}", cleaned.footplants);
        assert!(stands(&cleaned.contacts) < stands(&contact::contacts(&source, &body.landmarks)));
    }
    // A walk has the plants of a walk.
    let walk = go(&of("walk", "old"), true);
    assert!(walk.footplants.all > 8 && walk.footplants.doubt().is_none(), "{:?}", walk.footplants);
}
