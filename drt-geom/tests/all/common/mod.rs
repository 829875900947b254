//! Random points and soups, and queries without a tree.

pub(crate) mod tets;

use drt_geom::{Hit, Ray, Skip, TriangleBvh};
use drt_math::{Rng, Vec3, vec3};

/// A point of the cube [-1, 1]³.
pub(crate) fn point(rng: &mut Rng) -> Vec3 {
    vec3(rng.next_f64(), rng.next_f64(), rng.next_f64()) * 2.0 - Vec3::splat(1.0)
}

/// A uniform direction.
pub(crate) fn direction(rng: &mut Rng) -> Vec3 {
    loop {
        let p = point(rng);
        if p.length() <= 1.0 {
            return p.normalize();
        }
    }
}

/// Weights of vertices 1 and 2 of a uniform point of a triangle.
pub(crate) fn inside_triangle(rng: &mut Rng) -> [f64; 2] {
    let [u, v] = rng.next_2d();
    let r = u.sqrt();
    [r * (1.0 - v), r * v]
}

/// Triangles of the given size, centred in [-1, 1]³.
pub(crate) fn soup(n: usize, size: f64, seed: u64) -> Vec<[Vec3; 3]> {
    let mut rng = Rng::new(seed, 0, 0);
    let triangle = |_| {
        let c = point(&mut rng);
        [0; 3].map(|_| c + point(&mut rng) * size)
    };
    (0..n).map(triangle).collect()
}

/// The same queries, asked of each triangle alone.
pub(crate) struct BruteForce(Vec<TriangleBvh>);

impl BruteForce {
    pub(crate) fn new(triangles: &[[Vec3; 3]]) -> Self {
        Self(triangles.iter().map(|t| TriangleBvh::build(&[*t]).unwrap().portable()).collect())
    }

    /// All hits, sorted as `crossings` sorts them.
    pub(crate) fn all(&self, ray: &Ray) -> Vec<Hit> {
        let mut hits: Vec<Hit> = (0..)
            .zip(&self.0)
            .filter_map(|(prim, b)| Some(Hit { prim, ..b.closest(ray, Skip::NOTHING)? }))
            .collect();
        hits.sort_by(|a, b| a.t.total_cmp(&b.t).then(a.prim.cmp(&b.prim)));
        hits
    }
}
