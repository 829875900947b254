//! Rates that hold to edges across, and are free along them.
//!
//! Where radiance jumps at an edge, only the rate across it matters: a rate T of the ray's direction is right if n·T = n·c at
//! each visible edge, n being the unit vector across it and c the rate at which the edge is seen to move. At the border of a pixel,
//! along which the filter jumps, b·T = 0 across the border is all that is wanted. So T is the rate that misses all of these least,
//!
//! ```text
//! T = argmin |T|² + Σ w [(n·(T - c))² + g (l·(T - c))²] + Σ v (b·T)²  =  M⁻¹ Σ W c,
//! W = w [n nᵀ + g (1 - n nᵀ)],    M = 1 + Σ W + Σ v b bᵀ,
//! ```
//!
//! w being the weights of [edges](super), l the unit vector along an edge, and v = 1 / f² - 1 that of a border by a function f of one
//! coordinate of the image point which is 1 in the middle of the pixel and falls to 0 linearly at its ends. Where an edge crosses another one or a
//! border, T is near the one rate that both want, which is the same on all sides, and its divergence stays small. A scalar mean of
//! the two rates would turn from one to the other within no distance.
//!
//! g says how far an edge holds what is along it,
//!
//! ```text
//! g = q / min(q_a, q_b),
//! ```
//!
//! with the squared sines of the angles from the ray to the edge and to its ends. It is 1 where an end is the nearest point: around an end
//! n turns, and the vertex there moves at one rate, which is that of the other edges that meet there. Far from the ends it is 0 beside the
//! edge. W is continuous, so that T is.
//!
//! Everything is a function of two coordinates u of the direction over dual numbers, which give the divergence. The first is across
//! the edge, or the border, of the largest weight, so that the determinant of M keeps its digits.

use alloc::vec::Vec;
use core::array::from_fn;

use drt_math::{Frame, Mat3, Real, Vec3};

use crate::derivative::velocity::{ByU, TurnPart, Weight};
use crate::estimators::warped::angular_distance::Beside;
use crate::estimators::warped::edge::TurningEdge;

/// The border of a pixel that a ray is beside: its points keep the image point across it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Border {
    /// The image coordinate is (axis·d) / (forward·d), d being the ray's direction.
    pub(super) axis: Vec3,
    pub(super) forward: Vec3,
    pub(super) weight: Weight,
}

/// A symmetric matrix by u.
#[derive(Clone, Copy, Debug)]
struct Matrix {
    xx: ByU,
    xy: ByU,
    yy: ByU,
}

impl Matrix {
    fn even(c: ByU) -> Self {
        Self { xx: c, xy: ByU::from(0.0), yy: c }
    }

    /// c n nᵀ.
    fn across([x, y]: [ByU; 2], c: ByU) -> Self {
        Self { xx: x * x * c, xy: x * y * c, yy: y * y * c }
    }

    fn add(&mut self, other: &Self) {
        self.xx += other.xx;
        self.xy += other.xy;
        self.yy += other.yy;
    }

    fn scaled(self, c: ByU) -> Self {
        Self { xx: self.xx * c, xy: self.xy * c, yy: self.yy * c }
    }

    fn inverse(&self) -> Self {
        let inv = (self.xx * self.yy - self.xy * self.xy).recip();
        Self { xx: self.yy * inv, xy: -self.xy * inv, yy: self.xx * inv }
    }

    /// The rows of a product.
    fn times(&self, other: &Self) -> [[ByU; 2]; 2] {
        let Self { xx, xy, yy } = *self;
        [
            [xx * other.xx + xy * other.xy, xx * other.xy + xy * other.yy],
            [xy * other.xx + yy * other.xy, xy * other.xy + yy * other.yy],
        ]
    }
}

/// A ray's direction by coordinates u.
struct Around {
    dir: Vec3,
    across: [Vec3; 2],
}

impl Around {
    /// The first coordinate goes along `first`.
    fn new(dir: Vec3, first: Option<Vec3>) -> Self {
        let first = first.map(|n| n.reject(dir)).filter(|n| n.length_squared() > 1e-20);
        let across = match first {
            Some(n) => {
                let s = n.normalize();
                [s, dir.cross(s)]
            }
            None => {
                let frame = Frame::from_normal(dir);
                [frame.s, frame.t]
            }
        };
        Self { dir, across }
    }

    fn weight(&self, w: Weight) -> ByU {
        ByU::new(w.value, self.across.map(|t| w.gradient.dot(t)))
    }

    /// The dot product of a vector and the direction.
    fn dot(&self, v: Vec3) -> ByU {
        ByU::new(v.dot(self.dir), self.across.map(|t| v.dot(t)))
    }

    /// The coordinates of a vector across the direction, which turns against a fixed vector.
    fn coordinates(&self, v: Vec3) -> [ByU; 2] {
        let along = v.dot(self.dir);
        from_fn(|k| ByU::new(v.dot(self.across[k]), from_fn(|j| if j == k { -along } else { 0.0 })))
    }

    /// W of an edge as seen from a point.
    fn edge(&self, from: Vec3, Found { edge, beside, weight }: &Found<'_>) -> Matrix {
        let weight = self.weight(*weight);
        let Some(normal) = beside.normal else { return Matrix::even(weight) };
        let [to_a, to_b] = edge.ends.map(|end| square_to(end - from, self.dir));
        let nearer = if to_a.value < to_b.value { to_a } else { to_b };
        if nearer.value == 0.0 {
            return Matrix::even(weight);
        }
        let held = self.weight(beside.square / nearer);
        let sine = self.dot(normal);
        let inv = (ByU::from(1.0) - sine * sine).sqrt().recip();
        let n = self.coordinates(normal).map(|c| c * inv);
        let mut matrix = Matrix::across(n, weight * (ByU::from(1.0) - held));
        matrix.add(&Matrix::even(weight * held));
        matrix
    }

    /// v b bᵀ of a border.
    fn border(&self, border: &Border) -> Matrix {
        let Border { axis, forward, weight } = *border;
        // The normal of the plane of all directions with this coordinate is axis - coordinate forward.
        let coordinate = self.dot(axis) / self.dot(forward);
        let [a, f] = [axis, forward].map(|v| self.coordinates(v));
        let n: [ByU; 2] = from_fn(|k| a[k] - coordinate * f[k]);
        let inv = (n[0] * n[0] + n[1] * n[1]).recip();
        Matrix::across(n, self.weight(weight) * inv)
    }

    /// A rate by a vector, and its divergence.
    fn part(&self, rate: [[ByU; 2]; 2]) -> (Mat3, Vec3) {
        let [s, t] = self.across;
        let column = |c: f64, d: f64| s * c + t * d;
        let re = rate.map(|row| row.map(|c| c.re));
        // By a vector's components along s and t.
        let [by_s, by_t] = [0, 1].map(|k| column(re[0][k], re[1][k]));
        let cols = [Vec3::X, Vec3::Y, Vec3::Z].map(|e| by_s * s.dot(e) + by_t * t.dot(e));
        let [in_s, in_t] = [0, 1].map(|k| rate[0][k].eps[0] + rate[1][k].eps[1]);
        let divergence = s * in_s + t * in_t - self.dir * (re[0][0] + re[1][1]);
        (Mat3 { cols }, divergence)
    }
}

/// Squared sine of the angle between the unit direction ω and a place; 1 from a right angle on.
fn square_to(place: Vec3, w: Vec3) -> Weight {
    let end = place.normalize();
    let cosine = end.dot(w);
    if cosine <= 0.0 {
        return Weight::constant(1.0);
    }
    let value = end.cross(w).length_squared();
    Weight { value, gradient: (end - w * cosine) * (-2.0 * cosine) }
}

/// An edge that has a weight.
pub(super) struct Found<'a> {
    pub(super) edge: &'a TurningEdge,
    pub(super) beside: Beside,
    pub(super) weight: Weight,
}

/// Adds the summands of the rate of a ray that leaves a point at rest along `dir`, beside edges and the borders of its pixel.
pub(super) fn turn(
    from: Vec3,
    dir: Vec3,
    found: &[Found<'_>],
    borders: &[Border],
    parts: &mut Vec<TurnPart>,
) {
    let value = |f: &Found<'_>| f.weight.value;
    let strongest = found.iter().filter(|f| f.beside.normal.is_some());
    let strongest = strongest.max_by(|a, b| value(a).total_cmp(&value(b)));
    let of_edge = strongest.and_then(|f| Some((f.beside.normal?, value(f))));
    let of_border = borders.iter().map(|b| {
        let coordinate = b.axis.dot(dir) / b.forward.dot(dir);
        (b.axis - b.forward * coordinate, b.weight.value)
    });
    let first = of_border.chain(of_edge).max_by(|a, b| a.1.total_cmp(&b.1)).map(|(n, _)| n);
    let around = Around::new(dir, first);
    let mut matrix = Matrix::even(ByU::from(1.0));
    for border in borders {
        matrix.add(&around.border(border));
    }
    let matrices: Vec<Matrix> = found.iter().map(|f| around.edge(from, f)).collect();
    for one in &matrices {
        matrix.add(one);
    }
    let inverse = matrix.inverse();
    for (Found { edge, beside, .. }, one) in found.iter().zip(&matrices) {
        if !edge.moves {
            continue;
        }
        let (near, along) = (around.weight(beside.distance).recip(), around.weight(beside.along));
        for (end, part) in [ByU::from(1.0) - along, along].into_iter().enumerate() {
            if part.re == 0.0 && part.eps == [0.0; 2] {
                continue;
            }
            let (rate, divergence) = around.part(inverse.times(&one.scaled(part * near)));
            let part = |matter| TurnPart { matter: Some(matter), rate, divergence };
            parts.extend(edge.matter(end).map(part));
        }
    }
}
