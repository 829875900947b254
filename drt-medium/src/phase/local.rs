use core::f64::consts::PI;

use drt_math::{Frame, Real, Vec3, fm, vec3};

use super::{henyey_greenstein_cosine, rayleigh_cosine, squared_chord};
use crate::{Flakes, FlakesGradient, Phase, PhaseBlend, PhaseTable, henyey_greenstein, rayleigh};

/// A phase function at one point.
///
/// It is given two unit directions away from the point: `wo`, in which light leaves, and `wi`, from which it comes. With
/// `c = -wo . wi`, light goes straight on where `c = 1`. Swapping both directions changes nothing, so the same numbers serve
/// light paths and camera paths.
///
/// Values are per steradian and integrate to one over the sphere of either direction. Those of SGGX integrate to the
/// [projected area](Flakes::projected_area) in the other direction, by which a medium's extinction depends on direction.
#[derive(Clone, Copy, Debug)]
pub struct LocalPhase<'a> {
    phase: &'a Phase,
    here: Here<'a>,
    /// The point where grids are looked up.
    at: Vec3,
}

/// The kind of a phase function, with the numbers that it has at the point.
#[derive(Clone, Copy, Debug)]
enum Here<'a> {
    HenyeyGreenstein(f64),
    Rayleigh,
    Blend(&'a PhaseBlend, f64),
    Tabulated(&'a PhaseTable),
    Sggx(Flakes),
}

/// Derivatives of a phase function's value at one point and one pair of directions.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PhaseGradient {
    /// With respect to the direction in which light leaves.
    pub wo: Vec3,
    /// With respect to the direction from which it comes.
    pub wi: Vec3,
    /// With respect to the mean cosine of Henyey-Greenstein. The isotropic function counts as its member `g = 0`; the others
    /// have no such parameter: zero.
    pub g: f64,
    /// With respect to the weight of a blend; zero for all others.
    pub weight: f64,
    /// With respect to the matrix of SGGX; zero for all others.
    pub flakes: FlakesGradient,
    /// With respect to the vector of a rotation of the microflakes of SGGX, in radians; zero for all others.
    pub turn: Vec3,
    /// With respect to the point where grids are looked up, as far as they vary there; per scene unit. From
    /// [`Medium::phase_gradient`](crate::Medium::phase_gradient) it is with respect to the point of the world.
    pub place: Vec3,
}

/// What the value of a phase function that depends on the cosine alone changes by.
struct ByCosine {
    cosine: f64,
    g: f64,
    weight: f64,
    place: Vec3,
}

impl<'a> LocalPhase<'a> {
    #[inline]
    pub(crate) fn new(phase: &'a Phase, at: Vec3) -> Self {
        let here = match phase {
            Phase::Isotropic => Here::HenyeyGreenstein(0.0),
            Phase::HenyeyGreenstein { g } => Here::HenyeyGreenstein(*g),
            Phase::HenyeyGreensteinGrid(g) => Here::HenyeyGreenstein(g.value(at).r),
            Phase::Rayleigh => Here::Rayleigh,
            Phase::Blend(blend) => Here::Blend(blend, blend.weight().value(at).r),
            Phase::Tabulated(table) => Here::Tabulated(table),
            Phase::Sggx(field) => Here::Sggx(field.at(at)),
        };
        Self { phase, here, at }
    }

    /// The phase function of the medium.
    #[must_use]
    pub fn phase(&self) -> &'a Phase {
        self.phase
    }

    /// Both parts of a blend at the point.
    #[inline]
    fn parts(&self, blend: &'a PhaseBlend) -> [Self; 2] {
        blend.parts().each_ref().map(|part| Self::new(part, self.at))
    }

    /// The value for light that comes from `wi` and leaves to `wo`.
    #[inline]
    pub fn eval<T: Real>(&self, wo: Vec3<T>, wi: Vec3<T>) -> T {
        match &self.here {
            Here::Sggx(flakes) => flakes.lift().scattered(wo, wi),
            _ => self.by_cosine(-wo.dot(wi)),
        }
    }

    /// The value of one that depends on the cosine alone.
    #[inline(always)]
    fn by_cosine<T: Real>(&self, c: T) -> T {
        match self.here {
            Here::HenyeyGreenstein(0.0) => T::from(0.25 / PI),
            Here::HenyeyGreenstein(g) => henyey_greenstein(T::from(g), c),
            Here::Rayleigh => rayleigh(c),
            Here::Blend(blend, w) => {
                let [a, b] = self.parts(blend).map(|part| part.by_cosine(c));
                a * (1.0 - w) + b * w
            }
            Here::Tabulated(table) => table.eval(c),
            // No part of a blend, and asked by directions.
            Here::Sggx(_) => T::zero(),
        }
    }

    /// Derivatives of [`LocalPhase::eval`].
    #[must_use]
    pub fn gradient(&self, wo: Vec3, wi: Vec3) -> PhaseGradient {
        if let (Here::Sggx(flakes), Phase::Sggx(field)) = (&self.here, self.phase) {
            let (direction, flakes) = flakes.scattered_gradient(wo, wi);
            return PhaseGradient {
                wo: direction,
                wi: direction,
                flakes,
                turn: -(wo + wi).cross(direction),
                place: field.by_place(self.at, &flakes),
                ..PhaseGradient::default()
            };
        }
        let ByCosine { cosine, g, weight, place } = self.gradient_by_cosine(-wo.dot(wi));
        let [wo, wi] = [wi * -cosine, wo * -cosine];
        PhaseGradient { wo, wi, g, weight, place, ..PhaseGradient::default() }
    }

    fn gradient_by_cosine(&self, c: f64) -> ByCosine {
        let of_cosine = |cosine| ByCosine { cosine, g: 0.0, weight: 0.0, place: Vec3::ZERO };
        match self.here {
            Here::HenyeyGreenstein(g) => {
                let s = squared_chord(g, c);
                let cosine = henyey_greenstein(g, c) * 3.0 * g / s;
                let slope = -2.0 * g * s - 3.0 * (1.0 - g) * (1.0 + g) * (g - c);
                let by_g = slope / (4.0 * PI * s * s * fm::sqrt(s));
                let place = match self.phase {
                    Phase::HenyeyGreensteinGrid(grid) => grid.gradient(self.at).r * by_g,
                    _ => Vec3::ZERO,
                };
                ByCosine { g: by_g, place, ..of_cosine(cosine) }
            }
            Here::Rayleigh => of_cosine(3.0 / (8.0 * PI) * c),
            Here::Blend(blend, w) => {
                let parts = self.parts(blend);
                let [p, q] = parts.map(|part| part.by_cosine(c));
                let [a, b] = parts.map(|part| part.gradient_by_cosine(c));
                let rise = blend.weight().gradient(self.at).r;
                ByCosine {
                    cosine: a.cosine * (1.0 - w) + b.cosine * w,
                    g: 0.0,
                    weight: q - p,
                    place: a.place * (1.0 - w) + b.place * w + rise * (q - p),
                }
            }
            Here::Tabulated(table) => of_cosine(table.d_cos(c)),
            Here::Sggx(_) => of_cosine(0.0),
        }
    }

    /// The derivatives of the [projected area](Self::projected_area) for the unit direction `w`, as if that was the one in
    /// which light leaves.
    #[must_use]
    pub fn area_gradient(&self, w: Vec3) -> PhaseGradient {
        let (Here::Sggx(here), Phase::Sggx(field)) = (&self.here, self.phase) else {
            return PhaseGradient::default();
        };
        let (wo, flakes) = (here.area_by_direction(w), here.area_by_matrix(w));
        let place = field.by_place(self.at, &flakes);
        PhaseGradient { wo, flakes, turn: -w.cross(wo), place, ..PhaseGradient::default() }
    }

    /// What the extinction for light along the unit direction `w` is multiplied with: the
    /// [projected area](Flakes::projected_area) of microflakes, and one for other phase functions.
    #[inline]
    #[must_use]
    pub fn projected_area(&self, w: Vec3) -> f64 {
        match &self.here {
            Here::Sggx(flakes) => flakes.projected_area(w),
            _ => 1.0,
        }
    }

    /// The mean cosine `g` where the phase function has that parameter.
    #[inline]
    #[must_use]
    pub fn mean_cosine_parameter(&self) -> Option<f64> {
        match self.here {
            Here::HenyeyGreenstein(g) => Some(g),
            _ => None,
        }
    }

    /// The number that [`Property::G`](crate::Property::G) or [`Property::Weight`](crate::Property::Weight) is at the point; zero
    /// without any.
    pub(crate) fn number(&self) -> f64 {
        match self.here {
            Here::HenyeyGreenstein(number) | Here::Blend(_, number) => number,
            Here::Rayleigh | Here::Tabulated(_) | Here::Sggx(_) => 0.0,
        }
    }

    /// The point where grids are looked up.
    pub(crate) fn looked_up(&self) -> Vec3 {
        self.at
    }

    /// How far it is from even, from 0 to 1: the largest |mean cosine| of the lobes that it is made of, or how much less
    /// than others the smallest axis of microflakes is.
    #[must_use]
    pub fn sharpness(&self) -> f64 {
        match &self.here {
            Here::Rayleigh => 0.0,
            Here::HenyeyGreenstein(g) => Real::abs(*g),
            Here::Blend(blend, _) => {
                self.parts(blend).map(|p| p.sharpness()).into_iter().fold(0.0, f64::max)
            }
            Here::Tabulated(table) => Real::abs(table.mean_cosine()),
            Here::Sggx(flakes) => flakes.sharpness(),
        }
    }

    /// A unit direction of light after scattering that was before it on the way from `from` to the point, and its density per
    /// steradian, which is [`LocalPhase::pdf`]. Both directions are away from the point, and either may be that in which
    /// light leaves; `u` are two uniform numbers in [0, 1).
    #[inline]
    #[must_use]
    pub fn sample(&self, from: Vec3, u: [f64; 2]) -> (Vec3, f64) {
        // Both 1 - c and 1 + c, so that the sine keeps its digits next to the poles.
        let (below, above) = match &self.here {
            Here::HenyeyGreenstein(g) => henyey_greenstein_cosine(*g, u[0]),
            Here::Rayleigh => {
                let c = rayleigh_cosine(u[0]);
                (1.0 - c, 1.0 + c)
            }
            Here::Blend(blend, w) => {
                let (part, first) = blend.choose(*w, u[0]);
                let (to, _) = self.parts(blend)[part].sample(from, [first, u[1]]);
                return (to, self.pdf(from, to));
            }
            Here::Tabulated(table) => {
                let c = table.sample_cosine(u[0]);
                (1.0 - c, 1.0 + c)
            }
            Here::Sggx(flakes) => return flakes.sample(from, u),
        };
        let c = if below < above { 1.0 - below } else { above - 1.0 };
        let s = fm::sqrt(f64::max(0.0, below * above));
        let (sin_phi, cos_phi) = fm::sin_cos(2.0 * PI * u[1]);
        let to = Frame::from_normal(-from).to_world(vec3(s * cos_phi, s * sin_phi, c));
        (to, self.by_cosine(c))
    }

    /// The density of [`LocalPhase::sample`]: the value itself, but for blends in which one part hardly counts, and for
    /// microflakes, of which it is the value over the projected area for `from`.
    #[inline]
    #[must_use]
    pub fn pdf(&self, from: Vec3, to: Vec3) -> f64 {
        match &self.here {
            Here::Sggx(flakes) => flakes.pdf(from, to),
            _ => self.pdf_by_cosine(-from.dot(to)),
        }
    }

    #[inline]
    fn pdf_by_cosine(&self, c: f64) -> f64 {
        match self.here {
            Here::Blend(blend, w) => {
                let [a, b] = self.parts(blend).map(|part| part.pdf_by_cosine(c));
                let w = PhaseBlend::choice(w);
                a * (1.0 - w) + b * w
            }
            _ => self.by_cosine(c),
        }
    }
}
