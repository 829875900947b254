//! The edges that turn rays.

use alloc::vec::Vec;

use drt_geom::edges::{Cone, ConeSegment, ConeTree};
use drt_math::{Real, Vec3, fm};

use crate::derivative::velocity::{RayTurn, TurnPart, TurningRay};
use crate::edges::discontinuities::{DiscontinuityEdge, DiscontinuityEdges};
use crate::terms::warped::beside::Beside;
use crate::world::vertex::{MaterialPoint, Vertex};

/// How far behind the plane of the surface where a ray ends edges turn it, over their distances.
const BEHIND: f64 = 0.02;

/// How far creases between the faces of curved surfaces turn rays, over what other edges do.
const NARROW: f64 = 0.1;

/// An edge at which radiance jumps.
#[derive(Clone, Debug)]
pub(super) struct TurningEdge {
    ends: [Vec3; 2],
    /// Half its length.
    half: f64,
    points: [MaterialPoint; 2],
    moves: bool,
    /// Between faces of a curved surface, on which vertices move with their matter.
    facets: bool,
    /// Of a crease: the normals of its faces on one side, and whether radiance jumps seen from that side, and the other.
    crease: Option<([Vec3; 2], [bool; 2])>,
}

impl TurningEdge {
    fn new(
        edges: &DiscontinuityEdges,
        edge: &DiscontinuityEdge,
        moves: bool,
        curved: bool,
    ) -> Self {
        let [(a, from), (b, to)] = [0.0, 1.0].map(|along| edge.point(along));
        let discontinuous = edge.crease.map(|part| part > 0.0);
        let crease = edges.normals(edge).map(|normals| (normals, discontinuous));
        let (ends, half) = ([a, b], 0.5 * edge.length());
        // Of a fold as sharp as a corner, or between materials, a part is 1.
        let facets = curved && edge.crease.iter().all(|part| *part < 1.0);
        Self { ends, half, points: [from, to], moves, facets, crease }
    }

    /// What radiance does there, seen along a vector.
    fn discontinuity(&self, view: Vec3) -> Discontinuity {
        let Some((normals, discontinuous)) = &self.crease else { return Discontinuity::Full };
        let [front, other] = normals.map(|n| n.dot(view) > 0.0);
        match discontinuous[usize::from(front)] {
            _ if front != other => Discontinuity::Full,
            false => Discontinuity::None,
            true if self.facets => Discontinuity::Facets,
            true => Discontinuity::Full,
        }
    }
}

/// What radiance does at an edge.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Discontinuity {
    None,
    /// Between faces of a curved surface that are both seen from one side.
    Facets,
    Full,
}

/// The edges of a scene in trees of spheres.
#[derive(Debug, Default)]
pub(super) struct TurningEdges {
    list: Vec<TurningEdge>,
    all: ConeTree,
    moving: ConeTree,
}

/// What the weight of an edge depends on besides the edge.
struct Near<'a> {
    ray: &'a TurningRay<'a>,
    /// Squared sine of the cone's angle.
    square: f64,
    cone: Cone,
    /// For creases of curved surfaces.
    narrow: Cone,
    /// The unit normal of the surface that the viewer is on, towards the ray's side.
    horizon: Option<Vec3>,
    /// Unit normal of the surface where the ray ends, away from the viewer; zero where it does not. And the viewer's distance
    /// from its plane.
    normal: Vec3,
    depth: f64,
}

/// A weight and its gradient by the direction.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Weight {
    pub(super) value: f64,
    pub(super) gradient: Vec3,
}

impl TurningEdges {
    /// Of those that `moves` says of their shape to move, and `curved` to be on a curved surface.
    pub(super) fn new(
        edges: &DiscontinuityEdges,
        moves: impl Fn(u32) -> bool,
        curved: impl Fn(u32) -> bool,
    ) -> Self {
        let list: Vec<_> = edges
            .list
            .iter()
            .map(|edge| {
                let shape = edge.edge.shape;
                TurningEdge::new(edges, edge, moves(shape), curved(shape))
            })
            .collect();
        let tree = |of: &dyn Fn(&TurningEdge) -> bool| {
            let segments = list.iter().zip(0..).filter(|(edge, _)| of(edge));
            let segment = |(edge, name): (&TurningEdge, u32)| {
                let facets = edge.crease.filter(|_| edge.facets).map(|(normals, _)| normals);
                ConeSegment { ends: edge.ends, name, facets }
            };
            ConeTree::new(&segments.map(segment).collect::<Vec<_>>())
        };
        let (all, moving) = (tree(&|_| true), tree(&|edge| edge.moves));
        Self { list, all, moving }
    }

    /// True when something moves.
    pub(super) fn any_moves(&self) -> bool {
        !self.moving.is_empty()
    }

    /// Whether anything may move within an `angle` of a ray from a viewer: an edge, or all of them if the viewer does.
    pub(super) fn any_near(
        &self,
        viewer: &Vertex,
        dir: Vec3,
        angle: f64,
        viewer_moves: bool,
    ) -> bool {
        let cone = Cone::new(viewer.x, dir, angle, f64::INFINITY);
        let mut any = false;
        let tree = if viewer_moves { &self.all } else { &self.moving };
        tree.visit(&cone, &cone, |_| any = true);
        any
    }

    /// How edges within an `angle` of a ray turn it, besides what does not turn with a weight of `rest` beside 1. Without any
    /// that moves, unless `always` or the viewer moves, they do not.
    pub(super) fn turn(
        &self,
        ray: &TurningRay<'_>,
        angle: f64,
        rest: Weight,
        always: bool,
        parts: &mut Vec<TurnPart>,
    ) -> Option<RayTurn> {
        let near = Near::new(ray, angle);
        if !(ray.moves || always) {
            let mut any = false;
            self.moving.visit(&near.cone, &near.narrow, |i| {
                any = any || near.weight(&self.list[i as usize]).is_some();
            });
            if !any {
                return None;
            }
        }
        let first = parts.len();
        let mut sum = Weight::default();
        let mut resting = TurnPart { matter: None, rate: 0.0, divergence: Vec3::ZERO };
        self.all.visit(&near.cone, &near.narrow, |i| {
            let edge = &self.list[i as usize];
            let Some((beside, weight)) = near.weight(edge) else { return };
            sum.value += weight.value;
            sum.gradient += weight.gradient;
            // Of one of the ends, whose part in the nearest point is so much.
            let mut add = |matter, part: f64, slope: f64| {
                let rate = weight.value * part / beside.distance;
                let divergence = (weight.gradient * part
                    + beside.along_gradient * (weight.value * slope))
                    / beside.distance
                    - beside.distance_gradient * (rate / beside.distance);
                match matter {
                    Some(_) => parts.push(TurnPart { matter, rate, divergence }),
                    None => {
                        resting.rate += rate;
                        resting.divergence += divergence;
                    }
                }
            };
            if edge.moves {
                let [from, to] = edge.points;
                add(Some(from), 1.0 - beside.along, -1.0);
                add(Some(to), beside.along, 1.0);
            } else if ray.moves {
                add(None, 1.0, 0.0);
            }
        });
        if sum.value == 0.0 {
            return None;
        }
        if resting.rate > 0.0 {
            parts.push(resting);
        }
        let total = 1.0 + sum.value + rest.value;
        let slope = sum.gradient + rest.gradient;
        for part in &mut parts[first..] {
            part.rate /= total;
            // What is across the ray turns along it as the ray turns.
            part.divergence =
                (part.divergence - slope * part.rate) / total - ray.dir * (2.0 * part.rate);
        }
        let weight = sum.value / total;
        let gradient = (sum.gradient - slope * weight) / total;
        Some(RayTurn { weight, gradient, parts: first..parts.len() })
    }
}

impl<'a> Near<'a> {
    fn new(ray: &'a TurningRay<'a>, angle: f64) -> Self {
        let TurningRay { viewer, dir, distance, end, .. } = *ray;
        let normal = end.map_or(Vec3::ZERO, |s| if s.ng.dot(dir) < 0.0 { -s.ng } else { s.ng });
        // Nothing is behind the sky.
        let depth = if end.is_some() { normal.dot(dir) * distance } else { 0.0 };
        let reach = f64::INFINITY;
        let cone = Cone::new(viewer.x, dir, angle, reach);
        let sine = fm::sin(angle);
        let horizon = viewer.surface().map(|s| if s.ng.dot(dir) < 0.0 { -s.ng } else { s.ng });
        let narrow = Cone::new(viewer.x, dir, NARROW * angle, reach);
        Self { ray, square: sine * sine, cone, narrow, horizon, normal, depth }
    }

    /// How far a point, less the viewer's place, is behind the plane of the surface where the ray ends.
    fn behind(&self, place: Vec3) -> f64 {
        self.normal.dot(place) - self.depth
    }

    /// An edge beside the ray and its weight; `None` where it has none.
    fn weight(&self, edge: &TurningEdge) -> Option<(Beside, Weight)> {
        let (from, w) = (self.ray.viewer.x, self.ray.dir);
        let [a, b] = edge.ends;
        let ends = [a - from, b - from];
        let below = |n: Vec3| ends.iter().all(|p| n.dot(*p) <= 1e-9 * p.length());
        let widest = match edge.discontinuity(ends[0]) {
            Discontinuity::None => return None,
            Discontinuity::Facets => self.square * (NARROW * NARROW),
            Discontinuity::Full => self.square,
        };
        // Most edges are farther away, by a sphere around them.
        let middle = (ends[0] + ends[1]) * 0.5;
        let along = middle.dot(w);
        let reach = along + edge.half;
        let across = middle.length_squared() - along * along;
        let least = Real::sqrt(f64::max(across, 0.0)) - edge.half;
        // Of what is nearer than a right angle the tangent is at most that of the sine.
        let outside = least > 0.0 && least * least * (1.0 - widest) > widest * reach * reach;
        if reach <= 0.0 || outside || self.horizon.is_some_and(below) {
            return None;
        }
        let beside = Beside::new(ends, w)?;
        if beside.square >= widest {
            return None;
        }
        let mut shown = Weight { value: 1.0, gradient: Vec3::ZERO };
        let behind = self.behind(beside.place);
        if behind > 0.0 {
            let q = behind / (BEHIND * beside.distance);
            if q >= 1.0 {
                return None;
            }
            let rest = 1.0 - q * q;
            let q_gradient = beside.along_gradient
                * (self.normal.dot(b - a) / (BEHIND * beside.distance))
                - beside.distance_gradient * (q / beside.distance);
            shown.value = rest * rest;
            shown.gradient = q_gradient * (-4.0 * q * rest);
        }
        // Of an edge that is not hidden the weight diverges where the ray meets it.
        let rise = shown.value * (widest - beside.square);
        let fall = beside.square + (1.0 - shown.value) * widest;
        let fall = f64::max(fall, f64::MIN_POSITIVE.sqrt());
        let rise_gradient =
            shown.gradient * (widest - beside.square) - beside.square_gradient * shown.value;
        let fall_gradient = beside.square_gradient - shown.gradient * widest;
        let weight = Weight {
            value: rise / fall,
            gradient: (rise_gradient - fall_gradient * (rise / fall)) / fall,
        };
        Some((beside, weight))
    }
}
