//! The input with equal positions, edges and triangles merged.

use alloc::collections::BTreeMap;
use alloc::vec::Vec;

use drt_math::Vec3;

use super::faces::sorted;
use super::predicates::projected_areas;
use super::{SurfaceTriangle, TetrahedralizeError, TetrahedralizeInput};
use crate::{Aabb, NONE, weld};

/// A place on a surface triangle at which a vertex of the complex may lie.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Carrier {
    /// Index among all triangles of all surfaces.
    pub(super) triangle: u32,
    pub(super) part: Part,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Part {
    Corner(usize),
    /// From this corner to the next.
    Edge(usize),
    Inside,
}

/// A triangle of the input.
#[derive(Clone, Copy, Debug)]
pub(super) struct Named {
    pub(super) name: SurfaceTriangle,
    /// Its corners in the complex; all [`NONE`] when it has no area.
    pub(super) corners: [u32; 3],
}

/// Surfaces as vertices, edges and triangles of one complex.
///
/// The vertices are numbered from [`FIRST`].
#[derive(Debug, Default)]
pub(super) struct Merged {
    /// Multiplied with the input's coordinates: a power of two that brings the largest near one.
    pub(super) scale: f64,
    pub(super) positions: Vec<Vec3>,
    /// The triangle corners at each position, one for each surface vertex there.
    pub(super) owners: Vec<Vec<Carrier>>,
    /// The vertex of each point of the input.
    pub(super) points: Vec<u32>,
    /// Edges by their two vertices, the lower first; one carrier for each pair of surface vertices.
    pub(super) edges: BTreeMap<[u32; 2], Vec<Carrier>>,
    /// Distinct triangles that have an area, and the input's triangles that each stands for.
    pub(super) triangles: Vec<([u32; 3], Vec<Carrier>)>,
    pub(super) named: Vec<Named>,
}

/// Vertices before this one are the corners of the box.
pub(super) const FIRST: u32 = 8;

pub(super) fn edge_key(a: u32, b: u32) -> [u32; 2] {
    if a < b { [a, b] } else { [b, a] }
}

impl Merged {
    pub(super) fn new(input: &TetrahedralizeInput<'_>) -> Result<Self, TetrahedralizeError> {
        let all = checked(input)?;
        let largest = all.iter().fold(0.0, |m, p| f64::max(m, p.max_abs()));
        let mut merged = Self { scale: power_of_two_over(largest), ..Self::default() };
        let mut places = Places { equal: weld(&all), vertex: alloc::vec![NONE; all.len()] };
        let mut base = 0;
        for (surface, mesh) in (0..).zip(input.surfaces) {
            let mut noted = alloc::vec![false; mesh.positions.len()];
            for (triangle, indices) in (0..).zip(&mesh.triangles) {
                let id = merged.named.len() as u32;
                let at = mesh.triangle(triangle).map(|p| p * merged.scale);
                let mut corners = [NONE; 3];
                if projected_areas(at) != [0.0; 3] {
                    corners = [0, 1, 2].map(|k| {
                        let v = merged.vertex(&mut places, base + indices[k] as usize, at[k]);
                        if !core::mem::replace(&mut noted[indices[k] as usize], true) {
                            let corner = Carrier { triangle: id, part: Part::Corner(k) };
                            merged.owners[(v - FIRST) as usize].push(corner);
                        }
                        v
                    });
                    let whole = Carrier { triangle: id, part: Part::Inside };
                    merged.triangles.push((corners, alloc::vec![whole]));
                }
                merged.named.push(Named { name: SurfaceTriangle { surface, triangle }, corners });
            }
            base += mesh.positions.len();
        }
        for (i, &p) in input.points.iter().enumerate() {
            let v = merged.vertex(&mut places, base + i, p * merged.scale);
            merged.points.push(v);
        }
        merged.merge_triangles();
        merged.note_edges(input);
        Ok(merged)
    }

    fn vertex(&mut self, places: &mut Places, index: usize, at: Vec3) -> u32 {
        let vertex = &mut places.vertex[places.equal[index] as usize];
        if *vertex == NONE {
            *vertex = self.positions.len() as u32 + FIRST;
            self.positions.push(at);
            self.owners.push(Vec::new());
        }
        *vertex
    }

    fn merge_triangles(&mut self) {
        self.triangles.sort_by_cached_key(|(t, c)| (sorted(*t), c[0].triangle));
        self.triangles.dedup_by(|next, kept| {
            let same = sorted(next.0) == sorted(kept.0);
            if same {
                kept.1.append(&mut next.1);
            }
            same
        });
        // What follows in the input is mostly near in space.
        self.triangles.sort_by_key(|(_, c)| c[0].triangle);
    }

    fn note_edges(&mut self, input: &TetrahedralizeInput<'_>) {
        let named = &self.named;
        let own = |triangle: u32, k: usize| {
            let SurfaceTriangle { surface, triangle } = named[triangle as usize].name;
            let t = input.surfaces[surface as usize].triangles[triangle as usize];
            (surface, edge_key(t[k], t[(k + 1) % 3]))
        };
        for carrier in self.triangles.iter().flat_map(|(_, carriers)| carriers) {
            let corners = named[carrier.triangle as usize].corners;
            for k in 0..3 {
                let edge =
                    self.edges.entry(edge_key(corners[k], corners[(k + 1) % 3])).or_default();
                let this = own(carrier.triangle, k);
                let is_this =
                    |c: &Carrier| matches!(c.part, Part::Edge(k) if own(c.triangle, k) == this);
                if !edge.iter().any(is_this) {
                    edge.push(Carrier { triangle: carrier.triangle, part: Part::Edge(k) });
                }
            }
        }
    }

    /// The bounds grown by a fraction of their diagonal, and never by nothing.
    pub(super) fn enclosing_box(&self, margin: f64) -> Aabb {
        let bounds = Aabb::around(self.positions.iter().copied());
        if bounds.is_empty() {
            return Aabb { min: Vec3::splat(-1.0), max: Vec3::splat(1.0) };
        }
        let diagonal = bounds.extent().length();
        let size = if diagonal > 0.0 { diagonal } else { 1.0 };
        let largest = f64::max(bounds.min.max_abs(), bounds.max.max_abs());
        let grow = Vec3::splat(f64::max(margin * size, largest * LEAST_MARGIN));
        Aabb { min: bounds.min - grow, max: bounds.max + grow }
    }
}

/// Of the largest coordinate: far above rounding.
const LEAST_MARGIN: f64 = 1e-12;

/// Which position of the input is which vertex.
struct Places {
    /// The first position equal to each.
    equal: Vec<u32>,
    /// The vertex of each first position.
    vertex: Vec<u32>,
}

fn checked(input: &TetrahedralizeInput<'_>) -> Result<Vec<Vec3>, TetrahedralizeError> {
    if !(input.margin > 0.0 && input.margin.is_finite()) {
        return Err(TetrahedralizeError::BadMargin { margin: input.margin });
    }
    let mut all = Vec::new();
    for (surface, mesh) in input.surfaces.iter().enumerate() {
        if let Some(vertex) = mesh.positions.iter().position(|p| !p.is_finite()) {
            return Err(TetrahedralizeError::NonFinitePosition { surface, vertex });
        }
        let count = mesh.positions.len();
        let outside = |t: &[u32; 3]| t.iter().any(|&v| v as usize >= count);
        if let Some(triangle) = mesh.triangles.iter().position(outside) {
            return Err(TetrahedralizeError::IndexOutOfRange { surface, triangle });
        }
        all.extend_from_slice(&mesh.positions);
    }
    if let Some(point) = input.points.iter().position(|p| !p.is_finite()) {
        return Err(TetrahedralizeError::NonFinitePoint { point });
    }
    all.extend_from_slice(input.points);
    if all.len() >= (NONE / 2) as usize {
        return Err(TetrahedralizeError::TooLarge { count: all.len() });
    }
    Ok(all)
}

/// Brings coordinates near one without rounding them, so that products of five stay in range.
fn power_of_two_over(largest: f64) -> f64 {
    if largest == 0.0 {
        return 1.0;
    }
    let exponent = (largest.to_bits() >> 52) as i64 - 1023;
    f64::from_bits(((1023 - exponent.clamp(-1000, 1000)) as u64) << 52)
}
