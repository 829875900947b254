//! Rays that smooth surfaces pass on, as functions of the ray that started them.
//!
//! A chain starts at a point x with a direction d(u), u being two coordinates across it, and goes on from smooth surface to smooth
//! surface (theory sheet §15): it meets the plane of a triangle, and leaves in the direction that the surface singles out,
//!
//! ```text
//! y = x + d N·(a - x) / (N·d),    N = (b - a) × (c - a),    w = s(d, n(y)),
//! ```
//!
//! n being N or the normals of the corners, interpolated. All of this is a smooth function of u, of x and of the corners, so that dual
//! numbers tell how the ray behind the last surface depends on them: by u once and twice, by everything that may move once, and that
//! by u again.
//!
//! It is smooth up to the borders of triangles, that is. Where normals are interpolated, rays are continuous there, but their derivatives
//! jump. [`Evened`] derivatives do not: they are those of a surface whose tangent plane has the shading normal, and whose curvature is
//! interpolated, too. They differ from the others by as much as triangles are large, and stay
//! bounded where a ray grazes.
//!
//! The connection of a surface point y to a point or directional emitter is a ray of the same kind: it leaves y along w = (p - y) / |p - y|,
//! or against the flow of a directional emitter, both functions of u and of the emitter.

use alloc::vec::Vec;
use core::array::from_fn;

use drt_math::{Dual, Frame, Mat3, Real, Vec3};

use crate::derivative::velocity::EdgeMatter;
use crate::model::surface::Bend;
use crate::sampling::record::Node;
use crate::world::World;
use crate::world::lights::{LightKind, LightSample};
use crate::world::scatter::Scattering;
use crate::world::vertex::{MaterialPoint, SurfacePoint};

/// A number with its derivatives by u.
pub(crate) type ByU = Dual<f64, 2>;

/// With those by what moves as well.
type ByMatter = Dual<ByU, LANES>;

/// The coordinates of three points.
const LANES: usize = 9;

/// A smooth surface of a chain.
#[derive(Clone, Debug)]
pub(crate) struct Link {
    pub(crate) point: SurfacePoint,
    corners: [Vec3; 3],
    /// Unit shading normals of the corners, where they are interpolated.
    normals: Option<[Vec3; 3]>,
    onward: Onward,
    /// Of the surface.
    bsdf: usize,
}

/// Where a ray goes on to from a surface.
#[derive(Clone, Copy, Debug)]
enum Onward {
    /// Where the surface reflects, refracts or passes it to.
    Bent(Bend),
    /// To an emitter, as a connection.
    To(Lamp),
}

/// A point or directional emitter that a surface point is connected to.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Lamp {
    /// Its position, or the unit direction of its flow where it is at infinity.
    place: Vec3,
    at_infinity: bool,
    /// It moves.
    moves: bool,
}

/// How a surface of a chain changes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct LinkChange {
    /// Its points move.
    pub(crate) moves: bool,
    /// Its index of refraction changes.
    pub(crate) bends: bool,
}

/// Where a chain meets a surface, by u.
struct LinkHit {
    y: Vec3<ByU>,
    /// The unit direction in which it arrives, and over which distance.
    w: Vec3<ByU>,
    distance: ByU,
    /// Unit.
    n: Vec3<ByU>,
    /// The weights of the corners.
    weights: [ByU; 3],
    /// The length of the sum of the corners' normals.
    length: ByU,
    /// The normal's gradient by the place.
    slope: Mat3<ByU>,
    /// Below which cosine the direction counts as along the surface.
    grazing: f64,
}

/// A ray that left a smooth surface.
#[derive(Clone, Copy, Debug)]
pub(crate) struct RayBehind {
    pub(crate) dir: Vec3,
    /// To where it ends; infinite where it leaves the scene.
    pub(crate) distance: f64,
    /// The surface point there.
    pub(crate) end: Option<SurfacePoint>,
}

/// What moves a ray behind a chain.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Mover {
    /// The point where the chain starts.
    Viewer,
    /// The velocity of a point of a surface, or of an edge.
    Place(EdgeMatter),
    /// The rate of the shading normal at a point.
    Normal(MaterialPoint),
    /// The rate of the index of refraction of a BSDF, as if along the first axis.
    Index(usize),
    /// The velocity of the emitter that the chain ends at, or the rate of its flow's direction.
    Lamp,
}

/// A ray of a chain by u: its origin x and its unit direction w, with the derivatives by both coordinates.
#[derive(Clone, Copy, Debug)]
pub(crate) struct RayByU {
    pub(crate) x: Vec3<ByU>,
    pub(crate) w: Vec3<ByU>,
    /// The squared cosine [beyond](Bend::beyond) the surface that it left; 1 where no angle is critical.
    pub(crate) beyond: ByU,
    pub(crate) by_u: [RayVelocity; 2],
}

/// Derivatives of a ray that are continuous on bodies with interpolated normals.
#[derive(Clone, Debug)]
pub(crate) struct Evened {
    /// Those by both coordinates of u.
    pub(crate) by_u: [RayVelocity; 2],
    pub(crate) by_movers: Vec<RayByMover>,
}

/// How fast a ray's origin and direction move at fixed u, by one coordinate of the velocity of something.
#[derive(Clone, Copy, Debug)]
pub(crate) struct RayVelocity {
    pub(crate) x: Vec3<ByU>,
    pub(crate) w: Vec3<ByU>,
    /// How fast the squared cosine [beyond](Bend::beyond) the surface changes that the ray left.
    pub(crate) beyond: ByU,
}

/// A ray by the velocity of something, along each axis.
#[derive(Clone, Copy, Debug)]
pub(crate) struct RayByMover {
    pub(crate) mover: Mover,
    pub(crate) axes: [RayVelocity; 3],
}

/// A triangle of a smooth surface, over any scalar.
#[derive(Clone, Copy)]
struct Triangle<T> {
    corners: [Vec3<T>; 3],
    normals: Option<[Vec3<T>; 3]>,
    /// How much higher than it is the index of refraction is.
    more: T,
    /// How far the emitter that the chain ends at is from its place.
    shift: Vec3<T>,
}

/// The rates of what decides where a ray goes on to.
struct OnwardRates {
    x: Vec3<ByU>,
    w: Vec3<ByU>,
    n: Vec3<ByU>,
    index: f64,
    lamp: Vec3<ByU>,
}

impl OnwardRates {
    const STILL: Self = Self {
        x: Vec3 { x: ZERO, y: ZERO, z: ZERO },
        w: Vec3 { x: ZERO, y: ZERO, z: ZERO },
        n: Vec3 { x: ZERO, y: ZERO, z: ZERO },
        index: 0.0,
        lamp: Vec3 { x: ZERO, y: ZERO, z: ZERO },
    };
}

impl Lamp {
    /// The emitter of a connection, which may move; `None` of emitters with an area.
    pub(crate) fn of(light: &LightSample, moves: bool) -> Option<Self> {
        match light.kind {
            LightKind::Position => Some(Self { place: light.y, at_infinity: false, moves }),
            LightKind::Direction => Some(Self { place: -light.w, at_infinity: true, moves }),
            LightKind::Area(_) | LightKind::Environment => None,
        }
    }

    /// The unit direction towards it from a place, where it is elsewhere by a `shift`.
    fn seen_from<T: Real>(&self, x: Vec3<T>, shift: Vec3<T>) -> Vec3<T> {
        let place = self.place.lift() + shift;
        if self.at_infinity { -place.normalize() } else { (place - x).normalize() }
    }
}

impl Onward {
    /// The ray that goes on from x, where a ray arrives along the unit direction w and n is the unit normal.
    fn ray<T: Real>(self, x: Vec3<T>, w: Vec3<T>, n: Vec3<T>, more: T, shift: Vec3<T>) -> Ray<T> {
        match self {
            Self::Bent(bend) => {
                let beyond = bend.beyond(w, n, more).unwrap_or(T::one());
                Ray { x, w: bend.onward(w, n, more), beyond }
            }
            Self::To(lamp) => Ray { x, w: lamp.seen_from(x, shift), beyond: T::one() },
        }
    }
}

/// A ray over any scalar, as [`RayByU`] is one.
#[derive(Clone, Copy)]
struct Ray<T> {
    x: Vec3<T>,
    w: Vec3<T>,
    beyond: T,
}

impl<T: Real> Ray<T> {
    fn starting(x: Vec3<T>, w: Vec3<T>) -> Self {
        Self { x, w, beyond: T::one() }
    }
}

impl Link {
    /// The surface by which a walk left a node in a single direction; `None` of other nodes.
    pub(crate) fn at(world: &World, node: &Node) -> Option<Self> {
        let (vertex, arrival) = (node.vertex()?, node.arrival.as_ref()?);
        let point = *vertex.surface().filter(|_| node.single)?;
        let Some(Scattering::Surface(bsdf)) = world.scattering(vertex) else { return None };
        let bend = bsdf.specular(-arrival.dir, node.wi)?.bend;
        Some(Self::new(world, point, bend))
    }

    /// A point of a surface, which light goes on from in some way.
    pub(crate) fn new(world: &World, point: SurfacePoint, bend: Bend) -> Self {
        let corners = CORNERS.map(|bary| world.point(point.prim, bary));
        let normals = world.is_smooth(&point).then(|| corners.map(|(corner, _)| corner.ns));
        let bsdf = world.scene.shapes[point.shape as usize].bsdf;
        let (corners, onward) = (corners.map(|(_, x)| x), Onward::Bent(bend));
        Self { point, corners, normals, onward, bsdf }
    }

    /// A point of a surface that is connected to an emitter.
    pub(crate) fn connected(world: &World, point: SurfacePoint, lamp: Lamp) -> Self {
        let at = Self::new(world, point, Bend::Straight);
        Self { normals: None, onward: Onward::To(lamp), ..at }
    }

    /// Where a ray along a unit direction w meets the triangle's plane, and the unit shading normal there, on the side that w points to.
    pub(crate) fn tangent_plane(&self, x: Vec3<ByU>, w: Vec3<ByU>) -> [Vec3<ByU>; 2] {
        let [a, b, c] = self.corners;
        let across = (b - a).cross(c - a).lift();
        let place = x + w * (across.dot(a.lift() - x) / across.dot(w));
        let weights = self.weights(place);
        let normal = match self.normals {
            None => self.point.ng.lift(),
            Some(normals) => normals
                .into_iter()
                .zip(weights)
                .fold(Vec3::zero(), |sum, (n, weight)| sum + n.lift() * weight)
                .normalize(),
        };
        [if normal.dot(w).re < 0.0 { -normal } else { normal }, place]
    }

    fn triangle<T: Real>(&self) -> Triangle<T> {
        let lift = |of: [Vec3; 3]| of.map(Vec3::lift);
        Triangle {
            corners: lift(self.corners),
            normals: self.normals.map(lift),
            more: T::zero(),
            shift: Vec3::zero(),
        }
    }

    fn pass<T: Real>(&self, ray: Ray<T>, triangle: &Triangle<T>) -> Ray<T> {
        let [a, b, c] = triangle.corners;
        let (e1, e2) = (b - a, c - a);
        let across = e1.cross(e2);
        let x = ray.x + ray.w * (across.dot(a - ray.x) / across.dot(ray.w));
        let n = match triangle.normals {
            None => across,
            Some([na, nb, nc]) => {
                let square = across.length_squared();
                let at = x - a;
                let (s, t) = (across.dot(at.cross(e2)) / square, across.dot(e1.cross(at)) / square);
                na * (T::one() - s - t) + nb * s + nc * t
            }
        };
        let Triangle { more, shift, .. } = *triangle;
        self.onward.ray(x, ray.w, n.normalize(), more, shift)
    }
}

impl Link {
    /// True where normals are interpolated.
    pub(crate) fn is_interpolated(&self) -> bool {
        self.normals.is_some()
    }

    fn lamp_moves(&self) -> bool {
        matches!(self.onward, Onward::To(Lamp { moves: true, .. }))
    }

    fn corner(&self, k: usize) -> MaterialPoint {
        let at = drt_motion::SurfacePoint { triangle: self.point.triangle, bary: CORNERS[k] };
        MaterialPoint { shape: self.point.shape, at }
    }

    /// How the normal of the triangle moves as one of its corners does.
    fn normal_rate(&self, k: usize, velocity: Vec3) -> Vec3<ByU> {
        let corners = from_fn::<_, 3, _>(|i| {
            let (at, rate) = (self.corners[i].to_array(), velocity.to_array());
            let rate = if i == k { rate } else { [0.0; 3] };
            Vec3::from(from_fn::<_, 3, _>(|axis| Dual::<f64, 1>::new(at[axis], [rate[axis]])))
        });
        let [a, b, c] = corners;
        let n = (b - a).cross(c - a).normalize();
        let rate: Vec3 = n.to_array().map(|c| c.eps[0]).into();
        rate.lift()
    }

    /// The weights of the corners at a point of the triangle's plane.
    fn weights(&self, y: Vec3<ByU>) -> [ByU; 3] {
        let [a, b, c] = self.corners;
        let (e1, e2) = (b - a, c - a);
        let across = e1.cross(e2);
        let along = across * across.length_squared().recip();
        let at = y - a.lift();
        let by = |v: Vec3| at.dot(v.lift());
        let (s, t) = (by(e2.cross(along)), by(along.cross(e1)));
        [ByU::from(1.0) - s - t, s, t]
    }

    /// 1 in the middle of the triangle, and 0 on its border.
    pub(crate) fn inside(&self, y: Vec3<ByU>) -> ByU {
        let [a, b, c] = self.weights(y);
        a * b * c * 27.0
    }

    /// `slopes` are the gradients of the normals at the corners, where these are interpolated.
    fn meeting(&self, before: [Vec3<ByU>; 2], y: Vec3<ByU>, slopes: &Option<[Mat3; 3]>) -> LinkHit {
        let [x, w] = before;
        let weights = self.weights(y);
        let mut slope = Mat3 { cols: [Vec3::zero(); 3] };
        let (Some(normals), Some(slopes)) = (self.normals, slopes) else {
            let n = self.point.ng.lift();
            let length = ByU::from(1.0);
            let distance = (y - x).dot(w);
            return LinkHit { y, w, distance, n, weights, length, slope, grazing: 0.0 };
        };
        let mut sum = Vec3::zero();
        for ((normal, corner), weight) in normals.iter().zip(slopes).zip(weights) {
            sum += normal.lift() * weight;
            for (col, add) in slope.cols.iter_mut().zip(&corner.cols) {
                *col += add.lift() * weight;
            }
        }
        let length = sum.length();
        let n = sum * length.recip();
        let distance = (y - x).dot(w);
        LinkHit { y, w, distance, n, weights, length, slope, grazing: GRAZING }
    }
}

impl RayVelocity {
    /// Nothing moves.
    const STILL: Self = {
        let still = Vec3 { x: ZERO, y: ZERO, z: ZERO };
        Self { x: still, w: still, beyond: ZERO }
    };

    /// The derivatives that a lane of dual numbers has.
    fn lane<const N: usize>(ray: &Ray<Dual<ByU, N>>, k: usize) -> Self {
        let by = |v: Vec3<Dual<ByU, N>>| v.to_array().map(|c| c.eps[k]).into();
        Self { x: by(ray.x), w: by(ray.w), beyond: ray.beyond.eps[k] }
    }
}

impl LinkHit {
    /// How far along the ray the surface is met later, where it is farther by v. Facets are seen at angles at which the surface that
    /// they stand for is not: there the shading normal is across the ray, and so nothing is divided by its cosine.
    fn later(&self, v: Vec3<ByU>) -> ByU {
        let cosine = self.n.dot(self.w);
        self.n.dot(v) * cosine / (cosine.squared() + self.grazing * self.grazing)
    }

    /// How the ray that goes on moves, as the one that arrives does.
    fn pass(&self, onward: Onward, rate: &RayVelocity) -> RayVelocity {
        let ray = rate.x + rate.w * self.distance;
        let x = ray - self.w * self.later(ray);
        let n = self.slope * x;
        self.turned(onward, OnwardRates { x, w: rate.w, n, ..OnwardRates::STILL })
    }

    /// How it moves as the surface does, by the velocity of the surface's point and the rate of its normal.
    fn moved(&self, onward: Onward, u: Vec3<ByU>, n: Vec3<ByU>) -> RayVelocity {
        let x = self.w * self.later(u);
        let n = n + self.slope * (x - u);
        self.turned(onward, OnwardRates { x, n, ..OnwardRates::STILL })
    }

    fn turned(&self, onward: Onward, rates: OnwardRates) -> RayVelocity {
        let OnwardRates { x, w, n, index, lamp } = rates;
        let variable = |v: Vec3<ByU>, rate: Vec3<ByU>| -> Vec3<Dual<ByU, 1>> {
            let (v, rate) = (v.to_array(), rate.to_array());
            from_fn::<_, 3, _>(|k| Dual::new(v[k], [rate[k]])).into()
        };
        let more = Dual::new(ZERO, [ByU::from(index)]);
        let (y, w) = (variable(self.y, x), variable(self.w, w));
        let (n, shift) = (variable(self.n, n.reject(self.n)), variable(Vec3::zero(), lamp));
        RayVelocity::lane(&onward.ray(y, w, n, more, shift), 0)
    }
}

/// The derivatives of the rays behind the surfaces of a chain, without jumps. `rays` are these rays, `slopes` the gradients of normals
/// at the corners of the surfaces where they are interpolated.
pub(crate) fn evened(
    start: Vec3,
    viewer_moves: bool,
    frame: &Frame,
    links: &[Link],
    rays: &[RayByU],
    slopes: &[Option<[Mat3; 3]>],
    changes: impl Fn(&SurfacePoint) -> LinkChange,
) -> Vec<Evened> {
    let u = from_fn(|k| Dual::<ByU, 2>::variable(Dual::variable(0.0, k), k));
    let d = direction(frame, u).to_array();
    let mut before = [start.lift(), d.map(|c| c.re).into()];
    let mut now = Evened {
        by_u: from_fn(|k| RayVelocity { w: d.map(|c| c.eps[k]).into(), ..RayVelocity::STILL }),
        by_movers: Vec::new(),
    };
    if viewer_moves {
        let axes = AXES.map(|axis| RayVelocity { x: axis.lift(), ..RayVelocity::STILL });
        now.by_movers.push(RayByMover { mover: Mover::Viewer, axes });
    }
    let mut pass = |((link, ray), slopes): ((&Link, &RayByU), &Option<[Mat3; 3]>)| {
        let meeting = link.meeting(before, ray.x, slopes);
        before = [ray.x, ray.w];
        let rates = now.by_movers.iter_mut().flat_map(|m| &mut m.axes);
        for rate in now.by_u.iter_mut().chain(rates) {
            *rate = meeting.pass(link.onward, rate);
        }
        let LinkChange { moves, bends } = changes(&link.point);
        if moves {
            now.by_movers.extend(link.movers(&meeting));
        }
        if bends {
            let still = RayVelocity::STILL;
            let rates = OnwardRates { index: 1.0, ..OnwardRates::STILL };
            let axes = [meeting.turned(link.onward, rates), still, still];
            now.by_movers.push(RayByMover { mover: Mover::Index(link.bsdf), axes });
        }
        if link.lamp_moves() {
            let axes = AXES.map(|axis| {
                let rates = OnwardRates { lamp: axis.lift(), ..OnwardRates::STILL };
                meeting.turned(link.onward, rates)
            });
            now.by_movers.push(RayByMover { mover: Mover::Lamp, axes });
        }
        now.clone()
    };
    links.iter().zip(rays).zip(slopes).map(&mut pass).collect()
}

impl Link {
    fn movers(&self, meeting: &LinkHit) -> impl Iterator<Item = RayByMover> {
        let still = Vec3::zero();
        let places = (0..3).map(move |k| {
            let axes = AXES.map(|axis| {
                let turned = if self.is_interpolated() { still } else { self.normal_rate(k, axis) };
                meeting.moved(self.onward, axis.lift() * meeting.weights[k], turned)
            });
            RayByMover { mover: Mover::Place(EdgeMatter::of(self.corner(k))), axes }
        });
        let normals = (0..3).filter(|_| self.is_interpolated()).map(move |k| {
            let share = meeting.weights[k] / meeting.length;
            let axes = AXES.map(|axis| meeting.moved(self.onward, still, axis.lift() * share));
            RayByMover { mover: Mover::Normal(self.corner(k)), axes }
        });
        places.chain(normals)
    }
}

/// The cosine of the grazing angle below which [`Evened`] derivatives are less than those of a smooth surface.
const GRAZING: f64 = 0.05;

const ZERO: ByU = Dual { re: 0.0, eps: [0.0; 2] };

const AXES: [Vec3; 3] = [Vec3::X, Vec3::Y, Vec3::Z];

const CORNERS: [[f64; 2]; 3] = [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]];

/// The direction at u in a frame about the present one.
fn direction<T: Real>(frame: &Frame, u: [T; 2]) -> Vec3<T> {
    (frame.n.lift() + frame.s.lift() * u[0] + frame.t.lift() * u[1]).normalize()
}

/// The first ray of a chain, by u.
pub(crate) fn first_ray(start: Vec3, frame: &Frame) -> [Vec3<ByU>; 2] {
    [start.lift(), direction(frame, from_fn(|k| ByU::variable(0.0, k)))]
}

/// The ray behind each of a chain's surfaces. `frame` is about the first ray's direction.
pub(crate) fn rays_by_u(start: Vec3, frame: &Frame, links: &[Link]) -> Vec<RayByU> {
    let u = from_fn(|k| Dual::<ByU, 2>::variable(Dual::variable(0.0, k), k));
    let mut ray = Ray::starting(start.lift(), direction(frame, u));
    let mut pass = |link: &Link| {
        ray = link.pass(ray, &link.triangle());
        let value = |v: Vec3<Dual<ByU, 2>>| v.to_array().map(|c| c.re).into();
        RayByU {
            x: value(ray.x),
            w: value(ray.w),
            beyond: ray.beyond.re,
            by_u: from_fn(|k| RayVelocity::lane(&ray, k)),
        }
    };
    links.iter().map(&mut pass).collect()
}

/// The ray behind the last of a chain's surfaces, by everything of it that moves: the viewer, and the links of which `changes` says so.
pub(crate) fn ray_by_movers(
    start: Vec3,
    viewer_moves: bool,
    frame: &Frame,
    links: &[Link],
    changes: impl Fn(&SurfacePoint) -> LinkChange,
) -> Vec<RayByMover> {
    let u = from_fn(|k| ByU::variable(0.0, k));
    let d = direction(frame, u).to_array().map(constant).into();
    let first = Ray::starting(start.lift(), d);
    let mut found = Vec::new();
    let through = |ray: Ray<ByMatter>, from: usize| {
        links[from..].iter().fold(ray, |ray, link| link.pass(ray, &link.triangle()))
    };
    if viewer_moves {
        let ray = through(Ray { x: variable(start, 0), ..first }, 0);
        found.push(RayByMover { mover: Mover::Viewer, axes: axes(&ray, 0) });
    }
    let mut before = first;
    for (i, link) in links.iter().enumerate() {
        let still = link.triangle();
        let LinkChange { moves, bends } = changes(&link.point);
        if moves {
            let corner = |k: usize| link.corner(k);
            let mut add = |triangle: &Triangle<ByMatter>, mover: &dyn Fn(usize) -> Mover| {
                let ray = through(link.pass(before, triangle), i + 1);
                found.extend((0..3).map(|k| RayByMover { mover: mover(k), axes: axes(&ray, k) }));
            };
            let corners = from_fn(|k| variable(link.corners[k], k));
            add(&Triangle { corners, ..still }, &|k| Mover::Place(EdgeMatter::of(corner(k))));
            if let Some(normals) = link.normals {
                let normals = Some(from_fn(|k| variable(normals[k], k)));
                add(&Triangle { normals, ..still }, &|k| Mover::Normal(corner(k)));
            }
        }
        if bends {
            let more = Dual::variable(ByU::from(0.0), 0);
            let ray = through(link.pass(before, &Triangle { more, ..still }), i + 1);
            found.push(RayByMover { mover: Mover::Index(link.bsdf), axes: axes(&ray, 0) });
        }
        if link.lamp_moves() {
            let shift = variable(Vec3::ZERO, 0);
            let ray = through(link.pass(before, &Triangle { shift, ..still }), i + 1);
            found.push(RayByMover { mover: Mover::Lamp, axes: axes(&ray, 0) });
        }
        before = link.pass(before, &still);
    }
    found
}

fn constant(value: ByU) -> ByMatter {
    Dual::new(value, [ByU::from(0.0); LANES])
}

/// A point whose coordinates are the lanes of the `k`-th of three.
fn variable(v: Vec3, k: usize) -> Vec3<ByMatter> {
    let v = v.to_array();
    from_fn::<_, 3, _>(|axis| Dual::variable(ByU::from(v[axis]), 3 * k + axis)).into()
}

fn axes(ray: &Ray<ByMatter>, k: usize) -> [RayVelocity; 3] {
    from_fn(|axis| RayVelocity::lane(ray, 3 * k + axis))
}

#[cfg(test)]
mod tests;
