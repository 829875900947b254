//! BSDFs that tell directions along the surface apart.
//!
//! The tangent t that a frame follows counts by its angle about the normal n alone. Turning both directions, n and t about n
//! together by an angle φ changes nothing, so that what turns t alone is the opposite of what turns the rest:
//!
//! ```text
//! ∂f/∂t = (n × s) / |t - n (n·t)| ∂f/∂φ,      ∂f/∂φ = -(∂f/∂wo · (n × wo) + ∂f/∂wi · (n × wi)),
//! ```
//!
//! with s the unit vector along t in the surface ([`by_corners`]).

use drt_math::{Real, Rgb, RgbVec, Vec3};

use crate::model::surface::At;
use crate::model::surface::model::{Model, Numbers};
use crate::model::surface::shading_frame::{by_coordinates, shading_frame};
use crate::model::texture::TexturePoint;

/// A model in the frame of its surface, that of [`shading_frame`]: the normal is along z.
pub(super) trait Framed: Model {
    /// The value times the cosine at the light's direction, over any scalar.
    fn in_frame<T: Real>(&self, numbers: impl Numbers<T>, wo: Vec3<T>, wi: Vec3<T>) -> Rgb<T>;

    /// Draws the direction that `from` is scattered to.
    fn direction(&self, from: Vec3, u: [f64; 3]) -> Option<Vec3>;

    /// The density with which `direction` draws the direction `to`.
    fn density(&self, from: Vec3, to: Vec3) -> f64;
}

/// The methods by which a [`Model`] that is [`Framed`] answers: its derivatives are those of dual numbers. The arguments are the
/// properties that the value is differentiated by; a model that finds them otherwise gives the largest number of them. A file that uses
/// this imports the types that these methods have in [`Model`].
macro_rules! scatters_in_frame {
    ($($property:ident),*) => {
        #[inline]
        fn differentiated(&self) -> PropertySet {
            const { PropertySet::new(&[$(Property::$property),*]) }
        }

        $crate::model::surface::framed::scatters_in_frame!(
            at most <[Property]>::len(&[$(Property::$property),*])
        );
    };
    (at most $properties:expr) => {
        #[inline]
        fn dependence(&self) -> Dependence {
            Dependence::Frame
        }

        #[inline(never)]
        fn value<T: Real>(
            &self,
            numbers: impl Numbers<T>,
            at: At<'_>,
            directions: [Vec3<T>; 3],
        ) -> Rgb<T> {
            $crate::model::surface::framed::value(self, numbers, at, directions)
        }

        #[inline(never)]
        fn gradient(&self, at: At<'_>, wo: Vec3, wi: Vec3, n: Vec3) -> BsdfGradient {
            use $crate::model::surface::model::{COORDINATES, by_duals};
            by_duals::<{ COORDINATES + $properties }>(
                self.differentiated(),
                [wo, wi, n],
                |numbers, directions| {
                    $crate::model::surface::framed::value(self, numbers, at, directions)
                },
            )
        }

        fn sample(&self, at: At<'_>, from: Vec3, n: Vec3, u: [f64; 3], _: Given) -> Option<Vec3> {
            $crate::model::surface::framed::sample(self, at, from, n, u)
        }

        fn pdf(&self, at: At<'_>, from: Vec3, to: Vec3, n: Vec3, _: Given) -> f64 {
            $crate::model::surface::framed::pdf(self, at, from, to, n)
        }
    };
}

pub(super) use scatters_in_frame;

/// The value of a model in the frame that a point has.
#[inline(always)]
pub(super) fn value<T: Real>(
    model: &impl Framed,
    numbers: impl Numbers<T>,
    at: At<'_>,
    [wo, wi, n]: [Vec3<T>; 3],
) -> Rgb<T> {
    let frame = shading_frame(at, n);
    model.in_frame(numbers, frame.to_local(wo), frame.to_local(wi))
}

/// Draws a direction in that frame.
#[inline(never)]
pub(super) fn sample(
    model: &impl Framed,
    at: At<'_>,
    from: Vec3,
    n: Vec3,
    u: [f64; 3],
) -> Option<Vec3> {
    let frame = shading_frame(at, n);
    Some(frame.to_world(model.direction(frame.to_local(from), u)?))
}

/// The density with which `sample` draws the direction `to`.
#[inline(never)]
pub(super) fn pdf(model: &impl Framed, at: At<'_>, from: Vec3, to: Vec3, n: Vec3) -> f64 {
    let frame = shading_frame(at, n);
    model.density(frame.to_local(from), frame.to_local(to))
}

/// The gradient of a value by the corners of its triangle, as far as these turn the frame about the normal `n`. `others` are the
/// vectors that the value depends on but for the normal and the tangent, with its gradient by each.
#[cold]
pub(super) fn by_corners(at: &TexturePoint<'_>, n: Vec3, others: &[(Vec3, RgbVec)]) -> [RgbVec; 3] {
    let along = by_coordinates(at)[0].reject(n);
    if along.length_squared() == 0.0 {
        return [RgbVec::ZERO; 3];
    }
    of_corners(at, [by_tangent(n, along, others), RgbVec::ZERO])
}

/// The gradient of a value by the tangent that its frame follows, which is across the normal `n`; `others` as of [`by_corners`].
pub(super) fn by_tangent(n: Vec3, tangent: Vec3, others: &[(Vec3, RgbVec)]) -> RgbVec {
    let by_angle = others.iter().fold(Rgb::ZERO, |sum, (w, by)| sum - by.dot(n.cross(*w)));
    by_angle.outer(n.cross(tangent) * tangent.length_squared().recip())
}

/// The gradient of a value by the corners of its triangle, from those by the two vectors of [`by_coordinates`]. With the sides e of the triangle and the differences
/// of texture coordinates along them, these are (e₁ Δv₂ - e₂ Δv₁) / D and (e₂ Δu₁ - e₁ Δu₂) / D, D = Δu₁ Δv₂ - Δu₂ Δv₁.
pub(super) fn of_corners(at: &TexturePoint<'_>, [by_u, by_v]: [RgbVec; 2]) -> [RgbVec; 3] {
    let Some(texcoords) = &at.mesh.texcoords else { return [RgbVec::ZERO; 3] };
    let [[u, v], [u1, v1], [u2, v2]] = texcoords[at.triangle as usize];
    let ([u1, v1], [u2, v2]) = ([u1 - u, v1 - v], [u2 - u, v2 - v]);
    let determinant = u1 * v2 - v1 * u2;
    if determinant == 0.0 {
        return [RgbVec::ZERO; 3];
    }
    let second = (by_u * v2 - by_v * u2) * determinant.recip();
    let third = (by_v * u1 - by_u * v1) * determinant.recip();
    [-second - third, second, third]
}
