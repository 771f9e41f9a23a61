//! CRC-32C (Castagnoli): one table of 16 words, four bits at a time; about 10 instructions a byte.
//! Our own: core takes few packages, and a table of 64 bytes does where a crate's takes a kilobyte of flash.
//!
//! Long pieces take no table but for their end; about 3 instructions a byte. The polynomial divides
//! `x^8032 + x^5441 + x^1924 + 1`, which has four terms only: to divide by this one is to add, to each word, what the
//! quotient was 2,591, 6,108 and 8,032 bits before, with exclusive or. The remainder, a kilobyte, has the same checksum.

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

/// Words that are divided together: fewer than the shortest distance back.
const WORDS: usize = 64;
/// As many bytes.
const BLOCK: usize = 4 * WORDS;
/// Blocks that the longest distance back reaches over; the last ones are the remainder.
const REACH: usize = 4;
/// Blocks from which on division pays.
const LONG: usize = 2 * REACH;

/// Checksum of the pieces, as if they were one.
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

    /// Takes in blocks, more than [`REACH`], on 2 KB of stack.
    #[inline(never)]
    fn add_blocks(&mut self, blocks: &[[u8; BLOCK]]) {
        // The quotient of the last blocks, and room for as many.
        let mut quotient = [0; 2 * REACH * WORDS];
        for (i, block) in blocks.iter().enumerate() {
            if i % REACH == 0 {
                quotient.copy_within(REACH * WORDS.., 0);
            }
            let (before, rest) = quotient.split_at_mut((REACH + i % REACH) * WORDS);
            let Some(words) = rest.first_chunk_mut() else { return };
            divide(words, block, before);
            if i == 0 {
                words[0] ^= self.0;
                self.0 = 0;
            }
            if i + REACH >= blocks.len() {
                words.iter().flat_map(|word| word.to_le_bytes()).for_each(|byte| self.add(byte));
                *words = [0; WORDS];
            }
        }
    }

    /// The checksum of the bytes so far.
    #[inline]
    pub const fn value(self) -> u32 {
        !self.0
    }
}

/// The next words of the quotient, from those before.
#[inline]
fn divide(words: &mut [u32; WORDS], block: &[u8; BLOCK], before: &[u32]) {
    let (Some(near), Some(middle), Some(far)) = (back(before, 81), back(before, 191), back(before, 251))
    else {
        return;
    };
    for (i, (word, bytes)) in words.iter_mut().zip(block.as_chunks::<4>().0).enumerate() {
        let near = (near[i] >> 1) ^ (near[i + 1] << 31);
        let middle = (middle[i] >> 4) ^ (middle[i + 1] << 28);
        *word = u32::from_le_bytes(*bytes) ^ near ^ middle ^ far[i];
    }
}

/// A block's words and one more, from so many words before it on.
#[inline]
fn back(before: &[u32], words: usize) -> Option<&[u32; WORDS + 1]> {
    before.get(before.len().checked_sub(words)?..)?.first_chunk()
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
