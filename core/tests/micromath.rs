//! The feature `micromath`, for boards without an FPU: how far its sine is off, and a digest of its own, since its
//! bits are others. `cargo test -p gestus-core --features micromath`; without the feature there is nothing to test.
//! `cargo xtask golden` records the digest anew.
#![cfg(feature = "micromath")]

use std::{env, fs};

use gestus_core::{
    Config, Database, Digest, Pose, Stylizer,
    math::{quaternion::exp, sin_cos},
};

/// The kept database of the golden tests.
const BLOB: &[u8] = include_bytes!("../../tests/golden/blob-v2-legs.gestus");
/// Digest of [`stream`].
const RECORDED: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../tests/golden/micromath.txt");

#[test]
fn sine_and_cosine_are_off_by_a_thousandth_at_most() {
    let mut worst = 0.0_f64;
    for i in -100_000..=100_000 {
        let x = i as f32 * 1e-4;
        let (s, c) = sin_cos(x);
        let x = f64::from(x);
        worst = worst.max((f64::from(s) - libm::sin(x)).abs()).max((f64::from(c) - libm::cos(x)).abs());
    }
    assert!((5e-4..1.2e-3).contains(&worst), "worst error {worst}");
}

#[test]
fn stray_values_do_no_harm() {
    for x in [f32::NAN, f32::INFINITY, 1e9] {
        assert_eq!(sin_cos(x), (0.0, 1.0));
    }
}

/// A walk on the spot whose angles are sums and products of whole numbers, so that no sine makes the input.
fn pose(t: u16) -> Pose<22> {
    // A triangle wave of 24 frames, -1 to 1.
    let wave = |lead: u16| (f32::from((t + lead) % 24) - 12.0).abs() / 6.0 - 1.0;
    let mut pose = Pose::IDENTITY;
    pose.position = [0.0, 0.88, 0.0];
    for (j, rotation) in (0u16..).zip(&mut pose.rotations).take(21).skip(1) {
        let swing = if j >= 13 { 0.4 } else { 0.15 };
        let down = if j == 6 { -1.1 } else { f32::from(u8::from(j == 10)) * 1.1 };
        *rotation = exp([swing * wave(3 * j), 0.04 * wave(5 * j), down]);
    }
    pose
}

fn stream() -> u32 {
    let database = Database::open(BLOB).unwrap();
    let mut stylizer = Stylizer::<22, 40, 8>::new(database, Config::new()).unwrap();
    stylizer.set_style(&[(1, 0.75), (2, 0.25)]).unwrap();
    let (mut digest, mut output) = (Digest::new(), Pose::IDENTITY);
    for t in 0..300 {
        let report = stylizer.step(&pose(t), &mut output);
        digest.add(&output, database.counts().joints, report.step_s);
        // Rotations stay rotations: what the sine lacks, the normalisation makes up for.
        for q in output.rotations.iter().take(21) {
            let length2: f32 = q.iter().map(|v| v * v).sum();
            assert!((length2 - 1.0).abs() < 1e-5, "frame {t}: {q:?}");
        }
    }
    digest.value()
}

#[test]
fn the_digest_is_as_recorded() {
    let found = format!("300 frames, digest {:08x}\n", stream());
    if env::var_os("GESTUS_RECORD").is_some() {
        fs::write(RECORDED, &found).unwrap();
    }
    assert_eq!(found, fs::read_to_string(RECORDED).unwrap_or_default());
}
