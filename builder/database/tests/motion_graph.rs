//! Motion graphs over generated clips.

use std::collections::BTreeSet;

use gestus_database::{
    motion_graph::{GraphError, MotionGraph, WalkOptions},
    search::features::{Cloud, FeatureSpace, clouds},
    synth::{self, Options},
};
use gestus_motion::{body::Body, corpus::Corpus, statistics::mean};
use nalgebra::Vector3;

fn corpus() -> Corpus {
    synth::corpus(&Options::of(&["walk", "run", "kick"], &["neutral", "old"], 2, 6.0)).unwrap()
}

#[test]
fn a_walk_visits_every_class_and_is_the_same_again() {
    let corpus = corpus();
    let graph = MotionGraph::of(&corpus).unwrap();
    let options = WalkOptions { seconds: 60.0, seed: 3, stay_s: 2.0 };
    let walk = graph.walk(&options);
    assert_eq!((walk.clip.frames.len(), walk.labels.len()), (1800, 1800));
    let seen: BTreeSet<(usize, usize)> = walk.labels.iter().map(|l| (l.action, l.style)).collect();
    assert_eq!(seen.len(), 6);
    assert_eq!(graph.walk(&options).clip.frames, walk.clip.frames);
    assert_ne!(graph.walk(&WalkOptions { seed: 4, ..options }).clip.frames, walk.clip.frames);
}

#[test]
fn frames_outside_of_blends_are_the_clips_and_nothing_jumps() {
    let corpus = corpus();
    let graph = MotionGraph::of(&corpus).unwrap();
    let walk = graph.walk(&WalkOptions { seconds: 40.0, seed: 1, stay_s: 1.5 });
    let positions: Vec<Vec<Vector3<f64>>> =
        walk.clip.frames.iter().map(|f| f.positions(&corpus.skeleton)).collect();
    let fastest = |frames: &[Vec<Vector3<f64>>]| {
        let step =
            |w: &[Vec<Vector3<f64>>]| w[0].iter().zip(&w[1]).map(|(a, b)| (a - b).norm()).fold(0.0, f64::max);
        frames.windows(2).map(step).fold(0.0, f64::max)
    };
    let of_clips = corpus.examples.iter().map(|e| {
        let frames: Vec<_> = e.clip.frames.iter().map(|f| f.positions(&corpus.skeleton)).collect();
        fastest(&frames)
    });
    let of_clips = of_clips.fold(0.0, f64::max);
    assert!(fastest(&positions) < 1.2 * of_clips, "{} {of_clips}", fastest(&positions));
    let mut same = 0;
    for (frame, label) in walk.clip.frames.iter().zip(&walk.labels).filter(|(_, l)| !l.blend) {
        let clip = &corpus.examples[label.clip].clip;
        // Local rotations are the clip's; the root turns with the walk.
        for (ours, theirs) in frame.rotations.iter().zip(&clip.frames[label.frame].rotations).skip(1) {
            assert!(ours.angle_to(theirs) < 1e-6);
        }
        same += 1;
    }
    assert!(same > walk.labels.len() / 2 && walk.transitions.len() > 5);
    // Transitions lie where clips agree best. Most go to another action or style, so they are not near: 16 cm a joint here,
    // where any two moments of two clips, many of one action, are 23 apart.
    let clouds: Vec<Vec<Cloud>> = corpus.examples.iter().map(|e| clouds(&e.clip, 5)).collect();
    let body = Body::of(&corpus).unwrap();
    let space = FeatureSpace::of(&body, &vec![0; body.skeleton.joints()], &clouds.concat(), 5, 32);
    let apart = |a: &Cloud, b: &Cloud| {
        space.feature(a).iter().zip(space.feature(b)).map(|(p, q)| (p - q).powi(2)).sum::<f64>()
    };
    let some = clouds.iter().zip(clouds.iter().cycle().skip(5));
    let any = mean(
        some.flat_map(|(a, b)| a.iter().zip(b).step_by(7).map(|(p, q)| apart(p, q)).collect::<Vec<_>>()),
    );
    let chosen = mean(walk.transitions.iter().map(|t| t.distance2));
    assert!(chosen < 0.75 * any, "{chosen} {any}");
}

#[test]
fn short_clips_are_refused_with_their_class() {
    let mut corpus = corpus();
    let (kick, old) = (corpus.action("kick").unwrap(), corpus.style("old").unwrap());
    for example in corpus.examples.iter_mut().filter(|e| (e.action, e.style) == (kick, old)) {
        example.clip.frames.truncate(12);
    }
    let error = MotionGraph::of(&corpus).err().unwrap();
    assert!(matches!(error, GraphError::Short { action, style, .. } if action == "kick" && style == "old"));
    let one = corpus.without(&(1..corpus.examples.len()).collect::<Vec<_>>());
    assert!(matches!(MotionGraph::of(&one), Err(GraphError::Few(1))));
}
