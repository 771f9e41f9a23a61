//! Settings of a stylizer: style, labels, masks and strengths. All may change while a stream runs; one that is refused
//! leaves what was in force.

use core::ffi::c_char;

use gestus_core::{ConfigError, Effort, blob::layout::MAX_STYLES};

use crate::{
    memory::{self, Region, disjoint},
    profile::Running,
    status::{Answer, GestusStatus, status},
    stylizer::{GestusStylizer, running},
};

/// Does something with a stylizer.
///
/// # Safety
/// As for [`running`].
unsafe fn with(
    stylizer: *mut GestusStylizer,
    change: impl FnOnce(&mut dyn Running) -> Result<(), ConfigError>,
) -> GestusStatus {
    // SAFETY: the caller's word.
    status(unsafe { running(stylizer) }.and_then(|(stylizer, _)| Ok(change(stylizer)?)))
}

/// Sets the output style: `count` numbers of styles and their weights, which are brought to sum 1. A style may come
/// more than once; its weights add up.
///
/// Answers `GESTUS_STATUS_UNKNOWN` (no such style), `_WEIGHTS` (`count` is 0 or above 32, a weight is negative or not
/// finite, or all are 0), `_NULL`, `_MISALIGNED`, `_HANDLE`, `_OVERLAP` (an array with the stylizer).
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
    // SAFETY: the caller's word is passed on.
    status(unsafe { set_styles(stylizer, None, styles, weights, count) })
}

unsafe fn set_styles(
    stylizer: *mut GestusStylizer,
    group: Option<u16>,
    styles: *const u16,
    weights: *const f32,
    count: usize,
) -> Answer {
    // SAFETY: the caller's word. The arrays are checked to lie elsewhere before they are read.
    let (stylizer, [own, _]) = unsafe { running(stylizer) }?;
    if !(1..=MAX_STYLES).contains(&count) {
        return Err(GestusStatus::Weights);
    }
    disjoint([own, Region::of(styles, count)?])?;
    disjoint([own, Region::of(weights, count)?])?;
    // SAFETY: the caller's word.
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

/// Sets the output style of a joint group alone, in place of the body's: `count` numbers of styles and their weights,
/// which are brought to sum 1; a `count` of 0 gives the group back to the body's style (the arrays are not read then). The
/// group of the root says which feet stand and how long a step takes. Each mix that differs costs the regression once more.
///
/// Answers `GESTUS_STATUS_UNKNOWN` (no such group or style), `_WEIGHTS` (`count` is above 3, a weight is negative or not
/// finite, or all are 0), `_METHOD` (linear models know the whole body's style alone), `_NULL`, `_MISALIGNED`, `_HANDLE`,
/// `_OVERLAP` (an array with the stylizer).
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
        // SAFETY: the caller's word.
        return unsafe { with(stylizer, |s| s.set_group_style(group, &[])) };
    }
    // SAFETY: the caller's word is passed on.
    status(unsafe { set_styles(stylizer, Some(group), styles, weights, count) })
}

/// Sets the output style to the one of that name, alone.
///
/// Answers `GESTUS_STATUS_NOT_FOUND`, `_TEXT` (longer than `GESTUS_NAME_BYTES`, or not UTF-8), `_NULL`,
/// `_MISALIGNED`, `_HANDLE`.
///
/// # Safety
/// `stylizer` came from `gestus_stylizer_init`; `name` points at a text that ends with a zero, apart from the stylizer.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn gestus_stylizer_set_style_name(
    stylizer: *mut GestusStylizer,
    name: *const c_char,
) -> GestusStatus {
    // SAFETY: the caller's word is passed on.
    status(unsafe { set_style_name(stylizer, name) })
}

unsafe fn set_style_name(stylizer: *mut GestusStylizer, name: *const c_char) -> Answer {
    // SAFETY: the caller's word.
    let name = unsafe { memory::text(name) }?;
    let text = Region::of(name.as_ptr(), name.len())?;
    // SAFETY: the caller's word.
    let (stylizer, [own, _]) = unsafe { running(stylizer) }?;
    disjoint([own, text])?;
    let manifest = stylizer.database().manifest().map_err(|_| GestusStatus::BlobManifest)?;
    let style = manifest.styles.find(name).ok_or(GestusStatus::NotFound)?;
    Ok(stylizer.set_style(&[(style, 1.0)])?)
}

/// Sets the output style to the mix that comes nearest to an Effort: how bound (`flow`), strong (`weight`) and sudden
/// (`time`) the motion is to be, each from -3 to 3, 0 being what is usual for the data. Beyond that it is held at the end.
///
/// Answers `GESTUS_STATUS_NO_DIAL` (the database has no effort dial), `_PARAMETER` (not a number), `_NULL`,
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
    let change = |s: &mut dyn Running| {
        if flow.is_nan() || weight.is_nan() || time.is_nan() {
            return Err(ConfigError::OutOfRange);
        }
        s.set_effort(Effort { flow, weight, time })
    };
    // SAFETY: the caller's word.
    unsafe { with(stylizer, change) }
}

/// A label: negative for none.
fn label(number: i32) -> Answer<Option<u16>> {
    match u16::try_from(number) {
        Ok(number) => Ok(Some(number)),
        Err(_) if number < 0 => Ok(None),
        Err(_) => Err(GestusStatus::Unknown),
    }
}

/// Says which action the input is, where the caller knows it; a negative number where not. Only classes of that action
/// are searched then, which takes less time.
///
/// Answers `GESTUS_STATUS_UNKNOWN` (no such action), `_NO_CLASS` (not in the labelled input style), `_NULL`,
/// `_MISALIGNED`, `_HANDLE`.
///
/// # Safety
/// `stylizer` came from `gestus_stylizer_init`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn gestus_stylizer_set_action(
    stylizer: *mut GestusStylizer,
    action: i32,
) -> GestusStatus {
    match label(action) {
        // SAFETY: the caller's word.
        Ok(action) => unsafe { with(stylizer, |s| s.set_action(action)) },
        Err(status) => status,
    }
}

/// Says which style the input is in, where the caller knows it; a negative number where not.
///
/// Answers `GESTUS_STATUS_UNKNOWN` (no such style), `_NO_CLASS` (not of the labelled action), `_NULL`, `_MISALIGNED`,
/// `_HANDLE`.
///
/// # Safety
/// `stylizer` came from `gestus_stylizer_init`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn gestus_stylizer_set_input_style(
    stylizer: *mut GestusStylizer,
    style: i32,
) -> GestusStatus {
    match label(style) {
        // SAFETY: the caller's word.
        Ok(style) => unsafe { with(stylizer, |s| s.set_input_style(style)) },
        Err(status) => status,
    }
}

/// Says whether the search looks at a joint group: 0 leaves it out, any other number looks. At least one group is always
/// looked at.
///
/// Answers `GESTUS_STATUS_UNKNOWN` (no such group), `_PARAMETER` (no group would be left), `_NULL`, `_MISALIGNED`,
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
    // SAFETY: the caller's word.
    unsafe { with(stylizer, |s| s.set_mask(group, searched != 0)) }
}

/// Says how much of the style a joint group takes on: 0 leaves the input as it is, 1 is the style, up to 2 goes beyond.
///
/// Answers `GESTUS_STATUS_UNKNOWN` (no such group), `_PARAMETER` (not from 0 to 2), `_NULL`, `_MISALIGNED`, `_HANDLE`.
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
    // SAFETY: the caller's word.
    unsafe { with(stylizer, |s| s.set_strength(group, strength)) }
}

/// Sets how many distances are computed at most in a class a frame, 64 to 448: what a step costs in the worst case. The
/// first thing to lower where a deadline was missed; frames that reach it report `GESTUS_DEGRADED_VISITS`.
///
/// Answers `GESTUS_STATUS_PARAMETER` (not from 64 to 448), `_NULL`, `_MISALIGNED`, `_HANDLE`.
///
/// # Safety
/// `stylizer` came from `gestus_stylizer_init`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn gestus_stylizer_set_visits(
    stylizer: *mut GestusStylizer,
    visits: u32,
) -> GestusStatus {
    let Ok(visits) = u16::try_from(visits) else { return GestusStatus::Parameter };
    // SAFETY: the caller's word.
    unsafe { with(stylizer, |s| s.set_visits(visits)) }
}

/// Sets a parameter of the method, a number of `GestusParameter`, from the next step on. The stream goes on; with another
/// method it begins anew, and both labels are taken back: say the action and the input style again.
///
/// Answers `GESTUS_STATUS_UNKNOWN` (no such parameter), `_PARAMETER` (out of its range, or no whole number where one is
/// wanted), `_NEIGHBORS` (more than the profile takes), `_METHOD` (the database does not hold what the method needs, or the
/// method is that of linear models, which style the whole body, while a joint group has a style of its own), `_NULL`,
/// `_MISALIGNED`, `_HANDLE`.
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
    // SAFETY: the caller's word.
    unsafe { with(stylizer, |s| s.set_parameter(parameter, value)) }
}

/// Puts the value that a parameter has, a number of `GestusParameter`, into `*value`.
///
/// Answers `GESTUS_STATUS_UNKNOWN` (no such parameter), `_NULL`, `_MISALIGNED`, `_HANDLE`, `_OVERLAP` (`value` with the
/// stylizer).
///
/// # Safety
/// `stylizer` came from `gestus_stylizer_init`; `value` points at memory for a number.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn gestus_stylizer_parameter(
    stylizer: *mut GestusStylizer,
    parameter: u32,
    value: *mut f32,
) -> GestusStatus {
    // SAFETY: the caller's word. The place is checked to lie elsewhere before it is written.
    status(unsafe { running(stylizer) }.and_then(|(stylizer, [own, _])| {
        disjoint([own, Region::of(value, 1)?])?;
        let known = u16::try_from(parameter).ok().and_then(|number| stylizer.parameter(number));
        // SAFETY: the caller's word.
        unsafe { memory::put(value, &[known.ok_or(GestusStatus::Unknown)?]) }
    }))
}

/// Forgets the stream; the next pose is a first pose. Settings stay.
///
/// Answers `GESTUS_STATUS_NULL`, `_MISALIGNED`, `_HANDLE`.
///
/// # Safety
/// `stylizer` came from `gestus_stylizer_init`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn gestus_stylizer_reset(stylizer: *mut GestusStylizer) -> GestusStatus {
    // SAFETY: the caller's word.
    unsafe {
        with(stylizer, |s| {
            s.reset();
            Ok(())
        })
    }
}
