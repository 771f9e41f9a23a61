//! What is generated from the table of parameters is up to date: `docs/PARAMETERS.md`, and the enum of the C interface.
//! `GESTUS_RECORD=1 cargo test -p gestus-core --test parameter_documents` writes them.

use std::{env, fmt::Write, fs, path::Path};

use gestus_core::{
    Method,
    config::parameters::{Parameter, TABLE},
};

/// Compares a file below the repository's root with what the table makes of it, or writes it.
fn check(path: &str, generated: &str) {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("..").join(path);
    if env::var("GESTUS_RECORD").is_ok() {
        fs::write(&path, generated).unwrap();
    }
    let file = fs::read_to_string(&path).unwrap_or_default();
    assert!(
        file == generated,
        "{} is not what the table says: GESTUS_RECORD=1 cargo test -p gestus-core --test parameter_documents",
        path.display()
    );
}

/// A parameter's text on one line, without links into the core's documentation.
fn text(parameter: &Parameter) -> String {
    let words = parameter.doc.split_whitespace().collect::<Vec<_>>().join(" ");
    words.replace("[`", "`").replace("`]", "`")
}

/// The numbers that it takes: a range, or alternatives by name.
fn values(parameter: &Parameter) -> String {
    if parameter.choices.is_empty() {
        return parameter.range.to_string();
    }
    let named = parameter.choices.iter().enumerate().map(|(number, name)| format!("{number} {name}"));
    named.collect::<Vec<_>>().join(", ")
}

#[test]
fn the_document_is_the_table() {
    let mut page = "# Parameters\n\nGenerated from `core/src/config/parameters.rs`. The number is that of the link's \
        `Configure` and of `GestusParameter` in C; the name is the field of `Config` in Rust. On the command line a \
        parameter is the option of its name, without the unit: `halflife_s` is `--halflife`; `contacts` is \
        switched off by `--no-contact`. A parameter affects only the methods of its row.\n\n\
        | number | name | values | default | methods | what it does |\n|---|---|---|---|---|---|\n"
        .to_owned();
    for parameter in TABLE {
        let Parameter { number, name, methods, .. } = parameter;
        let (values, default, text) = (values(parameter), parameter.default(), text(parameter));
        let every = methods.len() == Method::ALL.len();
        let names = methods.iter().map(|m| m.name()).collect::<Vec<_>>().join(", ");
        let method = if every { "all".to_owned() } else { names };
        writeln!(page, "| {number} | `{name}` | {values} | {default} | {method} | {text} |").unwrap();
    }
    check("docs/PARAMETERS.md", &page);
}

#[test]
fn the_enum_of_the_c_interface_is_the_table() {
    let mut source = "//! Generated from the core's table of parameters by its test `parameter_documents`.\n\n\
        /// Parameters of a stylizer by number, the same as on the link. Every value is a `float`.\n#[repr(C)]\n\
        #[derive(Clone, Copy, Debug, PartialEq, Eq)]\npub enum GestusParameter {\n"
        .to_owned();
    for parameter in TABLE {
        let name =
            parameter.name.strip_suffix("_s").or(parameter.name.strip_suffix("_m")).unwrap_or(parameter.name);
        let mut variant = String::new();
        for word in name.split('_') {
            variant += &word[..1].to_uppercase();
            variant += &word[1..];
        }
        let line = format!("{} {}. Default {}.", text(parameter), values(parameter), parameter.default());
        for line in wrapped(&line, 112) {
            writeln!(source, "    /// {line}").unwrap();
        }
        writeln!(source, "    {variant} = {},", parameter.number).unwrap();
    }
    source += "}\n";
    check("firmware-sim/capi/src/parameter.rs", &source);
}

/// Lines of at most `width` characters.
fn wrapped(text: &str, width: usize) -> Vec<String> {
    let mut lines = vec![String::new()];
    for word in text.split(' ') {
        let last = lines.last_mut().unwrap();
        if !last.is_empty() && last.chars().count() + 1 + word.chars().count() > width {
            lines.push(word.to_owned());
        } else {
            if !last.is_empty() {
                last.push(' ');
            }
            last.push_str(word);
        }
    }
    lines
}
