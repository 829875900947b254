//! Control cages: closed meshes in OBJ or PLY files.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use drt_geom::Mesh;
use drt_motion::mean_value::Cage;
use drt_motion::{Cause, GeometryChange};

use super::keys;
use super::refusal::Refusal;
use crate::CliError;
use crate::error::Place;
use crate::files::input_file;

/// The cages of a job, each read once: parameters that share a cage share its coordinates, too.
#[derive(Default)]
pub(super) struct Cages(BTreeMap<PathBuf, Arc<Mesh>>);

impl Cages {
    /// What the key says; the file is relative to `folder`.
    pub(super) fn change(
        &mut self,
        keys: &keys::Cage,
        folder: &Path,
    ) -> Result<GeometryChange, Refusal> {
        let (Some(index), Some(direction)) = (keys.vertex, keys.direction) else {
            let missing = if keys.vertex.is_none() { "vertex" } else { "direction" };
            return Err(format!(
                "`cage` lacks `{missing}`; expected {{ mesh = \"cage.obj\", vertex = 5, \
                 direction = [0, 0, 1] }}"
            )
            .into());
        };
        let path = folder.join(&keys.mesh);
        let mesh = self.load(&path)?;
        let count = mesh.source_vertex_count as usize;
        if index as usize >= count {
            let cause = Cause::CageVertexIndex { index, count };
            return Err(format!("`cage`, {}: {cause}", path.display()).into());
        }
        Ok(GeometryChange::Cage { mesh, vertices: [(index, direction.0.into())].into() })
    }

    /// A cage's mesh, checked.
    pub(super) fn load(&mut self, path: &Path) -> Result<Arc<Mesh>, Refusal> {
        if let Some(mesh) = self.0.get(path) {
            return Ok(Arc::clone(mesh));
        }
        let fail = |reason: String| CliError::input(&Place::file(path), reason);
        let bytes = input_file::read(path).map_err(|e| Refusal::unreadable(path, &e))?;
        let name = path.to_string_lossy();
        let mesh = if bytes.starts_with(b"ply") {
            drt_geom::decode_ply(&bytes, &name).map_err(|e| fail(e.to_string()))?
        } else {
            drt_geom::decode_obj(&bytes, &name).map_err(|e| fail(e.to_string()))?
        };
        Cage::new(&mesh).map_err(|cause| fail(format!("unusable as a `cage`: {cause}")))?;
        let mesh = Arc::new(mesh);
        self.0.insert(path.into(), Arc::clone(&mesh));
        Ok(mesh)
    }
}
