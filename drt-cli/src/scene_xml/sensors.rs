//! Sensors with their film, filter and sampler, and the integrator.

use drt_estimators::filter::{Filter, FilterKind};
use drt_estimators::sensor::{FovAxis, Lens, Sensor};
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
            "perspective" => false,
            "orthographic" => true,
            _ => {
                return Err(e.error(format!(
                    "the sensor type `{kind}` is not supported; expected perspective or orthographic"
                )));
            }
        };
        let (film, filter) = self.film(&p)?;
        let lens = if parallel { clipped(&p, Lens::default())? } else { lens(&p)? };
        let to_world = p.transform("to_world")?.unwrap_or(Affine::IDENTITY);
        let medium = self.surrounding(&p)?;
        let sample_count = self.sampler(&p)?;
        // A camera without aperture in a scene at rest has neither focus nor shutter.
        p.accept(&["focus_distance", "shutter_open", "shutter_close"]);
        p.finish()?;
        let place = if parallel { Sensor::orthographic } else { Sensor::from_to_world };
        let sensor = place(&to_world, lens, film, filter);
        let sensor = sensor.map_err(|err| e.error(err))?;
        let item = SceneSensor { sensor, medium, sample_count };
        Ok(Named { id: e.id().map(Into::into), item })
    }

    fn film(&self, sensor: &Properties<'a>) -> Result<([u32; 2], Filter), CliError> {
        let default = [768, 576];
        let Some(film) = self.index.single(sensor, "film", None)? else {
            return Ok((default, default_filter(sensor)?));
        };
        let p = Properties::of(film.target)?;
        let kind = p.kind()?;
        if kind != "hdrfilm" {
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
        // How Mitsuba stores the image; none of it changes expected values.
        p.accept(&["file_format", "pixel_format", "component_format", "sample_border"]);
        p.accept(&["compensate", "high_quality_edges", "banner", "attach_log"]);
        p.finish()?;
        Ok(([width, height], filter))
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

fn lens(p: &Properties<'_>) -> Result<Lens, CliError> {
    let mut lens = match (p.float("fov")?, p.string("focal_length")?) {
        (Some(_), Some(_)) => {
            return Err(p.element.error("give `fov` or `focal_length`, not both"));
        }
        (Some(fov), None) => Lens { fov_axis: fov_axis(p)?, ..Lens::with_fov(fov) },
        // A focal length is about the diagonal of the film, so `fov_axis` is not asked for.
        (None, Some(text)) => Lens { fov: focal_length(p, text)?, ..Lens::default() },
        (None, None) => Lens::default(),
    };
    let offset = |name| Ok::<f64, CliError>(p.float(name)?.unwrap_or(0.0));
    lens.principal_point_offset =
        [offset("principal_point_offset_x")?, offset("principal_point_offset_y")?];
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
        other => {
            return Err(e.error(format!(
                "the filter type `{other}` is not supported; expected box, tent or gaussian"
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
    if !direct && !PATHS.contains(&kind) {
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
    for name in ["hide_emitters", "strict_normals"] {
        if p.boolean(name)? == Some(true) {
            return Err(e.error(format!("`{name}` = true is not supported")));
        }
    }
    // How the work is cut up.
    p.accept(&["samples_per_pass", "block_size", "timeout"]);
    p.finish()?;
    Ok(integrator)
}
