//! The command `gestus-sim view`, run as a program. `cargo xtask wasm` tests the core in the page; here a file with
//! the header and an exported name serves as its module.

mod common;

use std::path::Path;

use common::{json, sim};
use gestus_core::Database;
use gestus_database::blob::cut::models_only;
use gestus_tests::motion;

/// The command once streamed with the mixture, which such a database does not support, and the message said to choose a
/// method, for which the command has no option.
#[test]
fn a_database_that_was_cut_to_its_models_can_be_viewed() {
    let [db, clip] = common::files("view", 40);
    let beside = |name: &str| Path::new(db).with_file_name(name).to_str().expect("a plain path").to_owned();
    let [cut, page, module] = ["cut.gestus", "page.html", "m.wasm"].map(beside);
    std::fs::write(&module, b"\0asm gestus_stylizer_init").expect("it can be written");
    let database = Database::open(motion::small()).expect("the generated blob opens");
    std::fs::write(&cut, models_only(&database).expect("it has models")).expect("it can be written");
    let view = ["view", "--db", &cut, "--wasm", &module, "-o", &page];
    let shown = json(&[&view[..], &["--input", clip, "--json"]].concat());
    assert_eq!(shown["frames"], 40);
    assert!(std::fs::read_to_string(&page).expect("it was written").contains("Gestus live: cut"));
    // The database has no motion; the message says what to give.
    let (ok, stdout, stderr) = sim(&view);
    assert!(!ok && stdout.is_empty() && stderr.contains("--input"), "{stderr}");
}
