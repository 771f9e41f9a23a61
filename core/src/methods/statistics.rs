//! Statistical transfer of means and spreads with quaternions, as a stream.
//!
//! A style is the mean and the spread of every joint's rotation. The input's rotation `q_s` is turned so that its
//! mean is the output's, and moved along the geodesic from there so that its spread is the output's:
//!
//! `q' = q_s (q̄_s⁻¹ q̄_r)`, `q_t = Slerp(σ_r / σ_s, q̄_r, q')` (section 5.4, eq. 7)
//!
//! The root's height and ground velocity are scaled number by number (eq. 4). Velocities are used instead of positions,
//! so the place of the body does not matter. Eq. 4 gives a body that stands the velocity `μ_r - σ_r / σ_s μ_s`; this part
//! of it fades as the input becomes slower than a quarter of its mean. Turning and timing of the input pass through.
//!
//! `q̄_r`, `σ_r` are a table in the blob; blends of styles blend tables. The input's `q̄_s`, `σ_s` are those of the labelled
//! input style, or of the style that the blob names. With a half-life, they are an estimate that starts there and
//! follows the stream: `q̄ ← Slerp(α, q̄, q)`, `σ² ← σ² + α (d(q̄, q)² - σ²)`, with `α = 1 - 2^(-dt / half-life)`.
//!
//! The rotations of both quaternions from their means are the same, `q' q̄_r⁻¹ = q_s q̄_s⁻¹`. Eq. 7 therefore needs one
//! logarithm and one exponential a joint: `v = log(q_s q̄_s⁻¹)`, `q_t = exp(σ_r / σ_s v) q̄_r`. The distance `d(q̄, q)`
//! is the length of `v`.
//!
//! Feet stand where a projection of the input's dofs lies beyond a boundary: the output's feet stand where the input's
//! do. Cost: two logarithms and an exponential a joint, whatever the number of frames behind the tables.

use crate::{
    Config, Observer, Report,
    blob::{
        Database, Table,
        layout::{MAX_STYLES, ROOT_DOFS, dof},
    },
    error::saturating_u32,
    math::{
        abs, clamp, exp, maximum,
        quaternion::{self, IDENTITY, Quaternion, Vector},
        sqrt,
        vector::norm,
    },
    methods::{
        context::{Context, Frame, Needs, Translate},
        work::{Load, Work},
    },
    stylizer::style_mix::Settings,
};

/// Greatest ratio of two spreads. A joint that hardly moved in the data does not show how to move, and more than twice the
/// input's motion is seen as jerks.
const MAX_SPREAD_RATIO: f32 = 2.0;
/// Part of the input style's mean forward velocity above which eq. 4 has its full effect on velocities.
const MOVING: f32 = 0.25;
/// Squared distance of the furthest joint, in variances, below which input is of the database's kind, whatever its style.
const FAMILIAR_DISTANCE2: f32 = 20.0;
/// Dofs of the root that are scaled number by number.
const ROOT: [usize; 3] = [dof::HEIGHT, dof::FORWARD, dof::LEFT];

/// State of the method between frames: the input's running statistics.
#[derive(Debug, Clone)]
pub(crate) struct Statistics<const J: usize> {
    /// Mean and variance of the dofs in [`ROOT`], m and m/s.
    root: [[f32; 2]; 3],
    /// Mean local rotation of each joint.
    means: [Quaternion; J],
    /// Variance around the means, squared radians.
    variances: [f32; J],
}

impl<const J: usize> Translate<J> for Statistics<J> {
    // The first frame sets the statistics.
    const NEW: Self = Self { root: [[0.0; 2]; 3], means: [[0.0; 4]; J], variances: [0.0; J] };
    // Labels select tables, not frames. Each joint is translated on its own.
    const NEEDS: Needs = Needs { labelled_class: false, whole_body: false };

    /// Every joint reads the input's table and those of its output styles.
    fn worst_step(database: &Database<'_>, _config: &Config, load: &Load) -> Work {
        let table = saturating_u32(database.table(0).bytes());
        let bytes_read = table * (1 + load.styles);
        Work { mixes: load.mixes, outputs: load.styles, bytes_read, ..Work::default() }
    }

    #[inline(never)]
    fn predict(&mut self, context: &mut Context<'_, '_, J, impl Observer<J>>) {
        let Context { frame, input, signals, report, .. } = context;
        let frame = *frame;
        let database = frame.database;
        let settings = frame.settings;
        let style = settings.input_style.or(database.statistic_from()).unwrap_or(0);
        let Some(source) = database.table_of(style, settings.action) else {
            signals.predicted = signals.x;
            return;
        };
        report.bytes_read += source.bytes() as u32;
        let mut running =
            Running { root: &mut self.root, means: &mut self.means, variances: &mut self.variances };
        if frame.first {
            running.start(database, &source);
            for (i, d) in ROOT.into_iter().enumerate().skip(1) {
                set_dof(signals.x.as_flattened_mut(), d, source.root(i)[0]);
            }
            signals.x_prev = signals.x;
            signals.y_prev = signals.x;
        }
        let x = signals.x.as_flattened();
        transfer(frame, &source, running, &input.rotations, x, signals.predicted.as_flattened_mut(), report);
    }

    fn reset(&mut self) {
        // The next first frame sets the statistics again.
    }
}

/// The running statistics of the input, as slices.
struct Running<'a> {
    root: &'a mut [[f32; 2]; 3],
    means: &'a mut [Quaternion],
    variances: &'a mut [f32],
}

impl Running<'_> {
    /// Begins with the statistics of a table.
    fn start(&mut self, database: &Database<'_>, source: &Table<'_>) {
        for (i, statistics) in self.root.iter_mut().enumerate() {
            let [mean, deviation] = source.root(i);
            *statistics = [mean, deviation * deviation];
        }
        let joints = self.means.iter_mut().zip(&mut *self.variances).take(database.counts().joints);
        for (j, (running_mean, variance)) in joints.enumerate() {
            let (mean, deviation) = source.joint(j);
            *running_mean = mean;
            *variance = deviation * deviation;
        }
    }
}

/// Translates a frame: every dof, the contacts, and the distance in the report.
// Not generic over capacities, so that it is compiled with the core, optimised for speed.
#[inline(never)]
fn transfer(
    frame: Frame<'_, '_>,
    source: &Table<'_>,
    Running { root, means, variances }: Running<'_>,
    rotations: &[Quaternion],
    x: &[f32],
    predicted: &mut [f32],
    report: &mut Report,
) {
    let Frame { database, settings, .. } = frame;
    let running = frame.config.halflife_s > 0.0;
    let rate = 1.0 / (frame.config.halflife_s * database.rate_hz());
    let alpha = if running { 1.0 - exp(-core::f32::consts::LN_2 * rate) } else { 0.0 };
    // Begins with the root's mix. The tables are exchanged where a joint's group has another mix.
    let mut mix = settings.mix_of(database.joint_group(0));
    let mut tables = MixTables::new();
    load_tables(&mut tables, database, settings, mix);
    report.bytes_read += tables.iter().map(|(t, _)| t.bytes() as u32).sum::<u32>();

    let mut largest = 0.0;
    let forward = x.get(dof::FORWARD).copied().unwrap_or(0.0);
    let moving = moving(forward, source.root(1)[0]);
    for (i, (d, statistics)) in ROOT.into_iter().zip(root).enumerate() {
        let x = x.get(d).copied().unwrap_or(0.0);
        let [mean, deviation] = if running { [statistics[0], sqrt(statistics[1])] } else { source.root(i) };
        let (mut to_mean, mut to_deviation) = (0.0, 0.0);
        for &(table, weight) in &tables {
            let [mean, deviation] = table.root(i);
            to_mean += weight * mean;
            to_deviation += weight * deviation;
        }
        let offset = x - mean;
        largest = max_normalised(largest, abs(offset), deviation);
        let ratio = spread_ratio(to_deviation, deviation);
        let part = if d == dof::HEIGHT { 1.0 } else { moving };
        set_dof(predicted, d, ratio * x + part * (to_mean - ratio * mean));
        statistics[0] += alpha * offset;
        statistics[1] += alpha * (offset * offset - statistics[1]);
    }

    let turning = x.get(dof::YAW).copied().unwrap_or(0.0);
    set_dof(predicted, dof::YAW, turning);

    // The root's tilt is its orientation without the heading.
    let tilt = x.get(dof::TILT..dof::TILT + 3).map_or([0.0; 3], |v| [v[0], v[1], v[2]]);
    let states = means.iter_mut().zip(variances);
    let joints = database.means().zip(database.groups()).zip(rotations).zip(states);
    for (j, (((rest, group), &rotation), (running_mean, variance))) in joints.enumerate() {
        let q = if j == 0 { quaternion::turned(rest, tilt) } else { rotation };
        let (mean, deviation) = if running { (*running_mean, sqrt(*variance)) } else { source.joint(j) };
        let group_mix = settings.mix_of(group);
        if group_mix != mix {
            mix = group_mix;
            load_tables(&mut tables, database, settings, mix);
        }
        let (to_mean, to_deviation) = blended(&tables, j);
        let rotation_vector = quaternion::between_in_parent(mean, q);
        let moved = quaternion::turned_in_parent(
            to_mean,
            scaled(spread_ratio(to_deviation, deviation), rotation_vector),
        );
        // The map relative to the database's mean.
        let map = quaternion::between(rest, moved);
        let first = if j == 0 { dof::TILT } else { ROOT_DOFS + 3 * j };
        if let Some(slots) = predicted.get_mut(first..first + 3) {
            slots.iter_mut().zip(map).for_each(|(slot, v)| *slot = v);
        }
        let distance = norm(rotation_vector);
        largest = max_normalised(largest, distance, deviation);
        if running {
            let moved_mean = quaternion::turned_in_parent(*running_mean, scaled(alpha, rotation_vector));
            *running_mean = quaternion::normalize(moved_mean).unwrap_or(*running_mean);
            *variance += alpha * (distance * distance - *variance);
        }
    }
    report.distance2 = largest * largest;
    report.distance_ratio = report.distance2 / FAMILIAR_DISTANCE2;
    for (side, likelihood) in report.contact_likelihood.iter_mut().enumerate() {
        let (boundary, projection) = source.foot(side);
        let x = x.get(..database.counts().dofs).unwrap_or(&[]);
        *likelihood = if projection.product(x) > boundary { 1.0 } else { 0.0 };
    }
}

/// Mean rotation and spread, rad, of a joint in a mix: a weighted mean, accumulated table by table (eq. 6).
fn blended(tables: &MixTables<'_>, joint: usize) -> (Quaternion, f32) {
    let (mut mean, mut deviation, mut total) = (IDENTITY, 0.0, 0.0);
    for &(table, weight) in tables {
        let (rotation, spread) = table.joint(joint);
        total += weight;
        mean = if total > weight { quaternion::slerp(weight / total, mean, rotation) } else { rotation };
        deviation += weight * spread;
    }
    (mean, deviation)
}

/// A rotation vector multiplied by a factor.
fn scaled(factor: f32, v: Vector) -> Vector {
    v.map(|v| factor * v)
}

/// The tables of a mix's styles, and their weights.
type MixTables<'db> = heapless::Vec<(Table<'db>, f32), MAX_STYLES>;

/// Looks up the tables of a mix.
#[inline(never)]
fn load_tables<'db>(tables: &mut MixTables<'db>, database: &Database<'db>, settings: &Settings, mix: usize) {
    tables.clear();
    for (style, weight) in settings.mix(mix).weighted(database.counts().styles) {
        if let Some(table) = database.table_of(style as u16, settings.action) {
            // There is room for every style.
            let _ = tables.push((table, weight));
        }
    }
}

/// Sets a dof, if there is one of that number.
fn set_dof(dofs: &mut [f32], dof: usize, value: f32) {
    if let Some(slot) = dofs.get_mut(dof) {
        *slot = value;
    }
}

/// Part of eq. 4's change of the mean velocity that a body with this forward velocity takes, from 0 (it stands) to 1, in
/// data with this mean.
fn moving(forward: f32, mean: f32) -> f32 {
    let full = MOVING * abs(mean);
    // Whoever walks nowhere, as in gestures, has no drift to take away.
    if full > 1e-3 { clamp(abs(forward) / full, 0.0, 1.0) } else { 1.0 }
}

/// Ratio of two spreads, at most [`MAX_SPREAD_RATIO`].
fn spread_ratio(to: f32, from: f32) -> f32 {
    clamp(to / maximum(from, 1e-6), 0.0, MAX_SPREAD_RATIO)
}

/// The larger of `largest` and a distance in standard deviations.
fn max_normalised(largest: f32, distance: f32, deviation: f32) -> f32 {
    let distance = distance / maximum(deviation, 1e-6);
    maximum(distance, largest)
}
