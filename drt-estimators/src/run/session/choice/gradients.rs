//! Which estimator finds the gradient of a loss with the least work.
//!
//! A gradient in reverse mode is with respect to all quantities of some items of a scene, thousands of derivatives that no pilot can
//! compare one by one. It compares a few of their combinations instead: [motions](probes) of these items that vary smoothly over a shape, as
//! the steps of a fit do, since fits smooth the gradients that they step by.

use alloc::format;
use alloc::string::String;
use alloc::vec::Vec;
use core::f64::consts::TAU;

use drt_geom::Mesh;
use drt_math::{Rng, Vec3, fm, vec3};
use drt_motion::{Change, Effect, GeometryChange, Parameter};

use crate::derivative::tangents;
use crate::derivative::tangents::Tangents;
use crate::model::error::Error;
use crate::model::scene::{Scene, Target};
use crate::model::settings::{EstimatorKind, PathSampling, Settings};
use crate::run::session::choice::estimator::estimator;
use crate::run::session::preparation::Ground;
use crate::world::cache::PreparedCache;

/// How many motions there are of one shape, and of all items together.
const PER_SHAPE: u32 = 2;
const MOST: usize = 16;

/// The largest phase difference of a motion between the centre of a shape and a corner of its bounding box, in radians.
const TURN: f64 = 2.5;

/// The seed of the motions: the same whatever samples a gradient takes.
const SEED: u64 = 0x7072_6f62_6573;

/// The estimator of gradients with respect to some items of a scene, as far as the settings leave it open.
pub(crate) fn for_items(
    scene: &Scene,
    wanted: &[Target],
    settings: &Settings,
    kept: &mut PreparedCache,
) -> EstimatorKind {
    if settings.estimator != EstimatorKind::Auto {
        return settings.estimator;
    }
    // Gradients leave open how paths are found by finding them from the camera.
    let sampling = match settings.sampling {
        PathSampling::Auto => PathSampling::Unidirectional,
        named => named,
    };
    let settings = Settings { sampling, ..settings.clone() };
    let probed = tangents::apply(scene, &probes(scene, wanted));
    let chosen = probed.and_then(|(scene, rates)| for_motions(&scene, &rates, &settings, kept));
    // What no estimator can differentiate in this way may have a gradient still.
    chosen.unwrap_or(EstimatorKind::PathSpace)
}

/// The estimator of derivatives with respect to parameters, of which [`probes`] may be a part.
pub(crate) fn for_motions(
    scene: &Scene,
    tangents: &Tangents,
    settings: &Settings,
    kept: &mut PreparedCache,
) -> Result<EstimatorKind, Error> {
    let tangents = tangents.seen_by(settings.sensor);
    if tangents.names.is_empty() {
        return Ok(EstimatorKind::PathSpace);
    }
    tangents.check()?;
    let ground = Ground::new(scene, &tangents, settings, kept)?;
    Ok(estimator(&ground, kept)?.kind)
}

/// Parameters, zero at present, that move some items of a scene: none where nothing can move. Emitters that are points or directions
/// do not tell estimators apart, all of which take `path-space` for them.
pub(crate) fn probes(scene: &Scene, wanted: &[Target]) -> Vec<Parameter> {
    let mut found: Vec<Parameter> = Vec::new();
    for target in wanted {
        let changes: Vec<GeometryChange> = match *target {
            Target::Shape(s) => {
                let mesh = &scene.shapes[s].mesh;
                (0..PER_SHAPE).map(|k| wave(mesh, Rng::new(SEED, s as u64, k))).collect()
            }
            Target::Sensor(s) => {
                let pivot = scene.sensors[s].item.sensor.position();
                [Vec3::X, Vec3::Y, Vec3::Z]
                    .into_iter()
                    .flat_map(|axis| {
                        [GeometryChange::Translate(axis), GeometryChange::Rotate { axis, pivot }]
                    })
                    .collect()
            }
            Target::Medium(_) | Target::Coefficients(_) | Target::Bsdf(_) | Target::Emitter(_) => {
                Vec::new()
            }
        };
        let target = scene.name_of(*target);
        for change in changes.into_iter().take(MOST.saturating_sub(found.len())) {
            let effect = Effect { target: target.clone(), change: Change::Geometry(change) };
            let name: String = format!("motion {}", found.len());
            found.push(Parameter { name, value: 0.0, effects: [effect].into() });
        }
    }
    found
}

/// A velocity of a mesh's vertices that varies like a sine, in a random direction and with a random phase for each coordinate.
fn wave(mesh: &Mesh, mut rng: Rng) -> GeometryChange {
    let bounds = mesh.bounds();
    let (center, half) = (bounds.center(), (bounds.max - bounds.min) * 0.5);
    let turn = TURN / f64::max(half.length(), f64::MIN_POSITIVE);
    let waves: [(Vec3, f64); 3] = core::array::from_fn(|_| {
        let along = drt_math::warp::uniform_sphere(rng.next_2d()) * turn;
        (along, TAU * rng.next_f64())
    });
    let mut velocities = alloc::vec![Vec3::ZERO; mesh.source_vertex_count as usize];
    for (i, p) in (0..).zip(&mesh.positions) {
        let [x, y, z] = waves.map(|(along, phase)| fm::sin(along.dot(*p - center) + phase));
        velocities[mesh.source_vertex(i) as usize] = vec3(x, y, z);
    }
    GeometryChange::VertexVelocity(velocities.into())
}
