//! One segment as it is kept, and what of it counts from a viewpoint.

use drt_math::{Real, Vec3};

use super::Segment;
use super::kernel::Kernel;
use super::view::{ALMOST_NOTHING, Viewpoint};

/// Products this small against their factors may have either sign.
pub(super) const SLACK: f64 = 1e-9;

/// A segment of positive length and some weight.
#[derive(Clone, Copy, Debug)]
pub(super) struct Piece {
    pub(super) a: Vec3,
    /// Unit.
    pub(super) tangent: Vec3,
    pub(super) length: f64,
    pub(super) faces: [Vec3; 2],
    pub(super) open: bool,
    /// Its number among the caller's.
    pub(super) edge: u32,
    pub(super) jump: f64,
    pub(super) crease: [f64; 2],
}

/// The part of a segment that counts from a viewpoint.
#[derive(Clone, Copy, Debug)]
pub(super) struct Stretch {
    kernel: Kernel,
    /// Where the segment starts, measured along its line from where that is nearest to x.
    start: f64,
    length: f64,
    prior: f64,
    /// From x to the nearest point of the line.
    nearest: Vec3,
    tangent: Vec3,
}

impl Piece {
    /// `None` for a segment on which nothing ever counts, or one that is not finite.
    pub(super) fn new(segment: &Segment, edge: u32) -> Option<Self> {
        let &Segment { a, b, faces, open, jump, crease } = segment;
        let length = (b - a).length();
        let tangent = (b - a) / length;
        let crease = if open { [0.0; 2] } else { crease };
        let priors = [jump, crease[0], crease[1]];
        let faces = if open { [faces[0]; 2] } else { faces };
        let usable = tangent.is_finite()
            && length > 0.0
            && faces.iter().all(|n| n.is_finite())
            && priors.iter().all(|p| p.is_finite() && *p >= 0.0)
            && priors.iter().any(|p| *p > 0.0);
        usable.then_some(Self { a, tangent, length, faces, open, edge, jump, crease })
    }

    pub(super) fn end(&self) -> Vec3 {
        self.a + self.tangent * self.length
    }

    /// Its length times what it counts for at most.
    pub(super) fn most(&self) -> f64 {
        self.length * self.jump.max(self.crease[0]).max(self.crease[1])
    }

    /// Light it may let through or hide as seen from where it lies `to` away; all that it may where
    /// rounding leaves it open on which side of a face that is.
    fn prior(&self, to: Vec3, slack: f64) -> f64 {
        if self.open {
            return self.jump;
        }
        let tolerance = SLACK * one_norm(to) + slack;
        let [(front0, back0), (front1, back1)] = self.faces.map(|n| {
            let side = -n.dot(to);
            (side > -tolerance, side < tolerance)
        });
        let of = |may: bool, prior: f64| if may { prior } else { 0.0 };
        of((front0 && back1) || (back0 && front1), self.jump)
            + of(front0 && front1, self.crease[0])
            + of(back0 && back1, self.crease[1])
    }

    /// What it amounts to.
    pub(super) fn weigh(&self, view: &Viewpoint, slack: f64) -> f64 {
        self.stretch(view, slack).map_or(0.0, |s| s.weight(view))
    }

    /// What of it counts: the part above the horizon and in the cone.
    pub(super) fn stretch(&self, view: &Viewpoint, slack: f64) -> Option<Stretch> {
        let to = self.a - view.x;
        let prior = self.prior(to, slack);
        if prior <= 0.0 {
            return None;
        }
        let mut part = [0.0, self.length];
        if let Some((n, false)) = view.normal {
            let tolerance = SLACK * (one_norm(to) + self.length) + slack;
            part = above(n.dot(to) + tolerance, n.dot(self.tangent), part)?;
        }
        if let Some(cone) = &view.cone {
            part = cone.clip(to, self.tangent, part)?;
        }
        let start = to.dot(self.tangent);
        let nearest = to - self.tangent * start;
        let kernel = Kernel::new(nearest.length(), start + part[0], start + part[1]);
        if kernel.distance() > view.reach {
            return None;
        }
        Some(Stretch { kernel, start, length: self.length, prior, nearest, tangent: self.tangent })
    }
}

impl Stretch {
    /// What it amounts to: the kernel's integral, less than exactly where that makes no difference.
    fn weight(&self, view: &Viewpoint) -> f64 {
        let Kernel { near, far, .. } = self.kernel;
        let size2 = (far - near) * (far - near) * (1.0 / 12.0);
        let scattering = |t: f64| {
            let to = self.nearest + self.tangent * t;
            let r2 = to.length_squared();
            let cosine = view
                .normal
                .map_or(1.0, |(n, _)| f64::abs(n.dot(to)) / Real::sqrt(r2).max(f64::MIN_POSITIVE));
            view.lobes.toward(to, r2, size2, cosine.max(ALMOST_NOTHING))
        };
        let (mass, scattering) = match self.kernel.of_short() {
            Some((middle, mass)) => (mass, scattering(middle)),
            None => {
                let ends = 0.25 * (scattering(near) + scattering(far));
                (self.kernel.mass(), ends + 0.5 * scattering(self.kernel.sample(0.5)))
            }
        };
        self.prior * mass * scattering
    }

    /// How far along the segment the point for a uniform number lies, as a part of its length.
    pub(super) fn sample(&self, u: f64) -> f64 {
        ((self.kernel.sample(u) - self.start) / self.length).clamp(0.0, 1.0)
    }

    /// Density per length there; 0 outside the part that counts.
    pub(super) fn pdf(&self, u: f64) -> f64 {
        let t = self.start + u * self.length;
        let Kernel { near, far, .. } = self.kernel;
        // Rounding must not carry a sample out of its own density's support.
        let slip = 1e-14 * (self.start.abs() + self.length);
        let within = (near - slip..=far + slip).contains(&t);
        if within { self.kernel.pdf(t) } else { 0.0 }
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
pub(super) fn one_norm(v: Vec3) -> f64 {
    v.x.abs() + v.y.abs() + v.z.abs()
}
