use alloc::collections::BTreeMap;
use alloc::vec::Vec;

use drt_math::{Affine, Rgb, ValueChange, ValueMap, Vec3, vec3};

use crate::change::FieldChange;
use crate::{
    CoefficientGradients, CoefficientRates, Coefficients, FlakesGradient, Flow, FlowPlace, Grid,
    Medium, MediumChange, MediumError, PhaseGradient, Property,
};

/// Derivative of one coefficient field with respect to a parameter, at rest:
/// `uniform + relative × field + voxel values`.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct FieldTangent {
    /// The same everywhere in the medium.
    pub uniform: Rgb,
    /// In proportion to the field.
    pub relative: f64,
    /// At single voxels, interpolated like the grid's values (after a density's scale).
    pub voxels: BTreeMap<[usize; 3], Rgb>,
}

/// Derivative of a medium with respect to one parameter, at the medium's present state.
///
/// Tangents are linear; those of several changes by the same parameter add up with
/// [`MediumTangent::plus`], each first carried through the changes that came after it with
/// [`MediumTangent::push_through`].
#[derive(Clone, Debug, PartialEq)]
pub struct MediumTangent {
    /// Rate of the extinction, with the albedo held.
    pub sigma_t: FieldTangent,
    /// Rate of the albedo, with the extinction held.
    pub albedo: FieldTangent,
    /// Rate of the emitted radiance.
    pub emission: FieldTangent,
    /// Rate of the phase function's mean cosine.
    pub g: FieldTangent,
    /// Rate of the weight of a blend of phase functions.
    pub weight: FieldTangent,
    /// Rates of the entries of the matrix of SGGX, on the diagonal and off it, as they were before any motion.
    pub flakes: [FieldTangent; 2],
    /// Velocity field of the grids, in world coordinates.
    pub velocity: Affine,
    /// Further velocities of the grids, which add up.
    pub flows: Vec<Flow>,
}

impl FieldTangent {
    /// True when nothing changes.
    #[must_use]
    pub fn is_zero(&self) -> bool {
        self.uniform.is_zero() && self.relative == 0.0 && self.voxels.values().all(|v| v.is_zero())
    }

    fn add(&mut self, o: &Self) {
        self.uniform += o.uniform;
        self.relative += o.relative;
        for (voxel, v) in &o.voxels {
            *self.voxels.entry(*voxel).or_default() += *v;
        }
    }

    /// The tangent of `change` at theta, once it has been carried out. `present` is the changed
    /// value of the voxel it names.
    fn of(change: &FieldChange, theta: f64, present: Rgb) -> Result<Self, MediumError> {
        let mut tangent = Self::default();
        let relative = relative_rate(change.property, &change.op, theta)?;
        match (change.op, change.voxel) {
            (op, Some(v)) => {
                tangent.voxels.insert(v, op.rate(present, theta));
            }
            (ValueChange::Add(a), None) => tangent.uniform = a,
            (_, None) => tangent.relative = relative,
        }
        Ok(tangent)
    }

    /// Chain rule through a later change `f -> factor f + term` of all voxels or one. The part in
    /// proportion to the field refers to the field as it is then, so terms must be taken off it.
    fn push_through(&mut self, later: &FieldChange, theta: f64) {
        let ValueMap { factor, offset } = later.op.map(theta);
        let taken = offset * -self.relative;
        match later.voxel {
            None => {
                self.uniform = self.uniform * factor + taken;
                for v in self.voxels.values_mut() {
                    *v *= factor;
                }
            }
            Some(voxel) => {
                let own = self.voxels.entry(voxel).or_default();
                *own = *own * factor + self.uniform * (factor - 1.0) + taken;
            }
        }
    }

    #[inline]
    fn rate(&self, field: Rgb, grid: Option<&Grid>, x: Vec3) -> Rgb {
        let mut rate = self.uniform + field * self.relative;
        if let Some(grid) = grid.filter(|_| !self.voxels.is_empty()) {
            rate += self.voxel_rate(grid, x);
        }
        rate
    }

    /// The part of the rate that single voxels have in it.
    pub(crate) fn voxel_rate(&self, grid: &Grid, x: Vec3) -> Rgb {
        let cell = grid.cell(grid.from_world().point(x));
        let mut rate = Rgb::ZERO;
        for (voxel, w) in cell.voxels().iter().zip(cell.weights()) {
            if let Some(v) = self.voxels.get(voxel) {
                rate += *v * w;
            }
        }
        rate
    }
}

fn relative_rate(property: Property, op: &ValueChange, theta: f64) -> Result<f64, MediumError> {
    let rate = op.relative_rate(theta);
    if rate.is_finite() { Ok(rate) } else { Err(MediumError::VanishingFactor { property }) }
}

impl MediumTangent {
    /// Nothing changes.
    #[must_use]
    pub fn zero() -> Self {
        Self {
            sigma_t: FieldTangent::default(),
            albedo: FieldTangent::default(),
            emission: FieldTangent::default(),
            g: FieldTangent::default(),
            weight: FieldTangent::default(),
            flakes: Default::default(),
            velocity: Affine::ZERO,
            flows: Vec::new(),
        }
    }

    /// True when nothing changes.
    #[must_use]
    pub fn is_zero(&self) -> bool {
        self.sigma_t.is_zero()
            && self.albedo.is_zero()
            && self.emission.is_zero()
            && self.g.is_zero()
            && self.weight.is_zero()
            && self.flakes.iter().all(FieldTangent::is_zero)
            && !self.moves_grids()
    }

    /// The sum of two tangents.
    #[must_use]
    pub fn plus(mut self, o: &Self) -> Self {
        self.sigma_t.add(&o.sigma_t);
        self.albedo.add(&o.albedo);
        self.emission.add(&o.emission);
        self.g.add(&o.g);
        self.weight.add(&o.weight);
        self.flakes.iter_mut().zip(&o.flakes).for_each(|(own, other)| own.add(other));
        self.velocity = self.velocity.plus(&o.velocity);
        for flow in &o.flows {
            if !self.flows.iter_mut().any(|own| own.add(flow)) {
                self.flows.push(flow.clone());
            }
        }
        self
    }

    /// Chain rule: this tangent after a later change, made at theta, has acted on the medium too.
    pub fn push_through(&mut self, later: &MediumChange, theta: f64) {
        match later {
            MediumChange::Place { map, .. } => {
                let turn = Affine { linear: map.linear, translation: Vec3::ZERO };
                self.velocity = turn.after(&self.velocity).after(&map.inverse());
                self.flows.iter_mut().for_each(|flow| flow.carry(map));
            }
            _ => {
                if let Some(change) = later.field() {
                    self.field_mut(change.property).push_through(&change, theta);
                }
            }
        }
    }

    fn field_mut(&mut self, property: Property) -> &mut FieldTangent {
        match property {
            Property::SigmaT => &mut self.sigma_t,
            Property::Albedo => &mut self.albedo,
            Property::Emission => &mut self.emission,
            Property::G => &mut self.g,
            Property::Weight => &mut self.weight,
            Property::SggxDiagonal => &mut self.flakes[0],
            Property::SggxOffDiagonal => &mut self.flakes[1],
        }
    }

    /// True when the grids move.
    #[must_use]
    pub fn moves_grids(&self) -> bool {
        !(self.velocity.is_zero() && self.flows.iter().all(Flow::is_zero))
    }

    /// The velocity of the grids at a point of the world. `place` remembers what other tangents at the
    /// same point can use.
    #[inline]
    #[must_use]
    pub fn grid_velocity(&self, x: Vec3, place: &mut FlowPlace) -> Vec3 {
        self.velocity.point(x) + self.flow(x, place)
    }

    /// The part of the grids' velocity that [flows](Self::flows) give.
    #[inline]
    #[must_use]
    pub fn flow(&self, x: Vec3, place: &mut FlowPlace) -> Vec3 {
        let add = |sum, flow: &Flow| sum + place.at(&flow.basis, x).velocity(&flow.nodes);
        self.flows.iter().fold(Vec3::ZERO, add)
    }

    /// Eulerian rates of the coefficients at the fixed point x of the world: a grid carried along
    /// with velocity u adds `-u . grad`. The jumps at the box of a moving grid are not in them,
    /// see [`GridMedium::crossings`](crate::GridMedium::crossings).
    #[must_use]
    pub fn rates(&self, medium: &Medium, x: Vec3) -> CoefficientRates {
        let (coefficients, mut place) = (medium.coefficients(x), FlowPlace::default());
        if !self.moves_grids() {
            let still = (&CoefficientGradients::ZERO, Vec3::ZERO);
            return self.rates_given(medium, x, &coefficients, still.0, still.1);
        }
        let velocity = self.grid_velocity(x, &mut place);
        self.rates_given(medium, x, &coefficients, &medium.gradients(x), velocity)
    }

    /// [`MediumTangent::rates`] where the coefficients and gradients at x, and the
    /// [velocity](Self::grid_velocity) there, are at hand already: for many parameters of one point.
    #[must_use]
    pub fn rates_given(
        &self,
        medium: &Medium,
        x: Vec3,
        coefficients: &Coefficients,
        gradients: &CoefficientGradients,
        velocity: Vec3,
    ) -> CoefficientRates {
        let (c, u) = (coefficients, velocity);
        let Some((grids, at)) = medium.volumes_at(x) else {
            return CoefficientRates::ZERO;
        };
        CoefficientRates {
            sigma_t: self.sigma_t.rate(c.sigma_t, grids[0], at) - gradients.sigma_t.dot(u),
            albedo: self.albedo.rate(c.albedo, grids[1], at) - gradients.albedo.dot(u),
            emission: self.emission.rate(c.emission, grids[2], at) - gradients.emission.dot(u),
        }
    }

    /// Eulerian rate of the phase function's value, for one pair of directions, at the fixed point x of the world. `gradient` is that
    /// of the value, and `place` remembers what other tangents at the same point can use.
    #[must_use]
    pub fn phase_rate(
        &self,
        medium: &Medium,
        x: Vec3,
        gradient: &PhaseGradient,
        place: &mut FlowPlace,
    ) -> f64 {
        let mut rate = 0.0;
        for (tangent, property, by) in
            [(&self.g, Property::G, gradient.g), (&self.weight, Property::Weight, gradient.weight)]
        {
            if by != 0.0 && !tangent.is_zero() {
                let here = medium.phase_at(x);
                let grid = medium.phase.voxels(property);
                rate += by * tangent.rate(Rgb::splat(here.number()), grid, here.looked_up()).r;
            }
        }
        if gradient.place != Vec3::ZERO && self.moves_grids() {
            rate -= gradient.place.dot(self.grid_velocity(x, place));
        }
        if medium.phase.sggx().is_some() {
            rate += self.flakes_rate(medium, x, &gradient.flakes);
            rate += gradient.turn.dot(spin(&self.velocity));
        }
        rate
    }

    /// The rate, as the matrix of microflakes changes, of a number whose gradient by it is given, at the point x of the world.
    pub(crate) fn flakes_rate(&self, medium: &Medium, x: Vec3, by: &FlakesGradient) -> f64 {
        let Some(field) = medium.phase.sggx() else { return 0.0 };
        let at = medium.phase_place(x);
        let rate = |k: usize, by: Rgb| match &self.flakes[k] {
            tangent if tangent.is_zero() => 0.0,
            tangent => {
                let entries = &field.entries()[k];
                by.dot(tangent.rate(entries.value(at), entries.grid(), at))
            }
        };
        let [diagonal, off_diagonal] = field.by_values(by);
        rate(0, diagonal) + rate(1, off_diagonal)
    }
}

/// The rate of rotation in a velocity field: half of its curl, in radians.
pub(crate) fn spin(velocity: &Affine) -> Vec3 {
    let [x, y, z] = velocity.linear.cols;
    vec3(y.z - z.y, z.x - x.z, x.y - y.x) * 0.5
}

impl Medium {
    /// The derivative with respect to theta of a change that has been [applied](Medium::apply) at
    /// theta, as the last one so far.
    ///
    /// # Errors
    /// As [`Medium::apply`]; and when a factor `1 + theta m` is zero, or microflakes would not only [turn](Medium::admits).
    pub fn tangent(&self, change: &MediumChange, theta: f64) -> Result<MediumTangent, MediumError> {
        let mut tangent = MediumTangent::zero();
        match change {
            MediumChange::Place { velocity, .. } => {
                self.admits(velocity)?;
                if self.is_carried() {
                    tangent.velocity = *velocity;
                }
            }
            _ => {
                if let Some(c) = change.field() {
                    if c.property.is_of_phase() {
                        self.phase.check_change(&c)?;
                    }
                    let present = self.voxel_value(&c)?;
                    *tangent.field_mut(c.property) = FieldTangent::of(&c, theta, present)?;
                }
            }
        }
        Ok(tangent)
    }

    /// Present value of the voxel that a change names; zero when it names none.
    fn voxel_value(&self, change: &FieldChange) -> Result<Rgb, MediumError> {
        let FieldChange { property, voxel: Some(voxel), .. } = *change else {
            return Ok(Rgb::ZERO);
        };
        let grid = self.voxels(property).ok_or(MediumError::NotAGrid { property })?;
        let size = grid.size();
        if (0..3).any(|k| voxel[k] >= size[k]) {
            return Err(MediumError::NoSuchVoxel { property, voxel, size });
        }
        Ok(grid.voxel(voxel) * self.voxel_scale(property))
    }
}
