//! Baselines that the mixture is compared with, in `f64` and without regard to speed.

use gestus_core::{
    ConfigError, Database,
    blob::{Counterpart, Moment, layout::flag},
    search::found::Found,
};

use gestus_database::{
    blob::export,
    stream::{Request, Streamed, Watcher, stream},
};
use gestus_motion::clip::Clip;
use nalgebra::{Matrix4, Vector4};

/// Neighbors of a class: its number, and row of the database and squared distance of each.
pub type ClassNeighbors = (usize, Vec<(usize, f32)>);

/// Keeps, for every frame, the neighbors of each class and the frame's variables.
#[derive(Debug, Default)]
pub struct Record {
    /// Neighbors of each class of each frame: row of the database, squared distance.
    pub neighbors: Vec<Vec<ClassNeighbors>>,
    /// `x[t]` of each frame.
    pub x: Vec<Vec<f64>>,
    /// The prediction of each frame.
    pub predicted: Vec<Vec<f64>>,
    first_rows: Vec<usize>,
    current: Vec<ClassNeighbors>,
}

impl Record {
    /// A record of streams through that database.
    pub fn of(database: &Database<'_>) -> Self {
        Self { first_rows: database.classes().map(|c| c.first_row).collect(), ..Self::default() }
    }

    /// Streams a clip, with its record.
    ///
    /// # Errors
    /// A request that the database does not serve, such as a method without its section.
    pub fn of_stream(
        database: &Database<'_>,
        clip: &Clip,
        request: &Request,
    ) -> Result<(Self, Streamed), ConfigError> {
        let mut record = Self::of(database);
        let streamed = stream(database, clip, request, &mut record)?;
        Ok((record, streamed))
    }

    /// A function of each frame's neighbors; where it is `None`, the value of the frame before, or the input.
    pub fn each(&self, of: impl Fn(&[ClassNeighbors]) -> Option<Vec<f64>>) -> Vec<Vec<f64>> {
        let mut rows: Vec<Vec<f64>> = Vec::new();
        for (near, x) in self.neighbors.iter().zip(&self.x) {
            let row = of(near).or_else(|| rows.last().cloned()).unwrap_or_else(|| x.clone());
            rows.push(row);
        }
        rows
    }
}

impl Watcher for Record {
    fn searched(&mut self, class: usize, found: &Found<'_>) {
        let first = self.first_rows[class];
        self.current.push((
            class,
            found.neighbors().map(|(row, distance2)| (first + usize::from(row), distance2)).collect(),
        ));
    }

    fn predicted(&mut self, x: &[f32], _x_prev: &[f32], _y_prev: &[f32], predicted: &[f32]) {
        let wide = |v: &[f32]| v.iter().map(|&v| f64::from(v)).collect();
        self.x.push(wide(x));
        self.predicted.push(wide(predicted));
        self.neighbors.push(std::mem::take(&mut self.current));
    }
}

/// A row of the database, unpacked.
pub fn row(database: &Database<'_>, row: usize) -> Vec<f64> {
    export::row(database, row).into_iter().map(f64::from).collect()
}

/// The pose at a moment, unpacked.
pub fn moment(database: &Database<'_>, moment: Moment) -> Vec<f64> {
    let a = row(database, moment.row);
    if moment.fraction == 0.0 {
        return a;
    }
    let t = f64::from(moment.fraction);
    a.iter().zip(row(database, moment.row + 1)).map(|(a, b)| a + t * (b - a)).collect()
}

/// Which output of an example a method is fitted to.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Outputs {
    /// One captured output, as in the papers: of two, the first.
    One,
    /// The mean of all, as the core fits it.
    Mean,
}

impl Outputs {
    /// What a baseline can be fitted to, with the ending of its rows' name. Where a database has one output an example, its
    /// mean is that.
    pub fn each(database: &Database<'_>) -> &'static [(Self, &'static str)] {
        const ALL: [(Outputs, &str); 2] = [(Outputs::One, ""), (Outputs::Mean, "-both")];
        if database.outputs() > 1 { &ALL } else { &ALL[..1] }
    }
}

/// `y[t]` and `y[t-1]` of a row of a class, in a style.
pub fn output(
    database: &Database<'_>,
    class: usize,
    row: usize,
    style: usize,
    outputs: Outputs,
) -> Option<(Vec<f64>, Vec<f64>)> {
    let most = if outputs == Outputs::One { 1 } else { usize::MAX };
    let found = database.counterparts(database.cycle_of(class, row)?, row, style);
    let found: Vec<Counterpart> = found.take(most).collect();
    let mean = |of: &dyn Fn(&Counterpart) -> Moment| {
        let mut sum = vec![0.0; database.counts().dofs];
        for counterpart in &found {
            let value = moment(database, of(counterpart));
            sum.iter_mut().zip(value).for_each(|(s, v)| *s += v / found.len() as f64);
        }
        sum
    };
    (!found.is_empty()).then(|| (mean(&|c| c.now), mean(&|c| c.before)))
}

/// The variables of a row that the search may return.
pub struct Example {
    /// Row of the database.
    pub row: usize,
    /// `x[t]`.
    pub x: Vec<f64>,
    /// `x[t-1]`.
    pub x_prev: Vec<f64>,
    /// `y[t]`.
    pub y: Vec<f64>,
    /// `y[t-1]`.
    pub y_prev: Vec<f64>,
}

/// The examples of a class for a style, in the order of their rows.
pub fn examples(database: &Database<'_>, class: usize, style: usize, outputs: Outputs) -> Vec<Example> {
    let record = database.class(class);
    (record.first_row..record.first_row + record.rows)
        .filter(|&r| database.flags(r) & flag::SEARCHABLE != 0)
        .filter_map(|r| {
            let (y, y_prev) = output(database, class, r, style, outputs)?;
            Some(Example { row: r, x: row(database, r), x_prev: row(database, r - 1), y, y_prev })
        })
        .collect()
}

/// The output in a style that neighbors are interpolated to, by the inverse of their distances: the `most` nearest of
/// those classes together, nearest first. `None` where none has an output.
pub fn interpolated(
    database: &Database<'_>,
    classes: &[&ClassNeighbors],
    most: usize,
    style: usize,
    outputs: Outputs,
) -> Option<Vec<f64>> {
    let mut near: Vec<(usize, usize, f32)> =
        classes.iter().flat_map(|(class, near)| near.iter().map(|&(r, d)| (*class, r, d))).collect();
    near.sort_by(|a, b| a.2.total_cmp(&b.2));
    let mut sum = vec![0.0; database.counts().dofs];
    let mut total = 0.0;
    for (class, row, distance2) in near.into_iter().take(most) {
        let weight = 1.0 / (f64::from(distance2).sqrt() + 1e-4);
        let Some((y, _)) = output(database, class, row, style, outputs) else { continue };
        sum.iter_mut().zip(y).for_each(|(s, y)| *s += weight * y);
        total += weight;
    }
    (total > 0.0).then(|| sum.iter().map(|s| s / total).collect())
}

/// The variables `u` of a global model.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Variables {
    /// `x[t]` and 1.
    Affine,
    /// `x[t-1]`, `y[t-1]`, `x[t]` and 1.
    Autoregressive,
}

impl Variables {
    fn of(self, x_prev: f64, y_prev: f64, x: f64) -> Vector4<f64> {
        match self {
            Self::Affine => Vector4::new(0.0, 0.0, x, 1.0),
            Self::Autoregressive => Vector4::new(x_prev, y_prev, x, 1.0),
        }
    }
}

/// A model of one map for a whole class, or for some together: `y = Σ β u`, a set of weights a dof.
#[derive(Debug, Clone)]
pub struct GlobalModel {
    variables: Variables,
    weights: Vec<[f64; 4]>,
}

impl GlobalModel {
    /// Fits classes: every searchable row and its output.
    pub fn fit(
        database: &Database<'_>,
        classes: &[usize],
        style: usize,
        variables: Variables,
        outputs: Outputs,
    ) -> Self {
        let dofs = database.counts().dofs;
        let mut sums = vec![(Matrix4::<f64>::identity() * 0.1, Vector4::<f64>::zeros()); dofs];
        for &class in classes {
            for Example { x, x_prev, y, y_prev, .. } in examples(database, class, style, outputs) {
                for d in 0..dofs {
                    let u = variables.of(x_prev[d], y_prev[d], x[d]);
                    sums[d].0 += u * u.transpose();
                    sums[d].1 += u * y[d];
                }
            }
        }
        let solve = |(a, b): (Matrix4<f64>, Vector4<f64>)| {
            let w = a.lu().solve(&b).unwrap_or_default();
            [w[0], w[1], w[2], w[3]]
        };
        Self { variables, weights: sums.into_iter().map(solve).collect() }
    }

    /// Translates a clip's dofs; `first` is the output before the first frame.
    pub fn run(&self, x: &[Vec<f64>], first: &[f64]) -> Vec<Vec<f64>> {
        let mut y_prev = first.to_vec();
        (0..x.len())
            .map(|t| {
                let x_prev = &x[t.saturating_sub(1)];
                let y: Vec<f64> = (0..y_prev.len())
                    .map(|d| {
                        let u = self.variables.of(x_prev[d], y_prev[d], x[t][d]);
                        let w = &self.weights[d];
                        w[0] * u[0] + w[1] * u[1] + w[2] * u[2] + w[3] * u[3]
                    })
                    .collect();
                y_prev.clone_from(&y);
                y
            })
            .collect()
    }
}
