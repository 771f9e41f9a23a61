//! Emulated boards, as a user runs them. Without QEMU or the compiler's targets there is nothing to run: the test says
//! so and passes. `cargo xtask firmware --setup` installs both.

use gestus_core::Database;
use gestus_firmware_sim::board::{
    boards::{BOARDS, find},
    generated::SMALL,
    image,
    measure::{Job, measure},
};

/// Whether boards are to be emulated; they take minutes to build.
fn wanted() -> bool {
    let wanted = std::env::var_os("GESTUS_BOARDS").is_some();
    if !wanted {
        eprintln!("skipped: set GESTUS_BOARDS=1 to emulate boards, or run `cargo xtask firmware`");
    }
    wanted
}

/// The smallest board runs the small database bit by bit as this machine does, in the memory that it has.
#[test]
fn the_micro_bit_does_what_this_machine_does() {
    if !wanted() {
        return;
    }
    let board = find("m0").unwrap();
    let path = SMALL.database().unwrap();
    let bytes = std::fs::read(&path).unwrap();
    let database = Database::open(&bytes).unwrap();
    let options = image::Options { blob: Some(&path), ..image::Options::default() };
    let image = image::build(board, options).unwrap();
    let (mut clip, request) = (SMALL.clip(4.0).unwrap(), SMALL.request());
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

/// Every board is in the README of the firmware.
#[test]
fn the_readme_lists_every_board() {
    let readme = std::fs::read_to_string(image::crate_folder().join("README.md")).unwrap();
    for board in &BOARDS {
        let row = readme.lines().find(|l| l.starts_with(&format!("| `{}`", board.name)));
        assert!(row.is_some_and(|r| r.contains(board.machine) && r.contains(board.target)), "{}", board.name);
    }
}
