//! All that is learned from a library: Efforts of its fragments, labelled blends, and the function between them.

use gestus_core::Database;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;

use crate::effort::{
    ALPHA, Factors, Source,
    align::{THRESHOLD_RAD, distance},
    blend::Pair,
    components::Components,
    estimate::Estimator,
    example::{Example, Known},
    fragment::{Library, Span},
    labels::{LabelError, Row},
    learn::{Learner, Method},
};
use gestus_motion::landmarks::LandmarkError;

/// Blends that are drawn, as in Torresani 2006, section 8.
pub const BLENDS: usize = 105;
/// Seed of the blends that are drawn by default.
const SEED: u64 = 2006;
/// Fewest labelled blends to learn from.
pub const MIN_BLENDS: usize = 20;

/// A drawn blend: two fragments and α.
pub type Draw = (usize, usize, f64);

/// A library with its Efforts.
#[derive(Debug, Clone)]
pub struct Model {
    /// The fragments.
    pub library: Library,
    /// Where the Efforts come from.
    pub source: Source,
    /// Components and Efforts of the fragments.
    pub known: Known,
    /// The labelled blends.
    pub examples: Vec<Example>,
    /// What was learned from them, by kernel ridge regression.
    pub learner: Learner,
}

/// Draws blends of fragments of one action and content: two clips or styles, α uniform over its range. Fewer come out
/// where few fragments match.
pub fn draw(library: &Library, count: usize, seed: u64) -> Vec<Draw> {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let fragments = &library.fragments;
    let mut draws = Vec::new();
    if fragments.len() < 2 {
        return draws;
    }
    for _ in 0..60 * count {
        if draws.len() == count {
            break;
        }
        let (i, j) = (rng.random_range(0..fragments.len()), rng.random_range(0..fragments.len()));
        let alpha = rng.random_range(ALPHA.0..ALPHA.1);
        // Another style where there is one: two walks of one person hardly differ.
        let differ = library.styles.len() < 2 || fragments[i].style != fragments[j].style;
        // Actions with different names are different content, however near their poses are.
        let differ = differ && fragments[i].action == fragments[j].action;
        if i != j && differ && distance(&fragments[i].content, &fragments[j].content) < THRESHOLD_RAD {
            draws.push((i, j, alpha));
        }
    }
    draws
}

/// Efforts of rows of dofs of an action; `None` where they can't be rated.
pub type Observer = dyn Fn(&[Vec<f64>], usize) -> Option<Factors> + Sync;

impl Model {
    /// A model whose Efforts an observer gives: a function of the rows of a fragment or blend and of its action.
    pub fn observed(library: Library, source: Source, draws: &[Draw], observer: &Observer) -> Self {
        let efforts: Vec<Factors> =
            library.fragments.par_iter().map(|f| observer(&f.rows, f.action).unwrap_or_default()).collect();
        let examples: Vec<Example> = draws
            .par_iter()
            .filter_map(|&(first, second, alpha)| {
                let (a, b) = (&library.fragments[first], &library.fragments[second]);
                let effort = observer(&Pair::new(a, b).blend(alpha), a.action)?;
                Some(Example { first, second, alpha, effort })
            })
            .collect();
        Self::of(library, source, efforts, examples)
    }

    /// A model with estimated Efforts.
    pub fn estimated(library: Library, draws: &[Draw]) -> Self {
        let estimator = Estimator::of(&library);
        let (body, rate_hz) = (library.body.clone(), library.rate_hz);
        Self::observed(library, Source::Estimated, draws, &move |rows, action| {
            estimator.estimate(&body, rows, rate_hz, Some(action))
        })
    }

    /// A model with estimated Efforts of the cycles that a database holds.
    ///
    /// # Errors
    /// [`LandmarkError`] where the skeleton has no legs.
    pub fn of_database(database: &Database<'_>) -> Result<Self, LandmarkError> {
        let library = Library::of_database(database)?;
        let draws = draw(&library, BLENDS, SEED);
        Ok(Self::estimated(library, &draws))
    }

    /// A model of a table that people have filled in. Rows without labels are passed over; so are blends of fragments
    /// without.
    ///
    /// # Errors
    /// [`LabelError`] where too few are filled in, or the clips are not the library's. `file` is named in messages;
    /// `library` gives the fragments that are marked, of a corpus or a database.
    pub fn given(
        rows: &[Row],
        file: &str,
        library: impl FnOnce(&[Span]) -> Result<Library, LandmarkError>,
    ) -> Result<Self, LabelError> {
        let seeds: Vec<(&Span, Factors)> =
            rows.iter().filter(|r| r.second.is_none()).filter_map(|r| Some((&r.first, r.effort?))).collect();
        let few = |what, have, need| LabelError::Few { file: file.to_owned(), what, have, need };
        if seeds.len() < 2 {
            return Err(few("fragments", seeds.len(), 2));
        }
        let spans: Vec<Span> = seeds.iter().map(|s| s.0.clone()).collect();
        let clips = || LabelError::Clips { file: file.to_owned() };
        let library = library(&spans)?;
        if library.fragments.is_empty() {
            return Err(clips());
        }
        let efforts: Vec<Factors> = library
            .fragments
            .iter()
            .map(|f| seeds.iter().find(|s| s.0.begins_with(&f.span)).map_or([0.0; 3], |s| s.1))
            .collect();
        let find = |span: &Span| library.fragments.iter().position(|f| f.span.begins_with(span));
        let examples: Vec<Example> = rows
            .iter()
            .filter_map(|row| {
                let (second, alpha) = row.second.as_ref()?;
                let (first, second) = (find(&row.first)?, find(second)?);
                Some(Example { first, second, alpha: *alpha, effort: row.effort? })
            })
            .collect();
        if examples.len() < MIN_BLENDS {
            return Err(few("blends", examples.len(), MIN_BLENDS));
        }
        Ok(Self::of(library, Source::Given, efforts, examples))
    }

    fn of(library: Library, source: Source, efforts: Vec<Factors>, examples: Vec<Example>) -> Self {
        let components = Components::of(&library.fragments);
        let known = Known {
            components: library.fragments.iter().map(|f| components.coefficients(f)).collect(),
            efforts,
        };
        // Without blends to learn from there is interpolation.
        let method =
            if examples.len() < MIN_BLENDS { Method::LinearInterpolation } else { Method::PairKernelRidge };
        let learner = Learner::fit(method, &known, &examples);
        Self { library, source, known, examples, learner }
    }

    /// The Effort that a blend is expected to have.
    pub fn predict(&self, first: usize, second: usize, alpha: f64) -> Factors {
        self.learner.predict(&self.known, first, second, alpha)
    }
}
