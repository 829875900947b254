//! Mitsuba XML, versions 3 and 0.5–0.6, to [`Scene`]s.
//!
//! A file becomes one tree of elements in one spelling ([`source`], [`element`], [`dialect`]), the
//! tree an [`index`] of ids and order, and each element a thing of the scene. Properties are taken
//! out of an element one by one; what is left over is an error with its line ([`properties`]).

mod bsdfs;
mod dialect;
mod element;
mod emitters;
mod files;
mod index;
mod media;
mod notes;
mod numbers;
mod parts;
mod properties;
mod sensors;
mod shapes;
mod source;
mod spectrum;
#[cfg(test)]
mod tests;
mod textured;
mod textures;
mod transform;
mod values;
mod volume_lights;
mod volumes;

use std::cell::RefCell;
use std::collections::{BTreeMap, HashSet};
use std::path::{Path, PathBuf};
use std::sync::Arc;

use drt_estimators::surface::{Bsdf, Diffuse, Mask, Measured};
use drt_estimators::{Instance, Named, Scene};
use drt_math::Rgb;

use crate::CliError;
use crate::error::{Place, Warning};
use crate::files::input_file::{read_text, text_of};
use element::Element;
use index::Index;
use properties::Properties;
use shapes::SharedMeshes;
pub use source::Defaults;
use source::SceneFiles;

/// Reads a scene file; `defaults` override its `<default>` values.
///
/// ```
/// use drt_cli::{Defaults, read_scene};
///
/// # let folder = tempfile::tempdir()?;
/// # let path = folder.path().join("scene.xml");
/// std::fs::write(
///     &path,
///     r#"<scene version="3.0.0">
///          <default name="size" value="64"/>
///          <sensor type="perspective">
///            <film type="hdrfilm">
///              <integer name="width" value="$size"/>
///              <integer name="height" value="48"/>
///            </film>
///          </sensor>
///        </scene>"#,
/// )?;
/// let scene = read_scene(&path, &Defaults::from([("size".into(), "32".into())]))?;
/// assert_eq!(scene.sensors[0].item.sensor.film(), [32, 48]);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
///
/// # Errors
/// Names the file, line and element of what is malformed, missing or not supported.
pub fn read_scene(path: &Path, defaults: &Defaults) -> Result<Scene, CliError> {
    SceneReader::default().read(path, defaults).map(|(scene, ..)| scene)
}

/// Reads scenes, and remembers the last one: jobs of one scene in a row read its files once.
#[derive(Default)]
pub(crate) struct SceneReader {
    last: Option<(PathBuf, Defaults, Read)>,
}

/// A scene, what in it was passed over, and the files that it was read from.
pub(crate) type Read = (Scene, Vec<Warning>, Vec<PathBuf>);

impl SceneReader {
    /// As [`read_scene`], with what was passed over.
    pub(crate) fn read(&mut self, path: &Path, defaults: &Defaults) -> Result<Read, CliError> {
        if let Some((_, _, read)) =
            self.last.as_ref().filter(|(p, d, _)| p == path && d == defaults)
        {
            return Ok(read.clone());
        }
        // The old one is not kept beside the new one.
        self.last = None;
        let read = parse_scene(path, &read_text(path, None)?, defaults)?;
        self.last = Some((path.into(), defaults.clone(), read.clone()));
        Ok(read)
    }
}

/// Reads a scene from the bytes of its text, as [`read_scene`] does from a file. Relative file names start from the folder of
/// `path`, by which messages call the text; such a file need not exist.
///
/// ```
/// use std::path::Path;
///
/// use drt_cli::{Defaults, decode_scene};
///
/// let xml = br#"<scene version="3.0.0"><emitter type="constant" id="sky"/></scene>"#;
/// let scene = decode_scene(xml, Path::new("sky.xml"), &Defaults::new())?;
/// assert_eq!(scene.emitters.len(), 1);
/// # Ok::<(), drt_cli::CliError>(())
/// ```
///
/// # Errors
/// As [`read_scene`].
pub fn decode_scene(bytes: &[u8], path: &Path, defaults: &Defaults) -> Result<Scene, CliError> {
    decode(bytes, path, defaults).map(|(scene, ..)| scene)
}

/// Reads a scene as [`decode_scene`] does, with what was passed over and the files that were read.
pub(crate) fn decode(bytes: &[u8], path: &Path, defaults: &Defaults) -> Result<Read, CliError> {
    parse_scene(path, text_of(bytes, path)?, defaults)
}

fn parse_scene(path: &Path, text: &str, defaults: &Defaults) -> Result<Read, CliError> {
    let (root, included) = SceneFiles::new(defaults).read(path, text)?;
    at_rest(&root)?;
    let index = Index::new(&root)?;
    missing_files(path, &root, &index)?;
    let loader = Loader { index, measured: RefCell::default(), referred: RefCell::default() };
    let scene = loader.scene(&root)?;
    Ok((scene, root.notes().take(), files::of_scene(path, included, &root)))
}

/// Refuses a scene several of whose files are missing, naming all of them; of a single one its reader tells. What is not used is
/// left out.
fn missing_files(path: &Path, root: &Element, index: &Index<'_>) -> Result<(), CliError> {
    fn visit(e: &Element, found: &mut Vec<String>) {
        found.extend(e.file().and_then(Result::err).map(|error| error.to_string()));
        e.children.iter().for_each(|child| visit(child, found));
    }
    let mut found = Vec::new();
    root.children.iter().filter(|e| index.is_used(e)).for_each(|e| visit(e, &mut found));
    if found.len() < 2 {
        return Ok(());
    }
    let message = format!("{} files are missing:\n  {}", found.len(), found.join("\n  "));
    Err(CliError::input(&Place::file(path), message))
}

/// Refuses what moves while the shutter is open.
fn at_rest(e: &Element) -> Result<(), CliError> {
    if e.tag == "animation" {
        return Err(e.error(
            "motion blur is not supported, here as in Mitsuba 3.9; give a <transform name=\"to_world\"> of one time",
        ));
    }
    e.children.iter().try_for_each(at_rest)
}

/// Turns elements into things of the scene.
struct Loader<'a> {
    index: Index<'a>,
    /// Materials of files, which all that name them share.
    measured: RefCell<BTreeMap<PathBuf, Arc<Measured>>>,
    /// BSDFs inside others that something refers to: by the ordinals of their elements, their numbers among the scene's.
    referred: RefCell<BTreeMap<usize, usize>>,
}

impl<'a> Loader<'a> {
    /// What was read, or a stand-in for what is not used and cannot be read, as Mitsuba builds nothing of that.
    fn unless_unused<T>(
        &self,
        e: &Element,
        read: Result<T, CliError>,
        stand_in: impl FnOnce() -> Result<T, CliError>,
    ) -> Result<T, CliError> {
        read.or_else(|error| {
            if self.index.is_used(e) {
                return Err(error);
            }
            e.note(format!("is not used, and could not be ({error})"));
            stand_in()
        })
    }

    fn scene(&self, root: &'a Element) -> Result<Scene, CliError> {
        let mut scene = Scene::default();
        for e in self.index.all("medium") {
            let id = || e.id().map(Into::into);
            let vacuum = || Ok(Named { id: id(), item: media::vacuum(e)? });
            scene.media.push(self.unless_unused(e, self.medium(e), vacuum)?);
        }
        for e in self.index.all("bsdf") {
            let item = self.unless_unused(e, self.bsdf(e), || Ok(Bsdf::Null))?;
            scene.bsdfs.push(Named { id: e.id().map(Into::into), item });
        }
        self.referred_bsdfs(&mut scene.bsdfs)?;
        let declared = scene.bsdfs.len();
        let shapes = self.index.all("shape");
        let carried = self.carried_emitters(shapes)?;
        self.light_media(shapes, &carried, &mut scene.media)?;
        for e in self.emitters() {
            scene.emitters.push(self.emitter(e, carried.contains(&e.ordinal))?);
        }
        let groups = self.groups(shapes, &mut scene.bsdfs, declared)?;
        let alone: Vec<&Element> = shapes.iter().copied().filter(|e| !groups.have(e)).collect();
        let shared = SharedMeshes::of(&alone);
        for e in alone {
            match e.attribute("type") {
                Some("instance") => self.instance(e, &groups, &mut scene)?,
                // The shapes in it are among all shapes.
                Some("merge") => self.merged(e)?,
                _ => {
                    let shape = self.shape(e, &mut scene.bsdfs, declared, &shared)?;
                    let Some((shape, to_world)) = shape else { continue };
                    if let Some(to_world) = to_world {
                        scene.instances.push(Instance { shape: scene.shapes.len(), to_world });
                    }
                    scene.shapes.push(shape);
                }
            }
        }
        for e in self.index.all("sensor") {
            scene.sensors.push(self.sensor(e)?);
        }
        self.top_level(root, &mut scene)?;
        if scene.integrator.straight_depth {
            count_null_interfaces(&mut scene);
        }
        Ok(scene)
    }

    /// The emitters on shapes, nested there or referred to, by ordinal.
    fn carried_emitters(&self, shapes: &[&'a Element]) -> Result<HashSet<usize>, CliError> {
        let mut carried = HashSet::new();
        for shape in shapes {
            for emitter in self.index.inner(&Properties::of(shape)?, "emitter", None) {
                if !carried.insert(emitter.target.ordinal) {
                    let message = "an emitter can only be on one shape, and this one is on another";
                    return Err(emitter.child.error(message));
                }
            }
        }
        Ok(carried)
    }

    /// Everything else that stands directly in the scene.
    fn top_level(&self, root: &'a Element, scene: &mut Scene) -> Result<(), CliError> {
        let mut integrators = 0;
        for e in &root.children {
            match e.tag.as_str() {
                "shape" | "bsdf" | "medium" | "emitter" | "sensor" | "alias" => {}
                // Read for their own sake, so that mistakes in unused ones are found too.
                "phase" => self.unless_unused(e, self.phase(e).map(drop), || Ok(()))?,
                "volume" => {
                    self.unless_unused(e, volumes::read(e, volumes::Values::Any).map(drop), || {
                        Ok(())
                    })?
                }
                "texture" if e.id().is_some() && properties::varies(e) => {
                    self.unless_unused(e, textures::read(e).map(drop), || Ok(()))?;
                }
                "texture" | "spectrum" | "rgb" | "srgb" if e.id().is_some() => {
                    self.unless_unused(e, spectrum::reflected(e).map(drop), || Ok(()))?;
                }
                "rfilter" => drop(sensors::filter(e)?),
                // Read where they are referred to.
                "film" | "sampler" if e.id().is_some() => {}
                "integrator" => {
                    integrators += 1;
                    if integrators > 1 {
                        return Err(e.error("a scene has only one integrator"));
                    }
                    scene.integrator = sensors::integrator(e)?;
                }
                _ => return Err(e.error("not supported directly inside <scene>")),
            }
        }
        Ok(())
    }
}

/// The material of a shape without one: gray, or black where the shape is a light, as in Mitsuba; in files of version 0.5 and 0.6
/// nothing where it bounds a medium.
fn material_of_none(glows: bool, legacy_boundary: bool) -> Bsdf {
    match (glows, legacy_boundary) {
        (true, _) => Bsdf::Diffuse(Diffuse { reflectance: Rgb::ZERO }),
        (false, true) => Bsdf::Null,
        (false, false) => Bsdf::Diffuse(Diffuse::default()),
    }
}

/// The number of a material that no element is of. It is added after all others, so that their order in the file stays.
fn added_bsdf(bsdfs: &mut Vec<Named<Bsdf>>, declared: usize, wanted: Bsdf) -> usize {
    let added = bsdfs[declared..].iter().position(|b| b.item == wanted);
    added.map_or_else(
        || {
            bsdfs.push(Named::anonymous(wanted));
            bsdfs.len() - 1
        },
        |i| declared + i,
    )
}

/// Makes null interfaces what they are to integrators that know nothing of media: masks with nothing behind them, which add to the depth and
/// block the light of points. Those around media stay, as scenes with media mean these.
fn count_null_interfaces(scene: &mut Scene) {
    let Scene { bsdfs, shapes, .. } = scene;
    let count = bsdfs.len();
    for shape in shapes.iter_mut().filter(|s| s.boundary.is_none()) {
        if shape.bsdf < count && bsdfs[shape.bsdf].item.is_null() {
            if bsdfs.len() == count {
                let bsdf = Bsdf::Diffuse(Diffuse::default());
                bsdfs.push(Named::anonymous(Bsdf::Mask(Box::new(Mask { bsdf, opacity: 0.0 }))));
            }
            shape.bsdf = count;
        }
    }
}
