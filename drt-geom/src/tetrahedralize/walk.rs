//! What lies on the way from a vertex to another.

use alloc::vec::Vec;

use drt_math::Vec3;

use super::complex::{Complex, OPPOSITE};
use super::predicates::projected_areas;

/// What the open segment from one vertex to another meets first.
#[derive(Clone, Copy, Debug)]
pub(super) enum Meets {
    /// Nothing: it is an edge, of this tetrahedron.
    Nothing(u32),
    Vertex(u32),
    /// The inside of an edge; also a tetrahedron that has it.
    Edge([u32; 2], u32),
    /// The inside of the face across from a corner of a tetrahedron.
    Face(u32, usize),
}

impl Complex {
    /// Looks from `a` to `b`, exactly. None only for points that are no vertices of the complex.
    pub(super) fn look(&mut self, a: u32, b: u32, star: &mut Vec<u32>) -> Option<Meets> {
        if let Some(t) = self.tet_with(a, b, star) {
            return Some(Meets::Nothing(t));
        }
        for &t in star.iter() {
            let tet = &self.tets[t as usize];
            let corner = tet.corner(a);
            let [x, y, z] = OPPOSITE[corner].map(|k| tet.vertices[k]);
            // The direction in the frame of the three edges from a, up to a positive factor.
            let along = [[a, b, y, z], [a, x, b, z], [a, x, y, b]].map(|v| self.orient(v));
            if along.iter().any(|&s| s < 0.0) {
                continue;
            }
            return Some(match along.map(|s| s > 0.0) {
                [true, true, true] => Meets::Face(t, corner),
                [false, true, true] => Meets::Edge([y, z], t),
                [true, false, true] => Meets::Edge([x, z], t),
                [true, true, false] => Meets::Edge([x, y], t),
                [true, false, false] => Meets::Vertex(x),
                [false, true, false] => Meets::Vertex(y),
                [false, false, true] => Meets::Vertex(z),
                [false, false, false] => continue,
            });
        }
        None
    }

    /// Whether the open segment between two vertices meets the closed triangle of three others;
    /// false for triangles that have an end of it as a corner.
    pub(super) fn pierces(&self, [a, b]: [u32; 2], [x, y, z]: [u32; 3]) -> bool {
        if [x, y, z].iter().any(|v| [a, b].contains(v)) {
            return false;
        }
        let sides = [a, b].map(|end| self.orient([x, y, z, end]));
        let same = sides.iter().all(|&s| s >= 0.0) || sides.iter().all(|&s| s <= 0.0);
        if same && (sides[0] == 0.0) == (sides[1] == 0.0) {
            return false;
        }
        let around = [[x, y], [y, z], [z, x]].map(|[v, w]| self.orient([a, b, v, w]));
        around.iter().all(|&s| s >= 0.0) || around.iter().all(|&s| s <= 0.0)
    }

    /// Where a segment goes through the plane of three vertices that lies between its ends.
    pub(super) fn on_segment(&self, [a, b]: [u32; 2], [x, y, z]: [u32; 3]) -> Vec3 {
        let [da, db] = [a, b].map(|end| self.orient([x, y, z, end]).abs());
        self.between([a, b], da, db)
    }

    /// Where a segment goes through the line of an edge in a common plane.
    pub(super) fn on_coplanar(&self, [a, b]: [u32; 2], [x, y]: [u32; 2]) -> Vec3 {
        let at = |v: u32| self.points[v as usize];
        let [da, db] = [a, b].map(|end| projected_areas([at(x), at(y), at(end)]));
        let reach = |k: usize| da[k].abs() + db[k].abs();
        let k = (0..3).max_by(|&i, &j| reach(i).total_cmp(&reach(j))).unwrap_or(0);
        self.between([a, b], da[k].abs(), db[k].abs())
    }

    /// Divides a segment in proportion; a coordinate that both ends share stays what it is.
    fn between(&self, [a, b]: [u32; 2], da: f64, db: f64) -> Vec3 {
        let [a, b] = [a, b].map(|v| self.points[v as usize]);
        if da <= db { a.lerp(b, da / (da + db)) } else { b.lerp(a, db / (da + db)) }
    }

    /// Where an edge goes through a triangle whose corners are on no line with it: in the
    /// triangle's own coordinates, so that one which all corners share stays what it is.
    pub(super) fn on_triangle(&self, [u, v, w]: [u32; 3], [p, q]: [u32; 2]) -> Vec3 {
        let weights = [[v, w], [w, u], [u, v]].map(|[s, t]| self.orient([p, q, s, t]).abs());
        let total = weights[0] + weights[1] + weights[2];
        let [o, e1, e2] = [u, v, w].map(|c| self.points[c as usize]);
        o + (e1 - o) * (weights[1] / total) + (e2 - o) * (weights[2] / total)
    }
}
