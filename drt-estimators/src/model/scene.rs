//! The contents of a scene: plain data, the reference configuration from which every estimator starts.

use alloc::borrow::Cow;
use alloc::collections::BTreeSet;
use alloc::string::String;
use alloc::sync::Arc;
use alloc::vec::Vec;

use drt_geom::{Aabb, Mesh};
use drt_math::{Affine, Vec3};
use drt_medium::Medium;

use crate::model::emitter::Emitter;
use crate::model::emitter_overlap::overlapping_lamps;
use crate::model::error::{ElementError, Error, SettingError};
use crate::model::sensor::Sensor;
use crate::model::surface::Bsdf;

/// A scene: shapes, their scattering models and media, emitters, and sensors.
///
/// Indices refer to the vectors of this struct. Everything is in world space except the meshes of instances.
#[derive(Clone, Debug, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Scene {
    /// Surfaces, in file order.
    pub shapes: Vec<Shape>,
    /// The shapes that are instances, in increasing order of their indices.
    #[cfg_attr(feature = "serde", serde(default))]
    pub instances: Vec<Instance>,
    /// Surface scattering models.
    pub bsdfs: Vec<Named<Bsdf>>,
    /// Participating media.
    pub media: Vec<Named<Medium>>,
    /// Emitters; the shape of an area emitter has the emitter's index.
    pub emitters: Vec<Named<SceneEmitter>>,
    /// Cameras.
    pub sensors: Vec<Named<SceneSensor>>,
    /// Path depth and Russian roulette.
    pub integrator: Integrator,
}

/// An item that a job file can address by its id.
#[derive(Clone, Debug)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Named<T> {
    /// The id in the scene file, where there is one.
    pub id: Option<String>,
    /// The item itself.
    pub item: T,
}

impl<T> Named<T> {
    /// An item with an id.
    pub fn new(id: impl Into<String>, item: T) -> Self {
        Self { id: Some(id.into()), item }
    }
    /// An item that is addressed by its order only.
    pub fn anonymous(item: T) -> Self {
        Self { id: None, item }
    }
}

/// A surface: a triangle mesh, its scattering, and the media on its two sides.
#[derive(Clone, Debug)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Shape {
    /// The id in the scene file, where there is one.
    pub id: Option<String>,
    /// Geometry, in world space unless the shape is an [`Instance`]. The front of a triangle is the side from which its
    /// vertices run counter-clockwise; `interior` is behind it.
    pub mesh: Arc<Mesh>,
    /// Index of the scattering model.
    pub bsdf: usize,
    /// The media that the surface separates; with `None` the medium is the one around the surface, on both sides.
    pub boundary: Option<MediumBoundary>,
    /// Index of the shape's area emitter, if it emits.
    pub emitter: Option<usize>,
}

/// A shape whose mesh is in a space of its own, so that many shapes can share it.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Instance {
    /// Index of the shape.
    pub shape: usize,
    /// The map from the space of the mesh to the world. The front of a surface stays its front where this map mirrors.
    pub to_world: Affine,
}

/// The media behind and in front of a surface; `None` is vacuum.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct MediumBoundary {
    /// Behind the faces.
    pub interior: Option<usize>,
    /// In front of the faces.
    pub exterior: Option<usize>,
}

/// An emitter and the medium it sits in.
#[derive(Clone, Debug)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct SceneEmitter {
    /// The emitter.
    pub emitter: Emitter,
    /// The medium around it (point and spot lights).
    pub medium: Surrounding,
}

/// A sensor and the medium it sits in.
#[derive(Clone, Debug)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct SceneSensor {
    /// The camera.
    pub sensor: Sensor,
    /// The medium around it.
    pub medium: Surrounding,
    /// Samples per pixel that the scene file asks for.
    pub sample_count: Option<u32>,
}

/// Which medium surrounds a point.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum Surrounding {
    /// Found by counting the interfaces between the point and infinity.
    #[default]
    Counted,
    /// Stated by the scene; `None` is vacuum.
    Stated(Option<usize>),
}

/// Path depth and Russian roulette, with Mitsuba's meaning.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Integrator {
    /// The maximum depth: 1 shows emitters only, and each scattering adds 1; `None` is unlimited.
    pub max_depth: Option<u32>,
    /// The depth from which Russian roulette may end a path.
    pub rr_depth: u32,
    /// Camera rays go through area emitters, and see no environment.
    #[cfg_attr(feature = "serde", serde(default))]
    pub hide_emitters: bool,
    /// Going straight through a surface (a mask, a thin pane) also adds 1 to the depth, and the light of point, spot
    /// and directional emitters does not get through, as in Mitsuba's `path`. Otherwise it adds nothing, as in
    /// `volpath`. Null interfaces add nothing in either case.
    #[cfg_attr(feature = "serde", serde(default))]
    pub straight_depth: bool,
}

impl Default for Integrator {
    fn default() -> Self {
        Self { max_depth: None, rr_depth: 5, hide_emitters: false, straight_depth: false }
    }
}

/// The item of a scene on which an effect acts, once its name has been looked up.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Target {
    /// A shape.
    Shape(usize),
    /// A medium.
    Medium(usize),
    /// A medium at rest: its coefficients and its phase function, not where its grids are. A gradient by these alone takes less
    /// time than one by the medium. Names find media, not these.
    Coefficients(usize),
    /// A scattering model.
    Bsdf(usize),
    /// An emitter.
    Emitter(usize),
    /// A sensor.
    Sensor(usize),
}

/// A name of an item of a scene: its id, its kind and order such as `shape[0]`, or the [`Target`] itself.
pub trait TargetName {
    /// The item.
    ///
    /// # Errors
    /// When nothing or more than one thing has that name.
    fn find_in(&self, scene: &Scene) -> Result<Target, Error>;
}

impl TargetName for Target {
    fn find_in(&self, scene: &Scene) -> Result<Target, Error> {
        let (kind, i, count) = match *self {
            Self::Shape(i) => ("shape", i, scene.shapes.len()),
            Self::Medium(i) | Self::Coefficients(i) => ("medium", i, scene.media.len()),
            Self::Bsdf(i) => ("bsdf", i, scene.bsdfs.len()),
            Self::Emitter(i) => ("emitter", i, scene.emitters.len()),
            Self::Sensor(i) => ("sensor", i, scene.sensors.len()),
        };
        if i < count { Ok(*self) } else { scene.find(&alloc::format!("{kind}[{i}]")) }
    }
}

impl TargetName for &str {
    fn find_in(&self, scene: &Scene) -> Result<Target, Error> {
        scene.find(self)
    }
}

impl TargetName for String {
    fn find_in(&self, scene: &Scene) -> Result<Target, Error> {
        scene.find(self)
    }
}

impl Scene {
    /// Checks that indices refer to something, that what emits has an area, and the numbers of meshes, scattering
    /// models, phase functions and emitters. Coefficients, sensors and filters are checked where they are made.
    ///
    /// # Errors
    /// Names the element and what is wrong with it.
    pub fn check(&self) -> Result<(), Error> {
        let missing = |m: Option<usize>| m.is_some_and(|m| m >= self.media.len());
        let stated = |s: Surrounding| matches!(s, Surrounding::Stated(m) if missing(m));
        self.check_instances()?;
        let mut checked = BTreeSet::new();
        for (i, s) in self.shapes.iter().enumerate() {
            let fail = |reason| unusable(&s.id, "shape", i, reason);
            // Instances share theirs.
            if checked.insert(Arc::as_ptr(&s.mesh)) {
                s.mesh.validate().map_err(|e| fail(e.into()))?;
            }
            if s.bsdf >= self.bsdfs.len() {
                return Err(fail(ElementError::NoBsdf(s.bsdf)));
            }
            if let Some(e) = s.emitter {
                let emitter = self.emitters.get(e).ok_or_else(|| fail(ElementError::NoEmitter))?;
                let emitter = &emitter.item.emitter;
                if emitter.area_radiance().is_none() {
                    return Err(fail(ElementError::NotAnArea(emitter.kind())));
                }
            }
            if s.boundary.is_some_and(|b| missing(b.interior) || missing(b.exterior)) {
                return Err(fail(ElementError::NoMedium));
            }
            if s.emitter.is_some() && s.mesh.surface_area() <= 0.0 {
                return Err(fail(ElementError::NoArea));
            }
        }
        let emit = || (0..self.shapes.len()).filter(|s| self.shapes[*s].emitter.is_some());
        // One alone overlaps with none.
        let others = emit().nth(1).is_some();
        let lamps = emit().filter(|_| others).map(|s| (s, self.world_triangles(s)));
        if let Some([first, second]) = overlapping_lamps(lamps) {
            let reason = ElementError::OverlappingLamp(self.name_of(Target::Shape(first)));
            return Err(unusable(&self.shapes[second].id, "shape", second, reason));
        }
        for (i, b) in self.bsdfs.iter().enumerate() {
            b.item.validate().map_err(|e| unusable(&b.id, "bsdf", i, e.into()))?;
        }
        for (i, s) in self.shapes.iter().enumerate() {
            let bsdf = &self.bsdfs[s.bsdf].item;
            bsdf.validate_on(&s.mesh).map_err(|e| unusable(&s.id, "shape", i, e.into()))?;
        }
        for (i, m) in self.media.iter().enumerate() {
            m.item.phase.validate().map_err(|e| unusable(&m.id, "medium", i, e.into()))?;
        }
        for (i, e) in self.emitters.iter().enumerate() {
            let fail = |reason| unusable(&e.id, "emitter", i, reason);
            e.item.emitter.validate().map_err(|e| fail(e.into()))?;
            if stated(e.item.medium) {
                return Err(fail(ElementError::NoMedium));
            }
        }
        for (i, s) in self.sensors.iter().enumerate() {
            if stated(s.item.medium) {
                return Err(unusable(&s.id, "sensor", i, ElementError::NoMedium));
            }
        }
        Ok(())
    }

    /// The first shape that light goes straight through, but for null interfaces.
    pub(crate) fn first_straight(&self) -> Option<usize> {
        self.shapes.iter().position(|s| self.bsdfs[s.bsdf].item.passes_straight())
    }

    /// True when the camera sees less than there is, as the integrator hides emitters.
    pub(crate) fn hides_something(&self) -> bool {
        let delta = |e: &Named<SceneEmitter>| e.item.emitter.is_delta();
        self.integrator.hide_emitters && !self.emitters.iter().all(delta)
    }

    /// The sensor that a setting names.
    pub(crate) fn sensor(&self, index: usize) -> Result<&Named<SceneSensor>, Error> {
        let reason = SettingError::NoSensor { index, count: self.sensors.len() };
        self.sensors.get(index).ok_or(Error::Setting { setting: "sensor", reason })
    }

    /// Finds what a job calls `name`: an id, or kind and order such as `shape[0]`.
    ///
    /// # Errors
    /// A sentence naming what exists when nothing or more than one thing has that name.
    pub fn find(&self, name: &str) -> Result<Target, Error> {
        if let Some(target) = self.find_by_order(name) {
            return Ok(target);
        }
        let mut found = self.named().filter(|(id, _)| *id == Some(name)).map(|(_, t)| t);
        match (found.next(), found.next()) {
            (Some(t), None) => Ok(t),
            (None, _) => Err(Error::UnknownTarget {
                name: name.into(),
                known: self.named().filter_map(|(id, _)| id.map(String::from)).collect(),
            }),
            (Some(_), Some(_)) => Err(Error::AmbiguousTarget { name: name.into() }),
        }
    }

    /// Finds all that a job calls `name`: as [`find`](Self::find), or all shapes of an instance of several, whose ids
    /// are that of the instance, a slash and what each is called in its group.
    ///
    /// # Errors
    /// As [`find`](Self::find).
    pub fn find_all(&self, name: &str) -> Result<Vec<Target>, Error> {
        let of_instance =
            |id: &str| id.strip_prefix(name).is_some_and(|rest| rest.starts_with('/'));
        let members = || {
            let shapes = self.shapes.iter().enumerate();
            shapes.filter(|(_, s)| s.id.as_deref().is_some_and(of_instance))
        };
        match self.find(name) {
            Err(Error::UnknownTarget { .. }) if members().next().is_some() => {
                Ok(members().map(|(i, _)| Target::Shape(i)).collect())
            }
            found => Ok(alloc::vec![found?]),
        }
    }

    fn find_by_order(&self, name: &str) -> Option<Target> {
        let (kind, rest) = name.split_once('[')?;
        let i: usize = rest.strip_suffix(']')?.parse().ok()?;
        let (len, make): (usize, fn(usize) -> Target) = match kind {
            "shape" => (self.shapes.len(), Target::Shape),
            "medium" => (self.media.len(), Target::Medium),
            "bsdf" => (self.bsdfs.len(), Target::Bsdf),
            "emitter" => (self.emitters.len(), Target::Emitter),
            "sensor" => (self.sensors.len(), Target::Sensor),
            _ => return None,
        };
        (i < len).then(|| make(i))
    }

    /// Id, or kind and order, of something that exists.
    pub(crate) fn name_of(&self, target: Target) -> String {
        let (kind, i, id) = match target {
            Target::Shape(i) => ("shape", i, &self.shapes[i].id),
            Target::Medium(i) | Target::Coefficients(i) => ("medium", i, &self.media[i].id),
            Target::Bsdf(i) => ("bsdf", i, &self.bsdfs[i].id),
            Target::Emitter(i) => ("emitter", i, &self.emitters[i].id),
            Target::Sensor(i) => ("sensor", i, &self.sensors[i].id),
        };
        id.clone().unwrap_or_else(|| alloc::format!("{kind}[{i}]"))
    }

    pub(crate) fn named(&self) -> impl Iterator<Item = (Option<&str>, Target)> {
        fn ids<T>(
            items: &[Named<T>],
            make: fn(usize) -> Target,
        ) -> impl Iterator<Item = (Option<&str>, Target)> {
            items.iter().enumerate().map(move |(i, n)| (n.id.as_deref(), make(i)))
        }
        let shapes = self.shapes.iter().enumerate();
        shapes
            .map(|(i, s)| (s.id.as_deref(), Target::Shape(i)))
            .chain(ids(&self.media, Target::Medium))
            .chain(ids(&self.bsdfs, Target::Bsdf))
            .chain(ids(&self.emitters, Target::Emitter))
            .chain(ids(&self.sensors, Target::Sensor))
    }
}

/// Most triangles of the copies that derivatives make of instances.
const MOST_COPIED: u64 = 1 << 25;

impl Scene {
    /// The map from the space of a shape's mesh to the world, of an instance.
    #[must_use]
    pub fn placement(&self, shape: usize) -> Option<&Affine> {
        let found = self.instances.binary_search_by_key(&shape, |i| i.shape);
        found.ok().map(|i| &self.instances[i].to_world)
    }

    /// The corners of a shape's triangles in the world.
    pub(crate) fn world_triangles(&self, shape: usize) -> impl Iterator<Item = [Vec3; 3]> {
        let (mesh, placement) = (&self.shapes[shape].mesh, self.placement(shape));
        (0..mesh.triangles.len() as u32).map(move |t| {
            let triangle = mesh.triangle(t);
            placement.map_or(triangle, |map| triangle.map(|p| map.point(p)))
        })
    }

    /// A box around a shape in the world.
    pub(crate) fn world_bounds(&self, shape: usize) -> Aabb {
        let b = self.shapes[shape].mesh.bounds();
        let Some(map) = self.placement(shape).filter(|_| !b.is_empty()) else { return b };
        let corner = |i: u32| {
            let pick = |k: usize| if i >> k & 1 == 0 { b.min[k] } else { b.max[k] };
            map.point(drt_math::vec3(pick(0), pick(1), pick(2)))
        };
        Aabb::around((0..8).map(corner))
    }

    /// This scene with a mesh in world space for every instance: derivatives need it, as each of its edges
    /// and vertices moves by itself.
    ///
    /// # Errors
    /// When these would have more than 33 million triangles.
    pub fn expanded(&self) -> Result<Cow<'_, Self>, Error> {
        let Some(first) = self.instances.first() else { return Ok(Cow::Borrowed(self)) };
        self.check_instances()?;
        let triangles = |i: &Instance| self.shapes[i.shape].mesh.triangles.len() as u64;
        let count: u64 = self.instances.iter().map(triangles).sum();
        if count > MOST_COPIED {
            let reason = ElementError::Copies { count, most: MOST_COPIED };
            return Err(unusable(&self.shapes[first.shape].id, "shape", first.shape, reason));
        }
        let mut scene = self.clone();
        for Instance { shape, to_world } in core::mem::take(&mut scene.instances) {
            let shape = &mut scene.shapes[shape];
            shape.mesh = Arc::new(shape.mesh.transform(&to_world));
        }
        Ok(Cow::Owned(scene))
    }

    fn check_instances(&self) -> Result<(), Error> {
        for (i, instance) in self.instances.iter().enumerate() {
            let Some(shape) = self.shapes.get(instance.shape) else {
                let element = alloc::format!("instance {i}");
                return Err(Error::Element { element, reason: ElementError::NoShape });
            };
            let fail = |reason| Err(unusable(&shape.id, "shape", instance.shape, reason));
            if i > 0 && self.instances[i - 1].shape >= instance.shape {
                return fail(ElementError::InstanceOrder);
            }
            let map = &instance.to_world;
            if !(map.is_finite() && map.inverse().is_finite()) {
                return fail(ElementError::FlatInstance);
            }
            if shape.emitter.is_some() {
                return fail(ElementError::GlowingInstance);
            }
        }
        Ok(())
    }
}

pub(crate) fn unusable(id: &Option<String>, kind: &str, i: usize, reason: ElementError) -> Error {
    Error::Element { element: id.clone().unwrap_or_else(|| alloc::format!("{kind}[{i}]")), reason }
}

#[cfg(test)]
pub(super) mod tests {
    use alloc::string::ToString;

    use drt_geom::procedural;
    use drt_math::{Rgb, Vec3};

    use super::*;
    use crate::model::surface::{Diffuse, RoughConductor};

    pub(in crate::model) fn scene() -> Scene {
        let light = Emitter::Point { position: Vec3::Z, intensity: Rgb::ONE };
        Scene {
            shapes: alloc::vec![Shape {
                id: None,
                mesh: Arc::new(procedural::cube()),
                bsdf: 0,
                boundary: None,
                emitter: None,
            }],
            bsdfs: alloc::vec![Named::new("grey", Bsdf::Diffuse(Diffuse::default()))],
            emitters: alloc::vec![Named::new(
                "bulb",
                SceneEmitter { emitter: light, medium: Surrounding::Counted }
            )],
            ..Scene::default()
        }
    }

    #[test]
    fn every_element_is_checked() {
        scene().check().unwrap();
        let fails = |change: &dyn Fn(&mut Scene), part: &str| {
            let mut scene = scene();
            change(&mut scene);
            let message = scene.check().unwrap_err().to_string();
            assert!(message.contains(part), "{message}");
        };
        fails(&|s| s.shapes[0].bsdf = 1, "shape[0]: there is no bsdf 1");
        fails(&|s| s.shapes[0].emitter = Some(1), "its emitter does not exist");
        let media = MediumBoundary { interior: Some(0), exterior: None };
        fails(&|s| s.shapes[0].boundary = Some(media), "one of its media");
        let albedo = |r| Bsdf::Diffuse(Diffuse { reflectance: Rgb::splat(r) });
        for wrong in [f64::NAN, -0.1, f64::INFINITY] {
            fails(&|s| s.bsdfs[0].item = albedo(wrong), "grey: ");
        }
        let metal = |alpha| Bsdf::RoughConductor(RoughConductor { alpha, ..Default::default() });
        for wrong in [f64::NAN, 0.0, -1.0] {
            fails(&|s| s.bsdfs[0].item = metal(wrong), "alpha");
        }
        for wrong in [f64::NAN, f64::INFINITY] {
            let light = |at: f64| Emitter::Point { position: Vec3::Z * at, intensity: Rgb::ONE };
            fails(&|s| s.emitters[0].item.emitter = light(wrong), "bulb: ");
        }
        let sun = Emitter::Directional { direction: Vec3::ZERO, irradiance: Rgb::ONE };
        fails(&|s| s.emitters[0].item.emitter = sun.clone(), "zero vector");
        fails(&|s| s.emitters[0].item.medium = Surrounding::Stated(Some(3)), "one of its media");
        let flat = |s: &mut Scene| {
            let mut mesh = (*s.shapes[0].mesh).clone();
            mesh.positions.iter_mut().for_each(|p| *p = Vec3::ZERO);
            (s.shapes[0].mesh, s.shapes[0].emitter) = (Arc::new(mesh), Some(0));
            s.emitters[0].item.emitter = Emitter::Area { radiance: Rgb::ONE };
        };
        fails(&flat, "it emits but has no area");
    }
}
