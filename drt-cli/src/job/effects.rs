//! From the keys of an effect to what it does.

use std::path::Path;

use drt_estimators::{Scene, Target};
use drt_math::{Affine, Mat3, Rgb, Vec3};
use drt_medium::Property;
use drt_motion::{Change, Effect, GeometryChange, PropertyChange, Texels, ValueChange};

use super::cages::Cages;
use super::keys::{self, Voxels};
use super::list::List;
use super::refusal::Refusal;
use super::velocities;

/// Keys of which an effect has exactly one.
const KINDS: &str = "translate, rotate, scale, matrix, vertex_velocity, vertex_normals, vertex, cage, follow or property";

/// What an effect does; files are relative to `folder`.
pub(super) fn effect(
    keys: &keys::Effect,
    folder: &Path,
    cages: &mut Cages,
) -> Result<Effect, Refusal> {
    let geometry = |change| Change::Geometry(change);
    let vec = |list: List<f64, 3>| Vec3::from(list.0);
    let mut changes = Vec::new();
    if let Some(t) = keys.translate {
        changes.push(geometry(GeometryChange::Translate(vec(t))));
    }
    if let Some(r) = &keys.rotate {
        let (axis, pivot) = (vec(r.axis), vec(r.pivot));
        changes.push(geometry(GeometryChange::Rotate { axis, pivot }));
    }
    if let Some(s) = &keys.scale {
        let (factor, pivot) = (vec(s.factor), vec(s.pivot));
        changes.push(geometry(GeometryChange::Scale { factor, pivot }));
    }
    if let Some(rows) = keys.matrix {
        changes.push(geometry(GeometryChange::Matrix(affine(rows.0.map(|row| row.0)))));
    }
    if let Some(file) = &keys.vertex_velocity {
        let velocities = velocities::read(&folder.join(file))?;
        changes.push(geometry(GeometryChange::VertexVelocity(velocities.into())));
    }
    if let Some(file) = &keys.vertex_normals {
        let vectors = velocities::read(&folder.join(file))?;
        changes.push(geometry(GeometryChange::VertexNormals(vectors.into())));
    }
    if let Some(v) = &keys.vertex {
        let direction = vec(v.direction);
        changes.push(geometry(GeometryChange::Vertex { index: v.index, direction }));
    }
    if let Some(cage) = &keys.cage {
        changes.push(geometry(cages.change(cage, folder)?));
    }
    if let Some(leader) = &keys.follow {
        changes.push(Change::Follow(leader.clone()));
    }
    if let Some(change) = property(keys)? {
        changes.push(Change::Property(change));
    }
    match (changes.pop(), changes.len()) {
        (Some(change), 0) => Ok(Effect { target: keys.target.clone(), change }),
        (None, _) => Err(format!("the effect does nothing; give one of {KINDS}").into()),
        (Some(_), n) => {
            Err(format!("the effect does {} things; give one of {KINDS} each", n + 1).into())
        }
    }
}

/// Refuses voxels of a property that has none.
pub(super) fn check_voxels(
    scene: &Scene,
    targets: &[Target],
    effect: &Effect<String>,
) -> Result<(), String> {
    let Change::Property(PropertyChange { property, .. }) = &effect.change else { return Ok(()) };
    for target in targets {
        let Target::Medium(m) = target else {
            let name = &effect.target;
            return Err(format!(
                "`voxels`: only the grids of a medium have voxels; `{name}` is none"
            ));
        };
        let medium = &scene.media[*m].item;
        let voxels = Property::from_name(property).and_then(|p| medium.voxels(p));
        if voxels.is_none() {
            let name = &effect.target;
            return Err(format!("`voxels`: {property} of `{name}` has no grid, and so no voxels"));
        }
    }
    Ok(())
}

fn affine(rows: [[f64; 4]; 3]) -> Affine {
    let row = |i: usize| Vec3::from([rows[i][0], rows[i][1], rows[i][2]]);
    Affine {
        linear: Mat3::from_rows(row(0), row(1), row(2)),
        translation: Vec3::from(rows.map(|r| r[3])),
    }
}

fn property(keys: &keys::Effect) -> Result<Option<PropertyChange>, String> {
    let Some(property) = keys.property.clone() else {
        let stray = [
            ("add", keys.add.is_some()),
            ("multiply", keys.multiply.is_some()),
            ("log", keys.log.is_some()),
            ("voxels", keys.voxels.is_some()),
            ("texels", keys.texels.is_some()),
        ];
        return match stray.iter().find(|(_, given)| *given) {
            Some((key, _)) => Err(format!("`{key}` belongs to a `property`, which is missing")),
            None => Ok(None),
        };
    };
    let op = match (keys.add, keys.multiply, keys.log) {
        (Some(a), None, None) => ValueChange::Add(Rgb::from(a.0)),
        (None, Some(m), None | Some(false)) => ValueChange::Multiply(m),
        (None, Some(m), Some(true)) => ValueChange::MultiplyLog(m),
        (Some(_), None, Some(_)) => return Err("`log` belongs to `multiply`".into()),
        _ => return Err("a `property` needs either `add` or `multiply`".into()),
    };
    let finite = match op {
        ValueChange::Add(a) => a.is_finite(),
        ValueChange::Multiply(m) | ValueChange::MultiplyLog(m) => m.is_finite(),
    };
    if !finite {
        return Err(format!("`{}` is not finite", op.kind()));
    }
    let voxels = match keys.voxels {
        None | Some(Voxels::All(_)) => None,
        Some(Voxels::One(voxel)) => Some(voxel.0),
    };
    let texels = keys.texels.map(|texels| match texels {
        keys::Texels::All(_) => Texels::All,
        keys::Texels::One(texel) => Texels::One(texel.0),
    });
    Ok(Some(PropertyChange { property, op, voxels, texels }))
}
