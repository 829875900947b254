//! Diffuse surfaces of rough, V-shaped grooves.
//!
//! Oren & Nayar 1994, "Generalization of Lambert's Reflectance Model", by their approximation of the integrals over grooves whose
//! slopes have the standard deviation σ. With α and β the larger and the smaller polar angle and φ between both azimuths,
//!
//! ```text
//! π f = ρ (C₁ + cos φ C₂ tan β + (1 - |cos φ|) C₃ tan((α + β) / 2)) + ρ² C₄ (1 - cos φ (2β/π)²),
//!
//! C₁ = 1 - 0.5 σ² / (σ² + 0.33),
//! C₂ = 0.45 σ² / (σ² + 0.09) (sin α - [cos φ < 0] (2β/π)³),
//! C₃ = 0.125 σ² / (σ² + 0.09) (4αβ/π²)²,
//! C₄ = 0.17 σ² / (σ² + 0.13),
//! ```
//!
//! where the last term is light that is reflected twice in a groove. The fast version has only C₁ and C₂, and that where cos φ > 0.
//! As in Mitsuba 0.6, σ is the roughness of the model's property over √2, for it to mean what that of microfacets does. What would
//! be less than no light, in grooves steeper than they are measured in, is none.

use core::f64::consts::{FRAC_1_PI, FRAC_2_PI};

use drt_geom::edges::Lobes;
use drt_math::{Real, Rgb, Vec3, warp};

use crate::model::surface::framed::{Framed, scatters_in_frame};
use crate::model::surface::microfacet::LEAST_COS2;
use crate::model::surface::model::{Dependence, Flags, Model, Numbers};
use crate::model::surface::params::PropertySet;
use crate::model::surface::property::{Property, Slot, SurfaceError, in_range, nonnegative};
use crate::model::surface::{At, BsdfGradient, Given};

/// A rough diffuse reflector: Mitsuba 0.6's `roughdiffuse`. Black from behind.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct RoughDiffuse {
    /// Albedo of the grooves' sides; default 0.5.
    pub reflectance: Rgb,
    /// Roughness, as of Beckmann microfacets: √2 times the standard deviation of slopes; default 0.2.
    pub alpha: f64,
    /// The fast version of the model, without light that is reflected twice.
    pub fast: bool,
}

impl Default for RoughDiffuse {
    fn default() -> Self {
        Self { reflectance: Rgb::splat(0.5), alpha: 0.2, fast: false }
    }
}

/// Squared sine below which a direction has no azimuth.
const LEAST_SIN2: f64 = 1e-16;

/// Sine and polar angle of a direction above the surface.
fn polar<T: Real>(w: Vec3<T>) -> [T; 2] {
    let sin2 = w.x.squared() + w.y.squared();
    if sin2.re() < LEAST_SIN2 || w.z.re() >= 1.0 {
        return [T::zero(); 2];
    }
    [sin2.sqrt(), w.z.acos()]
}

impl Framed for RoughDiffuse {
    fn in_frame<T: Real>(&self, numbers: impl Numbers<T>, wo: Vec3<T>, wi: Vec3<T>) -> Rgb<T> {
        let above = wo.z.re() > 0.0 && wi.z.re() > 0.0;
        if !above || (wo.z * wi.z).re() < LEAST_COS2 {
            return Rgb::splat(T::zero());
        }
        let variance = numbers.number(Property::Alpha, self.alpha).squared() * 0.5;
        let share = |offset: f64| variance / (variance + offset);
        let ([sin_o, angle_o], [sin_i, angle_i]) = (polar(wo), polar(wi));
        let both = sin_o * sin_i;
        let cos_phi = if both.is_zero() { T::zero() } else { (wo.x * wi.x + wo.y * wi.y) / both };
        let o_is_steeper = wo.z.re() > wi.z.re();
        let (sin_alpha, sin_beta, beta, cos_beta) = if o_is_steeper {
            (sin_i, sin_o, angle_o, wo.z)
        } else {
            (sin_o, sin_i, angle_i, wi.z)
        };
        let tan_beta = sin_beta / cos_beta;
        let towards = cos_phi.re() > 0.0;
        let once = T::one() - share(0.33) * 0.5;
        let colour = numbers.colour(Property::Reflectance, self.reflectance);
        let scale = wi.z * FRAC_1_PI;
        if self.fast {
            let lit = if towards { cos_phi } else { T::zero() };
            return colour * ((once + share(0.09) * lit * sin_alpha * tan_beta * 0.45) * scale);
        }
        let turned = beta * FRAC_2_PI;
        let hidden = if towards { T::zero() } else { turned.squared() * turned };
        let c2 = share(0.09) * (sin_alpha - hidden) * 0.45;
        let spread = (angle_o * angle_i * (FRAC_2_PI * FRAC_2_PI)).squared();
        let c3 = share(0.09) * spread * 0.125;
        let c4 = share(0.13) * 0.17;
        let tan_half = (sin_o + sin_i) / (wo.z + wi.z);
        let single = once + cos_phi * c2 * tan_beta + (T::one() - cos_phi.abs()) * c3 * tan_half;
        let double = c4 * (T::one() - cos_phi * turned.squared());
        colour.map(|c| ((single + double * c) * c * scale).max(T::zero()))
    }

    fn direction(&self, from: Vec3, u: [f64; 3]) -> Option<Vec3> {
        (from.z > 0.0).then(|| warp::cosine_hemisphere([u[0], u[1]]))
    }

    fn density(&self, from: Vec3, to: Vec3) -> f64 {
        if from.z > 0.0 && to.z > 0.0 { to.z * FRAC_1_PI } else { 0.0 }
    }
}

impl Model for RoughDiffuse {
    fn name(&self) -> &'static str {
        "roughdiffuse"
    }

    #[inline]
    fn flags(&self) -> Flags {
        Flags::REFLECTOR
    }

    scatters_in_frame!(Reflectance, Alpha);

    fn slot(&mut self, property: Property) -> Option<Slot<'_>> {
        match property {
            Property::Reflectance => Some(Slot::Color(&mut self.reflectance)),
            Property::Alpha => Some(Slot::Scalar(&mut self.alpha)),
            _ => None,
        }
    }

    fn validate(&self) -> Result<(), SurfaceError> {
        nonnegative(Property::Reflectance, self.reflectance)?;
        in_range(Property::Alpha, self.alpha, self.alpha >= 0.0, "0 or more")
    }

    fn lobes(&self, _: At<'_>, _: Vec3, _: Vec3) -> Lobes {
        Lobes::even(self.reflectance.mean() * FRAC_1_PI)
    }

    fn lobe_width(&self, _: At<'_>) -> f64 {
        1.0
    }
}
