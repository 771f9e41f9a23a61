//! The section of linear models, encoded and decoded: `gestus_core::blob::layout::lti`.

use gestus_core::{
    Database,
    blob::layout::{NONE, lti},
};
use nalgebra::DMatrix;

use crate::models::lti::{Model, Unit, n4sid::System};
use crate::models::{footplant::Footplant, numbers::floats};

/// A model with its output style and the action that it was estimated from; `None`: all.
#[derive(Debug, Clone)]
pub struct Labelled {
    /// The style.
    pub style: usize,
    /// The action.
    pub action: Option<usize>,
    /// The model.
    pub model: Model,
}

/// Encodes models whose input style is `from`.
pub fn section(from: usize, models: &[Labelled]) -> Vec<u8> {
    let mut header = [0; lti::HEADER];
    header[lti::FROM].copy_from_slice(&(from as u16).to_le_bytes());
    header[lti::MODELS].copy_from_slice(&(models.len() as u16).to_le_bytes());
    let mut directory = header.to_vec();
    let mut bodies = Vec::new();
    for Labelled { style, action, model } in models {
        let start = lti::HEADER + models.len() * lti::ENTRY + bodies.len();
        let body = body(model);
        let mut entry = [0; lti::ENTRY];
        for (range, value) in [
            (lti::STYLE, *style as u16),
            (lti::ACTION, action.map_or(NONE, |a| a as u16)),
            (lti::UNITS, model.units.len() as u16),
            (lti::STATES, model.states() as u16),
        ] {
            entry[range].copy_from_slice(&value.to_le_bytes());
        }
        entry[lti::OFFSET].copy_from_slice(&(start as u32).to_le_bytes());
        entry[lti::BYTES].copy_from_slice(&(body.len() as u32).to_le_bytes());
        directory.extend(entry);
        bodies.extend(body);
    }
    directory.extend(bodies);
    directory
}

fn body(model: &Model) -> Vec<u8> {
    let dofs = model.inputs.iter().zip(&model.outputs).flat_map(|(i, o)| [i.0, i.1, o.0, o.1]);
    let mut bytes = floats(dofs);
    let (mean, deviation) = model.outputs[model.inputs.len()];
    bytes.extend(floats([mean, deviation]));
    for Footplant { projection, boundary } in &model.feet {
        bytes.extend(floats(std::iter::once(*boundary).chain(projection.iter().copied())));
    }
    for Unit { first_input, first_output, system, .. } in &model.units {
        let mut header = [0; lti::UNIT];
        header[lti::ORDER] = system.order() as u8;
        header[lti::INPUTS] = system.b.ncols() as u8;
        header[lti::OUTPUTS] = system.d.nrows() as u8;
        header[lti::FIRST_INPUT].copy_from_slice(&(*first_input as u16).to_le_bytes());
        header[lti::FIRST_OUTPUT].copy_from_slice(&(*first_output as u16).to_le_bytes());
        bytes.extend(header);
        for matrix in [&system.a, &system.b, &system.c, &system.d] {
            bytes.extend(floats(matrix.row_iter().flat_map(|r| r.iter().copied().collect::<Vec<_>>())));
        }
    }
    bytes
}

impl Model {
    /// Model `index` of a database, as it was written.
    pub fn of(database: &Database<'_>, index: usize) -> Self {
        let dofs = database.counts().dofs;
        let view = database.linear_model(index);
        let moments = |at: usize, d: usize| {
            let numbers = view.dof(d).map(f64::from);
            (numbers[at], numbers[at + 1])
        };
        let units = view.units().map(|unit| {
            let mut numbers = unit.numbers;
            let mut matrix = |rows: usize, columns: usize| {
                let values: Vec<f64> = (&mut numbers).take(rows * columns).map(f64::from).collect();
                DMatrix::from_row_slice(rows, columns, &values)
            };
            let (n, m, p) = (unit.order, unit.inputs, unit.outputs);
            let (a, b) = (matrix(n, n), matrix(n, m));
            let (c, d) = (matrix(p, n), matrix(p, m));
            Unit {
                first_input: unit.first_input,
                first_output: unit.first_output,
                system: System { a, b, c, d },
            }
        });
        let foot = |side: usize| {
            let (boundary, projection) = view.foot(side);
            Footplant {
                boundary: f64::from(boundary),
                projection: projection.take(view.states).map(f64::from).collect(),
            }
        };
        Self {
            inputs: (0..dofs).map(|d| moments(0, d)).collect(),
            outputs: (0..=dofs).map(|d| moments(2, d)).collect(),
            units: units.collect(),
            feet: [foot(0), foot(1)],
        }
    }
}
