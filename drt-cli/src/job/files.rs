//! The files that a job names, besides its scene's.

use std::path::{Path, PathBuf};

use super::keys;
use super::motions::tetrahedra_files;

/// What decides the parameters and how things move; pictures to fit to are not among them.
pub(super) fn named(keys: &keys::Job, folder: &Path) -> Vec<PathBuf> {
    let of_views = keys.view.iter().flat_map(|v| &v.get_ref().effect);
    let effects = keys.parameter.iter().flat_map(|p| &p.get_ref().effect).chain(of_views);
    let of_effect = effects.flat_map(|effect| {
        let keys::Effect { vertex_velocity, vertex_normals, cage, .. } = effect.get_ref();
        vertex_velocity.iter().chain(vertex_normals).chain(cage.as_ref().map(|c| &c.mesh))
    });
    let cages = keys.parameter_group.iter().filter_map(|g| g.get_ref().cage.as_ref());
    let velocities = keys.motion.iter().filter_map(|m| m.get_ref().velocities.as_ref());
    let meshes = keys.motion.iter().filter_map(|m| m.get_ref().mesh.as_ref());
    let plain = of_effect.chain(cages.map(|c| &c.mesh)).chain(velocities);
    let mut files: Vec<PathBuf> = plain.map(|file| folder.join(file)).collect();
    files.extend(meshes.flat_map(|file| tetrahedra_files(&folder.join(file))));
    files.sort();
    files.dedup();
    files
}
