//! Chooses a database for a part: one that its memory holds, with a method that keeps the time there.
//!
//! 1. **Memory for the database.** The whole one is kept where it fits into the internal flash beside the code, or into
//!    external memory that every such part has. Otherwise it is built for the room that there is, as by
//!    [`BuildOptions::bytes`](crate::build::BuildOptions::bytes). External memory that a board may lack comes last.
//! 2. **RAM**, by the formula of [`state`](super::state).
//! 3. **Time.** Clips of the corpus are streamed on this machine, and each method's slowest frame is [estimated](Estimate).
//!    The first of [`CANDIDATES`] that keeps the time is chosen. If it needs no frames, the database is [cut] to its
//!    models, or to those of one method if all do not fit.
//!
//! The estimates are those of `gestus-sim run --board`, on the same clips.

use gestus_core::{Config, Database, Method};
use gestus_motion::{clip::Clip, corpus::Corpus};

use super::{
    chosen::{Chosen, Timed},
    error::FitError,
    estimate::{Estimate, Fit, Place, Stream},
    table::Part,
};
use crate::{
    blob::cut,
    build::{BuildError, Built},
    stream::{Request, stream},
};

/// Methods, and whether the input's action and style are given; those that are preferred come first.
pub const CANDIDATES: [(Method, bool); 6] = [
    (Method::Mar, false),
    (Method::Mar, true),
    (Method::Phase, false),
    (Method::Phase, true),
    (Method::Lti, false),
    (Method::Statistic, false),
];

/// Joints of hips and two legs, the fewest of a body.
const MIN_JOINTS: usize = 7;

/// What is wanted.
#[derive(Debug, Clone, Copy)]
pub struct Wanted {
    /// The name by which the part was asked for: its own, or that of an emulated board.
    pub board: &'static str,
    /// The part.
    pub part: &'static Part,
    /// Frames a second.
    pub fps: f64,
}

/// A clip by which time is estimated, on the database's joints and at its rate.
#[derive(Debug, Clone, Copy)]
pub struct Sample<'a> {
    /// The clip.
    pub clip: &'a Clip,
    /// Its action.
    pub action: &'a str,
    /// Its style.
    pub style: &'a str,
    /// The style that it is translated to.
    pub to: &'a str,
}

impl<'a> Sample<'a> {
    /// The first clip of each action in a style, or in another where the action lacks it. They are translated to the first
    /// style that differs from it.
    pub fn of(corpus: &'a Corpus, style: usize) -> Vec<Self> {
        let to = (0..corpus.styles.len()).find(|&s| s != style).unwrap_or(style);
        let first = |action: usize| {
            let clips = || corpus.examples.iter().filter(move |e| e.action == action);
            clips().find(|e| e.style == style).or_else(|| clips().next())
        };
        let sample = |e: &'a gestus_motion::corpus::Example| Self {
            clip: &e.clip,
            action: &corpus.actions[e.action],
            style: &corpus.styles[e.style],
            to: &corpus.styles[to],
        };
        (0..corpus.actions.len()).filter_map(first).map(sample).collect()
    }
}

/// Chooses a database for a part. `build` builds it in at most the given number of bytes, or whole for 0.
///
/// # Errors
/// [`FitError`] if none suits the part.
pub fn choose(
    wanted: &Wanted,
    samples: &[Sample<'_>],
    mut build: impl FnMut(usize) -> anyhow::Result<Built>,
) -> Result<(Built, Chosen), FitError> {
    let Wanted { board, part, fps } = *wanted;
    let whole = build(0)?;
    let counts = *Database::open(&whole.bytes)?.counts();
    let capacities = [counts.joints, usize::from(Config::new().k), counts.classes];
    check_ram(wanted, capacities)?;
    let whole_bytes = whole.bytes.len() as u64;
    let models = without_frames(&whole)?;
    let chosen = |timed: Vec<Timed>, index: usize, error_cost_percent: Option<f64>| Chosen {
        board: board.to_owned(),
        fps,
        models_only: timed[index].method != Method::Mar,
        timed,
        index,
        capacities,
        whole_bytes,
        error_cost_percent,
    };
    let mut least = models.iter().map(|built| built.bytes.len() as u64).min().unwrap_or(u64::MAX);
    let mut timed = Vec::new();
    match in_memory(part, whole, &mut build)? {
        InMemory::Fits(framed) => {
            timed = time(wanted, &framed, samples)?;
            let is_first = |t: &Timed| t.method == Method::Mar && t.keeps(fps);
            if let Some(index) = timed.iter().position(is_first) {
                let cost = framed.choice.map_or(Some(0.0), |choice| choice.error_cost_percent);
                return Ok((framed, chosen(timed, index, cost)));
            }
        }
        InMemory::TooLarge(bytes) => least = least.min(bytes),
    }
    let has_models = !models.is_empty();
    // Without the frames, the others may be in faster memory.
    timed.retain(|t| t.method == Method::Mar);
    let fits = |models: &Built| Place::of(part, models.bytes.len() as u64) != Place::None;
    // Those of one method are for parts that do not hold all.
    let tried = if models.first().is_some_and(fits) { 1 } else { models.len() };
    for models in models.into_iter().take(tried).filter(fits) {
        timed.iter_mut().for_each(|t| t.is_held = false);
        let first = timed.len();
        timed.extend(time(wanted, &models, samples)?);
        if let Some(index) = (first..timed.len()).find(|&t| timed[t].keeps(fps)) {
            return Ok((models, chosen(timed, index, None)));
        }
    }
    let board = board.to_owned();
    if timed.is_empty() {
        let room = places(part).map(|p| p.room(part)).max().unwrap_or(0);
        return Err(FitError::Flash { board, room, least, has_models });
    }
    Err(FitError::Time { board, fps, timed })
}

/// Refuses capacities that the part's RAM does not hold.
fn check_ram(wanted: &Wanted, [j, k, c]: [usize; 3]) -> Result<(), FitError> {
    let part = wanted.part;
    let fits = |j: usize, c: usize| Fit::of(part, [j, k, c], 0).fits_ram();
    let fit = Fit::of(part, [j, k, c], 0);
    if fit.fits_ram() {
        return Ok(());
    }
    Err(FitError::Ram {
        board: wanted.board.to_owned(),
        joints: j,
        classes: c,
        needed: fit.ram_needed,
        have: fit.ram_bytes,
        code_runs_from_ram: part.flash_kib == 0,
        most_joints: (MIN_JOINTS..j).rev().find(|&j| fits(j, c)),
        most_classes: (1..c).rev().find(|&c| fits(j, c)),
    })
}

/// The database without its frames: with all models, and with those of each method alone, in the order of [`CANDIDATES`].
/// None if it has no models that translate by themselves.
fn without_frames(whole: &Built) -> Result<Vec<Built>, FitError> {
    let database = Database::open(&whole.bytes)?;
    let held = |method: &Method| method.section().is_some() && method.is_available_in(&database);
    let alone = [Method::Phase, Method::Lti, Method::Statistic].into_iter().filter(held);
    let mut sets: Vec<Vec<Method>> = alone.map(|method| vec![method]).collect();
    if sets.len() > 1 {
        sets.insert(0, sets.concat());
    }
    let cut = |methods: Vec<Method>| {
        let bytes = cut::models_of(&database, &methods)?;
        Ok(Built { bytes, notes: whole.notes.clone(), choice: None })
    };
    sets.into_iter().map(cut).collect()
}

/// A database with frames in a part's memory.
enum InMemory {
    Fits(Built),
    /// Bytes of the smallest.
    TooLarge(u64),
}

/// The whole database if it fits somewhere, or else one for the room that there is.
fn in_memory(
    part: &Part,
    whole: Built,
    build: &mut impl FnMut(usize) -> anyhow::Result<Built>,
) -> Result<InMemory, FitError> {
    let bytes = whole.bytes.len() as u64;
    let mut smallest = bytes;
    for room in places(part).map(|p| p.room(part)) {
        if bytes <= room {
            return Ok(InMemory::Fits(whole));
        }
        match build(usize::try_from(room).unwrap_or(usize::MAX)) {
            Ok(built) => return Ok(InMemory::Fits(built)),
            Err(error) => match error.downcast_ref::<BuildError>() {
                Some(BuildError::Size { least, .. }) => smallest = smallest.min(*least as u64),
                _ => return Err(error.into()),
            },
        }
    }
    Ok(InMemory::TooLarge(smallest))
}

/// The places of a part that hold a database, in the order in which they are tried: those that every such part has come
/// first, of these the larger.
fn places(part: &Part) -> impl Iterator<Item = Place> {
    let mut places = vec![Place::Internal, Place::External];
    places.retain(|place| place.room(part) > 0);
    places.sort_by_key(|&place| (!place.is_always_there(part), std::cmp::Reverse(place.room(part))));
    places.into_iter()
}

/// The time of each method that a database holds.
fn time(wanted: &Wanted, built: &Built, samples: &[Sample<'_>]) -> Result<Vec<Timed>, FitError> {
    let database = Database::open(&built.bytes)?;
    let held = CANDIDATES.into_iter().filter(|(method, _)| method.is_available_in(&database));
    let mut timed = Vec::new();
    for (method, labelled) in held {
        let mut slowest: Option<Timed> = None;
        for sample in samples {
            let estimate =
                estimate(wanted.part, &database, built.bytes.len() as u64, sample, (method, labelled))?;
            let seconds = |t: &Timed| t.estimate.worst.seconds[1];
            if slowest.as_ref().is_none_or(|s| estimate.worst.seconds[1] > seconds(s)) {
                let input =
                    [&sample.clip.name[..], sample.action, sample.style, sample.to].map(str::to_owned);
                slowest = Some(Timed { method, labelled, estimate, input, is_held: true });
            }
        }
        timed.extend(slowest);
    }
    Ok(timed)
}

/// The estimate for a clip.
fn estimate(
    part: &'static Part,
    database: &Database<'_>,
    blob_bytes: u64,
    sample: &Sample<'_>,
    (method, labelled): (Method, bool),
) -> Result<Estimate, FitError> {
    let manifest = database.manifest()?;
    let (action, style) = (manifest.actions.find(sample.action), manifest.styles.find(sample.style));
    let request = Request {
        config: Config::new().method(method),
        action: action.filter(|_| labelled),
        input_style: style.filter(|_| labelled),
        ..Request::style(manifest.styles.find(sample.to).unwrap_or(0))
    };
    let refused = |error| FitError::Build(anyhow::anyhow!("{}: {error}", sample.clip.name));
    let streamed = stream(database, sample.clip, &request, &mut ()).map_err(refused)?;
    let stream = Stream { database, blob_bytes, request: &request };
    Ok(Estimate::new(part, &stream, streamed.steps.iter().map(|step| &step.report)))
}

#[cfg(test)]
mod tests;
