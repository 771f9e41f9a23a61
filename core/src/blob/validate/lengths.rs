//! The length of every required section, as it follows from the counts.

use crate::blob::{
    Database,
    check::{Checked, length},
    layout::{
        DEGREE, class, clip, cycle, dof_range, dof_record, joint, query,
        section::{self, Required},
        timing,
    },
};

#[inline]
pub(super) fn lengths(db: &Database<'_>) -> Checked {
    let c = &db.counts;
    let coordinates: usize =
        (0..c.features).map(|f| 3 * c.window * joints_of_group(db, db.feature_group(f))).sum();
    let query =
        if c.features > 0 { query::components(c.window, c.joints, c.features) + 2 * coordinates } else { 0 };
    let Required { manifest, knots, rows, graph, .. } = db.required;
    let need = Required {
        // Decoded below.
        manifest: manifest.len(),
        skeleton: c.joints * joint::LENGTH + joint::TRAILER,
        // One table, or two.
        dofs: c.dofs * (dof_record::LENGTH + if db.has_dof_ranges() { dof_range::LENGTH } else { 0 }),
        query,
        classes: c.classes * class::LENGTH,
        clips: c.clips * clip::LENGTH,
        cycles: c.cycles * cycle::LENGTH,
        // Cycles refer to knots, which are checked with them.
        knots: knots.len(),
        // One table, or two.
        pairs: c.cycles * c.styles * 2 * db.outputs(),
        blocks: blocks_of(db) * 4,
        // The blocks say how long their rows are, which is checked with them.
        rows: rows.len(),
        features: c.frames * c.features,
        // All frames have edges, or none has.
        graph: if graph.is_empty() { 0 } else { c.frames * 2 * DEGREE },
        flags: c.frames,
        timing: c.timing * timing::LENGTH,
    };
    for ((id, bytes), (_, need)) in db.required.numbered().into_iter().zip(need.numbered()) {
        length(id, need, bytes.len())?;
    }
    length(section::KNOTS, knots.len().next_multiple_of(4), knots.len())
}

/// Number of blocks that the rows fill; a block holds a power of two of them.
#[inline]
pub(super) fn blocks_of(db: &Database<'_>) -> usize {
    (db.counts.rows + db.counts.block_rows - 1) >> db.block_shift
}

#[inline]
fn joints_of_group(db: &Database<'_>, group: usize) -> usize {
    (0..db.counts.joints).filter(|&j| db.joint(j).group == group).count()
}
