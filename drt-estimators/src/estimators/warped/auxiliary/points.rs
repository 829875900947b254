//! Auxiliary points around a vertex on a surface, in the material form (2023 paper, §5.1 and Algorithm 1).
//!
//! A vertex p, seen from y at the distance r_0, moves with its matter, and by v besides. Points q are drawn in the tangent plane
//! of p by a normal distribution and projected onto all surfaces along the normal of p. With d the unit direction from y
//! to q, N the normal at q, O the first surface on the way and k = |q - y| / |O - y|, what hides q has the velocity (theory
//! sheet §9)
//!
//! ```text
//! v_dis(q) = P [k (u_O - y_dot) - (u(q) - y_dot)],    P = 1 - d N^T / (N·d),
//! ```
//!
//! and 0 where q is seen. y_dot is the whole velocity of y, so that each vertex takes that of the one before as it is
//! (theory sheet §9.3); printed is that of matter alone.

use alloc::vec::Vec;

use drt_geom::{Ray, Skip};
use drt_math::{Frame, Real, Vec3, fm};

use crate::derivative::sensitivity::ActiveInputs;
use crate::derivative::velocity::{
    Auxiliary, Blend, Found, Moved, Movers, Probe, VelocityField, VertexVelocity,
};
use crate::estimators::warped::auxiliary::kernel::{Distance, SIGMA, WIDE, weight};
use crate::estimators::warped::auxiliary::rims::Rims;
use crate::estimators::warped::auxiliary::{Sample, plan, ratio};
use crate::estimators::warped::edges::TurningEdges;
use crate::model::settings::{AuxiliarySamples, WarpKernel};
use crate::sampling::trace::Endpoint;
use crate::world::World;
use crate::world::rays::short_of;
use crate::world::vertex::{Matter, SurfacePoint, Vertex};

/// Standard deviations of the samples within which something must move.
const NEAR: f64 = 6.0;

/// Velocities of surface vertices from auxiliary points.
#[derive(Debug)]
pub(crate) struct AuxiliaryPoints {
    asked: AuxiliarySamples,
    movers: Movers,
    edges: TurningEdges,
    rims: Rims,
}

/// A hidden point, and what hides it.
#[derive(Clone, Copy, Debug)]
struct Hidden {
    /// P.
    direction: Vec3,
    normal: Vec3,
    q: Matter,
    occluder: Matter,
    k: f64,
}

impl AuxiliaryPoints {
    pub(in crate::estimators::warped) fn new(
        world: &World,
        active: &ActiveInputs,
        edges: TurningEdges,
        samples: AuxiliarySamples,
    ) -> Self {
        let movers = Movers::new(active);
        Self { asked: samples, movers, edges, rims: Rims::new(world) }
    }

    /// Adds the summands of a vertex at `x`, seen from a viewer over a `distance`.
    #[allow(clippy::too_many_arguments)]
    fn smooth(
        &self,
        world: &World,
        viewer: &Vertex,
        viewer_moves: bool,
        (point, x): (&SurfacePoint, Vec3),
        distance: f64,
        probe: &mut Probe,
        auxiliary: &mut Vec<Auxiliary>,
    ) {
        let length = world.geometry.radius;
        let sigma = SIGMA * length;
        let spread = match self.asked.kernel {
            WarpKernel::Year2020 => WIDE * distance,
            _ => sigma,
        };
        let dir = (x - viewer.x) / distance;
        let angle = f64::min(NEAR * spread / distance, 1.5);
        if !self.edges.any_near(viewer, dir, angle, viewer_moves) {
            return;
        }
        let (count, sets) = plan(&self.asked, &mut probe.rng);
        let frame = Frame::from_normal(point.ng);
        let mut samples = Vec::new();
        let mut ends = Vec::new();
        for _ in 0..count {
            let [u, v] = probe.rng.next_2d();
            let square = -2.0 * fm::ln(1.0 - u);
            let (sin, cos) = fm::sin_cos(core::f64::consts::TAU * v);
            let radius = spread * Real::sqrt(square);
            let flat = frame.s * (radius * cos) + frame.t * (radius * sin);
            let pdf = fm::exp(-0.5 * square) / (core::f64::consts::TAU * spread * spread);
            let far = 2.0 * length + radius;
            let ray = Ray { origin: x + flat - point.ng * far, dir: point.ng, t_max: 2.0 * far };
            let mut hits = core::mem::take(&mut probe.hits);
            probe.rays += 1;
            world.geometry.bvh.closest_through(&ray, Skip::NOTHING, |_| false, &mut hits);
            for hit in &hits {
                let (q, place) = world.point(hit.prim, hit.bary);
                let cosine = Real::abs(q.ng.dot(point.ng));
                if cosine > 0.0 {
                    let seen = (viewer, point, x, distance, dir);
                    samples.extend(self.sample(world, seen, (&q, place), pdf * cosine, probe));
                }
            }
            probe.hits = hits;
            ends.push(samples.len());
        }
        for (set, factor) in sets {
            let at = |part: f64| match (part * f64::from(count)) as usize {
                0 => 0,
                n => ends[n - 1],
            };
            if factor == 0.0 {
                continue;
            }
            let set = &samples[at(set.start)..at(set.end)];
            ratio(set, factor, |hidden: Hidden, value, slope| {
                let Hidden { direction, normal, q, occluder, k } = hidden;
                for e in [frame.s, frame.t] {
                    // The transpose of P.
                    let functional = e - normal * (e.dot(direction) / normal.dot(direction));
                    for (matter, factor) in [(occluder, k), (q, -1.0)] {
                        auxiliary.push(Auxiliary {
                            matter,
                            functional: functional * factor,
                            displacement: e * value,
                            divergence: slope.dot(e),
                            moved: Moved::FromViewer,
                        });
                    }
                }
            });
        }
    }

    /// A point q on a surface near the vertex, drawn with a density; `None` where it has no weight.
    fn sample(
        &self,
        world: &World,
        (viewer, point, x, distance, dir): (&Vertex, &SurfacePoint, Vec3, f64, Vec3),
        (q, place): (&SurfacePoint, Vec3),
        pdf: f64,
        probe: &mut Probe,
    ) -> Option<Sample<Hidden>> {
        let length = world.geometry.radius;
        let y = viewer.x;
        let away = (place - y).length();
        let direction = (place - y) / away;
        let own = viewer.surface().map_or(u32::MAX, |s| s.prim);
        let skip = Skip::two(own, q.prim);
        let ray = Ray { origin: y, dir: direction, t_max: short_of(y, away) };
        probe.rays += 1;
        let occluder = world.geometry.bvh.closest(&ray, skip);
        let printed = |s: &SurfacePoint, x: Vec3| self.rims.printed(world, s, x, y, length);
        let (boundary, velocity) = match occluder {
            None if self.asked.kernel == WarpKernel::Corrected => {
                (f64::min(self.rims.to_crease(world, q, place) / length, 1.0), None)
            }
            None => (1.0, None),
            Some(hit) => {
                let (o, at) = world.point(hit.prim, hit.bary);
                let boundary = match self.asked.kernel {
                    WarpKernel::Corrected => {
                        f64::min(self.rims.to_silhouette(world, &o, at, y) / length, 1.0)
                    }
                    _ if q.ng.dot(direction) < 0.0 => printed(&o, at),
                    _ => printed(q, place),
                };
                let [q_matter, o_matter] = [q, &o].map(|s| Matter::Surface(s.material()));
                let k = away / (at - y).length();
                let (normal, q) = (q.ng, q_matter);
                (boundary, Some(Hidden { direction, normal, q, occluder: o_matter, k }))
            }
        };
        let d = match self.asked.kernel {
            WarpKernel::Year2020 => {
                let c = dir.dot(direction);
                Distance::of_cosine(c, (direction - dir * c) / distance)
            }
            _ => {
                // r²/σ = |q - p|² / (r_0 σ_0) and 1/σ = r_0 / σ_0, with gradients by p.
                let sigma = SIGMA * length;
                let apart = x - place;
                let scale = 1.0 / (distance * sigma);
                let s = apart.length_squared() * scale;
                let ds = apart * (2.0 * scale) - dir * (s / distance);
                Distance::saturating((s, ds), (distance / sigma, dir / sigma))
            }
        };
        let (w, gradient) = weight(self.asked.kernel, d, boundary);
        let n = point.ng;
        let gradient = (gradient - n * gradient.dot(n)) / pdf;
        let weight = w / pdf;
        (weight.is_finite() && gradient.is_finite()).then_some(Sample {
            weight,
            gradient,
            velocity,
        })
    }
}

impl VelocityField for AuxiliaryPoints {
    fn camera(&self) -> VertexVelocity {
        VertexVelocity { moves: self.movers.camera, blend: Blend::MATERIAL, ..Default::default() }
    }

    fn vertex(
        &self,
        world: &World,
        found: &Found<'_>,
        probe: &mut Probe,
        auxiliary: &mut Vec<Auxiliary>,
    ) -> VertexVelocity {
        let first = auxiliary.len();
        let arrival = found.arrival;
        let mut moves = false;
        if let Endpoint::Surface(v) = &arrival.end
            && let Some(s) = v.surface()
        {
            moves = self.movers.moves(&Matter::Surface(s.material()));
            let eye = world.eye_of(v.x);
            let viewer = found.viewer.unwrap_or(&eye);
            let at = (s, v.x);
            self.smooth(world, viewer, found.ray_moves, at, arrival.distance, probe, auxiliary);
        }
        moves |= auxiliary.len() > first;
        let auxiliary = first..auxiliary.len();
        VertexVelocity { moves, blend: Blend::MATERIAL, auxiliary, turn: None }
    }

    fn looks_around(&self) -> bool {
        true
    }

    fn light(
        &self,
        world: &World,
        viewer: &Vertex,
        end: &Vertex,
        _: Vec3,
        distance: f64,
        viewer_moves: bool,
        probe: &mut Probe,
        auxiliary: &mut Vec<Auxiliary>,
    ) -> VertexVelocity {
        let first = auxiliary.len();
        if let Some(s) = end.surface() {
            self.smooth(world, viewer, viewer_moves, (s, end.x), distance, probe, auxiliary);
        }
        let auxiliary = first..auxiliary.len();
        VertexVelocity { moves: true, blend: Blend::MATERIAL, auxiliary, turn: None }
    }

    fn is_random(&self) -> bool {
        true
    }

    fn follows_edges(&self) -> bool {
        true
    }

    fn blend(&self, _: &World, _: &Vertex, _: &Vertex, _: Vec3, _: f64) -> Blend {
        Blend::MATERIAL
    }
}
