//! Any bytes as a blob: `open` refuses them or takes them, and what it takes can be stepped through without a panic.
//!
//! Mutated bytes fail at the first checksum, so they are opened twice: as they are, and with the checksums (and the
//! length, in the header) made to agree. What lies behind the blob's stated length are settings and poses.
#![no_main]

use gestus_core::{Config, Database, Effort, Method, Pose, Stylizer};
use gestus_core_fuzz::{JOINTS, pose, sealed};
use libfuzzer_sys::fuzz_target;

fuzz_target!(|bytes: &[u8]| {
    let _ = Database::open(bytes);
    let (blob, rest) = sealed(bytes);
    if let Ok(database) = Database::open(&blob) {
        drive(database, rest);
    }
});

/// Settings and a few steps, from whatever bytes there are.
fn drive(database: Database<'_>, bytes: &[u8]) {
    let counts = *database.counts();
    let names = database.manifest().expect("open has decoded it");
    assert_eq!(names.styles.count(), counts.styles);
    for method in Method::ALL {
        drive_by(database, Config::new().method(method), bytes);
    }
}

fn drive_by(database: Database<'_>, config: Config, bytes: &[u8]) {
    let counts = *database.counts();
    let Ok(mut stylizer) = Stylizer::<JOINTS, 40, 64>::new(database, config) else { return };
    let mut bytes = bytes.iter().copied().cycle();
    let mut byte = || bytes.next().unwrap_or(0x3c);
    // Settings may be refused; then those before them stay.
    let _ = stylizer.set_style(&[(u16::from(byte()), 1.0), (u16::from(byte()), f32::from(byte()))]);
    let target = [byte(), byte(), byte()].map(|b| f32::from(b as i8) / 16.0);
    if let Ok(reached) = stylizer.set_effort(Effort::new(target)) {
        assert!(reached.effort.factors().iter().all(|f| f.is_finite()), "{target:?}: {reached:?}");
        assert!((stylizer.style().iter().sum::<f32>() - 1.0).abs() < 1e-3);
    }
    let _ = stylizer.set_action((byte() & 1 == 1).then(|| u16::from(byte())));
    let _ = stylizer.set_input_style((byte() & 1 == 1).then(|| u16::from(byte())));
    let _ = stylizer.set_mask(u16::from(byte() & 7), false);
    let _ = stylizer.set_strength(u16::from(byte() & 7), f32::from(byte()) / 100.0);
    let mut output = Pose::IDENTITY;
    for step in 0..6 {
        let input = pose(step, &mut byte);
        let report = stylizer.step(&input, &mut output);
        assert!(output.is_valid(counts.joints), "step {step}: {report:?}");
        assert!(report.step_s.is_finite() && report.step_s >= 0.0, "step {step}: {report:?}");
        let shares: f32 = report.classes.iter().map(|c| c.proportion).sum();
        assert!(shares <= 1.001, "step {step}: {report:?}");
    }
}
