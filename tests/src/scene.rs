//! Scenes from the oracle file, without a scene file in between.

use std::sync::Arc;

use drt_estimators::emitter::Emitter;
use drt_estimators::surface::{Bsdf, Diffuse, TwoSided};
use drt_estimators::{
    Integrator, MediumBoundary, Named, Scene, SceneEmitter, SceneSensor, Shape, Surrounding,
};
use drt_geom::Mesh;
use drt_math::{Affine, Mat3, Rgb};
use drt_medium::{Grid, GridMedium, Homogeneous, Layout, Medium, Phase, Volume};

use crate::Result;
use crate::detector::{sensor, vector};
use crate::oracle::{Detector, Light, MediumText, NumberText, SceneText, Surface, Triple};
use crate::region::{Region, interfaces};

/// The id of the one sensor.
pub const DETECTOR: &str = "detector";

/// A scene with what parameters need to know about it.
#[derive(Clone, Debug)]
pub struct Built {
    /// The scene.
    pub scene: Scene,
    /// Boxes that hold media.
    pub regions: Vec<Region>,
    /// Ids of the null interfaces around them.
    pub interfaces: Vec<String>,
    /// Ids of surfaces that reflect.
    pub reflectors: Vec<String>,
    /// Ids of surfaces that emit.
    pub emitters: Vec<String>,
}

/// Builds what a case describes.
///
/// # Errors
/// When the description has a part of unknown kind, or one that the library rejects.
pub fn build(text: &SceneText, detector: &Detector) -> Result<Built> {
    let mut built = Built {
        scene: Scene::default(),
        regions: Vec::new(),
        interfaces: Vec::new(),
        reflectors: Vec::new(),
        emitters: Vec::new(),
    };
    built.scene.integrator = Integrator {
        max_depth: match text.max_order.as_deref() {
            None => None,
            Some("single scattering only") => Some(2),
            Some(other) => return Err(format!("unknown max_order `{other}`").into()),
        },
        ..Integrator::default()
    };
    for surface in &text.surfaces {
        built.surface(surface)?;
    }
    let mut everywhere = None;
    for (i, text) in text.media.iter().enumerate() {
        built.scene.media.push(Named::new(format!("medium {i}"), medium(text)?));
        match (text.region.as_str(), text.lo, text.hi) {
            ("box", Some(lo), Some(hi)) => {
                built.regions.push(Region { medium: i, ends: [vector(lo), vector(hi)] });
            }
            ("all space", _, _) => everywhere = Some(i),
            (other, _, _) => return Err(format!("unknown region `{other}`").into()),
        }
    }
    built.interfaces()?;
    for light in &text.lights {
        built.light(light)?;
    }
    let medium = match everywhere {
        Some(m) => Surrounding::Stated(Some(m)),
        None => Surrounding::Counted,
    };
    let sensor = SceneSensor { sensor: sensor(detector)?, medium, sample_count: None };
    built.scene.sensors.push(Named::new(DETECTOR, sensor));
    Ok(built)
}

impl Built {
    fn surface(&mut self, s: &Surface) -> Result<()> {
        let mesh = match (&s.shape, s.lo, s.hi) {
            (None, _, _) => {
                let positions = s.vertices.iter().map(|v| vector(*v)).collect();
                Mesh::new(positions, s.triangles.clone())?
            }
            (Some(shape), Some(lo), Some(hi)) if shape == "cube faces" => {
                let mut walls = Region { medium: 0, ends: [vector(lo), vector(hi)] }.mesh()?;
                walls.flip();
                walls
            }
            (Some(other), _, _) => return Err(format!("unknown shape `{other}`").into()),
        };
        let reflectance = match s.bsdf.as_str() {
            "black" => 0.0,
            "diffuse" => s.albedo.ok_or("a diffuse surface has no albedo")?,
            other => return Err(format!("unknown bsdf `{other}`").into()),
        };
        let diffuse = Bsdf::Diffuse(Diffuse { reflectance: Rgb::splat(reflectance) });
        let bsdf = if s.two_sided {
            Bsdf::TwoSided(Box::new(TwoSided { front: diffuse, back: None }))
        } else {
            diffuse
        };
        let emitter = s.emission.map(|radiance| {
            self.emitter(None, Emitter::Area { radiance: Rgb::splat(radiance) });
            self.emitters.push(s.name.clone());
            self.scene.emitters.len() - 1
        });
        if s.bsdf == "diffuse" {
            self.reflectors.push(s.name.clone());
        }
        self.shape(s.name.clone(), mesh, bsdf, None, emitter);
        Ok(())
    }

    fn interfaces(&mut self) -> Result<()> {
        for (i, face) in interfaces(&self.regions)?.into_iter().enumerate() {
            let id = format!("interface {i}");
            let boundary =
                MediumBoundary { interior: Some(face.interior), exterior: face.exterior };
            self.shape(id.clone(), face.mesh, Bsdf::Null, Some(boundary), None);
            self.interfaces.push(id);
        }
        Ok(())
    }

    fn light(&mut self, light: &Light) -> Result<()> {
        let (id, emitter) = match light {
            Light::Point { position, intensity } => {
                let intensity = Rgb::splat(*intensity);
                ("light", Emitter::Point { position: vector(*position), intensity })
            }
            Light::Directional { direction, irradiance } => {
                let irradiance = Rgb::splat(*irradiance);
                ("light", Emitter::Directional { direction: vector(*direction), irradiance })
            }
            Light::Environment { radiance } => {
                ("sky", Emitter::Constant { radiance: Rgb::splat(radiance.number()?) })
            }
        };
        self.emitter(Some(id), emitter);
        Ok(())
    }

    fn emitter(&mut self, id: Option<&str>, emitter: Emitter) {
        let item = SceneEmitter { emitter, medium: Surrounding::Counted };
        self.scene.emitters.push(Named { id: id.map(String::from), item });
    }

    fn shape(
        &mut self,
        id: String,
        mesh: Mesh,
        bsdf: Bsdf,
        boundary: Option<MediumBoundary>,
        emitter: Option<usize>,
    ) {
        self.scene.bsdfs.push(Named::anonymous(bsdf));
        let bsdf = self.scene.bsdfs.len() - 1;
        self.scene.shapes.push(Shape {
            id: Some(id),
            mesh: Arc::new(mesh),
            bsdf,
            boundary,
            emitter,
        });
    }

    /// The mesh of a shape by its id.
    #[must_use]
    pub fn mesh(&self, id: &str) -> Option<&Mesh> {
        let named = self.scene.shapes.iter().find(|s| s.id.as_deref() == Some(id));
        named.map(|s| &*s.mesh)
    }
}

fn medium(text: &MediumText) -> Result<Medium> {
    let phase = match (text.phase.as_deref(), text.g) {
        (Some("HG"), Some(g)) => Phase::henyey_greenstein(g)?,
        (None | Some("isotropic"), _) => Phase::Isotropic,
        (Some("Rayleigh"), _) => Phase::Rayleigh,
        (Some(other), _) => return Err(format!("unknown phase function `{other}`").into()),
    };
    let [albedo, emission] = [text.albedo, text.emission_radiance].map(Rgb::splat);
    Ok(match (&text.sigma_t, &text.sigma_t_grid) {
        (Some(NumberText::Number(sigma_t)), None) => {
            Medium::new(Homogeneous::new(Rgb::splat(*sigma_t), albedo, emission)?, phase)
        }
        (None, Some(values)) => {
            let (Some(lo), Some(hi)) = (text.lo, text.hi) else {
                return Err("a grid has no box".into());
            };
            let density = grid(values, lo, hi)?;
            let [albedo, emission] = [albedo, emission].map(Volume::Constant);
            let scale = text.sigma_t_scale.unwrap_or(1.0);
            Medium::new(GridMedium::new(density, scale, albedo, emission)?, phase)
        }
        _ => return Err("a medium needs a number for sigma_t, or a grid".into()),
    })
}

/// Values `[i][j][k]` at the nodes of a lattice from corner to corner.
fn grid(values: &[Vec<Vec<f64>>], lo: Triple, hi: Triple) -> Result<Grid> {
    let size = [values.len(), values[0].len(), values[0][0].len()];
    let [nx, ny, nz] = size;
    let mut flat = Vec::with_capacity(nx * ny * nz);
    for k in 0..nz {
        for j in 0..ny {
            for plane in values {
                let value = plane.get(j).and_then(|row| row.get(k));
                flat.push(*value.ok_or("the rows of a grid differ in length")?);
            }
        }
    }
    let (lo, hi) = (vector(lo), vector(hi));
    let place = Affine { linear: Mat3::diagonal(hi - lo), translation: lo };
    Ok(Grid::new(size, 1, flat)?.with_layout(Layout::NodeCentred).with_placement(place)?)
}
