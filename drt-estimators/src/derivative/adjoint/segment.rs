//! Segments: their geometric terms, the Jacobians of their far ends, and transmittance.
//!
//! Transmittance over a segment x → y of length R (theory sheet §2): with τ = exp(-t),
//!
//! ```text
//! t_dot = (R_dot/R) t + R ∫ [σ_dot + z_dot·∇σ] ds + sum over crossings (σ₋-σ₊) N·(u_c - z_dot) / (N·w)
//! ```
//!
//! Where σ depends on the direction w, w_dot·∫ ∂σ/∂w ds comes on top, with w_dot = (ẏ - ẋ) / R across w between two points.

use drt_math::{Ray, Rgb, RgbVec, Vec3};
use drt_medium::DepthEstimate;

use crate::derivative::adjoint::Differentiator;
use crate::derivative::sensitivity::{AdjointSink, CoefficientAdjoint, SurfaceAdjoint};
use crate::world::vertex::{Kind, Vertex};
use crate::world::{Crossing, Interval, intervals};

/// A segment's far end.
pub(super) enum Far<'a> {
    /// A vertex, with a receiver for its adjoint.
    Vertex(&'a Vertex, &'a mut SurfaceAdjoint),
    /// A point light; its position's adjoint is returned.
    Position,
    /// A fixed direction.
    Direction,
}

/// Sensitivities by the places of the points along a stretch, collected at its ends.
#[derive(Default)]
pub(super) struct Along {
    /// The far end is a fixed direction: points follow the near end alone.
    fixed: bool,
    near: RgbVec,
    far: RgbVec,
    /// By the rate of a fixed direction.
    turn: RgbVec,
}

impl Along {
    /// Adds the gradient by the direction of a stretch of a given length, across it.
    fn add_turn(&mut self, g: &RgbVec, length: f64) {
        if self.fixed {
            self.turn += *g;
        } else {
            let far = *g * (1.0 / length);
            self.near -= far;
            self.far += far;
        }
    }

    /// Adds the gradient by points of a stretch of a given length, and the sum of it times their
    /// distances from the start.
    fn add(&mut self, g: &RgbVec, moment: &RgbVec, length: f64) {
        if self.fixed {
            self.near += *g;
            self.turn += *moment;
        } else {
            let far = *moment * (1.0 / length);
            self.near += *g - far;
            self.far += far;
        }
    }
}

/// A straight stretch of a path.
pub(super) struct Stretch<'a> {
    pub(super) start: Vec3,
    pub(super) dir: Vec3,
    pub(super) length: f64,
    pub(super) medium: Option<usize>,
    pub(super) crossings: &'a [Crossing],
}

impl Differentiator<'_> {
    /// Sensitivities of one stretch between two ends: geometric term, far-end Jacobian and
    /// transmittance, all weighted by the contributions that pass. The near end's go to `near`; the
    /// far end's to its own receiver. Returns that of a point light's position, else what transmittance owes to the rate of
    /// the direction.
    pub(super) fn segment<S: AdjointSink>(
        &mut self,
        path: &Stretch<'_>,
        far: Far<'_>,
        moving: bool,
        weight: Rgb,
        near: &mut SurfaceAdjoint,
        sink: &mut S,
    ) -> RgbVec {
        // Two points of one flat lamp see each other at right angles: 0 × infinity.
        if weight.is_zero() {
            return RgbVec::ZERO;
        }
        let mut along = Along { fixed: matches!(far, Far::Direction), ..Along::default() };
        self.transmittance(path, moving, weight, &mut along, sink);
        if !moving {
            return RgbVec::ZERO;
        }
        near.u += along.near;
        let d = path.dir * path.length;
        match far {
            Far::Vertex(v, receiver) => {
                receiver.u += along.far;
                let turn = along.far * path.length;
                // ln(|n·d| / R^3) on a surface, ln(1/R^2) in a volume.
                let mut g = path.dir * (-2.0 / path.length);
                if let Kind::Surface(s) = &v.kind {
                    let nd = s.ng.dot(d);
                    g = s.ng / nd - path.dir * (3.0 / path.length);
                    receiver.n += weight.outer(d / nd);
                }
                receiver.j += weight;
                let g = weight.outer(g);
                receiver.u += g;
                near.u -= g;
                turn
            }
            Far::Position => {
                let g = weight.outer(path.dir * (-2.0 / path.length));
                near.u -= g;
                along.far + g
            }
            Far::Direction => along.turn,
        }
    }

    /// Sensitivities of the transmittance over a stretch; those by the places of points along it are
    /// added to `along`.
    pub(super) fn transmittance<S: AdjointSink>(
        &mut self,
        path: &Stretch<'_>,
        moving: bool,
        weight: Rgb,
        along: &mut Along,
        sink: &mut S,
    ) {
        let world = self.world;
        if !world.has_media() {
            return;
        }
        let control = core::mem::take(&mut self.control);
        let mut depth_per_length = Rgb::ZERO;
        for i in intervals(path.medium, path.crossings, path.length) {
            let Some(m) = i.medium else { continue };
            let length = i.end - i.start;
            if !length.is_finite() && world.medium(m).extinction().is_some() {
                continue;
            }
            let changes = sink.active().media[m];
            let start = path.start + path.dir * i.start;
            if let Some(h) = world.medium(m).extinction() {
                if changes {
                    sink.medium(m, start, &CoefficientAdjoint::of_sigma_t(weight * -length));
                }
                depth_per_length += h.coefficients().sigma_t * (length / path.length);
            } else if moving || changes {
                depth_per_length += self.grid(path, &i, m, moving, [weight, control], along, sink);
            }
        }
        if moving && !along.fixed {
            let g = (weight * -depth_per_length).outer(path.dir);
            along.far += g;
            along.near -= g;
        }
        let mut before = path.medium;
        for c in path.crossings {
            let discontinuity = world.sigma_t_at_border(before, c.x, -path.dir)
                - world.sigma_t_at_border(c.after, c.x, path.dir);
            before = c.after;
            let shape_moves = sink.active().shapes[c.point.shape as usize];
            if discontinuity.is_zero() || !(moving || shape_moves) {
                continue;
            }
            let n = c.point.ng;
            let g = (weight * -discontinuity).outer(n / n.dot(path.dir));
            if shape_moves {
                sink.surface(&c.point.material(), &SurfaceAdjoint::of_place(g));
            }
            along.add(&-g, &(-g * c.t), path.length);
        }
    }

    /// The part of a stretch inside a grid: an unbiased line integral, and the faces of the grid's
    /// own box. Returns the estimated optical depth per length of the stretch.
    #[allow(clippy::too_many_arguments)]
    fn grid<S: AdjointSink>(
        &mut self,
        path: &Stretch<'_>,
        i: &Interval,
        m: usize,
        moving: bool,
        [weight, control]: [Rgb; 2],
        along: &mut Along,
        sink: &mut S,
    ) -> Rgb {
        let medium = self.world.medium(m);
        let changes = sink.active().media[m];
        let ray = Ray::new(path.start + path.dir * i.start, path.dir).until(i.end - i.start);
        let mut points = core::mem::take(&mut self.points);
        points.clear();
        medium.line_points(&ray, &mut self.rng, &mut points);
        let relative = moving || (changes && sink.active().grids[m]);
        let mut depth = DepthEstimate::inside(medium, ray, &points, relative);
        if relative {
            depth = depth.with_faces(medium);
        }
        if changes {
            let control = if self.world.probed[m].is_some() { control } else { Rgb::ZERO };
            if relative && !control.is_zero() {
                sink.depth(m, &depth, -weight);
                sink.depth(m, &depth.at_rest(), control);
            } else {
                sink.depth(m, &depth, control - weight);
            }
        }
        if moving {
            let (g, moment) = (depth.gradient * -weight, depth.moment * -weight);
            along.add(&g, &(moment + g * i.start), path.length);
            if depth.turn != RgbVec::ZERO {
                along.add_turn(&(depth.turn * -weight), path.length);
            }
        }
        let depth = if moving { depth.depth() } else { Rgb::ZERO };
        self.points = points;
        depth / path.length
    }
}
