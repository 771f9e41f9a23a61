//! The folder that `gestus page` writes. What the page does in a browser is tried by `cargo xtask wasm`.
//! Messages are compared by their words, which are what the user of the command reads.

#[allow(dead_code, reason = "other tests use more of it")]
mod common;

use std::{fs, path::Path, process::Command};

use base64::{Engine, prelude::BASE64_STANDARD as BASE64};
use gestus_motion::{
    binding::to_clip,
    capture::{Format, read},
};

/// What passes for the module: its header, and a function that it exports.
const MODULE: &[u8] = b"\0asm text_length";

#[test]
fn the_folder_is_complete_and_needs_no_network() {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("page");
    fs::create_dir_all(&folder).unwrap();
    let [db, wasm, site] = ["k.gestus", "m.wasm", "site"].map(|name| folder.join(name));
    fs::write(&db, common::blob()).unwrap();
    fs::write(&wasm, MODULE).unwrap();
    let page = |db: &Path, wasm: &Path| {
        let mut gestus = Command::new(env!("CARGO_BIN_EXE_gestus"));
        gestus.args(["page", "--json", "--db"]).arg(db).arg("--wasm").arg(wasm).arg("-o").arg(&site);
        gestus.output().unwrap()
    };
    let output = page(&db, &wasm);
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let figures: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(figures["database_bytes"], common::blob().len());

    // Everything that the page asks for lies beside it.
    let html = fs::read_to_string(site.join("index.html")).unwrap();
    let accepted = format!("accept=\"{}, .gestus\"", Format::endings_that_are_read());
    assert!(html.contains(&accepted), "{accepted}");
    let named = html.split(['"']).filter(|word| word.ends_with(".js") || word.ends_with(".css"));
    let named: Vec<&str> = named.collect();
    assert_eq!(named.len(), 7, "{named:?}");
    assert!(named.iter().all(|name| site.join(name).is_file()), "{named:?}");
    for name in named {
        let text = fs::read_to_string(site.join(name)).unwrap();
        for word in ["https:", "fetch(", "@import", "url("] {
            assert!(!text.contains(word), "{name}: {word}");
        }
    }
    let data = fs::read_to_string(site.join("data.js")).unwrap();
    for bytes in [common::blob(), MODULE, &fs::read(site.join("sample.glb")).unwrap()] {
        assert!(data.contains(&BASE64.encode(bytes)));
    }
    // The sample is a body of an adult's size that walks.
    let (clip, binding) = to_clip(&read(&site.join("sample.glb")).unwrap(), &Default::default()).unwrap();
    assert!(clip.frames.len() > 200 && binding.doubt().is_none());
    assert!((clip.frames[0].root - clip.frames[clip.frames.len() - 1].root).norm() > 2.0);

    // A page of its own may be written again, with another database.
    let output = page(&db, &wasm);
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    for (db, wasm, said) in [(&wasm, &wasm, "m.wasm: "), (&db, &folder.join("none"), "none can't be read")] {
        let output = page(db, wasm);
        let stderr = String::from_utf8_lossy(&output.stderr);
        assert!(!output.status.success() && stderr.contains(said), "{stderr}");
    }
}
