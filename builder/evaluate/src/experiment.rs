//! An experiment: the clips, those that are held out as tests, and how databases are built from the others.

use std::collections::BTreeSet;

use anyhow::{Result, bail};
use gestus_core::blob::layout::dof;
use gestus_database::{
    build::BuildOptions,
    command_line::outputs::note,
    data_folder::{
        config::AnnotateError,
        split::{Set, Split},
    },
    pairing::Scheme,
};
use gestus_motion::{
    body::Body,
    corpus::{Corpus, Example},
    landmarks::LandmarkError,
    statistics::mean,
};

/// What every measure that builds databases works on.
#[derive(Debug, Clone)]
pub struct Experiment {
    /// All clips.
    pub corpus: Corpus,
    /// Style of the test clips: the input style.
    pub from: usize,
    /// Output styles.
    pub to: Vec<usize>,
    /// Test clips of each action.
    pub folds: usize,
    /// Names of the clips that may be test and truth clips; all where it is `None`. Folds that have one test clip of each
    /// action between them then share a database.
    pub among: Option<BTreeSet<String>>,
    /// How databases are built.
    pub build: BuildOptions,
    /// Which clip is the truth for a test clip.
    pub truth: Truth,
}

/// Which clip of the output style a test clip's translation is compared with.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Truth {
    /// The clip of the same action that is nearest in mean speed and yaw rate: for motion that was not recorded in pairs.
    NearestContent,
    /// The clip of the same take, which is the exact answer: for pairs that were generated.
    SameTake,
}

/// A test clip in one output style, and the clip that its translation is compared with. A fold leaves both out of the
/// database.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct HeldOut {
    /// The test clip.
    pub test: usize,
    /// The truth for it in the output style.
    pub truth: usize,
    /// The next best clip of the output style, if there is one; it stays in the database.
    pub other: Option<usize>,
    /// The output style.
    pub style: usize,
}

impl Experiment {
    /// From the plain style to all others, with one test clip of each action. Clips that are paired by take are compared by
    /// take.
    pub fn new(corpus: Corpus, build: BuildOptions) -> Self {
        let from = corpus.plain_style();
        let to = (0..corpus.styles.len()).filter(|&s| s != from).collect();
        let truth = if build.pairing == Scheme::Take { Truth::SameTake } else { Truth::NearestContent };
        Self { corpus, from, to, folds: 1, among: None, build, truth }
    }

    /// The same experiment on pairs from the first style to the second that belong together by take.
    pub(crate) fn on_pairs(&self, corpus: Corpus) -> Self {
        let build = BuildOptions { pairing: Scheme::Take, ..self.build.clone() };
        Self { corpus, from: 0, to: vec![1], build, truth: Truth::SameTake, ..self.clone() }
    }

    /// The same experiment on one set of a split: test and truth clips are of that set, all of them are test clips, and for
    /// `development` the clips of the test set are not there at all.
    ///
    /// # Errors
    /// [`AnnotateError::Both`] for a clip in both sets.
    pub fn on(self, split: &Split, set: Set) -> Result<Self, AnnotateError> {
        let sets: Vec<Option<Set>> =
            self.corpus.examples.iter().map(|e| split.set_of(&e.clip.name)).collect::<Result<_, _>>()?;
        let of = |wanted: Set| (0..sets.len()).filter(|&i| sets[i] == Some(wanted)).collect::<Vec<_>>();
        let among = of(set).into_iter().map(|i| self.corpus.examples[i].clip.name.clone()).collect();
        let hidden: Vec<usize> = if set == Set::Development { of(Set::Test) } else { Vec::new() };
        let corpus = self.corpus.without(&hidden);
        Ok(Self { corpus, among: Some(among), folds: usize::MAX, ..self })
    }

    /// What is measured, for reports: actions, styles, the input and output styles, the number of clips, and the test clips.
    pub fn described(&self) -> serde_json::Value {
        let Self { corpus, from, to, .. } = self;
        let tests = self.test_clips().into_iter().map(|i| corpus.examples[i].clip.name.as_str());
        serde_json::json!({
            "actions": corpus.actions,
            "styles": corpus.styles,
            "from": corpus.styles.get(*from),
            "to": to.iter().map(|&s| corpus.styles[s].as_str()).collect::<Vec<_>>(),
            "clips": corpus.examples.len(),
            "test_clips": tests.collect::<Vec<_>>(),
        })
    }

    /// Whether a clip may be a test or a truth clip.
    pub(crate) fn may_be_tested(&self, clip: usize) -> bool {
        self.among.as_ref().is_none_or(|names| names.contains(&self.corpus.examples[clip].clip.name))
    }

    /// Build options with linear models and statistics, of each action and of all together.
    pub fn build_with_models(&self) -> BuildOptions {
        BuildOptions {
            models: true,
            models_by_action: true,
            from: self.corpus.styles.get(self.from).cloned(),
            ..self.build.clone()
        }
    }

    /// Test clips: of each action in the input style, the first `folds` by name.
    pub fn test_clips(&self) -> Vec<usize> {
        let examples = &self.corpus.examples;
        let mut tests = Vec::new();
        for action in 0..self.corpus.actions.len() {
            let mut clips: Vec<usize> = (0..examples.len())
                .filter(|&i| (examples[i].action, examples[i].style) == (action, self.from))
                .filter(|&i| self.may_be_tested(i))
                .collect();
            clips.sort_by(|&a, &b| examples[a].clip.name.cmp(&examples[b].clip.name));
            tests.extend(clips.into_iter().take(self.folds));
        }
        tests
    }

    /// The test clips without which, all at once, each class keeps a clip. Those that have to stay in the database are named
    /// on standard error.
    ///
    /// # Errors
    /// Where none is left.
    pub fn queries(&self) -> Result<Vec<usize>> {
        let (queries, spared) = self.spared();
        for clip in spared {
            let example = &self.corpus.examples[clip];
            let (action, style) = (&self.corpus.actions[example.action], &self.corpus.styles[example.style]);
            note(format_args!(
                "not tested: {} stays in the database, since it is the last clip of {action} in {style}",
                example.clip.name
            ));
        }
        if queries.is_empty() {
            bail!(
                "--folds {}: no clip of the style {} can be a query: its actions have one clip each, which the database \
                 needs",
                self.folds,
                self.corpus.styles[self.from]
            );
        }
        Ok(queries)
    }

    /// The test clips that leave the database, all at once, and those that stay, since a class would be empty without them.
    fn spared(&self) -> (Vec<usize>, Vec<usize>) {
        let (mut gone, mut kept) = (Vec::new(), Vec::new());
        for test in self.test_clips() {
            let action = self.corpus.examples[test].action;
            // An action that lacks a style is not in the database with this clip either.
            let before = self.lacking(action, &gone).len();
            gone.push(test);
            if self.lacking(action, &gone).len() > before {
                gone.pop();
                kept.push(test);
            }
        }
        (gone, kept)
    }

    /// Most test clips that an action has.
    pub fn max_tests(&self) -> usize {
        let tests = self.test_clips();
        let of = |action| tests.iter().filter(|&&i| self.corpus.examples[i].action == action).count();
        (0..self.corpus.actions.len()).map(of).max().unwrap_or(0)
    }

    /// Folds that share a database, which leaves out all of their tests and truths: of a split, those that are
    /// [`grouped`](Self::grouped); else each is alone.
    pub fn sharing(&self, folds: &[HeldOut]) -> Vec<Vec<HeldOut>> {
        if self.among.is_some() { self.grouped(folds) } else { folds.iter().map(|&f| vec![f]).collect() }
    }

    /// Folds with the first test clip of each action, those with the second, and so on. Without the clips of a group, each
    /// class lacks one.
    pub fn grouped(&self, folds: &[HeldOut]) -> Vec<Vec<HeldOut>> {
        let tests = self.test_clips();
        let action = |test: usize| self.corpus.examples[test].action;
        let number = |f: &HeldOut| {
            let own = tests.iter().filter(|&&t| action(t) == action(f.test));
            own.take_while(|&&t| t != f.test).count()
        };
        let mut groups: Vec<Vec<HeldOut>> = Vec::new();
        for &fold in folds {
            let number = number(&fold);
            groups.resize_with(groups.len().max(number + 1), Vec::new);
            groups[number].push(fold);
        }
        groups.retain(|g| !g.is_empty());
        groups
    }

    /// Number of folds, those that are left out included.
    pub fn max_folds(&self) -> usize {
        self.test_clips().len() * self.to.len()
    }

    /// The folds, with the body that all clips share. Folds that are left out are named on standard error.
    ///
    /// # Errors
    /// [`LandmarkError`] where the skeleton has no recognisable legs.
    pub fn folds(&self) -> Result<(Body, Vec<HeldOut>), LandmarkError> {
        let body = Body::of(&self.corpus)?;
        let (folds, left_out) = self.held_out(&body);
        left_out.iter().for_each(note);
        Ok((body, folds))
    }

    /// The folds, and a line for each one that is left out: methods are compared by their means, which have to be over
    /// the same folds, and no method has an answer for an action that the database lacks.
    pub fn held_out(&self, body: &Body) -> (Vec<HeldOut>, Vec<String>) {
        let (mut folds, mut left_out) = (Vec::new(), Vec::new());
        for test in self.test_clips() {
            for &style in &self.to {
                match self.fold(body, test, style) {
                    Ok(fold) => folds.push(fold),
                    Err(line) => left_out.push(line),
                }
            }
        }
        (folds, left_out)
    }

    /// One fold, or why it can't be measured.
    fn fold(&self, body: &Body, test: usize, style: usize) -> Result<HeldOut, String> {
        let corpus = &self.corpus;
        let example = &corpus.examples[test];
        let (clip, action, to) = (&example.clip.name, &corpus.actions[example.action], &corpus.styles[style]);
        let truths = match self.truth {
            Truth::SameTake => self.same_take(test, style),
            Truth::NearestContent => self.counterparts(body, test, style),
        };
        let truth = truths.iter().copied().find(|&i| self.may_be_tested(i));
        let Some(truth) = truth else {
            return Err(format!("left out: {clip} to {to}: no clip of {action} in {to} to compare with"));
        };
        let missing = self.lacking(example.action, &[test, truth]);
        if missing.is_empty() {
            let other = truths.iter().copied().find(|&i| i != truth);
            return Ok(HeldOut { test, truth, other, style });
        }
        let (truth, missing) = (&corpus.examples[truth].clip.name, missing.join(", "));
        Err(format!(
            "left out: {clip} to {to}: without it and its truth {truth} no clip of {action} is left in {missing}"
        ))
    }

    /// The styles in which an action has no clip with a cycle once some clips are left out: such an action is not in the
    /// database.
    pub(crate) fn lacking(&self, action: usize, left_out: &[usize]) -> Vec<&str> {
        let remains = |style: usize| {
            let mut clips = self.corpus.examples.iter().enumerate();
            clips.any(|(i, e)| {
                (e.action, e.style) == (action, style) && !e.cycles.is_empty() && !left_out.contains(&i)
            })
        };
        let styles = self.corpus.styles.iter().enumerate();
        styles.filter(|&(s, _)| !remains(s)).map(|(_, name)| name.as_str()).collect()
    }

    /// The clips of a test clip's action in a style, nearest first in mean speed (m/s) and yaw rate (rad/s).
    pub(crate) fn counterparts(&self, body: &Body, test: usize, style: usize) -> Vec<usize> {
        let examples = &self.corpus.examples;
        let content = |i: usize| {
            let rows = body.clip_dofs(&examples[i].clip);
            [dof::FORWARD, dof::YAW].map(|d| mean(rows.iter().map(|r| r[d])))
        };
        let wanted = content(test);
        let mut clips: Vec<(usize, f64)> = (0..examples.len())
            .filter(|&i| {
                i != test && (examples[i].action, examples[i].style) == (examples[test].action, style)
            })
            .map(|i| {
                let [speed, yaw] = content(i);
                (i, (speed - wanted[0]).powi(2) + (yaw - wanted[1]).powi(2))
            })
            .collect();
        clips.sort_by(|a, b| a.1.total_cmp(&b.1));
        clips.into_iter().map(|c| c.0).collect()
    }

    /// The clips of a test clip's action and take in a style.
    fn same_take(&self, test: usize, style: usize) -> Vec<usize> {
        let examples = &self.corpus.examples;
        let wanted = &examples[test];
        let same = |e: &Example| e.action == wanted.action && e.style == style && e.take == wanted.take;
        (0..examples.len()).filter(|&i| same(&examples[i])).collect()
    }
}

/// The clips of some actions, but for those that are left out. Actions are numbered anew, styles are not.
pub(crate) fn only(corpus: &Corpus, actions: &[usize], left_out: &[usize]) -> Corpus {
    let is_out = |&i: &usize| left_out.contains(&i) || !actions.contains(&corpus.examples[i].action);
    let out: Vec<usize> = (0..corpus.examples.len()).filter(is_out).collect();
    let mut some = corpus.without(&out);
    some.actions = actions.iter().map(|&a| corpus.actions[a].clone()).collect();
    for example in &mut some.examples {
        example.action = actions.iter().position(|&a| a == example.action).unwrap_or_default();
    }
    some
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::measures::loo::{self, Methods};
    use gestus_database::synth;

    impl Experiment {
        /// On generated clips, with databases that have no linear models unless a measure needs them.
        pub(crate) fn generated(actions: &[&str], styles: &[&str], clips: usize, seconds: f64) -> Self {
            let corpus = synth::corpus(&synth::Options::of(actions, styles, clips, seconds)).unwrap();
            Self::new(corpus, BuildOptions { models: false, ..BuildOptions::default() })
        }
    }

    /// Walks, and punches of which one neutral clip is left.
    fn sparse() -> Experiment {
        let Experiment { corpus, build, .. } =
            Experiment::generated(&["walk", "punch"], &["neutral", "proud"], 2, 4.0);
        let (punch, neutral) = (corpus.action("punch").unwrap(), corpus.style("neutral").unwrap());
        let one = corpus.examples.iter().position(|e| (e.action, e.style) == (punch, neutral)).unwrap();
        Experiment::new(corpus.without(&[one]), build)
    }

    #[test]
    fn a_fold_without_its_action_is_left_out_and_named() {
        let experiment = sparse();
        let corpus = &experiment.corpus;
        let (folds, left_out) = experiment.held_out(&Body::of(corpus).unwrap());
        let walk = corpus.action("walk").unwrap();
        assert!(folds.len() == 1 && corpus.examples[folds[0].test].action == walk);
        assert!(
            left_out.len() == 1 && left_out[0].contains("no clip of punch is left in neutral"),
            "{left_out:?}"
        );
    }

    #[test]
    fn clips_that_are_paired_by_take_are_compared_by_take() {
        let Experiment { corpus, build, .. } =
            Experiment::generated(&["walk"], &["neutral", "proud"], 3, 4.0);
        let experiment = Experiment::new(corpus, BuildOptions { pairing: Scheme::Take, ..build });
        let experiment = Experiment { folds: 3, ..experiment };
        let (_, folds) = experiment.folds().unwrap();
        let take = |clip: usize| &experiment.corpus.examples[clip].take;
        assert!(folds.len() == 3 && folds.iter().all(|f| take(f.test) == take(f.truth) && f.other.is_none()));
    }

    #[test]
    fn a_split_hides_the_test_set_from_development_and_shares_databases() {
        let new = || Experiment::generated(&["walk", "run"], &["neutral", "proud"], 4, 4.0);
        let text = r#"
            development = ["{action}_{style}_000", "{action}_{style}_001"]
            test = ["{action}_{style}_002", "{action}_{style}_003"]
        "#;
        let split = Split::parse(text, "split").unwrap();
        for (set, takes, clips) in [(Set::Development, ["000", "001"], 8), (Set::Test, ["002", "003"], 16)] {
            let experiment = new().on(&split, set).unwrap();
            assert_eq!(experiment.corpus.examples.len(), clips, "{set:?}");
            let (folds, _) = experiment.held_out(&Body::of(&experiment.corpus).unwrap());
            assert_eq!((folds.len(), experiment.max_tests()), (4, 2));
            let name = |clip: usize| experiment.corpus.examples[clip].clip.name.clone();
            for clip in folds.iter().flat_map(|f| [f.test, f.truth]) {
                assert!(takes.iter().any(|take| name(clip).ends_with(take)), "{set:?}: {}", name(clip));
            }
            // One test clip of each action in each group.
            let groups = experiment.sharing(&folds);
            assert_eq!(groups.iter().map(Vec::len).collect::<Vec<_>>(), [2, 2]);
            for group in groups {
                let actions: BTreeSet<usize> =
                    group.iter().map(|f| experiment.corpus.examples[f.test].action).collect();
                assert_eq!(actions.len(), 2);
            }
        }
        assert_eq!(new().sharing(&new().held_out(&Body::of(&new().corpus).unwrap()).0).len(), 2);
    }

    #[test]
    fn queries_leave_the_database_a_clip_of_each_class() {
        let walks = Experiment::generated(&["walk"], &["neutral", "proud"], 2, 4.0);
        let mut experiment = Experiment { folds: 5, ..walks };
        let tests = experiment.test_clips();
        assert_eq!(tests.len(), 2);
        assert_eq!(experiment.spared(), (vec![tests[0]], vec![tests[1]]));
        experiment.corpus = experiment.corpus.without(&tests[..1]);
        assert_eq!(experiment.spared().0, Vec::<usize>::new());
        assert!(experiment.queries().is_err());
    }

    #[test]
    fn every_method_is_measured_over_the_same_folds() {
        let methods = Methods { configs: Methods::default().configs[..1].to_vec(), ..Methods::default() };
        let rows = loo::run(&sparse(), &methods, &|| ()).unwrap();
        let clips = |method: &str| -> BTreeSet<&str> {
            rows.iter().filter(|r| r.method == method).map(|r| r.clip.as_str()).collect()
        };
        let all = clips("mixture");
        assert_eq!(all.len(), 1);
        for method in ["unchanged", "global-affine", "nearest", "knn", "local-ar"] {
            assert_eq!(clips(method), all, "{method}");
        }
    }
}
