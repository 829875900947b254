//! Delaunay tetrahedra of points in a box, by incremental insertion (Bowyer 1981, Watson 1981).

use alloc::vec::Vec;

use drt_math::{Rng, Vec3, vec3};

use super::complex::{Complex, OPPOSITE};
use super::predicates::{in_sphere, orient};
use crate::{Aabb, NONE};

/// Fills a box: its corners become vertices 0 to 7, the points, which are distinct and strictly
/// inside, those from 8 in their order. None when arithmetic has left its range.
pub(super) fn delaunay(bounds: &Aabb, points: &[Vec3]) -> Option<Complex> {
    let corner = |i: u32| {
        let side = |k: u32| if i >> k & 1 == 1 { bounds.max } else { bounds.min };
        vec3(side(0).x, side(1).y, side(2).z)
    };
    let mut all: Vec<Vec3> = (0..8).map(corner).collect();
    all.extend_from_slice(points);
    // Six around a diagonal; the corners lie on one sphere, so that any choice is Delaunay.
    let path = [[1, 3], [3, 2], [2, 6], [6, 4], [4, 5], [5, 1]];
    let mut complex = Complex::new(all, &path.map(|[a, b]| [0, a, b, 7]));
    let (mut conflict, mut last) = (Vec::new(), 0);
    for v in insertion_order(bounds, points) {
        let v = v + 8;
        let p = complex.points[v as usize];
        let tet = locate(&complex, p, last)?;
        conflicts(&mut complex, p, tet, &mut conflict);
        complex.replace_by_cone(&conflict, v).ok()?;
        last = complex.home(v);
    }
    Some(complex)
}

/// Rounds of doubling size, each along a curve: Amenta, Choi, Rote 2003, "Incremental constructions
/// con BRIO". Random enough to meet no bad case, near enough to find the way quickly.
fn insertion_order(bounds: &Aabb, points: &[Vec3]) -> Vec<u32> {
    let mut rng = Rng::new(3, 0, 0);
    let extent = bounds.extent();
    let mut keyed: Vec<(u32, u64, u32)> = (0..)
        .zip(points)
        .map(|(i, &p)| {
            // Half of all are in the last round, a quarter in the one before.
            let round = u32::MAX - rng.next_u32().trailing_zeros();
            let cell = |k: usize| ((p[k] - bounds.min[k]) / extent[k] * 1024.0) as u32;
            (round, along_curve([0, 1, 2].map(|k| cell(k).min(1023))), i)
        })
        .collect();
    keyed.sort_unstable();
    keyed.into_iter().map(|(.., i)| i).collect()
}

/// The place of a cell of a 1024³ grid along Hilbert's curve: Skilling 2004, "Programming the
/// Hilbert curve".
fn along_curve(mut x: [u32; 3]) -> u64 {
    let mut q = 512;
    while q > 1 {
        let below = q - 1;
        for i in 0..3 {
            if x[i] & q != 0 {
                x[0] ^= below;
            } else {
                let t = (x[0] ^ x[i]) & below;
                x[0] ^= t;
                x[i] ^= t;
            }
        }
        q >>= 1;
    }
    x[1] ^= x[0];
    x[2] ^= x[1];
    let mut flip = 0;
    let mut q = 512;
    while q > 1 {
        if x[2] & q != 0 {
            flip ^= q - 1;
        }
        q >>= 1;
    }
    let x = x.map(|c| c ^ flip);
    let bits = (0..10).rev().flat_map(|b| (0..3).map(move |i| (i, b)));
    bits.fold(0, |code, (i, b)| code << 1 | u64::from(x[i] >> b & 1))
}

/// A tetrahedron that holds a point, by walking there through faces that see it.
fn locate(complex: &Complex, p: Vec3, start: u32) -> Option<u32> {
    let mut t = start;
    // A walk in a Delaunay mesh does not come back: Edelsbrunner 1990.
    for step in 0..complex.tets.len() + 4 {
        let corners = complex.corners(t);
        let beyond = (0..4).map(|k| (k + step) & 3).find(|&k| {
            let [x, y, z] = OPPOSITE[k].map(|i| corners[i]);
            orient([p, x, y, z]) < 0.0
        });
        match beyond {
            None => return Some(t),
            Some(k) => t = complex.tets[t as usize].neighbors[k],
        }
        if t == NONE {
            return None;
        }
    }
    None
}

/// All tetrahedra whose sphere has the point strictly inside; they are connected and see it.
fn conflicts(complex: &mut Complex, p: Vec3, start: u32, found: &mut Vec<u32>) {
    found.clear();
    complex.begin_search();
    complex.first_visit(start);
    found.push(start);
    let mut next = 0;
    while next < found.len() {
        let neighbors = complex.tets[found[next] as usize].neighbors;
        next += 1;
        for n in neighbors {
            if n != NONE && complex.first_visit(n) && in_sphere(complex.corners(n), p) > 0.0 {
                found.push(n);
            }
        }
    }
}
