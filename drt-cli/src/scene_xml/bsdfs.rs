//! Surface scattering.

mod composed;
mod legacy;
mod measured;
mod principled;

use drt_estimators::surface::{
    Anisotropic, Bsdf, Coating, Conductor, Dielectric, Diffuse, Distribution, Phong, Plastic,
    Property, RoughConductor, RoughDielectric, Textured, ThinDielectric, TwoSided,
};
use drt_math::Rgb;

use super::Loader;
use super::element::Element;
use super::parts::Parts;
use super::properties::Properties;
use super::spectrum::conductors;
use crate::CliError;

impl<'a> Loader<'a> {
    pub(super) fn bsdf(&self, e: &'a Element) -> Result<Bsdf, CliError> {
        self.part(e, &Parts::new("bsdfs"))
    }

    /// A BSDF that is inside of one.
    fn part(&self, e: &'a Element, parts: &Parts) -> Result<Bsdf, CliError> {
        parts.count(e)?;
        let p = Properties::of(e)?;
        let bsdf = match p.kind()? {
            "null" => Bsdf::Null,
            "diffuse" => Bsdf::Diffuse(diffuse(&p)?),
            "phong" => Bsdf::Phong(phong(&p)?),
            "plastic" | "roughplastic" => Bsdf::Plastic(plastic(&p)?),
            "conductor" => Bsdf::Conductor(smooth_conductor(&p)?),
            "pplastic" => Bsdf::Plastic(unpolarized_plastic(&p)?),
            "roughconductor" => rough(&p, Bsdf::RoughConductor(conductor(&p)?))?,
            "dielectric" => Bsdf::Dielectric(smooth_dielectric(&p)?),
            "thindielectric" => Bsdf::ThinDielectric(thin_dielectric(&p)?),
            "roughdielectric" => rough(&p, Bsdf::RoughDielectric(dielectric(&p)?))?,
            "principled" => Bsdf::Principled(Box::new(principled::thick(&p)?)),
            "principledthin" => Bsdf::PrincipledThin(Box::new(principled::thin(&p)?)),
            "measured" => Bsdf::Measured(self.measured(&p)?),
            "twosided" => Bsdf::TwoSided(Box::new(self.two_sided(&p, parts)?)),
            "mask" => Bsdf::Mask(Box::new(self.mask(&p, parts)?)),
            "blendbsdf" => Bsdf::Blend(Box::new(self.blend(&p, parts)?)),
            "normalmap" => Bsdf::Perturbed(Box::new(self.normal_map(&p, parts)?)),
            "coating" | "roughcoating" => Bsdf::Coated(Box::new(self.coated(&p, parts)?)),
            "roughdiffuse" => Bsdf::RoughDiffuse(legacy::rough_diffuse(&p)?),
            "ward" => legacy::ward(&p)?,
            "bumpmap" => Bsdf::Perturbed(Box::new(self.bump_map(&p, parts)?)),
            other => {
                return Err(e.error(format!(
                    "the bsdf type `{other}` is not supported; expected diffuse, plastic, \
                     roughplastic, pplastic, conductor, roughconductor, dielectric, \
                     thindielectric, roughdielectric, phong, principled, principledthin, measured, \
                     blendbsdf, mask, normalmap, bumpmap, coating, roughcoating, roughdiffuse, \
                     ward, twosided or null"
                )));
            }
        };
        let mut textures = Vec::new();
        for (name, texture) in p.take_textures() {
            let property = Property::from_name(name).map_err(|_| {
                e.error(format!("a texture of `{name}` is not supported; give a number"))
            })?;
            textures.push((property, texture));
        }
        p.finish()?;
        if textures.is_empty() {
            return bsdf.validate().map(|()| bsdf).map_err(|err| e.error(err));
        }
        let textured = Textured::new(bsdf, textures).map_err(|err| e.error(err))?;
        Ok(Bsdf::Textured(Box::new(textured)))
    }

    fn two_sided(&self, p: &Properties<'a>, parts: &Parts) -> Result<TwoSided, CliError> {
        let sides = self.index.inner(p, "bsdf", None);
        // Also what keeps a reference to itself from being followed for ever.
        if let Some(s) = sides.iter().find(|s| s.target.attribute("type") == Some("twosided")) {
            return Err(s
                .child
                .error("a twosided bsdf cannot be a side of another one, or its own"));
        }
        let side = |i: usize| sides.get(i).map(|s| self.part(s.target, parts)).transpose();
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
    let (eta, k) = index(p, (default.eta, default.k))?;
    Ok(RoughConductor {
        distribution: distribution(p)?,
        alpha: default.alpha,
        eta,
        k,
        specular_reflectance: reflectance(p, &["specular_reflectance"], Rgb::ONE)?,
    })
}

/// The index of a metal: `eta` and `k`, or that of a `material`.
fn index(p: &Properties<'_>, default: (Rgb, Rgb)) -> Result<(Rgb, Rgb), CliError> {
    // The default material of 0.6 is copper.
    let copper = if p.element.is_legacy() { Some("Cu") } else { None };
    let exterior = if p.element.is_legacy() { ior(p, "ext_eta", AIR)? } else { 1.0 };
    let (eta, k) = match (p.color("eta")?, p.color("k")?, p.string("material")?) {
        (None, None, Some("none")) => return Ok(default),
        (None, None, name) => match name.or(copper) {
            None => default,
            Some(name) => conductors::conductor(name).ok_or_else(|| {
                let known = conductors::names();
                p.element.error(format!("`material` is `{name}`; expected none, {known}"))
            })?,
        },
        (eta, k, None) => (eta.unwrap_or(default.0), k.unwrap_or(default.1)),
        _ => return Err(p.element.error("give `material`, or `eta` and `k`, not both")),
    };
    let index = [("eta", eta), ("k", k)].map(|(name, value)| {
        let clamped = value.map(|v| v.max(0.0));
        if clamped != value {
            p.element.note(format!("`{name}` has negative numbers, which count as zero"));
        }
        clamped * exterior.recip()
    });
    Ok((index[0], index[1]))
}

fn smooth_conductor(p: &Properties<'_>) -> Result<Conductor, CliError> {
    let default = Conductor::default();
    let (eta, k) = index(p, (default.eta, default.k))?;
    let specular_reflectance = reflectance(p, &["specular_reflectance"], Rgb::ONE)?;
    Ok(Conductor { eta, k, specular_reflectance })
}

fn smooth_dielectric(p: &Properties<'_>) -> Result<Dielectric, CliError> {
    Ok(Dielectric {
        eta: ior(p, "int_ior", BK7)? / ior(p, "ext_ior", AIR)?,
        specular_reflectance: reflectance(p, &["specular_reflectance"], Rgb::ONE)?,
        specular_transmittance: reflectance(p, &["specular_transmittance"], Rgb::ONE)?,
    })
}

fn thin_dielectric(p: &Properties<'_>) -> Result<ThinDielectric, CliError> {
    let Dielectric { eta, specular_reflectance, specular_transmittance } = smooth_dielectric(p)?;
    Ok(ThinDielectric { eta, specular_reflectance, specular_transmittance })
}

fn plastic(p: &Properties<'_>) -> Result<Plastic, CliError> {
    let eta = ior(p, "int_ior", POLYPROPYLENE)? / ior(p, "ext_ior", AIR)?;
    let coating = match p.kind()? {
        "plastic" => Coating::smooth(eta),
        _ => Coating::rough(distribution(p)?, alpha(p, 0.1)?, eta),
    };
    let default = Plastic::new(coating.map_err(|err| p.element.error(err))?);
    Ok(Plastic {
        reflectance: reflectance(p, &["diffuse_reflectance"], default.reflectance)?,
        specular_reflectance: reflectance(p, &["specular_reflectance"], Rgb::ONE)?,
        nonlinear: p.boolean("nonlinear")?.unwrap_or(false),
        ..default
    })
}

/// `pplastic`, whose polarisation nothing here sees.
fn unpolarized_plastic(p: &Properties<'_>) -> Result<Plastic, CliError> {
    let eta = ior(p, "int_ior", POLYPROPYLENE)? / ior(p, "ext_ior", AIR)?;
    let coating = Coating::unmixed(distribution(p)?, alpha(p, 0.1)?, eta);
    let default = Plastic::new(coating.map_err(|err| p.element.error(err))?);
    Ok(Plastic {
        reflectance: reflectance(p, &["diffuse_reflectance"], default.reflectance)?,
        specular_reflectance: reflectance(p, &["specular_reflectance"], Rgb::ONE)?,
        ..default
    })
}

fn dielectric(p: &Properties<'_>) -> Result<RoughDielectric, CliError> {
    let default = RoughDielectric::default();
    let (int_ior, ext_ior) = (ior(p, "int_ior", BK7)?, ior(p, "ext_ior", AIR)?);
    Ok(RoughDielectric {
        distribution: distribution(p)?,
        alpha: default.alpha,
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

/// A rough metal or interface with its roughness, even or not.
fn rough(p: &Properties<'_>, mut bsdf: Bsdf) -> Result<Bsdf, CliError> {
    let alphas = (p.float("alpha")?, p.float("alpha_u")?, p.float("alpha_v")?);
    let (Bsdf::RoughConductor(RoughConductor { alpha, .. })
    | Bsdf::RoughDielectric(RoughDielectric { alpha, .. })) = &mut bsdf
    else {
        return Ok(bsdf);
    };
    let textured = ["alpha_u", "alpha_v"].into_iter().any(|name| p.is_textured(name));
    match alphas {
        (even, None, None) => *alpha = even.unwrap_or(*alpha),
        (None, Some(u), Some(v)) if u == v && !textured => *alpha = u,
        (None, Some(u), Some(v)) => {
            return Ok(Bsdf::Anisotropic(Box::new(Anisotropic { base: bsdf, alpha: [u, v] })));
        }
        _ => return Err(p.element.error(ONE_ROUGHNESS)),
    }
    Ok(bsdf)
}

const ONE_ROUGHNESS: &str = "give `alpha` alone, or `alpha_u` and `alpha_v`";

/// `alpha`, or `alpha_u` and `alpha_v` where they are equal.
fn alpha(p: &Properties<'_>, default: f64) -> Result<f64, CliError> {
    match (p.float("alpha")?, p.float("alpha_u")?, p.float("alpha_v")?) {
        (alpha, None, None) => Ok(alpha.unwrap_or(default)),
        (None, Some(u), Some(v)) if u == v => Ok(u),
        (None, Some(_), Some(_)) => Err(p.element.error(
            "a coating cannot have anisotropic roughness; `alpha_u` and `alpha_v` must be equal",
        )),
        _ => Err(p.element.error(ONE_ROUGHNESS)),
    }
}

const BK7: f64 = 1.5046;
const POLYPROPYLENE: f64 = 1.49;
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
    ("polypropylene", POLYPROPYLENE),
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
