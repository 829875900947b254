//! Extinction by direction.
//!
//! In a medium of microflakes the extinction along the unit direction w is σ(x) A(x, w), σ being that of the medium's
//! coefficients and A the [projected area](crate::Flakes::projected_area). It is the same for both directions of a line. What
//! scatters at a point is σ a A p = σ a D(h) / 4 ([`LocalPhase::eval`](crate::LocalPhase::eval)), so that vertices of paths need
//! the coefficients without A, and only *distances* know of directions: free flight, transmittance, optical depths, and what
//! the medium emits, σ (1 - a) A e.
//!
//! This file has all of it for values; [`DepthEstimate`](crate::DepthEstimate) has the derivatives. Along one ray the medium
//! is an ordinary field of the extinction σ A, through which [`tracking`](crate::tracking) walks. As S is interpolated between
//! voxels, A² = wᵀ S w lies between its least and its largest value there, which bounds the field on a piece of the ray by
//! the bounds of σ times those of A. Those of A are of all voxels together. In a medium that is the same everywhere, all has
//! the closed forms of [`Homogeneous`].

use core::ops::ControlFlow;

use drt_math::{Rgb, Vec3};

use crate::phase::AreaRange;
use crate::{
    CoefficientGradients, Coefficients, DensityField, Homogeneous, Medium, Piece, Ray, Sggx,
};

/// A medium of microflakes as rays of one direction see it.
#[derive(Debug)]
pub(crate) struct Directed<'a> {
    medium: &'a Medium,
    flakes: &'a Sggx,
    dir: Vec3,
    areas: AreaRange,
}

impl Medium {
    /// What the extinction along the unit direction `w` is at a point, over that of the
    /// [coefficients](Medium::coefficients): the projected area of microflakes, and one in other media.
    #[inline]
    #[must_use]
    pub fn projected_area(&self, x: Vec3, w: Vec3) -> f64 {
        match self.phase.sggx() {
            None => 1.0,
            Some(flakes) => flakes.area(self.phase_place(x), w),
        }
    }

    /// The extinction along the unit direction `w` at a point, in 1 / scene unit.
    #[inline]
    #[must_use]
    pub fn sigma_t_along(&self, x: Vec3, w: Vec3) -> Rgb {
        self.along(self.sigma_t(x), x, w)
    }

    /// The extinction along a unit direction at a point where it is `sigma_t` for the coefficients.
    #[inline]
    pub(crate) fn along(&self, sigma_t: Rgb, x: Vec3, w: Vec3) -> Rgb {
        match self.phase.sggx() {
            None => sigma_t,
            Some(flakes) => sigma_t * flakes.area(self.phase_place(x), w),
        }
    }

    /// The medium as rays along the unit direction `dir` see it, where that depends on the direction.
    #[inline]
    pub(crate) fn directed(&self, dir: Vec3) -> Option<Directed<'_>> {
        let flakes = self.phase.sggx()?;
        Some(Directed { medium: self, flakes, dir, areas: flakes.area_range(dir) })
    }
}

impl Directed<'_> {
    /// The homogeneous medium that has the same extinction along the direction, where there is one.
    pub(crate) fn even(&self) -> Option<Homogeneous> {
        let even = self.medium.even_extinction().filter(|_| !self.flakes.varies())?;
        let c = even.coefficients();
        let sigma_t = c.sigma_t * self.flakes.area(Vec3::ZERO, self.dir);
        Some(Homogeneous { coefficients: Coefficients { sigma_t, ..c } })
    }

    fn pass(&self, piece: &Piece) -> Piece {
        let AreaRange { least, largest, mean } = self.areas;
        // A negative extinction is the farther from zero the larger the area.
        let minorant = piece.minorant.map(|m| m * if m < 0.0 { largest } else { least });
        let majorant = piece.majorant * largest;
        Piece { majorant, minorant, mean: piece.mean * mean, ..*piece }
    }
}

impl DensityField for Directed<'_> {
    fn coefficients(&self, x: Vec3) -> Coefficients {
        let c = self.medium.coefficients(x);
        Coefficients { sigma_t: c.sigma_t * self.medium.projected_area(x, self.dir), ..c }
    }

    fn sigma_t(&self, x: Vec3) -> Rgb {
        self.medium.sigma_t_along(x, self.dir)
    }

    fn gradients(&self, x: Vec3) -> CoefficientGradients {
        let g = self.medium.gradients(x);
        let phase = self.medium.phase_at(x);
        let area = self.medium.in_world(x, phase.area_gradient(self.dir)).place;
        let by_area = self.medium.sigma_t(x).outer(area);
        CoefficientGradients { sigma_t: g.sigma_t * phase.projected_area(self.dir) + by_area, ..g }
    }

    fn pieces(&self, ray: &Ray, visit: &mut dyn FnMut(&Piece) -> ControlFlow<()>) {
        self.medium.kind.field().pieces(ray, &mut |piece| visit(&self.pass(piece)));
    }

    fn means(&self, ray: &Ray, visit: &mut dyn FnMut(&Piece) -> ControlFlow<()>) {
        self.medium.kind.field().means(ray, &mut |piece| visit(&self.pass(piece)));
    }

    fn covered(&self, ray: &Ray) -> Option<(f64, f64)> {
        self.medium.kind.field().covered(ray)
    }

    fn majorant_floor(&self) -> f64 {
        let own = self.medium.kind.field().majorant_floor();
        if own > 0.0 { own } else { self.flakes.extent().map_or(0.0, f64::recip) }
    }

    fn feature_size(&self) -> f64 {
        f64::min(self.medium.kind.field().feature_size(), self.flakes.feature_size())
    }
}

/// A homogeneous medium without a boundary.
impl DensityField for Homogeneous {
    fn coefficients(&self, _: Vec3) -> Coefficients {
        self.coefficients
    }

    fn gradients(&self, _: Vec3) -> CoefficientGradients {
        CoefficientGradients::ZERO
    }

    fn pieces(&self, ray: &Ray, visit: &mut dyn FnMut(&Piece) -> ControlFlow<()>) {
        let (mean, end) = (self.coefficients.sigma_t, ray.t_max);
        let majorant = mean.abs();
        // The visitor has nothing left to see in any case.
        let _ = visit(&Piece { start: 0.0, end, majorant, minorant: mean, mean });
    }
}
