//! Rates that follow edges and borders across alone.

use super::levels::before;
use super::*;
use crate::derivative::tests::scenes::FILM;
use crate::model::filter::FilterKind;
use crate::sampling::record::CameraRay;

/// The rate of a ray of the camera of which all that is beside it moves by `c`, and its divergence.
fn rate(prepared: &Prepared, pixel: [u32; 2], dir: Vec3, c: Vec3) -> Option<(Vec3, f64)> {
    let world = &prepared.world;
    let eye = world.eye_at(world.camera.position());
    let mut ray = crate::world::RayPath::default();
    world.cast(&eye, dir, &mut ray, &mut Default::default());
    let end = ray.end.as_ref().map(|(point, _)| point);
    let ray = TurningRay {
        viewer: &eye,
        moves: false,
        of_camera: Some(CameraRay { pixel, lens: [0.0; 2] }),
        dir,
        distance: ray.length,
        end,
        emission_alone: false,
        tangent_plane: None,
    };
    let (mut parts, mut probe) = (Vec::new(), Probe::new(Rng::new(0, 0, 0)));
    prepared.terms.velocity.turn(world, &ray, &mut probe, &mut parts)?;
    let rate = parts.iter().fold(Vec3::ZERO, |sum, part| sum + part.rate * c);
    // What is along the ray turns nothing.
    let rate = rate.reject(dir);
    Some((rate, parts.iter().map(|part| part.divergence.dot(c)).sum()))
}

fn everything_moves(filter: FilterKind) -> Prepared {
    let targets = ["ball", "cube"].map(|name| moves(name, shift())).to_vec();
    let motion = parameter("all", 0.0, targets);
    let lit = EmitterMask::Extended;
    prepare_lit(EstimatorKind::Warped, lit, &before(filter, false), &motion, 2).0
}

/// The pixel of an image point, and the direction in which that is seen.
fn seen_at(prepared: &Prepared, point: [f64; 2]) -> ([u32; 2], Vec3) {
    let dir = prepared.world.camera.ray(point).dir;
    (point.map(|x| x as u32), dir)
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
            let frame = drt_math::Frame::from_normal(dir);
            let differences = [1e-6, 2e-6].map(|h| {
                let along = |t: Vec3| {
                    let at = |h: f64| rate(&prepared, pixel, (dir + t * h).normalize(), c);
                    Some((at(h)?.0.dot(t) - at(-h)?.0.dot(t)) / (2.0 * h))
                };
                Some(along(frame.s)? + along(frame.t)?)
            });
            let [Some(near), Some(far)] = differences else { continue };
            // Not across kinks, nor where steps are too long.
            if (near - far).abs() > 1e-3 * (1.0 + near.abs()) {
                continue;
            }
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
