//! Segments near a direction.

use alloc::vec::Vec;
use core::ops::ControlFlow;

use drt_math::{Real, Vec3, fm};

/// Segments in a leaf of the tree.
const LEAF: usize = 4;

/// All points that a viewer sees within an angle of a direction, up to a distance; or, for a viewer at infinity, all within
/// a distance of a line.
#[derive(Clone, Copy, Debug)]
pub struct Cone {
    /// The viewer, or a point of the line.
    pub apex: Vec3,
    /// Unit, the direction.
    pub axis: Vec3,
    /// Sine and cosine of the angle, which is less than a right one.
    turn: [f64; 2],
    /// The distance.
    reach: f64,
    /// From the line; none of a viewer that is not at infinity.
    radius: Option<f64>,
}

impl Cone {
    /// Of an `angle` in radians, less than a right one, around the unit direction `axis`.
    #[must_use]
    pub fn new(apex: Vec3, axis: Vec3, angle: f64, reach: f64) -> Self {
        let (sine, cosine) = fm::sin_cos(angle);
        Self { apex, axis, turn: [sine, cosine], reach, radius: None }
    }

    /// Of a `radius` around the line through a point along the unit direction `axis`.
    #[must_use]
    pub fn cylinder(through: Vec3, axis: Vec3, radius: f64) -> Self {
        Self { apex: through, axis, turn: [0.0, 1.0], reach: f64::INFINITY, radius: Some(radius) }
    }

    /// False when no point of a sphere is in the cone.
    #[must_use]
    pub fn may_meet(&self, center: Vec3, radius: f64) -> bool {
        self.may_meet_at(&Place::new(self, center), radius)
    }

    fn may_meet_at(&self, place: &Place, radius: f64) -> bool {
        let [sine, cosine] = self.turn;
        let farthest = self.reach + radius;
        // Without roots: how far the sphere's centre is outside, of which neither side is negative.
        let beside = radius + self.radius.unwrap_or(0.0) + place.along * sine;
        beside >= 0.0
            && place.across * (cosine * cosine) <= beside * beside
            && place.square <= farthest * farthest
    }
}

/// Where a point is, as cones of one apex and axis see it.
struct Place {
    along: f64,
    /// Squared distances, from the axis and from the apex.
    across: f64,
    square: f64,
}

impl Place {
    fn new(cone: &Cone, point: Vec3) -> Self {
        let to = point - cone.apex;
        let along = to.dot(cone.axis);
        let square = to.length_squared();
        Self { along, across: square - along * along, square }
    }
}

/// A segment of a [`ConeTree`].
#[derive(Clone, Copy, Debug)]
pub struct ConeSegment {
    /// Its ends.
    pub ends: [Vec3; 2],
    /// The number it is to be known by.
    pub name: u32,
    /// Of an edge that matters within a narrow cone only, unless it is a silhouette: unit normals of its two faces on one
    /// side of the surface.
    pub facets: Option<[Vec3; 2]>,
}

/// Segments in a tree of spheres, to find those that may be in a [`Cone`].
#[derive(Clone, Debug, Default)]
pub struct ConeTree {
    /// In the order of a walk that goes down first.
    nodes: Vec<Node>,
    leaves: Vec<Leaf>,
}

/// A segment as leaves list it.
#[derive(Clone, Copy, Debug)]
struct Leaf {
    name: u32,
    /// One of its ends.
    end: Vec3,
    facets: Option<[Vec3; 2]>,
}

impl Leaf {
    /// False of an edge whose facets are seen from one side.
    fn may_be_silhouette(&self, cone: &Cone) -> bool {
        let Some(facets) = self.facets else { return true };
        let view = if cone.radius.is_some() { cone.axis } else { self.end - cone.apex };
        let [front, other] = facets.map(|n| n.dot(view) > 0.0);
        front != other
    }
}

#[derive(Clone, Copy, Debug)]
struct Node {
    center: Vec3,
    radius: f64,
    /// The node after all below this one.
    next: u32,
    /// Which of the leaves' segments; none for an inner node.
    leaf: [u32; 2],
    normals: Normals,
}

/// A cone around the normals of facets, on either side: its axis, and the sine and cosine of its angle; a right one where there
/// are other segments.
#[derive(Clone, Copy, Debug)]
struct Normals {
    axis: Vec3,
    turn: [f64; 2],
}

impl Normals {
    const ANY: Self = Self { axis: Vec3::ZERO, turn: [1.0, 0.0] };

    fn new(facets: impl Iterator<Item = Option<[Vec3; 2]>> + Clone) -> Self {
        let Some(Some([first, _])) = facets.clone().next() else { return Self::ANY };
        let (mut sum, mut least) = (Vec3::ZERO, 1.0);
        for pair in facets.clone() {
            let Some([n, m]) = pair else { return Self::ANY };
            sum += if n.dot(first) < 0.0 { -n - m } else { n + m };
        }
        let axis = sum.normalize();
        for [n, m] in facets.flatten() {
            let side = if n.dot(first) < 0.0 { -1.0 } else { 1.0 };
            least = f64::min(least, f64::min(n.dot(axis) * side, m.dot(axis) * side));
        }
        if least > 0.0 && axis.is_finite() {
            Self { axis, turn: [Real::sqrt(1.0 - least * least), least] }
        } else {
            Self::ANY
        }
    }

    /// False when the viewer sees all facets in a sphere from one side.
    fn may_be_silhouettes(&self, cone: &Cone, center: Vec3, radius: f64) -> bool {
        let (view, radius) = match cone.radius {
            Some(_) => (cone.axis, 0.0),
            None => (center - cone.apex, radius),
        };
        let (square, [spread, narrow]) = (view.length_squared(), self.turn);
        let outside = square - radius * radius;
        // With the sphere's angle, whose sine is its radius over the distance, the sum of both angles must be less than a right one,
        // and the view nearer to the axis than what is left.
        if outside.is_nan() || radius * radius >= narrow * narrow * square {
            return true;
        }
        Real::abs(self.axis.dot(view)) <= spread * Real::sqrt(outside) + narrow * radius
    }
}

impl ConeTree {
    /// Of segments.
    #[must_use]
    pub fn new(segments: &[ConeSegment]) -> Self {
        let mut order: Vec<u32> = (0..segments.len() as u32).collect();
        let mut tree = Self::default();
        if !order.is_empty() {
            tree.split(segments, &mut order, 0);
        }
        let leaf = |i: u32| {
            let ConeSegment { ends: [end, _], name, facets } = segments[i as usize];
            Leaf { name, end, facets }
        };
        tree.leaves = order.into_iter().map(leaf).collect();
        tree
    }

    /// True without segments.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.nodes.is_empty()
    }

    fn split(&mut self, segments: &[ConeSegment], order: &mut [u32], first: u32) {
        let (mut low, mut high) = (Vec3::splat(f64::INFINITY), Vec3::splat(f64::NEG_INFINITY));
        for i in order.iter() {
            for end in segments[*i as usize].ends {
                (low, high) = (low.min(end), high.max(end));
            }
        }
        let (center, size) = ((low + high) * 0.5, high - low);
        let at = self.nodes.len();
        let end = first + order.len() as u32;
        let leaf = if order.len() <= LEAF { [first, end] } else { [0; 2] };
        let normals = Normals::new(order.iter().map(|i| segments[*i as usize].facets));
        self.nodes.push(Node { center, radius: 0.5 * size.length(), next: 0, leaf, normals });
        if order.len() > LEAF {
            let half = order.len() / 2;
            let axis = widest(size);
            let middle = |i: &u32| {
                let [a, b] = segments[*i as usize].ends;
                (a + b).to_array()[axis]
            };
            order.select_nth_unstable_by(half, |a, b| middle(a).total_cmp(&middle(b)));
            let (left, right) = order.split_at_mut(half);
            self.split(segments, left, first);
            self.split(segments, right, first + half as u32);
        }
        self.nodes[at].next = self.nodes.len() as u32;
    }

    /// Tells the numbers of all segments in a cone, and of some beside it, until `found` says to stop. Of facets' edges that
    /// are no silhouettes only those in a `narrow` one with the same apex and axis must be told.
    pub fn visit<B>(
        &self,
        cone: &Cone,
        narrow: &Cone,
        mut found: impl FnMut(u32) -> ControlFlow<B>,
    ) -> ControlFlow<B> {
        let mut at = 0;
        while let Some(node) = self.nodes.get(at) {
            let Node { center, radius, .. } = *node;
            let place = Place::new(cone, center);
            let in_narrow = narrow.may_meet_at(&place, radius);
            let met = cone.may_meet_at(&place, radius)
                && (in_narrow || node.normals.may_be_silhouettes(cone, center, radius));
            if !met {
                at = node.next as usize;
                continue;
            }
            let [first, end] = node.leaf;
            for leaf in &self.leaves[first as usize..end as usize] {
                if in_narrow || leaf.may_be_silhouette(cone) {
                    found(leaf.name)?;
                }
            }
            at += 1;
        }
        ControlFlow::Continue(())
    }
}

/// The axis along which a box is longest.
fn widest(size: Vec3) -> usize {
    let size = size.to_array();
    (0..3).fold(0, |best, k| if size[k] > size[best] { k } else { best })
}

#[cfg(test)]
mod tests {
    use drt_math::{Rng, vec3};

    use super::*;

    fn point(rng: &mut Rng) -> Vec3 {
        vec3(rng.next_f64() - 0.5, rng.next_f64() - 0.5, rng.next_f64() - 0.5) * 2.0
    }

    fn all(tree: &ConeTree, cone: &Cone, narrow: &Cone, found: &mut [bool]) -> ControlFlow<()> {
        tree.visit(cone, narrow, |i| {
            found[i as usize] = true;
            ControlFlow::Continue(())
        })
    }

    /// Every segment of which some point is in the cone is told, and far from all are.
    #[test]
    fn segments_in_cones_are_told() {
        let mut rng = Rng::new(3, 0, 0);
        let segments: Vec<_> = (0..300)
            .map(|i| {
                let a = point(&mut rng);
                let ends = [a, a + point(&mut rng) * 0.1];
                ConeSegment { ends, name: i, facets: None }
            })
            .collect();
        let tree = ConeTree::new(&segments);
        let (mut inside, mut told) = (0, 0);
        for _ in 0..200 {
            let (apex, axis) = (point(&mut rng) * 1.5, point(&mut rng).normalize());
            let (angle, reach) = (0.3 * rng.next_f64(), 0.5 + rng.next_f64());
            let mut found = [false; 300];
            let cone = Cone::new(apex, axis, angle, reach);
            let _ = all(&tree, &cone, &cone, &mut found);
            for ConeSegment { ends: [a, b], name: i, .. } in &segments {
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
        let cone = Cone::new(Vec3::ZERO, vec3(0.0, 0.0, 1.0), 0.1, 1.0);
        assert!(all(&ConeTree::default(), &cone, &cone, &mut []).is_continue());
    }

    /// Of a sphere, all silhouettes in the wide cone are told, and few others.
    #[test]
    fn silhouettes_of_spheres_are_told() {
        let mut rng = Rng::new(9, 0, 0);
        let segments: Vec<_> = (0..4000)
            .map(|name| {
                let n = point(&mut rng).normalize();
                let m = (n + point(&mut rng) * 0.02).normalize();
                let side = n.cross(m).normalize() * 0.02;
                let facets = if name % 2 == 0 { [n, m] } else { [-n, -m] };
                ConeSegment { ends: [n - side, n + side], name, facets: Some(facets) }
            })
            .collect();
        let tree = ConeTree::new(&segments);
        let (mut silhouettes, mut told) = (0, 0);
        for _ in 0..100 {
            let apex = point(&mut rng).normalize() * 3.0;
            let axis = (point(&mut rng) * 0.5 - apex).normalize();
            let [wide, narrow] = [0.3, 0.01].map(|a| Cone::new(apex, axis, a, f64::INFINITY));
            let mut found = alloc::vec![false; segments.len()];
            let _ = all(&tree, &wide, &narrow, &mut found);
            told += found.iter().filter(|f| **f).count();
            for s in &segments {
                let [n, m] = s.facets.unwrap().map(|n| n.dot(s.ends[0] - apex) > 0.0);
                if n != m && (s.ends[0] - apex).normalize().dot(axis) > f64::cos(0.29) {
                    silhouettes += 1;
                    assert!(found[s.name as usize]);
                }
            }
        }
        assert!(silhouettes > 300 && told < 30_000, "{silhouettes} {told}");
    }
}
