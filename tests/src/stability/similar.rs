//! The same scene elsewhere and in other units.

use std::sync::Arc;

use drt_estimators::emitter::Emitter;
use drt_estimators::sensor::{Lens, Sensor};
use drt_math::{Affine, Mat3, Vec3, vec3};
use drt_medium::{GridMedium, Homogeneous, Medium, MediumKind, UniformMedium, Volume};
use drt_motion::{Change, Effect, GeometryChange, Parameter, ValueChange};

use super::{Case, Condition, Extent};
use crate::Result;
use crate::matrix::{Stage, lights, media, surfaces};

/// Every place x becomes `scale` x + `offset`.
#[derive(Clone, Copy, Debug)]
struct Similarity {
    scale: f64,
    offset: Vec3,
}

pub(super) fn conditions(extent: Extent) -> Result<Vec<Condition>> {
    let far = vec3(1e6, -0.7e6, 0.4e6);
    let mut places = vec![
        ("offset 1e6", Similarity { scale: 1.0, offset: far }),
        ("scale 1e-6", Similarity { scale: 1e-6, offset: Vec3::ZERO }),
        ("scale 1e6", Similarity { scale: 1e6, offset: Vec3::ZERO }),
    ];
    let mut stages = vec![
        surfaces::room()?,
        lights::point_and_sun()?,
        media::fog_box()?,
        media::smoke()?,
        media::glass()?,
    ];
    if extent == Extent::Full {
        places.push(("scale 1e-3, offset 1e3", Similarity { scale: 1e-3, offset: far * 1e-3 }));
        places.push(("scale 1e3, offset 1e6", Similarity { scale: 1e3, offset: far }));
        stages.extend([surfaces::knot()?, surfaces::gloss()?, lights::spot()?, media::blob()?]);
        stages.extend([media::layers()?, media::ember()?]);
    } else {
        stages = stages.into_iter().map(Stage::short).collect();
    }
    let mut all = Vec::new();
    for (place, similarity) in places {
        for stage in &stages {
            let parameters = stage.cells.iter().map(|c| c.parameter.clone());
            let parameters = parameters.filter(|p| p.value == 0.0).collect();
            let easy = Case { scene: stage.scene.clone(), parameters };
            let hard = similarity.of(&easy)?;
            all.push(Condition::new(format!("{}, {place}", stage.name), hard, easy).samples(128));
        }
    }
    Ok(all)
}

impl Similarity {
    fn map(&self) -> Affine {
        Affine { linear: Mat3::IDENTITY * self.scale, translation: self.offset }
    }

    /// The case elsewhere, with the same image and the same derivatives.
    fn of(&self, case: &Case) -> Result<Case> {
        let mut scene = case.scene.clone();
        for shape in &mut scene.shapes {
            shape.mesh = Arc::new(shape.mesh.transform(&self.map()));
        }
        for medium in &mut scene.media {
            medium.item = self.medium(&medium.item)?;
        }
        for emitter in &mut scene.emitters {
            self.emitter(&mut emitter.item.emitter);
        }
        for sensor in &mut scene.sensors {
            let old = &sensor.item.sensor;
            let mut to_world = old.to_world();
            to_world.translation = self.map().point(to_world.translation);
            let lens = *old.lens();
            let lens = Lens { near: lens.near * self.scale, far: lens.far * self.scale, ..lens };
            sensor.item.sensor =
                Sensor::from_to_world(&to_world, lens, old.film(), old.filter().clone())?;
        }
        let parameters = case.parameters.iter().map(|p| self.parameter(p)).collect();
        Ok(Case { scene, parameters })
    }

    fn medium(&self, medium: &Medium) -> Result<Medium> {
        let placed = |volume: &Volume| -> Result<Volume> {
            let mut volume = volume.clone();
            if let Volume::Grid(grid) = &mut volume {
                grid.place(&self.map())?;
            }
            Ok(volume)
        };
        let kind: MediumKind = match &medium.kind {
            MediumKind::Homogeneous(h) => {
                let mut c = h.coefficients();
                c.sigma_t *= 1.0 / self.scale;
                Homogeneous::try_from(c)?.into()
            }
            MediumKind::Uniform(u) => {
                let (albedo, emission) = (placed(u.albedo())?, placed(u.emission())?);
                UniformMedium::new(u.sigma_t() / self.scale, albedo, emission)?.into()
            }
            MediumKind::Grid(g) => {
                let mut density = g.density().clone();
                density.place(&self.map())?;
                let scale = g.scale() / self.scale;
                GridMedium::new(density, scale, placed(g.albedo())?, placed(g.emission())?)?.into()
            }
            MediumKind::Custom(_) | MediumKind::Deformed(_) => {
                return Err("no scene here has a medium of its own kind".into());
            }
        };
        let mut phase = medium.phase.clone();
        phase.place(&self.map())?;
        Ok(Medium::new(kind, phase))
    }

    fn emitter(&self, emitter: &mut Emitter) {
        match emitter {
            Emitter::Point { position, intensity } | Emitter::Spot { position, intensity, .. } => {
                *position = self.map().point(*position);
                *intensity *= self.scale * self.scale;
            }
            // The others have no position.
            _ => {}
        }
    }

    fn parameter(&self, parameter: &Parameter) -> Parameter {
        let effects = parameter.effects.iter().map(|e| self.effect(e)).collect();
        Parameter { effects, ..parameter.clone() }
    }

    fn effect(&self, effect: &Effect) -> Effect {
        let mut effect = effect.clone();
        match &mut effect.change {
            Change::Geometry(change) => self.motion(change),
            Change::Property(p) => {
                let per_unit = match p.property.as_str() {
                    "sigma_t" => 1.0 / self.scale,
                    "intensity" => self.scale * self.scale,
                    _ => 1.0,
                };
                if let ValueChange::Add(amount) = &mut p.op {
                    *amount *= per_unit;
                }
            }
            Change::Follow(_) => {}
        }
        effect
    }

    fn motion(&self, change: &mut GeometryChange) {
        let s = self.scale;
        match change {
            GeometryChange::Translate(v) | GeometryChange::Vertex { direction: v, .. } => {
                *v *= s;
            }
            GeometryChange::Rotate { pivot, .. } | GeometryChange::Scale { pivot, .. } => {
                *pivot = self.map().point(*pivot);
            }
            GeometryChange::Matrix(m) => {
                m.translation = m.translation * s - m.linear * self.offset;
            }
            GeometryChange::VertexVelocity(v) => *v = v.iter().map(|v| *v * s).collect(),
            other => unreachable!("no stage has the change {other:?}"),
        }
    }
}
