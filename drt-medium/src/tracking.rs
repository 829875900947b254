//! Unbiased walks through any [`DensityField`]: distances by weighted delta tracking,
//! transmittance by residual ratio tracking.
//!
//! Tentative collisions come from a Poisson process whose rate is the local majorant of all
//! channels together; each is accepted as a scattering event or counted as a null collision. The
//! acceptance probability follows the channel weights collected so far, which is the same in
//! distribution as choosing one channel by its weight, tracking that channel alone and combining
//! all channels with the balance heuristic (Miller, Georgiev and Jarosz 2019, "A null-scattering
//! path integral formulation of light transport", section 5; Kutz et al. 2017, "Spectral and
//! decomposition tracking"). Weights therefore stay below 1 / (probability of the channel), and
//! one density serves extinctions that differ by any factor.

use core::ops::ControlFlow;

use alloc::vec::Vec;
use drt_math::{Rgb, Rng, fm};

use crate::reach::Reach;
use crate::{DensityField, Ray};

/// A sampled distance along a ray.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum DistanceSample {
    /// An event inside the segment.
    Scatter {
        /// Distance from the origin.
        t: f64,
        /// Unbiased estimate of transmittance over density, `T(t) / pdf(t)`; the scattering
        /// coefficient is not in it.
        weight: Rgb,
        /// The density per scene unit, where it is known in closed form.
        pdf: Option<f64>,
    },
    /// No event: light passes the whole segment.
    Pass {
        /// Unbiased estimate of `T(t_max) / P(pass)`.
        weight: Rgb,
    },
}

/// What a walk cost.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct TrackingStats {
    /// Pieces of rays visited.
    pub pieces: u64,
    /// Evaluations of the extinction.
    pub lookups: u64,
}

impl core::ops::AddAssign for TrackingStats {
    fn add_assign(&mut self, o: Self) {
        self.pieces += o.pieces;
        self.lookups += o.lookups;
    }
}

/// Probabilities of following each channel: the nonnegative weights, normalised, with `defensive`
/// parts of equal shares, so that a channel whose weight is zero (but may have a derivative) is
/// still covered. Without any weight all channels are equal.
#[inline]
#[must_use]
pub fn channel_probabilities(channels: Rgb, defensive: f64) -> Rgb {
    let sum = channels.sum();
    let own = if sum > 0.0 && sum.is_finite() { channels / sum } else { Rgb::splat(1.0 / 3.0) };
    own * (1.0 - defensive) + Rgb::splat(defensive / 3.0)
}

/// Samples a distance with a density that is at best proportional to the collision density of the
/// weighted channels.
///
/// `channels` are nonnegative weights, as a rule the path's throughput. With `defensive` > 0, in
/// [0, 1), majorants are at least [`DensityField::majorant_floor`], and events happen at a rate of
/// at least `defensive × floor` wherever the field has a piece: then vertices also fall where the
/// extinction is zero, as derivatives with respect to it need (the aim of differential ratio
/// tracking, Nimier-David et al. 2022, reached with one density instead of a second sample).
/// Weights account for it. With `defensive` zero, a channel of weight zero is not estimated.
pub fn sample_distance<F: DensityField + ?Sized>(
    field: &F,
    ray: &Ray,
    channels: Rgb,
    defensive: f64,
    rng: &mut Rng,
    stats: &mut TrackingStats,
) -> DistanceSample {
    let probabilities = channel_probabilities(channels, defensive);
    let floor = if defensive > 0.0 { field.majorant_floor() } else { 0.0 };
    let mut weight = Rgb::ONE;
    let mut event = None;
    let mut depth = exponential(rng);
    field.pieces(ray, &mut |piece| {
        stats.pieces += 1;
        let mut majorant = f64::max(left(piece.majorant, weight).max_channel(), floor);
        let mut t = piece.start;
        while let Some(next) = next_collision(t, piece.end, majorant, &mut depth) {
            t = next;
            depth = exponential(rng);
            stats.lookups += 1;
            let sigma = left(field.sigma_t(ray.at(t)), weight);
            let accept = acceptance(probabilities * weight.abs(), sigma.abs() / majorant);
            let accept = accept.clamp(defensive * floor / majorant, 1.0);
            if rng.next_f64() < accept {
                event = Some((t, weight / (majorant * accept)));
                return ControlFlow::Break(());
            }
            weight *= sigma.map(|s| (majorant - s) / (majorant * (1.0 - accept)));
            if weight.to_array().iter().any(|w| w.abs() < f64::MIN_POSITIVE) {
                // A dense channel must not hold up an empty one once nothing is left of it.
                weight = weight.map(|w| if w.abs() < f64::MIN_POSITIVE { 0.0 } else { w });
                majorant = f64::max(left(piece.majorant, weight).max_channel(), floor);
            }
        }
        if weight.is_zero() { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    });
    match event {
        Some((t, weight)) => DistanceSample::Scatter { t, weight, pdf: None },
        None => DistanceSample::Pass { weight },
    }
}

/// Unbiased estimate of the transmittance of the whole ray: residual ratio tracking (Novák, Selle
/// and Jarosz 2014) with each piece's minorant as the part integrated in closed form. All
/// channels share their collisions.
pub fn transmittance<F: DensityField + ?Sized>(
    field: &F,
    ray: &Ray,
    rng: &mut Rng,
    stats: &mut TrackingStats,
) -> Rgb {
    let mut weight = Rgb::ONE;
    let mut control = Rgb::ZERO;
    let mut depth = exponential(rng);
    field.pieces(ray, &mut |piece| {
        stats.pieces += 1;
        let length = piece.end - piece.start;
        // An empty channel of an infinite piece: 0 × inf.
        control += piece.minorant.map(|m| if m == 0.0 { 0.0 } else { m * length });
        let mut gap = piece.majorant - piece.minorant;
        if control.max_channel() > DEEPEST {
            // Channels of which nothing is left need no collisions.
            weight = zip(weight, control, |w, c| if c > DEEPEST { 0.0 } else { w });
            gap = left(gap, weight);
        }
        let residual = gap.max_channel();
        let mut t = piece.start;
        while let Some(next) = next_collision(t, piece.end, residual, &mut depth) {
            t = next;
            depth = exponential(rng);
            stats.lookups += 1;
            let sigma = field.sigma_t(ray.at(t)) - piece.minorant;
            weight *= sigma.map(|s| 1.0 - s / residual);
        }
        if weight.is_zero() { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    });
    weight * (-control).exp()
}

/// Optical depth through which nothing gets that an `f64` can hold: its exponential is zero.
const DEEPEST: f64 = 746.0;

/// Points and weights for an unbiased estimate of `∫ h(t) dt` over the parts of the ray that the
/// field covers: `sum w_i h(t_i)`. One random point in each of equal strata; their number grows
/// with the length in units of [`DensityField::feature_size`], between 1 and 16. Appends to `out`.
pub fn line_points<F: DensityField + ?Sized>(
    field: &F,
    ray: &Ray,
    rng: &mut Rng,
    out: &mut Vec<(f64, f64)>,
) {
    let Some((start, end)) = field.covered(ray).filter(|c| c.1 > c.0) else { return };
    const FEATURES_PER_POINT: f64 = 4.0;
    const MOST_POINTS: f64 = 16.0;
    let features = (end - start) / field.feature_size();
    let count = if end.is_finite() && features.is_finite() {
        fm::ceil(features / FEATURES_PER_POINT).clamp(1.0, MOST_POINTS)
    } else {
        MOST_POINTS
    };
    let reach = Reach::new(end - start, 1.0);
    for i in 0..count as u32 {
        let t = reach.sample((f64::from(i) + rng.next_f64()) / count);
        out.push((start + t, 1.0 / (count * reach.pdf(t))));
    }
}

/// A cheap positive stand-in for the density of [`sample_distance`], without randomness: the
/// pieces' mean extinction in place of the field. Meant for weights of multiple importance
/// sampling, where any positive function keeps the estimate unbiased.
pub fn approximate_pdf<F: DensityField + ?Sized>(
    field: &F,
    ray: &Ray,
    t: f64,
    channels: Rgb,
    defensive: f64,
) -> f64 {
    let probabilities = channel_probabilities(channels, defensive);
    let floor = if defensive > 0.0 { defensive * field.majorant_floor() } else { 0.0 };
    let mut depth = Rgb::ZERO;
    let mut rate = Rgb::ZERO;
    field.means(ray, &mut |piece| {
        if piece.start > t {
            return ControlFlow::Break(());
        }
        let mean = piece.mean.map(|m| f64::max(m.abs(), floor));
        depth += mean * (f64::min(piece.end, t) - piece.start);
        rate = if t <= piece.end { mean } else { Rgb::ZERO };
        ControlFlow::Continue(())
    });
    probabilities.dot(rate * (-depth).exp())
}

/// The next tentative collision before `end`, `depth` majorant mean free paths after `t`; without
/// one, `depth` is what is left of it at `end`.
#[inline]
fn next_collision(t: f64, end: f64, majorant: f64, depth: &mut f64) -> Option<f64> {
    if majorant <= 0.0 {
        return None;
    }
    let next = t + *depth / majorant;
    if next < end {
        // Where free paths are shorter than a rounding of t, a walk would stand still at a point that rounding put outside.
        return if next > t { Some(next) } else { Some(t.next_up()).filter(|next| *next < end) };
    }
    *depth = f64::max(*depth - majorant * (end - t), 0.0);
    None
}

/// An extinction in the channels of which something is left.
#[inline]
fn left(sigma: Rgb, weight: Rgb) -> Rgb {
    zip(sigma, weight, |s, w| if w == 0.0 { 0.0 } else { s })
}

/// Mean over channels of the collision probability, weighted by their shares of the walk.
#[inline]
fn acceptance(shares: Rgb, collision: Rgb) -> f64 {
    let total = shares.sum();
    if total > 0.0 { shares.dot(collision) / total } else { collision.mean() }
}

#[inline]
fn exponential(rng: &mut Rng) -> f64 {
    -fm::ln(rng.next_f64())
}

/// A function of two colours, channel by channel.
#[inline]
pub(crate) fn zip(a: Rgb, b: Rgb, f: impl Fn(f64, f64) -> f64) -> Rgb {
    Rgb::new(f(a.r, b.r), f(a.g, b.g), f(a.b, b.b))
}
