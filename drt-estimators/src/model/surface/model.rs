//! What every kind of BSDF answers.
//!
//! A model states its [value](Model::value) over any scalar. Its derivatives are that value over dual numbers: by both directions, the
//! normal, and every number of the properties that it is [differentiated](Model::differentiated) by. The channels of a colour share a
//! lane, as no channel of a value depends on another one of it. A model whose derivatives cost less otherwise says so by a
//! [gradient](Model::gradient) of its own, which `tests/gradients.rs` compares with that by dual numbers. By hand is only that of rough
//! metal: in a closed box whose walls are of one BSDF, with dual numbers derivatives by the motion of a cube took 1.14 times the instructions
//! for rough metal, but at most 1.03 times for diffuse, Phong, rough plastic and rough glass. What is made of other BSDFs combines
//! their gradients, by which those of isotropic ones keep their few lanes.

use alloc::vec::Vec;

use drt_geom::Mesh;
use drt_geom::edges::Lobes;
use drt_math::{Dual, Real, Rgb, RgbVec, Vec3};

use crate::model::surface::facet::Facet;
use crate::model::surface::params::{BsdfParams, PropertySet};
use crate::model::surface::property::{Property, Slot, SurfaceError};
use crate::model::surface::textures::Textures;
use crate::model::surface::{At, BsdfGradient, Given, SpecularSample, SpecularValue};
use crate::model::texture::{SurfaceLine, Texture};

/// Turns the numbers of a model's properties into those that its value is computed over.
pub(crate) trait Numbers<T: Real>: Copy {
    /// A number of a property.
    fn number(self, property: Property, value: f64) -> T;

    /// The numbers of a colour.
    #[inline]
    fn colour(self, property: Property, value: Rgb) -> Rgb<T> {
        value.map(|c| self.number(property, c))
    }

    /// These numbers, with constants for some properties: a BSDF hides those of one that it is made of.
    #[must_use]
    fn without(self, hidden: PropertySet) -> Self;
}

/// Every number is a constant.
#[derive(Clone, Copy)]
pub(crate) struct Constants;

impl<T: Real> Numbers<T> for Constants {
    #[inline]
    fn number(self, _: Property, value: f64) -> T {
        T::from(value)
    }

    #[inline]
    fn without(self, _: PropertySet) -> Self {
        self
    }
}

/// A lane of dual numbers for each property, from the lane `FIRST` on.
#[derive(Clone, Copy)]
pub(super) struct Lanes<const FIRST: usize> {
    all: PropertySet,
    shown: PropertySet,
}

impl<const FIRST: usize> Lanes<FIRST> {
    #[inline]
    pub(super) fn new(properties: PropertySet) -> Self {
        Self { all: properties, shown: properties }
    }
}

impl<const FIRST: usize, const N: usize> Numbers<Dual<f64, N>> for Lanes<FIRST> {
    #[inline]
    fn number(self, property: Property, value: f64) -> Dual<f64, N> {
        if self.shown.contains(property) {
            Dual::variable(value, FIRST + self.all.rank(property))
        } else {
            Dual::from(value)
        }
    }

    #[inline]
    fn without(self, hidden: PropertySet) -> Self {
        Self { shown: self.shown.without(hidden), ..self }
    }
}

/// What a value depends on besides directions.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Dependence {
    /// Nothing but the normal.
    Normal,
    /// A frame that follows texture coordinates.
    Frame,
    /// What textures are at the point, or what the BSDFs are that it is made of.
    Point,
}

/// What transport asks of a BSDF before it samples one. A model that is not made of others starts from [`Flags::REFLECTOR`] or
/// [`Flags::INTERFACE`] and states where it differs; `tests/flags.rs` compares what it answers with its values.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Flags {
    /// Nothing is scattered, as of now.
    pub(super) black: bool,
    /// Nothing is scattered where both directions are on the back of the surface.
    pub(super) black_from_behind: bool,
    /// Light is scattered through the surface, to the other side.
    pub(super) transmissive: bool,
    /// Some light is scattered into single directions.
    pub(super) smooth: bool,
    /// Some light goes straight on, as through nothing.
    pub(super) straight: bool,
    /// Some light is scattered into all directions of a solid angle.
    pub(super) spread: bool,
    /// Its index of refraction turns light that goes on in a single direction.
    pub(super) bends: bool,
    /// Directions along the surface are told apart, by its texture coordinates.
    pub(super) oriented: bool,
    /// The value may be differentiated where something moves: it has no jumps besides those that boundary terms sample, and is in
    /// no single direction that a map bends.
    pub(super) differentiable: bool,
}

impl Flags {
    /// The answers of a rough reflector, alike in all directions about its normal and black from behind.
    pub(super) const REFLECTOR: Self = Self {
        black: false,
        black_from_behind: true,
        transmissive: false,
        smooth: false,
        straight: false,
        spread: true,
        bends: false,
        oriented: false,
        differentiable: true,
    };

    /// The answers of a rough surface that scatters light on both of its sides and through it.
    pub(super) const INTERFACE: Self =
        Self { black_from_behind: false, transmissive: true, ..Self::REFLECTOR };

    /// What is made of two BSDFs is black where both are, and the rest where either is.
    pub(super) fn of_both(self, other: Self) -> Self {
        Self {
            black: self.black && other.black,
            black_from_behind: self.black_from_behind && other.black_from_behind,
            transmissive: self.transmissive || other.transmissive,
            smooth: self.smooth || other.smooth,
            straight: self.straight || other.straight,
            spread: self.spread || other.spread,
            bends: self.bends || other.bends,
            oriented: self.oriented || other.oriented,
            differentiable: self.differentiable && other.differentiable,
        }
    }
}

/// A kind of BSDF. Conventions are those of the methods of [`Bsdf`] of these names.
pub(super) trait Model {
    /// The name of the plugin that it follows.
    fn name(&self) -> &'static str;

    fn flags(&self) -> Flags;

    /// What the value depends on besides directions. A model that knows nothing better answers that its point decides, which is never
    /// wrong.
    #[inline]
    fn dependence(&self) -> Dependence {
        Dependence::Point
    }

    /// The properties that its value is differentiated by.
    fn differentiated(&self) -> PropertySet;

    /// Where it keeps a property.
    fn slot(&mut self, property: Property) -> Option<Slot<'_>>;

    /// Checks every number.
    fn validate(&self) -> Result<(), SurfaceError>;

    /// The value, over any scalar.
    fn value<T: Real>(
        &self,
        numbers: impl Numbers<T>,
        at: At<'_>,
        directions: [Vec3<T>; 3],
    ) -> Rgb<T>;

    /// The value with its derivatives.
    fn gradient(&self, at: At<'_>, wo: Vec3, wi: Vec3, n: Vec3) -> BsdfGradient;

    /// Draws the direction that `from` is scattered to.
    fn sample(&self, at: At<'_>, from: Vec3, n: Vec3, u: [f64; 3], given: Given) -> Option<Vec3>;

    /// The density with which `sample` draws the direction `to`.
    fn pdf(&self, at: At<'_>, from: Vec3, to: Vec3, n: Vec3, given: Given) -> f64;

    /// Draws a direction, with its density.
    #[inline]
    fn draw(
        &self,
        at: At<'_>,
        from: Vec3,
        n: Vec3,
        u: [f64; 3],
        given: Given,
    ) -> Option<(Vec3, f64)> {
        let w = self.sample(at, from, n, u, given)?;
        Some((w, self.pdf(at, from, w, n, given)))
    }

    /// Draws one of the single directions of a smooth surface.
    #[inline]
    fn sample_specular(
        &self,
        _at: At<'_>,
        _from: Vec3,
        _n: Vec3,
        _choice: f64,
        _given: Given,
    ) -> Option<SpecularSample> {
        None
    }

    /// The probability with which `sample_specular` draws any direction.
    #[inline]
    fn single_chance(&self, _at: At<'_>, _from: Vec3, _n: Vec3) -> f64 {
        0.0
    }

    /// What is scattered from `wo` into the single direction `wi`.
    #[inline]
    fn specular(&self, _at: At<'_>, _wo: Vec3, _wi: Vec3, _n: Vec3) -> Option<SpecularValue> {
        None
    }

    /// The part of the light that goes straight through, at a cosine to the normal.
    fn straight(&self, _at: At<'_>, _cos: f64) -> Rgb {
        Rgb::ZERO
    }

    /// The microfacets that scatter so, and the rate of their index of refraction by that of the material.
    #[inline]
    fn facet(&self, _at: At<'_>, _wo: Vec3, _wi: Vec3, _n: Vec3) -> Option<(Facet, f64)> {
        None
    }

    /// A sketch of the light that leaves to `wo`, by where it comes from.
    fn lobes(&self, at: At<'_>, wo: Vec3, n: Vec3) -> Lobes;

    /// About how far the half vector of its sharpest lobe is from the normal, in slopes.
    fn lobe_width(&self, at: At<'_>) -> f64;

    /// The texture that stands for a property.
    fn texture(&self, _property: Property) -> Option<&Texture> {
        None
    }

    /// Why there are only finite differences with respect to a property that it has, where that depends on more than the
    /// property: on the values that it and others have by now, some of which `textures` may stand for.
    fn undifferentiated(
        &self,
        _property: Property,
        _textures: Textures<'_>,
    ) -> Option<&'static str> {
        None
    }

    /// The gradient of a value by the place of its point, as far as textures change there; `params` are the value's derivatives by
    /// properties, times a `factor`, as the gradient is to be.
    fn slide(
        &self,
        _at: At<'_>,
        _directions: [Vec3; 3],
        _params: &BsdfParams,
        _factor: f64,
    ) -> RgbVec {
        RgbVec::ZERO
    }

    /// The gradient of the value, times a `factor`, by the corners of its triangle, as far as these stretch the texture coordinates on the
    /// surface: besides the normal, and [the turn of its frame](crate::model::surface::by_corners).
    fn stretch(&self, _at: At<'_>, _directions: [Vec3; 3], _factor: f64) -> [RgbVec; 3] {
        [RgbVec::ZERO; 3]
    }

    /// Checks what it has from the mesh of a shape.
    fn validate_on(&self, _mesh: &Mesh) -> Result<(), SurfaceError> {
        Ok(())
    }

    /// The lines on a mesh along which its own textures jump; `None` where they may jump elsewhere.
    fn lines_on(&self, _mesh: &Mesh) -> Option<Vec<SurfaceLine>> {
        Some(Vec::new())
    }
}

/// The gradient of a value by two directions, the normal, and properties: that of dual numbers with a lane for each of their
/// coordinates and of the properties, of which there are `LANES` in all.
#[inline(always)]
pub(super) fn by_duals<const LANES: usize>(
    properties: PropertySet,
    [wo, wi, n]: [Vec3; 3],
    value: impl Fn(Lanes<COORDINATES>, [Vec3<Dual<f64, LANES>>; 3]) -> Rgb<Dual<f64, LANES>>,
) -> BsdfGradient {
    let directions = variables([wo, wi, n]);
    let value = value(Lanes::new(properties), directions);
    let lane = |k: usize| value.map(|c| c.eps[k]);
    let by = |first: usize| gradient_of(|k| lane(first + k));
    let params = BsdfParams::from_ranks(properties, |k| lane(COORDINATES + k));
    BsdfGradient {
        value: value.map(|c| c.re),
        wo: by(0),
        wi: by(3),
        n: by(COORDINATES - 3),
        params,
    }
}

/// Vectors with a lane of dual numbers for each coordinate, from the first lane on.
#[inline(always)]
pub(super) fn variables<const LANES: usize, const N: usize>(
    vectors: [Vec3; N],
) -> [Vec3<Dual<f64, LANES>>; N] {
    core::array::from_fn(|i| {
        let [x, y, z] = vectors[i].to_array();
        [(x, 0), (y, 1), (z, 2)].map(|(v, k)| Dual::variable(v, 3 * i + k)).into()
    })
}

/// The gradient by a vector, from the derivative by each of its coordinates.
#[inline(always)]
pub(super) fn gradient_of(by: impl Fn(usize) -> Rgb) -> RgbVec {
    by(0).outer(Vec3::X) + by(1).outer(Vec3::Y) + by(2).outer(Vec3::Z)
}

/// The lanes of two directions and the normal.
pub(super) const COORDINATES: usize = 9;
