//! Fourth stage: rows packed, features and graph for the search.

use gestus_core::blob::{
    TrustLimits,
    layout::{self, MAX_TIMING, NONE, distances::FALLS, dof, flag},
};
use gestus_motion::{
    body::Body,
    corpus::{Cycle, Example},
    statistics::{extent, moments, variance},
};
use rayon::prelude::*;

use super::{clips::Clips, frames::Frames, options::BuildError};
use crate::{
    blob::rows::{PackError, PackedRows, choose_steps, pack},
    pairing::Pairing,
    search::{
        falls::falls,
        features::{Cloud, FeatureSpace, clouds},
        graph::{ClassFeatures, ClassGraph, build_graph},
        trust_limits::{Captured, OfClass, trust_limits, turning},
    },
};

/// The rows of a database, and the tables for the search.
pub(super) struct Index {
    /// First row and number of rows of every clip; prototypes follow the captured clips.
    pub clips: Vec<(usize, usize)>,
    /// Clip and timeline of every cycle; prototypes follow the captured cycles.
    pub cycles: Vec<(usize, Cycle)>,
    /// Number of rows, including prototypes.
    pub rows: usize,
    pub packed: PackedRows,
    /// How fast the distance of a far class falls.
    pub falls: [f32; FALLS],
    /// What input of each class is like; zeros for a draft.
    pub trust_limits: Vec<TrustLimits>,
    /// The features as stored.
    pub codes: Vec<Vec<i8>>,
    pub flags: Vec<u8>,
    /// One graph per class, left out unless the index is whole.
    pub graphs: Vec<ClassGraph>,
    /// Searchable frames of each class.
    pub searchable: Vec<usize>,
}

/// The feature space of all clips, and their features.
pub(super) struct Features {
    pub space: FeatureSpace,
    /// Of the captured frames of all clips, metres.
    pub values: Vec<Vec<f64>>,
    /// The same as stored.
    pub codes: Vec<Vec<i8>>,
}

impl Features {
    pub fn new(clips: &Clips<'_>, most: usize) -> Self {
        let Clips { options, body, groups, examples, .. } = clips;
        let clouds: Vec<Cloud> = examples.iter().flat_map(|e| clouds(&e.clip, options.window)).collect();
        let space = FeatureSpace::of(body, &groups.of_joint, &clouds, options.window, most);
        let values: Vec<Vec<f64>> = clouds.par_iter().map(|c| space.feature(c)).collect();
        let codes = values.iter().map(|value| space.code(value)).collect();
        Self { space, values, codes }
    }
}

/// What every database of the same clips shares, however many of their cycles it keeps.
pub(super) struct Shared {
    /// Quantisation step of each dof.
    pub steps: Vec<f32>,
    /// Standard deviation of each dof over all captured frames.
    pub scales: Vec<f32>,
    /// Least and greatest value of each dof in all captured frames.
    pub ranges: Vec<[f32; 2]>,
    /// The dofs of the timing metric, each with its weight and that of its change.
    pub timing: Vec<(usize, f64, f64)>,
}

impl Shared {
    pub fn new(clips: &Clips<'_>, pairing: &Pairing, error_cm: f64) -> Self {
        let mut rows: Vec<Vec<f32>> = clips.dofs.iter().flatten().map(|row| narrow(row)).collect();
        let scales = deviations(&rows);
        let ranges = ranges(&rows);
        rows.extend(pairing.prototypes.iter().flat_map(|p| &p.rows).map(|row| narrow(row)));
        let steps = choose_steps(&clips.body, &rows, error_cm / 100.0);
        Self { steps, scales, ranges, timing: timing_metric(&clips.body, &clips.dofs) }
    }
}

/// The clips that are stored: all, or those that are left of them.
pub(super) struct Stored<'a> {
    /// All clips, and the layout of their frames.
    pub source: (&'a Clips<'a>, &'a Frames<'a>),
    pub clips: &'a Clips<'a>,
    pub frames: &'a Frames<'a>,
    pub pairing: &'a Pairing,
    /// Where each clip starts among the frames of all clips.
    pub first_frames: &'a [usize],
}

impl Stored<'_> {
    /// What input of each class is like, by all captured frames, and by their distances from what is stored.
    fn trust_limits(&self, features: &Features, classes: &[OfClass<'_>]) -> Vec<TrustLimits> {
        let (clips, frames) = self.source;
        let rate_hz = clips.corpus.rate_hz;
        let dofs = &clips.dofs;
        let stored = |example: &Example| {
            self.frames.classes.iter().position(|c| (c.action, c.style) == (example.action, example.style))
        };
        let of_clip = |(example, &first): (&&Example, &usize)| {
            stored(example).map(|class| (class, first, example.clip.frames.len()))
        };
        let mut in_cycle = vec![false; frames.count];
        for (&first, example) in frames.first_rows.iter().zip(&clips.examples) {
            for (start, end) in example.cycles.iter().map(Cycle::span) {
                let span =
                    start.ceil().max(0.0) as usize..(end.ceil() as usize).min(example.clip.frames.len());
                in_cycle[first..][span].fill(true);
            }
        }
        let of_stored = |(&first, rows): (&usize, &Vec<Vec<f64>>)| first..first + rows.len();
        let velocity = |row: &Vec<f64>| [row[dof::FORWARD], row[dof::LEFT]];
        let captured = Captured {
            clips: &clips.examples.iter().zip(&frames.first_rows).filter_map(of_clip).collect::<Vec<_>>(),
            codes: &features.codes,
            velocities: &dofs.iter().flatten().map(velocity).collect::<Vec<_>>(),
            turning: &dofs.iter().flat_map(|rows| turning(rows, rate_hz)).collect::<Vec<_>>(),
            in_cycle: &in_cycle,
            stored: &self.first_frames.iter().zip(&self.clips.dofs).flat_map(of_stored).collect::<Vec<_>>(),
        };
        trust_limits(&captured, classes, rate_hz)
    }
}

/// How much of an index is made.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Extent {
    /// As large as [`WithoutGraph`](Self::WithoutGraph), without measured falls and trust.
    Draft,
    /// All but the graph.
    WithoutGraph,
    Whole,
}

impl Index {
    pub fn new(
        stored: &Stored<'_>,
        features: &Features,
        shared: &Shared,
        extent: Extent,
    ) -> Result<Self, BuildError> {
        let Stored { clips, frames, pairing, first_frames, .. } = stored;
        let Clips { options, examples, dofs, .. } = clips;
        let mut rows: Vec<Vec<f32>> = dofs.iter().flatten().map(|row| narrow(row)).collect();
        let mut clip_table: Vec<(usize, usize)> =
            frames.first_rows.iter().zip(dofs).map(|(&f, d)| (f, d.len())).collect();
        let mut cycles: Vec<(usize, Cycle)> =
            frames.cycles.iter().map(|c| (c.clip, c.cycle.clone())).collect();
        for prototype in &pairing.prototypes {
            cycles.push((clip_table.len(), prototype.cycle.clone()));
            clip_table.push((rows.len(), prototype.rows.len()));
            rows.extend(prototype.rows.iter().map(|row| narrow(row)));
        }
        let most = usize::from(NONE) - 1;
        if cycles.len() > most {
            let cure = "use fewer clips (--limit)";
            return Err(BuildError::too_many("cycles and prototypes", cycles.len(), most, cure));
        }
        let packed = pack(&rows, &shared.steps, options.block_rows)
            .map_err(|error| located(&error, &clip_table, clips))?;

        let space = &features.space;
        let codes: Vec<Vec<i8>> = first_frames
            .iter()
            .zip(dofs)
            .flat_map(|(&first, rows)| &features.codes[first..first + rows.len()])
            .cloned()
            .collect();

        let flags = flags(clips, frames, pairing)?;
        let weights: Vec<f32> = space.scales.iter().map(|s| (s * s) as f32).collect();
        let is_searchable: Vec<bool> = flags.iter().map(|f| f & flag::SEARCHABLE != 0).collect();
        let (mut graphs, mut counts) = (Vec::new(), Vec::new());
        let mut by_class = Vec::new();
        for class in &frames.classes {
            let range = class.first_row..class.first_row + class.rows;
            let searchable = &is_searchable[range.clone()];
            let of_class = ClassFeatures { codes: &codes[range], weights: &weights, searchable };
            by_class.push((class.first_row, of_class));
            graphs.push(match extent {
                Extent::Whole => build_graph(&of_class),
                Extent::Draft | Extent::WithoutGraph => ClassGraph::left_out(),
            });
            counts.push(searchable.iter().filter(|s| **s).count());
        }
        let (falls, trust_limits) = if extent == Extent::Draft {
            (
                [0.0; FALLS],
                vec![TrustLimits { far: 0.0, speeds: [0.0; 2], turning: 0.0 }; frames.classes.len()],
            )
        } else {
            let falls = falls(&clip_table[..examples.len()], &by_class);
            let of_class: Vec<_> = frames.classes.iter().map(|c| c.action).zip(by_class).collect();
            (falls, stored.trust_limits(features, &of_class))
        };
        Ok(Self {
            clips: clip_table,
            cycles,
            rows: rows.len(),
            packed,
            falls,
            trust_limits,
            codes,
            flags,
            graphs,
            searchable: counts,
        })
    }
}

/// The clip and the frame of a row that could not be packed; `clip_table` has first row and number of rows of every clip.
fn located(error: &PackError, clip_table: &[(usize, usize)], clips: &Clips<'_>) -> BuildError {
    let &PackError::TooLarge { dof, row, value } = error;
    let clip = clip_table.partition_point(|&(first, _)| first <= row).saturating_sub(1);
    let name = clips.examples.get(clip).map_or("the mean of several cycles", |e| e.clip.name.as_str());
    BuildError::TooLarge {
        clip: name.to_owned(),
        frame: row - clip_table[clip].0,
        dof: clips.body.dof_names().swap_remove(dof),
        value,
    }
}

fn narrow(row: &[f64]) -> Vec<f32> {
    row.iter().map(|&v| v as f32).collect()
}

/// Contacts of every captured frame, and whether the search may return it.
fn flags(clips: &Clips<'_>, frames: &Frames<'_>, pairing: &Pairing) -> Result<Vec<u8>, BuildError> {
    let outputs: Vec<bool> = pairing.outputs.iter().map(|o| o.iter().all(Option::is_some)).collect();
    let flags = frame_flags(&clips.examples, &frames.first_rows, &outputs, frames.count);
    for c in &frames.classes {
        if !flags[c.first_row..c.first_row + c.rows].iter().any(|f| f & flag::SEARCHABLE != 0) {
            let corpus = clips.corpus;
            let name = format!("{} in {}", corpus.actions[c.action], corpus.styles[c.style]);
            return Err(BuildError::Unpaired(format!("no cycle of {name} has an output in every style")));
        }
    }
    Ok(flags)
}

fn frame_flags(examples: &[&Example], first_rows: &[usize], paired: &[bool], frames: usize) -> Vec<u8> {
    let mut flags = vec![0; frames];
    let mut paired = paired.iter();
    for (example, &first) in examples.iter().zip(first_rows) {
        for (f, contact) in example.contacts.iter().enumerate() {
            let flag = &mut flags[first + f];
            *flag |= if contact[0] { flag::LEFT_CONTACT } else { 0 };
            *flag |= if contact[1] { flag::RIGHT_CONTACT } else { 0 };
            *flag |= if f > 0 { flag::FOLLOWS } else { 0 };
        }
        for (cycle, paired) in example.cycles.iter().zip(paired.by_ref()) {
            if !paired {
                continue;
            }
            let (start, end) = cycle.span();
            let last = (end.ceil() as usize).min(example.clip.frames.len());
            for f in (start.ceil().max(1.0) as usize)..last {
                flags[first + f] |= flag::SEARCHABLE;
            }
        }
    }
    flags
}

/// Standard deviation of each dof.
fn deviations(rows: &[Vec<f32>]) -> Vec<f32> {
    // The scale of a constant dof is not 0, since it is divided by.
    (0..rows[0].len()).map(|d| moments(rows.iter().map(|r| f64::from(r[d])), 1e-4).1 as f32).collect()
}

/// Least and greatest value of each dof.
fn ranges(rows: &[Vec<f32>]) -> Vec<[f32; 2]> {
    let extents = (0..rows[0].len()).map(|d| extent(rows.iter().map(|r| f64::from(r[d]))));
    extents.map(|(least, greatest)| [least as f32, greatest as f32]).collect()
}

/// The dofs of the timing metric: the joints' dofs that move most, each weighed by its spread and by that of its
/// change.
fn timing_metric(body: &Body, dofs: &[Vec<Vec<f64>>]) -> Vec<(usize, f64, f64)> {
    let variance = |value: &dyn Fn(&[Vec<f64>], usize) -> f64| {
        variance(dofs.iter().flat_map(|rows| (0..rows.len()).map(move |t| value(rows, t))))
    };
    let mut found: Vec<(f64, usize, f64)> = (layout::dof::JOINTS..body.dofs())
        .map(|d| {
            let change = variance(&|rows, t| rows[t][d] - rows[t.saturating_sub(1)][d]);
            (variance(&|rows, t| rows[t][d]), d, change)
        })
        .collect();
    found.sort_by(|a, b| b.0.total_cmp(&a.0));
    found.truncate(MAX_TIMING);
    found.into_iter().map(|(pose, d, change)| (d, 1.0 / pose.max(1e-8), 1.0 / change.max(1e-8))).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{build::BuildOptions, synth};

    #[test]
    fn a_number_that_is_too_large_is_named_by_its_clip_and_frame() {
        let corpus = synth::corpus(&synth::Options::of(&["walk"], &["neutral"], 2, 2.0)).unwrap();
        let options = BuildOptions::default();
        let clips = Clips::new(&corpus, &options).unwrap();
        let table = [(0, clips.dofs[0].len()), (clips.dofs[0].len(), clips.dofs[1].len())];
        let error = PackError::TooLarge { dof: dof::FORWARD, row: table[1].0 + 3, value: 9e9 };
        let error = located(&error, &table, &clips);
        let BuildError::TooLarge { clip, frame: 3, dof, .. } = &error else { panic!("{error}") };
        assert_eq!((clip, dof.as_str()), (&clips.examples[1].clip.name, "root.forward"));
    }
}
