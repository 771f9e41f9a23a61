//! hnswlib, through its Python package, in the same rounds as the others. `hnswlib_peer.py` times it.

use std::{
    io::{BufRead, BufReader, Write},
    path::Path,
    process::{Child, ChildStdin, ChildStdout, Command, Stdio},
};

use anyhow::{Context, Result, bail};

use crate::measure::Row;

/// The running script.
#[derive(Debug)]
pub struct Hnswlib {
    child: Child,
    rounds: ChildStdin,
    answers: BufReader<ChildStdout>,
}

impl Hnswlib {
    /// Starts the script on what [`export`](crate::setup::export) wrote to `folder`; it searches for that recall.
    ///
    /// # Errors
    /// Where Python does not start, or has no hnswlib.
    pub fn start(python: &Path, folder: &Path, recall: f64) -> Result<Self> {
        let script = concat!(env!("CARGO_MANIFEST_DIR"), "/hnswlib_peer.py");
        let mut child = Command::new(python)
            .arg(script)
            .arg(folder)
            .args(["--recall", &recall.to_string()])
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .spawn()
            .with_context(|| python.display().to_string())?;
        let pipes = child.stdin.take().zip(child.stdout.take());
        let (rounds, answers) = pipes.context("hnswlib_peer.py has no pipes")?;
        let mut this = Self { child, rounds, answers: BufReader::new(answers) };
        this.answer().context("pip install hnswlib numpy")?;
        Ok(this)
    }

    /// Answers every query once.
    ///
    /// # Errors
    /// Where the script has ended.
    pub fn round(&mut self) -> Result<()> {
        writeln!(self.rounds)?;
        self.answer().map(drop)
    }

    /// Ends the script, and has its line of the table.
    ///
    /// # Errors
    /// Where it printed none.
    pub fn finish(mut self) -> Result<Row> {
        drop(self.rounds);
        let mut line = String::new();
        self.answers.read_line(&mut line)?;
        self.child.wait()?;
        serde_json::from_str(&line).with_context(|| format!("hnswlib_peer.py: `{line}`"))
    }

    fn answer(&mut self) -> Result<String> {
        let mut line = String::new();
        if self.answers.read_line(&mut line)? == 0 {
            bail!("hnswlib_peer.py ended too early");
        }
        Ok(line)
    }
}
