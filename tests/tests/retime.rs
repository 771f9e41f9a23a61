//! One pose a tick: bounds, order, rates, and streams of unlimited length.

use gestus_core::{
    ConfigError, Database, Pose,
    output::retime::{Bounds, Retimer},
};
use gestus_database::{
    build::{BuildOptions, build},
    stream::{Request, stream, to_pose},
    synth,
};
use gestus_motion::clip::Clip;
use gestus_tests::motion;

type Wide = Retimer<22, 48>;

/// Position of a pose in the stream, from its root, which moves a centimetre per input frame.
fn place(pose: &Pose<22>) -> f64 {
    f64::from(pose.position[0]) * 100.0
}

fn pose_at(frame: usize) -> Pose<22> {
    Pose { position: [frame as f32 * 0.01, 1.0, 0.0], ..Pose::IDENTITY }
}

fn clip_poses(clip: &Clip) -> Vec<Pose<22>> {
    clip.frames.iter().map(to_pose).collect()
}

/// All ticks of a stream whose poses take `step` input frames each: position, lag in frames, waited.
fn play(
    retimer: &mut Wide,
    rate_hz: f64,
    frames: usize,
    step: impl Fn(usize) -> f64,
) -> Vec<(f64, f64, bool)> {
    let mut ticks = Vec::new();
    let mut output = Pose::IDENTITY;
    for frame in 0..frames {
        retimer.push(&pose_at(frame), (step(frame) / rate_hz) as f32);
        while retimer.is_due() {
            let tick = retimer.tick(&mut output);
            ticks.push((place(&output), f64::from(tick.lag_s) * rate_hz, tick.waited));
        }
    }
    ticks
}

#[test]
fn in_time_with_its_input_a_stream_passes_to_the_bit() {
    let mut retimer = Wide::new(30_000, 30_000, Bounds::SYNC).unwrap();
    let mut output = Pose::IDENTITY;
    for pose in clip_poses(&motion::unseen(0, 0, 90)) {
        // Independent of the style's own time.
        retimer.push(&pose, 0.047);
        let tick = retimer.tick(&mut output);
        assert!(!tick.waited && tick.lag_s == 0.0 && !retimer.is_due());
        assert_eq!(output, pose);
    }
    assert_eq!(retimer.latency_s(), 0.0);
}

#[test]
fn styles_forty_percent_slower_and_faster_stay_within_bounds_and_in_order() {
    let bounds = Bounds { lead_s: 0.2, lag_s: 0.3 };
    for tempo in [1.4, 0.6] {
        let mut retimer = Wide::new(30_000, 30_000, bounds).unwrap();
        assert!((retimer.latency_s() - 0.2).abs() < 1e-6);
        let ticks = play(&mut retimer, 30.0, 600, |_| tempo);
        assert_eq!(ticks.len(), 600, "one pose a tick");
        for w in ticks.windows(2) {
            assert!(w[1].0 >= w[0].0 - 1e-4, "went back: {w:?}");
        }
        let lags: Vec<f64> = ticks.iter().map(|t| t.1).collect();
        let (least, most) =
            (lags.iter().copied().fold(0.0, f64::min), lags.iter().copied().fold(0.0, f64::max));
        assert!(least >= -6.0 - 1e-3 && most <= 9.0 + 1e-3, "tempo {tempo}: {least} to {most}");
        assert!(ticks.iter().all(|t| !t.2), "waited");
        // It follows the style: at first at its speed, then at the bound.
        let speed = (ticks[10].0 - ticks[7].0) / 3.0;
        assert!((speed - 1.0 / tempo).abs() < 0.12 * (1.0 / tempo), "tempo {tempo}: speed {speed}");
        let settled = lags[599];
        assert!(if tempo > 1.0 { settled > 4.0 } else { settled < -3.0 }, "tempo {tempo}: {settled}");
        // And at the input's speed where it stays.
        let late = (ticks[599].0 - ticks[499].0) / 100.0;
        assert!((late - 1.0).abs() < 0.02, "tempo {tempo}: {late}");
    }
}

#[test]
fn a_lag_is_eased_back_when_the_style_is_in_time_again() {
    let mut retimer = Wide::new(30_000, 30_000, Bounds { lead_s: 0.1, lag_s: 0.3 }).unwrap();
    let ticks = play(&mut retimer, 30.0, 900, |t| if t < 60 { 1.4 } else { 1.0 });
    let most = ticks.iter().map(|t| t.1).fold(0.0, f64::max);
    assert!(most > 4.0, "{most}");
    let last = ticks[899].1;
    assert!(last.abs() < 0.05, "{last}");
    // The lag is eased: it never changes faster than with the style's own speed.
    for w in ticks.windows(2) {
        assert!((w[1].1 - w[0].1).abs() <= 0.45, "{w:?}");
    }
}

#[test]
fn any_ratio_of_rates_gives_its_number_of_poses_at_their_places() {
    for (input, output) in [
        (30_000, 30_000),
        (30_000, 60_000),
        (30_000, 120_000),
        (30_000, 50_000),
        (120_000, 30_000),
        (100_000, 30_000),
        (59_940, 30_000),
        (25_000, 100_000),
        (30_000, 7_500),
        (44_100, 48_000),
    ] {
        let mut retimer = Wide::new(input, output, Bounds::SYNC).unwrap();
        let frames = 400;
        let ticks = play(&mut retimer, f64::from(input) / 1000.0, frames, |_| 1.0);
        let ratio = f64::from(output) / f64::from(input);
        let due = ((frames - 1) as f64 * ratio + 1e-9).floor() as usize + 1;
        assert_eq!(ticks.len(), due, "{input} to {output}");
        let late = f64::from(retimer.latency_s()) * f64::from(input) / 1000.0;
        assert!(late < 1.0, "{late}");
        for (k, tick) in ticks.iter().enumerate() {
            let wanted = (k as f64 / ratio - late).max(0.0);
            assert!(
                (tick.0 - wanted).abs() < 2e-3,
                "{input} to {output}: tick {k} at {} not {wanted}",
                tick.0
            );
        }
    }
}

#[test]
fn resampling_agrees_with_the_builders_in_f64() {
    let clip = motion::unseen(0, 0, 120);
    let fast = clip.resampled(120.0);
    let mut retimer = Wide::new(120_000, 30_000, Bounds::SYNC).unwrap();
    let mut output = Pose::IDENTITY;
    let mut worst = 0.0_f64;
    let mut count = 0;
    for pose in clip_poses(&fast) {
        retimer.push(&pose, 1.0 / 120.0);
        while retimer.is_due() {
            let _ = retimer.tick(&mut output);
            let truth = &clip.frames[count];
            let got = gestus_database::stream::from_pose(&output, 21);
            worst =
                got.rotations.iter().zip(&truth.rotations).map(|(a, b)| a.angle_to(b)).fold(worst, f64::max);
            count += 1;
        }
    }
    assert!(count >= 119 && worst < 1e-3, "{count} poses, {worst} rad");
    // And between poses, against interpolation in f64.
    let mut retimer = Wide::new(30_000, 50_000, Bounds::SYNC).unwrap();
    let late = f64::from(retimer.latency_s()) * 30.0;
    let mut tick = 0;
    for pose in clip_poses(&clip) {
        retimer.push(&pose, 1.0 / 30.0);
        while retimer.is_due() {
            let _ = retimer.tick(&mut output);
            let truth = clip.at((f64::from(tick) * 0.6 - late).max(0.0));
            let got = gestus_database::stream::from_pose(&output, 21);
            let apart =
                got.rotations.iter().zip(&truth.rotations).map(|(a, b)| a.angle_to(b)).fold(0.0, f64::max);
            assert!(apart < 2e-3, "tick {tick}: {apart} rad");
            tick += 1;
        }
    }
}

#[test]
fn a_day_of_ticks_does_not_drift() {
    let mut retimer = Retimer::<4, 8>::new(30_000, 49_999, Bounds::SYNC).unwrap();
    let mut output = Pose::IDENTITY;
    let pose = Pose::IDENTITY;
    let mut ticks = 0_u64;
    let frames = 30 * 3600 * 24;
    for _ in 0..frames {
        retimer.push(&pose, 1.0 / 30.0);
        while retimer.is_due() {
            let _ = retimer.tick(&mut output);
            ticks += 1;
        }
    }
    assert_eq!(ticks, (frames - 1) * 49_999 / 30_000 + 1);
}

#[test]
fn late_input_is_waited_for_and_caught_up_with() {
    let mut retimer = Wide::new(30_000, 30_000, Bounds { lead_s: 0.0, lag_s: 0.1 }).unwrap();
    let mut output = Pose::IDENTITY;
    let mut places = Vec::new();
    let mut waited = 0;
    for t in 0..500_usize {
        // The ticks continue; ten inputs arrive late and at once.
        if !(50..60).contains(&t) {
            let from = if t == 60 { 50 } else { t };
            for frame in from..=t {
                retimer.push(&pose_at(frame), 1.0 / 30.0);
            }
        }
        let tick = retimer.tick(&mut output);
        waited += usize::from(tick.waited);
        places.push(place(&output));
    }
    assert_eq!(waited, 10);
    for w in places.windows(2) {
        assert!(w[1] >= w[0] - 1e-4 && w[1] - w[0] < 3.1, "{w:?}");
    }
    assert!((places[499] - 499.0).abs() < 0.2, "{}", places[499]);
}

/// Ticks of one clock, and input frames of a sensor with its own clock, without the lost ones. Returns for each tick
/// the time of the newest pose minus that of the shown one, in frames, and whether the tick waited.
fn in_a_room(
    retimer: &mut Wide,
    [sensor_hz, ticks_hz]: [f64; 2],
    seconds: f64,
    step: f64,
    lost: impl Fn(usize) -> bool,
) -> Vec<(f64, bool)> {
    let (mut next, mut newest, mut output) = (0, 0, Pose::IDENTITY);
    (0..(seconds * ticks_hz) as usize)
        .map(|t| {
            while next as f64 / sensor_hz <= t as f64 / ticks_hz + 1e-9 {
                if !lost(next) {
                    retimer.push(
                        &Pose { position: [next as f32, 1.0, 0.0], ..Pose::IDENTITY },
                        (step / 30.0) as f32,
                    );
                    newest = next;
                }
                next += 1;
            }
            let tick = retimer.tick(&mut output);
            (newest as f64 - f64::from(output.position[0]), tick.waited)
        })
        .collect()
}

#[test]
fn frames_that_never_come_are_not_waited_for() {
    type Lost = fn(usize) -> bool;
    // One frame, a stall, and frames at random; at the input's rate and at others.
    let lost: [(&str, Lost); 3] = [
        ("one", |t| t == 100),
        ("three seconds", |t| (100..190).contains(&t)),
        ("one in thirty", |t| t < 700 && t * 7919 % 30 == 0),
    ];
    for (name, lost) in lost {
        for (millihz, bounds) in [
            (30_000, Bounds::SYNC),
            (50_000, Bounds::SYNC),
            (30_000, Bounds { lead_s: 0.2, lag_s: 0.2 }),
            (50_000, Bounds { lead_s: 0.2, lag_s: 0.2 }),
        ] {
            let mut retimer = Wide::new(30_000, millihz, bounds).unwrap();
            let hz = f64::from(millihz) / 1000.0;
            let ticks = in_a_room(&mut retimer, [30.0, hz], 60.0, 1.0, lost);
            let waits = ticks.iter().filter(|t| t.1).count() as f64;
            // Until the frame is known to be lost.
            let patience = if name == "one in thirty" { 22.0 } else { 4.5 };
            assert!(waits <= patience * hz, "{name}, {millihz}: {waits} waits");
            let settled = &ticks[ticks.len() - 20 * hz as usize..];
            assert!(settled.iter().all(|t| !t.1), "{name}, {millihz}: still waiting");
            let latency = f64::from(retimer.latency_s()) * 30.0;
            let most = settled.iter().map(|t| t.0).fold(0.0, f64::max);
            assert!(most < latency + 1.1, "{name}, {millihz}: {most} frames behind, {latency} wanted");
        }
    }
}

#[test]
fn a_styles_time_goes_on_after_frames_were_lost() {
    let bounds = Bounds { lead_s: 0.2, lag_s: 0.2 };
    let last = |lost: fn(usize) -> bool| {
        let mut retimer = Wide::new(30_000, 30_000, bounds).unwrap();
        let ticks = in_a_room(&mut retimer, [30.0; 2], 40.0, 1.4, lost);
        assert!(!ticks[1199].1);
        retimer.lag_s()
    };
    let (whole, stalled) = (last(|_| false), last(|t| (300..320).contains(&t)));
    assert!(whole > 0.1 && (whole - stalled).abs() < 1e-2, "{whole} {stalled}");
}

#[test]
fn a_sensor_with_another_clock_stays_in_time() {
    for parts_per_million in [-300.0, -100.0, 100.0, 300.0] {
        for ticks_hz in [30.0, 50.0] {
            let mut retimer = Wide::new(30_000, (ticks_hz * 1000.0) as u32, Bounds::SYNC).unwrap();
            let sensor = 30.0 * (1.0 + parts_per_million * 1e-6);
            let ticks = in_a_room(&mut retimer, [sensor, ticks_hz], 3600.0, 1.0, |_| false);
            let late = ticks.iter().map(|t| t.0).fold(0.0, f64::max);
            let waits = ticks.iter().filter(|t| t.1).count() as f64 / ticks.len() as f64;
            println!(
                "{parts_per_million} ppm, {ticks_hz} Hz: {late:.2} frames at most, waits {:.2}%",
                100.0 * waits
            );
            assert!(late < 4.0, "{parts_per_million} ppm at {ticks_hz} Hz: {late} frames behind");
            assert!(waits < 0.02, "{parts_per_million} ppm at {ticks_hz} Hz: {waits} of the ticks wait");
        }
    }
}

#[test]
fn before_the_first_pose_nothing_is_shown() {
    let mut retimer = Wide::new(30_000, 30_000, Bounds::SYNC).unwrap();
    let mut output = pose_at(7);
    assert!(retimer.tick(&mut output).waited);
    assert_eq!(output, pose_at(7));
    retimer.push(&pose_at(3), f32::NAN);
    assert!(!retimer.tick(&mut output).waited);
    assert_eq!(output, pose_at(3));
    retimer.reset();
    assert!(!retimer.is_due() && retimer.tick(&mut output).waited);
}

#[test]
fn rates_and_bounds_are_checked() {
    let new = |i, o, lead_s, lag_s| Wide::new(i, o, Bounds { lead_s, lag_s }).err();
    assert_eq!(new(30_000, 30_000, 0.5, 0.5), None);
    for (i, o) in [(0, 30_000), (30_000, 0), (30_000, 121_000), (121_000, 30_000)] {
        assert_eq!(new(i, o, 0.0, 0.0), Some(ConfigError::OutOfRange), "{i} to {o}");
    }
    for bad in [-0.1, f32::NAN, 11.0] {
        assert_eq!(new(30_000, 30_000, bad, 0.0), Some(ConfigError::OutOfRange));
        assert_eq!(new(30_000, 30_000, 0.0, bad), Some(ConfigError::OutOfRange));
    }
    assert!(
        matches!(new(120_000, 120_000, 0.3, 0.3), Some(ConfigError::Poses { need, have: 48 }) if need > 48)
    );
}

/// A walk in three styles, of which one is slowed down to 1.4 times its duration and one sped up to 0.6 of it.
fn tempos() -> (Vec<u8>, Clip) {
    let options = synth::Options {
        actions: vec!["walk".to_owned()],
        styles: ["neutral", "old", "proud"].map(String::from).to_vec(),
        clips: 3,
        seconds: 8.0,
        ..synth::Options::default()
    };
    let mut corpus = synth::corpus(&options).unwrap();
    let style = |name: &str| corpus.styles.iter().position(|s| s == name).unwrap();
    let (neutral, slow, fast) = (style("neutral"), style("old"), style("proud"));
    // Styles that differ only in tempo: every clip is a neutral one, played at the style's tempo.
    let originals: Vec<_> = corpus.examples.iter().filter(|e| e.style == neutral).cloned().collect();
    corpus.examples = [(neutral, 1.0), (slow, 1.4), (fast, 0.6)]
        .into_iter()
        .flat_map(|(style, tempo)| {
            originals.iter().map(move |example| {
                let mut example = example.clone();
                let count = ((example.clip.frames.len() - 1) as f64 * tempo) as usize + 1;
                let at = |t: usize| t as f64 / tempo;
                let last = example.contacts.len() - 1;
                example.contacts =
                    (0..count).map(|t| example.contacts[(at(t).round() as usize).min(last)]).collect();
                example.clip.frames = (0..count).map(|t| example.clip.at(at(t))).collect();
                example.clip.name = format!("{}-{tempo}", example.clip.name);
                for knot in example.cycles.iter_mut().flat_map(|c| &mut c.knots) {
                    *knot *= tempo;
                }
                example.style = style;
                example
            })
        })
        .collect();
    let test = corpus.examples[0].clip.clone();
    let built = build(&corpus.without(&[0]), &BuildOptions::default()).unwrap();
    (built.bytes, test)
}

#[test]
fn clips_whose_styles_differ_by_forty_percent_in_tempo_stay_within_bounds_at_every_rate() {
    let (blob, clip) = tempos();
    let database = Database::open(&blob).unwrap();
    let bounds = Bounds { lead_s: 0.3, lag_s: 0.3 };
    for (name, tempo) in [("old", 1.4), ("proud", 0.6), ("neutral", 1.0)] {
        let style = database.manifest().unwrap().styles.find(name).unwrap();
        // The poses do not determine the tempo; the label does.
        let input_style = database.manifest().unwrap().styles.find("neutral");
        let request = Request { bounds: Some(bounds), input_style, ..Request::style(style) };
        let streamed = stream(&database, &clip, &request, &mut ()).unwrap();
        // The durations in the database are those of the clips.
        let own: f64 = streamed.steps.iter().skip(5).map(|s| f64::from(s.report.step_s) * 30.0).sum::<f64>()
            / (streamed.steps.len() - 5) as f64;
        assert!((own - tempo).abs() < 0.12 * tempo, "{name}: steps are {own} of the input's");
        let retimed = streamed.retimed.as_ref().unwrap();
        assert_eq!(retimed.frames.len(), clip.frames.len(), "one pose a tick");
        let lags: Vec<f64> = retimed.ticks.iter().map(|t| f64::from(t.lag_s)).collect();
        let (least, most) =
            (lags.iter().copied().fold(0.0, f64::min), lags.iter().copied().fold(0.0, f64::max));
        println!("{name}: steps {own:.2} of the input's, lead {:.3} s, lag {most:.3} s", -least);
        assert!(least >= -0.3 - 1e-4 && most <= 0.3 + 1e-4, "{name}: {least} to {most}");
        // A slow style lags, a fast one leads, and both use most of the bound.
        match name {
            "old" => assert!(most > 0.15, "{most}"),
            "proud" => assert!(least < -0.15, "{least}"),
            _ => assert!(most < 0.1 && least > -0.1, "{least} to {most}"),
        }
        // The reported position is right, and the playhead never goes back.
        let places: Vec<f64> = lags.iter().enumerate().map(|(k, lag)| k as f64 / 30.0 - lag).collect();
        assert!(places.windows(2).all(|w| w[1] >= w[0] - 1e-4), "{name} went back");
        // At any rate of ticks, from a quarter to four times the input's.
        for (out_millihz, ratio) in
            [(7_500, 0.25), (20_000, 2.0 / 3.0), (30_000, 1.0), (50_000, 5.0 / 3.0), (120_000, 4.0)]
        {
            let mut retimer = Wide::new(30_000, out_millihz, bounds).unwrap();
            let (mut output, mut ticks, mut before) = (Pose::<22>::IDENTITY, 0, f64::NEG_INFINITY);
            for step in &streamed.steps {
                retimer.push(&to_pose(&step.frame), step.report.step_s);
                while retimer.is_due() {
                    let tick = retimer.tick(&mut output);
                    let lag = f64::from(tick.lag_s);
                    assert!((-0.3001..=0.3001).contains(&lag), "{name} at {ratio}: lag {lag}");
                    assert_eq!(lag, f64::from(retimer.lag_s()), "the caller can see it");
                    let place = f64::from(ticks) / (30.0 * ratio) - lag;
                    assert!(place >= before - 1e-3, "{name} at {ratio}: back from {before} to {place}");
                    assert!(output.is_valid(21));
                    (before, ticks) = (place, ticks + 1);
                }
            }
            let due = ((streamed.steps.len() - 1) as f64 * ratio + 1e-9) as i32 + 1;
            assert_eq!(ticks, due, "{name} at {ratio}");
        }
    }
}
