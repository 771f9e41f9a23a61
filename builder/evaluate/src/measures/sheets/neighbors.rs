//! Poses of an input, and the nearest frames of the nearest classes in ascending order.

use anyhow::Result;
use gestus_core::Database;
use gestus_database::{blob::export::class_names, build::BuildError, stream::Request};
use gestus_motion::{body::Body, statistics::mean};
use serde_json::json;

use crate::{
    baselines::outputs::{ClassNeighbors, Record, row as database_row},
    evaluation::row,
    experiment::Experiment,
    metrics::{centred, joint_distance},
    plots::poses::{Figure as Drawn, Ink, Sheet, sheet},
    report::{html::Figure, table},
};

/// Moments of the input, nearest classes, and neighbors of each.
const MOMENTS: usize = 4;
const CLASSES: usize = 3;
const NEAREST: usize = 3;
/// Width and height of a figure's cell, what is above the first, and a metre of the body, pixels.
const CELL: (i32, i32) = (104, 176);
const TOP: i32 = 30;
const SCALE: f64 = 64.0;

/// A row for each moment and class, and the sheet. `name` is that of the sheet.
pub(super) fn drawn(
    experiment: &Experiment,
    database: &Database<'_>,
    test: usize,
    name: &str,
) -> Result<(Vec<table::Row>, Figure)> {
    let clip = &experiment.corpus.examples[test].clip;
    let body = Body::of(&experiment.corpus)?.with_means_of(database);
    let manifest = database.manifest().map_err(BuildError::from)?;
    let names: Vec<String> = database
        .classes()
        .map(|c| class_names(&manifest, c).into_iter().flatten().collect::<Vec<_>>().join(" "))
        .collect();
    let (record, _) = Record::of_stream(database, clip, &Request::style(0)).map_err(anyhow::Error::msg)?;
    let pose = |dofs: &[f64]| body.pose(dofs, [0.0; 2], 0.0);
    let (mut rows, mut figures) = (Vec::new(), Vec::new());
    for moment in 0..MOMENTS {
        let frame = (moment + 1) * clip.frames.len() / (MOMENTS + 1);
        let input = &record.x[frame];
        let place = |column: usize| {
            let (x, y) = (CELL.0 * column as i32 + CELL.0 / 2, TOP + CELL.1 * (moment as i32 + 1));
            (x, y - 40)
        };
        let text = vec!["input".to_owned(), format!("frame {frame}")];
        figures.push(Drawn { at: place(0), poses: vec![(pose(input), Ink::Green)], text });
        for (c, (class, near)) in nearest_classes(&record.neighbors[frame]).into_iter().enumerate() {
            let mut distances = Vec::new();
            for (n, &(found, _)) in near.iter().take(NEAREST).enumerate() {
                let neighbor = database_row(database, found);
                let cm = 100.0 * joint_distance(&centred(&body, input), &centred(&body, &neighbor));
                distances.push(cm);
                figures.push(Drawn {
                    at: place(1 + c * NEAREST + n),
                    poses: vec![(pose(&neighbor), Ink::Red)],
                    text: vec![names[*class].clone(), format!("{cm:.1} cm")],
                });
            }
            rows.push(row(json!({
                "sheet": name,
                "place": format!("class {}", c + 1),
                "of": names[*class],
                "clip": clip.name,
                "frame": frame,
                "nearest_cm": mean(distances),
            })));
        }
    }
    let size =
        ((CELL.0 * (1 + CLASSES * NEAREST) as i32) as u32, (TOP + CELL.1 * MOMENTS as i32 + 10) as u32);
    let title = format!("{} and its nearest frames in {} classes", clip.name, names.len());
    let svg = sheet(&body, &Sheet { title: &title, size, scale: SCALE, lines: Vec::new(), figures });
    let caption = "Poses of an input (green) and the three nearest frames of each of the three nearest classes (red), nearest \
                   first (Xia 2015, Figure 7); hips-centred distance. The search looks at five frames, not at the pose alone.";
    Ok((rows, Figure { name: format!("neighbors-{name}"), caption: caption.into(), svg }))
}

/// The classes that were searched, that with the nearest neighbors first.
fn nearest_classes(of: &[ClassNeighbors]) -> Vec<&ClassNeighbors> {
    let distance = |c: &ClassNeighbors| mean(c.1.iter().take(NEAREST).map(|n| f64::from(n.1)));
    let mut classes: Vec<&ClassNeighbors> = of.iter().filter(|c| !c.1.is_empty()).collect();
    classes.sort_by(|a, b| distance(a).total_cmp(&distance(b)));
    classes.truncate(CLASSES);
    classes
}
