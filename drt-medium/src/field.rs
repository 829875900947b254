use core::fmt::Debug;
use core::ops::ControlFlow;

use drt_math::{Ray, Rgb, Vec3};

use crate::{CoefficientGradients, Coefficients};

/// A stretch of a ray with bounds of the extinction on it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Piece {
    /// Distance where it starts.
    pub start: f64,
    /// Distance where it ends.
    pub end: f64,
    /// At least the extinction, everywhere on the piece (its magnitude, where it is negative).
    pub majorant: Rgb,
    /// At most the extinction, everywhere on the piece. The tighter, the fewer lookups a
    /// transmittance needs; zero is always allowed.
    pub minorant: Rgb,
    /// Roughly the mean extinction on the piece; only steers sampling, any value is correct.
    pub mean: Rgb,
}

/// A spatially varying medium that the functions of [`tracking`](crate::tracking) can walk through.
///
/// Implement it for a field of your own to use delta and ratio tracking inside your own loop.
pub trait DensityField: Debug + Send + Sync {
    /// Everything at a point.
    fn coefficients(&self, x: Vec3) -> Coefficients;

    /// The extinction at a point.
    #[inline]
    fn sigma_t(&self, x: Vec3) -> Rgb {
        self.coefficients(x).sigma_t
    }

    /// Spatial gradients at a point, for the derivatives of moving ray points.
    fn gradients(&self, x: Vec3) -> CoefficientGradients;

    /// Shows the ray's pieces in increasing order of distance, without overlap, until `visit`
    /// breaks. What is left out is empty. Extinction above a majorant makes estimates wrong, so
    /// a bound must hold on the whole piece.
    fn pieces(&self, ray: &Ray, visit: &mut dyn FnMut(&Piece) -> ControlFlow<()>);

    /// Shows stretches that cover the ray's [`pieces`](Self::pieces) in the same way, of which only the ends and the means
    /// are used. These may be longer where bounds need short pieces and means do not.
    fn means(&self, ray: &Ray, visit: &mut dyn FnMut(&Piece) -> ControlFlow<()>) {
        self.pieces(ray, visit);
    }

    /// From where to where the ray's pieces reach; `None` without any.
    fn covered(&self, ray: &Ray) -> Option<(f64, f64)> {
        let mut covered: Option<(f64, f64)> = None;
        self.pieces(ray, &mut |piece| {
            covered = Some((covered.map_or(piece.start, |c| c.0), piece.end));
            ControlFlow::Continue(())
        });
        covered
    }

    /// The least majorant, in 1 / scene unit, used on the pieces when distances are sampled
    /// defensively, so that vertices also fall where the field is zero now. One over the field's
    /// size is a good value; zero: no vertices there.
    fn majorant_floor(&self) -> f64 {
        0.0
    }

    /// A length over which the field varies, for choosing how many points resolve it on a line;
    /// only steers sampling.
    fn feature_size(&self) -> f64 {
        f64::INFINITY
    }
}
