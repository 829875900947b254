//! The list of kinds of BSDFs.

use alloc::boxed::Box;
use alloc::sync::Arc;

use crate::model::surface::null::NoSurface;
use crate::model::surface::{
    Anisotropic, Blend, Coated, Conductor, Dielectric, Diffuse, Mask, Measured, Perturbed, Phong,
    Plastic, Principled, PrincipledThin, RoughConductor, RoughDielectric, RoughDiffuse, Textured,
    ThinDielectric, TwoSided, Ward,
};

/// Declares the kinds, and `each!`, which applies an expression to the model of a BSDF of any of them.
macro_rules! kinds {
    ($d:tt $($(#[$doc:meta])* $kind:ident($model:ty),)+) => {
        /// A bidirectional scattering distribution function.
        ///
        /// Fields are plain data: [`Bsdf::validate`] says whether they make sense, and everything else
        /// relies on it.
        #[derive(Clone, Debug, PartialEq)]
        #[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
        #[non_exhaustive]
        pub enum Bsdf {
            /// No surface at all: the border of a medium.
            Null,
            $($(#[$doc])* $kind($model),)+
        }

        /// The names of the kinds.
        #[cfg(test)]
        pub(super) const KINDS: &[&str] = &["Null", $(stringify!($kind)),+];

        #[cfg(test)]
        impl Bsdf {
            /// The name of its kind.
            pub(super) fn kind(&self) -> &'static str {
                match self {
                    Self::Null => "Null",
                    $(Self::$kind(_) => stringify!($kind),)+
                }
            }
        }

        macro_rules! each {
            ($d bsdf:expr, $d model:ident => $d body:expr) => {
                match $d bsdf {
                    $crate::model::surface::Bsdf::Null => {
                        let $d model = $crate::model::surface::kinds::no_surface();
                        $d body
                    }
                    $($crate::model::surface::Bsdf::$kind($d model) => $d body,)+
                }
            };
        }
    };
}

kinds! {
    $
    /// A Lambertian reflector.
    Diffuse(Diffuse),
    /// A modified Phong reflector.
    Phong(Phong),
    /// A rough metal.
    RoughConductor(RoughConductor),
    /// A rough interface of two transparent media.
    RoughDielectric(RoughDielectric),
    /// A diffuse base under a coating, smooth or rough.
    Plastic(Plastic),
    /// A smooth metal.
    Conductor(Conductor),
    /// A smooth interface of two transparent media.
    Dielectric(Dielectric),
    /// A thin pane.
    ThinDielectric(ThinDielectric),
    /// A reflector on both sides.
    TwoSided(Box<TwoSided>),
    /// A one-sided BSDF with textures.
    Textured(Box<Textured>),
    /// A BSDF that is there in part only.
    Mask(Box<Mask>),
    /// A mixture of two BSDFs.
    Blend(Box<Blend>),
    /// A reflector under a clear or tinted layer.
    Coated(Box<Coated>),
    /// A BSDF whose normals are not those of the surface.
    Perturbed(Box<Perturbed>),
    /// A rough metal or interface whose lobes are longer than wide.
    Anisotropic(Box<Anisotropic>),
    /// Burley's model of many materials.
    Principled(Box<Principled>),
    /// Burley's model of thin sheets.
    PrincipledThin(Box<PrincipledThin>),
    /// A measured reflector.
    Measured(Arc<Measured>),
    /// A diffuse reflector of rough grooves.
    RoughDiffuse(RoughDiffuse),
    /// Ward's reflector.
    Ward(Ward),
}

pub(super) use each;

/// The model of a BSDF that has no numbers, for as long as one likes: it takes no memory.
#[inline]
pub(super) fn no_surface<'a>() -> &'a mut NoSurface {
    Box::leak(Box::new(NoSurface))
}
