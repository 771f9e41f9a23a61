//! Translates a clip to another style, for `gestus translate` and `gestus-sim run`.

use anyhow::Result;
use gestus_core::Database;

use crate::stream::{Request, Streamed, Watcher, cleanup, input::Input, looped, stream};
use gestus_motion::{
    body::Body,
    corpus::Corpus,
    statistics::{mean_or_zero, quantile, sorted},
};

/// Streams an input; of a loop, the last of its rounds.
///
/// # Errors
/// Refusals of the stylizer.
pub fn translate(
    database: &Database<'_>,
    input: &Input,
    request: &Request,
    watcher: &mut impl Watcher,
) -> Result<Streamed> {
    run(database, input, request, watcher, |_| ())
}

/// The same, and removes foot skate afterwards, with later frames known ([`cleanup`]).
///
/// # Errors
/// As [`translate`].
pub fn translate_clean(
    database: &Database<'_>,
    input: &Input,
    request: &Request,
    watcher: &mut impl Watcher,
) -> Result<Streamed> {
    let window = cleanup::WINDOW_S * f64::from(database.rate_hz());
    run(database, input, request, watcher, |streamed| {
        cleanup::clean_up(database, streamed, window as usize);
    })
}

/// Streams an input, in all its rounds where it is a loop, lets `finish` work on the whole, and keeps the last round.
fn run(
    database: &Database<'_>,
    input: &Input,
    request: &Request,
    watcher: &mut impl Watcher,
    finish: impl FnOnce(&mut Streamed),
) -> Result<Streamed> {
    let body = input.round().map(|_| Body::of(&Corpus::of_clip(&input.mapped))).transpose()?;
    let rounds = body.as_ref().map(|body| looped::repeated(&input.mapped, body));
    let clip = rounds.as_ref().unwrap_or(&input.mapped);
    let mut streamed = stream(database, clip, request, watcher).map_err(|e| anyhow::anyhow!("{e}"))?;
    finish(&mut streamed);
    if let (Some(round), Some(body)) = (input.round(), body) {
        looped::last(&mut streamed, round, &input.mapped, &body);
    }
    Ok(streamed)
}

/// Figures of a stream, as the commands' JSON has them.
pub fn figures(streamed: &Streamed) -> serde_json::Value {
    let steps = &streamed.steps;
    let micros = sorted(steps.iter().map(|s| s.micros));
    let mean =
        |value: &dyn Fn(&gestus_core::Report) -> f64| mean_or_zero(steps.iter().map(|s| value(&s.report)));
    let by: serde_json::Map<String, serde_json::Value> = gestus_core::Degraded::NAMES
        .iter()
        .map(|(flag, name)| {
            let frames = steps.iter().filter(|s| s.report.degraded.contains(*flag)).count();
            ((*name).to_owned(), frames.into())
        })
        .collect();
    let seconds = match &streamed.retimed {
        Some(retimed) => retimed.frames.len().saturating_sub(1) as f64 * retimed.tick_s,
        None => streamed.times().last().copied().unwrap_or(0.0),
    };
    let lags = || streamed.retimed.iter().flat_map(|r| &r.ticks).map(|t| t.lag_s);
    let mut figures = serde_json::json!({
        "frames": steps.len(),
        "seconds": seconds,
        "median_us": quantile(&micros, 0.5),
        "p99_us": quantile(&micros, 0.99),
        "classes_mean": mean(&|r| r.classes.len() as f64),
        "visits_mean": mean(&|r| f64::from(r.visits)),
        "visits_max": steps.iter().map(|s| s.report.visits).max(),
        "bytes_read_mean": mean(&|r| f64::from(r.bytes_read)),
        "distance2_mean": mean(&|r| f64::from(r.distance2)),
        "passed_mean": mean(&|r| f64::from(r.passed)),
        "degraded": steps.iter().filter(|s| !s.report.degraded.is_empty()).count(),
        "degraded_by": by,
        "ram_bytes": streamed.ram_bytes,
        "digest": format!("{:08x}", streamed.digest),
        "held": steps.iter().filter(|s| s.report.held != [false; 2]).count(),
        "held_cm_max": steps.iter().flat_map(|s| s.report.held_m).fold(0.0, f32::max) * 100.0,
    });
    if let Some(retimed) = &streamed.retimed {
        figures["lag_s_max"] = lags().fold(0.0, f32::max).into();
        figures["lead_s_max"] = lags().map(|l| -l).fold(0.0, f32::max).into();
        figures["latency_s"] = retimed.latency_s.into();
    }
    figures
}

/// Number and causes of degraded frames as text, from [`figures`].
pub fn degraded_words(figures: &serde_json::Value) -> String {
    let by: Vec<String> = figures["degraded_by"]
        .as_object()
        .into_iter()
        .flatten()
        .filter(|(_, count)| count.as_u64() > Some(0))
        .map(|(name, count)| format!("{count} {name}"))
        .collect();
    let all = format!("{} degraded", figures["degraded"]);
    if by.is_empty() { all } else { format!("{all} ({})", by.join(", ")) }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use gestus_motion::{formats::bvh::Bvh, unit::Unit};

    use super::*;
    use crate::{
        build::{BuildOptions, build},
        retarget::Retarget,
        stream::input::InputOptions,
        synth,
    };

    /// A corpus of a walk whose bodies are that many times as large.
    fn corpus(scale: f64) -> Corpus {
        let mut corpus =
            synth::corpus(&synth::Options::of(&["walk"], &["neutral", "proud"], 1, 4.0)).unwrap();
        let mut skeleton = (*corpus.skeleton).clone();
        skeleton.offsets.iter_mut().for_each(|offset| *offset *= scale);
        corpus.skeleton = Arc::new(skeleton);
        for example in &mut corpus.examples {
            example.clip.skeleton = corpus.skeleton.clone();
            example.clip.frames.iter_mut().for_each(|frame| frame.root *= scale);
        }
        corpus
    }

    #[test]
    fn a_small_body_keeps_its_databases_unit() {
        let small = corpus(0.18);
        let options = BuildOptions { models: false, ..BuildOptions::default() };
        let blob = build(&small, &options).unwrap().bytes;
        let database = Database::open(&blob).unwrap();
        let path = std::env::temp_dir().join(format!("gestus-unit-{}.bvh", std::process::id()));
        let clip = &small.examples[0].clip;
        std::fs::write(&path, Bvh::from_clip(clip, Unit::Centimetres).unwrap().to_text()).unwrap();
        let input = Input::read(&path, &database).unwrap();
        assert!(input.retarget().is_none(), "{:?}", input.retarget().map(Retarget::doubts));
        assert_eq!(input.binding.unit(), Unit::Centimetres);
        let told = InputOptions { unit: Some(Unit::Metres), ..InputOptions::default() };
        let told = Input::read_with(&path, &database, &told).unwrap();
        assert_eq!(told.binding.unit(), Unit::Metres);
        assert!(told.retarget().is_some());

        // Bounded time: as long as the input, tick by tick; and what was degraded is named.
        let bounds = gestus_core::output::retime::Bounds { lead_s: 0.1, lag_s: 0.1 };
        let request = Request { bounds: Some(bounds), ..Request::style(1) };
        let streamed = translate(&database, &input, &request, &mut ()).unwrap();
        let mut figures = figures(&streamed);
        let seconds = figures["seconds"].as_f64().unwrap();
        assert!((seconds - input.output(&streamed).duration_s()).abs() < 1e-6, "{seconds}");
        figures["degraded"] = 3.into();
        figures["degraded_by"] = serde_json::json!({ "far": 2, "input": 0, "visits": 1 });
        assert_eq!(degraded_words(&figures), "3 degraded (2 far, 1 visits)");
        std::fs::remove_file(path).unwrap();
    }
}
