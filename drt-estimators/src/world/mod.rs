//! A scene prepared for ray queries: the triangles of all shapes in one BVH, and the media on both sides of each.

mod activity;
pub(crate) mod cache;
mod crossings;
mod geometry;
pub(crate) mod lights;
mod points;
pub(crate) mod rays;
pub(crate) mod scatter;
mod surroundings;
pub(crate) mod vertex;

use alloc::string::String;
use alloc::sync::Arc;
use alloc::vec::Vec;

use drt_geom::Aabb;
use drt_math::{Rgb, Vec3};
use drt_medium::{Coefficients, Homogeneous, Medium};

use crate::model::emitter::Emitter;
use crate::model::error::Error;
use crate::model::scene::{Scene, Shape};
use crate::model::surface::Bsdf;
pub(crate) use crate::world::activity::{ActiveFactors, MediumActivity};
use crate::world::cache::PreparedCache;
pub(crate) use crate::world::crossings::{Crossing, Interval, RayPath, intervals};
use crate::world::geometry::Geometry;
use crate::world::lights::{EmitterMask, LightTable};
pub(crate) use crate::world::rays::short_of;
use crate::world::scatter::Scattering;
pub(crate) use crate::world::surroundings::SurroundingMedium;
use crate::world::vertex::{Kind, SurfacePoint, Vertex};

/// What tracking may skip in a medium.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Tracking {
    /// Vertices are sampled inside.
    Vertices,
    /// It only absorbs: segments are attenuated, no vertex is sampled.
    Attenuation,
}

/// A scene prepared for light transport.
#[derive(Clone)]
pub(crate) struct World {
    pub(crate) scene: Arc<Scene>,
    pub(crate) lights: LightTable,
    pub(crate) lit: EmitterMask,
    /// The sensor in use and the medium around it.
    pub(crate) camera: crate::model::sensor::Sensor,
    pub(crate) camera_medium: Option<usize>,
    /// That around the film or the lens, where rays of an orthographic camera, or one with an aperture, start.
    pub(crate) film_medium: SurroundingMedium,
    pub(crate) tracking: Vec<Tracking>,
    /// Least probability of a scattering vertex per tentative collision, per medium: nonzero
    /// where derivatives need vertices in empty or thin space.
    pub(crate) defensive: Vec<f64>,
    /// The extinction below which probes differentiate a medium better than vertices do, where that is so.
    pub(crate) probed: Vec<Option<f64>>,
    needs: ActiveFactors,
    /// How far light can go in each medium, at most.
    extent: Vec<f64>,
    /// Where set, no discrete choice depends on values that may differ between this scene and
    /// another: the extinctions by which distances in media of one extinction are drawn instead of their
    /// own.
    steady: Option<Vec<Option<Homogeneous>>>,
    pub(crate) max_depth: u32,
    pub(crate) rr_depth: u32,
    /// Rays from the camera pass area emitters, and see no environment.
    pub(crate) hides_emitters: bool,
    pub(crate) geometry: Arc<Geometry>,
    null: Vec<bool>,
    /// Shapes whose BSDFs tell directions along them apart.
    oriented: Vec<bool>,
    pub(crate) any_null: bool,
    /// Some surfaces let light go straight through at no depth.
    pub(crate) any_straight: bool,
    /// The medium beyond every interface.
    ambient: Option<usize>,
}

impl World {
    /// Prepares a scene. `like` is the same scene at other values, whose discrete choices this one
    /// repeats: finite differences need both sides to draw alike. What is `kept` is taken where it
    /// is that of the scene.
    pub(crate) fn new(
        scene: impl Into<Arc<Scene>>,
        sensor: usize,
        max_depth: Option<u32>,
        like: Option<&Self>,
        lit: EmitterMask,
        kept: &mut PreparedCache,
    ) -> Result<Self, Error> {
        let scene: Arc<Scene> = scene.into();
        let camera = scene.sensor(sensor)?;
        let (camera_item, surrounding) = (camera.item.sensor.clone(), camera.item.medium);
        let geometry = kept.geometry(&scene)?;
        let radius = geometry.radius;
        let of_bsdfs = |is: fn(&Bsdf) -> bool| -> Vec<bool> {
            scene.shapes.iter().map(|s| is(&scene.bsdfs[s.bsdf].item)).collect()
        };
        let [null, oriented] = [Bsdf::is_null, Bsdf::is_oriented].map(of_bsdfs);
        let tracking = scene
            .media
            .iter()
            .map(|m| {
                if m.item.is_scattering() || m.item.is_emissive() {
                    Tracking::Vertices
                } else {
                    Tracking::Attenuation
                }
            })
            .collect();
        let lights =
            LightTable::new(&scene, &geometry.first_prim, radius, like.map(|w| &w.lights), lit)?;
        let depth = max_depth.or(scene.integrator.max_depth).unwrap_or(u32::MAX);
        let mut world = Self {
            lights,
            lit,
            camera: camera_item,
            camera_medium: None,
            film_medium: SurroundingMedium::Uniform(None),
            tracking,
            defensive: alloc::vec![0.0; scene.media.len()],
            probed: alloc::vec![None; scene.media.len()],
            needs: ActiveFactors::default(),
            extent: (0..scene.media.len()).map(|m| extent(&scene, m, 2.0 * radius)).collect(),
            steady: like
                .map(|w| w.scene.media.iter().map(|m| m.item.extinction().copied()).collect()),
            max_depth: depth,
            rr_depth: scene.integrator.rr_depth,
            hides_emitters: scene.hides_something(),
            any_null: null.iter().any(|n| *n),
            any_straight: !scene.integrator.straight_depth && scene.first_straight().is_some(),
            geometry,
            null,
            oriented,
            ambient: None,
            scene,
        };
        world.settle_media(surrounding);
        Ok(world)
    }

    /// This world with the light of some emitters only.
    pub(crate) fn lit_by(&self, lit: EmitterMask) -> Result<Self, Error> {
        if lit == self.lit {
            return Ok(self.clone());
        }
        let first_prim = &self.geometry.first_prim;
        let lights = LightTable::new(&self.scene, first_prim, self.geometry.radius, None, lit)?;
        let mut world = Self { lights, lit, ..self.clone() };
        world.settle_lights();
        Ok(world)
    }

    /// True where normals are interpolated.
    pub(crate) fn is_smooth(&self, s: &SurfacePoint) -> bool {
        self.scene.shapes[s.shape as usize].mesh.normals.is_some()
    }

    /// About how wide the narrowest lobe at `v` is, in radians; at most 1.
    pub(crate) fn lobe_width(&self, v: &Vertex) -> f64 {
        self.scattering(v).map_or(1.0, |scattering| scattering.lobe_width())
    }

    pub(crate) fn medium(&self, m: usize) -> &Medium {
        &self.scene.media[m].item
    }

    /// The coefficients of medium `m` at `x`. The emission is that along the unit vector `w`, of which microflakes show their
    /// [area](Medium::projected_area), as far as it counts.
    pub(crate) fn coefficients(&self, m: usize, x: Vec3, w: Vec3) -> Coefficients {
        let mut c = self.medium(m).coefficients(x);
        if !self.lit.by_surroundings() {
            c.emission = Rgb::ZERO;
        } else if !c.emission.is_zero() {
            c.emission *= self.medium(m).projected_area(x, w);
        }
        c
    }

    pub(crate) fn bsdf_of(&self, shape: u32) -> &Bsdf {
        &self.scene.bsdfs[self.scene.shapes[shape as usize].bsdf].item
    }

    pub(crate) fn is_null(&self, shape: u32) -> bool {
        self.null[shape as usize]
    }

    /// True where directions along a shape are told apart.
    pub(crate) fn is_oriented(&self, shape: u32) -> bool {
        self.oriented[shape as usize]
    }

    /// True where some light goes straight through the surface that a vertex is on.
    #[cold]
    pub(crate) fn passes_straight(&self, v: &Vertex) -> bool {
        v.surface().is_some_and(|s| self.bsdf_of(s.shape).passes_straight())
    }

    pub(crate) fn has_media(&self) -> bool {
        !self.scene.media.is_empty()
    }

    /// True when light can leave a vertex by scattering.
    pub(crate) fn can_scatter(&self, v: &Vertex) -> bool {
        v.surface().is_none_or(|s| !self.bsdf_of(s.shape).is_black())
    }

    /// True when paths have vertices on a shape: it scatters or emits.
    pub(crate) fn scatters(&self, shape: usize) -> bool {
        !self.bsdf_of(shape as u32).is_black() || self.scene.shapes[shape].emitter.is_some()
    }

    pub(crate) fn shape_name(&self, shape: usize) -> String {
        let id = self.scene.shapes[shape].id.clone();
        id.unwrap_or_else(|| alloc::format!("shape[{shape}]"))
    }

    /// The scattering function at a vertex; `None` at points.
    pub(crate) fn scattering(&self, v: &Vertex) -> Option<Scattering<'_>> {
        match &v.kind {
            Kind::Surface(s) => {
                let shape = &self.scene.shapes[s.shape as usize];
                let bsdf = &self.scene.bsdfs[shape.bsdf].item;
                let at = (!bsdf.is_plain()).then(|| self.texture_point(s));
                Some(Scattering::Surface(bsdf.at(at, s.ng, s.ns, shape.mesh.normals.is_some())))
            }
            Kind::Volume(_) => v.medium.map(|m| {
                let (medium, x) = (self.medium(m), v.x);
                Scattering::Volume { medium, x, phase: medium.phase_at(x) }
            }),
            Kind::Point => None,
        }
    }

    /// True on an area emitter.
    pub(crate) fn emits(&self, s: &SurfacePoint) -> bool {
        self.scene.shapes[s.shape as usize].emitter.is_some()
    }

    /// Radiance a surface emits from `s` towards the unit direction `w`.
    pub(crate) fn emitted(&self, s: &SurfacePoint, w: Vec3) -> Rgb {
        match self.scene.shapes[s.shape as usize].emitter {
            Some(e) if s.ng.dot(w) > 0.0 => self.area_radiance(e, s),
            _ => Rgb::ZERO,
        }
    }

    /// True of a shape that emits the same radiance from everywhere on its front.
    pub(crate) fn emits_evenly(&self, shape: u32) -> bool {
        let emitter = self.scene.shapes[shape as usize].emitter;
        emitter.is_some_and(|e| matches!(self.scene.emitters[e].item.emitter, Emitter::Area { .. }))
    }

    /// Radiance of an area emitter at a point of it.
    #[inline]
    pub(crate) fn area_radiance(&self, emitter: usize, s: &SurfacePoint) -> Rgb {
        match &self.scene.emitters[emitter].item.emitter {
            Emitter::TexturedArea { radiance, texture } if self.lit.by_surroundings() => {
                *radiance * texture.at_point(&self.texture_point(s))
            }
            _ => self.lights.area_radiance(emitter),
        }
    }
}

/// The diagonal of the box around the surfaces that hold a medium; `all` where none do.
fn extent(scene: &Scene, medium: usize, all: f64) -> f64 {
    let bounds = |s: &Shape| s.boundary.is_some_and(|b| b.interior == Some(medium));
    let shapes = (0..scene.shapes.len()).filter(|i| bounds(&scene.shapes[*i]));
    let corners = shapes.map(|i| scene.world_bounds(i)).flat_map(|b| [b.min, b.max]);
    let bounds = Aabb::around(corners);
    if bounds.is_empty() { all } else { (bounds.max - bounds.min).length() }
}
