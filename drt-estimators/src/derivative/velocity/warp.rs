//! The distance warp: volume vertices of the spatial form move along their rays with the surfaces before
//! and behind them.
//!
//! In the spatial form a volume vertex stands at a fixed distance t of its ray. Where the ray meets a surface that
//! moves, the domain of t ends or begins elsewhere: a flux, D_dot times what scatters there (2019 paper, Eqs. 16 and
//! 20). And a vertex at rest at the height h over a curved surface is as near as √h to its silhouette, which moves:
//! what it sees of that grows like 1 / √h, whose second moment is infinite like a logarithm.
//!
//! Distances are integration variables. They may move at any speed s(t) that is continuous between surfaces: with
//! f the integrand, transmittance and scattering coefficient included, and an interval [a, b] with ends moving at
//! a_dot and b_dot,
//!
//! ```text
//! d/dθ ∫ f dt = ∫ [∂f + s f' + s' f] dt + f(b) (b_dot - s(b)) - f(a) (a_dot - s(a)).
//! ```
//!
//! Where s(b) = b_dot there is no flux, and vertices beside a surface move with it in the direction that
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
//! like any other. Nothing is warped at a = 0, the vertex that the ray left, nor by surfaces at rest on a ray at rest.
//!
//! b_dot has the factor 1 / cosine of the angle of incidence, s' the factor 1 / ℓ. So surfaces warp
//! rays that graze them by γ ≤ 1; and what little medium there is between two of them moves by the mean of both
//! speeds, as more of it moves by φ:
//!
//! ```text
//! s(t) = γ_a a_dot [ψ φ(t - a) + (1 - ψ)/2] + γ_b b_dot [ψ φ(b - t) + (1 - ψ)/2].
//! ```
//!
//! The halves are left out where one of the two does not move. The flux has the rest: of a thin layer half the difference
//! of the two speeds, which is nothing where its sides are parallel. Every way of choosing distances has the same s,
//! and weights between them are not differentiated. (To let all between two surfaces move as free flight would draw
//! it with fixed numbers, φ(t - a) = 1 - φ(b - t), displaces vertices farther, which edges have more noise of than the
//! rest has less.)
//!
//! In media with grids vertices stand still, and surfaces have all of their flux.

#[cfg(all(test, feature = "std"))]
mod tests;

use alloc::vec::Vec;

use drt_math::{Real, Vec3, fm};

use crate::derivative::velocity::{Auxiliary, Moved};
use crate::world::vertex::{Matter, SurfacePoint};
use crate::world::{RayPath, World};

/// Cosine of the angle of incidence up to which γ = 0.
pub(crate) const GRAZED: f64 = 0.02;

/// Cosine from which on γ = 1.
const STEEP: f64 = 0.3;

/// Optical depth between two surfaces from which on ψ = 1.
const THIN: f64 = 0.5;

/// σℓ at most.
const FARTHEST: f64 = 3.0;

/// A surface that a ray hits.
#[derive(Clone, Copy, Debug)]
pub(crate) struct SurfaceHit {
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
    /// 1/σ, a length.
    free_path: f64,
    /// σℓ.
    depth: f64,
    /// γ of the surfaces at the start and the end; 0 where none moves.
    strengths: [f64; 2],
    /// ψ, and (1 - ψ)/2 or 0.
    parts: [f64; 2],
}

impl Stretch {
    /// From one end to the other, in a medium with a mean `free_path`.
    pub(crate) fn new(ends: [Option<&SurfaceHit>; 2], free_path: f64) -> Self {
        let start = ends[0].map_or(0.0, |m| m.distance);
        let depth = (ends[1].map_or(f64::INFINITY, |m| m.distance) - start) / free_path;
        let strength = |m: &SurfaceHit| rise((Real::abs(m.cosine) - GRAZED) / (STEEP - GRAZED));
        let strengths = ends.map(|end| end.filter(|m| m.moves).map_or(0.0, strength));
        let thick = rise(depth / THIN);
        let both = strengths.iter().all(|strength| *strength > 0.0);
        Self {
            free_path,
            depth: f64::min(depth, FARTHEST),
            strengths,
            parts: [thick, if both { 0.5 * (1.0 - thick) } else { 0.0 }],
        }
    }

    /// The coefficients of the speeds of the two ends in s at a point so far `away` from them, and their
    /// derivatives by the point's distance.
    fn shares(&self, away: [f64; 2]) -> [[f64; 2]; 2] {
        let last = fm::exp(-self.depth);
        let region = f64::max(1.0 - last, f64::MIN_POSITIVE);
        let falls = [(away[0], -1.0), (away[1], 1.0)].map(|(away, sign)| {
            let here = fm::exp(-away / self.free_path);
            if here > last { [here - last, sign * here] } else { [0.0; 2] }
        });
        let [falling, even] = self.parts.map(|part| self.strengths.map(|strength| part * strength));
        core::array::from_fn(|end| {
            let [share, slope] = falls[end].map(|f| f / region * falling[end]);
            [share + even[end], slope / self.free_path]
        })
    }

    /// What is left to the flux at one of the ends: of the speed of that end, and of the other's.
    pub(crate) fn left(&self, end: usize) -> [f64; 2] {
        let [falling, even] = self.parts;
        [1.0 - (falling + even) * self.strengths[end], -even * self.strengths[1 - end]]
    }
}

/// 1/σ, a length, of the media in which distances are warped.
pub(super) fn free_paths(world: &World) -> Vec<Option<f64>> {
    let free_path = |m: usize| {
        let sigma_t = world.medium(m).homogeneous()?.coefficients().sigma_t.mean();
        (sigma_t > 0.0).then_some(1.0 / sigma_t)
    };
    (0..world.scene.media.len()).map(free_path).collect()
}

/// From 0 to 1, and no farther.
fn rise(q: f64) -> f64 {
    let q = q.clamp(0.0, 1.0);
    q * q * (3.0 - 2.0 * q)
}

/// Lists the surfaces on a ray along `dir`, of which `moves` says whether they move along it, unless none does.
pub(crate) fn list_hits(
    hits: &mut Vec<SurfaceHit>,
    ray: &RayPath,
    dir: Vec3,
    moves: impl Fn(&SurfacePoint) -> bool,
) {
    hits.clear();
    let crossings = ray.crossings.iter().map(|c| (c.point, c.x, c.t, c.after));
    let end = ray.end.iter().map(|(point, x)| (*point, *x, ray.length, None));
    hits.extend(crossings.chain(end).map(|(point, x, distance, after)| {
        let cosine = point.ng.dot(dir);
        let moves = cosine != 0.0 && moves(&point);
        SurfaceHit { point, x, distance, cosine, moves, after }
    }));
    if hits.iter().all(|m| !m.moves) {
        hits.clear();
    }
}

/// The warp of a vertex in a medium with a mean `free_path`, at distance `t` of a ray along the unit vector
/// `dir`.
pub(super) fn warps(
    hits: &[SurfaceHit],
    dir: Vec3,
    t: f64,
    free_path: f64,
) -> impl Iterator<Item = Auxiliary> + '_ {
    let next = hits.partition_point(|m| m.distance < t);
    let ends = [next.checked_sub(1).and_then(|i| hits.get(i)), hits.get(next)];
    let away = ends.map(|end| end.map_or(f64::INFINITY, |m| Real::abs(m.distance - t)));
    let shares = Stretch::new(ends, free_path).shares(away);
    ends.into_iter().zip(shares).filter_map(move |(end, [share, slope])| {
        let hit = end.filter(|_| share > 0.0)?;
        let n = hit.point.ng;
        Some(Auxiliary {
            matter: Matter::Surface(hit.point.material()),
            functional: n / n.dot(dir),
            displacement: dir * share,
            divergence: slope,
            moved: Moved::RayPoint(hit.distance),
        })
    })
}
