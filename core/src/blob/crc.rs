//! CRC-32C (Castagnoli): one table of 16 words, four bits at a time; about 10 instructions a byte.
//! Our own: core takes few packages, and a table of 64 bytes does where a crate's takes a kilobyte of flash.
//!
//! Long pieces take no table but for their end; about 3 instructions a byte. The polynomial divides
//! `x^8032 + x^5441 + x^1924 + 1`, which has four terms only: to divide by this one is to add, to each word, what the
//! quotient was 2,591, 6,108 and 8,032 bits before, with exclusive or. The remainder, a kilobyte, has the same checksum.

use core::cell::Cell;

const TABLE: [u32; 16] = {
    let mut table = [0; 16];
    let mut i = 0;
    while i < 16 {
        let mut value = i as u32;
        let mut bit = 0;
        while bit < 4 {
            value = if value & 1 == 1 { (value >> 1) ^ 0x82f6_3b78 } else { value >> 1 };
            bit += 1;
        }
        table[i] = value;
        i += 1;
    }
    table
};

/// Words from the quotient's longest distance back, 8,032 bits.
const WORDS: usize = 251;
/// As many bytes.
const BLOCK: usize = 4 * WORDS;
/// Blocks from which on division pays.
const LONG: usize = 4;
/// Words that are divided in a row.
const STRIDE: usize = 10;
/// Pieces of a block within which no place in the quotient wraps, and which do not refer to themselves: first word, where
/// the words 80 and 190 before it are, and length. Nearer bits are in these words, the others in those before them.
const RUNS: [[usize; 4]; 5] =
    [[0, 171, 61, 80], [80, 0, 141, 80], [160, 80, 221, 30], [190, 110, 0, 60], [250, 170, 60, 1]];

/// Checksum of the pieces, as if they were one.
#[inline(never)]
pub fn crc32c(pieces: &[&[u8]]) -> u32 {
    let mut crc = Crc32c::new();
    for piece in pieces {
        crc.add_all(piece);
    }
    crc.value()
}

/// A checksum that is fed with bytes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Crc32c(u32);

impl Crc32c {
    /// The checksum of no byte.
    pub const fn new() -> Self {
        Self(u32::MAX)
    }

    /// Takes in a byte.
    #[inline]
    pub fn add(&mut self, byte: u8) {
        let mut crc = self.0 ^ u32::from(byte);
        crc = (crc >> 4) ^ TABLE[(crc & 15) as usize];
        self.0 = (crc >> 4) ^ TABLE[(crc & 15) as usize];
    }

    /// Takes in many bytes.
    pub fn add_all(&mut self, bytes: &[u8]) {
        let (blocks, rest) = bytes.as_chunks::<BLOCK>();
        let rest = if blocks.len() < LONG { bytes } else { rest };
        if blocks.len() >= LONG {
            self.add_blocks(blocks);
        }
        rest.iter().for_each(|&byte| self.add(byte));
    }

    /// Takes in blocks, on 1 KB of stack.
    #[inline(never)]
    fn add_blocks(&mut self, blocks: &[[u8; BLOCK]]) {
        let mut quotient = [0; WORDS];
        // What is known of the checksum is added to the first word.
        quotient[0] = core::mem::take(&mut self.0);
        let quotient = Cell::from_mut(quotient.as_mut_slice()).as_slice_of_cells();
        let mut division = Division { near: 0, middle: 0 };
        for (i, block) in (1..).zip(blocks) {
            for [start, near, middle, length] in RUNS {
                let words = |at: usize| quotient.get(at..at + length).unwrap_or(&[]);
                let data = block.as_chunks::<4>().0.get(start..).unwrap_or(&[]);
                division.divide(words(start), data, words(near), words(middle));
                if i == blocks.len() {
                    for word in words(start) {
                        word.take().to_le_bytes().into_iter().for_each(|byte| self.add(byte));
                    }
                }
            }
        }
    }

    /// The checksum of the bytes so far.
    #[inline]
    pub const fn value(self) -> u32 {
        !self.0
    }
}

/// The words before those 80 and 190 back.
struct Division {
    near: u32,
    middle: u32,
}

impl Division {
    /// Replaces words of the quotient, one block old, by the next ones.
    #[inline]
    fn divide(&mut self, words: &[Cell<u32>], data: &[[u8; 4]], near: &[Cell<u32>], middle: &[Cell<u32>]) {
        let (strides, rest) = words.as_chunks::<STRIDE>();
        let all = strides.iter().zip(data.as_chunks().0).zip(near.as_chunks().0).zip(middle.as_chunks().0);
        all.for_each(|(((words, data), near), middle)| self.stride(words, data, near, middle));
        // A run of one word.
        if let ([word], [data, ..], [near, ..], [middle, ..]) = (rest, data, near, middle) {
            self.word(word, *data, near, middle);
        }
    }

    #[inline]
    fn stride(
        &mut self,
        words: &[Cell<u32>; STRIDE],
        data: &[[u8; 4]; STRIDE],
        near: &[Cell<u32>; STRIDE],
        middle: &[Cell<u32>; STRIDE],
    ) {
        let mut word = |i: usize| self.word(&words[i], data[i], &near[i], &middle[i]);
        // Written out, because the images that the budgets are for do not unroll a loop as long as this.
        word(0);
        word(1);
        word(2);
        word(3);
        word(4);
        word(5);
        word(6);
        word(7);
        word(8);
        word(9);
    }

    #[inline(always)]
    fn word(&mut self, word: &Cell<u32>, data: [u8; 4], near: &Cell<u32>, middle: &Cell<u32>) {
        let before = (self.near >> 1) ^ (self.middle >> 4);
        *self = Self { near: near.get(), middle: middle.get() };
        let sum = word.get() ^ u32::from_le_bytes(data) ^ before;
        word.set(sum ^ (self.near << 31) ^ (self.middle << 28));
    }
}

impl Default for Crc32c {
    fn default() -> Self {
        Self::new()
    }
}

#[cfg(test)]
mod tests {
    use super::{BLOCK, Crc32c, LONG, crc32c};

    #[test]
    fn check_value_of_the_catalogue() {
        assert_eq!(crc32c(&[b"123456789"]), 0xe306_9283);
        assert_eq!(crc32c(&[b"1234", b"", b"56789"]), 0xe306_9283);
    }

    #[test]
    fn long_pieces_have_the_checksum_of_their_bytes() {
        let mut state = 1_u32;
        let bytes: [u8; 2 * LONG * BLOCK + 7] = core::array::from_fn(|_| {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            (state >> 24) as u8
        });
        for blocks in LONG - 1..2 * LONG {
            for length in [0, 1, 7].map(|more| blocks * BLOCK + more) {
                let mut one_by_one = Crc32c::new();
                bytes[..length].iter().for_each(|&byte| one_by_one.add(byte));
                let parts = bytes[..length].split_at(5);
                assert_eq!(crc32c(&[&bytes[..length]]), one_by_one.value(), "{length}");
                assert_eq!(crc32c(&[parts.0, parts.1]), one_by_one.value(), "{length} in two");
            }
        }
    }
}
