//! Forward mode: sensitivities contracted with the tangents of N parameters, one dot product each.

use alloc::vec::Vec;

use drt_math::{Rgb, RgbVec, Vec3};
use drt_medium::{
    CoefficientGradients, CoefficientRates, DepthEstimate, FlowPlace, MediumTangent, PhaseGradient,
};
use drt_motion::interior::BasisValues;

use crate::derivative::medium_motion::MediumMotions;
use crate::derivative::sensitivity::{
    ActiveInputs, AdjointSink, CoefficientAdjoint, SurfaceAdjoint, TextureUse, VelocityFunctional,
};
use crate::derivative::tangents::Tangents;
use crate::model::emitter::EmitterGradient;
use crate::model::sensor::SensorGradient;
use crate::model::surface::{BsdfParams, BsdfTangent, Property};
use crate::model::texture::Footprint;
use crate::world::vertex::MaterialPoint;
use crate::world::{ActiveFactors, MediumActivity, World};

/// Everything that changes with the parameters.
#[derive(Clone, Debug, Default)]
pub(crate) struct Motion {
    pub(crate) tangents: Tangents,
    pub(crate) insides: MediumMotions,
    pub(crate) active: ActiveInputs,
}

impl Motion {
    pub(crate) fn new(tangents: Tangents, insides: MediumMotions) -> Self {
        fn some<T>(lists: &[Vec<T>]) -> Vec<bool> {
            lists.iter().map(|l| !l.is_empty()).collect()
        }
        let mut bsdfs = some(&tangents.bsdfs);
        let bending = (0..tangents.bsdfs.len()).map(|b| tangents.bends(b)).collect();
        let mut emitters = some(&tangents.emitters);
        for change in &tangents.texels {
            match change.of {
                TextureUse::Bsdf(b, _) => bsdfs[b] = true,
                TextureUse::Emitter(e) => emitters[e] = true,
            }
        }
        let active = ActiveInputs {
            shapes: some(&tangents.shapes),
            volumes: some(&insides.velocities),
            media: some(&tangents.media),
            grids: tangents.media.iter().map(|l| l.iter().any(|(_, t)| t.moves_grids())).collect(),
            bsdfs,
            bending,
            emitters,
            moving_emitters: tangents
                .emitters
                .iter()
                .map(|l| l.iter().any(|(_, t)| t.moves()))
                .collect(),
            sensor: !tangents.sensor.is_empty(),
        };
        Self { tangents, insides, active }
    }

    /// What must be sampled even where it contributes nothing to the image.
    pub(crate) fn factors(&self) -> ActiveFactors {
        let need = |tangents: &Vec<(usize, MediumTangent)>| {
            let any = |f: fn(&MediumTangent) -> bool| tangents.iter().any(|(_, t)| f(t));
            if any(|t| !t.albedo.is_zero() || !t.emission.is_zero()) {
                MediumActivity::Vertices
            } else if any(|t| !t.sigma_t.is_zero()) {
                MediumActivity::Density
            } else {
                MediumActivity::Nothing
            }
        };
        type Changes = Vec<(usize, BsdfTangent)>;
        let roughens =
            |changes: &Changes| changes.iter().any(|(_, t)| !t.get(Property::Alpha).is_zero());
        let bends =
            |changes: &Changes| changes.iter().any(|(_, t)| !t.get(Property::Eta).is_zero());
        let mut factors = ActiveFactors {
            media: self.tangents.media.iter().map(need).collect(),
            bsdfs: self.active.bsdfs.clone(),
            extinctions: self
                .tangents
                .media
                .iter()
                .map(|l| l.iter().any(|(_, t)| !t.sigma_t.is_zero() || t.moves_grids()))
                .collect(),
            roughness: self.tangents.bsdfs.iter().map(roughens).collect(),
            index: self.tangents.bsdfs.iter().map(bends).collect(),
            moves: self.active.moves_geometry(),
        };
        for change in &self.tangents.texels {
            match change.of {
                TextureUse::Bsdf(bsdf, Property::Alpha) => factors.roughness[bsdf] = true,
                TextureUse::Bsdf(bsdf, Property::Eta) => factors.index[bsdf] = true,
                TextureUse::Bsdf(..) | TextureUse::Emitter(_) => {}
            }
        }
        factors
    }

    pub(crate) fn parameters(&self) -> usize {
        self.tangents.names.len()
    }
}

/// The derivative of one value by every parameter.
pub(crate) struct Contraction<'a> {
    pub(crate) world: &'a World,
    motion: &'a Motion,
    pub(crate) rates: Vec<Rgb>,
    /// What the field of an inside is like at the last point.
    basis: BasisValues,
    /// And that of the flow of grids.
    flow: FlowPlace,
    /// By medium, the rates of what is the same everywhere in it.
    uniform: Vec<Option<Vec<CoefficientRates>>>,
}

impl<'a> Contraction<'a> {
    pub(crate) fn new(world: &'a World, motion: &'a Motion) -> Self {
        let uniform = motion.tangents.media.iter().enumerate().map(|(m, tangents)| {
            let medium = world.medium(m);
            medium.homogeneous()?;
            Some(tangents.iter().map(|(_, t)| t.rates(medium, Vec3::ZERO)).collect())
        });
        Self {
            world,
            motion,
            rates: alloc::vec![Rgb::ZERO; motion.parameters()],
            basis: BasisValues::default(),
            flow: FlowPlace::default(),
            uniform: uniform.collect(),
        }
    }

    pub(crate) fn clear(&mut self) {
        self.rates.fill(Rgb::ZERO);
    }

    /// The rates of a functional, one number per parameter; false when all vanish.
    pub(crate) fn evaluate(&mut self, functional: &VelocityFunctional) -> bool {
        self.clear();
        functional.send(Rgb::new(1.0, 0.0, 0.0), self);
        self.rates.iter().any(|r| r.r != 0.0)
    }
}

impl AdjointSink for Contraction<'_> {
    fn active(&self) -> &ActiveInputs {
        &self.motion.active
    }

    fn surface(&mut self, point: &MaterialPoint, adjoint: &SurfaceAdjoint) {
        let tangents = &self.motion.tangents;
        if tangents.shapes[point.shape as usize].is_empty() {
            return;
        }
        let mesh = &self.world.scene.shapes[point.shape as usize].mesh;
        let element = drt_motion::surface::SurfaceElement::new(mesh, &point.at);
        for (p, motion) in tangents.felt_on(point.shape as usize, point.at.triangle) {
            let jet = motion.jet_of(&element);
            self.rates[*p] += adjoint.u.dot(jet.u)
                + adjoint.n.dot(jet.n_dot)
                + adjoint.ns.dot(jet.ns_dot)
                + adjoint.j * jet.j_dot;
        }
    }

    fn volume(&mut self, medium: usize, x: Vec3, u: &RgbVec, j: Rgb) {
        let insides = &self.motion.insides;
        let motions = &insides.velocities[medium];
        if let Some(basis) = &insides.bases[medium] {
            basis.evaluate(x, &mut self.basis);
        }
        for (p, motion) in motions {
            let jet = motion.jet(x, &self.basis);
            self.rates[*p] += u.dot(jet.u) + j * jet.j_dot;
        }
    }

    fn grid(&mut self, medium: usize, x: Vec3, u: &RgbVec) {
        for (p, tangent) in &self.motion.tangents.media[medium] {
            self.rates[*p] += u.dot(tangent.grid_velocity(x, &mut self.flow));
        }
    }

    fn medium(&mut self, medium: usize, x: Vec3, adjoint: &CoefficientAdjoint) {
        let tangents = &self.motion.tangents.media[medium];
        if let Some(uniform) = &self.uniform[medium] {
            for ((p, _), rates) in tangents.iter().zip(uniform) {
                self.rates[*p] += adjoint.dot(rates);
            }
            return;
        }
        if tangents.is_empty() {
            return;
        }
        let moves = self.motion.active.grids[medium];
        let medium = self.world.medium(medium);
        let coefficients = medium.coefficients(x);
        let gradients = if moves { medium.gradients(x) } else { CoefficientGradients::ZERO };
        for (p, tangent) in tangents {
            let velocity = tangent.grid_velocity(x, &mut self.flow);
            let rates = tangent.rates_given(medium, x, &coefficients, &gradients, velocity);
            self.rates[*p] += adjoint.dot(&rates);
        }
    }

    fn phase(&mut self, medium: usize, x: Vec3, gradient: &PhaseGradient, adjoint: Rgb) {
        let tangents = &self.motion.tangents.media[medium];
        let medium = self.world.medium(medium);
        for (p, tangent) in tangents {
            self.rates[*p] += adjoint * tangent.phase_rate(medium, x, gradient, &mut self.flow);
        }
    }

    fn depth(&mut self, medium: usize, depth: &DepthEstimate<'_>, adjoint: Rgb) {
        let tangents = &self.motion.tangents.media[medium];
        let medium = self.world.medium(medium);
        for (p, tangent) in tangents {
            self.rates[*p] += depth.rate_without_flows(medium, tangent) * adjoint;
        }
        if tangents.iter().all(|(_, t)| t.flows.is_empty()) {
            return;
        }
        let Self { rates, flow, .. } = self;
        depth.pulls(medium, |x, pull| {
            for (p, tangent) in tangents {
                rates[*p] += pull.dot(tangent.flow(x, flow)) * adjoint;
            }
        });
    }

    fn bsdf(&mut self, bsdf: usize, params: &BsdfParams, weight: Rgb) {
        for (p, tangent) in &self.motion.tangents.bsdfs[bsdf] {
            self.rates[*p] += params.dot(tangent) * weight;
        }
    }

    fn texels(&mut self, of: TextureUse, footprint: &Footprint, adjoint: Rgb) {
        for change in self.motion.tangents.texels.iter().filter(|t| t.of == of) {
            self.rates[change.parameter] += change.tangent.at(footprint) * adjoint;
        }
    }

    fn emitter(&mut self, emitter: usize, gradient: &[EmitterGradient; 3]) {
        for (p, tangent) in &self.motion.tangents.emitters[emitter] {
            let rates: [f64; 3] = core::array::from_fn(|c| gradient[c].dot(tangent));
            self.rates[*p] += Rgb::from(rates);
        }
    }

    fn sensor(&mut self, gradient: &[SensorGradient; 3]) {
        for (p, tangent) in &self.motion.tangents.sensor {
            let rates: [f64; 3] = core::array::from_fn(|c| gradient[c].dot(tangent));
            self.rates[*p] += Rgb::from(rates);
        }
    }
}
