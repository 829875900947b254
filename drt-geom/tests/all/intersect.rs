//! Rates of change of a hit: duals against the closed form, and against the tree's hits.

use crate::common::{point, soup};
use drt_geom::{Ray, Skip, TriangleBvh, ray_plane};
use drt_math::{Dual, Rng, Vec3, vec3};

type D = Dual<f64, 1>;

fn moving(p: Vec3, velocity: Vec3) -> Vec3<D> {
    let d = |x, v| D::new(x, [v]);
    vec3(d(p.x, velocity.x), d(p.y, velocity.y), d(p.z, velocity.z))
}

/// The rate of the distance D from x along -w to a plane through a point moving with u0 (W the rates
/// of x and w): n . (x' - D w' - u0) / (n . w), and x0' = x' - D' w - D w'.
#[test]
fn the_rate_of_the_distance_has_its_closed_form() {
    let mut rng = Rng::new(1, 0, 0);
    let mut checked = 0;
    while checked < 2_000 {
        let triangle = [0; 3].map(|_| point(&mut rng));
        let velocity = [0; 3].map(|_| point(&mut rng));
        let (x, w) = (point(&mut rng) * 3.0, point(&mut rng));
        let (xd, wd) = (point(&mut rng), point(&mut rng));
        let n = (triangle[1] - triangle[0]).cross(triangle[2] - triangle[0]);
        if n.length() < 0.1 || n.normalize().dot(w).abs() < 0.05 {
            continue;
        }
        checked += 1;
        let corners = [0, 1, 2].map(|k| moving(triangle[k], velocity[k]));
        let (t, [b1, b2]) = ray_plane(moving(x, xd), moving(-w, -wd), corners);
        let [f1, f2] = [b1.re, b2.re];
        // Velocity of the material point that is hit.
        let u0 = velocity[0] * (1.0 - f1 - f2) + velocity[1] * f1 + velocity[2] * f2;
        let rate = n.dot(xd - wd * t.re - u0) / n.dot(w);
        let size = 1.0 + rate.abs();
        assert!((t.eps[0] - rate).abs() < 1e-10 * size * (1.0 + t.re.abs()), "{t:?} {rate}");
        // The same rate through the barycentric coordinates, whose point moves by x0'.
        let x0_rate = xd - w * rate - wd * t.re;
        let along =
            (triangle[1] - triangle[0]) * b1.eps[0] + (triangle[2] - triangle[0]) * b2.eps[0];
        let scale = 1.0 + x0_rate.length() + along.length();
        assert!((u0 + along - x0_rate).length() < 1e-9 * scale);
    }
}

#[test]
fn values_are_those_of_the_tree() {
    let triangles = soup(100, 0.7, 2);
    let bvh = TriangleBvh::build(&triangles).unwrap();
    let mut rng = Rng::new(3, 0, 0);
    let mut hits = 0;
    for _ in 0..5_000 {
        let ray = Ray::new(point(&mut rng) * 2.0, point(&mut rng));
        bvh.all(&ray, Skip::NOTHING, |hit| {
            hits += 1;
            let triangle = triangles[hit.prim as usize];
            let n = (triangle[1] - triangle[0]).cross(triangle[2] - triangle[0]);
            let [e1, e2] = [triangle[1] - triangle[0], triangle[2] - triangle[0]];
            // Both are exact to rounding times how grazing and how thin.
            let tolerance = 1e-14 * (1.0 + hit.t) * (e1.length() * e2.length() / n.length())
                / (n.normalize().dot(ray.dir.normalize()).abs());
            let (t, bary) = ray_plane(ray.origin, ray.dir, triangle);
            assert!((t - hit.t).abs() < tolerance * (1.0 + 1.0 / ray.dir.length()));
            for (ours, theirs) in bary.into_iter().zip(hit.bary) {
                let slack = tolerance * 10.0 / f64::min(e1.length(), e2.length());
                assert!((ours - theirs).abs() < slack);
            }
        });
    }
    assert!(hits > 2_000, "{hits}");
}
