use alloc::vec::Vec;

use drt_math::{Rgb, Rng};

use crate::fit::loss::{Loss, Reference, inner};

const LOSSES: [Loss; 6] = [
    Loss::L2,
    Loss::L1,
    Loss::Rmse,
    Loss::PyramidL2 { levels: 1, weight: 4.0 },
    Loss::PyramidL2 { levels: 3, weight: 4.0 },
    Loss::PyramidL2 { levels: 10, weight: 8.0 },
];

fn random(size: [u32; 2], stream: u64) -> Vec<Rgb> {
    let mut rng = Rng::new(5, stream, 0);
    let mut channel = || 4.0 * rng.next_f64() - 1.0;
    (0..size[0] * size[1]).map(|_| Rgb::new(channel(), channel(), channel())).collect()
}

fn references(size: [u32; 2]) -> [Reference; 2] {
    let plain = Reference::new(size, random(size, 1)).unwrap();
    let mask = random(size, 2).iter().map(|p| p.r.max(0.0)).collect();
    [plain.clone(), plain.with_mask(mask).unwrap()]
}

#[test]
fn adjoints_are_derivatives() {
    for size in [[8, 4], [7, 5], [1, 3], [16, 16]] {
        for reference in references(size) {
            let (image, change) = (random(size, 3), random(size, 4));
            for loss in LOSSES {
                let along = |t: f64| {
                    let moved: Vec<Rgb> =
                        image.iter().zip(&change).map(|(i, c)| *i + *c * t).collect();
                    loss.value(&moved, &reference)
                };
                let h = 1e-6;
                let difference = (along(h) - along(-h)) / (2.0 * h);
                let exact = inner(&loss.adjoint(&image, &reference), &change);
                let error = (difference - exact).abs() / exact.abs();
                assert!(error < 1e-6, "{loss:?} at {size:?}: {exact} against {difference}");
            }
        }
    }
}

#[test]
fn curvatures_are_derivatives_of_adjoints() {
    for reference in references([7, 6]) {
        let (image, change) = (random([7, 6], 3), random([7, 6], 4));
        for loss in LOSSES.into_iter().filter(|l| !matches!(l, Loss::L1 | Loss::Rmse)) {
            let moved: Vec<Rgb> = image.iter().zip(&change).map(|(i, c)| *i + *c).collect();
            let [a, b] = [&moved, &image].map(|i| loss.adjoint(i, &reference));
            let value = loss.value(&image, &reference);
            for ((a, b), c) in a.iter().zip(&b).zip(loss.curvature(&change, value, &reference)) {
                assert!((*a - *b - c).max_abs() < 1e-10 * (1.0 + a.max_abs()), "{loss:?}");
            }
        }
    }
}

/// 3×2 pixels, halved to 2×1 and 1×1 by hand.
#[test]
fn odd_sides_end_in_narrower_cells() {
    let image: Vec<Rgb> = [1.0, 2.0, 7.0, 3.0, 6.0, -3.0].map(Rgb::splat).to_vec();
    let zero = Reference::new([3, 2], alloc::vec![Rgb::ZERO; 6]).unwrap();
    let level = |values: &[f64]| 3.0 * values.iter().map(|v| v * v).sum::<f64>();
    let expected =
        level(&[1.0, 2.0, 7.0, 3.0, 6.0, -3.0]) + 4.0 * level(&[3.0, 2.0]) + 16.0 * level(&[2.5]);
    let found = Loss::PyramidL2 { levels: 10, weight: 4.0 }.value(&image, &zero);
    assert!((found - expected).abs() < 1e-10, "{found} {expected}");
}

#[test]
fn a_mask_hides_what_it_is_zero_for() {
    let size = [5, 4];
    let mask: Vec<f64> = (0..20).map(|i| f64::from(i % 3)).collect();
    let reference = Reference::new(size, random(size, 1)).unwrap().with_mask(mask.clone()).unwrap();
    let image = random(size, 3);
    let hidden: Vec<Rgb> = image
        .iter()
        .zip(&mask)
        .map(|(p, m)| if *m == 0.0 { Rgb::splat(9.0) } else { *p })
        .collect();
    for loss in LOSSES {
        assert_eq!(loss.value(&image, &reference), loss.value(&hidden, &reference));
        let adjoint = loss.adjoint(&image, &reference);
        assert!(adjoint.iter().zip(&mask).all(|(a, m)| (*m == 0.0) == a.is_zero()), "{loss:?}");
    }
}

#[test]
fn reduced_images_have_the_same_mean() {
    let [_, reference] = references([12, 6]);
    let reduced = reference.reduced(3).unwrap();
    assert_eq!(reduced.size(), [4, 2]);
    let mean = |r: &Reference| {
        r.pixels().iter().fold(Rgb::ZERO, |s, p| s + *p) * (1.0 / r.pixels().len() as f64)
    };
    assert!((mean(&reference) - mean(&reduced)).max_abs() < 1e-14);
    assert!(reference.reduced(5).is_err());
}

/// Pixels of 1 and 3 with a mean of 2: differences count 2 / (1 + 1) and 2 / (3 + 1) times.
#[test]
fn dark_pixels_count_as_much_as_bright_ones() {
    let gray = |values: [f64; 2]| values.map(Rgb::splat).to_vec();
    let plain = Reference::new([2, 1], gray([1.0, 3.0])).unwrap();
    let relative = plain.clone().relative(0.5).unwrap();
    let image = gray([2.0, 7.0]);
    assert!((Loss::L2.value(&image, &relative) - 3.0 * (1.0 + 4.0)).abs() < 1e-12);
    let masked = plain.with_mask(alloc::vec![0.0, 3.0]).unwrap().relative(0.5).unwrap();
    assert!((Loss::L2.value(&image, &masked) - 3.0 * 36.0).abs() < 1e-12);
}

#[test]
fn what_cannot_be_meant_is_refused() {
    let fail = |r: Result<Reference, crate::model::error::Error>, part: &str| {
        let message = alloc::string::ToString::to_string(&r.unwrap_err());
        assert!(message.contains(part), "{message}");
    };
    let size = [2, 2];
    fail(Reference::new(size, random([3, 2], 0)), "6 pixels; expected 2x2");
    let mut pixels = random(size, 0);
    pixels[3].g = f64::NAN;
    fail(Reference::new(size, pixels), "column 1, row 1 is not finite");
    let [plain, _] = references(size);
    fail(plain.clone().with_mask(alloc::vec![0.0; 4]), "zero everywhere");
    fail(plain.clone().with_mask(alloc::vec![-1.0; 4]), "expected 0 or more");
    fail(plain.with_mask(alloc::vec![1.0; 3]), "3 pixels");
    let gray = |values: [f64; 2]| Reference::new([2, 1], values.map(Rgb::splat).to_vec()).unwrap();
    fail(gray([1.0, 2.0]).relative(0.0), "expected a positive number");
    fail(gray([1.0, -0.5]).relative(0.1), "column 1, row 0 of the target is negative");
    fail(gray([0.0, 0.0]).relative(0.1), "black target");
    assert!(Loss::PyramidL2 { levels: 0, weight: 4.0 }.check().is_err());
    assert!(Loss::PyramidL2 { levels: 3, weight: 0.0 }.check().is_err());
}
