//! One moment of a clip in mixes of styles over a polygon: its corners, the middles of its edges, its centre.

use anyhow::Result;
use gestus_core::Database;
use gestus_database::stream::Request;
use gestus_motion::body::Body;
use serde_json::json;

use crate::{
    baselines::outputs::Record,
    evaluation::row,
    experiment::Experiment,
    metrics::{centred, joint_distance},
    plots::poses::{Figure as Drawn, Ink, Sheet, sheet},
    report::{html::Figure, table},
};

/// Most corners.
const CORNERS: usize = 8;
/// Width and height of the picture, radius of the polygon, and a metre of the body, pixels.
const SIZE: (u32, u32) = (1060, 1050);
const RADIUS: f64 = 420.0;
const SCALE: f64 = 80.0;
/// How far the polygon makes room for the heading.
const HEADING: i32 = 12;
/// How far the floor of a figure is under its place on the polygon.
const UNDER: i32 = 70;

/// A place on the polygon: its name, style weights, and position within the unit circle, upwards.
struct Place {
    name: &'static str,
    weights: Vec<(u16, f32)>,
    at: (f64, f64),
}

fn places(styles: &[usize]) -> Vec<Place> {
    let corner = |i: usize| {
        let angle = std::f64::consts::TAU * i as f64 / styles.len() as f64;
        (angle.sin(), angle.cos())
    };
    let mut places = Vec::new();
    for (i, &style) in styles.iter().enumerate() {
        places.push(Place { name: "corner", weights: vec![(style as u16, 1.0)], at: corner(i) });
        let next = (i + 1) % styles.len();
        let (a, b) = (corner(i), corner(next));
        // Two styles have one edge.
        if styles.len() > 2 || next > i {
            places.push(Place {
                name: "edge",
                weights: vec![(style as u16, 0.5), (styles[next] as u16, 0.5)],
                at: (0.5 * (a.0 + b.0), 0.5 * (a.1 + b.1)),
            });
        }
    }
    if styles.len() > 2 {
        let weight = 1.0 / styles.len() as f32;
        let weights = styles.iter().map(|&s| (s as u16, weight)).collect();
        places.push(Place { name: "centre", weights, at: (0.0, 0.0) });
    }
    places
}

/// A row for each place, and the sheet.
pub(super) fn drawn(
    experiment: &Experiment,
    database: &Database<'_>,
    test: usize,
) -> Result<(Vec<table::Row>, Figure)> {
    let corpus = &experiment.corpus;
    let clip = &corpus.examples[test].clip;
    let body = Body::of(corpus)?.with_means_of(database);
    let styles: Vec<usize> = experiment.to.iter().copied().take(CORNERS).collect();
    let moment = clip.frames.len() / 2;
    let places = places(&styles);
    let mut poses = Vec::new();
    for place in &places {
        let request = Request { style: place.weights.clone(), ..Request::style(experiment.from as u16) };
        let (mut record, _) = Record::of_stream(database, clip, &request).map_err(anyhow::Error::msg)?;
        poses.push((record.x.swap_remove(moment), record.predicted.swap_remove(moment)));
    }
    let corner = |style: u16| {
        let at = places.iter().position(|p| p.weights.len() == 1 && p.weights[0].0 == style);
        at.map(|at| &poses[at].1)
    };
    let (mut rows, mut figures) = (Vec::new(), Vec::new());
    for (place, (input, output)) in places.iter().zip(&poses) {
        let mut between = vec![0.0; output.len()];
        for &(style, weight) in &place.weights {
            let theirs = corner(style).into_iter().flatten();
            between.iter_mut().zip(theirs).for_each(|(b, v)| *b += f64::from(weight) * v);
        }
        let far = |other: &[f64]| 100.0 * joint_distance(&centred(&body, output), &centred(&body, other));
        let name = |style: u16| corpus.styles[usize::from(style)].as_str();
        let mix: Vec<String> = place.weights.iter().map(|&(s, w)| format!("{} {w:.2}", name(s))).collect();
        rows.push(row(json!({
            "sheet": "polygon",
            "place": place.name,
            "of": mix.join(" "),
            "clip": clip.name,
            "frame": moment,
            "between_cm": far(&between),
            "input_cm": far(input),
        })));
        let pose = |dofs: &[f64]| body.pose(dofs, [0.0; 2], 0.0);
        figures.push(Drawn {
            at: pixel(place.at, UNDER),
            poses: vec![(pose(input), Ink::Faint), (pose(output), Ink::Blue)],
            text: if place.name == "centre" { vec!["all alike".into()] } else { mix },
        });
    }
    let corners: Vec<(i32, i32)> =
        places.iter().filter(|p| p.name == "corner").map(|p| pixel(p.at, 0)).collect();
    let edges = (0..corners.len()).map(|i| [corners[i], corners[(i + 1) % corners.len()]]);
    let title = format!("{}, frame {moment}: styles and their mixes; faint: the input", clip.name);
    let svg =
        sheet(&body, &Sheet { title: &title, size: SIZE, scale: SCALE, lines: edges.collect(), figures });
    let caption = "One moment in the styles at the corners of a polygon, in mixes of two on its edges and of all at its \
                   centre (Xia 2015, section 5.4 and Figure 5): predictions, before feet are held.";
    Ok((rows, Figure { name: "polygon".into(), caption: caption.into(), svg }))
}

fn pixel((x, y): (f64, f64), under: i32) -> (i32, i32) {
    let (width, height) = (f64::from(SIZE.0), f64::from(SIZE.1));
    ((0.5 * width + RADIUS * x) as i32, (0.5 * height - RADIUS * y) as i32 + HEADING + under)
}
