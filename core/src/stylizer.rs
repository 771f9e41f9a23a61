//! One step: a pose in, the same pose in another style out.

mod configure;

use heapless::Vec;

use crate::{
    Config, ConfigError, Degraded, Observer, Pose, Report,
    blob::{
        Database,
        layout::{MAX_GROUPS, MAX_STYLES, ROOT_DOFS, dof},
    },
    config::Yaw,
    contact::Votes,
    examples::{Reader, StyleWeights},
    knn::{Limits, Metric, Searcher},
    mixture,
    pose::{self, Anchor, Dofs},
    query::{Feature, Window},
    regress::{Examples, Parameters},
    timing::{Steps, Timing},
};

/// Mean squared distance of a class that was not searched.
const NOT_SEARCHED: f32 = -1.0;
/// No dof of a body comes near (m, rad, m/s, rad/s): a prediction beyond is held back.
const BEYOND_ANY_BODY: f32 = 1e3;

/// Turns a stream of poses into another style. Owns all the RAM it needs, whose size is a constant.
///
/// `J` joints, `K` neighbors a class, `C` classes: capacities, at least those of the database and configuration.
#[derive(Debug, Clone)]
pub struct Stylizer<'db, const J: usize, const K: usize, const C: usize> {
    database: Database<'db>,
    config: Config,
    styles: StyleWeights,
    action: Option<u16>,
    input_style: Option<u16>,
    mask: u8,
    strength: [f32; MAX_GROUPS],

    window: Window<J>,
    searcher: Searcher,
    /// Neighbors of each class in the last frame, nearest first.
    neighbors: [Vec<u16, K>; C],
    mean_distance2: [f32; C],
    reader: Reader<J>,
    examples: Examples<J>,
    steps: Steps<K>,

    x: Dofs<J>,
    x_prev: Dofs<J>,
    /// The last prediction, before strength: what the regression is fed back.
    y_prev: Dofs<J>,
    predicted: Dofs<J>,
    class_predicted: Dofs<J>,
    input_anchor: Anchor,
    output_anchor: Anchor,
    last: Option<Pose<J>>,
}

impl<'db, const J: usize, const K: usize, const C: usize> Stylizer<'db, J, K, C> {
    /// A stylizer that puts out the database's first style until told otherwise.
    ///
    /// # Errors
    /// [`ConfigError`] where the database does not fit the capacities, or a parameter is out of its range.
    pub fn new(database: Database<'db>, config: Config) -> Result<Self, ConfigError> {
        let counts = *database.counts();
        let short = |value: usize| u16::try_from(value).unwrap_or(u16::MAX);
        // Dofs<J> has room for 3 J + 4 numbers from J = 4 on.
        if counts.joints > J || counts.dofs > 4 * J {
            return Err(ConfigError::Joints { need: short(counts.joints), have: short(J) });
        }
        if counts.classes > C {
            return Err(ConfigError::Classes { need: short(counts.classes), have: short(C) });
        }
        config.check(K)?;
        let mut styles = [0.0; MAX_STYLES];
        styles[0] = 1.0;
        Ok(Self {
            database,
            config,
            styles,
            action: None,
            input_style: None,
            mask: u8::MAX,
            strength: [1.0; MAX_GROUPS],
            window: Window::new(),
            searcher: Searcher::new(),
            neighbors: [const { Vec::new() }; C],
            mean_distance2: [NOT_SEARCHED; C],
            reader: Reader::new(),
            examples: Examples::new(),
            steps: Steps::new(),
            x: [[0.0; 4]; J],
            x_prev: [[0.0; 4]; J],
            y_prev: [[0.0; 4]; J],
            predicted: [[0.0; 4]; J],
            class_predicted: [[0.0; 4]; J],
            input_anchor: Anchor::ORIGIN,
            output_anchor: Anchor::ORIGIN,
            last: None,
        })
    }

    /// The database.
    pub fn database(&self) -> &Database<'db> {
        &self.database
    }

    /// The configuration.
    pub fn config(&self) -> &Config {
        &self.config
    }

    /// The output style: numbers of styles and their weights, which are brought to sum 1. May change while running.
    ///
    /// # Errors
    /// [`ConfigError`] for unknown styles and for weights that are negative, not finite or all zero; the style in
    /// force stays.
    pub fn set_style(&mut self, weights: &[(u16, f32)]) -> Result<(), ConfigError> {
        let mut styles: StyleWeights = [0.0; MAX_STYLES];
        for &(style, weight) in weights {
            self.known(Some(style), self.database.counts().styles)?;
            let slot = styles.get_mut(usize::from(style)).ok_or(ConfigError::Weights)?;
            if !(0.0..=1e6).contains(&weight) {
                return Err(ConfigError::Weights);
            }
            *slot += weight;
        }
        let total: f32 = styles.iter().sum();
        if total <= 1e-6 {
            return Err(ConfigError::Weights);
        }
        self.styles = styles.map(|w| w / total);
        Ok(())
    }

    /// The output style's weights, by number of the style; they sum to 1.
    pub fn style(&self) -> &[f32] {
        self.styles.get(..self.database.counts().styles).unwrap_or(&[])
    }

    /// The input's action, where the caller knows it.
    ///
    /// # Errors
    /// [`ConfigError`] where the database has no such action, or not in the labelled input style.
    pub fn set_action(&mut self, action: Option<u16>) -> Result<(), ConfigError> {
        self.known(action, self.database.counts().actions)?;
        self.label(action, self.input_style)
    }

    /// The input's style, where the caller knows it.
    ///
    /// # Errors
    /// [`ConfigError`] where the database has no such style, or not in the labelled action.
    pub fn set_input_style(&mut self, style: Option<u16>) -> Result<(), ConfigError> {
        self.known(style, self.database.counts().styles)?;
        self.label(self.action, style)
    }

    /// Whether the search looks at a joint group. At least one group is always looked at.
    ///
    /// # Errors
    /// [`ConfigError`] for an unknown group, or where no group would be left.
    pub fn set_mask(&mut self, group: u16, searched: bool) -> Result<(), ConfigError> {
        let groups = self.database.counts().groups;
        self.known(Some(group), groups)?;
        let bit = 1 << group;
        let mask = if searched { self.mask | bit } else { self.mask & !bit };
        let all = if groups >= 8 { u8::MAX } else { (1 << groups) - 1 };
        // What counts is whether a component is left to compare.
        let features = self.database.counts().features;
        if !(0..features).any(|f| (mask & all) >> self.database.feature_group(f) & 1 == 1) {
            return Err(ConfigError::Parameter);
        }
        self.mask = mask;
        Ok(())
    }

    /// True where the search looks at the group.
    pub fn searches(&self, group: usize) -> bool {
        group < MAX_GROUPS && self.mask >> group & 1 == 1
    }

    /// How much of the style a joint group takes on: 0 leaves the input as it is, 1 is the style, up to 2 goes beyond.
    ///
    /// # Errors
    /// [`ConfigError`] for an unknown group or a strength outside 0 to 2.
    pub fn set_strength(&mut self, group: u16, strength: f32) -> Result<(), ConfigError> {
        self.known(Some(group), self.database.counts().groups)?;
        if !(0.0..=2.0).contains(&strength) {
            return Err(ConfigError::Parameter);
        }
        if let Some(slot) = self.strength.get_mut(usize::from(group)) {
            *slot = strength;
        }
        Ok(())
    }

    /// Strength of a joint group.
    pub fn strength(&self, group: usize) -> f32 {
        self.strength.get(group).copied().unwrap_or(1.0)
    }

    /// The labelled action and input style.
    pub fn labels(&self) -> (Option<u16>, Option<u16>) {
        (self.action, self.input_style)
    }

    /// Forgets the stream; the next pose is a first pose. Settings stay.
    pub fn reset(&mut self) {
        self.window.clear();
        for neighbors in &mut self.neighbors {
            neighbors.clear();
        }
        self.last = None;
    }

    fn known(&self, id: Option<u16>, have: usize) -> Result<(), ConfigError> {
        match id {
            Some(id) if usize::from(id) >= have => Err(ConfigError::Unknown { id, have: have as u16 }),
            _ => Ok(()),
        }
    }

    fn label(&mut self, action: Option<u16>, style: Option<u16>) -> Result<(), ConfigError> {
        if !self.database.classes().any(|c| matches(c, action, style)) {
            return Err(ConfigError::NoClass);
        }
        (self.action, self.input_style) = (action, style);
        Ok(())
    }

    /// Takes one pose at the database's rate, gives it the style, and says what happened. Cannot fail: input that
    /// is no pose is answered with the last output, and reported.
    pub fn step(&mut self, input: &Pose<J>, output: &mut Pose<J>) -> Report {
        self.step_observed(input, output, &mut ())
    }

    /// [`step`](Self::step), looked into.
    pub fn step_observed(
        &mut self,
        input: &Pose<J>,
        output: &mut Pose<J>,
        observer: &mut impl Observer<J>,
    ) -> Report {
        let input_step = 1.0 / self.database.rate_hz();
        let mut report = Report { step_s: input_step, predicted_step_s: input_step, ..Report::default() };
        if !input.is_valid(self.database.counts().joints) {
            *output = self.last.unwrap_or(Pose::IDENTITY);
            report.degraded.set(Degraded::INPUT, true);
            return report;
        }
        let first = self.last.is_none();
        self.take_in(input, first);

        let mut feature: Feature = [0.0; _];
        self.window.feature(&self.database, &mut feature);
        observer.query(&feature);
        let metric = Metric::new(&self.database, &feature, self.mask);
        self.search(&metric, &mut report, observer);
        if first {
            self.settle(&metric, &report);
        }
        self.regress(&metric, &mut report, observer);
        self.put_out(first, &mut report, output);
        observer.predicted(&self.x, &self.x_prev, &self.y_prev, &self.class_predicted);

        self.y_prev = self.predicted;
        self.x_prev = self.x;
        self.last = Some(*output);
        report
    }

    /// Input pose to dofs and window.
    fn take_in(&mut self, input: &Pose<J>, first: bool) {
        if first {
            let root = input.rotations.first().copied().unwrap_or(crate::quaternion::IDENTITY);
            self.input_anchor = Anchor::of(&self.database, input.position, root, Anchor::ORIGIN);
        }
        self.input_anchor =
            pose::to_dofs(&self.database, input, self.input_anchor, self.x.as_flattened_mut());
        self.window.push(&self.database, input);
    }

    /// Neighbors in every class that the labels allow, and their proportions.
    fn search(&mut self, metric: &Metric, report: &mut Report, observer: &mut impl Observer<J>) {
        let limits = Limits {
            k: usize::from(self.config.k),
            pool: usize::from(self.config.pool),
            visits: self.config.visits,
            jump: self.config.jump,
        };
        let counts = *self.database.counts();
        let mut jumps = [false; C];
        let slots = self.neighbors.iter_mut().zip(&mut self.mean_distance2).zip(&mut jumps);
        for (class, ((neighbors, mean), jumped)) in slots.enumerate().take(counts.classes) {
            if !matches(self.database.class(class), self.action, self.input_style) {
                neighbors.clear();
                *mean = NOT_SEARCHED;
                continue;
            }
            let (found, effort) =
                self.searcher.search(&self.database, class, metric, &limits, neighbors, *mean);
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
        let (most, means) =
            (usize::from(self.config.classes), self.mean_distance2.get(..counts.classes).unwrap_or(&[]));
        let cut =
            mixture::proportions(means, self.config.delta, self.config.prune, most, &mut report.classes);
        report.degraded.set(Degraded::CLASSES, cut);
        // Far classes are found anew all the time; that counts where it is heard.
        let jumped = report.classes.iter().any(|s| jumps.get(usize::from(s.class)).copied().unwrap_or(false));
        report.degraded.set(Degraded::JUMP, jumped);
        report.distance2 =
            report.classes.first().and_then(|s| means.get(usize::from(s.class))).copied().unwrap_or(0.0);
        self.reader.start();
    }

    /// A first pose has no frame before it: what the neighbors came from stands in for it.
    fn settle(&mut self, metric: &Metric, report: &Report) {
        let dofs = self.database.counts().dofs;
        self.x_prev = [[0.0; 4]; J];
        self.y_prev = [[0.0; 4]; J];
        let mut rates = [0.0; 3];
        for share in &report.classes {
            self.gather(metric, usize::from(share.class), share.proportion, &mut Votes::default());
            let outputs = self.x_prev.as_flattened_mut().iter_mut().zip(self.y_prev.as_flattened_mut());
            for (d, (x_prev, y_prev)) in outputs.enumerate().take(dofs) {
                let [mean_x_prev, mean_y_prev, mean_x] = self.examples.means(d);
                *x_prev += share.proportion * mean_x_prev;
                *y_prev += share.proportion * mean_y_prev;
                if let Some(rate) = d.checked_sub(dof::FORWARD).and_then(|i| rates.get_mut(i)) {
                    *rate += share.proportion * mean_x;
                }
            }
        }
        if let Some(slots) = self.x.as_flattened_mut().get_mut(dof::FORWARD..dof::JOINTS) {
            slots.copy_from_slice(&rates);
        }
    }

    /// Reads the neighbors of a class into the regression and the timing. Returns their rows, sorted.
    fn gather(&mut self, metric: &Metric, class: usize, proportion: f32, votes: &mut Votes) -> Vec<u16, K> {
        let counts = *self.database.counts();
        let first_row = self.database.class(class).first_row;
        let mut sorted = self.neighbors.get(class).cloned().unwrap_or_default();
        insertion_sort(&mut sorted);
        self.examples.clear();
        self.steps.clear();
        for &row in &sorted {
            let row = first_row + usize::from(row);
            self.reader.read(&self.database, class, row, &self.styles);
            self.examples.add(&self.reader.variables, counts.dofs);
            let (x, x_prev) = (self.x.as_flattened(), self.x_prev.as_flattened());
            self.steps.add(&self.database, x, x_prev, &self.reader.variables, self.reader.step_s);
            votes.add(&self.database, row, metric.distance2(self.database.feature(row)), proportion);
        }
        sorted
    }

    /// The mixture's prediction of every dof, of the time step and of the contacts.
    fn regress(&mut self, metric: &Metric, report: &mut Report, observer: &mut impl Observer<J>) {
        let dofs = self.database.counts().dofs;
        let parameters = Parameters {
            lambda: self.config.lambda,
            ridge: self.config.ridge,
            kappa: self.config.kappa,
            rho: self.config.rho,
        };
        let mut votes = Votes::default();
        let mut step_s = 0.0;
        self.predicted = [[0.0; 4]; J];
        for share in &report.classes {
            let class = usize::from(share.class);
            let rows = self.gather(metric, class, share.proportion, &mut votes);
            let (x, x_prev, y_prev) =
                (self.x.as_flattened(), self.x_prev.as_flattened(), self.y_prev.as_flattened());
            let inputs = x_prev.iter().zip(y_prev).zip(x);
            let outputs =
                self.class_predicted.as_flattened_mut().iter_mut().zip(self.predicted.as_flattened_mut());
            for (d, ((one, all), ((&x_prev, &y_prev), &x))) in outputs.zip(inputs).enumerate().take(dofs) {
                *one = self.examples.predict(d, [x_prev, y_prev, x], self.database.scale(d), &parameters);
                *all += share.proportion * *one;
            }
            let y = self.class_predicted.as_flattened();
            step_s +=
                share.proportion * self.steps.predict(&self.database, y, y_prev, self.config.timing_width);
            observer.timed(class, &rows, self.steps.weights());
        }
        report.bytes_read += self.reader.bytes;
        report.contacts = votes.result();
        if step_s > 0.0 {
            report.predicted_step_s = step_s;
        }
    }

    /// Yaw, strength, and the way back to a pose; leaves the final dofs in `class_predicted`.
    fn put_out(&mut self, first: bool, report: &mut Report, output: &mut Pose<J>) {
        let dofs = self.database.counts().dofs;
        let root_strength = self.strength(self.database.joint_group(0));
        let variables = self.predicted.as_flattened_mut().iter_mut().zip(self.x.as_flattened());
        for (d, ((predicted, &x), last)) in
            variables.zip(self.class_predicted.as_flattened_mut()).enumerate().take(dofs)
        {
            // NaN is in no range.
            if !(-BEYOND_ANY_BODY..BEYOND_ANY_BODY).contains(predicted) {
                *predicted = x;
                report.degraded.set(Degraded::PREDICTION, true);
            }
            if d == dof::YAW && self.config.yaw == Yaw::Input {
                *predicted = x;
            }
            let strength = if d < dof::JOINTS {
                root_strength
            } else {
                let group = self.database.joint_group((d - ROOT_DOFS) / 3);
                self.strength.get(group).copied().unwrap_or(1.0)
            };
            *last = x + strength * (*predicted - x);
        }
        let input_step = 1.0 / self.database.rate_hz();
        let step_s = input_step + root_strength * (report.predicted_step_s - input_step);
        report.step_s = match self.config.timing {
            Timing::Free => step_s,
            Timing::Sync => input_step,
        };

        let at = |d: usize| self.class_predicted.as_flattened().get(d).copied().unwrap_or(0.0);
        if first {
            self.output_anchor = self.input_anchor;
        } else {
            self.output_anchor.ground = self.output_anchor.moved(at(dof::FORWARD), at(dof::LEFT), step_s);
            self.output_anchor.heading = match self.config.yaw {
                Yaw::Input => self.input_anchor.heading,
                Yaw::Predicted => crate::math::wrap_angle(self.output_anchor.heading + at(dof::YAW) * step_s),
            };
        }
        *output = Pose::IDENTITY;
        pose::to_pose(&self.database, self.class_predicted.as_flattened(), self.output_anchor, output);
    }
}

fn matches(class: crate::blob::Class, action: Option<u16>, style: Option<u16>) -> bool {
    action.is_none_or(|a| a == class.action) && style.is_none_or(|s| s == class.style)
}

/// Sorts a short list in place, ascending.
fn insertion_sort(rows: &mut [u16]) {
    for end in 1..rows.len() {
        let mut i = end;
        while let (Some(&before), Some(&here)) = (i.checked_sub(1).and_then(|b| rows.get(b)), rows.get(i)) {
            if before <= here {
                break;
            }
            rows.swap(i - 1, i);
            i -= 1;
        }
    }
}
