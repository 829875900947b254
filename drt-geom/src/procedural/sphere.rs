use alloc::collections::BTreeMap;
use alloc::vec::Vec;
use core::f64::consts::PI;

use drt_math::{Vec3, fm, vec3};

use super::{mesh, on_circle};
use crate::Mesh;

/// The unit sphere by `subdivisions` halvings of an icosahedron's edges: 20 · 4^subdivisions
/// triangles with vertices on the sphere, without shading normals.
#[must_use]
pub fn icosphere(subdivisions: u32) -> Mesh {
    let (mut positions, mut triangles) = icosahedron();
    for _ in 0..subdivisions {
        let mut middles = BTreeMap::new();
        let mut middle = |a: u32, b: u32, positions: &mut Vec<Vec3>| {
            *middles.entry((a.min(b), a.max(b))).or_insert_with(|| {
                positions.push((positions[a as usize] + positions[b as usize]).normalize());
                positions.len() as u32 - 1
            })
        };
        let mut finer = Vec::with_capacity(4 * triangles.len());
        for [a, b, c] in triangles {
            let ab = middle(a, b, &mut positions);
            let bc = middle(b, c, &mut positions);
            let ca = middle(c, a, &mut positions);
            finer.extend([[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]);
        }
        triangles = finer;
    }
    mesh(positions, triangles)
}

fn icosahedron() -> (Vec<Vec3>, Vec<[u32; 3]>) {
    // Two poles, and two rings of five turned against each other, at height ±1/sqrt 5.
    let height = 1.0 / fm::sqrt(5.0);
    let mut positions = alloc::vec![Vec3::Z];
    for ring in 0..2 {
        for i in 0..5 {
            let (c, s) = on_circle(2 * i + ring, 10);
            let z = if ring == 0 { height } else { -height };
            positions.push(vec3(2.0 * height * c, 2.0 * height * s, z));
        }
    }
    positions.push(-Vec3::Z);
    let (upper, lower) = (|i: u32| 1 + i % 5, |i: u32| 6 + i % 5);
    let mut triangles = Vec::with_capacity(20);
    for i in 0..5 {
        triangles.extend([
            [0, upper(i), upper(i + 1)],
            [upper(i), lower(i), upper(i + 1)],
            [lower(i), lower(i + 1), upper(i + 1)],
            [11, lower(i + 1), lower(i)],
        ]);
    }
    (positions, triangles)
}

/// The unit sphere by longitude and latitude, poles at ±z: `2 n` meridians, `n` bands, and the
/// sphere's own normals as shading normals. Stands for Mitsuba's `sphere`.
#[must_use]
pub fn uv_sphere(n: u32) -> Mesh {
    let bands = n.max(2);
    let around = 2 * bands;
    let mut positions = alloc::vec![Vec3::Z];
    for j in 1..bands {
        let (r, z) = fm::sin_cos(PI * f64::from(j) / f64::from(bands));
        positions.extend((0..around).map(|i| {
            let (c, s) = on_circle(i, around);
            vec3(r * c, r * s, z)
        }));
    }
    positions.push(-Vec3::Z);

    let last = positions.len() as u32 - 1;
    let at = |i: u32, j: u32| 1 + (j - 1) * around + i % around;
    let mut triangles = Vec::new();
    for i in 0..around {
        triangles.push([0, at(i, 1), at(i + 1, 1)]);
        for j in 1..bands - 1 {
            let corners = [at(i, j), at(i, j + 1), at(i + 1, j + 1), at(i + 1, j)];
            triangles.extend(super::quad(corners));
        }
        triangles.push([last, at(i + 1, bands - 1), at(i, bands - 1)]);
    }
    let normals = Some(positions.clone());
    Mesh { normals, ..mesh(positions, triangles) }
}

/// An icosphere whose radius varies by `1 + amplitude · sin(frequency x) sin(frequency y)
/// sin(frequency z)` over the unit sphere: a closed surface with valleys that shadow each other.
///
/// The amplitude is held within ±0.9, so that the surface stays star-shaped and closed.
#[must_use]
pub fn bumpy_sphere(subdivisions: u32, amplitude: f64, frequency: f64) -> Mesh {
    let amplitude = amplitude.clamp(-0.9, 0.9);
    let mut m = icosphere(subdivisions);
    for p in &mut m.positions {
        let [x, y, z] = p.to_array().map(|c| fm::sin(frequency * c));
        *p *= 1.0 + amplitude * x * y * z;
    }
    m
}
