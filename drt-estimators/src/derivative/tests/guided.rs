//! Guides of boundary samples change no expected value; one that ignores a cell does.

use drt_math::stats::Moments;

use crate::derivative::contraction::{Contraction, Motion};
use crate::derivative::tests::choice::{Total, prepare_by};
use crate::derivative::tests::scenes::*;
use crate::model::settings::Settings;
use crate::sampling::guide::Guide;
use crate::sampling::parallel::Pool;
use crate::terms::boundary_segments::Strategy;
use crate::terms::boundary_source::BoundarySource;
use crate::terms::guiding::{Guiding, OfImages};
use crate::terms::prepared::Prepared;
use crate::terms::splatting::Checked;
use crate::world::lights::EmitterMask;

const SEED: u64 = 17;

/// A guide that was learnt from some of so many samples.
fn learnt(
    (prepared, motion): &(Prepared, Motion),
    source: BoundarySource,
    samples: f64,
) -> Guiding {
    let mut guiding = Guiding::default();
    let (_, done) = guiding.learn(
        &prepared.splatter(&prepared.world, SEED),
        source,
        samples,
        &Pool::new(1),
        || OfImages::new(&prepared.world, motion),
        || false,
    );
    assert!(done);
    guiding
}

/// The derivative of all the light by a source.
fn light(
    (prepared, motion): &(Prepared, Motion),
    source: BoundarySource,
    guide: Option<&Guide>,
) -> Moments {
    let splatter = prepared.splatter(&prepared.world, SEED);
    let batch = |b: u64| {
        let contraction = Contraction::new(&prepared.world, motion);
        let mut sink = Checked::new(Total { contraction, weight: |_| 1.0, sum: 0.0 });
        splatter.run(source, guide, source.stream() + b, 2048, &mut sink);
        sink.inner.sum / 2048.0
    };
    (0..64).map(batch).collect()
}

#[test]
fn a_guide_that_ignores_a_cell_is_found_out() {
    let scene = surfaces(phong(), phong());
    let slides = parameter("slides", 0.0, vec![moves("ball", shift())]);
    let prepared = prepare_by(&Settings::default(), EmitterMask::All, &scene, &slides, 3);
    let source = BoundarySource::Edges(Strategy::Direct);
    let even = light(&prepared, source, None);
    let guiding = learnt(&prepared, source, 3e5);
    let Some(guide) = guiding.guide() else { panic!("nothing was learnt") };
    let off = |guide: &Guide| {
        let m = light(&prepared, source, Some(guide));
        let error = f64::sqrt(m.variance_of_mean() + even.variance_of_mean());
        ((m.mean() - even.mean()) / error, error / even.mean().abs())
    };
    let (z, error) = off(guide);
    assert!(z.abs() < 4.0 && error < 0.02, "{z} {error}");
    let mut faulty = guide.clone();
    faulty.ignore_a_cell();
    let (z, _) = off(&faulty);
    assert!(z.abs() > 5.0, "{z}");
}
