//! Stages without media.

use std::f64::consts::{FRAC_PI_2, PI};

use drt_estimators::emitter::Emitter;
use drt_estimators::filter::FilterKind;
use drt_estimators::surface::{Blend, Bsdf, Distribution, Phong, RoughConductor};
use drt_geom::procedural::{TorusKnot, cube, grid, icosphere, rectangle, torus_knot, uv_sphere};
use drt_math::{Affine, Mat3, Rgb, Vec3, vec3};
use drt_motion::{Effect, GeometryChange};

use super::effects::{add, grow, raise, translate, turn};
use super::set::{at, diffuse, inside_out, placed};
use super::{Cell, Set, Stage};
use crate::Result;
use crate::motion::moves;

/// Where the room's block is.
const BLOCK: Vec3 = vec3(0.25, -0.25, 0.3);
/// Where the room's lamp is.
const LAMP: Vec3 = vec3(-0.15, 0.75, 0.1);

/// A closed room with a floating block and a lamp, seen from inside.
fn furnished() -> Result<Set> {
    let walls = inside_out(cube());
    let block = placed(&cube(), Vec3::splat(0.25), vec3(1.0, 2.0, 0.5), 0.6, BLOCK);
    let lamp = placed(&rectangle(), vec3(0.35, 0.3, 1.0), Vec3::X, FRAC_PI_2, LAMP);
    Ok(Set::new(vec3(0.1, 0.05, -0.9), vec3(0.0, -0.1, 1.0), 75.0, 3)?
        .shape("walls", walls, diffuse([0.7, 0.5, 0.3]))
        .shape("block", block, diffuse([0.3, 0.6, 0.8]))
        .lamp("lamp", lamp, Rgb::new(3.0, 4.0, 5.0)))
}

/// Surfaces, an area light, a tent filter: every motion of shapes, lamp and camera.
///
/// # Errors
/// When the library rejects the scene.
pub fn room() -> Result<Stage> {
    let shear = Affine {
        linear: Mat3::from_rows(vec3(0.2, 0.5, 0.0), vec3(0.0, -0.3, 0.4), vec3(0.3, 0.0, 0.1)),
        translation: vec3(0.3, 0.1, 0.0),
    };
    let corner = GeometryChange::Vertex { index: 3, direction: vec3(0.4, 1.0, -0.6) };
    let cells = vec![
        Cell::new("block moves", [translate("block", vec3(0.8, 0.5, -0.2))]).representative(),
        Cell::new("block turns", [turn("block", vec3(0.3, 1.0, 0.2), BLOCK)]),
        Cell::new("block grows", [grow("block", vec3(1.0, 0.5, 1.0), BLOCK)]),
        Cell::new("block sheared", [moves("block", GeometryChange::Matrix(shear))]),
        Cell::new("block's corner", [moves("block", corner)]),
        Cell::new("lamp moves", [translate("lamp", vec3(0.7, -0.4, 0.3))]),
        Cell::new("lamp turns", [turn("lamp", vec3(0.4, 0.1, 1.0), LAMP)]),
        Cell::new("walls move", [translate("walls", vec3(0.5, 0.3, 0.4))]),
        Cell::new("camera moves", [translate("camera", vec3(0.6, 0.2, -0.3))]),
        Cell::new("camera turns", [turn("camera", vec3(0.3, 1.0, 0.4), vec3(0.0, 0.1, -0.7))]),
        Cell::new("field of view", [raise("camera", "fov", 30.0)]),
        Cell::new("principal point", [raise("camera", "principal_point_offset_x", 0.5)]),
        Cell::new("radiance", [add("lamp", "radiance", [1.0, 2.0, 0.5])]).samples(512),
        Cell::new("reflectance", [add("walls", "reflectance", [1.0, -0.5, 0.7])])
            .step(0.1)
            .samples(512)
            .representative()
            .precise(),
    ];
    Ok(Stage::new("room", furnished()?.scene, cells))
}

/// The room with a box filter, whose borders are discontinuities of their own, displaced by the
/// parameters' values.
///
/// # Errors
/// When the library rejects the scene.
pub fn room_box_filter() -> Result<Stage> {
    let everything = ["walls", "block", "lamp"];
    let cells = vec![
        Cell::new("block moves", [translate("block", vec3(0.8, 0.5, -0.2))]).at(0.25),
        Cell::new("camera turns", [turn("camera", vec3(0.3, 1.0, 0.4), vec3(0.0, 0.1, -0.7))])
            .representative(),
        Cell::new("block turns", [turn("block", vec3(0.3, 1.0, 0.2), BLOCK)]).at(-0.4),
        Cell::new(
            "everything but the camera",
            everything.map(|s| translate(s, vec3(0.5, 0.2, 0.4))),
        ),
    ];
    let scene = furnished()?.filter(FilterKind::BOX)?.scene;
    Ok(Stage::new("room, box filter", scene, cells))
}

/// A block that stands on a floor, with another on top of it, by direct light of lamp and sky: a
/// quarter of the sliding block's derivative comes from the line where it meets the floor.
///
/// # Errors
/// When the library rejects the scene.
pub fn standing() -> Result<Stage> {
    let floor = placed(&rectangle(), vec3(3.0, 3.0, 1.0), Vec3::X, -FRAC_PI_2, Vec3::ZERO);
    let block = placed(&cube(), vec3(0.35, 0.25, 0.3), Vec3::Y, 0.35, vec3(0.0, 0.25, 0.0));
    let top = at(&cube(), Vec3::splat(0.12), vec3(0.0, 0.62, 0.0));
    let lamp = placed(&rectangle(), vec3(0.4, 0.4, 1.0), Vec3::X, FRAC_PI_2, vec3(0.8, 1.8, -0.4));
    let scene = Set::new(vec3(1.2, 1.5, 2.6), vec3(0.0, 0.2, 0.0), 35.0, 2)?
        .shape("floor", floor, diffuse([0.7, 0.6, 0.5]))
        .shape("block", block, diffuse([0.2, 0.4, 0.7]))
        .shape("top", top, diffuse([0.7, 0.4, 0.2]))
        .lamp("lamp", lamp, Rgb::new(9.0, 9.0, 8.0))
        .light("sky", Emitter::Constant { radiance: Rgb::new(0.3, 0.35, 0.5) })
        .scene;
    let both = |effect: &dyn Fn(&str) -> Effect| ["block", "top"].map(effect);
    let cells = vec![
        Cell::new("both slide", both(&|id| translate(id, vec3(1.0, 0.0, 0.3)))).representative(),
        Cell::new("the top slides", [translate("top", vec3(0.6, 0.0, -0.8))]),
        Cell::new("both turn", both(&|id| turn(id, Vec3::Y, vec3(0.3, 0.0, 0.0)))),
        Cell::new("the floor slides", [translate("floor", vec3(0.7, 0.0, 0.7))]),
    ];
    Ok(Stage::new("standing blocks", scene, cells))
}

/// A ball half sunk in a floor and a block through a wall, by direct light: bodies that no edge bounds where they go in.
///
/// # Errors
/// When the library rejects the scene.
pub fn sunk() -> Result<Stage> {
    let lamp = placed(&rectangle(), vec3(0.4, 0.4, 1.0), Vec3::X, FRAC_PI_2, vec3(0.6, 1.6, 0.5));
    let scene = sunken(2, [0.8, 0.5, 0.2])?
        .lamp("lamp", lamp, Rgb::new(14.0, 13.0, 11.0))
        .light("sky", Emitter::Constant { radiance: Rgb::new(0.2, 0.25, 0.35) })
        .scene;
    let both = [translate("ball", vec3(0.4, 0.3, -0.2)), translate("floor", vec3(0.3, 0.6, 0.2))];
    let cells = vec![
        Cell::new("ball rises", [translate("ball", Vec3::Y)]).representative(),
        Cell::new("ball slides", [translate("ball", vec3(0.8, 0.0, 0.5))]),
        Cell::new("floor tilts", [turn("floor", vec3(1.0, 0.0, 0.4), SUNK_FLOOR)]),
        Cell::new("block turns", [turn("block", vec3(0.3, 1.0, 0.2), THROUGH_WALL)])
            .representative(),
        Cell::new("wall moves", [translate("wall", vec3(0.3, 0.2, 0.8))]),
        Cell::new("ball and floor move", both),
        Cell::new("camera moves", [translate("camera", vec3(0.6, 0.2, -0.3))]),
    ];
    Ok(Stage::new("sunk", scene, cells))
}

/// The same in the light of a point, which floor and wall throw on each other. Ball and block are black: with light between surfaces
/// that touch and move apart, `path-space` has samples in proportion to one over their distance.
///
/// # Errors
/// When the library rejects the scene.
pub fn sunk_by_point() -> Result<Stage> {
    let bulb = Emitter::Point { position: vec3(0.9, 1.2, 0.9), intensity: Rgb::new(3.0, 2.5, 2.0) };
    let scene = sunken(4, [0.0; 3])?.light("bulb", bulb).scene;
    let cells = vec![
        Cell::new("ball rises", [translate("ball", Vec3::Y)]).representative(),
        Cell::new("ball slides", [translate("ball", vec3(0.8, 0.0, 0.5))]),
        Cell::new("block turns", [turn("block", vec3(0.3, 1.0, 0.2), THROUGH_WALL)]),
        Cell::new("bulb moves", [translate("bulb", vec3(0.5, -0.3, 0.4))]),
    ];
    Ok(Stage::new("sunk, by a point", scene, cells))
}

/// Where the ball is in the floor.
const SUNK_FLOOR: Vec3 = vec3(0.1, -0.6, 0.0);
/// Where the block is in the wall.
const THROUGH_WALL: Vec3 = vec3(-0.45, 0.1, -0.6);

/// The bodies, with a reflectance, the floor and the wall.
fn sunken(depth: u32, bodies: [f64; 3]) -> Result<Set> {
    let floor = placed(&grid(2, 2), vec3(1.6, 1.6, 1.0), Vec3::X, -FRAC_PI_2, SUNK_FLOOR);
    let wall = placed(&rectangle(), vec3(1.6, 1.3, 1.0), Vec3::X, 0.1, vec3(0.0, 0.3, -0.6));
    let ball = at(&icosphere(2), Vec3::splat(0.45), SUNK_FLOOR + vec3(0.2, 0.1, 0.2));
    let block = placed(&cube(), vec3(0.2, 0.25, 0.4), vec3(1.0, 2.0, 0.5), 0.6, THROUGH_WALL);
    Ok(Set::new(vec3(0.7, 0.9, 2.8), vec3(0.0, -0.2, 0.0), 38.0, depth)?
        .shape("floor", floor, diffuse([0.7, 0.6, 0.5]))
        .shape("wall", wall, diffuse([0.3, 0.5, 0.6]))
        .shape("ball", ball, diffuse(bodies))
        .shape("block", block, diffuse(bodies)))
}

/// A metal knot over a floor under a constant sky.
///
/// # Errors
/// When the library rejects the scene.
pub fn knot() -> Result<Stage> {
    let shape = TorusKnot { segments: 48, sides: 8, tube: 0.22, ..TorusKnot::default() };
    let knot = placed(&torus_knot(&shape), Vec3::splat(0.55), Vec3::X, 1.0, Vec3::ZERO);
    let metal = RoughConductor {
        distribution: Distribution::Ggx,
        alpha: 0.35,
        eta: Rgb::new(0.2, 0.9, 1.4),
        k: Rgb::new(3.5, 2.4, 1.9),
        ..RoughConductor::default()
    };
    let floor =
        placed(&rectangle(), vec3(1.6, 1.6, 1.0), Vec3::X, -FRAC_PI_2, vec3(0.0, -0.9, 0.0));
    let scene = Set::new(vec3(0.4, 0.8, -2.8), vec3(0.0, -0.1, 0.0), 42.0, 3)?
        .shape("knot", knot, Bsdf::RoughConductor(metal))
        .shape("floor", floor, diffuse([0.5, 0.6, 0.7]))
        .light("sky", Emitter::Constant { radiance: Rgb::new(1.0, 0.8, 0.6) })
        .scene;
    let cells = vec![
        Cell::new("knot moves", [translate("knot", vec3(0.4, 0.7, 0.3))]).representative(),
        Cell::new("knot turns", [turn("knot", vec3(0.2, 1.0, 0.3), Vec3::ZERO)]),
        Cell::new("alpha", [raise("knot", "alpha", 1.0)]),
        Cell::new("eta", [add("knot", "eta", [1.0, 0.5, -0.5])]),
        Cell::new("k", [add("knot", "k", [1.0, 2.0, -1.0])]),
        Cell::new("specular reflectance", [raise("knot", "specular_reflectance", 1.0)]),
        Cell::new("sky", [add("sky", "radiance", [1.0, 0.0, 0.5])])
            .representative()
            .precise()
            .samples(512),
    ];
    Ok(Stage::new("knot", scene, cells))
}

/// A glossy ball with interpolated normals before a wall, lit by a lamp.
///
/// # Errors
/// When the library rejects the scene.
pub fn gloss() -> Result<Stage> {
    // With the normals that it is given as soon as a parameter deforms it, so that every cell has
    // the same scene.
    let ball = at(&uv_sphere(10), Vec3::splat(0.6), Vec3::ZERO).with_smooth_normals();
    let inflate = ball.positions.iter().map(|p| *p * (1.0 + p.y) + vec3(0.0, 0.0, 0.3 * p.x));
    let inflate = GeometryChange::VertexVelocity(inflate.collect());
    let phong = Phong {
        reflectance: Rgb::new(0.3, 0.2, 0.1),
        specular_reflectance: Rgb::new(0.3, 0.5, 0.6),
        exponent: 12.0,
    };
    let wall = placed(&rectangle(), vec3(2.0, 2.0, 1.0), Vec3::X, PI, vec3(0.0, 0.0, 1.2));
    let lamp = placed(&rectangle(), vec3(0.5, 0.4, 1.0), Vec3::X, FRAC_PI_2, vec3(-0.5, 1.6, -0.9));
    let scene = Set::new(vec3(0.3, 0.4, -2.6), Vec3::ZERO, 40.0, 3)?
        .shape("ball", ball, Bsdf::Phong(phong))
        .shape("wall", wall, diffuse([0.6, 0.5, 0.4]))
        .lamp("lamp", lamp, Rgb::new(8.0, 7.0, 6.0))
        .scene;
    let cells = vec![
        Cell::new("ball moves", [translate("ball", vec3(0.7, 0.3, -0.4))]),
        Cell::new("ball grows", [grow("ball", vec3(1.0, 0.3, 0.7), Vec3::ZERO)]),
        Cell::new("ball deforms", [moves("ball", inflate)]).representative(),
        Cell::new("exponent", [raise("ball", "exponent", 20.0)]),
        Cell::new("specular reflectance", [add("ball", "specular_reflectance", [1.0, 0.5, 0.2])]),
    ];
    Ok(Stage::new("gloss", scene, cells))
}

/// A ball between paint and metal before a wall.
///
/// # Errors
/// When the library rejects the scene.
pub fn blend() -> Result<Stage> {
    let ball = at(&uv_sphere(8), Vec3::splat(0.6), Vec3::ZERO).with_smooth_normals();
    let metal = RoughConductor { alpha: 0.4, ..RoughConductor::default() };
    let bsdfs = [diffuse([0.6, 0.3, 0.1]), Bsdf::RoughConductor(metal)];
    let wall = placed(&rectangle(), vec3(2.0, 2.0, 1.0), Vec3::X, PI, vec3(0.0, 0.0, 1.2));
    let lamp = placed(&rectangle(), vec3(0.5, 0.4, 1.0), Vec3::X, FRAC_PI_2, vec3(-0.5, 1.6, -0.9));
    let scene = Set::new(vec3(0.3, 0.4, -2.6), Vec3::ZERO, 40.0, 3)?
        .shape("ball", ball, Bsdf::Blend(Box::new(Blend { bsdfs, weight: 0.4 })))
        .shape("wall", wall, diffuse([0.6, 0.5, 0.4]))
        .lamp("lamp", lamp, Rgb::new(8.0, 7.0, 6.0))
        .scene;
    let cells = vec![
        Cell::new("weight", [raise("ball", "weight", 1.0)]).samples(512).representative(),
        Cell::new("ball moves", [translate("ball", vec3(0.7, 0.3, -0.4))]),
        Cell::new("ball turns", [turn("ball", vec3(0.2, 1.0, 0.3), vec3(0.2, 0.1, 0.0))]),
    ];
    Ok(Stage::new("blend", scene, cells))
}

/// A small lamp close above a floor and beside a post.
///
/// # Errors
/// When the library rejects the scene.
pub fn near_lamp() -> Result<Stage> {
    let place = vec3(0.1, -0.1, 0.0);
    let lamp = placed(&rectangle(), vec3(0.1, 0.1, 1.0), vec3(1.0, 0.0, 0.2), 1.3, place);
    let floor = placed(&grid(3, 3), vec3(1.2, 1.2, 1.0), Vec3::X, -FRAC_PI_2, vec3(0.0, -0.3, 0.0));
    let post = placed(&cube(), vec3(0.1, 0.2, 0.1), Vec3::Y, 0.4, vec3(-0.3, -0.05, -0.1));
    let scene = Set::new(vec3(0.3, 1.1, -1.7), vec3(0.0, -0.2, 0.0), 45.0, 3)?
        .shape("floor", floor, diffuse([0.7, 0.6, 0.5]))
        .shape("post", post, diffuse([0.5, 0.6, 0.7]))
        .lamp("lamp", lamp, Rgb::new(20.0, 18.0, 16.0))
        .scene;
    let cells = vec![
        Cell::new("lamp moves", [translate("lamp", vec3(0.3, 0.4, -0.2))]).representative(),
        Cell::new("lamp turns", [turn("lamp", vec3(0.5, 0.3, 1.0), place)]),
        Cell::new("post moves", [translate("post", vec3(0.2, 0.1, 0.4))]),
    ];
    Ok(Stage::new("near lamp", scene, cells))
}
