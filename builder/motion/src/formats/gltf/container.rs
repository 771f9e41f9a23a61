//! A file's JSON and binary part: `.glb` or `.gltf`, written again as it came in.

use nalgebra::Vector3;
use serde_json::Value;

use crate::formats::gltf::error::GltfErrorKind;

const GLB: &[u8] = b"glTF";
const JSON: &[u8] = b"JSON";
const BIN: &[u8] = b"BIN\0";
const VERSION: u32 = 2;
/// `accessor.componentType` of single-precision numbers.
pub const FLOAT: u32 = 5126;

/// A file's parts, where they are in it.
pub struct Chunks<'a> {
    /// Its JSON.
    pub json: &'a [u8],
    /// Its binary part, if it has one.
    pub bin: Option<&'a [u8]>,
    is_glb: bool,
    /// Chunks of other kinds, with their headers.
    others: Vec<&'a [u8]>,
}

impl<'a> Chunks<'a> {
    /// The parts of a file.
    ///
    /// # Errors
    /// A `.glb` of another version, and one that is shorter than it says, or than its parts.
    pub fn of(bytes: &'a [u8]) -> Result<Self, GltfErrorKind> {
        if !bytes.starts_with(GLB) {
            let json = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes);
            return Ok(Self { json, bin: None, is_glb: false, others: Vec::new() });
        }
        let cut = || GltfErrorKind::Cut;
        let version = bytes.get(4..8).and_then(number).ok_or_else(cut)?;
        match version {
            2 => {}
            1 => return Err(GltfErrorKind::FirstVersion),
            _ => return Err(GltfErrorKind::NotGltf(format!("its version is {version}"))),
        }
        // What comes after the length that it states is not of the file.
        let mut rest =
            bytes.get(8..12).and_then(number).and_then(|length| bytes.get(12..length)).ok_or_else(cut)?;
        let (mut json, mut bin, mut others) = (None, None, Vec::new());
        while let Some(length) = rest.get(..4).and_then(number) {
            let end = length.checked_add(8).ok_or_else(cut)?;
            let (kind, chunk) = (rest.get(4..8).ok_or_else(cut)?, rest.get(8..end).ok_or_else(cut)?);
            match kind {
                JSON if json.is_none() => json = Some(chunk),
                BIN if bin.is_none() => bin = Some(chunk),
                _ => others.push(&rest[..end]),
            }
            rest = &rest[end..];
        }
        Ok(Self { json: json.ok_or_else(cut)?, bin, is_glb: true, others })
    }
}

/// A file's parts, to be changed and written.
pub struct Container<'a> {
    /// All of its JSON.
    pub json: Value,
    /// Its binary part, if it has one.
    pub bin: Option<Vec<u8>>,
    is_glb: bool,
    /// Chunks of other kinds, with their headers.
    others: Vec<&'a [u8]>,
}

impl<'a> Container<'a> {
    /// The parts of a file.
    ///
    /// # Errors
    /// As [`Chunks::of`], and JSON that is none.
    pub fn of(bytes: &'a [u8]) -> Result<Self, GltfErrorKind> {
        let Chunks { json, bin, is_glb, others } = Chunks::of(bytes)?;
        let json = serde_json::from_slice(json).map_err(|e| GltfErrorKind::NotGltf(e.to_string()))?;
        Ok(Self { json, bin: bin.map(<[u8]>::to_vec), is_glb, others })
    }

    /// A new `.glb` file.
    pub fn glb(json: Value, bin: Vec<u8>) -> Self {
        Self { json, bin: Some(bin), is_glb: true, others: Vec::new() }
    }

    /// The file.
    ///
    /// # Errors
    /// [`GltfErrorKind::TooLarge`]: a `.glb` counts its bytes in 32 bits.
    pub fn bytes(self) -> Result<Vec<u8>, GltfErrorKind> {
        if !self.is_glb {
            let mut text = serde_json::to_vec_pretty(&self.json).expect("its keys are text");
            text.push(b'\n');
            return Ok(text);
        }
        let mut json = serde_json::to_vec(&self.json).expect("its keys are text");
        json.resize(aligned(json.len()), b' ');
        let bin = self.bin.unwrap_or_default();
        let others: usize = self.others.iter().map(|chunk| chunk.len()).sum();
        let total = 12 + 8 + json.len() + if bin.is_empty() { 0 } else { 8 + aligned(bin.len()) } + others;
        let small = |n: usize| u32::try_from(n).map(u32::to_le_bytes).map_err(|_| GltfErrorKind::TooLarge);
        let mut bytes = Vec::with_capacity(total);
        bytes.extend(GLB);
        bytes.extend(VERSION.to_le_bytes());
        bytes.extend(small(total)?);
        for (kind, mut chunk) in [(JSON, json), (BIN, bin)] {
            if !chunk.is_empty() {
                chunk.resize(aligned(chunk.len()), 0);
                bytes.extend(small(chunk.len())?);
                bytes.extend(kind);
                bytes.append(&mut chunk);
            }
        }
        self.others.iter().for_each(|chunk| bytes.extend(*chunk));
        Ok(bytes)
    }
}

/// The next multiple of four.
pub fn aligned(length: usize) -> usize {
    length.next_multiple_of(4)
}

/// A vector as files hold it.
pub fn single(v: &Vector3<f64>) -> [f32; 3] {
    [v.x as f32, v.y as f32, v.z as f32]
}

/// A length of 32 bits.
fn number(bytes: &[u8]) -> Option<usize> {
    usize::try_from(u32::from_le_bytes(bytes.try_into().ok()?)).ok()
}
