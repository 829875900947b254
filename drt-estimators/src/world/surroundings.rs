//! The media around points: on the sides of surfaces, and around cameras and emitters.

use alloc::vec::Vec;

use drt_geom::{Aabb, Hit, Skip};
use drt_math::{Ray, Rgb, Vec3};

use crate::model::scene::Surrounding;
use crate::world::vertex::{Contact, Kind, SurfacePoint, Vertex};
use crate::world::{Tracking, World};

/// The medium around something; `None` is vacuum.
#[derive(Clone, Copy, Debug)]
pub(crate) enum SurroundingMedium {
    /// The same everywhere around it.
    Uniform(Option<usize>),
    /// Different at different points.
    Varies,
}

impl SurroundingMedium {
    /// At a point.
    pub(crate) fn at(self, world: &World, x: Vec3) -> Option<usize> {
        match self {
            Self::Uniform(medium) => medium,
            Self::Varies => world.medium_at(x),
        }
    }

    /// At a point that may lie on an interface, where a ray starts along the unit direction `dir`.
    pub(crate) fn toward(self, world: &World, x: Vec3, dir: Vec3) -> Option<usize> {
        match self {
            Self::Uniform(medium) => medium,
            Self::Varies => world.medium_along(x, dir),
        }
    }
}

impl World {
    /// Finds the medium beyond all interfaces and the one around the camera.
    pub(super) fn settle_media(&mut self, camera: Surrounding) {
        let eye = self.camera.position();
        self.camera_medium = match camera {
            Surrounding::Stated(m) => {
                if self.first_boundary(eye, askew()).is_none() {
                    self.ambient = m;
                }
                m
            }
            Surrounding::Counted => self.medium_at(eye),
        };
        let is_counted = matches!(camera, Surrounding::Counted);
        self.film_medium = match self.camera.around_origins().filter(|_| is_counted) {
            Some(around) => self.medium_near(&Aabb::around(around)),
            None => SurroundingMedium::Uniform(self.camera_medium),
        };
        self.settle_lights();
    }

    /// Finds the lights inside of media.
    pub(super) fn settle_lights(&mut self) {
        let mut lights = core::mem::take(&mut self.lights);
        lights.keep_inside(|e, x| {
            self.medium_of_emitter(e, x).is_some_and(|m| self.tracking[m] == Tracking::Vertices)
        });
        self.lights = lights;
    }

    /// The medium around an emitter at `x`.
    pub(crate) fn medium_of_emitter(&self, emitter: usize, x: Vec3) -> Option<usize> {
        match self.scene.emitters[emitter].item.medium {
            Surrounding::Stated(m) => m,
            Surrounding::Counted => self.medium_at(x),
        }
    }

    /// The medium on one side of a surface; `through` is the medium of surfaces that separate none.
    pub(crate) fn medium_on_side(
        &self,
        s: &SurfacePoint,
        front: bool,
        through: Option<usize>,
    ) -> Option<usize> {
        match self.scene.shapes[s.shape as usize].boundary {
            Some(b) if front => b.exterior,
            Some(b) => b.interior,
            None => through,
        }
    }

    /// The medium a ray leaving `v` along `dir` starts in.
    pub(crate) fn medium_toward(&self, v: &Vertex, dir: Vec3) -> Option<usize> {
        match &v.kind {
            Kind::Surface(s) => self.medium_on_side(s, s.ng.dot(dir) > 0.0, v.medium),
            _ => v.medium,
        }
    }

    /// The side of the first surface that bounds media from `x` on along `dir`; of several that coincide, of one that a ray leaves.
    fn first_boundary(&self, x: Vec3, dir: Vec3) -> Option<(SurfacePoint, bool)> {
        let ray = Ray { origin: x, dir, t_max: f64::INFINITY };
        let bounds = |prim: u32| {
            let shape = self.geometry.prim(prim).shape as usize;
            self.scene.shapes[shape].boundary.is_some()
        };
        let bvh = &self.geometry.bvh;
        let mut hits = Vec::new();
        let first = bvh.closest_through(&ray, Skip::NOTHING, bounds, &mut hits)?;
        let side = |hit: &Hit| {
            let (point, _) = self.point(hit.prim, hit.bary);
            (point, point.ng.dot(dir) < 0.0)
        };
        // Up to a little beyond it.
        let ray = Ray { t_max: first.t * (1.0 + 1e-5), ..ray };
        bvh.crossings(&ray, Skip::NOTHING, |_| false, &mut hits);
        let coincides = |hit: &&Hit| bounds(hit.prim) && self.coincide(&ray, &first, hit);
        let left = hits.iter().filter(coincides).map(side).find(|(_, front)| !front);
        Some(left.unwrap_or_else(|| side(&first)))
    }

    /// The medium around a point off all surfaces: that on the near side of the first interface
    /// met on the way to infinity.
    pub(crate) fn medium_at(&self, x: Vec3) -> Option<usize> {
        self.medium_along(x, askew())
    }

    /// The medium in which a ray from `x` along the unit direction `dir` starts. The point may lie on an interface, but on no
    /// other surface that bounds media.
    fn medium_along(&self, x: Vec3, dir: Vec3) -> Option<usize> {
        if !self.has_media() {
            return None;
        }
        match self.first_boundary(x, dir) {
            Some((point, front)) => self.medium_on_side(&point, front, None),
            None => self.ambient,
        }
    }

    /// The medium outside of everything.
    pub(crate) fn ambient(&self) -> Option<usize> {
        self.ambient
    }

    /// The medium around a shape that bounds none itself: the same everywhere where no interface comes near it.
    pub(crate) fn medium_around(&self, shape: usize) -> SurroundingMedium {
        self.medium_near(&self.scene.world_bounds(shape))
    }

    /// The medium of all points of a box that are off shapes, if no interface comes near it.
    pub(crate) fn medium_near(&self, bounds: &Aabb) -> SurroundingMedium {
        if !self.has_media() {
            return SurroundingMedium::Uniform(None);
        }
        let near = |shape: usize| {
            let mut triangles = self.scene.world_triangles(shape);
            self.scene.world_bounds(shape).meets(bounds)
                && triangles.any(|t| Aabb::around(t).meets(bounds))
        };
        let mut shapes = 0..self.scene.shapes.len();
        if shapes.any(|s| self.scene.shapes[s].boundary.is_some() && near(s)) {
            SurroundingMedium::Varies
        } else {
            SurroundingMedium::Uniform(self.medium_at(bounds.center()))
        }
    }

    /// How far inside a medium its values at its own border are taken: a grid ends at its box, on
    /// which surfaces and their rounded points lie.
    fn border(&self, medium: usize) -> f64 {
        self.medium(medium).grid().map_or(0.0, |g| 2e-9 * g.density().world_extent().max_abs())
    }

    /// The extinction at a point of an interface, along the unit vector `towards` on the side that it points to.
    pub(crate) fn sigma_t_at_border(&self, medium: Option<usize>, x: Vec3, towards: Vec3) -> Rgb {
        let Some(m) = medium else { return Rgb::ZERO };
        self.medium(m).sigma_t_along(x + towards * self.border(m), towards)
    }

    /// A volume vertex touching a surface on one side.
    pub(crate) fn touching(
        &self,
        point: SurfacePoint,
        x: Vec3,
        front: bool,
        medium: usize,
    ) -> Vertex {
        let contact = Contact { point, front };
        let x = x + point.ng * (self.border(medium) * if front { 1.0 } else { -1.0 });
        Vertex { x, medium: Some(medium), kind: Kind::Volume(Some(contact)) }
    }

    /// A volume vertex at a face of a grid's box with the outward normal `n`, where the grid still is.
    pub(crate) fn inside_grid(&self, medium: usize, x: Vec3, n: Vec3) -> Vertex {
        let x = x - n * self.border(medium);
        Vertex { x, medium: Some(medium), kind: Kind::Volume(None) }
    }

    /// The camera as a vertex, where a ray starts.
    pub(crate) fn eye_at(&self, x: Vec3) -> Vertex {
        Vertex { x, medium: self.film_medium.at(self, x), kind: Kind::Point }
    }

    /// The camera as a vertex, where it sees the point x from.
    pub(crate) fn eye_of(&self, x: Vec3) -> Vertex {
        self.eye_at(self.camera.eye_of(x))
    }
}

/// A unit direction that avoids edges and faces along axes, to look for interfaces in where any direction serves.
fn askew() -> Vec3 {
    drt_math::vec3(0.577_215_66, 0.414_213_56, 0.703_818_4).normalize()
}
