//! How much of the material velocity vertices of the spatial form have.
//!
//! A ray at fixed direction d lands on a surface with the velocity (theory sheet §3)
//!
//! ```text
//! c = x_dot + D_dot d,    D_dot = n·(u - x_dot) / (n·d),
//! ```
//!
//! which grows without bounds where it grazes: second moments of what moves with c diverge, however
//! slowly. The velocity field v by which an integral over a surface is differentiated is free, as
//! long as v - u is tangential, u being that of matter. So vertices move by
//!
//! ```text
//! v = (1 - φ) c + φ u,
//! ```
//!
//! with φ = 1 where a curved surface is grazed, and mostly on [lamps and in media that move rigidly](region). With
//! div v = (1-φ) div c + φ div u + ∇φ·(u - c), the derivative of ∫ F dA, F holding the geometric term,
//! scattering and transmittance, becomes
//!
//! ```text
//! ∫ (1-φ) [∂_c F + F div c] + φ [∂_u F + F div u] + F ∇φ·(u - c)  dA,
//! ```
//!
//! the first bracket being the spatial form, the second the material one (2021 paper, Eqs. 23–30). A
//! jump of F at an edge moves relative to v, no more to c: of the two sides each counts by its own v.
//!
//! The second bracket has 1 / (n·d) too, from the geometric term, but over the ray's length where the
//! first has the curvature of the surface, with whose normal radiance changes. So φ rises only beyond
//! its radius of curvature, and is 1 farther away: c - u along the ray is 1 / (n·d) as
//! well, and must not meet a slope of φ there. A glossy surface turns its lobes with its normals, so that φ
//! rises from steeper angles on, as lobes are narrow. Of what the camera sees, where a filter's slope
//! takes the length's place, φ is nonzero only within about a pixel of a silhouette, less towards
//! the borders of the filter's support.

mod region;
#[cfg(all(test, feature = "std"))]
mod tests;

use alloc::vec::Vec;

use core::f64::consts::PI;

use drt_geom::{Aabb, Edge, EdgeClass, Mesh, NONE, Topology};
use drt_math::{Real, Vec3, fm};

use crate::derivative::velocity::blend::region::BlendRegion;

use crate::derivative::sensitivity::ActiveInputs;
use crate::model::scene::Shape;
use crate::sampling::record::CameraRay;
use crate::world::World;
use crate::world::vertex::{Kind, SurfacePoint, Vertex};

/// Cosine of the angle of incidence below which φ > 0, times the width of the surface's lobes in radians.
const GRAZING: f64 = 0.5;

/// The same for the camera, per pixel in radii of curvature.
const GRAZING_PIXELS: f64 = 2.0;

/// Angle from which on an edge is a corner of what is flat beside it, no facet of something curved.
const CORNER: f64 = 1.0;

/// Fewer facets make nothing curved.
const FACETS: usize = 16;

/// Weight of the material velocity in that of a vertex.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Blend {
    /// φ, from 0 to 1.
    pub(crate) weight: f64,
    /// ∇φ by the vertex's place, 1 / scene units.
    pub(crate) gradient: Vec3,
}

/// What decides about φ in a scene.
#[derive(Clone, Debug, Default)]
pub(crate) struct Blends {
    /// Mean curvatures of the shapes, 1 / scene units; zero where φ = 0.
    curvatures: Vec<f64>,
    /// Cosines of the angle of incidence below which φ > 0, by shape.
    cosines: Vec<f64>,
    /// The same for rays of the camera.
    camera_cosines: Vec<f64>,
    /// Of the shapes that are lamps.
    lamps: Vec<Option<BlendRegion>>,
    /// Of the media whose boundary moves by one affine field.
    media: Vec<Option<BlendRegion>>,
}

impl Blend {
    /// The material velocity alone.
    pub(crate) const MATERIAL: Self = Self { weight: 1.0, gradient: Vec3::ZERO };

    /// A weight that is the same all around.
    fn even(weight: f64) -> Self {
        Self { weight, gradient: Vec3::ZERO }
    }

    /// A weight that rises from 0 at the viewer to 1 at the distance 1 / `rise`, of a vertex at a `distance` along the unit
    /// direction `dir`.
    pub(crate) fn of_distance(dir: Vec3, distance: f64, rise: f64) -> Self {
        let q = f64::min(rise * distance, 1.0);
        Self { weight: q * q * (3.0 - 2.0 * q), gradient: dir * (6.0 * q * (1.0 - q) * rise) }
    }

    /// The weight of a point x that a ray of the camera finds, by its place in the pixel: it falls to 0 at the borders of the
    /// filter's support, where what is seen must keep its image point if the filter jumps.
    pub(crate) fn of_window(world: &World, x: Vec3, ray: CameraRay) -> Self {
        let camera = world.camera.at_lens(ray.lens);
        let view = camera.view(x);
        let (weight, slope) = camera.window(ray.pixel, view.pixel);
        let (gradient, _) = camera.view_gradient(&view, slope, 0.0);
        Self { weight, gradient }
    }

    /// The product of two weights.
    pub(crate) fn and(self, other: Self) -> Self {
        let gradient = self.gradient * other.weight + other.gradient * self.weight;
        Self { weight: self.weight * other.weight, gradient }
    }
}

impl Blends {
    /// Of a scene in which what is of interest moves.
    pub(super) fn new(world: &World, active: &ActiveInputs) -> Self {
        let curvatures = curvatures(world);
        let camera = &world.camera;
        let cosines: Vec<f64> = (0..)
            .map(|s| GRAZING / world.bsdf_of(s).lobe_width(None))
            .take(curvatures.len())
            .collect();
        let seen = |(s, curvature): (usize, &f64)| {
            let center = world.scene.shapes[s].mesh.bounds().center();
            f64::min(GRAZING_PIXELS * curvature * camera.pixel_width_at(center), GRAZING)
        };
        let camera_cosines = curvatures.iter().enumerate().map(seen).collect();
        let shapes = world.scene.shapes.iter();
        let lamps = shapes.map(|s| s.emitter.map(|_| BlendRegion::new(s.mesh.bounds()))).collect();
        let media =
            (0..world.scene.media.len())
                .map(|m| {
                    if active.volumes[m] { bounds_of(world, m).map(BlendRegion::new) } else { None }
                })
                .collect();
        Self { curvatures, cosines, camera_cosines, lamps, media }
    }

    /// Gives all vertices inside of media no weight.
    pub(crate) fn leave_media(&mut self) {
        self.media.fill_with(|| None);
    }

    /// True when φ > 0 for some vertices on a shape, or in a medium that it bounds.
    pub(crate) fn acts_on(&self, world: &World, shape: u32) -> bool {
        let inside = |(m, region): (usize, &Option<BlendRegion>)| {
            region.is_some() && bounds(&world.scene.shapes[shape as usize], m)
        };
        self.acts_in_view_on(shape)
            || self.lamp(shape as usize).is_some()
            || self.media.iter().enumerate().any(inside)
    }

    /// True when φ > 0 for some vertices on it that the camera sees.
    pub(crate) fn acts_in_view_on(&self, shape: u32) -> bool {
        self.curvature(shape) > 0.0
    }

    /// Mean curvature of a shape, 1 / scene units; zero where φ is, on lamps, and on what is flat.
    pub(crate) fn curvature(&self, shape: u32) -> f64 {
        self.curvatures.get(shape as usize).copied().unwrap_or(0.0)
    }

    fn lamp(&self, shape: usize) -> Option<&BlendRegion> {
        self.lamps.get(shape)?.as_ref()
    }

    /// φ of a vertex seen along the unit direction `dir` from a `viewer` at a `distance`.
    pub(crate) fn of(
        &self,
        world: &World,
        viewer: &Vertex,
        vertex: &Vertex,
        dir: Vec3,
        distance: f64,
    ) -> Blend {
        let s = match &vertex.kind {
            Kind::Surface(s) => s,
            Kind::Volume(_) => {
                return Blend::even(vertex.medium.map_or(0.0, |m| self.inside(viewer, m)));
            }
            Kind::Point => return Blend::default(),
        };
        let shape = s.shape as usize;
        if let Some(lamp) = self.lamp(shape) {
            let width = world.lobe_width(viewer);
            return Blend::even(lamp.weight_in_lobes(viewer.x, width));
        }
        let Some(curvature) = self.curvatures.get(shape).filter(|c| **c > 0.0) else {
            return Blend::default();
        };
        let graze = graze(world, s, dir, distance, self.cosines[shape]);
        graze.and(Blend::of_distance(dir, distance, *curvature))
    }

    /// φ of all vertices inside of a medium which a `viewer` sees.
    pub(crate) fn inside(&self, viewer: &Vertex, medium: usize) -> f64 {
        match (&viewer.kind, self.media.get(medium)) {
            // Not for the camera: its pixels would be edges.
            (Kind::Surface(_) | Kind::Volume(_), Some(Some(region))) => region.weight(viewer.x),
            _ => 0.0,
        }
    }

    /// Cosine of the angle of incidence below which φ > 0 for some vertices on a shape that the camera sees; 0 where there are none.
    pub(crate) fn cosine_in_view(&self, shape: u32) -> f64 {
        self.camera_cosines.get(shape as usize).copied().unwrap_or(0.0)
    }

    /// φ of a vertex that the camera sees along the unit direction `dir` at a `distance`, but for the part that depends on
    /// the pixel.
    pub(crate) fn in_view(
        &self,
        world: &World,
        vertex: &Vertex,
        dir: Vec3,
        distance: f64,
    ) -> Blend {
        let Kind::Surface(s) = &vertex.kind else { return Blend::default() };
        let cosine = self.cosine_in_view(s.shape);
        let is_far = world.camera.viewpoint().is_at_infinity();
        let apart = if is_far { f64::INFINITY } else { distance };
        graze(world, s, dir, apart, cosine)
    }

    /// φ of a vertex that a ray of the camera finds along the unit direction `dir` at a `distance`.
    pub(crate) fn in_pixel(
        &self,
        world: &World,
        vertex: &Vertex,
        dir: Vec3,
        distance: f64,
        ray: CameraRay,
    ) -> Blend {
        let blend = self.in_view(world, vertex, dir, distance);
        if blend.weight == 0.0 {
            return blend;
        }
        blend.and(Blend::of_window(world, vertex.x, ray))
    }
}

/// The box of the surfaces that bound a medium.
fn bounds_of(world: &World, medium: usize) -> Option<Aabb> {
    let shapes = world.scene.shapes.iter().filter(|s| bounds(s, medium));
    shapes.map(|s| s.mesh.bounds()).reduce(|a, b| a.union(&b))
}

/// The mean curvatures of the shapes by their shading normals, or by their edges where they have
/// none; 1 / scene units.
fn curvatures(world: &World) -> Vec<f64> {
    let curvature_of = |(s, shape): (u32, &Shape)| {
        // Lamps have a φ of their own, which is 0 for what the camera sees of them.
        if shape.emitter.is_some() { 0.0 } else { curvature(world, s) }
    };
    (0..).zip(&world.scene.shapes).map(curvature_of).collect()
}

/// The mean curvature of a shape, 1 / scene units; zero of null interfaces without normals.
pub(crate) fn curvature(world: &World, shape: u32) -> f64 {
    let mesh = &world.scene.shapes[shape as usize].mesh;
    match &mesh.normals {
        Some(_) => by_normals(mesh),
        None if world.is_null(shape) => 0.0,
        None => by_edges(mesh),
    }
}

/// The part of φ by the angle of incidence: from 0 at a `cosine` to 1.
fn graze(world: &World, s: &SurfacePoint, dir: Vec3, distance: f64, cosine: f64) -> Blend {
    let seen = s.ns.dot(dir);
    if Real::abs(seen) >= cosine {
        return Blend::default();
    }
    let q = seen / cosine;
    let rest = 1.0 - q * q;
    let turn = world.normal_slide(s, dir) + s.ns.reject(dir) / distance;
    Blend { weight: rest * rest, gradient: turn * (-4.0 * q * rest / cosine) }
}

fn bounds(shape: &Shape, medium: usize) -> bool {
    shape.boundary.is_some_and(|b| [b.interior, b.exterior].contains(&Some(medium)))
}

/// The mean curvature of a mesh by its shading normals; zero without them.
fn by_normals(mesh: &Mesh) -> f64 {
    let Some(normals) = &mesh.normals else { return 0.0 };
    let (mut turns, mut area) = (0.0, 0.0);
    for (t, corners) in (0..).zip(&mesh.triangles) {
        let [a, b, c] = mesh.triangle(t);
        let [i, j, k] = corners.map(|v| normals[v as usize]);
        let own = (b - a).cross(c - a).length();
        let (turn, along) = (
            (j - i).length() + (k - j).length() + (i - k).length(),
            (b - a).length() + (c - b).length() + (a - c).length(),
        );
        if own > 0.0 {
            turns += own * turn / along;
            area += own;
        }
    }
    if area > 0.0 { turns / area } else { 0.0 }
}

/// The mean curvature of a mesh by the angles at its edges; zero with few facets.
fn by_edges(mesh: &Mesh) -> f64 {
    if mesh.triangles.len() < FACETS {
        return 0.0;
    }
    let turn = |e: &Edge| {
        let [a, b] = e.vertices.map(|v| mesh.positions[v as usize]);
        let along = (b - a).normalize();
        let [f, g] = e.opposite.map(|v| (mesh.positions[v as usize] - a).reject(along));
        let turn = PI - fm::atan2(f.cross(g).length(), f.dot(g));
        if turn < CORNER { 0.5 * turn * (b - a).length() } else { 0.0 }
    };
    let topology = Topology::of(mesh);
    let bent =
        |e: &&Edge| e.faces[1] != NONE && e.class != EdgeClass::Flat && e.can_be_silhouette();
    let sum: f64 = topology.edges.iter().filter(bent).map(turn).filter(|t| t.is_finite()).sum();
    sum / f64::max(mesh.surface_area(), f64::MIN_POSITIVE)
}
