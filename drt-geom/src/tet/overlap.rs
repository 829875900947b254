//! Overlaps that adjacency alone does not show.

use alloc::vec::Vec;
use core::ops::ControlFlow;

use drt_math::Vec3;

use super::locate::{Record, holds};
use super::{TetLocator, TetMesh};
use crate::Aabb;

impl TetLocator {
    /// Two tetrahedra that overlap by more than rounding: a face of the boundary passes through one,
    /// or the middle of one lies in another.
    pub(super) fn overlap(&self, mesh: &TetMesh, boundary: &[(u32, usize)]) -> Option<[u32; 2]> {
        let first = |window: &Aabb, of: u32, overlaps: &dyn Fn(&Record) -> bool| {
            let mut found: Option<u32> = None;
            self.tree.near(window, |places| {
                for record in &self.records[places] {
                    let tet = record.tet();
                    if tet != of && overlaps(record) {
                        found = Some(found.map_or(tet, |f| f.min(tet)));
                    }
                }
                ControlFlow::Continue(())
            });
            found.map(|tet| [of, tet])
        };
        let faces = boundary.iter().find_map(|&(tet, k)| {
            let corners = mesh.face(tet, k).map(|v| mesh.positions[v as usize]);
            first(&Aabb::around(corners), tet, &|record| enters(record, corners))
        });
        faces.or_else(|| {
            (0..mesh.tets.len() as u32).find_map(|tet| {
                let middle = mesh.tet(tet).iter().fold(Vec3::ZERO, |sum, v| sum + *v * 0.25);
                let window = Aabb { min: middle, max: middle };
                first(&window, tet, &|r| holds(&r.weights(middle), &r.errors()))
            })
        })
    }
}

/// Whether part of a triangle lies inside a tetrahedron: whatever is left of it after cutting off
/// where a weight is not positive (Sutherland and Hodgman 1974, "Reentrant polygon clipping").
fn enters(record: &Record, triangle: [Vec3; 3]) -> bool {
    let mut polygon: Vec<[f64; 4]> = triangle.iter().map(|v| record.weights(*v)).collect();
    // The errors are those of points inside and grow with the distance, as weights do.
    let largest = polygon.iter().flatten().fold(1.0, |m, w| f64::max(m, w.abs()));
    let least = record.errors().map(|e| e * 4.0 * largest);
    let reaches = |i: usize| polygon.iter().any(|w| w[i] > least[i]);
    if !(0..4).all(reaches) {
        return false;
    }
    for i in 0..4 {
        let height = |w: &[f64; 4]| w[i] - least[i];
        let mut kept = Vec::with_capacity(polygon.len() + 1);
        for (k, w) in polygon.iter().enumerate() {
            let next = &polygon[(k + 1) % polygon.len()];
            let (h, j) = (height(w), height(next));
            if h > 0.0 {
                kept.push(*w);
            }
            if (h > 0.0) != (j > 0.0) {
                let s = h / (h - j);
                kept.push([0, 1, 2, 3].map(|c| w[c] + (next[c] - w[c]) * s));
            }
        }
        polygon = kept;
    }
    !polygon.is_empty()
}
