//! Probes: points on the rays of a path at which extinctions are differentiated where free flight seldom stops.
//!
//! Let a ray leave x along w, and let T(y) be the transmittance from x to its point y. The light that arrives at x is
//!
//! ```text
//! L(x) = ∫ T [σ_t a S + σ_t (1 - a) e] dy + T_end L_end,
//! ```
//!
//! with the albedo a, the emission e, and the radiance S that the phase function gathers at y. For a change σ_t' of the extinction
//!
//! ```text
//! L'(x) = ∫ T σ_t' [a S + (1 - a) e - L(y)] dy,
//! ```
//!
//! L(y) being what arrives at y along the ray. The part with L(y) is T' / T = -∫ σ_t' of the segments of the path, which line
//! integrals estimate wherever σ_t is (`derivative::adjoint::segment`). The other part is that of volume vertices. Free flight has
//! the density σ_t T, so that a vertex would have to be weighted by σ_t' / σ_t, with a variance of the order of ∫ T σ_t'² / σ_t: it
//! is infinite where σ_t vanishes and σ_t' does not, and in empty voxels there is no vertex at all.
//!
//! A *probe* y has a density that does not depend on σ_t at y (differential ratio tracking, Nimier-David et al. 2022). With the
//! throughput Θ to x, all rays of a path together have the density
//!
//! ```text
//! q(y) = Θ T̃(y) / W,   W = Σ over rays of Θ ∫ T̃ dy,
//! ```
//!
//! where T̃ is the average of two approximations of T: by the mean extinctions of the cells on the way, and by their minima, so that
//! T / T̃ is about 2 at most. Where free flight does better, a stretch counts for less. One probe is chosen by reservoir sampling
//! while the path is walked, and S is traced for it alone. So the cost stays linear in the path's length.
//!
//! # Control radiance
//!
//! The two parts have opposite signs and cancel where light is the same in all directions, but free flight and probe do not meet the same
//! points. For any radiance β that depends on the ray alone, and not on where the walk stops on it,
//!
//! ```text
//! E[m ∫_0^t σ_t' dy] = ∫ T σ_t' dy,   m = σ_t a at a volume vertex at the distance t, a at the ray's end,
//! ```
//!
//! a being transmittance over density there (integrate by parts). So L and a S may both be taken relative to β: the line integrals of a
//! segment take Θ (a R - m β) for Θ a R, and a vertex or probe takes a S - β. Here β is what the ray would see without any medium, weighted
//! as where the walk meets it, times the root of what the medium lets through, roughly; of a sky that is the same everywhere, a part of the rest
//! is added. Half of what scatters once leaves a body of some depth, so that with the sky's radiance L the gathered radiance is about
//! S = (L + a S) / 2, and the part is a S / L = a / (2 - a), with the albedo at the mean place where a probe would be. It is one where
//! nothing is absorbed: there a sky makes S = L exactly. Where a medium on the way has no vertices, the identity does not hold, and β is zero.
//!
//! # Splitting
//!
//! In thin places most of the noise is that of S. A probe that takes more than half of the derivative is seen by two paths from there on.
//! What these draw first are two points of one Sobol' sequence, so that they leave into opposite halves of the sphere, and the next
//! two go on with the sequence of the pixel. One number of another sequence chooses the stretch and the place on it: what is left of a uniform
//! number once it has made a choice is uniform again, so that probes of a pixel spread evenly along its rays.
//!
//! # Beside vertices
//!
//! Vertices are better where σ_t is large. A vertex takes the part σ_t / (σ_t + c) of the derivative at its place, and a probe
//! the rest: the balance heuristic for densities σ_t T and c T, where c is a medium's
//! [least extinction](World::share_of_vertices) that vertices see well. The parts depend on the place alone, so that
//! they add up to one for vertices of any path, be they found by free flight, by the angle that a light is seen under, or from the
//! emitter's end. Derivatives by the albedo and by the emission are shared in the same way. They are in proportion to σ_t, so that nothing
//! is lost where there are no vertices, but a thin body has a vertex on few of its rays, and whether it has one is most of their noise.
//! Where nothing else is asked for, probes [count](World::weight_of_probes) in proportion to σ_t.
//!
//! # Motion
//!
//! A vertex that moves with the velocity v through a grid that moves with u sees σ_t change by σ_t' = ∂σ_t + (v - u)·∇σ_t. Beside an empty voxel, where σ_t
//! rises from zero along a line, ∫ σ_t'² / σ_t diverges like a logarithm, so that grids that move are probed as well. A probe is
//! added to the path's record as a vertex that no light passes, found by the ray that it is on. It is given the [velocity](crate::derivative::velocity) of
//! a vertex there, and sends its sensitivities the same way, whatever the estimator is, in forward and reverse mode.
//!
//! # What is left out
//!
//! Custom fields, of which it is not known where they are empty. Media with a point or spot
//! emitter in them: S has a pole there. Connections with emitters, whose line integrals meet no vertices.

use core::ops::ControlFlow;

use drt_math::sobol::{self, SobolSampler};
use drt_math::{Ray, Rgb, Rng, Vec3, fm};
use drt_medium::Piece;

use crate::sampling::streams::{PROBE_STREAM, names_of_probes};
use crate::sampling::trace::{Arrival, Endpoint, OutgoingRay, Tracer};
use crate::world::lights::Environment;
use crate::world::vertex::{Kind, Vertex};
use crate::world::{RayPath, Tracking, World, intervals};

/// Paths that go on from a probe that takes more than half of the derivative.
const SPLIT: u32 = 2;

/// A stretch of a ray that a probe may be on.
#[derive(Clone, Copy, Debug)]
struct Stretch {
    node: u32,
    origin: Vec3,
    dir: Vec3,
    throughput: Rgb,
    carries: Rgb,
    /// Segments up to a vertex on it.
    segments: u32,
    start: f64,
    length: f64,
    /// How much points on it count.
    scale: f64,
    control: Rgb,
    passing: Passing,
    rates: [f64; 2],
}

/// The two approximations of the transmittance of a ray so far.
#[derive(Clone, Copy, Debug)]
struct Passing([f64; 2]);

/// A point of a path that has been chosen.
pub(crate) struct Probe {
    pub(crate) arrival: Arrival,
    /// What Russian roulette takes the path to carry there.
    pub(crate) carries: Rgb,
    pub(crate) segments: u32,
    pub(crate) control: Rgb,
    /// How many paths see what it scatters.
    pub(crate) paths: u32,
}

/// Chooses one probe per path.
#[derive(Clone, Debug)]
pub(crate) struct Probes {
    rng: Rng,
    /// The path's pixel, and its number among those of the pixel.
    pixel: Option<u32>,
    unit: u32,
    /// Names the pixel's sequences of the choice of probes, and of the numbers of what they see.
    names: [u32; 2],
    /// Uniform in what is left of the choice among the stretches so far.
    choice: f64,
    total: f64,
    chosen: Option<Stretch>,
    /// The ray up to the end of the chosen stretch.
    part: RayPath,
    /// The control radiance of the present ray.
    pub(crate) control: Rgb,
}

impl Probes {
    pub(crate) fn new() -> Self {
        Self {
            rng: Rng::new(0, 0, 0),
            pixel: None,
            unit: 0,
            names: [0; 2],
            choice: 0.5,
            total: 0.0,
            chosen: None,
            part: RayPath::default(),
            control: Rgb::ZERO,
        }
    }

    /// Forgets the last path; the next is sample `unit` of a pixel. All paths are of one `seed`.
    pub(crate) fn begin(&mut self, seed: u64, pixel: u32, unit: u32) {
        if self.pixel != Some(pixel) {
            self.pixel = Some(pixel);
            self.names = names_of_probes(seed, pixel);
        }
        self.rng = Rng::new(seed, PROBE_STREAM | u64::from(pixel), unit);
        self.unit = unit;
        self.choice = sobol::sample(unit, 0, self.names[0]);
        self.total = 0.0;
        self.chosen = None;
    }

    /// Whether the choice falls on what has this weight, which the total includes.
    fn takes(&mut self, weight: f64) -> bool {
        // Behind great depths nothing may be left, and none of it may be all that was offered so far.
        if weight <= 0.0 {
            return false;
        }
        let (taken, left) = divided(self.choice, weight / self.total);
        self.choice = left;
        taken
    }

    /// Offers what is on a ray of the path.
    pub(crate) fn offer(&mut self, world: &World, leaving: &OutgoingRay, ray: &RayPath) {
        let OutgoingRay { node, throughput, dir, .. } = *leaving;
        self.control = Rgb::ZERO;
        let strength = throughput.max_abs();
        let segments = leaving.segments + 1;
        if strength == 0.0 || segments > world.max_depth {
            return;
        }
        let origin = leaving.vertex.x;
        let mut passing = Passing([0.5; 2]);
        let mut chosen = false;
        let mut mean = MeanPlace::default();
        for i in intervals(ray.medium, &ray.crossings, ray.length) {
            let Some(m) = i.medium.filter(|_| i.end > i.start) else { continue };
            let probed = world.probed[m].is_some();
            let part = Ray::new(origin + dir * i.start, dir).until(i.end - i.start);
            world.medium(m).means(&part, &mut |piece: &Piece| {
                let length = piece.end - piece.start;
                let rates = [piece.mean, piece.minorant].map(least);
                if probed && length > 0.0 {
                    let scale = strength * world.weight_of_probes(m, piece.mean.mean().abs());
                    let [a, b] = passing.along(rates, length);
                    let weight = scale * (a + b);
                    self.total += weight;
                    mean.add(m, i.start + 0.5 * (piece.start + piece.end), weight);
                    if self.takes(weight) {
                        let start = i.start + piece.start;
                        let carries = leaving.carries();
                        self.chosen = Some(Stretch {
                            node,
                            origin,
                            dir,
                            throughput,
                            carries,
                            segments,
                            start,
                            length,
                            scale,
                            control: Rgb::ZERO,
                            passing,
                            rates,
                        });
                        self.part.truncate_from(ray, start + length);
                        chosen = true;
                    }
                }
                passing = passing.after(rates, length);
                if passing.0 == [0.0; 2] {
                    ControlFlow::Break(())
                } else {
                    ControlFlow::Continue(())
                }
            });
        }
        let Some((m, distance)) = mean.place() else { return };
        let albedo = world.coefficients(m, origin + dir * distance, dir).albedo;
        self.control = control(world, leaving, ray, 2.0 * passing.0[0], albedo);
        if let Some(stretch) = self.chosen.as_mut().filter(|_| chosen) {
            stretch.control = self.control;
        }
    }

    /// The probe of the path; `None` where no ray of it met a medium that has some, or nothing gets there.
    pub(crate) fn choose(&mut self, tracer: &mut Tracer<'_>) -> Option<Probe> {
        let s = self.chosen.take()?;
        let (world, rng) = (tracer.world, &mut self.rng);
        let [a, b] = s.passing.along(s.rates, s.length);
        let (by_mean, left) = divided(self.choice, a / (a + b));
        let rate = s.rates[usize::from(!by_mean)];
        let within = exponential(left, rate, s.length);
        let [a, b] = s.passing.after(s.rates, within).0;
        let density = s.scale * (a + b) / self.total;
        let distance = s.start + within;
        self.part.cut(distance);
        let m = self.part.last_medium()?;
        let tau =
            world.transmittance(&Ray::new(s.origin, s.dir), &self.part, rng, &mut tracer.counters);
        if tau.is_zero() {
            return None;
        }
        let x = s.origin + s.dir * distance;
        let vertex = Vertex { x, medium: Some(m), kind: Kind::Volume(None) };
        let coefficients = world.coefficients(m, x, s.dir);
        let by_vertices = world.share_of_vertices(&vertex, &coefficients);
        let paths = if by_vertices < 0.5 { SPLIT } else { 1 };
        tracer.counters.probes += 1;
        let arrival = tau * (1.0 / density);
        let arrival = Arrival {
            parent: s.node,
            end: Endpoint::Volume(vertex, coefficients),
            dir: s.dir,
            distance,
            start_medium: self.part.medium,
            arrival,
            throughput: s.throughput * arrival,
            emission_weight: 1.0,
        };
        let Stretch { carries, segments, control, .. } = s;
        Some(Probe { arrival, carries, segments, control, paths })
    }

    /// Interfaces on the way to the probe that has been chosen last.
    pub(crate) fn way(&self) -> &RayPath {
        &self.part
    }

    /// The random numbers of what a probe sees.
    pub(crate) fn numbers(&self) -> Rng {
        self.rng.clone()
    }

    /// What leads the numbers of path `k` of those that see it.
    pub(crate) fn leading(&self, k: u32) -> SobolSampler {
        SobolSampler::new(self.names[1], self.unit.wrapping_mul(SPLIT).wrapping_add(k))
    }
}

/// The mean place of probes on a ray.
#[derive(Clone, Copy, Debug, Default)]
struct MeanPlace {
    medium: usize,
    weight: f64,
    moment: f64,
}

impl MeanPlace {
    fn add(&mut self, medium: usize, distance: f64, weight: f64) {
        self.medium = medium;
        self.weight += weight;
        self.moment += distance * weight;
    }

    /// The medium that was met last, and the distance; `None` where the ray meets nothing that is probed.
    fn place(&self) -> Option<(usize, f64)> {
        (self.weight > 0.0).then(|| (self.medium, self.moment / self.weight))
    }
}

impl Passing {
    /// The integrals of both approximations over the next `length`.
    fn along(self, rates: [f64; 2], length: f64) -> [f64; 2] {
        [0, 1].map(|k| {
            let depth = rates[k] * length;
            let mean = if depth < 1e-6 { 1.0 - 0.5 * depth } else { -fm::exp_m1(-depth) / depth };
            self.0[k] * length * mean
        })
    }

    /// Both approximations after that.
    fn after(self, rates: [f64; 2], length: f64) -> Self {
        Self([0, 1].map(|k| {
            if rates[k] > 0.0 { self.0[k] * fm::exp(-rates[k] * length) } else { self.0[k] }
        }))
    }
}

/// The control radiance of a ray that the media on its way let so much through, roughly, and of which the rest meets an `albedo`.
fn control(world: &World, leaving: &OutgoingRay, ray: &RayPath, passing: f64, albedo: Rgb) -> Rgb {
    let Some((radiance, weight)) = leaving.met(world, ray) else { return Rgb::ZERO };
    let attenuates = |m: usize| world.tracking[m] == Tracking::Attenuation;
    let mut media = intervals(ray.medium, &ray.crossings, ray.length).filter_map(|i| i.medium);
    // Where nothing stops, the walk does not tell how much is left at the points that it passes.
    if media.any(attenuates) {
        return Rgb::ZERO;
    }
    let through = fm::sqrt(passing);
    let environment = world.lights.environment().filter(|_| ray.end.is_none());
    let around = match environment.map(Environment::parts) {
        Some((radiance, None)) => radiance * albedo.map(|a| a / (2.0 - a)),
        _ => Rgb::ZERO,
    };
    radiance * (weight * through) + around * (1.0 - through)
}

/// Whether a uniform number is below `share`, and a uniform number that does not depend on the answer.
fn divided(u: f64, share: f64) -> (bool, f64) {
    if u < share { (true, u / share) } else { (false, (u - share) / (1.0 - share)) }
}

/// The extinction of the channel that lets most through.
fn least(sigma_t: Rgb) -> f64 {
    let [r, g, b] = sigma_t.to_array();
    f64::max(f64::min(f64::min(r, g), b), 0.0)
}

/// A distance in a stretch with a density in proportion to what passes.
fn exponential(u: f64, rate: f64, length: f64) -> f64 {
    let depth = rate * length;
    if depth < 1e-6 {
        return u * length;
    }
    f64::min(-fm::ln_1p(u * fm::exp_m1(-depth)) / rate, length)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The choice of one number is that of the weights, and what weighs nothing leaves it as it was.
    #[test]
    fn weights_are_chosen_in_proportion() {
        const N: u32 = 4096;
        let weights = [0.0, 1.0, 0.0, 2.0, 5.0];
        let mut counts = [0; 5];
        for unit in 0..N {
            let mut probes = Probes::new();
            probes.choice = sobol::sample(unit, 0, 7);
            let mut last = None;
            for (k, weight) in weights.into_iter().enumerate() {
                probes.total += weight;
                last = if probes.takes(weight) { Some(k) } else { last };
            }
            assert!((0.0..=1.0).contains(&probes.choice));
            counts[last.unwrap()] += 1;
        }
        assert_eq!([counts[0], counts[2]], [0, 0]);
        for (k, share) in [(1, 0.125), (3, 0.25), (4, 0.625)] {
            assert!((f64::from(counts[k]) / f64::from(N) - share).abs() < 0.01, "{counts:?}");
        }
    }
}
