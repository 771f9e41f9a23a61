//! A board in QEMU, and the line to it.

use std::{
    fs::File,
    io::ErrorKind,
    net::TcpListener,
    path::Path,
    process::{Child, Command, Stdio},
    time::{Duration, Instant},
};

use anyhow::{Context, Result, bail};

use super::boards::Board;
use crate::link::line::{Line, Piped};

/// Time limit for QEMU to start.
const START: Duration = Duration::from_secs(60);

/// Time limit for a program that ends on its own.
const RUN: Duration = Duration::from_secs(1800);

/// A running emulator, which is killed when this value is dropped.
#[derive(Debug)]
pub struct Emulator {
    child: Child,
}

impl Emulator {
    /// Starts a board with an image and, unless the image contains it, a database. The firmware's log lines, which it
    /// prints through the debugger, go to `log`.
    ///
    /// # Errors
    /// A missing emulator (the message says how to install it), and one that does not start.
    pub fn start(board: &Board, image: &Path, blob: &Path, log: File) -> Result<(Self, impl Line + use<>)> {
        let listener = TcpListener::bind("127.0.0.1:0").context("no free port on 127.0.0.1")?;
        let port = listener.local_addr()?.port();
        let mut command = counting_machine(board, image, blob)?;
        command.args(["-chardev", &format!("socket,id=link,host=127.0.0.1,port={port},nodelay=on")]);
        command.args(["-serial", "chardev:link"]);
        let stderr = log.try_clone()?;
        command.stdin(Stdio::null()).stdout(log).stderr(stderr);
        let child = command.spawn().map_err(|error| missing(board, error))?;
        let mut emulator = Self { child };
        let stream = emulator.accept(&listener).with_context(|| board.emulator.to_owned())?;
        stream.set_nodelay(true)?;
        let line = Piped::new(stream.try_clone()?, stream);
        Ok((emulator, line))
    }

    fn accept(&mut self, listener: &TcpListener) -> Result<std::net::TcpStream> {
        listener.set_nonblocking(true)?;
        let start = Instant::now();
        loop {
            match listener.accept() {
                Ok((stream, _)) => {
                    stream.set_nonblocking(false)?;
                    return Ok(stream);
                }
                Err(error) if error.kind() == ErrorKind::WouldBlock => {}
                Err(error) => return Err(error.into()),
            }
            if let Some(status) = self.child.try_wait()? {
                bail!("it ended before it started ({status})");
            }
            if start.elapsed() > START {
                bail!("it did not start within {} s", START.as_secs());
            }
            std::thread::sleep(Duration::from_millis(5));
        }
    }

    /// Why the firmware has ended, from the exit code of the image; `None` if it is still running.
    pub fn exit_reason(&mut self) -> Option<String> {
        // The line closes a moment before the program ends.
        std::thread::sleep(Duration::from_millis(200));
        let status = self.child.try_wait().ok()??;
        Some(match status.code() {
            Some(2) => "the board refuses the database: is its firmware older than the file?".into(),
            Some(3) => "the database has more joints or classes than the board's image has room for (firmware-sim/image/README.md): build it with fewer --joints, --actions or --styles".into(),
            Some(4) => {
                "the board has no robot's tables after its database, or tables made for another database"
                    .into()
            }
            Some(101) => "the firmware panicked".into(),
            _ => format!("the emulator ended ({status})"),
        })
    }
}

/// The command that emulates a board, with an image and, unless the image contains it, a database.
fn machine(board: &Board, image: &Path, blob: &Path) -> Result<Command> {
    let mut command = Command::new(board.emulator);
    command.args(["-M", board.machine, "-display", "none", "-monitor", "none"]);
    command.args(board.arguments);
    command.args(["-semihosting-config", "enable=on,target=native"]);
    if let Some(address) = board.blob_address {
        let Some(path) = blob.to_str().filter(|p| !p.contains(',')) else {
            bail!("{}: QEMU can't load a file with that name", blob.display());
        };
        command.args(["-device", &format!("loader,file={path},addr={address:#x},force-raw=on")]);
    }
    command.arg("-kernel").arg(image);
    Ok(command)
}

/// [`machine`] with a timer that counts instructions: each takes the same virtual time, which slows the emulator down.
fn counting_machine(board: &Board, image: &Path, blob: &Path) -> Result<Command> {
    let mut command = machine(board, image, blob)?;
    command.args(["-icount", &format!("shift={}", board.icount_shift)]);
    Ok(command)
}

fn missing(board: &Board, error: std::io::Error) -> anyhow::Error {
    match error.kind() {
        ErrorKind::NotFound => anyhow::anyhow!(
            "{} is not installed, and the {} board needs it: run `cargo xtask firmware --setup` or `apt-get install {}`",
            board.emulator,
            board.name,
            package(board)
        ),
        _ => anyhow::Error::from(error).context(board.emulator),
    }
}

/// Runs a program that ends on its own, and returns what it prints through the debugger.
///
/// # Errors
/// A missing emulator, and a program that fails or does not end in time.
pub fn output(board: &Board, image: &Path, blob: &Path) -> Result<String> {
    printed(board, image, machine(board, image, blob)?)
}

/// The same of a program that counts instructions.
///
/// # Errors
/// As [`output`].
pub fn counted_output(board: &Board, image: &Path, blob: &Path) -> Result<String> {
    printed(board, image, counting_machine(board, image, blob)?)
}

fn printed(board: &Board, image: &Path, mut command: Command) -> Result<String> {
    let path = image.with_extension("out");
    let file = File::create(&path).with_context(|| format!("{} can't be written", path.display()))?;
    command.args(["-serial", "none"]).stdin(Stdio::null()).stderr(file.try_clone()?).stdout(file);
    let child = command.spawn().map_err(|error| missing(board, error))?;
    let mut emulator = Emulator { child };
    let start = Instant::now();
    let status = loop {
        match emulator.child.try_wait()? {
            Some(status) => break status,
            None if start.elapsed() > RUN => {
                bail!("{}: the program did not end within {} s", board.name, RUN.as_secs())
            }
            None => std::thread::sleep(Duration::from_millis(20)),
        }
    };
    let text = std::fs::read_to_string(&path)?;
    if !status.success() {
        bail!("{}: the program failed ({status}): {}", board.name, text.trim_end());
    }
    Ok(text)
}

impl Drop for Emulator {
    fn drop(&mut self) {
        // Both fail if it has already ended.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// Debian's package of a board's emulator.
pub fn package(board: &Board) -> &'static str {
    if board.emulator == "qemu-system-arm" { "qemu-system-arm" } else { "qemu-system-misc" }
}
