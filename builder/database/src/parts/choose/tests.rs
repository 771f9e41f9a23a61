use std::sync::OnceLock;

use super::*;
use crate::{
    build::{BuildOptions, build},
    parts::{estimate::CODE_BYTES, names, table::External},
    synth,
};

fn corpus() -> &'static Corpus {
    static CORPUS: OnceLock<Corpus> = OnceLock::new();
    CORPUS.get_or_init(|| {
        synth::corpus(&synth::Options::of(&["walk", "run"], &["neutral", "proud"], 2, 5.0)).unwrap()
    })
}

fn samples() -> Vec<Sample<'static>> {
    Sample::of(corpus(), corpus().plain_style())
}

/// With so few features, the smallest database with frames is larger than the models.
fn options(bytes: usize) -> BuildOptions {
    BuildOptions { bytes, features: 12, ..BuildOptions::default() }
}

/// The whole database, which is built once.
fn whole() -> &'static [u8] {
    static WHOLE: OnceLock<Vec<u8>> = OnceLock::new();
    WHOLE.get_or_init(|| build(corpus(), &options(0)).unwrap().bytes)
}

fn built(bytes: usize) -> anyhow::Result<Built> {
    if bytes == 0 {
        return Ok(Built { bytes: whole().to_vec(), notes: Vec::new(), choice: None });
    }
    Ok(build(corpus(), &options(bytes))?)
}

/// A part like that of a name, changed.
fn part_like(name: &str, change: impl Fn(&mut Part)) -> &'static Part {
    let mut part = *names::find(name).unwrap();
    change(&mut part);
    Box::leak(Box::new(part))
}

fn wanted(part: &'static Part, fps: f64) -> Wanted {
    Wanted { board: part.name, part, fps }
}

fn chosen(part: &'static Part, fps: f64) -> Result<(Built, Chosen), FitError> {
    choose(&wanted(part, fps), &samples(), built)
}

/// Flash, KiB, that leaves so many bytes beside the code, or up to a KiB more.
fn flash_for(bytes: usize) -> u32 {
    (CODE_BYTES as usize + bytes).div_ceil(1024) as u32
}

#[test]
fn a_clip_of_each_action_is_streamed() {
    let samples = samples();
    let actions: Vec<&str> = samples.iter().map(|s| s.action).collect();
    assert_eq!(actions, corpus().actions);
    for sample in samples {
        assert_eq!((sample.style, sample.to), ("neutral", "proud"));
        assert!(sample.clip.name.contains(sample.action) && sample.clip.name.contains(sample.style));
    }
    // Without another style it is its own.
    let one = Sample::of(corpus(), 1);
    assert!(one.iter().all(|s| (s.style, s.to) == ("proud", "neutral")));
}

#[test]
fn memory_decides_what_is_kept_and_where() {
    let half = flash_for(whole().len() / 2);
    let memory =
        External { bytes: 1 << 24, bus_mhz: 80.0, lanes: 4, line_bytes: 32, latency_clocks: 10, ram: false };
    let ram = External { ram: true, ..memory };
    let cuts: Vec<usize> =
        without_frames(&built(0).unwrap()).unwrap().iter().map(|b| b.bytes.len()).collect();
    let [models, by_phase, linear, statistic] = cuts[..] else { panic!("{cuts:?}") };
    assert!(models > by_phase && models > linear && linear > statistic, "{cuts:?}");
    // Flash, external memory; the place, whether the database is whole, whether it has frames.
    for (flash_kib, external, place, is_whole, has_frames) in [
        (flash_for(whole().len()), None, Place::Internal, true, true),
        (1024, Some(memory), Place::Internal, true, true),
        (half, None, Place::Internal, false, true),
        (half, Some(memory), Place::Internal, false, true),
        (half, Some(ram), Place::External, true, true),
        (0, Some(memory), Place::External, true, true),
        (flash_for(1), Some(memory), Place::External, true, true),
        (flash_for(models), None, Place::Internal, false, false),
        (flash_for(models) - 1, None, Place::Internal, false, false),
    ] {
        let part = part_like("stm32f405", |part| {
            (part.flash_kib, part.external) = (flash_kib, external);
            part.flash_mb_s = 100.0;
        });
        let case = format!("{flash_kib} {external:?}");
        let (built, chosen) = chosen(part, 30.0).unwrap();
        let fit = *chosen.fit();
        assert_eq!((fit.place, fit.blob_bytes), (place, built.bytes.len() as u64), "{case}");
        assert!(fit.blob_bytes <= place.room(part), "{case}");
        assert_eq!(built.bytes == whole(), is_whole, "{case}");
        assert_eq!(built.choice.is_some(), !is_whole && has_frames, "{case}");
        assert_eq!(chosen.models_only, !has_frames, "{case}");
        let cost =
            if is_whole { Some(0.0) } else { built.choice.and_then(|choice| choice.error_cost_percent) };
        assert_eq!(chosen.error_cost_percent, cost, "{case}");
        let dear = Chosen { error_cost_percent: Some(12.0), ..chosen };
        let advised = dear.advised().unwrap();
        assert!(advised.method == Method::Phase && !advised.labelled && advised.keeps(30.0), "{case}");
        assert_eq!(dear.json()["advised"], "phase", "{case}");
        let rate = format!("{:.1} in its slowest frame", advised.estimate.worst.frames_per_second()[1]);
        assert!(dear.lines("k").concat().contains(&rate), "{case}");
        let chosen = Chosen { error_cost_percent: cost, ..dear };
        assert_eq!(chosen.advised().is_some(), cost.is_some_and(|percent| percent > 5.0), "{case}");
        let database = Database::open(&built.bytes).unwrap();
        assert_eq!(database.counts().frames > 0, has_frames, "{case}");
        let first = if has_frames { Method::Mar } else { Method::Phase };
        assert_eq!((chosen.timed().method, chosen.timed().labelled), (first, false), "{case}");
        let held = chosen.timed.iter().filter(|t| t.is_held).count();
        let bytes = built.bytes.len();
        assert_eq!(
            held,
            if has_frames {
                6
            } else if bytes == models {
                4
            } else {
                2
            },
            "{case}"
        );
        assert!(has_frames || [models, by_phase].contains(&bytes), "{case}");
        assert_eq!(chosen.whole_bytes, whole().len() as u64);
        // It is what the estimate of any database says.
        assert_eq!(fit, Fit::new(part, &database, built.bytes.len() as u64, Config::new().k), "{case}");
    }
}

#[test]
fn the_first_method_that_keeps_the_time_is_chosen() {
    // A slow part with room for everything.
    let slow = part_like("nrf51822", |part| (part.ram_kib, part.flash_kib) = (64, 4096));
    let (built, patient) = chosen(slow, 0.1).unwrap();
    assert_eq!(built.bytes, whole());
    let order: Vec<_> = patient.timed.iter().map(|t| (t.method, t.labelled)).collect();
    assert_eq!(order, CANDIDATES);
    let rates: Vec<f64> = patient.timed.iter().map(|t| t.estimate.worst.frames_per_second()[1]).collect();
    assert!(rates[1] > rates[0] && rates[2] > rates[1], "{rates:?}");
    for rate in &rates {
        let fps = 0.999 * rate;
        let first = rates.iter().position(|rate| *rate >= fps).unwrap();
        let (built, chosen) = chosen(slow, fps).unwrap();
        assert_eq!((chosen.timed().method, chosen.timed().labelled), CANDIDATES[first], "{fps}");
        let database = Database::open(&built.bytes).unwrap();
        assert_eq!(database.counts().frames > 0, chosen.timed().method == Method::Mar);
        assert_eq!(chosen.models_only, chosen.timed().method != Method::Mar);
        assert!(chosen.timed().is_held && chosen.timed().keeps(fps));
        assert!(chosen.timed[..chosen.index].iter().all(|t| !t.keeps(fps)));
        assert!(chosen.timed.iter().all(|t| t.method.is_available_in(&database) == t.is_held));
    }
    let fps = 1.001 * rates.iter().copied().fold(0.0, f64::max);
    let error = chosen(slow, fps).unwrap_err();
    // Without models there is the mixture alone.
    let frames = |bytes| Ok(build(corpus(), &BuildOptions { models: false, ..options(bytes) })?);
    let without_models = choose(&wanted(slow, fps), &samples(), frames).unwrap_err();
    let FitError::Time { timed, .. } = without_models else { panic!("{without_models}") };
    assert!(timed.len() == 2 && timed.iter().all(|t| t.method == Method::Mar));
    let FitError::Time { board, fps: said, timed } = error else { panic!("{error}") };
    assert_eq!((board.as_str(), said, timed.len()), ("nrf51822", fps, CANDIDATES.len()));
}

#[test]
fn too_little_ram_says_what_would_fit() {
    let part = names::find("nrf51822").unwrap();
    let FitError::Ram {
        joints, classes, needed, have, code_runs_from_ram, most_joints, most_classes, ..
    } = chosen(part, 30.0).unwrap_err()
    else {
        panic!()
    };
    assert_eq!((joints, classes, have), (corpus().skeleton.joints(), 4, 16 * 1024));
    assert!(needed > have && !code_runs_from_ram && most_classes.is_none());
    let k = usize::from(Config::new().k);
    let ram = |j: usize| Fit::of(part, [j, k, classes], 0).ram_needed;
    let most = most_joints.unwrap();
    assert!(ram(most) <= have && ram(most + 1) > have, "{most}");
    // With as much RAM as is needed it fits, and with less by one class as well.
    let enough = part_like("stm32f405", |part| part.ram_kib = needed.div_ceil(1024) as u32);
    assert!(chosen(enough, 30.0).is_ok());
    assert!(matches!(
        check_ram(&wanted(enough, 30.0), [joints, k, 200]),
        Err(FitError::Ram { most_classes: Some(most), .. }) if (classes..200).contains(&most)
    ));
}

#[test]
fn too_little_flash_says_what_is_the_least() {
    let part = part_like("stm32f405", |part| part.flash_kib = flash_for(1024));
    let Err(FitError::Flash { room: 1024, least, has_models: true, .. }) = chosen(part, 30.0) else {
        panic!()
    };
    let (built_for_least, found) =
        chosen(part_like("stm32f405", |part| part.flash_kib = flash_for(least as usize)), 30.0).unwrap();
    assert!(found.models_only && built_for_least.bytes.len() as u64 == least);
    // Without models, the smallest has a cycle of each class.
    let frames_of = |bytes| build(corpus(), &BuildOptions { models: false, ..options(bytes) });
    let frames = |bytes| Ok(frames_of(bytes)?);
    let Err(FitError::Flash { least, has_models: false, .. }) =
        choose(&wanted(part, 30.0), &samples(), frames)
    else {
        panic!()
    };
    let one = frames_of(least as usize).unwrap();
    assert!(one.bytes.len() as u64 <= least && one.choice.unwrap().cycles == 1);
    assert!(matches!(frames_of(least as usize - 1), Err(BuildError::Size { .. })));
    // A refusal of the builder is passed on.
    let refused = |_| Err(BuildError::Unpaired("all".to_owned()).into());
    let Err(FitError::Build(error)) = choose(&wanted(part, 30.0), &samples(), refused) else { panic!() };
    assert!(matches!(error.downcast_ref(), Some(BuildError::Unpaired(_))));
}

#[test]
fn what_was_chosen_is_told() {
    let (_, chosen) = chosen(names::find("rp2040").unwrap(), 30.0).unwrap();
    let json = chosen.json();
    assert_eq!((&json["board"], &json["place"]), (&"rp2040".into(), &"external memory".into()));
    assert_eq!(json["bytes_limit"], 16 * 1024 * 1024 - CODE_BYTES);
    assert_eq!(json["stylizer"], "Stylizer<21, 8, 4>");
    let text = chosen.lines("k.gestus").join("\n");
    for said in [
        "rp2040 (Cortex-M0+, 133 MHz) keeps 30 frames a second",
        &format!("{} of 16646144 bytes of external memory beside the code; whole", whole().len()),
        "gestus-sim run --db k.gestus",
        "--board rp2040",
        "Fit::<21, 8, 4>::new(database, Config::new().method(Method::Mar))?.stylizer()",
    ] {
        assert!(text.contains(said), "{said}: {text}");
    }
    for (timed, row) in chosen.timed.iter().zip(json["methods"].as_array().unwrap()) {
        let [worst, fps] = ["worst_ms", "fps"].map(|key| row[key].as_f64().unwrap());
        assert!((worst * fps / 1e3 - 1.0).abs() < 1e-9);
        assert_eq!(row["keeps"], timed.keeps(30.0));
    }
}
