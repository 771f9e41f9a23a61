//! A database of a wanted size: the error of the rows, the number of features and the cycles of a class, chosen by what
//! they cost on held-out cycles. Such a database has no graph: the same bytes hold more frames without.

use gestus_core::blob::layout::MAX_FEATURES;

use super::{
    estimated::Estimated,
    held_out::HeldOut,
    index::{Features, Shared},
    options::{BuildError, BuildOptions},
    source::Source,
};

/// Errors of the rows that are tried besides that of the options, centimetres.
const ERRORS_CM: [f64; 2] = [0.2, 0.4];
/// Numbers of features that are tried besides that of the options.
const FEATURES: [usize; 2] = [12, 16];

/// What was chosen for a wanted size.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Choice {
    /// Mean joint error of the stored rows, centimetres.
    pub row_error_cm: f64,
    /// Most components of a feature.
    pub features: usize,
    /// Most cycles of a class; 0 if all are kept.
    pub cycles: usize,
    /// How much larger the error is on held-out cycles than with all cycles, rows as captured and the most features,
    /// percent; `None` where no cycle with a captured output could be held out.
    pub error_cost_percent: Option<f64>,
}

impl Choice {
    /// The options with what was chosen.
    pub(super) fn options(&self, options: &BuildOptions) -> BuildOptions {
        let Self { row_error_cm, features, cycles, .. } = *self;
        BuildOptions { error_cm: row_error_cm, features, cycles, graph: false, ..options.clone() }
    }
}

/// The choice with the least error of those whose file is small enough.
pub(super) fn choose(source: &Source<'_>) -> Result<Choice, BuildError> {
    let options = source.clips.options;
    let held_out = HeldOut::new(source);
    let full = held_out.error_cm(&Features::new(source.clips, MAX_FEATURES), None, usize::MAX);
    let mut errors = ERRORS_CM.to_vec();
    errors.push(options.error_cm);
    let rows: Vec<(f64, Shared)> = errors.into_iter().map(|e| (e, source.shared(e))).collect();
    let mut numbers = FEATURES.to_vec();
    numbers.push(options.features);
    let mut least = usize::MAX;
    let mut best: Option<(f64, Choice)> = None;
    for features in numbers {
        let estimated = Estimated::new(source, features);
        for (row_error_cm, shared) in &rows {
            let cycles = match most_cycles(source, &estimated, shared)? {
                Fit::Cycles(cycles) => cycles,
                Fit::TooLarge(bytes) => {
                    least = least.min(bytes);
                    continue;
                }
            };
            let error = held_out.error_cm(&estimated.features, Some(&shared.steps), cycles);
            if best.is_none_or(|(least, _)| error < least) {
                let cycles = if cycles >= source.choices().most() { 0 } else { cycles };
                let error_cost_percent = Some(100.0 * (error / full - 1.0)).filter(|cost| cost.is_finite());
                best = Some((
                    error,
                    Choice { row_error_cm: *row_error_cm, features, cycles, error_cost_percent },
                ));
            }
        }
    }
    best.map(|(_, choice)| choice).ok_or(BuildError::Size { wanted: options.bytes, least })
}

/// How many cycles of a class have room.
enum Fit {
    Cycles(usize),
    /// Not one: the bytes of a database of one.
    TooLarge(usize),
}

fn most_cycles(source: &Source<'_>, estimated: &Estimated<'_>, shared: &Shared) -> Result<Fit, BuildError> {
    let options = source.clips.options;
    let size = |cycles: usize| -> Result<usize, BuildError> {
        estimated.draft_bytes(&BuildOptions { cycles, ..options.clone() }, shared)
    };
    let smallest = size(1)?;
    if smallest > options.bytes {
        return Ok(Fit::TooLarge(smallest));
    }
    let most = match options.cycles {
        0 => source.choices().most(),
        cycles => cycles.min(source.choices().most()),
    };
    // `low` has room, `high` has none.
    let (mut low, mut high) = (1, most + 1);
    while high - low > 1 {
        let middle = usize::midpoint(low, high);
        if size(middle)? <= options.bytes { low = middle } else { high = middle }
    }
    Ok(Fit::Cycles(low))
}
