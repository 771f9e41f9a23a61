//! The time-warp stage of iterative motion warping: approximate matching by repetition (Hsu 2005, section 3.1).
//!
//! Every frame `p_i` is repeated `r_i` times, `1 <= r_i <= k`, `sum r_i = n`, so that `|R p - q|^2` is least
//! (eq. 3), `q` being the other motion with every frame repeated `s` times and `k = s^2`: slopes of the warp then
//! lie between `1/s` and `s`. With `C_i[j]` the sum of the first `j` costs of row `i`, the recurrence is
//!
//! `D_i[j] = C_i[j] + min over r of (D_{i-1}[j - r] - C_i[j - r])`
//!
//! Cost: O(frames x s frames x s^2) time, one byte per cell. For motions of similar length, two
//! thirds of the cells violate the slope limit and are skipped.

use crate::registration::warp::error::WarpError;

/// Least and greatest number of frames of the lengthened `q` that rows up to `row` of `rows` can cover.
pub(super) fn reach(row: usize, rows: usize, columns: usize, limit: usize) -> (usize, usize) {
    let after = rows - 1 - row;
    let least = (row + 1).max(columns.saturating_sub(after * limit));
    (least, ((row + 1) * limit).min(columns - after))
}

/// The repetition vector of least cost; `costs` is [frames of p x frames of q before lengthening].
///
/// # Errors
/// [`WarpError::Lengths`] if the slope limit allows no warp.
pub fn repetitions(costs: &[Vec<f64>], slope: usize) -> Result<Vec<usize>, WarpError> {
    let rows = costs.len();
    let to = costs.first().map_or(0, Vec::len);
    let (slope, columns) = (slope.max(1), to * slope.max(1));
    let limit = slope * slope;
    if rows == 0 || rows > columns || columns > rows * limit {
        return Err(WarpError::Lengths { from: rows, to, slope });
    }
    let mut best = vec![f64::INFINITY; columns + 1];
    best[0] = 0.0;
    let mut taken = vec![vec![0_u16; columns + 1]; rows];
    let mut sums = vec![0.0; columns + 1];
    let mut before = 0;
    for (i, (row, taken)) in costs.iter().zip(&mut taken).enumerate() {
        let (least, most) = reach(i, rows, columns, limit);
        sums[before] = 0.0;
        for j in before..most {
            sums[j + 1] = sums[j] + row[j / slope];
        }
        let mut next = vec![f64::INFINITY; columns + 1];
        for j in least..=most {
            for r in 1..=limit.min(j - before) {
                let cost = best[j - r] + (sums[j] - sums[j - r]);
                if cost < next[j] {
                    next[j] = cost;
                    taken[j] = r as u16;
                }
            }
        }
        best = next;
        before = least;
    }
    let mut j = columns;
    let mut result: Vec<usize> = taken
        .iter()
        .rev()
        .map(|taken| {
            let r = usize::from(taken[j]);
            j -= r;
            r
        })
        .collect();
    result.reverse();
    Ok(result)
}

/// Cost of a repetition vector, `|R p - q|^2`, by its definition.
pub fn cost(costs: &[Vec<f64>], slope: usize, repetitions: &[usize]) -> f64 {
    let mut j = 0;
    let mut sum = 0.0;
    for (row, &r) in costs.iter().zip(repetitions) {
        for _ in 0..r {
            sum += row[j / slope];
            j += 1;
        }
    }
    sum
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Every repetition vector there is.
    fn exhaustive(costs: &[Vec<f64>], slope: usize, chosen: &mut Vec<usize>, left: usize) -> f64 {
        if chosen.len() == costs.len() {
            return if left == 0 { cost(costs, slope, chosen) } else { f64::INFINITY };
        }
        let mut least = f64::INFINITY;
        for r in 1..=(slope * slope).min(left) {
            chosen.push(r);
            least = least.min(exhaustive(costs, slope, chosen, left - r));
            chosen.pop();
        }
        least
    }

    #[test]
    fn is_the_best_of_all_repetitions() {
        for (rows, to) in [(4, 4), (5, 3), (3, 5), (6, 4)] {
            let costs: Vec<Vec<f64>> = (0..rows)
                .map(|i| (0..to).map(|j| ((i * 37 + j * 91 + i * j * 13) % 29) as f64).collect())
                .collect();
            let found = repetitions(&costs, 2).unwrap();
            assert_eq!(found.iter().sum::<usize>(), 2 * to);
            assert!(found.iter().all(|r| (1..=4).contains(r)));
            assert_eq!(cost(&costs, 2, &found), exhaustive(&costs, 2, &mut Vec::new(), 2 * to));
        }
    }

    #[test]
    fn refuses_lengths_beyond_the_slope_limit() {
        let costs = |rows: usize, to: usize| vec![vec![0.0; to]; rows];
        assert!(repetitions(&costs(10, 20), 2).is_ok());
        assert!(repetitions(&costs(20, 10), 2).is_ok());
        assert!(matches!(repetitions(&costs(10, 21), 2), Err(WarpError::Lengths { .. })));
        assert!(matches!(repetitions(&costs(21, 10), 2), Err(WarpError::Lengths { .. })));
    }
}
