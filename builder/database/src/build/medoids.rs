//! k-medoids: the items that stand for all others best, by partitioning around medoids (Kaufman and Rousseeuw 1990, with
//! the exchange step of Schubert and Rousseeuw 2021, which tries all medoids at once).

/// Most exchanges; each makes the sum smaller.
const EXCHANGES: usize = 1000;

/// The `count` items with the smallest sum of distances from every item to its nearest one of them, ascending; all where
/// there are no more. `distances` is symmetric, shape `[n][n]`. The same input gives the same items.
pub(super) fn medoids(distances: &[Vec<f64>], count: usize) -> Vec<usize> {
    let n = distances.len();
    if count >= n {
        return (0..n).collect();
    }
    let mut chosen = greedy(distances, count);
    for _ in 0..EXCHANGES {
        let Some((slot, item)) = best_exchange(distances, &chosen) else { break };
        chosen[slot] = item;
    }
    chosen.sort_unstable();
    chosen
}

/// Takes one item after the other, each time the one that makes the sum smallest.
fn greedy(distances: &[Vec<f64>], count: usize) -> Vec<usize> {
    let n = distances.len();
    let mut nearest = vec![f64::INFINITY; n];
    let mut chosen = Vec::new();
    while chosen.len() < count {
        let sum = |x: usize| distances[x].iter().zip(&nearest).map(|(d, near)| d.min(*near)).sum::<f64>();
        let rest = (0..n).filter(|x| !chosen.contains(x));
        let Some((_, next)) = rest.map(|x| (sum(x), x)).min_by(|a, b| a.0.total_cmp(&b.0)) else { break };
        chosen.push(next);
        for (near, d) in nearest.iter_mut().zip(&distances[next]) {
            *near = near.min(*d);
        }
    }
    chosen
}

/// The exchange that lowers the sum most: a place in `chosen`, and the item that takes it.
fn best_exchange(distances: &[Vec<f64>], chosen: &[usize]) -> Option<(usize, usize)> {
    let n = distances.len();
    // Of every item: place of its nearest medoid, the distance to it, and that to the second.
    let near: Vec<(usize, f64, f64)> = (0..n)
        .map(|o| {
            let (mut first, mut second, mut place) = (f64::INFINITY, f64::INFINITY, 0);
            for (m, &c) in chosen.iter().enumerate() {
                let d = distances[o][c];
                if d < first {
                    (second, first, place) = (first, d, m);
                } else if d < second {
                    second = d;
                }
            }
            (place, first, second)
        })
        .collect();
    let mut best = (-1e-9, None);
    for x in (0..n).filter(|x| !chosen.contains(x)) {
        let mut kept = 0.0;
        let mut changes = vec![0.0; chosen.len()];
        for (o, &(place, first, second)) in near.iter().enumerate() {
            let d = distances[o][x];
            let gain = (d - first).min(0.0);
            kept += gain;
            changes[place] += d.min(second) - first - gain;
        }
        for (m, change) in changes.iter().enumerate() {
            if kept + change < best.0 {
                best = (kept + change, Some((m, x)));
            }
        }
    }
    best.1
}

#[cfg(test)]
mod tests {
    use super::*;

    fn line(places: &[f64]) -> Vec<Vec<f64>> {
        places.iter().map(|a| places.iter().map(|b| (a - b).abs()).collect()).collect()
    }

    #[test]
    fn each_cluster_has_its_middle() {
        let places = [0.0, 1.0, 2.0, 10.0, 11.0, 12.0, 30.0, 31.0, 32.0];
        assert_eq!(medoids(&line(&places), 3), [1, 4, 7]);
    }

    #[test]
    fn the_sum_is_the_least_of_all_choices() {
        let places = [0.3, 4.1, 2.2, 9.7, 5.5, 6.1, 0.9, 7.4];
        let distances = line(&places);
        let sum = |chosen: &[usize]| -> f64 {
            distances.iter().map(|d| chosen.iter().map(|&c| d[c]).fold(f64::INFINITY, f64::min)).sum()
        };
        let pairs = (0..8).flat_map(|a| (0..a).map(move |b| [b, a]));
        let least = pairs.map(|pair| sum(&pair)).fold(f64::INFINITY, f64::min);
        assert!((sum(&medoids(&distances, 2)) - least).abs() < 1e-12);
    }

    #[test]
    fn more_than_there_are_is_all() {
        assert_eq!(medoids(&line(&[1.0, 2.0]), 5), [0, 1]);
    }
}
