//! One animation of several that move one joint each, as sample figures and some exporters have them: together they are one
//! motion.

use serde_json::{Value, json};

use super::{container::Container, error::GltfErrorKind};

/// The file with one animation in the place of those that turn joints; others stay.
///
/// # Errors
/// A file that can't be taken apart or put together.
pub fn joined(bytes: &[u8]) -> Result<Vec<u8>, GltfErrorKind> {
    let mut file = Container::of(bytes)?;
    if let Some(animations) = file.json["animations"].as_array_mut() {
        let turns = |animation: &Value| {
            let channels = animation["channels"].as_array();
            channels.is_some_and(|channels| channels.iter().any(|c| c["target"]["path"] == "rotation"))
        };
        let (all, mut others): (Vec<Value>, Vec<Value>) =
            std::mem::take(animations).into_iter().partition(turns);
        let (mut samplers, mut channels) = (Vec::new(), Vec::new());
        for animation in all {
            let before = samplers.len();
            samplers.extend(animation["samplers"].as_array().cloned().unwrap_or_default());
            for mut channel in animation["channels"].as_array().cloned().unwrap_or_default() {
                channel["sampler"] = json!(before as u64 + channel["sampler"].as_u64().unwrap_or(0));
                channels.push(channel);
            }
        }
        others.insert(0, json!({"channels": channels, "samplers": samplers}));
        *animations = others;
    }
    file.bytes()
}
