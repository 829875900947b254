//! Probes in a medium without any extinction yet, where every path has the same derivative.

use drt_math::{Real, Rgb, Rng};

use crate::derivative::adjoint::Differentiator;
use crate::derivative::contraction::Contraction;
use crate::derivative::recorded_path::RecordedPath;
use crate::derivative::tests::scenes::*;
use crate::derivative::tests::setup::{Recording, prepare, trace_with};
use crate::sampling::record::Role;
use crate::sampling::trace::Tracer;
use crate::terms::interior::Probes;

/// Something done wrong on purpose.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Fault {
    None,
    /// The density of the probe is taken for another.
    Density,
    /// The probe's control radiance is not given back to the line integrals.
    Control,
    /// The probe is missing.
    Nowhere,
}

/// The largest error of a path's derivative, as a part of what the medium takes from the path's light.
fn error(fault: Fault) -> f64 {
    let albedo = Rgb::new(0.9, 0.7, 0.3);
    let scene = empty_cloud(albedo);
    let (world, motion) = prepare(&scene, &parameter("thickens", 0.0, vec![thickens()]));
    let mut tracer = Tracer::new(&world);
    let mut recording = Recording::material(&world, &motion).with_probes();
    let mut differentiator = Differentiator::new(&world);
    let mut sink = Contraction::new(&world, &motion);
    let mut probes = Probes::new();
    let mut worst = 0.0;
    for i in 0..200 {
        probes.begin(8, i, 0);
        let slope = trace_with(&mut tracer, &mut recording, Some(&mut probes), None, 15, i);
        let record = &mut recording.record;
        let length = record.nodes[1].arrival.map_or(0.0, |a| {
            let t: Vec<f64> = record.crossings.iter().take(2).map(|c| c.t).collect();
            if t.len() == 2 && !a.distance.is_finite() { t[1] - t[0] } else { 0.0 }
        });
        for node in &mut record.nodes {
            let probe = matches!(node.role, Role::Probe);
            match (fault, &mut node.arrival) {
                (Fault::Density, Some(a)) if probe => a.throughput *= 1.02,
                (Fault::Control, _) if !probe => node.control = Rgb::ZERO,
                (Fault::Nowhere, Some(a)) if probe => a.throughput = Rgb::ZERO,
                _ => {}
            }
        }
        sink.clear();
        let path: RecordedPath<'_> = recording.path();
        differentiator.differentiate(&path, slope, Rng::new(16, 0, i), &mut sink);
        // The radiance of the sky comes from everywhere: what is scattered less what is missing.
        let taken = path.record.value * Rgb::new(1.0, 0.8, 0.6) * length;
        let off = sink.rates[0] - taken * (albedo - Rgb::ONE);
        if length > 0.0 {
            worst = f64::max(worst, Real::abs(off.max_abs() / taken.max_abs()));
        }
    }
    worst
}

#[test]
fn what_an_empty_medium_will_do() {
    assert!(error(Fault::None) < 1e-10, "{:e}", error(Fault::None));
    for fault in [Fault::Density, Fault::Control, Fault::Nowhere] {
        assert!(error(fault) > 1e-3, "{fault:?}: {:e}", error(fault));
    }
}
