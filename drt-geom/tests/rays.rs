//! Ray queries against brute force.

use drt_geom::procedural::icosphere;
use drt_geom::{Hit, Ray, Skip, TriangleBvh};
use drt_math::{Rng, Vec3, vec3};

fn point(rng: &mut Rng) -> Vec3 {
    vec3(rng.next_f64(), rng.next_f64(), rng.next_f64()) * 2.0 - vec3(1.0, 1.0, 1.0)
}

fn soup(n: usize, size: f64, seed: u64) -> Vec<[Vec3; 3]> {
    let mut rng = Rng::new(seed, 0, 0);
    (0..n)
        .map(|_| {
            let c = point(&mut rng);
            [0; 3].map(|_| c + point(&mut rng) * size)
        })
        .collect()
}

#[test]
fn smoke() {
    let m = icosphere(3);
    let bvh = TriangleBvh::of(&m).unwrap();
    let ray = Ray::new(vec3(0.1, 0.2, -3.0), Vec3::Z);
    let mut hits = Vec::<Hit>::new();
    assert!(!bvh.crossings(&ray, Skip::NOTHING, |_| false, &mut hits));
    assert_eq!(hits.len(), 2);
    assert_eq!(bvh.closest(&ray, Skip::NOTHING), Some(hits[0]));
    assert!(bvh.inside(Vec3::ZERO) && !bvh.inside(vec3(0.9, 0.9, 0.9)));
    assert_eq!(bvh.winding_number(vec3(0.3, 0.2, 0.1)), 1);
    assert!(TriangleBvh::build(&soup(100, 0.1, 1)).is_ok());
}
