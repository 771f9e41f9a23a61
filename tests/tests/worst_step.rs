//! The work of steps against its bound, [`Database::worst_step`]: on plain streams, and in a blob that is made to be slow.

use gestus_core::{
    Config, Database, Method, Observer, Pose, Report, Stage, Stylizer,
    blob::layout::{NONE, flag, section},
    methods::work::Work,
    search::found::Found,
};
use gestus_database::stream::to_pose;
use gestus_motion::clip::{Clip, Frame};
use gestus_tests::{
    motion::{self, LARGE, Size},
    patch,
};

const JOINTS: usize = 21;
const CLASSES: usize = 6;
type Gestus<'db> = Stylizer<'db, JOINTS, 64, CLASSES>;

/// Counts what a step does.
#[derive(Default)]
struct Counted {
    searched: u32,
    distances: u32,
    decoded: u32,
}

impl Observer<JOINTS> for Counted {
    fn stage(&mut self, stage: Stage) {
        self.decoded += u32::from(stage == Stage::Decode);
    }
    fn searched(&mut self, _class: usize, found: &Found<'_>) {
        self.searched += 1;
        self.distances += found.stats.visits;
    }
}

/// Steps once, holds what was counted against the bound, and returns it.
fn stepped(stylizer: &mut Gestus<'_>, input: &Pose<JOINTS>) -> (Counted, Report) {
    let (mut counted, mut output) = (Counted::default(), Pose::IDENTITY);
    let report = stylizer.step_observed(input, &mut output, &mut counted);
    let most = stylizer.database().worst_step(stylizer.config());
    let Work { searched, distances, examples, mixes, bytes_read, .. } = stylizer.worst_step();
    let config = stylizer.config();
    assert!(counted.searched <= searched && searched <= most.searched, "{config:?}");
    assert!(report.visits <= distances && distances <= most.distances, "{config:?}");
    assert!(counted.decoded <= examples * mixes, "{} of {examples} · {mixes}: {config:?}", counted.decoded);
    assert!(examples * mixes <= most.examples * most.mixes, "{config:?}");
    assert!(report.bytes_read <= bytes_read && bytes_read <= most.bytes_read, "{report:?}: {config:?}");
    (counted, report)
}

/// Motion of every class, a few frames of each, on one way over the ground: a root that leaps too is searched for less.
fn leaping(frames: usize) -> Clip {
    let clips: Vec<Clip> = (0..CLASSES).map(|c| motion::unseen(c / 3, c % 3, frames)).collect();
    let mut clip = clips[0].clone();
    let of = |frame: usize| Frame {
        root: clip.frames[frame].root,
        ..clips[frame / 4 % CLASSES].frames[frame].clone()
    };
    clip.frames = (0..frames).map(of).collect();
    clip
}

/// Under every method, and under labels, masks, mixes of styles and styles of joint groups.
#[test]
fn no_step_takes_more_than_the_bound() {
    let base = Config::new();
    let of_mixture = [base, base.visits(64).k(40), base.visits(448).k(64).classes(8), Config::paper()];
    let of_tables_and_models = [
        base.method(Method::Phase),
        base.method(Method::Phase).classes(8),
        base.method(Method::Lti),
        base.method(Method::Statistic),
    ];
    stay_within_the_bound(motion::large(), &of_mixture);
    stay_within_the_bound(motion::large(), &of_tables_and_models);
    stay_within_the_bound(&motion::without_graph(LARGE), &of_mixture);
}

fn stay_within_the_bound(blob: &[u8], configs: &[Config]) {
    let database = Database::open(blob).unwrap();
    let clip = leaping(96);
    for &config in configs {
        let mut stylizer = Gestus::new(database, config).unwrap();
        let mut nearest = 0.0f64;
        for (t, frame) in clip.frames.iter().enumerate() {
            // Another setting every dozen frames.
            match t {
                12 => stylizer.set_style(&[(0, 1.0), (1, 1.0), (2, 1.0)]).unwrap(),
                // The linear models have none of a group's own.
                24 => drop(stylizer.set_group_style(1, &[(2, 1.0), (1, 1.0)])),
                36 => drop(stylizer.set_group_style(2, &[(1, 1.0)])),
                48 => stylizer.set_action(Some(1)).unwrap(),
                60 => stylizer.set_mask(1, false).unwrap(),
                72 => stylizer.set_action(None).unwrap(),
                84 => stylizer.reset(),
                _ => {}
            }
            let (_, report) = stepped(&mut stylizer, &to_pose(frame));
            nearest = nearest.max(f64::from(report.bytes_read) / f64::from(stylizer.worst_step().bytes_read));
        }
        assert!(nearest > 0.2, "the bound says nothing: {nearest} of it at most: {config:?}");
    }
}

/// A blob whose graph leads nowhere and whose rows collide in the visited set: slow, and no slower than the bound says.
#[test]
fn a_blob_made_to_be_slow_stays_within_the_bound() {
    const CROWD: Size = Size { actions: 1, styles: 2, takes: 10, frames: 300 };
    let plain = motion::blob(CROWD);
    let slow = slow(&plain);
    let config = Config::new();
    let [of_plain, of_slow] = [&plain, &slow].map(|blob| {
        let database = Database::open(blob).expect("every edge leads to a frame that can be found");
        let mut stylizer = Gestus::new(database, config).unwrap();
        let reports: Vec<Report> =
            leaping(96).frames.iter().map(|f| stepped(&mut stylizer, &to_pose(f)).1).collect();
        let most = reports.iter().map(|r| r.visits).max().unwrap_or(0);
        (most, f64::from(most) / f64::from(database.worst_step(&config).distances))
    });
    assert!(of_slow.0 > of_plain.0, "{of_slow:?} {of_plain:?}");
    assert!(of_slow.1 > 0.5, "{} of the bound", of_slow.1);
}

/// Every edge leads to a row of its own hash slot, far away.
fn slow(blob: &[u8]) -> Vec<u8> {
    let database = Database::open(blob).unwrap();
    let classes: Vec<_> = database.classes().collect();
    let flags: Vec<u8> = (0..database.counts().frames).map(|row| database.flags(row)).collect();
    patch::with_section(blob, section::GRAPH, |graph| {
        for class in classes {
            let own = &flags[class.first_row..][..class.rows];
            let mut rows: Vec<u16> = (0..class.rows)
                .filter(|&row| own[row] & flag::SEARCHABLE != 0)
                .map(|row| row as u16)
                .collect();
            // Rows of one slot of the visited set stand side by side.
            rows.sort_by_key(|row| row.wrapping_mul(40_503));
            for (i, edges) in
                graph[16 * class.first_row..][..16 * class.rows].chunks_exact_mut(16).enumerate()
            {
                for (e, edge) in edges.chunks_exact_mut(2).enumerate() {
                    let to = rows[(8 * i + e) % rows.len()];
                    assert_ne!(to, NONE);
                    edge.copy_from_slice(&to.to_le_bytes());
                }
            }
        }
    })
}
