//! The checks of `open`, in three passes: the places of the sections ([`sections`]); their checksums ([`checksums`]);
//! then every number's range and every index ([`contents`]). No later read needs a check.

mod body;
mod counts;
mod effort;
mod frames;
mod labels;
mod lengths;
mod lti;
mod phase;
mod query;
mod statistic;

use super::{
    Database, Mark,
    check::{Checked, Envelope, reserved},
    crc::crc32c,
    layout::{
        ALIGNMENT, MAGIC, VERSION, entry, header,
        section::{self, Optional, Required},
    },
    read::Record,
};
use crate::{BlobError, Method, error::saturating_u32};
use counts::NO_METHOD;

const ENVELOPE: Envelope = Envelope {
    section: 0,
    magic: MAGIC,
    version: VERSION,
    header: header::LENGTH,
    total: header::TOTAL,
    crc: header::CRC,
};

impl<'db> Database<'db> {
    /// Checks a blob: magic, version, lengths, checksums, every index, every scale. Takes time in proportion to
    /// its size, and no memory.
    ///
    /// # Errors
    /// [`BlobError`] says which section and record is wrong.
    #[inline]
    pub fn open(bytes: &'db [u8]) -> Result<Self, BlobError> {
        checked(bytes, sections(bytes))
    }

    /// Opens a blob that has been checked before. Where its mark is `mark`, only header, section table and the places of
    /// sections are checked, not their contents. A blob without the mark is opened as by [`open`](Self::open), so the first start
    /// may pass [`Mark::from_bits`]`(0)`; afterwards store [`mark`](Self::mark).
    ///
    /// With the mark the time does not depend on the size of the sections. Flash that has changed since then is not found: a
    /// step still does not panic or write outside its memory, but poses may be wrong, and the bounds of
    /// [`worst_step`](Self::worst_step) are no longer certain.
    ///
    /// # Errors
    /// As [`open`](Self::open).
    #[inline]
    pub fn open_marked(bytes: &'db [u8], mark: Mark) -> Result<Self, BlobError> {
        let found = sections(bytes);
        if found.as_ref().is_ok_and(|database| database.mark() == mark) {
            found
        } else {
            checked(bytes, found)
        }
    }
}

/// Checks the contents of the sections that were found.
// Takes and returns the whole result, so that the stack holds one copy of the database, not three.
#[inline]
fn checked<'db>(bytes: &[u8], found: Result<Database<'db>, BlobError>) -> Result<Database<'db>, BlobError> {
    let fault = match &found {
        Ok(database) => checksums(bytes).and_then(|()| contents(database, Method::is_built)).err(),
        Err(_) => None,
    };
    match fault {
        Some(fault) => Err(fault),
        None => found,
    }
}

/// Finds the sections and checks header, table and lengths.
// None of the passes is inlined, so that their stack frames are not needed at the same time.
#[inline(never)]
fn sections(bytes: &[u8]) -> Result<Database<'_>, BlobError> {
    let head = ENVELOPE.open(bytes)?;
    let total = bytes.len();
    let count = usize::from(head.u16(header::SECTIONS));
    let table_end = header::LENGTH + count * entry::LENGTH;
    ENVELOPE.sum(bytes, table_end)?;
    reserved(0, head.zero(header::RESERVED))?;

    let mut required: [Option<&[u8]>; section::REQUIRED.len()] = [None; section::REQUIRED.len()];
    let mut optional: [Option<&[u8]>; section::OPTIONAL.len()] = [None; section::OPTIONAL.len()];
    let mut end = table_end;
    for i in 0..count {
        let record = Record::of(bytes.get(header::LENGTH..).unwrap_or(&[]), i, entry::LENGTH);
        let id = record.u16(entry::ID);
        if !record.zero(entry::RESERVED) {
            return Err(BlobError::Reserved { section: id });
        }
        let misplaced = BlobError::Section { section: id };
        let (start, length) = (record.u32(entry::OFFSET) as usize, record.u32(entry::BYTES) as usize);
        let slot = match section::REQUIRED.iter().position(|&r| r == id) {
            Some(i) => required.get_mut(i),
            None => section::OPTIONAL.iter().position(|&o| o == id).and_then(|i| optional.get_mut(i)),
        };
        let Some(slot) = slot else { return Err(misplaced) };
        // Sections follow each other in the order of the table, each on the next boundary.
        if start != end.next_multiple_of(ALIGNMENT) || length > total {
            return Err(misplaced);
        }
        let (Some(padding), Some(content)) = (bytes.get(end..start), bytes.get(start..start + length)) else {
            return Err(misplaced);
        };
        if padding.iter().any(|&b| b != 0) {
            return Err(BlobError::Reserved { section: id });
        }
        if slot.replace(content).is_some() {
            return Err(misplaced);
        }
        end = start + length;
    }
    if end != total {
        return Err(BlobError::Truncated { need: saturating_u32(end), have: saturating_u32(total) });
    }
    let mut sections: [&[u8]; section::REQUIRED.len()] = [&[]; section::REQUIRED.len()];
    for ((slot, content), &id) in sections.iter_mut().zip(required).zip(&section::REQUIRED) {
        *slot = content.ok_or(BlobError::Section { section: id })?;
    }
    let counts = counts::counts(bytes)?;
    Ok(Database {
        counts,
        identity: head.u32(header::CRC),
        rate_hz: head.f32(header::RATE),
        block_shift: counts.block_rows.trailing_zeros(),
        required: Required::from_array(sections),
        optional: Optional::from_array(optional),
    })
}

/// Checks the checksum of each section; their places are checked.
#[inline(never)]
fn checksums(bytes: &[u8]) -> Checked {
    let count = usize::from(Record(bytes).u16(header::SECTIONS));
    for i in 0..count {
        let record = Record::of(bytes.get(header::LENGTH..).unwrap_or(&[]), i, entry::LENGTH);
        let (start, length) = (record.u32(entry::OFFSET) as usize, record.u32(entry::BYTES) as usize);
        let content = bytes.get(start..).and_then(|rest| rest.get(..length)).unwrap_or(&[]);
        if crc32c(&[content]) != record.u32(entry::CRC) {
            return Err(BlobError::Checksum { section: record.u16(entry::ID) });
        }
    }
    Ok(())
}

/// Checks every number of every section that one of the methods reads which the core `is_built` with.
// With a closure it is compiled with the program that opens a blob, mostly for size: it runs once. The loops that take long
// are functions of their own, which are compiled with the core, for speed.
#[inline(never)]
fn contents(db: &Database<'_>, is_built: impl Fn(Method) -> bool) -> Checked {
    lengths::lengths(db)?;
    body::manifest(db)?;
    body::skeleton(db)?;
    body::dofs(db)?;
    query::query_section(db)?;
    // A retargeting map is checked where it is opened. What belongs to a method that the core was built without is not read,
    // and its checks would take flash. Captured motion belongs to the mixture; all that others read of it are the labels of
    // classes.
    let reads_frames = is_built(Method::Mar);
    if reads_frames {
        frames::clips(db)?;
        frames::cycles(db)?;
    }
    frames::classes(db, &is_built)?;
    if reads_frames {
        frames::rows(db)?;
        frames::blocks(db)?;
        frames::timing_metric(db)?;
    }
    let Optional { lti, statistic, effort, retarget: _, feet, phase, distances, trust } = db.optional;
    if let Some(bytes) = lti.filter(|_| is_built(Method::Lti)) {
        lti::linear_models(db, bytes)?;
    }
    if let Some(bytes) = statistic.filter(|_| is_built(Method::Statistic)) {
        statistic::tables(db, bytes)?;
    }
    if let Some(bytes) = effort {
        effort::dial(db, bytes)?;
    }
    if let Some(bytes) = feet {
        body::feet(db, bytes)?;
    }
    if let Some(bytes) = phase.filter(|_| is_built(Method::Phase)) {
        phase::tables_by_phase(db, bytes)?;
    }
    if let Some(bytes) = distances.filter(|_| reads_frames) {
        frames::distances(db, bytes)?;
    }
    if let Some(bytes) = trust {
        frames::trust(db, bytes)?;
    }
    // Without frames only phase tables have classes.
    if db.counts.frames == 0 && db.counts.classes > 0 && phase.is_none() {
        return Err(NO_METHOD);
    }
    let translates = db.counts.frames > 0 || lti.is_some() || statistic.is_some() || phase.is_some();
    if translates { Ok(()) } else { Err(NO_METHOD) }
}
