//! Minimisation by L-BFGS.

use gestus_motion::statistics::dot;

/// Minimises a function by L-BFGS (Nocedal 1980) with backtracking, and gives the least value too. The function returns
/// its value and its gradient, or `None` where it is not defined.
pub(super) fn minimise(
    mut at: Vec<f64>,
    evaluations: usize,
    f: impl Fn(&[f64]) -> Option<(f64, Vec<f64>)>,
) -> (Vec<f64>, f64) {
    let Some((mut value, mut gradient)) = f(&at) else { return (at, f64::INFINITY) };
    let mut memory: Vec<(Vec<f64>, Vec<f64>)> = Vec::new();
    let mut used = 1;
    while used < evaluations && dot(&gradient, &gradient) > 1e-10 {
        // The two-loop recursion (Nocedal).
        let mut direction = gradient.clone();
        let mut shares = Vec::new();
        for (s, y) in memory.iter().rev() {
            let share = dot(s, &direction) / dot(s, y);
            direction.iter_mut().zip(y).for_each(|(d, y)| *d -= share * y);
            shares.push(share);
        }
        let scale = memory
            .last()
            .map_or(0.3 / dot(&gradient, &gradient).sqrt().max(1e-12), |(s, y)| dot(s, y) / dot(y, y));
        direction.iter_mut().for_each(|d| *d *= scale);
        for ((s, y), share) in memory.iter().zip(shares.iter().rev()) {
            let back = dot(y, &direction) / dot(s, y);
            direction.iter_mut().zip(s).for_each(|(d, s)| *d += (share - back) * s);
        }
        let downhill = dot(&direction, &gradient);
        let mut step = 1.0;
        let found = loop {
            // Hyperparameters are logarithms: no step of more than a factor of e² at once.
            let longest = direction.iter().fold(0.0f64, |a, d| a.max((step * d).abs()));
            let held = if longest > 2.0 { step * 2.0 / longest } else { step };
            let next: Vec<f64> = at.iter().zip(&direction).map(|(a, d)| a - held * d).collect();
            used += 1;
            match f(&next) {
                Some((v, g)) if v <= value - 1e-4 * held * downhill => break Some((next, v, g)),
                _ if used >= evaluations || step < 1e-6 => break None,
                _ => step *= 0.4,
            }
        };
        let Some((next, v, g)) = found else { break };
        let s: Vec<f64> = next.iter().zip(&at).map(|(a, b)| a - b).collect();
        let y: Vec<f64> = g.iter().zip(&gradient).map(|(a, b)| a - b).collect();
        if dot(&s, &y) > 1e-12 {
            memory.push((s, y));
            if memory.len() > 8 {
                memory.remove(0);
            }
        }
        let gained = value - v;
        (at, value, gradient) = (next, v, g);
        if gained < 1e-7 {
            break;
        }
    }
    (at, value)
}
