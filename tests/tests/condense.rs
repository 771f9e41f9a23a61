//! Databases of some of the cycles, and of a wanted size.

use std::collections::BTreeSet;

use gestus_core::Database;
use gestus_database::{
    build::{BuildError, BuildOptions, build},
    pairing::Scheme,
    stream::{Request, stream},
};
use gestus_tests::motion::{self, LARGE};

fn condensed(cycles: usize) -> Vec<u8> {
    let options = BuildOptions { cycles, ..BuildOptions::default() };
    build(&motion::corpus(LARGE), &options).unwrap().bytes
}

fn section(blob: &[u8], name: &str) -> Vec<u8> {
    let database = Database::open(blob).unwrap();
    let mut all = database.sections().into_iter().chain(database.optional_sections());
    let named = |id| gestus_core::blob::layout::section::name(id) == Some(name);
    all.find(|&(id, _)| named(id)).unwrap().1.to_vec()
}

#[test]
fn at_most_so_many_cycles_of_a_class_are_kept() {
    let full = Database::open(motion::large()).unwrap();
    for cycles in [1, 3] {
        let blob = condensed(cycles);
        let database = Database::open(&blob).unwrap();
        assert_eq!(database.counts().classes, full.counts().classes);
        for (class, before) in database.classes().zip(full.classes()) {
            assert_eq!((class.action, class.style), (before.action, before.style));
            assert_eq!(class.cycles, cycles, "of {}", before.cycles);
        }
        assert!(blob.len() < motion::large().len());
        assert_eq!(blob, condensed(cycles), "the same clips give the same bytes");
    }
}

#[test]
fn what_is_estimated_comes_from_all_cycles() {
    let blob = condensed(2);
    for name in ["skeleton", "dofs", "query", "timing", "lti", "statistic", "phase", "feet"] {
        assert!(section(&blob, name) == section(motion::large(), name), "{name}");
    }
}

#[test]
fn as_many_cycles_as_there_are_change_nothing() {
    let clips = |blob: &[u8]| section(blob, "clips");
    assert_eq!(clips(&condensed(1000)), clips(motion::large()));
    assert_eq!(section(&condensed(1000), "rows"), section(motion::large(), "rows"));
}

#[test]
fn stored_frames_are_those_of_the_clips() {
    let (blob, full) = (condensed(3), Database::open(motion::large()).unwrap());
    let database = Database::open(&blob).unwrap();
    let rows = |database: &Database<'_>| -> Vec<Vec<u32>> {
        let mut row = vec![0.0; database.counts().dofs];
        (0..database.counts().frames)
            .map(|r| {
                database.decode(r, &mut row);
                row.iter().map(|v| v.to_bits()).collect()
            })
            .collect()
    };
    let all: BTreeSet<Vec<u32>> = rows(&full).into_iter().collect();
    assert!(rows(&database).iter().all(|row| all.contains(row)));
}

#[test]
fn a_condensed_database_translates() {
    translates(&condensed(3), 0.02);
}

#[test]
fn a_database_without_a_graph_translates() {
    let blob = motion::without_graph(LARGE);
    assert!(section(&blob, "graph").is_empty());
    translates(&blob, 0.006);
}

/// The translation is at most so many metres from that of the whole database, in the mean.
fn translates(blob: &[u8], most_m: f64) {
    let database = Database::open(blob).unwrap();
    let full = Database::open(motion::large()).unwrap();
    for label in [None, Some(0)] {
        let request = Request { action: label, ..Request::style(2) };
        let clip = motion::unseen(0, 0, 90);
        let frames = stream(&database, &clip, &request, &mut ()).unwrap().frames();
        let wanted = stream(&full, &clip, &request, &mut ()).unwrap().frames();
        assert_eq!(frames.len(), clip.frames.len());
        let distance = |a: &gestus_motion::clip::Frame, b: &gestus_motion::clip::Frame| {
            let (a, b) = (a.positions(&clip.skeleton), b.positions(&clip.skeleton));
            let centred = |p: &[nalgebra::Vector3<f64>], j: usize| p[j] - p[0];
            (0..a.len()).map(|j| (centred(&a, j) - centred(&b, j)).norm()).sum::<f64>() / a.len() as f64
        };
        let mean = frames.iter().zip(&wanted).map(|(a, b)| distance(a, b)).sum::<f64>() / wanted.len() as f64;
        assert!(mean < most_m, "{mean} m from the translation of the whole database");
    }
}

#[test]
fn cycles_paired_by_take_are_kept_together() {
    let options = BuildOptions { cycles: 2, pairing: Scheme::Take, ..BuildOptions::default() };
    let blob = build(&motion::corpus(LARGE), &options).unwrap().bytes;
    let database = Database::open(&blob).unwrap();
    for class in database.classes() {
        assert_eq!(class.cycles, 2);
        assert!(class.searchable > 0);
    }
}

#[test]
fn prototypes_stay() {
    let options = BuildOptions { cycles: 2, pairing: Scheme::Mean, ..BuildOptions::default() };
    let built = build(&motion::corpus(LARGE), &options).unwrap();
    let database = Database::open(&built.bytes).unwrap();
    assert!(database.counts().rows > database.counts().frames);
}

#[test]
fn a_wanted_size_is_kept_and_its_choice_told() {
    let corpus = motion::corpus(LARGE);
    let fit = |bytes: usize| build(&corpus, &BuildOptions { bytes, ..BuildOptions::default() });
    let least = match fit(1).map(|_| ()) {
        Err(error @ BuildError::Size { wanted: 1, least }) => {
            assert!(error.to_string().contains(&least.to_string()), "{error}");
            least
        }
        other => panic!("{other:?}"),
    };
    let smallest = fit(least).unwrap();
    assert!(smallest.bytes.len() <= least);
    assert_eq!(smallest.choice.unwrap().cycles, 1);
    let middle = usize::midpoint(least, motion::large().len());
    let between = fit(middle).unwrap();
    assert!(between.bytes.len() <= middle && between.bytes.len() > least);
    assert!(!Database::open(&between.bytes).unwrap().has_graph());
    let choice = between.choice.unwrap();
    assert_eq!(Database::open(&between.bytes).unwrap().counts().features, choice.features);
    let whole = fit(10 * motion::large().len()).unwrap();
    assert_eq!(whole.choice.unwrap().cycles, 0, "all cycles have room");
    let cost = |choice: Option<gestus_database::build::Choice>| choice.unwrap().error_cost_percent.unwrap();
    assert!(cost(whole.choice) < 1.0 && cost(whole.choice) <= cost(smallest.choice));
}
