//! What the shape of a group has become, seen from all around.

use std::f64::consts::TAU;

use drt_estimators::emitter::Emitter;
use drt_estimators::filter::{Filter, FilterKind};
use drt_estimators::sensor::{Lens, Sensor};
use drt_estimators::surface::{Bsdf, Diffuse, TwoSided};
use drt_estimators::{SceneBuilder, Session, Settings, ShapeBuilder, Unattended};
use drt_geom::Mesh;
use drt_math::{Rgb, Vec3};

/// Pictures around the shape.
const TURNS: u32 = 6;
/// The sides of one of them, in pixels.
const SIZE: u32 = 112;
/// Samples of each pixel.
const SPP: u32 = 4;
/// The field of view, in degrees.
const FOV: f64 = 30.0;

/// Rows of pictures of meshes, one mesh a row and the first on top: by a lamp beside a camera that turns about the axis of the
/// coordinates that `up` is nearest to. They are seen from where all of them are in view as a whole. Width and height are in
/// pixels, and pixels go row by row; nothing for what cannot be shown, such as a mesh without extent.
pub(super) fn turning(meshes: &[&Mesh], up: Vec3) -> Option<([u32; 2], Vec<Rgb>)> {
    let bounds = meshes.iter().map(|mesh| mesh.bounds()).reduce(|all, one| all.union(&one))?;
    let (middle, radius) = (bounds.center(), 0.5 * bounds.extent().length());
    let up = nearest_axis(up);
    let aside = if up.x == 0.0 { Vec3::X } else { Vec3::Z };
    let distance = radius / (0.5 * FOV.to_radians()).sin();
    let size = [TURNS * SIZE, meshes.len() as u32 * SIZE];
    let mut pixels = vec![Rgb::ZERO; (size[0] * size[1]) as usize];
    for (row, mesh) in meshes.iter().enumerate() {
        for turn in 0..TURNS {
            let (sin, cos) = (TAU * f64::from(turn) / f64::from(TURNS)).sin_cos();
            let level = aside * cos + up.cross(aside) * sin;
            let away = (level + up * 0.35).normalize();
            let tile = tile(mesh, middle, middle + away * distance, up)?;
            for (k, pixel) in tile.into_iter().enumerate() {
                let (x, y) = (k as u32 % SIZE + turn * SIZE, k as u32 / SIZE + row as u32 * SIZE);
                pixels[(y * size[0] + x) as usize] = pixel;
            }
        }
    }
    Some((size, pixels))
}

fn nearest_axis(up: Vec3) -> Vec3 {
    let along = |axis: Vec3| axis.dot(up);
    [Vec3::X, Vec3::Y, Vec3::Z, -Vec3::X, -Vec3::Y, -Vec3::Z]
        .into_iter()
        .max_by(|a, b| along(*a).total_cmp(&along(*b)))
        .unwrap_or(Vec3::Y)
}

fn tile(mesh: &Mesh, middle: Vec3, eye: Vec3, up: Vec3) -> Option<Vec<Rgb>> {
    let forward = (middle - eye).normalize();
    let lamp = forward + up.cross(forward) * 0.5 - up * 0.5;
    let filter = Filter::new(FilterKind::BOX).ok()?;
    let sensor = Sensor::look_at([eye, middle, up], Lens::with_fov(FOV), [SIZE; 2], filter).ok()?;
    let clay = Bsdf::Diffuse(Diffuse { reflectance: Rgb::new(0.75, 0.7, 0.65) });
    let scene = SceneBuilder::new()
        .shape(
            "shape",
            ShapeBuilder::new(
                mesh.clone(),
                Bsdf::TwoSided(Box::new(TwoSided { front: clay, back: None })),
            ),
        )
        .emitter("lamp", Emitter::Directional { direction: lamp, irradiance: Rgb::splat(3.0) })
        .emitter("sky", Emitter::Constant { radiance: Rgb::splat(0.15) })
        .sensor("camera", sensor)
        .max_depth(2)
        .build()
        .ok()?;
    let mut session = Session::new(&scene, &[], &Settings::default()).ok()?;
    session.run(SPP, &Unattended);
    Some(session.rendering().image.pixels.iter().map(|p| p.mean).collect())
}

#[cfg(test)]
mod tests {
    use drt_math::{Affine, Mat3, vec3};

    use super::*;

    #[test]
    fn a_sheet_is_broad_from_above_one_side_and_narrow_from_the_other() {
        let sheet = drt_geom::procedural::rectangle();
        let (size, pixels) = turning(&[&sheet, &sheet], vec3(0.1, 0.9, -0.3)).unwrap();
        assert_eq!(size, [TURNS * SIZE, 2 * SIZE]);
        // The sheet is upright, in the plane of x and y, and the camera begins on the axis of x.
        let seen = |pixels: &[Rgb], row: u32, turn: u32, k: u32| {
            let (x, y) = (k % SIZE + turn * SIZE, k / SIZE + row * SIZE);
            (pixels[(y * size[0] + x) as usize].r - 0.15).abs() > 0.02
        };
        let lit =
            |row: u32, turn: u32| (0..SIZE * SIZE).filter(|k| seen(&pixels, row, turn, *k)).count();
        assert!(lit(0, 1) > 4 * lit(0, 0), "{} {}", lit(0, 1), lit(0, 0));
        assert_eq!(lit(0, 2), lit(1, 2));
        // One that has grown is in view as a whole, too.
        let fifth = Affine { linear: Mat3::IDENTITY * 0.2, translation: Vec3::ZERO };
        let small = sheet.transform(&fifth);
        let (_, grown) = turning(&[&small, &sheet], Vec3::Y).unwrap();
        let border = |k: u32| [k % SIZE, k / SIZE].iter().any(|c| *c == 0 || *c == SIZE - 1);
        let at_border: Vec<u32> = (0..SIZE * SIZE).filter(|k| border(*k)).collect();
        assert!(!(0..TURNS).any(|turn| at_border.iter().any(|k| seen(&grown, 1, turn, *k))));
        assert_eq!(nearest_axis(vec3(0.1, 0.2, -0.3)), -Vec3::Z);
    }
}
