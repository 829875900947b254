//! Rooms of open sheets full of fog: six rectangles whose rims meet up to rounding, rectangles with gaps
//! between them, and a room with a wall missing.

use std::f64::consts::{FRAC_PI_2, PI};
use std::sync::Arc;

use drt_estimators::{MediumBoundary, Surrounding};
use drt_geom::Mesh;
use drt_geom::procedural::{icosphere, rectangle};
use drt_math::{Rgb, Vec3, vec3};
use drt_medium::Phase;
use drt_motion::{Effect, GeometryChange};

use super::cases::{Case, Draft, fog, scattered, seen};
use crate::Result;
use crate::matrix::Set;
use crate::matrix::effects::{grow, translate, turn};
use crate::matrix::set::{at, diffuse, placed};
use crate::motion::moves;

/// Half the room's sides.
const HALF: Vec3 = vec3(1.1, 0.9, 1.3);

const ONE: Vec3 = vec3(1.0, 1.0, 1.0);
const SKEW: Vec3 = vec3(0.3, 1.0, 0.2);

/// Where the camera is in the room, and what it looks at.
const EYE: Vec3 = vec3(0.15, -0.1, 1.05);
const TARGET: Vec3 = vec3(-0.1, 0.05, 0.0);

/// The six walls with their fronts to the room, `part` of their full sides long. Each is turned into
/// its place by itself, so that vertices that should be one differ by some ulps.
fn walls(part: f64) -> Vec<(&'static str, Mesh)> {
    let turned = |axis: Vec3, angle: f64| {
        let sheet = at(&rectangle(), vec3(part, part, 1.0), -Vec3::Z);
        let side = placed(&sheet, ONE, axis, angle, Vec3::ZERO);
        // Askew and back again.
        let askew = placed(&side, ONE, SKEW, 0.7, vec3(0.1, 0.2, 0.3));
        let back = at(&askew, ONE, -vec3(0.1, 0.2, 0.3));
        at(&placed(&back, ONE, SKEW, -0.7, Vec3::ZERO), HALF, Vec3::ZERO)
    };
    vec![
        ("back", turned(Vec3::X, 0.0)),
        ("front", turned(Vec3::X, PI)),
        ("floor", turned(Vec3::X, -FRAC_PI_2)),
        ("ceiling", turned(Vec3::X, FRAC_PI_2)),
        ("left", turned(Vec3::Y, FRAC_PI_2)),
        ("right", turned(Vec3::Y, -FRAC_PI_2)),
    ]
}

/// A room of some walls with a lamp, a black body, and the camera in fog. If it is open, the fog goes on
/// outside.
fn room(walls: Vec<(&'static str, Mesh)>, is_open: bool) -> Result<Set> {
    let mut set = seen(EYE, TARGET, 75.0, 3)?.medium(
        "fog",
        fog([0.5, 0.7, 0.9], [0.9, 0.8, 0.7])?,
        Phase::henyey_greenstein(0.3)?,
    );
    let outside = if is_open { "fog" } else { "" };
    for (i, (id, mesh)) in walls.into_iter().enumerate() {
        let grey = 0.3 + 0.1 * i as f64;
        set =
            set.filled(id, mesh, diffuse([grey, 0.5, 0.8 - 0.1 * i as f64]), outside, Some("fog"));
    }
    let lamp = placed(&rectangle(), Vec3::splat(0.4), Vec3::X, FRAC_PI_2, vec3(0.1, 0.7, 0.2));
    let body = at(&icosphere(1), Vec3::splat(0.3), vec3(-0.2, -0.2, -0.1));
    set = set.lamp("lamp", lamp, Rgb::new(6.0, 7.0, 8.0)).filled(
        "body",
        body,
        diffuse([0.0; 3]),
        "",
        Some("fog"),
    );
    let is_lamp = set.scene.shapes.iter_mut().find(|s| s.id.as_deref() == Some("lamp"));
    if let Some(lamp) = is_lamp {
        lamp.boundary = Some(MediumBoundary { interior: Some(0), exterior: Some(0) });
    }
    set.scene.sensors[0].item.medium = Surrounding::Stated(Some(0));
    Ok(set)
}

/// What moves the body.
fn body_moves() -> [Effect; 1] {
    [translate("body", vec3(0.7, 0.4, -0.3))]
}

/// A black body moves in a room of six sheets whose rims meet up to rounding.
///
/// # Errors
/// When the library rejects the scene.
pub fn room_of_sheets() -> Result<Case> {
    let draft =
        Draft::new("body moves in a room of sheets", room(walls(1.0), false)?, body_moves());
    Ok(draft.at_rest().differences(0.02).case())
}

/// The lamp, a sheet seen from both sides, slides and turns in that room.
///
/// # Errors
/// When the library rejects the scene.
pub fn lamp_in_room() -> Result<Case> {
    let effects = [
        translate("lamp", vec3(0.5, -0.3, 0.2)),
        turn("lamp", vec3(0.2, 0.1, 1.0), vec3(0.1, 0.7, 0.2)),
    ];
    let draft = Draft::new("lamp moves in a room of sheets", room(walls(1.0), false)?, effects);
    Ok(draft.differences(0.02).case())
}

/// The body moves between six sheets that do not meet, in fog without end.
///
/// # Errors
/// When the library rejects the scene.
pub fn room_with_gaps() -> Result<Case> {
    let set = room(walls(0.85), true)?;
    let draft = Draft::new("body moves between sheets with gaps", set, body_moves());
    let draft = draft.at_rest().differences(0.02);
    let surfaces = ["back", "front", "floor", "ceiling", "left", "right", "lamp", "body"];
    // All below the lamp and before the body.
    let further = scattered(16, vec3(0.7, 0.2, 0.2));
    let further: Vec<Vec3> = further.into_iter().map(|p| p + vec3(0.0, 0.0, 0.6)).collect();
    Ok(draft.stirred(&surfaces, Some(EYE), &further, 8)?.0.case())
}

/// The body moves in a room with a wall missing, in fog without end.
///
/// # Errors
/// When the library rejects the scene.
pub fn room_without_a_wall() -> Result<Case> {
    let walls = walls(1.0).into_iter().filter(|(id, _)| *id != "right").collect();
    let draft = Draft::new("body moves in a room open to a side", room(walls, true)?, body_moves());
    Ok(draft.at_rest().differences(0.02).case())
}

/// A side wall's middle bulges, its rim rests: the deforming sheet is one of the six.
///
/// # Errors
/// When the library rejects the scene.
pub fn wall_bulges() -> Result<Case> {
    let mut set = room(walls(1.0), false)?;
    let wall = set.scene.shapes.iter_mut().find(|s| s.id.as_deref() == Some("back"));
    let wall = wall.ok_or("no such wall")?;
    let (mesh, velocities) = bulging(&wall.mesh);
    wall.mesh = Arc::new(mesh);
    let effects = [moves("back", GeometryChange::VertexVelocity(velocities.into()))];
    let draft = Draft::new("a wall of a room of sheets bulges", set, effects);
    Ok(draft.differences(0.05).case())
}

/// A rectangle with a vertex in its middle, which moves along the normal.
fn bulging(wall: &Mesh) -> (Mesh, Vec<Vec3>) {
    let mut positions = wall.positions.clone();
    let middle = positions.iter().fold(Vec3::ZERO, |s, p| s + *p) * 0.25;
    let normal = wall.normal(0);
    // Corners in the order of the outline.
    let [first, second] = [wall.triangles[0], wall.triangles[1]];
    let around = [first[0], first[1], first[2]];
    let last = second.into_iter().find(|v| !around.contains(v));
    let mut outline: Vec<u32> = around.into_iter().chain(last).collect();
    let angle = |v: &u32| {
        let (x, y) = (positions[around[1] as usize] - middle, positions[*v as usize] - middle);
        f64::atan2(x.cross(y).dot(normal), x.dot(y))
    };
    outline.sort_by(|a, b| angle(a).total_cmp(&angle(b)));
    positions.push(middle);
    let center = positions.len() as u32 - 1;
    let triangles = (0..4).map(|k| [outline[k], outline[(k + 1) % 4], center]).collect();
    let mut velocities = vec![Vec3::ZERO; positions.len()];
    velocities[center as usize] = normal;
    (Mesh::new(positions, triangles).expect("a pyramid without height"), velocities)
}

/// Everything around the fog moves by one affine map, the camera with it.
///
/// # Errors
/// When the library rejects the scene.
pub fn room_moves_as_one() -> Result<Case> {
    let set = room(walls(1.0), false)?;
    let shift = vec3(0.4, -0.2, 0.3);
    let ids = set.scene.shapes.iter().filter_map(|s| s.id.clone());
    let mut effects: Vec<Effect> = ids.map(|id| grow(&id, vec3(0.3, 0.5, -0.2), EYE)).collect();
    let moved: Vec<Effect> = effects.iter().map(|e| translate(&e.target, shift)).collect();
    effects.extend(moved);
    effects.push(translate("camera", shift));
    let draft = Draft::new("a room of sheets moves and grows", set, effects).affine();
    Ok(draft.differences(0.02).case())
}
