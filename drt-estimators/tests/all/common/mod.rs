//! Small scenes with a bit of everything, and the parameters that change them.
#![allow(dead_code, unreachable_pub, reason = "the crate's own tests use a part")]

pub mod differences;
pub mod pairing;

use std::sync::Arc;

use drt_estimators::emitter::{Emitter, EnvironmentMap};
use drt_estimators::filter::{Filter, FilterKind};
use drt_estimators::sensor::{Lens, Sensor};
use drt_estimators::surface::{
    Bsdf, Diffuse, Distribution, Phong, Property, RoughConductor, RoughDielectric, Textured,
    TwoSided,
};
use drt_estimators::texture::{Bitmap, Texture, TextureFilter, TextureWrap, UvMap};
use drt_estimators::{Integrator, Layer, Rendering, Scene, Session, Settings, Unattended};
pub use drt_estimators::{SceneBuilder, ShapeBuilder};
use drt_geom::{Mesh, procedural};
use drt_math::{Affine, Mat3, Rgb, Rng, Vec3, vec3};
use drt_medium::{
    Flakes, Grid, GridMedium, Homogeneous, Layout, Medium, Phase, PhaseBlend, Sggx, Volume,
};
use drt_motion::{Change, Effect, GeometryChange, Parameter, PropertyChange, Texels, ValueChange};

/// The scene of a builder, as a camera at a point sees it that looks at another one.
pub fn seen(scene: SceneBuilder, [origin, target]: [Vec3; 2], max_depth: u32) -> Scene {
    let filter = Filter::new(FilterKind::Tent { radius: 1.0 }).expect("a valid filter");
    let sensor = Sensor::look_at([origin, target, Vec3::Y], Lens::with_fov(40.0), FILM, filter);
    let integrator =
        Integrator { max_depth: Some(max_depth), rr_depth: 3, ..Integrator::default() };
    let scene = scene.sensor("camera", sensor.expect("a valid camera")).integrator(integrator);
    let mut scene = scene.build().expect("a valid scene");
    for emitter in scene.emitters.iter_mut().map(|e| &mut e.item.emitter) {
        *emitter = emitter.checked().expect("a valid emitter");
    }
    scene
}

/// A dark surface that glows.
pub fn glowing(mesh: Mesh, radiance: Rgb) -> ShapeBuilder {
    ShapeBuilder::new(mesh, diffuse(0.2, 0.2, 0.2)).emitter(Emitter::Area { radiance })
}

pub const FILM: [u32; 2] = [6, 5];

pub fn diffuse(r: f64, g: f64, b: f64) -> Bsdf {
    Bsdf::Diffuse(Diffuse { reflectance: Rgb::new(r, g, b) })
}

pub fn phong() -> Bsdf {
    Bsdf::Phong(Phong {
        reflectance: Rgb::new(0.5, 0.3, 0.2),
        specular_reflectance: Rgb::splat(0.3),
        exponent: 12.0,
    })
}

pub fn metal() -> Bsdf {
    Bsdf::RoughConductor(RoughConductor {
        distribution: Distribution::Ggx,
        alpha: 0.35,
        eta: Rgb::new(0.2, 0.9, 1.1),
        k: Rgb::new(3.9, 2.4, 2.1),
        specular_reflectance: Rgb::new(0.9, 0.8, 0.7),
    })
}

pub fn glass() -> Bsdf {
    Bsdf::RoughDielectric(RoughDielectric {
        distribution: Distribution::Beckmann,
        alpha: 0.3,
        eta: 1.4,
        specular_reflectance: Rgb::new(0.9, 1.0, 0.8),
        specular_transmittance: Rgb::new(0.8, 0.9, 1.0),
    })
}

pub fn twosided(front: Bsdf) -> Bsdf {
    Bsdf::TwoSided(Box::new(TwoSided { front, back: None }))
}

pub fn homogeneous(sigma_t: Rgb, albedo: Rgb, emission: Rgb, g: f64) -> Medium {
    let coefficients = Homogeneous::new(sigma_t, albedo, emission).expect("valid coefficients");
    Medium::new(coefficients, Phase::henyey_greenstein(g).expect("a valid mean cosine"))
}

/// Placed by a scale, a turn about a slanted axis and a shift.
pub fn placed(mesh: Mesh, scale: Vec3, turn: f64, shift: Vec3) -> Mesh {
    let linear = Mat3::rotation(vec3(0.48, 0.64, 0.6), turn) * Mat3::diagonal(scale);
    mesh.transform(&Affine { linear, translation: shift })
}

/// A ball with smooth shading normals.
pub fn ball(radius: f64, centre: Vec3) -> Mesh {
    placed(procedural::icosphere(1), Vec3::splat(radius), 0.3, centre).with_smooth_normals()
}

pub fn floor() -> Mesh {
    // Facing up.
    let linear = Mat3::rotation(Vec3::X, -core::f64::consts::FRAC_PI_2) * 4.0;
    procedural::grid(2, 2).transform(&Affine { linear, translation: vec3(0.0, -1.0, 0.0) })
}

pub fn lamp() -> Mesh {
    // Facing down, a little askew.
    placed(
        procedural::rectangle().transform(&Affine {
            linear: Mat3::rotation(Vec3::X, core::f64::consts::FRAC_PI_2),
            translation: Vec3::ZERO,
        }),
        Vec3::splat(0.7),
        0.2,
        vec3(0.6, 2.2, -0.4),
    )
}

/// A smooth ball of one material over a floor of another, under a lamp.
fn ball_on_floor(ball_bsdf: Bsdf, floor_bsdf: Bsdf) -> SceneBuilder {
    SceneBuilder::new()
        .shape("ball", ShapeBuilder::new(ball(0.9, vec3(0.1, 0.1, 0.0)), ball_bsdf))
        .shape("floor", ShapeBuilder::new(floor(), floor_bsdf))
        .shape("lamp", glowing(lamp(), Rgb::new(3.0, 2.5, 2.0)))
}

/// Where the camera is that sees ball and floor, and what it looks at.
const BEFORE_BALL: [Vec3; 2] = [vec3(0.3, 0.9, 4.0), vec3(0.0, -0.1, 0.0)];

/// A smooth ball of one material over a floor of another, in the light of a lamp and the sky.
pub fn surfaces_in_extended_light(ball_bsdf: Bsdf, floor_bsdf: Bsdf) -> Scene {
    seen(ball_on_floor(ball_bsdf, floor_bsdf).emitter("sky", sky()), BEFORE_BALL, 5)
}

/// A smooth ball of one material over a floor of another, under every kind of light; no media.
pub fn surfaces(ball_bsdf: Bsdf, floor_bsdf: Bsdf) -> Scene {
    let spot = Emitter::Spot {
        position: vec3(1.4, 1.6, 1.5),
        direction: vec3(-0.8, -1.2, -0.9),
        intensity: Rgb::new(4.0, 3.0, 3.5),
        cutoff_angle: 0.9,
        beam_width: 0.1,
    };
    let scene = ball_on_floor(ball_bsdf, floor_bsdf)
        .emitter("bulb", bulb(vec3(-1.5, 1.3, 0.8)))
        .emitter("spot", spot)
        .emitter("sun", sun(Rgb::new(0.7, 0.6, 0.5)))
        .emitter("sky", sky());
    seen(scene, BEFORE_BALL, 5)
}

pub fn sky() -> Emitter {
    Emitter::Constant { radiance: Rgb::new(0.2, 0.3, 0.5) }
}

pub fn bulb(position: Vec3) -> Emitter {
    Emitter::Point { position, intensity: Rgb::new(1.0, 1.5, 2.0) }
}

pub fn sun(irradiance: Rgb) -> Emitter {
    Emitter::Directional { direction: vec3(0.4, -1.0, -0.3), irradiance }
}

/// A floor that a block of fog, out of view, shines on, with a card between the two that hides half of the block.
pub fn glow() -> Scene {
    let card = placed(procedural::cube(), vec3(0.4, 0.02, 0.6), 0.0, vec3(-0.5, 0.0, 0.0));
    let block = placed(procedural::cube(), Vec3::splat(0.7), 0.3, vec3(-0.9, 1.1, 0.0));
    let fog = homogeneous(Rgb::new(2.0, 1.5, 2.5), Rgb::splat(0.95), Rgb::ZERO, 0.0);
    let scene = SceneBuilder::new()
        .medium("fog", fog)
        .shape("floor", ShapeBuilder::new(floor(), diffuse(0.6, 0.5, 0.4)))
        .shape("card", ShapeBuilder::new(card, diffuse(0.1, 0.1, 0.1)))
        .shape("block", ShapeBuilder::interface(block).interior("fog"))
        .shape("lamp", glowing(lamp(), Rgb::new(3.0, 2.5, 2.0)));
    seen(scene, [vec3(0.3, 0.3, 3.5), vec3(0.0, -1.0, 0.0)], 4)
}

/// The lamp at another place.
fn lamp_at(place: Vec3) -> ShapeBuilder {
    glowing(placed(lamp(), Vec3::splat(1.0), 0.0, place), Rgb::new(3.0, 2.5, 2.0))
}

/// A solid ball and a bulb in a box of fog with a denser blob in it, lit from outside as well.
pub fn fog() -> Scene {
    let scene = fog_by_area_lights();
    let scene = scene.emitter("bulb", bulb(vec3(0.3, 0.7, 0.5)));
    in_front_of_fog(scene.emitter("sun", sun(Rgb::new(0.7, 0.6, 0.5))))
}

/// The scene of [`fog`] as its camera sees it.
pub fn in_front_of_fog(scene: SceneBuilder) -> Scene {
    seen(scene, [vec3(0.4, 0.8, 4.2), vec3(0.0, 0.1, 0.0)], 4)
}

/// What is in [`fog`], lit by a lamp and a sky.
pub fn fog_by_area_lights() -> SceneBuilder {
    let emission = Rgb::new(0.0, 0.1, 0.05);
    let thin = homogeneous(Rgb::new(0.4, 0.5, 0.3), Rgb::new(0.9, 0.6, 0.8), emission, 0.4);
    let dense = homogeneous(Rgb::new(1.5, 1.1, 2.0), Rgb::new(0.7, 0.9, 0.5), Rgb::ZERO, -0.3);
    let walls = placed(procedural::cube(), vec3(1.7, 1.5, 1.6), 0.15, vec3(0.0, 0.1, 0.0));
    let blob = placed(procedural::icosphere(0), Vec3::splat(0.5), 0.7, vec3(-0.7, 0.4, 0.3));
    SceneBuilder::new()
        .medium("thin", thin)
        .medium("dense", dense)
        .shape("box", ShapeBuilder::interface(walls).interior("thin"))
        .shape("blob", ShapeBuilder::interface(blob).interior("dense").exterior("thin"))
        .shape("ball", ShapeBuilder::new(ball(0.45, vec3(0.5, -0.3, 0.1)), phong()))
        .shape("lamp", lamp_at(vec3(0.2, 0.6, 0.3)))
        .emitter("sky", sky())
}

/// A block in a tub of fog with a floor at -1, both of one reflectance; its own bottom is at `bottom`.
pub fn fog_with_a_block(bottom: f64, reflectance: f64) -> Scene {
    let fog = homogeneous(Rgb::new(0.6, 0.5, 0.4), Rgb::new(0.9, 0.8, 0.7), Rgb::ZERO, 0.2);
    let tub = procedural::cube().transform(&scaled(1.5, vec3(0.0, 0.25, 0.0)));
    let mut floor = floor();
    floor.positions.iter_mut().for_each(|p| *p = vec3(0.3 * p.x, p.y, 0.3 * p.z));
    let block = procedural::cube().transform(&scaled(0.4, vec3(0.1, bottom + 0.4, 0.0)));
    let scene = SceneBuilder::new()
        .medium("fog", fog)
        .bsdf("grey", diffuse(reflectance, reflectance, reflectance))
        .shape("tub", ShapeBuilder::interface(tub).interior("fog"))
        .shape("floor", ShapeBuilder::sharing(floor, "grey"))
        .shape("block", ShapeBuilder::sharing(block, "grey"))
        .emitter("sun", sun(Rgb::new(2.0, 2.5, 3.0)));
    seen(scene, [vec3(0.4, 0.8, 4.2), vec3(0.0, -0.2, 0.0)], 4)
}

pub fn scaled(size: f64, at: Vec3) -> Affine {
    Affine { linear: Mat3::IDENTITY * size, translation: at }
}

/// Voxels of smoke, with at least `border` at the faces of their box, in a larger box.
pub fn smoke(border: f64) -> Scene {
    let n = 5;
    let mut rng = Rng::new(7, 0, 0);
    let inner = |i: usize| i > 0 && i < n - 1;
    let values = (0..n * n * n)
        .map(|v| {
            let (i, j, k) = (v % n, v / n % n, v / n / n);
            let value = 2.0 * rng.next_f64();
            if inner(i) && inner(j) && inner(k) { value } else { border * value }
        })
        .collect();
    let linear = Mat3::rotation(vec3(0.48, 0.64, 0.6), 0.4) * 2.0;
    let placement = Affine { linear, translation: -(linear * Vec3::splat(0.5)) };
    let density = Grid::new([n, n, n], 1, values)
        .expect("a valid grid")
        .with_layout(Layout::NodeCentred)
        .with_placement(placement)
        .expect("a box");
    let albedo = Volume::Constant(Rgb::new(0.9, 0.7, 0.8));
    let emission = Volume::Constant(Rgb::new(0.1, 0.05, 0.0));
    let medium = GridMedium::new(density, 1.3, albedo, emission).expect("valid coefficients");
    let medium = Medium::new(medium, Phase::henyey_greenstein(0.3).expect("valid"));
    let walls = placed(procedural::cube(), Vec3::splat(1.9), 0.1, Vec3::ZERO);
    let mut floor = floor();
    for p in &mut floor.positions {
        p.y -= 2.0;
    }
    let scene = SceneBuilder::new()
        .medium("smoke", medium)
        .shape("box", ShapeBuilder::interface(walls).interior("smoke"))
        .shape("floor", ShapeBuilder::new(floor, diffuse(0.6, 0.5, 0.4)))
        .shape("lamp", lamp_at(vec3(0.2, 1.0, 0.3)))
        .emitter("bulb", bulb(vec3(0.3, 0.2, 0.5)))
        .emitter("sun", sun(Rgb::new(0.7, 0.6, 0.5)));
    seen(scene, [vec3(0.4, 0.8, 6.0), Vec3::ZERO], 4)
}

/// Smoke with a phase function that varies as well: by its mean cosine, or by how much each of two functions counts.
pub fn varied_smoke(border: f64) -> [Scene; 2] {
    let scene = smoke(border);
    let placement = *scene.media[0].item.grid().expect("voxels").density().to_world();
    let mut rng = Rng::new(17, 0, 0);
    let mut varied = |lo: f64, hi: f64| {
        let values = (0..64).map(|_| lo + (hi - lo) * rng.next_f64()).collect();
        let grid = Grid::new([4; 3], 1, values).expect("a valid grid");
        grid.with_placement(placement).expect("a box")
    };
    let g = Phase::henyey_greenstein_grid(varied(-0.6, 0.7)).expect("mean cosines");
    let parts = [Phase::henyey_greenstein_grid(varied(0.2, 0.8)).expect("valid"), Phase::Rayleigh];
    let blend = PhaseBlend::varying(varied(0.1, 0.9), parts).expect("weights");
    [g, Phase::Blend(Box::new(blend))].map(|phase| {
        let mut scene = scene.clone();
        scene.media[0].item.phase = phase;
        scene
    })
}

/// Sheets that lean to the camera more or less, and to a side.
fn some_flakes(rng: &mut Rng) -> Flakes {
    let axes = vec3(0.1 + 0.1 * rng.next_f64(), 0.2 + 0.1 * rng.next_f64(), 1.0);
    let lean = Mat3::rotation(vec3(0.6, 0.8, 0.0), 0.3 + 0.4 * rng.next_f64());
    Flakes { diagonal: axes, off_diagonal: Vec3::ZERO }.turned(&lean)
}

/// Smoke of microflakes that vary, and that emits.
pub fn flaky_smoke(border: f64) -> Scene {
    let mut scene = smoke(border);
    let placement = *scene.media[0].item.grid().expect("voxels").density().to_world();
    let mut rng = Rng::new(21, 0, 0);
    let voxels: Vec<Flakes> = (0..64).map(|_| some_flakes(&mut rng)).collect();
    let grid = |entries: fn(&Flakes) -> Vec3| {
        let values = voxels.iter().flat_map(|s| entries(s).to_array()).collect();
        let grid = Grid::new([4; 3], 3, values).expect("a valid grid");
        grid.with_placement(placement).expect("a box")
    };
    let field = Sggx::varying(grid(|s| s.diagonal), grid(|s| s.off_diagonal));
    scene.media[0].item.phase = Phase::Sggx(Box::new(field.expect("flakes")));
    scene
}

/// Fog of microflakes that are the same everywhere takes the place of the smoke.
pub fn flaky_fog() -> Scene {
    let mut scene = smoke(1.0);
    let fog = Homogeneous::new(
        Rgb::new(0.3, 0.4, 0.6),
        Rgb::new(0.8, 0.7, 0.9),
        Rgb::new(0.1, 0.05, 0.0),
    );
    let field = Sggx::new(some_flakes(&mut Rng::new(22, 0, 0))).expect("flakes");
    scene.media[0].item = Medium::new(fog.expect("coefficients"), Phase::Sggx(Box::new(field)));
    scene
}

/// A medium in a box, and a lamp beside it: nothing else has a shadow or an outline.
pub fn alone(medium: Medium) -> Scene {
    let walls = placed(procedural::cube(), Vec3::splat(1.4), 0.1, Vec3::ZERO);
    let scene = SceneBuilder::new()
        .medium("smoke", medium)
        .shape("box", ShapeBuilder::interface(walls).interior("smoke"))
        .emitter("bulb", bulb(vec3(0.5, 2.6, 3.0)));
    seen(scene, [vec3(0.4, 0.8, 6.0), Vec3::ZERO], 4)
}

/// Light from all sides would hide what phase functions do: a sun behind the camera is all there is.
pub fn in_the_sun(mut scene: Scene) -> Scene {
    for emitter in scene.emitters.iter_mut().map(|e| &mut e.item.emitter) {
        match emitter {
            Emitter::Point { intensity, .. } => *intensity = Rgb::ZERO,
            Emitter::Area { radiance } => *radiance = Rgb::ZERO,
            Emitter::Directional { direction, irradiance } => {
                *direction = vec3(-0.2, -0.3, -1.0).normalize();
                *irradiance = Rgb::splat(5.0);
            }
            _ => {}
        }
    }
    scene
}

const VOXELS: usize = 5;

/// A cube of voxels with the extinctions of three channels, in the light of the sky.
fn cloud(extinctions: Vec<f64>, albedo: Rgb) -> SceneBuilder {
    let side = 2.0;
    let placement =
        Affine { linear: Mat3::diagonal(Vec3::splat(side)), translation: Vec3::splat(-0.5 * side) };
    let density = Grid::new([VOXELS; 3], 3, extinctions).expect("a grid");
    let density = density.with_placement(placement).expect("a box");
    let [albedo, emission] = [Volume::Constant(albedo), Volume::Constant(Rgb::ZERO)];
    let medium = GridMedium::new(density, 1.0, albedo, emission).expect("valid coefficients");
    let medium = Medium::new(medium, Phase::henyey_greenstein(0.0).expect("a mean cosine"));
    let walls = procedural::cube().transform(&scaled(0.5 * side, Vec3::ZERO));
    SceneBuilder::new()
        .medium("cloud", medium)
        .shape("box", ShapeBuilder::interface(walls).interior("cloud"))
        .emitter("sky", Emitter::Constant { radiance: Rgb::new(0.8, 1.0, 1.3) })
}

const BEFORE_CLOUD: [Vec3; 2] = [vec3(0.4, 0.8, 5.0), Vec3::ZERO];

/// A cloud without any extinction.
pub fn empty_cloud(albedo: Rgb) -> Scene {
    seen(cloud(vec![0.0; 3 * VOXELS.pow(3)], albedo), BEFORE_CLOUD, 6)
}

/// A cloud of which one voxel in seven is filled, each channel by its own amount, over a floor and under a lamp.
pub fn sparse_cloud() -> Scene {
    seen(sparse(), BEFORE_CLOUD, 5)
}

/// Such a cloud with a lamp in the middle of it.
pub fn inhabited_cloud() -> Scene {
    let inner = placed(procedural::rectangle(), Vec3::splat(0.3), 0.5, vec3(0.1, 0.0, -0.1));
    let inner = glowing(inner, Rgb::new(6.0, 7.0, 8.0));
    seen(sparse().shape("inner", inner), BEFORE_CLOUD, 5)
}

/// Such a cloud that glows, by voxels of its own.
pub fn glowing_cloud() -> Scene {
    let mut scene = sparse_cloud();
    let grids = scene.media[0].item.grid().expect("voxels");
    let mut rng = Rng::new(12, 0, 0);
    let values = (0..3 * 4_usize.pow(3)).map(|_| 3.0 * rng.next_f64()).collect();
    let emission = Grid::new([4; 3], 3, values).expect("a grid");
    let emission = emission.with_placement(*grids.density().to_world()).expect("a box");
    let (density, albedo) = (grids.density().clone(), grids.albedo().clone());
    let grids = GridMedium::new(density, grids.scale(), albedo, Volume::Grid(emission));
    scene.media[0].item.kind = grids.expect("valid coefficients").into();
    scene
}

fn sparse() -> SceneBuilder {
    let mut rng = Rng::new(5, 0, 0);
    let mut extinctions = Vec::new();
    for _ in 0..VOXELS.pow(3) {
        let filled = rng.next_f64() < 1.0 / 7.0;
        extinctions.extend([4.0, 2.5, 1.0].map(|s| if filled { s } else { 0.0 }));
    }
    let mut floor = floor();
    floor.positions.iter_mut().for_each(|p| p.y -= 0.5);
    cloud(extinctions, Rgb::new(0.6, 0.3, 0.4))
        .shape("floor", ShapeBuilder::new(floor, diffuse(0.6, 0.5, 0.4)))
        .shape("lamp", glowing(lamp(), Rgb::new(9.0, 8.0, 7.0)))
}

/// A cloud that is the same everywhere.
pub fn full_cloud() -> Scene {
    seen(cloud(vec![2.0; 3 * VOXELS.pow(3)], Rgb::splat(0.9)), BEFORE_CLOUD, 5)
}

/// All of a cloud's extinction grows, by channel.
pub fn thickens() -> Effect {
    changes("cloud", "sigma_t", ValueChange::Add(Rgb::new(1.0, 0.8, 0.6)))
}

pub fn parameter(name: &str, value: f64, effects: Vec<Effect>) -> Parameter {
    Parameter { name: name.into(), value, effects }
}

pub fn moves(target: &str, change: GeometryChange) -> Effect {
    Effect { target: target.into(), change: Change::Geometry(change) }
}

pub fn changes(target: &str, property: &str, op: ValueChange) -> Effect {
    let change = PropertyChange { property: property.into(), op, voxels: None, texels: None };
    Effect { target: target.into(), change: Change::Property(change) }
}

pub fn changes_voxel(target: &str, property: &str, voxel: [usize; 3], op: ValueChange) -> Effect {
    let change =
        PropertyChange { property: property.into(), op, voxels: Some(voxel), texels: None };
    Effect { target: target.into(), change: Change::Property(change) }
}

/// Of one texel of the texture that stands for a property, or of all.
pub fn changes_texel(
    target: &str,
    property: &str,
    texel: Option<[usize; 2]>,
    op: ValueChange,
) -> Effect {
    let change = PropertyChange {
        property: property.into(),
        op,
        voxels: None,
        texels: Some(texel.map_or(Texels::All, Texels::One)),
    };
    Effect { target: target.into(), change: Change::Property(change) }
}

/// A picture of random values between two, turned a little.
pub fn image(
    seed: u64,
    [low, high]: [f32; 2],
    filter: TextureFilter,
    wrap: TextureWrap,
) -> Texture {
    let mut rng = Rng::new(seed, 0, 0);
    let mut value = || low + (high - low) * rng.next_f64() as f32;
    let texels = (0..16).map(|_| [value(), value(), value()]).collect();
    let to_uv = UvMap([[1.5, 0.3, 0.1], [0.0, 1.2, 0.0]]);
    let mut image = Bitmap::new([4, 4], texels).expect("an image");
    (image.filter, image.wrap, image.to_uv) = (filter, wrap, to_uv);
    Texture::Bitmap(image)
}

pub fn textured(bsdf: Bsdf, textures: Vec<(Property, Texture)>) -> Bsdf {
    Bsdf::Textured(Box::new(Textured::new(bsdf, textures).expect("textures")))
}

/// Everything textured: a floor under a ball of rough metal, in all kinds of light.
pub fn textures() -> Scene {
    use TextureFilter::{Bilinear, Nearest};
    let metal = textured(
        metal(),
        vec![
            (Property::Alpha, image(1, [0.2, 0.5], Bilinear, TextureWrap::Repeat)),
            (Property::SpecularReflectance, image(2, [0.3, 0.9], Nearest, TextureWrap::Mirror)),
        ],
    );
    let squares = Texture::Checkerboard {
        colours: [Rgb::new(0.1, 0.2, 0.3), Rgb::splat(0.25)],
        to_uv: UvMap([[2.0, 0.0, 0.0], [0.0, 2.0, 0.0]]),
    };
    let floor = textured(
        phong(),
        vec![
            (Property::Reflectance, image(3, [0.1, 0.7], Bilinear, TextureWrap::Clamp)),
            (Property::SpecularReflectance, squares),
        ],
    );
    let mut scene = surfaces(metal, twosided(floor));
    let area = |e: &Emitter| matches!(e, Emitter::Area { .. });
    let lamp = scene.emitters.iter_mut().find(|e| area(&e.item.emitter)).expect("a lamp");
    lamp.item.emitter = Emitter::TexturedArea {
        radiance: Rgb::new(3.0, 2.5, 2.0),
        texture: image(4, [0.1, 1.0], Bilinear, TextureWrap::Repeat),
    };
    let uv = |p: Vec3| [0.3 * p.x + 0.1, 0.3 * p.z + 0.2];
    for shape in &mut scene.shapes {
        let mesh = (*shape.mesh).clone();
        let corners = (0..mesh.triangles.len() as u32).map(|i| mesh.triangle(i).map(uv)).collect();
        shape.mesh = Arc::new(mesh.with_texcoords(corners).expect("coordinates"));
    }
    scene
}

/// The sky being an image.
pub fn under_an_image(mut scene: Scene) -> Scene {
    let mut rng = Rng::new(5, 0, 0);
    let texels = (0..24).map(|_| [0; 3].map(|_| 0.1 + rng.next_f64() as f32)).collect();
    let frame = Mat3::rotation(vec3(0.48, 0.64, 0.6), 0.5);
    let map = EnvironmentMap::new([6, 4], texels, frame).expect("a map");
    let sky = scene.emitters.iter_mut().find(|e| e.id.as_deref() == Some("sky")).expect("one");
    sky.item.emitter = Emitter::Envmap { radiance: Rgb::new(0.2, 0.3, 0.5), map: Arc::new(map) };
    scene
}

pub fn grey(v: f64) -> ValueChange {
    ValueChange::Add(Rgb::splat(v))
}

pub fn shift() -> GeometryChange {
    GeometryChange::Translate(vec3(0.7, -0.4, 0.5))
}

pub fn turn() -> GeometryChange {
    GeometryChange::Rotate { axis: vec3(0.3, 1.0, -0.2), pivot: vec3(0.1, 0.2, -0.3) }
}

pub fn stretch() -> GeometryChange {
    GeometryChange::Scale { factor: vec3(0.5, -0.3, 0.2), pivot: vec3(0.1, 0.2, 0.3) }
}

/// A velocity for each vertex of a shape's file.
pub fn wobble(scene: &Scene, shape: &str, seed: u64) -> GeometryChange {
    let mesh = &scene.shapes.iter().find(|s| s.id.as_deref() == Some(shape)).expect("a shape").mesh;
    let mut rng = Rng::new(seed, 0, 0);
    let mut signed = || 2.0 * rng.next_f64() - 1.0;
    let velocities = (0..mesh.source_vertex_count).map(|_| vec3(signed(), signed(), signed()));
    GeometryChange::VertexVelocity(velocities.collect())
}

/// The image and derivatives of so many samples per pixel.
pub fn rendered(
    scene: &Scene,
    parameters: &[Parameter],
    settings: &Settings,
    spp: u32,
) -> Rendering {
    let mut session = Session::new(scene, parameters, settings).expect("a valid scene");
    assert!(session.run(spp, &Unattended));
    session.rendering()
}

/// The sum over all pixels and channels, and its standard error: pixels share samples, and channels are taken to rise and fall
/// together.
pub fn sum(layer: &Layer) -> [f64; 2] {
    let pixels = layer.pixels.len() as f64;
    [layer.total.mean, layer.total.stderr].map(|mean| mean.sum() * pixels)
}

/// A multiple of what blocks of a layer hold.
pub fn multiple(layer: &Layer, by: f64) -> Layer {
    let mut layer = layer.clone();
    layer.blocks.iter_mut().for_each(|b| b.mean *= by);
    layer
}
