//! Dot products of a query with stored codes, in integers.
//!
//! A sum of integers does not depend on the order of its terms, so each processor may use its fastest code.

use crate::blob::layout::MAX_FEATURES;

/// Number of components that are added in straight code.
const CHUNK: usize = 16;

/// Sum of products of a query with i8 codes. The sum has to fit 32 bits.
#[inline]
pub(crate) fn dot<T: Copy + Into<i32>>(query: &[T; MAX_FEATURES], codes: &[u8]) -> i32 {
    if let ([low, high], ([first, second], [])) = (query.as_chunks().0, codes.as_chunks()) {
        return chunk(low, first) + chunk(high, second);
    }
    query.iter().zip(codes).map(|(&query, &code)| query.into() * i32::from(code as i8)).sum()
}

/// Sum of products of i8 codes with each other.
// Not inlined: a loop calls it from two places.
#[inline(never)]
pub(crate) fn dot_of_codes(a: &[u8], b: &[u8]) -> i32 {
    let ((chunks, rest), (other_chunks, other_rest)) = (a.as_chunks::<CHUNK>(), b.as_chunks::<CHUNK>());
    let whole: i32 = chunks.iter().zip(other_chunks).map(|(a, b)| chunk(&a.map(|code| code as i8), b)).sum();
    whole + rest.iter().zip(other_rest).map(|(&a, &b)| i32::from(a as i8) * i32::from(b as i8)).sum::<i32>()
}

/// [`dot`] for whole chunks of codes, in straight code.
#[inline]
fn dot_of<T: Copy + Into<i32>, const N: usize>(query: &[T; MAX_FEATURES], codes: &[u8; N]) -> i32 {
    let (chunks, _) = codes.as_chunks();
    query.as_chunks().0.iter().zip(chunks).map(|(query, codes)| chunk(query, codes)).sum()
}

/// The sum of a chunk's products, written out so that the code is straight at any optimisation level.
#[inline]
fn chunk<T: Copy + Into<i32>>(query: &[T; CHUNK], codes: &[u8; CHUNK]) -> i32 {
    let product = |i: usize| query[i].into() * i32::from(codes[i] as i8);
    let low = product(0) + product(1) + product(2) + product(3);
    let low = low + product(4) + product(5) + product(6) + product(7);
    let high = product(8) + product(9) + product(10) + product(11);
    low + high + product(12) + product(13) + product(14) + product(15)
}

/// Factors of up to 24 bits for a dot product with codes.
#[derive(Debug, Clone)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub(crate) struct Products(Factors);

/// Microcontrollers multiply 32 bits in one instruction.
#[cfg(any(target_arch = "arm", target_arch = "riscv32"))]
type Factors = [i32; MAX_FEATURES];
/// Vector units multiply 16 bits and add pairs in one instruction: the high bits, and the low 9.
#[cfg(not(any(target_arch = "arm", target_arch = "riscv32")))]
type Factors = [[i16; MAX_FEATURES]; 2];

#[cfg(any(target_arch = "arm", target_arch = "riscv32"))]
impl Products {
    pub const NEW: Self = Self([0; MAX_FEATURES]);

    /// Sets the factor of a component, less than 2^24.
    pub fn set(&mut self, at: usize, factor: i32) {
        if let Some(slot) = self.0.get_mut(at) {
            *slot = factor;
        }
    }

    /// Sum of products with stored codes.
    #[inline]
    pub fn dot(&self, codes: &[u8]) -> i32 {
        dot(&self.0, codes)
    }

    /// The same for whole chunks of 16 codes.
    #[inline]
    pub fn dot_of<const N: usize>(&self, codes: &[u8; N]) -> i32 {
        dot_of(&self.0, codes)
    }
}

#[cfg(not(any(target_arch = "arm", target_arch = "riscv32")))]
impl Products {
    pub const NEW: Self = Self([[0; MAX_FEATURES]; 2]);

    /// Sets the factor of a component, less than 2^24.
    pub fn set(&mut self, at: usize, factor: i32) {
        let [high, low] = &mut self.0;
        if let (Some(high), Some(low)) = (high.get_mut(at), low.get_mut(at)) {
            (*high, *low) = ((factor >> 9) as i16, (factor & 511) as i16);
        }
    }

    /// Sum of products with stored codes.
    #[inline]
    pub fn dot(&self, codes: &[u8]) -> i32 {
        let [high, low] = &self.0;
        512 * dot(high, codes) + dot(low, codes)
    }

    /// The same for whole chunks of 16 codes.
    #[inline]
    pub fn dot_of<const N: usize>(&self, codes: &[u8; N]) -> i32 {
        let [high, low] = &self.0;
        512 * dot_of(high, codes) + dot_of(low, codes)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_pair_of_codes_counts_once() {
        let codes: [u8; 32] = core::array::from_fn(|i| (47 * i + 128) as u8);
        let other: [u8; 32] = core::array::from_fn(|i| (91 * i + 3) as u8);
        for length in 0..=codes.len() {
            let pairs = codes[..length].iter().zip(&other);
            let wanted = pairs.map(|(&a, &b)| i32::from(a as i8) * i32::from(b as i8)).sum::<i32>();
            assert_eq!(dot_of_codes(&codes[..length], &other[..length]), wanted, "{length}");
            let query: [i16; MAX_FEATURES] =
                core::array::from_fn(|i| other.get(i).map_or(0, |&code| i16::from(code as i8)));
            assert_eq!(dot(&query, &codes[..length]), wanted, "{length}");
        }
    }
}
