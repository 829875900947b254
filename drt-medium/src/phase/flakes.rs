//! Microflakes at one point: how much of them a direction sees, and where they reflect light.
//!
//! A medium is full of small flat mirrors. The symmetric positive definite matrix S of SGGX (Heitz, Dupuy, Crassin and
//! Dachsbacher 2015, "The SGGX Microflake Distribution") tells how their normals are distributed: like the normals of the
//! surface of the ellipsoid that has S = B Bᵀ, the image of the unit sphere's surface under area vectors a → B a. Everything
//! follows from this map.
//!
//! The area that all flakes show to a direction w is that of the sphere's area vectors seen along Bᵀ w (their Eq. 7),
//!
//! ```text
//! A(w) = |Bᵀ w| = sqrt(wᵀ S w).
//! ```
//!
//! The density of normals per solid angle, weighted by area, follows from the Jacobian of the map (their Eq. 10):
//!
//! ```text
//! D(m) = 1 / (π sqrt(det S) (mᵀ S⁻¹ m)²),   ∫ D(m) max(0, m·w) dm = A(w).
//! ```
//!
//! A ray along w sees the normal m with the density D(m) max(0, m·w) / A(w). On the sphere of area vectors this is a cosine
//! distribution around Bᵀ w, so a is drawn there and m = B a / |B a|. A flake is a mirror: light from wi leaves to wo where
//! the normal is along the half vector h of both, and dm/dwi = 1 / (4 |m·wi|), so that
//!
//! ```text
//! A(wo) p(wo, wi) = D(h) / 4 = det(S)^(3/2) |d|⁴ / (4 π q²),   d = wo + wi,   q = dᵀ adj(S) d,
//! ```
//!
//! p being the phase function, which integrates to one over wi. The product is symmetric in both directions, which makes
//! light paths reciprocal (their Eq. 4). It is what [`Flakes::scattered`] gives.
//!
//! With the logarithm of the product, and v = adj(S) d,
//!
//! ```text
//! ∂/∂d = 4 d / |d|² - 4 v / q,   ∂/∂S = 2 v vᵀ / (q det S) - S⁻¹ / 2.
//! ```
//!
//! Straight on, where wi = -wo, there is no half vector, and the value depends on the side from which that is approached.
//! It is bounded there, but its derivative by the directions grows like one over the distance from there.
//!
//! What is not handled: flakes that are diffuse, and singular matrices, whose flakes reflect light into single directions.

use core::f64::consts::PI;

use drt_math::{Frame, Mat3, Real, Vec3, fm, vec3, warp};

/// The distribution of the normals of microflakes at a point, by the symmetric matrix S.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Flakes<T = f64> {
    /// The entries `[Sxx, Syy, Szz]`.
    pub diagonal: Vec3<T>,
    /// The entries `[Sxy, Sxz, Syz]`.
    pub off_diagonal: Vec3<T>,
}

/// The derivative of a number with respect to the entries of S, of which each stands for both places that it has off the
/// diagonal.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct FlakesGradient {
    /// With respect to `[Sxx, Syy, Szz]`.
    pub diagonal: Vec3,
    /// With respect to `[Sxy, Sxz, Syz]`.
    pub off_diagonal: Vec3,
}

impl<T: Real> Flakes<T> {
    /// The product of S and a vector.
    #[inline]
    fn times(&self, v: Vec3<T>) -> Vec3<T> {
        let (d, o) = (self.diagonal, self.off_diagonal);
        vec3(
            d.x * v.x + o.x * v.y + o.y * v.z,
            o.x * v.x + d.y * v.y + o.z * v.z,
            o.y * v.x + o.z * v.y + d.z * v.z,
        )
    }

    /// The adjugate of S, the inverse times the determinant.
    #[inline]
    fn adjugate(&self) -> Self {
        let (d, o) = (self.diagonal, self.off_diagonal);
        Self {
            diagonal: vec3(d.y * d.z - o.z * o.z, d.x * d.z - o.y * o.y, d.x * d.y - o.x * o.x),
            off_diagonal: vec3(o.y * o.z - o.x * d.z, o.x * o.z - o.y * d.y, o.x * o.y - o.z * d.x),
        }
    }

    fn determinant(&self, adjugate: &Self) -> T {
        let (o, a) = (self.off_diagonal, adjugate.off_diagonal);
        self.diagonal.x * adjugate.diagonal.x + o.x * a.x + o.y * a.y
    }

    /// The area that the flakes show to the unit direction w, over what they show on average if S is the unit matrix:
    /// `sqrt(wᵀ S w)`. The extinction along w is the medium's times this.
    #[inline]
    pub fn projected_area(&self, w: Vec3<T>) -> T {
        let squared = w.dot(self.times(w));
        if squared.re() > 0.0 { squared.sqrt() } else { T::zero() }
    }

    /// The phase function times the [projected area](Self::projected_area), per steradian: the light from the unit
    /// direction `wi` that leaves to `wo`. Both point away from the flakes, and either may be the first.
    #[inline]
    pub fn scattered(&self, wo: Vec3<T>, wi: Vec3<T>) -> T {
        let d = half_way(wo, wi);
        let adjugate = self.adjugate();
        let det = self.determinant(&adjugate);
        if det.re() <= 0.0 {
            return T::zero();
        }
        let share = d.length_squared() / d.dot(adjugate.times(d));
        det * det.sqrt() * share.squared() * (0.25 / PI)
    }
}

impl Flakes {
    /// These flakes with constants of another scalar.
    #[inline]
    #[must_use]
    pub fn lift<T: Real>(&self) -> Flakes<T> {
        Flakes { diagonal: self.diagonal.lift(), off_diagonal: self.off_diagonal.lift() }
    }

    /// How far it is from even, from 0 to 1: the determinant is that of a cube of this size less.
    pub(super) fn sharpness(&self) -> f64 {
        let mean = (self.diagonal.x + self.diagonal.y + self.diagonal.z) / 3.0;
        let volume = self.determinant(&self.adjugate()) / (mean * mean * mean);
        if volume > 0.0 { 1.0 - fm::sqrt(volume.min(1.0)) } else { 0.0 }
    }

    /// True of matrices that make a distribution: positive definite ones, by more than rounding, and zero, which is no flakes.
    #[must_use]
    pub fn is_valid(&self) -> bool {
        /// The least determinant, over that of a multiple of the unit matrix with the same trace.
        const LEAST: f64 = 1e-15;
        let (d, adjugate) = (self.diagonal, self.adjugate());
        if d == Vec3::ZERO && self.off_diagonal == Vec3::ZERO {
            return true;
        }
        let mean = (d.x + d.y + d.z) / 3.0;
        let det = self.determinant(&adjugate);
        d.x > 0.0 && adjugate.diagonal.z > 0.0 && det > LEAST * mean * mean * mean
    }

    /// The gradient of the [projected area](Self::projected_area) with respect to the direction, `S w / A(w)`. That along w
    /// is the area itself, which has degree one.
    #[inline]
    #[must_use]
    pub fn area_by_direction(&self, w: Vec3) -> Vec3 {
        let area = self.projected_area(w);
        if area > 0.0 { self.times(w) / area } else { Vec3::ZERO }
    }

    /// The gradient of the [projected area](Self::projected_area) with respect to S.
    #[inline]
    #[must_use]
    pub fn area_by_matrix(&self, w: Vec3) -> FlakesGradient {
        let area = self.projected_area(w);
        if area > 0.0 {
            FlakesGradient::of_square(w, 0.5 / area)
        } else {
            FlakesGradient::default()
        }
    }

    /// The gradients of [`Flakes::scattered`] with respect to either direction, for both of which it is the same, and with
    /// respect to S.
    #[must_use]
    pub fn scattered_gradient(&self, wo: Vec3, wi: Vec3) -> (Vec3, FlakesGradient) {
        let d = half_way(wo, wi);
        let adjugate = self.adjugate();
        let (det, v) = (self.determinant(&adjugate), adjugate.times(d));
        let value = self.scattered(wo, wi);
        if value == 0.0 {
            return (Vec3::ZERO, FlakesGradient::default());
        }
        let q = d.dot(v);
        let direction = (d / d.length_squared() - v / q) * (4.0 * value);
        let square = FlakesGradient::of_square(v, 2.0 * value / (q * det));
        let inverse = FlakesGradient::of_entries(&adjugate, -0.5 * value / det);
        (direction, square.plus(&inverse))
    }

    /// A unit direction to which a flake that `from` sees reflects, both away from the flakes, and its density per steradian;
    /// `u` are two uniform numbers in [0, 1). The density is zero where there are no flakes.
    #[must_use]
    pub fn sample(&self, from: Vec3, u: [f64; 2]) -> (Vec3, f64) {
        let factor = self.factor();
        let seen = factor.transpose_mul(from);
        let length = seen.length();
        if length == 0.0 || !length.is_finite() {
            return (-from, 0.0);
        }
        let frame = Frame::from_normal(seen / length);
        let m = factor * frame.to_world(warp::cosine_hemisphere(u));
        let m = m.normalize();
        let to = (m * (2.0 * m.dot(from)) - from).normalize();
        (to, self.pdf(from, to))
    }

    /// The density of [`Flakes::sample`], which is the phase function.
    #[inline]
    #[must_use]
    pub fn pdf(&self, from: Vec3, to: Vec3) -> f64 {
        let area = self.projected_area(from);
        if area > 0.0 { self.scattered(from, to) / area } else { 0.0 }
    }

    /// The lower triangular matrix B with S = B Bᵀ (Cholesky).
    fn factor(&self) -> Mat3 {
        let (d, o) = (self.diagonal, self.off_diagonal);
        let root = |squared: f64| fm::sqrt(f64::max(squared, 0.0));
        let over = |v: f64, root: f64| if root > 0.0 { v / root } else { 0.0 };
        let xx = root(d.x);
        let (yx, zx) = (over(o.x, xx), over(o.y, xx));
        let yy = root(d.y - yx * yx);
        let zy = over(o.z - zx * yx, yy);
        let zz = root(d.z - zx * zx - zy * zy);
        Mat3 { cols: [vec3(xx, yx, zx), vec3(0.0, yy, zy), vec3(0.0, 0.0, zz)] }
    }

    /// The flakes turned by a rotation R: R S Rᵀ.
    #[must_use]
    pub fn turned(&self, rotation: &Mat3) -> Self {
        let (d, o) = (self.diagonal, self.off_diagonal);
        let [diagonal, off_diagonal] = turned([d, o], rotation);
        Self { diagonal, off_diagonal }
    }
}

impl FlakesGradient {
    /// The derivative of `scale × vᵀ S v`.
    #[inline]
    pub(super) fn of_square(v: Vec3, scale: f64) -> Self {
        let two = 2.0 * scale;
        Self {
            diagonal: vec3(v.x * v.x, v.y * v.y, v.z * v.z) * scale,
            off_diagonal: vec3(v.x * v.y, v.x * v.z, v.y * v.z) * two,
        }
    }

    /// The derivative of the sum of the products of S and another matrix, entry by entry, times `scale`.
    fn of_entries(m: &Flakes, scale: f64) -> Self {
        Self { diagonal: m.diagonal * scale, off_diagonal: m.off_diagonal * (2.0 * scale) }
    }

    fn plus(&self, o: &Self) -> Self {
        Self {
            diagonal: self.diagonal + o.diagonal,
            off_diagonal: self.off_diagonal + o.off_diagonal,
        }
    }

    /// The change along rates of the entries of S, in the same order.
    #[inline]
    #[must_use]
    pub fn dot(&self, diagonal: Vec3, off_diagonal: Vec3) -> f64 {
        self.diagonal.dot(diagonal) + self.off_diagonal.dot(off_diagonal)
    }

    /// The gradient by the matrix that a rotation R turns into S: the transpose of [`Flakes::turned`].
    #[must_use]
    pub fn before(&self, rotation: &Mat3) -> Self {
        let whole = [self.diagonal, self.off_diagonal * 0.5];
        let [diagonal, off_diagonal] = turned(whole, &rotation.transpose());
        Self { diagonal, off_diagonal: off_diagonal * 2.0 }
    }
}

/// The sum of two unit directions; where they are opposite, something across both.
#[inline]
fn half_way<T: Real>(wo: Vec3<T>, wi: Vec3<T>) -> Vec3<T> {
    let d = wo + wi;
    if d.length_squared().re() > 0.0 { d } else { Frame::from_normal(wo).s }
}

/// R M Rᵀ of a symmetric matrix M, given by its entries on the diagonal and off it.
fn turned([d, o]: [Vec3; 2], rotation: &Mat3) -> [Vec3; 2] {
    let matrix = Mat3::from_rows(vec3(d.x, o.x, o.y), vec3(o.x, d.y, o.z), vec3(o.y, o.z, d.z));
    let [x, y, z] = (*rotation * matrix * rotation.transpose()).cols;
    [vec3(x.x, y.y, z.z), vec3(y.x, z.x, z.y)]
}
