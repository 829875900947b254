//! BSDFs made of others.

use drt_estimators::surface::{Blend, Bsdf, Mask, Perturbation, Perturbed};
use drt_estimators::texture::{Bitmap, Texture};
use drt_math::Rgb;

use super::super::Loader;
use super::super::parts::Parts;
use super::super::properties::{Properties, varies};
use super::super::{spectrum, textures};
use crate::CliError;

impl<'a> Loader<'a> {
    pub(super) fn mask(&self, p: &Properties<'a>, parts: &Parts) -> Result<Mask, CliError> {
        let opacity = fraction(p, "opacity")?.unwrap_or(0.5);
        Ok(Mask { bsdf: self.only(p, parts)?, opacity })
    }

    pub(super) fn blend(&self, p: &Properties<'a>, parts: &Parts) -> Result<Blend, CliError> {
        let weight = fraction(p, "weight")?.unwrap_or(0.5);
        match &self.index.inner(p, "bsdf", None)[..] {
            [a, b] => {
                let bsdfs = [self.part(a.target, parts)?, self.part(b.target, parts)?];
                Ok(Blend { bsdfs, weight })
            }
            other => {
                let message = format!("expected two bsdfs inside, found {}", other.len());
                Err(p.element.error(message))
            }
        }
    }

    pub(super) fn normal_map(
        &self,
        p: &Properties<'a>,
        parts: &Parts,
    ) -> Result<Perturbed, CliError> {
        let normal = p.color("normalmap")?;
        let normal = normal.ok_or_else(|| p.element.error("`normalmap` is missing"))?;
        let map = match p.take_texture("normalmap") {
            Some(Texture::Volume(_)) => {
                return Err(p.element.error("a `normalmap` of a volume is not supported"));
            }
            Some(map) => map,
            None => {
                let texel = normal.to_array().map(|c| c as f32);
                let same = Bitmap::new([1, 1], vec![texel]).map_err(|err| p.element.error(err))?;
                Texture::Bitmap(same)
            }
        };
        self.perturbed(p, parts, map, Perturbation::Normals)
    }

    pub(super) fn bump_map(
        &self,
        p: &Properties<'a>,
        parts: &Parts,
    ) -> Result<Perturbed, CliError> {
        // It may have any name.
        let maps = p.children(|e| e.tag == "texture");
        let [map] = maps[..] else {
            let message = format!("expected one texture inside, found {}", maps.len());
            return Err(p.element.error(message));
        };
        if !varies(map) || matches!(map.attribute("type"), Some("mesh_attribute" | "volume")) {
            return Err(
                map.error("bumps need an image, or what else varies by texture coordinates")
            );
        }
        let heights = textures::luminance(textures::read(map)?).map_err(|err| map.error(err))?;
        let scale = p.float("scale")?.unwrap_or(1.0);
        self.perturbed(p, parts, heights, Perturbation::Heights(scale))
    }

    fn perturbed(
        &self,
        p: &Properties<'a>,
        parts: &Parts,
        map: Texture,
        perturbation: Perturbation,
    ) -> Result<Perturbed, CliError> {
        Ok(Perturbed {
            bsdf: self.only(p, parts)?,
            map,
            perturbation,
            flip_invalid_normals: p.boolean("flip_invalid_normals")?.unwrap_or(true),
            use_shadowing_function: p.boolean("use_shadowing_function")?.unwrap_or(true),
        })
    }

    /// The one BSDF inside.
    pub(super) fn only(&self, p: &Properties<'a>, parts: &Parts) -> Result<Bsdf, CliError> {
        let inner = self.index.single(p, "bsdf", None)?;
        let inner = inner.ok_or_else(|| p.element.error("expected a bsdf inside"))?;
        self.part(inner.target, parts)
    }
}

/// A number, or the luminance of a colour.
fn fraction(p: &Properties<'_>, name: &'static str) -> Result<Option<f64>, CliError> {
    let named = |e: &&_| p.is_property(e, name);
    match p.element.children.iter().find(named) {
        Some(e) if !varies(e) && !["float", "integer"].contains(&e.tag.as_str()) => {
            p.property(name);
            let colour: Rgb = spectrum::reflected(e)?;
            Ok(Some(textures::grey(colour.to_array())))
        }
        _ => p.float(name),
    }
}
