//! Stylizers: makes one in the caller's memory, and steps it.

use core::ffi::c_void;

use gestus_core::{Config, Database, Fit, methods::weights::MAX_KEPT};

use crate::{
    config::GestusConfig,
    database::{GestusDatabase, opened},
    handle::{Cell, close, kind_of},
    memory::{self, Region, disjoint},
    pose,
    profile::{self, AnyStylizer, GestusProfile, Large, Small, Standard},
    status::{GestusStatus, StatusResult, status},
};

/// Translates a stream of poses to another style. It is in memory that the caller provided, and refers to the blob,
/// which has to stay valid as long. Each stream needs its own stylizer; several may share a database. Only one thread
/// at a time may use a stylizer; an interrupt may, if the thread masks it during its own calls.
pub struct GestusStylizer {
    _opaque: [u8; 0],
}

/// Bytes that `gestus_stylizer_init` needs for a profile; 0 if this library has no such profile.
#[unsafe(no_mangle)]
pub extern "C" fn gestus_stylizer_size(profile: u32) -> usize {
    GestusProfile::of(profile).map_or(0, |p| p.layout().0)
}

/// Alignment, in bytes, of the memory that `gestus_stylizer_init` needs for a profile; 0 if this library has no
/// such profile.
#[unsafe(no_mangle)]
pub extern "C" fn gestus_stylizer_alignment(profile: u32) -> usize {
    GestusProfile::of(profile).map_or(0, |p| p.layout().1)
}

/// Makes a stylizer in `memory`. Its output style is the database's first until another is set. The handle, which is
/// `memory` itself, is written to `*stylizer`. The object can't be moved.
///
/// This function needs as much stack as memory: call it early, while little stack is in use. A step needs far less.
///
/// If `config` is null the configuration is that of `gestus_config_default`.
///
/// Returns `GESTUS_STATUS_PROFILE`, `_JOINTS` or `_CLASSES` (the database exceeds the profile's capacity),
/// `_NEIGHBORS`, `_PARAMETER`, `_METHOD` (the database lacks the data that the method needs), `_NULL`, `_MISALIGNED`,
/// `_SHORT` (`bytes` is less than `gestus_stylizer_size`), `_OVERLAP`, `_HANDLE` (of the database).
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
    let init = || {
        let profile = GestusProfile::of(profile)?;
        let (need, alignment) = profile.layout();
        let own = Region::memory(memory.cast(), bytes, need, alignment)?;
        let out = Region::of(stylizer, 1)?;
        // SAFETY: by the caller's contract.
        let (db, [cell, blob]) = unsafe { opened(database) }?;
        disjoint([own, out, cell, blob])?;
        let config = if config.is_null() {
            GestusConfig::of(profile)
        } else {
            disjoint([own, out, Region::of(config, 1)?])?;
            // SAFETY: by the caller's contract; not null and aligned by the line above.
            unsafe { memory::slice(config, 1) }?.first().copied().ok_or(GestusStatus::Short)?
        };
        let (db, config) = (*db, config.read()?);
        match profile {
            // SAFETY: `own` is aligned and long enough for this profile, and overlaps nothing that is read here.
            #[cfg(feature = "standard")]
            GestusProfile::Standard => unsafe {
                make::<{ profile::STANDARD[0] }, { profile::STANDARD[1] }, { profile::STANDARD[2] }>(
                    memory, profile, blob, db, config,
                )
            },
            // SAFETY: as above.
            #[cfg(feature = "small")]
            GestusProfile::Small => unsafe {
                make::<{ profile::SMALL[0] }, { profile::SMALL[1] }, { profile::SMALL[2] }>(
                    memory, profile, blob, db, config,
                )
            },
            // SAFETY: as above.
            #[cfg(feature = "large")]
            GestusProfile::Large => unsafe {
                make::<{ profile::LARGE[0] }, { profile::LARGE[1] }, { profile::LARGE[2] }>(
                    memory, profile, blob, db, config,
                )
            },
            #[cfg(not(all(feature = "standard", feature = "small", feature = "large")))]
            _ => Err(GestusStatus::Profile),
        }?;
        // SAFETY: `out` was checked, and may be written by the caller's contract.
        unsafe { memory::put(stylizer, &[memory.cast::<GestusStylizer>()]) }
    };
    status(init())
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
) -> StatusResult {
    let fit = Fit::<J, K, C>::new(database, config)?;
    // SAFETY: by the caller's contract.
    unsafe { Cell::make(memory.cast(), profile as u32, blob, || fit.stylizer()) };
    Ok(())
}

/// A stylizer, and the regions of the stylizer and of its blob.
///
/// # Safety
/// The handle is null or points at memory that can be read, and no other reference to it is used while the
/// result is.
pub(crate) unsafe fn stylizer_of<'a>(
    stylizer: *mut GestusStylizer,
) -> StatusResult<(&'a mut dyn AnyStylizer, [Region; 2])> {
    // SAFETY: by the caller's contract.
    let kind = unsafe { kind_of(stylizer.cast_const().cast()) }?;
    // SAFETY: only `init` makes objects with a profile's seal, and they have the profile's type.
    unsafe {
        match GestusProfile::of_kind(kind)? {
            GestusProfile::Standard => parts(Cell::<Standard>::of_mut(stylizer.cast(), kind)?),
            GestusProfile::Small => parts(Cell::<Small>::of_mut(stylizer.cast(), kind)?),
            GestusProfile::Large => parts(Cell::<Large>::of_mut(stylizer.cast(), kind)?),
        }
    }
}

fn parts<T: AnyStylizer>(cell: &mut Cell<T>) -> StatusResult<(&mut dyn AnyStylizer, [Region; 2])> {
    let regions = [cell.region()?, cell.blob];
    Ok((&mut cell.object, regions))
}

/// Makes a stylizer's handle invalid, so that later use of it is detected. Calling this is optional: the memory may be
/// reused in any case.
///
/// Returns `GESTUS_STATUS_NULL`, `_MISALIGNED`, `_HANDLE`.
///
/// # Safety
/// `stylizer` came from `gestus_stylizer_init`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn gestus_stylizer_close(stylizer: *mut GestusStylizer) -> GestusStatus {
    // SAFETY: by the caller's contract.
    let found = unsafe { stylizer_of(stylizer) }.map(|_| ());
    // SAFETY: as above; the handle is that of an intact object.
    status(found.map(|()| unsafe { close(stylizer.cast()) }))
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

/// The report of a step.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct GestusReport {
    /// Time from the last output pose to this one, seconds, under the timing policy.
    pub step_s: f32,
    /// The predicted time step, regardless of the policy and the strength of the style, seconds.
    pub predicted_step_s: f32,
    /// How far the input is from the data. Mixture: mean squared distance of the nearest class's neighbors, weighted
    /// square metres. Phase tables: smoothed squared distance to the nearest class, whitened. Linear models and
    /// statistics: the largest distance of a dof from its mean, squared, in variances.
    pub distance2: f32,
    /// Part of the input that was passed through because it is unlike the database, 0 to 1.
    pub passed: f32,
    /// Distances computed.
    pub visits: u32,
    /// Bytes read from the blob.
    pub bytes_read: u32,
    /// How the frame was degraded: bits `GESTUS_DEGRADED_...`; 0 if it was not.
    pub degraded: u32,
    /// 1 if the left foot is in contact with the floor, otherwise 0.
    pub left_contact: u32,
    /// 1 if the right foot is in contact with the floor, otherwise 0.
    pub right_contact: u32,
    /// Number of entries of `classes` in use.
    pub class_count: u32,
    /// The classes used, largest proportion first.
    pub classes: [GestusShare; GESTUS_MOST_CLASSES],
}

/// The input was not a valid pose (NaN, a quaternion whose length is not within 1% of 1, a position over 100 km from
/// the origin): the output was the last one, or as `GESTUS_PARAMETER_SAFETY` says.
pub const GESTUS_DEGRADED_INPUT: u32 = 1;
/// A search reached the cap on visits before it was complete.
pub const GESTUS_DEGRADED_VISITS: u32 = 2;
/// More classes had weight than a frame may mix.
pub const GESTUS_DEGRADED_CLASSES: u32 = 4;
/// A prediction was not finite or far out of range: the input was used instead.
pub const GESTUS_DEGRADED_PREDICTION: u32 = 8;
/// A class with weight was searched again from the start: the input has jumped, or is far from the data.
pub const GESTUS_DEGRADED_JUMP: u32 = 16;
/// The input moved faster than any body can; reported under every policy of safety.
pub const GESTUS_DEGRADED_LEAP: u32 = 128;
/// The input is unlike the database: at least half of it was passed through unchanged.
pub const GESTUS_DEGRADED_FAR: u32 = 256;
/// The frame before was wrong, and was used: a joint or the heading left by more than 6 rad/s, or the root's height by
/// more than 3 m/s, and came back by as much in this frame.
pub const GESTUS_DEGRADED_SPIKE: u32 = 512;

const _: () = {
    use gestus_core::Degraded as D;
    assert!(GESTUS_DEGRADED_INPUT == D::INPUT.bits() as u32);
    assert!(GESTUS_DEGRADED_VISITS == D::VISITS.bits() as u32);
    assert!(GESTUS_DEGRADED_CLASSES == D::CLASSES.bits() as u32);
    assert!(GESTUS_DEGRADED_PREDICTION == D::PREDICTION.bits() as u32);
    assert!(GESTUS_DEGRADED_JUMP == D::JUMP.bits() as u32);
    assert!(GESTUS_DEGRADED_LEAP == D::LEAP.bits() as u32);
    assert!(GESTUS_DEGRADED_FAR == D::FAR.bits() as u32);
    assert!(GESTUS_DEGRADED_SPIKE == D::SPIKE.bits() as u32);
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
            passed: report.passed,
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

/// Translates one pose of a stream at the database's rate to the output style, and reports on it.
///
/// A pose is the root's position, 3 numbers in metres, Y up, and `joints` unit quaternions x, y, z, w, one after the
/// other: joint 0 is the root's orientation in the world, the others are local to their parents. `joints` is at least
/// the database's number of joints; further joints are neither read nor written.
///
/// The output may overlap the input in any way: `position` may be `out_position`, and `rotations` may be
/// `out_rotations`. Otherwise no memory that is written may overlap any other argument. `report` may be null.
///
/// With valid arguments a step can't fail: if the input is not a valid pose, the output follows the configured `safety`,
/// and `degraded` reports it. Before the first valid input the output is a pose of identity rotations, which should not be
/// played.
///
/// Returns `GESTUS_STATUS_SHORT` (`joints` is less than the database's), `_NULL`, `_MISALIGNED`, `_HANDLE`, `_OVERLAP`.
/// The stylizer has not stepped then.
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
    let step = || {
        // SAFETY: by the caller's contract. That the arguments do not overlap the stylizer is checked before they are read.
        let (stylizer, [own, blob]) = unsafe { stylizer_of(stylizer) }?;
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
        // SAFETY: both arrays were checked, and exist by the caller's contract. They are copied before anything is written.
        let (mut root, mut joint_rotations) = unsafe { pose::read(position, rotations, used) }?;
        let happened = stylizer.step(&mut root, joint_rotations.get_mut(..used).unwrap_or(&mut []));
        // SAFETY: the places were checked, exist by the caller's contract, and no reference to them is alive.
        unsafe {
            memory::put(out_position, &root)?;
            memory::put(out_rotations, joint_rotations.get(..used).unwrap_or(&[]).as_flattened())?;
            if !report.is_null() {
                memory::put(report, &[GestusReport::from(&happened)])?;
            }
        }
        Ok(())
    };
    status(step())
}
