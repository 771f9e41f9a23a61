//! `gestus-sim view`: a page in which the core itself runs.
//!
//! The page contains the core as a wasm module (`firmware-sim/web`), the database, and a stream of input poses: one
//! file that opens without a network. Its sliders change the core's settings while it streams. The browser computes all
//! that it shows. To prove it, the page streams the input a second time with the settings of the command, and compares
//! the digest with the one that this command computed with the core on the host.

use std::path::PathBuf;

use anyhow::{Context, Result, bail};
// With padding, as JavaScript's `atob` reads it (RFC 4648).
use base64::{Engine, prelude::BASE64_STANDARD as BASE64};
use gestus_core::blob::Manifest;
use gestus_database::{
    command_line::{
        blob,
        options::{GroundArgs, ReportArgs, UnitArgs},
        outputs::{check_outputs, tell},
        resolve::{find, named},
        wasm::WasmCrate,
    },
    stream::input::Input,
};
use gestus_evaluate::pages::{DRAW, STYLE, document};

use crate::recording::{Recording, Settings};

/// Seconds of each action where no input is given.
const SECONDS: f64 = 8.0;
/// The core as a wasm module.
const MODULE: WasmCrate = WasmCrate {
    folder: concat!(env!("CARGO_MANIFEST_DIR"), "/web"),
    file: "gestus_web.wasm",
    export: "gestus_stylizer_init",
};

/// Write an HTML page that runs the core in a browser, to try out a database.
#[derive(clap::Args, Debug)]
#[command(
    mut_arg("unit", |unit| unit.requires("input")),
    mut_arg("floor", |floor| floor.requires("input")),
    mut_arg("up", |up| up.requires("input")),
    mut_arg("root", |root| root.requires("input"))
)]
pub struct ViewArgs {
    /// The database
    #[arg(long)]
    db: PathBuf,
    /// The clip, BVH or glTF (`hero.glb#walk` names one of several animations). It is retargeted if its skeleton is not
    /// the database's. Default: generated motion
    #[arg(long)]
    input: Option<PathBuf>,
    #[command(flatten)]
    unit: UnitArgs,
    #[command(flatten)]
    ground: GroundArgs,
    /// Initial output style: a name, or two with weights, a=1,b=2. Default: the database's second style
    #[arg(long)]
    style: Option<String>,
    /// The input's action, if it is known
    #[arg(long)]
    action: Option<String>,
    /// The input's style, if it is known
    #[arg(long)]
    input_style: Option<String>,
    /// The core as a wasm module. Default: it is built, or an earlier build is used
    #[arg(long)]
    wasm: Option<PathBuf>,
    /// HTML file to write the page to
    #[arg(short, long)]
    output: PathBuf,
    #[command(flatten)]
    report: ReportArgs,
}

/// Runs the command.
///
/// # Errors
/// Files that can't be read or written, names that the database does not have, and a missing wasm module.
pub fn run(args: &ViewArgs) -> Result<()> {
    check_outputs([Some(&args.db), args.input.as_ref(), args.wasm.as_ref()], [("-o", Some(&args.output))])?;
    let blob = blob::read(&args.db)?;
    let database = blob::open(&args.db, &blob)?;
    let settings = settings(args, &database.manifest()?).with_context(|| args.db.display().to_string())?;
    let (recording, what) = match &args.input {
        Some(path) => {
            let input = Input::read_with(path, &database, &args.ground.reading(None, args.unit.unit)?)?;
            tell(path, input.notes());
            (Recording::of_clip(&input.mapped, settings), format!("{}, one pose at a time", path.display()))
        }
        None => Recording::sample(&database, settings, SECONDS)?,
    };
    let digest = recording.digest(&database).with_context(|| args.db.display().to_string())?;
    let module = MODULE.bytes(args.wasm.as_deref())?;
    let name = args.db.file_stem().map_or_else(String::new, |n| n.to_string_lossy().into_owned());
    let html = page(&format!("Gestus live: {name}"), &what, &module, &blob, &recording.to_bytes(digest));
    blob::write(&args.output, &html)?;
    let (output, frames) = (args.output.display().to_string(), recording.frames.len());
    args.report.print(
        || {
            serde_json::json!({
                "output": output, "frames": frames, "digest": format!("{digest:08x}"),
                "bytes": html.len(), "wasm_bytes": module.len(),
            })
        },
        || {
            let mb = html.len() as f64 / 1e6;
            format!("{output}: {frames} frames of input ({what}), digest {digest:08x}, {mb:.1} MB; open it in a browser")
        },
    )
}

/// The initial settings of the stream.
fn settings(args: &ViewArgs, manifest: &Manifest<'_>) -> Result<Settings> {
    let label = |name: &Option<String>, names, what| name.as_ref().map(|n| find(n, names, what)).transpose();
    let styles = match &args.style {
        // The first style is most often that of the input.
        None => Settings::style(u16::from(manifest.styles.count() > 1)).styles,
        Some(words) => match named(words, manifest.styles)?[..] {
            [one] => [one, (one.0, 0.0)],
            [one, two] => [one, two],
            _ => bail!("--style: give one style or two; the page lets you choose any later"),
        },
    };
    Ok(Settings {
        action: label(&args.action, manifest.actions, "action")?,
        input_style: label(&args.input_style, manifest.styles, "style")?,
        styles,
    })
}

/// The page as HTML.
fn page(title: &str, about: &str, module: &[u8], blob: &[u8], recording: &[u8]) -> String {
    let data = serde_json::json!({
        "about": format!("The core runs in this page. Input: {about}."),
        "wasm": BASE64.encode(module), "blob": BASE64.encode(blob), "recording": BASE64.encode(recording),
    });
    let style = [STYLE, include_str!("../web/view.css")].concat();
    let script = [DRAW, include_str!("../web/gestus.js"), include_str!("../web/view.js")].concat();
    document(include_str!("../web/view.html"), title, &style, &data.to_string(), &script)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_page_is_one_file_and_names_stay_text() {
        let html = page("</title><script>", "</script>", b"module", b"blob", b"recording");
        for word in ["http:", "https:", "src=", "@import", "url(", "fetch(", "<link"] {
            assert!(!html.contains(word), "{word}");
        }
        assert_eq!(html.matches("</script>").count(), 2, "the data and the program");
        assert!(html.contains("&lt;&#x2f;title&gt;&lt;script&gt;"));
        assert!(!html.contains("{{"));
    }
}
