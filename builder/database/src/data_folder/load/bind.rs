//! From files to clips with labels, one by one.

use std::{
    collections::HashMap,
    fmt::Display,
    path::{Path, PathBuf},
};

use rayon::prelude::*;

use crate::{
    data_folder::{
        config::{AnnotateError, Annotation, Config},
        left_out::{LeftOut, Reason},
        worlds::Up,
    },
    registration::has_cycles,
};
use gestus_motion::{
    animation::Recording,
    binding::{Options, to_clip},
    capture::{Document, Folder},
    clip::Clip,
};

/// A clip with its file's labels.
#[derive(Clone)]
pub(super) struct Bound {
    pub name: String,
    /// The file below the folder, without its ending.
    pub below: String,
    pub annotation: Annotation,
    /// The unit, if guessed.
    pub guessed: Option<String>,
    /// A warning about the body's size, if the unit was not guessed.
    pub doubt: Option<String>,
    /// The height of its floor, metres, if the configuration states it.
    pub floor_m: Option<f64>,
    /// Up in its world.
    pub up: Up,
    /// Whether registration has a timeline for it.
    pub has_cycles: bool,
    pub clip: Clip,
}

/// A path below a folder.
pub(super) fn below<'p>(folder: &Path, path: &'p Path) -> &'p Path {
    path.strip_prefix(folder).unwrap_or(path)
}

/// Converts all readable files that are selected. Adds the others that should have been usable to `left_out`.
pub(super) fn bind_all(
    config: &Config,
    folder: &Path,
    files: &Folder,
    left_out: &mut Vec<LeftOut>,
) -> Result<Vec<Bound>, AnnotateError> {
    let below = |path: &Path| below(folder, path).to_path_buf();
    left_out.extend(files.skipped.iter().map(|error| {
        LeftOut::new(Reason::Unreadable, below(Path::new(error.file())).to_string_lossy(), error)
    }));
    // Files that can't be read have names too.
    let named: Vec<PathBuf> = (files.documents.iter().map(|(path, _)| below(path)))
        .chain(files.skipped.iter().map(|e| below(Path::new(e.file()))))
        .collect();
    let paths: Vec<&Path> = named.iter().map(PathBuf::as_path).collect();
    config.check_names(&paths)?;
    let bound: Vec<Result<Option<Bound>, LeftOut>> = files
        .documents
        .par_iter()
        .map(|(path, document)| bind(config, &below(path), path, document))
        .collect();
    let mut clips: Vec<Bound> = Vec::new();
    for clip in bound {
        match clip {
            Ok(clip) => clips.extend(clip),
            Err(why) => left_out.push(why),
        }
    }
    Ok(clips)
}

/// Names clips by their files; clips of the same name in several folders get the folder's name too.
pub(super) fn disambiguate_names(clips: &mut [Bound]) {
    let mut count = HashMap::<String, usize>::new();
    for clip in clips.iter() {
        *count.entry(clip.clip.name.clone()).or_default() += 1;
    }
    for clip in clips.iter_mut().filter(|c| count[&c.clip.name] > 1) {
        clip.clip.name.clone_from(&clip.below);
    }
}

/// Converts a file to a clip at the database's rate; `None` if it is not selected.
fn bind(config: &Config, below: &Path, path: &Path, document: &Document) -> Result<Option<Bound>, LeftOut> {
    let name = document.name().to_owned();
    let file = below.to_string_lossy();
    let annotation = config.annotate(below).map_err(|e| LeftOut::new(Reason::Unlabelled, file.clone(), e))?;
    if !config.wants(&annotation) {
        return Ok(None);
    }
    let options = Options { unit: config.unit(), ..Options::default() };
    let unread =
        |e: &dyn Display| LeftOut::new(Reason::Unreadable, file.clone(), format_args!("{name}: {e}"));
    let (clip, binding) = to_clip(document, &options).map_err(|e| unread(&e))?;
    let mut clip = clip.fitted(config.rate_hz).map_err(|e| unread(&e))?;
    clip.name = path.file_stem().map_or_else(|| name.clone(), |s| s.to_string_lossy().into_owned());
    let steps: Vec<_> = below.with_extension("").iter().map(|s| s.to_string_lossy().into_owned()).collect();
    let guessed = (config.unit.is_none() && document.unit().is_none()).then(|| binding.unit().name());
    let doubt = binding.doubt().map(|doubt| format!("{name}: {doubt}"));
    let has_cycles = has_cycles(&clip, annotation.kind);
    let floor_m = config.floor(below);
    let up = Up::of(document, &clip, config.up);
    let below = steps.join("/");
    Ok(Some(Bound { name, below, annotation, guessed, doubt, floor_m, up, has_cycles, clip }))
}
