//! Choosing emitters for next-event estimation.
//!
//! A constant environment is not among them: scattering finds it by itself, with densities
//! proportional to all that varies but visibility, and no light sample would improve on that. One that an image
//! tells is.

use alloc::sync::Arc;
use alloc::vec::Vec;

use drt_math::{AliasTable, Rgb, RgbVec, Rng, Vec3, warp};

use crate::model::emitter::{Emitter, EnvironmentMap};
use crate::model::error::Error;
use crate::model::scene::{Scene, Shape};
use crate::world::World;
use crate::world::vertex::SurfacePoint;

/// How far off an emitter's plane a point must be to see it, over the coordinates of both: what rounding adds to that distance.
const IN_PLANE: f64 = 32.0 * f64::EPSILON;

/// The emitters whose light is looked at. Light adds up, so that an estimator may leave some of it to
/// another.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) enum EmitterMask {
    /// By all.
    #[default]
    All,
    /// By surfaces, media and the environment.
    Extended,
    /// By points and directions.
    Delta,
}

impl EmitterMask {
    /// Whether an emitter counts.
    pub(crate) fn by(self, emitter: &Emitter) -> bool {
        match self {
            Self::All => true,
            Self::Extended => !emitter.is_delta(),
            Self::Delta => emitter.is_delta(),
        }
    }

    /// Whether the environment and emission of surfaces and in media count.
    pub(crate) fn by_surroundings(self) -> bool {
        self != Self::Delta
    }

    /// Whether a sampled emitter counts.
    pub(crate) fn by_sample(self, light: &LightSample) -> bool {
        match self {
            Self::All => true,
            Self::Extended => light.pdf > 0.0,
            Self::Delta => light.pdf == 0.0,
        }
    }
}

/// One choice of the table.
#[derive(Clone, Copy, Debug)]
enum Entry {
    /// A triangle of an area emitter, by its index in the soup.
    Triangle { emitter: u32, prim: u32, area: f64 },
    /// A point, spot or directional light.
    Delta { emitter: u32 },
    /// The environment.
    Environment,
}

/// An emitter chosen by the table, not yet a point of it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Choice {
    /// The emitter, when it is a delta light.
    pub(crate) delta: Option<usize>,
    pub(crate) pmf: f64,
    entry: Entry,
}

impl Choice {
    /// 1 over the density per area of a point of a chosen area emitter.
    pub(crate) fn inverse_area_pdf(&self) -> f64 {
        match self.entry {
            Entry::Triangle { area, .. } => area / self.pmf,
            _ => 0.0,
        }
    }
}

/// What was sampled.
#[derive(Clone, Copy, Debug)]
pub(crate) enum LightKind {
    /// A point of an area emitter.
    Area(SurfacePoint),
    /// A point or spot light.
    Position,
    /// A directional light.
    Direction,
    /// A direction of the environment.
    Environment,
}

/// A sampled point of an emitter with an area.
#[derive(Clone, Copy, Debug)]
pub(crate) struct AreaPoint {
    emitter: u32,
    point: SurfacePoint,
    y: Vec3,
}

/// A sampled point or direction of an emitter, seen from somewhere.
#[derive(Clone, Copy, Debug)]
pub(crate) struct LightSample {
    pub(crate) emitter: usize,
    pub(crate) kind: LightKind,
    /// Unit, towards the light.
    pub(crate) w: Vec3,
    /// The light's point; meaningless for directions.
    pub(crate) y: Vec3,
    /// Infinite for directions.
    pub(crate) distance: f64,
    /// Radiance (area, environment), I/r² (position) or irradiance (direction).
    pub(crate) value: Rgb,
    /// 1 over the density: solid angle for areas and environments, selection probability for delta lights.
    pub(crate) inv_pdf: f64,
    /// Solid-angle density; 0 for delta lights, which nothing else can hit.
    pub(crate) pdf: f64,
}

impl LightSample {
    /// True of light from a point or a direction, which no path meets by chance.
    pub(crate) fn is_delta(&self) -> bool {
        matches!(self.kind, LightKind::Position | LightKind::Direction)
    }

    /// The point of an area emitter.
    pub(crate) fn point(&self) -> Option<&SurfacePoint> {
        match &self.kind {
            LightKind::Area(point) => Some(point),
            _ => None,
        }
    }
}

/// The light that comes from outside.
#[derive(Clone, Debug)]
pub(crate) struct Environment {
    pub(crate) emitter: usize,
    strength: Rgb,
    map: Option<Arc<EnvironmentMap>>,
    /// What directions are drawn by.
    drawn: Option<Arc<EnvironmentMap>>,
    /// Probability of choosing it; 0 where scattering finds it alone.
    pmf: f64,
}

impl Environment {
    /// What the radiance from all directions is multiplied by, and the image that it comes of.
    pub(crate) fn parts(&self) -> (Rgb, Option<&EnvironmentMap>) {
        (self.strength, self.map.as_deref())
    }

    /// The radiance from a unit direction.
    #[inline]
    pub(crate) fn radiance(&self, w: Vec3) -> Rgb {
        match &self.map {
            None => self.strength,
            Some(map) => self.strength * map.at(w),
        }
    }

    /// The gradient of the radiance by a unit direction, across it.
    pub(crate) fn gradient(&self, w: Vec3) -> RgbVec {
        self.map.as_ref().map_or(RgbVec::ZERO, |map| map.gradient(w) * self.strength)
    }

    /// Density per steradian with which light samples have a unit direction.
    #[inline]
    pub(crate) fn pdf(&self, w: Vec3) -> f64 {
        match &self.drawn {
            None => 0.0,
            Some(map) => self.pmf * map.pdf(w),
        }
    }

    fn sample(&self, rng: &mut Rng) -> Option<LightSample> {
        let (w, pdf) = self.drawn.as_ref()?.sample(rng.next_f64(), rng.next_2d())?;
        let pdf = self.pmf * pdf;
        (pdf > 0.0).then(|| LightSample {
            emitter: self.emitter,
            kind: LightKind::Environment,
            w,
            y: Vec3::ZERO,
            distance: f64::INFINITY,
            value: self.radiance(w),
            inv_pdf: 1.0 / pdf,
            pdf,
        })
    }
}

/// The emitters of a scene by power.
#[derive(Clone, Debug, Default)]
pub(crate) struct LightTable {
    entries: Vec<Entry>,
    table: Option<AliasTable>,
    /// Radiance of each area emitter, or the mean of its texture's; zero for others.
    area_radiance: Vec<Rgb>,
    /// Selection probability per unit area of each soup triangle's emitter.
    density: Vec<f64>,
    environment: Option<Environment>,
    /// Lights with a position inside a scattering medium: emitter index, selection probability,
    /// position; and the sum of the probabilities.
    inside: (Vec<(usize, f64, Vec3)>, f64),
}

impl LightTable {
    /// The emitters of a scene, chosen with the probabilities of `like` where that is given: a scene
    /// that differs from this one in values alone.
    pub(crate) fn new(
        scene: &Scene,
        first_prim: &[u32],
        radius: f64,
        like: Option<&Self>,
        lit: EmitterMask,
    ) -> Result<Self, Error> {
        let mut entries = Vec::new();
        let mut weights = Vec::new();
        // Instances do not emit, and come last.
        let own = |(i, _): &(usize, &Shape)| scene.placement(*i).is_none();
        let shapes = scene.shapes.iter().enumerate().filter(own);
        let count: usize = shapes.map(|(_, s)| s.mesh.triangles.len()).sum();
        let mut environment = None;
        let mut area_radiance = alloc::vec![Rgb::ZERO; scene.emitters.len()];
        for (i, shape) in scene.shapes.iter().enumerate() {
            let Some(e) = shape.emitter else { continue };
            if !lit.by(&scene.emitters[e].item.emitter) {
                continue;
            }
            let Some(radiance) = scene.emitters[e].item.emitter.area_radiance() else { continue };
            area_radiance[e] = radiance;
            let surface = shape.mesh.surface_area();
            let mean = |t: u32| match &scene.emitters[e].item.emitter {
                Emitter::TexturedArea { radiance, texture } => {
                    *radiance * texture.mean_on(&shape.mesh, t)
                }
                _ => radiance,
            };
            for t in 0..shape.mesh.triangles.len() as u32 {
                let area = shape.mesh.area(t);
                let emitter = e as u32;
                entries.push(Entry::Triangle { emitter, prim: first_prim[i] + t, area });
                let power = area * core::f64::consts::PI * mean(t).mean();
                weights.push((power, area / surface));
            }
        }
        for (e, named) in scene.emitters.iter().enumerate() {
            let emitter = e as u32;
            if !lit.by(&named.item.emitter) {
                continue;
            }
            match &named.item.emitter {
                Emitter::Area { .. } | Emitter::TexturedArea { .. } => continue,
                Emitter::Constant { radiance } => {
                    let strength = *radiance;
                    environment = Some(Environment {
                        emitter: e,
                        strength,
                        map: None,
                        drawn: None,
                        pmf: 0.0,
                    });
                    continue;
                }
                Emitter::Envmap { radiance, map } => {
                    let (strength, map) = (*radiance, Some(Arc::clone(map)));
                    let other = like.and_then(|l| l.environment.as_ref());
                    let drawn = other.map_or_else(|| map.clone(), |other| other.drawn.clone());
                    environment = Some(Environment { emitter: e, strength, map, drawn, pmf: 0.0 });
                    entries.push(Entry::Environment);
                }
                _ => entries.push(Entry::Delta { emitter }),
            }
            weights.push((named.item.emitter.power(radius), 1.0));
        }
        // Half by power, half by the number of emitters: a narrow spot has little power and is the
        // brightest thing where it shines; a light that is off still has a derivative.
        let power: f64 = weights.iter().map(|w| w.0).sum();
        let number: f64 = weights.iter().map(|w| w.1).sum();
        let weights: Vec<f64> = weights
            .iter()
            .map(|(p, n)| if power > 0.0 { p / power + n / number } else { *n })
            .collect();
        let table = if let Some(like) = like {
            like.table.clone()
        } else if weights.is_empty() {
            None
        } else {
            Some(
                AliasTable::new(&weights)
                    .map_err(|e| Error::Element { element: "emitters".into(), reason: e.into() })?,
            )
        };
        let mut lights = Self {
            entries,
            table,
            area_radiance,
            density: alloc::vec![0.0; count],
            environment,
            inside: (Vec::new(), 0.0),
        };
        for (i, entry) in lights.entries.iter().enumerate() {
            let pmf = lights.table.as_ref().map_or(0.0, |t| t.pmf(i));
            match *entry {
                Entry::Triangle { prim, area, .. } => lights.density[prim as usize] = pmf / area,
                Entry::Delta { emitter } => {
                    let e = emitter as usize;
                    if let Some(at) = scene.emitters[e].item.emitter.position() {
                        lights.inside.0.push((e, pmf, at));
                    }
                }
                Entry::Environment => {
                    if let Some(environment) = &mut lights.environment {
                        environment.pmf = pmf;
                    }
                }
            }
        }
        Ok(lights)
    }

    pub(crate) fn area_radiance(&self, emitter: usize) -> Rgb {
        self.area_radiance[emitter]
    }

    pub(crate) fn environment(&self) -> Option<&Environment> {
        self.environment.as_ref()
    }

    /// True where the environment differs by direction.
    pub(crate) fn has_image(&self) -> bool {
        self.environment.as_ref().is_some_and(|e| e.map.is_some())
    }

    /// Lights with a position inside a scattering medium, for equiangular sampling: emitter index,
    /// selection probability and position; and the sum of the probabilities.
    pub(crate) fn inside(&self) -> (&[(usize, f64, Vec3)], f64) {
        (&self.inside.0, self.inside.1)
    }

    /// Keeps the lights for which `scatters(emitter, position)` holds around them.
    pub(crate) fn keep_inside(&mut self, scatters: impl Fn(usize, Vec3) -> bool) {
        self.inside.0.retain(|(e, pmf, x)| *pmf > 0.0 && scatters(*e, *x));
        self.inside.1 = self.inside.0.iter().map(|l| l.1).sum();
    }

    /// Solid-angle density with which [`LightTable::sample`] finds the emitting point `s` at
    /// `distance` along the unit direction `w`.
    pub(crate) fn area_pdf(&self, s: &SurfacePoint, w: Vec3, distance: f64) -> f64 {
        let cosine = -s.ng.dot(w);
        if cosine <= 0.0 {
            return 0.0;
        }
        self.density[s.prim as usize] * distance * distance / cosine
    }

    /// Density per area with which [`LightTable::choose`] and [`LightTable::point_of`] find an emitting point.
    pub(crate) fn area_density(&self, s: &SurfacePoint) -> f64 {
        self.density[s.prim as usize]
    }

    /// True when light comes from somewhere in particular, where paths of light can start.
    pub(crate) fn start_paths(&self) -> bool {
        self.table.is_some()
    }

    /// True when some surface emits.
    pub(crate) fn has_areas(&self) -> bool {
        self.density.iter().any(|d| *d > 0.0)
    }

    /// Chooses an emitter, or a triangle of one.
    pub(crate) fn choose(&self, rng: &mut Rng) -> Option<Choice> {
        let i = self.table.as_ref()?.sample(rng.next_f64()).index;
        let entry = self.entries[i];
        let delta = match entry {
            Entry::Delta { emitter } => Some(emitter as usize),
            Entry::Triangle { .. } | Entry::Environment => None,
        };
        let pmf = self.table.as_ref().map_or(0.0, |t| t.pmf(i));
        Some(Choice { delta, pmf, entry })
    }

    /// Samples a point of a chosen area emitter.
    pub(crate) fn point_of(
        &self,
        world: &World,
        choice: &Choice,
        rng: &mut Rng,
    ) -> Option<(SurfacePoint, Vec3)> {
        let Entry::Triangle { prim, .. } = choice.entry else { return None };
        Some(world.point(prim, triangle_bary(rng.next_2d())))
    }

    /// Samples a point of a chosen area emitter, as seen from `x`.
    pub(crate) fn sample_area(
        &self,
        world: &World,
        choice: &Choice,
        x: Vec3,
        rng: &mut Rng,
    ) -> Option<LightSample> {
        let point = self.area_point(world, choice, rng)?;
        self.area_seen_from(world, &point, x)
    }

    /// Samples a point of an emitter with an area, uniformly; `None` of others.
    pub(crate) fn area_point(
        &self,
        world: &World,
        choice: &Choice,
        rng: &mut Rng,
    ) -> Option<AreaPoint> {
        let Entry::Triangle { emitter, .. } = choice.entry else { return None };
        let (point, y) = self.point_of(world, choice, rng)?;
        Some(AreaPoint { emitter, point, y })
    }

    /// The light that a point of an emitter sends to `x`; `None` where it sends none.
    pub(crate) fn area_seen_from(
        &self,
        world: &World,
        of: &AreaPoint,
        x: Vec3,
    ) -> Option<LightSample> {
        let AreaPoint { emitter, point, y } = *of;
        let d = y - x;
        // A point in the emitter's plane, as those of a ceiling in which a lamp lies, sees nothing of it; rounding would give it a
        // cosine of that size, and derivatives one over it.
        if -point.ng.dot(d) <= IN_PLANE * (x.max_abs() + y.max_abs()) {
            return None;
        }
        let distance = d.length();
        let w = d / distance;
        let pdf = self.area_pdf(&point, w, distance);
        if pdf.is_nan() || pdf <= 0.0 {
            return None;
        }
        Some(LightSample {
            emitter: emitter as usize,
            kind: LightKind::Area(point),
            w,
            y,
            distance,
            value: world.area_radiance(emitter as usize, &point),
            inv_pdf: 1.0 / pdf,
            pdf,
        })
    }

    /// Samples an emitter as seen from `x`.
    pub(crate) fn sample(&self, world: &World, x: Vec3, rng: &mut Rng) -> Option<LightSample> {
        let choice = self.choose(rng)?;
        match choice.entry {
            Entry::Triangle { .. } => self.sample_area(world, &choice, x, rng),
            Entry::Delta { emitter } => Self::delta(world, emitter as usize, x, choice.pmf),
            Entry::Environment => self.environment.as_ref()?.sample(rng),
        }
    }

    /// A delta light as seen from `x`, chosen with probability `pmf`.
    pub(crate) fn delta(world: &World, emitter: usize, x: Vec3, pmf: f64) -> Option<LightSample> {
        let light = &world.scene.emitters[emitter].item.emitter;
        let incident = light.incident(x)?;
        let (kind, y) = match light.position() {
            Some(p) => (LightKind::Position, p),
            None => (LightKind::Direction, Vec3::ZERO),
        };
        Some(LightSample {
            emitter,
            kind,
            w: incident.w,
            y,
            distance: incident.distance,
            value: incident.value,
            inv_pdf: 1.0 / pmf,
            pdf: 0.0,
        })
    }
}

/// Uniform barycentric weights of a triangle's second and third vertex.
pub(crate) fn triangle_bary(u: [f64; 2]) -> [f64; 2] {
    let [_, b1, b2] = warp::uniform_triangle(u);
    [b1, b2]
}
