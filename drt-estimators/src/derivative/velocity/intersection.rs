//! The velocity of a line along which two surfaces intersect.
//!
//! A point of the line of surfaces a and b stays on both: of its velocity u the normals of the two tell what theirs at the
//! point, v_a and v_b, have along them, and nothing moves it along the line,
//!
//! ```text
//! n_a·u = n_a·v_a,    n_b·u = n_b·v_b,    t·u = 0,
//! u = d_a (n_a·v_a) + d_b (n_b·v_b),    d_a = (n_a - c n_b) / (1 - c²),    c = n_a·n_b,
//! ```
//!
//! and d_b likewise.

use drt_math::Vec3;

use crate::world::vertex::MaterialPoint;

/// A material point, and how the velocity of a point of an edge depends on that of it; where surfaces intersect it does on two.
#[derive(Clone, Copy, Debug)]
pub(crate) struct EdgeMatter {
    pub(crate) point: MaterialPoint,
    /// `None` where the edge moves with its matter.
    across: Option<Across>,
}

/// The part d (n·v) of a velocity v.
#[derive(Clone, Copy, Debug)]
struct Across {
    n: Vec3,
    d: Vec3,
}

impl EdgeMatter {
    /// Of an edge that moves with its matter.
    pub(crate) fn of(point: MaterialPoint) -> Self {
        Self { point, across: None }
    }

    /// Of a line on two surfaces, from a point of each and their unit normals there.
    pub(crate) fn of_intersection(points: [MaterialPoint; 2], normals: [Vec3; 2]) -> [Self; 2] {
        let [a, b] = normals;
        let c = a.dot(b);
        let part = |point, n: Vec3, other: Vec3| {
            let d = (n - other * c) / (1.0 - c * c);
            Self { point, across: Some(Across { n, d }) }
        };
        let [p, q] = points;
        [part(p, a, b), part(q, b, a)]
    }

    /// What multiplies the point's velocity in `g·u`.
    pub(crate) fn pull(&self, g: Vec3) -> Vec3 {
        match self.across {
            None => g,
            Some(Across { n, d }) => n * d.dot(g),
        }
    }

    /// What a velocity of the point adds to that of the edge.
    pub(crate) fn push(&self, v: Vec3) -> Vec3 {
        match self.across {
            None => v,
            Some(Across { n, d }) => d * n.dot(v),
        }
    }
}

#[cfg(test)]
mod tests {
    use drt_math::{Rng, vec3};

    use super::*;

    /// A point that moves so stays on both planes, to first order.
    #[test]
    fn the_point_stays_on_both_surfaces() {
        let mut rng = Rng::new(8, 0, 0);
        let mut next = || vec3(rng.next_f64() - 0.5, rng.next_f64() - 0.5, rng.next_f64() - 0.5);
        let at = drt_motion::SurfacePoint { triangle: 0, bary: [0.0; 2] };
        let points = [0, 1].map(|shape| MaterialPoint { shape, at });
        for _ in 0..100 {
            let [a, b] = [next().normalize(), next().normalize()];
            let velocities = [next(), next()];
            let matter = EdgeMatter::of_intersection(points, [a, b]);
            let moved = matter.iter().zip(velocities).map(|(m, v)| m.push(v));
            let u = moved.fold(Vec3::ZERO, |sum, u| sum + u);
            let scale = 1e-9 * (1.0 + u.length());
            assert!(
                a.dot(u - velocities[0]).abs() < scale && b.dot(u - velocities[1]).abs() < scale
            );
            assert!(a.cross(b).dot(u).abs() < scale);
            let g = next();
            let pulled = matter.iter().zip(velocities).map(|(m, v)| m.pull(g).dot(v));
            assert!((pulled.sum::<f64>() - g.dot(u)).abs() < scale);
        }
    }
}
