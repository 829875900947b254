//! Shapes: meshes from files and tessellated primitives, with what they are made of.

mod instances;
mod mesh_file;
mod serialized;
mod shared;
mod texcoords;

use std::sync::Arc;

use drt_estimators::surface::Bsdf;
use drt_estimators::texture::{Texture, VolumeTexture};
use drt_estimators::{MediumBoundary, Named, Shape};
use drt_geom::{Mesh, procedural};
use drt_math::{Affine, Frame, Mat3, Vec3};

use super::element::Element;
use super::properties::Properties;
use super::{Loader, added_bsdf, material_of_none, volume_lights};
use crate::CliError;
pub(super) use shared::SharedMeshes;

/// Bands of a sphere between its poles where none are given; twice as many meridians.
const SPHERE_RESOLUTION: u32 = 128;
/// Corners of a disk where none are given.
const DISK_RESOLUTION: u32 = 256;
/// Sides of a cylinder where none are given.
const CYLINDER_RESOLUTION: u32 = 256;

/// A shape before its placement.
struct Model {
    mesh: Mesh,
    /// A mirroring placement turns it inside out, as it does in Mitsuba: it has no normals of its
    /// own that say which side is the front.
    turns: bool,
    /// Shading normals are to be made from the placed mesh.
    smooth: bool,
}

impl Model {
    fn faceted(mesh: Mesh) -> Self {
        Self { mesh, turns: false, smooth: false }
    }
}

/// True where a texture of a BSDF is the value of a volume.
pub(super) fn takes_volumes(bsdf: &Bsdf) -> bool {
    let mut any = false;
    bsdf.for_each_texture(|_, texture| any |= matches!(texture, Texture::Volume(_)));
    any
}

impl<'a> Loader<'a> {
    /// One shape, unless it has no area, and its map into the world where its mesh is a shared one. A default material is added to the
    /// `declared` ones where it has none.
    pub(super) fn shape(
        &self,
        e: &'a Element,
        bsdfs: &mut Vec<Named<Bsdf>>,
        declared: usize,
        shared: &SharedMeshes,
    ) -> Result<Option<(Shape, Option<Affine>)>, CliError> {
        let p = Properties::of(e)?;
        let emitter = self.index.single(&p, "emitter", None)?;
        // A medium's light is no light of the shape.
        let emitter = emitter.filter(|inner| !volume_lights::is_one(inner.target));
        let boundary = self.boundary(&p)?;
        let bsdf = match self.index.single(&p, "bsdf", None)? {
            Some(bsdf) => match self.referred.borrow().get(&bsdf.target.ordinal) {
                Some(number) => *number,
                None => self.counted(bsdf.child, bsdf.target)?,
            },
            None => {
                let bounds = e.is_legacy() && boundary.is_some();
                added_bsdf(bsdfs, declared, material_of_none(emitter.is_some(), bounds))
            }
        };
        // What looks up volumes knows where each of its points is.
        let in_space = takes_volumes(&bsdfs[bsdf].item);
        let alone = emitter.is_some() || in_space;
        let (mesh, to_world) = match shared.find(&p)?.filter(|_| !alone) {
            Some((mesh, map)) => (Some(mesh), Some(map)),
            None => {
                let mesh = without_degenerate(&p, place(&p, model(&p)?)?);
                let remember = |m| VolumeTexture::remember_positions(m).map_err(|err| e.error(err));
                let mesh = if in_space { mesh.map(remember).transpose()? } else { mesh };
                (mesh.map(Arc::new), None)
            }
        };
        p.finish()?;
        let Some(mesh) = mesh else {
            if emitter.is_some() {
                return Err(e.error("no triangle of this shape, which is a light, has an area"));
            }
            return Ok(None);
        };
        let emitter = emitter
            .and_then(|inner| self.emitters().position(|e| e.ordinal == inner.target.ordinal));
        let id = e.id().map(Into::into);
        Ok(Some((Shape { id, mesh, bsdf, boundary, emitter }, to_world)))
    }

    /// Adds the BSDFs inside others that shapes refer to, as things of their own without a name: what a job changes in one of them
    /// would not change in what it is inside of.
    pub(super) fn referred_bsdfs(&self, bsdfs: &mut Vec<Named<Bsdf>>) -> Result<(), CliError> {
        for e in self.index.referred() {
            self.referred.borrow_mut().insert(e.ordinal, bsdfs.len());
            bsdfs.push(Named::anonymous(self.bsdf(e)?));
        }
        Ok(())
    }

    /// The number of what `child` stands for among things of its kind.
    fn counted(&self, child: &Element, target: &Element) -> Result<usize, CliError> {
        let inside = || child.error("refers to something inside another bsdf; give it a place");
        self.index.position(target).ok_or_else(inside)
    }

    fn boundary(&self, p: &Properties<'a>) -> Result<Option<MediumBoundary>, CliError> {
        let side = |name| -> Result<Option<usize>, CliError> {
            let inner = self.index.single(p, "medium", Some(name))?;
            inner.map(|inner| self.counted(inner.child, inner.target)).transpose()
        };
        let (interior, exterior) = (side("interior")?, side("exterior")?);
        if let Some(other) =
            self.index.inner(p, "medium", None).first().filter(|inner| {
                !matches!(inner.child.attribute("name"), Some("interior" | "exterior"))
            })
        {
            let message = "a medium of a shape must be named `interior` or `exterior`";
            return Err(other.child.error(message));
        }
        let any = interior.is_some() || exterior.is_some();
        Ok(any.then_some(MediumBoundary { interior, exterior }))
    }
}

/// The mesh without triangles that cannot be seen or are there twice; `None` where no triangle is left, and the shape is left out.
fn without_degenerate(p: &Properties<'_>, mesh: Mesh) -> Option<Mesh> {
    let (clean, dropped) = mesh.drop_degenerate();
    let all = mesh.triangles.len();
    let file = p.element.children.iter().find(|e| e.attribute("name") == Some("filename"));
    let of = match file.and_then(|e| e.attribute("value")) {
        Some(file) => format!(" of `{file}`"),
        None => String::new(),
    };
    if clean.triangles.is_empty() {
        let message = format!("left out: none of the {all} triangles{of} has an area");
        p.element.note(message);
        return None;
    }
    if dropped > 0 {
        let message = format!("dropped {dropped} of {all} triangles{of}: no area, or there before");
        p.element.note(message);
    }
    Some(clean)
}

fn model(p: &Properties<'_>) -> Result<Model, CliError> {
    let face_normals = p.boolean("face_normals")?.unwrap_or(false);
    let mut model = match p.kind()? {
        // Wavefront's images begin at the bottom.
        "obj" => from_file(p, face_normals, true, mesh_file::obj)?,
        "ply" => from_file(p, face_normals, false, mesh_file::ply)?,
        "serialized" => {
            let index = p.integer_in("shape_index", 0..=i64::from(u32::MAX))?.unwrap_or(0);
            from_file(p, face_normals, false, |e, path| serialized::read(e, path, index))?
        }
        "cube" => Model::faceted(texcoords::cube(procedural::cube())),
        "rectangle" => Model::faceted(texcoords::rectangle(procedural::rectangle())),
        other => {
            if let Some(round) = round(p)? {
                let mut model = round.model(p.element)?;
                if face_normals {
                    model.mesh.normals = None;
                }
                return Ok(model);
            }
            let why = match other {
                "bsplinecurve" | "linearcurve" => ": curves are no triangles",
                "sdfgrid" => ": a distance field is no triangles",
                _ => "",
            };
            return Err(p.element.error(format!(
                "the shape type `{other}` is not supported{why}; expected obj, ply, serialized, \
                 rectangle, cube, sphere, disk, cylinder, shapegroup, instance or merge"
            )));
        }
    };
    if face_normals {
        model.mesh.normals = None;
    }
    Ok(model)
}

fn from_file(
    p: &Properties<'_>,
    face_normals: bool,
    upside_down: bool,
    read: impl FnOnce(&Element, &std::path::Path) -> Result<Mesh, CliError>,
) -> Result<Model, CliError> {
    let path = p.path("filename")?.ok_or_else(|| p.element.error("`filename` is missing"))?;
    let flip = p.boolean("flip_tex_coords")?.unwrap_or(upside_down);
    // Silhouettes are sampled in another way.
    p.accept(&["silhouette_sampling_weight"]);
    let mut mesh = read(p.element, &path)?;
    for [_, v] in mesh.texcoords.iter_mut().flatten().flatten().filter(|_| flip) {
        *v = 1.0 - *v;
    }
    let turns = face_normals || mesh.normals.is_none();
    let smooth = !face_normals && mesh.normals.is_none();
    Ok(Model { mesh, turns, smooth })
}

/// A shape with a curved outline, before it is placed.
struct Round {
    kind: &'static str,
    resolution: u32,
    /// From the mesh of all shapes of its kind and resolution; `None` for that mesh itself.
    map: Option<Affine>,
}

impl Round {
    fn mesh(&self) -> Mesh {
        match self.kind {
            "disk" => texcoords::disk(procedural::disk(self.resolution)),
            "cylinder" => texcoords::cylinder(procedural::cylinder(self.resolution)),
            _ => texcoords::sphere(procedural::uv_sphere(self.resolution)),
        }
    }

    fn model(&self, e: &Element) -> Result<Model, CliError> {
        let Some(map) = &self.map else { return Ok(Model::faceted(self.mesh())) };
        let mesh = self.mesh().transform(map);
        mesh.validate().map_err(|err| e.error(err))?;
        Ok(Model { mesh, turns: true, smooth: false })
    }
}

/// What a sphere, disk or cylinder is made of; `None` for other shapes.
fn round(p: &Properties<'_>) -> Result<Option<Round>, CliError> {
    let resolution =
        |range, default| Ok::<u32, CliError>(p.integer_in("resolution", range)?.unwrap_or(default));
    Ok(Some(match p.kind()? {
        "disk" => {
            let resolution = resolution(3..=1 << 20, DISK_RESOLUTION)?;
            Round { kind: "disk", resolution, map: None }
        }
        "sphere" => {
            let resolution = resolution(2..=1024, SPHERE_RESOLUTION)?;
            Round { kind: "sphere", resolution, map: Some(sphere(p)?) }
        }
        "cylinder" => {
            let resolution = resolution(3..=1 << 20, CYLINDER_RESOLUTION)?;
            Round { kind: "cylinder", resolution, map: Some(cylinder(p)?) }
        }
        _ => return Ok(None),
    }))
}

/// From the unit sphere.
fn sphere(p: &Properties<'_>) -> Result<Affine, CliError> {
    let center = p.vector("center")?.unwrap_or(Vec3::ZERO);
    Ok(Affine { linear: Mat3::IDENTITY * radius(p)?, translation: center })
}

fn radius(p: &Properties<'_>) -> Result<f64, CliError> {
    let radius = p.float("radius")?.unwrap_or(1.0);
    if radius <= 0.0 {
        return Err(p.element.error(format!("`radius` is {radius}; it must be positive")));
    }
    Ok(radius)
}

/// From the unit cylinder to the one from `p0` to `p1` about the line between them, without its ends.
fn cylinder(p: &Properties<'_>) -> Result<Affine, CliError> {
    let (from, to) = (p.vector("p0")?.unwrap_or(Vec3::ZERO), p.vector("p1")?.unwrap_or(Vec3::Z));
    let radius = radius(p)?;
    let axis = to - from;
    if axis.max_abs() == 0.0 {
        return Err(p.element.error("`p0` and `p1` are the same point"));
    }
    let frame = Frame::from_normal(axis.normalize());
    let columns = [frame.s * radius, frame.t * radius, axis];
    let row = |axis: Vec3| {
        let [a, b, c] = columns.map(|column| column.dot(axis));
        drt_math::vec3(a, b, c)
    };
    let linear = Mat3::from_rows(row(Vec3::X), row(Vec3::Y), row(Vec3::Z));
    Ok(Affine { linear, translation: from })
}

/// The model in the world.
fn place(p: &Properties<'_>, model: Model) -> Result<Mesh, CliError> {
    let to_world = p.transform("to_world")?.unwrap_or(Affine::IDENTITY);
    let determinant = to_world.linear.determinant();
    if determinant == 0.0 && model.mesh.normals.is_some() {
        let message = "`to_world` flattens a shape with shading normals";
        return Err(p.element.error(message));
    }
    let mut mesh = model.mesh.transform(&to_world);
    mesh.validate().map_err(|err| p.element.error(err))?;
    let mirrored_inside_out = determinant < 0.0 && model.turns;
    if mirrored_inside_out != p.boolean("flip_normals")?.unwrap_or(false) {
        mesh.flip();
    }
    if model.smooth { mesh_file::smooth(p.element, mesh) } else { Ok(mesh) }
}
