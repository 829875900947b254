//! Groups of very many unknowns of one kind: vertices of a shape or of a cage around it, voxels, texels.
//!
//! The values of a group are absolute, in the order and the units of the scene that a fit is given: positions in the
//! scene's coordinates in the order of the shape's file, voxels as the grid stores them (before its scale), texels as
//! the texture stores them, channel by channel. They are set before any parameter acts. The gradient is with respect to
//! these values: it is propagated back through parameters that move the shape.

use alloc::format;
use alloc::string::{String, ToString};
use alloc::sync::Arc;
use alloc::vec::Vec;

use drt_geom::Mesh;
use drt_math::{Mat3, Rgb, Vec3, vec3};
use drt_motion::mean_value::{Cage, CageWeights};
use drt_motion::parameter::Applied;
use drt_motion::surface::{SmoothNormals, in_file_order, move_mesh};
use drt_motion::{Change, GeometryChange, Parameter};

use crate::derivative::scene_gradient::SceneGradient;
use crate::model::error::Error;
use crate::model::scene::{Named, Scene, Target, TargetName};
use crate::model::surface;

/// Very many unknowns of one kind.
#[derive(Clone, Debug)]
pub struct Group {
    /// Name of the group, for messages and files.
    pub name: String,
    /// The item of the scene that the unknowns change.
    pub target: Target,
    /// The kind of unknowns.
    pub kind: GroupKind,
}

/// The kind of unknowns of a [`Group`].
#[derive(Clone, Debug)]
#[non_exhaustive]
pub enum GroupKind {
    /// The x, y and z of each vertex of the shape's file.
    Vertices,
    /// The x, y and z of each vertex of a cage around the shape, which follows by mean value coordinates.
    Cage(Arc<Mesh>),
    /// Each voxel's value, channel by channel.
    Voxels(drt_medium::Property),
    /// Each texel's value of a property's texture, channel by channel; one value per texel where the property is a
    /// number.
    Texels {
        /// The property that has the texture.
        property: surface::Property,
        /// The property is a number.
        number: bool,
    },
    /// Each texel's value of the image of an emitter's light, channel by channel.
    LightTexels,
}

impl Group {
    /// A group of a scene's unknowns.
    ///
    /// # Errors
    /// When the target has no such unknowns, a cage is not closed, or its vertices are not those of a polyhedron.
    pub fn new(
        name: impl Into<String>,
        scene: &Scene,
        target: &impl TargetName,
        kind: GroupKind,
    ) -> Result<Self, Error> {
        let group = Self { name: name.into(), target: target.find_in(scene)?, kind };
        if let GroupKind::Cage(cage) = &group.kind {
            Cage::new(cage).map_err(|e| group.refusal(&e))?;
        }
        if group.count(scene) == 0 {
            return Err(group.refusal(&"its target has no such values"));
        }
        Ok(group)
    }

    /// What a [gradient](crate::Session::gradient) has to be by, so that the group can [collect](Self::collector) its part.
    #[must_use]
    pub fn wanted(&self) -> Target {
        match (&self.kind, self.target) {
            (GroupKind::Voxels(_), Target::Medium(m)) => Target::Coefficients(m),
            (_, target) => target,
        }
    }

    /// Groups of all vertices, voxels and texels of a scene that have gradients, named by their targets and by what
    /// they are: `cube.vertices`, `smoke.sigma_t`, `wall.reflectance`, `sky.radiance`. Vertices of instances are left
    /// out: they have gradients in an [expanded](Scene::expanded) scene.
    #[must_use]
    pub fn all(scene: &Scene) -> Vec<Self> {
        let mut groups = Vec::new();
        let mut add = |target, what: &str, kind| {
            let name = format!("{}.{what}", scene.name_of(target));
            groups.push(Self { name, target, kind });
        };
        let instanced = |s: &usize| scene.instances.iter().any(|instance| instance.shape == *s);
        for s in (0..scene.shapes.len()).filter(|s| !instanced(s)) {
            add(Target::Shape(s), "vertices", GroupKind::Vertices);
        }
        for (m, medium) in scene.media.iter().enumerate() {
            for property in drt_medium::Property::ALL {
                if medium.item.voxels(property).is_some() {
                    add(Target::Medium(m), property.name(), GroupKind::Voxels(property));
                }
            }
        }
        for (b, Named { item: bsdf, .. }) in scene.bsdfs.iter().enumerate() {
            for property in bsdf.differentiated().iter() {
                let number = bsdf.is_number(property) == Some(true);
                if bsdf.texels(property).is_some() && bsdf.undifferentiated(property).is_none() {
                    let kind = GroupKind::Texels { property, number };
                    add(Target::Bsdf(b), property.name(), kind);
                }
            }
        }
        for (e, emitter) in scene.emitters.iter().enumerate() {
            if emitter.item.emitter.texels().is_some() {
                add(Target::Emitter(e), "radiance", GroupKind::LightTexels);
            }
        }
        groups
    }

    /// Refuses groups that would set the same values. Each of them has its gradient, but only one of them can step.
    ///
    /// # Errors
    /// For the first group that decides values of one before it.
    pub fn check_together(groups: &[Self]) -> Result<(), Error> {
        for (i, group) in groups.iter().enumerate() {
            let same = |other: &&Self| {
                other.target == group.target
                    && match (&other.kind, &group.kind) {
                        (GroupKind::Voxels(a), GroupKind::Voxels(b)) => a == b,
                        (
                            GroupKind::Texels { property: a, .. },
                            GroupKind::Texels { property: b, .. },
                        ) => a == b,
                        _ => true,
                    }
            };
            if let Some(other) = groups[..i].iter().find(same) {
                let message = format!("group {} changes the same values", other.name);
                return Err(group.refusal(&message));
            }
        }
        Ok(())
    }

    fn refusal(&self, reason: &dyn ToString) -> Error {
        Error::Group { group: self.name.clone(), reason: reason.to_string() }
    }

    /// The number of values of the group in a scene.
    #[must_use]
    pub fn count(&self, scene: &Scene) -> usize {
        match (&self.kind, self.target) {
            (GroupKind::Voxels(property), Target::Medium(m)) => {
                scene.media[m].item.voxels(*property).map_or(0, |grid| grid.values().len())
            }
            _ => self.values(scene).len(),
        }
    }

    /// The lengths of the axes of the group's values, the last of which varies fastest: vertices × 3, voxels of z × y × x,
    /// or rows × columns of texels, with another axis where these have several channels.
    #[must_use]
    pub fn shape(&self, scene: &Scene) -> Vec<usize> {
        let of_image = |size: Option<[u32; 2]>| {
            size.map_or_else(Vec::new, |[w, h]| alloc::vec![h as usize, w as usize])
        };
        let mut shape = match (&self.kind, self.target) {
            (GroupKind::Vertices, Target::Shape(s)) => {
                alloc::vec![scene.shapes[s].mesh.source_vertex_count as usize]
            }
            (GroupKind::Cage(cage), _) => alloc::vec![cage.positions.len()],
            (GroupKind::Voxels(property), Target::Medium(m)) => {
                let grid = scene.media[m].item.voxels(*property);
                grid.map_or_else(Vec::new, |grid| grid.size().into_iter().rev().collect())
            }
            (GroupKind::Texels { property, .. }, Target::Bsdf(b)) => {
                of_image(scene.bsdfs[b].item.texels(*property))
            }
            (GroupKind::LightTexels, Target::Emitter(e)) => {
                of_image(scene.emitters[e].item.emitter.texels())
            }
            _ => Vec::new(),
        };
        let channels = self.count(scene) / shape.iter().product::<usize>().max(1);
        if channels != 1 {
            shape.push(channels);
        }
        shape
    }

    /// The values of the group in a scene; for a cage, the positions of its vertices.
    #[must_use]
    pub fn values(&self, scene: &Scene) -> Vec<f64> {
        let coordinates = |positions: &[Vec3]| -> Vec<f64> {
            positions.iter().flat_map(|p| p.to_array()).collect()
        };
        match (&self.kind, self.target) {
            (GroupKind::Vertices, Target::Shape(s)) => {
                let mesh = &scene.shapes[s].mesh;
                let mut positions = alloc::vec![Vec3::ZERO; mesh.source_vertex_count as usize];
                for (i, p) in (0..).zip(&mesh.positions) {
                    positions[mesh.source_vertex(i) as usize] = *p;
                }
                coordinates(&positions)
            }
            (GroupKind::Cage(cage), Target::Shape(_)) => coordinates(&cage.positions),
            (GroupKind::Voxels(property), Target::Medium(m)) => {
                let grid = scene.media[m].item.voxels(*property);
                grid.map_or_else(Vec::new, |grid| grid.values().to_vec())
            }
            (GroupKind::Texels { property, number }, Target::Bsdf(b)) => {
                let texels = scene.bsdfs[b].item.texel_values(*property).unwrap_or_default();
                match number {
                    true => texels.iter().map(|v| v.r).collect(),
                    false => texels.iter().flat_map(|v| v.to_array()).collect(),
                }
            }
            (GroupKind::LightTexels, Target::Emitter(e)) => {
                let texels = scene.emitters[e].item.emitter.texel_values().unwrap_or_default();
                texels.iter().flat_map(|v| v.to_array()).collect()
            }
            _ => Vec::new(),
        }
    }

    /// Sets the group's values in a `scene`, where `given` is the scene that the group was made for. In `scene`, only
    /// other groups may have been set before.
    ///
    /// # Errors
    /// When the number of values is wrong, or a value is not finite or out of its range.
    pub fn apply(&self, given: &Scene, values: &[f64], scene: &mut Scene) -> Result<(), Error> {
        let start = self.values(given);
        if start.len() != values.len() {
            let (found, expected) = (values.len(), start.len());
            return Err(self.refusal(&format!("{found} values for {expected} unknowns")));
        }
        if let Some(value) = values.iter().find(|v| !v.is_finite()) {
            return Err(self.refusal(&format!("a value is {value}")));
        }
        let change: Vec<f64> = values.iter().zip(&start).map(|(v, s)| v - s).collect();
        let vectors = |numbers: &[f64]| -> Vec<Vec3> {
            numbers.chunks_exact(3).map(|c| vec3(c[0], c[1], c[2])).collect()
        };
        match (&self.kind, self.target) {
            (GroupKind::Vertices, Target::Shape(s)) => {
                let change = GeometryChange::VertexVelocity(vectors(&change).into());
                self.deform(given, scene, s, &change)
            }
            (GroupKind::Cage(cage), Target::Shape(s)) => {
                let vertices = (0..).zip(vectors(&change)).collect();
                let change = GeometryChange::Cage { mesh: cage.clone(), vertices };
                self.deform(given, scene, s, &change)
            }
            (GroupKind::Voxels(property), Target::Medium(m)) => {
                let mut medium = scene.media[m].item.clone();
                let scale = medium.voxel_scale(*property);
                let step: Vec<f64> = change.iter().map(|c| c * scale).collect();
                medium.add_to_voxels(*property, &step).map_err(|e| self.refusal(&e))?;
                medium.check(*property).map_err(|e| self.refusal(&e))?;
                scene.media[m].item = medium;
                Ok(())
            }
            (GroupKind::Texels { property, number }, Target::Bsdf(b)) => {
                let texels: Vec<Rgb> = match number {
                    true => values.iter().map(|v| Rgb::splat(*v)).collect(),
                    false => vectors(values).iter().map(|v| Rgb::from(v.to_array())).collect(),
                };
                let with = scene.bsdfs[b].item.with_texel_values(*property, &texels);
                scene.bsdfs[b].item = with.map_err(|e| self.refusal(&e))?;
                Ok(())
            }
            (GroupKind::LightTexels, Target::Emitter(e)) => {
                let texels: Vec<Rgb> =
                    vectors(values).iter().map(|v| Rgb::from(v.to_array())).collect();
                let with = scene.emitters[e].item.emitter.with_texel_values(&texels);
                scene.emitters[e].item.emitter = with.map_err(|e| self.refusal(&e))?;
                Ok(())
            }
            _ => Ok(()),
        }
    }

    fn deform(
        &self,
        given: &Scene,
        scene: &mut Scene,
        shape: usize,
        change: &GeometryChange,
    ) -> Result<(), Error> {
        let changes = [Applied { parameter: 0, theta: 1.0, change }];
        let moved = move_mesh(&given.shapes[shape].mesh, &changes, 1);
        scene.shapes[shape].mesh = Arc::new(moved.map_err(|e| self.refusal(&e))?.mesh);
        Ok(())
    }

    /// The collector that extracts the group's part from gradients with respect to its target. `given` is the scene
    /// that the group was made for, `scene` the one that is differentiated, on which the parameters have acted.
    ///
    /// # Errors
    /// When a parameter moves single vertices of the group's shape, through which gradients cannot be propagated back.
    pub fn collector(
        &self,
        given: &Scene,
        scene: &Scene,
        parameters: &[Parameter],
    ) -> Result<Collector, Error> {
        let take = match (&self.kind, self.target) {
            (GroupKind::Voxels(property), Target::Medium(m)) => {
                Take::Voxels(m, *property, given.media[m].item.voxel_scale(*property))
            }
            (GroupKind::LightTexels, Target::Emitter(e)) => Take::LightTexels(e),
            (GroupKind::Texels { property, number }, Target::Bsdf(b)) => {
                Take::Texels { bsdf: b, property: *property, number: *number }
            }
            (kind, Target::Shape(s)) => {
                let (file, mesh) = (given.shapes[s].mesh.clone(), scene.shapes[s].mesh.clone());
                let weights = match kind {
                    GroupKind::Cage(cage) => {
                        let cage = Cage::new(cage).map_err(|e| self.refusal(&e))?;
                        Some(CageWeights::new(&cage, &file.positions))
                    }
                    _ => None,
                };
                let pull_back = self.linear_part(given, s, parameters)?.transpose();
                let normals = SmoothNormals::new(&mesh);
                let of = OfShape { shape: s, file, mesh, normals, weights, pull_back };
                Take::Shape(of.into())
            }
            _ => Take::Nothing,
        };
        Ok(Collector(take))
    }

    /// The linear part of what parameters do to a shape.
    fn linear_part(
        &self,
        scene: &Scene,
        shape: usize,
        parameters: &[Parameter],
    ) -> Result<Mat3, Error> {
        let mut linear = Mat3::IDENTITY;
        for (parameter, effect) in
            parameters.iter().flat_map(|p| p.effects.iter().map(move |e| (p, e)))
        {
            let Change::Geometry(change) = &effect.change else { continue };
            if effect.target.as_str().find_in(scene)? != Target::Shape(shape) {
                continue;
            }
            match change.affine(parameter.value) {
                Some(map) => linear = map.linear * linear,
                None if parameter.value == 0.0 => {}
                None => {
                    let name = &parameter.name;
                    return Err(self.refusal(&format!(
                        "parameter `{name}` moves single vertices of its shape; expected affine changes beside a group"
                    )));
                }
            }
        }
        Ok(linear)
    }
}

/// Extracts a [`Group`]'s part from gradients.
#[derive(Debug)]
pub struct Collector(Take);

#[derive(Debug)]
enum Take {
    Voxels(usize, drt_medium::Property, f64),
    Texels { bsdf: usize, property: surface::Property, number: bool },
    LightTexels(usize),
    Shape(alloc::boxed::Box<OfShape>),
    Nothing,
}

#[derive(Debug)]
struct OfShape {
    shape: usize,
    /// As it was before the group changed it.
    file: Arc<Mesh>,
    /// As it is.
    mesh: Arc<Mesh>,
    normals: SmoothNormals,
    /// The weights of a cage's vertices, where the group has those.
    weights: Option<CageWeights>,
    /// The transpose of the linear map that parameters make.
    pull_back: Mat3,
}

impl Collector {
    /// Adds the group's part of the gradient of a loss, times a weight, to numbers for its values, in their order.
    pub fn add_to(&self, gradient: &SceneGradient, weight: f64, numbers: &mut [f64]) {
        let add = |numbers: &mut [f64], part: &mut dyn Iterator<Item = f64>| {
            numbers.iter_mut().zip(part).for_each(|(number, g)| *number += weight * g);
        };
        match &self.0 {
            Take::Voxels(m, property, scale) => {
                let Some(of) = &gradient.media[*m] else { return };
                if let Some(voxels) = &of.field(*property).voxels {
                    voxels.add_to(numbers, weight * scale);
                }
            }
            Take::Texels { bsdf, property, number } => {
                let textures = gradient.texels[*bsdf].iter().filter(|(p, _)| p == property);
                for (_, texels) in textures {
                    let values = texels.values();
                    if *number {
                        add(numbers, &mut values.iter().map(|v| v.sum()));
                    } else {
                        add(numbers, &mut values.iter().flat_map(|v| v.to_array()));
                    }
                }
            }
            Take::LightTexels(emitter) => {
                let Some(texels) = &gradient.emitter_texels[*emitter] else { return };
                add(numbers, &mut texels.values().iter().flat_map(|v| v.to_array()));
            }
            Take::Shape(of) => {
                let Some(by_mesh) = &gradient.shapes[of.shape] else { return };
                let mut vertices = by_mesh.finish(&of.mesh, &of.normals);
                vertices.iter_mut().for_each(|v| *v = of.pull_back * *v);
                let vectors = match &of.weights {
                    Some(weights) => weights.gather(&vertices),
                    None => in_file_order(&of.file, &vertices),
                };
                add(numbers, &mut vectors.iter().flat_map(|v| v.to_array()));
            }
            Take::Nothing => {}
        }
    }
}
