//! Microfacets whose roughness depends on the direction along the surface, and the rough metals and interfaces made of
//! them.
//!
//! Slopes are stretched by α_u along the tangent and by α_v across it (Heitz 2014, "Understanding the Masking-Shadowing
//! Function in Microfacet-Based BRDFs", section 5). With α² = α_u α_v and h stretched to h' = (h_x α/α_u, h_y α/α_v,
//! h_z), the density of normals is that of even roughness α at h'; masking of a direction w is that of the roughness
//! along it,
//!
//! ```text
//! α(w)² sin² = α_u² w_x² + α_v² w_y².
//! ```
//!
//! All vectors are in the frame of [`Framed`].

use drt_geom::edges::Lobes;
use drt_math::{Real, Rgb, Vec3, fm, vec3};

use crate::model::surface::angles::Angles;
use crate::model::surface::dielectric::Passage;
use crate::model::surface::framed::{Framed, scatters_in_frame};
use crate::model::surface::lobes::widest;
use crate::model::surface::microfacet::{Distribution, LEAST_ALPHA, LEAST_COS2, mirrored};
use crate::model::surface::model::{Constants, Dependence, Flags, Model, Numbers};
use crate::model::surface::params::PropertySet;
use crate::model::surface::property::{Property, Slot, SurfaceError, in_range};
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

/// Microfacets in the frame of their surface.
#[derive(Clone, Copy)]
pub(super) struct StretchedFacets<T = f64> {
    pub(super) distribution: Distribution,
    pub(super) alpha: [T; 2],
}

impl<T: Real> StretchedFacets<T> {
    /// `D(h/|h|) / |h|⁴`, as [`Distribution::density`].
    #[inline]
    pub(super) fn density(&self, h: Vec3<T>) -> T {
        let [u, v] = self.alpha;
        let even2 = u * v;
        let (x, y) = (h.x / u, h.y / v);
        let h2 = even2 * (x.squared() + y.squared()) + h.z.squared();
        self.distribution.density(h.z, h2, even2.sqrt())
    }

    /// Smith's masking over the cosine, as [`Distribution::masking`]; of the side that the direction is on.
    #[inline]
    pub(super) fn masking(&self, w: Vec3<T>) -> T {
        self.distribution.masking_by(w.z.abs(), self.spread2(w))
    }

    #[inline]
    fn spread2(&self, w: Vec3<T>) -> T {
        (self.alpha[0] * w.x).squared() + (self.alpha[1] * w.y).squared()
    }

    /// As [`Distribution::facets`].
    #[inline]
    fn facets(&self, h: Vec3<T>, [wo, wi]: [Vec3<T>; 2]) -> T {
        let density = self.density(h);
        // Directions in the surface underflow.
        if density.re() == 0.0 || (wo.z * wi.z).re().abs() < LEAST_COS2 {
            return T::zero();
        }
        density * self.masking(wo) * (self.masking(wi) * wi.z.abs())
    }
}

impl StretchedFacets {
    /// `G1(w) D(m) / (|h|⁴ n·w)` with exact masking, as [`Distribution::visible_density`].
    #[inline]
    pub(super) fn visible_density(&self, h: Vec3, w: Vec3) -> f64 {
        let density = self.density(h);
        if density == 0.0 {
            return 0.0;
        }
        density * self.distribution.exact_masking_by(w.z.abs(), fm::sqrt(self.spread2(w)))
    }

    /// As [`Distribution::sample_visible`], of a direction above the surface.
    pub(super) fn sample_visible(&self, from: Vec3, u: [f64; 2]) -> Vec3 {
        let [a, b] = self.alpha;
        let (x, y) = (a * from.x, b * from.y);
        let sin = fm::sqrt(x * x + y * y);
        let stretched = fm::sqrt(sin * sin + from.z * from.z);
        let (cos_phi, sin_phi) =
            if sin > 1e-9 * stretched { (x / sin, y / sin) } else { (1.0, 0.0) };
        let [p, q, up] = self.distribution.sample_stretched(from.z / stretched, sin / stretched, u);
        vec3(a * (p * cos_phi - q * sin_phi), b * (p * sin_phi + q * cos_phi), up).normalize()
    }
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
