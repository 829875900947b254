//! Oracle P08: single scattering of a point light in an unbounded homogeneous medium, value and
//! derivatives with respect to the medium, from detached free flights.

use crate::common::*;
use drt_math::{Ray, Rgb, Vec3, vec3};
use drt_medium::{
    DistanceSample, FlowPlace, Homogeneous, Medium, MediumChange, Phase, Property, TrackingStats,
    ValueChange,
};

const LIGHT: Vec3 = vec3(1.5, 0.8, 0.4);
const INTENSITY: f64 = 3.0;
const SAMPLES: u32 = 1_000_000;

fn medium() -> Medium {
    let h = Homogeneous::new(Rgb::splat(0.7), Rgb::splat(0.8), Rgb::ZERO).expect("a medium");
    Medium::new(h, Phase::HenyeyGreenstein { g: 0.5 })
}

/// Derivative of the observed radiance along a change of the medium; its value without one.
fn radiance(change: Option<MediumChange>) -> drt_math::Moments {
    let medium = medium();
    let tangent = change.map(|c| medium.tangent(&c, 0.0).expect("a change that fits"));
    let dir = vec3(0.9759000729485331, 0.19518001458970663, 0.09759000729485331);
    estimate(SAMPLES, |rng, _| {
        let stats = &mut TrackingStats::default();
        let s = medium.sample_distance(&Ray::new(Vec3::ZERO, dir), Rgb::ONE, 0.3, rng, stats);
        let DistanceSample::Scatter { t, weight, .. } = s else { return 0.0 };
        let x = dir * t;
        let r = (LIGHT - x).length();
        // From the light to x, then towards the origin.
        let (wo, wi) = (-dir, (LIGHT - x) / r);
        let coefficients = medium.coefficients(x);
        let here = medium.phase_at(x);
        let phase = here.eval(wo, wi);
        let arriving = weight.r * INTENSITY * (-coefficients.sigma_t.r * r).exp() / (r * r);
        let Some(tangent) = &tangent else { return arriving * coefficients.sigma_s().r * phase };
        let rate = tangent.rates(&medium, x);
        let scattering = rate.sigma_t.r * coefficients.albedo.r
            + coefficients.sigma_t.r * rate.albedo.r
            - coefficients.sigma_s().r * rate.sigma_t.r * (t + r);
        let turning = coefficients.sigma_s().r
            * tangent.phase_rate(&medium, x, &here.gradient(wo, wi), &mut FlowPlace::default());
        arriving * (scattering * phase + turning)
    })
}

#[test]
fn value_and_derivatives_with_respect_to_the_medium() {
    let add = ValueChange::Add(Rgb::ONE);
    let cases = [
        ("value", None, 0.163_273_339_759_29),
        (
            "sigma_t",
            Some(MediumChange::Value { property: Property::SigmaT, op: add, voxels: None }),
            -0.083_026_614_548_341,
        ),
        (
            "albedo",
            Some(MediumChange::Value { property: Property::Albedo, op: add, voxels: None }),
            0.204_091_674_699_11,
        ),
        (
            "g",
            Some(MediumChange::Value { property: Property::G, op: add, voxels: None }),
            0.055_504_958_190_37,
        ),
    ];
    for (what, change, truth) in cases {
        let e = radiance(change);
        assert_agrees(&format!("P08 {what}"), &e, truth, 0.006 * truth.abs().max(0.1));
        assert_rejects(what, &e, 1.05 * truth);
    }
}
