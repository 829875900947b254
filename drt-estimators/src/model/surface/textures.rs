use crate::model::surface::property::Property;
use crate::model::texture::Texture;

/// The textures that stand for values of a BSDF, each with the property that it replaces.
#[derive(Clone, Copy)]
pub(super) struct Textures<'a>(pub(super) &'a [(Property, Texture)]);

impl<'a> Textures<'a> {
    /// No value varies over the surface.
    pub(super) const NONE: Textures<'static> = Textures(&[]);

    /// The texture that stands for a property.
    pub(super) fn of(self, property: Property) -> Option<&'a Texture> {
        self.0.iter().find(|(p, _)| *p == property).map(|(_, texture)| texture)
    }

    /// True where textures tell directions along the surface apart.
    pub(super) fn orients(self) -> bool {
        let uneven = [Property::Anisotropic, Property::AlphaU, Property::AlphaV];
        uneven.into_iter().any(|p| self.of(p).is_some())
    }
}
