//! A builder of scenes whose elements refer to each other by names.

use alloc::string::String;
use alloc::sync::Arc;
use alloc::vec::Vec;

use drt_geom::Mesh;
use drt_math::Affine;
use drt_medium::Medium;

use crate::model::emitter::Emitter;
use crate::model::error::{ElementError, Error};
use crate::model::scene::{
    Instance, Integrator, MediumBoundary, Named, Scene, SceneEmitter, SceneSensor, Shape,
    Surrounding,
};
use crate::model::sensor::Sensor;
use crate::model::surface::Bsdf;

/// Puts a [`Scene`] together: elements are added in any order and refer to each other by their ids, which
/// [`build`](Self::build) looks up.
///
/// ```
/// use drt_estimators::emitter::Emitter;
/// use drt_estimators::filter::{Filter, FilterKind};
/// use drt_estimators::sensor::{Lens, Sensor};
/// use drt_estimators::surface::{Bsdf, Diffuse};
/// use drt_estimators::{SceneBuilder, ShapeBuilder};
/// use drt_math::{Rgb, vec3};
/// use drt_medium::{Homogeneous, Medium, Phase};
///
/// let fog = Homogeneous::new(Rgb::splat(0.4), Rgb::splat(0.9), Rgb::ZERO)?;
/// let view = [vec3(0.0, -6.0, 1.0), vec3(0.0, 0.0, 0.0), vec3(0.0, 0.0, 1.0)];
/// let filter = Filter::new(FilterKind::TENT)?;
/// let grey = Bsdf::Diffuse(Diffuse { reflectance: Rgb::splat(0.5) });
/// let scene = SceneBuilder::new()
///     .medium("fog", Medium::new(fog, Phase::Isotropic))
///     .shape("walls", ShapeBuilder::interface(drt_geom::procedural::cube()).interior("fog"))
///     .shape("floor", ShapeBuilder::new(drt_geom::procedural::rectangle(), grey))
///     .emitter("sky", Emitter::Constant { radiance: Rgb::ONE })
///     .sensor("camera", Sensor::look_at(view, Lens::with_fov(45.0), [32, 32], filter)?)
///     .max_depth(6)
///     .build()?;
/// assert_eq!(scene.shapes.len(), 2);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug, Default)]
#[must_use]
pub struct SceneBuilder {
    shapes: Vec<(String, ShapeBuilder)>,
    bsdfs: Vec<Named<Bsdf>>,
    media: Vec<Named<Medium>>,
    emitters: Vec<Named<SceneEmitter>>,
    sensors: Vec<Named<SceneSensor>>,
    integrator: Integrator,
}

/// A shape of a [`SceneBuilder`]: a mesh, how its surface scatters, the media on its two sides, and what it emits.
#[derive(Clone, Debug)]
#[must_use]
pub struct ShapeBuilder {
    mesh: Arc<Mesh>,
    bsdf: SurfaceModel,
    interior: Option<String>,
    exterior: Option<String>,
    emitter: Option<Emitter>,
    to_world: Option<Affine>,
}

/// How a surface scatters.
#[derive(Clone, Debug)]
enum SurfaceModel {
    Own(Bsdf),
    Shared(String),
}

impl ShapeBuilder {
    /// A shape with a BSDF of its own, which effects on the shape's id change.
    pub fn new(mesh: impl Into<Arc<Mesh>>, bsdf: Bsdf) -> Self {
        Self::with(mesh.into(), SurfaceModel::Own(bsdf))
    }

    /// A shape with the BSDF of an id, which many shapes can share.
    pub fn sharing(mesh: impl Into<Arc<Mesh>>, bsdf: impl Into<String>) -> Self {
        Self::with(mesh.into(), SurfaceModel::Shared(bsdf.into()))
    }

    /// A null interface: the boundary of a medium, which rays cross unchanged.
    pub fn interface(mesh: impl Into<Arc<Mesh>>) -> Self {
        Self::new(mesh, Bsdf::Null)
    }

    fn with(mesh: Arc<Mesh>, bsdf: SurfaceModel) -> Self {
        Self { mesh, bsdf, interior: None, exterior: None, emitter: None, to_world: None }
    }

    /// Puts the medium of an id behind the surface. If only an exterior is given, vacuum is behind it.
    pub fn interior(self, medium: impl Into<String>) -> Self {
        Self { interior: Some(medium.into()), ..self }
    }

    /// Puts the medium of an id in front of the surface. If only an interior is given, vacuum is in front of it.
    pub fn exterior(self, medium: impl Into<String>) -> Self {
        Self { exterior: Some(medium.into()), ..self }
    }

    /// Lets the front of the surface emit. The emitter has to be an area emitter.
    pub fn emitter(self, emitter: Emitter) -> Self {
        Self { emitter: Some(emitter), ..self }
    }

    /// Makes the shape an instance, whose mesh is in a space of its own; this map takes that space to the world.
    pub fn to_world(self, map: Affine) -> Self {
        Self { to_world: Some(map), ..self }
    }
}

impl SceneBuilder {
    /// An empty scene.
    pub fn new() -> Self {
        Self::default()
    }

    /// Adds a shape.
    pub fn shape(mut self, id: impl Into<String>, shape: ShapeBuilder) -> Self {
        self.shapes.push((id.into(), shape));
        self
    }

    /// Adds a BSDF, for shapes to [share](ShapeBuilder::sharing).
    pub fn bsdf(mut self, id: impl Into<String>, bsdf: Bsdf) -> Self {
        self.bsdfs.push(Named::new(id, bsdf));
        self
    }

    /// Adds a medium, for shapes to have on their sides.
    pub fn medium(mut self, id: impl Into<String>, medium: Medium) -> Self {
        self.media.push(Named::new(id, medium));
        self
    }

    /// Adds an emitter without a shape. Its medium is found from the interfaces around it.
    pub fn emitter(mut self, id: impl Into<String>, emitter: Emitter) -> Self {
        self.emitters.push(Named::new(id, counted(emitter)));
        self
    }

    /// Adds a sensor with its film. Its medium is found from the interfaces around it.
    pub fn sensor(mut self, id: impl Into<String>, sensor: Sensor) -> Self {
        let sensor = SceneSensor { sensor, medium: Surrounding::Counted, sample_count: None };
        self.sensors.push(Named::new(id, sensor));
        self
    }

    /// Limits the depth of paths: 1 shows emitters only, and each scattering adds one.
    pub fn max_depth(mut self, depth: u32) -> Self {
        self.integrator.max_depth = Some(depth);
        self
    }

    /// Sets the depth of paths, and where Russian roulette begins.
    pub fn integrator(self, integrator: Integrator) -> Self {
        Self { integrator, ..self }
    }

    /// Looks up the ids, and [checks](Scene::check) the scene.
    ///
    /// # Errors
    /// When two elements have the same id, a shape names what does not exist, or an element is unusable.
    pub fn build(self) -> Result<Scene, Error> {
        let Self { shapes, bsdfs, media, emitters, sensors, integrator } = self;
        let mut scene = Scene { bsdfs, media, sensors, integrator, ..Scene::default() };
        // The emitters of shapes come first: what others there are does not change their indices.
        for (id, shape) in shapes {
            add(&mut scene, id, shape)?;
        }
        scene.emitters.extend(emitters);
        refuse_same_ids(&scene)?;
        scene.check()?;
        Ok(scene)
    }
}

fn counted(emitter: Emitter) -> SceneEmitter {
    SceneEmitter { emitter, medium: Surrounding::Counted }
}

fn add(scene: &mut Scene, id: String, shape: ShapeBuilder) -> Result<(), Error> {
    let ShapeBuilder { mesh, bsdf, interior, exterior, emitter, to_world } = shape;
    let medium = |name: Option<String>| {
        name.map(|name| position(&scene.media, &id, "medium", &name)).transpose()
    };
    let [interior, exterior] = [medium(interior)?, medium(exterior)?];
    let sides = MediumBoundary { interior, exterior };
    let boundary = (sides != MediumBoundary::default()).then_some(sides);
    let bsdf = match bsdf {
        SurfaceModel::Shared(name) => position(&scene.bsdfs, &id, "BSDF", &name)?,
        SurfaceModel::Own(bsdf) => {
            scene.bsdfs.push(Named::anonymous(bsdf));
            scene.bsdfs.len() - 1
        }
    };
    let emitter = emitter.map(|emitter| {
        scene.emitters.push(Named::anonymous(counted(emitter)));
        scene.emitters.len() - 1
    });
    let index = scene.shapes.len();
    scene.instances.extend(to_world.map(|to_world| Instance { shape: index, to_world }));
    scene.shapes.push(Shape { id: Some(id), mesh, bsdf, boundary, emitter });
    Ok(())
}

/// Where among the elements of a kind the one is that a shape names.
fn position<T>(
    all: &[Named<T>],
    shape: &str,
    kind: &'static str,
    name: &str,
) -> Result<usize, Error> {
    all.iter().position(|e| e.id.as_deref() == Some(name)).ok_or_else(|| {
        let known = all.iter().filter_map(|e| e.id.clone()).collect();
        let reason = ElementError::UnknownPart { kind, name: name.into(), known };
        Error::Element { element: shape.into(), reason }
    })
}

fn refuse_same_ids(scene: &Scene) -> Result<(), Error> {
    let mut ids: Vec<&str> = scene.named().filter_map(|(id, _)| id).collect();
    ids.sort_unstable();
    match ids.windows(2).find(|pair| pair[0] == pair[1]) {
        None => Ok(()),
        Some(pair) => Err(Error::Element { element: pair[0].into(), reason: ElementError::SameId }),
    }
}

#[cfg(test)]
mod tests {
    use drt_geom::procedural::{cube, rectangle};
    use drt_math::{Mat3, Rgb, Vec3};
    use drt_medium::{Homogeneous, Phase};

    use super::*;
    use crate::model::surface::Diffuse;

    fn grey() -> Bsdf {
        Bsdf::Diffuse(Diffuse { reflectance: Rgb::splat(0.5) })
    }

    fn fog() -> Medium {
        let fog = Homogeneous::new(Rgb::ONE, Rgb::splat(0.5), Rgb::ZERO).expect("a medium");
        Medium::new(fog, Phase::Isotropic)
    }

    #[test]
    fn names_become_indices() {
        let glow = Emitter::Area { radiance: Rgb::ONE };
        let scene = SceneBuilder::new()
            .shape("room", ShapeBuilder::interface(cube()).interior("fog"))
            .shape("card", ShapeBuilder::sharing(rectangle(), "grey").exterior("fog"))
            .shape("lamp", ShapeBuilder::new(rectangle(), grey()).emitter(glow))
            .shape("copy", ShapeBuilder::new(cube(), grey()).to_world(Affine::IDENTITY))
            .bsdf("grey", grey())
            .medium("mist", fog())
            .medium("fog", fog())
            .emitter("sky", Emitter::Constant { radiance: Rgb::ONE })
            .max_depth(4)
            .build()
            .expect("a scene");
        let boundary = |interior, exterior| Some(MediumBoundary { interior, exterior });
        let found: Vec<_> = scene.shapes.iter().map(|s| (s.bsdf, s.boundary, s.emitter)).collect();
        assert_eq!(found[0], (1, boundary(Some(1), None), None));
        assert_eq!(found[1], (0, boundary(None, Some(1)), None));
        assert_eq!(found[2], (2, None, Some(0)));
        assert_eq!(scene.instances, [Instance { shape: 3, to_world: Affine::IDENTITY }]);
        assert_eq!(scene.integrator.max_depth, Some(4));
    }

    #[test]
    fn errors_name_what_is_wrong() {
        let sheet = || ShapeBuilder::new(rectangle(), grey());
        let flat = Affine { linear: Mat3::diagonal(Vec3::X), translation: Vec3::ZERO };
        let point = Emitter::Point { position: Vec3::ZERO, intensity: Rgb::ONE };
        let cases: [(SceneBuilder, &[&str]); 5] = [
            (
                SceneBuilder::new().medium("fog", fog()).shape("card", sheet().interior("mist")),
                &["card", "no medium is called `mist`", "fog"],
            ),
            (
                SceneBuilder::new().shape("card", ShapeBuilder::sharing(rectangle(), "white")),
                &["card", "no BSDF is called `white`", "none"],
            ),
            (
                SceneBuilder::new().medium("card", fog()).shape("card", sheet()),
                &["card", "another element has the same id"],
            ),
            (
                SceneBuilder::new().shape("card", sheet().emitter(point)),
                &["card", "only those of type `area` belong on shapes"],
            ),
            (SceneBuilder::new().shape("card", sheet().to_world(flat)), &["card", "flattens"]),
        ];
        for (builder, words) in cases {
            let message = alloc::format!("{}", builder.build().expect_err("a fault"));
            assert!(words.iter().all(|word| message.contains(word)), "{message}");
        }
    }
}
