//! Edges of meshes, and what they amount to without a tree.

use alloc::vec::Vec;

use drt_geom::{EdgeClass, Mesh, NONE, Topology};
use drt_math::{Vec3, vec3};

use super::super::*;

/// All edges of a mesh that are not flat, each counting as much as any other.
pub(super) fn segments(mesh: &Mesh, jump: f64, crease: [f64; 2]) -> Vec<Segment> {
    let normal = |f: u32| {
        let [a, b, c] = mesh.triangles[f as usize].map(|v| mesh.positions[v as usize]);
        (b - a).cross(c - a).normalize()
    };
    let topology = Topology::of(mesh);
    let edges = topology.edges.iter().filter(|e| e.class != EdgeClass::Flat);
    let segment = |e: &drt_geom::Edge| {
        let [a, b] = e.vertices.map(|v| mesh.positions[v as usize]);
        let open = e.faces[1] == NONE;
        let faces = [normal(e.faces[0]), if open { Vec3::ZERO } else { normal(e.faces[1]) }];
        Segment { a, b, faces, open, jump, crease }
    };
    edges.map(segment).collect()
}

/// The weight with which a segment counts, seen from `x`.
pub(super) fn prior(s: &Segment, x: Vec3) -> f64 {
    if s.open {
        return s.jump;
    }
    match s.faces.map(|n| n.dot(x - s.a) > 0.0) {
        [true, true] => s.crease[0],
        [false, false] => s.crease[1],
        _ => s.jump,
    }
}

/// The kernel at a point of a segment: angular speed times weight times cosine.
pub(super) fn kernel(s: &Segment, u: f64, x: Vec3, normal: Option<(Vec3, bool)>) -> f64 {
    let to = s.a.lerp(s.b, u) - x;
    let r = to.length();
    let sine = to.cross(s.b - s.a).length() / (r * (s.b - s.a).length());
    let cosine = normal.map_or(1.0, |(n, through)| {
        let c = n.dot(to) / r;
        if through { c.abs() } else { c.max(0.0) }
    });
    prior(s, x) * sine * cosine / (r * r)
}

/// Its integral along a segment.
pub(super) fn integral(s: &Segment, x: Vec3, normal: Option<(Vec3, bool)>) -> f64 {
    if prior(s, x) == 0.0 {
        return 0.0;
    }
    // Steps even in the angle.
    let t = (s.b - s.a).normalize();
    let (t0, length) = ((s.a - x).dot(t), (s.b - s.a).length());
    let d = (s.a - x - t * t0).length();
    let steps = 64;
    let (from, to) = ((t0 / d).atan(), ((t0 + length) / d).atan());
    let step = (to - from) / f64::from(steps);
    (0..steps)
        .map(|i| {
            let angle = from + (f64::from(i) + 0.5) * step;
            let jacobian = d / (angle.cos() * angle.cos());
            kernel(s, (d * angle.tan() - t0) / length, x, normal) * jacobian * step
        })
        .sum()
}

pub(super) fn direction(rng: &mut Rng) -> Vec3 {
    drt_math::warp::uniform_sphere(rng.next_2d())
}

pub(super) fn moved(mesh: &Mesh, scale: f64, by: Vec3) -> Mesh {
    let mut mesh = mesh.clone();
    for p in &mut mesh.positions {
        *p = *p * scale + by;
    }
    mesh
}

pub(super) fn cloud(rng: &mut Rng) -> Vec3 {
    vec3(rng.next_f64(), rng.next_f64(), rng.next_f64()) * 2.0 - Vec3::splat(1.0)
}
