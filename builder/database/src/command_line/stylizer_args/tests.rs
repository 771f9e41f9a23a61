//! Messages about options are compared by their words, which are what the user of a command reads.

use clap::Parser;

use super::*;
use crate::{
    build::{BuildOptions, build},
    list::ListError,
    synth,
};

#[derive(Parser)]
struct Line {
    #[command(flatten)]
    stylizer_args: StylizerArgs,
}

fn blob() -> Vec<u8> {
    blob_with(false, ["neutral", "proud"])
}

fn blob_with(models: bool, styles: [&str; 2]) -> Vec<u8> {
    let mut corpus = synth::corpus(&synth::Options::of(&["walk"], &["neutral", "proud"], 1, 4.0)).unwrap();
    corpus.styles = styles.map(str::to_owned).to_vec();
    build(&corpus, &BuildOptions { models, ..BuildOptions::default() }).unwrap().bytes
}

/// The request of those options.
fn asked(database: &Database<'_>, words: &str) -> std::result::Result<Request, String> {
    let words = ["gestus", "--style=proud"].into_iter().chain(words.split_whitespace());
    Line::parse_from(words).stylizer_args.request(database).map_err(|e| format!("{e:#}"))
}

/// Linear models have no neighbors and no ridge regression: options about those were ignored without a message.
#[test]
fn what_a_method_does_not_look_at_is_refused() {
    let blob = blob_with(true, ["neutral", "proud"]);
    let database = Database::open(&blob).unwrap();
    for method in ["lti", "statistic"] {
        for words in ["--mask left-arm", "--ridge norm"] {
            let message = asked(&database, &format!("--method {method} {words}")).unwrap_err();
            assert!(message.contains("does nothing without --method mar"), "{message}");
        }
        // The number of neighbors sets a board's memory, whatever the method.
        assert!(asked(&database, &format!("--method {method} --k 8 --speed-limit 2")).is_ok());
    }
    assert!(asked(&database, "--method phase --mask left-arm").is_ok());
    assert!(asked(&database, "--method phase --ridge norm").is_err());
}

#[test]
fn a_ridge_on_normalised_variables_keeps_the_weight_that_was_said() {
    let blob = blob();
    let database = Database::open(&blob).unwrap();
    for (words, lambda) in [
        ("--ridge norm", 1.0),
        ("--ridge norm --lambda 0.3", 0.3),
        ("--preset paper --ridge norm", 1.0),
        ("--preset normalised --ridge norm", 0.1),
        ("--preset normalised --ridge norm --lambda 2", 2.0),
    ] {
        let config = asked(&database, words).unwrap().config;
        assert_eq!((config.ridge, config.lambda), (Ridge::Normalised, lambda), "{words}");
    }
}

#[test]
fn a_name_is_looked_for_before_it_is_split() {
    let blob = blob_with(false, ["a,b=c", "d=1"]);
    let database = Database::open(&blob).unwrap();
    let ask = |words: &[&str]| {
        let words = ["gestus"].iter().chain(words).copied();
        Line::parse_from(words).stylizer_args.request(&database)
    };
    assert_eq!(ask(&["--style", "a,b=c"]).unwrap().style, [(0, 1.0)]);
    assert_eq!(ask(&["--style", "d=1=0.5"]).unwrap().style, [(1, 0.5)]);
    assert_eq!(ask(&["--style", "d=1"]).unwrap().style, [(1, 1.0)]);
    let error = ask(&["--style", "d=x"]).unwrap_err();
    assert!(matches!(error.downcast_ref(), Some(ListError::Value { value, .. }) if value == "x"), "{error}");
    assert_eq!(error.to_string(), "--style d=x");
}

#[test]
fn what_is_refused_is_named_with_its_value_and_its_range() {
    let blob = blob();
    let database = Database::open(&blob).unwrap();
    let ask = |words: &str| {
        let words = ["gestus", "--style=proud"].into_iter().chain(words.split_whitespace());
        Line::parse_from(words).stylizer_args.request(&database).map_err(|e| format!("{e:#}"))
    };
    for fine in [
        "",
        "--k 64 --visits 64 --rho 0 --speed-limit 0 --prune 0.5",
        "--timing bounded",
        "--timing bounded --lead 10 --lag 0",
        "--strength left-arm=2 --mask left-arm",
        "--group-style left-arm=proud:2+neutral:1",
    ] {
        assert!(ask(fine).is_ok(), "{fine}: {:?}", ask(fine).err());
    }
    let groups = database.manifest().unwrap().groups;
    let all = format!("--mask {}", groups.iter().collect::<Vec<_>>().join(","));
    for (words, said) in [
        ("--strength leg=1", "--strength leg=1: the database has no"),
        ("--strength left-arm=x", "--strength left-arm=x: left-arm is `x`, not"),
        ("--mask leg", "--mask leg: the database has no"),
        ("--group-style leg=proud", "--group-style leg=proud: the database has no"),
        ("--group-style left-arm=loud", "--group-style left-arm=loud: the database has no"),
        ("--strength left-arm=3", "--strength left-arm=3: from 0"),
        ("--strength left-arm=nan", "--strength left-arm=nan: from 0"),
        ("--visits 1", "--visits 1: from 64 to 448"),
        ("--k 0", "--k 0: from 1 to 64"),
        ("--k 100", "--k 100: from 1 to 64"),
        ("--rho nan", "--rho NaN: from 0 to 1"),
        ("--speed-limit 0.5", "--speed-limit 0.5: from 1 to 100, or 0 for none"),
        ("--timing bounded --lead 30", "--lead 30: seconds from 0 to 10"),
        (
            "--timing bounded --lead 10 --lag 10",
            "--lead 10 --lag 10: a lead of 10 s and a lag of 10 s together take",
        ),
        ("--group-style left-arm=proud:0", "all weights are 0"),
        ("--group-style left-arm=proud:nan", "a weight of NaN"),
        (&all, "nothing left to look at"),
        ("--lead 0.1", "--lead does nothing without --timing bounded"),
        ("--timing sync --lag 0.1", "--lag does nothing without --timing bounded"),
        ("--halflife 3", "--halflife does nothing without --method statistic"),
        ("--confidence 3", "--confidence does nothing without --method lti"),
        ("--preference 3", "--preference does nothing without --method lti"),
    ] {
        let message = ask(words).unwrap_err();
        assert!(message.contains(said), "{words}: {message}");
    }
}
