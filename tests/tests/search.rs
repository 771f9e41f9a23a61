//! The graph search against brute force: its recall, its visits, and its behaviour at jumps.

use gestus_core::{Config, Database, Degraded};
use gestus_database::stream::{Request, stream};
use gestus_tests::{
    motion::{self, Size},
    reference,
    trace::{Frame, Trace},
};

/// Two classes of 3,000 frames.
const CROWD: Size = Size { actions: 1, styles: 2, takes: 10, frames: 300 };
/// Cap on visits in the tests.
const VISITS: u16 = 256;

fn config() -> Config {
    Config::new().visits(VISITS)
}

/// Recall of a frame's search in the classes selected by `which`.
fn recall(db: &Database<'_>, frame: &Frame, which: impl Fn(usize) -> bool) -> f64 {
    let searched = vec![true; db.counts().groups];
    let (mut found, mut wanted) = (0, 0);
    for class in frame.searched.iter().filter(|s| which(s.class)) {
        let exact = reference::brute_force(db, class.class, &frame.query, &searched);
        // Frames at the same distance as the last one count too.
        let farthest = exact[class.neighbors.len() - 1].1 * 1.0001;
        let first = db.class(class.class).first_row;
        let own = |row: u16| reference::distance2(db, &frame.query, first + usize::from(row), &searched);
        found += class.neighbors.iter().filter(|n| own(n.0) <= farthest).count();
        wanted += class.neighbors.len();
    }
    f64::from(found as u32) / f64::from(wanted as u32)
}

fn traced(db: &Database<'_>, clip: &gestus_motion::clip::Clip, config: Config) -> Vec<Frame> {
    let mut trace = Trace::default();
    stream(db, clip, &Request { config, ..Request::style(1) }, &mut trace).unwrap();
    trace.frames
}

/// Recall of the 40 nearest frames, and of as many as the default `k`.
#[test]
fn the_graph_finds_98_5_percent_of_the_nearest() {
    let blob = motion::blob(CROWD);
    let db = Database::open(&blob).unwrap();
    finds_98_5_percent(&db, config().k(40));
    finds_98_5_percent(&db, config());
}

fn finds_98_5_percent(db: &Database<'_>, config: Config) {
    assert!(db.classes().all(|c| c.rows == 3000 && c.k_cap > 40));
    // A second of each of two clips that are far apart, back and forth: three jumps.
    let (walk, heavy) = (motion::unseen(0, 0, 120), motion::unseen(0, 1, 120));
    let mut clip = walk.clone();
    clip.frames =
        [&walk.frames[..30], &heavy.frames[40..70], &walk.frames[75..105], &heavy.frames[..30]].concat();
    let frames = traced(db, &clip, config);
    let recalls: Vec<f64> = frames.iter().map(|f| recall(db, f, |_| true)).collect();
    // In the frame of a jump a search goes no further than it takes to know how far a class is: one without weight may
    // lose its nearest frames.
    let others: Vec<f64> = (0..frames.len()).filter(|t| t % 30 != 0).map(|t| recalls[t]).collect();
    let mean = others.iter().sum::<f64>() / others.len() as f64;
    assert!(mean >= 0.985, "recall {mean}");
    // The frame of a jump is the first of three; after them every class is found again.
    for t in [3, 33, 63, 93] {
        assert!(recalls[t] >= 0.95, "frame {t}, 3 after a jump: recall {}", recalls[t]);
    }
    // Later on this holds for the classes that have weight, and not for all: a far class may lose its nearest frames for
    // a frame (frame 102 here finds 45% in the class without weight). The mean above counts those frames.
    for (t, frame) in frames.iter().enumerate().filter(|(t, _)| t % 30 >= 3) {
        let used = |c: usize| frame.report.classes.iter().any(|s| usize::from(s.class) == c);
        let recall = recall(db, frame, used);
        assert!(recall >= 0.95, "frame {t}, {} after a jump: recall {recall}", t % 30);
    }
    for (t, frame) in frames.iter().enumerate() {
        // A class is searched again at most once.
        let most = 2 * u32::from(VISITS) * db.counts().classes as u32;
        assert!(frame.report.visits <= most, "frame {t}: {} visits", frame.report.visits);
        assert!(frame.report.bytes_read > frame.report.visits * 32);
        assert!(frame.searched.iter().all(|s| s.neighbors.is_sorted_by(|a, b| a.1 <= b.1)));
        let rows = frame.searched.iter().map(|s| s.neighbors.iter().map(|n| n.0).collect::<Vec<_>>());
        for mut rows in rows {
            rows.sort_unstable();
            assert!(rows.windows(2).all(|w| w[0] < w[1]), "frame {t}: a frame was found twice");
        }
    }
}

/// Successors of the last neighbors and rows spread over the class lead to frames about as near as the nearest.
#[test]
fn without_a_graph_the_neighbors_are_about_as_near() {
    let blob = motion::without_graph(CROWD);
    let db = Database::open(&blob).unwrap();
    assert!(!db.has_graph());
    let searched = vec![true; db.counts().groups];
    let frames = traced(&db, &motion::unseen(0, 0, 120), config());
    let (mut found, mut nearest) = (0.0, 0.0);
    for (frame, class) in frames.iter().flat_map(|frame| frame.searched.iter().map(move |s| (frame, s))) {
        let exact = reference::brute_force(&db, class.class, &frame.query, &searched);
        let first = db.class(class.class).first_row;
        for (neighbor, exact) in class.neighbors.iter().zip(&exact) {
            let row = first + usize::from(neighbor.0);
            found += reference::distance2(&db, &frame.query, row, &searched).sqrt();
            nearest += exact.1.sqrt();
        }
    }
    assert!(found < 1.3 * nearest, "{found} m, and {nearest} m to the nearest");
    let most = 2 * u32::from(VISITS) * db.counts().classes as u32;
    assert!(frames.iter().all(|frame| frame.report.visits <= most));
}

#[test]
fn a_small_cap_on_visits_is_kept_and_reported() {
    let db = Database::open(motion::large()).unwrap();
    let frames = traced(&db, &motion::unseen(0, 0, 40), config().visits(64));
    let most = 2 * 64 * db.counts().classes as u32;
    assert!(frames.iter().all(|f| f.report.visits <= most));
    assert!(frames.iter().any(|f| f.report.degraded.contains(Degraded::VISITS)));
}

/// Far from the data all classes are about equally near: the cap on classes bounds the work, and the report says so.
#[test]
fn input_far_from_the_data_is_bounded_and_reported() {
    let db = Database::open(motion::small()).unwrap();
    let mut clip = motion::unseen(0, 0, 60);
    for frame in &mut clip.frames {
        let upside_down = nalgebra::UnitQuaternion::from_euler_angles(0.3, 0.0, 2.6);
        frame.rotations[1] = upside_down;
        frame.root.y += 3.0;
    }
    let near = traced(&db, &motion::unseen(0, 0, 60), config().classes(2));
    let far = traced(&db, &clip, config().classes(2));
    assert!(far.iter().all(|f| f.report.classes.len() <= 2));
    assert!(far.iter().filter(|f| f.report.degraded.contains(Degraded::CLASSES)).count() > 30);
    let mean = |frames: &[Frame]| frames.iter().map(|f| f.report.distance2).sum::<f32>();
    assert!(mean(&far) > 100.0 * mean(&near), "the distance says how far: {} {}", mean(&far), mean(&near));
    assert!(far.iter().all(|f| f.predicted.iter().all(|v| v.abs() < 100.0)), "and the output stays a body");
}
