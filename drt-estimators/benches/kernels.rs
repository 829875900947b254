//! Nanoseconds per call of the functions that paths are made of.
//!
//! `cargo bench -p drt-estimators --bench kernels`
//!
//! The functions of a row take turns on the same random inputs. What differentiates a recorded path
//! and contracts it with velocities is not public; it is measured at the end through a small room,
//! as differences of whole runs without boundary samples.

use std::cell::RefCell;
use std::hint::black_box;

use drt_estimators::filter::{Filter, FilterKind};
use drt_estimators::surface::{
    Bsdf, Diffuse, Distribution, Given, Phong, RoughConductor, RoughDielectric,
};
use drt_estimators::{Session, Settings, Unattended};
use drt_geom::{Mesh, TriangleBvh};
use drt_math::{Affine, Rgb, Rng, Vec3, vec3};
use drt_medium::Phase;
use drt_motion::interior::{Blend, Site};
use drt_motion::surface::{JetAdjoint, SurfaceElement, VertexGradient};
use drt_motion::{Parameter, SurfaceMotion, SurfacePoint};

mod common;
use common::scenes::{self, Detail};
use common::turns::{Task, Times, take_turns};

/// Calls of a turn.
const CALLS: usize = 1000;
const TURNS: usize = 100;

fn main() {
    phases();
    surfaces();
    filters();
    motions();
    paths();
}

/// Times of functions of the number of the call, in turns.
fn per_call<const N: usize>(functions: [Box<dyn Fn(usize) + '_>; N]) -> [f64; N] {
    let tasks = functions.map(|f| -> Task<'_> { Box::new(move || (0..CALLS).for_each(&f)) });
    take_turns(TURNS, tasks).map(|t| t.median() / CALLS as f64 * 1e9)
}

/// A kernel whose result is kept from the optimiser.
fn kernel<'a, T>(f: impl Fn(usize) -> T + 'a) -> Box<dyn Fn(usize) + 'a> {
    Box::new(move |i| {
        black_box(f(i));
    })
}

fn directions(seed: u64) -> Vec<Vec3> {
    let mut rng = Rng::new(seed, 0, 0);
    let mut signed = || 2.0 * rng.next_f64() - 1.0;
    (0..CALLS).map(|_| vec3(signed(), signed(), signed()).normalize()).collect()
}

fn numbers() -> Vec<[f64; 3]> {
    let mut rng = Rng::new(3, 0, 0);
    (0..CALLS).map(|_| [rng.next_f64(), rng.next_f64(), rng.next_f64()]).collect()
}

fn phases() {
    println!("{:18} {:>8} {:>8} {:>8}", "phase function, ns", "eval", "sample", "gradient");
    let (from, to, u) = (directions(1), directions(2), numbers());
    for (name, phase) in [
        ("isotropic", Phase::Isotropic),
        ("henyey-greenstein", Phase::HenyeyGreenstein { g: 0.7 }),
        ("rayleigh", Phase::Rayleigh),
    ] {
        let phase = phase.at(Vec3::ZERO);
        let row = per_call([
            kernel(|i| phase.eval(from[i], to[i])),
            kernel(|i| phase.sample(from[i], [u[i][0], u[i][1]])),
            kernel(|i| phase.gradient(from[i], to[i])),
        ]);
        println!("{name:18}{}", columns(&row));
    }
    println!();
}

fn surfaces() {
    println!(
        "{:18} {:>8} {:>8} {:>8} {:>8} {:>15}",
        "surface, ns", "eval", "pdf", "sample", "gradient", "gradient / eval"
    );
    let (mut wo, mut wi, u) = (directions(1), directions(2), numbers());
    // On the side where all models scatter.
    for w in wo.iter_mut().chain(&mut wi) {
        w.z = w.z.abs();
    }
    let ggx = Distribution::Ggx;
    for (name, bsdf) in [
        ("diffuse", Bsdf::Diffuse(Diffuse { reflectance: Rgb::splat(0.5) })),
        ("phong", Bsdf::Phong(Phong::default())),
        (
            "rough conductor",
            Bsdf::RoughConductor(RoughConductor { distribution: ggx, ..Default::default() }),
        ),
        (
            "rough dielectric",
            Bsdf::RoughDielectric(RoughDielectric { distribution: ggx, ..Default::default() }),
        ),
    ] {
        let bsdf = &black_box(bsdf);
        let row = per_call([
            kernel(|i| bsdf.eval(wo[i], wi[i], Vec3::Z)),
            kernel(|i| bsdf.pdf(wo[i], wi[i], Vec3::Z, Given::Wo)),
            kernel(|i| bsdf.sample(wo[i], Vec3::Z, u[i], Given::Wo)),
            kernel(|i| bsdf.gradient(wo[i], wi[i], Vec3::Z)),
        ]);
        println!("{name:18}{} {:15.2}", columns(&row), row[3] / row[0]);
    }
    println!();
}

fn filters() {
    println!("{:18} {:>8} {:>8}", "filter, ns", "eval", "gradient");
    let u = numbers();
    for (name, kind) in [("tent", FilterKind::TENT), ("gaussian", FilterKind::GAUSSIAN)] {
        let filter = Filter::new(kind).expect("a filter");
        let row = per_call([
            kernel(|i| filter.eval(u[i][0], u[i][1])),
            kernel(|i| filter.gradient(u[i][0], u[i][1])),
        ]);
        println!("{name:18}{}", columns(&row));
    }
    println!();
}

/// What a contraction and a scatter at a point are made of, on the knot.
fn motions() {
    println!(
        "{:18} {:>8} {:>8} {:>8} {:>8} {:>8}",
        "motion, ns", "element", "affine", "vertices", "scatter", "blend"
    );
    let [_, room, ..] = scenes::all(Detail::Fine);
    let mesh = |id: &str| {
        let shape = room.scene.shapes.iter().find(|s| s.id.as_deref() == Some(id));
        &shape.expect("a shape").mesh
    };
    let (knot, walls) = (mesh("knot"), mesh("walls"));
    let site = |m: &Mesh| Site::Surface(TriangleBvh::build(&m.soup()).expect("finite triangles"));
    let blend = Blend::new(vec![site(knot), site(walls)]);
    let rigid = SurfaceMotion::Affine(Affine::IDENTITY);
    let each = SurfaceMotion::Vertices { positions: knot.positions.clone().into(), normals: None };
    let (u, out) = (numbers(), directions(1));
    let points: Vec<SurfacePoint> = (0..CALLS)
        .map(|i| {
            let triangle = (u[i][2] * knot.triangles.len() as f64) as u32;
            SurfacePoint { triangle, bary: [0.5 * u[i][0], 0.5 * u[i][1]] }
        })
        .collect();
    let elements: Vec<_> = points.iter().map(|p| SurfaceElement::new(knot, p)).collect();
    let gradient = RefCell::new(VertexGradient::zeros(knot));
    let weights = RefCell::new(Vec::new());
    let row = per_call([
        kernel(|i| SurfaceElement::new(knot, &points[i])),
        kernel(|i| rigid.jet_of(&elements[i])),
        kernel(|i| each.jet_of(&elements[i])),
        kernel(|i| {
            let adjoint = JetAdjoint { u: out[i], n: out[i], ns: out[i], j: 1.0 };
            gradient.borrow_mut().scatter(knot, &points[i], &adjoint);
        }),
        kernel(|i| blend.weights(out[i] * 4.0, &mut weights.borrow_mut())),
    ]);
    println!("{:18}{}", "", columns(&row));
    println!();
}

/// What a vertex of a path costs: traced; recorded, differentiated and contracted with one parameter;
/// contracted with another one of the same kind.
fn paths() {
    const DEPTH: u32 = 16;
    const SPP: u32 = 16;
    const FILM: [u32; 2] = [8, 8];
    println!(
        "{:6} {:11} {:>8} {:>15} {:>18}",
        "vertex, ns", "", "traced", "differentiated", "another parameter"
    );
    for misty in [false, true] {
        let subject = scenes::furnace(misty, DEPTH).with_film(FILM);
        for (kind, ten) in &subject.parameters {
            let task = |parameters: &[Parameter]| -> Task<'_> {
                // Next to no boundary samples.
                let boundary_ratio = Some(1.0 / f64::from(SPP));
                let settings = Settings { boundary_ratio, threads: 1, ..Settings::default() };
                let mut session =
                    Session::new(&subject.scene, parameters, &settings).expect("a valid scene");
                Box::new(move || {
                    session.run(SPP, &Unattended);
                })
            };
            let [none, one, all] = take_turns(9, [task(&[]), task(&ten[..1]), task(ten)]);
            let vertices = f64::from(DEPTH * SPP * FILM[0] * FILM[1]);
            let ns = |t: &Times| t.median() / vertices * 1e9;
            println!(
                "{:6} {kind:11} {:8.0} {:15.0} {:18.0}",
                subject.name,
                ns(&none),
                ns(&one.without(1.0, &none)),
                ns(&all.without(1.0, &one)) / (ten.len() - 1) as f64,
            );
        }
    }
}

fn columns(row: &[f64]) -> String {
    row.iter().map(|ns| format!(" {ns:8.1}")).collect()
}
