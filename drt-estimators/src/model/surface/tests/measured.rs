//! Materials of tables.

use alloc::string::ToString;
use alloc::sync::Arc;

use core::f32::consts::{FRAC_PI_2, PI};

use drt_math::testing::{SIGNIFICANCE, sphere_chi_square};

use super::*;

const ALPHA: [f64; 2] = [0.5, 0.25];

/// Copper, even or not, with azimuths of a part of a turn.
fn tables(phi_i: &[f32], resolution: [usize; 3]) -> MeasuredTables {
    let alpha = if phi_i.len() <= 2 { [0.35; 2] } else { ALPHA };
    MeasuredTables::of_metal(&copper(Distribution::Ggx, 0.1), alpha, phi_i, resolution)
        .expect("tables")
}

fn measured(tables: MeasuredTables) -> Bsdf {
    Bsdf::Measured(Arc::new(Measured::new(tables).expect("a material")))
}

fn azimuths(from: f32, to: f32, count: u8) -> Vec<f32> {
    (0..count).map(|k| from + (to - from) * f32::from(k) / f32::from(count - 1)).collect()
}

/// Isotropic, and of a quarter, half and whole turn.
pub(super) fn measured_cases() -> Vec<Bsdf> {
    let azimuths = [azimuths(-PI, -FRAC_PI_2, 4), azimuths(-PI, 0.0, 5), azimuths(-PI, PI, 7)];
    let anisotropic = azimuths.map(|phi_i| measured(tables(&phi_i, [7, 17, 9])));
    core::iter::once(isotropic_case()).chain(anisotropic).collect()
}

/// The first of the [cases](measured_cases): tables take long to make.
pub(super) fn isotropic_case() -> Bsdf {
    measured(tables(&[0.0], [7, 17, 9]))
}

fn p_value(bsdf: &Bsdf, from: Vec3, other: &Bsdf) -> f64 {
    let mut rng = Rng::new(81, 0, 0);
    let samples = (0..100_000).map(|_| {
        let drawn = bsdf.sample(from, normal(), random_3d(&mut rng), Given::Wo);
        drawn.map_or(Vec3::splat(f64::NAN), |s| s.w)
    });
    sphere_chi_square(samples, |w| other.pdf(from, w, normal(), Given::Wo))
}

#[test]
fn samples_follow_their_density() {
    let cases = measured_cases();
    for bsdf in &cases {
        for degrees in [15.0, 70.0] {
            let p = p_value(bsdf, tilted(degrees), bsdf);
            assert!(p > SIGNIFICANCE, "{degrees} degrees: p = {p:e}");
        }
        assert!(bsdf.sample(tilted(100.0), normal(), [0.4; 3], Given::Wo).is_none());
    }
    // Planted: a slightly different roughness.
    let metal = copper(Distribution::Ggx, 0.1);
    let wrong = MeasuredTables::of_metal(&metal, [0.36; 2], &[0.0], [7, 17, 9]).expect("tables");
    let p = p_value(&cases[0], tilted(15.0), &measured(wrong));
    assert!(p < SIGNIFICANCE, "{p:e}");
}

/// Values and densities that Mitsuba 3.9.1 (scalar_rgb) gets from files of these tables.
#[test]
fn values_are_those_of_mitsuba() {
    let directions = [
        [[0.3, 0.2, 0.9], [0.1, -0.4, 0.8]],
        [[-0.3, 0.2, 0.9], [0.5, 0.4, 0.3]],
        [[0.8, -0.2, 0.4], [-0.6, 0.3, 0.8]],
        [[0.1, -0.5, 0.6], [0.2, 0.2, 0.9]],
    ];
    let even = [
        [0.316_687_55, 0.185_644_81, 0.135_972_19, 0.331_697_31],
        [0.076_882_27, 0.045_090_76, 0.033_123_35, 0.079_042_67],
        [0.610_350_01, 0.362_134_37, 0.270_829_68, 0.712_911_84],
        [0.308_294_42, 0.180_888_27, 0.132_877_98, 0.333_397_87],
    ];
    let brushed = [
        [0.336_981_18, 0.197_545_20, 0.144_694_12, 0.377_326_76],
        [0.021_879_05, 0.012_825_99, 0.009_392_78, 0.021_894_02],
        [0.635_806_20, 0.376_799_37, 0.281_728_89, 0.791_714_31],
        [0.247_683_00, 0.145_345_63, 0.106_806_62, 0.253_689_32],
    ];
    for (phi_i, expected) in [(alloc::vec![0.0], even), (azimuths(-PI, 0.0, 5), brushed)] {
        let bsdf = measured(tables(&phi_i, [4, 7, 5]));
        for (pair, expected) in directions.iter().zip(expected) {
            let [wo, wi] = pair.map(|w| Vec3::from(w).normalize());
            let [r, g, b] = bsdf.eval(wo, wi, Vec3::Z).to_array();
            let found = [r, g, b, bsdf.pdf(wo, wi, Vec3::Z, Given::Wo)];
            for (found, expected) in found.into_iter().zip(expected) {
                assert!((found - expected).abs() < 1e-5 * expected, "{found} {expected}");
            }
        }
    }
}

/// What tables are made of comes out of them, the closer the finer they are.
#[test]
fn tables_of_a_metal_are_that_metal() {
    let exact = [
        Bsdf::RoughConductor(copper(Distribution::Ggx, 0.35)),
        anisotropic(Bsdf::RoughConductor(copper(Distribution::Ggx, 0.1)), ALPHA),
    ];
    for (exact, phi_i) in exact.iter().zip([alloc::vec![0.0], azimuths(-PI, -FRAC_PI_2, 9)]) {
        let error = |resolution| {
            let bsdf = measured(tables(&phi_i, resolution));
            let mut rng = Rng::new(82, 0, 0);
            let (mut off, mut sum) = (0.0, 0.0);
            for _ in 0..2000 {
                let wo = tilted(75.0 * rng.next_f64());
                let Some(s) = exact.sample(wo, normal(), random_3d(&mut rng), Given::Wo) else {
                    continue;
                };
                let [a, b] = [exact, &bsdf].map(|b| b.eval(wo, s.w, normal()) / s.pdf);
                off += (a - b).max_abs();
                sum += a.max_abs();
            }
            off / sum
        };
        let [coarse, fine] = [error([7, 17, 9]), error([13, 49, 33])];
        assert!(fine < 0.02 && fine < 0.5 * coarse, "{fine} {coarse}");
    }
}

/// Derivatives by dual numbers are those of differences, where both are in the same cells.
#[test]
fn slopes_are_those_of_finite_differences() {
    let (n, mut rng) = (normal(), Rng::new(83, 0, 0));
    for bsdf in measured_cases() {
        let (mut seen, mut planted) = (0, 0);
        for k in 0..400 {
            // Also where the viewer has no azimuth.
            let wo = if k % 8 == 0 { n } else { tilted(80.0 * rng.next_f64()) };
            let Some(s) = bsdf.sample(wo, n, random_3d(&mut rng), Given::Wo) else { continue };
            let velocity = [wo, s.w, n].map(|v| random_direction(&mut rng).reject(v));
            let moved = |h: f64| {
                let at = [wo, s.w, n];
                let [o, i, n] = [0, 1, 2].map(|k| (at[k] + velocity[k] * h).normalize());
                bsdf.eval(o, i, n)
            };
            let difference = |h: f64| (moved(h) - moved(-h)) * (0.5 / h);
            let (coarse, fine) = (difference(2e-6), difference(1e-6));
            let scale = 1.0 + fine.max_abs();
            if (coarse - fine).max_abs() > 1e-4 * scale {
                continue;
            }
            let d = bsdf.gradient(wo, s.w, n);
            assert_eq!(d.value, bsdf.eval(wo, s.w, n));
            let found = d.wo.dot(velocity[0]) + d.wi.dot(velocity[1]) + d.n.dot(velocity[2]);
            let limit = if k % 8 == 0 { 2e-2 } else { 1e-3 };
            assert!((found - fine).max_abs() < limit * scale, "{k}: {found:?} {fine:?}");
            seen += 1;
            planted += u32::from((found + fine).max_abs() > limit * scale);
        }
        assert!(seen > 200 && 10 * planted > 9 * seen, "{seen} {planted}");
    }
}

#[test]
fn extremes_give_numbers() {
    let n = Vec3::Z;
    let tiny = [0.0, 1e-300, 1e-160, 1e-17, 1e-9, 1e-3];
    let directions =
        tiny.iter().flat_map(|z| [1.0, -1.0].map(|x| vec3(x, 0.0, *z).normalize())).chain([n]);
    let directions: Vec<Vec3> = directions.collect();
    for bsdf in measured_cases() {
        for wo in &directions {
            for wi in &directions {
                let (value, g) = (bsdf.eval(*wo, *wi, n), bsdf.gradient(*wo, *wi, n));
                assert_eq!(value, g.value, "{wo:?} {wi:?}");
                let finite = [g.wo, g.wi, g.n].iter().all(|v| v.is_finite());
                assert!(value.is_finite() && finite, "{wo:?} {wi:?} {g:?}");
                assert!(bsdf.pdf(*wo, *wi, n, Given::Wo).is_finite(), "{wo:?} {wi:?}");
            }
            for u in [1e-16, 0.5, 1.0 - 1e-16] {
                for v in [1e-16, 0.5, 1.0 - 1e-16] {
                    let drawn = bsdf.sample(*wo, n, [u, v, 0.5], Given::Wo);
                    assert!(drawn.is_none_or(|s| (s.w.length() - 1.0).abs() < 1e-9));
                }
            }
        }
    }
}

#[test]
fn no_more_light_returns_than_comes() {
    for bsdf in measured_cases() {
        for degrees in [10.0, 70.0] {
            let mut rng = Rng::new(84, 0, 0);
            let mut light = drt_math::Moments::default();
            for _ in 0..4000 {
                let drawn = bsdf.sample(tilted(degrees), normal(), random_3d(&mut rng), Given::Wo);
                let weight = |s: DirectionSample| {
                    bsdf.eval(tilted(degrees), s.w, normal()).max_channel() / s.pdf
                };
                light.push(drawn.map_or(0.0, weight));
            }
            assert!((0.5..1.0).contains(&light.mean()), "{}", light.mean());
        }
    }
}

/// Numbers that do not go on where others stand for them are found, as are those that do.
#[test]
fn parts_of_a_turn_that_do_not_fit() {
    let refused: Vec<_> = measured_cases().iter().map(Bsdf::undifferentiable).collect();
    assert_eq!(refused, [None, Some("measured"), None, None]);
    let mut off = tables(&azimuths(-PI, 0.0, 5), [7, 17, 9]);
    let last = off.rgb.values.len() / 5 * 4;
    off.rgb.values[last..].iter_mut().for_each(|v| *v *= 1.01);
    assert_eq!(measured(off).undifferentiable(), Some("measured"));
}

/// Tables that are taken out again make the same material.
#[test]
fn tables_come_back() {
    for phi_i in [alloc::vec![0.0], azimuths(-PI, PI, 5)] {
        let once = Measured::new(tables(&phi_i, [4, 6, 5])).expect("a material");
        let again = Measured::new(once.clone().into()).expect("a material");
        assert!(once == again);
    }
}

#[test]
fn isotropic_ones_need_no_coordinates() {
    let oriented: Vec<bool> = measured_cases().iter().map(Bsdf::is_oriented).collect();
    assert_eq!(oriented, [false, true, true, true]);
}

#[test]
fn tables_that_make_no_material_are_named() {
    let good = || tables(&[0.0], [4, 5, 4]);
    type Change<'a> = &'a dyn Fn(&mut MeasuredTables);
    let refused = |change: Change<'_>| {
        let mut tables = good();
        change(&mut tables);
        Measured::new(tables).expect_err("not a material").to_string()
    };
    let cases: [(Change<'_>, [&str; 2]); 12] = [
        (&|t| t.phi_i.clear(), ["`phi_i`", "empty"]),
        (&|t| t.theta_i[1] = 0.0, ["`theta_i`", "must increase"]),
        (&|t| t.theta_i[1] = f32::NAN, ["`theta_i`", "finite"]),
        (&|t| t.ndf.shape = alloc::vec![25], ["`ndf`", "rows × columns"]),
        (&|t| t.sigma.values[3] = -1.0, ["`sigma`", "is -1 at index 3"]),
        (&|t| t.vndf.shape[1] = 5, ["`vndf`", "expected 1 × 4 × rows × columns"]),
        (&|t| t.vndf.values[7] = f32::INFINITY, ["`vndf`", "finite"]),
        (&|t| t.vndf.values.fill(0.0), ["`vndf`", "0 all over"]),
        (&|t| t.luminance.shape[2] = 1, ["`luminance`", "two at least"]),
        (&|t| t.luminance.values[5] = 0.0, ["`luminance`", "is 0 in row 1, column 1"]),
        (&|t| t.rgb.shape[2] = 1, ["`rgb`", "expected 1 × 4 × 3 × 4 × 4"]),
        (&|t| t.rgb.shape = alloc::vec![usize::MAX; 5], ["`rgb`", "expected"]),
    ];
    for (change, parts) in cases {
        let message = refused(change);
        assert!(parts.iter().all(|part| message.contains(part)), "{parts:?}: {message}");
    }
    let spans = MeasuredTables::of_metal(
        &RoughConductor::default(),
        [0.3; 2],
        &azimuths(-PI, -2.0, 3),
        [4, 5, 4],
    );
    let message = Measured::new(spans.expect("tables")).expect_err("not a turn").to_string();
    assert!(message.contains("`phi_i`") && message.contains("quarter"), "{message}");
    let few = MeasuredTables::of_metal(&RoughConductor::default(), [0.3; 2], &[0.0], [4, 1, 4]);
    assert!(few.expect_err("no grid").to_string().contains("`ndf`"));
}
