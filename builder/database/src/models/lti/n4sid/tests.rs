use super::*;
use rand::{Rng, SeedableRng};

/// The outputs from `x = 0`. Shape `[p x frames]`.
fn simulate(system: &System, u: &DMatrix<f64>) -> DMatrix<f64> {
    let states = system.states(u);
    let mut y = &system.d * u;
    for t in 1..u.ncols() {
        let add = &system.c * states.column(t - 1);
        let mut column = y.column_mut(t);
        column += add;
    }
    y
}

/// A system with known poles, and what it makes of noise.
fn known(n: usize) -> (System, Vec<Signal>) {
    let a = match n {
        1 => DMatrix::from_row_slice(1, 1, &[0.7]),
        2 => DMatrix::from_row_slice(2, 2, &[0.6, -0.5, 0.5, 0.6]),
        _ => DMatrix::from_row_slice(
            4,
            4,
            &[0.8, -0.3, 0.1, 0.0, 0.3, 0.8, 0.0, 0.2, 0.0, 0.0, 0.5, 0.1, 0.0, 0.0, 0.0, -0.4],
        ),
    };
    let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(n as u64);
    let mut matrix = |r: usize, c: usize| DMatrix::from_fn(r, c, |_, _| rng.random::<f64>() * 2.0 - 1.0);
    let system = System { a, b: matrix(n, 3), c: matrix(3, n), d: matrix(3, 3) };
    let signals = [300, 211, 90].map(|frames| {
        let u = matrix(3, frames);
        Signal { y: simulate(&system, &u), u }
    });
    (system, signals.into())
}

fn sorted(system: &System) -> Vec<Complex<f64>> {
    let mut poles = system.poles();
    poles.sort_by(|a, b| a.re.total_cmp(&b.re).then(a.im.total_cmp(&b.im)));
    poles
}

const EXACT: Options = Options {
    horizon: 8,
    order: None,
    most: 8,
    noise: 1e-11,
    stability: Stability::Within(0.999),
    rounds: 0,
};

#[test]
fn a_known_system_comes_back() {
    for n in [1, 2, 4] {
        let (truth, signals) = known(n);
        let found = estimate(&signals, 20, &EXACT).unwrap();
        assert_eq!(found.order(), n);
        for (a, b) in sorted(&found).iter().zip(sorted(&truth)) {
            assert!((a - b).norm() < 1e-4, "pole {a} for {b}");
        }
        // States are known up to a change of basis; what the system does is not.
        let error = (simulate(&found, &signals[0].u) - &signals[0].y).abs().max();
        assert!(error < 1e-3, "order {n}: {error}");
    }
}

/// Measurement noise of a tenth: the order and the poles are still about right.
#[test]
fn noise_does_not_hide_the_system() {
    let (truth, mut signals) = known(2);
    let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(9);
    for signal in &mut signals {
        signal.y.iter_mut().for_each(|y| *y += 0.1 * (rng.random::<f64>() - 0.5));
    }
    let options = Options { order: Some(2), noise: 1e-6, rounds: 3, ..EXACT };
    let found = estimate(&signals, 20, &options).unwrap();
    for (a, b) in sorted(&found).iter().zip(sorted(&truth)) {
        assert!((a - b).norm() < 0.03, "pole {a} for {b}");
    }
    // The refined fit is no worse than the plain one.
    let plain = estimate(&signals, 20, &Options { rounds: 0, ..options }).unwrap();
    let error = |s: &System| {
        let y = simulate(s, &signals[0].u);
        (y - &signals[0].y).columns(20, 200).norm()
    };
    assert!(error(&found) <= error(&plain) * 1.001);
}

#[test]
fn poles_are_brought_inside() {
    let mut a = DMatrix::from_row_slice(
        4,
        4,
        &[1.2, -0.9, 0.3, 0.1, 0.9, 1.2, 0.0, 0.7, 0.0, 0.0, 0.5, 0.1, 0.0, 0.0, 0.0, -1.01],
    );
    let before = a.complex_eigenvalues();
    stabilise(&mut a, 0.97);
    let after = a.complex_eigenvalues();
    assert!(after.iter().all(|e| e.norm() < 0.97 + 1e-9), "{after}");
    // The pole that was inside stays.
    assert!(before.iter().any(|e| (e.re - 0.5).abs() < 1e-9));
    assert!(after.iter().any(|e| (e.re - 0.5).abs() < 1e-9), "{after}");
}

/// A system that grows by a twentieth each frame. A shift with a zero block behind it can't.
#[test]
fn a_growing_system_becomes_stable() {
    let (mut truth, signals) = known(2);
    truth.a *= 1.35;
    let grown = |signal: &Signal| {
        let u = signal.u.columns(0, 60).into_owned();
        Signal { y: simulate(&truth, &u), u }
    };
    let signals: Vec<Signal> = signals.iter().map(grown).collect();
    let outermost = |stability| {
        let found = estimate(&signals, 20, &Options { order: Some(2), stability, ..EXACT }).unwrap();
        found.poles().iter().map(|p| p.norm()).fold(0.0, f64::max)
    };
    let (free, stable) = (outermost(Stability::Within(f64::INFINITY)), outermost(Stability::Guaranteed));
    assert!(free > 1.04 && stable < 1.0, "{free} {stable}");
}

#[test]
fn stretches_that_are_too_short_give_nothing() {
    let signal = Signal { u: DMatrix::zeros(3, 3), y: DMatrix::zeros(3, 3) };
    assert!(estimate(&[signal], 1, &Options::default()).is_none());
    assert!(estimate(&[], 1, &Options::default()).is_none());
}
