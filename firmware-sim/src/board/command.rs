//! `gestus-sim board`.

use std::path::PathBuf;

use anyhow::{Context, Result, bail};
use gestus_builder::{report::progress, translate::Input, wish::WishArgs};
use gestus_core::Database;
use serde_json::json;

use super::{
    boards::{self, BOARDS, Board},
    image,
    measure::{Job, Measured, measure, median},
};

/// Run the firmware in an emulator, stream a clip through it, and compare every bit with this machine.
#[derive(clap::Args, Debug)]
pub struct BoardArgs {
    /// The board: m4f, m7, m33, rv32imafc, rv32imac, m0, or the name of QEMU's machine
    #[arg(required_unless_present = "all", conflicts_with = "all")]
    name: Option<String>,
    /// Every board that takes a database from outside, one after the other, and a table
    #[arg(long)]
    all: bool,
    /// The database
    #[arg(long)]
    db: PathBuf,
    /// The clip, a BVH file on the database's skeleton
    #[arg(long)]
    input: PathBuf,
    #[command(flatten)]
    wish: WishArgs,
    /// Most frames of the clip
    #[arg(long)]
    frames: Option<usize>,
    /// An image that is built already, an ELF file for the board
    #[arg(long, conflicts_with = "all")]
    image: Option<PathBuf>,
    /// One JSON object on standard output
    #[arg(long)]
    json: bool,
}

/// Runs the command.
///
/// # Errors
/// Files that can't be read, a missing emulator or compiler target, a board that ends or refuses, and bits that differ.
pub fn run(args: &BoardArgs) -> Result<()> {
    let boards: Vec<&'static Board> = match &args.name {
        Some(name) => vec![boards::find(name)?],
        None => BOARDS.iter().filter(|b| b.blob_address.is_some()).collect(),
    };
    let bytes = std::fs::read(&args.db).with_context(|| format!("{} can't be read", args.db.display()))?;
    let database =
        Database::open(&bytes).map_err(|error| anyhow::anyhow!("{}: {error}", args.db.display()))?;
    let mut clip = Input::read(&args.input, &database)?.mapped;
    clip.frames.truncate(args.frames.unwrap_or(usize::MAX));
    let request = args.wish.request(&database)?;
    let job = Job { path: &args.db, database, clip: &clip, request: &request };
    let mut measured = Vec::new();
    for board in boards {
        let image = match &args.image {
            Some(image) => image.clone(),
            None => {
                eprintln!("building the image of {} ({})", board.name, board.title);
                image::build(board, image::Options { blob: Some(&args.db), ..image::Options::default() })?
            }
        };
        let bar = progress::bar(clip.frames.len(), "frames");
        let one = measure(board, &image, job, || bar.inc(1)).with_context(|| board.name)?;
        bar.finish_and_clear();
        measured.push(one);
    }
    if args.json {
        let all: Vec<_> = measured.iter().map(Measured::json).collect();
        match &all[..] {
            [one] if !args.all => println!("{one}"),
            _ => println!("{}", json!({ "boards": all })),
        }
    } else {
        print!("{}", table(&measured));
    }
    let differing: Vec<&str> = measured.iter().filter(|m| !m.bit_exact()).map(|m| m.board.name).collect();
    if !differing.is_empty() {
        bail!("{}: {} not bit-exact with this machine", args.input.display(), differing.join(", "));
    }
    Ok(())
}

/// A line a board.
pub fn table(measured: &[Measured]) -> String {
    let mut text = format!(
        "{:10} {:>9} {:>6}  {:>12} {:>12}  {:>6} {:>6} {:>7}  {:>10}  {}\n",
        "board",
        "bit-exact",
        "frames",
        "instructions",
        "worst",
        "RAM",
        "stack",
        "flash",
        "bytes read",
        "digest"
    );
    for one in measured {
        let instructions = one.linked.instructions();
        let number = |value: Option<u64>| value.map_or_else(|| "-".to_owned(), |v| v.to_string());
        text += &format!(
            "{:10} {:>9} {:>6}  {:>12} {:>12}  {:>6} {:>6} {:>7}  {:>10}  {:08x}\n",
            one.board.name,
            if one.bit_exact() { "yes" } else { "NO" },
            one.linked.streamed.steps.len(),
            number(median(&instructions)),
            number(instructions.last().copied()),
            one.ram_bytes,
            number(one.statistic(gestus_core::link::counter::STACK_BYTES)),
            one.flash_bytes,
            number(median(&one.bytes_read).map(u64::from)),
            one.linked.streamed.digest,
        );
    }
    text
}
