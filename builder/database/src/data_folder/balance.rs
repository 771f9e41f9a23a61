//! What a database can be made of: a frame needs an output in every style, so every action has to be there in every style.

use gestus_motion::corpus::{Corpus, Example};

use super::config::FILE_NAME;

/// The clips of actions that exist in every style, and one line for each action or style that is left out.
///
/// Where an action lacks a style, one of the two goes: the one that completes the rest for the fewest clips, so that one
/// clip of a style of its own costs that clip, and not all actions. Styles stay if `keep_styles` says so.
pub fn balanced(corpus: &Corpus, keep_styles: bool) -> (Corpus, Vec<String>) {
    let mut actions: Vec<usize> = (0..corpus.actions.len()).collect();
    let mut styles: Vec<usize> = (0..corpus.styles.len()).collect();
    let clips = |action: usize, style: usize| {
        let of = |e: &&Example| (e.action, e.style) == (action, style) && !e.cycles.is_empty();
        corpus.examples.iter().filter(of).count()
    };
    let mut notes = Vec::new();
    loop {
        // Of each action and style: how many classes it lacks, and how many clips it has.
        let row = |of: &dyn Fn(usize) -> usize, others: &[usize]| {
            let missing: Vec<usize> = others.iter().copied().filter(|&o| of(o) == 0).collect();
            (missing, others.iter().map(|&o| of(o)).sum::<usize>())
        };
        let by_action = actions.iter().map(|&a| (true, a, row(&|s| clips(a, s), &styles)));
        let by_style = styles.iter().map(|&s| (false, s, row(&|a| clips(a, s), &actions)));
        let incomplete = by_action.chain(by_style).filter(|(_, _, (missing, _))| !missing.is_empty());
        let free = incomplete.filter(|(is_action, ..)| *is_action || !keep_styles && styles.len() > 1);
        // Of equals an action: styles are what is learnt.
        let worst = free.reduce(|best, next| {
            let cost = |(_, _, (missing, clips)): &(bool, usize, (Vec<usize>, usize))| {
                *clips as f64 / missing.len() as f64
            };
            if cost(&next) < cost(&best) { next } else { best }
        });
        let Some((is_action, number, (missing, lost))) = worst else { break };
        let listed = |names: &[String], which: &[usize]| {
            which.iter().map(|&i| names[i].as_str()).collect::<Vec<_>>().join(", ")
        };
        let (list, what, name, lacks) = match is_action {
            true => (&mut actions, "action", &corpus.actions[number], listed(&corpus.styles, &missing)),
            false => (&mut styles, "style", &corpus.styles[number], listed(&corpus.actions, &missing)),
        };
        list.retain(|&other| other != number);
        if lost == 0 {
            continue;
        }
        let count = if lost == 1 { "1 clip".to_owned() } else { format!("{lost} clips") };
        notes.push(format!(
            "left out: {what} {name} lacks {lacks}: a frame needs an output in every style; it costs {count} (add what it \
             lacks, or choose with `{what}s = [...]` in {FILE_NAME})"
        ));
    }
    let place = |list: &[usize], number: usize| list.iter().position(|&other| other == number);
    let examples = corpus.examples.iter().filter_map(|e| {
        let (action, style) = (place(&actions, e.action)?, place(&styles, e.style)?);
        Some(Example { action, style, ..e.clone() })
    });
    let names = |all: &[String], kept: &[usize]| kept.iter().map(|&i| all[i].clone()).collect();
    let whole = Corpus {
        examples: examples.collect(),
        actions: names(&corpus.actions, &actions),
        styles: names(&corpus.styles, &styles),
        skeleton: corpus.skeleton.clone(),
        rate_hz: corpus.rate_hz,
    };
    (whole, notes)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::synth::{Options, corpus};

    /// Clips of those actions and styles.
    fn of(classes: &[(&str, &str)]) -> Corpus {
        let mut made = corpus(&Options::of(&["walk"], &["neutral"], 1, 2.0)).unwrap();
        let example = made.examples.remove(0);
        made.actions = Vec::new();
        made.styles = Vec::new();
        for (action, style) in classes {
            let number = |list: &mut Vec<String>, name: &str| {
                list.iter().position(|n| n == name).unwrap_or_else(|| {
                    list.push(name.to_owned());
                    list.len() - 1
                })
            };
            let (action, style) = (number(&mut made.actions, action), number(&mut made.styles, style));
            made.examples.push(Example { action, style, ..example.clone() });
        }
        made
    }

    #[test]
    fn one_odd_clip_costs_one_clip() {
        let whole: Vec<(&str, &str)> =
            ["walk", "run", "jump"].into_iter().flat_map(|a| [(a, "neutral"), (a, "proud")]).collect();
        for odd in [("walk", "weird"), ("dance", "proud"), ("dance", "weird")] {
            let corpus = of(&[&whole[..], &[odd]].concat());
            let (kept, notes) = balanced(&corpus, false);
            assert_eq!(
                (kept.actions.len(), kept.styles.len(), kept.examples.len()),
                (3, 2, 6),
                "{odd:?}: {notes:?}"
            );
            assert!(!notes.is_empty());
        }
        let (kept, notes) = balanced(&of(&whole), false);
        assert_eq!((kept.examples.len(), notes.len()), (6, 0));
        // Styles that were asked for are kept.
        let (kept, _) = balanced(&of(&[&whole[..], &[("walk", "weird")]].concat()), true);
        assert_eq!(kept.actions, ["walk"]);
    }
}
