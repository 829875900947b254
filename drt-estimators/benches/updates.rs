//! What the steps of a fit pay for preparation: gradients by all vertices of a body of some 10 000 triangles that moves before each, over
//! as many gradients from what is prepared.
//!
//! `cargo bench -p drt-estimators --bench updates -- [SCENE...]`

use std::sync::Arc;
use std::time::{Duration, Instant};

use drt_estimators::{EstimatorKind, Scene, Session, Settings, Target, Unattended};
use drt_math::{Rgb, vec3};

mod common;
use common::scenes::{self, Detail};

const FILM: [u32; 2] = [128, 128];
const PIXELS: usize = 128 * 128;
const SPP: u32 = 16;
const STEPS: u32 = 10;

fn main() {
    let names: Vec<String> = std::env::args().skip(1).filter(|w| w != "--bench").collect();
    println!(
        "{:8} {:12} {:>10} {:>12} {:>12} {:>10}",
        "scene", "estimator", "update, ms", "prepare, ms", "sample, ms", "ratio"
    );
    for subject in scenes::all(Detail::Fine) {
        if !names.is_empty() && !names.iter().any(|n| n == subject.name) {
            continue;
        }
        let subject = subject.with_film(FILM);
        let Ok(Target::Shape(shape)) = subject.scene.find(subject.vertices_of) else { continue };
        for kind in [EstimatorKind::PathSpace, EstimatorKind::Radiative, EstimatorKind::Warped] {
            measure(subject.name, &subject.scene, shape, kind);
        }
    }
}

fn measure(name: &str, scene: &Scene, shape: usize, estimator: EstimatorKind) {
    let settings = Settings { estimator, threads: 1, ..Settings::default() };
    let adjoint = vec![Rgb::splat(1.0 / PIXELS as f64); PIXELS];
    let mut session = Session::new(scene, &[], &settings).expect("a valid scene");
    let gradient = |session: &mut Session| {
        let begun = Instant::now();
        let wanted = [Target::Shape(shape)];
        session.gradient(&wanted, SPP, &adjoint, &Unattended).expect("a gradient");
        begun.elapsed()
    };
    let [mut update, mut first, mut again] = [Duration::ZERO; 3];
    for step in 0..STEPS {
        let scene = stepped(scene, shape, 1e-3 * f64::from(step + 1));
        let begun = Instant::now();
        session.update(&scene, &[]).expect("a valid scene");
        update += begun.elapsed();
        first += gradient(&mut session);
        again += gradient(&mut session);
    }
    let ms = |all: Duration| 1e3 * all.as_secs_f64() / f64::from(STEPS);
    let kind = format!("{estimator:?}");
    println!(
        "{name:8} {kind:12} {:10.1} {:12.1} {:12.1} {:10.3}",
        ms(update),
        ms(first) - ms(again),
        ms(again),
        (ms(update) + ms(first)) / ms(again),
    );
}

/// The scene with a body's vertices where a step has put them.
fn stepped(scene: &Scene, shape: usize, step: f64) -> Scene {
    let mut scene = scene.clone();
    for p in &mut Arc::make_mut(&mut scene.shapes[shape].mesh).positions {
        *p += vec3((7.0 * p.y).sin(), (5.0 * p.z).cos(), (3.0 * p.x).sin()) * step;
    }
    scene
}
