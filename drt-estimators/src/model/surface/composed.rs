//! BSDFs that are made of others, or that need more of a point than its normal.

use drt_math::{Rgb, Vec3};

use crate::model::surface::{
    At, Bsdf, BsdfGradient, Given, SpecularSample, SpecularValue, Textured,
};

/// What is asked of such a BSDF. Conventions are those of the methods of [`Bsdf`] of the same names; the normal is that of
/// the side which the first direction is on, where the BSDF is in a two-sided one.
pub(super) trait Composed {
    fn eval(&self, at: At<'_>, wo: Vec3, wi: Vec3, n: Vec3) -> Rgb;

    fn gradient(&self, at: At<'_>, wo: Vec3, wi: Vec3, n: Vec3) -> BsdfGradient;

    fn sample(&self, at: At<'_>, from: Vec3, n: Vec3, u: [f64; 3], given: Given) -> Option<Vec3>;

    fn sample_specular(
        &self,
        _at: At<'_>,
        _from: Vec3,
        _n: Vec3,
        _choice: f64,
        _given: Given,
    ) -> Option<SpecularSample> {
        None
    }

    fn specular(&self, _at: At<'_>, _wo: Vec3, _wi: Vec3, _n: Vec3) -> Option<SpecularValue> {
        None
    }

    fn pdf(&self, at: At<'_>, from: Vec3, to: Vec3, n: Vec3, given: Given) -> f64;

    fn lobe_width(&self, at: At<'_>) -> f64;
}

/// Whether a number of (0, 1) chooses the first of two parts, whose probabilities are given, and the number stretched to
/// (0, 1) again.
pub(super) fn choose(choice: f64, [first, second]: [f64; 2]) -> (bool, f64) {
    // Not 1, which no choice is.
    let most = 1.0 - 0.5 * f64::EPSILON;
    if choice < first {
        (true, (choice / first).min(most))
    } else {
        (false, ((choice - first) / second).clamp(f64::MIN_POSITIVE, most))
    }
}

impl Bsdf {
    /// The direction that [`Bsdf::sample`] draws, without its density.
    pub(super) fn direction(
        &self,
        at: At<'_>,
        from: Vec3,
        n: Vec3,
        u: [f64; 3],
        given: Given,
    ) -> Option<Vec3> {
        self.sample_at(at, from, n, u, given).map(|s| s.w)
    }
}

/// At each point that of its values there.
impl Composed for Textured {
    fn eval(&self, at: At<'_>, wo: Vec3, wi: Vec3, n: Vec3) -> Rgb {
        self.at(at).eval_at(at, wo, wi, n)
    }

    fn gradient(&self, at: At<'_>, wo: Vec3, wi: Vec3, n: Vec3) -> BsdfGradient {
        self.at(at).gradient_at(at, wo, wi, n)
    }

    fn sample(&self, at: At<'_>, from: Vec3, n: Vec3, u: [f64; 3], given: Given) -> Option<Vec3> {
        self.at(at).direction(at, from, n, u, given)
    }

    fn sample_specular(
        &self,
        at: At<'_>,
        from: Vec3,
        n: Vec3,
        choice: f64,
        given: Given,
    ) -> Option<SpecularSample> {
        self.at(at).sample_specular_at(at, from, n, choice, given)
    }

    fn specular(&self, at: At<'_>, wo: Vec3, wi: Vec3, n: Vec3) -> Option<SpecularValue> {
        self.at(at).specular(at, wo, wi, n)
    }

    fn pdf(&self, at: At<'_>, from: Vec3, to: Vec3, n: Vec3, given: Given) -> f64 {
        self.at(at).pdf_at(at, from, to, n, given)
    }

    fn lobe_width(&self, at: At<'_>) -> f64 {
        self.at(at).lobe_width(at)
    }
}
