//! Settings of a stylizer.

use super::*;

#[test]
fn settings() {
    let mut table = Table::default();
    let mut f = Fixture::new();
    let s = f.stylizer;
    let (null, bad): (*mut GestusStylizer, *mut GestusStylizer) = (ptr::null_mut(), off(s));
    let database: *mut GestusStylizer = f.database.cast();
    let own = s.wrapping_byte_add(64);
    let (one, weight) = ([1u16, 2], [1.0f32, 0.5]);
    try_all! { table, gestus_stylizer_set_style,
        "no stylizer": (null, one.as_ptr(), weight.as_ptr(), 2) => S::Null;
        "no styles": (s, ptr::null(), weight.as_ptr(), 2) => S::Null;
        "no weights": (s, one.as_ptr(), ptr::null(), 2) => S::Null;
        "stylizer misaligned": (bad, one.as_ptr(), weight.as_ptr(), 2) => S::Misaligned;
        "styles misaligned": (s, off(one.as_ptr().cast_mut()), weight.as_ptr(), 1) => S::Misaligned;
        "weights misaligned": (s, one.as_ptr(), off(weight.as_ptr().cast_mut()), 1) => S::Misaligned;
        "none": (s, one.as_ptr(), weight.as_ptr(), 0) => S::Weights;
        "more than there can be": (s, one.as_ptr(), weight.as_ptr(), usize::MAX) => S::Weights;
        "no such style": (s, [3].as_ptr(), weight.as_ptr(), 1) => S::Unknown;
        "negative": (s, one.as_ptr(), [-1.0].as_ptr(), 1) => S::Weights;
        "not a number": (s, one.as_ptr(), [f32::NAN].as_ptr(), 1) => S::Weights;
        "all zero": (s, one.as_ptr(), [0.0, 0.0].as_ptr(), 2) => S::Weights;
        "styles in the stylizer": (s, own.cast(), weight.as_ptr(), 1) => S::Overlap;
        "weights in the stylizer": (s, one.as_ptr(), own.cast(), 1) => S::Overlap;
        "a database for a stylizer": (database, one.as_ptr(), weight.as_ptr(), 2) => S::Handle;
        "as it should be": (s, one.as_ptr(), weight.as_ptr(), 2) => S::Ok;
    }
    let mut name = [0 as c_char; 64];
    // SAFETY: as it should be.
    let named = unsafe { gestus_database_name(f.database, 1, 2, name.as_mut_ptr(), 64, ptr::null_mut()) };
    assert_eq!(named, S::Ok);
    let long = [b'x' as c_char; 300];
    try_all! { table, gestus_stylizer_set_group_style,
        "no stylizer": (null, 1, one.as_ptr(), weight.as_ptr(), 2) => S::Null;
        "no stylizer and no styles": (null, 1, ptr::null(), ptr::null(), 0) => S::Null;
        "no styles": (s, 1, ptr::null(), weight.as_ptr(), 2) => S::Null;
        "no weights": (s, 1, one.as_ptr(), ptr::null(), 2) => S::Null;
        "stylizer misaligned": (bad, 1, one.as_ptr(), weight.as_ptr(), 2) => S::Misaligned;
        "no such group": (s, 8, one.as_ptr(), weight.as_ptr(), 2) => S::Unknown;
        "a group beyond any number": (s, u32::MAX, one.as_ptr(), weight.as_ptr(), 2) => S::Unknown;
        "no such style": (s, 1, [3].as_ptr(), weight.as_ptr(), 1) => S::Unknown;
        "more than a group's own": (s, 1, [0, 1, 2, 0].as_ptr(), [1.0; 4].as_ptr(), 4) => S::Weights;
        "all zero": (s, 1, one.as_ptr(), [0.0, 0.0].as_ptr(), 2) => S::Weights;
        "a database for a stylizer": (database, 1, one.as_ptr(), weight.as_ptr(), 2) => S::Handle;
        "as it should be": (s, 1, one.as_ptr(), weight.as_ptr(), 2) => S::Ok;
        "taken back": (s, 1, ptr::null(), ptr::null(), 0) => S::Ok;
    }
    try_all! { table, gestus_stylizer_set_style_name,
        "no stylizer": (null, name.as_ptr()) => S::Null;
        "no name": (s, ptr::null()) => S::Null;
        "stylizer misaligned": (bad, name.as_ptr()) => S::Misaligned;
        "no such style": (s, c"backwards".as_ptr()) => S::NotFound;
        "not UTF-8": (s, c"\xc3".as_ptr()) => S::Text;
        "too long": (s, long.as_ptr()) => S::Text;
        "a database for a stylizer": (database, name.as_ptr()) => S::Handle;
        "as it should be": (s, name.as_ptr()) => S::Ok;
    }
    try_all! { table, gestus_stylizer_set_action,
        "no stylizer": (null, 0) => S::Null;
        "stylizer misaligned": (bad, 0) => S::Misaligned;
        "no such action": (s, 2) => S::Unknown;
        "an action beyond any number": (s, 65_536) => S::Unknown;
        "a database for a stylizer": (database, 0) => S::Handle;
        "as it should be": (s, 1) => S::Ok;
        "taken back": (s, -1) => S::Ok;
    }
    try_all! { table, gestus_stylizer_set_input_style,
        "no stylizer": (null, 0) => S::Null;
        "stylizer misaligned": (bad, 0) => S::Misaligned;
        "no such style": (s, 3) => S::Unknown;
        "a style beyond any number": (s, i32::MAX) => S::Unknown;
        "a database for a stylizer": (database, 0) => S::Handle;
        "as it should be": (s, 2) => S::Ok;
        "taken back": (s, i32::MIN) => S::Ok;
    }
    try_all! { table, gestus_stylizer_set_labels,
        "no stylizer": (null, 0, 0) => S::Null;
        "stylizer misaligned": (bad, 0, 0) => S::Misaligned;
        "no such action": (s, 2, 0) => S::Unknown;
        "no such style": (s, 0, 3) => S::Unknown;
        "a style beyond any number": (s, 0, i32::MAX) => S::Unknown;
        "a database for a stylizer": (database, 0, 0) => S::Handle;
        "as it should be": (s, 1, 2) => S::Ok;
        "taken back": (s, -1, -1) => S::Ok;
    }
    try_all! { table, gestus_stylizer_set_mask,
        "no stylizer": (null, 0, 0) => S::Null;
        "stylizer misaligned": (bad, 0, 0) => S::Misaligned;
        "no such group": (s, 8, 0) => S::Unknown;
        "a group beyond any number": (s, 65_536, 0) => S::Unknown;
        "a database for a stylizer": (database, 1, 0) => S::Handle;
        "as it should be": (s, 1, 0) => S::Ok;
        "taken back": (s, 1, u32::MAX) => S::Ok;
    }
    try_all! { table, gestus_stylizer_set_strength,
        "no stylizer": (null, 0, 1.0) => S::Null;
        "stylizer misaligned": (bad, 0, 1.0) => S::Misaligned;
        "no such group": (s, 8, 1.0) => S::Unknown;
        "a group beyond any number": (s, u32::MAX, 1.0) => S::Unknown;
        "not a number": (s, 0, f32::NAN) => S::Parameter;
        "too much": (s, 0, 2.1) => S::Parameter;
        "a database for a stylizer": (database, 0, 1.0) => S::Handle;
        "as it should be": (s, 0, 0.5) => S::Ok;
    }
    try_all! { table, gestus_stylizer_set_effort,
        "no stylizer": (null, 0.0, 0.0, 0.0) => S::Null;
        "stylizer misaligned": (bad, 0.0, 0.0, 0.0) => S::Misaligned;
        "not a number": (s, 0.0, f32::NAN, 0.0) => S::Parameter;
        "no dial": (s, 0.0, 0.0, 0.0) => S::NoDial;
        "a database for a stylizer": (database, 0.0, 0.0, 0.0) => S::Handle;
    }
    try_all! { table, gestus_stylizer_set_visits,
        "no stylizer": (null, 100) => S::Null;
        "stylizer misaligned": (bad, 100) => S::Misaligned;
        "too few": (s, 63) => S::Parameter;
        "too many": (s, 449) => S::Parameter;
        "visits beyond any number": (s, 65_636) => S::Parameter;
        "a database for a stylizer": (database, 100) => S::Handle;
        "as it should be": (s, 100) => S::Ok;
    }
    let (rho, limit) = (GestusParameter::Rho as u32, GestusParameter::SpeedLimit as u32);
    try_all! { table, gestus_stylizer_set_parameter,
        "no stylizer": (null, rho, 0.5) => S::Null;
        "stylizer misaligned": (bad, rho, 0.5) => S::Misaligned;
        "no such parameter": (s, 99, 0.5) => S::Unknown;
        "a parameter beyond any number": (s, 65_536 + rho, 0.5) => S::Unknown;
        "not a number": (s, rho, f32::NAN) => S::Parameter;
        "too much": (s, rho, 1.1) => S::Parameter;
        "no whole number": (s, GestusParameter::K as u32, 7.5) => S::Parameter;
        "more than the profile takes": (s, GestusParameter::K as u32, 41.0) => S::Neighbors;
        "a database for a stylizer": (database, rho, 0.5) => S::Handle;
        "as it should be": (s, limit, 0.0) => S::Ok;
    }
    let mut value = 0.0f32;
    let v: *mut f32 = &mut value;
    let in_blob = f.blob.as_ptr().wrapping_add(f.blob.as_ptr().align_offset(8)).cast_mut().cast();
    try_all! { table, gestus_stylizer_parameter,
        "no stylizer": (null, rho, v) => S::Null;
        "stylizer misaligned": (bad, rho, v) => S::Misaligned;
        "nowhere to put it": (s, rho, ptr::null_mut()) => S::Null;
        "a place misaligned": (s, rho, v.cast::<u8>().wrapping_add(1).cast()) => S::Misaligned;
        "a place in the stylizer": (s, rho, s.cast()) => S::Overlap;
        "a place in the blob": (s, rho, in_blob) => S::Overlap;
        "no such parameter": (s, 99, v) => S::Unknown;
        "a parameter beyond any number": (s, 65_536 + rho, v) => S::Unknown;
        "a database for a stylizer": (database, rho, v) => S::Handle;
        "as it should be": (s, rho, v) => S::Ok;
    }
    assert_eq!(value, 0.7, "the shipped rho, after all that was refused");
    try_all! { table, gestus_stylizer_reset,
        "no stylizer": (null) => S::Null;
        "stylizer misaligned": (bad) => S::Misaligned;
        "a database for a stylizer": (database) => S::Handle;
        "as it should be": (s) => S::Ok;
    }
    // Run over from either side: the first and the last word of the stylizer.
    let words = gestus_stylizer_size(STANDARD) / 8;
    for word in [0, words - 1] {
        f.stylizer_memory.0[word] ^= 1 << 40 | 1;
        try_all! { table, gestus_stylizer_reset, "run over": (s) => S::Handle; }
        f.stylizer_memory.0[word] ^= 1 << 40 | 1;
    }
    let mut moved = Memory(f.stylizer_memory.0.clone());
    let moved: *mut GestusStylizer = moved.pointer().cast();
    try_all! { table, gestus_stylizer_reset, "moved": (moved) => S::Handle; }
    try_all! { table, gestus_stylizer_close,
        "no stylizer": (null) => S::Null;
        "stylizer misaligned": (bad) => S::Misaligned;
        "a database for a stylizer": (database) => S::Handle;
        "as it should be": (s) => S::Ok;
        "a second time": (s) => S::Handle;
    }
    try_all! { table, gestus_stylizer_reset, "stale": (s) => S::Handle; }
    try_all! { table, gestus_database_close,
        "no database": (ptr::null_mut()) => S::Null;
        "database misaligned": (off(f.database)) => S::Misaligned;
        "a stale stylizer": (s.cast()) => S::Handle;
        "as it should be": (f.database) => S::Ok;
        "a second time": (f.database) => S::Handle;
    }
    table.end(70);
}
