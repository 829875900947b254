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

/// What the other ray of a pair brings, as a test changes it.
type Change<'a> = &'a dyn Fn(&AntitheticPair, &mut PairedRadiance);

/// The interior derivative of all light of lamps and the sky: along single rays and from pairs; and the differences, path by path, between the
/// two, and between what is along single rays and what is from pairs whose other ray brings what a planted `fault` makes of it.
fn derivatives(
    scene: &Scene,
    parameter: &Parameter,
    form: Form,
    paths: u32,
    fault: Change<'_>,
) -> [Moments; 4] {
    let (prepared, motion) = prepare(scene, parameter, 5);
    let world = &prepared.world;
    let mut tracer = Tracer::new(world);
    let field: Arc<dyn VelocityField> = match form {
        Form::Material => Arc::new(Material::new(Movers::new(&motion.active))),
        Form::Spatial => Arc::new(Spatial::new(world, &motion.active)),
    };
    let mut path = Recording::new(world, field, AntitheticPairs::new(true));
    let mut differentiator = Differentiator::new(world);
    let mut sinks = [(); 2].map(|()| Contraction::new(world, &motion));
    let mut buffer = PairedRadiance::default();
    // Without pairs; with them, without the fault and with it. All by the same path.
    let mut of = |i: u32, paired: bool| -> [f64; 2] {
        let choices = paired.then(|| Rng::new(9, 1, i));
        let slope = trace(&mut tracer, &mut path, choices, 20, i);
        sinks.iter_mut().for_each(Contraction::clear);
        let [right, wrong] = &mut sinks;
        differentiator.differentiate(&path.path(), slope, Rng::new(6, 0, i), right);
        let alone = right.rates[0].mean();
        path.views[0].pairs.follow(&mut tracer, &mut buffer, |pair, chance, incoming| {
            differentiator.pair(&path.path(), pair, chance, incoming, right);
            let mut incoming = incoming.clone();
            fault(pair, &mut incoming);
            differentiator.pair(&path.path(), pair, chance, &incoming, wrong);
        });
        [right.rates[0].mean(), alone + wrong.rates[0].mean()]
    };
    let mut found = [Moments::default(); 4];
    for i in 0..paths {
        let [single, _] = of(i, false);
        let [pairs, faulty] = of(i, true);
        let all = [single, pairs, pairs - single, faulty - single];
        found.iter_mut().zip(all).for_each(|(moments, value)| moments.push(value));
    }
    found
}

/// The mean of differences in standard errors.
fn z(differences: &Moments) -> f64 {
    differences.mean() / differences.standard_error()
}

fn dimmed(incoming: &mut PairedRadiance, by: f64) {
    incoming.light *= by;
    incoming.ends.iter_mut().for_each(|(_, light)| *light *= by);
}

fn check(ball: Bsdf, paths: u32) {
    let scene = surfaces(ball, twosided(phong()));
    let rougher = set("alpha", "ball", "alpha", grey(1.0));
    // Planted: one of the sides is too dark.
    let fault: Change<'_> = &|pair, incoming| {
        if matches!(pair.kind, PairKind::Roughness(slope) if slope < 0.0) {
            dimmed(incoming, 0.75);
        }
    };
    let [.., fair, faulty] = derivatives(&scene, &rougher, Form::Material, paths, fault);
    assert!(z(&fair).abs() < 4.0, "{fair:?}");
    assert!(z(&faulty).abs() > 5.0, "{faulty:?}");
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
    // Planted: the one side of the lobe is dark.
    let fault: Change<'_> = &|pair, incoming| {
        if matches!(&pair.kind, PairKind::Turns([turn, _]) if turn.n.x + turn.eta < 0.0) {
            dimmed(incoming, 0.0);
        }
    };
    let [single, pairs, fair, faulty] = derivatives(&scene, parameter, form, 180_000, fault);
    let (z, unlike) = (z(&fair), z(&faulty));
    let noise = pairs.variance_of_mean() / single.variance_of_mean();
    println!("{form:?}, {}: {z:.2} {noise:.2}; {unlike:.2}", parameter.name);
    assert!(z.abs() < 4.0, "{fair:?}");
    // In the spatial form what is carried through glass has rare, large samples of its own.
    let tails = form == Form::Spatial && scene.bsdfs[0].item.is_transmissive();
    assert!(tails || noise < 0.5, "{single:?} {pairs:?}");
    assert!(unlike.abs() > 5.0, "{faulty:?}");
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
    turned(glass(), &set("eta", "ball", "eta", grey(0.1)), Form::Material);
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
        // Planted: the other rays end nowhere.
        let fault: Change<'_> = &|_, incoming| incoming.ends.clear();
        let [single, pairs, _, faulty] = derivatives(&scene, &all, Form::Material, 20_000, fault)
            .map(|m| f64::sqrt(m.mean() * m.mean() + m.variance_of_mean()));
        println!("{single:e} {pairs:e} {faulty:e}");
        assert!(single < 1e-9 && pairs < 1e-9 && faulty > 1e-4);
    }
}

#[test]
fn pairs_of_rays_from_metal() {
    check(metal(), 120_000);
}

/// In narrow lobes light is found by scattering as well as by connections.
#[test]
fn pairs_of_rays_from_narrow_lobes() {
    check(narrow(metal(), 0.07), 250_000);
}

#[test]
fn pairs_of_rays_through_glass() {
    check(glass(), 270_000);
}
