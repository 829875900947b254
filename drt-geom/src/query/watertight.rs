//! The ray-triangle test of Woop, Benthin and Wald 2013, "Watertight Ray/Triangle Intersection"
//! (JCGT 2.1), in `f64`.
//!
//! Vertices are translated to the ray's origin and sheared so that the ray runs along +z; the ray
//! then hits where the origin lies in the projected triangle. Neighbouring triangles project a
//! shared vertex to the same two numbers, and the side of an edge is decided exactly, so that no ray
//! slips between them. Where the paper repeats a zero edge function in twice the precision, the
//! rounding errors of its two products decide here: they are exact. A ray exactly through an edge or
//! vertex is decided as if it were moved by an infinitesimal amount (Edelsbrunner and Mücke 1990,
//! "Simulation of Simplicity"), the same for all triangles: it crosses exactly one of two neighbours
//! that lie on both sides of it, and a closed surface as often inward as outward.

use drt_math::{Ray, Vec3};

/// A triangle by its corners, as arrays so that the permuted axes can index them.
pub(super) type Corners = [[f64; 3]; 3];

/// A ray prepared for the test.
#[derive(Clone, Copy)]
pub(super) struct ShearedRay {
    pub(super) origin: [f64; 3],
    /// The axis along which the ray runs fastest comes last.
    pub(super) axes: [usize; 3],
    pub(super) shear: [f64; 3],
}

/// A triangle crossed by a line, at any `t`.
#[derive(Clone, Copy)]
pub(super) struct Crossing {
    /// Parameter on the line.
    pub(super) t: f64,
    /// Edge functions of the edges opposite to vertices 0, 1 and 2: all of one sign.
    pub(super) edge: [f64; 3],
    /// Their sum: positive when the line runs against the normal, into the surface.
    pub(super) det: f64,
}

impl Crossing {
    /// Weights of vertices 1 and 2.
    #[inline]
    pub(super) fn bary(&self) -> [f64; 2] {
        [self.edge[1] / self.det, self.edge[2] / self.det]
    }
}

impl ShearedRay {
    /// Prepares a ray; its direction must be finite and not zero.
    #[inline(always)]
    pub(super) fn new(ray: &Ray) -> Self {
        let d = ray.dir.to_array();
        let z = if d[0].abs() > d[1].abs() {
            if d[0].abs() > d[2].abs() { 0 } else { 2 }
        } else if d[1].abs() > d[2].abs() {
            1
        } else {
            2
        };
        // Swapping the other two keeps the winding when the ray runs down its main axis.
        let (x, y) =
            if d[z] < 0.0 { ((z + 2) % 3, (z + 1) % 3) } else { ((z + 1) % 3, (z + 2) % 3) };
        Self {
            origin: ray.origin.to_array(),
            axes: [x, y, z],
            shear: [d[x] / d[z], d[y] / d[z], 1.0 / d[z]],
        }
    }

    /// The crossing of the ray's line with a triangle. A triangle seen edge-on is not crossed.
    #[inline(always)]
    pub(super) fn cross(&self, triangle: &Corners) -> Option<Crossing> {
        let [x, y, z] = self.axes;
        let [sx, sy, sz] = self.shear;
        let project = |v: &[f64; 3]| {
            let h = v[z] - self.origin[z];
            [v[x] - self.origin[x] - sx * h, v[y] - self.origin[y] - sy * h, h]
        };
        let [a, b, c] = [project(&triangle[0]), project(&triangle[1]), project(&triangle[2])];
        let mut edge =
            [c[0] * b[1] - c[1] * b[0], a[0] * c[1] - a[1] * c[0], b[0] * a[1] - b[1] * a[0]];
        if disagree(edge) {
            return None;
        }
        if edge.contains(&0.0) {
            // In a plane with the ray and an axis: without a doubt edge-on.
            if [0, 1].iter().any(|&k| a[k] == 0.0 && b[k] == 0.0 && c[k] == 0.0) {
                return None;
            }
            let exact = [edge_function(c, b), edge_function(a, c), edge_function(b, a)];
            if disagree(exact.map(|e| e.1)) {
                return None;
            }
            edge = exact.map(|e| e.0);
        }
        let [u, v, w] = edge;
        let det = u + v + w;
        if det == 0.0 {
            return None;
        }
        let t = (u * a[2] + v * b[2] + w * c[2]) * sz / det;
        Some(Crossing { t, edge, det })
    }
}

/// Whether both signs occur. The sign of an edge function is exact unless it is zero.
#[inline]
fn disagree([u, v, w]: [f64; 3]) -> bool {
    (u < 0.0 || v < 0.0 || w < 0.0) && (u > 0.0 || v > 0.0 || w > 0.0)
}

/// The edge function of two projected vertices, and its sign once the ray is moved by (e, e²) for an
/// infinitesimal e: zero only where the vertices coincide.
#[cold]
fn edge_function(p: [f64; 3], q: [f64; 3]) -> (f64, f64) {
    let value = product_difference(p[0], q[1], p[1], q[0]);
    let moved = [value, p[1] - q[1], q[0] - p[0]];
    (value, moved.into_iter().find(|s| *s != 0.0).unwrap_or(0.0))
}

/// `a b - c d` with the exact sign. Rounding is monotonic, so different rounded products are already
/// in the right order; equal ones leave the difference of their rounding errors.
fn product_difference(a: f64, b: f64, c: f64, d: f64) -> f64 {
    let (p, q) = (a * b, c * d);
    if p != q { p - q } else { product_error(a, b, p) - product_error(c, d, q) }
}

/// The rounding error `a b - p` of the product `p`, exactly (Dekker 1971, "A floating-point
/// technique for extending the available precision"), for products of 1e-290 to 1e290.
fn product_error(a: f64, b: f64, p: f64) -> f64 {
    let ([ah, al], [bh, bl]) = (split(a), split(b));
    ((ah * bh - p) + ah * bl + al * bh) + al * bl
}

/// Veltkamp's splitting into halves of 26 bits.
fn split(a: f64) -> [f64; 2] {
    let c = a * 134_217_729.0;
    let high = c - (c - a);
    [high, a - high]
}

/// The corners as arrays.
pub(super) fn corners(triangle: &[Vec3; 3]) -> Corners {
    triangle.map(|v| v.to_array())
}

#[cfg(test)]
mod tests {
    use super::product_difference;
    use drt_math::Rng;

    #[test]
    fn the_sign_of_a_difference_of_products_is_exact() {
        let mut rng = Rng::new(1, 0, 0);
        let mut ties = 0;
        for i in 0..200_000 {
            let mut integer = || (rng.next_u64() >> 12) as i64 - (1 << 51);
            let (a, b, c) = (integer(), integer(), integer());
            // Nearly equal products, often the same when rounded.
            let d = (i128::from(a) * i128::from(b) / i128::from(c)) as i64 + i % 3 - 1;
            if d.unsigned_abs() >= 1 << 53 {
                continue;
            }
            let exact = i128::from(a) * i128::from(b) - i128::from(c) * i128::from(d);
            let [fa, fb, fc, fd] = [a, b, c, d].map(|x| x as f64);
            ties += i32::from(fa * fb == fc * fd);
            for scale in [1.0, 2.0_f64.powi(-300), 2.0_f64.powi(300)] {
                let got = product_difference(fa * scale, fb, fc * scale, fd);
                assert_eq!(got.partial_cmp(&0.0), Some(exact.cmp(&0)), "{a} {b} {c} {d}");
            }
        }
        assert!(ties > 1_000, "{ties}");
    }
}
