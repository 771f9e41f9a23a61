//! The section of statistics: `gestus_core::blob::layout::statistic`.
//!
//! One table per style over all its frames. Each table also has the projections of the dofs that detect foot contacts best
//! in the frames of all styles ([`crate::models::footplant`]): input of any style may come.
//!
//! The core measures how far a frame is from the input style in its spreads. A joint that hardly moves in that style's clips
//! is never as still in another take, so [`floored`] gives it a least spread.

use gestus_core::{
    blob::layout::{NONE, dof, statistic},
    math::quaternion::Quaternion,
};

use crate::models::{
    footplant::{self, Footplant},
    numbers::{floats, narrow},
    statistic::mean::{self, Spread},
};
use crate::registration::warp::STILL;
use gestus_motion::{
    body::{Body, about_y},
    corpus::Example,
    statistics::moments,
};

/// Least spread of the height of the input style, metres; that of a joint is [`STILL`].
const STILL_HEIGHT_M: f64 = 0.01;

/// Statistics of one style, over one action or all.
#[derive(Debug, Clone)]
pub struct Table {
    /// The style.
    pub style: usize,
    /// The action; `None`: all.
    pub action: Option<usize>,
    /// Mean and standard deviation of height, forward and left velocity.
    pub root: [(f64, f64); 3],
    /// When the left and the right foot stand, by the dofs.
    pub feet: [Footplant; 2],
    /// Of each joint; the root's without its heading.
    pub joints: Vec<Spread>,
}

impl Table {
    /// The statistics of clips of a style, over one action or all, whose dofs are `dofs`; means by `rounds` towards the
    /// geodesic mean. `feet` come from [`feet`].
    pub fn of(
        body: &Body,
        (style, action): (usize, Option<usize>),
        clips: &[(&Example, &[Vec<f64>])],
        feet: &[Footplant; 2],
        rounds: usize,
    ) -> Self {
        let rows = || clips.iter().flat_map(|(_, dofs)| dofs.iter());
        let root = [dof::HEIGHT, dof::FORWARD, dof::LEFT].map(|d| moments(rows().map(move |r| r[d]), 1e-3));
        let joints = (0..body.skeleton.joints())
            .map(|j| {
                let all: Vec<Quaternion> = clips
                    .iter()
                    .flat_map(|(example, _)| &example.clip.frames)
                    .map(|f| match j {
                        0 => narrow(&(about_y(-body.heading(f)) * f.rotations[0])),
                        _ => narrow(&f.rotations[j]),
                    })
                    .collect();
                mean::spread(all.iter().copied(), rounds)
            })
            .collect();
        Self { style, action, root, feet: feet.clone(), joints }
    }
}

/// Gives joints and height a least spread in the style `from`, the one of unlabelled input.
///
/// The core also moves joints by the ratio of the output's spread to the input's, so the tables of the other styles change
/// with it. A style that moves such a joint less keeps its ratio: with the floor alone, styles that move little would move
/// as the input does. One that moves it more has its ratio to the floor. What moves enough in the style `from` stays.
#[must_use]
pub fn floored(mut tables: Vec<Table>, from: usize) -> Vec<Table> {
    let inputs: Vec<Table> = tables.iter().filter(|table| table.style == from).cloned().collect();
    for input in &inputs {
        for table in tables.iter_mut().filter(|table| table.action == input.action) {
            table.root[0].1 = raised(table.root[0].1, input.root[0].1, STILL_HEIGHT_M);
            for (joint, input) in table.joints.iter_mut().zip(&input.joints) {
                let spreads = [joint.deviation, input.deviation].map(f64::from);
                joint.deviation = raised(spreads[0], spreads[1], STILL) as f32;
            }
        }
    }
    tables
}

/// The spread of a style, where that of the input style is `input` and is to be at least `least`.
fn raised(spread: f64, input: f64, least: f64) -> f64 {
    if input >= least {
        spread
    } else if spread < input {
        spread * least / input
    } else {
        spread.max(least)
    }
}

/// Footplants of clips of every style: fitted to standardised dofs, converted for dofs as they are.
pub fn feet(clips: &[(&Example, &[Vec<f64>])]) -> [Footplant; 2] {
    let rows = || clips.iter().flat_map(|(_, dofs)| dofs.iter());
    let dofs = rows().next().map_or(0, Vec::len);
    let spreads: Vec<(f64, f64)> = (0..dofs).map(|d| moments(rows().map(move |r| r[d]), 1e-3)).collect();
    let features: Vec<Vec<f64>> =
        rows().map(|r| r.iter().zip(&spreads).map(|(v, (mean, sd))| (v - mean) / sd).collect()).collect();
    [0, 1].map(|side| {
        let stands: Vec<bool> =
            clips.iter().flat_map(|(e, dofs)| e.contacts.iter().take(dofs.len()).map(|c| c[side])).collect();
        let Footplant { projection, boundary } = footplant::fit(&features, &stands);
        let offset: f64 = projection.iter().zip(&spreads).map(|(w, (mean, sd))| w * mean / sd).sum();
        let projection = projection.iter().zip(&spreads).map(|(w, (_, sd))| w / sd).collect();
        Footplant { projection, boundary: boundary + offset }
    })
}

/// Encodes the tables; those of `from` are used for an unlabelled input.
pub fn section(from: usize, tables: &[Table]) -> Vec<u8> {
    let mut bytes = vec![0; statistic::HEADER];
    bytes[statistic::FROM].copy_from_slice(&(from as u16).to_le_bytes());
    bytes[statistic::TABLES].copy_from_slice(&(tables.len() as u16).to_le_bytes());
    for table in tables {
        let mut head = [0; statistic::ROOT];
        head[statistic::STYLE].copy_from_slice(&(table.style as u16).to_le_bytes());
        head[statistic::ACTION].copy_from_slice(&table.action.map_or(NONE, |a| a as u16).to_le_bytes());
        bytes.extend(head);
        bytes.extend(floats(table.root.iter().flat_map(|r| [r.0, r.1])));
        for foot in &table.feet {
            bytes.extend(floats(std::iter::once(foot.boundary).chain(foot.projection.iter().copied())));
        }
        let joint = |s: &Spread| {
            let [x, y, z, w] = s.mean;
            [x, y, z, w, s.deviation].map(f64::from)
        };
        bytes.extend(floats(table.joints.iter().flat_map(joint)));
    }
    bytes
}

#[cfg(test)]
mod tests {
    use gestus_core::math::quaternion::IDENTITY;

    use super::*;

    fn table(style: usize, action: Option<usize>, height: f64, joint: f32) -> Table {
        let foot = Footplant { projection: Vec::new(), boundary: 0.0 };
        Table {
            style,
            action,
            root: [(0.9, height), (1.2, 0.002), (0.0, 0.002)],
            feet: [foot.clone(), foot],
            joints: vec![Spread { mean: IDENTITY, deviation: joint }],
        }
    }

    /// Right toes of captured gestures deviate by a thousandth of a radian: two degrees were a thousand variances, and most
    /// takes of other styles were passed through as unlike the database.
    #[test]
    fn the_input_style_has_least_spreads_and_smaller_ones_keep_their_ratio() {
        let walk = Some(0);
        let tables = vec![
            table(0, None, 0.004, 0.02),
            table(1, None, 0.002, 0.01),
            table(2, None, 0.006, 0.03),
            table(3, None, 0.03, 0.2),
            // By action, it is the input style's spread in that action that counts.
            table(0, walk, 0.02, 0.1),
            table(1, walk, 0.001, 0.01),
        ];
        let spreads =
            floored(tables, 0).into_iter().map(|t| (t.root[0].1, t.joints[0].deviation, t.root[1].1));
        let expected = [(0.01, 0.05), (0.005, 0.025), (0.01, 0.05), (0.03, 0.2), (0.02, 0.1), (0.001, 0.01)];
        for (i, ((height, joint, velocity), expected)) in spreads.zip(expected).enumerate() {
            assert!(
                (height - expected.0).abs() < 1e-9 && (joint - expected.1).abs() < 1e-6,
                "table {i}: {height} {joint}"
            );
            assert_eq!(velocity, 0.002, "table {i}");
        }
    }
}
