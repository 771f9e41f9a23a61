use super::*;

fn efforts() -> Vec<Option<Factors>> {
    vec![Some([0.0, 0.0, 0.0]), Some([-0.5, 1.8, 1.5]), None, Some([1.0, -1.2, -1.6]), Some([0.8, 0.9, -0.4])]
}

#[test]
fn styles_of_the_same_efforts_are_found() {
    let efforts = [[0.0, 1.0, 2.0], [0.5, 1.0, 2.0], [0.0, 1.0, 2.0002]];
    assert_eq!(alike(&efforts), [[0, 2]]);
}

/// A dial of three styles did the same at every setting, and the build said nothing.
#[test]
fn factors_that_no_knob_moves_are_named() {
    assert_eq!(narrow([(1.877, 1.927), (-0.2, 0.3), (0.0, 0.24)]), ["flow", "time"]);
    assert!(narrow([(-1.48, 1.8); 3]).is_empty());
}

#[test]
fn no_mix_on_a_fine_lattice_is_nearer() {
    let efforts: Vec<Factors> = efforts().into_iter().flatten().collect();
    let scales = [0.7, 0.3, 0.35];
    let uneven = DMatrix::from_fn(3, 4, |i, j| 0.1 * ((3 * i + 5 * j) % 4) as f64);
    let spread = uneven.tr_mul(&uneven);
    let misfit = |w: &[f64], e: &Factors| {
        let off = (0..3).map(|k| {
            (scales[k] * (efforts.iter().zip(w).map(|(s, w)| s[k] * w).sum::<f64>() - e[k])).powi(2)
        });
        let w = DVector::from_column_slice(w);
        off.sum::<f64>() + PENALTY * w.norm_squared() + (w.transpose() * &spread * &w)[0]
    };
    for target in [[0.2, 0.3, 0.1], [2.0, 2.0, 2.0], [-0.4, -1.0, 1.0]] {
        let found = misfit(&nearest(&efforts, &scales, &spread, &target), &target);
        for a in 0..=20 {
            for b in 0..=20 - a {
                for c in 0..=20 - a - b {
                    let w = [a, b, c, 20 - a - b - c].map(|v| f64::from(v) / 20.0);
                    assert!(found <= misfit(&w, &target) + 1e-6, "{target:?}: {w:?}");
                }
            }
        }
    }
}

/// The Effort of the mix at a node.
fn reached(dial: &Dial, node: usize) -> Factors {
    std::array::from_fn(|k| {
        let of = |(w, e): (&u8, &Option<Factors>)| f64::from(*w) / 255.0 * e.map_or(0.0, |e| e[k]);
        dial.table[node].iter().zip(&dial.styles).map(of).sum()
    })
}

/// The largest step from node to node of any factor against the direction of its axis, relative to its range.
fn backsteps(dial: &Dial) -> f64 {
    let mut worst = 0.0f64;
    for node in 0..dial.table.len() {
        for (k, stride) in [NODES.pow(2), NODES, 1].into_iter().enumerate() {
            if node / stride % NODES + 1 < NODES {
                let change = reached(dial, node + stride)[k] - reached(dial, node)[k];
                worst = worst.max(-change / (dial.axes[k].1 - dial.axes[k].0));
            }
        }
    }
    worst
}

/// The share of nodes that are reached within the core's tolerance: the part of the grid that the styles cover.
fn filled(dial: &Dial) -> f64 {
    let near = |node: &usize| {
        let (reached, wanted) = (reached(dial, *node), effort_at(&dial.axes, *node));
        (0..3).all(|k| {
            (reached[k] - wanted[k]).abs() <= f64::from(gestus_core::stylizer::effort_dial::TOLERANCE)
        })
    };
    (0..dial.table.len()).filter(near).count() as f64 / dial.table.len() as f64
}

#[test]
fn every_knob_moves_its_factor_and_never_back() {
    let dial = Dial::new(Source::Estimated, efforts(), 0);
    assert!(backsteps(&dial) < 0.01, "{}", backsteps(&dial));
    assert!(dial.table.iter().all(|w| w.iter().map(|b| u16::from(*b)).sum::<u16>() == 255 && w[2] == 0));
    assert!(filled(&dial) > 0.05 && filled(&dial) < 1.0, "{}", filled(&dial));
    assert_eq!(dial.rest, [0.0; 3]);
    for k in 0..3 {
        let stride = [NODES * NODES, NODES, 1][k];
        let middle = NODES * NODES * 4 + NODES * 4 + 4;
        let (low, high) = (middle - 4 * stride, middle + 4 * stride);
        assert!(reached(&dial, high)[k] > reached(&dial, low)[k] + 0.2, "{k}");
    }
}

/// Of three styles the first lowers flow and the second raises it; weight can only be raised; time not at all.
fn reaches() -> [[Reach; 2]; 3] {
    let even = [1.0 / 3.0; 3];
    let sweep = |end: [f64; 3], course: &[f64], factor: usize, sign: f64| {
        let last = (course.len() - 1) as f64;
        let mixes: Vec<Vec<f64>> = (0..course.len())
            .map(|i| even.iter().zip(end).map(|(c, e)| c + i as f64 / last * (e - c)).collect())
            .collect();
        let seen = |v: &f64| std::array::from_fn(|k| if k == factor { 0.5 + sign * v } else { 0.5 });
        Reach { course: course.to_vec(), seen: course.iter().map(seen).collect(), mixes }
    };
    let stay = || Reach { course: vec![0.0], mixes: vec![even.to_vec()], seen: vec![[0.5; 3]] };
    [
        [sweep([1.0, 0.0, 0.0], &[0.0, 0.4, 0.9], 0, -1.0), sweep([0.0, 1.0, 0.0], &[0.0, 0.1, 0.3], 0, 1.0)],
        [stay(), sweep([0.0, 0.0, 1.0], &[0.0, 0.0, 1.0, 2.0], 1, 1.0)],
        [stay(), stay()],
    ]
}

#[test]
fn measured_ways_are_the_lines_through_the_rest() {
    let dial = Dial::measured(Source::Estimated, &[Some([0.5; 3]); 3], [0.5; 3], &reaches());
    // Six nodes below for 0.9, two above for 0.3: 0.15 each. Eight above for 2.
    assert!((dial.axes[0].0 + 0.4).abs() < 1e-9 && (dial.axes[0].1 - 0.8).abs() < 1e-9, "{:?}", dial.axes);
    assert_eq!(dial.axes[1], (0.5, 2.5));
    assert!((dial.axes[2].1 - dial.axes[2].0 - MIN_AXIS).abs() < 1e-9);
    let node = |f: usize, w: usize, t: usize| (f * NODES + w) * NODES + t;
    let rest = node(6, 0, 4);
    assert!(dial.table[rest].iter().all(|&b| b == 85), "{:?}", dial.table[rest]);
    let mut before = 256u16;
    for f in 0..NODES {
        let first = u16::from(dial.table[node(f, 0, 4)][0]);
        assert!(first < before, "flow {f}");
        before = first;
    }
    assert_eq!(dial.table[node(0, 0, 4)], [255, 0, 0]);
    assert_eq!(dial.table[node(8, 0, 4)], [0, 255, 0]);
    assert_eq!(dial.table[node(6, 8, 4)], [0, 0, 255]);
    // A quarter of weight's change: 0.5 of 2, half way through the second of three steps.
    let third = f64::from(dial.table[node(6, 2, 4)][2]) / 255.0;
    assert!((third - (1.0 / 3.0 + 2.0 / 3.0 * 0.5)).abs() < 0.01, "{third}");
    // Time does nothing, and says so by being short.
    assert_eq!(dial.table[node(6, 0, 0)], dial.table[node(6, 0, 8)]);
    assert!(dial.table.iter().all(|w| w.iter().map(|b| u16::from(*b)).sum::<u16>() == 255));
}

#[test]
fn efforts_of_styles_come_from_blends_too() {
    let mix = |s: usize, t: usize, a: f64| {
        let mut w = vec![0.0; 3];
        w[s] += 1.0 - a;
        w[t] += a;
        w
    };
    let truth = [[1.0, 2.0, -1.0], [0.0, -1.0, 0.5], [2.0, 0.3, 0.7]];
    let samples: Vec<(Vec<f64>, Factors)> =
        [(0, 1, 0.3), (1, 2, 1.2), (2, 0, -0.2), (0, 2, 0.6), (1, 0, 0.5)]
            .map(|(s, t, a)| {
                (mix(s, t, a), std::array::from_fn(|k| (1.0 - a) * truth[s][k] + a * truth[t][k]))
            })
            .into();
    for (found, wanted) in fit(&samples, &[[0.0; 3]; 3]).iter().zip(truth) {
        assert!(found.iter().zip(wanted).all(|(f, w)| (f - w).abs() < 0.02), "{found:?}");
    }
}

/// Two styles that are no end of a sweep had the same Efforts, whatever they were seen as.
#[test]
fn styles_that_no_sample_tells_apart_are_what_they_were_seen_as_alone() {
    let alone = [[-1.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.5, 0.0], [0.0, 0.5, 0.4]];
    let samples: Vec<(Vec<f64>, Factors)> = [0.0, 0.5, 1.0]
        .into_iter()
        .flat_map(|t: f64| [0, 1].map(|end| (t, end)))
        .map(|(t, end)| {
            let mix: Vec<f64> = (0..4).map(|s| 0.25 * (1.0 - t) + if s == end { t } else { 0.0 }).collect();
            // The mix of the last two is seen as less than the mean of both.
            let rest = [0.0, 0.8, 0.2];
            let seen = std::array::from_fn(|k| {
                t * alone[end][k] + (1.0 - t) * 0.25 * (alone[0][k] + alone[1][k] + 2.0 * rest[k])
            });
            (mix, seen)
        })
        .collect();
    let found = fit(&samples, &alone);
    assert!(alike(&found).is_empty(), "{found:?}");
    for k in 0..3 {
        let apart = (found[2][k] - found[3][k]) - (alone[2][k] - alone[3][k]);
        let middle = 0.5 * (found[2][k] + found[3][k]) - [0.0, 0.8, 0.2][k];
        assert!(apart.abs() < 1e-9 && middle.abs() < 0.02, "{k}: {found:?}");
    }
}
