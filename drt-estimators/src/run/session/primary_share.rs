//! A pilot of few samples: how many of the boundary samples go to edges that the camera sees.
//!
//! Kinds of boundary samples share [`Settings::boundary_ratio`](crate::Settings::boundary_ratio). In equal parts those of the
//! camera's edges often make a hundredth of the noise in a third of the time, as radiance differs beside an edge by about as
//! much as an image does; but where a lamp is in view, and that or the camera moves, they make nearly all of it. So before a run
//! a few samples of all terms tell which it is. With the variance v and cost c of a sample, and those of paths (v₁, c₁) and of the
//! other kinds (v_k, c_k), of which there are one and r₀ to a path, [least work](crate::sampling::budget) for one derivative would be the part
//!
//! ```text
//! p = √(v / c) / max(r₀ √(v₁ / c₁), √(v_k / c_k))
//! ```
//!
//! of an equal one. The camera's edges take a quarter of that, of the derivative that needs them most, but at least 1/4, at most 1,
//! and a power of two from above. The quarter is for what so few samples miss: other terms have rare samples, which make most of
//! their noise. (In rooms and fog 256 edge queries had a sixth to a fortieth of their variance.) No other term takes less for
//! this, and these samples have no part in the images.

use alloc::vec::Vec;

use drt_math::Real;

use crate::run::session::term_samples::Batch;
use crate::sampling::budget::{BESIDES, TermStatistics};
use crate::terms::prepared::Prepared;

/// The smallest part that is taken of an equal one.
const LEAST: f64 = 0.25;

/// The part of p that is taken, for what so few samples miss.
const TAKEN: f64 = 0.25;

/// The index among its sources of the edges that the camera sees, where there are any.
pub(super) fn of_camera(prepared: &Prepared) -> Option<usize> {
    prepared.terms.sources.iter().position(|s| s.is_of_camera())
}

/// The part that edges seen from the camera take of an equal one, by what some batches have seen.
pub(super) fn primary_share(prepared: &Prepared, batches: &[Batch]) -> f64 {
    let (Some(camera), Some(first)) = (of_camera(prepared), batches.first()) else { return 1.0 };
    let mut terms: Vec<TermStatistics> = (0..first.len())
        .map(|t| TermStatistics::mean(batches.iter().map(|batch| &batch[t].pixels)))
        .collect();
    // Paths come first, then edge queries, then the sources.
    let camera = terms.remove(2 + camera);
    let paths = terms.remove(0);
    part(&camera, &paths, &terms, prepared.terms.boundary_ratio)
}

/// p, as a power of two.
fn part(
    camera: &TermStatistics,
    paths: &TermStatistics,
    others: &[TermStatistics],
    equal: f64,
) -> f64 {
    let value =
        |term: &TermStatistics, q: usize| Real::sqrt(term.variance[q] / (term.rays + BESIDES));
    let need = |q: usize| {
        let most = others.iter().map(|o| value(o, q)).fold(equal * value(paths, q), f64::max);
        // NaN, which is no need, where nothing is noisy.
        value(camera, q) / most
    };
    let wanted = TAKEN * (0..paths.variance.len()).map(need).fold(0.0, f64::max);
    let mut part = 1.0;
    while part > LEAST && wanted <= 0.5 * part {
        part *= 0.5;
    }
    part
}

#[cfg(test)]
mod tests {
    use super::*;

    fn observed(variance: [f64; 2], cost: f64) -> TermStatistics {
        TermStatistics { variance: variance.to_vec(), rays: cost - BESIDES, even: false }
    }

    #[test]
    fn the_neediest_derivative_decides() {
        let paths = observed([1.0, 1.0], 4.0);
        let others = [observed([4.0, 0.1], 4.0), observed([0.0, 0.2], 4.0)];
        let of = |camera: [f64; 2]| part(&observed(camera, 16.0), &paths, &others, 0.5);
        // By one derivative p is √(v / 16) / √(4 / 4), by the other √(v / 16) / √(1 / 16).
        for (camera, expected) in [
            ([0.01, 0.0], 0.25),
            ([63.0, 0.0], 0.5),
            ([65.0, 0.0], 1.0),
            ([0.01, 0.9], 0.25),
            ([0.01, 3.9], 0.5),
            ([0.01, 4.1], 1.0),
        ] {
            let own = of(camera);
            assert_eq!(own, expected, "{camera:?}");
        }
    }

    #[test]
    fn without_other_noise_all_is_taken() {
        let none = observed([0.0; 2], 4.0);
        let of = |camera: [f64; 2]| {
            part(&observed(camera, 16.0), &none, core::slice::from_ref(&none), 0.5)
        };
        assert_eq!(of([1e-9, 0.0]), 1.0);
        // There is nothing to sample.
        assert_eq!(of([0.0; 2]), LEAST);
    }
}
