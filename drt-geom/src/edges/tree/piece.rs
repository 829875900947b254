//! One segment as it is kept, and what of it counts from a viewpoint.

use drt_math::Vec3;

use crate::edges::tree::Segment;
use crate::edges::tree::glint::Glints;
use crate::edges::tree::kernel::Kernel;
use crate::edges::tree::view::{Viewpoint, Way};

/// Products this small against their factors may have either sign.
const SLACK: f64 = 1e-9;

/// A segment of positive length and some weight.
#[derive(Clone, Copy, Debug)]
pub(super) struct Piece {
    pub(super) line: Line,
    pub(super) faces: [Vec3; 2],
    pub(super) open: bool,
    pub(super) discontinuity: f64,
    pub(super) crease: [f64; 2],
}

/// What there is to draw a point on.
#[derive(Clone, Copy, Debug)]
#[repr(align(64))]
pub(super) struct Line {
    pub(super) a: Vec3,
    /// Unit.
    pub(super) tangent: Vec3,
    pub(super) length: f64,
    /// Its number among the caller's segments.
    pub(super) edge: u32,
}

/// The part of a segment that counts from a viewpoint.
#[derive(Clone, Copy, Debug)]
pub(super) struct Stretch {
    kernel: Kernel,
    glints: Glints,
    /// Where the segment starts, measured along its line from where that is nearest to x.
    start: f64,
    length: f64,
}

impl Piece {
    /// `None` for a segment on which nothing ever counts, or one that is not finite.
    pub(super) fn new(segment: &Segment, edge: u32) -> Option<Self> {
        let &Segment { a, b, faces, open, discontinuity, crease } = segment;
        let length = (b - a).length();
        let tangent = (b - a) / length;
        let crease = if open { [0.0; 2] } else { crease };
        let priors = [discontinuity, crease[0], crease[1]];
        let faces = if open { [faces[0]; 2] } else { faces };
        let usable = tangent.is_finite()
            && length > 0.0
            && faces.iter().all(|n| n.is_finite())
            && priors.iter().all(|p| p.is_finite() && *p >= 0.0)
            && priors.iter().any(|p| *p > 0.0);
        let line = Line { a, tangent, length, edge };
        usable.then_some(Self { line, faces, open, discontinuity, crease })
    }

    /// Its length times what it counts for at most.
    pub(super) fn most(&self) -> f64 {
        self.line.length * self.discontinuity.max(self.crease[0]).max(self.crease[1])
    }
}

impl Line {
    pub(super) fn ends(&self) -> [Vec3; 2] {
        [self.a, self.a + self.tangent * self.length]
    }

    /// What of it counts: the part above the horizon, and, one way of looking, in the cone and near
    /// enough.
    pub(super) fn stretch(&self, view: &Viewpoint, way: &Way, slack: f64) -> Option<Stretch> {
        let to = self.a - view.x;
        let mut part = [0.0, self.length];
        if let Some((n, false)) = view.normal {
            let tolerance = SLACK * (one_norm(to) + self.length) + slack;
            part = above(n.dot(to) + tolerance, n.dot(self.tangent), part)?;
        }
        if let Some(cone) = &way.cone {
            part = cone.clip(to, self.tangent, part)?;
        }
        let start = to.dot(self.tangent);
        let foot = to - self.tangent * start;
        let kernel = Kernel::new(foot.length(), start + part[0], start + part[1]);
        let within = kernel.distance() <= way.reach;
        let glints = || Glints::new(view, &kernel, foot, self.tangent);
        within.then(|| Stretch { kernel, glints: glints(), start, length: self.length })
    }
}

impl Stretch {
    /// How far along the segment the point for a uniform number lies, as a part of its length.
    pub(super) fn sample(&self, u: f64) -> f64 {
        ((self.glints.sample(&self.kernel, u) - self.start) / self.length).clamp(0.0, 1.0)
    }

    /// Density per length there; 0 outside the part that counts.
    pub(super) fn pdf(&self, u: f64) -> f64 {
        let t = self.start + u * self.length;
        let Kernel { near, far, .. } = self.kernel;
        // Rounding must not carry a sample out of its own density's support.
        let slip = 1e-14 * (self.start.abs() + self.length);
        let within = (near - slip..=far + slip).contains(&t);
        if within { self.glints.pdf(&self.kernel, t) } else { 0.0 }
    }
}

/// The part of `[s0, s1]` on which `value + s slope` is positive.
fn above(value: f64, slope: f64, [s0, s1]: [f64; 2]) -> Option<[f64; 2]> {
    let zero = -value / slope;
    let part = match (value + s0 * slope > 0.0, value + s1 * slope > 0.0) {
        (true, true) => [s0, s1],
        (true, false) => [s0, zero.clamp(s0, s1)],
        (false, true) => [zero.clamp(s0, s1), s1],
        (false, false) => return None,
    };
    (part[0] < part[1]).then_some(part)
}

/// Bounds the products of a vector with any unit vector.
fn one_norm(v: Vec3) -> f64 {
    v.x.abs() + v.y.abs() + v.z.abs()
}
