//! Runs a scene of one pixel and judges its numbers in standard errors.

use drt_estimators::{Depth, Estimate, Scene, Session, Settings, Unattended};
use drt_motion::Parameter;

/// Standard errors within which an estimate must lie.
const LIMIT: f64 = 4.0;

/// A deviation that the run must be able to see.
const VISIBLE: f64 = 0.1;

const SAMPLES: u32 = 1 << 21;

/// The run's estimates of `value` and of the derivatives in `parameters` must agree with the exact
/// numbers, and disagree with numbers that are 10 % off.
pub(crate) fn judge(scene: &Scene, value: f64, parameters: &[(Parameter, f64)], depth: u32) {
    let (parameters, exact): (Vec<_>, Vec<_>) = parameters.iter().cloned().unzip();
    let settings = Settings { max_depth: Depth::AtMost(depth), seed: 11, ..Settings::default() };
    let mut session = Session::new(scene, &parameters, &settings).expect("the scene is usable");
    assert!(session.run(SAMPLES, &Unattended));
    let rendering = session.rendering();
    assert_eq!(rendering.non_finite, 0);
    assert_agrees("value", rendering.image.total, value);
    for (d, exact) in rendering.derivatives.iter().zip(exact) {
        assert_agrees(&d.name, d.total.total, exact);
    }
}

fn assert_agrees(name: &str, estimate: Estimate, exact: f64) {
    let (mean, stderr) = (estimate.mean.r, estimate.stderr.r);
    println!("{name}: {mean} ± {stderr}, exact {exact}");
    let agrees = |with: f64| (mean - with).abs() <= LIMIT * stderr + 1e-9 * exact.abs();
    assert!(agrees(exact), "{name}: {mean} ± {stderr} where {exact} is exact");
    if exact != 0.0 {
        assert!(!agrees(exact * (1.0 + VISIBLE)), "{name}: {stderr} is too noisy to judge by");
    }
}
