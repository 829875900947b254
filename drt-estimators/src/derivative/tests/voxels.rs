//! Line integrals through voxels are random: their mean must be right, and all else exact.

use alloc::vec;
use alloc::vec::Vec;

use drt_math::{Moments, Rgb, Rng, ValueChange};
use drt_motion::Parameter;

use crate::derivative::adjoint::Differentiator;
use crate::derivative::contraction::Contraction;
use crate::derivative::tests::changes::rates;
use crate::derivative::tests::moving::Moving;
use crate::derivative::tests::replay::replay;
use crate::derivative::tests::scenes::*;
use crate::derivative::tests::setup::{
    Fault, Faulty, Recording, coloured, motion, prepare, set, trace,
};
use crate::model::scene::Scene;
use crate::sampling::trace::Tracer;

#[test]
fn derivatives_on_average() {
    let scene = smoke(0.0);
    let one = ValueChange::Add(Rgb::splat(0.8));
    let voxel = vec![changes_voxel("smoke", "sigma_t", [2, 2, 2], one)];
    for p in [
        set("density", "smoke", "sigma_t", ValueChange::MultiplyLog(1.0)),
        parameter("voxel", 0.0, voxel),
        set("albedo", "smoke", "albedo", grey(0.5)),
        set("emission", "smoke", "emission", coloured()),
        motion("box", "shift", shift()),
        motion("lamp", "wobble", wobble(&scene, "lamp", 2)),
    ] {
        judge(&scene, &p);
    }
    // With a jump of the extinction at the grid's box.
    let scene = smoke(1.0);
    for p in [
        motion("smoke", "turn", turn()),
        motion("smoke", "shift", shift()),
        motion("sun", "turn", turn()),
        motion("bulb", "shift", shift()),
        motion("camera", "turn", turn()),
    ] {
        judge(&scene, &p);
    }
    let turned = motion("smoke", "turn", turn());
    let off = |z: &f64| z.abs() > 6.0;
    assert!(mean_deviations(&scene, &turned, Fault::None, 1.02).iter().any(off));
    assert!(mean_deviations(&scene, &turned, Fault::GridFace, 1.0).iter().any(off));
}

/// Phase functions whose numbers are voxels, which change one by one and move.
#[test]
fn phase_functions_that_vary() {
    let one = ValueChange::Add(Rgb::splat(0.3));
    let [cosines, blend] = varied_smoke(1.0);
    for (scene, property) in [(&cosines, "g"), (&blend, "weight")] {
        let voxel = vec![changes_voxel("smoke", property, [2, 1, 2], one)];
        for p in [
            parameter(property, 0.0, voxel),
            set("all", "smoke", property, ValueChange::MultiplyLog(0.7)),
            motion("smoke", "turn", turn()),
            motion("box", "shift", shift()),
            motion("camera", "turn", turn()),
        ] {
            judge(scene, &p);
        }
        let shifted = motion("smoke", "shift", shift());
        let off = |z: &f64| z.abs() > 6.0;
        assert!(mean_deviations(scene, &shifted, Fault::PhaseGrid, 1.0).iter().any(off));
    }
}

fn judge(scene: &Scene, parameter: &Parameter) {
    let deviations = mean_deviations(scene, parameter, Fault::None, 1.0);
    let n = deviations.len() as f64;
    let squares: f64 = deviations.iter().map(|z| z * z).sum();
    let worst = deviations.iter().fold(0.0, |w: f64, z| w.max(z.abs()));
    // Chi-squared with n degrees of freedom, whose variance is 2 n.
    let fits = squares <= n + 4.0 * (2.0 * n).sqrt();
    assert!(fits && worst < 4.5, "{}: {deviations:?}", parameter.name);
}

/// Deviations, path by path, of the mean over line points in standard errors; `factor` multiplies
/// what is expected. Where nothing is random, a deviation of more than rounding counts as many.
fn mean_deviations(scene: &Scene, parameter: &Parameter, fault: Fault, factor: f64) -> Vec<f64> {
    let (world, motion) = prepare(scene, parameter);
    let moving = Moving::new(scene, parameter, &world, &motion);
    let mut tracer = Tracer::new(&world);
    let mut path = Recording::material(&world, &motion);
    let mut differentiator = Differentiator::new(&world);
    let mut sink = Faulty(Contraction::new(&world, &motion), fault);
    let mut deviations = Vec::new();
    for i in 0..120 {
        let slope = trace(&mut tracer, &mut path, None, 15, i);
        let expected = rates(replay(&moving, &path.record, slope)).g * factor;
        let mean: Moments = (0..1000)
            .map(|j| {
                sink.0.clear();
                differentiator.differentiate(&path.path(), slope, Rng::new(16, j, i), &mut sink);
                sink.0.rates[0].g
            })
            .collect();
        let (error, stderr) = (mean.mean() - expected, mean.standard_error());
        let rounding = 1e-10 * f64::max(expected.abs(), path.record.value.g);
        if error.abs() > rounding || stderr > rounding {
            deviations.push(error / f64::hypot(stderr, rounding));
        }
    }
    deviations
}
