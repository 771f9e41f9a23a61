//! Figures for `--json`.

use serde_json::Value;

/// Adds the figures of one object to another.
pub fn add(figures: &mut Value, more: Value) {
    if let (Some(figures), Value::Object(more)) = (figures.as_object_mut(), more) {
        figures.extend(more);
    }
}
