use alloc::vec;
use alloc::vec::Vec;

use drt_geom::Mesh;
use drt_math::Vec3;

use super::triangle::Triangle;
use super::view::View;
use super::{BEYOND, Kernel, MeanValueWeight, orientation, unit_of};
use crate::error::Cause;

/// A closed triangle mesh whose vertices carry space with them.
#[derive(Clone, Debug)]
pub struct Cage {
    triangles: Vec<Triangle>,
    /// Vertices of the cage's file at the corners of the triangles.
    corners: Vec<[u32; 3]>,
    vertices: usize,
    middle: Vec3,
    unit: f64,
}

impl Cage {
    /// A cage from a mesh of one or several closed parts, nested in any way and with any winding,
    /// that do not intersect each other.
    ///
    /// Where parts overlap, coordinates may be large, for their common denominator may vanish.
    ///
    /// # Errors
    /// When the mesh is not closed or has one side only, or a part of it encloses no volume.
    pub fn new(mesh: &Mesh) -> Result<Self, Cause> {
        if !mesh.positions.iter().all(|p| p.is_finite()) {
            return Err(Cause::NotFinite { what: "a vertex of the cage" });
        }
        let bounds = mesh.bounds();
        let unit = unit_of(if bounds.is_empty() { 1.0 } else { bounds.extent().max_abs() });
        let turned = orientation::alternating(mesh)?;
        let corners = turned.iter().map(|(_, t)| *t);
        let place = |t: [u32; 3]| Triangle::new(t.map(|i| mesh.positions[i as usize] * unit));
        Ok(Self {
            triangles: corners.clone().map(place).collect(),
            corners: corners.map(|t| t.map(|i| mesh.source_vertex(i))).collect(),
            vertices: mesh.source_vertex_count as usize,
            middle: bounds.center() * unit,
            unit,
        })
    }

    /// Number of vertices in the cage's file.
    #[must_use]
    pub fn vertex_count(&self) -> usize {
        self.vertices
    }

    /// Replaces `out` by the mean value coordinates of a point: one weight per vertex of the cage's
    /// file, in its order.
    ///
    /// They sum to 1 and give every linear function back. On the surface, or nearer to it than 1e-13
    /// of the triangle's distance to its farthest corner, they are barycentric, with the gradient
    /// within the triangle: across the surface it jumps. Outside of the cage they go on smoothly, but
    /// grow with the distance; beyond 1e12 sizes of the cage, and for a point that is not finite, all
    /// are equal.
    pub fn coordinates(&self, x: Vec3, out: &mut Vec<MeanValueWeight>) {
        out.clear();
        out.resize(self.vertices, MeanValueWeight::default());
        let x = x * self.unit;
        let mut whole = MeanValueWeight::default();
        if (x - self.middle).max_abs() < BEYOND {
            for (triangle, corners) in self.triangles.iter().zip(&self.corners) {
                match triangle.view(x, Kernel::MeanValue) {
                    View::Apart(weights) => {
                        for (&v, w) in corners.iter().zip(&weights) {
                            out[v as usize].add(w);
                            whole.add(w);
                        }
                    }
                    View::On(weights) => {
                        out.fill(MeanValueWeight::default());
                        for (&v, w) in corners.iter().zip(&weights) {
                            let gradient = w.gradient * self.unit;
                            out[v as usize].add(&MeanValueWeight { gradient, ..*w });
                        }
                        return;
                    }
                }
            }
        }
        let inverse = 1.0 / whole.value;
        if !inverse.is_finite() {
            let value = 1.0 / self.vertices as f64;
            out.fill(MeanValueWeight { value, gradient: Vec3::ZERO });
            return;
        }
        for w in out {
            w.value *= inverse;
            w.gradient = (w.gradient - whole.gradient * w.value) * (inverse * self.unit);
        }
    }
}

/// Mean value coordinates of many points, as the matrix that spreads velocities of cage vertices to
/// the points.
#[derive(Clone, Debug)]
pub struct CageWeights {
    /// Row by row, one per point.
    weights: Vec<f64>,
    points: usize,
    columns: usize,
}

impl CageWeights {
    /// The weights of all vertices of the cage's file at these points.
    #[must_use]
    pub fn new(cage: &Cage, points: &[Vec3]) -> Self {
        let all: Vec<u32> = (0..cage.vertices as u32).collect();
        Self::of_vertices(cage, points, &all)
    }

    /// The weights of some vertices alone, which must exist.
    pub(crate) fn of_vertices(cage: &Cage, points: &[Vec3], vertices: &[u32]) -> Self {
        let mut weights = Vec::with_capacity(points.len() * vertices.len());
        let mut row = Vec::new();
        for &x in points {
            cage.coordinates(x, &mut row);
            weights.extend(vertices.iter().map(|&v| row[v as usize].value));
        }
        Self { weights, points: points.len(), columns: vertices.len() }
    }

    /// The weights of the cage's vertices at one point.
    ///
    /// # Panics
    /// When there is no such point.
    #[must_use]
    pub fn of_point(&self, point: usize) -> &[f64] {
        &self.weights[point * self.columns..(point + 1) * self.columns]
    }

    /// Velocities of the points from those of the cage's vertices, in the order of its file.
    #[must_use]
    pub fn spread(&self, vertices: &[Vec3]) -> Vec<Vec3> {
        let sum = |point| {
            self.of_point(point).iter().zip(vertices).fold(Vec3::ZERO, |sum, (w, v)| sum + *v * *w)
        };
        (0..self.points).map(sum).collect()
    }

    /// Transpose of [`spread`](Self::spread): the gradient with respect to the velocities of the
    /// cage's vertices, from that with respect to the points'.
    #[must_use]
    pub fn gather(&self, points: &[Vec3]) -> Vec<Vec3> {
        let mut vertices = vec![Vec3::ZERO; self.columns];
        for (point, g) in (0..self.points).zip(points) {
            for (v, w) in vertices.iter_mut().zip(self.of_point(point)) {
                *v += *g * *w;
            }
        }
        vertices
    }
}
