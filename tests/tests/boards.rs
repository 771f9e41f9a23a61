//! Emulated boards, as a user runs them. `cargo xtask firmware`, which installs QEMU and the compiler's targets, sets
//! `GESTUS_BOARDS`; without it the test of the smallest board is left to that chore.

use gestus_core::Database;
use gestus_database::stream::Request;
use gestus_firmware_sim::board::{
    boards::{BOARDS, find},
    generated::SMALL,
    image,
    measure::{Job, measure},
};

/// Whether to emulate boards. Building their images takes minutes.
fn enabled() -> bool {
    let enabled = std::env::var_os("GESTUS_BOARDS").is_some();
    if !enabled {
        eprintln!("left to `cargo xtask firmware`, which sets GESTUS_BOARDS");
    }
    enabled
}

/// The smallest board computes the same bits as the host, within its memory.
#[test]
fn the_micro_bit_does_what_this_machine_does() {
    if !enabled() {
        return;
    }
    let board = find("m0").unwrap();
    let path = SMALL.database().unwrap();
    let bytes = std::fs::read(&path).unwrap();
    let database = Database::open(&bytes).unwrap();
    let options = image::Options { blob: Some(&path), ..image::Options::default() };
    let image = image::build(board, options).unwrap();
    let (mut clip, request) = (SMALL.clip(4.0).unwrap(), Request::style(1));
    clip.frames.truncate(90);
    let measured = measure(
        board,
        &image,
        Job { path: &path, database, clip: &clip, request: &request, robot: None },
        || (),
    )
    .unwrap();
    assert!(measured.bit_exact());
    let figures = measured.json();
    let bytes = |key: &str| figures[key].as_u64().unwrap();
    assert!(bytes("static_bytes") + bytes("stack_bytes") <= 16 * 1024, "{figures}");
    assert!(bytes("flash_bytes") <= 256 * 1024, "{figures}");
    assert!(bytes("instructions_median") > 0);
}

/// The README of the firmware lists every board.
#[test]
fn the_readme_lists_every_board() {
    let readme = std::fs::read_to_string(image::crate_folder().join("README.md")).unwrap();
    for board in &BOARDS {
        let row = readme.lines().find(|l| l.starts_with(&format!("| `{}`", board.name)));
        assert!(row.is_some_and(|r| r.contains(board.machine) && r.contains(board.target)), "{}", board.name);
    }
}
