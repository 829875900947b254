//! What kind of BSDF one is: what transport asks before it samples one.

use drt_geom::Mesh;

use crate::model::surface::shading_frame::frames_jump_on;
use crate::model::surface::{Bsdf, Property};

impl Bsdf {
    /// True for the border of a medium that light crosses unchanged.
    #[inline]
    #[must_use]
    pub fn is_null(&self) -> bool {
        matches!(self, Self::Null)
    }

    /// True of a model that is the same everywhere and on both sides of its normal.
    #[inline]
    pub(crate) fn is_plain(&self) -> bool {
        matches!(
            self,
            Self::Null
                | Self::Diffuse(_)
                | Self::Phong(_)
                | Self::RoughConductor(_)
                | Self::RoughDielectric(_)
                | Self::Plastic(_)
        )
    }

    /// True when nothing is scattered, as of now: a null interface, or no reflectance on any side.
    #[must_use]
    pub(crate) fn is_black(&self) -> bool {
        match self {
            Self::Null => true,
            Self::Diffuse(d) => d.reflectance.is_zero(),
            Self::Textured(t) => t.bsdf.is_black(),
            Self::TwoSided(t) => t.front.is_black() && t.back.as_ref().is_none_or(Self::is_black),
            Self::Blend(b) => b.bsdfs.iter().all(Self::is_black),
            Self::Perturbed(b) => b.bsdf.is_black(),
            _ => false,
        }
    }

    /// True when nothing is scattered where both directions are on the back of the surface.
    pub(crate) fn is_black_from_behind(&self) -> bool {
        match self {
            Self::Diffuse(_)
            | Self::Phong(_)
            | Self::RoughConductor(_)
            | Self::Plastic(_)
            | Self::Conductor(_)
            | Self::RoughDiffuse(_)
            | Self::Ward(_)
            | Self::Measured(_) => true,
            Self::Textured(b) => b.bsdf.is_black_from_behind(),
            Self::Blend(b) => b.bsdfs.iter().all(Self::is_black_from_behind),
            _ => false,
        }
    }

    /// True when light is scattered through the surface, to the other side; not for [`Bsdf::Null`],
    /// which scatters nothing.
    #[inline]
    #[must_use]
    pub fn is_transmissive(&self) -> bool {
        match self {
            Self::RoughDielectric(_) | Self::Dielectric(_) | Self::ThinDielectric(_) => true,
            Self::Null
            | Self::Diffuse(_)
            | Self::Phong(_)
            | Self::RoughConductor(_)
            | Self::Plastic(_)
            | Self::Conductor(_) => false,
            _ => self.is_any_transmissive(),
        }
    }

    /// Of BSDFs that are no plain models.
    #[cold]
    fn is_any_transmissive(&self) -> bool {
        match self {
            Self::PrincipledThin(_) => true,
            Self::Principled(b) => b.is_transmissive(),
            Self::Anisotropic(b) => b.base.is_transmissive(),
            // A texture may stand for how much goes through.
            Self::Textured(b) => {
                b.bsdf.is_transmissive() || b.texture(Property::SpecTrans).is_some()
            }
            _ => self.inner().any(Self::is_transmissive),
        }
    }

    /// True where light is scattered into single directions, past which nothing that moves is differentiated.
    #[must_use]
    pub fn is_smooth(&self) -> bool {
        match self {
            Self::Conductor(_) | Self::Dielectric(_) | Self::ThinDielectric(_) => true,
            Self::Plastic(b) => b.is_smooth(),
            Self::Coated(b) if b.coating.facets().is_none() => true,
            _ => self.inner().any(Self::is_smooth),
        }
    }

    /// True where some light goes straight on, as through nothing.
    pub(crate) fn passes_straight(&self) -> bool {
        match self {
            Self::Mask(_) | Self::ThinDielectric(_) => true,
            _ => self.inner().any(Self::passes_straight),
        }
    }

    /// True where the value may depend on the place of its point.
    #[inline]
    pub(crate) fn varies(&self) -> bool {
        matches!(self, Self::Textured(_) | Self::Blend(_) | Self::TwoSided(_) | Self::Coated(_))
    }

    /// True where directions along the surface are told apart, by its texture coordinates.
    pub(crate) fn is_oriented(&self) -> bool {
        match self {
            Self::Diffuse(_) | Self::Phong(_) | Self::RoughConductor(_) | Self::Plastic(_) => false,
            Self::Anisotropic(_) | Self::Perturbed(_) => true,
            Self::Principled(b) => b.anisotropic != 0.0,
            Self::PrincipledThin(b) => b.anisotropic != 0.0,
            Self::Measured(b) => b.is_oriented(),
            Self::Ward(b) => b.alpha[0] != b.alpha[1],
            Self::Textured(b)
                if [Property::Anisotropic, Property::AlphaU, Property::AlphaV]
                    .into_iter()
                    .any(|p| b.texture(p).is_some()) =>
            {
                true
            }
            _ => self.inner().any(Self::is_oriented),
        }
    }

    /// The name of the first BSDF in this one that nothing which moves is differentiated at: it jumps where no term samples it, or its
    /// normals follow motions in ways that no term knows.
    pub(crate) fn undifferentiable(&self) -> Option<&'static str> {
        match self {
            Self::Mask(_) | Self::Perturbed(_) => Some(self.name()),
            Self::Measured(b) if !b.is_continuous() => Some(self.name()),
            _ => self.inner().find_map(Self::undifferentiable),
        }
    }

    /// The first property whose texture changes the value in ways that have no derivative.
    pub(crate) fn undifferentiated_texture(&self) -> Option<Property> {
        match self {
            Self::Textured(b) => {
                let mut properties = b.textures.iter().map(|(p, _)| *p);
                properties.find(|p| self.undifferentiated(*p).is_some())
            }
            _ => self.inner().find_map(Self::undifferentiated_texture),
        }
    }

    /// True where textures jump on a mesh, or frames that follow texture coordinates.
    pub(crate) fn is_discontinuous_on(&self, mesh: &Mesh) -> bool {
        match self {
            Self::Textured(b) if b.textures.iter().any(|(_, t)| !t.is_continuous_on(mesh)) => true,
            Self::Anisotropic(_)
            | Self::Principled(_)
            | Self::PrincipledThin(_)
            | Self::Ward(_)
            | Self::Measured(_) => self.is_oriented() && frames_jump_on(mesh),
            _ => self.inner().any(|b| b.is_discontinuous_on(mesh)),
        }
    }
}
