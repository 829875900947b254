//! Turns the parts of a closed surface such that they alternate: outermost ones outward, those
//! inside one other inward, and so on.

use alloc::vec;
use alloc::vec::Vec;

use drt_geom::{Edge, EdgeClass, Mesh, NONE, Topology, TriangleBvh};
use drt_math::Vec3;

use crate::error::Cause;

/// Volume of a part, over the cube of its size, below which it encloses nothing.
const FLAT: f64 = 1e-14;

/// How many triangles of a part are asked how deep inside the others it is: parts may touch.
const PROBES: usize = 15;

/// How far off a probed triangle the asking starts, relative to its size.
const OFF: f64 = 1e-4;

/// A triangle of a mesh: its number, and its corners in the order that makes all alternate.
pub(super) type Turned = (u32, [u32; 3]);

/// The triangles of the mesh without those that cancel.
///
/// Whatever order their corners come in is of no account. Triangles at the same place cancel in
/// pairs: there, bodies touch. Parts are connected by edges of exactly two faces, on welded
/// positions.
///
/// # Errors
/// When the mesh is not closed, has one side only, or a part of it encloses no volume.
pub(super) fn alternating(mesh: &Mesh) -> Result<Vec<Turned>, Cause> {
    let sources = single(mesh)?;
    let triangles = sources.iter().map(|&i| mesh.triangles[i as usize]).collect();
    let turned = turned(&Mesh { triangles, ..mesh.clone() })?;
    Ok(sources.into_iter().zip(turned).collect())
}

/// The triangles that no other one cancels.
fn single(mesh: &Mesh) -> Result<Vec<u32>, Cause> {
    let topology = Topology::of(mesh);
    let place = |face: u32| {
        let mut t = mesh.triangles[face as usize].map(|v| topology.welded[v as usize]);
        t.sort_unstable();
        t
    };
    // The rim of a sheet seen from both sides, which would cancel as a whole.
    let rim = |e: &Edge| e.class != EdgeClass::NonManifold && e.faces[1] != NONE;
    if topology.edges.iter().any(|e| rim(e) && place(e.faces[0]) == place(e.faces[1])) {
        return Err(Cause::FlatSurface);
    }
    let has_area = |t: [u32; 3]| t[0] != t[1] && t[1] != t[2];
    let faces = 0..mesh.triangles.len() as u32;
    let mut places: Vec<([u32; 3], u32)> = faces.map(|face| (place(face), face)).collect();
    places.sort_unstable();
    let odd = |same: &&[([u32; 3], u32)]| same.len() % 2 == 1 && has_area(same[0].0);
    let mut single: Vec<u32> =
        places.chunk_by(|a, b| a.0 == b.0).filter(odd).map(|same| same[0].1).collect();
    single.sort_unstable();
    Ok(single)
}

/// Each triangle with its corners in the order that makes all alternate.
fn turned(mesh: &Mesh) -> Result<Vec<[u32; 3]>, Cause> {
    let topology = Topology::of(mesh);
    if !topology.is_closed() {
        let open = topology.edges.iter().find(|e| e.class == EdgeClass::Boundary);
        let vertices = open.map_or([0; 2], |e| e.vertices.map(|v| mesh.source_vertex(v)));
        return Err(Cause::OpenSurface { vertices });
    }
    let parts = parts(mesh, &topology)?;
    let mut outward = mesh.clone();
    for part in &parts {
        let (volume, size) = volume(mesh, part);
        if volume.abs() <= FLAT * size * size * size {
            return Err(Cause::FlatSurface);
        }
        for &(face, flipped) in part {
            if flipped != (volume < 0.0) {
                outward.triangles[face as usize].swap(1, 2);
            }
        }
    }
    let Ok(bvh) = TriangleBvh::of(&outward) else { return Err(Cause::FlatSurface) };
    let mut triangles = outward.triangles.clone();
    for part in parts {
        if is_nested(&outward, &bvh, &part) {
            for (face, _) in part {
                triangles[face as usize].swap(1, 2);
            }
        }
    }
    Ok(triangles)
}

/// Whether an odd number of other parts surround this one.
fn is_nested(outward: &Mesh, bvh: &TriangleBvh, part: &[(u32, bool)]) -> bool {
    let step = part.len().div_ceil(PROBES);
    let (mut odd, mut all) = (0, 0);
    for &(face, _) in part.iter().step_by(step) {
        let [a, b, c] = outward.triangle(face);
        let off = outward.normal(face) * (OFF * f64::max((b - a).length(), (c - a).length()));
        let above = (a + b + c) / 3.0 + off;
        odd += bvh.winding_number(above).rem_euclid(2);
        all += 1;
    }
    2 * odd > all
}

/// Connected faces, and for each whether it runs against the first of its part.
fn parts(mesh: &Mesh, topology: &Topology) -> Result<Vec<Vec<(u32, bool)>>, Cause> {
    let mut seen: Vec<Option<bool>> = vec![None; mesh.triangles.len()];
    let mut parts = Vec::new();
    for first in 0..mesh.triangles.len() as u32 {
        if seen[first as usize].is_some() {
            continue;
        }
        seen[first as usize] = Some(false);
        let mut part = vec![(first, false)];
        let mut next = 0;
        while let Some(&(face, flipped)) = part.get(next) {
            next += 1;
            for &edge in &topology.face_edges[face as usize] {
                let edge = &topology.edges[edge as usize];
                if edge.class == EdgeClass::NonManifold {
                    continue;
                }
                let other = if edge.faces[0] == face { edge.faces[1] } else { edge.faces[0] };
                let along = |face: u32| {
                    let ends = edge.vertices.map(|v| topology.welded[v as usize]);
                    let t = mesh.triangles[face as usize].map(|v| topology.welded[v as usize]);
                    (0..3).any(|k| [t[k], t[(k + 1) % 3]] == ends)
                };
                let against = flipped ^ (along(face) == along(other));
                match seen[other as usize] {
                    Some(known) if known != against => return Err(Cause::OneSidedSurface),
                    Some(_) => {}
                    None => {
                        seen[other as usize] = Some(against);
                        part.push((other, against));
                    }
                }
            }
        }
        parts.push(part);
    }
    Ok(parts)
}

/// Signed volume of a part, as its first face is turned, and its size.
fn volume(mesh: &Mesh, part: &[(u32, bool)]) -> (f64, f64) {
    let origin = part.first().map_or(Vec3::ZERO, |(face, _)| mesh.triangle(*face)[0]);
    let (mut six, mut size) = (0.0, 0.0);
    for &(face, flipped) in part {
        let [a, b, c] = mesh.triangle(face).map(|p| p - origin);
        let v = a.dot(b.cross(c));
        six += if flipped { -v } else { v };
        size = f64::max(size, f64::max(a.max_abs(), f64::max(b.max_abs(), c.max_abs())));
    }
    (six / 6.0, size)
}
