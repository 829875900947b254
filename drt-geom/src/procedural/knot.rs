use core::f64::consts::TAU;

use drt_math::{Frame, fm, vec3};

use super::mesh;
use super::tube::{Tube, transport};
use crate::Mesh;

/// The shape of a [`torus_knot`].
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct TorusKnot {
    /// Turns about the torus's axis.
    pub p: u32,
    /// Turns about the torus's core; coprime to `p` for a single strand.
    pub q: u32,
    /// Radius of the torus's core circle, in the plane z = 0.
    pub major: f64,
    /// Distance of the knot from the core circle.
    pub minor: f64,
    /// Radius of the tube around the knot.
    pub tube: f64,
    /// Rings along the knot.
    pub segments: u32,
    /// Vertices per ring.
    pub sides: u32,
}

impl Default for TorusKnot {
    /// The trefoil, 256 × 16.
    fn default() -> Self {
        Self { p: 2, q: 3, major: 1.0, minor: 0.4, tube: 0.15, segments: 256, sides: 16 }
    }
}

/// A closed tube along the (p, q) torus knot: much self-shadowing and silhouettes of all kinds.
#[must_use]
pub fn torus_knot(shape: &TorusKnot) -> Mesh {
    let (p, q) = (f64::from(shape.p.max(1)), f64::from(shape.q));
    let (segments, sides) = (shape.segments.max(3), shape.sides.max(3));
    let curve = |s: f64| {
        let ((sp, cp), (sq, cq)) = (fm::sin_cos(p * s), fm::sin_cos(q * s));
        let r = shape.major + shape.minor * cq;
        let rate = -shape.minor * q * sq;
        let point = vec3(r * cp, r * sp, shape.minor * sq);
        let tangent =
            vec3(rate * cp - r * p * sp, rate * sp + r * p * cp, shape.minor * q * cq).normalize();
        (point, tangent)
    };
    let at = |i: u32| curve(TAU * f64::from(i) / f64::from(segments));

    let mut tube = Tube::default();
    let start = Frame::from_normal(at(0).1);
    let mut frame = start;
    for i in 0..segments {
        let (point, tangent) = at(i);
        frame = transport(&frame, tangent);
        tube.ring(point, &frame, shape.tube, sides);
        if i > 0 {
            tube.join((i - 1) * sides, i * sides, sides, 0);
        }
    }
    // Carried once around, the frame comes back turned; the last joint takes up the whole steps.
    let back = transport(&frame, start.n);
    let turn = fm::atan2(start.t.dot(back.s), start.s.dot(back.s));
    let steps = fm::round(turn * f64::from(sides) / TAU) as i64;
    let twist = steps.rem_euclid(i64::from(sides)) as u32;
    tube.join((segments - 1) * sides, 0, sides, twist);
    mesh(tube.positions, tube.triangles)
}
