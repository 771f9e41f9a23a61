//! Rows: the packed dofs of a frame.
//!
//! A block of rows stores, once, a base and a bit width a dof; a row is the dofs' distances from their bases, in
//! quantisation steps, fields side by side, lowest bits first. Any row is one address away:
//! `block + header + (row % block_rows) · row_bytes`.
//!
//! A step reads runs of two to four consecutive rows. Within a block they share bases and widths, so that a run is
//! unpacked dof by dof rather than row by row: the second row costs half of the first.

use crate::blob::{
    Database,
    layout::{block, dof_record},
    read::{Record, u16_at, u32_at},
};

/// A row in its block.
struct Packed<'a> {
    /// Two bytes a dof.
    bases: &'a [u8],
    /// Half a byte a dof.
    widths: &'a [u8],
    /// The row's fields, and what follows them.
    fields: &'a [u8],
    row_bytes: usize,
}

impl Database<'_> {
    /// Unpacks the dofs of a row into the first D places of `dofs`: metres, radians, and those a second.
    pub fn decode(&self, row: usize, dofs: &mut [f32]) {
        let dofs = dofs.get_mut(..self.counts.dofs).unwrap_or(&mut []);
        let _ = self.unpack(row, dofs, |slot, [value]| *slot = value as f32);
        if !self.counts.dofs.is_multiple_of(2)
            && let Some(last) = dofs.last_mut()
        {
            let Packed { bases, widths, fields, .. } = self.packed(row);
            let bits = |pair: &u8| u32::from(pair & 15) + u32::from(pair >> 4);
            // Its width is alone in its byte, whose other half is zero.
            let width = widths.last().map_or(0, bits);
            let bit = (widths.iter().map(bits).sum::<u32>() - width) as usize;
            let field = (u32_at(fields, bit >> 3) >> (bit & 7)) & below(width);
            *last = (i32::from(u16_at(bases, 2 * (self.counts.dofs - 1)) as i16) + field as i32) as f32;
        }
        let records = self.required.dofs.as_chunks::<{ dof_record::LENGTH }>().0;
        // Ranges may follow the records.
        for (value, record) in dofs.iter_mut().zip(records) {
            *value *= Record(record).f32(dof_record::STEP);
        }
    }

    /// Unpacks `N` rows from `row` on and gives each slot its dof's values, in quantisation steps (-32,768 to 65,534),
    /// to `put`. Returns the bytes read; `None`, and no call of `put`, if the rows are not in one block. With an odd
    /// number of dofs the slot behind the last, which a [`crate::methods::mixture::variables::Example`] has, receives
    /// meaningless values.
    #[inline]
    pub(crate) fn unpack<const N: usize, T>(
        &self,
        row: usize,
        slots: &mut [T],
        put: impl Fn(&mut T, [i32; N]),
    ) -> Option<u32> {
        if (row & (self.counts.block_rows - 1)) + N > self.counts.block_rows {
            return None;
        }
        let packed = self.packed(row);
        let bytes = block::header(self.counts.dofs) + N * packed.row_bytes;
        unpack(packed, slots, put);
        Some(bytes as u32)
    }

    #[inline(never)]
    fn packed(&self, row: usize) -> Packed<'_> {
        let count = self.counts.dofs;
        let start = u32_at(self.required.blocks, 4 * (row >> self.block_shift)) as usize;
        let bytes = self.required.rows.get(start..).unwrap_or(&[]);
        let row_bytes = usize::from(u16_at(bytes, block::ROW_BYTES.start));
        let within = row & (self.counts.block_rows - 1);
        let (bases, widths) = (block::BASES + 2 * count, block::header(count));
        Packed {
            // Whole pairs of dofs: with an odd number the last pair reads into the widths.
            bases: bytes.get(block::BASES..block::BASES + 4 * count.div_ceil(2)).unwrap_or(&[]),
            widths: bytes.get(bases..widths).unwrap_or(&[]),
            fields: bytes.get(widths + within * row_bytes..).unwrap_or(&[]),
            row_bytes,
        }
    }
}

/// The lowest `width` bits, at most 15.
#[inline]
fn below(width: u32) -> u32 {
    !(u32::MAX << (width & 15))
}

/// Unpacks `N` rows of one block. Not inlined, so that the caller's variables do not take its registers.
#[inline(never)]
fn unpack<const N: usize, T>(packed: Packed<'_>, slots: &mut [T], put: impl Fn(&mut T, [i32; N])) {
    // Any field of a row can be read as four bytes: other fields or the padding follow it.
    let length = packed.row_bytes + block::PADDING - 1;
    let mut rows: [&[u8]; N] = [&[]; N];
    for (i, fields) in rows.iter_mut().enumerate() {
        let start = i * packed.row_bytes;
        // All have the same length, so that the compiler needs one bounds check for all.
        let Some(found) = packed.fields.get(start..start + length) else { return };
        *fields = found;
    }
    let word = |fields: &[u8], at: usize| {
        fields.get(at..).and_then(|rest| rest.first_chunk()).map_or(0, |bytes| u32::from_le_bytes(*bytes))
    };
    let read = |bit: usize| -> [u32; N] { rows.map(|fields| word(fields, bit >> 3) >> (bit & 7)) };
    let mut bit = 0;
    let pairs = slots.as_chunks_mut::<2>().0;
    let bases = packed.bases.as_chunks::<4>().0;
    for (([even, odd], bases), widths) in pairs.iter_mut().zip(bases).zip(packed.widths) {
        let bases = i32::from_le_bytes(*bases);
        let (first, second) = (u32::from(widths & 15), u32::from(widths >> 4));
        let mut fields = read(bit);
        put(even, fields.map(|f| i32::from(bases as i16) + (f & below(first)) as i32));
        // A read gives at least 25 bits: usually both fields.
        fields = if first + second <= 25 { fields.map(|f| f >> first) } else { read(bit + first as usize) };
        put(odd, fields.map(|f| (bases >> 16) + (f & below(second)) as i32));
        bit += (first + second) as usize;
    }
}
