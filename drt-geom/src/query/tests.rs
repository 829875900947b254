//! How much of a tree a ray sees, in scenes of very different sizes and distances.

use core::ops::ControlFlow;

use drt_math::{Ray, Rng, Vec3, vec3};

use super::lanes::Lanes;
use super::wide::Visitor;
use super::{BoxTree, Skip, TriangleBvh, Walk};
use crate::{Aabb, procedural};

/// Counts blocks that a walk comes to.
struct Count<'a>(&'a mut usize, f32);

impl Visitor for Count<'_> {
    fn announce<L: Lanes>(&self, _: L, _: usize) {}
    fn block<L: Lanes>(&mut self, _: L, _: usize) -> ControlFlow<(), f32> {
        *self.0 += 1;
        ControlFlow::Continue(self.1)
    }
}

/// A ball, and a small triangle at some distance in the direction of z.
fn scene(far: f64) -> alloc::vec::Vec<[Vec3; 3]> {
    let mut triangles = procedural::uv_sphere(24).soup();
    triangles.push([vec3(0.0, 0.0, far), vec3(0.1, 0.0, far), vec3(0.0, 0.1, far)]);
    triangles
}

fn rays() -> impl Iterator<Item = Ray> {
    let mut rng = Rng::new(3, 0, 0);
    (0..500).map(move |_| {
        let mut point = || Vec3::from([0; 3].map(|_| 3.0 * rng.next_f64() - 1.5));
        Ray::segment(point(), point())
    })
}

#[test]
fn what_is_far_away_costs_rays_nothing() {
    let blocks = |far: f64| {
        let bvh = TriangleBvh::build(&scene(far)).unwrap();
        let mut count = 0;
        for probe in rays().filter_map(|ray| bvh.probe(&ray, Skip::NOTHING)) {
            let visitor = Count(&mut count, probe.boxes.far);
            bvh.machine.run(Walk {
                tree: bvh.tree.as_ref().unwrap(),
                query: &probe.boxes,
                visitor,
            });
        }
        count
    };
    let near = blocks(4.0);
    for far in [1e3, 1e5, 1e6, 1e9] {
        let found = blocks(far);
        assert!(10 * found < 12 * near, "{found} blocks with a triangle at {far}, {near} at 4");
    }
}

#[test]
fn hits_beside_something_far_away_are_those_without_it() {
    let bvh = |far| TriangleBvh::build(&scene(far)).unwrap();
    let near = bvh(4.0);
    for far in [1e3, 1e6, 1e9, 1e20] {
        let far = bvh(far);
        for ray in rays() {
            assert_eq!(near.closest(&ray, Skip::NOTHING), far.closest(&ray, Skip::NOTHING));
            let at = ray.origin;
            assert_eq!(near.closest_point(at), far.closest_point(at));
        }
        // Rays that come from there, unless the ball is less than a rounding of the distance.
        if far.bounds().max.z > 1e12 {
            continue;
        }
        let from = vec3(0.3, 0.2, far.bounds().max.z);
        for ray in rays().map(|ray| Ray::segment(from, ray.origin.normalize() * 0.5)) {
            assert!(far.closest(&ray, Skip::NOTHING).is_some());
        }
    }
}

#[test]
fn boxes_beside_something_far_away_are_found_as_fast() {
    let count = |far: f64| {
        let z = move |i: u32| if i == 0 { far } else { 3.0 * f64::from(i) };
        let corners = |i: u32| [vec3(0.0, 0.0, z(i)), vec3(1.0, 1.0, z(i) + 1.0)];
        let bounds = Aabb::around((0..100).flat_map(corners));
        let boxes = BoxTree::build(&bounds, 100, corners).0;
        let mut found = 0;
        for i in 1..100 {
            let at = vec3(0.5, 0.5, 3.0 * f64::from(i) + 0.5);
            boxes.near(&Aabb::around([at, at]), |range| {
                found += range.len();
                ControlFlow::Continue(())
            });
        }
        found
    };
    let near = count(-3.0);
    for far in [1e4, 1e7] {
        let found = count(far);
        assert!(10 * found < 15 * near, "{found} at {far}, {near} near");
    }
}
