//! Meshes that many shapes of a scene have in common: those of spheres, disks and cylinders of one resolution.

use std::cell::RefCell;
use std::collections::BTreeMap;
use std::sync::Arc;

use drt_geom::Mesh;
use drt_math::Affine;

use super::super::element::Element;
use super::super::properties::Properties;
use super::{Round, round};
use crate::CliError;

/// From so many shapes of one mesh on, all of them are placed images of it.
const MANY: usize = 8;

/// What shapes have one mesh.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
struct Key {
    kind: &'static str,
    resolution: u32,
    face_normals: bool,
    flipped: bool,
}

/// The meshes that shapes of a scene share.
#[derive(Default)]
pub(in super::super) struct SharedMeshes {
    counts: BTreeMap<Key, usize>,
    meshes: RefCell<BTreeMap<Key, Arc<Mesh>>>,
}

impl SharedMeshes {
    /// Those of the shapes of a scene. Mistakes in shapes are found where these are read.
    pub(in super::super) fn of(shapes: &[&Element]) -> Self {
        let mut counts = BTreeMap::new();
        for e in shapes {
            let round = Properties::of(e).and_then(|p| Ok(round(&p)?.map(|r| key(&p, &r))));
            if let Ok(Some(Ok(key))) = round {
                *counts.entry(key).or_insert(0) += 1;
            }
        }
        Self { counts, meshes: RefCell::default() }
    }

    /// The mesh that a shape shares with many, and its map into the world.
    pub(super) fn find(&self, p: &Properties<'_>) -> Result<Option<(Arc<Mesh>, Affine)>, CliError> {
        let Some(round) = round(p)? else { return Ok(None) };
        let key = key(p, &round)?;
        let to_world = p.transform("to_world")?.unwrap_or(Affine::IDENTITY);
        let map = round.map.map_or(to_world, |map| to_world.after(&map));
        // Mirroring may turn a shape inside out, as its own mesh would be.
        let usable = map.linear.determinant() > 0.0 && map.is_finite() && map.inverse().is_finite();
        if !usable || self.counts.get(&key).is_none_or(|count| *count < MANY) {
            return Ok(None);
        }
        let mut meshes = self.meshes.borrow_mut();
        let mesh = meshes.entry(key).or_insert_with(|| {
            let mut mesh = round.mesh();
            if key.face_normals {
                mesh.normals = None;
            }
            if key.flipped {
                mesh.flip();
            }
            Arc::new(mesh)
        });
        Ok(Some((mesh.clone(), map)))
    }
}

fn key(p: &Properties<'_>, round: &Round) -> Result<Key, CliError> {
    let flag = |name| Ok::<bool, CliError>(p.boolean(name)?.unwrap_or(false));
    let (face_normals, flipped) = (flag("face_normals")?, flag("flip_normals")?);
    Ok(Key { kind: round.kind, resolution: round.resolution, face_normals, flipped })
}
