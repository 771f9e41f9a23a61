//! CRC-32C (Castagnoli): one table of 16 words, four bits at a time; about 10 instructions a byte.
//! Our own: core takes few packages, and a table of 64 bytes does where a crate's takes a kilobyte of flash.

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

/// Checksum of the pieces, as if they were one.
pub fn crc32c(pieces: &[&[u8]]) -> u32 {
    let mut crc = Crc32c::new();
    for piece in pieces {
        for &byte in *piece {
            crc.add(byte);
        }
    }
    crc.value()
}

/// A checksum that is fed byte by byte.
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

    /// The checksum of the bytes so far.
    #[inline]
    pub const fn value(self) -> u32 {
        !self.0
    }
}

impl Default for Crc32c {
    fn default() -> Self {
        Self::new()
    }
}

#[cfg(test)]
mod tests {
    #[test]
    fn check_value_of_the_catalogue() {
        assert_eq!(super::crc32c(&[b"123456789"]), 0xe306_9283);
        assert_eq!(super::crc32c(&[b"1234", b"", b"56789"]), 0xe306_9283);
    }
}
