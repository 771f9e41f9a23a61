use super::*;

#[test]
fn log_undoes_exp() {
    for v in [[0.0, 0.0, 0.0], [1e-5, 0.0, -2e-5], [0.3, -0.2, 0.9], [-2.0, 1.0, 1.5], [0.0, 3.1, 0.0]] {
        let back = log(exp(v));
        for i in 0..3 {
            assert!((back[i] - v[i]).abs() < 2e-5, "{v:?} came back as {back:?}");
        }
    }
}

/// Rotation vectors of many directions, 0 to π long, in f64.
fn vectors() -> impl Iterator<Item = [f64; 3]> {
    (0..20_000_u32).map(|i| {
        let (turn, height) = (2.399_963 * f64::from(i), 1.0 - f64::from(i % 199) / 99.0);
        let flat = (1.0 - height * height).max(0.0).sqrt();
        let angle = core::f64::consts::PI * (f64::from(i) / 20_000.0).powi(2);
        [flat * turn.cos() * angle, height * angle, flat * turn.sin() * angle]
    })
}

fn exact([x, y, z]: [f64; 3]) -> [f64; 4] {
    let angle = (x * x + y * y + z * z).sqrt();
    let s = if angle > 0.0 { (0.5 * angle).sin() / angle } else { 0.5 };
    [x * s, y * s, z * s, (0.5 * angle).cos()]
}

#[test]
fn exponential_and_logarithm_agree_with_f64() {
    let off = |a: f64, b: f32| (a - f64::from(b)).abs();
    let (mut worst_exp, mut worst_log) = (0.0_f64, 0.0_f64);
    for v in vectors() {
        let single = v.map(|v| v as f32);
        // Of the vector as it is rounded: what is measured is the function.
        let q = exact(single.map(f64::from));
        for (exact, found) in q.into_iter().zip(exp(single)) {
            worst_exp = worst_exp.max(off(exact, found));
        }
        // As a sensor may send it, and from the other side.
        for length in [1.0, 1.009, 0.991, -1.0, 40.0] {
            let back = log(q.map(|v| (length * v) as f32));
            // At half a turn both ways are short.
            let sign = if back[0] * single[0] + back[1] * single[1] + back[2] * single[2] < 0.0 {
                -1.0
            } else {
                1.0
            };
            for (wanted, found) in v.into_iter().zip(back) {
                worst_log = worst_log.max(off(sign * wanted, found));
            }
        }
    }
    assert!(worst_exp < 1.5e-7, "{worst_exp}");
    assert!(worst_log < 7e-7, "{worst_log}");
}

#[test]
fn beyond_half_a_turn_the_exponential_goes_on() {
    // The squares of the last two have a sum beyond 63 bits in the fixed point of shorter ones.
    for v in [[3.0, 2.0, -1.5], [0.0, 9.0, 0.0], [-40.0, 3.0, 100.0], [3.5; 3], [3.99, -3.99, 3.99]] {
        for (wanted, found) in exact(v.map(f64::from)).into_iter().zip(exp(v)) {
            assert!((wanted - f64::from(found)).abs() < 1e-5, "{v:?}");
        }
    }
    // Even of what is no vector the turned rotation has a length.
    for stray in [1e9, f32::INFINITY, f32::NAN] {
        assert_eq!(turned(IDENTITY, [stray, 0.0, 0.0]), IDENTITY);
    }
}

#[test]
fn a_rotation_is_turned_by_what_lies_between() {
    for (i, v) in vectors().enumerate().filter(|(i, _)| i % 37 == 0) {
        let a = exp([0.3, 0.1 - i as f32 * 1e-4, -0.8]);
        let b = turned(a, v.map(|v| v as f32));
        assert!((squared(b) - 1.0).abs() < 3e-7);
        let back = between(a, b);
        assert!(angle(turned(a, back), b) < 1e-6);
    }
}

#[test]
fn slerp_goes_along_the_geodesic() {
    let (a, b) = (exp([0.4, 1.0, -0.3]), exp([-0.2, 0.1, 0.7]));
    let way = log(multiply(conjugate(a), b));
    for t in [0.0, 0.25, 0.5, 1.0, 1.6] {
        let expected = multiply(a, exp(way.map(|v| t * v)));
        for other in [b, b.map(|v| -v)] {
            assert!(angle(slerp(t, a, other), expected) < 1e-5, "{t}");
        }
    }
    assert!(angle(slerp(0.5, a, a), a) < 1e-6);
    let near = multiply(a, exp([1e-3, 0.0, 0.0]));
    assert!((angle(a, near) - 1e-3).abs() < 1e-6 && (angle(slerp(0.5, a, near), a) - 5e-4).abs() < 1e-6);
}

#[test]
fn rotating_by_a_product_is_rotating_twice() {
    let (a, b) = (exp([0.4, 1.0, -0.3]), exp([-1.2, 0.1, 0.7]));
    let v = [0.3, -1.0, 2.0];
    let once = rotate(multiply(a, b), v);
    let twice = rotate(a, rotate(b, v));
    for i in 0..3 {
        assert!((once[i] - twice[i]).abs() < 1e-5);
    }
}

#[test]
fn a_quarter_turn_about_y_takes_forward_to_left() {
    let v = rotate(about_y(core::f32::consts::FRAC_PI_2), [0.0, 0.0, 1.0]);
    assert!((v[0] - 1.0).abs() < 1e-6 && v[2].abs() < 1e-6);
}
