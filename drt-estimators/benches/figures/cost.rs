//! What derivatives cost, in units of the image: one parameter, ten, and the gradient of a loss by
//! all vertices of a mesh.

use drt_estimators::{
    EstimatorKind, Rendering, Scene, Session, Settings, Target, Unattended, gradient,
};
use drt_math::Rgb;
use drt_motion::Parameter;

use crate::common::scenes::{self, Detail, Subject};
use crate::common::turns::{Task, take_turns};

const TURNS: usize = 5;
/// Samples per pixel of a turn, interior and boundary alike: as many as an image is rendered with,
/// on few pixels.
const SPP: u32 = 64;
const FILM: [u32; 2] = [16, 16];

/// How derivatives are estimated.
struct Way {
    name: &'static str,
    estimator: EstimatorKind,
    boundary_ratio: f64,
    /// With the lights that shine from a point, for which `radiative` needs `path-space` as well.
    points: bool,
}

const WAYS: [Way; 5] = [
    Way::new("path-space", EstimatorKind::PathSpace, 1.0, true),
    Way::new("radiative", EstimatorKind::Radiative, 1.0, false),
    Way::new("and a bulb", EstimatorKind::Radiative, 1.0, true),
    Way::new("its 1/8", EstimatorKind::Radiative, 0.125, true),
    Way::new("warped", EstimatorKind::Warped, 1.0, false),
];

impl Way {
    const fn new(
        name: &'static str,
        estimator: EstimatorKind,
        boundary_ratio: f64,
        points: bool,
    ) -> Self {
        Self { name, estimator, boundary_ratio, points }
    }
}

const PIXELS: usize = (FILM[0] * FILM[1]) as usize;

pub(crate) fn print() {
    println!(
        "COST of derivatives, at as many interior and boundary samples as the image has, or an"
    );
    println!(
        "eighth of the latter (\"rays\" are those of a sample of a pixel; a gradient is that by all"
    );
    println!(
        "vertices of the mesh named; for \"radiative\" and \"warped\" the bulb is out, unless it says so)"
    );
    println!();
    println!(
        "{:9} {:11} {:13} {:>8} {:>6} {:>12} {:>6} {:>13}",
        "scene", "parameter", "estimator", "us/path", "rays", "one / image", "rays", "ten / one"
    );
    println!("{:44} {:>6} {:>12} {:>6} {:>13}", "", "", "<= 2.5, 3", "", "<= 1.3");
    let subjects = scenes::all(Detail::Fine).map(|subject| subject.with_film(FILM));
    for subject in &subjects {
        for (kind, ten) in &subject.parameters {
            for way in &WAYS {
                parameters(subject, kind, ten, way);
            }
        }
    }
    println!();
    println!(
        "{:9} {:11} {:>8} {:>15} {:>6} {:>13}",
        "scene", "gradient by", "vertices", "gradient / image", "rays", "prepared in ms"
    );
    println!("{:9} {:11} {:>8} {:>15}", "", "", "", "<= 4");
    for subject in &subjects {
        vertices(subject);
    }
    println!();
}

fn settings() -> Settings {
    Settings { threads: 1, seed: 3, ..Settings::default() }
}

fn session(scene: &Scene, parameters: &[Parameter], settings: &Settings) -> Session {
    Session::new(scene, parameters, settings).expect("a valid scene")
}

/// Goes on with a run.
fn more(session: &mut Session) -> Task<'_> {
    Box::new(|| {
        session.run(SPP, &Unattended);
    })
}

/// Rays of all paths that a sample of a pixel takes: a session of two parts follows one in each.
fn rays_a_sample(session: &Session) -> f64 {
    let Rendering { counters, spp, .. } = session.rendering();
    counters.rays as f64 / (f64::from(spp) * PIXELS as f64)
}

fn parameters(
    subject: &Subject,
    kind: &str,
    ten: &[Parameter],
    &Way { name, estimator, boundary_ratio, points }: &Way,
) {
    let mut scene = subject.scene.clone();
    scene.emitters.retain(|e| points || !e.item.emitter.is_delta());
    let settings = Settings { estimator, boundary_ratio: Some(boundary_ratio), ..settings() };
    let [mut image, mut one, mut all] =
        [&[][..], &ten[..1], ten].map(|parameters| session(&scene, parameters, &settings));
    let [forward, single, tenfold] =
        take_turns(TURNS, [more(&mut image), more(&mut one), more(&mut all)]);
    let paths = f64::from(SPP) * PIXELS as f64;
    println!(
        "{:9} {kind:11} {name:13} {:8.2} {:6.1} {:12.2} {:6.1} {:13.2}",
        subject.name,
        forward.median() / paths * 1e6,
        rays_a_sample(&image),
        single.over(&forward),
        rays_a_sample(&one),
        tenfold.over(&single),
    );
}

fn vertices(subject: &Subject) {
    let scene = &subject.scene;
    let target = scene.find(subject.vertices_of).expect("a shape");
    let Target::Shape(shape) = target else { panic!("{} is no shape", subject.vertices_of) };
    let adjoint = [Rgb::ONE; PIXELS];
    let call = |spp| {
        gradient(scene, &[target], &settings(), spp, &adjoint, &Unattended).expect("a valid scene")
    };
    // What a call does whatever the number of samples: the least it can be asked for.
    const LEAST: u32 = 2;
    let mut image = session(scene, &[], &settings());
    let [forward, fixed, all] = take_turns(
        TURNS,
        [more(&mut image), Box::new(|| drop(call(LEAST))), Box::new(|| drop(call(SPP + LEAST)))],
    );
    let samples = all.without(1.0, &fixed);
    let preparation = fixed.without(f64::from(LEAST) / f64::from(SPP), &samples);
    let counters = call(SPP + LEAST).counters;
    println!(
        "{:9} {:11} {:8} {:15.2} {:6.1} {:13.1}",
        subject.name,
        subject.vertices_of,
        scene.shapes[shape].mesh.positions.len(),
        samples.over(&forward),
        counters.rays as f64 / counters.paths as f64,
        preparation.median() * 1e3,
    );
}
