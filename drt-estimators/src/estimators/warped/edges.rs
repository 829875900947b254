//! The edges that turn rays.

use alloc::collections::BTreeMap;
use alloc::sync::Arc;
use alloc::vec::Vec;
use core::convert::Infallible;
use core::ops::ControlFlow;

use drt_geom::Mesh;
use drt_geom::edges::{Cone, ConeSegment, ConeTree};
use drt_math::{Mat3, Vec3};

use crate::derivative::velocity::{EdgeMatter, RayTurn, TurnPart, TurningRay, Weight};
use crate::discontinuities::discontinuity_edge::{DiscontinuityEdge, DiscontinuityEdges};
use crate::estimators::warped::angular_distance::Beside;
use crate::estimators::warped::edge::{TurningEdge, is_untracked};
use crate::estimators::warped::edge_weights::Near;
use crate::estimators::warped::rates_across::{self, Border, Found};
use crate::model::scene::{Scene, Shape};
use crate::world::World;
use crate::world::vertex::{SurfacePoint, Vertex};

/// What keeps a ray from turning with the edges beside it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Limits {
    /// Farther away edges have no weight.
    pub(super) angle: f64,
    /// The weight, beside 1, of what does not turn.
    pub(super) rest: Weight,
    /// In place of that, the borders of a pixel, where edges are followed across [alone](super::rates_across).
    pub(super) borders: Option<[Border; 2]>,
}

/// The edges of a scene in trees of spheres.
#[derive(Debug, Default)]
pub(super) struct TurningEdges {
    list: Vec<TurningEdge>,
    all: ConeTree,
    moving: ConeTree,
    /// Shapes with creases between facets.
    faceted: Vec<bool>,
    /// Shapes with creases at which what they emit is the same on both sides.
    emits_alike: Vec<bool>,
    /// Shapes at whose creases light does not jump.
    untracked: Vec<bool>,
    /// Shapes with creases at which nothing that they scatter jumps, as seen from their front and from their back.
    even: Vec<[bool; 2]>,
    /// The gradients of the normals of smooth shapes at their vertices, where they are interpolated.
    normal_slopes: Vec<Vec<Mat3>>,
    /// To look these up.
    scene: Option<Arc<Scene>>,
}

impl TurningEdges {
    /// Of those that `moves` says to move, and `curved` to be on a curved surface, by its shape; with `lines` along which textures jump.
    pub(super) fn new(
        world: &World,
        edges: &DiscontinuityEdges,
        moves: impl Fn(&DiscontinuityEdge) -> bool,
        curved: impl Fn(u32) -> bool,
        lines: Vec<TurningEdge>,
    ) -> Self {
        let of_meshes = edges
            .list
            .iter()
            .map(|edge| TurningEdge::new(world, edges, edge, moves(edge), curved(edge.edge.shape)));
        let list: Vec<_> = of_meshes.chain(lines).collect();
        let tree = |of: &dyn Fn(&TurningEdge) -> bool| {
            let segments = list.iter().zip(0..).filter(|(edge, _)| of(edge));
            let segment = |(edge, name): (&TurningEdge, u32)| {
                let facets = edge.crease.filter(|_| edge.facets).map(|(normals, _)| normals);
                ConeSegment { ends: edge.ends, name, facets }
            };
            ConeTree::new(&segments.map(segment).collect::<Vec<_>>())
        };
        let (all, moving) = (tree(&|_| true), tree(&|edge| edge.moves));
        let shapes = &world.scene.shapes;
        let mut faceted = alloc::vec![false; shapes.len()];
        for shape in list.iter().filter_map(|edge| edge.within.filter(|_| edge.facets)) {
            faceted[shape as usize] = true;
        }
        let mut emits_alike = alloc::vec![None; shapes.len()];
        for edge in &edges.list {
            let Some(shape) = edges.shape_of_faces(world, edge) else { continue };
            let alike = &mut emits_alike[shape as usize];
            *alike.get_or_insert_with(|| world.emits_evenly(shape)) &=
                edges.faces_one_way(world, edge);
        }
        let mut even = alloc::vec![[false; 2]; shapes.len()];
        for (edge, turning) in edges.list.iter().zip(&list) {
            let Some(shape) = edges.shape_of_faces(world, edge) else { continue };
            let sides = &mut even[shape as usize];
            for (even, discontinuous) in sides.iter_mut().zip(turning.is_discontinuous()) {
                *even |= !discontinuous;
            }
        }
        let emits_alike = emits_alike.into_iter().map(|alike| alike.unwrap_or(false)).collect();
        let untracked = (0..shapes.len() as u32).map(|s| is_untracked(world, s)).collect();
        let slopes = |shape: &Shape| {
            if world.scene.bsdfs[shape.bsdf].item.is_smooth() {
                normal_slopes(&shape.mesh)
            } else {
                Vec::new()
            }
        };
        let normal_slopes = shapes.iter().map(slopes).collect();
        let scene = Some(Arc::clone(&world.scene));
        Self { list, all, moving, faceted, emits_alike, untracked, even, normal_slopes, scene }
    }

    /// True of a ray that ends on a shape at whose creases what it emits does not jump, though what it scatters may.
    pub(super) fn emission_turns_apart(&self, s: &SurfacePoint) -> bool {
        self.emits_alike[s.shape as usize]
    }

    /// Whether light does not jump at the creases of a shape.
    pub(super) fn is_untracked(&self, shape: u32) -> bool {
        self.untracked[shape as usize]
    }

    /// The gradients of the normals at the corners of a smooth surface, where they are interpolated.
    pub(super) fn normal_slopes(&self, s: &SurfacePoint) -> Option<[Mat3; 3]> {
        let slopes = &self.normal_slopes[s.shape as usize];
        let mesh = &self.scene.as_ref()?.shapes[s.shape as usize].mesh;
        let corners = mesh.triangles[s.triangle as usize];
        (!slopes.is_empty()).then(|| corners.map(|v| slopes[v as usize]))
    }

    pub(super) fn near(&self, ray: &TurningRay<'_>, angle: f64) -> Near {
        let alike = |s: &SurfacePoint| {
            ray.tangent_plane.is_some() || (ray.emission_alone && self.emission_turns_apart(s))
        };
        let creases_of = ray.end.filter(|s| !alike(s)).map(|s| s.shape);
        let facets = creases_of.is_some_and(|shape| self.faceted[shape as usize]);
        // Without the weight of a crease, nothing may jump there with the planes of facets.
        let even =
            |s: &SurfacePoint| self.even[s.shape as usize][usize::from(s.ng.dot(ray.dir) > 0.0)];
        let by_length = ray.end.is_some_and(|s| alike(s) || even(s));
        Near::of_ray(ray, angle, creases_of, by_length, facets)
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
        let tree = if viewer_moves { &self.all } else { &self.moving };
        tree.visit(&cone, &cone, |_| ControlFlow::Break(())).is_break()
    }

    /// Tells all edges in a cone, and some beside it.
    pub(super) fn visit_all<B>(
        &self,
        cone: &Cone,
        mut found: impl FnMut(&TurningEdge) -> ControlFlow<B>,
    ) -> ControlFlow<B> {
        self.all.visit(cone, cone, |i| found(&self.list[i as usize]))
    }

    /// Whether an edge that moves has a weight beside a ray.
    pub(super) fn moves_beside(&self, ray: &TurningRay<'_>, angle: f64) -> bool {
        self.any_moves_near(&self.near(ray, angle))
    }

    fn any_moves_near(&self, near: &Near) -> bool {
        let any = self.moving.visit(&near.cone, &near.narrow, |i| {
            match near.weight(&self.list[i as usize]) {
                Some(_) => ControlFlow::Break(()),
                None => ControlFlow::Continue(()),
            }
        });
        any.is_break()
    }

    /// How the edges beside a ray turn it. Without any that moves, unless `always` or the viewer moves, they do not.
    pub(super) fn turn(
        &self,
        ray: &TurningRay<'_>,
        limits: &Limits,
        always: bool,
        parts: &mut Vec<TurnPart>,
    ) -> Option<RayTurn> {
        let near = self.near(ray, limits.angle);
        if !(ray.moves || always || self.any_moves_near(&near)) {
            return None;
        }
        let first = parts.len();
        let (sum, rest) = match &limits.borders {
            Some(borders) => (self.gather_held(&near, ray, borders, parts), Weight::default()),
            None => (self.gather(&near, ray.moves, parts), limits.rest),
        };
        if sum.value == 0.0 {
            return None;
        }
        let total = Weight::constant(1.0) + sum + rest;
        if limits.borders.is_none() {
            divide(&mut parts[first..], ray.dir, total);
        }
        let Weight { value: weight, gradient } = sum / total;
        Some(RayTurn { weight, gradient, parts: first..parts.len(), chain: 0..0, shadow: None })
    }

    /// Adds up the weights of edges beside a ray of a camera at rest, and what turns it across these and the borders of its pixel.
    pub(super) fn gather_held(
        &self,
        near: &Near,
        ray: &TurningRay<'_>,
        borders: &[Border],
        parts: &mut Vec<TurnPart>,
    ) -> Weight {
        let (mut sum, mut all) = (Weight::default(), Vec::new());
        self.visit(near, |edge, beside, weight| {
            sum += weight;
            all.push(Found { edge, beside: *beside, weight });
        });
        if sum.value > 0.0 {
            rates_across::turn(ray.viewer.x, ray.dir, &all, borders, parts);
        }
        sum
    }

    /// Adds up the weights of edges beside a ray, and what they turn it by if these were divided by 1.
    pub(super) fn gather(
        &self,
        near: &Near,
        viewer_moves: bool,
        parts: &mut Vec<TurnPart>,
    ) -> Weight {
        let mut sum = Weight::default();
        let mut resting = Weight::default();
        self.visit(near, |edge, beside, weight| {
            sum += weight;
            // Of one of the ends, whose part in the nearest point is so much.
            let mut add = |matter, part: Weight| {
                let Weight { value: rate, gradient: divergence } = weight * part / beside.distance;
                match matter {
                    Some(_) => {
                        parts.push(even(matter, Weight { value: rate, gradient: divergence }))
                    }
                    None => resting += Weight { value: rate, gradient: divergence },
                }
            };
            let one = Weight::constant(1.0);
            if edge.moves {
                for (end, part) in [one - beside.along, beside.along].into_iter().enumerate() {
                    edge.matter(end).for_each(|matter| add(Some(matter), part));
                }
            } else if viewer_moves {
                add(None, one);
            }
        });
        if resting.value > 0.0 {
            parts.push(even(None, resting));
        }
        sum
    }

    /// Tells all edges that have a weight, and how near they are.
    pub(super) fn visit<'a>(
        &'a self,
        near: &Near,
        mut found: impl FnMut(&'a TurningEdge, &Beside, Weight),
    ) {
        let all = self.all.visit::<Infallible>(&near.cone, &near.narrow, |i| {
            let edge = &self.list[i as usize];
            if let Some((beside, weight)) = near.weight(edge) {
                found(edge, &beside, weight);
            }
            ControlFlow::Continue(())
        });
        debug_assert!(all.is_continue());
    }
}

/// The gradient of a mesh's unit normals by the place at each vertex, 1 / scene units: the mean of those in the middle of the triangles
/// around it, by their areas. Vertices at one place that have one normal, as along seams of texture coordinates, count as one. Empty of
/// a mesh without normals.
fn normal_slopes(mesh: &Mesh) -> Vec<Mat3> {
    let Some(normals) = &mesh.normals else { return Vec::new() };
    let key = |v: usize| {
        let [x, n] = [mesh.positions[v], normals[v]];
        [x, n].map(|v| v.to_array().map(f64::to_bits))
    };
    let mut sums = BTreeMap::new();
    for (t, corners) in (0..).zip(&mesh.triangles) {
        let [a, b, c] = mesh.triangle(t);
        let area = (b - a).cross(c - a).length();
        let [i, j, k] = corners.map(|v| normals[v as usize]);
        let sum = (i + j + k) * (1.0 / 3.0);
        let [g, h] = mesh.barycentric_gradients(t);
        let n = sum.normalize();
        let [along_g, along_h] = [j - i, k - i].map(|d| d.reject(n) * (area / sum.length()));
        let cols = [Vec3::X, Vec3::Y, Vec3::Z].map(|e| along_g * g.dot(e) + along_h * h.dot(e));
        let slope = Mat3 { cols };
        if !slope.is_finite() {
            continue;
        }
        for v in corners {
            let (total, weight) = sums.entry(key(*v as usize)).or_insert((Mat3::ZERO, 0.0));
            *total = *total + slope;
            *weight += area;
        }
    }
    let mean = |v: usize| match sums.get(&key(v)) {
        Some((total, weight)) if *weight > 0.0 => *total * weight.recip(),
        _ => Mat3::ZERO,
    };
    (0..mesh.positions.len()).map(mean).collect()
}

/// A summand that is not divided yet, whose rate is the same in all directions across the ray.
fn even(matter: Option<EdgeMatter>, rate: Weight) -> TurnPart {
    TurnPart { matter, rate: Mat3::IDENTITY * rate.value, divergence: rate.gradient }
}

/// Divides what turns a ray evenly by the sum of all weights.
pub(super) fn divide(parts: &mut [TurnPart], dir: Vec3, total: Weight) {
    for part in parts {
        let even = part.rate.trace() / 3.0;
        let share = Weight { value: even, gradient: part.divergence } / total;
        part.rate = Mat3::IDENTITY * share.value;
        // What is across the ray turns along it as the ray turns.
        part.divergence = share.gradient - dir * (2.0 * share.value);
    }
}
