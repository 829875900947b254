use drt_math::{Dual, Real, Rgb, Vec3};

use crate::model::surface::angles::{Angles, Slopes};
use crate::model::surface::model::{Lanes, Model, Numbers};
use crate::model::surface::{BsdfGradient, BsdfParams};

/// A model that sees directions by their [`Angles`] alone.
pub(super) trait Isotropic: Model {
    /// The value by the angles, over any scalar.
    fn by_angles<T: Real>(&self, numbers: impl Numbers<T>, a: &Angles<T>) -> Rgb<T>;
}

/// The methods by which a [`Model`] that is [`Isotropic`] answers: it depends on nothing but the normal, and its derivatives are those
/// of dual numbers. The arguments are the properties that the value is differentiated by. A file that uses this imports the types that
/// these methods have in [`Model`].
macro_rules! scatters_by_angles {
    ($($property:ident),+) => {
        #[inline]
        fn dependence(&self) -> Dependence {
            Dependence::Normal
        }

        #[inline]
        fn differentiated(&self) -> PropertySet {
            const { PropertySet::new(&[$(Property::$property),+]) }
        }

        #[inline]
        fn value<T: Real>(
            &self,
            numbers: impl Numbers<T>,
            _: At<'_>,
            [wo, wi, n]: [Vec3<T>; 3],
        ) -> Rgb<T> {
            self.by_angles(numbers, &Angles::new(wo, wi, n))
        }

        #[inline]
        fn gradient(&self, _: At<'_>, wo: Vec3, wi: Vec3, n: Vec3) -> BsdfGradient {
            use $crate::model::surface::isotropic::{ANGLES, by_angles};
            by_angles::<{ ANGLES + [$(Property::$property),+].len() }>(self, [wo, wi, n])
        }
    };
}

pub(super) use scatters_by_angles;

/// The lanes of the angles.
pub(super) const ANGLES: usize = 3;

/// The gradient of an isotropic model's value: that of dual numbers with a lane for each of the angles and of the properties, of which
/// there are `LANES` in all, and the chain rule.
#[inline]
pub(super) fn by_angles<const LANES: usize>(
    model: &impl Isotropic,
    [wo, wi, n]: [Vec3; 3],
) -> BsdfGradient {
    let Angles { cos_o, cos_i, h2 } = Angles::new(wo, wi, n);
    let angles = Angles::<Dual<f64, LANES>> {
        cos_o: Dual::variable(cos_o, 0),
        cos_i: Dual::variable(cos_i, 1),
        h2: Dual::variable(h2, ANGLES - 1),
    };
    let properties = model.differentiated();
    let value = model.by_angles(Lanes::<ANGLES>::new(properties), &angles);
    let lane = |k: usize| value.map(|c| c.eps[k]);
    let slopes = Slopes {
        value: value.map(|c| c.re),
        cos_o: lane(0),
        cos_i: lane(1),
        h2: lane(ANGLES - 1),
        params: BsdfParams::from_ranks(properties, |k| lane(ANGLES + k)),
    };
    slopes.pull_back(wo, wi, n)
}
