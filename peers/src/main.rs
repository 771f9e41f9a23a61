//! `peers`: a table of nearest neighbor libraries at the recall of core, and the same as JSON.

use std::{path::PathBuf, time::Instant};

use anyhow::Result;
use clap::Parser;
use gestus_core::{Database, search::graph::Limits};
use gestus_database::stream::{Request, stream};
use gestus_peers::{
    hnswlib::Hnswlib,
    measure::{Truth, after_jumps, sweep, time, tuned},
    setup::{Setup, Task, export, jumps, points, streams},
};
use serde_json::json;

/// Compares core's graph search with other nearest neighbor libraries.
#[derive(Debug, Parser)]
struct Arguments {
    /// Folder of BVH files.
    #[arg(long)]
    data: PathBuf,
    /// Actions, separated by commas; all if absent.
    #[arg(long, value_delimiter = ',', default_value = "walk,run,walk-turn-left,walk-turn-right")]
    actions: Vec<String>,
    /// Styles, separated by commas; all if absent.
    #[arg(long, value_delimiter = ',')]
    styles: Vec<String>,
    /// Clips whose name ends so are the queries and stay out of the database.
    #[arg(long, default_value = "_007")]
    held_out: String,
    /// Neighbors a class.
    #[arg(long, default_value_t = 40)]
    k: usize,
    /// Pool of core's search.
    #[arg(long, default_value_t = 40)]
    pool: usize,
    /// Most visits of core's search.
    #[arg(long, default_value_t = 320)]
    visits: u16,
    /// A distance this many times the last frame's is a jump.
    #[arg(long, default_value_t = 4.0)]
    jump: f32,
    /// Rounds of timing; the best counts.
    #[arg(long, default_value_t = 5)]
    rounds: usize,
    /// Try core with every pool and bound of visits instead of comparing.
    #[arg(long)]
    sweep: bool,
    /// Pools of the sweep.
    #[arg(long, value_delimiter = ',', default_value = "40,44,48,56,64")]
    pools: Vec<usize>,
    /// Bounds of the visits of the sweep.
    #[arg(long, value_delimiter = ',', default_value = "128,160,192,240,320,448")]
    bounds: Vec<u16>,
    /// Write points and queries as .npy.
    #[arg(long)]
    export: Option<PathBuf>,
    /// Compare hnswlib too, by this Python, on the files of `--export`.
    #[arg(long, requires = "export")]
    hnswlib: Option<PathBuf>,
    /// Print one JSON object and nothing else to standard output.
    #[arg(long)]
    json: bool,
}

fn main() -> Result<()> {
    let arguments = Arguments::parse();
    let task = Task {
        data: arguments.data.clone(),
        actions: arguments.actions.clone(),
        styles: arguments.styles.clone(),
        held_out: arguments.held_out.clone(),
    };
    let start = Instant::now();
    let setup = Setup::new(&task)?;
    let database = Database::open(&setup.bytes)?;
    let classes = points(&database, arguments.k);
    let streams = streams(&database, &setup.clips);
    eprintln!(
        "{} classes, {} points, {} queries, built in {:.1} s",
        classes.len(),
        classes.iter().map(|c| c.points.len()).sum::<usize>(),
        streams.iter().map(Vec::len).sum::<usize>(),
        start.elapsed().as_secs_f64()
    );
    if let Some(folder) = &arguments.export {
        export(&classes, &streams, folder)?;
    }
    let limits = Limits {
        k: arguments.k,
        pool: arguments.pool,
        visits: arguments.visits,
        spare: arguments.visits,
        jump: arguments.jump,
        cutoff_distance2: f32::INFINITY,
    };
    let truth = Truth::new(&classes, &streams);
    let report = if arguments.sweep {
        let settings =
            sweep(database, limits, (&arguments.pools, &arguments.bounds), &truth, arguments.rounds)?;
        let jumps = jumps(&database, &setup.clips);
        for &pool in &arguments.pools {
            let (mean, worst) = after_jumps(database, Limits { pool, ..limits }, &classes, &jumps, 6);
            eprintln!("pool {pool}: recall after a jump, mean {mean:.4?}, worst {worst:.4?}");
        }
        if !arguments.json {
            println!("pool  visits  recall  visits/query  us/query");
            for s in &settings {
                println!(
                    "{:4}  {:6}  {:.4}  {:12.1}  {:8.2}",
                    s.pool, s.visits, s.recall, s.visits_mean, s.us_per_query
                );
            }
        }
        json!({ "settings": settings })
    } else {
        compare(&arguments, &setup, database, limits, &truth, &classes)?
    };
    if arguments.json {
        println!("{report}");
    }
    Ok(())
}

fn compare(
    arguments: &Arguments,
    setup: &Setup,
    database: Database<'_>,
    limits: Limits,
    truth: &Truth<'_>,
    classes: &[gestus_peers::setup::Points],
) -> Result<serde_json::Value> {
    let mut methods = tuned(database, limits, truth)?;
    let recall = methods.first().map_or(0.0, |(_, core)| core.recall);
    let hnswlib = arguments.hnswlib.as_ref().zip(arguments.export.as_ref());
    let mut hnswlib = hnswlib.map(|(python, folder)| Hnswlib::start(python, folder, recall)).transpose()?;
    time(&mut methods, truth, arguments.rounds, || hnswlib.as_mut().map_or(Ok(()), Hnswlib::round))?;
    let mut rows: Vec<_> = methods.into_iter().map(|(_, row)| row).collect();
    rows.extend(hnswlib.map(Hnswlib::finish).transpose()?);
    let jumps = jumps(&database, &setup.clips);
    let (mean, worst) = after_jumps(database, limits, classes, &jumps, 6);
    let mut steps = Vec::new();
    for clip in &setup.clips {
        let streamed = stream(&database, clip, &Request::style(0), &mut ())?;
        steps.extend(streamed.steps.iter().map(|s| s.micros));
    }
    steps.sort_unstable_by(f64::total_cmp);
    let quantile = |q: f64| steps.get((q * (steps.len() - 1) as f64) as usize).copied().unwrap_or(0.0);
    if !arguments.json {
        println!("method             recall  us/query  times core  ef    visits");
        for row in &rows {
            println!(
                "{:17}  {:.4}  {:8.2}  {:10.2}  {:4}  {:6}",
                row.method,
                row.recall,
                row.us_per_query,
                row.us_per_query / rows[0].us_per_query,
                row.ef.map_or_else(|| "-".to_string(), |ef| ef.to_string()),
                row.visits.map_or_else(|| "-".to_string(), |v| format!("{v:.1}")),
            );
        }
        println!("recall after a jump, mean of {} jumps: {mean:.4?}; worst: {worst:.4?}", jumps.len());
        println!("whole step: {:.0} us median, {:.0} at the 99th percentile", quantile(0.5), quantile(0.99));
    }
    Ok(json!({
        "rows": rows,
        "jump": { "mean": mean, "worst": worst, "jumps": jumps.len() },
        "step": { "median_us": quantile(0.5), "p99_us": quantile(0.99) },
    }))
}
