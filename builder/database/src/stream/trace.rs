//! Records every step of a stream so that it can be recomputed independently: `gestus translate --trace`,
//! `docs/CHECKING.md`.

use std::{io, path::Path};

use gestus_core::{Database, Report, search::found::Found};
use serde_json::json;

use crate::stream::{Request, Watcher};
use gestus_motion::formats::npy::Archive;

/// Intermediate results of the steps of a stream. Shapes: T frames, C classes, K neighbors, D dofs, F features.
#[derive(Debug)]
pub struct Trace {
    classes: usize,
    k: usize,
    features: usize,
    dofs: usize,
    first_rows: Vec<usize>,
    input: Vec<f32>,
    input_prev: Vec<f32>,
    output_prev: Vec<f32>,
    predicted: Vec<f32>,
    query: Vec<f32>,
    proportion: Vec<f32>,
    mean_distance2: Vec<f32>,
    neighbors: Vec<i32>,
    distance2: Vec<f32>,
    timing_neighbors: Vec<i32>,
    timing_weights: Vec<f32>,
    step_seconds: Vec<f32>,
    contacts: Vec<u8>,
    /// Frames are counted here; places of the arrays follow.
    frames: usize,
}

impl Trace {
    /// An empty trace.
    pub fn of(database: &Database<'_>, request: &Request) -> Self {
        let counts = database.counts();
        Self {
            classes: counts.classes,
            k: usize::from(request.config.k),
            features: counts.features,
            dofs: counts.dofs,
            first_rows: database.classes().map(|c| c.first_row).collect(),
            input: Vec::new(),
            input_prev: Vec::new(),
            output_prev: Vec::new(),
            predicted: Vec::new(),
            query: Vec::new(),
            proportion: Vec::new(),
            mean_distance2: Vec::new(),
            neighbors: Vec::new(),
            distance2: Vec::new(),
            timing_neighbors: Vec::new(),
            timing_weights: Vec::new(),
            step_seconds: Vec::new(),
            contacts: Vec::new(),
            frames: 0,
        }
    }

    fn place(&self, class: usize, k: usize) -> usize {
        (self.frames * self.classes + class) * self.k + k
    }

    /// Writes the trace as `.npz`.
    ///
    /// # Errors
    /// Errors of the file system.
    pub fn write(&self, path: &Path, database: &Database<'_>, request: &Request) -> io::Result<()> {
        let (t, c, k, d) = (self.frames, self.classes, self.k, self.dofs);
        // Other methods than the mixture have no query, no classes and no neighbors.
        let filled = |values: &[f32], count: usize, with: f32| -> Vec<f32> {
            values.iter().copied().chain(std::iter::repeat(with)).take(count).collect()
        };
        let none = |values: &[i32]| -> Vec<i32> {
            values.iter().copied().chain(std::iter::repeat(-1)).take(t * c * k).collect()
        };
        let mut archive = Archive::create(path)?;
        archive.add("input", &[t, d], &self.input)?;
        archive.add("input_prev", &[t, d], &self.input_prev)?;
        archive.add("output_prev", &[t, d], &self.output_prev)?;
        archive.add("predicted", &[t, d], &self.predicted)?;
        archive.add("query", &[t, self.features], &filled(&self.query, t * self.features, 0.0))?;
        archive.add("proportion", &[t, c], &filled(&self.proportion, t * c, 0.0))?;
        archive.add("mean_distance2", &[t, c], &filled(&self.mean_distance2, t * c, -1.0))?;
        archive.add("neighbors", &[t, c, k], &none(&self.neighbors))?;
        archive.add("distance2", &[t, c, k], &filled(&self.distance2, t * c * k, -1.0))?;
        archive.add("timing_neighbors", &[t, c, k], &none(&self.timing_neighbors))?;
        archive.add("timing_weights", &[t, c, k], &filled(&self.timing_weights, t * c * k, 0.0))?;
        archive.add("step_seconds", &[t], &self.step_seconds)?;
        archive.add("contacts", &[t, 2], &self.contacts)?;
        let config = config(database, request).to_string().into_bytes();
        archive.add("config", &[config.len()], &config)?;
        archive.finish()
    }
}

/// The configuration of a stream as JSON.
fn config(database: &Database<'_>, request: &Request) -> serde_json::Value {
    let counts = database.counts();
    let config = &request.config;
    let total: f32 = request.style.iter().map(|s| s.1).sum();
    let mut weights = vec![0.0; counts.styles];
    for &(style, weight) in &request.style {
        weights[usize::from(style)] += weight / total;
    }
    let strength =
        |group: usize| request.strength.iter().rev().find(|s| usize::from(s.0) == group).map_or(1.0, |s| s.1);
    let searched = |group: usize| u8::from(!request.masked.iter().any(|&m| usize::from(m) == group));
    json!({
        "method": config.method.name(),
        "k": config.k,
        "k_per_class": database.classes().map(|c| c.k_cap.min(usize::from(config.k))).collect::<Vec<_>>(),
        "lambda": config.lambda,
        "ridge_mode": config.ridge.name(),
        "feedback": config.feedback,
        "output_kappa": config.output_kappa,
        "liveliness": config.liveliness,
        "settle_s": config.settle_s,
        "follow": config.follow,
        "delta": config.delta,
        "kappa": config.kappa,
        "rho": config.rho,
        "prune": config.prune,
        "style_weights": weights,
        "group_styles": request.group_styles,
        "strength": (0..counts.dofs).map(|d| strength(database.group_of_dof(d))).collect::<Vec<_>>(),
        "metric_mask": (0..counts.features).map(|f| searched(database.feature_group(f))).collect::<Vec<_>>(),
        "action": request.action,
        "input_style": request.input_style,
        "timing": if request.bounds.is_some() { "bounded" } else { config.timing.name() },
    })
}

impl Watcher for Trace {
    fn query(&mut self, feature: &[f32]) {
        // Start of a frame: entries that are not written stay -1.
        let (c, k) = (self.classes, self.k);
        self.query.extend(feature);
        self.proportion.resize((self.frames + 1) * c, 0.0);
        self.mean_distance2.resize((self.frames + 1) * c, -1.0);
        self.neighbors.resize((self.frames + 1) * c * k, -1);
        self.distance2.resize((self.frames + 1) * c * k, -1.0);
        self.timing_neighbors.resize((self.frames + 1) * c * k, -1);
        self.timing_weights.resize((self.frames + 1) * c * k, 0.0);
    }

    fn searched(&mut self, class: usize, found: &Found<'_>) {
        self.mean_distance2[self.frames * self.classes + class] = found.mean_distance2;
        for (i, (row, distance2)) in found.neighbors().enumerate() {
            let place = self.place(class, i);
            self.neighbors[place] = (self.first_rows[class] + usize::from(row)) as i32;
            self.distance2[place] = distance2;
        }
    }

    fn timed(&mut self, class: usize, rows: &[u16], weights: &[f32]) {
        for (i, (&row, &weight)) in rows.iter().zip(weights).enumerate() {
            let place = self.place(class, i);
            self.timing_neighbors[place] = (self.first_rows[class] + usize::from(row)) as i32;
            self.timing_weights[place] = weight;
        }
    }

    fn predicted(&mut self, x: &[f32], x_prev: &[f32], y_prev: &[f32], predicted: &[f32]) {
        self.input.extend(x);
        self.input_prev.extend(x_prev);
        self.output_prev.extend(y_prev);
        self.predicted.extend(predicted);
    }

    fn done(&mut self, report: &Report) {
        if self.input.len() == self.frames * self.dofs {
            // The input was invalid and nothing was computed.
            return;
        }
        self.proportion.resize((self.frames + 1) * self.classes, 0.0);
        for share in &report.classes {
            self.proportion[self.frames * self.classes + usize::from(share.class)] = share.proportion;
        }
        self.step_seconds.push(report.predicted_step_s);
        self.contacts.extend(report.contacts.map(u8::from));
        self.frames += 1;
    }
}
