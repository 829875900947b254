//! Segments near a direction.

use alloc::vec::Vec;

use drt_math::{Real, Vec3, fm};

/// Segments in a leaf of the tree.
const LEAF: usize = 4;

/// All points that a viewer sees within an angle of a direction, up to a distance.
#[derive(Clone, Copy, Debug)]
pub struct Cone {
    /// The viewer.
    pub apex: Vec3,
    /// Unit, the direction.
    pub axis: Vec3,
    /// Sine and cosine of the angle, which is less than a right one.
    turn: [f64; 2],
    /// The distance.
    reach: f64,
}

impl Cone {
    /// Of an `angle` in radians, less than a right one, around the unit direction `axis`.
    #[must_use]
    pub fn new(apex: Vec3, axis: Vec3, angle: f64, reach: f64) -> Self {
        let (sine, cosine) = fm::sin_cos(angle);
        Self { apex, axis, turn: [sine, cosine], reach }
    }

    /// False when no point of a sphere is in the cone.
    #[must_use]
    pub fn may_meet(&self, center: Vec3, radius: f64) -> bool {
        let to = center - self.apex;
        let along = to.dot(self.axis);
        let square = to.length_squared();
        let across = Real::sqrt(f64::max(square - along * along, 0.0));
        let [sine, cosine] = self.turn;
        let farthest = self.reach + radius;
        across * cosine - along * sine <= radius && square <= farthest * farthest
    }
}

/// Segments in a tree of spheres, to find those that may be in a [`Cone`].
#[derive(Clone, Debug, Default)]
pub struct ConeTree {
    /// In the order of a walk that goes down first.
    nodes: Vec<Node>,
    order: Vec<u32>,
}

#[derive(Clone, Copy, Debug)]
struct Node {
    center: Vec3,
    radius: f64,
    /// The node after all below this one.
    next: u32,
    /// In `order`; none for an inner node.
    leaf: [u32; 2],
}

impl ConeTree {
    /// Of segments, each by its ends and the number it is to be known by.
    #[must_use]
    pub fn new(segments: &[([Vec3; 2], u32)]) -> Self {
        let mut order: Vec<u32> = (0..segments.len() as u32).collect();
        let mut tree = Self::default();
        if !order.is_empty() {
            tree.split(segments, &mut order, 0);
        }
        tree.order = order.into_iter().map(|i| segments[i as usize].1).collect();
        tree
    }

    /// True without segments.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.nodes.is_empty()
    }

    fn split(&mut self, segments: &[([Vec3; 2], u32)], order: &mut [u32], first: u32) {
        let (mut low, mut high) = (Vec3::splat(f64::INFINITY), Vec3::splat(f64::NEG_INFINITY));
        for i in order.iter() {
            for end in segments[*i as usize].0 {
                (low, high) = (low.min(end), high.max(end));
            }
        }
        let (center, size) = ((low + high) * 0.5, high - low);
        let at = self.nodes.len();
        let end = first + order.len() as u32;
        let leaf = if order.len() <= LEAF { [first, end] } else { [0; 2] };
        self.nodes.push(Node { center, radius: 0.5 * size.length(), next: 0, leaf });
        if order.len() > LEAF {
            let size = size.to_array();
            let axis = (0..3).fold(0, |best, k| if size[k] > size[best] { k } else { best });
            let middle = |i: &u32| {
                let [a, b] = segments[*i as usize].0;
                (a + b).to_array()[axis]
            };
            let half = order.len() / 2;
            order.select_nth_unstable_by(half, |a, b| middle(a).total_cmp(&middle(b)));
            let (left, right) = order.split_at_mut(half);
            self.split(segments, left, first);
            self.split(segments, right, first + half as u32);
        }
        self.nodes[at].next = self.nodes.len() as u32;
    }

    /// Tells the numbers of all segments in a cone, and of some beside it.
    pub fn visit(&self, cone: &Cone, mut found: impl FnMut(u32)) {
        let mut at = 0;
        while let Some(node) = self.nodes.get(at) {
            if !cone.may_meet(node.center, node.radius) {
                at = node.next as usize;
                continue;
            }
            let [first, end] = node.leaf;
            self.order[first as usize..end as usize].iter().for_each(|i| found(*i));
            at += 1;
        }
    }
}

#[cfg(test)]
mod tests {
    use drt_math::{Rng, vec3};

    use super::*;

    fn point(rng: &mut Rng) -> Vec3 {
        vec3(rng.next_f64() - 0.5, rng.next_f64() - 0.5, rng.next_f64() - 0.5) * 2.0
    }

    /// Every segment of which some point is in the cone is told, and far from all are.
    #[test]
    fn segments_in_cones_are_told() {
        let mut rng = Rng::new(3, 0, 0);
        let segments: Vec<_> = (0..300)
            .map(|i| {
                let a = point(&mut rng);
                ([a, a + point(&mut rng) * 0.1], i)
            })
            .collect();
        let tree = ConeTree::new(&segments);
        let (mut inside, mut told) = (0, 0);
        for _ in 0..200 {
            let (apex, axis) = (point(&mut rng) * 1.5, point(&mut rng).normalize());
            let (angle, reach) = (0.3 * rng.next_f64(), 0.5 + rng.next_f64());
            let mut found = [false; 300];
            tree.visit(&Cone::new(apex, axis, angle, reach), |i| found[i as usize] = true);
            for ([a, b], i) in &segments {
                let seen = |k: u32| {
                    let to = *a + (*b - *a) * (f64::from(k) / 20.0) - apex;
                    to.length() < reach && to.normalize().dot(axis) > angle.cos()
                };
                if (0..=20).any(seen) {
                    inside += 1;
                    assert!(found[*i as usize]);
                }
            }
            told += found.iter().filter(|f| **f).count();
        }
        assert!(inside > 100 && told < 20 * inside, "{inside} {told}");
        ConeTree::default().visit(&Cone::new(Vec3::ZERO, vec3(0.0, 0.0, 1.0), 0.1, 1.0), |_| {
            panic!("there are none");
        });
    }
}
