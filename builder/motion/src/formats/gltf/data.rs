//! Buffers and accessors.
//!
//! A file's counts, offsets and types are untrusted: nothing is read beyond a buffer's end, and nothing is allocated for
//! a count. Numbers stay where they are in the buffer, since any number of accessors may name the same bytes.

use std::{
    cell::{Cell, OnceCell, RefCell},
    collections::HashMap,
    path::{Component, Path, PathBuf},
    rc::Rc,
};

use base64::{
    Engine,
    alphabet::STANDARD,
    engine::{DecodePaddingMode, GeneralPurpose, GeneralPurposeConfig},
};
use gltf::{
    Accessor,
    accessor::{DataType, Dimensions, sparse::IndexType},
    buffer::{Buffer, Source, View},
};

use crate::{
    files::{FileError, memory},
    formats::gltf::{document::Content, error::GltfErrorKind, packed::Packed},
};

/// Reads a file by its path relative to the glTF file.
pub type Open<'a> = dyn Fn(&Path) -> Result<Vec<u8>, FileError> + 'a;

/// Bytes of accessors that are looked at for each byte of the buffers, and besides: more is overlap, which takes time.
const LOOKED_AT: (usize, usize) = (16, 64 << 20);

/// Accepts data URIs with and without padding, and writes padding.
pub const BASE64: GeneralPurpose = GeneralPurpose::new(
    &STANDARD,
    GeneralPurposeConfig::new().with_decode_padding_mode(DecodePaddingMode::Indifferent),
);

/// The buffers of a file, each read on first use, and the views that are packed, each unpacked then: those of meshes and
/// images never are.
pub struct Buffers<'a> {
    open: &'a Open<'a>,
    content: &'a Content<'a>,
    read: Vec<OnceCell<Result<Rc<[u8]>, GltfErrorKind>>>,
    unpacked: HashMap<usize, OnceCell<Result<Vec<u8>, GltfErrorKind>>>,
    /// Files beside this one, for buffers that share one.
    beside: RefCell<HashMap<PathBuf, Rc<[u8]>>>,
    /// Keys' times by accessor: channels share them.
    times: RefCell<HashMap<usize, Rc<[f64]>>>,
    looked_at: Cell<usize>,
    size: Cell<usize>,
    taken: Cell<usize>,
}

/// The vectors of an accessor, in the buffer. Shape `[count][N]`.
#[derive(Debug, Clone, Copy)]
pub struct Numbers<'b, const N: usize> {
    data: &'b [u8],
    count: usize,
    stride: usize,
    data_type: DataType,
    /// Vectors that are written elsewhere.
    others: Option<Others<'b>>,
}

/// The vectors of an accessor that differ from its own: their ascending indices, and the vectors themselves.
#[derive(Debug, Clone, Copy)]
struct Others<'b> {
    indices: &'b [u8],
    index_type: DataType,
    vectors: &'b [u8],
    count: usize,
}

impl Others<'_> {
    fn index(&self, place: usize) -> usize {
        let row = &self.indices[place * self.index_type.size()..];
        match self.index_type {
            DataType::U8 => usize::from(row[0]),
            DataType::U16 => usize::from(u16::from_le_bytes([row[0], row[1]])),
            _ => u32::from_le_bytes([row[0], row[1], row[2], row[3]]) as usize,
        }
    }

    /// The place of the vector with that index.
    fn find(&self, index: usize) -> Option<usize> {
        let (mut low, mut high) = (0, self.count);
        while low < high {
            let middle = low.midpoint(high);
            if self.index(middle) < index { low = middle + 1 } else { high = middle }
        }
        (low < self.count && self.index(low) == index).then_some(low)
    }
}

impl<const N: usize> Numbers<'_, N> {
    /// Number of vectors.
    pub fn len(&self) -> usize {
        self.count
    }

    /// A vector; normalised integers become fractions.
    pub fn at(&self, index: usize) -> [f64; N] {
        let size = self.data_type.size();
        let other = self.others.and_then(|others| Some((others, others.find(index)?)));
        let row = match other {
            Some((others, place)) => &others.vectors[place * N * size..],
            None if self.data.is_empty() => return [0.0; N],
            None => &self.data[index * self.stride..],
        };
        std::array::from_fn(|k| number(self.data_type, &row[k * size..(k + 1) * size]))
    }
}

impl<'a> Buffers<'a> {
    /// The buffers of a file. `open` reads a file beside it.
    pub fn new(content: &'a Content<'a>, open: &'a Open<'a>) -> Self {
        Self {
            open,
            content,
            read: content.document.buffers().map(|_| OnceCell::new()).collect(),
            unpacked: content.packed.keys().map(|&view| (view, OnceCell::new())).collect(),
            beside: RefCell::default(),
            times: RefCell::default(),
            looked_at: Cell::new(0),
            size: Cell::new(content.size),
            taken: Cell::new(0),
        }
    }

    /// Memory that is left for what is made of the file and of those beside it that were read, bytes.
    pub fn room(&self) -> usize {
        memory::max_bytes(self.size.get()).saturating_sub(self.taken.get())
    }

    /// Takes memory from the [room](Self::room) for good.
    pub fn take(&self, bytes: usize) {
        self.taken.set(self.taken.get().saturating_add(bytes));
    }

    /// The unpacked bytes of a view, if it is packed; they stay in memory.
    fn unpacked(&self, view: usize) -> Option<Result<&[u8], GltfErrorKind>> {
        let (packed, cell) = (self.content.packed.get(&view)?, self.unpacked.get(&view)?);
        let unpack = || {
            let size = packed.size();
            if size > self.room() {
                return Err(GltfErrorKind::Inflates { view, megabytes: size >> 20 });
            }
            self.take(size);
            self.unpack(view, packed)
        };
        Some(cell.get_or_init(unpack).as_deref().map_err(Clone::clone))
    }

    /// Unpacks a view.
    pub fn unpack(&self, view: usize, packed: &Packed) -> Result<Vec<u8>, GltfErrorKind> {
        let wrong = |what| GltfErrorKind::Packed { view, what };
        let buffer = self.content.document.buffers().nth(packed.buffer);
        let data = self.get(&buffer.ok_or_else(|| wrong("its buffer is not there"))?)?;
        let end = packed.byte_offset.checked_add(packed.byte_length);
        let data = end.and_then(|end| data.get(packed.byte_offset..end));
        packed.unpack(data.ok_or_else(|| wrong("it is longer than its buffer"))?).map_err(wrong)
    }

    fn get(&self, buffer: &Buffer<'_>) -> Result<&[u8], GltfErrorKind> {
        let index = buffer.index();
        match buffer.source() {
            // Others without a URI stand for what is packed.
            Source::Bin => {
                self.content.bin.filter(|_| index == 0).ok_or(GltfErrorKind::NoBinary { buffer: index })
            }
            Source::Uri(uri) => {
                self.read[index].get_or_init(|| self.fetch(index, uri)).as_deref().map_err(Clone::clone)
            }
        }
    }

    fn fetch(&self, buffer: usize, uri: &str) -> Result<Rc<[u8]>, GltfErrorKind> {
        if let Some(data) = uri.strip_prefix("data:") {
            let wrong = |reason| GltfErrorKind::DataUri { buffer, reason };
            let (_, text) =
                data.split_once(";base64,").ok_or_else(|| wrong("it has no `;base64,`".into()))?;
            return BASE64.decode(text).map(Rc::from).map_err(|e| wrong(e.to_string()));
        }
        let path = path_of(uri);
        if let Some(known) = self.beside.borrow().get(&path) {
            return Ok(known.clone());
        }
        let failed = |reason| GltfErrorKind::Buffer { buffer, uri: uri.to_owned(), reason };
        let bytes: Rc<[u8]> = (self.open)(&path).map_err(failed)?.into();
        self.size.set(self.size.get() + bytes.len());
        self.beside.borrow_mut().insert(path, bytes.clone());
        Ok(bytes)
    }

    /// The times of an accessor's keys, and why they can't be used.
    pub fn times(&self, accessor: &Accessor<'_>) -> Result<Result<Rc<[f64]>, &'static str>, GltfErrorKind> {
        if let Some(known) = self.times.borrow().get(&accessor.index()) {
            return Ok(Ok(known.clone()));
        }
        let numbers = self.floats::<1>(accessor)?;
        let size = numbers.len().saturating_mul(size_of::<f64>());
        if size > self.room() {
            let what = "it and others hold more times than the file has room for";
            return Err(GltfErrorKind::Accessor { accessor: accessor.index(), what });
        }
        let times = ascending(&numbers);
        if let Ok(times) = &times {
            self.take(size);
            self.times.borrow_mut().insert(accessor.index(), times.clone());
        }
        Ok(times)
    }

    /// The vectors of an accessor. Shape `[count][N]`.
    pub fn floats<const N: usize>(&self, accessor: &Accessor<'_>) -> Result<Numbers<'_, N>, GltfErrorKind> {
        let wrong = |what| GltfErrorKind::Accessor { accessor: accessor.index(), what };
        let dimensions = match accessor.dimensions() {
            Dimensions::Scalar => 1,
            Dimensions::Vec3 => 3,
            Dimensions::Vec4 => 4,
            Dimensions::Mat4 => 16,
            _ => 0,
        };
        if dimensions != N {
            return Err(wrong("it is of another shape than what it is used for"));
        }
        let part = |view: &View<'_>| {
            if let Some(unpacked) = self.unpacked(view.index()) {
                return unpacked;
            }
            let data = self.get(&view.buffer())?;
            let start = view.offset();
            start
                .checked_add(view.length())
                .and_then(|end| data.get(start..end))
                .ok_or_else(|| wrong("its part of the buffer is longer than the buffer"))
        };
        let data_type = accessor.data_type();
        let size = data_type.size();
        let count = accessor.count();
        let stride = accessor.view().and_then(|view| view.stride()).unwrap_or(N * size).max(N * size);
        // From the first byte to the end of the last vector, which need not fill its stride.
        let within = |data: &[u8], count: usize, stride: usize, size: usize| {
            let needed = count.checked_sub(1).and_then(|last| last.checked_mul(stride)?.checked_add(size));
            if count > 0 && needed.is_none_or(|needed| needed > data.len()) {
                return Err(wrong("it is longer than its part of the buffer"));
            }
            Ok(())
        };
        // Without a part of its own an accessor is zero, but for the other vectors of a sparse one.
        let data: &[u8] = match accessor.view() {
            Some(view) => {
                let data = part(&view)?.get(accessor.offset()..).unwrap_or(&[]);
                within(data, count, stride, N * size)?;
                data
            }
            None => &[],
        };
        let others = match accessor.sparse() {
            None => None,
            Some(sparse) => {
                let (indices, vectors) = (sparse.indices(), sparse.values());
                let index_type = match indices.index_type() {
                    IndexType::U8 => DataType::U8,
                    IndexType::U16 => DataType::U16,
                    IndexType::U32 => DataType::U32,
                };
                let others = Others {
                    indices: part(&indices.view())?.get(indices.offset()..).unwrap_or(&[]),
                    index_type,
                    vectors: part(&vectors.view())?.get(vectors.offset()..).unwrap_or(&[]),
                    count: sparse.count(),
                };
                within(others.indices, others.count, index_type.size(), index_type.size())?;
                within(others.vectors, others.count, N * size, N * size)?;
                let ascend = (1..others.count).all(|i| others.index(i - 1) < others.index(i));
                if !ascend || others.count.checked_sub(1).is_some_and(|last| others.index(last) >= count) {
                    return Err(wrong("the indices of its sparse vectors do not ascend to its end"));
                }
                Some(others)
            }
        };
        let looked_at = self.looked_at.get().saturating_add(count * N * size);
        self.looked_at.set(looked_at);
        let (times, besides) = LOOKED_AT;
        if looked_at > self.size.get().saturating_mul(times).saturating_add(besides) {
            return Err(wrong("it and others name far more numbers than the file holds"));
        }
        let numbers = Numbers { data, count, stride, data_type, others };
        if (0..count).any(|i| numbers.at(i).iter().any(|x| !x.is_finite())) {
            return Err(wrong("it holds a number that is not finite"));
        }
        Ok(numbers)
    }
}

/// The path of a relative URI.
fn path_of(uri: &str) -> PathBuf {
    let path = percent_encoding::percent_decode_str(uri).decode_utf8_lossy();
    Path::new(&*path).components().filter(|c| *c != Component::CurDir).collect()
}

/// The file at a relative URI.
pub fn fetch(uri: &str, open: &Open<'_>) -> Result<Vec<u8>, FileError> {
    open(&path_of(uri))
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

/// Checks the times of keys.
///
/// # Errors
/// A message if they do not ascend.
fn ascending(numbers: &Numbers<'_, 1>) -> Result<Rc<[f64]>, &'static str> {
    let time = |key: usize| numbers.at(key)[0];
    if numbers.len() == 0 {
        return Err("it has no keys");
    }
    // Before they take memory: numbers that differ are in the file.
    if time(0) < 0.0 || (1..numbers.len()).any(|key| time(key) <= time(key - 1)) {
        return Err("its times do not grow from 0 on");
    }
    Ok((0..numbers.len()).map(time).collect())
}
