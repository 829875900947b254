//! Surface scattering: diffuse, phong, roughconductor, roughdielectric, twosided, null.

use drt_estimators::surface::{
    Bsdf, Diffuse, Distribution, Phong, RoughConductor, RoughDielectric, TwoSided,
};
use drt_math::Rgb;

use super::Loader;
use super::element::Element;
use super::properties::Properties;
use crate::CliError;

impl<'a> Loader<'a> {
    pub(super) fn bsdf(&self, e: &'a Element) -> Result<Bsdf, CliError> {
        let p = Properties::of(e)?;
        let bsdf = match p.kind()? {
            "null" => Bsdf::Null,
            "diffuse" => Bsdf::Diffuse(diffuse(&p)?),
            "phong" => Bsdf::Phong(phong(&p)?),
            "roughconductor" => Bsdf::RoughConductor(conductor(&p)?),
            "roughdielectric" => Bsdf::RoughDielectric(dielectric(&p)?),
            "twosided" => Bsdf::TwoSided(Box::new(self.two_sided(&p)?)),
            other => {
                return Err(e.error(format!(
                    "the bsdf type `{other}` is not supported; expected diffuse, roughconductor, \
                     roughdielectric, phong, twosided or null"
                )));
            }
        };
        p.finish()?;
        bsdf.validate().map_err(|err| e.error(err))?;
        Ok(bsdf)
    }

    fn two_sided(&self, p: &Properties<'a>) -> Result<TwoSided, CliError> {
        let sides = self.index.inner(p, "bsdf", None);
        // Also what keeps a reference to itself from being followed for ever.
        if let Some(s) = sides.iter().find(|s| s.target.attribute("type") == Some("twosided")) {
            return Err(s
                .child
                .error("a twosided bsdf cannot be a side of another one, or its own"));
        }
        let side = |i: usize| sides.get(i).map(|s| self.bsdf(s.target)).transpose();
        match (side(0)?, sides.len()) {
            (Some(front), 1 | 2) => Ok(TwoSided { front, back: side(1)? }),
            (_, n) => Err(p.element.error(format!("expected one or two bsdfs inside, found {n}"))),
        }
    }
}

fn reflectance(p: &Properties<'_>, names: &[&'static str], default: Rgb) -> Result<Rgb, CliError> {
    for name in names {
        if let Some(c) = p.color(name)? {
            return Ok(c);
        }
    }
    Ok(default)
}

fn diffuse(p: &Properties<'_>) -> Result<Diffuse, CliError> {
    let names = ["reflectance", "diffuse_reflectance"];
    let names = if p.element.is_legacy() { &names[..] } else { &names[..1] };
    Ok(Diffuse { reflectance: reflectance(p, names, Diffuse::default().reflectance)? })
}

fn phong(p: &Properties<'_>) -> Result<Phong, CliError> {
    let default = Phong::default();
    Ok(Phong {
        reflectance: reflectance(p, &["diffuse_reflectance", "reflectance"], default.reflectance)?,
        specular_reflectance: reflectance(
            p,
            &["specular_reflectance"],
            default.specular_reflectance,
        )?,
        exponent: p.float("exponent")?.unwrap_or(default.exponent),
    })
}

fn conductor(p: &Properties<'_>) -> Result<RoughConductor, CliError> {
    let default = RoughConductor::default();
    let (eta, k) = match (p.color("eta")?, p.color("k")?, p.string("material")?) {
        (None, None, Some("none")) => (default.eta, default.k),
        // The default material of 0.6 is copper, which is given by measured spectra.
        (None, None, None) if p.element.is_legacy() => {
            return Err(p.element.error("give `eta` and `k` as numbers"));
        }
        (eta, k, None) => (eta.unwrap_or(default.eta), k.unwrap_or(default.k)),
        (_, _, Some(name)) => {
            return Err(p.element.error(format!(
                "the material `{name}` is not supported; give `eta` and `k` as numbers"
            )));
        }
    };
    Ok(RoughConductor {
        distribution: distribution(p)?,
        alpha: alpha(p, default.alpha)?,
        eta,
        k,
        specular_reflectance: reflectance(p, &["specular_reflectance"], Rgb::ONE)?,
    })
}

fn dielectric(p: &Properties<'_>) -> Result<RoughDielectric, CliError> {
    let default = RoughDielectric::default();
    let (int_ior, ext_ior) = (ior(p, "int_ior", BK7)?, ior(p, "ext_ior", AIR)?);
    Ok(RoughDielectric {
        distribution: distribution(p)?,
        alpha: alpha(p, default.alpha)?,
        eta: int_ior / ext_ior,
        specular_reflectance: reflectance(p, &["specular_reflectance"], Rgb::ONE)?,
        specular_transmittance: reflectance(p, &["specular_transmittance"], Rgb::ONE)?,
    })
}

fn distribution(p: &Properties<'_>) -> Result<Distribution, CliError> {
    // How microfacets are sampled does not change expected values.
    p.boolean("sample_visible")?;
    let choices = [("beckmann", Distribution::Beckmann), ("ggx", Distribution::Ggx)];
    Ok(p.choice("distribution", &choices)?.unwrap_or(Distribution::Beckmann))
}

/// `alpha`, or `alpha_u` and `alpha_v` where they are equal.
fn alpha(p: &Properties<'_>, default: f64) -> Result<f64, CliError> {
    match (p.float("alpha")?, p.float("alpha_u")?, p.float("alpha_v")?) {
        (alpha, None, None) => Ok(alpha.unwrap_or(default)),
        (None, Some(u), Some(v)) if u == v => Ok(u),
        (None, Some(_), Some(_)) => Err(p.element.error(
            "anisotropic roughness is not supported; `alpha_u` and `alpha_v` must be equal",
        )),
        _ => Err(p.element.error("give `alpha` alone, or `alpha_u` and `alpha_v`")),
    }
}

const BK7: f64 = 1.5046;
const AIR: f64 = 1.000_277;

/// Indices of refraction at visible wavelengths by the names Mitsuba knows.
const INDICES: [(&str, f64); 23] = [
    ("vacuum", 1.0),
    ("helium", 1.000_036),
    ("hydrogen", 1.000_132),
    ("air", AIR),
    ("carbon dioxide", 1.000_45),
    ("water", 1.333),
    ("acetone", 1.36),
    ("ethanol", 1.361),
    ("carbon tetrachloride", 1.461),
    ("glycerol", 1.4729),
    ("benzene", 1.501),
    ("silicone oil", 1.520_45),
    ("bromine", 1.661),
    ("water ice", 1.31),
    ("fused quartz", 1.458),
    ("pyrex", 1.47),
    ("acrylic glass", 1.49),
    ("polypropylene", 1.49),
    ("bk7", BK7),
    ("sodium chloride", 1.544),
    ("amber", 1.55),
    ("pet", 1.575),
    ("diamond", 2.419),
];

/// An index of refraction, by number or by name.
fn ior(p: &Properties<'_>, name: &'static str, default: f64) -> Result<f64, CliError> {
    if !p.element.children.iter().any(|c| c.tag == "string" && c.attribute("name") == Some(name)) {
        return Ok(p.float(name)?.unwrap_or(default));
    }
    Ok(p.choice(name, &INDICES)?.unwrap_or(default))
}
