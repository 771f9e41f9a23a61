//! Criterion's timing of the methods that need no frames, on generated motion, each beside a slower way of its own in
//! the same run, so that a loaded machine shows in both:
//!
//! | group | what | held against |
//! |---|---|---|
//! | `correspond` | iterative motion warping of 427 and 400 frames (the statistical-transfer paper: 900 ms) | dynamic time warping, Type I, of the same |
//! | `transfer` | statistics and transfer of those (the statistical-transfer paper: 21 ms) | the paper's own order, every frame through the warp and back |
//! | `lti-step` | a step of a linear model in the core (Hsu 2005: 10,000 a second) | the same model simulated by matrices in `f64` |
//!
//! `RAYON_NUM_THREADS=1 cargo bench -p gestus-database --bench models`; `-- --save-baseline before`, and later
//! `-- --baseline before`, hold two versions against each other.

#![allow(missing_docs, reason = "criterion's macros write functions without any")]

use std::{hint::black_box, time::Duration};

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use gestus_core::{Config, Database, Method, Pose, Stylizer};
use gestus_database::{
    build::{BuildOptions, build},
    models::{
        lti::{Model, clip},
        statistic::transfer::{Options, Transferred, transfer},
    },
    registration::warp::dtw::{Constraint, dtw},
    stream::to_pose,
    synth,
};
use gestus_motion::{body::Body, clip::Clip, corpus::Corpus};

/// Frames of the clips that the statistical-transfer paper reports on.
const FRAMES: [usize; 2] = [427, 400];

/// Generated walks: the neutral one and the old one.
fn walks() -> (Corpus, [Clip; 2]) {
    let options = synth::Options {
        actions: vec!["walk".into()],
        styles: ["neutral", "old"].map(String::from).to_vec(),
        clips: 3,
        seconds: 18.0,
        ..synth::Options::default()
    };
    let corpus = synth::corpus(&options).expect("the generator knows these names");
    let clips = [0, 1].map(|style| {
        let example = corpus.examples.iter().find(|e| e.style == style).expect("a clip of each style");
        let mut clip = example.clip.clone();
        assert!(clip.frames.len() >= FRAMES[style], "{} frames", clip.frames.len());
        clip.frames.truncate(FRAMES[style]);
        clip
    });
    (corpus, clips)
}

/// Times a part of a transfer by what it says of itself.
fn part(
    criterion: &mut Criterion,
    group: &str,
    name: &str,
    options: &Options,
    milliseconds: fn(&Transferred) -> f64,
) {
    let (corpus, [source, reference]) = walks();
    let body = Body::of(&corpus).expect("the generated body has legs");
    criterion.benchmark_group(group).sample_size(20).bench_function(name, |bencher| {
        bencher.iter_custom(|count| {
            (0..count)
                .map(|_| transfer(&body, &source, &reference, options).expect("both clips have frames"))
                .map(|out| Duration::from_secs_f64(1e-3 * milliseconds(&out)))
                .sum()
        });
    });
}

fn statistic(criterion: &mut Criterion) {
    let plain = Options { clean_up: false, ..Options::default() };
    part(criterion, "correspond", "iterative motion warping", &plain, |o| o.warp_ms);
    let (corpus, [source, reference]) = walks();
    let body = Body::of(&corpus).expect("the generated body has legs");
    let (x, y) = (body.clip_dofs(&source), body.clip_dofs(&reference));
    criterion.benchmark_group("correspond").sample_size(20).bench_function(
        "dynamic time warping",
        |bencher| {
            bencher.iter(|| black_box(dtw(black_box(&x), black_box(&y), Constraint::TypeI)));
        },
    );
    part(criterion, "transfer", "frames where they are", &plain, |o| o.transfer_ms);
    let literal = Options { literal: true, ..plain };
    part(criterion, "transfer", "through the warp and back", &literal, |o| o.transfer_ms);
}

fn linear(criterion: &mut Criterion) {
    let (corpus, [source, _]) = walks();
    let built = build(&corpus, &BuildOptions { from: Some("neutral".into()), ..BuildOptions::default() })
        .expect("generated walks make a database");
    let database = Database::open(&built.bytes).expect("the builder's blob opens");
    let mut group = criterion.benchmark_group("lti-step");
    group.throughput(Throughput::Elements(source.frames.len() as u64)).sample_size(20);
    let poses: Vec<Pose<22>> = source.frames.iter().map(to_pose::<22>).collect();
    for (name, method) in [("linear model", Method::Lti), ("statistics", Method::Statistic)] {
        let config = Config::new().method(method);
        let mut stylizer =
            Box::new(Stylizer::<22, 40, 28>::new(database, config).expect("the profile holds the database"));
        stylizer.set_style(&[(1, 1.0)]).expect("there are two styles");
        let mut output = Pose::IDENTITY;
        group.bench_function(name, |bencher| {
            bencher.iter(|| {
                for pose in &poses {
                    let _ = black_box(stylizer.step(black_box(pose), &mut output));
                }
            });
        });
    }
    let index = database.linear_model_of(1, None).expect("the database has a linear model");
    let model = Model::of(&database, index);
    let rows =
        Body::of(&corpus).expect("the generated body has legs").with_means_of(&database).clip_dofs(&source);
    let options = clip::Options { generalise: Some((5.0, 8.0)), ..clip::Options::default() };
    group.bench_function("by matrices, f64, no poses", |bencher| {
        bencher.iter(|| black_box(model.translate(black_box(&rows), &options)));
    });
    group.finish();
}

criterion_group!(benches, statistic, linear);
criterion_main!(benches);
