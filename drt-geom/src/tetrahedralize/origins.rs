//! The result, with each vertex's place on the input.

use alloc::vec::Vec;

use drt_math::Vec3;

use super::Tetrahedralization;
use super::input::{Carrier, FIRST, Merged, Part};
use super::recovery::Recovery;
use crate::{TetMesh, TetVertexOrigin};

impl Recovery<'_> {
    pub(super) fn finish(self, merged: &Merged) -> Tetrahedralization {
        let count = self.complex.points.len();
        let mut places: Vec<Vec<TetVertexOrigin>> = alloc::vec![Vec::new(); count];
        for (v, carriers) in self.owners.iter().enumerate() {
            places[v].extend(carriers.iter().map(|c| self.place(v as u32, *c)));
        }
        for (&v, point) in merged.points.iter().zip(0..) {
            places[v as usize].push(TetVertexOrigin::Point(point));
        }
        let mut result = Tetrahedralization::default();
        for (v, places) in (0..).zip(&places) {
            let other = if v < FIRST { TetVertexOrigin::Box } else { TetVertexOrigin::Inside };
            result.origins.push(places.first().copied().unwrap_or(other));
            result.shared.extend(places.iter().skip(1).map(|&p| (v, p)));
        }
        let unscaled = 1.0 / merged.scale;
        let positions = self.complex.points.iter().map(|&p| p * unscaled).collect();
        result.mesh =
            TetMesh { positions, tets: self.complex.live().map(|t| t.vertices).collect() };
        result
    }

    fn place(&self, v: u32, carrier: Carrier) -> TetVertexOrigin {
        let named = &self.named[carrier.triangle as usize];
        let p = self.complex.points[v as usize];
        let corners = named.corners.map(|c| self.complex.points[c as usize]);
        let mut weights = [0.0; 3];
        match carrier.part {
            Part::Corner(k) => weights[k] = 1.0,
            Part::Edge(k) => {
                let (a, b) = (corners[k], corners[(k + 1) % 3]);
                let s = ((p - a).dot(b - a) / (b - a).length_squared()).clamp(0.0, 1.0);
                weights[k] = 1.0 - s;
                weights[(k + 1) % 3] = s;
            }
            Part::Inside => weights = project(corners, p),
        }
        TetVertexOrigin::Surface {
            surface: named.name.surface,
            triangle: named.name.triangle,
            bary: [weights[1], weights[2]],
        }
    }
}

/// Barycentric weights of a point's foot on a triangle.
fn project([a, b, c]: [Vec3; 3], p: Vec3) -> [f64; 3] {
    let (e1, e2, d) = (b - a, c - a, p - a);
    let normal = e1.cross(e2);
    let area = normal.length_squared();
    let w1 = (d.cross(e2).dot(normal) / area).clamp(0.0, 1.0);
    let w2 = (e1.cross(d).dot(normal) / area).clamp(0.0, 1.0 - w1);
    [1.0 - w1 - w2, w1, w2]
}
