//! Tetrahedral meshes of every kind of trouble.

use drt_geom::{Aabb, TetMesh, procedural};
use drt_math::{Rng, Vec3, vec3};

use super::point;

/// The cube [-1, 1]³ with its inner vertices off the grid.
pub(crate) fn jittered(cells: u32, seed: u64) -> TetMesh {
    let bounds = Aabb { min: Vec3::splat(-1.0), max: Vec3::splat(1.0) };
    let mut mesh = procedural::tet_grid([cells; 3], &bounds);
    let mut rng = Rng::new(seed, 0, 0);
    for p in &mut mesh.positions {
        let shift = point(&mut rng) * (0.3 / f64::from(cells));
        for (k, s) in shift.to_array().into_iter().enumerate() {
            let inner = p[k].abs() < 1.0;
            let mut moved = p.to_array();
            moved[k] += if inner { s } else { 0.0 };
            *p = Vec3::from(moved);
        }
    }
    mesh
}

/// The same cube with a tenth of its tetrahedra cut in four, around a point so near to one of their
/// faces, edges or corners that slivers of the given aspect are among the four.
pub(crate) fn slivers(cells: u32, aspect: f64, seed: u64) -> TetMesh {
    let mut mesh = jittered(cells, seed);
    let mut rng = Rng::new(seed, 1, 0);
    for i in 0..mesh.tets.len() {
        if !rng.next_u32().is_multiple_of(10) {
            continue;
        }
        let corners = mesh.tets[i];
        let thin = 1.0 / aspect;
        let weights = match rng.next_u32() % 3 {
            0 => [thin, 0.3, 0.3, 0.4 - thin],
            1 => [thin, thin, 0.5, 0.5 - 2.0 * thin],
            _ => [thin, 2.0 * thin, thin, 1.0 - 4.0 * thin],
        };
        let turn = rng.next_u32() as usize;
        let weights = [0, 1, 2, 3].map(|k| weights[(k + turn) % 4]);
        let middle = mesh.positions.len() as u32;
        mesh.positions.push(at(mesh.tet(i as u32), weights));
        for k in 0..4 {
            let mut part = corners;
            part[k] = middle;
            if k == 0 { mesh.tets[i] = part } else { mesh.tets.push(part) }
        }
    }
    mesh
}

/// The point of the given weights.
pub(crate) fn at(corners: [Vec3; 4], weights: [f64; 4]) -> Vec3 {
    corners.iter().zip(weights).fold(Vec3::ZERO, |sum, (v, w)| sum + *v * w)
}

/// The mesh made larger and put elsewhere.
pub(crate) fn placed(mut mesh: TetMesh, scale: f64, offset: f64) -> TetMesh {
    for p in &mut mesh.positions {
        *p = *p * scale + vec3(1.0, -0.7, 0.4) * offset;
    }
    mesh
}

/// Weights of a random point that is on the given number of faces: inside, on a face, on an edge, at
/// a vertex.
pub(crate) fn weights(faces: usize, rng: &mut Rng) -> [f64; 4] {
    let mut w = [0; 4].map(|_| rng.next_f64());
    let turn = rng.next_u32() as usize;
    for k in 0..faces {
        w[(k + turn) % 4] = 0.0;
    }
    let sum: f64 = w.iter().sum();
    w.map(|w| w / sum)
}
