//! Scattering at a vertex, surface or volume, under one roof.
//!
//! With interpolated normals the shading normal decides sides, as in Mitsuba. The contribution then
//! jumps where the camera's direction crosses the shading horizon while the surface is still in view,
//! and where the light's direction sinks under the facet while the shading normal still sees it:
//! jumps that no boundary term knows. So the value fades to zero over the last [`FADE`] of both
//! cosines, and the measurement contribution has no jumps besides visibility, which its derivative
//! relies on.

use drt_math::{Real, Rgb, RgbVec, Rng, Vec3};
use drt_medium::Phase;

use crate::model::surface::{Bsdf, BsdfParams, DirectionPartner, Given, Lobes, RoughnessPartner};

/// Cosine below which interpolated surfaces fade: 0.04 % of a sphere's image.
const FADE: f64 = 0.02;

/// The local scattering function of a vertex.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Scattering<'a> {
    /// BSDF times the cosine on the light's side; `smooth` where normals are interpolated.
    Surface { bsdf: &'a Bsdf, ng: Vec3, ns: Vec3, smooth: bool },
    /// Phase function; the scattering coefficient is not in it.
    Volume(&'a Phase),
}

/// The gradient of a scattering function.
pub(crate) struct ScatteringGradient {
    pub(crate) wo: RgbVec,
    pub(crate) wi: RgbVec,
    /// With respect to the shading normal.
    pub(crate) ns: RgbVec,
    /// With respect to the geometric normal.
    pub(crate) ng: RgbVec,
    /// With respect to the phase function's asymmetry.
    pub(crate) g: f64,
    /// With respect to the material, on surfaces.
    pub(crate) params: Option<BsdfParams>,
}

/// The fading factor, and its derivative by the cosine.
fn fade(cosine: f64) -> (f64, f64) {
    let c = Real::abs(cosine) / FADE;
    if c < 1.0 { (c, cosine.signum() / FADE) } else { (1.0, 0.0) }
}

impl Scattering<'_> {
    /// The value for light from `wi` leaving to `wo`, both unit and away from the vertex.
    pub(crate) fn eval(&self, wo: Vec3, wi: Vec3) -> Rgb {
        match self {
            Self::Surface { bsdf, ng, ns, smooth } => {
                let value = bsdf.eval(wo, wi, *ns);
                if *smooth { value * (fade(ns.dot(wo)).0 * fade(ng.dot(wi)).0) } else { value }
            }
            Self::Volume(phase) => Rgb::splat(phase.eval(-wo.dot(wi))),
        }
    }

    /// Draws the direction that is not given; returns it with its solid-angle density.
    pub(crate) fn sample(&self, from: Vec3, given: Given, rng: &mut Rng) -> Option<(Vec3, f64)> {
        match self {
            Self::Surface { bsdf, ns, .. } => {
                let u = [rng.next_f64(), rng.next_f64(), rng.next_f64()];
                bsdf.sample(from, *ns, u, given).map(|s| (s.w, s.pdf))
            }
            Self::Volume(phase) => {
                // Both phase functions here depend on the angle alone, so which of the two
                // directions is given makes no difference.
                let (flow, pdf) = phase.sample(-from, rng.next_2d());
                Some((flow, pdf))
            }
        }
    }

    /// The solid-angle density of [`Scattering::sample`].
    pub(crate) fn pdf(&self, from: Vec3, to: Vec3, given: Given) -> f64 {
        match self {
            Self::Surface { bsdf, ns, .. } => bsdf.pdf(from, to, *ns, given),
            Self::Volume(phase) => phase.eval(-from.dot(to)),
        }
    }

    /// A sketch of [`Scattering::eval`] by the light's direction.
    pub(crate) fn lobes(&self, wo: Vec3) -> Lobes {
        match self {
            Self::Surface { bsdf, ns, .. } => bsdf.lobes(wo, *ns),
            Self::Volume(phase) => match phase.mean_cosine_parameter() {
                Some(g) => Lobes::around(-wo * g.signum(), phase.eval(0.0), phase.eval(g.signum())),
                None => Lobes::even(phase.eval(0.0)),
            },
        }
    }

    /// About how wide the narrowest lobe is, in radians; at most 1.
    pub(crate) fn lobe_width(&self) -> f64 {
        match self {
            Self::Surface { bsdf, .. } => bsdf.lobe_width(),
            Self::Volume(phase) => 1.0 - phase.mean_cosine_parameter().map_or(0.0, f64::abs),
        }
    }

    /// Derivatives of [`Scattering::eval`].
    pub(crate) fn gradient(&self, wo: Vec3, wi: Vec3) -> ScatteringGradient {
        match self {
            Self::Surface { bsdf, ng, ns, smooth } => {
                let mut d = bsdf.gradient(wo, wi, *ns);
                let mut by_ng = RgbVec::ZERO;
                if *smooth {
                    let ((a, da), (b, db)) = (fade(ns.dot(wo)), fade(ng.dot(wi)));
                    let (factor, by_wo, by_wi) = (a * b, d.value * (da * b), d.value * (a * db));
                    d.wo = d.wo * factor + by_wo.outer(*ns);
                    d.n = d.n * factor + by_wo.outer(wo);
                    d.wi = d.wi * factor + by_wi.outer(*ng);
                    by_ng = by_wi.outer(wi);
                    let mut params = BsdfParams::default();
                    params.scatter(&d.params, Rgb::splat(factor));
                    d.params = params;
                }
                let params = Some(d.params);
                ScatteringGradient { wo: d.wo, wi: d.wi, ns: d.n, ng: by_ng, g: 0.0, params }
            }
            Self::Volume(phase) => {
                let c = -wo.dot(wi);
                let slope = Rgb::splat(-phase.d_cos(c));
                ScatteringGradient {
                    wo: slope.outer(wi),
                    wi: slope.outer(wo),
                    ns: RgbVec::ZERO,
                    ng: RgbVec::ZERO,
                    g: phase.d_g(c),
                    params: None,
                }
            }
        }
    }

    /// The [`RoughnessPartner`] of `wi`, if it has one.
    pub(crate) fn roughness_partner(&self, wo: Vec3, wi: Vec3) -> Option<RoughnessPartner> {
        match self {
            Self::Surface { bsdf, ns, .. } => bsdf.roughness_partner(wo, wi, *ns),
            Self::Volume(_) => None,
        }
    }

    /// The [`DirectionPartner`] of `wi`, if it has one.
    pub(crate) fn direction_partner(&self, wo: Vec3, wi: Vec3) -> Option<DirectionPartner> {
        match self {
            Self::Surface { bsdf, ns, .. } => bsdf.direction_partner(wo, wi, *ns),
            Self::Volume(_) => None,
        }
    }

    /// What an importance path must multiply the value by, per solid angle of `wo`: it arrives by
    /// the area measure seen from `wi` and leaves by that seen from `wo` (geometric normals).
    pub(crate) fn adjoint_correction(&self, wo: Vec3, wi: Vec3) -> f64 {
        match self {
            Self::Surface { ng, .. } => {
                let arriving = ng.dot(wi).abs();
                if arriving > 0.0 { Real::abs(ng.dot(wo)) / arriving } else { 0.0 }
            }
            Self::Volume(_) => 1.0,
        }
    }
}
