use super::*;
use crate::effort::sheet::{selected, sheet};
use crate::{
    build::{BuildOptions, build},
    effort::labels,
    synth,
};

fn corpus(actions: &[&str]) -> Corpus {
    synth::corpus(&synth::Options {
        actions: actions.iter().map(|a| (*a).to_owned()).collect(),
        styles: ["neutral", "angry"].map(String::from).to_vec(),
        clips: 2,
        seconds: 4.0,
        ..synth::Options::default()
    })
    .unwrap()
}

fn blob(corpus: &Corpus) -> Vec<u8> {
    build(corpus, &BuildOptions { models: false, ..BuildOptions::default() }).unwrap().bytes
}

fn cut(corpus: &mut Corpus, example: usize, frames: usize) {
    corpus.examples[example].clip.frames.truncate(frames);
}

/// `build` leaves out an action that lacks a style, but its name stays in the corpus: streaming its clips gave no output,
/// and so no dial for any action.
#[test]
fn an_action_that_is_left_out_costs_no_dial() {
    let mut corpus = corpus(&["walk", "run"]);
    corpus.examples.retain(|e| (e.action, e.style) != (1, 1));
    let bytes = blob(&corpus);
    let database = Database::open(&bytes).unwrap();
    let model = Model::of_database(&database).unwrap();
    let probe = Probe::of(&database, &corpus, &model, 0).unwrap();
    assert_eq!(probe.inputs.iter().map(|i| i.1).collect::<Vec<_>>(), [0, 0]);
    assert_eq!(solve(&database, &corpus, &model, 0).unwrap().unwrap().source, Source::Estimated);
    let mut one = model.clone();
    one.library.fragments.retain(|f| f.style == 0);
    assert_eq!(solve(&database, &corpus, &one, 0).unwrap(), Err(NoDial::Styles));
}

/// A clip of a few frames is not used, nor is one whose output is too short in a quick style.
#[test]
fn a_clip_that_is_too_short_costs_no_dial() {
    let mut corpus = corpus(&["walk"]);
    let bytes = blob(&corpus);
    let database = Database::open(&bytes).unwrap();
    let model = Model::of_database(&database).unwrap();
    let neutral = |corpus: &Corpus| -> Vec<usize> {
        (0..corpus.examples.len()).filter(|&i| corpus.examples[i].style == 0).collect()
    };
    let inputs = |corpus: &Corpus| {
        let mut probe = Probe::of(&database, corpus, &model, 0).unwrap();
        let before = probe.inputs.len();
        let seen = probe.rate_where_all_can(&[vec![1.0, 0.0], vec![0.0, 1.0]]);
        assert!(seen.iter().all(|s| s.len() == probe.inputs.len()));
        (before, probe.inputs.len())
    };
    assert_eq!(inputs(&corpus), (2, 2));
    let short = neutral(&corpus);
    // Angry walks are quicker: of as many frames as can be judged fewer come out.
    cut(&mut corpus, short[0], MIN_FRAMES);
    assert_eq!(inputs(&corpus), (2, 1));
    assert!(solve(&database, &corpus, &model, 0).unwrap().is_ok());
    cut(&mut corpus, short[0], MIN_FRAMES - 1);
    assert_eq!(inputs(&corpus), (1, 1));
    assert!(solve(&database, &corpus, &model, 0).unwrap().is_ok());
    (0..corpus.examples.len()).for_each(|i| cut(&mut corpus, i, MIN_FRAMES - 1));
    assert_eq!(solve(&database, &corpus, &model, 0).unwrap(), Err(NoDial::Short));
}

/// A table with enough labels for blends, but of too few fragments to learn people's ratings from: the dial is made
/// from estimates, and has to say so.
#[test]
fn a_dial_of_estimates_is_not_called_given() {
    let corpus = corpus(&["walk"]);
    let bytes = blob(&corpus);
    let database = Database::open(&bytes).unwrap();
    let source = |fragments: usize| {
        let library = selected(&Library::found(&corpus).unwrap(), fragments);
        let mut rows = labels::parse(sheet(&library, 60, 1).csv.as_bytes(), "s.csv", 30.0).unwrap();
        for (i, row) in rows.iter_mut().enumerate() {
            row.effort = Some([0.05 * i as f64 - 1.0, 1.0 - 0.05 * i as f64, 0.5]);
        }
        let model = Model::given(&rows, "s.csv", |s| Library::annotated(&corpus, s)).unwrap();
        assert_eq!((model.source, model.library.fragments.len()), (Source::Given, fragments));
        solve(&database, &corpus, &model, 0).unwrap().unwrap().source
    };
    assert_eq!(source(MIN_GIVEN - 1), Source::Estimated);
    assert_eq!(source(MIN_GIVEN), Source::Given);
}

#[test]
fn pools_are_the_nearest_ascending_values() {
    assert_eq!(isotonic(&[1.0, 3.0, 2.0, 4.0]), [1.0, 2.5, 2.5, 4.0]);
    assert_eq!(isotonic(&[3.0, 2.0, 1.0]), [2.0; 3]);
    // Of all ascending triples on a lattice none is nearer.
    let values = [0.4, 1.3, 0.2, 0.9];
    let off = |v: &[f64]| v.iter().zip(values).map(|(a, b)| (a - b) * (a - b)).sum::<f64>();
    let found = off(&isotonic(&values));
    for n in 0..16usize.pow(4) {
        let tried = [n / 4096, n / 256 % 16, n / 16 % 16, n % 16].map(|i| 0.1 * i as f64);
        if tried.windows(2).all(|w| w[0] <= w[1]) {
            assert!(found <= off(&tried) + 1e-9, "{tried:?}");
        }
    }
}

#[test]
fn a_sweep_ends_where_an_input_turns_back() {
    let seen = |a: [f64; 5], b: [f64; 5]| -> Vec<Vec<Factors>> {
        a.iter().zip(b).map(|(a, b)| vec![[0.0, *a, 0.0], [0.0, b, 0.0]]).collect()
    };
    let mixes: Vec<Vec<f64>> = (0..5).map(|i| vec![f64::from(i), 1.0 - f64::from(i)]).collect();
    let sweep = Sweep { mixes, seen: seen([0.0, 0.2, 0.5, 0.7, 0.9], [1.0, 1.3, 1.5, 1.0, 0.4]) };
    let found = reach(&sweep, 1, 1.0);
    assert_eq!(found.mixes.len(), 3, "{found:?}");
    assert!((found.gain() - 0.5).abs() < 1e-12, "{found:?}");
    // The other way round nothing is gained at the start, and nothing is reached.
    assert_eq!(reach(&sweep, 1, -1.0).mixes.len(), 1);
}

#[test]
fn ends_are_where_all_inputs_go_together() {
    // The third style moves weight most, but only for one of two inputs; the second for both.
    let vertices = vec![
        vec![[0.0, -0.5, 0.0], [0.0, -0.5, 0.0]],
        vec![[0.0, 0.8, 0.0], [0.0, 0.8, 0.0]],
        vec![[0.0, 2.4, 0.0], [0.0, -0.6, 0.0]],
    ];
    let middle = [[0.0, 0.9, 0.0], [0.0, -0.1, 0.0]];
    let ends = ends(&vertices, &middle);
    assert_eq!(ends.len(), 6 * UNEVEN.len());
    let up = &ends[3 * UNEVEN.len() + 1];
    assert!(up[1] > up[2] && up[1] > up[0], "{up:?}");
    let down = &ends[2 * UNEVEN.len()];
    assert!(down[0] > 0.5, "{down:?}");
}
