use super::*;
use crate::methods::mixture::sums::Scratch;

/// Predicts by the examples.
fn predict<const J: usize>(
    examples: &Examples<J>,
    dof: usize,
    input: [f32; 3],
    [step, scale]: [f32; 2],
    parameters: &Parameters,
) -> Prediction {
    Regression::new(parameters, examples.count()).predict(examples, dof, input, step, scale)
}

const PARAMETERS: Parameters = Parameters {
    lambda: 0.1,
    ridge: Ridge::Raw,
    feedback: 1.0,
    kappa: 1.0,
    output_kappa: 1.5,
    rho: 0.5,
    output_rho: 0.5,
};

/// Ridge regression about the neighbors' own zero, in f64, with the sums written out: `y[t]` at `input`.
fn slow(examples: &[[f64; 4]], [p, q, x]: [f64; 3], lambda: f64) -> f64 {
    let mut a: [[f64; 5]; 4] =
        core::array::from_fn(|i| core::array::from_fn(|j| if i == j { lambda } else { 0.0 }));
    for &[p, q, x, y] in examples {
        let row = [p, q, x, 1.0, y];
        for (i, sums) in a.iter_mut().enumerate() {
            for (sum, value) in sums.iter_mut().zip(row) {
                *sum += row[i] * value;
            }
        }
    }
    // Gauss and Jordan: a positive definite matrix needs no pivots.
    for i in 0..4 {
        let pivot = a[i].map(|v| v / a[i][i]);
        for (k, row) in a.iter_mut().enumerate() {
            let factor = row[i];
            for (v, p) in row.iter_mut().zip(pivot) {
                *v = if k == i { p } else { *v - factor * p };
            }
        }
    }
    a[0][4] * p + a[1][4] * q + a[2][4] * x + a[3][4]
}

#[test]
fn any_spread_keeps_its_precision_and_none_overflows() {
    let parameters = Parameters { kappa: 1e6, output_kappa: 1e6, ..PARAMETERS };
    for n in [16, 64] {
        for spread in [1e-2, 1.0, 30.0, 1e3, 3e4_f32] {
            let (mut examples, mut scratch) = (Examples::<1>::new(), Scratch::NEW);
            examples.clear([[1.0, DEVIATION]; 4].into_iter());
            let mut all = std::vec::Vec::new();
            for i in 0..n {
                // Small differences first: the unit grows on the way. The last ones lie at both ends.
                let wave = |k: f32| (k * i as f32).sin() * (i + 1) as f32 / n as f32;
                let [p, q, x] = [wave(1.3), wave(2.1), wave(0.7)];
                let y = 0.4 * p - 0.3 * q + 0.6 * x + 0.1 * wave(5.0);
                let variables = [p, q, x, y].map(|v| stored(100.0 + spread * v));
                all.push(variables.map(|v| f64::from(v) / f64::from(1 << FRACTION)));
                examples.next_slot(&mut scratch)[0][1] = variables;
                examples.add(4, &scratch);
            }
            examples.finish(4, &scratch);
            let input = [0.2, -0.1, 0.3].map(|v| 100.0 + spread * v);
            let found = predict(&examples, 1, input, [1.0, DEVIATION], &parameters).y;
            let truth = slow(&all, input.map(f64::from), f64::from(parameters.lambda));
            let off = (f64::from(found) - truth).abs();
            assert!(off < 2e-4 * f64::from(spread) + 1e-3, "{n} at {spread}: {found} not {truth}");
        }
    }
}

/// A variable of that many steps.
fn stored(steps: f32) -> i32 {
    (steps * (1 << FRACTION) as f32) as i32
}

/// Standard deviation of the dof of [`doubled`], in steps.
const DEVIATION: f32 = 16.0;

/// Answer and output of neighbors whose outputs are twice their last ones, in steps.
fn doubled(output_kappa: f32, y_prev: f32) -> (f32, f32) {
    let (mut examples, mut scratch) = (Examples::<1>::new(), Scratch::NEW);
    examples.clear([[1.0, DEVIATION]; 4].into_iter());
    for i in 0..20 {
        // Between -9.5 and 9.5 steps, and x of no help.
        let y_prev = i as f32 - 9.5;
        let variables = &mut examples.next_slot(&mut scratch)[0][3];
        *variables = [0.0, y_prev, 0.0, 2.0 * y_prev].map(stored);
        examples.add(4, &scratch);
    }
    examples.finish(4, &scratch);
    let parameters = Parameters { lambda: 1e-3, output_kappa, ..PARAMETERS };
    let answer = predict(&examples, 3, [0.0, y_prev, 0.0], [1.0, DEVIATION], &parameters);
    (answer.y, answer.y + answer.correction)
}

#[test]
fn far_off_answers_are_put_out_where_the_neighbors_are() {
    for y_prev in [-400.0, -30.0, 0.0, 4.0, 30.0, 5e3] {
        let (answer, output) = doubled(10.0 / DEVIATION, y_prev);
        assert!((answer - 2.0 * y_prev).abs() <= 1e-3 * y_prev.abs() + 1e-3, "{y_prev}: {answer}");
        // 10 steps about a mean of 0.
        let held = answer.clamp(-10.0, 10.0);
        assert!((output - held).abs() <= 1e-6 * answer.abs() + 1e-4, "{y_prev}: {output} not {held}");
        let free = doubled(1e6, y_prev);
        assert_eq!(free.0.to_bits(), answer.to_bits());
        assert_eq!(free.1.to_bits(), answer.to_bits(), "{y_prev}");
    }
}

#[test]
fn a_body_that_stands_is_moved_as_it_moves() {
    let (mut examples, mut scratch) = (Examples::<2>::new(), Scratch::NEW);
    examples.clear([[0.001, 1.0]; 8].into_iter());
    for i in 0..20 {
        // Neighbors walk at 1.0 m/s, deviation 0.058, and their outputs at 0.6, each as fast as it was, in steps of a
        // millimetre.
        let x = 1000.0 + 10.0 * (i as f32 - 9.5);
        let y = 600.0 + 2.0 * ((7 * i % 20) as f32 - 9.5);
        examples.next_slot(&mut scratch)[1][0] = [x, y, x, y].map(stored);
        examples.add(8, &scratch);
    }
    examples.finish(8, &scratch);
    let end = 1.0 - 0.0577;
    let at = |x: f32| predict(&examples, dof::FORWARD, [x - 0.1, 0.6, x], [0.001, 1.0], &PARAMETERS);
    let standing = |x: f32| at(x).correction;
    // Walking, the output gains half of what the input gains.
    assert!((at(1.0).change - 0.05).abs() < 1e-3, "{}", at(1.0).change);
    for x in [0.0, 0.01, 0.3, 0.9] {
        let (ratio, outside) = (x / end, x - end);
        let part = ratio * ratio * (3.0 - 2.0 * ratio);
        let wanted = (1.0 - part) * (x - 0.6 - 0.5 * outside);
        assert!((standing(x) - wanted).abs() < 1e-3, "{x}: {} not {wanted}", standing(x));
        // The input gains 0.1 m/s.
        let led = 0.05 * part + 0.1 * (1.0 - part);
        assert!((at(x).change - led).abs() < 1e-3, "{x}: led by {} not {led}", at(x).change);
    }
    // At rest all of the outputs' mean goes, beside what the bias takes.
    assert!((standing(0.0) - (-0.6 + 0.5 * end)).abs() < 1e-3);
    for x in [0.95, 1.0, 1.05, 2.0] {
        assert_eq!(standing(x), 0.0, "{x}");
    }
    // Not by an answer that is far off: 5 m/s fed back, of which 1.5 above the mean are put out.
    let parameters = Parameters { lambda: 1e-6, ..PARAMETERS };
    for x in [0.0, 0.5, 2.0] {
        let held = predict(&examples, dof::FORWARD, [x, 0.6, x], [0.001, 0.01], &parameters);
        let free = predict(&examples, dof::FORWARD, [x, 5.0, x], [0.001, 0.01], &parameters);
        assert!(free.y - held.y > 0.5, "{x}: the answer follows what is fed back, {} {}", free.y, held.y);
        let [held, free] = [held, free].map(|a| a.y + a.correction);
        assert!((held - free).abs() < 0.031, "{x}: {free} is put out, {held} without it");
    }
}
