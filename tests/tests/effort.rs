//! Laban effort on generated motion: the dial reaches its targets on unseen motion, streams are segmented into the
//! fragments that they consist of, and kernels learn a nonlinear annotator better than linear regression.

use gestus_core::{Database, Effort, blob::layout::section};
use gestus_database::{
    blob::assemble::with_section,
    build::{BuildOptions, build},
    effort::{
        NAMES,
        estimate::Estimator,
        fragment::Library,
        learn::{Method, compare},
        model::Model,
        response,
        stage::segment,
    },
    stream::{Request, stream},
    synth,
};
use gestus_evaluate::measures::effort::annotated;
use gestus_motion::{body::row_at, corpus::Corpus, statistics::rank_correlation};

fn corpus(actions: &[&str], styles: &[&str], clips: usize) -> Corpus {
    let names = |n: &[&str]| n.iter().map(|n| (*n).to_owned()).collect();
    let (actions, styles) = (names(actions), names(styles));
    let options = synth::Options { actions, styles, clips, seconds: 6.0, ..synth::Options::default() };
    synth::corpus(&options).unwrap()
}

/// If one factor is turned from end to end of its axis, that factor of the output follows, on clips that are neither in the
/// database nor in the dial's data.
#[test]
fn each_factor_goes_with_its_knob() {
    let corpus = corpus(&["walk", "run"], &["neutral", "old", "childlike", "angry"], 3);
    let tests: Vec<usize> = (0..2)
        .map(|a| corpus.examples.iter().rposition(|e| (e.action, e.style) == (a, 0)).unwrap())
        .collect();
    let seen = corpus.without(&tests);
    let built = build(&seen, &BuildOptions { models: false, ..BuildOptions::default() }).unwrap();
    let dial = {
        let database = Database::open(&built.bytes).unwrap();
        let model = Model::of_database(&database).unwrap();
        response::solve(&database, &seen, &model, 0).unwrap().unwrap()
    };
    let blob = with_section(&built.bytes, section::EFFORT, &dial.section()).unwrap();
    let database = Database::open(&blob).unwrap();
    let library = Library::of_database(&database).unwrap();
    let estimator = Estimator::of(&library);
    let dial = database.dial().unwrap();
    let mut turned = 0;
    for (k, name) in NAMES.iter().enumerate() {
        let (low, high) = dial.range()[k];
        // An axis without length reports that the target is not reached.
        if high - low < 0.2 {
            continue;
        }
        turned += 1;
        for &test in &tests {
            let example = &corpus.examples[test];
            let asked: Vec<f64> = (0..7).map(|i| f64::from(low + (high - low) * i as f32 / 6.0)).collect();
            let got: Vec<f64> = asked
                .iter()
                .map(|&target| {
                    let mut factors = dial.rest().factors();
                    factors[k] = target as f32;
                    let (weights, _) = dial.weights(Effort::new(factors));
                    let style = (0..4).map(|s| (s as u16, weights[s])).collect();
                    let request = Request { style, ..Request::style(0) };
                    let out = stream(&database, &example.clip, &request, &mut ()).unwrap();
                    let (body, action) = (&library.body, Some(example.action));
                    estimator.stream(body, &out.frames(), &out.times(), library.rate_hz, action).unwrap()[k]
                })
                .collect();
            let rank = rank_correlation(&asked, &got);
            println!("{name} {}: {rank:.3} {asked:.2?} {got:.2?}", example.clip.name);
            assert!(rank >= 0.9, "{name} on {}: {rank} {asked:?} {got:?}", example.clip.name);
            assert!(got[6] - got[0] > 0.4 * (asked[6] - asked[0]), "{name}: {asked:?} {got:?}");
        }
    }
    assert!(turned >= 2, "no more than {turned} factors can be turned: {:?}", dial.range());
}

/// Streams made of fragments at other speeds, with noise on every angle: 98% of the frames find their action. (The steps of
/// a clip differ by less than the noise, so the step itself is not checked.)
#[test]
fn streams_are_cut_into_their_fragments() {
    let corpus = corpus(&["walk", "run", "punch", "kick", "jump"], &["neutral", "old"], 2);
    let library = Library::found(&corpus).unwrap();
    let words: Vec<&[Vec<f64>]> = library.fragments.iter().map(|f| f.content.as_slice()).collect();
    let mut random = 1u64;
    let mut chance = || {
        random = random.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (random >> 33) as f64 / (1u64 << 31) as f64
    };
    let (mut right, mut frames) = (0, 0);
    for _ in 0..6 {
        let (mut input, mut truth) = (Vec::new(), Vec::new());
        for _ in 0..8 {
            let word = (chance() * words.len() as f64) as usize;
            let pace = 0.8 + 0.45 * chance();
            let count = ((words[word].len() as f64 / pace) as usize).max(2);
            for i in 0..count {
                let at = (words[word].len() - 1) as f64 * i as f64 / (count - 1) as f64;
                let mut pose = row_at(words[word], at);
                pose.iter_mut().for_each(|v| *v += 0.06 * (chance() - 0.5));
                input.push(pose);
                truth.push(word);
            }
        }
        for snippet in segment(&input, &words) {
            let action = |w: usize| library.fragments[w].action;
            let own = |w: &&usize| action(**w) == action(snippet.fragment);
            right += truth[snippet.from..snippet.to].iter().filter(own).count();
        }
        frames += input.len();
    }
    let share = right as f64 / frames as f64;
    println!("{share:.4} of {frames} frames, {} fragments", words.len());
    assert!(share >= 0.98, "{share}");
}

/// Table 1 of Torresani 2006, with a fixed nonlinear function and noise as annotator. Over corpora that share neither motion
/// nor noise, kernel ridge and support vectors of pairs predict Weight and Time better than interpolation: by more than
/// three standard errors of the difference, and by at least a fifth. With `--release` it runs the paper's 500 splits.
#[test]
fn kernels_beat_lines_on_weight_and_time() {
    let (annotators, splits) = if cfg!(debug_assertions) { (6, 4) } else { (10, 50) };
    let errors = annotated(annotators, splits, &|| ()).unwrap();
    for (m, method) in Method::ALL.iter().enumerate() {
        for (k, name) in NAMES.iter().enumerate() {
            let of = |m: usize| errors.iter().map(|e| e[m][k]).collect::<Vec<f64>>();
            let (held, line) = (compare(&of(m), &of(0)), compare(&of(0), &of(0)));
            println!("{} {name}: {held:.3?}", method.name());
            if k > 0 && [Method::PairKernelRidge, Method::PairSupportVector].contains(method) {
                let error = held.gain_error.unwrap();
                assert!(held.gain > 3.0 * error, "{} {name}: {held:?}", method.name());
                assert!(held.mean < 0.8 * line.mean, "{} {name}: {held:?} {line:?}", method.name());
            }
        }
    }
}
