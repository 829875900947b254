//! Open surfaces whose rims meet up to rounding, joined.

use alloc::sync::Arc;
use alloc::vec::Vec;

use drt_geom::{EdgeClass, Mesh, Topology};
use drt_math::{Vec3, vec3};

use super::SurroundingSurface;

/// How far apart vertices are that should be one, in units of the largest coordinate: 64 roundings.
///
/// An affine map takes three products and three sums for each coordinate. Its result is off by at most
/// three roundings of half a unit in the last place of the largest product, and so by 1.5 units. A chain of eight
/// maps is off by 12 units, and two vertices that came by different ones differ by 24. What is left
/// allows for coordinates that are larger on the way than in the end.
pub const WELDED: f64 = 64.0 * f64::EPSILON;

/// A vertex of one of several surfaces.
#[derive(Clone, Copy)]
struct Vertex {
    surface: usize,
    index: usize,
    position: Vec3,
    on_rim: bool,
    /// Along a direction in which few vertices lie level with one another.
    height: f64,
}

/// The meshes of surfaces, with each vertex on a rim moved to where the vertices are that differ from
/// it by rounding: to one off all rims if there is any, else to the first.
pub(super) fn joined(surfaces: &[SurroundingSurface<'_>]) -> Vec<Arc<Mesh>> {
    let mut meshes: Vec<Arc<Mesh>> = surfaces.iter().map(|s| Arc::clone(s.mesh)).collect();
    let mut vertices = Vec::new();
    let mut any_rim = false;
    for (surface, mesh) in meshes.iter().enumerate() {
        let on_rim = rim(mesh);
        any_rim |= on_rim.contains(&true);
        vertices.extend(mesh.positions.iter().zip(on_rim).enumerate().map(
            |(index, (&position, on_rim))| {
                let height = position.dot(vec3(0.577_215_66, 0.414_213_56, 0.703_818_4));
                Vertex { surface, index, position, on_rim, height }
            },
        ));
    }
    if !any_rim {
        return meshes;
    }
    let largest = vertices.iter().fold(0.0, |m, v| f64::max(m, v.position.max_abs()));
    let tolerance = WELDED * largest;
    // The direction is no longer than √3 / 1.7.
    let level = 2.0 * tolerance;
    let mut order: Vec<usize> = (0..vertices.len()).collect();
    order.sort_by(|&a, &b| vertices[a].height.total_cmp(&vertices[b].height));
    let mut groups = Groups::new(vertices.len());
    for (at, &i) in order.iter().enumerate() {
        let v = vertices[i];
        for &j in order[at + 1..].iter().take_while(|&&j| vertices[j].height - v.height <= level) {
            let w = vertices[j];
            let near = (v.position - w.position).max_abs() <= tolerance;
            if near && (v.on_rim || w.on_rim) {
                groups.join(i, j);
            }
        }
    }
    // Of each group, where it is joined.
    let mut place: Vec<Option<usize>> = alloc::vec![None; vertices.len()];
    for i in 0..vertices.len() {
        let first = groups.first(i);
        let better = place[first].is_none_or(|p| vertices[p].on_rim && !vertices[i].on_rim);
        if better {
            place[first] = Some(i);
        }
    }
    for i in 0..vertices.len() {
        let v = vertices[i];
        let Some(to) = place[groups.first(i)] else { continue };
        if v.on_rim && vertices[to].position != v.position {
            Arc::make_mut(&mut meshes[v.surface]).positions[v.index] = vertices[to].position;
        }
    }
    meshes
}

/// Which vertices lie on edges of one face.
fn rim(mesh: &Mesh) -> Vec<bool> {
    let topology = Topology::of(mesh);
    let mut at_place = alloc::vec![false; mesh.positions.len()];
    for edge in topology.edges.iter().filter(|e| e.class == EdgeClass::Boundary) {
        for v in edge.vertices {
            at_place[topology.welded[v as usize] as usize] = true;
        }
    }
    topology.welded.iter().map(|&first| at_place[first as usize]).collect()
}

/// Disjoint groups of numbers.
struct Groups(Vec<usize>);

impl Groups {
    fn new(count: usize) -> Self {
        Self((0..count).collect())
    }

    /// A number that stands for the group of this one.
    fn first(&mut self, mut i: usize) -> usize {
        while self.0[i] != i {
            self.0[i] = self.0[self.0[i]];
            i = self.0[i];
        }
        i
    }

    fn join(&mut self, i: usize, j: usize) {
        let (a, b) = (self.first(i), self.first(j));
        self.0[usize::max(a, b)] = usize::min(a, b);
    }
}

#[cfg(test)]
mod tests {
    use drt_geom::procedural;
    use drt_math::{Affine, Mat3};

    use super::*;

    fn meshes(list: Vec<Mesh>) -> Vec<Arc<Mesh>> {
        let list: Vec<Arc<Mesh>> = list.into_iter().map(Arc::new).collect();
        let surface = |mesh| SurroundingSurface { mesh, motions: &[], scatters: false };
        joined(&list.iter().map(surface).collect::<Vec<_>>())
    }

    fn moved(mesh: &Mesh, by: Vec3) -> Mesh {
        mesh.transform(&Affine { linear: Mat3::IDENTITY, translation: by })
    }

    #[test]
    fn rims_meet_to_rounding_and_no_farther() {
        let sheet = procedural::rectangle();
        for size in [1e-9, 1.0, 1e12] {
            let scaled = |m: &Mesh| {
                m.transform(&Affine { linear: Mat3::IDENTITY * size, translation: Vec3::ZERO })
            };
            for (off, meet) in [(20.0, true), (200.0, false)] {
                let off = vec3(2.0, off * f64::EPSILON, -off * f64::EPSILON);
                let [a, b] = [&sheet, &moved(&sheet, off)].map(scaled);
                let together = meshes(alloc::vec![a.clone(), b.clone()]);
                let shared = together[1].positions.iter().filter(|p| a.positions.contains(p));
                assert_eq!(shared.count(), if meet { 2 } else { 0 }, "{size}");
                assert_eq!(*together[0], a);
                let others =
                    (together[1].positions.iter()).zip(&b.positions).filter(|(p, q)| p == q);
                assert_eq!(others.count(), if meet { 2 } else { 4 });
            }
        }
    }

    #[test]
    fn bodies_stay() {
        // A rim is moved onto a body's corners; corners of two bodies stay apart.
        let off = Vec3::splat(8.0 * f64::EPSILON);
        let cube = procedural::cube();
        let other = moved(&cube, off);
        let sheet = moved(&procedural::rectangle(), vec3(0.0, 0.0, 1.0) - off);
        let together = meshes(alloc::vec![sheet, cube.clone(), other.clone()]);
        assert_eq!(*together[1], cube);
        assert_eq!(*together[2], other);
        assert!(together[0].positions.iter().all(|p| cube.positions.contains(p)));
    }
}
