//! Sobol' points with Owen scrambling, computed from index and dimension alone (Burley 2020,
//! "Practical Hash-based Owen Scrambling").
//!
//! Every coordinate of every point is uniform in (0, 1) over the seeds, so estimates are unbiased;
//! the points of one seed fill space evenly, so that the error for smooth integrands falls like
//! `N^-1.5` instead of `N^-0.5`, best at powers of two. Dimensions come in sets of
//! [`SET_DIMENSIONS`] whose projections on each other are even; each further set is a copy of the
//! first with indices and digits scrambled anew, independent of the others ("padding").

mod directions;
#[cfg(test)]
mod tests;

use directions::{BY_NIBBLE, DIMENSIONS};

/// Number of dimensions with generator matrices of their own.
pub const SET_DIMENSIONS: u32 = DIMENSIONS as u32;

/// Coordinate `dimension` of point `index` of the sequence named by `seed`, in (0, 1).
///
/// ```
/// use drt_math::sobol;
/// // The first 16 points: one in each sixteenth of every axis.
/// let mut strata: Vec<u32> = (0..16).map(|i| (16.0 * sobol::sample(i, 5, 7)) as u32).collect();
/// strata.sort();
/// assert_eq!(strata, (0..16).collect::<Vec<_>>());
/// ```
#[inline]
#[must_use]
pub fn sample(index: u32, dimension: u32, seed: u32) -> f64 {
    coordinate(shuffled(index, dimension / SET_DIMENSIONS, seed), dimension, seed)
}

/// The coordinates of one point, one after the other: stands where an [`Rng`](crate::Rng) stands.
#[derive(Clone, Debug)]
pub struct SobolSampler {
    index: u32,
    seed: u32,
    dimension: u32,
    /// The index as the current set of dimensions sees it.
    shuffled: u32,
}

impl SobolSampler {
    /// Point `index` of the sequence named by `seed`: one seed per pixel, one index per sample.
    #[must_use]
    pub fn new(seed: u32, index: u32) -> Self {
        Self { index, seed, dimension: 0, shuffled: shuffled(index, 0, seed) }
    }

    /// Stands where no points are asked for.
    pub(crate) const UNUSED: Self = Self { index: 0, seed: 0, dimension: 0, shuffled: 0 };

    /// The next coordinate, in (0, 1).
    #[inline]
    pub fn next_f64(&mut self) -> f64 {
        let x = coordinate(self.shuffled, self.dimension, self.seed);
        self.dimension = self.dimension.wrapping_add(1);
        if self.dimension.is_multiple_of(SET_DIMENSIONS) {
            self.enter_set();
        }
        x
    }

    #[cold]
    fn enter_set(&mut self) {
        self.shuffled = shuffled(self.index, self.dimension / SET_DIMENSIONS, self.seed);
    }

    /// Leaves out so many coordinates.
    pub(crate) fn skip(&mut self, coordinates: u32) {
        let set = self.dimension / SET_DIMENSIONS;
        self.dimension = self.dimension.wrapping_add(coordinates);
        if self.dimension / SET_DIMENSIONS != set {
            self.enter_set();
        }
    }

    /// The next two coordinates.
    #[inline]
    pub fn next_2d(&mut self) -> [f64; 2] {
        [self.next_f64(), self.next_f64()]
    }
}

/// The index permuted within its power-of-two blocks.
#[inline]
fn shuffled(index: u32, set: u32, seed: u32) -> u32 {
    // The complement keeps the seeds of sets and of dimensions apart.
    nested_uniform_scramble(index.reverse_bits(), mix(seed, !set)).reverse_bits()
}

#[inline]
fn coordinate(shuffled: u32, dimension: u32, seed: u32) -> f64 {
    let table = &BY_NIBBLE[(dimension % SET_DIMENSIONS) as usize];
    let mut digits = 0;
    for (k, row) in table.iter().enumerate() {
        digits ^= row[(shuffled >> (4 * k) & 15) as usize];
    }
    let digits = nested_uniform_scramble(digits, mix(seed, dimension)).reverse_bits();
    (f64::from(digits) + 0.5) * (1.0 / 4_294_967_296.0)
}

/// Owen's scramble of binary digits, first digit lowest: each is flipped or not depending on the
/// digits below it, at random. Carries and products only ever act upwards, which is all it takes:
/// the hash of Laine & Karras 2011 with the constants of Vegdahl 2021, "Building a Better LK Hash".
#[inline]
fn nested_uniform_scramble(mut x: u32, seed: u32) -> u32 {
    x ^= x.wrapping_mul(0x3d20_adea);
    x = x.wrapping_add(seed);
    x = x.wrapping_mul(seed >> 16 | 1);
    x ^= x.wrapping_mul(0x0552_6c56);
    x ^ x.wrapping_mul(0x53a2_2864)
}

/// A seed from a pair of numbers: a step and the finaliser of SplitMix64 (Steele, Lea & Flood 2014,
/// "Fast splittable pseudorandom number generators").
#[inline]
fn mix(a: u32, b: u32) -> u32 {
    let mut z =
        (u64::from(a) << 32 | u64::from(b)).wrapping_add(1).wrapping_mul(0x9E37_79B9_7F4A_7C15);
    z = (z ^ z >> 30).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    z = (z ^ z >> 27).wrapping_mul(0x94D0_49BB_1331_11EB);
    (z ^ z >> 31) as u32
}
