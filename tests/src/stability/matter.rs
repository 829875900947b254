//! Materials and media of extreme numbers.

use std::f64::consts::FRAC_PI_2;

use drt_estimators::emitter::Emitter;
use drt_estimators::surface::{Bsdf, Diffuse, RoughConductor};
use drt_geom::procedural::{cube, rectangle};
use drt_math::{Affine, Mat3, Rgb, Vec3, vec3};
use drt_medium::{Grid, GridMedium, Homogeneous, MediumKind, Phase, Volume};
use drt_motion::Effect;

use super::{Case, Condition};
use crate::Result;
use crate::matrix::Set;
use crate::matrix::effects::{add, raise, translate, turn};
use crate::matrix::set::{at, diffuse, inside_out, placed};

pub(super) fn conditions() -> Result<Vec<Condition>> {
    let mut all =
        vec![thin()?, nothing()?, thick()?, black()?, white()?, dark_fog()?, bright_fog()?];
    all.extend([forward()?, backward()?, mirror()?, long_paths()?, long_paths_in_fog()?]);
    all.extend([single_voxel()?, empty_grid()?]);
    Ok(all)
}

const PLACE: Vec3 = vec3(0.1, 0.5, 0.0);

fn stage(depth: u32) -> Result<Set> {
    let floor = placed(&rectangle(), vec3(3.0, 3.0, 1.0), Vec3::X, -FRAC_PI_2, Vec3::ZERO);
    let lamp = placed(&rectangle(), vec3(0.5, 0.5, 1.0), Vec3::X, FRAC_PI_2, vec3(0.6, 2.2, 0.3));
    Ok(Set::new(vec3(-0.3, 1.5, -2.4), vec3(0.1, 0.35, 0.0), 36.0, depth)?
        .shape("floor", floor, diffuse([0.7, 0.5, 0.4]))
        .lamp("lamp", lamp, Rgb::new(6.0, 7.0, 8.0)))
}

fn body() -> drt_geom::Mesh {
    placed(&cube(), vec3(0.35, 0.3, 0.35), vec3(0.3, 1.0, 0.2), 0.5, PLACE)
}

/// A box of a medium over the floor.
fn filled(kind: impl Into<MediumKind>, phase: Phase, depth: u32) -> Result<drt_estimators::Scene> {
    Ok(stage(depth)?.medium("fog", kind, phase).interface("box", body(), "fog", None).scene)
}

fn fog(sigma_t: f64, albedo: f64) -> Result<Homogeneous> {
    Ok(Homogeneous::new(Rgb::new(1.0, 1.5, 2.0) * sigma_t, Rgb::splat(albedo), Rgb::ZERO)?)
}

fn common() -> Vec<(&'static str, Vec<Effect>)> {
    vec![
        ("box moves", vec![translate("box", vec3(0.8, 0.3, -0.4))]),
        ("lamp moves", vec![translate("lamp", vec3(0.6, -0.5, 0.3))]),
        ("extinction", vec![raise("fog", "sigma_t", 1.0)]),
        ("albedo", vec![add("fog", "albedo", [-0.5, 0.5, 1.0])]),
    ]
}

/// A medium too thin to matter, whose changes do: by the extinction, and by the albedo relative to
/// the extinction.
fn thin() -> Result<Condition> {
    let of = |sigma_t: f64| -> Result<Case> {
        let phase = Phase::henyey_greenstein(0.3)?;
        let mut parameters = common();
        parameters[3].1 = vec![raise("fog", "albedo", 0.1 / sigma_t)];
        Ok(Case::new(filled(fog(sigma_t, 0.8)?, phase, 3)?, parameters.split_off(1)))
    };
    Ok(Condition::new("optical depth 1e-9", of(1e-9)?, of(1e-4)?))
}

/// The same against no medium.
fn nothing() -> Result<Condition> {
    let phase = Phase::henyey_greenstein(0.3)?;
    let hard = filled(fog(1e-9, 0.8)?, phase.clone(), 3)?;
    let easy = filled(fog(0.0, 0.8)?, phase, 3)?;
    let [hard, easy] = [hard, easy].map(|scene| Case::new(scene, common()));
    Ok(Condition::new("optical depth 1e-9 and none", hard, easy))
}

fn thick() -> Result<Condition> {
    let of = |sigma_t: f64| -> Result<Case> {
        let mut parameters = common();
        // Relative, so that the derivative does not shrink with the mean free path.
        parameters[2].1 = vec![raise("fog", "sigma_t", sigma_t)];
        Ok(Case::new(filled(fog(sigma_t, 0.8)?, Phase::Isotropic, 12)?, parameters))
    };
    Ok(Condition::new("optical depth 1e5", of(1e5)?, of(1e3)?))
}

fn with_body(bsdf: Bsdf) -> Result<Case> {
    let parameters = vec![
        ("box moves", vec![translate("box", vec3(0.8, 0.3, -0.4))]),
        ("box turns", vec![turn("box", vec3(0.2, 1.0, 0.4), PLACE)]),
        ("lamp moves", vec![translate("lamp", vec3(0.6, -0.5, 0.3))]),
        ("reflectance", vec![add("box", "reflectance", [-1.0, -0.5, -0.7])]),
    ];
    Ok(Case::new(stage(4)?.shape("box", body(), bsdf).scene, parameters))
}

fn black() -> Result<Condition> {
    let [hard, easy] = [0.0, 1e-7].map(|r| with_body(diffuse([r; 3])));
    Ok(Condition::new("reflectance 0", hard?, easy?))
}

fn white() -> Result<Condition> {
    let [hard, easy] = [1.0, 1.0 - 1e-7].map(|r| with_body(diffuse([r; 3])));
    Ok(Condition::new("reflectance 1", hard?, easy?))
}

fn of_albedo(albedo: f64, depth: u32) -> Result<Case> {
    let phase = Phase::henyey_greenstein(0.3)?;
    Ok(Case::new(filled(fog(1.0, albedo)?, phase, depth)?, common()))
}

fn dark_fog() -> Result<Condition> {
    Ok(Condition::new("albedo 0", of_albedo(0.0, 3)?, of_albedo(1e-7, 3)?))
}

fn bright_fog() -> Result<Condition> {
    Ok(Condition::new("albedo 1", of_albedo(1.0, 6)?, of_albedo(1.0 - 1e-7, 6)?))
}

/// Light scattered straight on is light not scattered.
fn forward() -> Result<Condition> {
    let scene = |kind: Homogeneous, g: f64| filled(kind, Phase::henyey_greenstein(g)?, 64);
    let unscattered = Homogeneous::new(Rgb::new(1.0, 1.5, 2.0) * 0.4, Rgb::ZERO, Rgb::ZERO)?;
    let hard = Case::new(
        scene(fog(1.0, 0.6)?, 0.9999)?,
        vec![
            ("extinction", vec![raise("fog", "sigma_t", 1.0)]),
            ("albedo", vec![raise("fog", "albedo", 1.0)]),
            ("lamp", vec![add("lamp", "radiance", [1.0, 0.5, 2.0])]),
        ],
    );
    let easy = Case::new(
        scene(unscattered, 0.0)?,
        vec![
            ("extinction", vec![raise("fog", "sigma_t", 0.4)]),
            ("albedo", vec![add("fog", "sigma_t", [-1.0, -1.5, -2.0])]),
            ("lamp", vec![add("lamp", "radiance", [1.0, 0.5, 2.0])]),
        ],
    );
    // Blocks need many samples before rare paths around the peak make errors normal.
    Ok(Condition::new("g = 0.9999", hard, easy).samples(2048))
}

/// Light scattered straight back, out of a medium so thin that it happens once.
fn backward() -> Result<Condition> {
    let of = |g: f64| -> Result<Case> {
        let scene = filled(fog(1.0, 0.6)?, Phase::henyey_greenstein(g)?, 4)?;
        let parameters = vec![
            ("extinction", vec![raise("fog", "sigma_t", 1.0)]),
            ("albedo", vec![raise("fog", "albedo", 1.0)]),
            ("lamp", vec![add("lamp", "radiance", [1.0, 0.5, 2.0])]),
        ];
        Ok(Case::new(scene, parameters))
    };
    Ok(Condition::new("g = -0.9999", of(-0.9999)?, of(-0.999)?))
}

fn mirror() -> Result<Condition> {
    let of = |alpha: f64| -> Result<Case> {
        let metal = RoughConductor {
            alpha,
            eta: Rgb::new(0.2, 0.9, 1.4),
            k: Rgb::new(3.5, 2.4, 1.9),
            ..RoughConductor::default()
        };
        let sky = Emitter::Constant { radiance: Rgb::new(0.5, 0.6, 0.7) };
        let scene =
            stage(4)?.shape("box", body(), Bsdf::RoughConductor(metal)).light("sky", sky).scene;
        let parameters = vec![
            ("sky", vec![add("sky", "radiance", [1.0, 0.5, 2.0])]),
            ("floor", vec![add("floor", "reflectance", [1.0, 0.5, -0.7])]),
            ("k", vec![add("box", "k", [1.0, 2.0, -1.0])]),
            ("specular reflectance", vec![raise("box", "specular_reflectance", 1.0)]),
            ("box moves", vec![translate("box", vec3(0.8, 0.3, -0.4))]),
        ];
        Ok(Case::new(scene, parameters))
    };
    Ok(Condition::new("alpha 1e-3", of(1e-3)?, of(3e-3)?))
}

/// Inside a closed white room, whose radiance the walls' emission and losses balance.
fn furnace(depth: u32, rr_depth: u32, medium: bool) -> Result<Case> {
    let loss = 0.02;
    let room = at(&inside_out(cube()), vec3(1.2, 1.0, 1.1), Vec3::ZERO);
    let mut set = Set::new(vec3(0.1, 0.2, -0.9), vec3(0.0, -0.1, 1.0), 60.0, depth)?;
    if medium {
        let fog = Homogeneous::new(Rgb::splat(3.0), Rgb::ONE, Rgb::ZERO)?;
        set = set.medium("fog", fog, Phase::henyey_greenstein(0.8)?);
    }
    set = set.lamp("room", room.clone(), Rgb::splat(loss));
    let mut scene = set.scene;
    let walls = scene.shapes[0].bsdf;
    scene.bsdfs[walls].item = Bsdf::Diffuse(Diffuse { reflectance: Rgb::splat(1.0 - loss) });
    scene.integrator.rr_depth = rr_depth;
    if medium {
        scene.sensors[0].item.medium = drt_estimators::Surrounding::Stated(Some(0));
    }
    let sensor = &mut scene.sensors[0].item.sensor;
    *sensor = sensor.with_film([4, 4])?;
    let mut parameters = vec![
        ("radiance", vec![add("room", "radiance", [1.0, 0.5, 2.0])]),
        ("reflectance", vec![raise("room", "reflectance", 1.0)]),
    ];
    if medium {
        parameters.push(("extinction", vec![raise("fog", "sigma_t", 1.0)]));
    }
    Ok(Case::new(scene, parameters))
}

fn long_paths() -> Result<Condition> {
    let (hard, easy) = (furnace(1000, 1000, false)?, furnace(1000, 5, false)?);
    Ok(Condition::new("paths of 1000 segments", hard, easy).samples(64))
}

fn long_paths_in_fog() -> Result<Condition> {
    let (hard, easy) = (furnace(1000, 1000, true)?, furnace(1000, 5, true)?);
    Ok(Condition::new("paths of 1000 segments in fog", hard, easy).samples(64))
}

/// The box filled with a grid of one voxel, and with a homogeneous medium.
fn single_voxel() -> Result<Condition> {
    let placement = Affine {
        linear: Mat3::rotation(vec3(0.3, 1.0, 0.2).normalize(), 0.5)
            * Mat3::diagonal(vec3(0.7, 0.6, 0.7)),
        translation: Vec3::ZERO,
    };
    let translation = PLACE - placement.linear * Vec3::splat(0.5);
    grids("a grid of one voxel", Affine { translation, ..placement }, 1.3)
}

fn empty_grid() -> Result<Condition> {
    let place = Affine { linear: Mat3::IDENTITY * 1.6, translation: PLACE - Vec3::splat(0.8) };
    grids("a grid of one empty voxel", place, 0.0)
}

fn grids(name: &str, place: Affine, sigma_t: f64) -> Result<Condition> {
    let density = Grid::new([1; 3], 1, vec![sigma_t])?.with_placement(place)?;
    let [albedo, dark] = [0.8, 0.0].map(|v| Volume::Constant(Rgb::splat(v)));
    let grid = GridMedium::new(density, 1.0, albedo, dark)?;
    let plain = Homogeneous::new(Rgb::splat(sigma_t), Rgb::splat(0.8), Rgb::ZERO)?;
    let phase = || Phase::henyey_greenstein(0.3);
    let mut parameters = common();
    parameters.push(("asymmetry", vec![raise("fog", "g", 1.0)]));
    let mut hard = Case::new(filled(grid, phase()?, 3)?, parameters.clone());
    let easy = Case::new(filled(plain, phase()?, 3)?, parameters);
    // The grid moves with its box.
    hard.parameters[0].effects.push(translate("fog", vec3(0.8, 0.3, -0.4)));
    Ok(Condition::new(name, hard, easy))
}
