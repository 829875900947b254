//! Stages of values that vary: over surfaces, lamps, films in lamps and skies; and of other lenses.

use std::sync::Arc;

use drt_estimators::emitter::{Emitter, EnvironmentMap, Slide};
use drt_estimators::surface::{
    Bsdf, Diffuse, Perturbation, Perturbed, Property, RoughConductor, Textured,
};
use drt_estimators::texture::{
    AttributeTexture, Bitmap, Texture, TextureFilter, TextureWrap, UvMap, VolumeTexture,
};
use drt_geom::procedural::uv_sphere;
use drt_geom::{Mesh, MeshAttribute};
use drt_math::{Affine, Mat3, Rgb, ValueChange, Vec3, vec3};
use drt_medium::{Grid, Volume};
use drt_motion::{Change, Effect, GeometryChange, PropertyChange, Texels};

use super::effects::{grow, raise, translate, turn};
use super::materials::{panel, with_coordinates};
use super::set::{at, diffuse};
use super::{Cell, Stage};
use crate::Result;
use crate::motion::moves;

/// What the colours of corners are called.
const COLOURS: &str = "vertex_colour";

/// Changes texels.
fn texel(target: &str, property: &str, texels: Texels) -> Effect {
    let op = ValueChange::Add([1.0, 0.6, -0.4].into());
    let change =
        PropertyChange { property: property.into(), op, voxels: None, texels: Some(texels) };
    Effect { target: target.into(), change: Change::Property(change) }
}

/// 4 × 3 texels that look like nothing else turned or mirrored.
fn image() -> Result<Bitmap> {
    let texel = |i: u16| {
        let wave = |by: f32| 0.45 + 0.3 * (by * f32::from(i)).sin();
        [wave(1.7), wave(2.9), wave(0.8)]
    };
    Ok(Bitmap::new([4, 3], (0..12).map(texel).collect())?)
}

fn painted(texture: Texture) -> Result<Bsdf> {
    let bsdf = Bsdf::Diffuse(Diffuse::default());
    let textured = Textured::new(bsdf, vec![(Property::Reflectance, texture)])?;
    Ok(Bsdf::Textured(Box::new(textured)))
}

/// An image on a panel.
///
/// # Errors
/// When the library rejects the scene.
pub fn picture() -> Result<Stage> {
    let mut image = image()?;
    image.wrap = TextureWrap::Mirror;
    let cells = vec![
        Cell::new("a texel", [texel("panel", "reflectance", Texels::One([1, 1]))])
            .samples(512)
            .representative(),
        Cell::new("all texels", [texel("panel", "reflectance", Texels::All)]).samples(512),
        Cell::new("panel moves", [translate("panel", vec3(0.3, 0.5, -0.3))])
            .samples(1024)
            .representative(),
        Cell::new("panel turns", [turn("panel", vec3(0.2, 1.0, 0.3), Vec3::ZERO)]),
    ];
    Ok(Stage::new("picture", panel(painted(Texture::Bitmap(image))?)?.scene, cells))
}

/// Nearest texels, which jump: of these, the texels alone are for all estimators.
///
/// # Errors
/// When the library rejects the scene.
pub fn mosaic() -> Result<Stage> {
    let mut image = image()?;
    (image.filter, image.wrap) = (TextureFilter::Nearest, TextureWrap::Clamp);
    let cells = vec![
        Cell::new("a texel", [texel("panel", "reflectance", Texels::One([2, 0]))])
            .samples(512)
            .representative(),
    ];
    Ok(Stage::new("mosaic", panel(painted(Texture::Bitmap(image))?)?.scene, cells))
}

/// A mesh whose corners have colours by their places, the same for all that share one.
pub(super) fn by_place(mesh: Mesh) -> Result<Mesh> {
    let colour = |x: Vec3| {
        [x.x + 0.3 * x.y, x.y - 0.5 * x.z, x.z + 0.2].map(|v| 0.5 + 0.35 * (3.0 * v).sin() as f32)
    };
    let corner = |v: u32| colour(mesh.positions[v as usize]);
    let values = mesh.triangles.iter().map(|t| t.map(corner)).collect();
    Ok(mesh.with_attributes(vec![MeshAttribute { name: String::from(COLOURS), values }])?)
}

/// A diffuse surface of the colours that its mesh's corners have.
pub(super) fn coloured() -> Result<Bsdf> {
    let name = String::from(COLOURS);
    painted(Texture::Attribute(AttributeTexture { name, scale: 1.0, grey: false }))
}

/// Values that the corners of a mesh have.
///
/// # Errors
/// When the library rejects the scene.
pub fn stained() -> Result<Stage> {
    let name = String::from(COLOURS);
    let mut scene = panel(coloured()?)?.scene;
    let mesh = &scene.shapes[0].mesh;
    let colour = |v: u32| {
        [[0.9, 0.1, 0.3], [0.2, 0.7, 0.4], [0.1, 0.3, 0.8], [0.6, 0.6, 0.1]][v as usize % 4]
    };
    let values = mesh.triangles.iter().map(|t| t.map(colour)).collect();
    let mesh = mesh.as_ref().clone().with_attributes(vec![MeshAttribute { name, values }])?;
    scene.shapes[0].mesh = mesh.into();
    let cells = vec![
        Cell::new("panel moves", [translate("panel", vec3(0.3, 0.5, -0.3))])
            .samples(1024)
            .representative(),
        Cell::new("panel turns", [turn("panel", vec3(0.2, 1.0, 0.3), Vec3::ZERO)]),
    ];
    Ok(Stage::new("stained", scene, cells))
}

/// Values of the space that a panel has been cut from, in three channels; one cell is of a panel that has moved.
///
/// # Errors
/// When the library rejects the scene.
pub fn marbled() -> Result<Stage> {
    let size = [4_usize, 3, 3];
    let value = |i: usize| 0.5 + 0.4 * (1.9 * i as f64).sin();
    let grid = Grid::new(size, 3, (0..3 * size.iter().product::<usize>()).map(value).collect())?;
    let wide =
        Affine { linear: Mat3::rotation(Vec3::X, 0.4) * 2.5, translation: vec3(-1.2, -1.0, -1.1) };
    let volume = Arc::new(Volume::Grid(grid.with_placement(wide)?));
    let paint = painted(Texture::Volume(VolumeTexture { volume, grey: false }))?;
    let mut scene = panel(paint)?.scene;
    let mesh = scene.shapes[0].mesh.as_ref().clone();
    scene.shapes[0].mesh = VolumeTexture::remember_positions(mesh)?.into();
    let turns = turn("panel", vec3(0.2, 1.0, 0.3), Vec3::ZERO);
    let cells = vec![
        Cell::new("panel moves", [translate("panel", vec3(0.3, 0.5, -0.3))]).samples(1024),
        Cell::new("panel, turned, turns on", [turns]).at(0.2).samples(1024).representative(),
    ];
    Ok(Stage::new("marbled", scene, cells))
}

/// A panel of squares, between which its colour jumps.
///
/// # Errors
/// When the library rejects the scene.
pub fn tiles() -> Result<Stage> {
    let squares = squares([[0.8, 0.2, 0.3].into(), [0.1, 0.6, 0.9].into()]);
    let set = panel(painted(squares)?)?;
    let cells = vec![
        Cell::new("panel turns", [turn("panel", vec3(0.2, 1.0, 0.3), Vec3::ZERO)]).representative(),
        Cell::new("panel shears", [shears()]).representative(),
        Cell::new("camera turns", [turn("camera", vec3(0.3, 1.0, 0.4), vec3(0.3, 1.2, -2.6))])
            .step(0.02)
            .representative(),
        Cell::new("wall moves", [translate("wall", vec3(0.1, 0.2, -0.3))]),
    ];
    Ok(Stage::new("tiles", set.scene, cells))
}

/// Two by three squares and a bit, askew.
pub(super) fn squares(colours: [Rgb; 2]) -> Texture {
    let to_uv = UvMap([[1.1, 0.3, 0.17], [-0.2, 1.4, 0.06]]);
    Texture::Checkerboard { colours, to_uv }
}

/// Normals of [`image`] up to about 40° from the surface's, or its heights.
fn bent(bsdf: Bsdf, perturbation: Perturbation) -> Result<Bsdf> {
    let mut image = image()?.map(|[r, g, _]| match perturbation {
        Perturbation::Normals => [r, g, 0.85],
        Perturbation::Heights(_) => [r; 3],
    })?;
    image.wrap = TextureWrap::Mirror;
    Ok(Bsdf::Perturbed(Box::new(Perturbed {
        bsdf,
        map: Texture::Bitmap(image),
        perturbation,
        flip_invalid_normals: true,
        use_shadowing_function: true,
    })))
}

/// The panel sheared in its own plane, which turns u and v apart.
fn shears() -> Effect {
    let velocities = [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]];
    let along = vec3(0.0, 0.447_213_595_499_958, 0.894_427_190_999_916);
    let moved = |[x, y]: [f64; 2]| vec3(0.5 * y + 0.3 * x, 0.0, 0.0) + along * (0.4 * x - 0.2 * y);
    moves("panel", GeometryChange::VertexVelocity(velocities.map(moved).into()))
}

/// Rough metal with a map of normals, which a panel takes along.
///
/// # Errors
/// When the library rejects the scene.
pub fn embossed() -> Result<Stage> {
    let metal = RoughConductor { alpha: 0.3, ..RoughConductor::default() };
    let bsdf = bent(Bsdf::RoughConductor(metal), Perturbation::Normals)?;
    let cells = vec![
        Cell::new("panel moves", [translate("panel", vec3(0.3, 0.5, -0.3))]),
        Cell::new("panel turns", [turn("panel", vec3(0.2, 1.0, 0.3), Vec3::ZERO)]).representative(),
        Cell::new("panel shears", [shears()]).representative(),
        Cell::new("camera turns", [turn("camera", vec3(0.3, 1.0, 0.4), vec3(0.3, 1.2, -2.6))]),
    ];
    Ok(Stage::new("embossed", panel(bsdf)?.scene, cells))
}

/// A panel with heights.
///
/// # Errors
/// When the library rejects the scene.
pub fn engraved() -> Result<Stage> {
    let bsdf = bent(diffuse([0.7, 0.6, 0.5]), Perturbation::Heights(0.5))?;
    let cells = vec![
        Cell::new("panel turns", [turn("panel", vec3(0.2, 1.0, 0.3), Vec3::ZERO)]),
        Cell::new("panel shears", [shears()]).representative(),
        Cell::new("panel grows", [grow("panel", vec3(1.0, 0.4, 0.4), Vec3::ZERO)]).representative(),
    ];
    Ok(Stage::new("engraved", panel(bsdf)?.scene, cells))
}

/// A ball whose map of normals has an orientation of its own in each triangle.
///
/// # Errors
/// When the library rejects the scene.
pub fn plastered() -> Result<Stage> {
    let ball = with_coordinates(&at(&uv_sphere(8), Vec3::splat(0.6), vec3(0.0, 0.4, 0.0)))?;
    let plaster = bent(diffuse([0.4, 0.6, 0.8]), Perturbation::Normals)?;
    let bulged = |p: &Vec3| vec3(0.6 * p.y, 0.5 * p.x * p.z, p.x - 0.4 * p.y);
    let bulges = ball.positions.iter().map(bulged).collect();
    let bulges = moves("ball", GeometryChange::VertexVelocity(bulges));
    let scene = panel(diffuse([0.7, 0.6, 0.5]))?.shape("ball", ball, plaster).scene;
    let cells = vec![
        Cell::new("ball turns", [turn("ball", vec3(0.2, 1.0, 0.3), vec3(0.0, 0.4, 0.0))])
            .representative(),
        Cell::new("ball bulges", [bulges]).representative(),
    ];
    Ok(Stage::new("plastered", scene, cells))
}

/// A lamp with a picture before it.
///
/// # Errors
/// When the library rejects the scene.
pub fn picture_lamp() -> Result<Stage> {
    let mut scene = panel(diffuse([0.7, 0.6, 0.5]))?.scene;
    let lamp = scene.shapes.iter().position(|s| s.emitter.is_some()).ok_or("no lamp")?;
    let mesh = with_coordinates(&drt_geom::procedural::rectangle())?;
    let mut shape = scene.shapes[lamp].mesh.as_ref().clone();
    shape.texcoords = mesh.texcoords;
    scene.shapes[lamp].mesh = shape.into();
    let (radiance, texture) = (Rgb::new(9.0, 8.0, 7.0), Texture::Bitmap(image()?));
    scene.emitters[0].item.emitter = Emitter::TexturedArea { radiance, texture };
    let cells = vec![
        Cell::new("a texel", [texel("lamp", "radiance", Texels::One([1, 1]))])
            .samples(512)
            .representative(),
        Cell::new("brighter", [raise("lamp", "radiance", 1.0)]).samples(512),
        Cell::new("lamp moves", [translate("lamp", vec3(0.5, -0.3, 0.3))]),
    ];
    Ok(Stage::new("picture lamp", scene, cells))
}

/// An environment that looks like nothing else turned or mirrored.
pub(super) fn sky() -> Result<Emitter> {
    let texels: Vec<[f32; 3]> = (0..12_u16)
        .map(|i| [0.4, 0.9, 1.7].map(|by: f32| 0.5 + 0.4 * (by * f32::from(i)).sin()))
        .collect();
    let map = EnvironmentMap::new([4, 3], texels, Mat3::IDENTITY)?;
    Ok(Emitter::Envmap { radiance: Rgb::ONE, map: map.into() })
}

/// What moves under an environment, the camera too, which sees some of it.
///
/// # Errors
/// When the library rejects the scene.
pub fn under_a_sky() -> Result<Stage> {
    let set = panel(diffuse([0.7, 0.6, 0.5]))?.light("sky", sky()?);
    let spin = |target| turn(target, vec3(0.3, 1.0, 0.2), Vec3::ZERO);
    let cells = vec![
        Cell::new("panel moves", [translate("panel", vec3(0.3, 0.5, -0.3))])
            .samples(1024)
            .representative(),
        Cell::new("panel and sky turn", ["panel", "sky"].map(spin)),
        Cell::new("camera turns", [turn("camera", vec3(0.3, 1.0, 0.4), vec3(0.3, 1.2, -2.6))])
            .samples(1024)
            .representative(),
        Cell::new("everything turns", ["panel", "wall", "lamp", "sky", "camera"].map(spin)),
    ];
    Ok(Stage::new("under a sky", set.scene, cells))
}

/// A projector and an environment: their numbers, texels and turns.
///
/// # Errors
/// When the library rejects the scene.
pub fn sky_and_slide() -> Result<Stage> {
    let mut set = panel(diffuse([0.7, 0.6, 0.5]))?;
    let image = image()?;
    let frame = Mat3::rotation(Vec3::X, std::f64::consts::FRAC_PI_2);
    let slide = Slide::projector(Some(Texture::Bitmap(image)), [0.5, 0.4])?;
    set = set.light("sky", sky()?).light(
        "projector",
        Emitter::Projector {
            position: vec3(0.2, 1.6, -0.4),
            frame,
            strength: Rgb::new(6.0, 5.0, 4.0),
            slide: slide.into(),
        },
    );
    let cells = vec![
        Cell::new("a texel of the sky", [texel("sky", "radiance", Texels::One([2, 1]))])
            .samples(512)
            .representative(),
        Cell::new("sky", [raise("sky", "radiance", 1.0)]).samples(512),
        Cell::new("sky turns", [turn("sky", vec3(0.3, 1.0, 0.2), Vec3::ZERO)])
            .samples(1024)
            .representative(),
        Cell::new("projector", [raise("projector", "irradiance", 1.0)]).samples(512),
    ];
    Ok(Stage::new("sky and slide", set.scene, cells))
}

/// A spot and a projector with pictures, which move with all that they throw. The projector's has a black border, so that its
/// light does not jump.
///
/// # Errors
/// When the library rejects the scene.
pub fn thrown() -> Result<Stage> {
    let frame = Mat3::rotation(Vec3::X, std::f64::consts::FRAC_PI_2);
    let bordered = |i: u16| {
        let inside = (1..4).contains(&(i % 5)) && (1..3).contains(&(i / 5));
        if inside { [0.9, 0.4 + 0.02 * f32::from(i), 0.6] } else { [0.0; 3] }
    };
    let mut border = Bitmap::new([5, 4], (0..20).map(bordered).collect())?;
    border.wrap = TextureWrap::Clamp;
    let slide = Slide::projector(Some(Texture::Bitmap(border)), [0.7, 0.6])?;
    let beam = Slide::spot(Texture::Bitmap(image()?), 0.7, 0.4)?;
    let light = |x: f64, strength, slide: Slide| Emitter::Projector {
        position: vec3(x, 1.6, -0.4),
        frame,
        strength,
        slide: slide.into(),
    };
    let scene = panel(diffuse([0.7, 0.6, 0.5]))?
        .light("spot", light(0.3, Rgb::new(6.0, 5.0, 4.0), beam))
        .light("projector", light(-0.2, Rgb::new(3.0, 4.0, 5.0), slide))
        .scene;
    let cells = vec![
        Cell::new("spot", [raise("spot", "intensity", 1.0)]).samples(512),
        Cell::new("a texel of the spot", [texel("spot", "intensity", Texels::One([1, 1]))])
            .samples(512),
        Cell::new(
            "a texel of the projector",
            [texel("projector", "irradiance", Texels::One([2, 1]))],
        )
        .samples(512)
        .representative(),
        Cell::new("spot moves", [translate("spot", vec3(0.3, 0.2, -0.4))])
            .samples(1024)
            .representative(),
        Cell::new("spot turns", [turn("spot", vec3(0.3, 0.4, 1.0), vec3(0.3, 1.6, -0.4))]),
        Cell::new("projector moves", [translate("projector", vec3(0.2, 0.2, 0.3))])
            .samples(1024)
            .representative(),
        Cell::new(
            "projector turns",
            [turn("projector", vec3(1.0, 0.2, 0.3), vec3(-0.2, 1.6, -0.4))],
        ),
        Cell::new("panel moves", [translate("panel", vec3(0.3, 0.5, -0.3))]),
    ];
    Ok(Stage::new("thrown", scene, cells))
}
