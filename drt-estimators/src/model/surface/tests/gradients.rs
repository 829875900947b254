use crate::model::surface::model::{COORDINATES, by_duals};
use crate::model::surface::tests::*;

/// Lanes of the coordinates of `wo`, `wi` and `n`; one for each property follows.
const LANES: usize = COORDINATES + BsdfParams::MOST;

/// Directions at random, about half of the second ones by sampling (or sharp lobes would be missed)
/// and some close to the surface.
fn configuration(bsdf: &Bsdf, rng: &mut Rng) -> Option<(Vec3, Vec3)> {
    let squeeze = |w: Vec3, by: f64| (w - normal() * (normal().dot(w) * by)).normalize();
    let mut wo = random_direction(rng);
    if rng.next_f64() < 0.2 {
        wo = squeeze(wo, 0.999);
    }
    if rng.next_f64() < 0.5 {
        return Some((wo, squeeze(random_direction(rng), 0.9)));
    }
    bsdf.sample(wo, normal(), random_3d(rng), Given::Wo).map(|s| (wo, s.w))
}

fn for_each_configuration(per_case: u32, mut check: impl FnMut(&Bsdf, Vec3, Vec3)) {
    let mut all = cases();
    all.extend(sharp_cases());
    let mut rng = Rng::new(31, 0, 0);
    for bsdf in &all {
        let mut nonzero = 0;
        for _ in 0..per_case {
            if let Some((wo, wi)) = configuration(bsdf, &mut rng) {
                check(bsdf, wo, wi);
                nonzero += u32::from(!bsdf.eval(wo, wi, normal()).is_zero());
            }
        }
        assert!(nonzero > per_case / 10, "{bsdf:?}: {nonzero}");
    }
}

/// The half vector's tangent comes by a cancellation that sharp microfacets magnify.
fn rounding(bsdf: &Bsdf) -> f64 {
    match bsdf {
        Bsdf::RoughConductor(RoughConductor { alpha, .. })
        | Bsdf::RoughDielectric(RoughDielectric { alpha, .. }) => {
            f64::max(1e-10, 1e-14 / (alpha * alpha))
        }
        _ => 1e-10,
    }
}

/// Whatever way a model has to its derivatives: they are those of its value over dual numbers.
#[test]
fn gradients_equal_those_of_dual_numbers() {
    for_each_configuration(500, |bsdf, wo, wi| {
        let own = bsdf.gradient(wo, wi, normal());
        let duals =
            by_duals::<LANES>(bsdf.differentiated(), [wo, wi, normal()], |numbers, directions| {
                bsdf.value(numbers, None, directions)
            });
        let off = (own.value - duals.value).max_abs();
        assert!(off <= 1e-12 * duals.value.max_abs(), "{bsdf:?}: {own:?} {duals:?}");
        let vectors = |g: &BsdfGradient| {
            [g.wo, g.wi, g.n].map(|v| [v.r, v.g, v.b]).into_iter().flatten().collect::<Vec<_>>()
        };
        let (own_vectors, vectors) = (vectors(&own), vectors(&duals));
        for channel in 0..3 {
            let of_channel = |all: &[Vec3]| [0, 3, 6].map(|k| all[k + channel]);
            let [a, b] = [&own_vectors, &vectors].map(|all| of_channel(all));
            let largest = b.iter().fold(0.0, |m: f64, v| m.max(v.max_abs()));
            for (a, b) in a.into_iter().zip(b) {
                let error = (a - b).max_abs();
                assert!(error <= rounding(bsdf) * largest, "{bsdf:?} {wo:?} {wi:?}: {error:e}");
            }
        }
        for property in bsdf.differentiated().iter() {
            let [a, b] = [&own, &duals].map(|g| g.params.get(property).to_array());
            for ((a, b), value) in a.into_iter().zip(b).zip(duals.value.to_array()) {
                let tolerance = rounding(bsdf) * (b.abs() + value);
                assert!((a - b).abs() <= tolerance, "{bsdf:?} {property}: {a} {b}");
            }
        }
    });
}

#[test]
fn values_of_eval_and_gradient_agree() {
    for_each_configuration(200, |bsdf, wo, wi| {
        assert_eq!(bsdf.gradient(wo, wi, normal()).value, bsdf.eval(wo, wi, normal()));
    });
}

/// Turning everything changes nothing, whatever the extension off the unit spheres.
#[test]
fn rigid_rotations_have_no_derivative() {
    let mut rng = Rng::new(32, 0, 0);
    for_each_configuration(200, |bsdf, wo, wi| {
        // Without a point the frame of what tells directions apart is any.
        if bsdf.is_oriented() {
            return;
        }
        let axis = random_direction(&mut rng);
        let g = bsdf.gradient(wo, wi, normal());
        let parts = [(g.wo, wo), (g.wi, wi), (g.n, normal())].map(|(g, v)| g.dot(axis.cross(v)));
        let largest = parts.iter().fold(0.0, |m: f64, p| m.max(p.max_abs()));
        let sum = parts[0] + parts[1] + parts[2];
        assert!(sum.max_abs() <= 1e-9 * largest + 1e-9, "{bsdf:?}: {parts:?}");
    });
}

/// Central differences of the value along great circles, where it is smooth enough for them.
#[test]
fn tangential_slopes_are_those_of_finite_differences() {
    let mut rng = Rng::new(33, 0, 0);
    let step = 1e-5;
    for bsdf in cases() {
        for _ in 0..200 {
            let n = normal();
            let wo = random_direction(&mut rng);
            let Some(s) = bsdf.sample(wo, n, random_3d(&mut rng), Given::Wo) else { continue };
            // Away from where the model ends.
            if n.dot(wo).abs() < 0.05 || n.dot(s.w).abs() < 0.05 {
                continue;
            }
            let at = [wo, s.w, n];
            let velocity = at.map(|v| random_direction(&mut rng).reject(v));
            let moved = |t: f64| {
                let [wo, wi, n] = [0, 1, 2].map(|i| (at[i] + velocity[i] * t).normalize());
                bsdf.eval(wo, wi, n)
            };
            let g = bsdf.gradient(wo, s.w, n);
            let slope = g.wo.dot(velocity[0]) + g.wi.dot(velocity[1]) + g.n.dot(velocity[2]);
            let coarse = (moved(step) - moved(-step)) * (0.5 / step);
            let fine = (moved(0.5 * step) - moved(-0.5 * step)) * (1.0 / step);
            let tolerance = 4.0 * (fine - coarse).max_abs() + 1e-6 * (1.0 + slope.max_abs());
            let error = (slope - fine).max_abs();
            assert!(error <= tolerance, "{bsdf:?} {at:?}: {slope:?} {fine:?}");
        }
    }
}
