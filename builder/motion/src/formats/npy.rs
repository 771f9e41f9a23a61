//! Arrays for use with numpy: `.npy` files and `.npz` archives.

use std::{
    io::{self, BufWriter},
    path::Path,
};

use npyz::{AutoSerialize, WriterBuilder};
use zip::{CompressionMethod, ZipWriter, write::SimpleFileOptions};

use crate::files::NewFile;

/// Writes one array to a `.npy` file. `shape` has to multiply to the number of values.
///
/// # Errors
/// Errors of the file system.
pub fn write_npy<T: AutoSerialize + Clone>(path: &Path, shape: &[usize], values: &[T]) -> io::Result<()> {
    let mut file = NewFile::create(path)?;
    write(BufWriter::new(&mut file), shape, values)?;
    file.commit()
}

fn write<T: AutoSerialize + Clone>(file: impl io::Write, shape: &[usize], values: &[T]) -> io::Result<()> {
    let shape: Vec<u64> = shape.iter().map(|&n| n as u64).collect();
    let mut writer = npyz::WriteOptions::new().default_dtype().shape(&shape).writer(file).begin_nd()?;
    writer.extend(values.iter().cloned())?;
    writer.finish()
}

/// Arrays from this size on need the larger headers of ZIP64, bytes.
const ZIP64_FROM: usize = 1 << 30;

/// An archive of arrays, stored as `numpy.savez` stores them. [`finish`](Self::finish) completes it.
pub struct Archive(ZipWriter<BufWriter<NewFile>>);

impl Archive {
    /// A new archive.
    ///
    /// # Errors
    /// Errors of the file system.
    pub fn create(path: &Path) -> io::Result<Self> {
        Ok(Self(ZipWriter::new(BufWriter::new(NewFile::create(path)?))))
    }

    /// Adds an array. `shape` has to multiply to the number of values.
    ///
    /// # Errors
    /// Errors of the file system.
    pub fn add<T: AutoSerialize + Clone>(
        &mut self,
        name: &str,
        shape: &[usize],
        values: &[T],
    ) -> io::Result<()> {
        let options = SimpleFileOptions::default()
            .compression_method(CompressionMethod::Stored)
            .large_file(size_of_val(values) > ZIP64_FROM);
        self.0.start_file(format!("{name}.npy"), options)?;
        write(&mut self.0, shape, values)
    }

    /// Writes the table of contents, without which the archive can't be read, and puts the file in its place.
    ///
    /// # Errors
    /// Errors of the file system.
    pub fn finish(self) -> io::Result<()> {
        self.0.finish()?.into_inner().map_err(io::IntoInnerError::into_error)?.commit()
    }
}
