//! Surfaces that coincide exactly look as they do with the least of gaps between them.

use std::f64::consts::FRAC_PI_2;

use drt_estimators::surface::{Bsdf, Diffuse, TwoSided};
use drt_estimators::{
    Agreement, Depth, EstimatorKind, PathSampling, Session, Settings, Unattended, agreement,
};
use drt_geom::Mesh;
use drt_geom::procedural::{cube, rectangle};
use drt_math::{Affine, Mat3, Rgb, Vec3, vec3};
use drt_medium::{Homogeneous, Phase};
use drt_motion::{Change, Effect, GeometryChange};
use drt_tests::Result;
use drt_tests::matrix::estimators::{Effort, Pairs, compare};
use drt_tests::matrix::{Cell, Set, Stage};

/// Everything is turned, so that no coordinate of a plane is exact.
fn askew(mesh: &Mesh, size: Vec3, about: Option<(Vec3, f64)>, at: Vec3) -> Mesh {
    let own = about.map_or(Mat3::IDENTITY, |(axis, angle)| Mat3::rotation(axis, angle));
    let placed = mesh.transform(&Affine { linear: own * Mat3::diagonal(size), translation: at });
    let turn = Mat3::rotation(vec3(0.36, 0.48, 0.8), 0.7);
    placed.transform(&Affine { linear: turn, translation: vec3(0.3, -0.2, 0.1) })
}

fn turned(x: Vec3) -> Vec3 {
    Mat3::rotation(vec3(0.36, 0.48, 0.8), 0.7) * x + vec3(0.3, -0.2, 0.1)
}

fn white() -> Bsdf {
    let reflectance = Rgb::new(0.7, 0.5, 0.4);
    Bsdf::Diffuse(Diffuse { reflectance })
}

fn two_sided(front: Bsdf) -> Bsdf {
    Bsdf::TwoSided(Box::new(TwoSided { front, back: None }))
}

fn fog() -> Result<Homogeneous> {
    Ok(Homogeneous::new(Rgb::new(0.8, 1.0, 1.2), Rgb::new(0.9, 0.8, 0.7), Rgb::ZERO)?)
}

/// A floor and a body on it, seen from beside.
fn floor_and_lamp(depth: u32) -> Result<Set> {
    floor_seen_from(vec3(-0.3, 1.5, -2.4), depth)
}

fn floor_seen_from(eye: Vec3, depth: u32) -> Result<Set> {
    let floor = askew(&rectangle(), vec3(2.0, 2.0, 1.0), Some((Vec3::X, -FRAC_PI_2)), Vec3::ZERO);
    let body = askew(&cube(), vec3(0.3, 0.25, 0.3), Some((Vec3::Y, 0.5)), vec3(0.1, 0.25, 0.0));
    Ok(Set::new(turned(eye), turned(vec3(0.1, 0.25, 0.0)), 40.0, depth)?
        .shape("floor", floor, white())
        .shape("body", body, white()))
}

fn lamp(set: Set, height: f64) -> Set {
    let lamp = askew(
        &rectangle(),
        vec3(0.5, 0.5, 1.0),
        Some((Vec3::X, FRAC_PI_2)),
        vec3(0.4, height, 0.3),
    );
    set.lamp("lamp", lamp, Rgb::new(6.0, 7.0, 8.0))
}

/// Fog on the floor, its lower face as much lower as said.
fn fog_on_floor(lower: f64) -> Result<Set> {
    let border = askew(&cube(), vec3(1.4, 0.7, 1.4), None, vec3(0.0, 0.7 - lower, 0.0));
    let set = floor_and_lamp(4)?.medium("fog", fog()?, Phase::henyey_greenstein(0.3)?);
    Ok(lamp(set.interface("border", border, "fog", None), 2.2))
}

fn compared(a: &Set, b: &Set, sampling: [PathSampling; 2]) -> Result<Agreement> {
    let image = |set: &Set, sampling, seed| -> Result<_> {
        let max_depth = Depth::OfScene;
        let settings = Settings { threads: 1, seed, sampling, max_depth, ..Settings::default() };
        let mut session = Session::new(&set.scene, &[], &settings)?;
        session.run(256, &Unattended);
        Ok(session.rendering().image)
    };
    Ok(agreement(&image(a, sampling[0], 1)?, &image(b, sampling[1], 2)?, None))
}

const CAMERA: [PathSampling; 2] = [PathSampling::Unidirectional; 2];
const BOTH: [PathSampling; 2] = [PathSampling::Unidirectional, PathSampling::Bidirectional];

#[test]
fn fog_stands_on_a_floor() -> Result<()> {
    let exact = fog_on_floor(0.0)?;
    for sampling in [CAMERA, BOTH] {
        let found = compared(&exact, &fog_on_floor(1e-6)?, sampling)?;
        assert!(found.agrees, "rms z {} max z {}", found.rms_z, found.max_z);
    }
    let other = compared(&exact, &fog_on_floor(-0.05)?, CAMERA)?;
    assert!(!other.agrees, "a layer of clear air above the floor is not seen");
    Ok(())
}

/// Two boxes that share a face are one, in whichever order they are listed.
#[test]
fn boxes_of_fog_share_a_face() -> Result<()> {
    let side = |x: f64, name: &str, set: Set| -> Result<Set> {
        let border = askew(&cube(), vec3(0.7, 0.7, 1.4), None, vec3(x, 0.75, 0.0));
        Ok(set
            .medium(name, fog()?, Phase::henyey_greenstein(0.3)?)
            .interface(name, border, name, None))
    };
    let whole = askew(&cube(), vec3(1.4, 0.7, 1.4), None, vec3(0.0, 0.75, 0.0));
    let one = floor_and_lamp(4)?.medium("fog", fog()?, Phase::henyey_greenstein(0.3)?);
    let one = lamp(one.interface("border", whole, "fog", None), 2.2);
    for order in [[-0.7, 0.7], [0.7, -0.7]] {
        let halves = side(order[1], "right", side(order[0], "left", floor_and_lamp(4)?)?)?;
        let found = compared(&lamp(halves, 2.2), &one, CAMERA)?;
        assert!(found.agrees, "rms z {} max z {}", found.rms_z, found.max_z);
    }
    // From inside either of them.
    for eye in [-0.5, 0.5].map(|x| vec3(x, 0.8, -1.0)) {
        let whole = askew(&cube(), vec3(1.4, 0.7, 1.4), None, vec3(0.0, 0.75, 0.0));
        let one = floor_seen_from(eye, 3)?.medium("fog", fog()?, Phase::henyey_greenstein(0.3)?);
        let one = lamp(one.interface("border", whole, "fog", None), 2.2);
        for order in [[-0.7, 0.7], [0.7, -0.7]] {
            let halves =
                side(order[1], "right", side(order[0], "left", floor_seen_from(eye, 3)?)?)?;
            let found = compared(&lamp(halves, 2.2), &one, CAMERA)?;
            assert!(found.agrees, "rms z {} max z {}", found.rms_z, found.max_z);
        }
    }
    let half = lamp(side(-0.7, "left", floor_and_lamp(4)?)?, 2.2);
    assert!(!compared(&half, &one, CAMERA)?.agrees, "half of the fog is not missed");
    Ok(())
}

/// A lamp in a ceiling's plane is seen, and one in the face of a box of fog shines into it.
#[test]
fn lamps_lie_in_other_surfaces() -> Result<()> {
    let ceiling = || {
        let at = vec3(0.0, 2.2, 0.0);
        askew(&rectangle(), vec3(2.0, 2.0, 1.0), Some((Vec3::X, FRAC_PI_2)), at)
    };
    let room = |height| -> Result<Set> {
        Ok(lamp(floor_and_lamp(3)?.shape("ceiling", ceiling(), white()), height))
    };
    for sampling in [CAMERA, BOTH] {
        let found = compared(&room(2.2)?, &room(2.2 - 1e-6)?, sampling)?;
        assert!(found.agrees, "rms z {} max z {}", found.rms_z, found.max_z);
    }
    assert!(!compared(&room(2.2)?, &room(2.2 + 1e-6)?, CAMERA)?.agrees, "a hidden lamp");
    let foggy = |height| -> Result<Set> {
        let border = askew(&cube(), vec3(1.4, 1.1, 1.4), None, vec3(0.0, 1.1, 0.0));
        let set = floor_and_lamp(3)?.medium("fog", fog()?, Phase::henyey_greenstein(0.3)?);
        Ok(lamp(set.interface("border", border, "fog", None), height))
    };
    // From the camera alone light so near to fog makes rare, large samples.
    for sampling in [CAMERA, [PathSampling::Bidirectional; 2]] {
        let found = compared(&foggy(2.2)?, &foggy(2.2 - 1e-6)?, sampling)?;
        assert!(found.agrees, "rms z {} max z {}", found.rms_z, found.max_z);
    }
    Ok(())
}

/// A lamp that slides in a ceiling's plane covers what is there, whichever way the ceiling faces.
#[test]
fn lamps_slide_in_ceilings() -> Result<()> {
    for angle in [FRAC_PI_2, -FRAC_PI_2] {
        let at = vec3(0.0, 2.2, 0.0);
        let ceiling = askew(&rectangle(), vec3(2.0, 2.0, 1.0), Some((Vec3::X, angle)), at);
        let two_sided = two_sided(white());
        let set = floor_seen_from(vec3(-0.3, 0.6, -2.4), 2)?;
        let eye = [vec3(-0.3, 0.3, -2.4), vec3(0.2, 2.0, 0.3)].map(turned);
        let view = Set::new(eye[0], eye[1], 50.0, 2)?.scene.sensors;
        let mut scene = lamp(set.shape("ceiling", ceiling, two_sided), 2.2).scene;
        scene.sensors = view;
        let slide = turned(vec3(0.7, 0.0, 0.4)) - turned(Vec3::ZERO);
        let effect = Effect {
            target: "lamp".into(),
            change: Change::Geometry(GeometryChange::Translate(slide)),
        };
        let stage =
            Stage::new("lamp in a ceiling", scene, vec![Cell::new("lamp slides", [effect])]);
        let effort = Effort { noise: 0.03, scale: 0.0, samples: 1024, seed: 0 };
        let methods = [EstimatorKind::Radiative.into(), EstimatorKind::Warped.into()];
        let pairs = compare(&stage, &methods, effort)?;
        println!("{}", Pairs(&pairs));
        assert!(pairs.len() == 2 && pairs.iter().all(|pair| pair.passes()));
    }
    Ok(())
}

#[test]
fn lamps_that_overlap_in_one_plane_are_refused() -> Result<()> {
    let other = |x: f64, height: f64| -> Result<Option<String>> {
        let size = vec3(0.5, 0.5, 1.0);
        let mesh = askew(&rectangle(), size, Some((Vec3::X, FRAC_PI_2)), vec3(x, height, 0.3));
        let set = lamp(floor_and_lamp(2)?, 2.2).lamp("other", mesh, Rgb::new(2.0, 1.0, 1.0));
        Ok(set.scene.check().err().map(|e| e.to_string()))
    };
    let refusal = other(1.3, 2.2)?.unwrap();
    assert!(refusal.contains("other: ") && refusal.contains("emitter `lamp`"), "{refusal}");
    // Beside it, and below it by the least.
    assert_eq!(other(1.4 + 1e-9, 2.2)?, None);
    assert_eq!(other(1.3, 2.2 - 1e-9)?, None);
    Ok(())
}
