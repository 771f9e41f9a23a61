//! Changes to a blob's bytes, with checksums repaired behind them: what a fault of a builder, or an attacker, would
//! write.

use std::ops::Range;

use gestus_core::{
    Database,
    blob::{
        crc::crc32c,
        layout::{entry, header},
        read::{u16_at, u32_at},
    },
};
use gestus_database::blob::assemble::{Section, assemble};

/// Where the entry of the section table for that section is.
///
/// # Panics
/// Where the blob has no such section.
pub fn entry_of(blob: &[u8], section: u16) -> usize {
    (0..usize::from(u16_at(blob, header::SECTIONS.start)))
        .map(|i| header::LENGTH + i * entry::LENGTH)
        .find(|&at| u16_at(blob, at + entry::ID.start) == section)
        .expect("the blob has the section")
}

/// Where the bytes of that section are.
pub fn section(blob: &[u8], section: u16) -> Range<usize> {
    let at = entry_of(blob, section);
    let start = u32_at(blob, at + entry::OFFSET.start) as usize;
    start..start + u32_at(blob, at + entry::BYTES.start) as usize
}

/// Makes every checksum agree that can be made to agree: those of sections that lie within the bytes, and the header's.
pub fn repair(blob: &mut [u8]) {
    if blob.len() < header::LENGTH {
        return;
    }
    let count = usize::from(u16_at(blob, header::SECTIONS.start));
    let table_end = (header::LENGTH + count * entry::LENGTH).min(blob.len());
    for at in (header::LENGTH..table_end).step_by(entry::LENGTH) {
        let start = u32_at(blob, at + entry::OFFSET.start) as usize;
        let length = u32_at(blob, at + entry::BYTES.start) as usize;
        let Some(content) = blob.get(start..start.saturating_add(length)) else { continue };
        let crc = crc32c(&[content]).to_le_bytes();
        if let Some(slot) = blob.get_mut(at + entry::CRC.start..at + entry::CRC.end) {
            slot.copy_from_slice(&crc);
        }
    }
    let crc = crc32c(&[&blob[..header::CRC.start], &[0; 4], &blob[header::CRC.end..table_end]]);
    blob[header::CRC].copy_from_slice(&crc.to_le_bytes());
}

/// A blob with `value` written at byte `at` of a section, checksums repaired.
pub fn patched(blob: &[u8], id: u16, at: usize, value: &[u8]) -> Vec<u8> {
    let start = section(blob, id).start + at;
    put(blob, start, value)
}

/// A blob with `value` written at byte `at`, checksums repaired.
pub fn put(blob: &[u8], at: usize, value: &[u8]) -> Vec<u8> {
    let mut blob = blob.to_vec();
    blob[at..at + value.len()].copy_from_slice(value);
    repair(&mut blob);
    blob
}

/// A blob with other bytes in a section, of any length.
///
/// # Panics
/// Where `blob` does not open.
pub fn with_section(blob: &[u8], id: u16, change: impl FnOnce(&mut Vec<u8>)) -> Vec<u8> {
    let database = Database::open(blob).expect("the blob to change is whole");
    let all = database.sections().into_iter().chain(database.optional_sections());
    let mut sections: Vec<Section> = all.map(|(i, b)| (i, b.to_vec())).collect();
    let wanted = sections.iter_mut().find(|s| s.0 == id).expect("the blob has the section");
    change(&mut wanted.1);
    assemble(database.counts(), f64::from(database.rate_hz()), &sections)
}
