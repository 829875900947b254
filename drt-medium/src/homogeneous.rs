use drt_math::{Rgb, Rng, fm};

use crate::reach::Reach;
use crate::tracking::{channel_probabilities, zip};
use crate::{Coefficients, DistanceSample, MediumError, Property};

/// The same coefficients everywhere. It has no boundary of its own: surfaces bound it.
///
/// Changes of a parameter may push the extinction below zero (a central difference around an
/// empty medium does); every function here then gives the analytic continuation.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(try_from = "Coefficients"))]
#[cfg_attr(feature = "serde", serde(into = "Coefficients"))]
pub struct Homogeneous {
    pub(crate) coefficients: Coefficients,
}

impl Homogeneous {
    /// A medium with the given extinction (1 / scene unit), albedo and emitted radiance.
    ///
    /// # Errors
    /// When a coefficient is negative or not finite, or an albedo exceeds one.
    pub fn new(sigma_t: Rgb, albedo: Rgb, emission: Rgb) -> Result<Self, MediumError> {
        check(Property::SigmaT, sigma_t)?;
        check(Property::Albedo, albedo)?;
        check(Property::Emission, emission)?;
        Ok(Self { coefficients: Coefficients { sigma_t, albedo, emission } })
    }

    /// The coefficients.
    #[inline]
    #[must_use]
    pub fn coefficients(&self) -> Coefficients {
        self.coefficients
    }

    /// `exp(-sigma_t t)`, also for infinite t.
    #[inline]
    #[must_use]
    pub fn transmittance(&self, t: f64) -> Rgb {
        attenuations(self.coefficients.sigma_t, t)
    }

    /// A distance from the density of [`Homogeneous::free_flight_pdf`], or the news that the light
    /// passes the whole segment. Returned weights are `T / pdf` per channel.
    #[must_use]
    pub fn sample_distance(
        &self,
        t_max: f64,
        channels: Rgb,
        defensive: f64,
        rng: &mut Rng,
    ) -> DistanceSample {
        let flight = Flight::new(self, t_max, channels, defensive);
        let t = if rng.next_f64() < defensive {
            flight.reach.sample(rng.next_f64())
        } else {
            let [u, v] = rng.next_2d();
            let p = flight.probabilities;
            let rate = match u {
                u if u < p.r => flight.rates.r,
                u if u < p.r + p.g => flight.rates.g,
                _ => flight.rates.b,
            };
            -fm::ln(v) / rate
        };
        // A rate of zero gives an infinite distance, which passes even an infinite segment.
        if t < t_max {
            let transmittance = self.transmittance(t);
            let pdf = flight.pdf_given(t, transmittance);
            DistanceSample::Scatter { t, weight: transmittance / pdf, pdf: Some(pdf) }
        } else {
            DistanceSample::Pass { weight: flight.pass_weight(self.coefficients.sigma_t) }
        }
    }

    /// Density per scene unit with which [`Homogeneous::sample_distance`] returns the distance t:
    /// the balance heuristic over channels, `sum_c q_c sigma_c exp(-sigma_c t)` with q the
    /// normalised `channels`, mixed with `defensive` parts of a density that does not depend on
    /// the medium (uniform on finite segments, `s/(s+t)²` with s one mean free path, or one scene
    /// unit in vacuum, on infinite ones).
    #[inline]
    #[must_use]
    pub fn free_flight_pdf(&self, t: f64, t_max: f64, channels: Rgb, defensive: f64) -> f64 {
        Flight::new(self, t_max, channels, defensive).pdf(t)
    }

    /// Probability with which [`Homogeneous::sample_distance`] passes the whole segment.
    #[inline]
    #[must_use]
    pub fn pass_probability(&self, t_max: f64, channels: Rgb, defensive: f64) -> f64 {
        let f = Flight::new(self, t_max, channels, defensive);
        (1.0 - f.defensive) * f.probabilities.dot(f.rates.map(|r| attenuation(r, t_max)))
    }
}

impl From<Homogeneous> for Coefficients {
    fn from(h: Homogeneous) -> Self {
        h.coefficients
    }
}

impl TryFrom<Coefficients> for Homogeneous {
    type Error = MediumError;
    fn try_from(c: Coefficients) -> Result<Self, MediumError> {
        Self::new(c.sigma_t, c.albedo, c.emission)
    }
}

/// Physical range of a coefficient. Albedos from 32-bit files may exceed one by their rounding.
pub(crate) fn check(property: Property, value: Rgb) -> Result<(), MediumError> {
    let (limit, expected) = match property {
        Property::Albedo => (1.0 + 1e-6, "between 0 and 1"),
        _ => (f64::MAX, "finite and not negative"),
    };
    match value.to_array().into_iter().find(|v| !(0.0..=limit).contains(v)) {
        Some(value) => Err(MediumError::OutOfRange { property, value, expected }),
        None => Ok(()),
    }
}

#[inline]
fn attenuation(sigma: f64, t: f64) -> f64 {
    // 0 × inf: light does pass an infinite vacuum.
    if sigma == 0.0 { 1.0 } else { fm::exp(-sigma * t) }
}

/// By channel; grey media, the usual ones, take one exponential.
#[inline]
fn attenuations(sigma: Rgb, t: f64) -> Rgb {
    if sigma.r == sigma.g && sigma.g == sigma.b {
        Rgb::splat(attenuation(sigma.r, t))
    } else {
        sigma.map(|s| attenuation(s, t))
    }
}

/// The density of distances along one segment.
struct Flight {
    rates: Rgb,
    probabilities: Rgb,
    defensive: f64,
    reach: Reach,
    t_max: f64,
}

impl Flight {
    fn new(medium: &Homogeneous, t_max: f64, channels: Rgb, defensive: f64) -> Self {
        let rates = medium.coefficients.sigma_t;
        let fastest = rates.max_channel();
        Self {
            rates,
            probabilities: channel_probabilities(channels, defensive),
            defensive,
            reach: Reach::new(t_max, if fastest > 0.0 { 1.0 / fastest } else { 1.0 }),
            t_max,
        }
    }

    #[inline]
    fn pdf(&self, t: f64) -> f64 {
        self.pdf_given(t, attenuations(self.rates, t))
    }

    /// The same where the transmittance is known.
    #[inline]
    fn pdf_given(&self, t: f64, transmittance: Rgb) -> f64 {
        let flight = self.rates * transmittance;
        (1.0 - self.defensive) * self.probabilities.dot(flight) + self.defensive * self.reach.pdf(t)
    }

    /// `T(t_max) / P(pass)`, with the slowest attenuation divided out of both, so that deep
    /// segments do not end in 0/0. Channels that are not followed get no weight: it could be
    /// infinite, for a throughput of zero.
    fn pass_weight(&self, sigma_t: Rgb) -> Rgb {
        let followed =
            zip(self.rates, self.probabilities, |r, q| if q > 0.0 { r } else { f64::MAX });
        let slowest = f64::min(f64::min(followed.r, followed.g), followed.b);
        let through = |sigma: Rgb| {
            zip(sigma, self.probabilities, |s, q| {
                if q > 0.0 { attenuation(s - slowest, self.t_max) } else { 0.0 }
            })
        };
        let pass = self.probabilities.dot(through(self.rates));
        through(sigma_t) / ((1.0 - self.defensive) * pass)
    }
}
