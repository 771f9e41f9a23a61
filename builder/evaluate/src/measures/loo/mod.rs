//! Leave one clip out: every method translates clips that the database has never seen.

pub(super) mod figures;

use gestus_core::{Config, Database};

use crate::{
    baselines::{
        gaussian_process, hsu, models,
        outputs::{ClassNeighbors, GlobalModel, Outputs, Record, Variables, interpolated},
    },
    evaluation::Evaluation,
    experiment::{Experiment, HeldOut},
    fold::{Fold, Row, class_of, classes_of, each_with, own_dofs},
    measures::{OnClips, Uses, growth},
    outside::{self, Output, OutsideArgs},
    report::table,
};
use gestus_database::{build::BuildError, command_line::progress, stream::Request, synth::affine};
use gestus_motion::{body::Body, corpus::Corpus};

/// Options of `gestus evaluate loo`.
#[derive(clap::Args, Debug, Clone, Default)]
pub struct Args {
    /// Add Gaussian process regression to the methods: it takes seconds a fold
    #[arg(long)]
    pub gaussian_process: bool,
    #[command(flatten)]
    outside: OutsideArgs,
}

/// Options of `gestus evaluate exact`.
#[derive(clap::Args, Debug, Clone, Default)]
pub struct ExactArgs {
    #[command(flatten)]
    loo: Args,
}

/// Methods that are compared.
#[derive(Debug, Clone)]
pub struct Methods {
    /// Configurations of the mixture, by name: the shipped one, that of Xia 2015, and the normalised ridge.
    pub configs: Vec<(String, Config)>,
    /// Whether the configurations are also run with the action alone known, and with the style alone.
    pub partly_labelled: bool,
    /// Whether baselines, linear models and statistics are among them.
    pub baselines: bool,
    /// Whether Gaussian process regression is among them.
    pub gaussian_process: bool,
    /// Methods from outside.
    pub outside: Vec<outside::Method>,
}

impl Default for Methods {
    fn default() -> Self {
        let configs = [
            ("mixture", Config::new()),
            ("mixture-paper", Config::paper()),
            ("mixture-normalised", Config::normalised()),
        ];
        let configs = configs.map(|(name, config)| (name.to_owned(), config)).to_vec();
        Self { configs, partly_labelled: true, baselines: true, gaussian_process: false, outside: Vec::new() }
    }
}

impl Methods {
    /// No configuration and no baseline.
    pub fn none() -> Self {
        Self {
            configs: Vec::new(),
            partly_labelled: false,
            baselines: false,
            gaussian_process: false,
            outside: Vec::new(),
        }
    }
}

impl OnClips for Args {
    const USES: Uses = Uses::ALL;

    fn evaluate(&self, experiment: &Experiment) -> anyhow::Result<Evaluation> {
        let outside = self.outside.run(experiment)?;
        let methods = Methods { gaussian_process: self.gaussian_process, outside, ..Methods::default() };
        Ok(evaluate(experiment, &methods)?)
    }
}

impl OnClips for ExactArgs {
    const USES: Uses = Uses { to: false, ..Uses::ALL };

    fn evaluate(&self, experiment: &Experiment) -> anyhow::Result<Evaluation> {
        let evaluation = self.loo.evaluate(&exact_pairs(experiment)?)?;
        Ok(Evaluation {
            what: "exact",
            about: "Every clip of the style has an output made by rule: an affine map of each dof on a warped timeline. \
                    The truth is exact, so a method that averages gains nothing by it."
                .into(),
            ..evaluation
        })
    }
}

/// Pairs made by rule from the clips of the input style: the true answer is known.
pub(super) fn exact_pairs(experiment: &Experiment) -> Result<Experiment, BuildError> {
    let pairs = affine::pairs(&experiment.corpus, experiment.from, &affine::Options::default())?;
    Ok(experiment.on_pairs(pairs.corpus))
}

/// Runs the evaluation and draws its plots.
fn evaluate(experiment: &Experiment, methods: &Methods) -> Result<Evaluation, BuildError> {
    let corpus = &experiment.corpus;
    let bar = progress::bar(experiment.max_folds(), "leave one out");
    let results = run(experiment, methods, &|| bar.inc(1))?;
    bar.finish_and_clear();
    let rows: Vec<table::Row> = results.iter().map(|r| r.to_json(corpus)).collect();
    let mut figures = vec![figures::error_bars(corpus, &results), figures::trade_off(&results)];
    figures.extend(figures::curves(experiment)?);
    Ok(Evaluation {
        what: "loo",
        about: "Every method translates clips that the database has never seen. Errors are mean joint distances, \
                hips-centred and facing ahead, to a held-out clip of the output style at equal canonical time: \
                `delivered_error_cm` is of the pose that leaves the core, after foot lock and limits, `joint_error_cm` of \
                the prediction, and so for every key that begins with `delivered_`. Mean \
                error rewards averaging: read it beside variability and third difference, which are relative to the \
                truth clip's."
            .into(),
        keys: vec!["method"],
        rows,
        figures,
    })
}

/// Runs every method on every fold; `progress` is called once a fold.
///
/// # Errors
/// [`BuildError`] where the remaining clips make no database.
pub fn run(
    experiment: &Experiment,
    methods: &Methods,
    progress: &(dyn Fn() + Sync),
) -> Result<Vec<Row>, BuildError> {
    let (body, folds) = experiment.folds()?;
    run_folds(experiment, &body, &folds, methods, progress)
}

/// Runs every method on some folds.
pub(super) fn run_folds(
    experiment: &Experiment,
    body: &Body,
    folds: &[HeldOut],
    methods: &Methods,
    progress: &(dyn Fn() + Sync),
) -> Result<Vec<Row>, BuildError> {
    let options = if methods.baselines { experiment.build_with_models() } else { experiment.build.clone() };
    let paper = |corpus: &Corpus| {
        methods.baselines.then(|| hsu::Models::of(corpus, &options, &experiment.to)).transpose()
    };
    let rows = each_with(experiment, folds, &options, paper, |held, database, paper| {
        let rows = fold(experiment, body, held, methods, (database, paper.as_ref()));
        progress();
        rows
    })?;
    Ok(rows.into_iter().flatten().collect())
}

fn fold(
    experiment: &Experiment,
    body: &Body,
    held: HeldOut,
    methods: &Methods,
    (database, paper): (&Database<'_>, Option<&hsu::Models>),
) -> Vec<Row> {
    let fold = Fold::of(experiment, body, held);
    let mut rows = Vec::new();
    if methods.baselines {
        baselines(&fold, database, &mut rows);
        models::rows(&fold, database, &mut rows);
    }
    if let Some(paper) = paper {
        hsu::rows(&fold, database, paper, &mut rows);
    }
    if methods.gaussian_process {
        let settings = gaussian_process::Options::default();
        for &outputs in Outputs::each(database) {
            let process =
                |labelled| growth::gaussian(&fold, database, &settings, labelled, outputs).map(|g| g.0);
            rows.extend(process(true));
            // Of one action both are the same.
            if experiment.corpus.actions.len() > 1 {
                rows.extend(process(false));
            }
        }
    }
    for (name, config) in &methods.configs {
        let compared = name == "mixture" && methods.baselines;
        for condition in CONDITIONS.iter().filter(|c| methods.partly_labelled || c.1 == c.2) {
            mixture(&fold, database, name, config, *condition, compared, &mut rows);
        }
    }
    for method in &methods.outside {
        let row = |output: &Output| fold.outside_row(&method.name, &output.clip, output.steps_s.as_deref());
        rows.extend(method.output(held).map(row));
    }
    let floor = fold.other_clip().map(|other| fold.row("other-clip", &other, None).delivered.error_cm);
    rows.iter_mut().for_each(|row| row.floor_cm = floor);
    rows
}

/// What is known of the input: an ending of the method's name, whether the action is, whether the style is.
type Condition = (&'static str, bool, bool);

const CONDITIONS: [Condition; 4] = [
    ("", false, false),
    ("-action-known", true, false),
    ("-style-known", false, true),
    ("-labelled", true, true),
];

/// The row of a configuration under a condition; and of interpolation of its neighbors, where they are to be compared.
fn mixture(
    fold: &Fold<'_>,
    database: &Database<'_>,
    name: &str,
    config: &Config,
    (suffix, action, style): Condition,
    compared: bool,
    rows: &mut Vec<Row>,
) {
    let example = &fold.corpus.examples[fold.test];
    let (action, input_style) =
        (action.then_some(example.action as u16), style.then_some(example.style as u16));
    let method =
        if suffix == "-labelled" { name.replace("mixture", "local-ar") } else { format!("{name}{suffix}") };
    let request = Request { config: *config, action, input_style, ..Request::style(fold.style as u16) };
    let Ok((record, streamed)) = Record::of_stream(database, &example.clip, &request) else { return };
    let predicted = own_dofs(fold, database, &record.predicted);
    rows.push(fold.row(&method, &predicted, Some(&streamed)));
    if compared {
        neighbors(fold, database, &record, suffix, rows);
    }
}

fn baselines(fold: &Fold<'_>, database: &Database<'_>, rows: &mut Vec<Row>) {
    rows.push(fold.row("unchanged", &fold.x, None));
    if let Some(other) = fold.other_clip() {
        rows.push(fold.row("other-clip", &other, None));
    }
    let example = &fold.corpus.examples[fold.test];
    let Some(class) = class_of(database, example.action, example.style) else { return };
    // The models live in the database's dofs.
    let x = fold.body.with_means_of(database).clip_dofs(&example.clip);
    let own = [class];
    let all = classes_of(database, example.style);
    for &(outputs, ending) in Outputs::each(database) {
        let fit = |classes: &[usize], variables: Variables| {
            GlobalModel::fit(database, classes, fold.style, variables, outputs)
        };
        let affine = fit(&own, Variables::Affine);
        let first = affine.run(&x[..1], &x[0]);
        let mut models = vec![("global-ar", fit(&own, Variables::Autoregressive)), ("global-affine", affine)];
        // Of one action both are the same.
        if fold.corpus.actions.len() > 1 {
            models.push(("global-affine-unlabelled", fit(&all, Variables::Affine)));
        }
        for (name, model) in models {
            let predicted = own_dofs(fold, database, &model.run(&x, &first[0]));
            rows.push(fold.row(&format!("{name}{ending}"), &predicted, None));
        }
    }
}

/// Interpolation of the neighbors that were found: of the labelled class, or of all together.
fn neighbors(fold: &Fold<'_>, database: &Database<'_>, record: &Record, suffix: &str, rows: &mut Vec<Row>) {
    let most = usize::from(Config::new().k);
    let ways: &[(&str, usize)] = match suffix {
        "-labelled" => &[("nearest", 1), ("knn", most)],
        // Of one action both are the same.
        "" if fold.corpus.actions.len() > 1 => &[("knn-unlabelled", most)],
        _ => &[],
    };
    for (&(name, most), &(outputs, ending)) in
        ways.iter().flat_map(|way| Outputs::each(database).iter().map(move |outputs| (way, outputs)))
    {
        let of = |classes: &[ClassNeighbors]| {
            interpolated(database, &classes.iter().collect::<Vec<_>>(), most, fold.style, outputs)
        };
        rows.push(fold.row(&format!("{name}{ending}"), &own_dofs(fold, database, &record.each(of)), None));
    }
}
