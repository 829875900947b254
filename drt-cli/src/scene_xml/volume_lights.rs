//! Light of media, as a `volumelight` on the shape around them says.
//!
//! That is proposed for Mitsuba 3 (its pull request 678) and in none of its releases: `radiance` is what a medium sends out per length,
//! whether it absorbs or not. Here a medium of the absorption `sigma_a` sends out `sigma_a Le`, so `Le` is the one over the other.

use std::collections::HashSet;

use drt_estimators::Named;
use drt_math::Rgb;
use drt_medium::{Homogeneous, Medium, MediumKind, UniformMedium, Volume};

use super::Loader;
use super::element::Element;
use super::properties::Properties;
use super::volumes::{self, Values};
use crate::CliError;

/// True for what is a medium's light, and no emitter of the scene.
pub(super) fn is_one(e: &Element) -> bool {
    e.tag == "emitter" && e.attribute("type") == Some("volumelight")
}

impl<'a> Loader<'a> {
    /// The emitters of the scene in order, without the light of media.
    pub(super) fn emitters(&self) -> impl Iterator<Item = &'a Element> {
        self.index.all("emitter").iter().copied().filter(|e| !is_one(e))
    }

    /// Lets the media inside of shapes with a `volumelight` glow. `carried` are the emitters on shapes.
    pub(super) fn light_media(
        &self,
        shapes: &[&'a Element],
        carried: &HashSet<usize>,
        media: &mut [Named<Medium>],
    ) -> Result<(), CliError> {
        let mut lights = self.index.all("emitter").iter().filter(|e| is_one(e));
        if let Some(light) = lights.find(|e| !carried.contains(&e.ordinal)) {
            return Err(light.error("a `volumelight` belongs inside a <shape>"));
        }
        for shape in shapes {
            let p = Properties::of(shape)?;
            let Some(light) = self.index.single(&p, "emitter", None)?.filter(|l| is_one(l.target))
            else {
                continue;
            };
            let inside = self.index.single(&p, "medium", Some("interior"))?;
            let Some(number) = inside.and_then(|medium| self.index.position(medium.target)) else {
                return Err(light
                    .target
                    .error("the shape around it has no medium called `interior`"));
            };
            self.glow(light.target, &mut media[number].item)?;
        }
        Ok(())
    }

    fn glow(&self, light: &'a Element, medium: &mut Medium) -> Result<(), CliError> {
        let p = Properties::of(light)?;
        p.kind()?;
        let radiance = match self.index.single(&p, "volume", Some("radiance"))? {
            Some(volume) => volumes::read(volume.target, Values::NotNegative)?.volume,
            None => Volume::Constant(p.light("radiance")?.unwrap_or(Rgb::ZERO)),
        };
        p.finish()?;
        emit(light, &radiance, medium)
    }
}

fn emit(light: &Element, radiance: &Volume, medium: &mut Medium) -> Result<(), CliError> {
    let MediumKind::Homogeneous(h) = &medium.kind else {
        return Err(light.error(
            "a volumelight in a medium with grids is not supported; give the medium an `emission`",
        ));
    };
    if medium.phase.sggx().is_some() {
        return Err(light.error(
            "a volumelight in a medium of microflakes is not supported; they emit by how much of them a direction sees",
        ));
    }
    let c = h.coefficients();
    let brightest = match radiance {
        Volume::Constant(radiance) => *radiance,
        Volume::Grid(grid) => grid.largest(),
    };
    let dark = |(source, absorbed): (f64, f64)| source > 0.0 && absorbed <= 0.0;
    if brightest.to_array().into_iter().zip(c.sigma_a().to_array()).any(dark) {
        return Err(light.error(
            "a volumelight in a medium that does not absorb, in any of its three colours, is not supported",
        ));
    }
    let per_source = Rgb::ONE.div_or_zero(c.sigma_a());
    let kind = match radiance {
        Volume::Constant(radiance) => {
            Homogeneous::new(c.sigma_t, c.albedo, *radiance * per_source).map(MediumKind::from)
        }
        Volume::Grid(grid) => {
            let (albedo, emission) = (Volume::Constant(c.albedo), grid.scaled(per_source));
            UniformMedium::new(c.sigma_t, albedo, Volume::Grid(emission)).map(MediumKind::from)
        }
    };
    medium.kind = kind.map_err(|err| light.error(err))?;
    Ok(())
}
