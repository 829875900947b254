//! How many samples each term of a derivative takes.
//!
//! A derivative is a sum of terms that are sampled apart: those along paths, edge queries from these, and
//! boundary samples that land anywhere. Where term k takes r_k samples to each path, of the variance v_k and the
//! cost c_k each, variance times time is (Σ v_k / r_k) (Σ c_k r_k). That is least for r_k in
//! proportion to √(v_k / c_k), by Cauchy and Schwarz's inequality, and then (Σ √(v_k c_k))² (Neyman 1934, for
//! strata of different cost). Paths have r = 1 by definition, so that
//!
//! ```text
//! r_k = √(v_k c_1 / (v_1 c_k)),      k = 1 being the paths.
//! ```
//!
//! Several derivatives count alike: each v_k is the sum over them of its part of the variance that the
//! derivative has where all r are one. Costs are counted, not timed: a run must not depend on the machine.

use alloc::vec::Vec;

use drt_math::Real;

/// The fewest and most samples of a term to each path. Terms at boundaries have rare samples that a pilot
/// seldom sees: some have seen a thousandth of the variance that there is.
const RANGE: [f64; 2] = [0.25, 4.0];

/// The fewest of one whose samples are all of a size.
const FEWEST_EVEN: f64 = 0.03125;

/// What a sample costs besides its rays, in rays: to choose an edge and to find what is around it.
pub(crate) const BESIDES: f64 = 1.0;

/// What a lookup in a grid costs, in rays.
pub(crate) const LOOKUP: f64 = 0.2;

/// Variance and cost of a term, as a pilot has measured them.
#[derive(Clone, Debug)]
pub(crate) struct TermStatistics {
    /// Of one sample, per derivative.
    pub(crate) variance: Vec<f64>,
    /// Rays of one sample.
    pub(crate) rays: f64,
    /// No sample counts much more than others.
    pub(crate) even: bool,
}

impl TermStatistics {
    /// What several measurements by equally many samples say together; of none, nothing.
    pub(crate) fn mean<'a>(measured: impl ExactSizeIterator<Item = &'a Self>) -> Self {
        let part = 1.0 / measured.len() as f64;
        let mut mean = Self { variance: Vec::new(), rays: 0.0, even: false };
        for one in measured {
            mean.variance.resize(one.variance.len(), 0.0);
            mean.variance.iter_mut().zip(&one.variance).for_each(|(sum, v)| *sum += part * v);
            mean.rays += part * one.rays;
            mean.even = one.even;
        }
        mean
    }
}

/// Boundary samples to each path.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct SampleBudget {
    /// Edge queries.
    pub(crate) queries: f64,
    /// Of each splatted source.
    pub(crate) sources: Vec<f64>,
}

impl SampleBudget {
    /// By what a pilot has seen of paths, of queries and of splatted sources.
    pub(crate) fn new(
        paths: &TermStatistics,
        queries: &TermStatistics,
        sources: &[TermStatistics],
    ) -> Self {
        let terms = || [paths, queries].into_iter().chain(sources);
        let all: Vec<f64> =
            (0..paths.variance.len()).map(|p| terms().map(|term| term.variance[p]).sum()).collect();
        let share = |term: &TermStatistics| -> f64 {
            let parts = term.variance.iter().zip(&all);
            parts.map(|(v, all)| if *all > 0.0 { v / all } else { 0.0 }).sum()
        };
        let own = share(paths) / (paths.rays + BESIDES);
        let ratio = |term: &TermStatistics| {
            let other = share(term) / (term.rays + BESIDES);
            // Without noise of either there is nothing to choose.
            let ratio = if other == 0.0 && own == 0.0 { 1.0 } else { Real::sqrt(other / own) };
            let [fewest, most] = RANGE;
            ratio.clamp(if term.even { FEWEST_EVEN } else { fewest }, most)
        };
        Self { queries: ratio(queries), sources: sources.iter().map(ratio).collect() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn observed(variance: &[f64], cost: f64) -> TermStatistics {
        TermStatistics { variance: variance.to_vec(), rays: cost - BESIDES, even: false }
    }

    /// Less work than by any other budget.
    #[test]
    fn work_is_least() {
        let terms = [(2.0, 10.0), (0.5, 20.0), (3.0, 30.0)];
        let [paths, queries, source] = terms.map(|(v, c)| observed(&[v], c));
        let budget = SampleBudget::new(&paths, &queries, core::slice::from_ref(&source));
        let work = |r: [f64; 3]| {
            let of = |f: &dyn Fn(f64, f64, f64) -> f64| -> f64 {
                terms.iter().zip(r).map(|((v, c), r)| f(*v, *c, r)).sum()
            };
            of(&|v, _, r| v / r) * of(&|_, c, r| c * r)
        };
        let best = work([1.0, budget.queries, budget.sources[0]]);
        let least: f64 = terms.iter().map(|(v, c)| Real::sqrt(v * c)).sum();
        assert!((best / (least * least) - 1.0).abs() < 1e-12, "{budget:?}");
        for factor in [0.8, 1.25] {
            assert!(work([1.0, factor * budget.queries, budget.sources[0]]) > 1.002 * best);
            assert!(work([1.0, budget.queries, factor * budget.sources[0]]) > 1.002 * best);
        }
        assert!(work([1.0, 1.0, 1.0]) > 1.02 * best);
    }

    #[test]
    fn derivatives_count_alike() {
        // What the second one lacks in noise is a matter of its unit.
        let [paths, queries] = [[1.0, 3e-6], [3.0, 1e-6]].map(|v| observed(&v, 10.0));
        let budget = SampleBudget::new(&paths, &queries, &[]);
        assert!((budget.queries - 1.0).abs() < 1e-12, "{budget:?}");
    }

    #[test]
    fn what_is_not_seen_is_not_forgotten() {
        let [paths, queries] = [[1.0], [0.0]].map(|v| observed(&v, 10.0));
        assert_eq!(SampleBudget::new(&paths, &queries, &[]).queries, RANGE[0]);
        assert_eq!(SampleBudget::new(&queries, &paths, &[]).queries, RANGE[1]);
        assert_eq!(SampleBudget::new(&queries, &queries, &[]).queries, 1.0);
        let even = TermStatistics { even: true, ..queries };
        assert_eq!(SampleBudget::new(&paths, &even, &[]).queries, FEWEST_EVEN);
    }
}
