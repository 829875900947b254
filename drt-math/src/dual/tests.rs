use proptest::prelude::*;

use super::*;
use crate::fm;

type D1 = Dual<f64, 1>;
type D2 = Dual<D1, 1>;

/// Value, first and second derivative by nested duals.
fn jet(f: impl Fn(D2) -> D2, x: f64) -> [f64; 3] {
    let y = f(D2::new(D1::variable(x, 0), [D1::one()]));
    assert_eq!(y.re.eps, [y.eps[0].re], "both levels carry the first derivative");
    [y.re.re, y.re.eps[0], y.eps[0].eps[0]]
}

fn close(a: f64, b: f64, tolerance: f64) -> bool {
    (a - b).abs() <= tolerance * (1.0 + b.abs())
}

#[test]
fn functions_match_their_closed_derivatives() {
    type Case = (fn(D2) -> D2, fn(f64) -> [f64; 3]);
    let cases: [Case; 13] = [
        (D2::sqrt, |x| [fm::sqrt(x), 0.5 / fm::sqrt(x), -0.25 / (x * fm::sqrt(x))]),
        (D2::recip, |x| [1.0 / x, -1.0 / (x * x), 2.0 / (x * x * x)]),
        (
            |x| (x * 3.0 - 1.0) / (x + 2.0),
            |x| {
                let d = 1.0 / (x + 2.0);
                [(3.0 * x - 1.0) * d, 7.0 * d * d, -14.0 * d * d * d]
            },
        ),
        (D2::exp, |x| [fm::exp(x); 3]),
        (D2::exp_m1, |x| [fm::exp_m1(x), fm::exp(x), fm::exp(x)]),
        (D2::ln, |x| [fm::ln(x), 1.0 / x, -1.0 / (x * x)]),
        (D2::ln_1p, |x| [fm::ln_1p(x), 1.0 / (1.0 + x), -1.0 / ((1.0 + x) * (1.0 + x))]),
        (D2::sin, |x| [fm::sin(x), fm::cos(x), -fm::sin(x)]),
        (D2::cos, |x| [fm::cos(x), -fm::sin(x), -fm::cos(x)]),
        (D2::atan, |x| {
            let d = 1.0 / (1.0 + x * x);
            [fm::atan(x), d, -2.0 * x * d * d]
        }),
        (D2::acos, |x| {
            let r = 1.0 / fm::sqrt(1.0 - x * x);
            [fm::acos(x), -r, -x * r * r * r]
        }),
        (|x| x.powf(2.5), |x| [fm::powf(x, 2.5), 2.5 * fm::powf(x, 1.5), 3.75 * fm::sqrt(x)]),
        (|x| x.powi(-3), |x| [x.powi(-3), -3.0 * x.powi(-4), 12.0 * x.powi(-5)]),
    ];
    for (i, (dual, closed)) in cases.into_iter().enumerate() {
        for x in [0.03, 0.4, 0.77, 0.95] {
            for (a, b) in jet(dual, x).into_iter().zip(closed(x)) {
                assert!(close(a, b, 1e-12), "case {i} at {x}: {a} against {b}");
            }
        }
    }
}

/// A smooth function of three variables that meets every smooth function of `Real`.
fn tangle<T: Real>([x, y, z]: [T; 3]) -> T {
    let a = (x * y - z).exp() / (x.squared() + y.powi(4) + 1.0);
    let b = (a + 2.0).sqrt() * z.sin() - (y * 0.5).cos();
    let c = (x * x + 1.5).ln() * b.atan() + (z * z + 0.5).powf(0.3);
    let d = (b * 0.2).exp_m1() + (c * c).ln_1p() - (z.sin() * 0.9).acos();
    ((d / (a + 3.0) - c * 0.25).squared() + 0.5).recip()
}

proptest! {
    #![proptest_config(crate::fixed_cases())]

    #[test]
    fn gradients_match_finite_differences(x in -1.5..1.5_f64, y in -1.5..1.5_f64, z in -1.5..1.5_f64) {
        let at = [x, y, z];
        let dual = tangle::<Dual<f64, 3>>(from_fn(|i| Dual::variable(at[i], i)));
        prop_assert_eq!(dual.re, tangle(at));
        for (i, slope) in dual.eps.into_iter().enumerate() {
            let along = |h: f64| tangle::<f64>(from_fn(|j| if j == i { at[j] + h } else { at[j] }));
            let central = |h: f64| (along(h) - along(-h)) / (2.0 * h);
            let difference = (4.0 * central(1e-3) - central(2e-3)) / 3.0;
            prop_assert!(close(slope, difference, 1e-8), "{}: {} against {}", i, slope, difference);
        }
    }

    #[test]
    fn nesting_gives_symmetric_second_derivatives(x in 0.1..1.4_f64, y in -1.4..1.4_f64) {
        type H = Dual<Dual<f64, 2>, 2>;
        let variable = |v: f64, i: usize| H::variable(Dual::variable(v, i), i);
        let f = |x: H, y: H| (x * y).sin() * (x + 2.0).ln() / (y * y + 1.0).sqrt();
        let h = f(variable(x, 0), variable(y, 1));
        prop_assert!(close(h.eps[0].eps[1], h.eps[1].eps[0], 1e-14));
        for i in 0..2 {
            prop_assert!(close(h.eps[i].re, h.re.eps[i], 1e-14));
        }
    }
}

#[test]
fn what_does_not_move_has_no_derivative_even_where_slopes_are_infinite() {
    let still = D1::from(0.0);
    assert_eq!(still.sqrt().eps, [0.0]);
    assert_eq!(still.powf(0.5).eps, [0.0]);
    assert_eq!(still.ln().eps, [0.0]);
    assert_eq!(D1::from(1.0).acos().eps, [0.0]);
    assert_eq!(D1::variable(0.0, 0).sqrt().eps, [f64::INFINITY]);
    assert_eq!(D1::variable(0.0, 0).powi(0).eps, [0.0]);
    assert_eq!(D1::variable(0.0, 0).powf(0.0).eps, [0.0]);
    assert_eq!(D1::variable(0.0, 0).powi(1).eps, [1.0]);
    // A constant at one level may move at the next.
    let outer = D2::new(D1::from(0.0), [D1::from(0.0)]);
    assert_eq!(outer.sqrt().eps[0].eps, [0.0]);
    assert!(outer.is_zero() && !D2::new(D1::from(0.0), [D1::variable(0.0, 0)]).is_zero());
}

#[test]
fn comparisons_see_values_only() {
    let (a, b) = (Dual::<f64, 2>::variable(1.0, 0), Dual::<f64, 2>::variable(1.0, 1));
    assert_eq!(a, b);
    assert_eq!(a.max(b).eps, a.eps, "the first wins ties");
    assert_eq!((-a).abs().eps, a.eps);
    assert!(a < b + 1e-9 && D1::from(f64::NAN).partial_cmp(&D1::from(0.0)).is_none());
}

#[cfg(feature = "serde")]
#[test]
fn serde_keeps_every_lane() {
    let a = Dual::<f64, 40>::new(1.5, from_fn(|i| i as f64 / 3.0));
    let text = serde_json::to_string(&a).unwrap();
    let b: Dual<f64, 40> = serde_json::from_str(&text).unwrap();
    assert_eq!((a.re, a.eps), (b.re, b.eps));
    assert_eq!(serde_json::to_string(&D1::variable(2.0, 0)).unwrap(), r#"{"re":2.0,"eps":[1.0]}"#);
    let nested: D2 = serde_json::from_str(
        &serde_json::to_string(&D2::new(D1::variable(3.0, 0), [D1::one()])).unwrap(),
    )
    .unwrap();
    assert_eq!((nested.re.eps, nested.eps[0].re), ([1.0], 1.0));
    let short = serde_json::from_str::<Dual<f64, 2>>(r#"{"re":2.0,"eps":[1.0]}"#);
    assert!(alloc::format!("{}", short.unwrap_err()).contains("1 derivatives where 2 belong"));
    // Types over duals follow.
    let v: crate::Vec3<D1> = serde_json::from_str(
        &serde_json::to_string(&crate::vec3(D1::one(), D1::zero(), D1::variable(7.0, 0))).unwrap(),
    )
    .unwrap();
    assert_eq!((v.z.re, v.z.eps), (7.0, [1.0]));
}
