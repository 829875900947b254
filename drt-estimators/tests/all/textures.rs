//! Derivatives of scenes with textures, which slide under points that move with rays.

use core::f64::consts::FRAC_PI_2;

use crate::common::*;
use drt_estimators::emitter::Emitter;
use drt_estimators::surface::Property;
use drt_estimators::texture::{Bitmap, Texture, TextureFilter, TextureWrap};
use drt_estimators::{
    EstimatorKind, PathSampling, Scene, Session, Settings, Unattended, finite_differences,
};
use drt_geom::procedural;
use drt_math::{Affine, Mat3, Rgb, ValueChange, Vec3, vec3};
use drt_motion::Parameter;

const SPP: u32 = 512;

/// A floor that fills the view under an even sky: without its texture nothing that slides would change.
fn floor(filter: TextureFilter) -> Scene {
    let textures =
        [(Property::Reflectance, [0.1, 0.9]), (Property::SpecularReflectance, [0.0, 0.4])];
    let textures = textures.into_iter().enumerate();
    let textures = textures
        .map(|(i, (p, range))| (p, image(i as u64, range, filter, TextureWrap::Repeat)))
        .collect();
    let plain = procedural::rectangle();
    let uv = |p: Vec3| [0.5 * (p.x + 1.0), 0.5 * (p.y + 1.0)];
    let corners = (0..2).map(|i| plain.triangle(i).map(uv)).collect();
    let mesh = plain.with_texcoords(corners).expect("coordinates");
    let mesh = placed(mesh, vec3(9.0, 9.0, 9.0), 0.0, vec3(0.0, 0.0, 0.0));
    let scene = SceneBuilder::new()
        .shape("floor", ShapeBuilder::new(mesh, twosided(textured(phong(), textures))))
        .emitter("sky", Emitter::Constant { radiance: Rgb::new(0.9, 1.0, 1.1) });
    seen(scene, [vec3(0.4, 0.8, 6.0), Vec3::ZERO], 2)
}

/// Sums of derivatives by each parameter.
fn derivatives(
    scene: &Scene,
    parameters: &[Parameter],
    settings: &Settings,
    spp: u32,
) -> Vec<[f64; 2]> {
    let mut session = Session::new(scene, parameters, settings).expect("a valid scene");
    assert!(session.run(spp, &Unattended));
    session.rendering().derivatives.iter().map(|d| sum(&d.total)).collect()
}

/// Those by finite differences. Values jump, or the choice of lobes does: of small steps few samples would tell all.
fn differences(scene: &Scene, parameters: &[Parameter], spp: u32, step: f64) -> Vec<[f64; 2]> {
    let estimator = EstimatorKind::FiniteDifference;
    let settings = Settings { estimator, threads: 1, ..Settings::default() };
    let differences = finite_differences(scene, parameters, &settings, spp, step, &Unattended);
    differences.expect("a valid scene").iter().map(sum).collect()
}

#[test]
fn values_slide_under_moving_rays() {
    use EstimatorKind::{PathSpace, Radiative, Warped};
    for (estimator, filter) in [
        (PathSpace, TextureFilter::Nearest),
        (PathSpace, TextureFilter::Bilinear),
        (Radiative, TextureFilter::Bilinear),
        (Warped, TextureFilter::Bilinear),
    ] {
        let scene = floor(filter);
        let shift = || drt_motion::GeometryChange::Translate(vec3(0.6, 0.3, 0.0));
        let parameters =
            ["floor", "camera"].map(|target| parameter(target, 0.0, vec![moves(target, shift())]));
        let settings = Settings { estimator, threads: 1, ..Settings::default() };
        let own = derivatives(&scene, &parameters, &settings, 4 * SPP);
        let others = differences(&scene, &parameters, 4 * SPP, 0.02);
        for ([own, error], [other, other_error]) in own.into_iter().zip(others) {
            let error = error.hypot(other_error);
            assert!((own - other).abs() < 4.0 * error, "{estimator:?}: {own} {other} +- {error}");
            // What a texture without slopes would have is far away.
            let resolved = other.abs() > 8.0 * error;
            assert!(resolved, "{estimator:?}: {other} +- {error}");
        }
    }
}

/// By texels, by numbers of what has textures, and by the turn of an image around, at zero and away from it.
#[test]
fn texels_change() {
    let scene = under_an_image(textures());
    let all = |target, property, op| changes_texel(target, property, None, op);
    let some = |target, property, at, op| changes_texel(target, property, Some(at), op);
    let (grow, colours) =
        (ValueChange::MultiplyLog(1.0), ValueChange::Add(Rgb::new(0.5, 0.2, 1.0)));
    let parameters = [
        parameter("wear", 0.1, vec![all("ball", "alpha", grow)]),
        parameter("spot of wear", 0.0, vec![some("ball", "alpha", [1, 2], grey(1.0))]),
        parameter("shine", 0.0, vec![all("ball", "specular_reflectance", grow)]),
        parameter("stain", 0.0, vec![some("floor", "reflectance", [0, 1], colours)]),
        parameter("bleach", 0.2, vec![all("floor", "reflectance", grow)]),
        parameter("white", 0.0, vec![some("floor", "specular_reflectance", [1, 0], grey(1.0))]),
        parameter("pattern", 0.1, vec![all("lamp", "radiance", colours)]),
        parameter("burn", 0.0, vec![some("lamp", "radiance", [1, 1], grey(2.0))]),
        parameter("lamp", 0.0, vec![changes("lamp", "radiance", colours)]),
        parameter("cloud", 0.0, vec![some("sky", "radiance", [1, 1], colours)]),
        parameter("dawn", 0.1, vec![all("sky", "radiance", grow)]),
        parameter("sky", 0.0, vec![changes("sky", "radiance", colours)]),
        parameter("day", 0.1, vec![moves("sky", turn())]),
    ];
    use EstimatorKind::{PathSpace, Radiative, Warped};
    let ends = [PathSampling::Unidirectional, PathSampling::Bidirectional];
    let others = differences(&scene, &parameters, 4 * SPP, 0.04);
    for (estimator, sampling) in [(PathSpace, ends[0]), (Radiative, ends[0]), (Warped, ends[1])] {
        let settings = Settings { estimator, sampling, threads: 1, ..Settings::default() };
        let found = derivatives(&scene, &parameters, &settings, 4 * SPP / 2);
        for (i, parameter) in parameters.iter().enumerate() {
            let (name, [own, error], [other, other_error]) = (&parameter.name, found[i], others[i]);
            let error = error.hypot(other_error);
            assert!((own - other).abs() < 4.0 * error, "{name}: {own} {other} +- {error}");
            assert!(other.abs() > 6.0 * error, "{name}: {other} +- {error}");
        }
    }
}

#[test]
fn texels_that_are_not_there_are_refused() {
    let scene = textures();
    let fails = |effect: drt_motion::Effect, part: &str| {
        let parameters = [parameter("stain", 0.0, vec![effect])];
        let session = Session::new(&scene, &parameters, &Settings::default());
        let message = session.err().expect("a refusal").to_string();
        assert!(message.contains(part) && message.contains("stain"), "{message}");
    };
    let some = |target, property| changes_texel(target, property, Some([4, 1]), grey(1.0));
    fails(some("floor", "reflectance"), "no texel [4, 1]");
    fails(some("floor", "exponent"), "no texture stands for `exponent`");
    fails(some("bulb", "intensity"), "no texture stands for `intensity`");
    fails(some("sky", "radiance"), "no texture stands for `radiance`");
    fails(some("lamp", "radiance"), "no texel [4, 1]");
    fails(some("emitter[0]", "intensity"), "no property `intensity`");
    fails(some("camera", "fov"), "have texels");
    let colour = ValueChange::Add(Rgb::new(1.0, 0.0, 0.0));
    fails(changes_texel("ball", "alpha", None, colour), "a single number");
    fails(changes_voxel("ball", "alpha", [0, 0, 0], grey(1.0)), "have voxels");
    let image = under_an_image(textures());
    for change in [shift(), stretch()] {
        let parameters = [parameter("storm", 0.0, vec![moves("sky", change)])];
        let session = Session::new(&image, &parameters, &Settings::default());
        let message = session.err().expect("a refusal").to_string();
        assert!(message.contains("storm") && message.contains("can be turned"), "{message}");
    }
    let dark = parameter("dark", 1.0, vec![changes("floor", "reflectance", grey(-1.0))]);
    let session = Session::new(&scene, &[dark], &Settings::default());
    let message = session.err().expect("a refusal").to_string();
    assert!(message.contains("\"reflectance\" is -"), "{message}");
}

/// A lamp brighter to the right over a floor: the camera sees one of them alone.
fn glowing(filter: TextureFilter, lamp_in_view: bool) -> Scene {
    let flat = |turn: f64, size: f64, y: f64| {
        let linear = Mat3::rotation(Vec3::X, turn) * size;
        procedural::rectangle().transform(&Affine { linear, translation: vec3(0.0, y, 0.0) })
    };
    let mesh = flat(FRAC_PI_2, 2.0, 0.6);
    let uv = |p: Vec3| [0.5 + 0.25 * p.x, 0.5 + 0.25 * p.z];
    let corners = (0..2).map(|i| mesh.triangle(i).map(uv)).collect();
    let texels = (0..16).map(|i| [0.1, 0.3, 0.6, 1.0].map(|v| v + 0.02 * i as f32)[i % 4]);
    let mut ramp = Bitmap::new([4, 4], texels.map(|v| [v, 0.5 * v, 0.2]).collect()).expect("one");
    (ramp.filter, ramp.wrap) = (filter, TextureWrap::Clamp);
    let radiance = Rgb::new(3.0, 2.5, 2.0);
    let emitter = Emitter::TexturedArea { radiance, texture: Texture::Bitmap(ramp) };
    let mesh = mesh.with_texcoords(corners).expect("coordinates");
    let floor = ShapeBuilder::new(flat(-FRAC_PI_2, 9.0, -0.5), diffuse(0.7, 0.7, 0.7));
    let lamp = ShapeBuilder::new(mesh, diffuse(0.0, 0.0, 0.0)).emitter(emitter);
    let scene = SceneBuilder::new().shape("floor", floor).shape("lamp", lamp);
    let y = if lamp_in_view { 9.0 } else { -9.0 };
    seen(scene, [vec3(0.2, 0.1, 0.3), vec3(0.4, y, 0.2)], 2)
}

#[test]
fn light_slides_under_moving_rays() {
    use EstimatorKind::{PathSpace, Radiative, Warped};
    let ends = [PathSampling::Unidirectional, PathSampling::Bidirectional];
    let shift = || drt_motion::GeometryChange::Translate(vec3(0.6, 0.2, 0.3));
    let parameters =
        ["lamp", "camera"].map(|target| parameter(target, 0.0, vec![moves(target, shift())]));
    for lamp_in_view in [true, false] {
        let scene = glowing(TextureFilter::Bilinear, lamp_in_view);
        let others = differences(&scene, &parameters, 2 * SPP, 0.02);
        for (estimator, sampling) in [(PathSpace, ends[1]), (Radiative, ends[0]), (Warped, ends[1])]
        {
            let settings = Settings { estimator, sampling, threads: 1, ..Settings::default() };
            let found = derivatives(&scene, &parameters, &settings, SPP);
            for (i, parameter) in parameters.iter().enumerate() {
                let (name, [own, error], [other, other_error]) =
                    (&parameter.name, found[i], others[i]);
                let error = error.hypot(other_error);
                println!("{estimator:?} {name}: {own} {other} +- {error}");
                assert!((own - other).abs() < 4.0 * error, "{name}: {own} {other} +- {error}");
                assert!(other.abs() > 8.0 * error, "{name}: {other} +- {error}");
            }
        }
    }
}

/// Rays of `warped` turn with the lines along which a texture jumps; `radiative` refuses.
#[test]
fn jumps_that_slide_are_refused() {
    let scene = floor(TextureFilter::Nearest);
    let lamp = glowing(TextureFilter::Nearest, true);
    let parameters = [parameter("slide", 0.0, vec![moves("camera", shift())])];
    let by = |estimator| Settings { estimator, ..Settings::default() };
    let settings = by(EstimatorKind::Radiative);
    for (scene, name) in [(&scene, "floor"), (&lamp, "lamp")] {
        let message = Session::new(scene, &parameters, &settings).err().expect("a refusal");
        let message = message.to_string();
        assert!(message.contains(&format!("{name}: it has a discontinuous")), "{message}");
        assert!(Session::new(scene, &parameters, &by(EstimatorKind::Warped)).is_ok());
    }
    // What moves nothing slides nothing.
    let sky = [parameter("sky", 0.0, vec![changes("sky", "radiance", grey(1.0))])];
    assert!(Session::new(&scene, &sky, &settings).is_ok());
}
