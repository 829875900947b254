use crate::sobol::SobolSampler;

/// A counter-based random number generator: Philox 4×32-10 (Salmon et al. 2011, "Parallel random
/// numbers: as easy as 1, 2, 3").
///
/// The numbers are a pure function of (seed, stream, index, position), so the same work item draws
/// the same numbers whichever thread runs it and in whatever order. Each (seed, stream, index) has
/// 2^34 numbers of 32 bits before they repeat, and shares none of them with any other.
///
/// ```
/// use drt_math::Rng;
/// let pixel = 640 * 12 + 7;
/// let mut rng = Rng::new(42, pixel, 3);
/// let u = rng.next_2d();
/// assert_eq!(Rng::new(42, pixel, 3).next_2d(), u);
/// assert_ne!(Rng::new(42, pixel, 4).next_2d(), u);
/// ```
#[derive(Clone, Debug)]
pub struct Rng {
    key: [u32; 2],
    counter: [u32; 4],
    block: [u32; 4],
    used: u32,
    /// Stands in for the first numbers.
    points: SobolSampler,
    /// How many of them are left.
    leading: u32,
    /// What comes before them, and how many of these, at the end of the list, are left.
    first: [f64; MOST_FIRST],
    first_left: u32,
}

/// The most numbers that can be told.
const MOST_FIRST: usize = 4;

impl Rng {
    /// The generator of one work item: `stream` names the kind of work (and pixel), `index` the
    /// sample within it.
    #[must_use]
    pub fn new(seed: u64, stream: u64, index: u32) -> Self {
        Self {
            key: [seed as u32, (seed >> 32) as u32],
            counter: [0, index, stream as u32, (stream >> 32) as u32],
            block: [0; 4],
            used: 4,
            points: SobolSampler::UNUSED,
            leading: 0,
            first: [0.0; MOST_FIRST],
            first_left: 0,
        }
    }

    /// The same with its first `dimensions` uniform numbers taken from a point of a Sobol' sequence:
    /// what is drawn first spreads evenly over the points of one sequence. Bits are not affected.
    ///
    /// ```
    /// use drt_math::{Rng, sobol::SobolSampler};
    /// let first = |i| Rng::new(1, 2, i).led_by(SobolSampler::new(9, i), 1).next_f64();
    /// let mut strata: Vec<u32> = (0..16).map(|i| (16.0 * first(i)) as u32).collect();
    /// strata.sort();
    /// assert_eq!(strata, (0..16).collect::<Vec<_>>());
    /// ```
    #[must_use]
    pub fn led_by(self, points: SobolSampler, dimensions: u32) -> Self {
        Self { points, leading: dimensions, ..self }
    }

    /// The same, beginning with four numbers in (0, 1) that are told, such as those of a
    /// distribution other than the uniform one. Bits are not affected.
    ///
    /// ```
    /// use drt_math::Rng;
    /// let mut rng = Rng::new(1, 2, 3).starting_with([0.1, 0.2, 0.3, 0.4]);
    /// assert_eq!([rng.next_2d(), rng.next_2d()], [[0.1, 0.2], [0.3, 0.4]]);
    /// assert_eq!(rng.next_f64(), Rng::new(1, 2, 3).next_f64());
    /// ```
    #[must_use]
    pub fn starting_with(self, first: [f64; 4]) -> Self {
        let first_left = MOST_FIRST as u32;
        Self { first, first_left, leading: self.leading + first_left, ..self }
    }

    /// 32 random bits.
    #[inline]
    pub fn next_u32(&mut self) -> u32 {
        if self.used == 4 {
            self.refill();
        }
        let v = self.block[self.used as usize];
        self.used += 1;
        v
    }

    /// The next block of bits: not in line, as its many registers would be saved for leading numbers, too.
    #[inline(never)]
    fn refill(&mut self) {
        self.block = philox4x32(self.counter, self.key);
        self.counter[0] = self.counter[0].wrapping_add(1);
        self.used = 0;
    }

    /// 64 random bits.
    #[inline]
    pub fn next_u64(&mut self) -> u64 {
        u64::from(self.next_u32()) << 32 | u64::from(self.next_u32())
    }

    /// A uniform number in (0, 1): the centre of one of 2^52 equal intervals (2^32 for a leading
    /// one), so neither 0 nor 1.
    #[inline]
    pub fn next_f64(&mut self) -> f64 {
        if self.leading > 0 {
            self.leading -= 1;
            if self.first_left > 0 {
                return self.next_first();
            }
            return self.points.next_f64();
        }
        interval_centre(self.next_u64() >> 12)
    }

    /// The next of the numbers that were told.
    #[cold]
    fn next_first(&mut self) -> f64 {
        let number = self.first[MOST_FIRST - self.first_left as usize];
        self.first_left -= 1;
        number
    }

    /// Two uniform numbers in (0, 1).
    #[inline]
    pub fn next_2d(&mut self) -> [f64; 2] {
        [self.next_f64(), self.next_f64()]
    }

    /// Leaves out so many uniform numbers, at hardly any cost where they are leading ones.
    ///
    /// ```
    /// use drt_math::Rng;
    /// let (mut rng, mut other) = (Rng::new(1, 2, 3), Rng::new(1, 2, 3));
    /// rng.skip(2);
    /// other.next_2d();
    /// assert_eq!(rng.next_f64(), other.next_f64());
    /// ```
    pub fn skip(&mut self, numbers: u32) {
        let leading = u32::min(numbers, self.leading);
        self.leading -= leading;
        let first = u32::min(leading, self.first_left);
        self.first_left -= first;
        self.points.skip(leading - first);
        for _ in leading..numbers {
            self.next_u64();
        }
    }
}

/// The centre of interval `k` of 2^52.
#[inline]
fn interval_centre(k: u64) -> f64 {
    (k as f64 + 0.5) * (1.0 / 4_503_599_627_370_496.0)
}

/// The ten-round Philox bijection.
#[must_use]
pub(crate) fn philox4x32(mut c: [u32; 4], mut k: [u32; 2]) -> [u32; 4] {
    for round in 0..10 {
        if round > 0 {
            k[0] = k[0].wrapping_add(0x9E37_79B9);
            k[1] = k[1].wrapping_add(0xBB67_AE85);
        }
        let p0 = u64::from(c[0]) * 0xD251_1F53;
        let p1 = u64::from(c[2]) * 0xCD9E_8D57;
        c = [
            (p1 >> 32) as u32 ^ c[1] ^ k[0],
            p1 as u32,
            (p0 >> 32) as u32 ^ c[3] ^ k[1],
            p0 as u32,
        ];
    }
    c
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{SIGNIFICANCE, interval_chi_square, rectangle_chi_square};

    #[test]
    fn philox_known_answers() {
        // Random123 1.09, tests/kat_vectors, "philox4x32 10".
        let ones = u32::MAX;
        let cases = [
            ([0; 4], [0; 2], [0x6627_e8d5, 0xe169_c58d, 0xbc57_ac4c, 0x9b00_dbd8]),
            ([ones; 4], [ones; 2], [0x408f_276d, 0x41c8_3b0e, 0xa20b_c7c6, 0x6d54_51fd]),
            (
                [0x243f_6a88, 0x85a3_08d3, 0x1319_8a2e, 0x0370_7344],
                [0xa409_3822, 0x299f_31d0],
                [0xd16c_fe09, 0x94fd_cceb, 0x5001_e420, 0x2412_6ea1],
            ),
        ];
        for (counter, key, answer) in cases {
            assert_eq!(philox4x32(counter, key), answer);
        }
    }

    #[test]
    fn numbers_come_from_the_named_block() {
        let mut rng = Rng::new(0x0123_4567_89ab_cdef, 0xfeed_0000_beef, 9);
        let key = [0x89ab_cdef, 0x0123_4567];
        for position in 0..3 {
            for word in philox4x32([position, 9, 0x0000_beef, 0xfeed], key) {
                assert_eq!(rng.next_u32(), word);
            }
        }
    }

    #[test]
    fn uniform_alone_in_pairs_and_across_streams() {
        const N: u32 = 200_000;
        let mut rng = Rng::new(7, 1, 0);
        let p = interval_chi_square((0..N).map(|_| rng.next_f64()), [0.0, 1.0], |_| 1.0);
        assert!(p > SIGNIFICANCE, "{p}");
        let square = |points: &mut dyn Iterator<Item = [f64; 2]>| {
            rectangle_chi_square(points, [0.0; 2], [1.0; 2], |_| 1.0)
        };
        let p = square(&mut (0..N).map(|_| rng.next_2d()));
        assert!(p > SIGNIFICANCE, "{p}");
        let first = |stream: u64, index: u32| Rng::new(7, stream, index).next_f64();
        let p = square(&mut (0..N).map(|i| [first(2, i), first(3, i)]));
        assert!(p > SIGNIFICANCE, "{p}");
        let p = square(&mut (0..N).map(|i| [first(u64::from(i), 0), first(u64::from(i) + 1, 0)]));
        assert!(p > SIGNIFICANCE, "{p}");
        let p = square(&mut (0..N).map(|i| [first(2, i), first(2, i / 2)]));
        assert!(p > SIGNIFICANCE, "{p}");
        let p = square(&mut (0..N).map(|i| [first(2, i % 1000), first(3, i % 1000)]));
        assert!(p < SIGNIFICANCE, "numbers used over and over: {p}");
    }

    #[test]
    fn what_is_skipped_is_what_would_be_drawn() {
        use crate::sobol::SET_DIMENSIONS;
        let new = || Rng::new(1, 2, 3).led_by(SobolSampler::new(4, 5), SET_DIMENSIONS + 3);
        for numbers in [0, 1, 7, SET_DIMENSIONS, SET_DIMENSIONS + 2, SET_DIMENSIONS + 9] {
            let (mut skipped, mut drawn) = (new(), new());
            skipped.skip(numbers);
            (0..numbers).for_each(|_| assert!(drawn.next_f64() < 1.0));
            for _ in 0..5 {
                assert_eq!(skipped.next_f64(), drawn.next_f64(), "{numbers}");
            }
        }
    }

    #[test]
    fn numbers_that_are_told_come_first() {
        use crate::sobol::SET_DIMENSIONS;
        let led = || Rng::new(1, 2, 3).led_by(SobolSampler::new(4, 5), SET_DIMENSIONS);
        let told = [0.1, 0.2, 0.3, 0.4];
        for numbers in [0, 1, 3, 4, 6, SET_DIMENSIONS + 6] {
            let mut rng = led().starting_with(told);
            rng.skip(numbers);
            let mut expected: alloc::vec::Vec<f64> =
                told.into_iter().skip(numbers as usize).collect();
            let mut points = led();
            points.skip(numbers.saturating_sub(4));
            expected.extend((0..5).map(|_| points.next_f64()));
            assert!(expected.iter().all(|n| *n == rng.next_f64()), "{numbers}");
        }
    }

    #[test]
    fn extremes_stay_inside_the_open_interval() {
        assert!(interval_centre(0) > 0.0 && interval_centre((1 << 52) - 1) < 1.0);
    }
}
