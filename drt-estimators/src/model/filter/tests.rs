use alloc::vec::Vec;

use drt_math::testing::{SIGNIFICANCE, rectangle_chi_square, z_score};
use drt_math::{Dual, Moments, Real, Rng};

use crate::model::filter::{Filter, FilterError, FilterKind};

const KINDS: [FilterKind; 11] = [
    FilterKind::BOX,
    FilterKind::Box { radius: 1.25 },
    FilterKind::TENT,
    FilterKind::Tent { radius: 2.5 },
    FilterKind::GAUSSIAN,
    FilterKind::Gaussian { radius: 1.0, std_dev: 0.8 },
    FilterKind::Gaussian { radius: 6.0, std_dev: 0.3 },
    FilterKind::MITCHELL,
    FilterKind::CATMULL_ROM,
    FilterKind::LANCZOS,
    FilterKind::Lanczos { lobes: 1 },
];

fn filters() -> impl Iterator<Item = Filter> {
    KINDS.into_iter().map(|kind| Filter::new(kind).unwrap())
}

/// Simpson's rule on one side of the kink.
fn half_integral(f: impl Fn(f64) -> f64, radius: f64) -> f64 {
    let n = 4000;
    let h = radius / f64::from(n);
    let weight = |i: i32| if i == 0 || i == n { 1.0 } else { 2.0 + 2.0 * f64::from(i % 2) };
    // The support is half open.
    let at = |i: i32| f(f64::min(f64::from(i) * h, radius * (1.0 - 1e-15)));
    (0..=n).map(|i| weight(i) * at(i)).sum::<f64>() * h / 3.0
}

/// The definition, written down once more for any scalar and normalised by quadrature.
fn definition<T: Real>(kind: FilterKind, x: T) -> T {
    match kind {
        FilterKind::Box { .. } => T::one(),
        FilterKind::Tent { radius } => T::one() - x.abs() / radius,
        FilterKind::Gaussian { radius, std_dev } => {
            let bell = |x: T| (x.squared() * (-0.5 / (std_dev * std_dev))).exp();
            bell(x) - bell(T::from(radius))
        }
        // By their values and slopes at 0, 1 and 2, from both sides (Hermite's cubics).
        FilterKind::Mitchell { b, c } => {
            let (middle, slope) = (b / 6.0, -0.5 * b - c);
            let peak = (3.0 - b) / 3.0;
            let hermite = |t: T, from: f64, to: f64, by: f64, at: f64| {
                let (t2, rest) = (t.squared(), T::one() - t);
                let rise = t2 * (T::from(3.0) - t * 2.0);
                (T::one() - rise) * from + rise * to + t * rest * (rest * by - t * at)
            };
            let x = x.abs();
            if x.re() < 1.0 {
                hermite(x, peak, middle, 0.0, slope)
            } else {
                hermite(x - T::one(), middle, 0.0, slope, 0.0)
            }
        }
        FilterKind::Lanczos { lobes } => {
            let sinc = |x: T| if x.re() == 0.0 { T::one() } else { x.sin() / x };
            sinc(x * core::f64::consts::PI) * sinc(x * (core::f64::consts::PI / f64::from(lobes)))
        }
    }
}

#[test]
fn filters_integrate_to_one() {
    for f in filters() {
        let integral = 2.0 * half_integral(|x| f.axis(x), f.radius());
        assert!((integral - 1.0).abs() < 1e-11, "{:?}: {integral}", f.kind());
    }
}

#[test]
fn values_and_gradients_follow_the_definition() {
    let mut rng = Rng::new(1, 0, 0);
    for f in filters() {
        let kind = f.kind();
        let r = f.radius();
        let norm = 2.0 * half_integral(|x| definition(kind, x), r);
        for _ in 0..200 {
            let [x, y] = rng.next_2d().map(|u| r * (2.0 * u - 1.0));
            let [dx, dy] = [Dual::<f64, 2>::variable(x, 0), Dual::variable(y, 1)];
            let p = definition(kind, dx) * definition(kind, dy) / (norm * norm);
            let peak = f.eval(0.0, 0.0);
            assert!((f.eval(x, y) - p.re).abs() < 1e-11 * peak);
            for (mine, dual) in f.gradient(x, y).iter().zip(p.eps) {
                assert!(
                    (mine - dual).abs() < 1e-10 * (peak + dual.abs()),
                    "{kind:?} {mine} {dual}"
                );
            }
        }
        for outside in [[r, 0.0], [0.0, -1.001 * r], [f64::NAN, 0.0], [f64::INFINITY, 0.0]] {
            assert_eq!(f.eval(outside[0], outside[1]), 0.0);
        }
    }
}

#[test]
fn points_on_a_border_count_half_for_either_pixel() {
    let f = Filter::new(FilterKind::BOX).unwrap();
    for at in [5.0, 5.0 + 1e-12, 5.0 - 1e-12] {
        let reached = f.reached(at, 9);
        assert_eq!(reached, 4..6);
        let row: Vec<f64> = f.row(at, 4).take(2).map(|(p, _)| p).collect();
        assert_eq!(row, [0.5, 0.5]);
    }
    assert_eq!(f.reached(5.0 + 1e-6, 9), 5..6);
    assert_eq!(f.row(5.0 + 1e-6, 5).next().unwrap().0, 1.0);
}

#[test]
fn rows_are_the_factors_of_one_pixel_after_another() {
    let mut rng = Rng::new(7, 0, 0);
    let wide = FilterKind::Gaussian { radius: 256.0, std_dev: 60.0 };
    for f in filters().chain([Filter::new(wide).unwrap()]) {
        for _ in 0..20 {
            let at = 300.0 + rng.next_f64();
            let reached = f.reached(at, 600);
            let peak = f.axis_with_slope(0.0).0;
            for (i, (p, slope)) in reached.clone().zip(f.row(at, reached.start)) {
                let (p0, slope0) = f.axis_with_slope(at - (f64::from(i) + 0.5));
                assert!((p - p0).abs() < 1e-11 * peak, "{:?} {p} {p0}", f.kind());
                assert!((slope - slope0).abs() < 1e-11 * (peak / f.radius() + slope0.abs()));
            }
        }
    }
}

#[test]
fn only_the_box_jumps_at_its_edge() {
    for f in filters() {
        let edge = f.axis(f.radius() * (1.0 - 1e-9)) / f.axis(0.0);
        assert_eq!(f.is_continuous(), edge < 1e-6);
    }
}

/// Values of `rfilter.eval` in Mitsuba 3.9.1; its Gaussian is a polynomial good to 4·10⁻⁴.
#[test]
fn profiles_are_those_of_mitsuba() {
    let ratio = |kind, x: f64| {
        let f = Filter::new(kind).unwrap();
        f.axis(x) / f.axis(0.0)
    };
    for (x, value) in [(0.25, 0.75), (0.49, 0.51), (1.0, 0.0)] {
        assert!((ratio(FilterKind::TENT, x) - value).abs() < 1e-12);
    }
    assert!((ratio(FilterKind::Tent { radius: 2.0 }, 0.5) - 0.75).abs() < 1e-12);
    for (x, value) in [(0.25, 0.882167), (0.5, 0.606423), (1.0, 0.13496), (1.5, 0.010758)] {
        assert!((ratio(FilterKind::GAUSSIAN, x) - value).abs() < 1e-3);
    }
    for (x, value) in [(0.5, 0.774714), (1.0, 0.360077), (2.0, 0.016533)] {
        assert!((ratio(FilterKind::gaussian(0.7), x) - value).abs() < 1e-3);
    }
    assert_eq!(Filter::new(FilterKind::gaussian(0.7)).unwrap().radius(), 4.0 * 0.7);
    let at = [0.25, 0.5, 1.25, 1.75];
    for (kind, values) in [
        (FilterKind::MITCHELL, [0.879883, 0.601563, -0.026367, -0.016601]),
        (FilterKind::Mitchell { b: 0.2, c: 0.3 }, [0.86942, 0.571429, -0.030134, -0.014509]),
        (FilterKind::CATMULL_ROM, [0.867188, 0.5625, -0.070312, -0.023438]),
        (FilterKind::LANCZOS, [0.890067, 0.607927, -0.132871, -0.067791]),
        (FilterKind::Lanczos { lobes: 2 }, [0.877354, 0.573159, -0.084725, -0.017905]),
    ] {
        for (x, value) in at.into_iter().zip(values) {
            assert!((ratio(kind, x) - value).abs() < 1e-6, "{kind:?} {x}");
        }
    }
}

#[test]
fn samples_follow_their_density() {
    let mut rng = Rng::new(2, 0, 0);
    for f in filters() {
        for derivative in [false, true] {
            let points: Vec<[f64; 2]> =
                (0..60_000).map(|_| f.sample(rng.next_2d(), derivative).offset).collect();
            let r = f.radius();
            let p_value = |mixed: bool| {
                let points = points.iter().copied();
                rectangle_chi_square(points, [-r; 2], [r; 2], |x| f.pdf(x, mixed))
            };
            assert!(p_value(derivative) > SIGNIFICANCE, "{:?}", f.kind());
            // The density of the other mixture is a fault, where the two differ.
            if matches!(f.kind(), FilterKind::Tent { .. } | FilterKind::Gaussian { .. }) {
                assert!(p_value(!derivative) < SIGNIFICANCE, "{:?}", f.kind());
            }
        }
    }
}

#[test]
fn weights_are_filter_over_density() {
    let mut rng = Rng::new(3, 0, 0);
    for f in filters() {
        for derivative in [false, true] {
            for _ in 0..2000 {
                let s = f.sample(rng.next_2d(), derivative);
                let [x, y] = s.offset;
                assert!(s.pdf > 0.0 && s.weight.is_finite());
                assert!((s.weight * s.pdf - f.eval(x, y)).abs() <= 1e-14 * f.eval(x, y).abs());
                assert_eq!(s.pdf, f.pdf(s.offset, derivative));
                // A quarter of each axis' samples goes elsewhere at most; of signed ones, to negative parts too.
                let most = if derivative { 16.0 / 9.0 } else { 1.0 };
                let most = if f.kind().signed(0.0).is_some() { 3.0 } else { most };
                assert!(s.weight.abs() < 1.03 * most, "{:?} {s:?}", f.kind());
            }
        }
    }
    for kind in [FilterKind::BOX, FilterKind::TENT] {
        let f = Filter::new(kind).unwrap();
        for _ in 0..100 {
            assert!((f.sample(rng.next_2d(), false).weight - 1.0).abs() < 1e-13);
        }
    }
    let f = Filter::new(FilterKind::GAUSSIAN).unwrap();
    let weights: Moments = (0..20_000).map(|_| f.sample(rng.next_2d(), false).weight).collect();
    assert!(z_score(&weights, 1.0).abs() < 4.0, "{weights:?}");
    assert!(weights.variance() < 1e-5, "{weights:?}");
}

/// By parts, the integral of x dP/dx is -1; and the second moment of (dP/dx)/pdf, infinite for
/// samples in proportion to a tent, is 8/3 ln 7 (x axis) times 1.0331 (y axis).
#[test]
fn derivative_samples_estimate_gradients_with_finite_variance() {
    let mut rng = Rng::new(4, 0, 0);
    for f in filters().filter(Filter::is_continuous) {
        let (mut parts, mut second) = (Moments::ZERO, Moments::ZERO);
        let n = if f.kind() == FilterKind::LANCZOS { 400_000 } else { 100_000 };
        for _ in 0..n {
            let s = f.sample(rng.next_2d(), true);
            let g = f.gradient(s.offset[0], s.offset[1])[0] / s.pdf;
            parts.push(s.offset[0] * g);
            second.push(g * g);
        }
        assert!(z_score(&parts, -1.0).abs() < 4.0, "{:?} {parts:?}", f.kind());
        assert!(parts.standard_error() < 0.01, "{:?} {parts:?}", f.kind());
        // A flipped gradient is a fault.
        assert!(z_score(&parts, 1.0).abs() > 4.0);
        if f.kind() == FilterKind::TENT {
            let y = 8.0 / 3.0 * (1.0 / 3.0 + 7.0_f64.ln() / 36.0);
            let expected = 8.0 / 3.0 * 7.0_f64.ln() * y;
            assert!(z_score(&second, expected).abs() < 4.0, "{second:?} {expected}");
        }
    }
}

#[test]
fn mirrored_numbers_give_mirrored_offsets() {
    let mut rng = Rng::new(5, 0, 0);
    for f in filters() {
        for derivative in [false, true] {
            let u = rng.next_2d();
            let a = f.sample(u, derivative);
            let b = f.sample(u.map(|u| 1.0 - u), derivative);
            for k in 0..2 {
                assert!((a.offset[k] + b.offset[k]).abs() < 1e-12 * f.radius());
            }
            assert!((a.weight - b.weight).abs() < 1e-10);
        }
        for u in [0.0, 0.5, 1.0 - f64::EPSILON] {
            let s = f.sample([u, 0.5], true);
            assert!(s.weight.is_finite() && s.pdf > 0.0 && s.offset[0].abs() <= f.radius());
        }
    }
}

#[test]
fn unusable_filters_are_named() {
    for radius in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        for kind in [FilterKind::Box { radius }, FilterKind::Tent { radius }] {
            let error = Filter::new(kind).unwrap_err();
            assert!(matches!(error, FilterError::NotPositive { what: "radius", .. }));
        }
        let error = Filter::new(FilterKind::Gaussian { radius: 1.0, std_dev: radius }).unwrap_err();
        assert!(matches!(error, FilterError::NotPositive { what: "standard deviation", .. }));
    }
    let none = FilterKind::Lanczos { lobes: 0 };
    assert!(matches!(Filter::new(none), Err(FilterError::NotPositive { .. })));
    for (b, c) in [(3.0, 0.0), (f64::NAN, 0.0), (0.0, f64::INFINITY)] {
        assert!(matches!(
            Filter::new(FilterKind::Mitchell { b, c }),
            Err(FilterError::Spline { .. })
        ));
    }
    let wide = Filter::new(FilterKind::Tent { radius: 257.0 });
    assert_eq!(wide, Err(FilterError::TooWide { radius: 257.0 }));
    for std_dev in [0.01, 2000.0] {
        let kind = FilterKind::Gaussian { radius: 1.0, std_dev };
        assert_eq!(Filter::new(kind), Err(FilterError::Cut { radius: 1.0, std_dev }));
    }
}

/// Every pixel of a row gets its filter's integral from the samples of all, with and without derivatives, and
/// from those of the intervals.
#[test]
fn samples_of_a_row_are_shared() {
    let mut rng = Rng::new(6, 0, 0);
    for f in filters() {
        for n in [1, 2, 7] {
            for how in [None, Some(false), Some(true)] {
                let mut sums = alloc::vec![Moments::ZERO; n as usize];
                let mut planted = sums.clone();
                for _ in 0..4000 {
                    let mut values = alloc::vec![[0.0; 2]; n as usize];
                    for i in 0..n {
                        let u = rng.next_f64();
                        let (at, pdf) = match how {
                            None => f.sample_interval(i, n, u),
                            Some(derivative) => {
                                let at =
                                    f64::from(i) + 0.5 + f.sample([u, 0.5], derivative).offset[0];
                                let pixels = f.reached(at, n);
                                (at, f.weights(at, pixels, how, &mut Vec::new()))
                            }
                        };
                        for (j, v) in (0..).zip(&mut values) {
                            let offset = at - (f64::from(j) + 0.5);
                            v[0] += f.axis(offset) / pdf;
                            // As if nothing were beyond the row.
                            v[1] += if at < 0.0 { 0.0 } else { f.axis(offset) / pdf };
                        }
                    }
                    for (j, v) in values.iter().enumerate() {
                        sums[j].push(v[0]);
                        planted[j].push(v[1]);
                    }
                }
                let wide = f.radius() > 0.5;
                for sum in &sums {
                    // A box's samples of its own have no noise.
                    let error = f64::max(sum.standard_error(), 1e-12);
                    assert!((sum.mean() - 1.0).abs() < 4.2 * error, "{:?} {sum:?}", f.kind());
                    assert!(error < 0.05, "{:?} {sum:?}", f.kind());
                }
                assert!(!wide || z_score(&planted[0], 1.0).abs() > 4.2, "{:?}", f.kind());
            }
        }
    }
}
