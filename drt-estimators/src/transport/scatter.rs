//! Scattering at a vertex, surface or volume, under one roof.
//!
//! Interpolated normals can put a direction in front of the surface by one normal and behind it by
//! the other. Sides are decided by the geometric normal, because contributions vanish continuously
//! there; a direction on the wrong side of the shading normal is mirrored at the tangent plane
//! before the scattering model sees it. The measurement contribution then has no jumps besides
//! visibility, which its derivative relies on (theory sheet §7, §13).

use drt_math::{Real, Rgb, RgbVec, Rng, Vec3, warp};
use drt_medium::Phase;

use crate::surface::{Bsdf, BsdfParams, Given};

/// Share of directions drawn uniformly where shading normals are interpolated, so that every
/// direction which can contribute has a density.
const SMOOTH_DEFENSE: f64 = 0.1;

/// The local scattering function of a vertex.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Scattering<'a> {
    /// BSDF times the cosine on the light's side.
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
    /// With respect to the phase function's asymmetry.
    pub(crate) g: f64,
    /// With respect to the material, on surfaces.
    pub(crate) params: Option<BsdfParams>,
}

/// The reflection that puts `w` on the same side of `ns` as it is of `ng`.
fn mirrored(w: Vec3, ng: Vec3, ns: Vec3) -> (Vec3, bool) {
    let c = w.dot(ns);
    if c * w.dot(ng) < 0.0 { (w - ns * (2.0 * c), true) } else { (w, false) }
}

impl Scattering<'_> {
    /// The value for light from `wi` leaving to `wo`, both unit and away from the vertex.
    pub(crate) fn eval(&self, wo: Vec3, wi: Vec3) -> Rgb {
        match self {
            Self::Surface { bsdf, ns, smooth: false, .. } => bsdf.eval(wo, wi, *ns),
            Self::Surface { bsdf, ng, ns, smooth: true } => {
                bsdf.eval(mirrored(wo, *ng, *ns).0, mirrored(wi, *ng, *ns).0, *ns)
            }
            Self::Volume(phase) => Rgb::splat(phase.eval(-wo.dot(wi))),
        }
    }

    /// Draws the direction that is not given; returns it with its solid-angle density.
    pub(crate) fn sample(&self, from: Vec3, given: Given, rng: &mut Rng) -> Option<(Vec3, f64)> {
        match self {
            Self::Surface { bsdf, ns, smooth: false, .. } => {
                let u = [rng.next_f64(), rng.next_f64(), rng.next_f64()];
                bsdf.sample(from, *ns, u, given).map(|s| (s.w, s.pdf))
            }
            Self::Surface { bsdf, ng, ns, smooth: true } => {
                let w = if rng.next_f64() < SMOOTH_DEFENSE {
                    warp::uniform_sphere(rng.next_2d())
                } else {
                    let u = [rng.next_f64(), rng.next_f64(), rng.next_f64()];
                    bsdf.sample(mirrored(from, *ng, *ns).0, *ns, u, given)?.w
                };
                Some((w, self.pdf(from, w, given)))
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
            Self::Surface { bsdf, ns, smooth: false, .. } => bsdf.pdf(from, to, *ns, given),
            Self::Surface { bsdf, ng, ns, smooth: true } => {
                // The model draws `to` itself, not its mirror image.
                let p = bsdf.pdf(mirrored(from, *ng, *ns).0, to, *ns, given);
                SMOOTH_DEFENSE * warp::uniform_sphere_pdf() + (1.0 - SMOOTH_DEFENSE) * p
            }
            Self::Volume(phase) => phase.eval(-from.dot(to)),
        }
    }

    /// Derivatives of [`Scattering::eval`].
    pub(crate) fn gradient(&self, wo: Vec3, wi: Vec3) -> ScatteringGradient {
        match self {
            Self::Surface { bsdf, ng, ns, smooth } => {
                let ((mo, fo), (mi, fi)) = if *smooth {
                    (mirrored(wo, *ng, *ns), mirrored(wi, *ng, *ns))
                } else {
                    ((wo, false), (wi, false))
                };
                let d = bsdf.gradient(mo, mi, *ns);
                let mut normal = d.n;
                // The mirror image w - 2 (w·n) n, transposed.
                let mut unmirror = |grad: RgbVec, w: Vec3, flipped: bool| {
                    if !flipped {
                        return grad;
                    }
                    normal -= grad.map(|g| w * (2.0 * g.dot(*ns)) + g * (2.0 * w.dot(*ns)));
                    grad.map(|g| g - *ns * (2.0 * g.dot(*ns)))
                };
                let wo = unmirror(d.wo, wo, fo);
                let wi = unmirror(d.wi, wi, fi);
                ScatteringGradient { wo, wi, ns: normal, g: 0.0, params: Some(d.params) }
            }
            Self::Volume(phase) => {
                let c = -wo.dot(wi);
                let slope = Rgb::splat(-phase.d_cos(c));
                ScatteringGradient {
                    wo: slope.outer(wi),
                    wi: slope.outer(wo),
                    ns: RgbVec::ZERO,
                    g: phase.d_g(c),
                    params: None,
                }
            }
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
