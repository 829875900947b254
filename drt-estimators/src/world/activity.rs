//! What a parameter may change, and how paths are sampled there so that derivatives find what images do not need.

use alloc::vec::Vec;

use drt_math::Rgb;
use drt_medium::{Coefficients, DensityField, Homogeneous};

use crate::world::scatter::Scattering;
use crate::world::vertex::{Kind, SurfacePoint, Vertex};
use crate::world::{Tracking, World};

/// Largest probability of going on under Russian roulette. Below one it also ends paths that lose
/// nothing, at the price of weights that grow with every vertex.
const MOST_SURVIVAL: f64 = 0.99;
/// What comes off something dark may still move fast: a survivor counts ten times at most.
const LEAST_SURVIVAL: f64 = 0.1;
/// The probability where it must not depend on what a path carries.
const STEADY_SURVIVAL: f64 = 0.9;
/// Least probability of a scattering vertex per tentative collision where coefficients change.
const DEFENSIVE: f64 = 0.1;

/// Optical depth of a medium's grid, along its diagonal, below which probes are better than vertices.
const PROBED_DEPTH: f64 = 3.0;
/// How much an empty place counts for probes, against the densest, where only what is in proportion to the extinction changes.
const LEAST_COUNT: f64 = 0.1;
/// Optical depth of a medium's grid, along its diagonal, below which voxels are as good as empty.
const EMPTY_DEPTH: f64 = 1.0;
/// Share of voxels that are empty, or nearly so, from which on probes pay.
const LEAST_EMPTY: f64 = 0.05;
/// Part of a medium's largest extinction below which a voxel is thin, and the share of these from which on probes pay.
const CONTRAST: f64 = 0.25;
const LEAST_THIN: f64 = 0.5;

/// What derivatives need of a medium.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum MediumActivity {
    /// Its coefficients do not change.
    Nothing,
    /// They change.
    Density,
    /// So does what happens at vertices, even if nothing does now.
    Vertices,
}

/// What derivatives need beyond the image.
#[derive(Clone, Debug, Default)]
pub(crate) struct ActiveFactors {
    pub(crate) media: Vec<MediumActivity>,
    pub(crate) bsdfs: Vec<bool>,
    /// Media whose extinction changes somewhere, with its values or as its grid moves.
    pub(crate) extinctions: Vec<bool>,
    /// Those whose roughness changes.
    pub(crate) roughness: Vec<bool>,
    /// Those whose index of refraction changes.
    pub(crate) index: Vec<bool>,
    /// Light moves against what it meets or the camera.
    pub(crate) moves: bool,
}

impl ActiveFactors {
    /// What either needs.
    pub(crate) fn union(&self, other: &Self) -> Self {
        let any = |a: &[bool], b: &[bool]| a.iter().zip(b).map(|(a, b)| *a || *b).collect();
        Self {
            media: self.media.iter().zip(&other.media).map(|(a, b)| *a.max(b)).collect(),
            bsdfs: any(&self.bsdfs, &other.bsdfs),
            extinctions: any(&self.extinctions, &other.extinctions),
            roughness: any(&self.roughness, &other.roughness),
            index: any(&self.index, &other.index),
            moves: self.moves || other.moves,
        }
    }
}

impl World {
    /// Makes sure that what derivatives need is sampled where its value is zero (theory sheet §14.5):
    /// vertices in media whose coefficients change, and paths over materials that change.
    pub(crate) fn prepare_for_derivatives(&mut self, needs: ActiveFactors) {
        for (m, need) in needs.media.iter().enumerate() {
            let changes = *need != MediumActivity::Nothing;
            if *need == MediumActivity::Vertices
                || (changes && needs.extinctions[m] && self.medium(m).would_send_light())
            {
                self.tracking[m] = Tracking::Vertices;
            }
            if !(changes || needs.extinctions[m]) {
                continue;
            }
            let probed = self.probed_below(m);
            if changes || probed.is_some() {
                self.probed[m] = probed;
                self.defensive[m] = match self.medium(m).even_extinction() {
                    Some(h) => self.defensive_where_thin(m, h),
                    None if probed.is_some() => 0.0,
                    None => DEFENSIVE,
                };
            }
        }
        self.needs = needs;
    }

    /// The extinction of medium `m` below which probes differentiate it better than vertices; `None` where there is too
    /// little of that.
    fn probed_below(&self, m: usize) -> Option<f64> {
        let medium = self.medium(m);
        let grid = medium.grid()?;
        let mut emitters = self.scene.emitters.iter().filter_map(|e| e.item.emitter.position());
        if self.tracking[m] == Tracking::Attenuation || emitters.any(|x| medium.contains(x)) {
            return None;
        }
        let unit = grid.majorant_floor();
        let varies = grid.share_below(EMPTY_DEPTH * unit) >= LEAST_EMPTY
            || grid.share_below(CONTRAST * grid.largest_sigma_t()) >= LEAST_THIN;
        varies.then_some(PROBED_DEPTH * unit)
    }

    /// The part of the derivative by the extinction at a vertex that is estimated by vertices there, in media with probes:
    /// the balance heuristic for densities σ T and c T of a vertex and of a probe.
    pub(crate) fn share_of_vertices(&self, vertex: &Vertex, c: &Coefficients) -> f64 {
        match vertex.medium.and_then(|m| self.probed[m]) {
            Some(floor) => {
                let sigma_t = c.sigma_t.abs().mean();
                sigma_t / (sigma_t + floor)
            }
            None => 1.0,
        }
    }

    /// How much a point of a ray counts among those that a probe may be at, in medium `m` where the extinction is `sigma_t`. Where
    /// extinctions stay as they are, nothing is owed where there is none.
    pub(crate) fn weight_of_probes(&self, m: usize, sigma_t: f64) -> f64 {
        let Some(floor) = self.probed[m] else { return 0.0 };
        let counts = if self.needs.extinctions[m] {
            0.5 * sigma_t + floor
        } else {
            sigma_t + LEAST_COUNT * floor
        };
        counts / (sigma_t + floor)
    }

    /// True where some medium is differentiated by probes.
    pub(crate) fn has_probes(&self) -> bool {
        self.probed.iter().any(Option::is_some)
    }

    /// The least probability of a vertex per flight through a homogeneous filling of medium `m`: zero
    /// where free flights stop inside more often than that by themselves.
    pub(crate) fn defensive_where_thin(&self, m: usize, filling: &Homogeneous) -> f64 {
        let sigma_t = filling.coefficients().sigma_t.to_array();
        let thin = |s: f64| s * self.extent[m] < DEFENSIVE;
        if sigma_t.into_iter().any(thin) { DEFENSIVE } else { 0.0 }
    }

    /// The medium by whose extinction distances are drawn, and its extinction less the medium's own;
    /// `None` when that is the medium itself.
    pub(crate) fn drawn_by(&self, m: usize) -> Option<(&Homogeneous, Rgb)> {
        let other = self.steady.as_ref()?.get(m)?.as_ref()?;
        let own = self.medium(m).extinction()?;
        Some((other, other.coefficients().sigma_t - own.coefficients().sigma_t))
    }

    /// Probability that Russian roulette lets a path go on which carries `throughput`.
    pub(crate) fn survival(&self, throughput: Rgb) -> f64 {
        if self.steady.is_some() {
            STEADY_SURVIVAL
        } else {
            let moves = throughput.max_channel();
            if moves > 0.0 { moves.clamp(LEAST_SURVIVAL, MOST_SURVIVAL) } else { 0.0 }
        }
    }

    /// True when a parameter changes how `v` scatters, so that a zero there may not stay zero.
    pub(crate) fn may_revive(&self, v: &Vertex) -> bool {
        match (&v.kind, v.medium) {
            (Kind::Surface(s), _) => self.needed(&self.needs.bsdfs, s),
            (_, Some(m)) => self.needs.media.get(m).is_some_and(|n| *n != MediumActivity::Nothing),
            _ => false,
        }
    }

    /// True where derivatives keep apart what a surface scatters into single directions from the rest: what is seen in such a
    /// direction turns the ray that found the surface, which must not happen to light whose value does not hold the probability of
    /// that direction.
    pub(crate) fn parts_directions(&self, scattering: &Scattering<'_>) -> bool {
        self.needs.moves
            && matches!(scattering, Scattering::Surface(bsdf) if bsdf.is_partly_smooth())
    }

    /// True when a parameter changes how rough the surface at `v` is.
    pub(crate) fn roughens(&self, v: &Vertex) -> bool {
        v.surface().is_some_and(|s| self.needed(&self.needs.roughness, s))
    }

    /// True when a parameter changes how the surface at `v` refracts.
    pub(crate) fn bends_light(&self, v: &Vertex) -> bool {
        let bends = |s: &SurfacePoint| {
            self.needed(&self.needs.index, s) && self.bsdf_of(s.shape).is_transmissive()
        };
        v.surface().is_some_and(bends)
    }

    /// Whether the material of a surface is one of those that something is needed `of`.
    fn needed(&self, of: &[bool], s: &SurfacePoint) -> bool {
        of.get(self.scene.shapes[s.shape as usize].bsdf) == Some(&true)
    }
}
