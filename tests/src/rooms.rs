//! Scenes of our own for the invariances: small images of what the oracles do not have.

use drt_estimators::filter::{Filter, FilterKind};
use drt_estimators::sensor::{Lens, Sensor};
use drt_estimators::surface::{Bsdf, Distribution, Phong, RoughConductor, RoughDielectric};
use drt_geom::{Mesh, procedural};
use drt_math::{Affine, Mat3, Vec3, vec3};

use crate::Result;
use crate::oracle::{Detector, Light, MediumText, NumberText, SceneText, Surface};
use crate::scene::{Built, build};

/// Pixels along each side of the image.
const SIDE: u32 = 16;

/// A scene with its name.
pub type Room = (&'static str, Built);

/// All of them.
///
/// # Errors
/// When the library rejects one.
pub fn rooms() -> Result<Vec<Room>> {
    Ok(vec![
        ("bumps", bumps()?),
        ("knot", knot()?),
        ("glass", glass()?),
        ("fog", fog()?),
        ("cloud", cloud()?),
    ])
}

/// A bumpy diffuse body on a diffuse floor, under a point light.
fn bumps() -> Result<Built> {
    let body = placed(&procedural::bumpy_sphere(2, 0.2, 4.0), 0.7, vec3(0.1, 0.0, 0.9));
    let text = SceneText {
        surfaces: vec![floor("diffuse"), surface("body", &body, "diffuse", None)],
        lights: vec![point([1.5, -1.0, 3.0])],
        ..SceneText::default()
    };
    room(&text, 4)
}

/// A rough metal knot over a glossy floor, under an area light.
fn knot() -> Result<Built> {
    let knot = procedural::torus_knot(&procedural::TorusKnot {
        segments: 48,
        sides: 6,
        ..procedural::TorusKnot::default()
    });
    let text = SceneText {
        surfaces: vec![
            floor("diffuse"),
            surface("body", &placed(&knot, 0.3, vec3(0.0, 0.1, 1.0)), "diffuse", None),
            lamp(),
        ],
        ..SceneText::default()
    };
    let mut built = room(&text, 4)?;
    built.scene.bsdfs[0].item = Bsdf::Phong(Phong { exponent: 8.0, ..Phong::default() });
    built.scene.bsdfs[1].item = Bsdf::RoughConductor(RoughConductor {
        distribution: Distribution::Ggx,
        alpha: 0.4,
        ..RoughConductor::default()
    });
    Ok(built)
}

/// A rough glass ball on a diffuse floor, under an area light.
fn glass() -> Result<Built> {
    let ball = placed(&procedural::icosphere(1), 0.7, vec3(0.0, 0.0, 0.9));
    let text = SceneText {
        surfaces: vec![floor("diffuse"), surface("body", &ball, "diffuse", None), lamp()],
        ..SceneText::default()
    };
    let mut built = room(&text, 5)?;
    built.scene.bsdfs[1].item = Bsdf::RoughDielectric(RoughDielectric {
        distribution: Distribution::Ggx,
        alpha: 0.5,
        eta: 1.3,
        ..RoughDielectric::default()
    });
    Ok(built)
}

/// A box of fog in front of a diffuse floor, half in the shadow of a black plate.
fn fog() -> Result<Built> {
    let text = SceneText {
        surfaces: vec![floor("diffuse"), plate()],
        media: vec![MediumText {
            sigma_t: Some(NumberText::Number(0.9)),
            phase: Some("HG".into()),
            g: Some(0.4),
            ..volume()
        }],
        lights: vec![point([0.3, 0.2, 3.5])],
        ..SceneText::default()
    };
    room(&text, 4)
}

/// A cloud of voxels under a sky and a slanting sun.
fn cloud() -> Result<Built> {
    let value = |i: u32, j: u32, k: u32| 0.3 + f64::from((7 * i + 5 * j + 3 * k) % 11) * 0.25;
    let row = |i, j| (0..3).map(|k| value(i, j, k)).collect();
    let grid = (0..3).map(|i| (0..4).map(|j| row(i, j)).collect()).collect();
    let text = SceneText {
        surfaces: vec![floor("diffuse")],
        media: vec![MediumText { sigma_t_grid: Some(grid), sigma_t_scale: Some(0.8), ..volume() }],
        lights: vec![
            Light::Environment { radiance: NumberText::Number(0.4) },
            Light::Directional { direction: [0.3, 0.2, -1.0], irradiance: 2.0 },
        ],
        ..SceneText::default()
    };
    room(&text, 4)
}

fn room(text: &SceneText, max_depth: u32) -> Result<Built> {
    let meter = Detector::Irradiance { point: [0.0; 3], normal: [0.0, 0.0, 1.0] };
    let mut built = build(text, &meter)?;
    let eye = [vec3(1.8, -2.6, 4.6), vec3(0.0, 0.0, 0.6), Vec3::Z];
    let filter = Filter::new(FilterKind::GAUSSIAN)?;
    built.scene.sensors[0].item.sensor =
        Sensor::look_at(eye, Lens::with_fov(38.0), [SIDE, SIDE], filter)?;
    built.scene.integrator.max_depth = Some(max_depth);
    Ok(built)
}

fn placed(mesh: &Mesh, size: f64, at: Vec3) -> Mesh {
    mesh.transform(&Affine { linear: Mat3::IDENTITY * size, translation: at })
}

fn surface(name: &str, mesh: &Mesh, bsdf: &str, emission: Option<f64>) -> Surface {
    Surface {
        name: name.into(),
        vertices: mesh.positions.iter().map(|p| p.to_array()).collect(),
        triangles: mesh.triangles.clone(),
        bsdf: bsdf.into(),
        albedo: Some(0.6),
        emission,
        ..Surface::default()
    }
}

fn floor(bsdf: &str) -> Surface {
    surface("floor", &placed(&procedural::rectangle(), 12.0, Vec3::ZERO), bsdf, None)
}

/// Faces down.
fn lamp() -> Surface {
    let mut mesh = placed(&procedural::rectangle(), 0.8, vec3(0.6, -0.4, 3.2));
    mesh.flip();
    surface("light", &mesh, "black", Some(5.0))
}

fn plate() -> Surface {
    let plate = placed(&procedural::rectangle(), 0.6, vec3(0.3, 0.1, 2.4));
    Surface { two_sided: true, ..surface("body", &plate, "black", None) }
}

fn point(position: [f64; 3]) -> Light {
    Light::Point { position, intensity: 12.0 }
}

fn volume() -> MediumText {
    MediumText {
        region: "box".into(),
        lo: Some([-0.9, -0.8, 0.2]),
        hi: Some([0.9, 0.7, 1.7]),
        albedo: 0.8,
        ..MediumText::default()
    }
}
