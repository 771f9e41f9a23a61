//! A generated walk and the database of it, which several tests share.

use std::sync::OnceLock;

use gestus_core::Database;
use gestus_database::{
    build::{BuildOptions, build},
    synth::{self, Options},
};
use gestus_motion::{clip::Clip, corpus::Corpus};

/// Two clips of a walk in two styles.
pub fn corpus() -> &'static Corpus {
    static CORPUS: OnceLock<Corpus> = OnceLock::new();
    CORPUS.get_or_init(|| synth::corpus(&Options::of(&["walk"], &["neutral", "proud"], 2, 6.0)).unwrap())
}

/// The bytes of the database.
pub fn blob() -> &'static [u8] {
    static BLOB: OnceLock<Vec<u8>> = OnceLock::new();
    BLOB.get_or_init(|| build(corpus(), &BuildOptions::default()).unwrap().bytes)
}

/// The database.
pub fn database() -> Database<'static> {
    Database::open(blob()).unwrap()
}

/// The first clip.
pub fn walk() -> &'static Clip {
    &corpus().examples[0].clip
}
