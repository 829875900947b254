//! Derivatives of chains are those of differences.

use drt_math::{Rng, vec3};

use super::*;

fn next(rng: &mut Rng) -> Vec3 {
    vec3(rng.next_f64() - 0.5, rng.next_f64() - 0.5, rng.next_f64() - 0.5)
}

/// A mirror, an interface and a surface that light goes straight through, each about across the z axis, at places that a ray along
/// it meets one after the other. In place of the mirror a surface may be connected to a lamp, which may be at infinity.
fn chain(rng: &mut Rng, interpolated: bool, lamp: Option<bool>) -> Vec<Link> {
    let bends = [Bend::refraction(1.5, 1.0), Bend::Straight, Bend::reflection(0.8, 1.0)];
    let link = |(i, bend): (u32, Bend)| {
        let place = Vec3::Z * f64::from(i + 1);
        let corners = [vec3(-2.0, -2.0, 0.0), vec3(3.0, -1.0, 0.2), vec3(-1.0, 3.0, -0.2)];
        let corners = corners.map(|c| c + place + next(rng) * 0.3);
        let [a, b, c] = corners;
        let ng = (b - a).cross(c - a).normalize();
        let normals = corners.map(|_| (ng + next(rng) * 0.3).normalize());
        let point = SurfacePoint { prim: 0, shape: i, triangle: 0, bary: [0.3; 2], ng, ns: ng };
        let (normals, onward) = (interpolated.then_some(normals), Onward::Bent(bend));
        Link { point, corners, normals, onward, bsdf: i as usize }
    };
    let mut links: Vec<Link> = (0..).zip(bends).map(link).collect();
    if let Some(at_infinity) = lamp {
        let place = if at_infinity { vec3(0.6, 0.0, 0.8) } else { vec3(0.4, 0.3, 2.0) };
        links[2].onward = Onward::To(Lamp { place, at_infinity, moves: true });
        links[2].normals = None;
    }
    links
}

/// A ray's origin and direction, and the squared cosine beyond the last surface.
type Traced = [Vec3; 3];

fn traced(start: Vec3, frame: &Frame, u: [f64; 2], links: &[Link]) -> Traced {
    let ray = Ray::starting(start, direction(frame, u));
    let ray = links.iter().fold(ray, |ray, link| link.pass(ray, &link.triangle()));
    [ray.x, ray.w, Vec3::X * ray.beyond]
}

fn rate(of: &RayVelocity) -> Traced {
    [of.x.re(), of.w.re(), Vec3::X * of.beyond.re]
}

/// How fast a rate changes along a coordinate of u.
fn rate_along(of: &RayVelocity, k: usize) -> Traced {
    let along = |v: Vec3<ByU>| -> Vec3 { v.to_array().map(|c| c.eps[k]).into() };
    [along(of.x), along(of.w), Vec3::X * of.beyond.eps[k]]
}

fn apart(a: Traced, b: Traced, h: f64) -> Traced {
    from_fn(|i| (a[i] - b[i]) / h)
}

fn assert_same(found: Traced, expected: Traced, what: &str) {
    for (f, e) in found.into_iter().zip(expected) {
        assert!((f - e).max_abs() < 1e-5 * (1.0 + e.max_abs()), "{what}: {f:?} {e:?}");
    }
}

fn all_changes(_: &SurfacePoint) -> LinkChange {
    LinkChange { moves: true, bends: true }
}

const H: f64 = 1e-4;

const LAMPS: [Option<bool>; 3] = [None, Some(false), Some(true)];

/// Derivatives by u are differences, and so are those of derivatives.
#[test]
fn derivatives_are_differences() {
    let mut rng = Rng::new(5, 0, 0);
    for round in 0..20 {
        let links = chain(&mut rng, round % 2 == 0, LAMPS[round % 3]);
        let start = next(&mut rng) * 0.5 - Vec3::Z;
        let frame = Frame::from_normal((Vec3::Z + next(&mut rng) * 0.2).normalize());
        let rays = rays_by_u(start, &frame, &links);
        let ray = rays.last().unwrap();
        for k in 0..2 {
            let at = |h: f64| {
                let mut u = [0.0; 2];
                u[k] = h;
                traced(start, &frame, u, &links)
            };
            let expected = apart(at(H), at(-H), 2.0 * H);
            assert_same(rate(&ray.by_u[k]), expected, "by u");
            let value = RayVelocity { x: ray.x, w: ray.w, beyond: ray.beyond };
            assert_same(rate_along(&value, k), expected, "by u");
            let [plus, zero, minus] = [at(H), at(0.0), at(-H)];
            let second = from_fn(|i| (plus[i] + minus[i] - zero[i] * 2.0) / (H * H));
            assert_same(rate_along(&ray.by_u[k], k), second, "by u twice");
        }
        // Evened derivatives are the same where nothing is interpolated.
        if round % 2 == 1 {
            let slopes = alloc::vec![None; links.len()];
            let all = evened(start, true, &frame, &links, &rays, &slopes, all_changes);
            let even = all.last().unwrap();
            let exact = ray_by_movers(start, true, &frame, &links, all_changes);
            assert_eq!(even.by_movers.len(), exact.len());
            for (a, b) in even.by_movers.iter().zip(&exact) {
                for (a, b) in a.axes.iter().zip(&b.axes) {
                    assert_same(rate(a), rate(b), "evened");
                    assert_same(rate_along(a, 0), rate_along(b, 0), "evened");
                }
            }
        }
    }
}

/// Rates by what moves are differences.
#[test]
fn rates_are_differences() {
    let mut rng = Rng::new(6, 0, 0);
    for round in 0..10 {
        let links = chain(&mut rng, round % 2 == 0, LAMPS[round % 3]);
        let start = next(&mut rng) * 0.5 - Vec3::Z;
        let frame = Frame::from_normal((Vec3::Z + next(&mut rng) * 0.2).normalize());
        let found = ray_by_movers(start, true, &frame, &links, |s| LinkChange {
            moves: s.shape != 1,
            bends: true,
        });
        for RayByMover { mover, axes } in found {
            for (found, axis) in axes.iter().zip(AXES) {
                let at = |h: f64| {
                    let (mut links, mut start) = (links.clone(), start);
                    let corner =
                        |bary: [f64; 2]| CORNERS.iter().position(|corner| *corner == bary).unwrap();
                    match mover {
                        Mover::Viewer => start += axis * h,
                        Mover::Place(EdgeMatter { point, .. }) => {
                            links[point.shape as usize].corners[corner(point.at.bary)] += axis * h;
                        }
                        Mover::Index(shape) => {
                            if let Onward::Bent(Bend::Refraction(index) | Bend::Inside(index)) =
                                &mut links[shape].onward
                            {
                                index.value += h * axis.x;
                            }
                        }
                        Mover::Lamp => {
                            if let Onward::To(lamp) = &mut links[2].onward {
                                lamp.place += axis * h;
                            }
                        }
                        Mover::Normal(point) => {
                            let link = &mut links[point.shape as usize];
                            link.normals.as_mut().unwrap()[corner(point.at.bary)] += axis * h;
                        }
                    }
                    traced(start, &frame, [0.0; 2], &links)
                };
                let expected = apart(at(H), at(-H), 2.0 * H);
                assert_same(rate(found), expected, "by what moves");
            }
        }
    }
}
