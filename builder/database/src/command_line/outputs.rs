//! Output of commands: checks of output files, and printing. What is printed may hold names from files that others wrote:
//! characters that would command the terminal are escaped.

use std::{
    borrow::Cow,
    ffi::{OsStr, OsString},
    path::{Path, PathBuf},
    process::ExitCode,
    sync::atomic::{AtomicBool, Ordering},
};

use anyhow::{Result, bail};
use clap::{ArgMatches, Command};
use same_file::Handle;
use serde_json::json;
use thiserror::Error;

use crate::data_folder::config::FILE_NAME;
use gestus_motion::{
    capture::{EndingError, Format, file_of, motion_files},
    files::NewFile,
};

/// Names of standard output.
const STANDARD: [&str; 3] = ["/dev/stdout", "/dev/fd/1", "/proc/self/fd/1"];

/// An output that can't be written as it was asked for.
#[derive(Debug, PartialEq, Error)]
#[error("{option} {problem}")]
pub struct OutputError {
    /// The option that names the output.
    pub option: String,
    /// Why.
    pub problem: OutputProblem,
}

/// Why an output can't be written.
#[derive(Debug, PartialEq, Error)]
#[allow(missing_docs, reason = "the messages say what the fields are")]
pub enum OutputProblem {
    #[error(transparent)]
    Ending(EndingError),
    #[error("{}: there is no folder {}: make it first", file.display(), folder.display())]
    NoFolder { file: PathBuf, folder: PathBuf },
    #[error("{}: this is a folder: give a file in it", .0.display())]
    IsFolder(PathBuf),
    #[error(
        "{}: it would be written over an input{}: choose another file",
        file.display(),
        folder.as_ref().map_or_else(String::new, |folder| format!(" of {}", folder.display()))
    )]
    Input { file: PathBuf, folder: Option<PathBuf> },
    #[error("{}: it is another name (a hard link) of the input {}: choose another file", file.display(), input.display())]
    Link { file: PathBuf, input: PathBuf },
    #[error("{}: {other} is written there too: choose another file", file.display())]
    Taken { file: PathBuf, other: String },
    #[error("{}: this is standard output, which gets the figures: give a file", .0.display())]
    Standard(PathBuf),
    #[error("{}: nothing can be written there: {error}", file.display())]
    Unwritable { file: PathBuf, error: String },
}

/// Refuses outputs that would overwrite an input or each other, and outputs in folders that do not exist or are read-only.
/// Call it before any work, so that no input is lost and no time is wasted. An input folder stands for its clips and its `gestus.toml`.
/// Each output comes with the option that names it, and is `None` if that is not given.
///
/// # Errors
/// [`OutputError`] names the option and the file.
pub fn check_outputs<'a>(
    read: impl IntoIterator<Item = Option<&'a PathBuf>>,
    written: impl IntoIterator<Item = (&'a str, Option<&'a PathBuf>)>,
) -> Result<(), OutputError> {
    let named: Vec<&PathBuf> = read.into_iter().flatten().collect();
    let read: Vec<PathBuf> = named.iter().filter_map(|p| file_of(p).canonicalize().ok()).collect();
    let mut links = Links::new(&read);
    let mut taken: Vec<(&str, PathBuf)> = Vec::new();
    for (option, path) in written.into_iter().filter_map(|(option, path)| Some((option, path?))) {
        let refuse = |problem| Err(OutputError { option: option.to_owned(), problem });
        let file = path.clone();
        if STANDARD.iter().any(|name| path == Path::new(name)) {
            return refuse(OutputProblem::Standard(file));
        }
        // A clip keeps the ending of its input (`check_clip`).
        if Format::of(path) == Some(Format::Gltf)
            && let Some(error) = refused(path, &named)
        {
            return refuse(OutputProblem::Ending(error));
        }
        let Some(place) = place(path) else {
            let folder = if names_folder(path) { path } else { path.parent().unwrap_or(path) };
            return refuse(OutputProblem::NoFolder { file, folder: folder.to_owned() });
        };
        if place.is_dir() {
            return refuse(OutputProblem::IsFolder(file));
        }
        // Devices such as /dev/null may be written to several times.
        if place.exists() && !place.is_file() {
            continue;
        }
        if let Some(input) = read.iter().find(|input| holds(input, &place)) {
            let folder = input.is_dir().then(|| input.clone());
            return refuse(OutputProblem::Input { file, folder });
        }
        if let Some(input) = links.holds(&place) {
            return refuse(OutputProblem::Link { file, input: input.to_owned() });
        }
        if let Some((other, _)) = taken.iter().find(|(_, other)| *other == place) {
            return refuse(OutputProblem::Taken { file, other: (*other).to_owned() });
        }
        if let Err(error) = NewFile::create(&place) {
            return refuse(OutputProblem::Unwritable { file, error: error.to_string() });
        }
        taken.push((option, place));
    }
    Ok(())
}

/// Why no clip of these inputs can be written to a file.
fn refused(output: &Path, read: &[&PathBuf]) -> Option<EndingError> {
    let of = |input| Format::of_output(output, input).err();
    let none = of(None)?;
    if read.iter().any(|input| of(Some(input)).is_none()) { None } else { Some(none) }
}

/// Refuses a file for a clip whose ending can't be written. `input`: the file that the clip comes from and on whose
/// skeleton it is; `None` for a clip on another one.
///
/// # Errors
/// [`OutputError`] names the option, the file, and the endings that can be written.
pub fn check_clip(
    option: &str,
    output: Option<&PathBuf>,
    input: Option<&PathBuf>,
) -> Result<(), OutputError> {
    match output.map(|output| Format::of_output(output, input.map(PathBuf::as_path))) {
        Some(Err(error)) => {
            Err(OutputError { option: option.to_owned(), problem: OutputProblem::Ending(error) })
        }
        _ => Ok(()),
    }
}

/// Refuses a name of an animation for an output that has none.
///
/// # Errors
/// A message with the option.
pub fn check_animation(name: Option<&str>, output: &Path) -> Result<()> {
    match name {
        Some("") => bail!("--animation: the name is empty"),
        Some(name) if Format::of(output) != Some(Format::Gltf) => {
            bail!("--animation {name} does nothing for {}: only glTF has names", output.display())
        }
        _ => Ok(()),
    }
}

/// True if a file is that input, or is read as part of that folder.
fn holds(input: &Path, file: &Path) -> bool {
    input == file
        || (input.is_dir()
            && file.exists()
            && file.starts_with(input)
            && (Format::of(file).is_some() || file.file_name() == Some(OsStr::new(FILE_NAME))))
}

/// The input files by device and inode, found when they are first needed.
struct Links<'a> {
    read: &'a [PathBuf],
    known: Option<Vec<(Handle, PathBuf)>>,
}

impl<'a> Links<'a> {
    fn new(read: &'a [PathBuf]) -> Self {
        Self { read, known: None }
    }

    /// The input that is the same file as an output that is there already.
    fn holds(&mut self, output: &Path) -> Option<&Path> {
        let output = Handle::from_path(output).ok()?;
        let known = self.known.get_or_insert_with(|| {
            let files = self.read.iter().flat_map(|input| match input.is_dir() {
                true => motion_files(input).unwrap_or_default().0,
                false => vec![input.clone()],
            });
            // Opening a pipe would wait for its other end.
            files.filter(|f| f.is_file()).filter_map(|f| Some((Handle::from_path(&f).ok()?, f))).collect()
        });
        known.iter().find(|(input, _)| *input == output).map(|(_, path)| path.as_path())
    }
}

/// The canonical path of a file that exists or will be written; `None` if its folder does not exist.
fn place(path: &Path) -> Option<PathBuf> {
    if let Ok(place) = path.canonicalize() {
        return Some(place);
    }
    if names_folder(path) {
        return None;
    }
    let folder = path.parent().filter(|f| !f.as_os_str().is_empty()).unwrap_or(Path::new("."));
    Some(folder.canonicalize().ok().filter(|f| f.is_dir())?.join(path.file_name()?))
}

/// True if a path ends as that of a folder, `out/`.
fn names_folder(path: &Path) -> bool {
    path.as_os_str().as_encoded_bytes().last().is_some_and(|&last| std::path::is_separator(last.into()))
}

/// A file's name as text, for JSON. Bytes that are not UTF-8 are replaced.
pub fn shown(path: &Path) -> String {
    path.display().to_string()
}

/// A text with those characters escaped that control a terminal or change the order of its text. The escapes are those of
/// JSON, where the text therefore stays the same.
pub fn escaped(text: &str) -> Cow<'_, str> {
    let commands = |c: char| {
        (c.is_control() && !matches!(c, '\n' | '\t'))
            || matches!(c, '\u{200e}' | '\u{200f}' | '\u{202a}'..='\u{202e}' | '\u{2066}'..='\u{2069}')
    };
    if !text.contains(commands) {
        return Cow::Borrowed(text);
    }
    let escape = |c: char| if commands(c) { format!("\\u{:04x}", u32::from(c)) } else { c.to_string() };
    Cow::Owned(text.chars().map(escape).collect())
}

/// Prints a line for people to standard error. Where nobody reads it (`2>&1 | head`), the work goes on.
pub fn note(line: impl std::fmt::Display) {
    use std::io::Write;
    let _ = writeln!(std::io::stderr(), "{}", escaped(&line.to_string()));
}

/// A number of things in words: `1 clip`, `2 clips`.
pub fn counted(count: usize, what: &str) -> String {
    counted_as(count, [what, &format!("{what}s")])
}

/// The same for a word whose plural has another ending: `1 class`, `2 classes`.
pub fn counted_as(count: usize, [one, many]: [&str; 2]) -> String {
    format!("{count} {}", if count == 1 { one } else { many })
}

/// Parses the words of a command line, of which the first is the program. One that cannot be parsed ends the program with
/// a message, in JSON too if the command was asked for it.
pub fn matches(command: Command, words: impl IntoIterator<Item = OsString>) -> ArgMatches {
    command.try_get_matches_from(words).unwrap_or_else(|error| {
        if error.use_stderr() {
            report_in_json(error.to_string().trim_start_matches("error: "));
        }
        error.exit()
    })
}

/// What a command returns to the system, after its error is printed.
pub fn exit_code(outcome: Result<()>) -> ExitCode {
    match outcome {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            let message = format!("{error:#}");
            note(format_args!("error: {message}"));
            report_in_json(&message);
            ExitCode::FAILURE
        }
    }
}

/// True once something was printed to standard output: a command that fails after its results does not add an error to
/// them.
static HAS_SAID: AtomicBool = AtomicBool::new(false);

/// Prints an error as the one object on standard output, where a command was asked for JSON and has not printed its own.
fn report_in_json(message: &str) {
    if std::env::args_os().any(|word| word == "--json") && !HAS_SAID.load(Ordering::Relaxed) {
        // The error is on standard error too: nothing is lost where this fails.
        let _ = say(json!({ "error": message.trim_end() }));
    }
}

/// Prints a line to standard output. A closed pipe (`| head`) is not an error.
///
/// # Errors
/// Other failures of standard output, such as a full disk.
pub fn say(line: impl std::fmt::Display) -> Result<()> {
    use std::io::{ErrorKind, Write};
    HAS_SAID.store(true, Ordering::Relaxed);
    match writeln!(std::io::stdout(), "{}", escaped(&line.to_string())) {
        Err(e) if e.kind() != ErrorKind::BrokenPipe => Err(e.into()),
        _ => Ok(()),
    }
}

/// Prints notes about a file to standard error.
pub fn tell(file: &Path, notes: impl IntoIterator<Item = impl std::fmt::Display>) {
    for line in notes {
        note(format_args!("{}: {line}", file.display()));
    }
}

#[cfg(test)]
mod tests {
    use std::fs;

    use super::*;

    #[test]
    fn endings_that_cannot_be_written_are_refused_with_those_that_can() {
        let check = |output: &str, input: Option<&str>| {
            let (output, input) = (PathBuf::from(output), input.map(PathBuf::from));
            check_clip("-o", Some(&output), input.as_ref()).err().map(|e| e.to_string())
        };
        for (output, input) in [
            ("a.bvh", None),
            ("a.BVH", Some("b.glb")),
            ("a", Some("b.bvh")),
            ("/dev/null", None),
            ("a.glb", Some("b.glb")),
            ("a.GLB", Some("b.glb#walk")),
            ("a.gltf", Some("b.gltf#walk 1.5")),
        ] {
            assert_eq!(check(output, input), None, "{output} from {input:?}");
        }
        for (output, input, said) in [
            ("a.glb", Some("b.bvh"), "glTF is read and not written, except where the clip comes from glTF"),
            ("a.glb", None, "name that ends in .bvh"),
            (
                "a.gltf",
                Some("b.glb#walk"),
                "the ending of the input: choose a name that ends in .bvh or .glb",
            ),
            (
                "a.fbx",
                Some("b.bvh"),
                "-o a.fbx: this ending can't be written: choose a name that ends in .bvh",
            ),
            ("a.fbx", Some("b.gltf"), ".bvh or .gltf"),
        ] {
            let message = check(output, input).unwrap();
            assert!(message.contains(said), "{output} from {input:?}: {message}");
        }
    }

    #[test]
    fn an_input_is_known_under_its_other_names() {
        let folder = tempfile::tempdir().unwrap();
        let [data, clip, hard, other] =
            ["data", "data/a.bvh", "hard.bvh", "other.bvh"].map(|n| folder.path().join(n));
        fs::create_dir(&data).unwrap();
        fs::write(&clip, "x").unwrap();
        fs::write(&other, "x").unwrap();
        fs::hard_link(&clip, &hard).unwrap();
        for input in [&clip, &data] {
            let error = check_outputs([Some(input)], [("-o", Some(&hard))]).unwrap_err();
            assert!(
                matches!(&error.problem, OutputProblem::Link { input, .. } if input.ends_with("a.bvh")),
                "{error}"
            );
            check_outputs([Some(input)], [("-o", Some(&other))]).unwrap();
        }
    }

    /// A build of minutes ended with a file that could not be written.
    #[test]
    fn what_cannot_be_written_is_refused_before_any_work() {
        let folder = tempfile::tempdir().unwrap();
        let [file, new] = ["file", "new"].map(|n| folder.path().join(n));
        fs::write(&file, "old").unwrap();
        let check = |path: &PathBuf| check_outputs([], [("--trace", Some(path))]);
        check(&file).unwrap();
        check(&new).unwrap();
        assert!(!new.exists() && fs::read_dir(folder.path()).unwrap().count() == 1);
        let mut permissions = fs::metadata(&file).unwrap().permissions();
        permissions.set_readonly(true);
        fs::set_permissions(&file, permissions).unwrap();
        let error = check(&file).unwrap_err();
        assert_eq!(error.option, "--trace");
        assert!(
            matches!(&error.problem, OutputProblem::Unwritable { file: at, .. } if *at == file),
            "{error}"
        );
        assert_eq!(fs::read(&file).unwrap(), b"old");
    }

    #[test]
    fn names_do_not_command_the_terminal() {
        assert_eq!(escaped("Hips\t\n"), "Hips\t\n");
        assert_eq!(escaped("a\u{1b}]0;x\u{7}b\u{9b}2J\u{202e}"), "a\\u001b]0;x\\u0007b\\u009b2J\\u202e");
        let json = serde_json::json!({ "name": "\u{1b}[2J\u{9b}\u{7f}" });
        let read: serde_json::Value = serde_json::from_str(&escaped(&json.to_string())).unwrap();
        assert_eq!(read, json);
    }

    #[test]
    fn one_thing_is_no_plural() {
        assert_eq!([0, 1, 2].map(|n| counted(n, "clip")), ["0 clips", "1 clip", "2 clips"]);
        assert_eq!([1, 2].map(|n| counted_as(n, ["class", "classes"])), ["1 class", "2 classes"]);
    }

    /// A clip whose name is mistyped is reported when it is read, not as an output that can't be written.
    #[test]
    fn a_clip_that_is_not_there_has_the_format_of_its_name() {
        let [clip, output] = ["none.glb", "out.glb"].map(|name| std::env::temp_dir().join(name));
        assert!(!clip.exists());
        check_outputs([Some(&clip)], [("-o", Some(&output))]).unwrap();
        assert!(check_outputs([None], [("-o", Some(&output))]).is_err());
    }

    #[test]
    fn outputs_are_neither_inputs_nor_each_other() {
        let folder = std::env::temp_dir().join(format!("gestus-outputs-{}", std::process::id()));
        fs::create_dir_all(folder.join("data/sub")).unwrap();
        let [clip, db, new, toml, inner] =
            ["data/a.bvh", "k.gestus", "new.bvh", "data/gestus.toml", "data/sub/../a.bvh"]
                .map(|n| folder.join(n));
        for file in [&clip, &db, &toml] {
            fs::write(file, "x").unwrap();
        }
        let data = folder.join("data");
        let refused = |read: &[&PathBuf], written: &[(&'static str, &PathBuf)]| {
            check_outputs(read.iter().copied().map(Some), written.iter().map(|&(o, p)| (o, Some(p))))
                .err()
                .map(|e| (e.option, e.problem))
        };
        let output = |problem| Some(("-o".to_owned(), problem));
        for (read, written) in
            [(&clip, &clip), (&clip, &inner), (&data, &clip), (&data, &toml), (&data, &inner)]
        {
            let folder = read.is_dir().then(|| read.canonicalize().unwrap());
            let input = OutputProblem::Input { file: written.clone(), folder };
            assert_eq!(refused(&[&db, read], &[("--page", &new), ("-o", written)]), output(input));
        }
        let taken = OutputProblem::Taken { file: new.clone(), other: "--page".into() };
        assert_eq!(refused(&[&db], &[("--page", &new), ("-o", &new)]), output(taken));
        let ending = refused(&[&db], &[("-o", &folder.join("k.glb"))]);
        assert!(matches!(ending, Some((_, OutputProblem::Ending(_)))), "{ending:?}");
        for (file, missing) in [("none/k.bvh", "none"), ("none/", "none/")] {
            let [file, folder] = [file, missing].map(|name| folder.join(name));
            let problem = OutputProblem::NoFolder { file: file.clone(), folder };
            assert_eq!(refused(&[&db], &[("-o", &file)]), output(problem));
        }
        assert_eq!(
            refused(&[&db], &[("--page", &data)]),
            Some(("--page".into(), OutputProblem::IsFolder(data.clone())))
        );
        // Allowed: new files, other files in the folder, and devices.
        // An animation of a file is the file.
        let hero = folder.join("hero.glb");
        fs::write(&hero, "x").unwrap();
        let input = OutputProblem::Input { file: hero.clone(), folder: None };
        assert_eq!(refused(&[&db, &folder.join("hero.glb#walk")], &[("-o", &hero)]), output(input));
        let null = PathBuf::from("/dev/null");
        let fresh = data.join("b.bvh");
        let table = data.join("t.csv");
        assert_eq!(refused(&[&db, &data], &[("-o", &fresh), ("--csv", &table)]), None);
        assert_eq!(refused(&[&null], &[("-o", &null), ("--csv", &null)]), None);
        fs::remove_dir_all(&folder).unwrap();
    }
}
