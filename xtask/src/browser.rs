//! A headless Chromium that opens a page and tells what has become of it.

use std::{fs, path::Path, time::Duration};

use anyhow::{Result, bail};

use crate::shell::{command, run_within};

const PATIENCE: Duration = Duration::from_secs(300);

/// Opens a page, lets it run for so many milliseconds of its own time, and returns its document. `folder` is for the
/// browser's own files, `fragment` follows the `#` of the address.
///
/// # Errors
/// Where the browser does not end in time.
pub fn document(browser: &str, folder: &Path, page: &Path, fragment: &str, millis: u32) -> Result<String> {
    let profile = folder.join(format!("chromium-{}", std::process::id()));
    let mut chromium = command(browser);
    chromium.args(["--headless", "--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run"]);
    chromium.args(["--disable-background-networking", "--disable-component-update", "--disable-sync"]);
    chromium.arg(format!("--user-data-dir={}", profile.display()));
    chromium.arg(format!("--virtual-time-budget={millis}")).arg("--dump-dom");
    chromium.arg(format!("file://{}#{fragment}", page.display()));
    let (done, dom) = run_within(&mut chromium, PATIENCE)?;
    fs::remove_dir_all(&profile).ok();
    if !done {
        bail!("{browser} does not open {} in time:\n{dom}", page.display());
    }
    Ok(dom)
}

/// The value of the first attribute of that name.
pub fn attribute(html: &str, name: &str) -> Option<String> {
    let rest = html.split_once(&format!("{name}=\""))?.1;
    let (value, _) = rest.split_once('"')?;
    let escaped = [("&quot;", "\""), ("&lt;", "<"), ("&gt;", ">"), ("&nbsp;", " "), ("&amp;", "&")];
    Some(escaped.iter().fold(value.to_owned(), |text, (from, to)| text.replace(from, to)))
}

#[cfg(test)]
mod tests {
    use super::attribute;

    #[test]
    fn attributes_are_found() {
        let html = r#"<html data-state="playing" data-all="[&quot;a &amp;lt;&quot;]"><p>data-frames</p>"#;
        assert_eq!(attribute(html, "data-state").as_deref(), Some("playing"));
        assert_eq!(attribute(html, "data-all").as_deref(), Some(r#"["a &lt;"]"#));
        assert_eq!(attribute(html, "data-frames"), None);
    }
}
