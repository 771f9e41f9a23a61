//! Rows: the dofs of one frame, packed.
//!
//! A block of rows stores, once, a base and a bit width a dof; a row is the dofs' distances from their bases, in
//! quantisation steps, fields side by side, lowest bits first. Any row is one address away:
//! `block + header + (row % block_rows) · row_bytes`.

use super::{
    Database,
    layout::{block, dof_record},
    read::{f32_at, u16_at, u32_at},
};

impl Database<'_> {
    /// Unpacks the dofs of a row into the first D places of `dofs`: metres, radians, and those a second.
    pub fn decode(&self, row: usize, dofs: &mut [f32]) {
        let count = self.counts.dofs;
        let start = u32_at(self.blocks, 4 * (row >> self.block_shift)) as usize;
        let bytes = self.rows.get(start..).unwrap_or(&[]);
        let row_bytes = usize::from(u16_at(bytes, block::ROW_BYTES.start));
        let within = row & (self.counts.block_rows - 1);
        let bases = bytes.get(block::BASES..).unwrap_or(&[]);
        let widths = bases.get(2 * count..).unwrap_or(&[]);
        let fields = bytes.get(block::header(count) + within * row_bytes..).unwrap_or(&[]);
        // Bits of the row that were read from memory and not yet used, lowest first.
        let mut held: u32 = 0;
        let mut bits = 0;
        let mut next = 0;
        for (d, (value, base)) in dofs.iter_mut().zip(bases.chunks_exact(2)).take(count).enumerate() {
            let pair = widths.get(d / 2).copied().unwrap_or(0);
            let width = u32::from(if d & 1 == 0 { pair & 15 } else { pair >> 4 });
            if bits < width {
                // Widths are at most 15, so 16 more bits always fit beside fewer than 15.
                held |= u32::from(u16_at(fields, next)) << bits;
                next += 2;
                bits += 16;
            }
            let field = held & ((1 << width) - 1);
            held >>= width;
            bits -= width;
            let base = i16::from_le_bytes([base[0], base[1]]);
            // Both are small whole numbers: the sum and its conversion are exact.
            let steps = i32::from(base) + field as i32;
            *value = steps as f32 * f32_at(self.dofs, d * dof_record::LENGTH);
        }
    }

    /// Bytes that [`decode`](Self::decode) reads for one row: the block's header and the row.
    pub fn row_cost(&self, row: usize) -> usize {
        let start = u32_at(self.blocks, 4 * (row >> self.block_shift)) as usize;
        block::header(self.counts.dofs) + usize::from(u16_at(self.rows, start))
    }
}
