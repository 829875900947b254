use drt_math::Dual;

use crate::model::surface::tests::*;

/// Lanes 0..9 are the coordinates of `wo`, `wi` and `n`; three for each property follow.
const LANES: usize = 24;
type D = Dual<f64, LANES>;

fn seeded(v: [f64; 3], lane: usize) -> [D; 3] {
    [0, 1, 2].map(|i| D::variable(v[i], lane + i))
}

/// The value of a BSDF with all its derivatives, and each property's first lane.
fn by_duals(bsdf: &Bsdf, wo: Vec3, wi: Vec3, n: Vec3) -> (Rgb<D>, Vec<(Property, usize)>) {
    let mut lanes = Vec::new();
    let [wo, wi, n] = [(wo, 0), (wi, 3), (n, 6)].map(|(v, lane)| seeded(v.to_array(), lane).into());
    let value = value_over(bsdf, wo, wi, n, &mut |property, value| {
        let lane = 9 + 3 * lanes.len();
        lanes.push((property, lane));
        seeded(value.to_array(), lane).into()
    });
    (value, lanes)
}

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

#[test]
fn gradients_equal_those_of_dual_numbers() {
    for_each_configuration(500, |bsdf, wo, wi| {
        if matches!(bsdf, Bsdf::TwoSided(_)) {
            return;
        }
        let g = bsdf.gradient(wo, wi, normal());
        let (value, lanes) = by_duals(bsdf, wo, wi, normal());
        let channels = [
            (value.r, g.value.r, g.wo.r, g.wi.r, g.n.r),
            (value.g, g.value.g, g.wo.g, g.wi.g, g.n.g),
            (value.b, g.value.b, g.wo.b, g.wi.b, g.n.b),
        ];
        for (channel, (dual, value, by_wo, by_wi, by_n)) in channels.into_iter().enumerate() {
            assert!((dual.re - value).abs() <= 1e-12 * value);
            let largest = dual.eps[..9].iter().fold(0.0, |m: f64, e| m.max(e.abs()));
            for (i, vector) in [by_wo, by_wi, by_n].into_iter().enumerate() {
                for (j, slope) in vector.to_array().into_iter().enumerate() {
                    let error = (slope - dual.eps[3 * i + j]).abs();
                    assert!(error <= rounding(bsdf) * largest, "{bsdf:?} {wo:?} {wi:?}: {error:e}");
                }
            }
            for &(property, lane) in &lanes {
                // A channel depends on its own lane of a colour, on the first of a number.
                let expected: f64 = dual.eps[lane..lane + 3].iter().sum();
                let slope = g.params.get(property).to_array()[channel];
                let error = (slope - expected).abs();
                assert!(
                    error <= rounding(bsdf) * (expected.abs() + value),
                    "{bsdf:?} {property}: {slope} {expected}"
                );
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
