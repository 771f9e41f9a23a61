//! The methods that need no frames, in the tables of [`crate::measures::loo`]: linear models (Hsu 2005) and statistics of
//! joint quaternions (the paper that is quoted in `docs/ARCHITECTURE.md`, Sources), streamed and over whole clips.
//!
//! | row | is |
//! |---|---|
//! | `lti` | one linear model of all actions, streamed, input unlabelled |
//! | `lti-labelled` | the linear model of the input's action |
//! | `lti-raw` | `lti` without the blend of unexpected input |
//! | `lti-clip` | `lti-raw` over the whole clip, its start extrapolated backwards |
//! | `phase` | phase tables, input unlabelled |
//! | `phase-labelled` | the same, action and style of the input known |
//! | `statistic` | tables of all actions, streamed |
//! | `statistic-labelled` | the tables of the input's action |
//! | `statistic-running` | `statistic` with the input's statistics estimated as it runs, half-life 2 s |
//! | `statistic-clip` | the pipeline of that paper, with one other clip of the style as the reference |
//! | `statistic-euler` | the same with Euler angles |

use gestus_core::{Config, Database, Method};

use crate::{
    baselines::outputs::Record,
    fold::{Fold, Row, own_dofs},
};
use gestus_database::{
    models::{
        lti::{Model, clip},
        statistic::transfer::{self, transfer},
    },
    stream::Request,
};

/// Standard deviations of trust that no input leaves: no blend.
pub(crate) const NO_BLEND: f32 = 1e6;

/// Adds the rows of a fold.
pub(crate) fn rows(fold: &Fold<'_>, database: &Database<'_>, rows: &mut Vec<Row>) {
    let example = &fold.corpus.examples[fold.test];
    let action = Some(example.action as u16);
    let lti = Config::new().method(Method::Lti);
    let statistic = Config::new().method(Method::Statistic);
    let phase = Config::new().method(Method::Phase);
    let own = Some(example.style as u16);
    let streams = [
        ("phase", phase, None, None),
        ("phase-labelled", phase, action, own),
        ("lti", lti, None, None),
        ("lti-labelled", lti, action, None),
        ("lti-raw", lti.confidence(NO_BLEND), None, None),
        ("statistic", statistic, None, None),
        ("statistic-labelled", statistic, action, None),
        ("statistic-running", statistic.halflife_s(2.0), None, None),
    ];
    for (name, config, action, input_style) in streams {
        let request = Request { config, action, input_style, ..Request::style(fold.style as u16) };
        // A database without that section has no such row.
        let Ok((record, streamed)) = Record::of_stream(database, &example.clip, &request) else { continue };
        rows.push(fold.row(name, &own_dofs(fold, database, &record.predicted), Some(&streamed)));
    }
    if let Some(index) = database.linear_model_of(fold.style as u16, None) {
        let model = Model::of(database, index);
        let x = fold.body.with_means_of(database).clip_dofs(&example.clip);
        let before = fold.corpus.rate_hz.round() as usize;
        let out = model.translate(&x, &clip::Options { before, ..clip::Options::default() });
        rows.push(fold.row("lti-clip", &own_dofs(fold, database, &out.rows), None));
    }
    if let Some(other) = fold.other {
        let reference = &fold.corpus.examples[other].clip;
        for (name, euler) in [("statistic-clip", false), ("statistic-euler", true)] {
            let options = transfer::Options { euler, clean_up: false, ..transfer::Options::default() };
            let Ok(out) = transfer(&fold.body, &example.clip, reference, &options) else { continue };
            rows.push(fold.row(name, &fold.body.clip_dofs(&out.clip), None));
        }
    }
}
