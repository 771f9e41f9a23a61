//! Tables of means and spreads of joint rotations, as [`statistic`](crate::blob::layout::statistic) lays them out.

use super::labelled;
use crate::{
    blob::{
        Database, Numbers,
        layout::statistic,
        read::{Record, f32_at, floats, u16_at},
    },
    math::quaternion::Quaternion,
};

/// A table of statistics: means and deviations of one style, over one action or all.
#[derive(Debug, Clone, Copy)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Table<'db> {
    /// Its style.
    pub style: u16,
    /// The action that it was estimated from; `None` for all.
    pub action: Option<u16>,
    pub(in crate::blob) bytes: &'db [u8],
    dofs: usize,
}

impl<'db> Table<'db> {
    /// Mean and standard deviation of height, forward and left velocity.
    #[inline(never)]
    pub fn root(&self, index: usize) -> [f32; 2] {
        floats(self.bytes, statistic::ROOT + 8 * index)
    }

    /// The footplant detector of a side: the boundary, and the projection of the dofs that is compared with it.
    #[inline(never)]
    pub fn foot(&self, side: usize) -> (f32, Numbers<'db>) {
        let at = statistic::FEET + side * 4 * (1 + self.dofs);
        (f32_at(self.bytes, at), Numbers::at(self.bytes, at + 4))
    }

    /// Mean local rotation of a joint (joint 0: without the heading) and standard deviation of the angle to it, radians.
    #[inline]
    pub fn joint(&self, joint: usize) -> (Quaternion, f32) {
        let bytes = self.bytes.get(statistic::joints(self.dofs)..).unwrap_or(&[]);
        let Some(record) = bytes.as_chunks::<{ statistic::JOINT }>().0.get(joint) else {
            return ([0.0; 4], 0.0);
        };
        let [x, y, z, w, deviation] = Record(record).floats(0..statistic::JOINT);
        ([x, y, z, w], deviation)
    }

    /// Bytes of the table.
    pub fn bytes(&self) -> usize {
        self.bytes.len()
    }
}

impl<'db> Database<'db> {
    fn statistic(&self) -> Record<'db> {
        Record(self.optional.statistic.unwrap_or(&[]))
    }

    /// The style that is assumed of an unlabelled input; `None` if the blob has no statistics.
    pub fn statistic_from(&self) -> Option<u16> {
        self.optional.statistic.map(|bytes| u16_at(bytes, statistic::FROM.start))
    }

    /// Number of tables of statistics.
    pub fn tables(&self) -> usize {
        usize::from(self.statistic().u16(statistic::TABLES))
    }

    /// Table `index` of statistics.
    #[inline(never)]
    pub fn table(&self, index: usize) -> Table<'db> {
        let length = statistic::length(self.counts.joints);
        let record = Record::of(self.statistic().0.get(statistic::HEADER..).unwrap_or(&[]), index, length);
        Table {
            style: record.u16(statistic::STYLE),
            action: labelled(record.u16(statistic::ACTION)),
            bytes: record.0,
            dofs: self.counts.dofs,
        }
    }

    /// The statistics of a style: those of the action if there are any, otherwise those of all actions.
    #[inline(never)]
    pub fn table_of(&self, style: u16, action: Option<u16>) -> Option<Table<'db>> {
        let of = |action: Option<u16>| {
            (0..self.tables()).map(|i| self.table(i)).find(|t| t.style == style && t.action == action)
        };
        action.and_then(|a| of(Some(a))).or_else(|| of(None))
    }
}
