//! Shapes: meshes from files and tessellated primitives, with what they are made of.

mod instances;
mod mesh_file;
mod serialized;
mod texcoords;

use std::sync::Arc;

use drt_estimators::surface::Bsdf;
use drt_estimators::{MediumBoundary, Named, Shape};
use drt_geom::{Mesh, procedural};
use drt_math::{Affine, Frame, Mat3, Vec3};

use super::element::Element;
use super::properties::Properties;
use super::{Loader, default_bsdf, volume_lights};
use crate::CliError;

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

impl<'a> Loader<'a> {
    /// One shape; a default material is added to `bsdfs` where it has none.
    pub(super) fn shape(
        &self,
        e: &'a Element,
        bsdfs: &mut Vec<Named<Bsdf>>,
    ) -> Result<Shape, CliError> {
        let p = Properties::of(e)?;
        let mesh = self.without_degenerate(e, place(&p, model(&p)?)?)?;
        let emitter = self.index.single(&p, "emitter", None)?;
        // A medium's light is no light of the shape.
        let emitter = emitter.filter(|inner| !volume_lights::is_one(inner.target));
        let bsdf = match self.index.single(&p, "bsdf", None)? {
            Some(bsdf) => self.counted(bsdf.child, bsdf.target)?,
            None => default_bsdf(bsdfs, self.index.all("bsdf").len(), emitter.is_some()),
        };
        let boundary = self.boundary(&p)?;
        p.finish()?;
        let emitter = emitter
            .and_then(|inner| self.emitters().position(|e| e.ordinal == inner.target.ordinal));
        Ok(Shape { id: e.id().map(Into::into), mesh: Arc::new(mesh), bsdf, boundary, emitter })
    }

    /// The mesh without triangles that cannot be seen or are there twice.
    fn without_degenerate(&self, e: &Element, mesh: Mesh) -> Result<Mesh, CliError> {
        let (clean, dropped) = mesh.drop_degenerate();
        if clean.triangles.is_empty() {
            return Err(e.error("no triangle of this shape has an area"));
        }
        if dropped > 0 {
            let all = mesh.triangles.len();
            let message = format!("dropped {dropped} of {all} triangles: no area, or there before");
            self.warn(e, message);
        }
        Ok(clean)
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
        "disk" => {
            let corners = p.integer_in("resolution", 3..=1 << 20)?.unwrap_or(DISK_RESOLUTION);
            Model::faceted(texcoords::disk(procedural::disk(corners)))
        }
        "sphere" => sphere(p)?,
        "cylinder" => cylinder(p)?,
        other => {
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

fn sphere(p: &Properties<'_>) -> Result<Model, CliError> {
    let bands = p.integer_in("resolution", 2..=1024)?.unwrap_or(SPHERE_RESOLUTION);
    let center = p.vector("center")?.unwrap_or(Vec3::ZERO);
    let radius = p.float("radius")?.unwrap_or(1.0);
    if radius <= 0.0 {
        return Err(p.element.error(format!("`radius` is {radius}; it must be positive")));
    }
    let map = Affine { linear: Mat3::IDENTITY * radius, translation: center };
    let mesh = texcoords::sphere(procedural::uv_sphere(bands)).transform(&map);
    Ok(Model { mesh, turns: true, smooth: false })
}

/// From `p0` to `p1` about the line between them, without its ends.
fn cylinder(p: &Properties<'_>) -> Result<Model, CliError> {
    let sides = p.integer_in("resolution", 3..=1 << 20)?.unwrap_or(CYLINDER_RESOLUTION);
    let (from, to) = (p.vector("p0")?.unwrap_or(Vec3::ZERO), p.vector("p1")?.unwrap_or(Vec3::Z));
    let radius = p.float("radius")?.unwrap_or(1.0);
    if radius <= 0.0 {
        return Err(p.element.error(format!("`radius` is {radius}; it must be positive")));
    }
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
    let mesh = texcoords::cylinder(procedural::cylinder(sides));
    let mesh = mesh.transform(&Affine { linear, translation: from });
    mesh.validate().map_err(|err| p.element.error(err))?;
    Ok(Model { mesh, turns: true, smooth: false })
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
