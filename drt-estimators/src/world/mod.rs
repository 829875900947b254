//! A scene prepared for ray queries: the triangles of all shapes in one BVH, and the media on both sides of each.

pub(crate) mod cache;
mod geometry;
pub(crate) mod lights;
pub(crate) mod rays;
pub(crate) mod scatter;
pub(crate) mod vertex;

use alloc::string::String;
use alloc::sync::Arc;
use alloc::vec::Vec;

pub(crate) use crate::world::rays::short_of;
use drt_geom::{Aabb, Hit, Ray, Skip};
use drt_math::{Rgb, Vec3};
use drt_medium::{Coefficients, Homogeneous, Medium};

use crate::model::emitter::Emitter;
use crate::model::error::Error;
use crate::model::scene::{Scene, Shape, Surrounding};
use crate::model::surface::Bsdf;
use crate::model::texture::TexturePoint;
use crate::world::cache::PreparedCache;
use crate::world::geometry::{Geometry, Prim};
use crate::world::lights::{EmitterMask, LightTable};
use crate::world::scatter::Scattering;
use crate::world::vertex::{Contact, Kind, SurfacePoint, Vertex};

/// A null interface on a ray.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Crossing {
    pub(crate) point: SurfacePoint,
    pub(crate) x: Vec3,
    /// Distance from the ray's start.
    pub(crate) t: f64,
    pub(crate) after: Option<usize>,
}

/// What lies along a ray up to the first surface that scatters.
#[derive(Clone, Debug, Default)]
pub(crate) struct RayPath {
    /// The medium the ray starts in.
    pub(crate) medium: Option<usize>,
    pub(crate) crossings: Vec<Crossing>,
    /// The surface it ends on; `None` when it escapes.
    pub(crate) end: Option<(SurfacePoint, Vec3)>,
    /// Its length; infinite when it escapes.
    pub(crate) length: f64,
    hits: Vec<Hit>,
}

impl RayPath {
    /// Ends the ray at `length`.
    pub(crate) fn cut(&mut self, length: f64) {
        self.crossings.retain(|c| c.t < length);
        self.end = None;
        self.length = length;
    }

    /// The medium at its end.
    pub(crate) fn last_medium(&self) -> Option<usize> {
        self.crossings.last().map_or(self.medium, |c| c.after)
    }

    /// Becomes the first `length` of another ray.
    pub(crate) fn truncate_from(&mut self, other: &Self, length: f64) {
        self.medium = other.medium;
        self.crossings.clear();
        self.crossings.extend(other.crossings.iter().take_while(|c| c.t < length));
        self.end = None;
        self.length = length;
    }
}

/// A piece of a ray inside one medium.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Interval {
    pub(crate) medium: Option<usize>,
    pub(crate) start: f64,
    pub(crate) end: f64,
}

/// The pieces a ray is cut into by its crossings.
pub(crate) fn intervals(
    medium: Option<usize>,
    crossings: &[Crossing],
    length: f64,
) -> impl Iterator<Item = Interval> + '_ {
    (0..=crossings.len()).map(move |i| Interval {
        medium: if i == 0 { medium } else { crossings[i - 1].after },
        start: if i == 0 { 0.0 } else { crossings[i - 1].t },
        end: crossings.get(i).map_or(length, |c| c.t),
    })
}

/// Largest probability of going on under Russian roulette. Below one it also ends paths that lose
/// nothing, at the price of weights that grow with every vertex.
const MOST_SURVIVAL: f64 = 0.99;
/// What comes off something dark may still move fast: a survivor counts ten times at most.
const LEAST_SURVIVAL: f64 = 0.1;
/// The probability where it must not depend on what a path carries.
const STEADY_SURVIVAL: f64 = 0.9;
/// Least probability of a scattering vertex per tentative collision where coefficients change.
const DEFENSIVE: f64 = 0.1;

/// What derivatives need of a medium.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum MediumActivity {
    /// Its coefficients do not change.
    Nothing,
    /// They change.
    Density,
    /// So does what happens at vertices, even if nothing does now.
    Vertices,
}

/// What derivatives need beyond the image.
#[derive(Clone, Debug, Default)]
pub(crate) struct ActiveFactors {
    pub(crate) media: Vec<MediumActivity>,
    pub(crate) bsdfs: Vec<bool>,
    /// Those whose roughness changes.
    pub(crate) roughness: Vec<bool>,
    /// Those whose index of refraction changes.
    pub(crate) index: Vec<bool>,
}

impl ActiveFactors {
    /// What either needs.
    pub(crate) fn union(&self, other: &Self) -> Self {
        let any = |a: &[bool], b: &[bool]| a.iter().zip(b).map(|(a, b)| *a || *b).collect();
        Self {
            media: self.media.iter().zip(&other.media).map(|(a, b)| *a.max(b)).collect(),
            bsdfs: any(&self.bsdfs, &other.bsdfs),
            roughness: any(&self.roughness, &other.roughness),
            index: any(&self.index, &other.index),
        }
    }
}

/// What tracking may skip in a medium.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Tracking {
    /// Vertices are sampled inside.
    Vertices,
    /// It only absorbs: segments are attenuated, no vertex is sampled.
    Attenuation,
}

/// The medium around something; `None` is vacuum.
#[derive(Clone, Copy, Debug)]
pub(crate) enum SurroundingMedium {
    /// One medium everywhere around it.
    Uniform(Option<usize>),
    /// Different media at different points.
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

    /// Makes sure that what derivatives need is sampled where its value is zero (theory sheet §14.5):
    /// vertices in media whose coefficients change, and paths over materials that change.
    pub(crate) fn prepare_for_derivatives(&mut self, needs: ActiveFactors) {
        for (m, need) in needs.media.iter().enumerate() {
            if *need == MediumActivity::Nothing {
                continue;
            }
            self.defensive[m] = match self.medium(m).extinction() {
                Some(h) => self.defensive_where_thin(m, h),
                None => DEFENSIVE,
            };
            if *need == MediumActivity::Vertices {
                self.tracking[m] = Tracking::Vertices;
            }
        }
        self.needs = needs;
    }

    /// The least probability of a vertex per flight through a homogeneous filling of medium `m`: zero
    /// where free flights stop inside more often than that by themselves.
    pub(crate) fn defensive_where_thin(&self, m: usize, filling: &Homogeneous) -> f64 {
        let sigma_t = filling.coefficients().sigma_t.to_array();
        let thin = |s: f64| s * self.extent[m] < DEFENSIVE;
        if sigma_t.into_iter().any(thin) { DEFENSIVE } else { 0.0 }
    }

    /// The medium by whose extinction distances are drawn, and its extinction less the medium's own;
    /// `None` when that is the medium itself.
    pub(crate) fn drawn_by(&self, m: usize) -> Option<(&Homogeneous, Rgb)> {
        let other = self.steady.as_ref()?.get(m)?.as_ref()?;
        let own = self.medium(m).extinction()?;
        Some((other, other.coefficients().sigma_t - own.coefficients().sigma_t))
    }

    /// Probability that Russian roulette lets a path go on which carries `throughput`.
    pub(crate) fn survival(&self, throughput: Rgb) -> f64 {
        if self.steady.is_some() {
            STEADY_SURVIVAL
        } else {
            let moves = throughput.max_channel();
            if moves > 0.0 { moves.clamp(LEAST_SURVIVAL, MOST_SURVIVAL) } else { 0.0 }
        }
    }

    /// True when a parameter changes how `v` scatters, so that a zero there may not stay zero.
    pub(crate) fn may_revive(&self, v: &Vertex) -> bool {
        match (&v.kind, v.medium) {
            (Kind::Surface(s), _) => self.needed(&self.needs.bsdfs, s),
            (_, Some(m)) => self.needs.media.get(m).is_some_and(|n| *n != MediumActivity::Nothing),
            _ => false,
        }
    }

    /// True when a parameter changes how rough the surface at `v` is.
    pub(crate) fn roughens(&self, v: &Vertex) -> bool {
        v.surface().is_some_and(|s| self.needed(&self.needs.roughness, s))
    }

    /// True when a parameter changes how the surface at `v` refracts.
    pub(crate) fn bends_light(&self, v: &Vertex) -> bool {
        let bends = |s: &SurfacePoint| {
            self.needed(&self.needs.index, s) && self.bsdf_of(s.shape).is_transmissive()
        };
        v.surface().is_some_and(bends)
    }

    /// Whether the material of a surface is one of those that something is needed `of`.
    fn needed(&self, of: &[bool], s: &SurfacePoint) -> bool {
        of.get(self.scene.shapes[s.shape as usize].bsdf) == Some(&true)
    }

    /// True where normals are interpolated.
    pub(crate) fn is_smooth(&self, s: &SurfacePoint) -> bool {
        self.scene.shapes[s.shape as usize].mesh.normals.is_some()
    }

    /// About how wide the narrowest lobe at `v` is, in radians; at most 1.
    pub(crate) fn lobe_width(&self, v: &Vertex) -> f64 {
        self.scattering(v).map_or(1.0, |scattering| scattering.lobe_width())
    }

    /// Finds the medium beyond all interfaces and the one around the camera.
    fn settle_media(&mut self, camera: Surrounding) {
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
        self.film_medium = match camera {
            Surrounding::Counted if self.camera.is_orthographic() => {
                self.medium_near(&Aabb::around(self.camera.film_corners()))
            }
            Surrounding::Counted if self.camera.aperture().is_some() => {
                let square = [[-1.0, -1.0], [-1.0, 1.0], [1.0, -1.0], [1.0, 1.0]];
                let corner = |at| self.camera.at_lens(at).position();
                self.medium_near(&Aabb::around(square.map(corner)))
            }
            _ => SurroundingMedium::Uniform(self.camera_medium),
        };
        self.settle_lights();
    }

    /// Finds the lights inside of media.
    fn settle_lights(&mut self) {
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

    pub(crate) fn medium(&self, m: usize) -> &Medium {
        &self.scene.media[m].item
    }

    /// The coefficients of medium `m` at `x`, its emission as far as it counts.
    pub(crate) fn coefficients(&self, m: usize, x: Vec3) -> Coefficients {
        let mut c = self.medium(m).coefficients(x);
        if !self.lit.by_surroundings() {
            c.emission = Rgb::ZERO;
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

    pub(crate) fn prim_of(&self, shape: usize, triangle: u32) -> u32 {
        self.geometry.first_prim[shape] + triangle
    }

    pub(crate) fn shape_name(&self, shape: usize) -> String {
        let id = self.scene.shapes[shape].id.clone();
        id.unwrap_or_else(|| alloc::format!("shape[{shape}]"))
    }

    /// The point of a triangle at given barycentric weights.
    pub(crate) fn point(&self, prim: u32, bary: [f64; 2]) -> (SurfacePoint, Vec3) {
        match self.geometry.prims.get(prim as usize) {
            Some(place) => self.point_of_mesh(prim, *place, bary),
            None => self.point_of_instance(prim, bary),
        }
    }

    #[cold]
    fn point_of_instance(&self, prim: u32, bary: [f64; 2]) -> (SurfacePoint, Vec3) {
        let (place, placed) = self.geometry.of_instance(prim);
        let (point, x) = self.point_of_mesh(prim, place, bary);
        let [ng, ns] = [point.ng, point.ns].map(|n| (placed.normals * n).normalize());
        (SurfacePoint { ng, ns, ..point }, placed.to_world.point(x))
    }

    /// The point in the space of the mesh.
    #[inline(always)]
    fn point_of_mesh(
        &self,
        prim: u32,
        Prim { shape, triangle }: Prim,
        bary: [f64; 2],
    ) -> (SurfacePoint, Vec3) {
        let mesh = &self.scene.shapes[shape as usize].mesh;
        let [a, b, c] = mesh.triangle(triangle);
        let (e1, e2) = (b - a, c - a);
        let ng = e1.cross(e2).normalize();
        let ns = match &mesh.normals {
            None => ng,
            Some(normals) => {
                let [i, j, k] = mesh.triangles[triangle as usize].map(|v| normals[v as usize]);
                (i * (1.0 - bary[0] - bary[1]) + j * bary[0] + k * bary[1]).normalize()
            }
        };
        let x = a * (1.0 - bary[0] - bary[1]) + b * bary[0] + c * bary[1];
        (SurfacePoint { prim, shape, triangle, bary, ng, ns }, x)
    }

    /// The point of a triangle's plane nearest to `x`, moved into the triangle.
    pub(crate) fn point_near(&self, prim: u32, x: Vec3) -> (SurfacePoint, Vec3) {
        let Prim { shape, triangle } = self.geometry.prim(prim);
        let mesh = &self.scene.shapes[shape as usize].mesh;
        let [a, ..] = mesh.triangle(triangle);
        let [g1, g2] = mesh.barycentric_gradients(triangle);
        let [b1, b2] = [g1, g2].map(|g| g.dot(x - a).clamp(0.0, 1.0));
        let sum = f64::max(b1 + b2, 1.0);
        self.point(prim, [b1 / sum, b2 / sum])
    }

    /// The gradient of `adjoint · shading normal` by the place of the point in its triangle.
    pub(crate) fn normal_slide(&self, s: &SurfacePoint, adjoint: Vec3) -> Vec3 {
        let mesh = &self.scene.shapes[s.shape as usize].mesh;
        let Some(normals) = &mesh.normals else { return Vec3::ZERO };
        let [i, j, k] = mesh.triangles[s.triangle as usize].map(|v| normals[v as usize]);
        let sum = i * (1.0 - s.bary[0] - s.bary[1]) + j * s.bary[0] + k * s.bary[1];
        let adjoint = adjoint.reject(s.ns) / sum.length();
        let [g1, g2] = mesh.barycentric_gradients(s.triangle);
        g1 * adjoint.dot(j - i) + g2 * adjoint.dot(k - i)
    }

    /// Where the textures of a point are looked up.
    #[inline]
    pub(crate) fn texture_point(&self, s: &SurfacePoint) -> TexturePoint<'_> {
        let mesh = &self.scene.shapes[s.shape as usize].mesh;
        let mut at = TexturePoint::new(mesh, s.triangle, s.bary);
        if s.prim as usize >= self.geometry.prims.len() {
            at.to_world = self.scene.placement(s.shape as usize);
        }
        at
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
            Kind::Volume(_) => v.medium.map(|m| Scattering::Volume(&self.medium(m).phase)),
            Kind::Point => None,
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

    /// The side of the first surface that bounds media from `x` on along `dir`; of several that coincide, of one that a
    /// ray leaves.
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

    /// The medium in which a ray from `x` along the unit direction `dir` starts. The point may lie on an interface, but
    /// on no other surface that bounds media.
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

    /// The extinction at a point of an interface, on the side that the unit vector `towards` points to.
    pub(crate) fn sigma_t_at_border(&self, medium: Option<usize>, x: Vec3, towards: Vec3) -> Rgb {
        let Some(m) = medium else { return Rgb::ZERO };
        self.medium(m).sigma_t(x + towards * self.border(m))
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

/// A unit direction that avoids edges and faces along axes, to look for interfaces in where any direction serves.
fn askew() -> Vec3 {
    drt_math::vec3(0.577_215_66, 0.414_213_56, 0.703_818_4).normalize()
}

/// The diagonal of the box around the surfaces that hold a medium; `all` where none do.
fn extent(scene: &Scene, medium: usize, all: f64) -> f64 {
    let bounds = |s: &Shape| s.boundary.is_some_and(|b| b.interior == Some(medium));
    let shapes = (0..scene.shapes.len()).filter(|i| bounds(&scene.shapes[*i]));
    let corners = shapes.map(|i| scene.world_bounds(i)).flat_map(|b| [b.min, b.max]);
    let bounds = Aabb::around(corners);
    if bounds.is_empty() { all } else { (bounds.max - bounds.min).length() }
}
