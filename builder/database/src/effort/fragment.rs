//! Fragments: the basic units of motion in a clip (Torresani 2006, section 3.1).
//!
//! Fragments are found by cycles: a gait is cut from left strike to left strike, so that all fragments begin at the same
//! moment of the action; any other clip is cut where the body rests. Or they are annotated by a person.

use std::sync::Arc;

use gestus_core::{
    Database,
    blob::{
        layout::{cycle, dof, flag, section},
        read::Record,
    },
};
use nalgebra::Vector3;

use crate::{blob::export, registration::timeline::GAIT_KNOTS};
use gestus_motion::{
    body::{Body, database_skeleton},
    clip::{Clip, Frame, Skeleton},
    corpus::Corpus,
    landmarks::{LandmarkError, Landmarks},
    statistics::{quantile, smooth, sorted},
};

/// Greatest speed of a rest, relative to the clip's 95th percentile of speed.
const REST_SPEED: f64 = 0.08;
/// Shortest rest, seconds.
const REST_S: f64 = 0.3;
/// Shortest fragment, seconds.
const MIN_FRAGMENT_S: f64 = 0.4;
/// Fewest frames of a cycle with a usable timing.
pub const MIN_FRAMES: usize = 8;

/// A stretch of a clip.
#[derive(Debug, Clone, PartialEq)]
pub struct Span {
    /// Name of the clip.
    pub clip: String,
    /// First frame.
    pub from: usize,
    /// End, exclusive.
    pub to: usize,
}

impl Span {
    /// Whether two spans begin at the same frame of a clip. The end of one may be cut off with its clip.
    pub fn begins_with(&self, other: &Self) -> bool {
        self.clip == other.clip && self.from == other.from
    }
}

/// A fragment with its motion.
#[derive(Debug, Clone)]
pub struct Fragment {
    /// Where it is from.
    pub span: Span,
    /// Action of its clip.
    pub action: usize,
    /// Style of its clip.
    pub style: usize,
    /// Its dofs, shape `[frames][D]`.
    pub rows: Vec<Vec<f64>>,
    /// Its content: tilt and joint angles, radians, shape `[frames][C]`.
    pub content: Vec<Vec<f64>>,
}

impl Fragment {
    /// A fragment of those rows.
    pub fn new(span: Span, action: usize, style: usize, rows: Vec<Vec<f64>>) -> Self {
        let content = content(&rows);
        Self { span, action, style, rows, content }
    }
}

/// Angles of each row; speed and height are not content.
pub fn content(rows: &[Vec<f64>]) -> Vec<Vec<f64>> {
    let angles = |r: &Vec<f64>| [&r[dof::TILT..dof::FORWARD], &r[dof::JOINTS..]].concat();
    rows.iter().map(angles).collect()
}

/// The fragments of a corpus.
#[derive(Debug, Clone)]
pub struct Library {
    /// The body of the dofs.
    pub body: Body,
    /// Frames a second.
    pub rate_hz: f64,
    /// Names of the actions.
    pub actions: Vec<String>,
    /// Names of the styles.
    pub styles: Vec<String>,
    /// The fragments.
    pub fragments: Vec<Fragment>,
}

impl Library {
    /// Finds the fragments of a corpus.
    ///
    /// # Errors
    /// [`LandmarkError`] where the skeleton has no legs.
    pub fn found(corpus: &Corpus) -> Result<Self, LandmarkError> {
        let mut library = Self::empty(corpus)?;
        for example in &corpus.examples {
            let rows = library.body.clip_dofs(&example.clip);
            for cycle in &example.cycles {
                let (from, to) = cycle.span();
                let whole = (from.round().max(0.0) as usize, (to.round() as usize).min(rows.len()));
                for (from, to) in library.cut(&rows, cycle.knots.len(), whole) {
                    let span = Span { clip: example.clip.name.clone(), from, to };
                    let rows = rows[from..to].to_vec();
                    library.fragments.push(Fragment::new(span, example.action, example.style, rows));
                }
            }
        }
        Ok(library)
    }

    /// The fragments that a person marked. Spans of clips that are not in the corpus are left out.
    ///
    /// # Errors
    /// [`LandmarkError`] where the skeleton has no legs.
    pub fn annotated(corpus: &Corpus, spans: &[Span]) -> Result<Self, LandmarkError> {
        let mut library = Self::empty(corpus)?;
        for example in &corpus.examples {
            let mut rows = None;
            for span in spans.iter().filter(|s| s.clip == example.clip.name) {
                let rows = rows.get_or_insert_with(|| library.body.clip_dofs(&example.clip));
                let to = span.to.min(rows.len());
                if to >= span.from + 2 {
                    let span = Span { to, ..span.clone() };
                    let rows = rows[span.from..to].to_vec();
                    library.fragments.push(Fragment::new(span, example.action, example.style, rows));
                }
            }
        }
        Ok(library)
    }

    /// The fragments of the cycles that a database holds, cut as [`found`](Self::found) cuts a corpus.
    ///
    /// # Errors
    /// [`LandmarkError`] where the skeleton has no legs.
    pub fn of_database(database: &Database<'_>) -> Result<Self, LandmarkError> {
        let skeleton: Arc<Skeleton> = Arc::new(database_skeleton(database));
        let landmarks = Landmarks::find(&skeleton)?;
        let hips_line = Vector3::from(database.hips_line().map(f64::from));
        let joints = skeleton.joints();
        let identity = vec![nalgebra::UnitQuaternion::identity(); joints];
        let body = Body { skeleton, landmarks, means: identity, hips_line }.with_means_of(database);
        let manifest = database.manifest().ok();
        let names = |pick: fn(&gestus_core::blob::Manifest<'_>) -> Vec<String>| {
            manifest.as_ref().map(pick).unwrap_or_default()
        };
        let clips = names(|m| m.clips.iter().map(String::from).collect());
        let mut library = Self {
            body,
            rate_hz: f64::from(database.rate_hz()),
            actions: names(|m| m.actions.iter().map(String::from).collect()),
            styles: names(|m| m.styles.iter().map(String::from).collect()),
            fragments: Vec::new(),
        };
        for (number, class) in database.classes().enumerate() {
            let mut row = class.first_row;
            while row < class.first_row + class.rows {
                let first = row;
                let cycle = database.cycle_of(number, row);
                let same = |r: usize| {
                    r < class.first_row + class.rows
                        && database.flags(r) & flag::SEARCHABLE != 0
                        && database.cycle_of(number, r) == cycle
                };
                while same(row) {
                    row += 1;
                }
                let wide = |r| export::row(database, r).into_iter().map(f64::from).collect();
                let rows: Vec<Vec<f64>> = (first..row).map(wide).collect();
                let knots = cycle.map_or(GAIT_KNOTS, |c| knots(database, c));
                for (from, to) in library.cut(&rows, knots, (0, rows.len())) {
                    let clip = (0..database.counts().clips).find(|&c| {
                        let (start, rows) = database.clip(c);
                        (start..start + rows).contains(&first)
                    });
                    let start = clip.map_or(0, |c| database.clip(c).0);
                    let clip = clip.and_then(|c| clips.get(c).cloned()).unwrap_or_default();
                    let span = Span { clip, from: first + from - start, to: first + to - start };
                    let (action, style) = (usize::from(class.action), usize::from(class.style));
                    library.fragments.push(Fragment::new(span, action, style, rows[from..to].to_vec()));
                }
                row = row.max(first + 1);
            }
        }
        Ok(library)
    }

    /// The fragments that a person marked, of the clips that a database holds.
    ///
    /// # Errors
    /// [`LandmarkError`] where the skeleton has no legs.
    pub fn marked(database: &Database<'_>, spans: &[Span]) -> Result<Self, LandmarkError> {
        let mut library = Self::of_database(database)?;
        library.fragments.clear();
        let clips = database.manifest().ok().map(|m| m.clips);
        for span in spans {
            let Some(clip) = clips.and_then(|c| c.find(&span.clip)) else { continue };
            let (first, rows) = database.clip(usize::from(clip));
            let class = database.classes().find(|c| (c.first_row..c.first_row + c.rows).contains(&first));
            let to = span.to.min(rows);
            // Prototypes are clips of no class.
            let Some(class) = class.filter(|_| to >= span.from + 2) else { continue };
            let wide = |r| export::row(database, r).into_iter().map(f64::from).collect();
            let span = Span { to, ..span.clone() };
            let rows = (first + span.from..first + to).map(wide).collect();
            let (action, style) = (usize::from(class.action), usize::from(class.style));
            library.fragments.push(Fragment::new(span, action, style, rows));
        }
        Ok(library)
    }

    fn empty(corpus: &Corpus) -> Result<Self, LandmarkError> {
        Ok(Self {
            body: Body::of(corpus)?,
            rate_hz: corpus.rate_hz,
            actions: corpus.actions.clone(),
            styles: corpus.styles.clone(),
            fragments: Vec::new(),
        })
    }

    /// The fragments within a cycle of some rows: a gait's is one, whatever else is cut at its rests. What is too short is
    /// left out.
    fn cut(&self, rows: &[Vec<f64>], knots: usize, cycle: (usize, usize)) -> Vec<(usize, usize)> {
        let mut spans = vec![cycle];
        if knots != GAIT_KNOTS && cycle.1 >= cycle.0 + MIN_FRAMES {
            spans = at_rests(&self.body, rows, self.rate_hz, cycle);
        }
        spans.retain(|(from, to)| *to >= from + MIN_FRAMES);
        spans
    }

    /// Rows as poses in the world, starting at the origin.
    pub fn frames(&self, rows: &[Vec<f64>]) -> Vec<Frame> {
        walk(&self.body, rows, self.rate_hz)
    }

    /// The same as a clip.
    pub fn clip(&self, rows: &[Vec<f64>]) -> Clip {
        Clip {
            name: String::new(),
            skeleton: self.body.skeleton.clone(),
            rate_hz: self.rate_hz,
            frames: self.frames(rows),
        }
    }
}

/// Rows as poses in the world: velocities integrated from the origin, facing +Z.
pub fn walk(body: &Body, rows: &[Vec<f64>], rate_hz: f64) -> Vec<Frame> {
    let (mut ground, mut heading) = ([0.0, 0.0], 0.0f64);
    rows.iter()
        .enumerate()
        .map(|(t, row)| {
            if t > 0 {
                advance(&mut ground, heading, row, rate_hz);
                heading += row[dof::YAW] / rate_hz;
            }
            body.pose(row, ground, heading)
        })
        .collect()
}

/// Moves a place on the ground by a frame's time at a row's speeds, facing `heading`.
pub(super) fn advance(ground: &mut [f64; 2], heading: f64, row: &[f64], rate_hz: f64) {
    let (forward, left) = (row[dof::FORWARD] / rate_hz, row[dof::LEFT] / rate_hz);
    let (sin, cos) = heading.sin_cos();
    ground[0] += sin * forward + cos * left;
    ground[1] += cos * forward - sin * left;
}

/// Number of knots of a cycle of a database.
fn knots(database: &Database<'_>, index: usize) -> usize {
    let table = database.sections().into_iter().find(|(id, _)| *id == section::CYCLES);
    table.map_or(0, |(_, table)| Record::of(table, index, cycle::LENGTH).u16(cycle::KNOTS).into())
}

/// Cuts a clip in the middle of its rests.
fn at_rests(body: &Body, rows: &[Vec<f64>], rate_hz: f64, (from, to): (usize, usize)) -> Vec<(usize, usize)> {
    let frames = walk(body, rows, rate_hz);
    let positions: Vec<_> = frames.iter().map(|f| f.positions(&body.skeleton)).collect();
    let raw: Vec<f64> = (0..rows.len())
        .map(|t| {
            let (a, b) = (&positions[t.saturating_sub(1)], &positions[(t + 1).min(rows.len() - 1)]);
            a.iter().zip(b).map(|(a, b)| (b - a).norm()).sum()
        })
        .collect();
    let speed = smooth(&raw, 0.05 * rate_hz);
    let fast = quantile(&sorted(speed.iter().copied()), 0.95).unwrap_or(0.0);
    let (rest, shortest) = ((REST_S * rate_hz) as usize, (MIN_FRAGMENT_S * rate_hz) as usize);
    let mut cuts = vec![from];
    let mut t = from;
    while t < to {
        let start = t;
        while t < to && speed[t] < REST_SPEED * fast {
            t += 1;
        }
        let middle = (start + t) / 2;
        let last = cuts[cuts.len() - 1];
        // Rests at the ends belong to the action.
        if t - start >= rest && start > from && t < to && middle >= last + shortest && middle + shortest <= to
        {
            cuts.push(middle);
        }
        t = t.max(start + 1);
    }
    cuts.push(to);
    cuts.windows(2).map(|w| (w[0], w[1])).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        build::{BuildOptions, build},
        synth,
    };
    use gestus_motion::corpus::Cycle;

    fn corpus(actions: &[&str]) -> Corpus {
        synth::corpus(&synth::Options {
            actions: actions.iter().map(|a| (*a).to_owned()).collect(),
            styles: vec!["neutral".into(), "angry".into()],
            clips: 1,
            seconds: 5.0,
            ..synth::Options::default()
        })
        .unwrap()
    }

    #[test]
    fn a_gait_is_cut_at_its_strikes_and_annotation_is_obeyed() {
        let corpus = corpus(&["walk"]);
        let library = Library::found(&corpus).unwrap();
        assert_eq!(library.fragments.len(), corpus.examples.iter().map(|e| e.cycles.len()).sum::<usize>());
        for pair in library.fragments.windows(2).filter(|p| p[0].span.clip == p[1].span.clip) {
            assert_eq!(pair[0].span.to, pair[1].span.from);
            assert_eq!(pair[0].rows.len(), pair[0].span.to - pair[0].span.from);
        }
        let span = Span { clip: corpus.examples[1].clip.name.clone(), from: 7, to: 31 };
        let marked = Library::annotated(&corpus, std::slice::from_ref(&span)).unwrap();
        assert_eq!(marked.fragments.len(), 1);
        assert_eq!((&marked.fragments[0].span, marked.fragments[0].style), (&span, 1));
    }

    #[test]
    fn a_clip_is_cut_where_the_body_rests() {
        let corpus = corpus(&["punch"]);
        let body = Body::of(&corpus).unwrap();
        let rows = body.clip_dofs(&corpus.examples[0].clip);
        // The same punch twice with half a second of standing between them.
        let last = rows[rows.len() - 1].clone();
        let mut still = last.clone();
        still[dof::FORWARD..dof::JOINTS].fill(0.0);
        let twice = [rows.clone(), vec![still; 15], rows.clone()].concat();
        let spans = at_rests(&body, &twice, corpus.rate_hz, (0, twice.len()));
        let cut = rows.len()..rows.len() + 15;
        assert!(spans.iter().any(|s| cut.contains(&s.1)), "{spans:?}, rest at {cut:?}");
        assert_eq!((spans[0].0, spans[spans.len() - 1].1), (0, twice.len()));
    }

    /// Generated motion, every clip twice with a second of standing between, and one cycle of so many knots over both.
    fn with_rests(actions: &[&str], knots: usize) -> Corpus {
        let mut corpus = corpus(actions);
        for example in &mut corpus.examples {
            let frames = example.clip.frames.clone();
            let last = frames[frames.len() - 1].clone();
            example.clip.frames = [frames.clone(), vec![last; 30], frames].concat();
            let count = example.clip.frames.len();
            let even = |k: usize| (count - 1) as f64 * k as f64 / (knots - 1) as f64;
            example.cycles = vec![Cycle { knots: (0..knots).map(even).collect() }];
            example.contacts = vec![[true; 2]; count];
        }
        corpus
    }

    /// A clip in which one gait cycle was found was taken for an act, and cut in the middle of it where the body stood.
    #[test]
    fn the_only_cycle_of_a_gait_is_one_fragment() {
        let fragments = |knots: usize| {
            let corpus = with_rests(&["walk"], knots);
            Library::found(&corpus).unwrap().fragments.len() as f64 / corpus.examples.len() as f64
        };
        assert_eq!((fragments(GAIT_KNOTS), fragments(13)), (1.0, 2.0));
    }

    /// The fragments of a database are those of its clips: acts were cut at their rests in a corpus, and not there.
    #[test]
    fn a_database_is_cut_as_its_clips_are() {
        let corpus = with_rests(&["punch"], 13);
        let built = build(&corpus, &BuildOptions { models: false, ..BuildOptions::default() }).unwrap();
        let held = Library::of_database(&Database::open(&built.bytes).unwrap()).unwrap().fragments;
        let found = Library::found(&corpus).unwrap().fragments;
        assert!(found.len() > corpus.examples.len());
        assert_eq!(held.len(), found.len());
        for f in &found {
            // A blob has rows of f32, and its rows begin behind the first frame.
            let near = |h: &&Fragment| {
                h.span.clip == f.span.clip
                    && h.span.from.abs_diff(f.span.from).max(h.span.to.abs_diff(f.span.to)) <= 2
            };
            let same = held.iter().find(near).unwrap_or_else(|| panic!("{:?}", f.span));
            assert_eq!(
                (same.action, same.style, same.rows.len()),
                (f.action, f.style, same.span.to - same.span.from)
            );
        }
    }
}
