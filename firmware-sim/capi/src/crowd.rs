//! Many characters in one call.

use crate::{
    memory::{self, Region, disjoint},
    status::{GestusStatus, StatusResult, status},
    stylizer::{GestusReport, GestusStylizer, gestus_stylizer_step, stylizer_of},
};

/// Characters that step together. The arrays hold them one after the other.
#[repr(C)]
pub struct GestusCrowd {
    /// One handle each. They may be of one database or of several.
    pub stylizers: *const *mut GestusStylizer,
    /// Number of characters.
    pub count: usize,
    /// Positions of the roots, 3 numbers each.
    pub positions: *const f32,
    /// Rotations of the joints, 4 times `joints` numbers each.
    pub rotations: *const f32,
    /// Joints of each pose, at least the databases'.
    pub joints: usize,
    /// Where the output goes; may be `positions`.
    pub out_positions: *mut f32,
    /// Where the output goes; may be `rotations`. Of joints beyond the database's nothing is written.
    pub out_rotations: *mut f32,
    /// One report each; may be null.
    pub reports: *mut GestusReport,
}

/// Steps each character of a crowd once, in order, to the bits of `gestus_stylizer_step`.
///
/// An output array may be its input array. Otherwise no memory that is written may overlap anything else that is named
/// here, the characters' databases included. A handle that comes twice steps twice. To use several threads, make a crowd
/// of a part of the arrays for each.
///
/// Returns the status of the first character that could not step, as `gestus_stylizer_step` does, and writes its place to
/// `stepped`: those before it have stepped, it and those behind it have not. `stepped` is `count` where all have; it may
/// be null. If an array is at fault (`GESTUS_STATUS_NULL`, `_MISALIGNED`, `_SHORT`, `_OVERLAP`), no character has stepped,
/// and `stepped` stays as it is; `_SHORT` includes a database of more joints than `joints`. A character's handle may give
/// `_NULL` and `_MISALIGNED` too: set `*stepped` to `SIZE_MAX` before the call to tell them apart.
///
/// # Safety
/// `crowd` is null or points at a crowd whose arrays are as long as it says; each handle came from
/// `gestus_stylizer_init`; `stepped` is null or points at a number.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn gestus_step_many(crowd: *const GestusCrowd, stepped: *mut usize) -> GestusStatus {
    // SAFETY: the caller's contract is passed on.
    status(unsafe { step_many(crowd, stepped) })
}

impl GestusCrowd {
    /// Where the arrays are, and the number of characters that were stepped.
    fn places(&self, stepped: *mut usize) -> StatusResult<Places> {
        let count = self.count;
        let numbers = |each: usize| count.checked_mul(each).ok_or(GestusStatus::Short);
        let (short, long) = (numbers(3)?, numbers(self.joints.checked_mul(4).ok_or(GestusStatus::Short)?)?);
        let optional =
            |region: StatusResult<Region>, is_null: bool| if is_null { Ok(None) } else { region.map(Some) };
        Ok(Places {
            inputs: [Region::of(self.positions, short)?, Region::of(self.rotations, long)?],
            outputs: [Region::of(self.out_positions, short)?, Region::of(self.out_rotations, long)?],
            reports: optional(Region::of(self.reports, count), self.reports.is_null())?,
            stepped: optional(Region::of(stepped, 1), stepped.is_null())?,
        })
    }
}

/// Where the arrays of a crowd are.
struct Places {
    inputs: [Region; 2],
    outputs: [Region; 2],
    reports: Option<Region>,
    stepped: Option<Region>,
}

impl Places {
    fn written(&self) -> impl Iterator<Item = Region> {
        self.outputs.into_iter().chain(self.reports).chain(self.stepped)
    }

    /// Refuses memory that is written twice, or is an input too. An output may be its input; one that began between two
    /// inputs would change one that is still to come.
    fn check(&self) -> StatusResult {
        for (i, written) in self.written().enumerate() {
            self.written().skip(i + 1).try_for_each(|other| disjoint([written, other]))?;
            for (place, input) in self.inputs.into_iter().enumerate() {
                if place != i || input != written {
                    disjoint([input, written])?;
                }
            }
        }
        Ok(())
    }

    /// Refuses memory that is written although others read it.
    fn spare(&self, read: Region) -> StatusResult {
        self.written().try_for_each(|written| disjoint([read, written]))
    }
}

unsafe fn step_many(crowd: *const GestusCrowd, stepped: *mut usize) -> StatusResult {
    Region::of(crowd, 1)?;
    // SAFETY: not null and aligned, and there by the caller's contract. It is copied before anything is written.
    let crowd = unsafe { crowd.read() };
    let handles = Region::of(crowd.stylizers, crowd.count)?;
    let places = crowd.places(stepped)?;
    places.check()?;
    places.spare(handles)?;
    // Each pose has to hold its character's joints, and nothing that is written may lie in the stylizer or the blob of
    // another character.
    for i in 0..crowd.count {
        // SAFETY: there are `count` handles, by the caller's contract, and they were checked to be aligned.
        let handle = unsafe { crowd.stylizers.add(i).read() };
        // SAFETY: by the caller's contract. A handle that is wrong is told when its turn comes.
        let Ok((stylizer, [own, blob])) = (unsafe { stylizer_of(handle) }) else { continue };
        if stylizer.database().counts().joints > crowd.joints {
            return Err(GestusStatus::Short);
        }
        places.spare(own)?;
        places.spare(blob)?;
    }
    let mut outcome = Ok(());
    let mut done = crowd.count;
    for i in 0..crowd.count {
        // SAFETY: as above; the arrays have a place for each character. A null pointer stays one.
        outcome = unsafe {
            let report = if crowd.reports.is_null() { crowd.reports } else { crowd.reports.add(i) };
            gestus_stylizer_step(
                crowd.stylizers.add(i).read(),
                crowd.positions.add(3 * i),
                crowd.rotations.add(4 * crowd.joints * i),
                crowd.joints,
                crowd.out_positions.add(3 * i),
                crowd.out_rotations.add(4 * crowd.joints * i),
                report,
            )
            .result()
        };
        if outcome.is_err() {
            done = i;
            break;
        }
    }
    if !stepped.is_null() {
        // SAFETY: it was checked, and exists by the caller's contract.
        unsafe { memory::put(stepped, &[done]) }?;
    }
    outcome
}
