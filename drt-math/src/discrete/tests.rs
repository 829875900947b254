use alloc::vec::Vec;

use proptest::prelude::*;

use super::*;
use crate::testing::{SIGNIFICANCE, chi_square, interval_chi_square};
use crate::{Rng, fm};

/// Both tables behind one face.
struct Table {
    sample: alloc::boxed::Box<dyn Fn(f64) -> DiscreteSample>,
    pmf: Vec<f64>,
}

fn tables(weights: &[f64]) -> [Table; 2] {
    let alias = AliasTable::new(weights).unwrap();
    let cdf = CdfTable::new(weights).unwrap();
    assert_eq!((alias.len(), cdf.len()), (weights.len(), weights.len()));
    assert_eq!((alias.pmf(weights.len()), cdf.pmf(weights.len())), (0.0, 0.0));
    let pmf = |f: &dyn Fn(usize) -> f64| (0..weights.len()).map(f).collect();
    [
        Table {
            pmf: pmf(&|i| alias.pmf(i)),
            sample: alloc::boxed::Box::new(move |u| alias.sample(u)),
        },
        Table { pmf: pmf(&|i| cdf.pmf(i)), sample: alloc::boxed::Box::new(move |u| cdf.sample(u)) },
    ]
}

#[test]
fn indices_and_residuals_follow_their_laws() {
    const N: u32 = 300_000;
    let weights = [0.0, 3.0, 1.0, 0.0, 7.5, 0.25, 2.0, 2.0, 0.0];
    let total: f64 = weights.iter().sum();
    for table in tables(&weights) {
        let mut rng = Rng::new(3, 0, 0);
        let samples: Vec<_> = (0..N).map(|_| (table.sample)(rng.next_f64())).collect();
        let mut counts = [0; 9];
        for s in &samples {
            counts[s.index] += 1;
            assert_eq!(s.pmf, table.pmf[s.index]);
        }
        let expected =
            |w: &[f64]| -> Vec<f64> { w.iter().map(|w| w / total * f64::from(N)).collect() };
        let p = chi_square(&counts, &expected(&weights));
        assert!(p > SIGNIFICANCE, "{p}");
        let mut wrong = weights;
        wrong[1] += 0.1;
        wrong[4] -= 0.1;
        let p = chi_square(&counts, &expected(&wrong));
        assert!(p < SIGNIFICANCE, "{p}");
        for index in [1, 4, 5] {
            let residuals = samples.iter().filter(|s| s.index == index).map(|s| s.residual);
            let p = interval_chi_square(residuals, [0.0, 1.0], |_| 1.0);
            assert!(p > SIGNIFICANCE, "{index}: {p}");
        }
    }
}

#[test]
fn cdf_is_monotone_and_its_residual_continues() {
    let [_, table] = tables(&[2.0, 0.0, 1.0, 1.0]);
    let mut before = (0, 0.0);
    for i in 0..1000 {
        let s = (table.sample)(f64::from(i) / 1000.0);
        assert!((s.index, s.residual) >= before);
        before = (s.index, s.residual);
    }
    // u is recovered as cdf + residual * pmf.
    assert_eq!((table.sample)(0.625), DiscreteSample { index: 2, pmf: 0.25, residual: 0.5 });
}

proptest! {
    #![proptest_config(crate::fixed_cases())]

    #[test]
    fn tables_hold_the_weights_exactly(
        weights in prop::collection::vec(prop_oneof![Just(0.0), 1e-12..1.0_f64, 1.0..1e6_f64], 1..50),
        scale in prop_oneof![Just(1.0), Just(1e300), Just(1e-310)],
    ) {
        prop_assume!(weights.iter().any(|&w| w * scale > 1e-311));
        let scaled: Vec<f64> = weights.iter().map(|w| w * scale).collect();
        let sum: f64 = scaled.iter().map(|w| w / scale).sum();
        for table in tables(&scaled) {
            for (w, p) in scaled.iter().zip(&table.pmf) {
                prop_assert!((p - w / scale / sum).abs() < 1e-14);
                prop_assert!(*w > 0.0 || *p == 0.0);
            }
            for u in [0.0, 1e-17, 0.5, BELOW_ONE, 1.0] {
                let s = (table.sample)(u);
                prop_assert!(s.pmf > 0.0 && (0.0..1.0).contains(&s.residual), "{} {:?}", u, s);
            }
        }
        // What the bins of the alias table give each index in all.
        let alias = AliasTable::new(&scaled).unwrap();
        let mut shares = alloc::vec![0.0; scaled.len()];
        for (i, bin) in alias.bins.iter().enumerate() {
            shares[i] += bin.own;
            shares[bin.alias as usize] += 1.0 - bin.own;
        }
        for (share, bin) in shares.iter().zip(&alias.bins) {
            prop_assert!((share / scaled.len() as f64 - bin.pmf).abs() < 1e-14);
            prop_assert!(bin.pmf > 0.0 || *share == 0.0);
        }
    }
}

#[test]
fn bad_weights_are_named() {
    let error = |w: &[f64]| {
        let e = AliasTable::new(w).unwrap_err();
        assert_eq!(alloc::format!("{e:?}"), alloc::format!("{:?}", CdfTable::new(w).unwrap_err()));
        e
    };
    assert_eq!(error(&[]), WeightsError::Empty);
    assert_eq!(error(&[0.0, -0.0]), WeightsError::AllZero);
    assert_eq!(error(&[1.0, -2.0]), WeightsError::Negative { index: 1, value: -2.0 });
    assert!(matches!(error(&[1.0, 0.0, f64::NAN]), WeightsError::NotFinite { index: 2, .. }));
    assert!(matches!(error(&[f64::INFINITY]), WeightsError::NotFinite { index: 0, .. }));
    let text = alloc::format!("{}", error(&[1.0, -2.0]));
    assert!(text.contains("weight 1 is -2"), "{text}");
}

#[test]
fn many_small_weights_keep_their_sum() {
    let weights: Vec<f64> = (0..200_000).map(|i| fm::exp(-1e-4 * f64::from(i))).collect();
    let table = CdfTable::new(&weights).unwrap();
    assert_eq!(table.sample(BELOW_ONE).index, weights.len() - 1);
    let ratio = table.pmf(100_000) / table.pmf(0);
    assert!((ratio / fm::exp(-10.0) - 1.0).abs() < 1e-6);
}

#[cfg(feature = "serde")]
#[test]
fn stored_tables_come_back_checked() {
    let weights = [0.1, 0.0, 0.7, 1.3];
    let cdf = CdfTable::new(&weights).unwrap();
    let text = serde_json::to_string(&cdf).unwrap();
    let back: CdfTable = serde_json::from_str(&text).unwrap();
    // serde_json reads floats to the last digit but one.
    assert!((0..4).all(|i| (back.pmf(i) - cdf.pmf(i)).abs() < 1e-15));
    let alias = AliasTable::new(&weights).unwrap();
    let text = serde_json::to_string(&alias).unwrap();
    let back: AliasTable = serde_json::from_str(&text).unwrap();
    assert!((0..4).all(|i| (back.pmf(i) - alias.pmf(i)).abs() < 1e-15));
    for bad in ["[]", "[0.0]", "[0.0,0.7,0.5,1.0]", "[0.0,0.5]", "[0.1,1.0]", "[0.0,2.0,1.0]"] {
        assert!(serde_json::from_str::<CdfTable>(bad).is_err(), "{bad}");
    }
    assert!(serde_json::from_str::<AliasTable>("[0.5,-0.5]").is_err());
}
