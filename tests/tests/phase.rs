//! Phase tables: every frame against the equations in `f64`, and the method's documented behaviour.

use std::sync::OnceLock;

use gestus_core::{
    Config, ConfigError, Database, Method, Stylizer,
    blob::{
        PhaseTables,
        layout::{dof, phase, section},
    },
};
use gestus_database::{
    blob::cut::models_only,
    build::{BuildOptions, build},
    stream::{Request, Streamed, from_pose, stream, to_pose},
};
use gestus_motion::{
    clip::Clip,
    corpus::{Corpus, Cycle, Example},
};
use gestus_tests::{
    motion,
    patch::{patched, section as section_of},
    trace::{Frame, Trace},
};
use nalgebra::{UnitQuaternion, Vector3};

// The foot lock is off, so that the predictions are compared.
const PHASE: Config = Config::new().method(Method::Phase).contacts(false).trust(0.0).still_speed(0.0);

fn run(blob: &[u8], request: &Request, clip: &Clip) -> (Trace, Streamed) {
    let database = Database::open(blob).unwrap();
    let mut trace = Trace::default();
    let streamed = stream(&database, clip, request, &mut trace).unwrap();
    (trace, streamed)
}

fn request(style: u16) -> Request {
    Request { config: PHASE, ..Request::style(style) }
}

/// The method in `f64`, by its equations: it examines every segment of every class, and each dof separately.
struct Reference<'db> {
    database: Database<'db>,
    tables: Vec<PhaseTables<'db>>,
    /// Phase, rate and distance of each class.
    tracks: Vec<[f64; 3]>,
    drift: [f64; 2],
    frames: usize,
    /// Last step of each dof's change of the input; height and speeds have none.
    steps: Vec<f64>,
    /// 1 where the body has jumped, then falls to 0 within 0.3 s.
    jump: f64,
    /// The features that are not masked.
    used: Vec<bool>,
}

impl<'db> Reference<'db> {
    fn new(database: Database<'db>) -> Self {
        let tables: Vec<PhaseTables<'_>> =
            (0..database.counts().classes).map(|c| database.phase_tables(c)).collect();
        let used = vec![true; database.counts().features];
        let (tracks, steps) = (vec![[0.0; 3]; tables.len()], vec![0.0; database.counts().dofs]);
        Self { database, tracks, tables, drift: [0.0; 2], frames: 0, steps, jump: 0.0, used }
    }

    fn whitened(&self, query: &[f32]) -> Vec<f64> {
        let mut matrix = self.database.whitening();
        let mut white = Vec::new();
        for count in self.database.features_by_group() {
            let first = white.len();
            for _ in 0..count {
                let own = &query[first..first + count];
                white.push(own.iter().map(|&v| f64::from(matrix.next().unwrap()) * f64::from(v)).sum());
            }
        }
        white
    }

    /// Phase and squared distance of the nearest point of the polyline. In a whole clip that is near the `led` phase, unless
    /// another knot is nearer by 48, which the last value tells.
    fn project(&self, tables: &PhaseTables<'_>, white: &[f64], led: Option<f64>) -> (f64, f64, bool) {
        let step = f64::from(self.database.phase_step());
        let knot = |k: usize| {
            let codes = tables.knot(k).0.iter().zip(&self.used).filter(|(_, used)| **used);
            codes.map(move |(&b, _)| step * f64::from(b as i8))
        };
        let white: Vec<f64> =
            white.iter().zip(&self.used).filter(|(_, used)| **used).map(|(v, _)| *v).collect();
        let share = white.len() as f64 / self.used.len() as f64;
        let count = tables.feature_knots;
        let segments = if tables.is_cyclic { count } else { count - 1 };
        let (mut among, mut elsewhere) = (0..segments, false);
        if let Some(led) = led.filter(|_| !tables.is_cyclic) {
            let distance2 = |k: usize| knot(k).zip(&white).map(|(a, q)| (q - a).powi(2)).sum::<f64>() / share;
            let frames = f64::from(tables.seconds[0] + tables.seconds[1]) * motion::RATE_HZ;
            let near = (3.0 * segments as f64 / frames).clamp(2.0, 8.0) as usize;
            let middle = (led.clamp(0.0, 1.0) * segments as f64).round() as usize;
            let nearest = |knots: std::ops::Range<usize>| {
                knots.min_by(|&a, &b| distance2(a).total_cmp(&distance2(b))).unwrap()
            };
            let expected = nearest(middle.saturating_sub(near)..(middle + near + 1).min(count));
            elsewhere = distance2(expected) - distance2(nearest(0..count)) >= 48.0;
            if !elsewhere {
                among = expected.saturating_sub(1)..(expected + 1).min(segments);
            }
        }
        let mut best = (0.0, f64::INFINITY);
        for k in among {
            let (a, b): (Vec<f64>, Vec<f64>) = knot(k).zip(knot((k + 1) % count)).unzip();
            let way: f64 = a.iter().zip(&b).map(|(a, b)| (b - a).powi(2)).sum();
            let along: f64 = a.iter().zip(&b).zip(&white).map(|((a, b), q)| (q - a) * (b - a)).sum();
            let t = (along / way.max(1e-12)).clamp(0.0, 1.0);
            let distance2 =
                a.iter().zip(&b).zip(&white).map(|((a, b), q)| (q - a - t * (b - a)).powi(2)).sum();
            if distance2 < best.1 {
                best = ((k as f64 + t) / segments as f64, distance2);
            }
        }
        (best.0, best.1 / share, elsewhere)
    }

    /// A table of codes at a phase: a Catmull-Rom spline through its knots.
    fn spline(tables: &PhaseTables<'_>, phase: f64, count: usize, code: impl Fn(usize) -> u8) -> f64 {
        let at = phase * if tables.is_cyclic { count } else { count - 1 } as f64;
        let start = at.floor();
        let t = at - start;
        let p: Vec<f64> = (-1..3)
            .map(|k| {
                let knot = start as i64 + k;
                let knot = if tables.is_cyclic {
                    knot.rem_euclid(count as i64)
                } else {
                    knot.clamp(0, count as i64 - 1)
                };
                f64::from(code(knot as usize) as i8)
            })
            .collect();
        p[1] + 0.5
            * t
            * (p[2] - p[0]
                + t * (2.0 * p[0] - 5.0 * p[1] + 4.0 * p[2] - p[3] + t * (3.0 * (p[1] - p[2]) + p[3] - p[0])))
    }

    /// A dof of a class's input or output table, with half of the slopes.
    fn value(&self, class: usize, at: usize, d: usize, phase: f64, off: [f64; 2]) -> f64 {
        let (tables, dofs) = (&self.tables[class], self.database.counts().dofs);
        let scale = self.database.phase_dofs().nth(d).unwrap();
        let code = Self::spline(tables, phase, tables.dof_knots, |k| tables.row(at, dofs, k)[d]);
        let slope = |side: usize| {
            let rows = |k: usize| tables.row(tables.parts().slopes, 2 * dofs, k)[2 * d + side];
            0.5 * f64::from(scale.step * self.database.slope_steps()[side])
                * off[side]
                * Self::spline(tables, phase, tables.slope_knots, rows)
        };
        f64::from(scale.centre) + f64::from(scale.step) * code + slope(0) + slope(1)
    }

    /// The prediction of a frame of a class that is known, in one other style.
    fn step(&mut self, frame: &Frame, class: usize, output: usize) -> Vec<f64> {
        let white = self.whitened(&frame.query);
        let tables = self.tables[class];
        let window = self.database.counts().window;
        let led = (self.frames >= window).then(|| self.tracks[class][0] + self.tracks[class][1]);
        let (found, distance2, elsewhere) = self.project(&tables, &white, led);
        let rate = 1.0 / (f64::from(tables.seconds[0] + tables.seconds[1]) * motion::RATE_HZ);
        // Whether it is elsewhere in its cycle.
        let mut exchanged = false;
        let track = &mut self.tracks[class];
        if self.frames < window {
            *track = [found, rate, distance2];
        } else {
            let distance2 = distance2.min(4.0 * (track[2] + 12.0));
            track[2] += (1.0 / (self.frames + 2 - window) as f64).max(0.2) * (distance2 - track[2]);
            let led = track[0] + track[1];
            let mut off = found - led;
            if tables.is_cyclic {
                off -= off.round();
            }
            if off.abs() > 0.15 {
                track[0] = found;
                exchanged = tables.is_cyclic && off.abs() > 0.25;
            } else {
                let led = led + 0.5 * off;
                track[0] = if tables.is_cyclic { led.rem_euclid(1.0) } else { led.clamp(0.0, 1.0) };
                track[1] = (track[1] + 0.05 * off).clamp(0.0, 2.4 / motion::RATE_HZ);
            }
        }
        let speeds = [dof::FORWARD, dof::YAW].map(|d| f64::from(frame.x[d]));
        if self.frames == 0 {
            self.drift = tables.drift.map(f64::from);
        }
        let taken = (1.0 - 0.5_f64.powf(1.0 / (0.25 * motion::RATE_HZ))).max(1.0 / self.frames.max(1) as f64);
        for (mean, speed) in self.drift.iter_mut().zip(speeds) {
            *mean += taken * (speed - *mean);
        }
        self.frames += 1;
        let phase = self.tracks[class][0];
        let off = [0, 1].map(|k| self.drift[k] - f64::from(tables.drift[k]));
        let walks = f64::from(tables.drift[0]);
        let stands = if walks > 0.3 { 1.0 - (2.0 * self.drift[0].abs() / walks).min(1.0) } else { 0.0 };
        let dofs = self.database.counts().dofs;
        // A first frame has nothing to settle from.
        let first = self.frames == 1;
        let now = if first || elsewhere { 1.0 } else { 0.5 * f64::from(u8::from(exchanged)) };
        // The core rounds the query.
        let (ratio, rounded) =
            (self.tracks[class][2] / (2.0 * f64::from(tables.far)), frame.report.distance_ratio);
        assert!((f64::from(rounded) - ratio).abs() < 0.01 * ratio.max(1.0), "{ratio}: {rounded}");
        let now = (f64::from(rounded) - 2.0).clamp(now, 1.0);
        self.jump = (self.jump - 1.0 / (0.3 * motion::RATE_HZ)).max(now);
        let (ratio, second) = if tables.is_cyclic { (0.25, 0.0) } else { (1.0, 0.5) };
        let time = 0.5 * f64::from(PHASE.settle_s) * (ratio + 1.5 * self.jump);
        let [a, b] = [1.0 - second, second].map(|part| (-1.0 / (motion::RATE_HZ * part * time)).exp());
        (0..dofs)
            .map(|d| {
                let x = f64::from(frame.x[d]);
                let own = x - self.value(class, tables.parts().input, d, phase, off);
                let spread = f64::from(self.database.phase_dofs().nth(d).unwrap().step)
                    * f64::from(tables.spread()[d]);
                let root = self.database.joint_group(0);
                let beyond = if self.database.group_of_dof(d) == root {
                    0.0
                } else {
                    own - own.clamp(-3.0 * spread, 3.0 * spread)
                };
                let kept = beyond + f64::from(tables.gain) * (own - beyond);
                let y = kept + self.value(output, self.tables[output].parts().output, d, phase, off);
                let mut y = y;
                if !first {
                    let before = f64::from(frame.y_prev[d] - frame.x_prev[d]);
                    y += (a + b - a * b) * (x + before - y) + a * b * self.steps[d];
                    if ![dof::HEIGHT, dof::FORWARD, dof::LEFT, dof::YAW].contains(&d) {
                        self.steps[d] = y - x - before;
                    }
                }
                let passed = if d == dof::FORWARD || d == dof::LEFT { stands } else { 0.0 };
                y + passed * (x - y)
            })
            .collect()
    }
}

fn class_of(database: &Database<'_>, action: u16, style: u16) -> usize {
    database.classes().position(|c| (c.action, c.style) == (action, style)).unwrap()
}

/// A whole clip of an arm that waves five to seven times; takes differ in tempo, height and posture.
fn wave(style: usize, take: usize) -> Example {
    let base = motion::example(0, style, take, 2);
    let times = 5.0 + (take % 3) as f64;
    let take = take as f64;
    let count = 132 + (17.0 * (1.7 * take).sin()) as usize - 20 * style;
    let height = [1.0, 0.6, 1.4][style] + 0.1 * (2.3 * take).sin();
    let frames: Vec<_> = (0..count)
        .map(|t| {
            let at = t as f64 / (count - 1) as f64;
            // Up in the first sixth, down in the last.
            let up = (6.0 * at).min(6.0 * (1.0 - at)).min(1.0);
            let waved = 0.35 * up * (std::f64::consts::TAU * times * at + 0.2 * (3.1 * take).sin()).sin();
            let mut frame = base.clip.frames[0].clone();
            frame.root = Vector3::new(0.0, frame.root.y, 0.0);
            let turn = |x: f64, z: f64| UnitQuaternion::from_scaled_axis(Vector3::new(x, 0.0, z));
            frame.rotations[6] = turn(-height * up, -1.2 + 0.9 * up);
            frame.rotations[7] = turn(-0.4 * up, waved);
            frame
        })
        .collect();
    let cycles = vec![Cycle { knots: vec![0.0, (count - 1) as f64] }];
    let contacts = vec![[true; 2]; count];
    Example { clip: Clip { frames, ..base.clip.clone() }, cycles, contacts, ..base }
}

/// A database of four takes of it in every style.
fn waves() -> &'static [u8] {
    static BLOB: OnceLock<Vec<u8>> = OnceLock::new();
    BLOB.get_or_init(|| {
        let corpus = motion::corpus(motion::TINY);
        let styles = motion::STYLES.map(String::from).to_vec();
        let examples = (0..3).flat_map(|style| (0..4).map(move |take| wave(style, take))).collect();
        let corpus = Corpus { actions: vec!["wave".to_owned()], styles, examples, ..corpus };
        build(&corpus, &BuildOptions::default()).unwrap().bytes
    })
}

#[test]
fn repeated_motion_in_a_whole_clip_is_followed_without_jumps() {
    let database = Database::open(waves()).unwrap();
    let third = |clip: &[gestus_motion::clip::Frame]| {
        let angles: Vec<f64> = clip.iter().map(|f| f.rotations[7].angle()).collect();
        let bends = angles.windows(4).map(|w| (w[3] - 3.0 * (w[2] - w[1]) - w[0]).abs());
        bends.sum::<f64>() / (angles.len() - 3) as f64
    };
    for take in [5, 6, 7] {
        let clip = wave(0, take).clip;
        for style in [1, 2] {
            let real = third(&wave(usize::from(style), take).clip.frames);
            let streamed = run(waves(), &request(style), &clip).1;
            let output: Vec<_> = streamed.steps.iter().skip(8).map(|step| step.frame.clone()).collect();
            println!("take {take}, style {style}: third difference {:.2} of real", third(&output) / real);
            assert!(third(&output) < 1.3 * real, "{take} {style}: {} {real}", third(&output));
        }
    }
    assert!(!database.is_gait(0));
}

#[test]
fn a_labelled_stream_is_that_of_the_equations() {
    let database = Database::open(motion::small()).unwrap();
    let arms: Vec<u8> = (1..database.counts().groups as u8).collect();
    let walk =
        |action, style, masked| (motion::small(), motion::unseen(action, 0, 150), action, style, masked);
    for (blob, clip, action, style, masked) in [
        walk(0, 1, &[][..]),
        walk(0, 2, &[]),
        walk(1, 2, &[]),
        walk(0, 2, &arms),
        (waves(), wave(0, 6).clip, 0, 1, &[]),
    ] {
        let (database, action) = (Database::open(blob).unwrap(), action as u16);
        let labelled = Request {
            action: Some(action),
            input_style: Some(0),
            masked: masked.iter().map(|&group| u16::from(group)).collect(),
            ..request(style)
        };
        let (trace, _) = run(blob, &labelled, &clip);
        let mut reference = Reference::new(database);
        for (f, used) in reference.used.iter_mut().enumerate() {
            *used = !masked.contains(&(database.feature_group(f) as u8));
        }
        assert_eq!(masked.is_empty(), reference.used.iter().all(|used| *used));
        let (class, output) = (class_of(&database, action, 0), class_of(&database, action, style));
        let (mut worst, mut sum, mut count) = (0.0_f64, 0.0, 0.0);
        for frame in &trace.frames {
            let truth = reference.step(frame, class, output);
            for (d, truth) in truth.iter().enumerate().filter(|(d, _)| *d != dof::YAW) {
                let off = (f64::from(frame.predicted[d]) - truth).abs();
                (worst, sum, count) = (worst.max(off), sum + off, count + 1.0);
            }
        }
        // The query is rounded to an eighth of a step, a weight of a knot to 1/4096, a kept step to 1/8192. A spring that
        // forgets its velocity is 0.004 off.
        assert!(worst < 2e-3 && sum / count < 1e-4, "{action} {style}: {worst} {}", sum / count);
    }
}

#[test]
fn an_unlabelled_input_is_recognised_and_takes_the_style() {
    let database = Database::open(motion::small()).unwrap();
    for action in 0..2 {
        let clip = motion::unseen(usize::from(action), 0, 150);
        let known = Request { action: Some(action), input_style: Some(0), ..request(2) };
        let (labelled, _) = run(motion::small(), &known, &clip);
        let (trace, _) = run(motion::small(), &request(2), &clip);
        let class = class_of(&database, action, 0) as u16;
        let share = |trace: &Trace| {
            let of_frame = |f: &Frame| {
                f.report.classes.iter().filter(|s| s.class == class).map(|s| s.proportion).sum::<f32>()
            };
            trace.frames[20..].iter().map(of_frame).sum::<f32>() / (trace.frames.len() - 20) as f32
        };
        let mixture = Request { config: Config::new().contacts(false), ..Request::style(2) };
        let (found, by_frames) = (share(&trace), share(&run(motion::small(), &mixture, &clip).0));
        assert!(found > 0.6 && found > by_frames, "action {action}: {found}, the mixture {by_frames}");
        let (mut off, mut moved) = (0.0, 0.0);
        for (frame, known) in trace.frames[20..].iter().zip(&labelled.frames[20..]) {
            for d in (0..frame.x.len()).filter(|d| *d != dof::YAW) {
                off += (frame.predicted[d] - known.predicted[d]).abs();
                moved += (known.predicted[d] - frame.x[d]).abs();
            }
        }
        assert!(off < 0.3 * moved, "action {action}: {off} of {moved}");
    }
}

#[test]
fn the_own_style_is_the_input_and_half_a_style_is_half_of_it() {
    let clip = motion::unseen(0, 0, 90);
    let labelled = |style: &[(u16, f32)]| Request {
        action: Some(0),
        input_style: Some(0),
        style: style.to_vec(),
        ..request(0)
    };
    let own = run(motion::small(), &labelled(&[(0, 1.0)]), &clip).0;
    let whole = run(motion::small(), &labelled(&[(2, 1.0)]), &clip).0;
    let half = run(motion::small(), &labelled(&[(0, 0.5), (2, 0.5)]), &clip).0;
    for (t, frame) in own.frames.iter().enumerate() {
        for d in (0..frame.x.len()).filter(|d| *d != dof::YAW) {
            let (x, y) = (frame.x[d], whole.frames[t].predicted[d]);
            assert!((frame.predicted[d] - x).abs() < 1e-4, "frame {t}, dof {d}");
            let mean = 0.5 * (x + y);
            assert!((half.frames[t].predicted[d] - mean).abs() < 1e-4, "frame {t}, dof {d}");
        }
    }
}

#[test]
fn a_group_takes_its_own_style() {
    let database = Database::open(motion::small()).unwrap();
    let clip = motion::unseen(0, 0, 60);
    let labelled = |style| Request { action: Some(0), input_style: Some(0), ..request(style) };
    let body = run(motion::small(), &labelled(1), &clip).0;
    let arms = run(motion::small(), &labelled(2), &clip).0;
    let group = database.groups().find(|g| *g != database.joint_group(0)).unwrap();
    let mut both = labelled(1);
    both.group_styles = vec![(group as u16, vec![(2, 1.0)])];
    let mixed = run(motion::small(), &both, &clip).0;
    for (t, frame) in mixed.frames.iter().enumerate() {
        for d in (0..frame.x.len()).filter(|d| *d != dof::YAW) {
            let from = if database.group_of_dof(d) == group { &arms } else { &body };
            assert_eq!(frame.predicted[d], from.frames[t].predicted[d], "frame {t}, dof {d}");
        }
    }
}

#[test]
fn a_body_that_stands_goes_nowhere() {
    let walk = motion::unseen(0, 0, 60);
    let mut clip = walk.clone();
    // The walk stops where it is, and stays for three seconds.
    let last = clip.frames[59].clone();
    clip.frames.extend(std::iter::repeat_n(last, 90));
    let (trace, streamed) = run(motion::small(), &request(1), &clip);
    let place = |t: usize| streamed.steps[t].frame.root;
    let speed = |t: usize| (place(t) - place(t - 1)).norm() * motion::RATE_HZ;
    assert!(speed(40) > 0.3, "it walks at first: {}", speed(40));
    for t in 110..150 {
        assert!(speed(t) < 0.02, "frame {t}: {} m/s", speed(t));
        let still = &trace.frames[t];
        assert!(still.predicted.iter().all(|v| v.is_finite()));
    }
}

#[test]
fn a_blob_of_models_alone_gives_the_same_bits() {
    let whole = motion::small();
    let cut = models_only(&Database::open(whole).unwrap()).unwrap();
    let database = Database::open(&cut).unwrap();
    let counts = database.counts();
    assert_eq!((counts.frames, counts.classes), (0, 6));
    assert!(Method::Phase.is_available_in(&database));
    let clip = motion::unseen(1, 0, 60);
    for request in [request(1), Request { action: Some(1), input_style: Some(0), ..request(2) }] {
        assert_eq!(run(&cut, &request, &clip).1.digest, run(whole, &request, &clip).1.digest);
    }
    // Labels still have to name a class, and a mask must not cover all groups.
    let mut stylizer = Box::new(Stylizer::<22, 40, 28>::new(database, PHASE).unwrap());
    assert_eq!(stylizer.set_action(Some(1)), Ok(()));
    assert!(matches!(stylizer.set_action(Some(9)), Err(ConfigError::Unknown { .. })));
    let small = Stylizer::<22, 40, 4>::new(database, PHASE).err();
    assert_eq!(small, Some(ConfigError::Classes { need: 6, have: 4 }));
    assert_eq!(models_only(&database).unwrap(), cut);
}

#[test]
fn a_leap_and_a_reset_restart_the_method() {
    let database = Database::open(motion::small()).unwrap();
    let clip = motion::unseen(0, 0, 60);
    let mut stylizer = Box::new(Stylizer::<22, 40, 28>::new(database, PHASE).unwrap());
    let mut run = || {
        let mut output = gestus_core::Pose::IDENTITY;
        let mut poses = Vec::new();
        for frame in &clip.frames {
            let _ = stylizer.step(&to_pose(frame), &mut output);
            poses.push(output);
        }
        stylizer.reset();
        poses
    };
    let first = run();
    assert_eq!(first, run());
    assert!(from_pose(&first[59], 21).root.iter().all(|v| v.is_finite()));
}

#[test]
fn damaged_tables_do_not_open() {
    let blob = motion::small();
    let at = section_of(blob, section::PHASE);
    let database = Database::open(blob).unwrap();
    let classes = database.counts().classes;
    let records = (at.end - at.start)
        - {
            let mut bytes = 0;
            for class in 0..classes {
                bytes += database.phase_tables(class).parts().end;
            }
            bytes
        }
        - classes * phase::tables::LENGTH;
    let field = |range: std::ops::Range<usize>| records + range.start;
    let damaged: [(usize, &[u8]); 9] = [
        (phase::STEP.start, &0_f32.to_le_bytes()),
        (phase::RESERVED.start, &[1]),
        (phase::HEADER, &f32::NAN.to_le_bytes()),
        (field(phase::tables::OFFSET), &1_u32.to_le_bytes()),
        (field(phase::tables::FEATURE_KNOTS), &1_u16.to_le_bytes()),
        (field(phase::tables::DOF_KNOTS), &65_u16.to_le_bytes()),
        (records + phase::tables::CYCLIC, &[2]),
        (field(phase::tables::SECONDS), &0_f32.to_le_bytes()),
        // The length of the first segment of the first class.
        (records + classes * phase::tables::LENGTH, &7_u32.to_le_bytes()),
    ];
    for (i, (offset, value)) in damaged.into_iter().enumerate() {
        assert!(Database::open(&patched(blob, section::PHASE, offset, value)).is_err(), "damage {i}");
    }
}
