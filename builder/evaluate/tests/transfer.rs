//! A transfer of statistics keeps standing feet in place.

use gestus_database::{
    models::statistic::transfer::{Options, transfer},
    stream::cleanup::Limbs,
    synth,
};
use gestus_evaluate::metrics::{feet::skate_cm_s, performance::Performance, speed::peak_speeds};
use gestus_motion::body::Body;

#[test]
fn feet_that_stand_in_the_source_stand_in_the_result() {
    let corpus = synth::corpus(&synth::Options::of(&["walk"], &["neutral", "proud"], 1, 4.0)).unwrap();
    let body = Body::of(&corpus).unwrap();
    let [source, reference] = [0, 1].map(|style| corpus.examples[style].clip.clone());
    let go = |clean_up: bool| {
        let out = transfer(&body, &source, &reference, &Options { clean_up, ..Options::default() }).unwrap();
        let (limbs, stands) = Limbs::of_clip(&body, &source).unwrap();
        assert_eq!(out.contacts, stands);
        let steps_s = vec![1.0 / source.rate_hz; source.frames.len()];
        let performance = Performance { frames: out.clip.frames.clone(), steps_s, stands };
        (skate_cm_s(&body.skeleton, limbs.legs(), &performance), performance)
    };
    let ((raw, before), (cleaned, after)) = (go(false), go(true));
    println!("transfer: skate {raw:.1} -> {cleaned:.2} cm/s");
    assert!(raw > 3.0 && cleaned <= 1.0, "{raw} -> {cleaned}");
    // Legs alone are moved.
    let marks = &body.landmarks;
    let legs = [marks.hip_joints, marks.knees, marks.feet].concat();
    for (a, b) in before.frames.iter().zip(&after.frames) {
        for j in (0..a.rotations.len()).filter(|j| !legs.contains(j)) {
            assert!(a.rotations[j].angle_to(&b.rotations[j]) < 1e-5, "joint {j}");
        }
    }
    let peak = |p: &Performance| peak_speeds(p).into_iter().fold(0.0, f64::max);
    // Whole plants move to their mean places: 1.31 here, 7.3 to 9.6 rad/s.
    assert!(peak(&after) <= 1.35 * peak(&before), "{} {}", peak(&before), peak(&after));
}
