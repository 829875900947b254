//! Surfaces that tow the volume vertices before and behind them along their rays.
//!
//! In the spatial form a volume vertex stands at a fixed distance t of its ray. Where the ray meets a surface that
//! moves, the domain of t ends or begins elsewhere: a flux, D_dot times what scatters there (2019 paper, Eqs. 16 and
//! 20). And a vertex at rest at the height h over a curved surface is as near as √h to its outline, which moves:
//! what it sees of that grows like 1 / √h, whose second moment is infinite like a logarithm.
//!
//! Distances are integration variables. They may go at any speed s(t) that is continuous between surfaces: with
//! f the integrand, transmittance and scattering coefficient included, and an interval [a, b] with ends going at
//! a_dot and b_dot,
//!
//! ```text
//! d/dθ ∫ f dt = ∫ [∂f + s f' + s' f] dt + f(b) (b_dot - s(b)) - f(a) (a_dot - s(a)).
//! ```
//!
//! Where s(b) = b_dot there is no flux, and vertices beside a surface go along with it in the direction that
//! counts, its normal. With the mean extinction σ of the medium, ℓ = min(b - a, 3/σ), and
//!
//! ```text
//! s(t) = ψ_a φ(t - a) a_dot + ψ_b φ(b - t) b_dot,    φ(δ) = (exp(-σδ) - exp(-σℓ)) / (1 - exp(-σℓ)) or 0,
//! ```
//!
//! s falls off before a surface as transmittance does: f has the factor exp(-σt), whose derivative by s is
//! s' - σ s = ψ_b b_dot σ exp(-σℓ) / (1 - exp(-σℓ)), the same for all of the vertices there. So does the distance that
//! free flight draws before b with a fixed random number, and the noise is that of a flux which is computed
//! for every ray. What is left is the motion s of the vertex along the ray, which all that comes after sees
//! like any other. Nothing tows at a = 0, the vertex that the ray left.
//!
//! b_dot has the factor 1 / cosine of the angle of incidence, s' the factor 1 / ℓ. So surfaces tow less, by
//! ψ, those rays that graze them or have little medium before them, and the flux has 1 - ψ. Every way of
//! choosing distances has the same s, and weights between them are not differentiated.
//!
//! In media with grids vertices stand still, and surfaces have all of their flux.

#[cfg(all(test, feature = "std"))]
mod tests;

use alloc::vec::Vec;

use drt_math::{Real, Vec3, fm};

use super::vertex::SurfacePoint;
use super::world::{RayPath, World};

/// Cosine from which on surfaces tow with all of their speed.
const GRAZING: f64 = 0.3;

/// The same of the depth of medium before or behind them.
const THIN: f64 = 0.5;

/// How far they tow at most, in mean free paths.
const FARTHEST: f64 = 3.0;

/// A surface that tows a volume vertex.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Tow {
    pub(crate) point: SurfacePoint,
    /// Its distance along the vertex's ray.
    pub(crate) distance: f64,
    /// φ: what of the surface's speed along the ray the vertex has.
    pub(crate) share: f64,
    /// Its derivative by the vertex's distance.
    pub(crate) slope: f64,
}

/// A surface on a ray.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Met {
    point: SurfacePoint,
    distance: f64,
    /// Between the ray and its normal; 0 where it does not tow.
    cosine: f64,
}

impl World {
    /// Lets surfaces tow.
    pub(crate) fn prepare_tows(&mut self) {
        // A mean free path, as s falls off like transmittance.
        let reach = |m: usize| {
            let sigma_t = self.medium(m).homogeneous()?.coefficients().sigma_t.mean();
            (sigma_t > 0.0).then_some(1.0 / sigma_t)
        };
        self.reaches = (0..self.scene.media.len()).map(reach).collect();
    }

    /// True when surfaces tow in some medium.
    pub(crate) fn any_tows(&self) -> bool {
        self.reaches.iter().any(Option::is_some)
    }

    /// How far surfaces tow in a medium, if they do.
    pub(crate) fn reach(&self, medium: usize) -> Option<f64> {
        self.reaches.get(medium).copied().flatten()
    }

    /// ψ of a surface that a ray meets at a `cosine` after, or before, a `length` in a medium.
    pub(crate) fn grip(&self, medium: usize, cosine: f64, length: f64) -> f64 {
        self.reach(medium).map_or(0.0, |reach| grip(cosine, length / reach))
    }
}

/// ψ, of a depth in mean free paths.
fn grip(cosine: f64, depth: f64) -> f64 {
    let rise = |q: f64| {
        let q = f64::min(q, 1.0);
        q * q * (3.0 - 2.0 * q)
    };
    rise(Real::abs(cosine) / GRAZING) * rise(depth / THIN)
}

/// Lists the surfaces on a ray along `dir`, of which `tows` says whether they tow, unless none does.
pub(super) fn list_met(
    met: &mut Vec<Met>,
    ray: &RayPath,
    dir: Vec3,
    tows: impl Fn(&SurfacePoint) -> bool,
) {
    met.clear();
    let crossings = ray.crossings.iter().map(|c| (c.point, c.t));
    let end = ray.end.iter().map(|(point, _)| (*point, ray.length));
    met.extend(crossings.chain(end).map(|(point, distance)| {
        let cosine = if tows(&point) { point.ng.dot(dir) } else { 0.0 };
        Met { point, distance, cosine }
    }));
    if met.iter().all(|m| m.cosine == 0.0) {
        met.clear();
    }
}

/// What tows a vertex at distance `t` of a ray, in a medium where surfaces have a `reach`.
pub(super) fn tows(met: &[Met], t: f64, reach: f64) -> impl Iterator<Item = Tow> + '_ {
    let next = met.partition_point(|m| m.distance < t);
    let (behind, ahead) = (next.checked_sub(1).and_then(|i| met.get(i)), met.get(next));
    let start = behind.map_or(0.0, |m| m.distance);
    let end = ahead.map_or(f64::INFINITY, |m| m.distance);
    let depth = (end - start) / reach;
    let last = fm::exp(-f64::min(depth, FARTHEST));
    let tow = move |m: &Met| {
        let away = m.distance - t;
        let here = fm::exp(-Real::abs(away) / reach);
        if here <= last {
            return None;
        }
        let scale = grip(m.cosine, depth) / (1.0 - last);
        let slope = if away < 0.0 { -here } else { here } / reach;
        let (share, slope) = ((here - last) * scale, slope * scale);
        Some(Tow { point: m.point, distance: m.distance, share, slope })
    };
    behind.into_iter().chain(ahead).filter(|m| m.cosine != 0.0).filter_map(tow)
}
