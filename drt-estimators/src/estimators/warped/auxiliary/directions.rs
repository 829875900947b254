//! Auxiliary directions around a ray, in the spatial form: warped-area sampling over the sphere (Bangaru et al. 2020).
//!
//! Each auxiliary ray tells how fast the direction of what it hits changes; their mean is the rate at which the ray
//! [turns](crate::derivative::velocity::RayTurn). All edges at which radiance jumps must be told by the boundary test: silhouettes,
//! borders and creases.

use alloc::sync::Arc;
use alloc::vec::Vec;

use drt_geom::{Ray, Skip};
use drt_math::{Frame, Mat3, Real, Vec3, fm};

use crate::derivative::velocity::{
    Auxiliary, Blend, EdgeMatter, Found, Probe, RayTurn, Spatial, TurnPart, TurningRay,
    VelocityField, VertexVelocity,
};
use crate::estimators::warped::auxiliary::kernel::{Distance, SIGMA, WIDE, weight};
use crate::estimators::warped::auxiliary::rims::Rims;
use crate::estimators::warped::auxiliary::{Sample, plan, ratio};
use crate::estimators::warped::edges::TurningEdges;
use crate::model::settings::{AuxiliarySamples, WarpKernel};
use crate::world::World;
use crate::world::vertex::{MaterialPoint, Vertex};

/// Standard deviation of the camera's auxiliary directions at most, in pixels.
const PIXELS: f64 = 1.0;

/// Standard deviations within which something must move.
const NEAR: f64 = 6.0;

/// Rates of directions from auxiliary directions.
#[derive(Debug)]
pub(crate) struct AuxiliaryDirections {
    asked: AuxiliarySamples,
    spatial: Arc<Spatial>,
    edges: TurningEdges,
    rims: Rims,
}

impl AuxiliaryDirections {
    pub(in crate::estimators::warped) fn new(
        world: &World,
        spatial: Arc<Spatial>,
        edges: TurningEdges,
        samples: AuxiliarySamples,
    ) -> Self {
        Self { asked: samples, spatial, edges, rims: Rims::new(world) }
    }

    /// An auxiliary direction w' drawn with a density; the velocity is that of a point at a distance.
    fn sample(
        &self,
        world: &World,
        ray: &TurningRay<'_>,
        spread: f64,
        w: Vec3,
        pdf: f64,
        probe: &mut Probe,
    ) -> Sample<(MaterialPoint, f64)> {
        let y = ray.viewer.x;
        let own = ray.viewer.surface().map_or(Skip::NOTHING, |s| Skip::one(s.prim));
        probe.rays += 1;
        let hit = world.geometry.bvh.closest(&Ray { origin: y, dir: w, t_max: f64::INFINITY }, own);
        let mut boundary = 1.0;
        let velocity = hit.map(|hit| {
            let (s, x) = world.point(hit.prim, hit.bary);
            let near = match self.asked.kernel {
                WarpKernel::Corrected => self.rims.to_crease(world, &s, x) / hit.t,
                _ => self.rims.printed(world, &s, x, y, hit.t),
            };
            boundary = f64::min(near, 1.0);
            (s.material(), hit.t)
        });
        let c = ray.dir.dot(w);
        let across = w - ray.dir * c;
        let d = match self.asked.kernel {
            WarpKernel::Year2020 => Distance::of_cosine(c, across),
            _ => {
                // With |w' - w|² = 2 - 2 c for r², and angles for lengths.
                let scale = 0.5 / (spread * spread);
                let s = (2.0 - 2.0 * c) * scale;
                let saturated = 2.0 * spread * spread / (SIGMA * SIGMA);
                Distance::saturating((s, across * (-2.0 * scale)), (saturated, Vec3::ZERO))
            }
        };
        let (w, gradient) = weight(self.asked.kernel, d, boundary);
        Sample { weight: w / pdf, gradient: gradient / pdf, velocity }
    }
}

impl VelocityField for AuxiliaryDirections {
    fn camera(&self) -> VertexVelocity {
        self.spatial.camera()
    }

    fn vertex(
        &self,
        world: &World,
        found: &Found<'_>,
        probe: &mut Probe,
        auxiliary: &mut Vec<Auxiliary>,
    ) -> VertexVelocity {
        let velocity = self.spatial.vertex(world, found, probe, auxiliary);
        let moves = velocity.moves || found.turn.is_some();
        // What blends would have to be told to boundary tests.
        VertexVelocity { moves, blend: Blend::default(), ..velocity }
    }

    fn follows_edges(&self) -> bool {
        true
    }

    fn turn(
        &self,
        world: &World,
        ray: &TurningRay<'_>,
        probe: &mut Probe,
        parts: &mut Vec<TurnPart>,
    ) -> Option<RayTurn> {
        let pixel = world.camera.pinhole().pixel_size;
        let spread = match self.asked.kernel {
            WarpKernel::Year2020 => WIDE,
            _ => SIGMA,
        };
        let spread =
            if ray.of_camera.is_some() { f64::min(PIXELS * pixel, spread) } else { spread };
        if !self.edges.any_near(ray.viewer, ray.dir, NEAR * spread, ray.moves) {
            return None;
        }
        let (count, sets) = plan(&self.asked, &mut probe.rng);
        let frame = Frame::from_normal(ray.dir);
        let narrow = 1.0 / (spread * spread);
        let mut samples = Vec::new();
        for _ in 0..count {
            // Density ∝ exp(cos θ / spread²).
            let [u, v] = probe.rng.next_2d();
            let least = fm::exp(-2.0 * narrow);
            let down = -fm::ln(1.0 - u * (1.0 - least)) / narrow;
            let sine = Real::sqrt(f64::max(down * (2.0 - down), 0.0));
            let (sin, cos) = fm::sin_cos(core::f64::consts::TAU * v);
            let w = frame.s * (sine * cos) + frame.t * (sine * sin) + ray.dir * (1.0 - down);
            let pdf = narrow * fm::exp(-down * narrow) / (core::f64::consts::TAU * (1.0 - least));
            samples.push(self.sample(world, ray, spread, w, pdf, probe));
        }
        let first = parts.len();
        let mut turn = RayTurn {
            weight: 0.0,
            gradient: Vec3::ZERO,
            parts: first..first,
            chain: 0..0,
            shadow: None,
        };
        for (set, factor) in sets {
            let at = |part: f64| (part * f64::from(count)) as usize;
            if factor == 0.0 {
                continue;
            }
            ratio(&samples[at(set.start)..at(set.end)], factor, |(matter, r), value, slope| {
                let rate = value / r;
                let divergence = slope / r - ray.dir * (2.0 * rate);
                let (matter, rate) = (Some(EdgeMatter::of(matter)), Mat3::IDENTITY * rate);
                parts.push(TurnPart { matter, rate, divergence });
                turn.weight += value;
                turn.gradient += slope;
            });
        }
        turn.parts.end = parts.len();
        Some(turn)
    }

    fn is_random(&self) -> bool {
        true
    }

    fn blend(&self, _: &World, _: &Vertex, _: &Vertex, _: Vec3, _: f64) -> Blend {
        Blend::default()
    }
}
