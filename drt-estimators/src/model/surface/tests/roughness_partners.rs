use alloc::format;

use drt_math::stats::Moments;

use crate::model::surface::tests::*;

/// Rough surfaces of both kinds.
pub(super) fn rough(alpha: f64) -> Vec<Bsdf> {
    let mut all = Vec::new();
    for distribution in [Distribution::Beckmann, Distribution::Ggx] {
        all.push(Bsdf::RoughConductor(copper(distribution, alpha)));
        all.push(Bsdf::RoughDielectric(glass(distribution, alpha, 1.5)));
        all.push(Bsdf::RoughDielectric(glass(distribution, alpha, 1.0 / 1.33)));
    }
    all
}

/// Directions in which light leaves rough surfaces and arrives from, drawn by their densities.
pub(super) fn scattered(seed: u64, mut each: impl FnMut(f64, &Bsdf, [Vec3; 2])) {
    let mut rng = Rng::new(seed, 0, 0);
    for alpha in [0.4, 0.05, 1e-3] {
        for bsdf in rough(alpha) {
            for _ in 0..300 {
                let wo = tilted(160.0 * rng.next_f64());
                let drawn = bsdf.sample(wo, normal(), random_3d(&mut rng), Given::Wo);
                if let Some(drawn) = drawn {
                    each(alpha, &bsdf, [wo, drawn.w]);
                }
            }
        }
    }
}

#[test]
fn counterparts_go_both_ways() {
    let mut found = 0;
    scattered(31, |alpha, bsdf, [wo, wi]| {
        let Some(there) = bsdf.roughness_partner(None, wo, wi, normal()) else { return };
        let back = bsdf.roughness_partner(None, wo, there.w, normal()).expect("the way back");
        let message = || format!("{bsdf:?} {wo:?} {wi:?} {there:?} {back:?}");
        assert!((back.w - wi).length() < 1e-6 * alpha, "{}", message());
        assert!((back.ratio * there.ratio - 1.0).abs() < 1e-5, "{}", message());
        let ([a, b], [c, d]) = (there.slopes, back.slopes);
        let same = |a: f64, b: f64| (a - b).abs() < 1e-5 * (1.0 + a.abs());
        assert!(a * b <= 0.0 && same(a, d) && same(b, c), "{}", message());
        found += 1;
    });
    assert!(found > 4000, "{found}");
}

/// The derivative by the roughness of what a smooth sky brings: as the density of its directions answers,
/// what is left by their differences from pairs, and the latter with densities that are not compared.
fn derivatives(bsdf: &Bsdf, wo: Vec3) -> [Moments; 3] {
    let light = |w: Vec3| 1.0 + 0.6 * w.x - 0.5 * w.y * w.z;
    let mut rng = Rng::new(32, 0, 0);
    let mut moments = [Moments::default(); 3];
    for _ in 0..200_000 {
        let drawn = bsdf.sample(wo, normal(), random_3d(&mut rng), Given::Wo);
        let Some(s) = drawn else {
            moments.iter_mut().for_each(|m| m.push(0.0));
            continue;
        };
        let g = bsdf.gradient(wo, s.w, normal());
        let region = g.params.get(Property::Alpha).g * light(s.w);
        let partner = bsdf.roughness_partner(None, wo, s.w, normal());
        let [apart, uncompared] = partner.map_or([region; 2], |c| {
            let beside = bsdf.eval(wo, c.w, normal()).g * light(c.w);
            let there = c.ratio * bsdf.pdf(wo, c.w, normal(), Given::Wo) / c.slopes[1].abs();
            let here = s.pdf / c.slopes[0].abs();
            let share = here / (here + there);
            [c.ratio, 1.0].map(|ratio| {
                let difference = g.value.g * light(s.w) - ratio * beside;
                region + c.slopes[0] * (share * difference - g.value.g * light(s.w))
            })
        });
        for (moments, value) in moments.iter_mut().zip([region, apart, uncompared]) {
            moments.push(value / s.pdf);
        }
    }
    moments
}

#[test]
fn pairs_tell_the_derivative_by_the_roughness() {
    for bsdf in rough(0.3) {
        // Metal is black from behind.
        let sides: &[f64] =
            if bsdf.is_transmissive() { &[20.0, 70.0, 86.0, 140.0] } else { &[20.0, 70.0, 86.0] };
        for &degrees in sides {
            let wo = tilted(degrees);
            let [region, fair, faulty] = derivatives(&bsdf, wo);
            let z = |apart: Moments| {
                let variance = region.variance_of_mean() + apart.variance_of_mean();
                (region.mean() - apart.mean()) / f64::sqrt(variance)
            };
            assert!(z(fair).abs() < 4.0, "{bsdf:?} at {degrees} degrees: {region:?} {fair:?}");
            // Planted: densities of the two directions are not compared.
            assert!(z(faulty).abs() > 8.0, "{bsdf:?} at {degrees} degrees: {region:?} {faulty:?}");
        }
    }
}

#[test]
fn noise_of_pairs_does_not_grow_as_lobes_narrow() {
    for distribution in [Distribution::Beckmann, Distribution::Ggx] {
        let noise = |alpha: f64| {
            let metal = Bsdf::RoughConductor(copper(distribution, alpha));
            derivatives(&metal, tilted(30.0)).map(|m| m.variance_of_mean())
        };
        let [wide, narrow] = [0.1, 0.001].map(noise);
        let growth = [0, 1].map(|k| narrow[k] / wide[k]);
        assert!(growth[0] > 3000.0 && growth[1] < 3.0, "{growth:?}");
        assert!(wide[1] < 0.05 * wide[0], "{wide:?}");
    }
}
