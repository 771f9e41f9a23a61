//! Tokens to a document, in one pass and without recursion.
//!
//! The open joints are a stack on the heap, at most [`MAX_DEPTH`] deep. The frame count of the file is compared
//! with the number of lines after they were read, so memory grows with the text, never with a number in it. Joints without
//! channels take no text in a frame and memory in a clip: a file whose clip would be many times its size is refused.

use std::collections::HashMap;

use crate::formats::bvh::document::{Bvh, Channel, Joint};
use crate::formats::bvh::error::{BvhError, BvhErrorKind as Kind};
use crate::formats::bvh::lexer::{Lexer, Token};
use crate::{
    clip::{FRAME_BYTES, ROTATION_BYTES},
    files::memory,
};

/// Deepest nesting of joints that is read.
pub const MAX_DEPTH: usize = 256;
/// Most joints of a body that is read.
pub const MAX_JOINTS: usize = 4096;

impl Bvh {
    /// Reads a document. `file` is its name, for messages and for naming the clip.
    pub fn parse(bytes: &[u8], file: &str) -> Result<Bvh, BvhError> {
        let bytes = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes);
        let text = std::str::from_utf8(bytes).map_err(|e| {
            let before = String::from_utf8_lossy(&bytes[..e.valid_up_to()]);
            let mut lexer = Lexer::new(&before);
            while lexer.next().is_some() {}
            let (line, column) = lexer.place();
            BvhError {
                file: file.to_string(),
                line,
                column,
                kind: if bytes.trim_ascii_start().starts_with(b"HIERARCHY") {
                    Kind::NotUtf8
                } else {
                    Kind::Binary
                },
            }
        })?;
        let (lexer, joints, lines) = (Lexer::new(text), Vec::new(), HashMap::new());
        Parser { lexer, file, joints, channels: 0, rest_rotations: false, lines }.document()
    }
}

pub(super) struct Parser<'t> {
    lexer: Lexer<'t>,
    file: &'t str,
    joints: Vec<Joint>,
    channels: usize,
    /// Whether OFFSET lines hold rotations.
    rest_rotations: bool,
    /// Line of each joint's name.
    lines: HashMap<&'t str, usize>,
}

impl<'t> Parser<'t> {
    fn error_at(&self, line: usize, column: usize, kind: Kind) -> BvhError {
        BvhError { file: self.file.to_string(), line, column, kind }
    }

    pub(super) fn error(&self, token: Token, kind: Kind) -> BvhError {
        self.error_at(token.line, token.column, kind)
    }

    fn error_here(&self, kind: Kind) -> BvhError {
        let (line, column) = self.lexer.place();
        self.error_at(line, column, kind)
    }

    fn unexpected(&self, token: Option<Token>, expected: &'static str, advice: &'static str) -> BvhError {
        match token {
            Some(t) => self.error(t, Kind::Unexpected { expected, found: shown(t.text), advice }),
            None => self.error_here(Kind::Unexpected {
                expected,
                found: "the end of the file".to_string(),
                advice,
            }),
        }
    }

    /// Consumes that word; case is ignored.
    fn expect(&mut self, word: &'static str, advice: &'static str) -> Result<Token<'t>, BvhError> {
        match self.lexer.next() {
            Some(t) if t.text.eq_ignore_ascii_case(word) => Ok(t),
            other => Err(self.unexpected(other, word, advice)),
        }
    }

    fn document(mut self) -> Result<Bvh, BvhError> {
        self.expect("HIERARCHY", "is this a BVH file?")?;
        self.expect("ROOT", "a BVH file starts with HIERARCHY and one ROOT joint")?;
        self.hierarchy()?;
        match self.lexer.next() {
            Some(t) if is(t, "MOTION") => {}
            Some(t) if is(t, "ROOT") => return Err(self.error(t, Kind::SeveralRoots)),
            Some(t) if is(t, "Frames") => {
                return Err(self.unexpected(Some(t), "MOTION", "write a line MOTION before it"));
            }
            None => return Err(self.error_here(Kind::NoMotion)),
            other => {
                return Err(self.unexpected(
                    other,
                    "MOTION",
                    "the ROOT's braces are closed; look for a closing brace too many",
                ));
            }
        }
        if self.channels == 0 {
            return Err(self.error_here(Kind::NoChannels));
        }
        self.motion()
    }

    /// From the root's name to the brace that closes it.
    fn hierarchy(&mut self) -> Result<(), BvhError> {
        let mut open = Vec::new();
        let mut has_offset = Vec::new();
        let mut has_channels = Vec::new();
        self.joint(None, &mut open, &mut has_offset, &mut has_channels)?;
        while let Some(&joint) = open.last() {
            let Some(token) = self.lexer.next() else {
                return Err(self.unexpected(
                    None,
                    "a closing brace",
                    "the file was cut or a closing brace is missing",
                ));
            };
            let name = || self.joints[joint].name.clone();
            if is(token, "OFFSET") {
                if has_offset[joint] {
                    return Err(self.error(token, Kind::DuplicateLine { joint: name(), word: "OFFSET" }));
                }
                has_offset[joint] = true;
                self.joints[joint].offset = self.triple()?;
                self.rest_rotation(token.line)?;
            } else if is(token, "CHANNELS") {
                if has_channels[joint] {
                    return Err(self.error(token, Kind::DuplicateLine { joint: name(), word: "CHANNELS" }));
                }
                if joint + 1 != self.joints.len() {
                    return Err(self.error(token, Kind::LateChannels { joint: name() }));
                }
                has_channels[joint] = true;
                self.channel_list(joint)?;
            } else if is(token, "JOINT") {
                if open.len() >= MAX_DEPTH {
                    return Err(self.error(token, Kind::TooDeep { limit: MAX_DEPTH }));
                }
                self.joint(Some(joint), &mut open, &mut has_offset, &mut has_channels)?;
            } else if is(token, "END") {
                self.end_site(joint)?;
            } else if token.text == "}" {
                if !has_offset[joint] {
                    return Err(self.error(token, Kind::NoOffset { joint: name() }));
                }
                open.pop();
            } else if is(token, "ROOT") {
                return Err(self.error(token, Kind::SeveralRoots));
            } else {
                return Err(self.unexpected(
                    Some(token),
                    "OFFSET, CHANNELS, JOINT, End Site or a closing brace",
                    "correct or remove the word",
                ));
            }
        }
        Ok(())
    }

    /// A name and an opening brace.
    fn joint(
        &mut self,
        parent: Option<usize>,
        open: &mut Vec<usize>,
        has_offset: &mut Vec<bool>,
        has_channels: &mut Vec<bool>,
    ) -> Result<(), BvhError> {
        if self.joints.len() >= MAX_JOINTS {
            return Err(self.error_here(Kind::TooManyJoints { limit: MAX_JOINTS }));
        }
        let Some(name) = self.lexer.name() else {
            let next = self.lexer.peek();
            return Err(self.unexpected(next, "the joint's name", "give every joint a name"));
        };
        if let Some(&first) = self.lines.get(name.text) {
            return Err(self.error(name, Kind::DuplicateJoint { name: shown_name(name.text), first }));
        }
        self.lines.insert(name.text, name.line);
        self.expect("{", "a joint's lines stand between braces")?;
        open.push(self.joints.len());
        has_offset.push(false);
        has_channels.push(false);
        self.joints.push(Joint {
            name: name.text.to_string(),
            parent,
            offset: [0.0; 3],
            channels: Vec::new(),
            first_channel: self.channels,
            end_sites: Vec::new(),
        });
        Ok(())
    }

    fn channel_list(&mut self, joint: usize) -> Result<(), BvhError> {
        let Some(count) = self.lexer.next() else {
            return Err(self.unexpected(None, "a number of channels", "the file was cut"));
        };
        let wanted = match count.text.parse::<usize>() {
            Ok(n) if n <= 6 => n,
            _ => return Err(self.error(count, Kind::ChannelCount { found: shown_name(count.text) })),
        };
        for _ in 0..wanted {
            let token = self.lexer.next();
            let Some((token, channel)) = token.and_then(|t| Some((t, Channel::from_word(t.text)?))) else {
                return Err(self.unexpected(
                    token,
                    "a channel (Xposition, Yposition, Zposition, Xrotation, Yrotation or Zrotation)",
                    "the number before the names must be how many there are",
                ));
            };
            if self.joints[joint].channels.contains(&channel) {
                let joint = self.joints[joint].name.clone();
                return Err(self.error(token, Kind::DuplicateChannel { joint, channel: channel.word() }));
            }
            self.joints[joint].channels.push(channel);
        }
        if let Some(t) = self.lexer.peek().filter(|t| Channel::from_word(t.text).is_some()) {
            let joint = self.joints[joint].name.clone();
            return Err(self.error(t, Kind::ExtraChannel { joint, expected: wanted }));
        }
        self.channels += wanted;
        Ok(())
    }

    fn end_site(&mut self, joint: usize) -> Result<(), BvhError> {
        // `End Site {`; the second word is left out, or replaced by a name, by some writers.
        self.lexer.name();
        self.expect("{", "an End Site's OFFSET stands between braces")?;
        self.expect("OFFSET", "an End Site has one OFFSET and nothing else")?;
        let offset = self.triple()?;
        self.expect("}", "an End Site has one OFFSET and nothing else")?;
        self.joints[joint].end_sites.push(offset);
        Ok(())
    }

    /// Three angles behind an OFFSET, as some exporters (SOMA) add: the joint's rotation at rest, which channels include.
    fn rest_rotation(&mut self, line: usize) -> Result<(), BvhError> {
        if self.lexer.peek().is_some_and(|t| t.line == line && self.number(t).is_ok()) {
            self.triple()?;
            self.rest_rotations = true;
        }
        Ok(())
    }

    fn triple(&mut self) -> Result<[f64; 3], BvhError> {
        let mut triple = [0.0; 3];
        for value in &mut triple {
            let Some(token) = self.lexer.next() else {
                return Err(self.unexpected(None, "a number", "the file was cut"));
            };
            *value = self.length(token)?;
        }
        Ok(triple)
    }

    fn motion(mut self) -> Result<Bvh, BvhError> {
        const HEAD: &str = "MOTION is followed by `Frames: N` and `Frame Time: SECONDS`";
        if self.lexer.peek().is_none() {
            return Err(self.error_here(Kind::NoFrames));
        }
        self.expect("Frames", HEAD)?;
        let colon = self.expect(":", HEAD)?;
        let count = self.lexer.next();
        let Some(count) = count else { return Err(self.unexpected(None, "a number of frames", HEAD)) };
        let promised: u64 = count.text.parse().map_err(|_| match count.line == colon.line {
            true => self.error(count, Kind::FrameCount { found: shown_name(count.text) }),
            false => self.nothing_behind(colon, "a number of frames", "write how many lines follow below"),
        })?;
        self.expect("Frame", HEAD)?;
        self.expect("Time", HEAD)?;
        let (time, frame_time_s) = self.frame_time(HEAD)?;
        let values = self.rows(time.line, promised)?;
        let found = values.len() / self.channels;
        if found == 0 {
            return Err(self.error(count, Kind::NoFrames));
        }
        let mut notes = Vec::new();
        if self.rest_rotations {
            notes.push("OFFSET lines hold rotations at rest too, which are not used or written: channels include them".into());
        }
        match promised.abs_diff(found as u64) {
            0 => {}
            // Some exporters count the rest pose, or do not count the last frame.
            1 => notes.push(format!("`Frames:` promises {promised} frames, and {found} are there and used")),
            _ => return Err(self.error(count, Kind::FrameCountLies { promised, found })),
        }
        let bytes = found * (FRAME_BYTES + self.joints.len() * ROTATION_BYTES) + 8 * values.len();
        if bytes > memory::max_bytes(self.lexer.length()) {
            let joints = self.joints.len();
            return Err(self.error(count, Kind::TooMuch { joints, frames: found, megabytes: bytes >> 20 }));
        }
        let name = self.file.to_string();
        let (joints, channels) = (self.joints, self.channels);
        Ok(Bvh { name, notes, joints, channels, frame_time_s, values })
    }

    /// Seconds per frame, behind the colon, and their position.
    fn frame_time(&mut self, advice: &'static str) -> Result<(Token<'t>, f64), BvhError> {
        const EXPECTED: &str = "a frame time in seconds";
        let colon = self.expect(":", advice)?;
        let Some(time) = self.lexer.next() else {
            return Err(self.unexpected(None, EXPECTED, advice));
        };
        let seconds = self.number(time);
        let fits = seconds.as_ref().is_ok_and(|s| (1e-6..=1.0).contains(s));
        // Numbers of a line below are those of the first frame.
        let below = time.line != colon.line;
        if below && (!fits || self.lexer.peek().is_some_and(|t| t.line == time.line)) {
            return Err(self.nothing_behind(colon, EXPECTED, "30 frames a second are 0.0333333"));
        }
        let seconds = seconds?;
        if !fits {
            let advice = if seconds > 1.0 { "is it in milliseconds? " } else { "" };
            return Err(self.error(time, Kind::FrameTime { found: shown_name(time.text), advice }));
        }
        Ok((time, seconds))
    }

    /// A colon that ends its line.
    fn nothing_behind(&self, colon: Token, expected: &'static str, advice: &'static str) -> BvhError {
        let found = "the end of the line".to_string();
        self.error_at(colon.line, colon.column + 1, Kind::Unexpected { expected, found, advice })
    }

    /// The motion table: one line per frame; blank lines are skipped.
    fn rows(&mut self, header: usize, promised: u64) -> Result<Vec<f64>, BvhError> {
        let expected = self.channels;
        // A value takes two characters or more, whatever is promised.
        let most = self.lexer.left() / 2 + 1;
        let room = usize::try_from(promised).unwrap_or(most).saturating_mul(expected).min(most);
        let channels: Vec<Channel> = self.joints.iter().flat_map(|j| j.channels.iter().copied()).collect();
        let mut values = Vec::with_capacity(room);
        let mut last: Option<Token> = None;
        while let Some(token) = self.lexer.next() {
            let (frame, found) = (values.len() / expected, values.len() % expected);
            let same_line = last.map_or(token.line == header, |l| l.line == token.line);
            if same_line && found == 0 {
                let frame = if last.is_some() { frame } else { 1 };
                return Err(self.error(token, Kind::TooManyValues { frame, expected }));
            }
            if let Some(l) = last.filter(|_| !same_line && found != 0) {
                let column = l.column + l.text.chars().count();
                let kind = Kind::TooFewValues { frame: frame + 1, found, expected };
                return Err(self.error_at(l.line, column, kind));
            }
            values.push(self.value(token, channels[found])?);
            last = Some(token);
        }
        let (frame, found) = (values.len() / expected + 1, values.len() % expected);
        if found != 0 {
            return Err(self.error_here(Kind::TooFewValues { frame, found, expected }));
        }
        Ok(values)
    }
}

fn is(token: Token, word: &str) -> bool {
    token.text.eq_ignore_ascii_case(word)
}

/// A word of the file, shortened for a message.
pub(super) fn shown_name(text: &str) -> String {
    let mut shown: String = text.chars().filter(|c| !c.is_control()).take(40).collect();
    if text.chars().count() > 40 {
        shown.push('…');
    }
    shown
}

fn shown(text: &str) -> String {
    format!("`{}`", shown_name(text))
}
