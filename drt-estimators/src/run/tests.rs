//! An estimator that nothing else knows of.

use alloc::vec;

use drt_math::vec3;
use drt_motion::GeometryChange;

use crate::derivative::medium_motion::Insides;
use crate::derivative::tangents;
use crate::derivative::tests::scenes::*;
use crate::estimators::path_space::PathSpace;
use crate::estimators::{Changes, Estimator};
use crate::model::error::Error;
use crate::model::refusals::Sliding;
use crate::model::rendering::Estimate;
use crate::model::scene::Scene;
use crate::model::settings::Settings;
use crate::run::control::Unattended;
use crate::run::finite_difference::finite_differences;
use crate::run::session::Session;
use crate::run::session::preparation::Ground;
use crate::terms::flux::Flux;
use crate::terms::selected::Terms;
use crate::world::World;
use crate::world::cache::PreparedCache;

/// Path space with insides of media at rest, as in the spatial form: all surfaces that move sweep over them, which has a flux.
struct AtRest;

/// At rest without the flux, which is wrong.
struct Faulty;

impl Estimator for AtRest {
    fn name(&self) -> &'static str {
        "at-rest"
    }

    fn insides(&self) -> Insides {
        Insides::AtRest
    }

    fn slides(&self, settings: &Settings) -> Sliding {
        PathSpace.slides(settings)
    }

    fn takes_delta_lights(&self, scene: &Scene, settings: &Settings) -> bool {
        PathSpace.takes_delta_lights(scene, settings)
    }

    fn terms(&self, world: &World, changes: &Changes<'_>) -> Result<Terms, Error> {
        let mut terms = PathSpace.terms(world, changes)?;
        let flags = changes.active.shapes.iter().enumerate();
        let moved: Vec<usize> = flags.filter(|(_, moves)| **moves).map(|(s, _)| s).collect();
        terms.flux = Flux::new(world, &moved, changes.active);
        Ok(terms)
    }
}

impl Estimator for Faulty {
    fn name(&self) -> &'static str {
        "faulty"
    }

    fn insides(&self) -> Insides {
        Insides::AtRest
    }

    fn slides(&self, settings: &Settings) -> Sliding {
        AtRest.slides(settings)
    }

    fn takes_delta_lights(&self, scene: &Scene, settings: &Settings) -> bool {
        AtRest.takes_delta_lights(scene, settings)
    }

    fn terms(&self, world: &World, changes: &Changes<'_>) -> Result<Terms, Error> {
        PathSpace.terms(world, changes)
    }
}

#[test]
fn estimators_are_told_from_outside() {
    let scene = glow();
    let falls = GeometryChange::Translate(vec3(0.3, -1.0, 0.2));
    let falling = [parameter("falls", 0.0, vec![moves("block", falls)])];
    let settings = Settings { seed: 5, ..Settings::default() };
    let by = |estimator: &'static dyn Estimator| -> Estimate {
        let (scene, tangents) = tangents::apply(&scene, &falling).expect("a valid parameter");
        let mut kept = PreparedCache::default();
        let tangents = tangents.seen_by(0);
        let ground = Ground::new(&scene, &tangents, &settings, &mut kept).expect("a valid scene");
        let preparation = ground.prepare(estimator, &mut kept).expect("a valid scene");
        let mut session = Session::of(ground, preparation);
        assert!(session.run(1 << 16, &Unattended));
        assert!(session.plan().estimators[0].starts_with(estimator.name()));
        session.rendering().derivatives[0].total.total
    };
    let judge = finite_differences(&scene, &falling, &settings, 1 << 17, 2e-3, &Unattended);
    let judge = judge.expect("a valid scene")[0].total;
    let off = |own: Estimate| {
        let [error, size] = [own.stderr + judge.stderr, judge.mean].map(|v| v.abs().sum());
        ((own.mean - judge.mean).abs().sum() / error, error / size)
    };
    let (z, error) = off(by(&AtRest));
    assert!(z < 3.0 && error < 0.05, "{z} {error}");
    let (z, _) = off(by(&Faulty));
    assert!(z > 5.0, "{z}");
}
