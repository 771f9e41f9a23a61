//! Phase tables: what each class is on average over its cycle, and what its outputs are. Method of its own; the
//! cycles' canonical time is Xia 2015's (section 4), their pairs are those of the mixture.
//!
//! With X_i the dofs of cycle i and f_i its features at uniform phases, and c the class of action a and style s:
//!
//! ```text
//! M_c = mean X_i                     f_c = mean f_i
//! S   = covariance of f_i - f_c      W' W = (S + 0.1 tr S / F)^-1, joint group by joint group
//! A_c = mean over the action's other styles of the mean over their cycles of the output's X in style s
//! B_c = ridge regression of X_i - M_c on the cycle's mean forward speed and yaw rate, about the class's
//! ```
//!
//! Means over input styles first: each style counts the same, however many cycles it has.

mod section;

pub use section::section;

use gestus_core::blob::layout::{dof, phase::CONTACTS};
use nalgebra::{Cholesky, DMatrix, DVector, Matrix2, Vector2};

use crate::{
    pairing::{CycleData, Pairing},
    registration::timeline::Kind,
};
use gestus_motion::{body::row_at, corpus::Cycle, statistics::distance2};

/// Numbers of knots of a table.
struct Knots {
    features: usize,
    dofs: usize,
    slopes: usize,
}

impl Knots {
    const fn of(kind: Kind) -> Self {
        match kind {
            Kind::Gait => Self { features: 16, dofs: 12, slopes: 6 },
            Kind::Whole => Self { features: 96, dofs: 48, slopes: 6 },
        }
    }
}

/// Part of the mean variance that is added to every feature's.
const SHRINKAGE: f64 = 0.1;
/// Ridge of the slopes, in cycles.
const RIDGE: f64 = 10.0;
/// Part of the input's departure from its mean that the output keeps.
const GAIN: f64 = 0.4;
/// Part of a class's frames whose distance is not far.
const FAR_QUANTILE: f64 = 0.99;

/// What tables are made of. A list for each clip, or cycle, or class, as the database has them.
#[derive(Debug, Clone, Copy)]
pub struct Source<'a> {
    /// The cycles, sorted by class, clip and time.
    pub cycles: &'a [CycleData<'a>],
    /// Action and style of each class.
    pub classes: &'a [(usize, usize)],
    /// Features of every frame of each clip, metres. Shape `[clips][frames][F]`.
    pub features: &'a [&'a [Vec<f64>]],
    /// Joint group of each feature, ascending.
    pub feature_groups: &'a [usize],
    /// Which foot stands in every frame of each clip.
    pub contacts: &'a [&'a [[bool; 2]]],
    /// The outputs of every cycle.
    pub pairing: &'a Pairing,
    /// Frames a second.
    pub rate_hz: f64,
}

/// The tables of a class. N dof knots, S slope knots, P feature knots.
#[derive(Debug, Clone)]
pub struct ClassTables {
    /// Whether the end of a cycle is the start of the next.
    pub is_cyclic: bool,
    /// Whitened mean features, shape `[P][F]`.
    pub features: Vec<Vec<f64>>,
    /// Mean of the class, shape `[N][D]`.
    pub input: Vec<Vec<f64>>,
    /// Mean output in the class's style, shape `[N][D]`.
    pub output: Vec<Vec<f64>>,
    /// Change with forward speed and with yaw rate, shape `[S][D]`.
    pub slopes: Vec<Vec<[f64; 2]>>,
    /// Standard deviation from mean and slopes, of each dof.
    pub spread: Vec<f64>,
    /// Likelihood that the left and the right foot stand in the output, at uniform phases.
    pub contacts: [[f64; 2]; CONTACTS],
    /// Part of the input's departure from its mean that the output keeps.
    pub gain: f64,
    /// Squared distance that most of the class's own frames are within, whitened.
    pub far: f64,
    /// Mean forward speed, m/s, and yaw rate, rad/s.
    pub drift: [f64; 2],
    /// Seconds of the halves of a cycle.
    pub seconds: [f64; 2],
    /// The same of the outputs.
    pub output_seconds: [f64; 2],
}

/// The tables of a database.
#[derive(Debug, Clone)]
pub struct Tables {
    /// Whitening matrix of each joint group that has features, in order.
    pub whitening: Vec<DMatrix<f64>>,
    /// The tables of each class.
    pub classes: Vec<ClassTables>,
}

/// A cycle read at uniform phases, or a mean of some.
#[derive(Debug, Clone)]
struct Sampled {
    dofs: Vec<Vec<f64>>,
    contacts: Vec<[f64; 2]>,
    drift: [f64; 2],
    seconds: [f64; 2],
}

impl Tables {
    /// The tables of all classes; every class has a cycle.
    pub fn of(source: &Source<'_>) -> Self {
        let classes: Vec<Class<'_>> = (0..source.classes.len()).map(|c| Class::of(source, c)).collect();
        let whitening = whitening(&classes, source.feature_groups);
        let outputs: Vec<Sampled> = (0..classes.len()).map(|c| output(source, &classes, c)).collect();
        let deviation = drift_deviation(&classes);
        let classes = classes
            .iter()
            .zip(outputs)
            .map(|(class, output)| {
                let white = |feature: &[f64]| whitened(&whitening, feature);
                let features: Vec<Vec<f64>> = class.mean_features.iter().map(|f| white(f)).collect();
                let (slopes, spread) = class.slopes(source, deviation);
                let mut distances: Vec<f64> = class
                    .features
                    .iter()
                    .flat_map(|cycle| cycle.iter().zip(&features))
                    .map(|(f, mean)| distance2(&white(f), mean))
                    .collect();
                distances.sort_by(f64::total_cmp);
                let far = distances[((distances.len() - 1) as f64 * FAR_QUANTILE) as usize];
                ClassTables {
                    is_cyclic: class.kind == Kind::Gait,
                    features,
                    input: class.mean.dofs.clone(),
                    output: output.dofs,
                    slopes,
                    spread,
                    contacts: std::array::from_fn(|k| output.contacts[k]),
                    gain: GAIN,
                    far: far.max(1.0),
                    drift: class.mean.drift,
                    seconds: class.mean.seconds,
                    output_seconds: output.seconds,
                }
            })
            .collect();
        Self { whitening, classes }
    }
}

/// The cycles of a class.
struct Class<'a> {
    own: Vec<&'a CycleData<'a>>,
    /// Their numbers.
    numbers: Vec<usize>,
    kind: Kind,
    cycles: Vec<Sampled>,
    mean: Sampled,
    /// Features of each cycle, shape `[cycles][P][F]`.
    features: Vec<Vec<Vec<f64>>>,
    mean_features: Vec<Vec<f64>>,
}

/// The phases of `count` knots; the end of a gait cycle is the start of the next.
fn phases(count: usize, kind: Kind) -> impl Iterator<Item = f64> {
    let last = if kind == Kind::Gait { count } else { count - 1 };
    (0..count).map(move |k| k as f64 / last as f64)
}

impl<'a> Class<'a> {
    fn of(source: &Source<'a>, class: usize) -> Self {
        let members = source.cycles.iter().enumerate().filter(|(_, c)| c.class == class);
        let (numbers, own): (Vec<usize>, Vec<&CycleData<'_>>) = members.unzip();
        let is_gait = own.iter().all(|c| Kind::of_cycle(c.cycle) == Kind::Gait);
        let kind = if is_gait { Kind::Gait } else { Kind::Whole };
        let cycles: Vec<Sampled> = own
            .iter()
            .map(|c| {
                let contacts = contacts(c.cycle, source.contacts[c.clip], kind);
                sampled(source.rate_hz, c.cycle, c.dofs, contacts, kind)
            })
            .collect();
        let features: Vec<Vec<Vec<f64>>> = own
            .iter()
            .map(|c| {
                let at = |phase| row_at(source.features[c.clip], c.cycle.position(phase));
                phases(Knots::of(kind).features, kind).map(at).collect()
            })
            .collect();
        let mean_features = mean_rows(features.iter());
        let mean = mean(cycles.iter());
        Self { own, numbers, kind, cycles, mean, features, mean_features }
    }

    /// Change of the dofs with the drift of a cycle, and what is left of their spread.
    fn slopes(&self, source: &Source<'_>, deviation: [f64; 2]) -> (Vec<Vec<[f64; 2]>>, Vec<f64>) {
        let count = Knots::of(self.kind).slopes;
        let drifts: Vec<Vector2<f64>> = self
            .cycles
            .iter()
            .map(|c| Vector2::from_fn(|k, _| (c.drift[k] - self.mean.drift[k]) / deviation[k]))
            .collect();
        let sum: Matrix2<f64> = drifts.iter().map(|z| z * z.transpose()).sum();
        let inverse = (sum + Matrix2::identity() * RIDGE).try_inverse().unwrap_or_default();
        let rows: Vec<Vec<Vec<f64>>> = self
            .own
            .iter()
            .map(|c| phases(count, self.kind).map(|p| row_at(c.dofs, c.cycle.position(p))).collect())
            .collect();
        let means = mean_rows(rows.iter());
        let dofs = source.cycles[0].dofs[0].len();
        let mut squares = vec![0.0; dofs];
        let slopes = (0..count)
            .map(|k| {
                (0..dofs)
                    .map(|d| {
                        let off = |cycle: &Vec<Vec<f64>>| cycle[k][d] - means[k][d];
                        let b = inverse
                            * rows.iter().zip(&drifts).map(|(row, z)| z * off(row)).sum::<Vector2<f64>>();
                        squares[d] += rows
                            .iter()
                            .zip(&drifts)
                            .map(|(row, z)| (off(row) - b.dot(z)).powi(2))
                            .sum::<f64>();
                        [b[0] / deviation[0], b[1] / deviation[1]]
                    })
                    .collect()
            })
            .collect();
        let samples = (count * rows.len()) as f64;
        (slopes, squares.into_iter().map(|s| (s / samples).sqrt()).collect())
    }
}

/// Which foot stands at uniform phases of a cycle of a clip.
fn contacts(cycle: &Cycle, of_clip: &[[bool; 2]], kind: Kind) -> Vec<[f64; 2]> {
    let stands = |phase: f64| {
        let at = (cycle.position(phase).round().max(0.0) as usize).min(of_clip.len() - 1);
        of_clip[at].map(f64::from)
    };
    phases(CONTACTS, kind).map(stands).collect()
}

/// A cycle at uniform phases.
fn sampled(rate_hz: f64, cycle: &Cycle, dofs: &[Vec<f64>], contacts: Vec<[f64; 2]>, kind: Kind) -> Sampled {
    let (start, end) = cycle.span();
    let frames = start.ceil().max(0.0) as usize..(end.ceil() as usize).clamp(1, dofs.len());
    let count = frames.len().max(1) as f64;
    let drift =
        [dof::FORWARD, dof::YAW].map(|d| dofs[frames.clone()].iter().map(|r| r[d]).sum::<f64>() / count);
    let seconds =
        [(0.5, 0.0), (1.0, 0.5)].map(|(to, from)| (cycle.position(to) - cycle.position(from)) / rate_hz);
    let dofs = phases(Knots::of(kind).dofs, kind).map(|p| row_at(dofs, cycle.position(p))).collect();
    Sampled { dofs, contacts, drift, seconds }
}

/// The mean output in the style of a class, of inputs in the action's other styles; the class itself where there are none.
fn output(source: &Source<'_>, classes: &[Class<'_>], target: usize) -> Sampled {
    let (action, style) = source.classes[target];
    let kind = classes[target].kind;
    let pairing = source.pairing;
    let of_class = |input: &Class<'_>| {
        let outputs = input.numbers.iter().zip(&input.own).flat_map(|(&i, own)| {
            let both = [pairing.outputs.get(i), pairing.second.get(i)].into_iter().flatten();
            both.filter_map(|of| of[style]).map(move |output| (own, output))
        });
        let found: Vec<Sampled> = outputs
            .map(|(own, output)| {
                let (cycle, dofs, clip) = pairing.output(source.cycles, output);
                // A prototype has no contacts: the output's feet stand where the input's do.
                let (steps, clip) = clip.map_or((own.cycle, own.clip), |clip| (cycle, clip));
                sampled(source.rate_hz, cycle, dofs, contacts(steps, source.contacts[clip], kind), kind)
            })
            .collect();
        (!found.is_empty()).then(|| mean(found.iter()))
    };
    let labels = source.classes.iter().zip(classes);
    let others: Vec<Sampled> =
        labels.filter(|((a, s), _)| *a == action && *s != style).filter_map(|(_, c)| of_class(c)).collect();
    if others.is_empty() { classes[target].mean.clone() } else { mean(others.iter()) }
}

fn mean<'s>(of: impl ExactSizeIterator<Item = &'s Sampled> + Clone) -> Sampled {
    let count = of.len() as f64;
    let average = |get: &dyn Fn(&Sampled) -> [f64; 2]| {
        let sum = of.clone().map(get).fold([0.0; 2], |sum, v| [sum[0] + v[0], sum[1] + v[1]]);
        sum.map(|s| s / count)
    };
    let phases = of.clone().next().map_or(0, |s| s.contacts.len());
    Sampled {
        dofs: mean_rows(of.clone().map(|s| &s.dofs)),
        contacts: (0..phases).map(|k| average(&|s| s.contacts[k])).collect(),
        drift: average(&|s| s.drift),
        seconds: average(&|s| s.seconds),
    }
}

/// Mean of tables of the same shape.
fn mean_rows<'s>(tables: impl ExactSizeIterator<Item = &'s Vec<Vec<f64>>>) -> Vec<Vec<f64>> {
    let count = tables.len() as f64;
    let mut sum: Vec<Vec<f64>> = Vec::new();
    for table in tables {
        if sum.is_empty() {
            sum = vec![vec![0.0; table[0].len()]; table.len()];
        }
        for (sum, value) in sum.iter_mut().flatten().zip(table.iter().flatten()) {
            *sum += value / count;
        }
    }
    sum
}

/// Standard deviation of cycles' drifts within their classes.
fn drift_deviation(classes: &[Class<'_>]) -> [f64; 2] {
    [0, 1].map(|k| {
        let (mut squares, mut count) = (0.0, 0.0);
        for class in classes {
            let mean = class.mean.drift[k];
            squares += class.cycles.iter().map(|c| (c.drift[k] - mean).powi(2)).sum::<f64>();
            count += class.cycles.len() as f64;
        }
        (squares / f64::max(count, 1.0)).sqrt().max(1e-3)
    })
}

/// The whitening matrices: of each group that has features, the transposed Cholesky factor of the inverse of its
/// features' covariance within classes.
fn whitening(classes: &[Class<'_>], groups: &[usize]) -> Vec<DMatrix<f64>> {
    let features = groups.len();
    let mut covariance = DMatrix::<f64>::zeros(features, features);
    let mut count = 0.0;
    for class in classes {
        for (feature, mean) in class.features.iter().flat_map(|cycle| cycle.iter().zip(&class.mean_features))
        {
            let off = DVector::from_iterator(features, feature.iter().zip(mean).map(|(f, m)| f - m));
            covariance.ger(1.0, &off, &off, 1.0);
            count += 1.0;
        }
    }
    covariance /= f64::max(count, 1.0);
    let shrinkage = (SHRINKAGE * covariance.trace() / features as f64).max(1e-9);
    let mut matrices = Vec::new();
    let mut first = 0;
    while first < features {
        let size = groups[first..].iter().take_while(|g| **g == groups[first]).count();
        let block = covariance.view((first, first), (size, size)) + DMatrix::identity(size, size) * shrinkage;
        // Positive definite: a covariance and a positive diagonal.
        let inverse = Cholesky::new(block).map_or_else(|| DMatrix::identity(size, size), |c| c.inverse());
        let factor = Cholesky::new(inverse).map_or_else(|| DMatrix::identity(size, size), |c| c.unpack());
        matrices.push(factor.transpose());
        first += size;
    }
    matrices
}

/// A feature, whitened group by group.
fn whitened(matrices: &[DMatrix<f64>], feature: &[f64]) -> Vec<f64> {
    let mut rest = feature;
    let mut white = Vec::new();
    for matrix in matrices {
        let (own, others) = rest.split_at(matrix.nrows());
        white.extend((matrix * DVector::from_column_slice(own)).iter());
        rest = others;
    }
    white
}
