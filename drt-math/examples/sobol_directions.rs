//! The search that the direction numbers of `drt_math::sobol` come from.
//!
//! Dimension after dimension, over the primitive polynomials in order of degree: of the initial
//! numbers that keep property A (Sobol' 1976), those win whose two-dimensional projections with the
//! dimensions before have the smallest quality parameters t, near dimensions counting most: the
//! principle of Joe & Kuo 2008, "Constructing Sobol sequences with better two-dimensional
//! projections", with a search of our own.
//!
//! `cargo run --release --example sobol_directions` prints the table as it stands in
//! `src/sobol/directions.rs`, and behind each dimension its mean t at 2^16 points.

use drt_math::Rng;

const DIMENSIONS: usize = 32;
/// Projections are judged on nets of 2, 4, ... 2^18 points.
const LARGEST_NET: usize = 18;
/// Where there are more initial numbers than this, as many are drawn at random.
const CANDIDATES: u64 = 6000;

/// A generator matrix: bit i of row r says whether index bit i flips digit r.
type Matrix = [u32; 32];

fn main() {
    let mut chosen: Vec<Matrix> = vec![std::array::from_fn(|r| 1 << r)];
    for polynomial in (0b11..).filter(|&p| is_primitive(p)).take(DIMENSIONS - 1) {
        let degree = polynomial.ilog2();
        let free_bits = degree * (degree - 1) / 2;
        let exhaustive = free_bits < 63 && 1_u64 << free_bits <= CANDIDATES;
        let mut rng = Rng::new(0, u64::from(polynomial), 0);
        let mut best: Option<(f64, Vec<u32>, Matrix)> = None;
        for k in 0..if exhaustive { 1 << free_bits } else { CANDIDATES } {
            let numbers = odd_numbers(degree, if exhaustive { k } else { rng.next_u64() });
            let matrix = matrix(polynomial, &numbers);
            if !has_property_a(&chosen, &matrix) {
                continue;
            }
            let bound = best.as_ref().map_or(f64::INFINITY, |b| b.0);
            if let Some(cost) = cost(&chosen, &matrix, bound) {
                best = Some((cost, numbers, matrix));
            }
        }
        let (_, numbers, matrix) = best.expect("some initial numbers keep property A");
        let mean_t = chosen.iter().map(|c| quality(c, &matrix, 16) as f64).sum::<f64>()
            / chosen.len() as f64;
        println!("    (0b{polynomial:b}, &{numbers:?}), // {mean_t:.2}");
        chosen.push(matrix);
    }
}

/// True when x generates the multiplicative group of GF(2)[x] modulo the polynomial.
fn is_primitive(polynomial: u32) -> bool {
    let degree = polynomial.ilog2();
    let mut power = 1;
    for k in 1..1_u32 << degree {
        power <<= 1;
        if power >> degree & 1 == 1 {
            power ^= polynomial;
        }
        if power == 1 {
            return k == (1 << degree) - 1;
        }
    }
    false
}

/// The i-th number (from 1) is odd and below 2^i; `bits` supplies what is free.
fn odd_numbers(degree: u32, mut bits: u64) -> Vec<u32> {
    (0..degree)
        .map(|i| {
            let m = (bits as u32 & ((1 << i) - 1)) << 1 | 1;
            bits >>= i;
            m
        })
        .collect()
}

/// Columns from the recurrence (Bratley & Fox 1988, eq. 2), turned into rows.
fn matrix(polynomial: u32, numbers: &[u32]) -> Matrix {
    let degree = numbers.len();
    let mut columns = [0_u32; 32];
    for i in 0..32 {
        columns[i] = if i < degree {
            numbers[i] << (31 - i)
        } else {
            (1..degree)
                .filter(|k| polynomial >> (degree - k) & 1 == 1)
                .fold(columns[i - degree] ^ columns[i - degree] >> degree, |v, k| {
                    v ^ columns[i - k]
                })
        };
    }
    std::array::from_fn(|r| (0..32).fold(0, |row, i| row | (columns[i] >> (31 - r) & 1) << i))
}

/// The first digits of the first d index bits in d dimensions form a regular matrix: each of the
/// 2^d parts of the halved unit cube gets one of the first 2^d points.
fn has_property_a(chosen: &[Matrix], new: &Matrix) -> bool {
    let d = chosen.len() + 1;
    let mut echelon: Vec<u32> = Vec::new();
    chosen.iter().chain([new]).all(|m| {
        let row = reduce(&echelon, m[0] & ((1_u64 << d) - 1) as u32);
        echelon.push(row);
        row != 0
    })
}

/// Adds rows so that the lowest bit of none is left.
fn reduce(echelon: &[u32], row: u32) -> u32 {
    echelon.iter().fold(row, |v, e| if v & e & e.wrapping_neg() != 0 { v ^ e } else { v })
}

/// Weighted sum of squared quality parameters, or nothing when it exceeds the bound.
fn cost(chosen: &[Matrix], new: &Matrix, bound: f64) -> Option<f64> {
    let mut sum = 0.0;
    let mut weight = 1.0;
    for old in chosen.iter().rev() {
        for m in 2..=LARGEST_NET {
            let t = quality(old, new, m) as f64;
            sum += weight * t * t;
        }
        if sum >= bound {
            return None;
        }
        weight *= 0.9;
    }
    Some(sum)
}

/// The quality parameter t of the first 2^m points in two dimensions: the least such that the first
/// k rows of one matrix and m - t - k of the other are independent, for every k.
fn quality(a: &Matrix, b: &Matrix, m: usize) -> usize {
    let mask = ((1_u64 << m) - 1) as u32;
    let independent = (0..m).map(|k| {
        let mut echelon: Vec<u32> = a[..k].iter().map(|row| row & mask).collect();
        for row in b {
            let row = reduce(&echelon, row & mask);
            if row == 0 || echelon.len() == m {
                break;
            }
            echelon.push(row);
        }
        echelon.len()
    });
    m - independent.min().unwrap_or(m)
}
