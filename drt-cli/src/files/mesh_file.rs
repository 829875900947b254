//! Meshes as a fit leaves them: PLY and OBJ.

use std::fmt::Write as _;

use drt_geom::Mesh;
use drt_math::Vec3;

/// Positions in the order of the mesh's file, and their faces.
fn in_file_order(mesh: &Mesh) -> (Vec<Vec3>, Vec<[u32; 3]>) {
    let mut positions = vec![Vec3::ZERO; mesh.source_vertex_count as usize];
    for (i, p) in (0..).zip(&mesh.positions) {
        positions[mesh.source_vertex(i) as usize] = *p;
    }
    let faces = mesh.triangles.iter().map(|t| t.map(|v| mesh.source_vertex(v))).collect();
    (positions, faces)
}

/// A binary PLY file: x, y, z in double precision in the order of the file that the mesh came from, and its triangles.
#[must_use]
pub fn ply(mesh: &Mesh) -> Vec<u8> {
    let (positions, faces) = in_file_order(mesh);
    let mut out = format!(
        "ply\nformat binary_little_endian 1.0\nelement vertex {}\nproperty double x\nproperty double y\n\
         property double z\nelement face {}\nproperty list uchar uint vertex_indices\nend_header\n",
        positions.len(),
        faces.len()
    )
    .into_bytes();
    for v in positions.iter().flat_map(|p| p.to_array()) {
        out.extend(v.to_le_bytes());
    }
    for face in faces {
        out.push(3);
        face.iter().for_each(|v| out.extend(v.to_le_bytes()));
    }
    out
}

/// An OBJ file: positions in the order of the file that the mesh came from, with the texture coordinates and normals that it has.
#[must_use]
pub fn obj(mesh: &Mesh) -> String {
    let (positions, faces) = in_file_order(mesh);
    let mut text = String::new();
    // Writing to a string cannot fail.
    for p in positions {
        let _ = writeln!(text, "v {} {} {}", p.x, p.y, p.z);
    }
    for [u, v] in mesh.texcoords.iter().flatten().flatten() {
        let _ = writeln!(text, "vt {u} {v}");
    }
    for n in mesh.normals.iter().flatten() {
        let _ = writeln!(text, "vn {} {} {}", n.x, n.y, n.z);
    }
    let (uv, normals) = (mesh.texcoords.is_some(), mesh.normals.is_some());
    for (f, (face, vertices)) in faces.iter().zip(&mesh.triangles).enumerate() {
        text += "f";
        for (k, (v, n)) in face.iter().zip(vertices).enumerate() {
            let (v, t, n) = (v + 1, 3 * f + k + 1, n + 1);
            let _ = match (uv, normals) {
                (false, false) => write!(text, " {v}"),
                (true, false) => write!(text, " {v}/{t}"),
                (false, true) => write!(text, " {v}//{n}"),
                (true, true) => write!(text, " {v}/{t}/{n}"),
            };
        }
        text += "\n";
    }
    text
}

#[cfg(test)]
mod tests {
    use drt_geom::procedural;

    use super::*;

    #[test]
    fn meshes_come_back() {
        for mesh in [procedural::icosphere(1).with_smooth_normals(), procedural::uv_sphere(6)] {
            let read = drt_geom::decode_ply(&ply(&mesh), "mesh.ply").unwrap();
            let (positions, _) = in_file_order(&mesh);
            assert_eq!(in_file_order(&read).0, positions);
            assert_eq!(read.triangles.len(), mesh.triangles.len());
            let read = drt_geom::decode_obj(obj(&mesh).as_bytes(), "mesh.obj").unwrap();
            assert_eq!(in_file_order(&read).0, positions);
            assert_eq!(read.normals.is_some(), mesh.normals.is_some());
            assert_eq!(read.texcoords.is_some(), mesh.texcoords.is_some());
        }
    }
}
