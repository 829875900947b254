//! How near a direction is to an edge, as it is seen from a point.

use drt_math::Vec3;

use crate::derivative::velocity::Weight;

/// An edge as a viewer sees it, beside a direction ω. Gradients are by ω, across it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Beside {
    /// Squared sine of the angle between ω and the edge.
    pub(super) square: Weight,
    /// How far along the edge its nearest point is, from 0 to 1.
    pub(super) along: Weight,
    /// Distance of that point from the viewer, in scene units.
    pub(super) distance: Weight,
    /// The point, less the viewer's place.
    pub(super) place: Vec3,
    /// Where the point is no end: the unit normal of the plane of edge and viewer.
    pub(super) normal: Option<Vec3>,
}

impl Beside {
    /// Of an edge by its ends less the viewer's place, and the unit direction ω; `None` at right angles and more.
    pub(super) fn new(ends: [Vec3; 2], w: Vec3) -> Option<Self> {
        let [a, b] = ends;
        let side = b - a;
        let n = a.cross(b);
        let flat = n.length();
        if flat > 1e-12 * (a.length_squared() + b.length_squared()) {
            let n = n / flat;
            // The plane of edge and viewer meets ω's half-plane across it where (a + s side) × ω has no part along n.
            let (to_start, to_side) = (a.cross(n), side.cross(n));
            let (start, rate) = (w.dot(to_start), w.dot(to_side));
            let s = -start / rate;
            let at = a + side * s;
            if (0.0..=1.0).contains(&s) && at.dot(w) > 0.0 {
                let sine = n.dot(w);
                let along = (to_start + to_side * s).reject(w) * (-1.0 / rate);
                let distance = at.length();
                return Some(Self {
                    square: Weight { value: sine * sine, gradient: n.reject(w) * (2.0 * sine) },
                    along: Weight { value: s, gradient: along },
                    distance: Weight {
                        value: distance,
                        gradient: along * (at.dot(side) / distance),
                    },
                    place: at,
                    normal: Some(n),
                });
            }
        }
        let [ra, rb] = [a.length(), b.length()];
        let [ca, cb] = [a.dot(w) / ra, b.dot(w) / rb];
        let (end, distance, cosine, along) =
            if ca >= cb { (a / ra, ra, ca, 0.0) } else { (b / rb, rb, cb, 1.0) };
        // Squared as a product, the sine keeps its digits.
        let square = end.cross(w).length_squared();
        (cosine > 0.0).then(|| Self {
            square: Weight { value: square, gradient: (end - w * cosine) * (-2.0 * cosine) },
            along: Weight::constant(along),
            distance: Weight::constant(distance),
            place: end * distance,
            normal: None,
        })
    }

    /// Seen from infinity along the unit direction ω, beside the line through a point x. `ends` and `place` are less x,
    /// `distance` is the `scale`, and so far does x move across ω to each radian.
    pub(super) fn from_infinity(ends: [Vec3; 2], w: Vec3, scale: f64) -> Self {
        let [a, b] = ends;
        let side = b - a;
        let across = side.reject(w);
        let s = -a.dot(across) / across.length_squared();
        let (along, slope) = match s {
            _ if s > 0.0 && s < 1.0 => (s, across * (scale / across.length_squared())),
            _ if s >= 1.0 => (1.0, Vec3::ZERO),
            _ => (0.0, Vec3::ZERO),
        };
        let place = a + side * along;
        let beside = place.reject(w) / scale;
        Self {
            square: Weight { value: beside.length_squared(), gradient: beside * -2.0 },
            along: Weight { value: along, gradient: slope },
            distance: Weight::constant(scale),
            place,
            normal: None,
        }
    }
}

#[cfg(test)]
mod tests {
    use drt_math::{Frame, Rng, vec3};

    use super::*;

    fn point(rng: &mut Rng) -> Vec3 {
        vec3(rng.next_f64() - 0.5, rng.next_f64() - 0.5, rng.next_f64() - 0.5) * 4.0
    }

    /// The angle is that to the nearest point, and gradients are those of differences.
    #[test]
    fn gradients_are_differences() {
        let mut rng = Rng::new(11, 0, 0);
        let mut ends_nearest = 0;
        for _ in 0..500 {
            let ends = [point(&mut rng), point(&mut rng)];
            let w = point(&mut rng).normalize();
            let Some(found) = Beside::new(ends, w) else { continue };
            let sampled = (0..=20_000).map(|i| {
                let at = ends[0] + (ends[1] - ends[0]) * (f64::from(i) / 20_000.0);
                at.dot(w) / at.length()
            });
            let nearest = sampled.fold(-1.0, f64::max);
            assert!((1.0 - found.square.value - nearest * nearest).abs() < 1e-6);
            ends_nearest += i32::from(found.along.gradient == Vec3::ZERO);
            let frame = Frame::from_normal(w);
            for t in [frame.s, frame.t] {
                let h = 1e-6;
                let at = |h: f64| Beside::new(ends, (w + t * h).normalize());
                let (Some(p), Some(m)) = (at(h), at(-h)) else { continue };
                // Ends become nearest at kinks.
                if (p.along.gradient == Vec3::ZERO) != (m.along.gradient == Vec3::ZERO) {
                    continue;
                }
                for (g, difference) in [
                    (found.square.gradient, p.square.value - m.square.value),
                    (found.along.gradient, p.along.value - m.along.value),
                    (found.distance.gradient, p.distance.value - m.distance.value),
                ] {
                    let difference = difference / (2.0 * h);
                    let scale = 1.0 + difference.abs();
                    assert!(
                        (g.dot(t) - difference).abs() < 1e-4 * scale * scale,
                        "{g:?} {difference}"
                    );
                }
            }
        }
        assert!(ends_nearest > 50, "{ends_nearest}");
    }

    #[test]
    fn seen_end_on_an_edge_is_a_point() {
        let w = vec3(0.1, 0.0, 1.0).normalize();
        let found = Beside::new([vec3(0.0, 0.0, 1.0), vec3(0.0, 0.0, 3.0)], w).unwrap();
        assert!((found.square.value - 0.01 / 1.01).abs() < 1e-12);
        assert!(Beside::new([vec3(0.0, 0.0, -1.0), vec3(0.0, 0.0, -3.0)], w).is_none());
    }
}
