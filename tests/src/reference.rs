//! The method once more, slow and obvious, in `f64`: sums over all frames, matrices written out, no graph, no cache, no
//! shifted sums. The equations of Xia 2015 stand here as they are printed; the core has to agree.
//!
//! Only stored values come from [`Database`]; counterparts are computed here from the stored cycles and knots.

use gestus_core::{
    Database,
    blob::{
        Leg,
        layout::{NONE, ROOT_DOFS, cycle, dof, flag, query, section},
        read::{Record, f32_at, u16_at},
    },
    search::query::PRODUCT_BITS,
};
use nalgebra::{Matrix4, UnitQuaternion, Vector3, Vector4};

use crate::trace;

/// The settings of the method.
#[derive(Debug, Clone)]
pub struct Parameters {
    /// Neighbors a class.
    pub k: usize,
    /// λ of the ridge.
    pub lambda: f64,
    /// Ridge on dofs divided by their standard deviations.
    pub normalised: bool,
    /// How many times λ the coefficient of `y[t-1]` is penalised with.
    pub feedback: f64,
    /// κy: half width of the interval that is put out from, in the dof's scales.
    pub output_kappa: f64,
    /// δ of eq. 4.
    pub delta: f64,
    /// Weight that may be dropped.
    pub prune: f64,
    /// Most classes.
    pub classes: usize,
    /// κ of eq. 6.
    pub kappa: f64,
    /// ρ of eq. 7.
    pub rho: f64,
    /// The same in the output, as a multiple of ρ that follows the style; 0 for ρ.
    pub liveliness: f64,
    /// Time in which the output settles on the prediction, seconds; 0 for at once.
    pub settle_s: f64,
    /// Width of the timing kernel.
    pub timing_width: f64,
    /// Weight of each output style; they sum to 1.
    pub styles: Vec<f64>,
    /// Whether the search looks at a joint group.
    pub searched: Vec<bool>,
    /// Strength of each joint group.
    pub strength: Vec<f64>,
}

/// The variables of one neighbor.
#[derive(Debug, Clone)]
pub struct Example {
    /// `x[t-1]`.
    pub x_prev: Vec<f64>,
    /// `y[t-1]`.
    pub y_prev: Vec<f64>,
    /// `x[t]`.
    pub x: Vec<f64>,
    /// `y[t]`.
    pub y: Vec<f64>,
    /// Seconds from `y[t-1]` to `y[t]`.
    pub step_s: f64,
}

/// What a step should have computed.
#[derive(Debug, Clone)]
pub struct Step {
    /// The prediction, after yaw and strength.
    pub predicted: Vec<f64>,
    /// The prediction before strength: what is fed back.
    pub fed_back: Vec<f64>,
    /// The output before strength, and its step from the one before, which the next step goes on from.
    pub settled: [Vec<f64>; 2],
    /// The output, with strength; the ground velocities are without the correction of a body that stands still.
    pub output: Vec<f64>,
    /// The predicted time step, seconds.
    pub step_s: f64,
    /// Weights of the neighbors in the timing, for each kept class in the order of its rows.
    pub timing_weights: Vec<Vec<f64>>,
    /// Share of the votes by which each foot stands.
    pub votes: [f64; 2],
}

fn bytes<'db>(db: &Database<'db>, id: u16) -> &'db [u8] {
    db.sections().into_iter().find(|s| s.0 == id).map_or(&[], |s| s.1)
}

/// The dofs of a stored row.
pub fn row(db: &Database<'_>, row: usize) -> Vec<f64> {
    let mut dofs = vec![0.0; db.counts().dofs];
    db.decode(row, &mut dofs);
    dofs.into_iter().map(f64::from).collect()
}

/// Squared distance of a stored frame to a query over the groups that are searched.
pub fn distance2(db: &Database<'_>, query: &[f32], row: usize, searched: &[bool]) -> f64 {
    db.feature(row)
        .iter()
        .enumerate()
        .filter(|(f, _)| searched[db.feature_group(*f)])
        .map(|(f, &code)| {
            (f64::from(query[f]) - f64::from(code as i8) * f64::from(db.feature_scale(f))).powi(2)
        })
        .sum()
}

/// All rows of a class that may be found, nearest first: row of the class and squared distance.
pub fn brute_force(db: &Database<'_>, class: usize, query: &[f32], searched: &[bool]) -> Vec<(u16, f64)> {
    let class = db.class(class);
    let mut all: Vec<(u16, f64)> = (0..class.rows)
        .filter(|r| db.flags(class.first_row + r) & flag::SEARCHABLE != 0)
        .map(|r| (r as u16, distance2(db, query, class.first_row + r, searched)))
        .collect();
    all.sort_by(|a, b| a.1.total_cmp(&b.1));
    all
}

/// The feature of a window of joint positions (oldest frame first, shape `[window][joints]`): eq. 1's closed form onto
/// the mean cloud, then the components.
pub fn feature(db: &Database<'_>, window: &[Vec<Vector3<f64>>]) -> Vec<f64> {
    let c = db.counts();
    let data = db.query_section();
    let whole = |at: usize| f64::from(u16_at(data, at) as i16);
    let point = |at: usize| Vector3::new(whole(at), whole(at + 2), whole(at + 4));
    let mean = |w: usize, j: usize| {
        point(query::mean(c.features) + 6 * (w * c.joints + j)) * f64::from(db.length_unit())
    };
    let weight = |j: usize| f64::from(data[query::weights(c.window, c.joints, c.features) + j]);
    let points = || (0..c.window).flat_map(|w| (0..c.joints).map(move |j| (w, j)));
    let total: f64 = points().map(|(_, j)| weight(j)).sum();
    let centre = points().map(|(w, j)| window[w][j] * weight(j)).sum::<Vector3<f64>>() / total;
    let centre = Vector3::new(centre.x, 0.0, centre.z);
    let (mut a, mut b) = (0.0, 0.0);
    for (w, j) in points() {
        let (m, p) = (mean(w, j), window[w][j] - centre);
        a += weight(j) * (m.x * p.x + m.z * p.z);
        b += weight(j) * (m.x * p.z - m.z * p.x);
    }
    let turn = UnitQuaternion::from_axis_angle(&Vector3::y_axis(), b.atan2(a));
    let mut at = query::components(c.window, c.joints, c.features);
    (0..c.features)
        .map(|f| {
            let mut sum = 0.0;
            let unit =
                f64::from(db.component_step(f)) / f64::from(db.length_unit() * (1 << PRODUCT_BITS) as f32);
            for (w, j) in points().filter(|p| db.joint_group(p.1) == db.feature_group(f)) {
                let d = turn * (window[w][j] - centre) - mean(w, j);
                sum += d.dot(&point(at)) * unit;
                at += 6;
            }
            sum
        })
        .collect()
}

/// The variables of the frame at a row of the database that belongs to `class`.
pub fn example(db: &Database<'_>, class: usize, at: usize, styles: &[f64]) -> Example {
    let record = |i: usize| Record::of(bytes(db, section::CYCLES), i, cycle::LENGTH);
    let own = db.class(class);
    let input = (own.first_cycle..own.first_cycle + own.cycles)
        .rfind(|&i| record(i).u32(cycle::START) as usize <= at)
        .expect("a frame that may be found lies in a cycle");
    let knots = |i: usize| -> Vec<f64> {
        let first = record(i).u32(cycle::FIRST_KNOT) as usize;
        let count = usize::from(record(i).u16(cycle::KNOTS));
        (first..first + count).map(|k| f64::from(f32_at(bytes(db, section::KNOTS), 4 * k))).collect()
    };
    let clip = |i: usize| db.clip(record(i).u32(cycle::CLIP) as usize);
    let phase = |knots: &[f64], position: f64| {
        let last = knots.len() - 2;
        let i = (1..=last).rfind(|&i| knots[i] <= position).unwrap_or(0);
        (i as f64 + (position - knots[i]) / (knots[i + 1] - knots[i])) / (knots.len() - 1) as f64
    };
    let position = |knots: &[f64], phase: f64| {
        let u = phase * (knots.len() - 1) as f64;
        let i = (u.floor().max(0.0) as usize).min(knots.len() - 2);
        knots[i] + (u - i as f64) * (knots[i + 1] - knots[i])
    };
    let dofs_at = |i: usize, position: f64| -> Vec<f64> {
        let (first, rows) = clip(i);
        let position = position.clamp(0.0, (rows - 1) as f64);
        let below = position.floor() as usize;
        let (a, b) = (row(db, first + below), row(db, first + (below + 1).min(rows - 1)));
        a.iter().zip(&b).map(|(a, b)| a + position.fract() * (b - a)).collect()
    };
    let rate = f64::from(db.rate_hz());
    let mut result = Example {
        x_prev: row(db, at - 1),
        y_prev: vec![0.0; db.counts().dofs],
        x: row(db, at),
        y: vec![0.0; db.counts().dofs],
        step_s: 0.0,
    };
    let frame = (at - clip(input).0) as f64;
    let (pairs, table) = (bytes(db, section::PAIRS), db.counts().cycles * db.counts().styles);
    let tables = pairs.len() / (2 * table);
    let weighted = styles.iter().enumerate().filter(|(_, w)| **w > 0.0);
    for ((style, &weight), second) in weighted.flat_map(|style| (0..tables).map(move |t| (style, t))) {
        let weight = weight / tables as f64;
        let output = u16_at(pairs, 2 * (second * table + input * db.counts().styles + style));
        assert_ne!(output, NONE, "row {at} has no output in style {style}");
        let output = usize::from(output);
        let (now, before) = if output == input {
            (frame, frame - 1.0)
        } else {
            let there = |f: f64| position(&knots(output), phase(&knots(input), f));
            (there(frame), there(frame - 1.0))
        };
        for (sum, value) in result.y.iter_mut().zip(dofs_at(output, now)) {
            *sum += weight * value;
        }
        for (sum, value) in result.y_prev.iter_mut().zip(dofs_at(output, before)) {
            *sum += weight * value;
        }
        let mut rows = now - before;
        let [from, to] = [input, output].map(knots);
        if output != input && from.len() != 3 {
            // No gait: half of the step is by the cycles' durations.
            let whole = |knots: &[f64]| knots[knots.len() - 1] - knots[0];
            rows = 0.5 * (rows + whole(&to) / whole(&from));
        }
        result.step_s += weight * rows / rate;
    }
    result
}

/// Eqs. 2, 3, 6 and 7 for one dof: least squares with all four coefficients penalised, evaluated at the biased input.
/// Returns the prediction, the output made from it, which keeps `part` of what lies outside, and how the output goes on.
pub fn regress(
    examples: &[Example],
    d: usize,
    input: [f64; 3],
    scale: f64,
    p: &Parameters,
    part: f64,
) -> [f64; 3] {
    let s = if p.normalised { scale } else { 1.0 };
    let mut matrix = Matrix4::identity() * p.lambda;
    matrix[(1, 1)] *= p.feedback;
    let mut right = Vector4::zeros();
    for e in examples {
        let v = Vector4::new(e.x_prev[d] / s, e.y_prev[d] / s, e.x[d] / s, 1.0);
        matrix += v * v.transpose();
        right += v * (e.y[d] / s);
    }
    let beta = matrix.lu().solve(&right).expect("a penalised system is regular");
    let n = examples.len() as f64;
    let mean = examples.iter().map(|e| e.x[d]).sum::<f64>() / n;
    let sigma = (examples.iter().map(|e| (e.x[d] - mean).powi(2)).sum::<f64>() / n).sqrt();
    let mean_y = examples.iter().map(|e| e.y[d]).sum::<f64>() / n;
    let into = |value: f64, mean: f64, half: f64| value.max(mean - half).min(mean + half);
    let [x_prev, y_prev, x] = input;
    let outside = x - into(x, mean, p.kappa * sigma);
    let (kept, kept_out) = (p.rho * outside, part * outside);
    let biased = Vector4::new((x_prev - outside) / s, (y_prev - kept) / s, (x - outside) / s, 1.0);
    let prediction = beta.dot(&biased) * s;
    let inside = into(prediction, mean_y, p.output_kappa * scale);
    // A body that stands is moved by its own velocity: the neighbors' mean gives way to it.
    let moves = if (dof::FORWARD..=dof::LEFT).contains(&d) && outside != 0.0 {
        let ratio = (x / (x - outside)).abs().min(1.0);
        3.0 * ratio.powi(2) - 2.0 * ratio.powi(3)
    } else {
        1.0
    };
    let stands = (1.0 - moves) * (x - mean_y - kept_out);
    let change =
        examples.iter().map(|e| e.y[d] - e.y_prev[d] - part * (e.x[d] - e.x_prev[d])).sum::<f64>() / n;
    [
        prediction + kept,
        inside + kept_out + stands,
        moves * (change + part * (x - x_prev)) + (1.0 - moves) * (x - x_prev),
    ]
}

/// What of the input's departure the output keeps: as much as clips of the style differ.
fn part_kept(db: &Database<'_>, class: usize, p: &Parameters) -> f64 {
    if p.liveliness == 0.0 {
        return p.rho;
    }
    let far = |class: usize| f64::from(db.trust_limits(class).expect("the blob says it").far);
    let of_style = |style: usize| {
        let same = |c: &usize| {
            db.class(*c).action == db.class(class).action && usize::from(db.class(*c).style) == style
        };
        (0..db.counts().classes).find(same).map_or(0.0, far)
    };
    let style: f64 = p.styles.iter().enumerate().map(|(style, weight)| weight * of_style(style)).sum();
    let known = far(class) > 0.0 && style > 0.0;
    let ratio = if known { (style / far(class)).sqrt().clamp(0.5, 2.0) } else { 1.0 };
    (p.rho * p.liveliness * ratio).min(1.0)
}

/// Eq. 4 over the mean squared distances of the classes that were searched: proportions before pruning, shape `[C]`.
pub fn proportions(mean_distance2: &[(usize, f64)], delta: f64) -> Vec<(usize, f64)> {
    let least = mean_distance2.iter().map(|d| d.1).fold(f64::INFINITY, f64::min);
    let weights: Vec<(usize, f64)> =
        mean_distance2.iter().map(|&(c, d)| (c, (-(d - least) / (delta * least)).exp())).collect();
    let total: f64 = weights.iter().map(|w| w.1).sum();
    weights.into_iter().map(|(c, w)| (c, w / total)).collect()
}

/// Which foot stands in a captured frame, 0 or 1.
fn label(db: &Database<'_>, row: usize) -> [f64; 2] {
    [flag::LEFT_CONTACT, flag::RIGHT_CONTACT].map(|bit| f64::from(u8::from(db.flags(row) & bit != 0)))
}

/// Which foot stands in a frame's outputs, by the weights of the styles. An average has no label: the frame's own
/// stands in.
fn output_label(db: &Database<'_>, class: usize, row: usize, styles: &[f64]) -> [f64; 2] {
    let cycle = db.cycle_of(class, row).expect("a frame lies in a cycle");
    let mut sum = [0.0; 2];
    for (style, weight) in styles.iter().enumerate().filter(|(_, w)| **w > 0.0) {
        let found: Vec<_> = db.counterparts(cycle, row, style).collect();
        assert!(!found.is_empty(), "a frame that is found has outputs");
        for now in found.iter().map(|c| c.now) {
            let nearest = now.row + usize::from(now.fraction > 0.5);
            let label = label(db, if nearest < db.counts().frames { nearest } else { row });
            let weight = weight / found.len() as f64;
            sum = [sum[0] + weight * label[0], sum[1] + weight * label[1]];
        }
    }
    sum
}

/// Squared distance of a leg, pose and rate of its nine dofs, with a fifth of a second for the rates.
fn leg_distance2(db: &Database<'_>, leg: &Leg, [x, x_prev]: [&[f64]; 2], example: &Example) -> f64 {
    [leg.hip, leg.knee, leg.ankle]
        .iter()
        .flat_map(|joint| (0..3).map(move |i| ROOT_DOFS + 3 * joint + i))
        .map(|d| {
            let pose = x[d] - example.x[d];
            let rate = 0.2 * f64::from(db.rate_hz()) * (pose - (x_prev[d] - example.x_prev[d]));
            pose * pose + rate * rate
        })
        .sum()
}

/// The step of a frame, given the neighbors that the core found, the classes that it kept, and the last output before
/// strength with its own step. Nothing has jumped: the classes are gaits.
pub fn step(db: &Database<'_>, frame: &trace::Frame, p: &Parameters, last: Option<&[Vec<f64>; 2]>) -> Step {
    let counts = db.counts();
    let wide = |values: &[f32]| -> Vec<f64> { values.iter().map(|&v| f64::from(v)).collect() };
    let (x, x_prev, y_prev) = (wide(&frame.x), wide(&frame.x_prev), wide(&frame.y_prev));
    let (mut predictions, mut held) = (vec![0.0; counts.dofs], vec![0.0; counts.dofs]);
    let mut lead = vec![0.0; counts.dofs];
    let (mut step_s, mut stands, mut total) = (0.0, [0.0; 2], [0.0; 2]);
    let mut timing_weights = Vec::new();
    for share in &frame.report.classes {
        let class = usize::from(share.class);
        let proportion = f64::from(share.proportion);
        let timed = frame.timed.iter().find(|t| t.class == class).expect("a kept class was timed");
        let rows: Vec<usize> =
            timed.rows.iter().map(|&row| db.class(class).first_row + usize::from(row)).collect();
        let examples: Vec<Example> = rows.iter().map(|&r| example(db, class, r, &p.styles)).collect();
        let part = part_kept(db, class, p);
        let mut y = vec![0.0; counts.dofs];
        for (d, y) in y.iter_mut().enumerate() {
            let input = [x_prev[d], y_prev[d], x[d]];
            let [prediction, inside, change] = regress(&examples, d, input, f64::from(db.scale(d)), p, part);
            *y = prediction;
            predictions[d] += proportion * prediction;
            held[d] += proportion * inside;
            lead[d] += proportion * change;
        }
        let weights = timing(db, &examples, [&x, &x_prev, &y, &y_prev], p.timing_width);
        step_s += proportion * weights.iter().zip(&examples).map(|(w, e)| w * e.step_s).sum::<f64>();
        timing_weights.push(weights);
        // The nearest vote: all, up to four classes.
        let voters = 160 / frame.report.classes.len();
        for (&r, example) in rows.iter().zip(&examples).take(voters) {
            let (own, output) = (label(db, r), output_label(db, class, r, &p.styles));
            for (side, leg) in db.legs().expect("the generated body has legs").iter().enumerate() {
                let weight = proportion / (leg_distance2(db, leg, [&x, &x_prev], example) + 3e-8).powi(2);
                stands[side] += weight * (own[side] + p.strength[0].min(1.0) * (output[side] - own[side]));
                total[side] += weight;
            }
        }
    }
    let part = |class: u16| if db.is_gait(usize::from(class)) { 0.25 } else { 1.0 };
    let parts = frame.report.classes.iter().map(|s| (f64::from(s.proportion), part(s.class)));
    let (sum, most) =
        parts.fold((0.0, 0.0), |(sum, most), (share, part)| (sum + share * part, share.max(most)));
    let ratio = (sum + 1.0 - most).min(1.0);
    let gesture = |class: u16| f64::from(u8::from(!db.is_gait(usize::from(class))));
    let second =
        0.5 * frame.report.classes.iter().map(|s| f64::from(s.proportion) * gesture(s.class)).sum::<f64>();
    let pole = |part: f64| {
        let time = part * ratio * p.settle_s;
        if time > 0.0 { (-1.0 / (time * f64::from(db.rate_hz()))).exp() } else { 0.0 }
    };
    let (a, b) = (pole(1.0 - second), pole(second));
    let (before, last_step) = match last {
        Some([output, step]) => (output.clone(), step.clone()),
        None => (y_prev.clone(), lead.clone()),
    };
    // A recurrence of the distance from the prediction with the roots a and b, about a moving prediction.
    let settled: Vec<f64> = (0..counts.dofs)
        .map(|d| {
            let distance = before[d] + lead[d] - held[d];
            let one_before = distance - (last_step[d] - lead[d]);
            held[d] + (a + b) * distance - a * b * one_before
        })
        .collect();
    let settled_step = settled.iter().zip(&before).map(|(now, before)| now - before).collect();
    // The heading is the input's.
    let mut held = settled.clone();
    (predictions[6], held[6]) = (x[6], x[6]);
    let strength = |d: usize| p.strength[db.joint_group(d.saturating_sub(ROOT_DOFS) / 3)];
    let with_strength =
        |y: &[f64]| y.iter().zip(&x).enumerate().map(|(d, (y, x))| x + strength(d) * (y - x)).collect();
    let (predicted, output) = (with_strength(&predictions), with_strength(&held));
    Step {
        predicted,
        fed_back: predictions,
        settled: [settled, settled_step],
        output,
        step_s,
        timing_weights,
        votes: [stands[0] / total[0], stands[1] / total[1]],
    }
}

/// Weights of the timing kernel: Gaussian in a distance of pose and change, of input and output.
fn timing(db: &Database<'_>, examples: &[Example], now: [&[f64]; 4], width: f64) -> Vec<f64> {
    let [x, x_prev, y, y_prev] = now;
    let distances: Vec<f64> = examples
        .iter()
        .map(|e| {
            (0..db.counts().timing)
                .map(|i| {
                    let t = db.timing(i);
                    let d = t.dof;
                    let pose = (x[d] - e.x[d]).powi(2) + (y[d] - e.y[d]).powi(2);
                    let change = ((x[d] - x_prev[d]) - (e.x[d] - e.x_prev[d])).powi(2)
                        + ((y[d] - y_prev[d]) - (e.y[d] - e.y_prev[d])).powi(2);
                    f64::from(t.pose) * pose + f64::from(t.change) * change
                })
                .sum()
        })
        .collect();
    let mean = distances.iter().sum::<f64>() / distances.len() as f64;
    let least = distances.iter().copied().fold(f64::INFINITY, f64::min);
    let weights: Vec<f64> = distances.iter().map(|d| (-(d - least) / (2.0 * width * mean)).exp()).collect();
    let total: f64 = weights.iter().sum();
    weights.iter().map(|w| w / total).collect()
}
