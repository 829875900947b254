use alloc::boxed::Box;
use alloc::string::String;
use core::fmt;

use drt_math::Rgb;

use crate::model::texture::TexelError;

/// A number or colour of a BSDF that a parameter can move.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum Property {
    /// Albedo of the diffuse lobe.
    Reflectance,
    /// Weight of the glossy reflection.
    SpecularReflectance,
    /// Weight of the glossy refraction.
    SpecularTransmittance,
    /// Roughness of the microfacets, a scalar.
    Alpha,
    /// Relative index of refraction: a scalar for dielectrics (interior over exterior), a colour for
    /// conductors (real part).
    Eta,
    /// Imaginary part of a conductor's index.
    K,
    /// Sharpness of the Phong lobe, a scalar.
    Exponent,
    /// Weight of the second BSDF of a blend, a scalar.
    Weight,
    /// What a mask leaves of a surface, a scalar.
    Opacity,
    /// Roughness along the tangent, a scalar.
    AlphaU,
    /// Roughness across it, a scalar.
    AlphaV,
    /// Colour of a principled BSDF.
    BaseColor,
    /// Its roughness, as artists know it, a scalar; so are all that follow.
    Roughness,
    /// How much wider lobes are along the tangent.
    Anisotropic,
    /// How much of a metal it is.
    Metallic,
    /// How much of the rest goes through.
    SpecTrans,
    /// How much of the base colour a dielectric's reflection has.
    SpecTint,
    /// The light of cloth at grazing angles.
    Sheen,
    /// How much of the base colour that has.
    SheenTint,
    /// From diffuse to flat, as by scattering below the surface.
    Flatness,
    /// A second, sharper reflection.
    Clearcoat,
    /// How sharp that is.
    ClearcoatGloss,
    /// Diffuse light that goes through a thin sheet, of two parts.
    DiffTrans,
    /// Absorption coefficient of a coating, a colour.
    SigmaA,
    /// Thickness of a coating.
    Thickness,
}

impl Property {
    pub(super) const ALL: [Self; 25] = [
        Self::Reflectance,
        Self::SpecularReflectance,
        Self::SpecularTransmittance,
        Self::Alpha,
        Self::Eta,
        Self::K,
        Self::Exponent,
        Self::Weight,
        Self::Opacity,
        Self::AlphaU,
        Self::AlphaV,
        Self::BaseColor,
        Self::Roughness,
        Self::Anisotropic,
        Self::Metallic,
        Self::SpecTrans,
        Self::SpecTint,
        Self::Sheen,
        Self::SheenTint,
        Self::Flatness,
        Self::Clearcoat,
        Self::ClearcoatGloss,
        Self::DiffTrans,
        Self::SigmaA,
        Self::Thickness,
    ];

    /// The least and the largest value that has a meaning, whatever the BSDF.
    #[must_use]
    pub fn range(self) -> [f64; 2] {
        match self {
            Self::Eta | Self::K | Self::Exponent | Self::SigmaA | Self::Thickness => {
                [0.0, f64::INFINITY]
            }
            Self::DiffTrans => [0.0, 2.0],
            _ => [0.0, 1.0],
        }
    }

    /// The property's name in job files.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Reflectance => "reflectance",
            Self::SpecularReflectance => "specular_reflectance",
            Self::SpecularTransmittance => "specular_transmittance",
            Self::Alpha => "alpha",
            Self::Eta => "eta",
            Self::K => "k",
            Self::Exponent => "exponent",
            Self::Weight => "weight",
            Self::Opacity => "opacity",
            Self::AlphaU => "alpha_u",
            Self::AlphaV => "alpha_v",
            Self::BaseColor => "base_color",
            Self::Roughness => "roughness",
            Self::Anisotropic => "anisotropic",
            Self::Metallic => "metallic",
            Self::SpecTrans => "spec_trans",
            Self::SpecTint => "spec_tint",
            Self::Sheen => "sheen",
            Self::SheenTint => "sheen_tint",
            Self::Flatness => "flatness",
            Self::Clearcoat => "clearcoat",
            Self::ClearcoatGloss => "clearcoat_gloss",
            Self::DiffTrans => "diff_trans",
            Self::SigmaA => "sigma_a",
            Self::Thickness => "thickness",
        }
    }

    /// The property of a name; `diffuse_reflectance` is another name of `reflectance`.
    ///
    /// # Errors
    /// [`SurfaceError::UnknownProperty`], which lists the names that exist.
    pub fn from_name(name: &str) -> Result<Self, SurfaceError> {
        let wanted = if name == "diffuse_reflectance" { "reflectance" } else { name };
        Self::ALL.into_iter().find(|p| p.name() == wanted).ok_or_else(|| {
            SurfaceError::UnknownProperty { name: name.into(), known: names(Self::ALL) }
        })
    }
}

impl fmt::Display for Property {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

/// Names separated by commas.
pub(super) fn names(properties: impl IntoIterator<Item = Property>) -> String {
    let mut list = String::new();
    for p in properties {
        if !list.is_empty() {
            list.push_str(", ");
        }
        list.push_str(p.name());
    }
    list
}

/// What is wrong with a BSDF or with a change of one.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum SurfaceError {
    /// No BSDF has a property of this name.
    #[error("no BSDF has a property \"{name}\"; there are: {known}")]
    UnknownProperty {
        /// The name asked for.
        name: String,
        /// The names that exist.
        known: String,
    },
    /// This BSDF lacks the property.
    #[error("a {bsdf} BSDF has no \"{property}\"; it has: {available}")]
    NoSuchProperty {
        /// Kind of BSDF, by its plugin name.
        bsdf: &'static str,
        /// The name of the property asked for.
        property: String,
        /// The names of those it has, or `nothing that can change`.
        available: String,
    },
    /// A value, given or reached by a change, that the model does not allow.
    #[error("\"{property}\" is {value}, but must be {expected}")]
    OutOfRange {
        /// The property.
        property: Property,
        /// The value refused.
        value: f64,
        /// What is allowed.
        expected: &'static str,
    },
    /// A property of this BSDF that nothing but finite differences differentiates by.
    #[error("\"{property}\" of a {bsdf} BSDF has finite differences only: {reason}")]
    NotDifferentiated {
        /// Kind of BSDF, by its plugin name.
        bsdf: &'static str,
        /// The property.
        property: Property,
        /// Why.
        reason: &'static str,
    },
    /// A scalar property was to be moved by three different numbers.
    #[error("\"{property}\" is a single number: add three equal numbers, not {r}, {g}, {b}")]
    NotUniform {
        /// The property.
        property: Property,
        /// First number.
        r: f64,
        /// Second number.
        g: f64,
        /// Third number.
        b: f64,
    },
    /// A property that a texture stands for.
    #[error("a texture stands for \"{property}\"")]
    StoodFor {
        /// The property.
        property: Property,
    },
    /// Values of a texture, or some of them, that the BSDF does not take.
    #[error("the texture of \"{property}\": {reason}")]
    Texture {
        /// What it stands for.
        property: Property,
        /// What is wrong.
        reason: Box<SurfaceError>,
    },
    /// Texels that cannot change.
    #[error(transparent)]
    Texels(#[from] TexelError),
    /// Textures around something that is no plain BSDF.
    #[error("a {bsdf} BSDF takes no textures; give them to what is in it")]
    TexturedTwice {
        /// Kind of that BSDF, by its plugin name.
        bsdf: &'static str,
    },
    /// A texture wants an attribute that a shape lacks.
    #[error("a texture of its BSDF is the attribute `{name}`, which its mesh does not have")]
    NoAttribute {
        /// The attribute.
        name: String,
    },
    /// The factor of a map of heights.
    #[error("the scale of a bump map is {0}, but must be finite")]
    BadScale(f64),
    /// Something that scatters nothing, or lets light go straight through, where that has no meaning.
    #[error("a {outer} BSDF cannot hold a {bsdf} BSDF")]
    CannotHold {
        /// Kind of the outer BSDF, by its plugin name.
        outer: &'static str,
        /// Kind of the nested BSDF, by its plugin name.
        bsdf: &'static str,
    },
    /// Only plain reflectors have two equal sides.
    #[error("a twosided BSDF cannot hold a {bsdf} BSDF; use it without twosided")]
    NotReflective {
        /// Kind of the nested BSDF, by its plugin name.
        bsdf: &'static str,
    },
    /// A change does not say which of two different sides it means.
    #[error(
        "\"{property}\" of a twosided BSDF with two different sides cannot change; use one BSDF for \
         both sides, or two surfaces"
    )]
    DifferentSides {
        /// The property.
        property: Property,
    },
}

/// Where a BSDF keeps a property.
pub(super) enum Slot<'a> {
    Color(&'a mut Rgb),
    Scalar(&'a mut f64),
}

impl Slot<'_> {
    /// The value, a scalar in every channel.
    pub(super) fn value(&self) -> Rgb {
        match self {
            Self::Color(c) => **c,
            Self::Scalar(s) => Rgb::splat(**s),
        }
    }

    /// Sets the value; of a scalar's three equal channels the first counts.
    pub(super) fn set(self, value: Rgb) {
        match self {
            Self::Color(c) => *c = value,
            Self::Scalar(s) => *s = value.r,
        }
    }
}

pub(super) fn in_range(
    property: Property,
    value: f64,
    allowed: bool,
    expected: &'static str,
) -> Result<(), SurfaceError> {
    if allowed && value.is_finite() {
        Ok(())
    } else {
        Err(SurfaceError::OutOfRange { property, value, expected })
    }
}

pub(super) fn part(property: Property, value: f64) -> Result<(), SurfaceError> {
    in_range(property, value, (0.0..=1.0).contains(&value), "from 0 to 1")
}

pub(super) fn nonnegative(property: Property, value: Rgb) -> Result<(), SurfaceError> {
    value.to_array().into_iter().try_for_each(|v| in_range(property, v, v >= 0.0, "0 or more"))
}
