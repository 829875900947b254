use core::f64::consts::PI;

use drt_math::{Frame, Mat3, Real, Vec3, fm, vec3};

use super::{henyey_greenstein_cosine, rayleigh_cosine, squared_chord};
use crate::{Phase, PhaseBlend, PhaseTable, henyey_greenstein, rayleigh};

/// A phase function at one point.
///
/// Every cosine here is `c = w' . w` between the incoming and the outgoing direction of light
/// *flow*: `c = 1` goes straight on. Values are per steradian and integrate to one over the
/// sphere. Swapping or reversing both directions leaves `c` unchanged, so the same numbers serve
/// light paths and camera paths.
#[derive(Clone, Copy, Debug)]
pub struct LocalPhase<'a> {
    phase: &'a Phase,
    here: Here<'a>,
    /// The point where grids are looked up, and its derivative by the point of the world.
    at: Vec3,
    slope: Mat3,
}

/// The kind of a phase function, with the number that it has at the point.
#[derive(Clone, Copy, Debug)]
enum Here<'a> {
    HenyeyGreenstein(f64),
    Rayleigh,
    Blend(&'a PhaseBlend, f64),
    Tabulated(&'a PhaseTable),
}

/// Derivatives of a phase function's value at one point and one pair of directions.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PhaseGradient {
    /// With respect to the cosine between the directions.
    pub cosine: f64,
    /// With respect to the mean cosine of Henyey-Greenstein. The isotropic function counts as its member `g = 0`; the others
    /// have no such parameter: zero.
    pub g: f64,
    /// With respect to the weight of a blend; zero for all others.
    pub weight: f64,
    /// With respect to the point, as far as grids vary there; per scene unit.
    pub place: Vec3,
}

impl<'a> LocalPhase<'a> {
    #[inline]
    pub(crate) fn new(phase: &'a Phase, at: Vec3, slope: Mat3) -> Self {
        let here = match phase {
            Phase::Isotropic => Here::HenyeyGreenstein(0.0),
            Phase::HenyeyGreenstein { g } => Here::HenyeyGreenstein(*g),
            Phase::HenyeyGreensteinGrid(g) => Here::HenyeyGreenstein(g.value(at).r),
            Phase::Rayleigh => Here::Rayleigh,
            Phase::Blend(blend) => Here::Blend(blend, blend.weight().value(at).r),
            Phase::Tabulated(table) => Here::Tabulated(table),
        };
        Self { phase, here, at, slope }
    }

    /// The phase function of the medium.
    #[must_use]
    pub fn phase(&self) -> &'a Phase {
        self.phase
    }

    /// Both parts of a blend at the point.
    #[inline]
    fn parts(&self, blend: &'a PhaseBlend) -> [Self; 2] {
        blend.parts().each_ref().map(|part| Self::new(part, self.at, self.slope))
    }

    /// Density per steradian at a flow cosine.
    #[inline]
    pub fn eval<T: Real>(&self, c: T) -> T {
        match self.here {
            Here::HenyeyGreenstein(0.0) => T::from(0.25 / PI),
            Here::HenyeyGreenstein(g) => henyey_greenstein(T::from(g), c),
            Here::Rayleigh => rayleigh(c),
            Here::Blend(blend, w) => {
                let [a, b] = self.parts(blend).map(|part| part.eval(c));
                a * (1.0 - w) + b * w
            }
            Here::Tabulated(table) => table.eval(c),
        }
    }

    /// Derivatives of [`LocalPhase::eval`].
    #[must_use]
    pub fn gradient(&self, c: f64) -> PhaseGradient {
        let of_cosine = |cosine| PhaseGradient { cosine, ..PhaseGradient::default() };
        match self.here {
            Here::HenyeyGreenstein(g) => {
                let s = squared_chord(g, c);
                let cosine = henyey_greenstein(g, c) * 3.0 * g / s;
                let slope = -2.0 * g * s - 3.0 * (1.0 - g) * (1.0 + g) * (g - c);
                let by_g = slope / (4.0 * PI * s * s * fm::sqrt(s));
                let place = match self.phase {
                    Phase::HenyeyGreensteinGrid(grid) => {
                        self.slope.transpose_mul(grid.gradient(self.at).r) * by_g
                    }
                    _ => Vec3::ZERO,
                };
                PhaseGradient { g: by_g, place, ..of_cosine(cosine) }
            }
            Here::Rayleigh => of_cosine(3.0 / (8.0 * PI) * c),
            Here::Blend(blend, w) => {
                let parts = self.parts(blend);
                let [p, q] = parts.map(|part| part.eval(c));
                let [a, b] = parts.map(|part| part.gradient(c));
                let rise = self.slope.transpose_mul(blend.weight().gradient(self.at).r);
                PhaseGradient {
                    cosine: a.cosine * (1.0 - w) + b.cosine * w,
                    g: 0.0,
                    weight: q - p,
                    place: a.place * (1.0 - w) + b.place * w + rise * (q - p),
                }
            }
            Here::Tabulated(table) => of_cosine(table.d_cos(c)),
        }
    }

    /// The mean cosine `g` where the phase function has that parameter.
    #[inline]
    #[must_use]
    pub fn mean_cosine_parameter(&self) -> Option<f64> {
        match self.here {
            Here::HenyeyGreenstein(g) => Some(g),
            Here::Rayleigh | Here::Blend(..) | Here::Tabulated(_) => None,
        }
    }

    /// The number that [`Property::G`](crate::Property::G) or [`Property::Weight`](crate::Property::Weight) is at the point; zero
    /// without any.
    pub(crate) fn number(&self) -> f64 {
        match self.here {
            Here::HenyeyGreenstein(number) | Here::Blend(_, number) => number,
            Here::Rayleigh | Here::Tabulated(_) => 0.0,
        }
    }

    /// The point where grids are looked up.
    pub(crate) fn looked_up(&self) -> Vec3 {
        self.at
    }

    /// How far it is from even, from 0 to 1: the largest |mean cosine| of the lobes that it is made of.
    #[must_use]
    pub fn sharpness(&self) -> f64 {
        match self.here {
            Here::Rayleigh => 0.0,
            Here::HenyeyGreenstein(g) => Real::abs(g),
            Here::Blend(blend, _) => {
                self.parts(blend).map(|p| p.sharpness()).into_iter().fold(0.0, f64::max)
            }
            Here::Tabulated(table) => Real::abs(table.mean_cosine()),
        }
    }

    /// A flow direction after scattering, and its density per steradian, which is [`LocalPhase::pdf`]. `flow` is the unit
    /// direction before; `u` are two uniform numbers in [0, 1).
    #[inline]
    #[must_use]
    pub fn sample(&self, flow: Vec3, u: [f64; 2]) -> (Vec3, f64) {
        // Both 1 - c and 1 + c, so that the sine keeps its digits next to the poles.
        let (below, above) = match self.here {
            Here::HenyeyGreenstein(g) => henyey_greenstein_cosine(g, u[0]),
            Here::Rayleigh => {
                let c = rayleigh_cosine(u[0]);
                (1.0 - c, 1.0 + c)
            }
            Here::Blend(blend, w) => {
                let (part, first) = blend.choose(w, u[0]);
                let (w, _) = self.parts(blend)[part].sample(flow, [first, u[1]]);
                return (w, self.pdf(flow.dot(w)));
            }
            Here::Tabulated(table) => {
                let c = table.sample_cosine(u[0]);
                (1.0 - c, 1.0 + c)
            }
        };
        let c = if below < above { 1.0 - below } else { above - 1.0 };
        let s = fm::sqrt(f64::max(0.0, below * above));
        let (sin_phi, cos_phi) = fm::sin_cos(2.0 * PI * u[1]);
        let w = Frame::from_normal(flow).to_world(vec3(s * cos_phi, s * sin_phi, c));
        (w, self.eval(c))
    }

    /// The density of [`LocalPhase::sample`] at a flow cosine: the value itself, but for blends in which one part hardly counts.
    #[inline]
    #[must_use]
    pub fn pdf(&self, c: f64) -> f64 {
        match self.here {
            Here::Blend(blend, w) => {
                let [a, b] = self.parts(blend).map(|part| part.pdf(c));
                let w = PhaseBlend::choice(w);
                a * (1.0 - w) + b * w
            }
            _ => self.eval(c),
        }
    }
}
