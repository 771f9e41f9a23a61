//! Time warps against a truth that is known.

use gestus_database::{
    registration::warp::{
        demo::{compare, drawn_pair, figure2, generated_pair, known_pair},
        imw::{Config, imw},
    },
    synth::STYLES,
};

/// Mean correspondence errors over seeds, in frames: DTW Type I, DTW Type III, IMW.
fn errors(style: f64, seeds: std::ops::Range<u64>) -> [f64; 3] {
    let count = (seeds.end - seeds.start) as f64;
    let mut sums = [0.0; 3];
    for seed in seeds {
        let pair = known_pair(seed, 120, 8, style);
        let warps = compare(&pair).unwrap();
        for (sum, (_, warp)) in sums.iter_mut().zip(&warps[1..]) {
            *sum += warp.mean_error(&pair.truth) / count;
        }
    }
    sums
}

#[test]
fn imw_has_at_most_a_third_of_the_error_of_dtw() {
    let [one, three, imw] = errors(1.0, 0..20);
    println!("mean correspondence error, frames: DTW I {one:.3}, DTW III {three:.3}, IMW {imw:.3}");
    assert!(imw <= one / 3.0, "IMW {imw:.3}, DTW Type I {one:.3}");
    assert!(imw <= three / 3.0, "IMW {imw:.3}, DTW Type III {three:.3}");
}

/// Mean correspondence errors over all styles and four contents of generated actions, in frames.
fn generated(actions: &[&str]) -> [f64; 3] {
    let mut sums = [0.0; 3];
    let mut count = 0.0;
    for action in actions {
        for style in STYLES.iter().filter(|s| **s != "neutral") {
            for content in 0..4 {
                let pair = generated_pair(content, action, style).unwrap();
                let warps = compare(&pair).unwrap();
                let errors = warps[1..].iter().map(|(_, warp)| warp.mean_error(&pair.truth));
                sums.iter_mut().zip(errors).for_each(|(sum, error)| *sum += error);
                count += 1.0;
            }
        }
    }
    sums.map(|s| s / count)
}

#[test]
fn imw_has_at_most_a_third_of_the_error_of_dtw_on_generated_acts() {
    let [one, three, imw] = generated(&["jump", "punch", "kick"]);
    println!("generated acts, frames: DTW I {one:.3}, DTW III {three:.3}, IMW {imw:.3}");
    assert!(imw <= one / 3.0, "IMW {imw:.3}, DTW Type I {one:.3}");
    assert!(imw <= three / 3.0, "IMW {imw:.3}, DTW Type III {three:.3}");
}

/// Cycles of a gait keep their rhythm in every style: there is little to find, and all are within a frame.
#[test]
fn imw_is_nearest_on_generated_gaits_too() {
    let [one, three, imw] = generated(&["walk", "run"]);
    println!("generated gaits, frames: DTW I {one:.3}, DTW III {three:.3}, IMW {imw:.3}");
    assert!(imw < 0.8 * one.min(three), "IMW {imw:.3}, DTW {one:.3} and {three:.3}");
    assert!(imw < 0.5, "IMW {imw:.3}");
}

#[test]
fn all_find_the_warp_where_only_time_differs() {
    for (name, error) in ["DTW I", "DTW III", "IMW"].iter().zip(errors(0.0, 0..5)) {
        assert!(error < 0.75, "{name}: {error:.3} frames");
    }
}

#[test]
fn the_objective_never_rises_and_the_slope_limit_holds() {
    for seed in 0..8 {
        let pair = known_pair(seed, 90, 5, 1.0);
        let solution = imw(&pair.u, &pair.y, &Config::default()).unwrap();
        assert!(
            solution.objective.windows(2).all(|w| w[1] <= w[0] * (1.0 + 1e-6)),
            "{:?}",
            solution.objective
        );
        assert!(solution.differential.iter().all(|w| (0.5..=2.0).contains(w)));
        assert!((solution.differential.iter().sum::<f64>() - 90.0).abs() < 1e-9);
        assert!(solution.warp.positions.windows(2).all(|w| w[0] < w[1]));
    }
}

#[test]
fn the_figure_has_a_curve_for_each_method() {
    let names: Vec<String> =
        figure2(&drawn_pair().unwrap()).unwrap().into_iter().map(|(name, _)| name).collect();
    assert_eq!(names.len(), 6);
    assert!(names.iter().any(|n| n.ends_with("IMW")));
}
