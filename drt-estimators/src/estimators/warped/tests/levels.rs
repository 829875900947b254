//! Radiances that the motion of rays is taken relative to: no derivative depends on them, and its noise does.

use super::*;
use crate::derivative::tests::scenes::FILM;
use crate::model::filter::FilterKind;
use crate::sampling::parallel::Pool;
use crate::terms::level::Levels;

/// A ball and a cube before nothing, in the light of a lamp that is not seen, and a sky where that is asked for.
pub(super) fn before(filter: FilterKind, under_sky: bool) -> Scene {
    let cube = placed(procedural::cube(), vec3(0.3, 0.3, 0.3), 0.5, vec3(-0.4, -0.2, 0.3));
    let ball = placed(procedural::icosphere(3), Vec3::splat(0.6), 0.3, vec3(0.3, 0.1, 0.0));
    let ball = ball.with_smooth_normals();
    let scene = SceneBuilder::new()
        .shape("ball", ShapeBuilder::new(ball, diffuse(0.5, 0.6, 0.4)))
        .shape("cube", ShapeBuilder::new(cube, diffuse(0.7, 0.5, 0.6)));
    let scene = if under_sky {
        scene.emitter("sky", Emitter::Constant { radiance: Rgb::ONE })
    } else {
        let linear = Mat3::rotation(Vec3::Y, core::f64::consts::PI) * 1.5;
        let facing = Affine { linear, translation: vec3(0.5, 1.0, 6.0) };
        let lamp = procedural::rectangle().transform(&facing);
        scene.shape("lamp", glowing(lamp, Rgb::splat(5.0)))
    };
    seen_through(filter, scene, [vec3(0.2, 0.4, 4.0), Vec3::ZERO])
}

/// The pixel in the middle of the ball.
const MIDDLE: u32 = 2 * FILM[0] + 3;

fn motions() -> [Parameter; 3] {
    let tilt = GeometryChange::Rotate { axis: vec3(0.6, 0.0, 0.8), pivot: Vec3::ZERO };
    let all = [("ball", shift()), ("cube", tilt.clone()), ("camera", tilt)];
    all.map(|(name, change)| parameter(name, 0.0, alloc::vec![moves(name, change)]))
}

fn prepared(scene: &Scene, motion: &Parameter, level: f64) -> (Prepared, Motion) {
    let lit = EmitterMask::Extended;
    let (mut prepared, motion) = prepare_lit(EstimatorKind::Warped, lit, scene, motion, 2);
    prepared.levels = Levels::even(Rgb::splat(level), &prepared.world);
    (prepared, motion)
}

/// An image of the same radiance everywhere does not change, however its rays move; it does if they do not move as they should.
#[test]
fn derivatives_do_not_depend_on_them() {
    let scene = before(FilterKind::Tent { radius: 1.0 }, false);
    for motion in motions() {
        let [none, some, none_faulty, some_faulty] =
            [(0.0, false), (1.0, false), (0.0, true), (1.0, true)].map(|(level, faulty)| {
                let (mut prepared, motion) = prepared(&scene, &motion, level);
                if faulty {
                    let field = Arc::clone(&prepared.terms.velocity);
                    let fault = Fault::Divergence;
                    prepared.terms.velocity = Arc::new(Faulty { field, fault });
                }
                derivative(MOMENT, &(prepared, motion))
            });
        let name = &motion.name;
        let (off, _) = some.off(&none);
        let (off_with_fault, _) = some_faulty.off(&none_faulty);
        assert!(off.abs() < 4.0, "{name}: {off}");
        assert!(off_with_fault.abs() > 10.0, "{name}: {off_with_fault}");
    }
}

/// Under a sky that is the same everywhere a body has one radiance, which its pixels learn, and only its outline is noisy.
#[test]
fn they_take_the_noise_of_what_is_even() {
    let scene = before(FilterKind::BOX, true);
    let [motion, ..] = motions();
    // Of a pixel that sees nothing but the ball.
    let sum = Sum { weight: |pixel| f64::from(u8::from(pixel == MIDDLE)), samples: 64, ..LIGHT };
    let [plain, level] = [false, true].map(|learnt| {
        let (mut prepared, motion) = prepared(&scene, &motion, 0.0);
        if learnt {
            let Prepared { world, terms, .. } = &prepared;
            let (account, levels) = Levels::learn(world, terms, 7, 64, &Pool::new(1), &|| false);
            assert!(account.counters.rays > 0 && !levels.is_empty());
            prepared.levels = levels;
        }
        derivative(sum, &(prepared, motion))
    });
    let spread = |batches: &Batches| {
        let exact = Batches::exact(1.0);
        batches.off(&exact).1
    };
    let [plain_error, level_error] = [&plain, &level].map(spread);
    assert!(level.off(&plain).0.abs() < 4.0);
    assert!(level_error < 0.25 * plain_error, "{level_error} {plain_error}");
}
