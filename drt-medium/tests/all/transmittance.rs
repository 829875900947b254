//! Derivatives of transmittance against the oracle P07, and of optical depth against exact
//! quadrature.

use crate::common::*;
use drt_math::{Affine, Mat3, Rgb, Rng, Vec3, vec3};
use drt_medium::{
    Layout, Medium, MediumChange, MediumTangent, Property, Ray, TrackingStats, ValueChange,
};

const SAMPLES: u32 = 1_000_000;

#[test]
fn p07_value_by_quadrature_and_by_tracking() {
    let (medium, ray) = (p07(), p07_ray());
    let exact = P07_RADIANCE * (-optical_depth(&medium, &ray)).exp().r;
    assert!((exact / P07_VALUE - 1.0).abs() < 1e-12, "{exact}");
    let e = estimate(SAMPLES, |rng, stats| P07_RADIANCE * medium.transmittance(&ray, rng, stats).g);
    assert_agrees("P07", &e, P07_VALUE, 0.003 * P07_VALUE);
    assert_rejects("P07 without scale", &e, P07_RADIANCE * (P07_VALUE / 2.0).powf(1.0 / 0.9));
}

fn p07_derivative(samples: u32, tangent: &MediumTangent) -> drt_math::Moments {
    let (medium, ray) = (p07(), p07_ray());
    let mut points = Vec::new();
    estimate(samples, |rng, stats| {
        P07_RADIANCE * medium.transmittance_rate(&ray, tangent, rng, stats, &mut points).rate.r
    })
}

/// To 0.3 %.
fn assert_derivative(what: &str, estimate: &drt_math::Moments, truth: f64) {
    assert_agrees(what, estimate, truth, 0.003 * truth.abs());
}

fn tangent(change: &MediumChange) -> MediumTangent {
    p07().tangent(change, 0.0).expect("a change of P07")
}

fn motion(velocity: Affine) -> MediumTangent {
    tangent(&MediumChange::Place { map: Affine::IDENTITY, velocity })
}

#[test]
fn p07_scale() {
    // The extinction is scale × value, so d/dscale is a relative change by 1 / 0.9.
    let op = ValueChange::Multiply(1.0 / 0.9);
    let d = p07_derivative(
        SAMPLES,
        &tangent(&MediumChange::Value { property: Property::SigmaT, op, voxels: None }),
    );
    assert_derivative("P07 d/dscale", &d, -0.465_646_916_636_44);
}

#[test]
fn p07_voxel() {
    // The oracle adds to the grid's value before the scale.
    let op = ValueChange::Add(Rgb::splat(0.9));
    let change = MediumChange::Value { property: Property::SigmaT, op, voxels: Some([1, 1, 1]) };
    let d = p07_derivative(SAMPLES, &tangent(&change));
    assert_derivative("P07 d/dvoxel", &d, -0.040_848_148_721_56);
    assert_rejects("P07 d/dvoxel after scale", &d, -0.040_848_148_721_56 / 0.9);
}

#[test]
fn p07_translation() {
    let truth = -0.035_093_323_742_101;
    let velocity = Affine { linear: Mat3::ZERO, translation: Vec3::X };
    let tangent = motion(velocity);
    let d = p07_derivative(SAMPLES, &tangent);
    assert_derivative("P07 translation", &d, truth);

    let (medium, ray) = (p07(), p07_ray());
    let faces = medium.grid().map(|g| g.crossings(&ray).map(|c| c.depth_rate(Vec3::X).r).sum());
    let without_faces = truth + P07_VALUE * faces.unwrap_or(0.0);
    assert_rejects("P07 translation without the box's faces", &d, without_faces);
}

#[test]
fn p07_stretch() {
    // The face x = 2 moves with velocity one, the values in between in proportion.
    let linear = Mat3::diagonal(vec3(0.5, 0.0, 0.0));
    let d = p07_derivative(SAMPLES, &motion(Affine { linear, translation: Vec3::ZERO }));
    assert_derivative("P07 stretch", &d, -0.206_876_459_411_24);
}

/// Central difference of the exact optical depth under a change.
fn depth_difference(medium: &Medium, ray: &Ray, h: f64, at: impl Fn(f64) -> MediumChange) -> Rgb {
    let depth = |theta: f64| {
        let mut changed = medium.clone();
        changed.apply(&at(theta), theta).expect("a small change");
        optical_depth(&changed, ray)
    };
    (depth(h) - depth(-h)) / (2.0 * h)
}

#[test]
fn optical_depth_rates_of_a_turning_chromatic_cloud() {
    let axis = vec3(0.0, 0.6, 0.8);
    let (spin, pivot) = (Mat3::skew(axis), vec3(0.4, 0.3, 0.2));
    let velocity = Affine { linear: spin, translation: -(spin * pivot) };
    for layout in [Layout::VoxelCentred, Layout::NodeCentred] {
        let medium = cloud(layout);
        let ray = ray_through(&medium, vec3(0.8, 0.3, -0.2));
        let turn = |theta| MediumChange::Place {
            map: Affine::about(Mat3::rotation(axis, theta), pivot),
            velocity,
        };
        let truth = depth_difference(&medium, &ray, 1e-5, turn);
        let tangent = medium.tangent(&turn(0.0), 0.0).expect("a motion");
        let mut points = Vec::new();
        for channel in 0..3 {
            let d = estimate(100_000, |rng, _| {
                let rate = medium.optical_depth_rate(&ray, &tangent, rng, &mut points);
                rate.to_array()[channel]
            });
            assert_agrees("turning cloud", &d, truth.to_array()[channel], 0.005 * truth.max_abs());
        }
    }
}

#[test]
fn optical_depth_gradients_at_both_ends() {
    let medium = cloud(Layout::VoxelCentred);
    let through = ray_through(&medium, vec3(-0.4, 0.9, 0.5));
    // One end outside the box, one inside.
    let ends = [through.at(0.7), through.at(2.6)];
    let segment = |[a, b]: [Vec3; 2]| {
        let r = (b - a).length();
        Ray::new(a, (b - a) / r).until(r)
    };
    let velocities = [vec3(0.3, -0.5, 0.8), vec3(0.2, 0.9, 0.1)];
    let mut points = Vec::new();
    for moving in 0..2 {
        let depth = |s: f64| {
            let mut moved = ends;
            moved[moving] += velocities[moving] * s;
            optical_depth(&medium, &segment(moved)).b
        };
        let truth = (depth(1e-5) - depth(-1e-5)) / 2e-5;
        let d = estimate(200_000, |rng, _| {
            let gradient = medium.optical_depth_gradient(&segment(ends), rng, &mut points);
            gradient[moving].dot(velocities[moving]).b
        });
        assert_agrees("moving end", &d, truth, 0.005 * truth.abs());
    }
}

#[test]
fn homogeneous_rates_are_exact() {
    let h = drt_medium::Homogeneous::new(Rgb::new(0.0, 0.5, 2.0), Rgb::ZERO, Rgb::ZERO)
        .expect("a valid medium");
    let medium = Medium::new(h, drt_medium::Phase::Isotropic);
    let op = ValueChange::Add(Rgb::ONE);
    let tangent = medium
        .tangent(&MediumChange::Value { property: Property::SigmaT, op, voxels: None }, 0.0)
        .expect("a change");
    let (rng, stats) = (&mut Rng::new(0, 0, 0), &mut TrackingStats::default());
    let ray = Ray::new(Vec3::ZERO, Vec3::X).until(3.0);
    let e = medium.transmittance_rate(&ray, &tangent, rng, stats, &mut Vec::new());
    for (rate, sigma) in e.rate.to_array().into_iter().zip([0.0, 0.5, 2.0_f64]) {
        assert!((rate + 3.0 * (-3.0 * sigma).exp()).abs() < 1e-14);
    }
}
