//! Sensors with their film, filter and sampler, and the integrator.

use drt_estimators::filter::{Filter, FilterKind};
use drt_estimators::sensor::{Aperture, FovAxis, Lens, Sensor, SensorError};
use drt_estimators::{Integrator, Named, SceneSensor};
use drt_math::Affine;

use super::Loader;
use super::element::Element;
use super::properties::Properties;
use crate::CliError;

/// Widest and highest film, in pixels.
const MAX_FILM: i64 = 65_536;

impl<'a> Loader<'a> {
    pub(super) fn sensor(&self, e: &'a Element) -> Result<Named<SceneSensor>, CliError> {
        let p = Properties::of(e)?;
        let kind = p.kind()?;
        let parallel = match kind {
            "perspective" | "thinlens" => false,
            "orthographic" => true,
            _ => {
                return Err(e.error(format!(
                    "the sensor type `{kind}` is not supported; expected perspective, thinlens or orthographic"
                )));
            }
        };
        let (film, filter) = self.film(&p)?;
        let lens = if parallel { clipped(&p, Lens::default())? } else { lens(&p, kind)? };
        let aperture = if kind == "thinlens" { aperture(&p, &lens)? } else { None };
        let to_world = p.transform("to_world")?.unwrap_or(Affine::IDENTITY);
        let medium = self.surrounding(&p)?;
        let sample_count = self.sampler(&p)?;
        // A camera without aperture in a scene at rest has neither focus nor shutter.
        p.accept(&["focus_distance", "shutter_open", "shutter_close"]);
        p.finish()?;
        let place = if parallel { Sensor::orthographic } else { Sensor::from_to_world };
        let sensor = || -> Result<Sensor, SensorError> {
            let mut sensor = place(&to_world, lens, film.size, filter)?;
            if let Some([offset, size]) = film.crop {
                sensor = sensor.cropped(offset, size)?;
            }
            match aperture {
                Some(aperture) => sensor.with_aperture(aperture),
                None => Ok(sensor),
            }
        };
        let sensor = sensor().map_err(|err| e.error(err))?;
        let item = SceneSensor { sensor, medium, sample_count };
        Ok(Named { id: e.id().map(Into::into), item })
    }

    fn film(&self, sensor: &Properties<'a>) -> Result<(Film, Filter), CliError> {
        let default = [768, 576];
        let Some(film) = self.index.single(sensor, "film", None)? else {
            return Ok((Film { size: default, crop: None }, default_filter(sensor)?));
        };
        let p = Properties::of(film.target)?;
        let kind = p.kind()?;
        // What sets it apart is how pixels are stored.
        let stored_as_bytes = kind == "ldrfilm" && film.target.is_legacy();
        if kind != "hdrfilm" && !stored_as_bytes {
            let message = format!("the film type `{kind}` is not supported; expected hdrfilm");
            return Err(film.child.error(message));
        }
        let width = p.integer_in("width", 1..=MAX_FILM)?.unwrap_or(default[0]);
        let height = p.integer_in("height", 1..=MAX_FILM)?.unwrap_or(default[1]);
        Sensor::check_film([width, height]).map_err(|err| film.target.error(err))?;
        let filter = match self.index.single(&p, "rfilter", None)? {
            Some(f) => filter(f.target)?,
            None => default_filter(&p)?,
        };
        let crop = crop(&p, [width, height])?;
        // How Mitsuba stores the image; none of it changes expected values.
        p.accept(&["file_format", "pixel_format", "component_format", "sample_border"]);
        p.accept(&["compensate", "high_quality_edges", "banner", "attach_log"]);
        p.finish()?;
        Ok((Film { size: [width, height], crop }, filter))
    }

    fn sampler(&self, sensor: &Properties<'a>) -> Result<Option<u32>, CliError> {
        let Some(sampler) = self.index.single(sensor, "sampler", None)? else { return Ok(None) };
        let p = Properties::of(sampler.target)?;
        p.kind()?;
        let count = p.integer_in("sample_count", 1..=i64::from(u32::MAX))?;
        p.accept_rest();
        Ok(count)
    }
}

/// Width and height of a film, and the part of it that is wanted.
struct Film {
    size: [u32; 2],
    /// Column and row of its top left pixel, and its size.
    crop: Option<[[u32; 2]; 2]>,
}

/// A crop window, which reaches to the film's end where its size is not given.
fn crop(p: &Properties<'_>, film: [u32; 2]) -> Result<Option<[[u32; 2]; 2]>, CliError> {
    let number = |name, least| p.integer_in(name, least..=MAX_FILM);
    let offset = [number("crop_offset_x", 0)?, number("crop_offset_y", 0)?];
    let size = [number("crop_width", 1)?, number("crop_height", 1)?];
    if offset.iter().chain(&size).all(Option::is_none) {
        return Ok(None);
    }
    let offset: [u32; 2] = offset.map(Option::unwrap_or_default);
    let rest = |k: usize| film[k].saturating_sub(offset[k]);
    Ok(Some([offset, [size[0].unwrap_or(rest(0)), size[1].unwrap_or(rest(1))]]))
}

/// The lens of a `thinlens`; one without radius is a pinhole.
fn aperture(p: &Properties<'_>, lens: &Lens) -> Result<Option<Aperture>, CliError> {
    let radius = p.float("aperture_radius")?;
    let radius = radius.ok_or_else(|| p.element.error("`aperture_radius` is missing"))?;
    let focus_distance = p.float("focus_distance")?.unwrap_or(lens.far);
    Ok((radius != 0.0).then_some(Aperture { radius, focus_distance }))
}

/// A field of view, given as such or by a focal length.
pub(super) fn view(p: &Properties<'_>) -> Result<Lens, CliError> {
    match (p.float("fov")?, p.string("focal_length")?) {
        (Some(_), Some(_)) => Err(p.element.error("give `fov` or `focal_length`, not both")),
        (Some(fov), None) => Ok(Lens { fov_axis: fov_axis(p)?, ..Lens::with_fov(fov) }),
        // A focal length is about the diagonal of the film, so `fov_axis` is not asked for.
        (None, Some(text)) => Ok(Lens { fov: focal_length(p, text)?, ..Lens::default() }),
        (None, None) => Ok(Lens::default()),
    }
}

fn lens(p: &Properties<'_>, kind: &str) -> Result<Lens, CliError> {
    let mut lens = view(p)?;
    let offset = |name| Ok::<f64, CliError>(p.float(name)?.unwrap_or(0.0));
    if kind == "perspective" {
        lens.principal_point_offset =
            [offset("principal_point_offset_x")?, offset("principal_point_offset_y")?];
    }
    clipped(p, lens)
}

fn clipped(p: &Properties<'_>, lens: Lens) -> Result<Lens, CliError> {
    let near = p.float("near_clip")?.unwrap_or(lens.near);
    let far = p.float("far_clip")?.unwrap_or(lens.far);
    Ok(Lens { near, far, ..lens })
}

fn fov_axis(p: &Properties<'_>) -> Result<FovAxis, CliError> {
    let choices = [
        ("x", FovAxis::X),
        ("y", FovAxis::Y),
        ("diagonal", FovAxis::Diagonal),
        ("smaller", FovAxis::Smaller),
        ("larger", FovAxis::Larger),
    ];
    Ok(p.choice("fov_axis", &choices)?.unwrap_or(FovAxis::X))
}

/// The diagonal field of view of a focal length such as `50mm`.
fn focal_length(p: &Properties<'_>, text: &str) -> Result<f64, CliError> {
    let number = text.strip_suffix("mm").unwrap_or(text).trim();
    match number.parse::<f64>() {
        Ok(v) if v > 0.0 && v.is_finite() => Ok(Lens::fov_of_focal_length(v)),
        _ => Err(p.element.error(format!("`focal_length` is `{text}`; expected one like `50mm`"))),
    }
}

fn default_filter(p: &Properties<'_>) -> Result<Filter, CliError> {
    Filter::new(FilterKind::default()).map_err(|err| p.element.error(err))
}

pub(super) fn filter(e: &Element) -> Result<Filter, CliError> {
    let p = Properties::of(e)?;
    let kind = match p.kind()? {
        "box" => FilterKind::BOX,
        "tent" => FilterKind::Tent { radius: p.float("radius")?.unwrap_or(1.0) },
        "gaussian" => FilterKind::gaussian(p.float("stddev")?.unwrap_or(0.5)),
        "mitchell" => {
            let parameter = |name| Ok::<_, CliError>(p.float(name)?.unwrap_or(1.0 / 3.0));
            FilterKind::Mitchell { b: parameter("B")?, c: parameter("C")? }
        }
        "catmullrom" => FilterKind::CATMULL_ROM,
        "lanczos" => FilterKind::Lanczos { lobes: p.integer_in("lobes", 1..=256)?.unwrap_or(3) },
        other => {
            return Err(e.error(format!(
                "the filter type `{other}` is not supported; expected box, tent, gaussian, mitchell, catmullrom or lanczos"
            )));
        }
    };
    p.finish()?;
    Filter::new(kind).map_err(|err| e.error(err))
}

/// Integrators whose expected image is that of all paths up to a depth.
const PATHS: [&str; 16] = [
    "path",
    "volpath",
    "volpathmis",
    "volpath_simple",
    "bdpt",
    "ptracer",
    "prb",
    "prb_basic",
    "prbvolpath",
    "prb_projective",
    "pssmlt",
    "mlt",
    "erpt",
    "prb_threepoint",
    "pathAD",
    "volpathAD",
];
/// Integrators of paths with one scattering at most.
const DIRECT: [&str; 3] = ["direct", "direct_projective", "direct_reparam"];
/// Integrators whose image is not that of light on paths.
const OTHERS: [&str; 10] = [
    "depth",
    "stokes",
    "ao",
    "field",
    "velocity",
    "multichannel",
    "singlescatter",
    "vpl",
    "dipole",
    "albedo",
];
/// Those that go through null interfaces, masks and panes at no depth.
const STRAIGHT: [&str; 5] = ["volpath", "volpathmis", "volpath_simple", "prbvolpath", "volpathAD"];
/// Integrators that say more about the image of another one, inside them.
const AROUND: [&str; 2] = ["moment", "aov"];

/// Path depths of an integrator; which method it names does not matter.
pub(super) fn integrator(e: &Element) -> Result<Integrator, CliError> {
    let p = Properties::of(e)?;
    let kind = p.kind()?;
    if AROUND.contains(&kind) {
        let inner = p.children(|child| child.tag == "integrator");
        p.accept(&["aovs"]);
        p.finish()?;
        return match inner[..] {
            [inner] => integrator(inner),
            _ => Err(e.error(format!("expected one integrator inside, found {}", inner.len()))),
        };
    }
    let direct = DIRECT.contains(&kind);
    if OTHERS.contains(&kind) {
        let message = format!(
            "the integrator type `{kind}` is not supported; expected one that traces paths ({}), one \
             for direct light ({}), or {} around one of them",
            PATHS.join(", "),
            DIRECT.join(", "),
            AROUND.join(" or ")
        );
        return Err(e.error(message));
    }
    let mut integrator = Integrator::default();
    if direct {
        integrator.max_depth = Some(2);
        p.accept(&["shading_samples", "emitter_samples", "bsdf_samples"]);
    } else if let Some(depth) = p.integer_in::<i64>("max_depth", -1..=i64::from(u32::MAX))? {
        integrator.max_depth = u32::try_from(depth).ok();
    }
    if let Some(depth) = p.integer_in("rr_depth", 1..=i64::from(u32::MAX))? {
        integrator.rr_depth = depth;
    }
    let known = direct || PATHS.contains(&kind);
    if !known {
        e.note(format!("the integrator type `{kind}` is not known; taken for `volpath`, whose image is that of all paths"));
        p.accept_rest();
    }
    integrator.straight_depth = known && !STRAIGHT.contains(&kind);
    integrator.hide_emitters = p.boolean("hide_emitters")?.unwrap_or(false);
    if p.boolean("strict_normals")? == Some(true) {
        let message = "`strict_normals` = true is not supported: light on the wrong side of a triangle is not cut off";
        if !e.is_legacy() {
            return Err(e.error(message));
        }
        e.note(message);
    }
    // How the work is cut up.
    p.accept(&["samples_per_pass", "block_size", "timeout"]);
    p.finish()?;
    Ok(integrator)
}
