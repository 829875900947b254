//! Groups of shapes, and instances of them: the meshes of a group are read once and shared.

use std::collections::{HashMap, HashSet};

use drt_estimators::surface::Bsdf;
use drt_estimators::{Instance, Named, Scene, Shape};
use drt_math::Affine;

use super::super::Loader;
use super::super::element::Element;
use super::super::properties::Properties;
use super::{SharedMeshes, takes_volumes};
use crate::CliError;

/// The groups of a scene.
#[derive(Default)]
pub(in super::super) struct Groups {
    /// The shapes of each, in its own space, by the ordinal of its element.
    shapes: HashMap<usize, Vec<Shape>>,
    /// Ordinals of the shapes that stand in one.
    inside: HashSet<usize>,
}

impl Groups {
    /// True for what is no surface where it stands: groups, and shapes in them.
    pub(in super::super) fn have(&self, e: &Element) -> bool {
        self.shapes.contains_key(&e.ordinal) || self.inside.contains(&e.ordinal)
    }
}

impl<'a> Loader<'a> {
    /// The groups among shapes.
    pub(in super::super) fn groups(
        &self,
        shapes: &[&'a Element],
        bsdfs: &mut Vec<Named<Bsdf>>,
        declared: usize,
    ) -> Result<Groups, CliError> {
        let mut groups = Groups::default();
        for e in shapes.iter().filter(|e| e.attribute("type") == Some("shapegroup")) {
            let p = Properties::of(e)?;
            let mut members = Vec::new();
            for inner in self.index.inner(&p, "shape", None) {
                if matches!(inner.target.attribute("type"), Some("shapegroup" | "instance")) {
                    let message =
                        "instances of instances are not supported: a shapegroup holds shapes alone";
                    return Err(inner.child.error(message));
                }
                if inner.child.tag == "shape" {
                    groups.inside.insert(inner.child.ordinal);
                }
                let own = SharedMeshes::default();
                let shape = self.shape(inner.target, bsdfs, declared, &own)?;
                let Some((shape, _)) = shape else { continue };
                if shape.emitter.is_some() {
                    return Err(inner
                        .child
                        .error("a shape of a shapegroup cannot carry an emitter"));
                }
                if takes_volumes(&bsdfs[shape.bsdf].item) {
                    return Err(inner.child.error(
                        "a `volume` texture in a shapegroup is not supported: its value is one for each place in the world",
                    ));
                }
                members.push(shape);
            }
            p.finish()?;
            if members.is_empty() {
                return Err(e.error("there is no shape in this shapegroup"));
            }
            groups.shapes.insert(e.ordinal, members);
        }
        Ok(groups)
    }

    /// Checks a `merge`, whose shapes are what they are without it: joining their meshes saves Mitsuba time.
    pub(in super::super) fn merged(&self, e: &'a Element) -> Result<(), CliError> {
        let p = Properties::of(e)?;
        let inner = self.index.inner(&p, "shape", None);
        if let Some(referred) = inner.iter().find(|inner| inner.child.tag != "shape") {
            return Err(referred.child.error("the shapes of a merge stand in it"));
        }
        if inner.is_empty() {
            return Err(e.error("there is no shape in this merge"));
        }
        p.finish()
    }

    /// Adds the shapes of an instance to a scene. Where there are several, their ids are that of the instance, a slash, and the id or the
    /// number of each.
    pub(in super::super) fn instance(
        &self,
        e: &'a Element,
        groups: &Groups,
        scene: &mut Scene,
    ) -> Result<(), CliError> {
        let p = Properties::of(e)?;
        let to_world = p.transform("to_world")?.unwrap_or(Affine::IDENTITY);
        if !(to_world.is_finite() && to_world.inverse().is_finite()) {
            return Err(e.error("`to_world` flattens the instance or is not finite"));
        }
        let group = self.index.single(&p, "shape", None)?;
        let group =
            group.ok_or_else(|| e.error("an instance refers to a shapegroup by a <ref>"))?;
        let Some(members) = groups.shapes.get(&group.target.ordinal) else {
            let message = format!("an instance is of a shapegroup, not of {}", group.target);
            return Err(group.child.error(message));
        };
        p.finish()?;
        for (i, member) in members.iter().enumerate() {
            let part = || member.id.clone().unwrap_or_else(|| i.to_string());
            let id = e.id().map(|id| match members.len() {
                1 => id.to_owned(),
                _ => format!("{id}/{}", part()),
            });
            scene.instances.push(Instance { shape: scene.shapes.len(), to_world });
            scene.shapes.push(Shape { id, ..member.clone() });
        }
        Ok(())
    }
}
