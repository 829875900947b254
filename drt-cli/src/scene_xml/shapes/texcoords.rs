//! Texture coordinates of primitives, where Mitsuba has them.

use std::f64::consts::TAU;

use drt_geom::Mesh;
use drt_math::Vec3;

/// The mesh with the coordinates `uv` at each corner, which may depend on the middle of its triangle.
fn with(mesh: Mesh, uv: impl Fn(Vec3, Vec3) -> [f64; 2]) -> Mesh {
    let corners = (0..mesh.triangles.len() as u32).map(|i| {
        let corners = mesh.triangle(i);
        let middle = (corners[0] + corners[1] + corners[2]) / 3.0;
        corners.map(|p| uv(p, middle))
    });
    let texcoords = Some(corners.collect());
    Mesh { texcoords, ..mesh }
}

/// The part of the turn about z, next to that of `middle`, so that no triangle goes all the way round.
fn turn(p: Vec3, middle: Vec3) -> f64 {
    let about = |v: Vec3| (v.y.atan2(v.x) / TAU).rem_euclid(1.0);
    let near = about(middle);
    // On the axis all are the same.
    if p.x.hypot(p.y) < 1e-9 {
        return near;
    }
    let off = about(p) - near;
    near + off - off.round()
}

pub(super) fn rectangle(mesh: Mesh) -> Mesh {
    with(mesh, |p, _| [0.5 * (p.x + 1.0), 0.5 * (p.y + 1.0)])
}

pub(super) fn disk(mesh: Mesh) -> Mesh {
    with(mesh, |p, middle| [p.x.hypot(p.y).min(1.0), turn(p, middle)])
}

pub(super) fn sphere(mesh: Mesh) -> Mesh {
    with(mesh, |p, middle| [turn(p, middle), 2.0 * p.z.clamp(-1.0, 1.0).acos() / TAU])
}

pub(super) fn cylinder(mesh: Mesh) -> Mesh {
    with(mesh, |p, middle| [turn(p, middle), p.z])
}

pub(super) fn cube(mesh: Mesh) -> Mesh {
    with(mesh, |p, middle| {
        let [x, y, z] = middle.to_array().map(f64::abs);
        let [s, t] = if z > x.max(y) {
            [p.y * middle.z.signum(), p.x]
        } else if x > y {
            [p.y, -p.z * middle.x.signum()]
        } else if middle.y > 0.0 {
            [-p.x, -p.z]
        } else {
            [p.z, p.x]
        };
        [0.5 * (s + 1.0), 0.5 * (t + 1.0)]
    })
}
