//! From a [`Corpus`] to a blob.

use gestus_core::{
    BlobError, Database,
    blob::{
        Counts, Manifest, Names,
        layout::{
            self, MAX_TIMING, NONE, class, cycle, flag, foot, joint,
            section::{self, Required},
            timing,
        },
    },
};
use serde::{Deserialize, Serialize};
use thiserror::Error;

use crate::{
    blob::{
        assemble::{Section, assemble},
        rows::{PackError, choose_steps, pack},
    },
    models::{self, Wanted, correspond::Pairs},
    pairing::{CycleData, Scheme, pair},
    registration::contact,
    search::{
        features::{Cloud, FeatureSpace, clouds},
        graph::{ClassFeatures, build_graph},
        groups::{Chosen, GroupError, Groups},
    },
    stream::MOST_CLASSES,
};
use gestus_motion::{
    body::Body,
    corpus::{Corpus, Cycle, Example, Unknown},
    landmarks::LandmarkError,
};

/// How a database is built.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct BuildOptions {
    /// How output cycles are chosen.
    pub pairing: Scheme,
    /// Frames of the query window.
    pub window: usize,
    /// Mean joint error that packing may cause, centimetres.
    pub error_cm: f64,
    /// Rows of a block.
    pub block_rows: usize,
    /// Whether linear models and statistics are built too.
    pub models: bool,
    /// The style that the models take; `normal` or `neutral`, or else the first, where left out.
    pub from: Option<String>,
    /// Whether there is a model and a table for each action, besides those of all actions.
    pub models_by_action: bool,
    /// Whether iterative motion warping refines the correspondence of gaits for the linear models.
    pub warp_gaits: bool,
    /// Rounds from the recursive mean of rotations towards the geodesic one, in the tables of statistics.
    pub mean_rounds: usize,
    /// Joint groups by name, each with its joints ([`crate::search::groups`]); the arms where empty.
    pub groups: Chosen,
}

impl Default for BuildOptions {
    fn default() -> Self {
        Self {
            pairing: Scheme::default(),
            window: 5,
            error_cm: 0.045,
            block_rows: 32,
            models: true,
            from: None,
            models_by_action: false,
            warp_gaits: false,
            mean_rounds: 0,
            groups: Chosen::new(),
        }
    }
}

/// A corpus that no database can be made of.
#[derive(Debug, Error)]
pub enum BuildError {
    /// The skeleton.
    #[error(transparent)]
    Landmark(#[from] LandmarkError),
    /// The joint groups.
    #[error(transparent)]
    Groups(#[from] GroupError),
    /// The rows.
    #[error(transparent)]
    Pack(#[from] PackError),
    /// More of something than the format holds.
    #[error("{what}: {have}, and the format holds {most}: {cure}")]
    TooMany {
        /// Of what.
        what: String,
        /// How many.
        have: usize,
        /// How many it may be.
        most: usize,
        /// What to do.
        cure: &'static str,
    },
    /// The style that models should take is not there.
    #[error("the style that the models should take: {0}")]
    From(Unknown),
    /// No action that is there in every style.
    #[error(
        "not every style has an output ({0}): a frame needs an output in each; choose --actions and --styles that are complete"
    )]
    Unpaired(String),
    /// The blob does not open: a fault of the builder.
    #[error("the blob that was built does not open ({0}): this is a fault of the builder, please report it")]
    Blob(#[from] BlobError),
}

/// A database and what was noticed while it was built.
#[derive(Debug)]
pub struct Built {
    /// The blob.
    pub bytes: Vec<u8>,
    /// One line for each class left out.
    pub notes: Vec<String>,
}

struct ClassRows {
    action: usize,
    style: usize,
    first_row: usize,
    rows: usize,
    first_cycle: usize,
    cycles: usize,
}

/// Builds a database. The result opens: it is checked as the core checks it.
///
/// # Errors
/// [`BuildError`] where the corpus is incomplete or too large.
pub fn build(corpus: &Corpus, options: &BuildOptions) -> Result<Built, BuildError> {
    let body = Body::of(corpus)?;
    let groups = Groups::of(&body.skeleton, &body.landmarks, &options.groups)?;
    let mut notes = Vec::new();
    let examples = complete(corpus, &mut notes)?;
    let dofs: Vec<Vec<Vec<f64>>> = examples.iter().map(|e| body.clip_dofs(&e.clip)).collect();

    let mut classes: Vec<ClassRows> = Vec::new();
    let mut first_rows = Vec::new();
    let mut cycles: Vec<CycleData<'_>> = Vec::new();
    let mut rows = 0;
    for (clip, (example, dofs)) in examples.iter().zip(&dofs).enumerate() {
        let (action, style) = (example.action, example.style);
        if classes.last().is_none_or(|c| (c.action, c.style) != (action, style)) {
            classes.push(ClassRows {
                action,
                style,
                first_row: rows,
                rows: 0,
                first_cycle: cycles.len(),
                cycles: 0,
            });
        }
        let number = classes.len() - 1;
        let class = &mut classes[number];
        class.rows += dofs.len();
        class.cycles += example.cycles.len();
        first_rows.push(rows);
        rows += dofs.len();
        let take = &example.take;
        cycles.extend(example.cycles.iter().enumerate().map(|(index, cycle)| CycleData {
            class: number,
            clip,
            take,
            index,
            cycle,
            dofs,
        }));
    }
    let frames = rows;
    limits(corpus, &classes, cycles.len(), frames)?;

    let names: Vec<(usize, usize)> = classes.iter().map(|c| (c.action, c.style)).collect();
    let pairing = pair(&cycles, &names, corpus.styles.len(), options.pairing);

    let models = if options.models {
        let examples_dofs: Vec<(&Example, &[Vec<f64>])> =
            examples.iter().copied().zip(dofs.iter().map(Vec::as_slice)).collect();
        let contacts: Vec<&[[bool; 2]]> = examples.iter().map(|e| e.contacts.as_slice()).collect();
        let own = options.pairing.of_models();
        let continuing = (own != options.pairing).then(|| pair(&cycles, &names, corpus.styles.len(), own));
        let pairs = Pairs {
            cycles: &cycles,
            classes: &names,
            contacts: &contacts,
            pairing: continuing.as_ref().unwrap_or(&pairing),
            rate_hz: corpus.rate_hz,
            warp_gaits: options.warp_gaits,
        };
        let wanted = Wanted {
            from: taken_style(corpus, options)?,
            styles: corpus.styles.len(),
            by_action: options.models_by_action,
            rounds: options.mean_rounds,
        };
        models::sections(&body, &examples_dofs, &pairs, &wanted, &mut notes)
    } else {
        Vec::new()
    };

    let mut all_rows: Vec<Vec<f32>> = dofs.iter().flatten().map(|row| narrow(row)).collect();
    let mut clip_table: Vec<(usize, usize)> =
        first_rows.iter().zip(&dofs).map(|(&f, d)| (f, d.len())).collect();
    let mut cycle_table: Vec<(usize, Cycle)> = cycles.iter().map(|c| (c.clip, c.cycle.clone())).collect();
    for prototype in &pairing.prototypes {
        cycle_table.push((clip_table.len(), prototype.cycle.clone()));
        clip_table.push((all_rows.len(), prototype.rows.len()));
        all_rows.extend(prototype.rows.iter().map(|row| narrow(row)));
    }
    if cycle_table.len() >= usize::from(NONE) {
        return Err(too_many(
            "cycles and prototypes",
            cycle_table.len(),
            usize::from(NONE) - 1,
            "use fewer clips (--limit)",
        ));
    }
    let steps = choose_steps(&body, &all_rows, options.error_cm / 100.0);
    let packed = pack(&all_rows, &steps, options.block_rows)?;

    let clouds: Vec<Cloud> = examples.iter().flat_map(|e| clouds(&e.clip, options.window)).collect();
    let space = FeatureSpace::of(&body, &groups.of_joint, &clouds, options.window);
    let codes: Vec<Vec<i8>> = {
        use rayon::prelude::*;
        clouds.par_iter().map(|c| space.code(c)).collect()
    };
    drop(clouds);
    let paired: Vec<bool> = pairing.outputs.iter().map(|o| o.iter().all(Option::is_some)).collect();
    let flags = flags(&examples, &first_rows, &paired, frames);
    for c in &classes {
        if !flags[c.first_row..c.first_row + c.rows].iter().any(|f| f & flag::SEARCHABLE != 0) {
            let name = format!("{} in {}", corpus.actions[c.action], corpus.styles[c.style]);
            return Err(BuildError::Unpaired(format!("no cycle of {name} has an output in every style")));
        }
    }
    let scales = deviations(&all_rows[..frames]);
    let timing_dofs = timing_metric(&body, &examples, &dofs);

    let mut class_bytes = Vec::new();
    let mut graph = Vec::new();
    let weights: Vec<f32> = space.scales.iter().map(|s| (s * s) as f32).collect();
    for c in &classes {
        let range = c.first_row..c.first_row + c.rows;
        let searchable: Vec<bool> = flags[range.clone()].iter().map(|f| f & flag::SEARCHABLE != 0).collect();
        let features = ClassFeatures { codes: &codes[range], weights: &weights, searchable: &searchable };
        let built = build_graph(&features);
        graph.extend(built.edges.iter().flatten().flat_map(|e| e.to_le_bytes()));
        let count = searchable.iter().filter(|s| **s).count();
        class_bytes.extend(class_record(c, count, &built.entries));
    }

    let counts = Counts {
        joints: body.skeleton.joints(),
        dofs: body.dofs(),
        features: space.components.len(),
        window: options.window,
        styles: corpus.styles.len(),
        actions: corpus.actions.len(),
        classes: classes.len(),
        groups: groups.names.len(),
        frames,
        rows: all_rows.len(),
        block_rows: options.block_rows,
        timing: timing_dofs.len(),
        cycles: cycle_table.len(),
        clips: clip_table.len(),
    };
    let (cycle_bytes, knot_bytes) = cycle_sections(&cycle_table, &clip_table);
    // Of the second table each entry is there, looked at or not.
    let tables = [(&pairing.outputs, true), (&pairing.second, false)];
    let pairs = tables.into_iter().filter(|(table, _)| !table.is_empty()).flat_map(|(table, may_lack)| {
        (0..cycle_table.len()).flat_map(move |i| {
            let outputs = table.get(i);
            let none = if may_lack { NONE } else { i as u16 };
            (0..corpus.styles.len()).map(move |s| outputs.and_then(|o| o[s]).map_or(none, |o| o as u16))
        })
    });
    let names: Vec<String> = examples.iter().map(|e| e.clip.name.clone()).collect();
    let manifest = manifest(corpus, &examples, &groups, names, pairing.prototypes.len(), options);
    let required = Required {
        manifest,
        skeleton: skeleton_section(&body, &groups),
        dofs: steps
            .iter()
            .zip(&scales)
            .flat_map(|(a, b)| [a.to_le_bytes(), b.to_le_bytes()])
            .flatten()
            .collect(),
        query: space.section(&groups.of_joint),
        classes: class_bytes,
        clips: clip_table
            .iter()
            .flat_map(|&(f, r)| [f as u32, r as u32])
            .flat_map(u32::to_le_bytes)
            .collect(),
        cycles: cycle_bytes,
        knots: knot_bytes,
        pairs: pairs.flat_map(u16::to_le_bytes).collect(),
        blocks: packed.blocks.iter().flat_map(|b| b.to_le_bytes()).collect(),
        rows: packed.bytes,
        features: codes.iter().flatten().map(|&c| c as u8).collect(),
        graph,
        flags,
        timing: timing_section(&timing_dofs),
    };
    let mut sections: Vec<Section> = required.numbered().into();
    sections.push((section::FEET, feet_section(&body, &examples)));
    sections.extend(models);
    let bytes = assemble(&counts, corpus.rate_hz, &sections);
    Database::open(&bytes)?;
    Ok(Built { bytes, notes })
}

/// The style that the models take.
fn taken_style(corpus: &Corpus, options: &BuildOptions) -> Result<usize, BuildError> {
    match &options.from {
        Some(from) => corpus.style(from).map_err(BuildError::From),
        None => Ok(corpus.plain_style()),
    }
}

fn narrow(row: &[f64]) -> Vec<f32> {
    row.iter().map(|&v| v as f32).collect()
}

fn too_many(what: impl Into<String>, have: usize, most: usize, cure: &'static str) -> BuildError {
    BuildError::TooMany { what: what.into(), have, most, cure }
}

/// The examples of actions that have every style, sorted by class and name.
fn complete<'a>(corpus: &'a Corpus, notes: &mut Vec<String>) -> Result<Vec<&'a Example>, BuildError> {
    let there = |action: usize, style: usize| {
        corpus.examples.iter().any(|e| (e.action, e.style) == (action, style) && !e.cycles.is_empty())
    };
    let mut kept = Vec::new();
    let mut missing = Vec::new();
    for (a, action) in corpus.actions.iter().enumerate() {
        let without: Vec<&str> =
            (0..corpus.styles.len()).filter(|&s| !there(a, s)).map(|s| corpus.styles[s].as_str()).collect();
        if without.is_empty() {
            kept.push(a);
        } else {
            missing.push(format!("{action} lacks {}", without.join(", ")));
        }
    }
    if kept.is_empty() {
        return Err(BuildError::Unpaired(missing.join("; ")));
    }
    notes.extend(
        missing.into_iter().map(|m| format!("left out: action {m}: a frame needs an output in every style")),
    );
    let mut examples: Vec<&Example> = corpus.examples.iter().filter(|e| kept.contains(&e.action)).collect();
    examples.sort_by(|a, b| (a.action, a.style, &a.clip.name).cmp(&(b.action, b.style, &b.clip.name)));
    Ok(examples)
}

fn limits(corpus: &Corpus, classes: &[ClassRows], cycles: usize, frames: usize) -> Result<(), BuildError> {
    let fits = |what: &str, have: usize, most: usize, cure| {
        if have > most { Err(too_many(what, have, most, cure)) } else { Ok(()) }
    };
    fits("joints", corpus.skeleton.joints(), layout::MAX_JOINTS, "leave out fingers")?;
    fits("styles", corpus.styles.len(), layout::MAX_STYLES, "choose with --styles")?;
    fits("actions", corpus.actions.len(), layout::MAX_ACTIONS, "choose with --actions")?;
    fits("classes", classes.len(), MOST_CLASSES, "choose with --actions and --styles")?;
    fits("frames", frames, 1 << 22, "use fewer clips (--limit)")?;
    fits("cycles", cycles, usize::from(NONE) - 1, "use fewer clips (--limit)")?;
    for c in classes {
        let what = format!("frames of {} in {}", corpus.actions[c.action], corpus.styles[c.style]);
        fits(&what, c.rows, usize::from(u16::MAX), "use fewer clips (--limit), or split the action")?;
    }
    Ok(())
}

fn flags(examples: &[&Example], first_rows: &[usize], paired: &[bool], frames: usize) -> Vec<u8> {
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
    let count = rows.len() as f64;
    (0..rows[0].len())
        .map(|d| {
            let mean = rows.iter().map(|r| f64::from(r[d])).sum::<f64>() / count;
            let square = rows.iter().map(|r| (f64::from(r[d]) - mean).powi(2)).sum::<f64>() / count;
            // A dof that never moves still has a scale to divide by.
            square.sqrt().max(1e-4) as f32
        })
        .collect()
}

/// The dofs that timing looks at: those of the legs and arms that move most, each weighed by its spread and by that
/// of its change.
fn timing_metric(body: &Body, examples: &[&Example], dofs: &[Vec<Vec<f64>>]) -> Vec<(usize, f64, f64)> {
    let count: usize = examples.iter().map(|e| e.clip.frames.len()).sum();
    let variance = |value: &dyn Fn(&[Vec<f64>], usize) -> f64| {
        let all = || dofs.iter().flat_map(|rows| (0..rows.len()).map(move |t| value(rows, t)));
        let mean = all().sum::<f64>() / count as f64;
        all().map(|v| (v - mean).powi(2)).sum::<f64>() / count as f64
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

fn timing_section(entries: &[(usize, f64, f64)]) -> Vec<u8> {
    let mut bytes = Vec::new();
    for &(dof, pose, change) in entries {
        let mut record = [0; timing::LENGTH];
        record[timing::DOF].copy_from_slice(&(dof as u16).to_le_bytes());
        record[timing::POSE].copy_from_slice(&(pose as f32).to_le_bytes());
        record[timing::CHANGE].copy_from_slice(&(change as f32).to_le_bytes());
        bytes.extend(record);
    }
    bytes
}

fn class_record(c: &ClassRows, searchable: usize, entries: &[u16]) -> [u8; class::LENGTH] {
    let mut record = [0; class::LENGTH];
    // A neighborhood is a small part of its class.
    let cap = (searchable / 8).clamp(4, usize::from(u16::MAX)).min(searchable);
    for (range, value) in [
        (class::FIRST_ROW, c.first_row),
        (class::ROWS, c.rows),
        (class::FIRST_CYCLE, c.first_cycle),
        (class::CYCLES, c.cycles),
    ] {
        record[range].copy_from_slice(&(value as u32).to_le_bytes());
    }
    for (range, value) in [
        (class::ACTION, c.action),
        (class::STYLE, c.style),
        (class::K_CAP, cap),
        (class::SEARCHABLE, searchable),
    ] {
        record[range].copy_from_slice(&(value as u16).to_le_bytes());
    }
    for (slot, entry) in record[class::ENTRY_POINTS].chunks_exact_mut(2).zip(entries) {
        slot.copy_from_slice(&entry.to_le_bytes());
    }
    record
}

fn cycle_sections(cycles: &[(usize, Cycle)], clips: &[(usize, usize)]) -> (Vec<u8>, Vec<u8>) {
    let (mut bytes, mut knots) = (Vec::new(), Vec::new());
    for (clip, timeline) in cycles {
        let (first_row, rows) = clips[*clip];
        let start = first_row + (timeline.span().0.ceil().max(0.0) as usize).min(rows - 1);
        let mut record = [0; cycle::LENGTH];
        record[cycle::CLIP].copy_from_slice(&(*clip as u32).to_le_bytes());
        record[cycle::FIRST_KNOT].copy_from_slice(&((knots.len() / 4) as u32).to_le_bytes());
        record[cycle::KNOTS].copy_from_slice(&(timeline.knots.len() as u16).to_le_bytes());
        record[cycle::START].copy_from_slice(&(start as u32).to_le_bytes());
        bytes.extend(record);
        knots.extend(timeline.knots.iter().flat_map(|&k| (k as f32).to_le_bytes()));
    }
    (bytes, knots)
}

fn skeleton_section(body: &Body, groups: &Groups) -> Vec<u8> {
    let mut bytes = Vec::new();
    for j in 0..body.skeleton.joints() {
        let mut record = [0; joint::LENGTH];
        record[joint::PARENT] = body.skeleton.parents[j].map_or(joint::ROOT, |p| p as u8);
        record[joint::GROUP] = groups.of_joint[j] as u8;
        let mean = body.means[j].coords;
        let numbers = body.skeleton.offsets[j].iter().chain(mean.iter()).map(|&v| v as f32);
        for (slot, value) in record[joint::OFFSET.start..].chunks_exact_mut(4).zip(numbers) {
            slot.copy_from_slice(&value.to_le_bytes());
        }
        bytes.extend(record);
    }
    let mut trailer = [0; joint::TRAILER];
    for (slot, value) in trailer[joint::HIPS_LINE].chunks_exact_mut(4).zip(body.hips_line.iter()) {
        slot.copy_from_slice(&(*value as f32).to_le_bytes());
    }
    for (slot, &toe) in trailer[joint::TOES].iter_mut().zip(&body.landmarks.toes) {
        *slot = toe as u8;
    }
    bytes.extend(trailer);
    bytes
}

/// The legs, and how high ankles and toes are where they carry the foot.
fn feet_section(body: &Body, examples: &[&Example]) -> Vec<u8> {
    let marks = &body.landmarks;
    let heights = contact::sole_heights(examples, marks);
    let mut bytes = Vec::new();
    for side in [0, 1] {
        let mut record = [0; foot::LENGTH];
        record[foot::HIP] = marks.hip_joints[side] as u8;
        record[foot::KNEE] = marks.knees[side] as u8;
        record[foot::ANKLE] = marks.feet[side] as u8;
        let toes = marks.toes[side] != marks.feet[side];
        record[foot::TOE] = if toes { marks.toes[side] as u8 } else { foot::NO_TOE };
        let [ankle, toe] = heights[side].map(|h| h as f32);
        record[foot::ANKLE_HEIGHT].copy_from_slice(&ankle.to_le_bytes());
        record[foot::TOE_HEIGHT].copy_from_slice(&if toes { toe } else { 0.0 }.to_le_bytes());
        bytes.extend(record);
    }
    bytes
}

fn manifest(
    corpus: &Corpus,
    examples: &[&Example],
    groups: &Groups,
    mut clips: Vec<String>,
    prototypes: usize,
    options: &BuildOptions,
) -> Vec<u8> {
    let lines = |names: &[String]| names.iter().map(|n| n.replace('\n', " ")).collect::<Vec<_>>().join("\n");
    clips.extend((0..prototypes).map(|i| format!("prototype-{i}")));
    let mut licences: Vec<String> =
        examples.iter().map(|e| e.licence.clone()).filter(|l| !l.is_empty()).collect();
    licences.sort();
    licences.dedup();
    let parameters = [
        format!("pairing = {}", options.pairing.name()),
        format!("window = {}", options.window),
        format!("error_cm = {}", options.error_cm),
        format!("block_rows = {}", options.block_rows),
        format!("prototypes = {prototypes}"),
    ];
    let strings = [
        lines(&corpus.skeleton.names),
        lines(&corpus.actions),
        lines(&corpus.styles),
        groups.names.join("\n"),
        lines(&clips),
        lines(&licences),
        parameters.join("\n"),
    ];
    let [joints, actions, styles, groups, clips, licences, parameters] = strings.each_ref().map(|s| Names(s));
    let builder = concat!("gestus-builder ", env!("CARGO_PKG_VERSION"));
    let manifest =
        Manifest { builder, unit: "m", joints, actions, styles, groups, clips, licences, parameters };
    // A struct of strings can't fail to serialise.
    postcard::to_stdvec(&manifest).unwrap_or_default()
}
