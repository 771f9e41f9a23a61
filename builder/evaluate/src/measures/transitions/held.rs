//! The clips that are held out, and the streams that a motion graph makes of them.

use anyhow::Result;
use gestus_database::motion_graph::{MotionGraph, Walk, WalkOptions};
use gestus_motion::{body::Body, corpus::Corpus};

use crate::experiment::Experiment;

/// Times since a transition began, seconds, that have a row of their own; and what is later.
pub(super) const SINCE_S: [(f64, &str); 3] =
    [(0.5, "0.0-0.5 s"), (1.0, "0.5-1.0 s"), (f64::INFINITY, "later")];

/// What both parts share.
pub(super) struct Held<'a> {
    pub(super) experiment: &'a Experiment,
    pub(super) body: Body,
    /// The clips that are held out.
    pub(super) clips: Vec<usize>,
}

/// A walk over held-out clips.
pub(super) struct Stream {
    pub(super) walk: Walk,
    /// The experiment's clip of each frame.
    pub(super) clips: Vec<usize>,
    /// Seconds since the last transition began, at each frame; infinite before the first.
    pub(super) since_s: Vec<f64>,
}

/// Of each class, the first `folds` clips by name that may be tested, as long as another one remains to be searched.
pub(super) fn held_out(experiment: &Experiment) -> Vec<usize> {
    let examples = &experiment.corpus.examples;
    let mut held = Vec::new();
    for action in 0..experiment.corpus.actions.len() {
        for style in 0..experiment.corpus.styles.len() {
            let of_class = |i: &usize| (examples[*i].action, examples[*i].style) == (action, style);
            let all: Vec<usize> = (0..examples.len()).filter(of_class).collect();
            let mut clips: Vec<usize> =
                all.iter().copied().filter(|&i| experiment.may_be_tested(i)).collect();
            clips.sort_by(|&a, &b| examples[a].clip.name.cmp(&examples[b].clip.name));
            let most = experiment.folds.min(all.len().saturating_sub(1));
            held.extend(clips.into_iter().take(most));
        }
    }
    held.sort_unstable();
    held
}

impl Held<'_> {
    /// A walk over the held-out clips, of one style or of all.
    pub(super) fn stream(&self, style: Option<usize>, options: &WalkOptions) -> Result<Stream> {
        let corpus = &self.experiment.corpus;
        let used: Vec<usize> = self
            .clips
            .iter()
            .copied()
            .filter(|&i| style.is_none_or(|s| corpus.examples[i].style == s))
            .collect();
        let others: Vec<usize> = (0..corpus.examples.len()).filter(|i| !used.contains(i)).collect();
        let subset: Corpus = corpus.without(&others);
        let walk = MotionGraph::of(&subset)?.walk(options);
        let clips = walk.labels.iter().map(|l| used[l.clip]).collect();
        let mut since = f64::INFINITY;
        let mut transitions = walk.transitions.iter().map(|t| t.frame).peekable();
        let since_s = (0..walk.labels.len())
            .map(|t| {
                since += 1.0 / corpus.rate_hz;
                if transitions.next_if_eq(&t).is_some() {
                    since = 0.0;
                }
                since
            })
            .collect();
        Ok(Stream { walk, clips, since_s })
    }
}
