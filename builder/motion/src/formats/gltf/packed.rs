//! Views of a buffer that meshoptimizer packed, as `gltfpack` and `gltf-transform` write them.
//!
//! `EXT_meshopt_compression` and `KHR_meshopt_compression` are one, but for a second version of the codec and a filter of
//! colors, which the latter adds. Either is read under both names.

use meshoptimizer_rs::{
    Error, Limits, Workspace,
    codec::{
        decode_filter_color, decode_filter_exp, decode_filter_oct, decode_filter_quat, decode_index_buffer,
        decode_index_sequence, decode_vertex_buffer,
    },
};
use serde::Deserialize;

/// The extensions.
pub const EXTENSIONS: [&str; 2] = ["EXT_meshopt_compression", "KHR_meshopt_compression"];

/// A view as its extension describes it.
#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
pub struct Packed {
    /// The buffer of the packed bytes.
    pub buffer: usize,
    /// Where they begin in it.
    #[serde(default)]
    pub byte_offset: usize,
    /// How many they are.
    pub byte_length: usize,
    byte_stride: usize,
    count: usize,
    mode: Mode,
    #[serde(default)]
    filter: Filter,
}

/// The codec.
#[derive(Deserialize, Clone, Copy)]
#[serde(rename_all = "UPPERCASE")]
enum Mode {
    Attributes,
    Triangles,
    Indices,
    #[serde(other)]
    Other,
}

/// What is done to the numbers after it.
#[derive(Deserialize, Clone, Copy, Default)]
#[serde(rename_all = "UPPERCASE")]
enum Filter {
    #[default]
    None,
    Octahedral,
    Quaternion,
    Exponential,
    Color,
    #[serde(other)]
    Other,
}

impl Packed {
    /// Length when unpacked, bytes.
    pub fn size(&self) -> usize {
        self.count.saturating_mul(self.byte_stride)
    }

    /// The bytes of the view.
    ///
    /// # Errors
    /// Says what is wrong.
    pub fn unpack(&self, data: &[u8]) -> Result<Vec<u8>, &'static str> {
        if self.count == 0 {
            return Ok(Vec::new());
        }
        let limits = Limits { max_bytes: self.size(), ..Limits::default() };
        let (count, stride, work) = (self.count, self.byte_stride, &mut Workspace::new(limits));
        let decode = match self.mode {
            Mode::Attributes => decode_vertex_buffer,
            Mode::Triangles => decode_index_buffer,
            Mode::Indices => decode_index_sequence,
            Mode::Other => return Err("its mode is unknown"),
        };
        let mut bytes = decode(count, stride, data, work).map_err(reason)?;
        let filter = match self.filter {
            Filter::None => return Ok(bytes),
            Filter::Octahedral => decode_filter_oct,
            Filter::Quaternion => decode_filter_quat,
            Filter::Exponential => decode_filter_exp,
            Filter::Color => decode_filter_color,
            Filter::Other => return Err("its filter is unknown"),
        };
        filter(&mut bytes, count, stride, work).map_err(reason)?;
        Ok(bytes)
    }
}

fn reason(error: Error) -> &'static str {
    match error {
        Error::InvalidStream => "its bytes are damaged",
        Error::UnsupportedVersion => "it was written by a newer version of meshoptimizer",
        Error::InvalidLayout | Error::InvalidTopology => {
            "its stride or count is not one of its mode and filter"
        }
        _ => "its numbers are out of range",
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn view(filter: &str, count: usize, stride: usize) -> String {
        format!(
            r#"{{"buffer": 1, "byteLength": 0, "byteStride": {stride}, "count": {count}, "mode": "ATTRIBUTES", "filter": "{filter}"}}"#
        )
    }

    fn unpack(description: &str, data: &[u8]) -> Result<Vec<u8>, &'static str> {
        serde_json::from_str::<Packed>(description).unwrap().unpack(data)
    }

    /// Bytes and numbers of the tests of meshoptimizer's own decoder (`js/meshopt_decoder.test.js`).
    #[test]
    fn what_the_reference_unpacks_is_unpacked_alike() {
        let mut data = vec![0xa0, 0x01, 0x0f, 0, 0, 0, 0x3d, 0x5a, 0x01, 0x0f, 0, 0, 0, 0x0e, 0x0d, 0x01];
        data.extend([0x3f, 0, 0, 0, 0x9a, 0x99, 0x26, 0x01, 0x3f, 0, 0, 0, 0x0e, 0x0d, 0x0a, 0, 0, 0x01]);
        data.push(0x2a);
        data.extend([0; 30]);
        data.extend([0x01, 0, 0, 0, 0xfc, 0x07]);
        let turns = unpack(&view("QUATERNION", 4, 8), &data).unwrap();
        let turns: Vec<i16> = turns.chunks_exact(2).map(|b| i16::from_le_bytes([b[0], b[1]])).collect();
        let expected = [32767, 0, 11, 0, 0, 25013, 0, 21166, 11, 0, 23504, 22830, 158, 14715, 0, 29277];
        assert_eq!(turns, expected);

        let mut data = vec![0xa0];
        data.extend([0; 32]);
        data.extend([0, 0, 0, 0, 0x03, 0, 0, 0xff, 0xf7, 0xff, 0xff, 0x02, 0xff, 0xff, 0x7f, 0xfe]);
        let numbers = unpack(&view("EXPONENTIAL", 1, 16), &data).unwrap();
        let numbers: Vec<u32> =
            numbers.chunks_exact(4).map(|b| u32::from_le_bytes(b.try_into().unwrap())).collect();
        assert_eq!(numbers, [0, 0x3fc0_0000, 0xc210_0000, 0x49ff_fffe]);

        assert_eq!(unpack(&view("NONE", 0, 16), &[]), Ok(vec![]));
        for (description, data) in [
            (view("EXPONENTIAL", 1, 16), &data[..40]),
            (view("NONE", 1, 3), &data),
            (view("QUATERNION", 1, 16), &data),
            (view("SQUARE", 1, 16), &data),
            (view("NONE", 1, 16).replace("ATTRIBUTES", "WAVELETS"), &data),
            (view("NONE", 1, 16).replace("ATTRIBUTES", "TRIANGLES"), &data),
        ] {
            assert!(unpack(&description, data).is_err(), "{description}");
        }
    }
}
