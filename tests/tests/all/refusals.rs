//! The rows of the derivative matrix that are refusals: every one names the parameter and the object.

use std::f32::consts::PI;

use drt_estimators::EstimatorKind::{PathSpace, Radiative, Warped};
use drt_estimators::emitter::Emitter;
use drt_estimators::surface::{
    Bsdf, Coating, Conductor, Dielectric, Diffuse, Mask, Measured, MeasuredTables, Perturbation,
    Perturbed, Plastic, Principled, PrincipledThin, Property, RoughConductor, Textured,
    ThinDielectric,
};
use drt_estimators::texture::{Bitmap, Texture, UvMap};
use drt_estimators::{
    AuxiliarySamples, EstimatorKind, Named, PathSampling, Scene, SceneEmitter, Session, Settings,
    Surrounding, Warp,
};
use drt_math::{Rgb, ValueChange, Vec3, vec3};
use drt_tests::matrix::{Cell, Stage, lenses, materials, still, textures};
use drt_tests::motion::changes;

/// What a session says of the stage's parameter of a name, if it refuses it.
fn refusal(scene: &Scene, stage: &Stage, name: &str, estimator: EstimatorKind) -> Option<String> {
    refusal_with(scene, stage, name, &Settings { estimator, ..Settings::default() })
}

fn refusal_with(scene: &Scene, stage: &Stage, name: &str, settings: &Settings) -> Option<String> {
    let cell = stage.cells.iter().find(|c| c.parameter.name == name).expect("a cell");
    let session = Session::new(scene, std::slice::from_ref(&cell.parameter), settings);
    session.err().map(|e| e.to_string())
}

/// Of the stage's panel that moves, by auxiliary samples of either kind.
fn by_samples(scene: &Scene, stage: &Stage) -> Option<String> {
    let by = |warp: fn(AuxiliarySamples) -> Warp| {
        let warp = warp(AuxiliarySamples::default());
        let settings = Settings { estimator: Warped, warp, ..Settings::default() };
        refusal_with(scene, stage, "panel moves", &settings)
    };
    let [points, directions] = [by(Warp::Points), by(Warp::Directions)];
    assert_eq!(points, directions);
    points
}

fn assert_refused(message: Option<String>, parts: &[&str]) {
    let message = message.unwrap_or_else(|| panic!("{parts:?}: not refused"));
    assert!(parts.iter().all(|part| message.contains(part)), "{parts:?}: {message}");
}

/// The panel of another material.
fn of(bsdf: Bsdf) -> (Stage, Scene) {
    let stage = materials::coated().unwrap();
    let mut scene = stage.scene.clone();
    let panel = scene.shapes[0].bsdf;
    scene.bsdfs[panel].item = bsdf;
    (stage, scene)
}

/// A map of the surface's own normals, or of one height.
fn perturbed(bsdf: Bsdf, perturbation: Perturbation) -> Bsdf {
    Bsdf::Perturbed(Box::new(Perturbed {
        bsdf,
        map: Texture::Bitmap(Bitmap::new([1, 1], vec![[0.5, 0.5, 1.0]]).unwrap()),
        perturbation,
        flip_invalid_normals: true,
        use_shadowing_function: true,
    }))
}

#[test]
fn materials_without_derivatives() {
    // Numbers for a quarter of a turn, too coarse to go on in the next one.
    let tables = MeasuredTables::of_metal(
        &RoughConductor::default(),
        [0.6, 0.2],
        &[-PI, -0.75 * PI, -0.5 * PI],
        [5, 9, 5],
    );
    let quarter = Measured::new(tables.unwrap()).unwrap();
    let mirror = || Bsdf::Conductor(Conductor::default());
    for bsdf in [
        perturbed(mirror(), Perturbation::Normals),
        perturbed(mirror(), Perturbation::Heights(0.1)),
        Bsdf::Measured(quarter.into()),
    ] {
        let kind = bsdf.name();
        let (stage, scene) = of(bsdf);
        for estimator in [PathSpace, Radiative, Warped] {
            let message = refusal(&scene, &stage, "panel moves", estimator);
            assert_refused(message, &["panel moves", "panel", kind, "finite differences"]);
        }
    }
}

/// Smooth surfaces may move, but not under light that jumps in shadows where these may be sheets in a volume, and not if they emit.
#[test]
fn what_smooth_surfaces_have_no_terms_for() {
    let inner = || Bsdf::Diffuse(Diffuse::default());
    for bsdf in [
        Bsdf::Conductor(Conductor::default()),
        Bsdf::Dielectric(Dielectric::default()),
        Bsdf::ThinDielectric(ThinDielectric::default()),
        Bsdf::Plastic(Plastic::new(Coating::smooth(1.5).unwrap())),
        Bsdf::Mask(Box::new(Mask { bsdf: inner(), opacity: 0.5 })),
    ] {
        let (stage, scene) = of(bsdf);
        let mut lit = scene.clone();
        let (position, intensity) = (vec3(0.0, 2.0, 0.0), Rgb::ONE);
        let bulb = SceneEmitter {
            emitter: Emitter::Point { position, intensity },
            medium: Surrounding::Counted,
        };
        lit.emitters.push(Named::new("bulb", bulb));
        let mut veiled = lit.clone();
        veiled.bsdfs.push(Named::new("veil", Bsdf::Null));
        let mut glowing = scene.clone();
        glowing.shapes[0].emitter = Some(0);
        for estimator in [PathSpace, Radiative, Warped] {
            assert_eq!(refusal(&scene, &stage, "panel moves", estimator), None);
            assert_eq!(refusal(&lit, &stage, "panel moves", estimator), None);
            let message = refusal(&veiled, &stage, "panel moves", estimator);
            assert_refused(message, &["panel moves", "panel", "bulb", "finite differences"]);
            let message = refusal(&glowing, &stage, "panel moves", estimator);
            assert_refused(message, &["panel moves", "panel", "emits", "finite differences"]);
        }
        let message = by_samples(&scene, &stage);
        assert_refused(message, &["warp", "smooth"]);
    }
}

#[test]
fn numbers_without_derivatives() {
    let tinted = Principled { spec_tint: 0.4, ..Principled::default() };
    let thin = PrincipledThin { sheen: 0.4, sheen_tint: 0.4, ..PrincipledThin::default() };
    for bsdf in [Bsdf::Principled(Box::new(tinted)), Bsdf::PrincipledThin(Box::new(thin))] {
        let kind = bsdf.name();
        let (_, scene) = of(bsdf);
        for estimator in [PathSpace, Radiative, Warped] {
            let stage = materials::principled().unwrap();
            let message = refusal(&scene, &stage, "base_color", estimator);
            assert_refused(message, &["base_color", "bsdf[0]", kind, "tint", "finite differences"]);
            assert_eq!(refusal(&scene, &stage, "roughness", estimator), None);
        }
    }
}

#[test]
fn light_that_would_turn_or_go_nowhere() {
    let mirrors = still::mirrors().unwrap();
    let veiled = still::veiled().unwrap();
    let with = |scene: &Scene, target, property| {
        let cell = Cell::new(property, [changes(target, property, ValueChange::Add(Rgb::ONE))]);
        Stage::new("still", scene.clone(), vec![cell])
    };
    // An index of refraction turns light, as what moves does.
    let mut lit = mirrors.scene.clone();
    let emitter = Emitter::Point { position: Vec3::Y, intensity: Rgb::ONE };
    let medium = Surrounding::Counted;
    lit.emitters.push(Named::new("bulb", SceneEmitter { emitter, medium }));
    lit.bsdfs.push(Named::new("veil", Bsdf::Null));
    let bends = with(&lit, "glass", "eta");
    let mut whole = veiled.scene.clone();
    let card = whole.shapes.iter().position(|s| s.id.as_deref() == Some("card")).unwrap();
    let bsdf = whole.shapes[card].bsdf;
    let Bsdf::Mask(mask) = &mut whole.bsdfs[bsdf].item else { panic!("the card is masked") };
    mask.opacity = 1.0;
    let whole = with(&whole, "card", "opacity");
    for estimator in [PathSpace, Radiative, Warped] {
        let message = refusal(&bends.scene, &bends, "eta", estimator);
        assert_refused(message, &["`eta` moves something", "bulb"]);
        let message = refusal(&whole.scene, &whole, "opacity", estimator);
        assert_refused(message, &["opacity", "mask", "at 0 and 1", "finite differences"]);
    }
    // Paths from both ends do not know what they owe to smooth surfaces.
    let settings = Settings { sampling: PathSampling::Bidirectional, ..Settings::default() };
    let stage = with(&mirrors.scene, "wall", "reflectance");
    let mut scene = stage.scene.clone();
    scene.shapes.retain(|s| s.id.as_deref() != Some("pane"));
    let parameters = [stage.cells[0].parameter.clone()];
    let message = Session::new(&scene, &parameters, &settings).err().map(|e| e.to_string());
    assert_refused(message, &["sampling", "mirror", "unidirectional"]);
}

#[test]
fn frames_without_coordinates() {
    let stage = materials::brushed().unwrap();
    let mut scene = stage.scene.clone();
    let mut mesh = scene.shapes[0].mesh.as_ref().clone();
    mesh.texcoords = None;
    scene.shapes[0].mesh = mesh.into();
    for estimator in [PathSpace, Radiative, Warped] {
        let message = refusal(&scene, &stage, "panel moves", estimator);
        assert_refused(message, &["panel moves", "panel", "texture coordinates"]);
    }
}

#[test]
fn textures_that_jump_under_sliding_points() {
    let colours = [Rgb::splat(0.2), Rgb::splat(0.8)];
    let board = || Texture::Checkerboard { colours, to_uv: UvMap::IDENTITY };
    let textured = |bsdf, property| {
        Bsdf::Textured(Box::new(Textured::new(bsdf, vec![(property, board())]).unwrap()))
    };
    let grey = || Bsdf::Diffuse(Diffuse::default());
    let (stage, squares) = of(textured(grey(), Property::Reflectance));
    let mosaic = textures::mosaic().unwrap().scene;
    let refused = ["panel moves", "panel", "discontinuous texture"];
    for scene in [&squares, &mosaic] {
        assert_refused(refusal(scene, &stage, "panel moves", Radiative), &refused);
        assert_refused(by_samples(scene, &stage), &refused);
        for estimator in [PathSpace, Warped] {
            assert_eq!(refusal(scene, &stage, "panel moves", estimator), None);
        }
    }
    // Slopes of heights jump everywhere, and lines on smooth surfaces are not followed where normals are interpolated.
    let (_, bumpy) = of(perturbed(grey(), Perturbation::Heights(0.1)));
    for estimator in [Radiative, Warped] {
        assert_refused(refusal(&bumpy, &stage, "panel moves", estimator), &refused);
    }
    assert_eq!(refusal(&bumpy, &stage, "panel moves", PathSpace), None);
    let mask = Bsdf::Mask(Box::new(Mask { bsdf: grey(), opacity: 0.5 }));
    let (_, mut cut) = of(textured(mask, Property::Opacity));
    assert_eq!(refusal(&cut, &stage, "panel moves", Warped), None);
    let mesh = cut.shapes[0].mesh.as_ref().clone().with_smooth_normals();
    cut.shapes[0].mesh = mesh.into();
    assert_refused(refusal(&cut, &stage, "panel moves", Warped), &refused);
}

#[test]
fn skies_of_images_over_what_moves() {
    let (stage, sky) = (materials::coated().unwrap(), textures::sky_and_slide().unwrap());
    let mut scene = sky.scene.clone();
    scene.emitters.retain(|e| e.id.as_deref() != Some("projector"));
    assert_refused(by_samples(&scene, &stage), &["warp", "auxiliary", "environments"]);
    // The projector's picture ends where it is bright.
    let message = refusal(&sky.scene, &stage, "panel moves", PathSpace);
    assert_refused(message, &["panel moves", "projector", "black border"]);
    let name = "a texel of the sky";
    assert_eq!(refusal(&sky.scene, &sky, name, Radiative), None);
}

#[test]
fn lenses_of_some_estimators() {
    let lens = lenses::thin_lens().unwrap();
    assert_refused(by_samples(&lens.scene, &lens), &["warp", "auxiliary", "aperture"]);
    let parallel = lenses::parallel_rays().unwrap();
    let message = refusal(&parallel.scene, &parallel, "panel moves", Warped);
    assert_refused(message, &["camera", "orthographic", "path-space"]);
    assert_eq!(refusal(&parallel.scene, &parallel, "panel moves", Radiative), None);
}
