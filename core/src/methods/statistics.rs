//! Statistical transfer: transfer of means and spreads with quaternions, as a stream.
//!
//! A style is the mean and the spread of every joint's rotation. The input's rotation `q_s` is turned so that its
//! mean is the output's, and moved along the geodesic from there so that its spread is the output's:
//!
//! `q' = q_s (q̄_s⁻¹ q̄_r)`, `q_t = Slerp(σ_r / σ_s, q̄_r, q')` (section 5.4, eq. 7)
//!
//! The root's height and ground velocity are scaled number by number (eq. 4): its translation is taken from frame
//! to frame, so that where the body is does not count. Its turning passes through, and so does time.
//!
//! `q̄_r`, `σ_r` are a table in the blob; blends of styles blend tables. The input's `q̄_s`, `σ_s` are those of the
//! labelled input style, or of the style that the blob names; or, where a half-life is given, an estimate that
//! starts there and follows the stream: `q̄ ← Slerp(α, q̄, q)`, `σ² ← σ² + α (d(q̄, q)² - σ²)`, with
//! `α = 1 - 2^(-dt / half-life)`.
//!
//! Both quaternions' way to their means is the same, `q' q̄_r⁻¹ = q_s q̄_s⁻¹`, so that eq. 7 is one logarithm and one
//! exponential a joint: `v = log(q_s q̄_s⁻¹)`, `q_t = exp(σ_r / σ_s v) q̄_r`. The distance `d(q̄, q)` is the length of `v`.
//!
//! Feet stand where a projection of the input's dofs lies beyond a boundary: where the content's feet stand, the
//! output's do. Cost: two logarithms and an exponential a joint, whatever the number of frames behind the tables.

use crate::{
    Config, Observer, Report,
    blob::{
        Database, Table,
        layout::{MAX_STYLES, ROOT_DOFS, dof},
    },
    math::{
        clamp, exp,
        quaternion::{self, IDENTITY, Quaternion, Vector},
        sqrt,
        vector::norm,
    },
    methods::{
        context::{Context, Frame, Needs, Translate},
        work::{Load, Work, as_u32},
    },
    stylizer::style_mix::Settings,
};

/// Most that a spread is scaled: a joint that stood still tells nothing of how to move.
const MOST_SCALE: f32 = 4.0;
/// Squared distance of the furthest joint, in variances, that input of the database's kind stays below in the mean, in
/// other styles too.
const FAR2: f32 = 20.0;
/// Dofs of the root that are scaled as numbers.
const ROOT: [usize; 3] = [dof::HEIGHT, dof::FORWARD, dof::LEFT];

/// State of the method between frames: the input's running statistics.
#[derive(Debug, Clone)]
pub(crate) struct Statistics<const J: usize> {
    /// Mean and variance of the root's numbers.
    root: [[f32; 2]; 3],
    means: [Quaternion; J],
    /// Variance around the means, squared radians.
    variances: [f32; J],
}

impl<const J: usize> Translate<J> for Statistics<J> {
    // The first frame gives it its statistics.
    const NEW: Self = Self { root: [[0.0; 2]; 3], means: [[0.0; 4]; J], variances: [0.0; J] };
    // Labels choose tables, not frames; each joint is translated by itself.
    const NEEDS: Needs = Needs { labelled_class: false, whole_body: false };

    /// Every joint takes the input's table and those of its output styles.
    fn worst_step(database: &Database<'_>, _config: &Config, load: &Load) -> Work {
        let table = as_u32(database.table(0).bytes());
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
                set(signals.x.as_flattened_mut(), d, source.root(i)[0]);
            }
            signals.x_prev = signals.x;
            signals.y_prev = signals.x;
        }
        let x = signals.x.as_flattened();
        transfer(frame, &source, running, &input.rotations, x, signals.predicted.as_flattened_mut(), report);
    }

    fn reset(&mut self) {
        // A first frame starts its statistics anew.
    }
}

/// The input's running statistics, whatever the capacity.
struct Running<'a> {
    root: &'a mut [[f32; 2]; 3],
    means: &'a mut [Quaternion],
    variances: &'a mut [f32],
}

impl Running<'_> {
    /// The running statistics begin with the stored ones.
    fn start(&mut self, database: &Database<'_>, source: &Table<'_>) {
        for (i, own) in self.root.iter_mut().enumerate() {
            let [mean, deviation] = source.root(i);
            *own = [mean, deviation * deviation];
        }
        let joints = self.means.iter_mut().zip(&mut *self.variances).take(database.counts().joints);
        for (j, (own, variance)) in joints.enumerate() {
            let (mean, deviation) = source.joint(j);
            *own = mean;
            *variance = deviation * deviation;
        }
    }
}

/// What [`Statistics::predict`] does in every frame.
// Of no capacity: it is compiled with the core, for speed, however its caller is.
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
    // The root's own styles; those of other groups' joints take their place where these begin.
    let mut mix = settings.mix_of(database.joint_group(0));
    let mut tables = MixTables::new();
    load_tables(&mut tables, database, settings, mix);
    report.bytes_read += tables.iter().map(|(t, _)| t.bytes() as u32).sum::<u32>();

    let mut furthest = 0.0;
    for (i, (d, own)) in ROOT.into_iter().zip(root).enumerate() {
        let x = x.get(d).copied().unwrap_or(0.0);
        let [mean, deviation] = if running { [own[0], sqrt(own[1])] } else { source.root(i) };
        let (mut to_mean, mut to_deviation) = (0.0, 0.0);
        for &(table, weight) in &tables {
            let [mean, deviation] = table.root(i);
            to_mean += weight * mean;
            to_deviation += weight * deviation;
        }
        let offset = x - mean;
        furthest = further(furthest, crate::math::abs(offset), deviation);
        set(predicted, d, to_mean + scale(to_deviation, deviation) * offset);
        own[0] += alpha * offset;
        own[1] += alpha * (offset * offset - own[1]);
    }

    let turning = x.get(dof::YAW).copied().unwrap_or(0.0);
    set(predicted, dof::YAW, turning);

    // The root's tilt is its orientation without the heading, which its dofs hold.
    let tilt = x.get(dof::TILT..dof::TILT + 3).map_or([0.0; 3], |v| [v[0], v[1], v[2]]);
    let states = means.iter_mut().zip(variances);
    let joints = database.means().zip(database.groups()).zip(rotations).zip(states);
    for (j, (((rest, group), &rotation), (own, variance))) in joints.enumerate() {
        let q = if j == 0 { quaternion::turned(rest, tilt) } else { rotation };
        let (mean, deviation) = if running { (*own, sqrt(*variance)) } else { source.joint(j) };
        let own_mix = settings.mix_of(group);
        if own_mix != mix {
            mix = own_mix;
            load_tables(&mut tables, database, settings, mix);
        }
        let (to_mean, to_deviation) = blended(&tables, j);
        let way = quaternion::apart(mean, q);
        let moved = quaternion::turned_about(to_mean, times(scale(to_deviation, deviation), way));
        // The map relative to the database's mean.
        let map = quaternion::between(rest, moved);
        let first = if j == 0 { dof::TILT } else { ROOT_DOFS + 3 * j };
        if let Some(slots) = predicted.get_mut(first..first + 3) {
            slots.iter_mut().zip(map).for_each(|(slot, v)| *slot = v);
        }
        let distance = norm(way);
        furthest = further(furthest, distance, deviation);
        if running {
            let on = quaternion::turned_about(*own, times(alpha, way));
            *own = quaternion::normalize(on).unwrap_or(*own);
            *variance += alpha * (distance * distance - *variance);
        }
    }
    report.distance2 = furthest * furthest;
    report.distance_ratio = report.distance2 / FAR2;
    for (side, contact) in report.contacts.iter_mut().enumerate() {
        let (boundary, projection) = source.foot(side);
        let x = x.get(..database.counts().dofs).unwrap_or(&[]);
        *contact = projection.product(x) > boundary;
    }
}

/// Mean rotation and spread of a joint in a mix: a weighted mean, one table after the other (eq. 6).
fn blended(tables: &MixTables<'_>, joint: usize) -> (Quaternion, f32) {
    let (mut mean, mut deviation, mut total) = (IDENTITY, 0.0, 0.0);
    for &(table, weight) in tables {
        let (own, spread) = table.joint(joint);
        total += weight;
        mean = if total > weight { quaternion::slerp(weight / total, mean, own) } else { own };
        deviation += weight * spread;
    }
    (mean, deviation)
}

fn times(factor: f32, v: Vector) -> Vector {
    v.map(|v| factor * v)
}

/// The tables that a mix of styles is made of, and their weights.
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

fn set(dofs: &mut [f32], dof: usize, value: f32) {
    if let Some(slot) = dofs.get_mut(dof) {
        *slot = value;
    }
}

fn scale(to: f32, from: f32) -> f32 {
    clamp(to / if from > 1e-6 { from } else { 1e-6 }, 0.0, MOST_SCALE)
}

fn further(furthest: f32, distance: f32, deviation: f32) -> f32 {
    let distance = distance / if deviation > 1e-6 { deviation } else { 1e-6 };
    if distance > furthest { distance } else { furthest }
}
