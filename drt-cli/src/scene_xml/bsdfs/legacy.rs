//! BSDFs that Mitsuba 0.5 and 0.6 have and version 3 lacks.

use drt_estimators::surface::{Bsdf, Coated, Coating, RoughDiffuse, Ward, WardVariant};
use drt_math::Rgb;

use super::super::Loader;
use super::super::parts::Parts;
use super::super::properties::Properties;
use super::{AIR, BK7, alpha, distribution, ior, reflectance};
use crate::CliError;

impl<'a> Loader<'a> {
    /// `coating` and `roughcoating`.
    pub(super) fn coated(&self, p: &Properties<'a>, parts: &Parts) -> Result<Coated, CliError> {
        let eta = ior(p, "int_ior", BK7)? / ior(p, "ext_ior", AIR)?;
        let coating = match p.kind()? {
            "coating" => Coating::smooth(eta),
            _ => Coating::rough(distribution(p)?, alpha(p, 0.1)?, eta),
        };
        // Else the texture would be one of what is inside, which may have a roughness, too.
        if ["alpha", "alpha_u", "alpha_v"].into_iter().any(|name| p.is_textured(name)) {
            return Err(p
                .element
                .error("a texture of `alpha` of a coating is not supported; give a number"));
        }
        let coating = coating.map_err(|err| p.element.error(err))?;
        Ok(Coated {
            bsdf: self.only(p, parts)?,
            coating,
            specular_reflectance: reflectance(p, &["specular_reflectance"], Rgb::ONE)?,
            sigma_a: reflectance(p, &["sigma_a"], Rgb::ZERO)?,
            thickness: p.float("thickness")?.unwrap_or(1.0),
        })
    }
}

pub(super) fn rough_diffuse(p: &Properties<'_>) -> Result<RoughDiffuse, CliError> {
    let default = RoughDiffuse::default();
    let names = ["reflectance", "diffuse_reflectance"];
    Ok(RoughDiffuse {
        reflectance: reflectance(p, &names, default.reflectance)?,
        alpha: p.float("alpha")?.unwrap_or(default.alpha),
        fast: p.boolean("use_fast_approx")?.unwrap_or(default.fast),
    })
}

pub(super) fn ward(p: &Properties<'_>) -> Result<Bsdf, CliError> {
    let default = Ward::default();
    let variants = [
        ("ward", WardVariant::Ward),
        ("ward-duer", WardVariant::Duer),
        ("balanced", WardVariant::Balanced),
    ];
    let even = p.float("alpha")?;
    if p.is_textured("alpha") {
        return Err(p.element.error("give textures of `alpha_u` and `alpha_v`, not of `alpha`"));
    }
    let [u, v] = default.alpha.map(|alpha| even.unwrap_or(alpha));
    let names = ["diffuse_reflectance", "reflectance"];
    Ok(Bsdf::Ward(Ward {
        variant: p.choice("variant", &variants)?.unwrap_or_default(),
        reflectance: reflectance(p, &names, default.reflectance)?,
        specular_reflectance: reflectance(
            p,
            &["specular_reflectance"],
            default.specular_reflectance,
        )?,
        alpha: [p.float("alpha_u")?.unwrap_or(u), p.float("alpha_v")?.unwrap_or(v)],
    }))
}
