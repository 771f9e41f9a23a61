//! The counts of the header.

use crate::{
    BlobError,
    blob::{
        Counts,
        check::as_u32,
        layout::{
            self, MAX_ACTIONS, MAX_FEATURES, MAX_GROUPS, MAX_JOINTS, MAX_STYLES, MAX_TIMING, MAX_WINDOW,
            NONE, header,
        },
        read::Record,
    },
};

/// Most frames, rows, cycles or clips: products with record lengths stay far below 2^32.
const MOST_RECORDS: usize = 1 << 22;

#[inline]
pub(super) fn counts(head: Record<'_>) -> Result<Counts, BlobError> {
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
    // A blob that was cut to its models holds no frames, and nothing that is about frames. Tables by phase have classes,
    // and features that tell where in their cycle a body is.
    let models_only = c.frames == 0;
    let frameless = [c.rows, c.timing, c.cycles, c.clips].iter().all(|&n| n == 0);
    let by_phase = [c.features, c.window, c.classes].map(|n| n > 0);
    if models_only && !(frameless && (by_phase == [true; 3] || by_phase == [false; 3])) {
        return Err(BlobError::Value { section: 0, record: 8 });
    }
    let least = usize::from(!models_only);
    let fits = [
        (2..=MAX_JOINTS).contains(&c.joints),
        c.dofs == layout::dofs(c.joints),
        (least..=MAX_FEATURES).contains(&c.features),
        (least..=MAX_WINDOW).contains(&c.window),
        (1..=MAX_STYLES).contains(&c.styles),
        (1..=MAX_ACTIONS).contains(&c.actions),
        (least..=c.styles * c.actions).contains(&c.classes),
        (1..=MAX_GROUPS).contains(&c.groups),
        (least..=MOST_RECORDS).contains(&c.frames),
        (c.frames..=MOST_RECORDS).contains(&c.rows),
        c.block_rows.is_power_of_two() && c.block_rows <= 64,
        (least..=MAX_TIMING).contains(&c.timing),
        (least..usize::from(NONE)).contains(&c.cycles),
        (least..=MOST_RECORDS).contains(&c.clips),
        (1.0..=1000.0).contains(&head.f32(header::RATE)),
    ];
    match fits.iter().position(|fit| !fit) {
        Some(record) => Err(BlobError::Value { section: 0, record: as_u32(record) }),
        None => Ok(counts),
    }
}
