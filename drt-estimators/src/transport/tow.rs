//! Surfaces that tow the volume vertices before and behind them along their rays.
//!
//! In the spatial form a volume vertex stands at a fixed distance t of its ray. Where the ray meets a
//! surface at D, the domain of t ends, and scattering at the end times D_dot is a flux (2019 paper, Eqs. 16
//! and 20). Worse, what a vertex at height h over a curved surface sees of its outline is as near as √h, and
//! the outline moves: rates grow like 1 / √h, whose second moment is infinite like a logarithm.
//!
//! Distances are integration variables: they may depend on the parameters, and with them go at any speed s(t)
//! that is continuous between two surfaces. With f the integrand in t, transmittance and scattering
//! coefficient included, on an interval [a, b] whose ends go at a_dot and b_dot,
//!
//! ```text
//! d/dθ ∫ f dt = ∫ [∂f + s f' + s' f] dt + f(b) (b_dot - s(b)) - f(a) (a_dot - s(a)).
//! ```
//!
//! With s(b) = b_dot = D_dot of the surface at b and s(a) = a_dot of the one at a there is no flux, and close to
//! a surface vertices go along with it in the direction that counts, its normal:
//!
//! ```text
//! s(t) = φ((t - a)/R) a_dot + φ((b - t)/R) b_dot,    φ(q) = max(1 - q, 0),    R = min(b - a, 1/σ_t).
//! ```
//!
//! Nothing tows at a = 0, where the vertex that the ray left is. s f' is the motion of the vertex along
//! the ray, which what comes after it sees like any other, with -σ_t s from the transmittance up to it.
//! Every way of choosing distances uses the same s, so weights between them are left alone.
//!
//! In media with grids vertices stand still, and surfaces have their flux.

use alloc::vec::Vec;

use drt_math::{Real, Vec3, fm};

use super::vertex::SurfacePoint;
use super::world::{RayPath, World};

/// Cosine from which on surfaces tow with all of their speed.
const GRAZING: f64 = 0.3;

/// Depth of medium before or behind them from which on they do.
const THIN: f64 = 1.0;

/// How far they tow, in mean free paths.
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
    /// Of the ray with its normal; 0 where it does not tow.
    cosine: f64,
}

impl World {
    /// Lets surfaces tow.
    pub(crate) fn prepare_tows(&mut self) {
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

/// What tows a vertex at distance `t` of a ray, with a `reach`.
pub(super) fn tows(met: &[Met], t: f64, reach: f64) -> impl Iterator<Item = Tow> + '_ {
    let next = met.partition_point(|m| m.distance < t);
    let (behind, ahead) = (next.checked_sub(1).and_then(|i| met.get(i)), met.get(next));
    let start = behind.map_or(0.0, |m| m.distance);
    let end = ahead.map_or(f64::INFINITY, |m| m.distance);
    let farthest = f64::min(end - start, FARTHEST * reach);
    let last = fm::exp(-farthest / reach);
    let tow = move |m: &Met| {
        let away = m.distance - t;
        let here = fm::exp(-Real::abs(away) / reach);
        if here <= last {
            return None;
        }
        let scale = grip(m.cosine, (end - start) / reach) / (1.0 - last);
        let slope = if away < 0.0 { -here } else { here } / reach;
        let (share, slope) = ((here - last) * scale, slope * scale);
        Some(Tow { point: m.point, distance: m.distance, share, slope })
    };
    behind.into_iter().chain(ahead).filter(|m| m.cosine != 0.0).filter_map(tow)
}
