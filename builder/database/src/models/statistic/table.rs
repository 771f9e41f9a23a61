//! The section of statistics: `gestus_core::blob::layout::statistic`.
//!
//! One table per style over all its frames. Each table also has the projections of the dofs that detect foot contacts best
//! in the frames of all styles ([`crate::models::footplant`]): input of any style may come.

use gestus_core::{
    blob::layout::{NONE, dof, statistic},
    math::quaternion::Quaternion,
};

use crate::models::statistic::mean::{self, Spread};
use crate::models::{
    footplant::{self, Footplant},
    numbers::{floats, narrow},
};
use gestus_motion::{
    body::{Body, about_y},
    corpus::Example,
    statistics::moments,
};

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
