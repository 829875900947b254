//! How lamps hold the points from which they light others.
//!
//! At fixed directions, a lamp that moves changes nothing but its rim: what it lights has a derivative that is
//! the sum of large terms of either sign, one for each edge. Next to it that is by far noisier than the
//! derivative of the geometric term, which holding the lamp's points gives. But from where light is scattered into
//! lobes narrower than the lamp, the latter moves a peak across its points, and its rim is in the dark. With
//! w the width of lobes and Θ the angle of the lamp,
//!
//! ```text
//! φ = w² / (w² + (1 - w²) Θ²),
//! ```
//!
//! the same for all points that a viewer sees of it.

use drt_geom::Aabb;
use drt_math::Vec3;

/// Where a lamp is.
#[derive(Clone, Copy, Debug)]
pub(super) struct Lamp {
    center: Vec3,
    radius2: f64,
    /// What its shares are multiplied by.
    pub(super) strength: f64,
}

impl Lamp {
    pub(super) fn new(bounds: &Aabb) -> Self {
        let half = (bounds.max - bounds.min) * 0.5;
        Self { center: bounds.center(), radius2: half.length_squared(), strength: 1.0 }
    }

    /// φ as seen from `x`, where light is scattered into lobes of a `width`, of at most 1.
    pub(super) fn share(&self, x: Vec3, width: f64) -> f64 {
        let w2 = width * width;
        let narrow = (1.0 - w2) * self.radius2 / (self.center - x).length_squared();
        if w2 > 0.0 { self.strength * w2 / (w2 + narrow) } else { 0.0 }
    }
}
