//! `drt info`: what is in a scene or job, and what a run would do.

use std::collections::HashMap;
use std::fmt;
use std::path::Path;
use std::sync::Arc;

use drt_estimators::emitter::Emitter;
use drt_estimators::filter::FilterKind;
use drt_estimators::texture::Texture;
use drt_estimators::{Integrator, MediumBoundary, Plan, Scene, Shape, Surrounding};
use drt_geom::{EdgeClass, Mesh, Topology};
use drt_math::Vec3;
use drt_medium::{Medium, MediumKind, Phase, Volume};
use drt_motion::{Change, Parameter};
use serde_json::json;

use super::console;
use super::destinations::Destinations;
use super::options::{InfoOptions, Options};
use super::table::Table;
use super::{Outcome, run};
use crate::error::Place;
use crate::files::digest::{plan_json, write_digest};
use crate::{CliError, Job, PROGRAM};

pub(super) fn run(options: &InfoOptions) -> Result<Outcome, CliError> {
    let InfoOptions { input, digest, spp, sampling, changes } = options;
    let own = Options::of(input.clone());
    let own = Options { spp: *spp, sampling: *sampling, changes: changes.clone(), ..own };
    let job = run::open(&own)?;
    let contents = Contents::new(&job);
    let destinations = Destinations::new([("--digest", digest.as_deref())]);
    destinations.spare(job.inputs())?;
    destinations.check()?;
    let text_is_asked_for = digest.as_deref() != Some(Path::new("-"));
    if text_is_asked_for {
        console::print(contents.to_string())?;
    }
    // The plan comes last: preparing it can fail for reasons that the tables help to find.
    let plan = plan(&job)?;
    if text_is_asked_for {
        console::print(match &plan {
            Ok(plan) => format!("plan\n{plan}"),
            Err(why) => format!("no plan: {why}\n"),
        })?;
    }
    if let Some(path) = digest {
        let text = contents.json(&job, plan.as_ref())?;
        if text_is_asked_for {
            write_digest(path, &text)?;
        } else {
            console::print(format!("{text}\n"))?;
        }
    }
    Ok(Outcome::Done)
}

/// What a run would do, or why there is none.
fn plan(job: &Job) -> Result<Result<Plan, String>, CliError> {
    if job.scene.sensors.is_empty() {
        return Ok(Err("the scene has no <sensor>".into()));
    }
    if let Err(e) = job.require_derivatives() {
        return Ok(Err(e.to_string()));
    }
    let session = run::prepare(job, &job.parameters, &mut run::Shared::default())?;
    Ok(Ok(session.plan().clone()))
}

/// What a scene or job holds.
struct Contents {
    scene: String,
    job: Option<String>,
    depth: Option<u32>,
    rr_depth: u32,
    hides_emitters: bool,
    shapes: Table<8>,
    media: Table<4>,
    emitters: Table<3>,
    textures: Table<4>,
    sensors: Table<6>,
    parameters: Table<4>,
}

impl Contents {
    fn new(job: &Job) -> Self {
        let scene = &job.scene;
        let Integrator { max_depth, rr_depth, hide_emitters, .. } = scene.integrator;
        Self {
            scene: job.scene_path.display().to_string(),
            job: job.text.is_some().then(|| job.path.display().to_string()),
            depth: job.settings.max_depth.within(max_depth),
            rr_depth,
            hides_emitters: hide_emitters,
            shapes: shapes(scene),
            media: media(scene),
            emitters: emitters(scene),
            textures: textures(scene),
            sensors: sensors(job),
            parameters: parameters(&job.parameters),
        }
    }

    /// Gives programs the contents as JSON, with tables as lists of objects.
    fn json(&self, job: &Job, plan: Result<&Plan, &String>) -> Result<String, CliError> {
        let place = Place::file(&job.path);
        let plan = plan.map_err(Clone::clone).map(plan_json);
        let (plan, no_plan) = (plan.as_ref().ok(), plan.as_ref().err());
        let all = json!({
            "program": PROGRAM,
            "command": "info",
            "scene": self.scene,
            "job": self.job,
            "depth": self.depth,
            "rr_depth": self.rr_depth,
            "hide_emitters": self.hides_emitters,
            "shapes": self.shapes.json(),
            "media": self.media.json(),
            "emitters": self.emitters.json(),
            "textures": self.textures.json(),
            "sensors": self.sensors.json(),
            "parameters": self.parameters.json(),
            "plan": plan,
            "no_plan": no_plan,
        });
        serde_json::to_string_pretty(&all).map_err(|e| CliError::input(&place, e))
    }
}

impl fmt::Display for Contents {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { scene, job, depth, rr_depth, hides_emitters, .. } = self;
        if let Some(job) = job {
            writeln!(f, "job {job}")?;
        }
        let depth = depth.map_or("unlimited".into(), |d| d.to_string());
        let hidden = if *hides_emitters { ", emitters hidden from the camera" } else { "" };
        writeln!(f, "scene {scene}\ndepth {depth}, Russian roulette from {rr_depth}{hidden}\n")?;
        let Self { shapes, media, emitters, textures, sensors, parameters, .. } = self;
        write!(f, "{shapes}{media}{emitters}{textures}{sensors}{parameters}")
    }
}

/// The id, or kind and order.
fn name(id: Option<&String>, kind: &str, i: usize) -> String {
    id.cloned().unwrap_or_else(|| format!("{kind}[{i}]"))
}

fn medium_name(scene: &Scene, medium: Option<usize>) -> String {
    let named = |i: usize| name(scene.media.get(i).and_then(|m| m.id.as_ref()), "medium", i);
    medium.map_or_else(|| "vacuum".into(), named)
}

fn shapes(scene: &Scene) -> Table<8> {
    // Instances share their meshes.
    let mut known: HashMap<*const Mesh, Topology> = HashMap::new();
    let row = |(i, s): (usize, &Shape)| {
        let topology = known.entry(Arc::as_ptr(&s.mesh)).or_insert_with(|| Topology::of(&s.mesh));
        let rims = topology.edges.iter().filter(|e| e.class == EdgeClass::Boundary).count();
        let edges = match rims {
            0 => topology.edges.len().to_string(),
            n => format!("{}, {n} on rims", topology.edges.len()),
        };
        let bsdf = &scene.bsdfs[s.bsdf];
        let id = bsdf.id.as_ref().map_or(String::new(), |id| format!(" {id}"));
        let between = |b: MediumBoundary| {
            let [inside, outside] = [b.interior, b.exterior].map(|m| medium_name(scene, m));
            format!("{inside} | {outside}")
        };
        [
            name(s.id.as_ref(), "shape", i),
            s.mesh.triangles.len().to_string(),
            if topology.is_closed() { "closed" } else { "open" }.into(),
            edges,
            if s.mesh.normals.is_some() { "smooth" } else { "faceted" }.into(),
            format!("{}{id}", bsdf.item.name()),
            s.boundary.map_or(String::new(), between),
            match (s.emitter, scene.placement(i)) {
                (Some(_), _) => "emits".into(),
                (None, Some(_)) => "instance".into(),
                (None, None) => String::new(),
            },
        ]
    };
    let heads =
        ["shape", "triangles", "surface", "edges", "normals", "bsdf", "inside | outside", "role"];
    Table::new(heads, scene.shapes.iter().enumerate().map(row))
}

fn media(scene: &Scene) -> Table<4> {
    let kind = |m: &Medium| match &m.kind {
        MediumKind::Homogeneous(h) => {
            let c = h.coefficients();
            let [t, a] = [c.sigma_t, c.albedo].map(|c| format!("{:?}", c.to_array()));
            ("homogeneous".into(), format!("sigma_t {t}, albedo {a}"))
        }
        MediumKind::Uniform(u) => {
            let t = u.sigma_t().to_array();
            let name = |volume: &Volume, name| volume.grid().map(|_| name);
            let grids = [name(u.albedo(), "albedo"), name(u.emission(), "emission")];
            let grids = grids.into_iter().flatten().collect::<Vec<_>>().join(" and ");
            ("homogeneous".into(), format!("sigma_t {t:?}, a grid of {grids}"))
        }
        MediumKind::Grid(g) => {
            let [x, y, z] = g.density().size();
            let largest = g.scale() * g.density().largest().max_channel();
            (format!("grid {x}x{y}x{z}"), format!("largest sigma_t {largest}"))
        }
        _ => ("custom".into(), String::new()),
    };
    let rows = scene.media.iter().enumerate().map(|(i, m)| {
        let (kind, coefficients) = kind(&m.item);
        [name(m.id.as_ref(), "medium", i), kind, coefficients, phase(&m.item.phase)]
    });
    Table::new(["medium", "kind", "coefficients", "phase function"], rows)
}

fn phase(p: &Phase) -> String {
    match p {
        Phase::Isotropic => "isotropic".into(),
        Phase::Rayleigh => "rayleigh".into(),
        Phase::HenyeyGreenstein { g } => format!("hg, g {g}"),
        Phase::HenyeyGreensteinGrid(_) => "hg, a grid of g".into(),
        Phase::Blend(blend) => {
            let [a, b] = blend.parts().each_ref().map(phase);
            match blend.weight() {
                Volume::Constant(weight) => format!("{a}, and {} of {b}", weight.r),
                Volume::Grid(_) => format!("{a}, and {b} by a grid of weights"),
            }
        }
        Phase::Sggx(field) if field.varies() => "sggx, a grid of S".into(),
        Phase::Sggx(field) => {
            let [d, o] = field.entries().each_ref().map(|v| v.value(Vec3::ZERO).to_array());
            format!("sggx, S {d:?} and {o:?} off the diagonal")
        }
        Phase::Tabulated(table) => format!("a table, mean cosine {}", table.mean_cosine()),
    }
}

fn emitters(scene: &Scene) -> Table<3> {
    let rows = scene.emitters.iter().enumerate().map(|(i, e)| {
        let (kind, strength) = (e.item.emitter.kind(), e.item.emitter.strength());
        [name(e.id.as_ref(), "emitter", i), kind.into(), format!("{:?}", strength.to_array())]
    });
    Table::new(["emitter", "kind", "strength"], rows)
}

/// Images and patterns, by what they stand for.
fn textures(scene: &Scene) -> Table<4> {
    let [wide, high] = ["columns", "rows"];
    let size = |[w, h]: [u32; 2]| format!("{w} {wide}, {h} {high}");
    let kind = |t: &Texture| match t {
        Texture::Checkerboard { .. } => "checkerboard".into(),
        Texture::Attribute(a) => format!("attribute {}", a.name),
        Texture::Volume(v) => match v.volume.grid().map(drt_medium::Grid::size) {
            Some([x, y, z]) => format!("volume {x}x{y}x{z}"),
            None => "volume, constant".into(),
        },
        Texture::Bitmap(image) => {
            format!("bitmap, {}, {:?}, {:?}", size(t.size()), image.filter, image.wrap)
                .to_lowercase()
        }
    };
    let mean = |c: drt_math::Rgb| format!("{:.4?}", c.to_array());
    let mut rows = Vec::new();
    for (i, b) in scene.bsdfs.iter().enumerate() {
        b.item.for_each_texture(|property, texture| {
            let name = name(b.id.as_ref(), "bsdf", i);
            let mean = match texture {
                Texture::Attribute(_) => String::new(),
                _ => mean(texture.mean()),
            };
            rows.push([name, property.into(), kind(texture), mean]);
        });
    }
    for (i, e) in scene.emitters.iter().enumerate() {
        let name = name(e.id.as_ref(), "emitter", i);
        let (kind, mean) = match &e.item.emitter {
            Emitter::TexturedArea { texture, .. } => (kind(texture), mean(texture.mean())),
            Emitter::Envmap { map, .. } => (format!("around, {}", size(map.size())), String::new()),
            _ => continue,
        };
        rows.push([name, "radiance".into(), kind, mean]);
    }
    Table::new(["textures of", "property", "kind", "mean"], rows)
}

fn sensors(job: &Job) -> Table<6> {
    let scene = &job.scene;
    let rows = scene.sensors.iter().enumerate().map(|(i, s)| {
        let [w, h] = s.item.sensor.film();
        let lens = s.item.sensor.lens();
        let medium = match s.item.medium {
            Surrounding::Counted => "found by counting".into(),
            Surrounding::Stated(medium) => medium_name(scene, medium),
        };
        [
            name(s.id.as_ref(), "sensor", i),
            format!("{w}x{h}"),
            filter(s.item.sensor.filter().kind()),
            if s.item.sensor.is_orthographic() {
                let width = s.item.sensor.pinhole().pixel_size * f64::from(w);
                format!("orthographic, {width:.4} wide")
            } else {
                let aperture = s.item.sensor.aperture().map_or_else(String::new, |a| {
                    format!(", a lens of radius {} sharp at {}", a.radius, a.focus_distance)
                });
                format!("{} degrees{aperture}", lens.fov)
            },
            medium,
            if i == job.settings.sensor { "used" } else { "" }.into(),
        ]
    });
    Table::new(["sensor", "film", "filter", "field of view", "medium", "role"], rows)
}

/// What Mitsuba calls a filter, with its numbers.
fn filter(kind: FilterKind) -> String {
    match kind {
        FilterKind::Box { radius } => format!("box, radius {radius}"),
        FilterKind::Tent { radius } => format!("tent, radius {radius}"),
        FilterKind::Gaussian { radius, std_dev } => {
            format!("gaussian, stddev {std_dev}, radius {radius}")
        }
        FilterKind::Mitchell { b, c } => format!("mitchell, B {b}, C {c}"),
        FilterKind::Lanczos { lobes } => format!("lanczos, {lobes} lobes"),
        other => format!("{other:?}"),
    }
}

fn parameters(parameters: &[Parameter<String>]) -> Table<4> {
    let rows = parameters.iter().flat_map(|p| {
        p.effects.iter().enumerate().map(move |(i, e)| {
            let what = match &e.change {
                Change::Geometry(g) => g.kind().into(),
                Change::Property(c) => format!("{} {}", c.op.kind(), c.property),
                Change::Follow(leader) => format!("follow {leader}"),
            };
            // Only the first effect repeats the parameter it belongs to.
            let [name, value] = match i {
                0 => [p.name.clone(), p.value.to_string()],
                _ => [String::new(), String::new()],
            };
            [name, value, e.target.clone(), what]
        })
    });
    Table::new(["parameter", "value", "target", "effect"], rows)
}
