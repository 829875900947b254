//! Scattering under one roof: gradients against dual numbers, densities against samples' weights.

use drt_math::{Dual, Real, Rgb, RgbVec, Rng, Vec3, warp};
use drt_medium::{Homogeneous, Medium, Phase, henyey_greenstein};

use crate::derivative::tests::fade;
use crate::derivative::tests::scenes::{diffuse, glass, metal, phong, twosided};
use crate::model::surface::{Bsdf, Constants, Given};
use crate::world::scatter::{Drawn, Scattering};

/// The coordinates of `wo`, `wi`, the shading and the geometric normal.
type D = Dual<f64, 12>;

fn seeded(v: Vec3, lane: usize) -> Vec3<D> {
    let [x, y, z] = v.to_array();
    [D::variable(x, lane), D::variable(y, lane + 1), D::variable(z, lane + 2)].into()
}

fn random(rng: &mut Rng) -> Vec3 {
    warp::uniform_sphere(rng.next_2d())
}

/// The largest deviation of the derivatives of each channel, over the largest derivative.
fn deviation(gradient: [RgbVec; 4], truth: Rgb<D>) -> f64 {
    let mut worst: f64 = 0.0;
    let channels = gradient.map(|g| [g.r, g.g, g.b]);
    for (channel, truth) in truth.to_array().into_iter().enumerate() {
        let largest = truth.eps.iter().fold(1e-3, |m: f64, e| m.max(e.abs()));
        for (i, g) in channels.iter().enumerate() {
            for (j, slope) in g[channel].to_array().into_iter().enumerate() {
                worst = worst.max((slope - truth.eps[3 * i + j]).abs() / largest);
            }
        }
    }
    worst
}

/// A direction bent to within half a degree of the plane.
fn near_horizon(w: Vec3, n: Vec3, rng: &mut Rng) -> Vec3 {
    (w.reject(n) + n * (0.0125 * (rng.next_f64() - 0.3))).normalize()
}

#[test]
fn surfaces_also_where_they_fade() {
    let mut rng = Rng::new(1, 0, 0);
    let models = [diffuse(0.3, 0.5, 0.7), phong(), metal(), glass(), twosided(phong())];
    let (mut fading, mut worst) = (0, 0.0_f64);
    for bsdf in &models {
        for i in 0..1000 {
            let (ng, ns) = (random(&mut rng), random(&mut rng));
            let mut wo = random(&mut rng);
            if i % 3 == 0 {
                wo = near_horizon(wo, ns, &mut rng);
            }
            let u = [rng.next_f64(), rng.next_f64(), rng.next_f64()];
            let Some(mut wi) = bsdf.sample(wo, ns, u, Given::Wo).map(|s| s.w) else { continue };
            if i % 3 == 1 {
                wi = near_horizon(wi, ng, &mut rng);
            }
            for smooth in [false, true] {
                let scattering = Scattering::Surface(bsdf.at(None, ng, ns, smooth));
                let [o, i, n, facet] =
                    [(wo, 0), (wi, 3), (ns, 6), (ng, 9)].map(|(v, lane)| seeded(v, lane));
                let mut truth = bsdf.value(Constants, None, [o, i, n]);
                if smooth {
                    let factor = fade(n.dot(o)) * fade(facet.dot(i));
                    truth *= factor;
                    fading += u32::from(factor.re < 1.0 && truth.r.re > 0.0);
                }
                let value = scattering.eval(wo, wi);
                let error = (truth.map(Real::re) - value).max_abs();
                assert!(error <= 1e-12 * value.max_abs(), "{bsdf:?}: {error:e} of {value:?}");
                let g = scattering.gradient(wo, wi);
                worst = worst.max(deviation([g.wo, g.wi, g.ns, g.ng], truth));
            }
        }
    }
    assert!(worst < 1e-10 && fading > 100, "{worst:e}, {fading}");
}

#[test]
fn phase_functions() {
    let mut rng = Rng::new(2, 0, 0);
    for phase in [Phase::Isotropic, Phase::HenyeyGreenstein { g: -0.7 }, Phase::Rayleigh] {
        for _ in 0..1000 {
            let (wo, wi) = (random(&mut rng), random(&mut rng));
            let medium = Medium::new(Homogeneous::default(), phase.clone());
            let (x, phase) = (Vec3::ZERO, medium.phase_at(Vec3::ZERO));
            let g = Scattering::Volume { medium: &medium, x, phase }.gradient(wo, wi);
            let (moving_wo, moving_wi) = (seeded(wo, 0), seeded(wi, 3));
            let cosine = -moving_wo.dot(moving_wi);
            let truth = Rgb::splat(phase.eval(moving_wo, moving_wi));
            assert!(deviation([g.wo, g.wi, g.ns, g.ng], truth) < 1e-10);
            if let Some(mean) = phase.mean_cosine_parameter() {
                let by_g = henyey_greenstein(Dual::<f64, 1>::variable(mean, 0), cosine.re.into());
                let of_phase = g.phase.expect("a phase function").g;
                assert!((by_g.eps[0] - of_phase).abs() < 1e-10 * (1.0 + of_phase.abs()));
            }
        }
    }
}

/// What a sample weighs, times its density, is the value: both directions of the walk.
#[test]
fn samples_have_the_density_they_claim() {
    let mut rng = Rng::new(3, 0, 0);
    for bsdf in [phong(), metal(), glass()] {
        let bsdf: &Bsdf = &bsdf;
        let (ng, ns) = (random(&mut rng), random(&mut rng));
        for smooth in [false, true] {
            let s = Scattering::Surface(bsdf.at(None, ng, ns, smooth));
            for given in [Given::Wo, Given::Wi] {
                for _ in 0..200 {
                    let from = random(&mut rng);
                    if let Some(Drawn::Spread(w, pdf)) = s.sample(from, given, &mut rng) {
                        assert!((s.pdf(from, w, given) - pdf).abs() <= 1e-12 * pdf);
                    }
                }
            }
        }
    }
}
