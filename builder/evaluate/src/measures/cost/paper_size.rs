//! Generated motion of the size of the database of Xia 2015, Table 1: its actions at 120 frames a second in eight styles.

use anyhow::Result;
use gestus_database::{
    build::BuildOptions,
    synth::{self, Options, STYLES},
};
use gestus_motion::corpus::Corpus;

use crate::experiment::Experiment;

/// Frames of each action in the paper's database. Its transitions are of several kinds; ours are of one.
pub(in crate::measures) const FRAMES: [(&str, usize); 6] = [
    ("walk", 49_461),
    ("run", 7_835),
    ("jump", 6_293),
    ("punch", 7_125),
    ("kick", 6_970),
    ("walk-to-run", 2_145),
];
/// Frames of all of them.
pub(in crate::measures) const TOTAL: usize = 79_829;
/// Frames a second.
const RATE_HZ: f64 = 120.0;
/// Length of a gait, seconds: many short clips come nearer to a number of frames than few long ones.
const SECONDS: f64 = 5.0;
/// Most clips of a class that are generated to choose from.
const CLIPS: usize = 16;
const SEED: u64 = 2015;

/// The experiment: a database of that size, and beside it one clip of each action in neutral style to stream.
pub(in crate::measures) fn experiment() -> Result<Experiment> {
    let build = BuildOptions { models: false, ..BuildOptions::default() };
    Ok(Experiment::new(corpus(&FRAMES, TOTAL)?, build))
}

/// Clips of each action until it has about that many frames, one of each style at least; the first action fills up the
/// total. Clip 000 in neutral style is more than that, for a stream that the database has not seen.
fn corpus(wanted: &[(&str, usize)], total: usize) -> Result<Corpus> {
    let mut all: Option<Corpus> = None;
    let mut frames = 0;
    for (i, &(action, most)) in wanted.iter().enumerate().rev() {
        let most = if i == 0 { total.saturating_sub(frames) } else { most };
        let options =
            Options { seed: SEED, rate_hz: RATE_HZ, ..Options::of(&[action], &STYLES, CLIPS, SECONDS) };
        let mut corpus = synth::corpus(&options)?;
        frames += choose(&mut corpus, most);
        let all =
            all.get_or_insert_with(|| Corpus { actions: Vec::new(), examples: Vec::new(), ..corpus.clone() });
        corpus.examples.iter_mut().for_each(|e| e.action = all.actions.len());
        all.actions.push(action.to_owned());
        all.examples.append(&mut corpus.examples);
    }
    all.ok_or_else(|| anyhow::anyhow!("no action is wanted"))
}

/// Keeps clips of a corpus of one action until they have about that many frames, clip after clip in all styles, and clip 000
/// in neutral style. Returns the frames of the former.
fn choose(corpus: &mut Corpus, most: usize) -> usize {
    let neutral = corpus.plain_style();
    corpus.examples.sort_by(|a, b| (&a.take, a.style).cmp(&(&b.take, b.style)));
    let mut frames = 0;
    corpus.examples.retain(|example| {
        let length = example.clip.frames.len();
        let kept = example.take == "001" || (example.take != "000" && frames + length / 2 <= most);
        frames += if kept { length } else { 0 };
        kept || (example.take == "000" && example.style == neutral)
    });
    frames
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_database_has_about_as_many_frames_as_were_asked_for() {
        let corpus = corpus(&[("walk", 0), ("kick", 4_000)], 16_000).unwrap();
        let frames = |action: usize, held: bool| -> usize {
            let of = corpus.examples.iter().filter(|e| e.action == action && (e.take == "000") == held);
            of.map(|e| e.clip.frames.len()).sum()
        };
        let (kick, walk) = (corpus.action("kick").unwrap(), corpus.action("walk").unwrap());
        assert!(frames(kick, false).abs_diff(4_000) < 400, "{}", frames(kick, false));
        let all = frames(kick, false) + frames(walk, false);
        assert!(all.abs_diff(16_000) < 400, "{all}");
        assert!(frames(walk, true) > 0 && frames(kick, true) > 0);
        // Each class is there without the clips that are held out.
        for style in 0..STYLES.len() {
            assert!([kick, walk].iter().all(|&a| {
                corpus.examples.iter().any(|e| (e.action, e.style) == (a, style) && e.take != "000")
            }));
        }
        assert_eq!(TOTAL, FRAMES.iter().map(|f| f.1).sum::<usize>());
    }
}
