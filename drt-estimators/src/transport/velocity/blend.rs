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
//! with φ = 1 where a curved surface is grazed, and mostly on [lamps and in media that move rigidly](whole). With
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
//! takes the length's place, φ is nonzero only within about a pixel of an outline, less towards
//! the borders of the filter's support.

#[cfg(all(test, feature = "std"))]
mod tests;
mod whole;

use alloc::vec::Vec;

use drt_geom::{Aabb, Mesh};
use drt_math::{Real, Vec3};

use whole::Whole;

use crate::boundary::edges::collect;
use crate::scene::Shape;
use crate::sensitivity::Interest;
use crate::transport::vertex::{Kind, SurfacePoint, Vertex};
use crate::transport::world::World;

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
    lamps: Vec<Option<Whole>>,
    /// Of the media whose boundary moves by one affine field.
    media: Vec<Option<Whole>>,
}

impl Blend {
    /// The material velocity alone.
    pub(crate) const MATERIAL: Self = Self { weight: 1.0, gradient: Vec3::ZERO };

    /// A weight that is the same all around.
    fn even(weight: f64) -> Self {
        Self { weight, gradient: Vec3::ZERO }
    }

    /// The product of two weights.
    fn and(self, other: Self) -> Self {
        let gradient = self.gradient * other.weight + other.gradient * self.weight;
        Self { weight: self.weight * other.weight, gradient }
    }
}

impl World {
    /// Prepares φ.
    pub(crate) fn prepare_blends(&mut self, interest: &Interest) {
        let curvatures = self.curvatures();
        let camera = &self.camera;
        let cosines: Vec<f64> =
            (0..).map(|s| GRAZING / self.bsdf_of(s).lobe_width()).take(curvatures.len()).collect();
        let seen = |(s, curvature): (usize, &f64)| {
            let center = self.scene.shapes[s].mesh.bounds().center();
            let pixel = camera.pinhole().pixel_size * (center - camera.position()).length();
            f64::min(GRAZING_PIXELS * curvature * pixel, GRAZING)
        };
        let camera_cosines = curvatures.iter().enumerate().map(seen).collect();
        let shapes = self.scene.shapes.iter();
        let lamps = shapes.map(|s| s.emitter.map(|_| Whole::new(s.mesh.bounds()))).collect();
        let media = (0..self.scene.media.len())
            .map(|m| if interest.volumes[m] { self.bounds_of(m).map(Whole::new) } else { None })
            .collect();
        self.blends = Blends { curvatures, cosines, camera_cosines, lamps, media };
    }

    /// The box of the surfaces that bound a medium.
    fn bounds_of(&self, medium: usize) -> Option<Aabb> {
        let shapes = self.scene.shapes.iter().filter(|s| bounds(s, medium));
        shapes.map(|s| s.mesh.bounds()).reduce(|a, b| a.union(&b))
    }

    /// True when φ > 0 for some vertices on a shape, or in a medium that it bounds.
    pub(crate) fn blends_on(&self, shape: u32) -> bool {
        let inside = |(m, whole): (usize, &Option<Whole>)| {
            whole.is_some() && bounds(&self.scene.shapes[shape as usize], m)
        };
        self.blends_in_view_on(shape)
            || self.lamp(shape as usize).is_some()
            || self.blends.media.iter().enumerate().any(inside)
    }

    /// True when φ > 0 for some vertices on it that the camera sees.
    pub(crate) fn blends_in_view_on(&self, shape: u32) -> bool {
        self.blends.curvatures.get(shape as usize).is_some_and(|c| *c > 0.0)
    }

    fn lamp(&self, shape: usize) -> Option<&Whole> {
        self.blends.lamps.get(shape)?.as_ref()
    }

    /// The mean curvatures of the shapes by their shading normals, or by their edges where they have
    /// none; 1 / scene units.
    fn curvatures(&self) -> Vec<f64> {
        let shapes = &self.scene.shapes;
        let mut curvatures: Vec<f64> = shapes.iter().map(|s| by_normals(&s.mesh)).collect();
        let faceted = |s: usize| shapes[s].mesh.normals.is_none();
        if (0..shapes.len()).any(|s| faceted(s) && shapes[s].mesh.triangles.len() >= FACETS) {
            for edge in collect(self).0 {
                let (turn, length) = edge.turn();
                if faceted(edge.shape as usize) && turn < CORNER {
                    curvatures[edge.shape as usize] += 0.5 * turn * length;
                }
            }
            for (curvature, shape) in
                curvatures.iter_mut().zip(shapes).filter(|(_, s)| s.mesh.normals.is_none())
            {
                *curvature /= f64::max(shape.mesh.surface_area(), f64::MIN_POSITIVE);
            }
        }
        // Lamps have a φ of their own, which is 0 for what the camera sees of them.
        for (curvature, _) in curvatures.iter_mut().zip(shapes).filter(|(_, s)| s.emitter.is_some())
        {
            *curvature = 0.0;
        }
        curvatures
    }

    /// φ of a vertex seen along the unit direction `dir` from a `viewer` at a `distance`.
    pub(crate) fn blend(
        &self,
        viewer: &Vertex,
        vertex: &Vertex,
        dir: Vec3,
        distance: f64,
    ) -> Blend {
        let s = match &vertex.kind {
            Kind::Surface(s) => s,
            Kind::Volume(_) => {
                return Blend::even(vertex.medium.map_or(0.0, |m| self.blend_inside(viewer, m)));
            }
            Kind::Point => return Blend::default(),
        };
        let shape = s.shape as usize;
        if let Some(lamp) = self.lamp(shape) {
            let width = self.lobe_width(viewer);
            return Blend::even(lamp.weight_in_lobes(viewer.x, width));
        }
        let Some(curvature) = self.blends.curvatures.get(shape).filter(|c| **c > 0.0) else {
            return Blend::default();
        };
        let graze = self.graze(s, dir, distance, self.blends.cosines[shape]);
        let q = f64::min(curvature * distance, 1.0);
        let (weight, slope) = (q * q * (3.0 - 2.0 * q), 6.0 * q * (1.0 - q) * curvature);
        graze.and(Blend { weight, gradient: dir * slope })
    }

    /// φ of all vertices inside of a medium which a `viewer` sees.
    pub(crate) fn blend_inside(&self, viewer: &Vertex, medium: usize) -> f64 {
        match (&viewer.kind, self.blends.media.get(medium)) {
            // Not for the camera: its pixels would be edges.
            (Kind::Surface(_) | Kind::Volume(_), Some(Some(whole))) => whole.weight(viewer.x),
            _ => 0.0,
        }
    }

    /// φ of a vertex that the camera sees, but for the part that depends on the pixel.
    pub(crate) fn blend_in_view(&self, vertex: &Vertex) -> Blend {
        let Kind::Surface(s) = &vertex.kind else { return Blend::default() };
        let cosine = self.blends.camera_cosines.get(s.shape as usize).copied().unwrap_or(0.0);
        let ray = vertex.x - self.camera.position();
        let distance = ray.length();
        self.graze(s, ray / distance, distance, cosine)
    }

    /// φ of a vertex that the camera sees in one pixel.
    pub(crate) fn blend_in_pixel(&self, vertex: &Vertex, pixel: [u32; 2]) -> Blend {
        let blend = self.blend_in_view(vertex);
        if blend.weight == 0.0 {
            return blend;
        }
        let view = self.camera.view(vertex.x);
        let (weight, slope) = self.camera.window(pixel, view.pixel);
        let (gradient, _) = self.camera.view_gradient(&view, slope, 0.0);
        blend.and(Blend { weight, gradient })
    }

    /// Blends what is seen at less than a `cosine`.
    fn graze(&self, s: &SurfacePoint, dir: Vec3, distance: f64, cosine: f64) -> Blend {
        let seen = s.ns.dot(dir);
        if Real::abs(seen) >= cosine {
            return Blend::default();
        }
        let q = seen / cosine;
        let rest = 1.0 - q * q;
        let turn = self.normal_slide(s, dir) + s.ns.reject(dir) / distance;
        Blend { weight: rest * rest, gradient: turn * (-4.0 * q * rest / cosine) }
    }
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
