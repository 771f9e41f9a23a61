//! The mixture of local autoregressive models: the method of paper 000, one frame at a time.
//!
//! The window of poses becomes a search feature ([`crate::search::query`]); every class that the labels allow gives its
//! nearest frames ([`crate::search::graph`]) and a proportion ([`crate::methods::mixture::weights`]); the neighbors of the classes kept are
//! unpacked with their counterparts in the output style ([`crate::methods::mixture::examples`]) and fitted ([`crate::methods::mixture::regression`]);
//! what each class predicts is summed by its proportion, and so are the time step ([`crate::methods::mixture::step_time`]) and the
//! contacts ([`crate::methods::mixture::contact_votes`]).
//!
//! Cost: the searches (visits a class), then two to three rows unpacked a neighbor and one 4 × 4 solve a dof for
//! each class kept. `docs/PERFORMANCE.md` has the instructions by stage.

use heapless::Vec;

use crate::{
    Degraded, Observer, Pose, Report,
    blob::layout::dof,
    math::clamp,
    methods::{
        context::{Frame, Signals},
        mixture::{
            contact_votes::{self, Votes},
            examples,
            regression::{Examples, Parameters, ROOM},
            step_time::Steps,
            weights::{self, Share},
        },
    },
    observe::Stage,
    search::{
        graph::{Limits, MAX_VISITS, Metric, Searcher},
        query::{ALIGNED, Window},
    },
};

/// Most classes of a frame in which the classes are searched anew: what bounds the worst frame.
const CLASSES_ANEW: usize = 4;
/// Visits that a frame has to spare beyond those of its classes, for searches that are begun anew. With it a frame of C
/// classes takes at most `C · visits + SPARE`.
const SPARE: u16 = MAX_VISITS;
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

impl<const J: usize, const K: usize, const C: usize> Mar<J, K, C> {
    /// No frame seen yet. As a constant that is all zeros it is written where it goes, whatever the level of optimisation.
    pub const NEW: Self = Self {
        window: Window::new(),
        searcher: Searcher::new(),
        neighbors: [const { Vec::new() }; C],
        // Written before it is read.
        mean_distance2: [0.0; C],
        examples: Examples::new(),
        steps: Steps::new(),
    };

    /// The next frame stands for those before it.
    pub fn forget_window(&mut self) {
        self.window.clear();
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
    #[inline(never)]
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
        // The query is written where it stays: a place of its own would be on the stack to the end of the frame.
        let mut metric = Metric::NOTHING;
        // Nothing is left of the last frame's examples.
        const { assert!(ROOM >= ALIGNED) };
        self.window.feature(frame.database, self.examples.room(), metric.query());
        observer.query(metric.query());
        metric.weigh(frame.database, frame.settings.mask);
        self.search(frame, &metric, report, observer);
        if frame.first {
            self.settle(frame, &metric, signals, report, observer);
        }
        self.regress(frame, &metric, signals, report, observer);
    }

    /// Neighbors in every class that the labels allow, and their proportions.
    #[inline(never)]
    fn search(
        &mut self,
        frame: Frame<'_, '_>,
        metric: &Metric,
        report: &mut Report,
        observer: &mut impl Observer<J>,
    ) {
        observer.stage(Stage::Search);
        let Frame { database, config, settings, .. } = frame;
        let mut limits = Limits {
            k: usize::from(config.k),
            pool: usize::from(config.pool),
            visits: config.visits,
            spare: SPARE,
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
            // Never below 0: a search takes no more than its own visits and those to spare.
            let visits = u16::try_from(effort.visits).unwrap_or(u16::MAX);
            limits.spare = limits.spare.saturating_add(config.visits).saturating_sub(visits);
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
        let cut = weights::proportions(means, config.delta, config.prune, most, &mut report.classes);
        report.degraded.set(Degraded::CLASSES, cut);
        // Far classes are found anew all the time; that counts where it is heard.
        let jumped = report.classes.iter().any(|s| jumps.get(usize::from(s.class)).copied().unwrap_or(false));
        report.degraded.set(Degraded::JUMP, jumped);
        report.distance2 =
            report.classes.first().and_then(|s| means.get(usize::from(s.class))).copied().unwrap_or(0.0);
    }

    /// A first pose has no frame before it: what the nearest class's neighbors came from stands in for it.
    #[inline(never)]
    fn settle(
        &mut self,
        frame: Frame<'_, '_>,
        metric: &Metric,
        signals: &mut Signals<J>,
        report: &mut Report,
        observer: &mut impl Observer<J>,
    ) {
        // In their places: zeros of their own would be on the stack first.
        signals.x_prev.fill([0.0; 4]);
        signals.y_prev.fill([0.0; 4]);
        let Frame { database, settings, .. } = frame;
        let Some(&nearest) = report.classes.first() else { return };
        for mix in (0..=database.counts().groups).filter(|&mix| is_wanted(frame, mix)) {
            let mut none = Votes::default();
            report.bytes_read += self.gather(frame, metric, nearest, mix, signals, &mut none, observer);
            let inputs = signals.x_prev.as_flattened_mut().iter_mut().zip(signals.x.as_flattened_mut());
            let slots = inputs.zip(signals.y_prev.as_flattened_mut());
            for (d, ((x_prev, x), y_prev)) in slots.enumerate().take(database.counts().dofs) {
                if settings.mix_of(database.group_of_dof(d)) != mix {
                    continue;
                }
                let [mean_x_prev, mean_y_prev, mean_x] =
                    self.examples.means(d).map(|mean| mean * database.step(d));
                (*x_prev, *y_prev) = (mean_x_prev, mean_y_prev);
                if (dof::FORWARD..dof::JOINTS).contains(&d) {
                    *x = mean_x;
                }
            }
        }
    }

    /// Reads the neighbors of a class into the regression and the timing, their outputs in a mix of styles, and lets the
    /// nearest of them vote. Returns the bytes read.
    #[allow(clippy::too_many_arguments)]
    #[inline(never)]
    fn gather(
        &mut self,
        frame: Frame<'_, '_>,
        metric: &Metric,
        share: Share,
        mix: usize,
        signals: &Signals<J>,
        votes: &mut Votes,
        observer: &mut impl Observer<J>,
    ) -> u32 {
        let Frame { database, settings, .. } = frame;
        let class = usize::from(share.class);
        let first_row = database.class(class).first_row;
        let (x, x_prev) = (signals.x.as_flattened(), signals.x_prev.as_flattened());
        observer.stage(Stage::Contacts);
        let legs = database.legs();
        let mut asked = [contact_votes::Asked::NOTHING; 2];
        for (asked, leg) in asked.iter_mut().zip(legs.iter().flatten()).filter(|_| votes.asked > 0) {
            asked.ask(database, leg, x, x_prev);
        }
        observer.stage(Stage::Rest);
        let strength = clamp(settings.strength_of(database.joint_group(0)), 0.0, 1.0);
        let dofs = database.counts().dofs;
        let mix = settings.mix(mix);
        let heard = examples::heard(mix, database.counts().styles);
        let mut bytes = 0;
        self.steps.ask(database, x, x_prev);
        self.examples.clear();
        self.steps.clear();
        for (i, &row) in self.neighbors.get(class).into_iter().flatten().enumerate() {
            let row = first_row + usize::from(row);
            observer.stage(Stage::Decode);
            let example = self.examples.place().as_flattened_mut();
            let read = examples::read(database, class, row, mix, &heard, example);
            if i < votes.asked {
                observer.stage(Stage::Contacts);
                let distances = if legs.is_some() {
                    let [left, right] = &asked;
                    [left.distance2(example), right.distance2(example)]
                } else {
                    // A blob that names no legs: the whole body.
                    [metric.distance2(database.feature(row)); 2]
                };
                let label = contact_votes::label(database, row, read.stands, strength);
                votes.add(label, distances, share.proportion);
            }
            observer.stage(Stage::Timing);
            self.steps.add(example, read.step_s);
            observer.stage(Stage::Regression);
            self.examples.add(dofs);
            bytes += read.bytes;
        }
        observer.stage(Stage::Regression);
        self.examples.finish(dofs);
        bytes
    }

    /// What a class predicts of every dof, in one mix of styles, left in `output`; those of the groups that have it are
    /// added to the mixture's.
    fn answer(
        &mut self,
        frame: Frame<'_, '_>,
        share: Share,
        mix: usize,
        signals: &mut Signals<J>,
        parameters: &Parameters,
    ) {
        let Frame { database, settings, .. } = frame;
        let (x, x_prev, y_prev) =
            (signals.x.as_flattened(), signals.x_prev.as_flattened(), signals.y_prev.as_flattened());
        let inputs = x_prev.iter().zip(y_prev).zip(x);
        let corrections = signals.correction.as_flattened_mut();
        let sums = signals.predicted.as_flattened_mut().iter_mut().zip(corrections);
        let outputs = signals.output.as_flattened_mut().iter_mut().zip(sums);
        for (d, ((one, (all, correction)), ((&x_prev, &y_prev), &x))) in
            outputs.zip(inputs).enumerate().take(database.counts().dofs)
        {
            let (step, scale) = (database.step(d), database.scale(d));
            let answer = self.examples.predict(d, [x_prev, y_prev, x], step, scale, parameters);
            *one = answer.y;
            let group = database.group_of_dof(d);
            if settings.mix_of(group) == mix {
                *all += share.proportion * answer.y;
                if answer.correction != 0.0 {
                    *correction += share.proportion * settings.strength_of(group) * answer.correction;
                    signals.is_corrected = true;
                }
            }
        }
    }

    /// The mixture's prediction of every dof, of the time step and of the contacts.
    #[inline(never)]
    fn regress(
        &mut self,
        frame: Frame<'_, '_>,
        metric: &Metric,
        signals: &mut Signals<J>,
        report: &mut Report,
        observer: &mut impl Observer<J>,
    ) {
        let Frame { database, config, settings, .. } = frame;
        let lead = settings.mix_of(database.joint_group(0));
        let parameters = Parameters {
            lambda: config.lambda,
            ridge: config.ridge,
            feedback: config.feedback,
            output_kappa: config.output_kappa,
            kappa: config.kappa,
            rho: config.rho,
        };
        let mut votes = Votes::of(report.classes.len());
        let mut step_s = 0.0;
        signals.predicted.fill([0.0; 4]);
        for share in &report.classes {
            let class = usize::from(share.class);
            // The root's mix first: its answers stay until the time step and the votes are told.
            report.bytes_read += self.gather(frame, metric, *share, lead, signals, &mut votes, observer);
            self.answer(frame, *share, lead, signals, &parameters);
            observer.stage(Stage::Timing);
            let (y, y_prev) = (signals.output.as_flattened(), signals.y_prev.as_flattened());
            step_s += share.proportion * self.steps.predict(y, y_prev, config.timing_width);
            observer.stage(Stage::Rest);
            let rows = self.neighbors.get(class).map_or(&[][..], |rows| rows);
            observer.timed(class, rows, self.steps.weights());
            for mix in 0..=database.counts().groups {
                if mix == lead || !is_wanted(frame, mix) {
                    continue;
                }
                // Feet and time have been voted for.
                let mut none = Votes::default();
                report.bytes_read += self.gather(frame, metric, *share, mix, signals, &mut none, observer);
                self.answer(frame, *share, mix, signals, &parameters);
            }
        }
        report.contact_likelihood = votes.likelihood();
        if step_s > 0.0 {
            report.predicted_step_s = step_s;
        }
    }
}

/// Whether a joint group has that mix of styles.
fn is_wanted(frame: Frame<'_, '_>, mix: usize) -> bool {
    (0..frame.database.counts().groups).any(|group| frame.settings.mix_of(group) == mix)
}
