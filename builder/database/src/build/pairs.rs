//! Third stage: the outputs of every cycle, and the models estimated from them.

use gestus_motion::corpus::{Corpus, Example};

use super::{
    clips::Clips,
    frames::Frames,
    options::{BuildError, BuildOptions},
};
use crate::{
    models::{
        self, Wanted,
        correspond::{Aligned, Correspondence, Pairs, align},
    },
    pairing::{Pairing, pair},
};

/// The cycles with their outputs, and the sections of the models.
pub(super) struct Paired {
    pub pairing: Pairing,
    pub models: models::Sections,
    /// One line for each model left out.
    pub notes: Vec<String>,
}

impl Paired {
    pub fn new(clips: &Clips<'_>, frames: &Frames<'_>) -> Result<Self, BuildError> {
        let Clips { corpus, options, .. } = clips;
        let pairing = pair(&frames.cycles, &frames.names(), corpus.styles.len(), options.pairing);
        let mut notes = Vec::new();
        let models = match options.models {
            true => sections(clips, frames, &pairing, &mut notes)?,
            false => models::Sections::default(),
        };
        Ok(Self { pairing, models, notes })
    }
}

/// The sections of linear models and statistics.
fn sections(
    clips: &Clips<'_>,
    frames: &Frames<'_>,
    pairing: &Pairing,
    notes: &mut Vec<String>,
) -> Result<models::Sections, BuildError> {
    let Clips { corpus, options, body, examples, dofs, .. } = clips;
    let examples_dofs: Vec<(&Example, &[Vec<f64>])> =
        examples.iter().copied().zip(dofs.iter().map(Vec::as_slice)).collect();
    let correspondence = if options.warp_gaits { Correspondence::Refined } else { Correspondence::Phase };
    let wanted = Wanted {
        from: source_style(corpus, options)?,
        styles: &corpus.styles,
        by_action: options.models_by_action,
        rounds: options.mean_rounds,
    };
    Ok(with_pairs(clips, frames, correspondence, Some(pairing), |pairs| {
        models::sections(body, &examples_dofs, pairs, &wanted, notes)
    }))
}

/// The stretches that a linear model of a style is estimated from. Their input style is [`BuildOptions::from`].
///
/// # Errors
/// [`BuildError`] where the clips make no database.
pub fn stretches(
    corpus: &Corpus,
    options: &BuildOptions,
    style: usize,
    correspondence: Correspondence,
) -> Result<Vec<Aligned>, BuildError> {
    let clips = Clips::new(corpus, options)?;
    let frames = Frames::new(&clips)?;
    let from = source_style(corpus, options)?;
    Ok(with_pairs(&clips, &frames, correspondence, None, |pairs| align(pairs, from, style)))
}

/// Runs on what linear models are estimated from; `pairing` is that of the rows, if it is known.
fn with_pairs<T>(
    clips: &Clips<'_>,
    frames: &Frames<'_>,
    correspondence: Correspondence,
    pairing: Option<&Pairing>,
    of: impl FnOnce(&Pairs<'_>) -> T,
) -> T {
    let Clips { corpus, options, examples, .. } = clips;
    let names = frames.names();
    let contacts: Vec<&[[bool; 2]]> = examples.iter().map(|e| e.contacts.as_slice()).collect();
    // Models are estimated from stretches of several cycles: their outputs have to be continuous.
    let own = options.pairing.of_models();
    let continuing;
    let pairing = match pairing.filter(|_| own == options.pairing) {
        Some(pairing) => pairing,
        None => {
            continuing = pair(&frames.cycles, &names, corpus.styles.len(), own);
            &continuing
        }
    };
    of(&Pairs {
        cycles: &frames.cycles,
        classes: &names,
        contacts: &contacts,
        pairing,
        rate_hz: corpus.rate_hz,
        correspondence,
    })
}

/// The models' input style.
fn source_style(corpus: &Corpus, options: &BuildOptions) -> Result<usize, BuildError> {
    match &options.from {
        Some(from) => corpus.style(from).map_err(BuildError::From),
        None => Ok(corpus.plain_style()),
    }
}
