//! Linear time-invariant translation: the method of Hsu 2005, as a stream.
//!
//! Every joint is a small system of its own, fed with its normalised dofs:
//!
//! `x[t+1] = A x[t] + B u[t]`, `y[t] = C x[t] + D u[t]` (eqs. 5 and 6)
//!
//! The root's motion drives one more output, the logarithm of the differential time warp, whose exponential is the
//! step (section 4.1). The state is the only memory and begins at `x = 0` (section 4.4). Poles lie inside the unit
//! circle, so any state decays. Feet stand where a projection of the frame's new state lies beyond a boundary (section
//! 4.5, "Annotation").
//!
//! **Unexpected input** (section 4.5, eqs. 7 and 8). A part `b = max over dofs of erf(|u| / (kc √2))^kp` of the input
//! is blended into the output, where u is the input's distance from its mean in standard deviations. The function
//! increases with |u|, so the maximum is taken first, and erf and power are computed once. Another dof is the furthest
//! from frame to frame, and the output would jump between model and input. The part therefore settles,
//! `b' = b + e^(-Δt / τ) (b'[t-1] - b)`, where τ is [`Config::settle_s`]; 0 is the paper's own.
//!
//! **Several styles** are several models on the same input, summed by their weights (section 6). Weights change gradually,
//! so that a model that starts at `x = 0` causes no jump.
//!
//! Cost: (n + p)(n + m) products a joint and model, where a joint has n states, m inputs and p outputs.

use crate::{
    Config, Database, Degraded, Observer, Report,
    blob::{
        LinearModel,
        layout::{MAX_ORDER, dof},
    },
    error::saturating_u32,
    math::{clamp, decay, erf, exp, maximum, pow},
    methods::{
        context::{Context, Frame, Needs, Signals, Translate},
        work::{Load, Work},
    },
    search::top_k::insert,
};

/// Greatest number of models that are blended.
const MAX_MODELS: usize = 4;
/// Squared distance of the furthest dof, in the model's variances, below which input is of the database's kind, whatever
/// its style.
const FAMILIAR_DISTANCE2: f32 = 33.0;
/// Greatest change of a weight in a frame.
const MAX_WEIGHT_CHANGE: f32 = 0.125;
/// Inputs are clamped to this many standard deviations, more than any trusted input has. States thus stay finite, and the
/// effect of one wrong frame is gone after two seconds.
const MAX_DEVIATIONS: f32 = 30.0;
/// The logarithm of the time warp is clamped to ±ln 4.
const MAX_LOG_STEP: f32 = 1.386_294_4;

/// A running model: its number, its weight, and its states, unit after unit.
#[derive(Debug, Clone)]
struct Slot<const J: usize> {
    model: Option<u16>,
    weight: f32,
    /// Part of the input in its last output; `None` before it.
    input_part: Option<f32>,
    states: [[f32; MAX_ORDER]; J],
}

/// State of the method between frames.
#[derive(Debug, Clone)]
pub(crate) struct Linear<const J: usize> {
    slots: [Slot<J>; MAX_MODELS],
    /// Weight of the input itself, if its own style is one of the output styles.
    input_weight: f32,
}

/// The models of the output styles, by number, and their weights.
type TargetModels = heapless::Vec<(u16, f32), MAX_MODELS>;

impl<const J: usize> Translate<J> for Linear<J> {
    const NEW: Self = Self { slots: [const { Slot::FREE }; MAX_MODELS], input_weight: 0.0 };
    // All joints share a state and a time step. Labels select models, not frames.
    const NEEDS: Needs = Needs { labelled_class: false, whole_body: true };

    /// Models that fade out run beside those that fade in, up to the number of slots.
    fn worst_step(database: &Database<'_>, _config: &Config, _load: &Load) -> Work {
        let largest = (0..database.linear_models()).map(|m| database.linear_model(m).bytes()).max();
        Work { bytes_read: saturating_u32(MAX_MODELS * largest.unwrap_or(0)), ..Work::default() }
    }

    #[inline(never)]
    fn predict(&mut self, context: &mut Context<'_, '_, J, impl Observer<J>>) {
        self.predict_frame(context.frame, context.signals, context.report);
    }

    fn reset(&mut self) {
        // In place: a new state of 3 KB would be on the stack first.
        self.input_weight = 0.0;
        self.slots.iter_mut().for_each(Slot::free);
    }
}

impl<const J: usize> Linear<J> {
    fn predict_frame(&mut self, frame: Frame<'_, '_>, signals: &mut Signals<J>, report: &mut Report) {
        let database = frame.database;
        let (target, input_weight) = target_models(frame, report);
        self.fade_weights(&target, input_weight, frame.first);
        if frame.first {
            // A first pose has no frame before it, so it gets the mean velocities of the model's inputs.
            if let Some(&(index, _)) = target.first() {
                let model = database.linear_model(usize::from(index));
                let rates = signals.x.as_flattened_mut().iter_mut().zip(model.inputs());
                rates.take(dof::JOINTS).skip(dof::FORWARD).for_each(|(v, [mean, _])| *v = mean);
            }
            signals.x_prev = signals.x;
            signals.y_prev = signals.x;
        }
        let total: f32 = self.input_weight + self.slots.iter().map(|s| s.weight).sum::<f32>();
        let total = if total > 1e-6 { total } else { 1.0 };
        let share = self.input_weight / total;
        let dofs = signals.predicted.as_flattened_mut().iter_mut().zip(signals.x.as_flattened());
        dofs.take(database.counts().dofs).for_each(|(predicted, x)| *predicted = share * x);
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
            let (input_part, log_step) =
                translate(&model, states, &mut slot.input_part, frame, share, dofs, report);
            step_s +=
                share * input_step * exp((1.0 - input_part) * clamp(log_step, -MAX_LOG_STEP, MAX_LOG_STEP));
            for (side, standing) in standing.iter_mut().enumerate() {
                let (boundary, projection) = model.foot(side);
                let sum = projection.product(states.get(..model.states).unwrap_or(&[]));
                *standing += if sum > boundary { share } else { -share };
            }
        }
        report.distance_ratio = report.distance2 / FAMILIAR_DISTANCE2;
        report.contact_likelihood = standing.map(|s| if s > 0.0 { 1.0 } else { 0.0 });
        report.predicted_step_s = step_s;
    }

    /// Changes the weights towards their targets, and starts and frees models.
    fn fade_weights(&mut self, target: &TargetModels, input_weight: f32, at_once: bool) {
        let max_change = if at_once { 1.0 } else { MAX_WEIGHT_CHANGE };
        let towards = |from: f32, to: f32| from + clamp(to - from, -max_change, max_change);
        self.input_weight = towards(self.input_weight, input_weight);
        for slot in &mut self.slots {
            let Some(model) = slot.model else { continue };
            let weight = target.iter().find(|w| w.0 == model).map_or(0.0, |w| w.1);
            slot.weight = towards(slot.weight, weight);
            if slot.weight <= 0.0 {
                slot.free();
            }
        }
        for &(model, weight) in target {
            if self.slots.iter().any(|s| s.model == Some(model)) {
                continue;
            }
            // If no slot is free, one will be when its model has faded out.
            if let Some(free) = self.slots.iter_mut().find(|s| s.model.is_none()) {
                free.model = Some(model);
                free.weight = towards(0.0, weight);
            }
        }
    }
}

/// The models of the output styles, heaviest first, and the weight of the input's own style.
#[inline]
fn target_models(frame: Frame<'_, '_>, report: &mut Report) -> (TargetModels, f32) {
    let database = frame.database;
    let from = database.linear_from();
    let mut target = TargetModels::new();
    let mut input_weight = 0.0;
    let mut cut = false;
    let styles = frame.settings.styles.iter().enumerate().take(database.counts().styles);
    for (style, &weight) in styles.filter(|(_, w)| **w > 0.0) {
        let style = style as u16;
        if Some(style) == from {
            input_weight += weight;
            continue;
        }
        let Some(model) = database.linear_model_of(style, frame.settings.action) else { continue };
        cut |= target.is_full();
        insert(&mut target, MAX_MODELS, (model as u16, weight), |other| other.1 >= weight);
    }
    report.degraded.add_if(cut, Degraded::CLASSES);
    (target, input_weight)
}

impl<const J: usize> Slot<J> {
    const FREE: Self = Self { model: None, weight: 0.0, input_part: None, states: [[0.0; MAX_ORDER]; J] };

    /// Removes the model.
    #[inline(never)]
    fn free(&mut self) {
        (self.model, self.weight, self.input_part) = (None, 0.0, None);
        self.states.as_flattened_mut().fill(0.0);
    }
}

/// The dofs that a model reads and writes, as slices of `[dofs]`.
struct ModelDofs<'a> {
    /// The input.
    x: &'a [f32],
    /// Scratch memory for the normalised input.
    normalised: &'a mut [f32],
    /// The sum of the outputs of all models.
    predicted: &'a mut [f32],
}

/// One step of a model: adds its output to the prediction with weight `share`. `last_part` is the part of the input in its
/// last output. Returns that in this one, and the logarithm of the time warp.
// Not generic over capacities, so that it is compiled with the core, optimised for speed.
#[inline(never)]
fn translate(
    model: &LinearModel<'_>,
    mut states: &mut [f32],
    last_part: &mut Option<f32>,
    frame: Frame<'_, '_>,
    share: f32,
    signals: ModelDofs<'_>,
    report: &mut Report,
) -> (f32, f32) {
    let dofs = frame.database.counts().dofs;
    let mut largest = 0.0;
    let inputs = signals.normalised.iter_mut().zip(signals.x);
    for ((u, &x), [mean, deviation]) in inputs.zip(model.inputs()) {
        *u = clamp((x - mean) / deviation, -MAX_DEVIATIONS, MAX_DEVIATIONS);
        let distance = crate::math::abs(*u);
        largest = maximum(distance, largest);
    }
    report.distance2 = maximum(largest * largest, report.distance2);
    let unexpected = blend(largest, frame.config.confidence, frame.config.preference);
    let left = decay(1.0 / frame.database.rate_hz(), frame.config.settle_s);
    let input_part = unexpected + left * (last_part.unwrap_or(unexpected) - unexpected);
    *last_part = Some(input_part);
    // The part of the input that is unlike the training data passes through.
    let mixed = signals.predicted.iter_mut().zip(signals.x);
    mixed.take(dofs).for_each(|(predicted, x)| *predicted += share * input_part * x);

    let weight = share * (1.0 - input_part);
    let mut log_step = 0.0;
    for unit in model.units() {
        let Some((state, rest)) = states.split_at_mut_checked(unit.order) else { break };
        states = rest;
        let mut numbers = unit.numbers;
        let Some(u) = signals.normalised.get(unit.first_input..) else { break };
        let Some(u) = u.get(..unit.inputs) else { break };
        let mut next = [0.0; MAX_ORDER];
        let following = next.get_mut(..unit.order).unwrap_or(&mut []);
        numbers.add_products(following, state);
        numbers.add_products(following, u);
        let mut outputs = [0.0; 4];
        let used = outputs.get_mut(..unit.outputs).unwrap_or(&mut []);
        numbers.add_products(used, state);
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
        for (slot, value) in state.iter_mut().zip(next) {
            // A blob may have any stable model, so large states are clamped.
            *slot = clamp(value, -1e6, 1e6);
        }
    }
    (input_part, log_step)
}

/// The part of the input that is blended in, 0 to 1: `erf(distance / (kc √2))^kp`.
fn blend(distance: f32, confidence: f32, preference: f32) -> f32 {
    pow(erf(distance / (confidence * core::f32::consts::SQRT_2)), preference)
}
