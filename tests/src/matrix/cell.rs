//! What is compared, and with how many samples.

use drt_estimators::{InteriorMotion, Named, Scene, SceneEmitter};
use drt_motion::{Effect, Parameter};

use super::deforming::sky;
use super::set::emitting;

/// One derivative that is compared with finite differences.
#[derive(Clone, Debug)]
pub struct Cell {
    /// The parameter.
    pub parameter: Parameter,
    /// Half step of the finite difference; half of it is compared, and the difference between both
    /// stands for its error.
    pub step: f64,
    /// Samples per pixel of each image that a finite difference takes.
    pub samples: u32,
    /// True for the cells of the short check.
    pub representative: bool,
    /// True where its largest term must not pass 3 % too large.
    pub precise: bool,
}

impl Cell {
    /// A parameter of value 0 with a half step of 0.06.
    #[must_use]
    pub fn new(name: &str, effects: impl IntoIterator<Item = Effect>) -> Self {
        let effects = effects.into_iter().collect();
        let parameter = Parameter { name: name.into(), value: 0.0, effects };
        Self { parameter, step: 0.06, samples: 2048, representative: false, precise: false }
    }

    /// The same at another value of the parameter.
    #[must_use]
    pub fn at(mut self, value: f64) -> Self {
        self.parameter.value = value;
        self
    }

    /// The same with another half step.
    #[must_use]
    pub fn step(self, step: f64) -> Self {
        Self { step, ..self }
    }

    /// The same with other samples per pixel for finite differences.
    #[must_use]
    pub fn samples(self, samples: u32) -> Self {
        Self { samples, ..self }
    }

    /// The same as a part of the short check.
    #[must_use]
    pub fn representative(self) -> Self {
        Self { representative: true, ..self }
    }

    /// The same, which must see its largest term multiplied by 1.03.
    #[must_use]
    pub fn precise(self) -> Self {
        Self { precise: true, ..self }
    }
}

/// A scene and what is differentiated in it.
#[derive(Clone, Debug)]
pub struct Stage {
    /// The name in tables.
    pub name: &'static str,
    /// The scene.
    pub scene: Scene,
    /// Samples per pixel of the derivatives.
    pub samples: u32,
    /// Boundary samples, per pixel on average.
    pub boundary_samples: u32,
    /// Media, by index, whose insides move otherwise than the plan would choose.
    pub insides: Vec<(usize, InteriorMotion)>,
    /// One per parameter.
    pub cells: Vec<Cell>,
}

impl Stage {
    /// A scene with its derivatives, of 2048 samples per pixel.
    #[must_use]
    pub fn new(name: &'static str, scene: Scene, cells: Vec<Cell>) -> Self {
        let (samples, boundary_samples) = (2048, 2048);
        Self { name, scene, samples, boundary_samples, insides: Vec::new(), cells }
    }

    /// The same with the cells of the short check only.
    #[must_use]
    pub fn short(mut self) -> Self {
        self.cells.retain(|c| c.representative);
        self
    }

    /// The cells that one run can differentiate together: a parameter that is not at rest changes the scene for all of its run.
    pub fn runs(&self) -> impl Iterator<Item = &[Cell]> {
        let at_rest = |c: &Cell| c.parameter.value == 0.0;
        self.cells.chunk_by(move |a, b| at_rest(a) && at_rest(b))
    }

    /// The same with nothing but what the 2019 theory covers: without lights that shine from points and
    /// directions, and without what changes these; under a sky where nothing else shines.
    #[must_use]
    pub fn in_extended_light(mut self) -> Self {
        let is_delta = |e: &Named<SceneEmitter>| e.item.emitter.is_delta();
        let Scene { emitters, shapes, media, .. } = &mut self.scene;
        for shape in shapes {
            // They are named by their numbers.
            let before = |e: usize| emitters[..e].iter().filter(|e| is_delta(e)).count();
            shape.emitter = shape.emitter.map(|e| e - before(e));
        }
        let delta: Vec<Option<String>> =
            emitters.extract_if(.., |e| is_delta(e)).map(|e| e.id).collect();
        if emitters.is_empty() && !media.iter().any(|m| m.item.is_emissive()) {
            emitters.push(Named::new("sky", emitting(sky())));
        }
        let of_delta = |e: &Effect| delta.iter().flatten().any(|id| *id == e.target);
        self.cells.retain(|c| !c.parameter.effects.iter().any(of_delta));
        self
    }
}

#[cfg(test)]
mod tests {
    use drt_estimators::emitter::Emitter;

    use super::super::{Stage, deforming, lights, surfaces};
    use crate::Result;

    #[test]
    fn extended_light_is_all_that_is_left() -> Result<()> {
        for stage in
            [surfaces::room()?, lights::spot()?, lights::point_and_sun()?, deforming::pulse()?]
        {
            let lamps = |stage: &Stage| {
                let shapes = stage.scene.shapes.iter().filter_map(|s| s.emitter);
                let radiance = shapes.map(|e| stage.scene.emitters[e].item.emitter.clone());
                radiance.collect::<Vec<Emitter>>()
            };
            let (before, cells) = (lamps(&stage), stage.cells.len());
            let name = stage.name;
            let stage = stage.in_extended_light();
            let emitters = &stage.scene.emitters;
            assert!(!emitters.is_empty() && !emitters.iter().any(|e| e.item.emitter.is_delta()));
            // Lamps shine as before.
            assert_eq!(lamps(&stage), before, "{name}");
            let moved = ["spot", "point and sun"].contains(&name);
            assert!(!stage.cells.is_empty() && (stage.cells.len() < cells) == moved, "{name}");
        }
        Ok(())
    }
}
