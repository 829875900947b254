//! Values that would jump where a normal is across a direction fade before that.

use drt_math::Real;

/// Cosine below which they fade, 0.3° before the horizon: 0.0025 % of a sphere's image.
pub(super) const FADE: f64 = 0.005;

/// The factor of a value at a cosine with the normal.
pub(super) fn fade<T: Real>(cosine: T) -> T {
    (cosine.abs() / FADE).min(T::one())
}
