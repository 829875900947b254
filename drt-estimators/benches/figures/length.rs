//! The cost of a path against its length: the time per vertex is to stay the same.

use drt_estimators::emitter::Emitter;
use drt_estimators::{EstimatorKind, Session, Settings, Target, Unattended, gradient};
use drt_math::Rgb;

use crate::common::scenes;
use crate::common::turns::{Task, take_turns};

const TURNS: usize = 5;
const DEPTHS: [u32; 5] = [8, 16, 32, 64, 128];
/// Of the derivatives of the 2019 form.
const RADIATIVE_DEPTHS: [u32; 4] = [8, 16, 32, 64];
const FILM: [u32; 2] = [8, 8];
const PIXELS: u32 = FILM[0] * FILM[1];
/// Vertices per pixel and turn, at every depth.
const VERTICES: u32 = 512;

#[derive(Clone, Copy)]
enum Job {
    Image,
    DerivativeImage,
    Gradient,
}

pub(crate) fn print() {
    println!("LENGTH of paths: microseconds per vertex in a closed room where nothing is absorbed");
    println!();
    print!("{:6} {:17}", "room", "maximum depth");
    DEPTHS.iter().for_each(|d| print!(" {d:>6}"));
    println!(" {:>9}", "128 / 16");
    println!("{:24} {:>45}", "", "about 1");
    for misty in [false, true] {
        for (name, job) in [
            ("image", Job::Image),
            ("derivative image", Job::DerivativeImage),
            ("gradient", Job::Gradient),
        ] {
            let times = take_turns(TURNS, DEPTHS.map(|depth| task(job, misty, depth)));
            print!("{:6} {name:17}", if misty { "misty" } else { "clear" });
            for t in &times {
                print!(" {:6.3}", t.median() * 1e6 / f64::from(PIXELS * VERTICES));
            }
            println!(" {:9.2}", times[4].over(&times[1]));
        }
    }
    println!();
    radiative();
}

/// The 2019 form, where one vertex of a path looks for an edge, or all do; and that in which rays turn with edges.
fn radiative() {
    print!("{:6} {:17}", "room", "radiative, depth");
    RADIATIVE_DEPTHS.iter().for_each(|d| print!(" {d:>6}"));
    println!(" {:>9}", "64 / 16");
    for misty in [false, true] {
        let radiative = EstimatorKind::Radiative;
        for (name, estimator, every_vertex) in [
            ("one vertex looks", radiative, false),
            ("every vertex does", radiative, true),
            ("warped", EstimatorKind::Warped, false),
        ] {
            let queries = Settings { estimator, every_vertex, ..Settings::default() };
            let task = |depth| with(Job::DerivativeImage, misty, depth, &queries);
            let times = take_turns(TURNS, RADIATIVE_DEPTHS.map(task));
            print!("{:6} {name:17}", if misty { "misty" } else { "clear" });
            for t in &times {
                print!(" {:6.3}", t.median() * 1e6 / f64::from(PIXELS * VERTICES));
            }
            println!(" {:9.2}", times[3].over(&times[1]));
        }
    }
    println!();
}

/// Paths of `depth` vertices, the fewer the longer they are.
fn task(job: Job, misty: bool, depth: u32) -> Task<'static> {
    with(job, misty, depth, &Settings::default())
}

fn with(job: Job, misty: bool, depth: u32, settings: &Settings) -> Task<'static> {
    let subject = scenes::furnace(misty, depth).with_film(FILM);
    let mut scene = subject.scene;
    if settings.estimator != EstimatorKind::PathSpace {
        // Points of light are not for the 2019 form: the ball glows instead.
        scene.emitters[0].item.emitter = Emitter::Area { radiance: Rgb::ONE };
        scene
            .shapes
            .iter_mut()
            .filter(|s| s.id.as_deref() == Some("ball"))
            .for_each(|s| s.emitter = Some(0));
    }
    let settings = Settings { threads: 1, ..settings.clone() };
    let spp = VERTICES / depth;
    let parameters = match job {
        Job::Image => vec![],
        Job::DerivativeImage => subject.parameters[0].1[..1].to_vec(),
        Job::Gradient => {
            let target: Target = scene.find(subject.vertices_of).expect("a shape");
            let adjoint = [Rgb::ONE; PIXELS as usize];
            return Box::new(move || {
                gradient(&scene, &[target], &settings, spp, &adjoint, &Unattended)
                    .expect("a gradient");
            });
        }
    };
    let mut session = Session::new(&scene, &parameters, &settings).expect("a valid scene");
    Box::new(move || {
        session.run(spp, &Unattended);
    })
}
