//! How surface velocities best reach the inside of a medium: what each kind of field takes to
//! prepare, what a derivative image costs with it, and how noisy it is.
//!
//! `cargo bench -p drt-estimators --bench insides -- [SCENE...]`
//!
//! The work is the variance of the derivative's block means times the time of the image, over that of
//! the first kind that is listed. The plan chooses by this table where a job does not.

use std::time::Instant;

use drt_estimators::{InteriorMotion, Scene, Session, Settings, Shape, Unattended};
use drt_motion::{Change, Effect, GeometryChange, Parameter};

mod common;
use common::scenes::{self, Detail};
use common::turns::{Task, take_turns_all};

const FILM: [u32; 2] = [32, 32];
const SPP: u32 = 32;
const TURNS: usize = 3;

fn main() {
    let names: Vec<String> = std::env::args().skip(1).filter(|w| w != "--bench").collect();
    println!(
        "{:26} {:12} {:>11} {:>11} {:>9} {:>9} {:>9}",
        "scene, parameter", "inside", "prepared, s", "us a path", "time", "noise %", "work"
    );
    for (detail, suffix) in [(Detail::Coarse, "coarse"), (Detail::Fine, "fine")] {
        for subject in scenes::all(detail).map(|s| s.with_film(FILM)) {
            let asked = names.is_empty() || names.iter().any(|n| n == subject.name);
            if subject.scene.media.is_empty() || subject.name == "cloud" || !asked {
                continue;
            }
            let moves = &subject.parameters[0].1[0];
            let deforms = deformation(&subject.scene, subject.vertices_of);
            for (how, parameter) in [("moves", moves), ("deforms", &deforms)] {
                let title = format!("{} {suffix}, {how}", subject.name);
                compare(&title, &subject.scene, parameter);
            }
        }
    }
}

/// Every vertex moves by itself.
fn deformation(scene: &Scene, id: &str) -> Parameter {
    let shape = scene.shapes.iter().find(|s| s.id.as_deref() == Some(id)).expect("a shape");
    let velocity = shape
        .mesh
        .positions
        .iter()
        .map(|p| drt_math::vec3((3.0 * p.y).sin(), 0.5 * p.x * p.z, (2.0 * p.x).cos()) * 0.5);
    let change = Change::Geometry(GeometryChange::VertexVelocity(velocity.collect()));
    let effects = vec![Effect { target: id.into(), change }];
    Parameter { name: "deforms".into(), value: 0.0, effects }
}

fn compare(title: &str, scene: &Scene, parameter: &Parameter) {
    let kinds = [
        ("tetrahedral", InteriorMotion::Tetrahedral(None)),
        ("blend", InteriorMotion::Blend),
        ("mean-value", InteriorMotion::MeanValue),
        ("affine", InteriorMotion::Affine),
        ("static", InteriorMotion::Static),
    ];
    let mut sessions = Vec::new();
    let triangles = |s: &Shape| s.mesh.triangles.len();
    let large = scene.shapes.iter().map(triangles).max() > Some(1024);
    for (name, kind) in kinds {
        // What deforms is blended triangle by triangle, which takes for ever.
        if name == "blend" && large && title.ends_with("deforms") {
            continue;
        }
        let insides = vec![(0, kind)];
        let settings = Settings { threads: 1, seed: 5, insides, ..Settings::default() };
        let start = Instant::now();
        match Session::new(scene, core::slice::from_ref(parameter), &settings) {
            Ok(session) => sessions.push((name, start.elapsed().as_secs_f64(), session)),
            Err(_) if name == "affine" => {}
            Err(e) => println!("{title:26} {name:12} {e}"),
        }
    }
    let mut tasks: Vec<Task<'_>> = Vec::new();
    for (_, _, session) in &mut sessions {
        tasks.push(Box::new(|| {
            session.run(SPP, &Unattended);
        }));
    }
    let times = take_turns_all(TURNS, tasks);
    let mut first = None;
    for ((name, prepared, session), times) in sessions.iter().zip(&times) {
        let time = times.median();
        let derivative = &session.rendering().derivatives[0].total;
        let noise = derivative.relative_noise(None);
        let work = noise * noise * time;
        let (time_of_first, work_of_first) = *first.get_or_insert((time, work));
        let paths = f64::from(FILM[0] * FILM[1] * SPP);
        println!(
            "{title:26} {name:12} {prepared:11.3} {:11.2} {:9.2} {:9.2} {:9.2}",
            time / paths * 1e6,
            time / time_of_first,
            100.0 * noise,
            work / work_of_first,
        );
    }
}
