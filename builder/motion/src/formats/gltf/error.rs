//! Errors of glTF files: the place, and what to do.

use thiserror::Error;

use crate::{binding::ConvertError, files::FileError};

/// A file that could not be read.
#[derive(Debug, Clone, PartialEq, Error)]
#[error("{file}: {kind}")]
pub struct GltfError {
    /// The file, as the caller named it.
    pub file: String,
    /// The error.
    pub kind: GltfErrorKind,
}

/// Kinds of errors in a glTF file.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
#[allow(missing_docs, reason = "the messages say what the fields are")]
pub enum GltfErrorKind {
    #[error("cannot be read: {0}")]
    File(FileError),
    #[error("{0}; this is not a glTF 2.0 file, or it is damaged: export it again")]
    NotGltf(String),
    #[error(
        "it is glTF 1.0, and only glTF 2.0 is read; export it again as glTF 2.0, or convert it: `npx gltf-pipeline -i \
         OLD.gltf -o NEW.glb`"
    )]
    FirstVersion,
    #[error(
        "it is shorter than its header or one of its parts says; the file is damaged, fetch or export it again"
    )]
    Cut,
    #[error(
        "bufferViews[{view}] is packed by meshoptimizer and can't be unpacked: {what}; the file is damaged, fetch or export \
         it again"
    )]
    Packed { view: usize, what: &'static str },
    #[error(
        "bufferViews[{view}] says that it unpacks to {megabytes} MB, which is out of proportion to the file; it is damaged, or \
         unpack it first, as `gltf-transform copy` does"
    )]
    Inflates { view: usize, megabytes: usize },
    #[error(
        "buffer {buffer} is in {uri}: {reason}; export one .glb file that holds it, or put it beside this one"
    )]
    Buffer { buffer: usize, uri: String, reason: FileError },
    #[error("buffer {buffer} is in the binary part, and the file has none; export it again")]
    NoBinary { buffer: usize },
    #[error(
        "its JSON would take {megabytes} MB of memory, which is out of proportion to the file; it is damaged"
    )]
    TooMuch { megabytes: usize },
    #[error("buffer {buffer}: its data URI is not base64: {reason}; export the file again")]
    DataUri { buffer: usize, reason: String },
    #[error("accessor {accessor}: {what}; the file is damaged, export it again")]
    Accessor { accessor: usize, what: &'static str },
    #[error(
        "node `{node}` is its own ancestor or has two parents, so the nodes are no tree; the file is damaged, export it \
         again"
    )]
    NoTree { node: String },
    #[error(
        "nodes are nested more than {limit} deep, which no body needs; leave what is not of the body out of the export"
    )]
    TooDeep { limit: usize },
    #[error("more than {limit} joints, which no body has; leave out what is not of the body")]
    TooManyJoints { limit: usize },
    #[error("no animation turns a joint, so nothing moves; export it again with animation")]
    NoMotion,
    #[error("it has no nodes, so that there is no skeleton; export the character with its bones")]
    NoNodes,
    #[error("{place}: {what}; export the animation again")]
    Curve { place: String, what: &'static str },
    #[error("{place}: its quaternion is all zeros, which is no rotation; export it again")]
    NoRotation { place: String },
    #[error(
        "node `{node}` is scaled by {scale:?}, and a skeleton is scaled alike along all axes (mirrored or not) and not to \
         zero; apply scales before the export"
    )]
    Scale { node: String, scale: [f64; 3] },
    #[error(
        "animation `{animation}`: {seconds:.1} s of {joints} joints at {rate_hz} frames a second are out of proportion to the \
         file; cut the clip, correct its times, or name one animation of several"
    )]
    TooLong { animation: String, seconds: f64, joints: usize, rate_hz: f64 },
    #[error("{0}")]
    Convert(ConvertError),
    #[error("it needs {uri}, which can't be copied: {reason}; write the output into the folder of the input")]
    NotCopied { uri: String, reason: String },
    #[error("it would become larger than the 4 GB of a .glb file; cut the clip, or write .bvh")]
    TooLarge,
    #[error("it holds {} animations: {}; name one, as in `{file}#{}`", .names.len(), .names.join(", "), .names[0])]
    Several { file: String, names: Vec<String> },
    #[error(
        "each of its {animations} animations moves one joint, and no joint is moved by two: together they are one motion; export \
         it again with all curves in one animation (Blender: animation mode `Scene`), or name one"
    )]
    OneByOne { animations: usize },
    #[error("no animation is called `{wanted}`; it holds {}", .names.join(", "))]
    NoSuch { wanted: String, names: Vec<String> },
}
