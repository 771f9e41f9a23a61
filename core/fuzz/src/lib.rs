//! What the targets share: blobs whose checksums agree, poses, and files that are given.

use gestus_core::{
    Pose,
    blob::{
        crc::crc32c,
        layout::{entry, header},
        read::{u16_at, u32_at},
    },
};

/// Joints of the poses.
pub const JOINTS: usize = 64;

/// The bytes of the file that an environment variable names.
///
/// # Panics
/// Where there is none: `cargo xtask fuzz` makes the files.
pub fn named(variable: &str) -> Vec<u8> {
    let file = std::env::var_os(variable)
        .unwrap_or_else(|| panic!("{variable} names no file: run `cargo xtask fuzz TARGET`"));
    std::fs::read(&file).unwrap_or_else(|e| panic!("{}: {e}", file.display()))
}

/// The blob that the bytes start with, its length and checksums made to agree with it, and the bytes behind it.
///
/// Mutated bytes would fail at the first checksum.
pub fn sealed(bytes: &[u8]) -> (Vec<u8>, &[u8]) {
    let total = u32_at(bytes, header::TOTAL.start) as usize;
    let (blob, rest) = bytes.split_at(total.min(bytes.len()));
    let mut blob = blob.to_vec();
    seal(&mut blob);
    (blob, rest)
}

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

/// A pose near to one that a body could hold, or no pose at all, once in a while.
pub fn pose(step: usize, byte: &mut impl FnMut() -> u8) -> Pose<JOINTS> {
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
