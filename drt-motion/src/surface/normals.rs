use alloc::collections::BTreeMap;
use alloc::vec;
use alloc::vec::Vec;

use drt_geom::{Mesh, weld};
use drt_math::{Vec3, fm};

use super::VertexVectors;
use super::area::{Unit, area_rate, area_rate_transposed, edges_and_area};
use super::reached::triangles_around;
use crate::lists::Lists;

/// Vertex normals recomputed from the positions of a deforming mesh, with their rates and the
/// transpose of those.
///
/// As in [`Mesh::with_smooth_normals`], a vertex normal is the mean of the normals of the triangles
/// around it, weighted by their angles there (Thürmer and Wüthrich 1998). Vertices that coincide
/// in the reference configuration *and* have the same normal there share one: seams stay smooth and
/// creases stay sharp. They go on sharing it when a deformation pulls them apart, for otherwise
/// normals would jump as soon as theta leaves zero.
#[derive(Clone, Debug, PartialEq)]
pub struct SmoothNormals {
    /// The shared normal that each mesh vertex takes.
    shared: Vec<u32>,
    count: usize,
}

impl SmoothNormals {
    /// Decides which vertices of the reference mesh share a normal.
    #[must_use]
    pub fn new(reference: &Mesh) -> Self {
        let positions = weld(&reference.positions);
        let normals = match &reference.normals {
            Some(normals) => weld(normals),
            None => vec![0; positions.len()],
        };
        let mut numbers = BTreeMap::new();
        let shared = positions.into_iter().zip(normals).map(|key| {
            let next = numbers.len() as u32;
            *numbers.entry(key).or_insert(next)
        });
        let shared = shared.collect();
        Self { shared, count: numbers.len() }
    }

    /// Unit normals of the mesh's vertices. Where the triangles around a vertex cancel, the normal
    /// that the mesh has is left in place.
    ///
    /// # Panics
    /// As all methods, when `mesh` is not the reference mesh in another position.
    #[must_use]
    pub fn normals(&self, mesh: &Mesh) -> Vec<Vec3> {
        let units = self.units(mesh);
        let unit = |(i, &s): (usize, &u32)| {
            let n = units[s as usize].dir;
            let kept = mesh.normals.as_ref().filter(|_| n == Vec3::ZERO);
            kept.map_or(n, |normals| normals[i])
        };
        self.shared.iter().enumerate().map(unit).collect()
    }

    /// Rates of the normals for given velocities of the mesh's vertices.
    #[must_use]
    pub fn rates(&self, mesh: &Mesh, velocities: &[Vec3]) -> Vec<Vec3> {
        self.rates_from(&self.units(mesh), mesh, velocities)
    }

    /// Computes [`rates`](Self::rates) from the [`units`](Self::units), which do not depend on the velocities.
    pub(super) fn rates_from(&self, units: &[Unit], mesh: &Mesh, velocities: &[Vec3]) -> Vec<Vec3> {
        let mut sums = vec![Vec3::ZERO; self.count];
        for t in &mesh.triangles {
            let v = t.map(|i| velocities[i as usize]);
            // Most of a mesh rests where single vertices move.
            if v == [Vec3::ZERO; 3] {
                continue;
            }
            let rates = Face::new(mesh, t).rates(v);
            for (&i, rate) in t.iter().zip(rates) {
                sums[self.shared[i as usize] as usize] += rate;
            }
        }
        let rates: Vec<_> = units.iter().zip(sums).map(|(unit, sum)| unit.rate(sum)).collect();
        self.shared.iter().map(|&s| rates[s as usize]).collect()
    }

    /// What [`rates_of_few`](Self::rates_of_few) looks up.
    pub(super) fn neighbours(&self, mesh: &Mesh) -> Neighbours {
        let pairs: Vec<_> = self.shared.iter().copied().zip(0..).collect();
        Neighbours { triangles: triangles_around(mesh), takers: Lists::new(self.count, &pairs) }
    }

    /// The same rates as [`rates_from`](Self::rates_from) for velocities of few vertices, the others resting, in a
    /// time that depends on these alone.
    pub(super) fn rates_of_few(
        &self,
        units: &[Unit],
        mesh: &Mesh,
        around: &Neighbours,
        velocities: &VertexVectors,
    ) -> VertexVectors {
        let mut triangles: Vec<u32> =
            velocities.stored().flat_map(|(v, _)| around.triangles.of(v)).copied().collect();
        triangles.sort_unstable();
        triangles.dedup();
        let mut sums = BTreeMap::new();
        for t in triangles.into_iter().map(|t| &mesh.triangles[t as usize]) {
            let v = t.map(|i| velocities[i as usize]);
            if v == [Vec3::ZERO; 3] {
                continue;
            }
            for (&i, rate) in t.iter().zip(Face::new(mesh, t).rates(v)) {
                *sums.entry(self.shared[i as usize]).or_insert(Vec3::ZERO) += rate;
            }
        }
        let mut rates: Vec<(u32, Vec3)> = Vec::new();
        for (shared, sum) in sums {
            let rate = units[shared as usize].rate(sum);
            rates.extend(around.takers.of(shared as usize).iter().map(|i| (*i, rate)));
        }
        rates.sort_unstable_by_key(|(i, _)| *i);
        VertexVectors::of_few(self.shared.len(), rates)
    }

    /// Transpose of [`rates`](Self::rates): adds to `positions` the gradient with respect to the
    /// velocities, given the gradient with respect to the rates of the normals.
    pub fn rates_transposed(&self, mesh: &Mesh, normals: &[Vec3], positions: &mut [Vec3]) {
        let units = self.units(mesh);
        let mut on_sums = vec![Vec3::ZERO; self.count];
        for (&s, &g) in self.shared.iter().zip(normals) {
            on_sums[s as usize] += units[s as usize].rate(g);
        }
        for t in &mesh.triangles {
            let on_corners = t.map(|i| on_sums[self.shared[i as usize] as usize]);
            let on_positions = Face::new(mesh, t).rates_transposed(on_corners);
            for (&i, g) in t.iter().zip(on_positions) {
                positions[i as usize] += g;
            }
        }
    }

    /// The shared normals, unit and with what they were divided by.
    pub(super) fn units(&self, mesh: &Mesh) -> Vec<Unit> {
        let mut sums = vec![Vec3::ZERO; self.count];
        for t in &mesh.triangles {
            let face = Face::new(mesh, t);
            for (&i, angle) in t.iter().zip(face.angles) {
                sums[self.shared[i as usize] as usize] += face.normal.dir * angle;
            }
        }
        sums.into_iter().map(Unit::new).collect()
    }
}

/// What is around each vertex of a mesh, and which vertices share a normal.
pub(super) struct Neighbours {
    triangles: Lists,
    /// The vertices that take each shared normal.
    takers: Lists,
}

/// What a triangle gives to the normals of its corners: its unit normal times its angle there.
/// A triangle without area gives nothing.
struct Face {
    edges: [Vec3; 2],
    normal: Unit,
    angles: [f64; 3],
    /// Gradient of each side's turning, within the plane, with respect to the side: (n × d) / d².
    turning: [Vec3; 3],
}

impl Face {
    fn new(mesh: &Mesh, t: &[u32; 3]) -> Self {
        let x = t.map(|i| mesh.positions[i as usize]);
        let (edges, area) = edges_and_area(x);
        let normal = Unit::new(area);
        if normal.dir == Vec3::ZERO {
            return Self { edges, normal, angles: [0.0; 3], turning: [Vec3::ZERO; 3] };
        }
        // Side k runs from corner k to the next.
        let sides = [0, 1, 2].map(|k| x[(k + 1) % 3] - x[k]);
        let angle = |k: usize| fm::atan2(area.length(), -sides[k].dot(sides[(k + 2) % 3]));
        Self {
            edges,
            normal,
            angles: [0, 1, 2].map(angle),
            turning: sides.map(|d| normal.dir.cross(d) / d.length_squared()),
        }
    }

    /// Rates of what the corners get. The angle at corner k closes by as much as side k turns, and
    /// opens by as much as the side before it.
    fn rates(&self, v: [Vec3; 3]) -> [Vec3; 3] {
        let n_dot = self.normal.rate(area_rate(self.edges, v));
        let turned = [0, 1, 2].map(|k| self.turning[k].dot(v[(k + 1) % 3] - v[k]));
        [0, 1, 2]
            .map(|k| n_dot * self.angles[k] + self.normal.dir * (turned[(k + 2) % 3] - turned[k]))
    }

    fn rates_transposed(&self, g: [Vec3; 3]) -> [Vec3; 3] {
        let on_normal = g[0] * self.angles[0] + g[1] * self.angles[1] + g[2] * self.angles[2];
        let mut on_v = area_rate_transposed(self.edges, self.normal.rate(on_normal));
        for k in 0..3 {
            let next = (k + 1) % 3;
            let on_side = self.turning[k] * self.normal.dir.dot(g[next] - g[k]);
            on_v[next] += on_side;
            on_v[k] += -on_side;
        }
        on_v
    }
}
