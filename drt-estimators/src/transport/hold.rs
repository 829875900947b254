//! How far the vertices of the spatial form hold to the matter they are on.
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
//! with φ = 1 where a curved surface is grazed, and mostly on [lamps and in media that move as a whole](whole). With
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
//! first has the curvature of the surface, with whose normal radiance changes. So only what lies farther
//! than its radius of curvature is held, the farther ones wholly: c - u along the ray is 1 / (n·d) as
//! well, and must not meet a slope of φ there. A glossy surface turns its lobes with its normals, and
//! holds from steeper angles on, as lobes are narrow. Of what the camera sees, where a filter's slope
//! takes the length's place, only what grazes within about a pixel of its outline is held, less towards
//! the borders of the filter's support.

#[cfg(all(test, feature = "std"))]
mod tests;
mod whole;

use alloc::vec::Vec;

use drt_geom::{Aabb, Mesh};
use drt_math::{Real, Vec3};

use whole::Whole;

use super::vertex::{Kind, SurfacePoint, Vertex};
use super::world::World;
use crate::boundary::edges::collect;
use crate::scene::Shape;
use crate::sensitivity::Interest;

/// Cosine below which surfaces begin to hold vertices, over the width of their lobes.
const GRAZING: f64 = 0.5;

/// The same for the camera, per pixel in radii of curvature.
const GRAZING_PIXELS: f64 = 2.0;

/// Angle from which on an edge is a corner of what is flat beside it, no facet of something curved.
const CORNER: f64 = 1.0;

/// Fewer facets make nothing curved.
const FACETS: usize = 16;

/// What holds a vertex at its matter.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Hold {
    /// φ.
    pub(crate) share: f64,
    /// ∇φ by the vertex's place.
    pub(crate) slope: Vec3,
}

/// What a scene holds, and where from.
#[derive(Clone, Debug, Default)]
pub(crate) struct Holds {
    /// Mean curvatures of the shapes, zero where nothing is held.
    bends: Vec<f64>,
    /// Cosines below which rays are held.
    cosines: Vec<f64>,
    /// The same for rays of the camera.
    seen: Vec<f64>,
    /// Those of the shapes that are lamps.
    lamps: Vec<Option<Whole>>,
    /// Those of the media that move as a whole.
    media: Vec<Option<Whole>>,
}

impl Hold {
    /// The product of two shares.
    fn and(self, other: Self) -> Self {
        let slope = self.slope * other.share + other.slope * self.share;
        Self { share: self.share * other.share, slope }
    }
}

impl World {
    /// Lets surfaces hold vertices.
    pub(crate) fn prepare_holds(&mut self, interest: &Interest) {
        let bends = self.bends();
        let camera = &self.camera;
        let cosines: Vec<f64> =
            (0..).map(|s| GRAZING / self.bsdf_of(s).lobe_width()).take(bends.len()).collect();
        let seen = |(s, bend): (usize, &f64)| {
            let center = self.scene.shapes[s].mesh.bounds().center();
            let pixel = camera.pinhole().pixel_size * (center - camera.position()).length();
            f64::min(GRAZING_PIXELS * bend * pixel, GRAZING)
        };
        let seen = bends.iter().enumerate().map(seen).collect();
        let shapes = self.scene.shapes.iter();
        let lamps = shapes.map(|s| s.emitter.map(|_| Whole::new(s.mesh.bounds()))).collect();
        let media = (0..self.scene.media.len())
            .map(|m| if interest.volumes[m] { self.bounds_of(m).map(Whole::new) } else { None })
            .collect();
        self.holds = Holds { bends, cosines, seen, lamps, media };
    }

    /// The box of the surfaces that bound a medium.
    fn bounds_of(&self, medium: usize) -> Option<Aabb> {
        let shapes = self.scene.shapes.iter().filter(|s| bounds(s, medium));
        shapes.map(|s| s.mesh.bounds()).reduce(|a, b| a.union(&b))
    }

    /// True when a shape holds vertices, or bounds a medium that does.
    pub(crate) fn holds_on(&self, shape: u32) -> bool {
        let inside = |(m, whole): (usize, &Option<Whole>)| {
            whole.is_some() && bounds(&self.scene.shapes[shape as usize], m)
        };
        self.holds_in_view_on(shape)
            || self.lamp(shape as usize).is_some()
            || self.holds.media.iter().enumerate().any(inside)
    }

    /// True when it holds what the camera sees of it.
    pub(crate) fn holds_in_view_on(&self, shape: u32) -> bool {
        self.holds.bends.get(shape as usize).is_some_and(|bend| *bend > 0.0)
    }

    fn lamp(&self, shape: usize) -> Option<&Whole> {
        self.holds.lamps.get(shape)?.as_ref()
    }

    /// The mean curvatures of the shapes by their shading normals, or by their edges where they have
    /// none.
    fn bends(&self) -> Vec<f64> {
        let shapes = &self.scene.shapes;
        let mut bends: Vec<f64> = shapes.iter().map(|s| by_normals(&s.mesh)).collect();
        let faceted = |s: usize| shapes[s].mesh.normals.is_none();
        if (0..shapes.len()).any(|s| faceted(s) && shapes[s].mesh.triangles.len() >= FACETS) {
            for edge in collect(self).0 {
                let (turn, length) = edge.turn();
                if faceted(edge.shape as usize) && turn < CORNER {
                    bends[edge.shape as usize] += 0.5 * turn * length;
                }
            }
            for (bend, shape) in
                bends.iter_mut().zip(shapes).filter(|(_, s)| s.mesh.normals.is_none())
            {
                *bend /= f64::max(shape.mesh.surface_area(), f64::MIN_POSITIVE);
            }
        }
        // Lamps hold as a whole, and nothing that the camera sees of them.
        for (bend, _) in bends.iter_mut().zip(shapes).filter(|(_, s)| s.emitter.is_some()) {
            *bend = 0.0;
        }
        bends
    }

    /// What holds a vertex seen along `dir` from a `viewer` at a `distance`.
    pub(crate) fn hold(&self, viewer: &Vertex, vertex: &Vertex, dir: Vec3, distance: f64) -> Hold {
        let s = match &vertex.kind {
            Kind::Surface(s) => s,
            Kind::Volume(_) => {
                let share = vertex.medium.map_or(0.0, |m| self.hold_inside(viewer, m));
                return Hold { share, slope: Vec3::ZERO };
            }
            Kind::Point => return Hold::default(),
        };
        let shape = s.shape as usize;
        if let Some(lamp) = self.lamp(shape) {
            let width = self.lobe_width(viewer);
            return Hold { share: lamp.share_in_lobes(viewer.x, width), slope: Vec3::ZERO };
        }
        let Some(bend) = self.holds.bends.get(shape).filter(|b| **b > 0.0) else {
            return Hold::default();
        };
        let graze = self.graze(s, dir, distance, self.holds.cosines[shape]);
        let q = f64::min(bend * distance, 1.0);
        let (share, slope) = (q * q * (3.0 - 2.0 * q), 6.0 * q * (1.0 - q) * bend);
        graze.and(Hold { share, slope: dir * slope })
    }

    /// The share that all vertices inside of a medium have which a `viewer` sees.
    pub(crate) fn hold_inside(&self, viewer: &Vertex, medium: usize) -> f64 {
        match (&viewer.kind, self.holds.media.get(medium)) {
            // Not for the camera: its pixels would be edges.
            (Kind::Surface(_) | Kind::Volume(_), Some(Some(whole))) => whole.share(viewer.x),
            _ => 0.0,
        }
    }

    /// What holds a vertex that the camera sees, in every pixel.
    pub(crate) fn hold_in_view(&self, vertex: &Vertex) -> Hold {
        let Kind::Surface(s) = &vertex.kind else { return Hold::default() };
        let cosine = self.holds.seen.get(s.shape as usize).copied().unwrap_or(0.0);
        let ray = vertex.x - self.camera.position();
        let distance = ray.length();
        self.graze(s, ray / distance, distance, cosine)
    }

    /// What holds a vertex that the camera sees, in one pixel.
    pub(crate) fn hold_in_pixel(&self, vertex: &Vertex, pixel: [u32; 2]) -> Hold {
        let hold = self.hold_in_view(vertex);
        if hold.share == 0.0 {
            return hold;
        }
        let view = self.camera.view(vertex.x);
        let (share, slope) = self.camera.window(pixel, view.pixel);
        let (slope, _) = self.camera.view_gradient(&view, slope, 0.0);
        hold.and(Hold { share, slope })
    }

    /// Holds what is seen at less than a `cosine`.
    fn graze(&self, s: &SurfacePoint, dir: Vec3, distance: f64, cosine: f64) -> Hold {
        let seen = s.ns.dot(dir);
        if Real::abs(seen) >= cosine {
            return Hold::default();
        }
        let q = seen / cosine;
        let rest = 1.0 - q * q;
        let turn = self.normal_slide(s, dir) + s.ns.reject(dir) / distance;
        Hold { share: rest * rest, slope: turn * (-4.0 * q * rest / cosine) }
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
