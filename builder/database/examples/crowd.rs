//! Times a frame of a crowd of characters on one database: unlabelled, labelled, and by tables of phase, on one thread and
//! on all. Every character streams the clip, from a frame of its own, in a style of its own.
//!
//! `cargo run --release -p gestus-database --example crowd -- DB CLIP ACTION STYLE [CHARACTERS]`, with the labels of
//! the clip

use std::time::Instant;

use gestus_core::{Config, Database, Method, Pose, Report, Stylizer, step_many};
use gestus_database::stream::{crowd, input::Input, to_pose};

/// Frames that are timed.
const FRAMES: usize = 100;
type Character<'db> = Stylizer<'db, 22, 16, 28>;

fn main() -> anyhow::Result<()> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [path, clip, action, style, rest @ ..] = arguments.as_slice() else {
        anyhow::bail!("name a database, a clip, its action and its style")
    };
    let count: usize = rest.first().map_or(Ok(100), |n| n.parse())?;
    let bytes = std::fs::read(path)?;
    let database = Database::open(&bytes).map_err(|e| anyhow::anyhow!("{path}: {e}"))?;
    let names = database.manifest()?;
    let (action, style) = (names.actions.find(action), names.styles.find(style));
    let clip = Input::read(clip.as_ref(), &database)?.mapped;
    let poses: Vec<Pose<22>> = clip.frames.iter().cycle().take(FRAMES + count).map(to_pose).collect();
    println!(
        "{count} characters, milliseconds a frame in the median: one thread, {} threads",
        rayon::current_num_threads()
    );
    for (name, method, labelled) in [
        ("mixture", Method::Mar, false),
        ("mixture, labelled", Method::Mar, true),
        ("phase tables", Method::Phase, false),
        ("phase tables, labelled", Method::Phase, true),
    ] {
        let timed = |all: bool| -> anyhow::Result<f64> {
            let mut characters = Vec::with_capacity(count);
            for i in 0..count {
                let mut character = Character::new(database, Config::new().method(method))?;
                character.set_style(&[((i % database.counts().styles) as u16, 1.0)])?;
                if labelled {
                    character.set_labels(action, style)?;
                }
                characters.push(character);
            }
            let mut outputs = vec![Pose::IDENTITY; count];
            let mut reports = vec![Report::default(); count];
            let mut times: Vec<f64> = (0..FRAMES)
                .map(|t| {
                    let inputs = &poses[t..t + count];
                    let start = Instant::now();
                    if all {
                        crowd::step_many(&mut characters, inputs, &mut outputs, &mut reports);
                    } else {
                        step_many(&mut characters, inputs, &mut outputs, &mut reports);
                    }
                    start.elapsed().as_secs_f64() * 1e3
                })
                .collect();
            times.sort_by(f64::total_cmp);
            Ok(times[FRAMES / 2])
        };
        println!("{name:28} {:8.2} {:8.2}", timed(false)?, timed(true)?);
    }
    Ok(())
}
