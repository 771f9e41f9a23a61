//! Golden digests: the same blob and the same input give the same bits in debug and in release, with and without an
//! observer, with every capacity, and in every later version that does not change them on purpose.
//!
//! `golden/blob-v2.gestus` is a small generated database as the first builder made it, with the query section of format
//! version 2, and `blob-v2-legs.gestus` the same with the section that came later: legs, whose feet are held;
//! `blob-v2-outputs.gestus` has two outputs a cycle as well. They are kept, not rebuilt: the builder may change, and
//! old blobs have to open. The input is computed with the core's own sine, which has the same bits everywhere.
//!
//! `GESTUS_RECORD=1 cargo test -p gestus-tests --test golden` records the digests anew, `GESTUS_RECORD=blob` the
//! last blob too.

use std::{fs, path::PathBuf};

use gestus_core::{
    Config, Database, Digest, Method, Observer, Pose, Stylizer,
    config::{Ridge, Timing},
    math::{
        quaternion::{self, exp},
        sin_cos,
    },
    search::found::Found,
};
use gestus_tests::motion::{self, Size};

/// Too small for a graph in any class, and small enough for the repository.
const KEPT: Size = Size { actions: 2, styles: 3, takes: 1, frames: 100 };
/// Frames of the stream.
const FRAMES: usize = 900;

fn golden(name: &str) -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("golden").join(name)
}

fn record() -> Option<String> {
    std::env::var("GESTUS_RECORD").ok()
}

/// The first blob.
fn first() -> Vec<u8> {
    fs::read(golden("blob-v2.gestus")).unwrap()
}

/// The blob with legs.
fn with_legs() -> Vec<u8> {
    fs::read(golden("blob-v2-legs.gestus")).unwrap()
}

/// The blob with two outputs a cycle.
fn with_outputs() -> Vec<u8> {
    let path = golden("blob-v2-outputs.gestus");
    if record().as_deref() == Some("blob") {
        fs::write(&path, motion::blob(KEPT)).unwrap();
    }
    fs::read(&path).unwrap()
}

/// A walk in f32 by the core's own arithmetic. It turns, changes its stride, and jumps once.
fn input<const J: usize>(t: usize) -> Pose<J> {
    let jumped = t >= 500;
    let time = t as f32 / 30.0;
    let phase = time * if jumped { 5.3 } else { 6.1 };
    let heading = 0.3 * time;
    let wave = |lead: f32| sin_cos(phase + lead).0;
    let mut pose = Pose::IDENTITY;
    let (s, c) = sin_cos(heading);
    pose.position = [-4.0 * c + if jumped { 3.0 } else { 0.0 }, 0.87 + 0.02 * wave(1.0) * wave(2.0), 4.0 * s];
    pose.rotations[0] =
        quaternion::multiply(quaternion::about_y(heading), exp([0.05, 0.05 * wave(0.3), 0.03 * wave(1.1)]));
    for (j, rotation) in pose.rotations.iter_mut().enumerate().take(21).skip(1) {
        let lead = 0.7 * j as f32;
        let left = if j < 9 || (13..17).contains(&j) { 1.0 } else { -1.0 };
        let swing = if j >= 13 { 0.4 } else { 0.15 } * if jumped { 1.3 } else { 1.0 };
        let down = if j == 6 || j == 10 { -1.1 * left } else { 0.0 };
        let bend = if j == 14 || j == 18 { 0.3 } else { 0.0 };
        *rotation =
            exp([swing * left * wave(lead) + bend, 0.05 * wave(2.0 * lead), down + 0.03 * wave(lead + 1.0)]);
    }
    // Not exactly of unit length, as from a sensor.
    pose.rotations[4] = pose.rotations[4].map(|v| v * 1.0001);
    pose
}

/// Observes everything and changes nothing.
#[derive(Default)]
struct Looks(u64);

impl<const J: usize> Observer<J> for Looks {
    fn query(&mut self, feature: &[f32; 32]) {
        self.0 ^= u64::from(feature[0].to_bits());
    }
    fn searched(&mut self, class: usize, found: &Found<'_>) {
        self.0 = self.0.wrapping_add((class * found.rows().len()) as u64);
    }
    fn timed(&mut self, _: usize, rows: &[u16], weights: &[f32]) {
        self.0 = self.0.wrapping_add((rows.len() + weights.len()) as u64);
    }
    fn predicted(&mut self, x: &[[f32; 4]; J], _: &[[f32; 4]; J], _: &[[f32; 4]; J], y: &[[f32; 4]; J]) {
        self.0 ^= u64::from((x[1][0] + y[2][0]).to_bits());
    }
}

/// Digest of the stream; styles and labels change during it.
fn digest<const J: usize, const K: usize, const C: usize>(blob: &[u8], config: Config, look: bool) -> u32 {
    let database = Database::open(blob).unwrap();
    let mut stylizer = Box::new(Stylizer::<J, K, C>::new(database, config).unwrap());
    let mut looks = Looks::default();
    let (mut digest, mut output) = (Digest::new(), Pose::IDENTITY);
    let mut held = false;
    for t in 0..FRAMES {
        match t {
            0 => stylizer.set_style(&[(1, 1.0)]).unwrap(),
            150 => stylizer.set_style(&[(0, 0.2), (1, 0.5), (2, 0.3)]).unwrap(),
            250 => stylizer.set_action(Some(0)).unwrap(),
            320 => stylizer.set_input_style(Some(0)).unwrap(),
            400 => {
                stylizer.set_action(None).unwrap();
                stylizer.set_strength(0, 0.7).unwrap();
                stylizer.set_mask(2, false).unwrap();
            }
            450 => stylizer.set_input_style(None).unwrap(),
            600 => {
                stylizer.set_style(&[(2, 1.0)]).unwrap();
                stylizer.set_strength(0, 1.0).unwrap();
                stylizer.set_mask(2, true).unwrap();
            }
            700 => stylizer.reset(),
            _ => {}
        }
        let mut pose = input::<J>(t);
        if t % 97 == 96 {
            pose.position[1] = f32::NAN;
        }
        let report = if look {
            stylizer.step_observed(&pose, &mut output, &mut looks)
        } else {
            stylizer.step(&pose, &mut output)
        };
        digest.add(&output, database.counts().joints, report.step_s);
        held |= report.held != [false; 2];
        for share in &report.classes {
            assert!(share.proportion > 0.0);
        }
    }
    assert_eq!(look, looks.0 != 0);
    assert_eq!(held, database.legs().is_some(), "feet are held where there are legs");
    digest.value()
}

#[test]
fn digests_are_as_recorded() {
    let (first, with_legs, with_outputs) = (first(), with_legs(), with_outputs());
    let cases = [
        ("default", Config::new()),
        ("paper", Config::paper()),
        ("normalised", Config::new().ridge(Ridge::Normalised).lambda(1.0)),
        ("sync", Config::new().timing(Timing::Sync).k(16)),
        ("lti", Config::new().method(Method::Lti)),
        ("lti-trusting", Config::new().method(Method::Lti).confidence(1e6).timing(Timing::Sync)),
        ("statistic", Config::new().method(Method::Statistic)),
        ("statistic-running", Config::new().method(Method::Statistic).halflife_s(1.5)),
    ];
    let legs = [
        ("legs", Config::new()),
        ("legs-stepping", Config::new().release_m(0.02).speed_limit(0.0)),
        ("legs-lti", Config::new().method(Method::Lti)),
        ("legs-statistic", Config::new().method(Method::Statistic)),
    ];
    let mut found = String::new();
    let outputs = [("outputs", Config::new()), ("outputs-few", Config::new().k(5).delta(0.7))];
    let of = |blob, cases: &[(&'static str, Config)]| cases.iter().map(|&(n, c)| (n, c, blob)).collect();
    let all: [Vec<_>; 3] = [of(&first, &cases), of(&with_legs, &legs), of(&with_outputs, &outputs)];
    for (name, config, blob) in all.into_iter().flatten() {
        let small = digest::<22, 40, 28>(blob, config, false);
        assert_eq!(small, digest::<22, 40, 28>(blob, config, true), "{name}: looked into");
        assert_eq!(small, digest::<64, 64, 256>(blob, config, false), "{name}: larger capacities");
        assert_eq!(small, digest::<21, 40, 6>(blob, config, true), "{name}: least capacities");
        found += &format!("{name} {small:08x}\n");
    }
    let path = golden("stream.txt");
    if record().is_some() {
        fs::write(&path, &found).unwrap();
    }
    let recorded = fs::read_to_string(&path).unwrap_or_default();
    assert_eq!(found, recorded, "record anew with GESTUS_RECORD=1 where the change is meant");
}

/// Every stored blob opens, and its contents are as expected.
#[test]
fn kept_blobs_open() {
    for (blob, legs, outputs) in [(first(), false, 1), (with_legs(), true, 1), (with_outputs(), true, 2)] {
        let database = Database::open(&blob).unwrap();
        let manifest = database.manifest().unwrap();
        assert_eq!(manifest.styles.iter().collect::<Vec<_>>(), motion::STYLES);
        assert_eq!(manifest.actions.iter().collect::<Vec<_>>(), motion::ACTIONS);
        assert_eq!(database.counts().frames, 600);
        assert_eq!((database.legs().is_some(), database.outputs()), (legs, outputs));
    }
}
