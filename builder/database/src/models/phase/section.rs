//! Phase tables as a section of the blob: `gestus_core::blob::layout::phase`.

use gestus_core::blob::layout::phase::{self, Parts, tables};

use super::{ClassTables, Tables};
use crate::models::numbers::floats;

/// Least step of a dof, m, rad, m/s or rad/s. A finer one is not visible, and would take a pose that is far from the tables
/// beyond the integers of the core.
const MIN_STEP: f64 = 1e-3;
/// Most steps of a dof for one step of its slope: the core holds the slopes to a change by four times its inverse.
const MAX_SLOPE_STEP: f64 = 1.0;

/// Codes of a dof.
struct Scale {
    centre: f64,
    step: f64,
}

/// The section.
pub fn section(model: &Tables) -> Vec<u8> {
    let knots = || model.classes.iter().flat_map(|c| &c.features).flatten();
    let step = narrow(knots().fold(1e-6, |most, v| f64::max(most, v.abs())) / 127.0);
    let dofs = model.classes.first().map_or(0, |c| c.spread.len());
    let scales: Vec<Scale> = (0..dofs).map(|d| scale(&model.classes, d)).collect();
    let mut bytes = vec![0; phase::HEADER];
    let slope_steps = [0, 1].map(|k| slope_step(&model.classes, &scales, k));
    bytes[phase::STEP].copy_from_slice(&(step as f32).to_le_bytes());
    bytes[phase::SLOPE_STEPS].copy_from_slice(&floats(slope_steps));
    // Row by row: the matrices lie by columns.
    bytes.extend(floats(
        model.whitening.iter().flat_map(|m| m.transpose().iter().copied().collect::<Vec<f64>>()),
    ));
    bytes.extend(floats(scales.iter().flat_map(|s| [s.centre, s.step, 1.0 / s.step])));
    let first = bytes.len() + tables::LENGTH * model.classes.len();
    let (mut records, mut contents) = (Vec::new(), Vec::new());
    for class in &model.classes {
        records.extend(record(class, first + contents.len()));
        contents.extend(content(class, step, &scales, slope_steps));
    }
    bytes.extend(records);
    bytes.extend(contents);
    bytes
}

/// A number as the section holds it.
fn narrow(value: f64) -> f64 {
    f64::from(value as f32)
}

fn scale(classes: &[ClassTables], d: usize) -> Scale {
    let values = || classes.iter().flat_map(|c| c.input.iter().chain(&c.output)).map(|row| row[d]);
    let (low, high) = values().fold((f64::MAX, f64::MIN), |(low, high), v| (low.min(v), high.max(v)));
    Scale { centre: narrow((low + high) / 2.0), step: narrow(((high - low) / 254.0).max(MIN_STEP)) }
}

/// Steps of a dof for one step of its slope with speed, or with yaw rate.
fn slope_step(classes: &[ClassTables], scales: &[Scale], k: usize) -> f64 {
    let rows = classes.iter().flat_map(|c| &c.slopes);
    let steps = rows.flat_map(|row| row.iter().zip(scales).map(|(b, s)| (b[k] / s.step).abs()));
    narrow((steps.fold(1e-6, f64::max) / 127.0).min(MAX_SLOPE_STEP))
}

fn record(class: &ClassTables, offset: usize) -> [u8; tables::LENGTH] {
    let mut record = [0; tables::LENGTH];
    record[tables::OFFSET].copy_from_slice(&(offset as u32).to_le_bytes());
    let counts = [
        (tables::FEATURE_KNOTS, class.features.len()),
        (tables::DOF_KNOTS, class.input.len()),
        (tables::SLOPE_KNOTS, class.slopes.len()),
    ];
    for (range, count) in counts {
        record[range].copy_from_slice(&(count as u16).to_le_bytes());
    }
    record[tables::CYCLIC] = u8::from(class.is_cyclic);
    let numbers = [
        (tables::GAIN, vec![class.gain]),
        (tables::FAR, vec![class.far]),
        (tables::DRIFT, class.drift.to_vec()),
        (tables::SECONDS, class.seconds.to_vec()),
        (tables::OUTPUT_SECONDS, class.output_seconds.to_vec()),
    ];
    for (range, values) in numbers {
        record[range].copy_from_slice(&floats(values));
    }
    record
}

/// The tables of a class.
fn content(class: &ClassTables, step: f64, scales: &[Scale], slope_steps: [f64; 2]) -> Vec<u8> {
    let code = |value: f64| value.round().clamp(-127.0, 127.0) as i8;
    let knots: Vec<Vec<i8>> =
        class.features.iter().map(|f| f.iter().map(|v| code(v / step)).collect()).collect();
    let mut bytes = Vec::new();
    for knot in &knots {
        let norm2: u32 = knot.iter().map(|code| i32::from(*code).unsigned_abs().pow(2)).sum();
        bytes.extend(norm2.to_le_bytes());
    }
    bytes.extend(knots.iter().flatten().map(|v| *v as u8));
    for table in [&class.input, &class.output] {
        for row in table {
            bytes.extend(row.iter().zip(scales).map(|(v, s)| code((v - s.centre) / s.step) as u8));
        }
    }
    for row in &class.slopes {
        let slope = |b: &[f64; 2], s: &Scale| [0, 1].map(|k| code(b[k] / (s.step * slope_steps[k])) as u8);
        bytes.extend(row.iter().zip(scales).flat_map(|(b, s)| slope(b, s)));
    }
    bytes.extend(class.spread.iter().zip(scales).map(|(v, s)| (v / s.step).ceil().clamp(1.0, 255.0) as u8));
    bytes.extend(class.contacts.as_flattened().iter().map(|l| (l * 255.0).round() as u8));
    let (features, dofs) = (knots[0].len(), scales.len());
    let parts = Parts::of(knots.len(), class.input.len(), class.slopes.len(), features, dofs);
    bytes.resize(parts.end, 0);
    bytes
}
