//! The section of classes.

use gestus_core::blob::layout::class;

use crate::search::graph::ClassGraph;

/// The rows and cycles of a class.
#[derive(Debug, Clone)]
pub struct ClassRows {
    /// Number of its action.
    pub action: usize,
    /// Number of its style.
    pub style: usize,
    /// First row.
    pub first_row: usize,
    /// Number of rows.
    pub rows: usize,
    /// First cycle.
    pub first_cycle: usize,
    /// Number of cycles.
    pub cycles: usize,
}

/// Most neighbors that the core takes of a class with so many searchable frames: a neighborhood is a small part of it.
pub fn k_cap(searchable: usize) -> usize {
    (searchable / 8).clamp(4, usize::from(u16::MAX)).min(searchable)
}

/// Encodes the classes, each with its number of searchable frames and its graph.
pub fn encode(classes: &[ClassRows], searchable: &[usize], graphs: &[ClassGraph]) -> Vec<u8> {
    let each = classes.iter().zip(searchable).zip(graphs);
    each.flat_map(|((class, &count), graph)| record(class, count, &graph.entries)).collect()
}

fn record(c: &ClassRows, searchable: usize, entries: &[u16]) -> [u8; class::LENGTH] {
    let mut record = [0; class::LENGTH];
    let cap = k_cap(searchable);
    for (range, value) in [
        (class::FIRST_ROW, c.first_row),
        (class::ROWS, c.rows),
        (class::FIRST_CYCLE, c.first_cycle),
        (class::CYCLES, c.cycles),
    ] {
        record[range].copy_from_slice(&(value as u32).to_le_bytes());
    }
    for (range, value) in [
        (class::ACTION, c.action),
        (class::STYLE, c.style),
        (class::K_CAP, cap),
        (class::SEARCHABLE, searchable),
    ] {
        record[range].copy_from_slice(&(value as u16).to_le_bytes());
    }
    for (slot, entry) in record[class::ENTRY_POINTS].chunks_exact_mut(2).zip(entries) {
        slot.copy_from_slice(&entry.to_le_bytes());
    }
    record
}

/// Encodes the clips: first row and number of rows.
pub fn encode_clips(clips: &[(usize, usize)]) -> Vec<u8> {
    clips.iter().flat_map(|&(first, rows)| [first as u32, rows as u32]).flat_map(u32::to_le_bytes).collect()
}
