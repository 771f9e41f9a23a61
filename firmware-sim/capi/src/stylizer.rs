//! Stylizers: making one in the caller's memory, and stepping it.

use core::ffi::c_void;

use gestus_core::{Config, Database, Fit, methods::mixture::weights::MAX_KEPT};

use crate::{
    config::GestusConfig,
    database::{GestusDatabase, opened},
    handle::{Cell, kind_of},
    memory::{self, Region, disjoint},
    pose,
    profile::{GestusProfile, Large, Running, Small, Standard},
    status::{Answer, GestusStatus, status},
};

/// Turns a stream of poses into another style. It lies in memory that the caller gave, and refers to the blob, which
/// has to stay as long. One stream needs one stylizer; several may share a database. A stylizer may be used by one
/// thread, or by one thread and the interrupts that it holds off, at a time.
pub struct GestusStylizer {
    _opaque: [u8; 0],
}

/// Bytes that `gestus_stylizer_init` needs for a profile; 0 where this library has no such profile.
#[unsafe(no_mangle)]
pub extern "C" fn gestus_stylizer_size(profile: u32) -> usize {
    GestusProfile::of(profile).map_or(0, |p| p.layout().0)
}

/// Alignment, in bytes, of the memory that `gestus_stylizer_init` needs for a profile; 0 where this library has no
/// such profile.
#[unsafe(no_mangle)]
pub extern "C" fn gestus_stylizer_alignment(profile: u32) -> usize {
    GestusProfile::of(profile).map_or(0, |p| p.layout().1)
}

/// Makes a stylizer in `memory` that puts out the database's first style until told otherwise. The handle is put into
/// `*stylizer`; it is `memory` itself, and the object can't be moved.
///
/// While it is made it takes as much stack as memory, once: call it early, from a shallow place. A step takes far less.
///
/// `config` may be null: then it is what `gestus_config_default` gives.
///
/// Answers `GESTUS_STATUS_PROFILE`, `_JOINTS` or `_CLASSES` (the database has more than the profile takes),
/// `_NEIGHBORS`, `_PARAMETER`, `_METHOD` (the database does not hold what the method needs), `_NULL`, `_MISALIGNED`, `_SHORT`
/// (`bytes` is less than `gestus_stylizer_size`), `_OVERLAP`, `_HANDLE` (of the database).
///
/// # Safety
/// `memory` points at `bytes` bytes; `database` came from `gestus_database_open`; `config` is null or points at a
/// `GestusConfig`; `stylizer` points at memory for a pointer.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn gestus_stylizer_init(
    memory: *mut c_void,
    bytes: usize,
    profile: u32,
    database: *const GestusDatabase,
    config: *const GestusConfig,
    stylizer: *mut *mut GestusStylizer,
) -> GestusStatus {
    // SAFETY: the caller's word is passed on.
    status(unsafe { init(memory, bytes, profile, database, config, stylizer) })
}

unsafe fn init(
    memory: *mut c_void,
    bytes: usize,
    profile: u32,
    database: *const GestusDatabase,
    config: *const GestusConfig,
    stylizer: *mut *mut GestusStylizer,
) -> Answer {
    let profile = GestusProfile::of(profile)?;
    let (need, alignment) = profile.layout();
    let own = Region::memory(memory.cast(), bytes, need, alignment)?;
    let out = Region::of(stylizer, 1)?;
    // SAFETY: the caller's word.
    let (db, [cell, blob]) = unsafe { opened(database) }?;
    disjoint([own, out, cell, blob])?;
    let config = if config.is_null() {
        GestusConfig::of(profile)
    } else {
        disjoint([own, out, Region::of(config, 1)?])?;
        // SAFETY: the caller's word; not null and aligned by the line above.
        unsafe { memory::slice(config, 1) }?.first().copied().ok_or(GestusStatus::Short)?
    };
    let (db, config) = (*db, config.read()?);
    match profile {
        // SAFETY: `own` is aligned and long enough for this profile, and overlaps nothing that is read here.
        #[cfg(feature = "standard")]
        GestusProfile::Standard => unsafe { make::<22, 40, 28>(memory, profile, blob, db, config) },
        // SAFETY: as above.
        #[cfg(feature = "small")]
        GestusProfile::Small => unsafe { make::<12, 16, 8>(memory, profile, blob, db, config) },
        // SAFETY: as above.
        #[cfg(feature = "large")]
        GestusProfile::Large => unsafe { make::<64, 64, 256>(memory, profile, blob, db, config) },
        #[cfg(not(all(feature = "standard", feature = "small", feature = "large")))]
        _ => Err(GestusStatus::Profile),
    }?;
    // SAFETY: `out` was checked, and is the caller's to write.
    unsafe { memory::put(stylizer, &[memory.cast::<GestusStylizer>()]) }
}

/// Makes a stylizer of those capacities in place.
///
/// # Safety
/// `memory` is aligned and long enough for it, and no reference to it is alive.
#[inline(never)]
unsafe fn make<const J: usize, const K: usize, const C: usize>(
    memory: *mut c_void,
    profile: GestusProfile,
    blob: Region,
    database: Database<'static>,
    config: Config,
) -> Answer {
    let fit = Fit::<J, K, C>::new(database, config)?;
    // SAFETY: the caller's word.
    unsafe { Cell::make(memory.cast(), profile as u32, blob, || fit.stylizer()) };
    Ok(())
}

/// A stylizer, and the regions that are its own and its blob's.
///
/// # Safety
/// The handle is null or points at memory that can be read, and nobody else refers to it as long as the answer is
/// used.
pub(crate) unsafe fn running<'a>(
    stylizer: *mut GestusStylizer,
) -> Answer<(&'a mut dyn Running, [Region; 2])> {
    // SAFETY: the caller's word.
    let kind = unsafe { kind_of(stylizer.cast_const().cast()) }?;
    match GestusProfile::of_kind(kind)? {
        GestusProfile::Standard => {
            // SAFETY: `init` has made what carries this kind's seal, of this type.
            let cell = unsafe { Cell::<Standard>::of_mut(stylizer.cast(), kind) }?;
            let regions = [cell.region()?, cell.blob];
            Ok((&mut cell.object, regions))
        }
        GestusProfile::Small => {
            // SAFETY: as above.
            let cell = unsafe { Cell::<Small>::of_mut(stylizer.cast(), kind) }?;
            let regions = [cell.region()?, cell.blob];
            Ok((&mut cell.object, regions))
        }
        GestusProfile::Large => {
            // SAFETY: as above.
            let cell = unsafe { Cell::<Large>::of_mut(stylizer.cast(), kind) }?;
            let regions = [cell.region()?, cell.blob];
            Ok((&mut cell.object, regions))
        }
    }
}

/// Makes a stylizer's handle stale, so that using it later is noticed. Need not be called; the memory is the caller's
/// again in any case.
///
/// Answers `GESTUS_STATUS_NULL`, `_MISALIGNED`, `_HANDLE`.
///
/// # Safety
/// `stylizer` came from `gestus_stylizer_init`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn gestus_stylizer_close(stylizer: *mut GestusStylizer) -> GestusStatus {
    // SAFETY: the caller's word is passed on.
    status(unsafe { close(stylizer) })
}

unsafe fn close(stylizer: *mut GestusStylizer) -> Answer {
    // SAFETY: the caller's word.
    let kind = unsafe { kind_of(stylizer.cast_const().cast()) }?;
    match GestusProfile::of_kind(kind)? {
        GestusProfile::Standard => {
            // SAFETY: `init` has made what carries this kind's seal, of this type.
            unsafe { Cell::<Standard>::of_mut(stylizer.cast(), kind) }?.close();
        }
        GestusProfile::Small => {
            // SAFETY: as above.
            unsafe { Cell::<Small>::of_mut(stylizer.cast(), kind) }?.close();
        }
        GestusProfile::Large => {
            // SAFETY: as above.
            unsafe { Cell::<Large>::of_mut(stylizer.cast(), kind) }?.close();
        }
    }
    Ok(())
}

/// Most classes in a report.
pub const GESTUS_MOST_CLASSES: usize = 8;

const _: () = assert!(GESTUS_MOST_CLASSES == MAX_KEPT);

/// A class of a frame and its proportion.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct GestusShare {
    /// Number of the class.
    pub class_index: u32,
    /// Its proportion; those of a frame sum to 1.
    pub proportion: f32,
}

/// What happened in a step.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct GestusReport {
    /// Time from the last output pose to this one, seconds, under the timing policy.
    pub step_s: f32,
    /// The same as predicted, whatever the policy and the strength of the style.
    pub predicted_step_s: f32,
    /// Mean squared distance of the nearest class's neighbors, weighted square metres: how far from the data.
    pub distance2: f32,
    /// Distances computed.
    pub visits: u32,
    /// Bytes of the blob that were read.
    pub bytes_read: u32,
    /// Each way in which the frame was degraded: bits `GESTUS_DEGRADED_...`; 0 where it was not.
    pub degraded: u32,
    /// 1 where the left foot stands, 0 where it does not.
    pub left_contact: u32,
    /// The same of the right foot.
    pub right_contact: u32,
    /// How many of `classes` are in use.
    pub class_count: u32,
    /// The classes used, largest proportion first.
    pub classes: [GestusShare; GESTUS_MOST_CLASSES],
}

/// The input was no pose (NaN, a quaternion whose length is not within 1% of 1, a place over 100 km off): the last output
/// was held, or what `GESTUS_PARAMETER_SAFETY` says.
pub const GESTUS_DEGRADED_INPUT: u32 = 1;
/// A search used up its visits before it was done.
pub const GESTUS_DEGRADED_VISITS: u32 = 2;
/// More classes had weight than a frame may use.
pub const GESTUS_DEGRADED_CLASSES: u32 = 4;
/// A prediction was not finite or far out of range: the input was passed through in its place.
pub const GESTUS_DEGRADED_PREDICTION: u32 = 8;
/// A class that has weight was searched anew: the input has jumped, or is far from the data.
pub const GESTUS_DEGRADED_JUMP: u32 = 16;
/// The input moved faster than any body; told where `GESTUS_PARAMETER_SAFETY` is not 0.
pub const GESTUS_DEGRADED_LEAP: u32 = 128;

const _: () = {
    use gestus_core::Degraded as D;
    assert!(GESTUS_DEGRADED_INPUT == D::INPUT.bits() as u32);
    assert!(GESTUS_DEGRADED_VISITS == D::VISITS.bits() as u32);
    assert!(GESTUS_DEGRADED_CLASSES == D::CLASSES.bits() as u32);
    assert!(GESTUS_DEGRADED_PREDICTION == D::PREDICTION.bits() as u32);
    assert!(GESTUS_DEGRADED_JUMP == D::JUMP.bits() as u32);
    assert!(GESTUS_DEGRADED_LEAP == D::LEAP.bits() as u32);
};

impl From<&gestus_core::Report> for GestusReport {
    fn from(report: &gestus_core::Report) -> Self {
        let mut classes = [GestusShare::default(); GESTUS_MOST_CLASSES];
        for (slot, share) in classes.iter_mut().zip(&report.classes) {
            *slot = GestusShare { class_index: share.class.into(), proportion: share.proportion };
        }
        Self {
            step_s: report.step_s,
            predicted_step_s: report.predicted_step_s,
            distance2: report.distance2,
            visits: report.visits,
            bytes_read: report.bytes_read,
            degraded: report.degraded.bits().into(),
            left_contact: report.contacts[0].into(),
            right_contact: report.contacts[1].into(),
            class_count: report.classes.len() as u32,
            classes,
        }
    }
}

/// Takes one pose at the database's rate, gives it the style, and says what happened.
///
/// A pose is the root's position, 3 numbers in metres, Y up, and `joints` unit quaternions x, y, z, w one behind the
/// other: joint 0 is the root's orientation in the world, the others are local to their parents. `joints` is at least
/// the database's number of joints; the numbers of joints beyond are neither read nor written.
///
/// The output may be put where the input was: `position` may be `out_position` and `rotations` may be
/// `out_rotations`, whole or overlapping in any way. Otherwise nothing that is written may overlap anything.
/// `report` may be null.
///
/// With good arguments a step can't fail: input that is no pose is answered with the last output, and reported in
/// `degraded`. Before there was an output the answer is a pose without any rotation, which is nothing to play.
///
/// Answers `GESTUS_STATUS_SHORT` (`joints` is less than the database's), `_NULL`, `_MISALIGNED`, `_HANDLE`, `_OVERLAP`.
/// Then the stylizer has not stepped.
///
/// # Safety
/// `stylizer` came from `gestus_stylizer_init`; `position` and `out_position` point at 3 numbers, `rotations` and
/// `out_rotations` at 4 times `joints`; `report` is null or points at memory for a `GestusReport`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn gestus_stylizer_step(
    stylizer: *mut GestusStylizer,
    position: *const f32,
    rotations: *const f32,
    joints: usize,
    out_position: *mut f32,
    out_rotations: *mut f32,
    report: *mut GestusReport,
) -> GestusStatus {
    // SAFETY: the caller's word is passed on.
    status(unsafe { step(stylizer, position, rotations, joints, out_position, out_rotations, report) })
}

unsafe fn step(
    stylizer: *mut GestusStylizer,
    position: *const f32,
    rotations: *const f32,
    joints: usize,
    out_position: *mut f32,
    out_rotations: *mut f32,
    report: *mut GestusReport,
) -> Answer {
    // SAFETY: the caller's word. What the caller's pointers point at is checked to lie elsewhere before it is read.
    let (stylizer, [own, blob]) = unsafe { running(stylizer) }?;
    let used = stylizer.database().counts().joints;
    let input = pose::regions(position, rotations, joints, used)?;
    let output = pose::regions(out_position, out_rotations, joints, used)?;
    disjoint([own, blob, output[0], output[1]])?;
    disjoint([own, input[0]])?;
    disjoint([own, input[1]])?;
    if !report.is_null() {
        let place = Region::of(report, 1)?;
        disjoint([own, blob, output[0], output[1], place])?;
        disjoint([place, input[0]])?;
        disjoint([place, input[1]])?;
    }
    // SAFETY: both arrays were checked, and are there by the caller's word. They are copied before anything is written.
    let (mut root, mut turns) = unsafe { pose::read(position, rotations, used) }?;
    let happened = stylizer.step(&mut root, turns.get_mut(..used).unwrap_or(&mut []));
    // SAFETY: the places were checked, are there by the caller's word, and no reference to them is alive.
    unsafe {
        memory::put(out_position, &root)?;
        memory::put(out_rotations, turns.get(..used).unwrap_or(&[]).as_flattened())?;
        if !report.is_null() {
            memory::put(report, &[GestusReport::from(&happened)])?;
        }
    }
    Ok(())
}
