//! Every function of the interface with every wrong argument that can be told from a right one: null, misaligned,
//! short, overlapping, stale and overwritten. A table says what each call has to answer.

use std::{
    collections::BTreeSet,
    ffi::{CStr, c_char, c_void},
    path::Path,
    ptr,
};

use gestus::{
    config::{GestusConfig, gestus_config_default},
    contents::*,
    database::*,
    parameter::GestusParameter,
    pose::gestus_digest,
    settings::*,
    status::{GestusBlobDetail, GestusStatus as S, gestus_error_message},
    stylizer::*,
};

const STANDARD: u32 = 0;
const SMALL: u32 = 1;
const JOINTS: usize = 21;

fn blob() -> Vec<u8> {
    std::fs::read(Path::new(env!("CARGO_MANIFEST_DIR")).join("../../tests/golden/blob-v2.gestus")).unwrap()
}

/// Memory of a stylizer or database, aligned as asked for.
struct Memory(Vec<u64>);

impl Memory {
    fn of(bytes: usize) -> Self {
        Self(vec![0; bytes.div_ceil(8) + 1])
    }
    fn pointer(&mut self) -> *mut c_void {
        self.0.as_mut_ptr().cast()
    }
}

/// A database and a stylizer, as a careful caller has them.
struct Fixture {
    blob: Vec<u8>,
    database_memory: Memory,
    stylizer_memory: Memory,
    database: *mut GestusDatabase,
    stylizer: *mut GestusStylizer,
}

impl Fixture {
    fn new() -> Self {
        let mut fixture = Self {
            blob: blob(),
            database_memory: Memory::of(gestus_database_size()),
            stylizer_memory: Memory::of(gestus_stylizer_size(STANDARD)),
            database: ptr::null_mut(),
            stylizer: ptr::null_mut(),
        };
        assert_eq!(fixture.open(), S::Ok);
        assert_eq!(fixture.init(), S::Ok);
        fixture
    }

    fn open(&mut self) -> S {
        let memory = self.database_memory.pointer();
        let (blob, length) = (self.blob.as_ptr(), self.blob.len());
        // SAFETY: every pointer is of the length that is said.
        unsafe {
            gestus_database_open(
                memory,
                gestus_database_size(),
                blob,
                length,
                ptr::null_mut(),
                &mut self.database,
            )
        }
    }

    fn init(&mut self) -> S {
        let (memory, bytes) = (self.stylizer_memory.pointer(), gestus_stylizer_size(STANDARD));
        // SAFETY: as above.
        unsafe {
            gestus_stylizer_init(memory, bytes, STANDARD, self.database, ptr::null(), &mut self.stylizer)
        }
    }
}

/// What was called, how, what it answered and what it should have.
#[derive(Default)]
struct Table {
    functions: BTreeSet<&'static str>,
    wrong: Vec<String>,
    cases: usize,
}

impl Table {
    fn case(&mut self, function: &'static str, case: &str, answer: S, expected: S) {
        self.functions.insert(function);
        self.cases += 1;
        if answer != expected {
            self.wrong.push(format!("{function}, {case}: {answer:?}, not {expected:?}"));
        }
    }

    fn end(self, at_least: usize) {
        assert!(self.wrong.is_empty(), "{}", self.wrong.join("\n"));
        assert!(self.cases >= at_least, "only {} cases were tried", self.cases);
    }
}

/// A pointer one byte further on: aligned to nothing.
fn off<T>(pointer: *mut T) -> *mut T {
    pointer.cast::<u8>().wrapping_add(1).cast()
}

macro_rules! try_all {
    ($table:ident, $name:ident, $($case:literal: ($($argument:expr),*) => $expected:expr;)*) => {
        $(
            // SAFETY: the misuse is of a kind that the function checks before it follows the pointer.
            #[allow(unused_unsafe)]
            let answer = unsafe { $name($($argument),*) };
            $table.case(stringify!($name), $case, answer, $expected);
        )*
    };
}

mod crowd;
mod settings;

#[test]
fn opening() {
    let mut table = Table::default();
    let blob = blob();
    let (data, length) = (blob.as_ptr(), blob.len());
    let mut memory = Memory::of(2 * gestus_database_size() + 64);
    let (m, size) = (memory.pointer(), gestus_database_size());
    let mut handle: *mut GestusDatabase = ptr::null_mut();
    let out: *mut *mut GestusDatabase = &mut handle;
    let mut detail = GestusBlobDetail::default();
    let d: *mut GestusBlobDetail = &mut detail;
    let none = ptr::null_mut();
    // The blob, where a database is wanted too: both in one piece of memory.
    let mut shared = Memory::of(length + size);
    let s = shared.pointer();
    // SAFETY: there is room for it.
    unsafe { ptr::copy_nonoverlapping(data, s.cast::<u8>(), length) };
    let mut damaged = blob.clone();
    damaged[length / 2] ^= 4;
    try_all! { table, gestus_database_open,
        "no memory": (ptr::null_mut(), size, data, length, d, out) => S::Null;
        "no blob": (m, size, ptr::null(), length, d, out) => S::Null;
        "no blob of no length": (m, size, ptr::null(), 0, d, out) => S::Null;
        "nowhere to answer": (m, size, data, length, d, ptr::null_mut()) => S::Null;
        "memory misaligned": (off(m), size, data, length, d, out) => S::Misaligned;
        "answer misaligned": (m, size, data, length, d, off(out)) => S::Misaligned;
        "detail misaligned": (m, size, data, length, off(d), out) => S::Misaligned;
        "memory short": (m, size - 1, data, length, d, out) => S::Short;
        "no bytes of memory": (m, 0, data, length, d, out) => S::Short;
        "blob longer than the address space": (m, size, data, usize::MAX, d, out) => S::Short;
        "memory longer than the address space": (m, usize::MAX, data, length, d, out) => S::Short;
        "blob of no length": (m, size, data, 0, d, out) => S::BlobTruncated;
        "blob cut": (m, size, data, length - 1, d, out) => S::BlobTruncated;
        "blob damaged": (m, size, damaged.as_ptr(), length, d, out) => S::BlobChecksum;
        "blob damaged, and no detail wanted": (m, size, damaged.as_ptr(), length, none, out) => S::BlobChecksum;
        "no blob at all": (m, size, d.cast(), 16, none, out) => S::BlobTruncated;
        "memory in the blob": (s, size, s.cast(), length, d, out) => S::Overlap;
        "blob's end in the memory": (s.wrapping_byte_add((length - 8) & !7), size, s.cast(), length, d, out) => S::Overlap;
        "answer in the memory": (m, size, data, length, d, m.cast()) => S::Overlap;
        "answer in the blob": (m, size, s.cast(), length, d, s.wrapping_byte_add(64).cast()) => S::Overlap;
        "detail in the memory": (m, size, data, length, m.cast(), out) => S::Overlap;
        "detail over the answer": (m, size, data, length, out.cast(), out) => S::Overlap;
    }
    assert!(handle.is_null(), "nothing was opened, so there is no handle");
    // SAFETY: there is room for one byte more.
    unsafe { ptr::copy(s.cast::<u8>(), s.cast::<u8>().add(1), length) };
    try_all! { table, gestus_database_open,
        "as it should be, at any alignment of the blob": (m, size, off(s).cast(), length, d, out) => S::Ok;
    }
    assert_eq!(handle.cast(), m, "the handle is the memory");
    let mut mark = 0;
    let k: *mut u64 = &mut mark;
    try_all! { table, gestus_database_mark,
        "no database": (ptr::null(), k) => S::Null;
        "nowhere to answer": (handle, ptr::null_mut()) => S::Null;
        "database misaligned": (off(handle), k) => S::Misaligned;
        "answer misaligned": (handle, off(k)) => S::Misaligned;
        "answer in the database": (handle, m.wrapping_byte_add(16).cast()) => S::Overlap;
        "as it should be": (handle, k) => S::Ok;
    }
    try_all! { table, gestus_database_open_marked,
        "no blob": (m, size, ptr::null(), length, mark, d, out) => S::Null;
        "memory short": (m, size - 1, data, length, mark, d, out) => S::Short;
        "memory in the blob": (s, size, s.cast(), length, mark, d, out) => S::Overlap;
        "blob cut": (m, size, data, length - 1, mark, d, out) => S::BlobTruncated;
        "blob damaged, with another mark": (m, size, damaged.as_ptr(), length, mark ^ 1, d, out) => S::BlobChecksum;
        "blob damaged since it was marked": (m, size, damaged.as_ptr(), length, mark, d, out) => S::Ok;
        "as it should be": (m, size, data, length, mark, d, out) => S::Ok;
        "as it should be, at the first start": (m, size, data, length, 0, d, out) => S::Ok;
    }
    table.end(36);
    assert_ne!(detail, GestusBlobDetail::default(), "a refused blob leaves its detail");
}

#[test]
fn making_a_stylizer() {
    let mut table = Table::default();
    let mut f = Fixture::new();
    let db: *const GestusDatabase = f.database;
    let size = gestus_stylizer_size(STANDARD);
    let mut memory = Memory::of(size);
    let m = memory.pointer();
    let mut handle: *mut GestusStylizer = ptr::null_mut();
    let out: *mut *mut GestusStylizer = &mut handle;
    let none = ptr::null();
    let mut c = GestusConfig { neighbors: 0, visits: 0, classes: 0, timing: 0, method: 0 };
    let config: *mut GestusConfig = &mut c;
    try_all! { table, gestus_config_default,
        "no such profile": (2, config) => S::Profile;
        "nowhere to answer": (STANDARD, ptr::null_mut()) => S::Null;
        "answer misaligned": (STANDARD, off(config)) => S::Misaligned;
        "as it should be": (STANDARD, config) => S::Ok;
    }
    // SAFETY: it was just filled.
    let good = unsafe { config.read() };
    let with = |change: fn(&mut GestusConfig)| {
        let mut changed = good;
        change(&mut changed);
        changed
    };
    let mut forged = Memory(f.database_memory.0.clone());
    let mut blob = f.blob.clone();
    try_all! { table, gestus_stylizer_init,
        "no memory": (ptr::null_mut(), size, STANDARD, db, none, out) => S::Null;
        "no database": (m, size, STANDARD, none.cast(), none, out) => S::Null;
        "nowhere to answer": (m, size, STANDARD, db, none, ptr::null_mut()) => S::Null;
        "memory misaligned": (off(m), size, STANDARD, db, none, out) => S::Misaligned;
        "database misaligned": (m, size, STANDARD, off(db.cast_mut()), none, out) => S::Misaligned;
        "configuration misaligned": (m, size, STANDARD, db, off(config), out) => S::Misaligned;
        "answer misaligned": (m, size, STANDARD, db, none, off(out)) => S::Misaligned;
        "memory short": (m, size - 1, STANDARD, db, none, out) => S::Short;
        "memory of the small profile": (m, gestus_stylizer_size(SMALL), STANDARD, db, none, out) => S::Short;
        "no such profile": (m, size, 2, db, none, out) => S::Profile;
        "a profile too small": (m, size, SMALL, db, none, out) => S::Joints;
        "memory is the database's": (db.cast_mut().cast(), size, STANDARD, db, none, out) => S::Overlap;
        "memory is the blob's": (f.blob.as_mut_ptr().wrapping_add(f.blob.as_ptr().align_offset(8)).cast(), size, STANDARD, db, none, out) => S::Overlap;
        "configuration in the memory": (m, size, STANDARD, db, m.cast(), out) => S::Overlap;
        "answer in the memory": (m, size, STANDARD, db, none, m.cast()) => S::Overlap;
        "answer in the database": (m, size, STANDARD, db, none, db.cast_mut().cast()) => S::Overlap;
        "a database that was moved": (m, size, STANDARD, forged.pointer().cast(), none, out) => S::Handle;
        "a stylizer for a database": (m, size, STANDARD, f.stylizer.cast(), none, out) => S::Handle;
        "a blob for a database": (m, size, STANDARD, blob.as_mut_ptr().wrapping_add(blob.as_ptr().align_offset(8)).cast(), none, out) => S::Handle;
        "no neighbors": (m, size, STANDARD, db, &with(|c| c.neighbors = 0), out) => S::Neighbors;
        "more neighbors than there is room": (m, size, STANDARD, db, &with(|c| c.neighbors = 41), out) => S::Neighbors;
        "neighbors beyond any number": (m, size, STANDARD, db, &with(|c| c.neighbors = 65_576), out) => S::Parameter;
        "no visits": (m, size, STANDARD, db, &with(|c| c.visits = 0), out) => S::Parameter;
        "nine classes": (m, size, STANDARD, db, &with(|c| c.classes = 9), out) => S::Parameter;
        "classes beyond any number": (m, size, STANDARD, db, &with(|c| c.classes = 257), out) => S::Parameter;
        "no such timing": (m, size, STANDARD, db, &with(|c| c.timing = 2), out) => S::Parameter;
        "no such method": (m, size, STANDARD, db, &with(|c| c.method = 4), out) => S::Parameter;
    }
    assert!(handle.is_null());
    try_all! { table, gestus_stylizer_init,
        "as it should be": (m, size, STANDARD, db, &good, out) => S::Ok;
    }
    assert_eq!(handle.cast(), m);
    assert_eq!((gestus_stylizer_size(2), gestus_stylizer_alignment(2)), (0, 0));
    table.end(29);
}

#[test]
fn asking_a_database() {
    let mut table = Table::default();
    let f = Fixture::new();
    let db = f.database;
    let constant: *const GestusDatabase = db;
    let own: *mut c_void = db.wrapping_byte_add(16).cast();
    let inside: *mut c_void = f.blob.as_ptr().wrapping_add(f.blob.as_ptr().align_offset(8)).cast_mut().cast();
    let mut counts = std::mem::MaybeUninit::<GestusCounts>::uninit();
    let mut joint = std::mem::MaybeUninit::<GestusJoint>::uninit();
    let mut class = std::mem::MaybeUninit::<GestusClass>::uninit();
    let (c, j, k) = (counts.as_mut_ptr(), joint.as_mut_ptr(), class.as_mut_ptr());
    try_all! { table, gestus_database_counts,
        "no database": (ptr::null(), c) => S::Null;
        "nowhere to answer": (constant, ptr::null_mut()) => S::Null;
        "database misaligned": (off(db), c) => S::Misaligned;
        "answer misaligned": (constant, off(c)) => S::Misaligned;
        "a stylizer for a database": (f.stylizer.cast(), c) => S::Handle;
        "answer in the database": (constant, own.cast()) => S::Overlap;
        "answer in the blob": (constant, inside.cast()) => S::Overlap;
        "as it should be": (constant, c) => S::Ok;
    }
    try_all! { table, gestus_database_joint,
        "no database": (ptr::null(), 0, j) => S::Null;
        "nowhere to answer": (constant, 0, ptr::null_mut()) => S::Null;
        "answer misaligned": (constant, 0, off(j)) => S::Misaligned;
        "no such joint": (constant, JOINTS as u32, j) => S::NotFound;
        "joint beyond any number": (constant, u32::MAX, j) => S::NotFound;
        "answer in the database": (constant, 0, own.cast()) => S::Overlap;
        "a stylizer for a database": (f.stylizer.cast(), 0, j) => S::Handle;
        "as it should be": (constant, 20, j) => S::Ok;
    }
    try_all! { table, gestus_database_class,
        "no database": (ptr::null(), 0, k) => S::Null;
        "nowhere to answer": (constant, 0, ptr::null_mut()) => S::Null;
        "answer misaligned": (constant, 0, off(k)) => S::Misaligned;
        "no such class": (constant, 6, k) => S::NotFound;
        "answer in the blob": (constant, 0, inside.cast()) => S::Overlap;
        "a stylizer for a database": (f.stylizer.cast(), 0, k) => S::Handle;
        "as it should be": (constant, 5, k) => S::Ok;
    }
    // SAFETY: they were filled.
    let (counts, joint) = unsafe { (counts.assume_init(), joint.assume_init()) };
    assert_eq!((counts.joints, counts.styles, counts.actions, counts.classes), (21, 3, 2, 6));
    assert!(joint.parent >= 0 && joint.parent < 20);

    let mut text = [0 as c_char; 64];
    let t = text.as_mut_ptr();
    let mut length = 0usize;
    let l: *mut usize = &mut length;
    try_all! { table, gestus_database_name,
        "no database": (ptr::null(), 0, 0, t, 64, l) => S::Null;
        "no text": (constant, 0, 0, ptr::null_mut(), 64, l) => S::Null;
        "length misaligned": (constant, 0, 0, t, 64, off(l)) => S::Misaligned;
        "no such kind": (constant, 4, 0, t, 64, l) => S::NotFound;
        "no such joint": (constant, 0, 21, t, 64, l) => S::NotFound;
        "no room": (constant, 0, 0, t, 0, l) => S::Short;
        "no room for the zero": (constant, 0, 0, t, length, l) => S::Short;
        "text longer than the address space": (constant, 0, 0, t, usize::MAX, l) => S::Short;
        "text in the blob": (constant, 0, 0, inside.cast(), 64, l) => S::Overlap;
        "text in the database": (constant, 0, 0, own.cast(), 64, l) => S::Overlap;
        "length in the database": (constant, 0, 0, t, 64, own.cast()) => S::Overlap;
        "length in the text": (constant, 0, 0, l.cast(), 64, l) => S::Overlap;
        "a stylizer for a database": (f.stylizer.cast(), 0, 0, t, 64, l) => S::Handle;
        "how long is it?": (constant, 0, 0, ptr::null_mut(), 0, l) => S::Short;
        "as it should be": (constant, 0, 0, t, 64, ptr::null_mut()) => S::Ok;
    }
    // SAFETY: a name with its zero was copied.
    let name = unsafe { CStr::from_ptr(t) }.to_str().unwrap().to_owned();
    assert_eq!((name.to_lowercase().as_str(), length), ("hips", 4));

    let mut index = 77u32;
    let i: *mut u32 = &mut index;
    let long = [b'x' as c_char; 300];
    try_all! { table, gestus_database_find,
        "no database": (ptr::null(), 0, t, i) => S::Null;
        "no name": (constant, 0, ptr::null(), i) => S::Null;
        "nowhere to answer": (constant, 0, t, ptr::null_mut()) => S::Null;
        "answer misaligned": (constant, 0, t, off(i)) => S::Misaligned;
        "no such kind": (constant, 9, t, i) => S::NotFound;
        "no such name": (constant, 0, c"tail".as_ptr(), i) => S::NotFound;
        "no name at all": (constant, 0, c"".as_ptr(), i) => S::NotFound;
        "not UTF-8": (constant, 0, c"\xff".as_ptr(), i) => S::Text;
        "too long": (constant, 0, long.as_ptr(), i) => S::Text;
        "answer in the database": (constant, 0, t, own.cast()) => S::Overlap;
        "a stylizer for a database": (f.stylizer.cast(), 0, t, i) => S::Handle;
        "as it should be": (constant, 0, t, i) => S::Ok;
    }
    assert_eq!(index, 0);
    table.end(50);
}

#[test]
fn stepping() {
    let mut table = Table::default();
    let f = Fixture::new();
    let s = f.stylizer;
    let null: *mut GestusStylizer = ptr::null_mut();
    let database: *mut GestusStylizer = f.database.cast();
    let own: *mut f32 = s.wrapping_byte_add(64).cast();
    let inside: *mut f32 = f.blob.as_ptr().wrapping_add(f.blob.as_ptr().align_offset(8)).cast_mut().cast();
    let mut numbers = vec![0f32; 512];
    let n = numbers.as_mut_ptr();
    // Position, rotations; the same of the output; and 60 more, for the report.
    let (p, r, op, or) = (n, n.wrapping_add(4), n.wrapping_add(100), n.wrapping_add(104));
    for joint in 0..JOINTS {
        // SAFETY: within the numbers.
        unsafe { r.add(4 * joint + 3).write(1.0) };
    }
    let mut report = GestusReport::default();
    let g: *mut GestusReport = &mut report;
    try_all! { table, gestus_stylizer_step,
        "no stylizer": (null, p, r, JOINTS, op, or, g) => S::Null;
        "no position": (s, ptr::null(), r, JOINTS, op, or, g) => S::Null;
        "no rotations": (s, p, ptr::null(), JOINTS, op, or, g) => S::Null;
        "nowhere for the position": (s, p, r, JOINTS, ptr::null_mut(), or, g) => S::Null;
        "nowhere for the rotations": (s, p, r, JOINTS, op, ptr::null_mut(), g) => S::Null;
        "stylizer misaligned": (off(s), p, r, JOINTS, op, or, g) => S::Misaligned;
        "position misaligned": (s, off(p), r, JOINTS, op, or, g) => S::Misaligned;
        "rotations misaligned": (s, p, off(r), JOINTS, op, or, g) => S::Misaligned;
        "position's place misaligned": (s, p, r, JOINTS, off(op), or, g) => S::Misaligned;
        "rotations' place misaligned": (s, p, r, JOINTS, op, off(or), g) => S::Misaligned;
        "report misaligned": (s, p, r, JOINTS, op, or, off(g)) => S::Misaligned;
        "a joint too few": (s, p, r, JOINTS - 1, op, or, g) => S::Short;
        "no joints": (s, p, r, 0, op, or, g) => S::Short;
        "joints beyond the address space": (s, p, r, usize::MAX, op, or, g) => S::Short;
        "joints beyond the address space, by a little": (s, p, r, usize::MAX / 16 + 1, op, or, g) => S::Short;
        "position's place in the rotations' place": (s, p, r, JOINTS, or.wrapping_add(8), or, g) => S::Overlap;
        "position in the stylizer": (s, own, r, JOINTS, op, or, g) => S::Overlap;
        "rotations in the stylizer": (s, p, own, JOINTS, op, or, g) => S::Overlap;
        "position's place in the stylizer": (s, p, r, JOINTS, own, or, g) => S::Overlap;
        "rotations' place in the stylizer": (s, p, r, JOINTS, op, own, g) => S::Overlap;
        "report in the stylizer": (s, p, r, JOINTS, op, or, own.cast()) => S::Overlap;
        "position's place in the blob": (s, p, r, JOINTS, inside, or, g) => S::Overlap;
        "rotations' place in the blob": (s, p, r, JOINTS, op, inside, g) => S::Overlap;
        "report in the blob": (s, p, r, JOINTS, op, or, inside.cast()) => S::Overlap;
        "report in the position": (s, p, r, JOINTS, op, or, p.cast()) => S::Overlap;
        "report in the rotations": (s, p, r, JOINTS, op, or, r.wrapping_add(16).cast()) => S::Overlap;
        "report in the position's place": (s, p, r, JOINTS, op, or, op.wrapping_sub(2).cast()) => S::Overlap;
        "report in the rotations' place": (s, p, r, JOINTS, op, or, or.cast()) => S::Overlap;
        "a database for a stylizer": (database, p, r, JOINTS, op, or, g) => S::Handle;
        "as it should be": (s, p, r, JOINTS, op, or, g) => S::Ok;
        "without a report": (s, p, r, JOINTS, op, or, ptr::null_mut()) => S::Ok;
    }
    assert!(report.class_count > 0 && report.degraded & GESTUS_DEGRADED_INPUT == 0, "{report:?}");

    let mut digest = 0u32;
    let d: *mut u32 = &mut digest;
    try_all! { table, gestus_digest,
        "no digest": (ptr::null_mut(), p, r, JOINTS, 0.0) => S::Null;
        "no position": (d, ptr::null(), r, JOINTS, 0.0) => S::Null;
        "no rotations": (d, p, ptr::null(), JOINTS, 0.0) => S::Null;
        "digest misaligned": (off(d), p, r, JOINTS, 0.0) => S::Misaligned;
        "position misaligned": (d, off(p), r, JOINTS, 0.0) => S::Misaligned;
        "rotations misaligned": (d, p, off(r), JOINTS, 0.0) => S::Misaligned;
        "no joints": (d, p, r, 0, 0.0) => S::Short;
        "more joints than there can be": (d, p, r, 65, 0.0) => S::Short;
        "digest in the position": (p.wrapping_add(1).cast(), p, r, JOINTS, 0.0) => S::Overlap;
        "digest in the rotations": (r.cast(), p, r, JOINTS, 0.0) => S::Overlap;
        "as it should be": (d, p, r, JOINTS, 0.0) => S::Ok;
    }
    assert_ne!(digest, 0);
    table.end(42);
}

#[test]
fn before_the_first_pose_the_answer_is_no_rotation_at_all() {
    let f = Fixture::new();
    let (mut position, mut rotations) = ([f32::NAN, 1.0, 0.0], [[0f32; 4]; JOINTS]);
    let (p, r) = (position.as_mut_ptr(), rotations.as_mut_ptr().cast::<f32>());
    let mut report = GestusReport::default();
    // SAFETY: the arrays have as many numbers; the output takes the input's place.
    let answer = unsafe { gestus_stylizer_step(f.stylizer, p, r, JOINTS, p, r, &mut report) };
    assert_eq!((answer, report.degraded), (S::Ok, GESTUS_DEGRADED_INPUT));
    assert_eq!((position, rotations), ([0.0; 3], [[0.0, 0.0, 0.0, 1.0]; JOINTS]));
}

#[test]
fn every_status_has_a_message_and_every_number_an_answer() {
    let text = |status: u32| {
        // SAFETY: it never answers null, and its texts end with a zero.
        unsafe { CStr::from_ptr(gestus_error_message(status)) }.to_str().unwrap()
    };
    let mut seen = BTreeSet::new();
    for status in 0..64 {
        seen.insert(text(status));
    }
    // 29 statuses have a text each, and all other numbers share one.
    assert_eq!(seen.len(), 30);
    assert_eq!(text(S::Overlap as u32), "two arguments overlap: give each its own memory");
    assert_eq!(text(u32::MAX), text(64), "a number without a status has the same text as any other");
    // A body of 60 joints ended at a profile that the library did not have, and nothing said where to find it.
    for status in [S::Joints, S::Classes, S::Profile] {
        assert!(
            text(status as u32).contains("feature") && text(status as u32).contains("`large`"),
            "{status:?}"
        );
    }
    // Both limits of a mix are in the text: those of the body and of a joint group.
    assert!(text(S::Unknown as u32).contains("parameter"));
    assert!(
        text(S::Weights as u32).contains("1 to 32 styles")
            && text(S::Weights as u32).contains("1 to 3 for a joint group")
    );
    // SAFETY: as above.
    let version = unsafe { CStr::from_ptr(gestus_version()) }.to_str().unwrap();
    assert_eq!(version, env!("CARGO_PKG_VERSION"));
    assert_eq!(gestus_blob_version(), 2);
    assert_eq!((gestus_database_alignment(), gestus_stylizer_alignment(STANDARD)), (8, 8));
}

/// A function that is added to the interface and not to these tables is found here.
#[test]
fn no_function_is_left_out() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR"));
    let header = std::fs::read_to_string(folder.join("include/gestus.h")).unwrap();
    let tests = [include_str!("main.rs"), include_str!("crowd.rs"), include_str!("settings.rs")].concat();
    let mut functions = BTreeSet::new();
    for line in header.lines().filter(|l| !l.starts_with("//")) {
        if let Some(at) = line.find("gestus_") {
            let name: String = line[at..].chars().take_while(|c| c.is_alphanumeric() || *c == '_').collect();
            functions.insert(name);
        }
    }
    assert!(functions.len() >= 25, "{functions:?}");
    for function in functions {
        assert!(tests.matches(function.as_str()).count() >= 1, "{function} is in no table of these files");
    }
}
