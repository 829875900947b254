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
//! s(t) = φ(t - a) a_dot + φ(b - t) b_dot,    φ(δ) = (exp(-σδ) - exp(-σℓ)) / (1 - exp(-σℓ)) or 0,
//! ```
//!
//! s falls off before a surface as transmittance does: f has the factor exp(-σt), whose derivative by s is
//! s' - σ s = b_dot σ exp(-σℓ) / (1 - exp(-σℓ)), the same for all of the vertices there. So does the distance that
//! free flight draws before b with a fixed random number, and the noise is that of a flux which is computed
//! for every ray. What is left is the motion s of the vertex along the ray, which all that comes after sees
//! like any other. Nothing tows at a = 0, the vertex that the ray left, nor do surfaces at rest on a ray at rest.
//!
//! b_dot has the factor 1 / cosine of the angle of incidence, s' the factor 1 / ℓ. So surfaces tow less, by
//! γ, those rays that graze them; and what little medium there is between two of them they both tow wholly, by half,
//! as more of it is by φ:
//!
//! ```text
//! s(t) = γ_a a_dot [ψ φ(t - a) + (1 - ψ)/2] + γ_b b_dot [ψ φ(b - t) + (1 - ψ)/2].
//! ```
//!
//! The halves are left out where one of the two does not tow. The flux has the rest: of a thin layer half the difference
//! of the two speeds, which is nothing where its sides are parallel. Every way of choosing distances has the same s,
//! and weights between them are not differentiated. (To let all between two surfaces go as free flight would draw
//! it with fixed numbers, φ(t - a) = 1 - φ(b - t), carries vertices farther, which edges have more noise of than the
//! rest has less.)
//!
//! In media with grids vertices stand still, and surfaces have all of their flux.

#[cfg(all(test, feature = "std"))]
mod tests;

use alloc::vec::Vec;

use drt_math::{Real, Vec3, fm};

use super::vertex::SurfacePoint;
use super::world::{RayPath, World};

/// Cosine up to which surfaces do not tow.
pub(crate) const NO_GRIP: f64 = 0.02;

/// Cosine from which on they tow with all of their speed.
const GRAZING: f64 = 0.3;

/// The same of the depth of medium between two of them.
const THIN: f64 = 0.5;

/// How far they tow at most, in mean free paths.
const FARTHEST: f64 = 3.0;

/// A surface that tows a volume vertex.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Tow {
    pub(crate) point: SurfacePoint,
    /// Its distance along the vertex's ray.
    pub(crate) distance: f64,
    /// What of the surface's speed along the ray the vertex has.
    pub(crate) share: f64,
    /// Its derivative by the vertex's distance.
    pub(crate) slope: f64,
}

/// A surface on a ray.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Met {
    pub(crate) point: SurfacePoint,
    pub(crate) x: Vec3,
    pub(crate) distance: f64,
    /// Between the ray and its normal.
    pub(crate) cosine: f64,
    /// It moves along the ray.
    pub(crate) moves: bool,
    /// The medium that a ray which goes on is in.
    pub(crate) after: Option<usize>,
}

/// The medium between two surfaces of a ray, or what ends it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Stretch {
    /// How far surfaces tow.
    reach: f64,
    /// σℓ.
    depth: f64,
    /// γ of the surfaces at the start and the end; 0 where none tows.
    grips: [f64; 2],
    /// What of γ falls off from a surface on, and what is the same all over the stretch.
    parts: [f64; 2],
}

impl Stretch {
    /// From one end to the other, in a medium where surfaces have a `reach`.
    pub(crate) fn new(ends: [Option<&Met>; 2], reach: f64) -> Self {
        let start = ends[0].map_or(0.0, |m| m.distance);
        let depth = (ends[1].map_or(f64::INFINITY, |m| m.distance) - start) / reach;
        let grip = |m: &Met| rise((Real::abs(m.cosine) - NO_GRIP) / (GRAZING - NO_GRIP));
        let grips = ends.map(|end| end.filter(|m| m.moves).map_or(0.0, grip));
        let thick = rise(depth / THIN);
        let both = grips.iter().all(|grip| *grip > 0.0);
        Self {
            reach,
            depth: f64::min(depth, FARTHEST),
            grips,
            parts: [thick, if both { 0.5 * (1.0 - thick) } else { 0.0 }],
        }
    }

    /// What a point has of the speeds of the two ends, from which it is so far `away`, and the derivatives of
    /// that by the point's distance.
    fn shares(&self, away: [f64; 2]) -> [[f64; 2]; 2] {
        let last = fm::exp(-self.depth);
        let whole = f64::max(1.0 - last, f64::MIN_POSITIVE);
        let falls = [(away[0], -1.0), (away[1], 1.0)].map(|(away, sign)| {
            let here = fm::exp(-away / self.reach);
            if here > last { [here - last, sign * here] } else { [0.0; 2] }
        });
        let [falling, even] = self.parts.map(|part| self.grips.map(|grip| part * grip));
        core::array::from_fn(|end| {
            let [share, slope] = falls[end].map(|f| f / whole * falling[end]);
            [share + even[end], slope / self.reach]
        })
    }

    /// What surfaces leave to the flux at one of the ends: of the speed of that end, and of the other's.
    pub(crate) fn left(&self, end: usize) -> [f64; 2] {
        let [falling, even] = self.parts;
        [1.0 - (falling + even) * self.grips[end], -even * self.grips[1 - end]]
    }
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

    /// How far surfaces tow in a medium, if they do.
    pub(crate) fn reach(&self, medium: usize) -> Option<f64> {
        self.reaches.get(medium).copied().flatten()
    }
}

/// From 0 to 1, and no farther.
fn rise(q: f64) -> f64 {
    let q = q.clamp(0.0, 1.0);
    q * q * (3.0 - 2.0 * q)
}

/// Lists the surfaces on a ray along `dir`, of which `moves` says whether they move along it, unless none does.
pub(crate) fn list_met(
    met: &mut Vec<Met>,
    ray: &RayPath,
    dir: Vec3,
    moves: impl Fn(&SurfacePoint) -> bool,
) {
    met.clear();
    let crossings = ray.crossings.iter().map(|c| (c.point, c.x, c.t, c.after));
    let end = ray.end.iter().map(|(point, x)| (*point, *x, ray.length, None));
    met.extend(crossings.chain(end).map(|(point, x, distance, after)| {
        let cosine = point.ng.dot(dir);
        let moves = cosine != 0.0 && moves(&point);
        Met { point, x, distance, cosine, moves, after }
    }));
    if met.iter().all(|m| !m.moves) {
        met.clear();
    }
}

/// What tows a vertex at distance `t` of a ray, in a medium where surfaces have a `reach`.
pub(super) fn tows(met: &[Met], t: f64, reach: f64) -> impl Iterator<Item = Tow> + '_ {
    let next = met.partition_point(|m| m.distance < t);
    let ends = [next.checked_sub(1).and_then(|i| met.get(i)), met.get(next)];
    let away = ends.map(|end| end.map_or(f64::INFINITY, |m| Real::abs(m.distance - t)));
    let shares = Stretch::new(ends, reach).shares(away);
    ends.into_iter().zip(shares).filter_map(|(end, [share, slope])| {
        let m = end.filter(|_| share > 0.0)?;
        Some(Tow { point: m.point, distance: m.distance, share, slope })
    })
}
