//! CRC-32C (Castagnoli): one table of 16 words, four bits at a time; about 10 instructions a byte.
//! Our own: core takes few packages, and a table of 64 bytes does where a crate's takes a kilobyte of flash.
//!
//! Long pieces take no table but for their end; about 2.5 instructions a byte. The polynomial divides
//! `x^8032 + x^5441 + x^1924 + 1`, which has four terms only: to divide by this one is to add, to each word, what the
//! quotient was 2,591, 6,108 and 8,032 bits before, with exclusive or. The remainder, a kilobyte, has the same checksum.

use core::{
    cell::Cell,
    sync::atomic::{Ordering, compiler_fence},
};

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

/// Length of a block in words: the longest distance of the quotient, 8,032 bits.
const WORDS: usize = 251;
/// The same in bytes.
const BLOCK: usize = 4 * WORDS;
/// The shorter distances in whole words: 2,591 bits are 80 words and 31 bits, 6,108 bits are 190 words and 28 bits.
const NEAR: usize = 80;
const MIDDLE: usize = 190;
/// Blocks from which on division pays.
const LONG: usize = 4;
/// Words per round of the unrolled loop.
const STRIDE: usize = 10;

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
        self.0 ^= u32::from(byte);
        self.divide_byte();
    }

    #[inline(always)]
    fn divide_byte(&mut self) {
        self.0 = (self.0 >> 4) ^ TABLE[(self.0 & 15) as usize];
        self.0 = (self.0 >> 4) ^ TABLE[(self.0 & 15) as usize];
    }

    /// Takes in four bytes.
    #[inline]
    fn add_word(&mut self, word: u32) {
        self.0 ^= word;
        self.divide_byte();
        self.divide_byte();
        self.divide_byte();
        self.divide_byte();
    }

    /// Takes in many bytes.
    fn add_all(&mut self, bytes: &[u8]) {
        let (blocks, rest) = bytes.as_chunks::<BLOCK>();
        let rest = match blocks.split_last() {
            Some((last, blocks)) if blocks.len() + 1 >= LONG => {
                self.add_blocks(blocks, last);
                rest
            }
            _ => bytes,
        };
        let (words, rest) = rest.as_chunks();
        words.iter().for_each(|&data| self.add_word(word(data)));
        rest.iter().for_each(|&byte| self.add(byte));
    }

    /// Adds `blocks` and then `last`, on 1 KB of stack.
    #[inline(never)]
    fn add_blocks(&mut self, blocks: &[[u8; BLOCK]], last: &[u8; BLOCK]) {
        let mut quotient = [0; WORDS];
        // The checksum of the bytes before is added to the first word.
        quotient[0] = core::mem::take(&mut self.0);
        let words = Cell::from_mut(quotient.as_mut_slice()).as_slice_of_cells();
        let mut division = Division { near: 0, middle: 0 };
        for block in blocks {
            division.divide(words, block.as_chunks().0);
        }
        // What the quotient leaves of the last block.
        let before = |i: usize| quotient.get(i).copied().unwrap_or(0);
        for (i, &data) in last.as_chunks().0.iter().enumerate() {
            let (near, middle) = (before(WORDS - NEAR + i), before(WORDS - MIDDLE + i));
            self.add_word(division.next(before(i) ^ word(data), near, middle));
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
    /// Replaces the words of the quotient, one block old, by the next ones.
    #[inline]
    fn divide(&mut self, words: &[Cell<u32>], data: &[[u8; 4]]) {
        // Up to where a word back is no longer of the block before: `NEAR`, `MIDDLE`, and the end.
        self.run::<0, { WORDS - NEAR }, { WORDS - MIDDLE }>(words, data);
        self.run::<NEAR, 0, { WORDS - MIDDLE + NEAR }>(words, data.get(NEAR..).unwrap_or(&[]));
        self.run::<MIDDLE, { MIDDLE - NEAR }, 0>(words, data.get(MIDDLE..).unwrap_or(&[]));
        // The last word is beyond the strides.
        let back = |distance| words.get(WORDS - 1 - distance).map_or(0, Cell::get);
        if let ([.., last], [.., data]) = (words, data) {
            last.set(self.next(last.get() ^ word(*data), back(NEAR), back(MIDDLE)));
        }
    }

    /// Strides of words from `FIRST` on, as long as those and the words back, which are at `NEAR` and `MIDDLE`, are there.
    #[inline]
    fn run<const FIRST: usize, const NEAR: usize, const MIDDLE: usize>(
        &mut self,
        words: &[Cell<u32>],
        data: &[[u8; 4]],
    ) {
        let longest = const {
            let longest = if NEAR > MIDDLE { NEAR } else { MIDDLE };
            STRIDE + if FIRST > longest { FIRST } else { longest }
        };
        for (words, data) in words.windows(longest).step_by(STRIDE).zip(data.as_chunks::<STRIDE>().0) {
            let at = |i: usize| words.get(i).map_or(0, Cell::get);
            let sum = |i: usize| at(FIRST + i) ^ data.get(i).map_or(0, |data| word(*data));
            let sums = |i: usize| [0, 1].map(|next| sum(i + next));
            let both = |i: usize| [0, 1].map(|next| at(i + next));
            let mut coming = sums(0);
            let mut pair = |i: usize| {
                let current = coming;
                // Read before the words back of this pair: in this order the compiler folds every shift into a sum.
                if i + 2 < STRIDE {
                    coming = sums(i + 2);
                }
                let (near, middle) = (both(NEAR + i), both(MIDDLE + i));
                let quotient = [0, 1].map(|next| self.next(current[next], near[next], middle[next]));
                if let Some([first, second]) = words.get(FIRST + i..).and_then(|words| words.first_chunk()) {
                    first.set(quotient[0]);
                    second.set(quotient[1]);
                }
                // Without the fence the compiler reads ahead, and needs more registers than there are.
                compiler_fence(Ordering::SeqCst);
            };
            // Written out, because the images that the budgets are for do not unroll a loop as long as this.
            pair(0);
            pair(2);
            pair(4);
            pair(6);
            pair(8);
        }
    }

    /// A word of the quotient: the sum of the data and the word one block old, and the bits further back, the last of which
    /// are in these two words.
    #[inline(always)]
    fn next(&mut self, sum: u32, near: u32, middle: u32) -> u32 {
        let before = core::mem::replace(self, Self { near, middle });
        sum ^ (before.near >> 1) ^ (before.middle >> 4) ^ (near << 31) ^ (middle << 28)
    }
}

#[inline(always)]
fn word(data: [u8; 4]) -> u32 {
    u32::from_le_bytes(data)
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
