//! Registration of real gaits; skipped where the data is missing.

use std::path::{Path, PathBuf};

use gestus_database::data_folder::{config::Config, load::load};

/// The folder of real clips, where there is one.
fn data() -> Option<PathBuf> {
    let root = std::env::var_os("GESTUS_DATA")
        .map_or_else(|| Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared/data"), PathBuf::from);
    Some(root.join("bandai-namco-2")).filter(|p| p.is_dir())
}

#[test]
fn gaits_are_covered_by_plausible_cycles() {
    let Some(folder) = data() else {
        assert!(std::env::var("CI").as_deref() != Ok("true"), "real clips are missing");
        println!("skipped: real clips are missing (set GESTUS_DATA to their folder)");
        return;
    };
    let actions = ["walk", "run", "walk-turn-left", "walk-turn-right"].map(String::from).to_vec();
    let loaded = load(&Config { data: Some(folder), actions: actions.clone(), ..Config::default() }).unwrap();
    let corpus = &loaded.corpus;
    assert_eq!(corpus.actions, actions);
    for note in &loaded.notes {
        println!("{note}");
    }
    for (a, action) in corpus.actions.iter().enumerate() {
        for (s, style) in corpus.styles.iter().enumerate() {
            let clips: Vec<_> = corpus.examples.iter().filter(|e| e.action == a && e.style == s).collect();
            let frames: usize = clips.iter().map(|e| e.clip.frames.len()).sum();
            let cycles: Vec<_> = clips.iter().flat_map(|e| &e.cycles).collect();
            let covered: f64 = cycles.iter().map(|c| c.span().1 - c.span().0).sum();
            let share = covered / frames.max(1) as f64;
            let mut seconds: Vec<f64> =
                cycles.iter().map(|c| (c.span().1 - c.span().0) / corpus.rate_hz).collect();
            seconds.sort_by(f64::total_cmp);
            let standing: usize = clips.iter().flat_map(|e| &e.contacts).flatten().filter(|c| **c).count();
            let standing = standing as f64 / (2 * frames.max(1)) as f64;
            println!(
                "{action:16} {style:10} clips {:2} cycles {:3} covered {share:.2} seconds {:.2} {:.2} {:.2} standing {standing:.2}",
                clips.len(),
                cycles.len(),
                seconds.first().unwrap_or(&0.0),
                seconds.get(seconds.len() / 2).unwrap_or(&0.0),
                seconds.last().unwrap_or(&0.0),
            );
            assert!(share > 0.5, "{action} {style}: {share:.2} of the frames lie in cycles");
            let median = seconds[seconds.len() / 2];
            assert!((0.4..2.5).contains(&median), "{action} {style}: {median} s");
            for example in &clips {
                for cycle in &example.cycles {
                    assert!(cycle.knots.len() == 3 && cycle.knots.windows(2).all(|w| w[0] < w[1]));
                }
                assert!(example.cycles.windows(2).all(|w| w[0].span().1 <= w[1].span().0));
            }
        }
    }
}
