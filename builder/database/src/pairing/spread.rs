//! Distributes real output cycles in proportion to kernel weights.
//!
//! Choosing the best output cycle for each input cycle makes hubs: all inputs beyond the contents of the output style get
//! the same outermost cycle, often an outlier. A kernel average has no hubs, but moves less than any real cycle and has to
//! be stored. Here every input cycle gets one real cycle, and neighboring inputs get different ones, **in proportion to
//! their kernel weights**. The regression averages over the neighbors of a pose, which come from a dozen cycles, so it
//! sees a kernel average made of captured motion.
//!
//! With `d_o` the squared distance in content to the N nearest output cycles,
//!
//! ```text
//! w_o ∝ exp(-d_o / mean d)        debt_o += w_o        take the o with the largest debt, debt_o -= 1
//! ```
//!
//! which is error diffusion as in printing. Deterministic. Cost: one distance per pair of cycles.

use gestus_motion::statistics::distance2;

/// Candidate output cycles of each input cycle. 4 and 12 work about as well; see `docs/experiments/pairing.md`.
const NEAREST: usize = 8;

/// One output for each input cycle, in the inputs' order; none without outputs.
pub(super) fn spread(inputs: &[usize], outputs: &[usize], content: &[Vec<f64>]) -> Vec<usize> {
    let mut debt = vec![0.0; outputs.len()];
    inputs
        .iter()
        .filter_map(|&input| {
            let mut near: Vec<(f64, usize)> = outputs
                .iter()
                .enumerate()
                .map(|(k, &o)| (distance2(&content[input], &content[o]), k))
                .collect();
            // A stable choice: the first of equals.
            near.sort_by(|a, b| a.0.total_cmp(&b.0));
            near.truncate(NEAREST);
            let mean = (near.iter().map(|n| n.0).sum::<f64>() / near.len() as f64).max(1e-9);
            let weights: Vec<f64> = near.iter().map(|n| (-n.0 / mean).exp()).collect();
            let total: f64 = weights.iter().sum();
            for ((_, k), w) in near.iter().zip(&weights) {
                debt[*k] += w / total;
            }
            let chosen_output =
                near.iter().map(|n| n.1).reduce(|a, b| if debt[b] > debt[a] { b } else { a })?;
            debt[chosen_output] -= 1.0;
            Some(outputs[chosen_output])
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Contents on a line: outputs 0 to 9 at 0, 1, .. 9, inputs behind them where the test says.
    fn line(inputs: &[f64]) -> (Vec<usize>, Vec<usize>, Vec<Vec<f64>>) {
        let content = (0..10).map(f64::from).chain(inputs.iter().copied()).map(|c| vec![c]).collect();
        ((10..10 + inputs.len()).collect(), (0..10).collect(), content)
    }

    #[test]
    fn equal_inputs_share_out_the_outputs_as_the_kernel_says() {
        let (inputs, outputs, content) = line(&[4.5; 1000]);
        let chosen = spread(&inputs, &outputs, &content);
        let near: Vec<usize> = (1..9).collect();
        let weights: Vec<f64> = {
            let d: Vec<f64> = near.iter().map(|&o| (o as f64 - 4.5).powi(2)).collect();
            let mean = d.iter().sum::<f64>() / 8.0;
            let w: Vec<f64> = d.iter().map(|d| (-d / mean).exp()).collect();
            w.iter().map(|x| x / w.iter().sum::<f64>()).collect()
        };
        for (o, w) in near.iter().zip(weights) {
            let count = chosen.iter().filter(|c| *c == o).count() as f64;
            assert!((count - 1000.0 * w).abs() <= 8.0, "{o}: {count} times for a weight of {w}");
        }
        assert!(chosen.iter().all(|c| near.contains(c)));
    }

    #[test]
    fn inputs_beyond_all_outputs_have_no_hub() {
        let (inputs, outputs, content) = line(&[30.0; 80]);
        let chosen = spread(&inputs, &outputs, &content);
        let most = outputs.iter().map(|o| chosen.iter().filter(|c| *c == o).count()).max();
        assert!(most < Some(20), "{most:?} of 80 inputs have one output");
    }

    #[test]
    fn a_single_output_serves_all_and_none_serves_none() {
        let (inputs, _, content) = line(&[3.0, 8.0]);
        assert_eq!(spread(&inputs, &[5], &content), [5, 5]);
        assert_eq!(spread(&inputs, &[], &content), Vec::<usize>::new());
    }
}
