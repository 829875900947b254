//! Where derivatives go. Estimators know only *sensitivities*: how a pixel changes per unit of some
//! local quantity (the jet of a surface point, a coefficient at a point, the camera's frame …).
//! Two sinks receive them: a contraction with the tangents of N parameters (forward mode), and a
//! scatter of one weighted sum into gradients of everything (reverse mode). They are transposes.

use alloc::vec::Vec;

use drt_math::{Rgb, RgbVec, Vec3};
use drt_medium::{CoefficientRates, DepthEstimate, PhaseGradient};

use crate::model::emitter::EmitterGradient;
use crate::model::sensor::SensorGradient;
use crate::model::surface::{BsdfParams, Property};
use crate::model::texture::Footprint;
use crate::world::vertex::{MaterialPoint, Matter};

/// Per channel, the change of a value per unit of each entry of a surface point's jet.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct SurfaceAdjoint {
    /// Position.
    pub(crate) u: RgbVec,
    /// Unit geometric normal.
    pub(crate) n: RgbVec,
    /// Unit shading normal.
    pub(crate) ns: RgbVec,
    /// Area Jacobian.
    pub(crate) j: Rgb,
    /// Place on the surface, at rest itself.
    pub(crate) slide: RgbVec,
}

impl SurfaceAdjoint {
    /// Of the position alone.
    pub(crate) fn of_place(u: RgbVec) -> Self {
        Self { u, ..Self::default() }
    }

    /// Multiplied channel by channel.
    pub(crate) fn times(&self, by: Rgb) -> Self {
        let Self { u, n, ns, j, slide } = *self;
        Self { u: u * by, n: n * by, ns: ns * by, j: j * by, slide: slide * by }
    }

    pub(crate) fn is_zero(&self) -> bool {
        [self.u, self.n, self.ns, self.slide].into_iter().all(|v| v == RgbVec::ZERO)
            && self.j.is_zero()
    }
}

/// Per channel, the change of a value per unit of each coefficient at a point of a medium.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct CoefficientAdjoint {
    pub(crate) sigma_t: Rgb,
    pub(crate) albedo: Rgb,
    pub(crate) emission: Rgb,
}

impl CoefficientAdjoint {
    /// Of the extinction alone.
    pub(crate) fn of_sigma_t(sigma_t: Rgb) -> Self {
        Self { sigma_t, ..Self::default() }
    }

    /// The change along rates of the coefficients.
    pub(crate) fn dot(&self, r: &CoefficientRates) -> Rgb {
        self.sigma_t * r.sigma_t + self.albedo * r.albedo + self.emission * r.emission
    }

    /// The channels summed with weights.
    pub(crate) fn weighted(&self, w: Rgb) -> CoefficientRates {
        CoefficientRates {
            sigma_t: self.sigma_t * w,
            albedo: self.albedo * w,
            emission: self.emission * w,
        }
    }
}

/// Which quantities any parameter (or gradient buffer) depends on: the rest is never computed.
#[derive(Clone, Debug, Default)]
pub(crate) struct ActiveInputs {
    /// Shapes that move.
    pub(crate) shapes: Vec<bool>,
    /// Media whose inside moves.
    pub(crate) volumes: Vec<bool>,
    /// Media whose coefficients change.
    pub(crate) media: Vec<bool>,
    /// Of those, the ones whose grids move.
    pub(crate) grids: Vec<bool>,
    pub(crate) bsdfs: Vec<bool>,
    /// BSDFs whose index of refraction changes, and turns light that goes on in a single direction.
    pub(crate) bending: Vec<bool>,
    pub(crate) emitters: Vec<bool>,
    /// Emitters whose place or direction changes.
    pub(crate) moving_emitters: Vec<bool>,
    pub(crate) sensor: bool,
}

impl ActiveInputs {
    /// True when a surface, an inside, an emitter, the camera or refracted light can move: what boundary terms need.
    pub(crate) fn moves_geometry(&self) -> bool {
        self.sensor
            || [&self.shapes, &self.volumes, &self.moving_emitters, &self.bending]
                .into_iter()
                .any(|l| l.contains(&true))
    }

    /// True when a point of matter moves.
    pub(crate) fn moves(&self, matter: &Matter) -> bool {
        match matter {
            Matter::Surface(point) => self.shapes[point.shape as usize],
            Matter::Volume(medium, _) => self.volumes[*medium],
        }
    }

    /// True when anything changes.
    pub(crate) fn any(&self) -> bool {
        let lists = [&self.shapes, &self.volumes, &self.media, &self.bsdfs, &self.emitters];
        self.sensor || lists.into_iter().any(|l| l.contains(&true))
    }
}

/// What texels stand for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum TextureUse {
    /// A property of a BSDF.
    Bsdf(usize, Property),
    /// The radiance of an emitter.
    Emitter(usize),
}

/// A receiver of sensitivities.
pub(crate) trait AdjointSink {
    /// What it depends on.
    fn active(&self) -> &ActiveInputs;
    /// Of a surface point.
    fn surface(&mut self, point: &MaterialPoint, adjoint: &SurfaceAdjoint);
    /// Of the position, and the volume Jacobian, of a material point inside a medium.
    fn volume(&mut self, medium: usize, x: Vec3, u: &RgbVec, j: Rgb);
    /// Of the velocity of a medium's grids at a point of space.
    fn grid(&mut self, medium: usize, x: Vec3, u: &RgbVec);
    /// Of a medium's coefficients at a point of space.
    fn medium(&mut self, medium: usize, x: Vec3, adjoint: &CoefficientAdjoint);
    /// Takes the derivative by the value of a medium's phase function at a point of space, whose gradient is given.
    fn phase(&mut self, medium: usize, x: Vec3, gradient: &PhaseGradient, adjoint: Rgb);
    /// Of the optical depth of a ray through a medium that varies in space.
    fn depth(&mut self, medium: usize, depth: &DepthEstimate<'_>, adjoint: Rgb);
    /// Of a material's parameters; `weight` multiplies channel by channel.
    fn bsdf(&mut self, bsdf: usize, params: &BsdfParams, weight: Rgb);
    /// Of a value that texels make up.
    fn texels(&mut self, of: TextureUse, footprint: &Footprint, adjoint: Rgb);
    /// Of an emitter, per channel.
    fn emitter(&mut self, emitter: usize, gradient: &[EmitterGradient; 3]);
    /// Of the camera, per channel.
    fn sensor(&mut self, gradient: &[SensorGradient; 3]);
}

/// Passes sensitivities on, multiplied channel by channel.
pub(crate) struct Scaled<'a> {
    pub(crate) sink: &'a mut dyn AdjointSink,
    pub(crate) by: Rgb,
}

impl AdjointSink for Scaled<'_> {
    fn active(&self) -> &ActiveInputs {
        self.sink.active()
    }

    fn surface(&mut self, point: &MaterialPoint, adjoint: &SurfaceAdjoint) {
        self.sink.surface(point, &adjoint.times(self.by));
    }

    fn volume(&mut self, medium: usize, x: Vec3, u: &RgbVec, j: Rgb) {
        self.sink.volume(medium, x, &(*u * self.by), j * self.by);
    }

    fn grid(&mut self, medium: usize, x: Vec3, u: &RgbVec) {
        self.sink.grid(medium, x, &(*u * self.by));
    }

    fn medium(&mut self, medium: usize, x: Vec3, adjoint: &CoefficientAdjoint) {
        let CoefficientAdjoint { sigma_t, albedo, emission } = *adjoint;
        let [sigma_t, albedo, emission] = [sigma_t, albedo, emission].map(|v| v * self.by);
        self.sink.medium(medium, x, &CoefficientAdjoint { sigma_t, albedo, emission });
    }

    fn phase(&mut self, medium: usize, x: Vec3, gradient: &PhaseGradient, adjoint: Rgb) {
        self.sink.phase(medium, x, gradient, adjoint * self.by);
    }

    fn depth(&mut self, medium: usize, depth: &DepthEstimate<'_>, adjoint: Rgb) {
        self.sink.depth(medium, depth, adjoint * self.by);
    }

    fn bsdf(&mut self, bsdf: usize, params: &BsdfParams, weight: Rgb) {
        self.sink.bsdf(bsdf, params, weight * self.by);
    }

    fn texels(&mut self, of: TextureUse, footprint: &Footprint, adjoint: Rgb) {
        self.sink.texels(of, footprint, adjoint * self.by);
    }

    fn emitter(&mut self, emitter: usize, gradient: &[EmitterGradient; 3]) {
        let by = self.by.to_array();
        self.sink.emitter(emitter, &core::array::from_fn(|c| gradient[c].scaled(by[c])));
    }

    fn sensor(&mut self, gradient: &[SensorGradient; 3]) {
        let by = self.by.to_array();
        self.sink.sensor(&core::array::from_fn(|c| gradient[c].scaled(by[c])));
    }
}

/// A weighted sum of velocities: what boundary and flux terms depend on besides light.
#[derive(Clone, Debug, Default)]
pub(crate) struct VelocityFunctional {
    pub(crate) items: Vec<VelocityTerm>,
}

/// A summand of a [`VelocityFunctional`].
#[derive(Clone, Copy, Debug)]
pub(crate) enum VelocityTerm {
    /// Velocity of a surface point, dotted with a vector.
    Surface(MaterialPoint, Vec3),
    /// Velocity of the inside of a medium at a point, dotted with a vector.
    Volume(usize, Vec3, Vec3),
    /// Velocity of a medium's grids at a point, dotted with a vector.
    Grid(usize, Vec3, Vec3),
    /// Change of an emitter.
    Emitter(usize, EmitterGradient),
    /// Change of the camera.
    Sensor(SensorGradient),
}

impl VelocityFunctional {
    /// Sends `weight` times the functional to a sink: the derivative of (weight × functional).
    pub(crate) fn send<S: AdjointSink>(&self, weight: Rgb, sink: &mut S) {
        self.items.iter().for_each(|item| item.send(weight, sink));
    }
}

impl VelocityTerm {
    /// Of a point, dotted with a vector.
    pub(crate) fn of(matter: Matter, n: Vec3) -> Self {
        match matter {
            Matter::Surface(point) => Self::Surface(point, n),
            Matter::Volume(medium, x) => Self::Volume(medium, x, n),
        }
    }

    /// Sends `weight` times the rate to a sink.
    pub(crate) fn send<S: AdjointSink>(&self, weight: Rgb, sink: &mut S) {
        match *self {
            Self::Surface(point, n) => {
                let u = weight.outer(n);
                sink.surface(&point, &SurfaceAdjoint::of_place(u));
            }
            Self::Volume(medium, x, n) => sink.volume(medium, x, &weight.outer(n), Rgb::ZERO),
            Self::Grid(medium, x, n) => sink.grid(medium, x, &weight.outer(n)),
            Self::Emitter(e, g) => sink.emitter(e, &weight.to_array().map(|w| g.scaled(w))),
            Self::Sensor(g) => sink.sensor(&weight.to_array().map(|w| g.scaled(w))),
        }
    }
}
