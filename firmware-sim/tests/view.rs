//! The command `gestus-sim view`, as somebody calls it. The core in the page is `cargo xtask wasm`'s to try: any file stands
//! for its module here.

mod common;

use std::path::Path;

use common::{json, sim};
use gestus_core::Database;
use gestus_database::blob::cut::models_only;
use gestus_tests::motion;

/// It was streamed by the mixture, which such a database does not hold, and the message told to choose a method, which the
/// command has no option for.
#[test]
fn a_database_that_was_cut_to_its_models_can_be_viewed() {
    let [db, clip] = common::files("view", 40);
    let beside = |name: &str| Path::new(db).with_file_name(name).to_str().expect("a plain path").to_owned();
    let [cut, page] = ["cut.gestus", "page.html"].map(beside);
    let database = Database::open(motion::small()).expect("the generated blob opens");
    std::fs::write(&cut, models_only(&database).expect("it has models")).expect("it can be written");
    let view = ["view", "--db", &cut, "--wasm", clip, "-o", &page];
    let shown = json(&[&view[..], &["--input", clip, "--json"]].concat());
    assert_eq!(shown["frames"], 40);
    assert!(std::fs::read_to_string(&page).expect("it was written").contains("Gestus live: cut"));
    // It has no motion of its own, and says what to give.
    let (ok, stdout, stderr) = sim(&view);
    assert!(!ok && stdout.is_empty() && stderr.contains("--input"), "{stderr}");
}
