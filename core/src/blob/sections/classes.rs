//! Classes (actions in a style) and the clips that their rows come from.

use crate::blob::{
    Database,
    layout::{ENTRIES, NONE, class, clip},
    read::{Record, u16_at},
};

/// A class: the frames of one action in one style.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Class {
    /// First row.
    pub first_row: usize,
    /// Number of rows, at most 65,535.
    pub rows: usize,
    /// First cycle.
    pub first_cycle: usize,
    /// Number of cycles.
    pub cycles: usize,
    /// Action.
    pub action: u16,
    /// Style.
    pub style: u16,
    /// Most neighbors that a search returns, less than K in a small class.
    pub k_cap: usize,
    /// Rows that the search may return.
    pub searchable: usize,
}

impl Class {
    /// Whether it has an action and a style; `None` stands for any.
    #[inline]
    pub fn has(&self, action: Option<u16>, style: Option<u16>) -> bool {
        labels_match([self.action, self.style], action, style)
    }
}

/// Whether the labels of a class are an action and a style; `None` stands for any.
#[inline]
pub(crate) fn labels_match(labels: [u16; 2], action: Option<u16>, style: Option<u16>) -> bool {
    let [of_action, of_style] = labels;
    action.is_none_or(|action| action == of_action) && style.is_none_or(|style| style == of_style)
}

impl<'db> Database<'db> {
    /// Class `index`.
    #[inline(never)]
    pub fn class(&self, index: usize) -> Class {
        let record = Record::of(self.required.classes, index, class::LENGTH);
        Class {
            first_row: record.u32(class::FIRST_ROW) as usize,
            rows: record.u32(class::ROWS) as usize,
            first_cycle: record.u32(class::FIRST_CYCLE) as usize,
            cycles: record.u32(class::CYCLES) as usize,
            action: record.u16(class::ACTION),
            style: record.u16(class::STYLE),
            k_cap: usize::from(record.u16(class::K_CAP)),
            searchable: usize::from(record.u16(class::SEARCHABLE)),
        }
    }

    /// Action and style of a class alone.
    #[inline(never)]
    pub fn labels(&self, index: usize) -> [u16; 2] {
        let record = Record::of(self.required.classes, index, class::LENGTH);
        [record.u16(class::ACTION), record.u16(class::STYLE)]
    }

    /// The classes, by number.
    pub fn classes(&self) -> impl Iterator<Item = Class> + '_ {
        (0..self.counts.classes).map(|c| self.class(c))
    }

    /// Entry points of a class's graph: rows of the class.
    #[inline]
    pub fn entries(&self, class: usize) -> impl Iterator<Item = u16> + 'db {
        let record = Record::of(self.required.classes, class, class::LENGTH).0;
        let entries = record.get(class::ENTRY_POINTS).unwrap_or(&[]);
        (0..ENTRIES).map(move |i| u16_at(entries, 2 * i)).filter(|&row| row != NONE)
    }

    /// First row and number of rows of a clip.
    #[inline(never)]
    pub fn clip(&self, index: usize) -> (usize, usize) {
        let record = Record::of(self.required.clips, index, clip::LENGTH);
        (record.u32(clip::FIRST_ROW) as usize, record.u32(clip::ROWS) as usize)
    }
}
