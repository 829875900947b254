//! Shadow boundaries of directly lit media, found along camera rays.
//!
//! An edge and a light point y span a shadow surface. A camera ray o + t d meets it at one point D,
//! where the in-scattered light of y jumps. Rewriting the collapsed kernel from (edge length, r_D)
//! to the image, with dl dr_D = dA r_B / (r_D sinB) on the shadow surface and dA = dω t² / |N·d|,
//!
//! ```text
//! ∫ P dq  I(w) τ(y, D) σ_s f_p τ(D, o) N·(u_B - (1-l) u_S - l u_D) / (r_B r_D |N·d|),
//! ```
//!
//! which has no 1/r² at the camera, needs no splat and works however small the pixel is. A sampled
//! point of an area light is a point light of intensity L_e cos / p_A; a directional light has the
//! denominator |N·d| alone. Every edge is tried for every ray, so this serves scenes with few edges
//! ([`Shadows::MOST_EDGES`]); the splatting strategies then leave these paths out.

use alloc::vec::Vec;

use drt_math::{Ray, Real, Rgb, Vec3};

use crate::derivative::sensitivity::{VelocityFunctional, VelocityTerm};
use crate::discontinuities::edge::Edge;
use crate::model::emitter::{Emitter, EmitterGradient};
use crate::sampling::trace::Tracer;
use crate::world::vertex::SurfacePoint;
use crate::world::{RayPath, World};
use crate::world::{Tracking, intervals, short_of};

/// Edges whose shadows are looked for along camera rays.
#[derive(Debug)]
pub(crate) struct Shadows {
    edges: Vec<Edge>,
}

/// Reusable buffers.
#[derive(Debug, Default)]
pub(crate) struct Buffers {
    functional: VelocityFunctional,
    segment: RayPath,
}

/// The light's end of a shadow.
enum ShadowLight {
    /// A point, with its surface point where it lies on one.
    Point(Vec3, Option<SurfacePoint>),
    /// A direction of travel.
    Direction(Vec3),
}

/// Where a camera ray meets the shadow surface of an edge.
struct FluxSample {
    t: f64,
    /// Position along the edge, from 0 to 1.
    s: f64,
    /// Unit, from the light.
    w: Vec3,
    /// Distances from the light; infinite for directions.
    r_edge: f64,
    r_point: f64,
}

impl Shadows {
    /// More edges than this are left to splatting.
    pub(crate) const MOST_EDGES: usize = 96;

    /// Takes edges of a scene in which lights shine into media, if they are few.
    pub(crate) fn new(world: &World, edges: Vec<Edge>) -> Option<Self> {
        let lit = world.max_depth >= 2
            && world.tracking.contains(&Tracking::Vertices)
            && (world.lights.has_areas()
                || world.scene.emitters.iter().any(|e| e.item.emitter.is_delta()));
        (lit && !edges.is_empty() && edges.len() <= Self::MOST_EDGES).then_some(Self { edges })
    }

    /// Calls `add` with the functional and the weight of each shadow boundary along a camera ray, which was
    /// followed from `eye` along `dir`.
    #[allow(clippy::too_many_arguments)]
    pub(crate) fn along_camera_ray(
        &self,
        tracer: &mut Tracer<'_>,
        eye: Vec3,
        dir: Vec3,
        ray: &RayPath,
        b: &mut Buffers,
        mut add: impl FnMut(&VelocityFunctional, Rgb),
    ) -> Option<()> {
        let world = tracer.world;
        let choice = world.lights.choose(&mut tracer.rng)?;
        let source = match choice.delta {
            Some(e) => match world.scene.emitters[e].item.emitter {
                Emitter::Directional { direction, .. } => ShadowLight::Direction(direction),
                ref other => ShadowLight::Point(other.position()?, None),
            },
            None => {
                let (point, y) = world.lights.point_of(world, &choice, &mut tracer.rng)?;
                ShadowLight::Point(y, Some(point))
            }
        };
        for edge in &self.edges {
            if let Some(m) = meet(edge, &source, eye, dir)
                && m.t < ray.length
            {
                self.shadow(tracer, eye, dir, ray, edge, &source, &choice, &m, b, &mut add);
            }
        }
        Some(())
    }

    #[allow(clippy::too_many_arguments)]
    fn shadow(
        &self,
        tracer: &mut Tracer<'_>,
        eye: Vec3,
        dir: Vec3,
        ray: &RayPath,
        edge: &Edge,
        source: &ShadowLight,
        choice: &crate::world::lights::Choice,
        m: &FluxSample,
        b: &mut Buffers,
        add: &mut impl FnMut(&VelocityFunctional, Rgb),
    ) -> Option<()> {
        let world = tracer.world;
        let n = edge.wedge.occluded_side(m.w)?;
        let part = intervals(ray.medium, &ray.crossings, ray.length)
            .find(|i| i.start <= m.t && m.t < i.end)?;
        let medium = part.medium?;
        if world.tracking[medium] != Tracking::Vertices {
            return None;
        }
        tracer.counters.boundary_samples += 1;
        let x = eye + dir * m.t;
        let x_edge = edge.wedge.at(m.s);
        // Light: from the edge back to the source, and on to the point.
        let tau = self.open(tracer, edge, x_edge, -m.w, source, m.r_edge, b)?
            * self.open(
                tracer,
                edge,
                x_edge,
                m.w,
                &ShadowLight::Point(x, None),
                (x - x_edge).length(),
                b,
            )?;
        let (strength, fall) = match source {
            ShadowLight::Point(_, Some(s)) => {
                let cosine = s.ng.dot(m.w);
                (
                    world.emitted(s, m.w) * (f64::max(cosine, 0.0) * choice.inverse_area_pdf()),
                    m.r_edge * m.r_point,
                )
            }
            ShadowLight::Point(_, None) => {
                let e = choice.delta?;
                let light = &world.scene.emitters[e].item.emitter;
                (light.emission(m.w).value * (1.0 / choice.pmf), m.r_edge * m.r_point)
            }
            ShadowLight::Direction(_) => {
                let e = choice.delta?;
                (world.scene.emitters[e].item.emitter.emission(m.w).value * (1.0 / choice.pmf), 1.0)
            }
        };
        let c = world.medium(medium).coefficients(x);
        let scattered = c.sigma_s() * world.medium(medium).phase_at(x).eval(-dir, -m.w);
        let value = strength * scattered * tau * (1.0 / (fall * Real::abs(n.dot(dir))));
        if value.is_zero() || !value.is_finite() {
            return None;
        }
        b.segment.truncate_from(ray, m.t);
        let seen = world.transmittance(
            &Ray::new(eye, dir),
            &b.segment,
            &mut tracer.rng,
            &mut tracer.counters,
        );
        let items = &mut b.functional.items;
        items.clear();
        items.extend(edge.velocity_terms(world, m.s, n));
        let l = match source {
            ShadowLight::Point(..) => m.r_edge / m.r_point,
            ShadowLight::Direction(_) => 1.0,
        };
        match (source, choice.delta) {
            (ShadowLight::Point(_, Some(s)), _) => {
                items.push(VelocityTerm::Surface(s.material(), n * -(1.0 - l)))
            }
            (ShadowLight::Point(_, None), Some(e)) => {
                let position = n * -(1.0 - l);
                items.push(VelocityTerm::Emitter(
                    e,
                    EmitterGradient { position, ..EmitterGradient::default() },
                ));
            }
            (ShadowLight::Direction(_), Some(e)) => {
                let direction = n * (x - x_edge).length();
                items.push(VelocityTerm::Emitter(
                    e,
                    EmitterGradient { direction, ..EmitterGradient::default() },
                ));
            }
            _ => {}
        }
        items.push(VelocityTerm::Volume(medium, x, n * -l));
        add(&b.functional, value * seen);
        Some(())
    }

    /// Transmittance from an edge point to a source or point, past the edge's faces.
    #[allow(clippy::too_many_arguments)]
    fn open(
        &self,
        tracer: &mut Tracer<'_>,
        edge: &Edge,
        x: Vec3,
        w: Vec3,
        to: &ShadowLight,
        distance: f64,
        b: &mut Buffers,
    ) -> Option<Rgb> {
        let world = tracer.world;
        let medium = edge.surrounding().toward(world, x, w);
        world.cast_past(x, edge.wedge.faces, medium, w, &mut b.segment, &mut tracer.counters);
        let reached = match to {
            ShadowLight::Point(_, Some(s)) => {
                b.segment.end.as_ref().is_some_and(|(p, _)| p.prim == s.prim)
            }
            _ => b.segment.length >= short_of(x, distance),
        };
        if !reached {
            return None;
        }
        b.segment.cut(distance);
        let segment = &b.segment;
        Some(world.transmittance(&Ray::new(x, w), segment, &mut tracer.rng, &mut tracer.counters))
    }
}

/// Intersects a camera ray with the shadow surface of an edge.
fn meet(edge: &Edge, source: &ShadowLight, eye: Vec3, dir: Vec3) -> Option<FluxSample> {
    let [a, b] = edge.wedge.ends;
    let along = b - a;
    match source {
        ShadowLight::Point(y, _) => {
            let q = a - *y;
            let plane = q.cross(along);
            let t = -plane.dot(eye - *y) / plane.dot(dir);
            let p = eye + dir * t - *y;
            let s = -plane.dot(q.cross(p)) / plane.dot(along.cross(p));
            let to_edge = q + along * s;
            let (r_edge, r_point) = (to_edge.length(), p.length());
            let between = to_edge.dot(p) > 0.0 && r_edge < r_point;
            (t > 0.0 && t.is_finite() && (0.0..1.0).contains(&s) && between).then(|| FluxSample {
                t,
                s,
                w: p / r_point,
                r_edge,
                r_point,
            })
        }
        ShadowLight::Direction(w) => {
            let plane = along.cross(*w);
            let t = plane.dot(a - eye) / plane.dot(dir);
            let p = eye + dir * t - a;
            let s = plane.dot(p.cross(*w)) / plane.length_squared();
            let behind = (p - along * s).dot(*w) > 0.0;
            (t > 0.0 && t.is_finite() && (0.0..1.0).contains(&s) && behind).then_some(FluxSample {
                t,
                s,
                w: *w,
                r_edge: f64::INFINITY,
                r_point: f64::INFINITY,
            })
        }
    }
}
