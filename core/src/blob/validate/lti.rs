//! Linear time-invariant models: directory, labels, ranges, dofs and poles.

use super::labels::Labels;
use crate::blob::{
    Database, LinearModel, Numbers, Unit,
    check::{Checked, check, in_range, is_deviation, length, reserved},
    layout::{MAX_ORDER, lti, section},
    read::{Record, u16_at},
};

/// Checks the section's directory, then each model.
#[inline(never)]
pub(super) fn linear_models(db: &Database<'_>, bytes: &[u8]) -> Checked {
    let c = db.counts();
    let (id, models) = (section::LTI, db.linear_models());
    let mut next = lti::HEADER + models * lti::ENTRY;
    if bytes.len() < next {
        return length(id, next, bytes.len());
    }
    reserved(id, Record(bytes).zero(lti::RESERVED))?;
    let from = u16_at(bytes, lti::FROM.start);
    check(id, models, usize::from(from) < c.styles)?;
    for i in 0..models {
        let entry = Record::of(bytes.get(lti::HEADER..).unwrap_or(&[]), i, lti::ENTRY);
        let model = db.linear_model(i);
        let labels_fit = usize::from(model.style) < c.styles
            && model.style != from
            && model.action.is_none_or(|a| usize::from(a) < c.actions);
        check(id, i, labels_fit && entry.u32(lti::OFFSET) as usize == next)?;
        // At most one unit a joint and two more for the root. A stylizer has memory for `MAX_ORDER` states a joint.
        check(id, i, model.units <= c.joints + 2 && model.states <= MAX_ORDER * c.joints)?;
        next = next.saturating_add(entry.u32(lti::BYTES) as usize);
        check(id, i, next <= bytes.len())?;
        check(id, i, one_model(&model, c.dofs))?;
    }
    length(id, next, bytes.len())?;
    labels(db, from)
}

/// Checks that no two models have the same labels, and that every style but `from` has one of all actions.
// Not inlined: the labels are not on the stack while poles are checked.
#[inline(never)]
fn labels(db: &Database<'_>, from: u16) -> Checked {
    let mut labels = Labels::new();
    let models = db.linear_models();
    for i in 0..models {
        let model = db.linear_model(i);
        check(section::LTI, i, labels.insert(model.style, model.action))?;
    }
    check(section::LTI, models, labels.cover(db.counts().styles, Some(from)))
}

#[inline]
fn one_model(model: &LinearModel<'_>, dofs: usize) -> bool {
    let units = lti::units(dofs, model.states);
    if model.bytes() < units {
        return false;
    }
    let dofs_fit = (0..=dofs).all(|d| {
        let [input_mean, input_deviation, output_mean, output_deviation] = model.dof(d);
        in_range([input_mean, output_mean].into_iter(), 1e3)
            && is_deviation(input_deviation)
            && is_deviation(output_deviation)
    });
    let feet_fit = in_range(Numbers::at(model.bytes.get(..units).unwrap_or(&[]), lti::feet(dofs)), 1e6);
    if !dofs_fit || !feet_fit {
        return false;
    }
    let (mut at, mut states) = (units, 0);
    for _ in 0..model.units {
        let unit = LinearModel::unit(model.bytes, at);
        let numbers = lti::numbers(unit.order, unit.inputs, unit.outputs);
        let sizes_fit = unit.order <= MAX_ORDER
            && (1..=4).contains(&unit.inputs)
            && (1..=4).contains(&unit.outputs)
            && unit.first_input + unit.inputs <= dofs
            && unit.first_output + unit.outputs <= dofs + 1
            && model.bytes.get(at + lti::UNIT_RESERVED) == Some(&0);
        if !sizes_fit || unit.numbers.count() < numbers {
            return false;
        }
        let mut rest = unit.numbers;
        if !in_range(rest.take_first(numbers), 1e4) || !is_stable(&unit) {
            return false;
        }
        at += lti::UNIT + 4 * numbers;
        states += unit.order;
    }
    at == model.bytes() && states == model.states
}

/// The rows of a matrix of up to [`MAX_ORDER`] columns; further columns are 0.
type Rows = [[f32; MAX_ORDER]];

/// Writes the square of a matrix, and sums up the squares of what it writes. With rows of a length that the compiler
/// knows, one stays in registers.
#[inline]
fn square(matrix: &Rows, out: &mut Rows) -> f32 {
    let mut sum = 0.0;
    for (row, out) in matrix.iter().zip(out) {
        let mut sums = [0.0; MAX_ORDER];
        for (factor, other) in row.iter().zip(matrix) {
            for (sum, value) in sums.iter_mut().zip(other) {
                *sum += factor * value;
            }
        }
        sum = sums.iter().fold(sum, |sum, v| sum + v * v);
        *out = sums;
    }
    sum
}

/// True if every pole lies inside the unit circle, so that `A` to the power of 1,024 (ten squarings) is small. A power
/// whose squares sum up to 1 or less will do: further powers are no larger.
#[inline(never)]
fn is_stable(unit: &Unit<'_>) -> bool {
    let [mut power, mut next] = [[[0.0; MAX_ORDER]; MAX_ORDER]; 2];
    let (Some(mut power), Some(mut next)) = (power.get_mut(..unit.order), next.get_mut(..unit.order)) else {
        return false;
    };
    let mut numbers = unit.numbers;
    for row in power.iter_mut() {
        row.iter_mut().zip(numbers.take_first(unit.order)).for_each(|(slot, number)| *slot = number);
    }
    for _ in 0..10 {
        // An unstable system gives more than 1, infinity or NaN.
        if (0.0..=1.0).contains(&square(power, next)) {
            return true;
        }
        core::mem::swap(&mut power, &mut next);
    }
    false
}
