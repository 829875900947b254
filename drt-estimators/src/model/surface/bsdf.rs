//! The list of kinds of BSDFs. Its folder has the kinds that hold other BSDFs, and what every kind is asked alike.

mod anisotropic;
mod blend;
mod change;
mod coated;
mod flags;
mod mask;
mod perturbed;
mod textured;
mod two_sided;

use alloc::boxed::Box;
use alloc::sync::Arc;

pub use crate::model::surface::bsdf::anisotropic::Anisotropic;
pub use crate::model::surface::bsdf::blend::Blend;
pub use crate::model::surface::bsdf::change::BsdfChange;
pub use crate::model::surface::bsdf::coated::Coated;
pub use crate::model::surface::bsdf::mask::Mask;
pub use crate::model::surface::bsdf::perturbed::{Perturbation, Perturbed};
pub use crate::model::surface::bsdf::textured::Textured;
pub use crate::model::surface::bsdf::two_sided::TwoSided;
use crate::model::surface::null::NoSurface;
use crate::model::surface::{
    Conductor, Dielectric, Diffuse, Measured, Phong, Plastic, Principled, PrincipledThin,
    RoughConductor, RoughDielectric, RoughDiffuse, ThinDielectric, Ward,
};

/// A BSDF that is made of other BSDFs.
trait Composed {
    /// The others.
    fn parts(&self) -> [Option<&Bsdf>; 2];
}

/// Declares the kinds, and `each!`, which applies an expression to the model of a BSDF of any of them.
macro_rules! kinds {
    (
        $d:tt
        single { $($(#[$doc:meta])* $kind:ident($model:ty),)+ }
        composed { $($(#[$composed_doc:meta])* $composed:ident($composed_model:ty),)+ }
    ) => {
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
            $($(#[$composed_doc])* $composed($composed_model),)+
        }

        /// The names of the kinds.
        #[cfg(test)]
        pub(super) const KINDS: &[&str] = &["Null", $(stringify!($kind),)+ $(stringify!($composed)),+];

        #[cfg(test)]
        impl Bsdf {
            /// The name of its kind.
            pub(super) fn kind(&self) -> &'static str {
                match self {
                    Self::Null => "Null",
                    $(Self::$kind(_) => stringify!($kind),)+
                    $(Self::$composed(_) => stringify!($composed),)+
                }
            }
        }

        impl Bsdf {
            /// The BSDFs that this one is made of.
            pub(super) fn parts(&self) -> impl Iterator<Item = &Self> {
                let parts = match self {
                    Self::Null $(| Self::$kind(_))+ => [None; 2],
                    $(Self::$composed(b) => b.parts(),)+
                };
                parts.into_iter().flatten()
            }
        }

        macro_rules! each {
            ($d bsdf:expr, $d model:ident => $d body:expr) => {
                match $d bsdf {
                    $crate::model::surface::Bsdf::Null => {
                        let $d model = $crate::model::surface::bsdf::no_surface();
                        $d body
                    }
                    $($crate::model::surface::Bsdf::$kind($d model) => $d body,)+
                    $($crate::model::surface::Bsdf::$composed($d model) => $d body,)+
                }
            };
        }
    };
}

kinds! {
    $
    single {
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
    composed {
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
    }
}

pub(super) use each;

/// The model of a BSDF that has no numbers, for as long as one likes: it takes no memory.
#[inline]
pub(super) fn no_surface<'a>() -> &'a mut NoSurface {
    Box::leak(Box::new(NoSurface))
}
