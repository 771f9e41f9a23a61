//! Captured clips, which are not part of the repository.

use std::{
    env,
    path::{Path, PathBuf},
};

use gestus_database::data_folder::{config::Config as Clips, load::load};
use gestus_motion::corpus::Corpus;

/// The folder of real clips: `GESTUS_DATA`, or `shared/data` beside the repository.
pub fn root() -> PathBuf {
    env::var_os("GESTUS_DATA")
        .map_or_else(|| Path::new(env!("CARGO_MANIFEST_DIR")).join("../../shared/data"), PathBuf::from)
}

/// The folder of a data set, for a test that is skipped where it is missing.
///
/// # Panics
/// Where it is missing and `CI=true`.
pub fn data_set(name: &str) -> Option<PathBuf> {
    let folder = root().join(name);
    if folder.is_dir() {
        return Some(folder);
    }
    skip(&format!("no real clips in {} (set GESTUS_DATA to their folder)", folder.display()));
    None
}

/// Says what a test leaves out, and why.
///
/// # Panics
/// With `CI=true`, where nothing may be left out.
pub fn skip(missing: &str) {
    assert!(env::var("CI").as_deref() != Ok("true"), "{missing}");
    println!("skipped: {missing}");
}

/// Clips of `bandai-namco-2` of some actions and styles, for a test that is skipped where they are missing.
///
/// # Panics
/// Where they are missing and `CI=true`, or can't be read.
pub fn corpus(actions: &[&str], styles: &[&str]) -> Option<Corpus> {
    let data = Some(data_set("bandai-namco-2")?);
    let names = |list: &[&str]| list.iter().map(|name| (*name).to_owned()).collect();
    let clips = Clips { data, actions: names(actions), styles: names(styles), ..Clips::default() };
    Some(load(&clips).expect("the real clips load").corpus)
}
