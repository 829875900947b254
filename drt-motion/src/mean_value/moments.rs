//! Expansion of the mean value kernel about the middle of a cluster of triangles.
//!
//! The kernel is a gradient: z_i / |z|⁴ = ∂_i P with P = -1 / (2 |z|²). So with n the normals, ξ the
//! places relative to the middle and z the middle relative to the point,
//!
//! ```text
//! ∫ u n·(z + ξ) / |z + ξ|⁴ dA ≈ Σ_i M_i ∂_i P + Σ_ij M_ij ∂_ij P + Σ_ijk M_ijk ∂_ijk P,
//! M_i = ∫ u n_i,   M_ij = ∫ u n_i ξ_j,   M_ijk = ½ ∫ u n_i ξ_j ξ_k.
//! ```
//!
//! Without the normals, the kernel is 1 / |z|⁴ = -Σ_i ∂_ii P, so that pieces of area a have moments of the same
//! kind,
//!
//! ```text
//! M_ij = -δ_ij ∫ u,   M_ijk = -δ_ij ∫ u ξ_k.
//! ```
//!
//! The symmetric parts of moments count only: they are kept as the coefficients of homogeneous
//! polynomials. Monomial xᵃ yᵇ zᶜ of any degree is number m (m + 1) / 2 + c with m = b + c.

use drt_math::{Vec3, vec3};

/// Monomials of degree 1 to 3.
const MOMENTS: usize = 3 + 6 + 10;
/// Where each degree starts among those of degree 1 to 4.
const START: [usize; 4] = [0, 3, 9, 19];
/// Exponents b + c of a monomial.
const BEYOND_X: [usize; 15] = [0, 1, 1, 2, 2, 2, 3, 3, 3, 3, 4, 4, 4, 4, 4];

/// The monomial times a coordinate.
const fn raised(monomial: usize, axis: usize) -> usize {
    if axis == 0 { monomial } else { monomial + BEYOND_X[monomial] + axis }
}

const fn monomials(degree: usize) -> usize {
    (degree + 1) * (degree + 2) / 2
}

/// For each monomial of degree 1 to 3, counted through, its product with each coordinate.
const RAISED: [[usize; 3]; MOMENTS] = {
    let mut table = [[0; 3]; MOMENTS];
    let mut degree = 1;
    while degree <= 3 {
        let mut k = 0;
        while k < monomials(degree) {
            let mut axis = 0;
            while axis < 3 {
                table[START[degree - 1] + k][axis] = START[degree] + raised(k, axis);
                axis += 1;
            }
            k += 1;
        }
        degree += 1;
    }
    table
};

/// Moments of a function on a cluster's surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Moments([f64; MOMENTS]);

/// Derivatives of P of order 1 to 4, in the order of the monomials.
#[derive(Clone, Copy, Debug)]
pub(super) struct Derivatives([f64; MOMENTS + 15]);

impl Moments {
    pub(super) const ZERO: Self = Self([0.0; MOMENTS]);

    /// Adds a piece of surface at ξ, of area and value combined in the length of its normal.
    pub(super) fn add(&mut self, normal: Vec3, xi: Vec3) {
        let mut term = [normal.x, normal.y, normal.z, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0];
        self.add_degree(1, &term, 1.0);
        multiply(&mut term, 1, xi);
        self.add_degree(2, &term, 1.0);
        multiply(&mut term, 2, xi);
        self.add_degree(3, &term, 0.5);
    }

    /// The same of the kernel without normals.
    pub(super) fn add_scalar(&mut self, amount: f64, xi: Vec3) {
        let mut term = [0.0; 10];
        // The squares of the coordinates.
        for k in [0, 3, 5] {
            term[k] = -amount;
        }
        self.add_degree(2, &term, 1.0);
        multiply(&mut term, 2, xi);
        self.add_degree(3, &term, 1.0);
    }

    /// Adds the moments of a part whose middle lies at `t`.
    pub(super) fn add_part(&mut self, part: &Self, t: Vec3) {
        for degree in 1..=3 {
            let mut term = [0.0; 10];
            let count = monomials(degree);
            let start = START[degree - 1];
            term[..count].copy_from_slice(&part.0[start..start + count]);
            let mut factor = 1.0;
            for higher in degree..=3 {
                self.add_degree(higher, &term, factor);
                if higher < 3 {
                    multiply(&mut term, higher, t);
                    factor /= (higher + 1 - degree) as f64;
                }
            }
        }
    }

    /// Transpose of [`add_part`](Self::add_part): adds to the gradient with respect to a part's
    /// moments what it gets from that with respect to the whole's.
    pub(super) fn add_part_transposed(&mut self, whole: &Self, t: Vec3) {
        for degree in 1..=3 {
            let count = monomials(degree);
            let mut term = [0.0; 10];
            term[..count].copy_from_slice(&whole.0[START[degree - 1]..][..count]);
            let mut factor = 1.0;
            for lower in (1..=degree).rev() {
                self.add_degree(lower, &term, factor);
                if lower > 1 {
                    multiply_transposed(&mut term, lower - 1, t);
                    factor /= (degree + 1 - lower) as f64;
                }
            }
        }
    }

    /// Transpose of [`value`](Self::value).
    pub(super) fn add_value_transposed(&mut self, p: &Derivatives, g: f64) {
        for (m, p) in self.0.iter_mut().zip(&p.0) {
            *m += p * g;
        }
    }

    /// Transpose of [`slope`](Self::slope).
    pub(super) fn add_slope_transposed(&mut self, p: &Derivatives, axis: usize, g: f64) {
        for (m, raised) in self.0.iter_mut().zip(&RAISED) {
            *m -= p.0[raised[axis]] * g;
        }
    }

    /// Sum of products.
    pub(super) fn dot(&self, other: &Self) -> f64 {
        self.0.iter().zip(&other.0).map(|(a, b)| a * b).sum()
    }

    fn add_degree(&mut self, degree: usize, term: &[f64; 10], factor: f64) {
        let moments = &mut self.0[START[degree - 1]..][..monomials(degree)];
        for (m, t) in moments.iter_mut().zip(term) {
            *m += t * factor;
        }
    }

    /// The integral.
    #[inline]
    pub(super) fn value(&self, p: &Derivatives) -> f64 {
        self.0.iter().zip(&p.0).map(|(m, p)| m * p).sum()
    }

    /// Derivative of the integral as the point moves along an axis.
    #[inline]
    pub(super) fn slope(&self, p: &Derivatives, axis: usize) -> f64 {
        -self.0.iter().zip(&RAISED).map(|(m, raised)| m * p.0[raised[axis]]).sum::<f64>()
    }

    /// Gradient of the integral with respect to the point.
    #[inline]
    pub(super) fn gradient(&self, p: &Derivatives) -> Vec3 {
        let mut sum = Vec3::ZERO;
        for (m, [x, y, z]) in self.0.iter().zip(RAISED) {
            sum -= vec3(p.0[x], p.0[y], p.0[z]) * *m;
        }
        sum
    }
}

/// A polynomial of the given degree times x·t.
fn multiply(term: &mut [f64; 10], degree: usize, t: Vec3) {
    let mut product = [0.0; 10];
    for (k, factor) in term.iter().enumerate().take(monomials(degree)) {
        for axis in 0..3 {
            product[raised(k, axis)] += factor * t[axis];
        }
    }
    *term = product;
}

/// Transpose of [`multiply`].
fn multiply_transposed(term: &mut [f64; 10], degree: usize, t: Vec3) {
    let mut product = [0.0; 10];
    for (k, p) in product.iter_mut().enumerate().take(monomials(degree)) {
        *p = (0..3).map(|axis| term[raised(k, axis)] * t[axis]).sum();
    }
    *term = product;
}

impl Derivatives {
    /// At the place of the middle relative to the point.
    #[inline]
    pub(super) fn at(Vec3 { x, y, z }: Vec3) -> Self {
        let (xx, yy, zz) = (x * x, y * y, z * z);
        let q = 1.0 / (xx + yy + zz);
        // (2 d/d|z|²)ⁿ P, which the products of n coordinates have as their factor; those with one
        // pair of coordinates contracted have the one before.
        let g1 = q * q;
        let [g2, g3, g4] = [-4.0 * g1 * q, 24.0 * g1 * g1, -192.0 * g1 * g1 * q];
        let [two_x, two_y, two_z] = [xx, yy, zz].map(|s| s * g3 + g2);
        let [pair_x, pair_y, pair_z] = [xx, yy, zz].map(|s| s * g4 + g3);
        let [three_x, three_y, three_z] = [xx, yy, zz].map(|s| s * g4 + 3.0 * g3);
        let both = |s: f64, t: f64| s * t * g4 + (s + t) * g3 + g2;
        let four = |s: f64| s * (s * g4 + 6.0 * g3) + 3.0 * g2;
        let (xy, xz, yz) = (x * y, x * z, y * z);
        Self([
            x * g1,
            y * g1,
            z * g1,
            xx * g2 + g1,
            xy * g2,
            xz * g2,
            yy * g2 + g1,
            yz * g2,
            zz * g2 + g1,
            x * (two_x + 2.0 * g2),
            y * two_x,
            z * two_x,
            x * two_y,
            xy * z * g3,
            x * two_z,
            y * (two_y + 2.0 * g2),
            z * two_y,
            y * two_z,
            z * (two_z + 2.0 * g2),
            four(xx),
            xy * three_x,
            xz * three_x,
            both(xx, yy),
            yz * pair_x,
            both(xx, zz),
            xy * three_y,
            xz * pair_y,
            xy * pair_z,
            xz * three_z,
            four(yy),
            yz * three_y,
            both(yy, zz),
            yz * three_z,
            four(zz),
        ])
    }
}

#[cfg(test)]
mod tests {
    use drt_math::Rng;

    use super::*;

    fn random(rng: &mut Rng) -> Vec3 {
        [(); 3].map(|()| 2.0 * rng.next_f64() - 1.0).into()
    }

    #[test]
    fn derivatives_are_those_of_each_other() {
        let mut rng = Rng::new(60, 0, 0);
        let h = 1e-5;
        for _ in 0..20 {
            let z = random(&mut rng) + vec3(1.5, 0.0, 0.0);
            let p = Derivatives::at(z);
            let q = z.length_squared();
            for axis in 0..3 {
                assert!((p.0[axis] - z[axis] / (q * q)).abs() < 1e-14 / (q * q));
                let mut off = Vec3::ZERO;
                (off.x, off.y, off.z) = match axis {
                    0 => (h, 0.0, 0.0),
                    1 => (0.0, h, 0.0),
                    _ => (0.0, 0.0, h),
                };
                let (plus, minus) = (Derivatives::at(z + off), Derivatives::at(z - off));
                for degree in 1..=3 {
                    for k in 0..monomials(degree) {
                        let i = START[degree - 1] + k;
                        let slope = (plus.0[i] - minus.0[i]) / (2.0 * h);
                        let found = p.0[START[degree] + raised(k, axis)];
                        assert!((found - slope).abs() < 1e-6 * (1.0 + 1.0 / (q * q * q)).powi(2));
                    }
                }
            }
        }
    }

    #[test]
    fn moments_of_parts_add_up() {
        let mut rng = Rng::new(61, 0, 0);
        let (mut whole, mut sum) = (Moments::ZERO, Moments::ZERO);
        for _ in 0..3 {
            let middle = random(&mut rng);
            let mut part = Moments::ZERO;
            for _ in 0..4 {
                let (n, xi) = (random(&mut rng), random(&mut rng));
                part.add(n, xi);
                whole.add(n, middle + xi);
            }
            sum.add_part(&part, middle);
        }
        for (a, b) in whole.0.iter().zip(&sum.0) {
            assert!((a - b).abs() < 1e-13);
        }
    }
}
