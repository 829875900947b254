//! From `[[motion]]` to how the inside of a medium moves.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use drt_estimators::{GivenTetrahedra, InteriorMotion, Scene, Target};
use drt_geom::TetMesh;
use drt_motion::Parameter;
use toml::Spanned;

use super::document::Document;
use super::keys::{self, MotionKind, Tetrahedralizer};
use super::refusal::Refusal;
use super::velocities;
use crate::CliError;
use crate::error::Place;
use crate::files::input_file;

/// The kinds asked for, by the medium's index. Several tables may speak of one medium, to give the
/// velocities of its tetrahedra for several parameters.
pub(super) fn insides(
    document: &Document<'_>,
    motions: &[Spanned<keys::Motion>],
    folder: &Path,
    scene: &Scene,
    parameters: &[Parameter<String>],
) -> Result<Vec<(usize, InteriorMotion)>, CliError> {
    let mut insides: BTreeMap<usize, (InteriorMotion, Option<PathBuf>)> = BTreeMap::new();
    for motion in motions {
        let fail = |message: String| {
            document.error_at(motion.span().start, format!("[[motion]]: {message}"))
        };
        let keys = motion.get_ref();
        let target = scene.find(&keys.medium).map_err(|e| fail(e.to_string()))?;
        let Target::Medium(medium) = target else {
            return Err(fail(format!("`{}` is not a medium", keys.medium)));
        };
        check(keys).map_err(fail)?;
        let mut kind = match (keys.kind, &keys.mesh) {
            (MotionKind::Affine, _) => InteriorMotion::Affine,
            (MotionKind::Static, _) => InteriorMotion::Static,
            (MotionKind::MeanValue, _) => InteriorMotion::MeanValue,
            (MotionKind::Tetrahedral, None)
                if keys.tetrahedralizer == Some(Tetrahedralizer::Tetgen) =>
            {
                InteriorMotion::Tetgen
            }
            (MotionKind::Tetrahedral, None) => InteriorMotion::Tetrahedral(None),
            (MotionKind::Tetrahedral, Some(file)) => {
                let before = insides.remove(&medium);
                let mut given = match before {
                    Some((InteriorMotion::Tetrahedral(Some(given)), Some(path)))
                        if path == *file =>
                    {
                        Arc::unwrap_or_clone(given)
                    }
                    _ => GivenTetrahedra {
                        mesh: tetrahedra(&folder.join(file)).map_err(|e| e.told(fail))?,
                        velocities: vec![],
                    },
                };
                if let (Some(file), Some(name)) = (&keys.velocities, &keys.parameter) {
                    let parameter = parameters.iter().position(|p| p.name == *name);
                    let parameter =
                        parameter.ok_or_else(|| fail(format!("there is no parameter `{name}`")))?;
                    let list = velocities::read(&folder.join(file)).map_err(|e| e.told(fail))?;
                    let (found, expected) = (list.len(), given.mesh.positions.len());
                    if found != expected {
                        let message = format!("{found} velocities for {expected} vertices");
                        return Err(CliError::input(&Place::file(&folder.join(file)), message));
                    }
                    given.velocities.retain(|(p, _)| *p != parameter);
                    given.velocities.push((parameter, list.into()));
                }
                InteriorMotion::Tetrahedral(Some(Arc::new(given)))
            }
        };
        if let (InteriorMotion::Tetrahedral(None), Some((before, _))) =
            (&kind, insides.get(&medium))
            && matches!(before, InteriorMotion::Tetrahedral(_))
        {
            kind = before.clone();
        }
        insides.insert(medium, (kind, keys.mesh.clone()));
    }
    Ok(insides.into_iter().map(|(medium, (kind, _))| (medium, kind)).collect())
}

/// Which keys go together.
fn check(keys: &keys::Motion) -> Result<(), String> {
    let keys::Motion { kind, mesh, velocities, parameter, tetrahedralizer, .. } = keys;
    match (kind, mesh, tetrahedralizer) {
        (_, _, None) => {}
        (MotionKind::Tetrahedral, None, Some(Tetrahedralizer::Tetgen)) => {
            if cfg!(not(feature = "tetgen")) {
                return Err("`tetrahedralizer` \"tetgen\" is not in this program; expected it to be built with \
                            `--features tetgen` (TetGen is under the AGPL), or \"own\""
                    .into());
            }
        }
        (MotionKind::Tetrahedral, None, Some(Tetrahedralizer::Own)) => {}
        _ => {
            return Err(
                "`tetrahedralizer` belongs to the kind `tetrahedral` without a `mesh`".into()
            );
        }
    }
    match (kind, mesh, velocities, parameter) {
        (MotionKind::Tetrahedral, Some(_), Some(_), Some(_))
        | (MotionKind::Tetrahedral, _, None, None)
        | (_, None, None, None) => Ok(()),
        (MotionKind::Tetrahedral, None, _, _) => {
            Err("`velocities` belong to the vertices of a `mesh`, which is missing".into())
        }
        (MotionKind::Tetrahedral, ..) => {
            Err("`velocities` and the `parameter` that they belong to need each other".into())
        }
        _ => Err("`mesh`, `velocities` and `parameter` belong to the kind `tetrahedral`".into()),
    }
}

fn tetrahedra(path: &Path) -> Result<TetMesh, Refusal> {
    for file in tetrahedra_files(path) {
        input_file::check(&file).map_err(|e| Refusal::unreadable(&file, &e))?;
    }
    Ok(drt_geom::read_tet_mesh(path).map_err(|e| CliError::input(&Place::file(path), e))?)
}

/// The files that hold the mesh of this one, which TetGen writes in two.
pub(super) fn tetrahedra_files(path: &Path) -> Vec<PathBuf> {
    match path.extension().and_then(|e| e.to_str()).map(str::to_ascii_lowercase).as_deref() {
        Some("node" | "ele") => ["node", "ele"].map(|e| path.with_extension(e)).into(),
        _ => vec![path.into()],
    }
}
