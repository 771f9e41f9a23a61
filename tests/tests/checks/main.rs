//! Every check of `Database::open`, one case each: a blob with one thing wrong, checksums repaired behind it, and the
//! error that has to come.

use std::ops::Range;

use gestus_core::{
    BlobError, Database,
    blob::{
        layout::{
            ALIGNMENT, NONE, VERSION, block, class, clip, cycle, dof_range, dof_record, effort, entry, flag,
            foot, header, joint, query, section, timing,
        },
        read::{f32_at, u16_at, u32_at},
    },
};
use gestus_tests::{
    motion,
    patch::{self, entry_of, patched, put, with_section},
};

mod frames;
mod head;
mod skeleton;

fn blob() -> &'static [u8] {
    motion::tiny()
}

fn database() -> Database<'static> {
    Database::open(blob()).unwrap()
}

/// The bytes of a section.
fn bytes(id: u16) -> &'static [u8] {
    &blob()[patch::section(blob(), id)]
}

fn refuses(name: &str, blob: &[u8], error: BlobError) {
    assert_eq!(Database::open(blob).err(), Some(error), "{name}");
    // Whatever is refused is refused in words that say what to do.
    assert!(error.to_string().contains(": "), "{error}");
}

fn value(section: u16, record: usize) -> BlobError {
    BlobError::Value { section, record: record as u32 }
}

/// Refuses `value` at byte `at` of a section, as the value of that record.
fn refuses_value(name: &str, id: u16, at: usize, written: &[u8], record: usize) {
    refuses(name, &patched(blob(), id, at, written), value(id, record));
}

fn float(value: f32) -> [u8; 4] {
    value.to_le_bytes()
}

const NOT_FINITE: [f32; 3] = [f32::NAN, f32::INFINITY, f32::NEG_INFINITY];

/// [`with_section`] for a blob that does not open (yet): the sections behind move along.
fn rebuilt(blob: &[u8], id: u16, change: impl FnOnce(&mut Vec<u8>)) -> Vec<u8> {
    let mut change = Some(change);
    let count = usize::from(u16_at(blob, header::SECTIONS.start));
    let mut result = blob[..header::LENGTH + count * entry::LENGTH].to_vec();
    let held = (0..count).map(|i| u16_at(blob, header::LENGTH + i * entry::LENGTH + entry::ID.start));
    for other in held {
        let mut content = blob[patch::section(blob, other)].to_vec();
        if other == id {
            change.take().expect("a section comes once")(&mut content);
        }
        result.resize(result.len().next_multiple_of(ALIGNMENT), 0);
        let at = entry_of(blob, other);
        let offset = (result.len() as u32).to_le_bytes();
        result[at + entry::OFFSET.start..at + entry::OFFSET.end].copy_from_slice(&offset);
        let length = (content.len() as u32).to_le_bytes();
        result[at + entry::BYTES.start..at + entry::BYTES.end].copy_from_slice(&length);
        result.extend(content);
    }
    let total = (result.len() as u32).to_le_bytes();
    result[header::TOTAL].copy_from_slice(&total);
    patch::repair(&mut result);
    result
}
