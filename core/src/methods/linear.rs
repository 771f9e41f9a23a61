//! Linear time-invariant translation: the method of Hsu 2005, as a stream.
//!
//! Every joint is a small system of its own, fed with its normalised dofs:
//!
//! `x[t+1] = A x[t] + B u[t]`, `y[t] = C x[t] + D u[t]` (eqs. 5 and 6)
//!
//! The root's motion drives one more output, the logarithm of the differential time warp, whose exponential is the
//! step (section 4.1). The state is the only memory, from `x = 0` on a first frame (section 4.4); poles lie
//! inside the unit circle, so that any state decays. Feet stand where a projection of the state lies beyond a
//! boundary (section 4.5, "Annotation"); the state is the one that the frame leads to.
//!
//! **Unexpected input** (section 4.5, eqs. 7 and 8). `b = max over dofs of erf(|u| / (kc √2))^kp` of the input's
//! distance from its mean in standard deviations is how much of the input is blended into the output. The function
//! ascends, so the maximum is taken first, and erf and power once.
//!
//! **Several styles** are several models on the same input, summed by their weights (section 6). Their weights
//! move gradually, so that a model that starts at `x = 0` does not show.
//!
//! Cost: (n + p)(n + m) products a joint and model, where a joint has n states, m inputs and p outputs.

use crate::{
    Config, Database, Degraded, Observer, Report,
    blob::{
        LinearModel,
        layout::{MAX_ORDER, dof},
    },
    math::{clamp, erf, exp, pow},
    methods::{
        context::{Context, Frame, Needs, Signals, Translate},
        work::{Load, Work, as_u32},
    },
    search::top_k::insert,
};

/// Most models that are blended.
pub const BLENDED: usize = 4;
/// Squared distance of the furthest dof, in the model's variances, that input of the database's kind stays below in the
/// mean, in other styles too.
const FAR2: f32 = 33.0;
/// Most that a weight changes in a frame.
const GLIDE: f32 = 0.125;
/// Inputs are held within this many standard deviations, which is beyond any trust: states stay finite whatever comes, and
/// what one wrong frame leaves in them is gone in two seconds.
const FURTHEST: f32 = 30.0;
/// The logarithm of the time warp is held within ±ln 4.
const LOG_STEP: f32 = 1.386_294_4;

/// A model that is running: which, its weight, and its states, unit after unit.
#[derive(Debug, Clone)]
struct Slot<const J: usize> {
    model: Option<u16>,
    weight: f32,
    states: [[f32; MAX_ORDER]; J],
}

/// State of the method between frames.
#[derive(Debug, Clone)]
pub(crate) struct Linear<const J: usize> {
    slots: [Slot<J>; BLENDED],
    /// Weight of the input itself: its own style is one of those wanted.
    plain: f32,
}

/// The models wanted and their weights.
type Wanted = heapless::Vec<(u16, f32), BLENDED>;

impl<const J: usize> Translate<J> for Linear<J> {
    const NEW: Self = Self { slots: [const { Slot::FREE }; BLENDED], plain: 0.0 };
    // One state and one time step for all joints; labels choose models, not frames.
    const NEEDS: Needs = Needs { labelled_class: false, whole_body: true };

    /// Models that fade out run beside those that fade in, as many as there is room for.
    fn worst_step(database: &Database<'_>, _config: &Config, _load: &Load) -> Work {
        let largest = (0..database.linear_models()).map(|m| database.linear_model(m).bytes()).max();
        Work { bytes_read: as_u32(BLENDED * largest.unwrap_or(0)), ..Work::default() }
    }

    #[inline(never)]
    fn predict(&mut self, context: &mut Context<'_, '_, J, impl Observer<J>>) {
        self.predict_frame(context.frame, context.signals, context.report);
    }

    fn reset(&mut self) {
        // In its place: a new one would be on the stack first, which is 3 KB.
        self.plain = 0.0;
        self.slots.iter_mut().for_each(Slot::free);
    }
}

impl<const J: usize> Linear<J> {
    fn predict_frame(&mut self, frame: Frame<'_, '_>, signals: &mut Signals<J>, report: &mut Report) {
        let database = frame.database;
        let (wanted, plain) = wanted_models(frame, report);
        self.steer(&wanted, plain, frame.first);
        if frame.first {
            // A first pose has no frame before it: it moves as its kind does on average.
            if let Some(&(index, _)) = wanted.first() {
                let model = database.linear_model(usize::from(index));
                let rates = signals.x.as_flattened_mut().iter_mut().zip(model.inputs());
                rates.take(dof::JOINTS).skip(dof::FORWARD).for_each(|(v, [mean, _])| *v = mean);
            }
            signals.x_prev = signals.x;
            signals.y_prev = signals.x;
        }
        let total: f32 = self.plain + self.slots.iter().map(|s| s.weight).sum::<f32>();
        let total = if total > 1e-6 { total } else { 1.0 };
        let share = self.plain / total;
        let plain = signals.predicted.as_flattened_mut().iter_mut().zip(signals.x.as_flattened());
        plain.take(database.counts().dofs).for_each(|(predicted, x)| *predicted = share * x);
        let input_step = 1.0 / database.rate_hz();
        let mut step_s = share * input_step;
        let mut standing = [0.0; 2];
        for slot in self.slots.iter_mut() {
            let Some(index) = slot.model else { continue };
            let model = database.linear_model(usize::from(index));
            report.bytes_read += model.bytes() as u32;
            let share = slot.weight / total;
            let states = slot.states.as_flattened_mut();
            let dofs = ModelDofs {
                x: signals.x.as_flattened(),
                normalised: signals.scratch.as_flattened_mut(),
                predicted: signals.predicted.as_flattened_mut(),
            };
            let (passed, log_step) = translate(&model, states, frame, share, dofs, report);
            step_s += share * input_step * exp((1.0 - passed) * clamp(log_step, -LOG_STEP, LOG_STEP));
            for (side, standing) in standing.iter_mut().enumerate() {
                let (boundary, projection) = model.foot(side);
                let sum = projection.product(states.get(..model.states).unwrap_or(&[]));
                *standing += if sum > boundary { share } else { -share };
            }
        }
        report.distance_ratio = report.distance2 / FAR2;
        report.contacts = standing.map(|s| s > 0.0);
        report.predicted_step_s = step_s;
    }

    /// Moves the weights towards those wanted.
    fn steer(&mut self, wanted: &Wanted, plain: f32, at_once: bool) {
        let glide = if at_once { 1.0 } else { GLIDE };
        let towards = |from: f32, to: f32| from + clamp(to - from, -glide, glide);
        self.plain = towards(self.plain, plain);
        for slot in &mut self.slots {
            let Some(model) = slot.model else { continue };
            let weight = wanted.iter().find(|w| w.0 == model).map_or(0.0, |w| w.1);
            slot.weight = towards(slot.weight, weight);
            if slot.weight <= 0.0 {
                slot.free();
            }
        }
        for &(model, weight) in wanted {
            if self.slots.iter().any(|s| s.model == Some(model)) {
                continue;
            }
            // Where none is free, one will be when it has faded.
            if let Some(free) = self.slots.iter_mut().find(|s| s.model.is_none()) {
                free.model = Some(model);
                free.weight = towards(0.0, weight);
            }
        }
    }
}

/// The models of the styles wanted, heaviest first, and the weight of the input's own style.
#[inline]
fn wanted_models(frame: Frame<'_, '_>, report: &mut Report) -> (Wanted, f32) {
    let database = frame.database;
    let from = database.linear_from();
    let mut wanted = Wanted::new();
    let mut plain = 0.0;
    let mut cut = false;
    let styles = frame.settings.styles.iter().enumerate().take(database.counts().styles);
    for (style, &weight) in styles.filter(|(_, w)| **w > 0.0) {
        let style = style as u16;
        if Some(style) == from {
            plain += weight;
            continue;
        }
        let Some(model) = database.linear_model_of(style, frame.settings.action) else { continue };
        cut |= wanted.is_full();
        insert(&mut wanted, BLENDED, (model as u16, weight), |other| other.1 >= weight);
    }
    report.degraded.set(Degraded::CLASSES, cut);
    (wanted, plain)
}

impl<const J: usize> Slot<J> {
    const FREE: Self = Self { model: None, weight: 0.0, states: [[0.0; MAX_ORDER]; J] };

    /// Forgets its model.
    #[inline(never)]
    fn free(&mut self) {
        (self.model, self.weight) = (None, 0.0);
        self.states.as_flattened_mut().fill(0.0);
    }
}

/// The dofs that a model reads and writes, whatever the capacity.
struct ModelDofs<'a> {
    x: &'a [f32],
    /// Scratch memory for the normalised input.
    normalised: &'a mut [f32],
    predicted: &'a mut [f32],
}

/// One step of a model: adds its output, weighted, to what is predicted. Returns how much of the input was blended in,
/// and the logarithm of the time warp.
// Of no capacity: it is compiled with the core, for speed, however its caller is.
#[inline(never)]
fn translate(
    model: &LinearModel<'_>,
    mut states: &mut [f32],
    frame: Frame<'_, '_>,
    share: f32,
    signals: ModelDofs<'_>,
    report: &mut Report,
) -> (f32, f32) {
    let dofs = frame.database.counts().dofs;
    let mut furthest = 0.0;
    let inputs = signals.normalised.iter_mut().zip(signals.x);
    for ((u, &x), [mean, deviation]) in inputs.zip(model.inputs()) {
        *u = clamp((x - mean) / deviation, -FURTHEST, FURTHEST);
        let distance = crate::math::abs(*u);
        furthest = if distance > furthest { distance } else { furthest };
    }
    report.distance2 =
        if furthest * furthest > report.distance2 { furthest * furthest } else { report.distance2 };
    let passed = blend(furthest, frame.config.confidence, frame.config.preference);
    // Content that the data has never seen: the input itself.
    let mixed = signals.predicted.iter_mut().zip(signals.x);
    mixed.take(dofs).for_each(|(predicted, x)| *predicted += share * passed * x);

    let weight = share * (1.0 - passed);
    let mut log_step = 0.0;
    for unit in model.units() {
        let Some((own, rest)) = states.split_at_mut_checked(unit.order) else { break };
        states = rest;
        let mut numbers = unit.numbers;
        let Some(u) = signals.normalised.get(unit.first_input..) else { break };
        let Some(u) = u.get(..unit.inputs) else { break };
        let mut next = [0.0; MAX_ORDER];
        let following = next.get_mut(..unit.order).unwrap_or(&mut []);
        numbers.add_products(following, own);
        numbers.add_products(following, u);
        let mut outputs = [0.0; 4];
        let used = outputs.get_mut(..unit.outputs).unwrap_or(&mut []);
        numbers.add_products(used, own);
        numbers.add_products(used, u);
        for (i, output) in outputs.iter().enumerate().take(unit.outputs) {
            let d = unit.first_output + i;
            let [_, _, mean, deviation] = model.dof(d);
            let value = mean + deviation * output;
            if d >= dofs {
                log_step = value;
            } else if let Some(slot) = signals.predicted.get_mut(d) {
                *slot += weight * value;
            }
        }
        for (slot, value) in own.iter_mut().zip(next) {
            // A blob may be anything that is stable: a state that runs far is held.
            *slot = clamp(value, -1e6, 1e6);
        }
    }
    (passed, log_step)
}

/// How much of the input is blended in: `erf(distance / (kc √2))^kp`.
fn blend(distance: f32, confidence: f32, preference: f32) -> f32 {
    pow(erf(distance / (confidence * core::f32::consts::SQRT_2)), preference)
}
