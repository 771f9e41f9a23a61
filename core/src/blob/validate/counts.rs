//! The counts of the header.

use crate::{
    BlobError,
    blob::{
        Counts,
        layout::{
            self, MAX_ACTIONS, MAX_FEATURES, MAX_GROUPS, MAX_JOINTS, MAX_STYLES, MAX_TIMING, MAX_WINDOW,
            NONE, header,
        },
        read::Record,
    },
    error::saturating_u32,
};

/// Most frames, rows, cycles or clips: products with record lengths stay far below 2^32.
const MAX_RECORDS: usize = 1 << 22;

/// Place of the number of frames among the limits of [`counts`].
const FRAMES_RECORD: u32 = 8;
/// No method can translate with what the blob holds.
pub(super) const NO_METHOD: BlobError = BlobError::Value { section: 0, record: FRAMES_RECORD };

/// Reads and checks the counts of a blob that is as long as a header.
#[inline(never)]
pub(super) fn counts(bytes: &[u8]) -> Result<Counts, BlobError> {
    // Of a length that the compiler knows, so that fields are plain loads.
    let head = Record::of(bytes, 0, header::LENGTH);
    let small = |range| usize::from(head.u16(range));
    let large = |range| head.u32(range) as usize;
    let counts = Counts {
        joints: small(header::JOINTS),
        dofs: small(header::DOFS),
        features: small(header::FEATURES),
        window: small(header::WINDOW),
        styles: small(header::STYLES),
        actions: small(header::ACTIONS),
        classes: small(header::CLASSES),
        groups: small(header::GROUPS),
        frames: large(header::FRAMES),
        rows: large(header::ROWS),
        block_rows: small(header::BLOCK_ROWS),
        timing: small(header::TIMING),
        cycles: large(header::CYCLES),
        clips: large(header::CLIPS),
    };
    let c = &counts;
    // A blob that was cut to its models holds no frames, and nothing that is about frames. Phase tables have classes,
    // and features that tell where in their cycle a body is.
    let models_only = c.frames == 0;
    let frameless = [c.rows, c.timing, c.cycles, c.clips].iter().all(|&n| n == 0);
    let by_phase = [c.features, c.window, c.classes].map(|n| n > 0);
    if models_only && !(frameless && (by_phase == [true; 3] || by_phase == [false; 3])) {
        return Err(NO_METHOD);
    }
    let least = usize::from(!models_only);
    // A power of two, or none that fits.
    let block_rows = if c.block_rows.is_power_of_two() { c.block_rows } else { 0 };
    let has_rate = usize::from((1.0..=1000.0).contains(&head.f32(header::RATE)));
    // Each with the least and the most that it may be: one loop is less code than a comparison for each.
    let limits = [
        (c.joints, 2, MAX_JOINTS),
        (c.dofs, layout::dofs(c.joints), layout::dofs(c.joints)),
        (c.features, least, MAX_FEATURES),
        (c.window, least, MAX_WINDOW),
        (c.styles, 1, MAX_STYLES),
        (c.actions, 1, MAX_ACTIONS),
        (c.classes, least, c.styles * c.actions),
        (c.groups, 1, MAX_GROUPS),
        (c.frames, least, MAX_RECORDS),
        (c.rows, c.frames, MAX_RECORDS),
        (block_rows, 1, 64),
        (c.timing, least, MAX_TIMING),
        (c.cycles, least, usize::from(NONE) - 1),
        (c.clips, least, MAX_RECORDS),
        (has_rate, 1, 1),
    ];
    match limits.iter().position(|(count, least, most)| !(least..=most).contains(&count)) {
        Some(record) => Err(BlobError::Value { section: 0, record: saturating_u32(record) }),
        None => Ok(counts),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_number_of_frames_has_its_record() {
        let mut bytes = [0; header::LENGTH];
        let mut put = |at: core::ops::Range<usize>, value: usize| {
            let length = at.len();
            bytes[at].copy_from_slice(&value.to_le_bytes()[..length]);
        };
        put(header::JOINTS, 2);
        put(header::DOFS, layout::dofs(2));
        for one in [header::FEATURES, header::WINDOW, header::STYLES, header::ACTIONS, header::CLASSES] {
            put(one, 1);
        }
        put(header::GROUPS, 1);
        put(header::FRAMES, MAX_RECORDS + 1);
        assert_eq!(counts(&bytes).err(), Some(NO_METHOD));
    }
}
