//! `gestus page`.

use std::path::{Path, PathBuf};

use anyhow::Result;
// With padding, as JavaScript's `atob` reads it (RFC 4648).
use base64::{Engine, prelude::BASE64_STANDARD as BASE64};
use gestus_database::{
    build::{BuildOptions, build},
    command_line::{options::ReportArgs, wasm::WasmCrate},
    effort::dial::doubts,
    synth::{self, Options},
};
use gestus_motion::{capture::Format, formats::gltf::toy};
use serde_json::json;

use super::open;

/// The module: reading, retargeting, streaming and writing of clips.
const MODULE: WasmCrate = WasmCrate {
    folder: concat!(env!("CARGO_MANIFEST_DIR"), "/page"),
    file: "gestus_page.wasm",
    export: "text_length",
};

/// The page's sources.
const FILES: [(&str, &str); 7] = [
    ("index.html", include_str!("../../page/web/index.html")),
    ("page.css", include_str!("../../page/web/page.css")),
    ("module.js", include_str!("../../page/web/module.js")),
    ("polygon.js", include_str!("../../page/web/polygon.js")),
    ("model.js", include_str!("../../page/web/model.js")),
    ("stage.js", include_str!("../../page/web/stage.js")),
    ("page.js", include_str!("../../page/web/page.js")),
];

/// Starts the file with the module, the database and the sample.
const DATA: &str = "const GESTUS = ";

/// Stands for the endings of the clips that are read.
const ENDINGS: &str = "ENDINGS";
/// Seconds of generated motion: of each clip of the database, and of the sample.
const SECONDS: f64 = 8.0;

/// Write a folder with a page that gives clips another style in the browser: drop a BVH or GLB file on it.
#[derive(clap::Args)]
pub struct Args {
    /// Folder for the page. It opens without a server, and can be hosted as it is
    #[arg(short, long)]
    output: PathBuf,
    /// The database. Default: one is built from generated motion
    #[arg(long)]
    db: Option<PathBuf>,
    /// The wasm module. Default: it is built, or an earlier build is used
    #[arg(long)]
    wasm: Option<PathBuf>,
    #[command(flatten)]
    report: ReportArgs,
}

/// Runs the command.
pub fn run(args: &Args) -> Result<()> {
    let given = args.db.as_deref().map(open::read_blob).transpose()?;
    if let (Some(bytes), Some(path)) = (&given, &args.db) {
        doubts(&open::open(path, bytes)?).iter().for_each(super::note);
    }
    if args.output.is_dir() {
        check(args)?;
    }
    // Before the database, which takes longer to build.
    let module = MODULE.bytes(args.wasm.as_deref())?;
    open::make_folder(&args.output)?;
    let blob = match given {
        Some(bytes) => bytes,
        None => generated()?,
    };
    let sample = sample()?;
    for (name, text) in FILES {
        open::write(&args.output.join(name), text.replace(ENDINGS, &Format::endings_that_are_read()))?;
    }
    open::write(&args.output.join("sample.glb"), &sample)?;
    let data = json!({
        "wasm": BASE64.encode(&module), "database": BASE64.encode(&blob), "sample": BASE64.encode(&sample),
    });
    open::write(&args.output.join("data.js"), format!("{DATA}{data};\n"))?;
    let page = args.output.join("index.html");
    args.report.print(
        || json!({ "page": super::shown(&page), "database_bytes": blob.len(), "wasm_bytes": module.len() }),
        || summary(&page, blob.len(), module.len()),
    )
}

/// Refuses a folder in which an input or a file of the user's own would be replaced.
fn check(args: &Args) -> Result<()> {
    let files: Vec<PathBuf> =
        FILES.iter().map(|(name, _)| *name).chain(["data.js"]).map(|name| args.output.join(name)).collect();
    super::check_outputs(
        [args.db.as_ref(), args.wasm.as_ref()],
        files.iter().map(|file| ("-o", Some(file))),
    )?;
    let sample = args.output.join("sample.glb");
    open::check_generated((&args.output.join("data.js"), DATA), files.into_iter().chain([sample]))
}

fn summary(page: &Path, blob: usize, module: usize) -> String {
    let mb = |bytes: usize| bytes as f64 / 1e6;
    format!(
        "{}: open it in a browser, and drop a BVH or GLB file on it ({:.1} MB of database, {:.1} MB of module)",
        page.display(),
        mb(blob),
        mb(module)
    )
}

/// A database of generated motion.
fn generated() -> Result<Vec<u8>> {
    super::note("building a database from generated motion; --db takes your own");
    let corpus = synth::corpus(&Options { clips: 2, seconds: SECONDS, ..Options::default() })?;
    Ok(build(&corpus, &BuildOptions::default())?.bytes)
}

/// A character that walks as no clip of a database of generated motion does.
fn sample() -> Result<Vec<u8>> {
    let corpus = synth::corpus(&Options { seed: 77, ..Options::of(&["walk"], &["neutral"], 1, SECONDS) })?;
    Ok(toy(&[("walk", &corpus.examples[0].clip)]))
}
