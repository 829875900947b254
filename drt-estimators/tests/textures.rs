//! Derivatives of scenes with textures, which slide under points that move with rays.

mod common;

use common::*;
use drt_estimators::emitter::Emitter;
use drt_estimators::surface::{Bsdf, Property, Textured};
use drt_estimators::texture::{Bitmap, Texture, TextureFilter, UvMap};
use drt_estimators::{EstimatorKind, Scene, Session, Settings, Unattended, finite_differences};
use drt_geom::procedural;
use drt_math::{Rgb, Rng, Vec3, vec3};

const SPP: u32 = 512;

fn image(seed: u64, [low, high]: [f32; 2], filter: TextureFilter) -> Texture {
    let mut rng = Rng::new(seed, 0, 0);
    let mut value = || low + (high - low) * rng.next_f64() as f32;
    let texels = (0..16).map(|_| [value(), value(), value()]).collect();
    let to_uv = UvMap([[1.5, 0.3, 0.1], [0.0, 1.2, 0.0]]);
    let mut image = Bitmap::new([4, 4], texels).expect("an image");
    (image.filter, image.to_uv) = (filter, to_uv);
    Texture::Bitmap(image)
}

/// A floor that fills the view under an even sky: without its texture nothing that slides would change.
fn floor(filter: TextureFilter) -> Scene {
    let mut b = Build::default();
    let textures =
        [(Property::Reflectance, [0.1, 0.9]), (Property::SpecularReflectance, [0.0, 0.4])];
    let textures = textures.into_iter().enumerate();
    let textures = textures.map(|(i, (p, range))| (p, image(i as u64, range, filter))).collect();
    let bsdf = Bsdf::Textured(Box::new(Textured::new(phong(), textures).expect("textures")));
    let bsdf = b.bsdf("floor-bsdf", twosided(bsdf));
    let plain = procedural::rectangle();
    let uv = |p: Vec3| [0.5 * (p.x + 1.0), 0.5 * (p.y + 1.0)];
    let corners = (0..2).map(|i| plain.triangle(i).map(uv)).collect();
    let mesh = plain.with_texcoords(corners).expect("coordinates");
    let mesh = placed(mesh, vec3(9.0, 9.0, 9.0), 0.0, vec3(0.0, 0.0, 0.0));
    b.shape("floor", mesh, bsdf);
    b.light("sky", Emitter::Constant { radiance: Rgb::new(0.9, 1.0, 1.1) });
    b.camera(vec3(0.4, 0.8, 6.0), Vec3::ZERO, 2)
}

/// Mean derivatives of all pixels and channels by what each parameter moves, with their standard errors; and those by
/// finite differences.
fn both(estimator: EstimatorKind, filter: TextureFilter) -> Vec<[[f64; 2]; 2]> {
    let scene = floor(filter);
    let shift = || drt_motion::GeometryChange::Translate(vec3(0.6, 0.3, 0.0));
    let parameters =
        ["floor", "camera"].map(|target| parameter(target, 0.0, vec![moves(target, shift())]));
    let settings = Settings { estimator, threads: 1, ..Settings::default() };
    let mut session = Session::new(&scene, &parameters, &settings).expect("a valid scene");
    assert!(session.run(SPP, &Unattended));
    let rendering = session.rendering();
    let settings = Settings { estimator: EstimatorKind::FiniteDifference, ..settings };
    // Values jump, or the choice of lobes does: of small steps few samples would tell all.
    let step = 0.02;
    let differences = finite_differences(&scene, &parameters, &settings, SPP, step, &Unattended);
    let differences = differences.expect("a valid scene");
    rendering
        .derivatives
        .iter()
        .zip(&differences)
        .map(|(d, f)| {
            [&d.total, f].map(|layer| {
                let sum = |f: fn(&drt_estimators::Estimate) -> Rgb| {
                    layer.pixels.iter().map(|p| f(p).sum()).sum::<f64>()
                };
                let variance = sum(|p| p.stderr * p.stderr);
                [sum(|p| p.mean), variance.sqrt()]
            })
        })
        .collect()
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
        for [[own, error], [other, other_error]] in both(estimator, filter) {
            let error = error.hypot(other_error);
            assert!((own - other).abs() < 4.0 * error, "{estimator:?}: {own} {other} +- {error}");
            // What a texture without slopes would have is far away.
            let resolved = other.abs() > 8.0 * error;
            assert!(resolved, "{estimator:?}: {other} +- {error}");
        }
    }
}

#[test]
fn jumps_that_slide_are_refused() {
    let scene = floor(TextureFilter::Nearest);
    let parameters = [parameter("slide", 0.0, vec![moves("camera", shift())])];
    for estimator in [EstimatorKind::Radiative, EstimatorKind::Warped] {
        let settings = Settings { estimator, ..Settings::default() };
        let message = Session::new(&scene, &parameters, &settings).err().expect("a refusal");
        let message = message.to_string();
        assert!(message.contains("floor: its BSDF has a discontinuous texture"), "{message}");
        // What moves nothing slides nothing.
        let sky = [parameter("sky", 0.0, vec![changes("sky", "radiance", grey(1.0))])];
        assert!(Session::new(&scene, &sky, &settings).is_ok());
    }
}
