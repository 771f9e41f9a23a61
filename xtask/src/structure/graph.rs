//! The files of a crate as a graph: which file uses what another one defines.

use std::collections::{BTreeMap, BTreeSet};

use super::{
    module_file,
    source::{Import, Module, Source},
};

/// Re-exports are followed this far; a longer chain would be a circle of re-exports.
const MAX_HOPS: usize = 16;

/// A module's place in the crate: the names from the root.
type Path = Vec<String>;

/// The modules of a crate.
pub struct Crate<'a> {
    /// By place: the file, and what stands in it.
    modules: BTreeMap<Path, (String, &'a Module)>,
}

/// What a path names.
enum Named {
    /// A module, and nothing in it.
    Module,
    /// An item that is defined in this file.
    Item(String),
}

impl<'a> Crate<'a> {
    /// The crate with that root file; it is empty where there is none.
    pub fn new(sources: &'a BTreeMap<String, Source>, root: &str) -> Self {
        let mut modules = BTreeMap::new();
        if let (Some(source), Some((folder, _))) = (sources.get(root), root.rsplit_once('/')) {
            add(sources, &mut modules, Vec::new(), root, folder, &source.module);
        }
        Self { modules }
    }

    /// Every circle of files, as lines of what in it uses what.
    pub fn circles(&self) -> Vec<Vec<String>> {
        let edges = self.edges();
        let reached: BTreeMap<&str, BTreeSet<&str>> =
            edges.keys().map(|(from, _)| (from.as_str(), reachable(&edges, from))).collect();
        let meet = |a: &str, b: &str| {
            let reaches = |a: &str, b: &str| reached.get(a).is_some_and(|r| r.contains(b));
            reaches(a, b) && reaches(b, a)
        };
        let mut circles: BTreeMap<&str, Vec<String>> = BTreeMap::new();
        for ((from, to), name) in edges.iter().filter(|((from, to), _)| meet(from, to)) {
            // A circle goes by its first file.
            let first = reached.keys().find(|file| meet(file, from)).unwrap_or(&"");
            circles.entry(first).or_default().push(format!("{from} uses `{name}` of {to}"));
        }
        circles.into_values().collect()
    }

    /// From which file to which, with one of the names that are used.
    fn edges(&self) -> BTreeMap<(String, String), String> {
        let mut edges = BTreeMap::new();
        for (place, (file, module)) in &self.modules {
            let imported = module.imports.iter().filter(|i| !i.is_public && i.name != "*").map(|i| &i.path);
            for path in imported.chain(&module.paths) {
                if let Some(Named::Item(to)) = self.resolve(place, path, 0)
                    && to != *file
                {
                    edges.entry((file.clone(), to)).or_insert_with(|| path.join("::"));
                }
            }
        }
        edges
    }

    /// What a path names that is written in the module at `place`. None for names of other crates and of variables.
    fn resolve(&self, place: &[String], path: &[String], hops: usize) -> Option<Named> {
        let (first, rest) = path.split_first()?;
        if hops > MAX_HOPS {
            return None;
        }
        match first.as_str() {
            "crate" => self.within(&[], rest, hops),
            "self" => self.within(place, rest, hops),
            "super" => self.within(place.split_last()?.1, rest, hops),
            _ => self.within(place, path, hops),
        }
    }

    /// What a path names that begins in the module at `place`.
    fn within(&self, place: &[String], path: &[String], hops: usize) -> Option<Named> {
        let (file, module) = self.modules.get(place)?;
        let Some((first, rest)) = path.split_first() else { return Some(Named::Module) };
        if first == "super" {
            return self.within(place.split_last()?.1, rest, hops);
        }
        let child = [place, std::slice::from_ref(first)].concat();
        if self.modules.contains_key(&child) {
            return self.within(&child, rest, hops);
        }
        if module.defines.contains(first) {
            return Some(Named::Item(file.clone()));
        }
        let follow = |import: &Import, rest: &[String]| {
            // `use x::x` would name itself.
            let path = [&import.path[..], rest].concat();
            self.resolve(place, &path, hops + 1)
        };
        let mut by_name = module.imports.iter().filter(|i| i.name == *first && i.path.first() != Some(first));
        by_name.find_map(|import| follow(import, rest)).or_else(|| {
            let mut globs = module.imports.iter().filter(|i| i.name == "*" && i.path.first() != Some(first));
            globs.find_map(|import| follow(import, path))
        })
    }
}

/// Adds a module and those in it. `folder` holds the files of its children.
fn add<'a>(
    sources: &'a BTreeMap<String, Source>,
    modules: &mut BTreeMap<Path, (String, &'a Module)>,
    place: Path,
    file: &str,
    folder: &str,
    module: &'a Module,
) {
    for name in &module.children {
        let is_there = |path: &str| sources.contains_key(path);
        let Some(inner) = module_file(folder, name, is_there) else { continue };
        let at = [&place[..], std::slice::from_ref(name)].concat();
        add(sources, modules, at, &inner, &format!("{folder}/{name}"), &sources[&inner].module);
    }
    for (name, inner) in &module.inline {
        let at = [&place[..], std::slice::from_ref(name)].concat();
        add(sources, modules, at, file, &format!("{folder}/{name}"), inner);
    }
    modules.insert(place, (file.to_owned(), module));
}

/// The files that can be reached from one by one step or more.
fn reachable<'a>(edges: &'a BTreeMap<(String, String), String>, from: &str) -> BTreeSet<&'a str> {
    let (mut reached, mut next) = (BTreeSet::new(), vec![from]);
    while let Some(at) = next.pop() {
        for (_, to) in edges.keys().filter(|(from, _)| from == at) {
            if reached.insert(to.as_str()) {
                next.push(to);
            }
        }
    }
    reached
}

#[cfg(test)]
mod tests {
    use super::*;

    fn circles(files: &[(&str, &str)]) -> Vec<Vec<String>> {
        let sources: BTreeMap<String, Source> =
            files.iter().map(|(path, text)| (format!("src/{path}"), Source::parse(text).unwrap())).collect();
        Crate::new(&sources, "src/lib.rs").circles()
    }

    #[test]
    fn a_circle_of_files_is_found() {
        let found = circles(&[
            ("lib.rs", "mod a; mod b; mod c;"),
            ("a.rs", "use crate::b::B; pub struct A(B);"),
            ("b.rs", "pub struct B; fn f() { super::c::run::<u8>(1) }"),
            ("c.rs", "use crate::a; pub fn run() { say!(a::A) }"),
        ]);
        let expected = [
            "src/a.rs uses `crate::b::B` of src/b.rs",
            "src/b.rs uses `super::c::run` of src/c.rs",
            "src/c.rs uses `a::A` of src/a.rs",
        ];
        assert_eq!(found, [expected]);
    }

    #[test]
    fn a_parent_that_only_re_exports_is_in_no_circle() {
        let parent = ("lib.rs", "mod a; mod b; pub use a::A; pub use b::*;");
        let children = [("a.rs", "use crate::B; pub struct A(B);"), ("b.rs", "pub struct B;")];
        assert!(circles(&[parent, children[0], children[1]]).is_empty());
        // The parent uses the child's name, and the child the parent's.
        let parent = ("lib.rs", "mod a; pub use a::A; pub struct P; fn f(a: A) {}");
        assert_eq!(circles(&[parent, ("a.rs", "use super::P; pub struct A(P);")]).len(), 1);
        // One of the two alone is no circle.
        assert!(circles(&[parent, ("a.rs", "pub struct A;")]).is_empty());
    }

    #[test]
    fn tests_are_not_drawn() {
        let a = ("a.rs", "pub struct A; #[cfg(test)] mod tests { use crate::b::B; fn f(b: B) {} }");
        assert!(
            circles(&[("lib.rs", "mod a; mod b;"), a, ("b.rs", "use crate::a::A; pub struct B(A);")])
                .is_empty()
        );
    }
}
