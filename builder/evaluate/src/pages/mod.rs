//! The viewer: one self-contained HTML page that plays skeletons side by side.
//!
//! Under the skeletons run the foot contacts, the class proportions and the time step. The page needs no network
//! and opens from `file://`. It holds joint positions instead of rotations, so it needs no kinematics:
//!
//! ```text
//! q[f][j] = round(1000 p[f][j])                    millimetres, world, Y up, error at most 0.5 mm an axis
//! stored  = q[0], q[1] - q[0], q[2] - q[1], ...    exact differences, mostly one or two digits
//! ```
//!
//! Cost: about 2.5 bytes a coordinate, 160 a frame of 21 joints; a minute at 60 Hz is 0.6 MB a track.

pub mod effort_outputs;
pub mod effort_sheet;
pub mod view;

use minijinja::context;
use serde::Serialize;

use crate::report::template;
use gestus_motion::clip::{Clip, Frame, Skeleton};

/// The script that draws skeletons, for other pages too: it defines `Draw`.
pub const DRAW: &str = include_str!("draw.js");
/// The style of the pages.
pub const STYLE: &str = include_str!("page.css");

/// One moving skeleton.
#[derive(Debug, Clone)]
pub struct Track<'a> {
    /// What it is: "input", "output, elderly".
    pub label: String,
    /// The joints that the frames move.
    pub skeleton: &'a Skeleton,
    /// When each frame is shown, seconds, ascending; see [`times_at`]. Frames beyond its end are left out.
    pub times_s: Vec<f64>,
    /// The poses, in order of time.
    pub frames: &'a [Frame],
    /// Contact of the left and the right foot, one entry a frame; missing ones are no contact. Empty where contacts are
    /// unknown: then no lane is drawn.
    pub contacts: &'a [[bool; 2]],
    /// Drawn faint over the track before it, its root on that one's.
    pub over: bool,
}

impl<'a> Track<'a> {
    /// A clip from its first frame on, beside the others.
    pub fn of(label: &str, clip: &'a Clip, contacts: &'a [[bool; 2]]) -> Self {
        let times_s = times_at(clip.rate_hz, clip.frames.len());
        Self {
            label: label.into(),
            skeleton: &clip.skeleton,
            times_s,
            frames: &clip.frames,
            contacts,
            over: false,
        }
    }
}

/// Mixing proportions of the classes over time.
#[derive(Debug, Clone, Default)]
pub struct Proportions {
    /// Name of each class.
    pub labels: Vec<String>,
    /// One row a frame of the last track, one value a class, each 0 to 1. Shape `[frames x classes]`.
    pub values: Vec<Vec<f32>>,
}

/// One entry of the page's list: tracks that are shown together, and what is drawn under them.
#[derive(Debug, Clone, Default)]
pub struct Scene<'a> {
    /// Heading.
    pub title: String,
    /// One line under the heading; may be empty.
    pub subtitle: String,
    /// Key facts, name and value, in order.
    pub facts: Vec<(String, String)>,
    /// The skeletons, input first; the last one is the output that proportions and steps belong to.
    pub tracks: Vec<Track<'a>>,
    /// Mixing proportions of the classes, if there are any.
    pub proportions: Option<Proportions>,
    /// Time step of each frame of the last track, seconds.
    pub steps_s: Option<Vec<f64>>,
}

/// A page: one or more scenes; with several the reader picks from a list.
#[derive(Debug, Clone, Default)]
pub struct Page<'a> {
    /// Title of the document.
    pub title: String,
    /// The scenes; the first is shown first.
    pub scenes: Vec<Scene<'a>>,
}

impl<'a> From<Scene<'a>> for Page<'a> {
    fn from(scene: Scene<'a>) -> Self {
        Page { title: scene.title.clone(), scenes: vec![scene] }
    }
}

/// Time stamps of `frames` frames at a fixed rate, seconds, from 0.
pub fn times_at(rate_hz: f64, frames: usize) -> Vec<f64> {
    (0..frames).map(|i| i as f64 / rate_hz).collect()
}

/// The whole page as one HTML document.
pub fn render(page: &Page) -> String {
    let data = Data { scenes: page.scenes.iter().map(scene_data).collect() };
    // Only strings, numbers and lists: serialising cannot fail.
    let json = serde_json::to_string(&data).unwrap_or_else(|_| String::from("{\"scenes\":[]}"));
    document(include_str!("page.html"), &page.title, STYLE, &json, &[DRAW, include_str!("page.js")].concat())
}

/// A page of a template with a title, a style, data for the script as JSON, and the script.
pub fn document(template: &str, title: &str, style: &str, json: &str, script: &str) -> String {
    template::render(template, context! { title, style, data => script_safe(json), script })
}

/// JSON that can stand inside a `script` element: no tag, comment or entity can begin in it.
fn script_safe(json: &str) -> String {
    json.replace('<', "\\u003c").replace('>', "\\u003e").replace('&', "\\u0026")
}

#[derive(Serialize)]
struct Data<'a> {
    scenes: Vec<SceneData<'a>>,
}

#[derive(Serialize)]
struct SceneData<'a> {
    title: &'a str,
    subtitle: &'a str,
    facts: &'a [(String, String)],
    tracks: Vec<TrackData<'a>>,
    proportions: Option<ProportionsData<'a>>,
    /// Units of 10 microseconds.
    steps: Option<Vec<i64>>,
}

#[derive(Serialize)]
struct TrackData<'a> {
    label: &'a str,
    names: &'a [String],
    /// -1 for the root.
    parents: Vec<i64>,
    /// Units of 100 microseconds; the first, then differences.
    times: Vec<i64>,
    /// Millimetres, `[frames x joints x 3]`; the first frame, then differences.
    positions: Vec<i64>,
    /// One digit a frame: left 1, right 2; empty where contacts are not known.
    contacts: String,
    over: bool,
}

#[derive(Serialize)]
struct ProportionsData<'a> {
    labels: &'a [String],
    /// Thousandths, `[frames x classes]`.
    values: Vec<i64>,
}

fn scene_data<'a>(scene: &'a Scene) -> SceneData<'a> {
    SceneData {
        title: &scene.title,
        subtitle: &scene.subtitle,
        facts: &scene.facts,
        tracks: scene.tracks.iter().map(track_data).collect(),
        proportions: scene.proportions.as_ref().map(|p| {
            let row = |v: &Vec<f32>| {
                let mut row: Vec<i64> = v.iter().map(|&x| quantise(f64::from(x), 1e3)).collect();
                row.resize(p.labels.len(), 0);
                row
            };
            ProportionsData { labels: &p.labels, values: p.values.iter().flat_map(row).collect() }
        }),
        steps: scene.steps_s.as_ref().map(|s| s.iter().map(|&x| quantise(x, 1e5)).collect()),
    }
}

fn track_data<'a>(track: &'a Track) -> TrackData<'a> {
    let count = track.frames.len().min(track.times_s.len());
    let mut times: Vec<i64> = track.times_s[..count].iter().map(|&t| quantise(t, 1e4)).collect();
    differences(&mut times, 1);
    let width = 3 * track.skeleton.joints();
    let mut positions = Vec::with_capacity(count * width);
    for frame in &track.frames[..count] {
        let world = frame.positions(track.skeleton);
        positions.extend(world.iter().flat_map(|p| [p.x, p.y, p.z]).map(|x| quantise(x, 1e3)));
    }
    differences(&mut positions, width);
    let contact = |f: usize| {
        let [left, right] = track.contacts.get(f).copied().unwrap_or_default();
        (b'0' + u8::from(left) + 2 * u8::from(right)) as char
    };
    TrackData {
        label: &track.label,
        names: &track.skeleton.names,
        parents: track.skeleton.parents.iter().map(|p| p.map_or(-1, |p| p as i64)).collect(),
        times,
        positions,
        contacts: if track.contacts.is_empty() { String::new() } else { (0..count).map(contact).collect() },
        over: track.over,
    }
}

/// Rounded to a whole number of `1 / scale` and limited to ±1e9; not a number becomes 0.
fn quantise(value: f64, scale: f64) -> i64 {
    (value * scale).round().clamp(-1e9, 1e9) as i64
}

/// Replaces every row of `width` values after the first by its difference from the row before.
fn differences(values: &mut [i64], width: usize) {
    for i in (width..values.len()).rev() {
        values[i] -= values[i - width];
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::{UnitQuaternion, Vector3};
    use serde_json::Value;

    use super::*;

    fn skeleton() -> Skeleton {
        Skeleton {
            names: vec!["Hips".into(), "</script><b>".into()],
            parents: vec![None, Some(0)],
            offsets: vec![Vector3::zeros(), Vector3::new(0.0, 0.5, 0.0)],
        }
    }

    fn frames() -> Vec<Frame> {
        let pose = |x: f64| Frame {
            root: Vector3::new(x, 0.9004, 0.0),
            rotations: vec![UnitQuaternion::from_axis_angle(&Vector3::z_axis(), x); 2],
        };
        vec![pose(0.0), pose(0.1), pose(f64::NAN)]
    }

    fn page<'a>(skeleton: &'a Skeleton, frames: &'a [Frame]) -> Page<'a> {
        let track = |label: &str| Track {
            label: label.into(),
            skeleton,
            times_s: times_at(30.0, 3),
            frames,
            contacts: &[[true, false], [true, true]],
            over: false,
        };
        Scene {
            title: "</script><script>alert(1)</script> & {{data}}".into(),
            subtitle: "<!-- \u{2028}".into(),
            facts: vec![("<i>".into(), "\"'".into())],
            tracks: vec![track("in"), track("out")],
            proportions: Some(Proportions { labels: vec!["a".into(), "b".into()], values: vec![vec![0.25]] }),
            steps_s: Some(vec![1.0 / 30.0]),
        }
        .into()
    }

    fn data(html: &str) -> Value {
        let open = "<script type=\"application/json\" id=\"data\">";
        let from = html.find(open).expect("data element") + open.len();
        let to = from + html[from..].find("</script>").expect("its end");
        serde_json::from_str(&html[from..to]).expect("valid JSON")
    }

    #[test]
    fn hostile_names_stay_text() {
        let (skeleton, frames) = (skeleton(), frames());
        let html = render(&page(&skeleton, &frames));
        assert_eq!(html.matches("</script>").count(), 2, "the data element and the program");
        assert!(!html.contains("alert(1)<"));
        let data = data(&html);
        assert_eq!(data["scenes"][0]["title"], "</script><script>alert(1)</script> & {{data}}");
        assert_eq!(data["scenes"][0]["tracks"][0]["names"][1], "</script><b>");
        assert_eq!(data["scenes"][0]["facts"][0][1], "\"'");
    }

    #[test]
    fn embedded_positions_are_the_frames_to_half_a_millimetre() {
        let (skeleton, frames) = (skeleton(), frames());
        let data = data(&render(&page(&skeleton, &frames[..2])));
        let track = &data["scenes"][0]["tracks"][1];
        let values: Vec<i64> =
            track["positions"].as_array().unwrap().iter().map(|v| v.as_i64().unwrap()).collect();
        assert_eq!(values.len(), 2 * 2 * 3);
        let mut sum = [0i64; 6];
        for (f, row) in values.chunks(6).enumerate() {
            let truth = frames[f].positions(&skeleton);
            for (i, &v) in row.iter().enumerate() {
                sum[i] += v;
                assert!((sum[i] as f64 * 1e-3 - truth[i / 3][i % 3]).abs() <= 0.5001e-3);
            }
        }
        assert_eq!(track["contacts"], "13");
        assert_eq!(track["parents"].to_string(), "[-1,0]");
    }

    #[test]
    fn odd_input_still_gives_a_page() {
        let (skeleton, frames) = (skeleton(), frames());
        let html = render(&page(&skeleton, &frames));
        let data = data(&html);
        assert_eq!(
            data["scenes"][0]["proportions"]["values"].to_string(),
            "[250,0]",
            "short rows are filled"
        );
        assert_eq!(data["scenes"][0]["tracks"][0]["contacts"], "130", "missing contacts are none");
        assert_eq!(render(&page(&skeleton, &frames)), html, "the same bytes again");
        assert!(render(&Page::default()).contains("<!doctype html>"));
    }

    #[test]
    fn contacts_that_nobody_knows_are_not_said_to_be_none() {
        let (skeleton, frames) = (skeleton(), frames());
        let mut unknown = page(&skeleton, &frames);
        unknown.scenes[0].tracks[0].contacts = &[];
        let data = data(&render(&unknown));
        assert_eq!(data["scenes"][0]["tracks"][0]["contacts"], "");
        assert_eq!(data["scenes"][0]["tracks"][1]["contacts"], "130");
    }

    #[test]
    fn page_loads_nothing() {
        let html = render(&Page::default());
        for word in ["http:", "https:", "src=", "@import", "url(", "fetch(", "<link"] {
            assert!(!html.contains(word), "{word}");
        }
    }
}
