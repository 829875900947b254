//! Derivatives of what smooth surfaces scatter into single directions.
//!
//! A walk that draws one of the single directions of a surface, with the probability P_i, goes on with the weight V_i / P_i. Its
//! derivative is ∂V_i / P_i: as of any sample, the density counts as a constant. Parts i of a surface that share a direction are
//! told apart by nothing that the walk leaves behind; given the direction, the mean of ∂V_i / P_i over them is Σ ∂V_i / Σ P_i,
//! which is taken: as unbiased, and of no more variance. Where an index of refraction turns the direction, there is more to the
//! derivative, which nothing here has.

use drt_math::{Dual, Rgb, Vec3};

use crate::model::surface::params::{BsdfParams, PropertySet};

/// The methods by which a [`Model`](super::model::Model) answers that scatters light into single directions only: nothing is in its value,
/// and no sampler asks for a sketch of it, as nothing that moves is differentiated at such surfaces. The arguments are the properties that
/// the model is differentiated by. A file that uses this imports the types that these methods have in `Model`.
macro_rules! scatters_into_single_directions {
    ($($property:ident),+) => {
        #[inline]
        fn dependence(&self) -> Dependence {
            Dependence::Normal
        }

        #[inline]
        fn differentiated(&self) -> PropertySet {
            const { PropertySet::new(&[$(Property::$property),+]) }
        }

        fn value<T: Real>(&self, _: impl Numbers<T>, _: At<'_>, _: [Vec3<T>; 3]) -> Rgb<T> {
            Rgb::splat(T::zero())
        }

        fn gradient(&self, _: At<'_>, _: Vec3, _: Vec3, _: Vec3) -> BsdfGradient {
            BsdfGradient::default()
        }

        fn sample(&self, _: At<'_>, _: Vec3, _: Vec3, _: [f64; 3], _: Given) -> Option<Vec3> {
            None
        }

        fn pdf(&self, _: At<'_>, _: Vec3, _: Vec3, _: Vec3, _: Given) -> f64 {
            0.0
        }

        fn lobes(&self, _: At<'_>, _: Vec3, _: Vec3) -> Lobes {
            Lobes::even(0.0)
        }

        fn lobe_width(&self, _: At<'_>) -> f64 {
            0.0
        }
    };
}

pub(super) use scatters_into_single_directions;

/// What a surface scatters from one direction into another, single one.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct SpecularValue {
    /// The value V.
    pub(crate) value: Rgb,
    /// Its derivatives by the properties.
    pub(crate) params: BsdfParams,
    /// The probability of drawing the direction, given `wo`.
    pub(crate) probability: f64,
}

impl SpecularValue {
    /// The parts of a value over dual numbers, which have a lane for each of the properties.
    pub(super) fn by_duals<const N: usize>(
        properties: PropertySet,
        value: Rgb<Dual<f64, N>>,
        probability: f64,
    ) -> Self {
        let params = BsdfParams::from_ranks(properties, |k| value.map(|c| c.eps[k]));
        Self { value: value.map(|c| c.re), params, probability }
    }

    /// The value times a factor, where the direction is drawn with another factor of the probability.
    pub(super) fn scaled(&self, value: Rgb, probability: f64) -> Self {
        let params = self.params.scaled(value);
        Self { value: self.value * value, params, probability: self.probability * probability }
    }

    /// The derivatives of a walk's weight by the properties; `None` where nothing draws the direction.
    pub(super) fn of_weight(&self) -> Option<BsdfParams> {
        let inverse = Rgb::splat(self.probability.recip());
        (self.probability > 0.0).then(|| self.params.scaled(inverse))
    }
}

/// True of a direction that was drawn as this one.
pub(super) fn same(drawn: Vec3, w: Vec3) -> bool {
    (drawn - w).max_abs() < 1e-9
}
