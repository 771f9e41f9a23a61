//! Last stage: the sections of a blob.

use gestus_core::blob::{
    Counts,
    layout::section::{self, Optional, Required},
};

use super::{
    clips::Clips,
    index::{Features, Index, Shared, Stored},
    options::BuildOptions,
};
use crate::blob::{
    assemble::{Section, assemble},
    classes, dofs, feet, manifest, pairs, search, skeleton, timing, trust,
};
use crate::models;

/// What is estimated from all clips, whichever are stored.
pub(super) struct Estimates<'a> {
    pub clips: &'a Clips<'a>,
    pub models: &'a models::Sections,
    pub features: &'a Features,
    pub shared: &'a Shared,
    /// The phase tables.
    pub phase: Option<&'a [u8]>,
}

/// Encodes the results of all stages as a blob.
pub(super) fn encode(
    stored: &Stored<'_>,
    index: Index,
    estimates: &Estimates<'_>,
    options: &BuildOptions,
) -> Vec<u8> {
    let Stored { clips: Clips { corpus, body, groups, examples, .. }, frames, pairing, .. } = stored;
    let Estimates { models, features: Features { space, .. }, shared, .. } = estimates;
    let counts = Counts {
        joints: body.skeleton.joints(),
        dofs: body.dofs(),
        features: space.components.len(),
        window: options.window,
        styles: corpus.styles.len(),
        actions: corpus.actions.len(),
        classes: frames.classes.len(),
        groups: groups.names.len(),
        frames: frames.count,
        rows: index.rows,
        block_rows: options.block_rows,
        timing: shared.timing.len(),
        cycles: index.cycles.len(),
        clips: index.clips.len(),
    };
    let (cycle_bytes, knot_bytes) = pairs::encode_cycles(&index.cycles, &index.clips);
    let required = Required {
        manifest: manifest::encode(corpus, examples, groups, pairing.prototypes.len(), options),
        skeleton: skeleton::encode(body, groups),
        dofs: dofs::encode(&shared.steps, &shared.scales, &shared.ranges),
        query: space.section(&groups.of_joint),
        classes: classes::encode(&frames.classes, &index.searchable, &index.graphs),
        clips: classes::encode_clips(&index.clips),
        cycles: cycle_bytes,
        knots: knot_bytes,
        pairs: pairs::encode(pairing, index.cycles.len(), corpus.styles.len()),
        blocks: index.packed.blocks.iter().flat_map(|b| b.to_le_bytes()).collect(),
        rows: index.packed.bytes,
        features: search::encode_features(&index.codes),
        graph: search::encode_graphs(&index.graphs),
        flags: index.flags,
        timing: timing::encode(&shared.timing),
    };
    let optional = Optional {
        feet: Some(feet::encode(body, &estimates.clips.examples)),
        lti: models.lti.clone(),
        statistic: models.statistic.clone(),
        phase: estimates.phase.map(<[u8]>::to_vec),
        distances: Some(search::encode_distances(&index.falls, &index.codes, &space.scales)),
        trust: Some(trust::encode(&index.trust_limits)),
        // Put into a finished blob: the dial is measured by streaming clips through it, a map needs another body.
        effort: None,
        retarget: None,
    };
    let mut optional: Vec<Section> =
        optional.numbered().into_iter().filter_map(|(id, content)| Some((id, content?))).collect();
    // Feet are written first: the order of earlier blobs.
    optional.sort_by_key(|&(id, _)| id != section::FEET);
    let mut sections: Vec<Section> = required.numbered().into();
    sections.extend(optional);
    assemble(&counts, corpus.rate_hz, &sections)
}
