//! Burley's principled BSDFs.

use drt_estimators::surface::{Principled, PrincipledThin};

use super::super::properties::Properties;
use crate::CliError;

pub(super) fn thick(p: &Properties<'_>) -> Result<Principled, CliError> {
    let default = Principled::default();
    p.accept(&[
        "main_specular_sampling_rate",
        "clearcoat_sampling_rate",
        "diffuse_reflectance_sampling_rate",
    ]);
    let number = |name, default: f64| Ok::<f64, CliError>(p.float(name)?.unwrap_or(default));
    let spec_trans = number("spec_trans", default.spec_trans)?;
    let transmits = spec_trans != 0.0 || p.is_textured("spec_trans");
    let eta = match (p.float("eta")?, p.float("specular")?) {
        // An interface to the same would not refract; Mitsuba takes these instead.
        (Some(1.0), None) if transmits => 1.001,
        (Some(eta), None) => eta,
        (None, Some(0.0)) if transmits => Principled::index_of(1e-3),
        (None, Some(specular)) => Principled::index_of(specular),
        (None, None) => default.eta,
        (Some(_), Some(_)) => return Err(p.element.error("give `eta` or `specular`, not both")),
    };
    Ok(Principled {
        base_color: p.color("base_color")?.unwrap_or(default.base_color),
        roughness: number("roughness", default.roughness)?,
        anisotropic: number("anisotropic", default.anisotropic)?,
        metallic: number("metallic", default.metallic)?,
        spec_trans,
        eta,
        spec_tint: number("spec_tint", default.spec_tint)?,
        sheen: number("sheen", default.sheen)?,
        sheen_tint: number("sheen_tint", default.sheen_tint)?,
        flatness: number("flatness", default.flatness)?,
        clearcoat: number("clearcoat", default.clearcoat)?,
        clearcoat_gloss: number("clearcoat_gloss", default.clearcoat_gloss)?,
    })
}

pub(super) fn thin(p: &Properties<'_>) -> Result<PrincipledThin, CliError> {
    let default = PrincipledThin::default();
    p.accept(&[
        "specular_reflectance_sampling_rate",
        "specular_transmittance_sampling_rate",
        "diffuse_transmittance_sampling_rate",
        "diffuse_reflectance_sampling_rate",
    ]);
    let number = |name, default: f64| Ok::<f64, CliError>(p.float(name)?.unwrap_or(default));
    Ok(PrincipledThin {
        base_color: p.color("base_color")?.unwrap_or(default.base_color),
        roughness: number("roughness", default.roughness)?,
        anisotropic: number("anisotropic", default.anisotropic)?,
        spec_trans: number("spec_trans", default.spec_trans)?,
        eta: number("eta", default.eta)?,
        spec_tint: number("spec_tint", default.spec_tint)?,
        sheen: number("sheen", default.sheen)?,
        sheen_tint: number("sheen_tint", default.sheen_tint)?,
        flatness: number("flatness", default.flatness)?,
        diff_trans: number("diff_trans", default.diff_trans)?,
    })
}
