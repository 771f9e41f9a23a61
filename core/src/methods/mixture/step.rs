//! One frame of the mixture of local autoregressive models (Xia 2015, section 5).
//!
//! 1. The window of poses becomes a search feature ([`crate::search::query`]).
//! 2. The nearest frames of every class that the labels allow are found ([`crate::search::graph`]), and each class gets a
//!    proportion ([`crate::methods::weights`]).
//! 3. For each class kept, the neighbors are unpacked with their counterparts in the output style ([`super::examples`]) and
//!    fitted ([`super::regression`]).
//! 4. The predictions of the classes are summed by their proportions, as are the time step ([`super::step_time`]) and the
//!    contacts ([`super::contact_votes`]).
//!
//! Cost: the searches (visits a class); for each class kept, two rows a neighbor and two to four for each of its
//! outputs, and a solve of three unknowns a dof. `docs/PERFORMANCE.md` has the instructions by stage.

use heapless::Vec;

use super::{
    candidates::ClassDistances,
    contact_votes::{self, Votes},
    examples,
    places::{self, Places},
    regression::{Parameters, Regression},
    settle::{Settled, output_rho},
    step_time::Steps,
    sums::{Examples, Scratch},
    work::{self, SPARE},
};
use crate::{
    Config, Database, Degraded, Observer, Report,
    blob::layout::dof,
    math::clamp,
    methods::{
        context::{Context, Frame, Needs, Translate},
        settling::Spring,
        weights::{self, Share, Width},
        work::{Load, Work},
    },
    observe::Stage,
    search::{
        graph::{Limits, Searcher},
        metric::Metric,
        query::{Feature, Window},
    },
};

/// State of the method between frames, and its scratch memory.
#[derive(Debug, Clone)]
pub(crate) struct Mixture<const J: usize, const K: usize, const C: usize> {
    window: Window<J>,
    searcher: Searcher,
    /// Neighbors of each class in the last frame, nearest first.
    neighbors: [Vec<u16, K>; C],
    class_distances: ClassDistances<C>,
    places: Places<C>,
    /// The rows of the class at hand that its examples are read from, nearest first.
    rows: Vec<u16, K>,
    examples: Examples<J>,
    /// The aligned window while the query is made, afterwards the batch of examples.
    scratch: Scratch<J>,
    steps: Steps<K>,
    settled: Settled<J>,
}

impl<const J: usize, const K: usize, const C: usize> Translate<J> for Mixture<J, K, C> {
    const NEW: Self = Self {
        window: Window::new(),
        searcher: Searcher::new(),
        neighbors: [const { Vec::new() }; C],
        class_distances: ClassDistances::NEW,
        places: Places::NEW,
        rows: Vec::new(),
        examples: Examples::new(),
        scratch: Scratch::NEW,
        steps: Steps::new(),
        settled: Settled::NEW,
    };
    // Frames are selected by their labels; each joint group has a regression of its own.
    const NEEDS: Needs = Needs { labelled_class: true, whole_body: false };

    fn worst_step(database: &Database<'_>, config: &Config, load: &Load) -> Work {
        work::worst_step(database, config, load)
    }

    #[inline(never)]
    fn predict(&mut self, context: &mut Context<'_, '_, J, impl Observer<J>>) {
        let frame = context.frame;
        context.observer.stage(Stage::Query);
        self.window.push(frame.database, context.input);
        let metric = self.metric(context);
        self.search(context, &metric);
        if frame.first {
            self.init_history(context, &metric);
        }
        self.regress(context, &metric);
    }

    fn forget_window(&mut self) {
        self.window.clear();
        self.class_distances.restart_warmup();
        self.places.retain(&[]);
    }

    fn reset(&mut self) {
        self.window.clear();
        for neighbors in &mut self.neighbors {
            neighbors.clear();
        }
    }
}

impl<const J: usize, const K: usize, const C: usize> Mixture<J, K, C> {
    /// The metric of the frame's query.
    // Not inlined, so that the query does not stay on the stack to the end of the frame.
    #[inline(never)]
    fn metric(&mut self, context: &mut Context<'_, '_, J, impl Observer<J>>) -> Metric {
        let Frame { database, settings, .. } = context.frame;
        let mut query: Feature = [0.0; _];
        self.window.feature(database, self.scratch.aligned(), &mut query);
        let metric = Metric::new(database, &mut query, settings.mask);
        context.observer.query(&query);
        metric
    }

    /// Finds the neighbors in every class that the labels allow, and the proportions of the classes.
    #[inline(never)]
    fn search(&mut self, context: &mut Context<'_, '_, J, impl Observer<J>>, metric: &Metric) {
        let Context { frame, report, observer, .. } = context;
        let Frame { database, config, .. } = *frame;
        observer.stage(Stage::Search);
        let mut limits = Limits {
            k: usize::from(config.k),
            pool: usize::from(config.pool),
            visits: config.visits,
            spare: SPARE,
            jump: config.jump,
            cutoff_distance2: f32::INFINITY,
        };
        let mut restarted = [false; C];
        let (mut count, mut restarts) = (0, 0);
        let mut candidates = self.class_distances.candidates(*frame, metric.is_whole());
        while let Some(class) = candidates.next() {
            let state = self.neighbors.get_mut(class).zip(restarted.get_mut(class));
            let Some((neighbors, restarted)) = state else { break };
            limits.cutoff_distance2 = candidates.cutoff_distance2();
            let last = self.class_distances.last(class, neighbors);
            let found = self.searcher.search(database, class, metric, &limits, last);
            self.class_distances.set(database, class, &found, &mut candidates);
            let stats = found.stats;
            neighbors.clear();
            // At most k, which is at most K.
            neighbors.extend(found.rows().take(K));
            // Never below 0: a search takes no more than its own visits and those to spare.
            let visits = u16::try_from(stats.visits).unwrap_or(u16::MAX);
            limits.spare = limits.spare.saturating_add(config.visits).saturating_sub(visits);
            report.visits += stats.visits;
            report.bytes_read += stats.bytes;
            report.degraded.add_if(stats.capped, Degraded::VISITS);
            *restarted = stats.restarted;
            count += 1;
            restarts += usize::from(stats.restarted);
            observer.searched(class, &found);
        }
        observer.stage(Stage::Rest);
        // A stream that begins or has jumped searches every class and twice as long, and its classes hardly differ yet.
        let is_fresh = 2 * restarts > count || !self.class_distances.is_warm();
        self.weigh_classes(*frame, is_fresh, &restarted, report);
    }

    /// Computes the proportions of the classes from their distances, and reports them. `is_fresh` is true in a frame in
    /// which most classes were searched afresh; `restarted` says it of each class.
    #[inline]
    fn weigh_classes(
        &self,
        Frame { database, config, .. }: Frame<'_, '_>,
        is_fresh: bool,
        restarted: &[bool; C],
        report: &mut Report,
    ) {
        let most = usize::from(config.classes);
        let most = if is_fresh { most.min(weights::MAX_KEPT_FRESH) } else { most };
        let (distances, shares) = (self.class_distances.distances(database), &mut report.classes);
        let cut = weights::proportions(&distances, Width::relative(config.delta), config.prune, most, shares);
        report.degraded.add_if(cut, Degraded::CLASSES);
        // The search of far classes restarts all the time; that counts where they have weight.
        let jumped =
            report.classes.iter().any(|s| restarted.get(usize::from(s.class)).copied().unwrap_or(false));
        report.degraded.add_if(jumped, Degraded::JUMP);
        let Some(nearest) = report.classes.first().map(|share| usize::from(share.class)) else { return };
        report.distance2 = self.class_distances.last_distance2(nearest);
        if let Some(trust_limits) = database.trust_limits(nearest).filter(|limits| limits.far > 0.0) {
            report.distance_ratio = report.distance2 / trust_limits.far;
        }
    }

    /// A first pose has no frame before it. The means of the nearest class's neighbors replace it.
    #[inline(never)]
    fn init_history(&mut self, context: &mut Context<'_, '_, J, impl Observer<J>>, metric: &Metric) {
        // In place: new arrays would be on the stack first.
        context.signals.x_prev.fill([0.0; 4]);
        context.signals.y_prev.fill([0.0; 4]);
        self.places.clear();
        let Frame { database, config, settings, .. } = context.frame;
        let Some(&nearest) = context.report.classes.first() else { return };
        self.take_nearest(usize::from(nearest.class));
        for mix in (0..=database.counts().groups).filter(|&mix| settings.uses_mix(database, mix)) {
            // An estimate that the next frame replaces, so a quarter of the neighbors is enough.
            let most = usize::from(config.k).div_ceil(4);
            self.load_examples(context, metric, nearest, mix, most, None);
            let signals = &mut *context.signals;
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

    /// Takes the nearest rows of a class.
    fn take_nearest(&mut self, class: usize) {
        self.rows.clear();
        for &row in self.neighbors.get(class).into_iter().flatten() {
            // There is room for as many.
            let _ = self.rows.push(row);
        }
    }

    /// Takes the rows that a class is fitted to: its nearest ones, or of whole actions those that follow the last ones. Returns
    /// true if the body has jumped to another place of a clip, or another class takes part.
    #[inline(never)]
    fn take_rows(
        &mut self,
        context: &mut Context<'_, '_, J, impl Observer<J>>,
        metric: &Metric,
        class: usize,
    ) -> bool {
        self.take_nearest(class);
        let Context { frame: Frame { database, config, .. }, report, observer, .. } = context;
        if config.follow <= 0.0 || database.is_gait(class) {
            return false;
        }
        observer.stage(Stage::Search);
        let limits =
            places::Limits { distance2: self.class_distances.last_distance2(class), follow: config.follow };
        let jumped = self.places.follow(database, class, metric, limits, &mut self.rows, report);
        observer.stage(Stage::Rest);
        jumped
    }

    /// Unpacks at most `most` of the rows taken of a class, with outputs in a mix of styles. Adds them to the regression and the
    /// timing, and the votes of the nearest to `votes`.
    #[inline(never)]
    fn load_examples(
        &mut self,
        context: &mut Context<'_, '_, J, impl Observer<J>>,
        metric: &Metric,
        share: Share,
        mix: usize,
        most: usize,
        mut votes: Option<&mut Votes>,
    ) {
        let Context { frame: Frame { database, settings, .. }, report, observer, .. } = context;
        let class = usize::from(share.class);
        let first_row = database.class(class).first_row;
        let has_legs = database.legs().is_some();
        let strength = clamp(settings.strength_of(database.joint_group(0)), 0.0, 1.0);
        let dofs = database.counts().dofs;
        let mix = settings.mix(mix);
        let active = examples::active_styles(mix, database.counts().styles);
        self.examples.clear((0..dofs).map(|d| [database.step(d), database.scale(d)]));
        self.steps.clear();
        for (i, &row) in self.rows.iter().enumerate().take(most) {
            let row = first_row + usize::from(row);
            observer.stage(Stage::Decode);
            let example = self.examples.next_slot(&mut self.scratch).as_flattened_mut();
            let read = examples::read(database, class, row, mix, &active, example);
            if let Some(votes) = votes.as_deref_mut().filter(|votes| i < votes.voters_per_class) {
                observer.stage(Stage::Contacts);
                let distances = if has_legs {
                    votes.distances2(example)
                } else {
                    // A blob without legs: the distance of the whole body.
                    [metric.metres2(database, row); 2]
                };
                let vote = contact_votes::vote(database, row, read.stands, strength);
                votes.add(vote, distances, share.proportion);
            }
            observer.stage(Stage::Timing);
            self.steps.add(example, read.step_s);
            observer.stage(Stage::Regression);
            self.examples.add(dofs, &self.scratch);
            report.bytes_read += read.bytes;
        }
        observer.stage(Stage::Regression);
        self.examples.finish(dofs, &self.scratch);
    }

    /// Predicts every dof by one class in one mix of styles, into `signals.scratch`. Adds those dofs whose joint groups
    /// have that mix to the mixture's prediction.
    fn predict_class(
        &mut self,
        context: &mut Context<'_, '_, J, impl Observer<J>>,
        share: Share,
        mix: usize,
        parameters: &Parameters,
        spring: Spring,
    ) {
        let Context { frame: Frame { database, settings, .. }, signals, .. } = context;
        let signals = &mut **signals;
        let (x, x_prev, y_prev) =
            (signals.x.as_flattened(), signals.x_prev.as_flattened(), signals.y_prev.as_flattened());
        let inputs = x_prev.iter().zip(y_prev).zip(x);
        let corrections = signals.correction.as_flattened_mut();
        let sums = signals.predicted.as_flattened_mut().iter_mut().zip(corrections);
        let outputs = signals.scratch.as_flattened_mut().iter_mut().zip(sums);
        let regression = Regression::new(parameters, self.examples.count());
        let [of_correction, of_change] = spring.parts(share.proportion);
        for (d, ((class_output, (predicted, correction)), ((&x_prev, &y_prev), &x))) in
            outputs.zip(inputs).enumerate().take(database.counts().dofs)
        {
            let (step, scale) = (database.step(d), database.scale(d));
            let prediction = regression.predict(&self.examples, d, [x_prev, y_prev, x], step, scale);
            *class_output = prediction.y;
            if settings.mix_of(database.group_of_dof(d)) == mix {
                *predicted += share.proportion * prediction.y;
                *correction += of_correction * prediction.correction + of_change * prediction.change;
            }
        }
    }

    /// Predicts every dof, the time step and the contacts by the mixture of the classes kept.
    #[inline(never)]
    fn regress(&mut self, context: &mut Context<'_, '_, J, impl Observer<J>>, metric: &Metric) {
        let Frame { database, config, settings, .. } = context.frame;
        let root_mix = settings.mix_of(database.joint_group(0));
        let mut parameters = Parameters {
            lambda: config.lambda,
            ridge: config.ridge,
            feedback: config.feedback,
            output_kappa: config.output_kappa,
            kappa: config.kappa,
            rho: config.rho,
            output_rho: config.rho,
        };
        let mut votes = Votes::new(context.report.classes.len());
        let (x, x_prev) = (context.signals.x.as_flattened(), context.signals.x_prev.as_flattened());
        context.observer.stage(Stage::Contacts);
        votes.set_query(database, x, x_prev);
        context.observer.stage(Stage::Timing);
        self.steps.set_query(database, x, x_prev);
        context.observer.stage(Stage::Rest);
        context.signals.predicted.fill([0.0; 4]);
        context.signals.correction.fill([0.0; 4]);
        let (mut i, mut spring, mut step_s) = (0, Spring::NONE, 0.0);
        while let Some(&share) = context.report.classes.get(i) {
            i += 1;
            let class = usize::from(share.class);
            let jumped = self.take_rows(context, metric, class) && !context.frame.first;
            // The nearest class comes first.
            if i == 1 {
                spring = self.settled.begin(context, jumped);
            }
            self.settled.note(jumped, share.proportion);
            // The root's mix first: the time step and the votes follow it.
            self.load_examples(context, metric, share, root_mix, K, Some(&mut votes));
            parameters.output_rho = output_rho(database, config, class, settings.mix(root_mix));
            self.predict_class(context, share, root_mix, &parameters, spring);
            context.observer.stage(Stage::Timing);
            let (y, y_prev) = (context.signals.scratch.as_flattened(), context.signals.y_prev.as_flattened());
            step_s += share.proportion * self.steps.predict(y, y_prev, config.timing_width);
            context.observer.stage(Stage::Rest);
            context.observer.timed(class, &self.rows, self.steps.weights());
            for mix in 0..=database.counts().groups {
                if mix == root_mix || !settings.uses_mix(database, mix) {
                    continue;
                }
                self.load_examples(context, metric, share, mix, K, None);
                parameters.output_rho = output_rho(database, config, class, settings.mix(mix));
                self.predict_class(context, share, mix, &parameters, spring);
            }
        }
        self.places.retain(&context.report.classes);
        self.settled.settle(context, spring);
        context.report.contact_likelihood = votes.likelihood();
        if step_s > 0.0 {
            context.report.predicted_step_s = step_s;
        }
    }
}
