//! φ of lamps, and of media whose boundary moves by one affine field.
//!
//! At fixed directions, a lamp that moves changes nothing but its rim: what it lights has a derivative that is
//! the sum of large terms of either sign, one for each edge. That is by far noisier than the
//! derivative of the geometric term, which φ = 1 on the lamp gives, but for two cases:
//!
//! * where light is scattered into lobes narrower than the lamp. These move their peak across its points, while
//!   its rim is in the dark;
//! * beside the lamp. At the distance r its points pass at a rate of 1 / r, which has no second moment over
//!   a medium that touches it.
//!
//! With w the width of lobes, R the lamp's radius, c its centre, and d the distance of a viewer x from its box,
//!
//! ```text
//! φ = w² / (w² + (1 - w²) R² / |c - x|²)  min(d² / (0.4 R)², 1),
//! ```
//!
//! the same for all points that the viewer sees of it.
//!
//! At fixed directions and distances the vertices of a medium that moves stand still, and all of the change is where
//! rays enter and leave it: a [flux](crate::terms::flux) that grows as 1 / cosine where they graze, whose second moment diverges like a
//! logarithm over all viewers. Vertices that move with their medium, by the field which all that bounds it moves by (see
//! [`medium_motion`](crate::derivative::medium_motion)), have no flux. The depth of a vertex below the surface changes with the direction it is
//! seen in, as depth / cosine over the distance, and depths are a mean free path or so. So
//!
//! ```text
//! φ = min(d² / (0.4 R)², 1)
//! ```
//!
//! as seen from outside of the medium, whatever the lobes. Vertices that see others of the same medium propagate
//! the velocity of these: all of it in a translation.

use drt_geom::Aabb;
use drt_math::Vec3;

/// How near is beside it, in radii.
const NEAR: f64 = 0.4;

/// A lamp or medium, all points of which have the same φ for a viewer.
#[derive(Clone, Copy, Debug)]
pub(super) struct BlendRegion {
    bounds: Aabb,
    radius2: f64,
    /// What φ is multiplied by.
    pub(super) strength: f64,
}

impl BlendRegion {
    pub(super) fn new(bounds: Aabb) -> Self {
        let radius2 = 0.25 * (bounds.max - bounds.min).length_squared();
        Self { bounds, radius2, strength: 1.0 }
    }

    /// φ as seen from `x`, of a medium.
    pub(super) fn weight(&self, x: Vec3) -> f64 {
        let outside = (x - x.max(self.bounds.min).min(self.bounds.max)).length_squared();
        if outside == 0.0 {
            return 0.0;
        }
        self.strength * f64::min(outside / (NEAR * NEAR * self.radius2), 1.0)
    }

    /// φ as seen from `x`, of a lamp, where light is scattered into lobes of a `width`, of at most 1.
    pub(super) fn weight_in_lobes(&self, x: Vec3, width: f64) -> f64 {
        let (weight, w2) = (self.weight(x), width * width);
        if weight == 0.0 || w2 == 0.0 {
            return 0.0;
        }
        let narrow = (1.0 - w2) * self.radius2 / (self.bounds.center() - x).length_squared();
        weight * w2 / (w2 + narrow)
    }
}

#[cfg(test)]
mod tests {
    use drt_math::vec3;

    use super::*;

    /// The rate at which points of a lamp pass, times φ, is bounded beside it and from all around.
    #[test]
    fn beside_a_lamp_the_weight_vanishes() {
        let lamp = BlendRegion::new(Aabb { min: vec3(-1.0, 0.0, -2.0), max: vec3(1.0, 0.0, 2.0) });
        let radius = 5.0_f64.sqrt();
        for direction in [vec3(0.0, 1.0, 0.0), vec3(0.0, -1.0, 0.0)] {
            for power in -12..4 {
                let distance = f64::powi(10.0, power);
                let weight = lamp.weight(vec3(0.3, 0.0, 1.9) + direction * distance);
                assert!(weight / distance <= 1.0001 / (NEAR * radius), "{distance} {weight}");
            }
        }
        assert_eq!(lamp.weight(vec3(0.2, 0.0, 0.1)), 0.0);
    }

    /// Unless lobes are narrower than what is seen of it.
    #[test]
    fn far_from_a_lamp_the_weight_is_one() {
        let lamp = BlendRegion::new(Aabb { min: Vec3::ZERO, max: vec3(1.0, 1.0, 0.0) });
        let far = lamp.bounds.center() + vec3(0.0, 0.0, 10.0);
        let angle = 0.5_f64.sqrt() / 10.0;
        assert_eq!(lamp.weight_in_lobes(far, 1.0), 1.0);
        assert!((lamp.weight_in_lobes(far, angle) - 0.5).abs() < 0.01);
        assert!(lamp.weight_in_lobes(far, 0.1 * angle) < 0.011);
        assert_eq!(lamp.weight_in_lobes(far, 0.0), 0.0);
    }
}
