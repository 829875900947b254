//! Rays that turn with edges seen past smooth surfaces.
//!
//! A ray with the direction d(u) starts a [chain](crate::derivative::velocity::Link) of smooth surfaces. Behind one of these it goes
//! on from x along w, both functions of u, and radiance jumps where it meets an edge. Let e be the point of an edge that is nearest to
//! the ray's line, t = w·(e - x) its distance along the ray, and o = e - x - t w its offset, along the unit vector m. A small turn δ of
//! the first ray moves the line at t by C δ, C = x_u + t w_u, across w. The offset stays what it is if the first ray turns at a rate V
//! that moves the line as fast as the edge moves against it at fixed u (theory sheet §15),
//!
//! ```text
//! m·C V = m·v,    v = e_dot - x_dot - t w_dot.
//! ```
//!
//! Along l, across m and w, the rate is free. If the same holds there, V = C⁻¹ v is the velocity of the image of e, which is one for all
//! edges that meet in e. But C is singular at folds of the map from u to what is seen, behind any curved glass. So V is the solution along m
//! that is the nearest to this along l, damped where C moves little there: with g = Cᵀ m, f = Cᵀ l, and h = g turned by a right angle,
//!
//! ```text
//! V = A v,    A v = (m·v) g / |g|² + k (l·v - (m·v) f·g / |g|²) h / |g|²,    k = r³ / (r⁴ + (1/2)⁴),    r = f·h / |g|².
//! ```
//!
//! r compares how far a turn moves the line along the edge with how far it moves it across: k is 1/r away from folds, and zero at
//! them. Both are lengths for a radian, so that A has no scale of its own.
//!
//! The first ray meets the edge if it turns by A o.
//!
//! V is added to the sum over edges beside the first ray that [`warped`](super) describes, and so are those of the edges behind the
//! other surfaces of the chain, with weights of the same kind,
//!
//! ```text
//! w = c b s (tan² Δ - q) / (q + (1 - s) tan² Δ),    q = |A o|² = |o|² / |g|²,    b = t² / (t² + |o|²).
//! ```
//!
//! s falls from 1 to 0 behind the plane of the surface where the ray ends. b makes the weight of an edge fall to zero where it goes
//! through the plane of the surface that the ray left, from which it would see nothing of it; at the edge itself b is 1. For plane
//! mirrors V is the velocity that the mirrored edge has as seen from the first ray's origin.
//!
//! Unlike beside the first ray, whose origin does not depend on u, no edge of few faces counts more or less for being a crease or a
//! silhouette as seen from x: x moves with u, and where it passes the plane of a face, the sum would jump. Between the facets of curved bodies
//! the weight of a silhouette rises from zero there.
//!
//! # Shadows
//!
//! The light of a point or directional emitter that arrives at the point where the chain's last ray ends jumps at the shadows of edges.
//! The connection from there to the emitter is one ray more: it leaves x(u) towards the emitter, and edges beside it turn the first ray by
//! the same formulas.
//!
//! # Facets of smooth bodies
//!
//! At creases of a smooth body with the normals of its faces light jumps; they are edges beside the ray before, and so turn it. With
//! interpolated normals light is continuous there, and only C and V jump. A V that follows each crease would turn rays back and forth between
//! creases, at a noise that grows as facets get smaller. So there are two of them: V as above, which is needed at the edge, and V' from
//! [evened](evened) derivatives, which is continuous. The ray turns at
//!
//! ```text
//! (1 - ψ) V' + ψ V,    ψ = B² / (B² + (q + q') / tan² Δ),
//! ```
//!
//! where B is 27 times the product of the three barycentric weights of the point on each such body, which is zero at creases: where the
//! edge is met, ψ is 1. V differs from V' by as much as facets are large, and over so long does ψ rise and fall: the divergence does not
//! grow as they get smaller. Weights are those by the continuous C', whose q' replaces q there.
//!
//! Everything is a function of u over dual numbers, which give its divergence. Where g is zero, which is where the image of an edge touches
//! itself, V is large and its weight is zero, except on the edge itself: second moments suffer, means do not.

use alloc::vec::Vec;
use core::array::from_fn;
use core::convert::Infallible;
use core::ops::ControlFlow;

use drt_geom::edges::Cone;
use drt_math::{Frame, Mat3, Real, Vec3, fm};

use crate::derivative::velocity::{
    ByU, ChainPart, ChainedRay, Link, LinkChange, Mover, RayBehind, RayByMover, RayByU,
    RayVelocity, TangentPlane, Weight, evened, first_ray, ray_by_movers, rays_by_u,
};
use crate::estimators::warped::critical_angle::CriticalAngle;
use crate::estimators::warped::edge::TurningEdge;
use crate::estimators::warped::edge_weights::{BEHIND, NARROW};
use crate::estimators::warped::edges::TurningEdges;
use crate::model::surface::Bend;
use crate::world::World;
use crate::world::vertex::SurfacePoint;

/// The widest angle of a cone in which edges are looked for, in radians.
const WIDEST: f64 = 1.5;

/// How far a turn moves a ray along an edge, over how far across it, where half of the motion along the edge is left out.
const DAMPING: f64 = 0.5;

/// What the edges behind a chain turn its first ray by, divided by nothing as yet.
#[derive(Debug)]
pub(super) struct TurnedBehind {
    frame: Frame,
    /// Σ w.
    pub(super) sum: ByU,
    /// w V by the velocities of what moves, along each axis.
    parts: Vec<(Mover, [[ByU; 2]; 3])>,
    /// An edge is near that moves, or that is seen by what moves.
    pub(super) moves: bool,
}

/// An edge beside a ray of a chain.
struct Beside {
    /// (1 - ψ) A' and ψ A, from coordinates in the frame across the ray.
    inverses: [Matrix; 2],
    /// t.
    distance: ByU,
    /// How far along the edge e is, from 0 to 1.
    along: ByU,
    weight: ByU,
}

type Matrix = [[ByU; 2]; 2];

/// A ray of a chain, as edges beside it are looked at.
struct Line<'a> {
    ray: &'a RayByU,
    /// Its continuous derivatives by u, and B, where its own jump.
    evened: Option<([RayVelocity; 2], ByU)>,
    /// Two unit vectors across it.
    across: [Vec3; 2],
    /// Squared tangent of the angle within which edges count.
    square: f64,
    /// How far from the line such edges may be: the first, and the second times their distance.
    spread: [f64; 2],
    /// The unit normal of the flat surface that it left, towards its side.
    horizon: Option<Vec3>,
    end: Option<End>,
}

/// Where a ray of a chain ends.
struct End {
    /// `None` of an emitter that the chain is connected to.
    shape: Option<u32>,
    /// The unit normal of the plane there, away from the ray's origin, and a point of that plane.
    plane: [Vec3<ByU>; 2],
}

impl TurnedBehind {
    /// Adds up what all edges behind the surfaces of a chain do that turn it by less than an `angle`; `changes` says how surfaces of the chain do.
    pub(super) fn new(
        world: &World,
        edges: &TurningEdges,
        chain: &ChainedRay<'_>,
        angle: f64,
        changes: impl Fn(&SurfacePoint) -> LinkChange + Copy,
    ) -> Self {
        let (start, links) = (&chain.start, &chain.links[..]);
        let (from, viewer_moves) = (start.viewer.x, start.moves);
        let frame = Frame::from_normal(start.dir);
        let mut turned = Self { frame, sum: ByU::from(0.0), parts: Vec::new(), moves: false };
        let rays = rays_by_u(from, &frame, links);
        let evened = links.iter().any(Link::is_interpolated).then(|| {
            let slopes: Vec<_> =
                links.iter().map(|link| edges.normal_slopes(&link.point)).collect();
            evened(from, viewer_moves, &frame, links, &rays, &slopes, changes)
        });
        let mut inside = ByU::from(1.0);
        for (i, (ray, behind)) in rays.iter().zip(&chain.rays).enumerate() {
            if links[i].is_interpolated() {
                inside *= links[i].inside(ray.x);
            }
            let evened = evened.as_ref().map(|rays| &rays[i]);
            let line = Line::new((world, edges), ray, behind, &links[i], tangent(angle));
            let line = Line { evened: evened.map(|rates| (rates.by_u, inside)), ..line };
            let smooth = evened.map_or(&[][..], |rates| &rates.by_movers);
            turned.gather(edges, &line.spread_out(tangent(angle)), smooth, || {
                ray_by_movers(from, viewer_moves, &frame, &links[..=i], changes)
            });
        }
        turned
    }

    /// `smooth` has the continuous rates of the ray, `movers` finds those that jump.
    fn gather(
        &mut self,
        edges: &TurningEdges,
        line: &Line<'_>,
        smooth: &[RayByMover],
        movers: impl FnOnce() -> Vec<RayByMover>,
    ) {
        // By both kinds of derivatives: sums of w A and of w t A.
        let mut sums = [[[[ByU::from(0.0); 2]; 2]; 2]; 2];
        let critical = CriticalAngle::beside(line.ray, line.evened, line.square);
        let mut any = critical.is_some();
        let mut add = |edge: &TurningEdge| {
            if let Some(beside) = line.beside(edge) {
                any = true;
                self.sum += beside.weight;
                for (sums, inverse) in sums.iter_mut().zip(&beside.inverses) {
                    for (sum, by) in sums.iter_mut().zip([ByU::from(1.0), beside.distance]) {
                        let by = by * beside.weight;
                        *sum = from_fn(|r| from_fn(|c| sum[r][c] + inverse[r][c] * by));
                    }
                }
                if edge.moves {
                    self.moves = true;
                    self.turn_with(edge, line, &beside);
                }
            }
            ControlFlow::<Infallible>::Continue(())
        };
        if let Some(cone) = line.cone() {
            let all = edges.visit_all(&cone, &mut add);
            debug_assert!(all.is_continue());
        }
        if !any {
            return;
        }
        let mut by_beyond = [[ByU::from(0.0); 2]; 2];
        if let Some(CriticalAngle { inverses, weight }) = critical {
            self.sum += weight;
            by_beyond = inverses.map(|inverse| inverse.map(|v| v * weight));
        }
        let movers = movers();
        self.moves |= !movers.is_empty();
        for ((sums, by_beyond), movers) in sums.iter().zip(by_beyond).zip([smooth, &movers]) {
            self.parts.extend(movers.iter().map(|RayByMover { mover, axes }| {
                let rate = axes.each_ref().map(|rate| {
                    let at = [rate.x, rate.w].map(|v| line.coordinates(v));
                    let v = [0, 1].map(|i| apply(&sums[i], at[i]));
                    from_fn(|k| -(v[0][k] + v[1][k] + by_beyond[k] * rate.beyond))
                });
                (*mover, rate)
            }));
        }
    }

    fn turn_with(&mut self, edge: &TurningEdge, line: &Line<'_>, beside: &Beside) {
        let axes = [Vec3::X, Vec3::Y, Vec3::Z].map(|axis| line.turn(beside, axis.lift()));
        let shares = [ByU::from(1.0) - beside.along, beside.along];
        for (end, share) in shares.into_iter().enumerate() {
            let rate = axes.map(|v| v.map(|v| v * share));
            self.parts.extend(edge.matter(end).map(|matter| (Mover::Place(matter), rate)));
        }
    }

    /// The tangent plane where the first ray of a chain ends, if its surface has interpolated normals.
    pub(super) fn tangent_plane(chain: &ChainedRay<'_>) -> Option<TangentPlane> {
        let link = chain.links.first().filter(|link| link.is_interpolated())?;
        let frame = Frame::from_normal(chain.start.dir);
        let [x, w] = first_ray(chain.start.viewer.x, &frame);
        let plane = link.tangent_plane(x, w);
        let by = |k: usize| plane.map(|v| v.to_array().map(|c| c.eps[k]).into());
        Some(TangentPlane {
            normal: plane[0].re(),
            place: plane[1].re(),
            by_direction: [(frame.s, by(0)), (frame.t, by(1))],
        })
    }

    /// A weight by u, of one by the direction.
    pub(super) fn by_u(&self, weight: &Weight) -> ByU {
        let across = [self.frame.s, self.frame.t];
        ByU::new(weight.value, across.map(|t| weight.gradient.dot(t)))
    }

    /// A weight by the direction, of one by u.
    pub(super) fn by_direction(&self, weight: ByU) -> Weight {
        let [s, t] = weight.eps;
        Weight { value: weight.re, gradient: self.frame.s * s + self.frame.t * t }
    }

    /// The summands of the turn, where all weights add up to a `total`.
    pub(super) fn finish(&self, total: ByU) -> impl Iterator<Item = ChainPart> {
        let across = [self.frame.s, self.frame.t];
        self.parts.iter().map(move |(mover, axes)| {
            let shares = axes.map(|axis| axis.map(|rate| rate / total));
            let cols = shares.map(|[a, b]| across[0] * a.re + across[1] * b.re);
            let divergence = shares.map(|[a, b]| a.eps[0] + b.eps[1]).into();
            ChainPart { mover: *mover, rate: Mat3 { cols }, divergence }
        })
    }
}

impl<'a> Line<'a> {
    /// A ray that left a surface, beside which edges count that turn the first ray by less than an angle of a given tangent.
    fn new(
        (world, edges): (&World, &TurningEdges),
        ray: &'a RayByU,
        behind: &RayBehind,
        left: &Link,
        tangent: f64,
    ) -> Self {
        let side = |n: Vec3| if n.dot(behind.dir) < 0.0 { -n } else { n };
        let Frame { s, t, .. } = Frame::from_normal(behind.dir);
        let end = behind.end.map(|end| {
            let plane = if edges.is_untracked(end.shape) {
                Link::new(world, end, Bend::Straight).tangent_plane(ray.x, ray.w)
            } else {
                let foot = ray.x.re() + behind.dir * behind.distance;
                [side(end.ng), foot].map(Vec3::lift)
            };
            End { shape: Some(end.shape), plane }
        });
        // Nothing but a connection ends off all surfaces at a finite distance.
        let end = end.or_else(|| {
            let lamp = ray.x.re() + behind.dir * behind.distance;
            behind.distance.is_finite().then(|| End { shape: None, plane: [ray.w, lamp.lift()] })
        });
        Self {
            ray,
            evened: None,
            across: [s, t],
            square: tangent * tangent,
            spread: [0.0; 2],
            horizon: (!left.is_interpolated()).then(|| side(left.point.ng)),
            end,
        }
    }

    /// With how far from the line edges may be.
    fn spread_out(mut self, tangent: f64) -> Self {
        let [x, w] = [0, 1].map(|of| {
            let by_u = self.by_u().map(|rate| if of == 0 { rate.x } else { rate.w });
            tangent * largest(by_u.map(|d| self.coordinates(d).map(|c| c.re)))
        });
        self.spread = [x, w];
        self
    }

    /// The continuous derivatives by u.
    fn by_u(&self) -> [RayVelocity; 2] {
        self.evened.map_or(self.ray.by_u, |(rates, _)| rates)
    }

    /// The coordinates of a vector across the ray.
    fn coordinates(&self, v: Vec3<ByU>) -> [ByU; 2] {
        let v = v.reject(self.ray.w);
        self.across.map(|axis| v.dot(axis.lift()))
    }

    /// w ((1 - ψ) A' + ψ A) v.
    fn turn(&self, beside: &Beside, v: Vec3<ByU>) -> [ByU; 2] {
        let at = self.coordinates(v);
        let [a, b] = beside.inverses.each_ref().map(|inverse| apply(inverse, at));
        from_fn(|k| (a[k] + b[k]) * beside.weight)
    }

    /// Where edges that count must be; `None` where none can.
    fn cone(&self) -> Option<Cone> {
        let [x, w] = self.spread;
        let angle = f64::clamp(fm::atan2(w, 1.0), 1e-6, WIDEST);
        let back = x / tangent(angle);
        let (origin, axis) = (self.ray.x.re(), self.ray.w.re());
        back.is_finite().then(|| Cone::new(origin - axis * back, axis, angle, f64::INFINITY))
    }

    /// A at a distance, from the derivatives by u; `m` is unit. `None` where no turn moves the ray towards the edge.
    fn inverse(&self, by_u: [RayVelocity; 2], distance: ByU, m: [ByU; 2]) -> Option<Matrix> {
        let l = [-m[1], m[0]];
        let columns = by_u.map(|rate| self.coordinates(rate.x + rate.w * distance));
        let [g, f] = [m, l].map(|axis| columns.map(|c| axis[0] * c[0] + axis[1] * c[1]));
        let square = g[0].squared() + g[1].squared();
        if square.re == 0.0 {
            return None;
        }
        // g rotated by a right angle has the length of g.
        let across = (f[1] * g[0] - f[0] * g[1]) / square;
        let fourth = across.squared().squared() + DAMPING.powi(4);
        let share = across * across.squared() / (fourth * square);
        let sheared = (f[0] * g[0] + f[1] * g[1]) / square;
        let turned = [-g[1], g[0]];
        Some(from_fn(|r| {
            from_fn(|c| {
                let along = turned[r] * share;
                m[c] * (g[r] / square - along * sheared) + l[c] * along
            })
        }))
    }

    /// An edge and its weight; `None` where it has none.
    fn beside(&self, edge: &TurningEdge) -> Option<Beside> {
        let ray = self.ray;
        let [a, b] = edge.ends;
        let origin = ray.x.re();
        let below = |n: Vec3, p: Vec3| n.dot(p - origin) <= 1e-9 * (p - origin).length();
        if self.horizon.is_some_and(|n| below(n, a) && below(n, b)) {
            return None;
        }
        // Most edges are farther away, by a sphere around them.
        let middle = (a + b) * 0.5 - origin;
        let along = middle.dot(self.ray.w.re());
        let reach = self.spread[0] + self.spread[1] * (along + edge.half) + edge.half;
        if along + edge.half <= 0.0 || middle.length_squared() - along * along > reach * reach {
            return None;
        }
        let w = ray.w;
        let (to_start, side) = (a.lift() - ray.x, (b - a).lift::<ByU>());
        let (silhouette, crease) = self.kinds(edge, to_start);
        if silhouette.re <= 0.0 && !crease {
            return None;
        }
        let (start_across, side_across) = (to_start.reject(w), side.reject(w));
        let along = -start_across.dot(side_across) / side_across.length_squared();
        let along = match along.re {
            s if s > 0.0 && s < 1.0 => along,
            s if s >= 1.0 => ByU::from(1.0),
            _ => ByU::from(0.0),
        };
        let (offset, place) = (start_across + side_across * along, to_start + side * along);
        let distance = place.dot(w);
        if distance.re <= 0.0 {
            return None;
        }
        let length_squared = |[a, b]: [ByU; 2]| a.squared() + b.squared();
        let offset = self.coordinates(offset);
        let apart = length_squared(offset);
        if apart.re == 0.0 {
            return None;
        }
        let m = offset.map(|o| o / apart.sqrt());
        let inverse = self.inverse(self.by_u(), distance, m)?;
        let near = length_squared(apply(&inverse, offset));
        if near.re >= self.square || !near.re.is_finite() {
            return None;
        }
        let least = f64::MIN_POSITIVE.sqrt();
        let near = if near.re < least { ByU::new(least, near.eps) } else { near };
        let seen = length_squared(apply(&inverse, self.coordinates(side)));
        let shown = self.shown(a, side * along, distance)?;
        let square = distance.squared();
        let front = square / (square + apart);
        let within = |square: f64| {
            // Many short edges together weigh as much as the line that they approximate.
            let part = if seen.re < square { (seen / square).sqrt() } else { ByU::from(1.0) };
            let fall = near + (ByU::from(1.0) - shown) * square;
            part * shown * (-near + square) / fall
        };
        let mut weight = silhouette * within(self.square);
        let narrow = self.square * (NARROW * NARROW);
        if crease && near.re < narrow {
            weight += within(narrow);
        }
        let inverses = match self.evened {
            None => [[[ByU::from(0.0); 2]; 2], inverse],
            Some((_, inside)) => {
                let own = self.inverse(ray.by_u, distance, m)?;
                let both = near + length_squared(apply(&own, offset));
                let exact = inside.squared() / (inside.squared() + both / self.square);
                let scaled = |m: Matrix, by: ByU| m.map(|row| row.map(|c| c * by));
                [scaled(inverse, ByU::from(1.0) - exact), scaled(own, exact)]
            }
        };
        Some(Beside { inverses, distance, along, weight: front * weight })
    }

    /// How much an edge counts as a silhouette, and whether as a crease of the body where the ray ends.
    fn kinds(&self, edge: &TurningEdge, to_start: Vec3<ByU>) -> (ByU, bool) {
        let Some((normals, _)) = edge.crease.filter(|_| edge.facets) else {
            return (ByU::from(1.0), false);
        };
        let own =
            self.end.as_ref().is_some_and(|end| end.shape.is_some() && edge.within == end.shape);
        let crease = own && !edge.untracked;
        let start = to_start.re();
        let [a, b] = normals.map(|n| start.dot(n));
        // A ray that starts on a facet sees its edges as no silhouettes; by rounding alone it would see some.
        let flat = 1e-9 * start.length() + 1e-13 * self.ray.x.re().max_abs();
        if a * b >= 0.0 || a.abs().min(b.abs()) <= flat {
            return (ByU::from(0.0), crease);
        }
        let view = to_start.normalize();
        let [a, b] = normals.map(|n| view.dot(n.lift()));
        let bend = 1.0 - normals[0].dot(normals[1]);
        let silhouette = (a * b) * (-4.0 / bend);
        let silhouette = if silhouette.re < 1.0 { silhouette } else { ByU::from(1.0) };
        (silhouette, crease)
    }

    /// s, of a point of an edge that is `along` from its start, at a distance along the ray; `None` where it is zero.
    fn shown(&self, start: Vec3, along: Vec3<ByU>, distance: ByU) -> Option<ByU> {
        let Some(end) = &self.end else { return Some(ByU::from(1.0)) };
        let [normal, foot] = end.plane;
        let behind = normal.dot(along + start.lift() - foot) / (distance * BEHIND);
        match behind.re {
            q if q >= 1.0 => None,
            q if q <= 0.0 => Some(ByU::from(1.0)),
            _ => Some((ByU::from(1.0) - behind.squared()).squared()),
        }
    }
}

fn apply(matrix: &Matrix, v: [ByU; 2]) -> [ByU; 2] {
    matrix.map(|[p, q]| p * v[0] + q * v[1])
}

fn tangent(angle: f64) -> f64 {
    let (sine, cosine) = fm::sin_cos(angle);
    sine / cosine
}

/// The largest singular value of a matrix.
fn largest([[a, b], [c, d]]: [[f64; 2]; 2]) -> f64 {
    let trace = a * a + b * b + c * c + d * d;
    let determinant = a * d - b * c;
    Real::sqrt(
        0.5 * (trace + Real::sqrt(f64::max(trace * trace - 4.0 * determinant * determinant, 0.0))),
    )
}
