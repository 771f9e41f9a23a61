//! Fits the unit costs of `gestus_database::parts::cost` to the counts of emulated boards, and prints their errors.
//!
//! `cargo run --release -p gestus-firmware-sim --example calibrate -- DB.gestus CLIP.bvh ACTION INPUT_STYLE STYLE
//! [BOARD...]`
//!
//! `generated [BOARD]` in place of the database and clip streams generated motion, and motion that leaps every few
//! frames. It also prints, for each stage, the largest ratio of counted to modelled instructions, for
//! `Calibration::worst`.
//!
//! `m0` alone streams generated motion that fits that board, and prints its instructions relative to those modelled for
//! Armv6-M.
//!
//! The clip is streamed without labels, with its action, with action and style, and with 40 neighbors, then by the
//! other methods, which stream generated motion too. Two frames in three are fitted, the third is predicted.

use std::path::Path;

use anyhow::{Context, Result, bail};
use gestus_core::{Config, Database, Method, Stage};
use gestus_database::{
    command_line::blob,
    parts::{
        calibration::Isa,
        cost::{STAGE_OF, TERMS, UnitCosts, Units, units},
    },
    stream::{Request, input::Input},
};
use gestus_firmware_sim::board::{
    boards, generated, image,
    measure::{Job, measure},
};
use gestus_motion::clip::Clip;
use nalgebra::{DMatrix, DVector};

const FRAMES: usize = 45;

/// A frame: its units of work, and its instructions by stage.
struct Sample {
    units: Units,
    stages: Vec<f64>,
}

fn main() -> Result<()> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    if arguments == ["m0"] {
        return compare_m0();
    }
    if arguments.first().is_some_and(|a| a == "generated") {
        return worst(boards::find(arguments.get(1).map_or("m4f", String::as_str))?);
    }
    let [db, clip, action, input_style, style, names @ ..] = &arguments[..] else {
        bail!("give m0, or DB.gestus CLIP.bvh ACTION INPUT_STYLE STYLE [BOARD...]");
    };
    let db = Path::new(db);
    let bytes = blob::read(db)?;
    let database = blob::open(db, &bytes)?;
    let mut clip = Input::read(Path::new(clip), &database)?.mapped;
    clip.frames.truncate(FRAMES);
    let manifest = database.manifest()?;
    let find = |names: gestus_core::blob::Names<'_>, name: &str| {
        names.find(name).with_context(|| format!("the database has no `{name}`"))
    };
    let (action, input_style) = (find(manifest.actions, action)?, find(manifest.styles, input_style)?);
    let base = Request::style(find(manifest.styles, style)?);
    let mut requests = vec![
        base.clone(),
        Request { action: Some(action), ..base.clone() },
        Request { action: Some(action), input_style: Some(input_style), ..base.clone() },
        Request { config: Config::new().k(40), ..base.clone() },
    ];
    requests.extend(other_methods(&base, Request { action: Some(action), ..base.clone() }));
    // Bytes of models, joints and knots hardly differ within one database, so a second one tells them apart.
    let (generated_path, mut generated_clip) =
        (generated::REFERENCE.database()?, generated::REFERENCE.clip(12.0)?);
    let generated_bytes = blob::read(&generated_path)?;
    let generated = blob::open(&generated_path, &generated_bytes)?;
    generated_clip.frames.truncate(FRAMES);
    let of_generated = other_methods(&Request::style(1), Request { action: Some(0), ..Request::style(1) });
    let all: Vec<String> = ["m4f", "rv32imafc", "rv32imac", "armv6m"].map(str::to_owned).to_vec();
    for name in if names.is_empty() { &all[..] } else { names } {
        let board = boards::find(name)?;
        let mut samples = count(board, db, database, &clip, &requests)?;
        samples.extend(count(board, &generated_path, generated, &generated_clip, &of_generated)?);
        report(name, &samples);
    }
    Ok(())
}

/// The frames of a clip on a board, request by request.
fn count(
    board: &'static boards::Board,
    path: &Path,
    database: Database<'_>,
    clip: &Clip,
    requests: &[Request],
) -> Result<Vec<Sample>> {
    let image = image::build(board, image::Options { blob: Some(path), ..image::Options::default() })?;
    let mut samples = Vec::new();
    for request in requests {
        let measured = measure(board, &image, Job { path, database, clip, request, robot: None }, || ())?;
        for (step, stages) in measured.linked.streamed.steps.iter().zip(&measured.linked.stages) {
            let units = units(&database, request, &step.report);
            samples.push(Sample { units, stages: stages.iter().map(|&s| f64::from(s)).collect() });
        }
    }
    Ok(samples)
}

/// The other methods, each with one and with two output styles, and with a label.
fn other_methods(base: &Request, labelled: Request) -> Vec<Request> {
    let two = Request { style: vec![(base.style[0].0, 0.5), (base.style[0].0 + 1, 0.5)], ..base.clone() };
    let methods = [Method::Phase, Method::Lti, Method::Statistic].map(|method| {
        [base, &two, &labelled].map(|r| Request { config: r.config.method(method), ..r.clone() })
    });
    methods.into_iter().flatten().collect()
}

/// Prints the largest ratios of counted to modelled instructions on worst-case streams.
fn worst(board: &'static boards::Board) -> Result<()> {
    let path = generated::REFERENCE.database()?;
    let bytes = blob::read(&path)?;
    let database = blob::open(&path, &bytes)?;
    let image = image::build(board, image::Options { blob: Some(&path), ..image::Options::default() })?;
    let base = Request::style(1);
    let requests = [
        base.clone(),
        Request { action: Some(0), ..base.clone() },
        Request { config: Config::new().k(40).visits(160), ..base.clone() },
    ];
    let requests =
        [&requests[..], &other_methods(&base, Request { action: Some(0), ..base.clone() })].concat();
    let unit_costs = Isa::Armv7MFpu.calibration().unit_costs;
    let mut ratios = [0.0f64; Stage::NAMES.len()];
    let (mut samples, mut visits) = (Vec::new(), 0);
    for mut clip in [generated::REFERENCE.clip(12.0)?, generated::REFERENCE.leaping(12.0)?] {
        clip.frames.truncate(2 * FRAMES);
        for request in &requests {
            let job = Job { path: &path, database, clip: &clip, request, robot: None };
            let measured = measure(board, &image, job, || ())?;
            for (step, stages) in measured.linked.streamed.steps.iter().zip(&measured.linked.stages) {
                // The first frame unpacks the nearest class twice, which its report does not count.
                let units = units(&database, request, &step.report);
                if request.config.method == Method::Mar && samples.len() % clip.frames.len() > 0 {
                    for ((ratio, &counted), modelled) in
                        ratios.iter_mut().zip(stages).zip(unit_costs.stages(&units))
                    {
                        *ratio = ratio.max(f64::from(counted) / modelled.max(1.0));
                    }
                }
                visits = visits.max(step.report.visits);
                samples.push(Sample { units, stages: stages.iter().map(|&s| f64::from(s)).collect() });
            }
        }
    }
    report(board.name, &samples);
    println!("{visits} visits at most; worst: Some({:.2?})", ratios.map(|r| r * 1.05));
    Ok(())
}

/// Prints the instructions of a Cortex-M0 relative to those modelled for Armv6-M.
fn compare_m0() -> Result<()> {
    let board = boards::find("m0")?;
    let path = generated::SMALL.database()?;
    let bytes = blob::read(&path)?;
    let database = blob::open(&path, &bytes)?;
    let clip = generated::SMALL.clip(2.0)?;
    let request = Request::style(1);
    let unit_costs = Isa::Armv6M.calibration().unit_costs;
    let (mut factors, mut by_stage) = (Vec::new(), [[0.0; 2]; Stage::NAMES.len()]);
    for Sample { units, stages } in count(board, &path, database, &clip, &[request])? {
        let modelled = unit_costs.stages(&units);
        for ((sums, counted), modelled) in by_stage.iter_mut().zip(&stages).zip(modelled) {
            sums[0] += counted;
            sums[1] += modelled;
        }
        factors.push(stages.iter().sum::<f64>() / modelled.iter().sum::<f64>());
    }
    factors.sort_by(f64::total_cmp);
    let quantile = |q: f64| factors[((factors.len() - 1) as f64 * q) as usize];
    println!(
        "m0, counted over modelled: {:.2} (nine frames in ten {:.2} to {:.2})",
        quantile(0.5),
        quantile(0.05),
        quantile(0.95)
    );
    for (name, [counted, modelled]) in Stage::NAMES.iter().zip(by_stage) {
        println!("  {name:<12} {:.2}", counted / modelled);
    }
    Ok(())
}

fn report(name: &str, samples: &[Sample]) {
    let (fitted, held): (Vec<_>, Vec<_>) = samples.iter().enumerate().partition(|(i, _)| i % 3 != 0);
    let unit_costs = fit(&fitted);
    println!("{name}: UnitCosts({:.4?})", unit_costs.0);
    for stage in Stage::ALL {
        let at = stage as usize;
        let error = relative(held.iter().map(|(_, s)| (unit_costs.stages(&s.units)[at], s.stages[at])));
        println!(
            "  {:<12} error median {:.1}%, 90% {:.1}%, worst {:.1}%",
            Stage::NAMES[at],
            error[0],
            error[1],
            error[2]
        );
    }
    let totals = |s: &Sample| (unit_costs.total(&s.units), s.stages.iter().sum());
    let error = relative(held.iter().map(|(_, s)| totals(s)));
    println!("  {:<12} error median {:.1}%, 90% {:.1}%, worst {:.1}%", "total", error[0], error[1], error[2]);
    for run in samples.chunks(FRAMES) {
        let mut totals: Vec<(f64, f64)> = run.iter().map(totals).collect();
        totals.sort_by(|a, b| a.1.total_cmp(&b.1));
        let (model, measured) = totals[totals.len() / 2];
        println!("  median frame of a run: {measured:.0} measured, {model:.0} modelled");
    }
}

/// Least squares, stage by stage. Terms with a negative solution are removed.
fn fit(samples: &[(usize, &Sample)]) -> UnitCosts {
    let mut costs = [0.0; TERMS];
    for stage in Stage::ALL {
        let mut terms: Vec<usize> = (0..TERMS).filter(|&t| STAGE_OF[t] == stage).collect();
        let right = DVector::from_fn(samples.len(), |row, _| samples[row].1.stages[stage as usize]);
        loop {
            let unit = |row: usize, column: usize| samples[row].1.units[terms[column]];
            let matrix = DMatrix::from_fn(samples.len(), terms.len(), unit);
            let Ok(solution) = matrix.svd(true, true).solve(&right, 1e-9) else { break };
            if let Some(negative) = solution.iter().position(|&cost| cost < 0.0) {
                terms.remove(negative);
                continue;
            }
            for (&term, &cost) in terms.iter().zip(solution.iter()) {
                costs[term] = cost;
            }
            break;
        }
    }
    UnitCosts(costs)
}

/// Median, 90th percentile and maximum of the relative error, percent.
fn relative(pairs: impl Iterator<Item = (f64, f64)>) -> [f64; 3] {
    // A method has no terms in some stages.
    let pairs = pairs.filter(|(model, _)| *model > 0.0);
    let mut errors: Vec<f64> =
        pairs.map(|(model, measured)| 100.0 * (model / measured.max(1.0) - 1.0).abs()).collect();
    errors.sort_by(f64::total_cmp);
    [0.5, 0.9, 1.0].map(|q| {
        let at = ((errors.len() as f64 * q) as usize).min(errors.len().saturating_sub(1));
        errors.get(at).copied().unwrap_or(0.0)
    })
}
