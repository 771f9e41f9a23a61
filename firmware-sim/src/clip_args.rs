//! The arguments and files that `run`, `link` and `board` share: how a clip is streamed, a database, a clip and a file for
//! the output.

use std::path::{Path, PathBuf};

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

/// How a clip is read and streamed.
#[derive(clap::Args, Debug)]
pub struct StreamArgs {
    #[command(flatten)]
    unit: UnitArgs,
    #[command(flatten)]
    ground: GroundArgs,
    /// The settings.
    #[command(flatten)]
    pub stylizer_args: StylizerArgs,
}

impl StreamArgs {
    /// Opens the database `db`, whose content is `bytes`, reads the clip for it and says what was noticed in it, and makes
    /// the settings of the stream.
    ///
    /// # Errors
    /// Bytes that are no database, a clip that can't be read, and settings that don't suit the database.
    pub fn open<'db>(
        &self,
        db: &Path,
        bytes: &'db [u8],
        clip: &Path,
    ) -> Result<(Database<'db>, Input, Request)> {
        let database = blob::open(db, bytes)?;
        let input = Input::read_with(clip, &database, &self.ground.reading(None, self.unit.unit)?)?;
        tell(clip, input.notes());
        let request = self.stylizer_args.request(&database).with_context(|| db.display().to_string())?;
        Ok((database, input, request))
    }
}

/// A clip that is streamed through a database.
#[derive(clap::Args, Debug)]
pub struct ClipArgs {
    /// The database
    // In its struct's group, which clap leaves empty where arguments are flattened into it: `link` looks whether it is there.
    #[arg(long, group = "ClipArgs")]
    db: PathBuf,
    /// The clip, BVH or glTF (`hero.glb#walk` names one of several animations). It is retargeted if its skeleton is not
    /// the database's
    #[arg(long)]
    input: PathBuf,
    #[command(flatten)]
    stream: StreamArgs,
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
        Ok(check_clip("-o", self.output.as_ref(), Some(&self.input))?)
    }

    /// Reads the bytes of the database.
    ///
    /// # Errors
    /// A file that can't be read.
    pub fn read(&self) -> Result<Vec<u8>> {
        blob::read(&self.db)
    }

    /// Opens the database, the clip and the settings: [`StreamArgs::open`].
    ///
    /// # Errors
    /// Those of [`StreamArgs::open`].
    pub fn open<'db>(&self, bytes: &'db [u8]) -> Result<(Database<'db>, Input, Request)> {
        self.stream.open(&self.db, bytes, &self.input)
    }

    /// The database's file, for messages.
    pub fn database_name(&self) -> String {
        self.db.display().to_string()
    }

    /// Writes the output, if `-o` is given.
    ///
    /// # Errors
    /// A file that can't be written.
    pub fn write(&self, input: &Input, streamed: &Streamed) -> Result<()> {
        let Some(path) = &self.output else { return Ok(()) };
        let bytes = input.written(&input.output(streamed), path, None)?;
        blob::write(path, bytes)
    }
}
