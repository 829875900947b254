//! Scenes put together from procedural shapes.

use std::sync::Arc;

use drt_estimators::emitter::Emitter;
use drt_estimators::filter::{Filter, FilterKind};
use drt_estimators::sensor::{Lens, Sensor};
use drt_estimators::surface::{Bsdf, Diffuse};
use drt_estimators::{
    Integrator, MediumBoundary, Named, Scene, SceneEmitter, SceneSensor, Shape, Surrounding,
};
use drt_geom::procedural::tet_grid;
use drt_geom::{Aabb, Mesh, TetMesh};
use drt_math::{Affine, Mat3, Rgb, Vec3};
use drt_medium::{Medium, MediumKind, Phase};

use crate::Result;

/// Pixels along each side of an image: two per block of the comparison.
const SIZE: u32 = 16;

/// A scene under construction. Every shape has a material of its own, which property changes reach
/// through the shape's id; the sensor is called `camera`.
#[derive(Clone, Debug)]
pub struct Set {
    /// What has been built.
    pub scene: Scene,
}

impl Set {
    /// An empty scene seen from a place towards a target, upright along y, with a tent filter.
    ///
    /// # Errors
    /// When that is no view.
    pub fn new(origin: Vec3, target: Vec3, fov: f64, depth: u32) -> Result<Self> {
        Self::upright([origin, target, drt_math::vec3(0.02, 1.0, 0.05)], fov, depth)
    }

    /// An empty scene with the y axis exactly upwards in the image, so that what is symmetrical is so there.
    ///
    /// # Errors
    /// When that is no view.
    pub fn facing(origin: Vec3, target: Vec3, fov: f64, depth: u32) -> Result<Self> {
        Self::upright([origin, target, Vec3::Y], fov, depth)
    }

    fn upright(view: [Vec3; 3], fov: f64, depth: u32) -> Result<Self> {
        let filter = Filter::new(FilterKind::TENT)?;
        let lens = Lens::with_fov(fov);
        let sensor = Sensor::look_at(view, lens, [SIZE; 2], filter)?;
        let sensor = SceneSensor { sensor, medium: Surrounding::Counted, sample_count: None };
        let integrator =
            Integrator { max_depth: Some(depth), rr_depth: depth, ..Integrator::default() };
        let sensors = vec![Named::new("camera", sensor)];
        Ok(Self { scene: Scene { sensors, integrator, ..Scene::default() } })
    }

    /// Another reconstruction filter.
    ///
    /// # Errors
    /// When there is none such.
    pub fn filter(mut self, kind: FilterKind) -> Result<Self> {
        let filter = Filter::new(kind)?;
        let sensor = &mut self.scene.sensors[0].item.sensor;
        *sensor = sensor.clone().with_filter(filter);
        Ok(self)
    }

    /// A body or sheet.
    #[must_use]
    pub fn shape(mut self, id: &str, mesh: Mesh, bsdf: Bsdf) -> Self {
        self.push(id, mesh, bsdf, None, None);
        self
    }

    /// The border between two media, crossed unchanged; `None` is vacuum.
    #[must_use]
    pub fn interface(self, id: &str, mesh: Mesh, inside: &str, outside: Option<&str>) -> Self {
        self.filled(id, mesh, Bsdf::Null, inside, outside)
    }

    /// A body with a medium behind its surface, and one before it.
    #[must_use]
    pub fn filled(
        mut self,
        id: &str,
        mesh: Mesh,
        bsdf: Bsdf,
        inside: &str,
        outside: Option<&str>,
    ) -> Self {
        let medium = |id: &str| self.scene.media.iter().position(|m| m.id.as_deref() == Some(id));
        let boundary =
            MediumBoundary { interior: medium(inside), exterior: outside.and_then(medium) };
        self.push(id, mesh, bsdf, Some(boundary), None);
        self
    }

    /// A black shape that glows on its front.
    #[must_use]
    pub fn lamp(mut self, id: &str, mesh: Mesh, radiance: Rgb) -> Self {
        let emitter = self.scene.emitters.len();
        self.scene.emitters.push(Named::anonymous(emitting(Emitter::Area { radiance })));
        self.push(id, mesh, diffuse([0.0; 3]), None, Some(emitter));
        self
    }

    /// A light without a shape.
    #[must_use]
    pub fn light(mut self, id: &str, emitter: Emitter) -> Self {
        self.scene.emitters.push(Named::new(id, emitting(emitter)));
        self
    }

    /// A medium, to be placed by interfaces named after it.
    #[must_use]
    pub fn medium(mut self, id: &str, kind: impl Into<MediumKind>, phase: Phase) -> Self {
        self.scene.media.push(Named::new(id, Medium::new(kind, phase)));
        self
    }

    fn push(
        &mut self,
        id: &str,
        mesh: Mesh,
        bsdf: Bsdf,
        boundary: Option<MediumBoundary>,
        emitter: Option<usize>,
    ) {
        self.scene.bsdfs.push(Named::anonymous(bsdf));
        let (id, mesh, bsdf) = (Some(id.into()), Arc::new(mesh), self.scene.bsdfs.len() - 1);
        self.scene.shapes.push(Shape { id, mesh, bsdf, boundary, emitter });
    }
}

/// An emitter in whatever medium lies around it.
pub(super) fn emitting(emitter: Emitter) -> SceneEmitter {
    SceneEmitter { emitter, medium: Surrounding::Counted }
}

/// A Lambertian reflector.
#[must_use]
pub(crate) fn diffuse(reflectance: [f64; 3]) -> Bsdf {
    Bsdf::Diffuse(Diffuse { reflectance: reflectance.into() })
}

/// A mesh stretched along the axes, turned about an axis, and put at a place, in this order.
#[must_use]
pub(crate) fn placed(mesh: &Mesh, size: Vec3, axis: Vec3, angle: f64, at: Vec3) -> Mesh {
    let linear = Mat3::rotation(axis.normalize(), angle) * Mat3::diagonal(size);
    mesh.transform(&Affine { linear, translation: at })
}

/// A mesh stretched along the axes and put at a place.
#[must_use]
pub(crate) fn at(mesh: &Mesh, size: Vec3, place: Vec3) -> Mesh {
    placed(mesh, size, Vec3::X, 0.0, place)
}

/// The mesh with its normals turned over.
#[must_use]
pub(crate) fn inside_out(mut mesh: Mesh) -> Mesh {
    mesh.flip();
    mesh
}

/// The box from `-half` to `half` with its faces cut into cells.
///
/// # Panics
/// When a side has no cells.
#[must_use]
pub(crate) fn block(cells: [u32; 3], half: Vec3) -> Mesh {
    let tets = tet_grid(cells, &Aabb { min: -half, max: half });
    let neighbours = tets.neighbours().expect("cells share their faces");
    let faces = TetMesh::boundary_faces(&neighbours).map(|(tet, k)| tets.face(tet, k));
    Mesh::new(tets.positions.clone(), faces.collect()).expect("a box has a surface")
}
