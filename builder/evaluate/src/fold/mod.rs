//! A fold: a test clip, the clip that is its truth, and the database without either.

mod row;

use std::collections::BTreeSet;

use gestus_core::{Database, Degraded};
use gestus_database::{
    build::{BuildError, BuildOptions, Built, build},
    command_line::{outputs::note, progress},
    stream::{Step, Streamed},
};
use gestus_motion::{
    body::{Body, first_dof, log, row_at},
    clip::Clip,
    corpus::{Corpus, Cycle},
    statistics::mean,
};
use rayon::prelude::*;

use crate::{
    experiment::{Experiment, HeldOut, Truth},
    metrics::{
        best_shift,
        figures::{Figures, Reference},
        matched,
    },
};
pub use row::Row;

/// A test clip and the clip that it is compared with.
pub(crate) struct Fold<'a> {
    pub(crate) corpus: &'a Corpus,
    pub(crate) body: Body,
    pub(crate) test: usize,
    pub(crate) truth: usize,
    pub(crate) other: Option<usize>,
    pub(crate) style: usize,
    pub(crate) shift: usize,
    pub(crate) x: Vec<Vec<f64>>,
    pub(crate) truth_rows: Vec<Vec<f64>>,
    reference: Reference,
}

/// Runs a measure on every fold, with the database that lacks its clips; folds may share one
/// ([`Experiment::sharing`]). `what` names the measure where progress is shown.
///
/// # Errors
/// Where the remaining clips make no database.
pub(crate) fn each<T: Send>(
    what: &str,
    experiment: &Experiment,
    folds: &[HeldOut],
    options: &BuildOptions,
    of: impl Fn(HeldOut, &Database<'_>) -> T + Sync,
) -> Result<Vec<T>, BuildError> {
    let bar = progress::bar(folds.len(), what);
    let all = each_with(
        experiment,
        folds,
        options,
        |_| Ok(()),
        |held, database, ()| {
            let found = of(held, database);
            bar.inc(1);
            found
        },
    );
    bar.finish_and_clear();
    all
}

/// The same without progress, with what else is made of the clips that a database is built from.
///
/// # Errors
/// Those of [`each`].
pub(crate) fn each_with<T: Send, P: Sync>(
    experiment: &Experiment,
    folds: &[HeldOut],
    options: &BuildOptions,
    prepare: impl Fn(&Corpus) -> Result<P, BuildError> + Sync,
    of: impl Fn(HeldOut, &Database<'_>, &P) -> T + Sync,
) -> Result<Vec<T>, BuildError> {
    let groups: Vec<(Vec<T>, Vec<String>)> = experiment
        .sharing(folds)
        .par_iter()
        .map(|group| {
            let left_out: Vec<usize> = group.iter().flat_map(|f| [f.test, f.truth]).collect();
            let corpus = experiment.corpus.without(&left_out);
            let Built { bytes, notes, .. } = build(&corpus, options)?;
            let database = Database::open(&bytes)?;
            let prepared = prepare(&corpus)?;
            Ok((group.par_iter().map(|&held| of(held, &database, &prepared)).collect(), notes))
        })
        .collect::<Result<_, BuildError>>()?;
    let (found, notes): (Vec<_>, Vec<_>) = groups.into_iter().unzip();
    // What a fold lacks has no rows.
    for about in notes.into_iter().flatten().collect::<BTreeSet<_>>() {
        note(format_args!("without the test clips: {about}"));
    }
    Ok(found.into_iter().flatten().collect())
}

impl<'a> Fold<'a> {
    /// A fold, and the database that is built from all other clips.
    pub(crate) fn new(
        experiment: &'a Experiment,
        body: &Body,
        held: HeldOut,
        build_options: &BuildOptions,
    ) -> Result<(Self, Vec<u8>), BuildError> {
        let built = build(&experiment.corpus.without(&[held.test, held.truth]), build_options)?;
        Ok((Self::of(experiment, body, held), built.bytes))
    }

    /// A fold without its database.
    pub(crate) fn of(experiment: &'a Experiment, body: &Body, held: HeldOut) -> Self {
        let corpus = &experiment.corpus;
        let HeldOut { test, truth, other, style } = held;
        let (x, truth_rows) =
            (body.clip_dofs(&corpus.examples[test].clip), body.clip_dofs(&corpus.examples[truth].clip));
        let shift = match experiment.truth {
            Truth::SameTake => 0,
            Truth::NearestContent => {
                best_shift(&x, &corpus.examples[test].cycles, &truth_rows, &corpus.examples[truth].cycles)
            }
        };
        let reference = Reference::of(corpus, body, [test, truth], &truth_rows, shift);
        let body = body.clone();
        Self { corpus, body, test, truth, other, style, shift, x, truth_rows, reference }
    }

    /// Which feet of the truth stand at the moments that match the test clip's frames; none outside of cycles. Shape
    /// `[frames]`.
    pub(crate) fn counterpart_stands(&self) -> &[[bool; 2]] {
        &self.reference.stands
    }

    /// Another real clip of the output style at the moments that match the test clip's frames, if there is one; where none
    /// matches, its first frame.
    pub(crate) fn other_clip(&self) -> Option<Vec<Vec<f64>>> {
        let example = &self.corpus.examples[self.other?];
        let rows = self.body.clip_dofs(&example.clip);
        let cycles = self.cycles().0;
        let shift = best_shift(&self.x, cycles, &rows, &example.cycles);
        let at = |t: usize| matched(cycles, t, &example.cycles, shift);
        Some((0..self.x.len()).map(|t| at(t).map_or_else(|| rows[0].clone(), |p| row_at(&rows, p))).collect())
    }

    /// The truth's frame at each frame of the test clip; none outside of cycles. Shape `[frames]`.
    pub(crate) fn matches(&self) -> &[Option<f64>] {
        &self.reference.at
    }

    /// The figures of a method from outside, which delivers what it predicts.
    pub(crate) fn outside_row(&self, method: &str, clip: &Clip, steps_s: Option<&[f64]>) -> Row {
        let figures = self.reference.figures(&self.reference.given(clip, steps_s));
        self.with_figures(method, [figures; 2], None)
    }

    /// Seconds in the truth clip from the match of each frame's predecessor to that of the frame, where both have one.
    pub(crate) fn true_steps(&self) -> Vec<Option<f64>> {
        let (cycles, truth_cycles) = self.cycles();
        let at = |t: usize| matched(cycles, t, truth_cycles, self.shift);
        (0..self.x.len())
            .map(|t| {
                let (now, before) = (at(t)?, at(t.checked_sub(1)?)?);
                (now > before).then_some((now - before) / self.corpus.rate_hz)
            })
            .collect()
    }

    pub(crate) fn cycles(&self) -> (&[Cycle], &[Cycle]) {
        (&self.corpus.examples[self.test].cycles, &self.corpus.examples[self.truth].cycles)
    }

    /// The figures of a method's output, one pose a frame of the test clip.
    pub(crate) fn row(&self, method: &str, output: &[Vec<f64>], streamed: Option<&Streamed>) -> Row {
        let steps_s =
            streamed.map(|s| s.steps.iter().map(|s| f64::from(s.report.predicted_step_s)).collect());
        self.measured(method, output, steps_s, streamed)
    }

    /// The same of a method outside the core that says how long each step takes, seconds.
    pub(crate) fn timed_row(&self, method: &str, output: &[Vec<f64>], steps_s: Vec<f64>) -> Row {
        self.measured(method, output, Some(steps_s), None)
    }

    fn measured(
        &self,
        method: &str,
        output: &[Vec<f64>],
        steps_s: Option<Vec<f64>>,
        streamed: Option<&Streamed>,
    ) -> Row {
        let reference = &self.reference;
        let predicted = reference.figures(&reference.predicted(output, steps_s));
        let delivered = streamed.map_or(predicted, |s| reference.figures(&reference.delivered(s)));
        self.with_figures(method, [predicted, delivered], streamed)
    }

    fn with_figures(
        &self,
        method: &str,
        [predicted, delivered]: [Figures; 2],
        streamed: Option<&Streamed>,
    ) -> Row {
        let example = &self.corpus.examples[self.test];
        Row {
            method: method.to_owned(),
            action: example.action,
            style: self.style,
            clip: example.clip.name.clone(),
            truth: self.corpus.examples[self.truth].clip.name.clone(),
            predicted,
            delivered,
            contact_f1: streamed.and_then(|s| self.reference.contact_f1(s)),
            far: streamed.map(far),
            floor_cm: None,
        }
    }
}

/// Share of the frames in which the report says that the input is unlike the database.
pub(crate) fn far(streamed: &Streamed) -> f64 {
    let said = |s: &Step| f64::from(u8::from(s.report.degraded.contains(Degraded::FAR)));
    mean(streamed.steps.iter().map(said))
}

/// Dofs relative to the database's means as dofs relative to the evaluation's.
pub(crate) fn own_dofs(fold: &Fold<'_>, database: &Database<'_>, rows: &[Vec<f64>]) -> Vec<Vec<f64>> {
    let theirs = fold.body.with_means_of(database);
    rows.iter()
        .map(|row| {
            let frame = theirs.pose(row, [0.0; 2], 0.0);
            let mut own = row.clone();
            for j in 0..frame.rotations.len() {
                let map = log(&(fold.body.means[j].inverse() * frame.rotations[j]));
                let at = first_dof(j);
                own[at..at + 3].copy_from_slice(map.as_slice());
            }
            own
        })
        .collect()
}

/// The classes of a style, of whatever action.
pub(crate) fn classes_of(database: &Database<'_>, style: usize) -> Vec<usize> {
    database.classes().enumerate().filter(|(_, c)| usize::from(c.style) == style).map(|c| c.0).collect()
}

pub(crate) fn class_of(database: &Database<'_>, action: usize, style: usize) -> Option<usize> {
    database.classes().position(|c| usize::from(c.action) == action && usize::from(c.style) == style)
}

#[cfg(test)]
mod tests {
    use gestus_core::Config;
    use gestus_database::{registration::contact, stream::Request};

    use super::*;
    use crate::{
        baselines::outputs::Record,
        metrics::{feet, performance::Performance},
    };

    fn walks() -> Experiment {
        Experiment::generated(&["walk"], &["neutral", "proud"], 3, 5.0)
    }

    #[test]
    fn the_truth_itself_has_no_error_and_every_ratio_is_one() {
        let experiment = walks();
        let body = Body::of(&experiment.corpus).unwrap();
        let held = HeldOut { test: 0, truth: 0, other: None, style: 0 };
        let fold = Fold::of(&experiment, &body, held);
        let found = fold.row("truth", &fold.x, None).delivered;
        let real = Performance::of_clip(&experiment.corpus.examples[0].clip, &body);
        let legs = contact::legs(&[&experiment.corpus.examples[0]], &body.landmarks);
        let skate = feet::skate_cm_s(&body.skeleton, &legs, &real);
        assert!(found.error_cm < 1e-9, "{found:?}");
        for ratio in [Some(found.third_difference), found.amplitude, found.variability, found.speed] {
            assert!((ratio.unwrap() - 1.0).abs() < 1e-3, "{found:?}");
        }
        // Its own contacts, where cycles are; and a way made of velocities is the clip's own.
        assert!((found.skate_counterpart_cm_s - skate).abs() < 0.5, "{found:?} {skate}");
        assert!(found.duration.is_none() && found.skate_stillest_cm_s < 6.0, "{found:?}");
    }

    #[test]
    fn delivered_figures_are_those_of_the_poses_that_leave() {
        let experiment = walks();
        let body = Body::of(&experiment.corpus).unwrap();
        let (folds, _) = experiment.held_out(&body);
        let held = folds[0];
        let left_out = experiment.corpus.without(&[held.test, held.truth]);
        let bytes = build(&left_out, &experiment.build).unwrap().bytes;
        let database = Database::open(&bytes).unwrap();
        let fold = Fold::of(&experiment, &body, held);
        let run = |config: Config, strength: f32| {
            let groups = database.counts().groups as u16;
            let strength = (0..groups).map(|group| (group, strength)).collect();
            let request = Request { config, strength, ..Request::style(held.style as u16) };
            let clip = &experiment.corpus.examples[held.test].clip;
            let (record, streamed) = Record::of_stream(&database, clip, &request).unwrap();
            fold.row("mixture", &own_dofs(&fold, &database, &record.predicted), Some(&streamed))
        };
        let plain = Config::new().contacts(false).speed_limit(0.0).liveliness(0.0).settle_s(0.0);
        let (bare, locked, none) = (run(plain, 1.0), run(Config::new(), 1.0), run(plain, 0.0));
        // Without lock, limit and corrections the prediction leaves as it is.
        assert!((bare.delivered.error_cm - bare.predicted.error_cm).abs() < 0.02, "{bare:?}");
        assert!((bare.delivered.speed.unwrap() - bare.predicted.speed.unwrap()).abs() < 0.01, "{bare:?}");
        // The lock is in what is delivered alone.
        assert!(
            locked.delivered.skate_counterpart_cm_s < 0.5 * locked.predicted.skate_counterpart_cm_s,
            "{locked:?}"
        );
        assert!((locked.predicted.error_cm - bare.predicted.error_cm).abs() < 1e-6, "{locked:?}");
        // At strength 0 the input leaves; strength is part of what the core calls its prediction.
        let unchanged = fold.row("unchanged", &fold.x, None);
        assert!(
            (none.delivered.error_cm - unchanged.delivered.error_cm).abs() < 0.01,
            "{none:?} {unchanged:?}"
        );
        assert!((none.predicted.error_cm - none.delivered.error_cm).abs() < 0.01, "{none:?}");
    }
}
