//! The formats of motion files: by ending, by content, and in which of them clips are written.

use std::path::{Path, PathBuf};

use thiserror::Error;

use crate::files::{self, FileError};

macro_rules! formats {
    ($($(#[doc = $doc:literal])* $Format:ident: $endings:expr;)*) => {
        /// A format of motion files.
        #[derive(Debug, Clone, Copy, PartialEq, Eq)]
        pub enum Format {
            $($(#[doc = $doc])* $Format,)*
        }

        impl Format {
            const ALL: &[Self] = &[$(Self::$Format),*];

            const fn endings(self) -> &'static [&'static str] {
                match self {
                    $(Self::$Format => &$endings,)*
                }
            }
        }
    };
}

// Each with the endings of its files' names.
formats! {
    /// BVH.
    Bvh: ["bvh"];
    /// glTF. VRM and its animations are glTF by another name.
    Gltf: ["glb", "gltf", "vrm", "vrma"];
    /// FBX, which is recognised only to say how to convert it.
    Fbx: ["fbx"];
}

impl Format {
    /// The format of a file by its first bytes, or else by its name. A name without a known ending is BVH.
    pub(crate) fn of_file(path: &Path) -> Result<Self, FileError> {
        Ok(Self::of_content(path, &files::head(path, 64)?))
    }

    /// The same, of a file with these first bytes.
    pub(crate) fn of_content(path: &Path, head: &[u8]) -> Self {
        let by_content = Self::ALL.iter().copied().find(|format| format.begins(head));
        by_content.or_else(|| Self::of(path)).unwrap_or(Self::Bvh)
    }

    /// Whether these first bytes are those of a file of the format.
    fn begins(self, head: &[u8]) -> bool {
        let text = head.trim_ascii_start();
        match self {
            Self::Bvh => text.starts_with(b"HIERARCHY"),
            // Its text form is JSON, as other files are.
            Self::Gltf => head.starts_with(b"glTF"),
            Self::Fbx => head.starts_with(b"Kaydara FBX Binary") || text.starts_with(b"; FBX"),
        }
    }

    /// The format of a file, by the ending of its name.
    pub fn of(path: &Path) -> Option<Self> {
        let ending = path.extension()?;
        Self::ALL
            .iter()
            .copied()
            .find(|format| format.endings().iter().any(|e| ending.eq_ignore_ascii_case(e)))
    }

    /// The endings of files that are read: `.bvh, .glb, ...`.
    pub fn endings_that_are_read() -> String {
        let read = Self::ALL.iter().filter(|format| **format != Self::Fbx);
        read.flat_map(|format| format.endings())
            .map(|ending| format!(".{ending}"))
            .collect::<Vec<_>>()
            .join(", ")
    }

    /// The format in which a clip is written to a file, by the ending of its name: BVH, also where it has none, or glTF if
    /// the clip comes from a file with the same ending. `input`: that file; `None` for a clip on another skeleton.
    ///
    /// # Errors
    /// [`EndingError`] names the endings that can be written.
    pub fn of_output(output: &Path, input: Option<&Path>) -> Result<Self, EndingError> {
        let Some(ending) = output.extension() else { return Ok(Self::Bvh) };
        let format = Self::of(output).filter(|format| *format != Self::Fbx);
        let input = input.map(file_of).filter(|path| is_gltf(path)).and_then(Path::extension);
        if format == Some(Self::Bvh) {
            return Ok(Self::Bvh);
        }
        if input.is_some_and(|input| input.eq_ignore_ascii_case(ending)) {
            return Ok(Self::Gltf);
        }
        let reason = match (format, input) {
            (Some(_), Some(_)) => "glTF is written with the ending of the input",
            (Some(_), None) => {
                "glTF is read and not written, except where the clip comes from glTF and stays on its nodes"
            }
            _ => "this ending can't be written",
        };
        let own = input.map(|e| format!(" or .{}", e.to_string_lossy().to_ascii_lowercase()));
        let endings = format!(".bvh{}", own.unwrap_or_default());
        Err(EndingError { file: output.to_owned(), reason, endings })
    }
}

/// The file of a clip's path, without the name of an animation after a `#`.
pub fn file_of(path: &Path) -> &Path {
    file_and_animation(path).0
}

/// The file of a clip's path, and the name of an animation after a `#`.
pub fn file_and_animation(path: &Path) -> (&Path, Option<&str>) {
    // Folders and animations may have a `#` in their names: the first behind the ending of a glTF file counts.
    let text = path.to_str().unwrap_or_default();
    let parts = text.match_indices('#').map(|(at, _)| (Path::new(&text[..at]), Some(&text[at + 1..])));
    let named = || parts.into_iter().find(|(file, _)| is_gltf(file));
    (!path.exists()).then(named).flatten().unwrap_or((path, None))
}

/// An output whose ending can't be written.
#[derive(Debug, Clone, PartialEq, Error)]
#[error("{}: {reason}: choose a name that ends in {endings}", .file.display())]
pub struct EndingError {
    /// The output.
    pub file: PathBuf,
    /// Why it can't be written.
    pub reason: &'static str,
    /// The endings that can be written.
    pub endings: String,
}

/// Whether a file is glTF, by its name.
pub(crate) fn is_gltf(path: &Path) -> bool {
    Format::of(path) == Some(Format::Gltf)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_animation_follows_the_hash_behind_a_gltf_file() {
        let cases = [
            ("a.glb#walk", "a.glb", Some("walk")),
            ("c#1/a.glb#walk", "c#1/a.glb", Some("walk")),
            ("a.glb#b.glb#c", "a.glb", Some("b.glb#c")),
            ("c#1/a.glb", "c#1/a.glb", None),
            ("a#b.bvh", "a#b.bvh", None),
        ];
        for (path, file, animation) in cases {
            assert_eq!(file_and_animation(Path::new(path)), (Path::new(file), animation), "{path}");
        }
    }

    #[test]
    fn the_commands_page_names_all_endings_that_are_read() {
        let page = include_str!("../../../docs/COMMANDS.md");
        let endings = Format::endings_that_are_read();
        let names_all = |line: &str| endings.split(", ").all(|ending| line.contains(ending));
        assert!(page.lines().any(names_all), "no line names {endings}");
    }
}
