//! From `[[parameter_group]]` to many parameters at once.

use std::path::Path;

use drt_estimators::fit::{Group, GroupKind};
use drt_estimators::{Scene, Target, surface};
use drt_motion::optimize::Stages;
use toml::Spanned;

use super::cages::Cages;
use super::document::Document;
use super::keys;
use super::list::List;
use crate::CliError;

/// Parameters that are too many to name, and how a fit steps them.
#[derive(Clone, Debug)]
pub struct ParameterGroup {
    /// What they are.
    pub group: Group,
    /// How they are stepped.
    pub steps: GroupSteps,
}

/// How a fit steps a group.
#[derive(Clone, Debug)]
pub struct GroupSteps {
    /// The learning rate by iteration; the optimizer's where it is `None`.
    pub learning_rate: Option<Stages<f64>>,
    /// λ of the preconditioner (I + λ L)⁻², L being the combinatorial Laplacian of the mesh; 0 is none.
    pub laplacian: f64,
    /// Weight of total variation (voxels, texels), or of the Laplacian's energy (vertices).
    pub smooth: f64,
    /// Least and largest value.
    pub bounds: [f64; 2],
    /// The logarithm is stepped.
    pub log: bool,
}

impl GroupSteps {
    /// The steps of unknowns of some kind, or of one number if there is none, as the text of a TOML table says by the keys of a
    /// `[[parameter_group]]`: `learning_rate`, `laplacian`, `smooth`, `bounds` and `log`.
    ///
    /// # Errors
    /// Names the key.
    pub fn from_text(text: &str, kind: Option<&GroupKind>) -> Result<Self, CliError> {
        let keys: keys::Steps =
            toml::from_str(text).map_err(|e| CliError::argument(e.message().to_string()))?;
        steps(&keys, kind).map_err(CliError::argument)
    }
}

impl From<Group> for ParameterGroup {
    /// A group whose values stay in the range in which they have a meaning.
    fn from(group: Group) -> Self {
        let bounds = range(&group.kind);
        let steps =
            GroupSteps { learning_rate: None, laplacian: 0.0, smooth: 0.0, bounds, log: false };
        Self { group, steps }
    }
}

pub(super) fn groups(
    document: &Document<'_>,
    keys: &[Spanned<keys::ParameterGroup>],
    folder: &Path,
    scene: &Scene,
) -> Result<Vec<ParameterGroup>, CliError> {
    let mut cages = Cages::default();
    let mut groups: Vec<ParameterGroup> = Vec::new();
    for spanned in keys {
        let fail = |message: String| {
            document.error_at(spanned.span().start, format!("[[parameter_group]]: {message}"))
        };
        let keys = spanned.get_ref();
        let (target, kind) = match &keys.cage {
            Some(cage) => {
                let mesh = cages.load(&folder.join(&cage.mesh));
                let mesh = mesh.map_err(|refusal| refusal.told(fail))?;
                alone(keys).map_err(fail)?;
                let target = scene.find(&keys.target).map_err(|e| fail(e.to_string()))?;
                (target, GroupKind::Cage(mesh))
            }
            None => unknowns(scene, keys).map_err(fail)?,
        };
        let shape = matches!(kind, GroupKind::Vertices | GroupKind::Cage(_));
        if shape && !matches!(target, Target::Shape(_)) {
            return Err(fail(format!("`{}` is not a shape", keys.target)));
        }
        let taken = |name: &str| groups.iter().any(|g| g.group.name == name);
        let name = match &keys.name {
            Some(name) => name.clone(),
            None if taken(&keys.target) => format!("{}-{}", keys.target, what(keys, &kind)),
            None => keys.target.clone(),
        };
        if name.is_empty() || name.contains(['/', '\\', ',', '"']) || name.starts_with('.') {
            return Err(fail(format!("`name`: \"{name}\" cannot be the name of a file")));
        }
        if taken(&name) {
            return Err(fail(format!("there are two groups `{name}`; expected a `name` of each")));
        }
        let steps = steps(&keys.steps(), Some(&kind)).map_err(fail)?;
        let group = Group::new(name, scene, &target, kind).map_err(|e| fail(e.to_string()))?;
        groups.push(ParameterGroup { group, steps });
    }
    Ok(groups)
}

/// A word for what the unknowns are.
fn what(keys: &keys::ParameterGroup, kind: &GroupKind) -> String {
    match kind {
        GroupKind::Vertices => "vertices".into(),
        GroupKind::Cage(_) => "cage".into(),
        _ => keys.property.clone().unwrap_or_default(),
    }
}

/// Refuses more than one kind of unknowns.
fn alone(keys: &keys::ParameterGroup) -> Result<(), String> {
    let kinds = [
        keys.vertices.is_some(),
        keys.cage.is_some(),
        keys.voxels.is_some(),
        keys.texels.is_some(),
    ];
    match kinds.into_iter().filter(|given| *given).count() {
        1 => Ok(()),
        _ => Err("expected one of `vertices`, `cage`, `voxels` and `texels`".into()),
    }
}

fn unknowns(scene: &Scene, keys: &keys::ParameterGroup) -> Result<(Target, GroupKind), String> {
    alone(keys)?;
    let target = scene.find(&keys.target).map_err(|e| e.to_string())?;
    if keys.vertices.is_some() {
        return Ok((target, GroupKind::Vertices));
    }
    if keys.texels.is_some() {
        return texels(scene, target, keys.property.as_deref());
    }
    let property = property(keys.property.as_deref())?;
    let wrong = |what: &str| Err(format!("`{}` is not {what}", keys.target));
    match target {
        Target::Medium(m) if scene.media[m].item.voxels(property).is_some() => {
            Ok((target, GroupKind::Voxels(property)))
        }
        Target::Medium(_) => wrong("a medium with a grid of that property"),
        _ => wrong("a medium with a grid"),
    }
}

/// The texels that stand for a property of a target, or of the BSDF that it has.
fn texels(
    scene: &Scene,
    target: Target,
    property: Option<&str>,
) -> Result<(Target, GroupKind), String> {
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
            return Ok((target, GroupKind::LightTexels));
        }
        _ => return Err("only textures of BSDFs and emitters have texels".into()),
    };
    let bsdf = &scene.bsdfs[b].item;
    let property = bsdf.named_property(name).map_err(|e| e.to_string())?;
    if bsdf.texels(property).is_none() {
        return Err(no_texture());
    }
    if let Some(reason) = bsdf.undifferentiated(property) {
        let bsdf = bsdf.name();
        let error = surface::SurfaceError::NotDifferentiated { bsdf, property, reason };
        return Err(error.to_string());
    }
    let number = bsdf.is_number(property) == Some(true);
    Ok((target, GroupKind::Texels { property, number }))
}

fn property(name: Option<&str>) -> Result<drt_medium::Property, String> {
    name.and_then(drt_medium::Property::from_name).ok_or_else(|| {
        let names = drt_medium::Property::ALL.map(drt_medium::Property::name).join(", ");
        format!("`voxels` need a `property`, one of {names}")
    })
}

/// How far from zero a fit takes mean cosines where nothing else is said: at 1 nothing is scattered aside.
const SHARPEST_G: f64 = 0.99;

const UNBOUNDED: [f64; 2] = [f64::NEG_INFINITY, f64::INFINITY];

/// The range in which values of a kind have a meaning.
fn range(kind: &GroupKind) -> [f64; 2] {
    match kind {
        GroupKind::Voxels(drt_medium::Property::Albedo | drt_medium::Property::Weight) => {
            [0.0, 1.0]
        }
        GroupKind::Voxels(drt_medium::Property::G) => [-SHARPEST_G, SHARPEST_G],
        GroupKind::Voxels(drt_medium::Property::SggxOffDiagonal) => UNBOUNDED,
        GroupKind::Voxels(_) | GroupKind::LightTexels => [0.0, f64::INFINITY],
        GroupKind::Texels { property, .. } => property.range(),
        _ => UNBOUNDED,
    }
}

/// How a group is stepped. Values stay in the range in which they have a meaning, where nothing else is said.
fn steps(keys: &keys::Steps, kind: Option<&GroupKind>) -> Result<GroupSteps, String> {
    let of_shape = matches!(kind, Some(GroupKind::Vertices | GroupKind::Cage(_)));
    let bounds = keys.bounds.map_or(kind.map_or(UNBOUNDED, range), |List(bounds)| bounds);
    let [lower, upper] = bounds;
    if lower.partial_cmp(&upper) != Some(core::cmp::Ordering::Less) {
        return Err(format!("`bounds`: [{}, {}]; expected a range", bounds[0], bounds[1]));
    }
    let not_negative = |name: &str, value: Option<f64>| match value.unwrap_or(0.0) {
        value if value >= 0.0 && value.is_finite() => Ok(value),
        value => Err(format!("`{name}` is {value}; expected a number that is not negative")),
    };
    let laplacian = not_negative("laplacian", keys.laplacian)?;
    if laplacian > 0.0 && !of_shape {
        return Err("`laplacian` goes with `vertices` and `cage`".into());
    }
    let log = keys.log.unwrap_or(false);
    if laplacian > 0.0 && (log || bounds != UNBOUNDED) {
        return Err("`laplacian` does not go with `bounds` or `log`".into());
    }
    let learning_rate = match &keys.learning_rate {
        None => None,
        Some(keys::GroupRate::All(rate)) => Some(Stages::new(*rate, Vec::new())),
        Some(keys::GroupRate::Stages(stages)) => {
            let stage = |List([from, rate]): &List<f64, 2>| {
                let whole = *from >= 0.0 && from.fract() == 0.0 && *from <= f64::from(u32::MAX);
                whole.then_some((*from as u32, *rate)).ok_or_else(|| {
                    format!("`learning_rate`: a stage begins at iteration {from}; expected a whole number")
                })
            };
            let stages = stages.iter().map(stage).collect::<Result<Vec<_>, _>>()?;
            let Some((_, first)) = stages.first().copied() else {
                return Err("`learning_rate`: there are no stages".into());
            };
            Some(Stages::new(first, stages))
        }
    };
    let smooth = not_negative("smooth", keys.smooth)?;
    if smooth > 0.0 && kind.is_none() {
        return Err("`smooth` goes with groups".into());
    }
    Ok(GroupSteps { learning_rate, laplacian, smooth, bounds, log })
}
