//! The report of an evaluation as one HTML document.

use minijinja::{Value, context};

use crate::report::{
    table::{self, Row},
    template::render,
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

/// Text for people as parts, of which the `words in backticks` are code.
fn prose(text: &str) -> Vec<Value> {
    let parts: Vec<&str> = text.split('`').collect();
    // A backtick without its other half is a character like any.
    let paired = (parts.len() - 1) / 2 * 2;
    let part = |(i, part): (usize, &&str)| {
        let text = if i > paired { format!("`{part}") } else { (*part).to_owned() };
        context! { code => i <= paired && i % 2 == 1, text }
    };
    parts.iter().enumerate().map(part).collect()
}

/// Rows as the template's table.
fn cells(rows: &[Row]) -> Value {
    let columns = table::columns(rows);
    let cells = |row: &Row| columns.iter().map(|c| table::text(row.get(*c))).collect::<Vec<_>>();
    context! { rows => rows.iter().map(cells).collect::<Vec<_>>(), columns => columns.iter().map(|c| (*c).to_owned()).collect::<Vec<_>>() }
}

/// Renders a report: what was measured, summaries with their headings first, pictures, then every row.
pub fn report(
    title: &str,
    about: &str,
    summaries: &[(&str, Vec<Row>)],
    figures: &[Figure],
    rows: &[Row],
) -> String {
    let summary = |(name, rows): &(&str, Vec<Row>)| context! { name => *name, table => cells(rows) };
    let figure = |f: &Figure| context! { svg => f.svg.as_str(), caption => prose(&f.caption) };
    render(
        include_str!("report.html"),
        context! {
            title, about => prose(about), summaries => summaries.iter().map(summary).collect::<Vec<_>>(), rows => cells(rows),
            figures => figures.iter().map(figure).collect::<Vec<_>>(),
        },
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn backticks_become_code() {
        for (about, html) in [
            ("`a<b` and `c`.", "<p><code>a&lt;b</code> and <code>c</code>.</p>"),
            ("`a` and ` alone", "<p><code>a</code> and ` alone</p>"),
            ("plain", "<p>plain</p>"),
        ] {
            let report = report("", about, &[], &[], &[]);
            assert!(report.contains(html), "{report}");
        }
    }

    #[test]
    fn names_are_escaped_and_pictures_are_not() {
        let row = serde_json::json!({ "a<": "<b>", "n": 0.5 });
        let figure = Figure { name: "f".into(), caption: "<i>".into(), svg: "<svg/>".into() };
        let html = report("<t>", "", &[], &[figure], &[row.as_object().unwrap().clone()]);
        assert!(html.starts_with("<!doctype html>\n"), "{html}");
        assert!(html.contains("<tr><th>a&lt;</th><th>n</th></tr>"), "{html}");
        assert!(html.contains("<tr><td>&lt;b&gt;</td><td>0.5000</td></tr>\n</tbody>"), "{html}");
        assert!(html.contains("<figure><svg/><figcaption>&lt;i&gt;</figcaption></figure>"), "{html}");
    }
}
