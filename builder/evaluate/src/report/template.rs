//! HTML from templates.

use minijinja::{Environment, Value, syntax::SyntaxConfig};

/// Fills in an HTML template (Jinja's syntax). Values are escaped unless the template marks them `safe`.
///
/// # Panics
/// On a template with an error. Templates are part of the program, and tests render each of them.
pub fn render(template: &str, values: Value) -> String {
    let syntax = SyntaxConfig::builder().trim_blocks(true).keep_trailing_newline(true).build();
    let mut environment = Environment::new();
    environment.set_syntax(syntax.expect("delimiters are the default ones"));
    environment.render_named_str("page.html", template, values).expect("a template without errors")
}

#[cfg(test)]
mod tests {
    use minijinja::context;

    use super::*;

    #[test]
    fn values_are_escaped_once_and_are_no_templates() {
        let html = render("{{a}}-{{b}}-{{c|safe}}\n", context! { a => "{{b}}<", b => "\"", c => "<b>" });
        assert_eq!(html, "{{b}}&lt;-&quot;-<b>\n");
    }
}
