//! What the chore needs to know of one source: its length, its functions, and by module what it imports, defines and
//! names. Items with `#[cfg(test)]` are left out of all of it.

use std::collections::BTreeSet;

use anyhow::Result;
use proc_macro2::{Spacing, TokenStream, TokenTree};
use quote::ToTokens;
use syn::{
    Attribute, Item, UseTree, Visibility,
    spanned::Spanned,
    visit::{self, Visit},
};

/// A function and its length.
#[derive(Debug)]
pub struct Function {
    /// Its name.
    pub name: String,
    /// The line that it starts in.
    pub line: usize,
    /// Lines from its signature to its closing brace.
    pub lines: usize,
}

/// A name that an import brings into a module.
#[derive(Debug)]
pub struct Import {
    /// The name; `*` for all of the path's.
    pub name: String,
    /// The path as it is written.
    pub path: Vec<String>,
    /// True for `pub use`, which passes a name on and need not use it.
    pub is_public: bool,
}

/// A module, which is a file's or stands in braces.
#[derive(Debug, Default)]
pub struct Module {
    /// Names of the items that it defines.
    pub defines: BTreeSet<String>,
    /// Modules in files of their own.
    pub children: Vec<String>,
    /// Modules in braces.
    pub inline: Vec<(String, Module)>,
    /// Its imports.
    pub imports: Vec<Import>,
    /// Paths in its code.
    pub paths: BTreeSet<Vec<String>>,
}

/// A source.
#[derive(Debug)]
pub struct Source {
    /// Lines without tests.
    pub lines: usize,
    /// Why it is longer than it should be.
    pub reason: Option<String>,
    /// Its functions.
    pub functions: Vec<Function>,
    /// Its module.
    pub module: Module,
}

impl Source {
    /// Reads a source.
    ///
    /// # Errors
    /// Where it is not Rust.
    pub fn parse(text: &str) -> Result<Self> {
        let file = syn::parse_file(text)?;
        let tests: usize = file.items.iter().filter(|i| is_test(attributes(i))).map(lines).sum();
        let reason = text.lines().find_map(|line| line.strip_prefix(super::REASON)).map(str::to_owned);
        let mut functions = Functions::default();
        file.items.iter().for_each(|item| functions.visit_item(item));
        let module = Module::of(&file.items);
        Ok(Self { lines: text.lines().count() - tests, reason, functions: functions.0, module })
    }
}

impl Module {
    fn of(items: &[Item]) -> Self {
        let mut module = Self::default();
        for item in items.iter().filter(|i| !is_test(attributes(i))) {
            match item {
                Item::Mod(inner) => match &inner.content {
                    Some((_, items)) => module.inline.push((inner.ident.to_string(), Self::of(items))),
                    None => module.children.push(inner.ident.to_string()),
                },
                Item::Use(item) => {
                    let is_public = !matches!(item.vis, Visibility::Inherited);
                    imports(&item.tree, &mut Vec::new(), is_public, &mut module.imports);
                }
                item => {
                    module.defines.extend(defined(item));
                    paths(item.to_token_stream(), &mut module.paths);
                }
            }
        }
        module
    }
}

/// The attributes of an item that can hold code.
fn attributes(item: &Item) -> &[Attribute] {
    match item {
        Item::Const(i) => &i.attrs,
        Item::Fn(i) => &i.attrs,
        Item::Impl(i) => &i.attrs,
        Item::Macro(i) => &i.attrs,
        Item::Mod(i) => &i.attrs,
        Item::Static(i) => &i.attrs,
        Item::Struct(i) => &i.attrs,
        Item::Use(i) => &i.attrs,
        _ => &[],
    }
}

/// True for `#[cfg(test)]`, alone or with other conditions.
fn is_test(attributes: &[Attribute]) -> bool {
    attributes.iter().any(|a| {
        let words = a.meta.to_token_stream().to_string();
        words == "test" || (words.starts_with("cfg") && words.contains("test") && !words.contains("not"))
    })
}

/// Lines from an item's first attribute to its end.
fn lines(item: &Item) -> usize {
    let (start, end) = (item.span().start().line, item.span().end().line);
    end + 1 - start
}

/// The name that an item defines.
fn defined(item: &Item) -> Option<String> {
    let ident = match item {
        Item::Const(i) => &i.ident,
        Item::Enum(i) => &i.ident,
        Item::Fn(i) => &i.sig.ident,
        Item::Macro(i) => i.ident.as_ref()?,
        Item::Static(i) => &i.ident,
        Item::Struct(i) => &i.ident,
        Item::Trait(i) => &i.ident,
        Item::Type(i) => &i.ident,
        Item::Union(i) => &i.ident,
        _ => return None,
    };
    Some(ident.to_string())
}

fn imports(tree: &UseTree, path: &mut Vec<String>, is_public: bool, found: &mut Vec<Import>) {
    let mut import = |name: String, path: Vec<String>| found.push(Import { name, path, is_public });
    match tree {
        UseTree::Path(inner) => {
            path.push(inner.ident.to_string());
            imports(&inner.tree, path, is_public, found);
            path.pop();
        }
        UseTree::Group(group) => group.items.iter().for_each(|tree| imports(tree, path, is_public, found)),
        UseTree::Glob(_) => import("*".into(), path.clone()),
        UseTree::Name(name) if name.ident == "self" => {
            import(path.last().cloned().unwrap_or_default(), path.clone());
        }
        UseTree::Name(name) => {
            import(name.ident.to_string(), [&path[..], &[name.ident.to_string()]].concat())
        }
        UseTree::Rename(name) => {
            import(name.rename.to_string(), [&path[..], &[name.ident.to_string()]].concat())
        }
    }
}

/// Adds every `a::b::c` of the tokens, in macros as well; not the names behind a dot, which are fields and methods.
fn paths(tokens: TokenStream, found: &mut BTreeSet<Vec<String>>) {
    let (mut path, mut colons, mut is_field): (Vec<String>, usize, bool) = (Vec::new(), 0, false);
    let mut end = |path: &mut Vec<String>| {
        if !path.is_empty() {
            found.insert(std::mem::take(path));
        }
    };
    let mut groups = Vec::new();
    for token in tokens {
        match token {
            TokenTree::Ident(ident) => {
                if colons != 2 {
                    end(&mut path);
                }
                if !(is_field || colons == 2 && path.is_empty()) {
                    path.push(ident.to_string());
                }
                (colons, is_field) = (0, false);
            }
            TokenTree::Punct(punct) if punct.as_char() == ':' => {
                colons = if colons == 1 || punct.spacing() == Spacing::Joint { colons + 1 } else { 0 };
            }
            token => {
                end(&mut path);
                colons = 0;
                is_field = matches!(&token, TokenTree::Punct(p) if p.as_char() == '.' && p.spacing() == Spacing::Alone);
                if let TokenTree::Group(group) = token {
                    groups.push(group.stream());
                }
            }
        }
    }
    end(&mut path);
    groups.into_iter().for_each(|group| paths(group, found));
}

/// Collects functions, without those of tests.
#[derive(Default)]
struct Functions(Vec<Function>);

impl Functions {
    fn add(&mut self, signature: &syn::Signature, end: proc_macro2::Span) {
        let line = signature.span().start().line;
        self.0.push(Function { name: signature.ident.to_string(), line, lines: end.end().line + 1 - line });
    }
}

impl<'a> Visit<'a> for Functions {
    fn visit_item(&mut self, item: &'a Item) {
        if !is_test(attributes(item)) {
            visit::visit_item(self, item);
        }
    }

    fn visit_item_fn(&mut self, function: &'a syn::ItemFn) {
        self.add(&function.sig, function.block.span());
        visit::visit_item_fn(self, function);
    }

    fn visit_impl_item_fn(&mut self, function: &'a syn::ImplItemFn) {
        self.add(&function.sig, function.block.span());
        visit::visit_impl_item_fn(self, function);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn paths_are_read_from_code_and_macros() {
        let text = "fn f(x: a::B) -> c::D { x.field.method(crate::e::F); say!(\"{}\", g::H { i: 1 }) }";
        let source = Source::parse(text).unwrap();
        let joined: BTreeSet<String> = source.module.paths.iter().map(|p| p.join("::")).collect();
        for expected in ["a::B", "c::D", "crate::e::F", "g::H"] {
            assert!(joined.contains(expected), "{expected}: {joined:?}");
        }
        assert!(!joined.contains("field") && !joined.contains("method"), "{joined:?}");
    }

    #[test]
    fn imports_are_read_and_tests_are_not() {
        let text = "pub use a::B;\nuse super::{c as d, e::{self, *}};\nmod f;\nstruct G;\n#[cfg(test)]\nmod tests { use x::Y; }\n";
        let module = Source::parse(text).unwrap().module;
        let found: Vec<String> = module
            .imports
            .iter()
            .map(|i| format!("{} = {}{}", i.name, i.path.join("::"), if i.is_public { " pub" } else { "" }))
            .collect();
        assert_eq!(found, ["B = a::B pub", "d = super::c", "e = super::e", "* = super::e"]);
        assert_eq!((module.children, module.defines.contains("G")), (vec!["f".to_owned()], true));
    }
}
