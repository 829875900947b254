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

use drt_math::{Real, Vec3, vec3};

use super::piece::{Piece, SLACK, one_norm};
use super::view::{ALMOST_NOTHING, Viewpoint};

/// A box of values: a middle and how far they reach on either side, rounded outward.
type Box32 = ([f32; 3], [f32; 3]);

/// The density of fronts at the ends of their range, as a part of that in the middle.
const LEAST_DENSITY: f64 = 0.05;

/// From within a box, segments are taken to be as near as this part of half its diagonal, squared.
/// Measured on spheres, dents and cubes: with more, close edges come too seldom, with less, too often.
const CLOSEST: f64 = 0.04;

/// Bounds of a set of segments.
#[derive(Clone, Copy, Debug)]
pub(super) struct Node {
    /// The middle m of the segments' box, and half its edges.
    center: Vec3,
    half: [f32; 3],
    /// The box of the normals of all faces.
    normal: Box32,
    /// The range of n.(m - p), over every face's normal n and its edge's points p.
    offset: f32,
    offset_half: f32,
    /// Sums of length times prior: of open edges, of others as silhouettes...
    open: f32,
    jump: f32,
    /// ...the same times the distance of both normals...
    turning: f32,
    /// ...and as creases seen from the front and from the back.
    crease: [f32; 2],
    /// The first of its children, 0 for none.
    pub(super) children: u32,
    /// The segment after its last.
    pub(super) end: u32,
}

impl Node {
    /// Around the segments before `end`, with weights as multiples of `unit`; without children.
    pub(super) fn around<'a>(
        pieces: impl Iterator<Item = &'a Piece> + Clone,
        unit: f64,
        end: u32,
    ) -> Self {
        let points = pieces.clone().flat_map(|p| [p.a, p.end()]);
        let (center, half) = middle(points);
        let normals = pieces.clone().flat_map(|p| p.faces);
        let (normal, spread) = middle(normals);
        let normal = normal.to_array().map(|c| c as f32);
        let rounding = normal.map(|c| f64::from(c) * f64::from(f32::EPSILON));
        let spread = [0, 1, 2].map(|k| up(spread[k] + rounding[k].abs()));
        let offsets =
            pieces.clone().flat_map(|p| p.faces.map(|n| Vec3::splat(n.dot(center - p.a))));
        let (offset, offset_half) = middle(offsets);
        let offset_rounding = offset.x.abs() * f64::from(f32::EPSILON);
        let sum = |weight: &dyn Fn(&Piece) -> f64| {
            let total: f64 = pieces.clone().map(|p| weight(p) * (p.length / unit)).sum();
            // What counts little still counts.
            if total > 0.0 { f32::max(total as f32, f32::MIN_POSITIVE) } else { 0.0 }
        };
        Self {
            center,
            half: half.to_array().map(up),
            normal: (normal, spread),
            offset: offset.x as f32,
            offset_half: up(offset_half.x + offset_rounding),
            open: sum(&|p| if p.open { p.jump } else { 0.0 }),
            jump: sum(&|p| if p.open { 0.0 } else { p.jump }),
            turning: sum(&|p| p.jump * (p.faces[1] - p.faces[0]).length()),
            crease: [0, 1].map(|k| sum(&|p| p.crease[k])),
            children: 0,
            end,
        }
    }

    /// An estimate of the integral over the segments of kernel, scattering and weight, the weight in
    /// multiples of the tree's unit; 0 only if none of them counts.
    pub(super) fn importance(&self, view: &Viewpoint, slack: f64) -> f64 {
        let from = view.x - self.center;
        let half = Vec3::from(self.half.map(f64::from));
        // Twice what is conceded to a single segment.
        let tolerance = 2.0 * (SLACK * (one_norm(from) + one_norm(half)) + slack);
        let length2 = from.length_squared();
        let outside = (absolute(from) - half).max(Vec3::ZERO).length_squared();
        let kinds = self.kinds(from, Real::sqrt(length2), tolerance);
        if kinds <= 0.0 || outside > view.reach * view.reach {
            return 0.0;
        }
        let size2 = half.length_squared();
        let r2 = length2 + size2 * (1.0 / 3.0);
        let cosine =
            view.normal.map_or(1.0, |normal| self.cosine(normal, from, half, tolerance, r2));
        if cosine <= 0.0 {
            return 0.0;
        }
        let scattering = view.lobes.toward(-from, r2, size2 * (1.0 / 3.0), cosine);
        let overlap = view.cone.map_or(1.0, |cone| cone.overlap(-from, half));
        // 1 / r^2 in the mean: near the box it follows its nearest point, but not all the way.
        let r = Real::sqrt(r2 * (outside + size2 * CLOSEST));
        kinds * scattering * overlap / r.max(f64::MIN_POSITIVE)
    }

    /// True within some times half the box's diagonal from the box.
    pub(super) fn is_near(&self, view: &Viewpoint, times: f64) -> bool {
        let half = Vec3::from(self.half.map(f64::from));
        let outside = (absolute(view.x - self.center) - half).max(Vec3::ZERO);
        outside.length_squared() <= times * times * half.length_squared()
    }

    /// The sums of what may count as what.
    fn kinds(&self, from: Vec3, distance: f64, tolerance: f64) -> f64 {
        let (normal, spread) = self.normals();
        let middle = normal.dot(from) + f64::from(self.offset);
        let half = spread.dot(absolute(from)) + f64::from(self.offset_half) + tolerance;
        // In the whole range at -1 the backs are seen, at 1 the fronts.
        let at = middle / half;
        let [front, back] = [0.5 * (1.0 + at), 0.5 * (1.0 - at)];
        let mut sum = f64::from(self.open);
        if front > 0.0 && back > 0.0 {
            let density = f64::max(1.0 - at.abs(), LEAST_DENSITY) / half;
            let jump = f64::from(self.jump);
            let split = 0.5 * f64::from(self.turning) * distance * density;
            sum += split.clamp(ALMOST_NOTHING * jump, jump);
        }
        for (side, crease) in [front, back].into_iter().zip(self.crease) {
            if side > 0.0 {
                sum += f64::from(crease) * side.clamp(ALMOST_NOTHING, 1.0);
            }
        }
        sum
    }

    /// The mean height of the segments above the horizon over their mean distance; 0 only if all lie
    /// below.
    fn cosine(
        &self,
        (n, through): (Vec3, bool),
        from: Vec3,
        half: Vec3,
        tolerance: f64,
        r2: f64,
    ) -> f64 {
        // Heights n.(p - x) of all of the box; and, which is closer where n is like the faces'
        // normals n', heights n.(m - x) + n'.(p - m) + (n - n').(p - m).
        let (normal, spread) = self.normals();
        let middle = -n.dot(from);
        let reach = half.dot(absolute(n));
        let aligned = middle - f64::from(self.offset);
        let near = f64::from(self.offset_half) + half.dot(absolute(n - normal) + spread);
        let low = f64::max(middle - reach, aligned - near);
        let high = f64::min(middle + reach, aligned + near);
        if !through && high + tolerance <= 0.0 {
            return 0.0;
        }
        let height = if low >= 0.0 {
            0.5 * (low + high)
        } else {
            let above = high.max(0.0);
            let below = if through { low } else { 0.0 };
            0.5 * (above * above + below * below) / f64::max(high - low, tolerance)
        };
        (height / Real::sqrt(r2)).clamp(ALMOST_NOTHING, 1.0)
    }

    /// The box of normals.
    fn normals(&self) -> (Vec3, Vec3) {
        (self.normal.0.map(f64::from).into(), self.normal.1.map(f64::from).into())
    }
}

/// The middle of a box around points, and half its edges.
fn middle(points: impl Iterator<Item = Vec3>) -> (Vec3, Vec3) {
    let all = vec3(f64::INFINITY, f64::INFINITY, f64::INFINITY);
    let (low, high) = points.fold((all, -all), |(low, high), p| (low.min(p), high.max(p)));
    let center = low.lerp(high, 0.5);
    (center, (high - center).max(center - low))
}

/// Rounded away from zero.
fn up(x: f64) -> f32 {
    let r = x as f32;
    if f64::from(r) < x { r.next_up() } else { r }
}

fn absolute(v: Vec3) -> Vec3 {
    vec3(v.x.abs(), v.y.abs(), v.z.abs())
}
