//! Measures the Effort of the core's output at mixes of styles: the data that the dial is fitted to.
//!
//! A label gives the Effort of a style, not of a mix of styles: where two styles are mixed, their movements partly cancel,
//! and the mix is smoother and lighter than either. So clips are streamed through the core at mixes, and the outputs are
//! rated as the fragments were: by the same descriptors, or, where people labelled the fragments, by a ridge regression
//! from the descriptors to their labels.
//!
//! 1. Every style alone and the even mix of all, `c`: a linear model `G` of the change from c, by input.
//! 2. For each factor and direction an end point: the mix that `G` predicts to be furthest along the factor for all
//!    inputs alike, with the other factors near those of c ([`nearest`](super::dial)).
//! 3. Outputs at mixes on the straight line from c to each end point. A factor's range ends where the sum of the
//!    smallest changes of any input is greatest. Up to there the mean over the inputs is made monotone (isotonic
//!    regression) and inverted: from a wanted change to a position on the line.
//!
//! The dial moves along these lines, so that within its range each factor follows its own knob on measured outputs.
//! Where several knobs are turned, their offsets from c add up.
//!
//! Cost: some 80 mixes, each of a few seconds of motion of every action, through the core.

use gestus_core::{Config, Database, blob::layout::MAX_STYLES};
use nalgebra::DMatrix;
use rayon::prelude::*;
use thiserror::Error;

use crate::effort::{
    Factors, Source,
    dial::{Dial, Reach, nearest},
    estimate::{Estimator, held},
    fragment::{Library, MIN_FRAMES},
    model::Model,
    ridge::{self, Kernel, Machine, Tabled, gammas},
};
use crate::{
    command_line::progress,
    stream::{Request, stream},
};
use gestus_motion::{
    clip::Clip,
    corpus::{Corpus, Example},
    landmarks::LandmarkError,
    statistics::{extent, mean_or_zero},
};

/// Inputs, at most: one an action, then a second.
const MAX_INPUTS: usize = 8;
/// Frames of an input, at most, in seconds.
const MAX_INPUT_S: f64 = 5.0;
/// Places on the line from the middle to an end.
const PLACES: usize = 6;
/// Weight of a factor that should not change, against 1 of the factor that should.
const SOFT: f64 = 0.3;
/// Weights of the difference between inputs that are tried for an end point.
const UNEVEN: [f64; 2] = [2.0, 12.0];
/// Least part of the mean change that every input has to show for the line to go on.
const LAG: f64 = 0.15;

/// Fewest labelled fragments to learn people's ratings from: as many as a cross-validation has folds.
pub const MIN_GIVEN: usize = ridge::FOLDS;

/// Why no dial can be made.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Error)]
pub enum NoDial {
    /// Fewer than two styles.
    #[error("it takes fragments of two styles or more: add clips of another style, or label fragments of it")]
    Styles,
    /// More styles than the format holds.
    #[error("{0} styles, at most {MAX_STYLES} fit into one: choose with --styles")]
    Many(usize),
    /// Every output is too short to rate.
    #[error("every clip is too short to rate its output: add clips of a second or more")]
    Short,
}

/// Streams clips through the core and rates the Effort of the outputs.
struct Probe<'a> {
    database: &'a Database<'a>,
    library: Library,
    estimator: Estimator,
    /// People's labels as functions of the estimates; empty where the labels are estimates.
    learned: Option<[Machine; 3]>,
    inputs: Vec<(Clip, usize)>,
}

impl<'a> Probe<'a> {
    fn of(
        database: &'a Database<'a>,
        corpus: &Corpus,
        model: &Model,
        rest: usize,
    ) -> Result<Self, LandmarkError> {
        let library = Library::of_database(database)?;
        let estimator = Estimator::of(&library);
        let learned = (model.source == Source::Given).then(|| learn_labels(model, &estimator)).flatten();
        // An action that lacks a style is not in the database and has no output.
        let actions: Vec<usize> = (0..corpus.actions.len())
            .filter(|&a| database.classes().any(|c| usize::from(c.action) == a))
            .collect();
        let mut inputs: Vec<(Clip, usize)> = Vec::new();
        for round in 0..2 {
            for &action in &actions {
                let long = |e: &&Example| e.action == action && e.clip.frames.len() >= MIN_FRAMES;
                let mut own: Vec<_> = corpus.examples.iter().filter(long).collect();
                // Clips of the style at rest first; the middle of them, for first and last takes are often odd ones.
                own.sort_by_key(|e| (e.style != rest, e.clip.name.clone()));
                let count = own.iter().filter(|e| e.style == rest).count().max(1);
                if let Some(example) = own.get((count / 2 + round) % count).filter(|_| round < count)
                    && inputs.len() < MAX_INPUTS.max(actions.len())
                {
                    let mut clip = example.clip.clone();
                    clip.frames.truncate((MAX_INPUT_S * clip.rate_hz) as usize);
                    inputs.push((clip, action));
                }
            }
        }
        Ok(Self { database, library, estimator, learned, inputs })
    }

    /// The Effort of an input's output without foot lock; `None` where it can't be rated. The lock changes landings by a
    /// frame more or less, which is no part of the style; on runs, whose flow hardly differs between styles, that would
    /// be as much as the styles' whole range.
    fn rate(&self, mix: &[f64], (clip, action): &(Clip, usize)) -> Option<Factors> {
        let style = mix.iter().enumerate().map(|(s, w)| (s as u16, *w as f32)).collect();
        let config = Config::new().contacts(false);
        let request = Request { config, style, action: Some(*action as u16), ..Request::style(0) };
        let streamed = stream(self.database, clip, &request, &mut ()).ok()?;
        let (body, rate_hz) = (&self.library.body, self.library.rate_hz);
        let (frames, times) = (streamed.frames(), streamed.times());
        let seen = self.estimator.stream(body, &frames, &times, rate_hz, Some(*action))?;
        Some(match &self.learned {
            Some(machines) => machines.each_ref().map(|m| held(m.predict(&seen))),
            None => seen,
        })
    }

    /// The Effort of every input's output.
    fn rate_all(&self, mix: &[f64]) -> Option<Vec<Factors>> {
        self.inputs.par_iter().map(|input| self.rate(mix, input)).collect()
    }

    /// Rates several mixes, and drops the inputs that can't be rated at one of them: a quick style can make a short clip
    /// too short.
    fn rate_where_all_can(&mut self, mixes: &[Vec<f64>]) -> Vec<Vec<Factors>> {
        let seen: Vec<Option<Vec<Factors>>> = self
            .inputs
            .par_iter()
            .map(|input| mixes.par_iter().map(|mix| self.rate(mix, input)).collect())
            .collect();
        let mut can = seen.iter().map(Option::is_some);
        self.inputs.retain(|_| can.next().unwrap_or(false));
        let kept: Vec<Vec<Factors>> = seen.into_iter().flatten().collect();
        (0..mixes.len()).map(|m| kept.iter().map(|of_input| of_input[m]).collect()).collect()
    }
}

/// People's labels as functions of the estimates, by ridge regression with the kernel of least cross-validation error.
fn learn_labels(model: &Model, estimator: &Estimator) -> Option<[Machine; 3]> {
    let library = &model.library;
    let seen: Vec<(Vec<f64>, Factors)> = library
        .fragments
        .iter()
        .zip(&model.known.efforts)
        .filter_map(|(f, e)| {
            let z = estimator.estimate(&library.body, &f.rows, library.rate_hz, Some(f.action))?;
            Some((z.to_vec(), *e))
        })
        .collect();
    if seen.len() < MIN_GIVEN {
        return None;
    }
    let (z, efforts): (Vec<Vec<f64>>, Vec<Factors>) = seen.into_iter().unzip();
    let kernels: Vec<Kernel> = std::iter::once(Kernel::Linear).chain(gammas(3).map(Kernel::Radial)).collect();
    let tabled: Vec<Tabled> = kernels.iter().map(|k| (*k, k.matrix(&z))).collect();
    let targets: Vec<Vec<f64>> = (0..3).map(|k| efforts.iter().map(|e| e[k]).collect()).collect();
    let chosen = ridge::choose(&tabled, &targets);
    Some(std::array::from_fn(|k| ridge::fit(kernels[chosen[k].0], chosen[k].1, &z, &targets[k])))
}

/// Outputs on the line from the middle to an end point, the middle first: mixes, and the Effort of each input.
struct Sweep {
    mixes: Vec<Vec<f64>>,
    seen: Vec<Vec<Factors>>,
}

/// Fits the dial of a database to measured outputs; `corpus` has its clips, `model` the labels, `rest` is the style of the
/// clips that are streamed. The dial records whether it is made from labels or estimates: with labels of fewer than
/// [`MIN_GIVEN`] fragments it is made from estimates. [`NoDial`] says why there is none.
///
/// # Errors
/// [`LandmarkError`] where the skeleton has no legs.
pub fn solve(
    database: &Database<'_>,
    corpus: &Corpus,
    model: &Model,
    rest: usize,
) -> Result<Result<Dial, NoDial>, LandmarkError> {
    let styles = corpus.styles.len();
    let used: Vec<usize> =
        (0..styles).filter(|&s| model.library.fragments.iter().any(|f| f.style == s)).collect();
    if used.len() < 2 {
        return Ok(Err(NoDial::Styles));
    }
    if styles > MAX_STYLES {
        return Ok(Err(NoDial::Many(styles)));
    }
    let mut probe = Probe::of(database, corpus, model, rest)?;
    let bar = progress::bar(used.len() + 1 + 6 * UNEVEN.len() * PLACES, "effort dial");
    let spread_over = |weights: &[f64]| {
        let mut mix = vec![0.0; styles];
        used.iter().zip(weights).for_each(|(&s, w)| mix[s] = *w);
        mix
    };
    let even = spread_over(&vec![1.0 / used.len() as f64; used.len()]);
    let alone = |i: usize| -> Vec<f64> { (0..used.len()).map(|j| f64::from(u8::from(i == j))).collect() };
    let mut mixes: Vec<Vec<f64>> = (0..used.len()).map(|i| spread_over(&alone(i))).collect();
    mixes.push(even.clone());
    let mut vertices = probe.rate_where_all_can(&mixes);
    bar.inc(mixes.len() as u64);
    let middle = vertices.pop().unwrap_or_default();
    if middle.is_empty() {
        bar.finish_and_clear();
        return Ok(Err(NoDial::Short));
    }
    let sweeps: Vec<Sweep> = ends(&vertices, &middle)
        .par_iter()
        .map(|end| {
            let end = spread_over(end);
            let mut sweep = Sweep { mixes: vec![even.clone()], seen: vec![middle.clone()] };
            for place in 1..=PLACES {
                let t = place as f64 / PLACES as f64;
                let mix: Vec<f64> = even.iter().zip(&end).map(|(c, e)| c + t * (e - c)).collect();
                // Where an output is too short to rate, the line ends.
                let Some(seen) = probe.rate_all(&mix) else { break };
                bar.inc(1);
                sweep.seen.push(seen);
                sweep.mixes.push(mix);
            }
            sweep
        })
        .collect();
    bar.finish_and_clear();
    // For each factor and direction: of the lines that were tried, the one that reaches furthest.
    let mut reaches = sweeps.chunks(UNEVEN.len()).enumerate().map(|(n, tried)| {
        let (factor, sign) = (n / 2, if n % 2 == 0 { -1.0 } else { 1.0 });
        let all = tried.iter().map(|sweep| reach(sweep, factor, sign));
        all.reduce(|a, b| if b.gain() > a.gain() { b } else { a }).unwrap_or_default()
    });
    let reaches: [[Reach; 2]; 3] =
        std::array::from_fn(|_| std::array::from_fn(|_| reaches.next().unwrap_or_default()));
    let source = if probe.learned.is_some() { Source::Given } else { Source::Estimated };
    let mut alone = vec![None; styles];
    used.iter().zip(&vertices).for_each(|(&s, seen)| alone[s] = Some(mean(seen)));
    Ok(Ok(Dial::measured(source, &alone, mean(&middle), &reaches)))
}

fn mean(seen: &[Factors]) -> Factors {
    std::array::from_fn(|k| mean_or_zero(seen.iter().map(|e| e[k])))
}

/// Mixes at the end points: for each factor and direction, one for each weight in the list.
fn ends(vertices: &[Vec<Factors>], middle: &[Factors]) -> Vec<Vec<f64>> {
    let efforts: Vec<Factors> = vertices.iter().map(|v| mean(v)).collect();
    let centre = mean(middle);
    let range: Factors = std::array::from_fn(|k| {
        let (low, high) = extent(efforts.iter().map(|e| e[k]));
        (high - low).max(0.05)
    });
    (0..3)
        .flat_map(|k| [-1.0, 1.0].map(|sign| (k, sign)))
        .flat_map(|(k, sign)| UNEVEN.map(|uneven| (k, sign, uneven)))
        .map(|(k, sign, uneven)| {
            let scales: Factors =
                std::array::from_fn(|j| if j == k { 1.0 / range[j] } else { SOFT / range[j] });
            // How far each input's change is from the mean of all.
            let mut spread = DMatrix::<f64>::zeros(efforts.len(), efforts.len());
            for (i, at_middle) in middle.iter().enumerate() {
                let off = DMatrix::from_fn(3, efforts.len(), |j, s| {
                    let change = vertices[s][i][j] - at_middle[j];
                    scales[j] * (change - (efforts[s][j] - centre[j]))
                });
                spread += off.tr_mul(&off) * (uneven / middle.len() as f64);
            }
            let mut target = centre;
            target[k] += sign * range[k];
            nearest(&efforts, &scales, &spread, &target)
        })
        .collect()
}

/// How far along a line every input follows, and the mean change up to there.
fn reach(sweep: &Sweep, factor: usize, sign: f64) -> Reach {
    let inputs = sweep.seen[0].len();
    let change = |place: usize, i: usize| sign * (sweep.seen[place][i][factor] - sweep.seen[0][i][factor]);
    let (mut sum, mut best, mut last) = (0.0, 0.0, 0);
    for place in 1..sweep.seen.len() {
        let steps = || (0..inputs).map(|i| change(place, i) - change(place - 1, i));
        let mean = mean_or_zero(steps());
        sum += steps().fold(f64::INFINITY, f64::min) - LAG * mean;
        if sum > best {
            (best, last) = (sum, place);
        }
    }
    let course: Vec<f64> =
        (0..=last).map(|place| mean_or_zero((0..inputs).map(|i| change(place, i)))).collect();
    let seen = sweep.seen[..=last].iter().map(|s| mean(s)).collect();
    Reach { course: isotonic(&course), mixes: sweep.mixes[..=last].to_vec(), seen }
}

/// The nearest ascending values in the squared sense: neighbors that descend are pooled until none does.
fn isotonic(values: &[f64]) -> Vec<f64> {
    let mut pools: Vec<(f64, usize)> = Vec::new();
    for &value in values {
        let mut pool = (value, 1);
        while let Some(&(before, count)) = pools.last()
            && before > pool.0
        {
            let joined = count + pool.1;
            pool = ((before * count as f64 + pool.0 * pool.1 as f64) / joined as f64, joined);
            pools.pop();
        }
        pools.push(pool);
    }
    pools.into_iter().flat_map(|(value, count)| std::iter::repeat_n(value, count)).collect()
}

#[cfg(test)]
mod tests;
