//! The models against the papers' formulas, written out with explicit half vectors and complex
//! numbers, and the special functions against tables.

use core::f64::consts::{FRAC_1_PI, PI};

use crate::model::surface::fresnel::{
    conductor_reflected, dielectric_reflected, dielectric_transmitted,
};
use crate::model::surface::tests::*;
use crate::model::surface::visible_slope::{erfc_scaled, visible_area, visible_slope};

/// Walter et al. 2007, eqs. 25-27 and 33-34.
fn density_and_masking(
    distribution: Distribution,
    alpha: f64,
    m: f64,
    v: f64,
    v_m: f64,
) -> [f64; 2] {
    let tan2 = |cos: f64| 1.0 / (cos * cos) - 1.0;
    let facing = v * v_m * m > 0.0;
    let [d, g] = match distribution {
        Distribution::Beckmann => {
            let a = 1.0 / (alpha * tan2(v).sqrt());
            let fit = (3.535 * a + 2.181 * a * a) / (1.0 + 2.276 * a + 2.577 * a * a);
            let d = (-tan2(m) / (alpha * alpha)).exp() / (PI * alpha * alpha * m.powi(4));
            [d, if a < 1.6 { fit } else { 1.0 }]
        }
        Distribution::Ggx => {
            let d = alpha * alpha / (PI * m.powi(4) * (alpha * alpha + tan2(m)).powi(2));
            [d, 2.0 / (1.0 + (1.0 + alpha * alpha * tan2(v)).sqrt())]
        }
    };
    [d, if facing { g } else { 0.0 }]
}

/// Eqs. 20 and 21 of the same, times the cosine at the light; `reflectance` is Fresnel's factor of
/// the cosine at `wo`, `eta` the index at `wi` over that at `wo` (1 when they share a side).
fn microfacet_value(
    distribution: Distribution,
    alpha: f64,
    [wo, wi, n]: [Vec3; 3],
    eta: f64,
    fresnel: impl Fn(f64) -> f64,
) -> f64 {
    let [cos_o, cos_i] = [n.dot(wo), n.dot(wi)];
    let h = wo + wi * eta;
    let m = (h * n.dot(h).signum()).normalize();
    let [o_m, i_m] = [m.dot(wo), m.dot(wi)];
    let [d, masking_o] = density_and_masking(distribution, alpha, n.dot(m), cos_o, o_m);
    let [_, masking_i] = density_and_masking(distribution, alpha, n.dot(m), cos_i, i_m);
    let common = d * masking_o * masking_i / cos_o.abs();
    if cos_o * cos_i > 0.0 {
        common * fresnel(o_m.abs()) / 4.0
    } else {
        let jacobian = (o_m * i_m).abs() / (o_m + eta * i_m).powi(2);
        common * (1.0 - fresnel(o_m.abs())) * jacobian
    }
}

/// Fresnel's reflectance for a complex index, by complex arithmetic.
fn complex_reflectance(cos: f64, eta: f64, k: f64) -> f64 {
    type C = [f64; 2];
    let mul = |a: C, b: C| [a[0] * b[0] - a[1] * b[1], a[0] * b[1] + a[1] * b[0]];
    let norm = |a: C| a[0] * a[0] + a[1] * a[1];
    let index2 = mul([eta, k], [eta, k]);
    let root2 = [index2[0] - (1.0 - cos * cos), index2[1]];
    let (length, angle) = (norm(root2).sqrt().sqrt(), 0.5 * root2[1].atan2(root2[0]));
    let root = [length * angle.cos(), length * angle.sin()];
    let s = norm([cos - root[0], -root[1]]) / norm([cos + root[0], root[1]]);
    let scaled = [index2[0] * cos, index2[1] * cos];
    let p = norm([scaled[0] - root[0], scaled[1] - root[1]])
        / norm([scaled[0] + root[0], scaled[1] + root[1]]);
    0.5 * (s + p)
}

#[test]
fn microfacet_values_follow_the_papers() {
    let mut rng = Rng::new(51, 0, 0);
    let n = normal();
    for distribution in [Distribution::Beckmann, Distribution::Ggx] {
        for alpha in [0.1, 0.7] {
            let metal = copper(distribution, alpha);
            let [over, under] = [1.5, 0.7].map(|eta| glass(distribution, alpha, eta));
            let mut seen = [0; 3];
            for _ in 0..20_000 {
                let at = [random_direction(&mut rng), random_direction(&mut rng), n];
                let [wo, wi, _] = at;
                // The model's masking is continuous where the paper's has a step of 6e-5.
                let agrees = |a: f64, b: f64| (a - b).abs() <= 1.3e-4 * b.abs() + 1e-12;
                if n.dot(wo) > 0.0 && n.dot(wi) > 0.0 {
                    let fresnel = |cos| complex_reflectance(cos, metal.eta.g, metal.k.g);
                    let expected = metal.specular_reflectance.g
                        * microfacet_value(distribution, alpha, at, 1.0, fresnel);
                    let value = Bsdf::RoughConductor(metal).eval(wo, wi, n).g;
                    assert!(agrees(value, expected), "{metal:?} {at:?}: {value} {expected}");
                    seen[0] += usize::from(value > 1e-6);
                }
                for interface in [over, under] {
                    let beyond = if n.dot(wo) > 0.0 { interface.eta } else { 1.0 / interface.eta };
                    let same_side = n.dot(wo) * n.dot(wi) > 0.0;
                    let fresnel = |cos| dielectric_reflected(cos, beyond);
                    let ratio = if same_side { 1.0 } else { beyond };
                    let expected = microfacet_value(distribution, alpha, at, ratio, fresnel);
                    let value = Bsdf::RoughDielectric(interface).eval(wo, wi, n).g;
                    assert!(agrees(value, expected), "{interface:?} {at:?}: {value} {expected}");
                    seen[1 + usize::from(same_side)] += usize::from(value > 1e-6);
                }
            }
            assert!(seen.into_iter().all(|count| count > 200), "{seen:?}");
        }
    }
}

#[test]
fn phong_follows_its_formula() {
    let (phong, n) = (Phong::default(), Vec3::Z);
    let [wo, wi] = [vec3(0.6, 0.0, 0.8), vec3(-0.48, 0.36, 0.8)];
    let mirror = vec3(-0.6, 0.0, 0.8);
    let fs = 0.5 * FRAC_1_PI + 0.2 * 32.0 * 0.5 * FRAC_1_PI * mirror.dot(wi).powi(30);
    let value = Bsdf::Phong(phong).eval(wo, wi, n).r;
    assert!((value - fs * 0.8).abs() < 1e-12);
}

#[test]
fn fresnel_has_its_known_values() {
    for eta in [1.5, 0.7] {
        let normal: f64 = dielectric_reflected(1.0, eta);
        assert!((normal - ((eta - 1.0) / (eta + 1.0)).powi(2)).abs() < 1e-15);
        // At Brewster's angle only one polarisation is reflected.
        let brewster = 1.0 / (1.0 + eta * eta).sqrt();
        let s = (1.0 - eta * eta) / (1.0 + eta * eta);
        assert!((dielectric_reflected(brewster, eta) - 0.5 * s * s).abs() < 1e-14);
        for cos in [0.2_f64, 0.5, 0.9, 1.0] {
            let cos2_t = 1.0 - (1.0 - cos * cos) / (eta * eta);
            let reflected = dielectric_reflected(cos, eta);
            let transmitted = if cos2_t > 0.0 {
                // A common factor of the cosines cancels.
                dielectric_transmitted(7.0 * cos, 7.0 * cos2_t.sqrt(), eta)
            } else {
                0.0
            };
            assert!((reflected + transmitted - 1.0).abs() < 1e-14, "{eta} {cos}");
            // A conductor that does not absorb is a dielectric.
            assert!((conductor_reflected(cos, eta, 0.0) - reflected).abs() < 1e-14);
        }
    }
    for cos in [1e-9, 0.3, 1.0] {
        assert!((conductor_reflected(cos, 0.0, 1.0) - 1.0_f64).abs() < 1e-15);
        for (eta, k) in [(0.2, 3.9), (1.5, 0.1), (0.05, 0.3), (2.0, 8.0)] {
            let (a, b) = (conductor_reflected(cos, eta, k), complex_reflectance(cos, eta, k));
            assert!((a - b).abs() < 1e-13, "{cos} {eta} {k}: {a} {b}");
        }
    }
}

#[test]
fn erfc_meets_its_table() {
    let table = [
        (0.0, 1.0),
        (0.5, 0.479_500_122_186_953_5),
        (1.0, 0.157_299_207_050_285_13),
        (2.0, 4.677_734_981_047_266e-3),
        (5.0, 1.537_459_794_428_035e-12),
        (10.0, 2.088_487_583_762_545e-45),
    ];
    for (x, erfc) in table {
        let x: f64 = x;
        let value = erfc_scaled(x) * (-x * x).exp();
        assert!((value / erfc - 1.0).abs() < 2e-9, "{x}: {value} {erfc}");
    }
}

/// The slope at the fraction `u` of the density, against Simpson's rule.
#[test]
fn visible_slopes_invert_their_distribution() {
    for degrees in [0.0_f64, 1.0, 30.0, 60.0, 85.0, 89.999, 90.0] {
        let (sin, cos) = degrees.to_radians().sin_cos();
        let density = |p: f64| (sin * p + cos).max(0.0) * (-p * p).exp();
        let integral = |from: f64, to: f64| {
            let (count, width) = (2000, (to - from) / 2000.0);
            let inner =
                (1..count).map(|i| (2 + 2 * (i % 2)) as f64 * density(from + i as f64 * width));
            (density(from) + density(to) + inner.sum::<f64>()) * width / 3.0
        };
        // From the horizon on, where the density has a kink.
        let horizon = (-cos / sin).max(-8.0);
        let all = integral(horizon, 8.0);
        assert!((visible_area(cos, sin) * PI.sqrt() / all - 1.0).abs() < 1e-8, "{degrees}");
        for u in [1e-9, 1e-3, 0.1, 0.4, 0.5, 0.6, 0.9, 0.999, 1.0 - 1e-9] {
            let p = visible_slope(cos, sin, u);
            let fraction = integral(p, 8.0) / all;
            let tolerance = 1e-7 * f64::max(u, 1e-3);
            assert!((fraction - u).abs() < tolerance, "{degrees} {u}: {p} {fraction}");
        }
    }
}

#[test]
fn the_masking_fit_is_near_the_exact_masking() {
    let mut worst: f64 = 0.0;
    for alpha in [1e-3, 0.1, 0.5, 1.0] {
        for i in 1..1000 {
            let cos = f64::from(i) / 1000.0;
            let [fit, exact] = [
                Distribution::Beckmann.masking(cos, alpha),
                Distribution::Beckmann.exact_masking(cos, alpha),
            ];
            worst = worst.max((fit / exact - 1.0).abs());
        }
    }
    assert!((1e-3..3.5e-3).contains(&worst), "{worst}");
}
