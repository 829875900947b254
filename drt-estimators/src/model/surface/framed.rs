//! BSDFs that tell directions along the surface apart.
//!
//! Their derivatives are those of dual numbers: by both directions, the normal, and every number that has an entry in
//! [`BsdfParams`]. The channels of a colour share a lane, as no channel of a value depends on another one of it.
//!
//! The tangent t that a frame follows counts by its angle about the normal n alone. Turning both directions, n and t about n
//! together by an angle φ changes nothing, so that what turns t alone is the opposite of what turns the rest:
//!
//! ```text
//! ∂f/∂t = (n × s) / |t - n (n·t)| ∂f/∂φ,      ∂f/∂φ = -(∂f/∂wo · (n × wo) + ∂f/∂wi · (n × wi)),
//! ```
//!
//! with s the unit vector along t in the surface ([`by_corners`]).

use drt_math::{Dual, Real, Rgb, RgbVec, Vec3, vec3};

use crate::model::surface::composed::Composed;
use crate::model::surface::property::Property;
use crate::model::surface::shading_frame::{by_coordinates, shading_frame};
use crate::model::surface::{At, BsdfGradient, BsdfParams, Given};
use crate::model::texture::TexturePoint;

/// A BSDF in the frame of its surface, that of [`shading_frame`]: the normal is along z.
pub(super) trait Framed {
    /// The value times the cosine at the light's direction, with what `number` makes of each number of a property.
    fn value<T: Real>(
        &self,
        number: impl Fn(Property, f64) -> T,
        wo: Vec3<T>,
        wi: Vec3<T>,
    ) -> Rgb<T>;

    /// Draws the direction that `from` is scattered to.
    fn direction(&self, from: Vec3, u: [f64; 3]) -> Option<Vec3>;

    /// The density of that.
    fn density(&self, from: Vec3, to: Vec3) -> f64;

    /// About how wide the narrowest lobe is, in slopes.
    fn narrowest(&self) -> f64;
}

/// First of the lanes of properties, after those of two directions and the normal.
const FIRST: usize = 9;
type Lanes = Dual<f64, { FIRST + BsdfParams::ENTRIES }>;

/// The gradient of a value in the frame of its surface, with respect to the directions, the normal that the frame is about, and
/// properties.
fn gradient_in_frame(at: At<'_>, [wo, wi, n]: [Vec3; 3], bsdf: &impl Framed) -> BsdfGradient {
    let variable = |v: Vec3, first: usize| {
        let [x, y, z] = v.to_array();
        vec3(
            Lanes::variable(x, first),
            Lanes::variable(y, first + 1),
            Lanes::variable(z, first + 2),
        )
    };
    let number = |property, value| match BsdfParams::entry(property) {
        Some(entry) => Lanes::variable(value, FIRST + entry),
        None => Lanes::from(value),
    };
    let frame = shading_frame(at, variable(n, 6));
    let value =
        bsdf.value(number, frame.to_local(variable(wo, 0)), frame.to_local(variable(wi, 3)));
    let lane = |k: usize| value.map(|c| c.eps[k]);
    let by = |first: usize| {
        let axis = |k: usize| lane(first + k);
        axis(0).outer(Vec3::X) + axis(1).outer(Vec3::Y) + axis(2).outer(Vec3::Z)
    };
    let params = BsdfParams::from_entries(core::array::from_fn(|k| lane(FIRST + k)));
    BsdfGradient { value: value.map(|c| c.re), wo: by(0), wi: by(3), n: by(6), params }
}

/// The gradient of a value by the corners of its triangle, as far as these turn the frame about the normal `n`. `others` are the
/// vectors that the value depends on but for the normal and the tangent, with its gradient by each.
///
/// The tangent is (e₁ Δv₂ - e₂ Δv₁) / (Δu₁ Δv₂ - Δu₂ Δv₁), with the sides e and differences of texture coordinates along them.
#[cold]
pub(crate) fn by_corners(at: &TexturePoint<'_>, n: Vec3, others: &[(Vec3, RgbVec)]) -> [RgbVec; 3] {
    let none = [RgbVec::ZERO; 3];
    let Some(texcoords) = &at.mesh.texcoords else { return none };
    let along = by_coordinates(at)[0].reject(n);
    let length2 = along.length_squared();
    let [[u, v], [u1, v1], [u2, v2]] = texcoords[at.triangle as usize];
    let ([u1, v1], [u2, v2]) = ([u1 - u, v1 - v], [u2 - u, v2 - v]);
    let determinant = u1 * v2 - v1 * u2;
    if length2 == 0.0 || determinant == 0.0 {
        return none;
    }
    let by_angle = others.iter().fold(Rgb::ZERO, |sum, (w, by)| sum - by.dot(n.cross(*w)));
    let by_tangent = by_angle.outer(n.cross(along) * (1.0 / (length2 * determinant)));
    [v1 - v2, v2, -v1].map(|share| by_tangent * share)
}

impl<B: Framed> Composed for B {
    fn eval(&self, at: At<'_>, wo: Vec3, wi: Vec3, n: Vec3) -> Rgb {
        let frame = shading_frame(at, n);
        self.value(|_, v| v, frame.to_local(wo), frame.to_local(wi))
    }

    fn gradient(&self, at: At<'_>, wo: Vec3, wi: Vec3, n: Vec3) -> BsdfGradient {
        gradient_in_frame(at, [wo, wi, n], self)
    }

    fn sample(&self, at: At<'_>, from: Vec3, n: Vec3, u: [f64; 3], _: Given) -> Option<Vec3> {
        let frame = shading_frame(at, n);
        Some(frame.to_world(self.direction(frame.to_local(from), u)?))
    }

    fn pdf(&self, at: At<'_>, from: Vec3, to: Vec3, n: Vec3, _: Given) -> f64 {
        let frame = shading_frame(at, n);
        self.density(frame.to_local(from), frame.to_local(to))
    }

    fn lobe_width(&self, _: At<'_>) -> f64 {
        self.narrowest()
    }
}
