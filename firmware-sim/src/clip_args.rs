//! The arguments and files that `run` and `link` share: a database, a clip and a file for the output.

use std::path::PathBuf;

use anyhow::{Context, Result};
use gestus_core::Database;
use gestus_database::{
    command_line::{
        blob,
        options::{GroundArgs, UnitArgs},
        outputs::{check_clip, check_outputs, tell},
        stylizer_args::StylizerArgs,
    },
    stream::{Request, Streamed, input::Input},
};
use gestus_motion::files;

/// A clip that is streamed through a database.
#[derive(clap::Args, Debug)]
pub struct ClipArgs {
    /// The database
    #[arg(long)]
    db: PathBuf,
    /// The clip, BVH or glTF (`hero.glb#walk` names one of several animations). It is retargeted if its skeleton is not
    /// the database's
    #[arg(long)]
    input: PathBuf,
    #[command(flatten)]
    unit: UnitArgs,
    #[command(flatten)]
    ground: GroundArgs,
    #[command(flatten)]
    stylizer_args: StylizerArgs,
    /// File for the output, at the database's rate: BVH, or glTF where the input is
    #[arg(short, long)]
    output: Option<PathBuf>,
}

impl ClipArgs {
    /// Refuses outputs that would overwrite an input or each other, or that cannot be written. `input` and `output` are a
    /// command's own files, the output with its option.
    ///
    /// # Errors
    /// Such outputs.
    pub fn check(&self, input: Option<&PathBuf>, output: Option<(&str, &PathBuf)>) -> Result<()> {
        let own = output.map(|(option, path)| (option, Some(path)));
        let outputs = std::iter::once(("-o", self.output.as_ref())).chain(own);
        check_outputs([Some(&self.db), Some(&self.input), input], outputs)?;
        check_clip("-o", self.output.as_ref(), Some(&self.input))
    }

    /// Reads the bytes of the database.
    ///
    /// # Errors
    /// A file that can't be read.
    pub fn read(&self) -> Result<Vec<u8>> {
        blob::read(&self.db)
    }

    /// Opens the database, reads the clip for it and says what was noticed in it, and makes the settings of the stream.
    ///
    /// # Errors
    /// Bytes that are no database, a clip that can't be read, and settings that don't suit the database.
    pub fn open<'db>(&self, bytes: &'db [u8]) -> Result<(Database<'db>, Input, Request)> {
        let database = self.of_database(Database::open(bytes))?;
        let input = Input::read_with(&self.input, &database, &self.ground.reading(None, self.unit.unit)?)?;
        tell(&self.input, input.notes());
        let request = self.of_database(self.stylizer_args.request(&database))?;
        Ok((database, input, request))
    }

    /// Adds the name of the database's file to an error.
    ///
    /// # Errors
    /// The error.
    pub fn of_database<T, E>(&self, result: Result<T, E>) -> Result<T>
    where
        Result<T, E>: Context<T, E>,
    {
        result.with_context(|| self.db.display().to_string())
    }

    /// Writes the output, if `-o` is given.
    ///
    /// # Errors
    /// A file that can't be written.
    pub fn write(&self, input: &Input, streamed: &Streamed) -> Result<()> {
        let Some(path) = &self.output else { return Ok(()) };
        let bytes = input.written(&input.output(streamed), path, None)?;
        files::write(path, bytes).with_context(|| format!("{} can't be written", path.display()))
    }
}
