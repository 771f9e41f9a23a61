//! Contacts against the generator's truth, found in each clip alone and carried over the canonical timeline.

use gestus_database::{
    registration::contact::{apply_majority, contacts},
    synth::{Options, corpus},
};
use gestus_motion::{corpus::Example, landmarks::Landmarks};

/// Harmonic mean of precision and recall over both feet, on frames inside of cycles.
fn f1(found: &[Example], truth: &[Example]) -> f64 {
    let (mut both, mut wrong) = (0.0, 0.0);
    for (f, t) in found.iter().zip(truth) {
        for cycle in &t.cycles {
            let (start, end) = cycle.span();
            for frame in start.ceil() as usize..(end as usize).min(f.contacts.len()) {
                for side in [0, 1] {
                    match (f.contacts[frame][side], t.contacts[frame][side]) {
                        (true, true) => both += 1.0,
                        (false, false) => {}
                        _ => wrong += 1.0,
                    }
                }
            }
        }
    }
    2.0 * both / (2.0 * both + wrong)
}

#[test]
fn the_canonical_timeline_knows_contacts_at_least_as_well_as_each_clip_does() {
    let actions = vec!["walk".to_owned(), "run".to_owned()];
    let styles = ["neutral", "old", "childlike"].map(String::from).to_vec();
    let truth = corpus(&Options { actions, styles, clips: 3, seconds: 10.0, ..Options::default() }).unwrap();
    let landmarks = Landmarks::find(&truth.skeleton).unwrap();
    let mut found = truth.examples.clone();
    for example in &mut found {
        example.contacts = contacts(&example.clip, &landmarks);
    }
    let alone = f1(&found, &truth.examples);
    apply_majority(&mut found);
    let carried = f1(&found, &truth.examples);
    println!("F1 of contacts: {alone:.4} in each clip alone, {carried:.4} over the canonical timeline");
    assert!(carried > alone - 0.005 && carried > 0.85, "{alone} {carried}");
}
