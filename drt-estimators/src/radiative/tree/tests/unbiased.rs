//! Estimates by the tree against integrals over all edges.

use drt_math::testing::z_score;
use drt_math::{Moments, Rng, vec3};

use super::super::*;
use super::setup::*;

const SAMPLES: u32 = 60_000;

fn moments(seed: u64, mut estimate: impl FnMut(&mut Rng) -> Option<f64>) -> Moments {
    let mut rng = Rng::new(seed, 0, 0);
    (0..SAMPLES).map(|_| estimate(&mut rng).unwrap_or(0.0)).collect()
}

#[test]
fn integrals_over_all_edges() {
    let segments = still_life();
    let tree = EdgeTree::new(&segments).unwrap();
    for view in &views() {
        let truth = integral(&segments, view);
        let value = |c: &Chosen| kernel(&segments[c.edge], c.u, view) * c.inv_pdf;
        let estimate = moments(1, |rng| Some(value(&tree.sample(view, rng.next_2d())?)));
        let z = z_score(&estimate, truth);
        assert!(z.abs() < 4.0, "{z}: {estimate:?} for {truth}");
        assert!(estimate.standard_error() < 0.01 * truth, "{estimate:?} for {truth}");
        // Planted: some children chosen a little more often than is said.
        let faulty = moments(1, |rng| {
            let c = tree.sample(view, rng.next_2d())?;
            Some(value(&c) * if c.edge % 3 == 0 { 1.1 } else { 1.0 })
        });
        assert!(z_score(&faulty, truth).abs() > 4.0, "{faulty:?} for {truth}");
    }
}

#[test]
fn together_with_samples_towards_a_light() {
    let segments = still_life();
    let tree = EdgeTree::new(&segments).unwrap();
    for view in &views() {
        let light = view.toward(vec3(1.0, -0.1, 0.3), 0.6);
        let truth = integral(&segments, view);
        let pick = |rng: &mut Rng| {
            let technique = if rng.next_f64() < 0.5 { view } else { &light };
            tree.sample(technique, rng.next_2d())
        };
        let pdf = |c: &Chosen, v: &Viewpoint| tree.pdf(v, c.edge, c.u);
        let estimate = moments(2, |rng| {
            let c = pick(rng)?;
            let both = 0.5 * (pdf(&c, view) + pdf(&c, &light));
            Some(kernel(&segments[c.edge], c.u, view) / both)
        });
        let z = z_score(&estimate, truth);
        assert!(z.abs() < 4.0, "{z}: {estimate:?} for {truth}");
        // Planted: the light's samples said to be drawn every time.
        let faulty = moments(2, |rng| {
            let c = pick(rng)?;
            let both = 0.5 * pdf(&c, view) + pdf(&c, &light);
            Some(kernel(&segments[c.edge], c.u, view) / both)
        });
        assert!(z_score(&faulty, truth).abs() > 4.0, "{faulty:?} for {truth}");
    }
}
