//! Rough metals and interfaces whose roughness depends on the direction along the surface.

use drt_geom::edges::Lobes;
use drt_math::{Real, Rgb, Vec3};

use crate::model::surface::angles::Angles;
use crate::model::surface::dielectric::Passage;
use crate::model::surface::framed::{Framed, scatters_in_frame};
use crate::model::surface::lobes::widest;
use crate::model::surface::microfacet::{Distribution, LEAST_ALPHA, mirrored};
use crate::model::surface::model::{Constants, Dependence, Flags, Model, Numbers};
use crate::model::surface::params::PropertySet;
use crate::model::surface::property::{Property, Slot, SurfaceError, in_range};
use crate::model::surface::stretched_facets::StretchedFacets;
use crate::model::surface::{At, Bsdf, BsdfGradient, Given, RoughConductor, RoughDielectric};

/// A [`RoughConductor`] or [`RoughDielectric`] of uneven roughness: `alpha_u` and `alpha_v` of
/// Mitsuba's plugins.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Anisotropic {
    /// The [`RoughConductor`] or [`RoughDielectric`]; its own roughness is ignored.
    pub base: Bsdf,
    /// Roughness in the direction in which the texture coordinate u grows and across it, each at least 1e-4.
    pub alpha: [f64; 2],
}

impl Anisotropic {
    fn facets<T: Real>(&self, numbers: impl Numbers<T>) -> StretchedFacets<T> {
        let [u, v] = self.alpha;
        let alpha = [numbers.number(Property::AlphaU, u), numbers.number(Property::AlphaV, v)];
        let distribution = match &self.base {
            Bsdf::RoughConductor(b) => b.distribution,
            Bsdf::RoughDielectric(b) => b.distribution,
            _ => Distribution::default(),
        };
        StretchedFacets { distribution, alpha }
    }
}

impl Framed for Anisotropic {
    fn in_frame<T: Real>(&self, numbers: impl Numbers<T>, wo: Vec3<T>, wi: Vec3<T>) -> Rgb<T> {
        let facets = self.facets(numbers);
        let a = Angles::new(wo, wi, Vec3::Z.lift());
        let black = Rgb::splat(T::zero());
        match &self.base {
            Bsdf::RoughConductor(b) if a.in_front() => {
                b.value_of(numbers, &a, facets.facets(wo + wi, [wo, wi]))
            }
            Bsdf::RoughDielectric(b) => {
                let eta = numbers.number(Property::Eta, b.eta);
                let Some(passage) = Passage::new(&a, eta) else { return black };
                let h = wo + wi * passage.index();
                b.value_of(numbers, &passage, facets.facets(h, [wo, wi]))
            }
            _ => black,
        }
    }

    fn direction(&self, from: Vec3, u: [f64; 3]) -> Option<Vec3> {
        let facets = self.facets(Constants);
        match &self.base {
            Bsdf::RoughConductor(_) if from.z > 0.0 => {
                Some(mirrored(from, facets.sample_visible(from, [u[0], u[1]])))
            }
            Bsdf::RoughDielectric(b) => {
                let (n, eta) = b.seen_from(from, Vec3::Z)?;
                let m = facets.sample_visible(from * n.z, [u[0], u[1]]) * n.z;
                b.sample_by(m, from, n, eta, u[2])
            }
            _ => None,
        }
    }

    fn density(&self, from: Vec3, to: Vec3) -> f64 {
        let facets = self.facets(Constants);
        let a = Angles::new(from, to, Vec3::Z);
        match &self.base {
            Bsdf::RoughConductor(_) if a.in_front() => {
                RoughConductor::pdf_of(&a, facets.visible_density(from + to, from))
            }
            Bsdf::RoughDielectric(b) => Passage::new(&a, b.eta).map_or(0.0, |passage| {
                let h = from + to * passage.index();
                b.pdf_of(&passage, || facets.visible_density(h, from))
            }),
            _ => 0.0,
        }
    }
}

impl Model for Anisotropic {
    fn name(&self) -> &'static str {
        self.base.name()
    }

    #[inline(never)]
    fn flags(&self) -> Flags {
        Flags { oriented: true, ..self.base.flags() }
    }

    #[inline]
    fn differentiated(&self) -> PropertySet {
        let own = const { PropertySet::new(&[Property::AlphaU, Property::AlphaV]) };
        let even = const { PropertySet::new(&[Property::Alpha]) };
        self.base.differentiated().without(even).union(own)
    }

    fn slot(&mut self, property: Property) -> Option<Slot<'_>> {
        match property {
            Property::AlphaU => Some(Slot::Scalar(&mut self.alpha[0])),
            Property::AlphaV => Some(Slot::Scalar(&mut self.alpha[1])),
            Property::Alpha => None,
            _ => self.base.property(property),
        }
    }

    fn validate(&self) -> Result<(), SurfaceError> {
        if !matches!(self.base, Bsdf::RoughConductor(_) | Bsdf::RoughDielectric(_)) {
            let bsdf = self.base.name();
            return Err(SurfaceError::CannotHold { outer: "anisotropic", bsdf });
        }
        for (property, alpha) in [Property::AlphaU, Property::AlphaV].into_iter().zip(self.alpha) {
            in_range(property, alpha, alpha >= LEAST_ALPHA, "at least 1e-4")?;
        }
        self.base.validate()
    }

    scatters_in_frame!(at most 5);

    /// As wide all around as where it is widest.
    fn lobes(&self, _: At<'_>, wo: Vec3, n: Vec3) -> Lobes {
        let alpha = widest(self.alpha);
        match &self.base {
            Bsdf::RoughConductor(b) => RoughConductor { alpha, ..*b }.lobes(None, wo, n),
            Bsdf::RoughDielectric(b) => RoughDielectric { alpha, ..*b }.lobes(None, wo, n),
            b => b.lobes(None, wo, n),
        }
    }

    fn lobe_width(&self, _: At<'_>) -> f64 {
        f64::min(self.alpha[0], self.alpha[1])
    }
}
