//! What can go wrong, as numbers, and what each means, as text.

use core::ffi::{CStr, c_char};

use gestus_core::{BlobError, ConfigError, MAX_OWN, blob::layout::MAX_STYLES};

/// What a function answers. With any answer but `GESTUS_STATUS_OK` nothing was changed, except as the function says.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum GestusStatus {
    /// It is done.
    Ok = 0,
    /// A pointer is null that must not be.
    Null = 1,
    /// A pointer is not aligned to what it points at.
    Misaligned = 2,
    /// Memory or an array is shorter than what is needed, or longer than the address space.
    Short = 3,
    /// Two arguments overlap that must not.
    Overlap = 4,
    /// The handle is none: stale, overwritten, moved, or never made.
    Handle = 5,
    /// The profile is not one of `GestusProfile`, or was left out of this library.
    Profile = 6,
    /// An index or kind is out of range, or there is no such name.
    NotFound = 7,
    /// A text is not UTF-8, or longer than `GESTUS_NAME_BYTES` with its final zero.
    Text = 8,
    /// The blob has fewer or more bytes than it says: copy it again, whole.
    BlobTruncated = 16,
    /// The first bytes are not a Gestus blob's.
    BlobMagic = 17,
    /// The blob is of another version of the format: build it again.
    BlobVersion = 18,
    /// A checksum does not agree: the blob was damaged.
    BlobChecksum = 19,
    /// A section is missing, doubled or misplaced.
    BlobSection = 20,
    /// A section's length does not follow from the header's counts.
    BlobLength = 21,
    /// A number in a section is out of its range.
    BlobValue = 22,
    /// A reserved byte is not zero: the blob is newer than this library, or damaged.
    BlobReserved = 23,
    /// The manifest can't be decoded.
    BlobManifest = 24,
    /// The blob is refused for a reason that this library has no number for.
    BlobOther = 31,
    /// The database has more joints than the profile takes.
    Joints = 32,
    /// The database has more classes than the profile takes.
    Classes = 33,
    /// The number of neighbors is 0, or more than the profile takes.
    Neighbors = 34,
    /// There is no style, action, joint group or parameter of that number.
    Unknown = 35,
    /// The database does not hold the labelled action in the labelled style.
    NoClass = 36,
    /// A weight is negative or not finite, or all are zero; or there are more styles than 32, or than 3 for a joint group.
    Weights = 37,
    /// A parameter is not finite or out of its range.
    Parameter = 38,
    /// The database does not hold what the method needs (frames, linear models or statistics), or the method can't do that:
    /// linear models give a style to the whole body alone.
    Method = 39,
    /// The database has no effort dial.
    NoDial = 40,
    /// The stylizer refuses for a reason that this library has no number for.
    SettingOther = 47,
}

impl GestusStatus {
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
            Self::Handle => c"the handle is none: it is stale, was overwritten or moved, or was never made",
            Self::Profile => c"there is no such profile in this library: build it with the profile's feature, `standard`, `small` or `large`",
            Self::NotFound => c"there is nothing of that name or number",
            Self::Text => c"a text is not UTF-8 or too long",
            Self::BlobTruncated => c"the blob has not as many bytes as it says: copy it again, whole",
            Self::BlobMagic => c"this is not a Gestus blob: build one with `gestus build`",
            Self::BlobVersion => {
                c"the blob is of another format version: build it again with the builder of this version"
            }
            Self::BlobChecksum => c"a checksum of the blob does not agree: it was damaged, copy it again",
            Self::BlobSection => c"a section of the blob is missing, doubled or misplaced: build it again",
            Self::BlobLength => {
                c"a section of the blob has not the length that its header asks for: build it again"
            }
            Self::BlobValue => c"a number in the blob is out of its range: build it again",
            Self::BlobReserved => {
                c"a reserved byte of the blob is not zero: it is newer than this library, or damaged"
            }
            Self::BlobManifest => c"the blob's manifest can't be decoded: build it again",
            Self::BlobOther => c"the blob is refused: build it again with the builder of this version",
            Self::Joints => c"the database has more joints than the profile takes: use a larger profile, up to GESTUS_PROFILE_LARGE of a library that was built with the feature `large`",
            Self::Classes => c"the database has more classes than the profile takes: use a larger profile, up to GESTUS_PROFILE_LARGE of a library that was built with the feature `large`",
            Self::Neighbors => c"the number of neighbors is 0 or more than the profile takes",
            Self::Unknown => c"there is no style, action, joint group or parameter of that number",
            Self::NoClass => {
                c"the database does not hold that action in that style: label one of them, or neither"
            }
            Self::Weights => c"weights must be finite, not negative, and not all zero, of 1 to 32 styles, and of 3 at most for a joint group",
            Self::Parameter => c"a parameter is not finite or out of its range",
            Self::Method => c"the database does not hold what the method needs, or the method can't do that (linear models style the whole body): choose another, or build it with the models in it",
            Self::NoDial => c"the database has no effort dial: build it again with two styles or more",
            Self::SettingOther => c"the setting is refused",
        }
    }
}

/// What a status means, in English, as text that ends with a zero and stays for ever. Numbers that are no status
/// have a text too; it never answers null.
#[unsafe(no_mangle)]
pub extern "C" fn gestus_error_message(status: u32) -> *const c_char {
    let known = GestusStatus::ALL.iter().find(|s| **s as u32 == status);
    known.map_or(c"there is no such status", |s| s.message()).as_ptr()
}

/// Where a blob was found to be wrong. Fields that an error does not have are 0.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct GestusBlobDetail {
    /// Bytes, or the format version, that is needed.
    pub need: u32,
    /// Bytes, or the format version, that is there.
    pub have: u32,
    /// Number of the section, as in docs/FORMAT.md; 0 is the header.
    pub section: u32,
    /// Record of the section.
    pub record: u32,
}

/// A blob's error as status and detail.
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

// What the texts of `Weights` say.
const _: () = assert!(MAX_STYLES == 32 && MAX_OWN == 3);

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

/// What a function's body gives: `?` leaves with the first status that is no success.
pub(crate) type Answer<T = ()> = Result<T, GestusStatus>;

/// The body's answer as a number for C.
pub(crate) fn status(answer: Answer) -> GestusStatus {
    match answer {
        Ok(()) => GestusStatus::Ok,
        Err(status) => status,
    }
}
