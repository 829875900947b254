//! Meshes from files, with the shading normals Mitsuba gives them.

use std::path::Path;

use drt_geom::Mesh;
use drt_math::Vec3;

use crate::CliError;
use crate::scene_xml::element::Element;

/// Reads an OBJ file for the shape `e`.
pub(super) fn obj(e: &Element, path: &Path) -> Result<Mesh, CliError> {
    let read = drt_geom::decode_obj_mended(&bytes(e, path)?, &path.to_string_lossy());
    read.map(|read| mended(e, path, read)).map_err(|err| e.error(err))
}

/// Reads a PLY file for the shape `e`.
pub(super) fn ply(e: &Element, path: &Path) -> Result<Mesh, CliError> {
    let read = drt_geom::decode_ply_mended(&bytes(e, path)?, &path.to_string_lossy());
    read.map(|read| mended(e, path, read)).map_err(|err| e.error(err))
}

/// A mesh of which some polygons may have been mended.
fn mended(e: &Element, path: &Path, (mesh, count): (Mesh, usize)) -> Mesh {
    if count > 0 {
        let file = path.display();
        e.note(format!(
            "the edges of {count} polygons of {file} cross; cut into fans, as Mitsuba does"
        ));
    }
    mesh
}

pub(super) fn bytes(e: &Element, path: &Path) -> Result<Vec<u8>, CliError> {
    crate::files::input_file::read(path)
        .map_err(|err| e.error(format!("cannot read {}: {err}", path.display())))
}

/// The mesh with a shading normal per vertex: the mean of the normals of the triangles that *name*
/// this vertex, weighted by their angles there (Thürmer and Wüthrich 1998, "Computing vertex normals
/// from polygonal facets").
///
/// Unlike [`Mesh::with_smooth_normals`], vertices at the same position stay apart: a file that
/// repeats them means a crease, and so Mitsuba reads it.
pub(super) fn smooth(e: &Element, mesh: Mesh) -> Result<Mesh, CliError> {
    let mut normals = vec![Vec3::ZERO; mesh.positions.len()];
    for (i, corners) in mesh.triangles.iter().enumerate() {
        let n = mesh.normal(i as u32);
        for k in 0..3 {
            let [at, next, last] = [0, 1, 2].map(|j| mesh.positions[corners[(k + j) % 3] as usize]);
            let (a, b) = (next - at, last - at);
            normals[corners[k] as usize] += n * a.cross(b).length().atan2(a.dot(b));
        }
    }
    for n in &mut normals {
        // No triangle names the vertex, or they cancel: any direction will do.
        if n.max_abs() < 1e-12 {
            *n = Vec3::Z;
        }
    }
    mesh.with_normals(normals).map_err(|err| e.error(err))
}
