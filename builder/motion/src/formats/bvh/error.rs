//! Errors of BVH files: the place, what was expected there, and what to do.

use thiserror::Error;

use crate::files::FileError;

/// A file that could not be read, with the place of the error: `walk.bvh:134:17: ...`.
#[derive(Debug, Clone, PartialEq, Error)]
#[error("{file}{}: {kind}", place(.line, .column))]
pub struct BvhError {
    /// The file, as the caller named it.
    pub file: String,
    /// Line, from 1; 0 for an error of the whole file.
    pub line: usize,
    /// Column in characters, from 1; 0 for an error of the whole file.
    pub column: usize,
    /// The error.
    pub kind: BvhErrorKind,
}

fn place(line: &usize, column: &usize) -> String {
    if *line == 0 { String::new() } else { format!(":{line}:{column}") }
}

/// Kinds of errors in a BVH file.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
#[allow(missing_docs, reason = "the messages say what the fields are")]
pub enum BvhErrorKind {
    #[error("cannot be read: {0}")]
    File(FileError),
    #[error("the text is not UTF-8; save the file as UTF-8 (plain ASCII will do) and try again")]
    NotUtf8,
    #[error("this is no text, so it is no BVH file; give one, or a glTF file")]
    Binary,
    #[error("expected {expected}, found {found}; {advice}")]
    Unexpected { expected: &'static str, found: String, advice: &'static str },
    #[error(
        "the file has no MOTION part after its HIERARCHY, so nothing moves; export it again with animation"
    )]
    NoMotion,
    #[error("the file has no frames; export it again with at least one frame")]
    NoFrames,
    #[error("no joint has a channel, so nothing can move; give the joints CHANNELS lines")]
    NoChannels,
    #[error(
        "a second ROOT: expected MOTION; Gestus reads one body a file, so split the bodies into a file each"
    )]
    SeveralRoots,
    #[error(
        "a second joint is called `{name}` (the first is on line {first}); names must differ, rename one of them"
    )]
    DuplicateJoint { name: String, first: usize },
    #[error("joint `{joint}` has a second {word} line; leave one of them out")]
    DuplicateLine { joint: String, word: &'static str },
    #[error(
        "joint `{joint}` has no OFFSET line before its closing brace; add one, `OFFSET 0 0 0` if it has no length"
    )]
    NoOffset { joint: String },
    #[error(
        "CHANNELS of joint `{joint}` come after its children; move the line above the first JOINT below it"
    )]
    LateChannels { joint: String },
    #[error(
        "expected a number of channels from 0 to 6, found `{found}`; count the channel names on this line"
    )]
    ChannelCount { found: String },
    #[error(
        "joint `{joint}` has more channel names than the expected {expected}; correct the number before them"
    )]
    ExtraChannel { joint: String, expected: usize },
    #[error("joint `{joint}` names the channel {channel} twice; each can be there once")]
    DuplicateChannel { joint: String, channel: &'static str },
    #[error(
        "joints are nested more than {limit} deep, which no body needs; look for a missing closing brace"
    )]
    TooDeep { limit: usize },
    #[error("expected a number, found `{found}`; correct the value or export the file again")]
    NotANumber { found: String },
    #[error(
        "found `{found}`, a number with a decimal comma; write a point (1.5, not 1,5) and no commas between values"
    )]
    CommaDecimal { found: String },
    #[error("expected a finite number, found `{found}`; the exporter failed here, repair or cut the frame")]
    NotFinite { found: String },
    #[error(
        "the number `{found}` is too large to be held; the exporter failed here, repair or cut the frame"
    )]
    Overflow { found: String },
    #[error(
        "the length `{found}` is beyond 1e10, which no body's is in any unit; the exporter failed here, correct the value"
    )]
    Length { found: String },
    #[error(
        "the angle `{found}` is beyond 1e7 degrees; the exporter failed here, correct the value or cut the frame"
    )]
    Angle { found: String },
    #[error(
        "expected a whole number of frames, found `{found}`; write `Frames: N` with the number of lines below it"
    )]
    FrameCount { found: String },
    #[error(
        "expected a frame time from 0.000001 to 1 second, found `{found}`; {advice}30 frames a second are 0.0333333"
    )]
    FrameTime { found: String, advice: &'static str },
    #[error(
        "frame {frame} has {found} values, expected {expected} (one a channel); complete the line or cut the frame"
    )]
    TooFewValues { frame: usize, found: usize, expected: usize },
    #[error(
        "frame {frame} has more than the expected {expected} values (one a channel); one line holds one frame"
    )]
    TooManyValues { frame: usize, expected: usize },
    #[error(
        "`Frames:` promises {promised} frames, found {found}; correct the number, or export the file again if it was cut"
    )]
    FrameCountLies { promised: u64, found: usize },
    #[error("more than {limit} joints, which no body has; leave out what is not of the body")]
    TooManyJoints { limit: usize },
    #[error(
        "{frames} frames of {joints} joints would take {megabytes} MB, which is out of proportion to the file; leave out joints \
         that do not move, or cut the clip"
    )]
    TooMuch { joints: usize, frames: usize, megabytes: usize },
}
