//! Stages seen through other lenses than a pinhole, and of shapes that share a mesh.

use drt_estimators::Instance;
use drt_estimators::sensor::{Aperture, Lens, Sensor, look_at};
use drt_math::{Affine, Mat3, Vec3, vec3};

use super::effects::{add, grow, raise, translate};
use super::materials::panel;
use super::set::diffuse;
use super::{Cell, Stage};
use crate::Result;

/// A thin lens, focused before the panel.
///
/// # Errors
/// When the library rejects the scene.
pub fn thin_lens() -> Result<Stage> {
    let mut scene = panel(diffuse([0.4, 0.6, 0.7]))?.scene;
    let sensor = &mut scene.sensors[0].item.sensor;
    *sensor = sensor.clone().with_aperture(Aperture { radius: 0.2, focus_distance: 2.2 })?;
    let cells = vec![
        Cell::new("radius", [raise("camera", "aperture_radius", 0.5)])
            .step(0.15)
            .samples(1024)
            .representative(),
        Cell::new("focus", [raise("camera", "focus_distance", 2.0)]).step(0.15).samples(1024),
        Cell::new("panel moves", [translate("panel", vec3(0.3, 0.5, -0.3))]),
        Cell::new("reflectance", [add("panel", "reflectance", [1.0, 0.5, -0.5])]).samples(512),
    ];
    Ok(Stage::new("thin lens", scene, cells))
}

/// A camera of parallel rays.
///
/// # Errors
/// When the library rejects the scene.
pub fn parallel_rays() -> Result<Stage> {
    let mut scene = panel(diffuse([0.4, 0.6, 0.7]))?.scene;
    let sensor = &mut scene.sensors[0].item.sensor;
    let pose = look_at(vec3(0.3, 1.2, -2.6), vec3(0.0, 0.1, 0.0), Vec3::Y)?;
    let wide = Affine { linear: pose.linear * Mat3::diagonal(vec3(1.2, 1.2, 1.0)), ..pose };
    *sensor =
        Sensor::orthographic(&wide, Lens::with_fov(45.0), sensor.film(), sensor.filter().clone())?;
    let cells = vec![
        Cell::new("panel moves", [translate("panel", vec3(0.3, 0.5, -0.3))])
            .samples(1024)
            .representative(),
        Cell::new("camera moves", [translate("camera", vec3(0.3, 0.2, 0.0))]),
    ];
    Ok(Stage::new("parallel rays", scene, cells))
}

/// A film that shows a part of the picture.
///
/// # Errors
/// When the library rejects the scene.
pub fn cropped() -> Result<Stage> {
    let mut scene = panel(diffuse([0.4, 0.6, 0.7]))?.scene;
    let sensor = &mut scene.sensors[0].item.sensor;
    let whole = [2 * sensor.film()[0], 2 * sensor.film()[1]];
    *sensor = sensor.with_film(whole)?.cropped([10, 6], sensor.film())?;
    let cells = vec![
        Cell::new("panel moves", [translate("panel", vec3(0.3, 0.5, -0.3))])
            .samples(1024)
            .representative(),
        Cell::new("field of view", [raise("camera", "fov", 30.0)]),
    ];
    Ok(Stage::new("cropped", scene, cells))
}

/// Two places of one mesh, of which one moves.
///
/// # Errors
/// When the library rejects the scene.
pub fn instances() -> Result<Stage> {
    let mut scene = panel(diffuse([0.4, 0.6, 0.7]))?.scene;
    let mut copy = scene.shapes[0].clone();
    copy.id = Some("copy".into());
    scene.shapes.push(copy);
    let linear = Mat3::rotation(Vec3::Y, 0.6) * Mat3::diagonal(vec3(0.4, 0.5, 0.6));
    let to_world = Affine { linear, translation: vec3(0.5, 0.5, -0.5) };
    scene.instances.push(Instance { shape: scene.shapes.len() - 1, to_world });
    let cells = vec![
        Cell::new("copy moves", [translate("copy", vec3(0.4, 0.2, -0.3))])
            .samples(1024)
            .representative(),
        Cell::new("panel grows", [grow("panel", vec3(0.5, 0.3, 0.4), Vec3::ZERO)]),
    ];
    Ok(Stage::new("instances", scene, cells))
}
