//! BSDFs that tell directions along the surface apart.

use drt_math::{Dual, Real, Rgb, Vec3, vec3};

use crate::model::surface::composed::Composed;
use crate::model::surface::shading_frame::shading_frame;
use crate::model::surface::{At, BsdfGradient, BsdfParams, Given};

/// A BSDF in the frame of its surface, that of [`shading_frame`]: the normal is along z.
pub(super) trait Framed {
    /// The value times the cosine at the light's direction.
    fn value<T: Real>(&self, wo: Vec3<T>, wi: Vec3<T>) -> Rgb<T>;

    /// Draws the direction that `from` is scattered to.
    fn direction(&self, from: Vec3, u: [f64; 3]) -> Option<Vec3>;

    /// The density of that.
    fn density(&self, from: Vec3, to: Vec3) -> f64;

    /// About how wide the narrowest lobe is, in slopes.
    fn narrowest(&self) -> f64;
}

/// The gradient of a value in the frame of its surface, with respect to the directions and the normal that the frame is about.
fn gradient_in_frame(
    at: At<'_>,
    [wo, wi, n]: [Vec3; 3],
    value: impl FnOnce(Vec3<Dual<f64, 9>>, Vec3<Dual<f64, 9>>) -> Rgb<Dual<f64, 9>>,
) -> BsdfGradient {
    let variable = |v: Vec3, first: usize| {
        let [x, y, z] = v.to_array();
        vec3(Dual::variable(x, first), Dual::variable(y, first + 1), Dual::variable(z, first + 2))
    };
    let frame = shading_frame(at, variable(n, 6));
    let value = value(frame.to_local(variable(wo, 0)), frame.to_local(variable(wi, 3)));
    let by = |first: usize| {
        let axis = |k: usize| value.map(|c| c.eps[first + k]);
        axis(0).outer(Vec3::X) + axis(1).outer(Vec3::Y) + axis(2).outer(Vec3::Z)
    };
    let params = BsdfParams::default();
    BsdfGradient { value: value.map(|c| c.re), wo: by(0), wi: by(3), n: by(6), params }
}

impl<B: Framed> Composed for B {
    fn eval(&self, at: At<'_>, wo: Vec3, wi: Vec3, n: Vec3) -> Rgb {
        let frame = shading_frame(at, n);
        self.value(frame.to_local(wo), frame.to_local(wi))
    }

    fn gradient(&self, at: At<'_>, wo: Vec3, wi: Vec3, n: Vec3) -> BsdfGradient {
        gradient_in_frame(at, [wo, wi, n], |wo, wi| self.value(wo, wi))
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
