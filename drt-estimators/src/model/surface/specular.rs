//! Derivatives of what smooth surfaces scatter into single directions.
//!
//! A walk that draws one of the single directions of a surface, with the probability P_i, goes on with the weight V_i / P_i. Its
//! derivative is ∂V_i / P_i: as of any sample, the density counts as a constant. Parts i of a surface that share a direction are
//! told apart by nothing that the walk leaves behind; given the direction, the mean of ∂V_i / P_i over them is Σ ∂V_i / Σ P_i,
//! which is taken: as unbiased, and of no more variance.
//!
//! As a point of the surface, its normal or the direction that light arrives from moves, the single direction moves with them. It is a
//! function w(wo, n) that a [`Bend`] tells; the value is a function of the cosine n·wo, besides what textures do.

use drt_math::{Dual, Real, Rgb, RgbVec, Vec3, vec3};

use crate::model::surface::params::{BsdfParams, PropertySet};

/// The methods by which a [`Model`](super::model::Model) answers that scatters light into single directions only: nothing is in its value,
/// and no sampler asks for a sketch of it, as nothing that moves is sampled at edges beside such surfaces. The arguments are the properties that
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

        fn single_chance(&self, _: At<'_>, _: Vec3, _: Vec3) -> f64 {
            1.0
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
    /// The value's derivative by the cosine of `wo` with the normal, whose sign tells the sides apart.
    pub(crate) by_cosine: Rgb,
    /// How the direction follows from `wo` and the normal.
    pub(crate) bend: Bend,
}

/// How a single direction follows from the one where light leaves to, and from the normal.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) enum Bend {
    /// Straight on, as if there was no surface.
    #[default]
    Straight,
    /// Reflected.
    Mirror,
    /// Reflected inside of the denser of two media; the index is that beyond the surface over that on this side.
    Inside(RelativeIndex),
    /// Refracted.
    Refraction(RelativeIndex),
}

/// The index of refraction on the side of the light's direction over that on the other.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct RelativeIndex {
    pub(crate) value: f64,
    /// Its derivative by the index that the surface has as a property.
    pub(crate) by_property: f64,
}

impl RelativeIndex {
    /// It, where the index that the surface has as a property is higher by `more`.
    fn raised<T: Real>(self, more: T) -> T {
        more * self.by_property + T::from(self.value)
    }
}

impl Bend {
    /// Reflected by an interface of two media, with the index beyond it over that on this side, as in [`refraction`](Self::refraction).
    pub(crate) fn reflection(value: f64, by_property: f64) -> Self {
        if value < 1.0 { Self::Inside(RelativeIndex { value, by_property }) } else { Self::Mirror }
    }

    /// Refracted, by the index on the side of the light's direction over that on the other, and the derivative of this by the index that the
    /// surface has as a property.
    pub(crate) fn refraction(value: f64, by_property: f64) -> Self {
        Self::Refraction(RelativeIndex { value, by_property })
    }

    /// The direction of a ray that goes on from a surface whose index of refraction is higher by `more`, where it arrives along the unit
    /// direction `w`; n is the unit normal, on either side. All angles of refraction exist: asked for others, it tells that along the surface.
    pub(crate) fn onward<T: Real>(self, w: Vec3<T>, n: Vec3<T>, more: T) -> Vec3<T> {
        let cos = n.dot(w);
        match self {
            Self::Straight => w,
            Self::Mirror | Self::Inside(_) => w - n * (cos * 2.0),
            Self::Refraction(index) => {
                let eta = index.raised(more);
                let beyond = T::one() - (T::one() - cos.squared()) / eta.squared();
                let beyond = if beyond.re() > 0.0 { beyond.sqrt() } else { T::zero() };
                let beyond = if cos.re() < 0.0 { -beyond } else { beyond };
                w / eta + n * (beyond - cos / eta)
            }
        }
    }

    /// The squared cosine of the angle of refraction into a thinner medium, which is zero at the critical angle and negative where
    /// light is totally reflected. `None` where no angle is critical.
    pub(crate) fn beyond<T: Real>(self, w: Vec3<T>, n: Vec3<T>, more: T) -> Option<T> {
        match self {
            Self::Inside(index) | Self::Refraction(index) if index.value < 1.0 => {
                let sine = T::one() - n.dot(w).squared();
                Some(T::one() - sine / index.raised(more).squared())
            }
            _ => None,
        }
    }

    /// Sensitivities by w, by n and by the index of refraction, from those by the direction [`onward`](Self::onward).
    pub(crate) fn pull(self, w: Vec3, n: Vec3, g: RgbVec) -> (RgbVec, RgbVec, Rgb) {
        let inputs = |v: Vec3, first: usize| -> Vec3<Dual<f64, 7>> {
            let [x, y, z] = v.to_array();
            [(x, 0), (y, 1), (z, 2)].map(|(v, k)| Dual::variable(v, first + k)).into()
        };
        let onward = self.onward(inputs(w, 0), inputs(n, 3), Dual::variable(0.0, 6));
        let by_index: Vec3 = onward.to_array().map(|c| c.eps[6]).into();
        let by = |first: usize| {
            g.map(|g| {
                let lane = |k: usize| {
                    let [x, y, z] = onward.to_array().map(|c| c.eps[first + k]);
                    vec3(x, y, z).dot(g)
                };
                vec3(lane(0), lane(1), lane(2))
            })
        };
        (by(0), by(3), g.dot(by_index))
    }
}

impl SpecularValue {
    /// The parts of a value over dual numbers, which have a lane for each of the properties.
    pub(super) fn by_duals<const N: usize>(
        properties: PropertySet,
        value: Rgb<Dual<f64, N>>,
        by_cosine: Rgb,
        probability: f64,
        bend: Bend,
    ) -> Self {
        let params = BsdfParams::from_ranks(properties, |k| value.map(|c| c.eps[k]));
        let value = value.map(|c| c.re);
        Self { value, params, probability, bend, by_cosine }
    }

    /// The value times a factor, where the direction is drawn with another factor of the probability.
    pub(super) fn scaled(&self, value: Rgb, probability: f64) -> Self {
        let params = self.params.scaled(value);
        Self {
            value: self.value * value,
            params,
            probability: self.probability * probability,
            by_cosine: self.by_cosine * value,
            bend: self.bend,
        }
    }

    /// The walk's weight in place of the value, with its derivatives; `None` where nothing draws the direction.
    pub(super) fn of_weight(&self) -> Option<Self> {
        (self.probability > 0.0).then(|| self.scaled(Rgb::splat(self.probability.recip()), 1.0))
    }
}

/// True of a direction that was drawn as this one.
pub(super) fn same(drawn: Vec3, w: Vec3) -> bool {
    (drawn - w).max_abs() < 1e-9
}
