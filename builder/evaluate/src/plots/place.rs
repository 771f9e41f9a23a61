//! Placement of point labels without overlap.

use std::ops::Range;

/// Width of a label of two digits with a margin; its height is [`TALL`].
pub(super) const WIDE: i32 = 17;
const TALL: i32 = 13;
/// Half of a point's width.
const POINT: i32 = 6;

/// The centre of each point's label, pixels: the nearest free place, or the last one tried where none is free.
pub(super) fn labels(points: &[(i32, i32)], across: Range<i32>, down: Range<i32>) -> Vec<(i32, i32)> {
    let mut taken: Vec<(i32, i32)> = Vec::new();
    for &(x, y) in points {
        let mut place = (x, y);
        let free = |(a, b): (i32, i32)| {
            let inside = across.contains(&(a - WIDE / 2))
                && across.contains(&(a + WIDE / 2))
                && down.contains(&(b - TALL / 2))
                && down.contains(&(b + TALL / 2));
            let clear =
                |&(c, d): &(i32, i32), wide: i32, tall: i32| (a - c).abs() >= wide || (b - d).abs() >= tall;
            inside
                && taken.iter().all(|t| clear(t, WIDE, TALL))
                && points.iter().all(|p| clear(p, WIDE / 2 + POINT, TALL / 2 + POINT))
        };
        // Rings around the point, wider and wider, from its upper right on.
        'rings: for radius in (14..240).step_by(5) {
            for step in 0..16 {
                let angle = f64::from(step) * std::f64::consts::TAU / 16.0 + 0.7;
                let (dx, dy) = (angle.cos() * f64::from(radius), -angle.sin() * f64::from(radius));
                place = (x + dx as i32, y + dy as i32);
                if free(place) {
                    break 'rings;
                }
            }
        }
        taken.push(place);
    }
    taken
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_label_lies_on_another_or_on_a_point() {
        // A crowd, as the variants of one parameter are.
        let points: Vec<(i32, i32)> = (0..40).map(|i| (300 + 7 * (i % 6), 200 + 5 * (i / 6))).collect();
        let places = labels(&points, 0..800, 0..480);
        for (i, a) in places.iter().enumerate() {
            let clear =
                |b: &(i32, i32), wide: i32, tall: i32| (a.0 - b.0).abs() >= wide || (a.1 - b.1).abs() >= tall;
            assert!(places[..i].iter().all(|b| clear(b, WIDE, TALL)), "label {i}");
            assert!(points.iter().all(|b| clear(b, WIDE / 2, TALL / 2)), "label {i}");
        }
    }
}
