//! The task: a database, the streams of queries against it, and the true answers.

use std::path::{Path, PathBuf};

use anyhow::{Context, Result, ensure};
use gestus_core::{
    Database,
    blob::layout::{MAX_FEATURES, flag},
    search::query::{ALIGNED, Feature, Window},
};
use gestus_database::{
    build,
    data_folder::{config::Config, load},
    stream::to_pose,
};
use gestus_motion::clip::Clip;
use npyz::WriterBuilder;

/// Most joints of the clips.
const JOINTS: usize = 64;

/// What the benchmark runs on.
#[derive(Debug, Clone)]
pub struct Task {
    /// Folder of BVH files.
    pub data: PathBuf,
    /// Actions; all if empty.
    pub actions: Vec<String>,
    /// Styles; all if empty.
    pub styles: Vec<String>,
    /// Clips whose name ends so are queries and stay out of the database.
    pub held_out: String,
}

/// A database and clips outside it.
#[derive(Debug)]
pub struct Setup {
    /// The blob.
    pub bytes: Vec<u8>,
    /// The clips held out, at the database's rate.
    pub clips: Vec<Clip>,
}

impl Setup {
    /// Reads the folder and builds the database.
    ///
    /// # Errors
    /// Where the folder cannot be read, nothing is held out, or what is left makes no database.
    pub fn new(task: &Task) -> Result<Self> {
        let config = Config {
            data: Some(task.data.clone()),
            actions: task.actions.clone(),
            styles: task.styles.clone(),
            ..Config::of_folder(&task.data)?
        };
        let mut corpus = load::load(&config)?.corpus;
        let (held, kept) =
            corpus.examples.into_iter().partition(|example| example.clip.name.ends_with(&task.held_out));
        corpus.examples = kept;
        let held: Vec<gestus_motion::corpus::Example> = held;
        ensure!(
            !held.is_empty(),
            "{}: no clip's name ends with `{}`: choose queries with --held-out",
            task.data.display(),
            task.held_out
        );
        let bytes = build::build(&corpus, &config.build)?.bytes;
        Ok(Self { bytes, clips: held.into_iter().map(|e| e.clip).collect() })
    }
}

/// Points of a class as peers take them: features in metres, so that plain Euclidean distance is core's.
#[derive(Debug, Clone)]
pub struct Points {
    /// Number of the class.
    pub class: usize,
    /// Neighbors wanted.
    pub k: usize,
    /// Row within the class, shape [points].
    pub rows: Vec<u16>,
    /// Shape [points][features].
    pub points: Vec<Feature>,
}

/// The points of every class.
pub fn points(database: &Database<'_>, k: usize) -> Vec<Points> {
    (0..database.counts().classes)
        .map(|class| {
            let record = database.class(class);
            let searchable =
                |r: &u16| database.flags(record.first_row + usize::from(*r)) & flag::SEARCHABLE != 0;
            let rows: Vec<u16> = (0..record.rows as u16).filter(searchable).collect();
            let point = |r: &u16| {
                let codes = database.feature(record.first_row + usize::from(*r));
                let mut point = [0.0; MAX_FEATURES];
                for (f, (slot, &code)) in point.iter_mut().zip(codes).enumerate() {
                    *slot = database.feature_scale(f) * f32::from(code as i8);
                }
                point
            };
            Points { class, k: k.min(record.k_cap), points: rows.iter().map(point).collect(), rows }
        })
        .collect()
}

/// The query of every frame of a clip, as a stylizer makes it; unused components are zero.
pub fn queries<'a>(
    database: &Database<'_>,
    frames: impl Iterator<Item = &'a gestus_motion::clip::Frame>,
) -> Vec<Feature> {
    let mut window = Box::new(Window::<JOINTS>::new());
    frames
        .map(|frame| {
            window.push(database, &to_pose::<JOINTS>(frame));
            let mut feature = [0.0; MAX_FEATURES];
            window.feature(database, &mut [0; ALIGNED * JOINTS], &mut feature);
            feature
        })
        .collect()
}

/// One stream for each clip held out.
pub fn streams(database: &Database<'_>, clips: &[Clip]) -> Vec<Vec<Feature>> {
    clips.iter().map(|clip| queries(database, clip.frames.iter())).collect()
}

/// Streams that jump: half of a clip, then the second half of another, with nothing between. The frame of the
/// jump comes first.
pub fn jumps(database: &Database<'_>, clips: &[Clip]) -> Vec<(usize, Vec<Feature>)> {
    let pairs = clips.len() * 4;
    (0..pairs)
        .filter_map(|i| {
            let from = &clips[i % clips.len()].frames;
            // A stride that meets other actions and styles.
            let to = &clips[(i + 1 + (i / clips.len()) * 7) % clips.len()].frames;
            let (half, start) = (from.len() / 2, to.len() * (i / clips.len() + 1) / 6);
            let frames = from[..half].iter().chain(&to[start..]);
            (half > 10 && to.len() - start > 10).then(|| (half, queries(database, frames)))
        })
        .collect()
}

/// Squared distance as peers compute it.
#[inline]
pub fn squared(a: &[f32], b: &[f32]) -> f32 {
    let mut sums = [0.0f32; 8];
    for (a, b) in a.as_chunks::<8>().0.iter().zip(b.as_chunks::<8>().0) {
        for ((sum, a), b) in sums.iter_mut().zip(a).zip(b) {
            *sum += (a - b) * (a - b);
        }
    }
    sums.iter().sum()
}

/// The squared distance within which a query's `k` true neighbors lie, in each class.
pub fn radii(classes: &[Points], query: &Feature) -> Vec<f32> {
    classes
        .iter()
        .map(|class| {
            let mut all: Vec<f32> = class.points.iter().map(|p| squared(p, query)).collect();
            if class.k == 0 || all.len() <= class.k {
                return f32::INFINITY;
            }
            let (_, &mut radius, _) = all.select_nth_unstable_by(class.k - 1, f32::total_cmp);
            // Core scales its query instead of its points: the last bits differ.
            radius * (1.0 + 1e-5)
        })
        .collect()
}

/// Writes `points.npy` [N x F], `class.npy` [N], `k.npy` [classes] and `queries.npy` [T x F] for programs in other
/// languages.
///
/// # Errors
/// Where the folder cannot be written.
pub fn export(classes: &[Points], streams: &[Vec<Feature>], folder: &Path) -> Result<()> {
    std::fs::create_dir_all(folder).with_context(|| folder.display().to_string())?;
    let points: Vec<Feature> = classes.iter().flat_map(|c| c.points.clone()).collect();
    let class: Vec<u16> = classes.iter().flat_map(|c| vec![c.class as u16; c.points.len()]).collect();
    let k: Vec<u16> = classes.iter().map(|c| c.k as u16).collect();
    let width = MAX_FEATURES as u64;
    write(folder, "points.npy", &[points.len() as u64, width], points.as_flattened())?;
    write(folder, "class.npy", &[class.len() as u64], &class)?;
    write(folder, "k.npy", &[k.len() as u64], &k)?;
    let queries = streams.concat();
    write(folder, "queries.npy", &[queries.len() as u64, width], queries.as_flattened())
}

fn write<T: npyz::AutoSerialize + Copy>(
    folder: &Path,
    name: &str,
    shape: &[u64],
    values: &[T],
) -> Result<()> {
    let path = folder.join(name);
    let file = std::fs::File::create(&path).with_context(|| path.display().to_string())?;
    let mut writer = npyz::WriteOptions::new()
        .default_dtype()
        .shape(shape)
        .writer(std::io::BufWriter::new(file))
        .begin_nd()?;
    writer.extend(values.iter().copied())?;
    Ok(writer.finish()?)
}
