//! Determinants of thin tetrahedra, in numbers of twice the precision (Dekker 1971, "A
//! floating-point technique for extending the available precision").
//!
//! Volumes and weights of a sliver are small differences of large products. Formed of doubled
//! numbers they are right to rounding whatever the shape, and so is the sign of the volume, unless
//! less than 1e-29 of the longest edge's cube is left of it.

use core::ops::{Add, Mul, Sub};

use drt_math::{Vec3, vec3};

/// More than twenty roundings of 2^-104 of a product of three edges below 2.
const ROUNDING: f64 = 1e-29;

/// The unevaluated sum of a number and a much smaller one.
#[derive(Clone, Copy)]
struct Double {
    head: f64,
    tail: f64,
}

impl Double {
    /// `a - b`, exactly.
    fn difference(a: f64, b: f64) -> Self {
        let head = a - b;
        let z = head - a;
        Self { head, tail: (a - (head - z)) - (b + z) }
    }

    /// `a + b` for `a` of the larger size, or zero.
    fn renormalized(a: f64, b: f64) -> Self {
        let head = a + b;
        Self { head, tail: b - (head - a) }
    }

    /// `a b`, exactly.
    fn product(a: f64, b: f64) -> Self {
        let (ah, al) = halves(a);
        let (bh, bl) = halves(b);
        let head = a * b;
        Self { head, tail: al * bl - (((head - ah * bh) - al * bh) - ah * bl) }
    }

    /// Times a power of two.
    fn scaled(self, s: f64) -> Self {
        Self { head: self.head * s, tail: self.tail * s }
    }
}

/// Two numbers of 26 bits that sum to `a`.
fn halves(a: f64) -> (f64, f64) {
    let c = 134_217_729.0 * a;
    let high = c - (c - a);
    (high, a - high)
}

impl Add for Double {
    type Output = Self;
    fn add(self, o: Self) -> Self {
        let head = self.head + o.head;
        let z = head - self.head;
        let tail = (self.head - (head - z)) + (o.head - z);
        Self::renormalized(head, tail + (self.tail + o.tail))
    }
}

impl Sub for Double {
    type Output = Self;
    fn sub(self, o: Self) -> Self {
        self + Self { head: -o.head, tail: -o.tail }
    }
}

impl Mul for Double {
    type Output = Self;
    fn mul(self, o: Self) -> Self {
        let p = Self::product(self.head, o.head);
        Self::renormalized(p.head, p.tail + (self.head * o.tail + self.tail * o.head))
    }
}

type Edge = [Double; 3];

fn cross(a: &Edge, b: &Edge) -> Edge {
    [(1, 2), (2, 0), (0, 1)].map(|(i, j)| a[i] * b[j] - a[j] * b[i])
}

fn dot(a: &Edge, b: &Edge) -> Double {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// The edges from a tetrahedron's first corner to the others.
pub(super) struct EdgeFrame {
    /// The edges, brought to a size of about one.
    edges: [Edge; 3],
    /// By what power of two.
    scale: f64,
    /// Their largest coordinate difference, as it was.
    pub(super) size: f64,
}

impl EdgeFrame {
    pub(super) fn of([a, b, c, d]: [Vec3; 4]) -> Self {
        let edge = |v: Vec3| [0, 1, 2].map(|k| Double::difference(v[k], a[k]));
        let size = [b, c, d].iter().fold(0.0, |s, v| f64::max(s, (*v - a).max_abs()));
        let scale = 1.0 / power_of_two(size);
        let edges = [b, c, d].map(|v| edge(v).map(|x| x.scaled(scale)));
        Self { edges, scale, size }
    }

    /// Six times the volume, signed, after bringing the edges to size; zero if rounding may be all
    /// there is to it.
    pub(super) fn determinant(&self) -> f64 {
        let [b, c, d] = &self.edges;
        let det = dot(b, &cross(c, d)).head;
        if det.abs() > ROUNDING { det } else { 0.0 }
    }

    /// The signed volume.
    pub(super) fn volume(&self) -> f64 {
        let per = 1.0 / self.scale;
        self.determinant() / 6.0 * per * per * per
    }

    /// The gradients of the weights of all corners but the first, which are the rows of the edges'
    /// inverse, each to rounding; `None` without a volume.
    pub(super) fn gradients(&self) -> Option<[Vec3; 3]> {
        let [b, c, d] = &self.edges;
        let det = self.determinant();
        let row = |n: Edge| vec3(n[0].head, n[1].head, n[2].head) * (self.scale / det);
        let rows = [row(cross(c, d)), row(cross(d, b)), row(cross(b, c))];
        rows.iter().all(|g| g.is_finite()).then_some(rows)
    }

    /// The gradients of the weights of all corners.
    fn all_gradients(&self) -> Option<[Vec3; 4]> {
        let [b, c, d] = self.gradients()?;
        Some([-(b + c + d), b, c, d])
    }

    /// Whether a corner is no farther than `height` from the plane of the others.
    pub(super) fn is_flat(&self, height: f64) -> bool {
        let above = |g: &Vec3| (*g * height).length_squared() < 1.0;
        !self.all_gradients().is_some_and(|g| g.iter().all(above))
    }

    /// The corner nearest to the plane of the others.
    pub(super) fn steepest(&self) -> usize {
        let gradients = self.all_gradients().unwrap_or_default().map(Vec3::max_abs);
        (1..4).fold(0, |k, i| if gradients[i] > gradients[k] { i } else { k })
    }
}

/// The power of two at or below a positive number; 1 for what has no such inverse.
fn power_of_two(x: f64) -> f64 {
    let power = f64::from_bits(x.to_bits() & f64::INFINITY.to_bits());
    if power.is_normal() && (1.0 / power).is_normal() { power } else { 1.0 }
}
