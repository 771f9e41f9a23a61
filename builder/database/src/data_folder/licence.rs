//! The terms of a folder's clips.

use std::path::Path;

use super::config::{Config, FILE_NAME};

/// A note about a licence file in the folder, if the manifest will have no licence.
pub(super) fn licence_beside(folder: &Path, config: &Config) -> Option<String> {
    if !config.licence.is_empty() {
        return None;
    }
    let is_licence = |name: &str| {
        let name = name.to_ascii_lowercase();
        ["license", "licence", "copying", "eula", "terms"].iter().any(|word| name.starts_with(word))
    };
    let files =
        std::fs::read_dir(folder).ok()?.filter_map(|entry| entry.ok()?.file_name().into_string().ok());
    let file = files.filter(|name| is_licence(name)).min()?;
    Some(format!(
        "{}: the database's manifest does not have these terms: say them by `licence = \"...\"` in {FILE_NAME}",
        folder.join(file).display()
    ))
}
