//! What a scene and its settings must be: one bad value at a time, and the error that names the element.

use std::sync::Arc;

use crate::common::*;
use drt_estimators::emitter::Emitter;
use drt_estimators::surface::Bsdf;
use drt_estimators::surface::{Phong, RoughConductor, RoughDielectric, TwoSided};
use drt_estimators::{
    Error, InteriorMotion, Scene, Session, Settings, Surrounding, Target, Unattended, gradient,
};
use drt_geom::Mesh;
use drt_math::{Rgb, Vec3, vec3};
use drt_medium::Phase;

const NAN: f64 = f64::NAN;

/// A session of the scene blames the element of this name, in these words.
fn blames(name: Option<String>, words: &str, change: impl FnOnce(&mut Scene)) {
    let mut scene = fog();
    change(&mut scene);
    let error = Session::new(&scene, &[], &Settings::default()).err().expect(words);
    let text = error.to_string();
    let Error::Element { element, .. } = error else { panic!("{text}") };
    assert!(Some(element) == name && text.contains(words), "{text}");
}

fn bsdf(words: &str, bad: Bsdf) {
    blames(Some("bsdf[0]".into()), words, |scene| scene.bsdfs[0].item = bad);
}

fn emitter(words: &str, bad: Emitter) {
    blames(Some("emitter[0]".into()), words, |scene| {
        scene.shapes.iter_mut().for_each(|s| s.emitter = None);
        scene.emitters[0].item.emitter = bad;
    });
}

fn shape(words: &str, change: impl FnOnce(&mut Scene)) {
    blames(fog().shapes[0].id.clone(), words, change);
}

fn mesh(words: &str, change: impl FnOnce(&mut Mesh)) {
    shape(words, |scene| change(Arc::make_mut(&mut scene.shapes[0].mesh)));
}

#[test]
fn scattering_models() {
    for value in [NAN, -0.1, f64::INFINITY] {
        let reflectance = Rgb::new(0.5, value, 0.5);
        bsdf("\"reflectance\" is", Bsdf::Phong(Phong { reflectance, ..Phong::default() }));
        let (eta, k) = (reflectance, reflectance);
        let metal = RoughConductor::default();
        bsdf("\"eta\" is", Bsdf::RoughConductor(RoughConductor { eta, ..metal }));
        bsdf("\"k\" is", Bsdf::RoughConductor(RoughConductor { k, ..metal }));
    }
    for exponent in [NAN, 0.0, -1.0] {
        bsdf("\"exponent\" is", Bsdf::Phong(Phong { exponent, ..Phong::default() }));
    }
    for alpha in [NAN, 0.0, -0.1] {
        let (metal, glass) = (RoughConductor::default(), RoughDielectric::default());
        bsdf("\"alpha\" is", Bsdf::RoughConductor(RoughConductor { alpha, ..metal }));
        bsdf("\"alpha\" is", Bsdf::RoughDielectric(RoughDielectric { alpha, ..glass }));
    }
    for eta in [NAN, 0.0, -1.5, 1.0] {
        let glass = RoughDielectric { eta, ..RoughDielectric::default() };
        bsdf("\"eta\" is", Bsdf::RoughDielectric(glass));
    }
    bsdf("\"reflectance\" is", twosided(diffuse(-1.0, 0.5, 0.5)));
    bsdf("cannot hold", twosided(Bsdf::Null));
    bsdf("cannot hold", twosided(twosided(phong())));
    let back = Some(glass());
    bsdf("cannot hold", Bsdf::TwoSided(Box::new(TwoSided { front: phong(), back })));
}

#[test]
fn emitters() {
    let (position, direction) = (vec3(0.0, 3.0, 0.0), vec3(0.0, -2.0, 0.0));
    for (value, words) in [(NAN, "not finite"), (f64::INFINITY, "not finite"), (-1.0, "negative")] {
        let light = Rgb::new(1.0, 1.0, value);
        emitter(words, Emitter::Area { radiance: light });
        emitter(words, Emitter::Constant { radiance: light });
        emitter(words, Emitter::Point { position, intensity: light });
        emitter(words, Emitter::Directional { direction, irradiance: light });
    }
    let (light, nowhere) = (Rgb::ONE, vec3(NAN, 0.0, 0.0));
    emitter("position is not finite", Emitter::Point { position: nowhere, intensity: light });
    emitter("zero vector", Emitter::Directional { direction: Vec3::ZERO, irradiance: light });
    emitter("not finite", Emitter::Directional { direction: nowhere, irradiance: light });
    for (cutoff_angle, beam_width) in [(0.3, 0.4), (0.0, 0.0), (4.0, 0.1), (0.3, -0.1), (NAN, 0.1)]
    {
        let intensity = light;
        emitter(
            "cutoff_angle is",
            Emitter::Spot { position, direction, intensity, cutoff_angle, beam_width },
        );
    }
}

#[test]
fn meshes() {
    mesh("below 1e100", |m| m.positions[0].x = NAN);
    mesh("below 1e100", |m| m.positions[0].x = 1e101);
    mesh("names vertex 1000", |m| m.triangles[0][1] = 1000);
    mesh("normals", |m| m.normals = Some(vec![Vec3::Z]));
    mesh("the normal of vertex 0", |m| m.normals = Some(vec![Vec3::ZERO; m.positions.len()]));
}

#[test]
fn shapes_and_media() {
    shape("there is no bsdf 99", |s| s.shapes[0].bsdf = 99);
    shape("its emitter does not exist", |s| s.shapes[0].emitter = Some(99));
    shape("type `point`", |s| {
        s.emitters[0].item.emitter = Emitter::Point { position: Vec3::ZERO, intensity: Rgb::ONE };
        s.shapes[0].emitter = Some(0);
    });
    for g in [NAN, 1.0, -1.0] {
        let medium = fog().media[0].id.clone();
        let phase = Phase::HenyeyGreenstein { g };
        blames(medium, "between -1 and 1", |s| s.media[0].item.phase = phase);
    }
    let elsewhere = |s: &mut Scene| s.sensors[0].item.medium = Surrounding::Stated(Some(9));
    blames(fog().sensors[0].id.clone(), "one of its media", elsewhere);
}

/// What settings and gradients name must exist, in both modes.
#[test]
fn settings_and_targets() {
    let scene = fog();
    let adjoint = vec![Rgb::ONE; (FILM[0] * FILM[1]) as usize];
    let reverse = |wanted: &[Target], settings: &Settings| {
        let gradient = gradient(&scene, wanted, settings, 1, &adjoint, &Unattended);
        gradient.expect_err("an error").to_string()
    };
    let insides = vec![(7, InteriorMotion::Static)];
    for (settings, words) in [
        (Settings { sensor: 3, ..Settings::default() }, "there is no sensor 3; the scene has 1"),
        (Settings { insides, ..Settings::default() }, "there is no medium 7"),
        (Settings { step: 0.0, ..Settings::default() }, "is 0; expected a positive number"),
        (Settings { boundary_ratio: Some(NAN), ..Settings::default() }, "`boundary_ratio`: is NaN"),
    ] {
        let forward = Session::new(&scene, &[], &settings).err().expect("an error").to_string();
        assert_eq!(forward, reverse(&[], &settings));
        assert!(forward.contains(words), "{forward}");
    }
    assert!(reverse(&[Target::Shape(99)], &Settings::default()).contains("`shape[99]`"));
}
