//! Stages of one material each: its numbers, and a panel of it that moves and turns in its plane.

use std::f64::consts::{FRAC_PI_2, PI};
use std::sync::Arc;

use drt_estimators::surface::{
    Anisotropic, Bsdf, Coating, Distribution, Measured, MeasuredTables, Plastic, Principled,
    PrincipledThin, RoughConductor, RoughDielectric, TwoSided,
};
use drt_geom::Mesh;
use drt_geom::procedural::rectangle;
use drt_math::{Rgb, Vec3, vec3};

use super::effects::{add, raise, translate, turn};
use super::set::{diffuse, placed};
use super::{Cell, Set, Stage};
use crate::Result;

/// Turns of the panel in its own plane are about this.
const NORMAL: Vec3 = vec3(0.0, 0.894_427_190_999_916, -0.447_213_595_499_958);

/// The mesh with texture coordinates from its own x and y, of [-1, 1].
pub(super) fn with_coordinates(mesh: &Mesh) -> Result<Mesh> {
    let corners = |t: &[u32; 3]| {
        t.map(|v| {
            let p = mesh.positions[v as usize];
            [0.5 + 0.5 * p.x, 0.5 + 0.5 * p.y]
        })
    };
    let texcoords = mesh.triangles.iter().map(corners).collect();
    Ok(mesh.clone().with_texcoords(texcoords)?)
}

/// A panel that leans back between a wall and a lamp.
pub(super) fn panel(bsdf: Bsdf) -> Result<Set> {
    let tilt = NORMAL.z.acos();
    let panel = with_coordinates(&rectangle())?;
    let panel = placed(&panel, vec3(0.9, 0.7, 1.0), Vec3::X, -tilt, Vec3::ZERO);
    let wall = placed(&rectangle(), vec3(2.0, 2.0, 1.0), Vec3::X, PI, vec3(0.0, 0.3, 1.4));
    let lamp = placed(&rectangle(), vec3(0.6, 0.5, 1.0), Vec3::X, FRAC_PI_2, vec3(-0.3, 1.8, 0.2));
    Ok(Set::new(vec3(0.3, 1.2, -2.6), vec3(0.0, 0.1, 0.0), 42.0, 3)?
        .shape("panel", panel, bsdf)
        .shape("wall", wall, diffuse([0.6, 0.4, 0.3]))
        .lamp("lamp", lamp, Rgb::new(7.0, 6.0, 5.0)))
}

/// The panel's numbers, the first of which is in the short check if there are any, and its motions.
fn stage(name: &'static str, bsdf: Bsdf, numbers: Vec<Cell>) -> Result<Stage> {
    let mut cells: Vec<Cell> = numbers.into_iter().map(|c| c.samples(512)).collect();
    if let Some(first) = cells.first_mut() {
        *first = first.clone().representative();
    }
    let moves = Cell::new("panel moves", [translate("panel", vec3(0.3, 0.5, -0.3))]);
    cells.push(if matches!(bsdf, Bsdf::TwoSided(_)) { moves } else { moves.representative() });
    let turns = Cell::new("panel turns in its plane", [turn("panel", NORMAL, Vec3::ZERO)]);
    let turns = turns.samples(1024);
    // Lobes that are the same all around do not see it.
    let oriented = match &bsdf {
        Bsdf::Anisotropic(_) => true,
        Bsdf::Measured(b) => b.is_oriented(),
        _ => false,
    };
    cells.push(if oriented { turns.representative() } else { turns });
    cells.push(Cell::new("panel tips", [turn("panel", vec3(1.0, 0.2, 0.1), Vec3::ZERO)]));
    Ok(Stage::new(name, panel(bsdf)?.scene, cells))
}

fn number(property: &str, by: f64) -> Cell {
    Cell::new(property, [raise("panel", property, by)])
}

fn colour(property: &str, by: [f64; 3]) -> Cell {
    Cell::new(property, [add("panel", property, by)])
}

/// Burley's model with most of its lobes, longer than wide.
///
/// # Errors
/// When the library rejects the scene.
pub fn principled() -> Result<Stage> {
    let bsdf = Principled {
        base_color: Rgb::new(0.6, 0.4, 0.2),
        roughness: 0.5,
        anisotropic: 0.6,
        metallic: 0.4,
        sheen: 0.4,
        clearcoat: 0.5,
        flatness: 0.3,
        ..Principled::default()
    };
    let numbers = vec![
        number("roughness", 0.8),
        colour("base_color", [1.0, 0.5, -0.5]),
        number("metallic", 1.0),
        number("eta", 1.0),
        number("sheen", 1.0),
        number("clearcoat", 1.0),
    ];
    stage("principled", Bsdf::Principled(Box::new(bsdf)), numbers)
}

/// Burley's thin sheet, which light goes through.
///
/// # Errors
/// When the library rejects the scene.
pub fn thin() -> Result<Stage> {
    let bsdf = PrincipledThin {
        base_color: Rgb::new(0.6, 0.7, 0.3),
        roughness: 0.6,
        anisotropic: 0.5,
        spec_trans: 0.4,
        diff_trans: 0.8,
        ..PrincipledThin::default()
    };
    let numbers = vec![
        number("roughness", 0.8),
        colour("base_color", [1.0, 0.5, -0.5]),
        number("spec_trans", 1.0),
        number("diff_trans", 1.0),
        number("eta", 1.0),
    ];
    stage("thin sheet", Bsdf::PrincipledThin(Box::new(bsdf)), numbers)
}

fn metal() -> RoughConductor {
    RoughConductor {
        distribution: Distribution::Ggx,
        eta: Rgb::new(0.2, 0.9, 1.4),
        k: Rgb::new(3.5, 2.4, 1.9),
        ..RoughConductor::default()
    }
}

/// The tables that a measurement of metal would give.
///
/// # Errors
/// When the library rejects the scene.
pub fn measured() -> Result<Stage> {
    tabulated("measured metal", [0.4; 2], &[0.0])
}

/// The same of metal whose lobes are longer than wide, for viewers all around.
///
/// # Errors
/// When the library rejects the scene.
pub fn measured_brushed() -> Result<Stage> {
    let azimuths: Vec<f32> = (0_u8..9).map(|k| (f32::from(k) / 4.0 - 1.0) * PI as f32).collect();
    tabulated("measured brushed metal", [0.6, 0.25], &azimuths)
}

fn tabulated(name: &'static str, alpha: [f64; 2], azimuths: &[f32]) -> Result<Stage> {
    let tables = MeasuredTables::of_metal(&metal(), alpha, azimuths, [7, 17, 9])?;
    stage(name, Bsdf::Measured(Arc::new(Measured::new(tables)?)), Vec::new())
}

/// Metal whose lobes are longer than wide.
///
/// # Errors
/// When the library rejects the scene.
pub fn brushed() -> Result<Stage> {
    let bsdf = Anisotropic { base: Bsdf::RoughConductor(metal()), alpha: [0.6, 0.25] };
    let numbers = vec![
        number("alpha_u", 1.0),
        number("alpha_v", 0.8),
        colour("eta", [1.0, 0.5, -0.5]),
        colour("k", [1.0, 2.0, -1.0]),
        number("specular_reflectance", 1.0),
    ];
    stage("brushed metal", Bsdf::Anisotropic(Box::new(bsdf)), numbers)
}

/// A rough pane whose lobes are longer than wide.
///
/// # Errors
/// When the library rejects the scene.
pub fn pressed() -> Result<Stage> {
    let glass = RoughDielectric { distribution: Distribution::Beckmann, ..Default::default() };
    let bsdf = Anisotropic { base: Bsdf::RoughDielectric(glass), alpha: [0.5, 0.3] };
    let numbers = vec![
        number("alpha_v", 0.8),
        number("alpha_u", 1.0),
        number("eta", 1.0),
        number("specular_transmittance", -1.0),
    ];
    stage("pressed glass", Bsdf::Anisotropic(Box::new(bsdf)), numbers)
}

/// A coating on both sides of paint, as `roughplastic` has it.
///
/// # Errors
/// When the library rejects the scene.
pub fn coated() -> Result<Stage> {
    plastic("rough plastic", Coating::rough(Distribution::Ggx, 0.3, 1.5)?)
}

/// The same as `pplastic` has it.
///
/// # Errors
/// When the library rejects the scene.
pub fn unmixed() -> Result<Stage> {
    plastic("unmixed plastic", Coating::unmixed(Distribution::Beckmann, 0.3, 1.5)?)
}

fn plastic(name: &'static str, coating: Coating) -> Result<Stage> {
    let bsdf = Plastic { reflectance: Rgb::new(0.5, 0.4, 0.2), ..Plastic::new(coating) };
    let bsdf = Bsdf::TwoSided(Box::new(TwoSided { front: Bsdf::Plastic(bsdf), back: None }));
    let numbers =
        vec![colour("reflectance", [1.0, 0.5, -0.5]), number("specular_reflectance", -1.0)];
    stage(name, bsdf, numbers)
}
