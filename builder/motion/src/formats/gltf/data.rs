//! Buffers and accessors.
//!
//! A file's counts, offsets and types are untrusted: nothing is read beyond a buffer's end, and no allocation depends
//! on a count.

use std::{cell::OnceCell, io};

use base64::{
    Engine,
    alphabet::STANDARD,
    engine::{DecodePaddingMode, GeneralPurpose, GeneralPurposeConfig},
};
use gltf::{
    Accessor,
    accessor::{DataType, Dimensions},
    buffer::{Buffer, Source},
};

use crate::formats::gltf::error::GltfErrorKind;

/// Reads a file by its path relative to the glTF file.
pub type Open<'a> = dyn Fn(&str) -> io::Result<Vec<u8>> + 'a;

/// Accepts data URIs with and without padding, and writes padding.
pub const BASE64: GeneralPurpose = GeneralPurpose::new(
    &STANDARD,
    GeneralPurposeConfig::new().with_decode_padding_mode(DecodePaddingMode::Indifferent),
);

/// The buffers of a file, each read on first use: those of meshes and images never are.
pub struct Buffers<'a> {
    open: &'a Open<'a>,
    blob: Option<&'a [u8]>,
    read: Vec<OnceCell<Result<Vec<u8>, GltfErrorKind>>>,
}

impl<'a> Buffers<'a> {
    /// The buffers of a document whose binary part is `blob`.
    pub fn new(document: &gltf::Document, blob: Option<&'a [u8]>, open: &'a Open<'a>) -> Self {
        Self { open, blob, read: document.buffers().map(|_| OnceCell::new()).collect() }
    }

    fn get(&self, buffer: &Buffer<'_>) -> Result<&[u8], GltfErrorKind> {
        let index = buffer.index();
        match buffer.source() {
            Source::Bin => self.blob.ok_or_else(|| GltfErrorKind::Buffer {
                buffer: index,
                uri: "the binary part".to_owned(),
                reason: "the file has none".to_owned(),
            }),
            Source::Uri(uri) => {
                self.read[index].get_or_init(|| self.fetch(index, uri)).as_deref().map_err(Clone::clone)
            }
        }
    }

    fn fetch(&self, buffer: usize, uri: &str) -> Result<Vec<u8>, GltfErrorKind> {
        if let Some(data) = uri.strip_prefix("data:") {
            let text = data.split_once(";base64,").map_or("", |(_, text)| text);
            return BASE64.decode(text).map_err(|e| GltfErrorKind::DataUri { buffer, reason: e.to_string() });
        }
        fetch(uri, self.open).map_err(|e| GltfErrorKind::Buffer {
            buffer,
            uri: uri.to_owned(),
            reason: e.to_string(),
        })
    }

    /// The vectors of an accessor; normalised integers become fractions. Shape `[count][N]`.
    pub fn floats<const N: usize>(&self, accessor: &Accessor<'_>) -> Result<Vec<[f64; N]>, GltfErrorKind> {
        let wrong = |what| GltfErrorKind::Accessor { accessor: accessor.index(), what };
        let dimensions = match accessor.dimensions() {
            Dimensions::Scalar => 1,
            Dimensions::Vec3 => 3,
            Dimensions::Vec4 => 4,
            _ => 0,
        };
        if dimensions != N {
            return Err(wrong("it is of another shape than what it is used for"));
        }
        if accessor.sparse().is_some() {
            return Err(wrong("it is sparse, which animations are not"));
        }
        let view = accessor.view().ok_or_else(|| wrong("it has no data"))?;
        let data = self.get(&view.buffer())?;
        let start = view.offset();
        let data = start
            .checked_add(view.length())
            .and_then(|end| data.get(start..end))
            .ok_or_else(|| wrong("its part of the buffer is longer than the buffer"))?;
        let data_type = accessor.data_type();
        let size = data_type.size();
        let stride = view.stride().unwrap_or(N * size).max(N * size);
        let data = data.get(accessor.offset()..).unwrap_or(&[]);
        let rows: Vec<[f64; N]> = data
            .chunks(stride)
            .take(accessor.count())
            .filter(|row| row.len() >= N * size)
            .map(|row| std::array::from_fn(|k| number(data_type, &row[k * size..(k + 1) * size])))
            .collect();
        if rows.len() < accessor.count() {
            return Err(wrong("it is longer than its part of the buffer"));
        }
        if rows.iter().flatten().any(|x| !x.is_finite()) {
            return Err(wrong("it holds a number that is not finite"));
        }
        Ok(rows)
    }
}

/// The file at a relative URI.
pub fn fetch(uri: &str, open: &Open<'_>) -> io::Result<Vec<u8>> {
    open(&percent_encoding::percent_decode_str(uri).decode_utf8_lossy())
}

/// A component of that type; integers are divided by their largest value.
fn number(data_type: DataType, bytes: &[u8]) -> f64 {
    let two = || [bytes[0], bytes[1]];
    let four = || [bytes[0], bytes[1], bytes[2], bytes[3]];
    match data_type {
        DataType::I8 => (f64::from(bytes[0].cast_signed()) / 127.0).max(-1.0),
        DataType::U8 => f64::from(bytes[0]) / 255.0,
        DataType::I16 => (f64::from(i16::from_le_bytes(two())) / 32767.0).max(-1.0),
        DataType::U16 => f64::from(u16::from_le_bytes(two())) / 65535.0,
        DataType::U32 => f64::from(u32::from_le_bytes(four())),
        DataType::F32 => f64::from(f32::from_le_bytes(four())),
    }
}
