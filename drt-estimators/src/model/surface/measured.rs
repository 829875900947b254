//! Materials measured on a goniophotometer, as Mitsuba's `measured` has them in its RGB variants.
//!
//! Dupuy & Jakob 2018, "An Adaptive Parameterization for Efficient Material Acquisition and Rendering". Directions of light are told by
//! normals m halfway between them and the viewer's direction o, and these by points of the unit square,
//!
//! ```text
//! x = √(2 θ_m / π),      y = (φ_m + π) / 2π,      dx dy = dm / J,      J = 2π² x sin θ_m.
//! ```
//!
//! With the density V_o of visible normals over this square, tabulated for some o, let s_o(x, y) be what [`Marginal2d`] draws (x, y)
//! by. Then with the tabulated colours c_o(s), density of normals D and projected area σ of microfacets, the value is, as the authors'
//! reader of their files (powitacq) has it,
//!
//! ```text
//! f(o, i) cos θ_i = c_o(s) D(m) / (4 σ(o)).
//! ```
//!
//! Directions are drawn through both maps: s by the luminance L_o(s) of the colours, (x, y) by V_o from that, which gives them the
//! density
//!
//! ```text
//! p(i) = L_o(s) V_o(x, y) / (4 J o·m).
//! ```
//!
//! All tables are linear between their numbers, so values are continuous, with slopes that jump from cell to cell; derivatives are those of
//! dual numbers ([`Framed`]). Three things keep values continuous, too: the two ends of an azimuth are the
//! same direction, and their numbers are taken to be their mean; within 0.06° of the horizon (a cosine of [`HORIZON`]) light
//! fades to none, where a measurement need not; and where o is along the normal, which has no azimuth, the value goes on linearly
//! across it. Azimuths of half a turn or a quarter stand for the others turned or mirrored; where numbers do not fit together there, which
//! s_o makes of a quarter's even if directions do, values jump, and [`Measured::is_continuous`] says so.
//!
//! Reciprocity is as good as the measurement: exchanging both directions looks up other numbers.

mod marginal2d;
mod tables;
mod tabulated;

use alloc::sync::Arc;
use alloc::vec::Vec;
use core::f64::consts::{FRAC_1_PI, FRAC_PI_2, PI, TAU};

use drt_geom::edges::{Lobe, Lobes};
use drt_math::{Real, Rgb, Rng, Vec3, fm, vec3};

use crate::model::surface::framed::{Framed, scatters_in_frame};
use crate::model::surface::lobes::reflection;
use crate::model::surface::measured::marginal2d::{Grid2d, Marginal2d, Mix};
pub use crate::model::surface::measured::tables::{MeasuredError, MeasuredTables, Tensor};
use crate::model::surface::microfacet::mirrored;
use crate::model::surface::model::{Dependence, Flags, Model, Numbers};
use crate::model::surface::params::PropertySet;
use crate::model::surface::property::{Property, Slot, SurfaceError};
use crate::model::surface::{At, BsdfGradient, Given};

/// Cosine below which light fades.
const HORIZON: f64 = 0.001;

/// A sine below which a direction is taken to have no azimuth.
const NO_AZIMUTH: f64 = 1e-9;

/// The part of measured light that is all around.
const AROUND: f64 = 0.3;

/// How far around the normal values are compared to go on across it, in radians.
const ACROSS: f64 = 1e-4;

/// For how many angles of the viewer it is known about how much light returns.
const ALBEDOS: usize = 16;

/// A measured reflector; black from behind. Copies of a scene share it.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(try_from = "MeasuredTables", into = "MeasuredTables"))]
pub struct Measured {
    phi_i: Vec<f32>,
    theta_i: Vec<f32>,
    ndf: Grid2d,
    sigma: Grid2d,
    vndf: Marginal2d,
    luminance: Marginal2d,
    rgb: Grid2d,
    jacobian: bool,
    /// Parts of a turn that the azimuths stand for.
    reduction: Reduction,
    continuous: bool,
    oriented: bool,
    /// About as wide as microfacets of this roughness.
    alpha: f64,
    /// Light that returns, by the viewer's angle with the normal.
    albedo: [f64; ALBEDOS],
}

/// What azimuths of a part of a turn say of the others.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Reduction {
    /// Only the difference of azimuths counts.
    Isotropic,
    None,
    /// Turned by half a turn.
    Half,
    /// Mirrored along and across.
    Quarter,
}

/// Where a pair of directions is in the tables.
struct Place<T> {
    /// The tables that are mixed for the viewer's direction.
    mix: Mix<T>,
    u_o: [T; 2],
    u_m: [T; 2],
    sin_m: T,
    cos_om: T,
}

/// Angles of a direction, θ with the normal and φ about it, and the sine of θ.
fn angles<T: Real>(w: Vec3<T>) -> [T; 3] {
    let (x, y) = (w.x.re(), w.y.re());
    let phi = fm::atan2(y, x);
    let sin2 = w.x.squared() + w.y.squared();
    if sin2.re() < NO_AZIMUTH * NO_AZIMUTH {
        let sin = fm::sqrt(sin2.re());
        return [sin, phi, sin].map(T::from);
    }
    let sin = sin2.sqrt();
    let turned = ((w.y * x - w.x * y) / (w.x * x + w.y * y)).atan();
    [(sin / (w.z + 1.0)).atan() * 2.0, turned + phi, sin]
}

/// The point of the unit square of angles.
fn place<T: Real>(theta: T, phi: T) -> [T; 2] {
    let x = (theta * (2.0 * FRAC_1_PI)).sqrt();
    let y = (phi + PI) / TAU;
    [x, y - fm::floor(y.re())]
}

impl Measured {
    /// Prepares the arrays of a file.
    ///
    /// # Errors
    /// Names the array whose shape or numbers do not make a material.
    pub fn new(tables: MeasuredTables) -> Result<Self, MeasuredError> {
        tables.check()?;
        let MeasuredTables { phi_i, theta_i, ndf, sigma, vndf, luminance, rgb, jacobian } = tables;
        let reduction = Reduction::of(&phi_i)?;
        let grid = |t: Tensor| {
            let [.., rows, columns] = t.shape[..] else { return Grid2d::new([0; 2], t.values) };
            Grid2d::new([rows, columns], t.values)
        };
        let (mut ndf, mut vndf) = (grid(ndf), grid(vndf));
        let (mut luminance, mut rgb) = (grid(luminance), grid(rgb));
        ndf.close_rows();
        for table in [&mut vndf, &mut luminance, &mut rgb] {
            table.close_rows();
            if spans(&phi_i) >= TAU - 1e-3 {
                table.close_slices(phi_i.len());
            }
        }
        let empty = |field| MeasuredError::new(field, "is 0 all over for a direction");
        let mut new = Self {
            ndf,
            sigma: grid(sigma),
            vndf: Marginal2d::new(vndf).ok_or_else(|| empty("vndf"))?,
            luminance: Marginal2d::new(luminance).ok_or_else(|| empty("luminance"))?,
            rgb,
            phi_i,
            theta_i,
            jacobian,
            reduction,
            continuous: true,
            oriented: false,
            alpha: 1.0,
            albedo: [0.0; ALBEDOS],
        };
        new.continuous = new.goes_on_across_ends();
        new.oriented = new.tells_azimuths_apart();
        new.alpha = new.roughness();
        let angle = |k: usize| (k as f64 + 0.5) * FRAC_PI_2 / ALBEDOS as f64;
        new.albedo = core::array::from_fn(|k| new.light_returned(angle(k)));
        Ok(new)
    }

    /// False where numbers for azimuths of a part of a turn do not go on in the next one: by more than a thousandth of
    /// the value on average. Nothing that moves is differentiated there.
    #[must_use]
    pub fn is_continuous(&self) -> bool {
        self.continuous
    }

    /// True where directions along the surface are told apart, by its texture coordinates.
    #[must_use]
    pub fn is_oriented(&self) -> bool {
        self.oriented
    }

    fn tells_azimuths_apart(&self) -> bool {
        let same_rows = |g: &Grid2d| {
            let columns = g.size()[1];
            g.values.chunks_exact(columns).all(|row| row == &g.values[..columns])
        };
        self.reduction != Reduction::Isotropic || self.phi_i.len() > 1 || !same_rows(&self.sigma)
    }

    /// About how much light returns to a direction at a cosine to the normal.
    pub(super) fn albedo(&self, cos: f64) -> f64 {
        let place = fm::acos(cos.clamp(0.0, 1.0)) / FRAC_PI_2 * ALBEDOS as f64;
        self.albedo[usize::min(place as usize, ALBEDOS - 1)]
    }

    /// The pair turned into the part of a turn that there are numbers for; the viewer's direction is first.
    fn reduced<T: Real>(&self, pair: [Vec3<T>; 2]) -> [Vec3<T>; 2] {
        let [x, y] = self.signs(pair[0].re());
        pair.map(|w| vec3(w.x * x, w.y * y, w.z))
    }

    fn signs(&self, o: Vec3) -> [f64; 2] {
        let negative = |v: f64| if v.is_sign_negative() { 1.0 } else { -1.0 };
        match self.reduction {
            Reduction::Isotropic | Reduction::None => [1.0; 2],
            Reduction::Half => [negative(o.y); 2],
            Reduction::Quarter => [negative(o.x), negative(o.y)],
        }
    }

    fn mix<T: Real>(&self, theta: T, phi: T) -> Mix<T> {
        Mix::new([&self.phi_i, &self.theta_i], [phi, theta])
    }

    /// `None` where one of the directions is not in front.
    fn place<T: Real>(&self, pair: [Vec3<T>; 2]) -> Option<Place<T>> {
        let in_front = pair.iter().all(|w| w.z.re() > 0.0);
        let [o, i] = self.reduced(pair);
        let h = o + i;
        if !in_front || h.re().max_abs() < 1e-12 {
            return None;
        }
        let m = h.normalize();
        let [theta_o, phi_o, _] = angles(o);
        let [theta_m, phi_m, sin_m] = angles(m);
        let turned = match self.reduction {
            Reduction::Isotropic => phi_m - phi_o,
            _ => phi_m,
        };
        Some(Place {
            mix: self.mix(theta_o, phi_o),
            u_o: place(theta_o, phi_o),
            u_m: place(theta_m, turned),
            sin_m,
            cos_om: o.dot(m),
        })
    }

    /// The value where the viewer has an azimuth, or with one that is as good as any.
    fn value_at<T: Real>(&self, pair: [Vec3<T>; 2]) -> Rgb<T> {
        let black = Rgb::splat(T::zero());
        let Some(Place { mix, u_o, u_m, .. }) = self.place(pair) else { return black };
        if self.vndf.density(&mix, u_m).re() == 0.0 {
            return black;
        }
        let s = self.vndf.invert(&mix, u_m);
        let mut factor = T::one();
        if self.jacobian {
            let area = self.sigma.eval(&Mix::single(), u_o);
            if area.re() == 0.0 {
                return black;
            }
            factor = self.ndf.eval(&Mix::single(), u_m) / (area * 4.0);
        }
        let cos = pair[1].z;
        if cos.re() < HORIZON {
            factor *= cos / HORIZON;
        }
        let channel = |c| self.rgb.eval(&mix.channel(c, 3), s) * factor;
        Rgb::new(channel(0), channel(1), channel(2))
    }

    /// Compares values on both sides of the azimuths at which numbers end, in pairs of directions at random.
    fn goes_on_across_ends(&self) -> bool {
        let ends: &[f64] = match self.reduction {
            Reduction::Isotropic | Reduction::None => return true,
            Reduction::Half => &[0.0, PI],
            Reduction::Quarter => &[0.0, FRAC_PI_2, PI, 3.0 * FRAC_PI_2],
        };
        let mut rng = Rng::new(0, 0, 0);
        let (mut off, mut sum) = (0.0, 0.0);
        for end in ends {
            for _ in 0..256 {
                let theta = FRAC_PI_2 * rng.next_f64();
                let viewer = |h: f64| direction(theta, end + h);
                let Some(i) = self.draw(viewer(1e-9), [rng.next_f64(), rng.next_f64(), 0.0]) else {
                    continue;
                };
                let [a, b] = [1e-9, -1e-9].map(|h| self.value_at([viewer(h), i]));
                off += (a - b).max_abs();
                sum += a.max_abs();
            }
        }
        off <= 1e-3 * sum
    }

    /// The roughness of microfacets whose visible normals have the greatest density that there is at the steepest view: 1/(π α²).
    fn roughness(&self) -> f64 {
        let grid = self.vndf.grid();
        let mix = self.mix(f64::from(self.theta_i[0]), f64::from(self.phi_i[0]));
        let [rows, columns] = grid.size();
        let mut most = 0.0_f64;
        for column in 1..columns {
            let x = column as f64 / (columns - 1) as f64;
            let jacobian = 2.0 * PI * PI * x * fm::sin(x * x * FRAC_PI_2);
            for row in 0..rows {
                let y = row as f64 / (rows - 1) as f64;
                most = most.max(self.vndf.density(&mix, [x, y]) / jacobian);
            }
        }
        fm::sqrt(FRAC_1_PI / most).clamp(1e-4, 1.0)
    }

    /// The mean over azimuths of the light that returns to a direction.
    fn light_returned(&self, theta: f64) -> f64 {
        let mut rng = Rng::new(1, 0, 0);
        let (mut sum, count) = (0.0, 256);
        for k in 0..count {
            let o = direction(theta, TAU * f64::from(k) / f64::from(count));
            if let Some(i) = self.draw(o, [rng.next_f64(), rng.next_f64(), 0.0]) {
                let density = self.drawn(o, i);
                if density > 0.0 {
                    sum += self.value_at([o, i]).mean() / density;
                }
            }
        }
        sum / f64::from(count)
    }
}

fn direction(theta: f64, phi: f64) -> Vec3 {
    let ((sin, cos), (y, x)) = (fm::sin_cos(theta), fm::sin_cos(phi));
    vec3(x * sin, y * sin, cos)
}

fn spans(phi_i: &[f32]) -> f64 {
    f64::from(phi_i[phi_i.len() - 1]) - f64::from(phi_i[0])
}

impl Reduction {
    fn of(phi_i: &[f32]) -> Result<Self, MeasuredError> {
        if phi_i.len() <= 2 {
            return Ok(Self::Isotropic);
        }
        let parts = TAU / spans(phi_i);
        let near = |n: f64| (parts - n).abs() < 0.02 * n;
        match () {
            () if near(1.0) => Ok(Self::None),
            () if near(2.0) => Ok(Self::Half),
            () if near(4.0) => Ok(Self::Quarter),
            () => Err(MeasuredError::new(
                "phi_i",
                alloc::format!(
                    "spans {} radians; expected a whole turn, a half or a quarter",
                    spans(phi_i)
                ),
            )),
        }
    }
}

impl Measured {
    /// Draws a direction in the frame of the surface.
    fn draw(&self, from: Vec3, u: [f64; 3]) -> Option<Vec3> {
        if from.z <= 0.0 {
            return None;
        }
        let [o, _] = self.reduced([from; 2]);
        let [theta_o, phi_o, _] = angles(o);
        let mix = self.mix(theta_o, phi_o);
        let [x, y] = self.vndf.sample(&mix, self.luminance.sample(&mix, [u[0], u[1]]));
        let from_azimuth = if self.reduction == Reduction::Isotropic { phi_o } else { 0.0 };
        let m = direction(x * x * FRAC_PI_2, (2.0 * y - 1.0) * PI + from_azimuth);
        let to = mirrored(o, m);
        let [x, y] = self.signs(from);
        (to.z > 0.0).then(|| vec3(to.x * x, to.y * y, to.z))
    }

    /// The density with which `draw` draws the direction `to`.
    fn drawn(&self, from: Vec3, to: Vec3) -> f64 {
        let Some(Place { mix, u_m, sin_m, cos_om, .. }) = self.place([from, to]) else {
            return 0.0;
        };
        let s = self.vndf.invert(&mix, u_m);
        let jacobian = 2.0 * PI * PI * u_m[0] * sin_m * 4.0 * cos_om;
        let density = self.luminance.density(&mix, s) * self.vndf.density(&mix, u_m);
        // Finite at the normal, too, a point that nothing is drawn at.
        density / jacobian.max(1e-30)
    }
}

impl Framed for Arc<Measured> {
    fn in_frame<T: Real>(&self, _: impl Numbers<T>, wo: Vec3<T>, wi: Vec3<T>) -> Rgb<T> {
        if wo.z.re() <= 0.0 || wi.z.re() <= 0.0 {
            return Rgb::splat(T::zero());
        }
        if f64::max(wo.x.re().abs(), wo.y.re().abs()) > NO_AZIMUTH {
            return self.value_at([wo, wi]);
        }
        let at = |x: f64, y: f64| {
            let z = fm::sqrt(1.0 - ACROSS * ACROSS);
            self.value_at([vec3(x * ACROSS, y * ACROSS, z).lift(), wi])
        };
        let (x, y) = ([at(1.0, 0.0), at(-1.0, 0.0)], [at(0.0, 1.0), at(0.0, -1.0)]);
        let across = |[a, b]: [Rgb<T>; 2], w: T| (a - b) * (w * (0.5 / ACROSS));
        let mean = (x[0] + x[1] + y[0] + y[1]) * T::from(0.25);
        mean + across(x, wo.x) + across(y, wo.y)
    }

    fn direction(&self, from: Vec3, u: [f64; 3]) -> Option<Vec3> {
        self.as_ref().draw(from, u)
    }

    fn density(&self, from: Vec3, to: Vec3) -> f64 {
        self.as_ref().drawn(from, to)
    }
}

impl Model for Arc<Measured> {
    fn name(&self) -> &'static str {
        "measured"
    }

    #[inline]
    fn flags(&self) -> Flags {
        let (oriented, differentiable) = (self.oriented, self.continuous);
        Flags { oriented, differentiable, ..Flags::REFLECTOR }
    }

    scatters_in_frame!();

    fn slot(&mut self, _: Property) -> Option<Slot<'_>> {
        None
    }

    fn validate(&self) -> Result<(), SurfaceError> {
        Ok(())
    }

    fn lobes(&self, _: At<'_>, wo: Vec3, n: Vec3) -> Lobes {
        let albedo = self.albedo(n.dot(wo));
        let lobe = reflection(wo, n, self.alpha, (1.0 - AROUND) * albedo);
        Lobes::glossy(AROUND * albedo * FRAC_1_PI, [lobe, Lobe::default()])
    }

    fn lobe_width(&self, _: At<'_>) -> f64 {
        self.alpha
    }
}

impl From<Measured> for MeasuredTables {
    fn from(m: Measured) -> Self {
        let leading = [m.phi_i.len(), m.theta_i.len()];
        let tensor = |leading: &[usize], grid: &Grid2d| Tensor {
            shape: [leading, &grid.size()[..]].concat(),
            values: grid.values.clone(),
        };
        Self {
            ndf: tensor(&[], &m.ndf),
            sigma: tensor(&[], &m.sigma),
            vndf: tensor(&leading, m.vndf.grid()),
            luminance: tensor(&leading, m.luminance.grid()),
            rgb: tensor(&[leading[0], leading[1], 3], &m.rgb),
            jacobian: m.jacobian,
            phi_i: m.phi_i,
            theta_i: m.theta_i,
        }
    }
}

impl TryFrom<MeasuredTables> for Measured {
    type Error = MeasuredError;

    fn try_from(tables: MeasuredTables) -> Result<Self, MeasuredError> {
        Self::new(tables)
    }
}
