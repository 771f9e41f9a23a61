//! From text to [`Bvh`]. No recursion: a file decides how deep it nests. Nothing is allocated from a number that a
//! file states.

use std::collections::HashSet;

use nalgebra::Vector3;

use super::{
    Bvh, Channel, Joint, Problem,
    lexer::{Fault, Lexer, number},
};

const MAX_DEPTH: usize = 128;
const MAX_JOINTS: usize = 1024;

pub(super) fn parse(bytes: &[u8]) -> Result<Bvh, Fault> {
    let text = std::str::from_utf8(bytes).map_err(|_| (None, Problem::NotText))?;
    let mut lexer = Lexer::new(text);
    lexer.expect("HIERARCHY")?;
    let joints = hierarchy(&mut lexer)?;
    let (frame_time, values) = motion(&mut lexer, &joints)?;
    Ok(Bvh { joints, frame_time, values })
}

fn hierarchy(lexer: &mut Lexer<'_>) -> Result<Vec<Joint>, Fault> {
    let mut joints: Vec<Joint> = Vec::new();
    let mut names = HashSet::new();
    lexer.expect("ROOT")?;
    let mut open: Vec<usize> = Vec::new();
    begin_joint(lexer, &mut joints, &mut names, &mut open)?;
    while let Some(&current) = open.last() {
        let word = lexer.next();
        match word.map(|w| w.text.to_ascii_uppercase()).as_deref() {
            Some("OFFSET") => joints[current].offset = vector(lexer)?,
            Some("CHANNELS") => joints[current].channels = channels(lexer, &joints[current].name)?,
            Some("JOINT") => begin_joint(lexer, &mut joints, &mut names, &mut open)?,
            Some("END") => joints[current].end_site = Some(end_site(lexer)?),
            Some("}") => {
                open.pop();
            }
            _ => return Err(lexer.unexpected("OFFSET, CHANNELS, JOINT, `End Site` or `}`", word)),
        }
    }
    Ok(joints)
}

fn begin_joint(
    lexer: &mut Lexer<'_>,
    joints: &mut Vec<Joint>,
    names: &mut HashSet<String>,
    open: &mut Vec<usize>,
) -> Result<(), Fault> {
    let place = Some(lexer.place());
    let name = lexer.rest_of_line().to_owned();
    if name.is_empty() {
        let found = lexer.next();
        return Err(lexer.unexpected("a joint's name", found));
    }
    if !names.insert(name.clone()) {
        return Err((place, Problem::JointTwice(name)));
    }
    if open.len() >= MAX_DEPTH {
        return Err((place, Problem::Depth(MAX_DEPTH)));
    }
    if joints.len() >= MAX_JOINTS {
        return Err((place, Problem::Joints(MAX_JOINTS)));
    }
    lexer.expect("{")?;
    let parent = open.last().copied();
    open.push(joints.len());
    joints.push(Joint { name, parent, offset: Vector3::zeros(), channels: Vec::new(), end_site: None });
    Ok(())
}

fn vector(lexer: &mut Lexer<'_>) -> Result<Vector3<f64>, Fault> {
    Ok(Vector3::new(lexer.number()?, lexer.number()?, lexer.number()?))
}

fn channels(lexer: &mut Lexer<'_>, joint: &str) -> Result<Vec<Channel>, Fault> {
    let count = lexer.next();
    let number = count.and_then(|w| w.text.parse::<usize>().ok()).filter(|n| *n <= 6);
    let (Some(number), Some(word)) = (number, count) else {
        let place = count.map_or_else(|| lexer.place(), |w| w.place);
        return Err((Some(place), Problem::ChannelCount(count.map_or(String::new(), |w| w.text.to_owned()))));
    };
    let mut channels = Vec::new();
    for _ in 0..number {
        let Some(name) = lexer.next() else { return Err(lexer.unexpected("a channel", None)) };
        let channel = Channel::named(name.text)
            .ok_or_else(|| (Some(name.place), Problem::Channel(name.text.to_owned())))?;
        if channels.contains(&channel) {
            let problem = Problem::ChannelTwice { joint: joint.to_owned(), channel: channel.name() };
            return Err((Some(word.place), problem));
        }
        channels.push(channel);
    }
    Ok(channels)
}

fn end_site(lexer: &mut Lexer<'_>) -> Result<Vector3<f64>, Fault> {
    lexer.expect("Site")?;
    // Some exporters name it.
    lexer.rest_of_line();
    lexer.expect("{")?;
    lexer.expect("OFFSET")?;
    let offset = vector(lexer)?;
    lexer.expect("}")?;
    Ok(offset)
}

fn motion(lexer: &mut Lexer<'_>, joints: &[Joint]) -> Result<(f64, Vec<f64>), Fault> {
    let word = lexer.next();
    match word {
        Some(w) if w.text.eq_ignore_ascii_case("MOTION") => {}
        Some(w) if w.text.eq_ignore_ascii_case("ROOT") => return Err((Some(w.place), Problem::SecondRoot)),
        _ => return Err(lexer.unexpected("`MOTION` and the frames behind it", word)),
    }
    let channels: usize = joints.iter().map(|j| j.channels.len()).sum();
    if channels == 0 {
        return Err((Some(lexer.place()), Problem::NoChannels));
    }
    key(lexer, &["Frames:"])?;
    let frames_place = lexer.place();
    let word = lexer.next();
    let Some(stated) = word.and_then(|w| w.text.parse::<u64>().ok()) else {
        return Err(lexer.unexpected("the number of frames", word));
    };
    key(lexer, &["Frame", "Time:"])?;
    let word = lexer.next();
    let Some(word) = word else { return Err(lexer.unexpected("the frame time", None)) };
    let frame_time = number(word)?;
    // A microsecond: shorter is a rate that nobody captures at.
    if !(1e-6..=1e4).contains(&frame_time) {
        return Err((Some(word.place), Problem::FrameTime(word.text.to_owned())));
    }
    let values = frames(lexer, channels)?;
    let found = values.len() / channels;
    if found == 0 {
        return Err((Some(lexer.place()), Problem::NoFrames));
    }
    if found as u64 != stated {
        return Err((Some(frames_place), Problem::FrameCount { stated, found }));
    }
    Ok((frame_time, values))
}

/// A keyword of one or more words, where blanks before the colon do no harm.
fn key(lexer: &mut Lexer<'_>, words: &[&str]) -> Result<(), Fault> {
    for expected in words {
        let word = lexer.next();
        let bare = expected.trim_end_matches(':');
        match word {
            Some(w) if w.text.eq_ignore_ascii_case(expected) => {}
            Some(w) if w.text.eq_ignore_ascii_case(bare) && bare != *expected => {
                lexer.expect(":")?;
            }
            _ => return Err(lexer.unexpected(&format!("`{}`", words.join(" ")), word)),
        }
    }
    Ok(())
}

/// One frame a line, as every exporter writes it. Frames that go over several lines are taken too, as long as every
/// frame begins on a line of its own.
fn frames(lexer: &mut Lexer<'_>, channels: usize) -> Result<Vec<f64>, Fault> {
    let mut values = Vec::new();
    let mut in_frame = 0;
    while let Some(word) = lexer.next() {
        let line_place = word.place;
        let mut next = Some(word);
        while let Some(word) = next {
            values.push(number(word)?);
            in_frame += 1;
            next = lexer.next_on_line();
        }
        if in_frame > channels {
            let frame = (values.len() - in_frame) / channels + 1;
            return Err((Some(line_place), Problem::Values { frame, found: in_frame, channels }));
        }
        if in_frame == channels {
            in_frame = 0;
        }
    }
    if in_frame > 0 {
        let frame = (values.len() - in_frame) / channels + 1;
        return Err((Some(lexer.place()), Problem::Values { frame, found: in_frame, channels }));
    }
    Ok(values)
}
