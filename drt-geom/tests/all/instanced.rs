//! Instances against copies of their triangles.

use std::sync::Arc;

use crate::common::{direction, inside_triangle, point, soup};
use drt_geom::{
    BvhError, Hit, InstancePlacement, InstancedBvh, Ray, Skip, TriangleBvh, procedural,
};
use drt_math::{Affine, Mat3, Rng, Vec3, vec3};

/// A rotation, a scale along each axis, perhaps a reflection, and a place.
fn map(rng: &mut Rng, reach: f64) -> Affine {
    let scale = vec3(1.0 + rng.next_f64(), 0.5 + rng.next_f64(), 0.3 + rng.next_f64());
    let mirrored = if rng.next_f64() < 0.5 { -1.0 } else { 1.0 };
    let linear = Mat3::rotation(direction(rng), 3.0 * rng.next_f64())
        * Mat3::diagonal(vec3(scale.x * mirrored, scale.y, scale.z));
    Affine { linear, translation: point(rng) * reach }
}

/// Two levels, and one over copies with the same numbers.
fn both(seed: u64, count: usize, reach: f64) -> (InstancedBvh, TriangleBvh, Vec<[Vec3; 3]>) {
    let mut rng = Rng::new(seed, 0, 0);
    let own = soup(20, 0.5, seed);
    let meshes = [soup(30, 0.4, seed + 1), soup(7, 0.8, seed + 2), Vec::new()];
    let trees = meshes.clone().map(|m| Arc::new(TriangleBvh::build(&m).unwrap()));
    let mut copies = own.clone();
    let placements: Vec<_> = (0..count)
        .map(|i| {
            let to_world = map(&mut rng, reach);
            copies.extend(meshes[i % 3].iter().map(|t| t.map(|p| to_world.point(p))));
            InstancePlacement { tree: trees[i % 3].clone(), to_world }
        })
        .collect();
    let triangles = TriangleBvh::build(&own).unwrap();
    let flat = TriangleBvh::build(&copies).unwrap();
    (InstancedBvh::new(triangles, placements).unwrap(), flat, copies)
}

fn close(a: &Hit, b: &Hit) -> bool {
    let bary = (a.bary[0] - b.bary[0]).abs().max((a.bary[1] - b.bary[1]).abs());
    a.prim == b.prim && (a.t - b.t).abs() < 1e-9 * b.t && bary < 1e-9
}

#[test]
fn instances_are_what_their_copies_are() {
    let mut found = 0;
    for (seed, count) in [(1, 0), (2, 1), (3, 12), (4, 60)] {
        let (two, flat, copies) = both(seed, count, 3.0);
        assert!(copies.iter().flatten().all(|p| two.bounds().contains(*p)));
        let mut rng = Rng::new(seed, 1, 0);
        let (mut a, mut b) = (Vec::new(), Vec::new());
        for i in 0..2000 {
            let t_max = if i % 3 == 0 { 2.0 * rng.next_f64() } else { f64::INFINITY };
            let origin = point(&mut rng) * 5.0;
            let ray = Ray { origin, dir: point(&mut rng) * 2.0 - origin, t_max };
            let odd = |prim: u32| prim % 2 == 1;
            let same = |x: Option<Hit>, y: Option<Hit>| match (x, y) {
                (Some(x), Some(y)) => close(&x, &y),
                (None, None) => true,
                _ => false,
            };
            let all = |x: &[Hit], y: &[Hit]| {
                x.len() == y.len() && x.iter().zip(y).all(|(x, y)| close(x, y))
            };
            let first = flat.closest(&ray, Skip::NOTHING);
            assert!(same(two.closest(&ray, Skip::NOTHING), first), "{ray:?}");
            found += usize::from(first.is_some());
            let skip = first.map_or(Skip::NOTHING, |h| Skip::one(h.prim));
            assert!(same(two.closest(&ray, skip), flat.closest(&ray, skip)), "{ray:?}");
            assert_eq!(two.any(&ray, skip, odd), flat.any(&ray, skip, odd));
            let (x, y) = (
                two.closest_through(&ray, skip, odd, &mut a),
                flat.closest_through(&ray, skip, odd, &mut b),
            );
            assert!(same(x, y) && all(&a, &b), "{ray:?}");
            for blocks in [&|_: u32| false, &odd as &dyn Fn(u32) -> bool] {
                let x = two.crossings(&ray, skip, blocks, &mut a);
                assert_eq!(x, flat.crossings(&ray, skip, blocks, &mut b));
                assert!(all(&a, &b), "{ray:?}");
            }
        }
    }
    assert!(found > 2000, "{found}");
}

/// Rays from the surface of a closed instance, outwards: rounding by the maps must not make them meet it.
#[test]
fn convex_instances_do_not_shadow_themselves() {
    let mut rng = Rng::new(6, 0, 0);
    let mesh = procedural::icosphere(2);
    let tree = Arc::new(TriangleBvh::of(&mesh).unwrap());
    let none = TriangleBvh::build(&[]).unwrap();
    for reach in [0.0, 10.0, 1e4] {
        let to_world = map(&mut rng, reach);
        let placed = InstancePlacement { tree: tree.clone(), to_world };
        let two = InstancedBvh::new(none.clone(), [placed]).unwrap();
        for i in 0..4000 {
            let prim = (rng.next_f64() * mesh.triangles.len() as f64) as u32;
            // On edges and at corners, too.
            let [u, v] = match i % 4 {
                0 => [0.0, rng.next_f64()],
                1 => [0.0, 1.0],
                _ => inside_triangle(&mut rng),
            };
            let [a, b, c] = mesh.triangle(prim).map(|p| to_world.point(p));
            let x = a * (1.0 - u - v) + b * u + c * v;
            let outward = (x - to_world.translation).normalize();
            let dir = (outward + direction(&mut rng) * 0.3).normalize();
            let ray = Ray::new(x, dir);
            assert!(two.closest(&ray, Skip::one(prim)).is_none(), "{reach} {i}");
            assert!(!two.any(&ray, Skip::one(prim), |_| true), "{reach} {i}");
        }
    }
}

#[test]
fn what_cannot_be_placed_is_refused() {
    let tree = Arc::new(TriangleBvh::of(&procedural::cube()).unwrap());
    let none = TriangleBvh::build(&[]).unwrap();
    let flat = Mat3::diagonal(vec3(1.0, 0.0, 1.0));
    for linear in [flat, Mat3::IDENTITY * f64::NAN, Mat3::IDENTITY * 1e101] {
        let good = InstancePlacement { tree: tree.clone(), to_world: Affine::IDENTITY };
        let bad =
            InstancePlacement { to_world: Affine { linear, ..Affine::IDENTITY }, ..good.clone() };
        let error = InstancedBvh::new(none.clone(), [good, bad]).unwrap_err();
        assert_eq!(error, BvhError::BadInstance { instance: 1 });
    }
}
