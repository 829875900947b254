//! How noisy the gradient of a loss by all vertices of a mesh is, and what it costs: with insides that
//! stay, the flux being added, and with insides carried by tetrahedra.
//!
//! `cargo bench -p drt-estimators --bench gradients -- [SCENE...]`
//!
//! The loss is the mean radiance. The noise is the standard deviation over seeds, relative to that mean:
//! of the gradient by all vertices, and of its sum, which is the derivative by a shift of the whole
//! mesh. The work is that sum's variance times the time, over that of the insides that stay; the
//! largest deviation of a seed, in standard deviations, tells heavy tails.

use drt_estimators::{InteriorMotion, Scene, Session, Settings, Target, Unattended, gradient};
use drt_math::{Rgb, Vec3};

mod common;
use common::scenes::{self, Detail};
use common::turns::{Task, take_turns};

const FILM: [u32; 2] = [16, 16];
const PIXELS: f64 = 256.0;
const SPP: u32 = 64;
const SEEDS: usize = 16;

fn main() {
    let names: Vec<String> = std::env::args().skip(1).filter(|w| w != "--bench").collect();
    println!(
        "{:18} {:12} {:>8} {:>11} {:>16} {:>9} {:>9} {:>9} {:>9}",
        "scene",
        "inside",
        "vertices",
        "prepared, s",
        "gradient / image",
        "noise",
        "of shift",
        "largest",
        "work"
    );
    let mut subjects = vec![("misty", scenes::furnace(true, 16))];
    for (detail, suffix) in [(Detail::Coarse, "coarse"), (Detail::Fine, "fine")] {
        subjects.extend(scenes::all(detail).map(|s| (suffix, s)));
    }
    for (suffix, subject) in subjects {
        let asked = names.is_empty() || names.iter().any(|n| n == subject.name);
        if subject.scene.media.is_empty() || subject.name == "cloud" || !asked {
            continue;
        }
        let subject = subject.with_film(FILM);
        let title = format!("{} {suffix}", subject.name);
        compare(&title, &subject.scene, subject.vertices_of);
    }
}

fn compare(title: &str, scene: &Scene, shape: &str) {
    let target = scene.find(shape).expect("a shape");
    let Target::Shape(shape) = target else { panic!("{title}: no shape") };
    let settings = Settings { threads: 1, ..Settings::default() };
    let mut image = Session::new(scene, &[], &settings).expect("a valid scene");
    image.run(SPP, &Unattended);
    let light = image.rendering().image.total.mean.sum();
    let adjoint = [Rgb::splat(1.0 / light / PIXELS); PIXELS as usize];
    let kinds = [
        ("static", vec![(0, InteriorMotion::Static)]),
        ("tetrahedral", vec![(0, InteriorMotion::Tetrahedral(None))]),
    ];
    let run = |kind: usize, spp, seed| -> Vec<Vec3> {
        let settings = Settings { seed, insides: kinds[kind].1.clone(), ..settings.clone() };
        let g = gradient(scene, &[target], &settings, spp, &adjoint, &Unattended);
        g.expect("a valid scene").vertices(scene, shape).expect("asked for")
    };
    let mut runs = [Vec::new(), Vec::new()];
    let [of_static, of_tetrahedral] = &mut runs;
    let tasks: [Task<'_>; 5] = [
        Box::new(|| {
            image.run(SPP, &Unattended);
        }),
        Box::new(|| drop(run(0, 1, 0))),
        Box::new(|| of_static.push(run(0, SPP, of_static.len() as u64))),
        Box::new(|| drop(run(1, 1, 0))),
        Box::new(|| of_tetrahedral.push(run(1, SPP, of_tetrahedral.len() as u64))),
    ];
    let [image, fixed, region, fixed_too, whole_too] = take_turns(SEEDS - 1, tasks);
    let times = [(fixed, region), (fixed_too, whole_too)];
    let mut first = None;
    for (((name, _), runs), (fixed, region)) in kinds.iter().zip(&runs).zip(times) {
        let sums: Vec<Vec<Vec3>> =
            runs.iter().map(|g| vec![g.iter().fold(Vec3::ZERO, |s, v| s + *v)]).collect();
        let [(noise, _), (shift, largest)] = [runs, &sums].map(|r| spread(r));
        let samples = region.without(1.0, &fixed);
        let work = shift * shift * samples.median();
        println!(
            "{title:18} {name:12} {:8} {:11.3} {:16.2} {noise:9.4} {shift:9.4} {largest:9.1} {:9.4}",
            runs[0].len(),
            fixed.median(),
            samples.over(&image),
            work / *first.get_or_insert(work),
        );
    }
}

/// The standard deviation, and the largest one over it.
fn spread(runs: &[Vec<Vec3>]) -> (f64, f64) {
    let n = runs.len() as f64;
    let mean: Vec<Vec3> = (0..runs[0].len())
        .map(|i| runs.iter().fold(Vec3::ZERO, |s, r| s + r[i]) * (1.0 / n))
        .collect();
    let squared =
        |a: &[Vec3]| -> f64 { a.iter().zip(&mean).map(|(a, b)| (*a - *b).length_squared()).sum() };
    let deviations: Vec<f64> = runs.iter().map(|r| squared(r)).collect();
    let variance = deviations.iter().sum::<f64>() / (n - 1.0);
    let largest = deviations.iter().copied().fold(0.0, f64::max);
    (variance.sqrt(), (largest / variance).sqrt())
}
