//! The manifest.

use gestus_core::blob::{Manifest, Names};
use gestus_motion::corpus::{Corpus, Example};

use crate::{build::BuildOptions, search::groups::Groups};

/// Encodes names, licences and build parameters.
pub fn encode(
    corpus: &Corpus,
    examples: &[&Example],
    groups: &Groups,
    prototypes: usize,
    options: &BuildOptions,
) -> Vec<u8> {
    let lines = |names: &[String]| names.iter().map(|n| n.replace('\n', " ")).collect::<Vec<_>>().join("\n");
    let mut clips: Vec<String> = examples.iter().map(|e| e.clip.name.clone()).collect();
    clips.extend((0..prototypes).map(|i| format!("prototype-{i}")));
    let mut licences: Vec<String> =
        examples.iter().map(|e| e.licence.clone()).filter(|l| !l.is_empty()).collect();
    licences.sort();
    licences.dedup();
    let mut parameters = vec![
        format!("pairing = {}", options.pairing.name()),
        format!("window = {}", options.window),
        format!("error_cm = {}", options.error_cm),
        format!("block_rows = {}", options.block_rows),
        format!("prototypes = {prototypes}"),
    ];
    if options.cycles > 0 {
        parameters.push(format!("cycles = {}", options.cycles));
    }
    if !options.rig.is_empty() {
        parameters.push(format!("rig = {}", options.rig.replace(char::is_control, "_")));
    }
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
    // Serialising a struct of strings can't fail.
    postcard::to_stdvec(&manifest).unwrap_or_default()
}
