//! The effort dial on real clips. Skipped if they are missing, which fails with `CI=true`.

use gestus_database::build::BuildOptions;
use gestus_evaluate::{experiment::Experiment, measures::effort};
use gestus_tests::real_clips;

/// Each factor of the output follows the dial from end to end of its axis, on clips that are neither in the database nor in
/// the dial's data.
#[test]
fn each_factor_goes_with_its_knob_on_real_clips() {
    let styles = ["normal", "active", "elderly", "youthful"];
    let Some(corpus) = real_clips::corpus(&["walk", "run"], &styles) else { return };
    let build = BuildOptions { models: false, ..BuildOptions::default() };
    let evaluation = effort::evaluate(&Experiment::new(corpus, build), None, 1).unwrap();
    let dial: Vec<_> = evaluation.rows.iter().filter(|r| r["part"] == "dial").collect();
    assert_eq!(dial.len(), 6);
    for row in dial {
        let number = |key: &str| row[key].as_f64().unwrap();
        println!(
            "{} {}: {:.3}, {:.2} to {:.2} moved {:.2}",
            row["factor"],
            row["clip"],
            number("rank_correlation"),
            number("low"),
            number("high"),
            number("moved")
        );
        assert!(number("rank_correlation") >= 0.9 && number("moved") > 0.0, "{row:?}");
        assert_eq!(row["held_out"], true);
    }
}
