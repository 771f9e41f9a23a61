//! Features: windows of joint positions, aligned to a mean cloud, as principal components (Xia 2015, section 5.1).
//! `gestus_core::search::query` does the same on the board, in whole numbers from the joint positions on.

use gestus_core::{
    blob::layout::{MAX_FEATURES, query},
    search::{metric::TOTAL, query::PRODUCT_BITS},
};
use nalgebra::{DMatrix, SymmetricEigen, Vector3};

use gestus_motion::{body::Body, clip::Clip, statistics::dot};

/// A window of joint positions, oldest frame first: shape `[window · joints]`, metres.
pub type Cloud = Vec<Vector3<f64>>;

/// The windows of a clip, one per frame, ending with that frame. The first frame is repeated before the start.
pub fn clouds(clip: &Clip, window: usize) -> Vec<Cloud> {
    let positions: Vec<Cloud> = clip.frames.iter().map(|f| f.positions(&clip.skeleton)).collect();
    (0..positions.len())
        .map(|t| {
            (0..window).flat_map(|w| positions[(t + w + 1).saturating_sub(window)].iter().copied()).collect()
        })
        .collect()
}

/// The feature space of a database.
#[derive(Debug, Clone)]
pub struct FeatureSpace {
    /// Frames of a window.
    pub window: usize,
    /// Mean cloud: weighted ground centroid at the origin, facing +Z. Shape `[window · joints]`.
    pub mean: Cloud,
    /// Weight of each joint in the alignment, shape `[joints]`.
    pub align_weights: Vec<u8>,
    /// Metres for one unit of length, in which core aligns windows: a power of two.
    pub unit: f64,
    /// Joint group of each component, ascending.
    pub groups: Vec<usize>,
    /// Components, weights folded in; zero outside their group. Shape `[features][window · joints · 3]`.
    pub components: Vec<Vec<f64>>,
    /// Metres per step of a stored i8, shape `[features]`.
    pub scales: Vec<f64>,
}

impl FeatureSpace {
    /// The space of a set of windows: mean cloud by alternating alignment and averaging, then principal
    /// components of each joint group (`joint_groups`: the group of each joint); the `most` of largest variance are kept.
    pub fn of(body: &Body, joint_groups: &[usize], clouds: &[Cloud], window: usize, most: usize) -> Self {
        let joints = body.skeleton.joints();
        // Arms gesture: they do not say where a body stands, whatever group they are in.
        let align_weights = body.landmarks.groups.iter().map(|&g| u8::from(g == 0)).collect();
        let mut space = Self {
            window,
            mean: start_cloud(body, &clouds[0]),
            align_weights,
            unit: 1.0,
            groups: Vec::new(),
            components: Vec::new(),
            scales: Vec::new(),
        };
        let sample: Vec<&Cloud> = clouds.iter().step_by(clouds.len().div_ceil(6000).max(1)).collect();
        for _ in 0..10 {
            let mut mean = vec![Vector3::zeros(); space.mean.len()];
            for cloud in &sample {
                for (m, p) in mean.iter_mut().zip(space.aligned(cloud)) {
                    *m += p / sample.len() as f64;
                }
            }
            space.mean = space.centred(&mean);
        }
        // Mean squared joint distance: every joint of every frame counts the same.
        let weight = (1.0 / (window * joints) as f64).sqrt();
        let samples: Vec<Vec<f64>> = sample
            .iter()
            .map(|c| {
                space
                    .aligned(c)
                    .iter()
                    .zip(&space.mean)
                    .flat_map(|(p, m)| ((p - m) * weight).data.0[0])
                    .collect()
            })
            .collect();
        let mut found: Vec<(f64, usize, Vec<f64>)> = Vec::new();
        for group in 0..=joint_groups.iter().copied().max().unwrap_or(0) {
            let coordinates: Vec<usize> =
                (0..3 * window * joints).filter(|i| joint_groups[i / 3 % joints] == group).collect();
            for (variance, vector) in principal(&samples, &coordinates) {
                let mut full = vec![0.0; 3 * window * joints];
                for (&at, v) in coordinates.iter().zip(vector) {
                    full[at] = v * weight;
                }
                found.push((variance, group, full));
            }
        }
        found.sort_by(|a, b| b.0.total_cmp(&a.0));
        found.truncate(most.min(MAX_FEATURES));
        // Group by group; within a group the largest first.
        found.sort_by_key(|f| f.1);
        space.groups = found.iter().map(|f| f.1).collect();
        space.components = found.into_iter().map(|f| f.2).collect();
        let mut scales = vec![1e-9f64; space.components.len()];
        let mut farthest = space.mean.iter().map(Vector3::amax).fold(1e-3, f64::max);
        for cloud in clouds {
            farthest = space.aligned(cloud).iter().map(Vector3::amax).fold(farthest, f64::max);
            for (scale, value) in scales.iter_mut().zip(space.feature(cloud)) {
                *scale = scale.max(value.abs() / 127.0);
            }
        }
        space.scales = on_one_grid(&scales);
        space.unit = (farthest / f64::from(i16::MAX)).log2().ceil().exp2();
        space
    }

    /// The feature of a window, metres.
    pub fn feature(&self, cloud: &Cloud) -> Vec<f64> {
        let flat: Vec<f64> =
            self.aligned(cloud).iter().zip(&self.mean).flat_map(|(p, m)| (p - m).data.0[0]).collect();
        self.components.iter().map(|c| dot(c, &flat)).collect()
    }

    /// A [`feature`](Self::feature) as stored.
    pub fn code(&self, feature: &[f64]) -> Vec<i8> {
        let scaled = feature.iter().zip(&self.scales).map(|(v, s)| (v / s).round());
        scaled.map(|v| v.clamp(-127.0, 127.0) as i8).collect()
    }

    fn centred(&self, cloud: &Cloud) -> Cloud {
        let weights = || self.align_weights.iter().map(|&w| f64::from(w));
        let total: f64 = weights().sum::<f64>() * self.window as f64;
        let centre: Vector3<f64> =
            cloud.iter().zip(weights().cycle()).map(|(p, w)| p * w).sum::<Vector3<f64>>() / total;
        cloud.iter().map(|p| p - Vector3::new(centre.x, 0.0, centre.z)).collect()
    }

    /// The cloud rotated about Y and translated on the floor to match the mean cloud (Xia 2015, eq. 1).
    pub fn aligned(&self, cloud: &Cloud) -> Cloud {
        let centred = self.centred(cloud);
        let (mut a, mut b) = (0.0, 0.0);
        for ((p, m), w) in centred.iter().zip(&self.mean).zip(self.align_weights.iter().cycle()) {
            let w = f64::from(*w);
            a += w * (m.x * p.x + m.z * p.z);
            b += w * (m.x * p.z - m.z * p.x);
        }
        let length = a.hypot(b);
        let (c, s) = if length > 1e-12 { (a / length, b / length) } else { (1.0, 0.0) };
        centred.iter().map(|p| Vector3::new(c * p.x + s * p.z, p.y, c * p.z - s * p.x)).collect()
    }

    /// The query section of the blob.
    pub fn section(&self, joint_groups: &[usize]) -> Vec<u8> {
        let (joints, features) = (joint_groups.len(), self.groups.len());
        let mut bytes = Vec::new();
        let mut put = |value: f64| bytes.extend((value as f32).to_le_bytes());
        // A component's largest number takes all of its bits.
        let parts: Vec<f64> = self
            .components
            .iter()
            .map(|c| c.iter().fold(1e-9, |most: f64, v| most.max(v.abs())) / f64::from(query::MAX_COMPONENT))
            .collect();
        put(self.unit);
        self.scales.iter().copied().for_each(&mut put);
        parts.iter().map(|part| self.unit * part * f64::from(1 << PRODUCT_BITS)).for_each(&mut put);
        let mut put = |value: f64| bytes.extend((value.round() as i16).to_le_bytes());
        self.mean.iter().flat_map(|p| p.data.0[0]).for_each(|v| put(v / self.unit));
        bytes.extend(&self.align_weights);
        bytes.extend(self.groups.iter().map(|&g| g as u8));
        bytes.resize(query::components(self.window, joints, features), 0);
        for ((component, part), &group) in self.components.iter().zip(parts).zip(&self.groups) {
            for (i, value) in component.iter().enumerate() {
                if joint_groups[i / 3 % joints] == group {
                    bytes.extend(((value / part).round() as i16).to_le_bytes());
                }
            }
        }
        bytes
    }
}

/// Scales at least as large whose squares are multiples of one unit and sum up to [`TOTAL`] of them: core weighs features
/// by these integers, without rounding.
fn on_one_grid(scales: &[f64]) -> Vec<f64> {
    let least_unit2 = scales.iter().map(|s| s * s).sum::<f64>() / (f64::from(TOTAL) - scales.len() as f64);
    let mut units: Vec<f64> = scales.iter().map(|s| (s * s / least_unit2).ceil()).collect();
    // What rounding up has left goes to the largest, which it changes least.
    let rest = f64::from(TOTAL) - units.iter().sum::<f64>();
    if let Some(largest) = units.iter_mut().max_by(|a, b| a.total_cmp(b)) {
        *largest += rest;
    }
    units.iter().map(|units| (units * least_unit2).sqrt()).collect()
}

/// Initial mean cloud: the first window, rotated to face +Z by the hips of its last frame.
fn start_cloud(body: &Body, cloud: &Cloud) -> Cloud {
    let joints = body.skeleton.joints();
    let last = &cloud[cloud.len() - joints..];
    let [left, right] = body.landmarks.hip_joints;
    let line = last[left] - last[right];
    let heading = (-line.z).atan2(line.x);
    cloud.iter().map(|p| gestus_motion::body::about_y(-heading) * p).collect()
}

/// Principal components of some coordinates of the samples (which have mean zero): variance and unit vector,
/// largest first. Signs are fixed by the largest entry.
fn principal(samples: &[Vec<f64>], coordinates: &[usize]) -> Vec<(f64, Vec<f64>)> {
    if coordinates.is_empty() {
        return Vec::new();
    }
    let data = DMatrix::from_fn(samples.len(), coordinates.len(), |i, j| samples[i][coordinates[j]]);
    let covariance = data.transpose() * &data / samples.len() as f64;
    let eigen = SymmetricEigen::new(covariance);
    let mut found: Vec<(f64, Vec<f64>)> = (0..coordinates.len())
        .map(|i| {
            let column = eigen.eigenvectors.column(i);
            let largest = column[column.icamax()];
            (eigen.eigenvalues[i], column.iter().map(|v| v * largest.signum()).collect())
        })
        .collect();
    found.sort_by(|a, b| b.0.total_cmp(&a.0));
    found.truncate(MAX_FEATURES);
    found
}
