//! Scattering at a vertex, surface or volume, under one roof.

use core::f64::consts::FRAC_1_PI;

use drt_geom::edges::Lobes;
use drt_math::{Rgb, RgbVec, Rng, Vec3, fm, vec3};
use drt_medium::{LocalPhase, Medium, Phase, PhaseGradient};

use crate::model::surface::{
    BsdfParams, DirectionPartner, Given, LocalBsdf, RoughnessPartner, SpecularSample,
};

/// The local scattering function of a vertex.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Scattering<'a> {
    /// BSDF times the cosine on the light's side.
    Surface(LocalBsdf<'a>),
    /// Phase function of a medium at a point; the scattering coefficient is not in it.
    Volume { medium: &'a Medium, x: Vec3, phase: LocalPhase<'a> },
}

/// A direction drawn at random.
pub(crate) enum Drawn {
    /// With its solid-angle density.
    Spread(Vec3, f64),
    /// One of the single directions of a smooth surface.
    Specular(SpecularSample),
}

/// The gradient of a scattering function.
pub(crate) struct ScatteringGradient {
    pub(crate) wo: RgbVec,
    pub(crate) wi: RgbVec,
    /// With respect to the shading normal.
    pub(crate) ns: RgbVec,
    /// With respect to the geometric normal.
    pub(crate) ng: RgbVec,
    /// With respect to the place of the point on its surface, where textures change.
    pub(crate) slide: RgbVec,
    /// Derivatives of the phase function, in media.
    pub(crate) phase: Option<PhaseGradient>,
    /// With respect to the material, on surfaces.
    pub(crate) params: Option<BsdfParams>,
}

impl ScatteringGradient {
    /// The gradient of what a medium does at a point.
    pub(crate) fn of_phase(gradient: PhaseGradient) -> Self {
        Self {
            wo: Rgb::ONE.outer(gradient.wo),
            wi: Rgb::ONE.outer(gradient.wi),
            ns: RgbVec::ZERO,
            ng: RgbVec::ZERO,
            slide: RgbVec::ZERO,
            phase: Some(gradient),
            params: None,
        }
    }
}

impl Scattering<'_> {
    /// The value for light from `wi` leaving to `wo`, both unit and away from the vertex.
    pub(crate) fn eval(&self, wo: Vec3, wi: Vec3) -> Rgb {
        match self {
            Self::Surface(bsdf) => bsdf.eval(wo, wi),
            Self::Volume { phase, .. } => Rgb::splat(phase.eval(wo, wi)),
        }
    }

    /// Draws the direction that is not given.
    pub(crate) fn sample(&self, from: Vec3, given: Given, rng: &mut Rng) -> Option<Drawn> {
        match self {
            Self::Surface(bsdf) => {
                let u = [rng.next_f64(), rng.next_f64(), rng.next_f64()];
                match bsdf.sample_specular(from, u[2], given) {
                    Some(s) => Some(Drawn::Specular(s)),
                    None => bsdf.sample(from, u, given).map(|s| Drawn::Spread(s.w, s.pdf)),
                }
            }
            Self::Volume { phase, .. } => {
                // Phase functions are reciprocal, so which of the two directions is given makes no
                // difference.
                let (to, pdf) = phase.sample(from, rng.next_2d());
                Some(Drawn::Spread(to, pdf))
            }
        }
    }

    /// The probability with which [`Scattering::sample`] draws a single direction.
    pub(crate) fn single_chance(&self, from: Vec3) -> f64 {
        match self {
            Self::Surface(bsdf) => bsdf.single_chance(from),
            Self::Volume { .. } => 0.0,
        }
    }

    /// The solid-angle density of [`Scattering::sample`].
    pub(crate) fn pdf(&self, from: Vec3, to: Vec3, given: Given) -> f64 {
        match self {
            Self::Surface(bsdf) => bsdf.pdf(from, to, given),
            Self::Volume { phase, .. } => phase.pdf(from, to),
        }
    }

    /// A sketch of [`Scattering::eval`] by the light's direction.
    pub(crate) fn lobes(&self, wo: Vec3) -> Lobes {
        match self {
            Self::Surface(bsdf) => bsdf.lobes(wo),
            Self::Volume { phase, .. } => match phase.mean_cosine_parameter() {
                Some(g) => {
                    let [aside, peak] = [0.0, g.signum()].map(|c| at_cosine(phase, c));
                    Lobes::around(-wo * g.signum(), aside, peak)
                }
                None => lobes_of(phase, wo),
            },
        }
    }

    /// About how wide the narrowest lobe is, in radians; at most 1.
    pub(crate) fn lobe_width(&self) -> f64 {
        match self {
            Self::Surface(bsdf) => bsdf.lobe_width(),
            Self::Volume { phase, .. } => 1.0 - phase.sharpness(),
        }
    }

    /// Derivatives of [`Scattering::eval`].
    pub(crate) fn gradient(&self, wo: Vec3, wi: Vec3) -> ScatteringGradient {
        match self {
            Self::Surface(bsdf) => {
                let (d, ng) = bsdf.gradient(wo, wi);
                let (slide, params) = (bsdf.slide(wo, wi, &d.params), Some(d.params));
                ScatteringGradient { wo: d.wo, wi: d.wi, ns: d.n, ng, slide, phase: None, params }
            }
            Self::Volume { medium, x, phase } => {
                ScatteringGradient::of_phase(medium.phase_gradient(*x, phase, wo, wi))
            }
        }
    }

    /// The gradient of [`Scattering::eval`] by the corners of its triangle, as far as these turn and stretch the texture coordinates there;
    /// `d` has the other derivatives.
    pub(crate) fn corners(&self, wo: Vec3, wi: Vec3, d: &ScatteringGradient) -> [RgbVec; 3] {
        match self {
            Self::Surface(bsdf) => bsdf.corners(wo, wi, [d.wo, d.wi, d.ng]),
            Self::Volume { .. } => [RgbVec::ZERO; 3],
        }
    }

    /// The [`RoughnessPartner`] of `wi`, if it has one.
    pub(crate) fn roughness_partner(&self, wo: Vec3, wi: Vec3) -> Option<RoughnessPartner> {
        match self {
            Self::Surface(bsdf) => bsdf.roughness_partner(wo, wi),
            Self::Volume { .. } => None,
        }
    }

    /// The [`DirectionPartner`] of `wi`, if it has one.
    pub(crate) fn direction_partner(&self, wo: Vec3, wi: Vec3) -> Option<DirectionPartner> {
        match self {
            Self::Surface(bsdf) => bsdf.direction_partner(wo, wi),
            Self::Volume { .. } => None,
        }
    }

    /// What an importance path must multiply the value by, per solid angle of `wo`.
    pub(crate) fn adjoint_correction(&self, wo: Vec3, wi: Vec3) -> f64 {
        match self {
            Self::Surface(bsdf) => bsdf.adjoint_correction(wo, wi),
            Self::Volume { .. } => 1.0,
        }
    }
}

/// A phase function's value where light turns by the angle of a cosine, in one of the planes that it may turn in.
fn at_cosine(phase: &LocalPhase<'_>, c: f64) -> f64 {
    phase.eval(-Vec3::Z, vec3(fm::sqrt(1.0 - c * c), 0.0, c))
}

/// A sketch of a phase function without a mean cosine to go by: one lobe to the side where there is more.
#[cold]
fn lobes_of(phase: &LocalPhase<'_>, wo: Vec3) -> Lobes {
    match phase.phase() {
        Phase::Rayleigh => return Lobes::even(at_cosine(phase, 0.0)),
        // As if what the flakes show was scattered evenly.
        Phase::Sggx(_) => return Lobes::even(0.25 * FRAC_1_PI * phase.projected_area(wo)),
        _ => {}
    }
    let [back, aside, forward] = [-1.0, 0.0, 1.0].map(|c| at_cosine(phase, c));
    let (side, most) = if forward >= back { (1.0, forward) } else { (-1.0, back) };
    // A table may be zero to the sides.
    let low = f64::max(aside, 0.01);
    Lobes::around(-wo * side, low, f64::max(most, low))
}
