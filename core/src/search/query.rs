//! From a window of poses to a search feature.
//!
//! Two moments are alike where the clouds of their joints, over the last few frames, lie close after one of them
//! was turned about the vertical and moved over the floor (Xia 2015, eq. 1; Kovar, Gleicher, Pighin 2002). Done
//! for every pair that would cost a fit each; here every window is brought onto one **mean cloud** by the same
//! closed form, once, and then compared as it lies, in a few principal components.
//!
//! With weights w, mean cloud m and window p, both about their weighted ground centroids, the turn is
//! `(cos, sin) ∝ (Σ w (m_x p_x + m_z p_z), Σ w (m_x p_z - m_z p_x))`.
//!
//! Only the body group steers the fit, and every component looks at one joint group: a gesture of the arms moves
//! no feature of the legs, and a mask can leave the arms out.

use crate::{
    blob::{
        Database,
        layout::{MAX_FEATURES, MAX_GROUPS, MAX_WINDOW, query},
    },
    body::{kinematics, pose::Pose},
    math::{quaternion::Vector, sqrt},
};

/// A feature: the first F of its numbers are in use. Metres, weighted.
pub type Feature = [f32; MAX_FEATURES];

/// Numbers a joint that a window needs to be aligned in.
pub const ALIGNED: usize = 3 * MAX_WINDOW;

/// The joint positions of the last frames.
#[derive(Debug, Clone)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Window<const J: usize> {
    /// Ring of clouds, metres, world.
    clouds: [[Vector; J]; MAX_WINDOW],
    /// Place of the newest cloud in the ring.
    newest: u8,
    /// False until the first pose.
    filled: bool,
}

impl<const J: usize> Window<J> {
    /// As a constant that is all zeros it is written where it goes, whatever the level of optimisation.
    const NEW: Self = Self { clouds: [[[0.0; 3]; J]; MAX_WINDOW], newest: 0, filled: false };

    /// A window without a pose.
    #[inline(never)]
    pub const fn new() -> Self {
        Self::NEW
    }

    /// Forgets every pose.
    pub fn clear(&mut self) {
        self.filled = false;
    }

    /// Takes in a pose. The first one fills the window: nothing moved before it.
    #[inline(never)]
    pub fn push(&mut self, database: &Database<'_>, pose: &Pose<J>) {
        let place = (usize::from(self.newest) + 1) % MAX_WINDOW;
        kinematics::positions(database, pose, &mut self.clouds[place]);
        if !self.filled {
            let cloud = self.clouds[place];
            self.clouds.fill(cloud);
            self.filled = true;
        }
        self.newest = place as u8;
    }

    /// The newest cloud: world positions of the joints, metres.
    pub fn positions(&self) -> &[Vector; J] {
        &self.clouds[usize::from(self.newest) % MAX_WINDOW]
    }

    /// The feature of the window. Cost: `window · joints · 3` multiplications a component. `aligned` is room to work
    /// in, [`ALIGNED`] numbers a joint.
    pub fn feature(&self, database: &Database<'_>, aligned: &mut [f32], feature: &mut Feature) {
        let clouds = Clouds { points: self.clouds.as_flattened(), room: J, newest: usize::from(self.newest) };
        clouds.feature(database, &mut [0; J], aligned, feature);
    }
}

/// A window, whatever its capacity: what is compiled with the core, for speed, however its caller is.
#[derive(Clone, Copy)]
struct Clouds<'a> {
    points: &'a [Vector],
    /// Joints that a cloud has room for.
    room: usize,
    newest: usize,
}

impl<'a> Clouds<'a> {
    /// The cloud at that place of the ring.
    fn cloud(self, place: usize) -> &'a [Vector] {
        self.points.get((place % MAX_WINDOW) * self.room..).unwrap_or(&[])
    }

    /// `members` is room to work in, one number a joint.
    #[inline(never)]
    fn feature(
        self,
        database: &Database<'_>,
        members: &mut [u8],
        aligned: &mut [f32],
        feature: &mut Feature,
    ) {
        let ends = self.align(database, members, aligned);
        let counts = database.counts();
        let at = query::components(counts.window, counts.joints, counts.features);
        let mut components = database.query_section().get(at..).unwrap_or(&[]).as_chunks::<4>().0;
        for (f, value) in feature.iter_mut().enumerate().take(counts.features) {
            let group = database.feature_group(f);
            let start = group.checked_sub(1).and_then(|before| ends.get(before)).copied().unwrap_or(0);
            let end = ends.get(group).copied().unwrap_or(start);
            let points = aligned.get(start..end).unwrap_or(&[]);
            *value = dot(points, components);
            components = components.get(points.len()..).unwrap_or(&[]);
        }
    }

    /// Brings the window onto the mean cloud, and takes the mean cloud off it: the first joint group's joints from
    /// the oldest frame to the newest, then the next group's, as components are stored. Returns where each joint
    /// group's numbers end.
    fn align(self, database: &Database<'_>, members: &mut [u8], aligned: &mut [f32]) -> [usize; MAX_GROUPS] {
        let counts = database.counts();
        let (window, joints) = (counts.window.min(MAX_WINDOW), counts.joints.min(self.room));
        let data = database.query_section();
        let weights = data.get(query::weights(window, joints)..).unwrap_or(&[]).as_chunks::<4>().0;
        let weights = weights.iter().map(|w| f32::from_le_bytes(*w));
        let mean = data.as_chunks::<12>().0;
        let oldest = self.newest + MAX_WINDOW + 1 - window;
        // The clouds of the window, oldest first, each with its part of the mean cloud.
        let clouds = || {
            (0..window).map(move |w| {
                let mean = mean.get(w * joints..).unwrap_or(&[]).iter().map(point);
                self.cloud(oldest + w).iter().take(joints).zip(mean)
            })
        };

        let (mut total, mut cx, mut cz) = (0.0, 0.0, 0.0);
        for cloud in clouds() {
            for ((p, _), weight) in cloud.zip(weights.clone()) {
                total += weight;
                cx += weight * p[0];
                cz += weight * p[2];
            }
        }
        let inverse = 1.0 / total;
        (cx, cz) = (cx * inverse, cz * inverse);

        let (mut a, mut b) = (0.0, 0.0);
        for cloud in clouds() {
            for ((p, m), weight) in cloud.zip(weights.clone()) {
                let (x, z) = (p[0] - cx, p[2] - cz);
                a += weight * (m[0] * x + m[2] * z);
                b += weight * (m[0] * z - m[2] * x);
            }
        }
        let length = sqrt(a * a + b * b);
        let (c, s) = if length > 1e-12 { (a / length, b / length) } else { (1.0, 0.0) };
        let mut slots = aligned.as_chunks_mut::<3>().0.iter_mut();
        let mut ends = [0; MAX_GROUPS];
        let mut end = 0;
        for (group, slot) in ends.iter_mut().enumerate().take(counts.groups) {
            let own = database.groups().enumerate().filter(|(_, of)| *of == group);
            let count = members.iter_mut().zip(own).map(|(slot, (j, _))| *slot = j as u8).count();
            for w in 0..window {
                let cloud = self.cloud(oldest + w);
                let mean = mean.get(w * joints..).unwrap_or(&[]);
                for j in members.iter().take(count).map(|&j| usize::from(j)) {
                    let (Some(p), Some(m)) = (cloud.get(j), mean.get(j).map(point)) else { continue };
                    let (x, z) = (p[0] - cx, p[2] - cz);
                    if let Some(slot) = slots.next() {
                        *slot = [c * x + s * z - m[0], p[1] - m[1], c * z - s * x - m[2]];
                        end += 3;
                    }
                }
            }
            *slot = end;
        }
        ends
    }
}

/// A point of the mean cloud.
fn point(stored: &[u8; 12]) -> Vector {
    let (numbers, _) = stored.as_chunks::<4>();
    core::array::from_fn(|i| numbers.get(i).map_or(0.0, |n| f32::from_le_bytes(*n)))
}

/// The dot product of points and a stored component. Eight sums side by side, added in a fixed order, so that vector
/// units and scalar ones agree bit for bit.
fn dot(points: &[f32], component: &[[u8; 4]]) -> f32 {
    let mut sums = [0.0f32; 8];
    let (chunks, rest) = points.as_chunks::<8>();
    let (stored, stored_rest) = component.as_chunks::<8>();
    for (points, stored) in chunks.iter().zip(stored) {
        let term = |i: usize| points[i] * f32::from_le_bytes(stored[i]);
        // Written out, so that it is straight code whatever the compiler is told of loops.
        sums = [
            sums[0] + term(0),
            sums[1] + term(1),
            sums[2] + term(2),
            sums[3] + term(3),
            sums[4] + term(4),
            sums[5] + term(5),
            sums[6] + term(6),
            sums[7] + term(7),
        ];
    }
    // What does not fill eight lies behind the last eight taken.
    let stored = stored.get(chunks.len()).map_or(stored_rest, |next| next.as_slice());
    for ((sum, point), stored) in sums.iter_mut().zip(rest).zip(stored) {
        *sum += point * f32::from_le_bytes(*stored);
    }
    ((sums[0] + sums[4]) + (sums[2] + sums[6])) + ((sums[1] + sums[5]) + (sums[3] + sums[7]))
}

impl<const J: usize> Default for Window<J> {
    fn default() -> Self {
        Self::new()
    }
}
