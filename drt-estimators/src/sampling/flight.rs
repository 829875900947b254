//! Where paths stop along a ray: free flight through media, and vertices placed by other densities
//! that compete with it.

use drt_math::{Ray, Rgb, Vec3, fm, warp};
use drt_medium::{Coefficients, DistanceSample, TrackingStats};

use crate::sampling::trace::{Flight, Tracer};
use crate::world::vertex::{Kind, Vertex};
use crate::world::{Crossing, Interval, RayPath, Tracking, World, intervals};

impl Tracer<'_> {
    /// Samples where along a followed ray the path stops, by free flight. `channels` weighs the
    /// colours of extinction against each other.
    pub(crate) fn travel(
        &mut self,
        origin: Vec3,
        dir: Vec3,
        ray: &RayPath,
        channels: Rgb,
    ) -> Travel {
        let world = self.world;
        let mut passed = Rgb::ONE;
        let mut depth = 0.0;
        if world.has_media() {
            for (i, interval) in intervals(ray.medium, &ray.crossings, ray.length).enumerate() {
                let Some(m) = interval.medium else { continue };
                let medium = world.medium(m);
                let length = interval.end - interval.start;
                let part = Ray::new(origin + dir * interval.start, dir).until(length);
                let mut stats = TrackingStats::default();
                let rng = &mut self.rng;
                let sample = if world.tracking[m] == Tracking::Attenuation {
                    let weight = medium.transmittance(&part, rng, &mut stats);
                    DistanceSample::Pass { weight }
                } else if let Some((other, excess)) = world.drawn_by(m) {
                    let defensive = world.defensive_where_thin(m, other);
                    reweighted(
                        other.sample_distance(length, Rgb::ONE, defensive, rng),
                        length,
                        excess,
                    )
                } else {
                    let channels = (channels * passed).abs();
                    let defensive = world.defensive[m];
                    medium.sample_distance(&part, channels, defensive, rng, &mut stats)
                };
                self.counters.tracking_steps += stats.lookups;
                match sample {
                    DistanceSample::Pass { weight } => {
                        passed *= weight;
                        depth += proxy_extinction(world, m, None) * length;
                    }
                    DistanceSample::Scatter { t, weight, .. } => {
                        let x = part.at(t);
                        depth += proxy_extinction(world, m, None) * t;
                        let vertex = Vertex { x, medium: Some(m), kind: Kind::Volume(None) };
                        return Travel::Volume(Flown {
                            vertex,
                            coefficients: world.coefficients(m, x, dir),
                            t: interval.start + t,
                            arrival: passed * weight,
                            crossed: i,
                            density: proxy_extinction(world, m, Some(x)) * fm::exp(-depth),
                        });
                    }
                }
                if passed.is_zero() {
                    return Travel::Absorbed;
                }
            }
        }
        match ray.end {
            Some((point, x)) => {
                let vertex = Vertex { x, medium: ray.last_medium(), kind: Kind::Surface(point) };
                Travel::Surface(vertex, passed)
            }
            None => Travel::Escape(passed),
        }
    }

    /// A volume vertex placed by the angle under which a point is seen along a `span` of a ray; the point is one of
    /// several whose selection probabilities add up to `total`, and densities are per unit of its own.
    pub(crate) fn place_towards(
        &mut self,
        origin: Vec3,
        dir: Vec3,
        ray: &RayPath,
        (begin, end): (f64, f64),
        point: Vec3,
        total: f64,
    ) -> Option<Flown> {
        let distances = warp::Equiangular::new(origin, dir, point, begin, end);
        let t = distances.sample(self.rng.next_f64());
        let mut part = core::mem::take(&mut self.shadow);
        part.truncate_from(ray, t);
        let v = self.place(origin, dir, &part, t, distances.pdf(t) / total);
        self.shadow = part;
        v
    }

    /// A volume vertex put at distance `t` with a given density, weighted against free flight;
    /// `part` is the ray up to there.
    fn place(
        &mut self,
        origin: Vec3,
        dir: Vec3,
        part: &RayPath,
        t: f64,
        density: f64,
    ) -> Option<Flown> {
        let world = self.world;
        let medium = part.last_medium()?;
        if world.tracking[medium] == Tracking::Attenuation || density.is_nan() || density <= 0.0 {
            return None;
        }
        let x = origin + dir * t;
        let depth: f64 = intervals(part.medium, &part.crossings, t)
            .filter_map(|i| i.medium.map(|m| proxy_extinction(world, m, None) * (i.end - i.start)))
            .sum();
        let free = proxy_extinction(world, medium, Some(x)) * fm::exp(-depth);
        let tau =
            world.transmittance(&Ray::new(origin, dir), part, &mut self.rng, &mut self.counters);
        Some(Flown {
            vertex: Vertex { x, medium: Some(medium), kind: Kind::Volume(None) },
            coefficients: world.coefficients(medium, x, dir),
            t,
            arrival: tau / (density + free),
            crossed: part.crossings.len(),
            density: free,
        })
    }
}

/// A distance drawn in a medium with `excess` more extinction, weighted for one without.
fn reweighted(sample: DistanceSample, length: f64, excess: Rgb) -> DistanceSample {
    let ratio = |t: f64| excess.map(|e| if e == 0.0 { 1.0 } else { fm::exp(e * t) });
    match sample {
        DistanceSample::Scatter { t, weight, pdf } => {
            DistanceSample::Scatter { t, weight: weight * ratio(t), pdf }
        }
        DistanceSample::Pass { weight } => DistanceSample::Pass { weight: weight * ratio(length) },
    }
}

/// Where a path stopped along a ray.
pub(crate) enum Travel {
    /// At a volume vertex.
    Volume(Flown),
    /// At the ray's end; with the transmittance over the probability of getting there.
    Surface(Vertex, Rgb),
    /// Nowhere: past everything.
    Escape(Rgb),
    /// Nothing got through.
    Absorbed,
}

impl Travel {
    /// The vertex, or `None` for the environment, with its weight; nothing where nothing got through.
    pub(crate) fn end(self) -> Option<(Option<Vertex>, Rgb)> {
        match self {
            Self::Volume(v) => Some((Some(v.vertex), v.arrival)),
            Self::Surface(vertex, arrival) => Some((Some(vertex), arrival)),
            Self::Escape(arrival) => Some((None, arrival)),
            Self::Absorbed => None,
        }
    }
}

/// A volume vertex reached by free flight.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Flown {
    pub(crate) vertex: Vertex,
    pub(crate) coefficients: Coefficients,
    pub(crate) t: f64,
    /// Transmittance over density.
    pub(crate) arrival: Rgb,
    /// Interfaces crossed on the way.
    pub(crate) crossed: usize,
    /// Density of the distance by [`proxy_extinction`], for MIS weights.
    pub(crate) density: f64,
}

impl Flown {
    /// How this vertex was found, for MIS against equiangular sampling over `span`.
    pub(crate) fn flight(&self, span: (f64, f64), origin: Vec3, dir: Vec3) -> Flight {
        Flight { span, origin, dir, t: self.t, density: self.density }
    }
}

/// A positive stand-in for a medium's extinction in MIS weights: they may be any fixed function of
/// the path that sums to one. Grids count where they are evaluated but not along the way.
fn proxy_extinction(world: &World, medium: usize, at: Option<Vec3>) -> f64 {
    let m = world.medium(medium);
    match (m.extinction(), at) {
        (Some(h), _) => h.coefficients().sigma_t.mean(),
        (None, Some(x)) => m.sigma_t(x).mean(),
        (None, None) => 0.0,
    }
}

/// What stands for the transmittance of a segment where densities are compared: exact in one colour and homogeneous media.
pub(crate) fn proxy_attenuation(
    world: &World,
    medium: Option<usize>,
    crossings: &[Crossing],
    length: f64,
) -> f64 {
    if !world.has_media() {
        return 1.0;
    }
    let depth = |i: Interval| match i.medium {
        Some(m) => proxy_extinction(world, m, None) * (i.end - i.start),
        None => 0.0,
    };
    // Beyond that squares of densities are not finite.
    let depth: f64 = intervals(medium, crossings, length).map(depth).sum();
    fm::exp(-f64::min(depth, 100.0))
}

/// The hull of the intervals inside media.
pub(crate) fn medium_span(ray: &RayPath) -> Option<(f64, f64)> {
    let mut span: Option<(f64, f64)> = None;
    for i in intervals(ray.medium, &ray.crossings, ray.length) {
        if i.medium.is_some() && i.end > i.start {
            span = Some((span.map_or(i.start, |s| s.0), i.end));
        }
    }
    span
}
