//! Registration of generated clips, whose timelines are known.

use gestus_database::{
    registration::{Performance, register, timeline::Kind},
    synth::{self, Options},
};
use gestus_motion::corpus::{Corpus, Cycle};

fn generated(actions: &[&str]) -> Corpus {
    let actions = actions.iter().map(|&a| a.to_owned()).collect();
    synth::corpus(&Options { seed: 5, clips: 2, seconds: 6.0, actions, ..Options::default() }).unwrap()
}

/// The same clips, registered by what they look like.
fn registered(truth: &Corpus, kind: Kind) -> Corpus {
    let performances = truth.examples.iter().map(|e| Performance {
        clip: e.clip.clone(),
        action: truth.actions[e.action].clone(),
        style: truth.styles[e.style].clone(),
        take: e.take.clone(),
        kind,
        licence: e.licence.clone(),
    });
    let (found, left_out) = register(performances.collect()).unwrap();
    assert!(left_out.is_empty());
    found
}

/// How far the found timelines put the moments of a clip in other clips of its take from where they are, and how far
/// they would be if time only ran faster: means over all styles, in frames.
fn apart(truth: &Corpus, found: &Corpus) -> [f64; 2] {
    const MOMENTS: usize = 20;
    let (mut sums, mut count) = ([0.0; 2], 0.0);
    for (a, fa) in truth.examples.iter().zip(&found.examples) {
        for (b, fb) in truth.examples.iter().zip(&found.examples) {
            if a.style == b.style || a.action != b.action || a.take != b.take {
                continue;
            }
            assert_eq!(
                [fa.cycles.len(), fb.cycles.len()],
                [a.cycles.len(), b.cycles.len()],
                "{}",
                a.clip.name
            );
            for c in 0..a.cycles.len() {
                let [from, to] = [a, b].map(|e| &e.cycles[c]);
                let ends = |cycle: &Cycle| Cycle { knots: vec![cycle.span().0, cycle.span().1] };
                let pairs = [[fa.cycles[c].clone(), fb.cycles[c].clone()], [from, to].map(ends)];
                for i in 0..MOMENTS {
                    let phase = i as f64 / MOMENTS as f64;
                    let at = from.position(phase);
                    for (sum, [from, other]) in sums.iter_mut().zip(&pairs) {
                        *sum += (other.position(from.phase(at)) - to.position(phase)).abs();
                    }
                    count += 1.0;
                }
            }
        }
    }
    sums.map(|s| s / count)
}

#[test]
fn whole_actions_of_all_styles_are_warped_onto_one_timeline() {
    let truth = generated(&["jump", "punch", "kick"]);
    let [error, linear] = apart(&truth, &registered(&truth, Kind::Whole));
    println!("acts: {error:.2} frames, {linear:.2} without a warp");
    assert!(error < 0.6 && error < 0.5 * linear, "{error:.2} frames, {linear:.2} without a warp");
}

/// A strike is where the feet are farthest apart, a moment before the heel comes down: the same moment in all clips.
#[test]
fn cycles_of_all_styles_are_set_into_correspondence() {
    let truth = generated(&["walk", "run"]);
    let [error, _] = apart(&truth, &registered(&truth, Kind::Gait));
    println!("gaits: {error:.2} frames");
    assert!(error < 0.7, "{error:.2} frames");
}
