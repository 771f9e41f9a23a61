//! The command `gestus`.
use gestus_builder::{
    build::{BuildOptions, build},
    load::{Selection, load},
};
use std::path::PathBuf;
fn main() {
    let a: Vec<String> = std::env::args().collect();
    let t = std::time::Instant::now();
    let sel = Selection {
        actions: a[2].split(',').filter(|s| !s.is_empty()).map(String::from).collect(),
        styles: a[3].split(',').filter(|s| !s.is_empty()).map(String::from).collect(),
        ..Selection::default()
    };
    let l = load(&PathBuf::from(&a[1]), &sel).unwrap();
    eprintln!("loaded {} clips {:?}", l.corpus.examples.len(), t.elapsed());
    for n in l.notes.iter().take(10) {
        eprintln!("{n}");
    }
    let b = build(&l.corpus, &BuildOptions::default()).unwrap();
    eprintln!("built {:?} bytes {}", t.elapsed(), b.bytes.len());
    let db = gestus_core::Database::open(&b.bytes).unwrap();
    let c = db.counts();
    eprintln!("{:?} {} B/frame", c, b.bytes.len() as f64 / c.frames as f64);
    for (id, s) in db.sections() {
        eprintln!(
            "{:10} {:9} {:.2}",
            gestus_core::blob::layout::section::name(id).unwrap(),
            s.len(),
            s.len() as f64 / c.frames as f64
        );
    }
    std::fs::write(&a[4], &b.bytes).unwrap();
}
