//! Rates that follow edges and borders across alone.

use core::array::from_fn;

use super::levels::before;
use super::*;
use crate::derivative::tests::scenes::FILM;
use crate::model::filter::FilterKind;
use crate::sampling::record::CameraRay;
use crate::world::lights::LightTable;

/// What is told of the ray of a camera at rest.
pub(super) fn asked<R>(
    prepared: &Prepared,
    pixel: [u32; 2],
    dir: Vec3,
    of: impl FnOnce(&World, &TurningRay<'_>) -> Option<R>,
) -> Option<R> {
    let world = &prepared.world;
    let eye = world.eye_at(world.camera.position());
    let mut ray = crate::world::RayPath::default();
    world.cast(&eye, dir, &mut ray, &mut Default::default());
    let ray = TurningRay {
        viewer: &eye,
        moves: false,
        of_camera: Some(CameraRay { pixel, lens: [0.0; 2] }),
        dir,
        distance: ray.length,
        end: ray.end.as_ref().map(|(point, _)| point),
        emission_alone: false,
        tangent_plane: None,
    };
    of(world, &ray)
}

/// The sum of what turns a ray by edges, and its divergence, where all of them move by `c`.
fn by_edges(parts: &[TurnPart], dir: Vec3, c: Vec3) -> (Vec3, f64) {
    let rate = parts.iter().fold(Vec3::ZERO, |sum, part| sum + part.rate * c);
    // What is along the ray turns nothing.
    (rate.reject(dir), parts.iter().map(|part| part.divergence.dot(c)).sum())
}

/// The rate of a ray of the camera of which all that is beside it moves by `c`, and its divergence.
pub(super) fn rate(
    prepared: &Prepared,
    pixel: [u32; 2],
    dir: Vec3,
    c: Vec3,
) -> Option<(Vec3, f64)> {
    asked(prepared, pixel, dir, |world, ray| {
        let (mut parts, mut probe) = (Vec::new(), Probe::new(Rng::new(0, 0, 0)));
        prepared.terms.velocity.turn(world, ray, &mut probe, &mut parts)?;
        Some(by_edges(&parts, dir, c))
    })
}

/// The same of what the ray sees in the light of an emitter, where it turns with the shadows there.
fn rate_beside_shadows(
    prepared: &Prepared,
    pixel: [u32; 2],
    dir: Vec3,
    c: Vec3,
    emitter: usize,
) -> Option<(Vec3, f64)> {
    asked(prepared, pixel, dir, |world, ray| {
        let x = ray.viewer.x + dir * ray.distance;
        let light = LightTable::delta(world, emitter, x, 1.0)?;
        let mut parts = TurnParts::default();
        let field = &prepared.terms.velocity;
        let turn = field.turn_with_shadows(world, ray, &light, true, &mut parts)?;
        let (mut rate, mut divergence) = by_edges(&parts.edges, dir, c);
        let shadow = turn.shadow?;
        let frame = drt_math::Frame::from_normal(dir);
        for part in &parts.shadows {
            let Weight { value, gradient } = part.share;
            for t in [frame.s, frame.t] {
                rate += t * (shadow.at.project(t).dot(c) * value);
            }
            divergence += shadow.at.projection_divergence().dot(c) * value;
            divergence += shadow.at.project(gradient).dot(c);
        }
        Some((rate, divergence))
    })
}

fn everything_moves(filter: FilterKind) -> Prepared {
    let targets = ["ball", "cube"].map(|name| moves(name, shift())).to_vec();
    let motion = parameter("all", 0.0, targets);
    let lit = EmitterMask::Extended;
    prepare_lit(EstimatorKind::Warped, lit, &before(filter, false), &motion, 2).0
}

/// The pixel of an image point, and the direction in which that is seen.
pub(super) fn seen_at(prepared: &Prepared, point: [f64; 2]) -> ([u32; 2], Vec3) {
    let dir = prepared.world.camera.ray(point).dir;
    (point.map(|x| x as u32), dir)
}

/// The divergence of a rate by differences; not across kinks, nor where steps are too long.
fn differences(dir: Vec3, rate: impl Fn(Vec3) -> Option<Vec3>) -> Option<f64> {
    let frame = drt_math::Frame::from_normal(dir);
    let by = |h: f64| {
        let along = |t: Vec3| {
            let at = |h: f64| rate((dir + t * h).normalize());
            Some((at(h)?.dot(t) - at(-h)?.dot(t)) / (2.0 * h))
        };
        Some(along(frame.s)? + along(frame.t)?)
    };
    let (near, far) = (by(1e-6)?, by(2e-6)?);
    ((near - far).abs() <= 1e-3 * (1.0 + near.abs())).then_some(near)
}

#[test]
fn divergences_are_differences() {
    for filter in [FilterKind::BOX, FilterKind::Tent { radius: 1.0 }] {
        let prepared = everything_moves(filter);
        let mut rng = Rng::new(5, 0, 0);
        let mut compared = 0;
        for _ in 0..4000 {
            let [x, y] = rng.next_2d();
            let (pixel, dir) = seen_at(&prepared, [x * f64::from(FILM[0]), y * f64::from(FILM[1])]);
            let c = vec3(rng.next_f64(), rng.next_f64(), rng.next_f64()) - Vec3::splat(0.5);
            let Some((_, divergence)) = rate(&prepared, pixel, dir, c) else { continue };
            let differences = differences(dir, |dir| Some(rate(&prepared, pixel, dir, c)?.0));
            let Some(near) = differences else { continue };
            compared += 1;
            let scale = 1.0 + divergence.abs();
            assert!((divergence - near).abs() < 1e-2 * scale, "{filter:?}: {divergence} {near}");
        }
        assert!(compared > 1000, "{compared}");
    }
}

/// Near a point where an edge crosses the border of a pixel, both are followed across, and the divergence does not grow.
#[test]
fn crossings_are_even() {
    let prepared = everything_moves(FilterKind::BOX);
    let world = &prepared.world;
    let c = vec3(0.3, 0.5, 0.2);
    let mut crossings = 0;
    let mut largest: f64 = 0.0;
    for shape in &world.scene.shapes[1..2] {
        let seen: Vec<_> =
            shape.mesh.positions.iter().map(|x| world.camera.view(*x).pixel).collect();
        for corners in &shape.mesh.triangles {
            for k in 0..3 {
                let [a, b] = [corners[k], corners[(k + 1) % 3]].map(|v| seen[v as usize]);
                let border = a[0].max(b[0]).floor();
                let part = (border - a[0]) / (b[0] - a[0]);
                // Beside a border for long, an edge does not go through it at one point.
                let steep = (b[1] - a[1]).abs() > 2.0 * (b[0] - a[0]).abs();
                if steep || !(0.1..0.9).contains(&part) {
                    continue;
                }
                let y = a[1] + part * (b[1] - a[1]);
                crossings += 1;
                for (right, down) in [(1e-5, 2e-5), (1e-5, -2e-5), (3e-5, 1e-5), (2e-5, -3e-5)] {
                    let (pixel, dir) = seen_at(&prepared, [border + right, y + down]);
                    let Some((rate, divergence)) = rate(&prepared, pixel, dir, c) else { continue };
                    largest = largest.max(divergence.abs() / c.length());
                    let camera = world.camera.pinhole();
                    let coordinate = camera.right.dot(dir) / camera.forward.dot(dir);
                    let across = (camera.right - camera.forward * coordinate).normalize();
                    assert!(rate.dot(across).abs() < 1e-5, "{rate:?}");
                }
            }
        }
    }
    assert!(crossings > 5 && largest < 100.0, "{crossings} {largest}");
}

/// A slab above a floor, whose outline and whose shadows by a bulb and by the sun are in the same pixels.
fn over_a_floor() -> Prepared {
    let grey = || diffuse(0.6, 0.5, 0.4);
    let slab = placed(procedural::cube(), vec3(0.5, 0.2, 0.4), 0.5, vec3(0.1, -0.75, 0.2));
    let bulb = Emitter::Point { position: vec3(-0.3, 2.3, 0.4), intensity: Rgb::ONE };
    let sun = Emitter::Directional { direction: vec3(0.3, -1.0, -0.3), irradiance: Rgb::ONE };
    let scene = SceneBuilder::new()
        .shape("floor", ShapeBuilder::new(floor(), grey()))
        .shape("slab", ShapeBuilder::new(slab, grey()))
        .emitter("bulb", bulb)
        .emitter("sun", sun);
    let place = [vec3(0.3, 0.6, 3.5), vec3(0.0, -0.9, 0.0)];
    let scene = seen_through(FilterKind::BOX, scene, place);
    let motion = parameter("slab", 0.0, alloc::vec![moves("slab", shift())]);
    prepare_lit(EstimatorKind::Warped, EmitterMask::Delta, &scene, &motion, 2).0
}

/// Where the weight of shadows ends, rays have the rate that they have without.
#[test]
fn shadows_join_what_is_beside_none() {
    let prepared = over_a_floor();
    let mut rng = Rng::new(6, 0, 0);
    let [mut joined, mut compared] = [0; 2];
    for k in 0..20_000 {
        let corner = [rng.next_2d(), rng.next_2d()];
        let at: [f64; 2] = from_fn(|i| (corner[0][i] * f64::from(FILM[i])).floor());
        let point = |part: [f64; 2]| from_fn(|i| at[i] + part[i]);
        let c = vec3(rng.next_f64(), rng.next_f64(), rng.next_f64()) - Vec3::splat(0.5);
        let beside = |(pixel, dir)| rate_beside_shadows(&prepared, pixel, dir, c, k % 2);
        let [mut some, mut none] = [corner[1], rng.next_2d()];
        if let Some((_, divergence)) = beside(seen_at(&prepared, point(some))) {
            let (pixel, dir) = seen_at(&prepared, point(some));
            let rate = |dir| Some(beside((pixel, dir))?.0);
            if let Some(near) = differences(dir, rate) {
                compared += 1;
                let scale = 1.0 + divergence.abs();
                assert!((divergence - near).abs() < 1e-2 * scale, "{divergence} {near}");
            }
        } else {
            (some, none) = (none, some);
        }
        let is_beside = |part| beside(seen_at(&prepared, point(part))).is_some();
        if !is_beside(some) || is_beside(none) {
            continue;
        }
        for _ in 0..40 {
            let half = from_fn(|i| 0.5 * (some[i] + none[i]));
            *(if is_beside(half) { &mut some } else { &mut none }) = half;
        }
        let Some((own, _)) = beside(seen_at(&prepared, point(some))) else { continue };
        let (pixel, dir) = seen_at(&prepared, point(none));
        let without = rate(&prepared, pixel, dir, c).unwrap_or_default().0;
        // Outlines are where rates may differ along them, and there shadows end, too.
        let ends = [some, none].map(|part| {
            let (pixel, dir) = seen_at(&prepared, point(part));
            asked(&prepared, pixel, dir, |_, ray| ray.end.map(|s| s.shape))
        });
        if ends[0] != ends[1] || without.length() < 1e-2 {
            continue;
        }
        joined += 1;
        let off = (own - without).length();
        assert!(off < 1e-3 * without.length(), "{own:?} {without:?}");
    }
    assert!(joined > 20 && compared > 1000, "{joined} {compared}");
}

/// A card out of view, whose edge casts a shadow on a floor exactly along the border between two columns of pixels.
fn shadow_along_a_border() -> Scene {
    let grey = || diffuse(0.6, 0.5, 0.4);
    let up = Mat3::rotation(Vec3::X, -core::f64::consts::FRAC_PI_2) * 0.5;
    let card = Affine { linear: up, translation: vec3(-0.5, 1.5, 0.0) };
    let card = procedural::rectangle().transform(&card);
    let bulb = Emitter::Point { position: vec3(0.0, 3.0, 0.1), intensity: Rgb::splat(9.0) };
    let scene = SceneBuilder::new()
        .shape("floor", ShapeBuilder::new(floor(), grey()))
        .shape("card", ShapeBuilder::new(card, grey()))
        .emitter("bulb", bulb);
    seen_through(FilterKind::BOX, scene, [vec3(0.0, 0.6, 4.5), vec3(0.0, -1.0, 0.0)])
}

/// What moves from one pixel into the next is all that moves.
#[test]
fn shadows_may_lie_along_borders() {
    let motion = parameter("card", 0.0, alloc::vec![moves("card", shift())]);
    let by = |kind| prepare_lit(kind, EmitterMask::Delta, &shadow_along_a_border(), &motion, 2);
    let sum = Sum { samples: 1024, ..LIGHT };
    let reference = derivative(sum, &by(EstimatorKind::PathSpace));
    let (errors, part) = derivative(sum, &by(EstimatorKind::Warped)).off(&reference);
    assert!(errors.abs() < 4.0 && part < 0.03, "{errors} standard errors of {part}");
}
