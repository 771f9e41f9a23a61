//! Rows: the dofs of one frame, packed.
//!
//! A block of rows stores, once, a base and a bit width a dof; a row is the dofs' distances from their bases, in
//! quantisation steps, fields side by side, lowest bits first. Any row is one address away:
//! `block + header + (row % block_rows) · row_bytes`.
//!
//! What a frame needs of the database are runs of two to four rows in a row. Within a block they share bases and
//! widths, so a run is unpacked dof by dof rather than row by row: the second row costs half of the first.

use super::{
    Database,
    layout::block,
    read::{u16_at, u32_at},
};

/// Longest run of rows that is unpacked at once.
pub const MAX_RUN: usize = 4;

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
        let _ = self.decode_run(row, 1, dofs, |_, slot, value| *slot = value);
        for (d, value) in dofs.iter_mut().enumerate().take(self.counts.dofs) {
            *value *= self.step(d);
        }
    }

    /// Unpacks `count` rows of one clip from `row` on, at most [`MAX_RUN`], and gives every value to `put`: number
    /// of the row within the run, slot of the dof, value in quantisation steps. Slots get their values in the
    /// order of the rows. Returns the bytes read: the headers of the rows' blocks, and the rows.
    #[inline]
    pub(crate) fn decode_run<T>(
        &self,
        row: usize,
        count: usize,
        slots: &mut [T],
        put: impl Fn(usize, &mut T, f32) + Copy,
    ) -> u32 {
        let slots = slots.get_mut(..self.counts.dofs).unwrap_or(&mut []);
        let packed = self.packed(row);
        let within = row & (self.counts.block_rows - 1);
        let (mut headers, rows) = (1, count * packed.row_bytes);
        match count {
            _ if within + count > self.counts.block_rows => {
                headers = 2;
                for i in 0..count {
                    unpack::<1, T>(self.packed(row + i), slots, |_, slot, value| put(i, slot, value));
                }
            }
            1 => unpack::<1, T>(packed, slots, put),
            2 => unpack::<2, T>(packed, slots, put),
            3 => unpack::<3, T>(packed, slots, put),
            _ => unpack::<MAX_RUN, T>(packed, slots, put),
        }
        (headers * block::header(self.counts.dofs) + rows) as u32
    }

    #[inline]
    fn packed(&self, row: usize) -> Packed<'_> {
        let count = self.counts.dofs;
        let start = u32_at(self.blocks, 4 * (row >> self.block_shift)) as usize;
        let bytes = self.rows.get(start..).unwrap_or(&[]);
        let row_bytes = usize::from(u16_at(bytes, block::ROW_BYTES.start));
        let within = row & (self.counts.block_rows - 1);
        let (bases, widths) = (block::BASES + 2 * count, block::header(count));
        Packed {
            bases: bytes.get(block::BASES..bases).unwrap_or(&[]),
            widths: bytes.get(bases..widths).unwrap_or(&[]),
            fields: bytes.get(widths + within * row_bytes..).unwrap_or(&[]),
            row_bytes,
        }
    }
}

/// Unpacks `N` rows of one block. A function of its own, so that what is around it leaves it its registers.
#[inline(never)]
fn unpack<const N: usize, T>(packed: Packed<'_>, slots: &mut [T], put: impl Fn(usize, &mut T, f32)) {
    // Any field of a row can be read as four bytes: others follow it, or the padding does.
    let length = packed.row_bytes + block::PADDING - 1;
    let mut rows: [&[u8]; N] = [&[]; N];
    for (i, fields) in rows.iter_mut().enumerate() {
        let start = i * packed.row_bytes;
        // All of one length: one check of a place in them is a check of all.
        let Some(found) = packed.fields.get(start..start + length) else { return };
        *fields = found;
    }
    let read = |bit: usize| -> [u32; N] { rows.map(|fields| u32_at(fields, bit >> 3) >> (bit & 7)) };
    let below = |width: u32| !(u32::MAX << (width & 15));
    let mut bit = 0;
    let (pairs, last) = slots.as_chunks_mut::<2>();
    let (bases, last_base) = packed.bases.as_chunks::<4>();
    for (([even, odd], bases), widths) in pairs.iter_mut().zip(bases).zip(packed.widths) {
        let bases = i32::from_le_bytes(*bases);
        let (first, second) = (u32::from(widths & 15), u32::from(widths >> 4));
        let mut fields = read(bit);
        for (i, field) in fields.into_iter().enumerate() {
            // Base and field are small whole numbers: the sum and its conversion are exact.
            put(i, even, (i32::from(bases as i16) + (field & below(first)) as i32) as f32);
        }
        // What was read holds 25 bits at least: both fields for the most part.
        fields = if first + second <= 25 { fields.map(|f| f >> first) } else { read(bit + first as usize) };
        for (i, field) in fields.into_iter().enumerate() {
            put(i, odd, ((bases >> 16) + (field & below(second)) as i32) as f32);
        }
        bit += (first + second) as usize;
    }
    if let ([slot], &[low, high], Some(widths)) = (last, last_base, packed.widths.last()) {
        let base = i32::from(i16::from_le_bytes([low, high]));
        for (i, field) in read(bit).into_iter().enumerate() {
            put(i, slot, (base + (field & below(u32::from(widths & 15))) as i32) as f32);
        }
    }
}
