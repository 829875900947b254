//! Edges that rest on another surface: the foot of a block on a floor, the border of a sheet that lies in another's plane, and
//! lines along which surfaces intersect.
//!
//! A segment past such an edge has one end on the floor, right at the edge, and neither which end nor
//! whether it is in shadow there can be found by rays. But what the edge does is simple: it bounds the
//! part of the floor that is not covered. With V the speed of that bound away from the faces, relative
//! to the floor,
//!
//! ```text
//! d/dθ ∫ f dA = - ∫ V f dl,
//! ```
//!
//! where f is everything that paths carry through a floor vertex just outside (the boundary of the
//! domain in Reynolds' theorem; 2021 paper, Eq. 17, with a jump of f from its value to zero). It is the
//! limit of the kernel of [boundary segments](crate::terms::boundary_segments) for a gap that closes (l = 0, |t×w| N = cos θ times the
//! conormal), with segments that end in the shadow of the edge and those that start in it together: so
//! each path counts once, light and camera both above the floor.

use core::f64::consts::{PI, TAU};

use drt_geom::edges::Wedge;
use drt_geom::{AlongSegment, Skip};
use drt_math::{Ray, Real, Vec3, fm};

use crate::discontinuities::edge::{Edge, EdgePoint};
use crate::discontinuities::intersection_faces::Sheets;
use crate::world::World;
use crate::world::vertex::{Kind, SurfacePoint, Vertex};

/// How far an edge may be from the surface it rests on, in its own lengths: what coordinates in
/// files written with single precision are off by.
const GAP: f64 = 1e-6;

/// Sine of the angle by which faces that lie in the floor may be off.
const FLAT: f64 = 1e-5;

/// How far from an edge rays start that leave a face beside it, in the edge's lengths: on the edge itself a ray would not tell
/// which face it leaves.
pub(super) const BESIDE: f64 = 1e-6;

/// Where along an edge it is found out whether it rests on anything.
const PROBES: [f64; 5] = [0.01, 0.3, 0.5, 0.7, 0.99];

/// What is between two faces around a line along which surfaces intersect.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Quadrant {
    face: u32,
    /// Unit, across the line into the face.
    side: Vec3,
    /// Unit normal of the face into what is between.
    up: Vec3,
    /// To the other face, in radians, and to half a turn at most.
    angle: f64,
}

impl Quadrant {
    /// Next to one of the faces, by its number, on the side to which `towards` points.
    pub(crate) fn new(tangent: Vec3, sheets: &Sheets, number: usize, towards: Vec3) -> Self {
        let (face, side) = sheets[number];
        let normal = side.cross(tangent);
        let up = if normal.dot(towards) < 0.0 { -normal } else { normal };
        let to = |across: Vec3| {
            let angle = fm::atan2(across.dot(up), across.dot(side));
            if angle < 0.0 { angle + TAU } else { angle }
        };
        let others = (0..).zip(sheets).filter(|(k, _)| *k != number);
        let angle = others.map(|(_, (_, across))| to(*across)).fold(PI, f64::min);
        Self { face, side, up, angle }
    }

    /// True of what a vector from the line points into.
    pub(crate) fn contains(&self, w: Vec3) -> bool {
        let angle = fm::atan2(w.dot(self.up), w.dot(self.side));
        angle > 0.0 && angle < self.angle
    }
}

/// Where an edge rests on a surface.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Contact {
    /// Unit normal of the floor, on the side of the faces.
    pub(crate) up: Vec3,
    /// Unit, in the floor, across the edge.
    side: Vec3,
    /// Angles from `side` over `up` between which the edge's faces are.
    wedge: [f64; 2],
    /// The floor along `side` and against it, where it goes on.
    floor: [Option<Vertex>; 2],
    /// A sheet lies in the floor's plane, and covers it from either side.
    pub(crate) two_sided: bool,
}

/// The surface right at a point of an edge that a ray along the unit vector `down` finds.
fn surface_under(world: &World, at: &EdgePoint<'_>, down: Vec3) -> Option<(SurfacePoint, Vec3)> {
    let wedge = &at.edge.wedge;
    let gap = GAP * wedge.length;
    let ray = Ray { origin: at.x - down * gap, dir: down, t_max: 2.0 * gap };
    let hit = world.nearest_scattering(&ray, Skip::two(wedge.faces[0], wedge.faces[1]))?;
    let (below, x) = world.point(hit.prim, hit.bary);
    let flat = Real::abs(below.ng.dot(wedge.tangent)) <= FLAT;
    flat.then_some((below, x))
}

/// False where no triangle but an edge's own faces lies along it, so that no ray needs to look for one on which it rests: nearly
/// everywhere.
fn has_flat_neighbor(world: &World, e: &Edge) -> bool {
    let Wedge { ends, length, faces, .. } = e.wedge;
    // Half an edge's length tilted by the angle of a floor, beside the gap; twice both, for rounding.
    let (reach, sine) = ((4.0 * GAP + FLAT) * length, 2.0 * FLAT);
    world.geometry.may_lie_along(&AlongSegment { ends, reach, sine, except: faces })
}

/// The surface in whose plane the only face of an open edge lies, to within rounding, and which it hides: a lamp in a
/// ceiling's plane.
fn plane_of_sheet(world: &World, at: &EdgePoint<'_>) -> Option<(SurfacePoint, Vec3)> {
    let wedge = &at.edge.wedge;
    let across = wedge.across[0];
    if wedge.across[1].dot(across) < 1.0 - FLAT {
        return None;
    }
    let (below, x) = surface_under(world, at, across.cross(wedge.tangent).normalize())?;
    let rounding = 64.0 * f64::EPSILON * (at.x.length() + wedge.length);
    let coincides = (x - at.x).length() <= rounding && Real::abs(below.ng.dot(across)) <= FLAT;
    // Of surfaces that coincide the one with the lower number is met.
    (coincides && wedge.faces[0] < below.prim).then_some((below, x))
}

impl Contact {
    /// One of the faces around a line along which surfaces intersect, as a floor up to where the next stands on it.
    pub(crate) fn of_intersection(world: &World, at: &EdgePoint<'_>, floor: &Quadrant) -> Self {
        let Quadrant { face, side, up, angle } = *floor;
        let beside = BESIDE * at.edge.wedge.length;
        let (point, x) = world.point_near(face, at.x + side * beside);
        let (sine, cosine) = fm::sin_cos(0.5 * angle);
        let medium = at.edge.medium(world, at.x + (side * cosine + up * sine) * beside);
        let vertex = Vertex { x, medium, kind: Kind::Surface(point) };
        let floor = [Some(vertex), None];
        Self { up, side, wedge: [angle, PI], floor, two_sided: false }
    }

    /// What the edge rests on at a point of it; `None` nearly everywhere.
    pub(crate) fn at(world: &World, at: &EdgePoint<'_>) -> Option<Self> {
        let e = at.edge;
        if !e.may_rest {
            return None;
        }
        let inward = e.wedge.inward()?;
        let gap = GAP * e.wedge.length;
        let skip = Skip::two(e.wedge.faces[0], e.wedge.faces[1]);
        let (below, x, up, two_sided) = match surface_under(world, at, -inward) {
            Some((below, x)) => {
                let up = if below.ng.dot(inward) > 0.0 { below.ng } else { -below.ng };
                (below, x, up, false)
            }
            None => {
                let (below, x) = plane_of_sheet(world, at)?;
                (below, x, below.ng, true)
            }
        };
        let side = e.wedge.tangent.cross(up).normalize();
        let angles = e.wedge.across.map(|h| {
            let (sine, cosine) = (h.dot(up), h.dot(side));
            (sine >= -FLAT).then(|| fm::atan2(f64::max(sine, 0.0), cosine))
        });
        let [Some(a), Some(b)] = angles else { return None };
        let wedge = [f64::min(a, b), f64::max(a, b)];
        // Next to the edge, so that its faces neither touch the floor there nor shade it from outside.
        // The floor may be where a medium begins.
        let medium = e.surrounding().toward(world, at.x, up);
        let beside = |outward: Vec3| {
            let x = x + outward * (4.0 * gap);
            let ray = Ray { origin: x + up * gap, dir: -up, t_max: 2.0 * gap };
            let hit = world.nearest_scattering(&ray, skip)?;
            let (floor, x) = world.point(hit.prim, hit.bary);
            let medium = world.medium_on_side(&floor, floor.ng.dot(up) > 0.0, medium);
            let found = Vertex { x, medium, kind: Kind::Surface(floor) };
            (floor.shape == below.shape && floor.ng.dot(up) * below.ng.dot(up) > 0.0)
                .then_some(found)
        };
        let open = [wedge[0] > FLAT, wedge[1] < PI - FLAT];
        let floor =
            [open[0].then(|| beside(side)).flatten(), open[1].then(|| beside(-side)).flatten()];
        // Without a floor outside, it is another's edge that this one meets.
        let any = floor[0].is_some() || floor[1].is_some();
        any.then_some(Self { up, side, wedge, floor, two_sided })
    }

    /// Looks at this contact from the other side of the floor.
    pub(crate) fn turned_over(&self, world: &World) -> Self {
        let below = |v: &Vertex| {
            let front = v.surface().is_some_and(|s| s.ng.dot(self.up) < 0.0);
            let medium = v.surface().and_then(|s| world.medium_on_side(s, front, v.medium));
            Vertex { medium, ..*v }
        };
        let [along, against] = [0, 1].map(|k| self.floor[k].as_ref().map(below));
        let [low, high] = self.wedge;
        Self {
            up: -self.up,
            side: -self.side,
            wedge: [PI - high, PI - low],
            floor: [against, along],
            two_sided: self.two_sided,
        }
    }

    /// True when an edge rests on something somewhere.
    pub(crate) fn anywhere(world: &World, e: &Edge) -> bool {
        if !has_flat_neighbor(world, e) {
            return false;
        }
        let mut e = *e;
        e.may_rest = true;
        PROBES.into_iter().any(|u| Self::at(world, &EdgePoint::new(&e, u, 1.0)).is_some())
    }

    /// The floor next to the edge on the side from which `w` leaves it, and the unit vector along the
    /// floor to there; `None` where `w` leaves into the faces.
    pub(crate) fn beside(&self, w: Vec3) -> Option<(Vertex, Vec3)> {
        let angle = fm::atan2(w.dot(self.up), w.dot(self.side));
        let [low, high] = self.wedge;
        let [along, against] = self.floor;
        match angle {
            a if a <= 0.0 => None,
            a if a < low => Some((along?, self.side)),
            a if a > high => Some((against?, -self.side)),
            _ => None,
        }
    }

    /// The floor next to the edge on the side to which `w` points, if it goes on there.
    pub(crate) fn floor_along(&self, w: Vec3) -> Option<Vertex> {
        self.floor[usize::from(self.side.dot(w) < 0.0)]
    }

    /// A point of the edge, moved off the floor by more than the two may be apart: to where the faces are, or, of a sheet in the floor's
    /// plane, to where it is seen from along `w`.
    pub(crate) fn off_the_floor(&self, edge: &Edge, x: Vec3, w: Vec3) -> Vec3 {
        let gap = 2.0 * GAP * edge.wedge.length;
        let below = self.two_sided && self.up.dot(w) < 0.0;
        x + self.up * if below { -gap } else { gap }
    }

    /// The direction and distance from the contact to the point from which it is seen.
    pub(crate) fn towards(&self, eye_of: impl Fn(Vec3) -> Vec3) -> Option<(Vec3, f64)> {
        let x = self.floor.iter().flatten().next()?.x;
        let d = eye_of(x) - x;
        let distance = d.length();
        Some((d / distance, distance))
    }
}
