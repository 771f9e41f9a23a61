//! A file without the packing of its views, for programs that do not unpack, such as the page of `gestus page`.

use serde_json::{Value, json};

use super::{
    container::{Container, aligned},
    data::Buffers,
    document::content,
    error::{GltfError, GltfErrorKind},
    packed::EXTENSIONS,
};
use crate::files::FileError;

/// Bytes at most between views.
const ALIGNMENT: usize = 4;

/// The bytes of a file, whose data is all inside, with its packed views unpacked.
///
/// # Errors
/// [`GltfError`] for views that can't be unpacked.
pub fn unpacked(bytes: &[u8], file: &str) -> Result<Vec<u8>, GltfError> {
    whole(bytes).map_err(|kind| GltfError { file: file.to_owned(), kind })
}

fn whole(bytes: &[u8]) -> Result<Vec<u8>, GltfErrorKind> {
    let content = content(bytes)?;
    let buffers = Buffers::new(&content, &|_| Err(FileError::Alone));
    let mut views: Vec<_> = content.packed.iter().collect();
    views.sort_by_key(|(view, _)| **view);
    // Copies of what is unpacked where the file is put together: as bytes, or as text.
    let most = buffers.room() / if content.bin.is_some() { 2 } else { 6 };
    let mut length = 0usize;
    for &(&view, packed) in &views {
        length = length.saturating_add(packed.size().saturating_add(ALIGNMENT));
        if length > most {
            return Err(GltfErrorKind::Inflates { view, megabytes: length >> 20 });
        }
    }
    let mut file = Container::of(bytes)?;
    if views.is_empty() {
        return file.bytes();
    }
    let mut data = Vec::with_capacity(length);
    let mut places = Vec::new();
    for (&view, packed) in views {
        data.resize(aligned(data.len()), 0);
        places.push((view, data.len()));
        data.append(&mut buffers.unpack(view, packed)?);
    }
    file.append(data)?;
    // The view that was added, which its parts take the place of.
    let all = file.json["bufferViews"].as_array_mut().and_then(Vec::pop).unwrap_or_default();
    let start = all["byteOffset"].as_u64().unwrap_or(0);
    for (view, place) in places {
        let view = &mut file.json["bufferViews"][view];
        view["buffer"] = all["buffer"].clone();
        view["byteOffset"] = json!(start + place as u64);
        forget(view);
    }
    for buffer in file.json["buffers"].as_array_mut().into_iter().flatten() {
        forget(buffer);
    }
    for list in ["extensionsUsed", "extensionsRequired"] {
        if let Some(list) = file.json.get_mut(list).and_then(Value::as_array_mut) {
            list.retain(|name| !EXTENSIONS.iter().any(|packing| name == packing));
        }
    }
    file.bytes()
}

/// Removes the packing from the extensions of a view or buffer.
fn forget(of: &mut Value) {
    if let Some(extensions) = of.get_mut("extensions").and_then(Value::as_object_mut) {
        extensions.retain(|name, _| !EXTENSIONS.contains(&name.as_str()));
    }
}
