//! Stages of smooth surfaces, masks, and maps of normals and heights, in which numbers change and nothing moves.

use std::f64::consts::{FRAC_PI_2, PI};

use drt_estimators::emitter::Emitter;
use drt_estimators::surface::{
    Blend, Bsdf, Coating, Conductor, Dielectric, Mask, Perturbation, Perturbed, Plastic,
    RoughConductor, ThinDielectric,
};
use drt_estimators::texture::{Bitmap, Texture};
use drt_geom::Mesh;
use drt_geom::procedural::{rectangle, uv_sphere};
use drt_math::{Rgb, Vec3, vec3};
use drt_medium::{Homogeneous, Phase};

use super::effects::{add, raise};
use super::materials::with_coordinates;
use super::set::{at, diffuse, placed};
use super::{Cell, Set, Stage};
use crate::Result;

fn sheet(size: [f64; 2], angle: f64, place: Vec3) -> Result<Mesh> {
    let size = vec3(size[0], size[1], 1.0);
    Ok(placed(&with_coordinates(&rectangle())?, size, Vec3::X, angle, place))
}

fn ball(radius: f64, place: Vec3) -> Mesh {
    at(&uv_sphere(12), Vec3::splat(radius), place)
}

/// A room with a lamp, seen from one side.
fn room(lamp: [f64; 2]) -> Result<Set> {
    Ok(Set::new(vec3(0.2, 1.0, -3.2), vec3(0.0, 0.5, 0.0), 44.0, 6)?
        .shape("wall", sheet([2.0, 1.5], PI, vec3(0.0, 0.8, 1.2))?, diffuse([0.6, 0.5, 0.3]))
        .shape("floor", sheet([2.0, 2.0], -FRAC_PI_2, vec3(0.0, -0.5, 0.0))?, diffuse([0.4; 3]))
        .lamp("lamp", sheet(lamp, FRAC_PI_2, vec3(-0.2, 2.2, 0.0))?, Rgb::new(6.0, 5.0, 4.0)))
}

fn number(target: &str, property: &str, by: f64) -> Cell {
    Cell::new(&format!("{target}, {property}"), [raise(target, property, by)]).samples(1024)
}

fn colour(target: &str, property: &str, by: [f64; 3]) -> Cell {
    Cell::new(&format!("{target}, {property}"), [add(target, property, by)]).samples(1024)
}

/// Mirrors, glass with a dye, a pane, varnish.
///
/// # Errors
/// When the library rejects the scene.
pub fn mirrors() -> Result<Stage> {
    let silver = Conductor {
        eta: Rgb::new(0.4, 0.6, 0.9),
        k: Rgb::new(2.8, 2.3, 1.7),
        specular_reflectance: Rgb::splat(0.9),
    };
    let glass = Dielectric { eta: 1.5, ..Dielectric::default() };
    let pane = ThinDielectric { eta: 1.6, ..ThinDielectric::default() };
    let coin = Blend { bsdfs: [Bsdf::Conductor(silver), diffuse([0.7, 0.3, 0.1])], weight: 0.4 };
    let varnish = Plastic::new(Coating::smooth(1.6)?);
    let dye = Homogeneous::new(Rgb::new(0.6, 1.2, 2.0), Rgb::ZERO, Rgb::ZERO)?;
    let scene = room([0.9, 0.9])?
        .medium("dye", dye, Phase::Isotropic)
        .shape(
            "mirror",
            sheet([0.7, 0.7], PI - 0.3, vec3(-0.7, 0.3, 0.9))?,
            Bsdf::Conductor(silver),
        )
        .shape("coin", sheet([0.5, 0.4], PI - 0.6, vec3(0.9, -0.1, 0.4))?, Bsdf::Blend(coin.into()))
        .filled("glass", ball(0.45, vec3(0.1, 0.4, -0.2)), Bsdf::Dielectric(glass), "dye", None)
        .shape("pane", sheet([0.3, 0.5], 0.4, vec3(0.6, 0.7, -1.2))?, Bsdf::ThinDielectric(pane))
        .shape("bowl", ball(0.4, vec3(-0.5, -0.3, -0.4)), Bsdf::Plastic(varnish))
        .scene;
    let cells = vec![
        colour("wall", "reflectance", [1.0, 0.5, -0.5]).representative(),
        colour("lamp", "radiance", [1.0, 2.0, 3.0]),
        colour("mirror", "specular_reflectance", [1.0, 0.5, -0.5]).representative(),
        colour("mirror", "eta", [1.0, 0.5, -0.5]),
        colour("mirror", "k", [1.0, 0.5, -0.5]),
        number("coin", "weight", 1.0),
        colour("glass", "specular_reflectance", [1.0, 0.5, -0.5]),
        colour("glass", "specular_transmittance", [-1.0, -0.5, 0.5]).representative(),
        Cell::new("dye", [add("dye", "sigma_t", [1.0, 0.5, -0.5])]).samples(1024),
        number("pane", "eta", 1.0).representative(),
        colour("pane", "specular_transmittance", [-1.0, -0.5, 0.5]),
        colour("bowl", "reflectance", [1.0, 0.5, -0.5]),
        colour("bowl", "specular_reflectance", [1.0, 0.5, -0.5]).representative(),
    ];
    Ok(Stage::new("mirrors", scene, cells))
}

/// A card that is there in part, a pane and plates with maps, under a point and a lamp.
///
/// # Errors
/// When the library rejects the scene.
pub fn veiled() -> Result<Stage> {
    let map = |texels: [[f32; 3]; 4]| -> Result<Texture> {
        Ok(Texture::Bitmap(Bitmap::new([2, 2], texels.to_vec())?))
    };
    let normals = map([[0.6, 0.5, 0.9], [0.4, 0.7, 0.9], [0.5, 0.3, 1.0], [0.3, 0.5, 0.9]])?;
    let heights = map([[0.1; 3], [0.5; 3], [0.3; 3], [0.0; 3]])?;
    let perturbed = |bsdf, map, perturbation| {
        Bsdf::Perturbed(Box::new(Perturbed {
            bsdf,
            map,
            perturbation,
            flip_invalid_normals: true,
            use_shadowing_function: true,
        }))
    };
    let metal = RoughConductor { alpha: 0.3, ..RoughConductor::default() };
    let card = Mask { bsdf: diffuse([0.7, 0.4, 0.2]), opacity: 0.4 };
    let light =
        Emitter::Point { position: vec3(0.5, 1.9, -0.6), intensity: Rgb::new(2.0, 2.5, 3.0) };
    let pane = ThinDielectric { eta: 1.8, ..ThinDielectric::default() };
    let plate = perturbed(Bsdf::RoughConductor(metal), normals, Perturbation::Normals);
    let relief = perturbed(diffuse([0.5, 0.6, 0.3]), heights, Perturbation::Heights(0.3));
    let scene = room([0.4, 0.4])?
        .light("point", light)
        .shape(
            "card",
            sheet([0.5, 0.5], FRAC_PI_2 + 0.3, vec3(0.3, 0.8, -0.2))?,
            Bsdf::Mask(card.into()),
        )
        .shape(
            "pane",
            sheet([0.6, 0.4], FRAC_PI_2 - 0.4, vec3(0.8, 1.2, -0.3))?,
            Bsdf::ThinDielectric(pane),
        )
        .shape("plate", sheet([0.6, 0.5], PI - 0.4, vec3(-0.8, 0.4, 0.8))?, plate)
        .shape("relief", sheet([0.6, 0.5], PI - 0.4, vec3(0.7, 0.2, 0.8))?, relief)
        .scene;
    let cells = vec![
        colour("floor", "reflectance", [1.0, 0.5, -0.5]),
        Cell::new("intensity", [add("point", "intensity", [1.0, 2.0, 3.0])]).samples(1024),
        number("card", "opacity", 1.0).representative(),
        colour("card", "reflectance", [1.0, 0.5, -0.5]),
        number("pane", "eta", 1.0).representative(),
        colour("pane", "specular_transmittance", [-1.0, -0.5, 0.5]),
        number("plate", "alpha", 1.0),
        colour("plate", "specular_reflectance", [1.0, 0.5, -0.5]).representative(),
        colour("relief", "reflectance", [1.0, 0.5, -0.5]).representative(),
    ];
    Ok(Stage::new("veiled", scene, cells))
}
