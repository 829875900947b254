//! What a node knows of its segments, and what it makes of that from a viewpoint.
//!
//! A face of normal n through the edge point p turns its front to x where n.(x - p) > 0, the same
//! for all points of the edge. About the middle m of a node's box,
//!
//! ```text
//! n.(x - p) = n.(x - m) + n.(m - p),
//! ```
//!
//! so that a box of the normals and a range of the offsets n.(m - p) bound it over all faces: a box
//! in the dual space of planes (Hertzmann & Zorin 2000, "Illustrating Smooth Surfaces", section 4;
//! Olson & Zhang 2006, "Silhouette Extraction in Hough Space"). On a smooth patch the offsets are of
//! second order in its size. A cone of normals around a sphere of points (Sander et al. 2000,
//! "Silhouette Clipping", section 4) has an error of first order instead, and offers as silhouettes
//! several times as many edges.
//!
//! With fronts in the range M ± H, an edge is a silhouette only if 0 is in it. If they spread over
//! it like a triangle, of density (1 - |M| / H) / H at 0, and those of one edge's two faces n, n'
//! lie |n - n'| |x - m| apart at most, half of it in the mean, then 0 separates them with the
//! probability
//!
//! ```text
//! |n - n'| |x - m| (1 - |M| / H) / (2 H).
//! ```

use drt_math::Vec3;

use crate::edges::tree::eight::{Eight, LANES, Vectors, dot, each, pairs, same, vectors};
use crate::edges::tree::piece::Piece;
use crate::edges::tree::seen::{ALMOST_NOTHING, Lies, Local, Place, Seen, Toward, weights};

/// The density of fronts at the ends of their range, as a part of that in the middle.
const LEAST_DENSITY: f32 = 0.05;

/// From within a box, segments are taken to be as near as this part of half its diagonal, squared.
/// Measured on spheres, dents and cubes: with more, close edges come too seldom, with less, too often.
const CLOSEST: f32 = 0.04;

/// Nodes nearer than this, in half diagonals of their boxes, are near.
const NEAR: f32 = 0.5;

/// What is taken of a weight at least, in comparison with the greatest: what counts little still counts.
pub(super) const LEAST_WEIGHT: f64 = 1e-20;

/// What is known of a set of segments.
#[derive(Clone, Copy, Debug)]
pub(super) struct Node {
    /// The corners of the segments' box.
    pub(super) corners: [Vec3; 2],
    /// The middle m of the box, and half its edges.
    center: Vec3,
    half: Vec3,
    /// The box of the normals of all faces.
    normal: [Vec3; 2],
    /// The range of n.(m - p), over every face's normal n and its edge's points p.
    offset: [f64; 2],
    /// Sums of length times prior: of open edges, of others as silhouettes, the latter times half the
    /// distance of both normals, and as creases seen from the front and from the back.
    sums: [f64; 5],
}

impl Node {
    pub(super) fn around<'a>(pieces: impl Iterator<Item = &'a Piece> + Clone) -> Self {
        let points = pieces.clone().flat_map(|p| p.line.ends());
        let corners = range(points);
        let [center, half] = middle(corners);
        let normal = middle(range(pieces.clone().flat_map(|p| p.faces)));
        let offsets = pieces.clone().flat_map(|p| p.faces.map(|n| n.dot(center - p.line.a)));
        let offset = middle(range(offsets.map(Vec3::splat))).map(|v| v.x);
        let sum =
            |weight: fn(&Piece) -> f64| pieces.clone().map(|p| weight(p) * p.line.length).sum();
        let sums = [
            sum(|p| if p.open { p.discontinuity } else { 0.0 }),
            sum(|p| if p.open { 0.0 } else { p.discontinuity }),
            sum(|p| 0.5 * p.discontinuity * (p.faces[1] - p.faces[0]).length()),
            sum(|p| if p.open { 0.0 } else { p.crease[0] }),
            sum(|p| if p.open { 0.0 } else { p.crease[1] }),
        ];
        Self { corners, center, half, normal, offset, sums }
    }
}

/// What a node's child is.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Child {
    /// The first of its [bundles](super::bundle), or the family of its own children.
    pub(super) first: u32,
    /// How many bundles; 0 for what has children.
    pub(super) bundles: u32,
}

/// The children of a node.
#[derive(Clone, Debug)]
pub(super) struct Family {
    place: Place,
    center: Vectors,
    half: Vectors,
    normal: [Vectors; 2],
    offset: [Eight; 2],
    /// As parts of the `unit`.
    open: Eight,
    discontinuity: Eight,
    crease: [Eight; 2],
    /// Half the distance of two faces' normals, in the mean.
    turning: Eight,
    /// In these the weights count.
    pub(super) unit: f64,
    pub(super) children: [Child; LANES],
    /// How many segments there are below.
    pub(super) count: u32,
}

/// What ways of looking ask of a family's nodes from a viewpoint.
pub(super) struct Boxes {
    local: Local,
    /// From the viewpoint.
    center: Vectors,
    /// How far away the boxes are, squared.
    outside2: Eight,
}

impl Family {
    pub(super) fn new(nodes: &[(Node, Child)], count: usize) -> Self {
        let all = range(nodes.iter().flat_map(|(n, _)| n.corners));
        let place = Place::new(all[0], all[1]);
        let nodes_only = nodes.iter().map(|(n, _)| n);
        let largest = nodes_only.clone().flat_map(|n| [n.sums[0], n.sums[1], n.sums[3], n.sums[4]]);
        let largest = largest.fold(0.0, f64::max);
        let part = |sum: f64| if sum > 0.0 { (sum / largest).max(LEAST_WEIGHT) } else { 0.0 };
        let sums = |k: usize| Eight::gather(nodes_only.clone().map(|n| part(n.sums[k])));
        let turning = |n: &Node| if n.sums[1] > 0.0 { n.sums[2] / n.sums[1] } else { 0.0 };
        let scaled =
            |f: fn(&Node) -> f64| Eight::gather(nodes_only.clone().map(|n| f(n) * place.scale));
        let mut children = [Child::default(); LANES];
        children.iter_mut().zip(nodes).for_each(|(c, (_, child))| *c = *child);
        Self {
            place,
            center: vectors(nodes_only.clone().map(|n| place.of(n.center))),
            half: vectors(nodes_only.clone().map(|n| n.half * place.scale)),
            normal: [0, 1].map(|k| vectors(nodes_only.clone().map(|n| n.normal[k]))),
            offset: [scaled(|n| n.offset[0]), scaled(|n| n.offset[1])],
            open: sums(0),
            discontinuity: sums(1),
            crease: [sums(3), sums(4)],
            turning: Eight::gather(nodes_only.clone().map(turning)),
            unit: largest * place.scale * place.scale,
            children,
            count: count as u32,
        }
    }

    /// Estimates of the integrals over the segments of kernel, scattering and weight, in multiples of
    /// the unit; 0 only if none of them counts.
    #[inline(always)]
    pub(super) fn weigh(&self, seen: &Seen) -> (Eight, Boxes) {
        let local = seen.local(&self.place);
        let tolerance = Eight::splat(local.tolerance);
        let from = pairs(local.x(), self.center, |a, b| a - b);
        let length2 = dot(from, from);
        let out = pairs(from, self.half, |f, h| (f.abs() - h).max(Eight::ZERO));
        let outside2 = dot(out, out);
        let kinds = self.kinds(from, length2.sqrt(), tolerance);
        let size2 = dot(self.half, self.half);
        let third = size2 * (1.0 / 3.0);
        let r2 = length2 + third;
        let r = r2.sqrt();
        let (counts, cosine) = match seen.normal {
            Some(normal) => {
                let cosine = self.cosine(normal, from, tolerance, r);
                (Eight::ZERO.less(cosine, kinds, Eight::ZERO), cosine)
            }
            None => (kinds, Eight::ONE),
        };
        let to = each(from, |c| Eight::ZERO - c);
        let scattering = seen.scattering(to, r2, third, cosine);
        // 1 / r^2 in the mean: near the box it follows its nearest point, but not all the way.
        let near = (outside2 + size2 * CLOSEST).sqrt();
        let weight = kinds * scattering / (r * near).max(Eight::splat(f32::MIN_POSITIVE));
        (weights(counts, weight), Boxes { local, center: to, outside2 })
    }

    /// What of these weights counts one way.
    #[inline(always)]
    pub(super) fn toward(&self, way: &Toward, weight: Eight, boxes: &Boxes) -> Eight {
        match way.lies(&boxes.local, &self.place) {
            Lies::Outside => return Eight::ZERO,
            Lies::Inside => return weight,
            Lies::Across => {}
        }
        let overlap = way.overlap(&boxes.local, boxes.center, self.half);
        let reach2 = way.reach2(&boxes.local, &self.place);
        let counts = reach2.less(boxes.outside2, Eight::ZERO, weight.min(overlap));
        weights(counts, weight * overlap)
    }

    /// 1 for those that are so near that they had better be opened.
    #[inline(always)]
    pub(super) fn near(&self, boxes: &Boxes) -> Eight {
        let size2 = dot(self.half, self.half);
        (size2 * (NEAR * NEAR)).less(boxes.outside2, Eight::ZERO, Eight::ONE)
    }

    /// The sums of what may count as what.
    #[inline(always)]
    fn kinds(&self, from: Vectors, distance: Eight, tolerance: Eight) -> Eight {
        let [normal, spread] = self.normal;
        let middle = dot(normal, from) + self.offset[0];
        let half = dot(spread, each(from, Eight::abs)) + self.offset[1] + tolerance;
        // In the whole range at -1 the backs are seen, at 1 the fronts.
        let at = middle / half;
        let least = Eight::splat(ALMOST_NOTHING);
        let [front, back] = [(at + 1.0) * 0.5, (Eight::ONE - at) * 0.5];
        let peak = (Eight::ONE - at.abs()).max(Eight::splat(LEAST_DENSITY));
        let split = (self.turning * distance * peak / half).max(least).min(Eight::ONE);
        let both = Eight::ZERO.less(front.min(back), self.discontinuity * split, Eight::ZERO);
        let fronts = self.crease[0] * front.max(least).min(Eight::ONE);
        let fronts = Eight::ZERO.less(front, fronts, Eight::ZERO);
        let backs = self.crease[1] * back.max(least).min(Eight::ONE);
        let backs = Eight::ZERO.less(back, backs, Eight::ZERO);
        self.open + both + fronts + backs
    }

    /// The mean height of the segments above the horizon over their mean distance; 0 only if all lie
    /// below.
    #[inline(always)]
    fn cosine(
        &self,
        (n, through): ([f32; 3], bool),
        from: Vectors,
        tolerance: Eight,
        r: Eight,
    ) -> Eight {
        // Heights n.(p - x) of all of the box; and, which is closer where n is like the faces'
        // normals n', heights n.(m - x) + n'.(p - m) + (n - n').(p - m).
        let n = same(n);
        let [normal, spread] = self.normal;
        let middle = Eight::ZERO - dot(n, from);
        let reach = dot(self.half, each(n, Eight::abs));
        let aligned = middle - self.offset[0];
        let apart = pairs(pairs(n, normal, |a, b| (a - b).abs()), spread, |a, b| a + b);
        let near = self.offset[1] + dot(self.half, apart);
        let low = (middle - reach).max(aligned - near);
        let high = (middle + reach).min(aligned + near);
        let above = high.max(Eight::ZERO);
        let below = if through { low } else { Eight::ZERO };
        let cut = (above * above + below * below) * 0.5 / (high - low).max(tolerance);
        let height = low.less(Eight::ZERO, cut, (low + high) * 0.5);
        let cosine = (height / r).max(Eight::splat(ALMOST_NOTHING)).min(Eight::ONE);
        if through {
            return cosine;
        }
        (Eight::ZERO - tolerance).less(high, cosine, Eight::ZERO)
    }
}

/// The corners of a box around points.
pub(super) fn range(points: impl Iterator<Item = Vec3>) -> [Vec3; 2] {
    let all = Vec3::splat(f64::INFINITY);
    points.fold([all, -all], |[low, high], p| [low.min(p), high.max(p)])
}

/// The middle of a box, and half its edges.
fn middle([low, high]: [Vec3; 2]) -> [Vec3; 2] {
    let center = low.lerp(high, 0.5);
    [center, (high - center).max(center - low)]
}
