//! A clip in a wanted Effort: its snippets replaced by blends, one after the other (Torresani 2006, section 7.2, eq. 12).
//!
//! For each snippet, every pair of fragments of its content gets the α whose predicted Effort is nearest to the wanted
//! one (even samples over -0.25 to 1.25, then golden section), and the best pair is blended. Factors without a wanted
//! value don't count.
//!
//! Two things that the paper leaves open: the K nearest fragments are those of each style in turn, since the K nearest
//! of all are cycles of one clip and all of one Effort; and where two blends meet, half of their difference is added to
//! either side and fades out, so that nothing jumps. The output turns as the input does, snippet by snippet.
//!
//! Blends of poses do not stand still where their feet stand. A foot stands where it does in the fragments, weighted as they
//! are, and foot skate is cleaned up as in a whole clip of any other method ([`cleanup`]).

use gestus_core::blob::layout::dof;
use rayon::prelude::*;

use crate::effort::{
    ALPHA, Factors,
    align::distance,
    blend::Pair,
    fragment::{Fragment, advance, content},
    model::Model,
    stage::{Snippet, segment},
};
use crate::{
    registration::contact::contacts,
    stream::cleanup::{self, Limbs},
};
use gestus_motion::{
    clip::{Clip, Frame},
    statistics::smoothstep,
};

/// Fragments of a snippet's content that are paired.
pub const NEIGHBORS: usize = 28;
/// Even samples of α.
const SAMPLES: usize = 13;
/// Steps of golden section: each takes the interval to 0.618 of itself.
const GOLDEN: usize = 12;
/// How long a difference at a join takes to fade, seconds.
const FADE_S: f64 = 0.25;

/// What a snippet became.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Choice {
    /// The snippet of the input.
    pub snippet: Snippet,
    /// First fragment of the blend.
    pub first: usize,
    /// Second fragment.
    pub second: usize,
    /// How far from the first to the second.
    pub alpha: f64,
    /// The Effort that this is predicted to have.
    pub effort: Factors,
}

/// A translated clip.
#[derive(Debug, Clone, Default)]
pub struct Output {
    /// The poses, at the library's rate.
    pub frames: Vec<Frame>,
    /// The same before their feet were cleaned up.
    pub blended: Vec<Frame>,
    /// Which foot stands, by the fragments. Shape `[frames]`.
    pub stands: Vec<[bool; 2]>,
    /// Dofs of the poses, `[frames][D]`.
    pub rows: Vec<Vec<f64>>,
    /// Where in the input each pose is, in frames.
    pub sources: Vec<f64>,
    /// What each snippet became.
    pub choices: Vec<Choice>,
}

/// Squared distance to what is wanted.
fn misfit(effort: &Factors, wanted: &[Option<f64>; 3]) -> f64 {
    effort.iter().zip(wanted).filter_map(|(e, w)| Some((e - (*w)?).powi(2))).sum()
}

/// The α of least misfit for a function of it: even samples, then golden section about the best of them.
pub fn best_alpha(misfit: impl Fn(f64) -> f64) -> (f64, f64) {
    let step = (ALPHA.1 - ALPHA.0) / (SAMPLES - 1) as f64;
    let at = |i: usize| ALPHA.0 + step * i as f64;
    let mut best = (f64::INFINITY, 0.0);
    for i in 0..SAMPLES {
        let found = misfit(at(i));
        if found < best.0 {
            best = (found, at(i));
        }
    }
    let ratio = 0.5 * (5f64.sqrt() - 1.0);
    let (mut low, mut high) = ((best.1 - step).max(ALPHA.0), (best.1 + step).min(ALPHA.1));
    let (mut a, mut b) = (high - ratio * (high - low), low + ratio * (high - low));
    let (mut fa, mut fb) = (misfit(a), misfit(b));
    for _ in 0..GOLDEN {
        if fa < fb {
            (high, b, fb) = (b, a, fa);
            a = high - ratio * (high - low);
            fa = misfit(a);
        } else {
            (low, a, fa) = (a, b, fb);
            b = low + ratio * (high - low);
            fb = misfit(b);
        }
    }
    let refined = if fa < fb { (fa, a) } else { (fb, b) };
    if refined.0 < best.0 { (refined.1, refined.0) } else { (best.1, best.0) }
}

/// The fragments of its action nearest in content to one, itself among them: as many of each style, nearest first.
pub fn neighbors(model: &Model, of: usize, k: usize) -> Vec<usize> {
    let fragments = &model.library.fragments;
    let mut near: Vec<(f64, usize)> = fragments
        .par_iter()
        .enumerate()
        .filter(|(_, f)| f.action == fragments[of].action)
        .map(|(i, f)| (distance(&fragments[of].content, &f.content), i))
        .collect();
    near.sort_by(|a, b| a.0.total_cmp(&b.0));
    let styles = model.library.styles.len().max(1);
    let most = k.div_ceil(styles);
    let mut taken = vec![0; styles];
    let mut chosen = Vec::new();
    for (distance, i) in near {
        let style = fragments[i].style.min(styles - 1);
        // A fragment further off than any of this content is not a variant of it.
        if taken[style] < most && (chosen.len() < 2 || distance < 2.0 * super::align::THRESHOLD_RAD) {
            taken[style] += 1;
            chosen.push(i);
        }
    }
    chosen.truncate(k.max(2));
    chosen
}

/// The pair and α of a set of fragments whose predicted Effort is nearest to the wanted.
pub fn choose(model: &Model, among: &[usize], wanted: &[Option<f64>; 3]) -> (usize, usize, f64) {
    let pairs: Vec<(usize, usize)> =
        among.iter().enumerate().flat_map(|(n, &i)| among[n + 1..].iter().map(move |&j| (i, j))).collect();
    pairs
        .par_iter()
        .map(|&(i, j)| {
            let (alpha, misfit) = best_alpha(|alpha| misfit(&model.predict(i, j, alpha), wanted));
            (misfit, i, j, alpha)
        })
        .min_by(|a, b| (a.0, a.1, a.2).partial_cmp(&(b.0, b.1, b.2)).unwrap_or(std::cmp::Ordering::Equal))
        .map_or((among[0], among[0], 0.0), |(_, i, j, alpha)| (i, j, alpha))
}

/// Translates a clip, which has to be at the library's rate and on its joints.
pub fn translate(model: &Model, clip: &Clip, wanted: &[Option<f64>; 3]) -> Output {
    let library = &model.library;
    let input = library.body.clip_dofs(clip);
    let fragments: Vec<&[Vec<f64>]> = library.fragments.iter().map(|f| f.content.as_slice()).collect();
    let snippets = segment(&content(&input), &fragments);
    let mut chosen: Vec<(usize, (usize, usize, f64))> = Vec::new();
    let mut output = Output::default();
    let mut joins = Vec::new();
    for snippet in snippets {
        let known = chosen.iter().find(|c| c.0 == snippet.fragment).map(|c| c.1);
        let (first, second, alpha) = known.unwrap_or_else(|| {
            let choice = choose(model, &neighbors(model, snippet.fragment, NEIGHBORS), wanted);
            chosen.push((snippet.fragment, choice));
            choice
        });
        let (a, b) = (&library.fragments[first], &library.fragments[second]);
        let (mut rows, stands) = if first == second {
            (a.rows.clone(), standing(model, a))
        } else {
            let pair = Pair::new(a, b);
            (pair.blend(alpha), pair.stands(alpha, &[a, b].map(|f| standing(model, f))))
        };
        // A snippet that was cut off covers part of its fragment only; the frames go by its share of it.
        let whole = fragments[snippet.fragment].len() as f64;
        let share = ((snippet.to - snippet.from) as f64 / whole).min(1.0);
        if share < 0.5 {
            rows.truncate(((rows.len() as f64 * share).ceil() as usize).max(1));
        }
        joins.push(output.rows.len());
        let span = (snippet.to - snippet.from) as f64 / rows.len() as f64;
        output.stands.extend(stands.into_iter().take(rows.len()));
        output.sources.extend((0..rows.len()).map(|k| snippet.from as f64 + span * k as f64));
        output.rows.extend(rows);
        let effort = model.predict(first, second, alpha);
        output.choices.push(Choice { snippet, first, second, alpha, effort });
    }
    fade(&mut output.rows, &joins, (FADE_S * library.rate_hz).round() as usize);
    place(&mut output, clip, model);
    clean(&mut output, clip, model);
    output
}

/// Which foot stands in a fragment, on the way that its velocities make.
fn standing(model: &Model, fragment: &Fragment) -> Vec<[bool; 2]> {
    contacts(&model.library.clip(&fragment.rows), &model.library.body.landmarks)
}

/// Takes foot skate out, with the legs and soles of the input. An input whose feet never stand has none.
fn clean(output: &mut Output, clip: &Clip, model: &Model) {
    let body = &model.library.body;
    let Some((limbs, _)) = Limbs::of_clip(body, clip) else { return };
    let window = (cleanup::WINDOW_S * clip.rate_hz) as usize;
    let cleaned = cleanup::clean(&limbs, &output.blended, &output.stands, window, clip.rate_hz);
    (output.frames, output.stands) = (cleaned.frames, cleaned.stands);
    output.rows = body.clip_dofs(&Clip { frames: output.frames.clone(), ..clip.clone() });
}

/// Adds half of the difference at each join to either side, fading out.
fn fade(rows: &mut [Vec<f64>], joins: &[usize], reach: usize) {
    let speed = |d: usize| (dof::FORWARD..=dof::YAW).contains(&d);
    let edges: Vec<usize> = joins.iter().copied().chain([rows.len()]).collect();
    for w in edges.windows(3) {
        let [before, join, after] = [w[0], w[1], w[2]];
        let jump: Vec<f64> = rows[join].iter().zip(&rows[join - 1]).map(|(b, a)| b - a).collect();
        let weight =
            |i: usize, room: usize| 0.5 * (1.0 - smoothstep(i as f64 / reach.min(room).max(1) as f64));
        for i in 0..reach.min(join - before) {
            let share = weight(i, join - before);
            for (d, v) in rows[join - 1 - i].iter_mut().enumerate().filter(|(d, _)| !speed(*d)) {
                *v += share * jump[d];
            }
        }
        for i in 0..reach.min(after - join) {
            let share = weight(i, after - join);
            for (d, v) in rows[join + i].iter_mut().enumerate().filter(|(d, _)| !speed(*d)) {
                *v -= share * jump[d];
            }
        }
    }
}

/// Stands the poses on the ground: they face as the input does at their moment, and go at their own speed.
fn place(output: &mut Output, clip: &Clip, model: &Model) {
    let body = &model.library.body;
    let headings: Vec<f64> = clip.frames.iter().map(|f| body.heading(f)).collect();
    let start = clip.frames[0].root;
    let mut ground = [start.x, start.z];
    for (t, (row, &source)) in output.rows.iter().zip(&output.sources).enumerate() {
        let i = (source as usize).min(headings.len() - 1);
        let next = (i + 1).min(headings.len() - 1);
        let heading =
            headings[i] + (source - i as f64) * gestus_motion::body::wrap(headings[next] - headings[i]);
        if t > 0 {
            advance(&mut ground, heading, row, clip.rate_hz);
        }
        output.blended.push(body.pose(row, ground, heading));
    }
    output.frames.clone_from(&output.blended);
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        effort::{fragment::Library, model::draw},
        synth,
    };

    #[test]
    fn alpha_is_found_between_the_samples() {
        for wanted in [-0.25, -0.1, 0.313, 0.777, 1.25] {
            let (alpha, misfit) = best_alpha(|a| (a - wanted).powi(2) + 0.1);
            assert!((alpha - wanted).abs() < 2e-3 && (misfit - 0.1) < 1e-4, "{wanted}: {alpha}");
        }
    }

    #[test]
    fn a_clip_is_replaced_snippet_by_snippet_and_turns_the_right_way() {
        let corpus = synth::corpus(&synth::Options {
            actions: vec!["walk".into(), "run".into()],
            styles: ["neutral", "angry", "old"].map(String::from).to_vec(),
            clips: 2,
            seconds: 5.0,
            ..synth::Options::default()
        })
        .unwrap();
        let library = Library::found(&corpus).unwrap();
        let draws = draw(&library, 40, 3);
        assert!(draws.len() > 20, "{}", draws.len());
        let model = Model::estimated(library, &draws);
        let clip = &corpus.examples[0].clip;
        let strong = translate(&model, clip, &[None, Some(1.5), None]);
        let light = translate(&model, clip, &[None, Some(-1.5), None]);
        let mean = |o: &Output| o.choices.iter().map(|c| c.effort[1]).sum::<f64>() / o.choices.len() as f64;
        assert!(mean(&strong) > mean(&light) + 1.0, "{} {}", mean(&strong), mean(&light));
        for output in [&strong, &light] {
            assert_eq!(output.choices[0].snippet.from, 0);
            assert_eq!(output.choices[output.choices.len() - 1].snippet.to, clip.frames.len());
            for w in output.choices.windows(2) {
                assert_eq!(w[0].snippet.to, w[1].snippet.from);
            }
            // No pose jumps: a joint turns less than a fast movement does in a frame.
            for w in output.rows.windows(2) {
                let most = w[0][7..].iter().zip(&w[1][7..]).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
                assert!(most < 0.6, "{most}");
            }
            let turn = |frames: &[Frame]| {
                gestus_motion::body::wrap(
                    model.library.body.heading(&frames[frames.len() - 1])
                        - model.library.body.heading(&frames[0]),
                )
            };
            assert!((turn(&output.frames) - turn(&clip.frames)).abs() < 0.3);
        }
    }
}
