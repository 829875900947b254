//! Derivatives without samples of edges are those with them, and what is wrong with a field is found.

use alloc::sync::Arc;
use alloc::vec::Vec;

use drt_math::stats::Moments;
use drt_math::{Vec3, vec3};
use drt_motion::{GeometryChange, Parameter};

use crate::derivative::contraction::Motion;
use crate::derivative::tests::choice::{LIGHT, MOMENT, Sum, derivative, prepare_for};
use crate::derivative::tests::scenes::*;
use crate::derivative::velocity::{
    Auxiliary, Blend, Found, Probe, RayTurn, TurnPart, TurningRay, VelocityField, VertexVelocity,
};
use crate::model::scene::Scene;
use crate::model::settings::EstimatorKind;
use crate::terms::prepared::Prepared;
use crate::world::World;
use crate::world::vertex::Vertex;

/// What is wrong with a field.
#[derive(Clone, Copy, Debug)]
enum Fault {
    /// The divergence of the rates is left out.
    Divergence,
    /// Rates have the wrong sign.
    Sign,
    /// Weights do not reach 1 at edges, as by a wrong exponent.
    Weight,
    /// What moves the same everywhere beside a ray has no divergence, as by a frozen direction.
    Direction,
}

#[derive(Debug)]
struct Faulty {
    field: Arc<dyn VelocityField>,
    fault: Fault,
}

impl VelocityField for Faulty {
    fn camera(&self) -> VertexVelocity {
        self.field.camera()
    }

    fn vertex(
        &self,
        world: &World,
        found: &Found<'_>,
        probe: &mut Probe,
        auxiliary: &mut Vec<Auxiliary>,
    ) -> VertexVelocity {
        self.field.vertex(world, found, probe, auxiliary)
    }

    fn turn(
        &self,
        world: &World,
        ray: &TurningRay<'_>,
        probe: &mut Probe,
        parts: &mut Vec<TurnPart>,
    ) -> Option<RayTurn> {
        let turn = self.field.turn(world, ray, probe, parts)?;
        for part in &mut parts[turn.parts.clone()] {
            match self.fault {
                Fault::Divergence => part.divergence = Vec3::ZERO,
                Fault::Sign => {
                    part.rate = -part.rate;
                    part.divergence = -part.divergence;
                }
                Fault::Weight => {
                    part.rate *= 0.8;
                    part.divergence *= 0.8;
                }
                Fault::Direction => part.divergence += ray.dir * (2.0 * part.rate),
            }
        }
        Some(turn)
    }

    fn blend(&self, world: &World, viewer: &Vertex, end: &Vertex, dir: Vec3, d: f64) -> Blend {
        self.field.blend(world, viewer, end, dir, d)
    }
}

fn compare(scene: &Scene, motion: &Parameter, sum: Sum, faults: &[Fault]) {
    let by = |kind| move |_| prepare_for(kind, scene, motion, 4);
    let reference = derivative(sum, &by(EstimatorKind::Radiative), [1.0; 2]);
    let off = |prepare: &dyn Fn(f64) -> (Prepared, Motion)| {
        let own: Moments = derivative(sum, prepare, [1.0; 2]);
        let error = f64::sqrt(own.variance_of_mean() + reference.variance_of_mean());
        ((own.mean() - reference.mean()) / error, error / reference.mean())
    };
    let fair = off(&by(EstimatorKind::Warped));
    assert!(fair.0.abs() < 4.0 && fair.1.abs() < 0.1, "{fair:?}");
    for fault in faults {
        let faulty = off(&|_| {
            let (mut prepared, motion) = prepare_for(EstimatorKind::Warped, scene, motion, 4);
            let warped = prepared.warped.as_mut().expect("the warped form");
            let field = Arc::clone(&warped.field);
            warped.field = Arc::new(Faulty { field, fault: *fault });
            (prepared, motion)
        });
        assert!(faulty.0.abs() > 5.0, "{fault:?} {faulty:?}");
    }
}

#[test]
fn on_surfaces() {
    let scene = surfaces(diffuse(0.3, 0.5, 0.4), diffuse(0.6, 0.5, 0.7));
    let motion = parameter("ball", 0.0, alloc::vec![moves("ball", shift())]);
    let faults = [Fault::Divergence, Fault::Sign, Fault::Weight];
    compare(&scene, &motion, MOMENT, &faults);
}

/// What approaches changes most by the divergence of what is the same everywhere.
#[test]
fn seen_by_a_camera_that_approaches() {
    let scene = surfaces(diffuse(0.3, 0.5, 0.4), diffuse(0.6, 0.5, 0.7));
    let forward = GeometryChange::Translate(vec3(0.0, 0.0, -1.0));
    let motion = parameter("camera", 0.0, alloc::vec![moves("camera", forward)]);
    compare(&scene, &motion, LIGHT, &[Fault::Direction]);
}

#[test]
fn in_media() {
    let motion = parameter("card", 0.0, alloc::vec![moves("card", shift())]);
    let faults = [Fault::Divergence, Fault::Sign, Fault::Weight];
    compare(&glow(), &motion, LIGHT, &faults);
}
