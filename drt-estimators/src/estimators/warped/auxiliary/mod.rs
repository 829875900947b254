//! Velocities that are smoothed from what auxiliary rays hit, as published.
//!
//! Samples are drawn around a vertex or a ray. Each has a velocity v_dis, discontinuous from sample to sample, of what
//! is seen or occludes there. The velocity v of the vertex is their mean with weights w that diverge where the sample
//! lies on a boundary and the vertex beside it (2023 paper, Eqs. 14 and 41; theory sheet §9.1),
//!
//! ```text
//! v = V / W,    div v = dV / W - (∇W·V) / W²,    W = Σ w/pdf,  V = Σ w v_dis / pdf,  dV = Σ ∇w·v_dis / pdf,
//! ```
//!
//! (Eqs. 44–47 and 58–62), with gradients with respect to the vertex at fixed samples: the summand w div v_dis of Eq.
//! 61 must be left out (theory sheet §12.32). A ratio of two estimates is biased, by O(1/N) for many samples N, however
//! many paths there are. The bias is removed by a sum over doubled numbers of samples, of which one term is drawn: with
//! r(S) the ratio V / W from a set S of samples,
//!
//! ```text
//! v = r(first N) + [r(all 2^k N) - (r(first half) + r(second half)) / 2] / P(k),    P(k) ∝ 2^(-3k/2).
//! ```

pub(super) mod directions;
mod kernel;
pub(super) mod points;
mod rims;

use core::ops::Range;

use drt_math::{Rng, Vec3, fm};

use crate::model::settings::AuxiliarySamples;

/// Ratio of the probabilities of one doubling and the one before.
const DOUBLING: f64 = 0.353_553_390_593_273_8;

/// Doublings at most.
const MOST: u32 = 12;

/// What one auxiliary sample tells.
#[derive(Clone, Copy, Debug)]
struct Sample<V> {
    /// w over the density of the sample.
    weight: f64,
    /// Its gradient by the vertex, or by the direction.
    gradient: Vec3,
    /// v_dis; `None` where it vanishes.
    velocity: Option<V>,
}

/// Calls `add` with each velocity and its coefficients in v and, dotted with it, in div v.
fn ratio<V: Copy>(samples: &[Sample<V>], scale: f64, mut add: impl FnMut(V, f64, Vec3)) {
    let sum: f64 = samples.iter().map(|s| s.weight).sum();
    if sum.is_nan() || sum <= 0.0 {
        return;
    }
    let slope = samples.iter().fold(Vec3::ZERO, |all, s| all + s.gradient) / sum;
    for s in samples {
        let Some(velocity) = s.velocity else { continue };
        let share = scale / sum;
        add(velocity, s.weight * share, (s.gradient - slope * s.weight) * share);
    }
}

/// How many samples are taken, and which sets of them make a velocity, each with its factor.
fn plan(asked: &AuxiliarySamples, rng: &mut Rng) -> (u32, [(Range<f64>, f64); 4]) {
    let none = (0.0..0.0, 0.0);
    let AuxiliarySamples { count, debiased, .. } = *asked;
    if !debiased {
        return (count, [(0.0..1.0, 1.0), none.clone(), none.clone(), none]);
    }
    let u = f64::max(1.0 - rng.next_f64(), f64::MIN_POSITIVE);
    let doublings = u32::min((fm::ln(u) / fm::ln(DOUBLING)) as u32, MOST - 1) + 1;
    let tail = if doublings == MOST { 1.0 } else { 1.0 - DOUBLING };
    let inverse = 1.0 / (tail * fm::exp(f64::from(doublings - 1) * fm::ln(DOUBLING)));
    let first = 1.0 / f64::from(1 << doublings);
    let sets = [
        (0.0..first, 1.0),
        (0.0..1.0, inverse),
        (0.0..0.5, -0.5 * inverse),
        (0.5..1.0, -0.5 * inverse),
    ];
    (count << doublings, sets)
}
