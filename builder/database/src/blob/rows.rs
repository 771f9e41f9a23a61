//! Rows: the dofs of every frame, quantised and packed in blocks. `gestus_core::blob` unpacks them.
//!
//! A dof's quantisation step depends on how far it moves the body: an error of one radian in a hip moves a whole leg, in
//! a toe almost nothing. Steps inversely proportional to that leverage need the fewest bits for a mean joint error
//! (classical bit allocation: equal marginal error per bit). A common factor is then searched such that the error measured
//! on the clips meets the target.

use gestus_core::blob::layout::{block, dof};
use nalgebra::Vector3;
use thiserror::Error;

use gestus_motion::body::{Body, first_dof};

/// Rows that could not be packed.
#[derive(Debug, Error, PartialEq)]
pub enum PackError {
    /// A value does not fit 16 bits of steps.
    #[error("dof {dof} is {value} in row {row}, more than 16 bits of steps")]
    TooLarge {
        /// The dof.
        dof: usize,
        /// The row.
        row: usize,
        /// The value.
        value: f32,
    },
}

/// The packed rows of a database.
#[derive(Debug, Clone, PartialEq)]
pub struct PackedRows {
    /// Rows of a block.
    pub block_rows: usize,
    /// Where each block starts in [`bytes`](Self::bytes).
    pub blocks: Vec<u32>,
    /// The rows section.
    pub bytes: Vec<u8>,
}

/// Packs rows, shape `[rows][D]`, with one quantisation step per dof, in blocks of `block_rows` (a power of two).
///
/// # Errors
/// [`PackError`] if a value is out of range.
pub fn pack(rows: &[Vec<f32>], steps: &[f32], block_rows: usize) -> Result<PackedRows, PackError> {
    let mut packed = PackedRows { block_rows, blocks: Vec::new(), bytes: Vec::new() };
    for (b, chunk) in rows.chunks(block_rows).enumerate() {
        let codes: Vec<Vec<i32>> = chunk
            .iter()
            .enumerate()
            .map(|(i, row)| {
                codes(row, steps).map_err(|(dof, value)| PackError::TooLarge {
                    dof,
                    row: b * block_rows + i,
                    value,
                })
            })
            .collect::<Result<_, _>>()?;
        packed.blocks.push(packed.bytes.len() as u32);
        pack_block(&codes, &mut packed.bytes);
    }
    packed.bytes.extend([0; block::PADDING]);
    Ok(packed)
}

fn codes(row: &[f32], steps: &[f32]) -> Result<Vec<i32>, (usize, f32)> {
    row.iter()
        .zip(steps)
        .enumerate()
        .map(|(d, (&value, &step))| {
            let code = (value / step).round();
            // A block's field has 15 bits: within half of the range of i16 every difference fits.
            if code.abs() < 16_383.0 { Ok(code as i32) } else { Err((d, value)) }
        })
        .collect()
}

fn pack_block(codes: &[Vec<i32>], bytes: &mut Vec<u8>) {
    let dofs = codes[0].len();
    let column = |d: usize| codes.iter().map(move |row| row[d]);
    let bases: Vec<i32> = (0..dofs).map(|d| column(d).min().unwrap_or(0)).collect();
    let widths: Vec<u32> =
        (0..dofs).map(|d| 32 - ((column(d).max().unwrap_or(0) - bases[d]) as u32).leading_zeros()).collect();
    let row_bytes = widths.iter().sum::<u32>().div_ceil(8) as usize;
    bytes.extend((row_bytes as u16).to_le_bytes());
    for base in &bases {
        bytes.extend((*base as i16).to_le_bytes());
    }
    for pair in widths.chunks(2) {
        bytes.push((pair[0] | pair.get(1).copied().unwrap_or(0) << 4) as u8);
    }
    for row in codes {
        let (mut held, mut bits, start) = (0u64, 0, bytes.len());
        for ((code, base), width) in row.iter().zip(&bases).zip(&widths) {
            held |= ((code - base) as u64) << bits;
            bits += width;
            while bits >= 8 {
                bytes.push(held as u8);
                held >>= 8;
                bits -= 8;
            }
        }
        if bits > 0 {
            bytes.push(held as u8);
        }
        debug_assert_eq!(bytes.len() - start, row_bytes);
    }
    if bytes.len() % 2 == 1 {
        bytes.push(0);
    }
}

/// A row rounded to whole steps, as the core reads it.
pub fn rounded(row: &[f32], steps: &[f32]) -> Vec<f32> {
    row.iter().zip(steps).map(|(v, s)| (v / s).round() * s).collect()
}

/// Mean distance between the joints of two rows, hips-centred but with height and tilt, metres.
pub fn joint_error(body: &Body, a: &[f32], b: &[f32]) -> f64 {
    let positions = |row: &[f32]| {
        let row: Vec<f64> = row.iter().map(|&v| f64::from(v)).collect();
        body.pose(&row, [0.0; 2], 0.0).positions(&body.skeleton)
    };
    let (p, q) = (positions(a), positions(b));
    p.iter().zip(&q).map(|(p, q)| (p - q).norm()).sum::<f64>() / p.len() as f64
}

/// Quantisation steps for a mean joint error of `target_m`, measured on a sample of the rows.
pub fn choose_steps(body: &Body, rows: &[Vec<f32>], target_m: f64) -> Vec<f32> {
    let levers = levers(body);
    let sample: Vec<&Vec<f32>> = rows.iter().step_by(rows.len().div_ceil(1500).max(1)).collect();
    // The 14 bits of a field set the least step of each dof.
    let largest: Vec<f32> =
        (0..body.dofs()).map(|d| rows.iter().fold(0.0f32, |m, r| m.max(r[d].abs())) / 16_000.0).collect();
    let steps_at = |factor: f64| -> Vec<f32> {
        (0..body.dofs())
            .map(|d| {
                let step = match d {
                    dof::HEIGHT => factor,
                    // Velocities move no joint of the pose; a millimetre a second is 3 cm after half a minute of
                    // errors that all point the same way, which rounding errors don't.
                    dof::FORWARD | dof::LEFT => 2e-3,
                    dof::YAW => 2e-3,
                    _ => factor / levers[d],
                };
                (step as f32).max(largest[d])
            })
            .collect()
    };
    let error = |steps: &[f32]| {
        sample.iter().map(|row| joint_error(body, row, &rounded(row, steps))).sum::<f64>()
            / sample.len() as f64
    };
    let (mut low, mut high) = (1e-6, 0.1);
    for _ in 0..24 {
        let middle = f64::sqrt(low * high);
        if error(&steps_at(middle)) > target_m { high = middle } else { low = middle }
    }
    steps_at(low)
}

/// Root mean square movement of all joints per radian of each dof, metres.
fn levers(body: &Body) -> Vec<f64> {
    let skeleton = &body.skeleton;
    let rest = vec![0.0; body.dofs()];
    let positions = body.pose(&rest, [0.0; 2], 0.0).positions(skeleton);
    let joints = skeleton.joints();
    let mut levers = vec![1.0; body.dofs()];
    for j in 0..joints {
        let below = |mut k: usize| loop {
            if k == j {
                return true;
            }
            match skeleton.parents[k] {
                Some(p) => k = p,
                None => return false,
            }
        };
        let arms: Vec<Vector3<f64>> =
            (0..joints).filter(|&k| below(k)).map(|k| positions[k] - positions[j]).collect();
        // The mean square distance from a random axis is two thirds of the squared length.
        let sweep = arms.iter().map(|a| a.norm_squared()).sum::<f64>() * (2.0 / 3.0) / joints as f64;
        // Hands, head and toes have no joint behind them; they count as 4 cm long.
        let own = 0.04f64.powi(2) / joints as f64;
        let at = first_dof(j);
        levers[at..at + 3].fill((sweep + own).sqrt());
    }
    levers
}

#[cfg(test)]
mod tests {
    use super::*;

    fn unpack(packed: &PackedRows, steps: &[f32], row: usize) -> Vec<f32> {
        let dofs = steps.len();
        let start = packed.blocks[row / packed.block_rows] as usize;
        let bytes = &packed.bytes[start..];
        let row_bytes = usize::from(u16::from_le_bytes([bytes[0], bytes[1]]));
        let within = row % packed.block_rows;
        let fields = &bytes[block::header(dofs) + within * row_bytes..];
        let mut bit = 0;
        (0..dofs)
            .map(|d| {
                let base = i16::from_le_bytes([bytes[2 + 2 * d], bytes[3 + 2 * d]]);
                let pair = bytes[2 + 2 * dofs + d / 2];
                let width = usize::from(if d % 2 == 0 { pair & 15 } else { pair >> 4 });
                let field = (0..width)
                    .map(|i| i32::from(fields[(bit + i) / 8] >> ((bit + i) % 8) & 1) << i)
                    .sum::<i32>();
                bit += width;
                (i32::from(base) + field) as f32 * steps[d]
            })
            .collect()
    }

    #[test]
    fn every_row_comes_back_rounded_to_its_steps() {
        let steps = [0.01f32, 0.002, 0.5, 0.1, 1e-3];
        let rows: Vec<Vec<f32>> = (0..45)
            .map(|i| {
                let t = i as f32 * 0.13;
                vec![t.sin(), 3.0 * (2.0 * t).cos(), t * t, 7.0, (t * 40.0).sin() * 0.3]
            })
            .collect();
        let packed = pack(&rows, &steps, 16).unwrap();
        for (i, row) in rows.iter().enumerate() {
            for (a, b) in unpack(&packed, &steps, i).iter().zip(rounded(row, &steps)) {
                assert!((a - b).abs() < 1e-6, "row {i}: {a} {b}");
            }
        }
    }

    #[test]
    fn a_value_out_of_range_is_named() {
        let rows = vec![vec![0.0, 1.0], vec![0.0, 1e6]];
        assert_eq!(pack(&rows, &[0.1, 0.1], 16), Err(PackError::TooLarge { dof: 1, row: 1, value: 1e6 }));
    }
}
