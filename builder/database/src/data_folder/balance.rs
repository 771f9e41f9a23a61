//! What a database can be made of: a frame needs an output in every style, so every action has to be there in every style.

use gestus_motion::corpus::{Corpus, Example};

use super::left_out::{Group, Reason, selection};

/// The clips of actions that exist in every style, and those of each action or style that is left out.
///
/// Where an action lacks a style, one of the two goes: the one that completes the rest for the fewest clips, so that one
/// clip of a style of its own costs that clip, and not all actions. Styles stay if `keep_styles` says so.
pub fn balanced(corpus: &Corpus, keep_styles: bool) -> (Corpus, Vec<Group>) {
    let mut actions: Vec<usize> = (0..corpus.actions.len()).collect();
    let mut styles: Vec<usize> = (0..corpus.styles.len()).collect();
    let clips = |action: usize, style: usize| {
        let of = |e: &&Example| (e.action, e.style) == (action, style) && !e.cycles.is_empty();
        corpus.examples.iter().filter(of).count()
    };
    let mut left_out = Vec::new();
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
        let (list, others) = if is_action { (&mut actions, &styles) } else { (&mut styles, &actions) };
        list.retain(|&other| other != number);
        let there: Vec<usize> = others.iter().copied().filter(|other| !missing.contains(other)).collect();
        if lost > 0 {
            left_out.push(without_all(corpus, is_action, number, [&missing, &there]));
        }
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
    (whole, left_out)
}

/// The clips of an action or style that lacks some of the others: those that are missing, and those that are there.
fn without_all(corpus: &Corpus, is_action: bool, number: usize, [missing, there]: [&[usize]; 2]) -> Group {
    let (what, own, list, others) = match is_action {
        true => ("action", &corpus.actions, "styles", &corpus.styles),
        false => ("style", &corpus.styles, "actions", &corpus.actions),
    };
    let is_own = |e: &&Example| {
        let class = if is_action { e.action } else { e.style };
        class == number && !e.cycles.is_empty()
    };
    let named = |which: &[usize]| which.iter().map(|&i| others[i].as_str()).collect::<Vec<_>>();
    let mut advice = "a frame needs an output in every style: add what is missing".to_owned();
    let mut change = String::new();
    // One style alone teaches nothing.
    if there.len() > usize::from(is_action) {
        advice += ", or keep them and not the others";
        change = selection(list, &named(there));
    }
    Group {
        reason: Reason::Incomplete,
        clips: corpus.examples.iter().filter(is_own).map(|e| e.clip.name.clone()).collect(),
        what: format!("of {what} {}, which lacks {}", own[number], named(missing).join(", ")),
        advice,
        change,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::data_folder::config::Config;
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
            let (kept, left_out) = balanced(&corpus, false);
            assert_eq!(
                (kept.actions.len(), kept.styles.len(), kept.examples.len()),
                (3, 2, 6),
                "{odd:?}: {left_out:?}"
            );
            assert_eq!(left_out.iter().map(|group| group.clips.len()).sum::<usize>(), 1, "{left_out:?}");
        }
        let (kept, left_out) = balanced(&of(&whole), false);
        assert_eq!((kept.examples.len(), left_out.len()), (6, 0));
        // Styles that were asked for are kept.
        let (kept, _) = balanced(&of(&[&whole[..], &[("walk", "weird")]].concat()), true);
        assert_eq!(kept.actions, ["walk"]);
    }

    /// The line that is told keeps the clips.
    #[test]
    fn the_lines_keep_what_was_left_out() {
        let whole: Vec<(&str, &str)> = ["walk", "run", "jump"]
            .into_iter()
            .flat_map(|a| [(a, "neutral"), (a, "proud"), (a, "old")])
            .collect();
        let two = [("dance", "neutral"), ("dance", "old")];
        for (odd, line) in [
            (&[("walk", "weird")][..], "actions = [\"walk\"]"),
            (&two, "styles = [\"neutral\", \"old\"]"),
            (&[("dance", "proud")], ""),
        ] {
            let (_, left_out) = balanced(&of(&[&whole[..], odd].concat()), false);
            let [group] = &left_out[..] else { panic!("{left_out:?}") };
            assert_eq!((group.clips.len(), group.change.as_str()), (odd.len(), line));
            if line.is_empty() {
                continue;
            }
            let config = Config::parse(line, "gestus.toml").unwrap();
            let wanted = |(action, style): &(&str, &str)| {
                let among = |list: &[String], name: &str| list.is_empty() || list.iter().any(|n| n == name);
                among(&config.actions, action) && among(&config.styles, style)
            };
            let chosen: Vec<(&str, &str)> = whole.iter().chain(odd).copied().filter(wanted).collect();
            let (kept, left_out) = balanced(&of(&chosen), !config.styles.is_empty());
            assert!(left_out.is_empty() && kept.examples.len() == chosen.len(), "{left_out:?}");
        }
    }
}
