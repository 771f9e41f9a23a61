//! A part of the cycles: those of each class that stand for the others best, and their clips cut to them.

use gestus_motion::{
    body::row_at,
    clip::Clip,
    corpus::{Cycle, Example},
    statistics::{distance2, moments},
};

use super::{clips::Clips, frames::Frames, medoids::medoids};
use crate::pairing::{CycleData, Pairing, Scheme, pair_among};

/// Phases at which cycles are compared.
const PHASES: usize = 12;
/// Rows kept before the one in which a cycle begins: the frame before, also of an output that is slower.
const BEFORE: usize = 1;

/// Cycles that can be chosen, and the distances between them.
pub(super) struct Choices {
    /// Of each class, or of each action where cycles are paired by take.
    groups: Vec<Group>,
    cycles: usize,
}

/// Cycles that stand for each other.
struct Group {
    /// Cycles that are kept or left out together.
    items: Vec<Vec<usize>>,
    /// Between items, shape `[items][items]`.
    distances: Vec<Vec<f64>>,
}

impl Choices {
    /// The choices among some of the cycles.
    pub fn new(clips: &Clips<'_>, frames: &Frames<'_>, allowed: &[bool]) -> Self {
        let shapes = shapes(&frames.cycles);
        let distance = |a: &Vec<usize>, b: &Vec<usize>| {
            let pairs = a.iter().zip(b);
            pairs.map(|(&a, &b)| distance2(&shapes[a], &shapes[b])).sum::<f64>().sqrt()
        };
        let items = match clips.options.pairing {
            Scheme::Take => by_take(frames, allowed),
            _ => (0..frames.classes.len())
                .map(|c| of_class(frames, c).filter(|&i| allowed[i]).map(|i| vec![i]).collect())
                .collect(),
        };
        let group = |items: Vec<Vec<usize>>| {
            let distances = items.iter().map(|a| items.iter().map(|b| distance(a, b)).collect()).collect();
            Group { items, distances }
        };
        Self { groups: items.into_iter().map(group).collect(), cycles: frames.cycles.len() }
    }

    /// Cycles of the largest class.
    pub fn most(&self) -> usize {
        self.groups.iter().map(|g| g.items.len()).max().unwrap_or(0)
    }

    /// At most `count` cycles of each class, the medoids of all; whether each is kept.
    pub fn keep(&self, count: usize) -> Vec<bool> {
        let mut kept = vec![false; self.cycles];
        for group in &self.groups {
            for item in medoids(&group.distances, count) {
                group.items[item].iter().for_each(|&i| kept[i] = true);
            }
        }
        kept
    }
}

fn of_class<'f>(frames: &'f Frames<'_>, class: usize) -> impl Iterator<Item = usize> + 'f {
    let class = &frames.classes[class];
    class.first_cycle..class.first_cycle + class.cycles
}

/// For each action, the cycles of the same take and place in every style.
fn by_take(frames: &Frames<'_>, allowed: &[bool]) -> Vec<Vec<Vec<usize>>> {
    let names = frames.names();
    let mut actions: Vec<usize> = names.iter().map(|n| n.0).collect();
    actions.dedup();
    let classes = |action: usize| (0..names.len()).filter(move |&c| frames.classes[c].action == action);
    actions
        .into_iter()
        .map(|action| {
            let Some(first) = classes(action).next() else { return Vec::new() };
            let same = |a: usize| {
                let (take, index) = (frames.cycles[a].take, frames.cycles[a].index);
                let of = |c| {
                    of_class(frames, c).find(|&i| {
                        allowed[i] && (frames.cycles[i].take, frames.cycles[i].index) == (take, index)
                    })
                };
                classes(action).map(of).collect::<Option<Vec<usize>>>()
            };
            of_class(frames, first).filter_map(same).collect()
        })
        .collect()
}

/// Every cycle's dofs at uniform canonical times, and the logarithm of its duration, each by its standard deviation.
fn shapes(cycles: &[CycleData<'_>]) -> Vec<Vec<f64>> {
    let at = |c: &CycleData<'_>, p: usize| row_at(c.dofs, c.cycle.position(p as f64 / PHASES as f64));
    let mut shapes: Vec<Vec<f64>> =
        cycles.iter().map(|c| (0..PHASES).flat_map(|p| at(c, p)).collect()).collect();
    let dofs = shapes.first().map_or(0, |s| s.len() / PHASES);
    for d in 0..dofs {
        let values = shapes.iter().flat_map(|s| s.iter().skip(d).step_by(dofs).copied());
        let spread = moments(values, 1e-4).1;
        shapes.iter_mut().for_each(|s| s.iter_mut().skip(d).step_by(dofs).for_each(|v| *v /= spread));
    }
    let duration = |c: &CycleData<'_>| (c.cycle.span().1 - c.cycle.span().0).max(1e-6).ln();
    let spread = moments(cycles.iter().map(duration), 1e-4).1;
    for (shape, cycle) in shapes.iter_mut().zip(cycles) {
        // It counts as much as a dof.
        shape.push(duration(cycle) / spread * (PHASES as f64).sqrt());
    }
    shapes
}

/// The kept cycles, each in a clip of its own or with those next to it.
pub(super) struct Cut {
    pub examples: Vec<Example>,
    pub dofs: Vec<Vec<Vec<f64>>>,
    /// Where each clip starts among all frames.
    pub first_frames: Vec<usize>,
}

impl Cut {
    /// The clips as they are cut, with all that the whole ones have in common.
    pub fn clips<'a>(&'a self, whole: &Clips<'a>) -> Clips<'a> {
        Clips {
            corpus: whole.corpus,
            options: whole.options,
            body: whole.body.clone(),
            groups: whole.groups.clone(),
            examples: self.examples.iter().collect(),
            dofs: self.dofs.clone(),
            notes: Vec::new(),
        }
    }

    /// Cuts the clips.
    pub fn new(clips: &Clips<'_>, frames: &Frames<'_>, kept: &[bool]) -> Self {
        let mut cut = Self { examples: Vec::new(), dofs: Vec::new(), first_frames: Vec::new() };
        let mut kept = kept.iter();
        for (clip, example) in clips.examples.iter().enumerate() {
            let rows = example.clip.frames.len();
            let mut spans: Vec<(std::ops::Range<usize>, Vec<&Cycle>)> = Vec::new();
            for cycle in example.cycles.iter().zip(&mut kept).filter_map(|(c, kept)| kept.then_some(c)) {
                let (start, end) = cycle.span();
                let from = (start.floor().max(0.0) as usize).saturating_sub(BEFORE);
                let to = (end.ceil().max(0.0) as usize + 1).min(rows);
                match spans.last_mut().filter(|(span, _)| from <= span.end) {
                    Some((span, cycles)) => {
                        span.end = span.end.max(to);
                        cycles.push(cycle);
                    }
                    None => spans.push((from..to, vec![cycle])),
                }
            }
            for (span, cycles) in spans {
                cut.dofs.push(clips.dofs[clip][span.clone()].to_vec());
                cut.first_frames.push(frames.first_rows[clip] + span.start);
                cut.examples.push(part(example, span, &cycles));
            }
        }
        cut
    }
}

/// A part of a clip with some of its cycles.
fn part(example: &Example, span: std::ops::Range<usize>, cycles: &[&Cycle]) -> Example {
    let Example { clip, action, style, take, contacts, licence, .. } = example;
    let from = span.start;
    let whole = from == 0 && span.end == clip.frames.len();
    let shifted = |cycle: &&Cycle| Cycle { knots: cycle.knots.iter().map(|k| k - from as f64).collect() };
    Example {
        clip: Clip {
            name: if whole { clip.name.clone() } else { format!("{}@{from}", clip.name) },
            skeleton: clip.skeleton.clone(),
            rate_hz: clip.rate_hz,
            frames: clip.frames[span.clone()].to_vec(),
        },
        action: *action,
        style: *style,
        take: take.clone(),
        contacts: contacts[span].to_vec(),
        cycles: cycles.iter().map(shifted).collect(),
        licence: licence.clone(),
    }
}

/// The outputs of the kept cycles among themselves, in the numbers that they have when the others are gone.
pub(super) fn pairing(clips: &Clips<'_>, frames: &Frames<'_>, kept: &[bool]) -> Pairing {
    let (styles, scheme) = (clips.corpus.styles.len(), clips.options.pairing);
    let among = pair_among(&frames.cycles, &frames.names(), styles, scheme, kept);
    let count = kept.iter().filter(|kept| **kept).count();
    let mut next = 0;
    let mut number: Vec<Option<usize>> = kept
        .iter()
        .map(|&kept| {
            next += usize::from(kept);
            kept.then(|| next - 1)
        })
        .collect();
    number.extend((0..among.prototypes.len()).map(|p| Some(count + p)));
    let renumbered = |table: &[Vec<Option<usize>>]| -> Vec<Vec<Option<usize>>> {
        let rows = table.iter().zip(kept).filter(|(_, kept)| **kept);
        rows.map(|(row, _)| row.iter().map(|o| o.and_then(|o| number[o])).collect()).collect()
    };
    Pairing {
        outputs: renumbered(&among.outputs),
        second: renumbered(&among.second),
        prototypes: among.prototypes,
    }
}
