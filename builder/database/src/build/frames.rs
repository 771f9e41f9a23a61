//! Second stage: frames in rows, class after class, and their cycles.

use gestus_core::blob::layout::{self, NONE};
use gestus_motion::corpus::Corpus;

use super::{clips::Clips, options::BuildError};
use crate::{
    blob::classes::ClassRows,
    pairing::{ClassName, CycleData},
    stream::MOST_CLASSES,
};

/// The layout of the clips' frames in the database.
pub(super) struct Frames<'a> {
    pub classes: Vec<ClassRows>,
    /// First row of each clip.
    pub first_rows: Vec<usize>,
    /// Sorted by class, clip and time.
    pub cycles: Vec<CycleData<'a>>,
    /// Number of captured frames.
    pub count: usize,
}

impl<'a> Frames<'a> {
    pub fn new(clips: &'a Clips<'_>) -> Result<Self, BuildError> {
        let mut classes: Vec<ClassRows> = Vec::new();
        let mut first_rows = Vec::new();
        let mut cycles: Vec<CycleData<'_>> = Vec::new();
        let mut rows = 0;
        for (clip, (example, dofs)) in clips.examples.iter().zip(&clips.dofs).enumerate() {
            let (action, style) = (example.action, example.style);
            if classes.last().is_none_or(|c| (c.action, c.style) != (action, style)) {
                let first_cycle = cycles.len();
                classes.push(ClassRows { action, style, first_row: rows, rows: 0, first_cycle, cycles: 0 });
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
        limits(clips.corpus, &classes, cycles.len(), rows)?;
        Ok(Self { classes, first_rows, cycles, count: rows })
    }

    /// Action and style of each class.
    pub fn names(&self) -> Vec<ClassName> {
        self.classes.iter().map(|c| (c.action, c.style)).collect()
    }
}

fn limits(corpus: &Corpus, classes: &[ClassRows], cycles: usize, frames: usize) -> Result<(), BuildError> {
    let fits = |what: &str, have: usize, most: usize, cure| {
        if have > most { Err(BuildError::too_many(what, have, most, cure)) } else { Ok(()) }
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
