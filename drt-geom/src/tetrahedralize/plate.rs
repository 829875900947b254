//! A triangle with vertices on it.

use alloc::vec::Vec;

use drt_math::Vec3;

use super::complex::{Complex, ROUNDING};

/// A triangle and the vertices that count as exactly on it: rounded ones are not.
#[derive(Debug)]
pub(super) struct Plate {
    corners: [u32; 3],
    at: [Vec3; 3],
    /// Twice its area along its normal.
    normal: Vec3,
    vertices: Vec<u32>,
    /// The sides that each lies on, one bit each.
    sides: Vec<u8>,
    rim: usize,
}

impl Plate {
    pub(super) fn new(complex: &Complex, corners: [u32; 3], rim: Vec<(u32, u8)>) -> Self {
        let at = corners.map(|v| complex.points[v as usize]);
        let normal = (at[1] - at[0]).cross(at[2] - at[0]);
        let count = rim.len();
        let (vertices, sides) = rim.into_iter().unzip();
        Self { corners, at, normal, vertices, sides, rim: count }
    }

    pub(super) fn vertices(&self) -> &[u32] {
        &self.vertices
    }

    /// The vertices that are not on its rim.
    pub(super) fn added(&self) -> impl Iterator<Item = u32> {
        self.vertices[self.rim..].iter().copied()
    }

    pub(super) fn has(&self, v: u32) -> bool {
        self.vertices.contains(&v)
    }

    pub(super) fn add(&mut self, v: u32) {
        self.vertices.push(v);
        self.sides.push(0);
    }

    /// Adds a vertex that lies inside, up to rounding.
    pub(super) fn join(&mut self, complex: &Complex, v: u32) {
        if self.has(v) {
            return;
        }
        let p = complex.points[v as usize];
        let [a, b, c] = self.corners;
        let area = self.normal.length();
        let inside = |[o, e]: [Vec3; 2]| self.normal.cross(e - o).dot(p - o) > 0.0;
        let [x, y, z] = self.at;
        if complex.orient([a, b, c, v]).abs() <= ROUNDING * area
            && [[x, y], [y, z], [z, x]].into_iter().all(inside)
        {
            self.add(v);
        }
    }

    /// Whether an edge passes through its inside.
    pub(super) fn is_pierced_by(&self, complex: &Complex, [p, q]: [u32; 2]) -> bool {
        !self.has(p) && !self.has(q) && complex.pierces([p, q], self.corners)
    }

    /// Where an edge passes through it.
    pub(super) fn crossing(&self, complex: &Complex, edge: [u32; 2]) -> Vec3 {
        complex.on_triangle(self.corners, edge)
    }

    /// Whether a face is part of it: all of its vertices on it and not on one side.
    pub(super) fn has_face(&self, face: [u32; 3]) -> bool {
        let sides = |v: u32| self.vertices.iter().position(|&w| w == v).map(|i| self.sides[i]);
        match face.map(sides) {
            [Some(a), Some(b), Some(c)] => a & b & c == 0,
            _ => false,
        }
    }

    /// Area of a face as seen along the normal.
    pub(super) fn area(&self, complex: &Complex, face: [u32; 3]) -> f64 {
        let [a, b, c] = face.map(|v| complex.points[v as usize]);
        0.5 * (b - a).cross(c - a).dot(self.normal).abs() / self.normal.length()
    }

    /// Whether so large a part of it is all of it, up to rounding.
    pub(super) fn is_covered_by(&self, area: f64) -> bool {
        let whole = 0.5 * self.normal.length();
        let [a, b, c] = self.at;
        let length = f64::max((b - a).max_abs(), (c - a).max_abs());
        (area - whole).abs() <= 1e-6 * whole + 100.0 * ROUNDING * length
    }
}
