//! The file's parameters as effects on a scene.

use drt_math::{Affine, Mat3, Rgb, Vec3};
use drt_motion::{Change, Effect, GeometryChange, Parameter, PropertyChange, ValueChange};

use crate::Result;
use crate::detector::vector;
use crate::oracle::{ParameterText, Velocity};
use crate::region::{Plane, coordinate, shared_faces};
use crate::scene::{Built, DETECTOR};

/// The parameter that a text describes, at the scene as it was built.
///
/// # Errors
/// When the text names something the scene does not have, or a change of unknown kind.
pub fn parameter(built: &Built, text: &ParameterText) -> Result<Parameter> {
    let mut effects = Vec::new();
    for (what, velocity) in &text.velocity {
        effects.extend(motion(built, what, velocity)?);
    }
    if text.velocity.is_empty() {
        effects = scalar(built, &text.name)?;
    }
    Ok(Parameter { name: text.name.clone(), value: 0.0, effects })
}

/// A change of place or form.
#[must_use]
pub fn moves(target: &str, change: GeometryChange) -> Effect {
    Effect { target: target.into(), change: Change::Geometry(change) }
}

/// A change of a number.
#[must_use]
pub fn changes(target: &str, property: &str, op: ValueChange) -> Effect {
    let change = PropertyChange { property: property.into(), op, voxels: None, texels: None };
    Effect { target: target.into(), change: Change::Property(change) }
}

/// Everything that has a place: interfaces, media, other shapes, lights and the detector, moved by
/// one affine field.
#[must_use]
pub fn moves_everything(built: &Built, field: &Affine) -> Vec<Effect> {
    let scene = &built.scene;
    let shapes = scene.shapes.iter().filter_map(|s| s.id.as_deref());
    let grids = scene.media.iter().filter(|m| m.item.grid().is_some());
    let lights = scene.emitters.iter().filter_map(|e| e.id.as_deref()).filter(|id| *id != "sky");
    shapes
        .chain(grids.filter_map(|m| m.id.as_deref()))
        .chain(lights)
        .chain([DETECTOR])
        .map(|id| moves(id, GeometryChange::Matrix(*field)))
        .collect()
}

/// The same changes, `factor` times as fast.
#[must_use]
pub fn scaled(effects: &[Effect], factor: f64) -> Vec<Effect> {
    let scaled = |change: &Change| match change {
        Change::Geometry(GeometryChange::Translate(v)) => {
            Change::Geometry(GeometryChange::Translate(*v * factor))
        }
        Change::Geometry(GeometryChange::VertexVelocity(v)) => Change::Geometry(
            GeometryChange::VertexVelocity(v.iter().map(|v| *v * factor).collect()),
        ),
        Change::Geometry(GeometryChange::Matrix(m)) => {
            Change::Geometry(GeometryChange::Matrix(m.times(factor)))
        }
        &Change::Geometry(GeometryChange::Vertex { index, direction }) => {
            let direction = direction * factor;
            Change::Geometry(GeometryChange::Vertex { index, direction })
        }
        Change::Property(p) => {
            let op = match p.op {
                ValueChange::Add(a) => ValueChange::Add(a * factor),
                ValueChange::Multiply(m) => ValueChange::Multiply(m * factor),
                ValueChange::MultiplyLog(m) => ValueChange::MultiplyLog(m * factor),
            };
            Change::Property(PropertyChange { op, ..p.clone() })
        }
        other => unreachable!("no parameter here has the effect {other:?}"),
    };
    effects.iter().map(|e| Effect { target: e.target.clone(), change: scaled(&e.change) }).collect()
}

/// Vertices in a plane of box faces move; whatever else they belong to is stretched.
#[must_use]
pub fn moves_plane(built: &Built, plane: Plane, velocity: Vec3) -> Vec<Effect> {
    let of_mesh = |id: &String| {
        let positions = &built.mesh(id)?.positions;
        let moving = positions.iter().map(|p| plane.contains(*p));
        let velocities: Vec<Vec3> = moving.map(|m| if m { velocity } else { Vec3::ZERO }).collect();
        let any = velocities.iter().any(|v| *v != Vec3::ZERO);
        any.then(|| moves(id, GeometryChange::VertexVelocity(velocities.into())))
    };
    built.interfaces.iter().filter_map(of_mesh).collect()
}

fn motion(built: &Built, what: &str, velocity: &Velocity) -> Result<Vec<Effect>> {
    if let Some(shape) = what.strip_suffix(" vertices") {
        let Velocity::PerVertex(v) = velocity else {
            return Err(format!("`{what}` needs a velocity per vertex").into());
        };
        let v: Vec<Vec3> = v.iter().map(|v| vector(*v)).collect();
        return Ok(vec![moves(shape, GeometryChange::VertexVelocity(v.into()))]);
    }
    let Velocity::Uniform(v) = velocity else {
        return Err(format!("`{what}` needs one velocity").into());
    };
    let v = vector(*v);
    let translated = |ids: &mut dyn Iterator<Item = &str>| {
        ids.map(|id| moves(id, GeometryChange::Translate(v))).collect()
    };
    let mut interfaces = built.interfaces.iter().map(String::as_str);
    match what {
        "receiver" | "camera" | "detector origin" => Ok(translated(&mut [DETECTOR].into_iter())),
        "box" => Ok(translated(&mut interfaces)),
        "box and grid" => {
            let media = built.scene.media.iter().filter_map(|m| m.id.as_deref());
            Ok(translated(&mut interfaces.chain(media)))
        }
        _ if what.starts_with("face ") || what.starts_with("interface") => {
            if let Some(face) = what.strip_suffix(" (values advected)") {
                let field = stretch(built, plane(built, face)?, v)?;
                return Ok(stretched(built, &field));
            }
            let mut effects = Vec::new();
            for name in what.split(',') {
                effects.extend(moves_plane(built, plane(built, name.trim())?, v));
            }
            Ok(effects)
        }
        _ => Ok(translated(&mut [what].into_iter())),
    }
}

/// The regions and their grids, moved by an affine field.
fn stretched(built: &Built, field: &Affine) -> Vec<Effect> {
    let grids = built.scene.media.iter().filter(|m| m.item.grid().is_some());
    let interfaces = built.interfaces.iter().map(String::as_str);
    interfaces
        .chain(grids.filter_map(|m| m.id.as_deref()))
        .map(|id| moves(id, GeometryChange::Matrix(*field)))
        .collect()
}

/// The field that is `velocity` in a face of all the boxes together, zero in the opposite one, and
/// linear in between.
fn stretch(built: &Built, face: Plane, velocity: Vec3) -> Result<Affine> {
    let [lo, hi] = extent(built, face.axis)?;
    let fixed = if face.at == hi { lo } else { hi };
    let gradient = velocity / (face.at - fixed);
    let mut linear = Mat3::ZERO;
    linear.cols[face.axis] = gradient;
    Ok(Affine { linear, translation: -(gradient * fixed) })
}

/// Where all the boxes together begin and end along an axis.
fn extent(built: &Built, axis: usize) -> Result<[f64; 2]> {
    let along = |end: usize| built.regions.iter().map(move |r| coordinate(r.ends[end], axis));
    let lo = along(0).reduce(f64::min).ok_or("there is no box")?;
    let hi = along(1).reduce(f64::max).ok_or("there is no box")?;
    Ok([lo, hi])
}

/// `face x=hi`, `face z=H`, `interface z=zi`, `interface`, `top`, `bottom`: the first two of all
/// boxes together, the others along the axis that the interface crosses.
pub fn plane(built: &Built, name: &str) -> Result<Plane> {
    let unknown = || format!("there is no plane `{name}`");
    let interface = shared_faces(&built.regions).first().map(|(plane, _, _)| *plane);
    let end = |axis: usize, end: usize| Ok(Plane { axis, at: extent(built, axis)?[end] });
    if name == "interface" || name.starts_with("interface ") {
        return interface.ok_or_else(|| unknown().into());
    }
    if let Some(side) = ["bottom", "top"].iter().position(|s| *s == name) {
        return end(interface.ok_or_else(unknown)?.axis, side);
    }
    let (axis, side) =
        name.strip_prefix("face ").and_then(|f| f.split_once('=')).ok_or_else(unknown)?;
    let axis = ["x", "y", "z"].iter().position(|a| *a == axis).ok_or_else(unknown)?;
    match side {
        "lo" | "0" => end(axis, 0),
        "hi" | "H" => end(axis, 1),
        _ => Err(unknown().into()),
    }
}

/// A scalar by its name: what it is, `(what is held)`, and `of the lower (upper) medium`.
fn scalar(built: &Built, name: &str) -> Result<Vec<Effect>> {
    let add = ValueChange::Add(Rgb::ONE);
    let bare = name.split(" (").next().unwrap_or(name);
    let (what, which) = match bare.split_once(" of the ") {
        Some((what, which)) => (what, Some(which)),
        None => (bare, None),
    };
    let on_surfaces = |ids: &[String], property| {
        ids.iter().map(|id| changes(id, property, add)).collect::<Vec<_>>()
    };
    let media = &built.scene.media;
    let effects = match what {
        "rho" => on_surfaces(&built.reflectors, "reflectance"),
        "albedo" if media.is_empty() => on_surfaces(&built.reflectors, "reflectance"),
        "E" => on_surfaces(&built.emitters, "radiance"),
        "sigma_t" | "albedo" | "g" => {
            vec![changes(&medium_id(built, which)?, what, add)]
        }
        "sigma_t_scale" => {
            let scale = grid_scale(built)?;
            vec![changes(&medium_id(built, which)?, "sigma_t", ValueChange::Multiply(1.0 / scale))]
        }
        _ => match what.strip_prefix("grid value ") {
            Some(indices) => {
                // The library's sigma_t is that after the scale, the file's value that before.
                let op = ValueChange::Add(Rgb::splat(grid_scale(built)?));
                let voxels = Some(serde_json::from_str(indices)?);
                let change =
                    PropertyChange { property: "sigma_t".into(), op, voxels, texels: None };
                let target = medium_id(built, which)?;
                vec![Effect { target, change: Change::Property(change) }]
            }
            None => return Err(format!("unknown parameter `{name}`").into()),
        },
    };
    if effects.is_empty() {
        return Err(format!("the scene has nothing for `{name}` to change").into());
    }
    Ok(effects)
}

/// The id of `lower medium`, `upper medium`, or of the only one.
fn medium_id(built: &Built, which: Option<&str>) -> Result<String> {
    let shared = shared_faces(&built.regions);
    let of = |region: usize| format!("medium {}", built.regions[region].medium);
    match (which, shared.first()) {
        (Some("lower medium"), Some((_, below, _))) => Ok(of(*below)),
        (Some("upper medium"), Some((_, _, above))) => Ok(of(*above)),
        (None, _) if built.scene.media.len() == 1 => Ok("medium 0".into()),
        _ => Err(format!("the scene has no single `{}`", which.unwrap_or("medium")).into()),
    }
}

fn grid_scale(built: &Built) -> Result<f64> {
    let mut grids = built.scene.media.iter().filter_map(|m| m.item.grid());
    Ok(grids.next().ok_or("the scene has no grid")?.scale())
}
