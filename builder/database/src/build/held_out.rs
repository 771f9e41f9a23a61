//! What a smaller database costs, measured on cycles that it was not made of.
//!
//! Every fifth cycle of a class is held out. Each of its frames, its class given, is searched for in the other cycles of
//! the class, exhaustively. The answer in another style is the mean of the outputs of the nearest frames. The truth is the
//! cycle of that style that pairing chooses among those that are held out.

use gestus_core::Config;
use gestus_motion::{body::row_at, statistics::mean};
use rayon::prelude::*;

use super::{condense::Choices, index::Features, source::Source};
use crate::{
    blob::rows::{joint_error, rounded},
    pairing::{CycleData, Pairing, pair_among},
    search::graph::{ClassFeatures, exact_knn},
};

/// One cycle in this many is held out.
const EVERY: usize = 5;
/// One frame in this many of a held-out cycle is translated.
const STEP: usize = 3;

/// The held-out cycles of a corpus.
pub(super) struct HeldOut<'a> {
    source: &'a Source<'a>,
    is_held: Vec<bool>,
    truth: Pairing,
    choices: Choices,
}

/// A database without the held-out cycles.
struct Kept<'a> {
    source: &'a Source<'a>,
    features: &'a Features,
    /// Whether a cycle is in it.
    kept: Vec<bool>,
    pairing: Pairing,
    /// Dofs of every clip, as they are read back, shape `[clips][frames][D]`.
    dofs: Vec<Vec<Vec<f64>>>,
    /// Weights of the features' codes.
    weights: Vec<f32>,
}

impl<'a> HeldOut<'a> {
    /// Chooses the cycles; a class of fewer than five has none.
    pub fn new(source: &'a Source<'a>) -> Self {
        let Source { clips, frames, .. } = source;
        let within = |(i, cycle): (usize, &CycleData<'_>)| i - frames.classes[cycle.class].first_cycle;
        let is_held: Vec<bool> =
            frames.cycles.iter().enumerate().map(|c| within(c) % EVERY == EVERY - 1).collect();
        let others: Vec<bool> = is_held.iter().map(|held| !held).collect();
        let choices = Choices::new(clips, frames, &others);
        Self { source, truth: source.pair(&is_held), choices, is_held }
    }

    /// Mean joint error of a database that keeps `cycles` of each class, in centimetres; NaN where nothing is held out.
    /// Without `steps` its rows are not rounded.
    pub fn error_cm(&self, features: &Features, steps: Option<&[f32]>, cycles: usize) -> f64 {
        let kept = self.choices.keep(cycles);
        let read_back = |rows: &Vec<Vec<f64>>| rows.iter().map(|row| read_back(row, steps)).collect();
        let database = Kept {
            source: self.source,
            features,
            pairing: self.source.pair(&kept),
            kept,
            dofs: self.source.clips.dofs.iter().map(read_back).collect(),
            weights: features.space.scales.iter().map(|s| (s * s) as f32).collect(),
        };
        let classes = (0..self.source.frames.classes.len()).into_par_iter();
        mean(classes.flat_map_iter(|class| self.errors(&database, class)).collect::<Vec<f64>>())
    }

    /// The error of every answer for a class, centimetres.
    fn errors(&self, database: &Kept<'_>, class: usize) -> Vec<f64> {
        let Source { clips, frames, .. } = self.source;
        let (first, count) = (frames.classes[class].first_cycle, frames.classes[class].cycles);
        let candidates: Vec<(usize, usize)> = (first..first + count)
            .filter(|&i| database.kept[i])
            .flat_map(|i| times(&frames.cycles[i]).map(move |t| (i, t)))
            .collect();
        let space = &database.features.space;
        let codes: Vec<Vec<i8>> =
            candidates.iter().map(|&(i, t)| space.code(database.feature(i, t))).collect();
        let searchable = vec![true; codes.len()];
        let of_class = ClassFeatures { codes: &codes, weights: &database.weights, searchable: &searchable };
        let mut errors = Vec::new();
        for held in (first..first + count).filter(|&i| self.is_held[i]) {
            let from = &frames.cycles[held];
            for t in times(from).step_by(STEP) {
                let feature = database.feature(held, t).iter().zip(&space.scales);
                let query: Vec<f32> = feature.map(|(v, s)| (v / s) as f32).collect();
                let near = exact_knn(&of_class, &query, usize::from(Config::new().k));
                let near: Vec<(usize, usize)> = near.into_iter().map(|(_, n)| candidates[n]).collect();
                for (style, truth) in self.truth.outputs[held].iter().enumerate() {
                    let truth = truth.filter(|&o| o != held).and_then(|o| frames.cycles.get(o));
                    let answer = truth.and_then(|truth| Some((truth, database.answer(&near, style)?)));
                    let Some((to, answer)) = answer else { continue };
                    let wanted = row_at(to.dofs, to.cycle.position(from.cycle.phase(t as f64)));
                    let wanted: Vec<f32> = wanted.iter().map(|&v| v as f32).collect();
                    errors.push(100.0 * joint_error(&clips.body, &answer, &wanted));
                }
            }
        }
        errors
    }
}

impl Source<'_> {
    /// The outputs of some of the cycles among themselves.
    fn pair(&self, kept: &[bool]) -> Pairing {
        let Source { clips, frames, .. } = self;
        let styles = clips.corpus.styles.len();
        pair_among(&frames.cycles, &frames.names(), styles, clips.options.pairing, kept)
    }
}

impl Kept<'_> {
    /// The feature of a frame of a cycle.
    fn feature(&self, cycle: usize, t: usize) -> &[f64] {
        let frames = self.source.frames;
        &self.features.values[frames.first_rows[frames.cycles[cycle].clip] + t]
    }

    /// The mean of the outputs of some frames, each a cycle and a time; `None` where no frame has one.
    fn answer(&self, near: &[(usize, usize)], style: usize) -> Option<Vec<f32>> {
        let cycles = &self.source.frames.cycles;
        let mut outputs = Vec::new();
        for &(cycle, t) in near {
            for table in [&self.pairing.outputs, &self.pairing.second] {
                // A prototype is no captured cycle.
                let output = table.get(cycle).and_then(|o| o[style]).and_then(|o| cycles.get(o));
                let phase = cycles[cycle].cycle.phase(t as f64);
                outputs.extend(output.map(|o| row_at(&self.dofs[o.clip], o.cycle.position(phase))));
            }
        }
        let dofs = outputs.first()?.len();
        Some((0..dofs).map(|d| mean(outputs.iter().map(|o| o[d])) as f32).collect())
    }
}

/// The frames of a cycle.
fn times(cycle: &CycleData<'_>) -> std::ops::Range<usize> {
    let (start, end) = cycle.cycle.span();
    start.ceil().max(1.0) as usize..(end.ceil() as usize).min(cycle.dofs.len())
}

/// A row as it is read back.
fn read_back(row: &[f64], steps: Option<&[f32]>) -> Vec<f64> {
    let Some(steps) = steps else { return row.to_vec() };
    let row: Vec<f32> = row.iter().map(|&v| v as f32).collect();
    rounded(&row, steps).into_iter().map(f64::from).collect()
}
