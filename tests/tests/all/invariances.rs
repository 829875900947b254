//! Changes whose derivative is known without any number: the invariances I1 to I7 of the oracle
//! file, on its scenes and on our own.

use std::sync::Arc;

use drt_estimators::emitter::Emitter;
use drt_estimators::surface::Bsdf;
use drt_estimators::{MediumBoundary, Named, Shape};
use drt_geom::procedural;
use drt_math::{Affine, Mat3, Rgb, Vec3, vec3};
use drt_medium::Homogeneous;
use drt_motion::{Effect, GeometryChange, ValueChange};
use drt_tests::Result;
use drt_tests::comparison::{Claim, examine};
use drt_tests::motion::{changes, moves, moves_everything, scaled};
use drt_tests::oracle::{Case, Detector, MediumText, NumberText, OracleFile, SceneText, Surface};
use drt_tests::rooms::rooms;
use drt_tests::scene::{Built, DETECTOR, build};
use drt_tests::trial::Trial;

/// Samples a claim may cost, per pixel of an image and of a single number.
const SAMPLES: [u32; 2] = [1 << 11, 1 << 18];

fn check(claims: Vec<Claim>) {
    assert!(claims.len() >= 5, "only {} scenes", claims.len());
    let mut failing = 0;
    for claim in claims {
        let samples = SAMPLES[usize::from(claim.built.single_pixel())];
        let finding = examine(&claim, samples).unwrap();
        println!("{finding}");
        failing += u32::from(!finding.holds());
    }
    assert_eq!(failing, 0, "claims that fail");
}

/// Every claim is false, and that must show.
fn check_faults(claims: Vec<Claim>) {
    for claim in claims {
        let samples = SAMPLES[usize::from(claim.built.single_pixel())];
        let finding =
            examine(&Claim { wrong: Some(claim.left.clone()), ..claim }, samples).unwrap();
        let off = finding.difference;
        println!("fault: {:<40} {:>12.4e} ± {:.1e}", finding.name, off.left, off.stderr);
        assert!(!finding.difference.agrees, "{}: the fault went unnoticed", finding.name);
    }
}

/// Half the width of the pixels that stand for rays, whose exact numbers do not matter here.
const WIDE: f64 = 0.1;

/// One scene of every oracle: of the slab the one with an irradiance meter, else the first.
fn trials() -> Vec<Trial> {
    let trial = |mut case: Case| {
        case.detector = case.detector.widened(WIDE);
        let mut trials = Trial::of_case(&case).unwrap();
        let diffuse = trials.iter().position(|t| t.name.ends_with("R_diffuse"));
        trials.swap_remove(diffuse.unwrap_or(0))
    };
    OracleFile::read().unwrap().cases.into_iter().map(trial).collect()
}

/// Every oracle's scene and every room.
fn scenes() -> Vec<(String, Built)> {
    let oracles = trials().into_iter().map(|t| (t.name, t.built));
    oracles.chain(rooms().unwrap().into_iter().map(|(n, b)| (n.into(), b))).collect()
}

/// The boxes of media grow besides, with their grids.
fn swells(built: &Built) -> Vec<Effect> {
    let grids = built.scene.media.iter().filter(|m| m.item.grid().is_some());
    let ids = built.interfaces.iter().map(String::as_str);
    ids.chain(grids.filter_map(|m| m.id.as_deref()))
        .map(|id| moves(id, GeometryChange::Matrix(Affine::IDENTITY)))
        .collect()
}

/// A change of everything with a fault: boxes of media change besides, or the detector does not
/// follow. Where only walls are seen, all of one radiance, no fault shows.
fn spoiled(name: &str, built: &Built, effects: &[Effect]) -> Option<Vec<Effect>> {
    if built.interfaces.is_empty() {
        let uniform = name.contains("furnace");
        return (!uniform).then(|| without(effects, DETECTOR));
    }
    Some([effects, &swells(built)].concat())
}

/// The effects on all targets but one.
fn without(effects: &[Effect], target: &str) -> Vec<Effect> {
    effects.iter().filter(|e| e.target != target).cloned().collect()
}

#[test]
fn i1_everything_moves_rigidly() {
    let spin = Mat3::skew(vec3(0.4, 0.1, -0.6));
    let field = Affine { linear: spin, translation: vec3(0.3, -0.2, 0.5) };
    let claim = |(name, built): (String, Built)| {
        let left = moves_everything(&built, &field);
        let wrong = spoiled(&name, &built, &left);
        Claim { name, built, left, right: Vec::new(), wrong }
    };
    check(scenes().into_iter().map(claim).collect());
}

/// Everything grows around a point, and what is measured per length, area or steradian makes up
/// for it.
fn grows(built: &Built) -> Vec<Effect> {
    let field = Affine { linear: Mat3::IDENTITY, translation: vec3(-0.7, 0.4, -0.3) };
    let mut effects = moves_everything(built, &field);
    effects.extend(thins(built));
    for e in &built.scene.emitters {
        if let (Emitter::Point { .. }, Some(id)) = (&e.item.emitter, &e.id) {
            effects.push(changes(id, "intensity", ValueChange::Multiply(2.0)));
        }
    }
    effects
}

fn thins(built: &Built) -> Vec<Effect> {
    let media = built.scene.media.iter().filter_map(|m| m.id.as_deref());
    media.map(|id| changes(id, "sigma_t", ValueChange::Multiply(-1.0))).collect()
}

#[test]
fn i2_everything_grows() {
    let claim = |(name, built): (String, Built)| {
        let left = grows(&built);
        let wrong = spoiled(&name, &built, &left);
        Claim { name, built, left, right: Vec::new(), wrong }
    };
    check(scenes().into_iter().map(claim).collect());
}

/// The boxes of media moved and strained: by an affine map that takes the inside along, and vertex
/// by vertex, which leaves it at rest and adds the flux through the faces.
#[test]
fn i3_the_inside_may_move_at_will() {
    let strain = Mat3::diagonal(vec3(0.3, -0.2, 0.4));
    let field = Affine { linear: strain, translation: vec3(0.1, 0.2, 0.1) };
    let claim = |(name, built): (String, Built)| {
        let by_map = |id: &String| moves(id, GeometryChange::Matrix(field));
        let by_vertex = |id: &String| {
            let positions = &built.mesh(id).unwrap().positions;
            let velocities = positions.iter().map(|p| field.point(*p)).collect();
            moves(id, GeometryChange::VertexVelocity(velocities))
        };
        let left: Vec<Effect> = built.interfaces.iter().map(by_vertex).collect();
        let right = vec![built.interfaces.iter().map(by_map).collect()];
        let wrong = Some(scaled(&left, -1.0));
        Claim { name, built, left, right, wrong }
    };
    // A grid moves with the box or stays: that is another scene, not another inside.
    let boxed = |built: &Built| {
        let homogeneous = built.scene.media.iter().all(|m| m.item.homogeneous().is_some());
        !built.interfaces.is_empty() && homogeneous
    };
    // Of the slab, whose flux is expensive, the oracle itself is judged both ways.
    let chosen = |(name, built): &(String, Built)| boxed(built) && !name.contains("slab");
    check(scenes().into_iter().filter(chosen).map(claim).collect());
}

/// A closed null surface inside the first box, most of its size, around a copy of its medium with
/// another extinction; its vertices move anyhow.
fn with_bubble(built: &Built, thickened: f64) -> Option<(Built, Vec<Effect>)> {
    let region = built.regions.first()?;
    let mut medium = built.scene.media[region.medium].item.clone();
    let mut inside = medium.homogeneous()?.coefficients();
    inside.sigma_t *= thickened;
    medium.kind = Homogeneous::try_from(inside).ok()?.into();
    let [lo, hi] = region.ends;
    let place = Affine { linear: Mat3::diagonal((hi - lo) * 0.4), translation: (lo + hi) * 0.5 };
    let mesh = procedural::icosphere(1).transform(&place);
    let push = |p: &Vec3| (*p - place.translation) * 0.3 + vec3(p.z.sin(), p.x.cos(), p.y) * 0.1;
    let velocities = mesh.positions.iter().map(push).collect();
    let mut built = built.clone();
    built.scene.bsdfs.push(Named::anonymous(Bsdf::Null));
    built.scene.media.push(Named::new("bubble medium", medium));
    let interior = Some(built.scene.media.len() - 1);
    built.scene.shapes.push(Shape {
        id: Some("bubble".into()),
        mesh: Arc::new(mesh),
        bsdf: built.scene.bsdfs.len() - 1,
        boundary: Some(MediumBoundary { interior, exterior: Some(region.medium) }),
        emitter: None,
    });
    Some((built, vec![moves("bubble", GeometryChange::VertexVelocity(velocities))]))
}

#[test]
fn i4_a_surface_between_equal_media_is_nothing() {
    let bubbles = |thickened: f64| {
        scenes().into_iter().filter(|(name, _)| !name.contains("slab")).filter_map(
            move |(name, built)| {
                let (built, left) = with_bubble(&built, thickened)?;
                Some(Claim { name, built, left, right: Vec::new(), wrong: None })
            },
        )
    };
    check(bubbles(1.0).collect());
    check_faults(bubbles(4.0).collect());
}

/// A room whose walls, body and medium all glow so that the radiance is the same everywhere.
fn isothermal(body: &drt_geom::Mesh, filled: bool, emission: f64) -> Result<Built> {
    const RADIANCE: f64 = 1.3;
    let surface = |name: &str, albedo: f64| Surface {
        name: name.into(),
        bsdf: "diffuse".into(),
        albedo: Some(albedo),
        emission: Some((1.0 - albedo) * RADIANCE),
        ..Surface::default()
    };
    let mut body = Surface {
        vertices: body.positions.iter().map(|p| p.to_array()).collect(),
        triangles: body.triangles.clone(),
        ..surface("body", 0.3)
    };
    body.emission = body.emission.map(|e| e * emission);
    let text = SceneText {
        surfaces: vec![
            Surface {
                shape: Some("cube faces".into()),
                lo: Some([-1.0, -1.2, -0.9]),
                hi: Some([1.1, 1.0, 1.3]),
                ..surface("walls", 0.5)
            },
            body,
        ],
        media: Vec::from_iter(filled.then(|| MediumText {
            region: "all space".into(),
            sigma_t: Some(NumberText::Number(0.8)),
            albedo: 0.7,
            emission_radiance: RADIANCE,
            phase: Some("HG".into()),
            g: Some(0.3),
            ..MediumText::default()
        })),
        ..SceneText::default()
    };
    // At the body, off its middle.
    let (eye, target) = (vec3(-0.8, -0.9, 0.7), vec3(0.2, 0.15, 0.1));
    let direction = (target - eye).normalize().to_array();
    build(&text, &Detector::Radiance { origin: eye.to_array(), direction }.widened(0.6))
}

#[test]
fn i5_nothing_shows_at_one_temperature() {
    let place = |mesh: drt_geom::Mesh, size: f64| {
        mesh.transform(&Affine { linear: Mat3::IDENTITY * size, translation: vec3(0.1, 0.0, 0.05) })
    };
    let bodies = [
        ("cube", place(procedural::cube(), 0.35)),
        ("ball", place(procedural::icosphere(1), 0.45)),
        ("bumps", place(procedural::bumpy_sphere(2, 0.2, 4.0), 0.4)),
    ];
    let spin =
        Affine { linear: Mat3::skew(vec3(0.5, -0.3, 0.8)), translation: vec3(0.3, 0.4, -0.2) };
    let mut claims = Vec::new();
    for (name, body) in &bodies {
        for filled in [false, true] {
            let built = isothermal(body, filled, 1.0).unwrap();
            let mut motions = vec![
                ("moves", vec![moves("body", GeometryChange::Matrix(spin))]),
                (
                    "reflects",
                    vec![
                        changes("body", "reflectance", ValueChange::Add(Rgb::ONE)),
                        changes("body", "radiance", ValueChange::Add(Rgb::splat(-1.3))),
                    ],
                ),
            ];
            if filled {
                motions.push(("thickens", thins(&built)));
                let g = changes("medium 0", "g", ValueChange::Add(Rgb::ONE));
                motions.push(("scatters forward", vec![g]));
            }
            let medium = if filled { "medium" } else { "vacuum" };
            for (motion, left) in motions {
                let (name, built) = (format!("{name} {motion} in {medium}"), built.clone());
                claims.push(Claim { name, built, left, right: Vec::new(), wrong: None });
            }
        }
    }
    check(claims);
    // The fault: a body colder than the rest.
    let cold = |filled: bool| {
        let built = isothermal(&bodies[1].1, filled, 0.2).unwrap();
        let left = vec![moves("body", GeometryChange::Matrix(spin))];
        Claim { name: "cold body".into(), built, left, right: Vec::new(), wrong: None }
    };
    check_faults(vec![cold(false), cold(true)]);
}

/// Floors that slide in their own plane, with shadows on them and their edges out of sight.
#[test]
fn i6_sliding_in_the_own_plane_shows_nothing() {
    let oracles = trials().into_iter().map(|t| (t.name, t.built));
    let rooms = rooms().unwrap().into_iter().map(|(n, b)| (n.to_string(), b));
    let with_floor = oracles.chain(rooms).filter(|(_, b)| b.mesh("floor").is_some());
    let claim = |(name, built): (String, Built)| {
        let slides = |v| vec![moves("floor", GeometryChange::Translate(v))];
        let wrong = Some(slides(vec3(1.0, 0.0, 2.0)));
        Claim { name, built, left: slides(Vec3::X), right: Vec::new(), wrong }
    };
    check(with_floor.map(claim).collect());
}

#[test]
fn i7_derivatives_are_linear() {
    let (a, b) = (0.7, -1.6);
    let moving = |e: &Effect| matches!(e.change, drt_motion::Change::Geometry(_));
    let mut motions = Vec::new();
    for trial in trials() {
        let of_scene = trial.parameters.into_iter().map(|(p, _)| p.effects);
        let mut of_scene = of_scene.filter(|effects| effects.iter().all(moving));
        if let (Some(first), Some(second)) = (of_scene.next(), of_scene.next()) {
            motions.push((trial.name, trial.built, first, second));
        }
    }
    for (name, built) in rooms().unwrap() {
        if built.mesh("body").is_some() {
            let spin = Affine { linear: Mat3::skew(Vec3::Z), translation: Vec3::ZERO };
            let first = vec![moves("body", GeometryChange::Matrix(spin))];
            let second = vec![moves("body", GeometryChange::Translate(vec3(0.3, 0.2, 0.5)))];
            motions.push((name.into(), built, first, second));
        }
    }
    let claim = |(name, built, first, second): (String, Built, Vec<Effect>, Vec<Effect>)| {
        let sum = |a, b| [scaled(&first, a), scaled(&second, b)];
        // In a furnace nothing shows, and the motions of the slab are two of the same effect.
        let alike = name.contains("furnace") || name.contains("slab");
        let wrong = (!alike).then(|| sum(b, a).concat());
        Claim { name, built, left: sum(a, b).concat(), right: sum(a, b).into(), wrong }
    };
    check(motions.into_iter().map(claim).collect());
}
