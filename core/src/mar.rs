//! The mixture of local autoregressive models: the method of paper 000, one frame at a time.
//!
//! The window of poses becomes a search feature ([`crate::query`]); every class that the labels allow gives its
//! nearest frames ([`crate::knn`]) and a proportion ([`crate::mixture`]); the neighbors of the classes kept are
//! unpacked with their counterparts in the output style ([`crate::examples`]) and fitted ([`crate::regress`]);
//! what each class predicts is summed by its proportion, and so are the time step ([`crate::timing`]) and the
//! contacts ([`crate::contact`]).
//!
//! Cost: the searches (visits a class), then two to three rows unpacked a neighbor and one 4 × 4 solve a dof for
//! each class kept. `docs/PERFORMANCE.md` has the instructions by stage.

use heapless::Vec;

use crate::{
    Config, Degraded, Observer, Pose, Report,
    blob::{Database, layout::dof},
    contact::{self, Votes},
    examples,
    knn::{Limits, Metric, Searcher},
    math::clamp,
    mixture::{self, Share},
    observe::Stage,
    query::{ALIGNED, Feature, Window},
    regress::{Examples, Parameters, ROOM},
    stylizer::{Settings, Signals},
    timing::Steps,
};

/// Most classes of a frame in which the classes are searched anew: what bounds the worst frame.
const CLASSES_ANEW: usize = 4;
/// Mean squared distance of a class that was not searched.
const NOT_SEARCHED: f32 = -1.0;

/// State of the method between frames, and its room to work in.
#[derive(Debug, Clone)]
pub(crate) struct Mar<const J: usize, const K: usize, const C: usize> {
    window: Window<J>,
    searcher: Searcher,
    /// Neighbors of each class in the last frame, nearest first.
    neighbors: [Vec<u16, K>; C],
    mean_distance2: [f32; C],
    examples: Examples<J>,
    steps: Steps<K>,
}

/// What stays the same through a frame.
#[derive(Clone, Copy)]
pub(crate) struct Frame<'a, 'db> {
    pub database: &'a Database<'db>,
    pub config: &'a Config,
    pub settings: &'a Settings,
    /// No frame before this one.
    pub first: bool,
}

impl<const J: usize, const K: usize, const C: usize> Mar<J, K, C> {
    /// No frame seen yet.
    // A function of its own is given the place to write to; inlined, 20 KB would be copied there.
    #[inline(never)]
    pub const fn new() -> Self {
        Self {
            window: Window::new(),
            searcher: Searcher::new(),
            neighbors: [const { Vec::new() }; C],
            mean_distance2: [NOT_SEARCHED; C],
            examples: Examples::new(),
            steps: Steps::new(),
        }
    }

    /// Forgets the stream.
    pub fn reset(&mut self) {
        self.window.clear();
        for neighbors in &mut self.neighbors {
            neighbors.clear();
        }
    }

    /// Predicts every dof, the time step and the contacts. `signals.x` is the input's; on a first frame the
    /// neighbors say what came before it.
    pub fn predict(
        &mut self,
        frame: Frame<'_, '_>,
        input: &Pose<J>,
        signals: &mut Signals<J>,
        report: &mut Report,
        observer: &mut impl Observer<J>,
    ) {
        observer.stage(Stage::Query);
        self.window.push(frame.database, input);
        let mut feature: Feature = [0.0; _];
        // Nothing is left of the last frame's examples.
        const { assert!(ROOM >= ALIGNED) };
        self.window.feature(frame.database, self.examples.room(), &mut feature);
        observer.query(&feature);
        let metric = Metric::new(frame.database, &feature, frame.settings.mask);
        self.search(frame, &metric, report, observer);
        if frame.first {
            self.settle(frame, &metric, signals, report, observer);
        }
        self.regress(frame, &metric, signals, report, observer);
    }

    /// Neighbors in every class that the labels allow, and their proportions.
    fn search(
        &mut self,
        frame: Frame<'_, '_>,
        metric: &Metric,
        report: &mut Report,
        observer: &mut impl Observer<J>,
    ) {
        observer.stage(Stage::Search);
        let Frame { database, config, settings, .. } = frame;
        let limits = Limits {
            k: usize::from(config.k),
            pool: usize::from(config.pool),
            visits: config.visits,
            jump: config.jump,
        };
        let classes = database.counts().classes;
        let mut jumps = [false; C];
        let slots = self.neighbors.iter_mut().zip(&mut self.mean_distance2).zip(&mut jumps);
        for (class, ((neighbors, mean), jumped)) in slots.enumerate().take(classes) {
            if !settings.allow(database.class(class)) {
                neighbors.clear();
                *mean = NOT_SEARCHED;
                continue;
            }
            let (found, effort) = self.searcher.search(database, class, metric, &limits, neighbors, *mean);
            neighbors.clear();
            let mut sum = 0.0;
            for neighbor in found {
                // `found` holds at most k, which is at most K.
                let _ = neighbors.push(neighbor.row);
                sum += neighbor.distance2;
            }
            *mean = sum / found.len().max(1) as f32;
            report.visits += effort.visits;
            report.bytes_read += effort.bytes;
            report.degraded.set(Degraded::VISITS, effort.capped);
            *jumped = effort.restarted;
            observer.searched(class, found, *mean);
        }
        observer.stage(Stage::Rest);
        let (most, means) = (usize::from(config.classes), self.mean_distance2.get(..classes).unwrap_or(&[]));
        // A stream that begins or has jumped searches twice as long, and its classes hardly differ yet.
        let anew = 2 * jumps.iter().filter(|j| **j).count() > classes || frame.first;
        let most = if anew { most.min(CLASSES_ANEW) } else { most };
        let cut = mixture::proportions(means, config.delta, config.prune, most, &mut report.classes);
        report.degraded.set(Degraded::CLASSES, cut);
        // Far classes are found anew all the time; that counts where it is heard.
        let jumped = report.classes.iter().any(|s| jumps.get(usize::from(s.class)).copied().unwrap_or(false));
        report.degraded.set(Degraded::JUMP, jumped);
        report.distance2 =
            report.classes.first().and_then(|s| means.get(usize::from(s.class))).copied().unwrap_or(0.0);
    }

    /// A first pose has no frame before it: what the nearest class's neighbors came from stands in for it.
    fn settle(
        &mut self,
        frame: Frame<'_, '_>,
        metric: &Metric,
        signals: &mut Signals<J>,
        report: &mut Report,
        observer: &mut impl Observer<J>,
    ) {
        (signals.x_prev, signals.y_prev) = ([[0.0; 4]; J], [[0.0; 4]; J]);
        let Some(&nearest) = report.classes.first() else { return };
        report.bytes_read += self.gather(frame, metric, nearest, signals, &mut Votes::default(), observer);
        let inputs = signals.x_prev.as_flattened_mut().iter_mut().zip(signals.x.as_flattened_mut());
        let slots = inputs.zip(signals.y_prev.as_flattened_mut());
        for (d, ((x_prev, x), y_prev)) in slots.enumerate().take(frame.database.counts().dofs) {
            let [mean_x_prev, mean_y_prev, mean_x] =
                self.examples.means(d).map(|mean| mean * frame.database.step(d));
            (*x_prev, *y_prev) = (mean_x_prev, mean_y_prev);
            if (dof::FORWARD..dof::JOINTS).contains(&d) {
                *x = mean_x;
            }
        }
    }

    /// Reads the neighbors of a class into the regression and the timing, and lets them vote. Returns the bytes read.
    fn gather(
        &mut self,
        frame: Frame<'_, '_>,
        metric: &Metric,
        share: Share,
        signals: &Signals<J>,
        votes: &mut Votes,
        observer: &mut impl Observer<J>,
    ) -> u32 {
        let Frame { database, settings, .. } = frame;
        let class = usize::from(share.class);
        let first_row = database.class(class).first_row;
        let legs = database.legs();
        let strength = clamp(settings.strength_of(database.joint_group(0)), 0.0, 1.0);
        let dofs = database.counts().dofs;
        let mut bytes = 0;
        self.steps.ask(database, signals.x.as_flattened(), signals.x_prev.as_flattened());
        self.examples.clear();
        self.steps.clear();
        for &row in self.neighbors.get(class).into_iter().flatten() {
            let row = first_row + usize::from(row);
            observer.stage(Stage::Decode);
            let example = self.examples.place();
            let read = examples::read(database, class, row, &settings.styles, example);
            let leg_distances = match &legs {
                Some(legs) => {
                    let (x, x_prev) = (signals.x.as_flattened(), signals.x_prev.as_flattened());
                    let variables: &[[f32; 4]] = example.as_flattened();
                    legs.map(|leg| contact::distance2(database, &leg, x, x_prev, variables))
                }
                // A blob that names no legs: the whole body.
                None => [metric.distance2(database.feature(row)); 2],
            };
            observer.stage(Stage::Timing);
            self.steps.add(example, read.step_s);
            observer.stage(Stage::Regression);
            self.examples.add(dofs);
            bytes += read.bytes;
            observer.stage(Stage::Rest);
            let (input, output) = (contact::of(database, row), read.stands.0);
            let label = [0, 1].map(|i: usize| {
                let of = |label: [f32; 2]| label.get(i).copied().unwrap_or(0.0);
                of(input) + strength * (of(output) - of(input))
            });
            votes.add(label, leg_distances, share.proportion);
        }
        observer.stage(Stage::Regression);
        self.examples.finish(dofs);
        bytes
    }

    /// The mixture's prediction of every dof, of the time step and of the contacts.
    fn regress(
        &mut self,
        frame: Frame<'_, '_>,
        metric: &Metric,
        signals: &mut Signals<J>,
        report: &mut Report,
        observer: &mut impl Observer<J>,
    ) {
        let Frame { database, config, .. } = frame;
        let parameters = Parameters {
            lambda: config.lambda,
            ridge: config.ridge,
            feedback: config.feedback,
            kappa: config.kappa,
            rho: config.rho,
        };
        let mut votes = Votes::default();
        let mut step_s = 0.0;
        signals.predicted = [[0.0; 4]; J];
        for share in &report.classes {
            let class = usize::from(share.class);
            report.bytes_read += self.gather(frame, metric, *share, signals, &mut votes, observer);
            let (x, x_prev, y_prev) =
                (signals.x.as_flattened(), signals.x_prev.as_flattened(), signals.y_prev.as_flattened());
            let inputs = x_prev.iter().zip(y_prev).zip(x);
            let outputs =
                signals.output.as_flattened_mut().iter_mut().zip(signals.predicted.as_flattened_mut());
            for (d, ((one, all), ((&x_prev, &y_prev), &x))) in
                outputs.zip(inputs).enumerate().take(database.counts().dofs)
            {
                let (step, scale) = (database.step(d), database.scale(d));
                *one = self.examples.predict(d, [x_prev, y_prev, x], step, scale, &parameters);
                *all += share.proportion * *one;
            }
            observer.stage(Stage::Timing);
            let (y, y_prev) = (signals.output.as_flattened(), signals.y_prev.as_flattened());
            step_s += share.proportion * self.steps.predict(y, y_prev, config.timing_width);
            observer.stage(Stage::Rest);
            let rows = self.neighbors.get(class).map_or(&[][..], |rows| rows);
            observer.timed(class, rows, self.steps.weights());
        }
        report.contact_likelihood = votes.likelihood();
        if step_s > 0.0 {
            report.predicted_step_s = step_s;
        }
    }
}
