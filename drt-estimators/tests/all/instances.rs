//! Instances against copies: images, and derivatives of what moves them.

use std::sync::Arc;

use crate::common::*;
use drt_estimators::surface::{Bsdf, Mask, Perturbation, Perturbed};
use drt_estimators::texture::{Bitmap, Texture};
use drt_estimators::{
    EstimatorKind, Instance, MediumBoundary, Scene, Session, Settings, Shape, Target, Unattended,
    agreement, finite_differences, gradient,
};
use drt_geom::procedural;
use drt_math::{Affine, Mat3, Rgb, Vec3, vec3};

/// Adds an instance of the first shapes that are not instances yet.
fn instance(scene: &mut Scene, id: &str, members: &[&str], to_world: Affine) {
    for name in members {
        let shape = scene.shapes.iter().find(|s| s.id.as_deref() == Some(name)).expect("a member");
        let shape = Shape { id: Some(format!("{id}/{name}")), ..shape.clone() };
        scene.instances.push(Instance { shape: scene.shapes.len(), to_world });
        scene.shapes.push(shape);
    }
}

/// A smooth ball and a cube, stretched, turned and mirrored several times over a floor and in fog.
fn scene() -> Scene {
    let cube = placed(procedural::cube(), Vec3::splat(0.3), 0.4, vec3(0.1, -0.4, 0.0));
    let veil = placed(procedural::cube(), Vec3::splat(0.35), 0.2, Vec3::Z * 0.8);
    let fog = homogeneous(Rgb::new(0.8, 0.5, 0.6), Rgb::splat(0.8), Rgb::ZERO, 0.2);
    let linear = Mat3::rotation(Vec3::X, -core::f64::consts::FRAC_PI_2) * 4.0;
    let floor = Affine { linear, translation: vec3(0.0, -1.0, 0.0) };
    let floor = procedural::rectangle().transform(&floor);
    let bulb = drt_estimators::emitter::Emitter::Point {
        position: vec3(-1.0, 2.3, 2.0),
        intensity: Rgb::new(4.0, 5.0, 6.0),
    };
    let down = Mat3::rotation(Vec3::X, core::f64::consts::FRAC_PI_2) * 0.5;
    let lamp = Affine { linear: down, translation: vec3(0.5, 2.2, 0.0) };
    let lamp = procedural::rectangle().transform(&lamp);
    let scene = SceneBuilder::new()
        .medium("fog", fog)
        .shape("ball", ShapeBuilder::new(ball(0.4, vec3(0.0, 0.5, 0.1)), phong()))
        .shape("cube", ShapeBuilder::new(cube, diffuse(0.3, 0.6, 0.7)))
        .shape("veil", ShapeBuilder::interface(veil).interior("fog"))
        .shape("floor", ShapeBuilder::new(floor, diffuse(0.6, 0.5, 0.4)))
        .shape("lamp", glowing(lamp, Rgb::new(3.0, 2.5, 2.0)))
        .emitter("bulb", bulb);
    let mut scene = seen(scene, [vec3(0.3, 0.9, 4.0), vec3(0.0, -0.1, 0.0)], 3);
    let turned = Mat3::rotation(vec3(0.48, 0.64, 0.6), 0.9) * Mat3::diagonal(vec3(0.8, 1.1, 0.7));
    let mirrored = Mat3::diagonal(vec3(-0.9, 0.8, 0.9));
    let at = |linear, x: f64, y: f64| Affine { linear, translation: vec3(x, y, 0.0) };
    instance(&mut scene, "one", &["ball", "cube", "veil"], at(turned, -0.9, 0.0));
    instance(&mut scene, "two", &["ball", "cube", "veil"], at(mirrored, 0.9, 0.1));
    scene
}

/// The same with a cube that is half there and has tilted normals.
fn dressed() -> Scene {
    let mut scene = scene();
    let of = scene.shapes.iter().position(|s| s.id.as_deref() == Some("cube")).expect("a cube");
    let (mesh, bsdf) = (scene.shapes[of].mesh.clone(), scene.shapes[of].bsdf);
    let corners = [[[0.1, 0.2], [0.9, 0.3], [0.4, 0.8]], [[0.7, 0.2], [0.0, 0.5], [0.4, 0.9]]];
    let texcoords = (0..mesh.triangles.len()).map(|t| corners[t % 2]).collect();
    let mesh = Arc::new((*mesh).clone().with_texcoords(texcoords).expect("coordinates"));
    for shape in scene.shapes.iter_mut().filter(|s| s.bsdf == bsdf) {
        shape.mesh = mesh.clone();
    }
    let map = Bitmap::new([1, 1], vec![[0.85, 0.6, 0.9]]).expect("a texel");
    let tilted = Perturbed {
        bsdf: diffuse(0.3, 0.6, 0.7),
        map: Texture::Bitmap(map),
        perturbation: Perturbation::Normals,
        flip_invalid_normals: true,
        use_shadowing_function: false,
    };
    let bsdf = &mut scene.bsdfs[bsdf].item;
    *bsdf = Bsdf::Mask(Box::new(Mask { bsdf: Bsdf::Perturbed(Box::new(tilted)), opacity: 0.6 }));
    scene
}

#[test]
fn images_are_those_of_copies() {
    compared(&scene());
    compared(&dressed());
}

fn compared(scene: &Scene) {
    let copies = scene.expanded().expect("copies");
    assert!(copies.instances.is_empty());
    let image = |scene: &Scene, seed| {
        rendered(scene, &[], &Settings { seed, ..Settings::default() }, 256).image
    };
    let (a, b) = (image(scene, 1), image(&copies, 1));
    // The same paths, but for those that rounding sends another way.
    for (a, b) in a.pixels.iter().zip(&b.pixels) {
        let off = (a.mean - b.mean).max_abs();
        assert!(off < 0.5 * a.stderr.max_channel() + 1e-9, "{a:?} {b:?}");
    }
    assert!(agreement(&image(scene, 2), &b, None).agrees);
    let mut moved = scene.clone();
    moved.instances[0].to_world.translation += Vec3::Y * 0.3;
    assert!(!agreement(&image(&moved, 2), &a, None).agrees);
}

/// Of an instance with all its edges, by each estimator; of what it is made of, in all instances.
#[test]
fn derivatives_agree() {
    let scene = scene();
    let parameters = [
        parameter("one", 0.0, vec![moves("one", shift())]),
        parameter("colour", 0.0, vec![changes("cube", "reflectance", grey(0.5))]),
    ];
    let settings = Settings { seed: 3, ..Settings::default() };
    let differences = finite_differences(&scene, &parameters, &settings, 3000, 1e-2, &Unattended);
    let differences = differences.expect("a valid scene");
    let kinds = [EstimatorKind::PathSpace, EstimatorKind::Radiative, EstimatorKind::Warped];
    for (estimator, seed) in kinds.into_iter().zip(4..) {
        let settings = Settings { estimator, seed, ..Settings::default() };
        let found = rendered(&scene, &parameters, &settings, 1500).derivatives;
        for (a, b) in found.iter().zip(&differences) {
            let agrees = agreement(&a.total, b, None);
            assert!(agrees.agrees, "{estimator:?} {} {agrees:?}", a.name);
            let flipped = multiple(&a.total, -1.0);
            assert!(!agreement(&flipped, b, None).agrees, "{estimator:?} {}", a.name);
        }
    }
}

/// Exactly the derivatives of copies that have names of their own, forward and reverse.
#[test]
fn moving_an_instance_moves_its_copies() {
    let scene = scene();
    let copies = scene.expanded().expect("copies").into_owned();
    let settings = Settings::default();
    let as_one = [parameter("p", 0.1, vec![moves("two", turn())])];
    let each = ["two/ball", "two/cube", "two/veil"].map(|id| moves(id, turn()));
    let apart = [parameter("p", 0.1, each.to_vec())];
    let a = rendered(&scene, &as_one, &settings, 8);
    let b = rendered(&copies, &apart, &settings, 8);
    let [a, b] = [&a, &b].map(|r| r.derivatives[0].total.pixels.clone());
    assert_eq!(a, b);
    assert!(a.iter().any(|p| p.mean != Rgb::ZERO));
    let adjoint = vec![Rgb::ONE; (FILM[0] * FILM[1]) as usize];
    let reverse = |scene: &Scene| {
        let wanted = ["two/cube"];
        gradient(scene, &wanted, &settings, 4, &adjoint, &Unattended).expect("a gradient")
    };
    let i = scene.shapes.iter().position(|s| s.id.as_deref() == Some("two/cube")).expect("it");
    let [a, b] = [&scene, &copies].map(|s| format!("{:?}", reverse(s).shapes[i]));
    assert_eq!(a, b);
    assert!(a.contains("Some"));
    let all = scene.find_all("two").expect("three shapes");
    assert_eq!(all.len(), 3);
    assert!(matches!(all[0], Target::Shape(_)));
    assert!(scene.find("two").is_err());
}

#[test]
fn unusable_instances_are_named() {
    let fails = |change: &dyn Fn(&mut Scene), part: &str| {
        let mut scene = scene();
        change(&mut scene);
        let message = scene.check().expect_err("refused").to_string();
        assert!(message.contains(part), "{message}");
    };
    fails(&|s| s.instances[0].shape = 99, "instance 0: its shape does not exist");
    fails(&|s| s.instances.swap(0, 1), "one/ball: it is an instance twice");
    fails(&|s| s.instances[1].to_world.linear = Mat3::ZERO, "one/cube: its instance is placed");
    let of = scene().instances[2].shape;
    fails(&|s| s.shapes[of].emitter = Some(1), "cannot emit");
    fails(
        &|s| s.shapes[of].boundary = Some(MediumBoundary { interior: Some(7), exterior: None }),
        "media",
    );
    // Many instances render, and are not copied.
    let mut many = scene();
    let mesh = Arc::new(procedural::icosphere(5));
    let of = many.instances[0];
    many.shapes[of.shape].mesh = mesh;
    let shape = many.shapes[of.shape].clone();
    for _ in 0..1700 {
        many.instances.push(Instance { shape: many.shapes.len(), ..of });
        many.shapes.push(Shape { id: None, ..shape.clone() });
    }
    Session::new(&many, &[], &Settings::default()).expect("many instances");
    let p = [parameter("cube", 0.0, vec![moves("cube", shift())])];
    let message = Session::new(&many, &p, &Settings::default()).map(|_| ()).expect_err("too many");
    assert!(message.to_string().contains("at most 33554432 fit"), "{message}");
}
