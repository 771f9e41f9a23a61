//! Any bytes as a blob: `open` refuses them or takes them, and what it takes can be stepped through without a panic.
//!
//! Mutated bytes fail at the first checksum, so they are opened twice: as they are, and with the checksums (and the
//! length, in the header) made to agree. What lies behind the blob's stated length are settings and poses.
#![no_main]

use gestus_core::{
    Config, Database, Effort, Method, Pose, Stylizer,
    blob::{
        crc::crc32c,
        layout::{entry, header},
        read::{u16_at, u32_at},
    },
};
use libfuzzer_sys::fuzz_target;

const JOINTS: usize = 64;

fuzz_target!(|bytes: &[u8]| {
    let _ = Database::open(bytes);
    let total = u32_at(bytes, header::TOTAL.start) as usize;
    let (blob, rest) = bytes.split_at(total.min(bytes.len()));
    let mut blob = blob.to_vec();
    seal(&mut blob);
    if let Ok(database) = Database::open(&blob) {
        drive(database, rest);
    }
});

/// Makes length and checksums agree with the bytes.
fn seal(blob: &mut [u8]) {
    let table_end = header::LENGTH + usize::from(u16_at(blob, header::SECTIONS.start)) * entry::LENGTH;
    if blob.len() < table_end {
        return;
    }
    let total = blob.len() as u32;
    blob[header::TOTAL].copy_from_slice(&total.to_le_bytes());
    for at in (header::LENGTH..table_end).step_by(entry::LENGTH) {
        let (start, length) = (u32_at(blob, at + entry::OFFSET.start), u32_at(blob, at + entry::BYTES.start));
        let end = (start as usize).saturating_add(length as usize);
        if let Some(content) = blob.get(start as usize..end) {
            let crc = crc32c(&[content]);
            blob[at + entry::CRC.start..at + entry::CRC.end].copy_from_slice(&crc.to_le_bytes());
        }
    }
    blob[header::CRC].fill(0);
    let crc = crc32c(&[&blob[..table_end]]);
    blob[header::CRC].copy_from_slice(&crc.to_le_bytes());
}

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

/// A pose near to one that a body could hold, or no pose at all, once in a while.
fn pose(step: usize, byte: &mut impl FnMut() -> u8) -> Pose<JOINTS> {
    let mut small = || f32::from(byte() as i8) / 128.0;
    let mut pose = Pose::IDENTITY;
    pose.position = [small(), 0.9 + 0.1 * small(), small() + 0.03 * step as f32];
    for rotation in &mut pose.rotations {
        let [x, y, z] = [small(), small(), small()].map(|v| v * 0.7);
        let w = (1.0 - (x * x + y * y + z * z)).abs().sqrt();
        let length = (x * x + y * y + z * z + w * w).sqrt();
        *rotation = [x, y, z, w].map(|v| v / length);
    }
    if byte() == 0xff {
        pose.rotations[1][0] = f32::NAN;
    }
    pose
}
