//! Rays that turn with the shadows of points and directions.
//!
//! What a vertex x gets from a light at one point y, or from one direction, jumps at the shadows of edges on its surface. A ray from x_p
//! along ω that ends at x, at the distance t, sees a shadow move by what its edge does, by the light, and by the surface. Let d be
//! the unit direction of the light's flow at x, N the surface's normal, and e the point of an edge nearest to the
//! line from the light to x. Were e on that line, its shadow on the plane of the surface would be at y + k (e - y) with
//! k = |x - y| / |e - y|, or at e + m d with m = (x - e)·d for a direction, and have the velocity
//!
//! ```text
//! c = P v + d N·u / (N·d),    P = 1 - d N^T / (N·d),
//! v = k e_dot + (1 - k) y_dot,    or    v = e_dot + m d_dot,
//! ```
//!
//! u being that of the surface. So with weights Λ that rise to 1 at shadows, the ray's direction is to have the rate
//!
//! ```text
//! T = Σ Λ G v + Λ h N·u - Λ (1 - ω ω^T) x_p_dot / t,    G = (1 - ω ω^T) P / t,    h = (1 - ω ω^T) d / (t N·d).
//! ```
//!
//! Where x moves in its plane by P_ω t dω, with P_ω = 1 - ω N^T / (N·ω), what of this depends on ω gives, with τ the gradient of 1/t across ω,
//! and r the distance of the light (infinite for directions),
//!
//! ```text
//! Σ_i (∂_i G)^T e_i = P^T (τ - 2 ω / t) - 2 N / (r N·d),
//! div h = τ·d / (N·d) - 2 ω·d / (t N·d) + 2 / (r N·d).
//! ```
//!
//! Where the surface turns, N·u changes along it, too: as N stays across the surface, by -N_dot. So div (h N·u) has a last part,
//!
//! ```text
//! h·∇(N·u) = -t (h - ω N·h / (N·ω))·N_dot.
//! ```

use drt_math::Vec3;

use crate::derivative::velocity::{EdgeMatter, Weight};
use crate::world::vertex::MaterialPoint;

/// A summand of v, by the velocity of an edge's end.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ShadowPart {
    pub(crate) matter: EdgeMatter,
    /// Λ k and its part of the edge.
    pub(crate) share: Weight,
}

/// How a ray turns with the shadows beside the point where it ends.
#[derive(Clone, Debug)]
pub(crate) struct ShadowTurn {
    pub(crate) at: ShadowPlace,
    /// Σ Λ.
    pub(crate) weight: Weight,
    /// Σ Λ (1 - k), or Σ Λ m of a direction.
    pub(crate) by_light: Weight,
}

/// Where a ray meets a surface in a light's flow.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ShadowPlace {
    /// The surface there.
    pub(crate) matter: MaterialPoint,
    /// N, unit, to either side.
    pub(crate) normal: Vec3,
    /// 1 where that is the geometric normal, -1 where it is the opposite.
    pub(crate) side: f64,
    /// ω, unit.
    pub(crate) dir: Vec3,
    /// t, in scene units.
    pub(crate) distance: f64,
    /// d, unit.
    pub(crate) flow: Vec3,
    /// 1 / r, zero for directions.
    pub(crate) inv_range: f64,
}

impl ShadowPlace {
    /// The gradient across ω of what has a gradient `by_place` in the plane of the surface.
    pub(crate) fn by_direction(&self, by_place: Vec3) -> Vec3 {
        let n = self.normal;
        (by_place - n * (self.dir.dot(by_place) / n.dot(self.dir))) * self.distance
    }

    /// τ.
    pub(crate) fn inv_distance_gradient(&self) -> Vec3 {
        let n = self.normal;
        n.reject(self.dir) / (n.dot(self.dir) * self.distance)
    }

    /// P^T, applied.
    fn across_flow(&self, g: Vec3) -> Vec3 {
        let n = self.normal;
        g - n * (self.flow.dot(g) / n.dot(self.flow))
    }

    /// G^T, applied to what is across ω.
    pub(crate) fn project(&self, g: Vec3) -> Vec3 {
        self.across_flow(g) / self.distance
    }

    /// Σ_i (∂_i G)^T e_i.
    pub(crate) fn projection_divergence(&self) -> Vec3 {
        let n = self.normal;
        let across = self.inv_distance_gradient() - self.dir * (2.0 / self.distance);
        self.across_flow(across) - n * (2.0 * self.inv_range / n.dot(self.flow))
    }

    /// h and div h.
    pub(crate) fn lift(&self) -> (Vec3, f64) {
        let Self { dir, distance, flow, inv_range, .. } = *self;
        let cosine = self.normal.dot(flow);
        let own = self.inv_distance_gradient().dot(flow) - 2.0 * dir.dot(flow) / distance;
        (flow.reject(dir) / (distance * cosine), (own + 2.0 * inv_range) / cosine)
    }

    /// What h·∇(N·u) is by the rate of the geometric normal, with the [h](Self::lift) of the place.
    pub(crate) fn lift_by_normal(&self, h: Vec3) -> Vec3 {
        let n = self.normal;
        (h - self.dir * (n.dot(h) / n.dot(self.dir))) * (-self.side * self.distance)
    }
}

#[cfg(test)]
mod tests {
    use drt_math::{Frame, Rng, vec3};

    use super::*;

    /// The divergences are those of differences, for points and for directions.
    #[test]
    fn divergences_are_differences() {
        let mut rng = Rng::new(21, 0, 0);
        let mut next = || vec3(rng.next_f64() - 0.5, rng.next_f64() - 0.5, rng.next_f64() - 0.5);
        for case in 0..200 {
            let (dir, n, light) = (next().normalize(), next().normalize(), next() * 3.0);
            let (v, u, spin) = (next(), next(), next());
            let depth = n.dot(dir) * 1.5;
            let at = |dir: Vec3| {
                let distance = depth / n.dot(dir);
                let range = (dir * distance - light).length();
                let (flow, inv_range) = match case % 2 {
                    0 => ((dir * distance - light) / range, 1.0 / range),
                    _ => (light.normalize(), 0.0),
                };
                let at = drt_motion::SurfacePoint { triangle: 0, bary: [0.0; 2] };
                let matter = MaterialPoint { shape: 0, at };
                let side = if case % 3 == 0 { -1.0 } else { 1.0 };
                ShadowPlace { matter, normal: n, side, dir, distance, flow, inv_range }
            };
            let here = at(dir);
            if n.dot(dir).abs() < 0.2 || n.dot(here.flow).abs() < 0.2 {
                continue;
            }
            // T of one weight 1, by its definition.
            let turn = |p: &ShadowPlace| {
                let cosine = n.dot(p.flow);
                let u = u + spin.cross(p.dir * p.distance);
                let c = v - p.flow * (n.dot(v) / cosine) + p.flow * (n.dot(u) / cosine);
                (c - p.dir * c.dot(p.dir)) / p.distance
            };
            let frame = Frame::from_normal(dir);
            let mut differences = 0.0;
            let mut inverse = 0.0;
            for t in [frame.s, frame.t] {
                let h = 1e-5;
                let [p, m] = [h, -h].map(|h| at((dir + t * h).normalize()));
                differences += (turn(&p) - turn(&m)).dot(t) / (2.0 * h);
                let slope = (1.0 / p.distance - 1.0 / m.distance) / (2.0 * h);
                inverse += (slope - here.inv_distance_gradient().dot(t)).abs();
                for axis in [u, v] {
                    let own = here.by_direction(axis).dot(t);
                    let moved = (p.dir * p.distance - m.dir * m.distance).dot(axis) / (2.0 * h);
                    assert!((own - moved).abs() < 1e-6 * (1.0 + moved.abs()), "{own} {moved}");
                }
            }
            let (lift, lift_divergence) = here.lift();
            let u = u + spin.cross(here.dir * here.distance);
            let spun = here.lift_by_normal(lift).dot(spin.cross(n * here.side));
            let closed = here.projection_divergence().dot(v) + lift_divergence * n.dot(u) + spun;
            let scale = 1.0 + differences.abs();
            assert!((closed - differences).abs() < 1e-6 * scale, "{closed} {differences}");
            assert!(inverse < 1e-6);
            let along = turn(&here).dot(v);
            let sent = here.project(v.reject(dir)).dot(v) + lift.dot(v) * n.dot(u);
            assert!((along - sent).abs() < 1e-10, "{along} {sent}");
        }
    }
}
