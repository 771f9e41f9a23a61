//! Status codes and their messages.

use core::ffi::{CStr, c_char};

use gestus_core::{BlobError, ConfigError, MAX_GROUP_STYLES, blob::layout::MAX_STYLES};

/// The result of a function. With any status but `GESTUS_STATUS_OK` nothing was changed, unless the function's docs say
/// so.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum GestusStatus {
    /// Success.
    Ok = 0,
    /// A pointer is null that must not be null.
    Null = 1,
    /// A pointer is not aligned for its type.
    Misaligned = 2,
    /// Memory or an array is shorter than needed, or longer than the address space.
    Short = 3,
    /// Two arguments overlap that must not overlap.
    Overlap = 4,
    /// The handle is invalid: it was closed, overwritten, moved, or never made.
    Handle = 5,
    /// The profile is not one of `GestusProfile`, or this library was built without it.
    Profile = 6,
    /// An index or kind is out of range, or a name is unknown.
    NotFound = 7,
    /// A string is not UTF-8, or longer than `GESTUS_NAME_BYTES` with its final zero.
    Text = 8,
    /// The blob has fewer or more bytes than its header says: copy all of it again.
    BlobTruncated = 16,
    /// The first bytes are not those of a Gestus blob.
    BlobMagic = 17,
    /// The blob has another format version: build it again.
    BlobVersion = 18,
    /// A checksum is wrong: the blob was damaged.
    BlobChecksum = 19,
    /// A section is missing, duplicate or misplaced.
    BlobSection = 20,
    /// A section's length does not agree with the header's counts.
    BlobLength = 21,
    /// A number in a section is out of its range.
    BlobValue = 22,
    /// A reserved byte is not zero: the blob is newer than this library, or damaged.
    BlobReserved = 23,
    /// The manifest can't be decoded.
    BlobManifest = 24,
    /// The blob is refused for a reason without a status of its own.
    BlobOther = 31,
    /// The database has more joints than the profile's capacity.
    Joints = 32,
    /// The database has more classes than the profile's capacity.
    Classes = 33,
    /// The number of neighbors is 0, or more than the profile's capacity.
    Neighbors = 34,
    /// No style, action, joint group or parameter has that number.
    Unknown = 35,
    /// The database does not have the input's action in the input's style.
    NoClass = 36,
    /// A weight is negative, not finite or above 1e6, or their sum is not above 1e-6; or there are more styles than 32, or
    /// than 3 for a joint group.
    Weights = 37,
    /// A parameter is not finite or out of its range.
    Parameter = 38,
    /// The database lacks the data that the method needs (frames, linear models, statistics or phase tables), the
    /// library was built without the method, or the method does not support the setting: linear models support one
    /// style for the whole body only.
    Method = 39,
    /// The database has no effort dial.
    NoDial = 40,
    /// The setting is refused for a reason without a status of its own.
    SettingOther = 47,
}

impl GestusStatus {
    /// The status as a result: an error unless it is `Ok`.
    pub(crate) fn result(self) -> StatusResult {
        if self == Self::Ok { Ok(()) } else { Err(self) }
    }

    const ALL: [Self; 29] = {
        use GestusStatus as S;
        [
            S::Ok,
            S::Null,
            S::Misaligned,
            S::Short,
            S::Overlap,
            S::Handle,
            S::Profile,
            S::NotFound,
            S::Text,
            S::BlobTruncated,
            S::BlobMagic,
            S::BlobVersion,
            S::BlobChecksum,
            S::BlobSection,
            S::BlobLength,
            S::BlobValue,
            S::BlobReserved,
            S::BlobManifest,
            S::BlobOther,
            S::Joints,
            S::Classes,
            S::Neighbors,
            S::Unknown,
            S::NoClass,
            S::Weights,
            S::Parameter,
            S::Method,
            S::NoDial,
            S::SettingOther,
        ]
    };

    const fn message(self) -> &'static CStr {
        match self {
            Self::Ok => c"no error",
            Self::Null => c"a pointer is null",
            Self::Misaligned => {
                c"a pointer is not aligned: ask for the alignment, or use the type that it points at"
            }
            Self::Short => c"memory or an array is too short: ask for the size",
            Self::Overlap => c"two arguments overlap: give each its own memory",
            Self::Handle => c"the handle is invalid: it was closed, overwritten, moved, or never made",
            Self::Profile => c"this library has no such profile: build it with the profile's feature, `standard`, `small` or `large`",
            Self::NotFound => c"no joint, style, action or group has that name or number",
            Self::Text => c"a string is not UTF-8, or too long",
            Self::BlobTruncated => c"the blob's length is not the one in its header: copy all of it again",
            Self::BlobMagic => c"this is not a Gestus blob, or not the place where one begins: build one with `gestus build`",
            Self::BlobVersion => {
                c"the blob has another format version: build it again with the builder of this version"
            }
            Self::BlobChecksum => c"a checksum of the blob is wrong: it was damaged, copy it again",
            Self::BlobSection => c"a section of the blob is missing, duplicate or misplaced: build it again",
            Self::BlobLength => {
                c"a section's length does not agree with the blob's header: build it again"
            }
            Self::BlobValue => c"a number in the blob is out of its range: build it again",
            Self::BlobReserved => {
                c"a reserved byte of the blob is not zero: it is newer than this library, or damaged"
            }
            Self::BlobManifest => c"the blob's manifest can't be decoded: build it again",
            Self::BlobOther => c"the blob is refused: build it again with the builder of this version",
            Self::Joints => c"the database has more joints than the profile's capacity: use a larger profile, such as GESTUS_PROFILE_LARGE of a library built with the feature `large`",
            Self::Classes => c"the database has more classes than the profile's capacity: use a larger profile, such as GESTUS_PROFILE_LARGE of a library built with the feature `large`",
            Self::Neighbors => c"the number of neighbors is 0 or more than the profile's capacity",
            Self::Unknown => c"no style, action, joint group or parameter has that number",
            Self::NoClass => {
                c"the database does not have that action in that style: set one of the labels, or neither"
            }
            Self::Weights => c"weights must be from 0 to 1e6 and their sum above 1e-6, for 1 to 32 styles, or 1 to 3 for a joint group",
            Self::Parameter => c"a parameter is not finite or out of its range",
            Self::Method => c"the database lacks the data that the method needs (choose another method, or build the database with the models), or the library was built without the method, or the method does not support the setting (linear models style the whole body only)",
            Self::NoDial => c"the database has no effort dial: build it again with two styles or more and `--effort`",
            Self::SettingOther => c"the setting is refused",
        }
    }
}

/// The message of a status, in English, as a zero-terminated string that stays valid forever. Never null: unknown
/// numbers have a message too.
#[unsafe(no_mangle)]
pub extern "C" fn gestus_error_message(status: u32) -> *const c_char {
    let known = GestusStatus::ALL.iter().find(|s| **s as u32 == status);
    known.map_or(c"unknown status", |s| s.message()).as_ptr()
}

/// Where in a blob the error is. Fields that do not apply are 0.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct GestusBlobDetail {
    /// Number of bytes, or the format version, that is expected.
    pub need: u32,
    /// Number of bytes, or the format version, of the blob.
    pub have: u32,
    /// Number of the section, as in docs/FORMAT.md; 0 is the header.
    pub section: u32,
    /// Record of the section.
    pub record: u32,
}

/// The status and detail of a blob's error.
pub(crate) fn of_blob(error: BlobError) -> (GestusStatus, GestusBlobDetail) {
    use GestusStatus as S;
    let none = GestusBlobDetail::default();
    match error {
        BlobError::Truncated { need, have } => (S::BlobTruncated, GestusBlobDetail { need, have, ..none }),
        BlobError::Magic => (S::BlobMagic, none),
        BlobError::Version { need, have } => {
            (S::BlobVersion, GestusBlobDetail { need: need.into(), have: have.into(), ..none })
        }
        BlobError::Checksum { section } => {
            (S::BlobChecksum, GestusBlobDetail { section: section.into(), ..none })
        }
        BlobError::Section { section } => {
            (S::BlobSection, GestusBlobDetail { section: section.into(), ..none })
        }
        BlobError::Length { section, need, have } => {
            (S::BlobLength, GestusBlobDetail { need, have, section: section.into(), record: 0 })
        }
        BlobError::Value { section, record } => {
            (S::BlobValue, GestusBlobDetail { section: section.into(), record, ..none })
        }
        BlobError::Reserved { section } => {
            (S::BlobReserved, GestusBlobDetail { section: section.into(), ..none })
        }
        BlobError::Manifest => (S::BlobManifest, none),
        _ => (S::BlobOther, none),
    }
}

// The limits in the docs and message of `Weights`.
const _: () = assert!(MAX_STYLES == 32 && MAX_GROUP_STYLES == 3);

impl From<ConfigError> for GestusStatus {
    fn from(error: ConfigError) -> Self {
        match error {
            ConfigError::Joints { .. } => Self::Joints,
            ConfigError::Classes { .. } => Self::Classes,
            ConfigError::Neighbors { .. } => Self::Neighbors,
            ConfigError::Unknown { .. } => Self::Unknown,
            ConfigError::NoClass => Self::NoClass,
            ConfigError::Weights => Self::Weights,
            ConfigError::OutOfRange | ConfigError::Parameter { .. } => Self::Parameter,
            ConfigError::Method | ConfigError::WholeBody => Self::Method,
            ConfigError::NoDial => Self::NoDial,
            _ => Self::SettingOther,
        }
    }
}

/// Result of a function's body, so that `?` returns the first failure's status.
pub(crate) type StatusResult<T = ()> = Result<T, GestusStatus>;

/// The status of a result, as C has it.
pub(crate) fn status(answer: StatusResult) -> GestusStatus {
    match answer {
        Ok(()) => GestusStatus::Ok,
        Err(status) => status,
    }
}
