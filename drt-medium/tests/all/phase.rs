//! Phase functions: normalised, sampled as evaluated, with the mean cosine they promise, the right
//! way round, and with exact derivatives.

use std::f64::consts::PI;

use drt_math::testing::{SIGNIFICANCE, sphere_chi_square};
use drt_math::{Dual, Rng, Vec3, vec3};
use drt_medium::{Grid, MediumError, Phase, PhaseBlend, PhaseTable, henyey_greenstein};

use crate::common::{at_cosine, directions};

const SHARPEST: f64 = 0.9999;

fn phases() -> Vec<Phase> {
    let hg = [-SHARPEST, -0.6, -1e-9, 0.0, 1e-9, 0.3, 0.85, SHARPEST];
    let mut all = vec![Phase::Isotropic, Phase::Rayleigh];
    all.extend(hg.map(|g| Phase::henyey_greenstein(g).expect("a valid g")));
    all.extend([blend(), table(&[0.5, 1.0, 1.5, 4.0])]);
    all
}

fn table(values: &[f64]) -> Phase {
    Phase::Tabulated(Box::new(PhaseTable::new(values.to_vec()).expect("a table")))
}

fn blend() -> Phase {
    let parts = [Phase::henyey_greenstein(0.5).expect("a valid g"), Phase::Isotropic];
    Phase::Blend(Box::new(PhaseBlend::new(0.3, parts).expect("a weight")))
}

/// Values on a line of voxels along x.
fn ramp(values: &[f64], channels: usize) -> Grid {
    let count = values.len() / channels;
    Grid::new([count, 1, 1], channels, values.to_vec()).expect("a valid grid")
}

/// Functions that vary in space: a mean cosine, a weight, and both at once.
fn varying() -> [Phase; 3] {
    let g = Phase::henyey_greenstein_grid(ramp(&[-0.7, 0.1, 0.8], 1)).expect("mean cosines");
    let blend = |weights: &[f64], parts| {
        let blend = PhaseBlend::varying(ramp(weights, 1), parts).expect("weights");
        Phase::Blend(Box::new(blend))
    };
    let of_constants = blend(&[0.0, 1.0], [Phase::Rayleigh, table(&[0.0, 1.0, 3.0])]);
    [g.clone(), of_constants, blend(&[0.2, 0.9, 0.4], [g, Phase::Isotropic])]
}

/// Everywhere it is a phase function, and it is sampled as its density says.
#[test]
fn normalised_and_sampled_wherever_it_varies() {
    let flow = vec3(0.48, -0.6, 0.64);
    for phase in varying() {
        for x in [0.0, 0.31, 0.5, 0.77] {
            let p = phase.at(vec3(x, 0.5, 0.5));
            let total = sphere_integral(1.0, |c, _| at_cosine(&p, c));
            assert!((total - 1.0).abs() < 1e-6, "{p:?} integrates to {total}");
            let directions = (0..100_000).map(|i| {
                let (w, pdf) = p.sample(-flow, Rng::new(1, 2, i).next_2d());
                assert!((pdf / p.pdf(-flow, w) - 1.0).abs() < 1e-9);
                w
            });
            let value = sphere_chi_square(directions, |w| p.pdf(-flow, w));
            assert!(value > SIGNIFICANCE, "{p:?}: p-value {value}");
        }
    }
    let [g, ..] = varying();
    let [here, there] = [0.2, 0.8].map(|x| g.at(vec3(x, 0.5, 0.5)));
    let directions = (0..100_000).map(|i| here.sample(-flow, Rng::new(1, 2, i).next_2d()).0);
    let value = sphere_chi_square(directions, |w| there.eval(w, -flow));
    assert!(value < SIGNIFICANCE, "samples of one place pass for those of another: {value}");
}

/// Where the weight is zero, the other part is sampled as well: it has a derivative.
#[test]
fn both_parts_of_a_blend_are_sampled() {
    let [_, blend, _] = varying();
    let p = blend.at(vec3(0.0, 0.5, 0.5));
    let [wo, wi] = directions(1.0);
    let other = at_cosine(&table(&[0.0, 1.0, 3.0]).at(Vec3::ZERO), 1.0);
    let (value, density) = (p.eval(wo, wi), p.pdf(wo, wi));
    assert_eq!(p.gradient(wo, wi).weight, other - value);
    assert!(density != value && density > 0.95 * value);
}

#[test]
fn grids_that_make_no_phase_function_are_refused() {
    let parts = || [Phase::Isotropic, Phase::Rayleigh];
    for (values, channels) in [(&[0.1, 0.2, 0.3][..], 3), (&[0.1, 1.0], 1), (&[-1.5, 0.0], 1)] {
        assert!(Phase::henyey_greenstein_grid(ramp(values, channels)).is_err());
    }
    for (values, channels) in [(&[0.1, 0.2, 0.3][..], 3), (&[0.1, 1.1], 1), (&[-0.1, 0.0], 1)] {
        assert!(PhaseBlend::varying(ramp(values, channels), parts()).is_err());
    }
}

fn mean_cosine(p: &Phase) -> f64 {
    match *p {
        Phase::HenyeyGreenstein { g } => g,
        Phase::Blend(_) => 0.7 * 0.5,
        Phase::Tabulated(ref table) => table.mean_cosine(),
        _ => 0.0,
    }
}

/// `∫ f over the sphere` for f of the cosine c alone; with c = ±(1 - x²/…) clustered at the peak by
/// the substitution 1 ∓ c = exp(y).
fn sphere_integral(peak: f64, f: impl Fn(f64, f64) -> f64) -> f64 {
    let (low, high, steps) = (-60.0_f64, 2.0_f64.ln(), 20_000);
    let h = (high - low) / f64::from(steps);
    let value = |y: f64| {
        let from_pole = y.exp();
        let c = if peak >= 0.0 { 1.0 - from_pole } else { from_pole - 1.0 };
        2.0 * PI * f(c, from_pole) * from_pole
    };
    let simpson = |i: i32| {
        let y = low + f64::from(i) * h;
        (value(y) + 4.0 * value(y + 0.5 * h) + value(y + h)) * h / 6.0
    };
    (0..steps).map(simpson).sum()
}

#[test]
fn normalised_with_the_mean_cosine_promised() {
    for p in phases() {
        let g = mean_cosine(&p);
        let here = p.at(Vec3::ZERO);
        let total = sphere_integral(g, |c, _| at_cosine(&here, c));
        assert!((total - 1.0).abs() < 1e-7, "{p:?} integrates to {total}");
        let mean = sphere_integral(g, |c, _| c * at_cosine(&here, c));
        assert!((mean - g).abs() < 1e-7, "{p:?} has mean cosine {mean}");
    }
}

#[test]
fn sampled_as_evaluated() {
    let flow = vec3(0.48, -0.6, 0.64);
    for p in phases().into_iter().filter(|p| mean_cosine(p).abs() < 0.9) {
        let p = p.at(Vec3::ZERO);
        let directions = (0..200_000).map(|i| {
            let (w, pdf) = p.sample(-flow, Rng::new(1, 2, i).next_2d());
            assert!((w.length() - 1.0).abs() < 1e-12);
            assert!((pdf / p.pdf(-flow, w) - 1.0).abs() < 1e-9);
            w
        });
        let value = sphere_chi_square(directions, |w| p.eval(w, -flow));
        assert!(value > SIGNIFICANCE, "{p:?}: p-value {value}");
    }
}

#[test]
fn the_wrong_orientation_is_noticed() {
    let p = Phase::henyey_greenstein(0.05).expect("a valid g");
    let p = p.at(Vec3::ZERO);
    let directions = (0..200_000).map(|i| p.sample(-Vec3::Z, Rng::new(1, 2, i).next_2d()).0);
    let value = sphere_chi_square(directions, |w| p.eval(w, Vec3::Z));
    assert!(value < SIGNIFICANCE, "backward passes for forward: p-value {value}");
}

#[test]
fn inversion_holds_for_the_sharpest_lobes() {
    // The distribution function of Henyey-Greenstein in closed form, as a function of 1 - c.
    for g in [0.5, 0.99, SHARPEST] {
        let p = Phase::henyey_greenstein(g).expect("a valid g");
        let p = p.at(Vec3::ZERO);
        for u in [1e-9, 0.01, 0.3, 0.7, 0.99, 1.0 - 1e-9] {
            let (w, _) = p.sample(-Vec3::Z, [u, 0.0]);
            // The sine has its digits where the cosine has lost them.
            let below = w.x.hypot(w.y).powi(2) / (1.0 + w.z);
            let root = ((1.0 - g).powi(2) + 2.0 * g * below).sqrt();
            let above = (1.0 + g) / (2.0 * g) * (1.0 - (1.0 - g) / root);
            assert!((above + u - 1.0).abs() < 1e-9, "g {g}: {u} comes back as {}", 1.0 - above);
        }
    }
}

#[test]
fn forward_is_forward() {
    let forward = Phase::henyey_greenstein(0.7).expect("a valid g");
    let forward = forward.at(Vec3::ZERO);
    assert!(at_cosine(&forward, 1.0) > 100.0 * at_cosine(&forward, -1.0));
    let (w, _) = forward.sample(-Vec3::X, [0.5, 0.5]);
    assert!(w.x > 0.8);
    for p in phases() {
        assert!(p.at(Vec3::ZERO).sample(-Vec3::Y, [0.25, 0.5]).1.is_finite(), "{p:?}");
    }
}

#[test]
fn derivatives_are_those_of_duals() {
    let close = |a: f64, b: f64| (a - b).abs() <= 1e-10 * b.abs().max(1e-300);
    let mut rng = Rng::new(5, 0, 0);
    for p in &phases() {
        let p = p.at(Vec3::ZERO);
        for _ in 0..200 {
            let c = 2.0 * rng.next_f64() - 1.0;
            let d = at_cosine(&p, Dual::<f64, 1>::variable(c, 0));
            let [wo, wi] = directions(c);
            let by = p.gradient(wo, wi);
            // The directions are turned as the cosine grows.
            let cosine = by.wi.dot(vec3(-c / wi.x, 0.0, -1.0));
            assert!(close(cosine, d.eps[0]), "{p:?} at {c}: {cosine} {}", d.eps[0]);
            assert_eq!(by.wo.dot(wo), by.wi.dot(wi));
            if let Some(g) = p.mean_cosine_parameter() {
                let d = henyey_greenstein(Dual::<f64, 1>::variable(g, 0), Dual::from(c));
                assert!(close(by.g, d.eps[0]), "{p:?} at {c}: {} {}", by.g, d.eps[0]);
            }
        }
    }
}

#[test]
fn impossible_mean_cosines_are_refused() {
    for g in [1.0, -1.0, 1.5, f64::NAN, f64::INFINITY] {
        assert!(Phase::henyey_greenstein(g).is_err(), "{g}");
    }
}

/// Values of `eval_pdf` of Mitsuba 3.9.1.
#[test]
fn blends_and_tables_are_those_of_mitsuba() {
    let p = table(&[0.5, 1.0, 1.5, 4.0]);
    for (c, value) in
        [(-1.0, 0.0251297), (-0.5, 0.043977), (0.3, 0.0741327), (0.9, 0.182191), (1.0, 0.201038)]
    {
        assert!((at_cosine(&p.at(Vec3::ZERO), c) - value).abs() < 1e-6, "{c}");
    }
    for (c, value) in [(-0.5, 0.0419197), (0.5, 0.0881949), (1.0, 0.358099)] {
        assert!((at_cosine(&blend().at(Vec3::ZERO), c) - value).abs() < 1e-6, "{c}");
    }
    let wrong = |values: &[f64]| PhaseTable::new(values.to_vec()).unwrap_err();
    for values in [&[1.0][..], &[0.0, 0.0], &[1.0, -1.0], &[1.0, f64::NAN]] {
        assert!(matches!(wrong(values), MediumError::PhaseFunction { .. }));
    }
    assert!(PhaseBlend::new(1.5, [Phase::Isotropic, Phase::Rayleigh]).is_err());
}
