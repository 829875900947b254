//! How large the gradients of boundary samples are, for their guides.
//!
//! There is one number that all quantities' gradients count for: the squared norm of what a sample adds to velocities (of points, of lights,
//! of the camera), each of which is moved by a few vertices, or by one item.

use drt_math::{Rgb, RgbVec, Vec3};
use drt_medium::{DepthEstimate, PhaseGradient};

use crate::derivative::sensitivity::{
    ActiveInputs, AdjointSink, CoefficientAdjoint, SurfaceAdjoint, TextureUse, VelocityFunctional,
};
use crate::model::emitter::EmitterGradient;
use crate::model::sensor::SensorGradient;
use crate::model::surface::BsdfParams;
use crate::model::texture::Footprint;
use crate::terms::boundary_segments::BoundarySink;
use crate::terms::guiding::Sizes;
use crate::world::vertex::MaterialPoint;

/// Reverse mode: how large the gradient is by what is wanted.
pub(super) struct OfGradient<'a> {
    norm: SquaredNorm<'a>,
    adjoint: &'a [Rgb],
    /// What the last functional was received for, weighted by the adjoint.
    weight: f64,
    square: f64,
}

/// The sum of the squares of sensitivities in the first channel.
pub(super) struct SquaredNorm<'a> {
    active: &'a ActiveInputs,
    sum: f64,
}

impl<'a> OfGradient<'a> {
    /// `adjoint` is that of each pixel.
    pub(super) fn new(active: &'a ActiveInputs, adjoint: &'a [Rgb]) -> Self {
        Self { norm: SquaredNorm { active, sum: 0.0 }, adjoint, weight: 0.0, square: 0.0 }
    }

    fn flush(&mut self) {
        self.square += self.weight * self.weight * self.norm.sum;
        self.weight = 0.0;
    }
}

impl<'a> BoundarySink for OfGradient<'a> {
    type Sink = SquaredNorm<'a>;

    fn moves(&mut self, functional: &VelocityFunctional) -> bool {
        self.flush();
        self.norm.sum = 0.0;
        functional.send(Rgb::new(1.0, 0.0, 0.0), &mut self.norm);
        self.norm.sum > 0.0
    }

    fn receive(&mut self, pixel: u32, value: Rgb) {
        self.weight += self.adjoint[pixel as usize].dot(value);
    }

    fn spread(&mut self, _: &[(u32, f64)], _: impl FnOnce(&mut SquaredNorm<'a>)) -> bool {
        true
    }
}

impl Sizes for OfGradient<'_> {
    fn derivatives(&self) -> usize {
        1
    }

    fn take(&mut self, squares: &mut [f64]) {
        self.flush();
        squares[0] = core::mem::take(&mut self.square);
    }
}

impl AdjointSink for SquaredNorm<'_> {
    fn active(&self) -> &ActiveInputs {
        self.active
    }

    fn surface(&mut self, point: &MaterialPoint, adjoint: &SurfaceAdjoint) {
        if self.active.shapes[point.shape as usize] {
            self.sum += adjoint.u.r.length_squared();
        }
    }

    fn volume(&mut self, medium: usize, _: Vec3, u: &RgbVec, _: Rgb) {
        if self.active.volumes[medium] {
            self.sum += u.r.length_squared();
        }
    }

    fn grid(&mut self, medium: usize, _: Vec3, u: &RgbVec) {
        if self.active.grids[medium] {
            self.sum += u.r.length_squared();
        }
    }

    fn emitter(&mut self, emitter: usize, [gradient, ..]: &[EmitterGradient; 3]) {
        if self.active.emitters[emitter] {
            self.sum += gradient.position.length_squared() + gradient.direction.length_squared();
        }
    }

    fn sensor(&mut self, [gradient, ..]: &[SensorGradient; 3]) {
        if self.active.sensor {
            let SensorGradient { position, right, up, forward, pixel_size, principal, .. } =
                gradient;
            let axes = [position, right, up, forward].map(|v| v.length_squared());
            let [a, b] = principal;
            let lens = [*pixel_size, *a, *b, gradient.aperture_radius, gradient.focus_distance];
            self.sum += axes.iter().sum::<f64>() + lens.iter().map(|v| v * v).sum::<f64>();
        }
    }

    // Boundary samples have none of these.
    fn medium(&mut self, _: usize, _: Vec3, _: &CoefficientAdjoint) {}
    fn phase(&mut self, _: usize, _: Vec3, _: &PhaseGradient, _: Rgb) {}
    fn depth(&mut self, _: usize, _: &DepthEstimate<'_>, _: Rgb) {}
    fn bsdf(&mut self, _: usize, _: &BsdfParams, _: Rgb) {}
    fn texels(&mut self, _: TextureUse, _: &Footprint, _: Rgb) {}
}
