//! Arrays for checking by others: `.npy` files and `.npz` archives, as numpy reads them.

use std::{
    fs::File,
    io::{self, BufWriter},
    path::Path,
};

use npyz::{AutoSerialize, WriterBuilder};

/// Writes one array to a `.npy` file. `shape` has to multiply to the number of values.
///
/// # Errors
/// What the file system says.
pub fn write_npy<T: AutoSerialize + Clone>(path: &Path, shape: &[usize], values: &[T]) -> io::Result<()> {
    let file = BufWriter::new(File::create(path)?);
    let shape: Vec<u64> = shape.iter().map(|&n| n as u64).collect();
    let mut writer = npyz::WriteOptions::new().default_dtype().shape(&shape).writer(file).begin_nd()?;
    writer.extend(values.iter().cloned())?;
    writer.finish()
}

/// An archive of arrays.
pub struct Archive(npyz::npz::NpzWriter<BufWriter<File>>);

impl Archive {
    /// A new archive.
    ///
    /// # Errors
    /// What the file system says.
    pub fn create(path: &Path) -> io::Result<Self> {
        Ok(Self(npyz::npz::NpzWriter::new(BufWriter::new(File::create(path)?))))
    }

    /// Adds an array. `shape` has to multiply to the number of values.
    ///
    /// # Errors
    /// What the file system says.
    pub fn add<T: AutoSerialize + Clone>(
        &mut self,
        name: &str,
        shape: &[usize],
        values: &[T],
    ) -> io::Result<()> {
        let shape: Vec<u64> = shape.iter().map(|&n| n as u64).collect();
        let mut writer = self.0.array(name, Default::default())?.default_dtype().shape(&shape).begin_nd()?;
        writer.extend(values.iter().cloned())?;
        writer.finish()
    }
}
