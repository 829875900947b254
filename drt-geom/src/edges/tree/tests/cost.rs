//! What a sample costs and what it is worth.

use std::time::Instant;
use std::{eprintln, vec::Vec};

use crate::{Mesh, procedural};
use drt_math::{CdfTable, Moments, Rng};

use crate::edges::tree::tests::setup::*;
use crate::edges::tree::*;

/// Viewpoints at distances from near the unit sphere to five radii from its centre.
fn outside(count: u32) -> Vec<Viewpoint> {
    let mut rng = Rng::new(3, 0, 0);
    let distance = |i: u32| 1.0 + 4.0 * f64::from(i + 1) / f64::from(count);
    (0..count).map(|i| Viewpoint::new(direction(&mut rng) * distance(i), None)).collect()
}

/// How much a table of lengths varies and takes in comparison with a tree: ratios of variances, and
/// of variances times times.
fn against_lengths(mesh: &Mesh, views: &[Viewpoint], samples: u32) -> [Vec<f64>; 2] {
    let segments = segments(mesh, (1.0, [0.0; 2]));
    let tree = EdgeTree::new(&segments).unwrap();
    let mut tree = Drawing::new(&tree);
    let lengths: Vec<f64> = segments.iter().map(|s| (s.b - s.a).length()).collect();
    let total: f64 = lengths.iter().sum();
    let table = CdfTable::new(&lengths).unwrap();
    let timed = |n: u32, estimate: &mut dyn FnMut() -> f64| {
        let start = Instant::now();
        let moments: Moments = (0..n).map(|_| estimate()).collect();
        (moments, start.elapsed().as_secs_f64() / f64::from(n))
    };
    let mut ratios = [Vec::new(), Vec::new()];
    for view in views {
        let mut rng = Rng::new(5, 0, 0);
        let value = |edge: usize, u: f64| kernel(&segments[edge], u, view);
        let (by_tree, time) = timed(samples, &mut || {
            tree.sample(view, &ALL, &mut rng).map_or(0.0, |c| value(c.edge, c.u) * c.inv_pdf)
        });
        let mut rng = Rng::new(6, 0, 0);
        let (by_length, length_time) = timed(10 * samples, &mut || {
            let s = table.sample(rng.next_f64());
            value(s.index, s.residual) * total
        });
        assert!(drt_math::testing::welch_z(&by_tree, &by_length).abs() < 4.0);
        let variances = by_length.variance() / by_tree.variance();
        ratios[0].push(variances);
        ratios[1].push(variances * length_time / time);
    }
    for r in &mut ratios {
        r.sort_by(f64::total_cmp);
    }
    ratios
}

#[test]
fn silhouettes_of_a_fine_mesh() {
    let [variances, _] = against_lengths(&procedural::icosphere(5), &outside(5), 10_000);
    assert!(variances[0] > 100.0, "{variances:?}");
}

#[test]
fn a_room_around_a_fine_mesh_costs_little() {
    let ball = segments(&procedural::icosphere(5), (1.0, [0.0; 2]));
    let room = segments(&moved(&procedural::cube(), 12.0, Vec3::ZERO), (0.0, [0.0, 0.2]));
    let both = [ball.clone(), room].concat();
    for view in outside(5) {
        let [alone, inside] = [&ball, &both].map(|segments| {
            let tree = EdgeTree::new(segments).unwrap();
            let mut tree = Drawing::new(&tree);
            let mut rng = Rng::new(7, 0, 0);
            let value = |c: Chosen| kernel(&segments[c.edge], c.u, &view) * c.inv_pdf;
            let m: Moments = (0..20_000)
                .map(|_| tree.sample(&view, &ALL, &mut rng).map_or(0.0, value))
                .collect();
            m.variance() / (m.mean() * m.mean())
        });
        assert!(inside < 2.0 * alone, "{inside} in the room, {alone} without it");
    }
}

#[test]
#[ignore = "measures time: run alone, with --release"]
fn worth_of_a_sample() {
    let bumpy = procedural::bumpy_sphere(6, 0.15, 6.0);
    for (name, mesh) in [("sphere", procedural::icosphere(6)), ("bumpy sphere", bumpy)] {
        let ratios = against_lengths(&mesh, &outside(20), 40_000);
        for (what, r) in ["variance", "variance x time"].into_iter().zip(ratios) {
            eprintln!("{name}, {what}: {:.0} to {:.0}, median {:.0}", r[0], r[19], r[10]);
        }
    }
}

#[test]
#[ignore = "measures time: run alone, with --release"]
fn time_of_a_sample() {
    for (subdivisions, priors) in [
        (3, (1.0, [0.0; 2])),
        (5, (1.0, [0.0; 2])),
        (6, (1.0, [0.0; 2])),
        (7, (1.0, [0.0; 2])),
        (6, PRIORS),
    ] {
        let segments = segments(&procedural::icosphere(subdivisions), priors);
        let start = Instant::now();
        let tree = EdgeTree::new(&segments).unwrap();
        let built = start.elapsed().as_secs_f64();
        let mut rng = Rng::new(3, 0, 0);
        let n = 100_000;
        let mut tree = Drawing::new(&tree);
        let views = outside(20);
        let toward = views.iter().map(|v| v.toward(0.5, Vec3::ZERO, 0.3));
        let toward: Vec<[Way; 2]> = toward.map(|w| [w, Way::anywhere(0.5)]).collect();
        let [general, toward] = [false, true].map(|both| {
            let start = Instant::now();
            let ways = |i: usize| if both { &toward[i][..] } else { &ALL[..] };
            let found: f64 = (0..n)
                .filter_map(|i| tree.sample(&views[i % 20], ways(i % 20), &mut rng))
                .map(|c| c.inv_pdf)
                .sum();
            assert!(found.is_finite());
            start.elapsed().as_secs_f64() * 1e9 / n as f64
        });
        eprintln!(
            "{} edges, {priors:?}: built in {built:.3} s, {general:.0} ns, also towards a light {toward:.0} ns",
            segments.len()
        );
    }
}
