//! Derivatives from pairs of rays, against those along single ones.

use alloc::sync::Arc;

use drt_math::Rng;
use drt_math::stats::Moments;
use drt_motion::Parameter;

use crate::derivative::adjoint::Differentiator;
use crate::derivative::antithetic::{AntitheticPair, AntitheticPairs, PairKind, PairedRadiance};
use crate::derivative::contraction::Contraction;
use crate::derivative::tests::choice::prepare;
use crate::derivative::tests::scenes::*;
use crate::derivative::tests::setup::{Recording, motion, set, trace};
use crate::derivative::velocity::{Material, Movers, Spatial, VelocityField};
use crate::model::emitter::Emitter;
use crate::model::scene::Scene;
use crate::model::surface::{Bsdf, Distribution, RoughConductor, RoughDielectric};
use crate::sampling::trace::Tracer;

/// The velocity field.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Form {
    Material,
    Spatial,
}

/// The interior derivative of all light of lamps and the sky: along single rays, and from pairs whose other ray brings what
/// `other` makes of it.
fn derivatives(
    scene: &Scene,
    parameter: &Parameter,
    form: Form,
    paths: u32,
    other: impl Fn(&AntitheticPair, &mut PairedRadiance),
) -> [Moments; 2] {
    let (prepared, motion) = prepare(scene, parameter, 5);
    let world = &prepared.world;
    let mut tracer = Tracer::new(world);
    let field: Arc<dyn VelocityField> = match form {
        Form::Material => Arc::new(Material::new(Movers::new(&motion.active))),
        Form::Spatial => Arc::new(Spatial::new(world, &motion.active)),
    };
    let mut path = Recording::new(world, field, AntitheticPairs::new(true));
    let mut differentiator = Differentiator::new(world);
    let mut sink = Contraction::new(world, &motion);
    let (mut buffer, mut moments) = (PairedRadiance::default(), [Moments::default(); 2]);
    for (seed, moments) in (20..).zip(&mut moments) {
        for i in 0..paths {
            let choices = (seed == 21).then(|| Rng::new(9, 1, i));
            let slope = trace(&mut tracer, &mut path, choices, seed, i);
            sink.clear();
            differentiator.differentiate(&path.path(), slope, Rng::new(6, 0, i), &mut sink);
            path.views[0].pairs.follow(&mut tracer, &mut buffer, |pair, chance, incoming| {
                let mut incoming = incoming.clone();
                other(pair, &mut incoming);
                differentiator.pair(&path.path(), pair, chance, &incoming, &mut sink);
            });
            moments.push(sink.rates[0].mean());
        }
    }
    moments
}

fn z([single, pairs]: [Moments; 2]) -> f64 {
    let variance = single.variance_of_mean() + pairs.variance_of_mean();
    (single.mean() - pairs.mean()) / f64::sqrt(variance)
}

fn dimmed(incoming: &mut PairedRadiance, by: f64) {
    incoming.light *= by;
    incoming.ends.iter_mut().for_each(|(_, light)| *light *= by);
}

fn check(ball: Bsdf) {
    let scene = surfaces(ball, twosided(phong()));
    let rougher = set("alpha", "ball-bsdf", "alpha", grey(1.0));
    let find = |other: &dyn Fn(&AntitheticPair, &mut PairedRadiance)| {
        derivatives(&scene, &rougher, Form::Material, 400_000, other)
    };
    let fair = find(&|_, _| {});
    assert!(z(fair).abs() < 4.0, "{fair:?}");
    // Planted: one of the sides is too dark.
    let faulty = find(&|pair, incoming| {
        if matches!(pair.kind, PairKind::Roughness(slope) if slope < 0.0) {
            dimmed(incoming, 0.75);
        }
    });
    assert!(z(faulty).abs() > 5.0, "{faulty:?}");
}

fn narrow(bsdf: Bsdf, alpha: f64) -> Bsdf {
    let distribution = Distribution::Beckmann;
    match bsdf {
        Bsdf::RoughConductor(b) => {
            Bsdf::RoughConductor(RoughConductor { alpha, distribution, ..b })
        }
        Bsdf::RoughDielectric(b) => {
            Bsdf::RoughDielectric(RoughDielectric { alpha, distribution, ..b })
        }
        other => other,
    }
}

/// By what turns the lobes of the ball, with much less noise.
fn turned(ball: Bsdf, parameter: &Parameter, form: Form) {
    let scene = surfaces(narrow(ball, 0.05), twosided(phong()));
    let find = |other: &dyn Fn(&AntitheticPair, &mut PairedRadiance)| {
        derivatives(&scene, parameter, form, 200_000, other)
    };
    let fair = find(&|_, _| {});
    let [single, pairs] = fair.map(|m| m.variance_of_mean());
    println!("{form:?}, {}: {:.2} {:.2}", parameter.name, z(fair), pairs / single);
    assert!(z(fair).abs() < 4.0, "{fair:?}");
    // In the spatial form what is carried through glass has rare, large samples of its own.
    let tails = form == Form::Spatial && scene.bsdfs[0].item.is_transmissive();
    assert!(tails || pairs < 0.5 * single, "{fair:?}");
    // Planted: the one side of the lobe is dark.
    let faulty = find(&|pair, incoming| {
        if matches!(&pair.kind, PairKind::Turns([turn, _]) if turn.n.x + turn.eta < 0.0) {
            dimmed(incoming, 0.0);
        }
    });
    assert!(z(faulty).abs() > 5.0, "{faulty:?}");
}

#[test]
fn pairs_of_rays_tell_how_lobes_turn() {
    for form in [Form::Material, Form::Spatial] {
        turned(metal(), &motion("ball", "shifts", shift()), form);
        turned(glass(), &motion("ball", "shifts", shift()), form);
    }
}

#[test]
fn pairs_of_rays_tell_how_cameras_turn_lobes() {
    turned(metal(), &motion("camera", "shifts", shift()), Form::Spatial);
    turned(metal(), &motion("camera", "turns", turn()), Form::Spatial);
}

#[test]
fn pairs_of_rays_tell_how_glass_bends_light() {
    turned(glass(), &set("eta", "ball-bsdf", "eta", grey(0.1)), Form::Material);
}

/// When all turns together no path changes, and neither do pairs, whose rays turn to different ends.
#[test]
fn pairs_of_rays_turn_with_everything() {
    for ball in [metal(), glass()] {
        let mut scene = surfaces(narrow(ball, 0.05), twosided(phong()));
        // The sky stays where it is.
        scene.emitters.retain(|e| !matches!(e.item.emitter, Emitter::Constant { .. }));
        let all = ["ball", "floor", "lamp", "camera"].map(|id| moves(id, turn()));
        let all = parameter("all turns", 0.0, all.to_vec());
        let find = |other: &dyn Fn(&AntitheticPair, &mut PairedRadiance)| {
            derivatives(&scene, &all, Form::Material, 20_000, other)
        };
        let size = |m: &Moments| f64::sqrt(m.mean() * m.mean() + m.variance_of_mean());
        let [single, pairs] = find(&|_, _| {}).map(|m| size(&m));
        // Planted: the other rays end nowhere.
        let [_, faulty] = find(&|_, incoming| incoming.ends.clear()).map(|m| size(&m));
        println!("{single:e} {pairs:e} {faulty:e}");
        assert!(single < 1e-9 && pairs < 1e-9 && faulty > 1e-4);
    }
}

#[test]
fn pairs_of_rays_from_metal() {
    check(metal());
}

/// In narrow lobes light is found by scattering as well as by connections.
#[test]
fn pairs_of_rays_from_narrow_lobes() {
    check(narrow(metal(), 0.07));
}

#[test]
fn pairs_of_rays_through_glass() {
    check(glass());
}
