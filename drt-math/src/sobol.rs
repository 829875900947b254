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

use directions::{BY_NIBBLE, DIMENSIONS, TOGETHER};

/// Number of dimensions with generator matrices of their own.
pub const SET_DIMENSIONS: u32 = DIMENSIONS as u32;

/// Coordinates that are computed together.
const LANES: u32 = TOGETHER as u32;

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
    let shuffled = shuffled(index, dimension / SET_DIMENSIONS, seed);
    coordinates(shuffled, dimension / LANES, seed)[(dimension % LANES) as usize]
}

/// The coordinates of one point, one after the other: stands where an [`Rng`](crate::Rng) stands.
#[derive(Clone, Debug)]
pub struct SobolSampler {
    index: u32,
    seed: u32,
    dimension: u32,
    /// The index as the current set of dimensions sees it.
    shuffled: u32,
    /// The next coordinate and its neighbours, unless it is the first of these.
    together: [f64; TOGETHER],
}

impl SobolSampler {
    /// Point `index` of the sequence named by `seed`: one seed per pixel, one index per sample.
    #[must_use]
    pub fn new(seed: u32, index: u32) -> Self {
        Self { index, seed, ..Self::UNUSED }
    }

    /// Stands where no points are asked for.
    pub(crate) const UNUSED: Self =
        Self { index: 0, seed: 0, dimension: 0, shuffled: 0, together: [0.0; TOGETHER] };

    /// The next coordinate, in (0, 1).
    #[inline]
    pub fn next_f64(&mut self) -> f64 {
        let lane = self.dimension % LANES;
        if lane == 0 {
            self.enter(self.dimension.is_multiple_of(SET_DIMENSIONS));
        }
        self.dimension = self.dimension.wrapping_add(1);
        self.together[lane as usize]
    }

    /// Computes what stands together with the next coordinate. Not in line, as its many registers would be saved for every
    /// coordinate.
    #[inline(never)]
    fn enter(&mut self, new_set: bool) {
        if new_set {
            self.shuffled = shuffled(self.index, self.dimension / SET_DIMENSIONS, self.seed);
        }
        self.together = coordinates(self.shuffled, self.dimension / LANES, self.seed);
    }

    /// Leaves out so many coordinates.
    pub(crate) fn skip(&mut self, coordinates: u32) {
        let before = self.dimension;
        self.dimension = before.wrapping_add(coordinates);
        // What begins with the next coordinate is entered with that.
        let entered = |of: u32| self.dimension.div_ceil(of) != before.div_ceil(of);
        if entered(LANES) {
            self.enter(entered(SET_DIMENSIONS));
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

/// Those that stand together at one place.
#[inline]
fn coordinates(shuffled: u32, place: u32, seed: u32) -> [f64; TOGETHER] {
    let table = &BY_NIBBLE[place as usize % BY_NIBBLE.len()];
    let mut digits = [0; TOGETHER];
    for (k, row) in table.iter().enumerate() {
        let of_nibble = &row[(shuffled >> (4 * k) & 15) as usize];
        for (digits, d) in digits.iter_mut().zip(of_nibble) {
            *digits ^= d;
        }
    }
    let seeds: [u32; TOGETHER] =
        core::array::from_fn(|lane| mix(seed, place.wrapping_mul(LANES) | lane as u32));
    core::array::from_fn(|lane| {
        let digits = nested_uniform_scramble(digits[lane], seeds[lane]).reverse_bits();
        (f64::from(digits) + 0.5) * (1.0 / 4_294_967_296.0)
    })
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
