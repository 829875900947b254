//! What kind of BSDF one is: what transport asks before it samples one.

use alloc::vec::Vec;

use drt_geom::Mesh;

use crate::model::surface::bsdf::each;
use crate::model::surface::model::{Dependence, Flags, Model};
use crate::model::surface::shading_frame::frame_seams;
use crate::model::surface::{Bsdf, Property};
use crate::model::texture::SurfaceLine;

impl Bsdf {
    /// What a model states of itself.
    #[inline(always)]
    pub(in crate::model::surface) fn flags(&self) -> Flags {
        each!(self, b => b.flags())
    }

    #[inline(always)]
    fn dependence(&self) -> Dependence {
        each!(self, b => b.dependence())
    }

    /// True for the border of a medium that light crosses unchanged.
    #[inline]
    #[must_use]
    pub fn is_null(&self) -> bool {
        matches!(self, Self::Null)
    }

    /// True of a model that is the same everywhere and in all directions about its normal.
    #[inline]
    pub(crate) fn is_plain(&self) -> bool {
        self.dependence() == Dependence::Normal
    }

    /// True when nothing is scattered, as of now: a null interface, or no reflectance on any side.
    #[inline]
    #[must_use]
    pub(crate) fn is_black(&self) -> bool {
        self.flags().black
    }

    /// True when nothing is scattered where both directions are on the back of the surface.
    pub(crate) fn is_black_from_behind(&self) -> bool {
        self.flags().black_from_behind
    }

    /// True when light is scattered through the surface, to the other side; not for [`Bsdf::Null`],
    /// which scatters nothing.
    #[inline]
    #[must_use]
    pub fn is_transmissive(&self) -> bool {
        self.flags().transmissive
    }

    /// True where light is scattered into single directions.
    #[must_use]
    pub fn is_smooth(&self) -> bool {
        self.flags().smooth
    }

    /// True where the index of refraction, of which there are derivatives, turns light that goes on in a single direction.
    pub(crate) fn bends(&self) -> bool {
        self.flags().bends && self.differentiated().contains(Property::Eta)
    }

    /// True where light is scattered into single directions, and other light into all directions of a solid angle.
    pub(crate) fn is_partly_smooth(&self) -> bool {
        let flags = self.flags();
        flags.smooth && flags.spread
    }

    /// True where some light goes straight on, as through nothing.
    #[inline]
    pub(crate) fn passes_straight(&self) -> bool {
        self.flags().straight
    }

    /// True where the value may depend on the place of its point.
    #[inline]
    pub(crate) fn varies(&self) -> bool {
        self.dependence() == Dependence::Point
    }

    /// True where directions along the surface are told apart, by its texture coordinates.
    pub(crate) fn is_oriented(&self) -> bool {
        self.flags().oriented
    }

    /// The name of the first BSDF in this one that nothing which moves is differentiated at: it jumps where no term samples it, or a map
    /// bends what it reflects into single directions.
    pub(crate) fn undifferentiable(&self) -> Option<&'static str> {
        let lost = !self.flags().differentiable;
        lost.then(|| self.parts().find_map(Self::undifferentiable).unwrap_or(self.name()))
    }

    /// The first property whose texture changes the value, as a point slides over it, in ways that have no derivative.
    pub(crate) fn undifferentiated_texture(&self) -> Option<Property> {
        match self {
            Self::Textured(b) => {
                // An opacity of 0 or 1 is that of a region, in which it does not change.
                let sloping =
                    b.textures.iter().filter(|(p, t)| *p != Property::Opacity && t.has_slopes());
                let mut properties = sloping.map(|(p, _)| *p);
                properties.find(|p| self.undifferentiated(*p).is_some())
            }
            _ => self.parts().find_map(Self::undifferentiated_texture),
        }
    }

    /// The lines on a mesh along which textures jump, or frames that follow texture coordinates; `None` where its value may jump elsewhere.
    pub(crate) fn lines_on(&self, mesh: &Mesh) -> Option<Vec<SurfaceLine>> {
        match self.dependence() {
            Dependence::Normal => Some(Vec::new()),
            Dependence::Frame if self.is_oriented() => Some(frame_seams(mesh).collect()),
            Dependence::Frame => Some(Vec::new()),
            Dependence::Point => {
                let mut lines = each!(self, b => b.lines_on(mesh))?;
                for part in self.parts() {
                    lines.extend(part.lines_on(mesh)?);
                }
                Some(lines)
            }
        }
    }
}
