//! Runs of f32 in a blob, and products of the matrices that are stored as such.

/// The numbers of a byte string, f32 after f32.
#[derive(Debug, Clone, Copy)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Numbers<'a>(&'a [[u8; 4]]);

impl<'a> Numbers<'a> {
    /// Numbers from byte `at` on.
    #[inline]
    pub fn at(bytes: &'a [u8], at: usize) -> Self {
        Self(bytes.get(at..).unwrap_or(&[]).as_chunks::<4>().0)
    }

    /// Splits off the first `count` numbers, or all if there are fewer.
    #[inline]
    pub fn take_first(&mut self, count: usize) -> Self {
        let (first, rest) = self.0.split_at_checked(count).unwrap_or((self.0, &[]));
        self.0 = rest;
        Self(first)
    }

    /// Adds the product of a matrix and a vector to `sums`. The matrix is the next of the numbers, row by row.
    #[inline(never)]
    pub fn add_products(&mut self, sums: &mut [f32], vector: &[f32]) {
        // The usual sizes of a joint's model: three inputs, and six states.
        match vector.as_chunks::<3>() {
            ([x], []) => self.add_rows(sums, x),
            ([x, y], []) => self.add_rows(sums, &[x[0], x[1], x[2], y[0], y[1], y[2]]),
            _ => sums.iter_mut().for_each(|sum| *sum = self.take_first(vector.len()).added_to(*sum, vector)),
        }
    }

    /// The same with a number of columns that is known at compile time.
    #[inline]
    fn add_rows<const COLUMNS: usize>(&mut self, sums: &mut [f32], vector: &[f32; COLUMNS]) {
        let matrix = self.take_first(sums.len() * COLUMNS).0;
        for (sum, row) in sums.iter_mut().zip(matrix.as_chunks::<COLUMNS>().0) {
            let products = row.iter().zip(vector).map(|(number, x)| f32::from_le_bytes(*number) * x);
            *sum = products.fold(*sum, |sum, product| sum + product);
        }
    }

    /// The dot product with a vector, summed from the first to the last.
    #[inline]
    pub fn product(self, vector: &[f32]) -> f32 {
        self.added_to(0.0, vector)
    }

    #[inline]
    fn added_to(self, sum: f32, vector: &[f32]) -> f32 {
        self.0.iter().zip(vector).fold(sum, |sum, (number, x)| sum + f32::from_le_bytes(*number) * x)
    }

    /// Number of numbers.
    #[inline]
    pub fn count(self) -> usize {
        self.0.len()
    }
}

impl Iterator for Numbers<'_> {
    type Item = f32;

    #[inline]
    fn next(&mut self) -> Option<f32> {
        let (first, rest) = self.0.split_first()?;
        self.0 = rest;
        Some(f32::from_le_bytes(*first))
    }
}
