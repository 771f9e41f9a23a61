//! docs/FORMAT.md lists the sections: its rows are the code's table.

use gestus_core::blob::layout::section::{self, Kept};

const DOCUMENT: &str = include_str!("../../docs/FORMAT.md");

/// A row of the document's table: number, name, whether it is in a blob, and what a cut leaves of it.
fn row(id: u16) -> Option<String> {
    let name = section::name(id)?;
    let presence = match (section::REQUIRED.contains(&id), section::OPTIONAL.contains(&id)) {
        (true, _) => "always",
        (_, true) => "optional",
        _ => "never",
    };
    let cut = match (presence, section::kept_by_cut(id)) {
        ("never", _) => "",
        (_, Kept::Always) => "kept",
        (_, Kept::WithPhase) => "kept with 38",
        ("always", Kept::Never) => "empty",
        (_, Kept::Never) => "removed",
    };
    Some(format!("{id}|{name}|{presence}|{cut}"))
}

#[test]
fn the_documents_table_of_sections_is_the_codes() {
    let heading = "| number | section | in a blob | after a cut | length in bytes |\n";
    let table = DOCUMENT.split_once(heading).expect("the document has a table of sections").1;
    let documented: Vec<String> = table
        .lines()
        .skip(1)
        .take_while(|line| line.starts_with('|'))
        .map(|line| {
            let cells: Vec<&str> = line.split('|').map(str::trim).collect();
            let name = cells[2].trim_start_matches('[').split(']').next().unwrap_or("");
            [cells[1], name, cells[3], cells[4]].join("|")
        })
        .collect();
    let written: Vec<String> = (0..=u16::MAX).filter_map(row).collect();
    assert_eq!(documented, written);
}

#[test]
fn sections_are_written_by_number() {
    assert!(section::REQUIRED.is_sorted());
    assert!(section::OPTIONAL.is_sorted());
    assert!(section::REQUIRED.iter().max() < section::OPTIONAL.iter().min());
}
