//! Where a gradient's sensitivities are added up.

use drt_math::{Rgb, RgbVec, Vec3};
use drt_medium::{CoefficientRates, DepthEstimate, PhaseGradient};
use drt_motion::surface::JetAdjoint;
use drt_motion::volume::VolumeAdjoint;

use crate::derivative::medium_motion::{InteriorGradients, ReverseMediumMotions};
use crate::derivative::scene_gradient::SceneGradient;
use crate::derivative::sensitivity::{
    ActiveInputs, AdjointSink, CoefficientAdjoint, SurfaceAdjoint, TextureUse, VelocityFunctional,
};
use crate::model::emitter::EmitterGradient;
use crate::model::sensor::SensorGradient;
use crate::model::surface::BsdfParams;
use crate::model::texture::Footprint;
use crate::run::gradient::everything::Everything;
use crate::terms::boundary_segments::BoundarySink;
use crate::terms::interior::PathSink;
use crate::world::World;
use crate::world::vertex::MaterialPoint;

/// What some samples add to a gradient.
pub(super) struct Sums {
    pub(super) scene: SceneGradient,
    pub(super) insides: InteriorGradients,
}

impl Sums {
    pub(super) fn zeros(world: &World, of: &Everything) -> Self {
        Self { scene: SceneGradient::zeros(world, &of.active), insides: of.insides.zeros() }
    }

    pub(super) fn add(&mut self, other: Self) {
        self.scene.add(other.scene);
        self.insides.add(&other.insides);
    }
}

/// Adds sensitivities, weighted by the pixel's adjoint, to the gradient of everything.
pub(crate) struct ScatterSink<'a> {
    pub(super) world: &'a World,
    pub(super) active: &'a ActiveInputs,
    pub(super) insides: &'a ReverseMediumMotions,
    pub(super) weights: Rgb,
    pub(super) sums: Sums,
}

#[cfg(all(test, feature = "std"))]
impl<'a> ScatterSink<'a> {
    /// To what is not inside of media.
    pub(crate) fn of_surfaces(world: &'a World, active: &'a ActiveInputs, weights: Rgb) -> Self {
        let insides =
            alloc::boxed::Box::leak(alloc::boxed::Box::new(ReverseMediumMotions::at_rest(world)));
        let sums = Sums { scene: SceneGradient::zeros(world, active), insides: insides.zeros() };
        Self { world, active, insides, weights, sums }
    }

    pub(crate) fn into_gradient(self) -> SceneGradient {
        self.sums.scene
    }
}

impl AdjointSink for ScatterSink<'_> {
    fn active(&self) -> &ActiveInputs {
        self.active
    }

    fn surface(&mut self, point: &MaterialPoint, adjoint: &SurfaceAdjoint) {
        let shape = point.shape as usize;
        let Some(gradient) = &mut self.sums.scene.shapes[shape] else { return };
        let w = self.weights;
        let jet = JetAdjoint {
            u: adjoint.u.weighted(w),
            n: adjoint.n.weighted(w),
            ns: adjoint.ns.weighted(w),
            j: adjoint.j.dot(w),
        };
        if !(jet.u.is_finite() && jet.n.is_finite() && jet.ns.is_finite() && jet.j.is_finite()) {
            self.sums.scene.non_finite += 1;
            return;
        }
        gradient.scatter(&self.world.scene.shapes[shape].mesh, &point.at, &jet);
    }

    fn volume(&mut self, medium: usize, x: Vec3, u: &RgbVec, j: Rgb) {
        let adjoint = VolumeAdjoint { u: u.weighted(self.weights), j: j.dot(self.weights) };
        if adjoint.u.is_finite() && adjoint.j.is_finite() {
            self.insides.scatter(medium, x, &adjoint, &mut self.sums.insides);
        } else {
            self.sums.scene.non_finite += 1;
        }
    }

    fn grid(&mut self, medium: usize, x: Vec3, u: &RgbVec) {
        let Some(gradient) = &mut self.sums.scene.media[medium] else { return };
        let u = u.weighted(self.weights);
        if u.is_finite() {
            gradient.scatter_velocity(x, u);
        } else {
            self.sums.scene.non_finite += 1;
        }
    }

    fn medium(&mut self, medium: usize, x: Vec3, adjoint: &CoefficientAdjoint) {
        let Some(gradient) = &mut self.sums.scene.media[medium] else { return };
        let rates = adjoint.weighted(self.weights);
        if is_finite(&rates) {
            gradient.scatter(self.world.medium(medium), x, &rates);
        } else {
            self.sums.scene.non_finite += 1;
        }
    }

    fn phase(&mut self, medium: usize, x: Vec3, gradient: &PhaseGradient, adjoint: Rgb) {
        let Some(sum) = &mut self.sums.scene.media[medium] else { return };
        let adjoint = adjoint.dot(self.weights);
        if adjoint.is_finite() {
            sum.scatter_phase(self.world.medium(medium), x, gradient, adjoint);
        } else {
            self.sums.scene.non_finite += 1;
        }
    }

    fn depth(&mut self, medium: usize, depth: &DepthEstimate<'_>, adjoint: Rgb) {
        let Some(gradient) = &mut self.sums.scene.media[medium] else { return };
        let adjoint = adjoint * self.weights;
        if adjoint.is_finite() {
            gradient.scatter_depth(self.world.medium(medium), depth, adjoint);
        } else {
            self.sums.scene.non_finite += 1;
        }
    }

    fn bsdf(&mut self, bsdf: usize, params: &BsdfParams, weight: Rgb) {
        if let Some(gradient) = &mut self.sums.scene.bsdfs[bsdf] {
            gradient.scatter(params, weight * self.weights);
        }
    }

    fn texels(&mut self, of: TextureUse, footprint: &Footprint, adjoint: Rgb) {
        let adjoint = adjoint * self.weights;
        if !adjoint.is_finite() {
            self.sums.scene.non_finite += 1;
            return;
        }
        let sums = &mut self.sums.scene;
        let gradient = match of {
            TextureUse::Bsdf(bsdf, property) => {
                let mut textures = sums.texels[bsdf].iter_mut();
                textures.find(|(p, _)| *p == property).map(|(_, gradient)| gradient)
            }
            TextureUse::Emitter(emitter) => sums.emitter_texels[emitter].as_mut(),
        };
        if let Some(gradient) = gradient {
            gradient.scatter(footprint, adjoint);
        }
    }

    fn emitter(&mut self, emitter: usize, gradient: &[EmitterGradient; 3]) {
        if let Some(sum) = &mut self.sums.scene.emitters[emitter] {
            for (g, w) in gradient.iter().zip(self.weights.to_array()) {
                *sum += g.scaled(w);
            }
        }
    }

    fn sensor(&mut self, gradient: &[SensorGradient; 3]) {
        if let Some(sum) = &mut self.sums.scene.sensor {
            for (g, w) in gradient.iter().zip(self.weights.to_array()) {
                *sum += g.scaled(w);
            }
        }
    }
}

impl PathSink for ScatterSink<'_> {
    fn begin(&mut self) {}
    fn finish(&mut self, _: &mut [Rgb]) {}
    fn functional(&mut self, f: &VelocityFunctional, value: Rgb, _: &mut [Rgb]) {
        f.send(value, self);
    }
    fn layers(&self) -> usize {
        0
    }
}

/// Collects what a boundary sample splats and scatters its functional once.
pub(super) struct ToGradient<'a> {
    pub(super) scatter: ScatterSink<'a>,
    pub(super) adjoint: &'a [Rgb],
    pub(super) functional: VelocityFunctional,
    pub(super) weight: f64,
    pub(super) scale: f64,
}

impl ToGradient<'_> {
    pub(super) fn flush(&mut self) {
        if self.weight != 0.0 {
            self.scatter.weights = Rgb::new(self.weight, 0.0, 0.0);
            self.functional.send(Rgb::new(1.0, 0.0, 0.0), &mut self.scatter);
            self.weight = 0.0;
        }
    }
}

impl<'a> BoundarySink for ToGradient<'a> {
    fn moves(&mut self, functional: &VelocityFunctional) -> bool {
        self.flush();
        self.functional.clone_from(functional);
        true
    }

    fn receive(&mut self, pixel: u32, value: Rgb) {
        self.weight += self.adjoint[pixel as usize].dot(value) * self.scale;
    }

    type Sink = ScatterSink<'a>;

    fn spread(&mut self, pixels: &[(u32, f64)], send: impl FnOnce(&mut ScatterSink<'a>)) -> bool {
        self.flush();
        let weights = pixels.iter().map(|(pixel, weight)| self.adjoint[*pixel as usize] * *weight);
        self.scatter.weights = weights.fold(Rgb::ZERO, |sum, w| sum + w) * self.scale;
        send(&mut self.scatter);
        true
    }
}

fn is_finite(r: &CoefficientRates) -> bool {
    r.sigma_t.is_finite() && r.albedo.is_finite() && r.emission.is_finite()
}
