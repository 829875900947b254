use alloc::sync::Arc;
use alloc::vec;
use alloc::vec::Vec;

use drt_math::{Affine, Rgb, Vec3};

use crate::{
    CoefficientRates, Crossing, DepthEstimate, FieldTangent, FlakesGradient, Flow, FlowBasis, Grid,
    Medium, MediumTangent, PhaseGradient, Property, VoxelGradient,
};

/// Derivative of a loss with respect to one coefficient field: the transpose of [`FieldTangent`].
#[derive(Clone, Debug, Default, PartialEq)]
pub struct FieldGradient {
    /// With respect to a term added everywhere in the medium.
    pub uniform: Rgb,
    /// The derivative with respect to the logarithm of a common factor, as far as no voxels tell it.
    relative: f64,
    /// The derivative with respect to the voxels' values after a density's scale; `None` for a constant.
    pub voxels: Option<VoxelGradient>,
}

/// Derivative of a loss with respect to the velocities of nodes: the transpose of [`Flow`].
#[derive(Clone, Debug)]
pub struct FlowGradient {
    /// Whose nodes they are.
    pub basis: Arc<dyn FlowBasis>,
    /// With respect to the velocity of each node.
    pub nodes: Vec<Vec3>,
}

impl PartialEq for FlowGradient {
    fn eq(&self, o: &Self) -> bool {
        Arc::ptr_eq(&self.basis, &o.basis) && self.nodes == o.nodes
    }
}

impl FlowGradient {
    fn scatter(&mut self, x: Vec3, adjoint: Vec3) {
        self.basis.weights(x).scatter(adjoint, &mut self.nodes);
    }

    fn dot(&self, flow: &Flow) -> Option<f64> {
        let products = self.nodes.iter().zip(&*flow.nodes).map(|(g, v)| g.dot(*v));
        Arc::ptr_eq(&self.basis, &flow.basis).then(|| products.sum())
    }
}

/// Derivative of a loss with respect to everything a [`MediumTangent`] can change.
#[derive(Clone, Debug, PartialEq)]
pub struct MediumGradient {
    /// Derivative with respect to the extinction, with the albedo held.
    pub sigma_t: FieldGradient,
    /// Derivative with respect to the albedo, with the extinction held.
    pub albedo: FieldGradient,
    /// Derivative with respect to the emitted radiance.
    pub emission: FieldGradient,
    /// Derivative with respect to the phase function's mean cosine.
    pub g: FieldGradient,
    /// Derivative with respect to the weight of a blend of phase functions.
    pub weight: FieldGradient,
    /// Derivative with respect to the entries of the matrix of SGGX, on the diagonal and off it, as they were before any
    /// motion.
    pub flakes: [FieldGradient; 2],
    /// Derivative with respect to the coefficients of the grids' velocity field.
    pub velocity: Affine,
    /// Derivative with respect to the velocities of nodes, where there is room for them.
    pub flow: Option<FlowGradient>,
    /// True where motions of the grids are left out.
    at_rest: bool,
}

impl FieldGradient {
    /// The derivative with respect to the logarithm of a common factor.
    #[must_use]
    pub fn relative(&self) -> f64 {
        self.relative + self.voxels.as_ref().map_or(0.0, VoxelGradient::relative)
    }

    fn scatter(&mut self, field: Rgb, grid: Option<&Grid>, x: Vec3, adjoint: Rgb) {
        if adjoint.is_zero() {
            return;
        }
        self.uniform += adjoint;
        match grid {
            Some(grid) if self.voxels.is_some() => self.scatter_voxels(grid, x, adjoint),
            _ => self.relative += field.dot(adjoint),
        }
    }

    fn scatter_voxels(&mut self, grid: &Grid, x: Vec3, adjoint: Rgb) {
        if let Some(voxels) = &mut self.voxels {
            voxels.add_at(grid.from_world().point(x), adjoint);
        }
    }

    fn dot(&self, tangent: &FieldTangent) -> f64 {
        let voxels = if tangent.voxels.is_empty() {
            0.0
        } else {
            self.voxels.as_ref().expect("room for voxels").dot(&tangent.voxels)
        };
        let by_factor = match tangent.relative {
            0.0 => 0.0,
            relative => self.relative() * relative,
        };
        self.uniform.dot(tangent.uniform) + by_factor + voxels
    }

    fn add(&mut self, o: Self) {
        self.uniform += o.uniform;
        self.relative += o.relative;
        match (&mut self.voxels, o.voxels) {
            (Some(sum), Some(voxels)) => sum.add(voxels),
            (sum @ None, voxels) => *sum = voxels,
            (Some(_), None) => {}
        }
    }
}

impl MediumGradient {
    /// No derivative yet, with room for every voxel of the medium.
    #[must_use]
    pub fn zeros(medium: &Medium) -> Self {
        let of = |property| {
            let zeros = |grid| VoxelGradient::zeros(grid, medium.voxel_scale(property));
            FieldGradient { voxels: medium.voxels(property).map(zeros), ..Default::default() }
        };
        Self {
            sigma_t: of(Property::SigmaT),
            albedo: of(Property::Albedo),
            emission: of(Property::Emission),
            g: of(Property::G),
            weight: of(Property::Weight),
            flakes: [Property::SggxDiagonal, Property::SggxOffDiagonal].map(of),
            velocity: Affine::ZERO,
            flow: None,
            at_rest: false,
        }
    }

    /// The derivative with respect to a property.
    #[must_use]
    pub fn field(&self, property: Property) -> &FieldGradient {
        match property {
            Property::SigmaT => &self.sigma_t,
            Property::Albedo => &self.albedo,
            Property::Emission => &self.emission,
            Property::G => &self.g,
            Property::Weight => &self.weight,
            Property::SggxDiagonal => &self.flakes[0],
            Property::SggxOffDiagonal => &self.flakes[1],
        }
    }

    /// No derivative yet, without room for voxels: for media none of whose parameters names a
    /// voxel.
    #[must_use]
    pub fn zeros_without_voxels() -> Self {
        let [sigma_t, albedo, emission, g, weight] = Default::default();
        let flakes = Default::default();
        let (velocity, flow, at_rest) = (Affine::ZERO, None, false);
        Self { sigma_t, albedo, emission, g, weight, flakes, velocity, flow, at_rest }
    }

    /// This gradient without what motions of the grids change: nothing of that is computed or added up.
    #[must_use]
    pub fn at_rest(mut self) -> Self {
        self.at_rest = true;
        self
    }

    /// The same with room for the velocities of `nodes` nodes.
    #[must_use]
    pub fn with_flow(mut self, basis: Arc<dyn FlowBasis>, nodes: usize) -> Self {
        self.flow = Some(FlowGradient { basis, nodes: vec![Vec3::ZERO; nodes] });
        self
    }

    /// Adds the derivatives of a loss with respect to the coefficients at the point x of the world:
    /// the exact transpose of [`MediumTangent::rates`].
    pub fn scatter(&mut self, medium: &Medium, x: Vec3, adjoint: &CoefficientRates) {
        let Some((grids, at)) = medium.volumes_at(x) else { return };
        let c = medium.coefficients(x);
        self.sigma_t.scatter(c.sigma_t, grids[0], at, adjoint.sigma_t);
        self.albedo.scatter(c.albedo, grids[1], at, adjoint.albedo);
        self.emission.scatter(c.emission, grids[2], at, adjoint.emission);
        if !self.at_rest && grids.iter().any(Option::is_some) {
            let g = medium.gradients(x);
            let pull = g.sigma_t.weighted(adjoint.sigma_t)
                + g.albedo.weighted(adjoint.albedo)
                + g.emission.weighted(adjoint.emission);
            self.scatter_velocity(x, -pull);
        }
    }

    /// Adds the derivative of a loss with respect to the phase function's value, for one pair of directions, at the point x of
    /// the world: the transpose of [`MediumTangent::phase_rate`].
    pub fn scatter_phase(
        &mut self,
        medium: &Medium,
        x: Vec3,
        gradient: &PhaseGradient,
        adjoint: f64,
    ) {
        for (own, property, by) in [
            (&mut self.g, Property::G, gradient.g),
            (&mut self.weight, Property::Weight, gradient.weight),
        ] {
            if by != 0.0 {
                let here = medium.phase_at(x);
                let grid = medium.phase.voxels(property);
                let adjoint = Rgb::new(by * adjoint, 0.0, 0.0);
                own.scatter(Rgb::splat(here.number()), grid, here.looked_up(), adjoint);
            }
        }
        if gradient.place != Vec3::ZERO {
            self.scatter_velocity(x, gradient.place * -adjoint);
        }
        if medium.phase.sggx().is_some() {
            self.scatter_flakes(medium, x, &gradient.flakes, adjoint);
            self.scatter_spin(gradient.turn * adjoint);
        }
    }

    /// The transpose of [`MediumTangent::flakes_rate`].
    fn scatter_flakes(&mut self, medium: &Medium, x: Vec3, by: &FlakesGradient, adjoint: f64) {
        let Some(field) = medium.phase.sggx() else { return };
        let at = medium.phase_place(x);
        let parts = field.entries().iter().zip(field.by_values(by));
        for (own, (entries, by)) in self.flakes.iter_mut().zip(parts) {
            own.scatter(entries.value(at), entries.grid(), at, by * adjoint);
        }
    }

    /// Adds the derivative of a loss with respect to the [spin](crate::tangent::spin) of the grids.
    fn scatter_spin(&mut self, adjoint: Vec3) {
        if self.at_rest {
            return;
        }
        let half = adjoint * 0.5;
        for (col, axis) in self.velocity.linear.cols.iter_mut().zip([Vec3::X, Vec3::Y, Vec3::Z]) {
            *col += half.cross(axis);
        }
    }

    /// Adds the derivative of a loss with respect to the optical depth that a crossing's motion
    /// changes: the transpose of [`Crossing::depth_rate`].
    pub fn scatter_crossing(&mut self, crossing: &Crossing, x: Vec3, adjoint: Rgb) {
        self.scatter_velocity(x, crossing.depth_per_velocity().weighted(adjoint));
    }

    /// Adds the derivative of a loss with respect to a ray's optical depth: the transpose of
    /// [`DepthEstimate::rate`].
    pub fn scatter_depth(&mut self, medium: &Medium, depth: &DepthEstimate<'_>, adjoint: Rgb) {
        let sigma_t = &mut self.sigma_t;
        sigma_t.uniform += adjoint * depth.length;
        if sigma_t.voxels.is_some() {
            for (grid, material, w) in depth.points_inside(medium) {
                sigma_t.scatter_voxels(grid.density(), material, adjoint * w);
            }
        } else {
            sigma_t.relative += depth.depth().dot(adjoint);
        }
        if medium.phase.sggx().is_some() {
            depth.by_flakes(medium, |x, by, weight| {
                self.scatter_flakes(medium, x, by, weight.dot(adjoint));
            });
            self.scatter_spin(depth.by_spin().weighted(adjoint));
        }
        if self.at_rest {
            return;
        }
        if let Some(flow) = &mut self.flow {
            depth.pulls(medium, |x, pull| flow.scatter(x, pull.weighted(adjoint)));
        }
        let turn = -depth.moment.weighted(adjoint);
        self.scatter_affine(depth.ray.origin, -depth.gradient.weighted(adjoint));
        for (col, w) in self.velocity.linear.cols.iter_mut().zip(depth.ray.dir.to_array()) {
            *col += turn * w;
        }
    }

    /// Adds the derivative of a loss with respect to the velocity of the grid's point at x.
    pub fn scatter_velocity(&mut self, x: Vec3, adjoint: Vec3) {
        if self.at_rest {
            return;
        }
        self.scatter_affine(x, adjoint);
        if let Some(flow) = &mut self.flow {
            flow.scatter(x, adjoint);
        }
    }

    fn scatter_affine(&mut self, x: Vec3, adjoint: Vec3) {
        let v = &mut self.velocity;
        v.translation += adjoint;
        for (col, x) in v.linear.cols.iter_mut().zip(x.to_array()) {
            *col += adjoint * x;
        }
    }

    /// The derivative of the loss along a tangent.
    ///
    /// # Panics
    /// When the tangent names voxels, or flows, and this gradient was made without room for them, or
    /// for another medium.
    #[must_use]
    pub fn dot(&self, tangent: &MediumTangent) -> f64 {
        let (a, b) = (&self.velocity, &tangent.velocity);
        let linear = (0..3).map(|k| a.linear.cols[k].dot(b.linear.cols[k])).sum::<f64>();
        let flow = |flow| self.flow.as_ref().and_then(|own| own.dot(flow));
        let flows = tangent.flows.iter().map(|f| flow(f).expect("room for the flow's nodes"));
        self.sigma_t.dot(&tangent.sigma_t)
            + self.albedo.dot(&tangent.albedo)
            + self.emission.dot(&tangent.emission)
            + self.g.dot(&tangent.g)
            + self.weight.dot(&tangent.weight)
            + self.flakes.iter().zip(&tangent.flakes).map(|(g, t)| g.dot(t)).sum::<f64>()
            + linear
            + flows.sum::<f64>()
            + a.translation.dot(b.translation)
    }

    /// Adds another gradient of the same medium: for sums over threads.
    pub fn add(&mut self, o: Self) {
        self.sigma_t.add(o.sigma_t);
        self.albedo.add(o.albedo);
        self.emission.add(o.emission);
        self.g.add(o.g);
        self.weight.add(o.weight);
        self.flakes.iter_mut().zip(o.flakes).for_each(|(own, other)| own.add(other));
        self.velocity = self.velocity.plus(&o.velocity);
        if let (Some(a), Some(b)) = (&mut self.flow, o.flow) {
            a.nodes.iter_mut().zip(&b.nodes).for_each(|(a, b)| *a += *b);
        }
    }
}
