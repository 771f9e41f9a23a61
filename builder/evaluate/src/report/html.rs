//! The report of an evaluation as one HTML document.

use crate::report::{
    markup::escape,
    table::{self, Row},
};

/// A picture with what it shows.
#[derive(Debug, Clone)]
pub struct Figure {
    /// Name of its file, without ending.
    pub name: String,
    /// What it shows.
    pub caption: String,
    /// The picture.
    pub svg: String,
}

const STYLE: &str = "body{font:15px/1.5 system-ui,sans-serif;max-width:1000px;margin:2em auto;padding:0 1em;color:#222}\
table{border-collapse:collapse;font-size:13px;margin:1em 0}td,th{padding:2px 8px;border-bottom:1px solid #ddd;text-align:left}\
figure{margin:1.5em 0}figcaption{color:#555}svg{max-width:100%;height:auto}";

/// Text for people, its `words of code` set as such.
fn prose(text: &str) -> String {
    let parts: Vec<&str> = text.split('`').collect();
    // A mark without its other half is a character like any.
    let marks = (parts.len() - 1) / 2 * 2;
    let mut out = String::new();
    for (i, part) in parts.iter().enumerate() {
        match (i, i % 2) {
            (0, _) => {}
            _ if i > marks => out.push('`'),
            (_, 1) => out.push_str("<code>"),
            _ => out.push_str("</code>"),
        }
        out.push_str(&escape(part));
    }
    out
}

/// Renders a report: what was measured, means first, pictures, then every row.
pub fn report(title: &str, about: &str, summary: &[Row], figures: &[Figure], rows: &[Row]) -> String {
    let pictures: String = figures
        .iter()
        .map(|f| format!("<figure>{}<figcaption>{}</figcaption></figure>\n", f.svg, prose(&f.caption)))
        .collect();
    format!(
        "<!doctype html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"><title>{title}</title><style>{STYLE}</style></head>\n\
         <body><h1>{title}</h1><p>{about}</p>\n<h2>Means</h2>\n{}<h2>Plots</h2>\n{pictures}<h2>All rows</h2>\n{}</body></html>\n",
        table::html(summary),
        table::html(rows),
        title = escape(title),
        about = prose(about),
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn backticks_become_code() {
        assert_eq!(prose("`a<b` and `c`."), "<code>a&lt;b</code> and <code>c</code>.");
        assert_eq!(prose("`a` and ` alone"), "<code>a</code> and ` alone");
        assert_eq!(prose("plain"), "plain");
    }
}
