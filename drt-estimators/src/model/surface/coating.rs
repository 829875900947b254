//! What a dielectric coating lets through to what is below it, and back.

use alloc::sync::Arc;
use alloc::vec::Vec;
use core::f64::consts::TAU;

use drt_math::{Real, Vec3, fm, vec3};

use crate::model::surface::angles::Angles;
use crate::model::surface::fresnel::dielectric_reflected;
use crate::model::surface::microfacet::{Distribution, LEAST_ALPHA, mirrored, refracted};
use crate::model::surface::property::{Property, SurfaceError, in_range};

/// A dielectric layer over a diffuse base: how light is reflected at it, and how much goes through.
///
/// Rough coatings let through what their microfacets refract and do not mask, by single scattering,
/// tabulated over the cosine.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Coating {
    eta: f64,
    /// Microfacets and their roughness; a smooth coating has none.
    facets: Option<(Distribution, f64)>,
    /// The part of the light that a rough coating lets through at [`COSINES`] cosines from 0 to 1; empty for a smooth one.
    transmittance: Arc<[f64]>,
    /// The part of diffuse light from below that is reflected back down.
    internal_reflectance: f64,
}

/// Entries of the table, as many as Mitsuba has.
const COSINES: usize = 64;
/// Nodes per dimension of the integrals over microfacets from outside and from inside, where total
/// reflection makes them less smooth.
const OUTSIDE: usize = 32;
const INSIDE: usize = 64;

impl Coating {
    /// A smooth coating whose index of refraction is `eta` times that of the outside.
    ///
    /// # Errors
    /// When that is not above 1.
    pub fn smooth(eta: f64) -> Result<Self, SurfaceError> {
        check_index(eta)?;
        // Light beyond the critical angle is reflected; the rest by a midpoint rule in a variable that
        // takes the square root away from its edge.
        let critical2 = 1.0 - 1.0 / (eta * eta);
        let (steps, mut sum) = (1024, 0.0);
        for i in 0..steps {
            let t = (f64::from(i) + 0.5) / f64::from(steps);
            let cos = fm::sqrt(critical2 + (1.0 - critical2) * t * t);
            sum += dielectric_reflected(cos, eta.recip()) * 2.0 * t / f64::from(steps);
        }
        let internal_reflectance = critical2 + (1.0 - critical2) * sum;
        Ok(Self { eta, facets: None, transmittance: Arc::new([]), internal_reflectance })
    }

    /// A coating with microfacets.
    ///
    /// # Errors
    /// When `eta` is not above 1 or `alpha` below 1e-4.
    pub fn rough(distribution: Distribution, alpha: f64, eta: f64) -> Result<Self, SurfaceError> {
        check_index(eta)?;
        in_range(Property::Alpha, alpha, alpha >= LEAST_ALPHA, "at least 1e-4")?;
        let from_outside = |i| {
            over_facets(distribution, alpha, cosine(i), OUTSIDE, |from, m| {
                let (w, _) = refracted(from, m, eta).filter(|(w, _)| w.z < 0.0)?;
                Some((1.0 - dielectric_reflected(m.dot(from).min(1.0), eta), w))
            })
        };
        let from_inside = |i| {
            over_facets(distribution, alpha, cosine(i), INSIDE, |from, m| {
                let w = mirrored(from, m);
                let reflected = dielectric_reflected(m.dot(from).min(1.0), eta.recip());
                (w.z > 0.0).then_some((reflected, w))
            })
        };
        let transmittance = (0..COSINES).map(from_outside).collect();
        let inside: Vec<f64> = (0..COSINES).map(from_inside).collect();
        let weighted = inside.iter().enumerate().map(|(i, r)| r * cosine(i));
        let internal_reflectance = 2.0 * weighted.sum::<f64>() / COSINES as f64;
        Ok(Self { eta, facets: Some((distribution, alpha)), transmittance, internal_reflectance })
    }

    /// A coating with microfacets that reflect, but lets through to a diffuse base what a smooth one does, each way once, and
    /// none of it comes back: Mitsuba's `pplastic`, after Baek et al. 2018, "Simultaneous Acquisition of Polarimetric SVBRDF
    /// and Normals", without polarisation.
    ///
    /// # Errors
    /// When `eta` is not above 1 or `alpha` below 1e-4.
    pub fn unmixed(distribution: Distribution, alpha: f64, eta: f64) -> Result<Self, SurfaceError> {
        check_index(eta)?;
        in_range(Property::Alpha, alpha, alpha >= LEAST_ALPHA, "at least 1e-4")?;
        // With this the factors of light inside, 1 / ((1 - r) eta²), are one.
        let internal_reflectance = 1.0 - 1.0 / (eta * eta);
        let facets = Some((distribution, alpha));
        Ok(Self { eta, facets, transmittance: Arc::new([]), internal_reflectance })
    }

    /// The index of refraction over that of the outside.
    #[must_use]
    pub fn eta(&self) -> f64 {
        self.eta
    }

    /// Distribution and roughness of the microfacets; `None` of a smooth coating.
    #[must_use]
    pub fn facets(&self) -> Option<(Distribution, f64)> {
        self.facets
    }

    pub(super) fn internal_reflectance(&self) -> f64 {
        self.internal_reflectance
    }

    /// The value of a white reflection by the microfacets; `None` of a smooth coating. Both directions are in front.
    #[inline]
    pub(super) fn reflection<T: Real>(&self, a: &Angles<T>) -> Option<T> {
        let (distribution, alpha) = self.facets?;
        let facets = distribution.facets(a, T::one(), T::from(alpha));
        if facets.re() == 0.0 {
            return Some(T::zero());
        }
        let fresnel = dielectric_reflected(a.h2.sqrt() * 0.5, T::from(self.eta));
        Some(facets * fresnel * a.h2.squared() * 0.25)
    }

    /// The density with which visible microfacets are chosen to reflect so; `None` of a smooth coating.
    #[inline]
    pub(super) fn reflection_density(&self, a: &Angles) -> Option<f64> {
        let (distribution, alpha) = self.facets?;
        Some(0.25 * a.h2 * a.h2 * distribution.visible_density(a, 1.0, alpha))
    }

    /// The part of the light that goes through at a cosine in (0, 1].
    #[inline]
    pub(super) fn let_through<T: Real>(&self, cos: T) -> T {
        if self.transmittance.len() < 2 {
            return T::one() - dielectric_reflected(cos, T::from(self.eta));
        }
        let at = cos * (COSINES - 1) as f64;
        let i = (at.re() as usize).min(COSINES - 2);
        let [below, above] = [self.transmittance[i], self.transmittance[i + 1]];
        (at - i as f64) * (above - below) + below
    }

    /// Checks the index and, as it may have been read from anywhere, the table's length.
    pub(super) fn validate(&self) -> Result<(), SurfaceError> {
        check_index(self.eta)?;
        let length = self.transmittance.len();
        let fits = length == 0 || (self.facets.is_some() && length == COSINES);
        in_range(Property::Alpha, length as f64, fits, "a coating's table")
    }
}

fn check_index(eta: f64) -> Result<(), SurfaceError> {
    in_range(Property::Eta, eta, eta > 1.0, "above 1")
}

/// The cosine of an entry of the table.
fn cosine(i: usize) -> f64 {
    // Grazing light is as near to the surface as in Mitsuba's table.
    1e-6 + (1.0 - 1e-6) * i as f64 / (COSINES - 1) as f64
}

/// What `scatter` makes of the microfacets that a direction sees at a cosine: the mean of the part it
/// says, if not masked on its way out along the direction it says.
fn over_facets(
    distribution: Distribution,
    alpha: f64,
    cos: f64,
    nodes: usize,
    scatter: impl Fn(Vec3, Vec3) -> Option<(f64, Vec3)>,
) -> f64 {
    let from = vec3(fm::sqrt((1.0 - cos * cos).max(0.0)), 0.0, cos);
    let mut sum = 0.0;
    for i in 0..nodes {
        for j in 0..nodes {
            // Denser towards the ends, where the normals of long tails are.
            let u = [i, j].map(|k| (k as f64 + 0.5) / nodes as f64);
            let weight = u.map(|t| 1.0 - fm::sin_cos(TAU * t).1);
            let u = u.map(|t| t - fm::sin_cos(TAU * t).0 / TAU);
            let m = distribution.sample_visible(from, Vec3::Z, alpha, u);
            let Some((part, w)) = scatter(from, m).filter(|_| m.dot(from) > 0.0) else { continue };
            let cos = w.z.abs();
            if cos > 0.0 {
                sum += part * distribution.masking(cos, alpha) * cos * weight[0] * weight[1];
            }
        }
    }
    sum / (nodes * nodes) as f64
}
