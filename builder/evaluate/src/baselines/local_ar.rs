//! The local autoregressive model of Xia 2015 (eqs. 2, 6 and 7) in `f64`, over neighbors that any search may have found.

use gestus_core::Config;
use nalgebra::{Matrix4, Vector4};

use super::outputs::Example;

/// Translates `x`, shape `[frames][D]`: each frame by a model that is fitted to its own neighbors, `y[t-1]` fed back.
/// The first goes on from its neighbors' mean.
pub fn translate(config: &Config, x: &[Vec<f64>], near: &[Vec<&Example>]) -> Vec<Vec<f64>> {
    let mut outputs: Vec<Vec<f64>> = Vec::new();
    for (t, near) in near.iter().enumerate() {
        let x_prev = &x[t.saturating_sub(1)];
        let one = |d: usize| {
            let mean =
                |of: &dyn Fn(&Example) -> f64| near.iter().map(|e| of(e)).sum::<f64>() / near.len() as f64;
            let y_prev = outputs.last().map_or_else(|| mean(&|e| e.y_prev[d]), |y| y[d]);
            let spread = mean(&|e| e.x[d].powi(2)) - mean(&|e| e.x[d]).powi(2);
            let reach = f64::from(config.kappa) * spread.max(0.0).sqrt();
            let off = x[t][d] - mean(&|e| e.x[d]);
            // What lies outside of the interval bypasses the model.
            let bias = off - off.clamp(-reach, reach);
            let passed = f64::from(config.rho) * bias;
            let (mut squares, mut products) =
                (Matrix4::identity() * f64::from(config.lambda), Vector4::zeros());
            for e in near {
                let u = Vector4::new(e.x_prev[d], e.y_prev[d], e.x[d], 1.0);
                squares += u * u.transpose();
                products += u * e.y[d];
            }
            let model = squares.cholesky().map_or_else(Vector4::zeros, |c| c.solve(&products));
            model.dot(&Vector4::new(x_prev[d] - bias, y_prev - passed, x[t][d] - bias, 1.0)) + passed
        };
        let next = (0..x[t].len()).map(one).collect();
        outputs.push(next);
    }
    outputs
}

#[cfg(test)]
mod tests {
    use super::*;

    fn example(x_prev: f64, y_prev: f64, x: f64) -> Example {
        let y = 0.5 * x_prev - 0.25 * y_prev + 2.0 * x + 0.125;
        Example { row: 0, x: vec![x], x_prev: vec![x_prev], y: vec![y], y_prev: vec![y_prev] }
    }

    #[test]
    fn a_linear_map_is_found_and_what_is_outside_of_the_interval_passes_in_part() {
        let all: Vec<Example> =
            [(0.0, 1.0, 2.0), (1.0, 0.0, 0.5), (0.3, 0.7, -1.0), (2.0, -1.0, 1.0), (-1.0, 0.2, 0.0)]
                .map(|(a, b, c)| example(a, b, c))
                .into();
        let near = vec![all.iter().collect::<Vec<_>>()];
        let config = Config::new().lambda(1e-9).kappa(1e6);
        let y = translate(&config, &[vec![0.6]], &near)[0][0];
        let y_prev = all.iter().map(|e| e.y_prev[0]).sum::<f64>() / 5.0;
        assert!((y - (2.5 * 0.6 - 0.25 * y_prev + 0.125)).abs() < 1e-6, "{y}");
        // With no interval at all the model sees the neighbors' mean.
        let mean = all.iter().map(|e| e.x[0]).sum::<f64>() / 5.0;
        let held = |rho| translate(&config.kappa(0.0).rho(rho), &[vec![0.6]], &near)[0][0];
        assert!((held(0.0) - (2.5 * mean - 0.25 * y_prev + 0.125)).abs() < 1e-6);
        let bias = 0.6 - mean;
        assert!((held(1.0) - held(0.0) - (1.0 + 0.25) * bias).abs() < 1e-6);
    }
}
