//! Which fragments an input is made of: one-stage dynamic programming (Torresani 2006, section 7.1, eqs. 8 to 11; Ney 1984,
//! for connected words).
//!
//! A path runs through frames p of the input and q of fragment i. Within a fragment it steps as in [`align`]; at its
//! first frame it may also come from the last frame of any fragment, one frame of the input earlier. It begins at a
//! fragment's first frame and ends at one's last. Only one column of costs is kept, with the frame of the input at
//! which each path entered its fragment: Cost O(T Σ T_i C) time, O(T + Σ T_i) memory.
//!
//! [`align`]: super::align

use gestus_motion::statistics::distance2;
use rayon::prelude::*;

/// A stretch of the input and the fragment that it was recognised as.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Snippet {
    /// The fragment.
    pub fragment: usize,
    /// First frame of the input.
    pub from: usize,
    /// One behind its last frame.
    pub to: usize,
}

/// Costs of the paths that are in one fragment at the current frame of the input.
struct Column {
    cost: Vec<f64>,
    entered: Vec<usize>,
}

/// Cuts an input, `[T][C]`, into fragments, `[T_i][C]` each.
///
/// # Panics
/// Where there is no fragment, or one has no frames: callers ask whether the library is empty.
pub fn segment(input: &[Vec<f64>], fragments: &[&[Vec<f64>]]) -> Vec<Snippet> {
    let mut columns: Vec<Column> = fragments
        .iter()
        .map(|f| Column { cost: vec![f64::INFINITY; f.len()], entered: vec![0; f.len()] })
        .collect();
    // Of each frame: the cheapest fragment that can end there, and where it was entered.
    let mut ends: Vec<(usize, usize)> = Vec::with_capacity(input.len());
    let mut before = 0.0;
    for (p, frame) in input.iter().enumerate() {
        columns
            .par_iter_mut()
            .zip(fragments)
            .with_min_len(16)
            .for_each(|(column, fragment)| advance(column, fragment, frame, p, before));
        let (best, column) = columns
            .iter()
            .enumerate()
            .min_by(|a, b| last(&a.1.cost).total_cmp(&last(&b.1.cost)))
            .expect("there is a fragment");
        before = last(&column.cost);
        ends.push((best, column.entered[column.entered.len() - 1]));
    }
    let mut snippets = Vec::new();
    let mut to = input.len();
    while to > 0 {
        let (fragment, from) = ends[to - 1];
        snippets.push(Snippet { fragment, from, to });
        to = from;
    }
    snippets.reverse();
    snippets
}

fn last(costs: &[f64]) -> f64 {
    costs[costs.len() - 1]
}

/// Takes a column to frame `p` of the input; `before` is the cheapest path that ended a fragment one frame earlier.
fn advance(column: &mut Column, fragment: &[Vec<f64>], frame: &[f64], p: usize, before: f64) {
    // The cell diagonally behind, and the one below in this column.
    let (mut diagonal, mut below) = ((f64::INFINITY, 0), (f64::INFINITY, 0));
    for (q, pose) in fragment.iter().enumerate() {
        let level = if p == 0 { (f64::INFINITY, 0) } else { (column.cost[q], column.entered[q]) };
        let mut best = diagonal;
        for from in [level, below] {
            if from.0 < best.0 {
                best = from;
            }
        }
        // Entering costs nothing; it is not dearer than to stay at the first frame unless that is cheaper.
        if q == 0 && before < best.0 {
            best = (before, p);
        }
        let here = (best.0 + distance2(frame, pose), best.1);
        (column.cost[q], column.entered[q]) = here;
        (diagonal, below) = (level, here);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn word(n: usize, f: impl Fn(f64) -> f64) -> Vec<Vec<f64>> {
        (0..n).map(|i| vec![f(i as f64 / (n - 1) as f64)]).collect()
    }

    /// The least cost of all ways to cut and warp, by recursion over cells.
    fn least(input: &[Vec<f64>], words: &[&[Vec<f64>]], p: usize, q: usize, i: usize) -> f64 {
        let here = distance2(&input[p], &words[i][q]);
        let mut best = f64::INFINITY;
        if q == 0 {
            if p == 0 {
                best = 0.0;
            } else {
                best = best.min(least(input, words, p - 1, 0, i));
                for (j, word) in words.iter().enumerate() {
                    best = best.min(least(input, words, p - 1, word.len() - 1, j));
                }
            }
        } else {
            if p > 0 {
                best = best.min(least(input, words, p - 1, q, i)).min(least(input, words, p - 1, q - 1, i));
            }
            best = best.min(least(input, words, p, q - 1, i));
        }
        best + here
    }

    fn cost(input: &[Vec<f64>], words: &[&[Vec<f64>]], snippets: &[Snippet]) -> f64 {
        snippets
            .iter()
            .map(|s| crate::effort::align::align(&input[s.from..s.to], words[s.fragment]).ssd)
            .sum()
    }

    #[test]
    fn finds_the_cheapest_of_all_concatenations() {
        let words = [word(3, |x| x), word(2, |x| 1.0 - 2.0 * x), word(3, |x| (3.0 * x).sin())];
        let words: Vec<&[Vec<f64>]> = words.iter().map(Vec::as_slice).collect();
        let input = [word(3, |x| x * 1.1), word(3, |x| 0.9 - 1.8 * x)].concat();
        let snippets = segment(&input, &words);
        let slow = (0..3)
            .map(|i| least(&input, &words, input.len() - 1, words[i].len() - 1, i))
            .fold(f64::INFINITY, f64::min);
        assert!((cost(&input, &words, &snippets) - slow).abs() < 1e-12, "{snippets:?}");
    }

    #[test]
    fn a_warped_sentence_is_read_word_by_word() {
        let words =
            [word(20, |x| (6.0 * x).sin()), word(30, |x| 2.0 * x - 1.0), word(25, |x| (9.0 * x).cos() * x)];
        let said = [2, 0, 1, 1, 2, 0];
        let mut input = Vec::new();
        let mut truth = Vec::new();
        for (n, &w) in said.iter().enumerate() {
            let length = [22, 31, 18, 40, 26, 20][n];
            let from = input.len();
            input.extend((0..length).map(|i| {
                gestus_motion::body::row_at(
                    &words[w],
                    i as f64 / (length - 1) as f64 * (words[w].len() - 1) as f64,
                )
            }));
            truth.push(Snippet { fragment: w, from, to: input.len() });
        }
        let words: Vec<&[Vec<f64>]> = words.iter().map(Vec::as_slice).collect();
        assert_eq!(segment(&input, &words), truth);
    }
}
