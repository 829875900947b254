use alloc::vec::Vec;

use drt_math::{Vec3, vec3};

use super::{mesh, on_circle, quad};
use crate::Mesh;

/// The square [-1, 1]² in z = 0, as two triangles: Mitsuba's `rectangle`.
#[must_use]
pub fn rectangle() -> Mesh {
    grid(1, 1)
}

/// The square [-1, 1]² in z = 0, cut into `nx` × `ny` cells of two triangles each.
#[must_use]
pub fn grid(nx: u32, ny: u32) -> Mesh {
    let (nx, ny) = (nx.max(1), ny.max(1));
    let along = |i: u32, n: u32| f64::from(2 * i) / f64::from(n) - 1.0;
    let row = |j| (0..=nx).map(move |i| vec3(along(i, nx), along(j, ny), 0.0));
    let positions = (0..=ny).flat_map(row).collect();
    let at = |i, j| j * (nx + 1) + i;
    let cell = |i, j| quad([at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)]);
    let triangles = (0..ny).flat_map(|j| (0..nx).flat_map(move |i| cell(i, j))).collect();
    mesh(positions, triangles)
}

/// The regular polygon of `n` corners on the unit circle, as a fan around the middle: Mitsuba's
/// `disk`.
#[must_use]
pub fn disk(n: u32) -> Mesh {
    let n = n.max(3);
    fan((0..n).map(|i| on_circle(i, n)))
}

/// A flat star: `spikes` tips on the circle of radius `outer`, with notches on that of radius
/// `inner` between them.
#[must_use]
pub fn star(spikes: u32, inner: f64, outer: f64) -> Mesh {
    let n = 2 * spikes.max(2);
    fan((0..n).map(|i| {
        let (c, s) = on_circle(i, n);
        let r = if i % 2 == 0 { outer } else { inner };
        (r * c, r * s)
    }))
}

/// The polygon through points running counter-clockwise around the origin.
fn fan(rim: impl Iterator<Item = (f64, f64)>) -> Mesh {
    let mut positions: Vec<Vec3> = alloc::vec![Vec3::ZERO];
    positions.extend(rim.map(|(x, y)| vec3(x, y, 0.0)));
    let n = positions.len() as u32 - 1;
    let triangles = (0..n).map(|i| [0, i + 1, (i + 1) % n + 1]).collect();
    mesh(positions, triangles)
}
