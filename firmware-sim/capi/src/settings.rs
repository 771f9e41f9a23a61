//! Settings of a stylizer: style, labels, masks and strengths. All may change during a stream. A refused setting
//! changes nothing.

use core::ffi::c_char;

use gestus_core::{ConfigError, Effort, blob::layout::MAX_STYLES};

use crate::{
    database::write_value,
    memory::{self, Region, disjoint},
    profile::AnyStylizer,
    status::{GestusStatus, StatusResult, status},
    stylizer::{GestusStylizer, stylizer_of},
};

/// Calls a function with a stylizer.
///
/// # Safety
/// As for [`stylizer_of`].
unsafe fn with(
    stylizer: *mut GestusStylizer,
    change: impl FnOnce(&mut dyn AnyStylizer) -> Result<(), ConfigError>,
) -> GestusStatus {
    // SAFETY: by the caller's contract.
    status(unsafe { stylizer_of(stylizer) }.and_then(|(stylizer, _)| Ok(change(stylizer)?)))
}

/// Sets the output style: `count` numbers of styles and their weights, which are scaled to sum to 1. If a style occurs
/// more than once, its weights add up.
///
/// Returns `GESTUS_STATUS_UNKNOWN` (no such style), `_WEIGHTS` (`count` is 0 or above 32, or weights are out of
/// their range), `_NULL`, `_MISALIGNED`, `_HANDLE`, `_OVERLAP` (an array overlaps the stylizer).
///
/// # Safety
/// `stylizer` came from `gestus_stylizer_init`; `styles` and `weights` point at `count` numbers.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn gestus_stylizer_set_style(
    stylizer: *mut GestusStylizer,
    styles: *const u16,
    weights: *const f32,
    count: usize,
) -> GestusStatus {
    // SAFETY: the caller's contract is passed on.
    status(unsafe { set_styles(stylizer, None, styles, weights, count) })
}

unsafe fn set_styles(
    stylizer: *mut GestusStylizer,
    group: Option<u16>,
    styles: *const u16,
    weights: *const f32,
    count: usize,
) -> StatusResult {
    // SAFETY: by the caller's contract. That the arrays do not overlap the stylizer is checked before they are read.
    let (stylizer, [own, _]) = unsafe { stylizer_of(stylizer) }?;
    if !(1..=MAX_STYLES).contains(&count) {
        return Err(GestusStatus::Weights);
    }
    disjoint([own, Region::of(styles, count)?])?;
    disjoint([own, Region::of(weights, count)?])?;
    // SAFETY: by the caller's contract.
    let (styles, weights) = unsafe { (memory::slice(styles, count)?, memory::slice(weights, count)?) };
    let mut pairs = [(0, 0.0); MAX_STYLES];
    for (pair, (&style, &weight)) in pairs.iter_mut().zip(styles.iter().zip(weights)) {
        *pair = (style, weight);
    }
    let pairs = pairs.get(..count).unwrap_or(&[]);
    match group {
        Some(group) => stylizer.set_group_style(group, pairs)?,
        None => stylizer.set_style(pairs)?,
    }
    Ok(())
}

/// Sets the output style of one joint group, in place of the body's: `count` numbers of styles and their weights, which
/// are scaled to sum to 1. A `count` of 0 returns the group to the body's style; the arrays are not read then. Foot
/// contacts and time steps come from the style of the root's group. Each additional mix costs one more regression.
///
/// Returns `GESTUS_STATUS_UNKNOWN` (no such group or style), `_WEIGHTS` (`count` is above 3, or weights are out of
/// their range), `_METHOD` (linear models support one style for the whole body only), `_NULL`,
/// `_MISALIGNED`, `_HANDLE`, `_OVERLAP` (an array overlaps the stylizer).
///
/// # Safety
/// `stylizer` came from `gestus_stylizer_init`; `styles` and `weights` point at `count` numbers.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn gestus_stylizer_set_group_style(
    stylizer: *mut GestusStylizer,
    group: u32,
    styles: *const u16,
    weights: *const f32,
    count: usize,
) -> GestusStatus {
    let Ok(group) = u16::try_from(group) else { return GestusStatus::Unknown };
    if count == 0 {
        // SAFETY: by the caller's contract.
        return unsafe { with(stylizer, |s| s.set_group_style(group, &[])) };
    }
    // SAFETY: the caller's contract is passed on.
    status(unsafe { set_styles(stylizer, Some(group), styles, weights, count) })
}

/// Sets the output style to the style of that name.
///
/// Returns `GESTUS_STATUS_NOT_FOUND`, `_TEXT` (longer than `GESTUS_NAME_BYTES`, or not UTF-8), `_NULL`,
/// `_MISALIGNED`, `_HANDLE`.
///
/// # Safety
/// `stylizer` came from `gestus_stylizer_init`; `name` points at a zero-terminated string that does not overlap the
/// stylizer.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn gestus_stylizer_set_style_name(
    stylizer: *mut GestusStylizer,
    name: *const c_char,
) -> GestusStatus {
    // SAFETY: the caller's contract is passed on.
    status(unsafe { set_style_name(stylizer, name) })
}

unsafe fn set_style_name(stylizer: *mut GestusStylizer, name: *const c_char) -> StatusResult {
    // SAFETY: by the caller's contract.
    let name = unsafe { memory::text(name) }?;
    let text = Region::of(name.as_ptr(), name.len())?;
    // SAFETY: by the caller's contract.
    let (stylizer, [own, _]) = unsafe { stylizer_of(stylizer) }?;
    disjoint([own, text])?;
    let manifest = stylizer.database().manifest().map_err(|_| GestusStatus::BlobManifest)?;
    let style = manifest.styles.find(name).ok_or(GestusStatus::NotFound)?;
    Ok(stylizer.set_style(&[(style, 1.0)])?)
}

/// Sets the output style to the mix of styles that is nearest to an Effort: how bound (`flow`), strong (`weight`) and
/// sudden (`time`) the motion is, each from -3 to 3; 0 is typical of the data. Values beyond that range are clamped.
///
/// Returns `GESTUS_STATUS_NO_DIAL` (the database has no effort dial), `_PARAMETER` (not a number), `_NULL`,
/// `_MISALIGNED`, `_HANDLE`.
///
/// # Safety
/// `stylizer` came from `gestus_stylizer_init`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn gestus_stylizer_set_effort(
    stylizer: *mut GestusStylizer,
    flow: f32,
    weight: f32,
    time: f32,
) -> GestusStatus {
    let change = |s: &mut dyn AnyStylizer| {
        if flow.is_nan() || weight.is_nan() || time.is_nan() {
            return Err(ConfigError::OutOfRange);
        }
        s.set_effort(Effort { flow, weight, time })
    };
    // SAFETY: by the caller's contract.
    unsafe { with(stylizer, change) }
}

/// A label from C; negative numbers mean none.
fn label(number: i32) -> StatusResult<Option<u16>> {
    match u16::try_from(number) {
        Ok(number) => Ok(Some(number)),
        Err(_) if number < 0 => Ok(None),
        Err(_) => Err(GestusStatus::Unknown),
    }
}

/// Sets the input's action, or a negative number if it is not known. With an action only its classes are searched,
/// which takes less time.
///
/// Returns `GESTUS_STATUS_UNKNOWN` (no such action), `_NO_CLASS` (the database does not have it in the input style that
/// is set), `_NULL`, `_MISALIGNED`, `_HANDLE`.
///
/// # Safety
/// `stylizer` came from `gestus_stylizer_init`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn gestus_stylizer_set_action(
    stylizer: *mut GestusStylizer,
    action: i32,
) -> GestusStatus {
    match label(action) {
        // SAFETY: by the caller's contract.
        Ok(action) => unsafe { with(stylizer, |s| s.set_action(action)) },
        Err(status) => status,
    }
}

/// Sets the input's style, or a negative number if it is not known.
///
/// Returns `GESTUS_STATUS_UNKNOWN` (no such style), `_NO_CLASS` (the database does not have it for the action that is
/// set), `_NULL`, `_MISALIGNED`, `_HANDLE`.
///
/// # Safety
/// `stylizer` came from `gestus_stylizer_init`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn gestus_stylizer_set_input_style(
    stylizer: *mut GestusStylizer,
    style: i32,
) -> GestusStatus {
    match label(style) {
        // SAFETY: by the caller's contract.
        Ok(style) => unsafe { with(stylizer, |s| s.set_input_style(style)) },
        Err(status) => status,
    }
}

/// Sets the input's action and style together, each a negative number if it is not known. The database need not have the
/// new action in the style before, nor the action before in the new style.
///
/// Returns `GESTUS_STATUS_UNKNOWN` (no such action or style), `_NO_CLASS` (the database does not have the action in the
/// style), `_NULL`, `_MISALIGNED`, `_HANDLE`. If it fails, both labels stay.
///
/// # Safety
/// `stylizer` came from `gestus_stylizer_init`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn gestus_stylizer_set_labels(
    stylizer: *mut GestusStylizer,
    action: i32,
    style: i32,
) -> GestusStatus {
    match label(action).and_then(|action| Ok((action, label(style)?))) {
        // SAFETY: by the caller's contract.
        Ok((action, style)) => unsafe { with(stylizer, |s| s.set_labels(action, style)) },
        Err(status) => status,
    }
}

/// Sets whether the search uses the features of a joint group: 0 for no, any other number for yes. At least one group
/// has to be used.
///
/// Returns `GESTUS_STATUS_UNKNOWN` (no such group), `_PARAMETER` (it is the last group in use), `_NULL`, `_MISALIGNED`,
/// `_HANDLE`.
///
/// # Safety
/// `stylizer` came from `gestus_stylizer_init`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn gestus_stylizer_set_mask(
    stylizer: *mut GestusStylizer,
    group: u32,
    searched: u32,
) -> GestusStatus {
    let Ok(group) = u16::try_from(group) else { return GestusStatus::Unknown };
    // SAFETY: by the caller's contract.
    unsafe { with(stylizer, |s| s.set_mask(group, searched != 0)) }
}

/// Sets the strength of the style in a joint group: 0 keeps the input, 1 is the style, up to 2 exaggerates it.
///
/// Returns `GESTUS_STATUS_UNKNOWN` (no such group), `_PARAMETER` (not from 0 to 2), `_NULL`, `_MISALIGNED`, `_HANDLE`.
///
/// # Safety
/// `stylizer` came from `gestus_stylizer_init`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn gestus_stylizer_set_strength(
    stylizer: *mut GestusStylizer,
    group: u32,
    strength: f32,
) -> GestusStatus {
    let Ok(group) = u16::try_from(group) else { return GestusStatus::Unknown };
    // SAFETY: by the caller's contract.
    unsafe { with(stylizer, |s| s.set_strength(group, strength)) }
}

/// Sets the most distances computed in a class in a frame, 64 to 448, which bounds the time of a step. Lower it first
/// if steps miss their deadline. Frames that reach it report `GESTUS_DEGRADED_VISITS`.
///
/// Returns `GESTUS_STATUS_PARAMETER` (not from 64 to 448), `_NULL`, `_MISALIGNED`, `_HANDLE`.
///
/// # Safety
/// `stylizer` came from `gestus_stylizer_init`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn gestus_stylizer_set_visits(
    stylizer: *mut GestusStylizer,
    visits: u32,
) -> GestusStatus {
    let Ok(visits) = u16::try_from(visits) else { return GestusStatus::Parameter };
    // SAFETY: by the caller's contract.
    unsafe { with(stylizer, |s| s.set_visits(visits)) }
}

/// Sets a parameter, a number of `GestusParameter`, from the next step on. The stream continues. Setting another method
/// resets the stream and clears both labels: set the action and the input style again.
///
/// Returns `GESTUS_STATUS_UNKNOWN` (no such parameter), `_PARAMETER` (out of its range, or not a whole number where one
/// is required), `_NEIGHBORS` (more than the profile's capacity), `_METHOD` (the database lacks the data that the
/// method needs, or linear models are set while a joint group has a style of its own, which they do not support),
/// `_NULL`, `_MISALIGNED`, `_HANDLE`.
///
/// # Safety
/// `stylizer` came from `gestus_stylizer_init`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn gestus_stylizer_set_parameter(
    stylizer: *mut GestusStylizer,
    parameter: u32,
    value: f32,
) -> GestusStatus {
    let Ok(parameter) = u16::try_from(parameter) else { return GestusStatus::Unknown };
    // SAFETY: by the caller's contract.
    unsafe { with(stylizer, |s| s.set_parameter(parameter, value)) }
}

/// Writes the value of a parameter, a number of `GestusParameter`, to `*value`.
///
/// Returns `GESTUS_STATUS_UNKNOWN` (no such parameter), `_NULL`, `_MISALIGNED`, `_HANDLE`, `_OVERLAP` (`value` overlaps
/// the stylizer or its database).
///
/// # Safety
/// `stylizer` came from `gestus_stylizer_init`; `value` points at memory for a number.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn gestus_stylizer_parameter(
    stylizer: *mut GestusStylizer,
    parameter: u32,
    value: *mut f32,
) -> GestusStatus {
    // SAFETY: by the caller's contract.
    status(unsafe { stylizer_of(stylizer) }.and_then(|(stylizer, regions)| {
        let known = u16::try_from(parameter).ok().and_then(|number| stylizer.parameter(number));
        // SAFETY: by the caller's contract.
        unsafe { write_value(value, regions, known.ok_or(GestusStatus::Unknown)?) }
    }))
}

/// Resets the stream: the next pose is the first of a new one. Settings are kept.
///
/// Returns `GESTUS_STATUS_NULL`, `_MISALIGNED`, `_HANDLE`.
///
/// # Safety
/// `stylizer` came from `gestus_stylizer_init`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn gestus_stylizer_reset(stylizer: *mut GestusStylizer) -> GestusStatus {
    // SAFETY: by the caller's contract.
    unsafe {
        with(stylizer, |s| {
            s.reset();
            Ok(())
        })
    }
}
