//! Text made safe for HTML and SVG, and templates filled with it.

/// Text made safe for HTML and SVG, in elements and in quoted attributes.
///
/// Control characters other than tab and line ends are not allowed there, even escaped: they become U+FFFD.
pub fn escape(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '&' => out.push_str("&amp;"),
            '<' => out.push_str("&lt;"),
            '>' => out.push_str("&gt;"),
            '"' => out.push_str("&quot;"),
            '\'' => out.push_str("&#39;"),
            '\t' | '\n' | '\r' => out.push(c),
            c if c.is_control() => out.push('\u{fffd}'),
            c => out.push(c),
        }
    }
    out
}

/// A template with each `{{key}}` replaced by its value. One pass: braces inside a value are left alone.
pub fn fill(template: &str, values: &[(&str, &str)]) -> String {
    let mut out = String::with_capacity(template.len() + values.iter().map(|(_, v)| v.len()).sum::<usize>());
    let mut rest = template;
    while let Some(start) = rest.find("{{") {
        out.push_str(&rest[..start]);
        let tail = &rest[start + 2..];
        let known =
            values.iter().find(|(key, _)| tail.strip_prefix(key).is_some_and(|t| t.starts_with("}}")));
        match known {
            Some((key, value)) => {
                out.push_str(value);
                rest = &tail[key.len() + 2..];
            }
            None => {
                out.push_str("{{");
                rest = tail;
            }
        }
    }
    out.push_str(rest);
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn escapes_markup_and_control_characters() {
        assert_eq!(escape("a<b>&\"'\u{1}\t"), "a&lt;b&gt;&amp;&quot;&#39;\u{fffd}\t");
    }

    #[test]
    fn fills_once_and_leaves_values_alone() {
        assert_eq!(fill("{{a}}-{{b}}-{{c}}", &[("a", "{{b}}"), ("b", "2")]), "{{b}}-2-{{c}}");
    }
}
