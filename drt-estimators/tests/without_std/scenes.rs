//! Scenes in code.

use drt_estimators::emitter::Emitter;
use drt_estimators::filter::{Filter, FilterKind};
use drt_estimators::sensor::{Lens, Sensor};
use drt_estimators::surface::{Bsdf, Diffuse};
use drt_estimators::{Scene, SceneBuilder, ShapeBuilder};
use drt_geom::Mesh;
use drt_math::{Affine, Mat3, Rgb, Vec3};
use drt_motion::{GeometryChange, Parameter, PropertyChange, ValueChange};

/// The scene of a builder, as a sensor sees it.
pub(crate) fn seen(scene: SceneBuilder, sensor: Sensor) -> Scene {
    scene.sensor("sensor", sensor).build().expect("a valid scene")
}

pub(crate) fn diffuse(mesh: Mesh, reflectance: f64) -> ShapeBuilder {
    ShapeBuilder::new(mesh, Bsdf::Diffuse(Diffuse { reflectance: Rgb::splat(reflectance) }))
}

pub(crate) fn glowing(mesh: Mesh, radiance: f64) -> ShapeBuilder {
    diffuse(mesh, 0.0).emitter(Emitter::Area { radiance: Rgb::splat(radiance) })
}

pub(crate) fn triangle(corners: [[f64; 3]; 3]) -> Mesh {
    Mesh::new(corners.map(Vec3::from).into(), vec![[0, 1, 2]]).expect("a valid mesh")
}

pub(crate) fn quad(corners: [[f64; 3]; 4]) -> Mesh {
    Mesh::new(corners.map(Vec3::from).into(), vec![[0, 1, 2], [0, 2, 3]]).expect("a valid mesh")
}

/// A camera with one pixel under a tent that reaches `half_width` in the image plane at distance
/// one, around the image point `center`.
pub(crate) fn pixel(
    position: [f64; 3],
    [right, up, forward]: [[f64; 3]; 3],
    center: [f64; 2],
    half_width: f64,
) -> Sensor {
    let mut lens = Lens::with_fov(2.0 * (0.5 * half_width).atan().to_degrees());
    lens.principal_point_offset = [center[0] / half_width, -center[1] / half_width];
    let cols = [-Vec3::from(right), Vec3::from(up), Vec3::from(forward)];
    let to_world = Affine { linear: Mat3 { cols }, translation: Vec3::from(position) };
    let filter = Filter::new(FilterKind::TENT).expect("a valid filter");
    Sensor::from_to_world(&to_world, lens, [1, 1], filter).expect("a valid camera")
}

pub(crate) fn moves(name: &str, target: &str, velocity: [f64; 3]) -> Parameter {
    let change = GeometryChange::Translate(Vec3::from(velocity));
    Parameter::new(name).effect(target, change)
}

pub(crate) fn deforms(name: &str, target: &str, velocities: &[[f64; 3]]) -> Parameter {
    let velocities: Vec<_> = velocities.iter().copied().map(Vec3::from).collect();
    let change = GeometryChange::VertexVelocity(velocities.into());
    Parameter::new(name).effect(target, change)
}

pub(crate) fn grows(name: &str, target: &str, property: &str) -> Parameter {
    let op = ValueChange::Add(Rgb::splat(1.0));
    Parameter::new(name).effect(target, PropertyChange::new(property, op))
}
