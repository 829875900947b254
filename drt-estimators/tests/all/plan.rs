//! What a scene does not need is not done: the plan says so and the counters prove it.

use crate::common::*;
use drt_estimators::{
    AuxiliarySamples, Counters, EstimatorKind, InteriorMotion, Plan, Rendering, Scene, Session,
    Settings, Target, Term, Unattended, Warp, gradient,
};
use drt_math::{Rgb, ValueChange};
use drt_motion::{Effect, Parameter};

fn rendered(scene: &Scene, parameters: &[Parameter]) -> Rendering {
    let settings = Settings { terms: true, ..Settings::default() };
    let mut session = Session::new(scene, parameters, &settings).expect("a valid scene");
    assert!(session.run(8, &Unattended));
    session.rendering()
}

fn under(scene: &Scene, effects: Vec<Effect>) -> Rendering {
    rendered(scene, &[parameter("p", 0.0, effects)])
}

fn skips(plan: &Plan, what: &str) -> bool {
    plan.skipped.iter().any(|s| s.starts_with(what))
}

fn no_boundary(r: &Rendering) {
    let c = &r.counters;
    assert_eq!((c.boundary_samples, c.border_samples, c.flux_samples), (0, 0, 0));
    assert!(!r.plan.primary && !r.plan.direct && !r.plan.indirect && !r.plan.borders);
    assert!(!r.plan.antithetic, "mirrored pairs only help moving geometry");
    assert!(skips(&r.plan, "boundary"), "{}", r.plan);
}

const PATHS: u64 = (FILM[0] * FILM[1]) as u64 * 8;

#[test]
fn no_medium_no_tracking() {
    let r = under(&surfaces(phong(), phong()), vec![moves("ball", shift())]);
    assert_eq!((r.counters.tracking_steps, r.counters.flux_samples), (0, 0));
    assert!(skips(&r.plan, "tracking") && skips(&r.plan, "flux") && r.plan.media.is_empty());
    assert!(r.counters.boundary_samples > 0 && r.plan.primary && r.plan.direct && r.plan.indirect);
    assert_eq!(r.plan.moving_shapes, ["ball"]);
}

#[test]
fn homogeneous_media_are_not_tracked() {
    let r = under(&fog(), vec![moves("ball", wobble(&fog(), "ball", 1))]);
    assert_eq!(r.counters.tracking_steps, 0);
    assert!(r.plan.media.iter().all(|m| m.tracking == "closed form"));
    let r = rendered(&smoke(0.0), &[]);
    assert!(r.counters.tracking_steps > 0);
    assert_eq!(r.plan.media[0].tracking, "delta tracking");
}

#[test]
fn no_parameters_no_record() {
    for scene in [surfaces(phong(), phong()), fog(), smoke(0.0)] {
        let r = rendered(&scene, &[]);
        let paths = Counters { paths: PATHS, rays: r.counters.rays, ..Counters::default() };
        let tracked = r.counters.tracking_steps;
        assert_eq!(r.counters, Counters { tracking_steps: tracked, ..paths });
        assert!(r.derivatives.is_empty() && !r.plan.record && skips(&r.plan, "derivatives"));
    }
}

#[test]
fn parameters_that_change_nothing() {
    let scene = surfaces(phong(), phong());
    let still = moves("ball", drt_motion::GeometryChange::Translate(drt_math::Vec3::ZERO));
    for effects in [vec![], vec![still]] {
        let r = under(&scene, effects);
        no_boundary(&r);
        assert_eq!(r.counters.differentiated_paths, 0);
        assert!(!r.plan.record && r.plan.moving_shapes.is_empty());
        for (a, b) in r.image.pixels.iter().zip(&rendered(&scene, &[]).image.pixels) {
            assert!((a.mean - b.mean).max_abs() < 1e-14);
        }
        assert!(r.derivatives[0].total.pixels.iter().all(|p| p.mean.is_zero()));
    }
}

#[test]
fn materials_media_and_strengths_have_no_boundary() {
    let colour = ValueChange::Add(Rgb::new(0.5, -0.2, 0.3));
    for (scene, effect) in [
        (surfaces(metal(), phong()), changes("ball", "alpha", grey(0.1))),
        (surfaces(metal(), phong()), changes("bulb", "intensity", colour)),
        (surfaces(metal(), phong()), changes("lamp", "radiance", colour)),
        (surfaces(metal(), phong()), changes("spot", "cutoff_angle", grey(1.0))),
        (fog(), changes("thin", "sigma_t", colour)),
        (fog(), changes("dense", "g", grey(0.2))),
        (smoke(0.0), changes_voxel("smoke", "sigma_t", [2, 2, 2], grey(0.2))),
    ] {
        let r = under(&scene, vec![effect]);
        no_boundary(&r);
        assert_eq!(r.counters.differentiated_paths, PATHS);
        assert!(r.plan.record && r.counters.recorded_vertices > PATHS);
        assert!(r.derivatives[0].total.pixels.iter().any(|p| !p.mean.is_zero()));
    }
}

#[test]
fn lights_and_cameras_have_boundaries_too() {
    let scene = surfaces(phong(), phong());
    for effect in [
        moves("bulb", shift()),
        moves("sun", turn()),
        moves("camera", turn()),
        moves("spot", turn()),
    ] {
        let r = under(&scene, vec![effect]);
        assert!(r.counters.boundary_samples > 0 && r.plan.antithetic, "{}", r.plan);
        assert!(r.plan.moving_shapes.is_empty());
    }
}

#[test]
fn insides_follow_what_they_can() {
    let scene = fog();
    let how = |effects: Vec<Effect>| {
        let r = under(&scene, effects);
        let thin = &r.plan.media[0];
        (
            thin.motion.first().map(|(_, how)| how.clone()),
            r.plan.flux_shapes,
            r.counters.flux_samples,
        )
    };
    let motion = |s: &str| Some(String::from(s));
    // A surface with vertices on it takes its surroundings along.
    for (change, kind) in [(turn(), "blend"), (wobble(&scene, "ball", 1), "tetrahedral")] {
        let (thin, shapes, samples) = how(vec![moves("ball", change)]);
        assert_eq!((thin, shapes.len(), samples), (motion(kind), 0, 0));
    }
    // Nothing moves.
    let (thin, shapes, samples) = how(vec![changes("thin", "albedo", grey(0.1))]);
    assert_eq!((thin, shapes.len(), samples), (None, 0, 0));
}

#[test]
fn the_plan_says_why_there_are_no_tetrahedra() {
    for (bottom, crosses) in [(-1.1, true), (-0.7, false)] {
        let scene = fog_with_a_block(bottom, 0.5);
        let r = under(&scene, vec![moves("block", wobble(&scene, "block", 1))]);
        let said = r.plan.skipped.iter().find(|s| s.starts_with("tetrahedra in fog: "));
        let names = said.is_some_and(|s| s.contains("of floor and ") && s.contains("of block"));
        assert_eq!((said.is_some(), names), (crosses, crosses), "{}", r.plan);
        let kind = if crosses { "blend" } else { "tetrahedral" };
        assert_eq!(r.plan.media[0].motion[0].1, kind);
    }
}

#[test]
fn reverse_mode_skips_as_much() {
    let adjoint = vec![Rgb::ONE; (FILM[0] * FILM[1]) as usize];
    let under = |scene: &Scene, wanted: &[Target], insides: Vec<(usize, InteriorMotion)>| {
        let settings = Settings { insides, ..Settings::default() };
        gradient(scene, wanted, &settings, 8, &adjoint, &Unattended).expect("a valid scene")
    };
    let run = |scene: &Scene, wanted: &[Target]| under(scene, wanted, Vec::new());
    let scene = surfaces(phong(), phong());
    let g = run(&scene, &[Target::Bsdf(0)]);
    let c = &g.counters;
    assert_eq!((c.boundary_samples, c.flux_samples, c.tracking_steps), (0, 0, 0));
    assert_eq!(c.differentiated_paths, PATHS);
    assert!(g.bsdfs[0].is_some() && g.bsdfs[1].is_none() && g.shapes.iter().all(Option::is_none));
    let g = run(&scene, &[]);
    assert_eq!((g.counters.differentiated_paths, g.counters.boundary_samples), (0, 0));
    let g = run(&fog(), &[Target::Medium(0)]);
    assert_eq!((g.counters.boundary_samples, g.counters.flux_samples), (0, 0));
    // Insides follow; where they stay, the flux is needed.
    let g = run(&fog(), &[Target::Shape(2)]);
    assert!(g.counters.boundary_samples > 0 && g.counters.flux_samples == 0);
    let g = under(&fog(), &[Target::Shape(2)], vec![(0, InteriorMotion::Static)]);
    assert!(g.counters.boundary_samples > 0 && g.counters.flux_samples > 0);
    // So it is where surfaces pass through each other, or touch.
    for (at, why) in [(-1.1, "pass through"), (-1.0, "touch")] {
        let scene = fog_with_a_block(at, 0.5);
        let block = scene.find("block").expect("a shape");
        assert!(run(&scene, &[block]).counters.flux_samples > 0, "{why}");
    }
    let g = run(&fog_with_a_block(-0.7, 0.5), &[Target::Shape(2)]);
    assert!(g.counters.boundary_samples > 0 && g.counters.flux_samples == 0);
}

fn by_rays(scene: &Scene, parameters: &[Parameter]) -> Rendering {
    by(EstimatorKind::Radiative, scene, parameters)
}

fn by(estimator: EstimatorKind, scene: &Scene, parameters: &[Parameter]) -> Rendering {
    let settings = Settings { terms: true, estimator, ..Settings::default() };
    let mut session = Session::new(scene, parameters, &settings).expect("a valid scene");
    assert!(session.run(8, &Unattended));
    session.rendering()
}

#[test]
fn the_2019_estimator_skips_as_much() {
    for scene in [surfaces(phong(), diffuse(0.5, 0.4, 0.3)), fog()] {
        let r = by_rays(&scene, &[]);
        assert_eq!((r.counters.recorded_vertices, r.counters.boundary_samples), (0, 0));
        let colour = changes("sky", "radiance", grey(0.1));
        no_boundary(&by_rays(&scene, &[parameter("p", 0.0, vec![colour])]));
        let r = by_rays(&scene, &[parameter("p", 0.0, vec![moves("ball", shift())])]);
        assert!(r.counters.boundary_samples > 0 && r.plan.primary && r.plan.indirect);
    }
}

#[test]
fn each_light_has_one_estimator() {
    let shift = || [parameter("p", 0.0, vec![moves("ball", shift())])];
    let plan = by_rays(&surfaces(phong(), phong()), &shift()).plan;
    let named = |what: &str| plan.estimators.iter().filter(|e| e.starts_with(what)).count();
    assert_eq!((named("radiative"), named("path-space")), (1, 1), "{plan}");
    let plan = rendered(&surfaces(phong(), phong()), &shift()).plan;
    assert_eq!(plan.estimators, ["path-space, all light"]);
}

/// Neither boundary samples nor auxiliary rays: the paths are those of the image.
#[test]
fn rays_that_turn_need_no_others() {
    let warped =
        |scene: &Scene, parameters: &[Parameter]| by(EstimatorKind::Warped, scene, parameters);
    let moving = [parameter("p", 0.0, vec![moves("card", shift())])];
    let [image, derivative] = [&[][..], &moving].map(|p| warped(&glow(), p));
    let c = &derivative.counters;
    assert_eq!((c.boundary_samples, c.border_samples), (0, 0));
    assert!(c.recorded_vertices > 0 && c.rays < image.counters.rays * 2, "{c:?}");
    let layers = derivative.derivatives[0].terms.iter().map(|(term, _)| *term);
    assert!(layers.eq([Term::Interior, Term::Flux, Term::Warp]));
    let share = derivative.derivatives[0].terms[2].1.rms_value();
    assert!(share > 0.2 * derivative.derivatives[0].total.rms_value(), "{share}");
    // Light of points and directions, on surfaces and in fog.
    for (scene, others) in [(surfaces(phong(), phong()), false), (fog(), true)] {
        let plan = warped(&scene, &[parameter("p", 0.0, vec![moves("ball", shift())])]).plan;
        let named = |what: &str| plan.estimators.iter().any(|e| e.starts_with(what));
        assert!(named("warped") && named("path-space") == others, "{plan}");
    }
}

#[test]
fn auxiliary_samples_are_for_surfaces() {
    let moving = [parameter("p", 0.0, vec![moves("card", shift())])];
    for warp in
        [Warp::Points(AuxiliarySamples::default()), Warp::Directions(AuxiliarySamples::default())]
    {
        let estimator = EstimatorKind::Warped;
        let settings = Settings { estimator, warp, ..Settings::default() };
        let refused = Session::new(&glow(), &moving, &settings).err().expect("there is fog");
        assert!(refused.to_string().contains("surfaces alone"), "{refused}");
    }
}
