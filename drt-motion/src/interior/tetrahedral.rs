//! Velocities carried by tetrahedra: linear in each, so that a field has the velocities of the
//! surfaces it was made from, and is continuous (2021 paper, §6.1).
//!
//! In a tetrahedron with velocities v_i at its corners and barycentric weights b_i,
//!
//! ```text
//! u(x) = Σ b_i(x) v_i,   div u = Σ v_i · ∇b_i.
//! ```
//!
//! A surface's own velocity is linear on its triangles. Where these are unions of faces of tetrahedra,
//! the field equals it on the whole surface, however its vertices lie.

use alloc::vec::Vec;

use drt_geom::{Mesh, TetLocator, TetMesh, TetMeshError, TetVertexOrigin, Tetrahedralization};
use drt_math::Vec3;

use crate::surface::VertexGradient;
use crate::volume::{VolumeAdjoint, VolumeJet};
use crate::{SurfaceMotion, SurfacePoint};

/// Tetrahedra that fill a part of space, and what each vertex belongs to; at rest elsewhere.
#[derive(Clone, Debug)]
pub struct TetrahedralField {
    mesh: TetMesh,
    locator: TetLocator,
    origins: Vec<TetVertexOrigin>,
    shared: Vec<(u32, TetVertexOrigin)>,
    /// Vertices that belong to nothing, each with its neighbours that do, sorted.
    between: Vec<(u32, u32)>,
}

/// The velocities at the vertices of a [`TetrahedralField`], for one parameter.
pub type TetVelocities = alloc::sync::Arc<[Vec3]>;

/// What a [`TetrahedralField`] looks like at a point: the same for all parameters.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct TetrahedralPlace {
    corners: [u32; 4],
    weights: [f64; 4],
    gradients: [Vec3; 4],
}

/// Something that moves with velocities of its own, and that vertices lie on.
#[derive(Clone, Copy, Debug)]
pub struct Carrier<'a> {
    /// Its mesh, as moved.
    pub mesh: &'a Mesh,
    /// How it goes on moving.
    pub motion: &'a SurfaceMotion,
}

impl TetrahedralField {
    /// Prepares a field in tetrahedra made from surfaces.
    ///
    /// # Errors
    /// As [`TetLocator::new`].
    pub fn new(made: Tetrahedralization) -> Result<Self, TetMeshError> {
        let Tetrahedralization { mesh, origins, shared } = made;
        let free = |v: u32| matches!(origins[v as usize], TetVertexOrigin::Inside);
        let mut between = Vec::new();
        for tet in &mesh.tets {
            for &a in tet.iter().filter(|a| free(**a)) {
                between.extend(tet.iter().filter(|b| !free(**b)).map(|&b| (a, b)));
            }
        }
        between.sort_unstable();
        between.dedup();
        Ok(Self { locator: TetLocator::new(&mesh)?, mesh, origins, shared, between })
    }

    /// The tetrahedra.
    #[must_use]
    pub fn mesh(&self) -> &TetMesh {
        &self.mesh
    }

    /// Velocities of all vertices: those on surfaces move with these, those at points with the points'
    /// velocities, corners of the enclosing box rest, and others take the mean of their neighbours.
    ///
    /// Where surfaces touch that move differently, a vertex takes the velocity that suits all of them
    /// best: a body that slides along a floor carries the space in the contact along, which keeps the
    /// floor's normal velocity (theory sheet §14.3).
    ///
    /// # Panics
    /// When there are fewer carriers or points than the tetrahedra were made from.
    #[must_use]
    pub fn velocities(&self, carriers: &[Carrier<'_>], points: &[Vec3]) -> TetVelocities {
        let mut velocities = alloc::vec![Vec3::ZERO; self.origins.len()];
        for (v, origin) in velocities.iter_mut().zip(&self.origins) {
            *v = velocity(origin, carriers, points).0;
        }
        for group in self.shared.chunk_by(|a, b| a.0 == b.0) {
            let owners: Vec<_> =
                self.owners(group).map(|o| velocity(o, carriers, points)).collect();
            velocities[group[0].0 as usize] = agreement(&owners);
        }
        for around in self.between.chunk_by(|a, b| a.0 == b.0) {
            let sum = around.iter().fold(Vec3::ZERO, |s, (_, b)| s + velocities[*b as usize]);
            velocities[around[0].0 as usize] = sum * (1.0 / around.len() as f64);
        }
        velocities.into()
    }

    /// The surfaces whose normal velocity a field misses next to a contact with others that move
    /// otherwise, sorted: the flux through them must be added.
    ///
    /// # Panics
    /// As [`velocities`](Self::velocities), whose arguments these are, and result.
    #[must_use]
    pub fn left_behind(&self, velocities: &[Vec3], carriers: &[Carrier<'_>]) -> Vec<u32> {
        // What is missed, with the square of the speed it is measured by: at mesh vertices, and in
        // triangles that a vertex lies on elsewhere.
        let mut at_vertices: Vec<(u32, u32, Vec3, f64)> = Vec::new();
        let mut found = Vec::new();
        for group in self.shared.chunk_by(|a, b| a.0 == b.0) {
            let here = velocities[group[0].0 as usize];
            for owner in self.owners(group) {
                let &TetVertexOrigin::Surface { surface, triangle, bary } = owner else { continue };
                let Carrier { mesh, motion } = carriers[surface as usize];
                let point = SurfacePoint { triangle, bary };
                let own = motion.velocity(mesh, &point);
                let fastest = f64::max(here.length_squared(), own.length_squared());
                let miss = here - own;
                if miss.length_squared() <= ROUNDING * fastest {
                    continue;
                }
                if square(miss.dot(mesh.normal(triangle))) > ROUNDING * fastest {
                    found.push(surface);
                }
                let corners = mesh.triangles[triangle as usize];
                if let Some(k) = point.weights().iter().position(|w| *w == 1.0) {
                    at_vertices.push((surface, corners[k], miss, fastest));
                }
            }
        }
        at_vertices.sort_unstable_by_key(|(surface, vertex, ..)| (*surface, *vertex));
        for of_surface in at_vertices.chunk_by(|a, b| a.0 == b.0) {
            let (surface, mesh) = (of_surface[0].0, carriers[of_surface[0].0 as usize].mesh);
            let misses = |t: usize| {
                mesh.triangles[t].iter().any(|v| {
                    let first = of_surface.partition_point(|m| m.1 < *v);
                    let here = of_surface[first..].iter().take_while(|m| m.1 == *v);
                    let mut here = here.map(|(.., miss, fastest)| (miss, fastest));
                    here.any(|(m, f)| square(m.dot(mesh.normal(t as u32))) > ROUNDING * f)
                })
            };
            if (0..mesh.triangles.len()).any(misses) {
                found.push(surface);
            }
        }
        found.sort_unstable();
        found.dedup();
        found
    }

    /// Where a point lies; outside of all tetrahedra everything rests.
    #[must_use]
    pub fn place(&self, x: Vec3) -> TetrahedralPlace {
        let Some(found) = self.locator.locate(x, None) else { return TetrahedralPlace::default() };
        TetrahedralPlace {
            corners: self.mesh.tets[found.tet as usize],
            weights: found.bary,
            gradients: self.locator.gradients(found.tet),
        }
    }

    /// Pairs of surfaces that share vertices, each with the lower index first, sorted.
    #[must_use]
    pub fn contacts(&self) -> Vec<[u32; 2]> {
        let mut pairs = Vec::new();
        for group in self.shared.chunk_by(|a, b| a.0 == b.0) {
            let surfaces: Vec<u32> = self.owners(group).filter_map(surface_of).collect();
            for (i, a) in surfaces.iter().enumerate() {
                let others = surfaces[i + 1..].iter().filter(|b| *b != a);
                pairs.extend(others.map(|b| [*a.min(b), *a.max(b)]));
            }
        }
        pairs.sort_unstable();
        pairs.dedup();
        pairs
    }

    /// The transpose of [`velocities`](Self::velocities): hands the gradient with respect to the
    /// velocities of all vertices on to the vertices of surfaces and to points; `None` stands for
    /// those at rest.
    ///
    /// Where several touch, a vertex moves with the first that is not at rest. This is linear, as a
    /// gradient must be, and is what [`velocities`](Self::velocities) does too if they move alike.
    /// Surfaces that do not are left behind next to their [contacts](Self::contacts), and the flux
    /// through both surfaces must be added.
    ///
    /// # Panics
    /// When there are fewer entries, surfaces or points than the tetrahedra have.
    pub fn gather(
        &self,
        mut gradient: Vec<Vec3>,
        surfaces: &mut [(&Mesh, Option<&mut VertexGradient>)],
        points: &mut [Option<Vec3>],
    ) {
        for around in self.between.chunk_by(|a, b| a.0 == b.0) {
            let part = gradient[around[0].0 as usize] * (1.0 / around.len() as f64);
            around.iter().for_each(|(_, b)| gradient[*b as usize] += part);
        }
        let mut hand_on = |origin: &TetVertexOrigin, g: Vec3| match *origin {
            TetVertexOrigin::Surface { surface, triangle, bary } => {
                let (mesh, Some(to)) = &mut surfaces[surface as usize] else { return false };
                to.scatter_velocity(mesh, &SurfacePoint { triangle, bary }, g);
                true
            }
            TetVertexOrigin::Point(i) => points[i as usize].as_mut().map(|sum| *sum += g).is_some(),
            TetVertexOrigin::Box | TetVertexOrigin::Inside => false,
        };
        let mut groups = self.shared.chunk_by(|a, b| a.0 == b.0).peekable();
        for ((v, origin), g) in (0..).zip(&self.origins).zip(gradient) {
            let others = groups.next_if(|group| group[0].0 == v).unwrap_or_default();
            let mut owners = core::iter::once(origin).chain(others.iter().map(|(_, o)| o));
            owners.any(|owner| hand_on(owner, g));
        }
    }

    /// All that a vertex lies on which several things share, given its entries.
    fn owners<'a>(
        &'a self,
        group: &'a [(u32, TetVertexOrigin)],
    ) -> impl Iterator<Item = &'a TetVertexOrigin> {
        let first = &self.origins[group[0].0 as usize];
        core::iter::once(first).chain(group.iter().map(|(_, o)| o))
    }
}

fn surface_of(origin: &TetVertexOrigin) -> Option<u32> {
    match origin {
        TetVertexOrigin::Surface { surface, .. } => Some(*surface),
        _ => None,
    }
}

/// The velocity at a vertex by one of the things it belongs to, and the normal of that, if any.
fn velocity(origin: &TetVertexOrigin, carriers: &[Carrier<'_>], points: &[Vec3]) -> (Vec3, Vec3) {
    match *origin {
        TetVertexOrigin::Surface { surface, triangle, bary } => {
            let Carrier { mesh, motion } = carriers[surface as usize];
            let point = SurfacePoint { triangle, bary };
            (motion.velocity(mesh, &point), mesh.normal(triangle))
        }
        TetVertexOrigin::Point(i) => (points[i as usize], Vec3::ZERO),
        TetVertexOrigin::Box | TetVertexOrigin::Inside => (Vec3::ZERO, Vec3::ZERO),
    }
}

fn square(x: f64) -> f64 {
    x * x
}

/// Normals of surfaces that touch agree to rounding of their vertices, single precision included: what
/// is missed for that alone, in units of the greatest speed, squared.
const ROUNDING: f64 = 1e-10;

/// The velocity that misses the others' along their normals least.
fn agreement(owners: &[(Vec3, Vec3)]) -> Vec3 {
    let missed =
        |u: Vec3| -> f64 { owners.iter().map(|(v, n)| square((u - *v).dot(*n))).sum::<f64>() };
    let fastest = owners.iter().map(|(u, _)| u.length_squared()).fold(0.0, f64::max);
    let best = owners.iter().map(|(u, _)| (missed(*u), *u)).reduce(|a, b| {
        let better = if (b.0 - a.0).abs() > ROUNDING * fastest {
            b.0 < a.0
        } else {
            // Of equals, what moves: a body that slides over something at rest.
            b.1.length_squared() > a.1.length_squared()
        };
        if better { b } else { a }
    });
    best.map_or(Vec3::ZERO, |(_, u)| u)
}

impl TetrahedralPlace {
    /// Velocity and divergence by the velocities of one parameter.
    ///
    /// # Panics
    /// When the velocities belong to another field.
    #[inline]
    #[must_use]
    pub fn jet(&self, velocities: &[Vec3]) -> VolumeJet {
        let mut jet = VolumeJet::default();
        for k in 0..4 {
            let v = velocities[self.corners[k] as usize];
            jet.u += v * self.weights[k];
            jet.j_dot += v.dot(self.gradients[k]);
        }
        jet
    }

    /// The transpose of [`jet`](Self::jet): adds to the gradient with respect to the velocities.
    ///
    /// # Panics
    /// As [`jet`](Self::jet).
    #[inline]
    pub fn scatter(&self, adjoint: &VolumeAdjoint, gradient: &mut [Vec3]) {
        for k in 0..4 {
            let g = adjoint.u * self.weights[k] + self.gradients[k] * adjoint.j;
            gradient[self.corners[k] as usize] += g;
        }
    }
}
