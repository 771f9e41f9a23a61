//! Files that others wrote, read within bounds, and files of our own, which are replaced whole or not at all.
//!
//! Reading looks at a file's kind and size before it opens it: a pipe or a device would never end, and a size that was
//! not looked at is taken from memory. Writing goes to a new file beside the old one, which then takes its name, so that
//! a command that is stopped leaves the old file as it was.

use std::{
    fs::{self, File},
    io::{self, Read, Seek, SeekFrom, Write},
    path::{Component, Path, PathBuf},
};

use tempfile::{Builder, NamedTempFile};
use thiserror::Error;

/// Largest file of motion that is read, bytes.
pub const MAX_MOTION_BYTES: u64 = 1 << 30;
/// Largest file of settings, labels or maps that is read, bytes.
pub const MAX_SETTINGS_BYTES: u64 = 4 << 20;

/// How much memory the content of a file may take.
pub mod memory {
    /// Memory that any file may take, whatever its size, bytes.
    const BASE: usize = 40 << 20;
    /// Bytes of memory a byte of the file, besides the file itself.
    const TIMES: usize = 5;

    /// Most memory for the content of a file of that size.
    pub fn max_bytes(file: usize) -> usize {
        BASE.saturating_add(file.saturating_mul(TIMES))
    }
}

/// A file that is not read.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[allow(missing_docs, reason = "the messages say what the fields are")]
pub enum FileError {
    #[error("{0}")]
    Io(String),
    #[error(
        "this is a folder, a pipe or a device, and only regular files are read; copy its content to a file"
    )]
    NotRegular,
    #[error(
        "it has {bytes} bytes, and files of this kind are read up to {max_bytes}; leave out what is not needed"
    )]
    Size { bytes: u64, max_bytes: u64 },
    #[error("it is outside of the folder of the file that names it, and only files in that folder are read")]
    Outside,
    #[error("a page in a browser reads a file without those beside it")]
    Alone,
}

impl From<io::Error> for FileError {
    fn from(error: io::Error) -> Self {
        match error.kind() {
            // There are no files where a wasm module runs.
            io::ErrorKind::Unsupported => Self::Alone,
            _ => Self::Io(error.to_string()),
        }
    }
}

/// Reads a regular file of at most `max_bytes` bytes.
///
/// # Errors
/// [`FileError`]; nothing is read in that case.
pub fn read(path: &Path, max_bytes: u64) -> Result<Vec<u8>, FileError> {
    let about = fs::metadata(path)?;
    if !about.is_file() {
        return Err(FileError::NotRegular);
    }
    let bytes = about.len();
    if bytes > max_bytes {
        return Err(FileError::Size { bytes, max_bytes });
    }
    let mut content = Vec::with_capacity(bytes as usize);
    // A file may grow between the look and the reading.
    File::open(path)?.take(max_bytes + 1).read_to_end(&mut content)?;
    match content.len() as u64 {
        bytes if bytes > max_bytes => Err(FileError::Size { bytes, max_bytes }),
        _ => Ok(content),
    }
}

/// The first bytes of a regular file.
///
/// # Errors
/// [`FileError`].
pub fn head(path: &Path, bytes: u64) -> Result<Vec<u8>, FileError> {
    if !fs::metadata(path)?.is_file() {
        return Err(FileError::NotRegular);
    }
    let mut head = Vec::new();
    File::open(path)?.take(bytes).read_to_end(&mut head)?;
    Ok(head)
}

/// Reads a regular file of at most `max_bytes` bytes as UTF-8.
///
/// # Errors
/// [`FileError`].
pub fn read_text(path: &Path, max_bytes: u64) -> Result<String, FileError> {
    String::from_utf8(read(path, max_bytes)?).map_err(|_| FileError::Io("it is not UTF-8 text".to_owned()))
}

/// Reads a file that another one names by a path relative to its own folder. The file has to lie in that folder, also
/// after links are followed.
///
/// # Errors
/// [`FileError`].
pub fn read_in(folder: &Path, name: &Path, max_bytes: u64) -> Result<Vec<u8>, FileError> {
    let plain = |c: Component<'_>| matches!(c, Component::Normal(_) | Component::CurDir);
    // `C:x` and `file://x` are paths on one system and plain names on another.
    if !name.components().all(plain) || name.to_string_lossy().contains([':', '\\']) {
        return Err(FileError::Outside);
    }
    let folder = if folder.as_os_str().is_empty() { Path::new(".") } else { folder };
    let path = folder.join(name).canonicalize()?;
    if !path.starts_with(folder.canonicalize()?) {
        return Err(FileError::Outside);
    }
    read(&path, max_bytes)
}

/// A file that is being written, and takes its place when it is [committed](Self::commit).
pub struct NewFile {
    to: Destination,
}

enum Destination {
    /// The new file and the place that it takes.
    Beside(NamedTempFile, PathBuf),
    /// A device or a pipe, which nothing can be put in place of.
    Device(File),
}

impl NewFile {
    /// Begins a file. A link at that place stays, and the file that it points to is replaced.
    ///
    /// # Errors
    /// Errors of the file system: its folder is not there, or nothing may be written there.
    pub fn create(path: &Path) -> io::Result<Self> {
        let old = fs::metadata(path).ok();
        if old.as_ref().is_some_and(|old| !old.is_file()) {
            return Ok(Self { to: Destination::Device(File::options().write(true).open(path)?) });
        }
        if old.as_ref().is_some_and(|old| old.permissions().readonly()) {
            return Err(io::Error::new(io::ErrorKind::PermissionDenied, "the file there is read-only"));
        }
        let path = if old.is_some() { path.canonicalize()? } else { path.to_path_buf() };
        let folder = path.parent().filter(|f| !f.as_os_str().is_empty()).unwrap_or(Path::new("."));
        let mut builder = Builder::new();
        // Hidden, so that a folder of clips may hold one that was left.
        builder.prefix(".gestus-");
        #[cfg(unix)]
        {
            use std::os::unix::fs::PermissionsExt;
            // The process's mask takes away from them, as from any new file's.
            builder.permissions(fs::Permissions::from_mode(0o666));
        }
        let file = builder.tempfile_in(folder)?;
        if let Some(old) = old {
            file.as_file().set_permissions(old.permissions())?;
        }
        Ok(Self { to: Destination::Beside(file, path) })
    }

    fn file(&mut self) -> &mut File {
        match &mut self.to {
            Destination::Beside(file, _) => file.as_file_mut(),
            Destination::Device(file) => file,
        }
    }

    /// Puts the file in its place, once it is on the disk.
    ///
    /// # Errors
    /// Errors of the file system; what was at that place is still there.
    pub fn commit(self) -> io::Result<()> {
        match self.to {
            Destination::Beside(file, path) => {
                file.as_file().sync_all()?;
                file.persist(path).map_err(|e| e.error)?;
                Ok(())
            }
            Destination::Device(mut file) => file.flush(),
        }
    }
}

impl Write for NewFile {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.file().write(bytes)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.file().flush()
    }
}

impl Seek for NewFile {
    fn seek(&mut self, to: SeekFrom) -> io::Result<u64> {
        self.file().seek(to)
    }
}

/// Writes a file, whole or not at all.
///
/// # Errors
/// Errors of the file system; what was at that place is still there.
pub fn write(path: &Path, content: impl AsRef<[u8]>) -> io::Result<()> {
    let mut file = NewFile::create(path)?;
    file.write_all(content.as_ref())?;
    file.commit()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn size_and_kind_are_looked_at_first() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.bvh");
        write(&path, b"12345").unwrap();
        assert_eq!(read(&path, 5).unwrap(), b"12345");
        assert_eq!(read(&path, 4).unwrap_err(), FileError::Size { bytes: 5, max_bytes: 4 });
        assert_eq!(read(folder.path(), 4).unwrap_err(), FileError::NotRegular);
        assert!(matches!(read(&folder.path().join("none"), 4).unwrap_err(), FileError::Io(_)));
        write(&path, [0xff]).unwrap();
        assert!(matches!(read_text(&path, 4).unwrap_err(), FileError::Io(_)));
    }

    #[cfg(unix)]
    #[test]
    fn pipes_and_devices_are_not_opened() {
        assert_eq!(read(Path::new("/dev/zero"), 4).unwrap_err(), FileError::NotRegular);
        let folder = tempfile::tempdir().unwrap();
        let pipe = folder.path().join("walk.bvh");
        let made = std::process::Command::new("mkfifo").arg(&pipe).status();
        if made.is_ok_and(|status| status.success()) {
            assert_eq!(read(&pipe, 4).unwrap_err(), FileError::NotRegular);
        }
    }

    #[test]
    fn a_file_names_others_in_its_own_folder_alone() {
        let top = tempfile::tempdir().unwrap();
        let folder = top.path().join("clips");
        fs::create_dir_all(folder.join("sub")).unwrap();
        write(&top.path().join("secret"), "secret").unwrap();
        write(&folder.join("sub/a.bin"), "a").unwrap();
        assert_eq!(read_in(&folder, Path::new("./sub/a.bin"), 9).unwrap(), b"a");
        let absolute = folder.join("sub/a.bin");
        for outside in [
            Path::new("../secret"),
            Path::new("sub/../../secret"),
            &absolute,
            Path::new("file:a"),
            Path::new("..\\secret"),
        ] {
            assert_eq!(read_in(&folder, outside, 9).unwrap_err(), FileError::Outside, "{outside:?}");
        }
        #[cfg(unix)]
        {
            std::os::unix::fs::symlink(top.path().join("secret"), folder.join("link")).unwrap();
            assert_eq!(read_in(&folder, Path::new("link"), 9).unwrap_err(), FileError::Outside);
            std::os::unix::fs::symlink(folder.join("sub"), folder.join("inside")).unwrap();
            assert_eq!(read_in(&folder, Path::new("inside/a.bin"), 9).unwrap(), b"a");
        }
    }

    #[test]
    fn a_file_that_is_not_finished_replaces_nothing() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("k.gestus");
        write(&path, "good").unwrap();
        let mut file = NewFile::create(&path).unwrap();
        file.write_all(b"half").unwrap();
        assert_eq!(fs::read(&path).unwrap(), b"good");
        drop(file);
        assert_eq!(fs::read(&path).unwrap(), b"good");
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1);
        write(&path, "better").unwrap();
        assert_eq!(fs::read(&path).unwrap(), b"better");
    }

    #[cfg(unix)]
    #[test]
    fn links_and_permissions_stay() {
        use std::os::unix::fs::{PermissionsExt, symlink};
        let folder = tempfile::tempdir().unwrap();
        let [file, link, hard] = ["file", "link", "hard"].map(|n| folder.path().join(n));
        write(&file, "1").unwrap();
        assert_eq!(fs::metadata(&file).unwrap().permissions().mode() & 0o600, 0o600);
        fs::set_permissions(&file, fs::Permissions::from_mode(0o640)).unwrap();
        symlink(&file, &link).unwrap();
        fs::hard_link(&file, &hard).unwrap();
        write(&link, "2").unwrap();
        assert!(fs::symlink_metadata(&link).unwrap().is_symlink());
        assert_eq!(fs::read(&file).unwrap(), b"2");
        assert_eq!(fs::metadata(&file).unwrap().permissions().mode() & 0o777, 0o640);
        // Another name of the old file keeps the old content.
        assert_eq!(fs::read(&hard).unwrap(), b"1");
        fs::set_permissions(&file, fs::Permissions::from_mode(0o400)).unwrap();
        assert_eq!(write(&file, "3").unwrap_err().kind(), io::ErrorKind::PermissionDenied);
        write(Path::new("/dev/null"), "4").unwrap();
    }
}
