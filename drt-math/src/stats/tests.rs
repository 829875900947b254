use alloc::vec::Vec;

use proptest::prelude::*;

use super::*;
use crate::Rng;
use crate::testing::z_score;

#[test]
fn compensated_sum_does_not_drift() {
    let mut sum = CompensatedSum::ZERO;
    sum += 1e6;
    let mut naive = 1e6;
    for _ in 0..10_000_000 {
        sum += 0.1;
        naive += 0.1;
    }
    let exact = 1e6 + 1e7 * 0.1; // 0.1 is 5.6e-18 too large: 5.6e-11 in all, below the last digit
    assert_eq!(sum.value(), exact);
    let drift: f64 = naive - exact;
    assert!(drift.abs() > 1e-6, "the plain sum is off by {drift}, so this test tells them apart");
}

#[test]
fn compensated_sums_merge_and_overflow() {
    let terms = [1e16, 1.0, -1e16, 1.0, 3.0];
    let whole: CompensatedSum = terms.into_iter().collect();
    assert_eq!(whole.value(), 5.0);
    for cut in 0..terms.len() {
        let mut left: CompensatedSum = terms[..cut].iter().copied().collect();
        left += terms[cut..].iter().copied().collect::<CompensatedSum>();
        assert_eq!(left.value(), 5.0, "cut at {cut}");
    }
    let over: CompensatedSum = [f64::MAX, f64::MAX].into_iter().collect();
    assert_eq!(over.value(), f64::INFINITY);
    assert!([1.0, f64::NAN].into_iter().collect::<CompensatedSum>().value().is_nan());
}

#[test]
fn moments_do_not_drift_on_a_large_offset() {
    // 1e6 + 0.1 and 1e6 - 0.1 in turn: mean 1e6 and variance 0.01, up to how well the numbers
    // themselves can be written at this offset.
    let (high, low) = (1e6 + 0.1, 1e6 - 0.1);
    let half = 0.5 * (high - low);
    let mut moments = Moments::ZERO;
    let mut squares = 0.0;
    for i in 0..10_000_000 {
        let x = if i % 2 == 0 { high } else { low };
        moments.push(x);
        squares += x * x;
    }
    let n = 1e7;
    assert!((moments.mean() - 1e6).abs() < 1e-8, "{moments:?}");
    let variance = half * half * n / (n - 1.0);
    assert!((moments.variance() / variance - 1.0).abs() < 1e-6, "{moments:?}");
    assert!((moments.standard_error() - fm::sqrt(variance / n)).abs() < 1e-10);
    let textbook = squares / n - 1e12;
    assert!((textbook / variance - 1.0).abs() > 0.01, "{textbook} shows what is avoided");

    let mut constant = Moments::ZERO;
    constant.extend((0..10_000_000).map(|_| high));
    assert_eq!((constant.mean(), constant.variance()), (high, 0.0));
}

#[test]
fn a_billion_samples_merge_without_loss() {
    let mut rng = Rng::new(5, 0, 0);
    let chunk: Moments = (0..1_000_000).map(|_| 1e4 + rng.next_f64()).collect();
    let mut all = Moments::ZERO;
    for _ in 0..1000 {
        all.merge(&chunk);
    }
    assert_eq!(all.count(), 1_000_000_000);
    assert!((all.mean() / chunk.mean() - 1.0).abs() < 1e-13);
    let m2 = |m: &Moments| m.variance() * (m.count() - 1) as f64;
    assert!((m2(&all) / (1000.0 * m2(&chunk)) - 1.0).abs() < 1e-12);
    assert!(z_score(&chunk, 1e4 + 0.5).abs() < 4.0);
    assert!((chunk.variance() * 12.0 - 1.0).abs() < 4.0 * 0.9 / 1000.0);
}

#[test]
fn few_numbers_say_little() {
    let mut m = Moments::ZERO;
    assert_eq!((m.mean(), m.variance()), (0.0, f64::INFINITY));
    m.push(3.0);
    assert_eq!((m.mean(), m.variance(), m.standard_error()), (3.0, f64::INFINITY, f64::INFINITY));
    m.push(5.0);
    assert_eq!((m.mean(), m.variance(), m.standard_error()), (4.0, 2.0, 1.0));
    m.push(f64::NAN);
    assert!(m.mean().is_nan() && m.variance().is_nan());
    assert_eq!(Moments::repeated(f64::NAN, 0), Moments::ZERO);
}

fn direct(numbers: &[f64]) -> (f64, f64) {
    let n = numbers.len() as f64;
    let mean = numbers.iter().copied().collect::<CompensatedSum>().value() / n;
    let m2 = numbers.iter().map(|x| (x - mean) * (x - mean)).collect::<CompensatedSum>().value();
    (mean, m2 / (n - 1.0))
}

proptest! {
    #![proptest_config(crate::fixed_cases())]

    #[test]
    fn merging_in_any_order_equals_pushing(
        numbers in prop::collection::vec(-1e3..1e3_f64, 2..60),
        cuts in prop::array::uniform2(0.0..1.0_f64),
        zeros in 0..50_usize,
    ) {
        let at = |c: f64| (c * numbers.len() as f64) as usize;
        let (i, j) = (at(cuts[0].min(cuts[1])), at(cuts[0].max(cuts[1])));
        let parts = [&numbers[..i], &numbers[i..j], &numbers[j..]]
            .map(|p| p.iter().copied().collect::<Moments>());
        let padding = Moments::repeated(0.0, zeros as u64);
        let mut left = parts[0];
        for other in [parts[1], parts[2], padding] {
            left.merge(&other);
        }
        let mut right = padding;
        let mut tail = parts[2];
        tail.merge(&parts[1]);
        right.merge(&tail);
        right.merge(&parts[0]);
        let padded: Vec<f64> = numbers.iter().copied().chain((0..zeros).map(|_| 0.0)).collect();
        let (mean, variance) = direct(&padded);
        for m in [left, right] {
            prop_assert_eq!(m.count(), padded.len() as u64);
            prop_assert!((m.mean() - mean).abs() < 1e-12 * 1e3);
            prop_assert!((m.variance() - variance).abs() <= 1e-12 * 1e6);
        }
    }
}

#[test]
fn colours_are_three_streams() {
    let mut rng = Rng::new(8, 0, 0);
    let mut all = RgbMoments::ZERO;
    let mut parts = [RgbMoments::ZERO; 2];
    let mut green = Moments::ZERO;
    for i in 0..1000 {
        let c = Rgb::new(rng.next_f64(), 10.0 + rng.next_f64(), -2.0);
        all.push(c);
        parts[i % 2].push(c);
        green.push(c.g);
    }
    assert_eq!(all.channels()[1], green);
    assert_eq!((all.mean().b, all.variance().b), (-2.0, 0.0));
    let [mut merged, odd] = parts;
    merged.merge(&odd);
    assert_eq!(merged.count(), all.count());
    assert!((merged.mean() - all.mean()).max_abs() < 1e-13);
    assert!((merged.standard_error() - all.standard_error()).max_abs() < 1e-13);
    let error = all.variance_of_mean() - all.standard_error() * all.standard_error();
    assert!(error.max_abs() < 1e-18);
    all.merge(&RgbMoments::repeated(Rgb::ZERO, 1000));
    assert!((all.mean().g - 0.5 * green.mean()).abs() < 1e-14);
}

#[cfg(feature = "serde")]
#[test]
fn accumulators_can_be_stored() {
    let m: Moments = [0.1, 0.7, 0.3].into_iter().collect();
    let back: Moments = serde_json::from_str(&serde_json::to_string(&m).unwrap()).unwrap();
    assert_eq!(back, m);
}
