//! Assembles a blob from its sections, by the layout in `gestus_core::blob::layout`.

use gestus_core::blob::{
    Counts,
    crc::crc32c,
    layout::{ALIGNMENT, MAGIC, VERSION, entry, header},
};

/// A section's number and bytes.
pub type Section = (u16, Vec<u8>);

/// Assembles a blob: header, table of sections, aligned sections, checksums.
pub fn assemble(counts: &Counts, rate_hz: f64, sections: &[Section]) -> Vec<u8> {
    let table_end = header::LENGTH + sections.len() * entry::LENGTH;
    let mut bytes = vec![0; table_end];
    let mut table = Vec::new();
    for (id, content) in sections {
        bytes.resize(bytes.len().next_multiple_of(ALIGNMENT), 0);
        let mut record = [0; entry::LENGTH];
        record[entry::ID].copy_from_slice(&id.to_le_bytes());
        record[entry::OFFSET].copy_from_slice(&(bytes.len() as u32).to_le_bytes());
        record[entry::BYTES].copy_from_slice(&(content.len() as u32).to_le_bytes());
        record[entry::CRC].copy_from_slice(&crc32c(&[content]).to_le_bytes());
        table.extend(record);
        bytes.extend(content);
    }
    let total = bytes.len() as u32;
    let mut put16 = |range: std::ops::Range<usize>, value: usize| {
        bytes[range].copy_from_slice(&(value as u16).to_le_bytes());
    };
    put16(header::VERSION, usize::from(VERSION));
    put16(header::SECTIONS, sections.len());
    put16(header::JOINTS, counts.joints);
    put16(header::DOFS, counts.dofs);
    put16(header::FEATURES, counts.features);
    put16(header::WINDOW, counts.window);
    put16(header::STYLES, counts.styles);
    put16(header::ACTIONS, counts.actions);
    put16(header::CLASSES, counts.classes);
    put16(header::GROUPS, counts.groups);
    put16(header::BLOCK_ROWS, counts.block_rows);
    put16(header::TIMING, counts.timing);
    let mut put32 = |range: std::ops::Range<usize>, value: u32| {
        bytes[range].copy_from_slice(&value.to_le_bytes());
    };
    put32(header::TOTAL, total);
    put32(header::FRAMES, counts.frames as u32);
    put32(header::ROWS, counts.rows as u32);
    put32(header::CYCLES, counts.cycles as u32);
    put32(header::CLIPS, counts.clips as u32);
    put32(header::RATE, (rate_hz as f32).to_bits());
    bytes[header::MAGIC].copy_from_slice(&MAGIC);
    bytes[header::LENGTH..table_end].copy_from_slice(&table);
    let crc = crc32c(&[&bytes[..table_end]]);
    bytes[header::CRC].copy_from_slice(&crc.to_le_bytes());
    bytes
}

/// The blob with an optional section added or replaced.
///
/// # Errors
/// [`BlobError`](gestus_core::BlobError) if the blob or the new section is invalid.
pub fn with_section(blob: &[u8], id: u16, content: &[u8]) -> Result<Vec<u8>, gestus_core::BlobError> {
    let database = gestus_core::Database::open(blob)?;
    let mut sections: Vec<Section> = database
        .sections()
        .into_iter()
        .chain(database.optional_sections().filter(|s| s.0 != id))
        .map(|(id, bytes)| (id, bytes.to_vec()))
        .collect();
    sections.push((id, content.to_vec()));
    sections.sort_by_key(|s| s.0);
    let bytes = assemble(database.counts(), f64::from(database.rate_hz()), &sections);
    gestus_core::Database::open(&bytes)?;
    Ok(bytes)
}
