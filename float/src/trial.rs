//! Operations of all kinds of numbers, to compare one machine's with another's.

/// Bits where an operation may go wrong: zeros, the ends of what is subnormal and of what is finite, infinity, NaN, ones and
/// their neighbors.
const EDGES: [u32; 16] = [
    0,
    1,
    0x7f_ffff,
    0x80_0000,
    0x80_0001,
    0xff_ffff,
    0x3f7f_ffff,
    0x3f80_0000,
    0x3f80_0001,
    0x3fff_ffff,
    0x4b80_0000,
    0x7e80_0000,
    0x7f7f_ffff,
    0x7f80_0000,
    0x7fc0_0000,
    0x2000_0000,
];

/// How many pairs are tried on a board.
pub const PAIRS: usize = 20_000;

/// So many pairs of numbers, as bits: every pair of edges first, then of any bits, of exponents that are close, and of
/// mantissas that are nearly alike.
pub fn pairs(count: usize) -> impl Iterator<Item = (u32, u32)> {
    let signed = |i: usize| EDGES[i % 16] | ((i as u32 / 16) & 1) << 31;
    let edges = (0..1024).map(move |i| (signed(i), signed(i / 32)));
    let mut state = 1u32;
    let mut random = move || {
        // Knuth's; the lower bits of such a series repeat.
        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        let high = state >> 16;
        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        high << 16 | state >> 16
    };
    let others = (0u32..).map(move |i| {
        let (a, b) = (random(), random());
        match i % 4 {
            0 => (a, b),
            // Ordinary ones up to 32 powers of two apart.
            1 | 2 => (a & 0x9fff_ffff | 0x3000_0000, (b & 0x8fff_ffff) + (a & 0x7000_0000 | 0x3000_0000) / 2),
            _ => (a, a ^ (b & 0x8000_00ff) ^ (1 << (b >> 8 & 31))),
        }
    });
    edges.chain(others).take(count)
}

/// A digest of the sums, differences, products, quotients and comparisons of so many pairs, of the wide products of
/// their bits and of leading zeros, by this machine's own operations.
pub fn digest(count: usize) -> u32 {
    let mut digest = 0u32;
    let mut take = |value: u32| digest = (digest.rotate_left(5) ^ value).wrapping_mul(0x9e37_79b1);
    for (x, y) in pairs(count) {
        let (a, b) = (f32::from_bits(x), f32::from_bits(y));
        for result in [a + b, a - b, a * b, a / b] {
            // What bits a NaN has is left to a machine.
            take(if result.is_nan() { 0x7fc0_0000 } else { result.to_bits() });
        }
        let compared = [a < b, a <= b, a > b, a >= b, a == b, a != b];
        take(compared.iter().fold(0, |bits, &is| bits << 1 | u32::from(is)));
        for wide in
            [i64::from(x as i32) * i64::from(y as i32), (i64::from(x) << 20 | 77).wrapping_mul(!i64::from(y))]
        {
            take(wide as u32);
            take((wide >> 32) as u32);
        }
        take(x.leading_zeros() << 8 | (x >> (y & 31)).leading_zeros());
    }
    digest
}
