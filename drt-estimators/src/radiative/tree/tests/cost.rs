use std::time::Instant;
use std::{eprintln, vec::Vec};

use drt_geom::procedural;
use drt_math::{CdfTable, Moments, vec3};

use super::super::*;
use super::setup::*;

/// Relative variance and dead ends of the tree, and of a table of lengths, and times in ns.
#[allow(dead_code)]
fn compare_(name: &str, segments: &[Segment], views: &[Viewpoint]) {
    let start = Instant::now();
    let tree = EdgeTree::new(segments).unwrap();
    let built = start.elapsed().as_secs_f64();
    let lengths: Vec<f64> = segments.iter().map(|s| (s.b - s.a).length()).collect();
    let total: f64 = lengths.iter().sum();
    let table = CdfTable::new(&lengths).unwrap();
    let mut ratios = Vec::new();
    let (mut sum_ns, mut sum_table_ns, mut sum_dead, mut rel, mut rel_table) =
        (0.0, 0.0, 0.0, 0.0, 0.0);
    let mut used = 0.0;
    for (i, view) in views.iter().enumerate() {
        let n = 40_000;
        let mut rng = Rng::new(5, i as u64, 0);
        let x = view.x;
        let truth: f64 = segments.iter().map(|s| integral(s, x, view.normal)).sum();
        if truth == 0.0 {
            continue;
        }
        let start = Instant::now();
        let mut dead = 0;
        let a: Moments = (0..n)
            .map(|_| match tree.sample(view, &mut rng) {
                Some(c) => kernel(&segments[c.edge], c.u, x, view.normal) * c.inv_pdf,
                None => {
                    dead += 1;
                    0.0
                }
            })
            .collect();
        let ns = start.elapsed().as_secs_f64() * 1e9 / f64::from(n);
        let start = Instant::now();
        let b: Moments = (0..10 * n)
            .map(|_| {
                let s = table.sample(rng.next_f64());
                kernel(&segments[s.index], s.residual, x, view.normal) * total
            })
            .collect();
        let table_ns = start.elapsed().as_secs_f64() * 1e9 / f64::from(10 * n);
        let ratio = b.variance() * table_ns / (a.variance() * ns);
        if i < 6 {
            eprintln!(
                "{i} truth {truth:.4} mean {:.4} z {:.2} rel var {:.3} dead {:.3} {ns:.0} ns; table mean {:.3} rel var {:.1} {table_ns:.0} ns; ratio {ratio:.1}",
                a.mean(),
                drt_math::testing::z_score(&a, truth),
                a.variance() / (truth * truth),
                f64::from(dead) / f64::from(n),
                b.mean(),
                b.variance() / (truth * truth)
            );
        }
        ratios.push(ratio);
        sum_ns += ns;
        sum_table_ns += table_ns;
        sum_dead += f64::from(dead) / f64::from(n);
        rel += (a.variance() / (truth * truth)).ln();
        rel_table += (b.variance() / (truth * truth)).ln();
        used += 1.0;
    }
    ratios.sort_by(f64::total_cmp);
    let k = used;
    eprintln!(
        "== {name}: {} edges built {built:.3} s, {:.0} ns vs {:.0}, dead {:.3}, geo rel var {:.3} vs {:.1}, ratio min {:.1} median {:.1}",
        segments.len(),
        sum_ns / k,
        sum_table_ns / k,
        sum_dead / k,
        (rel / k).exp(),
        (rel_table / k).exp(),
        ratios[0],
        ratios[ratios.len() / 2]
    );
}

use std::collections::HashMap;
use std::string::String;
use std::string::ToString;
use std::sync::Mutex;
static TRUTH: Mutex<Option<HashMap<String, Vec<f64>>>> = Mutex::new(None);
fn compare(name: &str, segments: &[Segment], views: &[Viewpoint]) {
    let tree = EdgeTree::new(segments).unwrap();
    let mut guard = TRUTH.lock().unwrap();
    let truths = guard
        .get_or_insert_with(HashMap::new)
        .entry(name.to_string())
        .or_insert_with(|| {
            views
                .iter()
                .map(|v| segments.iter().map(|s| integral(s, v.x, v.normal)).sum())
                .collect()
        })
        .clone();
    let mut all = Vec::new();
    let mut ns = 0.0;
    let mut dead = 0.0;
    for (i, (view, truth)) in views.iter().zip(&truths).enumerate() {
        if *truth == 0.0 {
            continue;
        }
        let mut rng = Rng::new(5, i as u64, 0);
        let n = 10000;
        let start = Instant::now();
        let mut samples: Vec<f64> = (0..n)
            .map(|_| match tree.sample(view, &mut rng) {
                Some(c) => kernel(&segments[c.edge], c.u, view.x, view.normal) * c.inv_pdf,
                None => {
                    dead += 1.0;
                    0.0
                }
            })
            .collect();
        ns += start.elapsed().as_secs_f64() * 1e9 / n as f64 / truths.len() as f64;
        let _ = &mut samples;
        let a: Moments = samples.into_iter().collect();
        all.push(a.variance() / (truth * truth));
    }
    all.sort_by(f64::total_cmp);
    eprintln!(
        "   {name:24} ns {ns:.0} dead {:.3} median {:.3} q90 {:.2} max {:.2}",
        dead / 10000.0 / all.len() as f64,
        all[all.len() / 2],
        all[all.len() * 9 / 10],
        all[all.len() - 1]
    );
}
fn set(v: [f64; 8]) {
    for (i, x) in v.iter().enumerate() {
        let _ = (i, x);
    }
}
#[test]
#[ignore = "scratch"]
fn experiment() {
    for v in sets() {
        set(v);
        eprintln!("{v:?}");
        scenes();
    }
}
fn sets() -> Vec<[f64; 8]> {
    std::env::var("SETS")
        .unwrap()
        .split(';')
        .map(|l| {
            let mut it = l.split(',').map(|x| x.trim().parse().unwrap());
            core::array::from_fn(|_| it.next().unwrap_or(0.0))
        })
        .collect()
}
fn scenes() {
    let sphere = procedural::icosphere(6);
    let mut rng = Rng::new(3, 0, 0);
    let sil = segments(&sphere, 1.0, [0.0; 2]);
    let views: Vec<Viewpoint> = (0..20)
        .map(|i| {
            let r = 1.0 + 4.0 * (f64::from(i) + 1.0) / 20.0;
            Viewpoint::new(direction(&mut rng) * r, None)
        })
        .collect();
    compare("sphere outside", &sil, &views);
    let bumpy = procedural::bumpy_sphere(6, 0.15, 6.0);
    let sil = segments(&bumpy, 1.0, [0.0; 2]);
    compare("bumpy outside", &sil, &views);
    let both = segments(&bumpy, 1.0, [0.1, 0.1]);
    compare("bumpy creases", &both, &views);
    // Surface points of a bumpy sphere.
    let on: Vec<Viewpoint> = (0..20)
        .map(|_| {
            let t = bumpy.triangles[(rng.next_f64() * bumpy.triangles.len() as f64) as usize]
                .map(|v| bumpy.positions[v as usize]);
            let n = (t[1] - t[0]).cross(t[2] - t[0]).normalize();
            Viewpoint::new((t[0] + t[1] + t[2]) / 3.0, Some((n, false)))
        })
        .collect();
    compare("bumpy surface", &sil, &on);
    compare("bumpy surface creases", &both, &on);
    let mut many = Vec::new();
    let small = procedural::icosphere(3);
    for _ in 0..50 {
        let m = moved(&small, 0.1 + 0.1 * rng.next_f64(), cloud(&mut rng) * 3.0);
        many.extend(segments(&m, 1.0, [0.0; 2]));
    }
    let inside: Vec<Viewpoint> =
        (0..20).map(|_| Viewpoint::new(cloud(&mut rng) * 3.0, None)).collect();
    compare("fifty spheres", &many, &inside);
    let mut cubes = Vec::new();
    for _ in 0..2000 {
        let m = moved(&procedural::cube(), 0.03 + 0.03 * rng.next_f64(), cloud(&mut rng) * 3.0);
        cubes.extend(segments(&m, 1.0, [0.1, 0.0]));
    }
    compare("cubes", &cubes, &inside);
    let floor: Vec<Viewpoint> = (0..20)
        .map(|_| Viewpoint::new(cloud(&mut rng) * 3.0, Some((direction(&mut rng), false))))
        .collect();
    compare("cubes from surfaces", &cubes, &floor);
    let _ = vec3(0.0, 0.0, 0.0);
}
