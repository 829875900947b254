//! What keeps a ray from meeting the surface it starts or ends on.
//!
//! A point on a surface is a rounded point: interpolated from three vertices it lies off the
//! triangle by at most a few units of rounding of their coordinates. A ray from there meets its own
//! triangle at some t of either sign, and next to an edge or a vertex also the neighbours. Its own
//! triangles are excluded by number ([`Skip`](super::Skip)). Any other is passed over when the
//! ray's end itself lies *on* it to within that rounding error: off its plane by no more than the error
//! bound of that distance, and inside the triangle's box or right beside it. A point that rounding put an ε
//! behind its own triangle meets a neighbour from behind if the edge between them is nearer than ε over the sine
//! of the angle at which the ray leaves, so that *beside* is a wider margin than rounding, in all directions alike. Nothing here
//! depends on the size of the scene or on the direction of the ray, and triangles whose plane the end does
//! not touch are never dropped, however close the hit.

use super::watertight::Corners;

/// Unit roundoff of `f64`.
const U: f64 = f64::EPSILON / 2.0;

/// `n u / (1 - n u)`: bound of the relative error of `n` roundings (Higham 2002, Lemma 3.1).
pub(super) const fn gamma(n: f64) -> f64 {
    n * U / (1.0 - n * U)
}

/// Error, relative to the largest coordinate of the triangle, allowed to a point said to lie on it.
/// Barycentric interpolation with the third weight computed as `1 - b1 - b2` needs gamma(7), a point
/// on an edge by `lerp` gamma(5).
const ON_SURFACE: f64 = gamma(16.0);

/// The margin around a triangle's box, relative to the end's largest coordinate, in which ends in its plane lie beside it.
const BESIDE: f64 = 64.0 * ON_SURFACE;

/// An end of a ray, with the rounding error of its coordinates beyond that of a point interpolated
/// on a triangle.
#[derive(Clone, Copy)]
pub(super) struct End {
    point: [f64; 3],
    error: [f64; 3],
    /// How far beside a triangle's box it still lies beside the triangle.
    beside: f64,
}

impl End {
    /// The origin, as given.
    #[inline(always)]
    pub(super) fn origin(origin: [f64; 3]) -> Self {
        Self::with_error(origin, [0.0; 3])
    }

    /// A point with an error of its own.
    #[inline(always)]
    pub(super) fn with_error(point: [f64; 3], error: [f64; 3]) -> Self {
        let largest = |v: [f64; 3]| v[0].abs().max(v[1].abs()).max(v[2].abs());
        Self { point, error, beside: BESIDE * largest(point) + largest(error) }
    }

    /// The point `origin + t dir`, whose terms were rounded, `dir` perhaps by a subtraction.
    #[inline(always)]
    pub(super) fn far(origin: [f64; 3], dir: [f64; 3], t: f64) -> Self {
        let error = |k: usize| gamma(4.0) * (origin[k].abs() + (t * dir[k]).abs());
        let point = [0, 1, 2].map(|k| origin[k] + t * dir[k]);
        Self::with_error(point, [error(0), error(1), error(2)])
    }

    /// Whether the end lies on the triangle, as far as rounding lets one tell.
    ///
    /// `leaving` is the direction away from the end along the ray. Right at the triangle the sign of
    /// a computed hit distance is less certain than that of the end's distance to the plane, so an
    /// end from which the ray moves off the plane counts too.
    #[inline(always)]
    pub(super) fn lies_on(&self, triangle: &Corners, leaving: [f64; 3]) -> bool {
        let mut slack = [0.0; 3];
        for k in 0..3 {
            let [a, b, c] = [triangle[0][k], triangle[1][k], triangle[2][k]];
            let (low, high) = (a.min(b).min(c), a.max(b).max(c));
            slack[k] = ON_SURFACE * low.abs().max(high.abs()) + self.error[k];
            let margin = slack[k] + self.beside;
            // Written so that a NaN counts as outside.
            if !(self.point[k] >= low - margin && self.point[k] <= high + margin) {
                return false;
            }
        }
        self.touches_plane(triangle, slack, leaving)
    }

    /// Whether the end lies in the plane of the triangle, as far as rounding lets one tell.
    #[cold]
    pub(super) fn lies_in_plane(&self, triangle: &Corners) -> bool {
        let largest = |k: usize| triangle.iter().fold(0.0, |m: f64, v| m.max(v[k].abs()));
        let slack = [0, 1, 2].map(|k| ON_SURFACE * largest(k) + self.error[k]);
        // A vector of no length leaves no plane.
        self.touches_plane(triangle, slack, [0.0; 3])
    }

    #[cold]
    fn touches_plane(&self, triangle: &Corners, slack: [f64; 3], leaving: [f64; 3]) -> bool {
        let [v0, v1, v2] = triangle;
        let (mut distance, mut distance_error) = (0.0, 0.0);
        let (mut approach, mut approach_error) = (0.0, 0.0);
        for k in 0..3 {
            let (i, j) = ((k + 1) % 3, (k + 2) % 3);
            let (p, q) = ((v1[i] - v0[i]) * (v2[j] - v0[j]), (v1[j] - v0[j]) * (v2[i] - v0[i]));
            let (normal, magnitude) = (p - q, p.abs() + q.abs());
            let offset = self.point[k] - v0[k];
            distance += normal * offset;
            distance_error +=
                normal.abs() * slack[k] + magnitude * gamma(8.0) * (offset.abs() + slack[k]);
            approach += normal * leaving[k];
            approach_error += magnitude * gamma(8.0) * leaving[k].abs();
        }
        distance.abs() <= distance_error
            || (approach.abs() > approach_error && (distance > 0.0) == (approach > 0.0))
    }
}

#[cfg(test)]
mod tests {
    use super::End;

    const TRIANGLE: [[f64; 3]; 3] = [[1.0, 1.0, 1.0], [2.0, 1.0, 1.5], [1.0, 2.0, 1.0]];
    const NORMAL: [f64; 3] = [-0.5, 0.0, 1.0];

    /// The middle of the edge from vertex 1 to vertex 2, lifted along the normal.
    fn on_edge(lift: f64) -> End {
        End::origin([0, 1, 2].map(|k| 0.5 * (TRIANGLE[1][k] + TRIANGLE[2][k]) + lift * NORMAL[k]))
    }

    #[test]
    fn an_end_on_the_triangle_is_told_from_one_off_it() {
        let toward = NORMAL.map(|c| -c);
        for lift in [0.0, 2e-16, -2e-16, 1e-15] {
            assert!(on_edge(lift).lies_on(&TRIANGLE, toward), "{lift}");
        }
        for lift in [1e-13, 1e-9, 1e-2] {
            assert!(!on_edge(lift).lies_on(&TRIANGLE, toward), "{lift}");
        }
        let beside = End::origin([1.0 - 1e-13, 1.5, 1.0]);
        assert!(!beside.lies_on(&TRIANGLE, toward));
        assert!(!End::origin([f64::NAN, 1.5, 1.0]).lies_on(&TRIANGLE, toward));
    }

    #[test]
    fn a_ray_that_leaves_the_plane_cannot_hit_it() {
        assert!(on_edge(-1e-13).lies_on(&TRIANGLE, NORMAL.map(|c| -c)));
        assert!(on_edge(1e-13).lies_on(&TRIANGLE, NORMAL));
        assert!(!on_edge(-1e-13).lies_on(&TRIANGLE, NORMAL));
    }

    #[test]
    fn far_ends_carry_the_error_of_their_sum() {
        let [x, y, z] = [0, 1, 2].map(|k| 0.5 * (TRIANGLE[1][k] + TRIANGLE[2][k]));
        let dir = [-1e6 / 3.0, 2e6 / 3.0, 1e6 / 7.0];
        for t in [1.0, 0.1, 1e-3] {
            let origin = [x - t * dir[0], y - t * dir[1], z - t * dir[2]];
            let end = End::far(origin, dir, t);
            assert!(end.lies_on(&TRIANGLE, [0.5, 0.0, -1.0]), "{t}");
        }
    }
}
