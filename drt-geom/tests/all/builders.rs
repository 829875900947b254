//! Trees by `obvhs` against those by our own builder: the same hits, bit for bit, on every mesh at
//! hand, and on the input that is known to trouble `obvhs`.

use crate::common::{direction, inside_triangle, point, soup};
use drt_geom::procedural::{self, BranchingTree, TorusKnot};
use drt_geom::{BvhBuilder, BvhError, Hit, Mesh, Ray, Skip, TriangleBvh};
use drt_math::{Rng, Vec3, vec3};

fn trees(triangles: &[[Vec3; 3]]) -> [TriangleBvh; 2] {
    [BvhBuilder::Obvhs, BvhBuilder::Binned].map(|b| TriangleBvh::build_by(b, triangles).unwrap())
}

/// The hits along the ray, of which every query tells the same of both trees.
fn hits([a, b]: &[TriangleBvh; 2], ray: &Ray) -> Vec<Hit> {
    let nothing = Skip::NOTHING;
    let (mut hits, mut others) = (Vec::new(), Vec::new());
    a.crossings(ray, nothing, |_| false, &mut hits);
    b.crossings(ray, nothing, |_| false, &mut others);
    assert_eq!(hits, others, "{ray:?}");
    for tree in [a, b] {
        assert_eq!(tree.closest(ray, nothing), hits.first().copied(), "{ray:?}");
        assert_eq!(tree.any(ray, nothing, |_| true), !hits.is_empty(), "{ray:?}");
    }
    assert_eq!(a.closest_point(ray.origin), b.closest_point(ray.origin), "{ray:?}");
    hits
}

/// A ray of one of several kinds through the mesh or past it.
fn ray(kind: usize, triangles: &[[Vec3; 3]], scene: &TriangleBvh, rng: &mut Rng) -> Ray {
    let (center, half) = (scene.bounds().center(), 0.5 * scene.bounds().extent().max_abs());
    let [a, b, c] = triangles[rng.next_u32() as usize % triangles.len()];
    let on_surface = {
        let [u, v] = inside_triangle(rng);
        a * (1.0 - u - v) + b * u + c * v
    };
    let near = on_surface + direction(rng) * (half * 10.0_f64.powi(-(kind as i32) - 3));
    let axis = kind % 3;
    let mut along = [[0.0, -0.0, 1e-20, -1e-8][rng.next_u32() as usize % 4]; 3];
    along[axis] = if rng.next_u32().is_multiple_of(2) { 1.0 } else { -1.0 };
    let along = Vec3::from(along);
    match kind % 9 {
        0 => Ray::segment(center + point(rng) * half, center + point(rng) * half),
        1 => Ray::new(center + point(rng) * half, direction(rng)),
        2 => Ray::new(near, direction(rng)),
        3 => Ray::new(near, (on_surface - near) * 1e6),
        // Through edges and corners, near and from afar.
        4 => Ray::new(center + point(rng) * (2.0 * half), a - center),
        5 => Ray::segment(center + direction(rng) * (1e4 * half), a.lerp(b, rng.next_f64())),
        // Along axes.
        6 => Ray::new(on_surface - along * (100.0 * half), along),
        7 => Ray::new(a - along * half, along),
        _ => Ray::new(near, along * 1e-9),
    }
}

/// How many hits of how many rays.
fn agree(name: &str, mesh: &Mesh, rays: usize) {
    let triangles = mesh.soup();
    let trees = trees(&triangles);
    let mut rng = Rng::new(1, 0, 0);
    let found: usize =
        (0..rays).map(|i| hits(&trees, &ray(i, &triangles, &trees[0], &mut rng)).len()).sum();
    assert!(found > rays / 20, "{name}: {found} hits of {rays} rays");
}

#[test]
fn the_same_hits_on_every_shape() {
    let knot = TorusKnot { segments: 160, sides: 14, tube: 0.22, ..TorusKnot::default() };
    let tree = BranchingTree { seed: 5, sides: 6, ..BranchingTree::default() };
    let shapes = [
        ("rectangle", procedural::rectangle()),
        ("grid", procedural::grid(50, 40)),
        ("disk", procedural::disk(3000)),
        ("star", procedural::star(7, 0.4, 1.0)),
        ("cube", procedural::cube()),
        ("icosphere", procedural::icosphere(4)),
        ("uv sphere", procedural::uv_sphere(60)),
        ("bumpy sphere", procedural::bumpy_sphere(4, 0.35, 4.0)),
        ("torus knot", procedural::torus_knot(&knot)),
        ("branching tree", procedural::branching_tree(&tree)),
    ];
    for (name, mesh) in shapes {
        agree(name, &mesh, 4_000);
    }
}

#[cfg(feature = "obj")]
fn agree_on_files(folder: &std::path::Path, rays: usize) {
    let mut count = 0;
    for entry in std::fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.extension().is_some_and(|e| e == "obj") {
            let name = path.display().to_string();
            let mesh = drt_geom::read_obj(&path).unwrap();
            agree(&name, &mesh, rays);
            count += 1;
        }
    }
    assert!(count > 0, "{}: no meshes", folder.display());
}

#[cfg(feature = "obj")]
#[test]
fn the_same_hits_on_the_meshes_of_the_examples() {
    agree_on_files(concat!(env!("CARGO_MANIFEST_DIR"), "/../examples/meshes").as_ref(), 4_000);
}

/// `DRT_MESHES=FOLDER cargo test --release -p drt-geom --features obj --test all -- --ignored builders::`
#[cfg(feature = "obj")]
#[test]
#[ignore = "long, and the meshes are not in the repository"]
fn the_same_hits_on_meshes_of_a_folder() {
    let folder = std::env::var("DRT_MESHES").expect("DRT_MESHES names a folder of OBJ files");
    agree_on_files(folder.as_ref(), 300_000);
}

/// Size, place and length of direction.
const SETTINGS: [(f64, f64, f64); 6] = [
    (1.0, 0.0, 1.0),
    (1e-4, 0.0, 1.0),
    (1e-9, 0.0, 1e6),
    (1.0, 0.0, 1e6),
    (1.0, 1e3, 1.0),
    (1e5, 1e9, 1e-6),
];

#[test]
fn nothing_near_the_start_is_lost() {
    for (size, place, speed) in SETTINGS {
        let at = |p: Vec3| p * size + vec3(1.0, -0.5, 0.25) * place;
        let plane: Vec<_> = procedural::grid(40, 40).soup().iter().map(|t| t.map(at)).collect();
        let (trees, z) = (trees(&plane), at(Vec3::ZERO).z);
        let mut rng = Rng::new(2, 0, 0);
        for i in 0..3_000 {
            let p = point(&mut rng) * 0.8;
            let from = at(vec3(p.x, p.y, 10.0_f64.powi(-(i % 9))));
            let ray = Ray::new(from, vec3(0.1 * p.y, -0.1 * p.x, -1.0) * speed);
            let found = hits(&trees, &ray);
            // What is above the plane after rounding crosses it once.
            assert_eq!(found.len(), usize::from(from.z > z), "{ray:?}");
        }
    }
}

#[test]
fn nothing_is_lost_along_axes() {
    for (size, place, speed) in SETTINGS {
        let at = |p: Vec3| p * size + vec3(1.0, -0.5, 0.25) * place;
        let ball: Vec<_> = procedural::icosphere(4).soup().iter().map(|t| t.map(at)).collect();
        let trees = trees(&ball);
        let mut rng = Rng::new(3, 0, 0);
        for i in 0..3_000 {
            let axis = i % 3;
            let mut dir = [[0.0, -0.0, 1e-8, -1e-20, 1e-300][rng.next_u32() as usize % 5]; 3];
            dir[axis] = if i % 2 == 0 { 1.0 } else { -1.0 };
            let dir = Vec3::from(dir);
            let p = point(&mut rng) * 0.5;
            let inside = hits(&trees, &Ray::new(at(p), dir * speed));
            assert_eq!(inside.len(), 1, "{p:?} {dir:?}");
            let across = hits(&trees, &Ray::new(at(p - dir * 100.0), dir * speed));
            assert_eq!(across.len(), 2, "{p:?} {dir:?}");
        }
    }
}

/// Each takes half a minute where time is quadratic.
#[test]
fn coincident_and_stacked_triangles_are_built_fast() {
    const COUNT: usize = 30_000;
    let diagonal = |f: f64| [Vec3::splat(-1.0), Vec3::splat(1.0), vec3(0.9 - f, f - 0.9, f - 0.5)];
    let number = |i: usize| (i + 1) as f64 / COUNT as f64;
    let plate = vec3(1.0, -1.0, 0.0);
    let scenes: [(&str, Vec<_>); 4] = [
        ("the same triangle", vec![[Vec3::X, Vec3::Y, Vec3::Z]; COUNT]),
        ("different triangles of one box", (0..COUNT).map(number).map(diagonal).collect()),
        (
            "concentric",
            (0..COUNT)
                .map(|i| [Vec3::splat(-1.0), plate, Vec3::splat(1.0)].map(|v| v * number(i)))
                .collect(),
        ),
        (
            "stacked",
            (0..COUNT)
                .map(|i| [-plate, plate, vec3(1.0, 1.0, 0.0)].map(|v| v + Vec3::Z * number(i)))
                .collect(),
        ),
    ];
    for (name, triangles) in scenes {
        let trees = trees(&triangles);
        let mut rng = Rng::new(4, 0, 0);
        let rays = (0..20).map(|i| ray(i, &triangles, &trees[0], &mut rng));
        let found: usize = rays.map(|ray| hits(&trees, &ray).len()).sum();
        assert!(found > 0, "{name}");
    }
}

#[test]
fn scenes_of_a_few_triangles() {
    for count in 0..40 {
        let mut triangles = soup(count, 0.5, count as u64);
        // Points and repetitions have no leaf of their own.
        if count % 3 == 1 {
            triangles.push([Vec3::X; 3]);
            triangles.push(triangles[0]);
        }
        let trees = trees(&triangles);
        let mut rng = Rng::new(5, 0, 0);
        for _ in 0..300 {
            hits(&trees, &Ray::new(point(&mut rng), direction(&mut rng)));
        }
    }
}

#[test]
fn what_cannot_be_built_is_refused() {
    for bad in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY, 1e101] {
        let mut triangles = soup(5, 0.5, 1);
        triangles[3][2].y = bad;
        for builder in [BvhBuilder::Obvhs, BvhBuilder::Binned] {
            let error = TriangleBvh::build_by(builder, &triangles).unwrap_err();
            assert_eq!(error, BvhError::BadCoordinate { prim: 3 });
        }
    }
    // What is just small enough is built.
    let large: Vec<_> = soup(3_000, 0.5, 1).iter().map(|t| t.map(|v| v * 6e99)).collect();
    let trees = trees(&large);
    let mut rng = Rng::new(6, 0, 0);
    for i in 0..300 {
        hits(&trees, &ray(i, &large, &trees[0], &mut rng));
    }
}
