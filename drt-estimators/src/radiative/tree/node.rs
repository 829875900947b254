//! What a node knows of its segments, and what it makes of that from a viewpoint.

use drt_math::{Real, Vec3, vec3};

use super::piece::{Piece, SLACK, one_norm};
use super::view::{ALMOST_NOTHING, Viewpoint};

/// A box of values: a middle and how far they reach on either side, rounded outward.
type Box32 = ([f32; 3], [f32; 3]);

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
}

impl Node {
    /// Around some segments, with weights as multiples of `unit`.
    pub(super) fn around<'a>(pieces: impl Iterator<Item = &'a Piece> + Clone, unit: f64) -> Self {
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
        }
    }

    /// An estimate of the kernel's integral over the segments; 0 only if none of them counts.
    pub(super) fn importance(&self, view: &Viewpoint, slack: f64) -> f64 {
        let from = view.x - self.center;
        let half = Vec3::from(self.half.map(f64::from));
        // Twice what is conceded to a single segment.
        let tolerance = 2.0 * (SLACK * (one_norm(from) + one_norm(half)) + slack);
        let length2 = from.length_squared();
        let kinds = self.kinds(from, Real::sqrt(length2), tolerance);
        if kinds <= 0.0 {
            return 0.0;
        }
        let r2 = length2 + half.length_squared();
        let cosine =
            view.normal.map_or(1.0, |normal| self.cosine(normal, from, half, tolerance, r2));
        let overlap = view.cone.map_or(1.0, |cone| cone.overlap(-from, half));
        kinds * cosine * overlap / r2.max(f64::MIN_POSITIVE)
    }

    /// The sums of what may count as what.
    fn kinds(&self, from: Vec3, distance: f64, tolerance: f64) -> f64 {
        let normal = Vec3::from(self.normal.0.map(f64::from));
        let spread = Vec3::from(self.normal.1.map(f64::from));
        let middle = normal.dot(from) + f64::from(self.offset);
        let half = absolute_dot(spread, from) + f64::from(self.offset_half) + tolerance;
        let mut sum = f64::from(self.open);
        // Faces turn to x where this is positive.
        let at = middle / half;
        let [front, back] = [0.5 * (1.0 + at), 0.5 * (1.0 - at)];
        if front > 0.0 && back > 0.0 {
            let part = f64::from(self.turning) * distance / (2.0 * half);
            let bump = f64::max(1.0 - at * at, SHAPE);
            sum += f64::min(part * bump, f64::from(self.jump));
        }
        for (side, crease) in [front, back].into_iter().zip(self.crease) {
            if side > 0.0 {
                sum += f64::from(crease) * side.clamp(ALMOST_NOTHING, 1.0);
            }
        }
        sum
    }

    fn cosine(
        &self,
        (n, through): (Vec3, bool),
        from: Vec3,
        half: Vec3,
        tolerance: f64,
        r2: f64,
    ) -> f64 {
        // Heights n.(p - x) of the box's points; and those of points at which a face's normal is
        // near n, from n.(p - m) = n'.(p - m) + (n - n').(p - m).
        let up = -n.dot(from);
        let reach = absolute_dot(half, n);
        let normal = Vec3::from(self.normal.0.map(f64::from));
        let spread = Vec3::from(self.normal.1.map(f64::from));
        let offset = f64::from(self.offset);
        let near = f64::from(self.offset_half) + absolute_dot(half, n - normal) + spread.dot(half);
        let low = f64::max(up - reach, up - offset - near);
        let high = f64::min(up + reach, up - offset + near);
        if !through && high + tolerance <= 0.0 {
            return 0.0;
        }
        let width = f64::max(high - low, tolerance);
        let height = if low >= 0.0 {
            0.5 * (low + high)
        } else {
            let below = if through { low * low } else { 0.0 };
            let above = high.max(0.0);
            (above * above + below) / (2.0 * width)
        };
        (height / Real::sqrt(r2)).clamp(ALMOST_NOTHING, 1.0)
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

/// The largest product of `v` with a vector in the box that reaches `half` to either side.
fn absolute_dot(half: Vec3, v: Vec3) -> f64 {
    half.x * v.x.abs() + half.y * v.y.abs() + half.z * v.z.abs()
}

const SHAPE: f64 = 0.05;
