//! Linear models and statistics on real clips. Skipped if they are missing, which fails with `CI=true`.

use gestus_core::{Config, Database, Method};
use gestus_database::{
    build::{BuildOptions, build},
    stream::{Request, stream},
};
use gestus_evaluate::{
    experiment::Experiment,
    measures::loo::{self, Methods},
};
use gestus_motion::{clip::Clip, corpus::Corpus};
use gestus_tests::real_clips;

fn corpus() -> Option<Corpus> {
    real_clips::corpus(&["walk"], &["normal", "active", "elderly"])
}

/// On walk a linear model is nearer to the truth than the best affine map of each dof.
#[test]
fn linear_models_beat_the_affine_map_on_walk() {
    let Some(corpus) = corpus() else { return };
    let experiment = Experiment { folds: 2, ..Experiment::new(corpus, BuildOptions::default()) };
    let methods = Methods { configs: Vec::new(), ..Methods::default() };
    let rows = loo::run(&experiment, &methods, &|| ()).unwrap();
    let mean = |method: &str| {
        let of: Vec<f64> = rows.iter().filter(|r| r.method == method).map(|r| r.predicted.error_cm).collect();
        assert_eq!(of.len(), 4, "{method}");
        of.iter().sum::<f64>() / 4.0
    };
    let (lti, affine, statistic) = (mean("lti"), mean("global-affine"), mean("statistic"));
    println!(
        "lti {lti:.2} cm, affine {affine:.2}, statistic {statistic:.2}, unchanged {:.2}",
        mean("unchanged")
    );
    assert!(lti < affine, "{lti} {affine}");
    assert!(statistic < mean("unchanged"));
}

/// A minute of walk: the last lap equals the third, pose by pose. An estimate takes seconds.
#[test]
fn linear_models_are_stable() {
    let Some(corpus) = corpus() else { return };
    let start = std::time::Instant::now();
    let built = build(&corpus, &BuildOptions::default()).unwrap();
    let seconds = start.elapsed().as_secs_f64();
    println!("two styles estimated, and a database built, in {seconds:.1} s");
    let database = Database::open(&built.bytes).unwrap();
    let example = corpus.examples.iter().find(|e| corpus.styles[e.style] == "normal").unwrap();
    let lap = &example.clip.frames;
    let laps = 1800 / lap.len() + 4;
    let frames = (0..laps).flat_map(|_| lap.iter().cloned()).collect();
    let clip = Clip { frames, ..example.clip.clone() };
    let elderly = corpus.styles.iter().position(|s| s == "elderly").unwrap();
    // After the leap at the seam joints are held to a speed, and their way in a frame depends on its time, which oscillates.
    let config = Config::new().method(Method::Lti).speed_limit(0.0);
    let request = Request { config, ..Request::style(elderly as u16) };
    let steps = stream(&database, &clip, &request, &mut ()).unwrap().steps;
    for t in 0..lap.len() {
        let (third, last) = (&steps[2 * lap.len() + t], &steps[(laps - 1) * lap.len() + t]);
        for (a, b) in third.frame.rotations.iter().zip(&last.frame.rotations).skip(1) {
            assert!(a.angle_to(b) < 1e-3, "frame {t}: {}", a.angle_to(b));
        }
        // The seam of the loop is a leap, after which the linear models' time oscillates for most of a second.
        let ratio = last.report.step_s * database.rate_hz();
        assert!(t < 30 || (0.5..2.0).contains(&ratio), "frame {t}: {ratio}");
    }
}
