//! Rays that turn with the critical angle of total reflection.
//!
//! Let h be the squared cosine of the angle of refraction where a chain leaves glass. Where h is small, a part of light like √h is
//! refracted, in a direction that moves like √h. At h = 0 nothing jumps, and no edge is there. But derivatives by anything else grow like
//! ḣ/√h, and their square like 1/h: over the first ray's direction u, its integral is a logarithm, which a few samples of millions carry.
//!
//! h is a smooth function of u, and so are its gradient g and its rate ḣ at fixed u. If the first ray turns at
//!
//! ```text
//! V = -ḣ g / |g|²,
//! ```
//!
//! h does not change, and neither does what goes like its root. V is added to the sum over the [edges behind the chain](super::behind_chains),
//! with the weight
//!
//! ```text
//! w = 8 (1 - q / tan² Δ)²,    q = h² / |g|².
//! ```
//!
//! √q is the angle between the ray and the curve h = 0. The weights of edges are infinite on the edge. This one need not be, and must not:
//! light that goes round in a ball meets it at nearly the same angle each time, so that such curves lie close together, each with its own
//! velocity. Between infinite weights V would go from one to the other within the distance between them. With these, a ninth of the
//! derivative at rest is left on a single curve, and a hundredth of its square.
//!
//! Where normals are interpolated, g and ḣ jump at creases, and V is blended with that by evened derivatives, as behind edges. Only exits
//! into a thinner medium and reflections inside of the denser one have such a curve.

use drt_math::Real;

use crate::derivative::velocity::{ByU, RayByU, RayVelocity};

/// The weight on the curve itself.
const MOST: f64 = 8.0;

/// The critical angle beside a point where a chain leaves a denser medium, or is reflected inside of it.
pub(super) struct CriticalAngle {
    /// What the rate of the squared cosine turns the first ray by, from evened derivatives and from others: (1 - ψ) g' / |g'|² and ψ g / |g|².
    pub(super) inverses: [[ByU; 2]; 2],
    pub(super) weight: ByU,
}

impl CriticalAngle {
    /// It, if a turn by less than the angle with a squared tangent leads there. `evened` has the continuous derivatives by u and B, where others jump.
    pub(super) fn beside(
        ray: &RayByU,
        evened: Option<([RayVelocity; 2], ByU)>,
        square: f64,
    ) -> Option<Self> {
        let of = |by_u: &[RayVelocity; 2]| {
            let gradient = by_u.map(|rate| rate.beyond);
            let length = gradient[0].squared() + gradient[1].squared();
            let inverse = gradient.map(|g| g / length);
            (length.re > 0.0).then(|| (inverse, ray.beyond.squared() / length))
        };
        let (inverse, near) = of(evened.as_ref().map_or(&ray.by_u, |(rates, _)| rates))?;
        if near.re >= square {
            return None;
        }
        let inverses = match evened {
            None => [[ByU::from(0.0); 2], inverse],
            Some((_, inside)) => {
                let (own, near_own) = of(&ray.by_u)?;
                let exact = inside.squared() / (inside.squared() + (near + near_own) / square);
                [inverse.map(|v| v * (ByU::from(1.0) - exact)), own.map(|v| v * exact)]
            }
        };
        Some(Self { inverses, weight: (ByU::from(1.0) - near / square).squared() * MOST })
    }
}

#[cfg(test)]
mod tests {
    use drt_math::Vec3;

    use super::*;

    /// A ray that turns at V keeps h, and the weight is largest on the curve.
    #[test]
    fn turned_rays_keep_their_angle_of_refraction() {
        let still = Vec3::zero();
        let rate = |beyond: f64| RayVelocity { x: still, w: still, beyond: beyond.into() };
        let at =
            |h: f64| RayByU { x: still, w: still, beyond: h.into(), by_u: [rate(0.3), rate(-0.4)] };
        let on_curve = CriticalAngle::beside(&at(0.0), None, 0.01).unwrap();
        assert!((on_curve.weight.re - MOST).abs() < 1e-12);
        let near = CriticalAngle::beside(&at(0.02), None, 0.01).unwrap();
        assert!(near.weight.re > 0.0 && near.weight.re < MOST);
        let (change, [evened, own]) = (0.7, near.inverses);
        let turn = own.map(|v| -change * v.re);
        assert!((change + 0.3 * turn[0] - 0.4 * turn[1]).abs() < 1e-12);
        assert!(evened.iter().all(|v| v.re == 0.0));
        assert!(CriticalAngle::beside(&at(0.06), None, 0.01).is_none());
    }
}
