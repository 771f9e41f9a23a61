//! The search of Xia 2015 as section 5.1 has it: point clouds of windows of poses, every frame of a class compared, in
//! `f64`.
//!
//! Over the points of both clouds, with weights `w` that sum to 1 and both clouds about their weighted centroids on the
//! floor, the least of eq. 1 over turn and translation is
//!
//! ```text
//! d² = Σ w |p|² + Σ w |p'|² - 2 (Σ w y y' + √(A² + B²))     A = Σ w (x x' + z z'), B = Σ w (x z' - z x')
//! ```
//!
//! With both clouds aligned to one mean cloud beforehand, as in the core, `A` stands in place of the root.

use gestus_core::{Database, blob::layout::flag};
use gestus_database::search::features::{Cloud, FeatureSpace, clouds};
use gestus_motion::{
    body::{Body, about_y},
    clip::Clip,
};
use nalgebra::Vector3;

use super::outputs::row;
use gestus_core::blob::layout::dof;

/// How clouds are compared.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Comparison {
    /// Each pair of clouds is aligned, as in eq. 1; otherwise both to the mean cloud, as in the core.
    pub pairwise: bool,
    /// Weights taper off in a line towards the oldest frame of the window, to a fifth with five frames.
    pub tapered: bool,
    /// Joints above the hips have no weight, as for contacts (section 6).
    pub legs: bool,
}

/// A cloud that is ready to be compared.
struct Prepared {
    points: Cloud,
    /// `Σ w |p|²`.
    norm2: f64,
}

/// Rows of a database with their clouds.
pub struct CloudSearch {
    comparison: Comparison,
    window: usize,
    /// Of each point; they sum to 1. Shape `[window · joints]`.
    weights: Vec<f64>,
    space: FeatureSpace,
    rows: Vec<(usize, Prepared)>,
}

impl CloudSearch {
    /// The searchable rows of some classes. `body` has the database's means.
    pub fn of(database: &Database<'_>, body: &Body, classes: &[usize], comparison: Comparison) -> Self {
        let window = database.counts().window;
        let found: Vec<(usize, Cloud)> = classes
            .iter()
            .map(|&class| database.class(class))
            .flat_map(|class| class.first_row..class.first_row + class.rows)
            .filter(|&r| database.flags(r) & flag::SEARCHABLE != 0)
            .map(|r| (r, cloud_of(database, body, r, window)))
            .collect();
        let sample: Vec<Cloud> =
            found.iter().step_by(found.len().div_ceil(500).max(1)).map(|f| f.1.clone()).collect();
        let space = FeatureSpace::of(body, &vec![0; body.skeleton.joints()], &sample, window, 1);
        let weights = weights(body, window, comparison);
        let mut search = Self { comparison, window, weights, space, rows: Vec::new() };
        search.rows = found.into_iter().map(|(r, cloud)| (r, search.prepared(&cloud))).collect();
        search
    }

    /// Of each frame of a clip, the nearest rows in ascending order with their squared distances, square metres.
    pub fn nearest(&self, clip: &Clip, most: usize) -> Vec<Vec<(usize, f64)>> {
        let nearest = |cloud: Cloud| {
            let query = self.prepared(&cloud);
            let mut all: Vec<(usize, f64)> =
                self.rows.iter().map(|(r, theirs)| (*r, self.distance2(&query, theirs))).collect();
            let most = most.min(all.len());
            if most < all.len() {
                all.select_nth_unstable_by(most, |a, b| a.1.total_cmp(&b.1));
            }
            all.truncate(most);
            all.sort_by(|a, b| a.1.total_cmp(&b.1));
            all
        };
        clouds(clip, self.window).into_iter().map(nearest).collect()
    }

    fn prepared(&self, cloud: &Cloud) -> Prepared {
        let points = if self.comparison.pairwise {
            let centre: Vector3<f64> = cloud.iter().zip(&self.weights).map(|(p, w)| p * *w).sum();
            cloud.iter().map(|p| p - Vector3::new(centre.x, 0.0, centre.z)).collect()
        } else {
            self.space.aligned(cloud)
        };
        let norm2 = points.iter().zip(&self.weights).map(|(p, w)| w * p.norm_squared()).sum();
        Prepared { points, norm2 }
    }

    fn distance2(&self, a: &Prepared, b: &Prepared) -> f64 {
        let (mut height, mut along, mut across) = (0.0, 0.0, 0.0);
        for ((p, q), w) in a.points.iter().zip(&b.points).zip(&self.weights) {
            height += w * p.y * q.y;
            along += w * (p.x * q.x + p.z * q.z);
            across += w * (p.x * q.z - p.z * q.x);
        }
        let ground = if self.comparison.pairwise { along.hypot(across) } else { along };
        (a.norm2 + b.norm2 - 2.0 * (height + ground)).max(0.0)
    }
}

/// The weight of each point.
fn weights(body: &Body, window: usize, comparison: Comparison) -> Vec<f64> {
    let joints = body.skeleton.joints();
    let mut legs = vec![false; joints];
    for j in 0..joints {
        let above = body.skeleton.parents[j].is_some_and(|parent| parent != 0 && legs[parent]);
        legs[j] = j == 0 || above || body.landmarks.hip_joints.contains(&j);
    }
    let of = |w: usize, j: usize| {
        let taper = if comparison.tapered { (w + 1) as f64 / window as f64 } else { 1.0 };
        if comparison.legs && !legs[j] { 0.0 } else { taper }
    };
    let all: Vec<f64> =
        (0..window).flat_map(|w| (0..joints).map(move |j| (w, j))).map(|(w, j)| of(w, j)).collect();
    let total: f64 = all.iter().sum();
    all.iter().map(|w| w / total).collect()
}

/// The window that ends with a row, with the ground under it as the rows' velocities have it. A clip's first row is
/// repeated before its start.
fn cloud_of(database: &Database<'_>, body: &Body, last: usize, window: usize) -> Cloud {
    let rate = f64::from(database.rate_hz());
    let (mut ground, mut heading) = ([0.0; 2], 0.0);
    let mut frames: Vec<Vec<Vector3<f64>>> = Vec::with_capacity(window);
    let mut at = last;
    for _ in 0..window {
        let dofs = row(database, at);
        frames.push(body.pose(&dofs, ground, heading).positions(&body.skeleton));
        if database.flags(at) & flag::FOLLOWS == 0 {
            continue;
        }
        at -= 1;
        heading -= dofs[dof::YAW] / rate;
        let moved = about_y(heading) * Vector3::new(dofs[dof::LEFT], 0.0, dofs[dof::FORWARD]) / rate;
        ground = [ground[0] - moved.x, ground[1] - moved.z];
    }
    frames.into_iter().rev().flatten().collect()
}

#[cfg(test)]
mod tests {
    use gestus_database::{
        build::{BuildOptions, build},
        synth,
    };

    use super::*;

    #[test]
    fn a_row_has_the_cloud_of_its_clip_and_is_its_own_nearest_wherever_the_clip_stands() {
        let corpus = synth::corpus(&synth::Options::of(&["walk"], &["neutral", "old"], 2, 4.0)).unwrap();
        let bytes = build(&corpus, &BuildOptions { models: false, ..BuildOptions::default() }).unwrap().bytes;
        let database = Database::open(&bytes).unwrap();
        let body = Body::of(&corpus).unwrap().with_means_of(&database);
        // The first class begins with the first clip; it is turned, and moved away.
        let mut clip = corpus.examples[0].clip.clone();
        for frame in &mut clip.frames {
            frame.root = about_y(2.0) * frame.root + Vector3::new(3.0, 0.0, -7.0);
            frame.rotations[0] = about_y(2.0) * frame.rotations[0];
        }
        for pairwise in [false, true] {
            for tapered in [false, true] {
                let comparison = Comparison { pairwise, tapered, legs: false };
                let search = CloudSearch::of(&database, &body, &[0], comparison);
                let nearest = search.nearest(&clip, 3);
                for t in (20..80).step_by(7) {
                    let (found, distance2) = nearest[t][0];
                    assert_eq!(found, t, "{comparison:?}");
                    assert!(distance2.sqrt() < 0.01 && nearest[t][1].1 >= distance2, "{distance2}");
                }
            }
        }
    }

    #[test]
    fn aligning_the_pair_is_never_further_than_aligning_both_to_a_third() {
        let corpus =
            synth::corpus(&synth::Options::of(&["walk", "run"], &["neutral", "old"], 1, 4.0)).unwrap();
        let bytes = build(&corpus, &BuildOptions { models: false, ..BuildOptions::default() }).unwrap().bytes;
        let database = Database::open(&bytes).unwrap();
        let body = Body::of(&corpus).unwrap().with_means_of(&database);
        let of = |pairwise| {
            let comparison = Comparison { pairwise, ..Comparison::default() };
            CloudSearch::of(&database, &body, &[0], comparison)
                .nearest(&corpus.examples.last().unwrap().clip, 1)
        };
        for (pair, mean) in of(true).iter().zip(of(false)) {
            assert!(pair[0].1 <= mean[0].1 + 1e-9, "{} {}", pair[0].1, mean[0].1);
        }
        let legs = weights(&body, 5, Comparison { legs: true, tapered: true, pairwise: true });
        assert!((legs.iter().sum::<f64>() - 1.0).abs() < 1e-12);
        let head = body.skeleton.find("Head").unwrap_or(body.skeleton.joints() - 1);
        assert!(legs[body.landmarks.feet[1]] > 0.0 && legs[head] == 0.0);
    }
}
