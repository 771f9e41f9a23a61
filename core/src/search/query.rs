//! Turns a window of poses into a search feature.
//!
//! Two moments are alike if the clouds of their joints over the last few frames lie close together after one of them was
//! turned about the vertical axis and moved over the floor (Xia 2015, eq. 1; Kovar, Gleicher, Pighin 2002). That needs a fit
//! for every pair. Here every window is aligned once to a **mean cloud**, by the same closed form. Aligned windows are
//! compared directly, in a few principal components.
//!
//! With weights w, mean cloud m and window p, both about their weighted centroids on the ground, the rotation is
//! `(cos, sin) ∝ (Σ w (m_x p_x + m_z p_z), Σ w (m_x p_z - m_z p_x))`.
//!
//! Poses are f32. From the joint positions on, all numbers are integers in the database's unit of length (a sixteenth of a
//! millimetre for a human): aligned coordinates have 17 bits, and their products with the components 31.
//!
//! Only the body group determines the alignment, and every component belongs to one joint group. A gesture of the arms thus
//! changes no feature of the legs, and a mask can leave the arms out.

use crate::{
    blob::{
        Database,
        layout::{MAX_FEATURES, MAX_GROUPS, MAX_WINDOW, query},
    },
    body::{
        kinematics::{self, Point},
        pose::Pose,
    },
    math::{fixed::quotient, sqrt},
};

/// A feature: principal components in weighted metres. The first F are in use.
pub type Feature = [f32; MAX_FEATURES];

/// Numbers a joint in the scratch memory of the alignment.
pub const ALIGNED: usize = 3 * MAX_WINDOW;

/// Fractional bits of a joint's position, in units of length. At a sixteenth of a millimetre heights have a range of 8 km, and
/// places on the ground wrap around after 16.
const FRACTION: u32 = 4;

/// Greatest size of an aligned coordinate, units of length. Larger ones are clamped.
const MAX_COORDINATE: i32 = u16::MAX as i32;
/// Fractional bits of a sine.
const TURN_BITS: u32 = 24;
/// Right shift of a product with a component, so that the sum of 3 · 8 · 64 products fits 32 bits.
pub const PRODUCT_BITS: u32 = 10;
/// Left shift of an aligned coordinate. Cortex-M processors with an FPU can multiply 32 by 16 bits and add the product
/// without its lowest 16 bits in one instruction. On the others a product has to fit 32 bits.
const PRE_SHIFT: u32 =
    if cfg!(all(target_arch = "arm", target_abi = "eabihf")) { 16 - PRODUCT_BITS } else { 0 };

/// The joint positions of the last frames.
#[derive(Debug, Clone)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Window<const J: usize> {
    /// Ring of clouds of joint positions in world space, units of length with [`FRACTION`] fractional bits.
    clouds: [[Point; J]; MAX_WINDOW],
    /// Index of the newest cloud.
    newest: u8,
    /// False until the first pose.
    filled: bool,
}

impl<const J: usize> Window<J> {
    /// A constant of zeros, which every optimisation level writes in place.
    const NEW: Self = Self { clouds: [[[0; 3]; J]; MAX_WINDOW], newest: 0, filled: false };

    /// A window without a pose.
    #[inline(never)]
    pub const fn new() -> Self {
        Self::NEW
    }

    /// Removes all poses.
    pub fn clear(&mut self) {
        self.filled = false;
    }

    /// Adds a pose. The first pose fills the whole window.
    #[inline(never)]
    pub fn push(&mut self, database: &Database<'_>, pose: &Pose<J>) {
        let place = (usize::from(self.newest) + 1) % MAX_WINDOW;
        let parts = (1 << FRACTION) as f32 / database.length_unit();
        kinematics::positions(database, pose, parts, &mut self.clouds[place]);
        if !self.filled {
            let cloud = self.clouds[place];
            self.clouds.fill(cloud);
            self.filled = true;
        }
        self.newest = place as u8;
    }

    /// Computes the feature of the window. `aligned` is scratch memory of [`ALIGNED`] numbers a joint. Cost: `window ·
    /// joints · 3` multiplications a component.
    pub fn feature(&self, database: &Database<'_>, aligned: &mut [i32], feature: &mut Feature) {
        let clouds =
            Clouds { points: self.clouds.as_flattened(), capacity: J, newest: usize::from(self.newest) };
        clouds.feature(database, &mut [0; J], aligned, feature);
    }
}

/// A window as a slice. Not generic over capacities, so that it is compiled with the core, optimised for speed.
#[derive(Clone, Copy)]
struct Clouds<'a> {
    /// All clouds, one after the other.
    points: &'a [Point],
    /// Number of joints in the memory of a cloud.
    capacity: usize,
    /// Index of the newest cloud.
    newest: usize,
}

impl<'a> Clouds<'a> {
    /// The cloud at an index of the ring, which may wrap.
    fn cloud(self, place: usize) -> &'a [Point] {
        self.points.get((place % MAX_WINDOW) * self.capacity..).unwrap_or(&[])
    }

    /// See [`Window::feature`]. `members` is scratch memory of one number a joint.
    #[inline(never)]
    fn feature(
        self,
        database: &Database<'_>,
        members: &mut [u8],
        aligned: &mut [i32],
        feature: &mut Feature,
    ) {
        let ends = self.align(database, members, aligned);
        let counts = database.counts();
        let at = query::components(counts.window, counts.joints, counts.features);
        let mut components = database.query_section().get(at..).unwrap_or(&[]).as_chunks::<2>().0;
        for (f, (value, &group)) in feature.iter_mut().zip(database.feature_groups()).enumerate() {
            let group = usize::from(group);
            let start = group.checked_sub(1).and_then(|before| ends.get(before)).copied().unwrap_or(0);
            let end = ends.get(group).copied().unwrap_or(start);
            let points = aligned.get(start..end).unwrap_or(&[]);
            *value = database.component_step(f) * dot(points, components) as f32;
            components = components.get(points.len()..).unwrap_or(&[]);
        }
    }

    /// Aligns the window to the mean cloud, and subtracts the mean cloud. `aligned` gets the order in which components are
    /// stored: the first joint group's joints from the oldest frame to the newest, then the next group's. Returns where the
    /// numbers of each joint group end.
    fn align(self, database: &Database<'_>, members: &mut [u8], aligned: &mut [i32]) -> [usize; MAX_GROUPS] {
        let counts = database.counts();
        let (window, joints) = (counts.window.min(MAX_WINDOW), counts.joints.min(self.capacity));
        let data = database.query_section();
        let weights = data.get(query::weights(window, joints, counts.features)..).unwrap_or(&[]);
        let mean = data.get(query::mean(counts.features)..).unwrap_or(&[]).as_chunks::<6>().0;
        let oldest = self.newest + MAX_WINDOW + 1 - window;
        let [root_x, _, root_z] = self.cloud(self.newest).first().copied().unwrap_or_default();
        // Relative to the root's current position.
        let relative = |p: &Point| {
            [p[0].wrapping_sub(root_x), p[2].wrapping_sub(root_z)]
                .map(|v| v.clamp(-MAX_COORDINATE << FRACTION, MAX_COORDINATE << FRACTION))
        };
        let units = |parts: i32| parts.saturating_add(1 << (FRACTION - 1)) >> FRACTION;
        let order = Joints::by_group(database, members, joints);
        let weight = |j: u8| weights.get(usize::from(j)).map_or(0, |&weight| i32::from(weight));
        let mean = |w: usize| mean.get(w * joints..).unwrap_or(&[]);

        // The final heights, the positions on the ground relative to the root, and the weighted centroid.
        let (mut total, mut cx, mut cz) = (0i64, 0i64, 0i64);
        let ends = order.visit(window, aligned, |w, group_joints, slots| {
            let (cloud, mean) = (self.cloud(oldest + w), mean(w));
            for (slot, &j) in slots.iter_mut().zip(group_joints) {
                let place = usize::from(j);
                let (Some(p), Some(m)) = (cloud.get(place), mean.get(place).map(point)) else { continue };
                let [x, z] = relative(p);
                *slot = [x, clamp_coordinate(units(p[1]).saturating_sub(m[1])) << PRE_SHIFT, z];
                let weight = weight(j);
                total += i64::from(weight);
                // Below 2^28.
                cx += i64::from(weight * x);
                cz += i64::from(weight * z);
            }
        });
        let [cx, cz] = [cx, cz].map(|sum| quotient(sum, total as u32));

        let (mut a, mut b) = (0i64, 0i64);
        order.visit(window, aligned, |w, group_joints, slots| {
            let mean = mean(w);
            for (slot, &j) in slots.iter_mut().zip(group_joints) {
                let (x, z) = (slot[0] - cx, slot[2] - cz);
                (slot[0], slot[2]) = (x, z);
                let weight = weight(j);
                let m = mean.get(usize::from(j)).map(point).filter(|_| weight != 0);
                if let Some(m) = m {
                    let [mx, mz, x, z] = [weight * m[0], weight * m[2], x, z].map(i64::from);
                    a += mx * x + mz * z;
                    b += mx * z - mz * x;
                }
            }
        });
        let (a, b) = (a as f32, b as f32);
        let length = sqrt(a * a + b * b);
        let (c, s) = if length > 0.0 { (a / length, b / length) } else { (1.0, 0.0) };
        let [c, s] = [c, s].map(|v| (v * (1 << TURN_BITS) as f32) as i32);
        // A coordinate on the ground lies within 2^22 parts, the sum of both products within 2^47.
        let rotated = |v: i64| ((v + (1 << (TURN_BITS + FRACTION - 1))) >> (TURN_BITS + FRACTION)) as i32;
        order.visit(window, aligned, |w, group_joints, slots| {
            let mean = mean(w);
            for (slot, &j) in slots.iter_mut().zip(group_joints) {
                let Some(m) = mean.get(usize::from(j)).map(point) else { continue };
                let [x, z, c, s] = [slot[0], slot[2], c, s].map(i64::from);
                slot[0] = clamp_coordinate(rotated(c * x + s * z).saturating_sub(m[0])) << PRE_SHIFT;
                slot[2] = clamp_coordinate(rotated(c * z - s * x).saturating_sub(m[2])) << PRE_SHIFT;
            }
        });
        ends
    }
}

/// The joints sorted by joint group, as components are stored.
struct Joints<'a> {
    /// Numbers of the joints.
    members: &'a [u8],
    /// Where each joint group ends in `members`.
    ends: [usize; MAX_GROUPS],
}

impl<'a> Joints<'a> {
    fn by_group(database: &Database<'_>, members: &'a mut [u8], joints: usize) -> Self {
        let mut ends = [0; MAX_GROUPS];
        for group in database.groups().take(joints) {
            if let Some(count) = ends.get_mut(group) {
                *count += 1;
            }
        }
        // Each end is at first the start of its group, and moves with every joint of the group.
        let mut start = 0;
        for end in &mut ends {
            start += core::mem::replace(end, start);
        }
        for (j, group) in database.groups().enumerate().take(joints) {
            let Some(end) = ends.get_mut(group) else { continue };
            if let Some(member) = members.get_mut(*end) {
                *member = j as u8;
            }
            *end += 1;
        }
        Self { members, ends }
    }

    /// Calls `visitor` for each joint group and each frame of the window, the oldest first, with the number of the
    /// frame, the group's joints, and their slots in `aligned`. Returns where the numbers of each joint group end.
    #[inline(always)]
    fn visit(
        &self,
        window: usize,
        aligned: &mut [i32],
        mut visitor: impl FnMut(usize, &[u8], &mut [Point]),
    ) -> [usize; MAX_GROUPS] {
        let mut rest = aligned.as_chunks_mut::<3>().0;
        let (mut start, mut numbers) = (0, 0);
        self.ends.map(|end| {
            let group_joints = self.members.get(start..end).unwrap_or(&[]);
            start = end.max(start);
            for w in 0..window {
                let (slots, others) =
                    core::mem::take(&mut rest).split_at_mut_checked(group_joints.len()).unwrap_or_default();
                visitor(w, group_joints, slots);
                numbers += 3 * slots.len();
                rest = others;
            }
            numbers
        })
    }
}

/// Clamps a coordinate to 17 bits.
fn clamp_coordinate(coordinate: i32) -> i32 {
    coordinate.clamp(-MAX_COORDINATE, MAX_COORDINATE)
}

/// Decodes a point of the mean cloud.
fn point(stored: &[u8; 6]) -> Point {
    let (numbers, _) = stored.as_chunks::<2>();
    core::array::from_fn(|i| numbers.get(i).map_or(0, |&n| i32::from(i16::from_le_bytes(n))))
}

/// The product of an aligned coordinate with a stored number, shifted by [`PRODUCT_BITS`].
#[inline(always)]
fn product(point: i32, stored: [u8; 2]) -> i32 {
    let stored = i16::from_le_bytes(stored);
    if PRE_SHIFT != 0 {
        ((i64::from(point) * i64::from(stored)) >> (PRE_SHIFT + PRODUCT_BITS)) as i32
    } else {
        (point * i32::from(stored)) >> PRODUCT_BITS
    }
}

/// Number of products in straight code: those of a joint in a window of four frames, where the operands fit the registers.
const STRAIGHT: usize = if PRE_SHIFT != 0 { 12 } else { 4 };

/// The sum of the products of an aligned window with a stored component, each shifted by [`PRODUCT_BITS`].
fn dot(points: &[i32], component: &[[u8; 2]]) -> i32 {
    // Compensates for the shifts, which round down by half on average.
    let mut sum = points.len() as i32 / 2;
    let (chunks, rest) = points.as_chunks::<STRAIGHT>();
    let (stored, stored_rest) = component.as_chunks::<STRAIGHT>();
    // Not zipped: the compiler would compute every address from one index.
    let (mut next_chunk, mut next_stored) = (chunks.iter(), stored.iter());
    while let (Some(p), Some(c)) = (next_chunk.next(), next_stored.next()) {
        let mut add = |i: usize| {
            if let (Some(p), Some(c)) = (p.as_chunks::<4>().0.get(i), c.as_chunks::<4>().0.get(i)) {
                sum = sum
                    + product(p[0], c[0])
                    + product(p[1], c[1])
                    + product(p[2], c[2])
                    + product(p[3], c[3]);
            }
        };
        // Written out, so that the code is straight at any optimisation level.
        add(0);
        add(1);
        add(2);
    }
    // The rest does not fill a chunk.
    let stored = stored.get(chunks.len()).map_or(stored_rest, |next| next.as_slice());
    rest.iter().zip(stored).fold(sum, |sum, (&p, &c)| sum + product(p, c))
}

impl<const J: usize> Default for Window<J> {
    fn default() -> Self {
        Self::new()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_product_of_a_window_counts_once() {
        let points: [i32; 40] = core::array::from_fn(|i| (9_973 * i as i32) % 131_071 - 65_535);
        let component: [[u8; 2]; 50] = core::array::from_fn(|i| ((i as i16 - 20) * 1_001).to_le_bytes());
        for length in 0..=points.len() {
            let products = points[..length].iter().zip(component).map(|(&p, c)| {
                (i64::from(p) * i64::from(i16::from_le_bytes(c))).div_euclid(1 << PRODUCT_BITS) as i32
            });
            let wanted = products.sum::<i32>() + length as i32 / 2;
            let shifted = points.map(|p| p << PRE_SHIFT);
            assert_eq!(dot(&shifted[..length], &component), wanted, "{length}");
        }
    }
}
