//! One of many, chosen while they come by.

/// A choice among items with two weights each: mostly in proportion to the second, which is a guess of
/// what they are worth, and at times to the first, as a guess may be too low by any factor.
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

    /// The item, its probability, and a uniform number; `None` where there is none.
    pub(super) fn made(self) -> Option<(T, f64, f64)> {
        let (item, weights) = self.chosen?;
        let chance = probability(weights, self.totals, self.share);
        (chance > 0.0 && chance.is_finite()).then_some((item, chance, self.u))
    }
}

/// Of choosing an item with some weights, which add up to `totals` over all.
pub(super) fn probability(weights: [f64; 2], totals: [f64; 2], share: f64) -> f64 {
    share * weights[0] / totals[0] + (1.0 - share) * weights[1] / totals[1]
}
