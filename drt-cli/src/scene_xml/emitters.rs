//! Emitters: area, point, spot, projector, directional, constant, envmap.

use std::sync::Arc;

use drt_estimators::emitter::{Emitter, EnvironmentMap, Slide};
use drt_estimators::texture::Texture;
use drt_estimators::{Named, SceneEmitter, Surrounding};
use drt_math::{Affine, Mat3, Rgb, Vec3};

use super::Loader;
use super::element::Element;
use super::properties::Properties;
use super::sensors::view;
use super::textures;
use crate::CliError;

const EMITTERS: &str = "area, point, spot, projector, directional, constant, envmap or volumelight";

impl<'a> Loader<'a> {
    /// One emitter; an area emitter only where it is `on_shape`.
    pub(super) fn emitter(
        &self,
        e: &'a Element,
        on_shape: bool,
    ) -> Result<Named<SceneEmitter>, CliError> {
        let p = Properties::of(e)?;
        let kind = p.kind()?;
        // How often lights are sampled does not change expected values.
        p.accept(&["sampling_weight"]);
        if on_shape != (kind == "area") {
            return Err(e.error(if on_shape {
                "a shape can only carry an emitter of type `area`"
            } else {
                "an `area` emitter belongs inside a <shape>"
            }));
        }
        let mut medium = Surrounding::Counted;
        let light = |name| Ok::<Rgb, CliError>(p.light(name)?.unwrap_or(Rgb::ONE));
        let emitter = match kind {
            "area" => match p.texture("radiance")? {
                Some((e, texture)) => {
                    by_coordinates(e, &texture)?;
                    Emitter::TexturedArea { radiance: Rgb::ONE, texture }
                }
                None => Emitter::Area { radiance: light("radiance")? },
            },
            "constant" => Emitter::Constant { radiance: light("radiance")? },
            "envmap" => envmap(&p)?,
            "point" => {
                medium = self.surrounding(&p)?;
                Emitter::Point { position: position(&p)?, intensity: light("intensity")? }
            }
            "spot" => {
                medium = self.surrounding(&p)?;
                let intensity = light("intensity")?;
                spot(&p, intensity)?
            }
            "projector" => projector(&p)?,
            "sun" | "sky" | "sunsky" | "timed_sunsky" => {
                return Err(e.error(format!(
                    "the emitter type `{kind}` is not supported: the model of its sky is a table of spectra that is \
                     not part of this program; render the sky to an image with Mitsuba and use it as an envmap; \
                     otherwise expected {EMITTERS}"
                )));
            }
            "directional" => {
                Emitter::Directional { direction: direction(&p)?, irradiance: light("irradiance")? }
            }
            other => {
                return Err(e.error(format!(
                    "the emitter type `{other}` is not supported; expected {EMITTERS}"
                )));
            }
        };
        p.finish()?;
        let emitter =
            emitter.validate().and_then(|()| emitter.checked()).map_err(|err| e.error(err))?;
        Ok(Named { id: e.id().map(Into::into), item: SceneEmitter { emitter, medium } })
    }
}

/// The image of a file, turned by `to_world`.
fn envmap(p: &Properties<'_>) -> Result<Emitter, CliError> {
    let e = p.element;
    let path = p.path("filename")?.ok_or_else(|| e.error("`filename` is missing"))?;
    let radiance = Rgb::splat(p.float("scale")?.unwrap_or(1.0));
    let to_world = p.transform("to_world")?.unwrap_or(Affine::IDENTITY).linear;
    // How directions are drawn.
    p.accept(&["mis_compensation"]);
    let fail = |reason: String| e.error(format!("{}: {reason}", path.display()));
    let (size, texels) = textures::pixels(&path, false).map_err(fail)?;
    let map = EnvironmentMap::new(size, texels, to_world).map_err(fail)?;
    Ok(Emitter::Envmap { radiance, map: Arc::new(map) })
}

/// `position`, or the image of the origin under `to_world`.
fn position(p: &Properties<'_>) -> Result<Vec3, CliError> {
    match (p.vector("position")?, p.transform("to_world")?) {
        (Some(_), Some(_)) => Err(p.element.error("give `position` or `to_world`, not both")),
        (Some(position), None) => Ok(position),
        (None, to_world) => Ok(to_world.map_or(Vec3::ZERO, |m| m.translation)),
    }
}

/// `direction`, or the image of +z under `to_world`.
fn direction(p: &Properties<'_>) -> Result<Vec3, CliError> {
    match (p.vector("direction")?, p.transform("to_world")?) {
        (Some(_), Some(_)) => Err(p.element.error("give `direction` or `to_world`, not both")),
        (Some(direction), None) => Ok(direction),
        (None, to_world) => Ok(to_world.map_or(Vec3::Z, |m| m.vector(Vec3::Z))),
    }
}

/// Sits at the origin of `to_world` and shines along its +z axis; angles are in degrees.
fn spot(p: &Properties<'_>, intensity: Rgb) -> Result<Emitter, CliError> {
    let to_world = p.transform("to_world")?.unwrap_or(Affine::IDENTITY);
    let radians = |name| Ok::<_, CliError>(p.float(name)?.map(f64::to_radians));
    let cutoff_angle = radians("cutoff_angle")?.unwrap_or(Emitter::DEFAULT_CUTOFF_ANGLE);
    let beam_width =
        radians("beam_width")?.unwrap_or(Emitter::DEFAULT_BEAM_FRACTION * cutoff_angle);
    if let Some(texture) = p.texture("texture")? {
        let (e, texture) = texture;
        by_coordinates(e, &texture)?;
        let slide = Slide::spot(texture, cutoff_angle, beam_width).map_err(|err| e.error(err))?;
        return thrown(p, &to_world, intensity, slide);
    }
    // One that does not vary.
    let intensity = intensity * p.color("texture")?.unwrap_or(Rgb::ONE);
    Ok(Emitter::Spot {
        position: to_world.translation,
        direction: to_world.vector(Vec3::Z),
        intensity,
        cutoff_angle,
        beam_width,
    })
}

/// A picture thrown from the origin of `to_world` along its +z axis.
fn thrown(
    p: &Properties<'_>,
    to_world: &Affine,
    strength: Rgb,
    slide: Slide,
) -> Result<Emitter, CliError> {
    let frame = to_world.linear;
    let gram = frame.transpose() * frame + Mat3::IDENTITY * -1.0;
    if gram.cols.iter().any(|c| c.max_abs() > 1e-3 || !c.is_finite()) {
        let message = "its `to_world` may turn, mirror and move it, not scale or shear it";
        return Err(p.element.error(message));
    }
    let (position, slide) = (to_world.translation, Arc::new(slide));
    Ok(Emitter::Projector { position, frame, strength, slide })
}

/// Refuses a texture that has no texture coordinates.
fn by_coordinates(e: &Element, texture: &Texture) -> Result<(), CliError> {
    match texture {
        Texture::Attribute(_) | Texture::Volume(_) => {
            Err(e.error("attributes of meshes and volumes are for BSDFs"))
        }
        Texture::Bitmap(_) | Texture::Checkerboard { .. } => Ok(()),
    }
}

/// A `projector`: the reverse of a camera, whose film is the image of its texture.
fn projector(p: &Properties<'_>) -> Result<Emitter, CliError> {
    let scale = p.float("scale")?.unwrap_or(1.0);
    let (texture, strength) = match p.texture("irradiance")? {
        Some((e, texture)) => {
            by_coordinates(e, &texture)?;
            (Some(texture), Rgb::ONE)
        }
        None => (None, p.light("irradiance")?.unwrap_or(Rgb::ONE)),
    };
    let size = match &texture {
        Some(Texture::Bitmap(image)) => image.size(),
        _ => [1, 1],
    };
    let lens = view(p)?;
    let pixel = lens.pixel_size(size.map(f64::from)).map_err(|err| p.element.error(err))?;
    let half = size.map(|n| 0.5 * pixel * f64::from(n));
    let slide = Slide::projector(texture, half).map_err(|err| p.element.error(err))?;
    let to_world = p.transform("to_world")?.unwrap_or(Affine::IDENTITY);
    thrown(p, &to_world, strength * scale, slide)
}
