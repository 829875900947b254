//! Extreme shapes, and shapes in extreme positions.

use std::f64::consts::FRAC_PI_2;

use drt_estimators::Scene;
use drt_estimators::surface::Bsdf;
use drt_geom::Mesh;
use drt_geom::procedural::{cube, rectangle};
use drt_math::{Mat3, Rgb, Vec3, vec3};
use drt_medium::{Homogeneous, Phase};
use drt_motion::{Effect, GeometryChange};

use super::{Case, Condition};
use crate::Result;
use crate::matrix::Set;
use crate::matrix::effects::{add, raise, translate, turn};
use crate::matrix::set::{at, diffuse, placed};
use crate::motion::moves;

pub(super) fn conditions() -> Result<Vec<Condition>> {
    let mut all = vec![needles()?, needle_apart()?, split()?, twice()?, double_wall()?];
    all.extend([twin()?, sheets()?, standing()?, leaning()?]);
    all.extend([thin_gap()?, thin_film()?]);
    all.extend(aligned()?);
    Ok(all)
}

/// Where the block is.
const PLACE: Vec3 = vec3(0.1, 0.35, 0.0);

fn floor() -> Mesh {
    placed(&rectangle(), vec3(3.0, 3.0, 1.0), Vec3::X, -FRAC_PI_2, Vec3::ZERO)
}

fn block() -> Mesh {
    placed(&cube(), vec3(0.35, 0.25, 0.3), vec3(0.3, 1.0, 0.2), 0.5, PLACE)
}

/// A floor under a lamp, seen from above.
fn stage() -> Result<Set> {
    let lamp = placed(&rectangle(), vec3(0.5, 0.5, 1.0), Vec3::X, FRAC_PI_2, vec3(0.6, 2.2, 0.3));
    Ok(Set::new(vec3(-0.3, 1.5, -2.4), vec3(0.1, 0.25, 0.0), 36.0, 3)?
        .shape("floor", floor(), diffuse([0.7, 0.5, 0.4]))
        .lamp("lamp", lamp, Rgb::new(6.0, 7.0, 8.0)))
}

fn with_block(mesh: Mesh) -> Result<Scene> {
    Ok(stage()?.shape("block", mesh, diffuse([0.4, 0.6, 0.7])).scene)
}

/// A linear field at each vertex, so that it does not matter which vertices there are.
fn strain(mesh: &Mesh) -> GeometryChange {
    let field = Mat3::from_rows(vec3(0.3, 0.8, 0.0), vec3(0.1, -0.4, 0.5), vec3(0.0, 0.2, 0.6));
    GeometryChange::VertexVelocity(mesh.positions.iter().map(|p| field * *p).collect())
}

/// Every motion and change of a scene in which the shapes `ids` are the block.
fn in_stage(scene: Scene, ids: &[&str]) -> Case {
    let mesh = |id: &str| {
        let shape = scene.shapes.iter().find(|s| s.id.as_deref() == Some(id));
        shape.map(|s| s.mesh.clone()).unwrap_or_default()
    };
    let each = |effect: &dyn Fn(&str) -> Effect| ids.iter().map(|id| effect(id)).collect();
    let parameters = vec![
        ("block moves", each(&|id| translate(id, vec3(0.8, 0.3, -0.4)))),
        ("block turns", each(&|id| turn(id, vec3(0.2, 1.0, 0.4), PLACE))),
        ("block strained", each(&|id| moves(id, strain(&mesh(id))))),
        ("lamp moves", vec![translate("lamp", vec3(0.6, -0.5, 0.3))]),
        ("reflectance", each(&|id| add(id, "reflectance", [1.0, -0.5, 0.7]))),
    ];
    Case::new(scene, parameters)
}

fn plain() -> Result<Case> {
    Ok(in_stage(with_block(block())?, &["block"]))
}

/// Each triangle split at a point next to its first edge, `off` times its height away from it.
fn with_needles(mesh: &Mesh, off: f64) -> Result<Mesh> {
    let (mut positions, mut triangles) = (mesh.positions.clone(), Vec::new());
    for &[a, b, c] in &mesh.triangles {
        let [x, y, z] = [a, b, c].map(|v| mesh.positions[v as usize]);
        let p = positions.len() as u32;
        positions.push(x * (0.6 - 0.5 * off) + y * (0.4 - 0.5 * off) + z * off);
        triangles.extend([[a, b, p], [b, c, p], [c, a, p]]);
    }
    Ok(Mesh::new(positions, triangles)?)
}

fn needles() -> Result<Condition> {
    let hard = in_stage(with_block(with_needles(&block(), 1e-8)?)?, &["block"]);
    Ok(Condition::new("needles of aspect 1e8 in every face", hard, plain()?))
}

/// Every face in three parts.
fn split() -> Result<Condition> {
    let hard = in_stage(with_block(with_needles(&block(), 0.3)?)?, &["block"]);
    Ok(Condition::new("coplanar faces", hard, plain()?))
}

/// A triangle a metre long and ten nanometres wide.
fn needle_apart() -> Result<Condition> {
    let (a, along) = (vec3(-0.5, 0.8, -0.2), vec3(0.9, 0.2, 0.3));
    let tip = a + along * 0.5 + vec3(0.0, 1e-8, 0.0);
    let needle = Mesh::new(vec![a, a + along, tip], vec![[0, 1, 2]])?;
    let scene = stage()?
        .shape("block", block(), diffuse([0.4, 0.6, 0.7]))
        .shape("needle", needle, diffuse([0.5; 3]))
        .scene;
    let hard = in_stage(scene, &["block", "needle"]);
    Ok(Condition::new("a needle of aspect 1e8 in the air", hard, plain()?))
}

fn twice() -> Result<Condition> {
    let mut mesh = block();
    mesh.triangles = mesh.triangles.repeat(2);
    let hard = in_stage(with_block(mesh)?, &["block"]);
    Ok(Condition::new("every face twice", hard, plain()?))
}

fn twin() -> Result<Condition> {
    let scene = stage()?
        .shape("block", block(), diffuse([0.4, 0.6, 0.7]))
        .shape("twin", block(), diffuse([0.4, 0.6, 0.7]))
        .scene;
    Ok(Condition::new("the block twice", in_stage(scene, &["block", "twin"]), plain()?))
}

/// The block as six shapes that touch.
fn sheets() -> Result<Condition> {
    let ids = ["a", "b", "c", "d", "e", "f"];
    let whole = block();
    let mut set = stage()?;
    for (id, pair) in ids.iter().zip(whole.triangles.chunks(2)) {
        let mesh = Mesh { triangles: pair.to_vec(), ..whole.clone() };
        set = set.shape(id, mesh, diffuse([0.4, 0.6, 0.7]));
    }
    Ok(Condition::new("a block of six sheets", in_stage(set.scene, &ids), plain()?))
}

/// Parameters of things that touch the floor.
fn sliding(scene: Scene) -> Case {
    let parameters = vec![
        ("block slides", vec![translate("block", vec3(0.8, 0.0, -0.4))]),
        ("block turns", vec![turn("block", Vec3::Y, PLACE)]),
        ("lamp moves", vec![translate("lamp", vec3(0.6, -0.5, 0.3))]),
        ("reflectance", vec![add("floor", "reflectance", [1.0, -0.5, 0.7])]),
    ];
    Case::new(scene, parameters)
}

/// A block whose lower side lies in the floor, against one that hovers a little.
fn standing() -> Result<Condition> {
    let block =
        |gap: f64| placed(&cube(), vec3(0.35, 0.25, 0.3), Vec3::Y, 0.5, vec3(0.1, 0.25 + gap, 0.0));
    let [hard, easy] = [0.0, 1e-4].map(|gap| with_block(block(gap)).map(sliding));
    Ok(Condition::new("a block on the floor", hard?, easy?))
}

/// A sheet whose lower edge lies in the floor.
fn leaning() -> Result<Condition> {
    let sheet = |gap: f64| {
        let mesh =
            placed(&rectangle(), vec3(0.4, 0.3, 1.0), Vec3::Y, 0.5, vec3(0.1, 0.3 + gap, 0.0));
        with_block(mesh).map(sliding)
    };
    Ok(Condition::new("a sheet on the floor", sheet(0.0)?, sheet(1e-4)?))
}

/// A sheet with another 1e-9 behind it.
fn double_wall() -> Result<Condition> {
    let sheet = |depth: f64| {
        placed(&rectangle(), vec3(0.4, 0.3, 1.0), vec3(1.0, 0.3, 0.1), 0.9, PLACE)
            .transform(&drt_math::Affine::translation(vec3(0.1, -0.5, 0.7) * depth))
    };
    let bsdf = || {
        let front = diffuse([0.4, 0.6, 0.7]);
        Bsdf::TwoSided(Box::new(drt_estimators::surface::TwoSided { front, back: None }))
    };
    let scene = stage()?.shape("block", sheet(0.0), bsdf()).scene;
    let mut easy = in_stage(scene, &["block"]);
    let scene =
        stage()?.shape("block", sheet(0.0), bsdf()).shape("back", sheet(1e-9), bsdf()).scene;
    let mut hard = in_stage(scene, &["block", "back"]);
    for case in [&mut easy, &mut hard] {
        // Reflectances of two sides are not addressed here.
        case.parameters.pop();
    }
    Ok(Condition::new("sheets 1e-9 apart", hard, easy))
}

fn fog() -> Result<Homogeneous> {
    Ok(Homogeneous::new(Rgb::new(0.8, 1.2, 1.6), Rgb::new(0.9, 0.8, 0.7), Rgb::ZERO)?)
}

/// A block of fog over the floor, as these boxes.
fn fogs(boxes: &[(&str, [f64; 2])], medium: Homogeneous) -> Result<Case> {
    let mut set = stage()?.medium("fog", medium, Phase::henyey_greenstein(0.3)?);
    for (id, [low, high]) in boxes {
        let half = vec3(0.6, 0.5 * (high - low), 0.6);
        let mesh = at(&cube(), half, vec3(0.0, 0.5 * (low + high), 0.0));
        set = set.interface(id, mesh, "fog", None);
    }
    let each = |effect: &dyn Fn(&str) -> Effect| boxes.iter().map(|b| effect(b.0)).collect();
    let parameters = vec![
        ("fog moves", each(&|id| translate(id, vec3(0.8, 0.3, -0.4)))),
        ("fog turns", each(&|id| turn(id, vec3(0.2, 1.0, 0.4), PLACE))),
        ("lamp moves", vec![translate("lamp", vec3(0.6, -0.5, 0.3))]),
        ("extinction", vec![add("fog", "sigma_t", [1.0, 0.5, 0.7])]),
        ("asymmetry", vec![raise("fog", "g", 1.0)]),
    ];
    Ok(Case::new(set.scene, parameters))
}

fn thin_gap() -> Result<Condition> {
    let easy = fogs(&[("box", [0.2, 1.2])], fog()?)?;
    let hard = fogs(&[("low", [0.2, 0.7]), ("high", [0.7 + 1e-9, 1.2])], fog()?)?;
    Ok(Condition::new("a gap of 1e-9 in fog", hard, easy))
}

fn thin_film() -> Result<Condition> {
    let easy = fogs(&[("box", [0.2, 1.2])], fog()?)?;
    let hard = fogs(&[("film", [1.2 + 1e-9, 1.2 + 2e-9]), ("box", [0.2, 1.2])], fog()?)?;
    Ok(Condition::new("a film of fog 1e-9 thick, 1e-9 above", hard, easy))
}

/// A camera in the plane of a face, on the line of an edge and in the planes of vertices, with an
/// upright block.
fn aligned() -> Result<Vec<Condition>> {
    let half = vec3(0.35, 0.25, 0.3);
    let scene = |eye: Vec3| -> Result<Scene> {
        let lamp =
            placed(&rectangle(), vec3(0.5, 0.5, 1.0), Vec3::X, FRAC_PI_2, vec3(0.6, 2.2, 0.3));
        Ok(Set::new(eye, vec3(0.1, 0.25, 0.0), 36.0, 3)?
            .shape("floor", floor(), diffuse([0.7, 0.5, 0.4]))
            .lamp("lamp", lamp, Rgb::new(6.0, 7.0, 8.0))
            .shape("block", at(&cube(), half, vec3(0.0, 0.5, 0.0)), diffuse([0.4, 0.6, 0.7]))
            .scene)
    };
    let case = |eye: Vec3, along: Vec3| -> Result<Case> {
        let parameters = vec![
            ("block along the view", vec![translate("block", along)]),
            ("lamp moves", vec![translate("lamp", vec3(0.6, -0.5, 0.3))]),
            ("floor sinks", vec![translate("floor", vec3(0.0, -1.0, 0.0))]),
            ("camera along the view", vec![translate("camera", along)]),
        ];
        Ok(Case::new(scene(eye)?, parameters))
    };
    let pair = |name: &str, eye: Vec3, along: Vec3| -> Result<Condition> {
        // Away from the plane by what a pixel does not see.
        let easy = case(eye + vec3(1e-5, 1.3e-5, 0.7e-5), along)?;
        Ok(Condition::new(name, case(eye, along)?, easy))
    };
    let side = vec3(half.x, 1.3, -2.4);
    let edge = vec3(half.x, 0.5 + half.y, -2.4);
    Ok(vec![
        pair("camera in the plane of a face", side, vec3(0.0, 0.3, 1.0))?,
        pair("camera on the line of an edge", edge, vec3(0.0, 0.0, 1.0))?,
    ])
}
