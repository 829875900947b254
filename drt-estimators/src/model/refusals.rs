//! Derivatives that are refused: where something moves, and light jumps or turns in ways that no term here samples.

use alloc::vec::Vec;

use drt_geom::Mesh;

use crate::model::emitter::Emitter;
use crate::model::error::{ElementError, Error};
use crate::model::scene::{Scene, Shape, Target, unusable};
use crate::model::surface::Bsdf;
use crate::model::texture::SurfaceLine;

/// How vertices of paths slide over surfaces as something moves.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Sliding {
    /// They are points of matter.
    Nowhere,
    /// Over functions of their place, such as textures, that are continuous.
    Continuously,
    /// Also across lines on surfaces along which such functions jump.
    AcrossLines,
}

impl Bsdf {
    /// Why nothing that moves can be differentiated where light meets this on a mesh.
    fn refuses_motion(&self, mesh: &Mesh, parameter: &str) -> Option<ElementError> {
        let parameter = || parameter.into();
        if let Some(bsdf) = self.undifferentiable() {
            return Some(ElementError::NoDerivatives { bsdf, parameter: parameter() });
        }
        let lost = self.is_oriented() && mesh.texcoords.is_none();
        lost.then(|| ElementError::NoCoordinates { parameter: parameter() })
    }
}

impl Scene {
    /// Refuses derivatives with respect to `parameter` where `moves`, as something moves, and light meets surfaces at which it
    /// jumps as no term here samples, and where vertices slide over textures that jump.
    pub(crate) fn refuse_derivatives(
        &self,
        parameter: &str,
        moves: bool,
        sliding: Sliding,
    ) -> Result<(), Error> {
        for (i, s) in self.shapes.iter().enumerate() {
            let bsdf = &self.bsdfs[s.bsdf].item;
            if moves && let Some(reason) = bsdf.refuses_motion(&s.mesh, parameter) {
                return Err(unusable(&s.id, "shape", i, reason));
            }
            if sliding != Sliding::Nowhere
                && let Some(property) = bsdf.undifferentiated_texture()
            {
                let parameter = parameter.into();
                let reason = ElementError::UndifferentiatedTexture { property, parameter };
                return Err(unusable(&s.id, "shape", i, reason));
            }
            let lines = || Some(!self.lines_on(i)?.is_empty());
            let refused = match sliding {
                Sliding::Nowhere => false,
                Sliding::Continuously => lines() != Some(false),
                // Where normals are interpolated, what lies behind the plane of a facet counts less.
                Sliding::AcrossLines if bsdf.is_smooth() && s.mesh.normals.is_some() => {
                    lines() != Some(false)
                }
                Sliding::AcrossLines => lines().is_none(),
            };
            if refused {
                let reason = ElementError::DiscontinuousTexture { parameter: parameter.into() };
                return Err(unusable(&s.id, "shape", i, reason));
            }
        }
        if moves {
            self.refuse_smooth_emitters(parameter)?;
        }
        Ok(())
    }

    /// The lines on a shape along which what it scatters or emits jumps with its textures; `None` where it may jump elsewhere.
    pub(crate) fn lines_on(&self, shape: usize) -> Option<Vec<SurfaceLine>> {
        let shape = &self.shapes[shape];
        let mut lines = self.bsdfs[shape.bsdf].item.lines_on(&shape.mesh)?;
        if let Some(e) = shape.emitter
            && let Emitter::TexturedArea { texture, .. } = &self.emitters[e].item.emitter
        {
            lines.extend(texture.lines_on(&shape.mesh)?);
        }
        Some(lines)
    }

    /// Refuses derivatives of the light that a smooth surface emits by what moves: what the surface reflects moves otherwise.
    fn refuse_smooth_emitters(&self, parameter: &str) -> Result<(), Error> {
        let emits = |s: &Shape| s.emitter.is_some() && self.bsdfs[s.bsdf].item.is_smooth();
        let Some(i) = self.shapes.iter().position(emits) else { return Ok(()) };
        let reason = ElementError::SmoothEmitter { parameter: parameter.into() };
        Err(unusable(&self.shapes[i].id, "shape", i, reason))
    }

    /// Refuses derivatives by what moves of the light of points and directions that is seen past smooth surfaces, or by a camera that
    /// does not see other emitters, for an estimator that does not know how its shadows move there.
    pub(crate) fn refuse_delta_lights(&self, parameter: &str) -> Result<(), Error> {
        let lamp = self.emitters.iter().position(|e| e.item.emitter.is_delta());
        let Some(e) = lamp else { return Ok(()) };
        let parameter = parameter.into();
        if let Some(smooth) = self.first_smooth() {
            let surface = self.name_of(Target::Shape(smooth));
            let reason = ElementError::DeltaLightPastSmooth { parameter, surface };
            return Err(unusable(&self.emitters[e].id, "emitter", e, reason));
        }
        if self.hides_something() {
            let reason = ElementError::HiddenEmitters { parameter };
            return Err(unusable(&self.emitters[e].id, "emitter", e, reason));
        }
        Ok(())
    }

    /// The first shape of a smooth surface.
    pub(crate) fn first_smooth(&self) -> Option<usize> {
        self.shapes.iter().position(|s| self.bsdfs[s.bsdf].item.is_smooth())
    }

    /// Refuses derivatives with respect to `parameter`, which moves matter or lights, where light jumps.
    pub(crate) fn refuse_rims(&self, parameter: &str) -> Result<(), Error> {
        let Some(i) = self.emitters.iter().position(|e| !e.item.emitter.is_continuous()) else {
            return Ok(());
        };
        let reason = ElementError::Rim { parameter: parameter.into() };
        Err(unusable(&self.emitters[i].id, "emitter", i, reason))
    }
}

#[cfg(test)]
mod tests {
    use alloc::string::ToString;

    use drt_math::{Rgb, Vec3};

    use super::*;
    use crate::model::filter::{Filter, FilterKind};
    use crate::model::scene::tests::scene;
    use crate::model::scene::{Named, SceneSensor, Surrounding};
    use crate::model::sensor::{Lens, Sensor};
    use crate::model::settings::EstimatorKind;
    use crate::model::surface::{
        Blend, Conductor, Dielectric, Perturbation, Perturbed, Property, Textured,
    };
    use crate::model::texture::Texture;

    fn blended(bsdf: Bsdf) -> Bsdf {
        let bsdfs = [Bsdf::Diffuse(Default::default()), bsdf];
        Bsdf::Blend(alloc::boxed::Box::new(Blend { bsdfs, weight: 0.5 }))
    }

    #[test]
    fn smooth_and_textured_surfaces_refuse_derivatives_by_name() {
        let mut scene = scene();
        assert!(scene.refuse_derivatives("spin", true, Sliding::Continuously).is_ok());
        scene.bsdfs.push(Named::new("glass", Bsdf::Dielectric(Dielectric::default())));
        // One that no shape has does no harm.
        assert!(scene.refuse_derivatives("spin", true, Sliding::Continuously).is_ok());
        let shape = scene.shapes.len() - 1;
        scene.shapes[shape].bsdf = scene.bsdfs.len() - 1;
        let name = scene.name_of(Target::Shape(shape));
        let spin = drt_motion::GeometryChange::Rotate { axis: Vec3::Y, pivot: Vec3::ZERO };
        let change = drt_motion::Change::Geometry(spin);
        let effects = alloc::vec![drt_motion::Effect { target: name.clone(), change }];
        let parameters = [drt_motion::Parameter { name: "spin".into(), value: 0.0, effects }];
        let filter = Filter::new(FilterKind::BOX).expect("a filter");
        let at = [Vec3::Z * 5.0, Vec3::ZERO, Vec3::Y];
        let sensor = Sensor::look_at(at, Lens::default(), [2, 2], filter).expect("a camera");
        let item = SceneSensor { sensor, medium: Surrounding::Counted, sample_count: None };
        scene.sensors.push(Named::new("camera", item));
        assert!(crate::Session::new(&scene, &parameters, &crate::Settings::default()).is_ok());
        scene.bsdfs.push(Named::new("veil", Bsdf::Null));
        let message = crate::Session::new(&scene, &parameters, &crate::Settings::default());
        scene.bsdfs.pop();
        let message = message.err().expect("a refusal").to_string();
        assert!(message.contains(&name) && message.contains("bulb"), "{message}");
        assert!(message.contains("`spin` moves something"), "{message}");
        // Where vertices slide over surfaces, textures must not jump; their values may change.
        scene.shapes[shape].bsdf = 0;
        assert!(scene.refuse_derivatives("spin", true, Sliding::Continuously).is_ok());
        let texture = Texture::Checkerboard {
            colours: [Rgb::splat(0.2), Rgb::splat(0.8)],
            to_uv: crate::texture::UvMap::IDENTITY,
        };
        let bsdf = scene.bsdfs[0].item.clone();
        let textured = Textured::new(bsdf, alloc::vec![(Property::Reflectance, texture)]);
        scene.bsdfs[0].item = Bsdf::Textured(alloc::boxed::Box::new(textured.expect("a texture")));
        assert!(scene.refuse_derivatives("spin", true, Sliding::Nowhere).is_ok());
        let message =
            scene.refuse_derivatives("spin", true, Sliding::Continuously).unwrap_err().to_string();
        assert!(message.contains(&name) && message.contains("discontinuous texture"), "{message}");
        let op = drt_motion::ValueChange::Add(Rgb::ONE);
        let change = drt_motion::PropertyChange {
            property: "reflectance".into(),
            op,
            voxels: None,
            texels: None,
        };
        let change = drt_motion::Change::Property(change);
        let effects = alloc::vec![drt_motion::Effect { target: "grey".into(), change }];
        let bleach = [drt_motion::Parameter { name: "bleach".into(), value: 0.0, effects }];
        assert!(crate::Session::new(&scene, &bleach, &crate::Settings::default()).is_ok());
        // BSDFs that nothing is differentiated at, in any estimator.
        let map = crate::texture::Bitmap::new([1, 1], alloc::vec![[0.5, 0.5, 1.0]]).expect("a map");
        let perturbed = |bsdf, perturbation| {
            let map = Texture::Bitmap(map.clone());
            let (flip_invalid_normals, use_shadowing_function) = (true, true);
            let bent =
                Perturbed { bsdf, map, perturbation, flip_invalid_normals, use_shadowing_function };
            Bsdf::Perturbed(alloc::boxed::Box::new(bent))
        };
        let mirror = || Bsdf::Conductor(Conductor::default());
        let twice = perturbed(Bsdf::Diffuse(Default::default()), Perturbation::Heights(1.0));
        for bsdf in [
            perturbed(mirror(), Perturbation::Normals),
            perturbed(mirror(), Perturbation::Heights(1.0)),
            perturbed(twice, Perturbation::Normals),
        ] {
            let kind = bsdf.name();
            // Also inside of others.
            for bsdf in [bsdf.clone(), blended(bsdf)] {
                if bsdf.validate().is_err() {
                    continue;
                }
                scene.bsdfs[0].item = bsdf;
                for estimator in
                    [EstimatorKind::PathSpace, EstimatorKind::Radiative, EstimatorKind::Warped]
                {
                    let settings = crate::Settings { estimator, ..Default::default() };
                    let message = crate::Session::new(&scene, &parameters, &settings);
                    let message = message.err().expect("a refusal").to_string();
                    let wanted = ["`spin`", kind, "by finite differences", name.as_str()];
                    assert!(wanted.iter().all(|part| message.contains(part)), "{message}");
                }
            }
        }
        // The image is nobody's derivative.
        assert!(crate::Session::new(&scene, &[], &crate::Settings::default()).is_ok());
    }
}
