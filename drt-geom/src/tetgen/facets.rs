use alloc::vec::Vec;

use drt_math::{Vec3, vec3};

use super::TetgenError;
use crate::crossing::has_area;
use crate::{Aabb, Mesh, NONE, TetVertexOrigin, TetrahedralizeInput, procedural, weld};

/// The input as one set of points and triangles over them.
#[derive(Default)]
pub(super) struct Facets {
    /// Distinct: of the surfaces, of the points, of the box.
    pub(super) positions: Vec<Vec3>,
    /// Where each position comes from.
    pub(super) origins: Vec<TetVertexOrigin>,
    /// Further origins, sorted by position.
    pub(super) shared: Vec<(u32, TetVertexOrigin)>,
    /// No two over the same corners; those of the box are last.
    pub(super) triangles: Vec<[u32; 3]>,
    /// Surface and triangle of each, but of the box.
    pub(super) names: Vec<(u32, u32)>,
}

impl Facets {
    pub(super) fn new(input: &TetrahedralizeInput<'_>) -> Result<Self, TetgenError> {
        for (surface, mesh) in input.surfaces.iter().enumerate() {
            // For what it checks; fields may have been edited.
            Mesh::new(mesh.positions.clone(), mesh.triangles.clone())
                .map_err(|source| TetgenError::BadSurface { surface, source })?;
        }
        if let Some(point) = input.points.iter().position(|p| !p.is_finite()) {
            return Err(TetgenError::BadPoint { point });
        }
        let mut facets = Self::default();
        facets.gather(input);
        facets.drop_repeated()?;
        if facets.positions.is_empty() {
            return Err(TetgenError::Empty);
        }
        facets.enclose(input.margin)?;
        Ok(facets)
    }

    /// Numbers the vertices that triangles with an area use, and the points, each position once.
    fn gather(&mut self, input: &TetrahedralizeInput<'_>) {
        let surfaces = input.surfaces.iter().flat_map(|s| &s.positions);
        let all: Vec<Vec3> = surfaces.chain(input.points).copied().collect();
        let welded = weld(&all);
        let mut vertices = alloc::vec![NONE; all.len()];
        let mut seen = alloc::vec![false; all.len()];
        let mut number = |facets: &mut Self, place: usize, origin: TetVertexOrigin| {
            let vertex = &mut vertices[welded[place] as usize];
            if *vertex == NONE {
                *vertex = facets.positions.len() as u32;
                facets.positions.push(all[place]);
                facets.origins.push(origin);
            } else if !seen[place] {
                facets.shared.push((*vertex, origin));
            }
            seen[place] = true;
            *vertex
        };
        let mut base = 0;
        for (surface, mesh) in (0..).zip(input.surfaces) {
            for (triangle, corners) in (0..).zip(&mesh.triangles) {
                if !has_area(&mesh.triangle(triangle)) {
                    continue;
                }
                let mut corner = |k: usize| {
                    let bary = [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]][k];
                    let origin = TetVertexOrigin::Surface { surface, triangle, bary };
                    number(self, base + corners[k] as usize, origin)
                };
                let corners = [corner(0), corner(1), corner(2)];
                self.triangles.push(corners);
                self.names.push((surface, triangle));
            }
            base += mesh.positions.len();
        }
        for point in 0..input.points.len() {
            number(self, base + point, TetVertexOrigin::Point(point as u32));
        }
        self.shared.sort_by_key(|(vertex, _)| *vertex);
    }

    /// Keeps the first of the triangles with the same corners.
    fn drop_repeated(&mut self) -> Result<(), TetgenError> {
        let key = |i: u32| {
            let mut corners = self.triangles[i as usize];
            corners.sort_unstable();
            corners
        };
        let mut order: Vec<u32> = (0..self.triangles.len() as u32).collect();
        order.sort_by_cached_key(|&i| (key(i), i));
        let mut repeats = alloc::vec![false; order.len()];
        for run in order.chunk_by(|&i, &j| key(i) == key(j)) {
            for pair in run.windows(2) {
                let [(surface, first), (other, second)] =
                    [pair[0], pair[1]].map(|i| self.names[i as usize]);
                if surface == other {
                    let triangles = [first, second];
                    return Err(TetgenError::Repeated { surface, triangles });
                }
                repeats[pair[1] as usize] = true;
            }
        }
        let mut repeated = repeats.iter();
        self.triangles.retain(|_| repeated.next() == Some(&false));
        let mut repeated = repeats.iter();
        self.names.retain(|_| repeated.next() == Some(&false));
        Ok(())
    }

    /// Puts a box around everything.
    fn enclose(&mut self, margin: f64) -> Result<(), TetgenError> {
        let bounds = Aabb::around(self.positions.iter().copied());
        let reach = margin * bounds.extent().length();
        let grown =
            Aabb { min: bounds.min - Vec3::splat(reach), max: bounds.max + Vec3::splat(reach) };
        let strictly = |k: usize| grown.min[k] < bounds.min[k] && bounds.max[k] < grown.max[k];
        if !(grown.min.is_finite() && grown.max.is_finite() && (0..3).all(strictly)) {
            return Err(TetgenError::BadMargin { margin });
        }
        let cube = procedural::cube();
        let base = self.positions.len() as u32;
        let pick = |k: usize, c: f64| if c < 0.0 { grown.min[k] } else { grown.max[k] };
        let corners = cube.positions.iter().map(|p| vec3(pick(0, p.x), pick(1, p.y), pick(2, p.z)));
        self.positions.extend(corners);
        self.origins.resize(self.positions.len(), TetVertexOrigin::Box);
        self.triangles.extend(cube.triangles.iter().map(|t| t.map(|v| base + v)));
        Ok(())
    }
}
