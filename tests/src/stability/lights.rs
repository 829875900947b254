//! Lights of extreme size, at extreme places.

use std::f64::consts::{FRAC_PI_2, PI};

use drt_estimators::emitter::Emitter;
use drt_estimators::sensor::{Lens, Sensor};
use drt_geom::procedural::{cube, icosphere, rectangle};
use drt_math::{Rgb, Vec3, vec3};

use super::{Case, Condition};
use crate::Result;
use crate::matrix::Set;
use crate::matrix::effects::{add, translate, turn};
use crate::matrix::set::{at, diffuse, inside_out, placed};

pub(super) fn conditions() -> Result<Vec<Condition>> {
    Ok(vec![tiny()?, huge()?, standing()?, flat_on_a_wall()?, grazing()?, all_around()?])
}

fn furniture(camera: Vec3) -> Result<Set> {
    let floor = placed(&rectangle(), vec3(3.0, 3.0, 1.0), Vec3::X, -FRAC_PI_2, Vec3::ZERO);
    let block =
        placed(&cube(), vec3(0.35, 0.25, 0.3), vec3(0.3, 1.0, 0.2), 0.5, vec3(0.1, 0.5, 0.0));
    Ok(Set::new(camera, vec3(0.1, 0.25, 0.0), 36.0, 3)?
        .shape("floor", floor, diffuse([0.7, 0.5, 0.4]))
        .shape("block", block, diffuse([0.4, 0.6, 0.7])))
}

const ABOVE: Vec3 = vec3(-0.3, 1.5, -2.4);

/// A lamp that is the same from a distance whatever `size` it has.
fn lamp_case(size: f64, place: Vec3, radiance: f64, motion: f64) -> Result<Case> {
    let lamp = placed(&rectangle(), vec3(size, size, 1.0), Vec3::X, FRAC_PI_2, place);
    let scene = furniture(ABOVE)?.lamp("lamp", lamp, Rgb::new(0.8, 1.0, 1.2) * radiance).scene;
    let parameters = vec![
        ("lamp moves", vec![translate("lamp", vec3(0.6, -0.5, 0.3) * motion)]),
        ("lamp turns", vec![turn("lamp", vec3(0.4, 0.2, 1.0), place)]),
        ("block moves", vec![translate("block", vec3(0.8, 0.3, -0.4))]),
        ("radiance", vec![add("lamp", "radiance", [radiance, 0.5 * radiance, 2.0 * radiance])]),
        ("reflectance", vec![add("floor", "reflectance", [1.0, -0.5, 0.7])]),
    ];
    Ok(Case::new(scene, parameters))
}

fn tiny() -> Result<Condition> {
    // Off the planes of all faces: a lamp that straddles one lights it half.
    let place = vec3(0.6, 2.2, 0.5);
    let of = |size: f64| lamp_case(size, place, 4.0 / (size * size), 1.0);
    Ok(Condition::new("a lamp 1e-6 wide", of(1e-6)?, of(1e-2)?))
}

fn huge() -> Result<Condition> {
    let of = |size: f64| lamp_case(size, vec3(0.3, 1.0, 0.1) * size, 1.0, size);
    Ok(Condition::new("a lamp 1e6 wide, 1e6 away", of(1e6)?, of(1e3)?))
}

fn all_around() -> Result<Condition> {
    let radiance = Rgb::new(0.8, 1.0, 1.2);
    let ball = inside_out(at(&icosphere(1), Vec3::splat(1e6), Vec3::ZERO));
    let case = |set: Set| {
        let parameters = vec![
            ("block moves", vec![translate("block", vec3(0.8, 0.3, -0.4))]),
            ("radiance", vec![add("sky", "radiance", [1.0, 0.5, 2.0])]),
            ("reflectance", vec![add("floor", "reflectance", [1.0, -0.5, 0.7])]),
        ];
        Case::new(set.scene, parameters)
    };
    let mut hard = case(furniture(ABOVE)?.lamp("sky", ball, radiance));
    // The default lens does not see that far.
    let sensor = &mut hard.scene.sensors[0].item.sensor;
    let lens = Lens { far: 1e9, ..*sensor.lens() };
    *sensor =
        Sensor::from_to_world(&sensor.to_world(), lens, sensor.film(), sensor.filter().clone())?;
    let easy = case(furniture(ABOVE)?.light("sky", Emitter::Constant { radiance }));
    Ok(Condition::new("a sky as a ball of 1e6", hard, easy))
}

/// A lamp with an edge in the floor.
fn standing() -> Result<Condition> {
    let of = |gap: f64| -> Result<Case> {
        let lamp =
            placed(&rectangle(), vec3(0.3, 0.2, 1.0), Vec3::Y, 2.6, vec3(-0.4, 0.2 + gap, 0.6));
        let scene = furniture(ABOVE)?.lamp("lamp", lamp, Rgb::new(6.0, 7.0, 8.0)).scene;
        let parameters = vec![
            ("block moves", vec![translate("block", vec3(0.8, 0.3, -0.4))]),
            ("radiance", vec![add("lamp", "radiance", [1.0, 0.5, 2.0])]),
            ("reflectance", vec![add("floor", "reflectance", [1.0, -0.5, 0.7])]),
        ];
        Ok(Case::new(scene, parameters))
    };
    Ok(Condition::new("a lamp on the floor", of(0.0)?, of(1e-4)?))
}

/// A lamp a hair's breadth in front of a wall.
fn flat_on_a_wall() -> Result<Condition> {
    let of = |gap: f64| -> Result<Case> {
        let wall = |z| placed(&rectangle(), vec3(3.0, 3.0, 1.0), Vec3::Y, PI, vec3(0.0, 0.0, z));
        let lamp =
            placed(&rectangle(), vec3(0.4, 0.3, 1.0), Vec3::Y, PI, vec3(0.0, 1.0, 1.0 - gap));
        let scene = furniture(ABOVE)?
            .shape("wall", wall(1.0), diffuse([0.5, 0.6, 0.4]))
            .lamp("lamp", lamp, Rgb::new(6.0, 7.0, 8.0))
            .scene;
        let parameters = vec![
            ("lamp slides", vec![translate("lamp", vec3(0.6, 0.4, 0.0))]),
            ("lamp and wall move", ["lamp", "wall"].map(|id| translate(id, Vec3::Z)).into()),
            ("block moves", vec![translate("block", vec3(0.8, 0.3, -0.4))]),
            ("radiance", vec![add("lamp", "radiance", [1.0, 0.5, 2.0])]),
            ("reflectance", vec![add("wall", "reflectance", [1.0, -0.5, 0.7])]),
        ];
        Ok(Case::new(scene, parameters))
    };
    Ok(Condition::new("a lamp 1e-9 before a wall", of(1e-9)?, of(1e-4)?))
}

/// Sun and camera that graze the floor: as bright as they are steep.
fn grazing() -> Result<Condition> {
    let of = |slope: f64| -> Result<Case> {
        let sun = Emitter::Directional {
            direction: vec3(1.0, -slope, 0.3),
            irradiance: Rgb::new(0.8, 1.0, 1.2) * 3.0,
        };
        let scene = furniture(vec3(-0.3, 0.5, -2.4))?
            .light("sun", sun)
            .light("sky", Emitter::Constant { radiance: Rgb::splat(0.5) })
            .scene;
        let parameters = vec![
            ("block moves", vec![translate("block", vec3(0.8, 0.3, -0.4))]),
            ("reflectance", vec![add("floor", "reflectance", [1.0, -0.5, 0.7])]),
            ("floor sinks", vec![translate("floor", vec3(0.0, -1.0, 0.0))]),
        ];
        Ok(Case::new(scene, parameters))
    };
    Ok(Condition::new("a sun that grazes at 1e-9", of(1e-9)?, of(1e-5)?))
}
