use alloc::collections::BTreeSet;
use alloc::vec;
use alloc::vec::Vec;
use core::f64::consts::PI;

use super::directions::{DIRECTIONS, INITIAL};
use super::*;
use crate::testing::{SIGNIFICANCE, chi_square, z_score};
use crate::{Moments, Rng, fm};

/// The sequence before scrambling.
fn plain(index: u32, dimension: usize) -> u32 {
    (0..32)
        .filter(|i| index >> i & 1 == 1)
        .fold(0, |x, i| x ^ DIRECTIONS[dimension][i])
        .reverse_bits()
}

/// The least t for which the first 2^m points are a (t, m, 2)-net: counted, not computed.
fn quality(m: u32, point: impl Fn(u32) -> [u32; 2]) -> u32 {
    let even = |t: u32| {
        (0..=m - t).all(|k| {
            let mut cells = vec![0_u32; 1 << (m - t)];
            for i in 0..1 << m {
                let [x, y] = point(i).map(u64::from);
                cells[(x >> (32 - k) << (m - t - k) | y >> (32 - (m - t - k))) as usize] += 1;
            }
            cells.iter().all(|&c| c == 1 << t)
        })
    };
    (0..=m).find(|&t| even(t)).unwrap()
}

/// The 32 digits behind a sample.
fn digits(x: f64) -> u32 {
    (x * 4_294_967_296.0) as u32
}

#[test]
fn first_dimension_is_van_der_corput() {
    for i in [0, 1, 2, 3, 4, 1000, u32::MAX] {
        assert_eq!(plain(i, 0), i.reverse_bits());
    }
}

#[test]
fn polynomials_are_primitive_and_differ() {
    let distinct: BTreeSet<u32> = INITIAL.iter().map(|(p, _)| *p).collect();
    assert_eq!(distinct.len(), INITIAL.len());
    for (p, numbers) in INITIAL {
        let degree = p.ilog2();
        assert_eq!(numbers.len(), degree as usize);
        assert!(numbers.iter().zip(1..).all(|(&m, i)| m % 2 == 1 && m < 1 << i));
        let powers = core::iter::successors(Some(1_u32), |&x| {
            let x = x << 1;
            Some(if x >> degree & 1 == 1 { x ^ p } else { x })
        });
        let order = powers.skip(1).position(|x| x == 1).unwrap() + 1;
        assert_eq!(order, (1 << degree) - 1, "{p:b}");
    }
}

#[test]
fn all_dimensions_have_property_a() {
    // Row d: which of the first d + 1 index bits flip the first digit.
    for d in 1..=DIMENSIONS {
        let mut rows: Vec<u64> =
            (0..d).map(|j| (0..d).map(|i| u64::from(DIRECTIONS[j][i] & 1) << i).sum()).collect();
        for i in 0..d {
            let pivot = (i..d).find(|&r| rows[r] >> i & 1 == 1).expect("regular");
            rows.swap(i, pivot);
            for r in i + 1..d {
                if rows[r] >> i & 1 == 1 {
                    rows[r] ^= rows[i];
                }
            }
        }
    }
}

#[test]
fn scrambling_keeps_nets() {
    for m in 1..=10 {
        let t = quality(m, |i| [0, 1].map(|d| digits(sample(i, d, 99))));
        assert_eq!(t, 0, "dimensions 0 and 1 form (0, {m}, 2)-nets");
    }
    let mut scrambled = Vec::new();
    let mut raw = Vec::new();
    for pair in [[0, 2], [5, 6], [12, 30], [21, 22], [30, 31]] {
        scrambled.push(quality(9, |i| pair.map(|d| digits(sample(i, d, 3)))));
        raw.push(quality(9, |i| pair.map(|d| plain(i, d as usize))));
    }
    assert_eq!(scrambled, raw);
    assert!(raw.iter().all(|&t| t <= 4), "{raw:?}");
    // A later block, a padded set, and the check's own check: a shuffled copy across two sets.
    assert_eq!(quality(8, |i| [64, 65].map(|d| digits(sample(i + 256, d, 99)))), 0);
    assert!(quality(8, |i| [0, 33].map(|d| digits(sample(i, d, 99)))) > 0);
}

#[test]
fn every_coordinate_is_uniform_over_the_seeds() {
    for (index, dimension) in [(0, 0), (1, 0), (5, 3), (77, 31), (77, 32), (1 << 20, 100)] {
        let mut counts = [0; 64];
        let mut moments = Moments::ZERO;
        for seed in 0..64_000 {
            let x = sample(index, dimension, seed);
            counts[(64.0 * x) as usize] += 1;
            moments.push(x * x);
        }
        let p = chi_square(&counts, &[1000.0; 64]);
        assert!(p > SIGNIFICANCE, "{index} {dimension}: {p}");
        assert!(z_score(&moments, 1.0 / 3.0).abs() < 4.0, "{index} {dimension}");
    }
}

/// Digits flipped by true random bits, one per prefix.
fn owen(x: u32, seed: u32) -> u32 {
    (0..32).fold(0, |y, k| {
        let prefix = x & ((1_u64 << k) - 1) as u32;
        let flip = Rng::new(u64::from(seed), u64::from(prefix), k).next_u32() & 1;
        y | ((x >> k & 1) ^ flip) << k
    })
}

#[test]
fn scramble_flips_digits_independently_after_the_first_difference() {
    const SEEDS: u32 = 40_000;
    let flips_agree = |scramble: fn(u32, u32) -> u32, [x, y]: [u32; 2]| {
        let mut agree = [0_u32; 16];
        for i in 0..SEEDS {
            let seed = mix(i, 17);
            let differ = (scramble(x, seed) ^ x) ^ (scramble(y, seed) ^ y);
            for (k, a) in agree.iter_mut().enumerate() {
                *a += 1 - (differ >> k & 1);
            }
        }
        agree
    };
    for pair in [[0, 1], [0, 2], [1, 3], [5, 7], [12, 14], [9, 41], [170, 938]] {
        let [x, y]: [u32; 2] = pair;
        let first = (x ^ y).trailing_zeros() as usize;
        for (k, &n) in flips_agree(nested_uniform_scramble, pair).iter().enumerate() {
            if k <= first {
                assert_eq!(n, SEEDS, "same prefix, same flip: {pair:?} digit {k}");
            } else {
                let z =
                    (f64::from(n) - 0.5 * f64::from(SEEDS)) / (0.5 * fm::sqrt(f64::from(SEEDS)));
                assert!(z.abs() < 4.5, "{pair:?} digit {k}: {z}");
            }
        }
    }
    // The judge must see the known defect of a hash with no first multiplication.
    let weak = |x: u32, seed: u32| {
        let x = x.wrapping_add(seed);
        x ^ x.wrapping_mul(0x0552_6c56)
    };
    assert!(flips_agree(weak, [12, 14])[2..].iter().any(|&n| n.abs_diff(SEEDS / 2) > SEEDS / 50));
}

/// Root mean square error over the seeds, for an integral known.
fn rms(points: u32, truth: f64, integrand: impl Fn(u32, u32) -> f64) -> f64 {
    let squares: Moments = (0..64)
        .map(|seed| {
            let mean: Moments = (0..points).map(|i| integrand(i, seed)).collect();
            (mean.mean() - truth) * (mean.mean() - truth)
        })
        .collect();
    fm::sqrt(squares.mean())
}

#[test]
fn smooth_integrands_converge_as_by_true_owen_scrambling() {
    let f = |[x, y]: [f64; 2]| fm::exp(x) * (1.0 + fm::sin(PI * y));
    let truth = (core::f64::consts::E - 1.0) * (1.0 + 2.0 / PI);
    let ours = |i: u32, seed: u32| f([sample(i, 0, seed), sample(i, 1, seed)]);
    let slope = fm::ln(rms(64, truth, ours) / rms(4096, truth, ours)) / fm::ln(64.0);
    assert!(slope > 1.35, "error falls like N^-{slope}");
    let reference = |i: u32, seed: u32| {
        f([0, 1].map(|d| {
            let x = owen(plain(i, d).reverse_bits(), 2 * seed + d as u32).reverse_bits();
            (f64::from(x) + 0.5) / 4_294_967_296.0
        }))
    };
    let ratio = rms(256, truth, ours) / rms(256, truth, reference);
    assert!((0.75..1.33).contains(&ratio), "{ratio}");
    // Across sets and with the wrong seeds the points are merely random.
    let padded = |i: u32, seed: u32| f([sample(i, 0, seed), sample(i, 0, seed + 1000)]);
    let slope = fm::ln(rms(64, truth, padded) / rms(4096, truth, padded)) / fm::ln(64.0);
    assert!(slope < 0.8, "{slope}");
}

#[test]
fn sampler_walks_through_the_dimensions() {
    let mut sampler = SobolSampler::new(5, 123);
    for d in 0..70 {
        assert_eq!(sampler.next_f64(), sample(123, d, 5));
    }
    assert_eq!(sampler.next_2d(), [sample(123, 70, 5), sample(123, 71, 5)]);
}
