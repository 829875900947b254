//! Estimates by the tree against integrals over all edges.

use drt_math::testing::z_score;
use drt_math::{Moments, Rng, vec3};

use crate::edges::tree::tests::setup::*;
use crate::edges::tree::*;

const SAMPLES: u32 = 60_000;

fn moments(seed: u64, mut estimate: impl FnMut(&mut Rng) -> Option<f64>) -> Moments {
    let mut rng = Rng::new(seed, 0, 0);
    (0..SAMPLES).map(|_| estimate(&mut rng).unwrap_or(0.0)).collect()
}

#[test]
fn integrals_over_all_edges() {
    let segments = still_life();
    let tree = EdgeTree::new(&segments).unwrap();
    let mut tree = Drawing::new(&tree);
    for view in &views() {
        let truth = integral(&segments, view);
        let value = |c: &Chosen| kernel(&segments[c.edge], c.u, view) * c.inv_pdf;
        let estimate = moments(1, |rng| Some(value(&tree.sample(view, &ALL, rng)?)));
        let z = z_score(&estimate, truth);
        assert!(z.abs() < 4.0, "{z}: {estimate:?} for {truth}");
        assert!(estimate.standard_error() < 0.01 * truth, "{estimate:?} for {truth}");
        // Planted: some children chosen a little more often than is said.
        let faulty = moments(1, |rng| {
            let c = tree.sample(view, &ALL, rng)?;
            Some(value(&c) * if c.edge % 3 == 0 { 1.1 } else { 1.0 })
        });
        assert!(z_score(&faulty, truth).abs() > 4.0, "{faulty:?} for {truth}");
    }
}

#[test]
fn together_with_samples_towards_a_light() {
    let segments = still_life();
    let tree = EdgeTree::new(&segments).unwrap();
    let mut tree = Drawing::new(&tree);
    for view in &views() {
        let light = view.toward(0.5, vec3(1.0, -0.1, 0.3), 0.6);
        let ways = [light, Way::anywhere(0.5)];
        let truth = integral(&segments, view);
        let value = |c: &Chosen| kernel(&segments[c.edge], c.u, view);
        let estimate = moments(2, |rng| {
            let c = tree.sample(view, &ways, rng)?;
            Some(value(&c) * c.inv_pdf)
        });
        let z = z_score(&estimate, truth);
        assert!(z.abs() < 4.0, "{z}: {estimate:?} for {truth}");
        // Planted: the light's samples said to be drawn every time.
        let faulty = moments(2, |rng| {
            let c = tree.sample(view, &ways, rng)?;
            let more = 0.5 * tree.pdf(view, &[Way { chance: 1.0, ..light }], c.edge, c.u);
            Some(value(&c) / (1.0 / c.inv_pdf + more))
        });
        assert!(z_score(&faulty, truth).abs() > 4.0, "{faulty:?} for {truth}");
    }
}
