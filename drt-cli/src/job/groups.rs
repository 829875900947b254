//! From `[[parameter_group]]` to many parameters at once.

use std::path::Path;
use std::sync::Arc;

use drt_estimators::surface;
use drt_estimators::{Scene, SceneGradient, Target};
use drt_geom::Mesh;
use drt_motion::mean_value::{Cage, CageWeights};
use drt_motion::surface::{SmoothNormals, in_file_order};
use toml::Spanned;

use super::cages::Cages;
use super::document::Document;
use super::keys;
use crate::CliError;

/// Parameters that are all zero in the scene's file and too many to name.
#[derive(Clone, Debug)]
pub struct ParameterGroup {
    /// What they change.
    pub target: Target,
    kind: GroupKind,
}

#[derive(Clone, Debug)]
enum GroupKind {
    /// The x, y and z of each vertex of the shape's file.
    Vertices,
    /// The x, y and z of each vertex of a cage around the shape.
    Cage(Arc<Mesh>),
    /// Each voxel's value, channel by channel.
    Voxels(drt_medium::Property),
    /// Each texel's value, channel by channel; of a number, that alone.
    Texels { of: surface::Property, number: bool },
    /// Each texel's value of the image that tells an emitter's light.
    LightTexels,
}

pub(super) fn groups(
    document: &Document<'_>,
    keys: &[Spanned<keys::ParameterGroup>],
    folder: &Path,
    scene: &Scene,
) -> Result<Vec<ParameterGroup>, CliError> {
    let mut cages = Cages::default();
    keys.iter()
        .map(|spanned| {
            let fail = |message: String| {
                document.error_at(spanned.span().start, format!("[[parameter_group]]: {message}"))
            };
            let keys = spanned.get_ref();
            let target = scene.find(&keys.target).map_err(|e| fail(e.to_string()))?;
            let wrong = |what: &str| fail(format!("`{}` is not {what}", keys.target));
            let kind = match (&keys.vertices, &keys.cage, &keys.voxels, &keys.texels) {
                (Some(_), None, None, None) => GroupKind::Vertices,
                (None, Some(cage), None, None) => {
                    let mesh = cages.load(&folder.join(&cage.mesh));
                    GroupKind::Cage(mesh.map_err(|refusal| refusal.told(fail))?)
                }
                (None, None, Some(_), None) => {
                    GroupKind::Voxels(property(keys.property.as_deref()).map_err(fail)?)
                }
                (None, None, None, Some(_)) => {
                    return texels(scene, target, keys.property.as_deref()).map_err(fail);
                }
                _ => {
                    return Err(fail(
                        "expected one of `vertices`, `cage`, `voxels` and `texels`".into(),
                    ));
                }
            };
            match (&kind, target) {
                (GroupKind::Voxels(property), Target::Medium(m)) => {
                    match scene.media[m].item.voxels(*property) {
                        Some(_) => Ok(ParameterGroup { target, kind }),
                        None => Err(wrong("a medium with a grid of that property")),
                    }
                }
                (GroupKind::Voxels(_), _) => Err(wrong("a medium with a grid")),
                (_, Target::Shape(_)) => Ok(ParameterGroup { target, kind }),
                _ => Err(wrong("a shape")),
            }
        })
        .collect()
}

/// The texels that stand for a property of a target, or of the BSDF that it has.
fn texels(scene: &Scene, target: Target, property: Option<&str>) -> Result<ParameterGroup, String> {
    let name = property.ok_or("`texels` need the `property` that they stand for")?;
    let no_texture = || format!("no texture stands for `{name}` whose texels could change");
    let target = match target {
        Target::Shape(s) if name == "radiance" => {
            Target::Emitter(scene.shapes[s].emitter.ok_or_else(no_texture)?)
        }
        Target::Shape(s) => Target::Bsdf(scene.shapes[s].bsdf),
        other => other,
    };
    let b = match target {
        Target::Bsdf(b) => b,
        Target::Emitter(e) => {
            let emitter = &scene.emitters[e].item.emitter;
            emitter.property(name).map_err(|e| e.to_string())?;
            emitter.texels().ok_or_else(no_texture)?;
            return Ok(ParameterGroup { target, kind: GroupKind::LightTexels });
        }
        _ => return Err("only textures of BSDFs and emitters have texels".into()),
    };
    let of = surface::Property::from_name(name).map_err(|e| e.to_string())?;
    let bsdf = &scene.bsdfs[b].item;
    if bsdf.texels(of).is_none() {
        return Err(no_texture());
    }
    if let Some(reason) = bsdf.undifferentiated(of) {
        let bsdf = bsdf.name();
        let error = surface::SurfaceError::NotDifferentiated { bsdf, property: of, reason };
        return Err(error.to_string());
    }
    let number = bsdf.is_number(of) == Some(true);
    Ok(ParameterGroup { target, kind: GroupKind::Texels { of, number } })
}

fn property(name: Option<&str>) -> Result<drt_medium::Property, String> {
    match name {
        Some("sigma_t") => Ok(drt_medium::Property::SigmaT),
        Some("albedo") => Ok(drt_medium::Property::Albedo),
        Some("emission") => Ok(drt_medium::Property::Emission),
        _ => Err("`voxels` need `property`: sigma_t, albedo or emission".into()),
    }
}

impl ParameterGroup {
    /// What adds the group's part to gradients of a loss. `given` is the scene as the file has it, `scene` the one that
    /// is differentiated.
    pub fn collector(&self, given: &Scene, scene: &Scene) -> Collector {
        Collector(self.part(given, scene))
    }

    fn part(&self, given: &Scene, scene: &Scene) -> Part {
        match (&self.kind, self.target) {
            (GroupKind::Voxels(property), Target::Medium(m)) => Part::Voxels(m, *property),
            (GroupKind::LightTexels, Target::Emitter(e)) => Part::LightTexels(e),
            (GroupKind::Texels { of, number }, Target::Bsdf(b)) => {
                Part::Texels { bsdf: b, of: *of, number: *number }
            }
            (kind, Target::Shape(s)) => {
                let (file, mesh) = (given.shapes[s].mesh.clone(), scene.shapes[s].mesh.clone());
                let weights = match kind {
                    // It was loaded as a cage.
                    GroupKind::Cage(cage) => match Cage::new(cage) {
                        Ok(cage) => Some(CageWeights::new(&cage, &file.positions)),
                        Err(_) => return Part::Nothing,
                    },
                    _ => None,
                };
                let normals = SmoothNormals::new(&mesh);
                Part::Shape { shape: s, file, mesh, normals, weights }
            }
            _ => Part::Nothing,
        }
    }
}

/// Takes a group's part out of gradients of a loss.
pub struct Collector(Part);

/// What the part of a group is in a gradient.
enum Part {
    Voxels(usize, drt_medium::Property),
    Texels {
        bsdf: usize,
        of: surface::Property,
        number: bool,
    },
    LightTexels(usize),
    Shape {
        shape: usize,
        /// As the file has it.
        file: Arc<Mesh>,
        mesh: Arc<Mesh>,
        normals: SmoothNormals,
        /// What a cage's vertices weigh at those of the shape.
        weights: Option<CageWeights>,
    },
    Nothing,
}

impl Collector {
    /// Adds the group's part to the gradient of a loss.
    pub fn collect(&self, gradient: &SceneGradient, out: &mut Vec<f64>) {
        match &self.0 {
            Part::Voxels(m, property) => {
                let Some(of) = &gradient.media[*m] else { return };
                match property {
                    drt_medium::Property::SigmaT => out.extend(&of.sigma_t.voxels),
                    drt_medium::Property::Albedo => out.extend(&of.albedo.voxels),
                    drt_medium::Property::Emission => out.extend(&of.emission.voxels),
                    // Has no voxels.
                    drt_medium::Property::G => {}
                }
            }
            Part::Texels { bsdf, of, number } => {
                let textures = gradient.texels[*bsdf].iter().filter(|(p, _)| p == of);
                for (_, texels) in textures {
                    let values = texels.values();
                    if *number {
                        out.extend(values.iter().map(|v| v.sum()));
                    } else {
                        out.extend(values.iter().flat_map(|v| v.to_array()));
                    }
                }
            }
            Part::LightTexels(emitter) => {
                let Some(texels) = &gradient.emitter_texels[*emitter] else { return };
                out.extend(texels.values().iter().flat_map(|v| v.to_array()));
            }
            Part::Shape { shape, file, mesh, normals, weights } => {
                let Some(of) = &gradient.shapes[*shape] else { return };
                let vertices = of.finish(mesh, normals);
                let vectors = match weights {
                    Some(weights) => weights.gather(&vertices),
                    None => in_file_order(file, &vertices),
                };
                out.extend(vectors.iter().flat_map(|v| [v.x, v.y, v.z]));
            }
            Part::Nothing => {}
        }
    }
}
