//! The path tracer: the one random walk from the camera's side, forward and recorded.
//!
//! It estimates, for a vertex x_1 seen along a camera ray (2021 paper, Eqs. 7–11 in solid-angle and
//! distance form),
//!
//! ```text
//! L(x_0 ← x_1) = sum over k of  Θ_k [ e_k + σ_k ( NEE_k ) ],   Θ_{k+1} = Θ_k σ_k s_k a_{k+1}
//! ```
//!
//! | symbol | code | meaning |
//! |---|---|---|
//! | Θ_k | `throughput` | everything sampled before vertex k, its arrival included |
//! | a_k | `arrival` | transmittance over the density (or probability) of the distance |
//! | σ_k | `Coefficients::sigma_s` | scattering coefficient at a volume vertex, 1 on surfaces |
//! | s_k | `value · inv_pdf` | BSDF with cosine, or phase function, over the direction's density |
//! | e_k | | emission met, weighted against next-event estimation |
//!
//! Every choice is made in plain numbers and never differentiated; an [`Observer`] that records
//! sees each factor apart, so that a factor which is zero can still be differentiated (theory sheet
//! §14.5).

use alloc::boxed::Box;

use drt_math::{Rgb, Rng, Vec3, warp};
use drt_medium::Coefficients;

use crate::model::rendering::Counters;
use crate::world::lights::LightSample;
use crate::world::vertex::{Kind, Vertex};
use crate::world::{Crossing, RayPath, World};

/// Longest path with unlimited depth: far beyond where Russian roulette lets any path go.
const LONGEST: u32 = 1 << 20;

/// A vertex of the path, or the environment it escaped to, as the walk arrives there.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Arrival {
    pub(crate) parent: u32,
    pub(crate) end: Endpoint,
    /// Unit, from the parent.
    pub(crate) dir: Vec3,
    /// Infinite on escape.
    pub(crate) distance: f64,
    pub(crate) start_medium: Option<usize>,
    pub(crate) arrival: Rgb,
    pub(crate) throughput: Rgb,
    /// MIS weight of the emission met here; 0 where none counts.
    pub(crate) emission_weight: f64,
}

/// Where a segment ends.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Endpoint {
    /// A surface.
    Surface(Vertex),
    /// A volume vertex with the local coefficients.
    Volume(Vertex, Coefficients),
    /// The environment.
    Environment,
}

impl Endpoint {
    /// The scattering coefficient of a volume vertex; 1 elsewhere.
    pub(crate) fn sigma_s(&self) -> Rgb {
        match self {
            Self::Volume(_, c) => c.sigma_s(),
            _ => Rgb::ONE,
        }
    }
}

/// A next-event connection.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Connection {
    pub(crate) light: LightSample,
    pub(crate) start_medium: Option<usize>,
    /// Scattering value towards the light.
    pub(crate) f: Rgb,
    /// Transmittance × MIS weight / density.
    pub(crate) transport: Rgb,
}

impl Connection {
    /// Everything but the scattering function.
    pub(crate) fn rest(&self) -> Rgb {
        self.transport * self.light.value
    }
}

/// The pixel that a contribution goes to.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Pixel {
    /// The one whose path is walked: a contribution from where the walk goes to its start.
    Own,
    /// Row by row from the top left: a contribution of importance from the walk's start.
    At(u32),
}

/// What listens to a walk.
pub(crate) trait Observer {
    /// True when zero factors must not end a path, because their derivatives count.
    const RECORDS: bool;
    /// What reached a pixel, or the walk's start, over `segments` segments from the latter.
    fn contribution(&mut self, to: Pixel, segments: u32, value: Rgb);
    /// The walk is about to follow a ray.
    fn ray(&mut self, _world: &World, _leaving: &OutgoingRay, _ray: &RayPath) {}
    /// The walk arrived somewhere; returns the name by which the walk refers to it.
    fn arrive(&mut self, _world: &World, _arrival: &Arrival, _crossings: &[Crossing]) -> u32 {
        0
    }
    /// The walk leaves a vertex, with a value of its scattering function and its inverse density; what it draws
    /// next is `rng`'s.
    fn scatter(
        &mut self,
        _world: &World,
        _leaving: &OutgoingRay,
        _value: Rgb,
        _inv_pdf: f64,
        _rng: &Rng,
    ) {
    }
    /// Whether a ray of the camera is to be recorded that leaves the scene and finds no light.
    fn keeps_escapes(&self) -> bool {
        false
    }
    /// `node` was connected to a light.
    fn connect(&mut self, _node: u32, _connection: &Connection, _crossings: &[Crossing]) {}
}

/// A vertex about to scatter.
#[derive(Clone, Copy, Debug)]
pub(super) struct PathState {
    pub(super) node: u32,
    pub(super) vertex: Vertex,
    pub(super) coefficients: Option<Coefficients>,
    /// Unit, away from the vertex, to where the walk comes from.
    pub(super) from: Vec3,
    pub(super) throughput: Rgb,
    /// Arrival weight not yet in `alive`.
    pub(super) arrival: Rgb,
    pub(super) alive: Alive,
    /// Segments walked.
    pub(super) segments: u32,
    /// How the vertex's distance was sampled, where equiangular sampling competes.
    pub(super) flight: Option<Flight>,
}

/// The throughput with at most one zero factor per channel left out: what a derivative can still
/// bring back.
#[derive(Clone, Copy, Debug)]
pub(super) struct Alive {
    pub(super) value: Rgb,
    pub(super) spared: [bool; 3],
}

/// A ray about to be followed.
#[derive(Clone, Copy, Debug)]
pub(crate) struct OutgoingRay {
    pub(crate) node: u32,
    pub(crate) vertex: Vertex,
    pub(crate) dir: Vec3,
    /// Solid-angle density of `dir`, where next-event estimation competes.
    pub(super) pdf: Option<f64>,
    /// A smooth surface has reflected or refracted it.
    pub(super) bent: bool,
    pub(crate) throughput: Rgb,
    pub(super) alive: Alive,
    /// Segments before the ray.
    pub(crate) segments: u32,
}

impl OutgoingRay {
    /// The first one of a path.
    pub(super) fn starting(vertex: Vertex, dir: Vec3, throughput: Rgb) -> Self {
        // Roulette must not end paths for the filter's sake: its derivative needs them.
        let alive = Alive::new(Rgb::ONE);
        Self { node: 0, vertex, dir, pdf: None, bent: false, throughput, alive, segments: 0 }
    }

    /// True of a camera's ray, where the camera does not see emitters.
    pub(super) fn misses_emitters(&self, world: &World) -> bool {
        world.hides_emitters && matches!(self.vertex.kind, Kind::Point)
    }

    /// What Russian roulette takes it to carry.
    pub(crate) fn carries(&self) -> Rgb {
        self.alive.value
    }

    /// The density of its direction.
    pub(crate) fn pdf(&self) -> Option<f64> {
        self.pdf
    }

    /// Another direction of a given density, whose light counts so many `times` for Russian roulette but is not
    /// multiplied by anything.
    pub(crate) fn turned(&self, dir: Vec3, pdf: f64, times: f64) -> Self {
        let alive = Alive { value: self.alive.value * times, ..self.alive };
        Self { node: 0, dir, pdf: Some(pdf), throughput: Rgb::ONE, alive, ..*self }
    }
}

/// Everything one walk needs: the scene, its random numbers and reusable buffers.
pub(crate) struct Tracer<'w> {
    pub(crate) world: &'w World,
    pub(crate) rng: Rng,
    pub(crate) counters: Counters,
    /// Longest path in segments.
    pub(crate) max_segments: u32,
    /// Boxed, as it is lent out for every segment.
    pub(crate) ray: Option<Box<RayPath>>,
    pub(crate) shadow: RayPath,
    /// How many paths the present one stands for in its connections, of those that might go on from where it is.
    pub(super) connected: f64,
}

impl<'w> Tracer<'w> {
    pub(crate) fn new(world: &'w World) -> Self {
        Self {
            world,
            rng: Rng::new(0, 0, 0),
            counters: Counters::default(),
            max_segments: world.max_depth.min(LONGEST),
            ray: None,
            shadow: RayPath::default(),
            connected: 1.0,
        }
    }
}

/// A distance sampled by free flight, and the span of the ray that equiangular sampling covers.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Flight {
    pub(crate) span: (f64, f64),
    pub(crate) origin: Vec3,
    pub(crate) dir: Vec3,
    pub(crate) t: f64,
    pub(crate) density: f64,
}

impl Flight {
    /// Balance-heuristic weight of connecting to the point `at`, which equiangular sampling chooses
    /// one in `choices` times.
    pub(crate) fn weight(&self, at: Vec3, choices: f64) -> f64 {
        let (begin, end) = self.span;
        let d = warp::Equiangular::new(self.origin, self.dir, at, begin, end);
        self.density / (self.density + d.pdf(self.t) / choices)
    }
}
