//! Samples follow the density that is reported for them.

use alloc::vec::Vec;

use drt_math::testing::{SIGNIFICANCE, chi_square};
use drt_math::{Rng, vec3};

use crate::edges::Lobes;
use crate::edges::tree::tests::setup::*;
use crate::edges::tree::*;

const SAMPLES: u32 = 40_000;

/// Parts of each segment that samples are counted in.
const CELLS: usize = 3;

/// Samples by segment and part of it, and at the end those that found nothing.
fn counts(
    tree: &mut Drawing<'_>,
    view: &Viewpoint,
    ways: &[Way],
    segments: &[Segment],
) -> Vec<u64> {
    let mut counts = alloc::vec![0; CELLS * segments.len() + 1];
    let nothing = counts.len() - 1;
    let mut rng = Rng::new(11, 0, 0);
    for _ in 0..SAMPLES {
        let found = tree.sample(view, ways, &mut rng);
        let cell = found.map_or(nothing, |c| {
            let product = c.inv_pdf * tree.pdf(view, ways, c.edge, c.u);
            assert!((product - 1.0).abs() < 1e-6, "{c:?}: {product}");
            CELLS * c.edge + ((CELLS as f64 * c.u) as usize).min(CELLS - 1)
        });
        counts[cell] += 1;
    }
    counts
}

/// The same expected from the density.
fn expected(
    tree: &mut Drawing<'_>,
    view: &Viewpoint,
    ways: &[Way],
    segments: &[Segment],
) -> Vec<f64> {
    const STEPS: usize = 200;
    let mut expected = Vec::new();
    for (edge, s) in segments.iter().enumerate() {
        let step = 1.0 / (CELLS * STEPS) as f64;
        for cell in 0..CELLS {
            let at = |i: usize| ((cell * STEPS + i) as f64 + 0.5) * step;
            let sum: f64 = (0..STEPS).map(|i| tree.pdf(view, ways, edge, at(i))).sum();
            expected.push(sum * step * (s.b - s.a).length() * f64::from(SAMPLES));
        }
    }
    let rest = f64::from(SAMPLES) - expected.iter().sum::<f64>();
    // What quadrature leaves over where there is always something to find.
    expected.push(f64::max(rest, 0.0));
    expected
}

fn check(view: &Viewpoint) {
    check_ways(view, &ALL);
}

fn check_ways(view: &Viewpoint, ways: &[Way]) {
    let segments = still_life();
    let tree = EdgeTree::new(&segments).unwrap();
    let mut tree = Drawing::new(&tree);
    let counts = counts(&mut tree, view, ways, &segments);
    let expected = expected(&mut tree, view, ways, &segments);
    let total: f64 = expected.iter().sum::<f64>() / f64::from(SAMPLES);
    assert!((total - 1.0).abs() < 2e-3, "{total} from {view:?}");
    let p = chi_square(&counts, &expected);
    assert!(p > SIGNIFICANCE, "{p}");
    // A density that leans to one end of each segment by a little is told apart.
    let lean = |i: usize, e: f64| e * (1.0 + 0.15 * ((i % CELLS) as f64 - 1.0));
    let leaning: Vec<f64> = expected.iter().enumerate().map(|(i, e)| lean(i, *e)).collect();
    let p = chi_square(&counts, &leaning);
    assert!(p < SIGNIFICANCE, "{p}");
}

#[test]
fn all_around() {
    views().iter().for_each(check);
}

#[test]
fn towards_a_light() {
    let lights = [(vec3(1.3, -0.2, 0.4), 0.5), (vec3(-0.9, 0.6, -0.8), 0.9)];
    for (view, (center, radius)) in views().iter().zip(lights.iter().cycle()) {
        let light = view.toward(0.7, *center, *radius);
        check_ways(view, &[Way { chance: 1.0, ..light }]);
        check_ways(view, &[light, Way::anywhere(0.3)]);
    }
}

#[test]
fn where_lobes_are() {
    let peaks = [0.5, 20.0, 5e3];
    for (view, peak) in views().iter().zip(peaks.iter().cycle()) {
        let lobes = Lobes::around(vec3(0.6, -0.2, -0.77).normalize(), 0.01, *peak);
        check(&view.scattering(lobes));
    }
}

#[test]
fn near_edges() {
    let s = still_life();
    for (k, off) in [(5, 0.04), (90, 0.06), (260, 0.08)] {
        let s = s[k];
        let x = s.a.lerp(s.b, 0.4) + (s.faces[0] + vec3(0.1, 0.2, -0.1)) * off;
        check(&Viewpoint::new(x, None));
        check(&Viewpoint::new(x, None).scattering(Lobes::around(s.faces[0], 0.02, 3.0)));
    }
}
