//! Stages in which things move that are seen in mirrors, through glass, panes and masks, and these move, too.

use std::f64::consts::FRAC_PI_2;

use drt_estimators::surface::{
    Bsdf, Coating, Conductor, Dielectric, Mask, Plastic, Property, Textured, ThinDielectric,
};
use drt_estimators::texture::Texture;
use drt_geom::Mesh;
use drt_geom::procedural::{cube, icosphere, rectangle};
use drt_math::{Rgb, Vec3, vec3};

use super::deforming::sky;
use super::effects::{grow, raise, translate, turn};
use super::materials::with_coordinates;
use super::set::{at, diffuse, placed};
use super::textures::squares;
use super::{Cell, Set, Stage};
use crate::Result;

/// The half step of finite differences: what is seen past curved glass moves fast.
const STEP: f64 = 0.02;

fn silver() -> Bsdf {
    Bsdf::Conductor(Conductor {
        eta: Rgb::new(0.4, 0.6, 0.9),
        k: Rgb::new(2.8, 2.3, 1.7),
        specular_reflectance: Rgb::splat(0.9),
    })
}

fn glass() -> Bsdf {
    Bsdf::Dielectric(Dielectric { eta: 1.5, ..Dielectric::default() })
}

fn block(size: f64, place: Vec3) -> Mesh {
    placed(&cube(), Vec3::splat(size), vec3(0.4, 1.0, 0.2), 0.6, place)
}

fn panel(size: [f64; 2], angle: f64, place: Vec3) -> Mesh {
    placed(&rectangle(), vec3(size[0], size[1], 1.0), Vec3::Y, angle, place)
}

fn floor(bsdf: Bsdf, set: Set) -> Set {
    let mesh = placed(&rectangle(), vec3(4.0, 4.0, 1.0), Vec3::X, -FRAC_PI_2, vec3(0.0, -0.9, 0.0));
    set.shape("floor", mesh, bsdf)
}

/// An even sky, and what stands under it as the camera sees it.
fn under_a_sky(eye: Vec3, target: Vec3, depth: u32) -> Result<Set> {
    Ok(Set::new(eye, target, 42.0, depth)?.light("sky", sky()))
}

/// The block, what it is seen past, and the camera.
fn moving(past: &str, pivot: Vec3) -> Vec<Cell> {
    let cell = |name: &str, effect| Cell::new(name, [effect]).step(STEP);
    vec![
        cell("block moves", translate("block", vec3(0.5, 0.3, 0.2))).representative(),
        cell("what it is seen past turns", turn(past, vec3(0.3, 0.8, 0.1), pivot)).representative(),
        cell("what it is seen past moves", translate(past, vec3(0.2, -0.3, 0.5))),
        cell("camera turns", turn("camera", vec3(0.1, 0.9, 0.3), Vec3::ZERO)),
    ]
}

fn stage(name: &'static str, set: Set, cells: Vec<Cell>) -> Stage {
    Stage { samples: 1024, ..Stage::new(name, set.scene, cells) }
}

/// A block that is seen beside a mirror and in it.
///
/// # Errors
/// When the library rejects the scene.
pub fn mirror() -> Result<Stage> {
    let pivot = vec3(0.0, 0.3, -2.0);
    let set = under_a_sky(vec3(0.6, 0.8, 3.5), vec3(0.0, 0.0, -1.0), 3)?
        .shape("block", block(0.5, vec3(1.2, 0.0, 0.4)), diffuse([0.8, 0.3, 0.2]))
        .shape("mirror", panel([1.6, 1.6], 0.26, pivot), silver());
    Ok(stage("mirror", set, moving("mirror", pivot)))
}

/// A block that is seen over a varnished floor and in it.
///
/// # Errors
/// When the library rejects the scene.
pub fn varnish() -> Result<Stage> {
    let varnish =
        Plastic { reflectance: Rgb::new(0.3, 0.4, 0.2), ..Plastic::new(Coating::smooth(1.9)?) };
    let set = under_a_sky(vec3(0.6, 0.8, 3.5), vec3(0.0, 0.0, -1.0), 3)?.shape(
        "block",
        block(0.5, vec3(0.2, 0.0, 0.4)),
        diffuse([0.8, 0.3, 0.2]),
    );
    let set = floor(Bsdf::Plastic(varnish), set);
    Ok(stage("varnish", set, moving("floor", vec3(0.0, -0.9, 0.0))))
}

/// A block behind a pane, and one behind a veil that is half opaque.
///
/// # Errors
/// When the library rejects the scene.
pub fn panes() -> Result<Stage> {
    let pane = Bsdf::ThinDielectric(ThinDielectric { eta: 1.6, ..ThinDielectric::default() });
    let veil = Bsdf::Mask(Mask { bsdf: diffuse([0.3, 0.7, 0.2]), opacity: 0.4 }.into());
    let place = vec3(-0.9, 0.1, 1.0);
    let set = under_a_sky(vec3(0.3, 0.4, 5.0), Vec3::ZERO, 4)?
        .shape("block", block(0.9, vec3(0.1, 0.0, -0.8)), diffuse([0.8, 0.3, 0.2]))
        .shape("pane", panel([0.7, 0.9], 0.5, place), pane)
        .shape("veil", panel([0.7, 0.9], 0.4, vec3(0.8, -0.1, 1.2)), veil);
    let mut cells = moving("pane", place);
    let fades = turn("veil", vec3(0.1, 0.9, 0.1), vec3(0.8, -0.1, 1.2));
    cells.push(Cell::new("veil turns", [fades]).step(STEP).representative());
    Ok(stage("panes", set, cells))
}

fn tiled(bsdf: Bsdf, property: Property, texture: Texture) -> Result<Bsdf> {
    Ok(Bsdf::Textured(Textured::new(bsdf, vec![(property, texture)])?.into()))
}

fn tiles() -> Result<Bsdf> {
    let colours = [[0.8, 0.2, 0.3].into(), [0.1, 0.6, 0.9].into()];
    tiled(diffuse([0.5; 3]), Property::Reflectance, squares(colours))
}

/// A panel with texture coordinates.
fn sheet(size: [f64; 2], axis: Vec3, angle: f64, at: Vec3) -> Result<Mesh> {
    let mesh = with_coordinates(&rectangle())?;
    Ok(placed(&mesh, vec3(size[0], size[1], 1.0), axis, angle, at))
}

/// A block that is seen through a lattice, which is there in squares, and a floor of tiles in a mirror.
///
/// # Errors
/// When the library rejects the scene.
pub fn lattice() -> Result<Stage> {
    let place = vec3(-0.7, 0.1, 1.0);
    let mask = Bsdf::Mask(Mask { bsdf: diffuse([0.3, 0.7, 0.2]), opacity: 0.5 }.into());
    let mask = tiled(mask, Property::Opacity, squares([Rgb::splat(0.1), Rgb::ONE]))?;
    let set = under_a_sky(vec3(0.3, 0.4, 5.0), Vec3::ZERO, 4)?
        .shape("block", block(0.7, vec3(-0.5, 0.0, -0.8)), diffuse([0.8, 0.3, 0.2]))
        .shape("lattice", sheet([0.8, 0.9], Vec3::Y, 0.4, place)?, mask)
        .shape("floor", sheet([1.5, 1.5], Vec3::X, -FRAC_PI_2, vec3(0.8, -0.9, 0.6))?, tiles()?)
        .shape("mirror", panel([0.8, 1.0], -0.4, vec3(1.2, 0.0, -0.9)), silver());
    let mut cells = moving("lattice", place);
    let turns = turn("floor", vec3(0.1, 0.9, 0.1), vec3(0.8, -0.9, 0.6));
    cells.push(Cell::new("floor turns", [turns]).step(STEP));
    Ok(stage("lattice", set, cells))
}

/// A block behind a slab of glass.
///
/// # Errors
/// When the library rejects the scene.
pub fn slab() -> Result<Stage> {
    let pivot = vec3(0.0, 0.0, 1.0);
    let slab = placed(&cube(), vec3(1.2, 1.2, 0.3), Vec3::Y, 0.6, pivot);
    let set = under_a_sky(vec3(0.3, 0.4, 5.0), Vec3::ZERO, 6)?
        .shape("block", block(0.5, vec3(0.1, 0.0, -0.8)), diffuse([0.8, 0.3, 0.2]))
        .shape("slab", slab, glass());
    let mut cells = moving("slab", pivot);
    cells.push(Cell::new("index rises", [raise("slab", "eta", 1.0)]).step(STEP));
    Ok(stage("slab", set, cells))
}

/// A ball whose normals are those of a sphere.
fn ball(radius: f64, place: Vec3) -> Mesh {
    at(&icosphere(3).with_smooth_normals(), Vec3::splat(radius), place)
}

/// Tiles behind a ball of glass.
///
/// # Errors
/// When the library rejects the scene.
pub fn glass_ball() -> Result<Stage> {
    let pivot = vec3(0.0, 0.0, 1.0);
    let wall = sheet([1.3, 1.2], Vec3::Y, 0.3, vec3(0.1, 0.0, -0.8))?;
    let set = under_a_sky(vec3(0.3, 0.4, 5.0), Vec3::ZERO, 6)?
        .shape("block", wall, tiles()?)
        .shape("ball", ball(0.9, pivot), glass());
    // As the ball itself moves, a few rare samples outweigh all others.
    let mut cells = moving("ball", pivot);
    cells.retain(|cell| ["block moves", "camera turns"].contains(&&*cell.parameter.name));
    Ok(Stage { samples: 4096, ..stage("ball of glass", set, cells) })
}

/// A block that is seen beside a ball of silver and in it.
///
/// # Errors
/// When the library rejects the scene.
pub fn silver_ball() -> Result<Stage> {
    let pivot = vec3(0.0, 0.0, 1.0);
    let set = under_a_sky(vec3(0.3, 0.4, 5.0), Vec3::ZERO, 3)?
        .shape("block", block(0.5, vec3(1.3, 0.0, 1.8)), diffuse([0.8, 0.3, 0.2]))
        .shape("ball", ball(0.9, pivot), silver());
    // About its centre it would turn into itself.
    let mut cells = moving("ball", vec3(0.3, -0.2, 0.6));
    cells.push(Cell::new("ball flattens", [grow("ball", vec3(0.4, -0.3, 0.5), pivot)]).step(STEP));
    Ok(stage("silver ball", set, cells))
}
