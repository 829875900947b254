//! One of many, chosen while they come by.

/// A choice among items with two weights each: mostly in proportion to the second, which is a guess of
/// an estimate of their contributions, and at times to the first, as a guess may be too low by any factor.
pub(super) struct Choice<T> {
    /// Uniform; what is left of it is uniform again.
    u: f64,
    /// The part of choices by the first weight.
    share: f64,
    by: usize,
    totals: [f64; 2],
    chosen: Option<(T, [f64; 2])>,
}

impl<T> Choice<T> {
    pub(super) fn new(u: f64, share: f64) -> Self {
        let (by, u) = if u < share { (0, u / share) } else { (1, (u - share) / (1.0 - share)) };
        Self { u, share, by, totals: [0.0; 2], chosen: None }
    }

    /// Considers an item with positive weights.
    pub(super) fn offer(&mut self, item: T, weights: [f64; 2]) {
        for (total, weight) in self.totals.iter_mut().zip(weights) {
            *total += weight;
        }
        let chance = weights[self.by] / self.totals[self.by];
        if self.u < chance {
            self.chosen = Some((item, weights));
            self.u /= chance;
        } else {
            self.u = (self.u - chance) / (1.0 - chance);
        }
    }

    /// The item and its probability; `None` where there is none.
    pub(super) fn made(self) -> Option<(T, f64)> {
        let (item, weights) = self.chosen?;
        let [by_first, by_second] = [0, 1].map(|k| weights[k] / self.totals[k]);
        Some((item, self.share * by_first + (1.0 - self.share) * by_second))
    }
}

#[cfg(all(test, feature = "std"))]
mod tests {
    use drt_math::Rng;
    use drt_math::testing::{SIGNIFICANCE, chi_square};

    use super::*;

    #[test]
    fn items_come_as_often_as_is_said() {
        let weights = [[1.0, 0.01], [0.5, 2.0], [2.0, 0.1], [0.1, 5.0]];
        let (mut counts, mut said) = ([0; 4], [0.0; 4]);
        let mut rng = Rng::new(2, 0, 0);
        for _ in 0..40_000 {
            let mut choice = Choice::new(rng.next_f64(), 0.3);
            weights.iter().enumerate().for_each(|(k, w)| choice.offer(k, *w));
            let (k, chance) = choice.made().expect("one of them");
            counts[k] += 1;
            said[k] = 40_000.0 * chance;
        }
        assert!(chi_square(&counts, &said) > SIGNIFICANCE, "{counts:?} {said:?}");
        // Planted: the share of the first weight is another.
        let mut faulty = said;
        faulty[0] *= 1.1;
        faulty[3] -= 0.1 * said[0];
        assert!(chi_square(&counts, &faulty) < SIGNIFICANCE, "{counts:?} {faulty:?}");
        assert!(Choice::<u32>::new(0.5, 0.3).made().is_none());
    }
}
