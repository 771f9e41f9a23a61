//! The core against the slow `f64` reference, on every frame of streams under many settings.

use gestus_core::{
    Config, Database, Degraded,
    blob::layout::dof,
    config::{Ridge, Timing},
    search::{graph::MAX_VISITS, metric::TOTAL},
};
use gestus_database::{
    build::{BuildOptions, build},
    pairing::Scheme,
    stream::{Request, stream},
};
use gestus_motion::clip::Clip;
use gestus_tests::{
    motion,
    reference::{self, Parameters, Step},
    trace::{Frame, Searched, Timed, Trace},
};
use nalgebra::{UnitQuaternion, Vector3};

/// Largest difference of a dof, m, rad, m/s and rad/s: the project's tolerance; beyond 1, of the dof. (The stream that
/// is fed back may run away from the data; then a prediction is a slope times a large number.)
const DOF: f64 = 1e-4;
/// Largest difference of a proportion, a timing weight or a vote, all between 0 and 1: f32 sums of some hundred terms
/// under an exponential.
const SHARE: f64 = 1e-3;
/// Largest difference of a time step, seconds: a weight's tolerance times the few milliseconds by which steps differ.
const STEP_S: f64 = 1e-5;
/// Largest relative difference of a squared distance: 32 terms of f32.
const DISTANCE: f64 = 1e-4;

/// A case of the tables below: the settings of the stylizer.
#[derive(Clone)]
struct Case {
    name: &'static str,
    style: Vec<(u16, f32)>,
    action: Option<u16>,
    input_style: Option<u16>,
    masked: Vec<u16>,
    strength: Vec<(u16, f32)>,
    ridge: (Ridge, f32),
    feedback: f32,
    output_kappa: f32,
    bias: (f32, f32),
    /// `liveliness` and `settle_s`.
    delivery: (f32, f32),
    delta: f32,
    classes: u8,
    k: u16,
    timing: Timing,
}

impl Case {
    fn new(name: &'static str) -> Self {
        Self {
            name,
            style: vec![(1, 1.0)],
            action: None,
            input_style: None,
            masked: vec![],
            strength: vec![],
            ridge: (Ridge::Raw, 0.1),
            feedback: 1.0,
            output_kappa: 2.0,
            bias: (0.25, 0.5),
            delivery: (Config::new().liveliness, Config::new().settle_s),
            delta: 0.2,
            classes: 8,
            k: 16,
            timing: Timing::Free,
        }
    }

    fn request(&self) -> Request {
        // What comes after the settled prediction is not part of the reference: the lock, and the limit, which is one while
        // a stream begins.
        let config = Config::new()
            .contacts(false)
            .speed_limit(0.0)
            .trust(0.0)
            .still_speed(0.0)
            .joint_margin(0.0)
            .k(self.k)
            .ridge(self.ridge.0)
            .lambda(self.ridge.1)
            .feedback(self.feedback)
            .output_kappa(self.output_kappa)
            .kappa(self.bias.0)
            .rho(self.bias.1)
            .liveliness(self.delivery.0)
            .settle_s(self.delivery.1)
            .delta(self.delta)
            .classes(self.classes)
            .prune(0.01)
            .visits(MAX_VISITS)
            .timing_width(0.5)
            .timing(self.timing);
        Request {
            bounds: None,
            config,
            style: self.style.clone(),
            action: self.action,
            input_style: self.input_style,
            masked: self.masked.clone(),
            strength: self.strength.clone(),
            group_styles: vec![],
        }
    }

    fn parameters(&self, db: &Database<'_>) -> Parameters {
        let mut styles = vec![0.0; db.counts().styles];
        let total: f64 = self.style.iter().map(|s| f64::from(s.1)).sum();
        self.style.iter().for_each(|s| styles[usize::from(s.0)] += f64::from(s.1) / total);
        let mut strength = vec![1.0; db.counts().groups];
        self.strength.iter().for_each(|s| strength[usize::from(s.0)] = f64::from(s.1));
        Parameters {
            k: usize::from(self.k),
            lambda: f64::from(self.ridge.1),
            normalised: self.ridge.0 == Ridge::Normalised,
            feedback: f64::from(self.feedback),
            output_kappa: f64::from(self.output_kappa),
            delta: f64::from(self.delta),
            prune: 0.01,
            classes: usize::from(self.classes),
            kappa: f64::from(self.bias.0),
            rho: f64::from(self.bias.1),
            liveliness: f64::from(self.delivery.0),
            settle_s: f64::from(self.delivery.1),
            timing_width: 0.5,
            styles,
            searched: (0..db.counts().groups).map(|g| !self.masked.contains(&(g as u16))).collect(),
            strength,
        }
    }
}

/// Recall of the search against brute force.
#[derive(Default)]
struct Recall {
    found: usize,
    wanted: usize,
    /// Classes that were not searched, over all frames.
    unsearched: usize,
}

impl Recall {
    fn value(&self) -> f64 {
        self.found as f64 / self.wanted as f64
    }
}

fn near(what: &str, case: &str, t: usize, a: f64, b: f64, tolerance: f64) {
    assert!((a - b).abs() <= tolerance, "{case}, frame {t}, {what}: core {a}, reference {b}");
}

/// Distances, neighbors and means of a frame.
fn check_search(
    db: &Database<'_>,
    case: &Case,
    t: usize,
    frame: &Frame,
    p: &Parameters,
    recall: &mut Recall,
) {
    let wanted = |c: usize| {
        let class = db.class(c);
        case.action.is_none_or(|a| a == class.action) && case.input_style.is_none_or(|s| s == class.style)
    };
    let mut searched: Vec<usize> = frame.searched.iter().map(|s| s.class).collect();
    searched.sort_unstable();
    let classes: Vec<usize> = (0..db.counts().classes).filter(|&c| wanted(c)).collect();
    assert!(searched.iter().all(|c| classes.contains(c)), "{}, frame {t}: {searched:?}", case.name);
    let unsearched = classes.iter().copied().filter(|c| !searched.contains(c)).collect::<Vec<_>>();
    check_unsearched(db, case, t, frame, p, &unsearched);
    recall.unsearched += unsearched.len();
    // Distances are integers: frames that are as far but for what rounding takes may be found in either order.
    let scales2: f64 = (0..db.counts().features).map(|f| f64::from(db.feature_scale(f)).powi(2)).sum();
    let rounding2 = 3.0 * scales2 / f64::from(TOTAL);
    for Searched { class: c, neighbors: found, mean_distance2: mean } in &frame.searched {
        let class = db.class(*c);
        let k = p.k.min(class.k_cap);
        assert_eq!(found.len(), k, "{}, frame {t}, class {c}", case.name);
        let exact = reference::brute_force(db, *c, &frame.query, &p.searched);
        let farthest = exact[k - 1].1 * (1.0 + DISTANCE) + rounding2;
        let mut sum = 0.0;
        for &(row, distance2) in found {
            let own = reference::distance2(db, &frame.query, class.first_row + usize::from(row), &p.searched);
            near("distance", case.name, t, f64::from(distance2), own, DISTANCE * own + 1e-9);
            recall.found += usize::from(own <= farthest);
            sum += own;
        }
        recall.wanted += k;
        let own = sum / k as f64;
        near("mean distance", case.name, t, f64::from(*mean), own, DISTANCE * own + 1e-9);
    }
}

/// Classes that the search left out have no weight: together less than the mixture may drop.
fn check_unsearched(
    db: &Database<'_>,
    case: &Case,
    t: usize,
    frame: &Frame,
    p: &Parameters,
    unsearched: &[usize],
) {
    let mut means: Vec<(usize, f64)> =
        frame.searched.iter().map(|s| (s.class, f64::from(s.mean_distance2))).collect();
    for &c in unsearched {
        let k = p.k.min(db.class(c).k_cap);
        let exact = reference::brute_force(db, c, &frame.query, &p.searched);
        means.push((c, exact.iter().take(k).map(|n| n.1).sum::<f64>() / k as f64));
    }
    let weights = reference::proportions(&means, p.delta);
    let lost: f64 = weights.iter().filter(|(c, _)| unsearched.contains(c)).map(|w| w.1).sum();
    assert!(lost <= p.prune, "{}, frame {t}: {lost} of the weight was not searched", case.name);
}

/// Eq. 4, and that only classes below the threshold were dropped.
fn check_mixture(case: &Case, t: usize, frame: &Frame, p: &Parameters) {
    let means: Vec<(usize, f64)> =
        frame.searched.iter().map(|s| (s.class, f64::from(s.mean_distance2))).collect();
    let mut all = reference::proportions(&means, p.delta);
    all.sort_by(|a, b| b.1.total_cmp(&a.1));
    let kept = &frame.report.classes;
    let weight: f64 = all.iter().take(kept.len()).map(|s| s.1).sum();
    let before: f64 = all.iter().take(kept.len() - 1).map(|s| s.1).sum();
    // At most two classes where the search starts again, which is reported.
    let anew = frame.report.degraded.contains(Degraded::CLASSES) && kept.len() == 2;
    let enough = weight >= 1.0 - p.prune - SHARE || kept.len() == p.classes.min(all.len()) || anew;
    assert!(enough, "{}, frame {t}: {weight} of the weight is kept", case.name);
    assert!(before <= 1.0 - p.prune + SHARE, "{}, frame {t}: {before} would have done", case.name);
    let total: f64 = kept.iter().map(|s| f64::from(s.proportion)).sum();
    near("sum of proportions", case.name, t, total, 1.0, 1e-5);
    for share in kept {
        let own = all.iter().find(|a| a.0 == usize::from(share.class)).expect("a kept class was searched").1;
        near("proportion", case.name, t, f64::from(share.proportion), own / weight, SHARE);
    }
}

/// Prediction, timing and contacts.
fn check_step(
    db: &Database<'_>,
    case: &Case,
    t: usize,
    frame: &Frame,
    p: &Parameters,
    last: Option<&[Vec<f64>; 2]>,
) -> Step {
    let step = reference::step(db, frame, p, last);
    for (d, (&core, &own)) in frame.predicted.iter().zip(&step.predicted).enumerate() {
        near(&format!("dof {d}"), case.name, t, f64::from(core), own, DOF * own.abs().max(1.0));
    }
    near("time step", case.name, t, f64::from(frame.report.predicted_step_s), step.step_s, STEP_S);
    let input_step = 1.0 / f64::from(db.rate_hz());
    let out = match case.timing {
        Timing::Sync => input_step,
        _ => input_step + p.strength[db.joint_group(0)] * (step.step_s - input_step),
    };
    near("output step", case.name, t, f64::from(frame.report.step_s), out, STEP_S);
    assert_eq!(frame.timed.len(), step.timing_weights.len());
    for (Timed { rows, weights, .. }, own) in frame.timed.iter().zip(&step.timing_weights) {
        assert!(rows.len() == own.len(), "{}, frame {t}: {rows:?}", case.name);
        for (&core, &own) in weights.iter().zip(own) {
            near("timing weight", case.name, t, f64::from(core), own, SHARE);
        }
    }
    for (side, vote) in step.votes.into_iter().enumerate() {
        near("likelihood", case.name, t, f64::from(frame.report.contact_likelihood[side]), vote, SHARE);
    }
    assert!(!frame.report.degraded.contains(Degraded::PREDICTION), "{}, frame {t}", case.name);
    step
}

/// Streams a clip and checks every frame; returns the recall of the search.
fn check(db: &Database<'_>, clip: &Clip, case: &Case) -> Recall {
    let mut trace = Trace::default();
    let streamed = stream(db, clip, &case.request(), &mut trace).expect(case.name);
    assert_eq!(trace.frames.len(), clip.frames.len());
    let p = case.parameters(db);
    let mut recall = Recall::default();
    let (mut fed_back, mut settled): (Option<Vec<f64>>, Option<[Vec<f64>; 2]>) = (None, None);
    for (t, frame) in trace.frames.iter().enumerate() {
        check_search(db, case, t, frame, &p, &mut recall);
        check_mixture(case, t, frame, &p);
        if let Some(last) = &fed_back {
            for (d, (&core, &own)) in frame.y_prev.iter().zip(last).enumerate() {
                near(
                    &format!("fed back dof {d}"),
                    case.name,
                    t,
                    f64::from(core),
                    own,
                    DOF * own.abs().max(1.0),
                );
            }
            assert_eq!(frame.x_prev, trace.frames[t - 1].x, "{}, frame {t}", case.name);
        }
        let step = check_step(db, case, t, frame, &p, settled.as_ref());
        check_pose(db, case, t, &step, &streamed.steps[t].frame);
        if t > 0 {
            let [before, now] = [t - 1, t].map(|t| streamed.steps[t].frame.root);
            let moved = f64::hypot(now.x - before.x, now.z - before.z);
            let speed = f64::hypot(step.output[dof::FORWARD], step.output[dof::LEFT]);
            // A pose keeps its own time, whenever it is shown.
            let input_step = 1.0 / f64::from(db.rate_hz());
            let own_s = input_step + p.strength[db.joint_group(0)] * (step.step_s - input_step);
            let wanted = speed * own_s;
            near("way on the ground", case.name, t, moved, wanted, DOF);
        }
        (fed_back, settled) = (Some(step.fed_back), Some(step.settled));
    }
    recall
}

/// Joint rotations of the output: the mean, then the exponential of the dofs.
fn check_pose(db: &Database<'_>, case: &Case, t: usize, step: &Step, output: &gestus_motion::clip::Frame) {
    near("height", case.name, t, output.root.y, step.output[0], DOF);
    for j in 1..db.counts().joints {
        let map = Vector3::from_fn(|i, _| step.output[4 + 3 * j + i]);
        let own = mean(db, j) * UnitQuaternion::from_scaled_axis(map);
        near("joint angle", case.name, t, own.angle_to(&output.rotations[j]), 0.0, DOF);
    }
}

fn mean(db: &Database<'_>, joint: usize) -> UnitQuaternion<f64> {
    let [x, y, z, w] = db.joint(joint).mean.map(f64::from);
    UnitQuaternion::new_normalize(nalgebra::Quaternion::new(w, x, y, z))
}

/// A walk that turns into a turn of another style, neither in the database.
fn input(frames: usize) -> Clip {
    motion::joined(&motion::unseen(0, 0, frames), &motion::unseen(1, 1, frames / 2))
}

#[test]
fn small_classes_agree_under_every_labelling() {
    let db = Database::open(motion::small()).unwrap();
    let labels = [
        ("no label", None, None),
        ("action", Some(0), None),
        ("input style", None, Some(0)),
        ("both", Some(1), Some(2)),
    ];
    for (name, action, input_style) in labels {
        let recall = check(&db, &input(40), &Case { action, input_style, ..Case::new(name) });
        assert_eq!(recall.found, recall.wanted, "{name}: small classes are searched whole");
    }
}

#[test]
fn small_classes_agree_under_every_setting() {
    let db = Database::open(motion::small()).unwrap();
    let case = Case::new;
    let cases = [
        Case { style: vec![(0, 1.0), (2, 3.0)], ..case("two styles") },
        Case { style: vec![(0, 0.2), (1, 0.3), (2, 0.5)], ..case("three styles") },
        Case { style: vec![(2, 0.5), (2, 0.5)], ..case("a style said twice") },
        Case { ridge: (Ridge::Normalised, 1.0), ..case("normalised") },
        Case { ridge: (Ridge::Normalised, 0.1), style: vec![(1, 1.0), (2, 1.0)], ..case("normalised, two") },
        Case { ridge: (Ridge::Normalised, 0.1), feedback: 30.0, ..case("normalised, feedback") },
        Case { feedback: 7.0, ..case("raw, feedback") },
        Case { output_kappa: 0.1, ..case("narrow interval of what is put out") },
        Case { output_kappa: 1e6, ..case("no interval of what is put out") },
        Case { ridge: (Ridge::Raw, 1.0), ..case("raw, strong") },
        Case { bias: (2.0, 0.7), ..case("the paper's bias") },
        Case { bias: (0.0, 1.0), ..case("all is outside") },
        Case { bias: (0.25, 0.0), ..case("nothing is kept") },
        Case { delivery: (0.0, 0.0), ..case("the prediction is put out") },
        Case { delivery: (0.0, 0.3), ..case("settled slowly, as lively as the input") },
        Case { delivery: (0.5, 0.0), style: vec![(0, 0.5), (2, 0.5)], ..case("calm, two styles") },
        Case { delivery: (4.0, 0.1), ..case("as lively as can be") },
        Case { delta: 0.7, ..case("wide mixture") },
        Case { delta: 20.0, classes: 2, ..case("two classes of many") },
        Case { masked: vec![1, 2], ..case("arms masked") },
        Case { masked: vec![0], ..case("arms alone") },
        Case { strength: vec![(0, 0.5), (1, 0.0), (2, 1.7)], ..case("strength") },
        Case { timing: Timing::Sync, ..case("sync") },
        Case { k: 40, ..case("forty neighbors") },
        Case { k: 7, ..case("seven neighbors") },
        Case { k: 1, ..case("one neighbor") },
    ];
    for case in cases {
        let recall = check(&db, &input(24), &case);
        assert_eq!(recall.found, recall.wanted, "{}", case.name);
    }
}

/// An example has the mean of the two outputs of its cycle, or the only output if the database names one.
#[test]
fn one_output_a_cycle_and_two_agree() {
    let options = BuildOptions { pairing: Scheme::Spread, ..BuildOptions::default() };
    let blob = build(&motion::corpus(motion::SMALL), &options).unwrap().bytes;
    let alone = Database::open(&blob).unwrap();
    let db = Database::open(motion::small()).unwrap();
    assert_eq!((alone.outputs(), db.outputs()), (1, 2));
    let differ = |row: &usize| {
        let cycle = db.cycle_of(0, *row).expect("the rows of a class after its first cycle");
        let found: Vec<_> = db.counterparts(cycle, *row, 1).collect();
        assert_eq!(found.len(), 2);
        found[0] != found[1]
    };
    let last = db.class(0).rows - 1;
    assert!((last / 2..last).any(|row| differ(&row)), "both schemes choose the same");
    let one = Case::new("one output");
    for case in [one.clone(), Case { style: vec![(0, 1.0), (2, 3.0)], ..one }] {
        let recall = check(&alone, &input(40), &case);
        assert_eq!(recall.found, recall.wanted, "{}", case.name);
    }
}

#[test]
fn large_classes_agree_and_the_graph_finds_them() {
    let db = Database::open(motion::large()).unwrap();
    assert!(db.classes().all(|c| c.rows > 320), "the classes have to be too large to be searched whole");
    let cases = [
        Case::new("no label"),
        Case { style: vec![(0, 1.0), (2, 1.0)], masked: vec![2], ..Case::new("two styles, an arm masked") },
    ];
    for case in cases {
        let all_searched = !case.masked.is_empty();
        let recall = check(&db, &input(60), &case);
        assert_eq!(recall.unsearched == 0, all_searched, "{}: {}", case.name, recall.unsearched);
        let recall = recall.value();
        assert!(recall >= 0.985, "{}: recall {recall}", case.name);
    }
}

#[test]
fn dofs_and_queries_agree() {
    let db = Database::open(motion::small()).unwrap();
    let clip = motion::unseen(1, 0, 60);
    let mut trace = Trace::default();
    stream(&db, &clip, &Request::style(1), &mut trace).unwrap();
    let positions: Vec<_> = clip.frames.iter().map(|f| f.positions(&clip.skeleton)).collect();
    let c = db.counts();
    let heading = |t: usize| {
        let line = clip.frames[t].rotations[0] * Vector3::from(db.hips_line().map(f64::from));
        (-line.z).atan2(line.x)
    };
    let y = |angle: f64| UnitQuaternion::from_axis_angle(&Vector3::y_axis(), angle);
    for (t, frame) in trace.frames.iter().enumerate() {
        let window: Vec<_> =
            (0..c.window).map(|w| positions[(t + w + 1).saturating_sub(c.window)].clone()).collect();
        for (f, (&core, own)) in frame.query.iter().zip(reference::feature(&db, &window)).enumerate() {
            near(&format!("feature {f}"), "query", t, f64::from(core), own, 1e-5);
        }
        // The first frame has no velocity; the core takes one from the data.
        let Some(before) = t.checked_sub(1) else { continue };
        let rate = f64::from(db.rate_hz());
        let velocity = y(-heading(before)) * (clip.frames[t].root - clip.frames[before].root) * rate;
        let turned = (y(heading(t)) * y(heading(before)).inverse()).scaled_axis().y * rate;
        let tilt = mean(&db, 0).inverse() * y(-heading(t)) * clip.frames[t].rotations[0];
        let mut own = vec![clip.frames[t].root.y];
        own.extend(tilt.scaled_axis().iter());
        own.extend([velocity.z, velocity.x, turned]);
        for j in 1..c.joints {
            own.extend((mean(&db, j).inverse() * clip.frames[t].rotations[j]).scaled_axis().iter());
        }
        for (d, (&core, own)) in frame.x.iter().zip(own).enumerate() {
            near(&format!("dof {d}"), "dofs", t, f64::from(core), own, DOF);
        }
    }
}
