//! Properties for which textures may stand that vary over surfaces.

use drt_estimators::texture::Texture;
use drt_math::Rgb;

use super::element::Element;
use super::properties::Properties;
use super::textures;
use crate::CliError;

impl<'a> Properties<'a> {
    /// A finite number.
    ///
    /// A texture that varies gives its mean and is kept.
    pub(super) fn float(&self, name: &'static str) -> Result<Option<f64>, CliError> {
        if let Some((e, texture)) = self.texture(name)? {
            let texture = textures::luminance(texture).map_err(|reason| e.error(reason))?;
            return Ok(Some(self.keep(name, texture).r));
        }
        self.number(name)
    }

    /// A colour of something that reflects, refracts or absorbs.
    ///
    /// A texture that varies gives its mean and is kept.
    pub(super) fn color(&self, name: &'static str) -> Result<Option<Rgb>, CliError> {
        if let Some((_, texture)) = self.texture(name)? {
            return Ok(Some(self.keep(name, texture)));
        }
        self.uniform_color(name)
    }

    /// A texture that varies, with its element; whatever else has the name is not asked for.
    pub(super) fn texture(
        &self,
        name: &'static str,
    ) -> Result<Option<(&'a Element, Texture)>, CliError> {
        let Some(e) = self.varying(name) else { return Ok(None) };
        self.property(name);
        Ok(Some((e, textures::read(e)?)))
    }
}
